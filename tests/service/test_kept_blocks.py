"""Form factors kept as blocks: what the store holds, what answers refined by them are worth, what is refused, and what
a file with wrong values in it does."""

import json
import os
import re
import shutil
import unittest

import h5py
import numpy as np

from case import Case
from command import REFERENCE, example, lambert, must
from daemon import Daemon
from make_store import add_checksums

TOLERANCES = (.01, 1e-6, 1e-9)


class Truth:
    """F of a store, expanded pair by pair."""

    def __init__(self, path):
        with h5py.File(path, "r") as f:
            o = f["form_factors"]
            self.rho = f["mesh/reflectance"][()].astype(float)
            self.C, self.n = self.rho.shape
            self.groups = [name.decode() for name in f["mesh/group_names"][()]]
            self.group = f["mesh/group"][()]
            self.row_sums = f["mesh/row_sums"][()]
            clusters, rectangles = o["clusters"][()].astype(int), o["rectangles"][()]
            places, order, d, data = o["places"][()], o["order"][()], o["balance"][()], o["data"][()].astype(float)
            a = np.repeat(np.arange(len(o["indptr"]) - 1), np.diff(o["indptr"][()].astype(int)))
            b, area, at = o["indices"][()], f["mesh/area"][()][order], 0
            G = np.zeros((self.n, self.n))
            for p, q in zip(a, b):
                ends = []
                for t in (p, q):
                    if t >= len(clusters):
                        ends.append((np.array([t - len(clusters)]), np.ones((1, 1))))
                    else:
                        i, over = np.arange(*clusters[t, :2]), rectangles[t, 2:]
                        m = (places[i] - rectangles[t, :2]) * over
                        ends.append((i, np.column_stack([np.ones(len(i)), m[:, over != 0]])))
                (i, x), (j, y) = ends
                size = x.shape[1] * y.shape[1]
                L = data[at:at + size].reshape(x.shape[1], y.shape[1])
                at += size
                values = d[i][:, None] * d[j] * (x @ L @ y.T)
                G[np.ix_(i, j)] += values * area[j]
                G[np.ix_(j, i)] += values.T * area[i]
            assert at == len(data)
            self.F = np.zeros_like(G)
            self.F[np.ix_(order, order)] = G

    def indirect(self, E):
        return np.stack([np.linalg.solve(np.eye(self.n) - r[:, None] * self.F, e) - e for r, e in zip(self.rho, E)])


class KeptBlocks(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scene = os.path.join(cls.shared.name, "room.obj")
        cls.colour = os.path.join(cls.shared.name, "colour.obj")
        cls.kept = os.path.join(cls.shared.name, "kept.h5")
        cls.coloured = os.path.join(cls.shared.name, "coloured.h5")
        must("generate", "cornell", "--closed", "--elements", 900, "--reflectance", .6, "-o", cls.scene)
        must("generate", "cornell", "--elements", 500, "-o", cls.colour)
        must("precompute", cls.scene, "-o", cls.kept, "--epsilon", .2, "--probes", 4, "--form-factors", "blocks",
             "--keep-form-factors")
        must("precompute", cls.colour, "-o", cls.coloured, "--epsilon", .2, "--probes", 0, "--form-factors", "blocks",
             "--keep-form-factors")
        cls.truth = Truth(cls.kept)

    def light(self):
        """A lamp, a wall and a lamp, light from every element, one element."""
        t, E = self.truth, np.zeros((4, self.truth.C, self.truth.n))
        lamp, floor = (t.group == t.groups.index(name) for name in ("lamp", "floor"))
        E[0, :, lamp], E[1, :, floor], E[1, :, lamp] = 4, .5, 2
        E[2] = np.random.default_rng(1).integers(1, 64, E[2].shape) / 16
        E[3, :, t.n // 3] = 1
        return E

    def test_the_store_holds_them(self):
        with h5py.File(self.kept) as f:
            o = f["form_factors"]
            self.assertEqual((o.attrs["storage"], o.attrs["method"]), (b"blocks", b"blocks"))
            self.assertEqual(o["indptr"][-1], len(o["indices"]))
            self.assertLess(len(o["data"]), 9 * len(o["indices"]))
        self.assertGreaterEqual(self.truth.F.min(), 0)
        np.testing.assert_allclose(self.truth.F.sum(axis=1), self.truth.row_sums, atol=1e-12)
        np.testing.assert_allclose(self.truth.row_sums, 1, atol=1e-5)
        done = must("verify", self.kept, "--probes", 4)
        self.assertRegex(done.stdout, r"ok +form factors +\d+ blocks, none is negative, row sums agree with ")
        self.assertRegex(done.stdout, r"ok +error")
        self.assertIn("kept as           blocks", must("info", self.kept).stdout)

    def test_auto_keeps_blocks_of_large_planes(self):
        scene, store = self.path("large.obj"), self.path("large.h5")
        must("generate", "cornell", "--closed", "--elements", 4200, "--reflectance", .5, "-o", scene)
        must("precompute", scene, "-o", store, "--epsilon", .5, "--probes", 0, "--keep-form-factors")
        with h5py.File(store) as f:
            self.assertEqual(f["form_factors"].attrs["storage"], b"blocks")
        done = must("solve", store, "--emit", "lamp=1", "--tolerance", 1e-6, "-o", self.path("a.npy"))
        self.assertIn("refined to 1e-06", done.stderr)

    def test_memory_that_rows_pass_is_enough(self):
        """Rows of 36,000 elements take 436 MB by forecast, blocks less. Too little for either is refused."""
        scene, store = self.path("large.obj"), self.path("large.h5")
        must("generate", "cornell", "--closed", "--elements", 5000, "--reflectance", .5, "-o", scene)
        line = ("precompute", scene, "-o", store, "--elements", 36000, "--method", "hierarchical", "--epsilon", .2, "--probes",
                0, "--keep-form-factors", "--memory")
        self.failed("need about", *line, "400M", "--form-factors", "rays")
        must(*line, "400M", program=REFERENCE)
        with h5py.File(store) as f:
            self.assertEqual(f["form_factors"].attrs["storage"], b"blocks")
        done = self.failed("with blocks need about", *line, "20M")
        self.assertIn("--memory allows 20M; fits: ", done.stderr)

    def test_python_of_the_format(self):
        names = example("read_blocks.py", self.kept)
        with h5py.File(self.kept) as f:
            x = f["mesh/emission"][0].astype(float)
        self.assertGreater(x.max(), 0)
        np.testing.assert_allclose(names["H"], self.truth.F @ x, atol=1e-12 * x.max())

    def check_answers(self, store, truth, lights):
        for E in lights:
            right = truth.indirect(E)
            np.save(self.path("e.npy"), E)
            for tolerance in TOLERANCES:
                done = must("solve", store, "--emission", self.path("e.npy"), "--tolerance", tolerance, "--quantity",
                            "indirect", "-o", self.path("a.npy"))
                said = float(re.search("further than ([^ ]+) from", done.stderr).group(1))
                answer = np.load(self.path("a.npy"))
                off = np.abs(answer.reshape(right.shape) - right).max()
                # The truth is a solve in double.
                self.assertLessEqual(off, said * 1.01 + 1e-12 * right.max(), tolerance)
                self.assertLessEqual(said, tolerance * right.max() * (1 + tolerance) * 1.01)

    def test_certificates_are_true(self):
        self.check_answers(self.kept, self.truth, self.light())

    def test_certificates_are_true_in_colour(self):
        t = Truth(self.coloured)
        self.assertEqual(t.C, 3)
        E = np.random.default_rng(2).random((t.C, t.n)).astype("f4").astype(float)
        self.check_answers(self.coloured, t, [E])

    def test_the_daemon_refines_by_them(self):
        t = self.truth
        E = np.zeros((t.C, t.n))
        E[:, t.group == t.groups.index("lamp")] = 1
        right = t.indirect(E)
        with Daemon(f"{self.kept}:kept") as daemon:
            for tolerance in TOLERANCES:
                answer = daemon.radiosity("kept", {"emission": {"groups": {"lamp": 1}}, "tolerance": tolerance,
                                                   "quantity": "indirect"})
                self.assertEqual(answer.status, 200, answer)
                body = json.loads(answer.body)
                off = np.abs(np.array(body["indirect"]) - right).max()
                self.assertLessEqual(off, body["certificate"] + 1e-12 * right.max())
                self.assertLessEqual(body["certificate"], tolerance * (1 + tolerance) * 1.01 * right.max())

    def arrays(self, store):
        with h5py.File(store) as f:
            return {name: value[()] for name, value in f["form_factors"].items()}

    def test_threads_change_nothing(self):
        for threads in (1, 3):
            must("precompute", self.scene, "-o", self.path(f"{threads}.h5"), "--epsilon", .2, "--probes", 0,
                 "--form-factors", "blocks", "--keep-form-factors", "--threads", threads)
        one, three = self.arrays(self.path("1.h5")), self.arrays(self.path("3.h5"))
        for name, values in one.items():
            np.testing.assert_array_equal(values, three[name], name)

    def test_another_operator_of_the_same_factors(self):
        again = self.path("again.h5")
        done = must("precompute", self.kept, "-o", again, "--epsilon", .1, "--reflectance", .3, "--probes", 4,
                    "--keep-form-factors")
        self.assertRegex(done.stderr, r"\d+ blocks of \d+ planes\n")
        before, after = self.arrays(self.kept), self.arrays(again)
        self.assertEqual(sorted(before), sorted(after))
        for name, values in before.items():
            np.testing.assert_array_equal(values, after[name], name)
        must("solve", again, "--emit", "lamp=1", "--tolerance", 1e-8, "--quantity", "indirect", "-o", self.path("a.npy"))
        t, E = self.truth, np.zeros((1, self.truth.n))
        E[:, t.group == t.groups.index("lamp")] = 1
        B = np.linalg.solve(np.eye(t.n) - np.float32(.3).astype(float) * t.F, E[0]) - E[0]
        np.testing.assert_allclose(np.load(self.path("a.npy")).ravel(), B, atol=1e-8 * B.max())
        must("verify", again, "--probes", 4)

    def test_what_needs_rows_is_refused(self):
        out = self.path("no.h5")
        for wanted, line in (
                ("--method low-rank needs rows", ("precompute", self.kept, "-o", out, "--method", "low-rank")),
                ("--emitters needs rows", ("precompute", self.kept, "-o", out, "--emitters", "group=lamp")),
                ("where rows are needed", ("classify", self.kept)),
                ("do not tell which elements see each other",
                 ("render", self.kept, "--quantity", "visible", "-o", self.path("x.png")))):
            done = self.failed(wanted, *line)
            self.assertIn("--form-factors rays", done.stderr.splitlines()[-1])
        self.assertFalse(os.path.exists(out))

    def broken(self, change):
        """A copy with wrong values and right checksums."""
        path = self.path("broken.h5")
        shutil.copy(self.kept, path)
        with h5py.File(path, "r+") as f:
            change(f["form_factors"])
            del f["checksum"]
            add_checksums(f)
        return path

    def refine(self, path):
        return lambert("solve", path, "--emit", "lamp=1", "--tolerance", .1, "-o", self.path("a.npy"))

    def test_wrong_values_are_named(self):
        def put(name, at, value):
            def change(o):
                o[name][at] = value
            return change

        def resize(name, count):
            def change(o):
                values = o[name][()]
                del o[name]
                o[name] = values[:count]
            return change

        def cut(o):
            o["indptr"][-1] -= 1

        def scale(o):
            o["balance"][...] *= 1.01

        clusters = self.arrays(self.kept)["clusters"].astype(int)
        leaf = int(np.flatnonzero(clusters[:, 2] == 0xFFFFFFFF)[1])
        joined = int(np.flatnonzero(clusters[:, 2] != 0xFFFFFFFF)[1])
        planes = int(clusters[clusters[:, 3] != 0xFFFFFFFF, 3].max()) + 1
        above = int(np.flatnonzero(clusters[:, 3] == 0xFFFFFFFF)[0])
        for wanted, change in (
                ("must hold every number below", put("order", 3, 4)),
                ("must hold every number below", put("order", 0, 2**32 - 1)),
                (f"clusters[{leaf}] has the positions", put("clusters", (leaf, 0), 0)),
                (f"clusters[{leaf}] has the positions", put("clusters", (leaf, 1), 2**32 - 1)),
                (f"clusters[{leaf}] has the positions", put("clusters", (leaf, 3), 2**32 - 1)),
                (f"clusters[{joined}] joins", put("clusters", (joined, 2), joined)),
                (f"clusters[{joined}] joins", put("clusters", (joined, 1), 7)),
                (f"clusters[{joined}] is in plane", put("clusters", (joined, 3), (clusters[joined, 3] + 1) % planes)),
                (f"there are {planes}", put("clusters", (joined, 3), planes)),
                ("are", resize("clusters", above)),
                ("frames[4] = nan, must be finite", put("frames", (0, 4), np.nan)),
                ("places[3] = inf, must be finite", put("places", (1, 1), np.inf)),
                ("reaches beyond the rectangle", put("places", (1, 1), 99)),
                ("reaches beyond the rectangle", put("rectangles", (leaf, 2), 1e9)),
                ("must be at least 0, and 0 above planes", put("rectangles", (above, 2), 1)),
                ("must be at least 0, and 0 above planes", put("rectangles", (leaf, 2), -1)),
                ("rectangles[0] = -inf, must be finite", put("rectangles", (0, 0), -np.inf)),
                ("balance[5] = 0, must be finite and above 0", put("balance", 5, 0)),
                ("indptr begins with", put("indptr", 0, 1)),
                ("indptr begins with", cut),
                ("must be from", put("indptr", 40, 2**63)),
                ("must rise, below", put("indices", 7, 2**32 - 1)),
                ("must rise, below", put("indices", 7, 0)),
                ("data[9] = nan, must be finite", put("data", 9, np.nan)),
                ("must be at least 0", put("data", 0, -1)),
                ("data", resize("data", -1)),
                ("places", resize("places", -1)),
                ("must be at most 1", scale),
                ("places", lambda o: o.pop("places")),
                ("storage 'tiles'", lambda o: o.attrs.modify("storage", np.array(b"tiles")[()]))):
            done = self.refine(self.broken(change))
            self.assertEqual(done.returncode, 1, (wanted, done.stderr))
            self.assertIn(wanted, done.stderr)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)

    def test_compressed_form_factors_are_refused(self):
        """Earlier versions wrote them. They are hand-made here: of the group only the attribute `storage` is read."""
        def change(o):
            for name in list(o):
                if name not in ("leaving", "absorbed", "repair"):
                    del o[name]
            del o.attrs["storage"]  # whose length is fixed
            o.attrs["storage"] = np.bytes_(b"compressed")
            o["order"], o["indptr"] = np.arange(self.truth.n, dtype="<u4"), np.arange(self.truth.n + 1, dtype="<u8")
            o["indices"], o["data"] = np.arange(self.truth.n, dtype="<u4"), np.zeros(self.truth.n, "<f4")

        path, out = self.broken(change), self.path("no.h5")
        wanted = (f"{path}: its form factors are compressed, which is not supported any more; precompute the scene again, with "
                  "--form-factors blocks --keep-form-factors")
        for line in (("solve", path, "--emit", "lamp=1", "-o", self.path("a.npy")),
                     ("solve", path, "--emit", "lamp=1", "--tolerance", .1, "-o", self.path("a.npy")),
                     ("render", path, "--emit", "lamp=1", "-o", self.path("a.png")),
                     ("render", path, "--quantity", "visible", "-o", self.path("a.png")),
                     ("precompute", path, "-o", out), ("classify", path)):
            self.assertEqual(self.failed(wanted, *line).stderr.count("\n"), 1)
            self.assertFalse([name for name in ("a.npy", "a.png", "no.h5") if os.path.exists(self.path(name))])
        done = lambert("verify", path)
        self.assertEqual(done.returncode, 1)
        self.assertIn("its form factors are compressed", done.stdout)
        with Daemon(f"{path}:old", f"{self.kept}:kept") as daemon:
            self.assertEqual([scene["name"] for scene in json.loads(daemon.get("/v1/scenes").body)["scenes"]], ["kept"])
            self.assertIn(wanted, daemon.errors())
        done = lambert("precompute", self.scene, "-o", out, "--keep-form-factors=compressed")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("--keep-form-factors=compressed: was removed; give --keep-form-factors", done.stderr)

    def test_any_value_is_survived(self):
        """Numbers of any array replaced by any bytes: an answer or one line, also of the daemon, which lives on."""
        rng = np.random.default_rng(8)
        arrays = self.arrays(self.kept)
        good = 0
        for name in sorted(arrays):
            for round in range(4):
                def change(o):
                    values = o[name][()]
                    flat = values.reshape(-1).view("u1")
                    at = rng.integers(flat.size, size=1 + 3 * (round % 2))
                    flat[at] = rng.integers(256, size=at.size)
                    o[name][...] = values
                path = self.broken(change)
                done = self.refine(path)
                self.assertIn(done.returncode, (0, 1), (name, done))
                good += done.returncode == 0
                if done.returncode == 0:
                    self.assertTrue(np.isfinite(np.load(self.path("a.npy"))).all())
                else:
                    self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
                if round > 0:
                    continue
                with Daemon(f"{path}:broken") as daemon:
                    answer = daemon.radiosity("broken", {"emission": {"groups": {"lamp": 1}}, "tolerance": .1})
                    self.assertIn(answer.status, (200, 422, 500, 503), answer)
                    self.assertEqual(daemon.radiosity("broken", {"emission": {"groups": {"lamp": 1}}}).status, 200)
        self.assertGreater(good, 2)  # low bits of a number change nothing that is wrong


if __name__ == "__main__":
    unittest.main()
