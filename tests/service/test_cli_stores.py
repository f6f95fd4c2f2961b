"""Black box: stores that `lambert precompute` makes, and what `info` and `verify` say of them."""

import json
import os
import re
import shutil
import subprocess
import unittest

import h5py
import numpy

from case import Case
from command import ENVIRONMENT, LAMBERT, lambert, must


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

    def test_log_shows_axes_and_a_coarse_mesh(self):
        """A designer sees at once that y should be up, that the unit is not metres, that the mesh is too coarse."""
        room = self.path("room.obj")
        with open(room, "w", encoding="ascii") as file:
            file.write("v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 0 0 2.5\nv 4 0 2.5\nv 4 3 2.5\nv 0 3 2.5\n"
                       "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n")
        quick = ("-o", self.path("a.h5"), "--rays", 64, "--probes", 0)
        coarse = "without --mesh faces they are divided"
        said = must("precompute", room, *quick).stderr
        self.assertIn("\n4 m x 3 m, 2.5 m high, z up; --up and --unit", said)
        # The floor has 12 of 59 square metres.
        self.assertIn("one element has 20 % of the area, and light does not vary across an element: " + coarse, said)
        said = must("precompute", room, *quick, "--up", "y", "--unit", .001, "--elements", 24).stderr
        self.assertIn("\n0.004 m x 0.0025 m, 0.003 m high, y up", said)
        self.assertNotIn(coarse, said)
        # Turned inside out, as a modeller's cube is, the room loses all light, and the log says why.
        outward = "its faces look outward: turn them"
        self.assertNotIn(outward, said)
        with open(room, encoding="ascii") as file:
            lines = file.read().splitlines()
        with open(room, "w", encoding="ascii") as file:
            file.write("\n".join("f " + " ".join(reversed(line.split()[1:])) if line[0] == "f" else line for line in lines) + "\n")
        self.assertIn(outward, must("precompute", room, *quick).stderr)
        self.assertNotIn(outward, must("precompute", room, *quick, "--two-sided").stderr)
        # A mesh that is fine already needs no advice: each of 96 faces has 1 %.
        self.assertNotIn(coarse, must("precompute", self.box, *quick).stderr)

    def test_units_by_name_and_by_question(self):
        sides, verbs = "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n", ("precompute", "classify")

        def room(x, y, z):
            path = self.path("plan.obj")
            with open(path, "w", encoding="ascii") as file:
                file.write("".join(f"v {a} {b} {c}\n" for c in (0, z) for a, b in ((0, 0), (x, 0), (x, y), (0, y))) + sides)
            return path

        def said(verb, path, *options):
            output = ("-o", self.path("a.h5"), "--probes", 0) if verb == "precompute" else ()
            return must(verb, path, *output, "--rays", 64, "--mesh", "faces", *options).stderr

        for verb in verbs:
            path = room(4000, 3000, 2500)
            question = f"lambert {verb}: warning: {path}: 4000 m x 3000 m x 2500 m: is the unit millimetres? --unit mm\n"
            self.assertIn(question, said(verb, path))
            for word, size in (("m", "4000 m x 3000 m, 2500"), ("1", "4000 m x 3000 m, 2500"), ("mm", "4 m x 3 m, 2.5"),
                               ("cm", "40 m x 30 m, 25"), ("ft", "1219 m x 914.4 m, 762"), ("in", "101.6 m x 76.2 m, 63.5")):
                answered = said(verb, path, "--unit", word)
                self.assertNotIn("is the unit", answered)
                self.assertIn(f"\n{size} m high", answered)
            self.assertIn("is the unit feet? --unit ft", said(verb, room(13.1, 9.8, 8.2)))
            path = room(5, 2, 5)
            self.assertIn(f"warning: {path}: does it lie on its side, with y up? --up y\n", said(verb, path))
            for up in "zy":
                self.assertNotIn("on its side", said(verb, path, "--up", up))
            self.assertNotIn("?", said(verb, room(4, 3, 2.5)))
            wrong = lambert(verb, path, "--unit", "inch", *(("-o", self.path("a.h5")) if verb == "precompute" else ()))
            self.assertEqual((wrong.returncode, wrong.stderr), (2, f"lambert {verb}: --unit inch: must be the metres of a unit, above 0, "
                                                                   "or one of mm|cm|m|in|ft\n"))

    def test_fix_takes_unit_axis_and_sides(self):
        """A room of millimetres on its side that looks outward becomes the one that was meant, and every step is said; what is right
        stays."""
        meant, wrong, store = self.path("meant.obj"), self.path("wrong.obj"), self.path("fixed.h5")
        plain = ("-o", store, "--probes", 0, "--mesh", "faces")
        x, y, z = 5, 4, 2.5
        corners = [(a, b, c) for c in (0, z) for a, b in ((0, 0), (x, 0), (x, y), (0, y))]
        names, faces = ("floor", "ceiling", "south", "east", "north", "west"), (
            (1, 2, 3, 4), (8, 7, 6, 5), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1))
        for path, place, step in (meant, lambda a, b, c: (a, b, c), 1), (wrong, lambda a, b, c: (1000 * a, 1000 * c, -1000 * b), -1):
            with open(path, "w", encoding="ascii") as file:
                file.write("".join("v %g %g %g\n" % place(*v) for v in corners)
                           + "".join(f"o {name}\nf " + " ".join(map(str, face[::step])) + "\n" for name, face in zip(names, faces)))

        def floor():
            answer = must("solve", store, "--emit", "ceiling=1", "--quantity", "irradiance", "--reduce", "floor=mean", "--json")
            return json.loads(answer.stdout)["groups"]["floor"]["mean"]

        said = must("precompute", meant, *plain).stderr
        self.assertNotIn("warning: " + meant + ": --", said)
        right = floor()
        with h5py.File(store) as file:
            geometry = file["mesh"].attrs["geometry_hash"]
        self.assertNotIn("--fix", must("precompute", meant, *plain, "--fix").stderr)
        with h5py.File(store) as file:
            self.assertEqual(file["mesh"].attrs["geometry_hash"], geometry)
        said = must("precompute", wrong, *plain, "--fix").stderr
        for line in ("takes it for millimetres: 5 m x 2.5 m x 4 m (--unit m leaves it)",
                     "takes it to lie on its side: y is up (--up leaves it)",
                     "turns all 6 faces: no face sees another one, and their backs do"):
            self.assertIn(f"lambert precompute: warning: {wrong}: --fix {line}\n", said)
        self.assertIn("\n5 m x 4 m, 2.5 m high, y up", said)
        self.assertAlmostEqual(floor(), right, delta=1e-4 * right)
        with h5py.File(store) as file:
            self.assertEqual(file.attrs["unit"], .001)
        self.assertIn("has the same geometry and materials", must("verify", store, wrong, "--probes", 0).stdout)
        # Answers that were given stay, and a house under a sky stays a house.
        said = must("precompute", wrong, *plain, "--fix", "--unit", "cm", "--up", "z", "--sky", "tregenza").stderr
        self.assertNotIn("warning: " + wrong + ": --fix", said)
        self.assertIn("\n50 m x 25 m, 40 m high, z up", said)

    def test_standard_input_and_formats_by_name(self):
        """- is standard input, from a file or a pipe, of a format that is given; so may a file of any name be."""
        with open(self.box, "rb") as file:
            text = file.read()
        beside, folder = os.path.dirname(self.box), self.path("odd")
        os.mkdir(folder)
        odd, store = os.path.join(folder, "box.txt"), self.path("input.h5")
        with open(odd, "wb") as file:
            file.write(text)
        plain = ("precompute", "-o", store, "--probes", 0, "--mesh", "faces", "--format", "obj")

        def run(*arguments, **more):
            return subprocess.run([LAMBERT, *map(str, arguments)], cwd=beside, env=ENVIRONMENT, capture_output=True, text=True, **more)

        def area(done):
            self.assertEqual(done.returncode, 0, done.stderr)
            with h5py.File(store) as file:
                name = file.attrs["name"]
                return name.decode() if isinstance(name, bytes) else name, file["mesh/area"][()].sum()

        def group_names():
            with h5py.File(store) as file:
                return list(file["mesh/group_names"][()])

        self.assertEqual(area(run("precompute", self.box, *plain[1:-2])), ("box", 6))
        names = group_names()
        with open(self.box, encoding="utf-8") as file:
            self.assertEqual(area(run(*plain, "-", stdin=file)), ("stdin", 6))
        self.assertEqual(group_names(), names)
        self.assertEqual(area(run(*plain, "-", input=text.decode())), ("stdin", 6))
        self.assertEqual(group_names(), names)
        self.assertEqual(area(run(*plain, odd, "--assets", beside)), ("box", 6))
        self.assertIn("elements            96" if False else "96 ", run("classify", "-", "--format", "obj", "--mesh", "faces",
                                                                         input=text.decode()).stdout)
        for options, says in (((), "standard input has no extension: give its format, obj|gltf|glb|ply|stl|off"),
                              (("--format", "stl"), "-: not a scene that can be read"), (("--format", "obj"), "-: the scene is empty")):
            done = run("precompute", "-", "-o", store, *options, input="" if options == ("--format", "obj") else text.decode())
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn(says, done.stderr)

    def test_turned_faces_are_told_and_turned_back(self):
        right, wrong = self.path("right.obj"), self.path("wrong.obj")
        must("generate", "patio", "-o", right, "--elements", 1500)
        with open(right, encoding="ascii") as file:
            lines = file.read().splitlines()
        faces = [k for k, line in enumerate(lines) if line.startswith("f ")]
        for k in faces[::5]:
            lines[k] = "f " + " ".join(reversed(lines[k].split()[1:]))
        with open(wrong, "w", encoding="ascii") as file:
            file.write("\n".join(lines) + "\n")
        quick = ("--rays", 16, "--probes", 0, "--method", "sparse")
        normals = {}
        for name, scene, options in (("right", right, ()), ("wrong", wrong, ()), ("turned", wrong, ("--orient",)),
                                     ("kept", right, ("--orient",))):
            store = self.path(name + ".h5")
            said = must("precompute", scene, "-o", store, *quick, *options).stderr
            with self.subTest(name=name):
                if name == "wrong":
                    self.assertRegex(said, r"warning: [12]\d\.\d % of the light meets the backs of \d+ faces or more and is "
                                           r"lost there \(\w+ \d+\.\d %, .*--orient")
                else:
                    self.assertNotIn("meets the backs", said)
                    count = {"turned": len(faces[::5]), "kept": 0}.get(name)
                    if count is not None:
                        self.assertIn("\n%d of %d faces turned;" % (count, len(faces)), "\n" + said)
            with h5py.File(store) as file:
                corners = file["mesh/vertices"][:][file["mesh/elements"][:][:, :3].astype(int)]
            normals[name] = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.assertLess((normals["right"] * normals["wrong"]).sum(axis=1).min(), 0)
        for name in ("turned", "kept"):
            self.assertGreater((normals["right"] * normals[name]).sum(axis=1).min(), 0)
        # The store knows its scene: the hash is that of the file, before faces were turned.
        self.assertIn("same geometry", must("verify", self.path("turned.h5"), wrong, "--probes", 0).stdout)

    def test_log_and_info_name_figures_in_words(self):
        """The log and `info` print words; the store and JSON keep the names of the attributes."""
        methods = {"exact": (), "low-rank": (), "2msc": (), "sparse": (), "hierarchical": (),
                   "emitters": ("--emitters", "group=floor")}
        found = set()
        for method, options in methods.items():
            with self.subTest(method=method):
                done = must("precompute", self.box, "-o", self.path("a.h5"), "--method", method, "--rays", 64,
                            "--probes", 0, *options)
                report = json.loads(must("info", self.path("a.h5"), "--json").stdout)["report"]
                text = must("info", self.path("a.h5")).stdout
                block = text[text.index("figures "):text.index("\ngroups ")].splitlines()
                self.assertEqual(len(block), len(report))
                for line in block:
                    self.assertNotIn("_", line)
                    self.assertEqual(line[:18].strip() or "figures", "figures")
                logged = done.stderr.split("factorizer ", 1)[1].splitlines()[0]
                self.assertNotIn("_", logged)
                self.assertIn("reciprocal condition number ", logged)
                self.assertRegex("\n".join(block), r"(?m)^ +reciprocal condition number [0-9.]+$")
                found |= set(report)
        self.assertLessEqual({"rcond", "measured_norm_error", "patch_area_min", "probe_residual", "sweeps"}, found)

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
        self.refused(2, "--max-edge", "precompute", self.store, "--max-edge", 1, "-o", self.path("b.h5"))
        self.refused(2, "--mesh-error", "precompute", self.store, "--mesh-error", .1, "-o", self.path("b.h5"))
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
            # The standard error of the figure, from which the noise of both samples is taken out.
            self.assertGreater(single["reference_noise"], 1e-4)
            self.assertEqual((single["probes"], single["operator_probes"], single["total_is_bound"]), (8, 8, 0))
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
        self.assertIn("--form-factors auto does not use --resolution", done.stderr)

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
        self.assertEqual([line.split()[0] for line in done.stdout.splitlines()],
                         ["ok"] * 3 + ["skipped"] * 3 + ["ok"] * 4 + ["skipped", "ok"])  # no sky, luminaires, sensors, walks
        answer = json.loads(must("verify", self.store, "--probes", 0, "--json").stdout)
        self.assertTrue(answer["ok"])
        self.assertEqual({check["name"]: check["result"] for check in answer["checks"]}["scene"], "skipped")

    def test_verify_with_walks(self):
        self.assertNotIn("walks", json.loads(must("verify", self.store, "--probes", 0, "--json").stdout))
        command = ("verify", self.store, "--probes", 0, "--walks", 20000)
        answer = json.loads(must(*command, "--json").stdout)
        check = next(check for check in answer["checks"] if check["name"] == "walks")
        self.assertEqual(check["result"], "ok", check["detail"])
        # Uniform emission, each of the six groups alone (none emits by itself) and a mixture: groups and 8 elements.
        walks = answer["walks"]
        self.assertEqual(len(walks), 8 * (6 + 8))
        self.assertEqual({walk["emission"] for walk in walks} - {"uniform", "mixture"},
                         {walk["group"] for walk in walks if "group" in walk})
        self.assertEqual(sorted({walk["element"] for walk in walks if "element" in walk}), list(range(6, 96, 12)))
        # A closed box with one reflectance r under uniform emission 1: H = 1 / (1 - r).
        for walk in walks:
            self.assertEqual(walk["channel"], 0)
            self.assertAlmostEqual(walk["z"], (walk["operator"] - walk["walks"]) / walk["standard_error"], 6)
            if walk["emission"] == "uniform":
                self.assertAlmostEqual(walk["operator"], 1 / (1 - self.reflectance()), 4)
                self.assertLess(abs(walk["walks"] * (1 - self.reflectance()) - 1), .1)
        lines = must(*command, threads=1).stdout.splitlines()
        at = next(k for k, line in enumerate(lines) if re.match(r"ok +walks ", line))
        self.assertIn(f"of {len(walks)} means is {max(abs(walk['z']) for walk in walks):.1f} (", lines[at])
        for walk, line in zip(walks, lines[at + 1:]):  # the same for any number of threads
            name = walk.get("group", f"element {walk.get('element')}")
            self.assertEqual(line.split(), f"{walk['z']:+.1f} operator {walk['operator']:.6g} walks {walk['walks']:.6g} "
                             f"+- {walk['standard_error']:.2g} W/m2 {name} under {walk['emission']}".split())
            self.assertFalse(walk["dark"])
        self.refused(2, "--walks -1: must not be negative", "verify", self.store, "--walks", "-1")

    def test_verify_of_light_that_reaches_nothing(self):
        # The tops of the walls of a maze see nothing: they are a part of their own, and none of their light leaks.
        scene, store = self.path("maze.obj"), self.path("maze.h5")
        must("generate", "maze", "--elements", 300, "-o", scene)
        must("precompute", scene, "-o", store, "--form-factors", "blocks", "--method", "hierarchical", "--probes", 8)
        command = ("verify", store, "--probes", 0, "--walks", 20000)
        walks = json.loads(must(*command, "--json").stdout)["walks"]
        self.assertEqual({(walk["emission"], walk["dark"]) for walk in walks},
                         {("uniform", False), ("wall", False), ("floor", False), ("wall-top", True), ("mixture", False)})
        self.assertEqual({walk["walks"] for walk in walks if walk["dark"]}, {0})
        self.assertEqual({walk["operator"] for walk in walks if walk["dark"]}, {0})
        out = must(*command).stdout
        self.assertEqual(out.count(" under wall-top, dark\n"), sum(walk["dark"] for walk in walks))
        self.assertEqual(out.count(", dark\n"), sum(walk["dark"] for walk in walks))
        self.refused(2, "--walks 1000000001: must be", "verify", self.store, "--walks", "1000000001")
        self.refused(2, "--walks 1e3: not a whole number", "verify", self.store, "--walks", "1e3")

    def reflectance(self):
        with h5py.File(self.store) as file:
            return float(file["mesh/reflectance"][0, 0])

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
    def test_precompute_describes_its_store(self):
        out = self.path("a.h5")
        done = must("precompute", self.box, "-o", out, "--method", "exact", "--rays", 64, "--probes", 4, "--quiet",
                    "--json")
        answer = json.loads(done.stdout)
        self.assertEqual(done.stderr, "")
        self.assertEqual(answer.pop("output"), out)
        seconds = answer.pop("seconds")
        self.assertLessEqual({"import", "mesh", "form factors", "invert", "judge", "store"}, set(seconds))
        self.assertTrue(all(value >= 0 for value in seconds.values()))
        for name in ("processor_seconds", "forecast_processor_seconds"):
            used = answer.pop(name, {})
            self.assertTrue(all(value >= 0 for value in used.values()))
            if name == "processor_seconds":
                self.assertLessEqual({"form factors", "operator", "judge"}, set(used))
        self.assertEqual(answer, json.loads(must("info", out, "--json").stdout))
        for name in ("elements", "channels", "kind", "method", "reason", "bytes", "error"):
            self.assertIn(name, answer)

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
