"""Black box: a precomputation that is stopped again and again goes on where it was, with the same bits."""

import os
import random
import re
import resource
import shlex
import signal
import subprocess
import tempfile
import time
import unittest

import h5py

from command import ENVIRONMENT, LAMBERT, must, of_faces
from patience import PATIENCE

SEED = 20260301


class Scratch(unittest.TestCase):
    """An open box under a sky whose form factors take some dozens of blocks; what an undisturbed run makes of it."""

    threads = "2"

    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory()
        cls.scene = os.path.join(cls.shared.name, "room.obj")
        must("generate", "cornell", "--elements", "600", "-o", cls.scene)
        cls.options = ["--rays", "65536", "--probes", "0", "--rank", "16", "--method", "low-rank",
                       "--keep-form-factors", "--sky", "tregenza", "--ground-albedo", ".2"]
        cls.undisturbed = os.path.join(cls.shared.name, "undisturbed.h5")
        must("precompute", cls.scene, "-o", cls.undisturbed, *cls.options)

    @classmethod
    def tearDownClass(cls):
        cls.shared.cleanup()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.store = os.path.join(self.folder, "room.h5")
        self.scratch = os.path.join(self.folder, "scratch")
        self.rows = os.path.join(self.scratch, "form-factors.rows")
        self.command = [LAMBERT, *of_faces(("precompute", self.scene, "-o", self.store, *self.options, "--scratch", self.scratch))]

    def size(self):
        return os.stat(self.rows).st_size if os.path.exists(self.rows) else 0

    def stop_after(self, number, grown, pause):
        """Starts the command, and stops it when its file has grown by so much."""
        with open(os.path.join(self.folder, "log"), "w+", encoding="utf-8") as log:
            before = self.size()
            process = subprocess.Popen(self.command, stderr=log, env=dict(ENVIRONMENT, OMP_NUM_THREADS=self.threads))
            try:
                while self.size() < before + grown:
                    self.assertIsNone(process.poll(), "it ended before it could be stopped")
                    time.sleep(.002)
                time.sleep(pause)
                process.send_signal(number)
                status = process.wait(timeout=PATIENCE)
            finally:
                if process.poll() is None:
                    process.kill()
                    process.wait()
            log.seek(0)
            return status, log.read()

    def same_as_undisturbed(self):
        found = 0

        def visit(name, one):
            nonlocal found
            if isinstance(one, h5py.Dataset):
                found += 1
                self.assertEqual(one[()].tobytes(), other[name][()].tobytes(), name)

        with h5py.File(self.undisturbed) as wanted, h5py.File(self.store) as other:
            wanted.visititems(visit)
            self.assertEqual(sorted(wanted), sorted(other))
        self.assertGreater(found, 10)

    def test_killed_ten_times(self):
        print("seed", SEED)
        chance = random.Random(SEED)
        for stop in range(10):
            # Blocks of 16 rows are some kilobytes each: with their sky: one or two of the 38 at a time.
            status, said = self.stop_after(signal.SIGKILL, chance.randint(1, 20000), chance.uniform(0, .05))
            self.assertEqual(status, -signal.SIGKILL, said)
            self.assertFalse(os.path.exists(self.store))
            self.assertNotIn("form factors  ", said, "it was killed behind the form factors")
        done = must(*self.command[1:])
        kept, rows = map(int, re.search(r"(\d+) of (\d+) rows were in", done.stderr).groups())
        self.assertGreaterEqual(kept, 10)
        self.assertLess(kept, rows)
        self.same_as_undisturbed()
        self.assertFalse(os.path.exists(self.rows))

    def test_interrupted(self):
        status, said = self.stop_after(signal.SIGINT, 20000, 0)
        self.assertEqual(status, 1)
        last = said.splitlines()[-1]
        start = f"lambert precompute: cancelled; what was finished stays in {self.scratch}; to go on: lambert "
        self.assertTrue(last.startswith(start), last)
        done = must(*shlex.split(last[len(start):]))
        self.assertRegex(done.stderr, r"\d+ of 601 rows were in")
        self.same_as_undisturbed()

    def test_a_full_disk(self):
        def small():
            resource.setrlimit(resource.RLIMIT_FSIZE, (40000, 40000))
        done = subprocess.run(self.command, capture_output=True, text=True, timeout=PATIENCE, check=False, env=ENVIRONMENT,
                              preexec_fn=small)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr.splitlines()[-1], r"form-factors\.rows: .*; \d+ of \d+ blocks stay there")
        self.assertFalse(os.path.exists(self.store))
        again = must(*self.command[1:])
        self.assertRegex(again.stderr, r"\d+ of 601 rows were in")
        self.same_as_undisturbed()

    def test_other_options_are_refused(self):
        self.stop_after(signal.SIGKILL, 1, 0)
        before = self.size()
        for options, words in ((["--rays", "1024"], "other options"), (["--unit", "2"], "another scene")):
            done = subprocess.run([*self.command, *options], capture_output=True, text=True, timeout=PATIENCE, check=False,
                                  env=ENVIRONMENT)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(words, done.stderr.splitlines()[-1])
            self.assertIn(self.rows, done.stderr.splitlines()[-1])
            self.assertEqual(self.size(), before)

    def test_two_at_once_are_refused(self):
        with open(os.path.join(self.folder, "log"), "w", encoding="utf-8") as log:
            first = subprocess.Popen(self.command, stderr=log, env=ENVIRONMENT)
            try:
                while self.size() == 0:
                    self.assertIsNone(first.poll())
                    time.sleep(.002)
                second = subprocess.run([*self.command, "-o", self.store + "2"], capture_output=True, text=True,
                                        timeout=PATIENCE, check=False, env=ENVIRONMENT)
            finally:
                first.kill()
                first.wait()
        self.assertEqual(second.returncode, 1)
        self.assertIn("another run works there", second.stderr.splitlines()[-1])

    def test_unused(self):
        done = must("precompute", self.undisturbed, "-o", self.store, "--probes", "0", "--rank", "16",
                    "--scratch", self.scratch)
        self.assertIn("does not use --scratch", done.stderr)
        self.assertFalse(os.path.exists(self.scratch))


class Pairs(Scratch):
    """The same where form factors are found pair by pair, as they are at defaults, in a scene with so many occluders
    that its pairs are looked at closely by segments: projected ones leave nothing to the second file. One thread is
    slow enough for ten stops on a busy machine: the second file took half a second of two, and a late one found the run
    at its end."""

    threads = "1"

    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory()
        cls.scene = os.path.join(cls.shared.name, "room.obj")
        must("generate", "canopy", "--elements", "1000", "-o", cls.scene)
        cls.options = ["--probes", "0", "--rank", "16", "--method", "low-rank",
                       "--keep-form-factors"]
        cls.undisturbed = os.path.join(cls.shared.name, "undisturbed.h5")
        must("precompute", cls.scene, "-o", cls.undisturbed, *cls.options)

    def setUp(self):
        super().setUp()
        self.rows = os.path.join(self.scratch, "form-factors.rows.seen")

    def test_killed_ten_times(self):
        print("seed", SEED)
        chance = random.Random(SEED)
        for stop in range(10):
            # Some are stopped while pairs are found, some while it is looked closely at what is hidden.
            self.rows = os.path.join(self.scratch, "form-factors.rows." + ("found" if stop < 5 else "seen"))
            status, said = self.stop_after(signal.SIGKILL, 1, chance.uniform(0, .04))
            self.assertEqual(status, -signal.SIGKILL, said)
            self.assertNotIn("form factors  ", said, "it was killed behind the form factors")
        done = must(*self.command[1:])
        self.assertRegex(done.stderr, r"\d+ of \d+ rows were in")
        self.same_as_undisturbed()
        self.assertFalse(os.path.exists(self.rows))

    def test_interrupted(self):
        status, said = self.stop_after(signal.SIGINT, 1, 0)
        self.assertEqual(status, 1)
        self.assertIn("to go on: lambert ", said.splitlines()[-1])
        must(*self.command[1:])
        self.same_as_undisturbed()

    def test_a_full_disk(self):
        self.skipTest("the same code writes")

    test_other_options_are_refused = test_two_at_once_are_refused = test_unused = test_a_full_disk


class Large(unittest.TestCase):
    """Rows that memory is too small for lie in the scratch folder: the same store comes out."""

    def test_memory_too_small_for_rows(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, scratch = os.path.join(folder, "a.obj"), os.path.join(folder, "scratch")
            wide, narrow, again = (os.path.join(folder, name) for name in ("wide.h5", "narrow.h5", "again.h5"))
            options = ["--rank", "16", "--method", "low-rank", "--probes", "3", "--keep-form-factors", "--threads", "2"]
            traced = [*options, "--form-factors", "rays", "--rays", "300"]
            must("generate", "cornell", "--elements", "3000", "-o", scene)
            said = must("precompute", scene, "-o", wide, *traced).stderr
            needs = re.search(r"memory up to (\d+)M", said)
            self.assertIsNotNone(needs, said)
            less = ["--memory", f"{int(needs[1]) * 3 // 4}M"]
            for source, out, more in (scene, narrow, traced), (wide, again, options):
                command = ["precompute", source, "-o", out, *more, *less]
                refused = subprocess.run([LAMBERT, *command], capture_output=True, text=True, timeout=PATIENCE, check=False,
                                         env=ENVIRONMENT)
                self.assertEqual(refused.returncode, 1)
                self.assertIn("fits: --scratch DIR", refused.stderr.splitlines()[-1])
                said = must(*command, "--scratch", scratch).stderr
                self.assertIn("as memory is too small for them", said)
                self.assertFalse(os.path.exists(scratch))
                with h5py.File(wide) as one, h5py.File(out) as two:
                    for name in "form_factors/data", "form_factors/indices", "operator/V", "operator/Y", "mesh/row_sum":
                        if name in one:
                            self.assertTrue((one[name][()] == two[name][()]).all(), name)


class Forecast(unittest.TestCase):
    def test_said_before_the_form_factors(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, store = os.path.join(folder, "a.obj"), os.path.join(folder, "a.h5")
            must("generate", "box", "--divisions", "3", "-o", scene)
            said = must("precompute", scene, "-o", store, "--rays", "1000", "--scratch", folder).stderr
            line = next(line for line in said.splitlines() if line.startswith("forecast: "))
            self.assertRegex(line, r"^forecast: form factors [\d.]+ s, the judge [\d.]+ s, at [\d.e+-]+ Mray/s of [\d.]+ processors; "
                                   r"memory up to \d+M, store up to \d+M, scratch up to \d+M$")
            self.assertLess(said.index(line), said.index("form factors  "))


if __name__ == "__main__":
    unittest.main()
