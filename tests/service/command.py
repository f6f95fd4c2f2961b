"""Runs `lambert` for a test, on as many threads wherever it runs, in the C locale."""

import contextlib
import io
import os
import pathlib
import runpy
import subprocess
import sys
import unittest.mock

from patience import PATIENCE

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "examples"
LAMBERT = os.environ["LAMBERT"]
# The program that makes what others are compared with, where another build has made one that is quicker.
REFERENCE = os.environ.get("LAMBERT_REFERENCE") or LAMBERT
# Under sanitizers: scenes of tests that an optimised build runs as they are may be small.
SMALL = "SMALL" in os.environ
ENVIRONMENT = dict(os.environ, OMP_NUM_THREADS="2", LC_ALL="C")


MESH_OPTIONS = ("--mesh", "--mesh-error", "--elements", "--max-edge")


def of_faces(arguments):
    """The arguments of a command that makes a mesh of a scene, whose faces are the elements where no option of the mesh says
    otherwise: most tests are about what comes after the mesh, and know their elements. A test of presets says --mesh light."""
    arguments = [*map(str, arguments)]
    makes = len(arguments) > 2 and arguments[0] in ("precompute", "classify") and not arguments[1].startswith("-")
    if not makes or arguments[1].endswith(".h5") or any(a.split("=")[0] in MESH_OPTIONS for a in arguments):
        return arguments
    return [*arguments[:2], "--mesh", "faces", *arguments[2:]]


def lambert(*arguments, threads=2, program=LAMBERT, **more):
    environment = dict(ENVIRONMENT, OMP_NUM_THREADS=str(threads))
    return subprocess.run([program, *of_faces(arguments)], capture_output=True, text=True, timeout=PATIENCE,
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
