"""The surroundings that a tool is started in: limits that somebody has set for another program."""

import os
import pathlib
import subprocess
import tempfile
import unittest

from command import LAMBERT, must
from patience import PATIENCE


class Surroundings(unittest.TestCase):
    def test_fewer_threads_than_cores(self):
        """OpenBLAS waits for ever for threads that OMP_THREAD_LIMIT does not give it, unless it is told."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            must("generate", "box", "--divisions", 6, "-o", folder / "box.obj")
            for limit in "1", "2":
                done = subprocess.run([LAMBERT, "precompute", folder / "box.obj", "-o", folder / "box.h5", "--quiet",
                                       "--rays", "64", "--probes", "0", "--mesh", "faces"], capture_output=True, text=True, timeout=PATIENCE,
                                      env=dict(os.environ, OMP_NUM_THREADS="2", OMP_THREAD_LIMIT=limit))
                self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
