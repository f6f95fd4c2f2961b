"""Form factors kept compressed: what it takes, what answers refined by them are worth, what is refused."""
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import h5py
import numpy as np

from command import example, lambert, must
from daemon import Daemon
from make_store import add_checksums

TOLERANCES = (.3, .05, .01)


class Truth:
    """F as rows, of the store that keeps them so."""

    def __init__(self, path):
        with h5py.File(path, "r") as f:
            g = f["form_factors"]
            self.rho = f["mesh/reflectance"][()].astype(float)
            self.C, self.n = self.rho.shape
            self.groups = [name.decode() for name in f["mesh/group_names"][()]]
            self.group = f["mesh/group"][()]
            self.F = np.zeros((self.n, self.n))
            i = np.repeat(np.arange(self.n), np.diff(g["indptr"][()].astype(int)))
            self.F[i, g["indices"][()]] = g["data"][()]

    def indirect(self, E):
        return np.stack([np.linalg.solve(np.eye(self.n) - r[:, None] * self.F, e) - e for r, e in zip(self.rho, E)])


class Compressed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-compressed-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.scene = cls.folder / "box.obj"
        must("generate", "cornell", "--elements", 1200, "-o", cls.scene)
        cls.stores = {name: cls.folder / (name + ".h5") for name in ("rows", "tree", "low")}
        must("precompute", cls.scene, "-o", cls.stores["rows"], "--probes", 0, "--method", "exact", "--keep-form-factors")
        must("precompute", cls.scene, "-o", cls.stores["tree"], "--probes", 4, "--method", "hierarchical",
             "--keep-form-factors=compressed")
        must("precompute", cls.scene, "-o", cls.stores["low"], "--probes", 0, "--method", "low-rank", "--epsilon", .2,
             "--keep-form-factors=compressed")
        cls.truth = Truth(cls.stores["rows"])

    def path(self, name):
        return self.folder / name

    def light(self):
        """A lamp, a wall and a lamp, light from every element."""
        t, E = self.truth, np.zeros((3, self.truth.C, self.truth.n))
        lamp, floor = (t.group == t.groups.index(name) for name in ("lamp", "floor"))
        E[0, :, lamp], E[1, :, floor], E[1, :, lamp] = 4, .5, 2
        E[2] = np.random.default_rng(1).integers(1, 64, E[2].shape) / 16
        return E

    def test_it_takes_less_and_is_found_right(self):
        with h5py.File(self.stores["rows"], "r") as rows, h5py.File(self.stores["tree"], "r") as f:
            self.assertEqual(f["form_factors"].attrs["storage"], b"compressed")
            self.assertLess(2 * len(f["form_factors/data"]), len(rows["form_factors/data"]))
            self.assertEqual(sorted(f["form_factors/lit_group"][()]), list(range(len(self.truth.groups))))
            np.testing.assert_array_equal(f["mesh/row_sums"][()], rows["mesh/row_sums"][()])
            self.assertEqual(f["form_factors"].attrs["method"], b"pairs")
        for name in ("tree", "low"):
            done = lambert("verify", self.stores[name], "--probes", 2)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertRegex(done.stdout, "ok +form factors +compressed, row sums agree with ")
        self.assertIn("kept as           compressed", must("info", self.stores["tree"]).stdout)

    def test_python_of_a_hierarchical_store(self):
        """The reader in deploy/examples says what `lambert solve` does."""
        scene, path, answer = (self.folder / name for name in ("made.obj", "made.h5", "made.npy"))
        for kind, group, rays, made_up in (("cornell", "lamp", "auto", False), ("city", "street", 64, True)):
            for line in (("generate", kind, "--elements", 1000, "-o", scene),
                         ("precompute", scene, "-o", path, "--method", "hierarchical", "--probes", 0, "--reflectance", 0.5,
                          "--rays", rays),
                         ("solve", path, "--emit", f"{group}=2", "-o", answer)):
                must(*line)
            with h5py.File(path, "r+") as f:
                bright = [name.decode() for name in f["mesh/group_names"][()]].index(group)
                f["mesh/emission"][0] = np.where(f["mesh/group"][()] == bright, 2, 0)
                self.assertEqual("missing" in f["operator"], made_up)
            names = example("read_hierarchical.py", path)
            B = np.load(answer)
            B = B[0] if B.ndim == 2 else B
            # Two transforms and a product in single precision, of numbers that half precision has exactly.
            np.testing.assert_allclose(names["B"], B, atol=1e-5 * B.max())

    def test_python_of_the_format(self):
        """The reader in deploy/examples lights the scene as all of F does."""
        names = example("read_compressed.py", self.stores["tree"])
        with h5py.File(self.stores["tree"], "r") as f:
            x = f["mesh/emission"][0].astype(float)
        self.assertGreater(x.max(), 0)
        np.testing.assert_allclose(names["H"], self.truth.F @ x, atol=1e-6 * x.max())

    def test_certificates_cover_what_was_left_out(self):
        np.save(self.path("light.npy"), self.light())
        truths = [self.truth.indirect(E) for E in self.light()]
        for name in ("tree", "low"):
            reached = 0
            for tolerance in TOLERANCES:
                for k, E in enumerate(self.light()):
                    np.save(self.path("one.npy"), E)
                    done = lambert("solve", self.stores[name], "--emission", self.path("one.npy"), "--tolerance", tolerance,
                               "--quantity", "indirect", "-o", self.path("answer.npy"))
                    if done.returncode != 0:
                        self.assertIn("which are compressed; use a larger tolerance", done.stderr)
                        self.assertEqual(len(done.stderr.strip().splitlines()), 1)
                        continue
                    reached += 1
                    said = float(re.search("further than ([^ ]+) from", done.stderr).group(1))
                    off = np.abs(np.load(self.path("answer.npy")) - truths[k]).max()
                    self.assertLessEqual(off, said * 1.01, (name, tolerance, k))
                    self.assertLessEqual(said, tolerance * truths[k].max() * (1 + tolerance) * 1.01)
                    # They are bounds, but not of another world.
                    self.assertGreater(off, 1e-6 * said)
            self.assertGreaterEqual(reached, 2 * len(TOLERANCES))

    def test_the_daemon_refines_by_them(self):
        t = self.truth
        E = np.zeros((t.C, t.n))
        E[:, t.group == t.groups.index("lamp")] = 1
        indirect = t.indirect(E)
        with Daemon(f"{self.stores['tree']}:tree") as daemon:
            answer = daemon.radiosity("tree", {"emission": {"groups": {"lamp": 1}}, "tolerance": .02, "quantity": "indirect"})
            self.assertEqual(answer.status, 200, answer)
            body = json.loads(answer.body)
            self.assertLessEqual(np.abs(np.array(body["indirect"]) - indirect).max(), body["certificate"])
            self.assertLessEqual(body["certificate"], .02 * 1.02 * indirect.max())
            answer = daemon.radiosity("tree", {"emission": {"groups": {"lamp": 1}}, "tolerance": 1e-9})
            self.assertEqual(answer.status, 422, answer)
            self.assertIn("compressed", json.loads(answer.body)["detail"])

    def test_what_needs_rows_is_refused(self):
        for wanted, line in (
                ("makes no operator; precompute the scene again", ("precompute", self.stores["tree"], "-o", self.path("x.h5"))),
                ("do not tell which elements see each other",
                 ("render", self.stores["tree"], "--quantity", "visible", "-o", self.path("x.png")))):
            done = lambert(*line)
            self.assertEqual(done.returncode, 1)
            self.assertIn(wanted, done.stderr)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        self.assertFalse(self.path("x.h5").exists())

    def test_rays_and_small_scenes_are_kept_as_they_are(self):
        must("generate", "city", "--elements", 300, "-o", self.path("city.obj"))
        for group, wanted, line in (
                ("lamp", "noise where they are small", (self.scene, "--rays", 64, "--quality", "draft")),
                ("street", "take less as they are", (self.path("city.obj"),))):
            done = must("precompute", *line, "-o", self.path("kept.h5"), "--probes", 0, "--keep-form-factors=compressed")
            self.assertIn(wanted, done.stderr)
            with h5py.File(self.path("kept.h5"), "r") as f:
                self.assertEqual(f["form_factors"].attrs["storage"], b"rows")
            must("solve", self.path("kept.h5"), "--emit", f"{group}=1", "--tolerance", 1e-6, "-o",
                 self.path("answer.npy"))

    def test_what_does_not_fit_together(self):
        def replace(f, name, values):
            del f["form_factors/" + name]
            f["form_factors/" + name] = values

        def set_one(f, name, at, value):
            values = f["form_factors/" + name][()]
            values[at] = value
            replace(f, name, values)

        for wanted, break_it in (
                ("must hold every number below", lambda f: set_one(f, "order", 3, 4)),
                ("must be at least 0", lambda f: set_one(f, "bound", (0, 0), -1)),
                ("must be at least 0", lambda f: set_one(f, "lit", (0, 0), np.nan)),
                ("rows, the basis has", lambda f: replace(f, "bound", f["form_factors/bound"][:-1])),
                ("columns, must be", lambda f: replace(f, "bound", f["form_factors/bound"][:, :-1])),
                ("lit", lambda f: replace(f, "lit", f["form_factors/lit"][:, :-1])),
                ("must not be below the diagonal", lambda f: set_one(f, "indices", f["form_factors/indptr"][5], 2)),
                ("node", lambda f: replace(f, "basis/node", f["form_factors/basis/node"][:-1])),
                ("order", lambda f: f.pop("form_factors/order"))):
            shutil.copy(self.stores["tree"], self.path("broken.h5"))
            with h5py.File(self.path("broken.h5"), "r+") as f:
                break_it(f)
                del f["checksum"]
                add_checksums(f)
            done = lambert("solve", self.path("broken.h5"), "--emit", "lamp=1", "--tolerance", .1, "-o",
                           self.path("a.npy"))
            self.assertEqual(done.returncode, 1, (wanted, done.stderr))
            self.assertIn(wanted, done.stderr)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)


if __name__ == "__main__":
    unittest.main()
