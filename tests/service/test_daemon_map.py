"""lambertd and stores that it maps: what it finds out about them while it serves, and what it takes of memory."""

import io
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import h5py
import numpy as np

from command import must
from daemon import LAMBERTD, PATIENCE, Daemon
from daemon_case import TOLERANCE, replaced_under_load
from make_store import Luminaires, Scene, add_checksums

N, RANK, TILES = 3000, 100, 100
BYTES = 4 * N * RANK  # of Y, V, U and first_bounce: 1.14 MiB, which is worth a mapping


def serve_first(*arguments):
    """A daemon that compares what it maps while it serves it, as it does with large stores."""
    return Daemon(*arguments, "--verify-below", 1)


class Mapped(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.made = pathlib.Path(folder.name)
        cls.scene = Scene(N, rank=RANK)
        cls.other = Scene(N, rank=RANK, seed=2)
        cls.coloured = Scene(N, channels=3, rank=RANK)
        cls.scene.write(cls.made / "box.h5")
        cls.other.write(cls.made / "other.h5", "other")
        cls.coloured.write(cls.made / "sky.h5", "sky", sky=TILES)
        Scene(60).write(cls.made / "small.h5", "small")

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def store(self, name):
        return pathlib.Path(shutil.copy(self.made / f"{name}.h5", self.folder))

    def names(self, daemon):
        return [s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]]

    def gauge(self, daemon, name):
        return float(re.search(rf"^lambertd_{name} (\S+)$", daemon.get("/metrics").body.decode(), re.M).group(1))

    def place(self, path, dataset):
        with h5py.File(path, "r") as f:
            return f[dataset].id.get_offset()

    def flip(self, path, dataset, at):
        with open(path, "r+b") as f:
            f.seek(self.place(path, dataset) + at)
            byte = f.read(1)[0]
            f.seek(-1, os.SEEK_CUR)
            f.write(bytes([byte ^ 0x04]))

    def rot(self, path):
        """A number of V is infinite, and neither size nor time of the file tell."""
        times = os.stat(path)
        with open(path, "r+b") as f:
            f.seek(self.place(path, "operator/V") + 4 * 17)
            f.write(np.float32(np.inf).tobytes())
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def check(self, daemon, name, scene, seed=5):
        E = np.random.default_rng(seed).random((scene.channels, N))
        answer = daemon.radiosity(name, {"emission": E.tolist() if scene.channels > 1 else E[0].tolist()})
        self.assertEqual(answer.status, 200, answer)
        wanted = scene.solve(E)
        given = np.array(answer.json()["radiosity"]).reshape(scene.channels, N)
        self.assertLessEqual(np.abs(given - wanted).max(), TOLERANCE * wanted.max())

    def check_out_of_service(self, daemon, name, path, words):
        for answer in (daemon.radiosity(name, {"emission": [1] * N}), daemon.get(f"/v1/scenes/{name}")):
            self.assertEqual(answer.status, 503, answer)
            self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
            self.assertIsNotNone(answer.headers["Retry-After"])
            detail = answer.json()["detail"]
            self.assertIn(f"{name} is out of service: {words}", detail)
        self.assertNotIn(name, self.names(daemon))
        self.assertEqual(self.gauge(daemon, "scenes_damaged"), 1)
        lines = [line for line in daemon.errors().splitlines() if line.startswith(f"took {name} out of service")]
        self.assertEqual(len(lines), 1, daemon.errors())
        self.assertIn(f"{path}: {words}", lines[0])

    def test_answers(self):
        with serve_first(self.store("box"), self.store("sky"), self.store("small")) as daemon:
            self.check(daemon, "box", self.scene)
            self.check(daemon, "sky", self.coloured)
            E, L = np.random.default_rng(6).random((3, N)), np.random.default_rng(7).random((3, TILES))
            answer = daemon.radiosity("sky", {"emission": {"sky": L.T.tolist()}, "select": {"elements": [7, 8, 2999]}})
            self.assertEqual(answer.status, 200, answer)
            wanted = self.coloured.solve(0 * E, L=L)
            given = np.array(answer.json()["radiosity"])
            self.assertLessEqual(np.abs(given - wanted[:, [7, 8, 2999]]).max(), TOLERANCE * wanted.max())
            for name in "box", "sky":
                daemon.wait_for(f"verified {name}: ")
            self.assertEqual(self.gauge(daemon, "scenes_unverified"), 0)
            self.assertEqual(self.gauge(daemon, "scenes_damaged"), 0)
            self.assertEqual(self.gauge(daemon, "scenes"), 3)
            self.assertEqual(self.gauge(daemon, "mapped_bytes"), 5 * BYTES + 120000)  # Y, V; U, V, core, first_bounce
            self.assertNotIn("verified small", daemon.output())
            self.assertEqual(daemon.errors(), "")

    def test_a_copy_has_the_same_bits(self):
        path, out = self.folder / "room.h5", self.folder / "out.npy"
        must("generate", "cornell", "--reflectance", ".5", "--elements", 2400, "-o", self.folder / "room.obj")
        must("precompute", self.folder / "room.obj", "-o", path, "--method", "low-rank", "--rank", 150, "--rays", 64,
             "--probes", 2, "--quiet")
        with h5py.File(path) as f:
            E = np.random.default_rng(8).random((len(f["mesh/reflectance"]), len(f["mesh/area"]))).astype(np.float32)
        np.save(self.folder / "E.npy", E)
        must("solve", path, "--emission", self.folder / "E.npy", "-o", out)
        with serve_first(path) as daemon:
            raw = io.BytesIO()
            np.save(raw, E)
            self.assertGreater(self.gauge(daemon, "mapped_bytes"), 0)
            answer = daemon.radiosity("room", raw.getvalue(), kind="application/x-npy", accept="application/x-npy")
            self.assertEqual(answer.status, 200, answer)
            B = np.load(io.BytesIO(answer.body))
            np.testing.assert_array_equal(B.ravel(), np.load(out).astype(np.float32).ravel())

    def test_a_flipped_bit_takes_its_scene_out(self):
        for dataset, at, words in (("operator/Y", 0, "/operator/Y is damaged in MiB 1 of 2"),
                                   ("operator/V", BYTES - 1, "/operator/V is damaged in MiB 2 of 2")):
            path, other = self.store("box"), self.store("other")
            self.flip(path, dataset, at)
            with serve_first(path, other) as daemon:
                daemon.wait_for("verified other: ")
                self.check_out_of_service(daemon, "box", path, words)
                self.check(daemon, "other", self.other)
                self.assertEqual(self.names(daemon), ["other"])
                # Reading it again finds the same; a good file put in its place is served.
                daemon.signal(signal.SIGHUP)
                daemon.wait_for("reloaded: 2 scenes")
                self.assertIn(f"kept the box read before; {path} cannot be read now: ", daemon.errors())
                self.check_out_of_service(daemon, "box", path, words)
                shutil.copy(self.made / "box.h5", self.folder / "spare")
                os.replace(self.folder / "spare", path)
                daemon.signal(signal.SIGHUP)
                daemon.wait_for("reloaded: 2 scenes", 2)
                # After what was found it was looked at first.
                self.assertNotIn("verified box: ", daemon.output())
                self.check(daemon, "box", self.scene)
                self.assertEqual(self.gauge(daemon, "scenes_damaged"), 0)
                self.assertEqual(self.gauge(daemon, "scenes_unverified"), 0)

    def test_luminaires(self):
        """As many as the store has vectors: mapped, counted, answered, and compared as the operator is."""
        path = self.store("box")
        l = Luminaires(N, names=[f"l{k}" for k in range(RANK)], groups=[None] * RANK).add_to(path)
        with serve_first(path) as daemon:
            answer = daemon.radiosity("box", {"emission": {"luminaires": {"l1*": 1}}, "quantity": "irradiance"})
            self.assertEqual(answer.status, 200, answer)
            H0 = l.direct(l.of(**{name: 1 for name in l.names if name.startswith("l1")}))
            wanted = self.scene.solve(self.scene.rho * H0, "irradiance") + H0
            self.assertLessEqual(np.abs(answer.json()["irradiance"] - wanted[0]).max(), TOLERANCE * wanted.max())
            self.assertEqual(self.gauge(daemon, "mapped_bytes"), 3 * BYTES)  # Y, V, irradiance
            daemon.wait_for("verified box: ")
        small = subprocess.run([LAMBERTD, "--listen", "127.0.0.1:0", str(path), "--max-memory", str(2 * BYTES + 100000)],
                               capture_output=True, text=True, timeout=PATIENCE)
        self.assertGreater(int(re.search(r": takes (\d+) bytes, ", small.stderr)[1]), 3 * BYTES, small.stderr)
        self.flip(path, "luminaires/irradiance", BYTES - 1)
        with serve_first(path, self.store("other")) as daemon:
            daemon.wait_for("verified other: ")
            self.check_out_of_service(daemon, "box", path, "/luminaires/irradiance is damaged in MiB 2 of 2")

    MEAN = {"emission": {"groups": {"lamp": 1, "floor": 1, "wall": 1, "box": 1}},
            "reduce": {"groups": ["floor"], "with": ["mean"]}}

    def test_a_number_that_is_not_finite_takes_its_scene_out(self):
        """Its checksums are right: whoever wrote it wrote infinity."""
        path, other = self.store("box"), self.store("other")
        with h5py.File(path, "r+") as f:
            f["operator/V"][N - 1, 7] = np.inf
            add_checksums(f)
        with serve_first(path, other) as daemon:
            self.assertIn(daemon.radiosity("box", self.MEAN).status, (422, 503))
            daemon.wait_for("verified other: ")
            self.check_out_of_service(daemon, "box", path, "/operator/V has a number that is not finite in MiB 2 of 2")
            self.check(daemon, "other", self.other)
        with serve_first(path, other, "--verify") as daemon:
            self.assertEqual(self.names(daemon), ["other"])
            self.assertIn("/operator/V has a number that is not finite in MiB 2 of 2", daemon.errors())

    def test_a_figure_that_is_not_finite_is_refused(self):
        """Bytes that were compared are not compared again, so that requests meet a medium that rots later."""
        path = self.store("box")
        with serve_first(path) as daemon:
            daemon.wait_for("verified box: ")
            # After this doubt there is none for a minute, whose comparison could overtake the answers.
            self.assertEqual(daemon.radiosity("box", {"emission": [3e38] * N}).status, 422)
            daemon.wait_for("verified box: ", 2)
            self.rot(path)
            answer = daemon.radiosity("box", self.MEAN)
            self.assertEqual(answer.status, 422, answer)
            self.assertIn("the mean of floor is not finite", answer.json()["detail"])
            answer = daemon.radiosity("box", {"emission": [1] * N})
            self.assertEqual(answer.status, 422, answer)

    def test_an_answer_that_is_not_finite_has_its_scene_compared_again(self):
        path = self.store("box")
        with Daemon(path) as daemon:
            self.assertEqual(daemon.radiosity("box", {"emission": [3e38] * N}).status, 422)
            daemon.wait_for("verified box: ")
            self.rot(path)
            # Once in a minute: emission alone may have made the first answer too large.
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * N}).status, 422)
        path = self.store("box")
        with Daemon(path) as daemon:
            self.rot(path)
            self.assertIn(daemon.radiosity("box", {"emission": [1] * N}).status, (422, 503))
            daemon.wait_for_error("took box out of service: ")
            self.check_out_of_service(daemon, "box", path, "/operator/V is damaged in MiB 1 of 2")

    def test_small_stores_are_compared_before_they_are_served(self):
        path, other = self.store("box"), self.store("other")
        self.flip(path, "operator/V", BYTES - 1)
        for most, served in ("256M", ["other"]), (3 * BYTES, ["other"]), (BYTES, ["box", "other"]):
            with Daemon(path, other, *([] if most == "256M" else ["--verify-below", most])) as daemon:
                self.assertIn(self.names(daemon), (served, ["other"]))
                refused = f"refused {path}: " in daemon.errors()
                self.assertEqual(refused, "box" not in served, daemon.errors())
                if not refused:
                    daemon.wait_for_error("took box out of service: ")
                self.assertEqual(self.gauge(daemon, "scenes_damaged"), not refused)

    def test_verify_looks_before_it_serves(self):
        path, other = self.store("box"), self.store("other")
        self.flip(path, "operator/V", BYTES - 1)
        with serve_first(path, other, "--verify") as daemon:
            self.assertEqual(self.names(daemon), ["other"])
            self.assertEqual(daemon.radiosity("box", {"emission": [1] * N}).status, 404)
            self.assertIn(f"refused {path}: ", daemon.errors())
            self.assertIn("/operator/V is damaged in MiB 2 of 2", daemon.errors())
            self.assertNotIn("verified", daemon.output())  # there is nothing left to do

    def test_a_file_that_is_written_to_is_out_of_service(self):
        def cut(path):
            os.truncate(path, self.place(path, "operator/V") + BYTES // 2)

        def overwrite(path):
            path.write_bytes((self.made / "other.h5").read_bytes())  # as large: no fault, only another truth
            os.utime(path, (1, 1))

        for change in cut, overwrite:
            path, other = self.store("box"), self.store("other")
            with serve_first(path, other, "--threads", 2) as daemon:
                daemon.wait_for("verified box: ")
                daemon.wait_for("verified other: ")
                self.check(daemon, "box", self.scene)
                change(path)
                self.check_out_of_service(daemon, "box", path, "was changed since it was mapped")
                self.check(daemon, "other", self.other)

    def test_a_file_cut_short_is_survived(self):
        path, other = self.store("box"), self.store("other")
        with serve_first(path, other, "--threads", 2) as daemon:
            daemon.wait_for("verified box: ")
            daemon.wait_for("verified other: ")
            self.check(daemon, "box", self.scene)
            os.truncate(path, self.place(path, "operator/V") + BYTES // 2)
            self.check_out_of_service(daemon, "box", path, "was changed since it was mapped")
            self.check(daemon, "other", self.other)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 2 scenes")
            self.check_out_of_service(daemon, "box", path, "was changed since it was mapped")
            shutil.copy(self.made / "box.h5", self.folder / "spare")
            os.replace(self.folder / "spare", path)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 2 scenes", 2)
            self.check(daemon, "box", self.scene)

    def test_no_wrong_answer_while_a_file_is_cut(self):
        path = self.store("box")
        body = json.dumps({"emissions": [[1] * N] * 4})
        answers, stop = [], threading.Event()

        def client(daemon):
            connection = daemon.connect()
            while not stop.is_set():
                answers.append(daemon.radiosity("box", body, connection=connection))
            connection.close()

        with serve_first(path, "--threads", 2) as daemon:
            daemon.wait_for("verified box: ")
            right = daemon.radiosity("box", body).json()["radiosity"]
            clients = [threading.Thread(target=client, args=(daemon,)) for _ in range(3)]
            for c in clients:
                c.start()
            try:
                while len(answers) < 6:
                    time.sleep(0.001)
                os.truncate(path, self.place(path, "operator/Y") + 4096)
                deadline = time.monotonic() + PATIENCE
                while not any(a.status == 503 for a in list(answers)) and time.monotonic() < deadline:
                    time.sleep(0.001)
            finally:
                stop.set()
                for c in clients:
                    c.join()
            self.assertEqual({a.status for a in answers}, {200, 503})
            for answer in answers:
                if answer.status == 200:
                    self.assertTrue(answer.json()["radiosity"] == right)  # a diff of so much would take minutes

    def test_what_is_unchanged_stays_mapped(self):
        path, other = self.store("box"), self.store("other")
        with serve_first(path, other, f"{path}:again") as daemon:
            for name in "box", "other", "again":
                daemon.wait_for(f"verified {name}: ")
            before = self.mappings(daemon)
            self.assertEqual(len(before), 3)
            shutil.copy(self.made / "box.h5", self.folder / "spare")
            os.replace(self.folder / "spare", other)  # now of another content
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 3 scenes")
            self.check(daemon, "other", self.scene)
            os.replace(shutil.copy(self.made / "other.h5", self.folder / "spare"), other)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 3 scenes", 2)
            daemon.wait_for("verified other: ", 3)
            self.check(daemon, "other", self.other)
            self.check(daemon, "again", self.scene)
            self.assertEqual(self.names(daemon), ["again", "box", "other"])
            self.assertEqual(daemon.output().count("verified box: "), 1)
            self.assertEqual(daemon.output().count("verified again: "), 1)
            self.assertEqual([m for m in before if m.endswith("box.h5")],
                             [m for m in self.mappings(daemon) if m.endswith("box.h5")])

    def test_replaced_under_load(self):
        path = self.store("box")
        self.other.write(self.folder / "second")
        with replaced_under_load(self, path, (self.made / "box.h5", self.folder / "second"), (self.scene, self.other),
                                 n_clients=3, n_rounds=6, answers=6) as daemon:
            # Of the files that went nothing is left.
            deadline = time.monotonic() + PATIENCE
            while len(self.mappings(daemon)) != 1 and time.monotonic() < deadline:
                time.sleep(0.01)
            self.assertEqual(len(self.mappings(daemon)), 1, self.mappings(daemon))

    def mappings(self, daemon):
        """Lines of /proc/PID/maps of the stores' files."""
        lines = pathlib.Path(f"/proc/{daemon.process.pid}/maps").read_text().splitlines()
        return [line.removesuffix(" (deleted)") for line in lines if str(self.folder) in line]

    def shares(self, daemon, path):
        """Rss, Pss and so on of a file's mapping, in bytes."""
        found, inside = {}, False
        for line in pathlib.Path(f"/proc/{daemon.process.pid}/smaps").read_text().splitlines():
            if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
                inside = line.endswith(str(path))
            elif inside and (figure := re.match(r"(\w+): +(\d+) kB", line)):
                found[figure[1]] = found.get(figure[1], 0) + 1024 * int(figure[2])
        return found

    def test_two_daemons_share_pages(self):
        path = self.store("box")
        with serve_first(path) as one:
            one.wait_for("verified box: ")
            alone = self.shares(one, path)
            self.assertGreaterEqual(alone["Rss"], 2 * BYTES)
            self.assertEqual(alone["Anonymous"], 0)
            with serve_first(path) as two:
                two.wait_for("verified box: ")
                for daemon in one, two:
                    shared = self.shares(daemon, path)
                    # Every page of the two arrays is counted half by each.
                    # (Dirty as long as the new file is not on the disk.)
                    self.assertGreaterEqual(shared["Shared_Clean"] + shared["Shared_Dirty"], 2 * BYTES)
                    self.assertLessEqual(shared["Pss"], shared["Rss"] - BYTES)
                    self.assertEqual(shared["Anonymous"], 0)
                    self.check(daemon, "box", self.scene)

    def test_max_memory_refuses_by_name(self):
        box, other, small = self.store("box"), self.store("other"), self.store("small")
        with serve_first(box, other, small) as daemon:
            sizes = {name: daemon.get(f"/v1/scenes/{name}").json()["bytes"] for name in ("box", "other", "small")}
        # Room for one of the two and a thread's work area, which is 16 vectors of 3,000 floats a few times; each store
        # has 16 bytes an element and a description beside its operator, and some that are freed once it is open.
        room = sizes["box"] + sizes["small"] + 6 * 16 * 4 * N + 2 * 32 * N
        self.assertLess(6 * 16 * 4 * N + sizes["small"] + 2 * 32 * N, sizes["other"])
        with serve_first(box, other, small, "--threads", 1, "--max-memory", room) as daemon:
            self.assertEqual(self.names(daemon), ["box", "small"])
            lines = daemon.errors().splitlines()
            self.assertEqual(len(lines), 1, lines)
            takes = int(re.match(rf"refused {other}: takes (\d+) bytes, ", lines[0]).group(1))
            # Beside the operator: areas, groups by element and reflectances, and some names.
            self.assertGreaterEqual(takes, sizes["other"] + (8 + 4 + 4) * N)
            self.assertLess(takes, sizes["other"] + (8 + 4 + 4) * N + 1000)
            self.assertIn("are left of --max-memory; raise it", lines[0])
            self.check(daemon, "box", self.scene)
            # It is the sum that counts: without box there is room.
            box.unlink()
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 2 scenes")  # box stays as read before
            self.assertEqual(self.names(daemon), ["box", "small"])
        with serve_first(other, small, "--threads", 1, "--max-memory", room) as daemon:
            self.assertEqual(self.names(daemon), ["other", "small"])
        ended = subprocess.run([LAMBERTD, "--listen", "127.0.0.1:0", str(other), "--max-memory", "64K"],
                               capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual((ended.returncode, "no store can be served" in ended.stderr), (1, True), ended.stderr)
        # The arrays fit, the threads' work areas do not.
        ended = subprocess.run([LAMBERTD, "--listen", "127.0.0.1:0", str(other), "--threads", "64", "--max-memory",
                                str(sizes["other"] + 32 * N + 4096)], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(ended.returncode, 1)
        self.assertRegex(ended.stderr, r"takes \d+ bytes, and 64 threads \d+ each to solve, of --max-memory")


if __name__ == "__main__":
    unittest.main()
