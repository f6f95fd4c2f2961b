"""A run of `lambert bench service --quick`, the tables that it writes, and what it leaves behind."""

import csv
import json
import os
import stat
import subprocess
import tempfile
import unittest

from command import ENVIRONMENT, LAMBERT
from patience import PATIENCE

TABLES = {
    "load": "n k format clients server p50_ms p99_ms per_second bytes_sent bytes_got mb_per_second requests runs note",
    "solve": "n k gb solves threads p50_ms p99_ms per_second count",
    "loop": "n k loop format per_second p50_ms p50_second_ms note",
    "codec": "n k parse_ms solve_ms encode_ms codec_ms codec_best_ms",
    "ratios": "n k what measured wanted outcome",
}


def working_in(folder):
    """The processes whose folder is below another one."""
    found = []
    for process in filter(str.isdigit, os.listdir("/proc")):
        try:
            if os.readlink(f"/proc/{process}/cwd").startswith(folder + "/"):
                found.append(int(process))
        except OSError:
            pass  # it ended, or is not ours
    return found


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = os.path.realpath(folder.name)
        self.out, self.scratch = os.path.join(self.folder, "out"), os.path.join(self.folder, "scratch")
        self.programs = os.path.join(self.folder, "programs")
        os.mkdir(self.scratch)
        os.mkdir(self.programs)
        self.environment = dict(ENVIRONMENT, TMPDIR=self.scratch, CALLS=os.path.join(self.folder, "calls"))

    def program(self, name, text):
        """A program that is found before any of that name that is installed."""
        path = os.path.join(self.programs, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(path, stat.S_IRWXU)
        self.environment["PATH"] = self.programs + ":/bin:/usr/bin"

    def command(self, program=LAMBERT):
        return [program, "bench", "service", "--quick", "-o", self.out]

    def run_it(self, program=LAMBERT):
        done = subprocess.run(self.command(program), capture_output=True, text=True, timeout=PATIENCE,
                              env=self.environment, check=False)
        # servers, stores and answers are gone, however it ended
        self.assertEqual(os.listdir(self.scratch), [])
        self.assertEqual(working_in(self.scratch), [])
        return done

    def tables(self, program=LAMBERT):
        done = self.run_it(program)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = {}
        for name, columns in TABLES.items():
            with open(os.path.join(self.out, f"service-{name}.csv"), newline="", encoding="utf-8") as file:
                found[name] = list(csv.DictReader(file))
            with open(os.path.join(self.out, f"service-{name}.json"), encoding="utf-8") as file:
                whole = json.load(file)
            self.assertEqual([column["name"] for column in whole["columns"]], columns.split())
            self.assertEqual(len(whole["rows"]), len(found[name]))
            self.assertGreater(len(found[name]), 0)
        return found
