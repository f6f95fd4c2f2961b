"""Inverse lighting as a client does it: the program of deploy/examples beside the best emission, found another way."""

import io
import pathlib
import subprocess
import tempfile
import unittest

import h5py
import numpy as np
from scipy.optimize import nnls

from command import EXAMPLES, ENVIRONMENT, must
from daemon import Daemon
from patience import PATIENCE

ASKED, WEIGHT = 20, 1e-3


class Inverse(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lambert-inverse-")
        root = pathlib.Path(cls.folder.name)
        cls.store = root / "box.h5"
        must("generate", "cornell", "--elements", 250, "-o", root / "box.obj")
        must("precompute", root / "box.obj", "-o", cls.store, "--method", "hierarchical", "--epsilon", ".02", "--probes", 0)
        cls.daemon = Daemon(cls.store)
        cls.scene = f"http://127.0.0.1:{cls.daemon.port}/v1/scenes/box"
        with h5py.File(cls.store, "r") as f:
            names = [name.decode() for name in f["mesh/group_names"][()]]
            group, cls.area = f["mesh/group"][()], f["mesh/area"][()]
        cls.sources, cls.targets = (np.flatnonzero(group == names.index(name)) for name in ("ceiling", "floor"))

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            pass
        cls.folder.cleanup()

    def run_example(self, *arguments):
        return subprocess.run(["/usr/bin/python3", EXAMPLES / "inverse_light.py", self.store, *map(str, arguments)],
                              capture_output=True, timeout=PATIENCE, env=ENVIRONMENT, check=False)

    def irradiances(self):
        """[targets][sources], mean of the channels, by one request for each source."""
        columns = []
        for s in self.sources:
            answer = self.daemon.radiosity("box", {
                "emission": {"elements": [int(s)], "values": [1]}, "quantity": "irradiance",
                "select": {"elements": self.targets.tolist()}})
            self.assertEqual(answer.status, 200, answer)
            columns.append(np.mean(answer.json()["irradiance"], axis=0))
        return np.transpose(columns)

    def test_no_emission_is_better(self):
        done = self.run_example(self.scene, "ceiling", "floor", ASKED, WEIGHT)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr.decode(), r"^floor has 20 W/m2 within \d")
        found = np.load(io.BytesIO(done.stdout))
        self.assertTrue((found >= 0).all() and not np.delete(found, self.sources).any())
        # The same least squares over all columns at once: rows of the targets, then of the weight.
        share = self.area[self.targets] / self.area[self.targets].sum()
        cost = self.area[self.sources] / self.area[self.sources].sum()
        A = np.vstack([np.sqrt(share)[:, None] * self.irradiances(), np.diag(np.sqrt(WEIGHT * cost))])
        b = np.concatenate([np.sqrt(share), np.zeros(len(self.sources))])
        best, residual = nnls(A, b)
        self.assertGreater(best.max(), 0)
        self.assertLess(np.linalg.norm(A @ (found[self.sources] / ASKED) - b), 1.002 * residual)

    def test_words(self):
        for arguments, words in (((self.scene, "cieling", "floor", ASKED), b"no group is called cieling; there are floor, ceiling,"),
                                 ((self.scene + "s", "ceiling", "floor", ASKED), b"no scene"), ((self.scene,), b"usage: "),
                                 ((self.scene, "ceiling", "floor", "nan"), b"IRRADIANCE nan: must be a number"),
                                 ((self.scene, "ceiling", "floor", ASKED, -1), b"WEIGHT -1: must be a number of at least 0"),
                                 ((self.scene, "ceiling", "ceiling", ASKED), b"ceiling: SOURCE and TARGET are one group"),
                                 (("http://127.0.0.1:1/v1/scenes/box", "ceiling", "floor", ASKED), b"Connection refused")):
            done = self.run_example(*arguments)
            self.assertEqual(done.returncode, 1)
            self.assertIn(words, done.stderr)
            self.assertNotIn(b"Traceback", done.stderr)


if __name__ == "__main__":
    unittest.main()
