"""Form factors by rays that nobody keeps: a hierarchical operator takes their rows as they are found."""
import json
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

import h5py
import numpy as np

from command import ENVIRONMENT, LAMBERT, REFERENCE, lambert, must
from patience import PATIENCE

SAID = r"(?m)^rays, wavelets +[\d.]+ s$"
HELD = r"(?m)^form factors +[\d.]+ s$"


def operator(path):
    """All that a store says of its operator, by name."""
    found = {}
    with h5py.File(path, "r") as f:
        f["operator"].visititems(lambda name, item: found.update({name: item[()]}) if hasattr(item, "shape") else None)
    return found


class Streamed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-streamed-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.scene, cls.city = cls.folder / "box.obj", cls.folder / "city.obj"
        must("generate", "cornell", "--closed", "--elements", 3000, "--reflectance", .6, "-o", cls.scene)
        must("generate", "city", "--elements", 3000, "-o", cls.city)
        cls.store = cls.folder / "store.h5"
        cls.common = ("--method", "hierarchical", "--rays", 1536)
        cls.said = must("precompute", cls.scene, "-o", cls.store, *cls.common, "--probes", 8).stderr

    def path(self, name):
        return self.folder / name

    def test_it_is_as_near_as_with_rows_that_are_held(self):
        held, scratch = self.path("held.h5"), self.path("scratch")
        scratch.mkdir()
        said = must("precompute", self.scene, "-o", held, *self.common, "--probes", 8, "--scratch", scratch, program=REFERENCE).stderr
        self.assertRegex(self.said, SAID)
        self.assertNotRegex(self.said, HELD)
        self.assertRegex(said, HELD)
        self.assertNotRegex(said, SAID)
        errors = [json.loads(must("info", path, "--json").stdout)["error"] for path in (self.store, held)]
        for light in "single", "lights", "random":
            streamed, other = (error[light]["total_indirect_mean"] for error in errors)
            self.assertLess(streamed, 1.1 * other + .002, light)
        with h5py.File(self.store) as one, h5py.File(held) as two:
            np.testing.assert_allclose(one["mesh/row_sums"][()], two["mesh/row_sums"][()], atol=1e-4)
            self.assertLess(one["operator"].attrs["uniform_error"], 2e-3)
            for name in "rays", "form_factors":
                if name in two["operator"].attrs:
                    self.assertEqual(one["operator"].attrs[name], two["operator"].attrs[name])
            # The threshold follows the noise of the rows, for the stream by 64 rays of 1,024 elements. In a closed box each row has the
            # sum 1, and terms 2 A_i / (A_i + A_j) within .3 of 1: a standard error of their mean of .3 / 32 = .009 at most, half for the root.
            np.testing.assert_allclose(one["operator"].attrs["threshold"], two["operator"].attrs["threshold"], rtol=.015)
        for path in self.store, held:
            must("verify", path, "--probes", 4)

    def test_what_threads_and_the_judge_do_not_change(self):
        first = operator(self.store)
        for threads in 1, 3:
            again = self.path("again.h5")
            must("precompute", self.scene, "-o", again, *self.common, "--probes", 0, threads=threads)
            second = operator(again)
            self.assertEqual(sorted(first), sorted(second))
            for name, value in first.items():
                np.testing.assert_array_equal(value, second[name], name)

    def test_where_somebody_else_wants_the_rows(self):
        kept = self.path("kept.h5")
        said = must("precompute", self.scene, "-o", kept, *self.common, "--probes", 0, "--keep-form-factors").stderr
        self.assertRegex(said, HELD)
        with h5py.File(kept) as f:
            self.assertIn("form_factors", f)
        with h5py.File(self.store) as f:
            self.assertNotIn("form_factors", f)
        said = must("precompute", self.scene, "-o", kept, "--method", "low-rank", "--rank", 40, "--rays", 1536,
                    "--probes", 0).stderr
        self.assertRegex(said, HELD)

    def test_auto_needs_no_look_at_rows(self):
        large, path = self.path("large.obj"), self.path("large.h5")
        must("generate", "cornell", "--closed", "--elements", 12500, "-o", large)
        said = must("precompute", large, "-o", path, "--rays", 512, "--probes", 0).stderr
        self.assertRegex(said, SAID)
        self.assertIn("too large for the whole inverse, too noisy for a sparse one", said)
        # Rows would take 100 MB more.
        forecast = re.search(r"memory up to (\d+)M", said)
        held = must("precompute", large, "-o", path, "--rays", 512, "--probes", 0, "--keep-form-factors", program=REFERENCE).stderr
        self.assertGreater(int(re.search(r"memory up to (\d+)M", held)[1]), int(forecast[1]) + 80)
        self.assertRegex(held, HELD)
        # A look at the scene asks for rows itself, and counts them.
        done = lambert("classify", large, "--rays", 512, "--memory", "130M")
        self.assertEqual(done.returncode, 1)
        self.assertIn("need about", done.stderr)

    def test_a_sky(self):
        path, held, scratch = self.path("sky.h5"), self.path("held-sky.h5"), self.path("scratch-sky")
        scratch.mkdir()
        common = (*self.common, "--probes", 0, "--sky", "reinhart:1")
        self.assertRegex(must("precompute", self.city, "-o", path, *common).stderr, SAID)
        self.assertRegex(must("precompute", self.city, "-o", held, *common, "--scratch", scratch, program=REFERENCE).stderr, HELD)
        with h5py.File(path) as one, h5py.File(held) as two:
            sky, other = one["sky/first_bounce"][()].astype(float), two["sky/first_bounce"][()].astype(float)
            self.assertEqual(sky.shape, other.shape)
            self.assertLess(np.abs(sky - other).sum(), .01 * other.sum())
            # The light that elements send to others, the sky and the ground (which gives a fifth back) is all there is.
            self.assertLess((one["mesh/row_sums"][()] + sky.sum(axis=0) / np.pi).max(), 1 + 1e-5)

    def test_it_ends_when_asked_to(self):
        path = self.path("never.h5")
        run = subprocess.Popen([LAMBERT, "precompute", self.scene, "-o", path, "--method", "hierarchical", "--rays",
                                "400000", "--probes", "0", "--mesh", "faces"], stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        said = ""
        while "forecast:" not in said:  # it is the last line before the rays start
            line = run.stderr.readline()
            self.assertTrue(line, said)
            said += line
        time.sleep(.3)
        run.send_signal(signal.SIGINT)
        said += run.communicate(timeout=PATIENCE)[1]
        self.assertEqual(run.returncode, 1, said)
        self.assertIn("cancelled; nothing was written", said)
        self.assertFalse(path.exists())

    def test_too_little_memory(self):
        done = lambert("precompute", self.scene, "-o", self.path("no.h5"), *self.common, "--probes", 8, "--memory", "60M")
        self.assertEqual(done.returncode, 1)
        self.assertIn("--probes 0, or", done.stderr)
        self.assertFalse(self.path("no.h5").exists())


if __name__ == "__main__":
    unittest.main()
