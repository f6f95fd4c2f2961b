"""Black box: elements where light changes (--mesh-error), and the error of the mesh that stores state."""

import json
import math
import pathlib
import re
import unittest

import h5py
import numpy

from case import Case
from command import REFERENCE, must
from make_store import add_checksums


def values_of(store, name):
    with h5py.File(store) as file:
        return file[name][:]


class MeshError(Case):
    """A Cornell box, coarse, uniform and adaptive."""

    def setUp(self):
        super().setUp()
        self.scene = self.path("box.obj")
        must("generate", "cornell", "--elements", 10, "-o", self.scene)

    def made(self, name, *options):
        store = self.path(name)
        done = must("precompute", self.scene, "-o", store, "--probes", 32, *options)
        return json.loads(must("info", store, "--json").stdout), done.stderr, store

    def test_error_is_kept(self):
        about, log, store = self.made("kept.h5", "--mesh-error", .1)
        figures = about["error"]["mesh"]
        # stated by points of its own; of 300 looks the standard error of an error is below a tenth
        self.assertLess(max(figures["lights"], figures["even"]), 1.2 * .1)
        self.assertGreater(figures["lights"], .5 * .1)
        self.assertIn("constants on elements leave", log)
        self.assertNotIn("is not kept", log)
        self.assertIn(f"lights {figures['lights']:.3g}", must("info", store).stdout)
        # of groups whose noise is the larger part that counts, and what elements are off together is in it
        error = json.loads(must("solve", store, "--emit", "lamp=1", "--json").stdout)["error"]
        self.assertGreater(error["mesh"], .95 * figures["lights"])  # channels of equal power weigh groups otherwise
        self.assertLess(error["mesh"], 1.1 * figures["lights"])

    def test_what_solve_states_has_the_part_of_the_mesh(self):
        """The headline is the root of the sum of the squares of the parts, of this answer's light."""
        about, _, store = self.made("stated.h5", "--sky", "tregenza")
        numpy.save(self.path("sky.npy"), numpy.ones((3, 145)))
        mesh = about["error"]["mesh"]
        skies = max(mesh["sky_even"], mesh["sky_cloudy"])
        for light, part in (((), mesh["lights"]), (("--emit", "lamp=1"), mesh["lights"]), (("--sky", self.path("sky.npy")), skies),
                            (("--emit", "lamp=1", "--reduce", "floor=mean"), None)):
            error = json.loads(must("solve", store, *light, "--json").stdout)["error"]
            parts = error["parts"]
            self.assertEqual(set(parts), {"operator", "form_factors", "mesh"})
            self.assertAlmostEqual(error["stated"], math.hypot(*parts.values()), delta=1e-6)
            self.assertEqual(parts["mesh"], error["mesh"])
            if part is not None:  # by group, with their noise and what elements are off together
                self.assertLess(abs(math.log(parts["mesh"] / part)), math.log(1.3))
                self.assertTrue(error["coarse"])
                self.assertEqual(error["advice"], "precompute with --mesh-error .05")
            said = must("solve", store, *light, "--verbose").stdout.splitlines()[-2:]
            told = re.fullmatch(r"stated error of this answer, .*: (\S+), most of it by the (.*?)(: coarse; precompute with .*)?", said[0])
            self.assertIsNotNone(told, said)
            self.assertEqual(told[1], f"{error['stated']:.2g}")
            self.assertEqual(told[2], max(parts, key=parts.get).replace("_", " "))
            self.assertEqual(told[3] is not None, error["stated"] > .1)
            self.assertIn("parts: " + ", ".join(f"{name.replace('_', ' ')} {value:.2g}" for name, value in parts.items()), said[1])
            self.assertEqual(must("solve", store, *light).stdout.splitlines()[-1], said[0])

    def test_fewer_elements_than_uniform(self):
        adaptive, _, _ = self.made("adaptive.h5", "--mesh-error", .07)
        uniform, _, _ = self.made("uniform.h5", "--elements", adaptive["elements"])
        self.assertLess(adaptive["error"]["mesh"]["lights"], .9 * uniform["error"]["mesh"]["lights"])

    def test_pieces_of_a_wall_are_joined(self):
        must("generate", "cornell", "--elements", 641, "-o", self.scene)
        whole, _, store = self.made("whole.h5")
        about, log, joined = self.made("joined.h5", "--mesh-error", .2)
        self.assertLess(about["elements"], .5 * whole["elements"])
        self.assertRegex(log, rf"\d+ faces are left of {whole['elements']}")
        self.assertEqual([group["name"] for group in about["groups"]], [group["name"] for group in whole["groups"]])
        for group in range(len(whole["groups"])):
            areas = [values_of(path, "mesh/area")[values_of(path, "mesh/group") == group].sum() for path in (store, joined)]
            self.assertAlmostEqual(areas[0], areas[1], delta=1e-5 * areas[0])
        # The pieces that --max-edge makes are not joined again.
        _, _, edges = self.made("edged.h5", "--mesh-error", .2, "--max-edge", .1)
        corners = values_of(edges, "mesh/vertices")[values_of(edges, "mesh/elements")[:, :3]]
        self.assertLessEqual(numpy.linalg.norm(numpy.diff(corners, axis=1), axis=2).max(), .1 * 1.001)

    def test_limit_is_told(self):
        about, log, _ = self.made("few.h5", "--mesh-error", .001, "--elements", 200)
        self.assertEqual(about["elements"], 200)
        self.assertIn("--mesh-error 0.001 is not kept with 200 elements", log)

    def test_two_sided_and_repeatable(self):
        first, _, _ = self.made("first.h5", "--mesh-error", .12, "--two-sided", "--threads", 1)
        again, _, _ = self.made("again.h5", "--mesh-error", .12, "--two-sided", "--threads", 2)
        self.assertEqual(first["elements"] % 2, 0)
        self.assertGreater(first["elements"], 400)  # 384 are halves of faces that no light has chosen
        for member in ("elements", "groups"):
            self.assertEqual(first[member], again[member])
        self.assertEqual(first["error"]["mesh"], again["error"]["mesh"])

    def test_skies(self):
        """The figures of skies beside the light that is constant on elements, and that on a mesh of about 16 times as many."""
        must("generate", "cornell", "--elements", 80, "-o", self.scene)
        options = "--sky", "tregenza", "--ground-albedo", .9, "--method", "exact"
        about, _, coarse = self.made("coarse.h5", *options)
        stated = about["error"]["mesh"]
        fine = self.path("fine.h5")
        n = len(values_of(coarse, "mesh/area"))
        must("precompute", self.scene, "-o", fine, "--elements", 16 * n, "--probes", 0, *options, program=REFERENCE)
        skies = numpy.stack([numpy.ones(145), .2 + .8 * numpy.random.default_rng(1).random(145)])
        numpy.save(self.path("skies.npy"), numpy.repeat(skies[:, None], about["channels"], axis=1))
        light = []
        for store in coarse, fine:
            must("solve", store, "--sky", self.path("skies.npy"), "-o", self.path("light.npy"))
            values = numpy.load(self.path("light.npy")).astype(float)
            light.append(values.reshape(2, -1, len(values_of(store, "mesh/area"))))
        area = values_of(fine, "mesh/area")
        self.assertAlmostEqual(len(area), 16 * n, delta=n)
        # The parts of an element follow one another, and their areas add up to its own.
        whole = numpy.searchsorted(numpy.cumsum(values_of(coarse, "mesh/area")), numpy.cumsum(area) - area / 2)
        for name, there, true in zip(("sky_even", "sky_cloudy"), light[0], light[1]):
            off = (area * (there[:, whole] - true) ** 2).sum() / (area * true ** 2).sum()
            self.assertLess(abs(math.log(stated[name] / math.sqrt(off))), math.log(1.2))
        self.assertIn(f"even sky {stated['sky_even']:.3g}", must("info", coarse).stdout)
        # single tiles, by the power that each sends into the scene
        numpy.save(self.path("tiles.npy"), numpy.repeat(numpy.eye(145)[:, None], about["channels"], axis=1))
        light = []
        for store in coarse, fine:
            must("solve", store, "--sky", self.path("tiles.npy"), "-o", self.path("light.npy"))
            light.append(numpy.load(self.path("light.npy")).astype(float).reshape(145, about["channels"], -1))
        off, all_of = ((area * x ** 2).sum(axis=(1, 2)) for x in (light[0][..., whole] - light[1], light[1]))
        power = values_of(coarse, "error/by_group/sky_power").sum(axis=0)
        true = math.sqrt((power * off / numpy.maximum(all_of, 1e-300)).sum() / power.sum())
        self.assertLess(abs(math.log(stated["sky_tile"] / true)), math.log(1.6))  # of 12 tiles
        self.assertGreater(stated["sky_tile"], 1.5 * stated["sky_even"])
        # squares of the reflected light of 1 W from all of the sky, and from single tiles by their power
        of_groups = numpy.bincount(values_of(coarse, "mesh/group"), values_of(coarse, "mesh/area"))
        Q = values_of(coarse, "error/by_group/sky_power")
        even = (of_groups * values_of(coarse, "error/mesh/sky_even_reflected") ** 2).sum() / (Q.sum(axis=1) ** 2).sum()
        self.assertAlmostEqual(stated["sky_even_light"] / even, 1, delta=1e-5)
        reflected = (values_of(coarse, "mesh/area") * light[0] ** 2).sum(axis=(1, 2)) / (Q ** 2).sum(axis=0)
        self.assertLess(abs(math.log(stated["sky_tile_light"] * power.sum() / (power * reflected).sum())), math.log(1.3))
        sun = numpy.full(145, .05)
        sun[power.argmax()] = 50
        numpy.save(self.path("sky.npy"), sun)
        of_sun = json.loads(must("solve", coarse, "--sky", self.path("sky.npy"), "--json").stdout)["error"]["mesh"]
        self.assertLess(abs(math.log(of_sun / stated["sky_tile"])), math.log(1.3))
        numpy.save(self.path("sky.npy"), skies[0])
        error = [json.loads(must("solve", coarse, *light, "--sky", self.path("sky.npy"), "--json").stdout)["error"]["mesh"]
                 for light in ((), ("--emit", "floor=1e-6"), ("--emit", "floor=1e6"))]
        whole = max(stated["sky_even"], stated["sky_cloudy"])
        self.assertLess(abs(math.log(error[0] / whole)), math.log(1.3))
        self.assertAlmostEqual(error[1], error[0], delta=1e-3 * error[0])  # the power of each weighs its part
        self.assertNotAlmostEqual(error[2], error[0], delta=1e-2 * error[0])

    def test_single_elements_without_lamps(self):
        """A scene without lamps has the figure of single elements, too, and several light corners of their own in a maze."""
        must("generate", "maze", "--elements", 150, "-o", self.scene)
        about, _, store = self.made("maze.h5", "--mesh", "faces")
        stated, n = about["error"]["mesh"], about["elements"]
        self.assertNotIn("lights", stated)
        self.assertGreater(stated["single"], 3 * stated["even"])
        names, group, area = (values_of(store, f"mesh/{name}") for name in ("group_names", "group", "area"))
        # squares of the reflected light of 1 W from everywhere, and from single elements by area
        of_groups = numpy.bincount(group, area, len(names))
        light2 = (of_groups * values_of(store, "error/mesh/even_reflected") ** 2).sum()
        self.assertAlmostEqual(stated["even_light"] * area.sum() ** 2 / light2, 1, delta=1e-5)
        numpy.save(self.path("each.npy"), numpy.eye(n))
        must("solve", store, "--emission", self.path("each.npy"), "--quantity", "indirect", "-o", self.path("light.npy"))
        each = (area * numpy.load(self.path("light.npy")).astype(float).reshape(n, n) ** 2).sum(axis=1) / area ** 2
        true = (area * each).sum() / area.sum()
        self.assertLess(abs(math.log(stated["single_light"] / true)), math.log(1.2))
        floor = numpy.flatnonzero(names[group] == b"floor")
        parts = []
        for chosen in floor[:1], floor[:: len(floor) // 10]:
            emission = numpy.zeros(n)
            emission[chosen] = 1
            numpy.save(self.path("emission.npy"), emission)
            error = json.loads(must("solve", store, "--emission", self.path("emission.npy"), "--json").stdout)["error"]
            parts.append(error["mesh"])
        self.assertTrue(all(.5 * stated["single"] < part < 1.5 * stated["single"] for part in parts), (parts, stated))

    def test_groups_are_stated_as_if_they_were_lamps(self):
        """A group that is lit alone leaves what it does as the lamp of the scene; windows come first, however small."""
        common = "--mesh", "faces", "--probes", 8
        lit, dark = self.path("rooms.obj"), self.path("dark.obj")
        must("generate", "rooms", "--elements", 300, "-o", lit)
        materials = pathlib.Path(lit).with_suffix(".mtl").read_text(encoding="utf-8")
        plain = re.sub(r"(?m)^Ke .*$", "Ke 0 0 0", materials)
        self.assertNotEqual(plain, materials)
        plan = pathlib.Path(lit).read_text(encoding="utf-8").replace("rooms.mtl", "dark.mtl")
        pathlib.Path(dark).write_text(plan, encoding="utf-8")
        parts, n_faces = [], 0
        for line in plan.replace("o lamp-1\n", "o Window-1\n").splitlines(keepends=True):
            n_faces += line.startswith("f ")
            parts.append(f"o part-{n_faces // 15}\n{line}" if line.startswith("f ") and n_faces % 15 == 0 else line)
        pathlib.Path(self.path("windows.obj")).write_text("".join(parts), encoding="utf-8")
        pathlib.Path(dark).with_suffix(".mtl").write_text(plain, encoding="utf-8")
        stores = {}
        for name in "rooms", "dark", "windows":
            stores[name] = self.path(name + ".h5")
            must("precompute", self.path(name + ".obj"), "-o", stores[name], *common)
        with h5py.File(stores["dark"]) as file:
            mesh, figures = file["error/mesh"], dict(file["error/mesh"].attrs)
            share, light = mesh["group_share"][:], mesh["group_light"][:]
            names = [name.decode() for name in file["mesh/group_names"][:]]
            area = numpy.bincount(file["mesh/group"][:], file["mesh/area"][:], len(names))
        self.assertGreater((light > 0).sum(), 3)
        weight = light * area**2
        together = math.sqrt((share**2 * weight).sum() / weight.sum())
        self.assertLess(abs(math.log(figures["groups_together"] / together)), math.log(1.05))
        group = names[share.argmax()]
        kinds = dict(re.findall(r"o (\S+)\nusemtl (\S+)", plan))
        own = self.path("own.obj")
        text = plan.replace("dark.mtl", "own.mtl").replace(f"o {group}\nusemtl {kinds[group]}", f"o {group}\nusemtl lit")
        pathlib.Path(own).write_text(text, encoding="utf-8")
        block = re.search(rf"(?m)^newmtl {kinds[group]}$(?s:.*?)(?=^newmtl|\Z)", plain).group()
        glow = re.sub(r"(?m)^Ke .*$\n?", "", block).replace(kinds[group], "lit", 1) + "\nKe 1 1 1\n"
        pathlib.Path(own).with_suffix(".mtl").write_text(plain + "\n" + glow, encoding="utf-8")
        must("precompute", own, "-o", self.path("own.h5"), *common)
        with h5py.File(self.path("own.h5")) as file:
            lights = file["error/mesh"].attrs["lights"]
        self.assertLess(abs(math.log(share.max() / lights)), math.log(1.25), (group, share.max(), lights))
        with h5py.File(stores["windows"]) as file:
            names = [name.decode() for name in file["mesh/group_names"][:]]
            self.assertGreater(file["error/mesh/group_light"][names.index("Window-1")], 0)
            self.assertEqual(file["error/by_group/whole_groups"][0], names.index("Window-1"))

    def test_no_measurement(self):
        store = self.path("none.h5")
        must("precompute", self.scene, "-o", store, "--probes", 0)
        self.assertEqual(json.loads(must("info", store, "--json").stdout)["error"], {})
        advice = "precompute without --probes 0 measures it"
        self.assertEqual(must("info", store).stdout.splitlines()[1], f"error  not measured; {advice}")
        self.assertEqual(json.loads(must("solve", store, "--json").stdout)["error"], {"stated": None, "advice": advice})
        self.assertEqual(must("solve", store).stdout.splitlines()[-1], f"no error is stated: {advice}")

    def test_few_emitters_have_the_part_of_the_mesh(self):
        """As a store for any light has it, but for the luck of its looks; of emitters that are lamps and skies at once nothing is known."""
        numpy.save(self.path("sky.npy"), numpy.ones((3, 16)))
        mixed = {"emissions": [{"groups": {"lamp": 1}}, {"sky": [1] * 16}]}
        pathlib.Path(self.path("mixed.json")).write_text(json.dumps(mixed), encoding="utf-8")
        mesh = "--mesh", "faces", "--sky", "grid:4x4"
        any_light = self.made("any.h5", *mesh)[0]["error"]["mesh"]
        for emitters, name, light in (("group=lamp", "lights", ("--emit", "lamp=1")), ("sky", "sky_even", ("--sky", self.path("sky.npy")))):
            about, _, store = self.made("few.h5", *mesh, "--emitters", emitters)
            figures = about["error"]["mesh"]
            self.assertLess(abs(math.log(figures[name] / any_light[name])), math.log(1.2), emitters)
            error = json.loads(must("solve", store, *light, "--json").stdout)["error"]
            self.assertGreater(error["parts"]["mesh"], .8 * figures[name], emitters)
            self.assertAlmostEqual(error["stated"], math.hypot(*error["parts"].values()), delta=1e-6)
        about, _, store = self.made("mixed.h5", *mesh, "--emitters", self.path("mixed.json"))
        self.assertNotIn("mesh", about["error"])

    def test_receivers_leave_areas_of_groups(self):
        """The mesh's part for a group that shines evenly goes by its whole area, whether its light is read or not."""
        part = []
        for options in (), ("--receivers", "floor"):
            _, _, store = self.made("read.h5", "--mesh", "faces", "--method", "hierarchical", *options)
            part.append(json.loads(must("solve", store, "--emit", "tall-block=1", "--json").stdout)["error"]["parts"]["mesh"])
        self.assertLess(abs(math.log(part[1] / part[0])), .03)

    def test_older_stores(self):
        """Without figures by group every group has the share of the scene, of the lamps for any emission."""
        _, _, store = self.made("older.h5")
        with h5py.File(store, "r+") as file:
            mesh = file["error/mesh"]
            for name in list(mesh):
                del mesh[name]
            for name in "single", "groups", "even_emitters", "groups_emitters":
                del mesh.attrs[name]
            add_checksums(file)
        share = must("info", store, "--json").stdout
        lights = json.loads(share)["error"]["mesh"]["lights"]
        for light in ("lamp=1",), ("floor=1",):
            error = json.loads(must("solve", store, "--emit", *light, "--json").stdout)["error"]
            # each group lacks m^2 and, together, m^4
            self.assertAlmostEqual(error["mesh"], math.sqrt(lights**2 + lights**4 / 2), delta=1e-6)

    def test_groups_have_their_own(self):
        """Elements of each group beside those of a mesh 16 times finer: light of the lamp, in a box whose faces get unequal light."""
        must("generate", "cornell", "--elements", 80, "-o", self.scene)
        _, _, coarse = self.made("coarse.h5", "--method", "exact")
        n, fine = len(values_of(coarse, "mesh/area")), self.path("fine.h5")
        must("precompute", self.scene, "-o", fine, "--elements", 16 * n, "--probes", 0, "--method", "exact", program=REFERENCE)
        light = []
        for store in coarse, fine:
            must("solve", store, "--quantity", "indirect", "-o", self.path("light.npy"))
            light.append(numpy.load(self.path("light.npy")).astype(float).reshape(-1, len(values_of(store, "mesh/area"))))
        area, group = values_of(fine, "mesh/area"), values_of(fine, "mesh/group")
        whole = numpy.searchsorted(numpy.cumsum(values_of(coarse, "mesh/area")), numpy.cumsum(area) - area / 2)
        off2, light2 = area * (light[0][:, whole] - light[1]) ** 2, area * light[1] ** 2
        stated = values_of(coarse, "error/mesh/lights_variation") / values_of(coarse, "error/mesh/lights_reflected")
        lamp = values_of(coarse, "mesh/emission").any(axis=0)
        for g, share in enumerate(stated):
            if g in values_of(coarse, "mesh/group")[lamp]:
                continue
            here = group == g
            true = math.sqrt(off2[:, here].sum() / light2[:, here].sum())
            # 16 looks or more of a relative spread of up to 2 make a standard error of the share of a quarter
            self.assertLess(abs(math.log(share / true)), math.log(1.75), (g, share, true))
        self.assertGreater(stated.max(), 1.3 * stated.min())


if __name__ == "__main__":
    unittest.main()
