"""Answers of many numbers: nobody waits for one to be written or read."""

import json
import pathlib
import tempfile
import threading
import time
import unittest

from daemon import Daemon
from guard_case import metrics
from make_store import Scene

GROUPS = [f"g{k}" for k in range(20)]


class LongAnswers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        Scene(20000, groups=GROUPS).write(cls.folder / "big.h5", "big")

    @staticmethod
    def figures(vectors):
        return {"emissions": [{"groups": {"g1": v}} for v in range(1, vectors + 1)], "reduce": {"groups": GROUPS, "with": ["mean"]}}

    def test_long_figures_wait_for_their_turn(self):
        """Figures of a few vectors are written by the thread that receives and sends, beside a queue that is full; those of
        many, which take as long as many such answers, by one that solves."""
        with Daemon(self.folder / "big.h5", "--threads", 1, "--max-inflight", 1, "--max-batch", 4000) as daemon:
            self.assertEqual(daemon.radiosity("big", self.figures(1)).status, 200)
            ended, failures = threading.Event(), []

            def fill_the_queue():
                try:
                    body = {"emissions": [{"groups": {"g2": 1}}] * 500}
                    connection = daemon.connect()
                    while not ended.is_set():
                        daemon.radiosity("big", body, accept="application/x-npy", connection=connection)
                    connection.close()
                except Exception as failure:
                    failures.append(failure)

            filler = threading.Thread(target=fill_the_queue)
            filler.start()
            try:
                seen, deadline, connection = set(), time.monotonic() + 20, daemon.connect()
                while seen != {200, 503} and time.monotonic() < deadline and not failures:
                    seen.add(daemon.radiosity("big", self.figures(400), connection=connection).status)
                    if 503 not in seen and len(seen) > 0:
                        continue
                    self.assertEqual(daemon.radiosity("big", self.figures(2), connection=connection).status, 200)
                    if 503 in seen:
                        break
            finally:
                ended.set()
                filler.join()
            self.assertEqual(failures, [])
            self.assertIn(503, seen)
            self.assertEqual(metrics(daemon)[("lambertd_queued",)], 0)


if __name__ == "__main__":
    unittest.main()
