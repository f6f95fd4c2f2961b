"""Black box: pictures of known scenes show what they should, and wrong usage is one line."""

import base64
import json
import os
import resource
import signal
import subprocess
import tempfile
import time
import unittest

import h5py
import numpy

from command import LAMBERT, example, lambert, must
from exr_file import decode_exr
from png_file import decode_png
from patience import PATIENCE

BACKGROUND = 38
GLOW = [word for group in ("floor", "ceiling", "wall-x0", "wall-x1", "wall-y0", "wall-y1", "block-1", "block-2",
                           "block-3") for word in ("--emit", group + "=1")]


class Render(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lambert-render-")
        cls.cornell = cls.make("cornell", "cornell", "--elements", 700)
        cls.furnace = cls.make("furnace", "furnace", "--elements", 300)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @classmethod
    def make(cls, name, kind, *options):
        scene, store = cls.path(name + ".obj"), cls.path(name + ".h5")
        for command in (("generate", kind, *options, "-o", scene),
                        ("precompute", scene, "-o", store, "--method", "exact", "--rays", 1024,
                         "--probes", 4, "--quiet")):
            done = lambert(*command)
            assert done.returncode == 0, done.stderr
        return store

    def draw(self, store, *options, name="picture.png", **more):
        image = self.path(name)
        done = lambert("render", store, *options, "-o", image, **more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return decode_png(image)

    def test_cornell_box_bleeds(self):
        pixels = self.draw(self.cornell, "--size", "240x240").astype(float)
        self.assertEqual(pixels.shape, (240, 240, 3))
        left, right = (pixels[40:200, a:b].mean((0, 1)) for a, b in ((4, 48), (192, 236)))
        self.assertGreater(left[0], 2 * left[1])
        self.assertGreater(right[1], 1.25 * right[0])
        # The white back wall beside each coloured one has some of its colour.
        near_red, near_green = (pixels[70:110, a:b].mean((0, 1)) for a, b in ((54, 70), (170, 186)))
        self.assertGreater(near_red[0] / near_red[1], 1.03 * near_green[0] / near_green[1])
        # The lamp is white and above the middle, the room neither black nor washed out.
        white = numpy.argwhere(pixels.min(2) >= 250)
        self.assertGreater(len(white), 50)
        self.assertTrue((white[:, 0] < 60).all())
        self.assertTrue(60 < pixels.mean() < 190, pixels.mean())

    def test_no_seams(self):
        for option in ([], ["--smooth"]):
            # A room of one brightness: a gap between two elements, or an element left out, would be another.
            pixels = self.draw(self.furnace, *GLOW, "--size", "301x301", *option)
            self.assertEqual(pixels.shape[2], 1)
            scene = pixels[pixels != BACKGROUND]
            self.assertGreater(scene.size, 301 * 301 // 2)
            middle = pixels[90:-90, 30:-30]
            self.assertLessEqual(middle.max() - middle.min(), 1)
            # sRGB of .75, which exposure aims at, is 225; a grey, neither black nor white.
            self.assertTrue(100 < middle.mean() < 240, middle.mean())
            # No background shows through in the coloured room either.
            pixels = self.draw(self.cornell, "--size", "301x301", *option)
            inside = pixels[15:-15, 15:-15].reshape(-1, 3)
            self.assertFalse((inside == BACKGROUND).all(1).any())
            self.assertFalse((inside.max(1) < 3).any())

    def test_same_for_any_number_of_threads(self):
        for option in ([], ["--smooth"], ["--false-color"]):
            one = self.draw(self.cornell, "--size", "130x90", *option, threads=1)
            two = self.draw(self.cornell, "--size", "130x90", *option, threads=2)
            self.assertTrue((one == two).all())

    def test_smooth_is_smoother(self):
        def roughness(pixels):
            return numpy.abs(numpy.diff(pixels[150:165, 10:50, 0], axis=0)).max()

        flat = self.draw(self.cornell, "--size", "240x240")
        smooth = self.draw(self.cornell, "--size", "240x240", "--smooth")
        self.assertLess(2 * roughness(smooth), roughness(flat))

    def test_exposure_and_quantities(self):
        plain = self.draw(self.cornell, "--size", "90x90").mean()
        brighter = self.draw(self.cornell, "--size", "90x90", "--exposure", 1).mean()
        darker = self.draw(self.cornell, "--size", "90x90", "--exposure", -1).mean()
        self.assertGreater(brighter, plain + 10)
        self.assertLess(darker, plain - 10)
        # The lamp's own emission is no part of the light that it receives by reflection.
        indirect = self.draw(self.cornell, "--size", "240x240", "--quantity", "indirect")
        self.assertFalse((indirect.min(2) >= 250).any())
        self.draw(self.cornell, "--size", "90x90", "--quantity", "irradiance")

    def test_emit_chooses_the_light(self):
        warm = self.draw(self.cornell, "--size", "120x120", "--emit", "lamp=1,.2,.1").astype(float)
        cold = self.draw(self.cornell, "--size", "120x120", "--emit", "lamp=.1,.2,1").astype(float)
        self.assertGreater(warm[..., 0].mean(), 2 * warm[..., 2].mean())
        self.assertGreater(cold[..., 2].mean(), cold[..., 0].mean())

    def test_emission_file(self):
        groups = self.path("emission.json")
        with open(groups, "w", encoding="utf-8") as file:
            file.write('{"groups": {"lamp": [1, 0.2, 0.1]}}')
        by_file = self.draw(self.cornell, "--size", "120x120", "--emission", groups)
        by_option = self.draw(self.cornell, "--size", "120x120", "--emit", "lamp=1,.2,.1")
        self.assertTrue((by_file == by_option).all())

    def test_false_color(self):
        pixels = self.draw(self.furnace, *GLOW, "--false-color", "--size", "320x240")
        self.assertEqual(pixels.shape, (240, 320, 3))
        # The legend's top is yellow, its bottom violet.
        self.assertTrue((pixels[:60, -40:] == (253, 231, 37)).all(2).any())
        self.assertTrue((pixels[-60:, -40:] == (68, 1, 84)).all(2).any())

    def test_palettes_and_ranges(self):
        # A furnace of exitance 1 and reflectance rho has the same radiosity 1/(1 - rho) everywhere.
        with h5py.File(self.furnace) as file:
            value = 1 / (1 - file["mesh/reflectance"][0, 0])
        for place, options in ((.25, ("--range", f"0,{4 * value}")),
                               (.5, ("--range", f"{.5 * value},{1.5 * value}")),
                               (2 / 3, ("--range", f"{.01 * value},{10 * value}", "--log"))):
            for palette, colours in (("viridis", {.25: (59, 82, 139), .5: (33, 144, 140), 2 / 3: (53, 183, 121)}),
                                     ("inferno", {.25: (87, 16, 110), .5: (188, 55, 84), 2 / 3: (237, 105, 37)}),
                                     ("turbo", {.25: (38, 188, 225), .5: (149, 251, 81), 2 / 3: (251, 185, 37)})):
                pixels = self.draw(self.furnace, *GLOW, *options, "--palette", palette, "--size", "90x90")
                # The samples of a palette are within 4 of it, the radiosity is right to 1e-3 of its colour.
                self.assertLessEqual(numpy.abs(pixels[45, 45] - colours[place]).max(), 6, (palette, options))
        lines = self.draw(self.cornell, "--iso-lines", 5, "--size", "200x150")
        plain = self.draw(self.cornell, "--false-color", "--smooth", "--size", "200x150")
        changed = (lines != plain).any(2)
        self.assertTrue(.01 < changed.mean() < .2, changed.mean())
        self.assertFalse(changed[:, -40:].any())  # the legend

    def test_exr(self):
        image = self.path("a.exr")
        for options, kind, tolerance in ((), "f2", 2**-11), (("--float",), "f4", 1e-6):
            said = lambert("render", self.cornell, "--size", "61x47", "--exposure", 3, *options, "-o", image)
            self.assertEqual(said.returncode, 0, said.stderr)
            self.assertNotIn("white is", said.stderr)
            planes, notes = decode_exr(image)
            self.assertEqual(sorted(planes), ["B", "G", "R"])
            self.assertEqual((notes["quantity"], notes["unit"], notes["exposure"]), ("radiosity", "W/m2", 0))
            version = lambert("--version").stdout.split()[1]
            self.assertEqual(notes["software"], f"lambert {version}")
            # The same ray through the middle of each pixel: a pixel has the value of one element.
            must("render", self.cornell, "--size", "61x47", "--samples", 1, "-o", image, *options)
            solved = self.path("solved.npy")
            must("solve", self.cornell, "-o", solved)
            planes, _ = decode_exr(image)
            for channel, name in enumerate("RGB"):
                own = numpy.load(solved)[channel].astype(float)
                seen = planes[name][planes[name] > 0].astype(float)
                self.assertGreater(seen.size, 1000)
                nearest = numpy.abs(seen[:, None] - own[None, :]).min(1)
                self.assertLess((nearest / seen).max(), tolerance, kind)
        # One channel; a value that halves do not hold; another quantity and unit.
        said = must("render", self.furnace, *(word.replace("=1", "=1e5") for word in GLOW), "--size", "20x20", "-o",
                    image, "--quantity", "irradiance", "--unit-out", "lx").stderr
        planes, notes = decode_exr(image)
        self.assertEqual(list(planes), ["Y"])
        self.assertEqual((notes["quantity"], notes["unit"]), ("irradiance", "lx"))
        self.assertIn("above 65504", said)
        self.assertEqual(planes["Y"].max(), 65504)
        # Beside the old file, on a full disk too.
        with open(image, "rb") as file:
            older = file.read()
        done = lambert("render", self.cornell, "-o", image, "--size", "400x400", "--smooth",
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192)))
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
        self.assertIn("a.exr: cannot write the picture: ", done.stderr)
        with open(image, "rb") as file:
            self.assertEqual(file.read(), older)
        self.assertFalse([name for name in os.listdir(self.folder.name) if name.startswith(".")])

    def test_samples(self):
        # An edge of two colours has no more shades than rays of a pixel, between them.
        for samples in 1, 4, 16, 64:
            pixels = self.draw(self.furnace, *GLOW, "--camera", "30,20,9,0,0,0,30", "--size", "80x80", "--samples",
                               samples)
            shades = len(numpy.unique(pixels))
            self.assertTrue(shades <= samples + 1 and (samples == 1 or shades > 2), (samples, shades))

    def test_camera(self):
        # From close by, only the back wall, which is white: no channel far from the others.
        pixels = self.draw(self.cornell, "--camera", ".3,.2,.45,.3,.55,.45,20", "--size", "60x40")
        self.assertEqual(pixels.shape, (40, 60, 3))
        self.assertFalse((pixels == BACKGROUND).all(2).any())
        # Away from the scene there is nothing but background.
        pixels = self.draw(self.cornell, "--camera", "-9,-9,9,-10,-10,9,40", "--size", "10x10")
        self.assertTrue((pixels == BACKGROUND).all())

    def test_cameras_of_the_scene(self):
        # Two cameras look along -z at two triangles, the second from further away: it sees less of them.
        triangle = base64.b64encode(numpy.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "<f4").tobytes()).decode()
        nodes = [{"name": "tri", "mesh": 0}, {"name": "near", "camera": 0, "translation": [0, 0, 2]},
                 {"name": "far off", "camera": 0, "translation": [0, 0, 4]}]
        scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}], "nodes": nodes,
                 "cameras": [{"type": "perspective", "perspective": {"yfov": 1.2, "aspectRatio": 1.5, "znear": .1}}],
                 "materials": [{"name": "glow", "emissiveFactor": [1, 1, 1]}],
                 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
                 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0],
                                "max": [1, 1, 0]}],
                 "bufferViews": [{"buffer": 0, "byteLength": 36}],
                 "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + triangle}]}
        file, store = self.path("eyes.gltf"), self.path("eyes.h5")
        with open(file, "w", encoding="utf-8") as out:
            json.dump(scene, out)
        must("precompute", file, "-o", store, "--unit", 10, "--elements", 50, "--probes", 0, "--quiet")
        self.assertIn("cameras           2: near, far off\n", must("info", store).stdout)
        about = json.loads(must("info", store, "--json").stdout)["cameras"]
        self.assertEqual([camera["name"] for camera in about], ["near", "far off"])
        self.assertEqual(about[1]["eye"], [0, 0, 40])
        self.assertEqual((about[0]["direction"], about[0]["up"]), ([0, 0, -1], [0, 1, 0]))
        self.assertAlmostEqual(about[0]["fov"], numpy.degrees(1.2), 4)
        found = example("read_cameras.py", store)
        self.assertEqual(found["names"], ["near", "far off"])
        by_name, by_numbers = (self.draw(store, "--camera", camera, "--size", "40x30")
                               for camera in ("far off", found["numbers"]))
        self.assertLessEqual(numpy.abs(by_name - by_numbers).max(), 1)
        for name, distance in ("near", 20), ("far off", 40):
            pixels = self.draw(store, "--camera", name, "--size", "90x60")
            # The triangle has 200 m2 of the plane that the picture shows, 2 d tan(fov/2) high and 1.5 times as wide.
            height = 2 * distance * numpy.tan(.6)
            self.assertAlmostEqual((pixels[..., 0] != BACKGROUND).mean(), 200 / (1.5 * height**2), delta=.02)
        done = lambert("render", store, "--camera", "side", "-o", self.path("never.png"))
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
        self.assertIn("--camera side: no camera of this name; there are near, far off", done.stderr)
        done = lambert("render", self.cornell, "--camera", "side", "-o", self.path("never.png"))
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
        self.assertIn("came without cameras", done.stderr)

    def test_wrong_usage_is_one_line(self):
        image = self.path("never.png")
        foreign = self.path("foreign.h5")
        with open(foreign, "w", encoding="utf-8") as file:
            file.write("not a store")
        for status, words, arguments in (
                (2, "-o", [self.cornell]),
                (2, "png", [self.cornell, "-o", self.path("never.jpg")]),
                (2, "STORE", ["-o", image]),
                (2, "--size", [self.cornell, "-o", image, "--size", "640"]),
                (2, "--size", [self.cornell, "-o", image, "--size", "-1x5"]),
                (2, "0x5", [self.cornell, "-o", image, "--size", "0x5"]),
                (2, "16385x1", [self.cornell, "-o", image, "--size", "16385x1"]),
                (2, "16384x16384", [self.cornell, "-o", image, "--size", "16384x16384"]),
                (2, "--camera", [self.cornell, "-o", image, "--camera", "1,2,3"]),
                (2, "--camera", [self.cornell, "-o", image, "--camera", "0,0,0,0,0,nan,40"]),
                (2, "field of view", [self.cornell, "-o", image, "--camera", "0,0,0,1,0,0,180"]),
                (2, "two different", [self.cornell, "-o", image, "--camera", "1,1,1,1,1,1,40"]),
                (2, "--exposure", [self.cornell, "-o", image, "--exposure", "bright"]),
                (2, "--quantity", [self.cornell, "-o", image, "--quantity", "beauty"]),
                (2, "--samples", [self.cornell, "-o", image, "--samples", "5"]),
                (2, "--palette", [self.cornell, "-o", image, "--palette", "jet"]),
                (2, "0 <= LO < HI", [self.cornell, "-o", image, "--range", "5,5"]),
                (2, "0 <= LO < HI", [self.cornell, "-o", image, "--range", "-1,5"]),
                (2, "--range", [self.cornell, "-o", image, "--range", "1"]),
                (2, "above 0 with --log", [self.cornell, "-o", image, "--range", "0,1", "--log"]),
                (2, "--iso-lines", [self.cornell, "-o", image, "--iso-lines", "0"]),
                (2, "--float is for", [self.cornell, "-o", image, "--float"]),
                (2, "the values themselves", [self.cornell, "-o", self.path("never.exr"), "--palette", "turbo"]),
                (1, "has no patches; precompute it with --method 2msc",
                 [self.cornell, "-o", image, "--quantity", "coherence"]),
                (1, "has no patches", [self.cornell, "-o", image, "--quantity", "patch"]),
                (1, "precompute it with --keep-form-factors", [self.cornell, "-o", image, "--quantity", "visible"]),
                (1, "has no sky", [self.cornell, "-o", image, "--sky", "a.npy"]),
                (2, "both", [self.cornell, "-o", image, "--emit", "lamp=1", "--emission", "a.npy"]),
                (2, "--frobnicate", [self.cornell, "-o", image, "--frobnicate"]),
                (1, "nonexistent", [self.path("nonexistent.h5"), "-o", image]),
                (1, "foreign", [foreign, "-o", image]),
                (1, "no light of its own", [self.furnace, "-o", image]),
                (1, "nowhere", [self.cornell, "-o", self.path("nowhere/a.png")]),
                (1, "missing.npy", [self.cornell, "-o", image, "--emission", self.path("missing.npy")])):
            done = lambert("render", *arguments)
            self.assertEqual(done.returncode, status, (arguments, done.stderr))
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(words, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertFalse(os.path.exists(image))
        done = lambert("render", self.cornell, "-o", image, "--emit", "cellar=1")
        self.assertIn(done.returncode, (1, 2))
        self.assertIn("cellar", done.stderr)

    def test_full_disk_keeps_the_old_picture(self):
        folder = self.path("full")
        os.mkdir(folder)
        image = os.path.join(folder, "a.png")
        with open(image, "w", encoding="utf-8") as file:
            file.write("older")
        # A limit on file size stands for the full disk; the picture of noise-free colours is larger than it.
        done = lambert("render", self.cornell, "-o", image, "--size", "400x400", "--smooth",
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192)))
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn("a.png", done.stderr)
        self.assertEqual(os.listdir(folder), ["a.png"])
        with open(image, encoding="utf-8") as file:
            self.assertEqual(file.read(), "older")

    def test_interrupted_leaves_nothing(self):
        folder = self.path("interrupted")
        os.mkdir(folder)
        with subprocess.Popen([LAMBERT, "render", self.cornell, "--size", "8192x8192", "-o",
                               os.path.join(folder, "a.png")], stderr=subprocess.PIPE, text=True) as process:
            time.sleep(1)  # into the drawing, which takes tens of seconds; earlier is as good
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=PATIENCE)
        self.assertIn(process.returncode, (1, -signal.SIGINT), errors)
        self.assertEqual(os.listdir(folder), [])

    def test_help(self):
        done = lambert("render", "--help")
        self.assertEqual(done.returncode, 0)
        self.assertIn("--false-color", done.stdout)


class Visible(unittest.TestCase):
    """The number of elements that each one sees, by both ways in which form factors are kept."""

    def test_counts_and_colours(self):
        with tempfile.TemporaryDirectory() as folder:
            for elements, storage in (600, "rows"), (10400, "upper"):
                scene, store, image = (os.path.join(folder, name) for name in ("c.obj", "c.h5", "c.png"))
                must("generate", "city", "--variant", 3, "--elements", elements, "-o", scene)
                must("precompute", scene, "-o", store, "--rays", 64, "--probes", 0, "--method", "sparse",
                     "--threshold", .01, "--keep-form-factors", "--quiet")
                with h5py.File(store) as file:
                    kept = file["form_factors"]
                    self.assertEqual(kept.attrs["storage"].decode(), storage)
                    counts = numpy.diff(kept["indptr"][()].astype(int))
                    if storage == "upper":
                        counts += numpy.bincount(kept["indices"][()], minlength=len(counts))
                said = must("render", store, "--quantity", "visible", "--size", "200x150", "-o", image).stderr
                self.assertIn(f"sees {counts.mean():.3g} others on average, {counts.max():.6g} at most", said)
                self.assertEqual(decode_png(image).shape, (150, 200, 3))
                said = must("render", store, "--quantity", "visible", "--emit", "roof=1", "-o", image).stderr
                self.assertIn("visible does not use --emit", said)


if __name__ == "__main__":
    unittest.main()
