"""Materials at run time: variants of a scene, built in the background, against the same scene in double."""

import json
import os
import pathlib
import shutil
import signal
import tempfile
import threading
import time
import unittest
import urllib.parse

import h5py
import numpy as np

from command import must
from daemon import PATIENCE, Daemon
from make_store import Scene

N = 60
TOLERANCE = 1e-5  # as in test_daemon_answers.py: U, V and the core rounded, sums of 60 and 5 terms
TOKEN = "s3cret"
RED = {"wall": [.6, .1, .1], "box": .05}


class Variants(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "token").write_text(TOKEN)

    def store(self, file="colour.h5", name="colour", channels=3, keep_factors=True, n=N, **more):
        scene = Scene(n, channels=channels, **more.pop("scene", {}))
        scene.write(self.folder / file, name, keep_factors=keep_factors, **more)
        return scene

    def daemon(self, *files, most=4, token=True):
        secret = ("--token-file", self.folder / "token") if token else ()
        return Daemon(*(self.folder / f for f in files or ("colour.h5",)), "--threads", 2, "--max-variants", most, *secret)

    @staticmethod
    def ask(daemon, method, path, body=None, kind="application/json", token=TOKEN, connection=None):
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        if body is not None and kind:
            headers["Content-Type"] = kind
        if body is not None and not isinstance(body, (str, bytes)):
            body = json.dumps(body)
        return daemon.ask(method, path, body, headers, connection=connection)

    def put(self, daemon, groups, variant="red", scene="colour", **more):
        return self.ask(daemon, "PUT", f"/v1/scenes/{scene}/reflectance", {"variant": variant, "groups": groups}, **more)

    def until(self, daemon, path, wanted, meanwhile=(202,)):
        """The first answer of GET that has the status wanted; those before it are of meanwhile."""
        deadline = time.monotonic() + PATIENCE
        while (answer := self.ask(daemon, "GET", path)).status != wanted:
            self.assertIn(answer.status, meanwhile, answer)
            self.assertLess(time.monotonic(), deadline, path)
            if answer.status == 202:
                self.assertEqual(answer.json(), {"status": "building"})
            time.sleep(.002)
        return answer

    def made(self, daemon, groups, variant="red", scene="colour"):
        answer = self.put(daemon, groups, variant, scene)
        self.assertEqual((answer.status, answer.json()), (202, {"status": "building"}), answer)
        self.assertEqual(answer.headers["Location"], f"../{scene}@{variant}")
        return self.until(daemon, self.path_of(answer, scene), 200).json()

    def path_of(self, answer, scene):
        """The path that Location leads to, from that of the request."""
        return urllib.parse.urljoin(f"/v1/scenes/{scene}/reflectance", answer.headers["Location"])

    def solve(self, daemon, name, E, quantity="radiosity", **more):
        body = {"emission": E.tolist() if isinstance(E, np.ndarray) else E, "quantity": quantity, **more}
        return self.ask(daemon, "POST", f"/v1/scenes/{name}/radiosity", body)

    def check(self, daemon, name, truth, channels=3):
        E = np.random.default_rng(3).random((channels, N))
        for quantity in "radiosity", "irradiance", "indirect":
            answer = self.solve(daemon, name, E, quantity)
            self.assertEqual(answer.status, 200, answer)
            wanted = truth.solve(E, quantity)
            given = np.array(answer.json()[quantity]).reshape(channels, N)
            self.assertLessEqual(np.abs(given - wanted).max(), TOLERANCE * wanted.max(), (name, quantity))

    def problem(self, answer, status, *words):
        self.assertEqual(answer.status, status, answer)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        what = answer.json()
        self.assertEqual(what["status"], status)
        for word in words:
            self.assertIn(word, what["detail"])
        return what

    def test_a_variant_answers_as_the_scene_would(self):
        scene = self.store(sky=7)
        with self.daemon() as daemon:
            about = self.made(daemon, RED)
            truth = scene.relit(RED)
            self.check(daemon, "colour@red", truth)
            self.check(daemon, "colour", scene)
            # The two differ by far more than the tolerance: neither answers for the other.
            E = np.ones((3, N))
            self.assertGreater(np.abs(truth.solve(E) - scene.solve(E)).max(), 1000 * TOLERANCE * scene.solve(E).max())
            # The sky, groups and selections are those of the scene.
            L = np.arange(1., 8.)
            answer = self.solve(daemon, "colour@red", {"groups": {"lamp": [3, 2, 1]}, "sky": L.tolist()},
                                select={"groups": ["wall"]}).json()
            E = np.zeros((3, N))
            E[:, scene.members("lamp")] = np.array([3, 2, 1])[:, None]
            wanted = truth.solve(E, L=np.broadcast_to(L, (3, 7)))[:, scene.members("wall")]
            self.assertLess(np.abs(np.array(answer["radiosity"]) - wanted).max(), TOLERANCE * wanted.max())
            self.assertEqual(answer["scene"], "colour@red")
            # Figures measured under other reflectances are not its own.
            self.assertEqual((set(answer["error"]), answer["error"]["stated"]), ({"stated", "advice"}, None))
            self.assertIn("relative_mean", self.solve(daemon, "colour", {"groups": {"lamp": 1}}).json()["error"])
            base = self.ask(daemon, "GET", "/v1/scenes/colour").json()
            self.assertEqual(about, {**base, "name": "colour@red", "bytes": 3 * 5 * 5 * 4, "error": {},
                                     "variant_of": "colour", "reflectance": RED})
            listed = self.ask(daemon, "GET", "/v1/scenes").json()["scenes"]
            self.assertEqual([s["name"] for s in listed], ["colour", "colour@red"])
            self.assertEqual(listed[1], {**listed[0], "name": "colour@red", "bytes": 300})

    def test_its_own_reflectance_changes_nothing(self):
        scene = self.store()
        with self.daemon() as daemon:
            self.made(daemon, {}, "same")
            self.check(daemon, "colour@same", scene)

    def test_grey_and_black(self):
        # Elements that reflected nothing reflect, and the other way round; a fifth of the scene has neither.
        scene = self.store("grey.h5", "grey", channels=1)
        with self.daemon("grey.h5") as daemon:
            for variant, groups in (("white", {"floor": .9, "box.red": [.5]}), ("black", {"wall": 0, "box": 0}),
                                    ("dark", {g: 0 for g in scene.group_names})):
                self.made(daemon, groups, variant, "grey")
                self.check(daemon, f"grey@{variant}", scene.relit(groups), channels=1)

    def test_reflectances_that_count_as_none(self):
        """g / rho passes the range of single precision where rho lies below its normal numbers."""
        scene = self.store("grey.h5", "grey", channels=1, scene={"rank": 1})
        black = scene.relit({"floor": 0, "lamp": 0})
        tiny = scene.relit({"floor": 1e-45, "lamp": 1e-44})
        tiny.write(self.folder / "tiny.h5", "tiny", keep_factors=True)
        ask = {"emission": {"groups": {"lamp": 1, "wall": 1}}, "quantity": "irradiance"}
        E = np.where(np.isin(scene.group, [scene.group_names.index(g) for g in ("lamp", "wall")]), 1.0, 0.0)[None]
        wanted = black.solve(E, "irradiance")[0]
        floor = scene.members("floor")
        mean = wanted[floor] @ scene.area[floor] / scene.area[floor].sum()
        with self.daemon("grey.h5", "tiny.h5") as daemon:
            self.made(daemon, {"floor": 1e-45, "lamp": 1e-44}, "t", "grey")
            for name in "grey@t", "tiny":
                answer = self.ask(daemon, "POST", f"/v1/scenes/{name}/radiosity",
                                  {**ask, "reduce": {"groups": ["floor"], "with": ["mean", "sum"]}})
                self.assertEqual(answer.status, 200, answer)
                self.assertAlmostEqual(answer.json()["groups"]["floor"]["mean"] / mean, 1, delta=TOLERANCE)
                given = np.array(self.ask(daemon, "POST", f"/v1/scenes/{name}/radiosity", ask).json()["irradiance"])
                self.assertLessEqual(np.abs(given - wanted).max(), TOLERANCE * wanted.max())

    def test_a_variant_is_replaced_whole(self):
        scene = self.store()
        with self.daemon(most=1) as daemon:
            self.made(daemon, RED)
            self.made(daemon, {"floor": .25})
            # The walls of the first one are forgotten: a group that is not named has the scene's reflectance.
            self.check(daemon, "colour@red", scene.relit({"floor": .25}))

    def test_byte_order_marks(self):
        scene = self.store()
        text = json.dumps({"variant": "red", "groups": {"floor": .25}})
        with self.daemon() as daemon:
            path = "/v1/scenes/colour/reflectance"
            self.assertEqual(self.ask(daemon, "PUT", path, b"\xef\xbb\xbf" + text.encode()).status, 202)
            self.until(daemon, "/v1/scenes/colour@red", 200)
            self.check(daemon, "colour@red", scene.relit({"floor": .25}))
            self.problem(self.ask(daemon, "PUT", path, text.encode("utf-16")), 400, "UTF-16")
            self.problem(self.ask(daemon, "PUT", path, b"\xef\xbb\xbf{x"), 400, "at byte 5")

    def test_names(self):
        self.store("a b.h5")
        with self.daemon("a b.h5") as daemon:
            answer = self.put(daemon, RED, "weiß~1", scene="a%20b")
            self.assertEqual(self.path_of(answer, "a%20b"), "/v1/scenes/a%20b@wei%C3%9F~1")
            self.assertEqual(self.until(daemon, self.path_of(answer, "a%20b"), 200).json()["name"], "a b@weiß~1")

    def test_it_is_what_precompute_makes(self):
        """Of a scene whose left wall has another colour: the same U and V, and the core that the variant gets."""
        left, kd = [.1, .2, .7], "Kd 0.1 0.2 0.7"
        must("generate", "cornell", "--elements", 300, "-o", self.folder / "box.obj")
        (self.folder / "blue").mkdir()
        shutil.copy(self.folder / "box.obj", self.folder / "blue/box.obj")
        materials = (self.folder / "box.mtl").read_text().split("newmtl ")
        (self.folder / "blue/box.mtl").write_text("newmtl ".join(
            m.replace(m.splitlines()[1], kd) if m.startswith("red") else m for m in materials))
        for method in ("--method", "low-rank"), ("--method", "2msc"):
            how = (*method, "--rank", 50, "--rays", 256, "--probes", 0, "--quiet")
            for stem in "box", "blue/box":
                must("precompute", self.folder / f"{stem}.obj", "-o", self.folder / f"{stem}.h5", *how)
            with h5py.File(self.folder / "blue/box.h5") as f:
                rho, op = f["mesh/reflectance"][()].astype(float), f["operator"]
                U, core = op["U"][()].astype(float), op["core"][()].astype(float)
                V = np.abs(op["V"][()].astype(float)) if "V" in op else np.repeat(np.eye(50), np.diff(op["I"][()]).astype(int), axis=0)
                n = len(U)
            with Daemon(f"{self.folder / 'box.h5'}:box", f"{self.folder / 'blue/box.h5'}:blue", "--max-variants", 1,
                        "--token-file", self.folder / "token") as daemon:
                self.made(daemon, {"left-wall": left}, "blue", "box")
                E = np.random.default_rng(3).random((3, n))
                given = {name: np.array(self.solve(daemon, name, E).json()["radiosity"])
                         for name in ("box", "blue", "box@blue")}
            # A core summed by another number of threads may be rounded the other way.
            most = 2**-23 * (np.abs(U) @ np.abs(core) @ V.sum(axis=0)[:, None]).max()
            self.assertLessEqual(np.abs(given["box@blue"] - given["blue"]).max(), most, method)
            self.assertGreater(np.abs(given["box"] - given["blue"]).max(), 1000 * most, method)

    def test_metrics_count_factors_once(self):
        self.store()
        with self.daemon() as daemon:
            held = []
            for _ in range(2):
                lines = daemon.get("/metrics").body.decode().splitlines()
                held.append([int(line.split()[-1]) for line in lines if line.startswith("lambertd_operator_bytes ")][0])
                self.made(daemon, RED)
            self.assertEqual(held[1] - held[0], 3 * 5 * 5 * 4)

    def test_delete(self):
        scene = self.store()
        with self.daemon() as daemon:
            for how in (lambda: self.ask(daemon, "DELETE", "/v1/scenes/colour@red"),
                        lambda: self.ask(daemon, "DELETE", "/v1/scenes/colour@red/reflectance"),
                        lambda: self.ask(daemon, "DELETE", "/v1/scenes/colour/reflectance", {"variant": "red"})):
                self.problem(how(), 404)
                self.made(daemon, RED)
                answer = how()
                self.assertEqual((answer.status, answer.body), (204, b""))
                self.problem(self.ask(daemon, "GET", "/v1/scenes/colour@red"), 404)
                self.problem(self.solve(daemon, "colour@red", {"groups": {"lamp": 1}}), 404)
                self.problem(how(), 404)
            answer = self.ask(daemon, "DELETE", "/v1/scenes/colour")
            self.problem(answer, 405, "is a store")
            self.assertEqual(answer.headers["Allow"], "GET, HEAD")
            self.problem(self.ask(daemon, "DELETE", "/v1/scenes/colour/reflectance"), 422, "which variant")
            self.problem(self.ask(daemon, "DELETE", "/v1/scenes/colour/reflectance", {"groups": {}}), 422, "groups")
            self.problem(self.ask(daemon, "DELETE", "/v1/scenes/colour/reflectance", "[", ), 400)
            self.check(daemon, "colour", scene)

    def test_refused_before_the_body(self):
        self.store()
        self.store("grey.h5", "grey", channels=1, keep_factors=False)
        self.store("exact.h5", "exact", kind="exact")
        with self.daemon("colour.h5", "grey.h5", "exact.h5") as daemon:
            for name in "grey", "exact":
                self.problem(self.put(daemon, RED, scene=name), 409, "keeps no factors", "--keep-factors")
            self.problem(self.put(daemon, RED, scene="none"), 404)
            for token in None, "wrong":
                for method in "PUT", "DELETE":
                    self.problem(self.ask(daemon, method, "/v1/scenes/colour/reflectance", "{}", token=token), 401)
            self.problem(self.ask(daemon, "PUT", "/v1/scenes/colour/reflectance", "{}", kind="application/x-npy"), 415)
            self.problem(self.ask(daemon, "PUT", "/v1/scenes/colour/reflectance", " " * (9 << 20)), 413)
            self.made(daemon, RED)
            self.problem(self.put(daemon, RED, scene="colour@red"), 409, "variant itself")
        with self.daemon(token=False) as daemon:
            self.problem(self.put(daemon, RED), 403, "--token-file")
            self.assertRegex(daemon.get("/metrics").body.decode(), r'lambertd_requests_total\{route=".*",status="403"\} 1')
        with self.daemon(most=0) as daemon:
            self.problem(self.put(daemon, RED), 403, "--max-variants")
            self.problem(self.ask(daemon, "DELETE", "/v1/scenes/colour@red"), 404)

    def test_bad_bodies(self):
        self.store()
        self.store("grey.h5", "grey", channels=1)
        good = '"variant":"red"'
        with self.daemon("colour.h5", "grey.h5") as daemon:
            for body, status, words, pointer in (
                    ("", 400, "not JSON", None), ("{", 400, "not JSON", None), ("{}x", 400, "not JSON", None),
                    ('{"variant":"red","groups":{"wall":NaN}}', 400, "not JSON", None),
                    (b'{"variant":"\xff","groups":{}}', 400, "not JSON", None),
                    ("[" * 100000, 400, "not JSON", None),
                    ("3", 422, "object", None), ("{}", 422, "groups", "/groups"), ("{%s}" % good, 422, "groups", "/groups"),
                    ('{%s,"groups":[]}' % good, 422, "groups", "/groups"),
                    ('{"groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":3,"groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":"","groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":"a/b","groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":"a@b","groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":"a b","groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":"a\\n","groups":{}}', 422, "variant", "/variant"),
                    ('{"variant":"%s","groups":{}}' % ("x" * 101), 422, "variant", "/variant"),
                    ('{"variant":"a\\u0000b","groups":{}}', 422, "NUL", None),
                    ('{%s,"groups":{"a\\u0000":1}}' % good, 422, "NUL", None),
                    ('{%s,"groups":{},"more":1}' % good, 422, "more", None),
                    ('{%s,"groups":{},"groups":{}}' % good, 422, "twice", None),
                    ('{%s,"groups":{"wall":.1}}' % good, 400, "not JSON", None),
                    ('{%s,"groups":{"wall":0.1,"wall":0.2}}' % good, 422, "twice", None),
                    ('{%s,"groups":{"box.red":0.1,"box":0.2}}' % good, 422, "box.red is given twice", "/groups/box"),
                    ('{%s,"groups":{"a/~b":0.1}}' % good, 422, "no group \"a/~b\"", "/groups/a~1~0b"),
                    ('{%s,"groups":{"%s":0.1}}' % (good, "y" * 1000), 422, "no group", None),
                    ('{%s,"groups":{"wall":1}}' % good, 422, "wall = 1, must be at least 0 and below 1", "/groups/wall"),
                    ('{%s,"groups":{"wall":0.99999999}}' % good, 422, "below 1", "/groups/wall"),
                    ('{%s,"groups":{"wall":[0.1,0.2,-0.1]}}' % good, 422, "wall = -0.1", "/groups/wall/2"),
                    ('{%s,"groups":{"wall":1e999}}' % good, 422, "beyond double", None),
                    ('{%s,"groups":{"wall":1%s}}' % (good, "0" * 30), 422, "below 1", "/groups/wall"),
                    ('{%s,"groups":{"wall":"0.1"}}' % good, 422, "number", "/groups/wall"),
                    ('{%s,"groups":{"wall":[0.1,null,0.1]}}' % good, 422, "number", "/groups/wall/1"),
                    ('{%s,"groups":{"wall":[0.1,0.1]}}' % good, 422, "2 values", "/groups/wall"),
                    ('{%s,"groups":{"wall":[]}}' % good, 422, "0 values", "/groups/wall")):
                with self.subTest(body=body[:60]):
                    what = self.problem(self.ask(daemon, "PUT", "/v1/scenes/colour/reflectance", body), status, words)
                    self.assertEqual(what.get("pointer"), pointer)
            self.problem(self.put(daemon, RED, scene="grey"), 422, "3 values", "must be a number or 1")
            listed = self.ask(daemon, "GET", "/v1/scenes").json()["scenes"]
            self.assertEqual([s["name"] for s in listed], ["colour", "grey"])

    def test_no_more_than_allowed(self):
        scene = self.store()
        with self.daemon(most=2) as daemon:
            self.made(daemon, RED, "one")
            # One that waits counts as one that is served.
            self.assertEqual(self.put(daemon, RED, "two").status, 202)
            answer = self.put(daemon, RED, "three")
            self.problem(answer, 429, "2 variants", "--max-variants")
            self.assertEqual(answer.headers["Retry-After"], "1")
            self.made(daemon, {"floor": .1}, "one")
            self.assertEqual(self.ask(daemon, "DELETE", "/v1/scenes/colour@one").status, 204)
            self.made(daemon, RED, "three")
            self.check(daemon, "colour@three", scene.relit(RED))

    def test_a_name_that_a_store_has(self):
        self.store()
        self.store("colour@red.h5")
        with self.daemon("colour.h5", "colour@red.h5") as daemon:
            self.problem(self.put(daemon, RED), 409, "taken by a store")
            self.problem(self.ask(daemon, "DELETE", "/v1/scenes/colour@red"), 405)

    def test_what_cannot_be_built_is_told(self):
        # No scene, but a store may say so: rows of F sum to 2, and 1 - 2 * .5 = 0, exactly.
        scene = Scene(N, channels=1, rank=1)
        scene.U, scene.V = np.full((N, 1), 1 / 16), np.where(np.arange(N) < 32, 1.0, 0.0)[:, None]
        scene.rho[:] = .25
        scene.core = np.full((1, 1, 1), 2.0)
        scene.write(self.folder / "two.h5", "two", keep_factors=True)
        half = {group: .5 for group in scene.group_names}
        with self.daemon("two.h5", most=1) as daemon:
            self.made(daemon, {"wall": .3}, "x", "two")
            before = self.solve(daemon, "two@x", [1.0] * N).json()["radiosity"]
            self.assertEqual(self.put(daemon, half, "x", "two").status, 202)
            what = self.until(daemon, "/v1/scenes/two@x", 422)
            self.problem(what, 422, "two@x could not be built", "nearly singular")
            # The variant that was served is served on; the other can be tried again, or deleted.
            self.assertEqual(self.solve(daemon, "two@x", [1.0] * N).json()["radiosity"], before)
            self.made(daemon, {"wall": .3}, "x", "two")
            self.assertEqual(self.ask(daemon, "DELETE", "/v1/scenes/two@x").status, 204)
            self.assertEqual(self.put(daemon, half, "y", "two").status, 202)
            self.until(daemon, "/v1/scenes/two@y", 422)
            self.problem(self.solve(daemon, "two@y", [1.0] * N), 422, "nearly singular")
            self.problem(self.put(daemon, {}, "x", "two"), 429)
            self.assertEqual(self.ask(daemon, "DELETE", "/v1/scenes/two@y").status, 204)
            self.problem(self.ask(daemon, "GET", "/v1/scenes/two@y"), 404)

    def slow_store(self, n=2000, channels=3):
        """A variant of it takes long to build: many columns. Of few elements, it is the inversion that does."""
        rng = np.random.default_rng(5)
        scene = Scene(n, channels=channels)
        scene.rank = 1500
        scene.U, scene.V = rng.random((n, 1500)) / 2000, rng.random((n, 1500)) / 2000
        scene.core = np.stack([np.eye(1500)] * channels)
        scene.write(self.folder / "slow.h5", "slow", keep_factors=True)
        return scene

    def test_others_are_served_meanwhile(self):
        self.slow_store()
        scene = self.store()
        with self.daemon("slow.h5", "colour.h5") as daemon:
            refused = 0
            while not refused:  # again, where it was built before it could be asked
                self.ask(daemon, "DELETE", "/v1/scenes/slow@red")
                self.assertEqual(self.put(daemon, RED, scene="slow").status, 202)
                status = 202
                while status == 202:
                    answer = self.solve(daemon, "slow@red", {"groups": {"lamp": 1}}, select={"elements": [1]})
                    if answer.status != 200:
                        self.problem(answer, 503, "slow@red is being built")
                        self.assertEqual(answer.headers["Retry-After"], "1")
                        refused += 1
                        self.check(daemon, "colour", scene)
                    status = self.ask(daemon, "GET", "/v1/scenes/slow@red").status
                self.assertEqual(status, 200)
            self.assertEqual(self.put(daemon, RED).status, 202)
            self.until(daemon, "/v1/scenes/colour@red", 200)

    def test_what_is_being_built_can_be_deleted_and_replaced(self):
        self.slow_store()
        scene = self.store()
        with self.daemon("slow.h5", "colour.h5", most=3) as daemon:
            self.assertEqual(self.put(daemon, RED, scene="slow").status, 202)
            for path in "colour@red", "slow@red":
                self.assertEqual(self.put(daemon, RED).status, 202)
                self.assertEqual(self.ask(daemon, "DELETE", f"/v1/scenes/{path}/reflectance").status, 204)
                self.problem(self.ask(daemon, "GET", f"/v1/scenes/{path}"), 404)
            for rho in .1, .2, .3, .4:
                self.assertEqual(self.put(daemon, {"wall": rho}).status, 202)
            self.until(daemon, "/v1/scenes/colour@red", 200)
            self.check(daemon, "colour@red", scene.relit({"wall": .4}))
            # The end does not wait for what nobody will ask.
            for i in range(3):
                self.put(daemon, {"wall": i / 10}, scene="slow")
            daemon.stop()

    def test_what_was_deleted_does_not_come_back(self):
        self.slow_store(n=60, channels=1)
        self.store()
        with self.daemon("slow.h5", "colour.h5") as daemon:
            for i in range(6):
                self.assertEqual(self.put(daemon, {"wall": .5}, scene="slow").status, 202)
                time.sleep(.02)  # on the way, as a rule; whatever it is, the end is the same
                self.assertEqual(self.ask(daemon, "DELETE", "/v1/scenes/slow@red").status, 204)
                # One after the other: when the next is ready, so is the one before.
                self.made(daemon, RED, str(i % 2))
                self.problem(self.ask(daemon, "GET", "/v1/scenes/slow@red"), 404)

    def reload(self, daemon, times):
        daemon.signal(signal.SIGHUP)
        daemon.wait_for("reloaded:", times)

    def test_reload(self):
        scene = self.store()
        self.store("grey.h5", "grey", channels=1)
        with self.daemon("colour.h5", "grey.h5") as daemon:
            self.made(daemon, RED)
            self.made(daemon, {"wall": .5}, "pale", "grey")
            # The same files: variants stay.
            for times in 1, 2:
                self.reload(daemon, times)
                self.check(daemon, "colour@red", scene.relit(RED))
                self.check(daemon, "colour", scene)
            # Another scene under the same name: they are gone, others not; a broken one changes nothing.
            other = self.store(scene={"seed": 8})
            (self.folder / "copy.h5").write_bytes(b"")
            os.replace(self.folder / "copy.h5", self.folder / "grey.h5")
            self.reload(daemon, 3)
            self.assertIn("dropped colour@red", daemon.errors())
            self.assertIn("kept the grey", daemon.errors())
            self.problem(self.ask(daemon, "GET", "/v1/scenes/colour@red"), 404)
            self.assertEqual(self.ask(daemon, "GET", "/v1/scenes/grey@pale").status, 200)
            self.check(daemon, "colour", other)
            self.made(daemon, RED)
            self.check(daemon, "colour@red", other.relit(RED))

    def test_everything_at_once(self):
        """Solves of base and variant while variants come and go and stores are read again."""
        scene = self.store()
        truths = {rho: scene.relit({"wall": rho}) for rho in (.1, .3, .7)}
        E = np.random.default_rng(3).random((3, N))
        wanted = [t.solve(E) for t in truths.values()]
        failures, stop = [], threading.Event()

        def close(given, truth):
            return np.abs(np.array(given) - truth).max() < TOLERANCE * truth.max()

        def client(name, allowed):
            try:
                connection = daemon.connect()
                while not stop.is_set():
                    answer = self.ask(daemon, "POST", f"/v1/scenes/{name}/radiosity", {"emission": E.tolist()},
                                      connection=connection)
                    if answer.status == 200:
                        if not any(close(answer.json()["radiosity"], w) for w in allowed):
                            failures.append((name, "a wrong answer"))
                    elif name == "colour" or answer.status not in (404, 503):
                        failures.append((name, answer))
                    self.ask(daemon, "GET", "/v1/scenes", connection=connection)
                    self.ask(daemon, "GET", "/metrics", connection=connection)
                connection.close()
            except Exception as failure:
                failures.append((name, failure))

        with self.daemon(most=3) as daemon:
            clients = [threading.Thread(target=client, args=("colour", [scene.solve(E)]))]
            clients += [threading.Thread(target=client, args=(f"colour@{v}", wanted)) for v in ("a", "b")]
            for c in clients:
                c.start()
            try:
                for i in range(60):
                    variant = "ab"[i % 2]
                    self.assertEqual(self.put(daemon, {"wall": (.1, .3, .7)[i % 3]}, variant).status, 202)
                    if i % 3:
                        self.until(daemon, f"/v1/scenes/colour@{variant}", 200)
                    if i % 7 == 0:
                        self.ask(daemon, "DELETE", f"/v1/scenes/colour@{variant}")
                    if i % 10 == 0:
                        daemon.signal(signal.SIGHUP)
            finally:
                stop.set()
                for c in clients:
                    c.join()
            self.assertEqual(failures, [])
            self.check(daemon, "colour", scene)


if __name__ == "__main__":
    unittest.main()
