"""POST /v1/sun: where the sun stands. POST /v1/weather and POST /v1/scenes/NAME/weather: the rows of a weather file, as the daemon
reads it, or the line that is wrong."""

import json
import math
import pathlib
import tempfile
import unittest

import numpy as np

from command import must
from daemon import Daemon
from weather import LATITUDE, LONGITUDE, ZONE, a_year, epw, parts, sun, wea

PLACE = {"latitude": 52.5, "longitude": 13.4, "zone": 1}


class Weather(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-weather-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        must("generate", "box", "--divisions", "1", "-o", cls.folder / "box.obj")
        for name in "box", "bare", "gap":
            must("precompute", cls.folder / "box.obj", "-o", cls.folder / f"{name}.h5", "--sky", "tregenza", "--rays", 16, "--probes", 0,
                 "--quiet")
        cls.year = list(a_year())
        cls.days = [row for row in cls.year if row[:2] in ((6, 20), (6, 21), (6, 22))]
        (cls.folder / "box.epw").write_text(epw(cls.days, periods="6/20,6/22", dew=12.5))
        (cls.folder / "gap.wea").write_text(wea(cls.days[:36] + cls.days[37:]))
        cls.daemon = Daemon("--stores", cls.folder, "--max-request-memory", "200M")
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def ask(self, path, body):
        return self.daemon.post(path, body if isinstance(body, (str, bytes)) else json.dumps(body))

    def read(self, text, **more):
        answer = self.ask("/v1/weather", {"text": text, **more})
        self.assertEqual(answer.status, 200, answer.body[:300])
        return answer.json()

    def rows(self, told, direct="direct"):
        return list(zip(told["month"], told["day"], told["hour"], told[direct], told["diffuse"]))

    def test_positions_of_the_sun(self):
        hours = [0, 1901.5, 4114, 4114.25, 8760]
        told = self.ask("/v1/sun", {"place": PLACE, "hours": hours, "year": 2012}).json()
        for hour, azimuth, altitude in list(zip(hours, told["azimuth"], told["altitude"]))[:4]:
            month, day = ((1, 1), (3, 21), (6, 21))[(hour > 100) + (hour > 2000)]
            east, north, up = sun(2012, month, day, hour % 24, (52.5, 13.4, 1))
            self.assertAlmostEqual(altitude, math.degrees(math.asin(up)), delta=.02)
            self.assertAlmostEqual((azimuth - math.degrees(math.atan2(east, north)) + 180) % 360 - 180, 0, delta=.03)
        self.assertEqual({len(v) for v in told.values()}, {5})
        # That of a sky of the same hour, and the year that is taken where none is given.
        sky = self.ask("/v1/scenes/box/skies", {"sky": {"name": "clear", "place": PLACE, "hour": 4114}}).json()["skies"][0]
        for more in {}, {"year": 2001}:
            told = self.ask("/v1/sun", {"place": PLACE, "hours": [4114], **more}).json()
            self.assertAlmostEqual(told["azimuth"][0], sky["sun"]["azimuth"], delta=2e-5)
            self.assertAlmostEqual(told["altitude"][0], sky["sun"]["altitude"], delta=1e-5)
        self.assertEqual(self.ask("/v1/sun", {"place": PLACE, "hours": []}).json(), {"azimuth": [], "altitude": []})
        self.assertEqual(len(self.ask("/v1/sun", {"place": PLACE, "hours": [1] * 131072}).json()["azimuth"]), 131072)
        for status, body in ((422, {}), (422, {"place": PLACE}), (422, {"hours": [1]}), (422, {"place": PLACE, "hours": [8761]}),
                             (422, {"place": PLACE, "hours": ["noon"]}), (422, {"place": {"latitude": 1}, "hours": []}), (400, "{"),
                             (422, {"place": {**PLACE, "latitude": 91}, "hours": [1]}), (422, {"place": PLACE, "hours": [1] * 131073}),
                             (422, {"place": PLACE, "hours": [1], "year": 2001.5}), (422, {"place": PLACE, "hours": [1], "date": "1 May"})):
            self.assertEqual(self.ask("/v1/sun", body).status, status, str(body)[:200])
        self.assertEqual(self.daemon.get("/v1/sun").status, 405)

    def test_rows_of_both_formats(self):
        for text, form, year in ((wea(self.year), "wea", 2001), (epw(self.year, dew=12.5), "epw", 2001)):
            for given in text, "\ufeff" + text.replace("\n", "\r\n"):
                told = self.read(given)
                self.assertEqual((told["format"], told["latitude"], told["longitude"], told["zone"], told["elevation"], told["step"], told["rows"]),
                                 (form, LATITUDE, LONGITUDE, ZONE, 2, 1, 8760))
                self.assertEqual(told["place"], "Somewhere_XX" if form == "wea" else "Somewhere")
                np.testing.assert_allclose(self.rows(told), self.year, rtol=1e-6)
                self.assertEqual((told["year"][0], len(told["days"]), told["days"][171]), (year, 365, [6, 21]))
                self.assertEqual(set(told["dew_point"]), {None} if form == "wea" else {12.5})
                self.assertNotIn("direct_horizontal", told)
        half = self.read(wea(parts(self.days, 2)))
        self.assertEqual((half["step"], half["rows"], half["hour"][:3], half["days"]), (.5, 144, [.25, .75, 1.25], [[6, 20], [6, 21], [6, 22]]))
        flat = self.read(wea(self.days, units=2))
        self.assertEqual(self.rows(flat, "direct_horizontal"), [tuple(row) for row in self.days])
        self.assertNotIn("direct", flat)

    def test_the_file_beside_a_store(self):
        told = self.ask("/v1/scenes/box/weather", {}).json()
        self.assertEqual(told, self.read(epw(self.days, periods="6/20,6/22", dew=12.5)))
        self.assertEqual(self.daemon.post("/v1/scenes/box/weather", "").json(), told)
        answer = self.ask("/v1/scenes/bare/weather", {})
        self.assertEqual((answer.status, answer.json()["detail"]), (422, "no .epw or .wea file of its name is beside the store"))
        answer = self.ask("/v1/scenes/gap/weather", {"gaps": "refuse"})
        self.assertEqual(answer.status, 422)
        self.assertRegex(answer.json()["detail"], r"^weather.wea: line 43 \(2001-06-21 13:30\): before it 1 hour is missing")
        filled = self.ask("/v1/scenes/gap/weather", {"gaps": "fill"}).json()
        self.assertEqual((filled["rows"], filled["mended"]["filled"]), (72, 1))
        self.assertEqual(self.ask("/v1/scenes/gap/weather", {"gaps": "skip"}).json()["rows"], 71)
        self.assertEqual(self.ask("/v1/scenes/box/weather", {"text": "place"}).status, 422)
        self.assertEqual(self.ask("/v1/scenes/none/weather", {}).status, 404)

    def test_rows_are_skies(self):
        """A row's light at its place and hour gives the sky of `lambert sky`, in both units, of both formats."""
        for name, text in (("a.wea", wea(self.days)), ("flat.wea", wea(self.days, units=2)), ("a.epw", epw(self.days, periods="6/20,6/22", dew=12.5))):
            told = self.read(text)
            (self.folder / name).write_text(text)
            direct = "direct_horizontal" if "direct_horizontal" in told else "direct"
            for photometric in False, True:
                must("sky", self.folder / name, "--tiles", "tregenza", *["--photometric"] * photometric, "-o", self.folder / "sky.npy")
                wanted, lit = np.load(self.folder / "sky.npy"), 0
                for first in range(0, told["rows"], 64):
                    rows = range(first, min(first + 64, told["rows"]))
                    asked = [{direct: told[direct][i], "diffuse": told["diffuse"][i], "year": told["year"][i], "photometric": photometric, "dark": True,
                              "place": {key: told[key] for key in PLACE}, "hour": 24 * (170 + told["day"][i] - 20) + told["hour"][i],
                              **({} if told["dew_point"][i] is None else {"dew_point": told["dew_point"][i]})} for i in rows]
                    skies = self.ask("/v1/scenes/box/skies", {"skies": asked}).json()["skies"]
                    for i, one in zip(rows, skies):
                        # Light facing the sun is at most what reaches the earth; that on the ground is then less than the row's.
                        if direct == "direct_horizontal" and told[direct][i] > 1300 * max(0, math.sin(math.radians(one["sun"]["altitude"]))) > 0:
                            continue
                        np.testing.assert_allclose(one["sky"], wanted[i], rtol=2e-5, err_msg=f"{name}, row {i}")
                        lit += max(one["sky"]) > 0
                self.assertGreater(lit, 15)

    def test_what_is_wrong_is_named_by_its_line(self):
        good = wea(self.days)
        for detail, text in (("weather.wea: line 2: latitude = 375, must be from -90 to 90", good.replace("latitude 37.5", "latitude 375")),
                             ("weather.wea: line 20 must hold five numbers", good.replace("\n6 20 13.500 ", "\n6 20 13.500 x ")),
                             ("weather.wea: no hours", "".join(good.splitlines(True)[:6])),
                             ("weather.wea: ends at line 3", "".join(good.splitlines(True)[:3])),
                             ("weather.epw: line 2 begins with", "LOCATION,a,b,c,d,e,1,2,3,4\nx"),
                             ("weather.wea: line 1 holds a zero byte", "place a\0b\n"),
                             ("neither an EPW nor a WEA", "hours\n"), ("neither an EPW nor a WEA", "\ufeff"),
                             ("gaps must be refuse, fill or skip", None)):
            answer = self.ask("/v1/weather", {"text": good, "gaps": "x"} if text is None else {"text": text})
            with self.subTest(detail=detail):
                self.assertEqual(answer.status, 422, answer.body[:300])
                self.assertIn(detail, answer.json()["detail"])
        for status, body in ((422, {}), (422, {"text": ""}), (422, {"text": 1}), (422, []), (400, "place a"), (400, ""),
                             (422, {"text": good, "scene": "box"}), (400, b'{"text": "place \xff"}')):
            self.assertEqual(self.ask("/v1/weather", body).status, status, str(body)[:80])
        self.assertEqual(self.daemon.post("/v1/weather", good, kind="text/plain").status, 415)
        self.assertEqual(self.daemon.get("/v1/weather").status, 405)

    def test_long_texts(self):
        head, row = wea([]), "1 1 0.5 0 0\n"
        for text in head + row * 1_300_000, head + "\n" * (16 << 20), head + "1" * (15 << 20), head + "1 1 0.5 0 0\n" * 900_000:
            answer = self.ask("/v1/weather", {"text": text})
            self.assertEqual(answer.status, 422, answer.body[:300])
        self.assertEqual(len(self.read(wea(self.days))["days"]), 3)


if __name__ == "__main__":
    unittest.main()
