"""lambertd and its clients: many at once, slow ones, silent ones, those that go, and those without a token."""

import json
import os
import re
import signal
import socket
import threading
import time
import unittest

import numpy as np

from daemon_case import Case
from daemon import PATIENCE, Daemon

TOLERANCE = 1e-5  # as in test_daemon_answers.py


class Clients(Case):
    def test_a_hundred_clients_get_their_own_answers(self):
        path, scene = self.store()
        failures = []
        with Daemon(path, "--threads", 3) as daemon:
            start = threading.Barrier(100)

            def client(i):
                try:
                    connection = daemon.connect()
                    E = np.zeros((1, 60))
                    E[0, i % 60] = 1 + i
                    wanted = scene.solve(E)[0]
                    start.wait(PATIENCE)
                    for _ in range(3):
                        body = {"emission": {"elements": [i % 60], "values": [1 + i]}}
                        answer = daemon.radiosity("box", body, connection=connection)
                        given = np.array(answer.json()["radiosity"])
                        if not np.abs(given - wanted).max() <= TOLERANCE * wanted.max():
                            failures.append((i, "another client's answer"))
                    connection.close()
                except Exception as failure:
                    failures.append((i, failure))

            clients = [threading.Thread(target=client, args=(i,)) for i in range(100)]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            self.assertEqual(failures, [])

    def test_a_full_queue_answers_503(self):
        path, _ = self.store(n=1000, kind="exact")
        body = json.dumps({"emissions": [{"elements": [i % 1000], "values": [1]} for i in range(500)],
                           "select": {"elements": [0]}})
        with Daemon(path, "--threads", 1, "--max-inflight", 1) as daemon:
            answers = []
            clients = [threading.Thread(target=lambda: answers.append(daemon.radiosity("box", body))) for _ in range(16)]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            full = [a for a in answers if a.status == 503]
            self.assertEqual({a.status for a in answers}, {200, 503})
            for answer in full:
                self.assertEqual(answer.headers["Retry-After"], "1")
                self.assertEqual(answer.json()["status"], 503)
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * 1000}).status, 200)

    def test_a_small_body_limit_is_no_limit_on_scenes(self):
        path, scene = self.store(n=20000)
        with Daemon(path, "--max-body", 1000) as daemon:
            body = {"emission": {"groups": {"lamp": 1}}, "select": {"elements": [7]}}
            E = np.zeros((1, 20000))
            E[0, scene.members("lamp")] = 1
            wanted = scene.solve(E)[0, 7]
            # 20,000 terms of one sign are summed in single precision, in any order: at most 20,000 * 6e-8.
            self.assertAlmostEqual(daemon.radiosity("box", body).json()["radiosity"][0], wanted, delta=1.2e-3 * wanted)

    def test_what_is_not_http(self):
        path, _ = self.store()
        rng = np.random.default_rng(5)
        # libmicrohttpd may miss that a client went right behind its last byte; the time-out then ends it.
        with Daemon(path, "--timeout", 3) as daemon:
            for junk in (b"\r\n\r\n\r\n", b"\0" * 5000, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"HELO example\r\n\r\n",
                         b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n{}",
                         b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9x\r\n\r\n{}",
                         b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
                         b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
                         b"GET / HTTP/1.1\r\n" + b"X: " + b"y" * 100_000 + b"\r\n\r\n",
                         b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20_000 + b"\r\n",
                         b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + rng.bytes(500), *(rng.bytes(2000) for _ in range(20))):
                with self.subTest(junk=junk[:60]), daemon.raw() as s:
                    try:
                        s.sendall(junk)
                        s.shutdown(socket.SHUT_WR)
                    except OSError:
                        pass
                    answer = self.read_all(s)
                    self.assertNotIn(b" 200 ", answer[:20])
                self.assertEqual(daemon.radiosity("box", {"emission": [1] * 60}).status, 200)

    def test_clients_that_go(self):
        path, _ = self.store(n=400, kind="exact")
        forms = [{"elements": [i], "values": [1]} for i in range(100)]
        body = json.dumps({"emissions": forms}).encode()
        whole = (b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                 b"Content-Length: %d\r\n\r\n" % len(body) + body)
        with Daemon(path, "--timeout", 3) as daemon:
            for sent in (0, 1, 30, whole.index(b"{"), len(whole) - 1, len(whole), len(whole)):
                for abrupt in False, True:
                    s = daemon.raw()
                    if abrupt:
                        # Closing then resets the connection.
                        s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
                    s.sendall(whole[:sent])
                    s.close()
            # A client that reads only the beginning of its answer.
            s = daemon.raw()
            s.sendall(whole)
            s.recv(100)
            s.close()
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * 400}).status, 200)
            watch = daemon.connect()
            self.wait_in_flight(daemon, 1, watch)
            watch.close()

    def test_a_slow_client(self):
        path, scene = self.store()
        body = json.dumps({"emission": [1] * 60}).encode()
        whole = b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(body) + body
        with Daemon(path) as daemon, daemon.raw() as s:
            s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for at in range(len(whole)):
                s.sendall(whole[at : at + 1])
                if at % 50 == 0:
                    # Others are not held up.
                    self.assertEqual(daemon.radiosity("box", {"emission": [1] * 60}).status, 200)
            answer = b""
            while b"time_ms" not in answer:
                answer += s.recv(7)
            self.assertTrue(answer.startswith(b"HTTP/1.1 200 "))

    def test_a_silent_client_is_cut(self):
        path, _ = self.store()
        with Daemon(path, "--timeout", 1) as daemon:
            for begun in b"", b"GET /hea", b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 99\r\n\r\n{":
                with daemon.raw() as s:
                    s.sendall(begun)
                    self.assertNotIn(b" 200 ", self.read_all(s))

    def test_pipelined_requests_are_answered_in_order(self):
        path, scene = self.store()
        requests, wanted = b"", []
        for i in range(20):
            body = json.dumps({"emission": {"elements": [i], "values": [1]}, "select": {"elements": [i]}}).encode()
            requests += (b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(body)) + body
            requests += b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
            E = np.zeros((1, 60))
            E[0, i] = 1
            wanted.append(scene.solve(E)[0, i])
        with Daemon(path) as daemon, daemon.raw() as s:
            s.sendall(requests)
            stream = s.makefile("rb")
            for i in range(20):
                for kind in "radiosity", "status":
                    length = 0
                    self.assertIn(b" 200 ", stream.readline())
                    while (line := stream.readline()) != b"\r\n":
                        if line.lower().startswith(b"content-length:"):
                            length = int(line.split(b":")[1])
                    answer = json.loads(stream.read(length))
                    self.assertIn(kind, answer)
                    if kind == "radiosity":
                        self.assertAlmostEqual(answer["radiosity"][0], wanted[i], delta=TOLERANCE * wanted[i])

    def test_token(self):
        path, _ = self.store()
        token = self.folder / "token"
        token.write_text("  s3cret-token \n# rest\n")
        body = json.dumps({"emission": [1] * 60})
        with Daemon(path, "--token-file", token) as daemon:
            for given in (None, "", "Bearer", "Bearer ", "Bearer s3cret", "Bearer s3cret-tokenx", "Bearer S3cret-token",
                          "Basic s3cret-token", "s3cret-token", "Bearer s3cret-token rest",
                          "Bearer s3cret-tokens3cret-token"):
                headers = {} if given is None else {"Authorization": given}
                for method, route, sent in (("GET", "/v1/scenes", None), ("GET", "/v1/scenes/box", None),
                                            ("GET", "/v1/scenes/none", None), ("POST", "/v1/scenes/box/radiosity", body),
                                            ("GET", "/v1/openapi.json", None)):
                    answer = daemon.ask(method, route, sent, headers)
                    self.assertEqual((answer.status, answer.headers["WWW-Authenticate"]), (401, "Bearer"), (given, route))
                    self.assertEqual(answer.json()["status"], 401)
            for given in "Bearer s3cret-token", "bearer  s3cret-token":
                headers = {"Authorization": given, "Content-Type": "application/json"}
                self.assertEqual(daemon.ask("GET", "/v1/scenes", None, headers).status, 200)
                self.assertEqual(daemon.ask("POST", "/v1/scenes/box/radiosity", body, headers).status, 200)
            for route in "/healthz", "/readyz", "/metrics":
                self.assertEqual(daemon.get(route).status, 200)
        token.write_text("\n")
        self.assertEqual(self.run_once(path, "--token-file", token).returncode, 1)

    def test_an_access_log_that_nobody_reads(self):
        path, _ = self.store()
        fifo = self.folder / "log.fifo"
        os.mkfifo(fifo)
        reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
        with Daemon(path, "--access-log", fifo) as daemon:
            connection = daemon.connect()
            for _ in range(4000):  # 64 KiB of the pipe and 256 of the daemon are some 2,000 lines
                self.assertEqual(daemon.get("/healthz", connection=connection).status, 200)
            lost = re.search(r"lambertd_access_log_lost_total (\d+)", daemon.get("/metrics").body.decode())
            self.assertGreater(int(lost[1]), 0)
            connection.close()
            daemon.signal(signal.SIGTERM)
            self.assertEqual(daemon.wait(), 0)
        os.close(reader)

    def test_an_access_log_is_opened_again(self):
        path, _ = self.store()
        log, moved = self.folder / "access.log", self.folder / "old.log"
        with Daemon(path, "--access-log", log) as daemon:
            daemon.get("/healthz")
            self.wait_for_lines(log, 1)
            log.rename(moved)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded")
            daemon.get("/readyz")
            self.wait_for_lines(log, 1)
            self.assertIn("/readyz", log.read_text())
            self.assertEqual(len(moved.read_text().splitlines()), 1)

    def wait_for_lines(self, file, count):
        end = time.time() + PATIENCE
        while not file.exists() or len(file.read_text().splitlines()) < count:
            self.assertLess(time.time(), end)
            time.sleep(.01)

    def test_access_log(self):
        path, _ = self.store()
        log = self.folder / "access.log"
        with Daemon(path, "--access-log", log) as daemon:
            daemon.get("/healthz")
            daemon.get('/x"y%00')
            daemon.radiosity("box", {"emissions": [[1] * 60] * 3})
            daemon.stop()
        lines = [json.loads(line) for line in log.read_text().splitlines()]
        self.assertEqual([(e["method"], e["path"], e["status"], e["vectors"]) for e in lines],
                         [("GET", "/healthz", 200, 0), ("GET", '/x"y%00', 404, 0),
                          ("POST", "/v1/scenes/box/radiosity", 200, 3)])
        self.assertEqual(len({e["id"] for e in lines}), 3)

    def test_unix_socket(self):
        path, _ = self.store()
        where = self.folder / "socket"
        for _ in range(2):
            daemon = Daemon(path, "--unix", where, listen=None)
            with daemon:
                s = socket.socket(socket.AF_UNIX)
                s.connect(str(where))
                s.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                self.assertTrue(self.read_all(s).startswith(b"HTTP/1.1 200 "))
                s.close()
            self.assertFalse(where.exists())
            # One left behind by a daemon that was killed is no hindrance.
            left = socket.socket(socket.AF_UNIX)
            left.bind(str(where))
            left.close()


if __name__ == "__main__":
    unittest.main()
