"""Black box: the luminaires of a store, whose direct light H0 is reflected as E' = E + rho H0. Answers are held against the same
store's answers to the emission rho H0, and against solutions in double of what h5py reads from it alone."""

import copy
import itertools
import json
import pathlib
import shutil
import tempfile
import time
import unittest

import h5py
import numpy as np

from command import must
from daemon import PATIENCE, Daemon
from make_store import Luminaires, Scene, add_checksums
from yard import Truth, precompute_yard, write_yard

QUANTITIES = "radiosity", "irradiance", "indirect"
TOLERANCE = 1e-5  # as in test_daemon_answers.py: single precision, sums of some 100 products
# Both sides are the same sums in single precision by the same operator, of numbers whose last bits differ by rounding: some 2^-24 for
# each of them, and as much for each factor of M, below 1e-6 of the largest.
SAME = 1e-6
KINDS = {
    "low": ["--method", "low-rank", "--epsilon", ".2"],
    "coarse": ["--method", "2msc"],
    "exact": ["--method", "exact"],
    "sparse": ["--method", "sparse", "--threshold", "1e-2"],
    "hierarchical": ["--method", "hierarchical", "--epsilon", ".2"],
    "bytes": ["--method", "low-rank", "--epsilon", ".3", "--store-precision", "i8"],
    "sides": ["--method", "low-rank", "--epsilon", ".2", "--two-sided"],
    "grey": ["--method", "low-rank", "--epsilon", ".2", "--reflectance", ".9"],
    "paint": ["--method", "low-rank", "--keep-factors"],
}
LIT = {"desk-1": 1, "row-a": [.5, 1, 2]}
GREY = {"desk-1": 1, "row-a": .5, "wall": 3}


def dimmers(l, of):
    """D [C][k] of a `luminaires` by names of luminaires and groups."""
    D = np.zeros((l.channels, len(l.names)))
    for name, values in of.items():
        for k, (own, group) in enumerate(zip(l.names, l.groups)):
            if name in (own, group):
                D[:, k] = values
    return D


class Answers(unittest.TestCase):
    """Of stores whose answers are known."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-luminaires-")
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        cls.folder = path
        cls.scenes = {
            "grey": Scene(60, seed=1).write(path / "grey.h5", "grey", sky=6),
            "exact": Scene(40, seed=2).write(path / "exact.h5", "exact", kind="exact", error=False),
            "colour": Scene(50, channels=3, seed=4).write(path / "colour.h5", "colour", sky=4),
            "exact3": Scene(20, channels=3, seed=5).write(path / "exact3.h5", "exact3", kind="exact"),
        }
        cls.lights = {name: Luminaires(scene.n, scene.channels, seed=k).add_to(path / f"{name}.h5")
                      for k, (name, scene) in enumerate(cls.scenes.items())}
        Scene(30).write(path / "plain.h5", "plain")
        (path / "token").write_text("secret\n")
        cls.daemon = Daemon("--stores", path, "--max-variants", 2, "--token-file", path / "token")
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def post(self, path, body, method="POST"):
        return self.daemon.ask(method, path, json.dumps(body), {"Authorization": "Bearer secret", "Content-Type": "application/json"})

    def ask(self, name, body):
        answer = self.post(f"/v1/scenes/{name}/radiosity", body)
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def close(self, got, wanted, what, tolerance=TOLERANCE):
        wanted = np.asarray(wanted)
        got = np.asarray(got, float).reshape(wanted.shape)
        self.assertLessEqual(np.abs(got - wanted).max(), tolerance * np.abs(wanted).max(), what)

    def truth(self, name, of, quantity, E=0, L=None, scene=None):
        """The answer [C][n] in double to luminaires `of` beside E and the radiances L."""
        scene = scene or self.scenes[name]
        H0 = self.lights[name].direct(dimmers(self.lights[name], of))
        if L is not None:
            H0 = H0 + L @ scene.first_bounce(L.shape[-1]).astype(float)
        return scene.solve(E + scene.rho * H0, quantity) + (H0 if quantity == "irradiance" else 0)

    def test_answers_are_those_of_the_scene(self):
        for name, scene in self.scenes.items():
            of = LIT if scene.channels == 3 else GREY
            lamp = np.zeros((scene.channels, scene.n))
            lamp[:, scene.members("lamp")] = 2
            for quantity in QUANTITIES:
                body = {"emission": {"luminaires": of}, "quantity": quantity, "limit": False}
                got = self.ask(name, body)
                self.assertEqual(got["unit"], "lx" if quantity == "irradiance" else "lm/m2")
                self.close(got[quantity], self.truth(name, of, quantity), (name, quantity))
                body["emission"] = {"luminaires": of, "groups": {"lamp": 2}}
                self.close(self.ask(name, body)[quantity], self.truth(name, of, quantity, lamp), (name, quantity))
                body["select"] = {"groups": ["wall"]}
                self.close(self.ask(name, body)[quantity], self.truth(name, of, quantity, lamp)[:, scene.members("wall")], name)

    def test_beside_a_sky(self):
        for name, m in ("grey", 6), ("colour", 4):
            C, L = self.scenes[name].channels, np.arange(m) / 4
            for quantity in QUANTITIES:
                body = {"emission": {"sky": L.tolist(), "luminaires": GREY}, "quantity": quantity}
                wanted = self.truth(name, GREY, quantity, L=np.broadcast_to(L, (C, m)))
                self.close(self.ask(name, body)[quantity], wanted, (name, quantity))

    def test_batches_have_the_same_bits(self):
        emissions = [{"luminaires": GREY}, {"groups": {"lamp": 1}}, {"luminaires": {"*": 1}, "sky": [1] * 4}, {"sky": [2] * 4},
                     {"luminaires": LIT, "elements": [3], "values": [2]}] * 4
        many = self.ask("colour", {"emissions": emissions})["radiosity"]
        for k, one in enumerate(emissions):
            self.assertEqual(self.ask("colour", {"emission": one})["radiosity"], many[k], k)

    def test_figures_of_groups(self):
        """By adjoint rows, and by vectors: min asks for these."""
        for name, scene in self.scenes.items():
            of = LIT if scene.channels == 3 else GREY
            for quantity in QUANTITIES:
                x = self.truth(name, of, quantity)
                for figures in ["mean"], ["mean", "min"]:
                    body = {"emissions": [{"luminaires": {}}, {"luminaires": of}], "quantity": quantity,
                            "reduce": {"groups": ["lamp", "box"], "with": figures}}
                    for _ in range(2):  # the second time the rows are known
                        got = self.ask(name, body)["groups"]
                        for group in "lamp", "box":
                            members = scene.members(group)
                            A = scene.area[members]
                            mean = np.array(got[group]["mean"], float)
                            self.assertFalse(np.any(mean[0]))
                            self.assertLessEqual(np.abs(mean[1] - (x[:, members] @ A) / A.sum()).max(), TOLERANCE * x.max(),
                                                 (name, quantity, figures, group))

    def test_a_variant_keeps_them(self):
        base = self.scenes["colour"]
        red = {"wall": [.7, .1, .1]}
        done = self.post("/v1/scenes/colour/reflectance", {"variant": "red", "groups": red}, "PUT")
        self.assertEqual(done.status, 202, done)
        deadline = time.monotonic() + PATIENCE
        while self.post("/v1/scenes/colour@red", {}, "GET").status == 202 and time.monotonic() < deadline:
            time.sleep(.002)
        other = base.relit(red)
        lists = [self.post(f"/v1/scenes/{name}/luminaires", {}, "GET").json() for name in ("colour", "colour@red")]
        self.assertEqual(*lists)
        for quantity in QUANTITIES:
            body = {"emission": {"luminaires": LIT}, "quantity": quantity}
            wanted = self.truth("colour", LIT, quantity, scene=other)
            self.close(self.ask("colour@red", body)[quantity], wanted, quantity)
            self.assertGreater(np.abs(wanted - self.truth("colour", LIT, quantity)).max(), 100 * TOLERANCE * wanted.max())
            mean = self.ask("colour@red", dict(body, reduce={"groups": ["wall"], "with": ["mean"]}))["groups"]["wall"]["mean"]
            members = base.members("wall")
            A = base.area[members]
            self.assertLessEqual(np.abs(np.array(mean) - wanted[:, members] @ A / A.sum()).max(), TOLERANCE * wanted.max())

    def test_gradients(self):
        """J = sum g q is linear in dimmers, so that the gradient is J of each at 1; by reflectance against differences."""
        for name, scene in self.scenes.items():
            l, C, rng = self.lights[name], scene.channels, np.random.default_rng(3)
            g = rng.integers(-8, 8, (C, scene.n)) / 8
            for quantity in QUANTITIES:
                body = {"cotangent": (g if C > 1 else g[0]).tolist(), "quantity": quantity}
                answer = self.post(f"/v1/scenes/{name}/adjoint", body).json()
                got = np.array(answer["gradient"]["luminaires"])
                self.assertEqual(got.shape, (C, 5) if C > 1 else (5,))
                wanted = np.empty((C, 5))
                for k in range(5):
                    D = np.zeros((C, 5))
                    D[:, k] = 1
                    H0 = l.direct(D)
                    wanted[:, k] = (g * (scene.solve(scene.rho * H0, quantity) + (H0 if quantity == "irradiance" else 0))).sum(1)
                # Of the sum of |g| |q|, as the terms of J have both signs.
                self.assertLessEqual(np.abs(got.reshape(wanted.shape) - wanted).max(), TOLERANCE * scene.n * np.abs(wanted).max(), name)
                alone = self.post(f"/v1/scenes/{name}/adjoint", dict(body, gradient=["luminaires"])).json()["gradient"]
                self.assertEqual(alone, {"luminaires": answer["gradient"]["luminaires"]})
                by_rho = dict(body, gradient=["reflectance"], emission={"luminaires": GREY})
                got = np.reshape(self.post(f"/v1/scenes/{name}/adjoint", by_rho).json()["gradient"]["reflectance"], (C, scene.n))
                for i in 3, 8, 17:
                    # Central differences of a quotient of polynomials: their error is of h^2.
                    h, rho = 1e-4, scene.rho.copy()
                    J = []
                    for step in h, -h:
                        rho[:, i] = scene.rho[:, i] + step
                        J.append((g * self.truth(name, GREY, quantity, scene=scene.with_reflectance(rho.copy()))).sum(1))
                    np.testing.assert_allclose(got[:, i], (J[0] - J[1]) / (2 * h), rtol=1e-3, atol=1e-4 * np.abs(got).max())

    def test_units(self):
        body = {"emission": {"luminaires": GREY}, "quantity": "irradiance"}
        plain = np.array(self.ask("grey", body)["irradiance"])
        for unit, factor in ("lx", 1), ("klx", 1e-3), ("W/m2", 1 / 179):
            got = self.ask("grey", dict(body, unit=unit))
            self.assertEqual(got["unit"], unit)
            self.close(got["irradiance"], plain * factor, unit, SAME)

    def test_the_list(self):
        for name in "grey", "colour":
            l = self.lights[name]
            told = self.daemon.ask("GET", f"/v1/scenes/{name}/luminaires", None, {"Authorization": "Bearer secret"})
            self.assertEqual((told.status, told.headers["Content-Type"]), (200, "application/json"))
            told = told.json()
            self.assertEqual([one["name"] for one in told["luminaires"]], list(l.names))
            self.assertEqual([one["group"] for one in told["luminaires"]], list(l.groups))
            for member, wanted in {"at": l.at, "aim": -l.z, "c0": l.x, "dim": l.dimmers, "lumens": l.lumens, "colour": l.colour}.items():
                np.testing.assert_array_equal([one[member] for one in told["luminaires"]], wanted)
            self.assertEqual([one["opening"]["shape"] for one in told["luminaires"]], ["point", "rectangle", "box", "disc", "ellipse"])
            np.testing.assert_array_equal([one["opening"]["size"] for one in told["luminaires"]], l.size)
            self.assertEqual([(g["name"], g["luminaires"]) for g in told["groups"]], [("desks", 2), ("row-a", 2)])
            np.testing.assert_allclose([g["lumens"] for g in told["groups"]], [l.lumens[:2].sum(), l.lumens[2:4].sum()], rtol=1e-15)
            self.assertAlmostEqual(told["lumens"], l.lumens.sum(), delta=1e-9)
            about = self.daemon.ask("GET", f"/v1/scenes/{name}", None, {"Authorization": "Bearer secret"}).json()
            self.assertEqual(about["luminaires"]["count"], 5)
            self.assertAlmostEqual(about["luminaires"]["lumens"], l.lumens.sum(), delta=1e-9)
            self.assertIn(f"luminaires        5, {l.lumens.sum():.5g} lm\n", must("info", self.folder / f"{name}.h5").stdout)
        answer = self.daemon.ask("GET", "/v1/scenes/plain/luminaires", None, {"Authorization": "Bearer secret"})
        self.assertEqual((answer.status, answer.json()["detail"]), (404, "plain: the store has no luminaires"))
        self.assertIsNone(self.daemon.ask("GET", "/v1/scenes/plain", None, {"Authorization": "Bearer secret"}).json()["luminaires"])

    def test_refusals(self):
        for name, emission, words in (
                ("grey", {"luminaires": {"desk1": 1}},
                 'emission/luminaires/desk1: the scene has no luminaire "desk1"; did you mean "desk-1"?'),
                ("grey", {"luminaires": {"desk-1": 1, "desks": 1}}, "emission/luminaires/desks: the luminaire desk-1 is given twice"),
                ("grey", {"luminaires": {"wall": -1}}, "emission/luminaires/wall = -1, must not be negative"),
                ("grey", {"luminaires": {"wall": "3600lm"}}, "emission/luminaires/wall must be a number or one for each channel"),
                ("grey", {"luminaires": [1, 2, 3, 4, 5]}, "emission/luminaires must be an object of names and dimmers"),
                ("plain", {"luminaires": {"wall": 1}},
                 "emission/luminaires: the store has no luminaires; precompute it with --luminaires")):
            answer = self.post(f"/v1/scenes/{name}/radiosity", {"emission": emission})
            self.assertEqual((answer.status, answer.json()["detail"]), (422, words))
        for body, words in (({"cotangent": {"luminaires": {"wall": 1}}}, "cotangent/luminaires: a cotangent is of elements, groups or sensors"),
                            ({"cotangent": {"groups": {"wall": 1}}, "gradient": ["luminaires"]},
                             "gradient/0: the store has no luminaires; precompute it with --luminaires")):
            answer = self.post("/v1/scenes/plain/adjoint", body)
            self.assertEqual((answer.status, answer.json()["detail"]), (422, words))

    def test_stores_for_sources_state_no_error(self):
        """Luminaires light elements that are no sources; a dark one lights none."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name) / "some.h5"
        Scene(60).write(path, "some", sources=range(0, 60, 2))
        Luminaires(60).add_to(path)
        with Daemon(path) as daemon:
            for dimmer, of in (1, "others"), (0, "sources"):
                error = daemon.radiosity("some", {"emission": {"luminaires": {"wall": dimmer}}}).json()["error"]
                self.assertEqual(error["from"], of)
                self.assertEqual(error["stated"] is None, of == "others")

    def test_broken_stores_are_refused(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name) / "broken.h5"
        for array, place, value, words in (("irradiance", (1, 3), -1, "/luminaires/irradiance[1][3] = -1"),
                                           ("opening", (2, 0), 11, "/luminaires/opening[2][0] = 11, must be an integer below 11"),
                                           ("group", 1, 7, "/luminaires/group[1] = 7, must be below 2")):
            Scene(30).write(path, "broken")
            Luminaires(30).add_to(path)
            with h5py.File(path, "r+") as f:
                f["luminaires"][array][place] = value
                add_checksums(f)
            with Daemon(path, self.folder / "plain.h5") as daemon:
                self.assertIn(words, daemon.errors())
                self.assertEqual([s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]], ["plain"])


class Kinds(unittest.TestCase):
    """Of every kind of operator, as `lambert precompute` makes it."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-luminaires-")
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        cls.stores, cls.lights, cls.truth = {}, {}, {}
        for name, options in KINDS.items():
            cls.stores[name] = precompute_yard(path, name, *options, probes=8)
            cls.truth[name] = t = Truth(cls.stores[name])
            cls.lights[name] = Luminaires(t.n, t.C, seed=7, mesh_groups=len(t.groups)).add_to(cls.stores[name])
        cls.daemon = Daemon(*cls.stores.values())
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def ask(self, name, body):
        answer = self.daemon.radiosity(name, body)
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def test_they_are_answered_as_an_emission(self):
        for name in KINDS:
            truth, l = self.truth[name], self.lights[name]
            of = LIT if truth.C == 3 else GREY
            H0 = l.direct(dimmers(l, of))
            E = truth.rho * H0
            for quantity, limit in itertools.product(QUANTITIES, (False, True)):
                body = {"quantity": quantity, "limit": limit}
                got = np.reshape(self.ask(name, dict(body, emission={"luminaires": of}))[quantity], E.shape)
                same = np.reshape(self.ask(name, dict(body, emission=E.tolist() if truth.C == 3 else E[0].tolist()))[quantity], E.shape)
                if quantity == "irradiance":
                    same = same + H0
                self.assertLessEqual(np.abs(got - same).max(), SAME * np.abs(same).max(), (name, quantity, limit))

    def test_refined_answers(self):
        """Against a dense solution in double, by their certificates; the slack is that of test_tolerance.py."""
        for name in KINDS:
            truth, l = self.truth[name], self.lights[name]
            of = {name: np.float32(values).tolist() for name, values in (LIT if truth.C == 3 else GREY).items()}
            H0 = l.direct(dimmers(l, of))
            E = truth.rho * H0
            B = np.stack([np.linalg.solve(np.eye(truth.n) - r[:, None] * truth.F, e) for r, e in zip(truth.rho, E)])
            wanted = {"radiosity": B, "irradiance": H0 + B @ truth.F.T, "indirect": B - E}
            for quantity in QUANTITIES:
                for tolerance in 1e-3, 1e-9:
                    answer = self.ask(name, {"emission": {"luminaires": of}, "quantity": quantity, "tolerance": tolerance})
                    worst = np.abs(np.reshape(answer[quantity], E.shape) - wanted[quantity]).max()
                    self.assertLessEqual(worst, answer["certificate"] + 1e-13 * wanted[quantity].max(), (name, quantity))

    def error(self, daemon, name, emission, quantity, **members):
        answer = daemon.radiosity(name, {"emission": emission, "quantity": quantity, "limit": False, **members})
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(answer.json()["error"]["light"], "own")
        return answer.json()["error"]

    def test_stated_errors_are_those_of_the_emission(self):
        """Where the direct light is exact, as an emission rho H0 makes the same error; rows and vectors state the same."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        for name in "low", "grey":
            truth, l = self.truth[name], copy.copy(self.lights[name])
            C, of = truth.C, LIT if truth.C == 3 else GREY
            D = dimmers(l, of)
            E = truth.rho * l.direct(D)
            E = E.tolist() if C == 3 else E[0].tolist()
            l.off = 0 * l.off
            shutil.copy(self.stores[name], path / "right.h5")
            with h5py.File(path / "right.h5", "r+") as f:
                del f["luminaires"]
            l.add_to(path / "right.h5")
            groups = {"groups": ["floor", "south"], "with": ["mean"]}
            vectors = dict(groups, **{"with": ["mean", "min"]})
            with Daemon(path / "right.h5", f"{self.stores[name]}:off") as daemon:
                for quantity in QUANTITIES:
                    lit = self.error(daemon, "right", {"luminaires": of}, quantity)
                    same = self.error(daemon, "right", E, quantity)
                    # Of irradiance the one has H0 in |H|, the other not.
                    for figure in ["indirect_mean", "emitters"] + ["relative_mean"] * (quantity != "irradiance"):
                        self.assertAlmostEqual(lit[figure] / same[figure], 1, delta=1e-4, msg=(name, quantity, figure))
                    self.assertGreater(lit["parts"]["operator"], 0)
                    same = self.error(daemon, "right", E, quantity, reduce=vectors)["groups"]
                    # The figures of a row are of the mean reflectance of a group, which is that of its elements here.
                    for reduce in groups, vectors:
                        by_group = self.error(daemon, "right", {"luminaires": of}, quantity, reduce=reduce)["groups"]
                        for group in groups["groups"]:
                            for figure in "mean", "elements":
                                self.assertAlmostEqual(by_group[group][figure] / same[group][figure], 1, delta=1e-3)
                    self.check_direct(daemon, name, D, of, quantity, vectors, same)

    def check_direct(self, daemon, name, D, of, quantity, reduce, right):
        """Squares of errors of `off` are larger than of the right ones by D = sum rho^2 (d f)^2 off, of irradiance without rho."""
        truth, l = self.truth[name], self.lights[name]
        colour = l.colour.T if truth.C == 3 else np.ones_like(D)
        lit = self.error(daemon, "off", {"luminaires": of}, quantity, reduce=reduce)["groups"]
        H0 = l.direct(D)
        body = {"emission": {"luminaires": of}, "quantity": "indirect", "limit": False}
        B = np.reshape(daemon.radiosity("off", body).json()["indirect"], H0.shape)
        for group in reduce["groups"]:
            g = truth.groups.index(group)
            i = truth.group == g
            rho = truth.rho[:, i].mean(1)
            light = (B[:, i] @ truth.area[i]) / truth.area[i].sum() / (rho if quantity == "irradiance" else 1)
            seen = {"radiosity": rho, "irradiance": 1, "indirect": 0}[quantity]
            for figure, off in zip(("elements", "mean"), l.off):
                direct = ((np.broadcast_to(seen, truth.C)[:, None] * D * colour) ** 2 @ off[:, g]).sum()

                def square(x):  # error_ratio of error_law.h, undone
                    return (light**2).sum() * (x * x / (1 + x * x) if x < 1 else x * x / 2)
                larger = square(lit[group][figure]) - square(right[group][figure])
                # Differences of squares lose digits that both have, some 1e-5 of each.
                slack = 1e-3 * direct + 1e-4 * square(right[group][figure])
                self.assertAlmostEqual(larger, direct, delta=slack, msg=(quantity, group, figure))

    def test_without_errors_of_luminaires_those_of_the_store_stay(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name) / "silent.h5"
        shutil.copy(self.stores["low"], path)
        with h5py.File(path, "r+") as f:
            del f["luminaires/elements_off"], f["luminaires/means_off"]
            add_checksums(f)
        with Daemon(path) as daemon:
            for reduce in {}, {"reduce": {"groups": ["floor"], "with": ["mean"]}}:
                answer = daemon.radiosity("silent", {"emission": {"luminaires": {"wall": 1}}, **reduce}).json()
                self.assertEqual(answer["error"]["light"], "lights")


class Precomputed(unittest.TestCase):
    """Of a store that `lambert precompute --luminaires` made: the daemon says and answers what the command line does."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-luminaires-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        (path / "spot.ies").write_text("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 .3 1.2 0\n1 1 30\n0 30 60 90\n0\n1000 850 450 0\n")
        (path / "lights.json").write_text(json.dumps({"luminaires": [
            {"name": "row", "file": "spot.ies", "from": [1, 1, 2.8], "steps": [[2, 0, 0]], "counts": [2], "dim": .7},
            {"name": "desk", "file": "spot.ies", "at": [2, 3, 2.8], "aim": [0, 1, -2], "colour": [1.2, 1, .4]}]}))
        write_yard(path)
        must("precompute", path / "yard.obj", "-o", path / "yard.h5", "--elements", 600, "--luminaires", path / "lights.json", "--lights",
             "lm", "--method", "low-rank", "--epsilon", ".2")
        cls.daemon = Daemon(path / "yard.h5")
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def test_answers_are_those_of_solve(self):
        for quantity in QUANTITIES:
            for of in {"row": .4, "desk": 1}, {"row.1": 2}:
                dims = [word for name, value in of.items() for word in ("--dim", f"{name}={value}")]
                told = json.loads(must("solve", self.folder / "yard.h5", *dims, "--quantity", quantity, "--json").stdout)
                must("solve", self.folder / "yard.h5", *dims, "--quantity", quantity, "-o", self.folder / "o.npy")
                wanted = np.load(self.folder / "o.npy")
                answer = self.daemon.radiosity("yard", {"emission": {"luminaires": of}, "quantity": quantity}).json()
                self.assertEqual(answer["unit"], "lx" if quantity == "irradiance" else "lm/m2")
                got = np.reshape(answer[quantity], wanted.shape)
                self.assertLessEqual(np.abs(got - wanted).max(), SAME * np.abs(wanted).max(), (quantity, of))
                self.assertEqual(answer["error"]["light"], "own")
                stated = told["error"]["stated"] if "stated" in told["error"] else told["error"]
                self.assertAlmostEqual(answer["error"]["stated"] / stated, 1, delta=1e-4, msg=(quantity, of))

    def test_the_list_is_that_of_the_command_line(self):
        told = json.loads(must("luminaire", self.folder / "lights.json", "--json").stdout)
        got = self.daemon.get("/v1/scenes/yard/luminaires").json()
        for one in told["luminaires"]:
            one["lumens"] /= one["dim"]  # the list's are as dim as it says
        self.assertAlmostEqual(got["lumens"], sum(one["lumens"] for one in told["luminaires"]), delta=1e-5)
        self.assertEqual([(g["name"], g["luminaires"]) for g in got["groups"]], [(g["name"], g["luminaires"]) for g in told["groups"]])
        self.assertEqual(len(got["luminaires"]), 3)
        for one, of in zip(got["luminaires"], told["luminaires"]):
            for member, value in one.items():
                if isinstance(value, (float, list)):
                    np.testing.assert_allclose(value, of[member], rtol=1e-9, atol=1e-12, err_msg=member)
                elif member == "opening":
                    self.assertEqual(value["shape"], of[member]["shape"])
                    np.testing.assert_allclose(value["size"], of[member]["size"], rtol=1e-9)
                else:
                    self.assertEqual(value, of[member])


if __name__ == "__main__":
    unittest.main()
