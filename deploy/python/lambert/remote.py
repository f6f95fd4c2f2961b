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
from .errors import Cancelled, LambertError, NotFound, Refused, SceneChanged, TimedOut
from .light import About, AdjointQuery, LightQuery, jacobian_of, jacobian_request, skies_request
from .mesh import FIELDS, Elements
from .wire import ZIP, Array, Reply, Request, to_json


@dataclass(frozen=True)
class How:
    """The time limit of a question, and an event that gives it up."""

    timeout: Optional[float] = None
    cancel: Optional[threading.Event] = None


class Watch:
    """The scene that a client opened, and how it notices that another one stands in its place; it asks nobody itself."""

    def __init__(self, about: About, etag: Optional[str], check_s: float) -> None:
        self.about, self.etag, self.check_s = about, etag, check_s
        self._same = {about.tag}  # tags of scenes of this geometry
        self._checked = time.monotonic()

    @staticmethod
    def first(name: str) -> Request:
        return Request("GET", "/v1/scenes/" + urllib.parse.quote(name, safe="@"))

    @staticmethod
    def of(reply: Reply, name: str, check_s: float) -> Watch:
        """Begins with the answer to the first request."""
        return Watch(About.of(reply.json(), name, reply.scene_tag), reply.headers.get("etag"), check_s)

    def asks(self, tag: Optional[str]) -> Optional[Request]:
        """The request whose answer, 200 or 304, says that the scene is still this one; None: it is. `tag` is that of an answer."""
        if self.check_s < 0 or (tag is not None and tag in self._same):
            return None
        if tag is None and (self.etag is None or time.monotonic() - self._checked < self.check_s):
            return None
        return Request("GET", self.about.path, headers={} if self.etag is None else {"If-None-Match": self.etag})

    def take(self, reply: Reply, tag: Optional[str]) -> bool:
        """SceneChanged where the answer of this tag is of another geometry. True where the scene has other light or materials now."""
        now = None
        if reply.status == 200:
            now = About.of(reply.json(), self.about.name, reply.scene_tag)
            if geometry_of(now) != geometry_of(self.about):
                raise SceneChanged(f"the scene {now.name} was replaced by one of another geometry: {now.n} elements, {now.channels} "
                                   f"channels, in place of {self.about.n} and {self.about.channels}; open it again")
            # The same geometry under other light or materials: indices and areas mean what they did.
            self._same.add(now.tag)
            self.about, self.etag = now, reply.headers.get("etag")
        if tag is not None and tag not in self._same:
            raise SceneChanged(f"the scene {self.about.name} was replaced while it answered; ask again")
        self._checked = time.monotonic()
        return now is not None


class Remote:
    """Asks a daemon about one scene. Any number of threads may share it."""

    def __init__(self, client: Client, name: Optional[str], check: float) -> None:
        self.client = client
        self._lock = threading.Lock()
        self._elements: Optional[Elements] = None
        name = self._only_name() if name is None else name
        self._watch = Watch.of(client.ask(Watch.first(name)), name, check)

    def _only_name(self) -> str:
        names = [line["name"] for line in self.client.ask(Request("GET", "/v1/scenes")).json()["scenes"]]
        if len(names) != 1:
            raise Refused(f"{self.client.address.base} has {len(names)} scenes, so that one is named: {', '.join(names) or 'none'}")
        return str(names[0])

    @property
    def about(self) -> About:
        return self._watch.about

    def _send(self, request: Request, how: How, accepted: Tuple[int, ...] = (200,)) -> Reply:
        return self.client.ask(request, timeout=how.timeout, cancel=how.cancel, accepted=accepted)

    def _ask(self, request: Request, how: How = How(), accepted: Tuple[int, ...] = (200,), by_index: bool = True) -> Reply:
        """An answer of the scene that was opened, else SceneChanged; `by_index`: elements are sent or answered."""
        try:
            reply = self._send(request, how, accepted)
        except LambertError as error:  # a refusal may come of another scene, too
            if error.scene_tag is not None:
                self._notice(error.scene_tag, how)
            raise
        if by_index or reply.scene_tag is not None:
            self._notice(reply.scene_tag, how)
        return reply

    def _notice(self, tag: Optional[str], how: How) -> None:
        asks = self._watch.asks(tag)
        if asks is None:
            return
        reply = self._send(asks, how, (200, 304))
        with self._lock:
            if self._watch.take(reply, tag):
                self._elements = None

    def elements(self) -> Elements:
        with self._lock:
            if self._elements is not None:
                return self._elements
        fields = urllib.parse.quote(",".join(FIELDS), safe=",")
        try:
            made = Elements.read(self._ask(Request("GET", f"{self.about.path}/elements?fields={fields}", accept=ZIP)))
        except NotFound as error:
            raise NotFound(f"{error.detail}; a daemon of version 0.3 or later has areas and groups of elements",
                           status=error.status, route=error.route) from None
        if len(made.area) != self.about.n:
            raise SceneChanged(f"the scene {self.about.name} has {len(made.area)} elements instead of {self.about.n}: it was "
                               "replaced; open it again")
        with self._lock:
            self._elements = made
        return made

    def groups(self) -> List[Mapping[str, Any]]:
        lines: List[Mapping[str, Any]] = self._ask(Request("GET", f"{self.about.path}/groups"), by_index=False).json()["groups"]
        return lines

    def document(self, name: str) -> Optional[Mapping[str, Any]]:
        """Of the sky, the luminaires, the sensors; None where the store has none."""
        try:
            read: Mapping[str, Any] = self._ask(Request("GET", f"{self.about.path}/{name}"), by_index=False).json()
        except NotFound:
            if self.about.facts.get(name) is None:
                return None
            raise
        return read

    def light(self, query: LightQuery, how: How) -> Answer:
        by_index = query.select is None or not {"sensors", "probes"} & set(query.select)
        return joined([part.light(self._ask(part.array_request() or part.request(), how, by_index=by_index)) for part in query.parts()])

    def figures(self, query: LightQuery, how: How) -> Figures:
        return query.figures(self._ask(query.request(), how, by_index=query.dense))

    def adjoint(self, query: AdjointQuery, how: How) -> List[Dict[str, Array]]:
        return [part.gradients(self._ask(part.request(), how)) for part in query.parts()]

    def jacobian(self, of: Mapping[str, Any], by: Any, quantity: Optional[str], how: How) -> Jacobian:
        return jacobian_of(self._ask(jacobian_request(self.about, of, by, quantity), how, by_index="elements" in of))

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
        self._send(request, how, (202,))
        whole = f"{self.about.name}@{name}"
        seconds = self.client.timeout if how.timeout is None else how.timeout
        until = None if seconds is None else time.monotonic() + seconds
        wait, asks = 0.005, Request("GET", "/v1/scenes/" + urllib.parse.quote(whole, safe="@"))
        while True:
            if self._send(asks, how, (200, 202)).status == 200:
                return Remote(self.client, whole, self._watch.check_s)
            if until is not None and time.monotonic() > until:
                raise TimedOut(f"the variant is not built within {seconds:g} s", route=asks.route)
            if how.cancel is not None and how.cancel.wait(wait):
                raise Cancelled("given up before the variant was built", route=asks.route)
            if how.cancel is None:
                time.sleep(wait)
            wait = min(2 * wait, 0.2)

    def delete(self, how: How) -> None:
        self._send(Request("DELETE", self.about.path), how, (204,))

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


