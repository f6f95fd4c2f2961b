"""Light where it is hard: through a skylight of a large hall, a window, a hole between two rooms, doors, and between houses.
Means of groups are off by at most twice what the answer states for them, against other form factors, taken exactly."""

import json
import os
import unittest

import h5py
import numpy

from case import Case
from command import LAMBERT, REFERENCE, SMALL, must
from quads import Quads

TRUTH = "--method", "exact", "--quality", "high", "--seed", 77, "--probes", 0, "--quiet"


def polygon_factors(points, normal, polygon):
    """Form factors from points with a normal to a polygon in front of them (Lambert 1760): sum of angles times the cosine."""
    total = numpy.zeros(len(points))
    for p, q in zip(polygon, numpy.roll(polygon, -1, axis=0)):
        a, b = p - points, q - points
        a /= numpy.linalg.norm(a, axis=1)[:, None]
        b /= numpy.linalg.norm(b, axis=1)[:, None]
        across = numpy.cross(a, b)
        length = numpy.linalg.norm(across, axis=1)
        angle = numpy.arctan2(length, (a * b).sum(1))
        total += angle * (across @ normal) / numpy.maximum(length, 1e-300)
    return abs(total) / (2 * numpy.pi)


class HardLight(Case):
    def precompute(self, scene, name, *options, program=LAMBERT):
        store = self.path(name)
        must("precompute", scene, "-o", store, "--quiet", *options, program=program)
        return store

    def truth(self, scene, *options):
        return self.precompute(scene, "truth.h5", *options, *TRUTH, program=REFERENCE)

    def ratios(self, store, reference, groups, *light):
        """|error| of each group's mean of the radiosity over twice what is stated for it; 0 where any error is stated to be
        possible. Groups that get nothing of the light that bounces have neither."""
        reduce = [word for group in groups for word in ("--reduce", f"{group}=mean")]
        asked = json.loads(must("solve", store, *light, *reduce, "--json").stdout)
        truth, bounced = (json.loads(must("solve", reference, *light, *reduce, "--json", *more,
                                          program=REFERENCE).stdout)["groups"]
                          for more in ((), ("--quantity", "indirect")))
        self.assertEqual(asked["error"]["light"], "own")
        found = {}
        for group in groups:
            stated = asked["error"]["groups"][group]["mean"]
            if bounced[group]["mean"] > 0:
                off = abs(asked["groups"][group]["mean"] - truth[group]["mean"]) / bounced[group]["mean"]
                found[group] = 0 if stated is None else off / (2 * stated)
        self.assertGreater(len(found), 0)
        return found

    def within(self, found, what):
        worst = max(found, key=found.get)
        self.assertLessEqual(found[worst], 1, f"{what}: {worst} of {found}")

    def lamp(self, which):
        """An emission of 1 of the elements in a mask."""
        numpy.save(self.path("lamp.npy"), which.astype(numpy.float32))
        return "--emission", self.path("lamp.npy")

    def sky(self, radiances):
        numpy.save(self.path("sky.npy"), numpy.asarray(radiances, dtype=numpy.float32))
        return "--sky", self.path("sky.npy")

    def bounce_is_right(self, H0, truth, area):
        off = numpy.sqrt((area * (H0 - truth) ** 2).sum() / (area * truth ** 2).sum())
        self.assertLess(off, .01)

    def test_a_skylight_of_a_large_hall(self):
        """Of 1 m2, a share of 4e-5 of all area; what elements see of it is known exactly."""
        hall, scene = Quads(), self.path("hall.obj")
        hall.box("f", (0, 0, 0), (100, 100, 8), (7, 7, 1) if SMALL else (13, 13, 2), holes={5: (49.5, 50.5, 49.5, 50.5)})
        hall.write(scene, .5)
        store = self.precompute(scene, "hall.h5", "--probes", 16, "--sky", "tregenza")
        reference = self.truth(scene, "--sky", "tregenza")
        with h5py.File(store) as file:
            H0, area = file["sky/first_bounce"][:].sum(0), file["mesh/area"][:]
        hole = numpy.array([[49.5, 49.5, 8], [50.5, 49.5, 8], [50.5, 50.5, 8], [49.5, 50.5, 8]])
        places = (numpy.arange(8) + .5) / 8
        u, v = (x.ravel()[:, None] for x in numpy.meshgrid(places, places))
        truth = numpy.zeros_like(H0)
        for i, (a, b, _, d) in enumerate(hall.faces):
            normal = numpy.cross(b - a, d - a)
            if hall.groups[i] != "f5":  # the ceiling
                points = a + u * (b - a) + v * (d - a)
                truth[i] = numpy.pi * polygon_factors(points, normal / numpy.linalg.norm(normal), hole).mean()
        self.bounce_is_right(H0, truth, area)
        self.within(self.ratios(store, reference, sorted(set(hall.groups)), *self.sky(numpy.ones(145))), "even sky")

    def test_a_window_of_a_furnished_room(self):
        room, scene = Quads(), self.path("room.obj")
        room.box("wall", (0, 0, 0), (6, 4, 3), (6, 4, 3) if SMALL else (12, 8, 6), holes={0: (1.25, 2.75, 1, 2.2)})
        room.box("table", (1.2, 1, .72), (2.8, 1.9, .76), (6, 4, 1), inward=-1)
        room.box("cabinet", (3.4, 3.3, .001), (5.2, 3.95, 1.9), (5, 2, 5), inward=-1)
        room.box("seat", (4.2, .3, .001), (5, 1.1, .45), (3, 3, 2), inward=-1)
        room.write(scene, .6)
        options = "--sky", "tregenza", "--ground-albedo", 1
        store = self.precompute(scene, "room.h5", "--probes", 16, "--method", "hierarchical", *options)
        reference = self.truth(scene, *options)
        with h5py.File(store) as one, h5py.File(reference) as other:
            self.bounce_is_right(one["sky/first_bounce"][:].sum(0), other["sky/first_bounce"][:].sum(0), one["mesh/area"][:])
        groups, found = sorted(set(room.groups)), []
        for radiances in (numpy.ones(145), numpy.random.default_rng(1).uniform(.2, 1, 145), numpy.eye(145)[40], numpy.eye(145)[20]):
            found += self.ratios(store, reference, groups, *self.sky(radiances)).values()
        # A group of a few elements may err more under one sky than the judge saw: 19 of 20 do not.
        self.assertLessEqual(numpy.quantile(found, .95), 1, found)

    def test_a_hole_between_two_rooms(self):
        """Of .1 m: the rooms are dark for each other's light. Of .5 m they have some."""
        for size in (.5,) if SMALL else (.1, .5):
            rooms, scene, cells = Quads(), self.path("rooms.obj"), (3, 4, 4) if SMALL else (6, 7, 7)
            low, high = (2 - size / 2, 1.5 - size / 2), (2 + size / 2, 1.5 + size / 2)
            hole = (low[0], high[0], low[1], high[1])
            rooms.box("a", (0, 0, 0), (4, 4, 3), cells, holes={1: hole})
            rooms.box("b", (4.02, 0, 0), (8.02, 4, 3), cells, holes={0: hole})
            for axis in 1, 2:
                for side, at in enumerate((low[axis - 1], high[axis - 1])):
                    us, vs = ((low[1], high[1]), (4, 4.02)) if axis == 1 else ((4, 4.02), (low[0], high[0]))
                    rooms.grid("rim", axis, at, 1 - 2 * side, us, vs)
            rooms.write(scene, .7)
            store = self.precompute(scene, "rooms.h5", "--probes", 16, "--method", "hierarchical")
            reference = self.truth(scene)
            ceiling = numpy.flatnonzero(numpy.array(rooms.groups) == "b5")
            some = numpy.isin(numpy.arange(len(rooms.groups)), ceiling[len(ceiling) // 2 - 2:len(ceiling) // 2 + 2])
            groups = [name + str(k) for name in "ab" for k in range(6)]
            for light in self.lamp(some), ("--emit", "b5=1"):
                self.within(self.ratios(store, reference, groups, *light), f"hole of {size} m, {light}")

    def generated(self, kinds, lights, *words):
        """The scene of `lambert generate`, by several kinds; lights = {name: of the groups of elements, options}."""
        scene = self.path("scene.obj")
        must("generate", *words, "-o", scene)
        reference = self.truth(scene)
        with h5py.File(reference) as file:
            group = numpy.array([file["mesh/group_names"][k].decode() for k in file["mesh/group"][:]])
        for kind in kinds:
            store = self.precompute(scene, "asked.h5", "--probes", 16, "--method", kind)
            for light in lights:
                self.within(self.ratios(store, reference, sorted(set(group)), *light(group)), f"{kind} {words[0]}")

    def test_rooms_behind_doors(self):
        def six(group):
            ceiling = numpy.flatnonzero(group == "ceiling")
            return self.lamp(numpy.isin(numpy.arange(len(group)), ceiling[:6]))

        self.generated(["hierarchical", "low-rank"], [six, lambda _: ("--emit", "lamp-1=1")],
                       "rooms", "--elements", 300 if SMALL else 1100)

    def test_streets_of_a_city(self):
        self.generated(["sparse"], [lambda group: self.lamp(numpy.arange(len(group)) // 4 == len(group) // 8)],
                       "city", "--elements", 300 if SMALL else 900)

    def test_bright_walls(self):
        """A closed box of reflectance rho in which all elements emit: B = E / (1 - rho), rho in single precision."""
        box, scene, rho = Quads(), self.path("closed.obj"), .99
        box.box("f", (0, 0, 0), (1, 1, 1), [3 if SMALL else 5] * 3)  # the sparse inverse follows 2,000 bounces of each element
        box.write(scene, rho)
        numpy.save(self.path("E.npy"), numpy.ones(len(box.faces), numpy.float32))
        for kind in "exact", "hierarchical", "low-rank", "2msc", "sparse":
            store = self.precompute(scene, "closed.h5", "--probes", 16, "--method", kind)
            must("solve", store, "--emission", self.path("E.npy"), "-o", self.path("B.json"))
            with open(self.path("B.json"), encoding="ascii") as file:
                answer = json.load(file)
            off = numpy.array(answer["radiosity"]) * (1 - float(numpy.float32(rho))) - 1
            # Numbers of single precision are off by 1 / (1 - rho) times its rounding.
            rounding = 2.0**-24 / (1 - rho)
            self.assertLessEqual(numpy.sqrt((off**2).mean()), 2 * answer["error"]["relative_mean"] + rounding, kind)


if __name__ == "__main__":
    unittest.main()
