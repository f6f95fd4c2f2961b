"""A folder of stores for tests of a lambertd, and what they wait for."""

import contextlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import numpy as np

from daemon import LAMBERTD, PATIENCE, Daemon
from make_store import Scene

TOLERANCE = 1e-5  # as in test_daemon_answers.py: sums of 3,000 products, in single precision only over 128 of them


@contextlib.contextmanager
def replaced_under_load(test, path, stores, scenes, n_clients, n_rounds, answers):
    """A daemon whose store at path was replaced in every round by the one of two stores that it does not serve, while
    clients asked: each answer is that of one scene or the other, both occur, and so many come between two rounds."""
    E = np.random.default_rng(3).random((1, scenes[0].n))
    wanted = [scene.solve(E)[0] for scene in scenes]
    test.assertGreater(np.abs(wanted[0] - wanted[1]).max(), 100 * TOLERANCE * wanted[0].max())
    body = json.dumps({"emission": E[0].tolist()})
    stop, seen, failures = threading.Event(), [0, 0], []

    def client(daemon):
        connection = daemon.connect()
        try:
            while not stop.is_set():
                given = np.array(daemon.radiosity("box", body, connection=connection).json()["radiosity"])
                seen[[np.abs(given - w).max() <= TOLERANCE * w.max() for w in wanted].index(True)] += 1
        except Exception as failure:
            failures.append(failure)
        finally:
            connection.close()

    with Daemon(path) as daemon:
        clients = [threading.Thread(target=client, args=(daemon,)) for _ in range(n_clients)]
        for c in clients:
            c.start()
        try:
            for round_number in range(1, n_rounds + 1):
                before = sum(seen)
                while sum(seen) < before + answers and not failures:
                    time.sleep(0.001)
                spare = shutil.copy(stores[round_number % 2], path.with_name("spare"))
                os.replace(spare, path)
                daemon.signal(signal.SIGHUP)
                daemon.wait_for("reloaded: 1 scene", round_number)
        finally:
            stop.set()
            for c in clients:
                c.join()
        test.assertEqual(failures, [])
        test.assertGreater(min(seen), 0)
        test.assertEqual(daemon.errors(), "")
        yield daemon


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def store(self, file="box.h5", name="box", n=60, **more):
        path = self.folder / file
        kind = more.pop("kind", "low_rank")
        scene = Scene(n, **more)
        scene.write(path, name, kind=kind)
        return path, scene

    def run_once(self, *arguments):
        return subprocess.run([LAMBERTD, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)

    def names(self, daemon):
        return [s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]]

    def wait_in_flight(self, daemon, count, connection):
        """Until so many requests are open, the one that asks among them."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            text = daemon.get("/metrics", connection=connection).body.decode()
            if f"\nlambertd_in_flight {count}\n" in text:
                return
            time.sleep(0.001)
        self.fail(f"never {count} requests in flight")

    def wait_draining(self, daemon, connection):
        """Until the daemon says that it goes: by 503 or, where the signal came between the answer and its header,
        by closing the connection; asking again would then open another, which nobody accepts any more."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            answer = daemon.get("/readyz", connection=connection)
            if answer.status == 503 or answer.headers["Connection"] == "close":
                return
            time.sleep(0.001)
        self.fail("still ready after the signal")

    def read_all(self, s):
        parts = []
        try:
            while part := s.recv(65536):
                parts.append(part)
        except ConnectionResetError:
            pass
        return b"".join(parts)
