"""A scene that a daemon answers for."""

from __future__ import annotations

import json
import threading
import time
import urllib.parse
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from .answer import Answer, Figures, Jacobian, joined
from .client import Client
from .errors import Cancelled, NotFound, Refused, SceneChanged, TimedOut
from .light import About, AdjointQuery, LightQuery, jacobian_of, jacobian_request, skies_request
from .mesh import FIELDS, Elements
from .wire import ZIP, Array, Reply, Request, to_json

TRIES = 16  # dense questions for the linear map by JSON, after an answer by NPY was limited


@dataclass(frozen=True)
class How:
    """The time limit of a question, and an event that gives it up."""

    timeout: Optional[float] = None
    cancel: Optional[threading.Event] = None


class Remote:
    """Asks a daemon about one scene. Any number of threads may share it."""

    def __init__(self, client: Client, name: Optional[str], check: float) -> None:
        self.client, self.check_s = client, check
        self._lock = threading.Lock()
        self._elements: Optional[Elements] = None
        self._linear_by_json = 0
        if name is None:
            name = self._only_name()
        self.about, self._tag = self._describe(name, None)
        self._checked = time.monotonic()

    def _only_name(self) -> str:
        names = [line["name"] for line in self.client.ask(Request("GET", "/v1/scenes")).json()["scenes"]]
        if len(names) != 1:
            raise Refused(f"{self.client.address.base} has {len(names)} scenes, so that one is named: {', '.join(names) or 'none'}")
        return str(names[0])

    def _describe(self, name: str, how: Optional[How]) -> Tuple[About, Optional[str]]:
        request = Request("GET", "/v1/scenes/" + urllib.parse.quote(name, safe="@"))
        reply = self._ask(request, how or How())
        return About.of(reply.json(), name), reply.headers.get("etag")

    def _ask(self, request: Request, how: How, accepted: Tuple[int, ...] = (200,)) -> Reply:
        return self.client.ask(request, timeout=how.timeout, cancel=how.cancel, accepted=accepted)

    def still_there(self, how: How = How()) -> None:
        """SceneChanged where the scene is no longer the one that was opened: after an answer, before it is used."""
        if self.check_s < 0 or time.monotonic() - self._checked < self.check_s or self._tag is None:
            return
        reply = self._ask(Request("GET", self.about.path, headers={"If-None-Match": self._tag}), how, (200, 304))
        if reply.status == 200:
            now = About.of(reply.json(), self.about.name)
            if geometry_of(now) != geometry_of(self.about):
                raise SceneChanged(f"the scene {now.name} was replaced by one of another geometry: {now.n} elements, {now.channels} "
                                   f"channels, in place of {self.about.n} and {self.about.channels}; open it again")
            # The same geometry under other light or materials: indices and areas mean what they did.
            with self._lock:
                self.about, self._tag, self._elements = now, reply.headers.get("etag"), None
        self._checked = time.monotonic()

    def elements(self) -> Elements:
        with self._lock:
            if self._elements is not None:
                return self._elements
        fields = urllib.parse.quote(",".join(FIELDS), safe=",")
        try:
            made = Elements.read(self.client.ask(Request("GET", f"{self.about.path}/elements?fields={fields}", accept=ZIP)))
        except NotFound as error:
            raise NotFound(f"{error.detail}; a daemon of version 0.3 or later has areas and groups of elements",
                           status=error.status, route=error.route) from None
        if len(made.area) != self.about.n:
            raise SceneChanged(f"the scene {self.about.name} has {len(made.area)} elements instead of {self.about.n}: it was "
                               "replaced; open it again")
        self.still_there()
        with self._lock:
            self._elements = made
        return made

    def groups(self) -> List[Mapping[str, Any]]:
        lines: List[Mapping[str, Any]] = self.client.ask(Request("GET", f"{self.about.path}/groups")).json()["groups"]
        return lines

    def document(self, name: str) -> Optional[Mapping[str, Any]]:
        """Of the sky, the luminaires, the sensors; None where the store has none."""
        try:
            read: Mapping[str, Any] = self.client.ask(Request("GET", f"{self.about.path}/{name}")).json()
        except NotFound:
            if self.about.facts.get(name) is None:
                return None
            raise
        return read

    def light(self, query: LightQuery, how: How) -> Answer:
        answer = joined([self._light(part, how) for part in query.parts()])
        if query.select is None or not {"sensors", "probes"} & set(query.select):
            self.still_there(how)
        return answer

    def _light(self, query: LightQuery, how: How) -> Answer:
        """By NPY where that says all. NPY cannot ask for the linear map, but says how often its answer is not that of the map."""
        by_array = query.array_request()
        if by_array is not None and (query.limit or self._linear_by_json == 0):
            answer = query.light(self._ask(by_array, how))
            if query.limit or answer.limited == 0:
                return answer
            self._linear_by_json = TRIES
        elif by_array is not None:
            self._linear_by_json -= 1
        return query.light(self._ask(query.request(), how))

    def figures(self, query: LightQuery, how: How) -> Figures:
        figures = query.figures(self._ask(query.request(), how))
        if query.dense:
            self.still_there(how)
        return figures

    def adjoint(self, queries: Sequence[AdjointQuery], how: How) -> List[Dict[str, Array]]:
        found = [query.gradients(self._ask(query.request(), how)) for query in queries]
        self.still_there(how)
        return found

    def jacobian(self, of: Mapping[str, Any], by: Any, how: How) -> Jacobian:
        return jacobian_of(self._ask(jacobian_request(self.about, of, by), how))

    def skies(self, skies: Sequence[Any], how: How) -> List[Dict[str, Any]]:
        found: List[Dict[str, Any]] = self._ask(skies_request(self.about, skies), how).json()["skies"]
        return found

    def weather(self, gaps: Optional[str], how: How) -> Dict[str, Any]:
        body = {} if gaps is None else {"gaps": gaps}
        found: Dict[str, Any] = self._ask(to_json(f"{self.about.path}/weather", body), how).json()
        return found

    def variant(self, name: str, reflectances: Mapping[str, Any], how: How) -> Remote:
        """The variant, when it is built."""
        request = to_json(f"{self.about.path}/reflectance", {"variant": name, "groups": dict(reflectances)}, method="PUT")
        self._ask(request, how, (202,))
        whole = f"{self.about.name}@{name}"
        seconds = self.client.timeout if how.timeout is None else how.timeout
        until = None if seconds is None else time.monotonic() + seconds
        wait, asks = 0.005, Request("GET", "/v1/scenes/" + urllib.parse.quote(whole, safe="@"))
        while True:
            if self._ask(asks, how, (200, 202)).status == 200:
                return Remote(self.client, whole, self.check_s)
            if until is not None and time.monotonic() > until:
                raise TimedOut(f"the variant is not built within {seconds:g} s", route=asks.route)
            if how.cancel is not None and how.cancel.wait(wait):
                raise Cancelled("given up before the variant was built", route=asks.route)
            if how.cancel is None:
                time.sleep(wait)
            wait = min(2 * wait, 0.2)

    def delete(self, how: How) -> None:
        self._ask(Request("DELETE", self.about.path), how, (204,))

    @property
    def where(self) -> str:
        return f"{self.client.address.base}/{urllib.parse.quote(self.about.name, safe='@')}"

    def close(self) -> None:
        self.client.close()


def geometry_of(about: About) -> Tuple[Any, ...]:
    """The things that have to stay for an index to mean the same: n, C, groups and the hash of the mesh."""
    provenance = about.facts.get("provenance") or {}
    groups = json.dumps([[line["name"], line["elements"]] for line in about.facts.get("groups", [])])
    return about.n, about.channels, groups, provenance.get("geometry_hash")


