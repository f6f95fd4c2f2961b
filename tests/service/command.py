"""Runs `lambert` for a test, on as many threads wherever it runs, in the C locale."""

import contextlib
import io
import os
import pathlib
import runpy
import subprocess
import sys
import unittest.mock

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "examples"
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


def example(name, store):
    """Runs a program of deploy/examples on a store; the names that it leaves behind."""
    with unittest.mock.patch.object(sys, "argv", [name, str(store)]), \
            unittest.mock.patch.object(sys, "path", [str(EXAMPLES), *sys.path]), contextlib.redirect_stdout(io.StringIO()):
        return runpy.run_path(str(EXAMPLES / name))
