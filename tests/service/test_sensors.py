"""Sensors of a scene: irradiance gathered at points against formulas and a finer mesh, sets in every format, a year, sensors and
lamps that are moved in a store, and refusals."""
import csv
import json
import math
import os
import subprocess
import sys
import unittest

import h5py
import numpy as np

from case import Case
from command import EXAMPLES, example, lambert, must
from make_store import add_checksums

ASSETS = ("--assets", os.path.join(os.environ["FIXTURES"], "luminaires"))
LUMINAIRES = {"luminaires": [{"name": "a", "file": "made/lambertian-1000cd.ies", "at": [3, 3, 2.5]},
                             {"name": "b", "file": "made/cos4-2019.ies", "at": [1.5, 1.5, 2.8], "dim": 0.5}]}
SENSORS = {
    "grids": [{"name": "room", "over": "floor", "height": 0.85, "spacing": "en12464", "border": 0.5}],
    "points": [{"name": "desk", "at": [[1, 1, 0.75], [4, 3, 0.75]], "normal": [0, 0, 1]},
               {"name": "out", "at": [[3, 3, -1]], "normal": [0, 0, 1]}]}


class Sensors(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, value in (("l.json", LUMINAIRES), ("s.json", SENSORS)):
            with open(cls.kept(name), "w", encoding="utf-8") as file:
                json.dump(value, file)
        must("generate", "box", "--size", "6,6,3", "-o", cls.kept("room.obj"))
        cls.black = cls.make("black.h5", 0)
        cls.grey = cls.make("grey.h5", .5)

    @classmethod
    def kept(cls, name):
        """A file for all tests."""
        return os.path.join(cls.shared.name, name)

    @classmethod
    def make(cls, name, reflectance):
        must("precompute", cls.kept("room.obj"), "--luminaires", cls.kept("l.json"), *ASSETS, "--sensors", cls.kept("s.json"),
             "--elements", 600, "--reflectance", reflectance, "--method", "exact", "--probes", 0, "-o", cls.kept(name))
        return cls.kept(name)

    def answer(self, store, *options):
        return json.loads(must("solve", store, "--sensors", "all", "--json", *options).stdout)

    def test_direct_light_follows_the_formula(self):
        for one in self.answer(self.black, "--dim", "a=2")["sensors"]:
            if one["name"] == "out":
                continue
            for (x, y, z), found in zip(one["at"], one["values"]):
                # I cos / d2 of 1,000 cos gamma cd, 2.5 m above the floor, at a horizontal plane
                height, across2 = 2.5 - z, (x - 3) ** 2 + (y - 3) ** 2
                wanted = 2 * 1000 * height ** 2 / (height ** 2 + across2) ** 2
                self.assertAlmostEqual(found, wanted, delta=2e-3 * wanted)

    def test_all_bounces_come_to_the_points(self):
        # A closed room of one reflectance: the mean of the bounced light is that of a furnace, by its own elements.
        bounced = self.answer(self.grey)["sensors"]
        direct = self.answer(self.black)["sensors"]
        floor = must("solve", self.grey, "--quantity", "indirect", "--json", "--reduce", "floor=mean").stdout
        self.assertIn("floor", floor)
        for with_bounces, without in zip(bounced, direct):
            if with_bounces["name"] == "out":
                continue
            extra = np.array(with_bounces["values"]) - np.array(without["values"])
            self.assertGreater(extra.min(), 10)
            self.assertLess(extra.std() / extra.mean(), .3)

    def test_formats_agree(self):
        room = next(s for s in self.answer(self.grey)["sensors"] if s["name"] == "room")
        self.assertEqual(len(room["values"]), 81)
        self.assertAlmostEqual(room["figures"]["mean"], np.mean(room["values"]), places=6)
        must("solve", self.grey, "--sensors", "room", "-o", self.path("r.npy"))
        np.testing.assert_allclose(np.load(self.path("r.npy")), room["values"], rtol=1e-6)
        must("solve", self.grey, "--sensors", "room", "-o", self.path("r.csv"))
        with open(self.path("r.csv"), encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        np.testing.assert_allclose([float(r["irradiance [lx]"]) for r in rows], room["values"], rtol=1e-6)
        np.testing.assert_allclose([[float(r[k]) for k in ("x [m]", "y [m]", "z [m]")] for r in rows], room["at"])
        must("solve", self.grey, "--sensors", "desk,room", "-o", self.path("r.json"))
        with open(self.path("r.json"), encoding="utf-8") as file:
            self.assertEqual([s["name"] for s in json.load(file)["sensors"]], ["desk", "room"])
        self.assertIn("min/mean", must("solve", self.grey, "--sensors", "room").stdout)

    def test_a_program_of_one_s_own_reads_them(self):
        must("solve", self.grey, "-o", self.path("B.npy"))
        gather = example("read_sensors.py", self.grey)["gather"]
        for one in self.answer(self.grey)["sensors"]:
            found, wanted = gather(self.grey, np.load(self.path("B.npy")))[one["name"]][0], np.array(one["values"], float)
            # single precision of values, and the limiter, which solve uses for both
            np.testing.assert_allclose(found, wanted, rtol=1e-5)
            self.assertEqual(np.isnan(found).all(), one["name"] == "out")
        printed = subprocess.run([sys.executable, EXAMPLES / "read_sensors.py", self.grey, self.path("B.npy")], check=True, text=True,
                                 stdout=subprocess.PIPE).stdout
        self.assertEqual([line.split()[0] for line in printed.splitlines()].count("desk"), 1)
        for one in self.answer(self.black)["sensors"]:
            np.testing.assert_allclose(gather(self.black)[one["name"]][0], np.array(one["values"], float), rtol=1e-5)

    def test_points_outside_have_no_value(self):
        told = must("precompute", self.grey, "--sensors", self.kept("s.json"), "-o", self.path("again.h5")).stderr
        self.assertIn("sensors out: 1 of 1 lie in a wall or outside", told)
        out = next(s for s in self.answer(self.path("again.h5"))["sensors"] if s["name"] == "out")
        self.assertEqual((out["values"], out["figures"]["mean"]), ([None], None))

    def test_moved_lamps_and_sensors_give_what_a_precompute_of_all_gives(self):
        moved = {"luminaires": [dict(LUMINAIRES["luminaires"][0], at=[2, 4, 2.5]), LUMINAIRES["luminaires"][1]]}
        with open(self.path("m.json"), "w", encoding="utf-8") as file:
            json.dump(moved, file)
        with open(self.path("d.pts"), "w", encoding="utf-8") as file:
            file.write("1 2 0.8 0 0 1\n5 5 1.2 1 0 0\n")
        must("precompute", self.grey, "--luminaires", self.path("m.json"), *ASSETS, "-o", self.path("a.h5"))
        must("precompute", self.kept("room.obj"), "--luminaires", self.path("m.json"), *ASSETS, "--sensors", self.kept("s.json"),
             "--elements", 600, "--reflectance", .5, "--method", "exact", "--probes", 0, "-o", self.path("b.h5"))
        must("precompute", self.path("a.h5"), "--sensors", self.path("d.pts"), "-o", self.path("c.h5"))
        with h5py.File(self.path("a.h5")) as a, h5py.File(self.path("b.h5")) as b, h5py.File(self.path("c.h5")) as c:
            for name in b["sensors"]:
                np.testing.assert_array_equal(a["sensors"][name][()], b["sensors"][name][()], err_msg=name)
            for name in b["luminaires"]:
                np.testing.assert_array_equal(a["luminaires"][name][()], b["luminaires"][name][()], err_msg=name)
                np.testing.assert_array_equal(a["luminaires"][name][()], c["luminaires"][name][()], err_msg=name)
            self.assertEqual([n.decode() for n in c["sensors/names"]], ["d"])
        must("precompute", self.path("c.h5"), "--sensors", "none", "-o", self.path("e.h5"))
        self.refused(1, "the store has no sensors", "solve", self.path("e.h5"), "--sensors", "all")

    def test_a_year_at_sensors(self):
        with open(self.path("yard.obj"), "w", encoding="utf-8") as file:  # a floor and four walls
            file.write("".join(f"v {x} {y} {z}\n" for z in (0, 3) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))))
            file.write("f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n")
        with open(self.path("p.pts"), "w", encoding="utf-8") as file:
            file.write("".join(f"{x} {y} 0.8 0 0 1\n" for x in (.5, 2) for y in (1, 3)))
        must("precompute", self.path("yard.obj"), "--elements", 200, "--fix", "--reflectance", .5, "--sky", "tregenza", "--sensors",
             self.path("p.pts"), "--probes", 0, "-o", self.path("yard.h5"))
        L = np.random.default_rng(1).uniform(0, 50, (200, 145)).astype(np.float32)
        np.save(self.path("L.npy"), L)
        must("solve", self.path("yard.h5"), "--sky", self.path("L.npy"), "--sensors", "all", "-o", self.path("hours.npy"))
        hours = np.load(self.path("hours.npy"))
        hours = hours.reshape(200, -1, 4)
        limit = float(np.median(hours))
        must("solve", self.path("yard.h5"), "--sky", self.path("L.npy"), "--annual", f"autonomy={limit:.9g}", "--sensors", "all", "-o",
             self.path("year.npy"))
        year = np.load(self.path("year.npy")).reshape(-1, 4)
        # Hours within rounding of the limit may fall to either side.
        self.assertLessEqual(abs(year - (hours >= limit).mean(0)).max(), 2 / 200)
        self.assertGreater(year.std(), 0)

    def test_verify_sees_wrong_rows(self):
        """All receivers that have a value are found again, as these are no more than the check takes."""
        few = {"points": [{"name": "p", "at": [[1 + x, 1 + y, 0.75] for x in range(5) for y in range(4)], "normal": [0, 0, 1]},
                          {"name": "out", "at": [[3, 3, -1]], "normal": [0, 0, 1]}],
               "grids": [{"name": "g", "over": "floor", "height": 1, "spacing": 2}]}
        with open(self.path("few.json"), "w", encoding="utf-8") as file:
            json.dump(few, file)
        must("precompute", self.grey, "--sensors", self.path("few.json"), "-o", self.path("few.h5"))
        self.assertIn("30 in 3 sets, the rows of 29 of them were found again, as stated", must("verify", self.path("few.h5")).stdout)
        with h5py.File(self.path("few.h5")) as file:
            rows, flags, first = (file["sensors"][name][()] for name in ("indptr", "flags", "first"))
            grid = int(first[[n.decode() for n in file["sensors/names"][()]].index("g")])
        out = int(np.flatnonzero(flags)[0])

        def scale(factor, row):
            def change(sensors):
                for name in "weights", "weights_off":
                    sensors[name][int(rows[row]):int(rows[row + 1])] *= np.float32(factor)
            return change

        def put(name, place, value):
            def change(sensors):
                sensors[name][place] = value
            return change

        for words, change in (("times the weights that their places give", scale(.95, 0)),
                              ("receiver 29: elements", scale(.95, 29)),
                              ("add up to 1.05", scale(1.05, 0)),
                              ("halves of a weight differ", put("weights_off", 5, .5)),
                              ("times the light that its place and table do", put("luminaires", 1, 0)),
                              (f"receiver {out}: flags 0", put("flags", out, 0)),
                              ("receiver 3: flags 1", put("flags", 3, 1)),
                              ("flags 2 beside", None),
                              ("cell 9, which is none of its own", put("cell", grid, 9)),
                              ("in cell 0, which is none", put("cell", grid + 1, 0)),
                              ("in cell 4", put("cell", 0, 4)),
                              ("receiver 0: elements that nothing hides", None)):
            with self.subTest(words):
                with open(self.path("few.h5"), "rb") as good, open(self.path("bad.h5"), "wb") as bad:
                    bad.write(good.read())
                with h5py.File(self.path("bad.h5"), "r+") as file:
                    if change is not None:
                        change(file["sensors"])
                    elif words.startswith("receiver 0"):  # the row of a receiver that looks elsewhere
                        file["sensors/place"][0, 3:6] = [0, 0, -1]
                        file["sensors/place"][0, 2] = 2.5
                    else:
                        file["sensors/flags"][2] = 2
                        del file["sensors/luminaires"], file["luminaires"]
                    add_checksums(file)
                result = lambert("verify", self.path("bad.h5"))
                self.assertNotEqual(result.returncode, 0)
                line = next(line for line in result.stdout.splitlines() if "sensors" in line)
                self.assertTrue(line.startswith("BROKEN"), line)
                self.assertIn(words, line)

    def test_refusals(self):
        self.refused(1, "no such set; it has", "solve", self.grey, "--sensors", "rom")
        self.refused(1, "the store has no sensors", "solve", self.store, "--sensors", "all")
        self.refused(2, "receive irradiance", "solve", self.grey, "--sensors", "all", "--quantity", "radiosity")
        self.refused(2, ".csv, .json, .npy or .vtu", "solve", self.grey, "--sensors", "all", "-o", "x.ply")
        self.refused(2, "--reduce", "solve", self.grey, "--sensors", "all", "--reduce", "floor=mean")
        out = ("-o", self.path("refused.h5"))
        for text, words in (('{"points": [{"name": "a"}]}', "at"), ('{"points": [{"name": "a", "at": [[1, 2]]}]}', "three numbers"),
                            ('{"grids": [{"name": "g", "over": "flor"}]}', "flor"), ('{"point": []}', "point"), ("{", "line 1")):
            with open(self.path("bad.json"), "w", encoding="utf-8") as file:
                file.write(text)
            self.failed(words, "precompute", self.grey, "--sensors", self.path("bad.json"), *out)
        self.assertFalse(os.path.exists(self.path("refused.h5")))


if __name__ == "__main__":
    unittest.main()
