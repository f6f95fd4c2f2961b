"""From a weather file to light on a floor: `lambert sky`, what it writes, what it refuses, and that `lambert solve`
gives a horizontal square under the open sky what the file says."""

import json
import math
import os
import pathlib
import re
import resource
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from weather import LONGITUDE, a_year, epw, parts, sine_of_altitude, wea


class SkyWeather(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.hours = list(a_year())
        cls.wea = cls.write("year.wea", wea(cls.hours))
        cls.horizontal = np.array([diffuse + direct * max(0, sine_of_altitude(2001, month, day, hour))
                                   for month, day, hour, direct, diffuse in cls.hours])
        # A square of four under the open sky: nothing else is there.
        cls.write("square.obj", "mtllib square.mtl\no square\nusemtl grey\n"
                                "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n")
        cls.write("square.mtl", "newmtl grey\nKd 0.5 0.5 0.5\n")
        cls.store = cls.folder / "square.h5"
        must("precompute", cls.folder / "square.obj", "-o", cls.store, "--elements", 4, "--sky", "tregenza",
             "--method", "exact", "--probes", 0, "--quality", "high")

        # A black cube in the open.
        cls.write("cube.obj", "mtllib cube.mtl\no cube\nusemtl black\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\n"
                  "v 0 1 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n")
        cls.write("cube.mtl", "newmtl black\nKd 0 0 0\n")
        cls.yard = cls.folder / "cube.h5"
        must("precompute", cls.folder / "cube.obj", "-o", cls.yard, "--mesh", "faces", "--sky", "tregenza", "--method", "exact",
            "--probes", 0)

    @classmethod
    def write(cls, name, text):
        path = cls.folder / name
        path.write_text(text)
        return path

    def sky(self, weather, *options):
        out = self.folder / "sky.npy"
        done = must("sky", weather, "-o", out, *options)
        return np.load(out), done

    def refused(self, status, wanted, *arguments):
        before = sorted(os.listdir(self.folder))
        done = lambert("sky", *arguments)
        self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("lambert sky: "), done.stderr)
        self.assertIn(wanted, done.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), before)

    def cosines(self):
        with h5py.File(self.store) as f:
            return f["sky/tiles"][:, 8]

    def test_a_year(self):
        skies, done = self.sky(self.wea)
        self.assertEqual((skies.dtype, skies.shape), (np.dtype("<f4"), (8760, 145)))
        self.assertGreaterEqual(skies.min(), 0)
        got = skies.astype(float) @ self.cosines()
        # Hour by hour: single precision, and two hundredths of a degree of a sun of 950 W/m2.
        np.testing.assert_allclose(got, self.horizontal, rtol=1e-6, atol=950 * math.radians(.02))
        self.assertEqual(((got > 0) != (self.horizontal > 0)).sum(), 0)
        said = re.search(r"diffuse ([\d.]+) \+ direct ([\d.]+) = ([\d.]+) kWh/m2", done.stderr)
        self.assertAlmostEqual(float(said[1]), sum(h[4] for h in self.hours) / 1000, delta=.06)
        self.assertAlmostEqual(float(said[3]), got.sum() / 1000, delta=.06)
        self.assertIn("Somewhere_XX: 37.50 degrees north, 122.25 west, UTC-8", done.stderr)
        self.assertIn(f"{(self.horizontal > 0).sum()} hours with light", done.stderr)
        self.assertNotIn("warning", done.stderr)
        self.assertEqual(done.stdout, f"{self.folder / 'sky.npy'}: 8760 skies of 145 tiles (tregenza), W/(m2 sr)\n")

    def test_epw_says_the_same(self):
        from_wea, _ = self.sky(self.wea)
        from_epw, done = self.sky(self.write("year.epw", epw(self.hours)))
        np.testing.assert_array_equal(from_epw, from_wea)
        self.assertIn("Somewhere: 37.50 degrees north, 122.25 west, UTC-8", done.stderr)

    def test_horizontal_direct_light(self):
        day = [h for h in self.hours if h[:2] == (6, 21)]
        flat = [(*when, direct * max(0, sine_of_altitude(2001, *when)), diffuse) for *when, direct, diffuse in day]
        a, _ = self.sky(self.write("normal.wea", wea(day)))
        b, _ = self.sky(self.write("flat.wea", wea(flat, units=2)))
        np.testing.assert_allclose(b @ self.cosines(), a @ self.cosines(), rtol=1e-6, atol=950 * math.radians(.02))

    def test_tiles(self):
        day = self.write("day.wea", wea([h for h in self.hours if h[:2] in ((3, 20), (6, 21))]))
        for name, count in ("reinhart:1", 145), ("reinhart:3", 1297), ("grid:12x11", 132), ("grid:1x1", 1):
            skies, done = self.sky(day, "--tiles", name)
            self.assertEqual(skies.shape, (48, count))
            self.assertIn(f"{count} tiles ({name})", done.stdout)
        np.testing.assert_allclose(skies[:, 0] * np.pi, self.sky(day)[0] @ self.cosines(), rtol=1e-5)

    def test_the_sun_goes_from_east_to_west(self):
        day = [(6, 21, h + .5, 800 if 6 <= h <= 17 else 0, 60 if 6 <= h <= 17 else 0) for h in range(24)]
        skies, _ = self.sky(self.write("clear.wea", wea(day)), "--model", "perez")
        with h5py.File(self.store) as f:
            centres = f["sky/tiles"][:, :3]
        for hour, (east, up) in {7: (1, .48), 12: (0, .95), 16: (-1, .5)}.items():
            x, y, z = centres[skies[hour].argmax()]
            self.assertTrue(x * east >= 0 and abs(z - up) < .15, (hour, x, y, z))
            if east:
                self.assertGreater(abs(x), .4)
        self.assertLess(centres[skies[11].argmax(), 1], .1)  # noon is in the south

    def test_end_to_end(self):
        sky = self.folder / "end.npy"
        must("sky", self.wea, "-o", sky)
        out = self.folder / "light.npy"
        must("solve", self.store, "--sky", sky, "--quantity", "irradiance", "-o", out)
        light = np.load(out)
        self.assertEqual(light.shape, (8760, 4))
        # Measured to the noise of the form factors with tiles.
        self.assertAlmostEqual(light.mean(axis=1).sum() / self.horizontal.sum(), 1, delta=.03)
        direct = self.folder / "direct.npy"
        must("solve", self.store, "--sky", self.wea, "--sun", "tiles", "--quantity", "irradiance", "-o", direct)
        np.testing.assert_array_equal(np.load(direct), light)

    def test_rows_of_parts_of_an_hour(self):
        """Each row has its own sun, and counts by its duration: sums are the integral of the file's light over its times."""
        day = [h for h in self.hours if h[:2] == (6, 21)]
        for n in 2, 4, 12:
            rows = parts(day, n)
            wanted = np.array([diffuse + direct * max(0, sine_of_altitude(2001, *when)) for *when, direct, diffuse in rows])
            from_wea, done = self.sky(self.write("parts.wea", wea(rows)))
            # Three decimals of an hour are half a thousandth of it, in which the sun turns by .0075 degrees.
            atol = 950 * math.radians(.02 + .0075)
            np.testing.assert_allclose(from_wea @ self.cosines(), wanted, rtol=1e-6, atol=atol)
            self.assertIn(f"24 hours in {24 * n} rows of {1 / n:.4g} h, 2001-06-21 to 2001-06-21\n", done.stderr)
            self.assertIn(f"{(wanted > 0).sum() / n:.6g} hours with light", done.stderr)
            self.assertIn(f"need --hours-per-vector {1 / n:.10g}\n", done.stderr)
            said = re.search(r"diffuse ([\d.]+) \+ direct ([\d.]+) = ([\d.]+) kWh/m2", done.stderr)
            self.assertAlmostEqual(float(said[1]), sum(h[4] for h in day) / 1000, delta=.06)
            self.assertAlmostEqual(float(said[3]), wanted.sum() / n / 1000, delta=.06)
            for stated in 1, n:
                from_epw, done = self.sky(self.write("parts.epw", epw(rows, step=1 / n, periods="6/21,6/21", stated=stated)))
                np.testing.assert_allclose(from_epw @ self.cosines(), wanted, rtol=1e-6, atol=atol)
                self.assertEqual("warning: DATA PERIODS states 1 record an hour, but rows are" in done.stderr, stated == 1)

    def test_the_same_days_by_four_steps(self):
        """One light by a formula, in rows of 10, 15, 30 and 60 minutes: sums on a horizontal square agree within .1 %.

        A wall has the light of one sun at the middle of a row, also where the sun goes round its edge meanwhile: that is off by up to a
        fortieth of an hour of light a day, .4 % here."""
        sums = {}
        for n in 1, 2, 4, 6:
            rows = []
            for month in 3, 6, 9, 12:
                for k in range(24 * n):
                    hour = round((k + .5) / n, 3)
                    up = max(0, sine_of_altitude(2001, month, 21, hour))
                    # Smooth to the horizon, as the midpoint rule wants it.
                    rows.append((month, 21, hour, round(900 * math.exp(-.25 / up), 3) if up > 0 else 0, round(120 * up, 3)))
            light = self.folder / "steps.json"
            must("solve", self.yard, "--weather", self.write("steps.wea", wea(rows)), "--sun", "exact", "--sun-points", 1, "--annual",
                 "sum", "-o", light)
            sums[n] = np.array(json.loads(light.read_text())["annual"]["sum"])
        for n in 1, 2, 4:
            np.testing.assert_allclose(sums[n][0], sums[6][0], rtol=1e-3, err_msg=f"{60 // n} minutes")
            np.testing.assert_allclose(sums[n], sums[6], rtol=5e-3, err_msg=f"{60 // n} minutes")

    def test_rows_that_are_missing_or_repeated(self):
        out, hours = self.folder / "none.npy", self.hours[24 * 170:24 * 173]  # 20 to 22 June
        for name, text, wanted in (
                ("day.epw", epw(hours[:24] + hours[48:], periods="6/20,6/22"),
                 "line 33 (2001-06-22 00:00): before it 24 hours are missing"),
                ("end.epw", epw(hours[:48], periods="6/20,6/22"), "line 8 states 6/20 to 6/22, but rows are from line 9"),
                ("twice.epw", epw(hours[:24] + hours, periods="6/20,6/22"),
                 "line 33 (2001-06-20 00:00) has the time of line 9: 24 hours are there twice"),
                ("day.wea", wea(hours[:24] + hours[48:]), "line 31 (2001-06-22 00:30): before it 24 hours are missing"),
                ("order.wea", wea(hours[24:48] + hours[:24] + hours[48:]),
                 "line 31 (2001-06-20 00:30) is before the row above it: 24 hours are out of order"),
                ("mixed.wea", wea(hours[:24] + parts(hours[24:48], 2)), "but most rows are 0.5 h apart")):
            self.refused(1, wanted, self.write(name, text), "-o", out)

    def test_gaps(self):
        """Values that cannot matter pass with a line; the rest is filled or left out on request, and both are counted."""
        days = [h for h in self.hours if h[:2] in ((6, 20), (6, 21), (6, 22))]
        text = epw(days, dew=999, periods="6/20,6/22").splitlines(keepends=True)
        whole = self.sky(self.write("whole.epw", "".join(text)))[0]
        night = list(text)
        night[10], night[11] = night[10].replace(",0,0,0,0,0,0\n", ",9999,9999,0,0,0,0\n"), text[11].replace(
            ",0,0,0,0,0,0\n", ",0,-1,0,0,0,0\n")
        skies, done = self.sky(self.write("night.epw", "".join(night)))
        np.testing.assert_array_equal(skies, whole)
        self.assertIn("values that count as 0: 3, of which 2 are missing by night, 1 from -10 to 0 W/m2\n", done.stderr)
        self.assertNotIn("dew point", done.stderr)
        self.assertIn("rows without a dew point: 72; the air holds 2 cm of water there\n",
                      self.sky(self.folder / "night.epw", "--photometric")[1].stderr)
        noon = list(text)
        noon[8 + 36] = re.sub(r",(\d+),(\d+),0,0,0,0$", r",9999,\2,0,0,0,0", noon[8 + 36])
        path, out = self.write("noon.epw", "".join(noon)), self.folder / "none.npy"
        self.refused(1, "noon.epw: line 45 (2001-06-21 12:00): direct normal radiation (field 15) is missing by day; fill the gap, "
                     "or give --gaps fill or --gaps skip", path, "-o", out)
        skies, done = self.sky(path, "--gaps", "skip")
        np.testing.assert_array_equal(skies, np.delete(whole, 36, axis=0))
        self.assertIn("warning: 1 hours are left out: sums lack them", done.stderr)
        skies, done = self.sky(path, "--gaps", "fill")
        np.testing.assert_array_equal(np.delete(skies, 36, axis=0), np.delete(whole, 36, axis=0))
        direct = [h[3] for h in days]
        sun = sine_of_altitude(2001, 6, 21, 12.5)
        # The file's diffuse light, and direct light between that of the rows beside it; the sun's place is good to .02 degrees.
        self.assertAlmostEqual(float(skies[36] @ self.cosines()), days[36][4] + sun * (direct[35] + direct[37]) / 2, delta=1)
        self.assertIn("warning: 0.5 hours are filled: 0.5 from the rows beside the gap, 0 from the same time", done.stderr)
        again = text[:8] + text[32:56] + text[8:] + text[32:56]
        path = self.write("again.epw", "".join(again))
        self.refused(1, "line 33 (2001-06-20 00:00) is before the row above it", path, "-o", out)
        for gaps in "fill", "skip":
            skies, done = self.sky(path, "--gaps", gaps)
            np.testing.assert_array_equal(skies, whole)
            self.assertIn("warning: 48 repeated rows are dropped, of each time the later ones of the file\n", done.stderr)
        self.refused(2, "--gaps", path, "-o", out, "--gaps", "guess")

    def test_gaps_in_figures(self):
        """Sums and shares are of the hours that are there; a day that is filled is the mean of its neighbours."""
        days = [h for h in self.hours if h[:2] in ((6, 20), (6, 21), (6, 22))]
        light = [self.horizontal[24 * 170 + 24 * k:][:24] for k in range(3)]
        path = self.write("lacks.epw", epw(days[:24] + days[48:], periods="6/20,6/22"))

        def figures(gaps):
            done = must("solve", self.store, "--weather", path, "--gaps", gaps, "--annual", "sum", "--annual", "autonomy=100", "--json")
            answer = json.loads(done.stdout)
            return answer["hours"], *(answer["annual"][name]["square"]["mean"] for name in ("sum", "autonomy_100"))
        wanted = {"skip": (light[0].sum() + light[2].sum(), np.mean(np.concatenate([light[0], light[2]]) >= 100)),
                  "fill": (1.5 * (light[0].sum() + light[2].sum()), None)}
        for gaps, (total, share) in wanted.items():
            hours, got, bright = figures(gaps)
            self.assertEqual(hours, {"counted": 48 if gaps == "skip" else 72, "left_out": 24 if gaps == "skip" else 0,
                                     "filled": 0 if gaps == "skip" else 24})
            # Noise of the first light of tiles, and the sun of 21 June in place of those beside it.
            self.assertAlmostEqual(got / (total / 1000), 1, delta=.03, msg=gaps)
            if share is not None:
                self.assertAlmostEqual(bright, share, delta=1e-6)
        done = lambert("solve", self.store, "--gaps", "skip")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("--gaps is for --weather", done.stderr)

    def test_photometric(self):
        skies, _ = self.sky(self.wea)
        light, done = self.sky(self.wea, "--photometric")
        self.assertIn("cd/m2", done.stdout)
        ratio = (light @ self.cosines()).sum() / (skies @ self.cosines()).sum()
        self.assertTrue(90 < ratio < 130, ratio)
        self.assertAlmostEqual(float(re.search(r"([\d.]+) lm/W", done.stderr)[1]), ratio, delta=.1)
        self.assertEqual(((light > 0) & (skies == 0)).sum(), 0)
        # Dew: dry air and wet air give another light; unknown is 2 cm of water, a dew point of 10.97 degrees.
        text = {dew: self.write(f"dew{dew}.epw", epw(self.hours, dew)) for dew in (99.9, 10.9735, 24, -20)}
        lights = {dew: self.sky(path, "--photometric")[0] for dew, path in text.items()}
        np.testing.assert_array_equal(lights[99.9], light)
        np.testing.assert_allclose(lights[10.9735], light, rtol=1e-4)
        self.assertGreater(np.abs(lights[24] - light).max(), .01 * light.max())
        np.testing.assert_array_equal(self.sky(text[24])[0], skies)  # radiation asks for no dew point

    def test_sun_below_the_horizon(self):
        path = self.write("late.wea", wea([(6, 21, 12.5, 800, 100), (6, 21, 22.5, 30, 0), (6, 21, 23.5, 50, 5)]))
        skies, done = self.sky(path)
        self.assertEqual(skies[1].max(), 0)
        self.assertAlmostEqual(float(skies[2] @ self.cosines()), 5, delta=1e-4)
        self.assertIn("lambert sky: warning: 2 hours have direct light (at most 50 W/m2) though the sun is below the "
                      "horizon", done.stderr)

    def test_polar(self):
        night = [(12, d, h + .5, 100 if d == 5 else 0, 0) for d in range(1, 21) for h in range(24)]
        path = self.write("night.wea", wea(night, latitude=80, longitude=0, zone=0))
        self.refused(1, "night.wea: the sky is dark all year: of 480 hours none has diffuse light", path, "-o",
                     self.folder / "night.npy")
        dusk = self.write("dusk.wea", wea([(*row[:4], int(row[:3] == (12, 20, 12.5))) for row in night], latitude=80, longitude=0, zone=0))
        skies, _ = self.sky(dusk)
        self.assertEqual((skies.max(axis=1) > 0).sum(), 1)

    def test_a_sign_wrong(self):
        _, done = self.sky(self.write("sign.wea", wea(self.hours[3600:3700], longitude=LONGITUDE)))
        self.assertRegex(done.stderr, r"warning: the time zone UTC-8 is 118 degrees from the longitude 122\.25 .*sign")

    def test_wrong_usage(self):
        out = self.folder / "none.npy"
        for wanted, arguments in (
                ("too few arguments", ["-o", out]), ("no -o", [self.wea]),
                ("must end in .epw or .wea", [self.folder / "square.obj", "-o", out]),
                ("must end in .npy", [self.wea, "-o", self.folder / "none.h5"]),
                ("--tiles none: must be tregenza, reinhart:MF or grid:AxB", [self.wea, "-o", out, "--tiles", "none"]),
                ("from 1 to 16", [self.wea, "-o", out, "--tiles", "reinhart:17"]),
                ("--tiles grid:12: must be grid:AxB", [self.wea, "-o", out, "--tiles", "grid:12"]),
                ("--model", [self.wea, "-o", out, "--model", "cie"])):
            self.refused(2, wanted, *arguments)
        text = must("sky", "--help").stdout
        for option in "output tiles model photometric".split():
            self.assertRegex(text, r"--" + option + r"\b")

    def test_wrong_files(self):
        out = self.folder / "none.npy"
        good = wea(self.hours[:30]).splitlines(keepends=True)
        for name, text, wanted in (
                ("row.wea", "".join(good[:20]) + "1 1 4.5 0\n", "row.wea: line 21 must hold five numbers"),
                ("value.wea", "".join(good[:20]) + "1 1 4.5 0 -11\n", "line 21: diffuse horizontal radiation = -11"),
                ("head.wea", "".join(good[1:]), "head.wea: line 1 begins with"),
                ("month.wea", "".join(good[:6]) + "0 1 4.5 0 0\n", "line 7: month = 0, must be from 1 to 12"),
                ("large.epw", epw(self.hours[:30]).replace(",0,0,0,0,0,0\n", ",9998,0,0,0,0,0\n", 1),
                 "large.epw: line 9: direct normal radiation (field 15) = 9998, must be from 0 to 3000"),
                ("empty.epw", "", "empty.epw: ends at line 0"),
                ("wea.epw", "".join(good), "an EPW has LOCATION there"),
                ("binary.wea", "\0\1\2", "zero byte")):
            path = self.write(name, text)
            self.refused(1, wanted, path, "-o", out)
        self.refused(1, "No such file", self.folder / "absent.wea", "-o", out)
        self.refused(1, "cannot be written", self.wea, "-o", self.folder / "no" / "where.npy")
        (self.folder / "folder.wea").mkdir(exist_ok=True)
        self.refused(1, "not a file", self.folder / "folder.wea", "-o", out)

    def test_a_full_disk(self):
        done = lambert("sky", self.wea, "-o", self.folder / "full.npy",
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000)))
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("full.npy: cannot be written whole", done.stderr.splitlines()[-1])
        self.assertEqual([name for name in os.listdir(self.folder) if "full" in name], [])


if __name__ == "__main__":
    unittest.main()
