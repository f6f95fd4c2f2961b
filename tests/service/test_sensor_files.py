"""Answers at sensors in files of other programs: points for ParaView, and folders of results as Honeybee reads them."""
import json
import os
import pathlib
import unittest
import xml.etree.ElementTree

import numpy as np

from case import Case
from command import must
from weather import a_year, epw, parts, wea

SETS = {"points": [{"name": "desk 1/a", "at": [[1, 1, .8], [3, 1, .8]], "normal": [0, 0, 1]},
                   {"name": "desk 1_a", "at": [[2, 3, 1.2]], "normal": [1, 0, 0]},
                   {"name": "below", "at": [[2, 2, -1]], "normal": [0, 0, 1]}]}


def autonomy(folder, limit, hours=8760):
    """The share of the hours with at least `limit` of each sensor, as a reader of Honeybee's results finds it."""
    folder, found = pathlib.Path(folder), {}
    begins = np.loadtxt(folder / "sun-up-hours.txt")
    occupied = np.ones(hours, bool)
    of_hours = occupied[begins.astype(int)]
    for grid in json.loads((folder / "grids_info.json").read_text()):
        values = np.loadtxt(folder / f"{grid['full_id']}.ill", ndmin=2)
        assert values.shape == (grid["count"], len(begins))
        found[grid["name"]] = (values[:, of_hours] >= limit).sum(1) / occupied.sum()
    return found


class SensorFiles(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.kept = pathlib.Path(cls.shared.name)
        (cls.kept / "yard.obj").write_text(
            "".join(f"v {x} {y} {z}\n" for z in (0, 3) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))) +
            "f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n")
        (cls.kept / "s.json").write_text(json.dumps(SETS))
        (cls.kept / "year.wea").write_text(wea(a_year()))
        cls.yard = cls.kept / "yard.h5"
        must("precompute", cls.kept / "yard.obj", "--elements", 100, "--reflectance", .5, "--lights", "lm", "--sky", "tregenza",
             "--sensors", cls.kept / "s.json", "--method", "exact", "--probes", 0, "-o", cls.yard)
        cls.of_year = ("solve", cls.yard, "--weather", cls.kept / "year.wea", "--sensors", "all")

    def test_the_hours_of_a_year_have_its_autonomy(self):
        exact = "--sun", "exact", "--sun-points", 64  # the same rays for hours and for the year
        must(*self.of_year, *exact, "-o", self.path("year/"))
        found = autonomy(self.path("year"), 5000)
        must(*self.of_year, *exact, "--annual", "autonomy=5000", "-o", self.path("year.json"))
        with open(self.path("year.json"), encoding="utf-8") as file:
            sets = json.load(file)["sensors"]
        self.assertEqual([one["name"] for one in sets], list(found))
        for one in sets:
            stated = np.array(one["values"][0], float)
            if one["name"] == "below":
                self.assertTrue(np.isnan(stated).all())
                continue
            # hours within a rounding of the limit may fall to either side
            np.testing.assert_allclose(found[one["name"]], stated, atol=2.5 / 8760)
            self.assertGreater(stated.min(), .05)
            self.assertLess(stated.max(), .6)

    def test_names_and_hours_are_those_of_sets_and_rows(self):
        must(*self.of_year, "-o", self.path("year/"))
        self.assertEqual(sorted(os.listdir(self.path("year"))),
                         ["below.ill", "desk_1_a.ill", "desk_1_a_2.ill", "grids_info.json", "sun-up-hours.txt"])
        hours = pathlib.Path(self.path("year/sun-up-hours.txt")).read_text().split()
        lit = [k for k, (_, _, _, direct, diffuse) in enumerate(a_year()) if direct + diffuse > 0]
        # The whole hour at which each row begins. Hours whose direct light comes from below the horizon are dark.
        self.assertLessEqual(set(hours), {f"{k}.0" for k in lit})
        self.assertGreater(len(hours), .98 * len(lit))
        below = np.loadtxt(self.path("year/below.ill"))
        self.assertTrue(np.isnan(below).all())
        must(*self.of_year, "-o", self.path("year.npy"))
        every = np.load(self.path("year.npy"))
        np.testing.assert_allclose(np.loadtxt(self.path("year/desk_1_a.ill")), every[[int(float(h)) for h in hours]][:, :2].T,
                                   rtol=1e-6)

    def test_parts_of_hours_and_leap_years(self):
        rows = [row for row in a_year() if row[0] in (2, 3) and (row[0], row[1]) in ((2, 28), (3, 1))]
        leap = rows[:24] + [(2, 29, *row[2:]) for row in rows[:24]] + rows[24:]
        halves = epw(parts(rows[24:], 2), step=.5, periods=" 3/ 1, 3/ 1", stated=2)
        for name, text, day in (("w.epw", halves, 59), ("w.wea", wea(leap), 58)):
            pathlib.Path(self.path(name)).write_text(text)
            must("solve", self.yard, "--weather", self.path(name), "--sensors", "below,desk 1/a", "-o", self.path("some/"))
            hours = np.loadtxt(self.path("some/sun-up-hours.txt"))
            self.assertEqual(int(hours[0] // 24), day)
            self.assertAlmostEqual(np.diff(hours).min(), .5 if name == "w.epw" else 1)
        self.assertEqual(int(hours[-1] // 24), 60)

    def test_one_light_is_one_number_a_line(self):
        light = ("solve", self.yard, "--sky", "overcast", "--lux-outside", 10000, "--sensors", "all")
        must(*light, "-o", self.path("noon/"))
        must(*light, "-o", self.path("noon.npy"))
        self.assertEqual(sorted(os.listdir(self.path("noon"))), ["below.res", "desk_1_a.res", "desk_1_a_2.res", "grids_info.json"])
        np.testing.assert_allclose(np.loadtxt(self.path("noon/desk_1_a.res")), np.load(self.path("noon.npy"))[:2], rtol=1e-6)

    def test_points_for_paraview(self):
        light = ("solve", self.yard, "--sky", "overcast", "--lux-outside", 10000, "--sensors", "all")
        must(*light, "-o", self.path("p.vtu"))
        must(*light, "-o", self.path("p.npy"))
        piece = xml.etree.ElementTree.parse(self.path("p.vtu")).find("UnstructuredGrid/Piece")
        arrays = {a.get("Name"): np.array(a.text.split(), float) for a in piece.iter("DataArray")}
        np.testing.assert_allclose(arrays["irradiance"], np.load(self.path("p.npy"))[:3], rtol=1e-6)
        np.testing.assert_array_equal(arrays["Points"].reshape(-1, 3), [[1, 1, .8], [3, 1, .8], [2, 3, 1.2]])
        np.testing.assert_array_equal(arrays["normal"].reshape(-1, 3), [[0, 0, 1], [0, 0, 1], [1, 0, 0]])
        np.testing.assert_array_equal(arrays["set"], [0, 0, 1])
        try:
            from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
            from vtkmodules.util.numpy_support import vtk_to_numpy
        except ImportError:
            return
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(self.path("p.vtu"))
        reader.Update()
        read = reader.GetOutput()
        self.assertEqual((read.GetNumberOfPoints(), read.GetNumberOfCells()), (3, 3))
        np.testing.assert_allclose(vtk_to_numpy(read.GetPointData().GetArray("irradiance")), arrays["irradiance"], rtol=1e-6)

    def test_refusals(self):
        np.save(self.path("L.npy"), np.ones((3, 145), "<f4"))
        self.failed("of a batch are those of --weather", "solve", self.yard, "--sky", self.path("L.npy"), "--sensors", "all", "-o",
                    self.path("x/"))
        self.refused(2, "figures of --annual", *self.of_year, "--annual", "sum", "-o", self.path("x/"))
        self.refused(2, "or into a folder, NAME/", *self.of_year, "-o", self.path("x.ill"))
        self.refused(1, "it is a file", *self.of_year, "-o", f"{self.kept}/s.json/")
        self.refused(1, "make the directory", *self.of_year, "-o", self.path("a/b/"))
        self.refused(2, "must end in", "solve", self.yard, "--sky", "overcast", "-o", self.path("x/"))
        self.assertFalse(os.path.exists(self.path("x")))


if __name__ == "__main__":
    unittest.main()
