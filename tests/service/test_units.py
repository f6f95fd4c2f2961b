"""Light has a unit: a store says if it counts in W or in lm, lights are given by flux, luminance or exitance, and answers come in
the unit that is asked for, through both programs."""

import base64
import io
import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from daemon import Daemon
from make_store import Scene
from weather import a_year, wea

# Each in a file of its own: a box of 4 x 4 x 3 m without any reflectance, its fronts inwards, and below its ceiling four panels of
# .6 x .6 m that face down, which are one object.
PANEL, HEIGHT = .6, 2.5
MATERIALS = "newmtl black\nKd 0 0 0\nnewmtl red\nKd {} {} {}\n"


def box(colour=(0, 0, 0)):
    """The text of the OBJ and of its materials; a colour for the floor, which gives the store three channels."""
    corners = [(x, y, z) for z in (0, 3) for x, y in ((0, 0), (4, 0), (4, 4), (0, 4))]
    faces = {"floor": [(1, 2, 3, 4)], "ceiling": [(8, 7, 6, 5)],
             "wall": [(1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)], "lamp": []}
    for x in .7, 2.7:
        for y in .7, 2.7:
            first = len(corners) + 1
            corners += [(x, y, HEIGHT), (x, y + PANEL, HEIGHT), (x + PANEL, y + PANEL, HEIGHT), (x + PANEL, y, HEIGHT)]
            faces["lamp"].append(tuple(range(first, first + 4)))
    lines = ["mtllib box.mtl"] + ["v {} {} {}".format(*corner) for corner in corners]
    for name, of in faces.items():
        lines += [f"o {name}", f"usemtl {'red' if name == 'floor' else 'black'}"]
        lines += ["f {} {} {} {}".format(*face) for face in of]
    return "\n".join(lines) + "\n", MATERIALS.format(*colour)


def panel(factor, strength=1, floor=(), **more):
    """A glTF of a floor that looks up, and a panel above it that looks down and glows."""
    points = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]], "<f4")
    indices = np.array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7], "<u4")
    data = base64.b64encode(points.tobytes() + indices.tobytes()).decode()
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 48}]
    accessors = [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
                 {"bufferView": 1, "componentType": 5125, "count": 6, "type": "SCALAR"},
                 {"bufferView": 1, "byteOffset": 24, "componentType": 5125, "count": 6, "type": "SCALAR"}]
    glow = {"name": "glow", "emissiveFactor": [factor] * 3, "pbrMetallicRoughness": {"metallicFactor": 0}}
    if strength != 1:
        glow["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    meshes = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1 + k, "material": k}]} for k in range(2)]
    return json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
                       "nodes": [{"name": "floor", "mesh": 0, **dict(floor)}, {"name": "panel", "mesh": 1}],
                       "materials": [{"name": "plain", "pbrMetallicRoughness": {"metallicFactor": 0}}, glow],
                       "meshes": meshes, "accessors": accessors, "bufferViews": views,
                       "buffers": [{"byteLength": 144, "uri": "data:application/octet-stream;base64," + data}], **more})


class Stores(unittest.TestCase):
    """The kind of light of a store."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-units-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)

    def lights(self, text, name, *options):
        """As the attribute, and as `lambert info` has it, with the log."""
        (self.folder / name).write_text(text)
        store = self.folder / "of.h5"
        done = must("precompute", self.folder / name, "-o", store, "--rays", 16, "--probes", 0, *options)
        about = json.loads(must("info", store, "--json").stdout)
        with h5py.File(store) as f:
            self.assertEqual(f["mesh"].attrs["lights"].decode(), about["lights"])
        self.assertRegex(must("info", store).stdout, rf"\nlights +{about['lights']}\n")
        return about["lights"], done.stderr

    def test_by_the_file_and_by_the_option(self):
        (self.folder / "box.mtl").write_text(box()[1])
        punctual = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
        lamps = {"extensionsUsed": ["KHR_lights_punctual"],
                 "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 100}]}}}
        self.assertEqual(self.lights(box()[0], "a.obj")[0], "W")
        self.assertEqual(self.lights(box()[0], "a.obj", "--lights", "lm")[0], "lm")
        said = self.lights(panel(.5, 1000), "b.gltf")
        self.assertEqual(said[0], "lm")
        self.assertIn("is luminance in cd/m2, as glTF has it: the exitance is pi times that, in lm/m2", said[1])
        self.assertEqual(self.lights(panel(0), "c.gltf")[0], "W")
        self.assertEqual(self.lights(panel(0, floor=punctual, **lamps), "d.gltf")[0], "lm")
        said = self.lights(panel(.5), "b.gltf", "--lights", "W")
        self.assertEqual(said[0], "W")
        self.assertIn("--lights W: emission and answers of the store are in W/m2, with the numbers of lm", said[1])

    def test_a_division_of_the_mesh_keeps_it(self):
        for options in ("--elements", 40), ("--mesh", "light"), ("--two-sided", "--max-edge", .4):
            self.assertEqual(self.lights(panel(.5), "b.gltf", *options)[0], "lm", options)

    def test_a_store_of_a_store_and_an_older_store(self):
        self.lights(panel(.5), "b.gltf", "--keep-form-factors")
        store, again = self.folder / "of.h5", self.folder / "again.h5"
        for options, lights in ((), "lm"), (("--lights", "W"), "W"):
            must("precompute", store, "-o", again, "--method", "exact", "--probes", 0, *options)
            self.assertEqual(json.loads(must("info", again, "--json").stdout)["lights"], lights)
        Scene(60).write(store, "older")  # without the attribute
        self.assertEqual(json.loads(must("info", store, "--json").stdout)["lights"], "W")

    def test_a_wrong_word_is_refused(self):
        self.lights(panel(.5), "b.gltf")
        refused = lambert("precompute", self.folder / "b.gltf", "-o", self.folder / "x.h5", "--lights", "lux")
        self.assertEqual((refused.returncode, refused.stderr.count("\n")), (2, 1), refused.stderr)
        self.assertIn("--lights lux", refused.stderr)


FLUX, AREA = 3600, 4 * PANEL * PANEL
FOOT = 0.3048
GROUPS = ("floor", "wall", "ceiling", "lamp")


class Answers(unittest.TestCase):
    """Light in and numbers out, by `lambert solve` and over HTTP: the same, in each unit."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-units-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        for name, colour, lights in ("watts", (0, 0, 0), "W"), ("lumens", (0, 0, 0), "lm"), ("colour", (.6, .3, .1), "W"):
            text, materials = box(colour)
            (cls.folder / "box.obj").write_text(text)
            (cls.folder / "box.mtl").write_text(materials)
            must("precompute", cls.folder / "box.obj", "-o", cls.folder / f"{name}.h5", "--elements", 60, "--lights", lights,
                 "--keep-form-factors", "--sky", "tregenza", "--probes", 16)
        cls.daemon = Daemon("--stores", cls.folder)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def solve(self, name, *options):
        """The answer as JSON, with the log."""
        done = must("solve", self.folder / f"{name}.h5", "--json", *options)
        return json.loads(done.stdout), done.stderr

    def ask(self, name, body, **more):
        return self.daemon.radiosity(name, body, **more)

    def refused(self, name, body, *words):
        answer = self.ask(name, body)
        self.assertEqual(answer.status, 422, answer)
        for word in words:
            self.assertIn(word, answer.json()["detail"])

    def values(self, answer):
        self.assertEqual(answer.status, 200, answer)
        return np.array(answer.json()[answer.json()["quantity"]])

    # Unit that is asked for, and how many of it an lx is.
    UNITS = ("lx", 1), ("klx", 1e-3), ("fc", FOOT ** 2), ("W/m2", 1 / 179)

    def test_a_flux_comes_back(self):
        """Black walls take all that four panels of one group send out: sum A H is 3,600 lm, in any unit and store, and so with
        three channels of white light. Form factors of a closed scene sum to 1 within 1e-5."""
        reduce = {"groups": GROUPS, "with": ["sum"]}
        options = [word for group in GROUPS for word in ("--reduce", f"{group}=sum")]
        for name in "watts", "lumens":
            for unit, size in self.UNITS:
                by_program, log = self.solve(name, "--emit", f"lamp={FLUX}lm", "--quantity", "irradiance", "--unit-out", unit, *options)
                by_daemon = self.ask(name, {"emission": {"groups": {"lamp": f"{FLUX}lm"}}, "quantity": "irradiance", "unit": unit,
                                            "reduce": reduce}).json()
                for answer in by_program, by_daemon:
                    total = sum(figures["sum"] for figures in answer["groups"].values())
                    self.assertAlmostEqual(total / (FLUX * size), 1, delta=1e-4, msg=(name, unit))
                    self.assertEqual(answer["unit"], unit)
                    by = answer.get("converted_by", "")
                    self.assertEqual("179 lm/W" in by, name == "watts" or unit == "W/m2", (name, unit, by))
                    self.assertEqual("1 fc = 10.7639 lx" in by, unit == "fc", by)
                    self.assertEqual(by_program.get("converted_by"), by_daemon.get("converted_by"))
                    self.assertEqual(f"converted by {by}" in log, by != "", log)

    def test_units_of_lights(self):
        """The panels' own radiosity is the exitance: M = flux / A, M = pi L, 179 lm/W between the two kinds of store."""
        cases = (("12", 12, 12, ""), ("1000lm", 1000 / AREA / 179, 1000 / AREA, "lm"), ("40W", 40 / AREA, 40 / AREA * 179, "W"),
                 ("500cd/m2", np.pi * 500 / 179, np.pi * 500, "lm"), ("500 cd/m\u00b2", np.pi * 500 / 179, np.pi * 500, "lm"),
                 ("7lm/m2", 7 / 179, 7, "lm"), ("7W/m2", 7, 7 * 179, "W"))
        for text, watts, lumens, given in cases:
            for name, value, own in ("watts", watts, "W"), ("lumens", lumens, "lm"):
                by_program, _ = self.solve(name, "--emit", f"lamp={text}")
                by_daemon = self.ask(name, {"emission": {"groups": {"lamp": text if given else float(text)}},
                                            "reduce": {"groups": ["lamp"], "with": ["mean", "max"]}}).json()
                for answer in by_program, by_daemon:
                    self.assertAlmostEqual(answer["groups"]["lamp"]["mean"] / value, 1, delta=1e-6, msg=(name, text))
                    self.assertEqual(answer["unit"], {"W": "W/m2", "lm": "lm/m2"}[own])
                    self.assertEqual(answer.get("converted_by"), "179 lm/W" if given not in ("", own) else None)

    def test_colours(self):
        """A unit is of each channel; an illuminance is one number, the luminance of the channels."""
        weights = np.array([.2126, .7152, .0722])
        options = ["--emit", "lamp=300,200,100lm", "--quantity", "irradiance"]
        body = {"emission": {"groups": {"lamp": "300,200,100lm"}}, "quantity": "irradiance"}
        plain = self.values(self.ask("colour", body))
        rows = {"lx": 179 * weights @ plain, "fc": 179 * FOOT ** 2 * weights @ plain}
        for unit, right in rows.items():
            asked = dict(body, unit=unit)
            told = self.ask("colour", asked).json()
            self.assertEqual((told["channels"], told["unit"]), (1, unit))
            self.assertIn("luminance 0.2126 R + 0.7152 G + 0.0722 B", told["converted_by"])
            np.testing.assert_allclose(told["irradiance"], right, rtol=2e-6, atol=1e-6)
            out = self.folder / "answer.npy"
            must("solve", self.folder / "colour.h5", *options, "--unit-out", unit, "-o", out)
            np.testing.assert_allclose(np.load(out), right, rtol=2e-6, atol=1e-6)
            # Every way to an answer: batches, arrays, some elements, faces, figures, refined.
            two = self.values(self.ask("colour", {"emissions": [body["emission"]] * 2, "quantity": "irradiance", "unit": unit}))
            np.testing.assert_allclose(two, [right, right], rtol=2e-6, atol=1e-6)
            for accept, most in ("application/x-npy", 2e-6), ("application/x-npy; dtype=f2", 1e-3):
                array = self.ask("colour", asked, accept=accept)
                self.assertEqual((array.headers["Lambert-Unit"], array.headers["Lambert-Converted-By"]), (unit, told["converted_by"]))
                np.testing.assert_allclose(np.load(io.BytesIO(array.body)), right, rtol=most, atol=1e-3)
            some = self.values(self.ask("colour", dict(asked, select={"elements": [5, 0, 2]})))
            np.testing.assert_allclose(some, right[[5, 0, 2]], rtol=2e-6, atol=1e-6)
            fine = self.values(self.ask("colour", dict(asked, tolerance=1e-6)))
            np.testing.assert_allclose(fine, right, rtol=1e-4, atol=1e-4)
            faces = np.array(self.values(self.ask("colour", dict(asked, at="faces"))), float)
            by_channel = np.array(self.values(self.ask("colour", dict(body, at="faces"))), float)
            np.testing.assert_allclose(faces, right.sum() / (weights @ plain).sum() * (weights @ by_channel), rtol=2e-6, atol=1e-6)
            must("solve", self.folder / "colour.h5", *options, "--unit-out", unit, "--at", "faces", "-o", out)
            np.testing.assert_allclose(np.load(out), faces, rtol=2e-6, atol=1e-6)
            with h5py.File(self.folder / "colour.h5") as f:
                names = [n.decode() for n in f["mesh/group_names"]]
                there = f["mesh/group"][:] == names.index("floor")
                area = f["mesh/area"][:][there]
            x = right[there]
            mean = area @ x / area.sum()
            want = {"mean": mean, "sum": area @ x, "min": x.min(), "uniformity": x.min() / mean,
                    "variance": area @ (x - mean) ** 2 / area.sum()}
            for statistics in ["mean", "sum"], list(want):
                for more in {}, {"tolerance": 1e-6}:
                    figures = self.ask("colour", dict(asked, **more, reduce={"groups": ["floor"], "with": statistics})).json()
                    for k in statistics:
                        self.assertAlmostEqual(figures["groups"]["floor"][k] / want[k], 1, delta=1e-3 if more else 2e-5, msg=(k, more))
            figures, _ = self.solve("colour", *options, "--unit-out", unit, "--reduce", "floor=" + ",".join(want))
            for k, value in want.items():
                self.assertAlmostEqual(figures["groups"]["floor"][k] / value, 1, delta=2e-5, msg=k)

    def test_skies(self):
        """A sky is photometric or not, whatever the store is; lamps beside it are converted, and said so."""
        even = [1.] * 145
        def mean(answer):
            answer = answer if isinstance(answer, dict) else answer.json()
            return answer["groups"]["ceiling"]["mean"], answer["unit"], answer.get("converted_by")
        reduce = {"quantity": "irradiance", "reduce": {"groups": ["ceiling"], "with": ["mean"]}}
        lamp = {"groups": {"lamp": 1}}
        for name, photometric, converted, unit in (("watts", None, (1, 1), "W/m2"), ("watts", False, (1, 1), "W/m2"),
                                                   ("watts", True, (179, 1), "lx"), ("lumens", None, (1, 1), "lx"),
                                                   ("lumens", True, (1, 1), "lx"), ("lumens", False, (1, 179), "lx")):
            more = {} if photometric is None else {"photometric": photometric}
            body = {"emission": {**lamp, "sky": even}, **reduce, "limit": False}
            of_lamp = mean(self.ask(name, dict(body, emission=lamp)))[0]
            of_sky = mean(self.ask(name, dict(body, emission={"sky": even})))[0]
            both = mean(self.ask(name, dict(body, **more)))
            self.assertAlmostEqual(both[0], converted[0] * of_lamp + converted[1] * of_sky, delta=1e-5 * abs(both[0]) + 1e-9)
            self.assertEqual(both[1:], (unit, "179 lm/W" if converted != (1, 1) else None))
        clear = {"name": "clear", "sun": {"azimuth": 180, "altitude": 40}}
        for name, more, unit in (("watts", {}, "W/m2"), ("lumens", {}, "lx"), ("lumens", {"photometric": False}, "W/m2"),
                                 ("watts", {"photometric": True}, "lx")):
            made = self.daemon.ask("POST", f"/v1/scenes/{name}/skies", json.dumps({"sky": {**clear, **more}}),
                                   {"Content-Type": "application/json"}).json()["skies"][0]
            self.assertEqual(made["unit"], unit)
            told = self.ask(name, {"emission": {"sky": made["sky"]}, "photometric": unit == "lx", "quantity": "irradiance"}).json()
            self.assertEqual(told["unit"], "lx" if name == "lumens" else unit)
        np.save(self.folder / "sky.npy", np.array(even, "<f4"))
        for name, options, unit in (("watts", (), "W/m2"), ("watts", ("--photometric",), "lx"), ("lumens", (), "lx")):
            answer, _ = self.solve(name, "--sky", self.folder / "sky.npy", *options, "--quantity", "irradiance")
            self.assertEqual((answer["unit"], answer.get("converted_by")), (unit, None))
            beside, log = self.solve(name, "--sky", self.folder / "sky.npy", *options, "--quantity", "irradiance", "--emit", "lamp=1")
            self.assertEqual("converted by 179 lm/W" in log, name == "watts" and options != (), log)
            self.assertEqual(beside["unit"], unit)
        for name in "watts", "lumens":
            named, _ = self.solve(name, "--sky", "overcast", "--quantity", "irradiance")
            self.assertEqual((named["unit"], named.get("converted_by")), ("lx", None))
            share, _ = self.solve(name, "--figure", "daylight-factor")
            self.assertEqual((share["unit"], share.get("converted_by")), ("%", None))

    def test_what_is_written(self):
        out = self.folder / "answer.csv"
        for name, options, head in (("watts", (), "radiosity [W/m2]"), ("lumens", (), "radiosity [lm/m2]"),
                                    ("watts", ("--quantity", "irradiance", "--unit-out", "klx"), "irradiance [klx]"),
                                    ("colour", ("--unit-out", "fc"), "radiosity [lm/ft2]")):
            must("solve", self.folder / f"{name}.h5", "--emit", "lamp=1", *options, "-o", out)
            self.assertEqual(out.read_text().splitlines()[0], f"element,group,area,{head}")
            table = must("solve", self.folder / f"{name}.h5", "--emit", "lamp=1", *options).stdout.splitlines()[0]
            self.assertIn(head.replace(" [", ", ").rstrip("]"), table)
        must("solve", self.folder / "colour.h5", "--emit", "lamp=1", "-o", out)
        self.assertEqual(out.read_text().splitlines()[0].split(",")[3:], [f"radiosity_{c} [W/m2]" for c in "rgb"])
        for more in ("--smooth",), ():
            for kind in "glb", "ply", "vtu":
                must("solve", self.folder / "colour.h5", "--emit", "lamp=1", "--unit-out", "lx", *more, "-o", self.folder / f"a.{kind}")

    def test_pictures(self):
        for options, unit in ((), "W/m2"), (("--unit-out", "lx", "--quantity", "irradiance"), "lx"), (("--unit-out", "fc"), "lm/ft2"):
            log = must("render", self.folder / "watts.h5", "--emit", "lamp=90lm", "--false-color", *options, "--size", "64x64",
                       "-o", self.folder / "a.png").stderr
            self.assertRegex(log, rf"colours from 0 to \S+ {unit}\n")
            self.assertIn("converted by 179 lm/W", log)

    def test_refusals(self):
        light = {"groups": {"lamp": 1}}
        for value in "3600lux", "12", "lm", "1,2,3,4lm", "1,,2lm", "nanlm", "1e400lm", "3600lm2", "\u00b2", "", "3\u0000lm":
            self.refused("colour", {"emission": {"groups": {"lamp": value}}}, "emission/groups/lamp")
        self.refused("watts", {"emission": {"elements": [0], "values": ["3lm"]}}, "emission/values/0")
        self.refused("watts", {"emission": light, "unit": "lux"}, "unit", "lx, klx, fc or W/m2")
        self.refused("watts", {"emission": light, "unit": 1}, "unit")
        self.refused("watts", {"emission": light, "photometric": True}, "photometric")
        self.refused("watts", {"emission": {"groups": {"lamp": 3e38}}, "unit": "lx"}, "single precision")
        self.refused("watts", {"emission": light, "unit": "lx", "units": "lx"}, "units")
        cotangent = self.daemon.ask("POST", "/v1/scenes/watts/adjoint", json.dumps({"cotangent": {"groups": {"lamp": "3lm"}}}),
                                    {"Content-Type": "application/json"})
        self.assertEqual(cotangent.status, 422, cotangent)
        for text in "lamp=3600lux", "lamp=lm", "lamp=-3lm", "lamp=1,lm", "lamp=3e400W", "lamp=3lm,4":
            done = lambert("solve", self.folder / "watts.h5", "--emit", text)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
        for text in "lamp=1,2lm", "lamps=3lm", "lamp=3e38W/m2":
            done = lambert("solve", self.folder / "lumens.h5", "--emit", text)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
        done = lambert("solve", self.folder / "watts.h5", "--emit", "lamp=3e38", "--unit-out", "lx")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
        done = lambert("render", self.folder / "watts.h5", "--value-unit", "lx", "-o", self.folder / "a.png")
        self.assertEqual(done.returncode, 2)

    def test_signs_and_gradients(self):
        """A flux may be negative where emissions may, and lights of a gradient have units too."""
        values = self.values(self.ask("watts", {"emission": {"groups": {"lamp": "-179lm"}}}))
        self.assertAlmostEqual(values.min() * AREA, -1, delta=1e-5)
        body = {"cotangent": {"groups": {"floor": 1}}, "gradient": ["reflectance"], "quantity": "irradiance"}
        asked = [self.daemon.ask("POST", "/v1/scenes/watts/adjoint", json.dumps(dict(body, emission={"groups": {"lamp": v}})),
                                 {"Content-Type": "application/json"}).json() for v in ("179lm", 1 / AREA)]
        np.testing.assert_allclose(asked[0]["gradient"]["reflectance"], asked[1]["gradient"]["reflectance"], rtol=1e-5, atol=1e-9)
        self.assertEqual([a.get("converted_by") for a in asked], ["179 lm/W", None])

    def test_a_check_has_units(self):
        """`verify` names the kind of light, and its irradiances have their unit."""
        for name, lights, exitance, irradiance in ("watts", "W", "W/m2", "W/m2"), ("lumens", "lm", "lm/m2", "lx"):
            command = "verify", self.folder / f"{name}.h5", "--probes", 0, "--walks", 64
            lines = must(*command).stdout.splitlines()
            self.assertRegex(lines[1], rf"^ok +mesh +.* groups, lights in {exitance}$")
            compared = [line for line in lines if "walks " in line and " under " in line and line.startswith("     ")]
            self.assertGreater(len(compared), 8)
            for line in compared:
                self.assertRegex(line, rf" \+- \S+ +{irradiance}  \S.* under ")
            told = json.loads(must(*command, "--json").stdout)
            self.assertEqual((told["lights"], told["unit"]), (lights, irradiance))

    def test_a_light_that_moves(self):
        """Its emission has a unit as --emit has: the flux is that of the polygon, and its answers are in the unit of the store."""
        polygon = [[-.3, -.3, 0], [.3, -.3, 0], [.3, .3, 0], [-.3, .3, 0]]
        place = [{"name": "here", "move": [2, 2, 2], "turn": {"axis": [1, 0, 0], "degrees": 180}}]
        store, file = self.folder.parent / (self.folder.name + "-moves.h5"), self.folder / "moves.json"
        self.addCleanup(store.unlink, missing_ok=True)
        given = (("900lm", 900 / .36, "lm"), ("18 W", 18 / .36, "W"), ("500cd/m2", np.pi * 500, "lm"), ("7lm/m2", 7, "lm"), (12, 12, ""),
                 ("300,200,100lm", np.array([300, 200, 100]) / .36, "lm"))
        for lights, unit, irradiance in ("W", "W/m2", "W/m2"), ("lm", "lm/m2", "lx"):
            for text, exitance, own in given:
                file.write_text(json.dumps({"light": {"polygon": polygon, "emission": text}, "positions": place}))
                log = must("precompute", self.folder / "watts.h5", "--lights", lights, "--positions", file, "--paths", 64, "-o", store).stderr
                factor = {"": 1, lights: 1}.get(own, 179 if lights == "lm" else 1 / 179)
                with h5py.File(store) as f:
                    np.testing.assert_allclose(f["operator/exitance"][:], exitance * factor, rtol=1e-6)
                self.assertRegex(log, rf"1 positions of a light of 0.36 m2, [\d.e+, ]+ {unit}\n")
                self.assertEqual("converted by 179 lm/W" in log, factor != 1, log)
            told = json.loads(must("solve", store, "--emit", "here=1", "--quantity", "irradiance", "--json").stdout)
            self.assertEqual(told["unit"], irradiance)
            must("solve", store, "--emit", "here=1", "-o", self.folder / "moves.csv")
            self.assertIn(f" [{unit}]", (self.folder / "moves.csv").read_text().splitlines()[0])
            self.assertIn(f"lights in {unit}", must("verify", store).stdout)
        for text in "900lux", "lm", "1,2lm", "1,2,3,4lm", "nanlm", "-3lm", "0lm", "":
            file.write_text(json.dumps({"light": {"polygon": polygon, "emission": text}, "positions": place}))
            done = lambert("precompute", self.folder / "watts.h5", "--positions", file, "-o", store)
            self.assertEqual((done.returncode, done.stderr.count("lambert precompute: ")), (1, 1), done.stderr)
            self.assertIn("moves.json: light: emission", done.stderr.splitlines()[-1])
        done = lambert("solve", store, "--emit", "here=3lm")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)

    def test_files_of_lights(self):
        file = self.folder / "light.json"
        file.write_text(json.dumps({"emissions": [{"groups": {"lamp": "179lm"}}, {"groups": {"lamp": 1 / AREA}}]}))
        out = self.folder / "answer.npy"
        log = must("solve", self.folder / "watts.h5", "--emission", file, "-o", out).stderr
        np.testing.assert_allclose(*np.load(out), rtol=1e-6)
        self.assertIn("converted by 179 lm/W", log)


PEREZ = "luminous efficacies of Perez et al. 1990"


class Years(unittest.TestCase):
    """Figures of a year in the unit that is asked for."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-units-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        # More hours with light than the sky has tiles: shares then come from the answers to tiles.
        (cls.folder / "june.wea").write_text(wea([row for row in a_year() if row[0] == 6 and row[1] < 15]))
        for name, colour, lights in ("watts", (0, 0, 0), "W"), ("lumens", (0, 0, 0), "lm"), ("colour", (.6, .3, .1), "W"):
            text, materials = box(colour)
            (cls.folder / "box.obj").write_text(text)
            (cls.folder / "box.mtl").write_text(materials)
            must("precompute", cls.folder / "box.obj", "-o", cls.folder / f"{name}.h5", "--elements", 60, "--lights", lights,
                 "--sky", "tregenza", "--portal", "ceiling", "--probes", 16, "--quiet")

    def solve(self, name, *options):
        must("solve", self.folder / f"{name}.h5", "--weather", self.folder / "june.wea", *options)

    def hours(self, name, *options):
        """Irradiances [hours][elements], or [hours][channels][elements]."""
        self.solve(name, *options, "--quantity", "irradiance", "-o", self.folder / "hours.npy")
        return np.load(self.folder / "hours.npy").astype(float)

    def figures(self, name, *options):
        self.solve(name, *options, "-o", self.folder / "year.json")
        return json.loads((self.folder / "year.json").read_text())

    def test_shares_and_sums_of_the_luminance(self):
        for way in ("--sun", "tiles"), ("--sun", "exact", "--sun-points", 4):
            hours = self.hours("colour", "--unit-out", "lx", *way)
            low, high = (float(f"{x:.6g}") for x in np.quantile(hours[hours > 0], [.3, .8]))
            year = self.figures("colour", "--unit-out", "lx", *way, "--annual", "sum", "--annual", f"autonomy={low:.6g}",
                                "--annual", f"useful={low:.6g},{high:.6g}")
            self.assertEqual((year["channels"], year["unit"], year["sum_unit"]), (1, "lx", "klx h"))
            self.assertEqual(year["converted_by"], f"{PEREZ}; luminance 0.2126 R + 0.7152 G + 0.0722 B")
            total, autonomy, useful = map(np.array, year["annual"].values())
            np.testing.assert_allclose(total, hours.sum(0) / 1000, rtol=1e-4, atol=1e-4)
            self.assertGreater(np.ptp(autonomy), .1)
            for share, right in (autonomy, hours >= low), (useful, (hours >= low) & (hours <= high)):
                # An hour within rounding of a threshold may count or not.
                np.testing.assert_allclose(share, right.mean(0), atol=2.1 / len(hours))

    def test_a_sum_and_its_error(self):
        """The error that is stated is a share: the same in any unit, that of the sun too."""
        plain = self.figures("watts", "--annual", "sum")
        self.assertEqual((plain["unit"], plain["sum_unit"], plain.get("converted_by")), ("W/m2", "kWh/m2", None))
        plain = self.figures("watts", "--annual", "sum", "--photometric")
        self.assertEqual((plain["unit"], plain["sum_unit"], plain["converted_by"]), ("lx", "klx h", PEREZ))
        for unit, size, of_sum in ("fc", FOOT ** 2, "kfc h"), ("lx", 1, "klx h"), ("klx", .001, "Mlx h"), ("W/m2", 1 / 179, "kWh/m2"):
            options = ("--photometric",) if unit == "W/m2" else ()
            told = self.figures("watts", "--annual", "sum", "--unit-out", unit, *options)
            self.assertEqual((told["unit"], told["sum_unit"]), (unit, of_sum))
            np.testing.assert_allclose(told["annual"]["sum"], size * np.array(plain["annual"]["sum"]), rtol=1e-5, atol=1e-6)
            self.assertEqual(set(told["error"]), set(plain["error"]))
            self.assertGreater(plain["error"]["parts"]["sun"], 0)
            self.assertAlmostEqual(told["error"]["parts"]["sun"] / plain["error"]["parts"]["sun"], 1, delta=1e-3)
        self.solve("watts", "--annual", "sum", "--annual", "autonomy=1", "-o", self.folder / "year.csv")
        self.assertEqual((self.folder / "year.csv").read_text().splitlines()[0],
                         "element,group,area,irradiance_sum [kWh/m2],irradiance_autonomy_1")

    def test_weather_of_a_store_in_lumens_is_photometric(self):
        """By the efficacies of sky and sun, not by 179 lm/W; so is that of a store in W where lx are asked for."""
        right = self.hours("watts", "--photometric")
        np.testing.assert_allclose(self.hours("watts", "--unit-out", "klx"), right / 1000, rtol=1e-6, atol=1e-9)
        clear = ["--sky", "clear", "--place", "52.5,13.4,1", "--date", "21 Jun 9:00", "--quantity", "irradiance", "--json"]
        one, other = (json.loads(must("solve", self.folder / f"{name}.h5", *clear, "--unit-out", "lx").stdout) for name in ("watts", "lumens"))
        self.assertEqual((one["unit"], one["converted_by"], one["groups"]), ("lx", PEREZ, other["groups"]))
        for options in (), ("--photometric",), ("--unit-out", "lx"):
            np.testing.assert_allclose(self.hours("lumens", *options), right, rtol=1e-6, atol=1e-6)
        told = self.figures("lumens", "--annual", "sum")
        self.assertEqual((told["unit"], told["converted_by"]), ("lx", PEREZ))
        np.testing.assert_allclose(self.hours("lumens", "--unit-out", "W/m2"), right / 179, rtol=1e-5, atol=1e-6)
        lamp = self.figures("watts", "--photometric", "--emit", "lamp=1", "--annual", "sum")
        self.assertEqual((lamp["unit"], lamp["converted_by"]), ("lx", f"{PEREZ}; 179 lm/W"))


if __name__ == "__main__":
    unittest.main()
