"""--epsilon of the hierarchical kind is an error that is kept: trials lower the stated error of the lights to it, the store
says so, and a warning comes where they cannot."""

import json
import os
import re
import unittest

import h5py

from case import Case
from command import must

TRIAL = re.compile(r"trial (\d): the indirect error of (.*) is stated as ([\d.e-]+), --epsilon asks for ([\d.e-]+)(?:; next: (.*))?\n")


class KeptEpsilon(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.room, cls.large, cls.city = (os.path.join(cls.shared.name, name) for name in ("room.obj", "large.obj", "city.obj"))
        must("generate", "cornell", "--closed", "--elements", 300, "-o", cls.room)
        must("generate", "cornell", "--closed", "--elements", 1500, "-o", cls.large)
        must("generate", "city", "--elements", 400, "-o", cls.city)

    def precompute(self, scene, *options):
        store = self.path("s.h5")
        done = must("precompute", scene, "-o", store, "--probes", 2, "--method", "hierarchical", "--json", *options, threads=2)
        with h5py.File(store) as file:
            errors = {name: dict(file["/error"][name].attrs) for name in file["/error"]}
            return done.stderr, json.loads(done.stdout), dict(file["/operator"].attrs), errors

    def test_a_reachable_error_is_kept(self):
        log, about, operator, errors = self.precompute(self.room, "--epsilon", .01)
        self.assertLessEqual(errors["lights"]["total_indirect_mean"], .01)
        self.assertEqual(operator["epsilon"], .01)
        self.assertEqual(operator["epsilon_stated"], errors["lights"]["total_indirect_mean"])
        self.assertEqual(operator["trials"], len(TRIAL.findall(log)))
        self.assertEqual(about["epsilon"], .01)
        self.assertNotIn("advice", about)

    def test_trials_lower_it(self):
        """Of few rays the first trial is far off; a finer one keeps it."""
        log, _, operator, errors = self.precompute(self.room, "--quality", "draft", "--epsilon", .03)
        trials = TRIAL.findall(log)
        self.assertGreaterEqual(len(trials), 2, log)
        self.assertGreater(float(trials[0][2]), .03)
        self.assertEqual({trial[1] for trial in trials}, {"the scene's own lights"})
        self.assertRegex(trials[0][4], r"^\d+ rays in place of \d+$")
        self.assertEqual(trials[-1][4], "")
        self.assertLessEqual(errors["lights"]["total_indirect_mean"], .03)
        self.assertEqual(operator["trials"], len(trials))
        self.assertEqual(operator["rays"], int(re.match(r"\d+", trials[-2][4])[0]))
        done = must("verify", self.path("s.h5"), self.room, "--probes", 2)
        self.assertIn("as stated", done.stdout)

    def test_only_the_threshold_of_kept_form_factors(self):
        kept, scene = self.path("kept.h5"), self.path("scene.obj")
        must("generate", "cornell", "--elements", 640, "-o", scene)
        must("precompute", scene, "-o", kept, "--probes", 0, "--method", "hierarchical", "--keep-form-factors")
        log, _, operator, _ = self.precompute(kept, "--epsilon", .005, "--probes", 1)
        trials = TRIAL.findall(log)
        self.assertGreaterEqual(len(trials), 2, log)
        for trial in trials[:-1]:
            self.assertRegex(trial[4], r"^coefficients for --epsilon [\d.e-]+ in place of [\d.e-]+$")
        self.assertLess(float(trials[-1][2]), float(trials[0][2]))
        # A fiftieth of the --epsilon that the last trial was built for, of which the log has two digits.
        built_for = re.search(r"[\d.e-]+(?= in place)", trials[-2][4])[0]
        self.assertEqual(f"{operator['threshold'] / .02:.2g}", built_for)

    def test_an_error_out_of_reach_ends_with_a_warning(self):
        log, about, operator, errors = self.precompute(self.city, "--rays", 64, "--epsilon", .001)
        stated = errors["random"]["total_indirect_mean"]
        self.assertGreater(stated, .001)
        self.assertEqual(len(TRIAL.findall(log)), 1)  # the number of rays was given
        self.assertRegex(log, r"warning: the indirect error of random emission is stated as [\d.]+, above 0.001 of --epsilon; "
                              r"--rays \d+ would lower it\n")
        self.assertIn("--rays", about["advice"])
        self.assertEqual(operator["epsilon"], .001)
        self.assertEqual(operator["epsilon_stated"], stated)

    def test_memory_that_is_too_small_keeps_the_best(self):
        """As much memory as the first trial needs, and no more."""
        log = self.precompute(self.large, "--quality", "draft", "--epsilon", .05)[0]
        most = re.search(r"memory up to (\d+)M", log)[1]
        few = int(re.match(r"\d+", TRIAL.findall(log)[0][4])[0])
        log, _, operator, errors = self.precompute(self.large, "--quality", "draft", "--epsilon", .05, "--memory", f"{most}M")
        self.assertLess(operator["rays"], few)
        self.assertGreater(errors["lights"]["total_indirect_mean"], .05)
        self.assertRegex(log, r"above 0.05 of --epsilon; --memory \d+M would lower it\n")

    def test_nothing_loops_at_defaults_or_without_a_judge(self):
        log, about, operator, _ = self.precompute(self.room)
        self.assertEqual(TRIAL.findall(log), [])
        self.assertNotIn("epsilon", operator)
        done = must("precompute", self.room, "-o", self.path("s.h5"), "--probes", 0, "--method", "hierarchical", "--epsilon",
                    .01)
        self.assertEqual(TRIAL.findall(done.stderr), [])

    def test_defaults_keep_what_they_would_warn_of(self):
        """The threshold of the preset leaves .033 of the lamp's light in this box, of which form factors pair by pair have
        no part; a finer one costs next to nothing beside these."""
        scene = self.path("lit.obj")
        must("generate", "cornell", "--elements", 400, "-o", scene)
        log, about, operator, errors = self.precompute(scene)
        first, second = re.findall(r"trial \d: the indirect error of the scene's own lights is stated as (\S+), (above 0.03; next: "
                                   r"coefficients for --epsilon [\d.]+ in place of 0.05|at most 0.03)\n", log)
        self.assertGreater(float(first[0]), .03)
        self.assertAlmostEqual(float(second[0]), errors["lights"]["total_indirect_mean"], delta=.001)
        self.assertLessEqual(errors["lights"]["total_indirect_mean"], .03)
        self.assertEqual(operator["trials"], 2)
        self.assertNotIn("epsilon_stated", operator)
        self.assertNotIn("advice", about)
        log, about, *_ = self.precompute(scene, "--trials", 1)
        self.assertNotIn("trial 1", log)
        self.assertIn("--epsilon", about["advice"])

    def test_threads_do_not_change_the_trials(self):
        logs = []
        for threads in 1, 2:
            done = must("precompute", self.room, "-o", self.path("s.h5"), "--probes", 2, "--method", "hierarchical", "--quality",
                        "draft", "--epsilon", .03, threads=threads)
            logs.append(TRIAL.findall(done.stderr))
        self.assertEqual(*logs)


if __name__ == "__main__":
    unittest.main()
