"""From a scene to an answer over HTTP: `lambert generate` and `precompute`, then lambertd."""

import io
import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import must
from daemon import Daemon


class Whole(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = path = pathlib.Path(folder.name)
        cls.kinds = {"exact": "exact", "low-rank": "low_rank"}
        for rho in ".5", ".9":
            scene = path / f"furnace{rho[1:]}.obj"
            must("generate", "furnace", "--reflectance", rho, "--elements", 300, "-o", scene)
            for method in cls.kinds:
                must("precompute", scene, "-o", path / f"{scene.stem}-{method}.h5", "--method", method,
                     "--rays", 512, "--probes", 8, "--quiet")
        must("generate", "cornell", "--elements", 300, "-o", path / "cornell.obj")
        must("precompute", path / "cornell.obj", "-o", path / "cornell.h5", "--rays", 256, "--probes", 4, "--quiet")
        stores = [f"{store}:{store.stem}" for store in sorted(path.glob("*.h5"))]
        assert len(stores) == 5, stores
        cls.daemon = Daemon(*stores)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def test_furnace(self):
        # In a closed scene of one reflectance and E = 1 everywhere, B = 1/(1 - rho), whatever the shape.
        for rho in ".5", ".9":
            wanted = 1 / (1 - float(rho))
            for method, kind in self.kinds.items():
                name = f"furnace{rho[1:]}-{method}"
                about = self.daemon.get(f"/v1/scenes/{name}").json()
                self.assertEqual(about["kind"], kind)
                answer = self.daemon.radiosity(name, {"emission": [1] * about["elements"]})
                self.assertEqual(answer.status, 200, answer)
                B = np.array(answer.json()["radiosity"])
                self.assertEqual(len(B), about["elements"])
                stated = max(about["error"][light]["total_relative_max"] for light in ("single", "lights", "random")
                             if light in about["error"])
                limit = 1e-4 if kind == "exact" else stated
                self.assertLessEqual(np.linalg.norm(B - wanted) / np.linalg.norm(np.full_like(B, wanted)), limit, name)
                if kind == "exact":
                    self.assertLessEqual(np.abs(B - wanted).max(), 1e-4 * wanted, name)

    def test_info_prints_what_the_route_answers(self):
        for store in sorted(self.folder.glob("*.h5")):
            said = self.daemon.get(f"/v1/scenes/{store.stem}").json()
            printed = json.loads(must("info", store, "--json").stdout)
            # The daemon was given another name for it.
            self.assertEqual(said.pop("name"), store.stem)
            self.assertEqual(printed.pop("name"), store.stem.split("-")[0])
            self.assertEqual(said, printed)

    def test_a_coloured_room_is_answered_as_solve_does(self):
        about = self.daemon.get("/v1/scenes/cornell").json()
        self.assertEqual(about["channels"], 3)
        groups = [g["name"] for g in about["groups"]]
        for emission in {groups[0]: [1, 2, 3]}, {groups[-1]: [4.5, 0, 1], groups[1]: [1, 1, 1]}:
            out = self.folder / "out.npy"
            emit = [f"--emit={name}={','.join(map(str, value))}" for name, value in emission.items()]
            must("solve", self.folder / "cornell.h5", *emit, "-o", out)
            answer = self.daemon.radiosity("cornell", {"emission": {"groups": emission}}, accept="application/x-npy")
            self.assertEqual(answer.status, 200, answer)
            B = np.load(io.BytesIO(answer.body))
            self.assertEqual(B.shape, (3, about["elements"]))
            np.testing.assert_array_equal(B, np.load(out).astype(np.float32))

    def test_a_group_by_name_states_what_its_values_do(self):
        about = self.daemon.get("/v1/scenes/cornell").json()
        with h5py.File(self.folder / "cornell.h5") as file:
            group = file["mesh/group"][:]
        names = [g["name"] for g in about["groups"]]
        asked = {"reduce": {"groups": names[:3], "with": ["mean"]}, "limit": False}
        shares = []
        for k, name in enumerate(names):
            values = np.repeat((group == k)[None], 3, axis=0).astype(float).tolist()
            told = [self.daemon.radiosity("cornell", {"emission": emission, **asked}).json()["error"]
                    for emission in ({"groups": {name: 1}}, values)]
            for of in names[:3]:
                by_name, by_values = (error["groups"][of]["stated"] for error in told)
                self.assertAlmostEqual(by_name, by_values, delta=1e-4 * by_values, msg=(name, of))
            self.assertGreater(told[0]["parts"]["mesh"], 0)
            shares.append(told[0]["parts"]["mesh"])
        self.assertGreater(max(shares), 1.2 * min(shares), shares)  # groups have their own


if __name__ == "__main__":
    unittest.main()
