"""The time of an idle connection between requests is not that of a head or a body."""

import re
import unittest

from daemon import Daemon
from daemon_case import Case

GET = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"


class KeepAlive(Case):
    def cuts(self, daemon, why):
        return int(re.search(rf'lambertd_connections_cut_total{{why="{why}"}} (\d+)', daemon.get("/metrics").body.decode())[1])

    def answered(self, s):
        s.sendall(GET)
        self.assertIn(b" 200 ", s.recv(65536))

    def test_an_idle_connection_is_closed_after_its_time(self):
        path, _ = self.store()
        with Daemon(path, "--timeout", 3600, "--keep-alive", 1) as daemon, daemon.raw() as idle, daemon.raw() as begun:
            self.answered(idle)
            self.answered(begun)
            begun.sendall(GET[:-2])  # the line was read: it has the time of a head
            self.assertEqual(self.read_all(idle), b"")
            begun.sendall(GET[-2:])
            self.assertIn(b" 200 ", begun.recv(65536))
            self.assertEqual(self.cuts(daemon, "idle"), 1)
            self.assertEqual(self.cuts(daemon, "head"), 0)

    def test_an_idle_connection_outlives_the_time_of_a_head(self):
        path, _ = self.store()
        with Daemon(path, "--timeout", 1, "--keep-alive", 3600) as daemon, daemon.raw() as idle, daemon.raw() as begun, \
                daemon.raw() as fresh:
            self.answered(idle)
            self.answered(begun)
            begun.sendall(GET[:-2])
            self.assertEqual(self.read_all(begun), b"")
            self.assertEqual(self.read_all(fresh), b"")  # a connection that never asked has the time of a head, too
            self.answered(idle)
            self.assertEqual(self.cuts(daemon, "head"), 2)
            self.assertEqual(self.cuts(daemon, "idle"), 0)

    def test_the_preset_is_longer_than_that_of_balancers(self):
        self.assertRegex(" ".join(self.run_once("--help").stdout.split()), r"--keep-alive=SECONDS [^(]*\(preset 75 s\)")


if __name__ == "__main__":
    unittest.main()
