#!/usr/bin/env python3
"""Light probes for Godot 4, from probes that Lambert has found with y up: a LightmapGIData, as a text resource.

    lambert precompute room.obj --probes-grid 1 --probes-y-up -o room.h5
    lambert solve room.h5 --sensors probes --json > probes.json
    probes_for_godot.py probes.json probes.tres [SCALE]

Put a LightmapGI at the origin of the scene and load probes.tres as its light data: objects whose Global Illumination mode is
Dynamic are lit by the probes about them. Godot multiplies what it gathers by the albedo alone, so that SCALE is 1 / pi for
radiances as Lambert has them; multiply it by the exposure that the scene needs.

Godot looks a point up in a tree of planes whose leaves are the tetrahedra between probes: these are Delaunay's, and a plane
is taken from their faces that cuts few of them and leaves as many on either side.
"""
import json
import math
import sys

import numpy as np
from scipy.spatial import Delaunay

EMPTY = -2 ** 31        # a side of a plane without tetrahedra
FACES = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))


def read(answer):
    """Points [n][3] and coefficients [n][9][3] of all probes of an answer that have a value."""
    points, nine = [], []
    for one in answer["sensors"]:
        if "coefficients" not in one:
            continue
        if one["axes"] != "y-up":
            raise ValueError(f'{one["name"]} is in the axes of its scene: give it "axes": "y-up"')
        for at, c in zip(one["at"], one["coefficients"]):
            if c is not None:  # else it lies in a wall
                points.append(at)
                nine.append(np.broadcast_to(c, (9, 3)))
    return np.array(points, float), np.array(nine, float)


def tetrahedra(points):
    """[t][4], without flat ones."""
    found = Delaunay(points).simplices
    edges = points[found[:, 1:]] - points[found[:, :1]]
    size = np.linalg.norm(edges, axis=2).max(axis=1)
    return found[abs(np.linalg.det(edges)) > 1e-6 * size ** 3]


def best_plane(points, corners, tolerance):
    """(normal, d) and two masks: tetrahedra that are not all behind the plane, and those not all in front of it."""
    best = (-1, None)
    for one in corners[:: max(1, len(corners) // 24)]:
        for a, b, c in (points[one[list(face)]] for face in FACES):
            normal = np.cross(b - a, c - a)
            length = np.linalg.norm(normal)
            if not length > 0:
                continue
            normal /= length
            height = (points[corners] - a) @ normal
            over, under = (height > tolerance).any(axis=1), (height < -tolerance).any(axis=1)
            n_over, n_under, n_both = over.sum(), under.sum(), (over & under).sum()
            if max(n_over, n_under) < len(corners):
                score = min(n_over - n_both, n_under - n_both) - n_both
                if best[1] is None or score > best[0]:
                    best = (score, (normal, normal @ a, over, under))
    return best[1]


def tree(points, cells):
    """Nodes (normal, d, over, under), each before its children: a node, - number of a tetrahedron - 1, or EMPTY."""
    nodes = []
    tolerance = 1e-4 * np.ptp(points, axis=0).max()

    def child(which):
        if len(which) == 0:
            return EMPTY
        plane = best_plane(points, cells[which], tolerance) if len(which) > 1 else None
        if plane is None:  # one, or some that no face parts
            return -int(which[0]) - 1
        normal, d, over, under = plane
        at = len(nodes)
        nodes.append(None)
        nodes[at] = (normal, d, child(which[over]), child(which[under]))
        return at

    if child(np.arange(len(cells))) < 0:  # one tetrahedron: a plane with all of it in front
        nodes.append((np.array([0., 1., 0.]), float(points[:, 1].min()) - 1, -1, -1))
    return nodes


def packed(name, values):
    return f"{name}({', '.join(format(v, '.9g') if isinstance(v, float) else str(v) for v in values)})"


def resource(points, nine, scale):
    """The text of the LightmapGIData."""
    cells = tetrahedra(points)
    bits = []
    for normal, d, over, under in tree(points, cells):
        bits += np.array([*normal, d], np.float32).view(np.int32).tolist() + [over, under]
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    colours = np.concatenate([nine * scale, np.ones((*nine.shape[:2], 1))], axis=2)
    lines = {"baked_exposure": "1.0", "bounds": packed("AABB", [*low.tolist(), *size.tolist()]),
             "bsp": packed("PackedInt32Array", bits), "interior": "true",
             "points": packed("PackedVector3Array", points.ravel().tolist()),
             "sh": packed("PackedColorArray", colours.ravel().tolist()),
             "tetrahedra": packed("PackedInt32Array", cells.ravel().tolist())}
    data = ",\n".join(f'"{key}": {value}' for key, value in lines.items())
    return f'[gd_resource type="LightmapGIData" format=3]\n\n[resource]\nprobe_data = {{\n{data}\n}}\n'


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        text = resource(*read(json.load(file)), float(sys.argv[3]) if len(sys.argv) > 3 else 1 / math.pi)
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write(text)
