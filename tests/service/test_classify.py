"""Black box: `lambert classify`, and the choice of `--method auto` that follows it."""

import json
import os
import tempfile
import unittest

import h5py

from command import lambert, must


class Classify(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-classify-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        must("generate", "city", "--variant", 1, "--elements", 2000, "-o", cls.path("city.obj"))
        must("generate", "cornell", "--elements", 1300, "-o", cls.path("cornell.obj"))

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def look(self, name, *options):
        return json.loads(must("classify", self.path(name), "--json", "--rays", 256, *options).stdout)

    def test_auto_builds_what_classify_names(self):
        """With the form factors kept both see the same ones; a city is sparse, a room is not."""
        for scene, method in (("city", "sparse"), ("cornell", "hierarchical")):
            store = self.path(f"{scene}.h5")
            must("precompute", self.path(f"{scene}.obj"), "-o", store, "--rays", 256, "--epsilon", .15, "--probes", 0,
                 "--keep-form-factors", "--quiet")
            found = self.look(f"{scene}.h5", "--epsilon", .15)
            with h5py.File(store) as file:
                built = file["operator"].attrs
                self.assertEqual(built["kind"].decode(), method)
                self.assertIn(f"F is {100 * found['density']:.3g} % dense", built["reason"].decode())
                entries = file["form_factors/indptr"][-1]
                n = len(file["mesh/area"])
            self.assertEqual(found["method"], method)
            self.assertEqual(found["elements"], n)
            self.assertAlmostEqual(found["density"], entries / n ** 2)
            self.assertEqual(found["rank"]["epsilon"], .15)
            self.assertIsNone(found["rays"])  # of the store
            costs = found["numbers"]
            self.assertEqual(costs["exact"], n * n)
            self.assertAlmostEqual(costs["low-rank"], 2 * n * found["rank"]["estimate"], delta=1e-6 * n * n)
            self.assertEqual(costs[method], min(cost for cost in costs.values() if cost is not None))
            self.assertIsNone(costs["emitters"])
            info = json.loads(must("info", store, "--json").stdout)
            self.assertIn(f"{method}: F is", info["reason"])
        with h5py.File(self.path("city.h5")) as file:
            self.assertGreater(file["operator"].attrs["threshold"], 0)

    def test_a_threshold_that_is_given_is_kept(self):
        store = self.path("given.h5")
        done = must("precompute", self.path("city.obj"), "-o", store, "--rays", 256, "--epsilon", .15, "--threshold", 1e-5,
                    "--probes", 0)
        self.assertNotIn("does not use --threshold", done.stderr)
        with h5py.File(store) as file:
            self.assertEqual(file["operator"].attrs["threshold"], 1e-5)
        self.assertEqual(self.look("city.obj", "--epsilon", .15, "--threshold", 1e-5)["sparse"]["threshold"], 1e-5)

    def test_errors_come_before_time(self):
        """A threshold that loses the light of groups makes the fastest operator, which auto does not take."""
        done = must("precompute", self.path("city.obj"), "-o", self.path("lossy.h5"), "--rays", 256, "--threshold", 2e-3,
                    "--probes", 0)
        self.assertIn("does not use --threshold", done.stderr)
        self.assertRegex(done.stderr, r"exact: F is .*sparse would take 0\.\d+ times as long and err by ")

    def test_scenes_and_text(self):
        first, again = (must("classify", self.path("city.obj"), "--seed", 5).stdout for _ in range(2))
        self.assertEqual(first, again)
        for word in ("elements", "density", "4096 rays", "rank estimate", "method", "reason", "<-"):
            self.assertIn(word, first)
        self.assertEqual(self.look("cornell.obj")["rays"], 256)
        finer = self.look("cornell.obj", "--elements", 5200)
        self.assertGreater(finer["elements"], 4 * 1250)

    def test_what_low_rank_alone_has(self):
        """Is asked for, and auto takes low rank in place of what is hierarchical; by --rank anywhere."""
        store = self.path("asked.h5")
        for options in ("--rank", 40), ("--store-precision", "f16"), ("--factorizer", "hf"), ("--keep-factors",):
            done = must("precompute", self.path("cornell.obj"), "-o", store, "--rays", 64, "--epsilon", .4, "--probes", 0,
                        *options)
            self.assertNotIn(f"does not use {options[0]}", done.stderr)
            with h5py.File(store) as file:
                self.assertEqual(file["operator"].attrs["kind"].decode(), "low_rank", options)
        for options, kind in ((("--rank", 40), "low_rank"), (("--store-precision", "f16"), "sparse")):
            done = must("precompute", self.path("city.obj"), "-o", store, "--rays", 256, "--epsilon", .15, "--probes", 0,
                        *options)
            self.assertEqual(f"does not use --epsilon, {options[0]}" in done.stderr, kind == "sparse")
            with h5py.File(store) as file:
                self.assertEqual(file["operator"].attrs["kind"].decode(), kind, options)

    def test_noise_leaves_one_choice(self):
        """Where rays are so few that their noise is more than epsilon, a sparse inverse would be of noise."""
        found = self.look("city.obj")
        self.assertEqual(found["method"], "hierarchical")
        self.assertIsNone(found["sparse"])
        coarser = self.look("city.obj", "--epsilon", .15)
        self.assertEqual(coarser["method"], "sparse")
        self.assertLess(coarser["numbers"]["sparse"], coarser["numbers"]["hierarchical"])

    def test_few_emitters_are_the_answer_where_they_are_given(self):
        found = self.look("city.obj", "--sky", "grid:4x3", "--emitters", "sky")
        self.assertEqual(found["method"], "emitters")
        self.assertEqual(found["numbers"]["emitters"], 12 * found["elements"])
        self.assertLess(found["numbers"]["emitters"], found["numbers"]["hierarchical"])

    def test_small_scenes_keep_the_whole_inverse(self):
        must("generate", "box", "--divisions", 4, "-o", self.path("box.obj"))
        found = self.look("box.obj")
        self.assertEqual(found["method"], "exact")
        self.assertIn("few enough", found["reason"])

    def test_nothing_to_look_at(self):
        for status, wanted, *arguments in (
                (1, "nothing.obj", self.path("nothing.obj")),
                (2, "--epsilon", self.path("city.obj"), "--epsilon", 0),
                (2, "exclude each other", self.path("city.obj"), "--max-edge", 1, "--elements", 5000),
                (1, "--memory", self.path("city.obj"), "--memory", "1M"),
                (1, "--sky", self.path("city.obj"), "--emitters", "sky"),
                (2, "SCENE",)):
            done = lambert("classify", *arguments)
            self.assertEqual(done.returncode, status, (arguments, done.stderr))
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
            self.assertIn(wanted, done.stderr)
            self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    unittest.main()
