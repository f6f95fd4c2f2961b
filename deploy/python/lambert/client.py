"""Requests of threads: kept connections over TCP or a Unix socket, time limits, and ways to give up."""

from __future__ import annotations

import http.client
import os
import select
import socket
import threading
import time
import weakref
from typing import Any, Dict, List, Optional

from .errors import Cancelled, Disconnected
from .wire import Address, Attempts, Reply, Request

KEPT = 2  # idle connections of a thread
POLL_S = 0.02
CHUNK = 1 << 20


class _Connection(http.client.HTTPConnection):
    """One that closes when nobody has it any more: those of threads that have ended."""

    def __del__(self) -> None:
        self.close()


class _SecureConnection(http.client.HTTPSConnection):
    def __del__(self) -> None:
        self.close()


class _UnixConnection(_Connection):
    def __init__(self, path: str, timeout: Optional[float]) -> None:
        super().__init__("localhost", timeout=timeout)
        self.path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.path)


class Client:
    """Asks one daemon. Any number of threads may share it; each keeps connections of its own.

    The time limit `timeout` (s; None: none) is that of a whole request with all its attempts. The daemon is told, so that it
    computes nothing that nobody waits for. A request that is answered 429 or 503 is sent again after the `Retry-After` of the answer,
    up to `retries` times, as long as the time limit allows it.
    """

    def __init__(self, address: Address, token: Optional[str] = None, timeout: Optional[float] = 60.0,
                 retries: int = 4) -> None:
        self.address, self.token, self.timeout, self.retries = address, token, timeout, retries
        self._own = threading.local()
        self._all: weakref.WeakSet[http.client.HTTPConnection] = weakref.WeakSet()
        self._lock = threading.Lock()
        self._closed = 0  # counts calls of close()

    def ask(self, request: Request, *, timeout: Optional[float] = None, cancel: Optional[threading.Event] = None,
            accepted: tuple[int, ...] = (200,)) -> Reply:
        """The answer to a request; one of another status than those accepted is an error."""
        attempts = Attempts(request, self.timeout if timeout is None else timeout, self.retries)
        while True:
            reply = self._once(request, attempts, cancel)
            if reply.status in accepted:
                return reply
            wait = attempts.after(reply)
            if wait is None:
                raise reply.error(request)
            if cancel is None:
                time.sleep(wait)
            elif cancel.wait(wait):
                raise Cancelled("given up while the daemon was busy", route=request.route)

    def close(self) -> None:
        """Ends all connections; requests that wait in other threads end in Cancelled. The next one opens new connections."""
        with self._lock:
            self._closed += 1
            connections = list(self._all)
        for connection in connections:
            sock = connection.sock
            if sock is not None:
                try:
                    sock.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass  # it is closed already

    def _connections(self) -> List[http.client.HTTPConnection]:
        """The idle connections of this thread; connections from before close() are dropped."""
        now = self._closed, os.getpid()  # a forked process must not write into its parent's connections
        if getattr(self._own, "of", None) != now:
            for connection in getattr(self._own, "idle", ()):
                connection.close()
            self._own.idle, self._own.of = [], now
        idle: List[http.client.HTTPConnection] = self._own.idle
        return idle

    def _connect(self, seconds: Optional[float]) -> http.client.HTTPConnection:
        made: http.client.HTTPConnection
        address = self.address
        if address.socket is not None:
            made = _UnixConnection(address.socket, seconds)
        elif address.secure:
            made = _SecureConnection(address.host, address.port, timeout=seconds)
        else:
            made = _Connection(address.host, address.port, timeout=seconds)
        with self._lock:
            self._all.add(made)
        return made

    def _once(self, request: Request, attempts: Attempts, cancel: Optional[threading.Event]) -> Reply:
        """One answer, over a kept connection or a new one; a connection that was closed while idle is replaced once."""
        closed = self._closed
        while True:
            if cancel is not None and cancel.is_set():
                raise Cancelled("given up before it was sent", route=request.route)
            idle = self._connections()
            seconds = attempts.left()
            connection = idle.pop() if idle else None
            reused = connection is not None
            if connection is None:
                connection = self._connect(seconds)
            try:
                reply = self._exchange(connection, request, attempts, cancel)
            except BaseException as error:
                connection.close()
                if not isinstance(error, (OSError, http.client.HTTPException)):
                    raise
                if self._closed != closed:
                    raise Cancelled("the connections were closed", route=request.route) from None
                if isinstance(error, socket.timeout):
                    raise attempts.over() from None
                if attempts.after_loss(reused):
                    continue
                reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error) or "closed"
                raise Disconnected(f"{self.address.base}: {reason}", route=request.route) from error
            if connection.sock is not None and len(idle) < KEPT and self._closed == closed:
                idle.append(connection)
            else:
                connection.close()
            return reply

    def _exchange(self, connection: http.client.HTTPConnection, request: Request, attempts: Attempts,
                  cancel: Optional[threading.Event]) -> Reply:
        seconds = attempts.left()
        if connection.sock is not None:
            connection.sock.settimeout(seconds)
        try:
            connection.request(request.method, request.path, request.body, request.all_headers(self.token, seconds))
        except (BrokenPipeError, ConnectionResetError):
            if connection.sock is None or not request.body:
                raise
            # A body that is refused by its length is not read to its end: the answer may stand there already.
        self._wait(connection.sock, request, attempts, cancel)
        response = connection.getresponse()
        headers: Dict[str, str] = {name.lower(): value for name, value in response.getheaders()}
        # The body is read into memory that arrays may share and write.
        length = response.length
        if length is None:
            return Reply(response.status, headers, bytearray(response.read()))
        body = bytearray(length)
        view, at = memoryview(body), 0
        while at < length:
            if at > 0:  # a long one
                self._wait(connection.sock, request, attempts, cancel)
            got = response.readinto(view[at:at + CHUNK])
            if got == 0:
                raise http.client.IncompleteRead(b"", length - at)
            at += got
        response.read()
        return Reply(response.status, headers, body)

    @staticmethod
    def _wait(sock: Any, request: Request, attempts: Attempts, cancel: Optional[threading.Event]) -> None:
        """Until there is something to read, if anybody may give up meanwhile."""
        seconds = attempts.left()
        if sock is not None:
            sock.settimeout(seconds)
        if cancel is None or sock is None:
            return
        poll = select.poll()
        poll.register(sock, select.POLLIN)
        while not poll.poll(1000 * POLL_S):
            attempts.left()
            if cancel.is_set():
                raise Cancelled("given up before its answer", route=request.route)
