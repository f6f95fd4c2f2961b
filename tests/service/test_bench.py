"""Black box: `lambert bench`, its files, and whether what it measures makes sense."""

import csv
import json
import math
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
import xml.etree.ElementTree

from command import ENVIRONMENT, LAMBERT, lambert
from patience import PATIENCE

COLUMNS = {
    "closed-forms": "case source method occluded truth estimate absolute_error relative_error stated_bar repeats "
                    "covered worst_error seconds",
    "closed-forms-summary": "method open_worst open_median hidden_worst zero_worst covered seconds",
    "enclosures": "enclosure source method quantity from to truth estimate error own_accuracy",
    "enclosures-summary": "enclosure method F_worst F_own B_worst B_own seconds",
    "throughput": "scene elements rays threads bare facets counted whole counted_ratio whole_ratio facets_ratio "
                  "bare_speedup counted_speedup own_share",
    "resolution": "scene elements resolution seconds density speedup error density_1 density_2 density_3 speedup_1 "
                  "error_1 error_2 error_3",
    "error": "scene elements method reference seconds entries single_mean single_q05 single_median single_q95 lamp",
}


class FormFactors(unittest.TestCase):
    """One quick run, looked at from all sides."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.out = os.path.join(cls.folder.name, "results")
        cls.done = lambert("bench", "formfactors", "--quick", "-o", cls.out)
        assert cls.done.returncode == 0, cls.done.stderr
        cls.tables = {}
        for name in COLUMNS:
            with open(cls.path(name, "csv"), newline="", encoding="utf-8") as file:
                cls.tables[name] = list(csv.DictReader(file))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name, extension):
        return os.path.join(cls.out, f"formfactors-{name}.{extension}")

    def rows(self, name, **wanted):
        found = [row for row in self.tables[name] if all(row[key].startswith(w) for key, w in wanted.items())]
        self.assertGreater(len(found), 0, wanted)
        return found

    def test_files(self):
        plots = [name for name in os.listdir(self.out) if name.endswith(".svg")]
        self.assertGreaterEqual(len(plots), 3)
        self.assertEqual(len(os.listdir(self.out)), 2 * len(COLUMNS) + 2 * len(plots), os.listdir(self.out))
        self.assertIn(f"{len(os.listdir(self.out))} files in", self.done.stdout)
        for name in plots:
            root = xml.etree.ElementTree.parse(os.path.join(self.out, name)).getroot()
            self.assertTrue(root.tag.endswith("svg"))
            with open(os.path.join(self.out, name[:-3] + "png"), "rb") as file:
                self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")

    def test_columns_and_json(self):
        for name, columns in COLUMNS.items():
            with open(self.path(name, "csv"), newline="", encoding="utf-8") as file:
                self.assertEqual(next(csv.reader(file)), columns.split(), name)
            with open(self.path(name, "json"), encoding="utf-8") as file:
                whole = json.load(file)
            self.assertEqual([column["name"] for column in whole["columns"]], columns.split())
            self.assertEqual(whole["run"]["scale"], "quick")
            self.assertEqual(len(whole["rows"]), len(self.tables[name]))
            for row, same in zip(whole["rows"], self.tables[name]):
                for key, value in row.items():
                    if isinstance(value, float):
                        self.assertAlmostEqual(value, float(same[key]), delta=1e-9 * abs(value))
                    else:
                        self.assertEqual(value or "", same[key])

    def test_closed_forms(self):
        self.assertEqual(len({row["case"] for row in self.tables["closed-forms"]}), 34)
        for row in self.rows("closed-forms", method="pair by pair", occluded="0"):
            self.assertLessEqual(float(row["relative_error"]), 1e-6, row)
        for row in self.rows("closed-forms", truth="0"):
            if row["truth"] == "0":
                self.assertEqual(float(row["worst_error"]), 0, row)
        for row in self.rows("closed-forms", method="4096 rays"):
            # the bar is two standard errors of independent rays: twice that is 1 in 16,000
            self.assertLessEqual(float(row["absolute_error"]), 2 * float(row["stated_bar"]) + 1e-12, row)
        for row in self.rows("closed-forms", method="hemicube"):
            self.assertEqual((row["stated_bar"], row["covered"]), ("", ""))

    def test_enclosures(self):
        # published to 2.1e-5; stated are 7e-5 a pair, and a surface has up to three pieces
        for row in self.rows("enclosures", enclosure="L-room", method="pair", quantity="F"):
            self.assertLessEqual(float(row["error"]), 2.1e-5 + 3 * 2 * 7e-5, row)
        for row in self.rows("enclosures", enclosure="square", method="pair", quantity="F"):
            self.assertLessEqual(float(row["error"]), float(row["own_accuracy"]), row)
        self.assertEqual(len(self.rows("enclosures", method="pair", quantity="B")), 8)

    def test_throughput(self):
        self.assertEqual({row["threads"] for row in self.tables["throughput"]}, {"1", "2"})
        for row in self.tables["throughput"]:
            for key in ("bare", "counted", "whole", "counted_ratio", "counted_speedup"):
                self.assertGreater(float(row[key]), 0, row)
            # rays of the bare loop must not end where it begins
            self.assertLess(float(row["own_share"]), 1e-3, row)

    def test_resolution(self):
        rows = self.tables["resolution"]
        self.assertEqual([row["resolution"] for row in rows], ["64", "32"])
        self.assertEqual(float(rows[0]["error"]), 0)
        self.assertTrue(0 < float(rows[1]["error"]) < 1, rows)
        self.assertEqual(rows[1]["error_2"], "0.1281")  # the thesis' own

    def test_error_against_time(self):
        few, many = (float(self.rows("error", method=f"{rays} rays")[0]["single_mean"]) for rays in (256, 1024))
        pairs = float(self.rows("error", method="pair")[0]["single_mean"])
        # four times the rays: half the noise; low-discrepancy rays do no worse than .8
        self.assertLess(many, .8 * few)
        self.assertLess(pairs, .1 * many)
        for row in self.tables["error"]:
            self.assertTrue(0 < float(row["single_q05"]) <= float(row["single_median"]) <= float(row["single_q95"]))
            self.assertTrue(math.isfinite(float(row["lamp"])))


class Mesh(unittest.TestCase):
    """One quick run: a Cornell box, uniform and adaptive, against both truths, and under skies."""

    def test_errors_of_the_mesh(self):
        with tempfile.TemporaryDirectory() as folder:
            done = lambert("bench", "mesh", "--quick", "-o", folder)
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(os.path.join(folder, "mesh-mesh.csv"), encoding="utf-8", newline="") as stream:
                rows = list(csv.DictReader(stream))
            with open(os.path.join(folder, "mesh-skies.csv"), encoding="utf-8", newline="") as stream:
                skies = list(csv.DictReader(stream))
        self.assertEqual([row["sky"] for row in skies], ["even", "cloudy"])
        for row in skies:
            self.assertTrue(.5 < float(row["stated"]) / float(row["constant"]) < 2, row)
        self.assertEqual({(row["mesh"], row["light"]) for row in rows},
                         {(mesh, light) for mesh in ("uniform", "adaptive") for light in ("lamps", "even")})
        self.assertEqual({row["method"] for row in rows}, {"converged", "hierarchical"})
        for row in rows:
            constant, means, stated = (float(row[name]) for name in ("constant", "means", "stated"))
            # the stated error is the truth within a factor of 2
            self.assertTrue(.5 * constant < stated < 2 * constant, row)
            self.assertLess(means, constant, row)
            # points have the finer mesh's error within 3 standard errors and the 4 % that 16 parts leave
            self.assertLess(abs(float(row["points"]) - constant), 3 * float(row["bar"]) + .04 * constant, row)


class Honesty(unittest.TestCase):
    """One quick run: answers to random requests to a Cornell box, open with skies and closed, state errors like the true ones."""

    COUNTS = ["requests", "below", "above", "median", "largest", "unstated"]

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        done = lambert("bench", "honesty", "--quick", "-o", folder.name)
        assert done.returncode == 0, done.stderr
        cls.tables = {}
        for name in "scenes", "kinds", "mesh":
            with open(os.path.join(folder.name, f"honesty-{name}.csv"), encoding="utf-8", newline="") as stream:
                cls.tables[name] = list(csv.DictReader(stream))

    def shares(self, row):
        return [float(row[name]) for name in ("below", "above")]

    def test_scenes(self):
        rows = self.tables["scenes"]
        self.assertEqual(list(rows[0]), ["scene", "elements", *self.COUNTS])
        self.assertEqual([row["scene"] for row in rows], ["cornell", "closed cornell", "all"])
        for row in rows:
            below, above = self.shares(row)
            # Of 30 requests of a scene, reductions state an error for each group.
            self.assertGreaterEqual(float(row["requests"]), 30 if row["scene"] != "all" else 60, row)
            self.assertGreaterEqual(below, .9, row)
            # An error stated ten times too large would be above nothing.
            self.assertGreaterEqual(above, .5, row)
            self.assertEqual(float(row["unstated"]), 0, row)
            self.assertTrue(.2 < float(row["median"]) < 2 and float(row["median"]) <= float(row["largest"]), row)
        self.assertEqual(float(rows[2]["requests"]), sum(float(row["requests"]) for row in rows[:2]))

    def test_mesh(self):
        """Headlines, which have the mesh in them, beside elements 16 times smaller."""
        rows = self.tables["mesh"]
        self.assertEqual([row["scene"] for row in rows], ["cornell", "closed cornell", "all"])
        for row in rows:
            below, above = self.shares(row)
            self.assertGreaterEqual(float(row["requests"]), 30, row)
            self.assertGreaterEqual(below, .95, row)
            self.assertGreaterEqual(above, .5, row)
            self.assertEqual(float(row["unstated"]), 0, row)
            self.assertTrue(.2 < float(row["median"]) < 2, row)

    def test_kinds(self):
        rows = self.tables["kinds"]
        self.assertEqual(list(rows[0]), ["by", "kind", *self.COUNTS])
        whole = self.tables["scenes"][-1]
        for by, kinds, beside in (
                ("emission", {"group", "groups", "element", "elements", "random", "own", "even sky", "cloudy sky", "sun"},
                 {"luminaire", "luminaires"}),
                ("target", {"all", "group", "elements", "reduce"}, {"sensors", "sensors' means"})):
            of = [row for row in rows if row["by"] == by]
            # Luminaires and sensors are asked for beside finer elements alone.
            self.assertEqual({row["kind"] for row in of}, kinds | beside)
            self.assertEqual({float(row["requests"]) for row in of if row["kind"] in beside}, {0})
            for name, place in (("below", 0), ("above", 1)):
                counted = sum(float(row["requests"]) * self.shares(row)[place] for row in of if float(row["requests"]) > 0)
                self.assertAlmostEqual(counted, float(whole["requests"]) * float(whole[name]), delta=.5)


class Hierarchical(unittest.TestCase):
    """One quick run: every kind on two scenes, and what it says of them at equal error."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.out = os.path.join(folder.name, "results")
        done = lambert("bench", "hierarchical", "--quick", "--json", "-o", cls.out)
        assert done.returncode == 0, done.stderr
        cls.printed = json.loads(done.stdout)
        cls.tables = {}
        for name in "hierarchical", "equal-error", "plane", "plane-equal", "smooth", "growth":
            with open(os.path.join(cls.out, f"hierarchical-{name}.csv"), encoding="utf-8", newline="") as stream:
                cls.tables[name] = list(csv.DictReader(stream))

    def test_json_on_standard_output(self):
        self.assertEqual(list(self.printed), [f"hierarchical-{name}" for name in self.tables])
        for name, table in self.printed.items():
            with open(os.path.join(self.out, f"{name}.json"), encoding="utf-8") as file:
                self.assertEqual(table, json.load(file))

    def test_every_kind(self):
        rows = self.tables["hierarchical"]
        kinds = {"hierarchical", "low-rank", "2msc", "sparse", "exact", "emitters"}
        for scene in "city 1", "cornell":
            of = [row for row in rows if row["scene"] == scene]
            self.assertEqual({row["kind"] for row in of}, kinds)
            whole, = (row for row in of if row["kind"] == "exact")
            for row in of:
                for light in "single", "random":
                    self.assertLessEqual(float(row[light + "_relative"]), 1.001 * float(row[light]), row)
                self.assertGreater(float(row["stored_mb"]), 0)
                if row["kind"] == "hierarchical":
                    self.assertLess(float(row["stored_mb"]), .5 * float(whole["stored_mb"]))
            for what in "memory", "build-time", "query-time":
                name = f"hierarchical-{scene.replace(' ', '-')}-by-{what}.png"
                self.assertTrue(os.path.exists(os.path.join(self.out, name)), name)

    def test_at_equal_error(self):
        points = {(row["scene"], row["setting"]): row for row in self.tables["hierarchical"]
                  if row["kind"] == "hierarchical"}
        rows = self.tables["equal-error"]
        self.assertEqual({row["light"] for row in rows if row["scene"] == "cornell"}, {"single", "lights", "random"})
        for row in rows:
            own = points[row["scene"], row["epsilon"]]
            self.assertEqual(row["error"], own[row["light"]])
            if row["least_kind"] == "-":
                self.assertEqual(row["stored_share"], "")
                continue
            self.assertAlmostEqual(float(row["stored_share"]), float(row["stored_mb"]) / float(row["least_mb"]), 4)
            others = [float(other["stored_mb"]) for other in self.tables["hierarchical"]
                      if other["scene"] == row["scene"] and other["kind"] == row["least_kind"]
                      and float(other[row["light"]]) <= float(row["error"])]
            self.assertLessEqual(float(row["least_mb"]), min(others))

    def test_plane(self):
        rows = self.tables["plane"]
        ways = {"rays", "near pairs", "pairs", "blocks"}
        for scene in "city 1", "cornell":
            of = [row for row in rows if row["scene"] == scene]
            self.assertEqual({row["form_factors"] for row in of}, ways)
            for way in ways:
                coarse, middle, fine = (row for row in of if row["form_factors"] == way)
                # Errors fall with epsilon; the reference of a quick run is of rays, whose noise hides that of single
                # elements, but not that of the operator in random emission.
                self.assertLess(float(fine["random"]), float(coarse["random"]), way)
                self.assertGreater(float(middle["stored_mb"]), float(coarse["stored_mb"]))
                self.assertGreater(float(middle["form_factors_s"]), 0)
                self.assertEqual(scene == "city 1", middle["lights"] == "")
        points = {(row["scene"], row["epsilon"]): row for row in rows if row["form_factors"] == "blocks"}
        for row in self.tables["plane-equal"]:
            own = points[row["scene"], row["epsilon"]]
            self.assertEqual(row["error"], own[row["light"]])
            spent = float(own["form_factors_s"]) + float(own["build_s"])
            self.assertAlmostEqual(float(row["time_s"]), spent, delta=1e-3 * spent)
            if row["other"] == "-":
                self.assertEqual(row["ratio"], "")
                continue
            self.assertAlmostEqual(float(row["ratio"]), float(row["other_s"]) / float(row["time_s"]),
                                   delta=1e-3 * float(row["ratio"]))

    def test_smooth(self):
        small, large = self.tables["smooth"]
        for row in small, large:
            self.assertEqual(int(row["finer"]), 16 * int(row["elements"]))
            self.assertLess(float(row["means"]), float(row["constant"]))
            self.assertAlmostEqual(float(row["ratio"]), float(row["constant"]) / float(row["smooth"]), 4)
        # Some ten elements to a wall do not resolve the shadows; from there on their light is nearly linear.
        self.assertLess(float(large["smooth"]), float(large["constant"]))
        self.assertLess(float(large["smooth"]), float(small["smooth"]))

    def test_growth(self):
        for recipe in "blocks", "near-pairs":
            small, large = (row for row in self.tables["growth"] if row["form_factors"] == recipe)
            self.assertEqual(small["exponent"], "")
            self.assertGreater(float(large["elements"]), 1.9 * float(small["elements"]))
            for row in small, large:
                self.assertLess(float(row["uniform"]), 1e-3)
                self.assertAlmostEqual(float(row["ratio"]), float(row["low_rank_ms"]) / float(row["query_ms"]), 3)
                self.assertLess(float(row["noise"]), float(row["single"]))
                self.assertLess(float(row["single"]), .2)


class Cities(unittest.TestCase):
    """One quick run: columns beside those of the thesis, and errors that fall as they must."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        out = os.path.join(folder.name, "results")
        done = lambert("bench", "cities", "--quick", "-o", out)
        assert done.returncode == 0, done.stderr
        cls.tables = {}
        for name in "times", "errors", "emitters", "density", "relaxation":
            with open(os.path.join(out, f"cities-{name}.csv"), encoding="utf-8", newline="") as stream:
                cls.tables[name] = [{key: float(value) if value.replace(".", "").replace("e-", "").isdigit() else value
                                     for key, value in row.items()} for row in csv.DictReader(stream)]

    def test_errors(self):
        rows = self.tables["errors"]
        self.assertEqual([(row["city"], row["threshold"]) for row in rows],
                         [(city, threshold) for city in (1, 2, 3) for threshold in (1e-3, 1e-4, 1e-5)])
        for row in rows:
            for way in "none", "discarded", "delta":
                self.assertTrue(0 < row[way + "_mean"] <= row[way + "_max"], row)
                self.assertLess(row[way + "_mean"], row[way + "_indirect"])
            self.assertLess(row["discarded_mean"], row["none_mean"])
            self.assertLess(row["delta_mean"], row["none_mean"])
        for high, low in zip(rows, rows[1:]):
            if high["city"] == low["city"]:
                self.assertLess(low["none_mean"], .5 * high["none_mean"])

    def test_times(self):
        rows = self.tables["times"]
        for row in rows:
            self.assertGreater(row["jacobi_s"], 0)
            self.assertAlmostEqual(row["speedup"], row["jacobi_s"] / (row["inverse_s"] + row["product_s"]), 1)
            self.assertTrue(1 <= row["sweeps"] < 40, row)
        for high, low in zip(rows, rows[1:]):
            if high["city"] == low["city"]:
                self.assertGreater(low["density"], high["density"])
                self.assertGreaterEqual(low["sweeps"], high["sweeps"])

    def test_emitters(self):
        for row in self.tables["emitters"]:
            self.assertEqual(row["emitters"], 132)
            self.assertLess(row["residual"], 1e-6)
            self.assertTrue(1e-5 < row["five_sweeps_error"] < .1, row)

    def test_relaxation(self):
        """Every iteration converges to the reference, Gauss-Seidel in fewer sweeps than Jacobi; stochastic shooting errs as
        one over the root of its rays."""
        products = {}
        for row in self.tables["relaxation"]:
            products.setdefault((row["scene"], row["method"]), []).append((row["error"], row["products"]))
        for scene in "city 1", "city 3":
            for method in "Jacobi", "Gauss-Seidel", "shooting", "conjugate gradients":
                errors, steps = zip(*products[scene, method])
                self.assertLess(errors[-1], 1e-6)
                self.assertEqual(list(errors), sorted(errors, reverse=True))
                self.assertEqual(list(steps), sorted(steps))
            self.assertLess(products[scene, "Gauss-Seidel"][-1][1], products[scene, "Jacobi"][-1][1])
            coarse, fine = products[scene, "stochastic shooting"]
            self.assertTrue(.2 < (coarse[0] / fine[0]) ** 2 * coarse[1] / fine[1] < 5, (coarse, fine))
            self.assertLess(products[scene, "sparse threshold 1e-05"][0][0], products[scene, "sparse threshold 0.001"][0][0])

    def test_density(self):
        rows = self.tables["density"]
        self.assertEqual({row["terrain"] for row in rows}, {"flat", "valley", "hill"})
        for row in rows:
            self.assertTrue(1 < row["density"] < 30, row)


class Reuse(unittest.TestCase):
    """One quick run: paths that serve all positions of a lamp beside paths of their own."""

    @classmethod
    def setUpClass(cls):
        cls.tables = {}
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "results")
            done = lambert("bench", "reuse", "--quick", "-o", out)
            assert done.returncode == 0, done.stderr
            for name in "positions", "maps", "speed":
                with open(os.path.join(out, f"reuse-{name}.csv"), encoding="utf-8", newline="") as stream:
                    cls.tables[name] = list(csv.DictReader(stream))

    def test_positions(self):
        rows = self.tables["positions"]
        self.assertEqual([row["approach"][0] for row in rows], list("ABCDBE" * 4))
        for row in rows:
            own = row["approach"][0] == "A"
            self.assertTrue(2 < float(row["rays_per_path"]) < 4, row)
            for frame in "1", "15", "20", "mean", "largest":
                ratio = float(row["mse_" + frame])
                self.assertTrue(ratio == 1 if own else ratio > 2, row)
            self.assertTrue(own or float(row["flicker"]) > 5, row)
            self.assertTrue(row["approach"][0] != "E" or float(row["mse_mean"]) > 10, row)
            self.assertEqual(float(row["maps_s"]) > 0, row["approach"][0] in "CD")

    def test_counts(self):
        """Counts of paths by a pilot lower the largest error: by a third of it, where they are said to."""
        rows = {(row["experiment"], row["paths"], row["approach"]): row for row in self.tables["positions"]}
        for experiment in "1", "2":
            same, uneven = (float(rows[experiment, "640", name]["mse_largest"])
                            for name in ("B, reused, rays", "B, uneven counts"))
            self.assertGreater(uneven, 1.2 * same)

    def test_maps(self):
        """Finer maps have less bias."""
        bias = {(row["approach"][0], row["resolution"]): float(row["bias"]) for row in self.tables["maps"]}
        for approach in "C", "D":
            self.assertLess(bias[approach, "64"], .5 * bias[approach, "16"])

    def test_speed(self):
        for row in self.tables["speed"]:
            self.assertGreater(float(row["bare_ns"]), 0)
            self.assertAlmostEqual(float(row["ratio"]), float(row["bare_ns"]) / float(row["walk_ns"]), delta=.01)


class Refusals(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def refused(self, status, wanted, *arguments):
        done = lambert("bench", *arguments)
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(wanted, done.stderr)
        self.assertEqual(done.stdout, "")

    def test_usage(self):
        out = os.path.join(self.folder, "out")
        self.refused(2, "too few arguments", "-o", out)
        self.refused(2, "no such suite", "speed", "-o", out)
        self.refused(2, "exclude each other", "formfactors", "--quick", "--full", "-o", out)
        self.refused(2, "no such suite", "formfactors", "nothing", "-o", out)
        self.assertEqual(os.listdir(self.folder), [])

    def test_folders(self):
        self.refused(1, "cannot be made", "formfactors", "-o", os.path.join(self.folder, "no", "parent"))
        file = os.path.join(self.folder, "file")
        with open(file, "w", encoding="utf-8") as stream:
            stream.write("mine")
        self.refused(1, "not a directory", "formfactors", "-o", file)
        self.assertEqual(os.listdir(self.folder), ["file"])

    def test_without_the_program(self):
        """lambert alone, neither beside lambert-bench nor with it in PATH."""
        alone = shutil.copy(LAMBERT, self.folder)
        done = subprocess.run([alone, "bench", "formfactors"], capture_output=True, text=True, check=False,
                              env=dict(ENVIRONMENT, PATH=self.folder))
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), done.stderr)
        self.assertIn("the program lambert-bench cannot be run: No such file or directory", done.stderr)

    def test_scene_is_missed_at_once(self):
        self.refused(1, "none.obj", "formfactors", "--scene", os.path.join(self.folder, "none.obj"), "-o",
                     os.path.join(self.folder, "out"))
        self.assertEqual(os.listdir(self.folder), [])

    def test_cancelled(self):
        """Ctrl-C leaves whole files only; what a test run needs for its scenes is gone too."""
        out, scratch = os.path.join(self.folder, "out"), os.path.join(self.folder, "scratch")
        os.mkdir(scratch)
        with subprocess.Popen([LAMBERT, "bench", "formfactors", "-o", out], stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True, env=dict(ENVIRONMENT, TMPDIR=scratch)) as running:
            until = time.monotonic() + PATIENCE
            while not os.path.isdir(out) and time.monotonic() < until:
                time.sleep(.01)
            time.sleep(.3)
            running.send_signal(signal.SIGINT)
            _, said = running.communicate(timeout=PATIENCE)
        self.assertEqual(running.returncode, 1, said)
        self.assertIn("cancelled", said)
        self.assertEqual(os.listdir(scratch), [])
        if os.path.isdir(out):
            for name in os.listdir(out):
                self.assertFalse(name.startswith("."), name)


if __name__ == "__main__":
    unittest.main()
