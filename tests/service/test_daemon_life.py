"""lambertd from start to end: what it refuses to serve, reloading, draining, and clients that misbehave."""

import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import threading
import time
import unittest

import h5py
import numpy as np

from daemon import LAMBERTD, PATIENCE, Daemon
from daemon_case import Case, replaced_under_load
from make_store import Scene, add_checksums


class Life(Case):
    def test_help_and_version(self):
        asked = self.run_once("--help")
        self.assertEqual(asked.returncode, 0)
        for option in ("stores listen unix threads max-body max-batch max-inflight max-buffered max-connections max-memory max-request-memory "
                       "max-variants timeout request-timeout drain-delay shutdown-timeout min-rate token-file access-log verify").split():
            self.assertIn(f"--{option}", asked.stdout)
        self.assertRegex(self.run_once("--version").stdout, r"^lambertd \d+\.\d+\.\d+\n$")

    def test_wrong_usage(self):
        for arguments in ([], ["--nonsense", "x.h5"], ["x.h5", "--threads"], ["x.h5", "--threads", "0"],
                          ["x.h5", "--threads", "two"], ["x.h5", "--max-body", "12Q"], ["x.h5", "--max-body", "-1"],
                          ["x.h5", "--max-batch", "0"], ["x.h5", "--max-memory", "0"], ["x.h5", "--max-memory", "lots"],
                          ["x.h5", "--max-body", "99999999999999999999"], ["x.h5", "--max-body", "2M", "--max-buffered", "1M"],
                          ["x.h5", "--min-rate", "0"], ["x.h5", "--max-connections", "0"]):
            ended = self.run_once(*arguments)
            self.assertEqual(ended.returncode, 2, arguments)
            self.assertEqual(len(ended.stderr.splitlines()), 1, ended.stderr)
        for option in ("--lock", "--no-lights"):
            self.assertEqual(self.run_once("x.h5", option).stderr,
                             f"lambertd: {option}: no such option; see lambertd --help\n")

    def test_keeps_its_name(self):
        """ps, pgrep and the journal find the daemon by its name, although it starts itself a second time."""
        path, _ = self.store()
        for launcher in ((), ("env", "OMP_THREAD_LIMIT=1"), ("env", "OMP_THREAD_LIMIT=7")):
            with Daemon(path, launcher=launcher) as daemon:
                process = pathlib.Path("/proc") / str(daemon.process.pid)
                self.assertEqual((process / "comm").read_text(), "lambertd\n")
                self.assertEqual((process / "cmdline").read_bytes().split(b"\0")[0], os.fsencode(LAMBERTD))
                self.assertIn(b"OMP_THREAD_LIMIT=1", (process / "environ").read_bytes().split(b"\0"))

    def test_what_cannot_be_used(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            for arguments in (["--listen", f"127.0.0.1:{daemon.port}"], ["--listen", "nowhere"], ["--listen", "127.0.0.1:99999"],
                              ["--token-file", self.folder / "none"], ["--unix", "/" + "x" * 200],
                              ["--access-log", self.folder / "none" / "log"]):
                ended = self.run_once(path, *arguments)
                self.assertEqual(ended.returncode, 1, arguments)
                self.assertEqual(len(ended.stderr.splitlines()), 1, ended.stderr)

    def spoil(self):
        """Files that are not to be served, beside a sound one; what their refusal has to say."""
        path, _ = self.store()
        sound = path.read_bytes()
        wanted = {}

        def make(name, content):
            (self.folder / name).write_bytes(content)

        make("foreign.h5", b"this is no HDF5 file\n" * 100)
        make("empty.h5", b"")
        make("truncated.h5", sound[: len(sound) * 2 // 3])
        make("flipped.h5", sound)
        with h5py.File(self.folder / "flipped.h5", "r") as f:
            places = [f[name].id.get_offset() + 5 for name in ("operator/Y", "mesh/vertices")]
        for name, at in zip(("flipped.h5", "crooked.h5"), places):
            make(name, sound[:at] + bytes([sound[at] ^ 0x10]) + sound[at + 1:])
        make("newer.h5", sound)
        with h5py.File(self.folder / "newer.h5", "r+") as f:
            f.attrs.modify("version", np.int64(2))
        make("other.h5", sound)
        with h5py.File(self.folder / "other.h5", "r+") as f:
            f.attrs.modify("format", np.bytes_(b"photons"))
        for name, words in (("foreign", ""), ("empty", ""), ("truncated", ""), ("flipped", "/operator/Y"), ("crooked", "/mesh/vertices"),
                            ("newer", "version"), ("other", "")):
            wanted[self.folder / f"{name}.h5"] = words
        return path, wanted

    def check_refusals(self, errors, wanted):
        lines = errors.splitlines()
        self.assertEqual(len(lines), len(wanted), errors)
        for path, words in wanted.items():
            mine = [line for line in lines if line.startswith(f"refused {path}: ")]
            self.assertEqual(len(mine), 1, errors)
            self.assertIn(words, mine[0])

    def test_damaged_stores_are_refused_by_name_and_the_others_served(self):
        path, wanted = self.spoil()
        with Daemon("--stores", self.folder) as daemon:
            self.assertEqual(self.names(daemon), ["box"])
            self.check_refusals(daemon.errors(), wanted)
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * 60}).status, 200)
        with Daemon(*wanted, path, self.folder / "absent.h5") as daemon:
            self.assertEqual(self.names(daemon), ["box"])
            wanted[self.folder / "absent.h5"] = ""
            self.check_refusals(daemon.errors(), wanted)

    def test_verify_reads_what_a_solve_does_not_need(self):
        path = self.folder / "box.h5"
        Scene(60).write(path, sky=4)
        with h5py.File(path, "a") as f:
            f.create_dataset("/later", data=np.arange(100.0))
            add_checksums(f)
            at = f["later"].id.get_offset()
        raw = bytearray(path.read_bytes())
        raw[at] ^= 1
        path.write_bytes(raw)
        other, _ = self.store("other.h5", "other")
        with Daemon(path, other) as daemon:
            self.assertEqual(self.names(daemon), ["box", "other"])
        with Daemon(path, other, "--verify") as daemon:
            self.assertEqual(self.names(daemon), ["other"])
            self.check_refusals(daemon.errors(), {path: "/later"})

    def test_nothing_to_serve(self):
        _, wanted = self.spoil()
        for arguments in (list(wanted), [self.folder / "absent.h5"], ["--stores", self.folder / "absent"]):
            ended = self.run_once("--listen", "127.0.0.1:0", *arguments)
            self.assertEqual(ended.returncode, 1)
            self.assertIn("no store can be served", ended.stderr)
            self.assertNotIn("listening", ended.stdout)

    def test_names(self):
        one, _ = self.store("one.h5", "box")
        two, _ = self.store("two.h5", "box")
        with_colon, _ = self.store("a:b.h5", "colon")
        with Daemon(one, two, f"{two}:second", with_colon, f"{two}:one") as daemon:
            self.assertEqual(self.names(daemon), ["a:b", "one", "second", "two"])
            self.check_refusals(daemon.errors(), {two: "the name one is taken"})
            self.assertEqual(daemon.get("/v1/scenes/second").json()["name"], "second")
            self.assertEqual(daemon.radiosity("second", {"emission": [1] * 60}).json()["scene"], "second")

    def test_reload_swaps_without_dropping_a_request(self):
        path, first = self.store(seed=1)
        second = Scene(60, seed=2)
        stores = [self.folder / "first", self.folder / "second"]
        shutil.copy(path, stores[0])
        second.write(stores[1])
        with replaced_under_load(self, path, stores, (first, second), n_clients=4, n_rounds=10, answers=8):
            pass

    def test_a_store_that_fails_to_reload_stays_as_it_was(self):
        path, scene = self.store()
        other, _ = self.store("other.h5", "other")
        with Daemon(path, other, f"{other}:gone") as daemon:
            right = daemon.radiosity("box", {"emission": [1] * 60}).json()["radiosity"]
            path.write_bytes(path.read_bytes()[:1000])
            Scene(20, seed=9).write(other, "other")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 3 scenes")
            self.assertEqual(len(daemon.errors().splitlines()), 1, daemon.errors())
            self.assertIn(str(path), daemon.errors())
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * 60}).json()["radiosity"], right)
            self.assertEqual(daemon.get("/v1/scenes/other").json()["elements"], 20)

    def test_reload_follows_the_folder(self):
        self.store("a.h5", "a")
        self.store("b.h5", "b")
        with Daemon("--stores", self.folder) as daemon:
            self.assertEqual(self.names(daemon), ["a", "b"])
            (self.folder / "a.h5").unlink()
            self.store("c.h5", "c")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 2 scenes")
            self.assertEqual(self.names(daemon), ["b", "c"])

    def test_sigterm_finishes_an_upload_that_has_begun(self):
        path, scene = self.store()
        for number in signal.SIGTERM, signal.SIGINT:
            with Daemon(path) as daemon:
                body = json.dumps({"emission": [1] * 60}).encode()
                idle, slow = daemon.connect(), daemon.raw()
                self.assertEqual(daemon.get("/readyz", connection=idle).status, 200)
                slow.sendall(b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n"
                             b"Content-Type: application/json\r\n\r\n" % len(body) + body[:20])
                self.wait_in_flight(daemon, 2, idle)
                daemon.signal(number)
                self.wait_draining(daemon, idle)
                with self.assertRaises(OSError):
                    daemon.raw()
                self.assertIsNone(daemon.process.poll())
                slow.sendall(body[20:])
                answer = self.read_all(slow)
                self.assertTrue(answer.startswith(b"HTTP/1.1 200 "), answer[:200])
                self.assertIn(b"\r\nConnection: close\r\n", answer)
                self.assertEqual(daemon.wait(), 0)
                idle.close()
                slow.close()

    def test_sigterm_finishes_what_waits_and_runs(self):
        path, _ = self.store(n=400, kind="exact")
        count = 12
        forms = [{"elements": [i], "values": [1]} for i in range(200)]
        body = json.dumps({"emissions": forms, "select": {"elements": [1]}})
        answers = []
        with Daemon(path, "--threads", 2) as daemon:
            watch = daemon.connect()
            self.assertEqual(daemon.get("/healthz", connection=watch).status, 200)

            def client():
                answers.append(daemon.radiosity("box", body).status)

            clients = [threading.Thread(target=client) for _ in range(count)]
            for c in clients:
                c.start()
            # The signal comes when all are in, or some already answered: none may be lost either way.
            deadline = time.monotonic() + PATIENCE
            while time.monotonic() < deadline:
                lines = daemon.get("/metrics", connection=watch).body.decode().splitlines()
                open_now = [int(line.split()[-1]) for line in lines if line.startswith("lambertd_in_flight ")][0] - 1
                done = [int(line.split()[-1]) for line in lines
                        if line.startswith('lambertd_requests_total{route="/v1/scenes/{name}/radiosity",status="200"}')]
                if open_now + sum(done) == count:
                    break
            daemon.signal(signal.SIGTERM)
            for c in clients:
                c.join()
            watch.close()
            self.assertEqual(daemon.wait(), 0)
        self.assertEqual(answers, [200] * count)

    def test_reloads_do_not_keep_sigterm_waiting(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            storm = subprocess.Popen(["sh", "-c", f"while kill -HUP {daemon.process.pid} 2>/dev/null; do :; done"])
            try:
                time.sleep(.5)
                daemon.signal(signal.SIGTERM)
                self.assertEqual(daemon.process.wait(PATIENCE), 0)  # the storm goes on until then
            finally:
                storm.kill()
                storm.wait()

    def test_the_socket_of_a_successor_stays(self):
        path, _ = self.store()
        socket_path = os.path.join(self.folder, "u.sock")

        def healthy():
            with socket.socket(socket.AF_UNIX) as s:
                s.connect(socket_path)
                s.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                return s.recv(64).startswith(b"HTTP/1.1 200")
        with Daemon(path, "--unix", socket_path, listen=None) as first:
            slow = socket.socket(socket.AF_UNIX)
            slow.connect(socket_path)
            slow.sendall(b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\n"
                         b"Content-Type: application/json\r\nContent-Length: 100\r\n\r\n{")
            time.sleep(.3)
            first.signal(signal.SIGTERM)
            deaf = False
            while not deaf:  # its path may stay or not
                time.sleep(.01)
                try:
                    deaf = not healthy()
                except (ConnectionRefusedError, FileNotFoundError):
                    deaf = True
            with Daemon(path, "--unix", socket_path, listen=None) as second:
                self.assertTrue(healthy())
                slow.close()
                first.signal(signal.SIGTERM)
                self.assertEqual(first.wait(), 0)
                self.assertTrue(healthy())
                second.stop()
            self.assertFalse(os.path.exists(socket_path))

    def test_a_second_signal_does_not_wait(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            watch, slow = daemon.connect(), daemon.raw()
            slow.sendall(b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{")
            self.wait_in_flight(daemon, 2, watch)
            daemon.signal(signal.SIGTERM)
            self.wait_draining(daemon, watch)
            watch.close()
            daemon.signal(signal.SIGTERM)
            self.assertEqual(daemon.wait(), 0)
            slow.close()


if __name__ == "__main__":
    unittest.main()
