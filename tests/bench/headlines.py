#!/usr/bin/python3
"""The headline of `lambert precompute SCENE` at presets beside the error that unbiased walks at points find.

    headlines.py --lambert PROGRAM --points BENCH_POINTS [--number POINTS] [--walks WALKS] [--seed S] [--folder DIR] SCENE...

SCENE is a scene file, or words of `lambert generate` ("rooms --elements 400"). Each is precomputed at presets; its own lamps
shine or, where it has none, the groups whose names hold window, glass or pane, or else the largest. Printed as CSV: faces
and elements, processor seconds, peak memory, the kind, the headline of `lambert solve` with its parts, the true
share of the reflected light B - E that its elements are off by at points (preset: 1,000 of 8,192 walks each), its
standard error, and true over stated.
"""
import argparse
import csv
import io
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py
import numpy

COLUMNS = ("scene", "faces", "elements", "seconds", "peak_mb", "kind", "lights", "stated", "operator", "form_factors", "mesh", "true",
           "bar", "ratio")
WINDOWS = re.compile("window|glass|pane", re.IGNORECASE)


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"headlines: {' '.join(map(str, words))}: {done.stderr.strip()}")
    return done.stdout


def seconds_of(*words):
    """Processor seconds of a program, and its peak megabytes, no less than those of this script, which it begins as."""
    with tempfile.TemporaryFile() as said, subprocess.Popen([str(word) for word in words], stdout=said, stderr=said) as program:
        _, status, used = os.wait4(program.pid, 0)
        program.returncode = os.waitstatus_to_exitcode(status)
        if program.returncode != 0:
            said.seek(0)
            sys.exit(f"headlines: {' '.join(map(str, words))}: {said.read().decode().strip()}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def lit_groups(store):
    """The groups to be lit, none where the scene has lamps."""
    with h5py.File(store) as file:
        names = [name.decode() for name in file["mesh/group_names"][:]]
        if file["mesh/emission"][:].max() > 0:
            return []
        area = numpy.bincount(file["mesh/group"][:], file["mesh/area"][:], len(names))
    return [name for name in names if WINDOWS.search(name)] or [names[area.argmax()]]


def true_error(points, light):
    """Of light [C][n], and its standard error: sum (x - t)^2 - s^2 over sum t^2 - s^2, s being that of the walks."""
    rows = numpy.array([[float(x) for x in row] for row in list(csv.reader(io.StringIO(points)))[1:]])
    element, truth, noise = rows[:, 0].astype(int), rows[:, 1::2], rows[:, 2::2]
    off = ((light[:, element].T - truth) ** 2 - noise ** 2).sum(axis=1)
    there = (truth ** 2 - noise ** 2).sum(axis=1)
    square = off.sum() / there.sum()
    error = math.sqrt(max(square, 0))
    return error, math.sqrt(((off - square * there) ** 2).sum()) / there.sum() / 2 / max(error, 1e-9)


def measure(options, scene, folder):
    path, store, values = pathlib.Path(scene), folder / "store.h5", folder / "light.npy"
    name = path.stem
    if not path.exists():
        name, path = scene, folder / "scene.obj"
        run(options.lambert, "generate", *scene.split(), "-o", path)
    seconds, peak = seconds_of(options.lambert, "precompute", path, "-o", store, "--quiet")
    about = json.loads(run(options.lambert, "info", store, "--json"))
    with h5py.File(store) as file:
        faces = int(file["mesh/face"][:].max()) + 1 if "mesh/face" in file else 0
    lit = lit_groups(store)
    emit = [word for group in lit for word in ("--emit", f"{group}=1")]
    asked = options.lambert, "solve", store, *emit, "--quantity", "indirect"
    told = json.loads(run(*asked, "--json"))["error"]
    run(*asked, "-o", values)
    points = run(options.points, store, options.number, options.walks, options.seed, *lit)
    light = numpy.load(values).astype(float).reshape(about["channels"], -1)
    error, bar = true_error(points, light)
    parts, stated = told.get("parts", {}), told["stated"]
    return (name, faces, about["elements"], f"{seconds:.1f}", f"{peak:.0f}", about["kind"], "+".join(lit) or "own",
            f"{stated:.3g}", *(f"{parts.get(part, math.nan):.2g}" for part in ("operator", "form_factors", "mesh")), f"{error:.3g}",
            f"{bar:.1g}", f"{error / stated:.2f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--lambert", type=pathlib.Path, required=True)
    parser.add_argument("--points", type=pathlib.Path, required=True)
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--walks", type=int, default=8192)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="+")
    options = parser.parse_args()
    out = csv.writer(sys.stdout)
    out.writerow(COLUMNS)
    for scene in options.scenes:
        with tempfile.TemporaryDirectory(prefix="headlines-", dir=options.folder) as folder:
            out.writerow(measure(options, scene, pathlib.Path(folder)))
        sys.stdout.flush()


main()
