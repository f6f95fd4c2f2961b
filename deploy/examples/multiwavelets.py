"""The basis of area-weighted multiwavelets that stores keep, and its transforms, as store/FORMAT.md describes them."""
import numpy as np


def read_basis(basis):
    shape, node = basis["shape"][()].astype(int), basis["node"][()]
    Q = np.split(basis["basis"][()].astype(float), np.cumsum(shape[:, 1] ** 2)[:-1])
    Q = [q.reshape(s[1], s[1]) for q, s in zip(Q, shape)]
    return shape, node, Q


def forward(shape, node, Q, x):  # W x
    c, up = [], []
    for leaf, taken, handed, q in ((*shape[k], Q[k]) for k in node):
        v, x = (x[:taken], x[taken:]) if leaf else (np.concatenate([up.pop(-2), up.pop()]), x)
        up.append(q[:handed] @ v)
        c.append(q[handed:] @ v)
    return np.concatenate(c + up)


def inverse(shape, node, Q, c):  # W' c
    x, last = [], len(c) - shape[node[-1], 2]
    down, c = [c[last:]], c[:last]
    for t in range(len(node) - 1, -1, -1):
        leaf, taken, handed = shape[node[t]]
        own, c = c[len(c) - (taken - handed):], c[:len(c) - (taken - handed)]
        v = Q[node[t]].T @ np.concatenate([down.pop(), own])
        right = taken if leaf else shape[node[t - 1], 2]
        x, down = (x + [v], down) if leaf else (x, down + [v[:-right], v[-right:]])
    return np.concatenate(x[::-1])
