"""Everything at once, for hours, against one daemon: solves, adjoints, reductions, refinements, variants, bad bodies, slow
readers, clients that close half or all of a connection, reloads, stores that are cut and mended, an access log on a full disk.
On request only.

usage: mixed.py [SECONDS (7200)] [untimed]        with LAMBERT= and LAMBERTD= their paths; untimed: on a machine that others
use, or with sanitizers, deadlines and the end are printed and not judged
Ends with 0 when no answer was wrong (compared bit for bit with the first to the same request), none had a status that its
request cannot get, memory stayed within --max-memory, --max-request-memory and 64 MiB in every second, no request took longer
than --request-timeout and .1 s by the daemon's own log, and SIGTERM under full load ended it with 0 within --shutdown-timeout.
"""

import collections
import json
import multiprocessing
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
import numpy as np  # noqa: E402

from daemon import Daemon, npy  # noqa: E402

LAMBERT = os.environ["LAMBERT"]
MIB = 1 << 20
TOKEN = "soak-token-of-24-letters"
REQUEST_TIMEOUT, SHUTDOWN_TIMEOUT, MAX_MEMORY, MAX_REQUEST_MEMORY = 20, 5, 400 * MIB, 200 * MIB
SLACK = 64 * MIB
EVERY = 50  # an answer of so many is compared with the first one
BUSY = {429, 503}  # any request may get these from a daemon that has too much to do


def head(method, path, body, more):
    lines = [f"{method} {path} HTTP/1.1", "Host: localhost", f"Authorization: Bearer {TOKEN}", *more]
    if body or method != "GET":
        lines.append(f"Content-Length: {len(body)}")
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + body


def post(path, body, accept="application/json"):
    kind = "application/x-npy" if isinstance(body, bytes) else "application/json"
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    return head("POST", path, data, [f"Content-Type: {kind}", f"Accept: {accept}"])


class Connection:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=REQUEST_TIMEOUT + 60)
        self.left = b""

    def more(self):
        got = self.socket.recv(MIB)
        if not got:
            raise ConnectionError("closed")
        self.left += got

    def line(self):
        while b"\r\n" not in self.left:
            self.more()
        line, _, self.left = self.left.partition(b"\r\n")
        return line

    def exactly(self, length):
        while len(self.left) < length:
            self.more()
        body, self.left = self.left[:length], self.left[length:]
        return body

    def answer(self):
        """Status and body, of a length or in chunks."""
        status, fields = int(self.line().split()[1]), {}
        while line := self.line():
            name, _, value = line.partition(b":")
            fields[name.lower()] = value.strip()
        if fields.get(b"transfer-encoding") == b"chunked":
            body = b""
            while size := int(self.line().split(b";")[0], 16):
                body += self.exactly(size)
                self.line()
            self.line()
        elif b"content-length" in fields:
            body = self.exactly(int(fields[b"content-length"]))
        else:
            body = b""
        return status, body, fields.get(b"connection", b"").lower() == b"close"


def comparable(body):
    """Without what may differ from one answer to the next: the times, and how an iteration started."""
    return re.sub(rb'"time_ms":\{[^}]*\}', b"", body)


class Scenes:
    """The stores of a soak, all of small scenes, and requests to them."""

    def __init__(self, folder):
        self.folder = folder
        methods = {"kept": ["--probes", "16", "--keep-form-factors"],
                   "paint": ["--probes", "0", "--method", "low-rank", "--rank", "64", "--keep-factors"],
                   "rotten": ["--probes", "0", "--method", "low-rank", "--rank", "256"]}
        for name, options in methods.items():  # a scene is served by the name of its file
            self.run("generate", "cornell", "--elements", "2560", "-o", folder / f"{name}.obj")
            self.run("precompute", folder / f"{name}.obj", "-o", folder / f"{name}.h5", "--mesh", "faces", *options)
        facts = json.loads(self.run("info", folder / "kept.h5", "--json"))
        self.n, self.channels = facts["elements"], facts["channels"]
        self.group = facts["groups"][0]["name"]

    @staticmethod
    def run(*arguments):
        return subprocess.run([LAMBERT, *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    def requests(self):
        """By name of an actor: (bytes, statuses that it may get beside BUSY)."""
        n, rng = self.n, np.random.default_rng(3)
        dense = [float(x) for x in np.float32(rng.random(n))]
        array = npy(np.asarray(rng.random((self.channels, n)), "<f4"))
        solve, group = "/v1/scenes/%s/radiosity", {"groups": {self.group: 1}}
        good, both = {200}, {200, 404}
        solves = []
        for name, wanted in (("kept", good), ("paint", good), ("rotten", both)):
            at = solve % name
            solves += [(post(at, {"emission": dense}), wanted), (post(at, {"emission": group}), wanted),
                       (post(at, array, "application/x-npy"), wanted),
                       (post(at, {"emissions": [group] * 4, "quantity": "indirect"}), wanted),
                       (post(at, {"emission": group, "select": {"groups": [self.group]}}), wanted)]
        reductions = [(post(solve % name, {"emissions": [group] * 8, "reduce": {"groups": [self.group], "with": figures}}), good)
                      for name in ("kept", "paint") for figures in (["mean", "sum"], ["min", "max", "uniformity"])]
        return {"solve": solves,
                "adjoint": [(post("/v1/scenes/kept/adjoint", {"cotangent": dense}), good),
                            (post("/v1/scenes/paint/adjoint", {"cotangent": dense, "emission": group,
                                                               "gradient": ["emission", "reflectance"]}), good)],
                "reduce": reductions,
                "refine": [(post(solve % "kept", {"emissions": [group] * 3, "tolerance": 1e-5}), good)],
                "bad": [(post(solve % "kept", {"emission": [1.0] * 600000}), {422}),
                        (post(solve % "kept", {"emission": {"groups": {"moon": 1}}}), {422}),
                        (head("POST", solve % "paint", b'{"emission":[1,', ["Content-Type: application/json"]), {400}),
                        (head("GET", "/v1/scenes/none", b"", []), {404}),
                        (head("POST", "/healthz", b"", ["Content-Length: 5"]), {400, 405})],
                "large": [(post(solve % "kept", {"emissions": [group] * 128}), good)],
                "look": [(head("GET", path, b"", []), good) for path in ("/healthz", "/metrics", "/v1/scenes")]}


class Tally:
    """The counts of all processes together."""

    NAMES = ("asked", "compared", "busy", "wrong", "lost")

    def __init__(self):
        self.counts = {name: multiprocessing.Value("q", 0) for name in self.NAMES}

    def add(self, name):
        with self.counts[name].get_lock():
            self.counts[name].value += 1

    def wrong(self, words):
        self.add("wrong")
        print(words, file=sys.stderr, flush=True)

    def __str__(self):
        return ", ".join(f"{c.value} {name}" for name, c in self.counts.items())


def actor(port, name, requests, seed, tally, over):
    """Asks until it is over; sometimes it comes anew, closes one half, or goes in the middle."""
    rng, first, connection = random.Random(f"{name} {seed}"), {}, None
    count = 0
    while not over.is_set():
        which = rng.randrange(len(requests))
        data, wanted = requests[which]
        count += 1
        try:
            connection = connection or Connection(port)
            mood = rng.random()
            if mood < .01:
                connection.socket.sendall(data[:rng.randrange(1, len(data))])
                connection.socket.close()
                connection = None
                continue
            connection.socket.sendall(data)
            if mood < .02:
                connection.socket.shutdown(socket.SHUT_WR)
            elif mood < .04:
                time.sleep(rng.uniform(0, .05))
                connection.socket.close()
                connection = None
                continue
            elif name == "large":
                time.sleep(rng.uniform(0, 5))
            status, body, last = connection.answer()
            if last or mood < .02:
                connection = None
        except (OSError, ConnectionError) as what:
            connection = None
            if not over.is_set() and mood >= .02:
                # A daemon under this load may close a connection whose request's time is over.
                tally.add("lost")
            if isinstance(what, ConnectionRefusedError):
                time.sleep(.1)
            continue
        tally.add("asked")
        if status in BUSY:
            tally.add("busy")
            time.sleep(.05)
        elif status not in wanted:
            tally.wrong(f"{name} {which}: {status} {body[:200]!r}")
        elif status == 200 and name != "look" and (which not in first or count % EVERY == 0):
            tally.add("compared")
            body = comparable(body)
            if first.setdefault(which, body) != body:
                tally.wrong(f"{name} {which}: another answer than the first one")


def painter(port, group, tally, over):
    """Makes, replaces and removes variants."""
    rng, path = random.Random(7), "/v1/scenes/paint/reflectance"
    while not over.is_set():
        try:
            connection = Connection(port)
            body = json.dumps({"variant": f"v{rng.randrange(6)}", "groups": {group: rng.choice([.1, .5, .9])}}).encode()
            requests = [(head("PUT", path, body, ["Content-Type: application/json"]), {202, 409}),
                        (head("DELETE", f"/v1/scenes/paint@v{rng.randrange(6)}/reflectance", b"", []), {204, 404, 405, 409}),
                        (head("DELETE", f"/v1/scenes/paint@v{rng.randrange(6)}", b"", []), {204, 404, 409}),
                        (post(f"/v1/scenes/paint@v{rng.randrange(6)}/radiosity", {"emission": {"groups": {group: 1}}}), {200, 404})]
            data, wanted = rng.choice(requests)
            connection.socket.sendall(data)
            status, said, _ = connection.answer()
            connection.socket.close()
            tally.add("asked")
            if status in BUSY:
                tally.add("busy")
            elif status not in wanted:
                tally.wrong(f"painter: {status} {said[:200]!r}")
        except (OSError, ConnectionError):
            tally.add("lost")
        over.wait(rng.uniform(.05, .5))


class Weather(threading.Thread):
    """Bad weather for files: a store is cut, scribbled on and mended; the log's disk is full and then not; reloads."""

    def __init__(self, daemon, folder, log, over):
        super().__init__(daemon=True)
        self.daemon_of, self.over = daemon, over
        self.store, self.sound = folder / "rotten.h5", folder / "sound"
        self.log, self.logs = log, [log.with_suffix(".lines"), pathlib.Path("/dev/full")]
        self.reloads = self.cuts = 0
        self.rng = random.Random(11)

    def point_log(self, at):
        new = self.log.with_suffix(".new")
        new.symlink_to(self.logs[at])
        new.rename(self.log)

    def run(self):
        size = self.sound.stat().st_size
        while not self.over.wait(self.rng.uniform(.3, 3)):
            chance = self.rng.random()
            if chance < .15:
                os.truncate(self.store, self.rng.randrange(size))
                self.cuts += 1
            elif chance < .3:
                with open(self.store, "r+b") as f:
                    f.seek(self.rng.randrange(size))
                    f.write(self.rng.randbytes(4096))
                self.cuts += 1
            elif chance < .6:
                # In place of the old one, by renaming, as the manual says.
                shutil.copy(self.sound, self.store.with_suffix(".new"))
                self.store.with_suffix(".new").rename(self.store)
            elif chance < .7:
                self.point_log(self.rng.random() < .5)
            self.daemon_of.signal(signal.SIGHUP)
            self.reloads += 1


def memory(process):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) << 10


def slowest(log):
    """By the log: the longest time of a request, ms, and the lines."""
    longest, lines, by_status = 0.0, 0, collections.Counter()
    with log.open(errors="replace") as text:
        for line in text:
            try:
                entry = json.loads(line)
            except ValueError:
                continue  # the disk was full in the middle of it
            longest, lines = max(longest, entry["ms"]), lines + 1
            by_status[entry["status"]] += 1
    return longest, lines, by_status


def soak(daemon, scenes, log, seconds, timed):
    requests, tally, over = scenes.requests(), Tally(), multiprocessing.Event()
    actors = [("solve", 4), ("adjoint", 4), ("reduce", 2), ("refine", 3), ("bad", 4), ("large", 3), ("look", 1)]
    workers = [multiprocessing.Process(target=actor, args=(daemon.port, name, requests[name], k, tally, over))
               for name, count in actors for k in range(count)]
    workers.append(multiprocessing.Process(target=painter, args=(daemon.port, scenes.group, tally, over)))
    for w in workers:
        w.start()
    weather = Weather(daemon, scenes.folder, log, over)
    weather.start()
    most, start, said = 0, time.monotonic(), 0
    while (gone := time.monotonic() - start) < seconds and daemon.process.poll() is None:
        most = max(most, memory(daemon.process))
        if gone - said >= 60:
            said = gone
            print(f"{gone:.0f} s: {tally}, {most >> 20} MiB at most", flush=True)
        time.sleep(1)
    alive = daemon.process.poll() is None
    begun = time.monotonic()
    daemon.signal(signal.SIGTERM)
    code = daemon.process.wait(SHUTDOWN_TIMEOUT + 60)
    ended = time.monotonic() - begun
    over.set()
    for w in workers:
        w.join(REQUEST_TIMEOUT + 90)
        w.kill()
    weather.join(10)
    longest, lines, by_status = slowest(weather.logs[0])
    print(f"{tally}; {weather.reloads} reloads, {weather.cuts} cuts; at most {most >> 20} MiB; the slowest of {lines} logged "
          f"{longest:.0f} ms, by status {dict(by_status)}; SIGTERM: code {code} after {ended:.2f} s")
    faults = {"it ended before": not alive, "wrong answers": tally.counts["wrong"].value > 0,
              "memory": most > MAX_MEMORY + MAX_REQUEST_MEMORY + SLACK,
              "deadline": timed and longest > 1000 * REQUEST_TIMEOUT + 100, "exit": code != 0,
              "late exit": timed and ended > SHUTDOWN_TIMEOUT + .5,
              "nothing was compared": tally.counts["compared"].value == 0}
    print("; ".join(f"FAULT: {name}" for name, is_so in faults.items() if is_so) or "no fault")
    if code != 0:
        print(daemon.errors()[-4000:], file=sys.stderr)
    return any(faults.values())


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 7200
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scenes = Scenes(folder)
        shutil.copy(folder / "rotten.h5", folder / "sound")
        (folder / "token").write_text(TOKEN + "\n")
        log = folder / "access"
        log.symlink_to(log.with_suffix(".lines"))
        with Daemon("--stores", folder, "--request-timeout", REQUEST_TIMEOUT, "--shutdown-timeout", SHUTDOWN_TIMEOUT,
                    "--max-memory", MAX_MEMORY, "--max-request-memory", MAX_REQUEST_MEMORY, "--max-variants", 8,
                    "--token-file", folder / "token", "--access-log", log) as daemon:
            return int(soak(daemon, scenes, log, seconds, "untimed" not in sys.argv[2:]))


if __name__ == "__main__":
    sys.exit(main())
