"""Writes small stores after store/FORMAT.md with numpy and h5py alone, and knows what they must answer.

The form factors are of low rank, F = U V', so that every kind of operator holds the same M exactly.
"""

import copy
import ctypes
import ctypes.util

import h5py
import numpy as np

PIECE = 1 << 20
NO_VERTEX = 0xFFFFFFFF

_xxhash = ctypes.CDLL(ctypes.util.find_library("xxhash"))
_xxhash.XXH3_64bits.restype = ctypes.c_uint64
_xxhash.XXH3_64bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]


def xxh3(raw):
    return _xxhash.XXH3_64bits(raw, len(raw))


def text(value):
    raw = value.encode()
    return np.array(raw, dtype=f"S{max(len(raw), 1)}")[()]


class Scene:
    """The content of a store: answers in double, for comparison."""

    def __init__(self, n, channels=1, rank=5, seed=1, groups=("floor", "lamp", "box.red", "box.blue", "wall")):
        rng = np.random.default_rng(seed)
        self.n, self.channels, self.rank = n, channels, rank
        self.U = rng.random((n, rank)) + 0.01
        self.V = rng.random((n, rank))
        self.U *= (0.9 / (self.U @ self.V.sum(axis=0)))[:, None]  # rows of F sum to .9
        self.rho = rng.uniform(0.1, 0.8, (channels, n))
        self.rho[:, ::7] = 0.0
        self.rho = self.rho.astype(np.float32).astype(float)
        self.group_names = list(groups)
        self.group = rng.integers(0, len(groups), n).astype(np.uint32)
        self.group[: min(n, len(groups))] = np.arange(min(n, len(groups)))
        self.order = rng.permutation(n).astype(np.uint32)
        self.area = np.random.default_rng(seed + 1000).uniform(0.5, 2, n)
        self.core = self.core_of(self.rho)

    def core_of(self, rho):
        return np.stack([np.linalg.inv(np.eye(self.rank) - self.V.T @ (r[:, None] * self.U)) for r in rho])

    def with_reflectance(self, rho):
        """The same scene of other reflectances [C][n], made again from its F."""
        other = copy.copy(self)
        other.rho, other.core = rho, self.core_of(rho)
        return other

    def members(self, name):
        """The elements of a group, or of all `name.something`, in the order that `select` gives."""
        ids = [g for g, known in enumerate(self.group_names) if known == name]
        if not ids:
            ids = sorted(
                (g for g, known in enumerate(self.group_names) if known.startswith(name + ".")),
                key=lambda g: self.group_names[g].encode(),
            )
        return np.concatenate([np.flatnonzero(self.group == g) for g in ids])

    def first_bounce(self, tiles):
        """The first bounce of `tiles` sectors of the horizon, as it is stored."""
        return np.random.default_rng(tiles).random((tiles, self.n)).astype(np.float32)

    def solve(self, E, quantity="radiosity", L=None):
        """E is [..., C, n]; L, [..., C, m], the radiances of a sky."""
        E = np.asarray(E, dtype=float)
        if L is not None:
            L = np.asarray(L, dtype=float)
            H0 = L @ self.first_bounce(L.shape[-1]).astype(float)
            return self.solve(E + self.rho * H0, quantity) + (H0 if quantity == "irradiance" else 0)
        H = np.einsum("ik,ckl,...cl->...ci", self.U, self.core, np.einsum("ik,...ci->...ck", self.V, E))
        return {"radiosity": E + self.rho * H, "irradiance": H, "indirect": self.rho * H}[quantity]

    def relit(self, groups):
        """The scene under other reflectances: {name: a number or one for each channel}."""
        other = copy.copy(self)
        other.rho = self.rho.copy()
        for name, rho in groups.items():
            other.rho[:, self.members(name)] = np.broadcast_to(np.float32(rho), self.channels)[:, None]
        other.core = np.stack([np.linalg.inv(np.eye(self.rank) - self.V.T @ (r[:, None] * self.U)) for r in other.rho])
        return other

    def write(self, path, name="box", kind="low_rank", with_order=True, error=True, sky=0, keep_factors=False,
              receivers=(), sources=()):
        """sky: so many tiles, 0 for none. keep_factors: a grey store as coloured ones are. receivers, sources: the
        elements that the store says to be built for, none for all."""
        n, C = self.n, self.channels
        order = self.order if with_order else np.arange(n)
        with h5py.File(path, "w", libver=("v108", "v108")) as f:
            f.create_group("mesh")
            f.create_group("operator")
            arrays = {
                "/mesh/vertices": np.random.default_rng(0).random((n + 2, 3)),
                "/mesh/elements": np.array([[i, i + 1, i + 2, NO_VERTEX] for i in range(n)], np.uint32),
                "/mesh/area": self.area,
                "/mesh/normal": np.tile(np.array([0, 0, 1], np.float32), (n, 1)),
                "/mesh/reflectance": self.rho.astype(np.float32),
                "/mesh/emission": np.ones((C, n), np.float32),
                "/mesh/group": self.group,
                "/mesh/row_sums": np.full(n, 0.9),
            }
            if with_order:
                arrays["/operator/order"] = self.order
            if sky:
                width = 2 * np.pi / sky
                tiles = np.zeros((sky, 9))
                tiles[:, 4] = np.pi / 2
                tiles[:, 5], tiles[:, 6] = (np.arange(sky) - 0.5) * width, (np.arange(sky) + 0.5) * width
                tiles[:, 0] = np.sin(np.arange(sky) * width) * np.sqrt(0.5)
                tiles[:, 1] = np.cos(np.arange(sky) * width) * np.sqrt(0.5)
                tiles[:, 2] = np.sqrt(0.5)
                tiles[:, 7], tiles[:, 8] = width, width / 2
                arrays["/sky/tiles"] = tiles
                arrays["/sky/first_bounce"] = self.first_bounce(sky)
            if len(receivers):
                arrays["/importance/elements"] = np.array(receivers, np.uint32)
                arrays["/importance/weights"] = np.ones(len(receivers), np.float32)
            if len(sources):
                arrays["/sources/elements"] = np.array(sources, np.uint32)
            rho_stored = np.where(self.rho == 0, 1.0, self.rho)
            attributes = {"kind": kind, "layout": "rows", "reason": "a test", "epsilon": 0.05}
            if kind == "exact":
                M = np.stack([rho_stored[c][:, None] * (self.U @ self.core[c] @ self.V.T) for c in range(C)])
                M += np.eye(n)
                arrays["/operator/M"] = M[:, order][:, :, order].astype(np.float32)
                attributes["method"] = "exact"
            elif C == 1 and not keep_factors:
                Y = -rho_stored[0][:, None] * (self.U @ self.core[0])
                arrays["/operator/Y"] = Y[order].astype(np.float32)
                arrays["/operator/V"] = self.V[order].astype(np.float32)
                attributes.update(method="low-rank", form="folded", rank=self.rank)
            else:
                arrays["/operator/U"] = self.U[order].astype(np.float32)
                arrays["/operator/V"] = self.V[order].astype(np.float32)
                arrays["/operator/core"] = self.core.astype(np.float32)
                attributes.update(method="low-rank", form="factored", rank=self.rank)
            for path_in_file, values in arrays.items():
                f.create_dataset(path_in_file, data=np.ascontiguousarray(values))
            width = max(len(g.encode()) for g in self.group_names)
            f.create_dataset("/mesh/group_names", data=np.array([g.encode() for g in self.group_names], f"S{width}"))
            set_attributes(f["operator"], attributes)
            if len(receivers):
                set_attributes(f["importance"], {"option": "--receivers some"})
            if len(sources):
                set_attributes(f["sources"], {"option": "--sources some"})
            if sky:
                set_attributes(f["sky"], {"tiling": f"grid:{sky}x1", "ground_albedo": 0.0, "up": "z"})
            set_attributes(f["mesh"], {"geometry_hash": "0" * 32, "name": name, "unit": 1.0, "up": "z", "two_sided": 0})
            if error:
                figures = {"probes": 3}
                for against in "total", "operator":
                    for norm in "relative", "indirect":
                        for figure in "mean", "std", "max":
                            figures[f"{against}_{norm}_{figure}"] = 0.125 if norm == "relative" else 0.25
                if len(receivers):
                    figures.update(receivers_relative=0.03125, receivers_indirect=0.0625, receivers_noise=0.0,
                                   receivers_operator_indirect=0.0625, receivers_is_bound=0)
                f.create_group("error")
                for light in "single", "lights":
                    set_attributes(f["error"].create_group(light), figures)
            set_attributes(
                f,
                {
                    "format": "lambert",
                    "version": 1,
                    "created": "2026-01-31T12:00:00Z",
                    "name": name,
                    "tool": "make_store.py",
                    "command": "a test",
                    "seed": 1,
                    "unit": "W/m^2",
                },
            )
            add_checksums(f)
        return self


class Luminaires:
    """The luminaires of a store: names, the group of each (None: it has none), and the irradiance of every element."""

    NAMES = ("desk-1", "desk-2", "row-a.0", "row-a.1", "wall")
    GROUPS = ("desks", "desks", "row-a", "row-a", None)

    def __init__(self, n, channels=1, seed=1, names=NAMES, groups=GROUPS, mesh_groups=0):
        rng = np.random.default_rng(seed)
        k = len(names)
        self.names, self.groups, self.channels = names, groups, channels
        self.irradiance = (rng.random((k, n)) * rng.choice([0, 1, 10], (k, n))).astype(np.float32)
        self.dimmers, self.lumens = rng.random(k), rng.uniform(500, 4000, k)
        self.colour = rng.uniform(0.5, 1.5, (k, 3))
        z = rng.normal(size=(k, 3))
        self.z = z / np.linalg.norm(z, axis=1)[:, None]
        self.x = np.cross(self.z, np.roll(self.z, 1, axis=1))
        self.x /= np.linalg.norm(self.x, axis=1)[:, None]
        self.at = rng.uniform(-5, 5, (k, 3))
        self.shape, self.size = np.arange(k) % 11, rng.random((k, 3))
        self.off = rng.random((2, k, mesh_groups)) * 1e-3  # of elements, and of means

    def of(self, **dimmers):
        """Dimmers [C][k] by the names of luminaires: a number or one for each channel."""
        D = np.zeros((self.channels, len(self.names)))
        for name, values in dimmers.items():
            D[:, self.names.index(name.replace("_", "-"))] = values
        return D

    def direct(self, D):
        """H0 [..., C, n] of dimmers [..., C, k]."""
        colour = self.colour.T if self.channels == 3 else np.ones((self.channels, len(self.names)))
        return (np.asarray(D, float) * colour) @ self.irradiance.astype(float)

    def add_to(self, path):
        """Writes /luminaires into a store, which counts in lm then."""
        k = len(self.names)
        known = [g for g in dict.fromkeys(self.groups) if g is not None]
        y = np.cross(self.z, self.x)
        with h5py.File(path, "r+") as f:
            f.require_group("luminaires")
            arrays = {
                "irradiance": self.irradiance,
                "dimmers": self.dimmers,
                "lumens": self.lumens,
                "colour": self.colour,
                "place": np.concatenate([self.at, self.x, y, self.z], axis=1),
                "opening": np.concatenate([self.shape[:, None].astype(float), self.size, np.zeros((len(self.size), 4))], axis=1),
                "names": np.array([name.encode() for name in self.names]),
            }
            if known:
                arrays["group_names"] = np.array([name.encode() for name in known])
                arrays["group"] = np.array([known.index(g) if g is not None else NO_VERTEX for g in self.groups], np.uint32)
            if self.off.shape[2]:
                arrays["elements_off"], arrays["means_off"] = self.off
            for name, values in arrays.items():
                f.create_dataset("luminaires/" + name, data=np.ascontiguousarray(values))
            assert len(arrays["names"]) == k
            f["mesh"].attrs["lights"] = text("lm")
            add_checksums(f)
        return self


class Sensors:
    """The sensors of a store: two sets of points, one of cylinders, one receiver of which lies in a wall, and with `eyes` one of these."""

    NAMES, COUNTS, DARK = ("room.a", "room.b", "faces"), (5, 9, 4), 7

    def __init__(self, n, channels=1, tiles=0, lights=None, seed=1, eyes=0):
        rng = np.random.default_rng(seed)
        self.n, self.C, self.lights, self.eyes = n, channels, lights, eyes
        if eyes:
            self.NAMES, self.COUNTS = (*self.NAMES, "seat"), (*self.COUNTS, eyes)
        self.s = sum(self.COUNTS)
        self.first = np.concatenate([[0], np.cumsum(self.COUNTS)])
        self.weights = (rng.random((self.s, n)) * (rng.random((self.s, n)) < .6) / n).astype(np.float32)
        self.off = (rng.normal(size=(self.s, n)) * 1e-2 * self.weights).astype(np.float32)
        self.sky = rng.random((tiles, self.s)).astype(np.float32)
        self.luminaires = (rng.random((len(lights.names), self.s)) * 9).astype(np.float32) if lights is not None else None
        self.place = rng.uniform(-1, 1, (self.s, 9))

    def rows(self, names):
        """The receivers of some sets, those of the first before those of the next."""
        return np.concatenate([np.arange(self.first[k], self.first[k + 1]) for k in map(self.NAMES.index, names)])

    def values(self, B, L=None, D=None):
        """[C][s] of radiosities [C][n], radiances [C][tiles] and dimmers [C][luminaires], in double."""
        out = B @ self.weights.T.astype(float)
        if L is not None:
            out = out + L @ self.sky.astype(float)
        if D is not None:
            colour = self.lights.colour.T if self.C == 3 else np.ones((1, len(self.lights.names)))
            out = out + (np.asarray(D, float) * colour) @ self.luminaires.astype(float)
        out[:, self.DARK] = np.nan
        return out

    def add_to(self, path):
        """Writes /sensors into a store."""
        there = self.weights > 0
        flags = np.zeros(self.s, np.uint32)
        flags[self.DARK] = 1
        k = len(self.NAMES)
        arrays = {
            "names": np.array([name.encode() for name in self.NAMES]),
            "kind": np.array([0, 0, 3, 2][:k], np.uint32),
            "first": self.first.astype(np.uint64),
            "grid": np.zeros((k, 2), np.uint32),
            "spacing": np.zeros((k, 2)),
            "receiver": np.repeat(np.array([0, 0, 1, 0][:k], np.uint32), self.COUNTS),
            "place": self.place,
            "cell": np.full(self.s, 0xFFFFFFFF, np.uint32),
            "flags": flags,
            "backs": flags.astype(np.float32),
            "indptr": np.concatenate([[0], np.cumsum(there.sum(1))]).astype(np.uint64),
            "indices": np.nonzero(there)[1].astype(np.uint32),
            "weights": self.weights[there],
            "weights_off": self.off[there],
        }
        if len(self.sky):
            arrays["sky"], arrays["sky_off"] = self.sky, (self.sky * 1e-2).astype(np.float32)
        if self.luminaires is not None:
            arrays["luminaires"] = self.luminaires
        if self.eyes and self.luminaires is not None:
            arrays["eyes"] = np.arange(self.s - self.eyes, self.s, dtype=np.uint32)
            # cd, m2, m, the index of Guth, and the share that is seen.
            arrays["seen"] = np.broadcast_to(np.float32([1000, .1, 5, 2, 1]), (len(self.luminaires), self.eyes, 5))
        with h5py.File(path, "r+") as f:
            for name, values in arrays.items():
                f.create_dataset("sensors/" + name, data=values)
            add_checksums(f)
        return self


def set_attributes(group, values):
    for key, value in values.items():
        if isinstance(value, str):
            group.attrs[key] = text(value)
        else:
            group.attrs[key] = np.int64(value) if isinstance(value, int) else np.float64(value)


def add_checksums(f):
    """/checksum of all that is there; an older one is replaced."""
    if "checksum" in f:
        del f["checksum"]
    paths = []
    f.visititems(lambda p, o: paths.append("/" + p) if isinstance(o, h5py.Dataset) else None)
    together = b""
    f.create_group("checksum")
    for path in sorted(paths, key=str.encode):
        raw = np.ascontiguousarray(f[path][()]).tobytes()
        sums = np.array([xxh3(raw[i : i + PIECE]) for i in range(0, len(raw), PIECE)], np.uint64)
        f.create_dataset("/checksum" + path, data=sums)
        together += path.encode() + b"\0" + sums.tobytes()
    set_attributes(f["checksum"], {"piece_bytes": PIECE, "xxh3": f"{xxh3(together):016x}"})
