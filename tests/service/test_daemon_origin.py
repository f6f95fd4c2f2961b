"""Hosts that the daemon answers to, and pages in browsers that may ask it."""

import json
import socket
import unittest

from daemon import PATIENCE, Daemon
from daemon_case import Case

JSON = {"Content-Type": "application/json"}
BODY = json.dumps({"emission": [1] * 60})
SOLVE = "/v1/scenes/box/radiosity"


class Origin(Case):
    def refused(self, answer, status, name):
        self.assertEqual(answer.status, status, answer)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        self.assertEqual(answer.json()["type"], f"deploy/docs/api.md#{name}")
        self.assertIsNone(answer.headers["Access-Control-Allow-Origin"])

    def daemon(self, *options, **more):
        path, _ = self.store()
        daemon = Daemon(path, *options, **more)
        self.addCleanup(daemon.__exit__, None, None, None)
        return daemon

    def test_hosts_of_a_loopback(self):
        daemon = self.daemon("--allow-host", "lambert.example", "--allow-host", "other_name")
        for host in ("localhost", "LocalHost:1", f"127.0.0.1:{daemon.port}", "127.0.0.1", "[::1]", "[::1]:80", "lambert.example",
                     "LAMBERT.example:8317", "other_name"):
            self.assertEqual(daemon.get("/v1/scenes", headers={"Host": host}).status, 200, host)
            self.assertEqual(daemon.ask("POST", SOLVE, BODY, {**JSON, "Host": host}).status, 200, host)
        for host in ("evil.example:18901", "localhost.evil.example", "evil.example", "127.0.0.2", "10.0.0.1", "[::2]", "[::1", "[::1]x",
                     "localhost:x", "localhost:80:80", "", ":80", "localhost@evil", "xlocalhost", "localhos", "0.0.0.0"):
            for path in "/v1/scenes", "/v1/openapi.json", "/metrics", "/none", "/v1/scenes/none":
                self.refused(daemon.get(path, headers={"Host": host}), 403, "wrong-host")
            self.refused(daemon.ask("POST", SOLVE, BODY, {**JSON, "Host": host}), 403, "wrong-host")
            for path in "/healthz", "/readyz":
                self.assertEqual(daemon.get(path, headers={"Host": host}).status, 200)
        self.assertEqual(daemon.errors(), "")

    def test_the_host_of_an_absolute_target(self):
        daemon = self.daemon()
        for target, host, status in (("http://localhost/v1/scenes", "localhost", b"200"), ("http://localhost:7/v1/scenes", "evil", b"200"),
                                     ("http://evil/v1/scenes", "localhost", b"403"), ("http://evil/healthz", "evil", b"200")):
            with daemon.raw() as s:
                s.sendall(f"GET {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
                self.assertEqual(self.read_all(s).split()[1], status, target)

    def test_an_old_client_without_a_host(self):
        with self.daemon().raw() as s:
            s.sendall(b"GET /v1/scenes HTTP/1.0\r\n\r\n")
            self.assertIn(b" 200 ", self.read_all(s)[:15])

    def test_hosts_of_a_unix_socket(self):
        where = self.folder / "socket"
        daemon = self.daemon("--unix", where, listen=None)
        named = self.folder / "named"
        strict = self.daemon("--unix", named, "--allow-host", "app.example", listen=None)
        for path, hosts, status in ((where, ("localhost", "unix", "app.example", "app.example:80", "", "unix:" + str(where)), b"200"),
                                    (named, ("localhost", "app.example"), b"200"), (named, ("evil.example", ""), b"403")):
            for host in hosts:
                with socket.socket(socket.AF_UNIX) as s:
                    s.settimeout(PATIENCE)
                    s.connect(str(path))
                    s.sendall(f"GET /v1/scenes HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
                    self.assertEqual(self.read_all(s).split()[1], status, (path, host))
        self.assertEqual(daemon.errors() + strict.errors(), "")

    def test_hosts_of_a_wildcard_address(self):
        token = self.folder / "token"
        token.touch(0o600)
        token.write_text("secret\n")
        for options, names, warnings in ((), 200, 2), (("--allow-host", "a.example"), 403, 1), (("--token-file", token), 401, 1):
            daemon = self.daemon(*options, listen="0.0.0.0:0", ready=False)
            daemon.wait_for("listening on http://0.0.0.0:")
            daemon.port = int(daemon.output().split("http://0.0.0.0:")[1].split()[0])
            self.assertEqual(daemon.get("/v1/scenes", headers={"Host": "evil.example"}).status, names)
            for host in "127.0.0.1", "10.1.2.3:8317", "[fe80::1]", "localhost":
                self.assertIn(daemon.get("/metrics", headers={"Host": host}).status, (200,), host)
            lines = daemon.errors().splitlines()
            self.assertEqual(len(lines), warnings, lines)
            self.assertTrue(all("0.0.0.0" in line and "--" in line for line in lines), lines)

    def test_pages_of_other_origins(self):
        daemon = self.daemon()
        own = {"Host": "localhost:7"}
        for origin in ("http://evil.example", "null", "http://localhost:3000", "http://localhost", "https://localhost:70", "localhost:7",
                       "", "http://", "http://127.0.0.1:7"):
            for method, path, body in ("GET", "/v1/scenes", None), ("POST", SOLVE, BODY), ("GET", "/metrics", None), ("OPTIONS", SOLVE, None):
                answer = daemon.ask(method, path, body, {**own, **(JSON if body else {}), "Origin": origin})
                self.refused(answer, 403, "wrong-origin")
            self.assertEqual(daemon.get("/healthz", headers={**own, "Origin": origin}).status, 200)
        for origin in "http://localhost:7", "https://LOCALHOST:7":
            answer = daemon.ask("POST", SOLVE, BODY, {**own, **JSON, "Origin": origin, "Sec-Fetch-Site": "same-origin"})
            self.assertEqual(answer.status, 200)
            self.assertIsNone(answer.headers["Access-Control-Allow-Origin"])
        for site in "cross-site", "same-site", "Cross-Site":
            self.refused(daemon.get("/v1/scenes", headers={"Sec-Fetch-Site": site}), 403, "wrong-origin")
            self.refused(daemon.ask("POST", SOLVE, BODY, {**JSON, "Sec-Fetch-Site": site}), 403, "wrong-origin")
            self.assertEqual(daemon.get("/metrics", headers={"Sec-Fetch-Site": site}).status, 200)
        # The page of the daemon behind a proxy that writes a Host of its own, as nginx does where nothing else is said.
        behind = {**own, **JSON, "Origin": "https://public.example"}
        self.assertEqual(daemon.ask("POST", SOLVE, BODY, {**behind, "Sec-Fetch-Site": "same-origin"}).status, 200)
        for site in "none", "cross-site", "":
            self.refused(daemon.ask("POST", SOLVE, BODY, {**behind, "Sec-Fetch-Site": site}), 403, "wrong-origin")
        rebound = {**behind, "Host": "evil.example", "Sec-Fetch-Site": "same-origin"}
        self.refused(daemon.ask("POST", SOLVE, BODY, rebound), 403, "wrong-host")
        for site in "none", "same-origin":
            self.assertEqual(daemon.get("/v1/scenes", headers={"Sec-Fetch-Site": site}).status, 200)

    def test_pages_that_are_allowed(self):
        token = self.folder / "token"
        token.touch(0o600)
        token.write_text("secret\n")
        daemon = self.daemon("--allow-origin", "https://app.example", "--allow-origin", "http://localhost:3000", "--token-file", token)
        page = {"Origin": "http://localhost:3000", "Sec-Fetch-Site": "same-site"}
        bearer = {"Authorization": "Bearer secret"}
        for headers, status in (bearer, 200), ({}, 401):
            answer = daemon.ask("POST", SOLVE, BODY, {**JSON, **page, **headers})
            self.assertEqual(answer.status, status)
            self.assertEqual(answer.headers["Access-Control-Allow-Origin"], "http://localhost:3000")
            self.assertIn("X-Request-Id", answer.headers["Access-Control-Expose-Headers"])
            self.assertIn("Server-Timing", answer.headers["Access-Control-Expose-Headers"])
            self.assertEqual(answer.headers["Timing-Allow-Origin"], "http://localhost:3000")
            self.assertIn("Origin", answer.headers.get_all("Vary"))
        answer = daemon.get("/v1/scenes", headers={**bearer, "Origin": "https://app.example", "Sec-Fetch-Site": "cross-site"})
        self.assertEqual((answer.status, answer.headers["Access-Control-Allow-Origin"]), (200, "https://app.example"))
        # Answers to other origins, and to no page at all, depend on Origin, too.
        self.refused(daemon.get("/v1/scenes", headers={**bearer, "Origin": "https://app.example:444"}), 403, "wrong-origin")
        self.assertIn("Origin", daemon.get("/v1/scenes", headers=bearer).headers.get_all("Vary"))
        # A preflight has no token.
        asks = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization,content-type"}
        answer = daemon.ask("OPTIONS", SOLVE, None, {**page, **asks})
        self.assertEqual((answer.status, answer.body), (204, b""))
        self.assertEqual(answer.headers["Access-Control-Allow-Methods"], "POST, OPTIONS")
        for name in "authorization", "content-type":
            self.assertIn(name, answer.headers["Access-Control-Allow-Headers"].lower())
        self.assertEqual(answer.headers["Access-Control-Allow-Origin"], "http://localhost:3000")
        self.assertEqual(daemon.ask("OPTIONS", "/none", None, {**page, **asks}).status, 404)
        self.refused(daemon.ask("OPTIONS", SOLVE, None, {"Origin": "http://evil.example", **asks}), 403, "wrong-origin")
        self.assertEqual(daemon.ask("OPTIONS", SOLVE, None, page).status, 401)

    def test_a_body_needs_its_type(self):
        daemon = self.daemon()
        for body in BODY, "{}", "":
            with self.subTest(body=body):
                self.refused(daemon.ask("POST", SOLVE, body), 415, "media-type")
                self.refused(daemon.ask("PUT", "/v1/scenes/box/reflectance", body), 415, "media-type")

    def test_headers_of_every_answer(self):
        daemon = self.daemon()
        for answer in (daemon.get("/healthz"), daemon.get("/none"), daemon.get("/v1/scenes"), daemon.radiosity("box", BODY),
                       daemon.radiosity("box", "{"), daemon.get("/v1/scenes", headers={"Host": "evil"}),
                       daemon.get("/v1/scenes", headers={"X(Y": "z"})):
            self.assertEqual(answer.headers["X-Content-Type-Options"], "nosniff", answer)
            self.assertEqual(answer.headers["Cross-Origin-Resource-Policy"], "same-origin", answer)
            self.assertIsNone(answer.headers["Access-Control-Allow-Origin"])

    def test_wrong_usage(self):
        path, _ = self.store()
        for option, text in (("--allow-host", ""), ("--allow-host", "a:80"), ("--allow-host", "a b"), ("--allow-host", "http://a"),
                             ("--allow-host", "[x]"), ("--allow-origin", "a.example"), ("--allow-origin", "null"), ("--allow-origin", "*"),
                             ("--allow-origin", "https://a.example/"), ("--allow-origin", "https://a:"), ("--allow-origin", "https://")):
            done = self.run_once(path, "--listen", "127.0.0.1:0", option, text)
            self.assertEqual(done.returncode, 1, (option, text))
            self.assertRegex(done.stderr, rf"\Alambertd: {option}.*\n\Z")


if __name__ == "__main__":
    unittest.main()
