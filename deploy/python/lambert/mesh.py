"""The parts of a scene: its elements and groups, luminaires, sensors and the tiles of its sky."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from .errors import LambertError, NotFound
from .wire import Array, Reply

FIELDS = ("area", "normal", "centre", "group", "face", "reflectance")


@dataclass(frozen=True)
class Elements:
    """Arrays of all elements: area [n] m², normal and centre [n, 3], group and face [n], reflectance [C, n]."""

    area: Array
    normal: Array
    centre: Array
    group: Array
    face: Array
    reflectance: Array

    @staticmethod
    def of(arrays: Mapping[str, Any]) -> Elements:
        made = {name: np.asarray(arrays[name]) for name in FIELDS}
        made["reflectance"] = np.atleast_2d(made["reflectance"])
        for array in made.values():
            array.flags.writeable = False  # all who ask have the same ones
        return Elements(**made)

    @staticmethod
    def read(reply: Reply) -> Elements:
        """The elements of an answer, an NPZ or JSON."""
        if not reply.headers.get("content-type", "").startswith("application/json"):
            try:
                with np.load(io.BytesIO(reply.body)) as arrays:
                    return Elements.of(arrays)
            except (ValueError, OSError, KeyError, zipfile.BadZipFile) as error:
                raise LambertError(f"the elements of the answer cannot be read: {error}") from None
        read = reply.json()
        kinds = {"area": "f8", "group": "u4", "face": "i4"}
        read["face"] = [-1 if face is None else face for face in read["face"]]
        return Elements.of({name: np.array(read[name], kinds.get(name, "f4")) for name in FIELDS})

    def same_places(self, other: Elements) -> bool:
        """True where an index means the same piece of surface in both."""
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in ("area", "normal", "centre", "group"))


@dataclass(frozen=True)
class Group:
    """A group of elements: area (m²), means by area of reflectance and emission [C], number of elements, and their indices.

    Area and means are without the `buried` elements, which figures leave out.
    """

    name: str
    area: float
    elements: int
    reflectance: Array
    emission: Array
    indices: Array = field(repr=False)
    buried: int = 0

    def __len__(self) -> int:
        return self.elements


class Groups(Mapping[str, Group]):
    """The groups of a scene by name, in its order."""

    def __init__(self, lines: Sequence[Mapping[str, Any]], group: Array, channels: int) -> None:
        order = np.argsort(group, kind="stable")
        start = np.searchsorted(group[order], np.arange(len(lines) + 1))
        self._groups: Dict[str, Group] = {}
        for g, line in enumerate(lines):
            indices = order[start[g]:start[g + 1]]
            indices.flags.writeable = False
            colours = [np.broadcast_to(np.asarray(line.get(key) or 0, float), (channels,)) for key in ("reflectance", "emission")]
            self._groups[str(line["name"])] = Group(str(line["name"]), float(line["area"] or 0), int(line["elements"]), colours[0],
                                                    colours[1], indices, int(line.get("buried") or 0))

    def __getitem__(self, name: str) -> Group:
        try:
            return self._groups[name]
        except KeyError:
            raise MissingName(f"no group is called {name}; there are {', '.join(self._groups)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._groups)

    def __len__(self) -> int:
        return len(self._groups)

    def __repr__(self) -> str:
        return f"<groups {', '.join(self)}>"


class MissingName(NotFound, KeyError):
    """A name that the scene does not have."""

    __str__ = NotFound.__str__


class Named(Dict[str, Any]):
    """Things of a scene by name; a name that is not there says which are.

    >>> Named("luminaire", {"desk": 1})["dask"]
    Traceback (most recent call last):
    lambert.mesh.MissingName: no luminaire is called dask; there are desk
    """

    def __init__(self, what: str, items: Mapping[str, Any]) -> None:
        super().__init__(items)
        self._what = what

    def __missing__(self, name: str) -> Any:
        raise MissingName(f"no {self._what} is called {name}; there are {', '.join(self) or 'none'}")


@dataclass(frozen=True)
class Luminaire:
    """A luminaire: the middle of its opening `at` (m), the unit vectors `aim` and `c0`, the dimmer of its list, lumens at 1."""

    name: str
    group: Optional[str]
    at: Array
    aim: Array
    c0: Array
    dim: float
    lumens: float
    colour: Array
    opening: Mapping[str, Any]

    @staticmethod
    def of(line: Mapping[str, Any]) -> Luminaire:
        vectors = {key: np.array(line[key], float) for key in ("at", "aim", "c0", "colour")}
        return Luminaire(name=line["name"], group=line["group"], dim=line["dim"], lumens=line["lumens"],
                         opening=line["opening"], **vectors)


@dataclass(frozen=True)
class SensorSet:
    """A set of sensors: `kind` and `weight`, places `at` [s, 3] (m), the `axis` of each or of all, and the rows and columns of a grid."""

    name: str
    kind: str
    weight: str
    first: int
    count: int
    at: Array = field(repr=False)
    axis: Optional[Array] = field(repr=False)
    in_walls: Tuple[int, ...] = ()
    in_luminaires: Tuple[int, ...] = ()
    rows: Optional[int] = None
    columns: Optional[int] = None
    cells: Optional[Array] = field(repr=False, default=None)

    @staticmethod
    def of(line: Mapping[str, Any]) -> SensorSet:
        return SensorSet(line["name"], str(line["kind"]), str(line["weight"]), line["first"], line["count"],
                         np.array(line["at"], float), None if line["axis"] is None else np.array(line["axis"], float),
                         tuple(line["in_walls"]), tuple(line["in_luminaires"]), line.get("rows"), line.get("columns"),
                         None if line.get("cells") is None else np.array(line["cells"]))

    def __len__(self) -> int:
        return self.count


@dataclass(frozen=True)
class Sky:
    """The tiles of a sky: azimuth and altitude of their `centre` [m, 2] (degrees), `solid_angle` and `cosine` [m] (sr)."""

    tiling: str
    tiles: int
    centre: Array = field(repr=False)
    solid_angle: Array = field(repr=False)
    cosine: Array = field(repr=False)
    east: Array = field(repr=False)
    north: Array = field(repr=False)
    up: str
    ground_albedo: float

    @staticmethod
    def of(line: Mapping[str, Any]) -> Sky:
        arrays = {key: np.array(line[key], float) for key in ("centre", "solid_angle", "cosine", "east", "north")}
        return Sky(tiling=line["tiling"], tiles=line["tiles"], up=line["up"], ground_albedo=line["ground_albedo"], **arrays)

    def __len__(self) -> int:
        return self.tiles


def luminaires_of(document: Optional[Mapping[str, Any]]) -> Named:
    lines: List[Mapping[str, Any]] = list(document["luminaires"]) if document else []
    return Named("luminaire", {line["name"]: Luminaire.of(line) for line in lines})


def sensors_of(document: Optional[Mapping[str, Any]]) -> Named:
    lines: List[Mapping[str, Any]] = list(document["sets"]) if document else []
    return Named("set of sensors", {line["name"]: SensorSet.of(line) for line in lines})
