#!/usr/bin/python3
"""The bits of stores by two programs: a change that should change no result changes none of them.

    tests/bench/compare_stores.py OLD NEW [--only NAME]... [--threads T] [--list]

OLD and NEW are two `lambert`. Each makes a small store of each kind of form factors, operator and illumination, at once with
the other and from the same files; all datasets and attributes are compared, but for dates, versions, checksums and seconds. Each
difference is printed, with its size; the exit status is 1 then. Bits depend on the processor, the compiler and the C library, so
that hashes of them would hold nowhere else. They do not depend on the number of threads, but for the last digits of a reciprocal
condition number: T, 2 unless it is given, is the same for both.
"""

import argparse
import functools
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py
import numpy as np

POSITIONS = """{"light": {"polygon": [[-0.05, -0.05, 0], [0.05, -0.05, 0], [0.05, 0.05, 0], [-0.05, 0.05, 0]], "emission": [10, 9, 7]},
 "%s": [{"move": [0.1, 0.3, 0.5], "turn": {"axis": [1, 0, 0], "degrees": 180}},
        {"move": [0.45, 0.3, 0.5], "turn": {"axis": [1, 0, 0], "degrees": 180}},
        {"move": [0.3, 0.2, 0.4]}]}
"""
SCENES = {"cornell": "cornell --elements 400", "cornell1100": "cornell --elements 1100", "city": "city --elements 600",
          "patio": "patio --elements 300", "rooms": "rooms --elements 300", "box": "box --divisions 6 --reflectance .6"}
# The input, a scene or an earlier store, and the options.
STORES = {
    "exact": "cornell --method exact --form-factors rays --keep-form-factors",
    "exact-by-rays": "cornell --method exact --rays 256 --seed 3",
    "exact-by-hemicubes": "box --method exact --form-factors hemicube --resolution 64",
    "low-rank-hf": "exact --method low-rank --factorizer hf --epsilon .1",
    "low-rank-svd": "exact --method low-rank --factorizer svd --epsilon .1",
    "low-rank-rsi": "exact --method low-rank --factorizer rsi --rank 40",
    "low-rank-sgrsvd": "exact --method low-rank --factorizer sgrsvd --epsilon .2",
    "low-rank-f16": "rooms --method low-rank --store-precision f16 --rays 512",
    "low-rank-i8": "rooms --method low-rank --store-precision i8 --keep-factors --quality draft",
    "2msc": "exact --method 2msc --factorizer qr --rank 40",
    "sparse": "city --method sparse --rays 1024 --correction discarded",
    "emitters": "patio --emitters group=lamp --rays 256",
    "emitters-sky": "cornell --emitters sky --sky grid:6x3 --ground-albedo .2 --keep-form-factors --rays 256",
    "positions": "cornell --positions positions.json --paths 500",
    "path": "cornell --path path.json --frames 4 --reuse C --paths 500",
    "hierarchical-by-blocks": "cornell1100",
    "hierarchical-kept": "cornell --method hierarchical --form-factors blocks --keep-form-factors --epsilon .02",
    "hierarchical-from-store": "hierarchical-kept --method hierarchical --epsilon .1",
    "hierarchical-by-pairs": "cornell1100 --form-factors rays --epsilon .02 --trials 2",
    "hierarchical-by-rays": "rooms --method hierarchical --rays 1024 --sources lamp-1",
    "hierarchical-high": "rooms --method hierarchical --form-factors rays --quality high --two-sided",
    "hierarchical-sky": "cornell --method hierarchical --form-factors blocks --sky tregenza --receivers floor",
    "hierarchical-mesh": "rooms --method hierarchical --form-factors blocks --mesh-error .2 --elements 800",
}
PROBES = "--probes", "4"
# Attributes of when, by what and how fast a store was made.
VARIES = re.compile(r"^/(@created|@tool|@command)$|^/checksum|seconds$|^/operator@time_")
# Arrays that only later programs write: OLD may not know them.
LATER = re.compile(r"^/mesh/face(_area|_part|_part_area)?$")


@functools.cache
def knows_mesh(program):
    return "--mesh=" in subprocess.run([program, "precompute", "--help"], capture_output=True, text=True, check=True).stdout


def of_faces(program, source, options):
    """Bits are those of the faces of a scene: the mesh by preset rests on rays, whose bits differ between programs."""
    own = source in STORES or any(o.startswith(("--mesh", "--elements", "--max-edge")) for o in options)
    return () if own or not knows_mesh(program) else ("--mesh", "faces")


def make(program, name, folder, common, threads):
    """A store in its folder; scenes are common to both programs."""
    source, *options = STORES[name].split()
    scene = common / f"{source}.obj" if source in SCENES else folder / f"{source}.h5"
    if source in STORES and not scene.exists():
        make(program, source, folder, common, threads)
    walks = "--positions" in options or "--path" in options
    command = [program, "precompute", scene, "-o", folder / f"{name}.h5", "--quiet", "--memory", "8G",
               *(() if walks else PROBES), *of_faces(program, source, options), *options]
    done = subprocess.run(list(map(str, command)), cwd=common, stderr=subprocess.PIPE, text=True, check=False,
                          env=dict(os.environ, OMP_NUM_THREADS=str(threads), LC_ALL="C"))
    if done.returncode != 0:
        raise SystemExit(f"{name}: {' '.join(map(str, command))}: {done.stderr.strip()}")


def contents(path):
    """{path of a dataset or PATH@ATTRIBUTE: its values} of a store, without those that vary."""
    found = {}

    def take(where, item):
        for key, value in item.attrs.items():
            found[f"{where}@{key}"] = np.asarray(value)
        if isinstance(item, h5py.Dataset):
            found[where] = item[()]

    with h5py.File(path) as file:
        take("/", file)
        file.visititems(lambda where, item: take("/" + where, item))
    return {where: values for where, values in found.items() if not VARIES.search(where)}


def difference(old, new):
    """The difference of two arrays, as text; "" where all bits are the same."""
    old, new = np.asarray(old), np.asarray(new)
    if old.dtype != new.dtype or old.shape != new.shape:
        return f"{old.dtype}{list(old.shape)} became {new.dtype}{list(new.shape)}"
    if old.tobytes() == new.tobytes():
        return ""
    if old.dtype.kind not in "fiu":
        return f"{old.tolist()!r} became {new.tolist()!r}" if old.size == 1 else "other values"
    a, b = old.astype(float).ravel(), new.astype(float).ravel()
    if old.size == 1:
        return f"{a[0]:.9g} became {b[0]:.9g}"
    off = np.abs(b - a)
    differing = int(np.count_nonzero(~(off == 0)))
    return f"{differing} of {old.size} numbers differ, by at most {np.nanmax(off):.2g}; the largest is {np.nanmax(np.abs(a)):.2g}"


def compare(name, old, new):
    """The lines of what differs between two stores."""
    a, b = contents(old), contents(new)
    lines = [f"{name}: {where}: is in {side} alone"
             for side, here, there in (("OLD", a, b), ("NEW", b, a)) for where in here
             if where not in there and not (side == "NEW" and LATER.search(where))]
    for where in a:
        told = difference(a[where], b[where]) if where in b else ""
        if told:
            lines.append(f"{name}: {where}: {told}")
    return lines


def main():
    parse = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parse.add_argument("old", nargs="?")
    parse.add_argument("new", nargs="?")
    parse.add_argument("--only", action="append", metavar="NAME", choices=STORES)
    parse.add_argument("--threads", type=int, default=2)
    parse.add_argument("--list", action="store_true", help="print the stores and their options")
    asked = parse.parse_args()
    if asked.list:
        print(*(f"{name:24} {options}" for name, options in STORES.items()), sep="\n")
        return 0
    if asked.new is None:
        parse.error("OLD and NEW must be given")
    programs = [os.path.abspath(path) for path in (asked.old, asked.new)]
    names = asked.only or list(STORES)
    differing = 0
    with tempfile.TemporaryDirectory(prefix="lambert-compare-") as folder:
        common, *folders = (pathlib.Path(folder) / part for part in ("common", "old", "new"))
        for part in (common, *folders):
            part.mkdir()
        for scene, options in SCENES.items():
            subprocess.run([programs[0], "generate", *options.split(), "-o", common / f"{scene}.obj"], check=True,
                           stdout=subprocess.DEVNULL)
        for way in "positions", "path":
            (common / f"{way}.json").write_text(POSITIONS % ("path" if way == "path" else "positions"))
        for name in names:
            for program, place in zip(programs, folders):
                make(program, name, place, common, asked.threads)
            lines = compare(name, *(place / f"{name}.h5" for place in folders))
            differing += bool(lines)
            print(*(lines or [f"{name}: the same"]), sep="\n", flush=True)
    print(f"{differing} of {len(names)} stores differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
