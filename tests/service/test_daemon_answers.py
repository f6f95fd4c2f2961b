"""lambertd answers what the store holds: every form of emission, selection, quantity and encoding."""

import io
import json
import pathlib
import tempfile
import unittest

import numpy as np

from daemon import Daemon, npy
from make_store import Scene

# Factors are stored in single precision (6e-8 each) and at most 60 terms of one sign are summed in it: 4e-6 of
# the largest value.
TOLERANCE = 1e-5


def stated(relative, indirect, **more):
    """The error of a store without figures by group, whose operator has all of it."""
    coarse = {"coarse": True, "advice": "precompute with --epsilon"} if indirect > .1 else {}
    return {"stated": indirect, "parts": {"operator": indirect, "form_factors": 0}, "relative_mean": relative, "indirect_mean": indirect,
            "light": "lights", **coarse, **more}


class Answers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        cls.grey = Scene(60, seed=1).write(path / "grey.h5", "grey", sky=6)
        cls.exact = Scene(40, seed=2).write(path / "exact.h5", "exact", kind="exact", error=False)
        cls.plain = Scene(30, seed=3).write(path / "plain.h5", "plain", with_order=False, sky=3)
        cls.colour = Scene(50, channels=3, seed=4).write(path / "colour.h5", "colour")
        cls.exact3 = Scene(20, channels=3, seed=5).write(path / "exact3.h5", "exact3", kind="exact", sky=5)
        desks = Scene(60, seed=6)
        cls.desks = desks.write(path / "desks.h5", "desks", receivers=[*desks.members("floor"), *desks.members("lamp")[:-1]])
        lamps = Scene(60, seed=7)
        cls.lamps = lamps.write(path / "lamps.h5", "lamps", sky=4, sources=[*lamps.members("lamp"), *lamps.members("wall")[1:]])
        cls.both = lamps.write(path / "both.h5", "both", receivers=lamps.members("floor"), sources=lamps.members("lamp"))
        cls.spaced = Scene(10, groups=("a~b/c", "größe", "x")).write(path / "two words?ä.h5", "spaced")
        cls.scenes = {name: getattr(cls, name) for name in ("grey", "exact", "plain", "colour", "exact3")}
        cls.daemon = Daemon("--stores", path, "--max-batch", 40)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def solve(self, name, body, **more):
        answer = self.daemon.radiosity(name, body, **more)
        self.assertEqual(answer.status, 200, answer)
        return answer

    def check(self, name, body, E, quantity="radiosity", take=None, L=None, **more):
        """E is [C][n], or [b][C][n], L likewise [C][m]; the answer has no axis for one channel."""
        scene = self.scenes[name]
        answer = self.solve(name, body, **more).json()
        self.assertEqual(answer["scene"], name)
        self.assertEqual(answer["elements"], scene.n)
        self.assertEqual(answer["channels"], scene.channels)
        self.assertEqual(answer["quantity"], quantity)
        wanted = scene.solve(E, quantity, L)
        if take is not None:
            wanted = wanted[..., take]
        if scene.channels == 1:
            wanted = wanted[..., 0, :]
        given = np.array(answer[quantity], float)
        self.assertEqual(given.shape, wanted.shape)
        largest = max(np.abs(wanted).max(initial=0), 1e-30)
        self.assertLessEqual(np.abs(given - wanted).max(initial=0), TOLERANCE * largest)
        return answer

    def test_dense(self):
        for name, scene in self.scenes.items():
            E = np.random.default_rng(7).random(scene.n).round(6)
            all_alike = np.tile(E, (scene.channels, 1))
            self.check(name, {"emission": E.tolist()}, all_alike)
            rows = np.random.default_rng(8).random((scene.channels, scene.n)).round(6)
            self.check(name, {"emission": rows.tolist()}, rows)

    def test_dense_without_light(self):
        self.check("grey", {"emission": [0] * 60}, np.zeros((1, 60)))

    def test_quantities(self):
        for name, scene in self.scenes.items():
            E = np.random.default_rng(9).random((scene.channels, scene.n))
            for quantity in "radiosity", "irradiance", "indirect":
                answer = self.check(name, {"emission": E.tolist(), "quantity": quantity}, E, quantity)
                self.assertNotIn("radiosity" if quantity != "radiosity" else "irradiance", answer)

    def test_sparse(self):
        for name, scene in self.scenes.items():
            E = np.zeros((scene.channels, scene.n))
            E[:, 3], E[:, 0], E[:, scene.n - 1] = 2.5, 1, 4
            body = {"elements": [3, 0, scene.n - 1], "values": [2.5, 1, 4]}
            self.check(name, {"emission": body}, E)
            colours = [[0.5, 1, 2][: scene.channels], 3, [1, 0, 7][: scene.channels]]
            E[:, 3], E[:, 0], E[:, scene.n - 1] = colours
            body = {"values": colours, "elements": [3, 0, scene.n - 1]}
            self.check(name, {"emission": body}, E)
        self.check("grey", {"emission": {"elements": [], "values": []}}, np.zeros((1, 60)))
        self.check("grey", {"emission": {"elements": [1e1, 2.0], "values": [1, 1]}}, np.isin(np.arange(60), (10, 2))[None])

    def test_groups(self):
        for name, scene in self.scenes.items():
            E = np.zeros((scene.channels, scene.n))
            E[:, scene.members("lamp")] = 12.5
            E[:, scene.members("box.red")] = 1
            self.check(name, {"emission": {"groups": {"lamp": 12.5, "box.red": 1}}}, E)
        E = np.zeros((3, 50))
        E[:, self.colour.members("lamp")] = [[1], [2], [3]]
        self.check("colour", {"emission": {"groups": {"lamp": [1, 2, 3]}}}, E)
        self.check("grey", {"emission": {"groups": {}}}, np.zeros((1, 60)))

    def test_an_object_is_all_of_its_groups(self):
        E = np.zeros((1, 60))
        E[:, self.grey.members("box.red")] = 2
        E[:, self.grey.members("box.blue")] = 2
        self.check("grey", {"emission": {"groups": {"box": 2}}}, E)
        self.check("grey", {"emission": {"groups": {"box": 2}}, "select": {"groups": ["box"]}}, E,
                   take=self.grey.members("box"))

    def test_names_with_escapes(self):
        path = "/v1/scenes/two%20words%3F%C3%A4"
        about = self.daemon.get(path)
        self.assertEqual(about.status, 200, about)
        self.assertEqual(about.json()["name"], "two words?ä")
        body = '{"emission": {"groups": {"a~b\\/c": 1, "gr\\u00f6\\u00dfe": 2}}}'
        answer = self.daemon.post(path + "/radiosity", body)
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(answer.json()["scene"], "two words?ä")
        again = self.daemon.post(path + "/radiosity", {"emission": {"groups": {"größe": 2, "a~b/c": 1}}})
        self.assertEqual(again.json()["radiosity"], answer.json()["radiosity"])

    def test_select_keeps_the_order_asked(self):
        for name, scene in self.scenes.items():
            E = np.random.default_rng(10).random((scene.channels, scene.n))
            take = [scene.n - 1, 0, 5, 3, 5]
            self.check(name, {"select": {"elements": take}, "emission": E.tolist()}, E, take=take)
            take = np.concatenate([scene.members("wall"), scene.members("floor")])
            for quantity in "irradiance", "indirect":
                self.check(name, {"emission": E.tolist(), "select": {"groups": ["wall", "floor"]}, "quantity": quantity},
                           E, quantity, take)
        self.check("grey", {"emission": [1] * 60, "select": {"elements": []}}, np.ones((1, 60)), take=[])

    def test_batches(self):
        for name, scene in self.scenes.items():
            rng = np.random.default_rng(11)
            # More than one pass, and not a multiple of one.
            E = np.zeros((37, scene.channels, scene.n))
            forms = []
            for i in range(37):
                if i % 3 == 0:
                    E[i] = rng.random((scene.channels, scene.n))
                    forms.append(E[i].tolist())
                elif i % 3 == 1:
                    E[i][:, i % scene.n] = i
                    forms.append({"elements": [i % scene.n], "values": [i]})
                else:
                    E[i][:, scene.members("lamp")] = i
                    forms.append({"groups": {"lamp": i}})
            self.check(name, {"emissions": forms}, E)
            self.check(name, {"emissions": forms[:1]}, E[:1])
            self.check(name, {"emissions": forms, "select": {"elements": [2, 1]}, "quantity": "indirect"}, E, "indirect",
                       [2, 1])

    def test_a_vector_has_the_same_bits_in_any_batch(self):
        E = np.random.default_rng(12).random((40, 60)).astype(np.float32)
        batch = self.solve("grey", {"emissions": E.tolist()}).json()["radiosity"]
        for i in 0, 15, 16, 39:
            self.assertEqual(self.solve("grey", {"emission": E[i].tolist()}).json()["radiosity"], batch[i])

    def test_error_and_times(self):
        answer = self.solve("grey", {"emission": [1] * 60}).json()
        self.assertEqual(answer["error"], stated(0.125, 0.25))
        self.assertEqual(sorted(answer["time_ms"]), ["encode", "parse", "solve"])
        for value in answer["time_ms"].values():
            self.assertGreaterEqual(value, 0)
        self.assertEqual(self.solve("exact", {"emission": [1] * 40}).json()["error"],
                         {"stated": None, "advice": "precompute without --probes 0 measures it"})

    def test_times_stand_in_a_header_of_every_type(self):
        ask = {"emission": [1] * 60}
        for body in ask, {**ask, "reduce": {"groups": ["lamp"], "with": ["mean"]}}, {**ask, "reduce": {"groups": ["lamp"], "with": ["max"]}}:
            answer = self.solve("grey", body)
            said = ", ".join(f"{part};dur={answer.json()['time_ms'][part]:.3f}" for part in ("parse", "solve", "encode"))
            self.assertEqual(answer.headers["Server-Timing"], said)
        for route, body in ("radiosity", ask), ("adjoint", {"cotangent": [1] * 60, "gradient": ["emission"]}):
            for accept in "application/json", "application/x-npy", "application/x-npy; dtype=f2":
                answer = self.daemon.ask("POST", f"/v1/scenes/grey/{route}", json.dumps(body),
                                         {"Content-Type": "application/json", "Accept": accept})
                self.assertEqual(answer.status, 200)
                self.assertRegex(answer.headers["Server-Timing"],
                                 r"^parse;dur=\d+\.\d{3}, solve;dur=\d+\.\d{3}, encode;dur=\d+\.\d{3}$")
        self.assertIsNone(self.daemon.radiosity("grey", {"emission": [1]}).headers["Server-Timing"])
        self.assertIsNone(self.daemon.get("/v1/scenes").headers["Server-Timing"])

    RECEIVERS = stated(0.03125, 0.0625, of="receivers")
    ALL = stated(0.125, 0.25, of="all")

    def test_answers_of_receivers_alone_have_their_error(self):
        floor, lamp, wall = (self.desks.members(name).tolist() for name in ("floor", "lamp", "wall"))
        for select, error in (
            ({"elements": floor[:3]}, self.RECEIVERS),
            ({"elements": [lamp[0], *floor]}, self.RECEIVERS),
            ({"elements": [*floor, wall[0]]}, self.ALL),
            ({"elements": [wall[0], *floor]}, self.ALL),
            ({"elements": lamp[-1:]}, self.ALL),
            ({"groups": ["floor"]}, self.RECEIVERS),
            ({"groups": ["floor", "lamp"]}, self.ALL),
            (None, self.ALL),
        ):
            body = {"emission": [1] * 60, **({"select": select} if select else {})}
            self.assertEqual(self.solve("desks", body).json()["error"], error, select)
        # The second answer of a linear reduction is that of the thread which reads requests.
        for names, error in (["floor"], self.RECEIVERS), (["lamp"], self.ALL), (["floor", "wall"], self.ALL):
            for figures in ["mean"], ["max"], ["mean", "uniformity"]:
                body = {"emission": {"groups": {"lamp": 1}}, "reduce": {"groups": names, "with": figures}}
                for _ in range(2):
                    self.assertEqual(self.solve("desks", body).json()["error"], error, (names, figures))
        body = json.dumps({"cotangent": {"groups": {"floor": 1}}, "gradient": ["emission"]})
        answer = self.daemon.post("/v1/scenes/desks/adjoint", body)
        self.assertEqual(answer.status, 200)
        self.assertNotIn("error", answer.json())

    def test_a_scene_states_the_errors_of_receivers_by_name(self):
        about = self.daemon.get("/v1/scenes/desks").json()
        members = len(self.desks.members("floor")) + len(self.desks.members("lamp")) - 1
        self.assertEqual(about["importance"], {"option": "--receivers some", "elements": members})
        for light in "single", "lights":
            self.assertEqual(about["error"][light]["receivers_indirect"], 0.0625)
            self.assertEqual(about["error"][light]["total_indirect_mean"], 0.25)
        self.assertIsNone(self.daemon.get("/v1/scenes/grey").json()["importance"])

    SOURCES = stated(0.125, 0.25, **{"from": "sources"})
    OTHERS = {"stated": None, "advice": "precompute with --sources that name all that emits, or without", "from": "others"}

    def test_answers_to_sources_alone_have_an_error(self):
        floor, lamp, wall = (self.lamps.members(name).tolist() for name in ("floor", "lamp", "wall"))
        dense, other, colourless = np.zeros(60), np.zeros(60), np.zeros((1, 60))
        dense[lamp], dense[wall[1]], colourless[0, wall[2]] = 2, 1, 3
        other[wall[0]] = 1e-9
        for light, error in (
            ({"elements": lamp[:2], "values": [1, 2]}, self.SOURCES),
            ({"elements": [lamp[0], floor[0]], "values": [1, 2]}, self.OTHERS),
            ({"elements": [lamp[0], floor[0]], "values": [1, 0]}, self.SOURCES),
            ({"elements": [wall[0]], "values": [1]}, self.OTHERS),
            ({"elements": [wall[1]], "values": [1]}, self.SOURCES),
            ({"groups": {"lamp": 17}}, self.SOURCES),
            ({"groups": {"lamp": 17, "floor": 0}}, self.SOURCES),
            ({"groups": {"lamp": 17, "floor": 1}}, self.OTHERS),
            ({"groups": {"wall": 1}}, self.OTHERS),
            (dense.tolist(), self.SOURCES),
            (colourless.tolist(), self.SOURCES),
            (other.tolist(), self.OTHERS),
            ([1] * 60, self.OTHERS),
            ([0] * 60, self.SOURCES),
            ({"groups": {"lamp": 1}, "sky": [0, 0, 0, 0]}, self.SOURCES),
            ({"groups": {"lamp": 1}, "sky": [0, 1, 0, 0]}, self.OTHERS),
        ):
            for more in {}, {"select": {"groups": ["floor"]}}, {"reduce": {"groups": ["floor"], "with": ["mean"]}}, \
                    {"reduce": {"groups": ["floor"], "with": ["mean", "max"]}}:
                for _ in range(2 if "reduce" in more else 1):
                    answer = self.solve("lamps", {"emission": light, **more}).json()
                    self.assertEqual(answer["error"], error, (light, more))
        # One strange vector of a batch is enough, whichever it is.
        for batch, error in ([{"groups": {"lamp": 1}}, {"groups": {"lamp": 2}}], self.SOURCES), \
                ([{"groups": {"lamp": 1}}, {"groups": {"floor": 2}}], self.OTHERS), \
                ([dense.tolist(), other.tolist()], self.OTHERS), ([other.tolist(), {"groups": {"lamp": 1}}], self.OTHERS):
            self.assertEqual(self.solve("lamps", {"emissions": batch}).json()["error"], error)

    def test_receivers_and_sources_together(self):
        for light, select, error in (
            ("lamp", "floor", {**self.RECEIVERS, "from": "sources"}), ("lamp", "wall", {**self.ALL, "from": "sources"}),
            ("wall", "floor", self.OTHERS), ("wall", "wall", self.OTHERS),
        ):
            body = {"emission": {"groups": {light: 1}}, "select": {"groups": [select]}}
            self.assertEqual(self.solve("both", body).json()["error"], error, (light, select))

    def test_a_scene_names_its_sources(self):
        members = len(self.lamps.members("lamp")) + len(self.lamps.members("wall")) - 1
        about = self.daemon.get("/v1/scenes/lamps").json()
        self.assertEqual(about["sources"], {"option": "--sources some", "elements": members})
        self.assertIsNone(about["importance"])
        self.assertIsNone(self.daemon.get("/v1/scenes/grey").json()["sources"])

    def load(self, answer, dtype):
        self.assertEqual(answer.headers["Content-Type"], "application/x-npy")
        array = np.load(io.BytesIO(answer.body))
        self.assertEqual(array.dtype, np.dtype(dtype))
        return array

    def test_npy_in(self):
        rng = np.random.default_rng(13)
        for name, scene in self.scenes.items():
            C, n = scene.channels, scene.n
            one = rng.random(n)
            rows = rng.random((C, n))
            batch = rng.random((3, C, n))
            for dtype in "<f4", "<f8":
                kind = "application/x-npy"
                self.check(name, npy(one.astype(dtype)), np.tile(one, (C, 1)), kind=kind)
                self.check(name, npy(batch.astype(dtype)), batch, kind=kind)
                if C > 1:
                    self.check(name, npy(rows.astype(dtype)), rows, kind=kind)
                else:
                    self.check(name, npy(batch[:, 0].astype(dtype)), batch, kind=kind)

    def test_npy_versions(self):
        E = np.arange(60, dtype="<f4")
        for version in (1, 0), (2, 0), (3, 0):
            out = io.BytesIO()
            np.lib.format.write_array(out, E, version)
            self.check("grey", out.getvalue(), E[None], kind="application/x-npy")

    def test_npy_out_equals_json(self):
        for name, scene in self.scenes.items():
            C, n = scene.channels, scene.n
            E = np.random.default_rng(14).random((2, C, n)).astype(np.float32)
            for body, shape in (
                ({"emissions": E.tolist()}, (2, C, n)),
                ({"emission": E[0].tolist()}, (C, n)),
                ({"emissions": E.tolist(), "select": {"elements": [4, 1, 2]}}, (2, C, 3)),
            ):
                shape = tuple(s for axis, s in enumerate(shape) if not (C == 1 and axis == len(shape) - 2))
                said = np.array(self.solve(name, body).json()["radiosity"])
                answer = self.solve(name, body, accept="application/x-npy")
                array = self.load(answer, "<f4")
                self.assertEqual(array.shape, shape)
                # The JSON text reads back as the same single precision numbers.
                np.testing.assert_array_equal(array, said.astype(np.float32))
                wide = self.load(self.solve(name, body, accept="application/x-npy; dtype=f8"), "<f8")
                np.testing.assert_array_equal(wide, array.astype(float))
                half = self.load(self.solve(name, body, accept="application/x-npy;dtype=f2"), "<f2")
                np.testing.assert_array_equal(half, array.astype(np.float16))

    def test_npy_both_ways(self):
        E = np.random.default_rng(15).random(60).astype("<f4")
        answer = self.solve("grey", npy(E), kind="application/x-npy", accept="application/x-npy")
        array = self.load(answer, "<f4")
        wanted = self.grey.solve(E[None])[0]
        self.assertLessEqual(np.abs(array - wanted).max(), TOLERANCE * wanted.max())

    def test_accept(self):
        body = {"emission": [1] * 60}
        json_type, npy_type = "application/json", "application/x-npy"
        for accept, wanted in (
            (None, json_type),
            ("*/*", json_type),
            ("application/*", json_type),
            ("text/html", json_type),
            ("application/x-npy;q=0", json_type),
            ("application/json, application/x-npy", json_type),
            ("application/x-npy, application/json", npy_type),
            ("application/x-npy;q=0.5, application/json;q=0.4", npy_type),
            ("application/x-npy;q=0.4, application/json;q=0.5", json_type),
            ("application/x-npy, */*;q=0.1", npy_type),
            ("APPLICATION/X-NPY; DTYPE=F4", npy_type),
            ("application/x-npy; dtype=i4", json_type),
            (",;=,\"", json_type),
        ):
            answer = self.solve("grey", body, accept=accept)
            self.assertEqual(answer.headers["Content-Type"], wanted, accept)

    def test_content_type(self):
        for kind in "application/json", "application/json; charset=utf-8", "Application/JSON":
            self.solve("grey", {"emission": [1] * 60}, kind=kind)

    def test_scenes(self):
        listed = {s["name"]: s for s in self.daemon.get("/v1/scenes").json()["scenes"]}
        self.assertEqual(set(listed), set(self.scenes) | {"two words?ä", "desks", "lamps", "both"})
        self.assertEqual(list(listed), sorted(listed, key=lambda name: name.encode()))
        self.assertEqual(listed["exact3"],
                         {"name": "exact3", "elements": 20, "channels": 3, "kind": "exact",
                          "bytes": 3 * 20 * 20 * 4 + 20 * 4})

    def test_scene(self):
        about = self.daemon.get("/v1/scenes/colour").json()
        for member in ("name elements channels kind method reason epsilon rank bytes groups emitters sky error "
                       "provenance").split():
            self.assertIn(member, about)
        self.assertEqual(about["rank"], 5)
        self.assertEqual(about["epsilon"], 0.05)
        self.assertEqual(about["groups"], [{"name": name, "elements": int((self.colour.group == g).sum())}
                                           for g, name in enumerate(self.colour.group_names)])
        self.assertEqual(about["error"]["single"]["total_indirect_mean"], 0.25)
        self.assertEqual(about["error"]["single"]["probes"], 3)
        self.assertEqual(about["provenance"]["seed"], 1)
        self.assertEqual(about["provenance"]["tool"], "make_store.py")
        self.assertIsNone(about["sky"])
        self.assertIsNone(about["emitters"])
        exact = self.daemon.get("/v1/scenes/exact").json()
        self.assertEqual(exact["density"], 1)
        self.assertEqual(exact["error"], {})

    SKIES = {"grey": 6, "plain": 3, "exact3": 5}

    def test_scene_with_a_sky(self):
        for name, tiles in self.SKIES.items():
            self.assertEqual(self.daemon.get(f"/v1/scenes/{name}").json()["sky"],
                             {"tiling": f"grid:{tiles}x1", "tiles": tiles, "ground_albedo": 0})

    def test_sky(self):
        rng = np.random.default_rng(3)
        for name, m in self.SKIES.items():
            scene = self.scenes[name]
            n, C = scene.n, scene.channels
            grey = rng.random(m).round(6)
            colours = rng.random((m, C)).round(6)
            all_alike, none = np.tile(grey, (C, 1)), np.zeros((C, n))
            lamp = none.copy()
            lamp[:, scene.members("lamp")] = 2
            single = none.copy()
            single[:, 3] = 7
            for quantity in "radiosity", "irradiance", "indirect":
                more = {"quantity": quantity}
                self.check(name, {"emission": {"sky": grey.tolist()}, **more}, none, quantity, L=all_alike)
                self.check(name, {"emission": {"sky": colours.tolist()}, **more}, none, quantity, L=colours.T)
                self.check(name, {"emission": {"sky": grey.tolist(), "groups": {"lamp": 2}}, **more}, lamp, quantity,
                           L=all_alike)
                self.check(name, {"emission": {"elements": [3], "sky": colours.tolist(), "values": [7]}, **more},
                           single, quantity, L=colours.T)
            # Black elements receive too.
            answer = self.check(name, {"emission": {"sky": grey.tolist()}, "quantity": "irradiance",
                                       "select": {"elements": [0, 7, 14]}}, none, "irradiance", take=[0, 7, 14],
                                L=all_alike)
            self.assertGreater(np.min(answer["irradiance"]), 0)
            # A batch of which some are under a sky: none of them takes the sky of another.
            skies = rng.random((40, C, m)).round(6)
            skies[[0, 1, 7, 8, 20, 38, 39]] = 0
            emissions = [{"sky": L.T.tolist(), "groups": {"lamp": 2}} if L.any() else {"groups": {"lamp": 2}}
                         for L in skies]
            emissions[20] = lamp.tolist()
            for quantity in "radiosity", "irradiance":
                self.check(name, {"emissions": emissions, "quantity": quantity}, np.tile(lamp, (40, 1, 1)), quantity,
                           L=skies)

    def test_coloured_skies_over_one_channel(self):
        rng = np.random.default_rng(4)
        scene, m = self.grey, self.SKIES["grey"]
        colours = rng.random((m, 3)).round(6)
        luminance = (colours @ [.265, .670, .065])[None]
        none = np.zeros((1, scene.n))
        for select in {}, {"select": {"elements": [0, 7]}}:
            answer = self.check("grey", {"emission": {"sky": colours.tolist()}, **select}, none, "radiosity", L=luminance,
                                **({"take": [0, 7]} if select else {}))
            self.assertEqual(answer["sky"], "luminance")
        reduced = self.daemon.radiosity("grey", {"emission": {"sky": colours.tolist()},
                                                 "reduce": {"groups": ["lamp"], "with": ["mean"]}}).json()
        self.assertEqual(reduced["sky"], "luminance")
        mixed = [1.5, *colours[1:].tolist()]  # a number stays a number
        self.check("grey", {"emission": {"sky": mixed}}, none, "radiosity", L=np.array([[1.5, *luminance[0, 1:]]]))
        # Neither a grey sky nor three equal numbers need a word, nor does a store of three channels.
        for name, sky in (("grey", [1] * m), ("grey", [[2, 2, 2]] * m), ("exact3", [[1, 2, 3]] * self.SKIES["exact3"])):
            self.assertNotIn("sky", self.daemon.radiosity(name, {"emission": {"sky": sky}}).json())
        # Emissions of elements and groups have the channels of the store.
        for emission in {"groups": {"lamp": [1, 2, 3]}}, {"elements": [1], "values": [[1, 2, 3]]}:
            self.assertEqual(self.daemon.radiosity("grey", {"emission": emission}).status, 422)

    def test_health(self):
        for path in "/healthz", "/readyz":
            self.assertEqual(self.daemon.get(path).status, 200)
            head = self.daemon.ask("HEAD", path)
            self.assertEqual((head.status, head.body), (200, b""))

    def test_metrics(self):
        def count():
            lines = self.daemon.get("/metrics").body.decode().splitlines()
            return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in lines if not line.startswith("#")}

        before = count()
        self.solve("grey", {"emissions": [[1] * 60] * 20})
        self.assertEqual(self.daemon.radiosity("grey", "{").status, 400)
        after = count()
        route = "/v1/scenes/{name}/radiosity"
        for key, more in (
            (f'lambertd_requests_total{{route="{route}",status="200"}}', 1),
            (f'lambertd_requests_total{{route="{route}",status="400"}}', 1),
            (f'lambertd_request_duration_seconds_count{{route="{route}"}}', 2),
            ("lambertd_batch_size_sum", 20),
        ):
            self.assertEqual(after[key] - before.get(key, 0), more, key)
        self.assertEqual(after["lambertd_in_flight"], 1)  # the very request
        held = sum(s["bytes"] for s in self.daemon.get("/v1/scenes").json()["scenes"])
        self.assertGreater(after["lambertd_operator_bytes"], held / 2)


if __name__ == "__main__":
    unittest.main()
