#!/usr/bin/python3
"""Suite service of lambert-bench: lambertd under load, beside servers that compute nothing and beside solves in process.

    service.py PROGRAMS SCALE SEED

PROGRAMS is the folder of lambert-bench and lambertd; SCALE is quick, default or full. lambert-bench runs this script
and reads its standard output: one JSON object a line, which is a table, a line of the log, a share of progress or an
error. wrk makes the load, with one thread, because it shares the cores with the server; wrk and nginx take part where
they are installed.
"""

import io
import itertools
import json
import math
import os
import pathlib
import shutil
import socket
import statistics
import sys
import tempfile
import time

import numpy as np

from service_programs import (ANSWER_S, Client, Failure, GET_FILE, NGINX_CONFIGURATION, Program, Solver, WRK_SCRIPT, post,
                              run_suite, tell)

CLIENTS = 1, 4, 16
ONE, MANY = CLIENTS[0], CLIENTS[-1]
FORMATS = {"npy": "application/x-npy", "json": "application/json"}
SLEEPING = {  # servers that sleep as long as a solve takes, and how the table ratios calls their tail
    "sleeping": "likewise of the sleeping server, as many at once as solves are",
    "as many": "likewise of the sleeping server, at lambertd's pace",
    "abreast": "likewise of the sleeping server, all at once",
}
SERVERS = "lambertd", "ready", *SLEEPING, "nginx"
# n, k and seconds of each measurement: the Cornell box and the city of table 4.6 of the thesis, and the largest box
SIZES = {"quick": [(200, 32, 1)],
         "default": [(2560, 416, 1), (24128, 1364, 1), (163840, 4000, 3)],
         "full": [(2560, 416, 5), (24128, 1364, 5), (163840, 4000, 10)]}
PATH = "/v1/scenes/bench/"


class Table:
    def __init__(self, name, title, *columns):
        """columns: (name, unit, explanation); the unit of a column of texts is None."""
        self.table = {"name": name, "title": title, "columns": columns, "rows": []}

    def add(self, *cells):
        assert len(cells) == len(self.table["columns"])
        self.table["rows"].append([None if isinstance(x, float) and not math.isfinite(x) else x for x in cells])

    def write(self):
        tell(table=self.table)


SIZE = ("n", "", "elements"), ("k", "", "columns of the operator")


def make_tables():
    return {table.table["name"]: table for table in (
        Table("solve", "Solves in process", *SIZE, ("gb", "GB", "of operator that a solve reads"),
              ("solves", None, "one after the other, or one vector on each core at once"),
              ("threads", "", "in all"), ("p50_ms", "ms", "median of a solve"),
              ("p99_ms", "ms", "99 % of the solves took less"), ("per_second", "1/s", "solves"),
              ("count", "", "solves measured")),
        Table("load", "Servers under load", *SIZE, ("format", None, "of request and answer, both of n values"),
              ("clients", "", "connections of wrk, each with one request at a time"),
              ("server", None, "lambertd; ready: answers with the same bytes at once; sleeping: after the time of a "
               "solve, as many requests asleep at once as solves run; as many: as many asleep at once as give "
               "lambertd's rate; abreast: all asleep at once; nginx: serves the answer as a file"),
              ("p50_ms", "ms", "half of the answers came within"), ("p99_ms", "ms", "99 % came within"),
              ("per_second", "1/s", "answers"), ("bytes_sent", "B", "body of a request"),
              ("bytes_got", "B", "body of an answer"), ("mb_per_second", "MB/s", "both bodies"),
              ("requests", "", "answered in a run"), ("runs", "", "of which these are medians"),
              ("note", None, "why it was not run, how many requests failed, or that wrk stopped before there were three "
               "answers for each client")),
        Table("loop", "An optimizer's loop on one keep-alive connection", *SIZE,
              ("loop", None, "requests in turns"), ("format", None, "of request and answer"),
              ("per_second", "1/s", "evaluations: answers"), ("p50_ms", "ms", "median of the first request"),
              ("p50_second_ms", "ms", "median of the second"), ("note", None, "why it was not run")),
        Table("codec", "Times that dense JSON answers state", *SIZE,
              ("parse_ms", "ms", "median of 9 answers"), ("solve_ms", "ms", "likewise"), ("encode_ms", "ms", "likewise"),
              ("codec_ms", "ms", "parse and encode, median"), ("codec_best_ms", "ms", "parse and encode, least")),
        Table("ratios", "Cost of the service relative to its solves", *SIZE,
              ("what", None, "medians of rounds in which both sides had their turn"), ("measured", "", "the ratio"),
              ("wanted", None, "the target at this size; empty: none"),
              ("outcome", None, "met, missed, not run, too few answers")))}


class Size:
    """An operator of n x k: solved in process and served by every server, in turns, as the machine's speed drifts."""

    def __init__(self, bench, n, k, seconds):
        self.bench, self.n, self.wanted_k, self.seconds = bench, n, k, seconds
        self.short = .1 if bench.quick else seconds
        self.absent, self.ports, self.running = {}, {}, []
        clients = (ONE, MANY) if bench.quick else CLIENTS
        self.runs = {key: [] for key in itertools.product(FORMATS, clients, SERVERS)}
        self.alone, self.beside = [], []

    def measure(self):
        try:
            if self.make_operator():
                self.start_servers()
                self.measure_rounds()
                self.measure_rest()
                self.add_ratios(*self.measure_loops())
        finally:
            for program in reversed(self.running):
                program.stop()
            (self.bench.folder / "store.h5").unlink(missing_ok=True)  # the next size needs the room

    def start(self, name, *arguments):
        program = Program(name, self.bench.folder, *arguments)
        self.running.append(program)
        return program

    def make_operator(self):
        folder, n = self.bench.folder, self.n
        emission = np.random.default_rng(self.bench.seed).random(n, dtype=np.float32)
        emission.tofile(folder / "emission")
        npy = io.BytesIO()
        np.save(npy, emission)
        dense = ",".join(f"{x:.9g}" for x in emission.tolist())
        self.bodies = {"npy": npy.getvalue(), "json": f'{{"emission":[{dense}]}}'.encode()}
        for name, body in self.bodies.items():
            (folder / name).write_bytes(body)
        self.requests = {name: post(PATH + "radiosity", kind, self.bodies[name]) for name, kind in FORMATS.items()}

        begin = time.monotonic()
        self.solver = Solver(folder, self.bench.programs)
        self.running.append(self.solver)
        k, cores, size = self.solver.ask("make", n, self.wanted_k)
        self.k, self.cores, self.gb = int(k), int(cores), size * 1e-9
        if self.k < self.wanted_k:
            tell(log=f"n = {n}: memory or disk is enough for k = {self.k} only, not for {self.wanted_k}")
        if self.k == 0:
            return False
        tell(log=f"n = {n}, k = {self.k}: operator of {self.gb:.3g} GB made and stored "
                 f"in {time.monotonic() - begin:.1f} s")
        return True

    def add_solve(self, how, found):
        self.bench.tables["solve"].add(self.n, self.k, self.gb, how, found["threads"], 1e3 * found["p50"],
                                       1e3 * found["p99"], found["per_second"], found["count"])

    def time_solves(self):
        """The time of a solve, and how many solves run at once on these cores."""
        best = {}
        for _ in range(3):  # in turns; of each the best turn, as a disturbance only ever makes it slower
            for threads in 1, self.cores:
                found = self.solver.solves("alone", threads, self.short / 3)
                best[threads] = min(best.get(threads, found), found, key=lambda x: x["p50"])
        for threads in 1, self.cores:
            self.add_solve("one after the other", best[threads])
        self.add_solve("one on each core", self.solver.solves("beside", self.cores, self.short))
        one, all_cores = best[1]["p50"], best[self.cores]["p50"]
        return all_cores, max(1, min(self.cores, round(self.cores * all_cores / one)))

    def start_servers(self):
        bench, folder = self.bench, self.bench.folder
        self.solve_s, sleepers = self.time_solves()
        tell(log=f"n = {self.n}: a solve takes {1e3 * self.solve_s:.3g} ms; the sleeping server sleeps so long, "
                 f"{sleepers} requests at once")
        begin = time.monotonic()
        lambertd = bench.programs / "lambertd"
        if not os.access(lambertd, os.X_OK):
            raise Failure(f"{lambertd}: cannot be run; it has to stand beside lambert-bench")
        self.ports["lambertd"] = self.start("lambertd", lambertd, "--listen", "127.0.0.1:0", "--threads", self.cores,
                                            "store.h5:bench").port()
        self.keep_answers()
        tell(log=f"n = {self.n}: lambertd's first answers came {time.monotonic() - begin:.1f} s after its start")
        self.start_ready("ready", 0, 0)
        self.start_nginx()
        self.start_ready("sleeping", self.solve_s, sleepers)
        # lambertd shares passes, and so gives more answers than solves run at once. The delay of the slowest answers
        # depends on the rate, so the second sleeping server has about lambertd's rate.
        rates = [self.load("npy", MANY, server, self.seconds)["per_second"] for server in ("lambertd", "sleeping")
                 if bench.wrk and server not in self.absent]
        as_many = round(sleepers * rates[0] / rates[1]) if len(rates) == 2 and rates[1] > 0 else sleepers
        as_many = max(1, min(as_many, MANY))
        tell(log=f"n = {self.n}: with {as_many} requests asleep at once it gives about as many answers as lambertd")
        self.start_ready("as many", self.solve_s, as_many)
        self.start_ready("abreast", self.solve_s, MANY)

    def keep_answers(self):
        """One answer in each format: what other servers serve, and what must be the bits of the solve in process."""
        client = Client(self.ports["lambertd"])
        self.answer_bytes = {}
        for name, request in self.requests.items():
            body, _ = client.must(request, "lambertd")
            (self.bench.folder / "answers" / name).write_bytes(body)
            self.answer_bytes[name] = len(body)
            if name == "npy":
                values = (self.bench.folder / "radiosity").read_bytes()
                self.same_bits = len(body) > len(values) and bytes(body[-len(values):]) == values
        client.close()

    def start_ready(self, name, sleep, at_once):
        for place in "tests/ready_server", "ready_server":
            program = self.bench.programs / place
            if os.access(program, os.X_OK):
                self.ports[name] = self.start(name, program, math.ceil(1e6 * sleep), at_once, "answers/npy",
                                              "answers/json").port()
                return
        self.absent[name] = "not run: no tests/ready_server beside lambert-bench"

    def start_nginx(self):
        if not self.bench.nginx:
            self.absent["nginx"] = "not run: nginx is not installed"
            return
        for _ in range(3):
            with socket.socket() as free:  # nginx cannot be told to take a free port: one that was free just now
                free.bind(("127.0.0.1", 0))
                port = free.getsockname()[1]
            (self.bench.folder / "nginx.conf").write_text(NGINX_CONFIGURATION % port, encoding="ascii")
            nginx = self.start("nginx", self.bench.nginx, "-p", "./", "-c", "nginx.conf")
            until = time.monotonic() + 2
            while nginx.process.poll() is None and time.monotonic() < until:
                try:
                    client = Client(port)
                    if client.ask(GET_FILE)[0] == 200:
                        self.ports["nginx"] = port
                        return
                except OSError:
                    time.sleep(.02)
                finally:
                    client.close()
            nginx.stop()
        self.absent["nginx"] = "not run: nginx does not start"

    def why_not(self, server):
        return None if self.bench.wrk is None else self.absent.get(server, "")

    def load(self, form, clients, server, seconds):
        """wrk on one server, after a warm-up by one connection."""
        if server == "nginx":
            path, method, post_arguments, warm = f"/{form}", "GET", [], GET_FILE
        else:
            path = PATH + "radiosity" if server == "lambertd" else f"/{[*FORMATS].index(form)}"
            method, post_arguments = "POST", [form, FORMATS[form]]
            warm = post(path, FORMATS[form], self.bodies[form])
        client = Client(self.ports[server])
        client.repeat(warm, .2, server)
        wrk = self.start("wrk", self.bench.wrk, "-t", 1, "-c", clients, "-d", f"{seconds}s", "--timeout",
                         "60s", "-s", "load.lua", f"http://127.0.0.1:{self.ports[server]}{path}", method,
                         *post_arguments)
        said = wrk.finish(seconds + ANSWER_S)
        self.running.remove(wrk)
        wrk.stop()
        # lambertd still solves the last requests of wrk, which nobody waits for; they must not disturb the next run.
        client.repeat(warm, 0, server)
        client.close()
        found = [line.split()[1:] for line in said.splitlines() if line.startswith("measured ")]
        try:
            p50, p99, requests, duration, failed = map(float, found[-1])
        except (IndexError, ValueError):
            raise Failure("wrk does not say what it measured; is it wrk 4?") from None
        return {"p50": p50 * 1e-6, "p99": p99 * 1e-6, "requests": requests, "failed": failed,
                "per_second": (requests - failed) / (duration * 1e-6)}

    def seconds_of(self, clients, server):
        """Enough for ten answers and two for every client where solves wait for each other, at most three times as
        long as the scale says."""
        wanted = math.ceil(max(10, 2 * clients) * self.solve_s)
        return self.seconds if server in ("ready", "nginx") else max(self.seconds, min(wanted, 3 * self.seconds))

    def run(self, form, clients, server):
        if self.bench.wrk is not None and server not in self.absent:
            self.runs[form, clients, server].append(self.load(form, clients, server, self.seconds_of(clients, server)))

    def measure_rounds(self):
        """Measures both sides of every ratio, in turns."""
        rounds = 1 if self.bench.quick else 5
        for number in range(rounds):
            tell(progress=["rounds of HTTP and solves", number / rounds])
            self.alone.append(self.solver.solves("alone", self.cores, .5 * self.short))
            self.run("npy", ONE, "lambertd")
            self.beside.append(self.solver.solves("beside", self.cores, .5 * self.short))
            for server in "lambertd", *SLEEPING:
                self.run("npy", MANY, server)

    def measure_rest(self):
        """Runs everything that had no turn yet, once."""
        for number, key in enumerate(self.runs):
            tell(progress=["load on every server", number / len(self.runs)])
            if not self.runs[key]:
                self.run(*key)
            self.add_load(*key)
        tell(progress=["load on every server", 1])

    def median(self, key, figure):
        return statistics.median([run[figure] for run in self.runs[key]] or [math.nan])

    def enough(self, key):
        """True where the requests that are under way when wrk stops, which it does not count, are few beside the rest."""
        return all(run["requests"] >= 3 * key[1] for run in self.runs[key])

    def add_load(self, form, clients, server):
        key = form, clients, server
        sent = 0 if server == "nginx" else len(self.bodies[form])
        per_second, failed, requests = (self.median(key, x) for x in ("per_second", "failed", "requests"))
        note = self.absent.get(server, "")
        if self.bench.wrk is None:
            note = "not run: wrk is not installed"
        elif not note and failed > 0:
            note = f"{failed:.0f} of {requests:.0f} failed"
        elif not note and not self.enough(key):
            note = "too few answers"
        self.bench.tables["load"].add(
            self.n, self.k, form, clients, server, 1e3 * self.median(key, "p50"), 1e3 * self.median(key, "p99"),
            per_second, sent, self.answer_bytes[form], per_second * (sent + self.answer_bytes[form]) * 1e-6, requests,
            len(self.runs[key]), note)

    def loop(self, client, *requests):
        """Answers a second, and the median time of each request, of requests in turns."""
        for request in requests:
            client.repeat(request, .1, "lambertd")
        times, begin = [[] for _ in requests], time.perf_counter()
        while not times[0] or time.perf_counter() < begin + self.short:
            for request, taken in zip(requests, times):
                taken.append(client.must(request, "lambertd in a loop:")[1])
        elapsed = time.perf_counter() - begin
        return sum(map(len, times)) / elapsed, [statistics.median(taken) for taken in times]

    def add_loop(self, name, form, per_second, first=math.nan, second=math.nan, note=""):
        self.bench.tables["loop"].add(self.n, self.k, name, form, per_second, 1e3 * first, 1e3 * second, note)

    @staticmethod
    def refusal(client, request):
        """Why a route does not take a request; empty where it does."""
        status = client.ask(request)[0]
        return "" if status == 200 else f"not run: the route answers {status}"

    def measure_loops(self):
        client = Client(self.ports["lambertd"])
        for form, request in self.requests.items():
            per_second, (first,) = self.loop(client, request)
            self.add_loop("forward", form, per_second, first)
        adjoint = self.loop_with_adjoint(client)
        body = json.dumps({"emission": {"groups": {"lamp": 1.5}},
                           "reduce": {"groups": ["desk"], "with": ["mean", "sum"]}}).encode()
        request, reduced = post(PATH + "radiosity", FORMATS["json"], body), math.nan
        note = self.refusal(client, request)
        if note:
            self.add_loop("reduce", "json", math.nan, note=note)
        else:
            reduced, (first,) = self.loop(client, request)
            self.add_loop("reduce", "json", reduced, first)
        codec = self.measure_codec(client)
        client.close()
        return adjoint, reduced, codec

    def loop_with_adjoint(self, client):
        """Forward and adjoint in turns; the cotangent has the size and the format of the forward answer."""
        path, name = PATH + "adjoint", "forward, adjoint"
        # A short request first: a long one to a route that does not read it would be cut off.
        note = self.refusal(client, post(path, FORMATS["json"], b'{"cotangent":{"elements":[0],"values":[1]}}'))
        if "501" not in note and "404" not in note:
            cotangent = self.bodies["json"].replace(b'"emission"', b'"gradient":["emission"],"cotangent"', 1)
            for form, body in ("npy", self.bodies["npy"]), ("json", cotangent):
                request = post(path, FORMATS[form], body)
                note = self.refusal(client, request)
                if not note:
                    per_second, (first, second) = self.loop(client, self.requests[form], request)
                    self.add_loop(name, form, per_second, first, second)
                    return second / first
        self.add_loop(name, "", math.nan, note=note)
        return math.nan

    def measure_codec(self, client):
        """The times that dense JSON answers state at their end."""
        times = []
        for _ in range(9):
            body, _ = client.must(self.requests["json"], "lambertd")
            tail = bytes(body[-160:])
            if b'"time_ms":' not in tail:
                raise Failure("lambertd's answer has no time_ms at its end")
            said = json.loads(b"{" + tail[tail.index(b'"time_ms":'):])["time_ms"]
            times.append((said["parse"], said["solve"], said["encode"], said["parse"] + said["encode"]))
        medians = [statistics.median(column) for column in zip(*times)]
        self.bench.tables["codec"].add(self.n, self.k, *medians, min(both for *_, both in times))
        return medians[-1]

    def ratio(self, above, figure, below):
        """The median over rounds of a figure over that of something else in the same round."""
        if len(self.runs[above]) < len(self.alone) or len(below) < len(self.alone):
            return math.nan
        return statistics.median(a[figure] / b[figure] for a, b in zip(self.runs[above], below))

    def best_tail(self, key):
        """p99 over p50 in the best of the rounds, as a disturbance only ever makes it worse."""
        return min((run["p99"] / run["p50"] for run in self.runs[key]), default=math.nan)

    def add_ratios(self, adjoint, reduced, codec):
        """Targets are named at the sizes that they were set for."""
        whole = self.k == self.wanted_k and not self.bench.quick
        small, large = whole and self.n == 2560, whole and self.n == 163840
        one, many = ("npy", ONE, "lambertd"), ("npy", MANY, "lambertd")
        enough_one, enough_many = self.enough(one), self.enough(many)
        tail = self.best_tail(many)

        def add(what, measured, sure=True, wanted=None, met=False):
            self.bench.tables["ratios"].add(
                self.n, self.k, what, measured, wanted or "",
                "not run" if not math.isfinite(measured) else "too few answers" if not sure
                else "" if wanted is None else "met" if met else "missed")

        http = self.ratio(one, "p50", self.alone)
        add("p50 over the solve in process, npy, 1 client", http, enough_one, "<= 1.15" if large else None,
            http <= 1.15)
        rate = self.ratio(many, "per_second", self.beside)
        add("answers a second over unbatched solves, npy, 16 clients", rate, enough_many,
            ">= 0.85" if small else None, rate >= .85)
        batch = self.ratio(many, "per_second", self.runs[one])
        add("answers a second of 16 clients over 1, npy", batch, enough_many and enough_one,
            ">= 4" if whole and not small else None, batch >= 4)
        add("p99 over p50, npy, 16 clients, best round", tail, enough_many)
        for server, what in SLEEPING.items():
            key = "npy", MANY, server
            theirs = self.best_tail(key)
            add(what, theirs, enough_many and self.enough(key), ">= lambertd's" if small else None, tail <= theirs)
        add("parse and encode of dense JSON, ms", codec, True, "<= 9" if large else None, codec <= 9)
        add("evaluations a second of the reduce loop", reduced, True, ">= 5000" if whole else None, reduced >= 5000)
        add("adjoint over forward, p50 in turns", adjoint, True, "<= 1.2" if whole else None, adjoint <= 1.2)
        add("bits as in process (1: yes)", float(self.same_bits), True, "= 1", self.same_bits)


class Bench:
    def __init__(self, programs, scale, seed):
        self.programs, self.quick, self.seed = pathlib.Path(programs), scale == "quick", int(seed)
        self.tables, self.sizes = make_tables(), SIZES[scale]
        self.wrk = shutil.which("wrk")
        self.nginx = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin:/usr/local/sbin:/sbin")
        if self.wrk is None:
            tell(log="wrk is not installed: no load, only loops of one client")

    def run(self):
        try:
            folder = tempfile.TemporaryDirectory(prefix="lambert-bench-", dir=os.environ.get("TMPDIR") or "/tmp")
        except OSError as error:
            raise Failure(f"{error.filename}: no folder can be made there: {error.strerror}; name another in TMPDIR") \
                from error
        with folder as path:
            self.folder = pathlib.Path(path).resolve()
            (self.folder / "answers").mkdir()
            (self.folder / "load.lua").write_text(WRK_SCRIPT, encoding="ascii")
            for size in self.sizes:
                Size(self, *size).measure()
        for table in self.tables.values():
            table.write()


run_suite(lambda: Bench(*sys.argv[1:]).run())
