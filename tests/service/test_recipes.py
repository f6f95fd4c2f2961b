#!/usr/bin/python3
"""The form factors and the operators that scenes get, and the forecasts of them: tests/recipes.txt has the lines of the log
that say it. Most runs end with the forecast, before form factors are found.

    LAMBERT=build/release/lambert tests/service/test_recipes.py [--exact] [--only TEXT] [--write]

--exact compares all digits, as two programs give them on one machine, and so finds any change of a choice. Otherwise forecasts
may differ a little, as vector kernels and compilers round the counts of samples differently. --only runs the scenes whose
arguments and options contain TEXT. --write writes the file anew. Under sanitizers (SMALL=1) the few scenes that cost little
are run.

The clocks of the programs count calls (tests/faults/ticks.c). Only --time chooses by clocks, but every forecast of seconds
contains paces that are measured.
"""

import argparse
import difflib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from command import ENVIRONMENT, LAMBERT, SMALL, must, of_faces
from patience import PATIENCE

TESTS = pathlib.Path(__file__).resolve().parents[1]
RECIPES = TESTS / "recipes.txt"
HEAD = """# Form factors, operators and forecasts that lambert chooses for scenes. tests/service/test_recipes.py says how, and writes
# this file: scenes, their commands, and what each of them says.
"""

PRESET, RAYS, BLOCKS, TIME = "", "--form-factors rays", "--form-factors blocks", "--time 10"
ALL, UNTIMED = (PRESET, RAYS, BLOCKS, TIME), (PRESET, RAYS, BLOCKS)
CLASSIFY = "classify --epsilon .15 --rays 256"
# Scenes: arguments of `lambert generate`, or a file below tests/fixtures; options of all commands; the commands. With --time
# none of the options that it chooses can be given. Below 1,025 elements the preset is RAYS.
SCENES = (
    ("box --divisions 4", "--closed", (*ALL, "classify")),
    ("box --divisions 14 --size 8,5,3 --reflectance .9", "--method exact", UNTIMED),
    ("furnace --elements 1500", "", ALL),
    ("cornell --elements 200", "--method hierarchical --epsilon .03 --probes 8 --trials 2", (*UNTIMED[1:], "--quality draft")),
    ("cornell --elements 1300", "", (*ALL, CLASSIFY, "--form-factors hemicube", "--rays 512")),
    ("cornell --elements 1300", "--sky grid:6x3 --ground-albedo .2", ALL),
    ("cornell --closed --elements 2500", "--keep-form-factors", ALL),
    ("cornell --elements 5000", "--quality high", UNTIMED),
    ("cornell --elements 10249", "", ALL),
    ("cornell --elements 12000", "--receivers floor --memory 700M", ALL),
    ("cornell --elements 40000", "", ALL),
    ("rooms --elements 1100", "--two-sided", ALL),
    ("rooms --elements 3000", "--quality draft", UNTIMED),
    ("rooms --elements 12000", "", UNTIMED),
    ("city --variant 1 --elements 2000", "--method sparse", UNTIMED),
    ("city --variant 1 --elements 2000", "", (PRESET, TIME, CLASSIFY)),
    ("city --variant 3 --terrain valley --elements 10500", "", UNTIMED),
    ("anechoic --elements 700", "--epsilon .2", (RAYS, BLOCKS)),
    ("anechoic --elements 3000", "", (PRESET, BLOCKS)),
    ("patio --elements 1500", "--sky tregenza", ALL),
    ("patio --elements 11000", "--closed=no --memory 1G", (RAYS, BLOCKS)),
    ("atrium --elements 2500", "", (PRESET, BLOCKS, TIME)),
    ("maze --elements 1500", "--method low-rank --epsilon .1", UNTIMED),
    ("maze --elements 20000", "", ALL),
    ("canopy --elements 500", "", (RAYS, BLOCKS, CLASSIFY)),
    ("canopy --elements 2500", "--memory 120M", ALL),
    ("room-front/room-front.obj", "", (BLOCKS, "--quality draft")),
    ("room-front/room-front.obj", "--max-edge .25", (PRESET, BLOCKS, TIME)),
    ("meshes/octagonal_pocket.ply", "", ALL),
    ("l-room/l-room.obj", "--max-edge .3", ALL),
)
# Under sanitizers: these scenes with these commands.
CHEAP = {"box --divisions 4": (PRESET, BLOCKS), "furnace --elements 1500": (PRESET,), "l-room/l-room.obj": (PRESET,)}

# Of the log: the choice of a recipe, the scene, the forecast, the trials; how a run failed.
SAID = re.compile(r"--time |.*\d elements in |.* (are|is) (not )?taken|forecast: |rows are kept in |trial |"
                  r"lambert precompute: (warning: --time|(?!warning))")
RECIPE = re.compile(r"((?:pair by pair|near pairs|blocks of clusters|hemicubes|\d+ rays) [^:]*): .* leave the scene")
METHOD = re.compile(r"(emitters|exact|hierarchical|low-rank|2msc|sparse): ")
FOLLOWED = 400  # elements of scenes whose runs go on until their operator is there

# Numbers that may differ a little: those of forecasts, and the errors that trials are about.
FORECAST = re.compile(r"\b\d+(?:\.\d+)?(?= s\b|[MG]\b| Mray/s| processors| per element)")
ANY = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
SHARE = .03


def build_clocks(folder):
    """The library of clocks that count calls; it must not contain a sanitizer."""
    library = os.path.join(folder, "ticks.so")
    subprocess.run([os.environ.get("CC", "cc"), "-shared", "-fPIC", "-O1", "-o", library, TESTS / "faults" / "ticks.c"],
                   check=True, timeout=PATIENCE)
    return library


class Runs:
    """A folder of scenes, and the lines of the commands on them."""

    def __init__(self, folder, only=""):
        self.folder, self.only = folder, only
        self.environment = dict(ENVIRONMENT, LD_PRELOAD=build_clocks(folder))
        if SMALL:
            self.environment["ASAN_OPTIONS"] = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"

    def scene(self, making):
        if "/" in making:
            return str(TESTS / "fixtures" / making)
        path = os.path.join(self.folder, "scene.obj")
        must("generate", *making.split(), "-o", path)
        return path

    def classify(self, scene, *options):
        found = json.loads(must("classify", scene, "--json", *options).stdout)
        costs = [f"{name} {cost / found['elements']:.2g} per element" for name, cost in found["numbers"].items()
                 if cost is not None]
        return [f"{found['method']} by {found['rays']} rays, {found['density']:.0%} of F: {', '.join(costs)}"]

    def precompute(self, scene, *options):
        """The lines of the log up to the forecast; of small scenes and trials also those of their outcome."""
        memory = () if "--memory" in options else ("--memory", "16G")
        to_end, follows, lines, found = "--trials" in options, False, [], set()
        with subprocess.Popen([LAMBERT, *of_faces(("precompute", scene, "-o", os.path.join(self.folder, "s.h5"), *memory, *options))],
                              stderr=subprocess.PIPE, text=True, env=self.environment) as run:
            for line in run.stderr:
                line = line.rstrip()
                recipe, method = RECIPE.match(line), METHOD.match(line)
                size = re.match(r"(\d+) elements in ", line)
                follows = follows or to_end or size is not None and int(size[1]) <= FOLLOWED
                if recipe:
                    lines.append(f"form factors: {recipe[1]}")
                    found.add("recipe")
                elif method:
                    lines.append(f"operator: {method[1]}")
                    found.add("method")
                elif SAID.match(line) and not found or line.startswith("trial "):
                    lines.append(line)
                if line.startswith("forecast: ") and not follows or len(found) == 2 and not to_end or \
                        line.startswith("processor seconds"):
                    run.kill()
                    break
        return lines

    def blocks(self):
        """(scene, commands with their lines), scene by scene."""
        for making, options, ways in SCENES:
            if SMALL:
                ways = CHEAP.get(making, ())
            if self.only not in f"{making} {options}":
                continue
            scene, said = self.scene(making) if ways else None, {}
            for way in ways:
                words = (way if way.startswith("classify") else f"precompute {way}").split()
                words += options.split()
                said[" ".join(words)] = getattr(self, words[0])(scene, *words[1:])
            if ways:
                yield making, said


def text_of(making, said):
    return f"\n{making}\n" + "".join(f"  {command}\n" + "".join(f"    {line}\n" for line in lines)
                                     for command, lines in said.items())


def read():
    """{(scene, command): its lines} of the file."""
    found, making, lines = {}, None, None
    for line in RECIPES.read_text().splitlines():
        if line.startswith("    "):
            lines.append(line.strip())
        elif line.startswith("  "):
            lines = found[making, line.strip()] = []
        elif not line.startswith("#"):
            making = line
    return found


def parts_of(line):
    """The line without its numbers that may differ a little, and these."""
    line = re.sub(r"(\d+) min (\d+) s", lambda m: f"{60 * int(m[1]) + int(m[2])} s", line)
    pattern = ANY if line.startswith("trial ") else FORECAST
    return pattern.sub("#", line), pattern.findall(line)


def is_near(a, b):
    """Within SHARE, or one in the last digit of either."""
    digit = max(10.0 ** -len(x.partition(".")[2]) if "e" not in x else 0 for x in (a, b))
    return abs(float(a) - float(b)) <= max(SHARE * max(float(a), float(b)), 1.001 * digit)


def is_same(before, after, exact):
    if exact or len(before) != len(after):
        return before == after
    pairs = [(parts_of(b), parts_of(a)) for b, a in zip(before, after)]
    return all(b[0] == a[0] and all(map(is_near, b[1], a[1])) for b, a in pairs)


def compare(runs, exact):
    """The differences from the file, as text; "" where there is none."""
    wanted, told, seen = read(), [], set()
    for making, said in runs.blocks():
        for command, after in said.items():
            before = wanted.get((making, command))
            seen.add((making, command))
            if before is None:
                told += [f"{making}: {command}: is not in {RECIPES.name}: --write writes it"]
            elif not is_same(before, after, exact):
                changes = [line for line in difflib.ndiff(before, after) if not line.startswith("?")]
                told += [f"{making}: {command}", *(f"    {line}" for line in changes)]
    told += [f"{making}: {command}: is in {RECIPES.name} alone" for making, command in wanted
             if not SMALL and not runs.only and (making, command) not in seen]
    return "\n".join(told)


def difference(only="", exact=False):
    """The differences, below a line that says who is who."""
    with tempfile.TemporaryDirectory(prefix="lambert-recipes-") as folder:
        told = compare(Runs(folder, only), exact)
    return told and f"other recipes than in {RECIPES} (-: the file, +: {LAMBERT})\n{told}"


def write():
    with tempfile.TemporaryDirectory(prefix="lambert-recipes-") as folder:
        text = HEAD + "".join(text_of(*block) for block in Runs(folder).blocks())
    RECIPES.write_text(text)


class Recipes(unittest.TestCase):
    def test_scenes_get_what_they_got(self):
        told = difference()
        if told:
            self.fail(told)


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("--exact", action="store_true")
    parse.add_argument("--only", default="", metavar="TEXT")
    parse.add_argument("--write", action="store_true")
    asked = parse.parse_args()
    if asked.write:
        return write()
    return difference(asked.only, asked.exact) or None


if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.exit(main())
    unittest.main()
