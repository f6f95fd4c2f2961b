"""Images of materials: every element has the mean of its part, judged by samples of images that are decoded here."""

import base64
import json
import math
import os
import pathlib
import struct
import tempfile
import unittest
import zlib

import h5py
import numpy as np

from command import lambert, must
from png_file import decode_png

FIXTURES = pathlib.Path(os.environ["FIXTURES"])


def png_bytes(pixels):
    """An array [height][width][3] or [4] of bytes as a PNG."""
    height, width, channels = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    head = struct.pack(">2I5B", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def noise(width, height, seed=3):
    """Noise over a gradient."""
    ramp = np.linspace(0, 200, width)[None, :, None] * np.array([1, .6, .3])
    return np.random.default_rng(seed).integers(0, 55, (height, width, 3)) + ramp.astype(int)


def linear(pixels):
    x = np.asarray(pixels) / 255
    return np.where(x <= .04045, x / 12.92, ((x + .055) / 1.055) ** 2.4)


def wrapped(index, n, wrap):
    if wrap == "clamp":
        return np.clip(index, 0, n - 1)
    if wrap == "mirror":
        index = index % (2 * n)
        return np.where(index < n, index, 2 * n - 1 - index)
    return index % n


def mean_of(pixels, corners, wrap=("repeat", "repeat"), n=200000):
    """The mean [3] over a triangle or parallelogram with those corners in u and v, v downwards, by n samples of a sequence
    with two irrational steps: a grid would lie the same way in many pixels."""
    s, t = (np.arange(n) * step % 1 for step in (.7548776662466927, .5698402909980532))
    if len(corners) == 3:
        fold = s + t > 1
        s, t = np.where(fold, 1 - s, s), np.where(fold, 1 - t, t)
    a, b, d = (np.array(corners[k]) for k in (0, 1, -1))
    place = a + s[..., None] * (b - a) + t[..., None] * (d - a)
    height, width = pixels.shape[:2]
    x = wrapped(np.floor(place[..., 0] * width).astype(int), width, wrap[0])
    y = wrapped(np.floor(place[..., 1] * height).astype(int), height, wrap[1])
    return linear(pixels[y, x]).mean(axis=0)


class Store:
    def __init__(self, path):
        with h5py.File(path) as file:
            self.vertices = file["mesh/vertices"][:]
            self.elements = file["mesh/elements"][:]
            self.area = file["mesh/area"][:]
            self.reflectance = file["mesh/reflectance"][:]
            self.emission = file["mesh/emission"][:]

    def corners(self, i):
        return [self.vertices[v] for v in self.elements[i] if v != 0xFFFFFFFF]


SQUARE = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nvt 2.5 0\nvt 2.5 1.25\nvt 0 1.25\n"
FACE = "f 1/1 2/2 3/3 4/4\n"


class TexturesCase(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def write(self, name, data):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return path

    def store(self, scene, *options):
        """The store of a scene, and the lines on standard error."""
        path = self.folder / "made.h5"
        done = must("precompute", scene, "-o", path, "--probes", 0, "--rays", 16, "--quiet", *options)
        return Store(path), done.stderr

    def close(self, found, truth, what):
        """Within 1 %, and that of white, which the last levels of a dark image need."""
        np.testing.assert_allclose(found, truth, rtol=1e-2, atol=1e-4, err_msg=what)


class ObjTexturesTest(TexturesCase):
    def judge_wall(self, store, pixels, colour=(1, 1, 1), to_uv=lambda p: (1.25 * p[0], 1 - 1.25 * p[1]), wrap=("repeat", "repeat")):
        for i in range(len(store.elements)):
            truth = mean_of(pixels, [to_uv(p) for p in store.corners(i)], wrap) * colour
            self.close(store.reflectance[:, i], truth, f"element {i}")

    def test_obj_elements_have_the_means_of_their_parts(self):
        pixels = noise(30, 20)
        self.write("wood.png", png_bytes(pixels))
        self.write("a.mtl", "newmtl wood\nKd .8 .9 1\nmap_Kd wood.png\n")
        scene = self.write("a.obj", "mtllib a.mtl\n" + SQUARE + "usemtl wood\n" + FACE)
        for options in ([], ["--elements", 16], ["--max-edge", .3], ["--mesh-error", .3, "--elements", 30]):
            store, errors = self.store(scene, *options)
            self.assertEqual(store.reflectance.shape[0], 3)
            self.assertNotIn("image", errors)
            self.judge_wall(store, pixels, (.8, .9, 1))
        # The image is laid on each half by itself: it is mirrored in the second, which stays a face of its own.
        halves = "v 1 0 0\nv 1 1 0\nvt 1.25 0\nvt 1.25 1.25\n"
        self.write("b.obj", "mtllib a.mtl\n" + SQUARE + halves + "usemtl wood\nf 1/1 5/5 6/6 4/4\nf 5/5 2/1 3/4 6/6\n")
        store, _ = self.store(self.folder / "b.obj", "--mesh-error", .3, "--elements", 30)
        self.judge_wall(store, pixels, (.8, .9, 1), to_uv=lambda p: (1.25 * (1 - abs(p[0] - 1)), 1 - 1.25 * p[1]))
        store, _ = self.store(scene, "--two-sided", "--elements", 8)
        self.assertEqual(len(store.area), 8)
        self.judge_wall(store, pixels, (.8, .9, 1))
        must("verify", self.folder / "made.h5", scene)
        store, _ = self.store(scene, "--reflectance", .25)
        np.testing.assert_array_equal(store.reflectance, .25)

    def test_store_keeps_places_and_images(self):
        self.write("wood.png", png_bytes(noise(30, 20)))
        self.write("tile.jpg", (FIXTURES / "textures" / "tile.jpg").read_bytes())
        self.write("unused.png", png_bytes(noise(5, 5)))
        self.write("a.mtl", "newmtl wood\nKd .8 .9 1\nmap_Kd -clamp on wood.png\nnewmtl tile\nmap_Kd tile.jpg\n"
                   "newmtl unused\nmap_Kd unused.png\nnewmtl plain\nKd .3 .3 .3\n")
        above = "v 0 0 3\nv 2 0 3\nv 2 1 3\n"
        scene = self.write("a.obj", "mtllib a.mtl\n" + SQUARE + "usemtl wood\n" + FACE + above + "usemtl tile\nf 5/1 7/3 6/2\n"
                           "usemtl plain\nf 5 6 7\n")
        self.store(scene, "--max-edge", 1.2, "--keep-form-factors")
        must("precompute", self.folder / "made.h5", "-o", self.folder / "again.h5", "--probes", 0)
        for name in ("made.h5", "again.h5"):
            with h5py.File(self.folder / name) as file:
                mesh = {key: value[()] for key, value in file["mesh"].items()}
            np.testing.assert_array_equal(mesh["surface"], [0] * 2 + [1] * 4 + [0xFFFFFFFF] * 4)
            np.testing.assert_array_equal(mesh["surface_image"][:, 1:], [[2, 2], [0, 0]])
            np.testing.assert_allclose(mesh["surface_factor"], [[.8, .9, 1], [1, 1, 1]], rtol=1e-6)
            self.assertEqual(len(mesh["image_start"]), len(np.unique(mesh["surface_image"][:, 0])) + 1)
            for k, i in enumerate(mesh["surface_image"][:, 0]):
                data = mesh["images"][mesh["image_start"][i]:mesh["image_start"][i + 1]].tobytes()
                self.assertEqual(data[:3], b"\xff\xd8\xff", k)
            for i in range(6):
                corners = [v for v in mesh["elements"][i] if v != 0xFFFFFFFF]
                places = mesh["vertices"][corners][:, :2] * 1.25
                np.testing.assert_allclose(mesh["texcoord"][i, :len(corners)], np.c_[places[:, 0], 1 - places[:, 1]], atol=1e-5)
        self.assertEqual(lambert("verify", self.folder / "again.h5", scene).returncode, 0)
        store, _ = self.store(scene, "--reflectance", .5)
        with h5py.File(self.folder / "made.h5") as file:
            self.assertNotIn("surface", file["mesh"])

    def test_jpeg_and_webp_are_those_of_their_own_tools(self):
        for name in ("tile.jpg", "tile.webp"):
            self.write(name, (FIXTURES / "textures" / name).read_bytes())
            pixels = decode_png(FIXTURES / "textures" / f"{name}.png")
            self.write("a.mtl", f"newmtl wood\nmap_Kd {name}\n")
            scene = self.write("a.obj", "mtllib a.mtl\n" + SQUARE + "usemtl wood\n" + FACE)
            self.judge_wall(self.store(scene, "--elements", 4)[0], pixels)

    def test_coordinates_before_the_materials(self):
        pixels = noise(30, 20)
        self.write("wood.png", png_bytes(pixels))
        self.write("a.mtl", "newmtl wood\nKd 0 0 0\nmap_Kd wood.png\n")
        scene = self.write("a.obj", SQUARE + "usemtl wood\n" + FACE + "mtllib a.mtl\n")
        self.judge_wall(self.store(scene)[0], pixels)
        # A bent map has no affine one over the quad, which becomes two triangles.
        bent = SQUARE.replace("vt 2.5 1.25", "vt 2 1.5")
        scene = self.write("a.obj", "mtllib a.mtl\n" + bent + "usemtl wood\n" + FACE)
        store, _ = self.store(scene)
        self.assertEqual(len(store.area), 2)
        uv = {(0, 0): (0, 1), (2, 0): (2.5, 1), (2, 1): (2, -.5), (0, 1): (0, -.25)}
        for i in range(2):
            truth = mean_of(pixels, [uv[tuple(p[:2])] for p in store.corners(i)])
            self.close(store.reflectance[:, i], truth, f"triangle {i}")

    def test_options_of_map_statements(self):
        pixels = noise(30, 20)
        self.write("my wood.png", png_bytes(pixels))
        self.write("a.mtl", "newmtl wood\nKd 1 1 1\nmap_Kd -s 2 .5 -o .1 -.2 1 -mm 0 1 -clamp on my wood.png\n")
        scene = self.write("a.obj", "mtllib a.mtl\n" + SQUARE + "usemtl wood\n" + FACE)
        store, errors = self.store(scene, "--elements", 4)
        self.assertNotIn("image", errors)
        self.judge_wall(store, pixels, to_uv=lambda p: (2.5 * p[0] + .1, 1 - (.625 * p[1] - .2)), wrap=("clamp", "clamp"))

    def test_emission_of_an_image(self):
        pixels = noise(8, 8)
        self.write("lamp.png", png_bytes(pixels))
        self.write("a.mtl", "newmtl lamp\nKd .5 .5 .5\nKe 10 20 30\nmap_Ke lamp.png\n")
        scene = self.write("a.obj", "mtllib a.mtl\n" + SQUARE + "usemtl lamp\n" + FACE)
        store, _ = self.store(scene, "--elements", 4)
        for i in range(4):
            uv = [(1.25 * p[0], 1 - 1.25 * p[1]) for p in store.corners(i)]
            self.close(store.emission[:, i], mean_of(pixels, uv) * (10, 20, 30), f"element {i}")
        np.testing.assert_allclose(store.reflectance, .5)

    def test_white_and_transparent_images(self):
        self.write("white.png", png_bytes(np.full((4, 4, 3), 255)))
        rgba = np.dstack([noise(6, 6), np.full((6, 6), 20)])
        self.write("thin.png", png_bytes(rgba))
        self.write("a.mtl", "newmtl white\nKd 1 1 1\nmap_Kd white.png\nnewmtl thin\nmap_Kd thin.png\nmap_d thin.png\nmap_Bump b.png\n")
        scene = self.write("a.obj", "mtllib a.mtl\n" + SQUARE + "usemtl white\n" + FACE + "v 0 0 3\nv 2 0 3\nv 2 1 3\nv 0 0 4\nv 2 0 4\nv 2 1 4\n"
                           "usemtl thin\nf 5/1 6/2 7/3\nf 8 9 10\n")
        store, errors = self.store(scene)
        np.testing.assert_allclose(store.reflectance[:, 0], .9999)
        self.assertIn("material 'white': a mean reflectance above 0.9999 is clamped to it", errors)
        self.assertIn("a.mtl: 1 map of other things than Kd and Ke is left out", errors)
        self.assertIn("a.mtl: images of transparency (map_d) are left out: what has one is opaque", errors)
        self.assertIn("a.obj: 1 faces of materials with images have no texture coordinates", errors)
        truth = mean_of(rgba[..., :3], [(0, 1), (2.5, 1), (2.5, -.25)])
        self.close(store.reflectance[:, 1], truth, "alpha is left out")
        np.testing.assert_allclose(store.reflectance[:, 2], .5)


class Gltf:
    """A glTF of one rectangle of 2 m x 1 m, two triangles, whose uv are places over its size."""

    def __init__(self, material, images=(), **more):
        self.json = {"asset": {"version": "2.0"}, "buffers": [{}], "bufferViews": [], "accessors": [], "scene": 0,
                     "meshes": [{"primitives": [{"attributes": {}, "material": 0}]}], "nodes": [{"mesh": 0, "name": "wall"}],
                     "scenes": [{"nodes": [0]}], "materials": [dict(name="paint", **material)], "images": list(images),
                     "textures": [{"source": k} for k in range(len(images))], **more}
        self.data = b""
        self.corners = np.array([(0, 0), (2, 0), (2, 1), (0, 0), (2, 1), (0, 1)], np.float32)
        self.attribute("POSITION", np.c_[self.corners, np.zeros(6)].astype(np.float32), 5126, "VEC3", min=[0, 0, 0], max=[2, 1, 0])
        self.attribute("TEXCOORD_0", (self.corners / [2, 1]).astype(np.float32), 5126, "VEC2")

    def view(self, data):
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data + b"\0" * (-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def attribute(self, name, values, component, kind, **more):
        self.json["accessors"].append({"bufferView": self.view(values.tobytes()), "componentType": component, "count": len(values),
                                       "type": kind, **more})
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = len(self.json["accessors"]) - 1

    def text(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        self.json["buffers"] = [{"uri": uri, "byteLength": len(self.data)}]
        return json.dumps(self.json)

    def glb(self):
        self.json["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        whole = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(self.data), b"BIN\0") + self.data
        return b"glTF" + struct.pack("<2I", 2, 12 + len(whole)) + whole


def base_texture(factor=(1, 1, 1, 1), **info):
    return {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **info}, "baseColorFactor": list(factor), "metallicFactor": 0}}


class GltfTexturesTest(TexturesCase):
    def judge(self, store, pixels, to_uv=lambda u, v: (u, v), wrap=("repeat", "repeat"), colour=(1, 1, 1)):
        """Base colours of the rectangle; its u and v are its places over its size."""
        for i in range(len(store.elements)):
            uv = [to_uv(p[0] / 2, p[1]) for p in store.corners(i)]
            self.close(store.reflectance[:, i], mean_of(pixels, uv, wrap) * colour, f"element {i}")

    def test_images_in_all_places(self):
        pixels = noise(30, 20)
        data = png_bytes(pixels)
        self.write("sub/my wood.png", data)
        uri = "data:image/png;base64," + base64.b64encode(data).decode()
        for image in ({"uri": "sub/my%20wood.png"}, {"uri": "sub/my wood.png"}, {"uri": uri}):
            scene = Gltf(base_texture((.5, .75, 1, 1)), [image])
            store, errors = self.store(self.write("a.gltf", scene.text()), "--elements", 8)
            self.assertEqual(errors.count("\n"), 0, errors)
            self.assertEqual(len(store.area), 8)
            self.judge(store, pixels, colour=(.5, .75, 1))
        scene = Gltf(base_texture())
        scene.json["textures"] = [{"source": 0}]
        scene.json["images"] = [{"bufferView": scene.view(data), "mimeType": "image/png"}]
        self.judge(self.store(self.write("a.glb", scene.glb()))[0], pixels)
        self.judge(self.store(self.write("b.gltf", scene.text()))[0], pixels)
        webp = (FIXTURES / "textures" / "tile.webp").read_bytes()
        scene = Gltf(base_texture(), extensionsUsed=["EXT_texture_webp"], extensionsRequired=["EXT_texture_webp"])
        scene.json["images"] = [{"bufferView": scene.view(webp), "mimeType": "image/webp"}]
        scene.json["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
        self.judge(self.store(self.write("a.glb", scene.glb()))[0], decode_png(FIXTURES / "textures" / "tile.webp.png"))

    def test_coordinates_that_are_integers(self):
        pixels = noise(8, 8)
        self.write("a.png", png_bytes(pixels))
        for component, kind, top in (5121, np.uint8, 255), (5123, np.uint16, 65535):
            scene = Gltf(base_texture(), [{"uri": "a.png"}])
            values = np.zeros((6, 4 // kind().itemsize), kind)
            values[:, :2] = scene.corners / [2, 1] * top
            scene.attribute("TEXCOORD_0", values, component, "VEC2", normalized=True)
            scene.json["bufferViews"][-1]["byteStride"] = 4
            store, errors = self.store(self.write("a.gltf", scene.text()), "--elements", 8)
            self.assertEqual(errors, "")
            self.judge(store, pixels)
            self.judge(self.store(self.write("a.glb", scene.glb()), "--elements", 8)[0], pixels)

    def test_transforms_and_samplers(self):
        pixels = noise(30, 20)
        self.write("a.png", png_bytes(pixels))
        angle, c, s = .6, math.cos(.6), math.sin(.6)
        turned = {"extensions": {"KHR_texture_transform": {"offset": [.3, -.2], "rotation": angle, "scale": [2, 1.5]}}}
        codes = {"repeat": 10497, "mirror": 33648, "clamp": 33071}
        for wrap in (("repeat", "mirror"), ("mirror", "clamp"), ("clamp", "repeat")):
            scene = Gltf(base_texture(**turned), [{"uri": "a.png"}], extensionsUsed=["KHR_texture_transform"],
                         samplers=[{"wrapS": codes[wrap[0]], "wrapT": codes[wrap[1]]}])
            scene.json["textures"] = [{"source": 0, "sampler": 0}]
            store, errors = self.store(self.write("a.gltf", scene.text()), "--elements", 8)
            self.assertEqual(errors.count("\n"), 0, errors)
            self.judge(store, pixels, lambda u, v: (c * 2 * u + s * 1.5 * v + .3, -s * 2 * u + c * 1.5 * v - .2), wrap)

    def test_the_lower_left_quadrant_turned_clockwise(self):
        """The example of KHR_texture_transform: v runs downwards."""
        pixels = np.zeros((4, 4, 3), int)
        pixels[2:, :2] = [[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 255)]]
        self.write("a.png", png_bytes(pixels))
        turned = {"extensions": {"KHR_texture_transform": {"offset": [0, 1], "rotation": math.pi / 2, "scale": [.5, .5]}}}
        scene = Gltf(base_texture(**turned), [{"uri": "a.png"}])
        store, _ = self.store(self.write("a.gltf", scene.text()), "--elements", 8)
        # The corner of the quadrant at the lower left comes to the upper left, where u and v are 0.
        self.judge(store, pixels, lambda u, v: (.5 * v, 1 - .5 * u))

    def test_emission_sets_and_colours(self):
        pixels, lamp = noise(30, 20), noise(9, 7, seed=5)
        self.write("a.png", png_bytes(pixels))
        self.write("lamp.png", png_bytes(lamp))
        material = {**base_texture(texCoord=1), "emissiveTexture": {"index": 1}, "emissiveFactor": [1, .5, .25],
                    "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 12}}}
        scene = Gltf(material, [{"uri": "a.png"}, {"uri": "lamp.png"}], extensionsUsed=["KHR_materials_emissive_strength"])
        scene.attribute("TEXCOORD_1", (scene.corners * [1.5, -2]).astype(np.float32), 5126, "VEC2")
        store, errors = self.store(self.write("a.gltf", scene.text()), "--elements", 8)
        self.assertEqual(errors.count("\n"), 0, errors)
        self.judge(store, pixels, lambda u, v: (3 * u, -2 * v))
        for i in range(8):
            uv = [(p[0] / 2, p[1]) for p in store.corners(i)]
            self.close(store.emission[:, i], mean_of(lamp, uv) * (12 * np.pi, 6 * np.pi, 3 * np.pi), f"element {i}")
        # Colours of corners are linear in between, and multiply.
        colours = np.c_[scene.corners[:, 0] / 4, np.full(6, .5), 1 - scene.corners[:, 1] / 2]
        for component, values in ((5126, colours.astype(np.float32)), (5126, np.c_[colours, np.ones(6)].astype(np.float32)),
                                  (5121, np.round(255 * np.c_[colours, np.ones(6)]).astype(np.uint8)),
                                  (5123, np.round(65535 * np.c_[colours, np.ones(6)]).astype(np.uint16))):
            scene = Gltf({"pbrMetallicRoughness": {"baseColorFactor": [.8, .8, .8, 1], "metallicFactor": 0}})
            more = {} if component == 5126 else {"normalized": True}
            scene.attribute("COLOR_0", values, component, f"VEC{values.shape[1]}", **more)
            store, errors = self.store(self.write("a.gltf", scene.text()), "--elements", 32)
            self.assertEqual(errors.count("\n"), 0, errors)
            for i in range(len(store.area)):
                x, y = np.mean(store.corners(i), axis=0)[:2]
                self.close(store.reflectance[:, i], np.multiply(.8, (x / 4, .5, 1 - y / 2)), f"{component}, element {i}")

    def test_cubes_of_others(self):
        """tests/fixtures/gltf-odd, whose pictures are not there: ours take their place."""
        pixels = noise(64, 64)
        for name in ("Cube/Cube.gltf", "Cube-texture-ext/Cube-textransform.gltf"):
            source = (FIXTURES / "gltf-odd" / name)
            document = json.loads(source.read_text())
            self.write("Cube.bin", (source.parent / "Cube.bin").read_bytes())
            for image in document["images"]:
                self.write(image["uri"], png_bytes(pixels))
            material = document["materials"][document["meshes"][0]["primitives"][0]["material"]]
            has_base = "baseColorTexture" in material.get("pbrMetallicRoughness", {})
            store, errors = self.store(self.write("Cube.gltf", source.read_text()))
            self.assertNotIn("image", errors)
            data = (source.parent / "Cube.bin").read_bytes()

            def values(accessor, kind, width):
                a = document["accessors"][accessor]
                view = document["bufferViews"][a["bufferView"]]
                start = view.get("byteOffset", 0) + a.get("byteOffset", 0)
                return np.frombuffer(data, kind, a["count"] * width, start).reshape(-1, width)
            primitive = document["meshes"][0]["primitives"][0]
            index = values(primitive["indices"], np.uint16, 1)[:, 0]
            uv = values(primitive["attributes"]["TEXCOORD_0"], np.float32, 2)
            self.assertEqual(len(store.area), 12)
            if has_base:
                for i in range(12):
                    self.close(store.reflectance[:, i], mean_of(pixels, uv[index[3 * i:3 * i + 3]]), f"triangle {i}")

    def test_left_out_things_have_a_line(self):
        self.write("a.png", png_bytes(noise(4, 4)))
        material = {**base_texture(), "normalTexture": {"index": 0}, "occlusionTexture": {"index": 0}, "alphaMode": "MASK",
                    "extensions": {"KHR_materials_unlit": {}}}
        material["pbrMetallicRoughness"]["metallicFactor"] = 1
        scene = Gltf(material, [{"uri": "a.png"}], extensionsUsed=["KHR_materials_unlit", "KHR_lights_punctual"],
                     extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}]}})
        scene.json["nodes"] += [{"extensions": {"KHR_lights_punctual": {"light": 0}}}] * 2
        _, errors = self.store(self.write("a.gltf", scene.text()))
        for says in ("2 lights (KHR_lights_punctual) are left out: not in the scene that is read",
                     "the alpha of 1 materials (MASK, or in an image) is left out",
                     "normal and occlusion maps of 1 materials", "1 materials are metallic",
                     "these extensions are left out: KHR_materials_unlit (of 2 of 2 faces, 2 of 2 m2)\n"):
            self.assertIn(says, errors)
        self.assertEqual(errors.count("\n"), 5)


class BadImagesTest(TexturesCase):
    """One line each; the scene is read with its plain colours."""

    def check(self, says, image, factor=.4, **more):
        scene = Gltf(base_texture([factor] * 3 + [1]), [image], **more)
        store, errors = self.store(self.write("a.gltf", scene.text()))
        self.assertRegex(errors, f"^lambert precompute: warning: [^\n]*a.gltf: the image '[^\n]*' is not read: {says}")
        self.assertIn("plain colours take its place", errors)
        self.assertEqual(errors.count("\n"), 1, errors)
        np.testing.assert_allclose(store.reflectance, factor)

    def test_bad_images(self):
        whole = png_bytes(noise(30, 20))
        huge = bytearray(whole)
        huge[16:24] = struct.pack(">2I", 60000, 60000)
        huge[29:33] = struct.pack(">I", zlib.crc32(bytes(huge[12:29])))
        jpeg, webp = ((FIXTURES / "textures" / name).read_bytes() for name in ("tile.jpg", "tile.webp"))
        for data, says in ((whole[:len(whole) // 2], "it is damaged .libpng"), (whole[:20], "it is damaged .libpng"),
                           (bytes(huge), "it has 60000 x 60000 pixels, must be 1 to 16384"), (b"", "it is no PNG"),
                           (jpeg[:-200], "it is damaged .libjpeg-turbo: Premature end"), (jpeg[:40], "it is damaged .libjpeg"),
                           (webp[:200], "it is damaged .libwebp"), (webp[:12], "it is damaged .libwebp"),
                           (b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(60), "it is a KTX2, and only PNG, JPEG and WebP are read"),
                           (b"GIF89a" + bytes(60), "it is a GIF"), (b"<svg/>", "it is no PNG, JPEG or WebP"),
                           (bytes(whole[:40]) + b"\xff" * 60 + whole[100:], "it is damaged")):
            self.write("a.png", data)
            self.check(says, {"uri": "a.png"})
            self.check(says, {"uri": "data:image/png;base64," + base64.b64encode(data).decode()})

    def test_images_in_wrong_places(self):
        self.check("it is missing", {"uri": "none.png"})
        self.check("its data URI is not base64", {"uri": "data:image/png,abc"})
        self.check("its data URI is not base64", {"uri": "data:image/png;base64,ab!d"})
        with tempfile.TemporaryDirectory() as other:
            (pathlib.Path(other) / "a.png").write_bytes(png_bytes(noise(4, 4)))
            outside = {"uri": f"../{pathlib.Path(other).name}/a.png"}
            self.check("it lies outside the scene's folder; --assets with its folder lets it be read", outside)
            scene = Gltf(base_texture(), [outside])
            _, errors = self.store(self.write("a.gltf", scene.text()), "--assets", other)
            self.assertEqual(errors, "")
            _, errors = self.store(self.write("a.gltf", Gltf(base_texture(), [{"uri": "a.png"}]).text()), "--assets", other)
            self.assertEqual(errors, "")

    def test_white_beside_an_image_that_is_not_read(self):
        scene = Gltf(base_texture(), [{"uri": "none.png"}])
        store, errors = self.store(self.write("a.gltf", scene.text()))
        np.testing.assert_allclose(store.reflectance, .5)
        self.assertIn("material 'paint' has no colour beside its image; its reflectance is set to 0.5", errors)

    def test_a_broken_file_is_refused(self):
        text = Gltf(base_texture(), [{"uri": "a.png"}]).text()
        done = lambert("precompute", self.write("a.gltf", text[:len(text) // 2]), "-o", self.folder / "no.h5")
        self.assertEqual(done.returncode, 1)


if __name__ == "__main__":
    unittest.main()
