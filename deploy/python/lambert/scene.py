"""A scene: what it consists of, its light under any emission, and gradients, whoever answers."""

from __future__ import annotations

import base64
import json
import os
import sys
import threading
import urllib.parse
from typing import Any, Dict, List, Mapping, Optional, Protocol, Sequence, Union

import numpy as np

from .answer import Answer, Figures, Jacobian
from .client import Client
from .errors import NotFound, Refused
from .light import About, AdjointQuery, Emission, LightQuery, Strings, gradient_of, reduction
from .mesh import Elements, Groups, Luminaire, Named, SensorSet, Sky, luminaires_of, sensors_of
from .remote import How, Remote
from .wire import Address, Array


class Source(Protocol):
    """The side that answers for a scene: a daemon, or a store in process."""

    @property
    def about(self) -> About: ...
    @property
    def where(self) -> str: ...
    def elements(self) -> Elements: ...
    def groups(self) -> List[Mapping[str, Any]]: ...
    def document(self, name: str) -> Optional[Mapping[str, Any]]: ...
    def light(self, query: LightQuery, how: How) -> Answer: ...
    def figures(self, query: LightQuery, how: How) -> Figures: ...
    def adjoint(self, query: AdjointQuery, how: How) -> List[Dict[str, Array]]: ...
    def jacobian(self, of: Mapping[str, Any], by: Any, quantity: Optional[str], how: How) -> Jacobian: ...
    def skies(self, skies: Sequence[Any], how: How) -> List[Dict[str, Any]]: ...
    def weather(self, gaps: Optional[str], how: How) -> Dict[str, Any]: ...
    def variant(self, name: str, reflectances: Mapping[str, Any], how: How) -> Source: ...
    def delete(self, how: How) -> None: ...
    def close(self) -> None: ...


class Scene:
    """A scene of a daemon, or of a store in process.

    `where` is "http://HOST:PORT/NAME", "http://HOST:PORT" where the daemon has one scene or `name` says which,
    "unix:/PATH[:NAME]", or the path of a store. A store is answered in process by liblambert (`library`: its path; False: NumPy
    alone, which cannot read hierarchical operators). Both have the same methods and give the same numbers.

    `token` is sent to the daemon, `timeout` (s) limits each request, `retries` says how often a busy daemon is asked again. Every
    method that asks takes a `timeout` of its own, and `cancel`, a threading.Event that gives it up. A scene that was replaced by one
    of another geometry is noticed before its numbers are used, by the tag that each answer has; of a daemon that sends none by one
    more request, at most every `check` seconds (0: after each answer; -1: never, whoever answers).

    >>> scene = lambert.Scene(address + "/box")
    >>> scene.name, scene.n, scene.channels, scene.units
    ('box', 400, 3, 'W')
    >>> scene.groups["floor"].elements
    71
    """

    def __init__(self, where: Union[str, "os.PathLike[str]"], name: Optional[str] = None, *, token: Optional[str] = None,
                 timeout: Optional[float] = 60.0, retries: int = 4, check: float = 0.0,
                 library: Union[None, bool, str] = None) -> None:
        text = os.fspath(where)
        source: Source
        if Address.is_one(text):
            address = Address.parse(text)
            if name is not None and address.name not in (None, name):
                raise Refused(f"{text} names {address.name}, but name is {name}")
            source = Remote(Client(address, token, timeout, retries), name or address.name, check)
        else:
            from .local import Local

            source = Local(text, library)
        self._begin(source)

    def _begin(self, source: Source) -> None:
        self._source = source
        self._groups: Optional[Groups] = None
        self._groups_of: Optional[Elements] = None
        self._documents: Dict[str, Any] = {}

    @classmethod
    def _of(cls, source: Source) -> Scene:
        made = cls.__new__(cls)
        made._begin(source)
        return made

    # Its parts.

    @property
    def about(self) -> Mapping[str, Any]:
        """All that `GET /v1/scenes/NAME` says: kind, method, errors, origin."""
        return self._source.about.facts

    @property
    def name(self) -> str:
        """The name of the scene."""
        return self._source.about.name

    @property
    def n(self) -> int:
        """The number of elements."""
        return self._source.about.n

    @property
    def channels(self) -> int:
        """The number of channels, C."""
        return self._source.about.channels

    @property
    def shape(self) -> "tuple[int, ...]":
        """The shape of a vector in answers: (n,) of one channel, (C, n) of more."""
        return self._source.about.shape

    @property
    def units(self) -> str:
        """The unit of its light: "W", so that light is in W/m², or "lm"."""
        return str(self.about.get("lights") or "W")

    lights = units

    @property
    def names(self) -> List[str]:
        """The names of its groups."""
        return [str(line["name"]) for line in self.about["groups"]]

    @property
    def groups(self) -> Groups:
        """Its groups by name, each with area (m²), elements, reflectance and emission [C] (means by area) and indices.

        >>> floor = lambert.Scene(address + "/box").groups["floor"]
        >>> round(floor.area, 2), len(floor.indices), floor.reflectance.shape
        (0.26, 71, (3,))
        """
        elements = self._source.elements()
        if self._groups is None or self._groups_of is not elements:
            self._groups, self._groups_of = Groups(self._source.groups(), elements.group, self.channels), elements
        return self._groups

    @property
    def areas(self) -> Array:
        """Areas of elements, [n], m²."""
        return self._source.elements().area

    @property
    def normals(self) -> Array:
        """Unit normals, [n, 3]."""
        return self._source.elements().normal

    @property
    def centres(self) -> Array:
        """Centroids, [n, 3], m."""
        return self._source.elements().centre

    @property
    def faces(self) -> Array:
        """The face of the scene file that each element is a part of, [n]; -1: none, or several."""
        return self._source.elements().face

    @property
    def reflectances(self) -> Array:
        """Reflectances, [C, n]."""
        return self._source.elements().reflectance

    def _document(self, name: str) -> Any:
        about, found = self._documents.get(name, (None, None))
        if about is not self._source.about:  # never asked for, or the store was read again
            about, found = self._source.about, self._source.document(name)
            self._documents[name] = about, found
        return found

    @property
    def luminaires(self) -> Mapping[str, Luminaire]:
        """Its luminaires by name; empty without any."""
        return luminaires_of(self._document("luminaires"))

    @property
    def sensors(self) -> Mapping[str, SensorSet]:
        """Its sets of sensors by name; empty without any."""
        return sensors_of(self._document("sensors"))

    @property
    def sky(self) -> Optional[Sky]:
        """The tiles of its sky; None without one."""
        read = self._document("sky")
        return None if read is None else Sky.of(read)

    # Light.

    def radiosity(self, emission: Emission, at: Optional[str] = None, select: Optional[Mapping[str, Any]] = None,
                  quantity: str = "radiosity", tolerance: Optional[float] = None, unit: Optional[str] = None,
                  limit: bool = True, *, photometric: Optional[bool] = None, stated: Optional[bool] = None,
                  timeout: Optional[float] = None, cancel: Optional[threading.Event] = None) -> Answer:
        """The radiosity B = E + rho H of all surfaces under an emission, with all bounces, or of a batch of them.

        An emission is an array [n] (alike in all channels) or [C, n]; or a mapping of groups, {"lamp": 17} or
        {"lamp": [17, 12, 4]} or {"lamp": "3600lm"}; or an object as requests have it, with "groups", "elements" and "values",
        "luminaires", "sky", "sun", "emitters", alone or together. A list of these, or an array [m, C, n] ([m, n] of one channel), is
        a batch.

        `select` answers some elements alone: {"groups": [...]}, {"elements": [...]}, {"faces": [...]}, {"sensors": [...]}
        (with quantity "irradiance") or {"probes": [...]}; `at="faces"` answers at the faces of the scene file. `tolerance`
        refines the answer to a certified error, in doubles. `unit` is that of the answer, such as "lx"; `limit=False` is the
        linear map, without which no light is below zero.

        The answer is an array [n], or [C, n] of more channels, one level deeper of a batch. The stated error comes with selected
        elements, else where `stated` is True, as JSON alone has it and arrays of NumPy are quicker.

        >>> scene = lambert.Scene(address + "/box")
        >>> B = scene.radiosity({"lamp": [17, 12, 4]})
        >>> B.shape, B.unit, bool((B >= 0).all())
        ((3, 400), 'W/m2', True)
        >>> scene.radiosity({"lamp": 17}, select={"groups": ["floor"]}).error["light"]
        'own'
        >>> scene.radiosity(np.ones(399))
        Traceback (most recent call last):
        lambert.errors.Refused: emission has the shape [399], must have [400] or [3, 400] as the scene box has, or one level more for a batch
        """
        if select is not None and {"sensors"} <= set(select):
            quantity = "irradiance" if quantity == "radiosity" else quantity
        query = LightQuery.of(self._source.about, emission, quantity=quantity, at=at, select=select, tolerance=tolerance,
                              unit=unit, photometric=photometric, limit=limit, stated=stated)
        return self._source.light(query, How(timeout, cancel))

    def irradiance(self, emission: Emission, at: Optional[str] = None, select: Optional[Mapping[str, Any]] = None,
                   **more: Any) -> Answer:
        """All light that is received, H; as radiosity() with the quantity "irradiance".

        >>> lambert.Scene(address + "/office").irradiance({"luminaires": {"row": 0.4}}, select={"sensors": ["desks"]}).shape
        (100,)
        """
        return self.radiosity(emission, at, select, "irradiance", **more)

    def indirect(self, emission: Emission, at: Optional[str] = None, select: Optional[Mapping[str, Any]] = None,
                 **more: Any) -> Answer:
        """The light after the first bounce, B - E - rho H0; as radiosity() with the quantity "indirect"."""
        return self.radiosity(emission, at, select, "indirect", **more)

    def reduce(self, emission: Emission, groups: Optional[Strings] = None, sensors: Optional[Strings] = None,
               figures: Strings = ("mean",), at_least: Union[None, float, Sequence[float]] = None,
               quantity: Optional[str] = None, *, tolerance: Optional[float] = None, unit: Optional[str] = None,
               limit: bool = True, photometric: Optional[bool] = None, timeout: Optional[float] = None,
               cancel: Optional[threading.Event] = None) -> Figures:
        """Figures of groups or of sets of sensors: mean, sum, min, max, uniformity, variance, share (with `at_least`) and ugr.

        The quantity is irradiance, unless it is given. Means and sums of groups cost nothing that grows with n.

        >>> office = lambert.Scene(address + "/office")
        >>> found = office.reduce({"luminaires": {"row": 1}}, sensors="desks", figures=("mean", "min"), at_least=[100, 300])
        >>> sorted(found["desks"]), sorted(found["desks"]["share"]), found.unit
        (['mean', 'min', 'share'], [100.0, 300.0], 'lx')
        """
        query = LightQuery.of(self._source.about, emission, quantity=quantity or "irradiance", tolerance=tolerance, unit=unit,
                              reduce=reduction(groups, sensors, figures, at_least), photometric=photometric, limit=limit)
        return self._source.figures(query, How(timeout, cancel))

    # Gradients.

    def adjoint(self, cotangent: Any, gradient: Strings = "emission", quantity: str = "radiosity",
                emission: Optional[Emission] = None, *, doubles: bool = False, timeout: Optional[float] = None,
                cancel: Optional[threading.Event] = None) -> Any:
        """Gradients of J = sum_i g_i q_i, with the cotangent g and the quantity q.

        A cotangent is what an emission may be, of either sign: an array, groups, elements; or {"sensors": {NAME: weight or array}}.
        `gradient` is "emission", "reflectance" (which needs an `emission`), "sky", "luminaires", "groups" or "emitters". The answer
        is an array of one name, a dictionary of a sequence of names; one level deeper of a batch of cotangents.

        >>> scene = lambert.Scene(address + "/box")
        >>> scene.adjoint({"floor": 1}).shape
        (3, 400)
        >>> sorted(scene.adjoint({"floor": 1}, ("groups", "reflectance"), emission={"lamp": 17}))
        ['groups', 'reflectance']
        """
        query = AdjointQuery.of(self._source.about, cotangent, gradient, quantity, emission, doubles)
        return gradient_of(self._source.adjoint(query, How(timeout, cancel)), gradient)

    def jacobian(self, of: Mapping[str, Any], by: Optional[Strings] = None, quantity: Optional[str] = None, *,
                 timeout: Optional[float] = None, cancel: Optional[threading.Event] = None) -> Jacobian:
        """Derivatives of the irradiance at sensors, of={"sensors": [...]}, of the means of groups, {"groups": [...]}, or of the values of
        {"elements": [...]}, by "luminaires", "groups", "sky" or "emitters". They are of radiosity unless the quantity is given,
        but for sensors. Times what the sources give they are the linear answer.

        >>> office = lambert.Scene(address + "/office")
        >>> J = office.jacobian({"sensors": ["desks"]}, by=["luminaires"])
        >>> J["luminaires"].shape, J.columns["luminaires"], J.rows["desks"]
        ((100, 3), ['row.0', 'row.1', 'desk'], slice(0, 100, None))
        >>> J = office.jacobian({"groups": ["floor", "ceiling"]}, "luminaires", "irradiance")
        >>> means = office.reduce({"luminaires": {"row": 1, "desk": 0.5}}, groups=["floor", "ceiling"], limit=False)
        >>> bool(abs(J["luminaires"] @ [1, 1, 0.5] - [means[name]["mean"] for name in J.rows]).max() < 1e-3)
        True
        """
        return self._source.jacobian(of, by, quantity, How(timeout, cancel))

    # Skies and materials.

    def skies(self, skies: Any, *, timeout: Optional[float] = None, cancel: Optional[threading.Event] = None) -> Any:
        """Radiances of the tiles of the sky: of one sky, or of a list of them; each with `sky`, `unit`, `sun` and so on.

        A sky is "overcast", or an object as POST .../skies has it. `sky` of an answer is that of an emission, as an array.

        >>> yard = lambert.Scene(address + "/yard")
        >>> sky = yard.skies({"name": "overcast", "lux_outside": 100})
        >>> sky["unit"], sky["sky"].shape, yard.irradiance({"sky": sky["sky"]}, photometric=True).unit
        ('lx', (145,), 'lx')
        """
        many = isinstance(skies, (list, tuple))
        found = self._source.skies(skies if many else [skies], How(timeout, cancel))
        for sky in found:
            sky["sky"] = np.array(sky["sky"], float)
        return found if many else found[0]

    def weather(self, gaps: Optional[str] = None, *, timeout: Optional[float] = None,
                cancel: Optional[threading.Event] = None) -> Dict[str, Any]:
        """The weather file beside the store: its place, and an array for each column of its rows."""
        read = self._source.weather(gaps, How(timeout, cancel))
        return {**read, "rows": {name: np.array(column) for name, column in read["rows"].items()}}

    def variant(self, name: str, reflectances: Mapping[str, Any], *, timeout: Optional[float] = None,
                cancel: Optional[threading.Event] = None) -> Scene:
        """The same scene under other reflectances of some groups, once it is built. Delete it when it is no longer needed.

        >>> red = lambert.Scene(address + "/paint", token="secret").variant("red", {"floor": [0.6, 0.1, 0.1]})
        >>> red.name
        'paint@red'
        >>> red.delete()
        """
        return Scene._of(self._source.variant(name, reflectances, How(timeout, cancel)))

    def delete(self) -> None:
        """Removes a variant; a scene of a store stays, which is an error."""
        self._source.delete(How())

    # Other libraries.

    def __matmul__(self, emission: Emission) -> Array:
        """The radiosity by the linear map, M~ E, of any sign: [n], [C, n] or [m, C, n].

        >>> scene = lambert.Scene(address + "/box")
        >>> E = np.random.default_rng(1).normal(size=scene.shape)
        >>> float(abs((scene @ -E) + (scene @ E)).max()) < 1e-6
        True
        """
        return self.radiosity(emission, limit=False).values

    @property
    def H(self) -> Transposed:
        """The transpose: `scene.H @ g` is the gradient of <g, M~ E> by E.

        >>> scene = lambert.Scene(address + "/box")
        >>> E, g = np.random.default_rng(1).normal(size=(2, *scene.shape))
        >>> bool(abs((g * (scene @ E)).sum() - ((scene.H @ g) * E).sum()) < 1e-3)
        True
        """
        return Transposed(self)

    T = H

    def as_operator(self, quantity: str = "radiosity") -> Any:
        """M~ as a scipy.sparse.linalg.LinearOperator of C n rows and columns; needs SciPy."""
        from .operators import linear_operator

        return linear_operator(self, quantity)

    def torch(self, quantity: str = "radiosity") -> Any:
        """A differentiable function of emission tensors [n], [C, n] or [m, C, n]; needs PyTorch."""
        from .operators import torch_function

        return torch_function(self, quantity)

    def jax(self, quantity: str = "radiosity") -> Any:
        """A differentiable function of emission arrays [n], [C, n] or [m, C, n]; needs JAX."""
        from .operators import jax_function

        return jax_function(self, quantity)

    # The rest.

    def show(self, width: str = "100%", height: int = 600) -> Page:
        """The page of the daemon: a frame in a notebook; elsewhere its address is printed."""
        page = Page(self._source.where, width, height)
        if "IPython" not in sys.modules and not hasattr(sys, "ps1"):  # neither would show what this gives
            print(page.address)
        return page

    def close(self) -> None:
        """Ends its connections; questions that wait in other threads end in Cancelled."""
        self._source.close()

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<lambert.Scene {self._source.where}: {self.n} elements, {self.channels} channel{'s' * (self.channels > 1)}>"


class Transposed:
    """The transpose of a scene's linear map."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def __matmul__(self, cotangent: Any) -> Array:
        found: Array = self._scene.adjoint(cotangent)
        return found

    @property
    def H(self) -> Scene:
        return self._scene


class Page:
    """The page of a scene. Notebooks show it as a frame."""

    def __init__(self, where: str, width: str, height: int) -> None:
        if not where.startswith("http"):
            raise NotFound(f"{where}: a page has an address of HTTP; with lambert.serve(STORE) as daemon: daemon.scene().show()")
        base, _, name = where.rpartition("/")
        state = json.dumps({"scene": urllib.parse.unquote(name)}).encode()
        link = base64.urlsafe_b64encode(state).decode().rstrip("=")  # as the page writes its own links
        self.address, self.width, self.height = f"{base}/#1.{link}", width, height

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.address}" width="{self.width}" height="{self.height}" style="border:0" allowfullscreen></iframe>'

    def __repr__(self) -> str:
        return self.address
