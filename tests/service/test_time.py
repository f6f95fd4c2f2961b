"""--time: a recipe is chosen from forecasts before the work begins, and the options in the log give the same store."""

import os
import re
import unittest

import h5py

from case import Case
from command import must

CHOSEN = re.compile(r"^--time (\S+): forecast (.*), indirect error of single elements about ([\d.e-]+); the same store without "
                    r"--time: (--form-factors .*)$", re.MULTILINE)
# The command and the moment differ between any two runs, and seconds with them.
OF_THE_RUN = ("command", "created", "seconds")


def content(path):
    """Every dataset and attribute of a store but those of the run."""
    found = {}

    def keep(name, thing):
        if isinstance(thing, h5py.Dataset):
            found[name] = thing[()].tobytes()
        for key, value in thing.attrs.items():
            if not any(word in key for word in OF_THE_RUN):
                found[f"{name} {key}"] = str(value)

    with h5py.File(path) as file:
        keep("/", file)
        file.visititems(keep)
    return {name: value for name, value in found.items() if not name.startswith("checksum")}


class Time(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small, cls.room = cls.box, os.path.join(cls.shared.name, "room.obj")
        must("generate", "cornell", "--closed", "--elements", 1000, "-o", cls.room)

    def chosen(self, scene, seconds, *options):
        log = must("precompute", scene, "-o", self.path("a.h5"), "--time", seconds, *options).stderr
        found = CHOSEN.findall(log)
        self.assertEqual(len(found), 1, log)
        return log, float(found[0][2]), found[0][3]

    def test_the_options_give_the_same_store(self):
        """Blocks and rays in the room, whose cheapest recipes need more than a millisecond; pairs in the small scene, which an
        hour is enough for."""
        for scene, seconds, kind, wanted in ((self.room, .001, "blocks", "--form-factors blocks --method"),
                                             (self.room, .001, "rays", "--form-factors rays --rays 32 "),
                                             (self.small, 3600, "auto", "--form-factors rays --quality high")):
            _, _, options = self.chosen(scene, seconds, "--seed", 3, "--form-factors", kind)
            self.assertIn(wanted, options)
            must("precompute", scene, "-o", self.path("b.h5"), "--seed", 3, *options.split())
            one, two = content(self.path("a.h5")), content(self.path("b.h5"))
            self.assertGreater(len(one), 20)
            self.assertEqual(one.keys(), two.keys())
            for name, value in one.items():
                self.assertEqual(value, two[name], name)

    def test_more_time_has_a_smaller_error(self):
        """Between times that no machine confuses."""
        least, first, options = self.chosen(self.small, .001)
        self.assertRegex(least, r"warning: --time 0.001: the cheapest recipe is forecast to take .*, and is taken\n")
        self.assertIn("--probes 8", options)
        most, last, options = self.chosen(self.small, 3600)
        self.assertNotIn("cheapest", most)
        self.assertIn("--probes 32", options)
        self.assertLess(last, first / 10)

    def test_the_judge_counts(self):
        """The forecast of the choice is not far below that of the recipe that is taken: judges of blocks cost more than these."""
        patio = self.path("patio.obj")
        must("generate", "patio", "--elements", 600, "-o", patio)
        log, _, _ = self.chosen(patio, 3600, "--form-factors", "blocks")
        chosen = float(re.search(r"forecast ([\d.]+) s, indirect", log)[1])
        line = re.search(r"processor seconds, forecast and taken: form factors (\S+) .*, operator (\S+) .*, judge (\S+) ", log)
        self.assertGreater(chosen * os.cpu_count(), .6 * sum(float(part) for part in line.groups()))

    def test_other_options_are_kept(self):
        _, _, options = self.chosen(self.small, 3600, "--form-factors", "rays", "--probes", 2)
        self.assertNotIn("--probes", options)
        with h5py.File(self.path("a.h5")) as file:
            self.assertEqual(file["/error/single"].attrs["probes"], 2)
        _, _, options = self.chosen(self.room, .001, "--form-factors", "rays", "--probes", 0)
        self.assertIn("--rays", options)

    def test_wrong_values(self):
        for value in ("0", "-1", "nan", "inf", "soon", ""):
            self.refused(2, "--time", "precompute", self.small, "-o", self.path("a.h5"), "--time", value)

    def test_what_it_chooses_is_not_given_beside_it(self):
        for option, value in (("--epsilon", .1), ("--rays", 64), ("--quality", "high"), ("--trials", 2), ("--resolution", 64),
                              ("--emitters", "sky"), ("--scratch", self.folder)):
            self.refused(2, f"--time and {option} exclude each other", "precompute", self.small, "-o", self.path("a.h5"), "--time", 1, option, value)
        for option, value in (("--form-factors", "hemicube"), ("--method", "exact")):
            self.refused(2, "not supported together with " + option, "precompute", self.small, "-o", self.path("a.h5"),
                         "--time", 1, option, value)
        self.refused(2, "a store has its form factors", "precompute", self.store, "-o", self.path("a.h5"), "--time", 1)
        self.refused(2, "--trials", "precompute", self.small, "-o", self.path("a.h5"), "--trials", 4)

    def test_one_trial(self):
        """--trials 1 leaves an epsilon that the first operator misses."""
        log = must("precompute", self.small, "-o", self.path("a.h5"), "--method", "hierarchical", "--epsilon", .003, "--quality", "draft",
                   "--rays", 64, "--probes", 2, "--trials", 1).stderr
        self.assertIn("trial 1: ", log)
        self.assertNotIn("next: ", log)
        self.assertIn("warning: ", log)


if __name__ == "__main__":
    unittest.main()
