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
    basis, root = read_basis(o["basis"]), np.sqrt(f["mesh/area"][()])[order]
    first, step = o["groups/rows"][:, 0].astype(int), o["groups/step"][()].astype(float)
    count, tile, digit = K["count"][()], K["tile"][()], K["digit"][()]
    gap = (tile >> 9).astype(int)
    gap[gap == 127] = K["far"][()]
    even = (o["missing"][0].astype(float), o["even_light"][0]) if "missing" in o else None
plane, rows = np.divmod(np.repeat(np.arange(count.size), count.ravel()), len(first))     # of every tile
begin, ends = np.repeat(np.cumsum(count) - count.ravel(), count.ravel()), np.r_[0, np.cumsum(gap)]
columns = rows + ends[1:] - ends[begin]
t, bit = np.nonzero(tile[:, None] >> np.arange(9) & 1)                                   # of every digit
value = digit * 256. ** plane[t] * step[rows[t]] * step[columns[t]]
i, j = first[rows[t]] + bit // 3, first[columns[t]] + bit % 3
c, above = forward(*basis, root * E[order]), i != j
c = np.bincount(i, value * c[j], n) + np.bincount(j[above], (value * c[i])[above], n)
B = E.copy()
B[order] += rho[order] * inverse(*basis, c) / root      # B = E + R A^-1/2 W' K W A^1/2 E
if even is not None:
    B[order] += rho[order] * even[0] * (root**2 @ E[order]) / even[1]
print(*B, sep="\n")
