#!/usr/bin/env python3
"""Rooms with windows as walls are modelled: the first light of an even sky on floors against Lambert's formula.

    tests/bench/windows.py build/release/lambert [ROOMS [SEED]]

Each room is a box of random size with 1 to 4 windows in its walls or its ceiling; walls are strips, grids, grids of triangles
or polygons with a seam. A line for each: the relative rms over floor elements, of 27 points of each, and how many have no
light. Elements and options take turns: 600 to 8,000; presets, --form-factors rays, --quality high."""

import pathlib
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "service"))
from polygon_factor import polygon_factor # noqa: E402

ELEMENTS = (600, 1200, 2500, 8000)
OPTIONS = ((), ("--form-factors", "rays"), ("--quality", "high"))
STYLES = ("strips", "grid", "triangles", "seam")


class Side:
    """A side of the room: the points origin + x u + y v, which look along u x v."""

    def __init__(self, name, origin, u, v, size):
        self.name, self.origin, self.axes, self.size = name, np.array(origin, float), np.array([u, v], float), size
        self.windows = []

    def points(self, corners):
        return [self.origin + np.array(c, float) @ self.axes for c in corners]


def rectangle(x0, x1, y0, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def sides_of(X, Y, Z):
    return [Side("floor", (0, 0, 0), (1, 0, 0), (0, 1, 0), (X, Y)), Side("ceiling", (0, 0, Z), (0, 1, 0), (1, 0, 0), (Y, X)),
            Side("south", (0, 0, 0), (0, 0, 1), (1, 0, 0), (Z, X)), Side("north", (0, Y, 0), (1, 0, 0), (0, 0, 1), (X, Z)),
            Side("west", (0, 0, 0), (0, 1, 0), (0, 0, 1), (Y, Z)), Side("east", (X, 0, 0), (0, 0, 1), (0, 1, 0), (Z, Y))]


def faces_of(side, style):
    """Polygons of a side around its windows."""
    W, H = side.size
    if not side.windows:
        return [rectangle(0, W, 0, H)]
    if style == "seam" and len(side.windows) == 1:
        a, b, c, d = side.windows[0]
        return [[*rectangle(0, W, 0, H), (0, 0), (a, c), (a, d), (b, d), (b, c), (a, c)]]
    xs = sorted({0, W, *(x for w in side.windows for x in w[:2])})
    ys = sorted({0, H, *(y for w in side.windows for y in w[2:])})
    made = []
    for y0, y1 in zip(ys, ys[1:]):
        row = []
        for x0, x1 in zip(xs, xs[1:]):
            x, y = (x0 + x1) / 2, (y0 + y1) / 2
            if any(a < x < b and c < y < d for a, b, c, d in side.windows):
                continue
            if style == "strips" and row and row[-1][1] == x0:
                row[-1] = (row[-1][0], x1) # as long as it goes: corners lie on edges of others
            else:
                row.append((x0, x1))
        made += [rectangle(x0, x1, y0, y1) for x0, x1 in row]
    if style == "triangles":
        made = [t for p in made for t in ([p[0], p[1], p[2]], [p[0], p[2], p[3]])]
    return made


def room(random):
    """Sides of a room with windows that do not touch each other, and the style of its walls."""
    X, Y, Z = random.uniform(3, 9), random.uniform(3, 12), random.uniform(2.4, 4)
    sides = sides_of(round(X, 2), round(Y, 2), round(Z, 2))
    style = STYLES[random.integers(len(STYLES))]
    for side in random.permutation(np.array(sides[1:], object))[:random.integers(1, 5)]:
        W, H = side.size
        kind = random.integers(3)
        w, h = (W * random.uniform(.5, .9), H * random.uniform(.1, .2)) if kind == 0 else (W * random.uniform(.15, .5), H * random.uniform(.2, .5))
        x, y = random.uniform(.05 * W, .95 * W - w), random.uniform(.1 * H, .95 * H - h)
        side.windows.append(tuple(round(float(v), 2) for v in (x, x + w, y, y + h)))
    return sides, style


def truth_of(sides, corners):
    """Means over elements by 27 x 27 points of the Gauss rule, each of 3 x 3 parts."""
    places, weights = np.array([.5 - np.sqrt(.15), .5, .5 + np.sqrt(.15)]), np.array([5, 8, 5]) / 18
    at = (np.arange(3)[:, None] + places[None]).ravel() / 3
    of = np.tile(weights / 3, 3)
    total = 0
    for u, wu in zip(at, of):
        for v, wv in zip(at, of):
            points = ((1 - u) * (1 - v) * corners[:, 0] + u * (1 - v) * corners[:, 1] + u * v * corners[:, 2] + (1 - u) * v * corners[:, 3])
            for side in sides:
                for window in side.windows:
                    total = total + wu * wv * polygon_factor(points, np.array([0, 0, 1]), side.points(rectangle(*window)))
    return total


def measure(program, sides, style, options, folder):
    """rms of the floor, elements without light, elements, processor seconds, lines about openings."""
    scene, store = folder / "room.obj", folder / "room.h5"
    lines, count = [], 0
    for side in sides:
        for face in faces_of(side, style):
            lines.append(f"o {side.name}")
            lines += ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in side.points(face)]
            lines.append("f " + " ".join(str(count + k + 1) for k in range(len(face))))
            count += len(face)
    scene.write_text("\n".join(lines) + "\n")
    begun = time.monotonic()
    subprocess.run([program, "precompute", scene, "-o", store, "--sky", "tregenza", "--ground-albedo", "1", "--probes", "0",
                    "--reflectance", ".5", "--quiet", *options], check=True)
    seconds = time.monotonic() - begun
    with h5py.File(store) as f:
        of = f["mesh/group"][:] == f["mesh/group_names"].asstr()[:].tolist().index("floor")
        elements = f["mesh/elements"][:][of]
        elements[:, 3] = np.where(elements[:, 3] == 0xFFFFFFFF, elements[:, 2], elements[:, 3])
        corners = f["mesh/vertices"][:][elements]
        area, seen = f["mesh/area"][:][of], f["sky/first_bounce"][:][:, of].sum(0) / np.pi
        total = f["mesh/area"].shape[0]
    truth = truth_of(sides, corners)
    rms = np.sqrt(np.average((seen - truth)**2, weights=area)) / np.average(truth, weights=area)
    return rms, int(np.count_nonzero(seen == 0)), total, seconds


def main():
    program, rooms = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 40
    random = np.random.default_rng(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    worst, dark = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for k in range(rooms):
            sides, style = room(random)
            options = ("--elements", str(ELEMENTS[k % len(ELEMENTS)]), *OPTIONS[k % len(OPTIONS)])
            rms, none, total, seconds = measure(program, sides, style, options, pathlib.Path(folder))
            worst, dark = max(worst, rms), dark + none
            where = ", ".join(s.name for s in sides if s.windows)
            print(f"{k + 1:3} {style:9} {where:32} {' '.join(options):44} {total:6} elements  rms {rms:.4f}  dark {none:3}  {seconds:5.1f} s", flush=True)
    print(f"largest rms {worst:.4f}; {dark} elements without light")


if __name__ == "__main__":
    main()
