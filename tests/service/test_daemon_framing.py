"""Heads on which readers of one connection could differ: lambertd refuses them and reads nothing that follows. From its
version 1.0 on libmicrohttpd refuses many of them itself, and reads two others as RFC 9112 asks for."""

import ctypes
import ctypes.util
import json
import re
import unittest

from daemon import Daemon
from daemon_case import Case

# Nobody may wait for this long: a test that hangs fails by the patience of its socket.
TIMEOUT = 600

LIBRARY = ctypes.CDLL(ctypes.util.find_library("microhttpd"))
LIBRARY.MHD_get_version.restype = ctypes.c_char_p
BY_LIBRARY = LIBRARY.MHD_get_version() >= b"1"

NEXT = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
LAST = NEXT.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
POST = b"POST /v1/scenes/box/radiosity HTTP/1.1\r\n"


class Framing(Case):
    def setUp(self):
        super().setUp()
        path, _ = self.store()
        daemon = Daemon(path, "--timeout", TIMEOUT)
        self.addCleanup(daemon.__exit__, None, None, None)
        self.daemon = daemon
        self.body = json.dumps({"emission": [1] * 60}).encode()

    def exchange(self, sent):
        """All that the daemon answers until it closes the connection."""
        with self.daemon.raw() as s:
            s.sendall(sent)
            return self.read_all(s)

    def refused(self, sent, status=400, name="malformed-head"):
        """One answer, a problem, and then the end, although a good request follows."""
        for follows in b"", NEXT:
            with self.subTest(sent=sent[:200], follows=follows):
                answer = self.exchange(sent + follows)
                head, _, body = answer.partition(b"\r\n\r\n")
                self.assertEqual(len(re.findall(rb"HTTP/1\.1 \d", answer)), 1, answer)
                self.assertRegex(head.lower(), rb"\r\nconnection: close(\r\n|$)")
                if BY_LIBRARY and body.startswith(b"<html>"):
                    self.assertTrue(head.startswith(b"HTTP/1.1 400 "), answer)
                    continue
                self.assertTrue(head.startswith(b"HTTP/1.1 %d " % status), answer)
                if name is not None:
                    self.assertIn(b"application/problem+json", head)
                    what = json.loads(body)
                    self.assertEqual((what["type"], what["status"]), (f"deploy/docs/api.md#{name}", status))

    def post(self, *fields, host=b"Host: localhost"):
        own = [f for f in (host, b"Content-Type: application/json", *fields) if f is not None]
        return POST + b"\r\n".join(own) + b"\r\n\r\n"

    def chunked(self):
        return b"%x\r\n%s\r\n0\r\n\r\n" % (len(self.body), self.body)

    def test_two_lengths(self):
        n = len(self.body)
        for first, second in (0, n), (n, 0), (n, n):
            self.refused(self.post(b"Content-Length: %d" % first, b"Content-Length: %d" % second) + self.body)
            self.refused(self.post(b"Content-Length: %d" % first, b"content-length: %d" % second) + self.body)

    def test_lines_that_go_on(self):
        for space in b" ", b"\t":
            self.refused(self.post(b"Content-Length: 1\r\n%s2" % space) + self.body)
            self.refused(self.post(b"Transfer-Encoding: chunked\r\n%sx" % space) + self.chunked())
        folded = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n y\r\n\r\n"
        if BY_LIBRARY: # a space stands for the end of the line (RFC 9112, 5.2)
            self.assertEqual(self.exchange(folded + LAST).count(b"HTTP/1.1 200 "), 2)
        else:
            self.refused(folded)

    def test_white_space_in_a_name(self):
        n = len(self.body)
        for space in b" ", b"\t":
            self.refused(self.post(b"Content-Length%s: %d" % (space, n)) + self.body)
            self.refused(self.post(b"Transfer-Encoding%s: chunked" % space, b"Content-Length: %d" % n) + self.body)
            self.refused(self.post(b"X%sY: 1" % space, b"Content-Length: %d" % n) + self.body)
        self.refused(self.post(b"X(Y): 1"))

    def test_a_length_and_a_coding(self):
        for fields in ((b"Transfer-Encoding: chunked", b"Content-Length: 4"),
                       (b"Content-Length: 4", b"Transfer-Encoding: chunked")):
            self.refused(self.post(*fields) + self.chunked())

    def test_other_codings(self):
        """Refused at once: none of these requests has an end that the daemon could wait for."""
        codings = [b"identity", b"xchunked", b"gzip, chunked", b"gzip", b"", b"chunked, chunked", b"chunked;x=1"]
        if BY_LIBRARY: # space behind a value is no part of it (RFC 9112, 5.1)
            request = self.post(b"Transfer-Encoding: chunked ") + self.chunked()
            self.assertEqual(self.exchange(request + LAST).count(b"HTTP/1.1 200 "), 2)
        else:
            codings.append(b"chunked ")
        for coding in codings:
            self.refused(self.post(b"Transfer-Encoding: " + coding), 501, "transfer-coding")
            self.refused(self.post(b"Transfer-Encoding: " + coding) + self.chunked(), 501, "transfer-coding")
        self.refused(self.post(b"Transfer-Encoding: chunked", b"Transfer-Encoding: chunked") + self.chunked())
        self.refused(self.post(b"Transfer-Encoding: chunked", b"Transfer-Encoding: identity") + self.chunked())
        old = self.post(b"Transfer-Encoding: chunked").replace(b"HTTP/1.1", b"HTTP/1.0")
        self.refused(old + self.chunked())

    def test_hosts(self):
        self.refused(b"GET /healthz HTTP/1.1\r\n\r\n")
        self.refused(self.post(b"Content-Length: %d" % len(self.body), host=None) + self.body)
        self.refused(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n")
        self.refused(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nhost: y\r\n\r\n")
        answer = self.exchange(b"GET /healthz HTTP/1.0\r\n\r\n")
        self.assertTrue(answer.startswith(b"HTTP/1.1 200 ") or answer.startswith(b"HTTP/1.0 200 "), answer)

    def test_control_characters_in_a_value(self):
        for byte in b"\x01", b"\r", b"\x0b", b"\x7f":
            self.refused(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: a%sb\r\n\r\n" % byte)

    def test_the_absolute_form(self):
        for target in b"http://host/healthz", b"HTTP://host:8317/healthz", b"https://[::1]:1/healthz?x=/y", b"/healthz", b"http://localhost":
            answer = self.exchange(b"GET %s HTTP/1.1\r\nHost: host\r\nConnection: close\r\n\r\n" % target)
            self.assertTrue(answer.startswith(b"HTTP/1.1 200 "), (target, answer))
        for target in b"http:///healthz", b"http:/healthz", b"//host/healthz":
            answer = self.exchange(b"GET %s HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n" % target)
            self.assertTrue(answer.startswith(b"HTTP/1.1 404 "), (target, answer))

    def test_good_heads_keep_their_connection(self):
        n = len(self.body)
        for request in (self.post(b"Content-Length: %d" % n) + self.body, self.post(b"content-length:%d" % n) + self.body,
                        self.post(b"Transfer-Encoding: chunked") + self.chunked(),
                        self.post(b"transfer-encoding:\t Chunked") + self.chunked(), NEXT,
                        b"GET /healthz HTTP/1.1\r\nHost:\r\nX: \xc3\xa9\ta\r\n\r\n"):
            with self.subTest(request=request[:200]):
                self.assertEqual(self.exchange(request + LAST).count(b"HTTP/1.1 200 "), 2)


if __name__ == "__main__":
    unittest.main()
