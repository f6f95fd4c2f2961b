"""A lambertd leaves: balancers are told before it stops to accept, what runs has its time, what is left is told so."""

import pathlib
import signal
import tempfile
import time
import unittest

from daemon import Daemon
from deadlines_case import LONG, Case, metrics, read_all, until


class Leaving(Case):
    def many(self, daemon, count):
        """Clients whose solves take minutes, all in the queue."""
        clients = [self.ask(daemon, LONG) for _ in range(count)]
        for s in clients:
            self.addCleanup(s.close)
        until(lambda: metrics(daemon)[("lambertd_queued",)] == count)
        return clients

    def check_end(self, daemon, clients, start, least):
        """They are told, and the daemon ends with 0. In the time for last answers a slow machine may neither tell them all
        nor end each pass that runs; it says so then."""
        answers = [answer for s in clients if (answer := read_all(s))]
        for answer in answers:
            self.check_problem(answer, b"shutting down")
        self.assertGreaterEqual(len(answers), 1)
        self.assertEqual(daemon.wait(), 0)
        took = time.monotonic() - start
        self.assertGreaterEqual(took, least)
        print(f"{len(answers)} of {len(clients)} are told; ended {took - least:.3f} s after it might give up")
        self.assertIn(daemon.errors(), ("", "lambertd: what still runs is given up\n"))

    def test_it_accepts_for_a_while(self):
        with self.daemon("--drain-delay", 2) as daemon:
            self.assertEqual(daemon.get("/readyz").status, 200)
            daemon.signal(signal.SIGTERM)
            until(lambda: daemon.get("/readyz").status == 503)
            self.assertEqual(daemon.get("/healthz").status, 200)
            answer = daemon.radiosity("box", {"emission": {"groups": {}}})
            self.assertEqual((answer.status, answer.headers["Connection"]), (200, "close"))
            self.assertEqual(daemon.wait(), 0)

    def test_a_second_signal_ends_the_delay(self):
        with self.daemon("--drain-delay", 80000) as daemon:
            daemon.signal(signal.SIGTERM)
            until(lambda: daemon.get("/readyz").status == 503)
            daemon.signal(signal.SIGHUP)
            self.assertEqual(daemon.get("/readyz").status, 503)
            daemon.signal(signal.SIGINT)
            self.assertEqual(daemon.wait(), 0)

    def test_the_time_to_finish(self):
        # In the last .8 s of its time it answers those that it gives up.
        with self.daemon("--shutdown-timeout", 2, "--max-inflight", 64) as daemon:
            clients = self.many(daemon, 12)
            start = time.monotonic()
            daemon.signal(signal.SIGTERM)
            self.check_end(daemon, clients, start, 1)

    def test_a_second_signal_ends_at_once(self):
        with self.daemon("--max-inflight", 64) as daemon:
            clients = self.many(daemon, 12)
            daemon.signal(signal.SIGTERM)
            time.sleep(.3)
            start = time.monotonic()
            daemon.signal(signal.SIGTERM)
            self.check_end(daemon, clients, start, 0)

    def many_stores(self, count):
        """A folder of so many names of one store."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for k in range(count):
            pathlib.Path(folder.name, f"s{k:04}.h5").symlink_to(self.folder / "box.h5")
        return folder.name

    def check_left_off(self, daemon, signals, before):
        """It ends while most stores of 1,000 are still to be read: it leaves between two of them, not behind the last
        one. It is told so when it has read a few; those that it reads until the signal is there are its pace's."""
        for _ in range(signals):
            daemon.signal(signal.SIGTERM)
            time.sleep(.05)
        self.assertEqual(daemon.wait(), 0)
        read = daemon.output().count("serving") - before
        print(f"{read} of 1000 stores were read")
        self.assertLess(read, 500)
        self.assertRegex(daemon.errors(), r"left off reading stores at \d+ of 1000\n")

    def test_a_first_load_is_left_off(self):
        for signals in 1, 2:
            with self.subTest(signals=signals), Daemon("--stores", self.many_stores(1000), ready=False) as daemon:
                daemon.wait_for("serving", 3)
                self.check_left_off(daemon, signals, 0)
                self.assertNotIn("listening", daemon.output())

    def test_a_reload_is_left_off(self):
        with tempfile.TemporaryDirectory() as folder:
            stores = pathlib.Path(folder, "stores")
            stores.mkdir()
            (stores / "box.h5").symlink_to(self.folder / "box.h5")
            with Daemon("--stores", stores) as daemon:
                for path in pathlib.Path(self.many_stores(999)).iterdir():
                    path.rename(stores / path.name)
                daemon.signal(signal.SIGHUP)
                daemon.wait_for("serving", 4)
                self.assertEqual(daemon.get("/v1/scenes/box").status, 200)
                self.check_left_off(daemon, 2, 1)
                self.assertNotIn("reloaded", daemon.output())

    def test_a_solve_that_ends_in_time_is_answered(self):
        with self.daemon() as daemon:
            s = self.ask(daemon, self.refinement(300))
            until(lambda: metrics(daemon)[("lambertd_queued",)] == 1)
            daemon.signal(signal.SIGTERM)
            self.assertTrue(read_all(s).startswith(b"HTTP/1.1 200 "))
            self.assertEqual(daemon.wait(), 0)
            s.close()

    def test_ready_with_scenes_alone(self):
        folder = self.folder / "stores"
        folder.mkdir()
        path = folder / "box.h5"
        path.write_bytes(self.store.read_bytes())
        with Daemon("--stores", folder) as daemon:
            self.assertEqual(daemon.get("/readyz").status, 200)
            path.unlink()
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 0 scenes")
            answer = daemon.get("/readyz")
            self.assertEqual(answer.status, 503)
            self.assertIn("no scene", answer.json()["detail"])
            self.assertEqual(daemon.get("/healthz").status, 200)
            path.write_bytes(self.store.read_bytes())
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 1 scene\n")
            self.assertEqual(daemon.get("/readyz").status, 200)


if __name__ == "__main__":
    unittest.main()
