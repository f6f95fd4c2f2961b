"""Black box: what the script of `lambert bench service` makes of a wrk that is made up, of servers that are missing and
of a signal. The script is Python; the programs that it starts are under a sanitizer in test_bench_service.py."""

import os
import shutil
import signal
import subprocess
import time
import unittest

from bench_service_case import Case, working_in
from command import LAMBERT
from patience import PATIENCE

# 1000 answers and 10 failures in 2 s, half within .1 ms and 99 of 100 within .3 ms
WRK = """#!/bin/sh
echo "$@" >> "$CALLS"
echo measured with care
printf '\\nmeasured 100 300 1010 2000000 10\\n'
"""
WRK_ON_A_SLOW_MACHINE = "#!/bin/sh\necho; echo measured 400000 500000 20 1000000 0\n"
WRK_THAT_FAILS = "#!/bin/sh\necho no more sockets >&2\nexit 1\n"
WRK_THAT_HANGS = "#!/bin/sh\necho begun > \"$CALLS\"\nexec sleep 600\n"
NGINX_THAT_FAILS = "#!/bin/sh\necho 'nginx: [emerg] no' >&2\nexit 1\n"

# Answers every route, and wrongly: what it is sent for the light; adjoint in JSON only
LAMBERTD = """#!/usr/bin/python3
import http.server, json

class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *arguments):
        pass

    def do_POST(self):
        raw = self.rfile.read(int(self.headers["Content-Length"]))
        body = json.loads(raw) if self.headers["Content-Type"] == "application/json" else None
        status, answer = 200, raw
        if self.path.endswith("/adjoint"):
            status = 200 if body and len(body["cotangent"]) == 200 else 422
        elif body is not None:
            times = {"parse": 1.5, "solve": 2, "encode": 0.25}
            answer = json.dumps({"radiosity": body["emission"], "time_ms": times}, separators=(",", ":")).encode()
        self.send_response(status)
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
print(f"listening on http://127.0.0.1:{server.server_address[1]}", flush=True)
server.serve_forever()
"""


class MadeUp(Case):
    """With a wrk of our own."""

    def test_figures_of_wrk(self):
        self.program("wrk", WRK)
        self.program("nginx", NGINX_THAT_FAILS)
        tables = self.tables()
        for row in tables["load"]:
            if row["server"] == "nginx":
                self.assertEqual((row["note"], row["per_second"]), ("not run: nginx does not start", ""))
                continue
            self.assertEqual((float(row["p50_ms"]), float(row["p99_ms"])), (.1, .3))
            self.assertEqual(float(row["per_second"]), 500)
            self.assertAlmostEqual(float(row["mb_per_second"]),
                                   500e-6 * (int(row["bytes_sent"]) + int(row["bytes_got"])))
            self.assertEqual(row["note"], "10 of 1010 failed")
        ratios = {row["what"]: row for row in tables["ratios"]}
        for what, value in (("answers a second of 16 clients over 1, npy", 1),
                            ("p99 over p50, npy, 16 clients, best round", 3),
                            ("likewise of the sleeping server, all at once", 3)):
            self.assertAlmostEqual(float(ratios[what]["measured"]), value)
        # at this size nothing is wanted of speed
        self.assertEqual([row["what"] for row in tables["ratios"] if row["wanted"] != ""],
                         ["bits as in process (1: yes)"])
        with open(self.environment["CALLS"], encoding="utf-8") as file:
            calls = [line.split() for line in file]
        self.assertEqual(len(calls), 2 * 2 * 5 + 2)  # two to see what as many are
        for call in calls:
            self.assertEqual(call[:2] + call[4:6], ["-t", "1", "-d", "1s"])
            self.assertEqual(call[-3:], ["POST", "npy", "application/x-npy"] if "npy" in call
                             else ["POST", "json", "application/json"])

    def test_too_few_answers(self):
        """20 answers are enough for one client (3) and for four (12), not for 16."""
        self.program("wrk", WRK_ON_A_SLOW_MACHINE)
        self.program("nginx", NGINX_THAT_FAILS)
        tables = self.tables()
        for row in tables["load"]:
            if row["server"] != "nginx":
                self.assertEqual(row["note"], "too few answers" if row["clients"] == "16" else "", row)
        outcomes = {row["what"]: row["outcome"] for row in tables["ratios"]}
        self.assertEqual(outcomes["p50 over the solve in process, npy, 1 client"], "")
        self.assertEqual(outcomes["answers a second of 16 clients over 1, npy"], "too few answers")

    def test_a_wrk_that_fails(self):
        self.program("wrk", WRK_THAT_FAILS)
        done = self.run_it()
        self.assertEqual((done.returncode, done.stderr.splitlines()[-1]),
                         (1, "lambert bench: wrk failed: no more sockets"))
        self.assertFalse(os.path.exists(self.out))

    def started(self):
        """A run that waits for a wrk without end."""
        self.program("wrk", WRK_THAT_HANGS)
        running = subprocess.Popen(self.command(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                                   env=self.environment)
        self.addCleanup(running.stderr.close)
        self.addCleanup(running.wait)
        self.addCleanup(running.kill)
        until = time.monotonic() + PATIENCE
        while not os.path.exists(self.environment["CALLS"]):
            self.assertLess(time.monotonic(), until)
            self.assertIsNone(running.poll())
            time.sleep(.01)
        # lambertd, both ready servers and wrk, beside nginx where it is installed
        self.assertGreaterEqual(len(working_in(self.scratch)), 4)
        return running

    def test_cancelled(self):
        running = self.started()
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=PATIENCE)
        self.assertEqual(running.returncode, 1, said)
        self.assertIn("cancelled", said)
        self.assertEqual(os.listdir(self.scratch), [])
        self.assertEqual(working_in(self.scratch), [])
        self.assertFalse(os.path.exists(self.out))

    def test_killed(self):
        """The script is told by the kernel, and stops the servers."""
        self.started().kill()
        until = time.monotonic() + PATIENCE
        while working_in(self.scratch):
            self.assertLess(time.monotonic(), until)
            time.sleep(.01)


class Missing(Case):
    """A lambert that stands elsewhere than its build, with its scripts where they are installed."""

    def copy(self, *programs):
        build = os.path.dirname(LAMBERT)
        for program in "lambert", "lambert-bench", *programs:
            shutil.copy(os.path.join(build, program), self.programs)
        shutil.copytree(os.path.join(build, "bench"), os.path.join(self.folder, "share", "lambert", "bench"))
        return os.path.join(self.programs, "lambert")

    def test_without_wrk_and_ready_server(self):
        lambert = self.copy("lambertd")
        self.environment["PATH"] = self.programs
        tables = self.tables(lambert)
        for row in tables["load"]:
            self.assertEqual((row["note"], row["p50_ms"]), ("not run: wrk is not installed", ""))
        outcomes = {row["what"]: row["outcome"] for row in tables["ratios"]}
        self.assertEqual(outcomes["p50 over the solve in process, npy, 1 client"], "not run")
        self.assertEqual(outcomes["bits as in process (1: yes)"], "met")
        self.assertGreater(float(tables["loop"][0]["per_second"]), 0)
        self.assertFalse(os.path.exists(os.path.join(self.out, "service-throughput.svg")))

    def test_without_ready_server(self):
        self.program("wrk", WRK)
        self.program("nginx", NGINX_THAT_FAILS)
        tables = self.tables(self.copy("lambertd"))
        for row in tables["load"]:
            if row["server"] in ("ready", "sleeping", "as many", "abreast"):
                self.assertEqual(row["note"], "not run: no tests/ready_server beside lambert-bench")
            elif row["server"] == "lambertd":
                self.assertEqual(float(row["per_second"]), 500)

    def test_every_loop(self):
        """With a lambertd that has all routes: those of the real one come one by one."""
        self.program("wrk", WRK)
        self.program("nginx", NGINX_THAT_FAILS)
        self.program("lambertd", LAMBERTD)
        tables = self.tables(self.copy())
        self.assertEqual([(row["loop"], row["format"], row["note"]) for row in tables["loop"]],
                         [("forward", "npy", ""), ("forward", "json", ""), ("forward, adjoint", "json", ""),
                          ("reduce", "json", "")])
        for row in tables["loop"]:
            self.assertGreater(float(row["per_second"]), 0)
            self.assertEqual(row["p50_second_ms"] != "", row["loop"] == "forward, adjoint")
        for row in tables["codec"]:
            self.assertEqual([float(row[key + "_ms"]) for key in ("parse", "solve", "encode", "codec")],
                             [1.5, 2, .25, 1.75])
        ratios = {row["what"]: row for row in tables["ratios"]}
        self.assertEqual(ratios["bits as in process (1: yes)"]["outcome"], "missed")
        self.assertGreater(float(ratios["adjoint over forward, p50 in turns"]["measured"]), 0)
        self.assertGreater(float(ratios["evaluations a second of the reduce loop"]["measured"]), 0)

    def test_without_lambertd(self):
        done = self.run_it(self.copy())
        self.assertEqual(done.returncode, 1)
        self.assertIn("lambertd: cannot be run", done.stderr.splitlines()[-1])

    def test_without_a_place_for_stores(self):
        self.environment["TMPDIR"] = os.path.join(self.folder, "none")
        done = self.run_it()
        self.assertEqual(done.returncode, 1)
        self.assertIn("TMPDIR", done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
