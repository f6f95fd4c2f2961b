"""A daemon: one that runs somewhere, or one that is started here."""

from __future__ import annotations

import os
import queue
import re
import shutil
import subprocess
import tempfile
import threading
import time
from typing import Any, Dict, List, Optional, Union

from .client import Client
from .errors import Disconnected, LambertError, NotFound, TimedOut, Unavailable
from .remote import Remote
from .scene import Scene
from .wire import Address, Request

PathLike = Union[str, "os.PathLike[str]"]


class Daemon:
    """A daemon and its scenes.

    >>> daemon = lambert.connect(address)
    >>> daemon.scenes()[0]["name"], daemon.health(), daemon.openapi()["openapi"]
    ('box', True, '3.1.0')
    >>> daemon.scene("office").n
    296
    """

    def __init__(self, client: Client) -> None:
        self._client = client

    @property
    def address(self) -> str:
        """Its address, such as "http://127.0.0.1:8317"."""
        return self._client.address.base

    def scenes(self) -> List[Dict[str, Any]]:
        """Name, elements, channels, kind and bytes of every scene."""
        found: List[Dict[str, Any]] = self._client.ask(Request("GET", "/v1/scenes")).json()["scenes"]
        return found

    def refused(self) -> List[Dict[str, Any]]:
        """The stores that could not be read, with the reason."""
        found: List[Dict[str, Any]] = self._client.ask(Request("GET", "/v1/scenes")).json().get("refused", [])
        return found

    def scene(self, name: Optional[str] = None, check: float = 0.0) -> Scene:
        """One of its scenes; without a name the one that it has."""
        return Scene._of(Remote(self._client, name, check))

    def health(self) -> bool:
        """True where it is ready, false where it loads or drains."""
        try:
            self._client.ask(Request("GET", "/readyz"), timeout=5)
        except (Unavailable, Disconnected):
            return False
        return True

    def openapi(self) -> Dict[str, Any]:
        """The exact description of its routes."""
        found: Dict[str, Any] = self._client.ask(Request("GET", "/v1/openapi.json")).json()
        return found

    def sun(self, place: Dict[str, float], hours: List[float], year: int = 2001) -> Dict[str, Any]:
        """Azimuth and altitude of the sun at hours of a year."""
        from .wire import to_json

        body = {"place": place, "hours": hours, "year": year}
        found: Dict[str, Any] = self._client.ask(to_json("/v1/sun", body)).json()
        return found

    def close(self) -> None:
        """Ends the connections to it."""
        self._client.close()

    def __enter__(self) -> Daemon:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<lambert.Daemon {self.address}>"


def connect(address: str, *, token: Optional[str] = None, timeout: Optional[float] = 60.0, retries: int = 4) -> Daemon:
    """The daemon at "http://HOST:PORT" or "unix:/PATH"; it is asked for nothing before it has to be."""
    return Daemon(Client(Address.parse(address), token, timeout, retries))


class Served(Daemon):
    """A daemon of this program, which ends with it."""

    def __init__(self, client: Client, process: "subprocess.Popen[str]", log: Any) -> None:
        super().__init__(client)
        self.process, self._log = process, log

    def close(self) -> None:
        """Stops the daemon."""
        super().close()
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        if self.process.stdout is not None:
            self.process.stdout.close()
        self._log.close()

    def __enter__(self) -> Served:
        return self


def serve(*stores: PathLike, program: Optional[PathLike] = None, arguments: "tuple[str, ...]" = (), wait: float = 60.0,
          timeout: Optional[float] = 60.0) -> Served:
    """Starts lambertd on a free port of the loopback with these stores; a context manager that stops it.

    `program` is looked for in the environment's LAMBERTD and the PATH unless it is given, `arguments` are further options.

    >>> with lambert.serve(store) as daemon:
    ...     round(daemon.scene().reduce({"lamp": 17}, groups="floor", quantity="radiosity")["floor"]["mean"].sum(), 1) > 0
    True
    """
    found = os.fspath(program) if program is not None else os.environ.get("LAMBERTD") or shutil.which("lambertd")
    if found is None:
        raise NotFound("no program lambertd is in the PATH; name it: lambert.serve(STORE, program=PATH)")
    log = tempfile.TemporaryFile("w+")
    command = [found, "--listen", "127.0.0.1:0", *arguments, *(os.fspath(store) for store in stores)]
    try:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    except OSError as error:
        log.close()
        raise NotFound(f"{found}: {error.strerror}") from None
    lines: "queue.Queue[Optional[str]]" = queue.Queue()

    def listen() -> None:  # to its end, so that a full pipe never stops the daemon
        try:
            for line in process.stdout or ():
                lines.put(line)
        except ValueError:
            pass  # it was closed
        lines.put(None)

    reader = threading.Thread(target=listen, daemon=True)
    reader.start()
    until = time.monotonic() + wait
    try:
        while True:
            line = lines.get(timeout=max(until - time.monotonic(), 0))
            if line is None:
                log.seek(0)
                said = log.read().strip() or f"it ended with {process.wait()}"
                raise LambertError(f"lambertd did not start: {said}")
            listening = re.search(r"listening on (http://\S+)", line)
            if listening:
                return Served(Client(Address.parse(listening[1]), None, timeout), process, log)
    except BaseException as error:
        process.kill()
        process.wait()
        reader.join()
        if process.stdout is not None:
            process.stdout.close()
        log.close()
        if isinstance(error, queue.Empty):
            raise TimedOut(f"lambertd did not listen within {wait:g} s") from None
        raise
