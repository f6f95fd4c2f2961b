#!/usr/bin/env python3
"""A scene of which only some groups are read, or emit: what --receivers and --sources save, and what the light errs by.

    receivers.py [--lambert PROGRAM] [--scene OBJ] [--receivers GROUP,...] [--sources GROUP,...] [--elements N] [--folder DIR]
                 [--rounds R] [EPSILON ...]

builds operators of a scene (preset: an office whose desks are read) without these options, with each of them that is given,
and with both, at each epsilon (preset .05 and .1), in turn, --probes 0, and prints processor seconds (the least of R
rounds), bytes of the operator and errors as CSV: |B~ - B| / |B - E| over what is read (with --receivers) and over all
elements, of the scene's lamps, of two random emissions, and of 48 single elements together; and of light that the sources
alone emit (without --sources: the receivers): the scene's lamps among them, uniform, two random, 24 single ones. The
reference is converged with blocks of a tenth of the bound or less, kept in DIR (preset: a folder that is removed).
"""
import argparse
import os
import pathlib
import resource
import subprocess
import tempfile

import h5py
import numpy

WIDTH, DEPTH, HEIGHT = 8., 6., 3.
MATERIALS = {"floor": (.3, 0), "white": (.8, 0), "wall": (.6, 0), "wood": (.4, 0), "lamp": (.6, 40)}


class Office:
    """Quadrilaterals of a closed room, z up; all fronts see the room."""

    def __init__(self):
        self.corners, self.faces = [], []

    def rectangle(self, group, material, axis, level, low, high, positive):
        """low, high: on the two axes after `axis`."""
        u, v = (axis + 1) % 3, (axis + 2) % 3
        loop = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        first = len(self.corners) + 1
        for a, b in loop if positive else reversed(loop):
            at = [level] * 3
            at[u], at[v] = a, b
            self.corners.append(at)
        self.faces.append((group, material, range(first, first + 4)))

    def box(self, material, low, high, group, top=None, bottom=None):
        """Seen from outside; the top and the bottom may be of other groups, (group, material)."""
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for positive in (False, True):
                other = (top if positive else bottom) if axis == 2 else None
                of = other or (group, material)
                self.rectangle(*of, axis, (high if positive else low)[axis], (low[u], low[v]), (high[u], high[v]), positive)

    def write(self, path):
        with open(path.with_suffix(".mtl"), "w", encoding="ascii") as file:
            for name, (rho, emission) in MATERIALS.items():
                file.write(f"newmtl {name}\nKd {rho} {rho} {rho}\nKe {emission} {emission} {emission}\n")
        with open(path, "w", encoding="ascii") as file:
            file.write(f"mtllib {path.stem}.mtl\n")
            file.writelines("v {:.6f} {:.6f} {:.6f}\n".format(*at) for at in self.corners)
            for group, material, corners in self.faces:
                file.write(f"o {group}\nusemtl {material}\nf {' '.join(map(str, corners))}\n")


def office():
    room = Office()
    room.rectangle("floor", "floor", 2, 0, (0, 0), (WIDTH, DEPTH), True)
    room.rectangle("ceiling", "white", 2, HEIGHT, (0, 0), (WIDTH, DEPTH), False)
    for positive in (True, False):
        room.rectangle("wall", "wall", 0, 0 if positive else WIDTH, (0, 0), (DEPTH, HEIGHT), positive)
        room.rectangle("wall", "wall", 1, 0 if positive else DEPTH, (0, 0), (HEIGHT, WIDTH), positive)
    for i in range(3):
        for j in range(2):
            x, y = .9 + 2.4 * i, .9 + 2.6 * j
            room.box("wood", (x, y, .71), (x + 1.6, y + .8, .75), "frame", top=("desk", "wood"))
            for side in (x + .1, x + 1.46):
                room.box("wood", (side, y + .1, .06), (side + .04, y + .7, .65), "frame")
            room.box("white", (x + .2, y + .3, 2.8), (x + 1.4, y + .5, 2.84), "lamp-back", bottom=("lamp", "lamp"))
    for k in range(4):
        room.box("wood", (.3 + 1.9 * k, 5.4, .1), (1.8 + 1.9 * k, 5.9, 1.8), "cupboard")
    return room


def run(lambert, *arguments):
    """Processor seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([lambert, *map(str, arguments)], check=True, stderr=subprocess.PIPE,
                   env=dict(os.environ, OMP_WAIT_POLICY="passive"))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def measure(options, folder):
    scene = pathlib.Path(options.scene) if options.scene else folder / "office.obj"
    reference = folder / f"{scene.stem}-{options.elements}.h5"
    emission, out = folder / "emission.npy", folder / "answer.npy"
    if not options.scene:
        office().write(scene)
    build = "precompute", scene, "--elements", options.elements, "--method", "hierarchical", "--form-factors", "blocks", \
        "--trials", 1, "--probes", 0, "--quiet"
    if not reference.exists():
        run(options.lambert, *build, "--quality", "high", "--epsilon", .02, "--seed", 7, "--keep-form-factors", "-o", reference)
    with h5py.File(reference) as file:
        area, n = file["mesh/area"][()], len(file["mesh/area"])
        names = [name.decode() if isinstance(name, bytes) else name for name in file["mesh/group_names"][()]]
        group = file["mesh/group"][()]
        channels, lamps = len(file["mesh/emission"]), file["mesh/emission"][()].max(axis=0)
    read, emits = (numpy.isin(group, [names.index(name) for name in given.split(",")]) if given else None
                   for given in (options.receivers, options.sources))
    inside = read if emits is None else emits
    rng = numpy.random.default_rng(5)

    def singles(count, among):
        light = numpy.zeros((count, n), "f4")
        light[range(count), rng.choice(among, count, replace=False)] = 1
        return light

    single, single_of_some = singles(48, n), singles(min(24, inside.sum()), numpy.flatnonzero(inside))
    lamps = lamps if lamps.max() > 0 else rng.random(n)
    light = {"lamps": lamps[None], "random": rng.random((2, n)), "single": single, "uniform_of_some": inside[None],
             "random_of_some": rng.random((2, n)) * inside, "single_of_some": single_of_some}
    if (lamps * inside).max() > 0:
        light["lamps_of_some"] = (lamps * inside)[None]
    sets, count = {}, 0
    for name, vectors in light.items():
        sets[name] = slice(count, count := count + len(vectors))
    E = numpy.vstack(list(light.values())).astype("f4")
    numpy.save(emission, E if channels == 1 else numpy.repeat(E[:, None], channels, 1))

    def answers(store, *more):
        run(options.lambert, "solve", store, "--emission", emission, "--quantity", "indirect", "-o", out, *more)
        return numpy.load(out).astype("f8").reshape(count, channels, n)

    truth = answers(reference, "--tolerance", 1e-4)
    places = [("all", area, name) for name in sets]
    if read is not None:
        places = [("read", area * read, name) for name in list(sets)[:None if options.sources else 3]] + places
    print("receivers,sources,epsilon,processor_seconds,operator_MB," + ",".join(f"{where}_{name}" for where, _, name in places))
    extras = [()] + [(name, given) for name, given in (("--receivers", options.receivers), ("--sources", options.sources)) if given]
    cases = [(epsilon, extra) for epsilon in options.epsilons for extra in extras + ([extras[1] + extras[2]] if extras[2:] else [])]
    seconds = {case: [] for case in cases}
    for _ in range(options.rounds):
        for k, case in enumerate(cases):
            seconds[case].append(run(options.lambert, *build, "--epsilon", case[0], *case[1], "-o", folder / f"{k}.h5"))
    for k, case in enumerate(cases):
        with h5py.File(folder / f"{k}.h5") as file:
            size = sum(item.nbytes for item in collect(file["operator"]))
        wrong = answers(folder / f"{k}.h5") - truth
        errors = [numpy.sqrt((w * wrong[sets[name]] ** 2).sum() / (w * truth[sets[name]] ** 2).sum()) for _, w, name in places]
        given = [case[1][case[1].index(name) + 1].replace(",", "+") if name in case[1] else "all" for name in ("--receivers", "--sources")]
        print(f"{given[0]},{given[1]},{case[0]:g},{min(seconds[case]):.2f},{size / 1e6:.3f}," +
              ",".join(f"{e:.5f}" for e in errors), flush=True)


def collect(group):
    found = []
    group.visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) else None)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lambert", default="lambert")
    parser.add_argument("--scene")
    parser.add_argument("--receivers")
    parser.add_argument("--sources")
    parser.add_argument("--elements", type=int, default=10000)
    parser.add_argument("--folder", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("epsilons", nargs="*", type=float, default=[.05, .1])
    options = parser.parse_args()
    if not options.scene and not options.receivers and not options.sources:
        options.receivers = "desk"
    if not options.receivers and not options.sources:
        parser.error("give --receivers or --sources")
    with tempfile.TemporaryDirectory(prefix="lambert-receivers-") as made:
        folder = options.folder or pathlib.Path(made)
        folder.mkdir(exist_ok=True)
        measure(options, folder)


if __name__ == "__main__":
    main()
