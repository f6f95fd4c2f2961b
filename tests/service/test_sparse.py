"""Black box: stores of a sparse inverse from the command line to the daemon, read with h5py alone."""

import json
import os
import unittest

import h5py
import numpy

from command import must
from method_case import MethodCase


def dropped(operator, e):
    """delta_weight . e for each row."""
    if "delta_part" not in operator:
        return operator["delta_weight"][()].astype(float) @ e
    part = operator["delta_part"][()]
    return numpy.bincount(part, operator["delta_weight_in_part"][()].astype(float) * e)[part]


def bounced(store, E):
    """M E + delta (delta_weight . E) by element, the sum within parts, in double, as store/FORMAT.md says."""
    with h5py.File(store) as file:
        operator = file["operator"]
        order = operator["order"][()]
        result = numpy.zeros_like(E)
        for c, e in enumerate(E):
            rows = operator[f"M/{c}"]
            i = numpy.repeat(numpy.arange(len(e)), numpy.diff(rows["indptr"][()].astype(int)))
            row = numpy.bincount(i, rows["data"][()].astype(float) * e[order][rows["indices"][()]], len(e))
            if "delta" in operator:
                row += operator["delta"][c].astype(float) * dropped(operator, e[order])
            result[c, order] = row
    return result


class Sparse(MethodCase):
    method = kind = "sparse"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.factors = cls.path("city.h5")
        must("generate", "city", "--variant", 3, "--elements", 1500, "--reflectance", .7, "-o", cls.path("city.obj"))
        must("precompute", cls.path("city.obj"), "-o", cls.factors, "--method", "sparse", "--rays", 256, "--probes", 4,
             "--keep-form-factors", "--quiet")

    def test_the_formula_of_the_documentation(self):
        for store in self.factors, self.cornell:
            with h5py.File(store) as file:
                rho = file["mesh/reflectance"][()].astype(float)
            E = numpy.random.default_rng(1).random(rho.shape)
            numpy.save(self.path("E.npy"), E.astype(numpy.float32))
            must("solve", store, "--emission", self.path("E.npy"), "-o", self.path("B.npy"))
            found = numpy.load(self.path("B.npy")).reshape(rho.shape)
            expected = E + numpy.where(rho > 0, bounced(store, E), 0)
            numpy.testing.assert_allclose(found, expected, rtol=1e-5)

    def test_what_it_says(self):
        about = json.loads(must("info", "--json", self.factors).stdout)
        self.assertEqual((about["kind"], about["method"]), ("sparse", "sparse"))
        with h5py.File(self.factors) as file:
            operator, attributes = file["operator"], dict(file["operator"].attrs)
            stored = len(operator["M/0/data"])
            n = file["mesh/area"].shape[0]
            self.assertGreaterEqual(operator["M/0/data"][()].min(), numpy.float32(1e-4))
            for row in dropped(operator, numpy.ones(n)):
                self.assertAlmostEqual(float(row), 1, 5)
        self.assertEqual(attributes["threshold"], 1e-4)
        self.assertEqual(attributes["correction"], b"delta")
        self.assertAlmostEqual(about["density"], stored / n ** 2, 12)
        self.assertIn("%", about["reason"])
        self.assertNotIn("rank", attributes)
        self.assertIn("ok      operator      sparse", must("verify", self.factors).stdout)

    def test_corrections(self):
        """Light everywhere: delta makes it exact, and less threshold is less error."""
        with h5py.File(self.factors) as file:
            n, area = file["mesh/area"].shape[0], file["mesh/area"][()]
        ones = numpy.ones((1, n))
        truth = bounced(self.build("--threshold", 1e-7)[0], ones)
        errors = {}
        for threshold in 1e-3, 1e-4:
            for correction in "none", "delta", "discarded":
                store, _ = self.build("--threshold", threshold, "--correction", correction)
                with h5py.File(store) as file:
                    self.assertEqual("delta" in file["operator"], correction != "none")
                    self.assertEqual(file["operator"].attrs["correction"].decode(), correction)
                off = bounced(store, ones) - truth
                errors[threshold, correction] = (area @ off[0] ** 2 / (area @ truth[0] ** 2)) ** .5
        for threshold in 1e-3, 1e-4:
            self.assertLess(errors[threshold, "delta"], 1e-5)
            self.assertLess(errors[threshold, "discarded"], errors[threshold, "none"])
        self.assertLess(errors[1e-4, "none"], .5 * errors[1e-3, "none"])

    def test_same_bits(self):
        self.check_same_bits(["M/0/" + name for name in ("indptr", "indices", "data")])

    def test_the_daemon_serves_it(self):
        self.assertGreater(self.check_daemon()["density"], 0)

    def test_options(self):
        _, log = self.build("--rank", 5, "--factorizer", "svd", "--alpha", .4, "--store-precision", "f16",
                            "--coherence", .5)
        self.assertIn("sparse does not use", log)
        for name in "--rank", "--factorizer", "--alpha", "--store-precision", "--coherence":
            self.assertIn(name, log.split("sparse does not use")[1])
        done = must("precompute", self.factors, "-o", self.path("l.h5"), "--method", "low-rank", "--probes", 0,
                    "--threshold", 1e-3, "--correction", "none")
        self.assertIn("low-rank does not use --threshold, --correction", done.stderr)
        for value in "0", "1", "-1", "nan", "x":
            self.refused(2, "--threshold", "precompute", self.factors, "-o", self.path("no.h5"), "--method", "sparse",
                         "--threshold=" + value)
        self.assertFalse(os.path.exists(self.path("no.h5")))


if __name__ == "__main__":
    unittest.main()
