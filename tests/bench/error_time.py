"""Time of two programs at equal error, scene by scene.

    OMP_WAIT_POLICY=passive /usr/bin/python3 tests/bench/error_time.py OLD NEW [SCENE …] [--elements N] [--only "RECIPE;…"]

OLD and NEW are two `lambert`. SCENE is the kind of a generated scene or a file (--elements then divides nothing). Each program makes a
store by each recipe of RECIPES that it knows, without its judge, in turn with the other one. The time is in processor seconds, user and
system, the least of --repeats. The error is |P~ - P| / |P|, P = B - E, weighted by area: the mean over bright single elements, the
scene's own lights, uniform and random emission. References R, R' are all pairs of NEW at quality --reference by two further seeds, solved in
double; as their errors are independent, the squared error is <P~ - R, P~ - R'>, which has the noise of neither on average.
The table has seconds of OLD / seconds of NEW = ratio at errors of its head: each program's recipes that are beaten in time and error by
another one, or that gain less than a tenth of the error for more time, count nothing, and between two others error and time follow a
power; "-": no recipe is as exact. CSV of all runs: --csv.
Asserts nothing.
"""

import argparse
import csv
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

import h5py
import numpy as np

KINDS = {"cornell": ["cornell", "--closed"], **{kind: [kind] for kind in ("rooms", "atrium", "patio", "maze", "canopy", "anechoic")},
         "city1": ["city", "--variant", "1"], "city2": ["city", "--variant", "2", "--terrain", "valley"],
         "city3": ["city", "--variant", "3", "--terrain", "hill"]}
HIERARCHICAL = "--method hierarchical --epsilon"
RECIPES = {"defaults": "",
           **{f"rays {rays}, {epsilon}": f"--form-factors rays --rays {rays} {HIERARCHICAL} {epsilon}"
              for rays, epsilon in ((256, .2), (1024, .05), (4096, .05), (16384, .0125), (32768, .0125))},
           **{f"normal, {epsilon}": f"--form-factors rays {HIERARCHICAL} {epsilon}" for epsilon in (.2, .05, .0125)},
           **{f"exact, {epsilon}": f"--form-factors rays --method exact --epsilon {epsilon}" for epsilon in (.2, .05, .0125)},
           "normal, exact": "--form-factors rays --method exact",
           **{f"blocks, {epsilon}": f"--form-factors blocks {HIERARCHICAL} {epsilon}" for epsilon in (.2, .05, .0125, .006, .003, .001)},
           "high, exact": "--form-factors rays --quality high --method exact"}
LIGHTS = ("single", "lights", "uniform", "random")
SINGLES, RANDOMS = 24, 4
ERRORS = (.1, .03, .01, .003, .001, .0003)
REFERENCES = [f"--form-factors rays --method exact --keep-form-factors --seed {seed} --quality" for seed in (1001, 1002)]


def processor_seconds(command, limit):
    """None: the program knows no such recipe, or takes longer than the limit."""
    def bound():
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=bound)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime if status == 0 else None


class Scene:
    """A scene, emissions E [m][C][n] and two references P [m][C][n] in double."""

    def __init__(self, folder, program, path, quality):
        self.folder, self.path = folder, path
        stores = [os.path.join(folder, f"reference{k}.h5") for k in range(len(REFERENCES))]
        for store, recipe in zip(stores, REFERENCES):
            subprocess.run([program, "precompute", path, "-o", store, "--mesh", "faces", "--probes", "0", "--quiet", *recipe.split(), quality],
                           check=True)
        with h5py.File(stores[0]) as file:
            self.area, own = file["mesh/area"][:], file["mesh/emission"][:]
        self.n, C = len(self.area), len(own)
        draw = np.random.default_rng(1)
        single = np.zeros((min(SINGLES, self.n), C, self.n), "f4")
        for E, i in zip(single, draw.permutation(self.n)):
            E[:, i] = 1
        self.emissions = {"single": single, "lights": own[None].astype("f4") if own.max() > 0 else np.zeros((0, C, self.n), "f4"),
                          "uniform": np.ones((1, C, self.n), "f4"),
                          "random": draw.random((RANDOMS, C, self.n)).astype("f4")}
        self.batch = os.path.join(folder, "emissions.npy")
        E = np.concatenate(list(self.emissions.values()))
        np.save(self.batch, E if C > 1 else E[:, 0])
        self.shape = E.shape
        self.references = [self.indirect(program, store, "--tolerance", "1e-9") for store in stores]

    def indirect(self, program, store, *options):
        out = os.path.join(self.folder, "answer.npy")
        subprocess.run([program, "solve", store, "--emission", self.batch, "--quantity", "indirect", "-o", out, *options], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return np.load(out).astype("f8").reshape(self.shape)

    def errors(self, P):
        """One figure for each of LIGHTS; NaN where the scene has no such emission."""
        R, S = self.references
        dot = lambda x, y: np.einsum("mcn,mcn,n->m", x, y, self.area)
        squared, size = dot(P - R, P - S), dot(R, S)
        begin, out = 0, []
        for light in LIGHTS:
            rows = slice(begin, begin + len(self.emissions[light]))
            begin = rows.stop
            # An element that sees next to nothing has a relative error of thousands.
            lit = size[rows] > 1e-6 * size[rows].max(initial=0)
            # The mean of squares first: single differences may fall below 0.
            out.append(math.sqrt(max(np.mean(squared[rows][lit] / size[rows][lit]), 0)) if lit.any() else math.nan)
        return out

    def noise(self):
        """Of one reference, by the distance of both."""
        R, S = self.references
        self.references = [R, R]
        out = [error / math.sqrt(2) for error in self.errors(S)]
        self.references = [R, S]
        return out


def front(points):
    """Of (error, time), those that no other one beats in both, or nearly so, from the largest error on."""
    kept = []
    for error, time in sorted(points, key=lambda p: (p[1], p[0])):
        if not kept or error < .9 * kept[-1][0]:
            kept.append((error, time))
    return kept


def time_at(points, error):
    """inf: no recipe is as exact."""
    for k, (e, t) in enumerate(points):
        if e <= error:
            if k == 0 or e <= 0:
                return t
            e0, t0 = points[k - 1]
            return t0 * (t / t0) ** (math.log(e0 / error) / math.log(e0 / e))
    return math.inf


def compare(old, new, error):
    """The time of OLD over that of NEW, and both; those who do not reach the error have no time."""
    times = [time_at(front(points), error) for points in (old, new)]
    if not any(map(math.isfinite, times)):
        return "-"
    return " / ".join(f"{t:.2f}" if math.isfinite(t) else "-" for t in times) + (f" = {times[0] / times[1]:.1f}" if all(map(math.isfinite, times)) else "")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("scenes", nargs="*", default=list(KINDS))
    parser.add_argument("--elements", type=int, default=1500)
    parser.add_argument("--reflectance", default=".5")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--limit", type=int, default=120, help="processor seconds of a run")
    parser.add_argument("--reference", choices=("normal", "high"), default="high", help="quality of the references")
    parser.add_argument("--only", help="recipes, separated by ;")
    parser.add_argument("--csv")
    asked = parser.parse_args()
    recipes = asked.only.split(";") if asked.only else list(RECIPES)
    written = csv.writer(open(asked.csv, "a", newline="", buffering=1) if asked.csv else sys.stderr)
    print("| scene, elements | light | noise of a reference | " + " | ".join(map(str, ERRORS)) + " |\n" + "|---" * (3 + len(ERRORS)) + "|")
    for scene in asked.scenes:
        with tempfile.TemporaryDirectory() as folder:
            path = scene
            if scene in KINDS:
                path = os.path.join(folder, f"{scene}.obj")
                subprocess.run([asked.new, "generate", *KINDS[scene], "--elements", str(asked.elements), "--reflectance", asked.reflectance,
                                "-o", path], check=True, stdout=subprocess.DEVNULL)
            s = Scene(folder, asked.new, path, asked.reference)
            points = {"old": [], "new": []}
            for name in recipes:
                for which, program in (("old", asked.old), ("new", asked.new)):
                    store = os.path.join(folder, f"{which}.h5")
                    command = [program, "precompute", path, "-o", store, "--mesh", "faces", "--probes", "0", "--quiet", *RECIPES[name].split()]
                    times = [processor_seconds(command, asked.limit) for _ in range(asked.repeats)]
                    if None in times:
                        continue
                    errors = s.errors(s.indirect(program, store))
                    points[which].append((min(times), errors))
                    written.writerow([pathlib.Path(scene).stem, s.n, which, name, f"{min(times):.3f}", *(f"{e:.3g}" for e in errors)])
            for k, light in enumerate(LIGHTS):
                of = {which: [(errors[k], time) for time, errors in all_of if not math.isnan(errors[k])] for which, all_of in points.items()}
                # Furnaces: all recipes are exact but for rounding.
                if not of["old"] or max(error for error, _ in of["old"] + of["new"]) < ERRORS[-1]:
                    continue
                cells = [compare(of["old"], of["new"], error) for error in ERRORS]
                print(f"| {pathlib.Path(scene).stem}, {s.n} | {light} | {s.noise()[k]:.1g} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
