"""lambertd from start to end: what it refuses to serve, reloading, draining, and clients that misbehave."""

import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

import h5py
import numpy as np

from daemon import LAMBERTD, PATIENCE, Daemon
from make_store import Scene

TOLERANCE = 1e-5  # as in test_daemon_answers.py


class Life(unittest.TestCase):
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

    # --- the command line

    def test_help_and_version(self):
        asked = self.run_once("--help")
        self.assertEqual(asked.returncode, 0)
        for option in ("stores listen unix threads max-body max-batch max-inflight max-buffered max-connections max-memory "
                       "max-variants timeout min-rate token-file access-log verify").split():
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
        for option in ("--lock", "--no-viewer"):
            self.assertEqual(self.run_once("x.h5", option).stderr,
                             f"lambertd: {option}: no such option; see lambertd --help\n")

    def test_keeps_its_name(self):
        """ps, pgrep and the journal find the daemon by its name, although it starts itself a second time."""
        path, _ = self.store()
        for launcher in ((), ("env", "-u", "OMP_WAIT_POLICY")):
            with Daemon(path, launcher=launcher) as daemon:
                process = pathlib.Path("/proc") / str(daemon.process.pid)
                self.assertEqual((process / "comm").read_text(), "lambertd\n")
                self.assertEqual((process / "cmdline").read_bytes().split(b"\0")[0], os.fsencode(LAMBERTD))
                self.assertIn(b"OMP_WAIT_POLICY=", (process / "environ").read_bytes())

    def test_what_cannot_be_used(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            for arguments in (["--listen", f"127.0.0.1:{daemon.port}"], ["--listen", "nowhere"], ["--listen", "127.0.0.1:99999"],
                              ["--token-file", self.folder / "none"], ["--unix", "/" + "x" * 200],
                              ["--access-log", self.folder / "none" / "log"]):
                ended = self.run_once(path, *arguments)
                self.assertEqual(ended.returncode, 1, arguments)
                self.assertEqual(len(ended.stderr.splitlines()), 1, ended.stderr)

    # --- stores

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
        with h5py.File(path, "r") as f:
            at = f["sky/tiles"].id.get_offset()
        raw = bytearray(path.read_bytes())
        raw[at] ^= 1
        path.write_bytes(raw)
        other, _ = self.store("other.h5", "other")
        with Daemon(path, other) as daemon:
            self.assertEqual(self.names(daemon), ["box", "other"])
        with Daemon(path, other, "--verify") as daemon:
            self.assertEqual(self.names(daemon), ["other"])
            self.check_refusals(daemon.errors(), {path: "/sky/tiles"})

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
        with Daemon(one, two, f"{two}:second", with_colon) as daemon:
            self.assertEqual(self.names(daemon), ["box", "colon", "second"])
            self.check_refusals(daemon.errors(), {two: "box"})
            self.assertEqual(daemon.get("/v1/scenes/second").json()["name"], "second")
            self.assertEqual(daemon.radiosity("second", {"emission": [1] * 60}).json()["scene"], "second")

    # --- reloading

    def test_reload_swaps_without_dropping_a_request(self):
        path, first = self.store(seed=1)
        second = Scene(60, seed=2)
        spare = self.folder / "spare"
        shutil.copy(path, self.folder / "first")
        second.write(self.folder / "second")
        E = np.random.default_rng(3).random((1, 60))
        wanted = [scene.solve(E)[0] for scene in (first, second)]
        self.assertGreater(np.abs(wanted[0] - wanted[1]).max(), 100 * TOLERANCE)
        body = json.dumps({"emission": E[0].tolist()})
        stop, seen, failures = threading.Event(), [0, 0], []

        def client(daemon):
            connection = daemon.connect()
            try:
                while not stop.is_set():
                    answer = daemon.radiosity("box", body, connection=connection)
                    given = np.array(answer.json()["radiosity"])
                    which = [np.abs(given - w).max() <= TOLERANCE * w.max() for w in wanted]
                    seen[which.index(True)] += 1
            except Exception as failure:
                failures.append(failure)
            finally:
                connection.close()

        with Daemon(path) as daemon:
            clients = [threading.Thread(target=client, args=(daemon,)) for _ in range(4)]
            for c in clients:
                c.start()
            try:
                for round_number in range(1, 11):
                    before = sum(seen)
                    while sum(seen) < before + 8 and not failures:
                        time.sleep(0.001)
                    shutil.copy(self.folder / ("second" if round_number % 2 else "first"), spare)
                    os.replace(spare, path)
                    daemon.signal(signal.SIGHUP)
                    daemon.wait_for("reloaded: 1 scene", round_number)
            finally:
                stop.set()
                for c in clients:
                    c.join()
            self.assertEqual(failures, [])
            self.assertGreater(min(seen), 0)
            self.assertEqual(daemon.errors(), "")

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

    # --- the end

    def test_sigterm_finishes_an_upload_that_has_begun(self):
        path, scene = self.store()
        for number in signal.SIGTERM, signal.SIGINT:
            with Daemon(path) as daemon:
                body = json.dumps({"emission": [1] * 60}).encode()
                idle, slow = daemon.connect(), daemon.raw()
                self.assertEqual(daemon.get("/readyz", connection=idle).status, 200)
                slow.sendall(b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n"
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

    def wait_in_flight(self, daemon, count, connection):
        """Until so many requests are open, the one that asks among them."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            text = daemon.get("/metrics", connection=connection).body.decode()
            if f"\nlambertd_in_flight {count}\n" in text:
                return
            time.sleep(0.001)
        self.fail(f"never {count} requests in flight")

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

    def test_a_second_signal_does_not_wait(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            watch, slow = daemon.connect(), daemon.raw()
            slow.sendall(b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n{")
            self.wait_in_flight(daemon, 2, watch)
            daemon.signal(signal.SIGTERM)
            self.wait_draining(daemon, watch)
            watch.close()
            daemon.signal(signal.SIGTERM)
            self.assertEqual(daemon.wait(), 0)
            slow.close()

    # --- many clients, bad clients

    def test_a_hundred_clients_get_their_own_answers(self):
        path, scene = self.store()
        failures = []
        with Daemon(path, "--threads", 3) as daemon:
            start = threading.Barrier(100)

            def client(i):
                try:
                    connection = daemon.connect()
                    E = np.zeros((1, 60))
                    E[0, i % 60] = 1 + i
                    wanted = scene.solve(E)[0]
                    start.wait(PATIENCE)
                    for _ in range(3):
                        body = {"emission": {"elements": [i % 60], "values": [1 + i]}}
                        answer = daemon.radiosity("box", body, connection=connection)
                        given = np.array(answer.json()["radiosity"])
                        if not np.abs(given - wanted).max() <= TOLERANCE * wanted.max():
                            failures.append((i, "another client's answer"))
                    connection.close()
                except Exception as failure:
                    failures.append((i, failure))

            clients = [threading.Thread(target=client, args=(i,)) for i in range(100)]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            self.assertEqual(failures, [])

    def test_a_full_queue_answers_503(self):
        path, _ = self.store(n=1000, kind="exact")
        body = json.dumps({"emissions": [{"elements": [i % 1000], "values": [1]} for i in range(500)],
                           "select": {"elements": [0]}})
        with Daemon(path, "--threads", 1, "--max-inflight", 1) as daemon:
            answers = []
            clients = [threading.Thread(target=lambda: answers.append(daemon.radiosity("box", body))) for _ in range(16)]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            full = [a for a in answers if a.status == 503]
            self.assertEqual({a.status for a in answers}, {200, 503})
            for answer in full:
                self.assertEqual(answer.headers["Retry-After"], "1")
                self.assertEqual(answer.json()["status"], 503)
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * 1000}).status, 200)

    def test_a_small_body_limit_is_no_limit_on_scenes(self):
        path, scene = self.store(n=20000)
        with Daemon(path, "--max-body", 1000) as daemon:
            body = {"emission": {"groups": {"lamp": 1}}, "select": {"elements": [7]}}
            E = np.zeros((1, 20000))
            E[0, scene.members("lamp")] = 1
            wanted = scene.solve(E)[0, 7]
            # 20,000 terms of one sign are summed in single precision, in any order: at most 20,000 * 6e-8.
            self.assertAlmostEqual(daemon.radiosity("box", body).json()["radiosity"][0], wanted, delta=1.2e-3 * wanted)

    def read_all(self, s):
        parts = []
        try:
            while part := s.recv(65536):
                parts.append(part)
        except ConnectionResetError:
            pass
        return b"".join(parts)

    def test_what_is_not_http(self):
        path, _ = self.store()
        rng = np.random.default_rng(5)
        # libmicrohttpd may miss that a client went right behind its last byte; the time-out then ends it.
        with Daemon(path, "--timeout", 3) as daemon:
            for junk in (b"\r\n\r\n\r\n", b"\0" * 5000, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"HELO example\r\n\r\n",
                         b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: -5\r\n\r\n{}",
                         b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: 9x\r\n\r\n{}",
                         b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
                         b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
                         b"GET / HTTP/1.1\r\n" + b"X: " + b"y" * 100_000 + b"\r\n\r\n",
                         b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20_000 + b"\r\n",
                         b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + rng.bytes(500), *(rng.bytes(2000) for _ in range(20))):
                with self.subTest(junk=junk[:60]), daemon.raw() as s:
                    try:
                        s.sendall(junk)
                        s.shutdown(socket.SHUT_WR)
                    except OSError:
                        pass
                    answer = self.read_all(s)
                    self.assertNotIn(b" 200 ", answer[:20])
                self.assertEqual(daemon.radiosity("box", {"emission": [1] * 60}).status, 200)

    def test_clients_that_go(self):
        path, _ = self.store(n=400, kind="exact")
        forms = [{"elements": [i], "values": [1]} for i in range(100)]
        body = json.dumps({"emissions": forms}).encode()
        whole = (b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                 b"Content-Length: %d\r\n\r\n" % len(body) + body)
        with Daemon(path, "--timeout", 3) as daemon:
            for sent in (0, 1, 30, whole.index(b"{"), len(whole) - 1, len(whole), len(whole)):
                for abrupt in False, True:
                    s = daemon.raw()
                    if abrupt:
                        # Closing then resets the connection.
                        s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
                    s.sendall(whole[:sent])
                    s.close()
            # A client that reads only the beginning of its answer.
            s = daemon.raw()
            s.sendall(whole)
            s.recv(100)
            s.close()
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * 400}).status, 200)
            watch = daemon.connect()
            self.wait_in_flight(daemon, 1, watch)
            watch.close()

    def test_a_slow_client(self):
        path, scene = self.store()
        body = json.dumps({"emission": [1] * 60}).encode()
        whole = b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % len(body) + body
        with Daemon(path) as daemon, daemon.raw() as s:
            s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for at in range(len(whole)):
                s.sendall(whole[at : at + 1])
                if at % 50 == 0:
                    # Others are not held up.
                    self.assertEqual(daemon.radiosity("box", {"emission": [1] * 60}).status, 200)
            answer = b""
            while b"time_ms" not in answer:
                answer += s.recv(7)
            self.assertTrue(answer.startswith(b"HTTP/1.1 200 "))

    def test_a_silent_client_is_cut(self):
        path, _ = self.store()
        with Daemon(path, "--timeout", 1) as daemon:
            for begun in b"", b"GET /hea", b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: 99\r\n\r\n{":
                with daemon.raw() as s:
                    s.sendall(begun)
                    self.assertNotIn(b" 200 ", self.read_all(s))

    def test_pipelined_requests_are_answered_in_order(self):
        path, scene = self.store()
        requests, wanted = b"", []
        for i in range(20):
            body = json.dumps({"emission": {"elements": [i], "values": [1]}, "select": {"elements": [i]}}).encode()
            requests += (b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % len(body)) + body
            requests += b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"
            E = np.zeros((1, 60))
            E[0, i] = 1
            wanted.append(scene.solve(E)[0, i])
        with Daemon(path) as daemon, daemon.raw() as s:
            s.sendall(requests)
            stream = s.makefile("rb")
            for i in range(20):
                for kind in "radiosity", "status":
                    length = 0
                    self.assertIn(b" 200 ", stream.readline())
                    while (line := stream.readline()) != b"\r\n":
                        if line.lower().startswith(b"content-length:"):
                            length = int(line.split(b":")[1])
                    answer = json.loads(stream.read(length))
                    self.assertIn(kind, answer)
                    if kind == "radiosity":
                        self.assertAlmostEqual(answer["radiosity"][0], wanted[i], delta=TOLERANCE * wanted[i])

    # --- token, log, socket

    def test_token(self):
        path, _ = self.store()
        token = self.folder / "token"
        token.write_text("  s3cret-token \nrest\n")
        body = json.dumps({"emission": [1] * 60})
        with Daemon(path, "--token-file", token) as daemon:
            for given in (None, "", "Bearer", "Bearer ", "Bearer s3cret", "Bearer s3cret-tokenx", "Bearer S3cret-token",
                          "Basic s3cret-token", "s3cret-token", "Bearer s3cret-token rest",
                          "Bearer s3cret-tokens3cret-token"):
                headers = {} if given is None else {"Authorization": given}
                for method, route, sent in (("GET", "/v1/scenes", None), ("GET", "/v1/scenes/box", None),
                                            ("GET", "/v1/scenes/none", None), ("POST", "/v1/scenes/box/radiosity", body),
                                            ("GET", "/v1/openapi.json", None)):
                    answer = daemon.ask(method, route, sent, headers)
                    self.assertEqual((answer.status, answer.headers["WWW-Authenticate"]), (401, "Bearer"), (given, route))
                    self.assertEqual(answer.json()["status"], 401)
            for given in "Bearer s3cret-token", "bearer  s3cret-token":
                headers = {"Authorization": given, "Content-Type": "application/json"}
                self.assertEqual(daemon.ask("GET", "/v1/scenes", None, headers).status, 200)
                self.assertEqual(daemon.ask("POST", "/v1/scenes/box/radiosity", body, headers).status, 200)
            for route in "/healthz", "/readyz", "/metrics":
                self.assertEqual(daemon.get(route).status, 200)
        token.write_text("\n")
        self.assertEqual(self.run_once(path, "--token-file", token).returncode, 1)

    def test_access_log(self):
        path, _ = self.store()
        log = self.folder / "access.log"
        with Daemon(path, "--access-log", log) as daemon:
            daemon.get("/healthz")
            daemon.get('/x"y%00')
            daemon.radiosity("box", {"emissions": [[1] * 60] * 3})
            daemon.stop()
        lines = [json.loads(line) for line in log.read_text().splitlines()]
        self.assertEqual([(e["method"], e["path"], e["status"], e["vectors"]) for e in lines],
                         [("GET", "/healthz", 200, 0), ("GET", '/x"y%00', 404, 0),
                          ("POST", "/v1/scenes/box/radiosity", 200, 3)])
        self.assertEqual(len({e["id"] for e in lines}), 3)

    def test_unix_socket(self):
        path, _ = self.store()
        where = self.folder / "socket"
        for _ in range(2):
            daemon = Daemon(path, "--unix", where, listen=None)
            with daemon:
                s = socket.socket(socket.AF_UNIX)
                s.connect(str(where))
                s.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
                self.assertTrue(self.read_all(s).startswith(b"HTTP/1.1 200 "))
                s.close()
            self.assertFalse(where.exists())
            # One left behind by a daemon that was killed is no hindrance.
            left = socket.socket(socket.AF_UNIX)
            left.bind(str(where))
            left.close()


if __name__ == "__main__":
    unittest.main()
