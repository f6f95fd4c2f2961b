#!/usr/bin/env python3
"""Direct illumination H = F E of the scene's own lights, by compressed form factors, in double.

Usage: read_compressed.py STORE.h5
"""
import sys

import h5py
import numpy as np

from multiwavelets import forward, inverse, read_basis

with h5py.File(sys.argv[1]) as f:
    x, o, area = f["mesh/emission"][0].astype(float), f["form_factors"], f["mesh/area"][()]
    order, S, n, lit = o["order"][()], o["data"][()].astype(float), len(x), o["lit"][()].astype(float)
    basis = read_basis(o["basis"])
    i, j = np.repeat(np.arange(n), np.diff(o["indptr"][()].astype(int))), o["indices"][()]
    of = [np.flatnonzero(f["mesh/group"][()] == g) for g in o["lit_group"][()]]
mean = np.array([area[k] @ x[k] / area[k].sum() for k in of])
y, root, above = x.copy(), np.sqrt(area)[order], i != j
for k, m in zip(of, mean):
    y[k] -= m
c = forward(*basis, root * y[order])
c = np.bincount(i, S * c[j], n) + np.bincount(j[above], (S * c[i])[above], n)
H = mean @ lit                                                  # F x = sum_g m_g F 1_g + A^-1/2 W' S W A^1/2 y
H[order] += inverse(*basis, c) / root
print(*H, sep="\n")
