#!/usr/bin/env python3
"""Writes a hall below a roof of patches that may become skylights, and its site, as files that `lambert precompute` reads.

The hall is 20 m x 20 m x 6 m, z up, north is +y. A tower of 40 m stands south-west of it and shades the roof for a part of the day.

    FOLDER/site.obj        outside: groups ground, tower, and the roof's patches roof-0-0 (south-west), roof-0-1 (north of it) and so on
    FOLDER/hall.obj        inside: groups floor, walls, and the same patches from below
    FOLDER/emitters.json   each patch alone, for `lambert precompute --emitters`
"""
import argparse
import json
import pathlib

from office import Room

SIZE, HEIGHT, TOWER = 20.0, 6.0, ((-14, -22), (4, -8))
COLOURS = {"roof": 0.7, "floor": 0.3, "walls": 0.6, "ground": 0.2, "tower": 0.4}


def patches(room, divisions, seen_from_below):
    step = SIZE / divisions
    for i in range(divisions):
        for j in range(divisions):
            x, y, X, Y = i * step, j * step, (i + 1) * step, (j + 1) * step
            corners = [(x, y, HEIGHT), (X, y, HEIGHT), (X, Y, HEIGHT), (x, Y, HEIGHT)]
            room.quad(f"roof-{i}-{j}", *(corners[::-1] if seen_from_below else corners))


def site(divisions):
    room = Room()
    room.box((*TOWER[0], 0), (*TOWER[1], 40), "tower")
    xs, ys = ([-40, low, 0, high, SIZE, 60] for low, high in zip(*TOWER))
    for x, X in zip(xs, xs[1:]):
        for y, Y in zip(sorted(ys), sorted(ys)[1:]):
            if not any(a <= x < A and b <= y < B for (a, b), (A, B) in (TOWER, ((0, 0), (SIZE, SIZE)))):  # nothing lies below them
                room.quad("ground", (x, y, 0), (X, y, 0), (X, Y, 0), (x, Y, 0))
    for (x, y), (u, v) in (((0, 0), (SIZE, 0)), ((SIZE, 0), (SIZE, SIZE)), ((SIZE, SIZE), (0, SIZE)), ((0, SIZE), (0, 0))):
        room.quad("walls", (x, y, 0), (u, v, 0), (u, v, HEIGHT), (x, y, HEIGHT))
    patches(room, divisions, False)
    return room


def hall(divisions):
    room = Room()
    room.quad("floor", (0, 0, 0), (SIZE, 0, 0), (SIZE, SIZE, 0), (0, SIZE, 0))
    for (x, y), (u, v) in (((0, 0), (0, SIZE)), ((0, SIZE), (SIZE, SIZE)), ((SIZE, SIZE), (SIZE, 0)), ((SIZE, 0), (0, 0))):
        room.quad("walls", (x, y, 0), (u, v, 0), (u, v, HEIGHT), (x, y, HEIGHT))
    patches(room, divisions, True)
    return room


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--divisions", type=int, default=10, choices=range(1, 31), metavar="1..30", help="patches of the roof along a side (preset 10)")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    site(options.divisions).write(options.folder / "site.obj", COLOURS)
    inside = hall(options.divisions)
    inside.write(options.folder / "hall.obj", COLOURS)
    alone = [{"groups": {name: 1}} for name in inside.faces if name.startswith("roof-")]
    (options.folder / "emitters.json").write_text(json.dumps({"emissions": alone}))


if __name__ == "__main__":
    main()
