"""Every line of the contract's list of errors, over a real socket; the next request on the same connection works."""

import functools
import json
import pathlib
import tempfile
import unittest
import urllib.parse

import numpy as np

from daemon import Daemon, npy
from make_store import Scene

N = 60
MAX_BODY = 100_000


def header(text, data=b"", version=1, length=None):
    raw = text.encode()
    length = len(raw) if length is None else length
    return b"\x93NUMPY" + bytes([version, 0]) + length.to_bytes(2 if version == 1 else 4, "little") + raw + data


class Errors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        cls.grey = Scene(N).write(path / "grey.h5", "grey")
        cls.colour = Scene(N, channels=3).write(path / "colour.h5", "colour")
        Scene(N).write(path / "sky.h5", "sky", sky=4)
        Scene(N, channels=3).write(path / "dusk.h5", "dusk", sky=4)
        cls.daemon = Daemon("--stores", path, "--max-body", MAX_BODY, "--max-batch", 8)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)
        cls.right = cls.daemon.radiosity("grey", {"emission": [1] * N}).json()["radiosity"]

    def setUp(self):
        self.connection = self.daemon.connect()
        self.addCleanup(self.connection.close)

    def still_works(self):
        """On the connection that was just refused something."""
        answer = self.daemon.radiosity("grey", {"emission": [1] * N}, connection=self.connection)
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(answer.json()["radiosity"], self.right)

    def problem(self, answer, status, *words, pointer=None):
        self.assertEqual(answer.status, status, answer)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        what = answer.json()
        self.assertEqual(what["status"], status)
        self.assertTrue(what["title"])
        self.assertRegex(what["type"], r"^deploy/docs/api\.md#[a-z-]+$")
        self.assertNotIn("\n", what["detail"])
        for word in words:
            self.assertIn(str(word), what["detail"])
        if pointer is not None:
            self.assertEqual(what.get("pointer"), pointer)
        return what

    def test_classes(self):
        """A problem's type is that of its class, whatever else it says."""
        dense = [1] * N
        for body, name in (
                ("{", "not-json"), ({"emission": dense, "x": 1}, "wrong-members"), ({}, "wrong-members"), ([], "wrong-kind"),
                ({"emission": 7}, "wrong-kind"), ({"emission": dense[1:]}, "wrong-length"),
                ({"emissions": []}, "wrong-length"), ({"emission": [1e39] * N}, "bad-value"),
                ({"emission": {"elements": [N], "values": [1]}}, "bad-index"),
                ({"emission": {"elements": [1, 1], "values": [1, 1]}}, "given-twice"),
                ({"emission": {"groups": {"lava": 1}}}, "unknown-group"),
                ({"emission": dense, "select": {"groups": ["lava"]}}, "unknown-group"),
                ({"emission": dense, "quantity": "heat"}, "unknown-word"),
                ({"emission": {"emitters": [1]}}, "not-in-store"), ({"emission": [3e38] * N}, "not-in-encoding")):
            answer = self.daemon.radiosity("grey", body, connection=self.connection)
            self.assertEqual(answer.json()["type"], f"deploy/docs/api.md#{name}", (body, answer))
        self.assertEqual(self.daemon.get("/v1/scenes/lava").json()["type"], "deploy/docs/api.md#not-found")

    def refuse(self, body, status, *words, pointer=None, name="grey", **more):
        with self.subTest(body=body if len(str(body)) < 200 else str(body)[:200], name=name):
            answer = self.daemon.radiosity(name, body, connection=self.connection, **more)
            self.problem(answer, status, *words, pointer=pointer)
            self.still_works()

    def refuse_npy(self, body, status, *words, **more):
        self.refuse(body, status, *words, kind="application/x-npy", **more)

    def test_not_json(self):
        whole = json.dumps({"emission": [1] * N})
        for body in (
            "", " ", "{", "}", "null x", '{"emission":[1,2', whole + "x", whole + whole, "\ufeff\ufeff" + whole, "\ufeff",
            "{'emission':[1]}", '{"emission":[1,]}', '{"emission":[01]}', '{"emission":[+1]}', '{"emission":[.5]}',
            '{"emission":[1.]}', '{"emission":[1e]}', '{"emission":[0x10]}', '{"emission" [1]}', '{"emission":[1 2]}',
            '{"emission":[1],}', '{emission:[1]}', '// no\n{}', "[" * 100_000, '{"a":' * 10_000,
        ):
            self.refuse(body.encode(), 400, "not JSON")
        for body in b'{"emission":[1]}\x00', b'{"\xff":1}', b'{"\xed\xa0\x80":1}', b'{"a\x01":1}', b"\x00", b"\xff\xfe{\x00":
            self.refuse(body, 400, "not JSON")
        # The place counts the bytes of the mark.
        self.refuse(b"\xef\xbb\xbf{x", 400, "at byte 4")

    def test_byte_order_marks(self):
        """PowerShell and editors put one before UTF-8, which changes nothing; other encodings are named."""
        for path, whole in (("grey/radiosity", {"emission": [1] * N}), ("grey/adjoint", {"cotangent": [1] * N, "gradient": ["emission"]})):
            text = json.dumps(whole)
            plain, marked = (self.daemon.post(f"/v1/scenes/{path}", mark + text.encode()).json() | {"time_ms": None}
                             for mark in (b"", b"\xef\xbb\xbf"))
            self.assertEqual(plain, marked)
            self.assertIn("scene", plain)
            for coding in "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-32-be":
                answer = self.daemon.post(f"/v1/scenes/{path}", text.encode(coding), kind=f"application/json; charset={coding}")
                self.problem(answer, 400, "UTF-16 or UTF-32")

    def test_nan_and_infinity(self):
        for value in "NaN", "Infinity", "-Infinity", "nan", "inf":
            body = json.dumps({"emission": [1] * N}).replace("1", value, 1)
            self.refuse(body, 400, "not JSON")
        self.refuse('{"emission":[NaN]}', 400, "NaN")

    def test_a_fault_in_the_grammar_is_told_before_one_in_the_meaning(self):
        self.refuse('{"emission":[-1, 2', 400, "not JSON")
        self.refuse('{"quantity":"heat","emission":[1]} x', 400, "not JSON")

    def test_no_such_route(self):
        for path in ("/nothing", "/viewer", "/v1", "/v1/", "/v1/scenes/", "/v1/scenes/grey/", "/v1/scenes/grey/mesh/", "//",
                     "/v1/scenes/grey/light", "/v1/scenes//radiosity", "/v1/scenes/grey/radiosity/x", "/../etc/passwd",
                     "/healthz/", "/%00", "/v1/%73cenes"):
            for method in "GET", "POST":
                answer = self.daemon.ask(method, path, "{}" if method == "POST" else None, connection=self.connection)
                self.problem(answer, 404)
                self.still_works()

    def test_no_such_scene(self):
        self.problem(self.daemon.post("/v1/scenes/none/adjoint", "{}"), 404)
        for name in "none", "grey%00", "grey%2f..", "grey@red", "%", "%zz", "x" * 3000, "%ff%fe", "..":
            self.problem(self.daemon.get(f"/v1/scenes/{name}", connection=self.connection), 404, "no scene")
            answer = self.daemon.post(f"/v1/scenes/{name}/radiosity", "not looked at", kind="text/plain",
                                      connection=self.connection)
            self.problem(answer, 404, "no scene")
            self.still_works()

    def test_types_lead_to_the_manual(self):
        """From any path, without a token, and by the same text."""
        for path in "/none", "/v1/none", "/v1/scenes/none", "/v1/scenes/grey/none", "/v1/scenes/none/radiosity", "/v1/a/b/c/d/":
            kind = self.daemon.post(path, "{}").json()["type"]
            manual, _, name = urllib.parse.urljoin(path, kind).partition("#")
            answer = self.daemon.get(manual)
            self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "text/plain; charset=utf-8"))
            self.assertIn(f"\n### {name}\n", answer.body.decode())
            self.assertEqual(self.daemon.get(manual, headers={"If-None-Match": answer.headers["ETag"]}).status, 304)
            self.problem(self.daemon.ask("PUT", manual, "{}"), 405)
        self.problem(self.daemon.get("/v1/scenes/xdeploy/docs/api.md"), 404)

    def test_method(self):
        for path, method, allow in (
            ("/v1/scenes", "POST", "GET, HEAD"),
            ("/v1/scenes/grey", "DELETE", "GET, HEAD"),
            ("/v1/scenes/grey/radiosity", "GET", "POST"),
            ("/v1/scenes/none/radiosity", "GET", "POST"),
            ("/v1/scenes/grey/radiosity", "PUT", "POST"),
            ("/v1/scenes/grey/radiosity", "HEAD", "POST"),
            ("/v1/scenes/grey/adjoint", "GET", "POST"),
            ("/v1/scenes/grey/reflectance", "GET", "PUT, DELETE"),
            ("/healthz", "POST", "GET, HEAD"),
            ("/metrics", "TRACE", "GET, HEAD"),
            ("/v1/openapi.json", "PATCH", "GET, HEAD"),
            ("/readyz", "BREW", "GET, HEAD"),
        ):
            with self.subTest(path=path, method=method):
                answer = self.daemon.ask(method, path, connection=self.connection)
                self.assertEqual(answer.headers["Allow"], allow)
                if method == "HEAD":
                    self.assertEqual((answer.status, answer.body), (405, b""))
                else:
                    self.problem(answer, 405, method, allow)
                self.still_works()

    def test_options(self):
        """The check of HAProxy, as it comes without arguments, and those of others."""
        read = "GET, HEAD"
        for target, allow in (("*", "GET, HEAD, POST, PUT, DELETE"), ("/", read), ("/healthz", read), ("/readyz", read), ("/metrics", read),
                              ("/v1/scenes/grey/radiosity", "POST"), ("/v1/scenes/grey/reflectance", "PUT, DELETE")):
            for version, host in (("1.0", ""), ("1.1", "Host: localhost\r\n")) + ((("1.1", "Host: any\r\n"),) if target == "*" else ()):
                with self.subTest(target=target, host=host), self.daemon.raw() as s:
                    s.sendall(f"OPTIONS {target} HTTP/{version}\r\n{host}Connection: close\r\n\r\n".encode())
                    head, _, body = self.read_all(s).partition(b"\r\n\r\n")
                    self.assertIn(b" 204 ", head.splitlines()[0])
                    self.assertIn(f"\r\nAllow: {allow}, OPTIONS".encode(), head)
                    self.assertEqual(body, b"")
        self.problem(self.daemon.ask("OPTIONS", "/v1/none"), 404, "no such route")
        with self.daemon.raw() as s:
            s.sendall(b"GET * HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            self.assertIn(b" 404 ", self.read_all(s).splitlines()[0])

    def test_type(self):
        for kind in "text/plain", "application/x-www-form-urlencoded", "application/jsonx", "application/octet-stream", "":
            self.refuse("not looked at", 415, "Content-Type", kind=kind)
        self.refuse(b"\x1f\x8b", 415, "Content-Encoding", headers={"Content-Encoding": "gzip"})

    def test_body_over_the_limit(self):
        fits = json.dumps({"emission": [1] * N}).ljust(MAX_BODY)
        self.assertEqual(self.daemon.radiosity("grey", fits, connection=self.connection).status, 200)
        self.refuse(fits + " ", 413, MAX_BODY)
        self.refuse(" " * (1 << 20), 413, MAX_BODY)

    def test_a_length_over_the_limit_is_refused_before_the_body_is_sent(self):
        for length in 10**8, 10**15, 2**64 - 1:
            with self.daemon.raw() as s:
                s.sendall(b"POST /v1/scenes/grey/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                          b"Content-Length: %d\r\n\r\n" % length)
                self.assertIn(b" 413 ", self.read_all(s).split(b"\r\n")[0])
        self.still_works()

    def test_expect_is_answered_before_the_body_is_sent(self):
        for length, wanted in (MAX_BODY + 1, b" 413 "), (10, b" 100 "):
            with self.daemon.raw() as s:
                s.sendall(b"POST /v1/scenes/grey/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                          b"Expect: 100-continue\r\nContent-Length: %d\r\n\r\n" % length)
                self.assertIn(wanted, s.recv(65536).split(b"\r\n")[0])
        self.still_works()

    def test_chunked_bodies_are_counted(self):
        def chunks(total, size=5000):
            for at in range(0, total, size):
                yield b" " * min(size, total - at)

        body = json.dumps({"emission": [1] * N}).encode()

        def fitting():
            yield body
            yield from chunks(MAX_BODY - len(body))

        path, kind = "/v1/scenes/grey/radiosity", {"Content-Type": "application/json", "Transfer-Encoding": "chunked"}
        self.connection.request("POST", path, fitting(), kind, encode_chunked=True)
        response = self.connection.getresponse()
        self.assertEqual(json.loads(response.read())["radiosity"], self.right)
        self.connection.request("POST", path, chunks(MAX_BODY + 1), kind, encode_chunked=True)
        response = self.connection.getresponse()
        self.assertEqual(response.status, 413)
        self.assertEqual(json.loads(response.read())["status"], 413)
        self.still_works()

    def test_a_chunked_body_without_end_is_cut(self):
        """Beyond --max-body and 64 MiB the answer comes in the middle of the body, and its client may send on for a while;
        one without any end is cut."""
        head = (b"POST /v1/scenes/grey/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                b"X-Request-Id: long\r\nTransfer-Encoding: chunked\r\n\r\n")
        piece = b"40000\r\n" + b" " * 0x40000 + b"\r\n"
        with self.daemon.raw() as s:
            s.sendall(head)
            for _ in range(400):  # 100 MiB
                s.sendall(piece)
            s.sendall(b"0\r\n\r\n")
            answer = b""
            while part := s.recv(65536):
                answer += part
        told, _, body = answer.partition(b"\r\n\r\n")
        self.assertTrue(told.startswith(b"HTTP/1.1 413 "), told)
        self.assertIn(b"Connection: close", told)
        self.assertIn(b"X-Request-Id: long", told)
        self.assertEqual(int(told.split(b"Content-Length: ")[1].split()[0]), len(body))
        self.assertIn("--max-body", json.loads(body)["detail"])
        with self.daemon.raw() as s:
            s.sendall(head)
            with self.assertRaises(OSError):
                for _ in range(6_000):  # 1.5 GiB
                    s.sendall(piece)
        self.still_works()

    def test_wrong_length(self):
        for count in 0, 1, N - 1, N + 1, 2 * N:
            pointer = "/emission"
            self.refuse({"emission": [1] * count}, 422, N, pointer=pointer)
            self.refuse({"emissions": [[1] * N, [1] * count]}, 422, N, pointer="/emissions/1")
        self.refuse({"emission": [[1] * N] * 2}, 422, "row", pointer="/emission")
        self.refuse({"emission": [[1] * N] * 2}, 422, "2 rows", "3", pointer="/emission", name="colour")
        self.refuse({"emission": [[1] * N] * 4}, 422, "3 rows", pointer="/emission", name="colour")
        self.refuse({"emission": [[1] * N, [1] * N, [1] * 2]}, 422, N, pointer="/emission/2", name="colour")
        self.refuse({"emission": [[]]}, 422, N, pointer="/emission/0")

    def test_numbers(self):
        def dense(text):
            return '{"emission":[' + "1," * 7 + text + ",1" * (N - 8) + "]}"

        for text in "1e999", "-1e999", "1" + "0" * 400, "1e39", "3.5e38":
            self.refuse(dense(text), 422, "emission/7", text[:40], pointer="/emission/7")
        for body, pointer in (
            ('{"emission":{"elements":[3,4],"values":[1,1e999]}}', "/emission/values/1"),
            ('{"emission":{"groups":{"lamp":-1e999}}}', "/emission/groups/lamp"),
            ('{"emissions":[{"groups":{"lamp":1}},{"groups":{"lamp":1e999}}]}', "/emissions/1/groups/lamp"),
        ):
            self.refuse(body, 422, pointer=pointer)
        self.refuse('{"emission":{"groups":{"lamp":[1,2,-3e99]}}}', 422, "-3e99", name="colour",
                    pointer="/emission/groups/lamp/2")
        # These are no errors: zero below zero, and numbers too small for single precision.
        for text in "-0", "-0.0", "-0e5", "1e-999", "1e-60":
            answer = self.daemon.radiosity("grey", dense(text), connection=self.connection)
            self.assertEqual(answer.status, 200, answer)

    def test_an_answer_beyond_single_precision(self):
        body = '{"emission":[' + ",".join(["3.4e38"] * N) + "]}"
        self.refuse(body, 422, "single precision")
        body = {"emission": [60000] * N}
        self.refuse(body, 422, "half precision", accept="application/x-npy;dtype=f2")

    def test_elements(self):
        for index in N, -1, 1.5, 1e300, 2**64:
            self.refuse({"emission": {"elements": [0, index], "values": [1, 1]}}, 422, pointer="/emission/elements/1")
            self.refuse({"emission": [1] * N, "select": {"elements": [0, index]}}, 422, pointer="/select/elements/1")
        self.refuse({"emission": {"elements": [N], "values": [1]}}, 422, f"= {N}", N - 1)
        self.refuse({"emission": {"elements": [5, 3, 5], "values": [1, 1, 1]}}, 422, "5", pointer="/emission/elements/2")
        self.refuse({"emission": {"elements": [1, 2], "values": [1]}}, 422, "2 elements", "1 values", pointer="/emission")
        self.refuse({"emission": {"elements": [1], "values": [1, 2]}}, 422, pointer="/emission")
        self.refuse({"emission": {"elements": [1]}}, 422, "values", pointer="/emission")
        self.refuse({"emission": {"values": [1]}}, 422, pointer="/emission")
        self.refuse({"emission": {"elements": [1], "values": [1] * (N + 1)}}, 422, pointer="/emission/values")
        self.refuse({"emission": {"elements": [1], "values": [[1, 2]]}}, 422, pointer="/emission/values/0")
        self.refuse({"emission": {"elements": [1], "values": [[1, 2]]}}, 422, name="colour",
                    pointer="/emission/values/0")

    def test_groups(self):
        self.refuse({"emission": {"groups": {"nobody": 1}}}, 422, "nobody", pointer="/emission/groups/nobody")
        self.refuse({"emission": {"groups": {"lam": 1}}}, 422, "lam")
        self.refuse({"emission": {"groups": {"box.": 1}}}, 422)
        self.refuse({"emission": {"groups": {"": 1}}}, 422)
        self.refuse({"emission": {"groups": {"a/b~c": 1}}}, 422, pointer="/emission/groups/a~1b~0c")
        self.refuse({"emission": {"groups": {"box": 1, "box.red": 1}}}, 422, "box.red", "twice")
        self.refuse('{"emission":{"groups":{"lamp":1,"lamp":2}}}', 422, "lamp", "twice")
        self.refuse({"emission": [1] * N, "select": {"groups": ["floor", "nobody"]}}, 422, "nobody",
                    pointer="/select/groups/1")
        self.refuse({"emission": [1] * N, "select": {"groups": ["floor", "x" * 5000]}}, 422)

    def test_a_nul_in_a_key(self):
        for body in ('{"emission\\u0000":[1]}', '{"emission":{"groups":{"lamp\\u0000":1}}}',
                     '{"emission":{"\\u0000":1}}', '{"emission":[],"select":{"elements\\u0000":[1]}}'):
            if "[]" in body:
                body = body.replace("[]", json.dumps([1] * N))
            self.refuse(body, 422, "NUL")

    def test_members(self):
        good = [1] * N
        for body, pointer in (
            ({}, None),
            ({"select": {"elements": [1]}}, None),
            ({"emission": good, "emissions": [good]}, None),
            ({"emissions": []}, "/emissions"),
            ({"emissions": [good] * 9}, "/emissions/8"),
            ({"emission": good, "quantity": "heat"}, "/quantity"),
            ({"emission": good, "quantity": ""}, "/quantity"),
            ({"emission": good, "quantity": "Radiosity"}, "/quantity"),
            ({"emission": good, "tolerence": 1}, "/tolerence"),
            ({"emission": good, "select": {}}, "/select"),
            ({"emission": good, "select": {"elements": [1], "groups": ["lamp"]}}, "/select"),
            ({"emission": good, "select": {"elements": [0] * (N + 1)}}, f"/select/elements/{N}"),
            ({"emission": good, "select": {"groups": ["lamp", "floor", "wall", "box"] * 2}}, "/select/groups/4"),
            ({"emission": {}}, "/emission"),
            ({"emission": {"elements": [1], "values": [1], "groups": {"lamp": 1}}}, "/emission"),
        ):
            self.refuse(body, 422, pointer=pointer)
        for twice in ('{"emission":%s,"emission":%s}', '{"quantity":"indirect","emission":%s,"quantity":"radiosity"}'):
            self.refuse(twice.replace("%s", json.dumps(good)), 422, "twice")
        self.refuse('{"emission":{"elements":[1],"elements":[1],"values":[1]}}', 422, "twice")

    def test_members_of_the_wrong_type(self):
        good = [1] * N
        wrong = {"a number": 1, "a text": "x", "true": True, "null": None, "an array": [], "an object": {}}
        for body, pointer, allowed in (
            (lambda v: v, None, {"an object"}),
            (lambda v: {"emission": v}, "/emission", {"an array", "an object"}),
            (lambda v: {"emission": [1] * 3 + [v] + [1] * (N - 4)}, "/emission/3", {"a number"}),
            (lambda v: {"emissions": v}, "/emissions", {"an array"}),
            (lambda v: {"emissions": [good, v]}, "/emissions/1", {"an array", "an object"}),
            (lambda v: {"emission": good, "quantity": v}, "/quantity", {"a text"}),
            (lambda v: {"emission": good, "select": v}, "/select", {"an object"}),
            (lambda v: {"emission": good, "select": {"elements": v}}, "/select/elements", {"an array"}),
            (lambda v: {"emission": good, "select": {"elements": [v]}}, "/select/elements/0", {"a number"}),
            (lambda v: {"emission": good, "select": {"groups": v}}, "/select/groups", {"an array"}),
            (lambda v: {"emission": good, "select": {"groups": [v]}}, "/select/groups/0", {"a text"}),
            (lambda v: {"emission": {"groups": v}}, "/emission/groups", {"an object"}),
            (lambda v: {"emission": {"groups": {"lamp": v}}}, "/emission/groups/lamp", {"a number", "an array"}),
            (lambda v: {"emission": {"elements": v, "values": [1]}}, "/emission/elements", {"an array"}),
            (lambda v: {"emission": {"elements": [v], "values": [1]}}, "/emission/elements/0", {"a number"}),
            (lambda v: {"emission": {"elements": [1], "values": v}}, "/emission/values", {"an array"}),
            (lambda v: {"emission": {"elements": [1], "values": [v]}}, "/emission/values/0", {"a number", "an array"}),
        ):
            for what, value in wrong.items():
                if what not in allowed:
                    self.refuse(json.dumps(body(value)), 422, pointer=pointer)

    def test_sky_and_emitters(self):
        self.refuse({"emission": {"sky": [1]}}, 422, "no sky", pointer="/emission/sky")
        self.refuse({"emission": {"emitters": [1]}}, 422, "no precomputed emitters", pointer="/emission/emitters")

    def test_skies_that_are_wrong(self):
        refuse = functools.partial(self.refuse, name="sky")
        at = "/emission/sky"
        refuse({"emission": {"sky": [1] * 3}}, 422, "holds 3 values, must be 4", "tile", pointer=at)
        refuse({"emission": {"sky": [1] * 5}}, 422, "more than 4 values", pointer=at)
        refuse({"emission": {"sky": []}}, 422, "holds 0 values", pointer=at)
        refuse({"emission": {"sky": [1, 2, -3, 4]}}, 422, "-3", "negative", pointer=at + "/2")
        refuse({"emission": {"sky": [1, 2, 3, [4, 5]]}}, 422, "channel", pointer=at + "/3")
        refuse({"emission": {"sky": [1, [], 3, 4]}}, 422, "channel", pointer=at + "/1")
        refuse('{"emission":{"sky":[1,2,3,1e39]}}', 422, "1e39", pointer=at + "/3")
        refuse('{"emission":{"sky":[1,2,3,NaN]}}', 400)
        refuse('{"emission":{"sky":[1,2,3,4],"sky":[1,2,3,4]}}', 422, "twice", pointer=at)
        for value in (None, True, 7, "blue", {}):
            refuse({"emission": {"sky": value}}, 422, "array", pointer=at)
            refuse({"emission": {"sky": [1, 2, 3, value if value != 7 else "x"]}}, 422, "number", pointer=at + "/3")
        refuse({"emission": {}}, 422, "or a sky", pointer="/emission")
        refuse({"emission": {"sky": [1] * 4, "values": [1]}}, 422, "both elements and values", pointer="/emission")
        refuse({"emission": {"sky": [1] * 4, "groups": {}, "elements": [1], "values": [1]}}, 422, "either")
        refuse({"emission": {"sky": [1] * 4, "emitters": [1]}}, 422, "no precomputed emitters")
        refuse({"emissions": [[1] * N, {"sky": [1] * 3}]}, 422, "must be 4", pointer="/emissions/1/sky")
        self.refuse({"emission": {"sky": [1, 2, 3, [4, 5]]}}, 422, "must be 3", name="dusk", pointer=at + "/3")
        self.refuse({"emission": {"sky": [1, 2, 3, [4, 5, -6]]}}, 422, "-6", name="dusk", pointer=at + "/3/2")

    def test_npy_that_is_not(self):
        good = npy(np.ones(N, "<f4"))
        for body in (b"", b"x", good[:5], good[:9], good[:60], b"\x93NUMPX" + good[6:], b'{"emission":[1]}',
                     good[:6] + b"\x04\x00" + good[8:], good[:6] + b"\x01\x01" + good[8:],
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (60,), }", length=60000),
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (60,), }", length=2**32 - 1, version=2),
                     header("{'descr': '<f4', 'fortran_order': False}"),
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (60,), 'x': 1}"),
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (60), }"),
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (-60,), }"),
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (60L,), }"),
                     header("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (60,), }"),
                     header("{'descr': '<f4', 'fortran_order': 0, 'shape': (60,), }"),
                     header("{'descr': '<f4', 'fortran_order': False, 'shape': (%s,), }" % ("9" * 30)),
                     header("__import__('os').system('true')"), header("{" * 200), header("")):
            self.refuse_npy(body, 400, "NPY")

    def test_npy_types_and_shapes(self):
        orders = {"<": "little-endian", ">": "big-endian", "|": "without a byte order"}
        for dtype in "<f2", ">f4", ">f8", "<i4", "<c8", "|b1", "<U3":
            self.refuse_npy(npy(np.ones(N).astype(dtype)), 422, f"{dtype} ({orders[dtype[0]]})")
        self.refuse_npy(npy(np.ones((4, N - 1), "<f4", order="F")), 422, "shape")
        for shape in (), (N - 1,), (N + 1,), (N, 1), (1, 1, 1, N), (2, 2, N), (0,), (1, 0, N):
            self.refuse_npy(npy(np.ones(shape, "<f4")), 422, "shape")
        for shape in (2, N), (1, N), (2, N, 3), (3, N - 1):
            self.refuse_npy(npy(np.ones(shape, "<f4")), 422, "shape", name="colour")
        self.refuse_npy(npy(np.ones((0, N), "<f4")), 422, "empty")
        self.refuse_npy(npy(np.ones((9, N), "<f4")), 422, "8")
        self.refuse_npy(header("{'descr': '<f4', 'fortran_order': False, 'shape': (%d, 60), }" % (2**62 + 1)), 422)

    def test_npy_lengths(self):
        good = npy(np.ones(N, "<f4"))
        for body in good[:-1], good + b"\0", good[: -4 * N]:
            self.refuse_npy(body, 422, "bytes")

    def test_npy_values(self):
        for value, words in (np.nan, "NaN"), (np.inf, "inf"), (-np.inf, "-inf"), (1e39, "1e+39"):
            for dtype in "<f4", "<f8":
                if value == 1e39 and dtype == "<f4":
                    continue
                E = np.ones((2, N), dtype)
                E[1, 7] = value
                self.refuse_npy(npy(E), 422, f" {N + 7} ", words)

    def test_order(self):
        broken = {"Content-Type": "text/plain"}
        long = b" " * (MAX_BODY + 1)

        def ask(method, path, body, headers):
            return self.daemon.ask(method, path, body, headers, connection=self.connection)

        self.problem(ask("PUT", "/v1/scenes/none/light", long, broken), 404, "route")
        self.problem(ask("PUT", "/v1/scenes/none/radiosity", long, broken), 405)
        self.problem(ask("POST", "/v1/scenes/none/radiosity", long, broken), 404, "scene")
        self.problem(ask("POST", "/v1/scenes/grey/radiosity", long, broken), 415)
        self.problem(ask("POST", "/v1/scenes/grey/radiosity", long, {"Content-Type": "application/json"}), 413)
        self.still_works()

    @staticmethod
    def read_all(s):
        parts = []
        while True:
            part = s.recv(65536)
            if not part:
                return b"".join(parts)
            parts.append(part)


if __name__ == "__main__":
    unittest.main()
