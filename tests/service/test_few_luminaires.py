"""Black box: luminaires that are emitters of a store of few, which answers for these alone. Its answers are held against a dense
solution in double of what h5py reads, and against those of a store of all emissions with the same form factors."""

import itertools
import json
import pathlib
import shutil
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from daemon import Daemon
from make_store import Luminaires, add_checksums
from yard import Truth, write_yard

QUANTITIES = "radiosity", "irradiance", "indirect"
# The light of an emitter is converged to 1e-6 in the norm over the scene, and kept in single precision.
SAME = 2e-6
SPOT = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 .3 1.2 0\n1 1 30\n0 30 60 90\n0\n1000 850 450 0\n"
LIST = {"luminaires": [
    {"name": "row", "file": "spot.ies", "from": [1, 1, 2.8], "steps": [[2, 0, 0]], "counts": [2], "dim": .7},
    {"name": "desk", "file": "spot.ies", "at": [2, 3, 2.8], "aim": [0, 1, -2], "colour": [1.2, 1, .4]}]}
NAMES = ["row.0", "row.1", "desk"]
# The emitters of each store beside its luminaires.
STORES = {"sky": 12, "group=lamp": 1, "luminaires": 0}


class Few(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-few-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        (path / "spot.ies").write_text(SPOT)
        (path / "list.json").write_text(json.dumps(LIST))
        write_yard(path)
        must("precompute", path / "yard.obj", "-o", path / "all.h5", "--elements", 120, "--rays", 1024, "--probes", 0, "--sky", "grid:4x3",
             "--luminaires", path / "list.json", "--lights", "lm", "--method", "exact", "--keep-form-factors")
        cls.stores = {"all": path / "all.h5"}
        for name in STORES:
            cls.stores[name] = path / (name.replace("=", "-") + ".h5")
            must("precompute", path / "all.h5", "-o", cls.stores[name], "--emitters", name, "--probes", 8, "--keep-form-factors")
        cls.truth = Truth(path / "all.h5")
        with h5py.File(path / "all.h5") as f:
            cls.H, cls.colour = f["luminaires/irradiance"][()].astype(float), f["luminaires/colour"][()].T
        (path / "token").write_text("secret\n")
        cls.daemon = Daemon(*cls.stores.values(), "--max-variants", 2, "--token-file", path / "token")
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def post(self, path, body, method="POST"):
        return self.daemon.ask(method, path, json.dumps(body), {"Authorization": "Bearer secret", "Content-Type": "application/json"})

    def served(self, name):
        return self.stores[name].stem

    def ask(self, name, body):
        answer = self.post(f"/v1/scenes/{self.served(name)}/radiosity", body)
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def direct(self, D):
        """H0 [C][n] of dimmers D [C][k]."""
        return (D * self.colour) @ self.H

    def wanted(self, D, quantity, E=0):
        """E = rho H0 is what elements emit in the place of luminaires, whose direct light is seen beside it."""
        H0 = self.direct(D)
        q = self.truth.solve(E + self.truth.rho * H0, np.zeros((3, len(self.truth.first_bounce))), quantity)
        return q + {"radiosity": 0, "irradiance": H0, "indirect": 0}[quantity]

    def close(self, got, wanted, what):
        self.assertLessEqual(np.abs(np.reshape(got, wanted.shape) - wanted).max(), SAME * np.abs(wanted).max(), what)

    def dimmers(self, of):
        D = np.zeros((3, 3))
        for k, name in enumerate(NAMES):
            D[:, k] = of.get(name, of.get(name[:3], 0))
        return D

    def test_they_are_the_last_emitters_of_the_file(self):
        for name, beside in STORES.items():
            with h5py.File(self.stores[name]) as f:
                self.assertEqual([n.decode() for n in f["operator/names"][beside:]], NAMES)
                self.assertEqual(f["operator"].attrs["luminaires"], 3)
                for k in range(3):
                    D = np.zeros((3, 3))
                    D[:, k] = 1
                    lit = self.truth.rho > 0  # elsewhere the file has the irradiance
                    self.close(np.where(lit, f["operator/B"][:, beside + k], 0), self.wanted(D, "radiosity"), (name, k))

    def test_answers_are_those_of_an_emission(self):
        for (name, beside), quantity in itertools.product(STORES.items(), QUANTITIES):
            for of in {"row": .4}, {"row.0": 2, "desk": [.5, 1, 2]}:
                wanted = self.wanted(self.dimmers(of), quantity)
                as_weights = [0] * beside + self.dimmers(of).T.tolist()
                for emission in {"luminaires": of}, {"emitters": of if "row" not in of else {"row.0": .4, "row.1": .4}}, \
                        {"emitters": as_weights}:
                    self.close(self.ask(name, {"emission": emission, "quantity": quantity, "limit": False})[quantity], wanted,
                               (name, quantity, emission))
            both = {"emitters": {"desk": 1}, "luminaires": {"row": 1, "desk": 1}}
            self.close(self.ask(name, {"emission": both, "quantity": quantity, "limit": False})[quantity],
                       self.wanted(self.dimmers({"row": 1, "desk": 2}), quantity), "both add up")
        E = self.truth.lamp(7)
        for emission in {"groups": {"lamp": 7}}, {"emitters": {"lamp": 7}}:
            got = self.ask("group=lamp", {"emission": {**emission, "luminaires": {"desk": 2}}, "limit": False})["radiosity"]
            self.close(got, self.wanted(self.dimmers({"desk": 2}), "radiosity", E), emission)

    def test_answers_of_the_command_line(self):
        out = self.folder / "o.npy"
        for name, quantity in itertools.product(STORES, QUANTITIES):
            for options, of in ((("--dim", "row=.4", "--dim", "desk=.5,1,2"), {"row": .4, "desk": [.5, 1, 2]}),
                                (("--emit", "desk=1", "--dim", "desk=1"), {"desk": 2})):
                must("solve", self.stores[name], *options, "--quantity", quantity, "--linear", "-o", out)
                self.close(np.load(out), self.wanted(self.dimmers(of), quantity), (name, quantity))
        (self.folder / "e.json").write_text(json.dumps({"emissions": [{"luminaires": {"row": 1}}, {"emitters": {"desk": 1}}]}))
        must("solve", self.stores["sky"], "--emission", self.folder / "e.json", "--linear", "-o", out)
        for got, of in zip(np.load(out), ({"row": 1}, {"desk": 1})):
            self.close(got, self.wanted(self.dimmers(of), "radiosity"), of)
        # Without options it is the scene's own light, as its list dims it.
        must("solve", self.stores["group=lamp"], "--linear", "-o", out)
        self.close(np.load(out), self.wanted(self.dimmers({"row": .7, "desk": 1}), "radiosity", self.truth.lamp(5)), "own")

    def test_batches_have_the_same_bits(self):
        emissions = [{"luminaires": {"row": 1}}, {"emitters": {"desk": 1, "tile 3": 2}}, {"sky": [1] * 12}]
        got = self.ask("sky", {"emissions": emissions})["radiosity"]
        for one, emission in zip(got, emissions):
            self.assertEqual(one, self.ask("sky", {"emission": emission})["radiosity"])

    def test_figures_of_groups(self):
        """Rows answer means, vectors the rest; both are those of the dense solution, and state the same error."""
        t, by_row = self.truth, {}
        for name, quantity in itertools.product(STORES, QUANTITIES):
            of = {"row.1": 1, "desk": [1, 2, 3]}
            wanted = self.wanted(self.dimmers(of), quantity)
            for figures in ["mean"], ["mean", "min"]:
                body = {"emission": {"luminaires": of}, "quantity": quantity, "limit": False,
                        "reduce": {"groups": ["floor", "south"], "with": figures}}
                answer = self.ask(name, body)
                self.assertEqual(answer["error"]["light"], "own")
                for group in body["reduce"]["groups"]:
                    i = t.group == t.groups.index(group)
                    mean = wanted[:, i] @ t.area[i] / t.area[i].sum()
                    got = np.ravel(answer["groups"][group]["mean"])
                    self.assertLessEqual(np.abs(got - mean).max(), SAME * np.abs(wanted).max(), (name, quantity, figures))
                    error = answer["error"]["groups"][group]["mean"]
                    self.assertAlmostEqual(error / by_row.setdefault((name, quantity, group), error), 1, delta=1e-3)

    def test_stated_errors_know_their_direct_light(self):
        """As luminaires and as emitters they are one light, also over HTTP and at the command line."""
        for name in STORES:
            body = {"limit": False, "emission": {"luminaires": {"desk": 1}}}
            error = self.ask(name, body)["error"]
            self.assertEqual(error["light"], "own")
            self.assertEqual(error, self.ask(name, {"limit": False, "emission": {"emitters": {"desk": 1}}})["error"])
            for option in ("--dim", "desk=1"), ("--emit", "desk=1"):
                told = json.loads(must("solve", self.stores[name], *option, "--linear", "--json").stdout)["error"]
                self.assertAlmostEqual(error["stated"] / told["stated"], 1, delta=1e-4, msg=(name, option))
            with h5py.File(self.stores[name], "r") as f:
                self.assertGreater(f["error/mesh"].attrs["luminaire"], 0)

    def test_gradients(self):
        """J = sum g q is linear in dimmers, so that the gradient is J of each alone."""
        g = np.random.default_rng(3).integers(-8, 8, (3, self.truth.n)) / 8
        for (name, beside), quantity in itertools.product(STORES.items(), QUANTITIES):
            wanted = np.stack([(g * self.wanted(self.dimmers({n: 1}), quantity)).sum(1) for n in NAMES], axis=1)
            answer = self.post(f"/v1/scenes/{self.served(name)}/adjoint",
                               {"cotangent": g.tolist(), "quantity": quantity}).json()["gradient"]
            # Of the sum of |g| |q|, as the terms of J have both signs.
            self.assertLessEqual(np.abs(np.array(answer["luminaires"]) - wanted).max(), 1e-5 * self.truth.n * np.abs(wanted).max(), name)
            self.assertEqual(np.array(answer["emitters"])[:, beside:].tolist(), answer["luminaires"])
            body = {"cotangent": g.tolist(), "quantity": quantity, "gradient": ["luminaires"]}
            alone = self.post(f"/v1/scenes/{self.served(name)}/adjoint", body).json()["gradient"]
            self.assertEqual(alone, {"luminaires": answer["luminaires"]})

    def test_refined_answers(self):
        """Against a dense solution in double, by their certificates; the slack is that of test_tolerance.py."""
        for name, quantity in itertools.product(STORES, QUANTITIES):
            wanted = self.wanted(self.dimmers({"row": .5, "desk": 1}), quantity)
            answer = self.ask(name, {"emission": {"luminaires": {"row": .5, "desk": 1}}, "quantity": quantity, "tolerance": 1e-9})
            worst = np.abs(np.reshape(answer[quantity], wanted.shape) - wanted).max()
            self.assertLessEqual(worst, answer["certificate"] + 1e-13 * wanted.max(), (name, quantity))
        out = self.folder / "t.npy"
        must("solve", self.stores["luminaires"], "--dim", "row=.5", "--dim", "desk=1", "--tolerance", "1e-7", "-o", out)
        self.close(np.load(out), self.wanted(self.dimmers({"row": .5, "desk": 1}), "radiosity"), "solve --tolerance")

    def test_verify(self):
        for name in STORES:
            said = must("verify", self.stores[name]).stdout
            self.assertIn("3, the light of 3 of them was found again, as stated", said)
            self.assertIn("ok      energy", said)

    def refused(self, words, *command):
        result = lambert(*command)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn(words, result.stderr)
        self.assertTrue(result.stderr.strip().splitlines()[-1].startswith("lambert"), result.stderr)

    def test_refusals(self):
        yard, out = self.folder / "yard.obj", ("-o", self.folder / "no.h5")
        self.refused("there are none; give --luminaires", "precompute", yard, "--emitters", "luminaires", *out)
        (self.folder / "lamp.json").write_text(json.dumps({"luminaires": [{"name": "lamp", "file": "spot.ies", "at": [2, 2, 2]}]}))
        self.refused("lamp is the name of an emitter and of a luminaire", "precompute", yard, "--emitters", "group=lamp", "--luminaires",
                     self.folder / "lamp.json", "--lights", "lm", *out)
        self.refused("answers for the emitters that it was made for", "precompute", self.stores["sky"], "--luminaires",
                     self.folder / "list.json", *out)
        self.refused('no luminaire "lump"', "solve", self.stores["sky"], "--dim", "lump=1")
        self.assertFalse((self.folder / "no.h5").exists())
        answer = self.post(f"/v1/scenes/{self.served('sky')}/reflectance", {"variant": "dark", "groups": {"floor": .1}}, "PUT")
        self.assertEqual(answer.status, 409, answer)
        self.assertIn("low-rank", answer.json()["detail"])

    def test_luminaires_that_are_no_emitters_are_refused(self):
        """Their light would be dark in answers."""
        path = self.folder / "odd.h5"
        shutil.copy(self.stores["group=lamp"], path)
        for change, words in (("count", "counts 2 luminaires among 4 emitters, /luminaires has 3"),
                              ("none", "counts 0 luminaires"), ("names", "must be the same")):
            shutil.copy(self.stores["group=lamp"], path)
            with h5py.File(path, "r+") as f:
                if change == "count":
                    f["operator"].attrs["luminaires"] = 2
                elif change == "none":
                    del f["operator"].attrs["luminaires"]
                else:
                    f["luminaires/names"][2] = "disk"
                add_checksums(f)
            self.refused(words, "solve", path, "--dim", "desk=1", "-o", self.folder / "no.npy")
        must("precompute", self.stores["all"], "--luminaires", "none", "-o", self.folder / "dark.h5")
        must("precompute", self.folder / "dark.h5", "--emitters", "group=lamp", "--probes", 0, "-o", path)
        Luminaires(self.truth.n, 3, mesh_groups=len(self.truth.groups)).add_to(path)
        self.refused("counts 0 luminaires among 1 emitters, /luminaires has 5", "solve", path, "--dim", "wall=1")


if __name__ == "__main__":
    unittest.main()
