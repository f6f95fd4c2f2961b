"""A courtyard under a sky, and its dense solution in double of what h5py reads from a store alone."""

import h5py
import numpy as np

from command import must


# A courtyard: a floor, two walls and a lamp that lies on the floor; one wall is black. The fronts look inwards.
YARD = """mtllib yard.mtl
v 0 0 0
v 4 0 0
v 4 4 0
v 0 4 0
v 0 0 3
v 4 0 3
v 4 4 3
v 1 1 .01
v 2 1 .01
v 2 2 .01
v 1 2 .01
o floor
usemtl floor
f 1 2 3 4
o south
usemtl wall
f 1 5 6 2
o east
usemtl black
f 2 6 7 3
o lamp
usemtl lamp
f 8 9 10 11
"""
MATERIALS = """newmtl floor
Kd {floor}
newmtl wall
Kd 0.6 0.6 0.6
newmtl black
Kd 0 0 0
newmtl lamp
Kd 0.3 0.3 0.3
Ke 5 5 5
"""


def write_yard(folder, floor="0.7 0.4 0.2"):
    """Writes the scene into a folder; returns its path."""
    (folder / "yard.mtl").write_text(MATERIALS.format(floor=floor))
    (folder / "yard.obj").write_text(YARD)
    return folder / "yard.obj"


def precompute_yard(folder, name, *options, probes=0):
    """A store of the yard that keeps what Truth needs; returns its path."""
    path = folder / f"{name}.h5"
    must("precompute", write_yard(folder), "-o", path, "--elements", 120, "--rays", 1024, "--probes", probes, "--sky", "grid:4x3",
         "--keep-form-factors", *options)
    return path


class Truth:
    """The dense solution of a store that keeps its form factors."""

    def __init__(self, path):
        with h5py.File(path) as f:
            self.rho = f["mesh/reflectance"][()].astype(float)
            self.C, self.n = self.rho.shape
            self.F = np.zeros((self.n, self.n))
            pointers, columns, values = (f["form_factors/" + name][()] for name in ("indptr", "indices", "data"))
            for i in range(self.n):
                row = slice(int(pointers[i]), int(pointers[i + 1]))
                self.F[i, columns[row]] = values[row]
            self.first_bounce = f["sky/first_bounce"][()].astype(float)
            self.tiles = f["sky/tiles"][()]
            self.attributes = {k: v.decode() if isinstance(v, bytes) else v for k, v in f["sky"].attrs.items()}
            self.area = f["mesh/area"][()]
            self.normal = f["mesh/normal"][()].astype(float)
            self.group = f["mesh/group"][()]
            self.groups = [name.decode() for name in f["mesh/group_names"][()]]

    def solve(self, E, L, quantity):
        """E is [C][n], L is [C][m]."""
        out = np.empty((self.C, self.n))
        for c in range(self.C):
            rho, H0 = self.rho[c], L[c] @ self.first_bounce
            B = np.linalg.solve(np.eye(self.n) - rho[:, None] * self.F, E[c] + rho * H0)
            H = H0 + self.F @ B
            out[c] = {"radiosity": B, "irradiance": H, "indirect": B - E[c] - rho * H0}[quantity]
        return out

    def lamp(self, value):
        E = np.zeros((self.C, self.n))
        E[:, self.group == self.groups.index("lamp")] = value
        return E
