"""Black box: figures of a year from `lambert solve --annual`, judged hour by hour by a dense solution in double, and the
annual sum of an open square by what its weather file says."""

import csv
import json
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

import numpy as np

from command import ENVIRONMENT, LAMBERT, lambert, must
from weather import a_year, epw, parts, sine_of_altitude, wea
from yard import Truth, write_yard
from patience import PATIENCE

DAYS = 3
SQUARE = "mtllib square.mtl\no square\nusemtl grey\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n"


def shares(x, low, high):
    """Of the first axis; and how far rounding may take them: hours within 1e-5 of a bound."""
    near = np.zeros(x.shape[1:])
    for bound in low, high:
        if bound not in (0, np.inf):
            near += (np.abs(x - bound) < 1e-5 * np.abs(x).max()).mean(axis=0)
    return ((x >= low) & (x <= high)).mean(axis=0), near + 1e-6


class Annual(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-annual-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        write_yard(cls.folder)
        (cls.folder / "square.obj").write_text(SQUARE)
        (cls.folder / "square.mtl").write_text("newmtl grey\nKd 0.5 0.5 0.5\n")
        kept = cls.folder / "kept.h5"
        must("precompute", cls.folder / "yard.obj", "-o", kept, "--elements", 150, "--rays", 1024, "--probes", 0,
             "--keep-form-factors", "--sky", "grid:4x3", "--ground-albedo", .3, "--method", "exact")
        cls.stores = {"exact": kept, "low-rank": cls.folder / "low.h5", "emitters": cls.folder / "sky.h5"}
        must("precompute", kept, "-o", cls.stores["low-rank"], "--probes", 0, "--method", "low-rank", "--epsilon", "1e-6")
        must("precompute", kept, "-o", cls.stores["emitters"], "--probes", 0, "--emitters", "sky")
        cls.truth = Truth(kept)
        rng = np.random.default_rng(3)
        hours = np.arange(24 * DAYS)
        cls.day = (hours % 24 >= 5) & (hours % 24 < 20)
        cls.skies = (rng.random((len(hours), 3, 12)) * rng.random((len(hours), 1, 1)) * 100 *
                     cls.day[:, None, None]).astype("<f4")
        np.save(cls.folder / "sky.npy", cls.skies)
        cls.hourly = {}
        for quantity in "irradiance", "radiosity", "indirect":
            cls.hourly[quantity] = np.array([cls.truth.solve(np.zeros((3, cls.truth.n)), L.astype(float), quantity)
                                             for L in cls.skies])

    def year(self, store, *options, sky=None):
        out = self.folder / "year.npy"
        done = must("solve", store, "--sky", sky or self.folder / "sky.npy", *options, "-o", out)
        return np.load(out), done

    def refused(self, status, wanted, *arguments):
        done = lambert("solve", *arguments)
        self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
        said = [line for line in done.stderr.splitlines() if line.startswith("lambert")]
        self.assertEqual(len(said), 1, done.stderr)
        self.assertIn(wanted, said[0])

    def test_against_every_hour(self):
        working = (np.arange(24 * DAYS) % 24 >= 8) & (np.arange(24 * DAYS) % 24 < 18)
        for kind, store in self.stores.items():
            for quantity, hourly in self.hourly.items():
                low, high = np.quantile(hourly[hourly > 0], (.3, .7)).round(3)
                options = ["--annual", "sum", "--annual", f"autonomy={low}", "--annual", f"useful={low},{high}"]
                if quantity != "irradiance":
                    options += ["--quantity", quantity]
                for counted, more in (slice(None), []), (working, ["--occupied", "8-18"]):
                    got, done = self.year(store, *options, *more)
                    self.assertEqual(got.shape, (3, 3, self.truth.n))
                    self.assertIn(f"a year of {quantity}: {24 * DAYS} vectors of 1 h, {15 * DAYS} with light\nshares are "
                                  f"of {(10 if more else 24) * DAYS} vectors\n", done.stderr)
                    total = hourly.sum(axis=0) / 1000
                    # An epsilon of 1e-6, and single precision.
                    np.testing.assert_allclose(got[0], total, atol=2e-5 * total.max(), err_msg=kind + quantity)
                    for figure, bounds in (got[1], (low, np.inf)), (got[2], (low, high)):
                        wanted, near = shares(hourly[counted], *bounds)
                        self.assertTrue((np.abs(figure - wanted) <= near).all(), (kind, quantity, bounds))
                        self.assertTrue(.05 < wanted.mean() < .9)

    def test_with_a_lamp(self):
        """A lamp that burns all day goes with every sky; vectors may last longer than an hour."""
        got, _ = self.year(self.stores["exact"], "--emit", "lamp=5,3,1", "--annual", "sum", "--hours-per-vector", 2,
                           "--quantity", "radiosity")
        lamp = self.truth.solve(self.truth.lamp([[5], [3], [1]]), np.zeros((3, 12)), "radiosity")
        wanted = (self.hourly["radiosity"] + lamp).sum(axis=0) * 2 / 1000
        np.testing.assert_allclose(got[0], wanted, atol=1e-5 * wanted.max())

    def test_sums_of_tiles_are_limited_as_hours_are(self):
        """A coarse operator puts light below zero: shares are those of the answers to hours, where these are sums of tiles, and of suns,
        not of parts that were limited each by itself, which moved them by up to .27 here."""
        scene, store, year, out = (self.folder / name for name in ("patio.obj", "patio.h5", "june.wea", "out.npy"))
        must("generate", "patio", "--elements", 700, "-o", scene)
        year.write_text(wea([row for row in a_year() if row[0] == 6 and row[1] < 15]))
        for method in "low-rank", "hierarchical":
            must("precompute", scene, "-o", store, "--mesh", "faces", "--form-factors", "rays", "--rays", 256, "--sky", "tregenza",
                 "--probes", 0, "--method", method, "--epsilon", .3)
            for way in ("--sun", "tiles"), ("--sun", "exact", "--sun-points", 4):
                answers = []
                for more in (), ("--linear",):
                    must("solve", store, "--weather", year, *way, "--quantity", "irradiance", *more, "-o", out)
                    answers.append(np.load(out).astype(float).reshape(24 * 14, -1))
                hours, plain = answers
                self.assertLess(plain.min(), 0)
                low, high = (float(f"{x:.6g}") for x in np.quantile(hours[hours > 0], [.1, .3]))
                must("solve", store, "--weather", year, *way, "--annual", f"autonomy={low:.6g}", "--annual", f"useful={low:.6g},{high:.6g}",
                     "-o", self.folder / "patio.json")
                figures = json.loads((self.folder / "patio.json").read_text())["annual"].values()
                for told, (low_bound, high_bound) in zip(figures, ((low, np.inf), (low, high))):
                    right, near = shares(hours, low_bound, high_bound)
                    self.assertLess((np.abs(np.ravel(told) - right) - near).max(), 1e-6, (method, way))

    def test_files_and_tables(self):
        figures = "sum", "autonomy_60", "useful_20_150"
        options = ["--annual", "sum", "--annual", "autonomy=60", "--annual", "useful=20,150"]
        got, _ = self.year(self.stores["exact"], *options)
        columns = [f"irradiance_{figure}_{c}{' [kWh/m2]' if figure == 'sum' else ''}" for figure in figures for c in "rgb"]
        out = self.folder / "year.csv"
        light = ["--sky", self.folder / "sky.npy"]
        must("solve", self.stores["exact"], *light, *options, "-o", out)
        table = list(csv.reader(out.read_text().splitlines()))
        self.assertEqual(table[0], ["element", "group", "area"] + columns)
        np.testing.assert_allclose(np.array([row[3:] for row in table[1:]], float).T, got.reshape(9, -1), rtol=1e-6)
        out = self.folder / "year.json"
        must("solve", self.stores["exact"], *light, *options, "-o", out)
        answer = json.loads(out.read_text())
        self.assertEqual((answer["quantity"], list(answer["annual"])), ("irradiance", list(figures)))
        np.testing.assert_array_equal(np.array([answer["annual"][f] for f in figures], np.float32), got)
        for name in "year.ply", "year.vtu", "year.glb":
            must("solve", self.stores["exact"], *light, *options, "-o", self.folder / name)
            text = (self.folder / name).read_bytes()
            for column in columns:
                name_of = column.split(" ")[0]
                self.assertIn((f'"_{name_of.upper()}"' if name == "year.glb" else name_of).encode(), text)
        # Means of groups where no file is asked for.
        said = must("solve", self.stores["exact"], *light, *options).stdout.splitlines()
        columns = [column.replace(" [", ", ").rstrip("]") for column in columns]
        self.assertEqual(re.findall(r"irradiance_\w+(?:, \S+)?", said[0]), columns)
        for column in columns:  # each number ends under the end of its name
            end = said[0].index(column) + len(column)
            self.assertRegex(said[1][end - 1:end + 1], r"^\d ?$")
        area, floor = self.truth.area, self.truth.group == self.truth.groups.index("floor")
        row = next(line.split() for line in said if line.startswith("floor"))
        means = (got.reshape(9, -1)[:, floor] * area[floor]).sum(axis=1) / area[floor].sum()
        np.testing.assert_allclose(np.array(row[-9:], float), means, rtol=1e-5)
        # A group's figure is made of those of its elements.
        must("solve", self.stores["exact"], *light, *options, "--reduce", "floor=mean,min", "-o", out)
        reduced = json.loads(out.read_text())["annual"]
        np.testing.assert_allclose([reduced[f]["floor"]["mean"] for f in figures], means.reshape(3, 3), rtol=1e-6)
        np.testing.assert_allclose([reduced[f]["floor"]["min"] for f in figures], got[:, :, floor].min(axis=2), rtol=1e-6)

    def test_an_open_square(self):
        """The sum of a year is the file's own, within .1 %: that of 65,536 rays on tiles, and sun of both formulas."""
        store, sky = self.folder / "square.h5", self.folder / "square.npy"
        must("precompute", self.folder / "square.obj", "-o", store, "--elements", 4, "--sky", "tregenza", "--method",
             "exact", "--probes", 0, "--rays", 65536)
        hours = list(a_year())
        horizontal = np.array([diffuse + direct * max(0, sine_of_altitude(2001, *when))
                               for *when, direct, diffuse in hours])
        (self.folder / "year.wea").write_text(wea(hours))
        must("sky", self.folder / "year.wea", "-o", sky)
        got, _ = self.year(store, "--annual", "sum", "--annual", "autonomy=200", "--occupied", "9-17", sky=sky)
        self.assertEqual(got.shape, (2, 4))
        np.testing.assert_allclose(got[0], horizontal.sum() / 1000, rtol=1e-3)
        office = horizontal.reshape(365, 24)[:, 9:17]
        near = (np.abs(office - 200) < 6).mean()  # by the noise of one tile, 3 %
        np.testing.assert_allclose(got[1], (office >= 200).mean(), atol=near)

    def test_the_dark(self):
        np.save(self.folder / "dark.npy", np.zeros((24, 3, 12), "<f4"))
        got, done = self.year(self.stores["exact"], "--annual", "sum", "--annual", "autonomy=1", "--annual",
                              "useful=0,5", sky=self.folder / "dark.npy")
        np.testing.assert_array_equal(got, np.broadcast_to(np.array([0, 0, 1])[:, None, None], got.shape))
        self.assertIn("warning: no vector has any light", done.stderr)

    def test_wrong_usage(self):
        store, light = self.stores["exact"], ["--sky", self.folder / "sky.npy"]
        for wanted, more in (
                ("--annual total: must be sum, autonomy=X, useful=LOW,HIGH, daylit=X, sun=X or sun=X,HOURS", ["--annual", "total"]),
                ("must be above 0", ["--annual", "autonomy=0"]),
                ("must be LOW,HIGH with 0 <= LOW < HIGH", ["--annual", "useful=2000,100"]),
                ("needs 2", ["--annual", "useful=2000"]),
                ("asked for twice", ["--annual", "sum", "--annual", "sum"]),
                ("--occupied is for --annual autonomy", ["--annual", "sum", "--occupied", "8-18"]),
                ("--occupied is for --annual autonomy", ["--occupied", "8-18"]),
                ("--occupied 18-8: must be FROM-TO", ["--annual", "autonomy=1", "--occupied", "18-8"]),
                ("--hours-per-vector is for --annual", ["--hours-per-vector", 2]),
                ("--hours-per-vector", ["--annual", "sum", "--hours-per-vector", 0])):
            self.refused(2, wanted, store, *light, *more)
        text = must("solve", "--help").stdout
        for word in "--annual --occupied --hours-per-vector autonomy useful kWh/m2".split():
            self.assertIn(word, text)

    def test_what_cannot_be(self):
        np.save(self.folder / "odd.npy", self.skies[:30])
        np.save(self.folder / "one.npy", self.skies[7])
        store = self.stores["exact"]
        self.refused(1, "30 vectors of 1 hours are not whole days", store, "--sky", self.folder / "odd.npy", "--annual",
                     "autonomy=9", "--occupied", "8-18")
        self.refused(1, "--annual is of a batch", store, "--sky", self.folder / "one.npy", "--annual", "sum")
        self.refused(1, "--annual is of a batch", store, "--emit", "lamp=1", "--annual", "sum")
        none = self.folder / "none.h5"
        must("precompute", self.folder / "square.obj", "-o", none, "--probes", 0, "--method", "exact")
        self.refused(1, "the store has no sky; precompute it with --sky", none, "--sky", self.folder / "sky.npy",
                     "--annual", "sum")

    def test_ctrl_c(self):
        """Between passes: a long batch of many skies is left within them, and nothing is written."""
        many, out = self.folder / "many.npy", self.folder / "stopped.npy"
        np.save(many, np.tile(self.skies[self.day], (1200, 1, 1)))
        command = [LAMBERT, "solve", self.stores["low-rank"], "--sky", many, "--annual", "autonomy=5", "-o", out]
        for wait in .6, .3, .15, .08, 1.5, 3:
            work = subprocess.Popen([str(word) for word in command], stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
            time.sleep(wait)
            work.send_signal(signal.SIGINT)
            _, said = work.communicate(timeout=PATIENCE)
            self.assertEqual(out.exists(), work.returncode == 0)
            out.unlink(missing_ok=True)
            if work.returncode > 0:
                self.assertIn("cancelled; nothing was written", said)
                return
        self.fail("was never stopped within the work")


class Rows(unittest.TestCase):
    """Weather in steps of any length, on a square under one tile of sky."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-annual-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        (cls.folder / "square.obj").write_text(SQUARE)
        (cls.folder / "square.mtl").write_text("newmtl grey\nKd 0.5 0.5 0.5\n")
        cls.store = cls.folder / "square.h5"
        must("precompute", cls.folder / "square.obj", "-o", cls.store, "--sky", "grid:1x1", "--method", "exact", "--probes", 0,
             "--rays", 1024)

    def refused(self, status, wanted, *arguments):
        done = lambert("solve", *arguments)
        self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
        self.assertIn(wanted, done.stderr.splitlines()[-1])

    def test_rows_of_parts_of_an_hour(self):
        """Weather counts by the duration of its rows, in sums and in shares of the hours of the day; a year of half hours is
        the year of hours. Light is diffuse, which no position of the sun changes: single precision is all that differs."""
        store, days = self.store, [(m, d, h, 0, diffuse) for m, d, h, _, diffuse in a_year()]
        some = days[24 * 171:24 * 172]
        figures = ["--annual", "sum", "--annual", "autonomy=75", "--annual", "useful=45,75", "--occupied", "8-18"]

        def solve(name, text, *more):
            (self.folder / name).write_text(text)
            done = must("solve", store, "--weather", self.folder / name, *figures, *more, "-o", self.folder / "year.npy")
            return np.load(self.folder / "year.npy").ravel(), done.stderr

        whole, _ = solve("day.wea", wea(some))
        self.assertTrue(0 < whole[1] < 1 and 0 < whole[2] < 1)
        for n in 2, 4, 12:
            for name, text in ("parts.wea", wea(parts(some, n))), ("parts.epw", epw(parts(some, n), step=1 / n, periods="6/21,6/21")):
                got, said = solve(name, text)
                np.testing.assert_allclose(got, whole, rtol=1e-6)
                self.assertIn(f"24 hours in {24 * n} rows of {1 / n:.4g} h", said)
                self.assertIn(f"a year of irradiance: {24 * n} vectors of {1 / n:g} h", said)
                self.assertIn(f"shares are of {10 * n} vectors\n", said)
        # The step may be said once more, and no other.
        got, _ = solve("parts.wea", wea(parts(some, 2)), "--hours-per-vector", .5)
        np.testing.assert_allclose(got, whole, rtol=1e-6)
        self.refused(1, "--hours-per-vector 1: the rows of", store, "--weather", self.folder / "parts.wea", *figures,
                     "--hours-per-vector", 1)
        # Rows have their hours of the day: those of 8 to 18 alone have the same shares, whether days are whole or not.
        got, said = solve("window.wea", wea([row for row in parts(some, 2) if 8 < row[2] < 18]))
        np.testing.assert_allclose(got[1:], whole[1:], rtol=1e-6)
        self.assertIn("10 hours in 20 rows of 0.5 h", said)
        # Noons alone are an hour each, or what is said.
        noons = [row for row in days if row[2] == 12.5]
        got, said = solve("noons.wea", wea(noons))
        np.testing.assert_allclose(got[0], sum(row[4] for row in noons) / 1000, rtol=.05)
        self.assertIn("warning: no two rows are an hour apart or less: each stands for one hour", said)
        twice, _ = solve("noons.wea", wea(noons), "--hours-per-vector", 2)
        np.testing.assert_allclose(twice[0], 2 * got[0], rtol=1e-6)
        year, _ = solve("year.wea", wea(days))
        halves, said = solve("halves.wea", wea(parts(days, 2)))
        # Single precision: each hour is rounded for itself.
        np.testing.assert_allclose(halves, year, rtol=1e-6)
        self.assertIn("8760 hours in 17520 rows of 0.5 h, 2001-01-01 to 2001-12-31\n", said)

    def test_an_array_that_is_longer_than_a_year(self):
        np.save(self.folder / "long.npy", np.ones((17520, 1), "<f4"))
        command = "solve", self.store, "--sky", self.folder / "long.npy", "--annual", "sum"
        done = must(*command)
        self.assertIn("warning: 17520 vectors of 1 h are 730 days; --hours-per-vector says", done.stderr)
        done = must(*command, "--hours-per-vector", .5)
        self.assertNotIn("warning", done.stderr)


if __name__ == "__main__":
    unittest.main()
