"""lambertd's defence against slow clients: a part of a request or of an answer that takes too long ends the connection."""

import json
import socket
import threading
import time
import unittest

from daemon import PATIENCE, Daemon
from guard_case import HEAD, MIB, SOLVE, Case, cuts, metrics, until
from make_store import Scene


class Times(Case):
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
                s.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                self.assertIn(b" 200 ", s.recv(65536))
                self.assertEqual(self.drip(s, b"GET /healthz HTTP/1.1\r\nX: " + b"y" * 8000, 0.1), b"")
            self.assertEqual(cuts(daemon, "head"), 2)

    def test_a_body_that_drips_is_cut(self):
        with Daemon(self.box, "--timeout", 1) as daemon:
            for head in (HEAD + b"Content-Length: 90000\r\n\r\n", HEAD + b"Transfer-Encoding: chunked\r\n\r\nffff\r\n",
                         # One that is refused, whose body is dropped.
                         HEAD.replace(b"application/json", b"text/plain") + b"Content-Length: 90000\r\n\r\n"):
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
        s.sendall(b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nAccept: application/x-npy\r\n"
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
        with Daemon(path, "--timeout", 1, "--threads", 1) as daemon:
            # Twice the work each time, so that the last round takes seconds on any machine.
            answers, asked, clients, vectors = [], 0, 1, 125
            while True:
                asked += clients
                body = json.dumps({"emissions": [{"elements": [i], "values": [1]} for i in range(vectors)]})
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
                clients, vectors = (clients, 2 * vectors) if vectors < 1000 else (2 * clients, vectors)
                self.assertLess(clients, 256, "no solve takes long enough to tell")
            self.assertEqual(answers, [200] * asked)


if __name__ == "__main__":
    unittest.main()
