"""Panes: files whose materials let light pass, --glass, the sky and the sun through a window, rooms that see each other
through a pane by every source and kind, the walks that judge them, and what is refused."""

import json
import os
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

import glb
from command import lambert, must
from daemon import Daemon
from make_store import add_checksums
from weather import sun, wea

TAU = .78
FIXTURES = pathlib.Path(os.environ["FIXTURES"])


def law(cosine):
    return np.minimum(1, 1.018 * cosine * (1 + np.sqrt(1 - cosine ** 2) ** 3))


class Obj:
    def __init__(self):
        self.lines, self.n = ["mtllib s.mtl"], 0

    def quad(self, group, material, *corners):
        self.lines.append(f"o {group}\nusemtl {material}")
        self.lines.extend("v %.9g %.9g %.9g" % tuple(corner) for corner in corners)
        self.lines.append("f " + " ".join(str(self.n + k + 1) for k in range(4)))
        self.n += 4

    def sides(self, x):
        """The sides of a room of 2 m but for those across x."""
        self.quad("floor", "w", (x, 0, 0), (x + 2, 0, 0), (x + 2, 2, 0), (x, 2, 0))
        self.quad("ceiling", "w", (x, 0, 2), (x, 2, 2), (x + 2, 2, 2), (x + 2, 0, 2))
        self.quad("south", "w", (x, 0, 0), (x, 0, 2), (x + 2, 0, 2), (x + 2, 0, 0))
        self.quad("north", "w", (x, 2, 0), (x + 2, 2, 0), (x + 2, 2, 2), (x, 2, 2))

    def text(self):
        return "\n".join(self.lines) + "\n"


def two_rooms():
    o = Obj()
    o.quad("west", "lamp", (0, 0, 0), (0, 2, 0), (0, 2, 2), (0, 0, 2))
    o.sides(0)
    o.sides(2)
    o.quad("east", "w", (4, 0, 0), (4, 0, 2), (4, 2, 2), (4, 2, 0))
    o.quad("pane", "g", (2, 0, 0), (2, 2, 0), (2, 2, 2), (2, 0, 2))
    return o.text()


def window_room(pane=True):
    """4 x 3 x 2.5 m with a window of 2 x 1.5 m in the south; the sun shines in at noon."""
    o = Obj()
    o.quad("floor", "w", (0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 3, 0))
    o.quad("ceiling", "w", (0, 0, 2.5), (0, 3, 2.5), (4, 3, 2.5), (4, 0, 2.5))
    o.quad("north", "w", (0, 3, 0), (4, 3, 0), (4, 3, 2.5), (0, 3, 2.5))
    o.quad("west", "w", (0, 0, 0), (0, 3, 0), (0, 3, 2.5), (0, 0, 2.5))
    o.quad("east", "w", (4, 0, 0), (4, 0, 2.5), (4, 3, 2.5), (4, 3, 0))
    for a, b, c, d in ((0, 1, 0, 2.5), (3, 4, 0, 2.5), (1, 3, 0, .5), (1, 3, 2, 2.5)):
        o.quad("wall", "w", (a, 0, c), (a, 0, d), (b, 0, d), (b, 0, c))
    if pane:
        o.quad("pane", "g", (1, 0, .5), (3, 0, .5), (3, 0, 2), (1, 0, 2))
    return o.text()


def paint(wall, pane=f"Kd 0 0 0\nd {1 - TAU:g}", lamp="Ke 1 1 1"):
    return f"newmtl w\nKd {wall}\nnewmtl lamp\nKd {wall}\n{lamp}\nnewmtl g\n{pane}\n"


INSIDE = ("floor", "ceiling", "north", "west", "east", "wall")


class Glass(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lambert-glass-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, obj, mtl):
        (self.folder / "s.obj").write_text(obj)
        (self.folder / "s.mtl").write_text(mtl)
        return self.folder / "s.obj"

    def precompute(self, *options, name="s.h5"):
        out = self.folder / name
        done = must("precompute", self.folder / "s.obj", "-o", out, *options, "--verbose")
        return out, done.stderr

    def means(self, store, *options):
        groups = self.groups(store)
        asked = [word for g in groups for word in ("--reduce", f"{g}=mean")]
        out = json.loads(must("solve", store, *options, "--quantity", "irradiance", *asked, "--json").stdout)
        return {group: np.ravel(out["groups"][group]["mean"])[0] for group in groups}

    @staticmethod
    def stated(store, *options):
        return json.loads(must("solve", store, *options, "--quantity", "irradiance", "--reduce", "floor=mean", "--json").stdout)["error"]["parts"]

    @staticmethod
    def groups(store):
        with h5py.File(store) as f:
            return [name.decode() for name in f["mesh/group_names"][:]]

    def test_materials_that_let_light_pass(self):
        cases = {"Kd .2 .2 .2\nd .22": (.78, .044), "Kd .2 .2 .2\nTr .78": (.78, .044),
                 "Kd 0 0 0\nTf .88 .88 .88\nillum 6": (.88, 0), "Kd .5 .5 .5\nTf .88 .88 .88\nillum 4": (.88, .12),
                 "Tf 1 0 0\nd .5\nillum 9": (.5 * .2126, 0), "Kd .3 .3 .3\nTf .88 .88 .88\nillum 2": (0, .3),
                 "Kd .3 .3 .3\nTf 1 1 1\nillum 4": (0, .3), "Kd .3 .3 .3\nmap_d a.png": (0, .3)}
        for pane, (passes, reflects) in cases.items():
            self.write(window_room(), paint(".5 .5 .5", pane))
            store, log = self.precompute("--mesh", "faces", "--probes", 0)
            with h5py.File(store) as f:
                names = [name.decode() for name in f["mesh/group_names"][:]]
                glass = f["mesh/glass"][:, 0] if "mesh/glass" in f else np.zeros(len(names))
                rho = f["mesh/reflectance"][0][f["mesh/group"][:] == names.index("pane")]
            self.assertAlmostEqual(glass[names.index("pane")], passes, places=9, msg=pane)
            np.testing.assert_allclose(rho, reflects, atol=1e-6, err_msg=pane)
            self.assertEqual("pane.back" in names, passes > 0)
            self.assertEqual(f"pane {passes:.3g}" in log, passes > 0, log)
            self.assertEqual("reflect up to" in log, passes + .5 > 1 and ".5 .5 .5\nTf" in pane, log)

    def test_glTF(self):
        material = {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0}}
        clear = {"KHR_materials_transmission": {"transmissionFactor": .9}}
        base = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
                "nodes": [{"mesh": 0, "name": "paper"}, {"mesh": 1, "name": "pane"}],
                "buffers": [{"byteLength": 72, "uri": "s.bin"}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 36}],
                "accessors": [{"bufferView": k, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, k],
                               "max": [1, 1, k]} for k in (0, 1)],
                "meshes": [{"primitives": [{"attributes": {"POSITION": k}, "material": k}]} for k in (0, 1)]}
        (self.folder / "s.bin").write_bytes(
            np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], "<f4").tobytes())
        blend = {"pbrMetallicRoughness": {"baseColorFactor": [.5, .5, .5, .25], "metallicFactor": 0}, "alphaMode": "BLEND"}
        for pane, passes, reflects in ((dict(material, extensions=clear), .9, .1), (blend, .75, .125)):
            base["materials"] = [material, dict(pane, name="glass")]
            base["extensionsUsed"] = ["KHR_materials_transmission"]
            (self.folder / "s.gltf").write_text(json.dumps(base))
            out = self.folder / "g.h5"
            log = must("precompute", self.folder / "s.gltf", "-o", out, "--mesh", "faces", "--verbose").stderr
            with h5py.File(out) as f:
                self.assertAlmostEqual(f["mesh/glass"][1, 0], passes, places=6)
                np.testing.assert_allclose(f["mesh/reflectance"][0][[1, 2]], reflects, atol=1e-6)
            self.assertIn("light passes 1 face of panes", log)
            self.assertNotIn("left out", log)

    def test_rooms_see_each_other_by_every_source_and_kind(self):
        self.write(two_rooms(), paint(".5 .5 .5", f"Kd .1 .1 .1\nd {1 - TAU:g}"))
        wanted = None
        for options, delta in ((["--method", "exact"], 0), (["--form-factors", "rays"], .03),
                               (["--form-factors", "hemicube"], .03), (["--method", "hierarchical"], .03),
                               (["--emitters", "group=west"], .03), (["--method", "exact", "--two-sided"], .03),
                               (["--method", "low-rank"], .15), (["--method", "sparse"], .15), (["--method", "2msc"], .15)):
            rays = [] if "hemicube" in options or not wanted else ["--rays", 2048]
            store, _ = self.precompute("--elements", 200, *rays, *options, "--probes", 4, name="k.h5")
            found = self.means(store)
            if not wanted:  # pairs are exact, and light through panes has some noise: the judge sees no more
                self.assertLess(self.stated(store)["form_factors"], .02)
            wanted = wanted or found
            self.assertGreater(found["floor"], 0)
            for group in ("east", "pane", "pane.back"):  # kinds that compress err by more
                self.assertAlmostEqual(found[group], wanted[group], delta=delta * wanted[group] if delta < .1 else
                                       delta * wanted["pane.back"], msg=f"{options} {group}")
        checks = json.loads(must("verify", self.folder / "k.h5", "--json").stdout)
        self.assertNotIn("broken", [c["result"] for c in checks["checks"]])
        # Walks know no form factor between elements.
        store, _ = self.precompute("--elements", 200, "--method", "exact", name="exact.h5")
        self.assertGreater(found["east"], .02)
        must("verify", store, "--walks", 4096)

    def test_blocks_have_panes(self):
        """Blocks have the light between elements too: the same means as by rays, within 2 % of the brightest."""
        self.write(two_rooms(), paint(".5 .5 .5"))
        blocks, log = self.precompute("--elements", 1300, "--form-factors", "blocks", "--keep-form-factors",
                                       name="blocks.h5")
        self.assertIn("blocks of clusters", log)
        rays, _ = self.precompute("--elements", 1300, "--rays", 4096, "--form-factors", "rays", name="rays.h5")
        found, wanted = self.means(blocks, "--emit", "west=1"), self.means(rays, "--emit", "west=1")
        for group in ("east", "pane", "pane.back"):
            self.assertAlmostEqual(found[group], wanted[group], delta=.02 * wanted["pane.back"], msg=group)
        must("verify", blocks, "--walks", 1024)
        must("solve", blocks, "--emit", "west=1", "--tolerance", .01, "-o", self.folder / "fine.npy")
        self.write(window_room(), paint(".5 .5 .5"))
        _, log = self.precompute("--elements", 1300, "--sky", "tregenza", "--probes", 0)
        self.assertIn("blocks of clusters are taken", log)

    def test_sky_through_a_window(self):
        """Under an even sky the share that a pane passes is the mean of its law over what each point sees."""
        for name, pane, options in (("open", False, []), ("pane", True, []), ("none", True, ["--glass-law", "none"])):
            self.write(window_room(pane), paint("0 0 0"))
            self.precompute("--elements", 400, "--sky", "reinhart:2", "--rays", 4096, "--probes", 0, *options,
                            name=name + ".h5")
        found = {name: self.means(self.folder / (name + ".h5"), "--sky", "even") for name in ("open", "pane", "none")}
        for group in INSIDE:
            whole = found["open"][group]
            if whole > 1:
                self.assertAlmostEqual(found["none"][group] / whole, TAU, delta=.01, msg=group)
        # A point of the floor: sums over the window.
        n = 200
        x, z = np.meshgrid(1 + (np.arange(n) + .5) * 2 / n, .5 + (np.arange(n) + .5) * 1.5 / n)
        floor, area = np.meshgrid((np.arange(8) + .5) / 2, (np.arange(8) + .5) * 3 / 8), 3 / n ** 2
        sums = np.zeros(2)
        for px, py in zip(floor[0].ravel(), floor[1].ravel()):
            r2 = (x - px) ** 2 + py ** 2 + z ** 2
            cosine = py / np.sqrt(r2)
            each = z / np.sqrt(r2) * cosine / r2 * area
            sums += (each.sum(), (each * TAU * law(cosine)).sum())
        self.assertAlmostEqual(found["pane"]["floor"] / found["open"]["floor"], sums[1] / sums[0], delta=.01)

    def test_presets_under_a_sky(self):
        """The mesh is divided by the light behind a pane as by that of an open window, and its judge sees that light."""
        n = {}
        for pane in (False, True):
            self.write(window_room(pane), paint(".5 .5 .5"))
            store, _ = self.precompute("--sky", "tregenza", "--mesh-error", .08)
            with h5py.File(store) as f:
                names = [name.decode() for name in f["mesh/group_names"][:]]
                n[pane] = np.count_nonzero(f["mesh/group"][:] == names.index("floor"))
            parts = self.stated(store, "--sky", "even")
            self.assertLess(parts["form_factors"], .03)
            self.assertLess(parts["mesh"], .08)
        self.assertGreater(n[True], .5 * n[False], n)
        self.assertGreater(n[False], 20)

    def test_sun_through_a_window(self):
        hours = [(month, 21, hour + .5, 800, 0) for month in (3, 6, 12) for hour in range(9, 16)]
        (self.folder / "s.wea").write_text(wea(hours))
        entering, bare = [], []
        for month, day, hour, direct, _ in hours:
            cosine = max(0, -sun(2001, month, day, hour)[1])
            bare.append(3 * direct * cosine)
            entering.append(3 * direct * cosine * TAU * law(cosine))
        for pane, wanted in ((True, entering), (False, bare)):
            self.write(window_room(pane), paint("0 0 0"))
            store, _ = self.precompute("--elements", 800, "--sky", "tregenza", "--probes", 0)
            out = self.folder / "h.npy"
            must("solve", store, "--weather", self.folder / "s.wea", "--sun", "exact", "--sun-points", 64, "--quantity",
                 "irradiance", "-o", out)
            H = np.load(out)
            with h5py.File(store) as f:
                inside = np.isin(f["mesh/group"][:], [k for k, g in enumerate(self.groups(store)) if g in INSIDE])
                area = f["mesh/area"][:]
            # The way out of the room, and the sky of the store, do not count: walls are black and the sky is dark.
            np.testing.assert_allclose(H[:, inside] @ area[inside], wanted, rtol=.01)

    def test_luminaires_and_sensors_beside_a_pane(self):
        """A pane lets light pass to the faces behind it: more flux than the luminaire has, and rows that sum to more than 1."""
        self.write(two_rooms(), paint(".5 .5 .5"))
        lamp = {"name": "lamp", "file": str(FIXTURES / "luminaires/made/lambertian-1000cd-1x1m.ies"), "at": [2.5, 1, 1.9], "flux": 1000}
        seats = {"points": [{"name": "seats", "at": [[2.1, 1, .2 * k] for k in range(1, 9)], "normal": [-1, 0, 0]}]}
        (self.folder / "lum.json").write_text(json.dumps({"luminaires": [lamp]}))
        (self.folder / "sen.json").write_text(json.dumps(seats))
        store, _ = self.precompute("--luminaires", self.folder / "lum.json", "--sensors", self.folder / "sen.json", "--lights", "lm",
                                   "--elements", 300, "--assets", FIXTURES)
        with h5py.File(store) as f:
            self.assertGreater((f["luminaires/irradiance"][()] @ f["mesh/area"][()]).max(), 1010)
            self.assertGreater(np.add.reduceat(f["sensors/weights"][()], f["sensors/indptr"][:-1].astype(int)).min(), 1.5)
        said = must("verify", store).stdout
        self.assertIn("1, the light of 1 of them was found again", said)
        self.assertIn("8 in 1 set, the rows of 8 of them were found again", said)
        with h5py.File(store, "r+") as f:
            f["sensors/weights"][...] *= 1.05
            f["sensors/weights_off"][...] *= 1.05
            add_checksums(f)
        self.assertIn("BROKEN  sensors       receiver 0", lambert("verify", store).stdout)

    def test_a_thick_pane_and_names_on_the_command_line(self):
        o = Obj()
        o.lines, o.n = window_room(False).splitlines(), 36
        o.quad("glass", "w", (1, 0, .5), (3, 0, .5), (3, 0, 2), (1, 0, 2))
        o.quad("glass", "w", (1, -.006, .5), (1, -.006, 2), (3, -.006, 2), (3, -.006, .5))
        self.write(o.text(), paint("0 0 0"))
        thick, log = self.precompute("--elements", 400, "--sky", "tregenza", "--rays", 4096, "--probes", 0, "--glass",
                                     "gla*=.78,2")
        self.assertIn("glass 0.78 in 2 faces", log)
        self.write(window_room(), paint("0 0 0"))
        thin, _ = self.precompute("--elements", 400, "--sky", "tregenza", "--rays", 4096, "--probes", 0, name="t.h5")
        a, b = self.means(thick, "--sky", "even"), self.means(thin, "--sky", "even")
        for group in ("floor", "north"):
            self.assertAlmostEqual(a[group] / b[group], 1, delta=.02)
        opaque, _ = self.precompute("--elements", 400, "--sky", "tregenza", "--glass", "pane=0", "--probes", 0)
        self.assertEqual(self.means(opaque, "--sky", "even")["floor"], 0)

    def test_refusals(self):
        self.write(two_rooms(), paint(".5 .5 .5"))
        for options, says in ((["--glass", "pane"], "must be GROUP=T"), (["--glass", "pane=1.2"], "from 0 to 1"),
                              (["--glass", "pane=.78,0"], "from 1 to 16"), (["--glass", "pane=.78,1.5"], "whole number"),
                              (["--glass", "pane=.78x"], "'x' is left over"), (["--glass", "pain=.78"], "pain"),
                              (["--glass-law", "angel"], "angle"),
                              (["--positions", "lamp.json"], "panes")):
            done = lambert("precompute", self.folder / "s.obj", "-o", self.folder / "r.h5", *options)
            self.assertNotEqual(done.returncode, 0, options)
            self.assertIn(says, done.stderr)
            self.assertFalse((self.folder / "r.h5").exists())

    def test_scenes_are_compared_with_their_panes(self):
        for pane, options, other in (("Kd .5 .5 .5\nTf .88 .88 .88\nillum 4", [], "Kd .5 .5 .5\nTf .8 .8 .8\nillum 4"),
                                     ("Kd 0 0 0\nd .22", [], "Kd 0 0 0\nd .3"), ("Kd 0 0 0\nd .22", [], "Kd 0 0 0"),
                                     ("Kd .5 .5 .5", ["--glass", "pane=.78"], "Kd .1 .1 .1")):
            scene = self.write(window_room(), paint(".5 .5 .5", pane))
            store, _ = self.precompute("--mesh", "faces", "--probes", 0, *options)
            must("verify", store, scene)
            self.write(window_room(), paint(".5 .5 .5", other))
            done = lambert("verify", store, scene)
            self.assertEqual(done.returncode, 1, pane)
            self.assertIn("stale: group pane", done.stdout)

    def test_a_store_keeps_its_panes(self):
        self.write(window_room(), paint(".5 .5 .5"))
        store, _ = self.precompute("--elements", 400, "--sky", "tregenza", "--keep-form-factors", "--probes", 0)
        again = self.folder / "again.h5"
        done = lambert("precompute", store, "-o", again, "--glass", "pane=.5")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("--glass", done.stderr)
        must("precompute", store, "-o", again, "--method", "exact", "--probes", 0)
        with h5py.File(store) as a, h5py.File(again) as b:
            np.testing.assert_array_equal(a["mesh/glass"][:], b["mesh/glass"][:])
            self.assertEqual(b["mesh"].attrs["glass_law"], b"angle")

    def test_cracks_of_a_room_with_panes(self):
        """The outer side of a pane is no gap of the room: cracks of 2 mm stay cracks, which the rows make good, a gap of .3 m does not,
        and with --closed only the pane's outer rows stay empty, under their sky; nothing is said to coincide."""
        def room(gap):
            ceiling, narrow = "v 0 {0:g} 2.5\nv 4 {0:g} 2.5".format(3), "v 0 {0:g} 2.5\nv 4 {0:g} 2.5".format(3 - gap)
            self.assertIn(ceiling, window_room())
            return window_room().replace(ceiling, narrow, 1)
        even = {}
        for gap, options, closed in ((0, (), True), (.002, (), True), (.3, (), False), (0, ("--closed",), True), (.002, ("--closed=no",), False)):
            self.write(room(gap), paint(".5 .5 .5"))
            for source in "rays", "blocks", "auto":
                store, log = self.precompute("--elements", 150, "--sky", "tregenza", "--probes", 0, "--keep-form-factors",
                                             "--form-factors", source, *(("--rays", 1024) if source == "rays" else ()), *options)
                self.assertIn(f"the scene is {'closed but for its panes' if closed else 'open'}: ", log)
                self.assertNotIn("too much or too little", log)
                names = self.groups(store)
                with h5py.File(store) as f:
                    group, sums, area = f["mesh/group"][:], f["mesh/row_sums"][:], f["mesh/area"][:]
                    sky = f["sky/first_bounce"][:].sum(0) / np.pi
                outer, inside = group == names.index("pane"), np.array([names[g] in INSIDE for g in group])
                np.testing.assert_allclose(sums[outer], 0, atol=1e-6)
                np.testing.assert_allclose(sky[outer], .5, atol=.02)  # the upper half, before a dark ground
                if closed:
                    np.testing.assert_allclose(sums[inside], 1, atol=3e-5, err_msg=f"{gap} {source} {options}")
                else:
                    self.assertLess(area[inside] @ sums[inside] / area[inside].sum(), 1 - 1e-4)
                if gap < .3:
                    floor = self.means(store, "--sky", "even")["floor"]
                    self.assertAlmostEqual(floor / even.setdefault("floor", floor), 1, delta=.02, msg=f"{gap} {source} {options}")
            self.assertNotIn("BROKEN", must("verify", store, "--probes", 0, "--walks", 1024).stdout)

    def test_every_client_is_told_and_meshes_read_back(self):
        """`info` and the daemon name panes with T and the law; GET .../mesh and solve -o X.glb have blended materials, which are
        the same panes again: T, both sides, what they reflect, and the light of the floor."""
        sky = "--sky", "even", "--quantity", "irradiance"
        for pane, options, glass, law in (("Kd .3 .3 .3\nd .22", (), {"transmittance": .78, "faces": 1}, "angle"),
                                          ("Kd .2 .2 .2\nd .5", ("--glass", "pane=.49,2", "--glass-law", "none"),
                                           {"transmittance": .49, "faces": 2}, "none"),
                                          ("Kd 0 0 0", ("--glass", "pane=1"), {"transmittance": 1, "faces": 1}, "angle")):
            self.write(window_room(), paint(".5 .5 .5", pane))
            store, _ = self.precompute("--elements", 300, "--sky", "tregenza", "--probes", 0, *options)
            about = json.loads(must("info", store, "--json").stdout)
            named = {group["name"]: group.get("glass") for group in about["groups"]}
            self.assertEqual((about["glass_law"], named["pane"], named["pane.back"], named["floor"]), (law, glass, glass, None))
            self.assertRegex(must("info", store).stdout, rf"\n +pane, \d+ elements?; a pane, T = {glass['transmittance']:g}"
                             f"{' of 2 faces together' if glass['faces'] == 2 else ''} at {'normal incidence' if law == 'angle' else 'any angle'}\n")
            each = glass["transmittance"] ** (1 / glass["faces"])
            with Daemon(store) as daemon:
                described = daemon.get("/v1/scenes/s").json()
                self.assertEqual((described["groups"], described["glass_law"]), (about["groups"], law))
                (self.folder / "mesh.glb").write_bytes(daemon.get("/v1/scenes/s/mesh").body)
            must("solve", store, *sky, "-o", self.folder / "light.glb")
            for name in "mesh", "light":
                told = glb.Glb((self.folder / f"{name}.glb").read_bytes()).json
                self.assertEqual(told["extras"]["lambert"]["glass_law"], law)
                nodes = {node["name"]: node for node in told["nodes"]}
                for group in "pane", "pane.back", "floor":
                    material = told["materials"][told["meshes"][nodes[group]["mesh"]]["primitives"][0]["material"]]
                    is_pane = group != "floor"
                    self.assertEqual(nodes[group]["extras"].get("glass"), glass if is_pane else None)
                    self.assertEqual(material.get("alphaMode"), "BLEND" if is_pane else None)
                    if is_pane:
                        self.assertAlmostEqual(material["pbrMetallicRoughness"]["baseColorFactor"][3], 1 - each, places=9)
                again = self.folder / f"{name}.h5"
                log = must("precompute", self.folder / f"{name}.glb", "-o", again, "--mesh", "faces", "--sky", "tregenza", "--probes", 0,
                           "--form-factors", "rays", "--rays", 1024, "--glass-law", law).stderr
                self.assertNotIn("coincide", log)
                read = {g["name"]: g.get("glass") for g in json.loads(must("info", again, "--json").stdout)["groups"]}
                for group in "pane", "pane.back":
                    self.assertAlmostEqual(read[group]["transmittance"], each, places=6)
                if name == "light" or glass["faces"] == 2:
                    continue
                with h5py.File(store) as a, h5py.File(again) as b:
                    for f in a, b:
                        at = self.groups(store if f is a else again).index("pane")
                        rho = f["mesh/reflectance"][0][f["mesh/group"][:] == at]
                        np.testing.assert_allclose(rho, 0 if each == 1 else .066, atol=1e-6)
                # The same elements, but halves of quads, and rays: 1 % is left.
                one, other = (self.means(s, "--sky", "even")["floor"] for s in (store, again))
                self.assertAlmostEqual(other / one, 1, delta=.01)


if __name__ == "__main__":
    unittest.main()
