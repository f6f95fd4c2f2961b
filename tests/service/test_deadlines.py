"""Solves that nobody waits for any more: their clients went, or their time is over. Their places are free for others."""

import contextlib
import json
import select
import socket
import time
import unittest

from daemon import PATIENCE
from deadlines_case import LONG, N, SHORT, Case, cuts, head, metrics, read_all, refinement, refused, until


class Deadlines(Case):
    def test_clients_that_go_leave_no_work(self):
        """By FIN and by RST, before and in the middle of their iterations."""
        with self.daemon("--max-inflight", 16) as daemon:
            for abrupt in False, True:
                clients = [self.ask(daemon, LONG) for _ in range(4)]
                until(lambda: metrics(daemon)[("lambertd_queued",)] == 4)
                before = refused(daemon, "gone")
                time.sleep(.3)
                for s in clients:
                    if abrupt:
                        s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
                    s.close()
                until(lambda: metrics(daemon)[("lambertd_queued",)] == 0)
                self.assertEqual(refused(daemon, "gone"), before + 4)
                self.serves(daemon)

    def test_a_client_that_only_ends_its_sending(self):
        """It is answered if that is quick, and else told why it is not."""
        with self.daemon() as daemon:
            for body, wanted in ((SHORT.encode(), b"HTTP/1.1 200 "), (LONG, b"HTTP/1.1 503 ")):
                with self.ask(daemon, body, b"Connection: close") as s:
                    s.shutdown(socket.SHUT_WR)
                    answer = read_all(s)
                    self.assertTrue(answer.startswith(wanted), answer[:300])
            self.check_problem(answer, b"ended its sending")

    def test_the_time_of_a_request(self):
        for arguments, fields in (((), [b"Lambert-Timeout: .4"]), (("--request-timeout", 1), []),
                                  (("--request-timeout", 1), [b"Lambert-Timeout: 1000"])):
            with self.daemon(*arguments) as daemon:
                start = time.monotonic()
                with self.ask(daemon, LONG, b"Connection: close", *fields) as s:
                    self.check_problem(read_all(s), b"not ready in time")
                took = time.monotonic() - start
                least = 1 if arguments else .4
                self.assertGreaterEqual(took, least)
                print(f"answered {took - least:.3f} s after its time")
                self.assertEqual(refused(daemon, "deadline"), 1)
                until(lambda: metrics(daemon)[("lambertd_queued",)] == 0)
                self.serves(daemon)

    def test_times_that_are_over_at_once(self):
        """They are told so, whenever the thread that watches connections looks: of 1,000, 1 to 3 were cut without a word."""
        request = b"GET /v1/scenes/box/mesh HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nLambert-Timeout: 1e-9\r\n\r\n"
        with self.daemon() as daemon:
            for _ in range(2000):
                with daemon.raw() as s:
                    s.sendall(request)
                    self.check_problem(read_all(s), b"not ready in time")
            self.assertEqual(cuts(daemon, "deadline"), 0)
            self.serves(daemon)

    def test_a_solve_that_waits_is_answered_in_time(self):
        """Behind refinements, which go on: one pass of these runs at a time."""
        with self.daemon() as daemon, contextlib.closing(self.ask(daemon, LONG)), contextlib.closing(self.ask(daemon, LONG)):
            until(lambda: metrics(daemon)[("lambertd_queued",)] == 2)
            with self.ask(daemon, LONG, b"Connection: close", b"Lambert-Timeout: 0.5") as s:
                self.check_problem(read_all(s), b"not ready in time")
            self.assertEqual(metrics(daemon)[("lambertd_queued",)], 2)

    def test_times_that_are_none(self):
        with self.daemon() as daemon:
            for text in "", "soon", "-1", "0", "nan", "inf", "1 s", "1e99":
                answer = daemon.radiosity("box", SHORT, headers={"Lambert-Timeout": text})
                self.assertEqual(answer.status, 400, text)
                self.assertIn("Lambert-Timeout", answer.json()["detail"])
            self.assertEqual(daemon.radiosity("box", SHORT, headers={"Lambert-Timeout": "30"}).status, 200)

    def test_bodies_and_answers_end_in_time(self):
        body = json.dumps({"emissions": [{"elements": [i % N], "values": [1]} for i in range(8000)]}).encode()
        with self.daemon() as daemon:
            with daemon.raw() as s:
                s.sendall(head(body, b"Lambert-Timeout: .5") + body[:100])
                self.assertEqual(read_all(s), b"")
            self.assertEqual(cuts(daemon, "deadline"), 1)
            # An answer of 50 MB is not read; where it is not made in time, it has more time.
            seconds, late = 3, 0
            while cuts(daemon, "deadline") < 2:
                with self.ask(daemon, body, b"Lambert-Timeout: %d" % seconds):
                    until(lambda: cuts(daemon, "deadline") == 2 or refused(daemon, "deadline") > late)
                late, seconds = refused(daemon, "deadline"), 3 * seconds
            self.serves(daemon)

    def test_refinements_have_a_quarter_of_the_places(self):
        with self.daemon("--max-inflight", 8) as daemon, contextlib.ExitStack() as stack:
            for _ in range(2):
                stack.enter_context(self.ask(daemon, LONG))
            until(lambda: metrics(daemon)[("lambertd_refining",)] == 2)
            answer = daemon.radiosity("box", refinement(1))
            self.assertEqual(answer.status, 503)
            self.assertIn("refinements", answer.json()["detail"])
            self.assertGreaterEqual(int(answer.headers["Retry-After"]), 1)
            self.serves(daemon)
            self.assertEqual(refused(daemon, "refinements"), 1)
            stack.close()
            until(lambda: metrics(daemon)[("lambertd_refining",)] == 0)
            self.assertEqual(daemon.radiosity("box", refinement(1, 1e-3)).status, 200)

    def test_no_client_has_all_places(self):
        """While another comes; a trusted proxy tells them apart. One alone may have all."""
        with self.daemon("--max-inflight", 16, "--trusted-proxy", "127.0.0.1") as daemon, contextlib.ExitStack() as stack:
            def ask(name, body):
                return stack.enter_context(self.ask(daemon, body, b"Connection: close", b"X-Forwarded-For: 192.0.2." + name))

            greedy = [ask(b"1", LONG) for _ in range(4)]
            until(lambda: metrics(daemon)[("lambertd_refining",)] == 4)
            self.check_problem(read_all(ask(b"1", LONG)), b"too many refinements")
            modest = ask(b"2", refinement(1, 1e-3))
            self.assertTrue(read_all(modest).startswith(b"HTTP/1.1 200 "))
            self.assertEqual(refused(daemon, "share"), 1)
            # The one whose body came last.
            told = select.select(greedy, [], [], PATIENCE)[0]
            self.assertEqual(len(told), 1)
            self.check_problem(read_all(told[0]), b"has most of them")


if __name__ == "__main__":
    unittest.main()
