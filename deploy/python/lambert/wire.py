"""The parts that both kinds of client share: addresses, requests and replies, NumPy arrays as bodies, and when to ask again."""

from __future__ import annotations

import functools
import io
import json
import time
import urllib.parse
from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Tuple, Union

import numpy as np

from .errors import LambertError, Refused, TimedOut, of_answer

NPY, JSON, ZIP = "application/x-npy", "application/json", "application/zip"
Array = np.ndarray[Any, np.dtype[Any]]
_npy: Any = np.lib.format  # it has no types


@dataclass(frozen=True)
class Address:
    """Where a daemon listens, and the scene that the address names.

    >>> Address.parse("http://127.0.0.1:8317/office").name
    'office'
    >>> Address.parse("unix:/run/lambert.sock:office").socket
    '/run/lambert.sock'
    >>> Address.parse("http://127.0.0.1:8317/v1/scenes/a%20b").name
    'a b'
    """

    host: str
    port: int
    secure: bool = False
    socket: Optional[str] = None
    name: Optional[str] = None

    @staticmethod
    def is_one(text: str) -> bool:
        """True of an address of a daemon, false of what may be a file."""
        return text.startswith(("http://", "https://", "unix:"))

    @staticmethod
    def parse(text: str) -> Address:
        """Reads an address; one that is none is Refused."""
        if text.startswith("unix:"):
            path, _, name = text[len("unix:"):].partition(":")
            if not path:
                raise Refused(f"{text}: the path of a socket is missing, as in unix:/run/lambert.sock:NAME")
            return Address("localhost", 0, socket=path, name=name or None)
        url = urllib.parse.urlsplit(text)
        try:
            port = url.port
        except ValueError:
            raise Refused(f"{text}: the port is no number from 0 to 65535") from None
        if url.scheme not in ("http", "https") or not url.hostname:
            raise Refused(f"{text}: is no address such as http://127.0.0.1:8317/NAME or unix:/run/lambert.sock:NAME")
        secure = url.scheme == "https"
        parts = [urllib.parse.unquote(part) for part in url.path.split("/") if part]
        if parts[:2] == ["v1", "scenes"]:
            parts = parts[2:]
        if len(parts) > 1:
            raise Refused(f"{text}: names more than a scene; http://HOST:PORT/NAME names one")
        default = 443 if secure else 80
        return Address(url.hostname, default if port is None else port, secure, name=parts[0] if parts else None)

    @property
    def base(self) -> str:
        """The address without a scene."""
        if self.socket is not None:
            return f"unix:{self.socket}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.secure else 'http'}://{host}:{self.port}"

    @property
    def authority(self) -> str:
        """The Host of its requests."""
        if self.socket is not None:
            return "localhost"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return host if self.port == (443 if self.secure else 80) else f"{host}:{self.port}"


@dataclass(frozen=True)
class Request:
    """A request, whoever sends it."""

    method: str
    path: str
    body: Optional[bytes] = None
    kind: Optional[str] = None
    accept: Optional[str] = None
    headers: Mapping[str, str] = field(default_factory=dict)

    @property
    def route(self) -> str:
        return f"{self.method} {self.path}"

    @property
    def repeatable(self) -> bool:
        """True where asking twice is as good as asking once: of all that only reads or computes."""
        return self.method in ("GET", "POST")

    def all_headers(self, token: Optional[str], seconds: Optional[float]) -> Dict[str, str]:
        """Its headers, but for those that say where it goes and how long it is."""
        made = dict(self.headers)
        if self.kind is not None:
            made["Content-Type"] = self.kind
        if self.accept is not None:
            made["Accept"] = self.accept
        if token is not None:
            made["Authorization"] = f"Bearer {token}"
        if seconds is not None and self.method == "POST":
            made["Lambert-Timeout"] = f"{max(seconds, 0.001):.3f}"
        return made


@dataclass(frozen=True)
class Reply:
    """An answer; the names of headers are in small letters."""

    status: int
    headers: Mapping[str, str]
    body: Union[bytes, bytearray]

    def json(self) -> Any:
        return json.loads(self.body)

    def array(self) -> Array:
        return from_npy(self.body)

    @property
    def is_npy(self) -> bool:
        return self.headers.get("content-type", "").startswith(NPY)

    def error(self, request: Request) -> LambertError:
        """The error that it stands for."""
        try:
            problem = self.json()
        except ValueError:
            problem = None
        if not isinstance(problem, dict):  # that of a proxy, maybe
            text = bytes(self.body[:200]).decode(errors="replace").strip()
            problem = {"detail": text or "the answer has no body"}
        made = of_answer(self.status, problem, request.route)
        made.scene_tag = self.scene_tag
        return made

    @property
    def scene_tag(self) -> Optional[str]:
        """The tag of the scene that gave it; None of other answers, and of an older daemon."""
        return self.headers.get("lambert-scene")


def to_json(path: str, body: Mapping[str, Any], *, method: str = "POST", accept: Optional[str] = None) -> Request:
    """A request whose body is JSON.

    >>> to_json("/x", {"values": np.ones(2)}).body
    b'{"values":[1.0,1.0]}'
    """
    try:
        text = json.dumps(body, separators=(",", ":"), allow_nan=False, default=_plain)
    except ValueError as error:
        raise Refused(f"the request holds a number that is not finite: {error}", route=f"{method} {path}") from None
    return Request(method, path, text.encode(), JSON, accept)


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    raise Refused(f"a request holds a {type(value).__name__}, must hold numbers, texts, lists and arrays")


def to_npy(array: Array) -> bytes:
    """The bytes of an array as an NPY file holds them: <f4, or <f8 of doubles."""
    out = io.BytesIO()
    kind = "<f8" if array.dtype == np.float64 else "<f4"
    _npy.write_array(out, np.ascontiguousarray(array, dtype=kind), version=(1, 0))
    return out.getvalue()


@functools.lru_cache(64)
def _npy_head(head: bytes) -> Tuple[Tuple[int, ...], bool, Any]:
    """Shape, order and type of an NPY file; NumPy takes as long to read them as a daemon takes for a small scene."""
    file = io.BytesIO(head)
    read = _npy.read_array_header_1_0 if _npy.read_magic(file) == (1, 0) else _npy.read_array_header_2_0
    shape, fortran, dtype = read(file)
    return shape, fortran, dtype


def from_npy(body: Union[bytes, bytearray]) -> Array:
    """The array of an NPY file, which shares the bytes where these may be written.

    >>> from_npy(to_npy(np.float32([1, 2])))
    array([1., 2.], dtype=float32)
    """
    try:
        size = 10 + int.from_bytes(body[8:10], "little") if body[6:7] == b"\1" else 12 + int.from_bytes(body[8:12], "little")
        shape, fortran, dtype = _npy_head(bytes(body[:size]))
        flat = np.frombuffer(body, dtype, count=int(np.prod(shape, dtype=np.int64)), offset=size)
    except (ValueError, EOFError) as error:
        raise LambertError(f"the answer is no NPY array: {error}") from None
    array = flat.reshape(shape, order="F" if fortran else "C")
    return array if array.flags.writeable else array.copy()


class Attempts:
    """The time limit of a request, and whether it may be sent again.

    >>> Attempts(Request("GET", "/"), 9, 3).after(Reply(503, {"retry-after": "1"}, b""))
    1.0
    >>> Attempts(Request("PUT", "/"), 9, 3).after(Reply(429, {"retry-after": "1"}, b"")) is None
    True
    """

    def __init__(self, request: Request, timeout: Optional[float], retries: int) -> None:
        self.request, self.timeout, self.retries = request, timeout, retries
        self.until = None if timeout is None else time.monotonic() + timeout
        self.reused = True  # one more attempt is free where a connection was closed while nobody used it

    def left(self) -> Optional[float]:
        """The seconds that are left; None: as many as wanted."""
        if self.until is None:
            return None
        left = self.until - time.monotonic()
        if left <= 0:
            raise self.over()
        return left

    def over(self) -> TimedOut:
        return TimedOut(f"no answer within {self.timeout:g} s", route=self.request.route)

    def after(self, reply: Reply) -> Optional[float]:
        """The seconds to wait before it is asked again; None where the reply is the answer."""
        if reply.status not in (429, 503) or not self.request.repeatable or self.retries <= 0:
            return None
        try:
            wait = max(float(reply.headers.get("retry-after", 1)), 0.05)
        except ValueError:  # a date, which lambertd never sends
            wait = 1.0
        if self.until is not None and time.monotonic() + wait >= self.until:
            return None
        self.retries -= 1
        return wait

    def after_loss(self, reused: bool) -> bool:
        """True where a connection that broke before its answer is no reason to give up."""
        again = reused and self.reused and self.request.repeatable
        self.reused = False
        return again


def server_times(reply: Reply) -> Dict[str, float]:
    """Milliseconds by the names of Server-Timing.

    >>> server_times(Reply(200, {"server-timing": "parse;dur=0.012, solve;dur=0.41"}, b""))
    {'parse': 0.012, 'solve': 0.41}
    """
    times: Dict[str, float] = {}
    for part in reply.headers.get("server-timing", "").split(","):
        name, _, value = part.strip().partition(";dur=")
        if value:
            times[name] = float(value)
    return times


def shape_text(shape: Tuple[int, ...]) -> str:
    """A shape as messages have it.

    >>> shape_text((3, 400))
    '[3, 400]'
    """
    return "[" + ", ".join(map(str, shape)) + "]"
