"""Answers of many numbers: nobody waits for one to be written or read."""

import ctypes
import ctypes.util
import gzip
import io
import json
import pathlib
import tempfile
import threading
import time
import unittest

import numpy as np

from daemon import Daemon
from guard_case import HEAD, metrics, read_all, until
from make_store import Scene
from patience import PATIENCE

GROUPS = [f"g{k}" for k in range(20)]


class LongAnswers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        Scene(20000, groups=GROUPS).write(cls.folder / "big.h5", "big")

    @staticmethod
    def figures(vectors):
        return {"emissions": [{"groups": {"g1": v}} for v in range(1, vectors + 1)], "reduce": {"groups": GROUPS, "with": ["mean"]}}

    def test_long_figures_wait_for_their_turn(self):
        """Figures of a few vectors are written by the thread that receives and sends, beside a queue that is full; those of
        many, which take as long as many such answers, by one that solves."""
        with Daemon(self.folder / "big.h5", "--threads", 1, "--max-inflight", 1, "--max-batch", 4000) as daemon:
            self.assertEqual(daemon.radiosity("big", self.figures(1)).status, 200)
            ended, failures = threading.Event(), []

            def fill_the_queue():
                try:
                    body = {"emissions": [{"groups": {"g2": 1}}] * 500}
                    connection = daemon.connect()
                    while not ended.is_set():
                        daemon.radiosity("big", body, accept="application/x-npy", connection=connection)
                    connection.close()
                except Exception as failure:
                    failures.append(failure)

            filler = threading.Thread(target=fill_the_queue)
            filler.start()
            try:
                seen, deadline, connection = set(), time.monotonic() + PATIENCE, daemon.connect()
                while seen != {200, 503} and time.monotonic() < deadline and not failures:
                    seen.add(daemon.radiosity("big", self.figures(400), connection=connection).status)
                    if 503 not in seen and len(seen) > 0:
                        continue
                    self.assertEqual(daemon.radiosity("big", self.figures(2), connection=connection).status, 200)
                    if 503 in seen:
                        break
            finally:
                ended.set()
                filler.join()
            self.assertEqual(failures, [])
            self.assertIn(503, seen)
            self.assertEqual(metrics(daemon)[("lambertd_queued",)], 0)


    def stream(self, daemon, accept="application/json", coding=None, version="1.1", n=40):
        """Status line, headers and body of an answer of n vectors, whose text is above 12 MiB."""
        body = json.dumps({"emissions": [{"groups": {"g1": v}} for v in range(1, n + 1)]}).encode()
        more = f"Accept-Encoding: {coding}\r\n" if coding else ""
        with daemon.raw() as s:
            s.sendall((f"POST /v1/scenes/big/radiosity HTTP/{version}\r\nHost: localhost\r\nAccept: {accept}\r\n{more}"
                       f"Content-Type: application/json\r\nConnection: close\r\nContent-Length: {len(body)}\r\n\r\n").encode() + body)
            head, _, rest = read_all(s).partition(b"\r\n\r\n")
        lines = head.decode().split("\r\n")
        headers = {k.lower(): v for k, v in (line.split(": ", 1) for line in lines[1:])}
        if headers.get("transfer-encoding") == "chunked":
            rest = unchunk(rest)
        return lines[0], headers, rest

    def test_answers_that_are_encoded_while_they_are_sent(self):
        """They are the same numbers in every encoding, coding and version of HTTP, and give back what they held."""
        with Daemon(self.folder / "big.h5", "--threads", 2) as daemon:
            line, headers, body = self.stream(daemon, "application/x-npy")
            self.assertEqual((line, headers["content-length"]), ("HTTP/1.1 200 OK", str(len(body))))
            wanted = np.load(io.BytesIO(body))
            self.assertEqual(wanted.shape, (40, 20000))
            for accept, exact in ("application/json", np.float32), ("application/x-npy; dtype=f8", np.float64), \
                    ("application/x-npy; dtype=f2", np.float16):
                plain = None
                for coding, version in (None, "1.1"), ("gzip", "1.1"), ("zstd", "1.1"), (None, "1.0"), ("gzip", "1.0"):
                    # Enough that every encoding passes 12 MiB.
                    n = {np.float32: 40, np.float64: 80, np.float16: 320}[exact]
                    line, headers, body = self.stream(daemon, accept, coding, version, n)
                    self.assertTrue(line.endswith(" 200 OK"), line)
                    used = headers.get("content-encoding")
                    self.assertIn(used, (None, coding))
                    if exact == np.float32 and coding:
                        self.assertEqual(used, coding)
                    if used == "gzip":
                        body = gzip.decompress(body)
                    elif used == "zstd":
                        body = unzstd(body, 64 << 20)
                    elif exact != np.float32:
                        self.assertEqual(headers["content-length"], str(len(body)))
                    if exact == np.float32:
                        answer = json.loads(body)
                        self.assertEqual((answer["scene"], answer["elements"]), ("big", 20000))
                        self.assertIn("time_ms", answer)
                        given = np.array(answer["radiosity"], np.float32)
                    else:
                        given = np.load(io.BytesIO(body))
                        self.assertEqual(given.dtype, exact)
                    np.testing.assert_array_equal(given[:40], wanted.astype(exact))
                    plain = given if plain is None else plain
                    np.testing.assert_array_equal(given, plain)
            until(lambda: metrics(daemon)[("lambertd_request_memory_bytes",)] == 0)

    def test_threads_that_solve_encode_and_compress(self):
        """The one that receives and sends only copies: of the processor time of long answers it takes the smaller part."""
        def seconds(daemon):
            """Of the thread that receives and sends, and of all."""
            io = every = 0
            for task in pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir():
                took = int((task / "schedstat").read_text().split()[0])
                every += took
                io += took if (task / "comm").read_text().startswith("MHD") else 0
            return io, every

        with Daemon(self.folder / "big.h5", "--threads", 2) as daemon:
            before = seconds(daemon)
            for coding in "gzip", "gzip", None:
                self.stream(daemon, coding=coding)
            io, every = (after - b for after, b in zip(seconds(daemon), before))
            print(f"{1e-6 * io:.0f} of {1e-6 * every:.0f} ms by the thread that receives and sends")
            self.assertGreater(io, 0)
            self.assertLess(io, every / 2)

    def test_clients_that_go_in_the_middle(self):
        # Of other digits each, so that what is left to be sent fits into no buffers of sockets, compressed or not.
        n = 200
        body = json.dumps({"emissions": [{"groups": {"g1": 1 / v}} for v in range(3, 3 + n)]}).encode()
        with Daemon(self.folder / "big.h5", "--threads", 2) as daemon:
            for coding in b"identity", b"gzip", b"zstd":
                with daemon.raw() as s:
                    s.sendall(HEAD.replace(b"box", b"big") + b"Accept-Encoding: " + coding +
                              b"\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
                    self.assertTrue(s.recv(100).startswith(b"HTTP/1.1 200 OK"))
                    self.assertGreater(metrics(daemon)[("lambertd_request_memory_bytes",)], n * 20000 * 4)
                until(lambda: metrics(daemon)[("lambertd_request_memory_bytes",)] == 0)


def unzstd(raw, most):
    """A frame without its length, which a stream does not know before."""
    library = ctypes.CDLL(ctypes.util.find_library("zstd"))
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    out = ctypes.create_string_buffer(most)
    length = library.ZSTD_decompress(out, most, raw, len(raw))
    assert length <= most, "not zstd"
    return out.raw[:length]


def unchunk(body):
    parts, at = [], 0
    while True:
        end = body.index(b"\r\n", at)
        size = int(body[at:end], 16)
        if size == 0:
            return b"".join(parts)
        parts.append(body[end + 2:end + 2 + size])
        at = end + 4 + size


if __name__ == "__main__":
    unittest.main()
