"""Threads of OpenMP sleep while they wait, in both programs and in those that they start, unless the environment says otherwise.

libgomp prints what it took of the environment at OMP_DISPLAY_ENV=verbose: GOMP_SPINCOUNT, the turns that a thread waits before
it sleeps, is 0 where the policy is passive, 300000 by itself. The runtime of clang prints its own words in other places, so that
it is asked for the variable alone.
"""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

LAMBERT, LAMBERTD = os.environ["LAMBERT"], os.environ["LAMBERTD"]
BENCH = pathlib.Path(LAMBERT).with_name("lambert-bench")
PROGRAMS = [p for p in (LAMBERT, LAMBERTD, BENCH) if os.access(p, os.X_OK)]
KEPT = {name: os.environ[name] for name in ("ASAN_OPTIONS", "UBSAN_OPTIONS", "TSAN_OPTIONS", "LD_LIBRARY_PATH") if name in os.environ}


def is_gomp(program):
    return "libgomp" in subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout


def run(program, *arguments, **environment):
    return subprocess.run([program, *arguments], env=environment | KEPT, capture_output=True, text=True, check=True)


def spins(program, **environment):
    """The turns of the last start: lambertd starts itself twice."""
    said = run(program, "--help", OMP_DISPLAY_ENV="verbose", **environment).stderr
    return int(re.findall(r"GOMP_SPINCOUNT = '(\d+)'", said)[-1])


class Waits(unittest.TestCase):
    def test_threads_sleep(self):
        for program in PROGRAMS:
            if not is_gomp(program):
                continue
            for environment in ({"PATH": "/bin", "HOME": "/"}, {"HOME": "/", "SHLVL": "1"}, {"LANG": "C"}, {}):
                with self.subTest(program=program, environment=environment):
                    self.assertEqual(spins(program, **environment), 0)

    def test_the_environment_decides(self):
        for program in PROGRAMS:
            if not is_gomp(program):
                continue
            with self.subTest(program=program):
                self.assertEqual(spins(program, PATH="/bin", GOMP_SPINCOUNT="77"), 77)
                self.assertEqual(spins(program, PATH="/bin", KMP_BLOCKTIME="7"), 300000)
                self.assertGreater(spins(program, PATH="/bin", OMP_WAIT_POLICY="active"), 300000)
                self.assertEqual(spins(program, PATH="/bin", OMP_WAIT_POLICY="passive"), 0)

    def test_what_is_started_has_the_policy_and_all_variables(self):
        """`lambert view` starts the lambertd beside it, here a script."""
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            (here / "lambert").write_bytes(pathlib.Path(LAMBERT).read_bytes())
            (here / "lambertd").write_text(f"#!/bin/sh\nexec /usr/bin/env > {here}/said\n")
            for program in here.iterdir():
                program.chmod(0o755)
            given = {"PATH": "/usr/bin:/bin", "SHLVL": "3", "TERM": "dumb", "MINE": "x"}
            for more, policy in (({}, "passive"), ({"OMP_WAIT_POLICY": "active"}, "active"), ({"GOMP_SPINCOUNT": "5"}, None)):
                (here / "said").unlink(missing_ok=True)
                (here / "x.h5").write_bytes(b"")
                subprocess.run([here / "lambert", "view", here / "x.h5"], env=given | more | KEPT, capture_output=True, check=False,
                               stdin=subprocess.DEVNULL, timeout=60)
                said = dict(line.split("=", 1) for line in (here / "said").read_text().splitlines())
                with self.subTest(more=more):
                    self.assertEqual(said.get("OMP_WAIT_POLICY"), policy)
                    self.assertLessEqual(set({**given, "SHLVL": said["SHLVL"]}.items()), set(said.items()))


if __name__ == "__main__":
    unittest.main()
