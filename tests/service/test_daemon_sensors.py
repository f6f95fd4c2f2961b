"""Black box: the sensors of a store over HTTP. Values, figures, derivatives and gradients are held against sums in double of what h5py
would read, and of every kind of operator against the daemon's own radiosities."""

import concurrent.futures
import io
import json
import pathlib
import tempfile
import time
import unittest

import h5py
import numpy as np

from command import must
from daemon import PATIENCE, Daemon
from make_store import Luminaires, Scene, Sensors, add_checksums
from test_luminaires import GREY, KINDS, LIT, TOLERANCE, dimmers
from yard import Truth, precompute_yard

# As SAME of test_luminaires.py: sums in single precision of numbers whose last bits differ.
SAME = 2e-6
SETS = ["room.a", "faces"]


def numbers(answer, member="irradiance"):
    """null becomes NaN."""
    return np.array(answer[member], float)


class Case(unittest.TestCase):
    def post(self, path, body, method="POST", accept="application/json"):
        return self.daemon.ask(method, path, json.dumps(body), {"Authorization": "Bearer secret", "Content-Type": "application/json",
                                                                "Accept": accept})

    def ask(self, name, body, to="radiosity"):
        answer = self.post(f"/v1/scenes/{name}/{to}", body)
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def close(self, got, wanted, what, tolerance=TOLERANCE):
        wanted = np.asarray(wanted, float)
        got = np.asarray(got, float).reshape(wanted.shape)
        np.testing.assert_array_equal(np.isnan(got), np.isnan(wanted), str(what))
        self.assertLessEqual(np.nanmax(np.abs(got - wanted)), tolerance * np.nanmax(np.abs(wanted)), what)


class Answers(Case):
    """Of stores whose answers are known."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-sensors-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        cls.scenes = {
            "grey": Scene(60, seed=1).write(path / "grey.h5", "grey", sky=6),
            "exact": Scene(40, seed=2).write(path / "exact.h5", "exact", kind="exact", error=False),
            "colour": Scene(50, channels=3, seed=4).write(path / "colour.h5", "colour", sky=4)}
        cls.tiles = {"grey": 6, "exact": 0, "colour": 4}
        cls.lights, cls.sensors = {}, {}
        for k, (name, scene) in enumerate(cls.scenes.items()):
            cls.lights[name] = l = Luminaires(scene.n, scene.channels, seed=k).add_to(path / f"{name}.h5")
            cls.sensors[name] = Sensors(scene.n, scene.channels, cls.tiles[name], l, seed=k).add_to(path / f"{name}.h5")
        Scene(30).write(path / "plain.h5", "plain")
        (path / "token").write_text("secret\n")
        cls.daemon = Daemon("--stores", path, "--max-variants", 2, "--token-file", path / "token")
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def lit(self, name):
        """A request of all kinds of light, and its E, L and D."""
        scene, m = self.scenes[name], self.tiles[name]
        of = LIT if scene.channels == 3 else GREY
        E = np.zeros((scene.channels, scene.n))
        E[:, scene.members("lamp")] = 2
        L = np.broadcast_to(np.arange(m) / 4, (scene.channels, m))
        emission = {"luminaires": of, "groups": {"lamp": 2}}
        if m:
            emission["sky"] = L[0].tolist()
        return emission, E, L if m else None, dimmers(self.lights[name], of)

    def truth(self, name, E, L, D, scene=None):
        scene = scene or self.scenes[name]
        H0 = self.lights[name].direct(D)
        if L is not None:
            H0 = H0 + L @ scene.first_bounce(L.shape[-1]).astype(float)
        return self.sensors[name].values(scene.solve(E + scene.rho * H0), L, D)

    def test_values(self):
        for name, scene in self.scenes.items():
            emission, *light = self.lit(name)
            wanted = self.truth(name, *light)[:, self.sensors[name].rows(SETS)]
            body = {"emission": emission, "select": {"sensors": SETS}, "limit": False}
            got = self.ask(name, body)
            self.assertEqual((got["quantity"], got["at"], got["unit"]), ("irradiance", "sensors", "lx"))
            self.close(numbers(got), wanted, name)
            if scene.channels == 1:
                self.close(numbers(self.ask(name, dict(body, unit="klx"))), wanted / 1e3, name)
            answer = self.post(f"/v1/scenes/{name}/radiosity", body, accept="application/x-npy")
            self.close(np.load(io.BytesIO(answer.body)), wanted, name)
            # Sets of a common beginning, one receiver of which has no value.
            both = numbers(self.ask(name, dict(body, select={"sensors": ["room"]})))
            self.close(both, self.truth(name, *light)[:, self.sensors[name].rows(["room.a", "room.b"])], name)
            self.assertEqual(np.isnan(both).sum(), scene.channels)

    def test_batches_have_the_same_bits(self):
        emissions = [self.lit("colour")[0], {"groups": {"lamp": 1}}, {"luminaires": {"*": 1}}, {"elements": [3], "values": [2]}] * 5
        for more in {"select": {"sensors": SETS}}, {"reduce": {"sensors": SETS, "with": ["mean", "min"]}}:
            many = self.ask("colour", {"emissions": emissions, **more})
            for k, one in enumerate(emissions[:4]):
                alone = self.ask("colour", {"emission": one, **more})
                if "select" in more:
                    self.assertEqual(alone["irradiance"], many["irradiance"][k], k)
                    continue
                # An element that emits has no column: the batch is answered by vectors.
                for sensors in SETS:
                    self.close(alone["sensors"][sensors]["mean"], many["sensors"][sensors]["mean"][k], k, SAME)

    def test_figures(self):
        """By columns, which groups, luminaires and tiles have, and by vectors, which a single element asks for."""
        for name, scene in self.scenes.items():
            emission, E, L, D = self.lit(name)
            x = self.truth(name, E, L, D)
            limits = [float(np.nanmean(x)), 0, float(np.nanmax(x) * 2)]
            body = {"emission": emission, "limit": False,
                    "reduce": {"sensors": ["room", *SETS], "at_least": limits,
                               "with": ["mean", "min", "share", "max", "uniformity", "variance"]}}
            more = {key: value for key, value in emission.items() if key != "groups"}
            more.update(elements=scene.members("lamp").tolist(), values=[2] * len(scene.members("lamp")))
            for one in body, body, dict(body, emission=more):
                got = self.ask(name, one)["sensors"]
                self.assertEqual(list(got), ["room", *SETS])
                for sensors in got:
                    rows = self.sensors[name].rows(["room.a", "room.b"] if sensors == "room" else [sensors])
                    part = x[:, rows][:, ~np.isnan(x[0, rows])]
                    wanted = {"mean": part.mean(1), "min": part.min(1), "max": part.max(1), "uniformity": part.min(1) / part.mean(1),
                              "variance": part.var(1)}
                    for figure, values in wanted.items():
                        self.close(got[sensors][figure], values if len(values) > 1 else values[0], (name, sensors, figure), 5e-5)
                    self.assertEqual(list(got[sensors]), body["reduce"]["with"])
                    for limit, share in got[sensors]["share"].items():
                        np.testing.assert_allclose(np.ravel(share), (part >= float(limit)).mean(1), rtol=1e-9)
            dark = self.ask(name, {"emission": {"luminaires": {}}, "reduce": {"sensors": ["faces"], "with": ["mean", "uniformity"]}})
            self.assertFalse(np.any(dark["sensors"]["faces"]["mean"]))

    def test_shares_of_groups(self):
        scene = self.scenes["grey"]
        emission, E, L, D = self.lit("grey")
        H0 = self.lights["grey"].direct(D) + L @ scene.first_bounce(6).astype(float)
        B, wall = scene.solve(E + scene.rho * H0)[0], scene.members("wall")
        limit = float(np.median(B[wall]) * 1.001)
        got = self.ask("grey", {"emission": emission, "limit": False,
                                "reduce": {"groups": ["wall"], "with": ["share", "mean"], "at_least": [limit]}})["groups"]["wall"]
        A = scene.area[wall]
        self.assertAlmostEqual(*got["share"].values(), A[B[wall] >= limit].sum() / A.sum(), places=9)

    def test_derivatives(self):
        """Each column is the answer to its light alone, in single and in double."""
        for name, scene in self.scenes.items():
            C, m, l, rows = scene.channels, self.tiles[name], self.lights[name], self.sensors[name].rows(SETS)
            got = self.ask(name, {"of": {"sensors": SETS}}, "jacobian")
            kinds = ["luminaires", "groups"] + (["sky"] if m else [])
            self.assertEqual(list(got["jacobian"]), kinds)
            self.assertEqual(got["sensors"], {"room.a": 5, "faces": 4})
            self.assertEqual(got["columns"]["luminaires"], list(l.names))
            for kind in kinds:
                J = numbers(got["jacobian"], kind)
                J = J if C > 1 else J[None]
                for k in range(J.shape[2]):
                    E, L, D = np.zeros((C, scene.n)), np.zeros((C, m)) if m else None, np.zeros((C, len(l.names)))
                    if kind == "luminaires":
                        D[:, k], emission = 1, {"luminaires": {l.names[k]: 1}}
                    elif kind == "groups":
                        group = got["columns"]["groups"][k]
                        E[:, scene.members(group)], emission = 1, {"groups": {group: 1}}
                    else:
                        L[:, k], emission = 1, {"sky": np.eye(m)[k].tolist()}
                    wanted = self.truth(name, E, L, D)[:, rows]
                    self.close(J[:, :, k], wanted, (name, kind, k))
                    single = numbers(self.ask(name, {"emission": emission, "select": {"sensors": SETS}, "limit": False}))
                    self.close(J[:, :, k], single.reshape(C, -1), (name, kind, k), SAME)
                answer = self.post(f"/v1/scenes/{name}/jacobian", {"of": {"sensors": SETS}, "by": [kind]}, accept="application/x-npy")
                np.testing.assert_array_equal(np.load(io.BytesIO(answer.body)), np.float32(J if C > 1 else J[0]))

    def test_gradients(self):
        """J = sum g values: by its own derivatives, and by reflectance against differences of the truth."""
        rng = np.random.default_rng(3)
        for name, scene in self.scenes.items():
            C, l, s = scene.channels, self.lights[name], self.sensors[name]
            g = np.zeros((C, s.s))
            g[:, s.rows(SETS)] = rng.integers(-8, 8, (C, 9)) / 8
            each = {key: {"values": g[:, s.rows([key])].tolist() if C > 1 else g[0, s.rows([key])].tolist()} for key in SETS}
            J = self.ask(name, {"of": {"sensors": list(s.NAMES)}}, "jacobian")["jacobian"]
            kinds = list(J)
            got = self.ask(name, {"cotangent": {"sensors": each}, "gradient": kinds}, "adjoint")
            self.assertEqual((got["quantity"], got["at"]), ("irradiance", "sensors"))
            for kind in kinds:
                columns = np.nan_to_num(numbers(J, kind).reshape(C, s.s, -1))
                wanted = np.einsum("cs,csk->ck", g, columns)
                size = np.einsum("cs,csk->ck", np.abs(g), columns).max()
                found = numbers(got["gradient"], kind).reshape(C, -1)
                self.assertLessEqual(np.abs(found - wanted).max(), TOLERANCE * size, (name, kind))
            emission, E, L, D = self.lit(name)
            body = {"cotangent": {"sensors": each}, "gradient": ["reflectance"], "emission": emission}
            found = numbers(self.ask(name, body, "adjoint")["gradient"], "reflectance").reshape(C, scene.n)
            for i in 3, 8, 17:
                h, sums = 1e-4, []
                for step in h, -h:
                    rho = scene.rho.copy()
                    rho[:, i] += step
                    sums.append(np.nansum(g * self.truth(name, E, L, D, scene.with_reflectance(rho)), 1))
                np.testing.assert_allclose(found[:, i], (sums[0] - sums[1]) / (2 * h), rtol=2e-3, atol=2e-4 * np.abs(found).max())
            one = self.ask(name, {"cotangent": {"sensors": {"room": 1}}, "gradient": ["luminaires"]}, "adjoint")
            columns = numbers(J, "luminaires").reshape(C, s.s, -1)[:, s.rows(["room.a", "room.b"])]
            self.close(numbers(one["gradient"], "luminaires").reshape(C, -1), np.nansum(columns, 1), name)

    def test_a_variant_has_values_of_its_own(self):
        red = {"wall": [.7, .1, .1]}
        done = self.post("/v1/scenes/colour/reflectance", {"variant": "red", "groups": red}, "PUT")
        self.assertEqual(done.status, 202, done)
        deadline = time.monotonic() + PATIENCE
        while self.post("/v1/scenes/colour@red", {}, "GET").status == 202 and time.monotonic() < deadline:
            time.sleep(.002)
        other = self.scenes["colour"].relit(red)
        emission, *light = self.lit("colour")
        wanted = self.truth("colour", *light, scene=other)
        rows = self.sensors["colour"].rows(SETS)
        self.close(numbers(self.ask("colour@red", {"emission": emission, "select": {"sensors": SETS}, "limit": False})),
                   wanted[:, rows], "variant")
        self.assertGreater(np.nanmax(np.abs(wanted - self.truth("colour", *light))), 100 * TOLERANCE * np.nanmax(wanted))
        mean = self.ask("colour@red", {"emission": emission, "reduce": {"sensors": SETS, "with": ["mean"]}})["sensors"]["room.a"]["mean"]
        self.close(mean, wanted[:, self.sensors["colour"].rows(["room.a"])].mean(1), "variant")
        lists = [self.post(f"/v1/scenes/{name}/sensors", {}, "GET").json() for name in ("colour", "colour@red")]
        self.assertEqual(*lists)

    def test_the_list(self):
        s = self.sensors["grey"]
        told = self.post("/v1/scenes/grey/sensors", {}, "GET").json()
        self.assertEqual(told["sensors"], s.s)
        self.assertEqual([(one["name"], one["kind"], one["weight"], one["first"], one["count"]) for one in told["sets"]],
                         [("room.a", "points", "plane", 0, 5), ("room.b", "points", "plane", 5, 9), ("faces", "cylinders", "cylinder", 14, 4)])
        for one in told["sets"]:
            places = s.place[one["first"]:one["first"] + one["count"]]
            np.testing.assert_array_equal(one["at"], places[:, :3])
            np.testing.assert_array_equal(one["axis"], places[:, 3:6])
        self.assertEqual([one["in_walls"] for one in told["sets"]], [[], [2], []])
        answer = self.post("/v1/scenes/plain/sensors", {}, "GET")
        self.assertEqual((answer.status, answer.json()["detail"]), (404, "plain: the store has no sensors"))

    def test_refusals(self):
        lit = {"emission": {"groups": {"lamp": 1}}}
        room = {"sensors": ["room"]}
        for name, to, body, words in (
                ("plain", "radiosity", {"select": room}, "select/sensors: the store has no sensors; precompute it with --sensors"),
                ("plain", "radiosity", {"reduce": {**room, "with": ["mean"]}},
                 "reduce/sensors: the store has no sensors; precompute it with --sensors"),
                ("grey", "radiosity", {"select": {"sensors": ["rom"]}},
                 'select/sensors/0: the scene has no set of sensors "rom"; did you mean "room"?'),
                ("grey", "radiosity", {"select": room, "quantity": "radiosity"},
                 "quantity is radiosity, and sensors receive irradiance alone; leave it out"),
                ("grey", "radiosity", {"select": room, "at": "elements"}, "the body holds both at and select of sensors; leave at out"),
                ("grey", "radiosity", {"reduce": {**room, "groups": ["lamp"], "with": ["mean"]}},
                 "reduce holds both groups and sensors, must hold one of them"),
                ("grey", "radiosity", {"reduce": {**room, "with": ["sum"]}},
                 "reduce: a sum over sensors, which have no area, says nothing; ask for mean"),
                ("grey", "radiosity", {"reduce": {**room, "with": ["share"]}},
                 "reduce: share and at_least go together: say by at_least what is to be reached"),
                ("grey", "radiosity", {"reduce": {**room, "with": ["mean"], "at_least": [3]}},
                 "reduce: share and at_least go together: add share to with"),
                ("grey", "radiosity", {"reduce": {**room, "with": ["share"], "at_least": [-1]}},
                 "reduce/at_least/0 = -1, must be from 0 to 3.4e38"),
                ("grey", "radiosity", {"reduce": {**room, "with": ["share"], "at_least": list(range(17))}},
                 "reduce/at_least/16: more than 16 limits; send several requests"),
                ("grey", "radiosity", {"reduce": {"sensors": ["room", "room"], "with": ["mean"]}}, "reduce/sensors/1: room is given twice"),
                ("grey", "radiosity", {"emission": {"sensors": {"room": 1}}},
                 "emission/sensors: sensors receive light and emit none; select or reduce names them"),
                ("grey", "adjoint", {"cotangent": {**{"sensors": {"room": 1}}, "groups": {"lamp": 1}}},
                 "cotangent must hold either elements and values, or groups, or sensors"),
                ("grey", "adjoint", {"cotangent": {"sensors": {"room": 1}}, "quantity": "indirect"},
                 "quantity is indirect, and sensors receive irradiance alone; leave it out"),
                ("grey", "adjoint", {"cotangent": {"sensors": {"room": {"values": [1]}}}},
                 "cotangent/sensors/room means 2 sets, and values are of one: name it in full"),
                ("grey", "adjoint", {"cotangent": {"sensors": {"faces": {"values": [1]}}}},
                 "cotangent/sensors/faces/values holds 1 values, must be 4, one for each sensor"),
                ("grey", "adjoint", {"cotangent": {"sensors": {"room": 1, "room.a": 1}}},
                 "cotangent/sensors/room.a: the set room.a is given twice"),
                ("grey", "jacobian", {}, "the body does not say what the derivatives are of"),
                ("grey", "jacobian", {"of": {}}, "of must hold sensors, groups or elements"),
                ("grey", "jacobian", {"of": room, "by": []}, "by is empty, must hold luminaires, groups, sky or emitters"),
                ("grey", "jacobian", {"of": room, "by": ["walls"]}, 'by/0 = "walls", must be luminaires, groups, sky or emitters'),
                ("grey", "jacobian", {"of": room, "by": ["sky", "sky"]}, 'by/1 = "sky", which was listed before'),
                ("exact", "jacobian", {"of": room, "by": ["sky"]}, "by/0: the store has no sky; precompute it with --sky"),
                ("plain", "jacobian", {"of": room}, "of/sensors: the store has no sensors; precompute it with --sensors")):
            sent = {**lit, **body} if to == "radiosity" else body
            answer = self.post(f"/v1/scenes/{name}/{to}", sent)
            self.assertEqual((answer.status, answer.json()["detail"]), (422, words), sent)

    def test_probes(self):
        """Nine numbers of each, as `lambert solve` has them; a furnace is even."""
        folder = self.folder / "probes"
        folder.mkdir()
        (folder / "p.json").write_text(json.dumps({"probes": [{"name": "hall", "from": [.3, .3, .5], "steps": [[.4, 0, 0]], "counts": [2]}],
                                                   "points": [{"name": "up", "at": [[.5, .5, .5]], "normal": [0, 0, 1]}]}))
        must("generate", "furnace", "-o", folder / "f.obj")
        must("precompute", folder / "f.obj", "--sensors", folder / "p.json", "--elements", 200, "--probes", 0, "--keep-form-factors",
             "-o", folder / "hot.h5")
        told = json.loads(must("solve", folder / "hot.h5", "--sensors", "hall", "--emit", "*=1", "--json").stdout)["sensors"][0]
        wanted = np.transpose(told["coefficients"], (2, 0, 1))
        self.assertGreater(wanted[0, 0, 0], 1)
        with Daemon(folder / "hot.h5") as daemon:
            emission = {"groups": dict.fromkeys((g["name"] for g in daemon.get("/v1/scenes/hot").json()["groups"]), 1)}

            def ask(body):
                return daemon.radiosity("hot", {"emission": emission, **body})

            got = ask({"select": {"probes": ["hall"]}}).json()
            self.assertEqual((got["quantity"], got["at"], got["unit"]), ("radiance", "probes", "W/(m2 sr)"))
            values = numbers(got, "radiance").reshape(-1, 2, 9)
            even = values[0, 0, 0]
            np.testing.assert_allclose(values[:, :, 0], even, rtol=1e-4)
            self.assertLess(np.abs(values[:, :, 1:]).max(), 1e-3 * even)
            np.testing.assert_allclose(values / even, wanted / wanted[0, 0, 0], atol=1e-4)
            refined = ask({"select": {"probes": ["hall"]}, "tolerance": 1e-6}).json()
            self.assertLess(np.abs(numbers(refined, "radiance").reshape(values.shape) - values).max(), 1e-3 * even)
            listed = daemon.get("/v1/scenes/hot/sensors").json()["sets"]
            self.assertEqual([(one["kind"], one["weight"], len(one["at"])) for one in listed],
                             [("points", "plane", 1), ("probes", "harmonics", 2)])
            for body, words in (({"select": {"sensors": ["hall"]}}, "select: hall is a set of probes; select it as probes"),
                                ({"select": {"probes": ["up"]}}, "select: up is a set of sensors; select it as sensors"),
                                ({"reduce": {"sensors": ["hall"], "with": ["mean"]}},
                                 "reduce: hall is a set of probes, whose coefficients have no figures; select it as probes"),
                                ({"select": {"probes": ["hall"]}, "unit": "fc"},
                                 "unit is fc, and coefficients of probes are in cd/m2 or W/(m2 sr); ask for lx or W/m2"),
                                ({"select": {"probes": ["hall"]}, "quantity": "irradiance"},
                                 "quantity is irradiance, and probes have coefficients of radiance alone; leave it out")):
                answer = ask(body)
                self.assertEqual((answer.status, answer.json()["detail"]), (422, words))

    def test_broken_stores_are_refused(self):
        path = self.folder / "broken.h5"
        for array, place, value, words in (("weights", 2, np.inf, "/sensors/weights[2] = inf"),
                                           ("indices", 3, 999, "/sensors/indices[3] = 999, must be below 30"),
                                           ("flags", 1, 9, "/sensors/flags[1] = 9")):
            Scene(30).write(path, "broken")
            Sensors(30).add_to(path)
            with h5py.File(path, "r+") as f:
                f["sensors"][array][place] = value
                add_checksums(f)
            with Daemon(path, self.folder / "plain.h5") as daemon:
                self.assertIn(words, daemon.errors())
                self.assertEqual([s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]], ["plain"])
            path.unlink()


class Kinds(Case):
    """Of every kind of operator, as `lambert precompute` makes it; that of few emitters has a sky alone."""

    KINDS = {**KINDS, "few": ["--emitters", "sky"]}

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-sensors-")
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        cls.stores, cls.lights, cls.sensors, cls.truth = {}, {}, {}, {}
        for name, options in cls.KINDS.items():
            cls.stores[name] = precompute_yard(path, name, *options)
            cls.truth[name] = t = Truth(cls.stores[name])
            if name != "few":
                cls.lights[name] = Luminaires(t.n, t.C, seed=7).add_to(cls.stores[name])
            cls.sensors[name] = Sensors(t.n, t.C, 12, cls.lights.get(name), seed=7).add_to(cls.stores[name])
        cls.stores["stated"] = precompute_yard(path, "stated", *KINDS["low"], probes=16)
        t = cls.truth["stated"] = Truth(cls.stores["stated"])
        cls.lights["stated"] = Luminaires(t.n, t.C, seed=7, mesh_groups=len(t.groups)).add_to(cls.stores["stated"])
        cls.sensors["stated"] = Sensors(t.n, t.C, 12, cls.lights["stated"], seed=7).add_to(cls.stores["stated"])
        cls.daemon = Daemon(*cls.stores.values())
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def lit(self, name):
        of = LIT if self.truth[name].C == 3 else GREY
        L = np.arange(12) / 8
        if name == "few":
            return {"sky": L.tolist()}, {}, np.broadcast_to(L, (3, 12))
        return {"luminaires": of, "groups": {"lamp": 3}, "sky": L.tolist()}, of, np.broadcast_to(L, (self.truth[name].C, 12))

    def test_they_gather_the_answer_of_elements(self):
        for name in self.KINDS:
            s, C = self.sensors[name], self.truth[name].C
            emission, of, L = self.lit(name)
            D = dimmers(self.lights[name], of) if of else None
            for limit in False, True:
                B = np.reshape(self.ask(name, {"emission": emission, "limit": limit})["radiosity"], (C, -1)).astype(float)
                wanted = s.values(B, L, D)[:, s.rows(SETS)]
                got = self.ask(name, {"emission": emission, "limit": limit, "select": {"sensors": SETS}})
                self.close(numbers(got), wanted, (name, limit), SAME)
                if limit:
                    continue
                figures = self.ask(name, {"emission": emission, "limit": False, "reduce": {"sensors": SETS, "with": ["mean"]}})
                for key in SETS:
                    self.close(figures["sensors"][key]["mean"], s.values(B, L, D)[:, s.rows([key])].mean(1), name, SAME)

    def test_clients_at_once(self):
        """Columns that several requests make and keep at the same time have the bits of those of one."""
        with Daemon(self.stores["hierarchical"], self.stores["low"], "--threads", 2) as daemon:
            bodies = [(name, {"emission": {"luminaires": {"desk-1": k / 4, "row-a": 1}, "sky": np.eye(12)[k % 12].tolist()},
                              "reduce": {"sensors": SETS, "with": ["mean", "max"]}}) for k in range(24) for name in ("hierarchical", "low")]

            def ask(one):
                answer = daemon.radiosity(*one)
                return answer.status, answer.json().get("sensors")

            with concurrent.futures.ThreadPoolExecutor(8) as pool:
                found = list(pool.map(ask, bodies))
            self.assertEqual({status for status, _ in found}, {200})
            self.assertEqual(found, [ask(one) for one in bodies])

    def test_certificates_hold(self):
        """Against a dense solution in double; the slack is that of test_tolerance.py."""
        for name in self.KINDS:
            truth, l, s = self.truth[name], self.lights.get(name), self.sensors[name]
            emission, of, L = self.lit(name)
            of = {key: np.float32(values).tolist() for key, values in of.items()}
            D = dimmers(l, of) if of else None
            E = truth.lamp(3) if of else np.zeros((truth.C, truth.n))
            E = E + truth.rho * ((l.direct(D) if of else 0) + L @ truth.first_bounce)
            B = np.stack([np.linalg.solve(np.eye(truth.n) - r[:, None] * truth.F, e) for r, e in zip(truth.rho, E)])
            wanted = s.values(B, L, D)
            for tolerance in 1e-3, 1e-9:
                body = {"emission": {**emission, "luminaires": of} if of else emission, "tolerance": tolerance}
                answer = self.ask(name, dict(body, select={"sensors": SETS}))
                worst = np.abs(numbers(answer).reshape(truth.C, -1) - wanted[:, s.rows(SETS)]).max()
                self.assertLessEqual(worst, answer["certificate"] + 1e-13 * np.nanmax(wanted), (name, tolerance))
                figures = self.ask(name, dict(body, reduce={"sensors": ["faces"], "with": ["mean"]}))
                worst = np.abs(np.ravel(figures["sensors"]["faces"]["mean"]) - wanted[:, s.rows(["faces"])].mean(1)).max()
                self.assertLessEqual(worst, figures["certificate"] + 1e-13 * np.nanmax(wanted), (name, tolerance))

    def test_errors_are_stated_by_set(self):
        """By vectors and, of the same light, by columns; the part of the rows is known from their halves."""
        truth, s, name = self.truth["stated"], self.sensors["stated"], "stated"
        emission, of, L = self.lit(name)
        B = np.reshape(self.ask(name, {"emission": emission, "limit": False})["radiosity"], (truth.C, -1)).astype(float)
        values = s.values(B, L, dimmers(self.lights[name], of))
        off = B @ (s.off * (s.weights > 0)).T.astype(float) + L @ (s.sky * 1e-2).astype(np.float32).astype(float)
        body = {"emission": emission, "limit": False}
        both = self.ask(name, dict(body, select={"sensors": SETS}))["error"]
        self.assertEqual((both["light"], list(both["sensors"])), ("own", SETS))
        for key in SETS:
            rows = s.rows([key])
            answer = self.ask(name, dict(body, select={"sensors": [key]}))["error"]
            wanted = np.sqrt((off[:, rows] ** 2).sum() / (values[:, rows] ** 2).sum())
            parts = answer["parts"]
            self.assertAlmostEqual(parts["rows"], wanted, delta=1e-3 * wanted)
            self.assertGreater(min(parts["operator"], parts["mesh"]), 0)
            self.assertAlmostEqual(answer["stated"], np.sqrt(sum(x ** 2 for x in parts.values())), places=9)
            self.assertEqual(answer["sensors"], {key: {"stated": answer["stated"]}})
            self.assertEqual(both["sensors"][key], answer["sensors"][key])
            reduced = {"reduce": {"sensors": [key], "with": ["mean"]}, "limit": False}
            for light in {"luminaires": {"wall": 2}}, {"groups": {"lamp": 3}}, {"sky": np.eye(12)[3].tolist()}:
                pair = [self.ask(name, {"emission": light, "limit": False, **more})["error"]["parts"]
                        for more in ({"select": {"sensors": [key]}}, reduced)]
                for some in ("rows",), ("mesh",), ("operator", "form_factors"):
                    value, other = (np.hypot.reduce([of[part] for part in some]) for of in pair)
                    self.assertAlmostEqual(value, other, delta=1e-4 * value, msg=(light, key, some))
            mixed = self.ask(name, {"emission": emission, **reduced})["error"]["parts"]
            self.assertAlmostEqual(mixed["rows"], parts["rows"], delta=1e-6)
            self.assertTrue(.5 < mixed["mesh"] / parts["mesh"] < 2, (mixed, parts))
            lamp = self.ask(name, {"emission": {"groups": {"lamp": 3}}, "select": {"sensors": [key]}})["error"]["stated"]
            solved = json.loads(must("solve", self.stores[name], "--emit", "lamp=3", "--sensors", key, "--dim", "*=0", "--json").stdout)
            self.assertAlmostEqual(solved["error"], lamp, delta=1e-3 * lamp)  # the daemon has raised light below zero
            self.assertEqual(solved["error"], solved["sensors"][0]["error"])
        unknown = self.ask("low", {"emission": emission, "select": {"sensors": SETS}})["error"]
        self.assertEqual((unknown["stated"], unknown["advice"]), (None, "precompute without --probes 0 measures it"))


if __name__ == "__main__":
    unittest.main()
