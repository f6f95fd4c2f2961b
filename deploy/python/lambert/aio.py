"""Scenes of a daemon for asyncio: the same questions, awaited. It needs nothing but the standard library and NumPy.

    async with await lambert.aio.open("http://127.0.0.1:8317/office") as scene:
        B, figures = await asyncio.gather(scene.radiosity({"lamp": 17}), scene.reduce({"lamp": 17}, groups="floor"))

A question is given up by cancelling its task. Indices are those of the scene that was opened: one of another geometry in its
place is noticed by its answer, as in lambert.Scene.
"""

from __future__ import annotations

import asyncio
import ssl
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from .answer import Answer, Figures, Jacobian, joined
from .errors import Disconnected, LambertError, Refused
from .light import (About, AdjointQuery, Emission, LightQuery, Strings, gradient_of, jacobian_of, jacobian_request, reduction,
                    skies_request)
from .remote import Watch
from .wire import Address, Attempts, Reply, Request

KEPT = 16  # idle connections
HEAD = 1 << 16
Stream = Tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Client:
    """Asks one daemon from one event loop; each question that is under way has a connection of its own."""

    def __init__(self, address: Address, token: Optional[str] = None, timeout: Optional[float] = 60.0, retries: int = 4) -> None:
        self.address, self.token, self.timeout, self.retries = address, token, timeout, retries
        self._idle: List[Stream] = []

    async def ask(self, request: Request, *, timeout: Optional[float] = None, accepted: Tuple[int, ...] = (200,)) -> Reply:
        """The answer to a request; one of another status than those accepted is an error."""
        attempts = Attempts(request, self.timeout if timeout is None else timeout, self.retries)
        try:
            return await asyncio.wait_for(self._ask(request, attempts, accepted), attempts.left())
        except asyncio.TimeoutError:
            raise attempts.over() from None

    async def _ask(self, request: Request, attempts: Attempts, accepted: Tuple[int, ...]) -> Reply:
        while True:
            reply = await self._once(request, attempts)
            if reply.status in accepted:
                return reply
            wait = attempts.after(reply)
            if wait is None:
                raise reply.error(request)
            await asyncio.sleep(wait)

    async def _connect(self) -> Stream:
        if self.address.socket is not None:
            return await asyncio.open_unix_connection(self.address.socket, limit=HEAD)
        context = ssl.create_default_context() if self.address.secure else None
        return await asyncio.open_connection(self.address.host, self.address.port, limit=HEAD, ssl=context)

    async def _once(self, request: Request, attempts: Attempts) -> Reply:
        while True:
            reused = bool(self._idle)
            stream: Optional[Stream] = None
            try:
                stream = self._idle.pop() if reused else await self._connect()
                reply, kept = await _exchange(stream, request, self.address.authority, request.all_headers(self.token, attempts.left()))
            except (OSError, EOFError, ValueError, asyncio.LimitOverrunError) as error:
                if stream is not None:
                    stream[1].close()
                if attempts.after_loss(reused):
                    continue
                reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
                raise Disconnected(f"{self.address.base}: {reason or 'closed'}", route=request.route) from error
            except BaseException:  # cancelled: the daemon sees that nobody waits any more
                if stream is not None:
                    stream[1].close()
                raise
            if kept and len(self._idle) < KEPT:
                self._idle.append(stream)
            else:
                stream[1].close()
            return reply

    async def close(self) -> None:
        """Closes idle connections."""
        while self._idle:
            writer = self._idle.pop()[1]
            writer.close()
            try:
                await writer.wait_closed()
            except OSError:
                pass  # it was closed by the daemon


async def _exchange(stream: Stream, request: Request, host: str, headers: Mapping[str, str]) -> Tuple[Reply, bool]:
    """One request and its answer; and whether the connection stays open."""
    reader, writer = stream
    lines = [f"{request.method} {request.path} HTTP/1.1", f"Host: {host}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    if request.body is not None or request.method != "GET":
        lines.append(f"Content-Length: {len(request.body or b'')}")
    writer.write("\r\n".join([*lines, "", ""]).encode("latin-1") + (request.body or b""))
    try:
        await writer.drain()
    except ConnectionError:
        if not request.body:
            raise  # of a body that is refused by its length the answer may stand there already
    while True:
        head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")
        version, _, rest = head[0].partition(" ")
        status = int(rest.split(" ")[0])
        if status >= 200 or status == 101:
            break  # others come before the answer
    found: Dict[str, str] = {}
    for line in head[1:]:
        name, colon, value = line.partition(":")
        if colon:
            found[name.strip().lower()] = value.strip()
    kept = version == "HTTP/1.1" and found.get("connection", "").lower() != "close"
    if status in (204, 304):
        return Reply(status, found, b""), kept
    if found.get("transfer-encoding", "").lower() == "chunked":
        return Reply(status, found, await _chunks(reader)), kept
    if "content-length" in found:
        return Reply(status, found, await reader.readexactly(int(found["content-length"]))), kept
    return Reply(status, found, await reader.read()), False


async def _chunks(reader: asyncio.StreamReader) -> bytes:
    made: List[bytes] = []
    while True:
        size = int((await reader.readuntil(b"\r\n")).split(b";")[0], 16)
        if size == 0:
            while await reader.readuntil(b"\r\n") != b"\r\n":
                pass  # trailers
            return b"".join(made)
        made.append(await reader.readexactly(size))
        await reader.readexactly(2)


class Scene:
    """A scene of a daemon; open() makes one. Its questions are those of lambert.Scene, whose docstrings say what they take.

    >>> async def light():
    ...     async with await lambert.aio.open(address + "/box", token="secret") as scene:
    ...         B, g = await asyncio.gather(scene.radiosity({"lamp": 17}), scene.adjoint({"floor": 1}))
    ...         return B.shape, g.shape
    >>> asyncio.run(light())
    ((3, 400), (3, 400))
    """

    def __init__(self, client: Client, watch: Watch) -> None:
        self._client, self._watch = client, watch

    @property
    def _about(self) -> About:
        return self._watch.about

    @property
    def about(self) -> Mapping[str, Any]:
        """All that `GET /v1/scenes/NAME` says."""
        return self._about.facts

    @property
    def name(self) -> str:
        """The name of the scene."""
        return self._about.name

    @property
    def n(self) -> int:
        """The number of elements."""
        return self._about.n

    @property
    def channels(self) -> int:
        """The number of channels, C."""
        return self._about.channels

    @property
    def shape(self) -> Tuple[int, ...]:
        """The shape of a vector in answers."""
        return self._about.shape

    @property
    def names(self) -> List[str]:
        """The names of its groups."""
        return [str(line["name"]) for line in self.about["groups"]]

    async def _ask(self, request: Request, timeout: Optional[float], by_index: bool = True) -> Reply:
        """An answer of the scene that was opened, else SceneChanged; `by_index`: elements are sent or answered."""
        try:
            reply = await self._client.ask(request, timeout=timeout)
        except LambertError as error:  # a refusal may come of another scene, too
            if error.scene_tag is not None:
                await self._notice(error.scene_tag, timeout)
            raise
        if by_index or reply.scene_tag is not None:
            await self._notice(reply.scene_tag, timeout)
        return reply

    async def _notice(self, tag: Optional[str], timeout: Optional[float]) -> None:
        asks = self._watch.asks(tag)
        if asks is not None:
            self._watch.take(await self._client.ask(asks, timeout=timeout, accepted=(200, 304)), tag)

    async def radiosity(self, emission: Emission, at: Optional[str] = None, select: Optional[Mapping[str, Any]] = None,
                        quantity: str = "radiosity", tolerance: Optional[float] = None, unit: Optional[str] = None, limit: bool = True,
                        *, photometric: Optional[bool] = None, stated: Optional[bool] = None, timeout: Optional[float] = None) -> Answer:
        """As lambert.Scene.radiosity; the requests of a long batch are asked together."""
        if select is not None and "sensors" in select and quantity == "radiosity":
            quantity = "irradiance"
        query = LightQuery.of(self._about, emission, quantity=quantity, at=at, select=select, tolerance=tolerance, unit=unit,
                              photometric=photometric, limit=limit, stated=stated)
        by_index = select is None or not {"sensors", "probes"} & set(select)

        async def one(part: LightQuery) -> Answer:
            return part.light(await self._ask(part.array_request() or part.request(), timeout, by_index))

        return joined(list(await asyncio.gather(*map(one, query.parts()))))

    async def irradiance(self, emission: Emission, at: Optional[str] = None, select: Optional[Mapping[str, Any]] = None,
                         **more: Any) -> Answer:
        """As lambert.Scene.irradiance."""
        return await self.radiosity(emission, at, select, "irradiance", **more)

    async def indirect(self, emission: Emission, at: Optional[str] = None, select: Optional[Mapping[str, Any]] = None,
                       **more: Any) -> Answer:
        """As lambert.Scene.indirect."""
        return await self.radiosity(emission, at, select, "indirect", **more)

    async def reduce(self, emission: Emission, groups: Optional[Strings] = None, sensors: Optional[Strings] = None,
                     figures: Strings = ("mean",), at_least: Union[None, float, Sequence[float]] = None,
                     quantity: Optional[str] = None, *, tolerance: Optional[float] = None, unit: Optional[str] = None,
                     limit: bool = True, photometric: Optional[bool] = None, timeout: Optional[float] = None) -> Figures:
        """As lambert.Scene.reduce."""
        query = LightQuery.of(self._about, emission, quantity=quantity or "irradiance", tolerance=tolerance, unit=unit,
                              reduce=reduction(groups, sensors, figures, at_least), photometric=photometric, limit=limit)
        return query.figures(await self._ask(query.request(), timeout, query.dense))

    async def adjoint(self, cotangent: Any, gradient: Strings = "emission", quantity: str = "radiosity",
                      emission: Optional[Emission] = None, *, doubles: bool = False, timeout: Optional[float] = None) -> Any:
        """As lambert.Scene.adjoint; the requests of a long batch are asked together."""
        query = AdjointQuery.of(self._about, cotangent, gradient, quantity, emission, doubles)

        async def one(part: AdjointQuery) -> Dict[str, Any]:
            return part.gradients(await self._ask(part.request(), timeout))

        return gradient_of(list(await asyncio.gather(*map(one, query.parts()))), gradient)

    async def jacobian(self, of: Mapping[str, Any], by: Optional[Strings] = None, quantity: Optional[str] = None, *,
                       timeout: Optional[float] = None) -> Jacobian:
        """As lambert.Scene.jacobian."""
        return jacobian_of(await self._ask(jacobian_request(self._about, of, by, quantity), timeout, "elements" in of))

    async def skies(self, skies: Any, *, timeout: Optional[float] = None) -> Any:
        """As lambert.Scene.skies, with radiances as lists."""
        many = isinstance(skies, (list, tuple))
        reply = await self._ask(skies_request(self._about, skies if many else [skies]), timeout, False)
        found = reply.json()["skies"]
        return found if many else found[0]

    async def close(self) -> None:
        """Closes its idle connections."""
        await self._client.close()

    async def __aenter__(self) -> Scene:
        return self

    async def __aexit__(self, *error: Any) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<lambert.aio.Scene {self._client.address.base}/{self.name}: {self.n} elements>"


async def open(where: str, name: Optional[str] = None, *, token: Optional[str] = None, timeout: Optional[float] = 60.0,
               retries: int = 4, check: float = 0.0) -> Scene:
    """The scene at an address, as lambert.Scene takes it; a store in process is no matter of waiting, so lambert.Scene is for it."""
    if not Address.is_one(where):
        raise Refused(f"{where}: is no address such as http://127.0.0.1:8317/NAME; lambert.Scene opens a store in process")
    address = Address.parse(where)
    client = Client(address, token, timeout, retries)
    try:
        asked = name or address.name
        if asked is None:
            names = [line["name"] for line in (await client.ask(Request("GET", "/v1/scenes"))).json()["scenes"]]
            if len(names) != 1:
                raise Refused(f"{address.base} has {len(names)} scenes, so that one is named: {', '.join(names) or 'none'}")
            asked = str(names[0])
        return Scene(client, Watch.of(await client.ask(Watch.first(asked)), asked, check))
    except LambertError:
        await client.close()
        raise
