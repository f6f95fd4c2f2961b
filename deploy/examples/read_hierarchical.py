#!/usr/bin/env python3
"""The radiosity of a hierarchical store under the scene's own lights, in double.

Usage: read_hierarchical.py STORE.h5
"""
import sys

import h5py
import numpy as np

from multiwavelets import forward, inverse, read_basis


def numbers(K, first, size):  # rows, columns and values of K over the steps, which are all that is not 0
    four = K["four"][()].view(np.uint8)
    column = four[:, :4].copy().view("<u4") + four[:, 4:12].copy().view("<u2").astype(int)
    digit = four[:, 12:].view(np.int8).reshape(-1, 3, 4, 3)
    planes = (len(K["begin"]) - 1) // len(first)
    group, plane = np.divmod(np.repeat(np.arange(planes * len(first)), np.diff(K["begin"][()].astype(int))), planes)
    place = np.concatenate([f + np.arange(s) for f, s in zip(first, size)])        # of each coefficient
    f, r, t, s = np.nonzero(digit)
    return first[group[f]] + r, place[column[f, t] + s], digit[f, r, t, s] * 256. ** (planes - 1 - plane[f])


def older_numbers(K, first):  # the same of stores that have one triangle
    count, tile, digit = K["count"][()], K["tile"][()], K["digit"][()]
    gap = (tile >> 9).astype(int)
    gap[gap == 127] = K["far"][()]
    plane, rows = np.divmod(np.repeat(np.arange(count.size), count.ravel()), len(first))     # of every tile
    begin, ends = np.repeat(np.cumsum(count) - count.ravel(), count.ravel()), np.r_[0, np.cumsum(gap)]
    columns = rows + ends[1:] - ends[begin]
    t, bit = np.nonzero(tile[:, None] >> np.arange(9) & 1)                                   # of every digit
    i, j, value = first[rows[t]] + bit // 3, first[columns[t]] + bit % 3, digit * 256. ** plane[t]
    above = i != j
    return np.r_[i, j[above]], np.r_[j, i[above]], np.r_[value, value[above]]


with h5py.File(sys.argv[1]) as f:
    E, o = f["mesh/emission"][0].astype(float), f["operator"]   # or any other [n]
    order, rho, K, n = o["order"][()], f["mesh/reflectance"][0].astype(float), o["K/0"], len(E)
    basis, root = read_basis(o["basis"]), np.sqrt(f["mesh/area"][()])[order]
    first, size = o["groups/rows"][()].astype(int).T
    i, j, value = numbers(K, first, size) if "four" in K else older_numbers(K, first)
    step = np.ones(n)
    for k in range(3):
        step[(first + k)[size > k]] = o["groups/step"][()][size > k]
    even = (o["missing"][0].astype(float), o["even_light"][0]) if "missing" in o else None
c = step * forward(*basis, root * E[order])
c = step * np.bincount(i, value * c[j], n)
B = E.copy()
B[order] += rho[order] * inverse(*basis, c) / root      # B = E + R A^-1/2 W' K W A^1/2 E
if even is not None:
    B[order] += rho[order] * even[0] * (root**2 @ E[order]) / even[1]
print(*B, sep="\n")
