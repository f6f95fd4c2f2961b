"""Errors of light that whole groups emit: those that were measured for them, by each way of asking, beside the true ones."""

import json
import os
import unittest

import h5py
import numpy as np

from case import Case
from command import must
from daemon import Daemon

PANES = [f"pane-{k}" for k in range(1, 5)]


def room(path):
    """A room of 80 x 60 cm tiles with four panes of two triangles in a wall, and a box of splinters on its floor."""
    corners, lines = [], []

    def quad(name, a, b, c, d, n=1, m=1):
        lines.append(f"g {name}\nusemtl {'dark' if name.startswith('pane') else 'wall'}")
        a, b, c, d = (np.array(x, dtype=float) for x in (a, b, c, d))
        first = len(corners) + 1
        corners.extend((1 - i / n) * ((1 - j / m) * a + j / m * d) + i / n * ((1 - j / m) * b + j / m * c)
                       for i in range(n + 1) for j in range(m + 1))
        for i in range(n):
            for j in range(m):
                k = first + i * (m + 1) + j
                if name.startswith("pane"):
                    lines.extend((f"f {k} {k + m + 1} {k + m + 2}", f"f {k} {k + m + 2} {k + 1}"))
                else:
                    lines.append(f"f {k} {k + m + 1} {k + m + 2} {k + 1}")

    quad("floor", (0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0), 16, 12)
    quad("ceiling", (0, 3, 2.5), (4, 3, 2.5), (4, 0, 2.5), (0, 0, 2.5), 16, 12)
    quad("south", (0, 0, 0), (0, 0, 2.5), (4, 0, 2.5), (4, 0, 0), 10, 16)
    quad("west", (0, 3, 0), (0, 3, 2.5), (0, 0, 2.5), (0, 0, 0), 10, 12)
    quad("east", (4, 0, 0), (4, 0, 2.5), (4, 3, 2.5), (4, 3, 0), 10, 12)
    quad("north", (4, 3, 0), (4, 3, 1), (0, 3, 1), (0, 3, 0), 4, 16)
    quad("north", (4, 3, 2), (4, 3, 2.5), (0, 3, 2.5), (0, 3, 2), 2, 16)
    for k in range(4):
        quad("north", (k + .2, 3, 1), (k + .2, 3, 2), (k, 3, 2), (k, 3, 1), 4, 1)
        quad(PANES[k], (k + 1, 3, 1), (k + 1, 3, 2), (k + .2, 3, 2), (k + .2, 3, 1))
    for k in range(100):
        x, y = 1 + .1 * (k % 20), 1 + .2 * (k // 20)
        quad("splinters", (x, y, .1), (x + .02, y, .1), (x + .02, y + .02, .1), (x, y + .02, .1))
    with open(path, "w", encoding="utf-8") as file:
        file.write("mtllib room.mtl\n" + "".join("v %.6f %.6f %.6f\n" % tuple(c) for c in corners) + "\n".join(lines) + "\n")
    with open(os.path.join(os.path.dirname(path), "room.mtl"), "w", encoding="utf-8") as file:
        file.write("newmtl wall\nKd .6 .6 .6\nnewmtl dark\nKd .1 .1 .1\n")


class WholeGroups(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        scene = os.path.join(cls.shared.name, "room.obj")
        cls.asked, cls.sources = (os.path.join(cls.shared.name, name) for name in ("room.h5", "sources.h5"))
        cls.truths = [os.path.join(cls.shared.name, f"truth-{k}.h5") for k in range(2)]
        room(scene)
        must("precompute", scene, "-o", cls.asked, "--method", "hierarchical", "--probes", 16, "--quiet")
        must("precompute", scene, "-o", cls.sources, "--sources", ",".join(PANES), "--method", "hierarchical",
             "--probes", 16, "--quiet")
        for k, truth in enumerate(cls.truths):
            must("precompute", scene, "-o", truth, "--probes", 0, "--method", "exact", "--quality", "high", "--seed", 7 + k,
                 "--quiet")
        with h5py.File(cls.asked) as store:
            cls.names = [name.decode() for name in store["mesh/group_names"]]
            cls.group, cls.area = store["mesh/group"][:], store["mesh/area"][:]
            cls.lit = [cls.names[k] for k in store["error/by_group/whole_groups"]]

    def emission(self, groups):
        return np.array([groups.get(self.names[k], 0) for k in self.group], dtype=float)

    def lights(self):
        """Single groups, and mixtures of some."""
        draw = np.random.default_rng(3)
        yield from ({name: 1} for name in self.lit)
        for _ in range(6):
            yield {name: draw.uniform(.2, 1) for name in draw.choice(self.lit, draw.integers(2, len(self.lit)), replace=False)}

    def test_panes_and_large_groups_are_judged_without_lamps(self):
        self.assertEqual(set(self.lit[:4]), set(PANES))
        self.assertEqual(set(self.lit[4:6]), {"floor", "ceiling"})
        self.assertEqual(len(self.lit), min(4 + 8, len(self.names)))
        with h5py.File(self.sources) as store:
            lit = {self.names[k] for k in store["error/by_group/whole_groups"]}
        self.assertEqual(lit, set(PANES))

    def true_ratios(self, store, lights):
        """True over stated error of all elements, and of the means of groups, for each light."""
        elements, means = [], []
        with Daemon(store, "--threads", 2) as daemon, Daemon(*self.truths) as truth:
            for light in lights:
                request = {"emission": {"groups": light}, "limit": False}
                answer = daemon.radiosity(os.path.basename(store)[:-3], request).json()
                right = np.mean([truth.radiosity(f"truth-{k}", request).json()["radiosity"] for k in range(2)], axis=0)
                bounced, off = right - self.emission(light), np.array(answer["radiosity"]) - right
                error = np.sqrt((self.area * off**2).sum() / (self.area * bounced**2).sum())
                elements.append(error / answer["error"]["indirect_mean"])
                told = daemon.radiosity(os.path.basename(store)[:-3], {**request, "reduce": {"groups": self.names, "with": ["mean"]}}).json()
                for k, name in enumerate(self.names):
                    weight = self.area * (self.group == k)
                    true = abs((weight * off).sum() / (weight * bounced).sum())
                    means.append(true / told["error"]["groups"][name]["mean"])
        return np.array(elements), np.array(means)

    def check(self, store, lights):
        elements, means = self.true_ratios(store, lights)
        self.assertLess(elements.max(), 1.25)
        self.assertGreater(elements.min(), .8)
        self.assertGreaterEqual((means < 2).mean(), .95, np.sort(means)[-10:])
        self.assertGreaterEqual((means > .2).mean(), .5)

    def test_what_is_stated_is_true(self):
        self.check(self.asked, self.lights())

    def test_windows_that_are_named_are_judged(self):
        self.check(self.sources, [{name: 1} for name in PANES] + [{name: 1 for name in PANES}, {PANES[0]: 1, PANES[3]: .2}])

    def test_every_way_of_asking_states_the_same(self):
        light = {self.lit[0]: 1, self.lit[3]: .25, "splinters": 2}
        dense = self.emission(light).tolist()
        path = os.path.join(self.shared.name, "light.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"emission": dense}, file)
        with Daemon(self.asked) as daemon:
            ask = lambda **request: daemon.radiosity("room", request).json()["error"]
            whole, of_list = ask(emission={"groups": light}), ask(emission=dense)
            self.assertAlmostEqual(whole["indirect_mean"], of_list["indirect_mean"], delta=1e-6 * whole["indirect_mean"])
            reduce = {"groups": ["floor", "south", "splinters"], "with": ["mean"]}
            linear, reduced = ask(emission={"groups": light}, reduce=reduce, limit=False), ask(emission=dense, reduce=reduce, limit=False)
            for name in reduce["groups"]:
                self.assertAlmostEqual(linear["groups"][name]["mean"], reduced["groups"][name]["mean"],
                                       delta=1e-3 * linear["groups"][name]["mean"])
            # One element that differs makes its group no whole one.
            dense[int(np.flatnonzero(self.group == self.names.index(self.lit[0]))[0])] = .5
            self.assertGreater(abs(ask(emission=dense)["indirect_mean"] / whole["indirect_mean"] - 1), 1e-3)
        solved = json.loads(must("solve", self.asked, "--emission", path, "--json").stdout)["error"]
        self.assertAlmostEqual(solved["indirect_mean"], of_list["indirect_mean"], delta=1e-6 * whole["indirect_mean"])


if __name__ == "__main__":
    unittest.main()
