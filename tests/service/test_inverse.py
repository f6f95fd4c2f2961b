"""The programs of deploy/examples/inverse on small scenes, beside optima that are found another way."""

import glob
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import numpy as np

from command import EXAMPLES, ENVIRONMENT, must
from daemon import Daemon
from lambert_python import PACKAGE, lambert
from patience import PATIENCE
import weather

INVERSE = EXAMPLES / "inverse"
LIBRARY = next(iter(sorted(glob.glob(str(pathlib.Path(os.environ["LAMBERT"]).parent / "liblambert.so*")))), "")
sys.path.insert(0, str(INVERSE))

import catalogue  # noqa: E402
import enclosures  # noqa: E402
import heat  # noqa: E402
import materials  # noqa: E402
import openings  # noqa: E402


def run(program, *arguments):
    path = f"{pathlib.Path(os.environ['LAMBERT']).parent}:{ENVIRONMENT['PATH']}"
    return subprocess.run(["/usr/bin/python3", INVERSE / program, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                          check=False, env=dict(ENVIRONMENT, PATH=path, PYTHONPATH=str(PACKAGE), PYTHONDONTWRITEBYTECODE="1", LAMBERT_LIBRARY=LIBRARY))


class InverseCase(unittest.TestCase):
    @classmethod
    def folder(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-inverse-")
        cls.addClassCleanup(folder.cleanup)
        return pathlib.Path(folder.name)

    def printed(self, program, *arguments):
        done = run(program, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def refused(self, words, program, *arguments):
        """One line says it."""
        done = run(program, *arguments)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(words, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)

    @classmethod
    def serve(cls, *arguments):
        daemon = Daemon(*arguments)
        cls.addClassCleanup(daemon.__exit__, None, None, None)
        return f"http://127.0.0.1:{daemon.port}"


class Office(InverseCase):
    """Dimmers and a catalogue."""

    @classmethod
    def setUpClass(cls):
        root = cls.folder()
        for name, lamps in ("office", "5x4"), ("two", "2x1"):
            done = run("office.py", root / name, "--desks", "2x2", "--lamps", lamps)
            assert done.returncode == 0, done.stderr
        make = ("--elements", 400, "--method", "low-rank", "--probes", 0, "--quiet", "--sensors", root / "office" / "sensors.json")
        must("precompute", root / "office" / "office.obj", "-o", root / "office.h5", "--luminaires", root / "office" / "lights.json", *make)
        must("precompute", root / "office.h5", "-o", root / "two.h5", "--luminaires", root / "two" / "lights.json", "--quiet")
        cls.stores = [root / "office.h5", root / "two.h5"]
        cls.address = cls.serve(*cls.stores)
        cls.root = root

    def test_all_methods_find_the_least_power(self):
        lines = self.printed("lamps.py", self.address + "/office").splitlines()[1:]
        self.assertEqual([line.split()[0] for line in lines], ["programme", "L-BFGS-B", "SLSQP", "COBYLA"])
        for line in lines:
            watts, above, missing = map(float, re.search(r"([\d.]+) W +([+-][\d.]+) % +misses ([\d.]+) %", line).groups())
            self.assertGreater(watts, 0)
            # Half a per cent is asked for; a method may be below the optimum by as much as what it misses is worth.
            self.assertLess(abs(above), 0.5, line)
            self.assertLess(missing, 0.1, line)

    def test_the_least_power_is_enough_and_no_more(self):
        """The daemon's own figures under the optimum of a store in process: every desk has what it must, and one has no more."""
        self.printed("lamps.py", self.stores[0], "--methods", "programme", "-o", self.root / "dimmers.json")
        office = lambert.Scene(self.address + "/office")
        dimmers = json.loads((self.root / "dimmers.json").read_text())
        found = office.reduce(dimmers, sensors=[name for name in office.sensors if name.startswith("desk-")], figures=("mean", "uniformity"))
        self.assertEqual(len(found), 4)
        # Dimmers are written with 6 digits, light is a sum of single precision: 1e-4 is far above both.
        for figures in found.values():
            self.assertGreater(figures["mean"], 500 * (1 - 1e-4))
            self.assertGreater(figures["uniformity"], 0.6 * (1 - 1e-4))
        self.assertLess(min(figures["mean"] for figures in found.values()), 500 * (1 + 1e-4))

    def test_no_configuration_is_better(self):
        """Two places with 33 choices each are tried all."""
        two = lambert.Scene(self.address + "/two")
        with unittest.mock.patch.multiple(catalogue, LUX=10, SPREAD=1):
            problem = catalogue.Catalogue(two)
            every = np.array(list(itertools.product(range(33), repeat=2)))
            watts, mean, variance = problem.statistics(every)
            valid = mean - np.sqrt(variance) >= 10
            self.assertTrue(0 < valid.sum() < len(every))
            best = problem.search(20, 1)
            self.assertIn(best.tolist(), every[valid].tolist())
            self.assertAlmostEqual(problem.statistics(best[None])[0][0], watts[valid].min())
            self.assertLessEqual(problem.bound(), watts[valid].min() * (1 + 1e-6))
            # The same statistics by a question for each: sums of single precision.
            asked = catalogue.Catalogue(two, "reduce").statistics(every[::40])
            for one, other in zip((watts, mean, variance), asked):
                np.testing.assert_allclose(other, one[::40], rtol=1e-4, atol=1e-4 * abs(one).max())

    def test_catalogue(self):
        for by in "jacobian", "reduce":
            text = self.printed("catalogue.py", self.address + "/office", "--by", by, "--rounds", 0, "-o", self.root / "chosen.json")
            mean, deviation = map(float, re.search(r"mean ([\d.]+) lx, deviation ([\d.]+) lx", text).groups())
            self.assertGreaterEqual(mean - 2 * deviation, 299.7)  # numbers of one decimal
            above = float(re.search(r"at most ([\d.-]+) % above", text)[1])
            self.assertTrue(0 <= above < 40, text)
            self.assertRegex(text, r"\d+ configurations by \w+, \d+ a second")
            chosen = json.loads((self.root / "chosen.json").read_text())
            self.assertTrue(0 < len(chosen["luminaires"]) <= 20)

    def test_words(self):
        self.refused("no luminaire is called wid; there are narrow, spot, wide, wings", "lamps.py", self.stores[0], "--lamps", "wid")
        self.refused("no dimmers from 0 to 1 give every desk 500 lx", "lamps.py", self.stores[1])
        self.refused("there is no such store", "lamps.py", self.root / "none.h5")
        self.refused("Connection refused", "lamps.py", "http://127.0.0.1:1/office")
        self.refused("no configuration found", "catalogue.py", self.stores[1], "--rounds", 1)


# Form factors of closed forms: opposed (C-11) and perpendicular (C-14) rectangles, with the sizes of a box, of a cube and a room.
FACTORS = {(1, 1, 1): {("floor", "ceiling"): 0.199824895698, ("floor", "north"): 0.200043776075, ("floor", "east"): 0.200043776075},
           (10, 6, 3): {("floor", "ceiling"): 0.488700936440, ("floor", "north"): 0.162387354927, ("floor", "east"): 0.093262176853}}


class Heat(InverseCase):
    """Enclosures beside what is known of them."""

    def precompute(self, name, faces, eps, *more):
        root = self.folder()
        enclosures.write(root / f"{name}.obj", faces, eps)
        must("precompute", root / f"{name}.obj", "-o", root / f"{name}.h5", "--method", "exact", "--quality", "high", "--probes", 0, "--closed",
             "--quiet", *more)
        return root / f"{name}.h5"

    def test_closed_forms(self):
        for name, faces, eps, temperatures, heats, truth in enclosures.cases(0):
            scene = lambert.Scene(self.precompute(name, faces, eps), library=False)
            T, q = heat.steady_state(scene, temperatures, heats)
            for key, value in truth.items():
                found = T[key[:-2]] if key.endswith(" K") else q[key]
                self.assertLess(abs(found / value - 1), 1e-4, (name, key))
            # The heat that is put in leaves elsewhere, to the single precision of the largest part of it.
            total = [q[g] * scene.groups[g].area for g in q]
            self.assertLess(abs(sum(total)), 1e-5 * max(map(abs, total)), name)

    def test_black_surfaces_exchange_by_form_factors(self):
        """Of black surfaces K is F: that of the tables of view factors."""
        for size, table in FACTORS.items():
            faces = enclosures.box(*size)
            walls = faces.pop("walls")
            faces |= {name: [wall] for name, wall in zip(("west", "north", "east", "south"), walls)}
            scene = lambert.Scene(self.precompute("black", faces, dict.fromkeys(faces, 1)), library=False)
            K = heat.responses(scene, list(faces))
            for (a, b), F in table.items():
                self.assertLess(abs(K[list(faces).index(a), list(faces).index(b)] / F - 1), 1e-4, (size, a, b))

    def test_a_finer_mesh_keeps_what_needs_no_mesh(self):
        """Walls that are all as warm are as warm everywhere inside, and no heat flows: to the error of row sums that are made 1."""
        eps = {"floor": 0.8, "ceiling": 0.6, "walls": 0.3}
        scene = lambert.Scene(self.precompute("even", enclosures.box(1, 1, 1), eps, "--elements", 150), library=False)
        self.assertGreater(scene.n, 100)
        T, q = heat.steady_state(scene, {"floor": 300, "ceiling": 300}, {"walls": 0})
        self.assertAlmostEqual(T["walls"], 300, delta=1e-3)
        self.assertLess(max(map(abs, q.values())), 1e-5 * heat.SIGMA * 300**4)

    def test_program(self):
        store = self.precompute("room", enclosures.box(10, 6, 3), {"floor": 0.8, "ceiling": 0.6, "walls": 0.3})
        address = self.serve(store)
        T = (100 / enclosures.insulated(1, 0, 0.8, 0.6, enclosures.ROOM) + 290**4) ** 0.25
        for where in (store, address + "/room"):
            lines = self.printed("heat.py", where, "floor=100W/m2", "ceiling=290K", "walls=0W/m2").splitlines()
            self.assertEqual([line.split()[0] for line in lines[:3]], ["floor", "ceiling", "walls"])
            self.assertAlmostEqual(float(lines[0].split()[3]), T, delta=1e-4 * T)
        self.refused("walls: each surface needs a temperature or a heat", "heat.py", store, "floor=300K", "ceiling=290K")
        self.refused("no group is called walz; there are floor, ceiling, walls", "heat.py", store, "walz=300K")
        self.refused("floor would have to emit less than nothing", "heat.py", store, "floor=-1000W/m2", "ceiling=290K", "walls=0W/m2")
        self.refused("one surface at least needs a temperature", "heat.py", store, "floor=1W/m2", "ceiling=0W/m2", "walls=0W/m2")
        self.assertIn("must be GROUP=TEMPERATUREK or GROUP=HEATW/m2", run("heat.py", store, "floor=300").stderr)


PAINT = {"floor": (0.35, 0.2, 0.1), "ceiling": (0.85, 0.85, 0.8), "back-wall": (0.3, 0.4, 0.6), "left-wall": (0.2, 0.5, 0.3),
         "right-wall": (0.7, 0.6, 0.2)}


class Materials(InverseCase):
    """A room is painted as in a picture, whose paint is known."""

    @classmethod
    def setUpClass(cls):
        root = cls.folder()
        must("generate", "cornell", "--elements", 150, "-o", root / "box.obj")
        with open(root / "box.mtl", "a", encoding="ascii") as out:
            out.write("".join(f"newmtl {name}\nKd {r} {g} {b}\n" for name, (r, g, b) in PAINT.items()))
        painted = re.sub(rf"^o ({'|'.join(PAINT)})\nusemtl \w+$", r"o \1\nusemtl \1", (root / "box.obj").read_text(), flags=re.M)
        (root / "painted.obj").write_text(painted)
        must("precompute", root / "painted.obj", "-o", root / "painted.h5", "--method", "exact", "--probes", 0, "--quiet")
        must("solve", root / "painted.h5", "-o", root / "wanted.npy")
        cls.store, cls.wanted = root / "box.h5", root / "wanted.npy"
        must("precompute", root / "box.obj", "-o", cls.store, "--method", "low-rank", "--epsilon", 0.002, "--keep-factors", "--probes", 0, "--quiet")
        (root / "token").write_text("secret")
        (root / "token").chmod(0o600)
        cls.address = cls.serve(cls.store, "--token-file", root / "token", "--max-variants", 4) + "/box"

    def test_paint_is_found(self):
        for where in (self.store, self.address):
            lines = self.printed("materials.py", where, self.wanted, *PAINT, "--token", "secret").splitlines()
            found = {line.split()[0]: np.array(line.split()[1:], float) for line in lines[:-1]}
            self.assertEqual(list(found), list(PAINT))
            for name, paint in PAINT.items():
                # Reflectances move light by as much as themselves; the operators differ by 0.002 in the norm.
                self.assertLess(abs(found[name] - paint).max(), 0.002, name)

    def test_slopes_are_those_of_the_goal(self):
        painter = materials.Painter(lambert.Scene(self.address, token="secret"), list(PAINT), np.load(self.wanted))
        x = np.random.default_rng(3).uniform(0.2, 0.8, 15)
        value, slopes = painter.goal(x)
        way = slopes / np.linalg.norm(slopes)
        h = 0.02
        difference = (painter.goal(x + h * way)[0] - painter.goal(x - h * way)[0]) / (2 * h)
        # A central difference is off by h^2 / 6 of the third derivative: some h^2 of the slope.
        self.assertLess(abs(difference / np.linalg.norm(slopes) - 1), 10 * h**2)
        self.assertGreater(value, 0.01)
        self.assertEqual([scene["name"] for scene in lambert.connect(self.address.rpartition("/")[0], token="secret").scenes()], ["box"])

    def test_words(self):
        np.save(self.store.parent / "short.npy", np.ones((3, 10)))
        self.refused("the picture has the shape [3, 10], must have [3, ", "materials.py", self.store, self.store.parent / "short.npy", "floor")
        self.refused("no group is called flor; there are floor", "materials.py", self.store, self.wanted, "flor")
        self.refused("401", "materials.py", self.address, self.wanted, "floor")


class Skylights(InverseCase):
    """A roof of 16 patches, of which at most two open: all choices are tried."""

    @classmethod
    def setUpClass(cls):
        root = cls.folder()
        done = run("hall.py", root, "--divisions", 4)
        assert done.returncode == 0, done.stderr
        must("precompute", root / "site.obj", "-o", root / "site.h5", "--elements", 150, "--sky", "grid:8x4", "--method", "exact", "--probes", 0, "--quiet")
        must("precompute", root / "hall.obj", "-o", root / "hall.h5", "--elements", 150, "--emitters", root / "emitters.json", "--probes", 0, "--quiet")
        (root / "year.epw").write_text(weather.epw(weather.a_year()))
        must("sky", root / "year.epw", "--tiles", "grid:8x4", "--photometric", "-o", root / "year.npy")
        np.save(root / "some.npy", np.load(root / "year.npy").reshape(365, 24, -1)[::20].reshape(-1, 32))
        cls.root = root
        cls.address = cls.serve(root / "site.h5", root / "hall.h5")

    def test_no_choice_is_better(self):
        with unittest.mock.patch.object(openings, "PASSES", 0.1):
            p = openings.Openings(lambert.Scene(self.root / "site.h5", library=False), lambert.Scene(self.root / "hall.h5", library=False),
                                  np.load(self.root / "some.npy"), 0.05)
        every = {frozenset(c): p.useful(frozenset(c)) for k in range(3) for c in itertools.combinations(range(16), k)}
        best = max(every.values())
        self.assertGreater(best, sorted(every.values())[len(every) // 2] + 0.1)
        greedy = p.greedy(2)
        self.assertAlmostEqual(greedy[1], every[greedy[0]], delta=1e-3)
        p.tried = 0
        found, value = p.search(2, 1000, 1)
        # One element in an hour that is at a limit to single precision may count or not.
        self.assertAlmostEqual(value, best, delta=1e-3)
        self.assertAlmostEqual(every[found], best, delta=1e-3)
        self.assertGreaterEqual(p.bound(2), best)
        self.assertGreaterEqual(best + 1e-3, greedy[1])
        self.assertAlmostEqual(p.bound(16), float(p.share @ (p.light(range(16)) >= openings.LOW).sum(0)) / p.hours, delta=1e-3)

    def test_program(self):
        for where in ((self.root / "site.h5", self.root / "hall.h5"), (self.address + "/site", self.address + "/hall")):
            text = self.printed("openings.py", *where, self.root / "some.npy", "--most", 2, "--tries", 200, "--cap", 0.6)
            self.assertRegex(text, r"open: roof-\d-\d")
            value, greedy, bound = map(float, re.search(r"useful in ([\d.-]+) % .*; greedy ([\d.-]+) %, bound ([\d.]+) %", text).groups())
            self.assertTrue(greedy <= value <= bound, text)
            # The sum of patches by NumPy and by the scene: single precision.
            self.assertLess(float(re.search(r"and differs by (\S+) of the most", text)[1]), 1e-5)

    def test_words(self):
        np.save(self.root / "odd.npy", np.ones((25, 32)))
        self.refused("the year has the shape [25, 32], must have [24 days, 32]", "openings.py", self.root / "site.h5", self.root / "hall.h5",
                     self.root / "odd.npy")
        self.refused("hall.py writes both", "openings.py", self.root / "hall.h5", self.root / "site.h5", self.root / "some.npy")


if __name__ == "__main__":
    unittest.main()
