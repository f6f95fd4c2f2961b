"""Runs `lambert` for a test, on as many threads wherever it runs, in the C locale."""

import os
import subprocess

LAMBERT = os.environ["LAMBERT"]
ENVIRONMENT = dict(os.environ, OMP_NUM_THREADS="2", LC_ALL="C")


def lambert(*arguments, threads=2, **more):
    environment = dict(ENVIRONMENT, OMP_NUM_THREADS=str(threads))
    return subprocess.run([LAMBERT, *map(str, arguments)], capture_output=True, text=True, timeout=600,
                          env=environment, check=False, **more)


def must(*arguments, **more):
    done = lambert(*arguments, **more)
    assert done.returncode == 0, (arguments, done.stderr)
    return done
