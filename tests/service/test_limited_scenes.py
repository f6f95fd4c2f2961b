"""No light below zero in twelve scenes, 2,000 random answers of all kinds: means of groups are those of the linear map, and the
error against the converged solution of the same form factors does not grow. Signed emissions are differences of others."""

import os
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import SMALL, must

FIXTURES = pathlib.Path(os.environ["FIXTURES"])
U = 2.0**-24
SCENES = {"box": "box --divisions 6", "cornell": "cornell --elements 300", "closed": "cornell --closed --elements 500",
          "rooms": "rooms --elements 400", "maze": "maze --elements 500", "city": "city --variant 1 --elements 400",
          "hill": "city --variant 2 --terrain hill --elements 400", "patio": "patio --elements 400", "atrium": "atrium --elements 400",
          "canopy": "canopy --elements 300", "anechoic": "anechoic --elements 400", "room": "room-front/room-front.obj"}
KINDS = {"low-rank": ("--method", "low-rank", "--epsilon", .2), "bytes": ("--method", "low-rank", "--epsilon", .1, "--store-precision", "i8"),
         "2msc": ("--method", "2msc"), "sparse": ("--method", "sparse", "--threshold", 1e-3),
         "hierarchical": ("--method", "hierarchical", "--epsilon", .2), "exact": ("--method", "exact")}
VECTORS = 28  # of each scene and kind


class Scene:
    def __init__(self, folder, name):
        self.folder, self.name = folder, name
        self.base = folder / f"{name}.h5"
        scene = FIXTURES / SCENES[name]
        if "/" not in SCENES[name]:
            scene = folder / f"{name}.obj"
            must("generate", *SCENES[name].split(), "-o", scene)
        must("precompute", scene, "-o", self.base, "--keep-form-factors", "--method", "exact", "--rays", 256, "--probes", 0, "--quiet")
        with h5py.File(self.base) as file:
            self.area, self.group = file["mesh/area"][()], file["mesh/group"][()]
            self.channels = len(file["mesh/reflectance"])
        self.n = len(self.area)

    def emissions(self):
        """Single elements, some of them, whole groups and all: [VECTORS][C][n]."""
        rng = np.random.default_rng(sum(self.name.encode()))
        E = np.zeros((VECTORS, self.channels, self.n), np.float32)
        for v in range(VECTORS):
            if v % 4 < 2:
                E[v][:, rng.integers(0, self.n, 1 + 6 * (v % 4))] = 1 + rng.random()
            elif v % 4 == 2:
                E[v][:, self.group == rng.choice(self.group)] = 1 + rng.random()
            else:
                E[v] = rng.random(E[v].shape) ** 3
        return E

    def solve(self, store, E, *options):
        emission, out = self.folder / "e.npy", self.folder / "b.npy"
        np.save(emission, E if self.channels > 1 else E[:, 0])
        must("solve", store, "--emission", emission, "-o", out, *options)
        return np.load(out).astype(float).reshape(E.shape)

    def error(self, B, T, E):
        """The area-weighted error of each answer, as a share of the light that is reflected."""
        def norm(x):
            return np.sqrt((self.area * x**2).sum((1, 2)))
        reflects = norm(T - E) > 1e-6 * norm(E)
        return norm(B - T)[reflects] / norm(T - E)[reflects]


class LimitedScenes(unittest.TestCase):
    def test_random_answers(self):
        below, answers = 0, 0
        grown = {kind: [] for kind in KINDS}
        names = ("maze", "room") if SMALL else SCENES
        with tempfile.TemporaryDirectory(prefix="lambert-limited-") as folder:
            for name in names:
                scene = Scene(pathlib.Path(folder), name)
                E = scene.emissions()
                T = scene.solve(scene.base, E, "--tolerance", 1e-6)
                for kind, options in KINDS.items():
                    store = scene.folder / "kind.h5"
                    must("precompute", scene.base, "-o", store, "--probes", 0, "--quiet", *options)
                    linear, limited = scene.solve(store, E, "--linear"), scene.solve(store, E)
                    with self.subTest(scene=name, kind=kind):
                        self.check(scene, E, linear, limited)
                        # Signed emissions give the difference, but for the rounding of sums in single precision.
                        both, others = E[3::4], E[1::4]
                        D = both - others
                        self.assertLess(D.min((1, 2)).max(), 0)
                        slack = 64 * U * (np.abs(linear[3::4]).max() + np.abs(linear[1::4]).max())
                        np.testing.assert_allclose(scene.solve(store, D), linear[3::4] - linear[1::4], rtol=0, atol=slack)
                    below += int((linear < 0).sum())
                    answers += len(E)
                    grown[kind] += zip(scene.error(linear, T, E), scene.error(limited, T, E))
        print(f"{answers} answers, {below} values below zero without a limit")
        self.assertGreater(below, 0)
        for kind, errors in grown.items():
            before, after = np.mean(errors, axis=0)
            print(f"{kind}: error {before:.6g}, limited {after:.6g}")
            self.assertLessEqual(after, before * (1 + 1e-6), kind)

    def check(self, scene, E, linear, limited):
        self.assertGreaterEqual(limited.min(), 0)
        for g in np.unique(scene.group):
            i = scene.group == g
            A = scene.area[i]
            before, after = (linear - E)[..., i] @ A, (limited - E)[..., i] @ A
            slack = 4 * U * (np.maximum(np.abs(linear), E)[..., i] @ A)
            self.assertLessEqual((np.abs(after - np.maximum(before, 0)) - slack).max(), 0, g)


if __name__ == "__main__":
    unittest.main()
