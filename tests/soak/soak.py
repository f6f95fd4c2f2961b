"""Many mixed requests to one daemon, by several clients at once: every 1,000th answer of each is compared bit for bit
with the first to that request, and memory is looked at on the way. On request only: it takes minutes.

usage: soak.py [REQUESTS (1000000)] [CLIENTS (4)]        with LAMBERTD=path/to/lambertd
Ends with 0 when no answer differed, none failed, and the daemon took at most 2 % more memory in the last tenth of the
requests than in the first, the most that was seen under load in each.
"""

import io
import json
import multiprocessing
import os
import pathlib
import random
import re
import signal
import socket
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
import numpy as np  # noqa: E402

from daemon import Daemon  # noqa: E402
from make_store import Scene  # noqa: E402

N = 700
EVERY = 1000


def array(values):
    out = io.BytesIO()
    np.save(out, np.asarray(values, "<f4"))
    return out.getvalue()


def request(method, path, body=b"", kind=None, accept=None, more=()):
    lines = [f"{method} {path} HTTP/1.1", "Host: localhost", *more]
    if kind:
        lines.append(f"Content-Type: {kind}")
    if accept:
        lines.append(f"Accept: {accept}")
    if body or method == "POST":
        lines.append(f"Content-Length: {len(body)}")
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + body


def kinds_of_requests():
    """(bytes, status wanted) of every sort that clients send, good and bad."""
    rng = np.random.default_rng(3)
    dense, npy = [float(x) for x in np.float32(rng.random(N))], "application/x-npy"
    out = []
    for name in "grey", "colour":
        solve, adjoint = f"/v1/scenes/{name}/radiosity", f"/v1/scenes/{name}/adjoint"
        bodies = [({"emission": dense}, 200), ({"emission": {"elements": [3, 5], "values": [1, 2]}}, 200),
                  ({"emission": {"groups": {"lamp": 3}}, "quantity": "irradiance"}, 200),
                  ({"emission": {"groups": {"lamp": 3}}, "select": {"groups": ["floor"]}}, 200),
                  ({"emissions": [dense, {"groups": {"lamp": 1}}], "quantity": "indirect"}, 200),
                  ({"emission": {"groups": {"lamp": 2}}, "reduce": {"groups": ["floor"], "with": ["mean", "sum"]}}, 200),
                  ({"emission": dense, "reduce": {"groups": ["floor", "lamp"], "with": ["min", "variance"]}}, 200),
                  ({"emission": dense[:-1]}, 422), ({"emission": {"groups": {"moon": 1}}}, 422),
                  ({"emission": dense, "tolerance": 2}, 422)]
        for body, status in bodies:
            out.append((request("POST", solve, json.dumps(body).encode(), "application/json"), status))
        out.append((request("POST", solve, b'{"emission":[1,', "application/json"), 400))
        out.append((request("POST", solve, array(dense), npy, npy), 200))
        out.append((request("POST", solve, array([dense] * 3), npy, npy + "; dtype=f2"), 200)
                   if name == "grey" else (request("POST", solve, array([[dense] * 3] * 2), npy, npy), 200))
        out.append((request("POST", solve, array(dense), npy, "application/json", ["Accept-Encoding: zstd"]), 200))
        out.append((request("POST", adjoint, json.dumps({"cotangent": dense}).encode(), "application/json"), 200))
        out.append((request("POST", adjoint, json.dumps({"cotangent": dense, "emission": dense,
                                                         "gradient": ["emission", "reflectance"]}).encode(),
                            "application/json"), 200))
        out.append((request("GET", f"/v1/scenes/{name}"), 200))
    for path, status in (("/healthz", 200), ("/v1/scenes", 200), ("/v1/openapi.json", 200), ("/nothing", 404),
                         ("/v1/scenes/none", 404), ("/v1/scenes/..%2f..%2fetc", 404)):
        out.append((request("GET", path), status))
    return out


class Connection:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.left = b""

    def ask(self, data):
        self.socket.sendall(data)
        while b"\r\n\r\n" not in self.left:
            self.more()
        head, _, self.left = self.left.partition(b"\r\n\r\n")
        length = int(re.search(rb"(?i)content-length: (\d+)", head).group(1))
        while len(self.left) < length:
            self.more()
        body, self.left = self.left[:length], self.left[length:]
        return int(head[9:12]), body

    def more(self):
        got = self.socket.recv(1 << 20)
        if not got:
            raise ConnectionError("the daemon closed the connection")
        self.left += got


def comparable(body):
    """Without what may differ: the times; a coded answer holds them where they cannot be taken out."""
    if body[:4] == b"\x28\xb5\x2f\xfd":
        return b""
    return re.sub(rb'"time_ms":\{[^}]*\}', b"", body)


def client(port, requests, seed, asked, wrong):
    rng, first = random.Random(seed), {}
    all_kinds = kinds_of_requests()
    connection = Connection(port)
    for count in range(requests):
        which = rng.randrange(len(all_kinds))
        data, wanted = all_kinds[which]
        status, body = connection.ask(data)
        body = comparable(body) if which not in first or count % EVERY == 0 else None
        if status != wanted or (body is not None and first.setdefault(which, body) != body):
            with wrong.get_lock():
                wrong.value += 1
            print(f"client {seed}, request {count}, kind {which}: {status}, wanted {wanted}", file=sys.stderr)
        with asked.get_lock():
            asked.value += 1
        if rng.random() < 0.001:  # now and then somebody comes anew, or goes in the middle
            if rng.random() < 0.5:
                connection.socket.sendall(data[:len(data) // 2])
            connection.socket.close()
            connection = Connection(port)


def memory(process):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status).group(1))


def main():
    total = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    clients = int(sys.argv[2]) if len(sys.argv) > 2 else 4
    with tempfile.TemporaryDirectory() as folder:
        for name, channels in (("grey", 1), ("colour", 3)):
            Scene(N, channels).write(pathlib.Path(folder) / f"{name}.h5", name)
        with Daemon("--stores", folder, "--threads", os.cpu_count() or 1) as daemon:
            asked, wrong = multiprocessing.Value("q", 0), multiprocessing.Value("q", 0)
            workers = [multiprocessing.Process(target=client, args=(daemon.port, total // clients, k, asked, wrong))
                       for k in range(clients)]
            for w in workers:
                w.start()
            early, late, reloads = 0, 0, 0
            while any(w.is_alive() for w in workers):
                time.sleep(0.5)
                daemon.signal(signal.SIGHUP)
                reloads += 1
                if asked.value <= total // 10:
                    early = max(early, memory(daemon.process))
                elif total * 9 // 10 <= asked.value < total:
                    late = max(late, memory(daemon.process))
            failed = sum(w.exitcode != 0 for w in workers)
            print(f"{asked.value} requests, {reloads} reloads, {wrong.value} wrong, {failed} clients failed; "
                  f"memory at most {early} kB in the first tenth, {late} kB in the last")
            seen = early > 0 and late > 0
            return 1 if wrong.value or failed or not seen or late > 1.02 * early else 0


if __name__ == "__main__":
    sys.exit(main())
