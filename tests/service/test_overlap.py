"""Faces that are written twice are dropped, faces that overlap in one plane are cut so that each place belongs to one, and
where that would make too many parts they are named, and stated errors contain them.

The room is of 4 x 4 x 3 m with a lamp under its ceiling; the truth about one floor is the room with one floor, and about a
rug in the floor's plane a floor with a hole that the rug fills."""

import json
import unittest

import h5py
import numpy

from case import Case
from command import must
from quads import Quads


def room(path, second=None, rug=None, hole=False, scattered=0, half=False, without=(), reflectance=.7, lamp=True):
    """second: of the floor, as the number of its squares along each side; rug: its height; hole: in the floor below it, along
    the lines of which all is divided. scattered: squares on a floor of one face, along each side. half: of the floor, again, in
    finer squares; without: squares of the floor from low to high that are left out."""
    quads = Quads()
    at = numpy.linspace(1.1, 2.9, 4)
    floor = {"holes": {4: (1.1, 2.9, 1.1, 2.9)}} if hole else {}
    quads.box("r", (0, 0, 0), (4, 4, 3), (1, 1, 1) if scattered else (5, 5, 3), **floor)
    if lamp:
        quads.grid("lamp", 2, 2.9, -1, numpy.linspace(1.5, 2.5, 3), numpy.linspace(1.5, 2.5, 3))
    if second:
        quads.grid("second", 2, 0, 1, numpy.linspace(0, 4, second + 1), numpy.linspace(0, 4, second + 1))
    if rug is not None:
        quads.grid("rug", 2, rug, 1, at, at)
    if half:
        quads.grid("half", 2, 0, 1, numpy.linspace(0, 1.6, 5), numpy.linspace(0, 4, 11))
    for low, high in without:
        inside = [group == "r4" and (low < numpy.mean(face, 0)[:2]).all() and (numpy.mean(face, 0)[:2] < high).all()
                  for group, face in zip(quads.groups, quads.faces)]
        quads.groups, quads.faces = ([x for x, out in zip(of, inside) if not out] for of in (quads.groups, quads.faces))
    for x in 4 * numpy.arange(scattered) / max(scattered, 1):
        for y in 4 * numpy.arange(scattered) / scattered:
            quads.grid("tiles", 2, 0, 1, x + 2 / scattered * numpy.array([.5, 1.5]), y + 2 / scattered * numpy.array([.5, 1.5]))
    quads.write(path, reflectance)


def stated(answer, group):
    """Of a mean; null says that nothing is known of its light."""
    error = answer["error"]["groups"][group]["mean"]
    return numpy.inf if error is None else error


def turned(path, decimals):
    """Turns the scene of a file by a rotation of no meaning, and rounds it."""
    q, _ = numpy.linalg.qr(numpy.random.default_rng(3).normal(size=(3, 3)))
    q *= numpy.linalg.det(q)
    with open(path, encoding="ascii") as file:
        lines = file.read().splitlines()
    with open(path, "w", encoding="ascii") as file:
        for line in lines:
            if line.startswith("v "):
                line = "v " + " ".join(f"{x:.{decimals}f}" for x in q @ [float(x) for x in line.split()[1:]])
            file.write(line + "\n")


class Overlap(Case):
    def make(self, name, *options, **how):
        room(self.path(name + ".obj"), **how)
        done = must("precompute", self.path(name + ".obj"), "-o", self.path(name + ".h5"), "--probes", 4, "--threads", 1,
                    *options)
        return done.stderr

    def answer(self, name, *emit):
        options = [x for e in emit for x in ("--emit", e)]
        groups = [x for g in ("r0", "r2", "r4", "r5") for x in ("--reduce", f"{g}=mean")]
        done = must("solve", self.path(name + ".h5"), *options, "--quantity", "irradiance", *groups, "--json")
        return json.loads(done.stdout)

    def off(self, true, found):
        """By how much each group is off, and what is stated of it."""
        for group, mean in found["groups"].items():
            truth = true["groups"][group]["mean"]
            yield group, abs(mean["mean"] - truth) / mean["mean"], stated(found, group)

    def test_a_floor_that_is_written_twice_is_one(self):
        self.make("one")
        log = self.make("twice", second=5)
        self.assertIn("25 faces repeat another one and are dropped (second 25; the first at ", log)
        self.assertIn("25 of them have another group or material", log)
        for emit in ("lamp=10", "r2=1"):
            one, twice = self.answer("one", emit), self.answer("twice", emit)
            self.assertEqual(one["groups"], twice["groups"])
            self.assertEqual(one["error"], twice["error"])
        with h5py.File(self.path("one.h5")) as one, h5py.File(self.path("twice.h5")) as twice:
            for name in ("mesh/elements", "mesh/vertices", "mesh/group_names", "error/by_group/rms_many"):
                self.assertEqual(one[name][()].tolist(), twice[name][()].tolist())
            self.assertNotIn("overlap", twice["mesh"])
            self.assertNotIn("repair", twice["error"].attrs)
        self.assertIn("has the same geometry", must("verify", self.path("twice.h5"), self.path("twice.obj")).stdout)

    def same(self, name, other, *lights, atol=1e-5):
        for emit in lights:
            one, two = self.answer(name, emit), self.answer(other, emit)
            for group, mean in one["groups"].items():
                self.assertAlmostEqual(mean["mean"], two["groups"][group]["mean"], delta=atol, msg=(emit, group))

    def test_a_face_under_the_tiles_goes(self):
        """By all sorts of form factors the room is the one meant."""
        for options in (("--rays", 256), ("--form-factors", "hemicube"),
                        ("--method", "hierarchical", "--form-factors", "blocks"), ()):
            self.make("one", *options)
            log = self.make("under", *options, second=1)
            self.assertIn("1 face is cut where others cover the same place, by 16 m2 in all (second 16 m2; ", log)
            self.assertIn("; nothing is left of 1\n", log)
            self.same("one", "under", "lamp=10", "r0=1")
        with h5py.File(self.path("under.h5")) as file:
            self.assertNotIn("overlap_area", file["mesh"].attrs)
            self.assertNotIn("repair", file["error"].attrs)
        self.assertIn(" where others cover the same place, by 16 m2", must("classify", self.path("under.obj")).stderr)
        self.assertIn("has the same geometry", must("verify", self.path("under.h5"), self.path("under.obj")).stdout)
        log = self.make("finer", second=12) # the first of two surfaces of one size
        self.assertIn("144 faces are cut where others cover the same place, by 16 m2 in all (second 16 m2; ", log)
        self.make("one")
        self.same("one", "finer", "lamp=10", "r0=1")

    def test_a_half_that_is_written_twice(self):
        """Also by faces of the scene, turned at random with six decimals."""
        self.make("meant", half=True, without=[((0, 0), (1.6, 4))])
        log = self.make("half", half=True)
        self.assertIn("10 faces are cut where others cover the same place, by 6.4 m2 in all (r4 6.4 m2; ", log)
        self.same("meant", "half", "lamp=10", "r0=1", "half=1")
        for name in "meant", "half":
            turned(self.path(name + ".obj"), 6)
            must("precompute", self.path(name + ".obj"), "-o", self.path(name + ".h5"), "--probes", 4, "--threads", 1)
        self.same("meant", "half", "lamp=10", "r0=1", "half=1")

    def test_a_rug_in_the_plane_of_the_floor(self):
        """The floor has no light below the rug, whichever way it is divided; presets, with errors of the mesh below .01."""
        log = self.make("rug", "--elements", 2000, rug=0)
        self.make("hole", "--elements", 2000, rug=0, hole=True)
        self.assertIn("by 3.24 m2 in all (r4 3.24 m2; ", log)
        self.same("rug", "hole", "lamp=10", "rug=1", "r0=1", atol=.004)
        with h5py.File(self.path("rug.h5")) as rug, h5py.File(self.path("hole.h5")) as hole:
            areas = [numpy.bincount(f["mesh/group"][:], f["mesh/area"][:]) for f in (rug, hole)]
        numpy.testing.assert_allclose(areas[0], areas[1], rtol=1e-9)

    def test_too_many_parts_are_named_and_stated(self):
        """676 squares on a floor of one face: walls are off by what overlaps, and more than half of that is stated."""
        log = self.make("tiles", "--elements", 10, "--quality", "draft", scattered=26)
        self.make("plain", "--elements", 10, "--quality", "draft")
        self.assertIn("677 faces overlap others in one plane, 4 m2 in all (r4 4 m2, tiles 4 m2; ", log)
        with h5py.File(self.path("tiles.h5")) as file:
            self.assertAlmostEqual(file["mesh"].attrs["overlap_area"], 4, places=6)
            overlap = dict(zip(file["mesh/group_names"].asstr()[:], file["mesh/overlap"][:]))
            self.assertEqual({g for g, share in overlap.items() if share > 0}, {"r4", "tiles"})
            # Half of the 8 m2 of both, of 36 (floor, tiles, ceiling) + 48 (walls) + 1 (lamp), over (1 - .7)^1/2.
            self.assertGreater(file["error"].attrs["repair"], .99 * 4 / 85 / .3**.5)
        for emit in ("lamp=10", "r0=1"):
            for group, off, known in self.off(self.answer("plain", emit), self.answer("tiles", emit)):
                self.assertGreater(known, off / 2, (emit, group))
        shown = json.loads(must("info", self.path("tiles.h5"), "--json").stdout)
        self.assertAlmostEqual(shown["overlap_area"], 4, places=6)
        text = must("info", self.path("tiles.h5")).stdout
        self.assertRegex(text, r"overlap +4 m2 of faces in one plane count twice")
        for sort in ("single", "random", "whole"):
            self.assertGreater(shown["error"][sort]["total_indirect_mean"], .03)
        self.assertIn(" overlap others in one plane, 4 m2", must("classify", self.path("tiles.obj")).stderr)

    def test_an_open_scene_has_no_row_to_repair(self):
        """A floor and a wall: no row sums to more than 1, and what overlaps is stated nevertheless."""
        for name in ("alone", "doubled"):
            quads = Quads()
            quads.grid("floor", 2, 0, 1, numpy.array([0, 4]), numpy.array([0, 4]))
            quads.grid("wall", 0, 0, 1, numpy.linspace(0, 4, 6), numpy.linspace(0, 3, 4))
            for x in numpy.linspace(0, 4, 27)[:-1] if name == "doubled" else ():
                for y in numpy.linspace(0, 4, 27)[:-1]:
                    quads.grid("tiles", 2, 0, 1, x + numpy.array([.01, .14]), y + numpy.array([.01, .14]))
            quads.write(self.path(name + ".obj"), .7)
            must("precompute", self.path(name + ".obj"), "-o", self.path(name + ".h5"), "--probes", 4, "--elements", 10,
                 "--threads", 1, "--sky", "grid:4x2", "--quality", "draft")
        numpy.save(self.path("sky.npy"), numpy.ones((1, 8), "f4"))
        means = []
        for name in ("alone", "doubled"):
            done = must("solve", self.path(name + ".h5"), "--sky", self.path("sky.npy"), "--quantity", "indirect",
                        "--reduce", "wall=mean", "--json")
            means.append(json.loads(done.stdout))
        true, found = (numpy.ravel(x["groups"]["wall"]["mean"])[0] for x in means)
        self.assertGreater(abs(found - true), .1 * true)
        self.assertGreater(stated(means[1], "wall"), abs(found - true) / found / 2)
        self.assertGreater(means[1]["error"]["relative_mean"], .1) # of all light, of which some is known

    def test_backs_overlap_as_their_fronts(self):
        self.make("backs", "--two-sided", "--elements", 10, "--quality", "draft", scattered=26)
        with h5py.File(self.path("backs.h5")) as file:
            overlap = dict(zip(file["mesh/group_names"].asstr()[:], file["mesh/overlap"][:], strict=True))
            self.assertAlmostEqual(file["mesh"].attrs["overlap_area"], 4, places=6)
        self.assertEqual({g for g, share in overlap.items() if share > 0}, {"r4", "tiles", "r4.back", "tiles.back"})
        self.assertEqual(overlap["r4.back"], overlap["r4"])

    def test_positions_state_it_too(self):
        """Walks meet either of two faces; the floor is off by as much as is stated in a room with both."""
        light = self.path("light.json")
        with open(light, "w", encoding="ascii") as file:
            json.dump({"light": {"polygon": [[-.5, .5, 0], [.5, .5, 0], [.5, -.5, 0], [-.5, -.5, 0]], "emission": 10},
                       "positions": [{"name": "a", "move": [2, 2, 2.9]}, {"name": "b", "move": [1, 1, 2.9]}]}, file)
        figures = []
        for name, scattered in (("one", 0), ("tiles", 26)):
            room(self.path(name + ".obj"), scattered=scattered, lamp=False)
            done = must("precompute", self.path(name + ".obj"), "-o", self.path(name + ".h5"), "--positions", light, "--paths", 20000,
                        "--elements", 10)
            figures.append(json.loads(must("solve", self.path(name + ".h5"), "--emit", "a=1", "--quantity", "irradiance",
                                           "--reduce", "r0=mean", "--reduce", "r4=mean", "--json").stdout))
        self.assertIn(" overlap others in one plane, 4 m2", done.stderr)
        self.assertLess(stated(figures[0], "r0"), .05)
        self.assertGreater(stated(figures[1], "r0"), .07)
        self.assertGreater(stated(figures[1], "r4"), .3)

    def test_scenes_without_such_faces_state_none(self):
        log = self.make("one")
        self.assertNotIn("overlap", log)
        self.assertNotIn("coincide", log)
        with h5py.File(self.path("one.h5")) as file:
            self.assertNotIn("repair", file["error"].attrs)
            self.assertNotIn("overlap_area", file["mesh"].attrs)


if __name__ == "__main__":
    unittest.main()
