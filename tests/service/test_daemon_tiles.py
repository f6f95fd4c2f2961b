"""Tiles of a hierarchical store, which lambertd maps as answers read them: the bits of answers, and files that are damaged,
crafted, or changed while they are served."""

import io
import os
import pathlib
import shutil
import tempfile
import unittest

import h5py
import numpy as np

from command import must
from daemon import Daemon
from make_store import add_checksums

LIGHTS = ({"groups": {"lamp": 1}}, {"elements": [7], "values": [2]})


class Tiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        made = pathlib.Path(folder.name)
        cls.made = made / "room.h5"
        must("generate", "cornell", "--elements", 2500, "-o", made / "room.obj")
        must("precompute", made / "room.obj", "-o", cls.made, "--method", "hierarchical", "--epsilon", 0.01, "--probes", 0)
        must("solve", cls.made, "--emit", "lamp=1", "-o", made / "lamp.npy")
        cls.lamp = np.load(made / "lamp.npy")
        with h5py.File(cls.made) as f:
            cls.size, cls.place = f["operator/K/0/four"].nbytes, f["operator/K/0/four"].id.get_offset()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.path = pathlib.Path(shutil.copy(self.made, self.folder / "room.h5"))
        self.other = pathlib.Path(shutil.copy(self.made, self.folder / "other.h5"))

    def write(self, at, content):
        """Into the tiles in place; the file's times stay."""
        times = os.stat(self.path)
        with open(self.path, "r+b") as f:
            f.seek(self.place + at)
            f.write(content)
        os.utime(self.path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def ask(self, daemon, name, light):
        return daemon.radiosity(name, {"emission": light}, accept="application/x-npy")

    def check(self, daemon, name):
        answer = self.ask(daemon, name, LIGHTS[0])
        self.assertEqual(answer.status, 200, answer)
        given = np.load(io.BytesIO(answer.body))
        self.assertEqual(given.tobytes(), self.lamp.astype("<f4").reshape(given.shape).tobytes())

    def test_answers_have_the_bits_of_a_copy(self):
        self.assertGreater(self.size, 1 << 16)
        with Daemon(self.path) as daemon:
            self.check(daemon, "room")
            text = daemon.get("/metrics").body.decode()
            mapped = next(float(line.split()[1]) for line in text.splitlines() if line.startswith("lambertd_mapped_bytes "))
            self.assertGreaterEqual(mapped, self.size)

    def test_damage_is_found(self):
        """Before the scene is served, or, as of large stores, while it is."""
        with open(self.path, "rb") as f:
            f.seek(self.place + 20)
            byte = f.read(1)[0]
        self.write(20, bytes([byte ^ 4]))
        words = "/operator/K/0/four is damaged in MiB 1 of"
        with Daemon(self.path, self.other) as daemon:
            self.assertIn(f"refused {self.path}: {words}", daemon.errors())
            self.check(daemon, "other")
        with Daemon(self.path, self.other, "--verify-below", 1) as daemon:
            daemon.wait_for_error(f"took room out of service: {self.path}: {words}")
            self.assertEqual(self.ask(daemon, "room", LIGHTS[0]).status, 503)
            self.check(daemon, "other")

    def test_crafted_tiles_are_refused(self):
        """Their checksums are right."""
        with h5py.File(self.path, "r+") as f:
            f["operator/K/0/four"][5, :4] = -1
            add_checksums(f)
        with Daemon(self.path, self.other) as daemon:
            self.assertIn(f"refused {self.path}: /operator/K/0/four has a tile beyond its columns in MiB 1 of", daemon.errors())
            self.check(daemon, "other")

    def test_tiles_that_change_do_no_harm(self):
        """Another program writes into the file, and its times do not tell: answers are of what stands there, the daemon lives,
        and its next look finds out."""
        for content in b"\xff", b"\x80":
            with self.subTest(content=content):
                shutil.copy(self.made, self.folder / "fresh")
                os.replace(self.folder / "fresh", self.path)
                with Daemon(self.path, self.other, "--scrub", 1e-4) as daemon:
                    self.check(daemon, "room")
                    self.write(0, content * self.size)
                    for light in LIGHTS:
                        self.assertIn(self.ask(daemon, "room", light).status, (200, 422, 503))
                        many = {"emissions": [light] * 16}
                        self.assertIn(daemon.radiosity("room", many).status, (200, 422, 503))
                    self.check(daemon, "other")
                    daemon.wait_for_error("took room out of service: ")
                    self.check(daemon, "other")


if __name__ == "__main__":
    unittest.main()
