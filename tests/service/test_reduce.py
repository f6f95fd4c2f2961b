"""`reduce`: figures of groups in place of vectors, against numpy over what the store answers in double; and that means
and sums, which are products with adjoint rows, are the same figures."""

import json
import pathlib
import tempfile
import threading
import unittest

import numpy as np

from command import must
from daemon import Daemon
from make_store import Scene
from yard import Truth, write_yard

QUANTITIES = "radiosity", "irradiance", "indirect"
FIGURES = "mean", "sum", "min", "max", "uniformity", "variance"
# As in test_daemon_answers: of the largest value. A mean or sum by an adjoint row has the same number of roundings.
TOLERANCE = 1e-5


def figures_of(x, area, members):
    """All figures of x [..., n] over members, [...] each."""
    A, x = area[members], np.asarray(x)[..., members]
    mean = (x @ A) / A.sum()
    with np.errstate(invalid="ignore"):
        uniformity = x.min(-1) / mean
    return {"mean": mean, "sum": x @ A, "min": x.min(-1), "max": x.max(-1), "uniformity": uniformity,
            "variance": ((x - mean[..., None]) ** 2) @ A / A.sum()}


class Reduce(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-reduce-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        cls.scenes = {
            "grey": Scene(60, seed=1).write(path / "grey.h5", "grey", sky=6),
            "exact": Scene(40, seed=2).write(path / "exact.h5", "exact", kind="exact", error=False),
            "colour": Scene(50, channels=3, seed=4).write(path / "colour.h5", "colour"),
            "exact3": Scene(20, channels=3, seed=5).write(path / "exact3.h5", "exact3", kind="exact", sky=5),
            "many": Scene(200, seed=6, groups=[f"g{k}" for k in range(100)]).write(path / "many.h5", "many"),
        }
        cls.daemon = Daemon("--stores", path, "--max-batch", 40)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def ask(self, name, body, **more):
        answer = self.daemon.radiosity(name, body, **more)
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def check(self, name, body, E, L=None, quantity="radiosity", groups=("lamp", "box", "wall"), figures=FIGURES):
        """E is [C][n] or [b][C][n]; a figure has that shape without n, and without C where that is 1."""
        scene = self.scenes[name]
        body = dict(body, quantity=quantity, reduce={"groups": list(groups), "with": list(figures)})
        answer = self.ask(name, body)
        self.assertNotIn(quantity, answer)
        self.assertEqual((answer["scene"], answer["elements"], answer["channels"], answer["quantity"]),
                         (name, scene.n, scene.channels, quantity))
        self.assertEqual(list(answer["groups"]), list(groups))
        x = scene.solve(E, quantity, L)
        largest = max(np.abs(x).max(), 1e-30)
        for group in groups:
            members = scene.members(group)
            wanted = figures_of(x, scene.area, members)
            self.assertEqual(list(answer["groups"][group]), list(figures))
            for figure in figures:
                given, truth = np.array(answer["groups"][group][figure], float), wanted[figure]
                if scene.channels == 1:
                    truth = truth[..., 0]
                self.assertEqual(given.shape, truth.shape)
                # A sum is A times a mean; a variance moves with twice the deviation, at most the largest value, and
                # that is twice TOLERANCE off; a ratio by both its sides.
                slack = TOLERANCE * {"sum": largest * scene.area[members].sum(), "variance": 4 * largest**2,
                                     "uniformity": 2 * largest / max(np.abs(wanted["mean"]).min(), 1e-30)
                                     }.get(figure, largest)
                self.assertLessEqual(np.abs(given - truth).max(), slack, (name, body, group, figure))
        return answer

    def each_form(self, scene, rng):
        """(emission, E) of every form but skies."""
        C, n = scene.channels, scene.n
        E = rng.random((C, n)).round(6)
        yield E.tolist(), E
        E = np.zeros((C, n))
        colours = rng.random((3, C)).round(6)
        E[:, [3, 0, n - 1]] = colours.T
        yield {"elements": [3, 0, n - 1], "values": colours.tolist()}, E
        E = np.zeros((C, n))
        E[:, scene.members("lamp")] = 12.5
        E[:, scene.members("box")] = colours[0][:, None]
        yield {"groups": {"lamp": 12.5, "box": colours[0].tolist()}}, E
        yield {"groups": {}}, np.zeros((C, n))
        yield {"elements": [], "values": []}, np.zeros((C, n))

    def test_all_figures(self):
        for name, scene in self.scenes.items():
            if name == "many":
                continue
            for quantity in QUANTITIES:
                for emission, E in list(self.each_form(scene, np.random.default_rng(3)))[:3]:
                    self.check(name, {"emission": emission}, E, quantity=quantity)

    def test_names_that_begin_so(self):
        """A star means all groups whose names begin so, wherever groups are named."""
        scene, wanted = self.scenes["many"], [f"g{k}" for k in (1, *range(10, 20))]
        members = np.sort(np.concatenate([scene.members(name) for name in wanted]))
        E = np.zeros((1, scene.n))
        E[:, members] = 3
        x = scene.solve(E, "radiosity", None)[0]
        answer = self.ask("many", {"emission": {"groups": {"g1*": 3}}, "reduce": {"groups": ["g1*", "*"], "with": ["mean", "sum"]}})
        for name, of in ("g1*", members), ("*", np.arange(scene.n)):
            told = figures_of(x, scene.area, of)
            for figure in "mean", "sum":
                self.assertAlmostEqual(answer["groups"][name][figure], told[figure], delta=TOLERANCE * abs(told["sum"]))
        chosen = self.ask("many", {"emission": E[0].tolist(), "select": {"groups": ["g1*"]}})
        self.assertEqual(len(chosen["radiosity"]), len(members))
        none = self.daemon.radiosity("many", {"emission": {"groups": {"h*": 1}}})
        self.assertEqual(none.status, 422)

    def test_linear_figures(self):
        """Twice: by a row that is made, by the row that was kept; the same bits."""
        for name, scene in self.scenes.items():
            if name == "many":
                continue
            for quantity in QUANTITIES:
                for emission, E in self.each_form(scene, np.random.default_rng(4)):
                    for figures in ["mean"], ["sum"], ["sum", "mean"]:
                        kept = [self.check(name, {"emission": emission}, E, quantity=quantity, figures=figures)["groups"]
                                for _ in range(2)]
                        self.assertEqual(*kept)

    def test_skies(self):
        for name in "grey", "exact3":
            scene = self.scenes[name]
            m, C = {"grey": 6, "exact3": 5}[name], scene.channels
            L = np.random.default_rng(5).random((C, m)).round(6)
            lamp = np.zeros((C, scene.n))
            lamp[:, scene.members("lamp")] = 3
            for quantity in QUANTITIES:
                for figures in FIGURES, ["mean", "sum"]:
                    for emission, E in (({"sky": L.T.tolist()}, 0 * lamp),
                                        ({"sky": L.T.tolist(), "groups": {"lamp": 3}}, lamp)):
                        self.check(name, {"emission": emission}, E, L, quantity, figures=figures)

    def test_batches(self):
        for name in "grey", "colour", "exact3":
            scene = self.scenes[name]
            forms = [form for seed in range(5) for form in self.each_form(scene, np.random.default_rng(seed))]
            sparse = [form for form in forms if isinstance(form[0], dict)]
            for chosen in forms, sparse, sparse[:1]:
                E = np.array([e for _, e in chosen])
                for figures in FIGURES[:4], ["sum"]:
                    self.check(name, {"emissions": [emission for emission, _ in chosen]}, E, figures=figures)
        scene = self.scenes["grey"]
        skies = np.random.default_rng(6).random((20, 1, 6)).round(6)
        skies[[0, 3, 19]] = 0
        lamp = np.zeros((20, 1, 60))
        lamp[:, 0, scene.members("lamp")] = np.arange(20)[:, None]
        emissions = [dict({"groups": {"lamp": k}}, **({"sky": L[0].tolist()} if L.any() else {})) for k, L in enumerate(skies)]
        for figures in FIGURES[:4], ["mean"]:
            self.check("grey", {"emissions": emissions}, lamp, skies, "irradiance", figures=figures)

    def test_both_ways_are_one(self):
        """A mean beside a minimum is reduced from its vector, alone it is a product."""
        for name, scene in self.scenes.items():
            emission = {"elements": [1, 2], "values": [1, 2]}
            group = scene.group_names[0]
            mean = [self.ask(name, {"emission": emission, "reduce": {"groups": [group], "with": figures}})["groups"][group]["mean"]
                    for figures in (["mean"], ["mean", "min"])]
            np.testing.assert_allclose(*mean, rtol=TOLERANCE)

    def test_more_groups_than_rows(self):
        scene = self.scenes["many"]
        E = np.zeros((1, 200))
        E[0, 17] = 2
        names = scene.group_names
        for count in 64, 65, 100:
            self.check("many", {"emission": {"elements": [17], "values": [2]}}, E, groups=names[:count],
                       figures=["mean", "sum"])

    def test_no_value(self):
        """Nothing shines: no uniformity."""
        groups = self.ask("grey", {"emission": {"groups": {}}, "reduce": {"groups": ["wall"], "with": list(FIGURES)}})["groups"]
        self.assertEqual(groups, {"wall": dict.fromkeys(FIGURES, 0) | {"uniformity": None}})

    def test_names(self):
        """Names that mean the same elements, or share some; names of escapes; one order of answer: as asked."""
        emission = {"emission": {"elements": [5], "values": [1]}}
        for figures in ["mean"], ["mean", "max"]:
            body = dict(emission, reduce={"groups": ["box.red", "box", "box.blue"], "with": figures})
            groups = self.ask("grey", body)["groups"]
            self.assertEqual(list(groups), ["box.red", "box", "box.blue"])
            scene, E = self.scenes["grey"], np.zeros((1, 60))
            E[0, 5] = 1
            x = scene.solve(E)[0]
            for name, given in groups.items():
                self.assertAlmostEqual(given["mean"], figures_of(x, scene.area, scene.members(name))["mean"],
                                       delta=TOLERANCE * x.max())
        text = json.dumps(dict(emission, reduce={"groups": ["wall"], "with": ["mean"]})).replace("wall", "w\\u0061ll")
        self.assertIn("wall", self.ask("grey", text)["groups"])

    def test_bits_from_many_threads(self):
        """New rows asked for by all at once: whoever makes them, the answer is one."""
        scene = Scene(500, seed=9)
        scene.write(self.folder / "threads.h5", "threads")
        bodies = [{"emission": {"elements": [k], "values": [1]}, "quantity": quantity,
                   "reduce": {"groups": [group], "with": ["mean"]}}
                  for quantity in QUANTITIES for group in scene.group_names for k in (0, 1)]
        with Daemon(self.folder / "threads.h5", "--threads", 4, "--max-inflight", 100) as daemon:
            found = [[] for _ in range(8)]

            def client(mine):
                for body in bodies:
                    mine.append(daemon.radiosity("threads", body).json()["groups"])

            threads = [threading.Thread(target=client, args=(mine,)) for mine in found]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            for mine in found:
                self.assertEqual(mine, found[0])

    def test_reload_forgets(self):
        """Rows belong to the store that made them."""
        path = self.folder / "again.h5"
        body = {"emission": {"elements": [1], "values": [1]}, "reduce": {"groups": ["wall"], "with": ["mean"]}}
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "again.h5"
            Scene(30, seed=1).write(path, "again")
            with Daemon(path) as daemon:
                before = [daemon.radiosity("again", body).json()["groups"] for _ in range(2)]
                self.assertEqual(*before)
                other = Scene(30, seed=2).write(pathlib.Path(folder) / "other.h5", "again")
                (pathlib.Path(folder) / "other.h5").rename(path)
                daemon.signal(1)
                daemon.wait_for("again", 2)
                E = np.zeros((1, 30))
                E[0, 1] = 1
                wanted = figures_of(other.solve(E)[0], other.area, other.members("wall"))["mean"]
                for _ in range(2000):  # until the new store is served
                    given = daemon.radiosity("again", body).json()["groups"]["wall"]["mean"]
                    if given != before[0]["wall"]["mean"]:
                        break
                self.assertAlmostEqual(given, wanted, delta=TOLERANCE)

    def test_small_ones_wait_for_nobody(self):
        """While the one place of the queue is taken, a mean by a row that is there is answered all the same."""
        scene = Scene(3000, rank=40, seed=11)
        scene.write(self.folder / "queue.h5", "queue")
        mean = {"emission": {"groups": {"lamp": 1}}, "reduce": {"groups": ["wall"], "with": ["mean"]}}
        plain = {"emission": {"groups": {"lamp": 1}}, "select": {"elements": [1]}}
        long = json.dumps({"emissions": [{"groups": {"lamp": 1, "wall": 2}}] * 400})
        with Daemon(self.folder / "queue.h5", "--threads", 1, "--max-inflight", 1) as daemon:
            known = daemon.radiosity("queue", mean)
            self.assertEqual(known.status, 200, known)
            done = threading.Event()

            def load():
                while not done.is_set():
                    daemon.radiosity("queue", long)

            thread = threading.Thread(target=load)
            thread.start()
            try:
                seen = 0
                for _ in range(5000):
                    before = daemon.radiosity("queue", plain).status
                    between = daemon.radiosity("queue", mean)
                    after = daemon.radiosity("queue", plain).status
                    self.assertEqual(between.status, 200, between)
                    self.assertEqual(between.json()["groups"], known.json()["groups"])
                    seen += before == after == 503
                    if seen == 5:
                        break
                self.assertEqual(seen, 5)
            finally:
                done.set()
                thread.join()

    def test_areas_that_cannot_be(self):
        """A store whose areas are damaged is refused by name, the others are served."""
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            for name, value in ("nan", np.nan), ("negative", -1.0), ("endless", np.inf):
                scene = Scene(10, seed=1)
                scene.area[7] = value
                scene.write(folder / (name + ".h5"), name)
            Scene(10, seed=1).write(folder / "whole.h5", "whole")
            with Daemon("--stores", folder) as daemon:
                self.assertEqual([s["name"] for s in daemon.get("/v1/scenes").json()["scenes"]], ["whole"])
                for name in "nan", "negative", "endless":
                    self.assertRegex(daemon.output() + daemon.errors(), name + r"\.h5: /mesh/area\[7\] = .*, must be at least 0")

    def refuse(self, reduce, status, *words, pointer=None, emission=None, name="grey", accept=None, **more):
        body = dict({"emission": emission or {"groups": {"lamp": 1}}, "reduce": reduce}, **more)
        answer = self.daemon.radiosity(name, body, accept=accept)
        self.assertEqual(answer.status, status, (answer, reduce))
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        what = answer.json()
        for word in words:
            self.assertIn(word, what["detail"])
        if pointer is not None:
            self.assertEqual(what.get("pointer"), pointer)

    def test_refusals(self):
        good = {"groups": ["lamp"], "with": ["mean"]}
        for value in 3, None, [], "lamp", True:
            self.refuse(value, 422, "object", pointer="/reduce")
        self.refuse({}, 422, "with, and groups or sensors", pointer="/reduce")
        self.refuse({"groups": ["lamp"]}, 422, "with, and groups or sensors", pointer="/reduce")
        self.refuse({"with": ["mean"]}, 422, "with, and groups or sensors", pointer="/reduce")
        self.refuse(dict(good, elements=[1]), 422, "elements", pointer="/reduce/elements")
        self.refuse(dict(good, groups=[]), 422, "empty", pointer="/reduce/groups")
        self.refuse(dict(good, groups="lamp"), 422, "array", pointer="/reduce/groups")
        self.refuse(dict(good, groups=["lamp", "moon"]), 422, "moon", pointer="/reduce/groups/1")
        self.refuse(dict(good, groups=["lamp", "wall", "lamp"]), 422, "lamp", "twice", pointer="/reduce/groups/2")
        self.refuse(dict(good, groups=["lamp", 3]), 422, "name", pointer="/reduce/groups/1")
        self.refuse(dict(good, groups=["lamp\0"]), 422, "no group", pointer="/reduce/groups/0")
        self.refuse({"groups": ["lamp"], "with": []}, 422, "empty", pointer="/reduce/with")
        self.refuse({"groups": ["lamp"], "with": "mean"}, 422, "array", pointer="/reduce/with")
        self.refuse({"groups": ["lamp"], "with": ["mean", "median"]}, 422, "median", "uniformity", pointer="/reduce/with/1")
        self.refuse({"groups": ["lamp"], "with": ["mean", "mean"]}, 422, "before", pointer="/reduce/with/1")
        self.refuse({"groups": ["lamp"], "with": [0]}, 422, "name", pointer="/reduce/with/0")
        for select in {"elements": [1]}, {"groups": ["lamp"]}:
            self.refuse(good, 422, "both select and reduce", select=select)
        for figures in ["mean"], ["max"]:
            self.refuse(dict(good, **{"with": figures}), 422, "JSON", accept="application/x-npy")
            self.refuse(dict(good, **{"with": figures}), 422, "a number", emission={"elements": [1], "values": ["-1"]},
                        pointer="/emission/values/0")
            self.refuse(dict(good, **{"with": figures}), 422, "moon", emission={"groups": {"moon": 1}})
        self.refuse({"groups": ["lamp"], "with": ["max"]}, 422, "single precision", emission=[3e38] * 60)
        answer = self.daemon.radiosity("grey", '{"reduce":{"groups":["lamp"],"with":["mean"]},"emission":[NaN]}')
        self.assertEqual(answer.status, 400)
        # A second member of one name, and a fault in the grammar behind one in the meaning.
        for text, status in (('{"reduce":{"groups":["lamp"],"groups":["wall"],"with":["mean"]},"emission":{"groups":{}}}', 422),
                             ('{"reduce":{"groups":["moon"],"with":["mean"]},"emission":{"groups":{}}', 400)):
            self.assertEqual(self.daemon.radiosity("grey", text).status, status)

    def test_large_values(self):
        """Beyond single precision is no limit for a product in double."""
        body = {"emission": {"groups": {"lamp": 3e38, "wall": 3e38}}, "reduce": {"groups": ["lamp"], "with": ["sum"]}}
        self.assertGreater(self.ask("grey", body)["groups"]["lamp"]["sum"], 3e38)


class KindsThatAreMade(unittest.TestCase):
    """Two meshes, sparse, few emitters: figures against numpy over the vectors that the daemon itself answers, and of
    emitters against a dense solution in double."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-reduce-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        (cls.folder / "some.json").write_text(json.dumps({"emissions": [
            {"groups": {"lamp": [1, 2, 3]}, "sky": [[1, .5, .2]] + [0] * 11},
            {"elements": [3, 8, 40], "values": [1, 4, [0, 2, 1]]}, {"groups": {"east": 2}}]}))
        cls.truth = {}
        for name, floor, options in (
            ("two_mesh", "0.7 0.4 0.2", ["--method", "2msc"]),
            ("sparse", "0.5 0.5 0.5", ["--method", "sparse"]),
            ("hierarchical", "0.7 0.4 0.2", ["--method", "hierarchical"]),
            ("lights", "0.7 0.4 0.2", ["--emitters", "group=lamp,south"]),
            ("tiles", "0.5 0.5 0.5", ["--emitters", "sky"]),
            ("mixed", "0.7 0.4 0.2", ["--emitters", cls.folder / "some.json"]),
        ):
            must("precompute", write_yard(cls.folder, floor), "-o", cls.folder / (name + ".h5"), "--elements", 150, "--rays", 256, "--probes", 4,
                 "--keep-form-factors", "--sky", "grid:4x3", *options)
            cls.truth[name] = Truth(cls.folder / (name + ".h5"))
        cls.daemon = Daemon(*(f"{cls.folder / name}.h5:{name}" for name in cls.truth))
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def emissions(self, name):
        truth = self.truth[name]
        rng = np.random.default_rng(8)
        sky = rng.random((12, truth.C)).round(4).tolist()
        if name == "tiles":
            return [{"sky": sky}, {"emitters": sky}, {"sky": [1] + [0] * 11}]
        if name == "mixed":  # of the sky and groups, of an element, of one channel
            return [{"groups": {"east": [0, 0, 5]}}, {"groups": {"east": 2, "lamp": [2, 4, 6]}, "sky": [[2, 1, .4]] + [0] * 11},
                    {"emitters": [[1, 2, 3], 4, 5]}, {"elements": [3, 8, 40], "values": [2, 8, [0, 4, 2]]}]
        both = {"groups": {"lamp": rng.random(truth.C).round(4).tolist(), "south": 2}}
        if name == "lights":
            return [both, {"emitters": [[1, 2, 3], 4]}]
        return [both, dict(both, sky=sky), {"elements": [3, 8], "values": [1, 2]},
                rng.random((truth.C, truth.n)).round(4).tolist()]

    def test_figures(self):
        for name, truth in self.truth.items():
            for emission in self.emissions(name):
                for quantity in QUANTITIES:
                    body = {"emission": emission, "quantity": quantity}
                    answer = self.daemon.radiosity(name, body)
                    self.assertEqual(answer.status, 200, answer)
                    x = np.array(answer.json()[quantity], float).reshape(truth.C, truth.n)
                    for figures in FIGURES, ["mean", "sum"], ["mean", "sum"]:
                        body["reduce"] = {"groups": ["floor", "east"], "with": list(figures)}
                        answer = self.daemon.radiosity(name, body)
                        self.assertEqual(answer.status, 200, answer)
                        for group, given in answer.json()["groups"].items():
                            members = np.flatnonzero(truth.group == truth.groups.index(group))
                            wanted = figures_of(x, truth.area, members)
                            for figure in figures:
                                slack = 2e-5 * np.abs(x).max()
                                if figure == "sum":
                                    slack *= truth.area[members].sum()
                                elif figure == "variance":
                                    slack *= np.abs(x).max()
                                found = np.array(given[figure], float).reshape(-1)
                                if figure == "uniformity":  # of a mean of 0 there is none
                                    zero = wanted["mean"] == 0
                                    self.assertTrue(np.isnan(found[zero]).all())
                                    found, wanted[figure] = found[~zero], wanted[figure][~zero]
                                    slack = 1e-5
                                self.assertLessEqual(np.abs(found - wanted[figure]).max(initial=0), slack,
                                                     (name, emission, quantity, group, figure))

    def test_emitters_against_the_truth(self):
        """The mean of the floor under both lights, from a solution in double of the form factors."""
        truth = self.truth["lights"]
        E = np.zeros((3, truth.n))
        E[:, truth.group == truth.groups.index("lamp")] = [[1], [2], [3]]
        E[:, truth.group == truth.groups.index("south")] = 4
        floor = np.flatnonzero(truth.group == truth.groups.index("floor"))
        for quantity in QUANTITIES:
            wanted = figures_of(truth.solve(E, np.zeros((3, 12)), quantity), truth.area, floor)["mean"]
            for emission in {"emitters": [[1, 2, 3], 4]}, {"groups": {"lamp": [1, 2, 3], "south": 4}}:
                answer = self.daemon.radiosity("lights", {"emission": emission, "quantity": quantity,
                                                          "reduce": {"groups": ["floor"], "with": ["mean"]}})
                np.testing.assert_allclose(answer.json()["groups"]["floor"]["mean"], wanted, rtol=2e-5)

    def test_batches_of_emitters(self):
        """Vectors that groups, tiles or weights tell beside each other, and beside one that only its elements tell."""
        truth, told = self.truth["mixed"], self.emissions("mixed")
        for emissions in (told[:1] + told[2:3]) * 10, told[:3], told:
            for quantity in QUANTITIES:
                body = {"emissions": emissions, "quantity": quantity}
                x = np.array(self.daemon.radiosity("mixed", body).json()[quantity])
                floor = np.flatnonzero(truth.group == truth.groups.index("floor"))
                for _ in range(2):
                    body["reduce"] = {"groups": ["floor"], "with": ["mean"]}
                    answer = self.daemon.radiosity("mixed", body)
                    self.assertEqual(answer.status, 200, answer)
                    np.testing.assert_allclose(answer.json()["groups"]["floor"]["mean"],
                                               figures_of(x, truth.area, floor)["mean"], atol=2e-5 * np.abs(x).max())

    def test_what_emitters_do_not_send(self):
        for emission, word in (({"groups": {"floor": 1}}, "do not"), ({"elements": [0], "values": [1]}, "do not"),
                               ({"sky": [1] * 12}, "--emitters sky")):
            for _ in range(2):
                answer = self.daemon.radiosity("lights", {"emission": emission,
                                                          "reduce": {"groups": ["floor"], "with": ["mean"]}})
                self.assertEqual(answer.status, 422, answer)
                self.assertIn(word, answer.json()["detail"])


if __name__ == "__main__":
    unittest.main()
