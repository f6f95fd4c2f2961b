"""Lambert: light with all its bounces in static diffuse scenes, as arrays of NumPy.

    scene = lambert.Scene("http://127.0.0.1:8317/office")     # of a daemon; or lambert.Scene("office.h5"), in process
    B = scene.radiosity({"lamp": 17})                          # [n], or [C, n]
    g = scene.adjoint(B - wanted)                              # the gradient of |B - wanted|^2 / 2

The manual is python.md.
"""

from . import aio
from .answer import Answer, Figures, Jacobian
from .daemon import Daemon, Served, connect, serve
from .errors import (Busy, Cancelled, Denied, Disconnected, LambertError, NotFound, Refused, SceneChanged, TimedOut, Unavailable,
                     Unsupported)
from .mesh import Group, Luminaire, SensorSet, Sky
from .scene import Scene

__version__ = "0.3.0"
__all__ = ["Answer", "Busy", "Cancelled", "Daemon", "Denied", "Disconnected", "Figures", "Group", "Jacobian", "LambertError",
           "Luminaire", "NotFound", "Refused", "Scene", "SceneChanged", "SensorSet", "Served", "Sky", "TimedOut", "Unavailable",
           "Unsupported", "aio", "connect", "serve"]
