"""Skies by name, moments of a year and a north, in `lambert sky`, `solve` and `render`: a black cube in the open gets the light that
formulas say."""

import json
import math
import pathlib
import tempfile
import unittest

import numpy as np

from command import lambert, must
from weather import sun, wea

PLACE = 52.5, 13.4, 1
SIDES = {"roof": (0, 0, 1), "south": (0, -1, 0), "east": (1, 0, 0), "north": (0, 1, 0), "west": (-1, 0, 0)}
FACES = {"roof": (5, 6, 8, 7), "south": (1, 2, 6, 5), "east": (2, 4, 8, 6), "north": (4, 3, 7, 8), "west": (3, 1, 5, 7)}


class NamedSkies(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-skies-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        (cls.folder / "cube.mtl").write_text("newmtl black\nKd 0 0 0\n")
        (cls.folder / "cube.obj").write_text("mtllib cube.mtl\n" + "".join("v %d %d %d\n" % c for c in corners)
                                             + "".join(f"o {k}\nusemtl black\nf %d %d %d %d\n" % f for k, f in FACES.items()))
        cls.store = cls.folder / "cube.h5"
        must("precompute", cls.folder / "cube.obj", "-o", cls.store, "--sky", "reinhart:2", "--mesh", "faces", "--method", "exact",
             "--probes", 0)

    def light(self, *options, verb=("--quantity", "irradiance")):
        """Irradiance of the sides by name."""
        done = must("solve", self.store, *options, *verb, *(word for k in SIDES for word in ("--reduce", k + "=mean")), "--json")
        answer = json.loads(done.stdout)
        groups = answer["groups"] if "groups" in answer else answer["figures"]["daylight_factor"]
        return {k: groups[k]["mean"] for k in SIDES}, done.stderr

    def refused(self, status, wanted, *arguments, verb="solve"):
        done = lambert(verb, *arguments)
        self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn(wanted, done.stderr)

    def test_without_a_sun(self):
        for options, roof, wall in ((["even"], 10000, .5), (["overcast"], 10000, .3962), (["overcast", "--lux-outside", 500], 500, .3962)):
            got, said = self.light("--sky", *options)
            self.assertAlmostEqual(got["roof"] / roof, 1, delta=.002)
            for side in "south", "east", "north", "west":
                # Of the overcast sky 3/14 + 4/(7 pi) of what the roof gets; noise of the first light of tiles.
                self.assertAlmostEqual(got[side] / roof, 3 / 14 + 4 / (7 * math.pi) if wall < .5 else wall, delta=.006)
            self.assertIn(f"--sky {options[0]}: {roof} lx on a horizontal plane outside\n", said)

    def test_daylight_factor(self):
        overcast, _ = self.light("--sky", "overcast")
        for more in [], ["--sky", "overcast"]:
            got, _ = self.light("--figure", "daylight-factor", *more, verb=())
            for side in SIDES:
                self.assertAlmostEqual(got[side], overcast[side] / 100, delta=1e-4)
        path = self.folder / "factor.csv"
        must("solve", self.store, "--figure", "daylight-factor", "-o", path)
        self.assertTrue(path.read_text().startswith("element,group,area,irradiance_daylight_factor [%]\n"))
        factor = ["--figure", "daylight-factor"]
        for wanted, more in (("is of --sky overcast", ["--sky", "even"]), ("is of --quantity irradiance", ["--quantity", "radiosity"]),
                             ("exclude each other", ["--emit", "roof=1"]), ("exclude each other", ["--lux-outside", 9]),
                             ("exclude each other", ["--tolerance", .1]), ("exclude each other", ["--annual", "sum"])):
            self.refused(2, wanted, self.store, *factor, *more)

    def test_with_a_sun(self):
        """Direct light by the exact sun: what is stated for a horizontal plane, over the sine of its altitude, times the cosine."""
        where = ["--place", ",".join(map(str, PLACE)), "--date", "21 Jun 9:00"]
        at = np.array(sun(2001, 6, 21, 9, PLACE))
        for name in "clear", "turbidity:3.5":
            for north in 0, 90, -135:
                got, said = self.light("--sky", name, *where, *(["--north", north] if north else []))
                diffuse, direct, both = (float(said.split(word)[1].split()[0]) for word in ("diffuse ", "direct ", "= "))
                self.assertAlmostEqual(diffuse + direct, both, delta=.01)
                self.assertIn(f"the sun is {math.degrees(math.asin(at[2])):.1f} degrees high", said)
                turn = math.radians(north)
                turned = at[0] * math.cos(turn) + at[1] * math.sin(turn), at[1] * math.cos(turn) - at[0] * math.sin(turn), at[2]
                self.assertAlmostEqual(got["roof"], both, delta=.003 * both)
                sunny = {k: direct / at[2] * max(0, np.dot(turned, n)) for k, n in SIDES.items()}
                for k in "south", "east", "north", "west":  # and diffuse light, from a quarter to 1.5 times what the roof has
                    self.assertGreater(got[k], sunny[k] + .2 * diffuse)
                    self.assertLess(got[k], sunny[k] + 1.6 * diffuse)
            lux, said = self.light("--sky", name, *where, "--lux-outside", 50000)
            self.assertAlmostEqual(lux["roof"], 50000, delta=150)
            self.assertIn("= 50000 lx", said)
        tiles, _ = self.light("--sky", "clear", *where, "--sun", "tiles")
        exact, _ = self.light("--sky", "clear", *where)
        self.assertGreater(abs(tiles["east"] / exact["east"] - 1), .003)
        by_hour, _ = self.light("--sky", "clear", *where[:2], "--hour", (31 + 28 + 31 + 30 + 31 + 20) * 24 + 9)
        self.assertEqual(by_hour, exact)

    def test_moments_of_weather(self):
        rows = [(month, 21, h + .5, 800 if 6 <= h <= 17 else 0, 100 if 6 <= h <= 17 else 0) for month in (3, 6) for h in range(24)]
        path, out = self.folder / "days.wea", self.folder / "all.npy"
        path.write_text(wea(rows, PLACE[0], -PLACE[1], -15 * PLACE[2]))
        must("solve", self.store, "--weather", path, "--quantity", "irradiance", "-o", out)
        every = np.load(out)
        for date, hour, row in (("21 Mar 12:00", 79 * 24 + 12, 12), ("21 Jun 8:59", 171 * 24 + 8.98, 32)):
            for option in ["--date", date], ["--hour", hour]:
                must("solve", self.store, "--weather", path, *option, "--quantity", "irradiance", "-o", out)
                np.testing.assert_array_equal(np.load(out), every[row])
        # A quarter of a turn puts the light of each side on the next one.
        must("solve", self.store, "--weather", path, "--date", "21 Mar 12:00", "--north", 90, "--quantity", "irradiance", "-o", out)
        turned = np.load(out)
        np.testing.assert_allclose(turned[[4, 1, 2, 3]], every[12][[1, 2, 3, 4]], rtol=.01, atol=2)
        self.refused(1, "days.wea: no row covers 22 Mar 12:00", self.store, "--weather", path, "--date", "22 Mar 12:00")
        self.refused(1, "days.wea: the sky is dark at 21 Mar 02:00", self.store, "--weather", path, "--date", "21 Mar 2:00")
        self.refused(2, "--annual is of all rows", self.store, "--weather", path, "--date", "21 Mar 12:00", "--annual", "sum")

    def test_the_north_of_a_store(self):
        """precompute --north is what solve, render and the daemon take unless they are told another; from store to store it stays."""
        store, again, other = (self.folder / name for name in ("turned.h5", "again.h5", "other.h5"))
        must("precompute", self.folder / "cube.obj", "-o", store, "--sky", "reinhart:2", "--mesh", "faces", "--method", "exact",
             "--probes", 0, "--north", 90, "--keep-form-factors")
        must("precompute", store, "-o", again, "--method", "low-rank", "--probes", 0)
        must("precompute", store, "-o", other, "--method", "exact", "--probes", 0, "--north", -30)
        self.assertIn("ground albedo 0, north at 90 degrees", must("info", store).stdout)
        self.assertEqual(json.loads(must("info", again, "--json").stdout)["sky"]["north"], 90)
        self.assertNotIn("north", json.loads(must("info", self.store, "--json").stdout)["sky"])
        where = ["--sky", "clear", "--place", ",".join(map(str, PLACE)), "--date", "21 Jun 9:00", "--quantity", "irradiance"]
        out = self.folder / "north.npy"

        def light(path, *more):
            must("solve", path, *where, *more, "-o", out)
            return np.load(out)
        for path, north in (store, 90), (again, 90), (other, -30):
            np.testing.assert_allclose(light(path), light(self.store, "--north", north), rtol=.01, atol=2)
            np.testing.assert_allclose(light(path, "--north", 0), light(self.store), rtol=.01, atol=2)
        self.assertGreater(np.abs(light(store) - light(self.store)).max(), 50)

    def test_arrays_and_pictures(self):
        sky, out = self.folder / "sky.npy", self.folder / "out.npy"
        where = ["--place", ",".join(map(str, PLACE)), "--date", "21 Jun 9:00", "--north", 20]
        for name in ["overcast"], ["clear", *where], ["turbidity:4", *where, "--photometric"]:
            done = must("sky", *name, "--tiles", "reinhart:2", "-o", sky)
            self.assertIn("cd/m2" if name[0] == "overcast" or "--photometric" in name else "W/(m2 sr)", done.stdout)
            self.assertEqual(np.load(sky).shape, (1, 577))
            must("solve", self.store, "--sky", sky, "--quantity", "irradiance", "-o", out)
            by_file = np.load(out)
            must("solve", self.store, "--sky", *name, *(["--sun", "tiles"] if len(name) > 1 else []), "--quantity", "irradiance", "-o", out)
            np.testing.assert_allclose(by_file[0], np.load(out), rtol=1e-5)
            must("render", self.store, "--sky", *name, "--size", "32x32", "-o", self.folder / "cube.png")
        # Two lamps that shine by turns under one sky and its sun.
        np.save(self.folder / "E.npy", np.eye(5, dtype="f4")[:2])
        must("solve", self.store, "--emission", self.folder / "E.npy", "--sky", "clear", *where, "--quantity", "irradiance", "-o", out)
        np.testing.assert_array_equal(np.load(out)[0], np.load(out)[1])

    def test_refused(self):
        place = ["--place", "52.5,13.4,1"]
        for wanted, more in (("no such sky; named skies are even, overcast, clear and turbidity:T", ["--sky", "cloudy"]),
                             ("the turbidity must be a number from 1 to 20", ["--sky", "turbidity:0"]),
                             ("needs the place of the sun: give --place", ["--sky", "clear"]),
                             ("needs the place of the sun", ["--sky", "clear", *place]),
                             ("--place is for --sky clear", ["--sky", "overcast", *place]),
                             ("--date is for weather", ["--sky", "even", "--date", "21 Mar 12:00"]),
                             ("--hour is for weather", ["--emit", "roof=1", "--hour", 5]),
                             ("--north is for weather", ["--sky", "even", "--north", 5]),
                             ("--north is for weather", ["--sky", self.folder / "sky.npy", "--north", 5]),
                             ("--lux-outside is for --sky even", ["--emit", "roof=1", "--lux-outside", 5]),
                             ("--photometric is for --weather and --sky", ["--photometric"]),
                             ("must be DAY MONTH HH:MM", ["--sky", "clear", *place, "--date", "noon"]),
                             ("from 0 to below 8760", ["--sky", "clear", *place, "--hour", 8760]),
                             ("must be LATITUDE,LONGITUDE,ZONE", ["--sky", "clear", "--place", "95,0,0", "--hour", 12]),
                             ("exclude each other", ["--sky", "clear", *place, "--hour", 12, "--date", "21 Mar 12:00"]),
                             ("--north", ["--sky", "clear", *place, "--hour", 12, "--north", "east"])):
            self.refused(2, wanted, self.store, *more)
        self.refused(1, "the sky is dark: the sun is", self.store, "--sky", "clear", *place, "--hour", 0)
        self.refused(2, "--gaps is for weather", "overcast", "--gaps", "skip", "-o", self.folder / "none.npy", verb="sky")
        none = self.folder / "none.h5"
        must("precompute", self.folder / "cube.obj", "-o", none, "--mesh", "faces", "--method", "exact", "--probes", 0)
        self.refused(1, "--sky overcast: the store has no sky; precompute it with --sky", none, "--sky", "overcast")


if __name__ == "__main__":
    unittest.main()
