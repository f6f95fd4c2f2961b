"""Measures how soon lambertd answers from a large store, and the memory of two daemons on one store.

    LAMBERTD=… /usr/bin/python3 tests/bench/start.py STORE.h5 [ROUNDS]

Each round starts a daemon, and asks as soon as its port is known for three elements under light of four; then all
elements under light of all, twice, for what the pages cost that nobody touched before. The store should be in the
page cache (run it twice), or not at all, which is another question. bench_store makes a large one.
"""

import json
import pathlib
import re
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "service"))
from daemon import Daemon  # noqa: E402

SPARSE = {"emission": {"elements": [1, 2, 3, 100], "values": [1, 2, 3, 4]}, "select": {"elements": [5, 6, 7]}}


def figures(daemon, path):
    found, inside = {}, False
    for line in pathlib.Path(f"/proc/{daemon.process.pid}/smaps").read_text().splitlines():
        if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
            inside = line.endswith(str(path))
        elif (figure := re.match(r"(\w+): +(\d+) kB", line)):
            name = figure[1] + ("" if inside else " elsewhere")
            found[name] = found.get(name, 0) + int(figure[2]) / 1e6
    return found


def asked(daemon, body):
    begin = time.monotonic()
    answer = daemon.radiosity("big", body)
    assert answer.status == 200, answer
    return time.monotonic() - begin, answer.json()


def main():
    path, rounds = pathlib.Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    print(f"{path.stat().st_size / 1e9:.2f} GB")
    times = {"first answer": [], "verified": [], "dense, first": [], "dense, again": []}
    for _ in range(rounds):
        begin = time.monotonic()
        with Daemon(path) as daemon:
            asked(daemon, SPARSE)
            times["first answer"].append(time.monotonic() - begin)
            n = daemon.get("/v1/scenes/big").json()["elements"]
            dense = json.dumps({"emission": [1] * n, "select": {"elements": [0]}})
            times["dense, first"].append(asked(daemon, dense)[1]["time_ms"]["solve"] / 1e3)
            daemon.wait_for("verified big: ")
            times["verified"].append(time.monotonic() - begin)
            times["dense, again"].append(asked(daemon, dense)[1]["time_ms"]["solve"] / 1e3)
    for name, values in times.items():
        print(f"{name:14} median {statistics.median(values):.3f} s, most {max(values):.3f} s")
    with Daemon(path) as one:
        one.wait_for("verified big: ")
        for number, other in (("one daemon", None), ("each of two", Daemon(path))):
            if other is not None:
                other.wait_for("verified big: ")
            seen = figures(one, path)
            print(f"{number:14} " + ", ".join(f"{name} {seen.get(name, 0):.2f} GB" for name in (
                "Rss", "Pss", "Shared_Clean", "Private_Clean", "Anonymous elsewhere")))
            if other is not None:
                other.stop()
                other.kill()


main()
