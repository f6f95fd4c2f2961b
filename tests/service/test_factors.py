"""Black box: --keep-factors, and that what it keeps is free of reflectance."""

import json
import os
import tempfile
import unittest

import h5py
import numpy as np

from command import must

METHODS = {"low-rank": ("--method", "low-rank", "--rank", 40),
           "2msc": ("--method", "2msc", "--rank", 24),
           "qr": ("--method", "2msc", "--factorizer", "qr", "--rank", 24)}


class Factors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory()
        cls.box = cls.path("box.obj")
        must("generate", "box", "--divisions", 4, "--reflectance", .5, "-o", cls.box)

    @classmethod
    def tearDownClass(cls):
        cls.shared.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.shared.name, name)

    def precompute(self, name, *options):
        store = self.path(name + ".h5")
        done = must("precompute", self.box, "-o", store, "--rays", 256, "--probes", 2, *options)
        return store, done.stderr

    @staticmethod
    def emission():
        return np.random.default_rng(1).random(96).astype("<f4")

    def solve(self, store, quantity="irradiance"):
        np.save(self.path("E.npy"), self.emission())
        must("solve", store, "--emission", self.path("E.npy"), "--quantity", quantity, "-o", self.path("B.npy"))
        return np.load(self.path("B.npy"))

    @staticmethod
    def relit(store, rho):
        """H of a factored store under another reflectance, by the formula of FORMAT.md in double; and |U||core||V|E."""
        with h5py.File(store) as file:
            op = file["operator"]
            U = op["U"][()].astype(float)
            order = op["order"][()] if "order" in op else np.arange(len(U))
            if "I" in op:
                V, I = np.zeros_like(U), op["I"][()]
                for p in range(len(I) - 1):
                    V[I[p]:I[p + 1], p] = op["weight"][I[p]:I[p + 1]] if "weight" in op else 1
            else:
                V = op["V"][()].astype(float)
        core = np.linalg.inv(np.eye(U.shape[1]) - V.T @ (rho * U))
        E = Factors.emission()[order].astype(float)
        H, magnitude = np.empty(len(U)), np.empty(len(U))
        H[order] = U @ (core @ (V.T @ E))
        magnitude[order] = np.abs(U) @ (np.abs(core) @ (np.abs(V).T @ E))
        return H, magnitude

    def test_grey_stores_keep_factors(self):
        for name, options in METHODS.items():
            with self.subTest(name):
                folded, _ = self.precompute("folded", *options)
                kept, said = self.precompute("kept", *options, "--keep-factors")
                self.assertNotIn("does not use", said)
                with h5py.File(folded) as one, h5py.File(kept) as two:
                    self.assertEqual(one["operator"].attrs["form"], b"folded")
                    self.assertEqual(two["operator"].attrs["form"], b"factored")
                    k = two["operator/U"].shape[1]
                    self.assertEqual(two["operator/core"].shape, (1, k, k))
                must("verify", kept)
                about = json.loads(must("info", kept, "--json").stdout)
                self.assertEqual(about["kind"], "two_mesh" if name == "2msc" else "low_rank")
                # U, V and the core are rounded once, sums have 96 or 40 terms: at most 300 roundings of 6e-8 each.
                H, magnitude = self.relit(kept, .5)
                for store in folded, kept:
                    self.assertTrue((np.abs(self.solve(store) - H) <= 300 * 6e-8 * magnitude).all(), store)

    def test_the_factors_are_free_of_reflectance(self):
        # At full rank nothing is left out: under .7 they answer as the whole inverse that was made for .7.
        kept, _ = self.precompute("kept", "--method", "low-rank", "--rank", 96, "--keep-factors")
        exact, _ = self.precompute("exact", "--method", "exact", "--reflectance", .7)
        H, magnitude = self.relit(kept, np.float32(.7))
        # The rounding of S - Q V^T in single precision: 96 roundings and 1/(1 - .7) of each.
        self.assertLess(np.abs(self.solve(exact) - H).max(), 96 * 6e-8 * magnitude.max() / .3)
        self.assertGreater(np.abs(self.relit(kept, .5)[0] - H).max(), .1 * H.max())

    def test_where_there_are_none_it_is_said(self):
        for options in (("--method", "exact"), ("--method", "sparse"), ()):
            _, said = self.precompute("none", *options, "--keep-factors")
            self.assertRegex(said, r"(exact|sparse) does not use --keep-factors")


if __name__ == "__main__":
    unittest.main()
