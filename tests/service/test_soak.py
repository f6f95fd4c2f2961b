"""The soaks of tests/soak for some seconds, so that they work when somebody needs them for hours."""

import os
import pathlib
import subprocess
import sys
import unittest

from patience import PATIENCE

SOAK = pathlib.Path(__file__).resolve().parents[1] / "soak"


class Soak(unittest.TestCase):
    def run_soak(self, name, *arguments):
        done = subprocess.run([sys.executable, SOAK / name, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                              check=False, env=dict(os.environ, OMP_NUM_THREADS="2"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_raw(self):
        said = self.run_soak("raw.py", 2000)
        self.assertIn("'200'", said)
        self.assertIn("'400'", said)

    def test_mixed(self):
        self.assertIn("no fault", self.run_soak("mixed.py", 8, "untimed"))


if __name__ == "__main__":
    unittest.main()
