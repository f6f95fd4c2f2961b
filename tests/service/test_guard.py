"""lambertd's defence against bad clients: limits of memory, connections and descriptors; and that others do not feel it."""

import contextlib
import http.client
import json
import os
import pathlib
import re
import resource
import socket
import struct
import threading
import time
import unittest

from daemon import PATIENCE, Daemon
from guard_case import HEAD, MIB, SOLVE, Case, cuts, metrics, read_all, until


def cpu_seconds(daemon):
    fields = pathlib.Path(f"/proc/{daemon.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Guard(Case):
    def test_bodies_of_all_clients_are_bounded_together(self):
        with Daemon(self.box, "--max-body", "4M", "--max-buffered", "4M") as daemon:
            first = daemon.raw()
            whole = b" " * (3 * MIB) + SOLVE
            first.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % len(whole) + whole[: 3 * MIB])
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 3 * MIB)
            # Announced to be longer than what is left: answered before any of it is sent.
            with daemon.raw() as s:
                s.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % (2 * MIB))
                answer = read_all(s)
                self.assertTrue(answer.startswith(b"HTTP/1.1 503 "), answer)
                self.assertIn(b"\r\nRetry-After: 1\r\n", answer)
                self.assertIn(b"--max-buffered", answer)
            # Not announced: counted as it comes. The rest is read and dropped, and the connection goes on.
            connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=PATIENCE, source_address=("127.0.0.2", 0))
            answer = daemon.ask("POST", "/v1/scenes/box/radiosity", iter([b" " * 65536] * 20),
                                {"Content-Type": "application/json"}, connection)
            self.assertEqual((answer.status, answer.headers["Retry-After"]), (503, "1"), answer)
            self.assertEqual(metrics(daemon)[("lambertd_body_bytes",)], 3 * MIB)
            # A request of this client that fits is served meanwhile, on that connection too.
            self.assertEqual(daemon.radiosity("box", SOLVE, connection=connection).status, 200)
            connection.close()
            first.sendall(whole[3 * MIB :])
            self.assertTrue(first.recv(65536).startswith(b"HTTP/1.1 200 "))
            first.close()
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 0)
            # A client that goes in the middle gives back what it held.
            with daemon.raw() as s:
                s.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % (2 * MIB) + b" " * MIB)
                until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == MIB)
            until(lambda: metrics(daemon)[("lambertd_body_bytes",)] == 0)
            self.assertEqual(daemon.radiosity("box", whole).status, 200)

    def test_idle_clients_make_place(self):
        with Daemon(self.box, "--max-connections", 8) as daemon:
            working = daemon.raw()
            working.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % len(SOLVE) + SOLVE[:5])
            idle = [daemon.raw() for _ in range(20)]
            # More than there are places: those behind wait until the first are cut, which then see an end.
            self.serves(daemon)
            self.assertEqual(idle[0].recv(1), b"")
            self.assertGreaterEqual(cuts(daemon, "place"), 1)
            # A client in the middle of a request is not idle.
            working.sendall(SOLVE[5:])
            self.assertTrue(working.recv(65536).startswith(b"HTTP/1.1 200 "))
            for s in working, *idle:
                s.close()
            self.serves(daemon)

    def connect_from(self, daemon, source):
        s = socket.create_connection(("127.0.0.1", daemon.port), timeout=PATIENCE, source_address=(source, 0))
        self.addCleanup(s.close)
        return s

    def test_one_client_has_not_all_connections(self):
        """One address opens connections that are all in the middle of a request, again and again: others are served at once, and
        two that are greedy do not shut out a third."""
        part = HEAD + b"Content-Length: %d\r\n\r\n" % len(SOLVE) + SOLVE[:5]
        whole = HEAD + b"Content-Length: %d\r\n\r\n" % len(SOLVE) + SOLVE
        with Daemon(self.box, "--max-connections", 8, "--timeout", 3600, "--shutdown-timeout", 1) as daemon:
            greedy = [self.connect_from(daemon, "127.0.0.2") for _ in range(60)]
            for s in greedy:
                with contextlib.suppress(OSError):
                    s.sendall(part)
            for source in "127.0.0.3", "127.0.0.4":
                others = [self.connect_from(daemon, source) for _ in range(2)]
                for s in others:
                    s.sendall(whole)
                    self.assertTrue(s.recv(65536).startswith(b"HTTP/1.1 200 "))
            figures = daemon.get("/metrics").body.decode()
            self.assertGreaterEqual(int(re.search(r'cut_total{why="share"} (\d+)', figures).group(1)), 4)
            self.assertLessEqual(int(re.search(r"lambertd_connections (\d+)", figures).group(1)), 8 + 32)

    def test_the_gone_do_not_fill_their_share(self):
        """An address drops requests in their middle, quicker than the check of each second finds them: its other ones are served."""
        part = HEAD + b"Content-Length: %d\r\n\r\n" % len(SOLVE) + SOLVE[:5]
        whole = HEAD + b"Content-Length: %d\r\n\r\n" % len(SOLVE) + SOLVE
        with Daemon(self.box, "--max-connections", 8, "--timeout", 3600) as daemon:
            for _ in range(8 + 16):
                with daemon.raw() as s:
                    s.sendall(part)
            time.sleep(.4)
            mine = [daemon.raw() for _ in range(8)]
            for s in mine:
                s.sendall(whole)
            for s in mine:
                self.assertTrue(s.recv(65536).startswith(b"HTTP/1.1 200 "))
                s.close()
            self.assertEqual(cuts(daemon, "share"), 0)

    def test_connections_are_as_many_as_descriptors_allow(self):
        # 64 are kept for what else is opened, one is of the store.
        with Daemon(self.box, launcher=("prlimit", "--nofile=80:80")) as daemon:
            self.assertEqual(metrics(daemon)[("lambertd_connections_most",)], 15)
            clients = [daemon.raw() for _ in range(40)]
            self.serves(daemon)
            for s in clients:
                s.close()
            self.serves(daemon)

    def open_files(self, daemon):
        return len(os.listdir(f"/proc/{daemon.process.pid}/fd"))

    def test_descriptors_run_out(self):
        with Daemon(self.box, "--timeout", 1) as daemon:
            kept = daemon.connect()
            self.assertEqual(daemon.get("/healthz", connection=kept).status, 200)
            limit = self.open_files(daemon) + 3
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (limit, limit))
            # 3 of them are accepted; the daemon asks in vain for the descriptor of a fourth.
            clients = [daemon.raw() for _ in range(10)]
            until(lambda: self.open_files(daemon) == limit)
            before = cpu_seconds(daemon)
            for s in clients[:3]:
                self.assertEqual(read_all(s), b"")
            # Only a daemon that spins until the clients are cut spends more.
            self.assertLess(cpu_seconds(daemon) - before, 0.5)
            for s in clients:
                s.close()
            kept.close()
            self.serves(daemon)

    def test_one_client_does_not_hold_up_another(self):
        """Large requests of one client, many at a time and pipelined, while another asks small ones."""
        dense = json.dumps({"emissions": [[1] * 20000] * 40}).encode()
        large = (b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nAccept: application/x-npy\r\n"
                 b"Content-Length: %d\r\n\r\n" % len(dense) + dense)
        rounds, streams = 3, 6
        with Daemon(self.box, self.big, "--threads", 1) as daemon:
            done, failures = [], []

            def greedy():
                try:
                    with daemon.raw() as s:
                        sender = threading.Thread(target=s.sendall, args=(large * rounds,))
                        sender.start()
                        stream = s.makefile("rb")
                        for _ in range(rounds):
                            self.assertIn(b" 200 ", stream.readline())
                            while (line := stream.readline()) != b"\r\n":
                                if line.lower().startswith(b"content-length:"):
                                    length = int(line.split(b":")[1])
                            self.assertEqual(len(stream.read(length)), length)
                            done.append(1)
                        sender.join()
                except Exception as failure:
                    failures.append(failure)

            threads = [threading.Thread(target=greedy) for _ in range(streams)]
            for t in threads:
                t.start()
            connection, small = daemon.connect(), 0
            until(lambda: metrics(daemon)[("lambertd_in_flight",)] > 2 or done)
            # A turn each: the small client is served between the large requests, not behind all of them.
            while len(done) < streams * rounds and not failures:
                self.assertEqual(daemon.radiosity("box", SOLVE, connection=connection).status, 200)
                small += 1
            for t in threads:
                t.join()
            connection.close()
            self.assertEqual(failures, [])
            self.assertGreater(small, streams * rounds)

    def test_clients_that_reset_while_they_wait(self):
        body = json.dumps({"emissions": [[1] * 20000] * 20}).encode()
        whole = (b"POST /v1/scenes/big/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nAccept: application/x-npy\r\n"
                 b"Content-Length: %d\r\n\r\n" % len(body) + body)
        with Daemon(self.box, self.big, "--threads", 1) as daemon:
            for _ in range(10):
                s = daemon.raw()
                s.sendall(whole)
                s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                s.close()
            self.serves(daemon)
            until(lambda: metrics(daemon)[("lambertd_in_flight",)] == 1)
            until(lambda: metrics(daemon)[("lambertd_connections",)] == 1)
            self.assertEqual(metrics(daemon)[("lambertd_body_bytes",)], 0)

    def test_no_file_is_reachable(self):
        secret = self.folder / "secret.txt"
        secret.write_text("root:x:0:0")
        inside = str(secret)[1:].encode()
        with Daemon("--stores", self.folder) as daemon:
            for path in (b"/../../../../../../" + inside, b"/" + inside, b"//" + inside, b"/v1/scenes/../../" + inside,
                         b"/v1/scenes/..%2f..%2f" + inside.replace(b"/", b"%2f"), b"/v1/scenes/%2e%2e/%2e%2e/" + inside,
                         b"/v1/scenes/secret.txt", b"/v1/scenes/box.h5", b"/v1/scenes/%2e%2e%2f" + self.folder.name.encode(),
                         b"/%2e%2e/%2e%2e/etc/passwd", b"/etc/passwd", b"/v1/scenes/box%00", b"/v1/scenes/box%00/../box",
                         b"/v1/scenes/" + b"..%c0%af" * 20, b"/v1/scenes/" + b"a" * 30000, b"/v1/scenes/" + b"%61" * 300,
                         b"/v1/scenes/\x00box", b"/v1/scenes/\\..\\..\\etc", b"file:///etc/passwd",
                         b"http://127.0.0.1/etc/passwd", b"/metrics/../etc/passwd"):
                with self.subTest(path=path[:80]), daemon.raw() as s:
                    s.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                    answer = read_all(s)
                    if b"\x00" in path and answer == b"":
                        continue # newer versions of libmicrohttpd close such a connection
                    self.assertRegex(answer[:13], rb"^HTTP/1\.1 (400|404|414|431|501)", answer[:200])
                    self.assertNotIn(b"root:x", answer)
            # These are the page of the viewer, whatever they say beside.
            for path in b"/\x00", b"/?file=/etc/passwd":
                with daemon.raw() as s:
                    s.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                    answer = read_all(s)
                    if b"\x00" in path and answer == b"":
                        continue
                    self.assertRegex(answer, rb"^HTTP/1\.1 (200|400|404) ")
                    self.assertNotIn(b"root:x", answer)
            self.serves(daemon)


if __name__ == "__main__":
    unittest.main()
