"""lambertd's defence against bad clients: limits of memory, connections and time; and that others do not feel it."""

import json
import os
import pathlib
import resource
import socket
import struct
import tempfile
import threading
import time
import unittest

import numpy as np
from prometheus_client.parser import text_string_to_metric_families

from daemon import PATIENCE, Daemon
from make_store import Scene

MIB = 1 << 20
HEAD = b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\n"
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


def cpu_seconds(daemon):
    fields = pathlib.Path(f"/proc/{daemon.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


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


class Guard(unittest.TestCase):
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

    def test_bodies_of_all_clients_are_bounded_together(self):
        with Daemon(self.box, "--max-body", "4M", "--max-buffered", "4M") as daemon:
            first = daemon.raw()
            whole = b" " * (3 * MIB) + SOLVE
            first.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % len(whole) + whole[: 3 * MIB])
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 3 * MIB)
            # Announced to be longer than what is left: answered before any of it is sent.
            with daemon.raw() as s:
                s.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % (2 * MIB))
                answer = read_all(s)
                self.assertTrue(answer.startswith(b"HTTP/1.1 503 "), answer)
                self.assertIn(b"\r\nRetry-After: 1\r\n", answer)
                self.assertIn(b"--max-buffered", answer)
            # Not announced: counted as it comes. The rest is read and dropped, and the connection goes on.
            connection = daemon.connect()
            answer = daemon.ask("POST", "/v1/scenes/box/radiosity", iter([b" " * 65536] * 20), connection=connection)
            self.assertEqual((answer.status, answer.headers["Retry-After"]), (503, "1"), answer)
            self.assertEqual(metrics(daemon)[("lambertd_body_bytes",)], 3 * MIB)
            # A request that fits is served meanwhile, on that connection too.
            self.assertEqual(daemon.radiosity("box", SOLVE, connection=connection).status, 200)
            connection.close()
            first.sendall(whole[3 * MIB :])
            self.assertTrue(first.recv(65536).startswith(b"HTTP/1.1 200 "))
            first.close()
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 0)
            # A client that goes in the middle gives back what it held.
            with daemon.raw() as s:
                s.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % (2 * MIB) + b" " * MIB)
                until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == MIB)
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 0)
            self.assertEqual(daemon.radiosity("box", whole).status, 200)

    def test_idle_clients_make_place(self):
        with Daemon(self.box, "--max-connections", 8) as daemon:
            working = daemon.raw()
            working.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % len(SOLVE) + SOLVE[:5])
            idle = [daemon.raw() for _ in range(20)]
            # More than there are places: those behind wait until the first are cut, which then see an end.
            self.serves(daemon)
            self.assertEqual(idle[0].recv(1), b"")
            self.assertGreaterEqual(cuts(daemon, "place"), 1)
            # A client in the middle of a request is not idle.
            working.sendall(SOLVE[5:])
            self.assertTrue(working.recv(65536).startswith(b"HTTP/1.1 200 "))
            for s in working, *idle:
                s.close()
            self.serves(daemon)

    def test_connections_are_as_many_as_descriptors_allow(self):
        # 64 are kept for stores and what else is opened.
        with Daemon(self.box, launcher=("prlimit", "--nofile=80:80")) as daemon:
            self.assertEqual(metrics(daemon)[("lambertd_connections_most",)], 16)
            clients = [daemon.raw() for _ in range(40)]
            self.serves(daemon)
            for s in clients:
                s.close()
            self.serves(daemon)

    def open_files(self, daemon):
        return len(os.listdir(f"/proc/{daemon.process.pid}/fd"))

    def test_descriptors_run_out(self):
        with Daemon(self.box, "--timeout", 1) as daemon:
            kept = daemon.connect()
            self.assertEqual(daemon.get("/healthz", connection=kept).status, 200)
            limit = self.open_files(daemon) + 3
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (limit, limit))
            # 3 of them are accepted; the daemon asks in vain for the descriptor of a fourth.
            clients = [daemon.raw() for _ in range(10)]
            until(lambda: self.open_files(daemon) == limit)
            before = cpu_seconds(daemon)
            for s in clients[:3]:
                self.assertEqual(read_all(s), b"")
            # Only a daemon that spins until the clients are cut spends more.
            self.assertLess(cpu_seconds(daemon) - before, 0.5)
            for s in clients:
                s.close()
            kept.close()
            self.serves(daemon)

    def drip(self, s, data, pause):
        """Sends byte by byte until the other side ends it; what came meanwhile."""
        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1) if s.family == socket.AF_INET else None
        s.settimeout(pause)
        came = b""
        deadline = time.monotonic() + PATIENCE
        for at in range(len(data)):
            self.assertLess(time.monotonic(), deadline, "never cut")
            try:
                s.sendall(data[at : at + 1])
                part = s.recv(65536)
                if not part:
                    return came
                came += part
            except TimeoutError:
                pass
            except (ConnectionResetError, BrokenPipeError):
                return came
        self.fail(f"never cut; it answered {came!r}")

    def test_a_head_that_drips_is_cut(self):
        with Daemon(self.box, "--timeout", 1) as daemon:
            with daemon.raw() as s:
                self.assertEqual(self.drip(s, b"GET /healthz HTTP/1.1\r\nX: " + b"y" * 8000, 0.1), b"")
            self.assertEqual(cuts(daemon, "head"), 1)
            # Also the second on a connection.
            with daemon.raw() as s:
                s.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
                self.assertIn(b" 200 ", s.recv(65536))
                self.assertEqual(self.drip(s, b"GET /healthz HTTP/1.1\r\nX: " + b"y" * 8000, 0.1), b"")
            self.assertEqual(cuts(daemon, "head"), 2)

    def test_a_body_that_drips_is_cut(self):
        with Daemon(self.box, "--timeout", 1) as daemon:
            for head in (HEAD + b"Content-Length: 90000\r\n\r\n", HEAD + b"Transfer-Encoding: chunked\r\n\r\nffff\r\n",
                         # One that is refused, whose body is dropped.
                         HEAD + b"Content-Type: text/plain\r\nContent-Length: 90000\r\n\r\n"):
                with daemon.raw() as s:
                    s.sendall(head)
                    self.assertEqual(self.drip(s, b" " * 9000, 0.1), b"")
            self.assertEqual(cuts(daemon, "body"), 3)
            self.assertEqual(metrics(daemon)[("lambertd_body_bytes",)], 0)
            self.serves(daemon)

    def test_who_hangs_up_is_not_waited_for(self):
        """Long before the time-out. Some of them libmicrohttpd finds by itself."""
        for why, part in (("body", HEAD + b"Content-Length: 90000\r\n\r\n" + b" " * 9000), ("head", HEAD + b"X: y")):
            with self.subTest(why), Daemon(self.box, "--timeout", 3600) as daemon:
                def hang_up(times):
                    for _ in range(times):
                        with daemon.raw() as s:
                            s.sendall(part)
                    time.sleep(0.1)

                hang_up(40)
                # Whom libmicrohttpd finds is chance: there are more of them until it has missed one.
                until(lambda: cuts(daemon, why) > 0 or hang_up(4))
                until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 0)
                until(lambda: metrics(daemon)[("lambertd_connections",)] == 1)
                self.serves(daemon)

    def test_a_body_at_the_least_rate_is_read(self):
        # 1 KiB each tenth of a second, for more than two times the time-out: 10 times the least rate.
        with Daemon(self.box, "--timeout", 2, "--min-rate", "1K") as daemon, daemon.raw() as s:
            s.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % (50 * 1024 + len(SOLVE)))
            for _ in range(50):
                s.sendall(b" " * 1024)
                time.sleep(0.1)
            s.sendall(SOLVE)
            self.assertIn(b" 200 ", s.recv(100))
            self.assertEqual(cuts(daemon, "body"), 0)

    def ask_much(self, s):
        """For an answer of 24 MB, more than what the system keeps between the two."""
        body = json.dumps({"emissions": [{"elements": [i], "values": [1]} for i in range(300)]}).encode()
        s.sendall(b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: x\r\nAccept: application/x-npy\r\n"
                  b"Content-Length: %d\r\n\r\n" % len(body) + body)
        return 300 * 20000 * 4

    def test_an_answer_that_is_not_read_is_cut(self):
        where = self.folder / "socket"
        for unix in False, True:
            arguments = (self.box, self.big, "--timeout", 1, "--min-rate", "8M")
            daemon = Daemon(*arguments, "--unix", where, listen=None) if unix else Daemon(*arguments)
            with self.subTest(unix=unix), daemon:
                if unix:
                    s = socket.socket(socket.AF_UNIX)
                    s.connect(str(where))
                else:
                    s = socket.socket()
                    s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
                    s.connect(("127.0.0.1", daemon.port))
                length, count, deadline = self.ask_much(s), 0, time.monotonic() + PATIENCE
                try:
                    # 40 KB a second: never silent for the time-out.
                    while part := s.recv(4096):
                        count += len(part)
                        self.assertLess(time.monotonic(), deadline, "never cut")
                        time.sleep(0.1)
                except ConnectionResetError:
                    pass
                s.close()
                self.assertLess(count, length)
                if not unix:
                    self.assertEqual(cuts(daemon, "answer"), 1)
                    self.serves(daemon)

    def test_an_answer_at_the_least_rate_is_sent(self):
        with Daemon(self.box, self.big, "--timeout", 2, "--min-rate", "64K") as daemon, daemon.raw() as s:
            length, count = self.ask_much(s), 0
            # 1 MiB every fifth of a second, for more than two times the time-out.
            while count < length:
                part = s.recv(MIB, socket.MSG_WAITALL if length - count > MIB else 0)
                self.assertTrue(part, f"cut at {count}")
                count += len(part)
                time.sleep(0.2)
            self.assertEqual(cuts(daemon, "answer"), 0)

    def test_who_waits_for_a_solve_is_not_cut(self):
        path = self.folder / "exact.h5"
        Scene(1500).write(path, "exact", kind="exact")
        body = json.dumps({"emissions": [{"elements": [i], "values": [1]} for i in range(1000)]})
        with Daemon(path, "--timeout", 1, "--threads", 1) as daemon:
            answers, asked, clients = [], 0, 4
            while True:
                asked += clients
                asking = [threading.Thread(target=lambda: answers.append(daemon.post(
                    "/v1/scenes/exact/radiosity", body, accept="application/x-npy").status)) for _ in range(clients)]
                for t in asking:
                    t.start()
                for t in asking:
                    t.join()
                counts = metrics(daemon)
                route = ("route", "/v1/scenes/{name}/radiosity")
                label = "lambertd_request_duration_seconds"
                # Until some took longer than the time-out and the second between two checks.
                if counts[(f"{label}_count", route)] > counts[(f"{label}_bucket", ("le", "2.5"), route)]:
                    break
                clients *= 2
                self.assertLess(clients, 256, "no solve takes long enough to tell")
            self.assertEqual(answers, [200] * asked)

    def test_one_client_does_not_hold_up_another(self):
        """Large requests of one client, many at a time and pipelined, while another asks small ones."""
        dense = json.dumps({"emissions": [[1] * 20000] * 40}).encode()
        large = (b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: x\r\nAccept: application/x-npy\r\n"
                 b"Content-Length: %d\r\n\r\n" % len(dense) + dense)
        rounds, streams = 3, 6
        with Daemon(self.box, self.big, "--threads", 1) as daemon:
            done, failures = [], []

            def greedy():
                try:
                    with daemon.raw() as s:
                        sender = threading.Thread(target=s.sendall, args=(large * rounds,))
                        sender.start()
                        stream = s.makefile("rb")
                        for _ in range(rounds):
                            self.assertIn(b" 200 ", stream.readline())
                            while (line := stream.readline()) != b"\r\n":
                                if line.lower().startswith(b"content-length:"):
                                    length = int(line.split(b":")[1])
                            self.assertEqual(len(stream.read(length)), length)
                            done.append(1)
                        sender.join()
                except Exception as failure:
                    failures.append(failure)

            threads = [threading.Thread(target=greedy) for _ in range(streams)]
            for t in threads:
                t.start()
            connection, small = daemon.connect(), 0
            until(lambda: metrics(daemon)[("lambertd_in_flight",)] > 2 or done)
            # A turn each: the small client is served between the large requests, not behind all of them.
            while len(done) < streams * rounds and not failures:
                self.assertEqual(daemon.radiosity("box", SOLVE, connection=connection).status, 200)
                small += 1
            for t in threads:
                t.join()
            connection.close()
            self.assertEqual(failures, [])
            self.assertGreater(small, streams * rounds)

    def test_clients_that_reset_while_they_wait(self):
        body = json.dumps({"emissions": [[1] * 20000] * 20}).encode()
        whole = (b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: x\r\nAccept: application/x-npy\r\n"
                 b"Content-Length: %d\r\n\r\n" % len(body) + body)
        with Daemon(self.box, self.big, "--threads", 1) as daemon:
            for _ in range(10):
                s = daemon.raw()
                s.sendall(whole)
                s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                s.close()
            self.serves(daemon)
            until(lambda: metrics(daemon)[("lambertd_in_flight",)] == 1)
            until(lambda: metrics(daemon)[("lambertd_connections",)] == 1)
            self.assertEqual(metrics(daemon)[("lambertd_body_bytes",)], 0)

    def test_no_file_is_reachable(self):
        secret = self.folder / "secret.txt"
        secret.write_text("root:x:0:0")
        inside = str(secret)[1:].encode()
        with Daemon("--stores", self.folder) as daemon:
            for path in (b"/../../../../../../" + inside, b"/" + inside, b"//" + inside, b"/v1/scenes/../../" + inside,
                         b"/v1/scenes/..%2f..%2f" + inside.replace(b"/", b"%2f"), b"/v1/scenes/%2e%2e/%2e%2e/" + inside,
                         b"/v1/scenes/secret.txt", b"/v1/scenes/box.h5", b"/v1/scenes/%2e%2e%2f" + self.folder.name.encode(),
                         b"/%2e%2e/%2e%2e/etc/passwd", b"/etc/passwd", b"/v1/scenes/box%00", b"/v1/scenes/box%00/../box",
                         b"/v1/scenes/" + b"..%c0%af" * 20, b"/v1/scenes/" + b"a" * 30000, b"/v1/scenes/" + b"%61" * 300,
                         b"/v1/scenes/\x00box", b"/\x00", b"/v1/scenes/\\..\\..\\etc", b"file:///etc/passwd",
                         b"http://127.0.0.1/etc/passwd", b"/?file=/etc/passwd", b"/metrics/../etc/passwd"):
                with self.subTest(path=path[:80]), daemon.raw() as s:
                    s.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
                    answer = read_all(s)
                    self.assertRegex(answer[:13], rb"^HTTP/1\.1 (400|404|414|431|501)", answer[:200])
                    self.assertNotIn(b"root:x", answer)
            self.serves(daemon)


if __name__ == "__main__":
    unittest.main()
