"""Refusals reach clients that still send what is refused: by usual clients and by hand, whatever is wrong, and nobody holds
connections or the end of the daemon by sending on."""

import json
import re
import shutil
import signal
import socket
import subprocess
import unittest
import urllib.error
import urllib.request

from daemon import PATIENCE, Daemon
from daemon_case import Case

JSON = {"Content-Type": "application/json"}
BOX = "/v1/scenes/box/radiosity"
# The kernels of both ends hold 3 MB at most; what is longer is on its way when the answer comes.
LENGTHS = (3_000_000, 8_000_000, 30_000_000)
TRIES = 5

NODE = """
const [url, length, headers] = process.argv.slice(1);
const answer = await fetch(url, {method: "POST", body: Buffer.alloc(Number(length), 32), headers: JSON.parse(headers)});
console.log(answer.status, (await answer.json()).status);
"""


class Refusals(Case):
    def setUp(self):
        super().setUp()
        self.path, _ = self.store()
        token = self.folder / "token"
        token.write_text("s3cret-token\n")
        self.token = ["--token-file", token]
        self.known = {"Authorization": "Bearer s3cret-token"}

    def cases(self):
        """Options of a daemon, and of each of its refusals the method, the path, the headers and the status."""
        yield self.token, [("POST", BOX, JSON, 401), ("POST", "/v1/scenes/none/radiosity", JSON | self.known, 404),
                           ("POST", BOX, self.known | {"Content-Type": "text/plain"}, 415),
                           ("POST", BOX, JSON | self.known | {"Origin": "http://elsewhere.example"}, 403),
                           ("PUT", BOX, JSON | self.known, 405), ("GET", BOX, self.known, 405),
                           ("POST", BOX, JSON | self.known | {"Lambert-Timeout": "soon"}, 400)]
        yield ["--max-body", "1M"], [("POST", BOX, JSON, 413), ("POST", "/nowhere", JSON, 404)]
        yield ["--max-body", "256M", "--max-request-memory", "1M"], [("POST", BOX, JSON, 413)]

    def urllib(self, url, method, headers, body):
        try:
            urllib.request.urlopen(urllib.request.Request(url, body, headers, method=method), timeout=PATIENCE)
        except urllib.error.HTTPError as refused:
            return refused.code, json.load(refused)["status"]
        self.fail("not refused")

    def test_urllib(self):
        for options, refused in self.cases():
            with Daemon(self.path, *options) as daemon:
                for length in LENGTHS:
                    for method, path, headers, status in refused:
                        for _ in range(TRIES):
                            given = self.urllib(f"http://127.0.0.1:{daemon.port}{path}", method, headers, b" " * length)
                            self.assertEqual(given, (status, status), (length, path, headers))

    @unittest.skipUnless(shutil.which("curl"), "no curl")
    def test_curl(self):
        with Daemon(self.path, *self.token) as daemon:
            for length in LENGTHS:
                # With the field Expect, curl waits for a word; without, it sends at once.
                for expect in [], ["-H", "Expect:"]:
                    for _ in range(TRIES):
                        command = ["curl", "-s", "-H", "Content-Type: application/json", *expect, "--data-binary", "@-",
                                   f"http://127.0.0.1:{daemon.port}{BOX}"]
                        made = subprocess.run(command, input=b" " * length, capture_output=True, timeout=PATIENCE)
                        self.assertEqual((made.returncode, json.loads(made.stdout)["status"]), (0, 401))

    @unittest.skipUnless(shutil.which("node"), "no node")
    def test_node(self):
        with Daemon(self.path, *self.token) as daemon:
            for length in LENGTHS:
                command = ["node", "--input-type=module", "-e", NODE, f"http://127.0.0.1:{daemon.port}{BOX}", str(length),
                           json.dumps(JSON)]
                made = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
                self.assertEqual(made.stdout, "401 401\n", made.stderr)

    def test_unix(self):
        """A Unix socket is reset as one of TCP is."""
        where = self.folder / "socket"
        with Daemon(self.path, "--unix", where, *self.token, listen=None), socket.socket(socket.AF_UNIX) as s:
            s.settimeout(PATIENCE)
            s.connect(str(where))
            s.sendall(self.head(b"Content-Length: 30000000") + b" " * 30_000_000)
            self.assertTrue(self.read_all(s).startswith(b"HTTP/1.1 401 "))

    def head(self, length):
        return b"POST " + BOX.encode() + b" HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" + length + b"\r\n\r\n"

    def chunked(self, s, length):
        s.sendall(self.head(b"Transfer-Encoding: chunked"))
        chunk = b"10000\r\n" + b" " * 65536 + b"\r\n"
        for _ in range(length >> 16):
            s.sendall(chunk)
        s.sendall(b"0\r\n\r\n")
        return self.read_all(s)

    def test_chunked(self):
        """Without a length: refused at the head, and beyond --max-body while it comes."""
        for options, status in ((self.token, b" 401 "), (["--max-body", "1M"], b" 413 ")):
            with Daemon(self.path, "--keep-alive", 1, *options) as daemon:
                for length in LENGTHS:
                    with daemon.raw() as s:
                        self.assertIn(status, self.chunked(s, length)[:20])

    def test_expected_bodies_are_refused_before_they_come(self):
        with Daemon(self.path, *self.token) as daemon, daemon.raw() as s:
            s.sendall(self.head(b"Expect: 100-continue\r\nContent-Length: 8000000"))
            answer = self.read_all(s)
            self.assertTrue(answer.startswith(b"HTTP/1.1 401 "))
            self.assertIn(b"\r\nConnection: close\r\n", answer)

    def test_bytes_behind_a_refusal_are_no_request(self):
        """A body that is dropped, in the form of a request, is not answered."""
        inner = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
        body = inner * (8_000_000 // len(inner))
        with Daemon(self.path, *self.token) as daemon:
            for length in (b"Content-Length: %d" % len(body), b"Expect: 100-continue\r\nContent-Length: %d" % len(body),
                           b"Content-Length: 9\r\nContent-Length: 8"):
                with daemon.raw() as s:
                    s.sendall(self.head(length) + body)
                    self.assertEqual(self.read_all(s).count(b"HTTP/1.1 "), 1)

    def test_long_heads(self):
        """libmicrohttpd refuses them by itself."""
        with Daemon(self.path) as daemon, daemon.raw() as s:
            s.sendall(b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 500_000 + b"\r\n")
            self.assertTrue(self.read_all(s).startswith(b"HTTP/1.1 4"))

    def test_short_ones_keep_their_connection(self):
        with Daemon(self.path, *self.token) as daemon:
            connection = daemon.connect()
            for _ in range(3):
                self.assertEqual(daemon.radiosity("box", b" " * 500_000, connection=connection).status, 401)
            connection.close()

    def refuse_and_hold(self, daemon, count):
        """Clients that read that they are refused, and neither send on nor close."""
        held = []
        for _ in range(count):
            s = daemon.raw()
            self.addCleanup(s.close)
            s.sendall(self.head(b"Content-Length: 8000000") + b" ")
            self.assertTrue(s.recv(100).startswith(b"HTTP/1.1 401 "))
            held.append(s)
        return held

    def test_they_count_and_give_their_places_away(self):
        with Daemon(self.path, "--max-connections", 20, *self.token) as daemon:
            self.refuse_and_hold(daemon, 200)
            text = daemon.get("/metrics").body.decode()
            figures = {name: int(value) for name, value in re.findall(r"^(lambertd_connections\S*) (\d+)$", text, re.M)}
            self.assertLessEqual(figures["lambertd_connections_lingering"], 5)
            self.assertGreater(figures["lambertd_connections_lingering"], 0)
            self.assertLessEqual(figures["lambertd_connections"], 20 + 32)
            self.assertGreaterEqual(figures['lambertd_connections_cut_total{why="lingering"}'], 150)
            with daemon.raw() as s:  # others are served beside them
                s.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                self.assertIn(b" 200 ", self.read_all(s))

    def test_they_hold_no_place_for_ever(self):
        with Daemon(self.path, "--timeout", 1, *self.token) as daemon:
            silent, = self.refuse_and_hold(daemon, 1)
            self.assertTrue(self.read_all(silent).endswith(b"}\n"))
            while True:  # the daemon closed: sending fails
                try:
                    silent.sendall(b" ")
                except OSError:
                    break

    def test_the_daemon_ends_beside_them(self):
        with Daemon(self.path, *self.token) as daemon:
            self.refuse_and_hold(daemon, 10)
            daemon.signal(signal.SIGTERM)
            self.assertEqual(daemon.wait(), 0)


if __name__ == "__main__":
    unittest.main()
