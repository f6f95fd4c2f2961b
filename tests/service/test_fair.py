"""A lambertd under mixed load: who asks for little is answered while others ask for much, also for what is refused.

The figures of a run are printed; counts alone are asserted, since this may run on any machine.
"""

import contextlib
import json
import statistics
import threading
import time
import unittest

from daemon import PATIENCE, Daemon
from guard_case import Case, until
from make_store import Scene

SHORT = json.dumps({"emission": {"groups": {"lamp": 1}}, "select": {"elements": [0]}})


class Load:
    """Clients that ask for the same until they are stopped, and the number of their answers."""

    def __init__(self, daemon, n_clients, path, body, status):
        self.daemon, self.path, self.body, self.status = daemon, path, body, status
        self.answers, self.failures = 0, []
        self.stopping = threading.Event()
        self.clients = [threading.Thread(target=self.ask) for _ in range(n_clients)]

    def ask(self):
        connection = self.daemon.connect()
        try:
            while not self.stopping.is_set():
                answer = self.daemon.post(self.path, self.body, connection=connection)
                if answer.status not in (self.status, 503):
                    self.failures.append(answer)
                    return
                self.answers += answer.status == self.status
        except OSError as failure:
            if not self.stopping.is_set():
                self.failures.append(failure)
        finally:
            connection.close()

    def __enter__(self):
        for c in self.clients:
            c.start()
        return self

    def __exit__(self, *_):
        self.stopping.set()
        for c in self.clients:
            c.join()


class Fair(Case):
    def solve(self, daemon, count, source="127.0.0.1"):
        """Seconds of so many solves, one after the other."""
        took = []
        with contextlib.closing(daemon.connect(source)) as connection:
            for _ in range(count):
                start = time.monotonic()
                answer = daemon.radiosity("box", SHORT, connection=connection)
                self.assertEqual(answer.status, 200, answer)
                took.append(time.monotonic() - start)
        return took

    def check(self, loads, least, stores=(), source="127.0.0.1"):
        """While each load goes on, and is answered `least` times in all, 50 solves of another client are answered: more
        than that would be answered in turn with so many others, were a solve one of many that wait."""
        with Daemon(self.box, self.big, *stores, "--threads", 2) as daemon, contextlib.ExitStack() as stack:
            alone = self.solve(daemon, 50)
            loads = [stack.enter_context(Load(daemon, *load)) for load in loads]
            until(lambda: all(load.answers >= 3 for load in loads))
            solved = []
            solver = threading.Thread(target=lambda: solved.extend(self.solve(daemon, 50, source)))
            before = sum(load.answers for load in loads)
            solver.start()
            deadline = time.monotonic() + PATIENCE
            while solver.is_alive() and sum(load.answers for load in loads) < before + least:
                self.assertLess(time.monotonic(), deadline)
                solver.join(.01)
            ended = not solver.is_alive()
            others = sum(load.answers for load in loads) - before
            for load in loads:
                load.stopping.set()
            solver.join()
            self.assertEqual([f for load in loads for f in load.failures], [])
            print(f"50 solves: median {1e3 * statistics.median(alone):.2f} ms alone, {1e3 * statistics.median(solved):.2f} ms "
                  f"beside {others} other answers, longest {1e3 * max(solved):.2f} ms")
            self.assertTrue(ended, f"{others} others were answered before 50 solves")

    def bad(self):
        """Its length is wrong, which is known only when it is read."""
        return 24, "/v1/scenes/box/radiosity", json.dumps({"emission": [1] * 680000}), 422

    def adjoints(self):
        return 32, "/v1/scenes/big/adjoint", json.dumps({"cotangent": [1] * 20000}), 200

    def long_solves(self):
        body = json.dumps({"emissions": [{"elements": [i], "values": [1]} for i in range(64)]})
        return 8, "/v1/scenes/big/radiosity", body, 200

    def test_long_reductions(self):
        """Short bodies of another client, 740 lights by 64 groups, whose figures take far longer than any estimate by
        the length of the body: a solve of another scene waits for a step of these on each thread, not for a whole one.
        Before, each solve waited for more than eight of them, so that there were 400 answers in these 50 solves."""
        store = self.folder / "groups.h5"
        groups = [f"g{k}" for k in range(64)]
        Scene(2000, groups=groups).write(store, "groups")
        body = json.dumps({"emissions": [{"groups": {"g0": .001 * k}} for k in range(740)],
                           "reduce": {"groups": groups, "with": ["mean", "sum"]}})
        load = 8, "/v1/scenes/groups/radiosity", body, 200
        self.check([load], 50, [store], "127.0.0.9")

    def test_bad_bodies(self):
        self.check([self.bad()], 400)

    def test_adjoints(self):
        self.check([self.adjoints()], 1000)

    def test_all_at_once(self):
        self.check([self.bad(), self.adjoints(), self.long_solves()], 1500)


if __name__ == "__main__":
    unittest.main()
