"""The one stated error: in answers of the daemon and of solve, in what precompute says at its end on a terminal and elsewhere, and in info."""

import json
import math
import os
import pty
import subprocess
import unittest

from case import Case
from command import ENVIRONMENT, LAMBERT, lambert, must, of_faces
from daemon import Daemon
from patience import PATIENCE
from quads import Quads


def on_terminal(*arguments):
    """Runs lambert with a terminal as its standard error; the lines that this shows."""
    mine, its = pty.openpty()
    with subprocess.Popen([LAMBERT, *of_faces(arguments)], stdout=subprocess.PIPE, stderr=its, env=ENVIRONMENT) as run:
        os.close(its)
        shown = b""
        try:
            while more := os.read(mine, 4096):
                shown += more
        except OSError:  # the other side is closed
            pass
        os.close(mine)
        status = run.wait(PATIENCE)
    assert status == 0, (arguments, shown)
    # An erased line of progress is no line of its own.
    return [line.rpartition("\033[K")[2] for line in shown.decode().replace("\r\n", "\n").split("\n") if line]


class Headline(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.rooms = os.path.join(cls.shared.name, "rooms.obj")
        cls.lit = os.path.join(cls.shared.name, "lit.h5")
        must("generate", "rooms", "--elements", 120, "-o", cls.rooms)
        must("precompute", cls.rooms, "-o", cls.lit, "--probes", 8, "--quiet")

    def check(self, error):
        self.assertAlmostEqual(error["stated"], math.hypot(*error["parts"].values()), delta=1e-6 * error["stated"])
        self.assertEqual(error.get("coarse", False), error["stated"] > .1)
        self.assertEqual("advice" in error, error["stated"] > .1)
        return error["stated"]

    def test_answers_state_what_was_asked(self):
        light = {"emission": {"groups": {"lamp-1": 1}}}
        with Daemon(self.lit) as daemon:
            ask = lambda more: daemon.radiosity("lit", {**light, **more}).json()["error"]
            whole = ask({})
            self.check(whole)
            self.assertGreater(whole["parts"]["mesh"], 10 * whole["parts"]["operator"])
            groups = {name: self.check(ask({"select": {"groups": [name]}})) for name in ("floor", "ceiling", "lamp-2")}
            self.assertGreater(max(groups.values()), 1.2 * min(groups.values()))  # each its own
            reduced = ask({"reduce": {"groups": ["floor", "lamp-2"], "with": ["mean"]}})
            self.assertAlmostEqual(self.check(reduced), max(group["stated"] for group in reduced["groups"].values()), delta=1e-9)
            for name, group in reduced["groups"].items():
                self.assertLess(group["stated"], groups[name])  # of a mean less than of elements
            # Figures that are told by means alone are those of the whole answer.
            both = ask({"reduce": {"groups": ["floor", "lamp-2"], "with": ["mean", "max"]}})
            self.assertAlmostEqual(both["stated"], reduced["stated"], delta=.02 * both["stated"])
            batch = daemon.radiosity("lit", {"emissions": [{"groups": {"lamp-1": 1}}, {"groups": {"floor": 1}}]}).json()["error"]
            single = ask({"emission": {"groups": {"floor": 1}}})
            self.assertAlmostEqual(self.check(batch), max(whole["stated"], single["stated"]), delta=1e-6)
        told = json.loads(must("solve", self.lit, "--emit", "lamp-1=1", "--json").stdout)["error"]
        self.assertAlmostEqual(told["stated"], whole["stated"], delta=1e-4 * whole["stated"])

    def test_dark_groups_have_no_share(self):
        """A group that no light reaches has no error that were a share of it: it is left out, unless all are so."""
        rooms = Quads()
        for name, x in ("lit", 0), ("dark", 5):
            rooms.box(name, (x, 0, 0), (x + 4, 3, 2), (8, 6, 4))
        scene, store = self.path("two.obj"), self.path("two.h5")
        rooms.write(scene, .5)
        must("precompute", scene, "-o", store, "--probes", 8, "--method", "low-rank", "--quiet")
        plain = ("solve", store, "--emit", "lit0=1", "--quantity", "irradiance")
        with Daemon(store) as daemon:
            for names in ("lit1", "dark1"), ("dark1", "lit1"), ("lit1",), ("dark1", "dark2"):
                dark = [name for name in names if name.startswith("dark")]
                reduced = [part for name in names for part in ("--reduce", name + "=max")]
                error = json.loads(must(*plain, *reduced, "--json").stdout)["error"]
                asked = daemon.radiosity("two", {"emission": {"groups": {"lit0": 1}}, "quantity": "irradiance",
                                                 "reduce": {"groups": names, "with": ["max"]}}).json()["error"]
                for told in error, asked:
                    groups = told["groups"]
                    self.assertEqual([name for name in names if groups[name]["stated"] is None], dark, told)
                    self.assertEqual(told["stated"], None if len(dark) == len(names) else groups["lit1"]["stated"])
                    self.assertNotIn("coarse", told)
                lines = must(*plain, *reduced).stdout.splitlines()[1 + len(names):]
                if len(dark) == len(names):
                    self.assertEqual(lines, ["no error is stated: no light reaches what is asked for, so that it is no share of it"])
                else:
                    self.assertTrue(lines[0].startswith("stated error of this answer"))
                    self.assertEqual(lines[1:], [f"no error is stated of {name}, which no light reaches" for name in dark])

    def test_nothing_measured_is_null(self):
        store = self.path("none.h5")
        must("precompute", self.box, "-o", store, "--probes", 0, "--method", "low-rank", "--epsilon", .5, "--keep-factors")
        with Daemon(store, self.lit) as daemon:
            error = daemon.radiosity("none", {"emission": {"groups": {"floor": 1}}}).json()["error"]
            self.assertEqual(error, {"stated": None, "advice": "precompute without --probes 0 measures it"})

    def test_lines_at_the_end(self):
        """On a terminal they are all, beside warnings; with --verbose, and without a terminal, the log is before them."""
        store = self.path("a.h5")
        plain = ("precompute", self.rooms, "-o", store, "--probes", 8)
        logged = must(*plain).stderr.splitlines()
        self.assertGreater(len(logged), 12)
        last = logged[-3:]
        about = json.loads(must("info", store, "--json").stdout)
        n, groups, error = about["elements"], len(about["groups"]), about["error"]
        self.assertEqual(last[0], f"scene  rooms: {n} faces, one element each, in {groups} groups")
        self.assertTrue(last[1].startswith(f"error  {error['stated']:.2g} of the light that surfaces reflect, of the scene's own lights; most of it by "), last)
        self.assertEqual(last[1].endswith(f": coarse; {error.get('advice')}"), error["stated"] > .1)
        self.assertEqual(self.check(error), error["stated"])
        self.assertRegex(last[2], rf"^store  {store}, [\d.]+ [kM]B; to look at it: lambert view {store}$")
        said = on_terminal(*plain)
        self.assertEqual([line for line in said if "warning" not in line], last)
        self.assertEqual([line for line in logged if "warning" in line], [line for line in said if "warning" in line])
        verbose = on_terminal(*plain, "--verbose")
        self.assertEqual(verbose[-3:], last)
        self.assertGreater(len(verbose), 12)
        self.assertEqual(on_terminal(*plain, "--quiet"), [])
        self.assertEqual(must(*plain, "--quiet").stderr, "")
        told = must("info", store).stdout.splitlines()
        self.assertEqual(told[:3], [f"scene  rooms: {n} elements in {groups} groups", *last[1:]])

    def test_lines_of_divided_and_unmeasured(self):
        store = self.path("b.h5")
        said = on_terminal("precompute", self.box, "-o", store, "--elements", 400, "--probes", 0)[-3:]
        self.assertRegex(said[0], r"^scene  box: 96 faces, divided into \d+ elements in 6 groups$")
        self.assertEqual(said[1], "error  not measured; precompute without --probes 0 measures it")

    def test_a_failure_says_why(self):
        done = lambert("precompute", self.path("missing.obj"), "-o", self.path("c.h5"))
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1), done.stderr)


if __name__ == "__main__":
    unittest.main()
