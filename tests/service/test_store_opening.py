"""The headers of stores are read by HDF5 in a child process, whatever allocator and signals the program is started with."""

import ctypes
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import tempfile
import unittest

import h5py

from command import ENVIRONMENT, LAMBERT
from daemon import LAMBERTD, PATIENCE, Daemon
from make_store import Scene


class Opens:
    """Counts how often a file is opened by its name, one time after the other."""
    IN_CLOSE, IN_OPEN, EVENT = 0x18, 0x20, struct.Struct("iIII")

    def __init__(self, path):
        library = ctypes.CDLL(None, use_errno=True)
        self.fd = library.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        if self.fd < 0 or library.inotify_add_watch(self.fd, os.fsencode(path), self.IN_OPEN | self.IN_CLOSE) < 0:
            raise OSError(ctypes.get_errno(), "inotify")

    def count(self):
        """Since the last call. Equal events in a row are told as one: the end of each opening stands between."""
        try:
            seen = os.read(self.fd, 65536)
        except BlockingIOError:
            return 0
        return sum(mask & self.IN_OPEN != 0 for _, mask, _, _ in self.EVENT.iter_unpack(seen))


def ignore_children():
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)


class Opening(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.store = pathlib.Path(folder.name) / "box.h5"
        Scene(60).write(cls.store)
        # Every byte but those of the superblock is wrong, so that HDF5 finds no root group.
        cls.damaged = cls.store.with_name("damaged.h5")
        raw = cls.store.read_bytes()
        cls.damaged.write_bytes(raw[:48] + bytes(byte ^ 0x55 for byte in raw[48:]))

    @staticmethod
    def run_program(*command, **more):
        environment = dict(ENVIRONMENT, **more.pop("extra", {}))
        return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=PATIENCE, env=environment,
                              check=False, **more)

    def test_freed_memory_is_not_read(self):
        """The C library fills freed memory, in which a function table of HDF5 was looked up once."""
        done = self.run_program(LAMBERT, "info", self.store, extra={"MALLOC_PERTURB_": "190"})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("low_rank", done.stdout)

    @unittest.skipIf(shutil.which("valgrind") is None, "valgrind is not installed")
    def test_valgrind_sees_no_invalid_access(self):
        done = self.run_program("valgrind", "--undef-value-errors=no", "--error-exitcode=99", LAMBERT, "info", self.store)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("Invalid", done.stderr)
        self.assertIn("low_rank", done.stdout)

    def test_the_file_is_looked_up_once(self):
        """Nothing can take its place between the process that reads its headers and the one that reads its data."""
        opens = Opens(self.store)
        done = self.run_program(LAMBERT, "info", self.store)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(opens.count(), 1)
        with Daemon(self.store):
            self.assertEqual(opens.count(), 1)

    def test_ignored_children(self):
        """With SIGCHLD ignored, as some launchers leave it, the system keeps no exit status of a child."""
        for program, arguments in ((LAMBERT, ("info",)), (LAMBERTD, ("--listen", "127.0.0.1:0"))):
            usual = self.run_program(program, *arguments, self.damaged)
            self.assertEqual(usual.returncode, 1, usual.stderr)
            self.assertIn("damaged", usual.stderr)
            done = self.run_program(program, *arguments, self.damaged, preexec_fn=ignore_children)
            self.assertEqual((done.returncode, done.stderr), (1, usual.stderr))
        done = self.run_program(LAMBERT, "info", self.store, preexec_fn=ignore_children)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_among_others(self):
        """A daemon serves stores whose headers it reads itself and one that HDF5 is to read, and refuses the rest, each in the
        words of `lambert info`."""
        scene = self.store.with_name("room.obj")
        folder = self.store.with_name("stores")
        folder.mkdir()
        for line in (("generate", "cornell", "--elements", 300, "-o", scene),
                     ("precompute", scene, "-o", folder / "room.h5", "--method", "hierarchical", "--probes", 0, "--rays", 64)):
            done = self.run_program(LAMBERT, *line)
            self.assertEqual(done.returncode, 0, done.stderr)
        raw = (folder / "room.h5").read_bytes()
        shutil.copy(folder / "room.h5", folder / "odd.h5")
        with h5py.File(folder / "odd.h5", "r+") as f:
            f.create_group("odd", track_order=True)
        header = raw.index(b"OCHK")  # of the root
        spoilt = {"cut": raw[:-100], "text": b"v 0 0 0\n" * 100, "empty": b"", "none": raw[:48] + bytes(len(raw) - 48),
                  "header": raw[:header + 6] + bytes([raw[header + 6] ^ 1]) + raw[header + 7:]}
        for name, content in spoilt.items():
            (folder / f"{name}.h5").write_bytes(content)
        said = []
        for name in spoilt:
            done = self.run_program(LAMBERT, "info", folder / f"{name}.h5")
            self.assertEqual(done.returncode, 1)
            said.append(done.stderr.strip().removeprefix("lambert info: "))
        with Daemon("--stores", folder) as daemon:
            scenes = [one["name"] for one in daemon.get("/v1/scenes").json()["scenes"]]
            self.assertEqual(sorted(scenes), ["odd", "room"])
            for line in said:
                self.assertIn(f"refused {line}", daemon.errors())
            answers = [daemon.post(f"/v1/scenes/{name}/radiosity", {"emission": {"groups": {"lamp": 1}}}).json()["radiosity"]
                       for name in scenes]
            self.assertEqual(answers[0], answers[1])


if __name__ == "__main__":
    unittest.main()
