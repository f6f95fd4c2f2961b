"""The errors of the package: a refused request, a scene that is gone or another one, a daemon that is full or gone."""

from __future__ import annotations

from typing import Any, Mapping, Optional


class LambertError(Exception):
    """Any error of this package.

    Of an answer of the daemon it has the `status` of HTTP, the `title`, the `detail` that names index and value, the
    `pointer` to the place in the body, the `kind`, a section of api.md such as "bad-index", and the `route` that was
    asked. Of others these are None, but for `detail`.

    >>> error = LambertError("group 3 has no name", pointer="/groups/3", route="GET /v1/scenes")
    >>> str(error), error.pointer, error.status
    ('GET /v1/scenes: group 3 has no name (/groups/3)', '/groups/3', None)
    """

    def __init__(self, detail: str, *, status: Optional[int] = None, title: Optional[str] = None,
                 pointer: Optional[str] = None, kind: Optional[str] = None, route: Optional[str] = None) -> None:
        self.status, self.title, self.detail = status, title, detail
        self.pointer, self.kind, self.route = pointer, kind, route
        self.scene_tag: Optional[str] = None  # of an answer, that of the scene that gave it
        before = "" if route is None else f"{route}: " if status is None else f"{route}: {status} "
        super().__init__(before + detail + (f" ({pointer})" if pointer else ""))


class Refused(LambertError):
    """422, or 400, 409, 413 and 415: the request cannot be answered as it stands. So also where this package sees it first."""


class NotFound(LambertError):
    """404: there is no such scene, variant or route, or no sky, luminaires or sensors in the store."""


class Denied(LambertError):
    """401 or 403: the token is missing, unknown or has not this right, or the daemon was started without this ability."""


class Busy(LambertError):
    """429: there are too many variants already."""


class Unavailable(LambertError):
    """503: the daemon loads, drains or is full, or the scene is damaged, longer than the time limit lets wait."""


class Disconnected(LambertError):
    """There is no daemon at the address, or it went away before its answer was whole."""


class TimedOut(Disconnected):
    """The time limit of the request is over."""


class Cancelled(LambertError):
    """The request was given up by its `cancel` event, or by `close()` in another thread."""


class SceneChanged(LambertError):
    """The scene was replaced by one of another geometry, so that indices and areas known before are not its own."""


class Unsupported(LambertError):
    """This way of asking cannot do this: something in process that needs the daemon, or a library that is not installed."""



_BY_STATUS = {400: Refused, 401: Denied, 403: Denied, 404: NotFound, 409: Refused, 413: Refused, 415: Refused,
              422: Refused, 429: Busy, 503: Unavailable}


def of_answer(status: int, problem: Mapping[str, Any], route: str) -> LambertError:
    """The error that an answer's problem document (RFC 9457) stands for.

    >>> of_answer(422, {"title": "Bad index", "detail": "element 9", "type": "deploy/docs/api.md#bad-index"}, "POST /x").kind
    'bad-index'
    """
    kind = str(problem.get("type", "")).rpartition("#")[2] or None
    detail = str(problem.get("detail") or problem.get("title") or "the answer says no more")
    made = _BY_STATUS.get(status, LambertError)
    return made(detail, status=status, title=problem.get("title"), pointer=problem.get("pointer"), kind=kind, route=route)
