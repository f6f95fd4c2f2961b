"""Words of the daemon: clients do not see paths of the server, and names of stores cannot write lines of its log."""

import json
import os
import unittest

from command import must
from daemon import Daemon
from daemon_case import Case

N, RANK = 3000, 100  # Y and V: 1.14 MiB each, which is worth a mapping


class Words(Case):
    def test_no_path_in_the_words_for_clients(self):
        path, _ = self.store(n=N, rank=RANK)
        with Daemon(path) as daemon:
            os.utime(path)
            answer = daemon.radiosity("box", {"emission": {"groups": {"lamp": 1}}})
            self.assertEqual(answer.status, 503)
            self.assertIn("was changed since it was mapped", answer.json()["detail"])
            self.assertNotIn(str(self.folder), answer.body.decode())
            # Its operator sees the path.
            self.assertIn(str(path), daemon.errors())

    def test_a_store_without_its_form_factors(self):
        """One that is not mapped was cut short after it was read: its answers stay, and tolerances are 503."""
        scene, path = self.folder / "box.obj", self.folder / "box.h5"
        must("generate", "box", "--divisions", 4, "--reflectance", .5, "-o", scene)
        must("precompute", scene, "-o", path, "--method", "exact", "--rays", 256, "--probes", 0, "--keep-form-factors", "--quiet")
        body = {"emission": {"elements": [0], "values": [1]}}
        with Daemon(path) as daemon:
            for spoil in (lambda: os.truncate(path, path.stat().st_size // 2), lambda: path.write_bytes(b"x" * 5000), path.unlink):
                spoil()
                answer = daemon.radiosity("box", {**body, "tolerance": 1e-4})
                self.assertEqual(answer.status, 503, answer)
                self.assertIn("Retry-After", answer.headers)
                self.assertTrue(answer.json()["detail"].startswith("box: "), answer)
                self.assertNotIn(str(self.folder), answer.body.decode())
                self.assertEqual(daemon.radiosity("box", body).status, 200)

    def test_a_name_with_control_characters(self):
        name = "x\nverified evil\x1b[31m\x7f\u0085"
        path, _ = self.store(file=f"{name}.h5")
        odd, _ = self.store(file="y\nserving z.h5")
        other, _ = self.store(file="other.h5")
        with Daemon(path, odd, f"{other}:{name}", other) as daemon:
            self.assertEqual(self.names(daemon), ["other"])
            for line in daemon.errors().splitlines():
                self.assertEqual(line.count(str(self.folder)), 1)  # the path stands there once, whatever is in it
                self.assertIn("no control character", line)
            self.assertEqual(len(daemon.errors().splitlines()), 3)
            daemon.signal(1)
            daemon.wait_for("reloaded")
            path.write_bytes(b"damaged")
            daemon.signal(1)
            daemon.wait_for("reloaded", 2)
            for text in daemon.output(), daemon.errors():
                self.assertEqual([c for c in text if c != "\n" and not c.isprintable()], [])
                for line in text.splitlines():
                    self.assertRegex(line, r"\A(serving|refused|reloaded|kept|dropped|listening on http://127|verified|\d+ threads?:|took)")


if __name__ == "__main__":
    unittest.main()
