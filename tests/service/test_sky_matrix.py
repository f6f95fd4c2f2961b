"""Sky matrices of Radiance through `lambert sky` into `lambert solve`: a matrix laid out patch by patch as gendaymtx does,
with one bright patch, lights the wall that faces it."""

import os
import pathlib
import re
import tempfile
import unittest

import numpy as np

from command import lambert, must
from cube import CORNERS

# A cube without a bottom, its fronts outwards: walls that face south, east, north and west, and a roof.
CUBE = "mtllib cube.mtl\n" + CORNERS + """usemtl paint
o south
f 1 2 6 5
o east
f 2 3 7 6
o north
f 3 4 8 7
o west
f 4 1 5 8
o roof
f 5 6 7 8
"""
NORMALS = {"south": (0, -1, 0), "east": (1, 0, 0), "north": (0, 1, 0), "west": (-1, 0, 0), "roof": (0, 0, 1)}
ROWS = (30, 30, 24, 24, 18, 12, 6)


def patches(split=1):
    """Altitude, azimuth from north by east, and solid angle of the patches of Reinhart's sky, as Radiance counts them;
    the ground, which is the first row of a matrix, is not among them."""
    height = np.pi / 2 / (7 * split + .5)
    for row in range(7 * split):
        count = ROWS[row // split] * split
        omega = 2 * np.pi / count * (np.sin((row + 1) * height) - np.sin(row * height))
        for k in range(count):
            yield (row + .5) * height, 2 * np.pi * k / count, omega
    yield np.pi / 2, 0, 2 * np.pi * (1 - np.cos(height / 2))


def matrix(values, kind="float"):
    """[patches and ground][hours][components] as a file."""
    rows, columns, components = values.shape
    head = f"#?RADIANCE\ngendaymtx a.wea\nLATLONG= 37.5 -122.2\nNROWS={rows}\nNCOLS={columns}\nNCOMP={components}\n"
    if kind == "ascii":
        body = "\n".join("".join(" ".join(f"{x:.9g}" for x in cell) + "\n" for cell in row) for row in values).encode()
    else:
        head += "BigEndian=0\n"
        body = values.astype({"float": "<f4", "double": "<f8"}[kind]).tobytes()
    return (head + f"FORMAT={kind}\n\n").encode() + body


class SkyMatrix(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-matrix-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        (cls.folder / "cube.obj").write_text(CUBE)
        cls.stores = {}
        for name, paint in ("grey", ".5 .5 .5"), ("colour", ".5 .4 .3"):
            (cls.folder / "cube.mtl").write_text(f"newmtl paint\nKd {paint}\n")
            cls.stores[name] = cls.folder / (name + ".h5")
            must("precompute", cls.folder / "cube.obj", "-o", cls.stores[name], "--sky", "reinhart:2", "--rays", 65536,
                 "--probes", 0, "--method", "exact")

    def convert(self, values, *options, kind="float", name="a.mtx"):
        path, out = self.folder / name, self.folder / "a.npy"
        path.write_bytes(matrix(values, kind))
        done = must("sky", path, "-o", out, *options)
        return np.load(out), done

    def test_a_bright_patch_lights_the_wall_that_faces_it(self):
        places = list(patches(2))
        chosen = [k for k, (up, _, _) in enumerate(places) if up < .5][::7] + [len(places) - 1]
        values = np.zeros((len(places) + 1, len(chosen), 3))
        values[0] = 1e6  # the ground, which must not shine
        for hour, k in enumerate(chosen):
            values[1 + k, hour] = 1000
        self.convert(values)
        out = self.folder / "light.npy"
        must("solve", self.stores["grey"], "--sky", self.folder / "a.npy", "--quantity", "irradiance", "-o", out)
        light = np.load(out)
        self.assertEqual(light.shape, (len(chosen), 5))
        for hour, k in enumerate(chosen):
            up, turn, omega = places[k]
            towards = np.array([np.cos(up) * np.sin(turn), np.cos(up) * np.cos(turn), np.sin(up)])
            for element, name in enumerate(NORMALS):
                facing = NORMALS[name] @ towards
                if abs(facing) < .15:  # a patch that is partly behind the wall
                    continue
                # A patch is 6 degrees wide: its mean cosine differs from its middle's by .05 % of it; rays by 2 %.
                self.assertAlmostEqual(light[hour, element], max(0, facing) * omega * 1000, delta=.06 * omega * 1000)

    def test_kinds(self):
        rng = np.random.default_rng(4)
        values = rng.random((146, 5, 1)).astype("<f4").astype(float) * np.ones(3)
        grey = {kind: self.convert(values, kind=kind)[0] for kind in ("ascii", "float", "double")}
        self.assertEqual(grey["float"].shape, (5, 145))
        # Tiles are counted as Radiance counts patches, less the ground.
        np.testing.assert_array_equal(grey["float"], values[1:, :, 0].T.astype(np.float32))
        for kind in "ascii", "double":
            np.testing.assert_array_equal(grey[kind], grey["float"])
        one, done = self.convert(values[:, :, :1], name="a.SMX")
        np.testing.assert_array_equal(one, grey["float"])
        self.assertIn("5 skies of 145 tiles (tregenza), W/(m2 sr)", done.stdout)
        up, _, omega = np.array(list(patches())).T
        received = (values[1:, :, 0] * (np.sin(up) * omega)[:, None]).sum() / 1000
        said = float(re.search(r"on a horizontal plane: ([\d.]+) kWh/m2", done.stderr)[1])
        self.assertAlmostEqual(said, received, delta=.06)
        lit, done = self.convert(values, "--photometric", "--tiles", "reinhart:1")
        np.testing.assert_allclose(lit, 179 * grey["float"], rtol=1e-6)
        self.assertIn("(reinhart:1), cd/m2", done.stdout)

    def test_colours(self):
        rng = np.random.default_rng(5)
        values = rng.random((578, 4, 1)) * np.array([.96, 1.004, 1.118])
        skies, done = self.convert(values)
        self.assertEqual(skies.shape, (4, 3, 577))
        np.testing.assert_array_equal(skies, values[1:].transpose(1, 2, 0).astype(np.float32))
        self.assertIn("three components", done.stdout)
        out = self.folder / "year.npy"
        must("solve", self.stores["colour"], "--sky", self.folder / "a.npy", "--annual", "sum", "-o", out)
        year = np.load(out)
        np.testing.assert_allclose(year[0] / year[0, :1], np.array([1, 1.004 / .96, 1.118 / .96])[:, None] *
                                   np.ones(5), rtol=1e-4)

    def test_solve_reads_matrices(self):
        """Without `lambert sky` between: the same answers, a grey store by the luminance of Radiance's colours."""
        rng = np.random.default_rng(6)
        values = rng.random((578, 4, 3))
        path, direct, by_way = self.folder / "b.smx", self.folder / "direct.npy", self.folder / "way.npy"
        skies, _ = self.convert(values)
        path.write_bytes(matrix(values))
        must("solve", self.stores["colour"], "--sky", path, "-o", direct)
        must("solve", self.stores["colour"], "--sky", self.folder / "a.npy", "-o", by_way)
        np.testing.assert_array_equal(np.load(direct), np.load(by_way))
        np.save(self.folder / "grey.npy", np.einsum("c,bct->bt", (.265, .670, .065), skies).astype(np.float32))
        must("solve", self.stores["grey"], "--sky", self.folder / "grey.npy", "-o", by_way)
        for sky in path, self.folder / "a.npy":
            done = must("solve", self.stores["grey"], "--sky", sky, "-o", direct)
            self.assertEqual(done.stderr.count("lights it by its luminance, 0.265 R + 0.670 G + 0.065 B"), 1)
            np.testing.assert_allclose(np.load(direct), np.load(by_way), rtol=1e-6)
        path.write_bytes(matrix(values[:, :, :1] * np.ones(3)))  # grey: no word of luminance, in either store
        done = must("solve", self.stores["colour"], "--sky", path, "--annual", "sum", "-o", direct)
        self.assertNotIn("luminance", done.stderr)
        path.write_bytes(matrix(values[:146]))
        done = lambert("solve", self.stores["grey"], "--sky", path, "-o", direct)
        self.assertEqual(done.returncode, 1)
        self.assertIn("b.smx: has the patches of tregenza, the store has the tiles of reinhart:2", done.stderr)
        done = lambert("render", self.stores["grey"], "--sky", self.folder / "year.epw", "-o", self.folder / "a.png")
        self.assertEqual(done.returncode, 1)
        self.assertIn("hours of a weather file are for lambert solve", done.stderr)

    def test_refused(self):
        out = self.folder / "none.npy"
        good = matrix(np.ones((146, 2, 3)))
        for name, content, more, status, wanted in (
                ("short.mtx", good[:-1], [], 1, "short.mtx: holds 3503 bytes after its header"),
                ("head.mtx", good[11:], [], 1, "head.mtx: does not begin with #?RADIANCE"),
                ("rows.mtx", matrix(np.ones((100, 2, 3))), [], 1, "100 rows, must be 146"),
                ("nan.mtx", matrix(np.full((146, 2, 3), np.nan)), [], 1, "row 0, column 0 = nan"),
                ("dark.mtx", matrix(np.zeros((146, 2, 3))), [], 1, "the sky is dark in all 2 columns"),
                ("tiles.mtx", good, ["--tiles", "grid:12x11"], 1, "--tiles asks for grid:12x11"),
                ("a.txt", good, [], 2, "must end in .epw or .wea, or in .mtx or .smx")):
            path = self.folder / name
            path.write_bytes(content)
            before = sorted(os.listdir(self.folder))
            done = lambert("sky", path, "-o", out, *more)
            self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertIn(wanted, done.stderr)
            self.assertEqual(sorted(os.listdir(self.folder)), before)


if __name__ == "__main__":
    unittest.main()
