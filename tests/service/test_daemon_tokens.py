"""Several tokens with rights, read again on SIGHUP, and who changed what by which of them."""

import json
import signal
import unittest

from daemon import Daemon
from daemon_case import Case

TOKENS = """# tokens of the test
all-of-it
reader    read   name=viewer
writer\tvary
both read vary name=ci.2
scraper metrics
"""
PUT = {"variant": "red", "groups": {"floor": .5}}


class Tokens(Case):
    def setUp(self):
        super().setUp()
        self.file = self.folder / "tokens"
        self.write(TOKENS)
        self.path, _ = self.store()

    def write(self, text):
        self.file.touch(0o600)
        self.file.write_text(text)

    def ask(self, daemon, method, path, token, body=None):
        headers = {"Content-Type": "application/json", **({"Authorization": f"Bearer {token}"} if token else {})}
        return daemon.ask(method, path, json.dumps(body) if body is not None else None, headers)

    def statuses(self, daemon, token):
        """Of reading, of solving, of a PUT (403 "not-allowed" or 409 where the token may), and of /metrics."""
        out = []
        for method, path, body in (("GET", "/v1/scenes", None), ("POST", "/v1/scenes/box/radiosity", {"emission": [1] * 60}),
                                   ("PUT", "/v1/scenes/box/reflectance", PUT), ("DELETE", "/v1/scenes/box@red", None),
                                   ("GET", "/metrics", None)):
            answer = self.ask(daemon, method, path, token, body)
            refused = answer.status == 401 or answer.status == 403 and answer.json()["type"].endswith("#no-right")
            out.append(answer.status if refused else "")
        return out

    def test_rights(self):
        with Daemon(self.path, "--token-file", self.file, "--max-variants", 2) as daemon:
            for token, wanted in (("all-of-it", ["", "", "", "", ""]), ("reader", ["", "", 403, 403, 403]),
                                  ("writer", [403, 403, "", "", 403]), ("both", ["", "", "", "", 403]),
                                  ("scraper", [403, 403, 403, 403, ""]), (None, [401] * 5), ("read", [401] * 5),
                                  ("viewer", [401] * 5), ("# tokens", [401] * 5), ("#", [401] * 5), ("reader    read", [401] * 5)):
                self.assertEqual(self.statuses(daemon, token), wanted, token)
            # Another method of a path that exists needs a token, whichever.
            self.assertEqual(self.ask(daemon, "PATCH", "/v1/scenes", None).status, 401)
            self.assertEqual(self.ask(daemon, "PATCH", "/v1/scenes", "scraper").status, 405)

    def test_metrics_are_open_unless_a_token_has_their_right(self):
        self.write("reader read\nall\n")
        with Daemon(self.path, "--token-file", self.file) as daemon:
            self.assertEqual(daemon.get("/metrics").status, 200)

    def test_read_again(self):
        with Daemon(self.path, "--token-file", self.file) as daemon:
            self.write("new\n")
            self.assertEqual(self.ask(daemon, "GET", "/v1/scenes", "reader").status, 200)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded", 1)
            self.assertEqual(self.ask(daemon, "GET", "/v1/scenes", "new").status, 200)
            self.assertEqual(self.ask(daemon, "GET", "/v1/scenes", "reader").status, 401)
            # A file that cannot be used leaves the tokens as they are, and its words are told to nobody.
            self.write("newer\nhunter2 sudo\n")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded", 2)
            self.assertEqual(self.ask(daemon, "GET", "/v1/scenes", "new").status, 200)
            self.assertEqual(self.ask(daemon, "GET", "/v1/scenes", "newer").status, 401)
            said = daemon.errors()
            self.assertRegex(said, r"\Alambertd: the tokens stay as they were: \S*tokens:2: word 2 is none of .*\n\Z")
            self.assertNotIn("hunter2", said)
            self.assertNotIn("sudo", said)

    def test_files_that_cannot_be_used(self):
        for text, words in (("", "no token"), ("# x\n\n", "no token"), ("a\nb write\n", ":2: word 2"), ("a name=\n", ":1: word 2"),
                            ("a read name=x/y\n", ":1: word 3"), ("a name=" + "x" * 40, "word 2"), ("a\nb\na read\n", ":3: this token was given"),
                            ("x" * 513, "513 characters"), ("x " * 2000, "1024 characters"), ("caf\u00e9", "no header can hold"),
                            ("".join(f"t{i}\n" for i in range(257)), ":257: there are more than 256")):
            self.write(text)
            done = self.run_once(self.path, "--token-file", self.file)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, r"\Alambertd: [^\n]*\n\Z")
            self.assertIn(words, done.stderr)

    def test_a_file_that_others_can_read(self):
        self.file.chmod(0o644)
        with Daemon(self.path, "--token-file", self.file) as daemon:
            self.assertRegex(daemon.errors(), r"\Alambertd: other users can read \S*tokens \(mode 644\).*\n\Z")
        self.file.chmod(0o640)
        with Daemon(self.path, "--token-file", self.file) as daemon:
            self.assertEqual(daemon.errors(), "")

    def change(self, daemon):
        self.ask(daemon, "PUT", "/v1/scenes/box/reflectance", "both", PUT)
        self.ask(daemon, "PUT", "/v1/scenes/box/reflectance", "reader", PUT)
        self.ask(daemon, "DELETE", "/v1/scenes/box/reflectance", "writer", {"variant": "red"})
        self.ask(daemon, "DELETE", "/v1/scenes/box@blue", None)
        self.ask(daemon, "GET", "/v1/scenes/box", "reader")

    CHANGES = [{"method": "PUT", "client": "127.0.0.1", "token": "ci.2", "scene": "box", "status": 409},
               {"method": "PUT", "client": "127.0.0.1", "token": "viewer", "scene": "box", "status": 403},
               {"method": "DELETE", "client": "127.0.0.1", "token": "3", "scene": "box", "status": 404, "variant": "box@red"},
               {"method": "DELETE", "client": "127.0.0.1", "scene": "box@blue", "status": 401}]

    def shown(self, text):
        wanted = ("method", "client", "token", "scene", "status", "variant")
        return [{k: v for k, v in json.loads(line).items() if k in wanted} for line in text.splitlines()]

    def test_changes_are_told_on_standard_error(self):
        with Daemon(self.path, "--token-file", self.file, "--max-variants", 2) as daemon:
            self.change(daemon)
            daemon.stop()
            self.assertEqual(self.shown(daemon.errors()), self.CHANGES)

    def test_changes_are_told_in_the_access_log(self):
        log = self.folder / "log"
        with Daemon(self.path, "--token-file", self.file, "--max-variants", 2, "--access-log", log) as daemon:
            self.change(daemon)
            daemon.stop()
            self.assertEqual(daemon.errors(), "")
        self.assertEqual(self.shown(log.read_text()),
                         [*self.CHANGES, {"method": "GET", "client": "127.0.0.1", "token": "viewer", "status": 200}])


if __name__ == "__main__":
    unittest.main()
