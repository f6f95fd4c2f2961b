"""Scenes of axis-parallel quadrilaterals, as files."""

import os

import numpy


def lines(begin, end, count, *through):
    """About count steps from begin to end, with lines at `through`, none of them between two of these."""
    marks = [begin, *through, end]
    found = [begin]
    for low, high in zip(marks, marks[1:]):
        inside = low != begin and high != end
        steps = 1 if inside else max(1, round(count * (high - low) / (end - begin)))
        found += list(numpy.linspace(low, high, steps + 1)[1:])
    return numpy.array(found)


class Quads:
    def __init__(self):
        self.faces, self.groups = [], []

    def grid(self, group, axis, at, sign, us, vs, hole=None):
        """Cells of the plane where `axis` has the value `at`, whose normal looks along it (1) or against it (-1); us and
        vs are lines along the next two axes, hole = (u0, u1, v0, v1) is left out."""
        for u0, u1 in zip(us, us[1:]):
            for v0, v1 in zip(vs, vs[1:]):
                u, v = (u0 + u1) / 2, (v0 + v1) / 2
                if hole and hole[0] < u < hole[1] and hole[2] < v < hole[3]:
                    continue
                corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
                self.faces.append([numpy.roll([at, u, v], axis) for u, v in corners[::sign]])
                self.groups.append(group)

    def box(self, name, low, high, counts, inward=1, holes=None):
        """The faces name0 to name5 of a box, seen from inside or, inward = -1, from outside; holes = {face: its hole}."""
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for side in range(2):
                hole = (holes or {}).get(2 * axis + side)
                us = lines(low[u], high[u], counts[u], *(hole[:2] if hole else ()))
                vs = lines(low[v], high[v], counts[v], *(hole[2:] if hole else ()))
                self.grid(f"{name}{2 * axis + side}", axis, (low, high)[side][axis], inward * (1 - 2 * side), us, vs, hole)

    def write(self, path, reflectance):
        with open(path, "w", encoding="ascii") as file:
            file.write(f"mtllib {os.path.basename(path)[:-3]}mtl\nusemtl grey\n")
            last = None
            for k, (group, corners) in enumerate(zip(self.groups, self.faces)):
                if group != last:
                    file.write(f"o {group}\n")
                last = group
                for corner in corners:
                    file.write("v %.9g %.9g %.9g\n" % tuple(corner))
                file.write("f %d %d %d %d\n" % tuple(range(4 * k + 1, 4 * k + 5)))
        with open(path[:-3] + "mtl", "w", encoding="ascii") as file:
            file.write(f"newmtl grey\nKd {reflectance} {reflectance} {reflectance}\n")
