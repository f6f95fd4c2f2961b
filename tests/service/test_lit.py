"""Luminaires of a scene: their direct light against formulas and lumens, dimmers of `lambert solve` for every kind, lamps that are
moved in a store, lights of a glTF, and refusals."""
import base64
import json
import math
import os
import pathlib
import struct
import unittest

import h5py
import numpy as np

from case import Case
from command import lambert, must
from make_store import add_checksums

ASSETS = ("--assets", os.path.join(os.environ["FIXTURES"], "luminaires"))
KINDS = {kind: ("--method", kind) for kind in ("exact", "hierarchical", "low-rank", "2msc", "sparse")}
KINDS["few"] = ("--emitters", "luminaires")
LIST = {
    "luminaires": [
        {"name": "a", "file": "made/lambertian-1000cd.ies", "at": [3, 3, 2.5]},
        {"name": "b", "group": "row", "file": "made/lambertian-1000cd-1x1m.ies", "at": [1.5, 1.5, 3]},
        {"name": "c", "group": "row", "file": "made/asymmetric-0-360.ies", "at": [4.5, 1.5, 2.8], "aim": [0, 0.5, -1], "dim": 0.5,
         "colour": [1, 0.8, 0.5]},
    ]
}


def moved(name, **members):
    return {"luminaires": [dict(l, **members) if l["name"] == name else l for l in LIST["luminaires"]]}


class Lit(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with open(cls.kept("list.json"), "w", encoding="utf-8") as file:
            json.dump(LIST, file)
        must("generate", "box", "--size", "6,6,3", "-o", cls.kept("lit.obj"))
        must("precompute", cls.kept("lit.obj"), "--luminaires", cls.kept("list.json"), *ASSETS, "--elements", 700, "--reflectance", .5,
             "--method", "exact", "--keep-form-factors", "-o", cls.kept("lit.h5"))

    @classmethod
    def kept(cls, name):
        """A file for all tests."""
        return os.path.join(cls.shared.name, name)

    def write(self, name, value):
        with open(self.path(name), "w", encoding="utf-8") as file:
            json.dump(value, file)
        return self.path(name)

    def solve(self, store, *options):
        out = self.path("out.npy")
        must("solve", store, *options, "-o", out)
        return np.load(out).astype(float)

    def columns(self, store):
        with h5py.File(store) as file:
            return {name: file["luminaires"][name][()] for name in file["luminaires"]}, file["mesh/area"][()]

    def test_all_lumens_come_to_the_elements(self):
        found, area = self.columns(self.kept("lit.h5"))
        np.testing.assert_allclose(found["irradiance"] @ area, found["lumens"], rtol=1e-3)
        self.assertEqual([n.decode() for n in found["names"]], ["a", "b", "c"])
        self.assertAlmostEqual(found["lumens"][0], 1000 * math.pi, delta=1e-3 * 1000 * math.pi)

    def test_answers_of_every_kind_are_those_of_the_columns(self):
        found, _ = self.columns(self.kept("lit.h5"))
        for kind, options in KINDS.items():
            must("precompute", self.kept("lit.h5"), *options, "--probes", "0", "-o", self.path(kind + ".h5"))
            kept, _ = self.columns(self.path(kind + ".h5"))
            np.testing.assert_array_equal(kept["irradiance"], found["irradiance"])
            H0 = 0.25 * found["irradiance"][0].astype(float)
            np.save(self.path("E.npy"), (0.5 * H0).astype(np.float32))
            for quantity in ("radiosity", "irradiance", "indirect"):
                by_dimmer = self.solve(self.path(kind + ".h5"), "--dim", "a=0.25", "--quantity", quantity, "--linear")
                # Light of elements that emit what the direct light makes them reflect, with that light beside it. A store of few
                # emitters answers for these alone, converged to 1e-6; the exact one, made before, knows the others.
                store = self.path("exact.h5" if kind == "few" else kind + ".h5")
                by_elements = self.solve(store, "--emission", self.path("E.npy"), "--quantity", quantity, "--linear")
                beside = {"radiosity": 0, "irradiance": H0, "indirect": 0}[quantity]
                np.testing.assert_allclose(by_dimmer, by_elements + beside, rtol=0, atol=2e-6 * abs(by_dimmer).max())

    def test_dimmers_by_name_group_and_file(self):
        alone = {name: self.solve(self.kept("lit.h5"), "--dim", f"{name}=1", "--linear") for name in "abc"}
        most = max(x.max() for x in alone.values())
        row = self.solve(self.kept("lit.h5"), "--dim", "row=0.4", "--linear")
        np.testing.assert_allclose(row, 0.4 * (alone["b"] + alone["c"]), atol=1e-5 * most)
        own = self.solve(self.kept("lit.h5"), "--linear")
        np.testing.assert_allclose(own, alone["a"] + alone["b"] + 0.5 * alone["c"], atol=1e-5 * most)
        beside = self.solve(self.kept("lit.h5"), "--dim", "row=1", "--dim", "b=0", "--emit", "floor=10", "--linear")
        floor = self.solve(self.kept("lit.h5"), "--emit", "floor=10", "--linear")
        np.testing.assert_allclose(beside, alone["c"] + floor, atol=1e-5 * most)
        self.write("e.json", {"emissions": [{"luminaires": {"row": 1}}, {"groups": {"floor": 10}}]})
        batch = self.solve(self.kept("lit.h5"), "--emission", self.path("e.json"), "--linear")
        np.testing.assert_allclose(batch[0].ravel(), (alone["b"] + alone["c"]).ravel(), atol=1e-5 * most)
        np.testing.assert_allclose(batch[1].ravel(), floor.ravel(), atol=1e-5 * most)
        refined = self.solve(self.kept("lit.h5"), "--dim", "a=1", "--tolerance", "1e-6")
        np.testing.assert_allclose(refined, alone["a"], atol=1e-4 * most)

    def test_a_moved_lamp_costs_its_column(self):
        self.write("moved.json", moved("a", at=[3, 4, 2.5]))
        result = must("precompute", self.kept("lit.h5"), "--luminaires", self.path("moved.json"), *ASSETS,
                              "-o", self.path("moved.h5"), "--verbose")
        self.assertIn("2 of 3 luminaires have the light that the store had", result.stderr)
        before, after = self.columns(self.kept("lit.h5"))[0], self.columns(self.path("moved.h5"))[0]
        np.testing.assert_array_equal(before["irradiance"][1:], after["irradiance"][1:])
        self.assertGreater(abs(before["irradiance"][0] - after["irradiance"][0]).max(), 1)
        with h5py.File(self.kept("lit.h5")) as a, h5py.File(self.path("moved.h5")) as b:
            for group in ("mesh", "operator", "form_factors", "error"):
                for name in a[group]:
                    if isinstance(a[group][name], h5py.Dataset):
                        np.testing.assert_array_equal(a[group][name][()], b[group][name][()])
                self.assertEqual(dict(a[group].attrs), dict(b[group].attrs))
        # The error of the mesh is stated for the lamps that are there now.
        must("precompute", self.kept("lit.obj"), "--luminaires", self.path("moved.json"), *ASSETS, "--elements", 700, "--reflectance",
             .5, "--method", "exact", "-o", self.path("fresh.h5"))
        with h5py.File(self.kept("lit.h5")) as a, h5py.File(self.path("moved.h5")) as b, h5py.File(self.path("fresh.h5")) as c:
            old, new, fresh = (file["error/mesh"] for file in (a, b, c))
            self.assertEqual(dict(new.attrs), dict(fresh.attrs))
            self.assertNotEqual(new.attrs["luminaire"], old.attrs["luminaire"])
            np.testing.assert_array_equal(new["luminaire_variation"][()], fresh["luminaire_variation"][()])
            self.assertEqual(dict(b["error/own"].attrs), dict(c["error/own"].attrs))
            self.assertNotEqual(dict(a["error/own"].attrs), dict(b["error/own"].attrs))
        must("precompute", self.kept("lit.h5"), "--luminaires", "none", "-o", self.path("none.h5"))
        with h5py.File(self.path("none.h5")) as file:
            self.assertNotIn("luminaires", file)
            self.assertNotIn("own", file["error"])

    def test_the_headline_is_of_the_scene_s_own_light(self):
        """Of its lamps and luminaires, by the laws of answers: the error of direct light behind boxes is in it."""
        must("generate", "cornell", "--elements", 300, "-o", self.path("boxes.obj"))
        lights = {"luminaires": [{"name": "a", "file": "made/lambertian-1000cd.ies", "at": [.3, .5, .3], "aim": [1, 0, 0]}]}
        must("precompute", self.path("boxes.obj"), "--mesh", "faces", "--lights", "lm", "--luminaires", self.write("boxes.json", lights), *ASSETS,
             "-o", self.path("boxes.h5"))
        must("precompute", self.path("boxes.h5"), "--luminaires", self.path("boxes.json"), *ASSETS, "-o", self.path("again.h5"))
        with h5py.File(self.path("boxes.h5")) as first, h5py.File(self.path("again.h5")) as again:
            self.assertGreater(first["luminaires/elements_off"][()].max(), 0)
            self.assertEqual(dict(first["error/own"].attrs), dict(again["error/own"].attrs))
        told = json.loads(must("info", self.path("boxes.h5"), "--json").stdout)["error"]
        must("solve", self.path("boxes.h5"), "--linear", "-o", self.path("own.json"))
        answer = json.loads(pathlib.Path(self.path("own.json")).read_text(encoding="utf-8"))["error"]
        self.assertEqual(told["light"], "lights")
        for name, value in answer["parts"].items():
            self.assertAlmostEqual(told["parts"][name], value, delta=1e-5 * answer["stated"])
        self.assertAlmostEqual(told["own"]["indirect"], answer["indirect_mean"], delta=1e-5 * answer["indirect_mean"])

    def test_luminaires_as_sources(self):
        """Their light is kept where it comes from the elements that they light; the error that is stated covers it, and other light has
        none."""
        own = ("--luminaires", self.kept("list.json"), *ASSETS, "--elements", 3000, "--reflectance", .5, "--method", "hierarchical",
               "--epsilon", .3, "--trials", 1)
        for name, options in ("all", ()), ("lit", ("--sources", "luminaires")), ("both", ("--sources", "ceiling,luminaires")):
            must("precompute", self.kept("lit.obj"), *own, *options, "-o", self.path(name + ".h5"))
        must("precompute", self.kept("lit.obj"), "--luminaires", self.kept("list.json"), *ASSETS, "--elements", 3000, "--reflectance", .5,
             "--method", "exact", "--probes", 0, "-o", self.path("exact.h5"))
        with h5py.File(self.path("lit.h5")) as lit, h5py.File(self.path("both.h5")) as both, h5py.File(self.path("all.h5")) as every:
            x = 0.5 * lit["luminaires/irradiance"][()].astype(float)
            area = lit["mesh/area"][()]
            s = np.max([np.minimum(h / (h @ area / area[h > 0].sum()), 1) for h in x], axis=0)
            np.testing.assert_array_equal(lit["sources/elements"][()], np.flatnonzero(s >= 1 / 16))
            np.testing.assert_allclose(lit["sources/weights"][()], s[s >= 1 / 16], rtol=1e-6)
            self.assertEqual(lit["sources"].attrs["luminaires"], 1)
            ceiling = np.flatnonzero(lit["mesh/group"][()] == [n.decode() for n in lit["mesh/group_names"]].index("ceiling"))
            self.assertFalse(np.isin(ceiling, lit["sources/elements"][()]).all())
            self.assertTrue(np.isin(ceiling, both["sources/elements"][()]).all())
            self.assertEqual(dict(lit["error/own"].attrs).keys(), dict(every["error/own"].attrs).keys())
        truth = self.solve(self.path("exact.h5"), "--linear")
        for name in "lit", "both":
            must("solve", self.path(name + ".h5"), "--linear", "-o", self.path("o.json"))
            answer = json.loads(pathlib.Path(self.path("o.json")).read_text(encoding="utf-8"))
            self.assertEqual(answer["error"]["from"], "sources")
            off = np.array(answer["radiosity"], float).ravel() - truth.ravel()
            indirect = self.solve(self.path("exact.h5"), "--quantity", "indirect", "--linear").ravel()
            error = math.sqrt((area * off**2).sum() / (area * indirect**2).sum())
            # The figure is a mean over probes and has the noise of eight of them.
            self.assertLess(error, 2 * answer["error"]["indirect_mean"], name)
        must("solve", self.path("lit.h5"), "--emit", "ceiling=1", "-o", self.path("o.json"))
        self.assertEqual(json.loads(pathlib.Path(self.path("o.json")).read_text(encoding="utf-8"))["error"]["from"], "others")
        self.failed("was built for the light of the luminaires that it has", "precompute", self.path("lit.h5"), "--luminaires", "none",
                    "-o", self.path("no.h5"))
        self.failed("--sources luminaires: there are none", "precompute", self.kept("lit.obj"), "--sources", "luminaires", "-o",
                    self.path("no.h5"))
        self.assertIn("3, the light of 3 of them", must("verify", self.path("lit.h5")).stdout)

    def test_verify_sees_a_wrong_column(self):
        self.assertIn("3, the light of 3 of them was found again", must("verify", self.kept("lit.h5")).stdout)
        data = pathlib.Path(self.kept("lit.h5")).read_bytes()
        for factor, words in ((1.05, "elements receive"), (0.95, "other light than its place and table do")):
            wrong = pathlib.Path(self.path("wrong.h5"))
            wrong.write_bytes(data)
            with h5py.File(wrong, "r+") as file:
                file["luminaires/irradiance"][1] *= factor
                add_checksums(file)
            result = lambert("verify", str(wrong))
            self.assertEqual(result.returncode, 1)
            self.assertIn(words, result.stdout)

    def test_lights_of_a_gltf(self):
        corners = [(0, 0, 0), (4, 0, 0), (4, 0, 4), (0, 0, 4), (0, 3, 0), (4, 3, 0), (4, 3, 4), (0, 3, 4)]
        quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5), (3, 0, 4, 7)]
        index = [i for q in quads for i in (q[0], q[1], q[2], q[0], q[2], q[3])]
        raw = b"".join(struct.pack("<3f", *p) for p in corners) + struct.pack(f"<{len(index)}H", *index)
        lights = [{"type": "point", "name": "bulb", "intensity": 100}, {"type": "directional", "intensity": 1000}]
        must_have = {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [2, 2, 2]}
        self.write("room.gltf", {
            "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": lights}}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
            "nodes": [{"mesh": 0}, must_have, {"extensions": {"KHR_lights_punctual": {"light": 1}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}],
            "buffers": [{"byteLength": len(raw),
                         "uri": "data:application/octet-stream;base64," + base64.b64encode(raw).decode()}],
            "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [4, 3, 4]},
                          {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}]})
        result = must("precompute", self.path("room.gltf"), "--elements", "600", "--probes", "0", "-o", self.path("room.h5"))
        self.assertIn("1 directional light comes from outside and is no luminaire", result.stderr)
        H = self.solve(self.path("room.h5"), "--dim", "bulb=2", "--quantity", "irradiance")
        with h5py.File(self.path("room.h5")) as file:
            area, lights = file["mesh/area"][()], file["mesh"].attrs["lights"]
        self.assertEqual(lights, b"lm")
        # A closed room of one reflectance: its mean irradiance is flux / (area (1 - rho)).
        mean = 2 * 100 * 4 * math.pi / (area.sum() * 0.5)
        self.assertAlmostEqual((area * H.ravel()).sum() / area.sum(), mean, delta=1e-3 * mean)

    def test_refusals(self):
        box, out, own = self.kept("lit.obj"), ("-o", self.path("refused.h5")), self.kept("list.json")
        self.write("ignore.json", moved("a", ignore=["celing"]))
        self.write("twice.json", {"luminaires": LIST["luminaires"][:1] * 2})
        must("generate", "cornell", "-o", self.path("cornell.obj"))
        must("precompute", box, "--elements", 300, "--emitters", "group=floor", "--probes", 0, "-o", self.path("few.h5"))
        for words, scene, luminaires, *more in (
                ("celing", box, self.path("ignore.json")),
                ("name = a", box, self.path("twice.json")),
                ("luminaires count in lm", box, own, "--lights", "W"),
                ("give --lights lm", self.path("cornell.obj"), own),
                ("answers for the emitters", self.path("few.h5"), own)):
            with self.subTest(words):
                self.failed(words, "precompute", scene, "--luminaires", luminaires, *ASSETS, *more, *out)
        self.assertFalse(os.path.exists(self.path("refused.h5")))
        self.refused(1, 'no luminaire "d"', "solve", self.kept("lit.h5"), "--dim", "d=1")
        self.refused(1, "the store has no luminaires", "solve", self.store, "--dim", "a=1")
        self.refused(2, "must be from 0", "solve", self.kept("lit.h5"), "--dim", "a=-1")
        self.refused(2, "without a unit", "solve", self.kept("lit.h5"), "--dim", "a=1lm")
        self.refused(2, "must be NAME=V", "solve", self.kept("lit.h5"), "--dim", "a")


if __name__ == "__main__":
    unittest.main()
