"""All pairs, near pairs or rays, from the command line: the log says which are taken and why, and a warning which option lowers
an error that is large all the same. unit.weigh_pairs tests that threads do not change the choice."""

import json
import re
import unittest

import h5py

from case import Case
from command import must


class PairsOrRays(Case):
    def precompute(self, scene, name, *options):
        done = must("precompute", scene, "-o", self.path(name), "--probes", 0, *options, threads=2)
        with h5py.File(self.path(name)) as file:
            return done.stderr, dict(file["/operator"].attrs)

    def test_a_soup_gets_rays(self):
        soup = self.path("soup.obj")
        must("generate", "canopy", "--elements", 3000, "-o", soup)
        log, operator = self.precompute(soup, "soup.h5")
        self.assertRegex(log, r"not all pairs are taken: all pairs need about .* of one thread, by a sample of them, "
                              r"and \d+ rays per element .* s\n")
        self.assertRegex(log, r"forecast: form factors [\d.]+ s,")
        self.assertEqual(operator["form_factors"], b"rays")

    def test_a_small_room_gets_pairs(self):
        room = self.path("room.obj")
        must("generate", "cornell", "--elements", 800, "-o", room)
        log, operator = self.precompute(room, "room.h5")
        self.assertRegex(log, r"all pairs are taken: about .* s of one thread, by a sample of them\n")
        self.assertNotIn("not all pairs", log)
        self.assertEqual(operator["form_factors"], b"pairs")

    def test_pairs_are_as_fine_as_the_operator_needs(self):
        """As the root of epsilon from .0031 on; those of an operator without a threshold follow none but one that is given, and
        those that are kept, or of a scene with a sky, none."""
        room = self.path("room.obj")
        must("generate", "cornell", "--elements", 100, "-o", room)
        hierarchical, exact = ("--method", "hierarchical"), ("--method", "exact")
        for options, times in ((hierarchical, 4), ((*hierarchical, "--epsilon", .2), 8), ((*hierarchical, "--epsilon", .002), 1),
                               ((*hierarchical, "--keep-form-factors"), 1), ((*hierarchical, "--sky", "tregenza"), 1), (exact, 1),
                               ((*exact, "--epsilon", .0125), 2), ((*hierarchical, "--quality", "high", "--epsilon", .2), .8)):
            log, operator = self.precompute(room, "room.h5", *options)
            self.assertAlmostEqual(operator["accuracy"] / 7e-5, times, 6, options)
            self.assertNotIn("does not use --epsilon", log)
        log, _ = self.precompute(room, "room.h5", *exact, "--rays", 64, "--epsilon", .1)
        self.assertIn("exact does not use --epsilon", log)

    def test_a_large_error_names_an_option(self):
        city, store = self.path("city.obj"), self.path("city.h5")
        must("generate", "city", "--elements", 600, "-o", city)
        said = r"warning: the indirect error of random emission is stated as [\d.]+, above 0.03; --rays (\d+) would lower it\n"

        def stated(*options):
            done = must("precompute", city, "-o", store, "--probes", 4, "--json", *options, threads=2)
            answer = json.loads(done.stdout)
            with h5py.File(store) as file:
                return done.stderr, answer.get("advice"), file["/error/random"].attrs["total_indirect_mean"]

        log, advice, error = stated("--rays", 64)
        self.assertGreater(error, .03)
        self.assertRegex(log, said)
        self.assertIn(advice, log)
        _, _, less = stated("--rays", re.search(said, log).group(1))
        self.assertLess(less, error)
        log, advice, error = stated()
        self.assertLess(error, .03)
        self.assertNotIn("would lower it", log)
        self.assertIsNone(advice)


if __name__ == "__main__":
    unittest.main()
