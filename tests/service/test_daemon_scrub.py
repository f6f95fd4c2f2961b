"""Mapped arrays are compared with their checksums again while they are served (--scrub)."""

import os
import re
import time
import unittest

import h5py

from daemon import Daemon
from daemon_case import Case

N, RANK = 3000, 100  # Y and V: 1.14 MiB each, which is worth a mapping
SECONDS = 1 / 3600


class Scrub(Case):
    def rot(self, path):
        """Some bytes are not as they were, and neither size nor time of the file tell."""
        with h5py.File(path, "r") as f:
            at = f["/operator/V"].id.get_offset()
        before = path.stat()
        with open(path, "r+b") as f:
            f.seek(at + 4000)
            f.write(b"\0\0\x80\x7f" * 5)
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))

    def verified_at(self, daemon):
        return float(re.search(r"^lambertd_verified_timestamp_seconds (\S+)$", daemon.get("/metrics").body.decode(), re.M)[1])

    def test_rot_is_found(self):
        path, _ = self.store(n=N, rank=RANK)
        other, _ = self.store(file="other.h5", name="other")
        begun = int(time.time())
        with Daemon(path, other, "--scrub", .3 * SECONDS) as daemon:
            daemon.wait_for("verified box", 3)
            self.assertNotIn("verified other", daemon.output())  # nothing of it is mapped
            self.assertGreaterEqual(self.verified_at(daemon), begun)
            self.assertLessEqual(self.verified_at(daemon), time.time())
            self.rot(path)
            daemon.wait_for_error("took box out of service")
            self.assertEqual(self.names(daemon), ["other"])
            self.assertEqual(daemon.radiosity("box", {"emission": {"groups": {"lamp": 1}}}).status, 503)
            # It stays so, is told once, and what replaces it is compared again and again.
            self.store(n=N, rank=RANK, file="next.h5")
            os.replace(self.folder / "next.h5", path)
            daemon.signal(1)
            daemon.wait_for("reloaded: 2 scenes")
            daemon.wait_for("verified box", daemon.output().count("verified box") + 2)
            self.assertEqual(daemon.errors().count("took box out of service"), 1)

    def test_replaced_meanwhile(self):
        """Scenes come and go while they are compared."""
        path, _ = self.store(n=N, rank=RANK)
        with Daemon(path, "--scrub", .0001 * SECONDS) as daemon:
            for n in range(1, 21):
                self.store(n=N, rank=RANK, file="next.h5")
                os.replace(self.folder / "next.h5", path)
                daemon.signal(1)
                daemon.wait_for("reloaded: 1 scene", n)
            daemon.wait_for("verified box", daemon.output().count("verified box") + 5)
            self.assertEqual(daemon.radiosity("box", {"emission": {"groups": {"lamp": 1}}}).status, 200)
            self.assertEqual(daemon.errors(), "")

    def test_never_without_the_option(self):
        path, _ = self.store(n=N, rank=RANK)
        with Daemon(path) as daemon:
            self.assertGreater(self.verified_at(daemon), 0)
        for hours in "0", "-1", "x", "1e9":
            self.assertEqual(self.run_once(path, "--scrub", hours).returncode, 2)


if __name__ == "__main__":
    unittest.main()
