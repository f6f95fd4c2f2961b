"""A folder of scenes and stores for tests of the command line, and how it refuses."""

import os
import tempfile
import unittest

from command import lambert, must


class Case(unittest.TestCase):
    """A folder of scenes and stores, made once; every test has a folder of its own besides."""

    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory()
        cls.box = os.path.join(cls.shared.name, "box.obj")
        cls.store = os.path.join(cls.shared.name, "box.h5")
        must("generate", "box", "--divisions", 4, "--reflectance", .5, "-o", cls.box)
        must("precompute", cls.box, "-o", cls.store, "--method", "exact", "--rays", 256, "--probes", 8,
             "--keep-form-factors", "--quiet")

    @classmethod
    def tearDownClass(cls):
        cls.shared.cleanup()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def refused(self, status, wanted, *arguments, **more):
        """It fails with this status and one line that says so, and writes nothing else."""
        done = lambert(*arguments, **more)
        self.assertEqual(done.returncode, status, (arguments, done.stderr))
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, (arguments, done.stderr))
        self.assertTrue(lines[0].startswith("lambert"), lines[0])
        self.assertIn(wanted, lines[0], arguments)
        return done

    def failed(self, wanted, *arguments, **more):
        """As refused with 1; the log may come before the line."""
        done = lambert(*arguments, **more)
        self.assertEqual(done.returncode, 1, (arguments, done.stderr))
        self.assertTrue(done.stderr.splitlines()[-1].startswith("lambert "), done.stderr)
        self.assertIn(wanted, done.stderr.splitlines()[-1])
        return done
