#!/usr/bin/python3
"""Suite cie171 of lambert-bench: the analytic cases of CIE 171:2006 beside their formulas.

    cie171.py PROGRAMS SCALE SEED

PROGRAMS is the folder of lambert; SCALE is quick, default or full. Each scene is precomputed with sensors at the points of its
cases and solved, as its user would do it. Cases of lamps are found at --quality normal and high, those of the sky on the tiles
of tregenza and reinhart:4; full has both of both. Such tiles have the mean radiance that the sky has over each of them.
lambert-bench reads standard output: one JSON object a line, as of service.py.
"""

import json
import math
import os
import pathlib
import sys
import tempfile
import time

import numpy as np

from cie171_cases import BLACK, LIT, SKIES, horizontal_illuminance, lamp_scenes, sky_scenes
from service_programs import Failure, Program, run_suite, tell

SECONDS = 3600
TREGENZA_COUNTS = 30, 30, 24, 24, 18, 12, 6
TILINGS = {"tregenza": 1, "reinhart:4": 4}
NORMAL, HIGH = "normal", "high"
# per cent: of lamps by quality, in 5.2 to 5.4 and later; of each point under a sky of fine tiles, and rms under one of coarse ones
WANTED = {NORMAL: (.2, .5), HIGH: (.1, .1)}
EXACT = "5.2", "5.3", "5.4"
WANTED_FINE, WANTED_RMS = 1, 4

CASES = (("case", None, "number in CIE 171:2006"), ("name", None, "of it"), ("quality", None, "--quality"),
         ("sky", None, "tiles; empty: no sky"), ("unit", None, "of the values"), ("points", "", "values that are compared"),
         ("at", None, "the point of the largest difference"), ("value", "", "of lambert, there"),
         ("expected", "", "by the formula, there"),
         ("difference", "%", "of the expected value, or where that is 0 of the largest one of the case"),
         ("rms", "%", "of the differences"), ("wanted", "%", "of the largest difference; of tregenza, of their rms"),
         ("outcome", None, "met or missed"), ("seconds", "s", "to make the store of its scene, and to answer"))
POINTS = (("case", None, "number"), ("name", None, "of it"), ("quality", None, "--quality"), ("sky", None, "tiles"),
          ("point", None, "name"), ("x", "m", "place"), ("y", "m", "likewise"), ("z", "m", "up"), ("value", "", "of lambert"),
          ("expected", "", "by the formula"), ("difference", "%", "as in the table of cases"))


def write_scene(scene, folder):
    """An OBJ, its materials, luminaires and sensors; returns options of precompute."""
    options = [*scene.options]
    vertices, faces = [], []
    for group, material, corners in scene.faces:
        first = len(vertices) + 1
        vertices += [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in corners]
        faces += [f"o {group}", f"usemtl {material}", "f " + " ".join(str(first + k) for k in range(len(corners)))]
    (folder / "scene.obj").write_text("\n".join(["mtllib scene.mtl", *vertices, *faces, ""]))
    grey = f"{scene.reflectance:.17g}"
    (folder / "scene.mtl").write_text(f"newmtl {BLACK}\nKd {grey} {grey} {grey}\n"
                                      f"newmtl {LIT}\nKd 0 0 0\nKe" + f" {scene.emission:.17g}" * 3 + "\n")
    if scene.luminaire:
        text, place = scene.luminaire
        (folder / "lamp.ies").write_text(text)
        (folder / "lamps.json").write_text(json.dumps({"luminaires": [{"name": "lamp", "file": "lamp.ies", "at": place}]}))
        options += ["--luminaires", "lamps.json"]
    if scene.points:
        rows = [",".join(["points", *(f"{x:.17g}" for x in (*position, *normal))]) for _, position, normal in scene.points]
        (folder / "sensors.csv").write_text("\n".join(["name,x,y,z,nx,ny,nz", *rows, ""]))
        options += ["--sensors", "sensors.csv"]
    return options


def tile_means(luminance, split, nodes=4):
    """The mean by solid angle of a luminance over each tile, band by band from the horizon, by Gauss in sin(altitude) and azimuth.
    The first tile of a band is centred on north, +y; east is +x."""
    node, weight = np.polynomial.legendre.leggauss(nodes)
    at, share = (node + 1) / 2, weight / 2
    height, means = math.pi / 2 / (7 * split + .5), []
    for band in range(7 * split + 1):
        cap = band == 7 * split
        count = 1 if cap else TREGENZA_COUNTS[band // split] * split
        low, high = math.sin(band * height), 1. if cap else math.sin((band + 1) * height)
        sine = low + at * (high - low)
        parts = 24 if cap else 1  # the cap goes around: its azimuths take more nodes
        turn = (np.arange(count)[:, None] - .5 + ((np.arange(parts)[:, None] + at) / parts).ravel()) * (2 * math.pi / count)
        flat = np.sqrt(1 - sine ** 2)[:, None, None]
        direction = np.stack([flat * np.sin(turn), flat * np.cos(turn),
                              np.broadcast_to(sine[:, None, None], (nodes, *turn.shape))], axis=-1)
        means.append(share @ (luminance(direction) @ (np.tile(share, parts) / parts)))
    return np.concatenate(means)


class Bench:
    def __init__(self, programs, scale, seed):
        self.programs, self.scale, self.seed = pathlib.Path(programs).resolve(), scale, int(seed)
        self.cases, self.points = [], []

    def lambert(self, *arguments):
        return Program("lambert", self.folder, self.programs / "lambert", *arguments).finish(SECONDS)

    def answers(self, scene, quality, tiling):
        """Values of all cases, and the seconds that they took."""
        options = write_scene(scene, self.folder)
        light = []
        if scene.sky:
            np.save(self.folder / "sky.npy", np.array([tile_means(sky, TILINGS[tiling]) for sky in scene.sky], dtype=np.float32))
            options += ["--sky", tiling]
            light = ["--sky", "sky.npy"]
        begin = time.perf_counter()
        if self.scale == "quick":
            options += ["--elements", "200"]
        self.lambert("precompute", "scene.obj", "-o", "store.h5", "--quality", quality, "--seed", str(self.seed), "--quiet",
                     *options)
        found = self.solve(scene, light)
        return found, time.perf_counter() - begin

    def solve(self, scene, light):
        how = {"sensors": ("--sensors", "all"), "lumens": ("--quantity", "irradiance"), "mean": ("--quantity", "indirect")}
        answer = json.loads(self.lambert("solve", "store.h5", *how[scene.answer], *light, "--json"))
        if scene.answer == "sensors":
            values = answer["sensors"][0]["values"]
            if not scene.sky:
                return [values]
            return [[100 * x / horizontal_illuminance(sky) for x in of_sky] for of_sky, sky in zip(values, scene.sky)]
        groups = answer["groups"].values()
        total = sum(group["area"] * group["mean"] for group in groups)
        if scene.answer == "lumens":
            return [[total]]
        return [[total / sum(group["area"] for group in groups) / scene.reflectance]]

    def measure(self, scene, quality, tiling=""):
        found, seconds = self.answers(scene, quality, tiling)
        for case, values in zip(scene.cases, found):
            largest = max(case.expected)
            places = scene.points or [("all", (None,) * 3, None)]
            if len(values) != len(case.expected) or None in values:
                raise Failure(f"case {case.number}, {case.name}: sensors without a value")
            off = [100 * (value - expected) / (expected or largest) for value, expected in zip(values, case.expected)]
            for (name, position, _), value, expected, difference in zip(places, values, case.expected, off):
                self.points.append([case.number, case.name, quality, tiling, name, *position, value, expected, difference])
            worst = max(range(len(off)), key=lambda k: abs(off[k]))
            rms = math.sqrt(sum(x * x for x in off) / len(off))
            wanted = self.wanted(case, quality, tiling)
            met = (rms if tiling == "tregenza" else abs(off[worst])) <= wanted
            self.cases.append([case.number, case.name, quality, tiling, case.unit, len(off), places[worst][0], values[worst],
                               case.expected[worst], off[worst], rms, wanted, "met" if met else "missed", seconds])

    @staticmethod
    def wanted(case, quality, tiling):
        if tiling:
            return WANTED_RMS if tiling == "tregenza" else WANTED_FINE
        return WANTED[quality][case.number not in EXACT]

    def runs(self):
        """Scenes, each with a quality and tiles of the sky."""
        quick, full = self.scale == "quick", self.scale == "full"
        for quality in (NORMAL,) if quick else (NORMAL, HIGH):
            for scene in lamp_scenes((.5,), (4,)) if quick else lamp_scenes():
                yield scene, quality, ""
        for quality in (NORMAL, HIGH) if full else (NORMAL,):
            for tiling in ("tregenza",) if quick else TILINGS:
                for scene in sky_scenes((5, 12), small=True) if quick else sky_scenes(SKIES):
                    yield scene, quality, tiling

    def run(self):
        with tempfile.TemporaryDirectory(prefix="lambert-bench-", dir=os.environ.get("TMPDIR") or "/tmp") as path:
            self.folder = pathlib.Path(path).resolve()
            runs = list(self.runs())
            for k, (scene, quality, tiling) in enumerate(runs):
                case = scene.cases[0]
                tell(progress=[f"case {case.number}, {case.name}", k / len(runs)])
                self.measure(scene, quality, tiling)
        self.write("cases", "Cases of CIE 171:2006 beside their formulas", CASES, self.cases)
        rows = [[x if x is None or isinstance(x, str) else float(x) for x in row] for row in self.points]
        self.write("points", "The same, point by point", POINTS, rows, printed=False)

    @staticmethod
    def write(name, title, columns, rows, printed=True):
        tell(table={"name": name, "title": title, "columns": columns, "rows": rows, "printed": printed})


run_suite(lambda: Bench(*sys.argv[1:4]).run())
