"""A short solve beside greedy clients: its latency alone, beside clients that send bad bodies, that ask for adjoints, and that
refine, in one run against one daemon. On request only; needs wrk. deploy/docs/performance-service.md has its figures.

usage: beside.py [SECONDS each (10)] [ELEMENTS (100000)]        with LAMBERT= and LAMBERTD= their paths
Ends with 0 when the 99th percentile beside each of them is at most 20 times the median alone, and the answers were 200 (of the
greedy ones 200, 422, 429 or 503).
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
from daemon import Daemon  # noqa: E402

LAMBERT = os.environ["LAMBERT"]
MOST = 20  # of the time alone
UNIT = {"us": 1e-3, "ms": 1, "s": 1e3, "m": 6e4}
LOAD = """
wrk.method, wrk.body = "POST", %s
wrk.headers["Content-Type"] = "application/json"
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

    def __init__(self, folder, name, url, connections, seconds, body):
        script = folder / f"{name}.lua"
        script.write_text(LOAD % f"[==[{json.dumps(body)}]==]")
        self.run = subprocess.Popen([shutil.which("wrk"), "-t1", f"-c{connections}", f"-d{seconds}s", "--timeout", "60s", "--latency",
                                     "-s", script, url], stdout=subprocess.PIPE, text=True)

    def finish(self):
        said = self.run.communicate()[0]
        at = {int(share): milliseconds(time) for share, time in re.findall(r"^ +(50|99)% +([0-9.]+[a-z]+)$", said, re.M)}
        return at, {int(status): int(n) for status, n in re.findall(r"status (\d+) (\d+)", said)}


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
    print(f"{'beside':28} {'p50 ms':>8} {'p99 ms':>8} {'p99 / alone':>12}  statuses of the others")
    for beside, (connections, route, body) in greedy.items():
        others = Clients(folder, "others", f"{base}/{route}", connections, seconds + 2, body) if connections else None
        at, statuses = Clients(folder, "solve", f"{base}/radiosity", 1, seconds, solve).finish()
        of_others = others.finish()[1] if others else {}
        alone = alone or at[50]
        ratio = at[99] / alone
        failed |= ratio > MOST or set(statuses) != {200} or not set(of_others) <= {200, 422, 429, 503}
        print(f"{beside:28} {at[50]:8.2f} {at[99]:8.2f} {ratio:12.1f}  {of_others or ''}", flush=True)
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
                        ["precompute", scene, "-o", store, "--quiet", "--probes", "0", "--keep-form-factors"]):
            subprocess.run([LAMBERT, *map(str, command)], check=True, stdout=subprocess.DEVNULL)
        daemon = Daemon(store)
        try:
            failed = measure(daemon, folder, seconds, elements)
        finally:
            daemon.kill()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
