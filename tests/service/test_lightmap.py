"""Lightmaps: texels of every scene against elements, sensors and formulas, by the files alone, and refusals."""
import json
import os
import pathlib
import struct
import unittest

import h5py
import numpy as np

from case import Case
from command import lambert, must
from exr_file import decode_exr
from png_file import decode_png_bytes

ASSETS = ("--assets", os.path.join(os.environ["FIXTURES"], "luminaires"))
BORDER = 2


class Glb:
    """A glTF with a lightmap: its values [height][width][channels] and, by element, corners, places in the map and groups."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.json, self.binary = json.loads(data[20:20 + length]), data[28 + length:]
        image = self.json["bufferViews"][self.json["images"][-1]["bufferView"]]
        self.png = self.binary[image["byteOffset"]:image["byteOffset"] + image["byteLength"]]
        values = decode_png_bytes(self.png, path) / 65535
        about = self.json["extras"]["lambert"]["lightmap"]
        if about["encoding"] == "sRGB":
            values = np.where(values <= .04045, values / 12.92, ((values + .055) / 1.055) ** 2.4)
        self.white, self.unit, self.values = about["white"], about["unit"], values * about["white"]
        self.elements = {}  # number: (group, corners [k][3], places [k][2] in texels)
        for node in self.json["nodes"][1:]:
            attributes = self.json["meshes"][node["mesh"]]["primitives"][0]["attributes"]
            number, at, place = (self.array(attributes[name]) for name in ("_ELEMENT", "POSITION", "TEXCOORD_1"))
            starts = [0, *(np.flatnonzero(np.diff(number[:, 0])) + 1), len(number)]
            for first, last in zip(starts, starts[1:]):
                self.elements[int(number[first, 0])] = (node["name"], at[first:last], place[first:last] * self.values.shape[1::-1])

    def array(self, number):
        about = self.json["accessors"][number]
        view, width = self.json["bufferViews"][about["bufferView"]], {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[about["type"]]
        return np.frombuffer(self.binary, {5126: "<f4", 5125: "<u4"}[about["componentType"]], width * about["count"],
                             view["byteOffset"] + about["byteOffset"]).reshape(-1, width)


def sample(values, places):
    """Bilinear values at places in texels, as a graphics processor finds them."""
    low = np.floor(places - .5).astype(int)
    share = places - .5 - low
    found = 0
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.where(dx, share[:, 0], 1 - share[:, 0]) * np.where(dy, share[:, 1], 1 - share[:, 1])
            x, y = (np.clip(low[:, d] + step, 0, values.shape[1 - d] - 1) for d, step in ((0, dx), (1, dy)))
            found = found + weight[:, None] * values[y, x]
    return found


def inner(corners, k=3):
    """k * k points of a quad that share its area evenly, where it is a parallelogram; the centroid of a triangle."""
    if len(corners) == 3:
        return corners.mean(0)[None]
    s = (np.arange(k) + .5) / k
    u, v = (x.ravel()[:, None] for x in np.meshgrid(s, s))
    return (1 - u) * (1 - v) * corners[0] + u * (1 - v) * corners[1] + u * v * corners[2] + (1 - u) * v * corners[3]


def means(values, glb):
    """Of each group by area, as a viewer shows them."""
    sums = {}
    for group, at, place in glb.elements.values():
        area = .5 * np.linalg.norm(sum(np.cross(at[k] - at[0], at[k + 1] - at[0]) for k in range(1, len(at) - 1)))
        have = sums.setdefault(group, [0, 0])
        have[0] += area
        have[1] = have[1] + area * sample(values, inner(place)).mean(0)
    return {group: light / area for group, (area, light) in sums.items()}


class Lightmap(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.kept = pathlib.Path(cls.shared.name)
        must("generate", "cornell", "--elements", 700, "-o", cls.kept / "c.obj")
        cls.cornell = cls.kept / "c.h5"
        must("precompute", cls.kept / "c.obj", "--method", "exact", "--probes", 0, "--keep-form-factors", "-o", cls.cornell)
        for name, options in (("c.glb", ()), ("c.exr", ()), ("e.glb", ("--emissive",)), ("e.exr", ("--quantity", "radiosity"))):
            must("solve", cls.cornell, "--at", "texels", "--texel", .03, *options, "-o", cls.kept / name)
        cls.glb, cls.exr = Glb(cls.kept / "c.glb"), cls.read(cls.kept / "c.exr")

    @staticmethod
    def read(path):
        channels, about = decode_exr(path)
        return np.stack([channels[c] for c in ("RGB" if "R" in channels else "Y")], -1).astype(float)

    def test_both_files_hold_one_map(self):
        self.assertEqual(self.glb.values.shape, self.exr.shape)
        self.assertEqual(decode_exr(self.kept / "c.exr")[1]["quantity"], "irradiance")
        inside = self.exr <= self.glb.white
        self.assertGreater(inside.mean(), .98)
        np.testing.assert_allclose(self.glb.values[inside], self.exr[inside], atol=self.glb.white / 65535)
        np.testing.assert_allclose(self.glb.values[~inside], self.glb.white)
        for material in self.glb.json["materials"]:
            lightmap = material["extensions"]["MOZ_lightmap"]
            self.assertEqual((lightmap["index"], lightmap["texCoord"]), (0, 1))
            # a white surface under four means of the irradiance is shown as 1
            self.assertAlmostEqual(lightmap["intensity"] * self.glb.white ** -1 / np.pi,
                                   1 / (4 * self.mean_irradiance()), delta=.03 / (4 * self.mean_irradiance()))

    def mean_irradiance(self):
        glb = self.glb
        areas = {g: 0 for g, _, _ in glb.elements.values()}
        for g, at, _ in glb.elements.values():
            areas[g] += .5 * np.linalg.norm(sum(np.cross(at[k] - at[0], at[k + 1] - at[0]) for k in range(1, len(at) - 1)))
        found = means(self.exr, glb)
        return sum(areas[g] * found[g].mean() for g in areas) / sum(areas.values())

    def test_an_emissive_map_is_the_radiosity(self):
        glb, exr = Glb(self.kept / "e.glb"), self.read(self.kept / "e.exr")
        inside = exr <= glb.white
        # of 16 bits of sRGB a step is at most 1 / 65535 / 12.92 near black, and 2.4 / 65535 at white
        np.testing.assert_allclose(glb.values[inside], exr[inside], atol=2.4 * glb.white / 65535)
        for material in glb.json["materials"]:
            self.assertEqual((material["emissiveFactor"], material["emissiveTexture"]), ([1, 1, 1], {"index": 0}))
            self.assertNotIn("extensions", material)
        must("solve", self.cornell, "--quantity", "radiosity", "-o", self.path("B.npy"))
        B = np.load(self.path("B.npy"))
        with h5py.File(self.cornell) as file:
            E, rho = file["mesh/emission"][()], file["mesh/reflectance"][()]
        irradiance = self.exr
        for number, (group, _, place) in self.glb.elements.items():
            x, y = place.mean(0).astype(int)
            wanted = E[:, number] + rho[:, number] * irradiance[y, x]
            np.testing.assert_allclose(exr[y, x], wanted, rtol=1e-5, err_msg=group)
            if group == "lamp":
                np.testing.assert_allclose(exr[y, x], B[:, number], rtol=.02)

    def test_texels_are_what_sensors_receive(self):
        rng, chosen, points = np.random.default_rng(5), [], []
        for number in rng.choice(sorted(self.glb.elements), 40, replace=False):
            group, at, place = self.glb.elements[number]
            pixel = place.mean(0).astype(int)
            if len(at) != 4 or group == "lamp":
                continue
            # the centre of the texel, in the plane of the element, z up
            share = np.linalg.solve(np.array([place[1] - place[0], place[3] - place[0]]).T, pixel + .5 - place[0])
            x, y, z = at[0] + share @ np.array([at[1] - at[0], at[3] - at[0]])
            nx, ny, nz = np.cross(at[1] - at[0], at[3] - at[0]) / np.linalg.norm(np.cross(at[1] - at[0], at[3] - at[0]))
            if (share > 0).all() and (share < 1).all():
                chosen.append(pixel)
                points.append({"name": f"p{number}", "at": [[float(x), float(-z), float(y)]], "normal": [float(nx), float(-nz), float(ny)]})
        self.assertGreaterEqual(len(points), 10)
        with open(self.path("s.json"), "w", encoding="utf-8") as file:
            json.dump({"points": points}, file)
        must("precompute", self.cornell, "--sensors", self.path("s.json"), "--quality", "high", "-o", self.path("s.h5"))
        answer = json.loads(must("solve", self.path("s.h5"), "--sensors", "all", "--json").stdout)["sensors"]
        wanted = np.array([np.array(one["values"], float).reshape(3) for one in answer])
        found = np.array([self.exr[y, x] for x, y in chosen])
        # Noise of 1,024 rays is about .013 of what is not direct; below bodies neither has a value.
        seen = ~np.isnan(wanted).any(1)
        off = np.abs(found - wanted)[seen] / wanted[seen]
        self.assertGreater(seen.sum(), 9)
        self.assertLess(off.mean(), .015)
        self.assertLess(off.max(), .06)

    def test_area_means_of_groups_are_those_of_elements(self):
        must("generate", "box", "--divisions", 8, "--reflectance", .6, "-o", self.path("b.obj"))
        must("precompute", self.path("b.obj"), "--method", "exact", "--probes", 0, "-o", self.path("b.h5"))
        light = ("solve", self.path("b.h5"), "--emit", "ceiling=100")
        must(*light, "--at", "texels", "-o", self.path("b.glb"))
        found = means(Glb(self.path("b.glb")).values, Glb(self.path("b.glb")))
        for group, mean in found.items():
            stated = json.loads(must(*light, "--quantity", "irradiance", "--reduce", f"{group}=mean", "--json").stdout)
            wanted = stated["groups"][group]["mean"]
            self.assertAlmostEqual(mean[0] / wanted, 1, delta=.01, msg=group)

    def test_a_furnace_is_one_value_everywhere(self):
        must("generate", "box", "--divisions", 5, "--reflectance", .5, "-o", self.path("f.obj"))
        must("precompute", self.path("f.obj"), "--method", "exact", "--probes", 0, "-o", self.path("f.h5"))
        groups = ("floor", "ceiling", "wall-x0", "wall-x1", "wall-y0", "wall-y1")
        must("solve", self.path("f.h5"), *(x for g in groups for x in ("--emit", f"{g}=1")), "--at", "texels", "-o", self.path("f.exr"))
        values = self.read(self.path("f.exr"))
        lit = values[values > 0]
        # Rows of a closed scene sum to 1, and B is uniform to the noise of form factors: texels differ by rounding.
        self.assertLess(lit.std() / lit.mean(), 2e-3)
        self.assertGreater((values > 0).mean(), .7)

    def test_no_texel_near_an_edge_is_unlit(self):
        for _, _, place in self.glb.elements.values():
            for x, y in place:
                for dx in range(-BORDER, BORDER):
                    for dy in range(-BORDER, BORDER):
                        # the four texels on either side of each corner of an element
                        self.assertTrue((self.exr[int(round(y)) + dy, int(round(x)) + dx] > 0).any())

    def test_light_of_luminaires_and_of_the_sky_comes_to_texels_themselves(self):
        must("generate", "box", "--size", "6,6,3", "-o", self.path("room.obj"))
        with open(self.path("l.json"), "w", encoding="utf-8") as file:
            json.dump({"luminaires": [{"name": "a", "file": "made/lambertian-1000cd.ies", "at": [3, 3, 2.5]}]}, file)
        must("precompute", self.path("room.obj"), "--reflectance", 0, "--luminaires", self.path("l.json"), *ASSETS, "--elements", 600,
             "--method", "exact", "--probes", 0, "-o", self.path("r.h5"))
        must("solve", self.path("r.h5"), "--dim", "a=2", "--at", "texels", "--texel", .25, "-o", self.path("r.glb"))
        must("solve", self.path("r.h5"), "--dim", "a=2", "--at", "texels", "--texel", .25, "-o", self.path("r.exr"))
        glb, values, n = Glb(self.path("r.glb")), self.read(self.path("r.exr")), 0
        self.assertEqual(glb.unit, "lx")
        corners = [(at, place) for group, at, place in glb.elements.values() if group == "floor"]
        at, place = np.concatenate([a for a, _ in corners]), np.concatenate([p for _, p in corners])
        fit = np.linalg.lstsq(np.c_[place, np.ones(len(place))], at, rcond=None)[0]
        low, high = place.min(0), place.max(0)
        for y in range(round(low[1]), round(high[1])):
            for x in range(round(low[0]), round(high[0])):
                point = np.array([x + .5, y + .5, 1]) @ fit
                across2 = (point[0] - 3) ** 2 + (-point[2] - 3) ** 2
                # 2 * 1000 cd cos, 2.5 m above the floor
                self.assertAlmostEqual(values[y, x, 0] / (2000 * 2.5 ** 2 / (2.5 ** 2 + across2) ** 2), 1, delta=2e-3)
                n += 1
        self.assertEqual(n, 24 * 24)

    def test_an_open_square_under_a_uniform_sky(self):
        with open(self.path("q.obj"), "w", encoding="utf-8") as file:
            file.write("o square\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\n")
        must("precompute", self.path("q.obj"), "--elements", 16, "--fix", "--sky", "tregenza", "--reflectance", .5, "--probes", 0, "-o",
             self.path("q.h5"))
        np.save(self.path("L.npy"), np.full(145, 100, "<f4"))
        must("solve", self.path("q.h5"), "--sky", self.path("L.npy"), "--at", "texels", "-o", self.path("q.exr"))
        values = self.read(self.path("q.exr"))
        np.testing.assert_allclose(values[values > 0], 100 * np.pi, rtol=2e-3)
        self.assertEqual((values > 0).sum(), values.size)

    def test_a_floor_between_backs_of_thin_walls(self):
        """More than half of its rays meet backs, as in a body, and the map has the light that the elements have."""
        vertices = [(x, y, z) for z in (0, .5) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        walls = [(a + 1, b + 1, b + 5, a + 5) for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))]
        lines = [f"v {x} {y} {z}" for x, y, z in vertices] + ["g floor", "f 1 2 3 4", "g walls"] + ["f %d %d %d %d" % w for w in walls]
        pathlib.Path(self.path("w.obj")).write_text("\n".join(lines) + "\n", encoding="ascii")
        must("precompute", self.path("w.obj"), "--reflectance", 0, "--elements", 600, "--sky", "tregenza", "--probes", 0, "-o", self.path("w.h5"))
        light = ("solve", self.path("w.h5"), "--sky", "even")
        must(*light, "--at", "texels", "--texel", .03, "-o", self.path("w.glb"))
        glb = Glb(self.path("w.glb"))
        stated = json.loads(must(*light, "--quantity", "irradiance", "--reduce", "floor=mean", "--json").stdout)["groups"]["floor"]["mean"]
        # The factor of two unit squares half a unit apart is .4153 (Hottel and Sarofim 1967), under 10,000 lx.
        self.assertAlmostEqual(stated / 4153, 1, delta=.01)
        self.assertAlmostEqual(means(glb.values, glb)["floor"][0] / 4153, 1, delta=.01)

    def test_threads_change_no_bit(self):
        for threads in "1", "2":
            must("solve", self.cornell, "--at", "texels", "--texel", .05, "-o", self.path(f"{threads}.exr"),
                 threads=threads)
        self.assertEqual(pathlib.Path(self.path("1.exr")).read_bytes(), pathlib.Path(self.path("2.exr")).read_bytes())

    def test_refusals(self):
        texels = ("solve", self.cornell, "--at", "texels")
        self.refused(2, "is for -o FILE.glb or FILE.exr", *texels)
        self.refused(2, "goes into .glb or .exr only", *texels, "-o", self.path("x.png"))
        self.refused(2, "leave out --reduce", *texels, "--reduce", "floor=mean", "-o", self.path("x.exr"))
        self.refused(2, "leave out --tolerance", *texels, "--tolerance", .1, "-o", self.path("x.exr"))
        self.refused(2, "--texel is for --at texels", "solve", self.cornell, "--texel", .1)
        self.refused(2, "--emissive is for --at texels", "solve", self.cornell, "--emissive")
        self.refused(2, "by --emissive, or into .exr", *texels, "--quantity", "radiosity", "-o", self.path("x.glb"))
        self.refused(2, "shows --quantity radiosity", *texels, "--quantity", "irradiance", "--emissive", "-o", self.path("x.glb"))
        self.refused(2, "not indirect light", *texels, "--quantity", "indirect", "-o", self.path("x.exr"))
        self.failed("beyond single precision", *texels, "--texel", 1, "--emit", "lamp=3e38", "--emit", "floor=3e38", "-o",
                    self.path("x.glb"))
        self.failed("4194304 texels that a lightmap may have at most; give 0.0", *texels, "--texel", 1e-4, "-o", self.path("x.exr"))
        np.save(self.path("E.npy"), np.ones((2, h5py.File(self.cornell)["mesh/group"].shape[0]), "<f4"))
        with open(self.path("b.json"), "w", encoding="utf-8") as file:
            json.dump({"emissions": [{"groups": {"lamp": 1}}, {"groups": {"lamp": 2}}]}, file)
        self.failed("a lightmap is of one light, and this is a batch of 2", *texels, "--emission", self.path("b.json"), "-o",
                    self.path("x.exr"))
        self.assertFalse([name for name in os.listdir(self.folder) if name.startswith("x")])
        advised = lambert(*texels, "--texel", 1e-4, "-o", self.path("x.exr")).stderr.split("give ")[1].split()[0]
        self.assertLess(float(advised), .002)


if __name__ == "__main__":
    unittest.main()
