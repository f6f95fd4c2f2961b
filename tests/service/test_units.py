"""Light has a unit: a store says if it counts in W or in lm, lights are given by flux, luminance or exitance, and answers come in
the unit that is asked for, through both programs."""

import base64
import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from make_store import Scene

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


if __name__ == "__main__":
    unittest.main()
