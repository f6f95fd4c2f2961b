"""Scenes whose light is known from elsewhere, through the whole tool: precompute, the daemon, an answer."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import h5py
import numpy as np

from command import of_faces
from daemon import Daemon
from patience import PATIENCE

LAMBERT = os.environ["LAMBERT"]
FIXTURES = pathlib.Path(os.environ["FIXTURES"])


def precompute(scene, store, *options):
    done = subprocess.run([LAMBERT, *of_faces(("precompute", scene, "-o", store, "--probes", 4, "--quiet", *options))],
                          capture_output=True, text=True, timeout=PATIENCE)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)


class Store:
    def __init__(self, path):
        with h5py.File(path) as file:
            self.area = file["mesh/area"][:]
            self.group = file["mesh/group"][:]
            self.names = [name.decode() for name in file["mesh/group_names"][:]]
            self.row_sums = file["mesh/row_sums"][:]
            rows = file["form_factors"]
            n = len(self.area)
            self.F = np.zeros((n, n))
            row = np.repeat(np.arange(n), np.diff(rows["indptr"][:].astype(int)))
            self.F[row, rows["indices"][:]] = rows["data"][:]
            if rows.attrs["storage"] == "upper":
                self.F = (self.F + self.F.T) / self.area[:, None]

    def means(self, values):
        """Area means over each group."""
        return np.array([np.average(values[self.group == g], weights=self.area[self.group == g])
                         for g in range(len(self.names))])


class KnownScenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)

    def answer(self, store, emission):
        with Daemon(store) as daemon:
            answer = daemon.radiosity(store.stem, {"emission": emission})
        self.assertEqual(answer.status, 200, answer)
        return np.array(answer.json()["radiosity"])

    def test_l_shaped_room(self):
        """An independent program's form factors and radiosities (fixtures/l-room)."""
        known = json.loads((FIXTURES / "l-room/solution.json").read_text())
        path, rays = self.folder / "l-room.h5", 65536
        precompute(FIXTURES / "l-room/l-room.obj", path, "--rays", rays, "--keep-form-factors")
        store = Store(path)
        self.assertEqual(store.names, known["surfaces"])
        np.testing.assert_allclose(np.bincount(store.group, store.area), known["area"], rtol=1e-12)
        np.testing.assert_allclose(store.row_sums, 1, atol=1e-6)

        exact = np.array(known["F"])
        groups = range(len(store.names))
        found = np.array([store.means(store.F[:, store.group == h].sum(axis=1)) for h in groups]).T
        # Five standard deviations of independent rays, and the reference's own rounding.
        limit = 5 * np.sqrt(exact * (1 - exact) / rays) + 1e-5
        self.assertTrue((np.abs(found - exact) <= limit).all(), np.abs(found - exact).max())
        # Walls that cannot see each other around the inner corner: nothing leaks there.
        self.assertEqual(found[exact == 0].max(), 0)

        emission = np.array(known["emission_W_m2"])
        B = store.means(self.answer(path, emission[store.group].tolist()))
        # The reference has one radiosity for each whole surface, which moves the reflected part in its third digit.
        wanted = np.array(known["radiosity_W_m2"])
        self.assertLessEqual((np.abs(B - wanted) / (wanted - emission)).max(), .01)

    def test_l_shaped_room_pair_by_pair(self):
        known = json.loads((FIXTURES / "l-room/solution.json").read_text())
        path = self.folder / "l-room-high.h5"
        precompute(FIXTURES / "l-room/l-room.obj", path, "--quality", "high", "--keep-form-factors")
        store = Store(path)
        with h5py.File(path) as file:
            accuracy = file["form_factors"].attrs["accuracy"]
        exact = np.array(known["F"])
        groups = range(len(store.names))
        found = np.array([store.means(store.F[:, store.group == h].sum(axis=1)) for h in groups]).T
        # Three standard errors of what is partly hidden, summed over at most three elements a surface, what the rows
        # of the source were moved by (1e-5), and the rounding of its seven digits.
        self.assertLessEqual(np.abs(found - exact).max(), 3 * 3**.5 * accuracy + 1e-5 + 1e-7)
        self.assertEqual(found[exact == 0].max(), 0)

    def test_box_with_cubes(self):
        """Closed, with occluders: a furnace, and symmetric under a half turn (fixtures/box345)."""
        path, rays = self.folder / "box345.h5", 4096
        precompute(FIXTURES / "box345/box345.obj", path, "--rays", rays, "--keep-form-factors")
        store = Store(path)
        self.assertEqual(len(store.area), 106)
        np.testing.assert_allclose(store.area, 1, rtol=1e-12)
        np.testing.assert_allclose(store.row_sums, 1, atol=1e-6)
        np.testing.assert_allclose(self.answer(path, [1] * 106), 2, rtol=1e-5)  # rho = .5

        with h5py.File(path) as file:
            corners = file["mesh/vertices"][:][file["mesh/elements"][:]]
            place = np.round(np.concatenate([corners.mean(axis=1), file["mesh/normal"][:]], axis=1), 6) + 0.
        turned = place * [-1, -1, 1, -1, -1, 1] + [5, 4, 0, 0, 0, 0] + 0.
        where = {tuple(row): i for i, row in enumerate(place)}
        partner = [where[tuple(np.round(row, 6) + 0.)] for row in turned]
        difference = np.abs(store.F - store.F[np.ix_(partner, partner)])
        # Each of the two is off by its own noise; merging by reciprocity only lessens it.
        deviation = np.sqrt(2 * store.F * (1 - store.F) / rays)
        self.assertLessEqual((difference - 6 * deviation).max(), 3 / rays)

    def test_furnished_room(self):
        """A real scene under its own lamp (fixtures/room-front): nothing shines where nothing can."""
        path = self.folder / "room-front.h5"
        precompute(FIXTURES / "room-front/room-front.obj", path, "--elements", 1500, "--method", "low-rank",
                   "--epsilon", .1, "--rays", 1024, "--up", "y", "--keep-form-factors")
        store = Store(path)
        with h5py.File(path) as file:
            emission, reflectance = file["mesh/emission"][:].astype(float), file["mesh/reflectance"][:].astype(float)
            stated = file["error/lights"].attrs["operator_indirect_max"]
        B = self.answer(path, emission.tolist())
        self.assertEqual(B.shape, emission.shape)
        wanted = np.array([np.linalg.solve(np.eye(len(store.area)) - rho[:, None] * store.F, E)
                           for rho, E in zip(reflectance, emission)])
        weigh = lambda x: np.sqrt((store.area * x * x).sum())
        # The stored F is rounded to single precision, so the stated error is met within 1 %.
        self.assertLessEqual(weigh(B - wanted) / weigh(wanted - emission), 1.01 * stated)
        # Energy: what the lamp gives is absorbed or leaves (truths of radiosity: no F needed but its row sums).
        given = (store.area * emission).sum()
        H = np.divide(wanted - emission, reflectance, out=np.zeros_like(wanted), where=reflectance > 0)
        seen = reflectance > 0
        spent = np.where(seen, (1 - reflectance) * H, (store.F @ wanted.T).T) + wanted * (1 - store.row_sums)
        np.testing.assert_allclose((store.area * spent).sum(), given, rtol=1e-4)


if __name__ == "__main__":
    unittest.main()
