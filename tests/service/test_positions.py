"""Black box: stores of the positions of a light that is no part of the scene, judged by a dense solution in
double whose direct light is a sum over points, and what is no such light."""

import json
import os
import unittest

import h5py
import numpy as np

from case import Case
from command import lambert, must
from daemon import Daemon

SQUARE = [[-.1, -.1, 0], [.1, -.1, 0], [.1, .1, 0], [-.1, .1, 0]]
DOWN = {"axis": [1, 0, 0], "degrees": 180}
POSITIONS = [{"name": "door", "move": [.3, .5, .8], "turn": DOWN}, {"move": [.5, .5, .7], "turn": DOWN},
             {"name": "window", "move": [.6, .4, .3]}]


def light(emission=4, **more):
    return {"light": {"polygon": SQUARE, "emission": emission}, **more}


def turned(position):
    """Points of the square, and its front, at a position: none but half turns about x, or none at all."""
    u = (np.arange(12) + .5) / 12 * .2 - .1
    x = np.stack(np.meshgrid(u, u, [0.]), -1).reshape(-1, 3)
    sign = -1 if "turn" in position else 1
    return x * [1, sign, sign] + position["move"], np.array([0, 0, sign])


def direct_light(store, position):
    """The mean irradiance of the elements of a box that hides nothing, of 1 W/m2, by sums over points."""
    with h5py.File(store) as h5:
        vertices, elements, normal = (h5["mesh/" + name][:] for name in ("vertices", "elements", "normal"))
    x, front = turned(position)
    t = (np.arange(6) + .5) / 6
    corner = vertices[elements]
    a, b = np.meshgrid(t, t)
    a, b = a.ravel()[:, None], b.ravel()[:, None]
    y = corner[:, None, 0] + a * (corner[:, 1] - corner[:, 0])[:, None] + b * (corner[:, 3] - corner[:, 0])[:, None]
    to = x[None, None] - y[:, :, None]
    square = (to**2).sum(-1)
    above = np.clip(np.einsum("eplk,ek->epl", to, normal), 0, None)
    before = np.clip(-(to @ front), 0, None)
    return .04 / np.pi * (above * before / square**2).mean((1, 2))


class Positions(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with h5py.File(cls.store) as h5:
            f, n = h5["form_factors"], len(h5["mesh/area"])
            cls.area = h5["mesh/area"][:]
            F = np.zeros((n, n))
            for i in range(n):
                at = slice(*f["indptr"][i:i + 2])
                F[i, f["indices"][at]] = f["data"][at]
        cls.direct = np.array([direct_light(cls.store, p) for p in POSITIONS])
        cls.truth = np.linalg.solve(np.eye(n) - F * .5, cls.direct.T).T  # H / E
        cls.file = os.path.join(cls.shared.name, "lamp.json")
        cls.of_file(cls.file, light(positions=POSITIONS))
        cls.lit = os.path.join(cls.shared.name, "lit.h5")
        must("precompute", cls.box, "--positions", cls.file, "--paths", 20000, "-o", cls.lit)

    @staticmethod
    def of_file(path, what):
        with open(path, "w") as out:
            json.dump(what, out)
        return path

    def norm(self, x):
        return np.sqrt((self.area * x**2).sum(-1))

    def test_every_way_is_as_wrong_as_it_says(self):
        for way in "ABCDE":
            store = self.path(way + ".h5")
            must("precompute", self.box, "--positions", self.file, "--paths", 20000, "--reuse", way, "-o", store)
            with h5py.File(store) as h5:
                B, names = h5["operator/B"][0], list(h5["operator/names"].asstr())
                K, direct = h5["error/emitters/covariance"][:], h5["operator/direct"][:]
                relative = h5["error/emitters/relative"][:]
                self.assertEqual(h5["operator"].attrs["kind"], b"emitters")
                self.assertEqual(h5["operator"].attrs["reuse"], way.encode())
                self.assertEqual(h5["operator/exitance"][:], [4])
                self.assertEqual(h5["positions/pose"].shape, (3, 3, 4))
                np.testing.assert_allclose(h5["positions/pose"][0, :, 3], POSITIONS[0]["move"])
                np.testing.assert_allclose(h5["positions/polygon"][:], SQUARE)
            self.assertEqual(names, ["door", "pose-1", "window"])
            off = self.norm(B - 2 * self.truth)
            stated = np.sqrt(np.diag(K))
            if way in "ABE":  # 96 elements that depend on each other, three positions
                ratio = np.sqrt((off**2).sum() / (stated**2).sum())
                self.assertTrue(.7 < ratio < 1.4, (way, ratio))
                np.testing.assert_allclose(relative, stated / self.norm(B), rtol=.05)
                mixed = self.norm((B - 2 * self.truth).sum(0)) / np.sqrt(K.sum())
                self.assertTrue(.4 < mixed < 1.8, (way, mixed))
            self.assertLess((off / self.norm(2 * self.truth)).max(), .1, way)
            self.assertLess(self.norm(direct - self.direct).max(), .1 * self.norm(self.direct).max())

    def test_walks_from_elements_are_the_best(self):
        errors = {}
        for way in "ABE":
            store = self.path(way + ".h5")
            must("precompute", self.box, "--positions", self.file, "--paths", 20000, "--reuse", way, "-o", store)
            with h5py.File(store) as h5:
                errors[way] = h5["error/single"].attrs["total_indirect_mean"]
        self.assertLess(errors["B"], errors["A"])
        self.assertLess(errors["E"], .7 * errors["B"])

    def test_daemon_and_solve_know_names(self):
        with h5py.File(self.lit) as h5:
            B, direct, K = h5["operator/B"][0], h5["operator/direct"][:], h5["error/emitters/covariance"][:]
        w = np.array([.5, 0, 2])
        with Daemon(f"{self.lit}:box") as d:
            def ask(emission, **more):
                answer = d.radiosity("box", {"emission": emission, **more})
                self.assertEqual(answer.status, 200, answer)
                return answer.json()
            named = ask({"emitters": {"window": 2, "door": .5}})
            listed = ask({"emitters": [.5, 0, 2]})
            self.assertEqual(named["radiosity"], listed["radiosity"])
            about = d.get("/v1/scenes/box").json()
            self.assertEqual(about["emitters"], ["door", "pose-1", "window"])
            np.testing.assert_allclose(about["error"]["emitters"]["relative"], np.sqrt(np.diag(K)) / self.norm(B), rtol=.05)
            text = must("info", self.lit).stdout
            self.assertIn("standard errors of random walks", text)
            self.assertRegex(text, "emitters +3: door, pose-1, window\n")
            np.testing.assert_allclose(named["radiosity"], w @ B, rtol=1e-5)
            error = named["error"]
            self.assertEqual(error["light"], "own")
            np.testing.assert_allclose(error["emitters"], 6.25 / 4.25)
            off2 = w @ K @ w
            np.testing.assert_allclose(error["relative_mean"], np.sqrt(off2 / (self.norm(w @ B)**2 - off2)), rtol=1e-4)
            bounced = w @ (B - .5 * 4 * direct)
            np.testing.assert_allclose(error["indirect_mean"], np.sqrt(off2 / (self.norm(bounced)**2 - off2)), rtol=1e-4)
            got = ask({"emitters": {"window": 2, "door": .5}}, quantity="indirect")["indirect"]
            np.testing.assert_allclose(got, bounced, atol=1e-5 * np.abs(bounced).max())
            got = ask({"emitters": {"window": 2, "door": .5}}, quantity="irradiance")["irradiance"]
            np.testing.assert_allclose(got, 2 * (w @ B), rtol=1e-5)
            self.assertEqual(ask({"emitters": {}})["radiosity"], [0] * len(self.area))
            for emission, words in (({"emitters": {"pose-2": 1}}, "did you mean \"pose-1\""),
                                    ({"emitters": {"door": -1}}, "negative"), ({"emitters": 3}, "an object of names"),
                                    ([1] * len(self.area), "no part of its mesh")):
                answer = d.radiosity("box", {"emission": emission})
                self.assertEqual(answer.status, 422, answer)
                self.assertIn(words, answer.json()["detail"])
        out = self.path("out.npy")
        must("solve", self.lit, "--emit", "door=.5", "--emit", "window=2", "-o", out)
        np.testing.assert_allclose(np.load(out), w @ B, rtol=1e-5)
        weights = self.of_file(self.path("w.json"), {"emission": {"emitters": {"door": .5, "window": 2}}})
        must("solve", self.lit, "--emission", weights, "-o", out)
        np.testing.assert_allclose(np.load(out), w @ B, rtol=1e-5)
        got = json.loads(must("solve", self.lit, "--emit", "door=.5", "--emit", "window=2", "--json").stdout)["error"]
        for name in "light", "relative_mean", "indirect_mean", "emitters":
            np.testing.assert_allclose(got[name], error[name], rtol=1e-5) if name != "light" else self.assertEqual(got[name], "own")
        self.failed("no emitter \"dor\"", "solve", self.lit, "--emit", "dor=1", "-o", out)
        self.failed("--emit door=1", "solve", self.lit)

    def test_errors_of_what_is_selected_and_reduced(self):
        with h5py.File(self.lit) as h5:
            B, direct = h5["operator/B"][0], h5["operator/direct"][:]
            K, M = h5["error/emitters/groups"][:], h5["error/emitters/group_means"][:]
            whole, group = h5["error/emitters/covariance"][:], h5["mesh/group"][:]
            names = list(h5["mesh/group_names"].asstr())
        np.testing.assert_allclose(K.sum(0), whole, rtol=1e-9)
        w = np.array([.5, 0, 2])
        g, h = names.index("floor"), names.index("wall-x0")
        inside, other = group == g, group == h
        bounced = w @ (B - .5 * 4 * direct)

        def of_mean(squares, groups):
            area = self.area[np.isin(group, groups)]
            return np.sqrt(squares / max((self.area * bounced)[np.isin(group, groups)].sum()**2 / area.sum()**2 - squares, 0))
        mean = of_mean(w @ M[g] @ w, [g])
        elements = of_mean(w @ K[g] @ w / self.area[inside].sum(), [g])
        with Daemon(f"{self.lit}:box") as d:
            def ask(**more):
                answer = d.radiosity("box", {"emission": {"emitters": {"door": .5, "window": 2}}, **more})
                self.assertEqual(answer.status, 200, answer)
                self.assertEqual(answer.json()["error"]["light"], "own")
                return answer.json()["error"]
            for figures in ["mean"], ["max", "mean"]:  # by adjoint rows, and by values
                for quantity in "radiosity", "irradiance", "indirect":
                    error = ask(reduce={"groups": ["floor"], "with": figures}, quantity=quantity)
                    np.testing.assert_allclose(error["groups"]["floor"]["mean"], mean, rtol=1e-3)
                    np.testing.assert_allclose(error["groups"]["floor"]["elements"], elements, rtol=1e-3)
                    np.testing.assert_allclose(error["indirect_mean"], mean, rtol=1e-3)
            some = np.flatnonzero(inside)[:5].tolist() + np.flatnonzero(other)[:3].tolist()
            off2 = (w @ K[g] @ w * self.area[some[:5]].sum() / self.area[inside].sum()
                    + w @ K[h] @ w * self.area[some[5:]].sum() / self.area[other].sum())
            error = ask(select={"elements": some})
            light2 = (self.area * (w @ B)**2)[some].sum()
            np.testing.assert_allclose(error["relative_mean"], np.sqrt(off2 / (light2 - off2)), rtol=1e-3)
        got = json.loads(must("solve", self.lit, "--emit", "door=.5", "--emit", "window=2", "--reduce", "floor=mean", "--json").stdout)
        np.testing.assert_allclose(got["error"]["groups"]["floor"]["mean"], mean, rtol=1e-3)
        # The truth lies within what is stated: of means the error of 20,000 paths, four standard errors.
        for k in range(len(names)):
            members = group == k
            off = (self.area * (w @ (B - 2 * self.truth)))[members].sum() / self.area[members].sum()
            self.assertLess(abs(off), 4 * np.sqrt(w @ M[k] @ w) + 2e-3 * (w @ B)[members].mean(), names[k])

    def test_paths_are_divided_evenly(self):
        path = [{"move": [.2, .2, .8], "turn": DOWN}, {"move": [.8, .2, .8], "turn": DOWN},
                {"move": [.8, .8, .6], "turn": {"axis": [1, 0, 0], "degrees": 90}}]
        for closed in False, True:
            file, store = self.path("path.json"), self.path("path.h5")
            self.of_file(file, light(path=path, closed=closed))
            must("precompute", self.box, "--path", file, "--frames", 25, "--paths", 32, "-o", store)
            with h5py.File(store) as h5:
                pose, names = h5["positions/pose"][:], list(h5["operator/names"].asstr())
            self.assertEqual(names, [f"pose-{k}" for k in range(25)])
            turn, move = pose[:, :, :3], pose[:, :, 3]
            np.testing.assert_allclose(turn @ turn.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turn.shape), atol=1e-9)
            np.testing.assert_allclose(move[0], path[0]["move"], atol=1e-12)
            ends = np.concatenate([move, move[:1]]) if closed else move
            steps = np.linalg.norm(np.diff(ends, axis=0), axis=1)
            self.assertLess(steps.max(), 1.1 * steps.min())
            if closed:
                continue
            np.testing.assert_allclose(move[-1], path[-1]["move"], atol=1e-12)
            np.testing.assert_allclose(turn[0], np.diag([1, -1, -1]), atol=1e-9)
            np.testing.assert_allclose(turn[-1] @ [0, 0, 1], [0, -1, 0], atol=1e-9)

    def test_turns_take_the_shorter_way(self):
        file, store = self.path("turn.json"), self.path("turn.h5")
        turns = [{"move": [.5, .5, .5 + k * .1], "turn": {"axis": [0, 0, 1], "degrees": degrees}} for k, degrees in enumerate((10, 350))]
        self.of_file(file, light(path=turns))
        must("precompute", self.box, "--path", file, "--frames", 5, "--paths", 32, "-o", store)
        with h5py.File(store) as h5:
            turn = h5["positions/pose"][:, :, :3]
        angles = np.degrees(np.arctan2(turn[:, 1, 0], turn[:, 0, 0]))
        np.testing.assert_allclose(angles, [10, 5, 0, -5, -10], atol=1e-9)

    def test_threads_stores_and_colours(self):
        one, two = self.path("one.h5"), self.path("two.h5")
        for store, scene, threads in (one, self.box, 1), (two, self.store, 2):
            must("precompute", scene, "--positions", self.file, "--paths", 320, "--threads", threads, "-o", store)
        with h5py.File(one) as a, h5py.File(two) as b:
            for name in "operator/B", "operator/direct", "error/emitters/covariance":
                np.testing.assert_array_equal(a[name][:], b[name][:])
        done = must("precompute", self.box, "--positions", self.file, "--paths", 320, "--rays", 64, "--epsilon", .1, "--two-sided", "-o", two)
        self.assertIn("a light that moves does not use --rays, --epsilon", done.stderr)
        with h5py.File(two) as b:
            sides = b["operator/direct"][:].reshape(3, 2, -1)
        self.assertFalse(sides[:, 1].any())
        np.testing.assert_allclose(self.norm(sides[:, 0]), self.norm(self.direct), rtol=.05)
        coloured = self.of_file(self.path("c.json"), light([4, 0, 2], positions=POSITIONS))
        must("precompute", self.box, "--positions", coloured, "--paths", 320, "-o", two)
        with h5py.File(one) as a, h5py.File(two) as b:
            grey, B = a["operator/B"][0], b["operator/B"][:]
            self.assertEqual(b["mesh/reflectance"].shape, (3, len(self.area)))
        np.testing.assert_allclose(B[0], grey, rtol=1e-5)
        np.testing.assert_allclose(B[2], grey / 2, rtol=1e-5)
        self.assertFalse(B[1].any())

    def test_verify_knows_walks(self):
        text = must("verify", self.lit, "--walks", 20000).stdout
        self.assertIn("by random walks", text)
        self.assertNotIn("BROKEN", text)
        must("precompute", self.box, "--positions", self.file, "--paths", 64, "-o", self.path("noisy.h5"))
        self.assertNotIn("BROKEN", must("verify", self.path("noisy.h5"), "--walks", 20000).stdout)

    def test_what_is_no_light_is_refused_in_one_line(self):
        def given(what, words, option="--positions", more=()):
            file = what if isinstance(what, str) else self.of_file(self.path("bad.json"), what)
            self.failed(words, "precompute", self.box, option, file, "-o", self.path("none.h5"), "--paths", 64, *more)
            self.assertFalse(os.path.exists(self.path("none.h5")))
        frames = ("--frames", 4)
        outside = [{"move": [.5, .5, .5]}, {"name": "lost", "move": [.5, .5, 3]}]
        given(light(positions=outside), "position 1 (lost)")
        given(light(positions=[{"move": [.5, .5, 1.5]}]), "inside a wall")
        for far in 1e4, 1e30:
            given(light(positions=[POSITIONS[0], {"name": "far", "move": [.5, .5, far]}]), "position 1 (far): corner 0")
        large = [[-1e9, -1e9, 0], [1e9, -1e9, 0], [1e9, 1e9, 0], [-1e9, 1e9, 0]]
        given({"light": {"polygon": large, "emission": 1}, "positions": POSITIONS}, "position 0 (door): corner 0")
        given({"light": {"polygon": [[0, 0, 0], [1, 0, 0], [2, 0, 0]], "emission": 1}, "positions": POSITIONS}, "no area")
        given({"light": {"polygon": SQUARE[:2], "emission": 1}, "positions": POSITIONS}, "3 to")
        given({"light": {"polygon": SQUARE[:3] + [[0, 0, .3]], "emission": 1}, "positions": POSITIONS}, "off the plane")
        given(light(0, positions=POSITIONS), "dark")
        given(light(-1, positions=POSITIONS), "negative")
        given(light([1, 2], positions=POSITIONS), "emission must be an array of three")
        given(light(positions=[]), "1 to")
        given(light(positions=[{"move": [0, 0]}]), "positions[0]: move must be an array of three")
        given(light(positions=[{"mvoe": [0, 0, 1]}]), "\"mvoe\"")
        given(light(positions=[{"turn": {"axis": [0, 0, 0], "degrees": 3}}]), "axis has no length")
        given(light(positions=[{"name": "a=b"}]), "no '='")
        given(light(positions=[POSITIONS[0], POSITIONS[0]]), "positions[0] and positions[1] have the same name door")
        given(light(path=POSITIONS), "--path and --frames")
        given(light(positions=POSITIONS), "--positions, not --path", "--path", frames)
        given(light(path=POSITIONS[:1]), "2 to", "--path", frames)
        given(light(path=POSITIONS, closed=1), "closed must be", "--path", frames)
        given(self.path("missing.json"), "missing.json")
        broken = self.path("broken.json")
        with open(broken, "w") as out:
            out.write('{"light": [1,\n 2}')
        given(broken, "broken.json: line 2, column")
        with open(broken, "w", encoding="utf-16") as out:
            json.dump(light(positions=POSITIONS), out)
        given(broken, "UTF-16")
        with open(broken, "w", encoding="utf-8-sig") as out:  # a mark is passed over: the fault is another one
            json.dump(light(0, positions=POSITIONS), out)
        given(broken, "dark")
        given(light(positions=POSITIONS), "--memory allows", more=("--memory", "20K"))

        def usage(words, *arguments):
            self.refused(2, words, "precompute", self.box, "-o", self.path("none.h5"), *arguments)
        usage("exclude each other", "--positions", self.file, "--path", self.file, *frames)
        usage("give --frames N", "--path", self.file)
        usage("--frames", "--frames", 3)
        usage("leave out --method exact", "--positions", self.file, "--method", "exact")
        usage("--positions and --sky exclude each other", "--positions", self.file, "--sky", "tregenza")
        usage("--reuse", "--positions", self.file, "--reuse", "F")


if __name__ == "__main__":
    unittest.main()
