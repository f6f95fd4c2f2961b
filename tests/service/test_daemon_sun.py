"""The sun itself in an emission over HTTP: the answers of `solve` under the same sun, for every quantity, kind of request and kind of
store, and what refuses it."""

import json
import math
import pathlib
import tempfile
import time
import unittest

import numpy as np

from command import lambert, must
from daemon import Daemon
from patience import PATIENCE

PLACE = {"latitude": 48, "longitude": 2, "zone": 1}
MORNING = "21 Mar 9:30"
QUANTITIES = "radiosity", "irradiance", "indirect"
JSON = {"Content-Type": "application/json", "Authorization": "Bearer secret"}
SUN = {"azimuth": 140, "altitude": 35, "direct": 700}


class Sun(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-sun-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        must("generate", "city", "--elements", 500, "-o", cls.folder / "city.obj")
        must("generate", "cornell", "--elements", 400, "-o", cls.folder / "cornell.obj")
        usual = ["--mesh", "faces", "--rays", 64, "--probes", 0, "--quiet"]
        cls.skied = [*usual, "--sky", "tregenza", "--ground-albedo", .3]
        must("precompute", cls.folder / "city.obj", "-o", cls.folder / "city.h5", "--north", 25, "--keep-form-factors", *cls.skied)
        must("precompute", cls.folder / "cornell.obj", "-o", cls.folder / "cornell.h5", "--method", "low-rank", "--keep-factors",
             *cls.skied)
        must("precompute", cls.folder / "cornell.obj", "-o", cls.folder / "sides.h5", "--two-sided", "--up", "y", *cls.skied)
        must("precompute", cls.folder / "city.obj", "-o", cls.folder / "few.h5", "--method", "emitters", "--emitters", "sky", *cls.skied)
        must("precompute", cls.folder / "cornell.obj", "-o", cls.folder / "dark.h5", *usual)
        must("precompute", cls.folder / "cornell.obj", "-o", cls.folder / "panes.h5", "--glass", "ceiling=.7,2", "--glass", "back*=.6",
             "--form-factors", "rays", *cls.skied)
        (cls.folder / "token").write_text("secret\n")
        cls.daemon = Daemon("--stores", cls.folder, "--max-variants", 2, "--token-file", cls.folder / "token")
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def post(self, scene, body, route="radiosity", headers=None):
        return self.daemon.ask("POST", f"/v1/scenes/{scene}/{route}", json.dumps(body),
                               {**JSON, **(headers or {})})

    def values(self, scene, emission, quantity="radiosity", **members):
        answer = self.post(scene, {"emission": emission, "quantity": quantity, **members})
        self.assertEqual(answer.status, 200, answer.body)
        return np.array(answer.json()[quantity])

    def clear(self, scene, date=MORNING):
        answer = self.post(scene, {"sky": {"name": "clear", "place": PLACE, "date": date, "sun_in_tiles": False}}, "skies").json()
        sky = answer["skies"][0]
        sun = sky["sun"]
        return sky["sky"], {"azimuth": sun["azimuth"], "altitude": sun["altitude"], "direct": sun["normal"]}

    def solved(self, scene, quantity, date=MORNING):
        must("solve", self.folder / f"{scene}.h5", "--sky", "clear", "--place", "48,2,1", "--date", date, "--quantity", quantity,
             "-o", self.folder / "o.npy")
        return np.load(self.folder / "o.npy")

    def test_as_solve(self):
        # Of thousands of rays one or two may pass an edge on the other side, as they are cast by other means: one ray of an
        # element is a 128th of its sunlight. All other numbers are those of single precision.
        for scene in "city", "cornell", "sides", "panes":
            sky, sun = self.clear(scene)
            for quantity in QUANTITIES:
                right = self.solved(scene, quantity)
                got = self.values(scene, {"sky": sky, "sun": sun}, quantity)
                off = np.abs(got - right.reshape(got.shape)) / np.abs(right).max()
                self.assertLessEqual(off.max(), .02, (scene, quantity))
                self.assertLessEqual(np.mean(off > 2e-5), .01 if quantity != "indirect" else 1, (scene, quantity))
                self.assertLess(np.mean(off), 1e-4, (scene, quantity))
            both = self.values(scene, {"sky": sky}) + self.values(scene, {"sun": sun})
            np.testing.assert_allclose(self.values(scene, {"sky": sky, "sun": sun}), both, rtol=2e-5, atol=1e-3)

    def test_open_plane(self):
        # Roofs see the whole sky: E sin(altitude), and each wall that the sun reaches at least E times its cosine or nothing.
        at = math.radians(SUN["altitude"])
        roof = self.values("city", {"sun": SUN}, "irradiance", select={"groups": ["roof"]})
        self.assertAlmostEqual(np.max(roof) / (SUN["direct"] * math.sin(at)), 1, delta=.05)
        self.assertFalse(np.any(self.values("city", {"sun": {**SUN, "altitude": -1}})))
        self.assertFalse(np.any(self.values("city", {"sun": {**SUN, "altitude": 0}})))
        np.testing.assert_array_equal(self.values("city", {"sun": {**SUN, "azimuth": 115, "north": 50}}),
                                      self.values("city", {"sun": SUN}))

    def test_ways(self):
        whole = self.values("city", {"sun": SUN}, "irradiance")
        some = [3, 0, 200]
        np.testing.assert_allclose(self.values("city", {"sun": SUN}, "irradiance", select={"elements": some}), whole[some], rtol=1e-5)
        batch = self.post("city", {"emissions": [{"sun": SUN}, {"groups": {"roof": 1}}, {"sun": {**SUN, "direct": 70}}],
                                   "quantity": "irradiance"}).json()["irradiance"]
        np.testing.assert_allclose(batch[0], whole, rtol=1e-6)
        np.testing.assert_allclose(batch[1], self.values("city", {"groups": {"roof": 1}}, "irradiance"), rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(np.array(batch[2]) * 10, whole, rtol=1e-5)
        self.assertGreater(np.max(batch[0]), 100 * np.max(batch[1]))
        figures = self.post("city", {"emission": {"sun": SUN}, "quantity": "irradiance",
                                     "reduce": {"groups": ["roof"], "with": ["mean", "max"]}}).json()
        of_roofs = self.values("city", {"sun": SUN}, "irradiance", select={"groups": ["roof"]})
        self.assertAlmostEqual(figures["groups"]["roof"]["max"], np.max(of_roofs), delta=1e-3)
        refined = self.values("city", {"sun": SUN}, "irradiance", tolerance=1e-5)
        self.assertLess(np.linalg.norm(refined - whole) / np.linalg.norm(whole), .02)
        self.assertGreater(np.count_nonzero(refined), len(whole) / 2)
        gradient = self.post("city", {"cotangent": {"groups": {"roof": 1}}, "emission": {"sun": SUN}, "gradient": ["reflectance"]},
                             "adjoint").json()["gradient"]["reflectance"]
        plain = np.array(self.post("city", {"cotangent": {"groups": {"roof": 1}}, "emission": {"sky": [0] * 145},
                                            "gradient": ["reflectance"]}, "adjoint").json()["gradient"]["reflectance"])
        self.assertFalse(np.any(plain))
        # dJ/drho of roofs that the sun reaches is its irradiance, and what comes back to them of their light.
        self.assertAlmostEqual(np.max(np.array(gradient)[whole > np.max(whole) / 4] / whole[whole > np.max(whole) / 4]), 1, delta=.2)

    def test_colours(self):
        red = self.values("cornell", {"sun": {**SUN, "direct": [700, 0, 0]}}, "irradiance")
        self.assertTrue(np.any(red[0]))
        self.assertFalse(np.any(red[1:]))
        grey = self.values("city", {"sun": {**SUN, "direct": [100, 100, 400]}}, "irradiance")
        by = .265 * 100 + .670 * 100 + .065 * 400
        np.testing.assert_allclose(grey, self.values("city", {"sun": {**SUN, "direct": by}}, "irradiance"), rtol=1e-5)

    def test_stated(self):
        error = self.post("city", {"emission": {"sun": SUN}}).json()["error"]
        self.assertEqual(error.get("light", "own"), "own")

    def test_what_it_makes_elements_send_has_an_error(self):
        """That of an emission of the same: both have the same answer, apart from roundings."""
        must("precompute", self.folder / "cornell.obj", "-o", self.folder / "told.h5x", "--method", "low-rank", "--epsilon", .2,
             *self.skied, "--probes", 8)
        with Daemon(f"{self.folder / 'told.h5x'}:told") as daemon:
            def ask(emission, quantity="radiosity"):
                return daemon.radiosity("told", {"emission": emission, "quantity": quantity, "limit": False}).json()
            lit = {"sun": SUN}
            sun = ask(lit)
            sent = np.array(sun["radiosity"]) - np.array(ask(lit, "indirect")["indirect"])
            same = ask(sent.tolist())
        self.assertGreater(sun["error"]["relative_mean"], 0)
        for figure in "relative_mean", "indirect_mean", "emitters":
            self.assertAlmostEqual(sun["error"][figure] / same["error"][figure], 1, delta=1e-4, msg=figure)

    def test_refused(self):
        cases = (("few", {"sun": SUN}, "few emitters"), ("dark", {"sun": SUN}, "--sky"),
                 ("city", {"sun": {"azimuth": 1, "altitude": 2}}, "lacks direct"),
                 ("city", {"sun": {**SUN, "altitude": 90.5}}, "from -90 to 90"), ("city", {"sun": {**SUN, "direct": -1}}, "negative"),
                 ("city", {"sun": {**SUN, "direct": [1, 2]}}, "red, green and blue"), ("city", {"sun": 4}, "an object"),
                 ("city", {"sun": {**SUN, "azimuth": "south"}}, "degrees"), ("city", {"sun": {**SUN, "moon": 1}}, "moon"))
        for scene, emission, part in cases:
            answer = self.post(scene, {"emission": emission})
            self.assertEqual(answer.status, 422, (emission, answer.body))
            self.assertIn(part, answer.json()["detail"])
            self.assertIn("/emission/sun", answer.json()["pointer"])
        twice = self.post("city", {"cotangent": {"sun": SUN}, "gradient": ["emission"]}, "adjoint")
        self.assertEqual(twice.status, 422)

    def test_file(self):
        (self.folder / "sun.json").write_text(json.dumps({"emission": {"sun": SUN}}))
        told = lambert("solve", self.folder / "city.h5", "--emission", self.folder / "sun.json", "-o", self.folder / "o.npy")
        self.assertEqual(told.returncode, 1)
        self.assertIn("lambertd answers one", told.stderr)

    def test_variant(self):
        # A variant of other reflectances has the same direct light.
        body = json.dumps({"variant": "dark", "groups": {"floor": .01}})
        put = self.daemon.ask("PUT", "/v1/scenes/cornell/reflectance", body, JSON)
        self.assertEqual(put.status, 202, put.body)
        until = time.monotonic() + PATIENCE
        while self.daemon.ask("GET", "/v1/scenes/cornell@dark", None, JSON).status != 200 and time.monotonic() < until:
            time.sleep(.05)
        direct = [self.values(scene, {"sun": SUN}, "irradiance") - self.values(scene, {"sun": SUN}, "indirect") for scene in
                  ("cornell@dark",)]
        self.assertGreater(np.max(direct[0]), 0)
        self.assertLess(np.sum(self.values("cornell@dark", {"sun": SUN})), np.sum(self.values("cornell", {"sun": SUN})))

    def test_memory(self):
        # Faces are sorted within --max-memory; what does not fit is refused, and the daemon answers on.
        with Daemon(self.folder / "city.h5", "--max-memory", 1600000, "--threads", 1) as small:
            for body, statuses in ({"emission": {"sun": SUN}}, (503,)), ({"emission": {"groups": {"roof": 1}}}, (200,)):
                answer = small.ask("POST", "/v1/scenes/city/radiosity", json.dumps(body), JSON)
                self.assertIn(answer.status, statuses, answer.body)


if __name__ == "__main__":
    unittest.main()
