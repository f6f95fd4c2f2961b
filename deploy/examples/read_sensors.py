#!/usr/bin/env python3
"""The values at the sensors of a store: its luminaires as its list dims them, and what elements of radiosity B send there.

Usage: read_sensors.py STORE.h5 [B.npy]     B: as lambert solve -o B.npy writes it; without it, the scene's own emission
"""
import sys

import h5py
import numpy as np


def gather(path, B=None):
    """{set: values [C][points]}; NaN where a point lies in a wall or in a luminaire."""
    with h5py.File(path) as f:
        s = f["sensors"]
        B = np.reshape(f["mesh/emission"] if B is None else B, f["mesh/emission"].shape).astype(float)
        terms = s["weights"][()] * B[:, s["indices"][()]]
        sums = np.pad(np.cumsum(terms, axis=1), ((0, 0), (1, 0)))[:, s["indptr"][()].astype(int)]
        values = np.diff(sums, axis=1)                          # of rows, some of which may be empty
        if "luminaires" in s:
            colour = f["luminaires/colour"][()] if len(B) == 3 else np.ones((len(s["luminaires"]), 1))
            values += (f["luminaires/dimmers"][()][:, None] * colour).T @ s["luminaires"][()]
        values[:, s["flags"][()] != 0] = np.nan
        first = s["first"][()].astype(int)
        return {name.decode(): values[:, a:b] for name, a, b in zip(s["names"], first, first[1:])}


if __name__ == "__main__":
    for name, values in gather(sys.argv[1], np.load(sys.argv[2]) if len(sys.argv) > 2 else None).items():
        print(name, *values.T)
