"""Black box: sensors of stores of few emitters. Their values are held against sums in double of what h5py reads, over the radiosities
that the same store answers, and against a store of all emissions with the same form factors and rows."""

import io
import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from daemon import Daemon
from exr_file import decode_exr
from make_store import add_checksums
from test_few_luminaires import LIST, SPOT
from yard import Truth, write_yard

# Sums in single precision of numbers whose last bits differ; emitters are converged to 1e-6 in the norm over the scene.
SAME = 2e-6
# A gradient is a sum over all elements, in single precision.
CLOSE = 1e-5
SENSORS = {"points": [{"name": "room.a", "at": [[.6, .6, .8], [2, 2, .8], [3, 1, .5]], "normal": [0, 0, 1]},
                      {"name": "room.b", "at": [[1, 3, 1.5], [3.5, 3.5, .3], [2, 1.5, 1]], "normal": [0, .6, .8]}],
           "cylinders": [{"name": "faces", "at": [[2, 3, 1.2], [1, 1, 1.7]]}],
           "eyes": [{"name": "eye", "at": [[2, 1, 1.2]], "view": [0, 1, 0]}],
           "probes": [{"name": "game", "at": [[2, 2, 1], [3, 3, 1]]}]}
SETS = ["room.a", "room.b", "faces", "eye"]
POSITIONS = {"light": {"polygon": [[-.1, -.1, 0], [.1, -.1, 0], [.1, .1, 0], [-.1, .1, 0]], "emission": 4},
             "positions": [{"name": "door", "move": [1, 1, 1]}, {"move": [2, 1, 1]}]}
L = (np.arange(12) / 4).tolist()
# The emitters of each store, and lights that it answers: those of a store of all emissions beside the weights that mean the same.
LIGHTS = {
    "sky": [({"sky": L}, {"emitters": L + [0] * 3}), ({"luminaires": {"row": [1, .5, 2]}}, {"emitters": [0] * 12 + [[1, .5, 2]] * 2 + [0]}),
            ({"sky": L, "luminaires": {"desk": 2}}, {"emitters": {f"tile {k}": x for k, x in enumerate(L)}, "luminaires": {"desk": 2}})],
    "group=lamp": [({"groups": {"lamp": 3}}, {"emitters": {"lamp": 3}}),
                   ({"groups": {"lamp": [1, 2, 3]}, "luminaires": {"desk": .5}}, {"emitters": {"lamp": [1, 2, 3], "desk": .5}})],
    "luminaires": [({"luminaires": {"row.1": 1, "desk": .25}}, {"emitters": [0, 1, .25]})],
    "mixed": [({"groups": {"lamp": 2}, "sky": [1] * 12}, {"emitters": {"both": 2}}),
              ({"groups": {"lamp": 2}, "sky": [1] * 12, "luminaires": {"desk": 1}}, {"emitters": {"both": 2}, "luminaires": {"desk": 1}})]}


class FewSensors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-few-sensors-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        (path / "spot.ies").write_text(SPOT)
        (path / "list.json").write_text(json.dumps(LIST))
        (path / "s.json").write_text(json.dumps(SENSORS))
        (path / "one.json").write_text(json.dumps({"points": [{"name": "one", "at": [2, 2, 1], "normal": [0, 0, 1]}]}))
        (path / "pos.json").write_text(json.dumps(POSITIONS))
        # One emitter that is of elements and of the sky.
        (path / "both.json").write_text(json.dumps({"emissions": [{"groups": {"lamp": 1}, "sky": [.5] * 12}]}))
        write_yard(path)
        cls.made = (path / "yard.obj", "--elements", 120, "--rays", 1024, "--sky", "grid:4x3", "--luminaires", path / "list.json",
                    "--lights", "lm", "--keep-form-factors", "--sensors", path / "s.json")
        must("precompute", *cls.made, "--method", "exact", "--probes", 0, "-o", path / "all.h5")
        cls.stores = {"all": path / "all.h5"}
        for name in LIGHTS:
            cls.stores[name] = path / (name.replace("=", "-") + ".h5")
            must("precompute", path / "all.h5", "-o", cls.stores[name], "--emitters", path / "both.json" if name == "mixed" else name,
                 "--probes", 8, "--keep-form-factors")
        with h5py.File(cls.stores["mixed"], "r") as f:
            cls.both = f["operator/names"][0].decode()
        cls.truth = Truth(path / "all.h5")
        cls.weights, cls.sets = cls.read(path / "all.h5")
        cls.daemon = Daemon(*cls.stores.values())
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    @staticmethod
    def read(path):
        """Rows of elements, of tiles and of luminaires by channel, [..][receivers], and the receivers of each set."""
        with h5py.File(path) as f:
            s = f["sensors"]
            rows = np.zeros((len(s["indptr"]) - 1, len(f["mesh/area"])))
            for i in range(len(rows)):
                at = slice(int(s["indptr"][i]), int(s["indptr"][i + 1]))
                rows[i, s["indices"][at]] = s["weights"][at]
            colour = f["luminaires/colour"][()].T
            first = s["first"][()].astype(int)
            sets = {name.decode(): np.arange(first[k], first[k + 1]) for k, name in enumerate(s["names"][()])}
            return (rows.T, s["sky"][()].astype(float), colour[:, :, None] * s["luminaires"][()].astype(float)), sets

    @staticmethod
    def dimmers(emission):
        """[C][luminaires]"""
        D = np.zeros((3, 3))
        for name, value in emission.get("luminaires", {}).items():
            for k, own in enumerate(("row.0", "row.1", "desk")):
                if own == name or own.startswith(name + "."):
                    D[:, k] = value
        return D

    def values(self, B, emission):
        """[C][receivers] of radiosities and the light that is beside them."""
        rows, sky, luminaires = self.weights
        D = self.dimmers(emission)
        of_sky = np.array(emission.get("sky", [0] * 12)) @ sky
        return np.reshape(B, (3, -1)) @ rows + of_sky + np.einsum("ck,cks->cs", D, luminaires)

    def receivers(self, names):
        return np.concatenate([self.sets[name] for name in names])

    def post(self, name, body, to="radiosity", accept="application/json"):
        return self.daemon.ask("POST", f"/v1/scenes/{self.stores[name].stem}/{to}", json.dumps(body),
                               {"Content-Type": "application/json", "Accept": accept})

    def ask(self, name, body, to="radiosity"):
        answer = self.post(name, body, to)
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def lights(self):
        """(store, light, the same by weights) of all."""
        for name, lights in LIGHTS.items():
            for light, weights in lights:
                weights = json.loads(json.dumps(weights).replace('"both"', json.dumps(self.both)))
                yield name, light, weights

    def close(self, got, wanted, what, tolerance=SAME):
        wanted = np.asarray(wanted, float)
        self.assertLessEqual(np.abs(np.reshape(got, wanted.shape) - wanted).max(), tolerance * np.abs(wanted).max(), what)

    def test_values(self):
        for name, light, weights in self.lights():
            for limit in False, True:
                given = [light, weights] if name != "mixed" else [weights]
                for emission in given:
                    B = self.ask(name, {"emission": emission, "limit": limit})["radiosity"]
                    wanted = self.values(B, light)[:, self.receivers(SETS)]
                    body = {"emission": emission, "limit": limit, "select": {"sensors": SETS}}
                    got = self.ask(name, body)
                    self.assertEqual((got["quantity"], got["at"], got["unit"]), ("irradiance", "sensors", "lx"))
                    self.close(got["irradiance"], wanted, (name, emission))
                    array = self.post(name, body, accept="application/x-npy")
                    self.close(np.load(io.BytesIO(array.body)), wanted, (name, emission))
                    figures = self.ask(name, {"emission": emission, "limit": limit, "reduce": {"sensors": SETS, "with": ["mean", "max"]}})
                    for key in SETS:
                        part = self.values(B, light)[:, self.sets[key]]
                        self.close(figures["sensors"][key]["mean"], part.mean(1), (name, emission, key))
                        self.close(figures["sensors"][key]["max"], part.max(1), (name, emission, key))
                    probes = self.ask(name, {"emission": emission, "limit": limit, "select": {"probes": ["game"]}})
                    wanted = self.values(B, light)[:, self.sets["game"]] / np.pi
                    scale = np.asarray(probes["radiance"], float).reshape(3, -1) / wanted
                    self.close(scale, np.full_like(scale, scale[0, 0]), (name, "probes"), 1e-3)

    def test_they_are_those_of_all_emissions(self):
        """The form factors and the rows are the same, so that the method alone differs."""
        for name, light, weights in self.lights():
            every = self.ask("all", {"emission": light, "limit": False, "select": {"sensors": SETS}})["irradiance"]
            few = self.ask(name, {"emission": weights, "limit": False, "select": {"sensors": SETS}})["irradiance"]
            self.close(few, np.reshape(every, (3, -1)), (name, light), 2 * SAME)

    def test_batches_have_the_same_bits(self):
        for name in LIGHTS:
            emissions = [weights for of, _, weights in self.lights() if of == name]
            if name != "mixed":
                emissions += [light for of, light, _ in self.lights() if of == name]
            emissions = (emissions * 20)[:19]
            for more in {"select": {"sensors": SETS}}, {"reduce": {"sensors": SETS, "with": ["mean", "min", "share"], "at_least": [1]}}, \
                    {"select": {"probes": ["game"]}}:
                many = self.ask(name, {"emissions": emissions, **more})
                for k, emission in enumerate(emissions[:6]):
                    alone = self.ask(name, {"emission": emission, **more})
                    if "select" in more:
                        self.assertEqual(alone[alone["quantity"]], many[many["quantity"]][k], (name, k))
                        continue
                    for key in SETS:
                        self.assertEqual(alone["sensors"][key]["mean"], many["sensors"][key]["mean"][k], (name, k))
                        self.assertEqual(alone["sensors"][key]["min"], many["sensors"][key]["min"][k], (name, k))

    def test_derivatives_and_gradients(self):
        """Each column is the answer to its emitter alone, and the gradient the sum of columns."""
        g = np.random.default_rng(3).integers(-8, 8, (3, len(self.receivers(SETS)))) / 8
        for name in LIGHTS:
            got = self.ask(name, {"of": {"sensors": SETS}}, "jacobian")
            self.assertEqual(list(got["jacobian"]), ["luminaires", "emitters"])
            with h5py.File(self.stores[name]) as f:
                names = [n.decode() for n in f["operator/names"][()]]
            self.assertEqual(got["columns"], {"luminaires": names[-3:], "emitters": names})
            J = np.array(got["jacobian"]["emitters"])
            self.assertEqual(J[:, :, -3:].tolist(), got["jacobian"]["luminaires"])
            for k, emitter in enumerate(names):
                one = self.ask(name, {"emission": {"emitters": {emitter: 1}}, "limit": False, "select": {"sensors": SETS}})["irradiance"]
                self.close(J[:, :, k], np.reshape(one, (3, -1)), (name, emitter), SAME)
            array = self.post(name, {"of": {"sensors": SETS}, "by": ["emitters"]}, "jacobian", "application/x-npy")
            np.testing.assert_array_equal(np.load(io.BytesIO(array.body)), np.float32(J))
            ends = np.cumsum([len(self.sets[key]) for key in SETS])[:-1]
            each = {key: {"values": part.tolist()} for key, part in zip(SETS, np.split(g, ends, axis=1))}
            found = self.ask(name, {"cotangent": {"sensors": each}}, "adjoint")
            self.assertEqual((found["quantity"], found["at"]), ("irradiance", "sensors"))
            wanted, size = np.einsum("cs,csk->ck", g, J), np.einsum("cs,csk->ck", np.abs(g), np.abs(J)).max()
            self.assertLessEqual(np.abs(np.array(found["gradient"]["emitters"]) - wanted).max(), CLOSE * size, name)
            self.assertEqual(np.array(found["gradient"]["emitters"])[:, -3:].tolist(), found["gradient"]["luminaires"])
            for kind, words in (("groups", "has derivatives by emitters and luminaires only"), ("sky", "has derivatives by emitters")):
                refused = self.post(name, {"of": {"sensors": SETS}, "by": [kind]}, "jacobian")
                self.assertEqual(refused.status, 422)
                self.assertIn(words, refused.json()["detail"])
        refused = self.post("all", {"of": {"sensors": SETS}, "by": ["emitters"]}, "jacobian")
        self.assertEqual((refused.status, refused.json()["detail"]), (422, "by/0: the store has no precomputed emitters"))

    def test_what_emitters_do_not_send_is_refused(self):
        for more in {"select": {"sensors": SETS}}, {"reduce": {"sensors": SETS, "with": ["mean"]}}:
            answer = self.post("sky", {"emission": {"groups": {"lamp": 1}}, **more})
            self.assertEqual(answer.status, 422, answer)
            self.assertIn("emitters do not", answer.json()["detail"])

    def test_refined_answers(self):
        """By their certificates, against a dense solution in double; the slack is that of test_tolerance.py."""
        t = self.truth
        for name, light, weights in self.lights():
            E = np.zeros((3, t.n))
            E[:, t.group == t.groups.index("lamp")] = np.reshape(light.get("groups", {}).get("lamp", 0), (-1, 1))
            D = np.float32(self.dimmers(light)).astype(float)
            with h5py.File(self.stores["all"]) as f:
                H0 = (D * f["luminaires/colour"][()].T) @ f["luminaires/irradiance"][()].astype(float)
            B = t.solve(E + t.rho * H0, np.broadcast_to(light.get("sky", [0] * 12), (3, 12)), "radiosity")
            wanted = self.values(B, light)[:, self.receivers(SETS)]
            answer = self.ask(name, {"emission": weights, "tolerance": 1e-9, "select": {"sensors": SETS}})
            worst = np.abs(np.reshape(answer["irradiance"], wanted.shape) - wanted).max()
            self.assertLessEqual(worst, answer["certificate"] + 1e-13 * wanted.max(), (name, weights))
            self.assertLess(answer["certificate"], 1e-6 * wanted.max())

    def test_stated_errors(self):
        """The same of a light and of its weights, by HTTP, by columns and at the command line, up to the ways of adding up."""
        for name, light, weights in self.lights():
            if name == "mixed":
                continue
            stated = []
            for emission in light, weights:
                answer = self.ask(name, {"emission": emission, "select": {"sensors": ["room.a"]}, "limit": False})["error"]
                self.assertEqual((answer["light"], list(answer["sensors"])), ("own", ["room.a"]))
                stated.append(answer["stated"])
            self.assertAlmostEqual(stated[0] / stated[1], 1, delta=1e-4, msg=(name, light))
            by_column = self.ask(name, {"emission": weights, "reduce": {"sensors": ["room.a"], "with": ["mean"]}, "limit": False})["error"]
            # Errors of columns have one sign at worst; they may lie below those of all light together by what laws of sizes give away.
            self.assertTrue(.3 < by_column["stated"] / stated[0] < 3, (name, by_column, stated))
            path = self.folder / "e.json"
            path.write_text(json.dumps({"emissions": [weights]}))
            told = json.loads(must("solve", self.stores[name], "--emission", path, "--sensors", "room.a", "--linear", "--json").stdout)
            self.assertAlmostEqual(told["error"] / stated[0], 1, delta=1e-3, msg=(name, weights))

    def test_solve(self):
        out, path = self.folder / "o.npy", self.folder / "e.json"
        for name, light, weights in self.lights():
            path.write_text(json.dumps({"emissions": [weights]}))
            must("solve", self.stores[name], "--emission", path, "--sensors", ",".join(SETS), "--linear", "-o", out)
            got = self.ask(name, {"emission": weights, "select": {"sensors": SETS}, "limit": False})["irradiance"]
            self.close(np.load(out), np.reshape(got, (3, -1)), (name, weights))
        # A rating of glare takes dimmers and, of a sky, all light.
        for options in ("--dim", "desk=1"), ("--dim", "row=1", "--sky", "overcast"):
            few, every = (json.loads(must("solve", self.stores[name], *options, "--sensors", "eye", "--json").stdout)["sensors"][0]
                          for name in ("sky", "all"))
            self.assertEqual(set(few) - {"error"}, set(every) - {"error"})
            self.assertIn("ugr", json.dumps(every))

    def test_the_sun_itself(self):
        """Direct light is the sun's own as in a store of all emissions; what is reflected of it is that of its tile after the first
        reflection."""
        out = self.folder / "o.npy"
        (self.folder / "day.wea").write_text(
            "place x\nlatitude 47\nlongitude -8\ntime_zone -15\nsite_elevation 400\nweather_data_file_units 1\n" +
            "".join(f"6 21 {hour}.5 {800 if 5 < hour < 19 else 0} {100 if 4 < hour < 20 else 0}\n" for hour in range(24)))
        for how in ("--sun", "exact"), ("--annual", "autonomy=3000", "--annual", "sum"), ("--sun", "exact", "--annual", "sum"):
            made = []
            for name in "all", "sky":
                must("solve", self.stores[name], "--weather", self.folder / "day.wea", "--photometric", "--sensors", ",".join(SETS), *how,
                     "-o", out)
                made.append(np.load(out).astype(float))
            # Without --sun exact years of both have the reflected sun of its tile: they are one light.
            tolerance = 1e-5 if "--annual" in how and "--sun" not in how else .01
            self.close(made[1], made[0], how, tolerance)

    def test_texels(self):
        for name, light, option in (("group=lamp", "lamp=3", "--emit"), ("sky", "desk=1", "--dim"), ("sky", "overcast", "--sky")):
            made = []
            for store in name, "all":
                path = self.folder / f"{store}.exr"
                must("solve", self.stores[store], option, light, "--at", "texels", "--texel", .5, "-o", path)
                made.append(np.stack([values for _, values in sorted(decode_exr(path)[0].items())]).astype(float))
            # Of an .exr in half precision.
            self.close(made[0], made[1], (name, light), 2 ** -10)

    def test_precompute(self):
        """From a scene, from a store, and in place of other sensors, the rows are the same; the answers of elements stay."""
        direct, other = self.folder / "direct.h5", self.folder / "other.h5"
        must("precompute", *self.made, "--emitters", "sky", "--probes", 0, "-o", direct)
        must("precompute", direct, "--sensors", self.folder / "one.json", "-o", other)
        with h5py.File(direct) as made, h5py.File(self.stores["sky"]) as of_store, h5py.File(other) as f:
            for array in "weights", "indices", "sky", "luminaires":
                np.testing.assert_array_equal(made["sensors"][array][()], of_store["sensors"][array][()])
            np.testing.assert_array_equal(f["operator/B"][()], made["operator/B"][()])
            np.testing.assert_array_equal(f["luminaires/irradiance"][()], made["luminaires/irradiance"][()])
            self.assertEqual([n.decode() for n in f["sensors/names"][()]], ["one"])
        must("precompute", other, "--sensors", self.folder / "s.json", "-o", self.folder / "again.h5")
        with h5py.File(direct) as made, h5py.File(self.folder / "again.h5") as again:
            np.testing.assert_array_equal(made["sensors/weights"][()], again["sensors/weights"][()])
            np.testing.assert_array_equal(made["sensors/luminaires"][()], again["sensors/luminaires"][()])

    def test_verify(self):
        for name in LIGHTS:
            self.assertRegex(must("verify", self.stores[name]).stdout, r"ok +sensors +27 in 5 sets, the rows of 9 of them were found again")

    def failed(self, words, *command):
        result = lambert(*command)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn(words, result.stderr)
        self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)

    def test_positions_are_refused(self):
        """A store that has sensors beside positions, which no program makes, is answered but at them."""
        out = ("-o", self.folder / "no.h5")
        for more in ("--sensors", self.folder / "s.json"), ("--probes-grid", 1):
            self.failed(f"{more[0]} and --positions exclude each other", "precompute", self.folder / "yard.obj", "--positions",
                        self.folder / "pos.json", *more, *out)
        path = self.folder / "positions.h5"
        must("precompute", self.folder / "yard.obj", "--elements", 120, "--positions", self.folder / "pos.json", "--paths", 64, "-o", path)
        self.failed("is of positions of a light", "precompute", path, "--sensors", self.folder / "s.json", *out)
        self.assertFalse((self.folder / "no.h5").exists())
        with h5py.File(self.stores["sky"]) as f, h5py.File(path, "r+") as to:
            f.copy("sensors", to)
            for array in "sky", "sky_off", "luminaires", "eyes", "seen":
                if array in to["sensors"]:
                    del to["sensors"][array]
            n = len(to["mesh/area"])
            to["sensors/indices"][...] = to["sensors/indices"][()] % n
            add_checksums(to)
        words = "the store is of positions of a light, whose direct light is known on elements alone"
        self.failed("sensors have no values: " + words, "solve", path, "--emit", "door=1", "--sensors", "all", "--json")
        self.failed("texels have no values: " + words, "solve", path, "--emit", "door=1", "--at", "texels", "-o", self.folder / "no.exr")
        with Daemon(path) as daemon:
            for to, body in (("radiosity", {"emission": {"emitters": {"door": 1}}, "select": {"sensors": ["room"]}}),
                             ("radiosity", {"emission": {"emitters": {"door": 1}}, "reduce": {"sensors": ["room"], "with": ["mean"]}}),
                             ("adjoint", {"cotangent": {"sensors": {"room": 1}}}), ("jacobian", {"of": {"sensors": ["room"]}})):
                answer = daemon.ask("POST", f"/v1/scenes/positions/{to}", json.dumps(body), {"Content-Type": "application/json"})
                self.assertEqual(answer.status, 422)
                self.assertIn("sensors have no values: " + words, answer.json()["detail"])


if __name__ == "__main__":
    unittest.main()
