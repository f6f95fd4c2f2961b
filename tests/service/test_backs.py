"""Backs of faces: groups of their own beside those of the fronts, of all faces by `--two-sided` and of double-sided materials
of a glTF; and instances of its meshes."""

import base64
import json
import math
import pathlib
import struct
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert, must
from daemon import Daemon
from make_store import add_checksums
from png_file import decode_png

# Two parallel unit squares at distance 1 (Howell, C-11); a pair with nothing between it is found to 1e-6.
FACING = 2 / math.pi * (math.log(4 / 3) / 2 + 2 * math.sqrt(2) * math.atan(1 / math.sqrt(2)) - 2 * math.atan(1))
NEAR = 1e-5
QUICK = "--quiet", "--probes", 0
SKY = "--sky", "tregenza"
GREY, LAMP = {"Kd": ".5 .5 .5", "Ke": "0 0 0"}, {"Kd": "0 0 0", "Ke": "1 1 1"}


def square(height, size=1.0, at=(0, 0)):
    """A square that looks up."""
    (x, y), s = at, size
    return [[x, y, height], [x + s, y, height], [x + s, y + s, height], [x, y + s, height]]


class Gltf:
    """A glTF, y up, of squares and other quads given z up: (name, corners, material)."""

    def __init__(self, quads, materials, **more):
        self.data = b""
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(quads)))}], "nodes": [], "meshes": [],
                     "accessors": [], "bufferViews": [], "materials": materials, **more}
        for name, corners, material in quads:
            x, y, z = np.array(corners, float).T
            index = self.array(np.array([0, 1, 2, 0, 2, 3], "<u2"), 5123, "SCALAR")
            place = self.array(np.c_[x, z, -y].astype("<f4"), 5126, "VEC3")
            self.json["meshes"].append({"primitives": [{"attributes": {"POSITION": place}, "indices": index, "material": material}]})
            self.json["nodes"].append({"name": name, "mesh": len(self.json["meshes"]) - 1})

    def array(self, values, component, kind, **more):
        raw = values.tobytes()
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)})
        self.data += raw + bytes(-len(raw) % 4)
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component, "count": len(values), "type": kind, **more}
        if kind == "VEC3":
            accessor.update(min=values.min(axis=0).tolist() if len(values) else [], max=values.max(axis=0).tolist() if len(values) else [])
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def instances(self, node, required=False, **attributes):
        """Copies of a node: TRANSLATION=(values, component, type)."""
        self.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
        if required:
            self.json["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
        of = {name: self.array(*value) if isinstance(value, tuple) else value for name, value in attributes.items()}
        self.json["nodes"][node]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": of}}

    def text(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        return json.dumps({**self.json, "buffers": [{"byteLength": len(self.data), "uri": uri}]}).encode()

    def glb(self):
        head = json.dumps({**self.json, "buffers": [{"byteLength": len(self.data)}]}).encode()
        head += b" " * (-len(head) % 4)
        chunks = struct.pack("<I4s", len(head), b"JSON") + head + struct.pack("<I4s", len(self.data), b"BIN\0") + self.data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def material(colour, emission=0.0, **more):
    """A file has the luminance, of which pi times is the emission."""
    return {"pbrMetallicRoughness": {"baseColorFactor": [colour] * 3 + [1], "metallicFactor": 0},
            "emissiveFactor": [emission / np.pi] * 3, **more}


class BacksCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lambert-backs-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def obj(self, name, faces, **materials):
        """faces: (object, material, corners)."""
        lines, n = [f"mtllib {name}.mtl"], 0
        for thing, of, corners in faces:
            lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in corners]
            lines += [f"o {thing}", f"usemtl {of}", "f " + " ".join(str(n + k + 1) for k in range(len(corners)))]
            n += len(corners)
        (self.folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
        (self.folder / f"{name}.mtl").write_text("".join(f"newmtl {m}\nKd {v['Kd']}\nKe {v['Ke']}\n" for m, v in materials.items()))
        return self.folder / f"{name}.obj"

    def store(self, scene, *options, quick=QUICK):
        path = self.folder / (scene.stem + ".h5")
        done = must("precompute", scene, "-o", path, *quick, *options)
        return path, done.stderr

    def write(self, name, data):
        (self.folder / name).write_bytes(data)
        return self.folder / name

    def figures(self, store, *arguments):
        """(group, figure): value, of a solve."""
        rows = [line.split() for line in must("solve", store, *arguments).stdout.splitlines()[1:]]
        return {(row[0], row[1]): float(row[2]) for row in rows if len(row) == 3}

    def groups(self, store):
        """name: (elements, m2)."""
        with h5py.File(store) as f:
            names, group, area = [n.decode() for n in f["mesh/group_names"][()]], f["mesh/group"][()], f["mesh/area"][()]
        return {name: (int((group == g).sum()), float(area[group == g].sum())) for g, name in enumerate(names)}


class TwoSided(BacksCase):
    def test_a_floor_means_the_side_that_was_modelled(self):
        """Under an even sky of irradiance 1 the upper side has 1 everywhere, and the lower, over black ground, 0."""
        scene = self.obj("slab", [("floor", "grey", square(0, 10.))], grey=GREY)
        np.save(self.folder / "even.npy", np.full(145, 1 / math.pi, np.float32))
        for sided in ((), ("--two-sided",)):
            store, _ = self.store(scene, *SKY, "--elements", 50, *sided, quick=("--quiet",))
            said = must("solve", store, "--sky", self.folder / "even.npy", "--reduce", "floor=mean").stdout
            self.assertNotIn("inf", said)
            # The headline counts the sky's first light, which is all that there is.
            self.assertRegex(said, r"stated error of this answer, \d+ emitters: [\d.e-]+, most of it by the ")
            asked = [f"--reduce=floor={figure}" for figure in ("mean", "min", "uniformity")]
            asked += ["--reduce=floor.back=mean", "--reduce=floor.back=min"] if sided else []
            found = self.figures(store, "--sky", self.folder / "even.npy", "--quantity", "irradiance", *asked)
            for figure in ("mean", "min", "uniformity"):
                self.assertAlmostEqual(found["floor", figure], 1, delta=1e-6, msg=(sided, figure))
            if sided:
                self.assertEqual((found["floor.back", "mean"], found["floor.back", "min"]), (0, 0))
        names = self.groups(store)
        self.assertEqual(list(names), ["floor", "floor.back"])
        self.assertEqual(names["floor"], names["floor.back"])
        self.assertIn("floor.back, ", must("info", store).stdout)
        self.assertIn("has the same geometry and materials", must("verify", store, scene, "--probes", 0).stdout)
        with Daemon(store) as daemon:
            about = daemon.get("/v1/scenes/slab").json()
            self.assertEqual([g["name"] for g in about["groups"]], ["floor", "floor.back"])
            sky = {"sky": [1 / math.pi] * 145}
            answer = daemon.radiosity("slab", {"emission": sky, "quantity": "irradiance",
                                               "reduce": {"groups": ["floor", "floor.back"], "with": ["mean", "min", "uniformity"]}}).json()
            self.assertAlmostEqual(answer["groups"]["floor"]["mean"], 1, delta=1e-6)
            self.assertAlmostEqual(answer["groups"]["floor"]["uniformity"], 1, delta=1e-6)
            self.assertEqual(answer["groups"]["floor.back"], {"mean": 0, "min": 0, "uniformity": None})
            n = names["floor"][0]
            for group, value in ("floor", 1), ("floor.back", 0):
                selected = daemon.radiosity("slab", {"emission": sky, "quantity": "irradiance", "select": {"groups": [group]}}).json()
                np.testing.assert_allclose(selected["irradiance"], [value] * n, atol=1e-6)
            lit = np.array(daemon.radiosity("slab", {"emission": {"groups": {"floor": 2}}}).json()["radiosity"])
            np.testing.assert_allclose(lit, [2] * n + [0] * n)
            # Of the sum of the lower side, by light of 1 from each group: by its own alone.
            cotangent = [0] * n + [1] * n
            answer = daemon.post("/v1/scenes/slab/adjoint", json.dumps({"cotangent": cotangent, "gradient": ["groups"]})).json()
            self.assertEqual(answer["gradient"]["groups"], [0, n])

    def test_each_side_of_a_lamp_is_lit_alone(self):
        """A lamp over a floor, both looking up: the floor sees its back."""
        scene = self.obj("lamp", [("floor", "grey", square(0)), ("lamp", "black", square(1))], grey=GREY, black={**LAMP, "Ke": "0 0 0"})
        store, _ = self.store(scene, "--two-sided")
        for emitted, floor in (("lamp=1", 0), ("lamp.back=1", FACING)):
            found = self.figures(store, "--emit", emitted, "--quantity", "irradiance", "--reduce", "floor=mean", "--reduce", "floor.back=mean")
            self.assertAlmostEqual(found["floor", "mean"], floor, delta=NEAR)
            self.assertEqual(found["floor.back", "mean"], 0)
        # Emitters by their groups are the same.
        few = self.folder / "few.h5"
        must("precompute", scene, "-o", few, *QUICK, "--two-sided", "--method", "emitters", "--emitters", "group=lamp.back")
        found = self.figures(few, "--emit", "lamp.back=1", "--quantity", "irradiance", "--reduce", "floor=mean")
        self.assertAlmostEqual(found["floor", "mean"], FACING, delta=NEAR)

    def test_objects_of_several_materials(self):
        """`box` means the fronts of all its materials, `box.back` their backs."""
        faces = [("box", "red", square(0)), ("box", "blue", square(0, at=(2, 0))), ("floor", "grey", square(-1))]
        scene = self.obj("box", faces, red=GREY, blue=GREY, grey=GREY)
        store, _ = self.store(scene, "--two-sided")
        self.assertEqual(list(self.groups(store)), ["box.red", "box.blue", "floor", "box.red.back", "box.blue.back", "floor.back"])
        emission = np.zeros(6)
        with Daemon(store) as daemon:
            for asked, lit in (("box", [0, 1]), ("box.back", [3, 4]), ("box.red.back", [3]), ("floor", [2]), ("floor.back", [5])):
                values = emission.copy()
                values[lit] = 1
                answer = daemon.radiosity("box", {"emissions": [{"groups": {asked: 1}}, values.tolist()]}).json()["radiosity"]
                self.assertEqual(answer[0], answer[1], asked)
            wrong = daemon.radiosity("box", {"emission": {"groups": {"red.back": 1}}})
            self.assertEqual(wrong.status, 422)

    def test_an_object_of_the_name_of_a_back(self):
        """The object keeps its name, and the backs get another, which a warning says."""
        faces = [("floor", "grey", square(0)), ("floor.back", "grey", square(-1)), ("wall", "grey", square(1))]
        scene = self.obj("names", faces, grey=GREY)
        plain, errors = self.store(scene)
        self.assertEqual(list(self.groups(plain)), ["floor", "floor.back", "wall"])
        self.assertNotIn("floor.back-2", errors)
        store, errors = self.store(scene, "--two-sided")
        self.assertEqual(list(self.groups(store)), ["floor", "floor.back", "wall", "floor.back-2", "floor.back.back", "wall.back"])
        self.assertIn("the first is called 'floor.back-2'", errors)
        self.assertEqual(errors.count("\n"), 1)
        with Daemon(store) as daemon:
            for asked, lit in (("floor", 0), ("floor.back", 1), ("floor.back-2", 3)):
                found = daemon.radiosity("names", {"emission": {"groups": {asked: 1}}, "select": {"elements": [lit]}}).json()["radiosity"]
                self.assertGreaterEqual(found[0], 1)

    def test_stores_from_before(self):
        """Both sides have one group in them: figures are what they were."""
        scene = self.obj("slab", [("floor", "grey", square(0)), ("lamp", "lamp", square(1))], grey=GREY, lamp=LAMP)
        store, _ = self.store(scene, "--two-sided")
        with h5py.File(store, "r+") as f:
            group = f["mesh/group"][()] % 2
            for name in "mesh/group", "mesh/group_names":
                del f[name]
            f["mesh/group"] = group.astype(np.uint32)
            f.create_dataset("mesh/group_names", data=[b"floor", b"lamp"], dtype=h5py.string_dtype("utf-8", 5))
            if "error" in f:
                del f["error"]
            add_checksums(f)
        found = self.figures(store, "--quantity", "irradiance", "--reduce", "floor=mean", "--reduce", "floor=max")
        self.assertAlmostEqual(found["floor", "max"], FACING, delta=NEAR)
        self.assertAlmostEqual(found["floor", "mean"], FACING / 2, delta=NEAR)
        with Daemon(store) as daemon:
            answer = daemon.radiosity("slab", {"emission": {"groups": {"lamp": 1}}, "quantity": "irradiance", "select": {"groups": ["floor"]}}).json()
            np.testing.assert_allclose(answer["irradiance"], [FACING, 0], atol=NEAR)
        self.assertIn("has the same geometry and materials", must("verify", store, scene, "--probes", 0).stdout)


class DoubleSided(BacksCase):
    def panel(self, **more):
        """A floor, and a panel over it that emits 1; both look up."""
        return Gltf([("floor", square(0), 0), ("panel", square(1), 1)], [material(.5), material(0, 1, **more)])

    def test_materials_are_on_both_sides(self):
        for double, wanted in ((True, FACING), (False, 0)):
            scene = self.write("panel.gltf", self.panel(doubleSided=double).text())
            store, errors = self.store(scene, quick=("--probes", 0))
            found = self.figures(store, "--quantity", "irradiance", "--reduce", "floor=mean")
            self.assertAlmostEqual(found["floor", "mean"], wanted, delta=NEAR)
            said = "2 of 4 faces get a back, as their materials are double-sided; --two-sided=no leaves these backs out\n"
            self.assertEqual(said in errors, double, errors)
            self.assertEqual(list(self.groups(store)), ["floor", "panel", *(["panel.back"] if double else [])])
            with h5py.File(store) as f:
                self.assertEqual((f["mesh"].attrs["two_sided"], f["mesh"].attrs.get("backs", 0)), (0, 2 * double))
                np.testing.assert_allclose(f["mesh/emission"][0], [0, 0, 1, 1] + [1, 1] * double, rtol=1e-6)
            self.assertIn("has the same geometry and materials", must("verify", store, scene, "--probes", 0).stdout)
        store, _ = self.store(self.write("panel.glb", self.panel(doubleSided=True).glb()))
        self.assertAlmostEqual(self.figures(store, "--quantity", "irradiance", "--reduce", "floor=mean")["floor", "mean"], FACING, delta=NEAR)

    def test_materials_in_any_order(self):
        """Emission, strength and sides go with their material, whichever mesh is the first to have it."""
        named = [material(.5, name="grey"), material(.2, 1, name="lamp", doubleSided=True,
                                                     extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 100}})]
        nameless = [{k: v for k, v in m.items() if k != "name"} for m in named]
        of_one_name = [{**m, "name": "same"} for m in named]
        for materials in (named, nameless, of_one_name):
            for first in (0, 1):
                scene = Gltf([("floor", square(0), first), ("panel", square(1), 1 - first)], materials,
                             extensionsUsed=["KHR_materials_emissive_strength"])
                store, _ = self.store(self.write("order.gltf", scene.text()))
                lit = "panel" if first == 0 else "floor"
                self.assertEqual(list(self.groups(store)), ["floor", "panel", lit + ".back"])
                with h5py.File(store) as f:
                    emission, rho, group = f["mesh/emission"][0], f["mesh/reflectance"][0], f["mesh/group"][()]
                own = (group == 2) | (group == (1 if lit == "panel" else 0))
                np.testing.assert_allclose(emission, np.where(own, 100, 0), rtol=1e-6)
                np.testing.assert_allclose(rho, np.where(own, .2, .5), rtol=1e-6)

    def test_the_option_overrules_materials(self):
        scene = self.write("panel.gltf", self.panel(doubleSided=True).text())
        store, _ = self.store(scene, "--two-sided=no")
        self.assertEqual(self.groups(store), {"floor": (2, 1), "panel": (2, 1)})
        store, _ = self.store(scene, "--two-sided")
        self.assertEqual(list(self.groups(store)), ["floor", "panel", "floor.back", "panel.back"])
        done = lambert("precompute", scene, "-o", store, "--two-sided=some")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))

    def test_both_sides_of_a_sheet_stay(self):
        """Two faces back to back are its sides, of which one repeats the back of the other where all faces get backs."""
        scene = self.write("twins.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 4 3 2 1\n")
        for options in (), ("--two-sided=no",), ("--two-sided",):
            store, _ = self.store(scene, *options)
            with h5py.File(store) as f:
                np.testing.assert_array_equal(f["mesh/normal"][:, 2], [1, -1], str(options))
                self.assertNotIn("overlap", f["mesh"])

    def test_a_sheet_of_double_sided_faces_has_two_sides(self):
        """Its faces are back to back: one of them is enough, but without backs; a box of such faces keeps its place in a
        floor that is larger."""
        scene = Gltf([("top", square(0), 0), ("under", square(0)[::-1], 0)], [material(.5, doubleSided=True)])
        twin = self.write("twins.gltf", scene.text())
        for options, groups in ((), ["top", "top.back"]), (("--two-sided=no",), ["top", "under"]):
            store, _ = self.store(twin, *options)
            self.assertEqual(list(self.groups(store)), groups)
            self.assertIn("has the same geometry and materials", must("verify", store, twin, "--probes", 0).stdout)
        scene = Gltf([("floor", square(0, 4), 0), ("bottom", square(0, at=(1, 1))[::-1], 0)], [material(.5, doubleSided=True)])
        store, errors = self.store(self.write("box.gltf", scene.text()))
        self.assertIn(" where others cover the same place, by 1 m2 in all (floor 1 m2; ", errors)
        with h5py.File(store) as f:
            areas = np.bincount(f["mesh/group"][()], f["mesh/area"][()])
        np.testing.assert_allclose(areas, [15, 1, 15, 1], rtol=1e-9)

    def test_all_double_sided_is_two_sided(self):
        """The same bits but for what says how a store was made."""
        scene = Gltf([("floor", square(0), 0), ("panel", square(1), 1)], [material(.5, doubleSided=True), material(0, 1, doubleSided=True)])
        scene = self.write("both.gltf", scene.text())
        first, _ = self.store(scene)
        with h5py.File(first) as f:
            kept = {name: f[name][()] for name in ("mesh/elements", "mesh/group", "operator/order") if name in f}
            self.assertEqual(f["mesh"].attrs["two_sided"], 1)
        other, _ = self.store(scene, "--two-sided")
        with h5py.File(other) as f:
            for name, values in kept.items():
                np.testing.assert_array_equal(f[name][()], values)

    def test_refined_meshes(self):
        """Backs lie behind all fronts, in their order, however the mesh is divided; --elements counts both sides."""
        scene = self.write("panel.gltf", self.panel(doubleSided=True).text())
        for options in (("--elements", 90), ("--max-edge", .2), ("--mesh-error", .05, "--elements", 400)):
            store, _ = self.store(scene, *options)
            with h5py.File(store) as f:
                corners, v, group = f["mesh/elements"][()], f["mesh/vertices"][()], f["mesh/group"][()]
                n_backs, emission = f["mesh"].attrs["backs"], f["mesh/emission"][0]
            n = len(corners) - n_backs
            fronts = np.flatnonzero(group[:n] == 1)
            self.assertEqual(len(fronts), n_backs)
            self.assertTrue((group[n:] == 2).all())
            np.testing.assert_allclose(emission[n:], 1, rtol=1e-6)
            for k, i in enumerate(fronts):
                used = 3 + (corners[i, 3] != 0xFFFFFFFF)
                np.testing.assert_array_equal(corners[n + k, :used], corners[i, :used][::-1])
            if options[0] == "--elements":
                # 2/3 of the area in fronts: triangles are cut into squares, 4 x 16 = 64 fronts and 32 backs at the nearest
                self.assertAlmostEqual(len(corners), 90, delta=18)
            if options[0] == "--mesh-error":
                self.assertLessEqual(len(corners), 400)
                self.assertGreater(n, 100)
            found = self.figures(store, "--quantity", "irradiance", "--reduce", "floor=mean")
            self.assertAlmostEqual(found["floor", "mean"], FACING, delta=2e-4)  # up to 7e-5 of each pair

    def test_panes_reflect_what_they_do_not_transmit(self):
        """And pass the rest; both of their sides are there."""
        panes = [material(1, extensions={"KHR_materials_transmission": {"transmissionFactor": .9}}), material(.5)]
        scene = Gltf([("pane", square(0), 0), ("wall", square(1), 1)], panes, extensionsUsed=["KHR_materials_transmission"])
        store, errors = self.store(self.write("pane.gltf", scene.text()), quick=("--probes", 0))
        self.assertIn("light passes 2 faces of panes, less of it aslant: pane 0.9", errors)
        with h5py.File(store) as f:
            np.testing.assert_allclose(f["mesh/reflectance"][0], [.1, .1, .5, .5, .1, .1], rtol=1e-6)
        for lines, told in (("d .12\nillum 4", True), ("Tf .88 .88 .88\nillum 6", True), ("Tf 1 1 1\nillum 4", False),
                            ("Tf .88 .88 .88\nillum 2", False), ("Tr 0\nillum 2", False)):
            self.write("pane.mtl", f"newmtl pane\nKd .1 .1 .1\n{lines}\n".encode())
            scene = self.write("pane.obj", b"mtllib pane.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl pane\nf 1 2 3\n")
            self.assertEqual("light passes 1 face of panes" in self.store(scene, quick=("--probes", 0))[1], told, lines)

    def test_images_and_colours_are_on_both_sides(self):
        pixel = base64.b64encode((pathlib.Path(__file__).parent.parent / "fixtures" / "textures" / "tile.webp.png").read_bytes()).decode()
        scene = Gltf([("sheet", square(0), 0)], [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0},
                                                  "doubleSided": True}, material(.5)],
                     images=[{"uri": "data:image/png;base64," + pixel}], textures=[{"source": 0}])
        attributes = scene.json["meshes"][0]["primitives"][0]["attributes"]
        attributes["TEXCOORD_0"] = scene.array(np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4"), 5126, "VEC2")
        attributes["COLOR_0"] = scene.array(np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], "<f4"), 5126, "VEC3")
        store, _ = self.store(self.write("sheet.gltf", scene.text()), "--elements", 64)
        with h5py.File(store) as f:
            rho = f["mesh/reflectance"][()]
        fronts, backs = np.split(rho, 2, axis=1)
        self.assertGreater(np.ptp(fronts[0]), .05)
        np.testing.assert_array_equal(fronts, backs)
        self.assertGreater(decode_png(pathlib.Path(__file__).parent.parent / "fixtures" / "textures" / "tile.webp.png").size, 0)


class Instances(BacksCase):
    def room(self):
        """4 x 3 x 2.5 m, its floor first, of two triangles a wall."""
        a = [[x, y, z] for z in (0, 2.5) for x, y in ((0, 0), (4, 0), (4, 3), (0, 3))]
        sides = {"floor": (0, 1, 2, 3), "ceiling": (7, 6, 5, 4), "south": (0, 4, 5, 1), "east": (1, 5, 6, 2), "north": (2, 6, 7, 3), "west": (3, 7, 4, 0)}
        return Gltf([(name, [a[k] for k in corners], 0) for name, corners in sides.items()], [material(.5)])

    def test_copies_have_faces(self):
        moves = np.array([[0, 0, 0], [10, 0, 0]], "<f4"), 5126, "VEC3"
        for required in (False, True):
            scene = self.room()
            scene.instances(0, required, TRANSLATION=moves)
            for path in (self.write("two.gltf", scene.text()), self.write("two.glb", scene.glb())):
                store, errors = self.store(path)
                self.assertEqual(errors, "")
                found = self.groups(store)
                self.assertEqual(sum(n for n, _ in found.values()), 14)
                self.assertAlmostEqual(sum(m2 for _, m2 in found.values()), 71, places=4)
                self.assertEqual(found["floor"], (4, 24))
                with h5py.File(store) as f:
                    self.assertEqual(f["mesh/vertices"][()][:, 0].max(), 14)

    def test_turned_and_scaled_copies(self):
        """Of a square on its side of 2 m: turned about the vertical axis y of the format, scaled, below a node that moves all."""
        half = math.sqrt(.5)
        turns = np.array([[0, half, 0, half], [0, 0, 0, 1], [0, 1, 0, 0]])
        moves = np.array([[0, 0, 0], [5, 1, 0], [0, 0, 7]], "<f4")
        scales = np.array([[1, 1, 1], [2, 1, 3], [.5, 1, -1]], "<f4")
        for component, values in ((5126, turns.astype("<f4")), (5120, np.round(turns * 127).astype("i1")), (5122, np.round(turns * 32767).astype("<i2"))):
            scene = Gltf([("tile", square(0, 2.), 0)], [material(.5)])
            scene.json["nodes"].append({"children": [0], "translation": [100, 0, 0]})
            scene.json["scenes"][0]["nodes"] = [1]
            more = {} if component == 5126 else {"normalized": True}
            index = scene.array(values, component, "VEC4", **more)
            scene.instances(0, TRANSLATION=(moves, 5126, "VEC3"), SCALE=(scales, 5126, "VEC3"), ROTATION=index)
            store, _ = self.store(self.write("tiles.gltf", scene.text()))
            with h5py.File(store) as f:
                v, corners, normal = f["mesh/vertices"][()], f["mesh/elements"][()], f["mesh/normal"][()]
            wanted = []
            for move, (x, y, z, w), scale in zip(moves, turns, scales):
                turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
                own = np.array([[0, 0, 0], [2, 0, 0], [2, 0, -2], [0, 0, -2]])
                wanted += [turn @ (scale * p) + move + [100, 0, 0] for p in own[[0, 1, 2, 0, 2, 3]]]
            found = v[corners[:, :3]].reshape(-1, 3)
            # The library turns the order of corners where a copy is mirrored: the places are compared as sets. 16 bits
            # and 8 round a quaternion by 1/2 step, which moves what is 7 m away by twice that.
            far = 14 * {5126: 1e-6, 5122: .5 / 32767, 5120: .5 / 127}[component] + 1e-5
            for p in wanted:
                self.assertLess(np.linalg.norm(found - p, axis=1).min(), far, (component, p))
            self.assertEqual(len(corners), 6)
            np.testing.assert_allclose(normal[:, 1], 1, atol=far)  # the mirrored one, too

    def test_children_stay_and_double_sides_hold(self):
        scene = Gltf([("tree", square(0), 0), ("leaf", square(2), 1)], [material(.5), material(.2, doubleSided=True)])
        scene.json["scenes"][0]["nodes"] = [0]
        scene.json["nodes"][0]["children"] = [1]
        scene.instances(1, TRANSLATION=(np.arange(9, dtype="<f4").reshape(3, 3) * 2, 5126, "VEC3"))
        store, _ = self.store(self.write("tree.gltf", scene.text()))
        self.assertEqual(self.groups(store), {"tree": (2, 1), "leaf": (6, 3), "leaf.back": (6, 3)})

    def test_bad_instances_are_refused(self):
        """One line each, which says what is wrong."""
        moves = np.zeros((4, 3), "<f4"), 5126, "VEC3"

        def broken(change, **attributes):
            scene = self.room()
            scene.instances(0, **(attributes or {"TRANSLATION": moves}))
            change(scene.json)
            return scene.text()

        def accessor(**values):
            return lambda j: j["accessors"][-1].update(values)

        def view(**values):
            return lambda j: j["bufferViews"][-1].update(values)
        says = "TRANSLATION must be an accessor of VEC3 of floats whose bytes the file has"
        cases = [(broken(accessor(count=5)), says), (broken(accessor(count=2**31)), says), (broken(accessor(count=-1)), says),
                 (broken(accessor(count="4")), says), (broken(accessor(type="VEC4")), says), (broken(accessor(componentType=5123)), says),
                 (broken(accessor(componentType=5122, normalized=True)), says), (broken(accessor(byteOffset=4)), says),
                 (broken(accessor(bufferView=99)), says), (broken(accessor(sparse={"count": 1})), says), (broken(view(byteStride=4)), says),
                 (broken(view(byteLength=10**9)), says), (broken(view(byteOffset=4e9)), says), (broken(view(buffer=3)), says),
                 (broken(lambda j: j["accessors"][-1].pop("bufferView")), says), (broken(lambda j: None, TRANSLATION=77), says),
                 (broken(lambda j: None, _ID=(np.zeros(4, "<f4"), 5126, "SCALAR")), "TRANSLATION, ROTATION and SCALE are missing"),
                 (broken(lambda j: None, TRANSLATION=moves, SCALE=(np.ones((3, 3), "<f4"), 5126, "VEC3")), "SCALE has 3 entries, another attribute 4"),
                 (broken(lambda j: None, ROTATION=(np.zeros((4, 4), "<f4"), 5126, "VEC4")), "ROTATION of instance 0 is no usable number"),
                 (broken(lambda j: None, ROTATION=(np.ones((4, 4), "i1"), 5120, "VEC4")), "ROTATION must be an accessor of VEC4 of floats, or normalized"),
                 (broken(lambda j: None, TRANSLATION=(np.full((4, 3), np.nan, "<f4"), 5126, "VEC3")), "TRANSLATION of instance 0 is no usable number")]
        for data, wanted in cases:
            path = self.write("bad.gltf", data.replace(b"NaN", b"0"))
            done = lambert("precompute", path, "-o", self.folder / "bad.h5", *QUICK)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), (wanted, done.stderr))
            self.assertIn(wanted, done.stderr)
            self.assertIn("bad.gltf: node 0", done.stderr)

    def test_too_many_instances(self):
        """Nodes that share one list of copies: their number is limited before any is made."""
        scene = self.room()
        scene.instances(0, TRANSLATION=(np.zeros((4096, 3), "<f4"), 5126, "VEC3"))
        node = scene.json["nodes"][0]
        scene.json["nodes"] += [dict(node) for _ in range(256)]
        scene.json["scenes"][0]["nodes"] += list(range(6, 262))
        done = lambert("precompute", self.write("many.gltf", scene.text()), "-o", self.folder / "many.h5", *QUICK)
        self.assertEqual(done.returncode, 1)
        self.assertIn("more than 1048576 instances (EXT_mesh_gpu_instancing)", done.stderr)


if __name__ == "__main__":
    unittest.main()
