"""A short solve beside greedy clients: its latency alone, beside clients that send bad bodies, that ask for adjoints, and that
refine, and beside 32 clients of each route of routes.c, by GET, HEAD and with the tag of what they have (304), plain and by gzip, in
one run against one daemon. The short solve comes from another address than all of them. On request only; needs wrk.
deploy/docs/performance-service.md has its figures.

usage: beside.py [SECONDS each (10)] [ELEMENTS (100000)]        with LAMBERT= and LAMBERTD= their paths
Ends with 0 when the 99th percentile beside each of them is at most 20 times the median alone, beside clients of what is kept the
median at most 5 times, and the answers were 200 (of the greedy ones 200, 304, 422, 429 or 503, or 404 where there is no viewer).
"""

import http.client
import json
import multiprocessing
import os
import pathlib
import re
import selectors
import shutil
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
from daemon import Daemon  # noqa: E402

LAMBERT = os.environ["LAMBERT"]
MOST = 20  # of the time alone
MOST_KEPT = 5  # the median beside answers that are kept
ROUTES = pathlib.Path(__file__).resolve().parents[2] / "server" / "route" / "routes.c"
UNIT = {"us": 1e-3, "ms": 1, "s": 1e3, "m": 6e4}
LOAD = """
%s
local threads = {}
function setup(thread) table.insert(threads, thread) end
answers = {}
function response(status) answers[status] = (answers[status] or 0) + 1 end
function done(summary, latency)
  for _, thread in ipairs(threads) do
    for status, n in pairs(thread:get("answers")) do io.write("status ", status, " ", n, "\\n") end
  end
end
"""


def milliseconds(text):
    number, unit = re.fullmatch(r"([0-9.]+)([a-z]+)", text).groups()
    return float(number) * UNIT[unit]


class Clients:
    """wrk with one thread and some connections, each with one request at a time."""

    def __init__(self, folder, name, url, connections, seconds, body=None, method="POST", headers=()):
        script = folder / f"{name}.lua"
        lines = [f'wrk.method = "{method}"', *(f"wrk.headers[ [==[{key}]==] ] = [==[{value}]==]" for key, value in headers)]
        if body is not None:
            lines += [f"wrk.body = [==[{json.dumps(body)}]==]", 'wrk.headers["Content-Type"] = "application/json"']
        script.write_text(LOAD % "\n".join(lines))
        self.run = subprocess.Popen([shutil.which("wrk"), "-t1", f"-c{connections}", f"-d{seconds}s", "--timeout", "60s", "--latency",
                                     "-s", script, url], stdout=subprocess.PIPE, text=True)

    def finish(self):
        said = self.run.communicate()[0]
        at = {int(share): milliseconds(time) for share, time in re.findall(r"^ +(50|99)% +([0-9.]+[a-z]+)$", said, re.M)}
        return at, {int(status): int(n) for status, n in re.findall(r"status (\d+) (\d+)", said)}


def flood(port, line, seconds, statuses):
    """32 connections that ask for answers without bodies, sixteen at once each: wrk would wait for a body."""
    end, n, left, counts = time.monotonic() + seconds, 16, {}, {}
    with selectors.DefaultSelector() as ready:
        for _ in range(32):
            s = socket.create_connection(("127.0.0.1", port), 60)
            s.sendall(line * n)
            left[s] = n
            ready.register(s, selectors.EVENT_READ)
        while time.monotonic() < end:
            for key, _ in ready.select(.1):
                got = key.fileobj.recv(1 << 16)
                for status in re.findall(rb"HTTP/1.1 (\d+)", got):
                    counts[int(status)] = counts.get(int(status), 0) + 1
                left[key.fileobj] -= got.count(b"\r\n\r\n")
                if left[key.fileobj] <= 0:
                    key.fileobj.sendall(line * n)
                    left[key.fileobj] += n
        for s in left:
            s.close()
    statuses.update(counts)


class Flood:
    def __init__(self, port, path, seconds, method, headers):
        head = [f"{method} {path} HTTP/1.1", "Host: localhost", *(f"{key}: {value}" for key, value in headers), "", ""]
        self.statuses = multiprocessing.Manager().dict()
        self.run = multiprocessing.Process(target=flood, args=(port, "\r\n".join(head).encode(), seconds, self.statuses))
        self.run.start()

    def finish(self):
        self.run.join()
        return None, dict(self.statuses)


def ask(daemon, solve, seconds):
    """The 50th and the 99th percentile, ms, of short solves of a client of another address, one after the other, and statuses."""
    body, took, statuses = json.dumps(solve), [], {}
    connection = http.client.HTTPConnection("127.0.0.1", daemon.port, 60, source_address=("127.0.0.9", 0))
    end = time.monotonic() + seconds
    while (start := time.monotonic()) < end:
        connection.request("POST", "/v1/scenes/room/radiosity", body, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        answer.read()
        took.append(1e3 * (time.monotonic() - start))
        statuses[answer.status] = statuses.get(answer.status, 0) + 1
    connection.close()
    took.sort()
    return {share: took[len(took) * share // 100] for share in (50, 99)}, statuses


def measure(daemon, folder, seconds, elements):
    """Prints a line for each kind of company; true where a limit is not kept."""
    failed, alone = False, None
    base = f"http://127.0.0.1:{daemon.port}/v1/scenes/room"
    groups = [group["name"] for group in daemon.get("/v1/scenes/room").json()["groups"]]
    light = {"groups": {groups[0]: 1}}
    solve = {"emission": light, "reduce": {"groups": groups[-1:], "with": ["max"]}}
    greedy = {"alone": (0, None, None),
              **{f"24 with {5 * k // 1000} kB of bad body": (24, "radiosity", {"emission": [.5] * k})
                 for k in (1000, 10000, 40000, 101000, 200000, 400000) if k != elements},
              "32 clients for adjoints": (32, "adjoint", {"cotangent": light, "gradient": ["groups"]}),
              "16 clients that refine": (16, "radiosity", {**solve, "tolerance": 1e-6})}
    print(f"{'beside':40} {'p50 ms':>8} {'p99 ms':>8} {'p99 / alone':>12}  statuses of the others")
    for beside, (connections, route, body) in greedy.items():
        others = Clients(folder, "others", f"{base}/{route}", connections, seconds + 2, body) if connections else None
        at, statuses = ask(daemon, solve, seconds)
        of_others = others.finish()[1] if others else {}
        alone = alone or at[50]
        ratio = at[99] / alone
        failed |= ratio > MOST or set(statuses) != {200} or not set(of_others) <= {200, 422, 429, 503}
        print(f"{beside:40} {at[50]:8.2f} {at[99]:8.2f} {ratio:12.1f}  {of_others or ''}", flush=True)
    return measure_kept(daemon, folder, seconds, solve, alone) or failed


def kept_requests(daemon):
    """(words, path, method, headers) of every route of GET."""
    for path in sorted(set(re.findall(r'\.method = "GET",\s+\.pattern = "([^"]+)"', ROUTES.read_text()))):
        own = path.replace("{name}", "room")
        for coding in "identity", "gzip":
            accept = {"Accept-Encoding": coding}
            tag = daemon.ask("HEAD", own, headers=accept).headers["ETag"]
            yield f"GET {own} {coding}", own, "GET", accept
            yield f"HEAD {own} {coding}", own, "HEAD", accept
            if tag:
                yield f"304 {own} {coding}", own, "GET", {**accept, "If-None-Match": tag}


def measure_kept(daemon, folder, seconds, solve, alone):
    failed = False
    for words, path, method, headers in kept_requests(daemon):
        if words.startswith("GET"):
            others = Clients(folder, "others", f"http://127.0.0.1:{daemon.port}{path}", 32, seconds + 2, None, method, headers.items())
        else:
            others = Flood(daemon.port, path, seconds + 2, method, headers.items())
        at, statuses = ask(daemon, solve, seconds)
        of_others, ratio = others.finish()[1], at[50] / alone
        failed |= ratio > MOST_KEPT or set(statuses) != {200} or not set(of_others) <= {200, 304, 404}
        print(f"{words:40} {at[50]:8.2f} {at[99]:8.2f} {ratio:6.1f} (p50)  {of_others or ''}", flush=True)
    return failed


def main():
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    elements = int(sys.argv[2]) if len(sys.argv) > 2 else 100000
    if shutil.which("wrk") is None:
        sys.exit("beside.py: wrk is not there; apt-get install wrk")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scene, store = folder / "room.obj", folder / "room.h5"
        for command in (["generate", "cornell", "--elements", str(elements), "--reflectance", ".5", "-o", scene],
                        ["precompute", scene, "-o", store, "--mesh", "faces", "--quiet", "--probes", "0", "--keep-form-factors"]):
            subprocess.run([LAMBERT, *map(str, command)], check=True, stdout=subprocess.DEVNULL)
        # The largest weather file that is served; its sky is that of no scene here.
        (folder / "room.epw").write_bytes(b"LOCATION,Here\n" + b"1999,1,1,1,60,0,4.4\n" * 400000)
        daemon = Daemon(store)
        try:
            failed = measure(daemon, folder, seconds, elements)
        finally:
            daemon.kill()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
