"""Open files: the limit is raised, those of mapped stores are counted, and idle clients make room where none is left."""

import resource
import shutil
import signal
import unittest

from daemon import Daemon
from daemon_case import Case

STORES, FILES, IDLE = 80, 200, 150
FOR_EVER = 86400  # seconds: no connection is closed for being idle
SOLVE = '{"emission": {"groups": {"lamp": 1}}}'


class Descriptors(Case):
    def fill(self):
        folder = self.folder / "stores"
        folder.mkdir()
        path, _ = self.store(n=60)
        for k in range(STORES):
            shutil.copy(path, folder / f"s{k:02}.h5")
        return [f"{folder / f's{k:02}.h5'}:s{k:02}" for k in range(STORES)]

    def test_idle_clients_beside_many_stores(self):
        """Each mapped store holds a descriptor: connections are those that are left."""
        launcher = ["prlimit", f"--nofile={FILES}:{FILES}"]
        with Daemon("--timeout", FOR_EVER, *self.fill(), launcher=launcher) as daemon:
            self.assertEqual(daemon.errors(), "")
            idle = [daemon.raw() for _ in range(IDLE)]
            try:
                most = int(daemon.get("/metrics").body.decode().split("\nlambertd_connections_most ")[1].split()[0])
                self.assertGreater(most, 0)
                self.assertLessEqual(most, FILES - STORES)
                for k in (0, STORES - 1):
                    self.assertEqual(daemon.radiosity(f"s{k:02}", SOLVE).status, 200)
                daemon.signal(signal.SIGHUP)
                daemon.wait_for(f"reloaded: {STORES} scenes")
                self.assertEqual(daemon.errors(), "")
            finally:
                for s in idle:
                    s.close()

    def test_no_descriptor_left(self):
        """Fewer than --max-connections are open, yet nobody could be accepted: the idle ones go."""
        path, _ = self.store()
        with Daemon(path, "--timeout", FOR_EVER) as daemon:
            idle = [daemon.raw() for _ in range(4)]
            self.assertEqual(daemon.get("/healthz").status, 200)
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (12, 12))
            idle += [daemon.raw() for _ in range(20)]
            try:
                self.assertEqual(daemon.radiosity("box", SOLVE).status, 200)
            finally:
                for s in idle:
                    s.close()

    def test_soft_limit_is_raised(self):
        path, _ = self.store()
        with Daemon(path, launcher=["prlimit", "--nofile=100:1500"]) as daemon:
            self.assertEqual(resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE), (1500, 1500))


if __name__ == "__main__":
    unittest.main()
