"""The limits of what lambertd keeps and of what its requests take, under the requests that once passed them."""

import json
import pathlib
import re
import select
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import numpy as np

from daemon import LAMBERTD, PATIENCE, Daemon
from guard_case import HEAD, MIB, metrics, read_all, until
from make_store import Scene

TOKEN = "s3cret"


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class Kept(Case):
    """--max-memory: stores, variants, work areas."""

    def put(self, daemon, name):
        headers = {"Authorization": f"Bearer {TOKEN}", "Content-Type": "application/json"}
        answer = daemon.ask("PUT", "/v1/scenes/base/reflectance", json.dumps({"variant": name, "groups": {"wall": .3}}), headers)
        self.assertEqual(answer.status, 202, answer)
        deadline = time.monotonic() + PATIENCE
        while (answer := daemon.ask("GET", f"/v1/scenes/base@{name}", headers=headers)).status != 200:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(.002)
        return answer.json()["bytes"]

    def counted(self, path):
        """Bytes of a store, and of one thread that solves, from refusals of a store that has no room for them."""
        def refused(most, words):
            ended = subprocess.run([LAMBERTD, "--listen", "127.0.0.1:0", str(path), "--threads", "1", "--max-memory", str(most)],
                                   capture_output=True, text=True, timeout=PATIENCE)
            return [int(number) for number in re.search(words, ended.stderr).groups()]

        to_open = sum(refused(10000, r"takes (\d+) bytes, and (\d+) more while it is read"))
        return refused(to_open, r"takes (\d+) bytes, and 1 threads (\d+) each to solve")

    def test_variants_are_counted_after_stores_were_read_again(self):
        """A store that came later leaves room for one of two variants: the older one stays."""
        folder, token = self.folder / "stores", self.folder / "token"
        folder.mkdir()
        token.write_text(TOKEN)
        Scene(200, rank=60).write(folder / "base.h5", "base", keep_factors=True)
        Scene(200, rank=60, seed=2).write(self.folder / "later.h5", "later", keep_factors=True)
        headers = {"Authorization": f"Bearer {TOKEN}"}
        (held, work), variant = self.counted(folder / "base.h5"), 60 * 60 * 4
        limit = 2 * held + work + variant * 3 // 2
        with Daemon("--stores", folder, "--threads", 1, "--max-variants", 4, "--token-file", token, "--max-memory", limit) as daemon:
            self.assertEqual([self.put(daemon, name) for name in ("older", "newer")], [variant] * 2)
            (self.folder / "later.h5").rename(folder / "later.h5")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ")
            scenes = daemon.ask("GET", "/v1/scenes", headers=headers).json()["scenes"]
            self.assertEqual([s["name"] for s in scenes], ["base", "base@older", "later"])
            self.assertLessEqual(sum(s["bytes"] for s in scenes) + work, limit)
            self.assertIn("dropped base@newer: the stores leave it no room in --max-memory", daemon.errors())


# Beside the limits: the program, its heap between allocations, the memory of connections (32 KiB each).
CONSTANT = 64 * MIB


class Requests(Case):
    """--max-request-memory: bodies, emissions, outputs, answers that nobody reads."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.store = pathlib.Path(folder.name) / "big.h5"
        cls.n = 60000
        cls.scene = Scene(cls.n, rank=4)
        cls.scene.write(cls.store, "big", kind="low_rank")

    @staticmethod
    def resident(daemon, what="VmRSS"):
        process = pathlib.Path(f"/proc/{daemon.process.pid}")
        if "san.so" in (process / "maps").read_text():
            return 0  # a sanitizer keeps what is freed, and the shadow of it
        status = (process / "status").read_text()
        return int(re.search(rf"^{what}:\s+(\d+) kB", status, re.M).group(1)) * 1024

    def send(self, daemon, body, accept="application/json"):
        """A connection whose answer is not read."""
        s = socket.socket()
        self.addCleanup(s.close)
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        s.connect(("127.0.0.1", daemon.port))
        s.sendall(b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                  b"Accept: %s\r\nContent-Length: %d\r\n\r\n" % (accept.encode(), len(body)) + body)
        return s

    @staticmethod
    def settle(daemon, clients):
        """The clients that have an answer, once all others wait for memory."""
        def ready():
            return select.select(clients, [], [], 0)[0]

        until(lambda: len(ready()) + metrics(daemon)[("lambertd_request_memory_waiting",)] == len(clients))
        return ready()

    def groups(self, count, **more):
        return json.dumps({"emissions": [{"groups": {"lamp": k}} for k in range(1, count + 1)], **more}).encode()

    def test_answers_that_nobody_reads(self):
        """Twelve of 128 vectors, 2.8 KB each, whose text is 70 MB: those that fit are held as floats, others wait."""
        limit = 200 * MIB
        with Daemon(self.store, "--threads", 2, "--max-request-memory", limit, "--timeout", 3600) as daemon:
            clients = [self.send(daemon, self.groups(128)) for _ in range(12)]
            answered = self.settle(daemon, clients)
            self.assertLess(self.resident(daemon, "VmHWM"), limit + CONSTANT)
            self.assertEqual({s.recv(12)[9:] for s in answered}, {b"200"})
            # 31 MB each as they are computed; twice as much while they are.
            self.assertGreaterEqual(len(answered), 4)
            held = metrics(daemon)[("lambertd_request_memory_bytes",)]
            self.assertGreaterEqual(held, len(answered) * 128 * self.n * 4)
            self.assertLessEqual(held, limit)
            # The others are served once those have gone, and all is given back.
            for s in answered:
                s.close()
            others = self.settle(daemon, [s for s in clients if s not in answered])
            self.assertGreaterEqual(len(others), 4)
            self.assertEqual({s.recv(12)[9:] for s in others}, {b"200"})
            self.assertLess(self.resident(daemon, "VmHWM"), limit + CONSTANT)
            for s in clients:
                s.close()
            until(lambda: metrics(daemon)[("lambertd_request_memory_bytes",)] == 0)
            answer = daemon.radiosity("big", self.groups(128))
            self.assertEqual(answer.status, 200)
            until(lambda: metrics(daemon)[("lambertd_request_memory_bytes",)] == 0)
            self.assertLess(self.resident(daemon), CONSTANT)
            B = np.array(answer.json()["radiosity"])
            E = np.zeros((128, 1, self.n))
            E[:, :, self.scene.members("lamp")] = np.arange(1, 129)[:, None, None]
            wanted = np.array([self.scene.solve(e)[0] for e in E])
            self.assertLess(np.abs(B - wanted).max(), 1e-5 * wanted.max())

    def test_requests_under_way(self):
        """Short bodies that ask for 1,024 vectors of 60,000 elements, 246 MB of emission alone."""
        limit = 400 * MIB
        with Daemon(self.store, "--threads", 2, "--max-request-memory", limit, "--timeout", 3600) as daemon:
            clients = [self.send(daemon, self.groups(1024), "application/x-npy") for _ in range(6)]
            self.assertEqual({s.recv(12)[9:] for s in clients}, {b"422"})
            # Each fits alone, and its answer with another that is computed.
            more = [self.send(daemon, self.groups(300), "application/x-npy") for _ in range(6)]
            answered = self.settle(daemon, more)
            self.assertLess(self.resident(daemon, "VmHWM"), limit + CONSTANT)
            self.assertEqual({s.recv(12)[9:] for s in answered}, {b"200"})
            for s in clients + more:
                s.close()
            until(lambda: metrics(daemon)[("lambertd_request_memory_bytes",)] == 0)
            answer = daemon.radiosity("big", self.groups(1024))
            self.assertEqual(answer.status, 422)
            self.assertIn("--max-request-memory", answer.json()["detail"])
            # With the values of one group in place of the whole vectors there is room.
            for more in {"reduce": {"groups": ["lamp"], "with": ["max"]}}, {"select": {"groups": ["lamp"]}}:
                self.assertEqual(daemon.radiosity("big", self.groups(1024, **more)).status, 200)
                self.assertLess(self.resident(daemon, "VmHWM"), limit + CONSTANT)

    def test_a_body_that_can_never_fit(self):
        with Daemon(self.store, "--max-request-memory", "3M") as daemon:
            with daemon.raw() as s:
                s.sendall(HEAD.replace(b"box", b"big") + b"Content-Length: %d\r\n\r\n" % (4 * MIB))
                answer = read_all(s)
            self.assertTrue(answer.startswith(b"HTTP/1.1 413 "), answer)
            self.assertIn(b"--max-request-memory", answer)
            self.assertEqual(metrics(daemon)[("lambertd_request_memory_bytes",)], 0)
            self.assertEqual(daemon.radiosity("big", self.groups(1)).status, 200)


if __name__ == "__main__":
    unittest.main()
