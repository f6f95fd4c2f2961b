"""The access log says who asked, by the word of trusted proxies only."""

import json
import socket
import unittest

from daemon import PATIENCE, Daemon
from daemon_case import Case

FORWARDED = {"X-Forwarded-For": "203.0.113.9, 198.51.100.7"}


class Peers(Case):
    def clients(self, ask, *options, **more):
        """The clients of the log's lines, in order."""
        log = self.folder / "log"
        path, _ = self.store()
        with Daemon(path, "--access-log", log, *options, **more) as daemon:
            ask(daemon)
        lines = [json.loads(line) for line in log.read_text().splitlines()]
        self.assertEqual([line["path"] for line in lines], ["/healthz"] * len(lines))
        return [line["client"] for line in lines]

    def test_the_address_of_the_socket(self):
        def ask(daemon):
            daemon.get("/healthz")
            daemon.get("/healthz", headers=FORWARDED)
            daemon.get("/healthz", headers={"Forwarded": "for=198.51.100.7"})

        self.assertEqual(self.clients(ask), ["127.0.0.1"] * 3)

    def test_a_trusted_proxy(self):
        def ask(daemon):
            daemon.get("/healthz")
            daemon.get("/healthz", headers=FORWARDED)
            daemon.get("/healthz", headers={"Forwarded": 'for="[2001:db8::1]:7";proto=https'})
            daemon.get("/healthz", headers={**FORWARDED, "Forwarded": "for=192.0.2.1"})
            daemon.get("/healthz", headers={"X-Forwarded-For": "x\"y"})

        self.assertEqual(self.clients(ask, "--trusted-proxy", "10.0.0.0/8", "--trusted-proxy", "127.0.0.0/8"),
                         ["127.0.0.1", "198.51.100.7", "2001:db8::1", "127.0.0.1", "127.0.0.1"])

    def test_a_proxy_on_a_unix_socket(self):
        where = self.folder / "socket"

        def ask(daemon):
            for fields in "", "X-Forwarded-For: 198.51.100.7\r\n":
                with socket.socket(socket.AF_UNIX) as s:
                    s.settimeout(PATIENCE)
                    s.connect(str(where))
                    s.sendall(f"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{fields}\r\n".encode())
                    self.assertIn(b" 200 ", self.read_all(s))

        self.assertEqual(self.clients(ask, "--unix", where, listen=None), ["unix"] * 2)
        (self.folder / "log").unlink()
        self.assertEqual(self.clients(ask, "--unix", where, "--trusted-proxy", "unix", listen=None),
                         ["unix", "198.51.100.7"])

    def test_wrong_usage(self):
        path, _ = self.store()
        for text in "", "localhost", "10.0.0.0/33", "127.0.0.1:80":
            done = self.run_once(path, "--trusted-proxy", text)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, r"\Alambertd: --trusted-proxy.*\n\Z")


if __name__ == "__main__":
    unittest.main()
