#!/usr/bin/env python3
"""Compares every checksum of a store with its data, by the package xxhash. Usage: read_checksums.py STORE.h5"""
import sys

import h5py
import numpy as np
import xxhash

total = xxhash.xxh3_64()
with h5py.File(sys.argv[1]) as f:
    paths = []
    f["checksum"].visititems(lambda p, o: paths.append("/" + p) if isinstance(o, h5py.Dataset) else None)
    for path in sorted(paths, key=str.encode):
        raw, sums = np.ascontiguousarray(f[path][()]).tobytes(), f["checksum" + path][()]
        assert [xxhash.xxh3_64_intdigest(raw[i:i + 2**20]) for i in range(0, len(raw), 2**20)] == list(sums)
        total.update(path.encode() + b"\0" + sums.tobytes())
    assert total.hexdigest() == f["checksum"].attrs["xxh3"].decode()
print(len(paths), "datasets are as they were written")
