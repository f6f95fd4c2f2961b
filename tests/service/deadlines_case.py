"""A store whose form factors are kept, and solves of it that take minutes, for tests of solves that are not done."""

import json
import pathlib
import re
import tempfile
import unittest

from command import must
from daemon import Daemon
from guard_case import cuts, metrics, read_all, until  # noqa: F401, for the tests

N = 600


def refinement(n_vectors, tolerance=1e-9):
    """One that takes some milliseconds for each vector."""
    return json.dumps({"emissions": [{"elements": [i % N], "values": [1]} for i in range(n_vectors)], "tolerance": tolerance,
                       "select": {"elements": [0]}}).encode()


LONG = refinement(1 << 14)  # minutes
SHORT = json.dumps({"emission": {"groups": {}}, "select": {"elements": [0]}})


def head(body, *fields):
    return b"\r\n".join([b"POST /v1/scenes/box/radiosity HTTP/1.1", b"Host: localhost", b"Content-Type: application/json",
                         b"Content-Length: %d" % len(body), *fields, b"", b""])


def refused(daemon, why):
    return metrics(daemon)[("lambertd_solves_refused_total", ("why", why))]


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder = pathlib.Path(folder.name)
        cls.refinement = staticmethod(refinement)
        cls.store = folder / "box.h5"
        must("generate", "box", "--divisions", 10, "-o", folder / "box.obj")
        must("precompute", folder / "box.obj", "-o", cls.store, "--method", "low-rank", "--keep-form-factors", "--probes", 8,
             "--quiet")

    def daemon(self, *arguments):
        return Daemon(self.store, "--threads", 2, "--max-batch", 1 << 14, *arguments)

    def ask(self, daemon, body, *fields):
        s = daemon.raw()
        s.sendall(head(body, *fields) + body)
        return s

    def check_problem(self, answer, words, most_seconds=600):
        self.assertTrue(answer.startswith(b"HTTP/1.1 503 "), answer[:300])
        self.assertIn(b"application/problem+json", answer)
        self.assertIn(words, answer)
        seconds = int(re.search(rb"\r\nRetry-After: (\d+)\r\n", answer).group(1))
        self.assertGreaterEqual(seconds, 1)
        self.assertLessEqual(seconds, most_seconds)

    def serves(self, daemon):
        self.assertEqual(daemon.radiosity("box", SHORT).status, 200)
