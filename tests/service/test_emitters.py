"""Black box: stores of few emitters, judged by a dense solution in double of what h5py reads from them."""

import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from daemon import Daemon
from yard import Truth, write_yard

QUANTITIES = "radiosity", "irradiance", "indirect"
# Of a lamp and the sky together, of elements, and of a group in one colour only.
EMISSIONS = [{"groups": {"lamp": [1, 2, 3]}, "sky": [[1, .5, .2]] + [0] * 11},
             {"elements": [3, 8, 40], "values": [1, 4, [0, 2, 1]]},
             {"groups": {"east": 2}}]


class Emitters(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-emitters-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.scene = write_yard(cls.folder)
        (cls.folder / "some.json").write_text(json.dumps({"emissions": EMISSIONS}))
        cls.rng = np.random.default_rng(5)
        cls.stores, cls.truth = {}, {}
        for name, emitters in ("tiles", "sky"), ("groups", "group=lamp,south"), ("file", cls.folder / "some.json"):
            cls.stores[name] = cls.folder / (name + ".h5")
            must("precompute", cls.scene, "-o", cls.stores[name], "--elements", 150, "--rays", 1024, "--probes", 4,
                 "--keep-form-factors", "--sky", "grid:4x3", "--emitters", emitters)
            cls.truth[name] = Truth(cls.stores[name])

    def test_a_sky_alone_has_its_rays_alone(self):
        """Rays miss more of a tile than pairs would mend: these come where an error, or rows to keep, are asked for."""
        for options, pairs in ((), False), (("--epsilon", .05), True), (("--quality", "high"), True), (("--keep-form-factors",), True):
            said = must("precompute", self.scene, "-o", self.folder / "alone.h5", "--elements", 150, "--probes", 0, "--sky",
                        "grid:4x3", "--emitters", "sky", *options).stderr
            self.assertEqual("pair by pair" in said, pairs, (options, said))
            self.assertEqual("4096 rays per element:" in said, not pairs, (options, said))
        said = must("precompute", self.scene, "-o", self.folder / "alone.h5", "--elements", 150, "--probes", 0, "--sky",
                    "grid:4x3", "--emitters", "group=lamp").stderr
        self.assertIn("pair by pair", said)

    def close(self, got, wanted, what):
        np.testing.assert_allclose(got, wanted, atol=5e-6 * np.abs(wanted).max(), err_msg=str(what))

    def solve(self, name, *options, quantity="radiosity", shape=None):
        out = self.folder / "out.npy"
        must("solve", self.stores[name], *options, "--quantity", quantity, "-o", out)
        return np.load(out).reshape(shape or (3, -1))

    def dense(self, name, emission):
        """E [3][n] and L [3][12] of an emission."""
        truth = self.truth[name]
        E, L = np.zeros((3, truth.n)), np.zeros((3, 12))
        for group, value in emission.get("groups", {}).items():
            E[:, truth.group == truth.groups.index(group)] = np.broadcast_to(value, 3)[:, None]
        for element, value in zip(emission.get("elements", ()), emission.get("values", ())):
            E[:, element] = value
        for tile, value in enumerate(emission.get("sky", ())):
            L[:, tile] = value
        return E, L

    def refused(self, status, wanted, *arguments):
        done = lambert(*arguments)
        self.assertEqual(done.returncode, status, (arguments, done.stderr))
        said = [line for line in done.stderr.splitlines() if line.startswith("lambert") and "warning" not in line]
        self.assertEqual(len(said), 1, done.stderr)
        self.assertIn(wanted, done.stderr)

    def test_skies(self):
        skies = self.rng.random((40, 3, 12))
        np.save(self.folder / "skies.npy", skies)
        for quantity in QUANTITIES:
            found = self.solve("tiles", "--sky", self.folder / "skies.npy", quantity=quantity, shape=(40, 3, -1))
            for L, answer in zip(skies, found):
                self.close(answer, self.truth["tiles"].solve(np.zeros((3, self.truth["tiles"].n)), L, quantity), quantity)

    def test_groups(self):
        for quantity in QUANTITIES:
            found = self.solve("groups", "--emit", "lamp=5,3,1", "--emit", "south=2", quantity=quantity)
            E, L = self.dense("groups", {"groups": {"lamp": [5, 3, 1], "south": 2}})
            self.close(found, self.truth["groups"].solve(E, L, quantity), quantity)

    def test_weights(self):
        """Emitters of a file: weights add up, also in one channel, and whole emissions are told from what they send."""
        truth = self.truth["file"]
        weights = [[1, 2, 3], [4, 0, 1], 2]
        (self.folder / "w.json").write_text(json.dumps({"emissions": [{"emitters": weights}, {"emitters": [0, 0, 1]}]}))
        parts = [self.dense("file", emission) for emission in EMISSIONS]
        for quantity in QUANTITIES:
            found = self.solve("file", "--emission", self.folder / "w.json", quantity=quantity, shape=(2, 3, -1))
            wanted = sum(np.broadcast_to(w, 3)[:, None] * truth.solve(*part, quantity) for w, part in zip(weights, parts))
            self.close(found[0], wanted, quantity)
            self.close(found[1], truth.solve(*parts[2], quantity), quantity)
        np.save(self.folder / "E.npy", parts[1][0] * 3)
        self.close(self.solve("file", "--emission", self.folder / "E.npy"), 3 * truth.solve(*parts[1], "radiosity"), "E")

    def test_weights_beside_skies(self):
        """One set of weights goes with every sky of a batch, in the first pass and after it."""
        weights, skies = self.rng.random(12), self.rng.random((70, 3, 12))
        (self.folder / "w.json").write_text(json.dumps({"emitters": list(weights)}))
        np.save(self.folder / "skies.npy", skies)
        found = self.solve("tiles", "--emission", self.folder / "w.json", "--sky", self.folder / "skies.npy",
                           shape=(70, 3, -1))
        truth = self.truth["tiles"]
        for k in 0, 1, 63, 64, 69:
            self.close(found[k], truth.solve(np.zeros((3, truth.n)), skies[k] + weights, "radiosity"), k)

    def test_the_store(self):
        for name, truth in self.truth.items():
            with h5py.File(self.stores[name]) as file:
                operator = file["operator"]
                B, names = operator["B"][()], [text.decode() for text in operator["names"][()]]
                self.assertEqual(operator.attrs["kind"], b"emitters")
                self.assertLess(operator.attrs["residual"], 1e-6)
                self.assertGreater(operator.attrs["sweeps"], 2)
                self.assertEqual("L" in operator, name != "groups")
                ends = operator["E/indptr"][()]
                self.assertEqual(len(ends), 3 * len(names) + 1)
                self.assertEqual(ends[-1], len(operator["E/data"]))
            self.assertEqual(names[:2], {"tiles": ["tile 0", "tile 1"], "groups": ["lamp", "south"],
                                         "file": ["emitter 0", "emitter 1"]}[name])
            emissions = {"tiles": [{"sky": list(row)} for row in np.eye(12)],
                         "groups": [{"groups": {"lamp": 1}}, {"groups": {"south": 1}}], "file": EMISSIONS}[name]
            for k, emission in enumerate(emissions):
                E, L = self.dense(name, emission)
                wanted = truth.solve(E, L, "radiosity")
                black = truth.rho == 0  # there it is what it would be with a reflectance of 1
                self.close(B[:, k][~black], wanted[~black], (name, k))
                self.close(B[:, k][black], (E + truth.solve(E, L, "irradiance"))[black], (name, k))

    def test_what_it_says(self):
        about = json.loads(must("info", "--json", self.stores["groups"]).stdout)
        self.assertEqual((about["kind"], about["method"], about["emitters"]), ("emitters", "emitters", ["lamp", "south"]))
        self.assertIn("2 asked for by --emitters", about["reason"])
        self.assertLess(about["error"]["single"]["operator_relative_mean"], 1e-5)
        self.assertLess(about["error"]["lights"]["operator_relative_mean"], 1e-5)
        self.assertLess(about["error"]["random"]["energy_balance"], 1e-4)
        about = json.loads(must("info", "--json", self.stores["tiles"]).stdout)
        self.assertEqual(len(about["emitters"]), 12)
        self.assertNotIn("lights", about["error"])  # the lamp is none of the emitters
        self.assertLess(about["error"]["random"]["energy_balance"], 1e-4)
        for store in self.stores.values():
            said = must("verify", store).stdout
            self.assertIn("ok      operator      emitters", said)
            self.assertNotIn("broken", said.lower())
            self.assertIn("all emitters", said)
        must("render", self.stores["groups"], "--emit", "lamp=5", "--size", "80x60", "-o", self.folder / "lamp.png")

    def test_what_it_cannot_answer(self):
        at = self.folder / "w.json"
        self.refused(1, "which the store's 2 emitters do not", "solve", self.stores["groups"], "--emit", "floor=1")
        self.refused(1, "emits 5", "solve", self.stores["tiles"])  # its own lamp
        np.save(self.folder / "dusk.npy", np.ones(12))
        self.refused(1, "--emitters sky", "solve", self.stores["groups"], "--sky", self.folder / "dusk.npy")
        np.save(self.folder / "wrong.npy", self.rng.random((3, self.truth["groups"].n)))
        self.refused(1, "emits", "solve", self.stores["groups"], "--emission", self.folder / "wrong.npy")
        for weights, wanted in (([1], "must be 2"), ([1, -2], "-2"), ([1, [1, 2]], "must be 3"),
                                ("x", "an array of weights")):
            at.write_text(json.dumps({"emitters": weights}))
            self.refused(1, wanted, "solve", self.stores["groups"], "--emission", at)
        at.write_text(json.dumps({"emitters": [1, 2], "groups": {"lamp": 1}}))
        self.refused(1, "must hold either", "solve", self.stores["groups"], "--emission", at)

    def test_options(self):
        precompute = "precompute", self.scene, "-o", self.folder / "no.h5", "--rays", 64, "--probes", 0
        self.refused(1, "give --sky", *precompute, "--emitters", "sky")
        self.refused(1, 'no group "moon"', *precompute, "--emitters", "group=lamp,moon")
        self.refused(1, 'no group ""', *precompute, "--emitters", "group=")
        self.refused(1, "No such file", *precompute, "--emitters", self.folder / "none.json")
        self.refused(2, "give --emitters", *precompute, "--method", "emitters")
        (self.folder / "dark.json").write_text('{"emissions":[{"groups":{"lamp":1}},{"groups":{}}]}')
        self.refused(1, "emitter 1 sends nothing", *precompute, "--emitters", self.folder / "dark.json")
        self.assertFalse((self.folder / "no.h5").exists())
        said = must(*precompute, "--emitters", "group=lamp", "--method", "exact").stderr
        self.assertIn("exact does not use --emitters", said)
        said = must("precompute", self.stores["tiles"], "-o", self.folder / "again.h5", "--probes", 0, "--emitters",
                    "group=lamp", "--rank", 3, "--threshold", .1, "--store-precision", "f16").stderr
        for name in "--rank", "--threshold", "--store-precision":
            self.assertIn(name, said.split("emitters does not use")[1])

    def test_same_bits(self):
        kept = []
        for threads in 1, 3:
            must("precompute", self.stores["tiles"], "-o", self.folder / "t.h5", "--probes", 0, "--emitters", "sky",
                 threads=threads)
            with h5py.File(self.folder / "t.h5") as file:
                kept.append(file["operator/B"][()].tobytes())
        self.assertEqual(kept[0], kept[1])

    def test_the_daemon_serves_them(self):
        lamp, weights = {"groups": {"lamp": [5, 3, 1]}}, [[5, 3, 1], 0]
        wanted = self.solve("groups", "--emit", "lamp=5,3,1")
        truth = self.truth["tiles"]
        L = self.rng.random(12).round(3)
        with Daemon(self.stores["groups"].__str__() + ":groups", self.stores["tiles"].__str__() + ":tiles",
                    self.stores["file"].__str__() + ":file") as daemon:
            def ask(name, body):
                answer = daemon.post(f"/v1/scenes/{name}/radiosity", body)
                self.assertEqual(answer.status, 200, answer.body)
                return answer.json()

            def refuse(name, emission, wanted, status=422):
                answer = daemon.post(f"/v1/scenes/{name}/radiosity", {"emission": emission})
                self.assertEqual(answer.status, status, answer.body)
                self.assertIn(wanted, answer.json()["detail"])

            for emission in lamp, {"emitters": weights}:
                found = np.array(ask("groups", {"emission": emission})["radiosity"], np.float32)
                np.testing.assert_array_equal(found, wanted)
            batch = [{"groups": {"south": 3}}] * 20 + [{"emitters": weights}, lamp]
            some = ask("groups", {"emissions": batch, "select": {"elements": [7, 2, 7]}})
            for k in 20, 21:
                np.testing.assert_array_equal(np.array(some["radiosity"][k], np.float32), wanted[:, [7, 2, 7]])
            for quantity in QUANTITIES:
                for emission in {"sky": list(L)}, {"emitters": list(L)}:
                    found = np.array(ask("tiles", {"emission": emission, "quantity": quantity})[quantity])
                    self.close(found, truth.solve(np.zeros((3, truth.n)), np.tile(L, (3, 1)), quantity), quantity)
            self.assertEqual(daemon.get("/v1/scenes/groups").json()["emitters"], ["lamp", "south"])
            refuse("groups", {"groups": {"floor": 1}}, "which the store's 2 emitters do not")
            refuse("groups", {"emitters": [1]}, "holds 1 values, must be 2")
            refuse("groups", {"emitters": [1, 2, 3]}, "more than 2")
            refuse("groups", {"emitters": [1, -2]}, "-2")
            refuse("groups", {"emitters": 3}, "array")
            refuse("groups", {"emitters": [1, 2], "groups": {"lamp": 1}}, "either")
            refuse("groups", {"sky": [1] * 12}, "--emitters sky")
            refuse("tiles", [1.5] * truth.n, "emits 1.5")


if __name__ == "__main__":
    unittest.main()
