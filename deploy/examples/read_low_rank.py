#!/usr/bin/env python3
"""The radiosity of a folded store of low rank or of two meshes, under the scene's own lights, in double.

Usage: read_low_rank.py STORE.h5
"""
import sys

import h5py
import numpy as np

with h5py.File(sys.argv[1]) as f:
    E = f["mesh/emission"][0].astype(float)                     # or any other [n]
    order = f["operator/order"][()] if "order" in f["operator"] else np.arange(len(E))
    Y = f["operator/Y"][()].astype(float)
    if "V" in f["operator"]:
        V = f["operator/V"][()].astype(float)
        T = V.T @ E[order]
    else:                                                       # two meshes: V has one weight a row
        I, w = f["operator/I"][()].astype(int), f["operator/weight"][()] if "weight" in f["operator"] else 1.
        T = np.add.reduceat(w * E[order], I[:-1])               # no patch that lambert writes is empty
    black = f["mesh/reflectance"][0] == 0
B = E.copy()
B[order] -= Y @ T                                               # B = E - Y (V' E), row by position
B[black] = E[black]
print(*B, sep="\n")
