"""Black box: UGR of eyes over HTTP, beside what `lambert solve` says of the same light: dimmed, in batches, by vectors and refined, of
colours and of variants, and the reasons for which an eye has none."""

import json
import math
import time
import unittest

import h5py
import numpy as np

from case import Case
from command import must
from daemon import PATIENCE, Daemon
from make_store import add_checksums
from test_figures import ASSETS, LUMINAIRES, SENSORS

# Sums in single precision of numbers whose last bits differ; UGR is 3.5 times the relative error of its background.
SAME = 1e-5
EYES = {"eyes": [*SENSORS["eyes"], {"name": "desk.left", "at": [1, 2, 1.2], "view": [0.6, 0.8, 0]},
                 {"name": "desk.right", "at": [5, 2, 1.2], "view": [-0.6, 0.8, 0]},
                 {"name": "crowd", "at": [[.3 * x + .2, .1 * y + .2, 1.2] for x in range(18) for y in range(20)],
                  "view": [[0, 1, 0]] * 360}]}
NAMES = ["seat", "desk.left", "desk.right"]
LIGHTS = ({"panel": 1}, {"panel": .4, "rest": 1}, {"panel": 1, "bulb": 1}, {"panel": 1, "near": .5}, {"behind": 1}, {"panel": 0}, {})


class Eyes(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.files = {name: f"{cls.shared.name}/{name}" for name in ("room.obj", "l.json", "s.json", "room.h5", "dark.h5", "warm.h5", "watts.h5")}
        must("generate", "box", "--size", "6,6,3", "-o", cls.files["room.obj"])
        for name, value in (("l.json", LUMINAIRES), ("s.json", {**SENSORS, **EYES})):
            with open(cls.files[name], "w", encoding="utf-8") as file:
                json.dump(value, file)
        lit = ("--luminaires", cls.files["l.json"], *ASSETS)
        for name, *options in (("room.h5", "--reflectance", .5, *lit), ("dark.h5", "--reflectance", .2, *lit),
                               ("watts.h5", "--reflectance", .5)):
            cls.make(name, *options)
        # A store of three channels, whose luminaires have a colour.
        with open(f"{cls.shared.name}/w.json", "w", encoding="utf-8") as file:
            json.dump({"luminaires": [dict(one, cct=2700) for one in LUMINAIRES["luminaires"]]}, file)
        with open(f"{cls.shared.name}/room.mtl", encoding="utf-8") as file:
            material = file.read()
        with open(f"{cls.shared.name}/room.mtl", "w", encoding="utf-8") as file:
            file.write("".join("Kd .6 .5 .3\n" if line.startswith("Kd") else f"{line}\n" for line in material.splitlines()))
        cls.make("warm.h5", "--luminaires", f"{cls.shared.name}/w.json", *ASSETS)
        cls.daemon = Daemon(*(cls.files[name] for name in ("room.h5", "warm.h5", "watts.h5")), cls.store)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    @classmethod
    def make(cls, name, *options, method=("--method", "exact", "--keep-form-factors"), path=None):
        must("precompute", cls.files["room.obj"], "--sensors", cls.files["s.json"], "--elements", 200, "--probes", 0, *method, *options,
             "-o", path or cls.files[name])

    def solved(self, store, light, *options, names=None):
        """The eyes of `solve`, by set: of one light, or of a list of them."""
        path = self.path("light.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"emissions": light} if isinstance(light, list) else light, file)
        told = json.loads(must("solve", self.files[store], "--sensors", ",".join(names or NAMES), "--emission", path, "--json", *options).stdout)
        return {one["name"]: one["eyes"] for one in told["sensors"]}

    def asked(self, scene, light, **more):
        """The same of the daemon."""
        member = "emissions" if isinstance(light, list) else "emission"
        answer = self.daemon.radiosity(scene, {member: light, "reduce": {"sensors": NAMES, "with": ["ugr"]}, **more})
        self.assertEqual(answer.status, 200, answer)
        return {name: figures["ugr"] for name, figures in answer.json()["sensors"].items()}

    def same(self, got, wanted, what, tolerance=SAME):
        """Both are made of the same members, and of numbers that are as near."""
        if isinstance(wanted, dict):
            self.assertEqual(list(got), list(wanted), what)
        if isinstance(wanted, (dict, list)):
            self.assertEqual(len(got), len(wanted), what)
            for key in wanted if isinstance(wanted, dict) else range(len(wanted)):
                self.same(got[key], wanted[key], (what, key), tolerance)
        elif isinstance(wanted, float):
            self.assertIsInstance(got, (int, float), what)
            self.assertLessEqual(abs(got - wanted), tolerance * max(abs(wanted), 1), what)
        else:
            self.assertEqual(got, wanted, what)

    def test_as_solve_has_them(self):
        rated = []
        for dims in LIGHTS:
            light = {"luminaires": dims}
            wanted = self.solved("room.h5", light)
            self.same(self.asked("room", light), wanted, dims)
            # Again, by the columns that are kept.
            self.same(self.asked("room", light), wanted, dims)
            rated.append([eye["ugr"] is not None for eye in wanted["seat"]])
            for eye in wanted["seat"]:
                self.assertEqual("why" in eye, eye["ugr"] is None)
        self.assertEqual(rated, [[True, False, False]] * 2 + [[False] * 3] * 5)
        eye = self.asked("room", {"luminaires": LIGHTS[1]})["seat"][0]
        self.assertEqual([one["name"] for one in eye["luminaires"]], ["side", "panel"])
        self.assertAlmostEqual(sum(one["part"] for one in eye["luminaires"]), 1, places=12)

    def test_batches(self):
        lights = [{"luminaires": dims} for dims in LIGHTS]
        name = self.daemon.get("/v1/scenes/room").json()["groups"][0]["name"]
        lights += [{"groups": {name: 3}}, {"elements": [3], "values": [2], "luminaires": {"panel": .5}}]
        got = self.asked("room", lights)
        self.same(got, self.solved("room.h5", lights), "batch")
        self.assertNotIn("luminaires", got["seat"][0][0])
        for k, light in enumerate(lights):
            alone = self.asked("room", light)
            for sensors in NAMES:
                for eye in alone[sensors]:
                    eye.pop("luminaires", None)
                self.same([vector for vector in got[sensors][k]], alone[sensors], (k, sensors))
        # A batch of one is still one, and columns answer a batch too.
        self.assertEqual(len(self.asked("room", lights[:1])["seat"]), 1)
        self.same(self.asked("room", lights[:3] * 5)["seat"][12:], self.asked("room", lights[:3])["seat"], "columns")

    def test_by_vectors_and_refined(self):
        """A single element has no column; a tolerance is answered in double."""
        light = {"luminaires": {"panel": .7, "rest": 1}, "elements": [5], "values": [30]}
        wanted = self.solved("room.h5", light)
        self.assertIsNotNone(wanted["seat"][0]["ugr"])
        self.same(self.asked("room", light), wanted, "vectors")
        # The residual of the stored operator, in single precision, is what the refined answer has not.
        self.same(self.asked("room", light, tolerance=1e-7), wanted, "refined", 10 * SAME)

    def test_many_eyes_take_several_steps(self):
        """Their text is written a millisecond at a time, between the figures before and after it."""
        light = {"luminaires": {"panel": .7, "side": 1, "behind": .5}}
        reduce = {"sensors": ["crowd", "seat", "desk"], "with": ["mean", "ugr", "max"]}
        got = self.daemon.radiosity("room", {"emission": light, "reduce": reduce}).json()["sensors"]
        self.assertEqual([list(figures) for figures in got.values()], [reduce["with"]] * 3)
        self.same({"crowd": got["crowd"]["ugr"]}, self.solved("room.h5", light, names=["crowd"]), "crowd")
        self.assertEqual(len(got["crowd"]["ugr"]), 360)
        self.same(got["seat"]["ugr"], self.asked("room", light)["seat"], "seat")

    def test_beside_other_figures(self):
        """In the order asked, of names that mean several sets."""
        body = {"emissions": [{"luminaires": {"panel": 1}}, {"luminaires": {"rest": 1}}],
                "reduce": {"sensors": ["desk", "seat"], "with": ["mean", "ugr", "share", "max"], "at_least": [50, 100]}}
        got = self.daemon.radiosity("room", body).json()["sensors"]
        self.assertEqual({name: list(figures) for name, figures in got.items()}, dict.fromkeys(["desk", "seat"], body["reduce"]["with"]))
        apart = self.asked("room", body["emissions"])
        self.same(got["seat"]["ugr"], apart["seat"], "seat")
        self.same(got["desk"]["ugr"], [a + b for a, b in zip(apart["desk.left"], apart["desk.right"])], "desk")
        plain = self.daemon.radiosity("room", {**body, "reduce": {**body["reduce"], "with": ["mean", "share", "max"]}}).json()["sensors"]
        for name, figures in plain.items():
            self.assertEqual(figures, {key: got[name][key] for key in figures})

    def test_units_and_colours(self):
        for light in ({"luminaires": {"panel": .7, "rest": 1}}, {"luminaires": {"panel": [1, .5, .2], "side": [0, 0, 1]}}):
            for unit in None, "lx", "fc", "W/m2":
                more, options = ({}, ()) if unit is None else ({"unit": unit}, ("--unit-out", unit))
                wanted = self.solved("warm.h5", light, *options)
                self.same(self.asked("warm", light, **more), wanted, (light, unit))
                self.assertEqual(wanted["seat"][0].get("why"), None if unit in (None, "lx") else "the answer is not in lx")
            refined = self.asked("warm", light, tolerance=1e-7)
            self.same(refined, self.solved("warm.h5", light), "refined", 10 * SAME)
        with h5py.File(self.files["warm.h5"]) as file:
            self.assertEqual(file["mesh/reflectance"].shape[0], 3)

    def test_a_store_without_luminaires(self):
        """It counts in W."""
        group = self.daemon.get("/v1/scenes/watts").json()["groups"][0]["name"]
        light = {"groups": {group: 3}}
        for unit, words in (None, "the answer is not in lx"), ("lx", "no luminaire of the store is lit"):
            more, options = ({}, ()) if unit is None else ({"unit": unit}, ("--unit-out", unit))
            got = self.asked("watts", light, **more)
            self.same(got, self.solved("watts.h5", light, *options), unit)
            self.assertEqual(got["seat"][0]["why"], words)
            self.assertIsNone(got["seat"][0]["ugr"])

    def test_a_store_that_does_not_hold_what_eyes_see(self):
        old = self.path("old.h5")
        with open(self.files["room.h5"], "rb") as file, open(old, "wb") as copy:
            copy.write(file.read())
        with h5py.File(old, "r+") as file:
            del file["sensors/eyes"], file["sensors/seen"], file["checksum"]
            add_checksums(file)
        self.files = {**self.files, "old.h5": old}
        light = {"luminaires": {"panel": 1}}
        wanted = self.solved("old.h5", light)
        self.assertIn("precompute its sensors again", wanted["seat"][0]["why"])
        with Daemon(old) as daemon:
            got = daemon.radiosity("old", {"emission": light, "reduce": {"sensors": NAMES, "with": ["ugr"]}}).json()["sensors"]
        self.same({name: figures["ugr"] for name, figures in got.items()}, wanted, "old")

    def test_a_variant(self):
        groups = {group["name"]: .2 for group in self.daemon.get("/v1/scenes/room").json()["groups"]}
        light = {"luminaires": {"panel": 1, "side": .5}}
        with open(self.path("token"), "w", encoding="utf-8") as file:
            file.write("secret\n")
        self.make("room.h5", "--reflectance", .5, "--luminaires", self.files["l.json"], *ASSETS, path=self.path("room.h5"),
                  method=("--method", "low-rank", "--epsilon", 1e-6, "--keep-factors"))
        with Daemon(self.path("room.h5"), "--max-variants", 1, "--token-file", self.path("token")) as daemon:

            def ask(method, path, body):
                return daemon.ask(method, f"/v1/scenes/{path}", json.dumps(body),
                                  {"Content-Type": "application/json", "Authorization": "Bearer secret"})

            done = ask("PUT", "room/reflectance", {"variant": "dark", "groups": groups})
            self.assertEqual(done.status, 202, done)
            deadline = time.monotonic() + PATIENCE
            while ask("GET", "room@dark", None).status == 202 and time.monotonic() < deadline:
                time.sleep(.002)
            answer = ask("POST", "room@dark/radiosity", {"emission": light, "reduce": {"sensors": NAMES, "with": ["ugr"]}})
        self.assertEqual(answer.status, 200, answer)
        got = {name: figures["ugr"] for name, figures in answer.json()["sensors"].items()}
        self.same(got, self.solved("dark.h5", light), "variant", 10 * SAME)
        self.assertGreater(got["seat"][0]["ugr"], self.asked("room", light)["seat"][0]["ugr"] + 1)

    def test_by_hand(self):
        """From the answer alone: UGR of the luminances and solid angles that it names, and the light at the eye."""
        light = {"luminaires": {"panel": .3, "side": 1}}
        eye = self.asked("room", light)["seat"][0]
        total = sum(one["luminance"] ** 2 * one["solid_angle"] / one["position"] ** 2 for one in eye["luminaires"])
        self.assertAlmostEqual(eye["ugr"], 8 * math.log10(.25 / eye["background"] * total), places=9)
        all_light, direct = (np.array(self.daemon.radiosity("room", {"emission": light, "select": {"sensors": ["seat"]}}).json()["irradiance"],
                                      float), self.direct())
        self.assertAlmostEqual(eye["background"] * math.pi, all_light[0] - direct @ [.3, 1], places=3)

    def direct(self):
        """Light of panel and side at the first eye."""
        with h5py.File(self.files["room.h5"]) as file:
            return file["sensors/luminaires"][:2, file["sensors/eyes"][0]]

    def test_the_list_says_which_are_eyes(self):
        sets = self.daemon.get("/v1/scenes/room/sensors").json()["sets"]
        self.assertEqual([one["name"] for one in sets if one["kind"] == "eyes"], [*NAMES, "crowd"])

    def test_refusals(self):
        lit = {"luminaires": {"panel": 1}}
        for reduce, words in (
                ({"sensors": ["room"], "with": ["ugr"]}, "reduce: room is no set of eyes, which alone have a UGR; name sets whose kind is eyes"),
                ({"sensors": ["seat", "faces"], "with": ["mean", "ugr"]},
                 "reduce: faces is no set of eyes, which alone have a UGR; name sets whose kind is eyes"),
                ({"sensors": ["seet"], "with": ["ugr"]}, 'reduce/sensors/0: the scene has no set of sensors "seet"; did you mean "seat"?'),
                ({"sensors": ["seat"], "with": ["ugr", "mean", "ugr"]}, 'reduce/with/2: "ugr" was listed before'),
                ({"sensors": ["seat"], "with": ["mean", "mean"]}, 'reduce/with/1: "mean" was listed before'),
                ({"sensors": ["seat"], "with": ["glare"]},
                 'reduce/with/0: "glare" must be one of: mean, sum, min, max, uniformity, variance, share, ugr'),
                ({"groups": [], "with": ["ugr"]}, "reduce/groups is empty, must hold the name of a group"),
                ({"with": ["ugr"], "groups": [self.daemon.get("/v1/scenes/room").json()["groups"][0]["name"]]},
                 "reduce: ugr is of eyes; name sets of them by sensors in place of groups")):
            answer = self.daemon.radiosity("room", {"emission": lit, "reduce": reduce})
            self.assertEqual((answer.status, answer.json()["detail"]), (422, words), reduce)
        answer = self.daemon.radiosity("box", {"emission": {"elements": [0], "values": [1]}, "reduce": {"sensors": ["seat"], "with": ["ugr"]}})
        self.assertEqual((answer.status, answer.json()["detail"]),
                         (422, "reduce/sensors: the store has no sensors; precompute it with --sensors"))

    def test_memory_is_counted(self):
        """The text of an eye in a batch takes 352 bytes at most, so that 5 in 1,000 vectors pass three quarters of 2 MiB."""
        with Daemon(self.files["room.h5"], "--threads", 1, "--max-request-memory", "2M") as daemon:
            body = {"emissions": [{"luminaires": {"panel": (k + 1) / 1000}} for k in range(1000)], "reduce": {"sensors": NAMES, "with": ["ugr"]}}
            answer = daemon.radiosity("room", body)
            self.assertEqual(answer.status, 422, answer)
            self.assertIn("--max-request-memory", answer.json()["detail"])
            plain = daemon.radiosity("room", {**body, "reduce": {"sensors": NAMES, "with": ["mean"]}})
            self.assertEqual(plain.status, 200, plain)
            body["emissions"] = body["emissions"][500:]
            answer = daemon.radiosity("room", body)
            self.assertEqual(answer.status, 200, answer)
            ugr = [eyes[0]["ugr"] for eyes in answer.json()["sensors"]["seat"]["ugr"]]
            self.assertEqual(len(ugr), 500)
            self.assertTrue(np.all(np.diff(ugr) > 0))


if __name__ == "__main__":
    unittest.main()
