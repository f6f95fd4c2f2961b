#!/usr/bin/env python3
"""The form factors that a store keeps, entry by entry. Usage: read_form_factors.py STORE.h5"""
import sys

import h5py
import numpy as np

with h5py.File(sys.argv[1]) as f:
    A, g = f["mesh/area"][()], f["form_factors"]
    i = np.repeat(np.arange(len(A)), np.diff(g["indptr"][()].astype(np.int64)))
    j, F = g["indices"][()], g["data"][()].astype(float)        # F[p] is F_ij of i[p], j[p]
    if g.attrs["storage"] == b"upper":
        i, j, F = np.r_[i, j], np.r_[j, i], np.minimum(1, np.r_[F / A[i], F / A[j]]).astype("f4").astype(float)
print(len(F), "form factors; the largest is", F.max())
