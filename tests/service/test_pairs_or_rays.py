"""All pairs, near pairs or rays, from the command line: the log says which are taken and why, and the store is the same
however many threads there are."""

import unittest

import h5py

from case import Case
from command import must


class PairsOrRays(Case):
    def precompute(self, scene, name, threads=2):
        done = must("precompute", scene, "-o", self.path(name), "--probes", 0, threads=threads)
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
        again, other = self.precompute(soup, "again.h5", threads=3)
        self.assertEqual({key: operator[key] for key in ("rays", "ray_seed")},
                         {key: other[key] for key in ("rays", "ray_seed")})
        self.assertEqual([line for line in log.split("\n") if "all pairs" in line],
                         [line for line in again.split("\n") if "all pairs" in line])

    def test_a_small_room_gets_pairs(self):
        room = self.path("room.obj")
        must("generate", "cornell", "--elements", 800, "-o", room)
        log, operator = self.precompute(room, "room.h5")
        self.assertRegex(log, r"all pairs are taken: about .* s of one thread, by a sample of them\n")
        self.assertNotIn("not all pairs", log)
        self.assertEqual(operator["form_factors"], b"pairs")


if __name__ == "__main__":
    unittest.main()
