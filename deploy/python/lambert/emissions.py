"""Emissions of questions as numbers: of elements, tiles of the sky, luminaires and few emitters of a store in process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from .errors import Refused, Unsupported
from .kinds import NumpyOperator, emitter_weights
from .library import LibraryOperator
from .light import About
from .store import Names, Store
from .units import EFFICACY, exitance
from .wire import Array

Operator = Union[NumpyOperator, LibraryOperator]


def needs_daemon(what: str) -> Unsupported:
    """The error of what a process cannot do alone."""
    return Unsupported(f"{what} needs a daemon: with lambert.serve(STORE) as daemon: scene = daemon.scene()")


@dataclass
class Light:
    """A batch of emissions: E [m, C, n], radiances L [m, C, tiles], dimmers D [m, C, k] and weights W [m, C, s]; None: there are none."""

    E: Array
    L: Optional[Array]
    D: Optional[Array]
    W: Optional[Array]
    converted: bool = False
    kind: str = "W"


class Emissions:
    """The emissions that a store and its operator take."""

    store: Store
    op: Operator
    about: About

    def _colour(self, value: Any, what: str) -> Array:
        """A number for all channels, or one for each: [C]."""
        array = np.asarray(value, float)
        if array.shape not in ((), (1,), (self.about.channels,)) or not np.isfinite(array).all():
            raise Refused(f"{what} = {value!r}, must be a number or one for each of {self.about.channels} channels")
        return np.broadcast_to(array, (self.about.channels,))

    def _row(self, values: Any, length: int, what: str) -> Array:
        """A list of numbers or colours, as [C, length]."""
        array = np.asarray(values, float)
        if array.shape[:1] != (length,) or array.shape[1:] not in ((), (self.about.channels,)):
            raise Refused(f"{what} has the shape {list(array.shape)}, must have [{length}] or [{length}, {self.about.channels}]",
                          kind="wrong-length")
        return np.broadcast_to(array if array.ndim == 1 else array.T, (self.about.channels, length))

    def _spread(self, given: Union[Array, Mapping[str, Any]], what: str, signs: bool = True) -> Tuple[Array, bool]:
        """The emission of elements and groups as [C, n], and whether a unit was converted."""
        about, store = self.about, self.store
        if isinstance(given, np.ndarray):
            made, converted = np.array(about.rows(given), float), False
        else:
            made, converted = np.zeros((about.channels, about.n)), False
            if "elements" in given:
                indices = np.asarray(given["elements"])
                if indices.size and (indices.dtype.kind not in "iu" or indices.min() < 0 or indices.max() >= about.n):
                    raise Refused(f"{what}/elements holds an index that is not from 0 to {about.n - 1}", kind="bad-index")
                if len(np.unique(indices)) < len(indices):
                    raise Refused(f"{what}/elements names an element twice", kind="given-twice")
                if indices.size:
                    made[:, indices.astype(int)] = np.stack([self._colour(v, f"{what}/values") for v in given["values"]], 1)
            taken: Dict[int, str] = {}
            for name, value in given.get("groups", {}).items():
                found = store.groups.find(name)
                for g in found:
                    if g in taken:
                        raise Refused(f"{what}/groups: {store.group_names[g]} is reached by {taken[g]} and {name}", kind="given-twice")
                    taken[g] = name
                of = np.isin(store.group, found)
                if isinstance(value, str):
                    value, other = exitance(value, float(store.area[of & store.counts].sum()), store.lights)
                    converted = converted or other
                made[:, of] = self._colour(value, f"{what}/groups/{name}")[:, None]
        if not np.isfinite(made).all():
            raise Refused(f"{what} holds a number that is not finite", kind="bad-value")
        if not signs and (made < 0).any():
            raise Refused(f"{what} holds a negative number, must not", kind="bad-value")
        return made, converted

    def _light(self, emissions: Sequence[Union[Array, Mapping[str, Any]]], photometric: Optional[bool], signs: bool) -> Light:
        about, store, C = self.about, self.store, self.about.channels
        parts: Dict[str, List[Optional[Array]]] = {"L": [], "D": [], "W": []}
        E, converted = np.zeros((len(emissions), C, about.n)), False
        for v, given in enumerate(emissions):
            E[v], other = self._spread(given, "emission", signs)
            converted = converted or other
            more = {} if isinstance(given, np.ndarray) else given
            if "sun" in more:
                raise needs_daemon("the sun itself")
            parts["L"].append(self._sky_of(more["sky"]) if "sky" in more else None)
            parts["D"].append(self._dimmers_of(more["luminaires"]) if "luminaires" in more else None)
            parts["W"].append(self._weights_of(more["emitters"]) if "emitters" in more else None)
        stacked = {}
        for name, rows in parts.items():
            shape = next((row.shape for row in rows if row is not None), None)
            stacked[name] = None if shape is None else np.stack([np.zeros(shape) if row is None else row for row in rows])
            if stacked[name] is not None and (np.asarray(stacked[name]) < 0).any():
                raise Refused("radiances of skies, dimmers of luminaires and weights of emitters must not be negative", kind="bad-value")
        light = Light(E, stacked["L"], stacked["D"], stacked["W"], converted, store.lights)
        if photometric is not None and light.L is None:
            raise Refused("photometric is of the radiances of a sky, and there is none", kind="wrong-members")
        if light.L is not None and photometric is not None and photometric != (store.lights == "lm"):
            if photometric:  # light of both kinds together is photometric
                light.kind, light.E = "lm", light.E * EFFICACY
                light.W = None if light.W is None else light.W * EFFICACY
            else:
                light.L = light.L * EFFICACY
            light.converted = True
        return self._by_weights(light) if self.op.emitters else light

    def _by_weights(self, light: Light) -> Light:
        """Of a store of few emitters all light is theirs."""
        if any((x is not None and (x < 0).any()) for x in (light.E,)):
            raise Refused("an emission of a store of few emitters must not be negative", kind="bad-value")
        m, s = len(light.E), self.op.emitters
        W = np.zeros((m, self.about.channels, s)) if light.W is None else light.W.copy()
        for v in range(m):
            sky = None if light.L is None else light.L[v]
            if light.E[v].any() or (sky is not None and sky.any()):
                W[v] += emitter_weights(self.op, light.E[v], sky) if isinstance(self.op, NumpyOperator) else self.op.weights(light.E[v], sky)
        if light.D is not None:
            W[:, :, s - light.D.shape[2]:] += light.D
        light.W = W
        return light

    def _sky_of(self, values: Any) -> Array:
        if self.store.sky is None:
            raise Refused("the store has no sky; precompute it with --sky", kind="not-in-store")
        tiles = len(self.store.sky["tiles"])
        array = np.asarray(values, float)
        if self.about.channels == 1 and array.ndim == 2 and array.shape == (tiles, 3):
            array = array @ [0.265, 0.670, 0.065]
        return self._row(array, tiles, "emission/sky")

    def _dimmers_of(self, given: Mapping[str, Any]) -> Array:
        made = np.zeros((self.about.channels, len(self.store.luminaires["names"]) if self.store.luminaires else 0))
        taken: Dict[int, str] = {}
        for name, value in given.items():
            for k in self.store.luminaire_indices(name):
                if k in taken:
                    raise Refused(f"emission/luminaires: one is reached by {taken[k]} and {name}", kind="given-twice")
                taken[k] = name
                made[:, k] = self._colour(value, f"emission/luminaires/{name}")
        return made

    def _weights_of(self, given: Any) -> Array:
        if not self.op.emitters:
            raise Refused("the store answers any emission and has no emitters", kind="not-in-store")
        if not isinstance(given, Mapping):
            return self._row(given, self.op.emitters, "emission/emitters")
        made, names = np.zeros((self.about.channels, self.op.emitters)), Names(self.op.names, noun="emitter")
        for name, value in given.items():
            made[:, names.find(name)] = self._colour(value, f"emission/emitters/{name}")[:, None]
        return made

    def _direct(self, light: Light) -> Optional[Array]:
        """The irradiance H0 [m, C, n] of sky and luminaires; None: there is none."""
        made: Optional[Array] = None
        if light.L is not None and self.store.sky is not None:
            made = light.L @ self.store.sky["first_bounce"].astype(float)
        if light.D is not None and self.store.luminaires is not None:
            of = (light.D * self.store.luminaires["factors"]) @ self.store.luminaires["irradiance"].astype(float)
            made = of if made is None else made + of
        return made
