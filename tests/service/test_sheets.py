"""Black box: faces whose coordinates are rounded, as files of other programs have them: a leaf that is alone, twin faces,
and a room that is turned any way."""

import math
import os
import tempfile
import unittest

import h5py
import numpy

from command import SMALL, must

SOURCES = ([], ["--quality", "draft"], ["--form-factors", "hemicube", "--resolution", "64"],
           ["--form-factors", "blocks", "--method", "hierarchical"])


def rotation(seed):
    """A random rotation, [3][3]."""
    q = numpy.random.default_rng(seed).normal(size=4)
    w, x, y, z = q / numpy.linalg.norm(q)
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


class Sheets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-sheets-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def leaf(self, seed, decimals, faces):
        """Writes a leaf of .4 m that is turned at random; returns the z of its normal."""
        turned = rotation(seed)
        corners = numpy.array([[-.2, -.2, 0], [.2, -.2, 0], [.2, .2, 0], [-.2, .2, 0]]) @ turned.T + [1.234, 2.345, .987]
        with open(self.path("leaf.mtl"), "w", encoding="ascii") as file:
            file.write("newmtl green\nKd .5 .5 .5\n")
        with open(self.path("leaf.obj"), "w", encoding="ascii") as file:
            file.write("mtllib leaf.mtl\nusemtl green\n")
            for p in corners:
                file.write("v " + " ".join(f"{x:.{decimals}f}" for x in p) + "\n")
            file.writelines(f"f {face}\n" for face in faces)
        return turned[2, 2]

    def test_a_leaf_alone_sees_nothing(self):
        """Its radiosity is its emission, to the last bit. With four decimals some leaves are two triangles, of which
        those of one side see a little of each other: the square of the angle between them, of up to .001, over 8."""
        for seed in (3,):
            for faces, options in (["1 2 3 4"], ["--two-sided"]), (["1 2 3 4", "4 3 2 1"], []):
                for decimals in 4, 6, 9:
                    for source in SOURCES:
                        with self.subTest(seed=seed, faces=faces, decimals=decimals, source=source):
                            self.leaf(seed, decimals, faces)
                            must("precompute", self.path("leaf.obj"), "-o", self.path("leaf.h5"), "--probes", 0, "--quiet",
                                 *options, *source)
                            with h5py.File(self.path("leaf.h5")) as file:
                                E = (file["mesh/normal"][()] @ rotation(seed)[:, 2] > 0).astype(numpy.float32)
                            numpy.save(self.path("E.npy"), E)
                            must("solve", self.path("leaf.h5"), "--emission", self.path("E.npy"), "-o", self.path("B.npy"))
                            B = numpy.load(self.path("B.npy")).ravel()
                            self.assertTrue((B[E == 0] == 0).all(), B)
                            numpy.testing.assert_allclose(B[E == 1], 1, rtol=0, atol=0 if len(B) == 2 else 1e-6)

    def test_an_even_sky(self):
        """A face whose normal has the height z sees (1 + z)/2 of the cosines of the sky's hemisphere."""
        for faces, options in (["1 2 3 4"], ["--two-sided"]), (["1 2 3 4", "4 3 2 1"], []):
            z = self.leaf(3, 6, faces)
            must("precompute", self.path("leaf.obj"), "-o", self.path("leaf.h5"), "--probes", 0, "--quiet", "--sky", "tregenza",
                 "--rays", 4096, *options)
            numpy.save(self.path("sky.npy"), numpy.ones(145, numpy.float32))
            must("solve", self.path("leaf.h5"), "--sky", self.path("sky.npy"), "--quantity", "irradiance",
                 "-o", self.path("H.npy"))
            # 4,096 points of a sequence leave about n^-3/4 of a hemisphere, .002, along the horizon.
            numpy.testing.assert_allclose(numpy.load(self.path("H.npy")).ravel(),
                                          [math.pi * (1 + z) / 2, math.pi * (1 - z) / 2], atol=.02)

    def test_a_scene_that_is_turned(self):
        """Any direction and six decimals leave the means of groups as they are: of walls, whose elements are no more in one
        plane then than single precision tells, and of leaves."""
        for kind, group, size, options in ("cornell", "floor", 2, ["--closed"]), ("canopy", "ground", 1, []):
            scene, turned = self.path(kind + ".obj"), self.path("turned.obj")
            must("generate", kind, "--elements", 300, *options, "-o", scene)
            way = rotation(11)
            with open(scene, encoding="ascii") as file, open(turned, "w", encoding="ascii") as out:
                for line in file:
                    if line.startswith("v "):
                        p = way @ [size * float(x) for x in line.split()[1:]]
                        line = "v " + " ".join(f"{x:.6f}" for x in p) + "\n"
                    out.write(line)
            means = []
            for name in scene, turned:
                must("precompute", name, "-o", self.path("turned.h5"), "--method", "exact", "--probes", 0, "--quiet",
                     "--quality", "high")
                must("solve", self.path("turned.h5"), "--emit", f"{group}=1", "--quantity", "irradiance", "-o", self.path("H.npy"))
                with h5py.File(self.path("turned.h5")) as file:
                    area, groups = file["mesh/area"][()], file["mesh/group"][()]
                H = numpy.load(self.path("H.npy")).reshape(-1, len(area)).mean(0)
                means.append(numpy.bincount(groups, area * H) / numpy.bincount(groups, area))
            # Partly hidden pairs err by 7e-5 at most, each way by chance, and a group is the mean of many.
            numpy.testing.assert_allclose(means[1], means[0], rtol=0, atol=1e-4 * means[0].max())


if __name__ == "__main__":
    unittest.main()
