"""Light probes: a furnace, a box whose upper half gives light, a lamp straight above, y up, grids over free space, files, and
what Godot looks up in the resource that an example makes."""
import json
import math
import os
import re
import runpy
import subprocess
import sys
import unittest

import numpy as np

from case import Case
from command import EXAMPLES, must

ASSETS = ("--assets", os.path.join(os.environ["FIXTURES"], "luminaires"))
C0, C1 = math.sqrt(1 / (4 * math.pi)), math.sqrt(3 / (4 * math.pi))
PROBES = {"probes": [{"name": "middle", "at": [2, 2, 1]},
                     {"name": "game", "from": [2, 2, 1], "steps": [[9, 0, 0]], "counts": [2], "axes": "y-up"}],
          "points": [{"name": "floor", "at": [2, 2, 0]}]}

# A box of 4 x 4 x 2 m, seen from inside; what is above its half height has the radiance 1, 2 and 3 W/(m2 sr) in three channels.
BOX = "mtllib box.mtl\n" + "".join(f"v {x} {y} {z}\n" for z in (0, 1, 2) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))) + \
    "usemtl black\no lower\nf 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n" + \
    "usemtl lamp\no upper\nf 5 9 10 6\nf 6 10 11 7\nf 7 11 12 8\nf 8 12 9 5\nf 12 11 10 9\n"
MTL = "newmtl black\nKd 0 0 0\nnewmtl lamp\nKd 0 0 0\nKe 3.14159265 6.28318531 9.42477796\n"


def write(path, value):
    with open(path, "w", encoding="utf-8") as file:
        if isinstance(value, str):
            file.write(value)
        else:
            json.dump(value, file)


class Probes(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, value in (("box.obj", BOX), ("box.mtl", MTL), ("p.json", PROBES)):
            write(cls.kept(name), value)
        must("precompute", cls.kept("box.obj"), "--elements", 600, "--sensors", cls.kept("p.json"), "--probes", 0, "-o",
             cls.kept("box.h5"))
        cls.box = cls.kept("box.h5")

    @classmethod
    def kept(cls, name):
        """A file for all tests."""
        return os.path.join(cls.shared.name, name)

    def sets(self, store, *options):
        return {one["name"]: one for one in json.loads(must("solve", store, "--sensors", "all", "--json", *options).stdout)["sensors"]}

    def test_furnace(self):
        must("generate", "furnace", "-o", self.path("f.obj"))
        must("precompute", self.path("f.obj"), "--probes-grid", .7, "--probes", 0, "-o", self.path("f.h5"))
        must("solve", self.path("f.h5"), "--emit", "*=1", "--sensors", "probes", "-o", self.path("c.npy"))
        must("solve", self.path("f.h5"), "--emit", "*=1", "-o", self.path("B.npy"))
        c, B = np.load(self.path("c.npy")), np.load(self.path("B.npy")).mean()
        self.assertEqual(c.shape[1:], (9, 1))
        self.assertGreater(len(c), 50)
        # 3.54491 B / pi, and eight others of at most 1e-3 of it
        self.assertLess(abs(c[:, 0] / (3.544908 * B / math.pi) - 1).max(), 1e-5)
        self.assertLess(abs(c[:, 1:] / c[:, :1]).max(), 1e-3)

    def test_upper_half_of_a_black_box(self):
        L = np.array([1, 2, 3])
        expected = np.zeros((9, 3))
        expected[0], expected[2] = 1.772454 * L, 1.534990 * L
        sets = self.sets(self.box)
        one = sets["middle"]
        self.assertEqual((one["axes"], one["quantity"], one["unit"], one["at"]), ("scene", "radiance", "W/(m2 sr)", [[2, 2, 1]]))
        self.assertLess(abs(np.array(one["coefficients"][0]) - expected).max() / 3, 1e-3)
        game = sets["game"]  # y is up: z of the scene is y, and y is -z
        self.assertEqual((game["axes"], game["at"]), ("y-up", [[2, 1, -2], [11, 1, -2]]))
        self.assertLess(abs(np.array(game["coefficients"][0]) - expected[[0, 2, 1, 3, 4, 5, 6, 7, 8]]).max() / 3, 1e-3)
        self.assertIsNone(game["coefficients"][1])
        self.assertIn("values", sets["floor"])

    def test_files_and_tables(self):
        game = self.sets(self.box)["game"]
        must("solve", self.box, "--sensors", "game,middle", "-o", self.path("c.npy"))
        c = np.load(self.path("c.npy"))
        self.assertEqual(c.shape, (3, 9, 3))
        np.testing.assert_allclose(c[0], game["coefficients"][0], rtol=1e-6, atol=1e-6)
        self.assertTrue(np.isnan(c[1]).all())
        n = np.load(self.solved("-o", self.path("B.npy"))).shape[-1]
        E = np.zeros((2, 3, n), np.float32)
        E[1] = math.pi
        np.save(self.path("E.npy"), E)
        must("solve", self.box, "--emission", self.path("E.npy"), "--sensors", "middle", "-o", self.path("b.npy"))
        b = np.load(self.path("b.npy"))
        self.assertEqual(b.shape, (2, 1, 9, 3))
        self.assertEqual(abs(b[0]).max(), 0)
        np.testing.assert_allclose(b[1, 0, 0], 4 * math.pi * C0, rtol=1e-5)
        must("solve", self.box, "--emission", self.path("E.npy"), "--sensors", "game", "-o", self.path("b.json"))
        with open(self.path("b.json"), encoding="utf-8") as file:
            two = json.load(file)["sensors"][0]["coefficients"]
        self.assertEqual((len(two), len(two[1]), two[1][1]), (2, 2, None))
        table = must("solve", self.box, "--sensors", "all").stdout
        # the mean radiance of all directions is half of that of the upper ones
        self.assertRegex(table, r"game +1 radiance_b, W/\(m2 sr\) +1\.5 ")
        self.assertRegex(table, r"floor +1 irradiance_b, W/m2 ")

    def solved(self, *options):
        must("solve", self.box, *options)
        return options[-1]

    def test_a_lamp_straight_above(self):
        write(self.path("l.json"), {"luminaires": [{"name": "a", "file": "made/lambertian-1000cd.ies", "at": [2, 2, 1.9]}]})
        write(self.path("p.json"), {"probes": [{"name": "p", "at": [2, 2, .4]}]})
        must("precompute", self.kept("box.obj"), "--reflectance", 0, "--lights", "lm", "--luminaires", self.path("l.json"), *ASSETS,
             "--elements", 100, "--sensors", self.path("p.json"), "--probes", 0, "-o", self.path("l.h5"))
        one = self.sets(self.path("l.h5"), "--dim", "a=2")["p"]
        Y = [C0, 0, C1, 0, 0, 0, 2 * math.sqrt(5 / (16 * math.pi)), 0, 0]
        expected = 2 * 1000 / 1.5 ** 2 * np.array(Y)
        self.assertEqual(one["unit"], "cd/m2")
        # The opening is a point, so that rounding is left.
        np.testing.assert_allclose(np.array(one["coefficients"][0]).mean(1), expected, atol=1e-3 * expected[0])

    def test_a_grid_stands_beside_other_sensors_of_a_store(self):
        done = must("precompute", self.box, "--probes-grid", 1, "--probes-y-up", "-o", self.path("a.h5"))
        self.assertIn("probes at 32 of 32 points", done.stderr)
        must("precompute", self.path("a.h5"), "--probes-grid", 2, "-o", self.path("b.h5"))
        sets = self.sets(self.path("b.h5"))
        self.assertEqual(list(sets), ["floor", "middle", "game", "probes"])
        self.assertEqual((sets["probes"]["axes"], len(sets["probes"]["at"])), ("scene", 4))
        self.assertEqual(self.sets(self.path("a.h5"))["probes"]["at"][0], [.5, .5, -.5])

    def test_verify(self):
        """Coefficients of either sign are no shares of rays: the row of the one point is found again."""
        self.assertRegex(must("verify", self.box).stdout, r"ok +sensors +28 in 3 sets, the rows of 1 of them were found again, as stated")

    def test_refusals(self):
        self.refused(1, "go into .json or .npy", "solve", self.box, "--sensors", "all", "-o", self.path("x.csv"))
        self.refused(1, "floor is not", "solve", self.box, "--sensors", "game,floor", "-o", self.path("x.npy"))
        out = ("-o", self.path("x.h5"))
        self.failed("--probes-y-up is for --probes-grid", "precompute", self.kept("box.obj"), "--probes-y-up", *out)
        self.failed("more than 1000000 points", "precompute", self.kept("box.obj"), "--probes-grid", .001, *out)
        self.refused(2, "must be above 0", "precompute", self.kept("box.obj"), "--probes-grid", 0, *out)
        write(self.path("bad.json"), {"probes": [{"name": "p", "at": [0, 0, 1], "axes": "up"}]})
        self.failed('probes[0]: axes = "up", must be "scene" or "y-up"', "precompute", self.kept("box.obj"), "--sensors",
                    self.path("bad.json"), *out)
        self.assertFalse(os.path.exists(self.path("x.h5")))

    def test_no_share_of_hours(self):
        write(self.path("yard.obj"), BOX.replace("f 12 11 10 9\n", ""))
        write(self.path("box.mtl"), MTL.replace("Ke 3.14159265 6.28318531 9.42477796", "Ke 0 0 0"))
        must("precompute", self.path("yard.obj"), "--elements", 100, "--sky", "tregenza", "--sensors", self.kept("p.json"), "--probes", 0,
             "-o", self.path("yard.h5"))
        L = np.ones((5, 145), np.float32)
        L[1] = 0
        np.save(self.path("L.npy"), L)
        self.refused(1, "have no share of hours", "solve", self.path("yard.h5"), "--sky", self.path("L.npy"), "--annual", "autonomy=1",
                     "--sensors", "middle")
        must("solve", self.path("yard.h5"), "--sky", self.path("L.npy"), "--sensors", "middle", "-o", self.path("c.npy"))
        c = np.load(self.path("c.npy"))[:, 0, :, 0]
        self.assertEqual(abs(c[1]).max(), 0)
        # Of a square of 4 x 4 m, 1 m above: its solid angle, and its projection onto z, by closed forms.
        solid = 4 * math.asin(4 / 5)
        along = 4 * 2 / math.sqrt(5) * math.atan(2 / math.sqrt(5))
        # 256 rays or more of a half meet it evenly: half of a percent
        np.testing.assert_allclose(c[0, [0, 2]], [C0 * solid, C1 * along], rtol=.01)
        self.assertLess(abs(c[0, [1, 3]]).max(), .01 * c[0, 0])

    def test_godot_finds_the_light_between_probes(self):
        example = runpy.run_path(str(EXAMPLES / "probes_for_godot.py"))
        must("generate", "cornell", "--elements", 300, "-o", self.path("c.obj"))
        must("precompute", self.path("c.obj"), "--probes-grid", .1, "--probes-y-up", "--probes", 0, "-o", self.path("c.h5"))
        write(self.path("c.json"), must("solve", self.path("c.h5"), "--sensors", "probes", "--json").stdout)
        subprocess.run([sys.executable, EXAMPLES / "probes_for_godot.py", self.path("c.json"), self.path("c.tres"), "0.5"], check=True)
        with open(self.path("c.tres"), encoding="utf-8") as file:
            text = file.read()
        self.assertTrue(text.startswith('[gd_resource type="LightmapGIData" format=3]'))

        def array(name, columns):
            numbers = re.search(rf'"{name}": \w+\(([^)]*)\)', text)[1].split(",")
            return np.array(numbers, float).reshape(-1, columns)
        points, sh, cells, bsp = array("points", 3), array("sh", 4).reshape(-1, 9, 4), array("tetrahedra", 4), array("bsp", 6)
        with open(self.path("c.json"), encoding="utf-8") as file:
            wanted_points, wanted = example["read"](json.load(file))
        np.testing.assert_allclose(points, wanted_points, atol=1e-6)
        np.testing.assert_allclose(sh[..., :3], .5 * wanted, atol=1e-6)
        self.assertEqual(sh[..., 3].min(), 1)
        planes = bsp[:, :4].astype(np.int32).view(np.float32)
        random = np.random.default_rng(1)
        for point in points.min(0) + random.random((500, 3)) * np.ptp(points, axis=0):
            node = 0
            while node >= 0:  # as Godot goes down its tree
                child = int(bsp[node, 4 if planes[node, :3] @ point > planes[node, 3] else 5])
                self.assertFalse(0 <= child <= node)
                node = child
            self.assertGreater(node, -2 ** 31)
            corners = points[cells[-node - 1].astype(int)]
            weights = np.linalg.solve(np.vstack([corners.T, np.ones(4)]), [*point, 1])
            self.assertGreater(weights.min(), -2e-3)  # planes have a tolerance of 1e-4 of the scene, of cells of a fifth of it


if __name__ == "__main__":
    unittest.main()
