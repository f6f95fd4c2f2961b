"""The sun itself at sensors: in a sun patch and in shadow, behind a pane, hours by themselves and a year, and hours of direct sun."""
import json
import math
import os
import unittest

import numpy as np

from case import Case
from command import lambert, must
from daemon import Daemon
from quads import Quads
from weather import sun, wea

DIRECT = 800  # W/m2, normal to the sun; there is no diffuse light
DAYS = 14
OPENING = (1, 2, 1, 3)  # in the wall y = 0: z and x from and to
HOURS = [(6, day, hour + .5) for day in range(1, DAYS + 1) for hour in range(24)]


def suns():
    return np.array([sun(2001, month, day, hour) for month, day, hour in HOURS])


class SensorSun(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        dice = np.random.default_rng(3)
        cls.places, cls.normals = [], []
        for _ in range(60):
            cls.places.append([*dice.uniform(.05, 3.95, 2), dice.choice([0, .85])])
            cls.normals.append([0, 0, 1])
        for _ in range(20):
            cls.places.append([dice.uniform(.05, 3.95), 4, dice.uniform(.05, 2.95)])
            cls.normals.append([0, -1, 0])
        cls.places, cls.normals = np.array(cls.places), np.array(cls.normals)
        with open(cls.kept("s.csv"), "w", encoding="ascii") as file:
            file.write("name,x,y,z,nx,ny,nz\n")
            for place, normal in zip(cls.places, cls.normals):
                file.write("all," + ",".join(f"{x:.17g}" for x in (*place, *normal)) + "\n")
        with open(cls.kept("june.wea"), "w", encoding="ascii") as file:
            file.write(wea([(*hour, DIRECT if up[2] > .05 else 0, 0) for hour, up in zip(HOURS, suns())]))
        cls.black = cls.make("black", 0)
        cls.grey = cls.make("grey", .5)
        cls.pane = cls.make("pane", 0, "--glass", "pane=0.5", "--glass-law", "none")

    @classmethod
    def kept(cls, name):
        return os.path.join(cls.shared.name, name)

    @classmethod
    def make(cls, name, reflectance, *options):
        """A room of 4 x 4 x 3 m with an opening in the wall y = 0, or a pane there."""
        room = Quads()
        room.box("wall", (0, 0, 0), (4, 4, 3), (4, 4, 3), holes={2: OPENING})
        if options:
            room.grid("pane", 1, 0, 1, [1, 2], [1, 3])
        room.write(cls.kept(f"{name}.obj"), reflectance)
        must("precompute", cls.kept(f"{name}.obj"), "--mesh", "faces", "--sky", "tregenza", "--sensors", cls.kept("s.csv"), "--method",
             "exact", "--probes", 0, "-o", cls.kept(f"{name}.h5"), *options)
        return cls.kept(f"{name}.h5")

    def hours(self, store, *options):
        must("solve", store, "--weather", self.kept("june.wea"), "--sensors", "all", *options, "-o", self.path("h.npy"))
        return np.load(self.path("h.npy")).astype(float)

    def year(self, store, *figures, more=()):
        asked = [word for figure in figures for word in ("--annual", figure)]
        must("solve", store, "--weather", self.kept("june.wea"), "--sensors", "all", *asked, *more, "-o", self.path("y.npy"))
        return np.load(self.path("y.npy")).astype(float)

    def expected(self, toward=None):
        """E_n cos where a ray passes the opening, [hours][sensors], and where none is near its rim: positions of the sun differ by
        .01 degrees, .7 mm over 4 m."""
        toward, margin = suns() if toward is None else toward, .003
        z0, z1, x0, x1 = OPENING
        with np.errstate(divide="ignore", invalid="ignore"):
            far = -self.places[None, :, 1] / toward[:, 1, None]
            x, z = (self.places[None, :, d] + far * toward[:, d, None] for d in (0, 2))
        inside = np.minimum(np.minimum(x - x0, x1 - x), np.minimum(z - z0, z1 - z))
        lit = (inside > 0) & (toward[:, 1, None] < 0) & (toward[:, 2, None] > .05)
        values = DIRECT * np.maximum(toward @ self.normals.T, 0) * lit
        return values, np.abs(inside) > margin

    def test_patch_and_shadow(self):
        """Sun and shadow of 336 hours at 80 points; the directions of two formulas differ by 1.7e-4, and so do cosines."""
        values, sure = self.expected()
        found = self.hours(self.black)
        self.assertGreater((values[sure] > 0).sum(), 150)
        self.assertGreater((values[sure] == 0).sum(), 300)
        np.testing.assert_allclose(found[sure], values[sure], atol=3e-4 * DIRECT)

    def test_pane(self):
        values, sure = self.expected()
        np.testing.assert_allclose(self.hours(self.pane)[sure], .5 * values[sure], atol=3e-4 * DIRECT)

    def test_bounces_come_beside_it(self):
        """In a grey room points in the patch have its light and bounces, and others bounces alone."""
        direct, bounced = self.hours(self.black), self.hours(self.grey)
        lit = direct.sum(axis=1) > 0
        extra = (bounced - direct)[lit]
        self.assertGreater(extra.min(), 0)
        self.assertLess(extra.max(), .2 * DIRECT)

    def test_year(self):
        """Without bounces a year has the same sun by hours, and where elements have it from its tile: the tile's light at sensors is
        taken away to rounding of its 1e4 W/(m2 sr)."""
        hourly = self.hours(self.black)
        bounds = 100, 500
        for more in (), ("--sun", "exact", "--sun-points", 1):
            total, autonomy, useful, hours, many = self.year(self.black, "sum", "autonomy=100", "useful=100,500", "sun=100", "sun=100,20",
                                                             more=more)
            np.testing.assert_allclose(total, hourly.sum(axis=0) / 1000, atol=1e-4 * total.max())
            np.testing.assert_allclose(autonomy, (hourly >= bounds[0]).mean(axis=0), atol=1e-6)
            np.testing.assert_allclose(useful, ((hourly >= bounds[0]) & (hourly <= bounds[1])).mean(axis=0), atol=1e-6)
            np.testing.assert_array_equal(hours, (hourly > bounds[0]).sum(axis=0))
            np.testing.assert_array_equal(many, hours > 20)
            self.assertTrue(0 < many.mean() < 1)

    def test_ground(self):
        """A ground of .3 in the open lights what looks down by .3 E_h, walls by half and spheres by a half of that; hours of sun leave
        it out. Elements have the same, without weights of their own."""
        faces = Quads()
        faces.grid("far", 2, -50, 1, [90, 91], [90, 91])
        faces.write(self.path("open.obj"), 0)
        rows = {"up": (0, 0, 1), "down": (0, 0, -1), "north": (0, 1, 0)}
        with open(self.path("open.json"), "w", encoding="ascii") as file:
            json.dump({"points": [{"name": name, "at": [[0, 0, 0]], "normal": normal} for name, normal in rows.items()],
                       "spheres": [{"name": "ball", "at": [[0, 0, 0]]}]}, file)
        must("precompute", self.path("open.obj"), "--mesh", "faces", "--sky", "tregenza", "--ground-albedo", .3, "--sensors",
             self.path("open.json"), "--probes", 0, "-o", self.path("open.h5"))
        up, down, north, ball = self.hours(self.path("open.h5")).T
        toward = suns()
        high = toward[:, 2] > .05
        for found, cosine, share in ((up, toward[:, 2], 0), (down, 0, 1), (north, np.maximum(toward[:, 1], 0), .5), (ball, .25, .5)):
            # The share of the ground is that of rays: to 1 % of 1,024 by the weight.
            np.testing.assert_allclose(found[high], DIRECT * (cosine + .3 * share * toward[:, 2])[high],
                                       atol=DIRECT * (3e-4 + .003 * share))
        hours = self.year(self.path("open.h5"), "sun=1")[0]
        self.assertEqual(hours[0], (up > 1).sum())
        self.assertEqual(hours[1], 0)
        for more in (), ("--sun", "exact"):
            total = self.year(self.path("open.h5"), "sum", more=more)[0]
            np.testing.assert_allclose(total, np.array([x.sum() for x in (up, down, north, ball)]) / 1000, rtol=2e-4)

    def test_hours_of_sun_have_no_bounces(self):
        """They are the same in a grey room, on elements too, and --occupied leaves hours out."""
        black, grey = (self.year(store, "sun=1")[0] for store in (self.black, self.grey))
        np.testing.assert_array_equal(black, grey)
        noon = self.year(self.grey, "sun=1", more=("--occupied", "11-13"))[0]
        hourly = self.hours(self.black)
        kept = np.array([11 <= hour < 13 for _, _, hour in HOURS])
        np.testing.assert_array_equal(noon, (hourly[kept] > 1).sum(axis=0))
        must("solve", self.grey, "--weather", self.kept("june.wea"), "--annual", "sun=1", "--annual", "sun=1,20", "--reduce",
             "wall*=mean", "--reduce", "wall*=max", "-o", self.path("e.json"))
        with open(self.path("e.json"), encoding="utf-8") as file:
            of_hours, of_share = (figures["wall*"] for figures in json.load(file)["annual"].values())
        self.assertTrue(20 < of_hours["max"] <= 24 * DAYS and 0 < of_hours["mean"] < of_hours["max"], of_hours)
        self.assertEqual(of_share["max"], 1)
        self.assertTrue(0 < of_share["mean"] < .2, of_share)

    def test_exact_bounces_are_near_those_of_tiles(self):
        """Where --sun exact is given, elements have the sun itself too: bounces of two weeks differ by what a tile of 12 degrees does."""
        direct = self.year(self.black, "sum")[0]
        tiles, exact = (self.year(self.grey, "sum", more=more)[0] - direct for more in ((), ("--sun", "exact")))
        self.assertGreater(tiles.min(), 0)
        self.assertGreater(np.abs(tiles - exact).max(), 1e-3 * exact.mean())
        self.assertLess(np.abs(tiles - exact).max(), .5 * exact.mean())

    def test_named_sky(self):
        """Of one moment: with the sun itself a point in the patch is brighter than the sky and its bounces by E_n cos."""
        options = "--sky", "turbidity:3", "--place", "48,11,1", "--date", "21 Mar 12:00", "--sensors", "all", "--json"
        exact, tiles = (json.loads(must("solve", self.black, *options, *more).stdout)["sensors"][0]["values"]
                        for more in ((), ("--sun", "tiles")))
        up = math.radians(42.1)
        patch = np.array(exact[:60]) > 300
        self.assertTrue(0 < patch.sum() < 30)
        beside = np.array(exact[:60])[patch] - 600.3  # the window's part of 103.5 W/m2 of sky
        self.assertTrue(((beside > 0) & (beside < 103.5)).all(), beside)
        self.assertGreater(np.abs(np.array(exact) - tiles).max(), 100 * math.cos(up))

    def test_daemon(self):
        """The sun of a request comes to sensors as to a named sky of `lambert solve`, by values, figures and to a tolerance."""
        must("precompute", self.kept("grey.obj"), "--sensors", self.kept("s.csv"), "--method", "exact", "--mesh", "faces", "--sky",
             "tregenza", "--probes", 0, "--keep-form-factors", "-o", self.kept("sunny.h5"))
        with Daemon(self.kept("black.h5"), self.kept("sunny.h5")) as daemon:
            for azimuth, altitude in (180, 40), (150, 25), (200, 60), (0, 30):
                lit = {"sun": {"azimuth": azimuth, "altitude": altitude, "direct": DIRECT}}
                body = {"emission": lit, "select": {"sensors": ["all"]}}
                found = np.array(daemon.radiosity("black", body).json()["irradiance"])
                a, h = math.radians(azimuth), math.radians(altitude)
                toward = np.array([math.sin(a) * math.cos(h), math.cos(a) * math.cos(h), math.sin(h)])
                wanted, sure = (of[0] for of in self.expected(toward[None]))
                np.testing.assert_allclose(found[sure], wanted[sure], rtol=1e-5, atol=1e-3)
                grey = np.array(daemon.radiosity("sunny", body).json()["irradiance"])
                self.assertTrue((grey >= found - 1e-3).all())
                reduced = daemon.radiosity("sunny", {"emission": lit, "reduce": {"sensors": ["all"], "with": ["mean", "max"]}}).json()
                self.assertAlmostEqual(reduced["sensors"]["all"]["mean"], grey.mean(), delta=1e-5 * grey.mean())
                self.assertAlmostEqual(reduced["sensors"]["all"]["max"], grey.max(), delta=1e-5 * grey.max())
                refined = daemon.radiosity("sunny", {**body, "tolerance": 1e-6}).json()
                self.assertLessEqual(np.abs(np.array(refined["irradiance"]) - grey).max(), 1e-4 * grey.max())

    def test_refusals(self):
        for wanted, *words in (("must be at least 0", "sun=-1"), ("not numbers", "sun=1,x"), ("hours must be at least 0", "sun=1,-2"),
                               ("--sun exact", "sun=1", "--sun", "tiles"),
                               ("irradiance, not radiosity", "sun=1", "--quantity", "radiosity")):
            done = lambert("solve", self.black, "--weather", self.kept("june.wea"), "--annual", *words)
            self.assertIn(done.returncode, (1, 2))
            self.assertIn(wanted, done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
