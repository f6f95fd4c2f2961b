#!/usr/bin/env python3
"""Direct illumination H = F E of the scene's own lights, by form factors kept as blocks, in double.

Usage: read_blocks.py STORE.h5
"""
import sys

import h5py
import numpy as np

with h5py.File(sys.argv[1]) as f:
    x, o = f["mesh/emission"][0].astype(float), f["form_factors"]
    order, places, d = o["order"][()], o["places"][()], o["balance"][()]
    clusters, rectangles, data = o["clusters"][()].astype(int), o["rectangles"][()], o["data"][()].astype(float)
    a, b = np.repeat(np.arange(len(o["indptr"]) - 1), np.diff(o["indptr"][()].astype(int))), o["indices"][()]
    area = f["mesh/area"][()][order]
n = len(order)


def functions(t):
    """The positions of node t, and 1, u, v at their elements, without those that the node does not have."""
    if t >= len(clusters):
        return slice(t - len(clusters), t - len(clusters) + 1), np.ones((1, 1))
    here, over = slice(*clusters[t, :2]), rectangles[t, 2:]
    m = (places[here] - rectangles[t, :2]) * over
    return here, np.column_stack([np.ones(len(m)), m[:, over != 0]])


nodes = [functions(t) for t in range(len(clusters) + n)]
sent, H, at = area * d * x[order], np.zeros(n), 0
for k, j in zip(a, b):
    (i, m), (j, w) = nodes[k], nodes[j]
    L = data[at:at + m.shape[1] * w.shape[1]].reshape(m.shape[1], w.shape[1])   # F_ij = A_j d_i d_j m_a(i)' L m_b(j)
    H[i] += m @ (L @ (w.T @ sent[j]))
    H[j] += w @ (L.T @ (m.T @ sent[i]))
    at += L.size
H *= d
H = H[np.argsort(order)]
print(*H, sep="\n")
