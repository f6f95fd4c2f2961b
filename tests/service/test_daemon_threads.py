"""One budget of threads for the whole daemon: never more than it was given, whatever is asked at once, and the same bits
with any number of them."""

import json
import os
import pathlib
import unittest
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from daemon import Daemon
from daemon_case import Case

# Main thread, input and output, connections, those that are closed, verification, the one for short solves, the log, a sanitizer's own.
BESIDE_MOST = 8
THREADS, CLIENTS, LIMIT = 24, 48, 64
LARGE = 2600  # elements of an exact store of 27 MB: one answer is worth three threads


def count_of_user(uid):
    """The threads of a user, of which the system allows so many."""
    count = 0
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if process.stat().st_uid == uid:
                count += len(list((process / "task").iterdir()))
        except OSError:
            pass
    return count


def launcher_with(n_threads):
    """Starts a program that may have so many threads; the system asks this of no program of root's."""
    if os.geteuid() != 0:
        return ["prlimit", f"--nproc={count_of_user(os.geteuid()) + n_threads}"]
    uid = 100000 + os.getpid() % 100000
    reads = "+dac_read_search" # the program and its store may lie in a folder of root's
    return ["setpriv", f"--reuid={uid}", "--clear-groups", f"--inh-caps={reads}", f"--ambient-caps={reads}", "prlimit",
            f"--nproc={n_threads}"]


def threads_of(daemon):
    return len(list(pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir()))


class Threads(Case):
    def setUp(self):
        super().setUp()
        self.folder.chmod(0o755)
        self.path, self.scene = self.store(n=LARGE, kind="exact")
        self.path.chmod(0o644)
        rng = np.random.default_rng(7)
        self.vectors = rng.random((3, LARGE)).astype(np.float32)
        with Daemon(self.path, "--threads", 1) as daemon:
            self.beside = threads_of(daemon) - 1  # at rest
        self.assertLessEqual(self.beside, BESIDE_MOST)

    def questions(self):
        """Adjoints, rows of reductions, passes: everything that a large store shares among threads."""
        yield "adjoint", {"cotangent": self.vectors[0].tolist(), "gradient": ["emission"]}
        yield "radiosity", {"emission": self.vectors[1].tolist()}
        yield "radiosity", {"emissions": self.vectors.tolist(), "quantity": "irradiance"}
        for name in self.scene.group_names[:3]:
            yield "radiosity", {"emission": {"groups": {"lamp": 1}}, "reduce": {"groups": [name], "with": ["mean"]}}

    @staticmethod
    def ask(daemon, question):
        route, body = question
        answer = daemon.ask("POST", f"/v1/scenes/box/{route}", json.dumps(body), {"Content-Type": "application/json"})
        if answer.status != 200:
            raise AssertionError(f"{answer}")
        given = answer.json()
        given.pop("time_ms", None)
        return given

    def test_no_thread_above_the_budget_and_the_same_bits(self):
        questions = list(self.questions())
        with Daemon(self.path, "--threads", 1) as daemon:
            wanted = [self.ask(daemon, q) for q in questions]
            self.assertEqual(threads_of(daemon), 1 + self.beside)
        for threads in (2, 3, THREADS):
            with Daemon(self.path, "--threads", threads) as daemon, ThreadPoolExecutor(CLIENTS) as clients:
                for _ in range(2):
                    rounds = [clients.submit(self.ask, daemon, q) for q in questions * (CLIENTS // len(questions))]
                    for k, given in enumerate(rounds):
                        self.assertEqual(given.result(), wanted[k % len(questions)], questions[k % len(questions)][0])
                    self.assertEqual(threads_of(daemon), threads + self.beside)

    def test_where_the_system_allows_few_threads(self):
        """48 adjoints at once, of three threads each if there were any."""
        question = next(self.questions())
        with Daemon(self.path, "--threads", THREADS, launcher=launcher_with(LIMIT)) as daemon, \
             ThreadPoolExecutor(CLIENTS) as clients:
            given = list(clients.map(lambda _: self.ask(daemon, question), range(2 * CLIENTS)))
            self.assertEqual([g for g in given if g != given[0]], [])
            self.assertEqual(threads_of(daemon), THREADS + self.beside)
            self.assertEqual(daemon.errors(), "")

    def test_not_bound_to_one_processor(self):
        """OpenMP would do that to all threads where it is asked to bind its own."""
        with Daemon(self.path, "--threads", 2, launcher=["env", "OMP_PROC_BIND=true"]) as daemon:
            for task in pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir():
                self.assertEqual(os.sched_getaffinity(int(task.name)), os.sched_getaffinity(0))

    def test_as_many_as_the_process_may_use(self):
        """Without --threads, and a line that says why they are fewer than the processors."""
        most = len(os.sched_getaffinity(0))
        first = min(os.sched_getaffinity(0))
        with Daemon(self.path, launcher=["taskset", "-c", str(first)]) as daemon:
            self.assertEqual(threads_of(daemon), 1 + self.beside)
            if os.cpu_count() > 1:
                self.assertRegex(daemon.output(), rf"^1 thread: the process may run on 1 of {os.cpu_count()} processors\n")
        with Daemon(self.path) as daemon:
            self.assertLessEqual(threads_of(daemon), most + self.beside)
        with Daemon(self.path, "--threads", 3, launcher=["taskset", "-c", str(first)]) as daemon:
            self.assertEqual(threads_of(daemon), 3 + self.beside)
            self.assertRegex(daemon.output(), "^serving box")

    def test_fewer_threads_than_asked_for(self):
        """The program tells how many there are and serves with those."""
        question = next(self.questions())
        with Daemon(self.path, "--threads", THREADS, launcher=launcher_with(12)) as daemon:
            self.ask(daemon, question)
            self.assertLessEqual(threads_of(daemon), 12)
            self.assertRegex(daemon.errors(), rf"^lambertd: \d+ of {THREADS} --threads: the system allows no more\n$")


if __name__ == "__main__":
    unittest.main()
