"""Black box: a closed box stays dark to the last bit while another one is lit, in operators of every kind."""

import os
import tempfile
import unittest

import numpy

from command import must

# Elements along an edge.
SIDE = 6


def box(file, x, first, name):
    """A unit cube at x seen from within, its faces of SIDE x SIDE quadrilaterals."""
    corners = numpy.array([[0, 0, 0], [0, 0, 1], [0, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0]], float)
    along = [([1, 0, 0], [0, 1, 0]), ([0, 1, 0], [1, 0, 0]), ([0, 0, 1], [1, 0, 0]),
             ([1, 0, 0], [0, 0, 1]), ([0, 1, 0], [0, 0, 1]), ([0, 0, 1], [0, 1, 0])]
    for face, (corner, (u, v)) in enumerate(zip(corners, along)):
        file.write(f"o {name}{face}\nusemtl grey\n")
        for j in range(SIDE):
            for i in range(SIDE):
                for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                    p = corner + a / SIDE * numpy.array(u) + b / SIDE * numpy.array(v) + [x, 0, 0]
                    file.write("v %.17g %.17g %.17g\n" % tuple(p))
                file.write("f %d %d %d %d\n" % tuple(range(first, first + 4)))
                first += 4
    return first


class SealedBoxes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-sealed-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        with open(cls.path("boxes.mtl"), "w", encoding="ascii") as file:
            file.write("newmtl grey\nKd .7 .7 .7\n")
        with open(cls.path("boxes.obj"), "w", encoding="ascii") as file:
            file.write("mtllib boxes.mtl\n")
            # Of unequal distances, so that no half of a plane is a box.
            first = 1
            for name, x in ("a", 0), ("b", 3), ("c", 4.5):
                first = box(file, x, first, name)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def check_dark(self, roundings, *options, scene="boxes.obj", store="boxes.h5"):
        """The largest irradiance of a dark box, over that of the lit one, in roundings of single precision."""
        store = self.path(store)
        must("precompute", self.path(scene), "-o", store, "--probes", 0, "--quiet", *options)
        n = 6 * SIDE * SIDE
        for lit in range(3):
            for elements in range(n), [7]:
                E = numpy.zeros(3 * n, numpy.float32)
                E[[lit * n + i for i in elements]] = 1
                numpy.save(self.path("E.npy"), E)
                must("solve", store, "--emission", self.path("E.npy"), "--quantity", "irradiance", "-o", self.path("H.npy"))
                H = numpy.load(self.path("H.npy")).reshape(3, n).astype(float)
                self.assertGreater(H[lit].max(), 0)
                for dark in {0, 1, 2} - {lit}:
                    self.assertLessEqual(abs(H[dark]).max(), roundings * 2.0**-24 * H[lit].max(),
                                         (options, lit, dark, len(elements)))

    def test_each_kind(self):
        for method, *options in (["exact"], ["2msc"], ["sparse"], ["sparse", "--threshold", "1e-3"],
                                 ["sparse", "--correction", "discarded"], ["auto"], ["hierarchical"],
                                 ["hierarchical", "--form-factors", "blocks"],
                                 ["hierarchical", "--quality", "draft", "--epsilon", ".3"]):
            with self.subTest(method=method, options=options):
                self.check_dark(0, "--method", method, *options)

    def test_beside_a_city(self):
        """Few rays in a city leave a mean error of uniform emission to correct, which light of a box has no part in."""
        city, both, store = (self.path(name) for name in ("city.obj", "both.obj", "both.h5"))
        must("generate", "city", "--elements", 1000, "-o", city)
        with open(city, encoding="ascii") as file:
            lines = file.readlines()
        with open(both, "w", encoding="ascii") as file:
            file.write("mtllib boxes.mtl\n")
            file.writelines(lines)
            box(file, -5000, 1 + sum(line.startswith("v ") for line in lines), "far")
        must("precompute", both, "-o", store, "--method", "hierarchical", "--rays", 64, "--probes", 0, "--quiet")
        must("solve", store, "--emit", "far5=1", "--quantity", "irradiance", "-o", self.path("H.npy"))
        H = numpy.load(self.path("H.npy")).reshape(-1, numpy.load(self.path("H.npy")).shape[-1])[0]
        n = 6 * SIDE * SIDE
        self.assertGreater(H[-n:].max(), 0)
        self.assertEqual(abs(H[:-n]).max(), 0)

    def test_kept_blocks(self):
        """An operator of blocks from a store knows the parts of the scene as well."""
        self.check_dark(0, "--form-factors", "blocks", "--method", "hierarchical", "--keep-form-factors", store="kept.h5")
        self.check_dark(0, "--method", "hierarchical", "--epsilon", ".2", scene="kept.h5")

    def test_low_rank(self):
        """Columns of boxes that are alike may mix: each of at most n products is rounded once."""
        self.check_dark(3 * 6 * SIDE * SIDE, "--method", "low-rank")


if __name__ == "__main__":
    unittest.main()
