"""Black box: faces are cut along walls that stand on them, so that no light passes below a wall, however faces are divided."""

import json
import re
import unittest

import numpy

from case import Case
from command import SMALL, must

# About elements of equal size, of a longest edge, and where light changes.
WAYS = ([["--elements", 600]] if SMALL else
        [["--elements", 600], ["--elements", 1000], ["--elements", 3000], ["--max-edge", .3], ["--mesh-error", .05]])


def box_face(axis, level, inside):
    """The corners of a face of a room of 4 x 4 x 3 m, which looks to where the axis falls or rises."""
    size, (u, v) = (4, 4, 3), ((axis + 1) % 3, (axis + 2) % 3)
    corners = numpy.zeros((4, 3))
    corners[:, axis] = level
    corners[1:3, u], corners[2:4, v] = size[u], size[v]
    return corners if inside > 0 else corners[::-1]


def two_rooms(walls):
    """A room with a lamp in its west, and walls across it from floor to ceiling, each (x, side that it looks to)."""
    faces = {name: box_face(axis, level, side) for name, axis, level, side in
             (("west", 0, 0, 1), ("east", 0, 4, -1), ("south", 1, 0, 1), ("north", 1, 4, -1), ("floor", 2, 0, 1), ("ceiling", 2, 3, -1),
              *((f"wall{k}", 0, x, side) for k, (x, side) in enumerate(walls)))}
    faces["lamp"] = numpy.array([[.5, 1, 2.9], [.5, 2, 2.9], [1.5, 2, 2.9], [1.5, 1, 2.9]])
    return faces


class Walls(Case):
    def write(self, faces, turned=None):
        with open(self.path("rooms.mtl"), "w", encoding="ascii") as file:
            file.write("newmtl w\nKd .6 .6 .6\nnewmtl l\nKd .6 .6 .6\nKe 10 10 10\n")
        with open(self.path("rooms.obj"), "w", encoding="ascii") as file:
            file.write("mtllib rooms.mtl\n")
            for k, (name, corners) in enumerate(faces.items()):
                for p in corners if turned is None else corners @ turned.T:
                    file.write("v {:.6f} {:.6f} {:.6f}\n".format(*p))
                file.write(f"o {name}\nusemtl {'l' if name == 'lamp' else 'w'}\n"
                           f"f {4 * k + 1} {4 * k + 2} {4 * k + 3} {4 * k + 4}\n")
        return self.path("rooms.obj")

    def irradiance(self, scene, *options):
        """The log, and the mean irradiance of the wall towards the lamp and of the far wall of the dark room."""
        log = must("precompute", scene, "-o", self.path("rooms.h5"), "--probes", 0, *options).stderr
        answer = must("solve", self.path("rooms.h5"), "--quantity", "irradiance", "--reduce", "wall0=mean", "--reduce", "east=mean",
                      "--json").stdout
        groups = json.loads(answer)["groups"]
        return log, groups["wall0"]["mean"], groups["east"]["mean"]

    def check(self, scene, faces, parts, ways=WAYS):
        for way in ways:
            with self.subTest(way=way):
                log, lit, dark = self.irradiance(scene, *way)
                self.assertGreater(lit, .3)
                self.assertLess(dark, 1e-5 * lit)
                self.assertIn(f"{faces} faces are cut along walls that stand on them, into {parts} parts", log)
                self.assertNotIn("on both sides of a wall", log)

    def test_thick_wall(self):
        self.check(self.write(two_rooms([(2.03, -1), (2.13, 1)])), 4, 12)

    def test_two_sheets(self):
        self.check(self.write(two_rooms([(2, -1), (2, 1)])), 4, 8)

    def test_turned(self):
        """By no special angle; corners are off the planes of others by the rounding of six decimals."""
        turned, _ = numpy.linalg.qr(numpy.random.default_rng(7).normal(size=(3, 3)))
        turned *= numpy.linalg.det(turned)
        for walls, parts in (((2.03, -1), (2.13, 1)), 12), (((2, -1), (2, 1)), 8):
            self.check(self.write(two_rooms(walls), turned), 4, parts, WAYS[::2])

    def test_two_sided_sheet(self):
        scene = self.write(two_rooms([(2, -1)]))
        for way in WAYS:
            with self.subTest(way=way):
                _, lit, dark = self.irradiance(scene, "--two-sided", *way)
                self.assertGreater(lit, .3)
                self.assertLess(dark, 1e-5 * lit)

    def test_faces_that_are_not_divided_stay(self):
        """Without a mesh option, or where there are as many faces as elements that are asked for."""
        scene = self.write(two_rooms([(2.03, -1), (2.13, 1)]))
        for way in [], ["--elements", 9]:
            log, _, _ = self.irradiance(scene, *way)
            self.assertIn("9 elements in 9 groups", log)
            self.assertNotIn("walls", log)

    def test_legs_are_counted(self):
        """Elements on both sides of something that is smaller than half of an element, but not much, are counted in a line."""
        faces = two_rooms([])
        for k, (x, y) in enumerate(((1, 1), (3, 1), (1, 3), (3, 3))):
            for side in range(4):
                a, b = ([(-1, -1), (1, -1), (1, 1), (-1, 1)][s % 4] for s in (side, side + 1))
                (ax, ay), (bx, by) = ((x + .05 * u, y + .05 * v) for u, v in (a, b))
                faces[f"leg{k}{side}"] = numpy.array([[ax, ay, 0], [bx, by, 0], [bx, by, 1], [ax, ay, 1]])
        scene = self.write(faces)
        for edge, counted in (.3, True), (.2, False):
            log = must("precompute", scene, "-o", self.path("rooms.h5"), "--probes", 0, "--max-edge", edge).stderr
            told = re.search(r"(\d+) elements? lies? on both sides of a wall or a leg", log)
            self.assertEqual(told is not None, counted, log)
            if told:
                self.assertLessEqual(int(told[1]), 16)


if __name__ == "__main__":
    unittest.main()
