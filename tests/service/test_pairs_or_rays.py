"""All pairs, near pairs or rays, from the command line: the log says which are taken and why. unit.weigh_pairs tests that
threads do not change the choice."""

import unittest

import h5py

from case import Case
from command import must


class PairsOrRays(Case):
    def precompute(self, scene, name):
        done = must("precompute", scene, "-o", self.path(name), "--probes", 0, threads=2)
        with h5py.File(self.path(name)) as file:
            return done.stderr, dict(file["/operator"].attrs)

    def test_a_soup_gets_rays(self):
        soup = self.path("soup.obj")
        must("generate", "canopy", "--elements", 4000, "-o", soup)
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


if __name__ == "__main__":
    unittest.main()
