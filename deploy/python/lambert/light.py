"""Questions about light, apart from who answers them: what an emission may be, the requests for it, and their answers."""

from __future__ import annotations

import urllib.parse
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from .answer import Answer, Figures, Jacobian
from .errors import LambertError, Refused, SceneChanged
from .wire import NPY, Array, Reply, Request, server_times, shape_text, to_json, to_npy

Emission = Any  # see Scene.radiosity
Strings = Union[str, Sequence[str]]
_MEMBERS = ("elements", "values", "groups", "sky", "sun", "luminaires", "emitters")
QUANTITIES = ("radiosity", "irradiance", "indirect")
BATCH, BATCH_BYTES = 64, 1 << 26  # of a request; longer batches are several of them


@dataclass(frozen=True)
class About:
    """The facts of a scene that come before any question: its name, n, C, and `facts`, the answer to GET /v1/scenes/NAME.

    `tag` is that of the scene, which a daemon sends with each answer; None: it is an older one, or the scene is in process.
    """

    name: str
    n: int
    channels: int
    facts: Mapping[str, Any]
    tag: Optional[str] = None

    @staticmethod
    def of(facts: Mapping[str, Any], name: Optional[str] = None, tag: Optional[str] = None) -> About:
        return About(name or str(facts["name"]), int(facts["elements"]), int(facts["channels"]), facts, tag)

    @property
    def path(self) -> str:
        return "/v1/scenes/" + urllib.parse.quote(self.name, safe="@")

    @property
    def shape(self) -> Tuple[int, ...]:
        """That of a vector in answers."""
        return (self.n,) if self.channels == 1 else (self.channels, self.n)

    def dense(self, array: Array, what: str = "emission") -> Array:
        """An array of numbers [n] or [C, n] as floats; of another shape it is Refused."""
        if array.dtype.kind not in "fiub":
            raise Refused(f"{what} holds {array.dtype}, must hold real numbers")
        if array.shape not in ((self.n,), (self.channels, self.n)):
            raise Refused(f"{what} has the shape {shape_text(array.shape)}, must have {self.shapes()}")
        array = array.reshape(self.n) if self.channels == 1 else array  # [1][n] is no batch of one
        return array if array.dtype in (np.float32, np.float64) else array.astype(np.float64)

    def shapes(self) -> str:
        one, more, m = shape_text((self.n,)), f"{self.channels}, {self.n}]", "one level more for a batch"
        return f"{one}{'' if self.channels == 1 else f' or [{more}'} as the scene {self.name} has, or {m}"

    def rows(self, array: Array) -> Array:
        """[C, n] of [n] or [C, n]."""
        return np.broadcast_to(array, (self.channels, self.n))


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray) or (hasattr(value, "__array__") and not isinstance(value, (np.generic, Mapping)))


def one_emission(about: About, emission: Emission, what: str = "emission") -> Union[Array, Dict[str, Any]]:
    """An emission in one of two forms: a dense array, or the object that requests have."""
    if not isinstance(emission, Mapping):
        try:
            array = np.asarray(emission)
        except ValueError:
            raise Refused(f"{what} is a list of lists of different lengths") from None
        return about.dense(array, what)
    known = [key for key in emission if key in _MEMBERS]
    if not known:
        return {"groups": dict(emission)}
    if len(known) < len(emission):
        others = ", ".join(str(key) for key in emission if key not in _MEMBERS)
        raise Refused(f"{what} has {known[0]!r} beside {others}; put groups into {{\"groups\": {{…}}}}")
    made = dict(emission)
    if "elements" in made and "values" not in made:  # a dense emission beside something else
        array = about.dense(np.asarray(made["elements"]), what)
        made["elements"], made["values"] = list(range(about.n)), array.T.tolist()
    for key in ("sky", "emitters"):
        # A dense array of channels is [C, m] in NumPy, and a list of m colours in requests.
        if _is_array(made.get(key)):
            array = np.asarray(made[key])
            if array.ndim == 2 and array.shape[0] == about.channels:
                array = array.T if about.channels > 1 else array[0]
            made[key] = array.tolist()
    return made


def emissions_of(about: About, emission: Emission, what: str = "emission") -> Tuple[List[Union[Array, Dict[str, Any]]], bool]:
    """The emissions of a question, and whether it is a batch.

    >>> about = About("box", 4, 1, {})
    >>> [e.shape for e in emissions_of(about, np.ones((3, 1, 4)))[0]]
    [(4,), (4,), (4,)]
    >>> emissions_of(about, [{"lamp": 1}, {"groups": {"lamp": 2}}])
    ([{'groups': {'lamp': 1}}, {'groups': {'lamp': 2}}], True)
    """
    if _is_array(emission) and (np.ndim(emission) == 3 or np.ndim(emission) == 2 and about.channels == 1):
        array = np.asarray(emission)
        array = array[:, None] if array.ndim == 2 else array  # of one channel, as answers to a batch are
        if array.shape[1:] != (about.channels, about.n) or array.shape[0] == 0:
            raise Refused(f"{what} has the shape {shape_text(array.shape)}, must have "
                          f"{shape_text((about.channels, about.n))} behind the number of a batch, m")
        return [about.dense(row, what) for row in array], True
    if isinstance(emission, (list, tuple)) and (not emission or any(isinstance(e, Mapping) or _is_array(e) for e in emission)):
        if not emission:
            raise Refused(f"{what} is an empty batch")
        return [one_emission(about, e, f"{what} {i} of the batch") for i, e in enumerate(emission)], True
    return [one_emission(about, emission, what)], False


def _parts(about: About, vectors: List[Any]) -> List[List[Any]]:
    """A batch in as many requests as it takes."""
    step = max(1, min(BATCH, BATCH_BYTES // (8 * about.n * about.channels)))
    return [vectors[i:i + step] for i in range(0, len(vectors), step)]


def _stacked(about: About, vectors: List[Any], batch: bool) -> Array:
    """Dense vectors as one array: [n] or [C, n] of one, [m, C, n] of a batch."""
    if not batch:
        return np.asarray(vectors[0])
    made: Array = np.stack([about.rows(np.asarray(v)) for v in vectors]).astype(np.result_type(*vectors), copy=False)
    return made


def _query(members: Mapping[str, Any]) -> str:
    """Members of a request whose body is an array.

    >>> _query({"quantity": "indirect", "limit": False}), _query({})
    ('?quantity=indirect&limit=false', '')
    """
    words = [f"{name}={str(value).lower()}" for name, value in members.items()]
    return "?" + "&".join(words) if words else ""


def word(value: str, among: Sequence[str], what: str) -> str:
    if value not in among:
        raise Refused(f"{what} {value!r} is none of {', '.join(among)}")
    return value


@dataclass(frozen=True)
class LightQuery:
    """A question for the light of emissions, or for its figures."""

    about: About
    emissions: List[Union[Array, Dict[str, Any]]]
    batch: bool
    quantity: str = "radiosity"
    at: Optional[str] = None
    select: Optional[Mapping[str, Any]] = None
    reduce: Optional[Mapping[str, Any]] = None
    tolerance: Optional[float] = None
    unit: Optional[str] = None
    photometric: Optional[bool] = None
    limit: bool = True
    stated: Optional[bool] = None

    @staticmethod
    def of(about: About, emission: Emission, *, quantity: str = "radiosity", at: Optional[str] = None,
           select: Optional[Mapping[str, Any]] = None, reduce: Optional[Mapping[str, Any]] = None,
           tolerance: Optional[float] = None, unit: Optional[str] = None, photometric: Optional[bool] = None,
           limit: bool = True, stated: Optional[bool] = None) -> LightQuery:
        emissions, batch = emissions_of(about, emission)
        word(quantity, QUANTITIES, "quantity")
        if at is not None:
            word(at, ("elements", "faces"), "at")
        if select is not None:
            select = {key: _listed(value) for key, value in select.items()}
        return LightQuery(about, emissions, batch, quantity, at, select, reduce, tolerance, unit, photometric, limit, stated)

    def parts(self) -> List[LightQuery]:
        """The question in as many requests as its batch takes."""
        return [replace(self, emissions=part) for part in _parts(self.about, self.emissions)] if self.batch else [self]

    @property
    def whole(self) -> bool:
        """True where all elements are answered, in as many channels as the scene has."""
        return self.select is None and self.reduce is None and self.at in (None, "elements") and self.unit in (None, "W/m2")

    @property
    def dense(self) -> bool:
        return all(isinstance(e, np.ndarray) for e in self.emissions)

    def members(self) -> Dict[str, Any]:
        """The members of the request beside its emissions."""
        made: Dict[str, Any] = {}
        if self.quantity != "radiosity":
            made["quantity"] = self.quantity
        if not self.limit:
            made["limit"] = False
        for name in ("at", "select", "reduce", "tolerance", "unit", "photometric"):
            if getattr(self, name) is not None:
                made[name] = getattr(self, name)
        return made

    def array_request(self) -> Optional[Request]:
        """The request by NPY; None where it would need more members than a query may have, or a query that an older daemon leaves unread."""
        members = self.members()
        if not self.dense or self.stated or set(members) - {"limit", "quantity"} or (members and self.about.tag is None):
            return None
        body = _stacked(self.about, self.emissions, self.batch)
        return Request("POST", self.about.path + "/radiosity" + _query(members), to_npy(body), NPY, NPY)

    def request(self) -> Request:
        body: Dict[str, Any] = self.members()
        if self.batch:
            body["emissions"] = self.emissions
        else:
            body["emission"] = self.emissions[0]
        by_array = self.reduce is None and not self.stated and (self.stated is False or self.select is None)
        return to_json(self.about.path + "/radiosity", body, accept=NPY if by_array else None)

    def light(self, reply: Reply) -> Answer:
        """The answer to a question without `reduce`."""
        headers = reply.headers
        if reply.is_npy:
            count = headers.get("lambert-limited")
            certificate, iterations = headers.get("lambert-certificate"), headers.get("lambert-iterations")
            answer = Answer.of(reply.array(), unit=headers.get("lambert-unit"), times=server_times(reply),
                               converted_by=headers.get("lambert-converted-by"),
                               limited=None if count is None else int(count),
                               certificate=None if certificate is None else float(certificate),
                               iterations=None if iterations is None else int(iterations))
        else:
            read = reply.json()
            values = np.array(read[read["quantity"]], np.float64 if self.tolerance is not None else np.float32)
            answer = Answer.of(values, error=read.get("error"), unit=read.get("unit"), times=read.get("time_ms"),
                               converted_by=read.get("converted_by"), limited=read.get("limited"),
                               certificate=read.get("certificate"), iterations=read.get("iterations"))
        self.check(answer.shape)
        return answer

    def check(self, shape: Tuple[int, ...]) -> None:
        """A scene that was replaced by one of another size is noticed by its answer."""
        if not self.whole:
            return
        wanted = ((len(self.emissions),) if self.batch else ()) + self.about.shape
        luminance = wanted[:-2] + wanted[-1:] if self.about.channels > 1 else wanted
        if shape != wanted and shape != luminance:
            raise SceneChanged(f"the scene {self.about.name} answers the shape {shape_text(shape)} instead of {shape_text(wanted)}: "
                               "it was replaced; open it again")

    def figures(self, reply: Reply) -> Figures:
        """The answer to a question with `reduce`."""
        read = reply.json()
        over = "sensors" if self.reduce is not None and "sensors" in self.reduce else "groups"
        return Figures.of(read[over], error=read.get("error"), unit=read.get("unit"), times=read.get("time_ms"),
                          converted_by=read.get("converted_by"), limited=read.get("limited"))


def reduction(groups: Optional[Strings], sensors: Optional[Strings], figures: Strings,
              at_least: Union[None, float, Sequence[float]]) -> Dict[str, Any]:
    """The member `reduce` of a request."""
    if (groups is None) == (sensors is None):
        raise Refused("figures are of groups or of sensors: one of the two is given")
    words = _listed(figures)
    made: Dict[str, Any] = {"groups": _listed(groups)} if groups is not None else {"sensors": _listed(sensors)}
    if at_least is not None:
        made["at_least"] = [float(limit) for limit in np.atleast_1d(at_least)]
        words = words if "share" in words else [*words, "share"]
    made["with"] = words
    return made


def _listed(value: Any) -> List[Any]:
    if isinstance(value, str) or np.ndim(value) == 0:
        return [value]
    return list(value.tolist() if isinstance(value, np.ndarray) else value)


@dataclass(frozen=True)
class AdjointQuery:
    """A question for gradients of J = sum g q, of one cotangent or of a batch."""

    about: About
    cotangents: List[Union[Array, Dict[str, Any]]]
    batch: bool
    gradient: Tuple[str, ...]
    quantity: str = "radiosity"
    emission: Union[None, Array, Dict[str, Any]] = None
    doubles: bool = False

    @staticmethod
    def of(about: About, cotangent: Any, gradient: Strings, quantity: str, emission: Emission, doubles: bool = False) -> AdjointQuery:
        names = tuple(_listed(gradient))
        word(quantity, QUANTITIES, "quantity")
        if not names:
            raise Refused("gradient names nothing; it is of emission, reflectance, sky, emitters, groups or luminaires")
        if isinstance(cotangent, Mapping) and "sensors" in cotangent:
            sensors = cotangent["sensors"]
            cotangents: List[Union[Array, Dict[str, Any]]] = [
                {"sensors": {name: {"values": np.asarray(v).tolist()} if np.ndim(v) > 0 else v for name, v in sensors.items()}}]
            batch = False
        else:
            cotangents, batch = emissions_of(about, cotangent, "cotangent")
        light = None if emission is None else one_emission(about, emission)
        return AdjointQuery(about, cotangents, batch, names, quantity, light, doubles)

    def parts(self) -> List[AdjointQuery]:
        """The question in as many requests as its batch takes."""
        return [replace(self, cotangents=part) for part in _parts(self.about, self.cotangents)] if self.batch else [self]

    def request(self) -> Request:
        path = self.about.path + "/adjoint"
        accept = NPY + ("; dtype=f8" if self.doubles else "")
        members: Dict[str, Any] = {} if self.quantity == "radiosity" else {"quantity": self.quantity}
        alone = self.gradient == ("emission",) and self.emission is None and (not members or self.about.tag is not None)
        if alone and all(isinstance(g, np.ndarray) for g in self.cotangents):
            return Request("POST", path + _query(members), to_npy(_stacked(self.about, self.cotangents, self.batch)), NPY, accept)
        body: Dict[str, Any] = {"cotangents": self.cotangents} if self.batch else {"cotangent": self.cotangents[0]}
        body.update({"gradient": list(self.gradient), **members})
        if self.emission is not None:
            body["emission"] = self.emission
        return to_json(path, body, accept=accept if len(self.gradient) == 1 else None)

    def gradients(self, reply: Reply) -> Dict[str, Array]:
        """Arrays by name, one level deeper of a batch."""
        if reply.is_npy:
            made = {self.gradient[0]: reply.array()}
        else:
            kind = np.float64 if self.doubles else np.float32
            made = {name: np.array(values, kind) for name, values in reply.json()["gradient"].items()}
        wanted = ((len(self.cotangents),) if self.batch else ()) + self.about.shape
        for name in ("emission", "reflectance"):
            if name in made and made[name].shape != wanted:
                raise SceneChanged(f"the scene {self.about.name} answers a gradient of the shape {shape_text(made[name].shape)} "
                                   f"instead of {shape_text(wanted)}: it was replaced; open it again")
        return made


def gradient_of(found: List[Dict[str, Array]], gradient: Strings) -> Any:
    """The gradients of the parts of a question as a caller gets them: an array for one name, a dictionary for several."""
    made = {name: found[0][name] if len(found) == 1 else np.concatenate([f[name] for f in found]) for name in found[0]}
    return made[gradient] if isinstance(gradient, str) else made


def jacobian_request(about: About, of: Mapping[str, Any], by: Optional[Strings], quantity: Optional[str] = None) -> Request:
    body: Dict[str, Any] = {"of": {key: _listed(value) for key, value in of.items()}}
    if by is not None:
        body["by"] = _listed(by)
    if quantity is not None:
        body["quantity"] = word(quantity, QUANTITIES, "quantity")
    return to_json(about.path + "/jacobian", body)


def jacobian_of(reply: Reply) -> Jacobian:
    read = reply.json()
    try:
        rows = read.get("sensors") or {name: 1 for name in read.get("groups", ())}
        return Jacobian.of(read["jacobian"], rows, read["columns"], server_times(reply))
    except KeyError as missing:
        raise LambertError(f"the answer has no {missing}") from None


def skies_request(about: About, skies: Sequence[Any]) -> Request:
    return to_json(about.path + "/skies", {"skies": list(skies)})
