"""Black box: the command line of `lambert`, its exit status, what it writes and what it leaves alone."""

import os
import re
import resource
import shutil
import signal
import subprocess
import time
import unittest

import h5py

from case import Case
from command import LAMBERT, must
from patience import PATIENCE


class Usage(Case):
    def test_help_and_version(self):
        self.assertRegex(must("--version").stdout, r"^lambert \d+\.\d+\.\d+\n$")
        verbs = must("--help").stdout
        for verb in ("generate", "precompute", "info", "sky", "luminaire", "solve", "verify", "render"):
            self.assertIn(verb, verbs)
            about = must(verb, "--help")
            self.assertIn("Usage: lambert " + verb, about.stdout)
            self.assertEqual(about.stderr, "")

    def test_help_names_every_option_of_the_contract(self):
        known = must("precompute", "--help").stdout
        for option in ("max-edge elements mesh-error unit up two-sided reflectance form-factors rays resolution quality "
                       "sky ground-albedo keep-form-factors method factorizer epsilon alpha levels rank keep-factors "
                       "coherence min-area assign threshold correction emitters "
                       "store-precision threads memory scratch seed probes quiet progress").split():
            self.assertRegex(known, r"--" + option + r"\b", option)
        known = must("solve", "--help").stdout
        for option in "emit emission sky quantity reduce tolerance output".split():
            self.assertRegex(known, r"--" + option + r"\b", option)

    def test_wrong_usage(self):
        for wanted, line in (
                ("no verb", ""),
                ("no such verb", "illuminate"),
                ("too few arguments", "precompute"),
                ("no -o", "precompute a.obj"),
                ("--bogus: no such option", "precompute a.obj -o b.h5 --bogus"),
                ("-x: no such option", "precompute a.obj -o b.h5 -x"),
                ("--rays: needs a value", "precompute a.obj -o b.h5 --rays"),
                ("--quiet: takes no value", "precompute a.obj -o b.h5 --quiet=1"),
                ("ambiguous", "precompute a.obj -o b.h5 --m 1"),
                ("one argument too many", "precompute a.obj b.obj -o c.h5"),
                ("--epsilon 2: must be above 0 and at most 1", "precompute a.obj -o b.h5 --epsilon 2"),
                ("--epsilon 0: must be above 0", "precompute a.obj -o b.h5 --epsilon 0"),
                ("--epsilon nan: not a number", "precompute a.obj -o b.h5 --epsilon nan"),
                ("--epsilon .1x: not a number", "precompute a.obj -o b.h5 --epsilon .1x"),
                ("--epsilon 0x1p-4: not a number", "precompute a.obj -o b.h5 --epsilon 0x1p-4"),
                ("--alpha 1: must be above 0 and below 1", "precompute a.obj -o b.h5 --alpha 1"),
                ("--max-edge 1e999: too large", "precompute a.obj -o b.h5 --max-edge 1e999"),
                ("--max-edge 0: must be above 0", "precompute a.obj -o b.h5 --max-edge 0"),
                ("--reflectance 1: must be at least 0 and below 1", "precompute a.obj -o b.h5 --reflectance 1"),
                ("--rays 0: must be at least 1", "precompute a.obj -o b.h5 --rays 0"),
                ("--rays -5: must not be negative", "precompute a.obj -o b.h5 --rays -5"),
                ("--rays -5.5: not a whole number", "precompute a.obj -o b.h5 --rays -5.5"),
                ("--epsilon 0,05: not a number; the decimal mark is a point", "precompute a.obj -o b.h5 --epsilon 0,05"),
                ("--rays 1e3: not a whole number", "precompute a.obj -o b.h5 --rays 1e3"),
                ("too large", "precompute a.obj -o b.h5 --seed 18446744073709551616"),
                ("--levels 21: must be at least 0 and at most 20", "precompute a.obj -o b.h5 --levels 21"),
                ("--resolution 2: must be at least 4 and at most 4096", "precompute a.obj -o b.h5 --resolution 2"),
                ("--resolution 4098: must be at least 4", "precompute a.obj -o b.h5 --resolution 4098"),
                ("--resolution 33: must be even",
                 "precompute a.obj -o b.h5 --form-factors hemicube --resolution 33"),
                ("--form-factors spheres: must be one of: auto rays hemicube blocks",
                 "precompute a.obj -o b.h5 --form-factors spheres"),
                ("--rank 0: must be at least 1", "precompute a.obj -o b.h5 --rank 0"),
                ("--memory 5X: not a size", "precompute a.obj -o b.h5 --memory 5X"),
                ("--memory -5G: not a size", "precompute a.obj -o b.h5 --memory -5G"),
                ("--memory K: not a size", "precompute a.obj -o b.h5 --memory K"),
                ("--quality fine: must be one of: draft normal high", "precompute a.obj -o b.h5 --quality fine"),
                ("--method magic: must be one of: auto emitters exact hierarchical low-rank", "precompute a.obj -o b.h5 --method magic"),
                ("--up w: must be one of: x y z", "precompute a.obj -o b.h5 --up w"),
                ("exclude each other", "precompute a.obj -o b.h5 --max-edge 1 --elements 9"),
                ("--subdivide: was removed; give --elements N or --max-edge METRES", "precompute a.obj -o b.h5 --subdivide 1"),
                ("--subdivide: was removed; give --elements N or --max-edge METRES", "classify a.obj --subdivide=1"),
                ("no such scene", "generate castle -o a.obj"),
                ("no -o", "generate box"),
                ("must end in .obj", "generate box -o a.stl"),
                ("exclude each other", "generate box -o a.obj --divisions 2 --elements 9"),
                ("only for cornell", "generate box -o a.obj --closed"),
                ("only for box", "generate cornell -o a.obj --divisions 2"),
                ("only for city", "generate box -o a.obj --terrain hill"),
                ("only for city", "generate rooms -o a.obj --variant 2"),
                ("only for cornell", "generate rooms -o a.obj --closed"),
                ("only for box", "generate rooms -o a.obj --size 1,2,3"),
                ("--variant", "generate city -o a.obj --variant 4"),
                ("--terrain", "generate city -o a.obj --terrain swamp"),
                ("--size 1,2: 2 numbers, needs 3", "generate box -o a.obj --size 1,2"),
                ("--size 1,2,0: every length", "generate box -o a.obj --size 1,2,0"),
                ("--size 1,,2: not numbers", "generate box -o a.obj --size 1,,2"),
                ("too few arguments", "info"),
                ("must be GROUP=V", "solve a.h5 --emit lamp"),
                ("must be from 0", "solve a.h5 --emit lamp=-1"),
                ("not numbers", "solve a.h5 --emit lamp="),
                ("not both", "solve a.h5 --emit lamp=1 --emission b.npy"),
                ("must end in", "solve a.h5 -o b.txt"),
                ("one of: mean", "solve a.h5 --reduce floor=median"),
                ("--reduce goes into", "solve a.h5 --reduce floor=mean -o b.npy"),
                ("must be one of", "solve a.h5 --quantity colour"),
                ("too few arguments", "verify"),
                ("one argument too many", "verify a b c")):
            with self.subTest(line):
                self.assertEqual(self.refused(2, wanted, *line.split()).stdout, "")

    def test_what_is_not_there_is_unknown(self):
        self.refused(2, "no such option", "precompute", "a.obj", "-o", "b.h5", "--texture", "x.png")
        self.refused(2, "no such suite", "bench", "nothing")
        self.refused(2, "must end in", "solve", "a.h5", "-o", "b.fbx")

    def test_a_full_disk_behind_standard_output(self):
        with open("/dev/full", "wb") as full:
            for line in (("--help",), ("precompute", "--help"), ("info", self.store)):
                done = subprocess.run([LAMBERT, *line], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
                self.assertEqual(done.returncode, 1, line)
                self.assertIn("No space left", done.stderr)


class Files(Case):
    def test_bad_inputs(self):
        foreign = self.path("foreign.h5")
        with h5py.File(foreign, "w") as file:
            file["x"] = [1]
        with open(self.path("empty.obj"), "w", encoding="ascii"):
            pass
        self.failed("No such file", "precompute", self.path("none.obj"), "-o", self.path("a.h5"))
        self.failed("Is a directory", "precompute", self.folder, "-o", self.path("a.h5"))
        self.failed("empty.obj: the scene is empty: it has no faces; check that the file", "precompute",
                    self.path("empty.obj"), "-o", self.path("a.h5"))
        photo = b"\xff\xd8\xff\xe0\x00\x10JFIF\x00\x01" + bytes(range(256)) * 8
        for name, wanted in (("photo.obj", "it has no faces; check that"), ("photo.jpg", "(OBJ, glTF, GLB, PLY, STL, OFF)")):
            with open(self.path(name), "wb") as file:
                file.write(photo)
            self.failed(wanted, "precompute", self.path(name), "-o", self.path("a.h5"))
            os.remove(self.path(name))
        self.failed("No such file", "precompute", self.path("none.h5"), "-o", self.path("a.h5"))
        self.failed("foreign.h5", "precompute", foreign, "-o", self.path("a.h5"))
        for verb in ("info", "solve", "verify"):
            self.refused(1, "foreign.h5", verb, foreign)
            self.refused(1, "No such file", verb, self.path("none.h5"))
            self.refused(1, self.folder, verb, self.folder)
            self.refused(1, "box.obj", verb, self.box)
        self.assertEqual(sorted(os.listdir(self.folder)), ["empty.obj", "foreign.h5"])

    def test_every_kind_of_scene_that_help_names_is_generated(self):
        usage = " ".join(must("generate", "--help").stdout.split())
        kinds = re.search(r"[a-z|]+(?= -o SCENE)", usage).group().split("|")
        self.assertGreaterEqual(len(kinds), 10)
        for kind in kinds:
            scene = self.path(kind + ".obj")
            done = must("generate", kind, "--elements", 600, "--seed", 5, "-o", scene)
            with open(scene) as text:
                faces = sum(line.startswith("f ") for line in text)
            self.assertEqual(done.stdout, "%s: %d faces\n" % (scene, faces))
            self.assertIn(" " + kind, self.refused(2, "no such scene", "generate", "castle", "-o", scene).stderr)

    def test_bad_targets_are_refused_before_any_work(self):
        for verb, source, name in (("precompute", self.box, "a.h5"), ("solve", self.store, "a.npy"),
                                   ("generate", "box", "a.obj")):
            light = ("--emit", "floor=1") if verb == "solve" else ()
            self.refused(1, "No such file or directory; make the directory", verb, source, "-o",
                         self.path("none/" + name), *light)
            os.makedirs(self.path(verb + name))
            self.refused(1, "is a directory", verb, source, "-o", self.path(verb + name), *light)
        self.refused(2, "is the scene itself", "precompute", self.box, "-o", self.box)
        other = self.path("other.obj")
        shutil.copy(self.box, other)
        self.refused(2, "other.obj: there is a file that is not a store", "precompute", self.box, "-o", other)
        with open(self.box, "rb") as one, open(other, "rb") as two:
            self.assertEqual(one.read(), two.read())
        # A store may be replaced whatever its name, and so may an empty file.
        for name in "kept", "new":
            if name == "kept":
                shutil.copy(self.store, self.path(name))
            else:
                open(self.path(name), "wb").close()
            must("precompute", self.box, "-o", self.path(name), "--rays", 64, "--probes", 0)

    @unittest.skipIf(os.geteuid() == 0, "root may write anywhere")
    def test_unwritable_directory(self):
        os.chmod(self.folder, 0o500)
        self.refused(1, "Permission denied", "precompute", self.box, "-o", self.path("a.h5"))

    def test_memory_limit_names_what_fits(self):
        self.failed("--method low-rank", "precompute", self.box, "--elements", 6000, "--method", "exact", "--rays", 256,
                    "--memory", "300M", "--probes", 0, "-o", self.path("a.h5"))
        self.failed("--rays", "precompute", self.box, "--elements", 3000, "--rays", 65536, "--method", "low-rank",
                    "--memory", "130M", "--probes", 0, "-o", self.path("a.h5"))
        self.failed("--memory", "precompute", self.box, "--elements", 3000000000, "-o", self.path("a.h5"))
        self.assertEqual(os.listdir(self.folder), [])

    def test_file_size_limit_stands_for_a_full_disk(self):
        def small():
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        shutil.copy(self.store, self.path("a.h5"))
        with open(self.store, "rb") as file:
            before = file.read()
        # A store of 96 elements has an inverse of 36,864 bytes.
        self.failed("a.h5", "precompute", self.box, "--method", "exact", "--rays", 64, "--probes", 0, "-o",
                    self.path("a.h5"), preexec_fn=small)
        with open(self.path("a.h5"), "rb") as file:
            self.assertEqual(file.read(), before)
        self.failed("b.h5", "precompute", self.box, "--method", "exact", "--rays", 64, "--probes", 0, "-o",
                    self.path("b.h5"), preexec_fn=small)

        def tiny():
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        for name in ("c.npy", "c.json", "c.csv", "c.ply", "c.vtu", "c.glb"):
            done = self.failed(name, "solve", self.store, "--emit", "floor=1", "-o", self.path(name), preexec_fn=tiny)
            self.assertIn("File too large", done.stderr)
        self.assertEqual(os.listdir(self.folder), ["a.h5"])


class Stopping(Case):
    """A signal in the middle of precompute: nothing under the target's name, an older file whole."""

    def stop(self, number, target, older):
        with open(self.path("log"), "w+", encoding="utf-8") as log:
            process = subprocess.Popen(
                [LAMBERT, "precompute", self.box, "--elements", "1000", "--rays", "1048576", "--method", "low-rank",
                 "--progress", "-o", target], stderr=log, env=dict(os.environ, OMP_NUM_THREADS="2"))
            try:
                # The progress line of the form factors says that it is in the middle of the long work.
                for _ in range(6000):
                    with open(self.path("log"), encoding="utf-8") as seen:
                        if "form factors: " in seen.read():
                            break
                    self.assertIsNone(process.poll(), "it ended before it could be stopped")
                    time.sleep(.05)
                process.send_signal(number)
                status = process.wait(timeout=PATIENCE)
            finally:
                if process.poll() is None:
                    process.kill()
                    process.wait()
            log.seek(0)
            said = log.read()
        if older is None:
            self.assertFalse(os.path.exists(target))
        else:
            with open(target, "rb") as file:
                self.assertEqual(file.read(), older)
        return status, said

    def test_signals(self):
        with open(self.store, "rb") as file:
            older = file.read()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for there in (False, True):
                with self.subTest(number=number, there=there):
                    target = self.path(f"{number}-{there}.h5")
                    if there:
                        shutil.copy(self.store, target)
                    status, said = self.stop(number, target, older if there else None)
                    if number == signal.SIGKILL:
                        self.assertEqual(status, -signal.SIGKILL)
                        continue
                    self.assertEqual(status, 1)
                    self.assertTrue(said.endswith("lambert precompute: cancelled; nothing was written\n"), said[-200:])
        left = [name for name in os.listdir(self.folder) if "partial" in name or name.startswith(".")]
        self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()
