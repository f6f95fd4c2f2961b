"""The sun of a weather file in `lambert solve`: in tiles it gives the sky of `lambert sky`; as a disc it casts the
shadows that the geometry determines, at every hour, for either up axis, and its light is reflected."""

import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from weather import a_year, sine_of_altitude, sun, wea

WALL = 3.0  # metres high, along the plane x = 0 from south to north; its front faces east
DAY = [(6, 21, hour + .5, 800, 0) for hour in range(4, 20)] + [(12, 21, hour + .5, 500, 40) for hour in range(6, 18)]
SUNS = np.array([sun(2001, month, day, hour) for month, day, hour, _, _ in DAY])
DIRECT = np.array([direct for *_, direct, _ in DAY]) * (SUNS[:, 2] > 0)


def scene(place):
    """Ground of 64 squares of half a metre, east of a long wall of two strips; place turns (east, north, up)."""
    out, n = ["mtllib yard.mtl", "usemtl paint"], 0

    def quad(*corners):
        nonlocal n
        out.extend("v %.9g %.9g %.9g" % place(*corner) for corner in corners)
        out.append(f"f {n + 1} {n + 2} {n + 3} {n + 4}")
        n += 4

    out.append("o ground")
    for i in range(16):
        for j in range(4):
            x, y = i / 2, j / 2 - 1
            quad((x, y, 0), (x + .5, y, 0), (x + .5, y + .5, 0), (x, y + .5, 0))
    out.append("o wall")
    for k in range(2):
        low, high = WALL * k / 2, WALL * (k + 1) / 2
        quad((0, -60, low), (0, 60, low), (0, 60, high), (0, -60, high))
    return "\n".join(out) + "\n"


def z_up(east, north, up):
    return east, north, up


def y_up(east, north, up):
    return east, up, -north


def lit_ground():
    """[hours][64]: 1 where a square is lit, 0 where it is in the shadow of the wall, NaN between."""
    out = np.empty((len(SUNS), 64))
    for hour, (east, _, up) in enumerate(SUNS):
        for i in range(16):
            ends = np.array([i / 2, i / 2 + .5])
            # Towards a sun in the west a ray passes the wall's plane at this height.
            over = ends * up / -east > WALL if east < 0 and up > 0 else np.array([True, True])
            out[hour, 4 * i:4 * i + 4] = float(over[0]) if over[0] == over[1] else np.nan
    return out


class Sun(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-sun-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        (cls.folder / "zup.obj").write_text(scene(z_up))
        (cls.folder / "yup.obj").write_text(scene(y_up))
        cls.day = cls.folder / "day.wea"
        cls.day.write_text(wea(DAY))
        cls.black = cls.store("black", "zup.obj", "0 0 0", "--method", "exact")
        cls.grey = cls.store("grey", "zup.obj", ".5 .5 .5", "--method", "exact", "--keep-form-factors", "--ground-albedo",
                             .2)
        cls.few = cls.folder / "few.h5"
        must("precompute", cls.grey, "-o", cls.few, "--emitters", "sky", "--probes", 0)

    @classmethod
    def store(cls, name, obj, paint, *options):
        (cls.folder / "yard.mtl").write_text(f"newmtl paint\nKd {paint}\n")
        out = cls.folder / (name + ".h5")
        must("precompute", cls.folder / obj, "-o", out, "--sky", "tregenza", "--rays", 4096, "--probes", 0, *options)
        return out

    def solve(self, store, *options, weather=None, quantity="irradiance"):
        out = self.folder / "out.npy"
        must("solve", store, "--weather", weather or self.day, *options, "--quantity", quantity, "-o", out)
        return np.load(out)

    def check_shadows(self, ground):
        lit = lit_ground()
        sure = ~np.isnan(lit)
        self.assertGreater((lit == 0).sum(), 200)
        self.assertGreater((lit == 1).sum(), 400)
        self.assertGreater((~sure).sum(), 20)
        wanted = lit * (DIRECT * SUNS[:, 2])[:, None]
        # Two hundredths of a degree between the two formulas of the sun.
        np.testing.assert_allclose(ground[sure], wanted[sure], atol=800 * np.radians(.02))
        between = ground[~sure] / np.repeat((DIRECT * SUNS[:, 2])[:, None], 64, axis=1)[~sure]
        self.assertTrue(((between > -1e-6) & (between < 1 + 1e-3)).all())

    def test_shadows_of_a_wall(self):
        dark = [(month, day, hour, direct, 0) for month, day, hour, direct, _ in DAY]
        path = self.folder / "direct.wea"
        path.write_text(wea(dark))
        H = self.solve(self.black, "--sun", "exact", weather=path)
        self.check_shadows(H[:, :64])
        facing = DIRECT * np.maximum(SUNS[:, 0], 0)
        np.testing.assert_allclose(H[:, 64:], np.stack([facing, facing], 1), atol=800 * np.radians(.02))
        # More points find the edges of shadows better: squares between are lit by the share that is.
        fine = self.solve(self.black, "--sun", "exact", "--sun-points", 256, weather=path)[:, :64]
        self.check_shadows(fine)
        for hour, (east, _, up) in enumerate(SUNS):
            if east < 0 and up > .05:
                edge = WALL * -east / up  # of the shadow, metres from the wall
                for i in range(16):
                    share = min(max((i / 2 + .5 - edge) / .5, 0), 1)
                    self.assertAlmostEqual(fine[hour, 4 * i] / (DIRECT[hour] * up), share, delta=.03)
        # Whichever way is up, and with both sides of the faces, of which the wall's other one has the afternoon.
        other = self.store("yup", "yup.obj", "0 0 0", "--method", "exact", "--up", "y")
        turned = self.solve(other, "--sun", "exact", weather=path)
        self.check_shadows(turned[:, :64])
        np.testing.assert_allclose(turned[:, 64:], H[:, 64:], atol=1e-3)
        both = self.solve(self.store("both", "zup.obj", "0 0 0", "--method", "exact", "--two-sided"), "--sun", "exact",
                          weather=path)
        self.assertEqual(both.shape[1], 2 * 66)
        np.testing.assert_allclose(both[:, :66], H, atol=1e-3)
        np.testing.assert_array_equal(both[:, 66:130], 0)  # under the ground
        west = DIRECT * np.maximum(-SUNS[:, 0], 0)
        np.testing.assert_allclose(both[:, 130:], np.stack([west, west], 1), atol=800 * np.radians(.02))

    def first_light(self, store, rho=.5):
        """H0 of every hour, told from radiosity and indirect light; and both."""
        B, indirect = (self.solve(store, "--sun", "exact", quantity=q) for q in ("radiosity", "indirect"))
        return (B - indirect) / rho, B, indirect

    def test_bounces(self):
        H0, B, indirect = self.first_light(self.grey)
        with h5py.File(self.grey) as f:
            F = np.zeros((66, 66))
            ends, columns, values = (f["form_factors/" + name][()] for name in ("indptr", "indices", "data"))
            first_bounce = f["sky/first_bounce"][()].astype(float)
            cosines = f["sky/tiles"][()][:, 8]
        for i in range(66):
            F[i, columns[int(ends[i]):int(ends[i + 1])]] = values[int(ends[i]):int(ends[i + 1])]
        # Direct light: the sun, what the ground sends of it, and in winter the sky.
        lit = lit_ground()
        direct = np.concatenate([lit * (DIRECT * SUNS[:, 2])[:, None],
                                 np.repeat((DIRECT * np.maximum(SUNS[:, 0], 0))[:, None], 2, axis=1)], axis=1)
        ground = np.min(first_bounce / cosines[:, None], axis=0)
        self.assertLess(ground[:64].max(), 1e-6)
        np.testing.assert_allclose(ground[64:], .1, rtol=.5)  # an open wall sees half ground of albedo .2, less what is near
        sun_alone = DIRECT[:16, None] > 0  # of June, when there is no other light
        wanted = direct + ground * (DIRECT * np.maximum(SUNS[:, 2], 0))[:, None]
        sure = ~np.isnan(wanted[:16]) & sun_alone
        np.testing.assert_allclose(H0[:16][sure], wanted[:16][sure], atol=800 * np.radians(.03))
        sure = ~np.isnan(wanted[16:])
        self.assertGreater((H0[16:] - wanted[16:])[sure].min(), -800 * np.radians(.03))  # the sky is beside it
        self.assertGreater((H0[16:] - wanted[16:])[sure].max(), 20)
        # All bounces: the solution of B = rho (H0 + F B).
        np.testing.assert_allclose(B, np.linalg.solve(np.eye(66) - .5 * F, .5 * H0.T).T, atol=2e-5 * B.max())
        np.testing.assert_array_equal(self.solve(self.grey), self.solve(self.grey, "--sun", "exact"))  # which is the preset
        np.testing.assert_allclose(self.solve(self.grey), B / .5, rtol=1e-5, atol=1e-4)
        # Few emitters: direct light exact, bounces those of the tiles.
        few_H0, _, few_indirect = self.first_light(self.few)
        np.testing.assert_allclose(few_H0, H0, atol=2e-5 * H0.max())
        np.testing.assert_array_equal(few_indirect, self.solve(self.few, quantity="indirect"))
        np.testing.assert_allclose(self.solve(self.few, "--sun", "exact"), H0 + few_indirect / .5, atol=2e-5 * H0.max())
        self.assertGreater(np.abs(few_indirect - indirect).max(), .01 * indirect.max())
        said = must("solve", self.few, "--weather", self.day, "--sun", "exact", "-o",
                    self.folder / "few.npy").stderr
        self.assertIn("its reflected light is that of its tile", said)

    def test_tiles_are_those_of_the_sky_verb(self):
        sky, out = self.folder / "day.npy", self.folder / "tiles.npy"
        for more in [], ["--photometric"]:
            must("sky", self.day, "-o", sky, *more)
            must("solve", self.grey, "--sky", sky, "--quantity", "irradiance", "-o", out)
            np.testing.assert_array_equal(np.load(out), self.solve(self.grey, "--sun", "tiles", *more))
        # A store of colours takes the same skies in each.
        colour = self.store("colour", "zup.obj", ".6 .5 .4", "--method", "exact")
        for mode in "tiles", "exact":
            H = self.solve(colour, "--sun", mode, quantity="irradiance")
            self.assertEqual(H.shape, (len(DAY), 3, 66))
            self.assertTrue((H[:, 0] >= H[:, 1] - 1e-3).all() and (H[:, 1] >= H[:, 2] - 1e-3).all())
        # A lamp beside the weather.
        lamp = self.solve(self.grey, "--emit", "wall=7", "--sun", "exact") - self.solve(self.grey, "--sun", "exact")
        must("solve", self.grey, "--emit", "wall=7", "--quantity", "irradiance", "-o", out)
        np.testing.assert_allclose(lamp, np.broadcast_to(np.load(out), lamp.shape), atol=1e-3)

    def test_annual(self):
        # Of fewer tiles than hours each tile is solved once, and each hour's sun beside them.
        tiled = self.folder / "tiled.h5"
        must("precompute", self.folder / "zup.obj", "-o", tiled, "--sky", "grid:2x2", "--rays", 1024, "--probes", 0, "--reflectance", .5)
        for store in self.grey, self.few, tiled:
            for mode in ["tiles"], ["exact", "--sun-points", 4]:
                hourly = self.solve(store, "--sun", *mode).astype(float)
                year = self.solve(store, "--sun", *mode, "--annual", "sum", "--annual", "autonomy=150")
                np.testing.assert_allclose(year[0], hourly.sum(axis=0) / 1000, rtol=1e-5)
                near = (np.abs(hourly - 150) < 1e-3).mean(axis=0)
                self.assertTrue((np.abs(year[1] - (hourly >= 150).mean(axis=0)) <= near + 1e-6).all())
                out = self.folder / "group.csv"
                must("solve", store, "--weather", self.day, "--sun", *mode, "--annual", "sum", "--reduce",
                     "wall=mean,max", "-o", out)
                mean, most = (float(line.split(",")[2]) for line in out.read_text().splitlines()[1:])
                np.testing.assert_allclose([mean, most], [year[0, 64:].mean(), year[0, 64:].max()], rtol=1e-5)

    def test_an_open_square(self):
        """The year of a horizontal plane is the file's to .1 %: the sun's is exact, the sky's has rays' noise."""
        (self.folder / "square.obj").write_text("mtllib yard.mtl\nusemtl paint\no square\nv 0 0 0\nv 2 0 0\nv 2 2 0\n"
                                                "v 0 2 0\nf 1 2 3 4\n")
        store = self.store("square", "square.obj", ".5 .5 .5", "--elements", 4, "--method", "exact")
        hours = list(a_year())
        path = self.folder / "year.wea"
        path.write_text(wea(hours))
        wanted = sum(diffuse + direct * max(0, sine_of_altitude(2001, *when))
                     for *when, direct, diffuse in hours) / 1000
        for mode in "tiles", "exact":
            year = self.solve(store, "--sun", mode, "--annual", "sum", weather=path)
            np.testing.assert_allclose(year.mean(), wanted, rtol=1e-3)

    def test_facades(self):
        """At presets the walls of a cube get sum DNI cos over the year, in six places; formulas of the sun differ by .01 degrees."""
        (self.folder / "yard.mtl").write_text("newmtl paint\nKd 0 0 0\n")
        corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        faces = {"roof": (5, 6, 8, 7), "south": (1, 2, 6, 5), "east": (2, 4, 8, 6), "north": (4, 3, 7, 8), "west": (3, 1, 5, 7)}
        (self.folder / "cube.obj").write_text("mtllib yard.mtl\n" + "".join("v %d %d %d\n" % c for c in corners)
                                              + "".join(f"o {k}\nusemtl paint\nf %d %d %d %d\n" % f for k, f in faces.items()))
        store = self.folder / "cube.h5"
        must("precompute", self.folder / "cube.obj", "-o", store, "--sky", "tregenza")
        normals = np.array([(0, 0, 1), (0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)])
        path, out = self.folder / "place.wea", self.folder / "cube.json"
        # Every third day is chosen, at most half of them: a sum of these days.
        days = [row for row in a_year() if (30 * row[0] + row[1]) % 3 == 0]
        for place in (52.5, 13.4, 1), (-33.9, 151.2, 10), (28.6, 77.2, 5.5), (1.35, 103.8, 8), (69.6, 18.9, 1), (-33.4, -70.7, -4):
            suns = np.array([sun(2001, *row[:3], place) for row in days])
            direct = np.array([row[3] for row in days]) * (suns[:, 2] > 0)
            wanted = direct @ np.maximum(suns @ normals.T, 0) / 1000
            path.write_text(wea([(*row[:3], row[3], 0) for row in days], place[0], -place[1], -15 * place[2]))
            must("solve", store, "--weather", path, "--annual", "sum", *(word for k in faces for word in ("--reduce", k + "=mean")), "-o",
                out)
            got = [json.loads(out.read_text())["annual"]["sum"][k]["mean"] for k in faces]
            np.testing.assert_allclose(got, wanted, rtol=1e-3, atol=.02, err_msg=str(place))
        # The stated error of the sum contains what the sun's way leaves: nothing here, or the tiles' error on the worst wall.
        for side, mode, limits in (("north", "tiles", (.5, 2)), ("south", "tiles", (.5, 2)), ("north", "exact", None)):
            must("solve", store, "--weather", path, "--sun", mode, "--annual", "sum", "--reduce", side + "=mean", "-o", out)
            answer = json.loads(out.read_text())
            off = abs(answer["annual"]["sum"][side]["mean"] / wanted[list(faces).index(side)] - 1)
            stated = answer["error"]["stated"]
            if limits is None:
                self.assertLess(stated, 1e-3)
                continue
            self.assertGreater(off, .01)
            self.assertTrue(limits[0] * off < answer["error"]["parts"]["sun"] < limits[1] * off, (side, off, answer["error"]))
            self.assertGreaterEqual(stated, answer["error"]["parts"]["sun"])

    def test_a_window(self):
        """The power that enters a black room through a window is on its surfaces, hour by hour and in the sum of a year."""
        x, y, z, (a, b, c, d) = 6, 5, 3, (1.5, 4.5, 1, 2.5)

        def south(x0, x1, z0, z1):
            return [(x0, 0, z0), (x0, 0, z1), (x1, 0, z1), (x1, 0, z0)]
        quads = [[(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0)], [(0, y, z), (x, y, z), (x, 0, z), (0, 0, z)],
                 [(x, y, 0), (x, y, z), (0, y, z), (0, y, 0)], [(0, y, 0), (0, y, z), (0, 0, z), (0, 0, 0)],
                 [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)],
                 south(0, x, 0, c), south(0, x, d, z), south(0, a, c, d), south(b, x, c, d)]
        (self.folder / "yard.mtl").write_text("newmtl paint\nKd 0 0 0\n")
        (self.folder / "room.obj").write_text(
            "mtllib yard.mtl\nusemtl paint\n" + "".join("".join("v %g %g %g\n" % p for p in quad) for quad in quads)
            + "".join("f %d %d %d %d\n" % tuple(range(4 * k + 1, 4 * k + 5)) for k in range(len(quads))))
        store = self.folder / "room.h5"
        must("precompute", self.folder / "room.obj", "-o", store, "--sky", "tregenza", "--elements", 1500, "--probes", 0)
        with h5py.File(store) as f:
            area = f["mesh/area"][:]
        rows = [(m, 21, h + .5, 800, 0) for m in (3, 6, 12) for h in range(24)]
        path = self.folder / "noons.wea"
        path.write_text(wea(rows))
        suns = np.array([sun(2001, *row[:3]) for row in rows])
        wanted = 800 * (b - a) * (d - c) * np.maximum(-suns[:, 1], 0) * (suns[:, 2] > 0)
        got = self.solve(store, weather=path) @ area
        bright = wanted > .2 * wanted.max()
        self.assertGreater(bright.sum(), 15)
        np.testing.assert_allclose(got[bright], wanted[bright], rtol=.02)
        self.assertAlmostEqual(float(self.solve(store, "--annual", "sum", weather=path)[0] @ area) / (wanted.sum() / 1000), 1, delta=.01)

    def test_a_polar_year(self):
        """Months without a sun are dark; a file of them alone is refused."""
        hours = [(month, 15, hour + .5, 100 if month == 6 else 0, 30 if month == 6 else 0) for month in (1, 6, 12)
                 for hour in range(24)]
        path = self.folder / "polar.wea"
        path.write_text(wea(hours, latitude=80, longitude=0, zone=0))
        for mode in "tiles", "exact":
            H = self.solve(self.grey, "--sun", mode, weather=path)
            self.assertEqual(H[:24].max(), 0)
            self.assertGreater(H[24:48].min(), 0)
            self.assertEqual(H[48:].max(), 0)
        night = self.folder / "night.wea"
        night.write_text(wea(hours[:24], latitude=80, longitude=0, zone=0))
        self.refused(1, "night.wea: the sky is dark all year: of 24 hours none has diffuse light", self.grey,
                     "--weather", night)

    def refused(self, status, wanted, *arguments):
        done = lambert("solve", *arguments)
        self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
        said = [line for line in done.stderr.splitlines() if line.startswith("lambert") and "warning" not in line]
        self.assertEqual(len(said), 1, done.stderr)
        self.assertIn(wanted, said[0])

    def test_refused(self):
        np.save(self.folder / "sky.npy", np.ones(145))
        np.save(self.folder / "E.npy", np.ones((3, 66)))
        (self.folder / "bad.wea").write_text(wea(DAY) + "6 21 25 1 1\n")
        (self.folder / "one.wea").write_text(wea(DAY[5:6]))
        (self.folder / "yard.mtl").write_text("newmtl paint\nKd .5 .5 .5\n")
        none = self.folder / "none.h5"
        must("precompute", self.folder / "zup.obj", "-o", none, "--probes", 0, "--rays", 64)
        day = ["--weather", self.day]
        self.refused(1, "the store has no sky; precompute it with --sky", none, *day)
        self.refused(1, "the store has no sky; precompute it with --sky", none, *day, "--sun", "exact", "--annual", "sum")
        self.refused(1, f"bad.wea: line {len(DAY) + 7}: hour = 25", self.grey, "--weather", self.folder / "bad.wea")
        self.refused(1, "28 skies beside 3 emissions", self.grey, *day, "--emission", self.folder / "E.npy")
        self.refused(1, "one.wea: 1 hour beside 3 emissions", self.grey, "--weather", self.folder / "one.wea", "--emission",
                     self.folder / "E.npy", "--sun", "exact")
        self.refused(1, "No such file", self.grey, "--weather", self.folder / "absent.wea")
        for wanted, more in (("give --sky or --weather, not both", [*day, "--sky", self.folder / "sky.npy"]),
                             ("must end in .epw or .wea", ["--weather", self.folder / "sky.npy"]),
                             ("--sun is for --weather", ["--sun", "exact"]),
                             ("--photometric is for --weather and --sky", ["--photometric"]),
                             ("--sun-points is for --sun exact", [*day, "--sun", "tiles", "--sun-points", 9]),
                             ("--sun-points", [*day, "--sun", "exact", "--sun-points", 0]),
                             ("--sun", [*day, "--sun", "near"])):
            self.refused(2, wanted, self.grey, *more)


if __name__ == "__main__":
    unittest.main()
