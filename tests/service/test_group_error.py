"""--group-error lowers the stated error of the worst group of the scene to a limit: two rooms, between which there is a hole of
.2 m, so that each is nearly dark for lamps of the other."""

import json
import os
import re
import unittest

import h5py
import numpy

from case import Case
from command import REFERENCE, must
from quads import Quads

TRIAL = re.compile(r"trial (\d): the error of the mean of (\S+) by (.*) is stated as ([\d.e-]+), --group-error asks for ([\d.e-]+)"
                   r"(?:; next: (.*))?\n")
X = .1


def steps(begin, end, count):
    """Lines of a grid, two of which are the sides of the hole."""
    middle, half = (begin + end) / 2, .1
    return [*numpy.linspace(begin, middle - half, count), *numpy.linspace(middle + half, end, count)]


def write_rooms(path):
    """Two rooms of 4 x 4 x 3 m, .02 m apart, and the rim of the hole between them; each room has groups a0 to a5, b0 to b5."""
    faces = []

    def grid(group, axis, at, inward, us, vs, hole=False):
        """The face of a box at the coordinate `at` of an axis, whose normal looks along the axis (inward 1) or against it."""
        for i, (u0, u1) in enumerate(zip(us, us[1:])):
            for j, (v0, v1) in enumerate(zip(vs, vs[1:])):
                if hole and i == len(us) // 2 - 1 and j == len(vs) // 2 - 1:
                    continue
                corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
                faces.append((group, [numpy.roll([at, u, v], axis) for u, v in corners[::inward]]))

    for name, x in ("a", (0, 4)), ("b", (4.02, 8.02)):
        box = [x, (0, 4), (0, 3)]
        lines = [numpy.linspace(*x, 7), steps(0, 4, 4), steps(0, 3, 3)]
        for axis in range(3):
            for side in range(2):
                grid(f"{name}{2 * axis + side}", axis, box[axis][side], 1 - 2 * side, lines[(axis + 1) % 3],
                     lines[(axis + 2) % 3], axis == 0 and side == (name == "a"))
    for axis, (low, high) in ((1, (1.9, 2.1)), (2, (1.4, 1.6))):
        for side, at in enumerate((low, high)):
            across, along = ((1.4, 1.6), (4, 4.02)) if axis == 1 else ((4, 4.02), (1.9, 2.1))
            grid("rim", axis, at, 1 - 2 * side, across, along)
    quads = Quads()
    quads.groups, quads.faces = zip(*faces)
    quads.write(path, .7)


class GroupError(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.rooms = os.path.join(cls.shared.name, "rooms.obj")
        cls.plain, cls.kept, cls.exact = (os.path.join(cls.shared.name, name) for name in ("plain.h5", "kept.h5", "exact.h5"))
        write_rooms(cls.rooms)
        how = "--method", "hierarchical", "--probes", 16
        must("precompute", cls.rooms, "-o", cls.plain, *how, threads=2)
        cls.done = must("precompute", cls.rooms, "-o", cls.kept, *how, "--group-error", X, "--json", threads=2)
        # Errors of .1 are far above those of exact inverses by pairs, some .002.
        must("precompute", cls.rooms, "-o", cls.exact, "--method", "exact", "--probes", 0, "--seed", 7, threads=2, program=REFERENCE)

    @staticmethod
    def worst(store):
        with h5py.File(store) as file:
            figures = [file["/error/by_group"][name][0] for name in ("uniform", "near", "far")]
            return numpy.nanmax(figures), dict(file["/operator"].attrs)

    def test_the_stated_error_is_kept(self):
        before, plain = self.worst(self.plain)
        after, attributes = self.worst(self.kept)
        self.assertGreater(before, 2 * X)
        self.assertLessEqual(after, X)
        self.assertNotIn("group_error", plain)
        self.assertEqual(attributes["group_error"], X)
        self.assertEqual(attributes["group_error_stated"], after)
        self.assertNotIn("epsilon", attributes)
        trials = TRIAL.findall(self.done.stderr)
        self.assertEqual(attributes["trials"], len(trials))
        self.assertGreaterEqual(len(trials), 2)
        self.assertAlmostEqual(float(trials[0][3]), before, delta=.01 * before + .005)
        self.assertRegex(trials[0][5], "^coefficients for --epsilon")
        self.assertEqual(trials[-1][5], "")
        self.assertNotIn("advice", json.loads(self.done.stdout))
        printed = must("info", self.kept).stdout
        self.assertIn("error of the worst group", printed)

    def test_receivers_keep_it_too(self):
        """The last trial aims below the limit: the worst of six groups is another one in every trial."""
        for receivers, limit in ((",".join(f"a{k}" for k in range(6)), .05), ("b0", .02)):
            store = self.path("receivers.h5")
            must("precompute", self.rooms, "-o", store, "--method", "hierarchical", "--probes", 16, "--receivers", receivers,
                 "--group-error", limit, threads=2)
            after, attributes = self.worst(store)
            self.assertLessEqual(after, limit)
            self.assertEqual(attributes["group_error_stated"], after)

    def dark(self, store):
        """The means of the groups of room a, for each wall of room b as the lamp."""
        means = []
        for lamp in range(6):
            done = must("solve", store, "--emit", f"b{lamp}=1", *(word for k in range(6) for word in ("--reduce", f"a{k}=mean")),
                        "--json", "--quantity", "indirect")
            groups = json.loads(done.stdout)["groups"]
            means += [groups[f"a{k}"]["mean"] for k in range(6)]
        return numpy.array(means)

    def test_the_dark_room_is_right(self):
        """By the exact inverse of other form factors."""
        truth, plain, kept = (self.dark(store) for store in (self.exact, self.plain, self.kept))
        # The hole is a 2,000th of the walls of a room.
        self.assertTrue(0 < truth.min() and truth.max() < .002, truth)

        def error(x):
            return numpy.sqrt(((x - truth) ** 2).sum() / (truth ** 2).sum())

        self.assertLess(error(kept), .5 * error(plain))
        self.assertLess(error(kept), X)

    def test_a_limit_of_trials_ends_with_a_warning(self):
        store = self.path("s.h5")
        done = must("precompute", self.rooms, "-o", store, "--method", "hierarchical", "--probes", 16, "--group-error", X, "--trials",
                    1, threads=2)
        self.assertEqual(len(TRIAL.findall(done.stderr)), 1)
        self.assertRegex(done.stderr, r"warning: the error of the mean of \S+ by single elements .* is stated as [\d.]+, above 0.1 of "
                                      r"--group-error; --trials 3 would lower it\n")
        self.assertEqual(self.worst(store)[0], self.worst(self.plain)[0])

    def test_a_kind_without_the_knob_names_one_that_has_it(self):
        done = must("precompute", self.rooms, "-o", self.path("s.h5"), "--method", "2msc", "--probes", 16, "--group-error", .001,
                    threads=2)
        self.assertRegex(done.stderr, r"above 0.001 of --group-error; --method hierarchical would lower it\n")

    def test_with_epsilon(self):
        """Both are kept."""
        store = self.path("s.h5")
        done = must("precompute", self.rooms, "-o", store, "--method", "hierarchical", "--probes", 16, "--group-error", X, "--epsilon",
                    .02, threads=2)
        worst, attributes = self.worst(store)
        self.assertLessEqual(worst, X, done.stderr)
        self.assertLessEqual(attributes["epsilon_stated"], .02)
        self.assertEqual((attributes["epsilon"], attributes["group_error"]), (.02, X))

    def test_refused(self):
        store = self.path("s.h5")
        for value in 0, -1, 1, 2, "nan", "much":
            self.refused(2, "--group-error", "precompute", self.rooms, "-o", store, "--group-error", value)
        self.refused(2, "--probes", "precompute", self.rooms, "-o", store, "--group-error", X, "--probes", 0)
        self.refused(2, "--time and --group-error exclude each other", "precompute", self.rooms, "-o", store,
                     "--group-error", X, "--time", 10)
        self.assertFalse(os.path.exists(store))


if __name__ == "__main__":
    unittest.main()
