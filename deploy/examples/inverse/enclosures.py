#!/usr/bin/env python3
"""Enclosures whose heat is known in closed form, beside the operator's.

The closed forms are those of textbooks (Hottel 1954): surfaces of one temperature and one radiosity each, between which heat flows
through resistances (1 - eps) / (eps A) at surfaces and 1 / (A F) between them. That is exact where all of a surface sees the same:
on a sphere, and in the operator of a mesh with one element for each face. Form factors F are those of rectangles in closed form.

    hood          a floor of a regular tetrahedron below its three other faces: two surfaces, F = 1
    tetrahedron   two faces at temperatures, two insulated: three surfaces, F = 1/3 between any two
    cube          floor and ceiling at temperatures, insulated walls: three surfaces, F = 0.199824895698 (C-11)
    three         the cube with three temperatures: floor, ceiling, walls
    room          10 m x 6 m x 3 m, a heated floor of 100 W/m2, a ceiling at a temperature, insulated walls
    spheres       of radii 1 and 2 about one centre, as polyhedra

It writes scenes and stores into FOLDER, by `lambert` of the PATH, and prints the largest difference of each in parts of the heat.
"""
import argparse
import pathlib
import subprocess
import sys

import numpy as np

import heat
import lambert

SIGMA = heat.SIGMA
CUBE, ROOM = 0.199824895698, 0.488700936440  # from the floor to the ceiling


def write(path, faces, eps):
    """Faces, corner by corner, of each group."""
    text, count = f"mtllib {path.stem}.mtl\n", 0
    for name, polygons in faces.items():
        text += f"g {name}\nusemtl {name}\n"
        for corners in polygons:
            text += "".join("v %.12g %.12g %.12g\n" % tuple(p) for p in corners)
            text += "f" + "".join(f" {count + k}" for k in range(1, len(corners) + 1)) + "\n"
            count += len(corners)
    path.write_text(text)
    path.with_suffix(".mtl").write_text("".join(f"newmtl {name}\nKd {1 - eps[name]:.9g} {1 - eps[name]:.9g} {1 - eps[name]:.9g}\n" for name in faces))


def box(x, y, z):
    """A floor, a ceiling and four walls, from within."""
    a, b, c, d = (0, 0), (x, 0), (x, y), (0, y)
    walls = [[(*p, 0), (*q, 0), (*q, z), (*p, z)] for p, q in ((a, d), (d, c), (c, b), (b, a))]
    return {"floor": [[(*p, 0) for p in (a, b, c, d)]], "ceiling": [[(*p, z) for p in (d, c, b, a)]], "walls": walls}


def tetrahedron(names):
    """Four faces that look inward, in groups of these names."""
    p = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], float)
    faces = {}
    for k, name in enumerate(names):
        a, b, c = np.delete(p, k, 0)
        faces.setdefault(name, []).append([a, b, c] if np.dot(np.cross(b - a, c - a), p[k] - a) > 0 else [a, c, b])
    return faces


def ball(levels, radius, inward):
    """An icosahedron whose faces are divided by four so often; its area is made that of the sphere."""
    g = (1 + 5**0.5) / 2
    p = [np.array(q) for q in ((-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
                               (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1))]
    unit = lambda v: v / np.linalg.norm(v)
    faces = [[unit(p[i]), unit(p[j]), unit(p[k])] for i in range(12) for j in range(i) for k in range(j)
             if all(abs(np.linalg.norm(p[a] - p[b]) - 2) < 1e-9 for a, b in ((i, j), (j, k), (k, i)))]
    for _ in range(levels):
        split = []
        for a, b, c in faces:
            ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
            split += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        faces = split
    area = sum(np.linalg.norm(np.cross(b - a, c - a)) / 2 for a, b, c in faces)
    size = radius * (4 * np.pi / area) ** 0.5
    return [[size * x for x in (f if (np.dot(np.cross(f[1] - f[0], f[2] - f[0]), f[0]) > 0) != inward else f[::-1])] for f in faces]


def two(T1, T2, e1, e2, ratio, F=1.0):
    """Heat of the first of two surfaces, W/m2; ratio is A1 / A2."""
    return SIGMA * (T1**4 - T2**4) / ((1 - e1) / e1 + 1 / F + ratio * (1 - e2) / e2)


def insulated(T1, T2, e1, e2, F):
    """Heat from one to the other of two surfaces of one size that see each other by F and all else insulated, W/m2."""
    return two(T1, T2, e1, e2, 1, F + (1 - F) / 2)


def network(F, eps, T):
    """Heat of surfaces of known temperatures, W/m2."""
    F, eps, black = np.array(F), np.array(eps), SIGMA * np.array(T) ** 4
    B = np.linalg.solve(np.eye(len(eps)) - (1 - eps)[:, None] * F, eps * black)
    return B - F @ B


def cases(levels):
    """Faces, emissivities, temperatures, heats, and the closed form of some heats or temperatures."""
    e = {"floor": 0.8, "ceiling": 0.6, "walls": 0.3}
    yield "hood", tetrahedron(["floor", "hood", "hood", "hood"]), {"floor": 0.9, "hood": 0.4}, {"floor": 350, "hood": 300}, {}, \
        {"floor": two(350, 300, 0.9, 0.4, 1 / 3)}
    q = insulated(400, 300, 0.7, 0.5, 1 / 3)
    yield "tetrahedron", tetrahedron(["hot", "cold", "rest", "rest"]), {"hot": 0.7, "cold": 0.5, "rest": 0.9}, {"hot": 400, "cold": 300}, \
        {"rest": 0}, {"hot": q, "cold": -q}
    q = insulated(330, 280, 0.8, 0.6, CUBE)
    yield "cube", box(1, 1, 1), e, {"floor": 330, "ceiling": 280}, {"walls": 0}, {"floor": q, "ceiling": -q}
    side = (1 - CUBE) / 4
    q = network([[0, CUBE, 1 - CUBE], [CUBE, 0, 1 - CUBE], [side, side, 1 - 2 * side]], list(e.values()), [330, 280, 300])
    yield "three", box(1, 1, 1), e, {"floor": 330, "ceiling": 280, "walls": 300}, {}, dict(zip(e, q))
    T = (100 / insulated(1, 0, 0.8, 0.6, ROOM) + 290**4) ** 0.25
    yield "room", box(10, 6, 3), e, {"ceiling": 290}, {"floor": 100, "walls": 0}, {"ceiling": -100, "floor K": T}
    q = two(500, 300, 0.5, 0.2, 1 / 4)
    yield "spheres", {"inner": ball(levels, 1, False), "outer": ball(levels, 2, True)}, {"inner": 0.5, "outer": 0.2}, \
        {"inner": 500, "outer": 300}, {}, {"inner": q, "outer": -q / 4}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--levels", type=int, default=2, help="how often faces of the spheres are divided by four (preset 2)")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for name, faces, eps, temperatures, heats, truth in cases(options.levels):
        scene, store = options.folder / f"{name}.obj", options.folder / f"{name}.h5"
        write(scene, faces, eps)
        subprocess.run(["lambert", "precompute", scene, "--mesh", "faces", "--method", "exact", "--quality", "high", "--probes", "0", "--closed",
                        "--quiet", "-o", store], check=True)
        T, q = heat.steady_state(lambert.Scene(store), temperatures, heats)
        off = max(abs((T[g[:-2]] if g.endswith(" K") else q[g]) / value - 1) for g, value in truth.items())
        print(f"{name:12} {sum(map(len, faces.values())):5} faces   differs by {off:.1e}")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, subprocess.CalledProcessError, lambert.LambertError) as error:
        sys.exit(f"enclosures.py: {error}")
