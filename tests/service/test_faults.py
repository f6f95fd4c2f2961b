"""Faults around a daemon and not in a request: memory that ends, clocks that jump, kill -9, reloads without
end. tests/faults/faults.c makes it go wrong; sanitizers bring allocators of their own, so this is for other builds."""

import gzip
import io
import json
import os
import pathlib
import re
import signal
import socket
import struct
import tempfile
import threading
import time
import unittest

import numpy as np

from command import must
from daemon import PATIENCE, Daemon
from make_store import Luminaires, Scene, Sensors

N, TOKEN = 60, "s3cret"
NPY, JSON = "application/x-npy", "application/json"


class Controls:
    """The file that faults.c reads: allocations left until one fails, allocations held, seconds of the wall's clock."""

    def __init__(self, path):
        self.path = path
        path.write_bytes(struct.pack("=qqq", -1, 0, 0))

    def _at(self, index, value=None):
        with open(self.path, "r+b", buffering=0) as f:
            f.seek(8 * index)
            if value is None:
                return struct.unpack("=q", f.read(8))[0]
            f.write(struct.pack("=q", value))
        return value

    def fail_after(self, count):
        self._at(0, count)

    def left(self):
        return self._at(0)

    def held(self):
        return self._at(1)

    def set_clock_off_by(self, seconds):
        self._at(2, seconds)

    def launcher(self):
        return "env", f"LD_PRELOAD={os.environ['FAULTS_LIBRARY']}", f"FAULTS={self.path}"


def array(values):
    out = io.BytesIO()
    np.save(out, np.asarray(values, "<f4"))
    return out.getvalue()


def requests(n):
    """(method, path, headers, body): one at least for every route, format and way that an answer is made."""
    return [(method, path, dict(headers, Authorization=f"Bearer {TOKEN}"), body)
            for method, path, headers, body in each_request(n)]


def each_request(n):
    dense = [float(x) for x in np.float32(np.random.default_rng(3).random(n))]
    solve, adjoint = "/v1/scenes/grey/radiosity", "/v1/scenes/grey/adjoint"
    for path in ("/healthz", "/metrics", "/v1/scenes", "/v1/scenes/grey", "/v1/openapi.json", "/nothing", "/v1/scenes/none"):
        yield "GET", path, {}, None
    for body in ({"emission": dense}, {"emission": {"elements": [3, 5], "values": [1, 2]}, "quantity": "irradiance"},
                 {"emission": {"groups": {"lamp": 3}}, "select": {"groups": ["floor"]}},
                 {"emissions": [dense, {"groups": {"lamp": 1}}], "quantity": "indirect"},
                 {"emission": {"groups": {"lamp": 2}}, "reduce": {"groups": ["floor"], "with": ["mean", "sum"]}},
                 {"emission": dense, "reduce": {"groups": ["floor", "lamp"], "with": ["min", "variance"]}},
                 {"emission": dense[:-1]}, {"emission": {"groups": {"moon": 1}}}):
        yield "POST", solve, {"Content-Type": JSON}, json.dumps(body)
    yield "POST", solve, {"Content-Type": JSON}, '{"emission":[1,'
    yield "POST", solve, {"Content-Type": JSON, "Accept-Encoding": "gzip"}, json.dumps({"emission": [1] * n})
    yield "POST", solve, {"Content-Type": NPY, "Accept": NPY}, array(dense)
    yield "POST", solve, {"Content-Type": NPY, "Accept": NPY + "; dtype=f2"}, array([dense] * 3)
    yield "POST", solve, {"Content-Type": NPY, "Accept": JSON}, array(dense)
    for body in ({"cotangent": dense}, {"cotangent": dense, "emission": dense, "gradient": ["emission", "reflectance"]},
                 {"cotangent": {"groups": {"lamp": 1}}, "gradient": ["emission"]},
                 {"cotangents": [dense, {"groups": {"lamp": {"mean": 1}}}], "gradient": ["emission", "groups"]}):
        yield "POST", adjoint, {"Content-Type": JSON}, json.dumps(body)
    yield "POST", adjoint, {"Content-Type": NPY, "Accept": NPY}, array(dense)
    lit, sets = {"luminaires": {"desk-1": 1, "row-a": .5}, "groups": {"lamp": 2}}, {"sensors": ["room", "faces"]}
    for body in ({"emission": lit, "select": sets}, {"emission": dense, "reduce": {**sets, "with": ["mean"]}},
                 {"emission": lit, "reduce": {**sets, "with": ["mean", "share"], "at_least": [1]}},
                 {"emission": lit, "reduce": {"sensors": ["seat"], "with": ["mean", "ugr"]}},
                 {"emissions": [dense, lit], "reduce": {"sensors": ["seat"], "with": ["ugr"]}}):
        yield "POST", solve, {"Content-Type": JSON}, json.dumps(body)
    yield "POST", solve, {"Content-Type": JSON, "Accept": NPY}, json.dumps({"emission": lit, "select": sets})
    yield "POST", adjoint, {"Content-Type": JSON}, json.dumps({"cotangent": {"sensors": {"room": 1}}, "gradient": ["luminaires"]})
    for of in sets, {"groups": ["lamp", "floor"]}, {"elements": [3, 1]}, {"elements": list(range(40))}:
        yield "POST", "/v1/scenes/grey/jacobian", {"Content-Type": JSON}, json.dumps({"of": of})
    yield "GET", "/v1/scenes/grey/sensors", {}, None
    yield "GET", "/v1/scenes/grey/groups", {}, None
    for query, accept in (("", JSON), ("?fields=area,face", "application/zip"), ("?fields=centre", NPY), ("?fields=area,area", JSON)):
        yield "GET", f"/v1/scenes/grey/elements{query}", {"Accept": accept}, None
    yield "GET", "/v1/scenes/grey/elements?fields=normal", {"Accept": "application/zip", "Accept-Encoding": "zstd"}, None
    light = {"emission": {"elements": [3], "values": [1]}}
    for more in ({"tolerance": 1e-4}, {"at": "faces"}, {"at": "faces", "select": {"groups": ["floor"]}},
                 {"select": {"faces": [7, 3]}, "tolerance": 1e-4}):
        yield "POST", "/v1/scenes/box/radiosity", {"Content-Type": JSON}, json.dumps({**light, **more})
    yield "POST", "/v1/scenes/box/radiosity", {"Content-Type": JSON, "Accept": NPY}, json.dumps({**light, "at": "faces"})
    reflectance = "/v1/scenes/grey/reflectance"
    yield "PUT", reflectance, {"Content-Type": JSON}, json.dumps({"variant": "x", "groups": {"moon": .5}})
    yield "PUT", reflectance, {"Content-Type": JSON}, json.dumps({"variant": "x", "groups": {"floor": .5}})
    yield "DELETE", reflectance, {"Content-Type": JSON}, json.dumps({"variant": "x"})


def settled(answer):
    """The part that must be the same each time: not the times, nor what a metric counts, nor whether it was compressed, nor what
    is still being built."""
    body = answer.body
    if answer.headers.get("Content-Encoding") == "gzip":
        body = gzip.decompress(body)
    if answer.headers.get("Content-Type", "").startswith("text/plain"):
        return body.startswith(b"# HELP ") and body.endswith(b"\n") and b"lambertd_connections_cut_total{why=" in body
    return re.sub(rb'"(time_ms|state)":(\{[^}]*\}|"[a-z]*")', b"", body)


class Faults(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        Scene(N).write(self.folder / "grey.h5", "grey", keep_factors=True)
        Sensors(N, lights=Luminaires(N).add_to(self.folder / "grey.h5"), eyes=3).add_to(self.folder / "grey.h5")
        (self.folder / "token").write_text(TOKEN)
        (self.folder / "token").chmod(0o600)

    def daemon(self, *more, **how):
        return Daemon(self.folder / "grey.h5", "--threads", 2, "--token-file", self.folder / "token", *more, **how)

    def ask(self, daemon, request):
        """The answer, or None where there was none, or not a whole one."""
        method, path, headers, body = request
        connection = daemon.connect()
        try:
            return daemon.ask(method, path, body, headers, connection)
        except (ConnectionError, OSError, ValueError, EOFError) as e:
            if isinstance(e, TimeoutError):
                raise
            return None
        except Exception as e:  # http.client's own: an answer that ended early
            if type(e).__module__ != "http.client":
                raise
            return None
        finally:
            connection.close()

    def gone(self, daemon):
        """Waits until every connection but the one that asks is forgotten, and no variant is being built."""
        deadline = time.monotonic() + PATIENCE
        while b"\nlambertd_connections 1\n" not in daemon.get("/metrics", headers={"Authorization": f"Bearer {TOKEN}"}).body:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.001)

    def fail_everywhere(self, daemon, controls, request, right):
        """One allocation after the other fails, until the request is answered without so many. Returns the number of refusals."""
        refused = 0
        for k in range(10000):
            controls.fail_after(k)
            answer = self.ask(daemon, request)
            met = controls.left() < 0
            controls.fail_after(-1)
            self.assertIsNone(daemon.process.poll(), f"{request[:2]}: ended at allocation {k}")
            if answer is None or answer.status in (500, 503):
                self.assertTrue(met, f"{request[:2]}: {answer} though no allocation failed")
                refused += 1
            else:
                self.assertTrue((answer.status, settled(answer)) in right, f"{request[:2]}, allocation {k}: {answer}")
            if not met:
                return refused
        self.fail(f"{request[:2]}: there is no end of allocations")

    def test_every_allocation_of_every_request(self):
        """Whichever fails, the daemon lives, says so or nothing, or is right all the same, and holds nothing back."""
        controls = Controls(self.folder / "controls")
        box = self.folder / "box.h5"
        must("generate", "box", "--divisions", 3, "-o", self.folder / "box.obj")
        must("precompute", self.folder / "box.obj", "--rays", 64, "--probes", 0, "--keep-form-factors", "--method", "low-rank",
             "--epsilon", .2, "-o", box, "--quiet")
        with self.daemon(f"{box}:box", "--max-variants", 2, launcher=controls.launcher()) as daemon:
            asked = requests(N)
            right = []
            for request in asked:
                first = [self.ask(daemon, request) for _ in range(4)]  # of a variant, the first is another than the next
                self.assertNotIn(None, first)
                right.append({(answer.status, settled(answer)) for answer in first})
            held, refused = [], 0
            for _ in range(3):
                refused = sum(self.fail_everywhere(daemon, controls, *pair) for pair in zip(asked, right))
                self.gone(daemon)
                held.append(controls.held())
            # Memory that is allocated once and kept is there after the first time round, and that of a thread which had nothing
            # to do until then a time later. Memory that a request holds back grows each time.
            self.assertLessEqual(min(after - before for before, after in zip(held, held[1:])), 8, held)
            self.assertGreater(refused, 10 * len(asked))
            for request, wanted in zip(asked, right):
                answer = self.ask(daemon, request)
                self.assertIn((answer.status, settled(answer)), wanted)


    def test_clocks_that_jump(self):
        """The wall's clock may be set to any time: who is served goes on, and who is silent is cut when it should be."""
        controls = Controls(self.folder / "controls")
        year = 365 * 86400
        with self.daemon("--timeout", 2, "--access-log", self.folder / "log", "--max-variants", 1,
                         launcher=controls.launcher()) as daemon:
            wanted = {request: settled(self.ask(daemon, (*request[:2], dict(request[2]), request[3])))
                      for request in self.solves()}
            kept = daemon.connect()
            for shift in (year, -year, -3600, 30 * year, 1, 0):
                silent, begun = daemon.raw(), time.monotonic()
                controls.set_clock_off_by(shift)
                for (method, path, headers, body), right in wanted.items():
                    answer = daemon.ask(method, path, body, dict(headers), kept)
                    self.assertEqual((answer.status, settled(answer)), (200, right))
                self.assertEqual(silent.recv(1), b"")
                self.assertGreater(time.monotonic() - begun, 1.9, shift)
                silent.close()
                kept.close()
                daemon.signal(signal.SIGHUP)
            kept.close()
            daemon.wait_for("reloaded: 1 scene", 6)
        with open(self.folder / "log", encoding="utf-8") as log:
            entries = [json.loads(line) for line in log]
        self.assertGreaterEqual(len(entries), 7 * len(wanted))
        self.assertEqual(len({entry["time"][:4] for entry in entries}), 4)  # the clock did jump
        self.assertTrue(all(0 <= entry["ms"] < 60e3 for entry in entries), "a time between two readings of one clock")

    @staticmethod
    def solves():
        """Answers of the requests that have one answer, as what a dict can hold."""
        return [(method, path, tuple(headers.items()), body) for method, path, headers, body in requests(N)
                if path.startswith("/v1/scenes/grey/") and method == "POST" and "moon" not in str(body)
                and body != '{"emission":[1,' and len(str(body)) > 60][:5]

    def test_killed_and_started_again(self):
        """On the same port and the same socket, under load: nothing is left over that stands in the way, and the answers
        are the same bits."""
        where, port, wanted = self.folder / "socket", 0, set()
        method, path, headers, body = self.solves()[0]
        stop, failures = threading.Event(), []

        def load():
            """Asks whoever is there; what breaks off is nobody's fault."""
            while not stop.is_set():
                try:
                    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as s:
                        s.sendall(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 500\r\n\r\n".encode() + b" " * 100)
                except OSError:
                    pass
                except Exception as failure:
                    failures.append(failure)
                time.sleep(0.002)

        client = None
        try:
            for _ in range(10):
                with self.daemon(listen=f"127.0.0.1:{port}") as daemon, \
                        Daemon(self.folder / "grey.h5", "--unix", where, listen=None) as other:
                    port = daemon.port
                    if client is None:
                        client = threading.Thread(target=load)
                        client.start()
                    answer = daemon.ask(method, path, body, dict(headers))
                    self.assertEqual(answer.status, 200)
                    wanted.add(settled(answer))
                    with socket.socket(socket.AF_UNIX) as s:
                        s.connect(str(where))
                        s.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                        self.assertTrue(s.recv(100).startswith(b"HTTP/1.1 200 "))
                    daemon.kill()
                    other.kill()
        finally:
            stop.set()
            if client is not None:
                client.join()
        self.assertEqual((len(wanted), failures), (1, []))
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["grey.h5", "socket", "token"])

    def test_a_thousand_reloads_under_load(self):
        wanted = self.solves()
        stop, failures, served = threading.Event(), [], [0, 0]

        def client(daemon, which, right):
            connection = daemon.connect()
            try:
                while not stop.is_set():
                    for (method, path, headers, body), one in zip(wanted, right):
                        answer = daemon.ask(method, path, body, dict(headers), connection)
                        if (answer.status, settled(answer)) != (200, one):
                            failures.append(answer)
                        served[which] += 1
            except Exception as failure:
                failures.append(failure)
            finally:
                connection.close()

        with self.daemon() as daemon:
            right = [settled(daemon.ask(method, path, body, dict(headers))) for method, path, headers, body in wanted]
            files = len(os.listdir(f"/proc/{daemon.process.pid}/fd"))
            clients = [threading.Thread(target=client, args=(daemon, k, right)) for k in range(2)]
            for c in clients:
                c.start()
            try:
                for count in range(1, 1001):
                    daemon.signal(signal.SIGHUP)
                    daemon.wait_for("reloaded: 1 scene", count)
            finally:
                stop.set()
                for c in clients:
                    c.join()
            self.assertEqual(failures, [])
            self.assertGreater(min(served), 100)
            self.assertLessEqual(len(os.listdir(f"/proc/{daemon.process.pid}/fd")), files + 2)
            self.assertEqual(daemon.errors(), "")


if __name__ == "__main__":
    unittest.main()
