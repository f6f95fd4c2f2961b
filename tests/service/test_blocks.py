"""Form factors by blocks of clusters, from the command line: when they are taken, what they cannot be given with, and
that their answers are those of pairs within the stated error."""

import os
import re
import unittest

import h5py
import numpy

from case import Case
from command import lambert, must
from quads import Quads


class Blocks(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.room = os.path.join(cls.shared.name, "room.obj")
        must("generate", "cornell", "--closed", "--elements", 1000, "--reflectance", .5, "-o", cls.room)

    def precompute(self, name, *options):
        store = self.path(name)
        done = must("precompute", self.room, "-o", store, "--epsilon", .2, *options)
        return store, done.stderr

    @staticmethod
    def attributes(store, group="/operator"):
        with h5py.File(store) as file:
            return dict(file[group].attrs)

    def test_auto_takes_blocks_for_large_planes(self):
        self.room = self.path("large.obj")
        must("generate", "cornell", "--closed", "--elements", 4200, "--reflectance", .5, "-o", self.room)
        store, log = self.precompute("auto.h5", "--probes", 0)
        self.assertEqual(self.attributes(store)["form_factors"], b"blocks")
        self.assertRegex(log, r"blocks of clusters are taken: about .* s of one thread, by a sample of them\n")
        self.assertNotIn("pairs are", log)
        self.assertRegex(log, r"forecast: form factors [\d.]+ s,")
        self.assertRegex(log, r"\d+ blocks of \d+ planes: .* linear, .* partly hidden")
        rays, log = self.precompute("rays.h5", "--probes", 0, "--form-factors", "rays", "--quality", "draft",
                                    "--rays", 64, "--method", "hierarchical")
        self.assertEqual(self.attributes(rays)["form_factors"], b"rays")
        self.assertNotIn("blocks of", log)

    def test_at_high_quality_blocks_are_weighed_against_pairs(self):
        store, log = self.precompute("auto.h5", "--probes", 0, "--quality", "high", "--elements", 1100)
        self.assertEqual(self.attributes(store)["form_factors"], b"blocks")
        self.assertRegex(log, r"blocks of clusters are taken instead: about .* s of one thread, by a sample of them; "
                              r"pair by pair to .*: .* s\n")

    def test_memory_that_is_too_small_for_rows_has_room_for_blocks(self):
        self.room = self.path("large.obj")
        must("generate", "cornell", "--closed", "--elements", 4200, "--reflectance", .5, "-o", self.room)
        most = {}

        def made(way, *options):
            store, log = self.precompute("one.h5", "--probes", 0, *options)
            most[way] = int(re.search(r"memory up to (\d+)M", log)[1])
            return store

        made("rays", "--form-factors", "rays", "--method", "exact")
        store = made("auto", "--memory", f"{most['rays'] - 1}M")
        self.assertEqual(self.attributes(store)["form_factors"], b"blocks")
        self.assertLess(2 * most["auto"], most["rays"])
        refused = lambert("precompute", self.room, "-o", self.path("no.h5"), "--epsilon", .2, "--probes", 0, "--memory",
                          f"{most['auto'] // 2}M")
        self.assertEqual(refused.returncode, 1)
        self.assertRegex(refused.stderr.splitlines()[-1],
                         rf"elements with blocks need about {most['auto']}M of memory, --memory allows")
        self.assertFalse(os.path.exists(self.path("no.h5")))

    def test_answers_are_those_of_pairs(self):
        blocks, _ = self.precompute("blocks.h5", "--probes", 0, "--form-factors", "blocks")
        pairs, _ = self.precompute("pairs.h5", "--probes", 0, "--form-factors", "rays", "--method", "exact")
        count = h5py.File(blocks)["/mesh/elements"].shape[0]
        emission = numpy.random.default_rng(1).random((1, count)).astype("f4")
        lamp = numpy.zeros((1, count), "f4")
        lamp[:, : count // 50] = 1
        for light, allowed in ((emission, .006), (lamp, .05)):
            numpy.save(self.path("e.npy"), light)
            answers = []
            for store in (blocks, pairs):
                must("solve", store, "--emission", self.path("e.npy"), "--quantity", "indirect", "-o",
                     self.path("b.npy"))
                answers.append(numpy.load(self.path("b.npy")).astype("f8"))
            off = numpy.linalg.norm(answers[0] - answers[1]) / numpy.linalg.norm(answers[1])
            self.assertLess(off, allowed)

    def test_the_judge_states_what_verify_finds(self):
        store, _ = self.precompute("judged.h5", "--probes", 8, "--form-factors", "blocks")
        stated = self.attributes(store, "/error/single")
        self.assertLess(stated["total_indirect_mean"], .15)
        self.assertLess(self.attributes(store, "/error/random")["total_indirect_mean"], .006)
        self.assertGreater(stated["reference_noise"], 0)
        self.assertLess(stated["reference_noise"], stated["total_indirect_mean"])
        done = must("verify", store, "--probes", 8)
        self.assertRegex(done.stdout, r"ok +error")

    def test_what_needs_rows_is_refused(self):
        for options, reason in ((("--scratch", self.path("rows")), "--scratch"),
                                (("--method", "low-rank", "--rank", 8), "--method low-rank needs rows")):
            done = self.failed(reason, "precompute", self.room, "-o", self.path("no.h5"), "--form-factors", "blocks",
                               *options)
            self.assertIn("--form-factors blocks: ", done.stderr)
            self.assertIn("give --form-factors rays", done.stderr)
            self.assertFalse(os.path.exists(self.path("no.h5")))

    def test_a_sky_lights_blocks_as_it_lights_pairs(self):
        """All that the tiles of two bands give a court, through direct light and what is reflected."""
        court, answers, quads = self.path("court.obj"), [], Quads()
        quads.box("wall", (0, 0, 0), (6, 6, 3), (6, 6, 4), holes={5: (.5, 5.5, .5, 5.5)})
        quads.box("table", (2, 1.5, .7), (4.5, 3, .8), (4, 3, 1), inward=-1)
        quads.write(court, .5)
        numpy.save(self.path("sky.npy"), numpy.linspace(.5, 1, 8, dtype="f4")[None])
        for method in ("blocks", "rays"):
            done = must("precompute", court, "-o", self.path("court.h5"), "--method", "hierarchical", "--probes", 0,
                        "--epsilon", .01, "--form-factors", method, "--sky", "grid:4x2", "--ground-albedo", .2)
            self.assertIn("sky: grid:4x2, 8 tiles, ground albedo 0.2", done.stderr)
            must("solve", self.path("court.h5"), "--sky", self.path("sky.npy"), "-o", self.path("b.npy"))
            answers.append(numpy.load(self.path("b.npy")).astype("f8").ravel())
        self.assertGreater(answers[1].max(), .5)
        self.assertLess(numpy.linalg.norm(answers[0] - answers[1]), .03 * numpy.linalg.norm(answers[1]))

    def test_faces_that_coincide_are_told_and_lose_no_light(self):
        """A closed box with 676 squares on its floor, too many to cut it around them: both see all walls. The rows are
        repaired, and the answer is that of pairs, which are repaired likewise."""
        double, answers, quads = self.path("double.obj"), [], Quads()
        quads.box("wall", (0, 0, 0), (1, 1, 1), (6, 6, 6))
        floor = [k for k, group in enumerate(quads.groups) if group == "wall4"]
        quads.groups, quads.faces = ([x for k, x in enumerate(of) if k not in floor] for of in (quads.groups, quads.faces))
        quads.grid("floor", 2, 0, 1, numpy.array([0, 1]), numpy.array([0, 1]))
        for x in numpy.arange(26) / 26:
            for y in numpy.arange(26) / 26:
                quads.grid("tiles", 2, 0, 1, x + numpy.array([.003, .035]), y + numpy.array([.003, .035]))
        quads.write(double, .5)
        for method in ("blocks", "rays"):
            done = must("precompute", double, "-o", self.path("double.h5"), "--method", "hierarchical", "--probes", 0,
                        "--mesh", "faces", "--epsilon", .01, "--form-factors", method)
            self.assertIn("some faces may coincide", done.stderr)
            self.assertIn(" overlap others in one plane, ", done.stderr)
            count = h5py.File(self.path("double.h5"))["/mesh/elements"].shape[0]
            numpy.save(self.path("e.npy"), numpy.linspace(0, 1, count, dtype="f4")[None])
            must("solve", self.path("double.h5"), "--emission", self.path("e.npy"), "-o", self.path("b.npy"))
            answers.append(numpy.load(self.path("b.npy")).astype("f8"))
        self.assertLess(numpy.abs(answers[0] - answers[1]).max(), .02 * answers[1].max())

    def test_more_planes_than_blocks_can_take_are_refused(self):
        sphere, sides = self.path("sphere.obj"), 66
        with open(sphere, "w") as file:
            for i in range(1, sides):
                for j in range(sides):
                    up, around = numpy.pi * i / sides, 2 * numpy.pi * j / sides
                    radius = numpy.sin(up)
                    file.write(f"v {radius * numpy.cos(around)} {radius * numpy.sin(around)} {numpy.cos(up)}\n")
            for i in range(sides - 2):
                for j in range(sides):
                    a, b = i * sides + j + 1, i * sides + (j + 1) % sides + 1
                    file.write(f"f {a} {a + sides} {b + sides} {b}\n")
        self.failed("planes, at most 4096 are possible; give --form-factors rays", "precompute", sphere, "-o",
                    self.path("no.h5"), "--form-factors", "blocks")


if __name__ == "__main__":
    unittest.main()
