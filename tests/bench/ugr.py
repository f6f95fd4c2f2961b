#!/usr/bin/env python3
"""UGR in rooms of CIE 190 against the tables of Relux.

    tests/bench/ugr.py build/release/lambert [SAMPLE,... [all]]

Samples are 02, 07 and 09 of tests/fixtures/luminaires; rooms 4H x 8H, 8H x 4H and 8H x 8H with reflectances .7 .5 .2 and
.3 .3 .2, or all that Relux has, across and along the lamps. A line for each, then mean and largest difference of each sample.
The exit status is 1 where one of .5 or more is among them."""
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "service"))
from ugr_rooms import REFLECTANCES, ROOMS, ROUND, eyes_of, table  # noqa: E402

LIMIT = .5


def main(program, samples="02,07,09", which=""):
    def run(*words):
        return subprocess.run([program, *map(str, words)], check=True, text=True, capture_output=True).stdout

    floors = sorted({tuple(sorted(room)) for room in ROOMS}) if which == "all" else [(4, 8), (8, 8)]
    sets = REFLECTANCES if which == "all" else [REFLECTANCES[0], REFLECTANCES[-1]]
    worst = 0
    print(f"{'sample':8s} {'room':9s} {'reflectances':14s} {'view':7s} {'UGR':>6s} {'Relux':>6s} {'apart':>6s}")
    for sample in samples.split(","):
        wanted, apart = table(sample), []
        for floor in floors:
            # Lamps along the longer side and along the shorter one: each gives a view of two rooms, or both of a square.
            for sides in sorted({floor, floor[::-1]})[: 1 if sample in ROUND else 2]:
                for reflectances in sets:
                    with tempfile.TemporaryDirectory() as folder:
                        eyes = eyes_of(run, folder, sample, sides, reflectances)
                    for (room, view), eye in eyes.items():
                        if (room, reflectances, view) not in wanted:
                            continue
                        found, known = eye["ugr"], wanted[room, reflectances, view]
                        apart.append(found - known)
                        print(f"{sample:8s} {room[0]:2d}H x {room[1]:2d}H {' '.join(f'{r:.1f}' for r in reflectances):14s} {view:7s} "
                              f"{found:6.2f} {known:6.1f} {apart[-1]:+6.2f}", flush=True)
        print(f"sample {sample}: {len(apart)} of them, mean {sum(apart) / len(apart):+.2f}, largest {max(map(abs, apart)):.2f}", flush=True)
        worst = max(worst, *map(abs, apart))
    return worst >= LIMIT


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
