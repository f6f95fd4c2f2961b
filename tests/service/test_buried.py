"""Black box: parts of a floor below a body that stands on it have no part in figures of groups, in both programs; pictures and
values of elements keep them."""

import csv
import json
import os
import shutil
import tempfile
import unittest

import h5py
import numpy as np

import glb
from command import lambert, must
from daemon import Daemon
from make_store import add_checksums
from quads import Quads

BODY = 2.25  # m2 of the floor below the body
FIGURES = "mean", "sum", "min", "max", "uniformity", "variance"
LAMP = {"emission": {"groups": {"lamp": 1}}, "quantity": "irradiance"}


def room(path):
    """A room of 4 x 4 x 3 m, on the floor of which stands a cube whose sides are on lines of the floor; a lamp
    at the ceiling, and an opening in it."""
    quads = Quads()
    quads.box("room", (0, 0, 0), (4, 4, 3), (8, 8, 6), holes={5: (.5, 1.5, .5, 1.5)})
    quads.box("body", (1, 1, 0), (2.5, 2.5, 1.5), (3, 3, 3), inward=-1)
    quads.grid("lamp", 2, 2.9, -1, np.linspace(2.5, 3.5, 3), np.linspace(2.5, 3.5, 3))
    quads.write(path, .5)


class Buried(unittest.TestCase):
    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-buried-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        room(cls.path("room.obj"))
        cls.store = cls.path("room.h5")
        must("precompute", cls.path("room.obj"), "-o", cls.store, "--probes", 4, "--mesh", "faces", "--method", "low-rank",
                       "--epsilon", 1e-3, "--keep-form-factors", "--sky", "tregenza", "--quiet")
        with h5py.File(cls.store) as f:
            cls.area, cls.group = f["mesh/area"][()], f["mesh/group"][()]
            cls.names = [name.decode() for name in f["mesh/group_names"]]
            cls.buried = f["mesh/buried"][()]
            cls.corners = f["mesh/vertices"][()][f["mesh/elements"][()]]

    def figures(self, values, name, buried=None):
        """By hand: of the elements of a group that are open."""
        inside = self.group == self.names.index(name)
        inside[self.buried if buried is None else buried] = False
        a, x = self.area[inside], np.array(values)[inside]
        if not len(a):
            return dict.fromkeys(FIGURES)
        mean = a @ x / a.sum()
        return {"mean": mean, "sum": a @ x, "min": x.min(), "max": x.max(), "uniformity": x.min() / mean,
                "variance": a @ (x - mean) ** 2 / a.sum()}

    def same(self, found, wanted):
        self.assertEqual(list(found), list(wanted))
        for key, value in wanted.items():
            if value is None:
                self.assertIsNone(found[key], key)
            else:
                self.assertAlmostEqual(found[key] / value, 1, delta=2e-5 if key != "variance" else 1e-3, msg=key)

    def test_the_store_names_them(self):
        """The floor has them below the body, and the body has its underside."""
        middle = self.corners.mean(axis=1)
        wanted = (middle[:, 2] == 0) & ((middle[:, :2] > 1) & (middle[:, :2] < 2.5)).all(axis=1)
        np.testing.assert_array_equal(np.flatnonzero(wanted), self.buried)
        self.assertEqual({self.names[g] for g in self.group[self.buried]}, {"room4", "body4"})
        about = json.loads(must("info", self.store, "--json").stdout)
        found = {group["name"]: group["buried"] for group in about["groups"] if "buried" in group}
        self.assertEqual(found, {"room4": {"elements": 9, "area": BODY}, "body4": {"elements": 9, "area": BODY}})
        self.assertIn("room4, 64 elements; 9 of these, 2.25 m2, lie below a body: figures leave them out", must("info", self.store).stdout)

    def test_solve(self):
        light = "--emit", "lamp=1", "--quantity", "irradiance"
        must("solve", self.store, *light, "-o", self.path("all.npy"))
        values = np.load(self.path("all.npy"))
        self.assertEqual(len(values), len(self.area))
        self.assertLess(values[self.buried].max(), 1e-3 * values.mean())
        wanted = self.figures(values, "room4")
        self.assertGreater(wanted["uniformity"], .05)
        reduce = [x for name in ("room4", "body4") for figure in FIGURES for x in ("--reduce", f"{name}={figure}")]
        found = json.loads(must("solve", self.store, *light, *reduce, "--json").stdout)["groups"]
        self.same(found["room4"], wanted)
        self.same(found["body4"], self.figures(values, "body4"))
        must("solve", self.store, *light, *reduce, "-o", self.path("figures.csv"))
        with open(self.path("figures.csv"), encoding="ascii") as file:
            rows = {(group, figure): value for group, figure, value in list(csv.reader(file))[1:]}
        self.assertAlmostEqual(float(rows["room4", "min"]), wanted["min"], delta=1e-5 * wanted["min"])
        self.assertEqual(rows["body4", "min"], "")
        text = must("solve", self.store, *light, *reduce).stdout
        self.assertIn("figures leave out 9 elements of room4, 2.25 m2; 9 elements of body4, 2.25 m2, below bodies that stand on them", text)
        self.assertNotIn("nan", text)
        self.assertNotIn("figures leave out", must("solve", self.store, *light, "--reduce", "lamp=mean").stdout)
        table = must("solve", self.store, *light).stdout
        self.assertIn("figures leave out 9 elements of room4", table)
        self.assertNotIn("nan", table)
        means = json.loads(must("solve", self.store, *light, "--json").stdout)["groups"]
        self.assertEqual((means["room4"]["elements"], means["room4"]["area"], means["room4"]["buried"]),
                         (55, 16 - BODY, {"elements": 9, "area": BODY}))
        self.assertAlmostEqual(means["room4"]["mean"], wanted["mean"], delta=1e-5)
        self.assertIsNone(means["body4"]["mean"])
        for more in (["--tolerance", 1e-5], ["--sky", "even"]):
            given = light if more[0] == "--tolerance" else light[2:]
            must("solve", self.store, *given, *more, "-o", self.path("more.npy"))
            found = json.loads(must("solve", self.store, *given, *more, *reduce, "--json").stdout)["groups"]
            self.same(found["room4"], self.figures(np.load(self.path("more.npy")), "room4"))

    def test_daemon(self):
        with Daemon(self.store) as daemon:
            groups = {g["name"]: g.get("buried") for g in daemon.get("/v1/scenes/room").json()["groups"]}
            self.assertEqual(groups["room4"], {"elements": 9, "area": BODY})
            self.assertIsNone(groups["room5"])
            mesh = glb.Glb(daemon.get("/v1/scenes/room/mesh").body)
            named = [e for node in mesh.json["nodes"] for e in node["extras"].get("buried", [])]
            self.assertEqual(sorted(named), self.buried.tolist())
            for more in ({}, {"tolerance": 1e-5}, {"limit": False}):
                values = daemon.radiosity("room", json.dumps({**LAMP, **more})).json()["irradiance"]
                wanted = {name: self.figures(values, name) for name in ("room4", "body4")}
                stated = {}
                for names in (["mean", "sum"], FIGURES):
                    body = json.dumps({**LAMP, **more, "reduce": {"groups": ["room4", "body4"], "with": names}})
                    for _ in range(2):  # rows of the adjoint are kept from the first on
                        answer = daemon.radiosity("room", body).json()
                        for name in wanted:
                            self.same(answer["groups"][name], {key: wanted[name][key] for key in names})
                    stated[len(names)] = answer.get("error", {}).get("groups", {}).get("room4", {}).get("mean")
                if stated[2] is not None:
                    # Reflectance is even, so that the error of a mean is told by the mean alone as well as by all values.
                    self.assertAlmostEqual(stated[2] / stated[6], 1, delta=.02)

    def test_wrong_and_older_stores(self):
        path = self.path("wrong.h5")
        for numbers, told in ((self.buried + 10000, "/mesh/buried[0] = "), (self.buried[::-1], "/mesh/buried[1] = ")):
            shutil.copy(self.store, path)
            with h5py.File(path, "r+") as f:
                f["mesh/buried"][...] = numbers
                add_checksums(f)
            done = lambert("solve", path, "--emit", "lamp=1")
            self.assertEqual(done.returncode, 1)
            self.assertIn(told, done.stderr)
        with h5py.File(path, "r+") as f:
            del f["mesh/buried"]
            add_checksums(f)
        found = json.loads(must("solve", path, "--emit", "lamp=1", "--quantity", "irradiance", "--reduce", "room4=min", "--json").stdout)
        self.assertLess(found["groups"]["room4"]["min"], 1e-3)


if __name__ == "__main__":
    unittest.main()
