"""POST .../adjoint: gradients against finite differences of operators made again in double, and <g, M e> = <w, e>."""

import io
import json
import os
import pathlib
import tempfile
import unittest

# Hundreds of small solutions: a second thread of each only waits for a core that others have.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from command import must
from daemon import Daemon, npy
from make_store import Scene
from yard import Truth, write_yard

QUANTITIES = "radiosity", "irradiance", "indirect"
# Some hundred terms in single precision, of either sign: of the sum of their magnitudes.
TOLERANCE = 1e-5
NPY = "application/x-npy"


class Both(unittest.TestCase):
    """Stores and checks that the classes below share."""

    def ask(self, name, body, query="", **more):
        answer = self.daemon.post(f"/v1/scenes/{name}/adjoint{query}", body, **more)
        self.assertEqual(answer.status, 200, (answer, str(body)[:200]))
        return answer

    def gradient(self, name, body):
        return {key: np.array(value, float) for key, value in self.ask(name, body).json()["gradient"].items()}

    def matrix(self, name, C, n, quantity):
        """[C][n][n] of what the daemon answers to every element alone."""
        units = [{"elements": [j], "values": [1]} for j in range(n)]
        answer = self.daemon.radiosity(name, {"emissions": units, "quantity": quantity, "limit": False})
        self.assertEqual(answer.status, 200, answer)
        return np.array(answer.json()[quantity], float).reshape(n, C, n).transpose(1, 2, 0)

    def close(self, found, wanted, scale, what):
        self.assertLessEqual(np.abs(found - wanted).max(), TOLERANCE * scale, what)


def cotangents(scene, rng):
    """(as it is asked, [C][n]) of every form; of both signs."""
    C, n = scene.C, scene.n
    g = rng.standard_normal((C, n)).round(5)
    yield g.tolist(), g
    yield g[0].tolist(), np.tile(g[0], (C, 1))
    sparse = np.zeros((C, n))
    sparse[:, [n - 1, 2]] = g[:, [0, 1]]
    yield {"elements": [n - 1, 2], "values": g[:, [0, 1]].T.tolist()}, sparse
    lamp = np.zeros((C, n))
    lamp[:, scene.lamp_members] = -2
    yield {"groups": {"lamp": -2}}, lamp


class SmallScene(Scene):
    """With the names that Truth has."""

    @property
    def C(self):
        return self.channels

    @property
    def lamp_members(self):
        return self.members("lamp")

    def value(self, rho, E, L, quantity):
        return self.with_reflectance(rho).solve(E, quantity, L)


class Yard(Truth):
    @property
    def lamp_members(self):
        return self.members("lamp")

    def members(self, name):
        return np.flatnonzero(self.group == self.groups.index(name))

    def value(self, rho, E, L, quantity):
        kept, self.rho = self.rho, rho
        try:
            return self.solve(E, L if L is not None else np.zeros((self.C, len(self.tiles))), quantity)
        finally:
            self.rho = kept


class Gradients(Both):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-adjoint-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        cls.scenes = {
            "grey": SmallScene(60, seed=1).write(path / "grey.h5", "grey", sky=6),
            "exact": SmallScene(40, seed=2).write(path / "exact.h5", "exact", kind="exact"),
            "colour": SmallScene(50, channels=3, seed=4).write(path / "colour.h5", "colour", sky=4),
            "exact3": SmallScene(20, channels=3, seed=5).write(path / "exact3.h5", "exact3", kind="exact", sky=5),
        }
        cls.skies = {"grey": 6, "colour": 4, "exact3": 5}
        cls.approximate = []
        for name, floor, options in (
            ("yard", "0.5 0.5 0.5", ["--method", "exact"]),
            ("yard3", "0.7 0.4 0.2", ["--method", "exact"]),
            ("low", "0.7 0.4 0.2", ["--method", "low-rank", "--rank", 20]),
            ("two_mesh", "0.5 0.5 0.5", ["--method", "2msc"]),
            ("sparse", "0.7 0.4 0.2", ["--method", "sparse"]),
            ("hierarchical", "0.7 0.4 0.2", ["--method", "hierarchical"]),
        ):
            must("precompute", write_yard(cls.folder, floor), "-o", cls.folder / (name + ".h5"), "--elements", 80, "--rays", 256, "--probes", 0,
                 "--keep-form-factors", "--sky", "grid:4x3", *options)
            truth = cls.scenes[name] = Yard(cls.folder / (name + ".h5"))
            cls.skies[name] = len(truth.tiles)
            if not name.startswith("yard"):
                cls.approximate.append(name)
        cls.daemon = Daemon(*(f"{cls.folder / name}.h5:{name}" for name in cls.scenes))
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def test_emission(self):
        """dJ/dE = (dq/dE)^T g for every kind, quantity and form of cotangent."""
        for name, scene in self.scenes.items():
            for quantity in QUANTITIES:
                M = self.matrix(name, scene.C, scene.n, quantity)
                for asked, g in cotangents(scene, np.random.default_rng(1)):
                    answer = self.ask(name, {"cotangent": asked, "quantity": quantity}).json()
                    self.assertEqual((answer["scene"], answer["elements"], answer["channels"], answer["quantity"]),
                                     (name, scene.n, scene.C, quantity))
                    self.assertEqual(set(answer["gradient"]), {"emission", "sky"} if name in self.skies else {"emission"})
                    w = np.array(answer["gradient"]["emission"], float)
                    self.assertEqual(w.shape, (scene.n,) if scene.C == 1 else (scene.C, scene.n))
                    wanted = np.einsum("cij,ci->cj", M, g)
                    scale = np.einsum("cij,ci->cj", np.abs(M), np.abs(g)).max()
                    self.close(w.reshape(wanted.shape), wanted, scale, (name, quantity))

    def test_inner_products(self):
        """<g, q(e)> = <w, e> for emissions that are no basis."""
        rng = np.random.default_rng(2)
        for name, scene in self.scenes.items():
            for quantity in QUANTITIES:
                e, g = rng.random((scene.C, scene.n)).round(5), rng.standard_normal((scene.C, scene.n)).round(5)
                answer = self.daemon.radiosity(name, {"emission": e.tolist(), "quantity": quantity, "limit": False})
                q = np.array(answer.json()[quantity], float).reshape(e.shape)
                w = self.gradient(name, {"cotangent": g.tolist(), "quantity": quantity})["emission"].reshape(e.shape)
                self.close((w * e).sum(), (g * q).sum(), np.abs(g * q).sum() + np.abs(w * e).sum(), (name, quantity))

    def test_groups(self):
        """One number a group: the sum of the gradient by the emission of its elements, and what an emission of the group
        alone gives."""
        for name, scene in self.scenes.items():
            about = self.daemon.get(f"/v1/scenes/{name}").json()
            names = [group["name"] for group in about["groups"]]
            rng = np.random.default_rng(8)
            for quantity in QUANTITIES:
                g = rng.standard_normal((scene.C, scene.n)).round(5)
                found = self.gradient(name, {"cotangent": g.tolist(), "quantity": quantity, "gradient": ["groups", "emission"]})
                self.assertEqual(found["groups"].shape, (len(names),) if scene.C == 1 else (scene.C, len(names)))
                w, by_group = found["emission"].reshape(scene.C, scene.n), found["groups"].reshape(scene.C, len(names))
                answer = self.daemon.radiosity(name, {"emissions": [{"groups": {one: 1}} for one in names],
                                                      "quantity": quantity, "limit": False})
                q = np.array(answer.json()[quantity], float).reshape(len(names), scene.C, scene.n)
                for k, one in enumerate(names):
                    self.close(by_group[:, k], w[:, scene.members(one)].sum(axis=1), np.abs(w).sum(), (name, quantity, one))
                    self.close(by_group[:, k], (q[k] * g).sum(axis=1), np.abs(q[k] * g).sum() + np.abs(w).sum(), (name, quantity, one))
            # The light of one point, by the lamps that make it.
            point = {"elements": [3], "values": [1]}
            emission = {one: k + 1 for k, one in enumerate(names)}
            answer = self.daemon.radiosity(name, {"emission": {"groups": emission}, "select": {"elements": [3]}, "limit": False}).json()
            B = np.array(answer["radiosity"], float).sum()
            parts = self.gradient(name, {"cotangent": point, "gradient": ["groups"]})["groups"].reshape(scene.C, len(names))
            self.close((parts * list(emission.values())).sum(), B, B, name)
            array = np.load(io.BytesIO(self.ask(name, {"cotangent": point, "gradient": ["groups"]}, accept=NPY).body))
            np.testing.assert_array_equal(array.reshape(parts.shape), parts.astype("f4"))

    def test_sky(self):
        """One number a tile: the derivative by its radiance, of what is linear in it."""
        for name, m in self.skies.items():
            scene = self.scenes[name]
            for quantity in QUANTITIES:
                g = np.random.default_rng(3).standard_normal((scene.C, scene.n)).round(5)
                found = self.gradient(name, {"cotangent": g.tolist(), "quantity": quantity, "gradient": ["sky"]})
                self.assertEqual(set(found), {"sky"})
                units = [{"sky": row} for row in np.eye(m).tolist()]
                answer = self.daemon.radiosity(name, {"emissions": units, "quantity": quantity, "limit": False})
                q = np.array(answer.json()[quantity], float).reshape(m, scene.C, scene.n)
                self.close(found["sky"].reshape(scene.C, m), np.einsum("mci,ci->cm", q, g),
                           np.einsum("mci,ci->cm", np.abs(q), np.abs(g)).max(), (name, quantity))

    def test_reflectance(self):
        """dJ/drho against central differences of the scene made again in double: (J(rho + h) - J(rho - h)) / 2h is off
        by h^2 J'''/6 and 1e-16 J/h, 1e-10 at h = 1e-5. Black elements are among them, a negative reflectance is only
        arithmetic to the judge."""
        h = 1e-5
        for name, scene in self.scenes.items():
            if name in self.approximate:
                continue
            rng = np.random.default_rng(4)
            self.assertTrue((scene.rho == 0).any())
            C, n = scene.C, scene.n
            g, E = rng.standard_normal((C, n)).round(5), rng.random((C, n)).round(5)
            skies = [None, rng.random((C, self.skies[name])).round(5)] if name in self.skies else [None]
            for quantity in QUANTITIES:
                for L in skies:
                    emission = E.tolist()
                    light = E
                    if L is not None:
                        light = np.zeros((C, n))
                        light[:, scene.lamp_members] = 3
                        emission = {"groups": {"lamp": 3}, "sky": L.T.tolist()}
                    found = self.gradient(name, {"cotangent": g.tolist(), "quantity": quantity, "emission": emission,
                                                 "gradient": ["reflectance"]})
                    self.assertEqual(set(found), {"reflectance"})
                    # All of a small scene; of a yard, where each is a dense solution, some of every group.
                    some = np.arange(n) if n <= 60 else rng.permutation(n)[:10]
                    if n > 60:
                        some[:2] = np.flatnonzero(scene.rho[0] == 0)[:2]
                    wanted = np.empty((C, len(some)))
                    for k, i in enumerate(some):
                        rho = scene.rho.copy()
                        rho[:, i] += h
                        up = scene.value(rho, light, L, quantity)
                        rho[:, i] -= 2 * h
                        wanted[:, k] = ((up - scene.value(rho, light, L, quantity)) * g).sum(axis=1) / (2 * h)
                    q = np.abs(scene.value(scene.rho, light, L, "irradiance")).max()
                    scale = np.abs(g).sum() * q
                    given = found["reflectance"].reshape(C, n)[:, some]
                    self.close(given, wanted, scale, (name, quantity, L is not None))
                    # That scale is a sum over all; nearly all is far below it, and must not be lost in it.
                    error = np.linalg.norm(given - wanted) / np.linalg.norm(wanted)
                    self.assertLess(error, 2e-5, (name, quantity))

    def test_reflectance_of_approximations(self):
        """w_i H_i, and g_i (H_i - H0_i) more for indirect light, of the answers themselves; of low_rank, whose M~ is
        (I - R U V')^-1, the finite difference as well (above: grey and colour)."""
        for name in self.approximate:
            scene = self.scenes[name]
            rng = np.random.default_rng(5)
            g, L = rng.standard_normal((scene.C, scene.n)).round(5), rng.random((scene.C, self.skies[name])).round(5)
            emission = {"groups": {"lamp": 3}, "sky": L.T.tolist()}
            H = np.array(self.daemon.radiosity(name, {"emission": emission, "quantity": "irradiance", "limit": False}).json()["irradiance"])
            H0 = L @ scene.first_bounce
            for quantity in QUANTITIES:
                found = self.gradient(name, {"cotangent": g.tolist(), "quantity": quantity, "emission": emission,
                                             "gradient": ["reflectance", "emission"]})
                self.assertEqual(set(found), {"emission", "reflectance", "sky"})
                wanted = (found["emission"] * H).reshape(scene.C, scene.n)
                if quantity == "indirect":
                    wanted += g * (H.reshape(wanted.shape) - H0)
                self.close(found["reflectance"].reshape(wanted.shape), wanted, np.abs(wanted).max(), (name, quantity))

    def test_npy(self):
        for name, scene in self.scenes.items():
            g = np.random.default_rng(6).standard_normal((scene.C, scene.n)).astype("<f4")
            g = g if scene.C > 1 else g[0]
            wanted = self.gradient(name, {"cotangent": g.tolist()})
            for dtype in "<f4", "<f8":
                found = self.ask(name, npy(g.astype(dtype)), kind=NPY).json()["gradient"]
                np.testing.assert_array_equal(found["emission"], wanted["emission"])
            answer = self.ask(name, npy(g), kind=NPY, accept=NPY)
            self.assertEqual(answer.headers["Content-Type"], NPY)
            array = np.load(io.BytesIO(answer.body))
            self.assertEqual((array.dtype, array.shape), (np.dtype("<f4"), g.shape))
            np.testing.assert_array_equal(array, wanted["emission"].astype("f4"))
            for quantity in QUANTITIES:
                array = np.load(io.BytesIO(self.ask(name, npy(g), f"?quantity={quantity}", kind=NPY, accept=NPY).body))
                np.testing.assert_array_equal(array, self.gradient(name, {"cotangent": g.tolist(), "quantity": quantity})["emission"].astype("f4"))
            refused = self.daemon.post(f"/v1/scenes/{name}/adjoint?limit=false", npy(g), kind=NPY)
            self.assertEqual(refused.status, 422)
            self.assertIn('"limit", may have quantity alone', refused.json()["detail"])
            for kind in "emission", "reflectance", "sky":
                if kind == "sky" and name not in self.skies:
                    continue
                body = {"cotangent": g.tolist(), "gradient": [kind], "emission": {"groups": {"lamp": 1}}}
                array = np.load(io.BytesIO(self.ask(name, body, accept=NPY + "; dtype=f8").body))
                self.assertEqual(array.dtype, np.dtype("<f8"))
                np.testing.assert_array_equal(array.astype("f4"), self.gradient(name, body)[kind].astype("f4"))

    def test_a_batch_has_the_bits_of_single_answers(self):
        """In JSON and NPY, of every gradient, longer than a pass."""
        for name in "grey", "exact3", "low", "hierarchical":
            scene, rng = self.scenes[name], np.random.default_rng(8)
            G = rng.standard_normal((19, scene.C, scene.n)).round(5).astype("f4")
            kinds = ["emission", "reflectance", "groups"]
            more = {"gradient": kinds, "emission": {"groups": {"lamp": 2}}, "quantity": "indirect"}
            asked = [g.tolist() if scene.C > 1 else g[0].tolist() for g in G]
            found = self.gradient(name, {"cotangents": [*asked, {"groups": {"wall" if isinstance(scene, SmallScene) else "south": 1}}], **more})
            for k in 0, 7, 18:
                alone = self.gradient(name, {"cotangent": asked[k], **more})
                self.assertEqual(set(alone), set(found))
                for kind, values in alone.items():
                    np.testing.assert_array_equal(found[kind][k], values, (name, kind))
            shape = G if scene.C > 1 else G[:, 0]
            array = np.load(io.BytesIO(self.ask(name, npy(shape), kind=NPY, accept=NPY).body))
            self.assertEqual(array.shape, shape.shape)
            np.testing.assert_array_equal(array[5], self.gradient(name, {"cotangent": asked[5]})["emission"].astype("f4"))
            one = self.ask(name, {"cotangents": asked[:1]}).json()["gradient"]["emission"]
            self.assertEqual(np.shape(one), (1, *shape.shape[1:]))

    def test_figures_of_groups(self):
        """The gradient of a mean is what `reduce` answers to single elements; of a sum, the area more."""
        for name in "grey", "yard3", "hierarchical":
            scene = self.scenes[name]
            group = "floor" if name != "grey" else "wall"
            members = scene.members(group) if name == "grey" else np.flatnonzero(scene.group == scene.groups.index(group))
            share = np.zeros(scene.n)
            share[members] = scene.area[members] / scene.area[members].sum()
            for asked, factor in (({"mean": 1}, 1), ({"sum": 2}, 2 * scene.area[members].sum())):
                found = self.gradient(name, {"cotangent": {"groups": {group: asked}}})["emission"]
                wanted = self.gradient(name, {"cotangent": np.tile(share * factor, (scene.C, 1)).tolist() if scene.C > 1
                                              else (share * factor).tolist()})["emission"]
                self.close(found, wanted, np.abs(wanted).max(), (name, asked))
            emission = {"elements": [members[0], 1], "values": [2, 3]}
            mean = self.daemon.radiosity(name, {"emission": {key: np.asarray(v).tolist() for key, v in emission.items()}, "limit": False,
                                                "reduce": {"groups": [group], "with": ["mean"]}}).json()["groups"][group]["mean"]
            rows = np.reshape(self.gradient(name, {"cotangent": {"groups": {group: {"mean": 1}}}})["emission"], (scene.C, scene.n))
            np.testing.assert_allclose(rows[:, members[0]] * 2 + rows[:, 1] * 3, np.ravel(mean), rtol=2e-6)

    def test_order_of_members(self):
        body = {"gradient": ["reflectance"], "emission": {"groups": {"lamp": 1}}, "cotangent": {"groups": {"wall": -1}},
                "quantity": "indirect"}
        backwards = dict(reversed(body.items()))
        self.assertEqual(self.ask("grey", body).json()["gradient"], self.ask("grey", backwards).json()["gradient"])

    def refuse(self, body, status, *words, pointer=None, name="grey", **more):
        answer = self.daemon.post(f"/v1/scenes/{name}/adjoint", body, **more)
        self.assertEqual(answer.status, status, (answer, str(body)[:200]))
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        what = answer.json()
        for word in words:
            self.assertIn(word, what["detail"])
        if pointer is not None:
            self.assertEqual(what.get("pointer"), pointer)

    def test_refusals(self):
        g = [1] * 60
        for text in "", "{", '{"cotangent":[1', '{"cotangent":[NaN]}', '{"cotangent":[1]} x', '{"cotangent":[1],}':
            self.refuse(text, 400, "not JSON")
        self.refuse({}, 422, "no cotangent")
        self.refuse([], 422, "object")
        self.refuse({"cotangent": [1] * 59}, 422, "60", pointer="/cotangent")
        self.refuse({"cotangent": [1] * 61}, 422, "60", pointer="/cotangent")
        self.refuse({"cotangent": [g, g]}, 422, "row", pointer="/cotangent")
        self.refuse({"cotangent": 1}, 422, "array", pointer="/cotangent")
        self.refuse('{"cotangent":[1e39' + ",1" * 59 + "]}", 422, "1e39", "single precision", pointer="/cotangent/0")
        self.refuse('{"cotangent":[-1e39' + ",1" * 59 + "]}", 422, "-1e39", "single precision", pointer="/cotangent/0")
        self.refuse({"cotangent": {"sky": [1] * 6}}, 422, "cotangent", pointer="/cotangent/sky")
        self.refuse({"cotangent": {"emitters": [1]}}, 422, "cotangent", pointer="/cotangent/emitters")
        self.refuse({"cotangent": {"elements": [60], "values": [1]}}, 422, "59", pointer="/cotangent/elements/0")
        self.refuse({"cotangent": {"groups": {"moon": 1}}}, 422, "moon", pointer="/cotangent/groups/moon")
        self.refuse({"cotangents": []}, 422, "empty", pointer="/cotangents")
        self.refuse({"cotangents": [g, [1]]}, 422, "60", pointer="/cotangents/1")
        self.refuse({"cotangents": [g], "cotangent": g}, 422, "both cotangent and cotangents")
        self.refuse({"cotangent": {"groups": {"lamp": {"max": 1}}}}, 422, "max", pointer="/cotangent/groups/lamp/max")
        self.refuse({"cotangent": {"groups": {"lamp": {"mean": 1, "sum": 1}}}}, 422, "mean or sum", pointer="/cotangent/groups/lamp")
        self.refuse({"cotangent": {"groups": {"lamp": {}}}}, 422, "mean or sum", pointer="/cotangent/groups/lamp")
        self.refuse({"cotangent": g, "gradient": ["reflectance"], "emission": {"groups": {"lamp": {"mean": 1}}}}, 422, "number",
                    pointer="/emission/groups/lamp")
        self.refuse({"cotangent": g, "emissions": [g]}, 422, "emissions", pointer="/emissions")
        self.refuse('{"cotangent":[],"cotangent":[]}', 422, pointer="/cotangent")
        self.refuse({"cotangent": g, "quantity": "heat"}, 422, "heat", pointer="/quantity")
        self.refuse({"cotangent": g, "gradient": "emission"}, 422, "array", pointer="/gradient")
        self.refuse({"cotangent": g, "gradient": []}, 422, "empty", pointer="/gradient")
        self.refuse({"cotangent": g, "gradient": ["emission", "heat"]}, 422, "heat", pointer="/gradient/1")
        self.refuse({"cotangent": g, "gradient": ["emission"] * 2}, 422, "before", pointer="/gradient/1")
        self.refuse({"cotangent": g, "gradient": [1]}, 422, "name", pointer="/gradient/0")
        self.refuse({"cotangent": g, "gradient": ["emitters"]}, 422, "no precomputed emitters", pointer="/gradient/0")
        self.refuse({"cotangent": [1] * 40, "gradient": ["sky"]}, 422, "no sky", pointer="/gradient/0", name="exact")
        self.refuse({"cotangent": g, "gradient": ["reflectance"]}, 422, "needs an emission")
        self.refuse({"cotangent": g, "gradient": ["reflectance"], "emission": ["-1"] * 60}, 422, "a number",
                    pointer="/emission/0")
        self.refuse({"cotangent": g, "emission": [1] * 3}, 422, "60", pointer="/emission")
        self.refuse({"cotangent": g, "emission": {"emitters": [1]}}, 422, "emitters", pointer="/emission/emitters")
        self.refuse({"cotangent": g, "gradient": ["emission", "sky"]}, 422, "one gradient", accept=NPY)
        self.refuse({"cotangent": [3e38] * 60}, 422, "single precision")
        self.refuse(json.dumps({"cotangent": g}), 415, "Content-Type", kind="text/plain")
        self.refuse({"cotangent": g}, 404, "no scene", name="none")
        for array, word in ((np.ones(59), "59"), (np.ones((2, 2, 60)), "shape"), (np.full(60, np.nan), "NaN"), (np.full(60, -1e39), "single precision"),
                            (np.ones(60, int), "<i8")):
            self.refuse(npy(array), 422, word, kind=NPY)
        self.refuse(b"nothing", 400, kind=NPY)

    def test_the_next_request_is_not_harmed(self):
        connection = self.daemon.connect()
        for body in "{", {"cotangent": [1]}, {"cotangent": [-1] * 60}:
            self.daemon.post("/v1/scenes/grey/adjoint", body, connection=connection)
        answer = self.daemon.radiosity("grey", {"emission": [1e39] * 60}, connection=connection)
        self.assertEqual(answer.status, 422)
        connection.close()


class Emitters(Both):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-adjoint-")
        cls.addClassCleanup(folder.cleanup)
        folder = pathlib.Path(folder.name)
        cls.truth = {}
        for name, floor, emitters in (("lights", "0.7 0.4 0.2", "group=lamp,south"), ("tiles", "0.5 0.5 0.5", "sky")):
            must("precompute", write_yard(folder, floor), "-o", folder / (name + ".h5"), "--elements", 80, "--rays", 256, "--probes", 0,
                 "--keep-form-factors", "--sky", "grid:4x3", "--emitters", emitters)
            cls.truth[name] = Truth(folder / (name + ".h5"))
        cls.daemon = Daemon(*(f"{folder / name}.h5:{name}" for name in cls.truth))
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def test_weights(self):
        """One number an emitter: what g says of its light alone, from a dense solution in double."""
        for name, truth in self.truth.items():
            g = np.random.default_rng(7).standard_normal((truth.C, truth.n)).round(5)
            dark, no_sky = np.zeros((truth.C, truth.n)), np.zeros((truth.C, 12))
            if name == "tiles":
                units = [(dark, np.tile(row, (truth.C, 1))) for row in np.eye(12)]
            else:
                units = [(np.tile((truth.group == truth.groups.index(group)).astype(float), (truth.C, 1)), no_sky)
                         for group in ("lamp", "south")]
            for quantity in QUANTITIES:
                q = np.array([truth.solve(E, L, quantity) for E, L in units])
                wanted = np.einsum("kci,ci->ck", q, g)
                scale = np.einsum("kci,ci->ck", np.abs(q), np.abs(g)).max()
                for body in {}, {"gradient": ["emission"]}, {"gradient": ["emitters"]}:
                    found = self.gradient(name, dict(body, cotangent=g.tolist(), quantity=quantity))
                    self.assertEqual(set(found), {"emitters"})
                    self.assertEqual(found["emitters"].shape, wanted.shape if truth.C > 1 else wanted[0].shape)
                    self.close(found["emitters"].reshape(wanted.shape), wanted, scale, (name, quantity))
                # In radiosities the emission is exact, and the rest within what the store's solution was (1e-6).
            array = np.load(io.BytesIO(self.ask(name, npy((g if truth.C > 1 else g[0]).astype("f4")), kind=NPY, accept=NPY).body))
            self.assertEqual(array.shape[-1], len(units))

    def test_refusals(self):
        g = [1] * self.truth["lights"].n
        for gradient in "reflectance", "sky", "groups":
            answer = self.daemon.post("/v1/scenes/lights/adjoint", {"cotangent": g, "gradient": [gradient],
                                                                    "emission": {"groups": {"lamp": 1}}})
            self.assertEqual(answer.status, 422, answer)
            self.assertIn("few emitters", answer.json()["detail"])
            self.assertEqual(answer.json()["pointer"], "/gradient/0")
        # Both at once would be two of a kind.
        answer = self.daemon.post("/v1/scenes/lights/adjoint", {"cotangent": g, "gradient": ["emission", "emitters"]})
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(list(answer.json()["gradient"]), ["emitters"])


if __name__ == "__main__":
    unittest.main()
