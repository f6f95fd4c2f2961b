#!/usr/bin/python3
"""An office with windows and furniture, or a furnished room with a lamp, as OBJ and MTL: what an architect's program exports.

    office.py [--room] [--turn DEGREES] [--desks N] -o SCENE.obj

Metres, z up, triangles, numbers of six decimals, one group a material. The office, 24 m x 12 m x 3 m, has eight panes in its
southern wall (groups window-1 to window-8), no lamps, and 24 desks with a screen and a chair whose seat and back are rounded:
about 21,000 triangles. The room, 5 m x 4 m x 2.6 m, has a lamp below its ceiling, a bed, a table, two chairs and a shelf.
"""
import argparse
import math
import pathlib

COLOURS = {"floor": (.3, .25, .2), "wall": (.7, .7, .68), "ceiling": (.8, .8, .8), "desk": (.5, .4, .3), "metal": (.4, .4, .42),
           "screen": (.05, .05, .05), "cushion": (.2, .3, .5), "window": (.1, .1, .1), "lamp": (.7, .7, .7), "shelf": (.6, .5, .4)}


class Scene:
    def __init__(self):
        self.vertices, self.faces = [], {}

    def quad(self, group, *corners):
        first = len(self.vertices)
        self.vertices += corners
        self.faces.setdefault(group, []).extend([(first, first + 1, first + 2), (first, first + 2, first + 3)])

    def box(self, group, low, high, below=True):
        (x, y, z), (X, Y, Z) = low, high
        self.quad(group, (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z))
        if below:
            self.quad(group, (x, y, z), (x, Y, z), (X, Y, z), (X, y, z))
        self.quad(group, (x, y, z), (X, y, z), (X, y, Z), (x, y, Z))
        self.quad(group, (X, Y, z), (x, Y, z), (x, Y, Z), (X, Y, Z))
        self.quad(group, (x, Y, z), (x, y, z), (x, y, Z), (x, Y, Z))
        self.quad(group, (X, y, z), (X, Y, z), (X, Y, Z), (X, y, Z))

    def cushion(self, group, centre, size, around=20, along=11):
        """A body that is round at its edges: x^4 + y^4 + z^4 = 1, scaled."""
        def at(i, j):
            u, v = 2 * math.pi * i / around, math.pi * (j / along - .5)
            way = (math.cos(v) * math.cos(u), math.cos(v) * math.sin(u), math.sin(v))
            norm = sum(x ** 4 for x in way) ** .25
            return tuple(c + s / 2 * x / norm for c, s, x in zip(centre, size, way))
        for i in range(around):
            for j in range(along):
                a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
                first = len(self.vertices)
                self.vertices += [a, b, c, d]
                self.faces.setdefault(group, []).extend(([(first, first + 1, first + 2)] if j > 0 else []) +
                                                        ([(first, first + 2, first + 3)] if j < along - 1 else []))

    def chair(self, x, y, side):
        self.cushion("cushion", (x, y, .46), (.46, .46, .08))
        self.cushion("cushion", (x, y + side * .24, .78), (.44, .06, .44))
        for dx in -.18, .18:
            for dy in -.18, .18:
                self.box("metal", (x + dx - .015, y + dy - .015, 0), (x + dx + .015, y + dy + .015, .42), below=False)

    def table(self, x, y, width, depth):
        self.box("desk", (x, y, .71), (x + width, y + depth, .74))
        for dx in .05, width - .09:
            for dy in .05, depth - .09:
                self.box("metal", (x + dx, y + dy, 0), (x + dx + .04, y + dy + .04, .70), below=False)

    def shell(self, X, Y, Z, panes):
        """Six sides that look inward; the southern one around panes (x from, x to), from .9 to 2.4 m."""
        self.quad("floor", (0, 0, 0), (X, 0, 0), (X, Y, 0), (0, Y, 0))
        self.quad("ceiling", (0, 0, Z), (0, Y, Z), (X, Y, Z), (X, 0, Z))
        self.quad("wall", (0, Y, 0), (X, Y, 0), (X, Y, Z), (0, Y, Z))
        self.quad("wall", (0, 0, 0), (0, Y, 0), (0, Y, Z), (0, 0, Z))
        self.quad("wall", (X, Y, 0), (X, 0, 0), (X, 0, Z), (X, Y, Z))
        low, high = (.9, 2.4) if panes else (Z, Z)

        def south(group, x, X, z, Z):
            self.quad(group, (X, 0, z), (x, 0, z), (x, 0, Z), (X, 0, Z))
        south("wall", 0, X, 0, low)
        if not panes:
            return
        south("wall", 0, X, high, Z)
        edges = [0] + [x for pane in panes for x in pane] + [X]
        for k in range(0, len(edges), 2):
            south("wall", edges[k], edges[k + 1], low, high)
        for k, pane in enumerate(panes):
            south(f"window-{k + 1}", *pane, low, high)

    def write(self, path, degrees):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        kinds = {group: group.split("-", maxsplit=1)[0] for group in self.faces}
        with open(path, "w", encoding="utf-8") as out:
            out.write(f"mtllib {path.with_suffix('.mtl').name}\n")
            out.writelines(f"v {c * x - s * y:.6f} {s * x + c * y:.6f} {z:.6f}\n" for x, y, z in self.vertices)
            for group, faces in self.faces.items():
                out.write(f"g {group}\nusemtl {kinds[group]}\n")
                out.writelines(f"f {a + 1} {b + 1} {d + 1}\n" for a, b, d in faces)
        with open(path.with_suffix(".mtl"), "w", encoding="utf-8") as out:
            for kind in sorted(set(kinds.values())):
                light = "Ke 10 9 7\n" if kind == "lamp" else ""
                out.write("newmtl {}\nKd {} {} {}\n{}".format(kind, *COLOURS[kind], light))


def office(desks):
    scene = Scene()
    scene.shell(24, 12, 3, [(.6 + 3 * k, 2.8 + 3 * k) for k in range(8)])
    for k in range(desks):
        x, y = 1 + 3.6 * (k % 6), 1.4 + 2.6 * (k // 6)
        scene.table(x, y, 1.6, .8)
        scene.box("screen", (x + .5, y + .15, .745), (x + 1.1, y + .18, 1.2))
        scene.chair(x + .8, y + 1.1, 1)
    return scene


def room():
    scene = Scene()
    scene.shell(5, 4, 2.6, [])
    scene.box("lamp", (2.3, 1.8, 2.3), (2.7, 2.2, 2.35))
    scene.box("desk", (.1, .1, 0), (2.1, 1.1, .35), below=False)
    scene.cushion("cushion", (1.1, .6, .45), (1.96, .96, .18))
    scene.table(3.2, 1.2, 1.4, .8)
    scene.chair(3.6, 2.35, 1)
    scene.chair(4.2, .85, -1)
    for k in range(5):
        scene.box("shelf", (.4, 3.6, .05 + .45 * k), (1.6, 3.95, .08 + .45 * k))
    return scene


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--room", action="store_true")
    parser.add_argument("--turn", type=float, default=0)
    parser.add_argument("--desks", type=int, default=24)
    parser.add_argument("-o", dest="output", type=pathlib.Path, required=True)
    options = parser.parse_args()
    scene = room() if options.room else office(options.desks)
    scene.write(options.output, options.turn)
    print(f"{options.output}: {sum(map(len, scene.faces.values()))} faces")


main()
