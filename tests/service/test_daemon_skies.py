"""POST /v1/scenes/NAME/skies: the radiances of skies by name, of direct and diffuse light, and of a moment of weather, which are those
of `lambert sky`; and the answers that they give."""

import json
import math
import pathlib
import tempfile
import unittest

import numpy as np

from command import must
from daemon import Daemon
from make_store import Scene
from weather import a_year, epw, sun, wea

PLACE = {"latitude": 52.5, "longitude": 13.4, "zone": 1}
WHERE = ["--place", "52.5,13.4,1"]


class Skies(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-skies-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        must("generate", "box", "--divisions", "1", "-o", cls.folder / "box.obj")
        for name, up in ("box", "z"), ("other", "y"):
            must("precompute", cls.folder / "box.obj", "-o", cls.folder / f"{name}.h5", "--up", up, "--sky", "tregenza", "--rays", 64,
                 "--probes", 0, "--quiet")
        must("precompute", cls.folder / "box.obj", "-o", cls.folder / "turned.h5", "--sky", "tregenza", "--rays", 64, "--probes", 0,
             "--quiet", "--north", 40)
        Scene(60).write(cls.folder / "plain.h5", "plain")
        cls.days = [row for row in a_year() if row[:2] in ((6, 20), (6, 21), (6, 22))]
        (cls.folder / "box.wea").write_text(wea(cls.days))
        lacks = epw(cls.days[:36] + cls.days[37:], periods="6/20,6/22")
        (cls.folder / "other.epw").write_text(lacks)
        cls.daemon = Daemon("--stores", cls.folder)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def ask(self, body, scene="box", headers=None):
        text = body if isinstance(body, str) else json.dumps(body)
        return self.daemon.ask("POST", f"/v1/scenes/{scene}/skies", text, {"Content-Type": "application/json", **(headers or {})})

    def skies(self, body, scene="box"):
        answer = self.ask(body, scene)
        self.assertEqual(answer.status, 200, answer.body)
        told = answer.json()
        self.assertEqual((told["scene"], told["tiles"]), (scene, 145))
        return told["skies"]

    def by_program(self, *options):
        must("sky", *options, "-o", self.folder / "sky.npy")
        return np.load(self.folder / "sky.npy")

    def test_names(self):
        day = {"place": PLACE, "date": "21 Jun 9:00"}
        cases = (("overcast", ["overcast"], "lx"), ({"name": "even", "lux_outside": 500}, ["even", "--lux-outside", 500], "lx"),
                 ({"name": "clear", **day}, ["clear", *WHERE, "--date", "21 Jun 9:00"], "W/m2"),
                 ({"name": "turbidity:4", "place": PLACE, "hour": 4114, "photometric": True, "north": 30},
                  ["turbidity:4", *WHERE, "--hour", 4114, "--photometric", "--north", 30], "lx"))
        told = self.skies({"skies": [body for body, _, _ in cases]})
        for one, (body, options, unit) in zip(told, cases):
            np.testing.assert_array_equal(np.float32(one["sky"]), self.by_program(*options)[0])
            self.assertEqual(one["unit"], unit)
            self.assertEqual(self.skies({"sky": body}), [one])
        self.assertEqual((told[0]["diffuse"], told[0]["direct"], told[0]["sun"]), (10000, 0, None))
        at = sun(2001, 6, 21, 9, (52.5, 13.4, 1))
        np.testing.assert_allclose(told[2]["sun"]["direction"], at, atol=4e-4)
        self.assertAlmostEqual(told[2]["sun"]["altitude"], math.degrees(math.asin(at[2])), delta=.02)
        self.assertAlmostEqual(told[2]["sun"]["normal"] * at[2], told[2]["direct"], delta=.1)
        # Without the sun in its tile, which is then left to the client.
        alone = self.skies({"sky": {"name": "clear", **day, "sun_in_tiles": False}})[0]
        self.assertEqual(alone["sun"], told[2]["sun"])
        self.assertEqual(sum(a != b for a, b in zip(alone["sky"], told[2]["sky"])), 1)
        # A store's own north, unless a request has one.
        for scene, north, wanted in (("turned", {}, 40), ("turned", {"north": 10}, 10), ("turned", {"north": 0}, 0),
                                     ("box", {"north": 40}, 40)):
            got = self.skies({"sky": {"name": "clear", **day, **north}}, scene)[0]
            self.assertEqual(got["north"], wanted)
            np.testing.assert_array_equal(np.float32(got["sky"]), self.by_program("clear", *WHERE, "--date", "21 Jun 9:00", "--north",
                wanted)[0])
        # Where y is up, the sun stands in the axes of that scene.
        np.testing.assert_allclose(self.skies({"sky": {"name": "clear", **day}}, "other")[0]["sun"]["direction"], [at[0], at[2], -at[1]],
            atol=4e-4)

    def test_light_that_is_stated(self):
        told = self.skies({"skies": [{"direct": 800, "diffuse": 100, "sun": {"azimuth": 180, "altitude": 30}},
                                     {"diffuse": 100, "sun": {"azimuth": 0, "altitude": -3}},
                                     {"direct": 800, "diffuse": 100, "place": PLACE, "date": "21 Jun 12:00", "lux_outside": 7}]})
        self.assertAlmostEqual(told[0]["direct"], 400, delta=1e-6)
        self.assertAlmostEqual(told[0]["diffuse"], 100, delta=1e-6)
        cosine = np.array(self.daemon.get("/v1/scenes/box/sky").json()["cosine"])
        self.assertAlmostEqual(float(np.dot(told[0]["sky"], cosine)), 500, delta=1e-3)
        self.assertEqual((told[1]["direct"], told[1]["unit"]), (0, "W/m2"))
        self.assertAlmostEqual(told[2]["direct"] + told[2]["diffuse"], 7, delta=1e-6)
        # They are the sky of an emission.
        answer = self.daemon.radiosity("box", {"emissions": [{"sky": one["sky"]} for one in told]})
        self.assertEqual(answer.status, 200)

    def test_the_sun_apart(self):
        cosine = np.array(self.daemon.get("/v1/scenes/box/sky").json()["cosine"])
        given = {"direct": 800, "diffuse": 100, "sun": {"azimuth": 190, "altitude": 33}}
        whole, alone, spread, apart = self.skies({"skies": [given, {**given, "sun_in_tiles": False}, {**given, "sun_spread": True},
                                                            {**given, "sun_spread": True, "sun_in_tiles": False}]})
        for with_sun, without in ((whole, alone), (spread, apart)):
            tiles, radiance = without["sun"]["tiles"], np.array(without["sun"]["radiance"])
            self.assertEqual((with_sun["sun"]["tiles"], with_sun["sun"]["radiance"]), (tiles, list(radiance)))
            sky = np.array(without["sky"])
            sky[tiles] += radiance
            np.testing.assert_allclose(sky, with_sun["sky"], rtol=1e-6)
            self.assertAlmostEqual(float(radiance @ cosine[tiles]), whole["direct"], delta=1e-4 * whole["direct"])
        self.assertEqual(alone["sky"], apart["sky"])
        self.assertEqual(len(alone["sun"]["tiles"]), 1)
        self.assertIn(alone["sun"]["tiles"][0], apart["sun"]["tiles"])
        self.assertGreater(len(apart["sun"]["tiles"]), 3)
        # Figures of Perez, eq. 1 and 2.
        cube = 1.041 * math.radians(57) ** 3
        self.assertAlmostEqual(whole["clearness"], (9 + cube) / (1 + cube), delta=1e-9)
        self.assertTrue(.05 < whole["brightness"] < .3)
        blue, plain = self.skies({"skies": [{**given, "diffuse": 0}, "even"]})
        self.assertEqual((blue["clearness"], plain["clearness"], plain["brightness"]), (None, None, None))
        self.assertGreater(blue["brightness"], 0)
        # Light on a horizontal plane is that over the sine of the altitude, within what reaches the earth.
        flat, low = self.skies({"skies": [{"diffuse": 100, "direct_horizontal": 300, "sun": given["sun"]},
                                          {"diffuse": 100, "direct_horizontal": 300, "sun": {"azimuth": 0, "altitude": 1}}]})
        self.assertAlmostEqual(flat["direct"], 300, delta=1e-9 * 300)
        self.assertAlmostEqual(low["sun"]["normal"], 1367, delta=1e-6)

    def test_dark_skies_are_answered_where_they_may_be(self):
        night = {"place": PLACE, "date": "21 Jun 0:30", "dark": True}
        told = self.skies({"skies": [{"name": "clear", **night}, {"name": "turbidity:3", **night}, {"diffuse": 0, "direct": 700, **night},
                                     {"weather": True, "date": "21 Jun 1:30", "dark": True}, {"name": "clear", **night, "date": "21 Jun 12:00"}]})
        for one in told[:4]:
            self.assertEqual((max(one["sky"]), one["diffuse"], one["direct"], one["sun"]["normal"], one["sun"]["tiles"]), (0, 0, 0, 0, []))
            self.assertLess(one["sun"]["altitude"], 0)
        self.assertGreater(told[4]["direct"], 500)
        del night["dark"]
        self.assertEqual(self.ask({"skies": ["even", {"name": "clear", **night}]}).status, 422)

    def test_the_year_of_the_sun(self):
        for year in (1999, 2040):
            one = self.skies({"sky": {"name": "clear", "place": PLACE, "year": year, "date": "21 Mar 9:00"}})[0]
            np.testing.assert_allclose(one["sun"]["direction"], sun(year, 3, 21, 9, (52.5, 13.4, 1)), atol=3e-4)
        # Equinoxes wander by a quarter of a day each year: .25 * .4 degrees.
        a, b = self.skies({"skies": [{"name": "clear", "place": PLACE, "year": y, "date": "21 Mar 12:00"} for y in (2000, 2003)]})
        self.assertTrue(.2 < a["sun"]["altitude"] - b["sun"]["altitude"] < .4)

    def test_weather(self):
        every = self.by_program(self.folder / "box.wea")
        told = self.skies({"skies": [{"weather": True, "date": f"21 Jun {hour}:30"} for hour in (8, 12, 17)]})
        for one, hour in zip(told, (8, 12, 17)):
            np.testing.assert_allclose(np.float32(one["sky"]), every[24 + hour], rtol=1e-6)
        path = self.folder / "other.epw"
        answer = self.ask({"sky": {"weather": True, "date": "21 Jun 12:00"}}, "other")
        self.assertEqual(answer.status, 422)
        self.assertIn("sky 0: weather.epw: line 45 (2001-06-21 13:00): before it 1 hour is missing", answer.json()["detail"])
        filled = self.skies({"sky": {"weather": True, "date": "21 Jun 12:00", "gaps": "fill"}}, "other")[0]
        np.testing.assert_allclose(np.float32(filled["sky"]), self.by_program(path, "--gaps", "fill", "--date", "21 Jun 12:00")[0],
            rtol=1e-6)
        self.assertEqual(self.ask({"sky": {"weather": True, "date": "21 Jun 12:00", "gaps": "skip"}}, "other").status, 422)

    def test_refused(self):
        noon = {"date": "21 Jun 12:00"}
        for wanted, sky in (
                ("no such sky", "cloudy"),
                ("turbidity must be", "turbidity:99"),
                ("needs its sun", "clear"),
                ("must be a name or an object", 7),
                ("one of name, diffuse, and weather", {}),
                ("one of name, diffuse, and weather", {"weather": False}),
                ("one of name, diffuse, and weather", {"name": "even", "diffuse": 1}),
                ("sky/place lacks zone", {"name": "clear", "place": {"latitude": 1, "longitude": 2}}),
                ("needs a date", {"name": "clear", "place": PLACE}),
                ("both date and hour", {"weather": True, **noon, "hour": 1}),
                ("must be DAY MONTH HH:MM", {"weather": True, "date": "noon"}),
                ("no row covers 1 Jan", {"weather": True, "date": "1 Jan 12:00"}),
                ("sky is dark", {"weather": True, "date": "21 Jun 1:00"}),
                ("sky is dark", {"name": "clear", "sun": {"azimuth": 0, "altitude": -5}}),
                ("sky/hour = 9000, must be from 0 to 8760", {"weather": True, "hour": 9000}),
                ("must be below 8760", {"weather": True, "hour": 8760}),
                ("sky/diffuse = -1, must be from 0 to 3000", {"diffuse": -1}),
                ("gaps does not go with name", {"name": "even", "gaps": "fill"}),
                ("place does not go with weather", {"weather": True, "place": PLACE}),
                ("gaps must be refuse, fill or skip", {"weather": True, **noon, "gaps": "x"}),
                ("leave out sun, place", {"name": "even", "north": 3}),
                ("one way only", {"name": "clear", "sun": {"azimuth": 0, "altitude": 5}, **noon}),
                ("both direct and direct_horizontal", {"diffuse": 1, "direct": 1, "direct_horizontal": 1}),
                ("direct_horizontal does not go with name", {"name": "even", "direct_horizontal": 1}),
                ("year goes with place", {"diffuse": 1, "year": 2000}),
                ("year does not go with weather", {"weather": True, **noon, "year": 2000}),
                ("sky/year = 1899, must be from 1900", {"diffuse": 1, "place": PLACE, **noon, "year": 1899}),
                ("year = 2000.5, must be a whole", {"diffuse": 1, "place": PLACE, **noon, "year": 2000.5}),
                ("must be true or false", {"diffuse": 1, "dark": 1}),
                ("sky/lux_outside = 0, must be from", {"name": "even", "lux_outside": 0}),
                ("sky/clouds is not a member", {"name": "even", "clouds": 1}),
                ("must be true or false", {"name": "even", "photometric": 1}),
                ("must be a number", {"diffuse": None}),
                ("a text of 1 to", {"name": "x" * 99})):
            answer = self.ask({"sky": sky})
            with self.subTest(sky=sky):
                self.assertEqual(answer.status, 422, answer.body)
                self.assertIn(wanted, answer.json()["detail"])
        for status, body in (
                (422, {}),
                (422, []),
                (422, {"sky": "even", "skies": ["even"]}),
                (422, {"skies": []}),
                (422, {"skies": ["even"] * 65}),
                (400, "{"),
                (400, '{"sky": "even"'),
                (422, '{"sky": {"name": "ev\\u0000en"}}'),
                (400, '{"sky": {"diffuse": 1e999x}}')):
            self.assertEqual(self.ask(body).status, status, body)
        self.assertEqual(self.ask({"sky": "even"}, headers={"Content-Type": "application/x-npy"}).status, 415)
        self.assertEqual(self.daemon.get("/v1/scenes/box/skies").status, 405)
        self.assertEqual(self.ask({"sky": "even"}, "none").status, 404)
        answer = self.ask({"sky": "even"}, "plain")
        self.assertEqual((answer.status, answer.json()["detail"]), (422, "the store has no sky; precompute it with --sky"))
        self.assertEqual(len(self.skies({"skies": ["even"] * 64})), 64)


if __name__ == "__main__":
    unittest.main()
