"""Forecast beside truth, stage by stage, in processor seconds, of scenes at defaults but for 32 probes.

    LAMBERT=… OMP_WAIT_POLICY=passive /usr/bin/python3 tests/bench/forecasts.py [--elements N] [--add OPTIONS] [SCENE …]

SCENE is the kind of a generated scene (cornell, rooms, maze, atrium, patio, canopy, anechoic, city1, city2, city3) or a file.
Without one all generated kinds are taken. A factor is the larger of both over the smaller. Asserts nothing.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile

KINDS = {"cornell": ["cornell", "--closed"], **{kind: [kind] for kind in ("rooms", "maze", "atrium", "patio", "canopy", "anechoic")},
         "city1": ["city", "--variant", "1"], "city2": ["city", "--variant", "2", "--terrain", "valley"],
         "city3": ["city", "--variant", "3", "--terrain", "hill"]}
STAGES = ("form factors", "operator", "judge")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", default=list(KINDS))
    parser.add_argument("--elements", type=int, default=8000)
    parser.add_argument("--add", default="")
    asked = parser.parse_args()
    program = os.environ.get("LAMBERT", "lambert")
    print(f"{'scene':12} {'elements':>8} " + " ".join(f"{stage:>21}" for stage in (*STAGES, "all")))
    with tempfile.TemporaryDirectory() as folder:
        for scene in asked.scenes:
            path = scene
            if scene in KINDS:
                path = os.path.join(folder, f"{scene}.obj")
                subprocess.run([program, "generate", *KINDS[scene], "--elements", str(asked.elements), "-o", path], check=True,
                               stdout=subprocess.DEVNULL)
            command = [program, "precompute", path, "-o", os.path.join(folder, "s.h5"), "--json", "--mesh", "faces", "--probes", "32"]
            done = subprocess.run(command + asked.add.split(), check=True, capture_output=True, text=True)
            about = json.loads(done.stdout)
            forecast, taken = about.get("forecast_processor_seconds", {}), about["processor_seconds"]
            pairs = [(forecast.get(stage, 0), taken[stage]) for stage in STAGES]
            pairs.append(tuple(sum(column) for column in zip(*pairs)))
            cells = [f"{f:7.2f} {t:7.2f} x{max(f, t) / max(min(f, t), 1e-3):4.2f}" if f > 0 else f"{'-':>7} {t:7.2f}      "
                     for f, t in pairs]
            print(f"{pathlib.Path(scene).stem:12} {about['elements']:8} " + " ".join(f"{cell:>21}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
