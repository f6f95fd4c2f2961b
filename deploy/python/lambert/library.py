"""Operators by liblambert, through ctypes; include/lambert/lambert.h says what its functions do."""

from __future__ import annotations

import ctypes
import ctypes.util
import glob
import os
import shutil
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from .errors import LambertError, Refused, Unsupported
from .kinds import NumpyOperator
from .store import Store
from .wire import Array

QUANTITY = {"radiosity": 0, "irradiance": 1, "indirect": 2}
ARGUMENT, UNSUPPORTED = 1, 8
P, Z, INT = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
# Its functions that are used: what they give, and what they take; the error, which is last, goes without saying.
FUNCTIONS: Dict[str, Tuple[Any, List[Any]]] = {
    "lam_operator_open": (INT, [ctypes.c_char_p, P, P]), "lam_operator_close": (None, [P]),
    "lam_operator_elements": (Z, [P]), "lam_operator_channels": (Z, [P]), "lam_operator_emitters": (Z, [P]),
    "lam_operator_emitter_name": (ctypes.c_char_p, [P, Z]), "lam_operator_work_bytes": (Z, [P, Z]),
    "lam_operator_apply_lit": (INT, [P, Z, INT, P, P, P, P, Z, P]),
    "lam_operator_apply_emitters": (INT, [P, Z, INT, P, Z, P, P, P, Z, P]),
    "lam_operator_apply_adjoint": (INT, [P, Z, INT, P, P, P, Z, P]),
    "lam_operator_adjoint_emitters": (INT, [P, Z, INT, P, P, P, Z, P]),
    "lam_operator_weights": (INT, [P, Z, P, Z, P, P, P]),
    "lam_limiter_open": (INT, [ctypes.c_char_p, P, P]), "lam_limiter_close": (None, [P]), "lam_limiter_work_bytes": (Z, [P]),
    "lam_limiter_apply": (INT, [P, P, Z, INT, P, P, P, P, P, P, Z, P]),
    "lam_form_factors_open": (INT, [ctypes.c_char_p, P, P]), "lam_form_factors_close": (None, [P]),
    "lam_refiner_create": (INT, [P, P, P, P]), "lam_refiner_free": (None, [P]),
    "lam_refine": (INT, [P, Z, INT, P, P, P, ctypes.c_double, P, P, P, P])}


class _Error(ctypes.Structure):
    _fields_ = [("status", INT), ("message", ctypes.c_char * 480)]


def find(library: Any = None) -> Optional[str]:
    """The path of liblambert: as given, of LAMBERT_LIBRARY, beside the program `lambert`, or of the system; None: there is none."""
    if library is False:
        return None
    if isinstance(library, str):
        return library
    given = os.environ.get("LAMBERT_LIBRARY")
    if given:
        return given
    program = shutil.which("lambert")
    if program is not None:
        folder = os.path.dirname(os.path.realpath(program))
        for pattern in ("liblambert.so*", "../lib*/liblambert.so*", "../lib/*/liblambert.so*"):
            found = sorted(glob.glob(os.path.join(folder, pattern)))
            if found:
                return found[0]
    return ctypes.util.find_library("lambert")


class Library:
    """The loaded library."""

    def __init__(self, path: str) -> None:
        try:
            self.functions = ctypes.CDLL(path)
            for name, (result, arguments) in FUNCTIONS.items():
                function = getattr(self.functions, name)
                function.restype, function.argtypes = result, arguments
        except (OSError, AttributeError) as error:
            raise Unsupported(f"{path}: is no liblambert that can be used: {error}") from None

    def call(self, name: str, *arguments: Any) -> None:
        """Calls a function that may fail."""
        error = _Error()
        status = getattr(self.functions, name)(*arguments, ctypes.byref(error))
        if status != 0:
            made = Refused if status == ARGUMENT else Unsupported if status == UNSUPPORTED else LambertError
            raise made(error.message.decode(errors="replace") or f"{name} failed with {status}")

    def open(self, name: str, path: str) -> ctypes.c_void_p:
        handle = ctypes.c_void_p()
        self.call(name, os.fsencode(path), ctypes.byref(handle))
        return handle


def _pointer(array: Optional[Array]) -> Any:
    return None if array is None else array.ctypes.data_as(P)


def _floats(array: Optional[Array]) -> Optional[Array]:
    return None if array is None else np.ascontiguousarray(array, np.float32)


class LibraryOperator:
    """M~ of a store by liblambert; vectors are [m, C, n] in mesh order. Any number of threads may share it."""

    def __init__(self, store: Store, library: Library) -> None:
        self._handles: List[Tuple[str, Any]] = []
        self.store, self.library = store, library
        self.op = self._open("lam_operator", store.path)
        self.limiter = self._open("lam_limiter", store.path)
        self.n, self.channels, self.rho = store.n, store.channels, store.rho.astype(float)
        self.emitters = int(library.functions.lam_operator_emitters(self.op))
        self.names = [library.functions.lam_operator_emitter_name(self.op, k).decode() for k in range(self.emitters)]
        self._lit_by: Optional[NumpyOperator] = None
        self._refiner: Any = None

    def _open(self, what: str, path: str) -> Any:
        handle = self.library.open(what + "_open", path)
        self._handles.append((what + "_close", handle))
        return handle

    def __del__(self) -> None:
        for close, handle in reversed(getattr(self, "_handles", [])):
            getattr(self.library.functions, close)(handle)

    def _run(self, name: str, quantity: str, m: int, width: int, *between: Any) -> Array:
        """A function with a work area, of m vectors; `between` stands after the quantity, up to the output."""
        out = np.empty((m, self.channels, width), np.float32)
        size = int(self.library.functions.lam_operator_work_bytes(self.op, m))
        work = np.empty(size, np.uint8)
        self.library.call(name, self.op, m, QUANTITY[quantity], *between, _pointer(out), _pointer(work), size)
        return out

    def apply(self, quantity: str, E: Array, H0: Optional[Array]) -> Array:
        E, lit = np.ascontiguousarray(E, np.float32), _floats(H0)
        return self._run("lam_operator_apply_lit", quantity, len(E), self.n, _pointer(E), _pointer(lit))

    def adjoint(self, quantity: str, g: Array) -> Array:
        g = np.ascontiguousarray(g, np.float32)
        return self._run("lam_operator_apply_adjoint", quantity, len(g), self.n, _pointer(g))

    def apply_emitters(self, quantity: str, W: Array) -> Array:
        W = np.ascontiguousarray(W, np.float32)
        return self._run("lam_operator_apply_emitters", quantity, len(W), self.n, _pointer(W), 0, None)

    def adjoint_emitters(self, quantity: str, g: Array) -> Array:
        g = np.ascontiguousarray(g, np.float32)
        return self._run("lam_operator_adjoint_emitters", quantity, len(g), self.emitters, _pointer(g))

    def weights(self, E: Array, L: Optional[Array]) -> Array:
        E, sky = np.ascontiguousarray(E, np.float32), _floats(L)
        W = np.zeros((self.channels, self.emitters), np.float32)
        self.library.call("lam_operator_weights", self.op, 1, _pointer(E), 0 if sky is None else sky.shape[-1], _pointer(sky), _pointer(W))
        return W

    def limit(self, quantity: str, E: Optional[Array], H0: Optional[Array], W: Optional[Array], out: Array) -> List[int]:
        light, lit, weights = _floats(E), _floats(H0), _floats(W)
        size = int(self.library.functions.lam_limiter_work_bytes(self.limiter))
        work, limited = np.empty(size, np.uint8), np.zeros(len(out), np.uintp)
        self.library.call("lam_limiter_apply", self.limiter, self.op, len(out), QUANTITY[quantity], _pointer(light), _pointer(lit),
                          _pointer(weights), _pointer(out), _pointer(limited), _pointer(work), size)
        return [int(count) for count in limited]

    def refine(self, quantity: str, E: Array, H0: Optional[Array], tolerance: float) -> Tuple[Array, List[float], List[int]]:
        """The refined quantity in doubles, its certificates and iterations."""
        if self._refiner is None:
            F = self.library.open("lam_form_factors_open", self.store.path)
            if not F:
                raise Refused("the store keeps no form factors, which tolerance needs; precompute it with --keep-form-factors",
                              kind="not-in-store")
            self._handles.append(("lam_form_factors_close", F))
            refiner = ctypes.c_void_p()
            self.library.call("lam_refiner_create", self.op, F, ctypes.byref(refiner))
            self._handles.append(("lam_refiner_free", refiner))
            self._refiner = refiner
        E = np.ascontiguousarray(E, np.float64)
        lit = None if H0 is None else np.ascontiguousarray(H0, np.float64)
        out, certificates, iterations = np.empty(E.shape), np.zeros(len(E)), np.zeros(len(E), np.uintp)
        self.library.call("lam_refine", self._refiner, len(E), QUANTITY[quantity], _pointer(E), _pointer(lit), None, tolerance,
                          _pointer(out), _pointer(certificates), _pointer(iterations))
        return out, certificates.tolist(), [int(count) for count in iterations]
