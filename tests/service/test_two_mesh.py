"""Black box: stores of two meshes from the command line to the picture, read with h5py alone."""

import json
import os
import unittest

import h5py
import numpy

from command import must
from method_case import MethodCase
from png_file import decode_png

BACKGROUND = 38


def patches_of(store):
    """The elements of each patch, and what the operator's group says."""
    with h5py.File(store) as file:
        group = file["operator"]
        order, ends = group["order"][()], group["I"][()].astype(int)
        return ([order[ends[p]:ends[p + 1]] for p in range(len(ends) - 1)], dict(group.attrs),
                file["mesh/area"][()], group["coherence"][()])


class TwoMesh(MethodCase):
    method, kind = "2msc", "two_mesh"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.factors = cls.path("box.h5")
        must("generate", "box", "--size", "4,3,2", "--divisions", 8, "--reflectance", .5, "-o", cls.path("box.obj"))
        must("precompute", cls.path("box.obj"), "-o", cls.factors, "--method", "exact", "--probes", 0,
             "--keep-form-factors", "--quiet")

    def build(self, *options, name="out.h5", probes=0):
        return super().build("--rays", 256, *options, name=name, probes=probes)

    def test_defaults(self):
        store, log = self.build(probes=8)
        about = json.loads(must("info", store, "--json").stdout)
        self.assertEqual((about["kind"], about["method"], about["rank"]), ("two_mesh", "2msc", 24))
        self.assertEqual(about["elements"], 384)
        self.assertIn("24 patches of 384 elements by inclusion, coherence", about["reason"])
        self.assertIn(about["reason"], log)
        self.assertGreater(about["epsilon"], 0)
        self.assertLess(about["epsilon"], 1)
        self.assertIn("operator_indirect_mean", about["error"]["single"])
        self.assertIn("rank              24", must("info", store).stdout)
        done = must("verify", store, "--probes", 8)
        self.assertIn("two_mesh", done.stdout)
        self.assertNotIn("broken", done.stdout)

    def test_what_format_says(self):
        store, _ = self.build("--rank", 31, name="format.h5")
        patches, attributes, area, coherence = patches_of(store)
        self.assertEqual(attributes["kind"], b"two_mesh")
        self.assertEqual(attributes["form"], b"folded")
        self.assertEqual(attributes["factorizer"], b"none")
        self.assertEqual(attributes["assign"], b"inclusion")
        self.assertEqual(attributes["rank"], 31)
        self.assertEqual(len(patches), 31)
        self.assertEqual(sorted(numpy.concatenate(patches)), list(range(384)))
        self.assertTrue(all(len(p) > 0 for p in patches))
        self.assertAlmostEqual(attributes["coherence_min"], coherence.min(), places=6)
        self.assertAlmostEqual(attributes["patch_area_min"], min(area[p].sum() for p in patches))
        with h5py.File(store) as file:  # B = E - Y T, as FORMAT.md has it
            group = file["operator"]
            weight = group["weight"][()] if "weight" in group else numpy.ones(384)
            order, starts = group["order"][()], group["I"][()].astype(int)[:-1]
            E = numpy.random.default_rng(1).random(384)
            B = E.copy()
            B[order] -= group["Y"][()].astype(float) @ numpy.add.reduceat(weight * E[order], starts)
        numpy.save(self.path("E.npy"), E)
        must("solve", store, "--emission", self.path("E.npy"), "-o", self.path("B.npy"))
        numpy.testing.assert_allclose(numpy.load(self.path("B.npy")).ravel(), B, rtol=1e-6)

    def test_precisions(self):
        E = numpy.random.default_rng(2).random(384)
        numpy.save(self.path("light.npy"), E)
        # Y's values are off by half a unit in the last place of 11 bits, or half a 127th of the column's
        # largest; 1e-6 more for the answer in single precision.
        for precision, kept, bits in (("f16", "<f2", 2. ** -11), ("i8", "|i1", .5 / 127)):
            with self.subTest(precision):
                store, log = self.build("--rank", 31, "--store-precision", precision, name=precision + ".h5")
                wide, _ = self.build("--rank", 31, name="wide.h5")
                self.assertIn(precision + " takes ", log)
                self.assertNotIn("2msc does not use", log)
                with h5py.File(store) as file, h5py.File(wide) as before:
                    group = file["operator"]
                    self.assertEqual(group.attrs["precision"], precision.encode())
                    self.assertEqual(group["Y"].dtype.str, kept)
                    Y = group["Y"][()]
                    Y = Y * (group["Y_scale"][()] if "Y_scale" in group else 1.)
                    exact = before["operator/Y"][()].astype(float)
                    off = abs(Y - exact)
                    self.assertGreater(off.max(), 0)
                    largest = abs(exact).max(axis=0)
                    # f16 below 2^-14 has steps of 2^-24
                    limit = largest * bits * 1.001 if precision == "i8" else abs(exact) * bits + 2. ** -25
                    self.assertTrue((off <= limit).all())
                    weight = group["weight"][()] if "weight" in group else numpy.ones(384)
                    order, starts = group["order"][()], group["I"][()].astype(int)[:-1]
                    B = E.copy()
                    B[order] -= Y @ numpy.add.reduceat(weight * E[order], starts)
                must("solve", store, "--emission", self.path("light.npy"), "-o", self.path("B.npy"))
                numpy.testing.assert_allclose(numpy.load(self.path("B.npy")).ravel(), B, rtol=1e-6)
                self.assertIn("precision         " + precision, must("info", store).stdout)
                must("verify", store, "--probes", 8)

    def test_against_exact(self):
        """With every element a patch it is the exact operator; with few, power in a closed box still balances."""
        numpy.save(self.path("one.npy"), numpy.eye(384)[7])
        must("solve", self.factors, "--emission", self.path("one.npy"), "-o", self.path("exact.npy"))
        exact = numpy.load(self.path("exact.npy")).ravel()
        for rank in (384, 1000):
            store, _ = self.build("--rank", rank)
            must("solve", store, "--emission", self.path("one.npy"), "-o", self.path("B.npy"))
            numpy.testing.assert_allclose(numpy.load(self.path("B.npy")).ravel(), exact, rtol=1e-4, atol=1e-8)
        store, _ = self.build("--rank", 10)
        must("solve", store, "--emission", self.path("one.npy"), "--quantity", "irradiance", "-o", self.path("H.npy"))
        with h5py.File(store) as file:
            area = file["mesh/area"][()]
        absorbed = (.5 * area * numpy.load(self.path("H.npy")).ravel()).sum()
        self.assertAlmostEqual(absorbed / area[7], 1, delta=1e-4)

    def test_coherence_and_area(self):
        store, log = self.build("--coherence", .9)
        patches, _, _, coherence = patches_of(store)
        self.assertGreaterEqual(coherence.min(), .9 - 1e-6)
        self.assertLess(len(patches), 384)
        self.assertIn(str(len(patches)) + " patches", log)
        fine, _ = self.build("--coherence", .95, name="fine.h5")
        self.assertGreater(len(patches_of(fine)[0]), len(patches))
        store, _ = self.build("--min-area", .5)
        patches, _, area, _ = patches_of(store)
        self.assertTrue(all(area[p].sum() <= .5 for p in patches))
        self.assertGreater(min(area[p].sum() for p in patches), .1)
        store, _ = self.build("--min-area", 100)
        self.assertEqual(len(patches_of(store)[0]), 6)
        both, _ = self.build("--coherence", .95, "--min-area", .5, name="both.h5")
        self.assertLessEqual(len(patches_of(both)[0]), len(patches))

    def test_proximity(self):
        store, log = self.build("--rank", 40, "--assign", "proximity")
        patches, attributes, _, _ = patches_of(store)
        self.assertEqual(attributes["assign"], b"proximity")
        self.assertIn("by proximity", log)
        self.assertEqual(len(patches), 40)
        self.assertEqual(sorted(numpy.concatenate(patches)), list(range(384)))
        self.assertTrue(all(len(p) > 0 for p in patches))

    def test_qr(self):
        store, log = self.build("--rank", 40, "--factorizer", "qr", probes=4)
        about = json.loads(must("info", store, "--json").stdout)
        self.assertEqual((about["kind"], about["method"], about["rank"]), ("low_rank", "2msc", 40))
        with h5py.File(store) as file:
            self.assertEqual(file["operator"].attrs["factorizer"], b"qr")
            self.assertNotIn("levels", file["operator"].attrs)
        plain, _ = self.build("--rank", 40, name="plain.h5")
        self.assertLess(about["epsilon"], json.loads(must("info", plain, "--json").stdout)["epsilon"])
        self.refused(1, "has no patches", "render", store, "--quantity", "patch", "-o", self.path("no.png"))
        self.assertFalse(os.path.exists(self.path("no.png")))
        self.assertIn("40 patches of 384", log)

    def test_three_channels(self):
        about = json.loads(must("info", self.cornell, "--json").stdout)
        self.assertEqual((about["kind"], about["channels"]), ("two_mesh", 3))
        with h5py.File(self.cornell) as file:
            n, k = file["mesh/area"].shape[0], about["rank"]
            self.assertEqual(file["operator/core"].shape, (3, k, k))
            self.assertEqual(file["operator/U"].shape, (n, k))
            self.assertEqual(file["operator/weight"].shape, (n,))
            self.assertEqual(file["operator"].attrs["form"], b"factored")
            ends = file["operator/I"][()].astype(int)
            sums = numpy.add.reduceat(file["operator/weight"][()].astype(float), ends[:-1])
        numpy.testing.assert_allclose(sums, 1, atol=1e-5)
        done = must("solve", self.cornell, "--emit", "lamp=17,12,4", "-o", self.path("B.csv"))
        self.assertEqual(done.stderr.count("error"), 0)

    def test_the_daemon_serves_it(self):
        self.check_daemon()

    def test_same_bits(self):
        self.check_same_bits(("I", "order", "coherence"), "--assign", "proximity")

    def colours(self, image):
        pixels = decode_png(image)
        found, counts = numpy.unique(pixels.reshape(-1, pixels.shape[2]), axis=0, return_counts=True)
        # Edges mix the colours of two patches, along a line of pixels at most.
        return {tuple(c) for c, count in zip(found, counts) if 100 * count >= pixels.shape[0] * pixels.shape[1]}

    def test_pictures(self):
        image = self.path("a.png")
        inside = ("--camera", "2,.1,1,2,3,1,70", "--size", "320x240")
        store, _ = self.build("--rank", 12, name="picture.h5")
        done = must("render", store, "--quantity", "patch", "-o", image, *inside)
        self.assertIn("12 patches", done.stderr)
        self.assertEqual(decode_png(image).shape, (240, 320, 3))
        seen = self.colours(image)
        self.assertGreaterEqual(len(seen), 5)
        self.assertLessEqual(len(seen), 12)
        for colour in seen:  # no greys: each patch has a hue
            self.assertGreater(max(colour) - min(colour), 60, seen)
        done = must("render", store, "--quantity", "coherence", "-o", image, *inside)
        self.assertRegex(done.stderr, r"black is coherence 0\.\d+, white 1")
        self.assertEqual(decode_png(image).shape, (240, 320, 1))
        greys = {c[0] for c in self.colours(image)}
        self.assertGreater(len(greys), 2)
        self.assertTrue(all(10 <= grey <= 255 for grey in greys), greys)
        done = must("render", store, "--quantity", "coherence", "--false-color", "-o", image, *inside)
        self.assertIn("colours from coherence 0 to 1", done.stderr)
        self.assertEqual(decode_png(image).shape[2], 3)

    def test_greys_are_the_coherences(self):
        """Everything that is seen of one face is in the greys that its patches' coherences ask for."""
        store, _ = self.build("--rank", 24, name="grey.h5")
        image = self.path("g.png")
        must("render", store, "--quantity", "coherence", "-o", image, "--camera", "2,1.5,1.9,2,1.6,0,80",
             "--size", "200x200")
        _, _, _, coherence = patches_of(store)
        smallest = coherence.min()
        allowed = 255 * (.06 + .94 * (coherence - smallest) / (1 - smallest))
        for colour in self.colours(image):
            self.assertLess(abs(allowed - colour[0]).min(), 1.5, (colour, allowed))

    def test_unused_options_are_named(self):
        done = must("render", self.cornell, "--quantity", "patch", "--emit", "lamp=1", "--smooth", "--false-color",
                    "-o", self.path("u.png"), "--size", "64x64")
        for option in ("--emit", "--smooth", "--false-color"):
            self.assertIn("--quantity patch does not use " + option, done.stderr)
        _, log = self.build("--rank", 9, "--coherence", .5, "--min-area", 1, "--alpha", .3, "--epsilon", .2)
        self.assertIn("2msc does not use --coherence, --min-area, --alpha, --epsilon", log)
        _, log = self.build("--coherence", .5, "--assign", "inclusion", "--factorizer", "auto")
        self.assertNotIn("2msc does not use", log)
        for factorizer in ("hf", "svd", "rsi", "sgrsvd"):
            store, log = self.build("--rank", 9, "--factorizer", factorizer)
            self.assertIn("2msc does not use --factorizer", log)
            with h5py.File(store) as file:
                self.assertEqual(file["operator"].attrs["factorizer"], b"none")
        _, log = self.build("--rank", 9, "--factorizer", "qr")
        self.assertNotIn("--factorizer", log)
        done = must("precompute", self.factors, "-o", self.path("e.h5"), "--method", "exact", "--factorizer", "qr",
                    "--probes", 0)
        self.assertIn("exact does not use --factorizer", done.stderr)

    def test_wrong_usage(self):
        out = self.path("never.h5")
        for status, wanted, options in (
                (2, "--coherence 0: must be above 0 and at most 1", ["--coherence", 0]),
                (2, "--coherence 1.01: must be above 0 and at most 1", ["--coherence", 1.01]),
                (2, "--coherence", ["--coherence", "nan"]),
                (2, "--min-area 0: must be above 0", ["--min-area", 0]),
                (2, "--min-area", ["--min-area", "-2"]),
                (2, "--min-area", ["--min-area", "small"]),
                (2, "--assign", ["--assign", "guess"]),
                (2, "--rank", ["--rank", 0]),
                (2, "--factorizer", ["--factorizer", "cholesky"]),
                (1, "--memory", ["--memory", "100K"])):
            with self.subTest(options):
                self.refused(status, wanted, "precompute", self.factors, "-o", out, "--method", "2msc",
                             "--probes", 0, "--quiet", *options)
                self.assertFalse(os.path.exists(out))
        for method in ([], ["--method", "low-rank"]):
            self.refused(2, "--factorizer qr: goes with --method 2msc only", "precompute", self.factors, "-o", out,
                         "--factorizer", "qr", *method)

    def test_a_damaged_patch_is_refused(self):
        store, _ = self.build(name="damaged.h5")
        with open(store, "r+b") as file:
            with h5py.File(store) as h5:
                place = h5["operator/I"].id.get_offset()
            file.seek(place + 8)
            file.write(b"\xff")
        self.refused(1, "/operator/I", "solve", store, "--emit", "floor=1", "-o", self.path("x.csv"))


if __name__ == "__main__":
    unittest.main()
