"""The Python package of the tree, and scenes and a daemon for its tests."""

import os
import pathlib
import sys
import tempfile
import unittest

import h5py
import numpy as np

from command import must
from daemon import Daemon

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "deploy" / "python"
sys.dont_write_bytecode = True  # nothing is written into the tree
sys.path.insert(0, str(PACKAGE))

import lambert  # noqa: E402

TOKEN = "secret"
SPOT = """IESNA:LM-63-2002
TILT=NONE
1 -1 1 4 1 1 2 .3 1.2 0
1 1 30
0 30 60 90
0
1000 850 450 0
"""
LIGHTS = """{"luminaires":[{"name":"row","file":"spot.ies","from":[1.5,1.5,2.8],"steps":[[3,0,0]],"counts":[2]},
               {"name":"desk","file":"spot.ies","at":[3,4.5,2.8],"dim":0.5}]}"""
POINTS = """{"grids":[{"name":"desks","over":"floor","height":0.85,"spacing":0.5,"border":0.5}]}"""


def make_stores(folder, names=None):
    """Stores by name, all or those named: one of each kind of operator, and of each kind of light and mesh."""
    root = pathlib.Path(folder)
    for name, text in (("spot.ies", SPOT), ("lights.json", LIGHTS), ("points.json", POINTS)):
        (root / name).write_text(text)
    must("generate", "cornell", "--elements", 400, "-o", root / "box.obj")
    must("generate", "box", "--size", "6,6,3", "-o", root / "office.obj")
    must("generate", "city", "--elements", 200, "-o", root / "yard.obj")
    must("generate", "canopy", "--elements", 150, "-o", root / "leaves.obj")
    stores = {}

    def make(name, scene, *options):
        if names is not None and name not in names:
            return
        stores[name] = str(root / f"{name}.h5")
        must("precompute", root / scene, "-o", stores[name], "--probes", 4, "--quiet", *options)

    office = ("office.obj", "--reflectance", 0.5, "--elements", 300, "--luminaires", root / "lights.json", "--quiet")
    make("box", "box.obj", "--mesh", "faces", "--keep-form-factors")
    make("paint", "box.h5", "--method", "low-rank", "--keep-factors")
    make("coarse", "box.h5", "--method", "2msc", "--coherence", 0.8)
    make("thin", "box.h5", "--method", "sparse", "--threshold", 1e-3)
    make("waves", "box.h5", "--method", "hierarchical", "--epsilon", 0.05)
    make("office", *office, "--sensors", root / "points.json", "--method", "low-rank")
    make("few", *office, "--method", "emitters", "--emitters", "group=ceiling")
    make("dome", "box.obj", "--mesh", "faces", "--closed=no", "--sky", "grid:4x2", "--method", "emitters", "--emitters", "sky")
    make("merged", "box.obj", "--mesh-error", 0.2)  # elements are parts of several faces
    make("leaves", "leaves.obj", "--mesh", "faces", "--two-sided", "--sky", "tregenza", "--method", "exact")
    make("yard", "yard.obj", "--mesh", "faces", "--sky", "tregenza", "--method", "exact")
    return stores


class PackageCase(unittest.TestCase):
    """One daemon with all stores, made once."""

    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory(prefix="lambert-python-")
        cls.addClassCleanup(cls.shared.cleanup)
        cls.stores = make_stores(cls.shared.name)
        tokens = pathlib.Path(cls.shared.name, "tokens")
        tokens.write_text(TOKEN)
        tokens.chmod(0o600)
        cls.daemon = cls.enterClassContext(Daemon(*cls.stores.values(), "--token-file", tokens, "--max-variants", 4))
        cls.address = f"http://127.0.0.1:{cls.daemon.port}"

    def scene(self, name, **more):
        return lambert.Scene(f"{self.address}/{name}", token=TOKEN, **more)

    def mesh(self, name):
        with h5py.File(self.stores[name], "r") as f:
            return {key: f["mesh"][key][()] for key in ("area", "normal", "group", "group_names", "reflectance", "emission")}


def random_emission(scene, seed=1, *shape):
    """Of either sign: as answers are shaped, or of more of them."""
    return np.random.default_rng(seed).normal(size=(*shape, *scene.shape))
