"""A store read by h5py: all that answers need beside the operator, in the words of the daemon's documents."""

from __future__ import annotations

import importlib
import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from .errors import NotFound, Refused, Unsupported
from .mesh import Elements
from .wire import Array

SENSOR_KINDS = ("points", "grids", "eyes", "cylinders", "semicylinders", "spheres", "cubes", "probes")
WEIGHTS = ("plane", "cylinder", "semicylinder", "sphere")
SHAPES = ("point", "rectangle", "box", "disc", "ellipse", "upright cylinder", "sphere", "ellipsoid", "cylinder along x",
          "cylinder along y", "upright disc")
NONE = 0xFFFFFFFF
LEAST = 1.1754944e-38  # the least normal number: smaller reflectances are 0


def _texts(dataset: Any) -> List[str]:
    return [text.decode() for text in dataset[()]]


class Names:
    """The things that a name of a request means, by the daemon's rules for groups.

    >>> names = Names(["desk.0", "desk.1", "floor", "floor.back"], {3})
    >>> names.find("desk"), names.find("fl*"), names.find("floor.back")
    ([0, 1], [2], [3])
    """

    def __init__(self, names: Sequence[str], backs: "set[int]" = set(), noun: str = "group") -> None:
        self.names, self.backs, self.noun = list(names), backs, noun

    def find(self, name: str) -> List[int]:
        fronts = [i for i in range(len(self.names)) if i not in self.backs]
        backs = sorted(self.backs)
        base = name[:-len(".back")] if name.endswith(".back") else None
        among = backs if base is not None else fronts
        begin = name if base is None else base
        for found in ([i for i in fronts if self.names[i] == name], [i for i in backs if self.names[i] == name],
                      [i for i in fronts if self.names[i].startswith(name + ".")],
                      [i for i in backs if base is not None and self.names[i].startswith(base + ".")],
                      [i for i in among if begin.endswith("*") and self.names[i].startswith(begin[:-1])]):
            if found:
                return found
        raise Refused(f"no {self.noun} is called {name}; there are {', '.join(self.names)}", kind="unknown-group")


class Store:
    """The mesh, sky, luminaires and sensors of a store, in memory."""

    def __init__(self, path: str) -> None:
        try:
            h5py = importlib.import_module("h5py")
        except ImportError:
            raise Unsupported(f"{path}: a store in process is read by h5py, which is not installed; "
                              f"with lambert.serve({path!r}) as daemon a daemon answers for it") from None
        if not os.path.exists(path):
            raise NotFound(f"{path}: there is no such store")
        try:
            file = h5py.File(path, "r")
        except OSError as error:
            raise Refused(f"{path}: is no store: {error}") from None
        with file:
            if _text(file.attrs.get("format")) != "lambert":
                raise Refused(f"{path}: is no store of Lambert")
            if int(file.attrs["version"]) != 1:
                raise Refused(f"{path}: is a store of version {int(file.attrs['version'])}, must be 1")
            self.path = path
            self._read_mesh(file["mesh"])
            self._read_lights(file)
            self.operator = {key: _text(value) for key, value in file["operator"].attrs.items()}
        self.name = os.path.splitext(os.path.basename(path))[0]

    def _read_mesh(self, mesh: Any) -> None:
        self.area: Array = mesh["area"][()]
        self.rho: Array = np.atleast_2d(mesh["reflectance"][()]).astype(np.float32)
        self.rho[self.rho < LEAST] = 0
        self.channels, self.n = self.rho.shape
        self.lights = _text(mesh.attrs.get("lights", "W"))
        self.geometry_hash = _text(mesh.attrs.get("geometry_hash", ""))
        self.group_names, self.group = _texts(mesh["group_names"]), mesh["group"][()]
        self.emission: Array = np.atleast_2d(mesh["emission"][()])
        counts = np.ones(self.n, bool)
        if "buried" in mesh:
            counts[mesh["buried"][()]] = False
        self.counts = counts
        of_backs = self.n // 2 if int(mesh.attrs.get("two_sided", 0)) else int(mesh.attrs.get("backs", 0))
        fronts = set(self.group[:self.n - of_backs].tolist())
        backs = {g for g in range(len(self.group_names)) if g not in fronts and (self.group == g).any()}
        self.groups = Names(self.group_names, backs)
        self.n_fronts = self.n - of_backs
        self.elements = Elements.of({"area": self.area, "normal": mesh["normal"][()], "centre": _centres(mesh),
                                     "group": self.group, "reflectance": self.rho,
                                     "face": _signed(mesh["face"][()]) if "face" in mesh else np.full(self.n, -1, np.int32)})
        self.face_area: Optional[Array] = mesh["face_area"][()] if "face_area" in mesh else None
        self.face_part = mesh["face_part"][()].astype(int) if "face_part" in mesh else np.zeros((0, 2), int)
        self.face_part_area = mesh["face_part_area"][()] if "face_part" in mesh else np.zeros(0)

    def _read_lights(self, file: Any) -> None:
        self.sky: Optional[Dict[str, Any]] = None
        if "sky" in file:
            group = file["sky"]
            self.sky = {"tiles": group["tiles"][()], "first_bounce": group["first_bounce"][()],
                        **{key: _text(value) for key, value in group.attrs.items()}}
        self.luminaires: Optional[Dict[str, Any]] = None
        if "luminaires" in file:
            group = file["luminaires"]
            self.luminaires = {key: group[key][()] for key in group if key in
                               ("irradiance", "dimmers", "lumens", "colour", "place", "opening", "group")}
            self.luminaires["names"] = _texts(group["names"])
            self.luminaires["group_names"] = _texts(group["group_names"]) if "group_names" in group else []
            colour = self.luminaires["colour"].T if self.channels == 3 else np.ones((self.channels, len(group["names"])))
            self.luminaires["factors"] = colour
        self.sensors: Optional[Dict[str, Any]] = None
        if "sensors" in file:
            group = file["sensors"]
            self.sensors = {key: group[key][()] for key in group if key in
                            ("kind", "first", "grid", "spacing", "receiver", "place", "cell", "flags", "indptr", "indices",
                             "weights", "sky", "luminaires")}
            self.sensors["names"] = _texts(group["names"])

    def facts(self) -> Dict[str, Any]:
        """The answer to GET /v1/scenes/NAME, as far as it can be known without the daemon."""
        sizes = np.bincount(self.group, minlength=len(self.group_names))
        return {
            "name": self.name, "elements": self.n, "channels": self.channels, "lights": self.lights, "kind": self.operator["kind"],
            "method": self.operator.get("method"), "faces": None if self.face_area is None else len(self.face_area),
            "groups": [{"name": name, "elements": int(count)} for name, count in zip(self.group_names, sizes)],
            "sky": None if self.sky is None else {"tiling": self.sky["tiling"], "tiles": len(self.sky["tiles"])},
            "luminaires": None if self.luminaires is None else {"count": len(self.luminaires["names"])},
            "sensors": None if self.sensors is None else {"sets": len(self.sensors["names"])},
            "provenance": {"geometry_hash": self.geometry_hash}}

    def group_lines(self) -> List[Mapping[str, Any]]:
        """The lines of GET /v1/scenes/NAME/groups."""
        lines: List[Mapping[str, Any]] = []
        for g, name in enumerate(self.group_names):
            all_of = self.group == g
            of = all_of & self.counts
            area = float(self.area[of].sum())
            mean = [(x[:, of] @ self.area[of] / area if area > 0 else np.zeros(self.channels)).tolist()
                    for x in (self.rho.astype(float), self.emission.astype(float))]
            lines.append({"name": name, "area": area, "elements": int(all_of.sum()), "reflectance": mean[0], "emission": mean[1],
                          "buried": int(all_of.sum() - of.sum())})
        return lines

    def document(self, name: str) -> Optional[Dict[str, Any]]:
        """The answer to GET /v1/scenes/NAME/sky, /luminaires or /sensors."""
        return {"sky": self._sky, "luminaires": self._luminaires, "sensors": self._sensors}[name]()

    def _sky(self) -> Optional[Dict[str, Any]]:
        if self.sky is None:
            return None
        tiles = self.sky["tiles"]
        middle = np.stack([tiles[:, 5:7].mean(1), tiles[:, 3:5].mean(1)], 1)
        middle[-1, 1] = middle[-1, 1] if tiles[-1, 4] < np.pi / 2 - 1e-9 or tiles[-1, 6] - tiles[-1, 5] < 6 else np.pi / 2
        up = self.sky["up"]
        north, east = {"x": ([0, 0, 1], [0, 1, 0]), "y": ([0, 0, -1], [1, 0, 0]), "z": ([0, 1, 0], [1, 0, 0])}[up]
        return {"tiling": self.sky["tiling"], "tiles": len(tiles), "centre": np.degrees(middle) % 360, "solid_angle": tiles[:, 7],
                "cosine": tiles[:, 8], "east": east, "north": north, "up": up, "ground_albedo": float(self.sky["ground_albedo"])}

    def _luminaires(self) -> Optional[Dict[str, Any]]:
        read = self.luminaires
        if read is None:
            return None
        lines = []
        for k, name in enumerate(read["names"]):
            of, place = int(read["group"][k]) if "group" in read else NONE, read["place"][k].reshape(4, 3)
            lines.append({"name": name, "group": None if of == NONE else read["group_names"][of], "at": place[0], "aim": -place[3],
                          "c0": place[1], "dim": float(read["dimmers"][k]), "lumens": float(read["lumens"][k]),
                          "colour": read["colour"][k], "opening": {"shape": SHAPES[int(read["opening"][k, 0])],
                                                                   "size": read["opening"][k, 1:4].tolist()}})
        return {"luminaires": lines, "lumens": float(read["lumens"].sum())}

    def _sensors(self) -> Optional[Dict[str, Any]]:
        read = self.sensors
        if read is None:
            return None
        sets = []
        for k, name in enumerate(read["names"]):
            of = slice(int(read["first"][k]), int(read["first"][k + 1]))
            receiver, flags, axis = int(read["receiver"][of.start]), read["flags"][of], read["place"][of, 3:6]
            line = {"name": name, "kind": SENSOR_KINDS[int(read["kind"][k])], "first": of.start, "count": of.stop - of.start,
                    "weight": WEIGHTS[receiver] if receiver < 4 else "harmonics", "at": read["place"][of, :3],
                    "axis": None if receiver == 3 else axis[0] if (axis == axis[0]).all() else axis,
                    "in_walls": np.flatnonzero(flags & 1).tolist(), "in_luminaires": np.flatnonzero(flags & 2).tolist()}
            if read["grid"][k].all():
                line.update(rows=int(read["grid"][k, 0]), columns=int(read["grid"][k, 1]), cells=read["cell"][of])
            sets.append(line)
        return {"sets": sets, "sensors": len(read["receiver"])}

    def luminaire_indices(self, name: str) -> List[int]:
        """The luminaires that a name means: one, those of a group, or else those called so."""
        read = self.luminaires
        if read is None:
            raise Refused("the store has no luminaires; precompute it with --luminaires", kind="not-in-store")
        if name in read["names"]:
            return [read["names"].index(name)]
        groups = Names(read["group_names"], noun="luminaire")

        of = read["group"].tolist() if "group" in read else [NONE] * len(read["names"])

        def of_groups(wanted: Sequence[int]) -> List[int]:
            return [k for k, group in enumerate(of) if group in wanted]

        if name in read["group_names"]:
            return of_groups([read["group_names"].index(name)])
        try:
            return Names(read["names"], noun="luminaire").find(name)
        except Refused as unknown:
            try:
                return of_groups(groups.find(name))
            except Refused:
                raise unknown from None

    def sensor_rows(self, names: Sequence[str], probes: bool = False) -> Tuple[Dict[str, int], Array]:
        """The number of receivers of each name, and all of them in order."""
        if self.sensors is None:
            raise Refused("the store has no sensors; precompute it with --sensors", kind="not-in-store")
        index, counts, rows = Names(self.sensors["names"], noun="set of sensors"), {}, []
        for name in names:
            found = [np.arange(int(self.sensors["first"][k]), int(self.sensors["first"][k + 1])) for k in index.find(name)]
            for k in index.find(name):
                if (self.sensors["kind"][k] == 7) != probes:
                    raise Refused(f"{name} {'is no set of' if probes else 'is a set of'} probes")
            rows += found
            counts[name] = int(sum(map(len, found)))
        return counts, np.concatenate(rows) if rows else np.zeros(0, int)


def _text(value: Any) -> Any:
    return value.decode() if isinstance(value, bytes) else value


def _signed(face: Array) -> Array:
    return np.where(face == NONE, -1, face.astype(np.int64)).astype(np.int32)


def _centres(mesh: Any) -> Array:
    """Centroids of triangles and quadrangles."""
    corners, vertices = mesh["elements"][()], mesh["vertices"][()]
    p = vertices[np.where(corners == NONE, corners[:, :1], corners)]
    halves = [(np.linalg.norm(np.cross(p[:, a] - p[:, 0], p[:, b] - p[:, 0]), axis=1), p[:, [0, a, b]].mean(1)) for a, b in ((1, 2), (2, 3))]
    weight = np.maximum(halves[0][0] + halves[1][0], 1e-300)
    return np.asarray(sum(w[:, None] * c for w, c in halves) / weight[:, None], np.float32)
