"""Black box: elements where light changes (--mesh-error), and the error of the mesh that stores state."""

import json
import math
import re
import unittest

import h5py
import numpy

from case import Case
from command import REFERENCE, must


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
        must("solve", store, "--emit", "lamp=1", "-o", self.path("answer.json"))
        with open(self.path("answer.json"), encoding="utf-8") as stream:
            self.assertEqual(json.load(stream)["error"]["mesh"], figures["lights"])

    def test_what_solve_states_has_the_part_of_the_mesh(self):
        """The line is the root of the sum of the squares of the parts, of this answer's light; members of JSON are the parts."""
        about, _, store = self.made("stated.h5", "--sky", "tregenza")
        numpy.save(self.path("sky.npy"), numpy.ones((3, 145)))
        mesh = about["error"]["mesh"]
        skies = max(mesh["sky_even"], mesh["sky_cloudy"])
        for light, part in (((), mesh["lights"]), (("--emit", "lamp=1"), mesh["lights"]), (("--sky", self.path("sky.npy")), skies),
                            (("--emit", "lamp=1", "--reduce", "floor=mean"), mesh["lights"])):
            parts = json.loads(must("solve", store, *light, "--json").stdout)["error"]
            self.assertEqual(parts["mesh"], part)
            line = must("solve", store, *light).stdout.splitlines()[-1]
            told = re.fullmatch(r"stated error of .*: relative (\S+), indirect (\S+) \(operator and form factors: relative (\S+), "
                                r"indirect (\S+); mesh: indirect (\S+)\)", line)
            self.assertIsNotNone(told, line)
            indirect = math.hypot(parts["indirect_mean"], part)
            wanted = (parts["relative_mean"] * indirect / parts["indirect_mean"], indirect, parts["relative_mean"], parts["indirect_mean"], part)
            for number, right in zip(told.groups(), wanted):
                self.assertAlmostEqual(float(number), right, delta=.005 * right)  # three digits
            self.assertGreater(indirect, .05)

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
        numpy.save(self.path("sky.npy"), skies[0])
        must("solve", coarse, "--sky", self.path("sky.npy"), "-o", self.path("answer.json"))
        with open(self.path("answer.json"), encoding="utf-8") as stream:
            self.assertEqual(json.load(stream)["error"]["mesh"], max(stated["sky_even"], stated["sky_cloudy"]))
        must("solve", coarse, "--emit", "floor=1", "--sky", self.path("sky.npy"), "-o", self.path("answer.json"))
        with open(self.path("answer.json"), encoding="utf-8") as stream:
            self.assertEqual(json.load(stream)["error"]["mesh"], stated["lights"])

    def test_no_measurement(self):
        store = self.path("none.h5")
        must("precompute", self.scene, "-o", store, "--probes", 0)
        self.assertEqual(json.loads(must("info", store, "--json").stdout)["error"], {})


if __name__ == "__main__":
    unittest.main()
