#!/usr/bin/env python3
"""Writes an office whose lamps are to be chosen, as files that `lambert precompute` reads.

The office is 14.4 m x 9.6 m x 3 m, z up. It has desks in rows with a screen behind each, cupboards along a wall, and a lattice
of places for luminaires 0.2 m below its ceiling. At every place hang four luminaires of 6,000 lm, one for each distribution
of a catalogue: spot, narrow, wide, wings. The sensors are points on the desks, a set for each.

    FOLDER/office.obj, office.mtl   the room: groups floor, ceiling, walls, screens, cupboards, desk-1 and so on (their tops)
    FOLDER/lights.json, *.ies       the luminaires, called spot.0.0, spot.0.1 and so on by their place
    FOLDER/sensors.json             the sensors
"""
import argparse
import json
import math
import pathlib

SIZE, HANGING, LUMENS = (14.4, 9.6, 3.0), 2.8, 6000
COLOURS = {"floor": 0.25, "ceiling": 0.8, "walls": 0.6, "screens": 0.4, "cupboards": 0.5, "desk": 0.45, "below": 0.3}
CATALOGUE = {"spot": lambda c: c**8, "narrow": lambda c: c**3, "wide": lambda c: c, "wings": lambda c: c * (1.6 - c)}


class Room:
    """Faces by group; boxes have a top, sides and a bottom, each of a group."""

    def __init__(self):
        self.vertices, self.faces = [], {}

    def quad(self, group, *corners):
        self.faces.setdefault(group, []).append(range(len(self.vertices) + 1, len(self.vertices) + 5))
        self.vertices += corners

    def box(self, low, high, sides, top=None, bottom=None):
        (x, y, z), (X, Y, Z) = low, high
        self.quad(sides, (x, y, z), (X, y, z), (X, y, Z), (x, y, Z))
        self.quad(sides, (X, Y, z), (x, Y, z), (x, Y, Z), (X, Y, Z))
        self.quad(sides, (x, Y, z), (x, y, z), (x, y, Z), (x, Y, Z))
        self.quad(sides, (X, y, z), (X, Y, z), (X, Y, Z), (X, y, Z))
        self.quad(top or sides, (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z))
        if bottom:
            self.quad(bottom, (x, y, z), (x, Y, z), (X, Y, z), (X, y, z))

    def write(self, path, colours):
        """The groups as OBJ; a group desk-1 has the reflectance of desk."""
        with open(path, "w", encoding="ascii") as out:
            out.write(f"mtllib {path.stem}.mtl\n" + "".join("v %g %g %g\n" % v for v in self.vertices))
            for group, faces in self.faces.items():
                out.write(f"g {group}\nusemtl {group.split('-')[0]}\n" + "".join("f %d %d %d %d\n" % tuple(f) for f in faces))
        path.with_suffix(".mtl").write_text("".join(f"newmtl {m}\nKd {rho} {rho} {rho}\n" for m, rho in colours.items()))


def office(columns, rows):
    room, (X, Y, Z) = Room(), SIZE
    room.quad("floor", (0, 0, 0), (X, 0, 0), (X, Y, 0), (0, Y, 0))
    room.quad("ceiling", (0, 0, Z), (0, Y, Z), (X, Y, Z), (X, 0, Z))
    for (x, y), (u, v) in zip(((0, 0), (0, Y), (X, Y), (X, 0)), ((0, Y), (X, Y), (X, 0), (0, 0))):
        room.quad("walls", (x, y, 0), (u, v, 0), (u, v, Z), (x, y, Z))
    for k in range(3):
        room.box((0.02, 0.6 + 3 * k, 0), (0.52, 2.6 + 3 * k, 1.9), "cupboards")
    desks = []
    for i in range(columns):
        for j in range(rows):
            x, y = 1.2 + (X - 1.2) * (i + 0.5) / columns, Y * (j + 0.5) / rows
            desks.append(f"desk-{len(desks) + 1}")
            room.box((x - 0.8, y - 0.4, 0.71), (x + 0.8, y + 0.4, 0.75), "below", desks[-1], "below")
            room.box((x - 0.8, y + 0.45, 0.6), (x + 0.8, y + 0.5, 1.25), "screens", bottom="screens")
    return room, desks


def ies(intensity):
    """A table of candela by gamma, in steps of 5 degrees, of a luminaire 1.2 m long and 0.3 m wide."""
    angles = range(0, 91, 5)
    candela = " ".join(f"{1000 * max(intensity(math.cos(math.radians(a))), 0):.1f}" for a in angles)
    return f"IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {len(angles)} 1 1 2 .3 1.2 0\n1 1 30\n{' '.join(map(str, angles))}\n0\n{candela}\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--desks", default="4x3", help="columns x rows of desks (preset 4x3)")
    parser.add_argument("--lamps", default="6x4", help="columns x rows of places for luminaires (preset 6x4)")
    options = parser.parse_args()
    try:
        (columns, rows), (a, b) = (map(int, text.split("x")) for text in (options.desks, options.lamps))
        if min(columns, rows, a, b) < 1:
            raise ValueError
    except ValueError:
        parser.error(f"--desks {options.desks} --lamps {options.lamps}: both must be numbers of at least 1 with an x between")
    options.folder.mkdir(parents=True, exist_ok=True)
    room, desks = office(columns, rows)
    room.write(options.folder / "office.obj", COLOURS)
    dx, dy = SIZE[0] / a, SIZE[1] / b
    lights = [{"name": name, "file": name + ".ies", "flux": LUMENS, "from": [dx / 2, dy / 2, HANGING],
               "steps": [[dx, 0, 0], [0, dy, 0]], "counts": [a, b]} for name in CATALOGUE]
    for name, intensity in CATALOGUE.items():
        (options.folder / (name + ".ies")).write_text(ies(intensity))
    (options.folder / "lights.json").write_text(json.dumps({"luminaires": lights}, indent=1))
    grids = [{"name": desk, "over": desk, "height": 0.01, "spacing": 0.2, "border": 0.1} for desk in desks]
    (options.folder / "sensors.json").write_text(json.dumps({"grids": grids}, indent=1))


if __name__ == "__main__":
    main()
