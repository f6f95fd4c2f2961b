"""No light below zero: answers of both programs, of every kind, with the means of groups of the linear map; and what is
linear on request."""

import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import SMALL, lambert, must
from daemon import Daemon, npy

U = 2.0**-24  # a value in single precision is rounded by that share of itself
QUANTITIES = "radiosity", "irradiance", "indirect"
# The options of a store each; a maze has corners that no light reaches.
KINDS = {"lowrank": ["--method", "low-rank", "--epsilon", .2], "twomesh": ["--method", "2msc"],
         "sparse": ["--method", "sparse"], "hierarchical": ["--method", "hierarchical", "--epsilon", .2],
         "exact": ["--method", "exact"], "half": ["--method", "low-rank", "--epsilon", .2, "--store-precision", "i8"]}
VECTORS = 6 if SMALL else 24


class Store:
    def __init__(self, path):
        self.path = path
        with h5py.File(path) as file:
            self.area, self.group = file["mesh/area"][()], file["mesh/group"][()]
            self.rho = file["mesh/reflectance"][()].astype(float)
            self.names = [name.decode() for name in file["mesh/group_names"][()]]
            self.first = file["sky/first_bounce"][()].astype(float) if "sky" in file else None
        self.n, self.channels = len(self.area), len(self.rho)

    def members(self, g):
        return np.nonzero(self.group == g)[0]

    def emissions(self, seed, count=VECTORS):
        """Single elements, a few of them, groups and all elements: [count][C][n] in single precision."""
        rng = np.random.default_rng(seed)
        E = np.zeros((count, self.channels, self.n), np.float32)
        for v in range(count):
            if v % 4 == 3:
                E[v] = rng.random(E[v].shape)
            elif v % 4 == 2:
                E[v][:, self.members(rng.choice(np.unique(self.group)))] = 3
            else:
                E[v][:, rng.integers(0, self.n, 1 + 4 * (v % 4))] = 1 + rng.random()
        return E

    def direct(self, quantity, E, L=None):
        H0 = 0 if L is None else L.astype(float) @ self.first
        return {"radiosity": E + self.rho * H0, "irradiance": H0 + 0 * E, "indirect": 0 * E}[quantity]


class Limited(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-limited-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        must("generate", "maze", "--elements", 500 if SMALL else 900, "-o", cls.folder / "maze.obj")
        must("generate", "cornell", "--elements", 400, "-o", cls.folder / "cornell.obj")
        must("generate", "patio", "--elements", 500, "-o", cls.folder / "patio.obj")
        few = ["--rays", 128, "--probes", 0, "--quiet"]
        base = cls.folder / "base.h5"
        must("precompute", cls.folder / "maze.obj", "-o", base, "--keep-form-factors", *few)
        cls.stores = {}
        stores = cls.folder / "stores"
        stores.mkdir()
        for name, options in KINDS.items():
            must("precompute", base, "-o", stores / f"{name}.h5", "--probes", 0, "--quiet", *options)
        must("precompute", cls.folder / "cornell.obj", "-o", stores / "colour.h5", "--method", "low-rank", "--epsilon", .3, *few)
        must("precompute", cls.folder / "patio.obj", "-o", stores / "patio.h5", "--method", "low-rank", "--epsilon", .3,
             "--sky", "tregenza", *few)
        must("precompute", cls.folder / "maze.obj", "-o", stores / "refined.h5", "--method", "low-rank", "--epsilon", .2,
             "--keep-form-factors", *few)
        must("precompute", cls.folder / "patio.obj", "-o", stores / "tiles.h5", "--emitters", "sky", "--sky", "tregenza",
             "--store-precision", "f32", *few)
        for path in sorted(stores.glob("*.h5")):
            cls.stores[path.stem] = Store(path)
        cls.daemon = Daemon("--stores", stores)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def ask(self, name, body, status=200):
        answer = self.daemon.radiosity(name, body)
        self.assertEqual(answer.status, status, answer)
        return answer.json()

    def check(self, store, quantity, E, linear, limited, L=None):
        """limited [b][C][n] has no light below zero, and the means of groups of linear where these are not negative."""
        direct = store.direct(quantity, E.astype(float), L)
        self.assertGreaterEqual(limited.min(), 0)
        # Direct light is rounded too, three times at most.
        self.assertGreaterEqual((limited - direct + 3 * U * direct).min(), 0)
        for g in range(len(store.names)):
            i = store.members(g)
            A = store.area[i]
            before, after = (linear - direct)[..., i] @ A, (limited - direct)[..., i] @ A
            slack = 4 * U * (np.maximum(np.abs(linear), direct)[..., i] @ A)
            self.assertLessEqual((np.abs(after - np.maximum(before, 0)) - slack).max(), 0, (store.path, quantity, g))

    def solve(self, store, E, quantity, *options):
        np.save(self.folder / "e.npy", E if store.channels > 1 else E[:, 0])
        done = must("solve", store.path, "--emission", self.folder / "e.npy", "--quantity", quantity,
                    "-o", self.folder / "b.npy", *options)
        return np.load(self.folder / "b.npy").astype(float).reshape(E.shape), done.stderr

    def test_every_kind_and_both_programs(self):
        raised = {}
        for name, store in self.stores.items():
            if name == "tiles":
                continue
            E = store.emissions(len(name))
            for quantity in QUANTITIES:
                linear, quiet = self.solve(store, E, quantity, "--linear")
                limited, said = self.solve(store, E, quantity)
                self.check(store, quantity, E.astype(float), linear, limited)
                self.assertNotIn("below zero", quiet)
                emissions = E.tolist() if store.channels > 1 else E[:, 0].tolist()
                body = {"emissions": emissions, "quantity": quantity}
                answer = self.ask(name, body)
                given = np.array(answer[quantity], np.float32).reshape(E.shape)
                self.assertTrue((given == limited.astype(np.float32)).all())
                self.assertEqual(len(answer["limited"]), len(E))
                raised[name] = raised.get(name, 0) + sum(answer["limited"])
                self.assertEqual("below zero" in said, sum(answer["limited"]) > 0)
                plain = self.ask(name, dict(body, limit=False))
                self.assertNotIn("limited", plain)
                self.assertTrue((np.array(plain[quantity], np.float32).reshape(E.shape) == linear.astype(np.float32)).all())
                # Alone, and element by element, the bits are those of the batch.
                v = 1
                alone = self.ask(name, {"emission": emissions[v], "quantity": quantity})
                self.assertEqual((alone[quantity], alone["limited"]), (answer[quantity][v], answer["limited"][v]))
                some = [store.n - 1, 3, 3, store.n // 2]
                chosen = self.ask(name, {"emissions": emissions, "quantity": quantity, "select": {"elements": some}})
                self.assertTrue((np.array(chosen[quantity], np.float32).reshape(*E.shape[:2], 4) == given[..., some]).all())
                g = store.names[store.group[3]]
                chosen = self.ask(name, {"emissions": emissions, "quantity": quantity, "select": {"groups": [g]}})
                self.assertTrue((np.array(chosen[quantity], np.float32).reshape(*E.shape[:2], -1) ==
                                 given[..., store.members(store.group[3])]).all())
                # Figures of limited values; a mean alone, by an adjoint row, is that of the linear map or 0.
                figures = self.ask(name, {"emissions": emissions, "quantity": quantity,
                                          "reduce": {"groups": [g], "with": ["min", "mean"]}})
                low = np.array(figures["groups"][g]["min"]).reshape(E.shape[:2])
                self.assertTrue((low.astype(np.float32) == given[..., store.members(store.group[3])].min(-1)).all())
                means = self.ask(name, {"emissions": emissions, "quantity": quantity,
                                        "reduce": {"groups": [g], "with": ["mean"]}})
                self.assertGreaterEqual(np.array(means["groups"][g]["mean"]).min(), 0)
        # A test that finds nothing to limit would say nothing.
        for name in "lowrank", "hierarchical", "half", "colour", "patio", "refined":
            self.assertGreater(raised[name], 0, name)

    def test_the_error_does_not_grow(self):
        store = self.stores["refined"]
        E = store.emissions(5)
        for quantity in QUANTITIES:
            truth, _ = self.solve(store, E, quantity, "--tolerance", 1e-6)
            self.assertGreaterEqual(truth.min(), 0)
            direct = store.direct(quantity, E.astype(float))
            size = np.sqrt(((truth - direct)**2 @ store.area).sum(-1))
            off = {}
            for options in ("--linear",), ():
                x, _ = self.solve(store, E, quantity, *options)
                off[options] = (np.sqrt(((x - truth)**2 @ store.area).sum(-1))[size > 0] / size[size > 0]).mean()
            self.assertLessEqual(off[()], off[("--linear",)], quantity)

    def test_skies(self):
        store = self.stores["patio"]
        rng = np.random.default_rng(3)
        L = np.where(rng.random((4, 145)) < .05, rng.random((4, 145)), 0).astype(np.float32)
        E = np.zeros((4, store.channels, store.n))
        for quantity in QUANTITIES:
            body = {"emissions": [{"sky": row.tolist()} for row in L], "quantity": quantity}
            limited, linear = (self.ask("patio", dict(body, limit=limit))[quantity] for limit in (True, False))
            self.check(store, quantity, E, np.array(linear).reshape(E.shape), np.array(limited).reshape(E.shape), L[:, None])
            x = np.array(self.ask("tiles", body)[quantity])
            self.assertGreaterEqual(x.min(), 0)

    def test_numpy_answers_have_a_header(self):
        store = self.stores["lowrank"]
        E = store.emissions(8)[:, 0]
        answer = self.daemon.post("/v1/scenes/lowrank/radiosity", npy(E), kind="application/x-npy", accept="application/x-npy")
        self.assertEqual(answer.status, 200, answer)
        counted = self.ask("lowrank", {"emissions": E.tolist()})["limited"]
        self.assertGreater(sum(counted), 0)
        self.assertEqual(int(answer.headers["Lambert-Limited"]), sum(counted))
        plain = self.daemon.radiosity("lowrank", {"emissions": E.tolist(), "limit": False})
        self.assertNotIn("Lambert-Limited", plain.headers)

    def test_queries_of_arrays(self):
        """An array has no place for members: its request has them in the query, and the bits of one in JSON."""
        E = self.stores["lowrank"].emissions(8)[:, 0]
        route, as_array = "/v1/scenes/lowrank/radiosity", {"kind": "application/x-npy", "accept": "application/x-npy"}
        for quantity in QUANTITIES:
            for limit in True, False:
                body = {"emissions": E.tolist(), "quantity": quantity, "limit": limit}
                wanted = self.daemon.post(route, body, accept="application/x-npy")
                answer = self.daemon.post(f"{route}?quantity={quantity}&limit={str(limit).lower()}", npy(E), **as_array)
                self.assertEqual((answer.status, answer.body), (200, wanted.body), (quantity, limit))
                self.assertEqual("Lambert-Limited" in answer.headers, limit)
        for query, kind, words in (("limits=false", "wrong-members", '"limits", may have limit and quantity alone'), ("limit=no", "unknown-word", "limit=no must be true or false"),
                                   ("limit", "unknown-word", "limit= must"), ("quantity=light", "unknown-word", "quantity=light must be radiosity"),
                                   ("limit=false&limit=true", "given-twice", '"limit" a second time')):
            answer = self.daemon.post(f"{route}?{query}", npy(E), **as_array)
            self.assertEqual((answer.status, answer.json()["type"].split("#")[1]), (422, kind), query)
            self.assertIn(words, answer.json()["detail"])
        for more in {}, {"reduce": {"groups": ["floor"], "with": ["mean"]}}:
            answer = self.daemon.post(route + "?limit=false", {"emission": {"groups": {"floor": 1}}, **more})
            self.assertEqual(answer.status, 422)
            self.assertIn("in JSON has its members in its body", answer.json()["detail"])

    def test_signed_emissions(self):
        """The answer to a difference is the difference of linear answers, whichever program and form."""
        for name in "lowrank", "hierarchical", "sparse", "colour":
            store = self.stores[name]
            E = store.emissions(11, 8)
            D = E[:4] - E[4:]
            for quantity in QUANTITIES:
                linear, _ = self.solve(store, E, quantity, "--linear")
                signed, said = self.solve(store, D, quantity)
                self.assertNotIn("below zero", said)
                # Each is as far from the exact product as single precision and sums of it are: of the largest values.
                slack = 1e-5 * max(np.abs(linear).max(), 1)
                self.assertLessEqual(np.abs(signed - (linear[:4] - linear[4:])).max(), slack, (name, quantity))
                emissions = D.tolist() if store.channels > 1 else D[:, 0].tolist()
                answer = self.ask(name, {"emissions": emissions, "quantity": quantity})
                self.assertTrue((np.array(answer[quantity], np.float32).reshape(D.shape) == signed.astype(np.float32)).all())
                g = store.names[store.group[3]]
                i, A = store.members(store.group[3]), store.area[store.members(store.group[3])]
                means = self.ask(name, {"emissions": emissions, "quantity": quantity,
                                        "reduce": {"groups": [g], "with": ["mean"]}})["groups"][g]["mean"]
                self.assertLessEqual(np.abs(np.array(means).reshape(D.shape[:2]) - signed[..., i] @ A / A.sum()).max(), slack)
            i = int(np.nonzero(D[0, 0])[0][0])
            body = {"emission": {"elements": [i], "values": [-2]}}
            plus = self.ask(name, {"emission": {"elements": [i], "values": [2]}, "limit": False})
            minus = self.ask(name, body)
            self.assertEqual((-np.array(minus["radiosity"])).tolist(), plus["radiosity"])
            self.assertEqual(np.max(minus["limited"]), 0)
            if "error" in plus:
                self.assertEqual(minus["error"], plus["error"])

    def test_signs_are_refused_where_they_mean_nothing(self):
        problem = self.ask("patio", {"emission": {"sky": [-1.0] + [0.0] * 144}}, 422)
        self.assertEqual(problem["pointer"], "/emission/sky/0")
        problem = self.ask("tiles", {"emission": {"emitters": [-1.0] + [0.0] * 144}}, 422)
        self.assertEqual(problem["pointer"], "/emission/emitters/0")
        problem = self.ask("refined", {"emission": {"elements": [3], "values": [-1]}, "tolerance": .1}, 422)
        self.assertIn("-1", problem["detail"])
        np.save(self.folder / "minus.npy", -np.ones(self.stores["refined"].n, np.float32))
        done = lambert("render", self.stores["refined"].path, "--emission", self.folder / "minus.npy",
                       "-o", self.folder / "a.png")
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1), done.stderr)
        self.assertIn("must not be negative", done.stderr)

    def test_refusals(self):
        for value in 0, "no", None, [], {}:
            problem = self.ask("lowrank", {"emission": {"elements": [0], "values": [1]}, "limit": value}, 422)
            self.assertEqual(problem["pointer"], "/limit")
        done = lambert("solve", self.stores["refined"].path, "--linear", "--tolerance", .1)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--linear is not for --tolerance", done.stderr)

    def test_gradients_are_of_the_linear_map(self):
        store = self.stores["lowrank"]
        g = np.zeros(store.n)
        g[store.n // 3] = 1
        gradient = self.daemon.post("/v1/scenes/lowrank/adjoint", {"cotangent": g.tolist()}).json()["gradient"]["emission"]
        E = store.emissions(8)[:, 0]
        linear = np.array(self.ask("lowrank", {"emissions": E.tolist(), "limit": False})["radiosity"])
        self.assertLess(np.abs(E @ np.array(gradient) - linear @ g).max(), 1e-4 * np.abs(linear).max())


if __name__ == "__main__":
    unittest.main()
