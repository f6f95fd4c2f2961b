"""The limits of what lambertd keeps and of what its requests take, under the requests that once passed them."""

import json
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

from daemon import LAMBERTD, PATIENCE, Daemon
from make_store import Scene

TOKEN = "s3cret"


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class Kept(Case):
    """--max-memory: stores, variants, work areas."""

    def put(self, daemon, name):
        headers = {"Authorization": f"Bearer {TOKEN}", "Content-Type": "application/json"}
        answer = daemon.ask("PUT", "/v1/scenes/base/reflectance", json.dumps({"variant": name, "groups": {"wall": .3}}), headers)
        self.assertEqual(answer.status, 202, answer)
        deadline = time.monotonic() + PATIENCE
        while (answer := daemon.ask("GET", f"/v1/scenes/base@{name}", headers=headers)).status != 200:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(.002)
        return answer.json()["bytes"]

    def work_bytes(self, path, held):
        """Of one thread, from the refusal of a store that has no room for it."""
        ended = subprocess.run([LAMBERTD, "--listen", "127.0.0.1:0", str(path), "--threads", "1", "--max-memory", str(held + 1)],
                               capture_output=True, text=True, timeout=PATIENCE)
        return int(re.search(r"and 1 threads (\d+) each to solve", ended.stderr).group(1))

    def test_variants_are_counted_after_stores_were_read_again(self):
        """A store that came later leaves room for one of two variants: the older one stays."""
        folder, token = self.folder / "stores", self.folder / "token"
        folder.mkdir()
        token.write_text(TOKEN)
        Scene(200, rank=60).write(folder / "base.h5", "base", keep_factors=True)
        Scene(200, rank=60, seed=2).write(self.folder / "later.h5", "later", keep_factors=True)
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with Daemon(folder / "base.h5") as daemon:
            held = daemon.get("/v1/scenes/base").json()["bytes"]
        work, variant = self.work_bytes(folder / "base.h5", held), 60 * 60 * 4
        limit = 2 * held + work + variant * 3 // 2
        with Daemon("--stores", folder, "--threads", 1, "--max-variants", 4, "--token-file", token, "--max-memory", limit) as daemon:
            self.assertEqual([self.put(daemon, name) for name in ("older", "newer")], [variant] * 2)
            (self.folder / "later.h5").rename(folder / "later.h5")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ")
            scenes = daemon.ask("GET", "/v1/scenes", headers=headers).json()["scenes"]
            self.assertEqual([s["name"] for s in scenes], ["base", "base@older", "later"])
            self.assertLessEqual(sum(s["bytes"] for s in scenes) + work, limit)
            self.assertIn("dropped base@newer: the stores leave it no room in --max-memory", daemon.errors())


if __name__ == "__main__":
    unittest.main()
