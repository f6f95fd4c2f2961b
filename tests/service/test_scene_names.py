"""A scene is called as its store's file is; stores that are refused are counted and named, without a path."""

import pathlib
import shutil
import signal
import subprocess
import tempfile
import unittest
import urllib.parse

from daemon import LAMBERTD, PATIENCE, Daemon
from guard_case import metrics
from make_store import Scene


class SceneNames(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lambert-names-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.stores = self.folder / "stores"
        self.stores.mkdir()
        self.one = self.folder / "one.h5"
        Scene(20).write(self.one, "box")  # all stores here were made from one scene

    def names(self, daemon):
        return [s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]]

    def refused(self, daemon):
        """The stores that /readyz names, as many as /metrics counts, without a path."""
        answer = daemon.get("/readyz")
        self.assertEqual(answer.status, 200)
        self.assertNotIn(str(self.folder).encode(), answer.body)
        self.assertNotIn(b"/", answer.body)
        told = answer.json().get("refused", [])
        self.assertEqual(metrics(daemon)[("lambertd_stores_refused",)], len(told))
        return {r["name"]: r for r in told}

    def test_stores_of_one_scene(self):
        for name in "z-old", "a-new":
            shutil.copy(self.one, self.stores / f"{name}.h5")
        with Daemon("--stores", self.stores) as daemon:
            self.assertEqual(self.names(daemon), ["a-new", "z-old"])
            self.assertEqual(self.refused(daemon), {})
            self.assertEqual(daemon.get("/readyz").json(), {"status": "ready"})
            (self.stores / "z-old.h5").rename(self.stores / "newest.h5")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded")
            self.assertEqual(self.names(daemon), ["a-new", "newest"])
            answer = daemon.radiosity("newest", {"emission": {"groups": {"lamp": 1}}}).json()
            self.assertEqual(answer["scene"], "newest")
            self.assertEqual(daemon.get("/v1/scenes/newest").json()["name"], "newest")

    def test_names_that_paths_must_escape(self):
        names = sorted(["a b", "50% #1?", "Wände & α", "x+y;z", "%2e", "two.parts", "é" * 120], key=str.encode)
        for name in names:
            shutil.copy(self.one, self.stores / f"{name}.h5")
        with Daemon("--stores", self.stores) as daemon:
            self.assertEqual(self.names(daemon), names)
            for name in names:
                path = urllib.parse.quote(name, safe="")
                self.assertEqual(daemon.radiosity(path, {"emission": {"groups": {"lamp": 1}}}).json()["scene"], name)

    def test_names_that_nobody_can_ask_for(self):
        shutil.copy(self.one, self.folder / "..h5")
        for name in ".", "..", "x" * 256, "a/b", "a\nb", "\x7f", "/":
            with self.subTest(name=name), Daemon(self.one, f"{self.one}:{name}") as daemon:
                self.assertEqual(self.names(daemon), ["one"])
                self.assertEqual(len(daemon.errors().splitlines()), 1)
                self.assertIn("give it another", daemon.errors())
                self.assertEqual([r["name"] for r in daemon.get("/readyz").json()["refused"]], [name])
        shutil.copy(self.one, self.stores / "a\tb.h5")
        shutil.copy(self.one, self.stores / "ab.h5")
        with Daemon("--stores", self.stores) as daemon:
            self.assertEqual(self.names(daemon), ["ab"])
            self.assertIn("control character); rename the file", daemon.errors())

    def test_a_folder_with_a_colon(self):
        odd = self.folder / "a:b"
        odd.mkdir()
        shutil.copy(self.one, odd / "one.h5")
        with Daemon(odd / "one.h5", f"{odd / 'one.h5'}:two") as daemon:
            self.assertEqual(self.names(daemon), ["one", "two"])

    def test_what_is_no_store(self):
        """Scenes and folders that were meant otherwise: the line says how."""
        scene = self.folder / "room.obj"
        scene.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        first = f"precompute it first: lambert precompute {scene} -o room.h5"
        for file, words in ((scene, first), (self.stores, f"--stores {self.stores}"),
                            (self.folder / "none.obj", "No such file")):
            made = subprocess.run([LAMBERTD, file, "--listen", "127.0.0.1:0"], capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual((made.returncode, made.stderr.count("\n")), (1, 2))
            self.assertIn(f"refused {file}: ", made.stderr)
            self.assertIn(words, made.stderr)

    def success(self, daemon):
        return metrics(daemon)[("lambertd_reload_success",)]

    def test_strict(self):
        """A refused store is an error of the start and of readiness; without the option of neither, but it is counted."""
        for name in "good", "bad":
            shutil.copy(self.one, self.stores / f"{name}.h5")
        with Daemon("--stores", self.stores, "--strict") as strict, Daemon("--stores", self.stores) as easy:
            for state, status, success in (("bad", 503, 0), ("mended", 200, 1), ("gone", 503, 0), ("back", 200, 1)):
                away = self.folder / "away"
                if state == "bad":
                    (self.folder / "new").write_bytes(b"no store")
                    (self.folder / "new").rename(self.stores / "worse.h5")
                elif state == "mended":
                    (self.stores / "worse.h5").unlink()
                elif state == "gone":
                    self.stores.rename(away)
                else:
                    away.rename(self.stores)
                for daemon in strict, easy:
                    before = daemon.output().count("reloaded")
                    daemon.signal(signal.SIGHUP)
                    daemon.wait_for("reloaded", before + 1)
                    self.assertEqual(self.success(daemon), success, state)
                    self.assertEqual(self.names(daemon), ["bad", "good"])
                self.assertEqual(easy.get("/readyz").status, 200)
                answer = strict.get("/readyz")
                self.assertEqual(answer.status, status, answer)
                if state == "bad":
                    self.assertIn("--strict", answer.json()["detail"])
                    self.assertIn("worse", answer.json()["detail"])
                    listed = easy.get("/v1/scenes").json()["refused"]
                    self.assertEqual([(r["name"], r["kept"]) for r in listed], [("worse", False)])
                    self.assertEqual(listed, easy.get("/readyz").json()["refused"])
                else:
                    self.assertNotIn("refused", easy.get("/v1/scenes").json())
        (self.stores / "worse.h5").write_bytes(b"no store")
        made = subprocess.run([LAMBERTD, "--stores", self.stores, "--strict", "--listen", "127.0.0.1:0"], capture_output=True, text=True,
                              timeout=PATIENCE)
        self.assertEqual(made.returncode, 1)
        self.assertIn("--strict", made.stderr.splitlines()[-1])
        self.assertNotIn("listening", made.stdout)

    def test_a_name_is_taken(self):
        other = self.folder / "other"
        other.mkdir()
        shutil.copy(self.one, other / "one.h5")
        with Daemon(self.one, other / "one.h5", f"{other / 'one.h5'}:two") as daemon:
            self.assertEqual(self.names(daemon), ["one", "two"])
            self.assertIn(f"refused {other / 'one.h5'}: the name one is taken by {self.one}", daemon.errors())
            self.assertEqual(self.refused(daemon)["one"]["reason"], "another store has its name")

    def test_refused_stores_are_named_until_they_are_sound(self):
        for name in "good", "bad", "ugly":
            shutil.copy(self.one, self.stores / f"{name}.h5")
        (self.stores / "bad.h5").write_bytes(b"no store")
        with Daemon("--stores", self.stores) as daemon:
            self.assertEqual(self.names(daemon), ["good", "ugly"])
            first = self.refused(daemon)
            self.assertEqual(list(first), ["bad"])
            self.assertFalse(first["bad"]["kept"])
            self.assertGreater(len(first["bad"]["reason"]), 10)
            shutil.copy(self.one, self.folder / "new")
            (self.folder / "new").rename(self.stores / "bad.h5")
            (self.folder / "cut").write_bytes(self.one.read_bytes()[:-1000])
            (self.folder / "cut").rename(self.stores / "ugly.h5")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded")
            self.assertEqual(self.names(daemon), ["bad", "good", "ugly"])
            second = self.refused(daemon)
            self.assertEqual([(r["name"], r["kept"]) for r in second.values()], [("ugly", True)])
            for path in self.stores.iterdir():
                path.unlink()
            (self.stores / "ugly.h5").write_bytes(b"")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded", 2)
            answer = daemon.get("/readyz")
            self.assertEqual(answer.status, 200)  # the scene that was read before goes on
            self.assertEqual(self.names(daemon), ["ugly"])


if __name__ == "__main__":
    unittest.main()
