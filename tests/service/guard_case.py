"""Stores of a small and a large scene for daemons that bad clients ask, and the figures that a daemon gives of them."""

import json
import pathlib
import tempfile
import time
import unittest

from prometheus_client.parser import text_string_to_metric_families

from daemon import PATIENCE
from make_store import Scene

MIB = 1 << 20
HEAD = b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
SOLVE = json.dumps({"emission": [1] * 60}).encode()


def metrics(daemon):
    """{(name, labels…): value}"""
    found = {}
    for family in text_string_to_metric_families(daemon.get("/metrics").body.decode()):
        for sample in family.samples:
            found[(sample.name, *sorted(sample.labels.items()))] = sample.value
    return found


def cuts(daemon, why):
    return metrics(daemon)[("lambertd_connections_cut_total", ("why", why))]


def read_all(s):
    """All that comes until the other side ends it, in whatever way."""
    parts = []
    try:
        while part := s.recv(65536):
            parts.append(part)
    except ConnectionResetError:
        pass
    return b"".join(parts)


def until(what):
    deadline = time.monotonic() + PATIENCE
    while not what():
        if time.monotonic() > deadline:
            raise TimeoutError
        time.sleep(0.005)


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.box, cls.big = cls.folder / "box.h5", cls.folder / "big.h5"
        Scene(60).write(cls.box, "box")
        cls.big_scene = Scene(20000)
        cls.big_scene.write(cls.big, "big")

    def serves(self, daemon):
        self.assertEqual(daemon.radiosity("box", SOLVE).status, 200)
