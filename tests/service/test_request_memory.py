"""Requests that lack memory (--max-request-memory) wait for it within their time, in a fair order; what can never fit does not."""

import contextlib
import json
import pathlib
import re
import select
import socket
import tempfile
import threading
import time
import unittest

from daemon import PATIENCE, Daemon
from guard_case import MIB, metrics, read_all, until
from make_store import Scene

N = 60000
VECTOR = 4 * N


def body(count):
    """Takes count vectors of emission and as many of radiosity; an NPY answer keeps half."""
    return json.dumps({"emissions": [{"groups": {"lamp": k}} for k in range(1, count + 1)]}).encode()


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.store = pathlib.Path(folder.name) / "big.h5"
        Scene(N, rank=4).write(cls.store, "big", kind="low_rank")

    @contextlib.contextmanager
    def daemon(self, *options):
        """Without its clients when it is stopped, so that it has nothing to give up."""
        self.clients = []
        with Daemon(self.store, *options, "--timeout", 3600) as daemon:
            yield daemon
            for s in self.clients:
                s.close()

    def connect(self, daemon, source="127.0.0.1"):
        s = socket.socket()
        self.clients.append(s)
        s.settimeout(PATIENCE)
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        s.bind((source, 0))
        s.connect(("127.0.0.1", daemon.port))
        return s

    def send(self, daemon, body, *fields, source="127.0.0.1", accept=b"application/x-npy", length=None):
        s = self.connect(daemon, source)
        s.sendall(b"\r\n".join([b"POST /v1/scenes/big/radiosity HTTP/1.1", b"Host: localhost", b"Content-Type: application/json",
                                b"Accept: " + accept, b"Content-Length: %d" % (length or len(body)), *fields, b"", b""]) + body)
        return s

    def hold(self, daemon, count, source="127.0.0.1"):
        """An answer of so many vectors that is not read."""
        s = self.send(daemon, body(count), source=source)
        self.assertEqual(s.recv(12), b"HTTP/1.1 200")
        return s

    def held(self, daemon):
        return metrics(daemon)[("lambertd_request_memory_bytes",)]

    def waiting(self, daemon):
        return metrics(daemon)[("lambertd_request_memory_waiting",)]

    def status(self, s):
        return s.recv(12)[9:]


class Waiting(Case):
    def test_a_request_waits_until_others_go(self):
        with self.daemon("--max-request-memory", 160 * VECTOR) as daemon:
            holders = [self.hold(daemon, 40)]
            last = self.send(daemon, body(50))
            until(lambda: self.waiting(daemon) == 1)
            # Requests that fit are served meanwhile, and refused ones wait for nobody.
            self.assertEqual(daemon.radiosity("big", body(2)).status, 200)
            self.assertEqual(daemon.radiosity("big", body(400)).status, 422)
            self.assertEqual(daemon.radiosity("big", b"{}").status, 422)
            self.assertEqual(self.waiting(daemon), 1)
            for s in holders:
                s.close()
            self.assertEqual(self.status(last), b"200")
            last.close()
            until(lambda: self.held(daemon) == 0)
            self.assertEqual(metrics(daemon)[("lambertd_request_memory_refused_total", ("why", "full"))], 0)

    def test_it_waits_within_its_time(self):
        with self.daemon("--max-request-memory", 160 * VECTOR) as daemon:
            holder = self.hold(daemon, 40)
            start = time.monotonic()
            answer = read_all(self.send(daemon, body(50), b"Lambert-Timeout: .7", b"Connection: close"))
            self.assertGreaterEqual(time.monotonic() - start, .7)
            self.assertTrue(answer.startswith(b"HTTP/1.1 503 "), answer)
            self.assertIn(b"--max-request-memory", answer)
            self.assertGreaterEqual(int(re.search(rb"\r\nRetry-After: (\d+)\r\n", answer).group(1)), 1)
            figures = metrics(daemon)
            self.assertEqual(figures[("lambertd_solves_refused_total", ("why", "memory"))], 1)
            self.assertEqual(figures[("lambertd_request_memory_refused_total", ("why", "full"))], 1)
            # One whose client goes is forgotten.
            s = self.send(daemon, body(50))
            until(lambda: self.waiting(daemon) == 1)
            s.close()
            until(lambda: self.waiting(daemon) == 0)
            holder.close()
            until(lambda: self.held(daemon) == 0)

    def test_the_rest_of_a_body_waits(self):
        with self.daemon("--max-request-memory", 12 * MIB) as daemon:
            first = self.send(daemon, b" " * (6 * MIB), length=7 * MIB)
            until(lambda: self.held(daemon) == 6 * MIB)
            text = b" " * (6 * MIB) + body(1)
            second = self.send(daemon, b"", length=len(text), accept=b"application/x-npy")
            sender = threading.Thread(target=second.sendall, args=(text,))
            sender.start()
            until(lambda: self.waiting(daemon) == 1)
            first.close()
            self.assertEqual(self.status(second), b"200")
            sender.join()
            second.close()
            until(lambda: self.held(daemon) == 0)

    def test_bodies_that_wait_for_each_other(self):
        """Four bodies that leave none of them the room to be read: some are refused, so that the others are served."""
        with self.daemon("--max-request-memory", 40 * MIB) as daemon:
            text = b" " * (9 * MIB) + body(10)
            clients = [self.send(daemon, b"", length=len(text), accept=b"application/x-npy") for _ in range(4)]
            senders = [threading.Thread(target=s.sendall, args=(text,)) for s in clients]
            for t in senders:
                t.start()
            statuses = [self.status(s) for s in clients]
            for t in senders:
                t.join()
            self.assertIn(b"200", statuses)
            self.assertLessEqual(set(statuses), {b"200", b"503"})
            for s in clients:
                s.close()
            until(lambda: self.held(daemon) == 0)

    def test_places_are_for_those_that_wait_too(self):
        with self.daemon("--max-request-memory", 160 * VECTOR, "--max-inflight", 4) as daemon:
            holder = self.hold(daemon, 40)
            waiting = [self.send(daemon, body(50)) for _ in range(4)]
            until(lambda: self.waiting(daemon) == 4)
            answer = daemon.radiosity("big", body(50))
            self.assertEqual(answer.status, 503)
            self.assertIn("--max-inflight", answer.json()["detail"])
            # Another client's request has a place, for one of those.
            other = self.send(daemon, body(1), source="127.0.0.2")
            self.assertEqual(self.status(other), b"200")
            holder.close()
            statuses = []
            while waiting:
                s = select.select(waiting, [], [], PATIENCE)[0][0]
                statuses.append(self.status(s))
                s.close()
                waiting.remove(s)
            self.assertEqual(sorted(statuses), [b"200"] * 3 + [b"503"])

    def test_the_daemon_ends(self):
        with self.daemon("--max-request-memory", 160 * VECTOR, "--shutdown-timeout", 1) as daemon:
            self.hold(daemon, 40)
            waiting = self.send(daemon, body(50))
            until(lambda: self.waiting(daemon) == 1)
            daemon.stop()
            answer = read_all(waiting)
            self.assertTrue(answer.startswith(b"HTTP/1.1 503 "), answer)


class Fair(Case):
    def test_one_client_has_not_all_of_it(self):
        """Answers that one client does not read leave room for the requests of another, of which two do not take all either."""
        with self.daemon("--max-request-memory", 160 * VECTOR) as daemon:
            for _ in range(12):
                self.send(daemon, body(12))
            until(lambda: self.waiting(daemon) >= 2)
            time.sleep(.2)
            self.assertLessEqual(self.held(daemon), 120 * VECTOR)
            self.assertEqual(self.status(self.send(daemon, body(12), source="127.0.0.2")), b"200")
            self.assertEqual(self.status(self.send(daemon, body(2), source="127.0.0.3")), b"200")

    def test_one_client_has_not_all_bodies(self):
        """Bodies that one client sends slowly leave --max-buffered room for those of another."""
        with self.daemon("--max-body", "2M", "--max-buffered", "8M") as daemon:
            slow = [self.send(daemon, b" " * (MIB - 1), length=MIB) for _ in range(6)]
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 6 * (MIB - 1))
            refused = self.send(daemon, b" " * MIB)
            self.assertEqual(self.status(refused), b"503")
            other = self.send(daemon, b" " * MIB + body(1), source="127.0.0.2")
            self.assertEqual(self.status(other), b"200")
            for s in slow:
                s.close()

    def test_who_holds_least_goes_first(self):
        """Of two that wait the one of the client that holds nothing is answered, though it came later."""
        with self.daemon("--max-request-memory", 160 * VECTOR) as daemon:
            self.hold(daemon, 20)
            holder = self.hold(daemon, 20, source="127.0.0.3")
            greedy = self.send(daemon, body(49))
            until(lambda: self.waiting(daemon) == 1)
            modest = self.send(daemon, body(49), source="127.0.0.2")
            until(lambda: self.waiting(daemon) == 2)
            holder.close()
            self.assertEqual(self.status(modest), b"200")
            self.assertEqual(self.waiting(daemon), 1)
            modest.close()
            self.assertEqual(self.status(greedy), b"200")

    def test_small_ones_do_not_overtake_for_ever(self):
        """A client that asks for a tenth of the memory again and again, several at a time, beside one that needs nearly all."""
        with self.daemon("--max-request-memory", 160 * VECTOR, "--threads", 2) as daemon:
            stop = threading.Event()

            def ask():
                while not stop.is_set():
                    self.assertEqual(daemon.radiosity("big", body(12), accept="application/x-npy").status, 200)

            askers = [threading.Thread(target=ask) for _ in range(6)]
            for t in askers:
                t.start()
            try:
                until(lambda: self.held(daemon) > 60 * VECTOR)
                s = self.send(daemon, body(56), source="127.0.0.2")
                self.assertEqual(self.status(s), b"200")
                s.close()
            finally:
                stop.set()
                for t in askers:
                    t.join()


if __name__ == "__main__":
    unittest.main()
