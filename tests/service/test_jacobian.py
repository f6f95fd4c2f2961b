"""POST .../jacobian of groups and of elements: each number against the daemon's single answers, and against the dense solution in
double of what h5py reads."""

import io
import json
import pathlib
import tempfile
import unittest

import numpy as np

from daemon import Daemon
from make_store import Luminaires
from test_luminaires import KINDS
from yard import Truth, precompute_yard

OF = ["low", "exact", "hierarchical", "grey"]
QUANTITIES = "radiosity", "irradiance", "indirect"
# Sums in single precision, forwards and backwards, of some hundred terms.
SAME = 2e-6
GROUPS = ["floor", "south", "lamp"]


class Jacobian(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-jacobian-")
        cls.addClassCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        cls.truth, cls.lights, stores = {}, {}, []
        for name in OF:
            stores.append(precompute_yard(path, name, *KINDS[name]))
            cls.truth[name] = t = Truth(stores[-1])
            cls.lights[name] = Luminaires(t.n, t.C, seed=7).add_to(stores[-1])
        stores.append(precompute_yard(path, "few", "--emitters", "sky"))
        cls.truth["few"] = Truth(stores[-1])
        cls.daemon = Daemon(*stores)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def post(self, name, body, to="jacobian", accept="application/json"):
        return self.daemon.ask("POST", f"/v1/scenes/{name}/{to}", json.dumps(body),
                               {"Content-Type": "application/json", "Accept": accept})

    def ask(self, name, body, to="jacobian"):
        answer = self.post(name, body, to)
        self.assertEqual(answer.status, 200, (answer, body))
        return answer.json()

    def matrices(self, name, of, **more):
        """By kind, [C][rows][columns], and the names of columns."""
        got = self.ask(name, {"of": of, **more})
        return {kind: np.array(J, float).reshape(self.truth[name].C, -1, np.shape(J)[-1]) for kind, J in got["jacobian"].items()}, got

    def emissions(self, name, got):
        """A unit of each column, by kind."""
        return {kind: [{kind: np.eye(names)[k].tolist()} if kind == "sky" else {kind: {key: 1}} for k, key in
                       enumerate(range(names) if kind == "sky" else names)]
                for kind, names in got["columns"].items() if kind != "emitters"}

    def passes(self):
        found = next(line for line in self.daemon.get("/metrics").body.decode().splitlines() if line.startswith("lambertd_batch_size_sum"))
        return float(found.split()[1])

    def test_matrices_of_elements_are_kept(self):
        """Asked again a matrix has the same bytes and takes no vector, unless another quantity, order or kind is asked for; nine drop the first."""
        of = {"elements": [3, 0, 9]}
        asked = [{"of": of}, {"of": {"elements": [0, 3, 9]}}, {"of": of, "quantity": "irradiance"}, {"of": of, "by": ["groups"]}]
        first = [self.ask("low", body)["jacobian"] for body in asked]
        self.assertEqual(len({json.dumps(matrix) for matrix in first}), 4)
        before = self.passes()
        for _ in range(2):
            self.assertEqual([self.ask("low", body)["jacobian"] for body in asked], first)
        self.assertEqual(self.passes(), before)
        for k in range(9):
            self.ask("low", {"of": {"elements": [k]}})
        before = self.passes()
        self.assertEqual(self.ask("low", asked[0])["jacobian"], first[0])
        self.assertGreater(self.passes(), before)

    def test_each_column_is_the_answer_to_its_light(self):
        for name in OF:
            n, C = self.truth[name].n, self.truth[name].C
            some, every = [n - 1, 3, 3, 17], list(range(n))
            for quantity in QUANTITIES:
                means, told = self.matrices(name, {"groups": GROUPS}, quantity=quantity)
                self.assertEqual((told["groups"], told["quantity"], list(means)), (GROUPS, quantity, ["luminaires", "groups", "sky"]))
                few, _ = self.matrices(name, {"elements": some}, quantity=quantity)
                many, _ = self.matrices(name, {"elements": every}, quantity=quantity)
                for kind, emissions in self.emissions(name, told).items():
                    self.assertEqual(len(emissions), means[kind].shape[2])
                    answer = self.ask(name, {"emissions": emissions, "quantity": quantity, "limit": False}, "radiosity")
                    x = np.array(answer[quantity], float).reshape(len(emissions), C, n).transpose(1, 2, 0)
                    reduced = self.ask(name, {"emissions": emissions, "quantity": quantity, "limit": False,
                                              "reduce": {"groups": GROUPS, "with": ["mean"]}}, "radiosity")["groups"]
                    wanted = np.array([reduced[g]["mean"] for g in GROUPS]).reshape(len(GROUPS), len(emissions), C).transpose(2, 0, 1)
                    for found, right, what in ((means, wanted, "means"), (few, x[:, some], "few"), (many, x, "many")):
                        self.assertLessEqual(np.abs(found[kind] - right).max(), 2 * SAME * np.abs(x).max(), (name, quantity, kind, what))

    def test_truth(self):
        """Differences of a linear map are its derivatives: the light of one luminaire, one tile and one group in double."""
        t, l = self.truth["exact"], self.lights["exact"]
        means, told = self.matrices("exact", {"groups": GROUPS})
        dark, night = np.zeros((t.C, t.n)), np.zeros((t.C, 12))
        for kind, k in (("luminaires", 1), ("groups", t.groups.index("lamp")), ("sky", 5)):
            E, L = dark.copy(), night.copy()
            if kind == "luminaires":
                D = np.zeros((t.C, len(l.names)))
                D[:, k] = 1
                E = t.rho * l.direct(D)
            elif kind == "groups":
                E = t.lamp(1)
            else:
                L[:, k] = 1
            B = t.solve(E, L, "radiosity")
            for r, group in enumerate(GROUPS):
                of = t.group == t.groups.index(group)
                wanted = (B[:, of] * t.area[of]).sum(1) / t.area[of].sum()
                np.testing.assert_allclose(means[kind][:, r, k], wanted, atol=1e-5 * B.max(), err_msg=f"{kind} {group}")

    def test_npy_and_few_emitters(self):
        for of in {"groups": GROUPS}, {"elements": [5, 1]}:
            J = self.matrices("low", of, by=["sky"])[0]["sky"]
            answer = self.post("low", {"of": of, "by": ["sky"]}, accept="application/x-npy")
            np.testing.assert_array_equal(np.load(io.BytesIO(answer.body)), np.float32(J))
            few, told = self.matrices("few", of)
            self.assertEqual(list(few), ["emitters"])
            for k in range(0, 12, 5):
                answer = self.ask("few", {"emission": {"emitters": np.eye(12)[k].tolist()}, "limit": False,
                                          "select": of if "elements" in of else {"elements": [0]}}, "radiosity")
                if "elements" in of:
                    found = np.reshape(answer["radiosity"], few["emitters"].shape[:2])
                    np.testing.assert_allclose(few["emitters"][:, :, k], found, atol=SAME * np.abs(found).max())
            self.assertEqual(self.post("few", {"of": of, "by": ["groups"]}).status, 422)

    def test_bits_do_not_depend_on_company(self):
        """Rows of groups that are kept, and rows and columns of elements, alone and in other orders."""
        for quantity in "radiosity", "indirect":
            first = self.matrices("hierarchical", {"groups": GROUPS}, quantity=quantity)[0]
            for order in GROUPS[::-1], GROUPS[1:2]:
                other = self.matrices("hierarchical", {"groups": order}, quantity=quantity)[0]
                for kind, J in other.items():
                    np.testing.assert_array_equal(J, first[kind][:, [GROUPS.index(g) for g in order]])
        n = self.truth["hierarchical"].n
        for elements in [4, 9, 2], list(range(n)):
            first = self.matrices("hierarchical", {"elements": elements}, by=["luminaires", "sky"])[0]
            for kind in first:
                part = self.matrices("hierarchical", {"elements": elements[::-1]}, by=[kind])[0][kind]
                np.testing.assert_array_equal(part, first[kind][:, ::-1])

    def test_refusals(self):
        for body, words in (
                ({"of": {"groups": []}}, "of/groups is empty, must hold the name of a group"),
                ({"of": {"elements": []}}, "of/elements is empty, must hold the number of an element"),
                ({"of": {"groups": ["flor"]}}, 'of/groups/0: the scene has no group "flor"; did you mean "floor"?'),
                ({"of": {"elements": [1, 99999]}}, None),
                ({"of": {"elements": [1.5]}}, None),
                ({"of": {"groups": ["floor"], "elements": [1]}}, "of must hold one of sensors, groups and elements"),
                ({"of": {"groups": ["floor"]}, "quantity": "light"}, None),
                ({"of": {"sensors": ["a"]}}, "of/sensors: the store has no sensors; precompute it with --sensors"),
                ({"of": {"groups": ["floor"]}, "by": ["emitters"]}, "by/0: the store has no precomputed emitters")):
            answer = self.post("low", body)
            self.assertEqual(answer.status, 422, body)
            if words:
                self.assertEqual(answer.json()["detail"], words)
        two = self.post("low", {"of": {"groups": ["floor"]}, "by": ["sky", "groups"]}, accept="application/x-npy")
        self.assertEqual(two.json()["detail"], "an NPY answer holds one matrix; name one kind in by, or ask for JSON")


if __name__ == "__main__":
    unittest.main()
