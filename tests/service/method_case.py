"""A folder with form factors and a Cornell box of one method, for tests that follow a method from the command line to
the daemon."""

import os
import tempfile
import unittest

import h5py
import numpy

from command import lambert, must
from daemon import Daemon


class MethodCase(unittest.TestCase):
    """A subclass names its `method` and the `kind` of its stores, and sets `factors`, a store that keeps form factors."""

    method = kind = factors = None

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix=f"lambert-{cls.method}-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        must("generate", "cornell", "--elements", 700, "-o", cls.path("cornell.obj"))
        cls.cornell = cls.path("cornell.h5")
        must("precompute", cls.path("cornell.obj"), "-o", cls.cornell, "--rays", 256, "--probes", 4,
             "--method", cls.method, "--quiet")

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def build(self, *options, name="out.h5", probes=0):
        """A store of `factors`, and what the log says."""
        done = must("precompute", self.factors, "-o", self.path(name), "--method", self.method, "--probes", probes, *options)
        return self.path(name), done.stderr

    def refused(self, status, wanted, *arguments):
        done = lambert(*arguments)
        self.assertEqual(done.returncode, status, (arguments, done.stderr))
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        self.assertIn(wanted, done.stderr)

    def check_same_bits(self, datasets, *options):
        """Any number of threads makes the same arrays of /operator."""
        sums = []
        for threads in (1, 3):
            must("precompute", self.factors, "-o", self.path("t.h5"), "--method", self.method, "--probes", 0, "--quiet",
                 *options, threads=threads)
            with h5py.File(self.path("t.h5")) as file:
                sums.append([file["operator/" + name][()].tobytes() for name in datasets])
        self.assertEqual(sums[0], sums[1])

    def check_daemon(self):
        """The same bits from a socket as from `lambert solve`, for one lighting and in a batch; the description."""
        must("solve", self.cornell, "--emit", "lamp=17,12,4", "-o", self.path("B.npy"))
        expected = numpy.load(self.path("B.npy")).reshape(3, -1)
        lamp = {"groups": {"lamp": [17, 12, 4]}}
        with Daemon(self.cornell) as daemon:
            one = daemon.post("/v1/scenes/cornell/radiosity", {"emission": lamp}).json()
            batch = daemon.post("/v1/scenes/cornell/radiosity",
                                {"emissions": [{"groups": {"floor": 3}}, lamp]}).json()
            about = daemon.get("/v1/scenes/cornell").json()
        self.assertEqual(about["kind"], self.kind)
        numpy.testing.assert_array_equal(numpy.array(one["radiosity"], numpy.float32), expected)
        numpy.testing.assert_array_equal(numpy.array(batch["radiosity"][1], numpy.float32), expected)
        return about
