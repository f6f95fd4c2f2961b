#!/usr/bin/env python3
"""The radiosity of a hierarchical store under the scene's own lights, in double.

Usage: read_hierarchical.py STORE.h5
"""
import sys

import h5py
import numpy as np

from multiwavelets import forward, inverse, read_basis

with h5py.File(sys.argv[1]) as f:
    E, o = f["mesh/emission"][0].astype(float), f["operator"]   # or any other [n]
    order, rho, K, n = o["order"][()], f["mesh/reflectance"][0].astype(float), o["K/0"], len(E)
    basis = read_basis(o["basis"])
    root, value = np.sqrt(f["mesh/area"][()])[order], K["data"][()].astype(float) * K.attrs["scale"]
    count, steps = K["count"][()].astype(int), np.r_[0, np.cumsum(K["gap"][()], dtype=int)]
    even = (o["missing"][0].astype(float), o["even_light"][0]) if "missing" in o else None
i = np.repeat(np.arange(n), count)
j = i + steps[1:] - np.repeat(steps[np.cumsum(count) - count], count)
c, above = forward(*basis, root * E[order]), i != j
c = np.bincount(i, value * c[j], n) + np.bincount(j[above], (value * c[i])[above], n)
B = E.copy()
B[order] += rho[order] * inverse(*basis, c) / root      # B = E + R A^-1/2 W' K W A^1/2 E
if even is not None:
    B[order] += rho[order] * even[0] * (root**2 @ E[order]) / even[1]
print(*B, sep="\n")
