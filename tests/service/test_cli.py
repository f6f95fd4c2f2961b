"""Black box: the command line of `lambert`, its exit status, what it writes and what it leaves alone."""

import csv
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
import xml.etree.ElementTree

import h5py
import numpy

from command import LAMBERT, lambert, must


class Case(unittest.TestCase):
    """A folder of scenes and stores, made once; every test has a folder of its own besides."""

    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory()
        cls.box = os.path.join(cls.shared.name, "box.obj")
        cls.store = os.path.join(cls.shared.name, "box.h5")
        must("generate", "box", "--divisions", 4, "--reflectance", .5, "-o", cls.box)
        must("precompute", cls.box, "-o", cls.store, "--method", "exact", "--rays", 256, "--probes", 8,
             "--keep-form-factors", "--quiet")

    @classmethod
    def tearDownClass(cls):
        cls.shared.cleanup()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def refused(self, status, wanted, *arguments, **more):
        """It fails with this status and one line that says so, and writes nothing else."""
        done = lambert(*arguments, **more)
        self.assertEqual(done.returncode, status, (arguments, done.stderr))
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, (arguments, done.stderr))
        self.assertTrue(lines[0].startswith("lambert"), lines[0])
        self.assertIn(wanted, lines[0], arguments)
        return done

    def failed(self, wanted, *arguments, **more):
        """As refused with 1; the log may come before the line."""
        done = lambert(*arguments, **more)
        self.assertEqual(done.returncode, 1, (arguments, done.stderr))
        self.assertTrue(done.stderr.splitlines()[-1].startswith("lambert "), done.stderr)
        self.assertIn(wanted, done.stderr.splitlines()[-1])
        return done


class Usage(Case):
    def test_help_and_version(self):
        self.assertRegex(must("--version").stdout, r"^lambert \d+\.\d+\.\d+\n$")
        verbs = must("--help").stdout
        for verb in ("generate", "precompute", "info", "sky", "solve", "verify", "render"):
            self.assertIn(verb, verbs)
            about = must(verb, "--help")
            self.assertIn("Usage: lambert " + verb, about.stdout)
            self.assertEqual(about.stderr, "")

    def test_help_names_every_option_of_the_contract(self):
        known = must("precompute", "--help").stdout
        for option in ("subdivide max-edge elements unit up two-sided reflectance form-factors rays resolution quality "
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
                ("--rays -5: not a whole number", "precompute a.obj -o b.h5 --rays -5"),
                ("--rays 1e3: not a whole number", "precompute a.obj -o b.h5 --rays 1e3"),
                ("too large", "precompute a.obj -o b.h5 --seed 18446744073709551616"),
                ("--levels 21: must be at least 0 and at most 20", "precompute a.obj -o b.h5 --levels 21"),
                ("--resolution 2: must be at least 4 and at most 4096", "precompute a.obj -o b.h5 --resolution 2"),
                ("--resolution 4098: must be at least 4", "precompute a.obj -o b.h5 --resolution 4098"),
                ("--resolution 33: must be even",
                 "precompute a.obj -o b.h5 --form-factors hemicube --resolution 33"),
                ("--form-factors spheres: must be one of: rays hemicube",
                 "precompute a.obj -o b.h5 --form-factors spheres"),
                ("--rank 0: must be at least 1", "precompute a.obj -o b.h5 --rank 0"),
                ("--memory 5X: not a size", "precompute a.obj -o b.h5 --memory 5X"),
                ("--memory -5G: not a size", "precompute a.obj -o b.h5 --memory -5G"),
                ("--memory K: not a size", "precompute a.obj -o b.h5 --memory K"),
                ("--quality fine: must be one of: draft normal high", "precompute a.obj -o b.h5 --quality fine"),
                ("--method magic: must be one of: auto exact low-rank", "precompute a.obj -o b.h5 --method magic"),
                ("--up w: must be one of: x y z", "precompute a.obj -o b.h5 --up w"),
                ("exclude each other", "precompute a.obj -o b.h5 --subdivide 1 --elements 9"),
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
        for line in (*("precompute a.obj -o b.h5 " + option for option in (
                         "--positions p.json", "--path p.json --frames 3", "--reuse A", "--paths 9")),
                     "render a.h5 -o b.png --animate c.npy"):
            with self.subTest(line):
                self.refused(2, "no such option", *line.split())
        self.refused(2, "no such suite", "bench", "reuse")
        self.refused(2, "must end in", "solve", "a.h5", "-o", "b.glb")

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
        self.failed("empty.obj", "precompute", self.path("empty.obj"), "-o", self.path("a.h5"))
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
            self.refused(1, "No such file or directory", verb, source, "-o", self.path("none/" + name), *light)
            os.makedirs(self.path(verb + name))
            self.refused(1, "is a directory", verb, source, "-o", self.path(verb + name), *light)
        self.refused(2, "is the scene itself", "precompute", self.box, "-o", self.box)

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
        for name in ("c.npy", "c.json", "c.csv", "c.ply", "c.vtu"):
            self.failed(name, "solve", self.store, "--emit", "floor=1", "-o", self.path(name), preexec_fn=tiny)
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
                status = process.wait(timeout=300)
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


class Answers(Case):
    def solve(self, name, *arguments):
        must("solve", self.store, "-o", self.path(name), *arguments)
        return self.path(name)

    def glow(self):
        return [word for group in ("floor", "ceiling", "wall-x0", "wall-x1", "wall-y0", "wall-y1")
                for word in ("--emit", group + "=1")]

    def test_furnace(self):
        # In a closed box of one reflectance rho and one emission E, B = E / (1 - rho) exactly.
        B = numpy.load(self.solve("a.npy", *self.glow()))
        self.assertEqual((B.shape, B.dtype.str), ((96,), "<f4"))
        numpy.testing.assert_allclose(B, 2, rtol=1e-4)
        H = numpy.load(self.solve("h.npy", "--quantity", "irradiance", *self.glow()))
        numpy.testing.assert_allclose(H, 2, rtol=1e-4)
        indirect = numpy.load(self.solve("i.npy", "--quantity", "indirect", *self.glow()))
        numpy.testing.assert_allclose(indirect, 1, rtol=2e-4)

    def test_formats_agree(self):
        light = ("--emit", "floor=3", "--emit", "wall-x0=.5")
        B = numpy.load(self.solve("a.npy", *light))
        with open(self.solve("a.json", *light), encoding="utf-8") as file:
            answer = json.load(file)
        self.assertEqual((answer["scene"], answer["elements"], answer["channels"], answer["quantity"]),
                         ("box", 96, 1, "radiosity"))
        self.assertEqual(set(answer["error"]), {"relative_mean", "indirect_mean"})
        numpy.testing.assert_array_equal(numpy.array(answer["radiosity"], "f4"), B)
        with open(self.solve("a.csv", *light), newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        numpy.testing.assert_array_equal(numpy.array([row["radiosity"] for row in rows], "f4"), B)
        self.assertEqual([int(row["element"]) for row in rows], list(range(96)))
        self.assertEqual({row["group"] for row in rows},
                         {"floor", "ceiling", "wall-x0", "wall-x1", "wall-y0", "wall-y1"})
        self.assertAlmostEqual(sum(float(row["area"]) for row in rows), 6)
        tree = xml.etree.ElementTree.parse(self.solve("a.vtu", *light))
        arrays = {array.get("Name"): array.text.split() for array in tree.iter("DataArray")}
        numpy.testing.assert_array_equal(numpy.array(arrays["radiosity"], "f4"), B)
        self.assertEqual(len(arrays["offsets"]), 96)
        self.assertEqual(int(arrays["offsets"][-1]), len(arrays["connectivity"]))
        with open(self.solve("a.ply", *light), "rb") as file:
            header, body = file.read().split(b"end_header\n", 1)
        n_vertices = int(header.split(b"element vertex ")[1].split()[0])
        faces = numpy.frombuffer(body[24 * n_vertices:], numpy.dtype(
            [("corners", "u1"), ("vertices", "<u4", 4), ("group", "<u4"), ("value", "<f4")]))
        self.assertEqual((len(faces), set(faces["corners"])), (96, {4}))
        numpy.testing.assert_array_equal(faces["value"], B)

    def test_emission_files_agree_with_groups(self):
        wanted = numpy.load(self.solve("a.npy", "--emit", "floor=3"))
        with h5py.File(self.store) as file:
            names = [name.decode() for name in file["mesh/group_names"][:]]
            E = 3. * (file["mesh/group"][:] == names.index("floor"))
        inputs = {"f8.npy": E, "f4.npy": E.astype("f4")}
        for name, array in inputs.items():
            numpy.save(self.path(name), array)
        for name, document in (("dense.json", E.tolist()), ("groups.json", {"groups": {"floor": 3}}),
                               ("sparse.json", {"elements": numpy.flatnonzero(E).tolist(),
                                                "values": [3] * int((E > 0).sum())}),
                               ("body.json", {"emission": {"groups": {"floor": [3]}}})):
            with open(self.path(name), "w", encoding="utf-8") as file:
                json.dump(document, file)
            inputs[name] = None
        for name in inputs:
            with self.subTest(name):
                B = numpy.load(self.solve("b.npy", "--emission", self.path(name)))
                numpy.testing.assert_array_equal(B, wanted)
        # As for the daemon, rows of a grey scene are vectors: this is a batch of one.
        numpy.save(self.path("row.npy"), E[None])
        numpy.testing.assert_array_equal(numpy.load(self.solve("b.npy", "--emission", self.path("row.npy"))), wanted[None])

    def test_batches(self):
        E = numpy.zeros((3, 96))
        E[0], E[1, 5], E[2, ::2] = 1, 10, 2
        numpy.save(self.path("e.npy"), E)
        with open(self.path("e.json"), "w", encoding="utf-8") as file:
            json.dump({"emissions": E.tolist()}, file)
        B = numpy.load(self.solve("b.npy", "--emission", self.path("e.npy")))
        self.assertEqual(B.shape, (3, 96))
        numpy.testing.assert_array_equal(numpy.load(self.solve("c.npy", "--emission", self.path("e.json"))), B)
        for v in range(3):
            numpy.save(self.path("one.npy"), E[v])
            numpy.testing.assert_array_equal(numpy.load(self.solve("one-b.npy", "--emission", self.path("one.npy"))),
                                             B[v])
        with open(self.solve("b.json", "--emission", self.path("e.npy")), encoding="utf-8") as file:
            numpy.testing.assert_array_equal(numpy.array(json.load(file)["radiosity"], "f4"), B)

    def test_bad_emissions(self):
        def npy(name, array):
            numpy.save(self.path(name), array)
            return name
        def text(name, content):
            with open(self.path(name), "w", encoding="utf-8") as file:
                file.write(content)
            return name
        good = numpy.ones(96)
        nan, negative = good.copy(), good.copy()
        nan[7], negative[8] = numpy.nan, -2
        numpy.save(self.path("cut.npy"), good)
        with open(self.path("cut.npy"), "r+b") as file:
            file.truncate(300)
        for name, wanted in (
                (npy("short.npy", good[:-1]), "must be (96)"), (npy("nan.npy", nan), "value 7 is NaN"),
                (npy("negative.npy", negative), "value 8 is -2"), (npy("int.npy", good.astype(int)), "<f4 or <f8"),
                (npy("big-endian.npy", good.astype(">f8")), "<f4 or <f8"),
                (npy("fortran.npy", numpy.asfortranarray(numpy.ones((96, 96)))), "C order"),
                (npy("deep.npy", numpy.ones((1, 1, 1, 96))), "3 axes"),
                (npy("colour.npy", numpy.ones((2, 3, 96))), "shape"), (npy("none.npy", numpy.ones((0, 96))), "empty"),
                (npy("huge.npy", numpy.array([1e300] * 96)), "single precision"),
                ("cut.npy", "its shape and type need 768"),
                (text("a.json", "{"), "not JSON"), (text("b.json", "[1,NaN]"), "not JSON"),
                (text("c.json", "[1,2]"), "must be 96"), (text("d.json", '{"groups":{"lava":1}}'), 'no group "lava"'),
                (text("e.json", '{"elements":[96],"values":[1]}'), "from 0 to 95"),
                (text("f.json", '{"elements":[1],"values":[]}'), "must be as many"),
                (text("g.json", '{"elements":[1],"values":[-1]}'), "must not be negative"),
                (text("h.json", '{"sky":[1]}'), "has no sky"), (text("i.json", '{"emissions":[]}'), "empty"),
                (text("j.json", '{"groups":{"floor":"bright"}}'), "must be a number"),
                (text("k.json", "[1e999]"), "0 = 1e999"),
                (text("l.json", '{"floor":1}'), "floor is not a member"), (text("m.txt", "1"), "must end in"),
                (text("n.npy", "not an array"), "is not NPY"), ("missing.npy", "No such file"),
                ("missing.json", "missing.json")):
            with self.subTest(name):
                self.refused(1, wanted, "solve", self.store, "--emission", self.path(name), "-o", self.path("out.npy"))
                self.assertFalse(os.path.exists(self.path("out.npy")))
        self.refused(1, 'no group "lava"', "solve", self.store, "--emit", "lava=1")
        self.refused(1, 'did you mean "floor"?', "solve", self.store, "--emit", "flor=1")
        self.refused(1, "2 values", "solve", self.store, "--emit", "floor=1,2")
        self.refused(1, "no light of its own", "solve", self.store)

    def test_reduce(self):
        light = ("--emit", "floor=3")
        B = numpy.load(self.solve("a.npy", *light)).astype("f8")
        figures = "floor=mean,sum,min,max,uniformity,variance"
        with open(self.solve("r.json", "--reduce", figures, "--reduce", "wall-x0=mean", *light), encoding="utf-8") as f:
            groups = json.load(f)["groups"]
        with h5py.File(self.store) as file:
            names = [name.decode() for name in file["mesh/group_names"][:]]
            inside, A = file["mesh/group"][:] == names.index("floor"), file["mesh/area"][:]
        x, a = B[inside], A[inside]
        mean = (a * x).sum() / a.sum()
        for name, value in (("mean", mean), ("sum", (a * x).sum()), ("min", x.min()), ("max", x.max()),
                            ("uniformity", x.min() / mean), ("variance", (a * (x - mean) ** 2).sum() / a.sum())):
            self.assertAlmostEqual(groups["floor"][name], value, delta=1e-6 * abs(value), msg=name)
        self.assertEqual(set(groups["wall-x0"]), {"mean"})
        with open(self.solve("r.csv", "--reduce", figures, *light), newline="", encoding="utf-8") as file:
            rows = {row["statistic"]: float(row["radiosity"]) for row in csv.DictReader(file)}
        self.assertAlmostEqual(rows["mean"], mean, delta=1e-6 * mean)
        self.refused(1, "no group", "solve", self.store, "--reduce", "lava=mean", *light)
        table = must("solve", self.store, *light).stdout
        line = next(line for line in table.splitlines() if line.startswith("floor"))
        self.assertAlmostEqual(float(line.split()[3]), mean, delta=1e-4 * mean)

    def test_own_light_in_colour(self):
        scene, store = self.path("cornell.obj"), self.path("cornell.h5")
        must("generate", "cornell", "--elements", 200, "-o", scene)
        must("precompute", scene, "-o", store, "--method", "low-rank", "--rays", 256, "--probes", 4, "--quiet")
        done = must("solve", store, "-o", self.path("a.npy"))
        self.assertIn("the scene's own light", done.stderr)
        with h5py.File(store) as file:
            n, E = file["mesh/area"].shape[0], file["mesh/emission"][:]
        B = numpy.load(self.path("a.npy"))
        self.assertEqual(B.shape, (3, n))
        numpy.save(self.path("e.npy"), E)
        must("solve", store, "--emission", self.path("e.npy"), "-o", self.path("b.npy"))
        numpy.testing.assert_array_equal(numpy.load(self.path("b.npy")), B)
        lamp = E[:, E[0].argmax()]
        must("solve", store, "--emit", "lamp=" + ",".join(repr(float(e)) for e in lamp), "-o", self.path("c.npy"))
        numpy.testing.assert_array_equal(numpy.load(self.path("c.npy")), B)
        with open(self.path("c.json"), "w", encoding="utf-8") as file:
            json.dump({"emissions": [E.tolist(), {"groups": {"lamp": [1, 0, 0]}}]}, file)
        must("solve", store, "--emission", self.path("c.json"), "-o", self.path("d.npy"))
        batch = numpy.load(self.path("d.npy"))
        self.assertEqual(batch.shape, (2, 3, n))
        numpy.testing.assert_array_equal(batch[0], B)
        self.assertEqual((abs(batch[1, 1:]).max(), batch[1, 0].max() > 0), (0, True))
        must("solve", store, "-o", self.path("a.csv"))
        with open(self.path("a.csv"), encoding="utf-8") as header:
            self.assertEqual(header.readline(), "element,group,area,radiosity_r,radiosity_g,radiosity_b\n")


class Stores(Case):
    def test_info_as_json(self):
        about = json.loads(must("info", self.store, "--json").stdout)
        self.assertEqual((about["name"], about["elements"], about["channels"], about["kind"], about["method"]),
                         ("box", 96, 1, "exact", "exact"))
        self.assertIsInstance(about["reason"], str)
        self.assertEqual(about["density"], 1)
        self.assertIn("epsilon", about)
        with h5py.File(self.store) as file:
            self.assertEqual(about["bytes"], sum(d.nbytes for d in file["operator"].values()))
            self.assertEqual(about["provenance"]["geometry_hash"], file["mesh"].attrs["geometry_hash"].decode()
                             if isinstance(file["mesh"].attrs["geometry_hash"], bytes)
                             else file["mesh"].attrs["geometry_hash"])
            self.assertEqual(about["error"]["single"]["total_indirect_mean"],
                             file["error/single"].attrs["total_indirect_mean"])
        self.assertEqual(sum(group["elements"] for group in about["groups"]), 96)
        self.assertEqual((about["emitters"], about["sky"]), (None, None))
        self.assertEqual(about["error"]["single"]["probes"], 8)
        provenance = about["provenance"]
        self.assertRegex(provenance["tool"], r"^lambert \d")
        self.assertEqual((provenance["seed"], provenance["unit"]), (1, 1))
        self.assertTrue(provenance["command"].startswith("lambert precompute "))
        self.assertEqual(provenance["form_factors"]["rays"], 256)
        text = must("info", self.store).stdout
        for word in ("box", "exact", "floor, 16 elements", "single", "lambert precompute"):
            self.assertIn(word, text)

    def test_log_and_quiet(self):
        done = must("precompute", self.box, "-o", self.path("a.h5"), "--method", "exact", "--alpha", ".3",
                    "--coherence", ".5", "--rays", 64, "--probes", 0)
        self.assertIn("exact does not use --alpha, --coherence", done.stderr)
        for stage in ("import", "mesh", "form factors", "invert", "store"):
            self.assertRegex(done.stderr, r"(?m)^" + stage + r" +[\d.]+ s$")
        self.assertEqual(done.stdout, "")
        done = must("precompute", self.box, "-o", self.path("a.h5"), "--rays", 64, "--probes", 0, "--quiet")
        self.assertEqual(done.stderr, "")
        about = json.loads(must("info", self.path("a.h5"), "--json").stdout)
        self.assertEqual(about["error"], {})
        done = must("precompute", self.box, "-o", self.path("a.h5"), "--rays", 64, "--probes", 0, "--method",
                    "low-rank", "--epsilon", ".1")
        self.assertIn("below the sampling noise", done.stderr)

    def test_from_a_store_with_form_factors(self):
        for method in ("exact", "low-rank"):
            direct, again = self.path(method + ".h5"), self.path(method + "-again.h5")
            common = ("--method", method, "--rays", 256, "--epsilon", ".2", "--probes", 6)
            must("precompute", self.box, "-o", direct, *common)
            must("precompute", self.store, "-o", again, *common)
            with h5py.File(direct) as one, h5py.File(again) as two:
                self.assertEqual(sorted(one["operator"]), sorted(two["operator"]))
                for name in one["operator"]:
                    numpy.testing.assert_array_equal(one["operator"][name][:], two["operator"][name][:])
                self.assertEqual(one.attrs["name"], two.attrs["name"])
        self.refused(2, "--subdivide", "precompute", self.store, "--subdivide", 1, "-o", self.path("b.h5"))
        self.failed("holds no /form_factors", "precompute", self.path("exact.h5"), "-o", self.path("b.h5"))

    def test_pairs(self):
        kept, bare, again = self.path("kept.h5"), self.path("bare.h5"), self.path("again.h5")
        common = ("--quality", "high", "--method", "exact", "--probes", 8)
        done = must("precompute", self.box, "-o", kept, *common, "--keep-form-factors")
        self.assertIn("pair by pair to 7e-06: 0.00 % leave the scene (closed)", done.stderr)
        must("precompute", self.box, "-o", bare, *common)
        must("precompute", kept, "-o", again, *common)
        with h5py.File(kept) as file:
            attributes = dict(file["form_factors"].attrs)
            self.assertEqual((attributes["method"], attributes["rays"]), (b"pairs", 256))
            self.assertEqual(file["operator"].attrs["accuracy"], attributes["accuracy"])
            numpy.testing.assert_allclose(file["mesh/row_sums"][:], 1, atol=1e-6)
            # An empty box: nothing is hidden, so nothing is sampled.
            self.assertLess(attributes["repair_max"], 1e-5)
            self.assertLess(file["error/single"].attrs["total_indirect_max"], 1e-4)
        for store in (kept, bare, again):
            must("verify", store, "--probes", 4)
        self.assertRegex(must("info", kept).stdout, r"(?m)^form factors +pairs$")
        # Rays asked for by number are rays.
        done = must("precompute", self.box, "-o", bare, *common, "--rays", 64)
        self.assertIn("64 rays per element", done.stderr)
        done = lambert("precompute", self.box, "-o", bare, *common, "--memory", "100K")
        self.assertEqual(done.returncode, 1)
        self.assertIn("with near-pairs need about", done.stderr)

    def test_hemicube(self):
        kept, bare, again = self.path("kept.h5"), self.path("bare.h5"), self.path("again.h5")
        common = ("--form-factors", "hemicube", "--resolution", 48, "--method", "low-rank", "--epsilon", ".02",
                  "--probes", 8)
        done = must("precompute", self.box, "-o", kept, *common, "--rays", 64, "--quality", "high",
                    "--keep-form-factors")
        self.assertIn("hemicubes of 48 pixels: 0.00 % leave the scene (closed)", done.stderr)
        self.assertIn("hemicube does not use --rays, --quality", done.stderr)
        self.assertNotIn("noise of 0 rays", done.stderr)
        self.assertNotIn("below the sampling noise", done.stderr)
        with h5py.File(kept) as file:
            attributes = dict(file["form_factors"].attrs)
            self.assertEqual((attributes["method"], attributes["resolution"], attributes["rays"]),
                             (b"hemicube", 48, 0))
            self.assertLess(attributes["reciprocity_error"], 1e-6)
            numpy.testing.assert_allclose(file["mesh/row_sums"][:], 1, atol=1e-6)
            self.assertEqual(file["operator"].attrs["resolution"], 48)
            # Judged by rays: a hemicube that judged itself would find no difference and no noise.
            single = file["error/single"].attrs
            self.assertGreater(single["total_indirect_mean"], 1.5 * single["operator_indirect_mean"])
            self.assertGreater(single["reference_noise"], 1e-3)
        self.assertRegex(must("info", kept).stdout, r"(?m)^form factors +hemicube\nresolution +48$")
        about = json.loads(must("info", kept, "--json").stdout)["provenance"]["form_factors"]
        self.assertEqual((about["method"], about["resolution"]), ("hemicube", 48))

        # Kept or not, a later run and verify know what the operator was built from.
        must("precompute", self.box, "-o", bare, *common)
        done = must("precompute", kept, "-o", again, *common, "--keep-form-factors")
        self.assertIn("does not use --form-factors, --resolution", done.stderr)
        for store in (bare, again):
            with h5py.File(kept) as one, h5py.File(store) as two:
                for name in one["operator"]:
                    numpy.testing.assert_array_equal(one["operator"][name][:], two["operator"][name][:])
                self.assertEqual(two["operator"].attrs["resolution"], 48)
            must("verify", store, self.box, "--probes", 6)
        with h5py.File(again) as file:
            self.assertEqual((file["form_factors"].attrs["method"], file["form_factors"].attrs["resolution"]),
                             (b"hemicube", 48))

        done = must("precompute", self.box, "-o", again, "--resolution", 32, "--rays", 64, "--probes", 0)
        self.assertIn("rays does not use --resolution", done.stderr)

    def test_judged_by_another_sample_whatever_the_seeds(self):
        # With the F of seed s kept, another seed must not make the judge draw s again: then total = operator.
        about = {}
        for seed in (1, 2, 3):
            must("precompute", self.store, "-o", self.path("a.h5"), "--method", "exact", "--seed", seed,
                 "--probes", 4, "--quiet")
            about[seed] = json.loads(must("info", self.path("a.h5"), "--json").stdout)["error"]["single"]
            self.assertLess(about[seed]["operator_indirect_mean"], 1e-5)
            self.assertGreater(about[seed]["total_indirect_mean"], 1e-3)

    def test_threads_do_not_change_the_store(self):
        for threads in (1, 2):
            must("precompute", self.box, "-o", self.path(f"{threads}.h5"), "--method", "exact", "--rays", 256,
                 "--probes", 0, "--threads", threads, "--keep-form-factors")
        with h5py.File(self.path("1.h5")) as one, h5py.File(self.path("2.h5")) as two:
            for name in ("indptr", "indices", "data"):
                numpy.testing.assert_array_equal(one["form_factors"][name][:], two["form_factors"][name][:])

    def test_verify(self):
        done = must("verify", self.store, self.box, "--probes", 6)
        self.assertEqual([line.split()[0] for line in done.stdout.splitlines()], ["ok"] * 3 + ["skipped"] + ["ok"] * 5)  # no sky
        answer = json.loads(must("verify", self.store, "--probes", 0, "--json").stdout)
        self.assertTrue(answer["ok"])
        self.assertEqual({check["name"]: check["result"] for check in answer["checks"]}["scene"], "skipped")

    def test_verify_finds_a_flipped_byte(self):
        with h5py.File(self.store) as file:
            places = {name: file[name].id.get_offset() for name in ("operator/M", "mesh/area", "form_factors/data")}
        for name, place in places.items():
            with self.subTest(name):
                broken = self.path("broken.h5")
                shutil.copy(self.store, broken)
                with open(broken, "r+b") as file:
                    file.seek(place + 17)
                    byte = file.read(1)[0]
                    file.seek(place + 17)
                    file.write(bytes([byte ^ 4]))
                done = lambert("verify", broken, "--probes", 0)
                self.assertEqual(done.returncode, 1)
                self.assertRegex(done.stdout, r"(?m)^BROKEN +checksums.*" + name)
                self.assertIn("broken", done.stderr)

    def test_verify_finds_another_scene(self):
        other = self.path("box.obj")
        must("generate", "box", "--divisions", 4, "--reflectance", .5, "--size", "1,1,2", "-o", other)
        done = lambert("verify", self.store, other, "--probes", 0)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"(?m)^BROKEN +scene +stale: .*geometry")
        must("generate", "box", "--divisions", 4, "--reflectance", .6, "-o", other)
        done = lambert("verify", self.store, other, "--probes", 0)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"(?m)^BROKEN +scene +stale: group .*material")


class Json(Case):
    def test_solve_prints_the_same_as_json(self):
        emission, refined = self.path("batch.npy"), ("--tolerance", "1e-6")
        n = 6 * 4 * 4
        numpy.save(emission, numpy.random.default_rng(7).random((24, n), dtype=numpy.float32))
        for more in ((), ("--quantity", "indirect"), ("--emission", emission), refined):
            light = () if "--emission" in more else ("--emit", "floor=2")
            table = must("solve", self.store, *light, *more).stdout
            answer = json.loads(must("solve", self.store, *light, *more, "--json").stdout)
            self.assertEqual(answer["quantity"], "indirect" if "indirect" in more else "radiosity")
            self.assertEqual(("certificate" in answer, "error" in answer), (more == refined, more != refined))
            rows = [line.split() for line in table.splitlines()[1:] if not line.startswith("stated")]
            self.assertEqual([row[0] for row in rows], list(answer["groups"]))
            for name, elements, area, *means in rows:
                group = answer["groups"][name]
                self.assertEqual(int(elements), group["elements"])
                self.assertAlmostEqual(float(area), group["area"], delta=1e-3 * group["area"])
                numpy.testing.assert_allclose([float(x) for x in means], numpy.ravel(group["mean"]), rtol=1e-5)
        reduced = ("solve", self.store, "--emit", "floor=2", "--reduce", "ceiling=mean,max")
        must(*reduced, "-o", self.path("a.json"))
        with open(self.path("a.json"), encoding="utf-8") as file:
            self.assertEqual(json.loads(must(*reduced, "--json").stdout), json.load(file))
        year = ("solve", self.store, "--emission", emission, "--annual", "sum", "--annual", "autonomy=.5")
        answer = json.loads(must(*year, "--json").stdout)["annual"]
        self.assertEqual(list(answer), ["sum", "autonomy_0.5"])
        self.assertEqual(set(answer["sum"]["floor"]), {"elements", "area", "mean"})
        self.refused(2, "--json or -o", "solve", self.store, "--json", "-o", self.path("a.npy"))


if __name__ == "__main__":
    unittest.main()
