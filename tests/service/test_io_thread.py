"""The one thread that receives and sends: an answer takes little of it, and each client has its turns there.

No figure here is a time of the clock: costs are the daemon's processor time, compared with that of GET /healthz in the same run,
and turns are counted in the order of the access log.
"""

import gzip
import json
import os
import pathlib
import re
import socket
import statistics
import tempfile
import threading
import time
import unittest

from daemon import METRICS_S, PATIENCE, Daemon
from guard_case import read_all
from make_store import Scene

ROUTES = pathlib.Path(__file__).resolve().parents[2] / "server" / "route" / "routes.c"
MIB = 1 << 20


def request(path, *lines, method="GET", body=b""):
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: localhost", *lines, "", ""]).encode() + body


def processor_seconds(daemon):
    """Of all threads."""
    tasks = pathlib.Path(f"/proc/{daemon.process.pid}/task")
    return 1e-9 * sum(int((tasks / task / "schedstat").read_text().split()[0]) for task in os.listdir(tasks))


class IoThread(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.store = cls.folder / "box.h5"
        # Its description has 14 KB.
        Scene(600, groups=[f"group {k}" for k in range(500)]).write(cls.store, "box")
        cls.weather = b"LOCATION,Here\n" + b"".join(b"1999,%d,%.3f\n" % (k, k * .7 % 40) for k in range(400000))
        assert 4 * MIB < len(cls.weather) < 8 * MIB
        (cls.folder / "box.epw").write_bytes(cls.weather)

    def ask_often(self, daemon, line, times, wanted):
        """Processor seconds of the daemon for a request without the body of an answer, which is sent so often at once."""
        with socket.create_connection(("127.0.0.1", daemon.port), PATIENCE) as s:
            before = processor_seconds(daemon)
            s.sendall(line * times)
            got = b""
            while (n := got.count(b"\r\n\r\n")) < times:
                part = s.recv(1 << 16)
                self.assertTrue(part, got[-200:])
                got += part
            self.assertEqual(n, times)
            self.assertEqual(len(re.findall(rb"^HTTP/1.1 %d " % wanted, got, re.M)), times, got[:300])
            return processor_seconds(daemon) - before

    def test_what_an_answer_costs(self):
        """HEAD and 304 of each route, plain and compressed, cost about what GET /healthz costs: bytes, tags and codings are kept.
        They were found anew for each answer: a hash of 6 MB takes 50 times as long, to compress 100 KB 15 times."""
        paths = sorted(set(re.findall(r'\.method = "GET",\s+\.pattern = "([^"]+)"', ROUTES.read_text())))
        self.assertGreater(len(paths), 12)
        times, tagged = 200, 0
        with Daemon(self.store, "--threads", 2) as daemon:
            def pace():
                return self.ask_often(daemon, request("/healthz", method="HEAD"), times, 200)

            def often(line, status):
                """Of both the least of some rounds in turns: another load on the machine makes one of them slow, but not all."""
                took, beside = [], []
                while len(took) < 3 or (len(took) < 10 and not min(took) < 4 * min(beside)):
                    beside.append(pace())
                    took.append(self.ask_often(daemon, line, times, status))
                return min(took) / min(beside)

            for path in paths:
                for accept in "identity", "gzip", "zstd":
                    own = path.replace("{name}", "box")
                    first = daemon.ask("HEAD", own, headers={"Accept-Encoding": accept})
                    asked = [(request(own, f"Accept-Encoding: {accept}", method="HEAD"), first.status)]
                    if tag := first.headers["ETag"]:
                        asked += [(request(own, f"Accept-Encoding: {accept}", f"If-None-Match: {tag}"), 304)]
                        tagged += 1
                    for line, status in asked:
                        took = often(line, status)
                        with self.subTest(path=path, accept=accept, status=status, took=f"{took:.1f} times"):
                            self.assertLess(took, 4)
            self.assertGreaterEqual(tagged, 12)

    def test_bytes_are_those_of_the_file(self):
        """In parts, in each coding, to clients at once."""
        with Daemon(self.store, "--threads", 2) as daemon:
            path = "/v1/scenes/box/weather"
            for accept in ("identity", "gzip"):
                answers = []
                clients = [threading.Thread(target=lambda: answers.append(daemon.get(path, headers={"Accept-Encoding": accept})))
                           for _ in range(4)]
                for c in clients:
                    c.start()
                for c in clients:
                    c.join()
                for answer in answers:
                    self.assertEqual(answer.headers["Content-Encoding"], None if accept == "identity" else accept)
                    self.assertEqual(gzip.decompress(answer.body) if accept == "gzip" else answer.body, self.weather)
                self.assertEqual(len({answer.headers["ETag"] for answer in answers}), 1)

    def test_codings_within_max_memory(self):
        """Without room for a coding the text is still sent in it, and not kept."""
        with Daemon(self.store, "--threads", 2) as daemon:
            most = self.memory(daemon)
            daemon.get("/v1/scenes/box/weather", headers={"Accept-Encoding": "gzip"})
            grown = self.memory(daemon) - most
            self.assertGreater(grown, len(self.weather) / 20)
            again = daemon.get("/v1/scenes/box/weather", headers={"Accept-Encoding": "gzip"})
            self.assertEqual(self.memory(daemon), most + grown)
            self.assertEqual(len(again.body), grown - 1)
        with Daemon(self.store, "--threads", 2, "--max-memory", most + grown - 1) as daemon:
            for _ in range(2):
                answer = daemon.get("/v1/scenes/box/weather", headers={"Accept-Encoding": "gzip"})
                self.assertEqual(gzip.decompress(answer.body), self.weather)
                self.assertEqual(self.memory(daemon), most)

    @staticmethod
    def memory(daemon):
        return int(re.search(r"^lambertd_kept_memory_bytes (\d+)$", daemon.get("/metrics").body.decode(), re.M)[1])

    def test_metrics_are_written_ten_times_a_second(self):
        """Each text counts the requests for the one before, so that no two are the same."""
        with Daemon(self.store, "--threads", 2) as daemon, socket.create_connection(("127.0.0.1", daemon.port), PATIENCE) as s:
            start, got = time.monotonic(), b""
            for _ in range(10):
                s.sendall(request("/metrics") * 40)
                wanted = got.count(b"HTTP/1.1 200") + 40
                while got.count(b"HTTP/1.1 200") < wanted or not got.endswith(b"\n"):
                    got += s.recv(1 << 20)
            took = time.monotonic() - start
            texts = {re.sub(r"\A.*?\r\n\r\n", "", part, flags=re.S) for part in got.decode().split("HTTP/1.1 200")[1:-1]}
            print(f"{len(texts)} texts in {took:.3f} s")
            self.assertLessEqual(len(texts), took / METRICS_S + 2)

    def test_long_tokens(self):
        """A token that is longer than any may be is compared with none: 256 times 30,000 bytes took 1,000 times as long."""
        tokens = self.folder / "tokens"
        tokens.write_text("".join(f"{k:032d}\n" for k in range(256)))
        tokens.chmod(0o600)
        with Daemon(self.store, "--token-file", tokens) as daemon:
            pad = "x" * 30000
            short, long = (min(self.ask_often(daemon, request("/v1/scenes", *lines, method="HEAD"), 20, 401) for _ in range(3))
                           for lines in (("Authorization: Bearer x", f"Pad: {pad}"), ("Pad: x", f"Authorization: Bearer {pad}")))
            # Both heads have the same length.
            self.assertLess(long, 3 * short)

    def between(self, line, drained):
        """The number of answers that 32 connections of one client get, which always ask, from one answer to the next of another
        client that always asks: the median."""
        log, n = self.folder / "log", 60
        log.unlink(missing_ok=True)
        with Daemon(self.store, "--threads", 2, "--access-log", log) as daemon:
            greedy = [self.connect(daemon, "127.0.0.1") for _ in range(32)]
            other = self.connect(daemon, "127.0.0.9")
            readers = [threading.Thread(target=read_all, args=(s,)) for s in greedy if drained]
            for r in readers:
                r.start()
            other.sendall(request("/healthz", method="HEAD"))
            other.recv(4096)
            for s in greedy:
                s.sendall(line * 400)
            other.sendall(request("/healthz", method="HEAD") * n)
            got = b""
            while got.count(b"\r\n\r\n") < n:
                got += other.recv(1 << 16)
            for s in [*greedy, other]:
                s.shutdown(socket.SHUT_RDWR)
            for r in readers:
                r.join()
            for s in [*greedy, other]:
                s.close()
        counts, count = [], 0
        for entry in map(json.loads, log.read_text().splitlines()):
            if entry["client"] == "127.0.0.9":
                counts.append(count)
                count = 0
            else:
                count += 1
        self.assertEqual(len(counts), n + 1)
        return statistics.median(counts[10:])

    def connect(self, daemon, source):
        s = socket.create_connection(("127.0.0.1", daemon.port), PATIENCE, (source, 0))
        self.addCleanup(s.close)
        return s

    def test_turns_are_those_of_clients(self):
        """A connection gets an answer each two rounds, as it is read once and answered once. In a round a client has 60 us, which are
        two small answers of 30 us (server/net/turns.h), and one more that was begun before they were over: 6 in two rounds.
        Turns of connections would be 32."""
        for line in (request("/healthz", method="HEAD"), request("/v1/scenes/box/weather", method="HEAD"), request("/nothing", method="HEAD"),
                     request("/metrics", "Accept-Encoding: gzip", method="HEAD")):
            counted = self.between(line, True)
            with self.subTest(line=line.split(b"\r\n")[0], counted=counted):
                self.assertLessEqual(counted, 10)


if __name__ == "__main__":
    unittest.main()
