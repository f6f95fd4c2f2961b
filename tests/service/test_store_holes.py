"""Stores with holes: files of some MB whose datasets are far longer, as nothing was ever written there. The sizes in a
file's headers are added up before anything is read: each is refused by one line, by little memory."""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

import h5py
import numpy as np

from command import LAMBERT
from daemon import PATIENCE, Daemon
from make_store import PIECE, Scene, set_attributes, xxh3

MIB = 1 << 20
# --max-memory, --max-request-memory and what operating.md allows beside them.
LIMITS = 100, 64, 64
# A sanitizer's shadow and its quarantine are memory of the process, too.
SANITIZED = b"__asan_init" in pathlib.Path(os.environ["LAMBERTD"]).read_bytes() or \
    b"__tsan_init" in pathlib.Path(os.environ["LAMBERTD"]).read_bytes()


def hole(file, path, shape, dtype):
    """A dataset that is allocated, at once, and never written."""
    dcpl = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    dcpl.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    dcpl.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    dcpl.set_layout(h5py.h5d.CONTIGUOUS)
    h5py.h5d.create(file.id, path.encode(), h5py.h5t.py_create(np.dtype(dtype)), h5py.h5s.create_simple(shape), dcpl=dcpl)


def sum_up(file):
    """The checksum of the checksums."""
    names = []
    file["checksum"].visititems(lambda p, o: names.append("/" + p) if isinstance(o, h5py.Dataset) else None)
    together = b"".join(n.encode() + b"\0" + file["checksum" + n][()].tobytes() for n in sorted(names, key=str.encode))
    set_attributes(file["checksum"], {"xxh3": f"{xxh3(together):016x}"})


class StoreHoles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-holes-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.sound = cls.folder / "sound.h5"
        Scene(60, groups=["lamp"]).write(cls.sound)
        zeros = xxh3(bytes(PIECE))

        def craft(name, change):
            path = cls.folder / f"{name}.h5"
            shutil.copy(cls.sound, path)
            with h5py.File(path, "r+", libver=("v108", "v110")) as file:
                change(file)
            return path

        def of_nothing(file):
            hole(file, "/checksum/zzz", (1 << 27,), "u8")

        def of_an_array(file):
            del file["/checksum/mesh/area"]
            hole(file, "/checksum/mesh/area", (1 << 27,), "u8")

        def long_names(file):
            del file["/mesh/group_names"], file["/checksum/mesh/group_names"]
            hole(file, "/mesh/group_names", (1,), f"S{1 << 29}")
            file.create_dataset("/checksum/mesh/group_names", data=np.full((1 << 29) // PIECE, zeros, np.uint64))
            sum_up(file)

        def long_areas(file):
            for path in "/mesh/area", "/mesh/group", "/operator/V":
                del file[path], file["/checksum" + path]
            hole(file, "/mesh/area", (1 << 26,), "f8")
            hole(file, "/mesh/group", (1 << 26,), "u4")
            hole(file, "/operator/V", (1 << 26, 2), "f4")
            for path, count in ("/mesh/area", 512), ("/mesh/group", 256), ("/operator/V", 512):
                file.create_dataset("/checksum" + path, data=np.full(count, zeros, np.uint64))
            sum_up(file)

        # By the daemon within its memory; by `lambert` where it is more than any store has.
        cls.cases = {
            craft("nothing", of_nothing): ("/checksum/zzz is of no array", "/checksum/zzz is of no array"),
            craft("array", of_an_array): ("/mesh/area has no checksum of its size", "/mesh/area has no checksum of its size"),
            craft("names", long_names): ("--max-memory", "a text of /mesh/group_names"),
            craft("areas", long_areas): ("--max-memory", None),
        }

    def test_a_daemon_refuses_them(self):
        stores = self.folder / "stores"
        stores.mkdir()
        shutil.copy(self.sound, stores)
        most, requests, beside = LIMITS
        with Daemon("--stores", stores, "--max-memory", f"{most}M", "--max-request-memory", f"{requests}M",
                    "--threads", 2) as daemon:
            for path in self.cases:
                (stores / path.name).symlink_to(path)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 1 scene")
            lines = daemon.errors().splitlines()
            self.assertEqual(len(lines), len(self.cases), lines)
            for path, (words, _) in self.cases.items():
                self.assertEqual([words in line for line in lines if path.name in line], [True], lines)
            self.assertEqual(len(daemon.get("/readyz").json()["refused"]), len(self.cases))
            status = pathlib.Path(f"/proc/{daemon.process.pid}/status").read_text(encoding="ascii")
            peak = int(status.split("VmHWM:")[1].split()[0]) << 10
            print(f"the daemon took at most {peak / MIB:.0f} MiB of {sum(LIMITS)}")
            if not SANITIZED:
                self.assertLess(peak, (most + requests + beside) * MIB)

    def test_lambert_refuses_them(self):
        for path, (_, words) in self.cases.items():
            for verb in ["info"], ["verify"], ["solve", "--emit", "lamp=1", "-o", self.folder / "out.npy"]:
                if words is None or (verb[0] != "info" and "text" in words):  # only that reads names before anything else
                    continue
                with self.subTest(store=path.name, verb=verb[0]):
                    process = subprocess.Popen([LAMBERT, verb[0], path, *verb[1:]], stdout=subprocess.PIPE,
                                               stderr=subprocess.PIPE, text=True)
                    output, errors = process.stdout.read(), process.stderr.read()
                    process.stdout.close()
                    process.stderr.close()
                    _, code, usage = os.wait4(process.pid, 0)
                    process.returncode = os.waitstatus_to_exitcode(code)
                    self.assertEqual((process.returncode, errors.count("\n")), (1, 1), output + errors)
                    self.assertIn(words, errors)
                    if not SANITIZED:  # a sixth of the hole; a start takes 30
                        self.assertLess(usage.ru_maxrss, 160 << 10)

    def test_sound_stores_count_whole(self):
        """Areas, reflectances and groups count, which a store of a small operator has most of."""
        n = 200000
        store = self.folder / "wide.h5"
        Scene(n, rank=1).write(store, with_order=False)
        ended = subprocess.run([os.environ["LAMBERTD"], "--listen", "127.0.0.1:0", str(store), "--max-memory", str(n * 8)],
                               capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(ended.returncode, 1)
        takes = int(re.search(r"takes (\d+) bytes, .* of --max-memory", ended.stderr).group(1))
        # Y and V, areas, groups by element, reflectances.
        least = n * (2 * 4 + 8 + 4 + 4)
        self.assertGreaterEqual(takes, least)
        self.assertLess(takes, least + 10000)


if __name__ == "__main__":
    unittest.main()
