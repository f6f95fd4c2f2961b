"""Operators by NumPy alone, as store/FORMAT.md defines them: low_rank, two_mesh, exact, sparse and emitters.

Each gives H = F B of an emission in the order of its positions; radiosity, irradiance and indirect light follow from that.
Light below zero is taken out as liblambert does (solver/operator/limiter.h).
"""

from __future__ import annotations

import importlib
from typing import Any, Callable, List, Optional

import numpy as np

from .errors import Refused, Unsupported
from .store import Store, _text
from .wire import Array

BLOCK = 32  # elements that the limiter takes together
Map = Callable[[int, Array], Array]  # of a channel and columns [n, m]


class NumpyOperator:
    """M~ of a store; vectors are [m, C, n] in mesh order."""

    def __init__(self, store: Store, rho: Optional[Array] = None) -> None:
        self.store, self.rho = store, store.rho.astype(float) if rho is None else rho
        self.n, self.channels, self.emitters = store.n, store.channels, 0
        self.names: List[str] = []
        h5py = importlib.import_module("h5py")
        with h5py.File(store.path, "r") as file:
            group = file["operator"]
            self.kind, self.form = _text(group.attrs["kind"]), _text(group.attrs.get("form", ""))
            if self.kind not in ("low_rank", "two_mesh", "exact", "sparse", "emitters"):
                raise Unsupported(f"{store.path}: an operator of the kind {self.kind} needs liblambert, which was not found; set "
                                  f"LAMBERT_LIBRARY, or ask a daemon: with lambert.serve({store.path!r}) as daemon")
            if rho is not None and self.form != "factored":
                raise Refused(f"{store.path}: keeps no factors, so that it cannot have other materials; precompute it with --keep-factors")
            self.order = group["order"][()].astype(int) if "order" in group else np.arange(self.n)
            self._read(group, rho is not None)
        # Where nothing is reflected the row is that of a reflectance of 1.
        self._divisor = np.where(self.rho > 0, self.rho, 1)

    def _read(self, group: Any, other_rho: bool) -> None:
        def scaled(name: str) -> Array:
            scale = group[name + "_scale"][()] if name + "_scale" in group else 1
            return np.asarray(group[name][()].astype(float) * scale)

        if self.kind == "emitters":
            self._read_emitters(group)
        elif self.kind == "exact":
            M: Array = group["M"][()].astype(float)
            self._forward, self._backward = (lambda c, X: M[c] @ X - X), (lambda c, X: M[c].T @ X - X)
        elif self.kind == "sparse":
            self._read_sparse(group)
        else:
            start = group["I"][()].astype(int)[:-1] if "I" in group else None
            weight = group["weight"][()].astype(float) if "weight" in group else np.ones(self.n)
            V = scaled("V") if start is None else None
            patch = None if start is None else np.repeat(np.arange(len(start)), np.diff(np.append(start, self.n)))

            def gather(X: Array) -> Array:
                return np.asarray(V.T @ X if V is not None else np.add.reduceat(weight[:, None] * X, start, axis=0))

            def spread(T: Array) -> Array:
                return np.asarray(V @ T if V is not None else weight[:, None] * T[patch])

            if self.form == "factored":
                U = scaled("U")
                core = [np.linalg.inv(np.eye(U.shape[1]) - gather(self.rho[c][self.order][:, None] * U)) for c in range(self.channels)] \
                    if other_rho else list(group["core"][()].astype(float))
                self._forward = lambda c, X: U @ (core[c] @ gather(X))
                self._backward = lambda c, X: spread(core[c].T @ (U.T @ X))
            else:
                Y = scaled("Y")
                self._forward, self._backward = (lambda c, X: -(Y @ gather(X))), (lambda c, X: -spread(Y.T @ X))

    def _read_sparse(self, group: Any) -> None:
        rows, delta = [], group["delta"][()].astype(float) if "delta" in group else None
        for c in range(self.channels):
            of = group[f"M/{c}"]
            indptr = of["indptr"][()].astype(int)
            rows.append((np.repeat(np.arange(self.n), np.diff(indptr)), of["indices"][()].astype(int), of["data"][()].astype(float)))
        if "delta_part" in group:
            part, weight = group["delta_part"][()].astype(int), group["delta_weight_in_part"][()].astype(float)
        else:
            part = np.zeros(self.n, int)
            weight = group["delta_weight"][()].astype(float) if delta is not None else np.zeros(self.n)

        def product(c: int, X: Array, back: bool) -> Array:
            i, j, values = rows[c]
            i, j = (j, i) if back else (i, j)
            made = np.stack([np.bincount(i, values * x[j], self.n) for x in X.T], 1)
            if delta is not None:
                a, b = (weight, delta[c]) if back else (delta[c], weight)
                sums = np.stack([np.bincount(part, b * x, self.n) for x in X.T], 1)
                made += a[:, None] * sums[part]
            return np.asarray(made)

        self._forward, self._backward = (lambda c, X: product(c, X, False)), (lambda c, X: product(c, X, True))

    def _read_emitters(self, group: Any) -> None:
        self.names = [text.decode() for text in group["names"][()]]
        self.emitters = s = len(self.names)
        C, n, store = self.channels, self.n, self.store
        E = np.zeros((C * s, n))
        indptr = group["E/indptr"][()].astype(int)
        E[np.repeat(np.arange(C * s), np.diff(indptr)), group["E/indices"][()].astype(int)] = group["E/data"][()]
        self.E = E.reshape(C, s, n)
        self.L: Optional[Array] = group["L"][()].astype(float) if "L" in group else None
        H0 = np.zeros((C, s, n))
        if self.L is not None and store.sky is not None:
            H0 += self.L @ store.sky["first_bounce"]
        self.outside = "direct" in group
        if self.outside:
            H0 += group["exitance"][()].astype(float)[:, None, None] * group["direct"][()]
        self.first_luminaire = s - int(group.attrs.get("luminaires", 0))
        if store.luminaires is not None and self.first_luminaire < s and not self.outside:
            H0[:, self.first_luminaire:] += store.luminaires["factors"][:, :, None] * store.luminaires["irradiance"]
        self.H0 = H0
        B = group["B"][()].astype(float)
        if "order" in group:  # rows are positions
            by_element = np.empty_like(B)
            by_element[:, :, self.order] = B
            B = by_element
        self.T = B - self.E

    # Light of emissions.

    def _map(self, what: Map, x: Array) -> Array:
        """The map of vectors [m, C, n] in mesh order."""
        made = np.empty(x.shape)
        for c in range(self.channels):
            made[:, c, self.order] = what(c, np.ascontiguousarray(x[:, c, self.order].T)).T
        return made

    def apply(self, quantity: str, E: Array, H0: Optional[Array]) -> Array:
        """The quantity [m, C, n] under E and the irradiance H0 of a sky or of luminaires."""
        lit = E.astype(float) if H0 is None else E + self.rho * H0
        H = self._map(self._forward, lit)
        if self.form != "factored":
            H /= self._divisor
        if quantity == "radiosity":
            H = lit + self.rho * H
        elif quantity == "indirect":
            H = self.rho * H
        elif H0 is not None:
            H += H0
        return np.asarray(H, np.float32)

    def adjoint(self, quantity: str, g: Array) -> Array:
        """The gradient of <g, quantity> by E, [m, C, n]."""
        back = g if quantity == "irradiance" else self.rho * g
        w = self._map(self._backward, back if self.form == "factored" else back / self._divisor)
        return np.asarray(w + g if quantity == "radiosity" else w, np.float32)

    # Light of few emitters, by their weights [m, C, s].

    def apply_emitters(self, quantity: str, W: Array) -> Array:
        T = np.einsum("mcs,csn->mcn", W, self.T)
        if quantity == "irradiance":
            return np.asarray(T / self._divisor, np.float32)
        T = np.where(self.rho > 0, T, 0)
        if quantity == "radiosity":
            T += np.einsum("mcs,csn->mcn", W, self.E)
        else:
            T -= self.rho * np.einsum("mcs,csn->mcn", W, self.H0)
        return np.asarray(T, np.float32)

    def adjoint_emitters(self, quantity: str, g: Array) -> Array:
        g = g.astype(float)
        if quantity == "irradiance":
            return np.asarray(np.einsum("mcn,csn->mcs", g / self._divisor, self.T), np.float32)
        made = np.einsum("mcn,csn->mcs", g * (self.rho > 0), self.T)
        if quantity == "radiosity":
            made += np.einsum("mcn,csn->mcs", g, self.E)
        else:
            made -= np.einsum("mcn,csn->mcs", g * self.rho, self.H0)
        return np.asarray(made, np.float32)

    def weights(self, E: Array, L: Optional[Array]) -> Array:
        """The weights [C, s] whose emitters send E [C, n] and the sky L [C, tiles]; Refused where none do."""
        return emitter_weights(self, E, L)

    # Light below zero.

    def limit(self, quantity: str, E: Optional[Array], H0: Optional[Array], W: Optional[Array], out: Array) -> List[int]:
        """Raises what is below zero in out, and keeps the means of groups; how many elements that were, of each vector."""
        order = np.argsort(self.store.group, kind="stable")
        start = np.searchsorted(self.store.group[order], np.arange(len(self.store.group_names) + 1))
        counts = []
        for v in range(len(out)):
            negative = 0
            for c in range(self.channels):
                if any(x is not None and (x[v, c] < 0).any() for x in (E, H0, W)):
                    continue
                direct = np.zeros(self.n, np.float32)
                if quantity == "radiosity" and E is not None:
                    direct = (E[v, c] + (0 if H0 is None else self.rho[c] * H0[v, c])).astype(np.float32)
                elif quantity == "irradiance" and H0 is not None:
                    direct = H0[v, c].astype(np.float32)
                if not (out[v, c] < direct).any():
                    continue
                for g in range(len(start) - 1):
                    negative += self._limit_group(order[start[g]:start[g + 1]], direct, out[v, c])
            counts.append(negative)
        return counts

    def _limit_group(self, of: Array, direct: Array, out: Array) -> int:
        negative = out[of] < direct[of]
        if not negative.any():
            return 0
        x, A = out[of].astype(float) - direct[of], self.store.area[of]
        edges = list(range(0, len(of), BLOCK))
        sums = [float(A[a:a + BLOCK] @ x[a:a + BLOCK]) for a in edges]
        factors = [0.0] * len(edges)
        _hand_down(sums, factors, 0, len(edges), 1.0 if _sum(sums, 0, len(edges)) > 0 else 0.0)
        for a, total, factor in zip(edges, sums, factors):
            block = slice(a, a + BLOCK)
            if factor == 1 and not negative[block].any():
                continue
            target = factor * total if total > 0 else 0.0
            level = _level(A[block], x[block], target) if target > 0 else np.inf
            made = np.maximum(x[block] - level, 0) if np.isfinite(level) else 0.0
            out[of[block]] = (direct[of[block]].astype(float) + made).astype(np.float32)
        return int(negative.sum())


def _sum(sums: List[float], first: int, last: int) -> float:
    if last - first == 1:
        return sums[first]
    middle = first + (last - first) // 2
    return _sum(sums, first, middle) + _sum(sums, middle, last)


def _hand_down(sums: List[float], factors: List[float], first: int, last: int, factor: float) -> None:
    """A node hands factor times its sum to its halves; one below zero gets nothing."""
    if last - first == 1 or factor <= 0:
        factors[first:last] = [factor] * (last - first)
        return
    middle = first + (last - first) // 2
    left, right = _sum(sums, first, middle), _sum(sums, middle, last)
    total = left + right
    _hand_down(sums, factors, first, middle, (factor if right > 0 else factor * total / left) if left > 0 else 0.0)
    _hand_down(sums, factors, middle, last, (factor if left > 0 else factor * total / right) if right > 0 else 0.0)


def _level(A: Array, x: Array, target: float) -> float:
    """The level l with sum A max(x - l, 0) = target, by Newton's steps from 0."""
    level = 0.0
    for _ in range(BLOCK + 1):
        over = x > level
        excess, falls = float(A[over] @ (x[over] - level)) - target, float(A[over].sum())
        if not (excess > np.finfo(float).eps * target and falls > 0):
            break
        level += excess / falls
    return level


def emitter_weights(op: Any, E: Array, L: Optional[Array]) -> Array:
    C, s, last = op.channels, op.emitters, op.first_luminaire
    made = np.zeros((C, s))
    for c in range(C):
        sky = np.zeros(0) if L is None or op.L is None else L[c]
        if L is not None and op.L is None and L[c].any():
            raise Refused("no emitter of the store is of the sky; precompute with --emitters sky")
        wanted = np.concatenate([E[c], sky])
        if not wanted.any():
            continue
        if op.outside:
            raise Refused('the emitters of this store are no part of its mesh, nor of a sky; give "emitters", a weight each or by name')
        sent = np.concatenate([op.E[c, :last], op.L[c, :last] if len(sky) else np.zeros((last, 0))], 1)
        found = np.linalg.lstsq(sent.T, wanted, rcond=None)[0]
        off = abs(found @ sent - wanted)
        if (off > 1e-5 * np.maximum(abs(wanted), abs(found @ sent)) + 1e-7 * abs(wanted).max()).any():
            raise Refused(f"element {int(off[:op.n].argmax())} emits {E[c][int(off[:op.n].argmax())]:g}, which the store's {s} emitters "
                          'do not; give what they send, or "emitters"')
        made[c, :last] = found
    return made
