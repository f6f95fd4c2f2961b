"""Raw mutated requests to one daemon, by several clients: every byte that a client may send, in any order. On request only.

usage: raw.py [REQUESTS (1000000)] [SEED (1)]        with LAMBERTD= its path, best of a build with sanitizers
Ends with 0 when the daemon lived through all of it, said nothing on standard error (no sanitizer's report), answered a good
request as at the start, wrote nothing but JSON into its access log, and ended with 0.
"""

import collections
import json
import multiprocessing
import os
import pathlib
import random
import socket
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
import numpy as np  # noqa: E402

from daemon import Daemon, npy  # noqa: E402
from make_store import Scene  # noqa: E402

N = 60
TOKEN = "a-token-of-a-fuzzer"
FIELDS = [b"Content-Length: 5", b"Content-Length: 99999999999999999999", b"Content-Length: -1", b"Transfer-Encoding: chunked",
          b"Transfer-Encoding: gzip, chunked", b"Host: localhost", b"Host:", b"Origin: http://evil.example", b"Expect: 100-continue",
          b"Connection: close", b"Connection: keep-alive, upgrade", b"Accept: */*;q=x", b"Accept: application/x-npy;dtype=f2",
          b"Accept-Encoding: zstd, gzip;q=0", b"Content-Encoding: gzip", b"Range: bytes=0-1", b"If-None-Match: *", b"Lambert-Timeout: 1e9",
          b"Lambert-Timeout: -1", b"Forwarded: for=[::1", b"X-Forwarded-For: 1.2.3.4, 5", b"X-Request-Id: \x7f\xff", b" folded: 1",
          b"Sec-Fetch-Site: cross-site", b"Authorization: Bearer ", b"Content-Type: application/json; charset=x", b"\x00: \x00"]
WORDS = [b"NaN", b"1e999", b"-1", b"null", b"{}", b"[]", b"\"", b"\\u0000", b"\xff\xfe", b"18446744073709551616", b"\r\n", b"\r", b"\n", b"%00",
         b"..%2f", b"@", b"?", b"#", b"0\r\n\r\n", b"ffffffffffffffff\r\n", b"\x93NUMPY", b"HTTP/1.0", b"HTTP/9.9", b"http://h/", b"OPTIONS", b"TRACE"]


def head(line, body=b"", more=()):
    lines = [line.encode() + b" HTTP/1.1", b"Host: localhost", b"Authorization: Bearer " + TOKEN.encode(), *more]
    if body:
        lines += [b"Content-Length: %d" % len(body)]
    return b"\r\n".join(lines) + b"\r\n\r\n" + body


def chunked(line, body, kind):
    pieces = b"".join(b"%x\r\n%s\r\n" % (len(body[k:k + 40]), body[k:k + 40]) for k in range(0, len(body), 40))
    return head(line, b"", [b"Content-Type: " + kind, b"Transfer-Encoding: chunked"]) + pieces + b"0\r\n\r\n"


def seeds():
    """Good requests of every route, to be mutated."""
    rng, json_type, npy_type = np.random.default_rng(1), b"application/json", b"application/x-npy"
    dense = [round(float(x), 3) for x in rng.random(N)]
    bodies = [{"emission": dense}, {"emission": {"groups": {"lamp": 1}}, "reduce": {"groups": ["floor"], "with": ["mean", "max"]}},
              {"emissions": [{"elements": [1, 2], "values": [3, 4]}] * 3, "quantity": "irradiance", "select": {"elements": [0, 5]}},
              {"emission": {"groups": {"lamp": 1}}, "tolerance": 1e-4}, {"emission": dense, "sky": [1.0] * 4}]
    out = [head(f"GET {path}") for path in ("/healthz", "/readyz", "/metrics", "/v1/scenes", "/v1/scenes/box", "/v1/openapi.json", "/")]
    for body in bodies:
        text = json.dumps(body).encode()
        out.append(head("POST /v1/scenes/box/radiosity", text, [b"Content-Type: " + json_type]))
        out.append(chunked("POST /v1/scenes/box/radiosity", text, json_type))
    out.append(head("POST /v1/scenes/box/radiosity", npy(np.asarray(dense, "<f4")), [b"Content-Type: " + npy_type, b"Accept: " + npy_type]))
    out.append(head("POST /v1/scenes/box/adjoint", json.dumps({"cotangent": dense, "emission": dense,
                                                              "gradient": ["emission", "reflectance"]}).encode(),
                    [b"Content-Type: " + json_type]))
    out.append(head("PUT /v1/scenes/box/reflectance", b'{"variant":"a","groups":{"floor":0.5}}', [b"Content-Type: " + json_type]))
    out += [head("DELETE /v1/scenes/box@a"), head("HEAD /v1/scenes"), head("OPTIONS *")]
    return out


def mutate(data, rng):
    """One to six changes, of bytes, lines and words."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        kind, at = rng.randrange(9), rng.randrange(len(data) + 1)
        if kind == 0 and data:
            data[at % len(data)] ^= 1 << rng.randrange(8)
        elif kind == 1 and data:
            data[at % len(data)] = rng.choice(b"\0\r\n :;,{}[]\"\\/%\x7f\xff09aZ")
        elif kind == 2:
            data[at:at] = rng.choice(WORDS)
        elif kind == 3:
            del data[at:at + rng.choice((1, 2, 8, 64))]
        elif kind == 4:
            del data[at:]
        elif kind == 5:
            data[at:at] = data[at:at + rng.choice((1, 4, 16, 200))]
        elif kind == 6:
            data[at:at] = bytes([rng.randrange(256)]) * rng.choice((1, 100, 5000))
        else:
            lines = bytes(data).split(b"\r\n")
            lines.insert(rng.randrange(len(lines)), rng.choice(FIELDS))
            data = bytearray(b"\r\n".join(lines))
    return bytes(data)


def ask(port, data, rng):
    """Sends it whole, in pieces or with an end, and reads what comes for a moment; the statuses."""
    with socket.create_connection(("127.0.0.1", port), timeout=60) as s:
        mood = rng.random()
        try:
            if mood < .1:
                cut = rng.randrange(len(data) + 1)
                s.sendall(data[:cut])
                time.sleep(.001)
                s.sendall(data[cut:])
            else:
                s.sendall(data)
            if mood < .95:
                s.shutdown(socket.SHUT_WR)
            s.settimeout(.1)  # a half request is answered by silence
            got = b""
            while piece := s.recv(1 << 16):
                got = (got + piece)[:1 << 20]
                if mood >= .95:
                    break
            return [line[9:12].decode("ascii", "replace") for line in got.split(b"\r\n") if line.startswith(b"HTTP/1.")]
        except socket.timeout:
            return ["silent"]
        except OSError:
            return ["closed"]


def client(port, count, seed, statuses):
    rng, good = random.Random(seed), seeds()
    seen = collections.Counter()
    for _ in range(count):
        data = b"".join(mutate(rng.choice(good), rng) if rng.random() < .9 else rng.choice(good)
                        for _ in range(rng.choice((1, 1, 1, 2, 4))))
        if data:
            data += b"" if rng.random() < .2 else head("GET /healthz", more=[b"Connection: close"])
            seen.update(ask(port, data, rng) or ["nothing"])
    statuses.put(seen)


def main():
    total = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    clients = 8 * (os.cpu_count() or 2)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        Scene(N, 3).write(folder / "box.h5", "box", sky=4)
        (folder / "token").write_text(TOKEN + "\n")
        (folder / "token").chmod(0o600)
        log = folder / "access"
        with Daemon("--stores", folder, "--token-file", folder / "token", "--max-variants", 3, "--max-body", "64K", "--max-batch", 8,
                    "--timeout", 1, "--max-connections", 64, "--access-log", log) as daemon:
            check = lambda: daemon.get("/v1/scenes/box", headers={"Authorization": f"Bearer {TOKEN}"}).body  # noqa: E731
            before, statuses = check(), multiprocessing.Queue()
            workers = [multiprocessing.Process(target=client, args=(daemon.port, total // clients, f"{first} {k}", statuses))
                       for k in range(clients)]
            for w in workers:
                w.start()
            seen = sum((statuses.get() for _ in workers), collections.Counter())
            for w in workers:
                w.join()
            same, said = check() == before, daemon.errors()
            daemon.stop()
            lines = log.read_bytes().splitlines()
            odd = sum(not is_json(line) for line in lines)
        print(f"{total} sent, answered {dict(seen.most_common())}; {len(lines)} lines of log, {odd} of them no JSON; a good request "
              f"is answered {'as before' if same else 'otherwise'}")
        if said:
            print(said[-4000:], file=sys.stderr)
        return int(not same or odd > 0 or bool(said))


def is_json(line):
    try:
        json.loads(line)
        return True
    except ValueError:
        return False


if __name__ == "__main__":
    sys.exit(main())
