"""A scene in process, from a store."""

from __future__ import annotations

from typing import Any, Union

from .errors import Unsupported


def Local(path: str, library: Union[None, bool, str]) -> Any:
    raise Unsupported(f"{path}: a store needs a daemon: with lambert.serve({path!r}) as daemon: scene = daemon.scene()")
