"""Black box: answers refined to a tolerance, from the daemon and the tool, against a dense solution in double of what
h5py reads from the store alone. Every answer is held against its certificate, every certificate against the tolerance."""

import concurrent.futures
import io
import json
import os
import pathlib
import shutil
import signal
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from daemon import Daemon
from make_store import add_checksums, text
from yard import Truth, write_yard

QUANTITIES = "radiosity", "irradiance", "indirect"
# The truth is a solution of 300 equations in double, of a condition below 10, and sums of 300 products: far below
# 1000 times 2^-53 of its largest number.
SLACK = 1e-13
BUILDS = {
    "low": ["--method", "low-rank", "--epsilon", ".2"],
    "coarse": ["--method", "2msc"],
    "exact": ["--method", "exact"],
    "sparse": ["--method", "sparse", "--threshold", "1e-2"],
    "hierarchical": ["--method", "hierarchical", "--epsilon", ".2"],
    "half": ["--method", "low-rank", "--epsilon", ".3", "--store-precision", "i8"],
    "sides": ["--method", "low-rank", "--epsilon", ".2", "--two-sided"],
    "grey": ["--method", "low-rank", "--epsilon", ".2", "--reflectance", ".9"],
}


def to_upper(path):
    """The same form factors as exchange areas of j > i."""
    with h5py.File(path, "r+") as f:
        g, area = f["form_factors"], f["mesh/area"][()]
        i = np.repeat(np.arange(len(area)), np.diff(g["indptr"][()].astype(np.int64)))
        j, F = g["indices"][()], g["data"][()]
        above = j > i
        i, j, exchange = i[above], j[above], (F[above].astype(float) * area[i[above]]).astype(np.float32)
        for name in "indptr", "indices", "data":
            del g[name]
        g["indptr"] = np.concatenate([[0], np.cumsum(np.bincount(i, minlength=len(area)))]).astype(np.uint64)
        g["indices"], g["data"] = j.astype(np.uint32), exchange
        g.attrs["storage"] = text("upper")
        add_checksums(f)


class Upper(Truth):
    """F of a store of exchange areas, as store/FORMAT.md reads it."""

    def __init__(self, path):
        super().__init__(path)
        g = np.triu(self.F, 1)
        g = g + g.T
        self.F = np.minimum(1, g / self.area[:, None]).astype(np.float32).astype(float)


class Tolerance(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-tolerance-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        (cls.folder / "served").mkdir()
        scene = write_yard(cls.folder)
        common = ["--elements", 120, "--rays", 1024, "--probes", 0, "--sky", "grid:4x3"]
        cls.stores = {}

        def build(name, *options):
            cls.stores[name] = cls.folder / "served" / (name + ".h5")
            must("precompute", scene, "-o", cls.stores[name], *common, *options)

        for name, options in BUILDS.items():
            build(name, "--keep-form-factors", *options)
        build("emitters", "--keep-form-factors", "--emitters", "group=lamp,south")
        build("tiles", "--keep-form-factors", "--emitters", "sky")
        build("none", "--method", "low-rank")
        cls.stores["upper"] = cls.folder / "served" / "upper.h5"
        shutil.copy(cls.stores["low"], cls.stores["upper"])
        to_upper(cls.stores["upper"])
        cls.truth = {name: (Upper if name == "upper" else Truth)(path) for name, path in cls.stores.items()
                     if name != "none"}
        cls.daemon = Daemon(*(f"{path}:{name}" for name, path in cls.stores.items()))
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def dense(self, name, E, L=None):
        """B, H and E' [C][n] of E [C][n] and L [C][m]."""
        truth = self.truth[name]
        H0 = L @ truth.first_bounce if L is not None else np.zeros_like(E)
        lit = E + truth.rho * H0
        B = np.stack([np.linalg.solve(np.eye(truth.n) - r[:, None] * truth.F, e) for r, e in zip(truth.rho, lit)])
        return {"radiosity": B, "irradiance": H0 + B @ truth.F.T, "indirect": B - lit}

    def hold(self, name, values, certificate, quantity, tolerance, E, L=None):
        truth = self.dense(name, E, L)
        values = np.reshape(values, E.shape)
        worst = np.abs(values - truth[quantity]).max()
        slack = SLACK * np.abs(truth[quantity]).max()
        self.assertLessEqual(worst, certificate + slack, (name, quantity, tolerance))
        if quantity != "irradiance":
            least = np.abs(truth["indirect"]).max()
            self.assertLessEqual(certificate, tolerance * least * (1 + tolerance) + slack, (name, quantity, tolerance))

    def ask(self, name, body, **more):
        answer = self.daemon.radiosity(name, body, **more)
        self.assertEqual(answer.status, 200, answer)
        return answer

    def emission(self, name, seed=3):
        """Numbers that single precision holds."""
        truth = self.truth[name]
        return np.random.default_rng(seed).integers(0, 64, (truth.C, truth.n)) / 8

    def sky(self, name):
        return np.broadcast_to([4, 0, 1, .5] * 3, (self.truth[name].C, 12)).astype(float)

    def test_certificates_cover_the_error(self):
        for name in [*BUILDS, "upper"]:
            E, L = self.emission(name), self.sky(name)
            for tolerance in 1e-1, 1e-4, 1e-6, 1e-9:
                for quantity in QUANTITIES:
                    for lit in False, True:
                        emission = {"sky": L[0].tolist()} if lit else E.tolist() if len(E) > 1 else E[0].tolist()
                        body = {"emission": emission, "tolerance": tolerance, "quantity": quantity}
                        answer = self.ask(name, body).json()
                        self.assertEqual(answer["quantity"], quantity)
                        self.assertNotIn("error", answer)
                        self.assertIsInstance(answer["iterations"], int)
                        self.hold(name, answer[quantity], answer["certificate"], quantity, tolerance,
                                  np.zeros_like(E) if lit else E, L if lit else None)

    def test_stricter_is_closer_and_takes_longer(self):
        body = {"emission": {"groups": {"lamp": 5}}}
        before = None
        for tolerance in 1e-2, 1e-5, 1e-8, 1e-11:
            answer = self.ask("low", dict(body, tolerance=tolerance)).json()
            if before is not None:
                self.assertLess(answer["certificate"], before["certificate"])
                self.assertGreater(answer["iterations"], before["iterations"])
            before = answer
        plain = np.array(self.ask("low", body).json()["radiosity"])
        self.assertGreater(np.abs(plain - np.array(before["radiosity"])).max(), before["certificate"])

    def test_stores_of_few_emitters(self):
        lamp = np.array(self.truth["emitters"].group) == self.truth["emitters"].groups.index("lamp")
        E = np.where(lamp, 2., 0.) * np.ones((3, 1))
        for tolerance in 1e-3, 1e-9:
            for quantity in QUANTITIES:
                body = {"tolerance": tolerance, "quantity": quantity}
                for emission in {"groups": {"lamp": 2}}, {"emitters": self.weights("emitters", lamp, 2)}:
                    answer = self.ask("emitters", dict(body, emission=emission)).json()
                    self.hold("emitters", answer[quantity], answer["certificate"], quantity, tolerance, E)
                L = self.sky("tiles")
                answer = self.ask("tiles", dict(body, emission={"sky": L[0].tolist()})).json()
                self.hold("tiles", answer[quantity], answer["certificate"], quantity, tolerance, 0 * E, L)
        refused = self.daemon.radiosity("emitters", {"emission": {"groups": {"east": 1}}, "tolerance": .1})
        self.assertEqual(refused.status, 422, refused)

    def weights(self, name, lamp, value):
        """Of the emitters that are groups: by what the lamp emits alone."""
        with h5py.File(self.stores[name]) as f:
            names = [n.decode() for n in f["operator/names"][()]]
            s, pointers = len(names), f["operator/E/indptr"][()].astype(int)
            k = names.index("lamp")
            emitted = [f["operator/E/data"][pointers[c * s + k]] for c in range(3)]
        weights = np.zeros((s, 3))
        weights[k] = [value / e for e in emitted]
        np.testing.assert_array_equal(weights[k] * emitted, value)
        return weights.tolist()

    def test_batches_and_selections_have_the_same_bits(self):
        bodies = [{"groups": {"lamp": 3}}, {"elements": [5], "values": [1]}, {"sky": [1] * 12},
                  {"elements": [], "values": []}] * 5
        batch = self.ask("low", {"emissions": bodies, "tolerance": 1e-6}).json()
        self.assertEqual(len(batch["certificate"]), 20)
        self.assertEqual(len(batch["iterations"]), 20)
        self.assertEqual(batch["certificate"][3], 0)
        self.assertEqual(set(np.ravel(batch["radiosity"][3])), {0})
        for v, body in enumerate(bodies):
            alone = self.ask("low", {"emission": body, "tolerance": 1e-6}).json()
            for key in "radiosity", "certificate", "iterations":
                self.assertEqual(alone[key], batch[key][v], (v, key))
        some = self.ask("low", {"emission": bodies[0], "tolerance": 1e-6, "select": {"elements": [7, 0, 7]}}).json()
        self.assertEqual(some["radiosity"], np.array(batch["radiosity"][0])[:, [7, 0, 7]].tolist())
        self.assertEqual(some["certificate"], batch["certificate"][0])

    def test_npy(self):
        body = {"emission": {"groups": {"lamp": 3}}, "tolerance": 1e-9}
        plain = self.ask("low", body).json()
        kept = np.array(plain["radiosity"])
        for accept, dtype in (("", "<f8"), ("; dtype=f8", "<f8"), ("; dtype=f4", "<f4"), ("; dtype=f2", "<f2")):
            answer = self.ask("low", body, accept="application/x-npy" + accept)
            array = np.load(io.BytesIO(answer.body))
            self.assertEqual(array.dtype, np.dtype(dtype))
            np.testing.assert_array_equal(array, kept.astype(dtype))
            certificate = float(answer.headers["Lambert-Certificate"])
            self.assertEqual(int(answer.headers["Lambert-Iterations"]), plain["iterations"])
            # The rounding is counted, and no more than it.
            rounding = np.abs(array.astype(float) - kept).max()
            self.assertEqual(certificate, plain["certificate"] + rounding)
            if dtype == "<f4":
                self.assertGreater(rounding, plain["certificate"])
        self.assertNotIn("Lambert-Certificate", self.ask("low", {"emission": {"sky": [1] * 12}}).headers)

    def test_many_ask_first(self):
        """Of a store that nobody has asked for a tolerance yet: its form factors are read once, for all."""
        with Daemon(f"{self.stores['low']}:low", "--threads", 4) as daemon:
            body = {"emission": {"groups": {"lamp": 3}}, "tolerance": 1e-6}
            with concurrent.futures.ThreadPoolExecutor(8) as pool:
                answers = list(pool.map(lambda _: daemon.radiosity("low", body), range(16)))
        wanted = self.ask("low", body).json()["radiosity"]
        for answer in answers:
            self.assertEqual(answer.status, 200, answer)
            self.assertEqual(answer.json()["radiosity"], wanted)

    def test_others_do_not_wait_for_refinements(self):
        """However many are asked for, they take one thread; with two, who wants a plain answer has the other."""
        plain = {"emission": {"groups": {"lamp": 3}}}
        long = json.dumps({"emissions": [{"elements": [i % 50], "values": [1]} for i in range(600)], "tolerance": 1e-10})
        with Daemon(f"{self.stores['low']}:low", "--threads", 2) as daemon:
            daemon.radiosity("low", dict(plain, tolerance=1e-2))  # the form factors are read
            with concurrent.futures.ThreadPoolExecutor(4) as pool:
                asked = [pool.submit(daemon.radiosity, "low", long) for _ in range(4)]
                while b"\nlambertd_queued 4\n" not in daemon.get("/metrics").body:
                    self.assertFalse(asked[0].done(), "too few to wait for")
                for _ in range(5):
                    self.assertEqual(daemon.radiosity("low", plain).status, 200)
                self.assertLess(sum(a.done() for a in asked), 2)
                answers = [a.result() for a in asked]
            self.assertEqual({a.status for a in answers}, {200})
            self.assertEqual(len({str(a.json()["radiosity"]) for a in answers}), 1)

    def test_figures(self):
        """reduce with a tolerance: figures of certified numbers. No figure but a sum and a variance is further off than the
        numbers are; a sum is by as much as the area makes of it."""
        for name in "low", "upper", "grey":
            truth, E = self.truth[name], self.emission(name)
            group = self.groups(self.stores[name])
            body = {"emission": E.tolist() if len(E) > 1 else E[0].tolist(), "tolerance": 1e-7,
                    "reduce": {"groups": ["floor", "lamp"], "with": ["mean", "sum", "min", "max", "variance"]}}
            answer = self.ask(name, body).json()
            B, certificate = self.dense(name, E)["radiosity"], answer["certificate"]
            self.assertGreater(answer["iterations"], 0)
            self.assertNotIn("error", answer)
            for g in "floor", "lamp":
                figures, a, values = answer["groups"][g], truth.area[group == g], B[:, group == g]
                mean = values @ a / a.sum()
                for figure, wanted, most in (("mean", mean, 1), ("sum", values @ a, a.sum()), ("min", values.min(axis=1), 1),
                                             ("max", values.max(axis=1), 1)):
                    off = np.abs(np.reshape(figures[figure], wanted.shape) - wanted).max()
                    self.assertLessEqual(off, most * (certificate + SLACK * np.abs(wanted).max()), (name, g, figure))
                variance = (values - mean[:, None]) ** 2 @ a / a.sum()
                self.assertLess(np.abs(np.reshape(figures["variance"], variance.shape) - variance).max(), 1e-5 * variance.max())
            batch = {"emissions": [body["emission"]] * 20, "tolerance": 1e-7, "reduce": body["reduce"]}
            many = self.ask(name, batch).json()
            self.assertEqual(many["certificate"], [certificate] * 20)
            self.assertEqual(many["groups"]["floor"]["mean"], [answer["groups"]["floor"]["mean"]] * 20)

    @staticmethod
    def groups(path):
        """[n] names."""
        with h5py.File(path) as f:
            names = [g.decode() if isinstance(g, bytes) else g for g in f["mesh/group_names"][()]]
            return np.array([names[g] for g in f["mesh/group"][()]])

    def test_max_memory_counts_form_factors(self):
        """Where it leaves no room for them, a plain answer is given and a certified one is not; with room both are."""
        plain = {"emission": {"groups": {"lamp": 3}}}
        held = self.daemon.get("/v1/scenes/upper").json()["bytes"]
        with h5py.File(self.stores["upper"]) as f:
            form_factors = 24 * len(f["form_factors/data"])
        # The store, and room for work that is far less than the form factors take
        for more, status in ((form_factors // 2, 503), (3 * form_factors, 200)):
            with Daemon(f"{self.stores['upper']}:upper", "--threads", 1, "--max-memory", 2 * held + more) as daemon:
                self.assertEqual(daemon.radiosity("upper", plain).status, 200)
                answer = daemon.radiosity("upper", dict(plain, tolerance=1e-6))
                self.assertEqual(answer.status, status, answer)
                if status == 503:
                    self.assertIn("--max-memory", answer.json()["detail"])
                self.assertEqual(daemon.radiosity("upper", plain).status, 200)

    def test_variants(self):
        """A variant is refined with the form factors of its base, under its own reflectances."""
        path = self.folder / "relit.h5"
        must("precompute", self.folder / "yard.obj", "-o", path, "--elements", 120, "--rays", 1024, "--probes", 0,
             "--keep-form-factors", "--keep-factors", "--method", "low-rank", "--epsilon", .2, "--sky", "grid:4x3")
        token = self.folder / "token"
        token.write_text("s3cret")
        headers = {"Authorization": "Bearer s3cret", "Content-Type": "application/json"}
        with Daemon(f"{path}:relit", "--token-file", token, "--max-variants", 1) as daemon:
            made = daemon.ask("PUT", "/v1/scenes/relit/reflectance",
                              json.dumps({"variant": "dim", "groups": {"floor": [.1, .2, .3], "south": .9}}), headers)
            self.assertEqual(made.status, 202, made)
            while (answer := daemon.get("/v1/scenes/relit@dim", headers=headers)).status == 202:
                pass
            self.assertEqual(answer.status, 200, answer)
            body = {"emission": {"groups": {"lamp": 5}}, "tolerance": 1e-7}
            answer = daemon.radiosity("relit@dim", body, headers=headers).json()
            base = daemon.radiosity("relit", body, headers=headers).json()
        group, truth = self.groups(path), Truth(path)
        E = np.broadcast_to(np.where(group == "lamp", 5.0, 0.0), (truth.C, truth.n))
        for rho, given, certificate in ((truth.rho, base, base["certificate"]), (None, answer, answer["certificate"])):
            if rho is None:
                rho = truth.rho.copy()
                rho[:, group == "floor"] = np.float32([[.1], [.2], [.3]])
                rho[:, group == "south"] = np.float32(.9)
            B = np.stack([np.linalg.solve(np.eye(truth.n) - r[:, None] * truth.F, e) for r, e in zip(rho, E)])
            off = np.abs(np.array(given["radiosity"]) - B).max()
            self.assertLessEqual(off, certificate + SLACK * B.max())
            self.assertLess(certificate, 1e-6 * np.abs(B - E).max())
        self.assertNotEqual(answer["radiosity"], base["radiosity"])

    def refused(self, status, words, name, body, pointer="/tolerance"):
        if not isinstance(body, str):
            body = json.dumps(body)
        answer = self.daemon.radiosity(name, body)
        self.assertEqual(answer.status, status, (body, answer))
        problem = answer.json()
        self.assertIn(words, problem["detail"], body)
        self.assertEqual(problem.get("pointer"), pointer, body)

    def test_refusals(self):
        light = '{"emission": {"groups": {"lamp": 1}}, "tolerance": %s}'
        for value in "0", "1", "-1e-3", "2", "1e999", "-0", "0.0":
            self.refused(422, "must be above 0 and below 1", "low", light % value)
        for value in '"1e-3"', "null", "true", "[1e-3]", "{}":
            self.refused(422, "tolerance", "low", light % value)
        for value in "NaN", "Infinity", "1e", ".1":
            self.assertEqual(self.daemon.radiosity("low", light % value).status, 400, value)
        self.refused(422, "tolerance", "low", (light % "1e-3")[:-1] + ', "tolerance": 1e-3}')
        self.refused(422, "--keep-form-factors", "none", light % "1e-3")
        for name in "low", "exact", "sparse", "emitters":
            self.refused(422, "tolerance 1e-18 is not reached: vector 0 is certified to ", name, light % "1e-18", None)
        self.ask("low", light % "1e-3")

    def test_a_store_that_changed_on_disk(self):
        path = self.folder / "changing.h5"
        shutil.copy(self.stores["low"], path)
        body = {"emission": {"groups": {"lamp": 3}}, "tolerance": 1e-6}
        with Daemon(f"{path}:changing") as daemon:
            shutil.copy(self.stores["grey"], self.folder / "other.h5")
            os.rename(self.folder / "other.h5", path)
            answer = daemon.radiosity("changing", body)
            self.assertEqual(answer.status, 503, answer)
            self.assertIn("another one", answer.json()["detail"])
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 1 scene")
            answer = daemon.radiosity("changing", body)
            self.assertEqual(answer.json()["radiosity"], self.ask("grey", body).json()["radiosity"])

    def test_damaged_form_factors(self):
        path = self.folder / "damaged.h5"
        shutil.copy(self.stores["low"], path)
        with h5py.File(path) as f:
            at = f["form_factors/data"].id.get_offset()
        with open(path, "r+b") as raw:
            raw.seek(at + 8)
            raw.write(b"\xff\x00\xff")
        with Daemon(f"{path}:damaged") as daemon:
            for _ in range(2):
                answer = daemon.radiosity("damaged", {"emission": {"groups": {"lamp": 3}}, "tolerance": 1e-6})
                self.assertEqual(answer.status, 503, answer)
                self.assertIn("form_factors/data", answer.json()["detail"])
            answer = daemon.radiosity("damaged", {"emission": {"groups": {"lamp": 3}}})
            self.assertEqual(answer.status, 200, answer)

    def solve(self, name, *options, suffix="npy"):
        out = self.folder / f"out.{suffix}"
        done = must("solve", self.stores[name], *options, "-o", out)
        return out, done.stderr

    def test_the_tool_answers_the_same(self):
        for name in [*BUILDS, "upper", "emitters"]:
            for quantity in QUANTITIES:
                body = {"emission": {"groups": {"lamp": 3}}, "tolerance": 1e-7, "quantity": quantity}
                wanted = self.ask(name, body).json()
                out, said = self.solve(name, "--emit", "lamp=3", "--quantity", quantity, "--tolerance", "1e-7")
                array = np.load(out)
                self.assertEqual(array.dtype, np.dtype("<f8"))
                # The tool may be of another build than the daemon: then bits may differ, by no more than is certified.
                np.testing.assert_allclose(array, np.array(wanted[quantity]), rtol=0, atol=2.1 * wanted["certificate"],
                                           err_msg=f"{name} {quantity}")
                self.assertRegex(said, rf"refined to 1e-07: no {quantity} is further than [0-9.e-]+ from .*; "
                                       rf"{wanted['iterations']} iterations\n")

    def test_the_tool_under_a_sky(self):
        L = self.sky("low")
        skies = self.folder / "skies.npy"
        np.save(skies, np.stack([L, 2 * L, 0 * L]))
        out, _ = self.solve("low", "--sky", skies, "--tolerance", "1e-8")
        for v, factor in enumerate((1, 2, 0)):
            truth = self.dense("low", np.zeros((3, self.truth["low"].n)), factor * L)["radiosity"]
            np.testing.assert_allclose(np.load(out)[v], truth, rtol=0, atol=1e-8 * max(truth.max(), 1e-300))

    def test_the_tool_in_other_formats(self):
        options = "--emit", "lamp=3", "--tolerance", "1e-9"
        array = np.load(self.solve("grey", *options)[0])
        answer = json.loads(self.solve("grey", *options, suffix="json")[0].read_text())
        self.assertEqual(answer["radiosity"], array.tolist())
        self.assertLess(answer["certificate"], 1e-8)
        self.assertNotIn("error", answer)
        rows = self.solve("grey", *options, suffix="csv")[0].read_text().splitlines()
        self.assertEqual([float(row.split(",")[-1]) for row in rows[1:]], array.tolist())
        reduced = json.loads(self.solve("grey", *options, "--reduce", "floor=mean,max", suffix="json")[0].read_text())
        inside = self.truth["grey"].group == self.truth["grey"].groups.index("floor")
        area = self.truth["grey"].area[inside]
        self.assertEqual(reduced["groups"]["floor"]["max"], array[inside].max())
        self.assertAlmostEqual(reduced["groups"]["floor"]["mean"], (area * array[inside]).sum() / area.sum(), places=14)
        self.solve("grey", *options, suffix="ply")
        self.solve("grey", *options, suffix="vtu")

    def test_the_tool_refuses(self):
        for status, words, line in ((2, "above 0 and below 1", "low --tolerance 0"), (2, "below 1", "low --tolerance 1"),
                                    (2, "not for --annual", "low --tolerance .1 --annual sum"),
                                    (1, "--keep-form-factors", "none --tolerance .1 --emit lamp=1"),
                                    (1, "is not reached", "low --tolerance 1e-18 --emit lamp=1")):
            name, *options = line.split()
            out = self.folder / "never.npy"
            done = lambert("solve", self.stores[name], *options, "-o", out)
            self.assertEqual(done.returncode, status, (line, done.stderr))
            self.assertIn(words, done.stderr.splitlines()[-1])
            if status == 1:
                self.assertIn(str(self.stores[name]), done.stderr.splitlines()[-1])
            self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
