"""Operators by liblambert, through ctypes; include/lambert/lambert.h says what its functions do."""

from __future__ import annotations

import ctypes
import ctypes.util
import glob
import os
import shutil
import threading
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

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
# The same of functions that libraries of before 0.3 have not.
SCENE_FUNCTIONS: Dict[str, Tuple[Any, List[Any]]] = {
    "lam_scene_open": (INT, [ctypes.c_char_p, P, P]), "lam_scene_close": (None, [P]), "lam_scene_operator": (P, [P]),
    "lam_scene_limiter": (P, [P]), "lam_scene_sources": (Z, [P, INT]), "lam_scene_stated": (INT, [P, INT, P, P, Z, P, P, P]),
    "lam_scene_jacobian": (INT, [P, INT, Z, P, INT, P, P]), "lam_rows_create": (INT, [P, INT, Z, P, P, P]), "lam_rows_close": (None, [P]),
    "lam_rows_area": (ctypes.c_double, [P, Z]), "lam_rows_means": (INT, [P, Z, P, P, P]), "lam_rows_jacobian": (None, [P, INT, P])}
BY = {"luminaires": 0, "groups": 1, "sky": 2, "emitters": 3}
ROWS_KEPT = 64  # sets of rows of one operator


class _Error(ctypes.Structure):
    _fields_ = [("status", INT), ("message", ctypes.c_char * 480)]


class _Light(ctypes.Structure):
    """lam_light, whose arrays are kept by whoever makes it."""

    _fields_ = [("E", P), ("groups", P), ("exitances", P), ("n_groups", Z), ("L", P), ("D", P), ("W", P)]


class _Stated(ctypes.Structure):
    _fields_ = [("stated", ctypes.c_double), ("rest", ctypes.c_double), ("mesh", ctypes.c_double), ("own", INT)]


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
        self.has_scenes = all(hasattr(self.functions, name) for name in SCENE_FUNCTIONS)
        for name, (result, arguments) in SCENE_FUNCTIONS.items() if self.has_scenes else ():
            function = getattr(self.functions, name)
            function.restype, function.argtypes = result, arguments

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
        self.scene = self._open("lam_scene", store.path) if library.has_scenes else None
        if self.scene is None:
            self.op = self._open("lam_operator", store.path)
            self.limiter = self._open("lam_limiter", store.path)
        else:
            self.op = ctypes.c_void_p(library.functions.lam_scene_operator(self.scene))
            self.limiter = ctypes.c_void_p(library.functions.lam_scene_limiter(self.scene))
        self._rows: Dict[Tuple[str, Tuple[str, ...]], Rows] = {}
        self._lock = threading.Lock()
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

    def rows(self, quantity: str, names: Tuple[str, ...]) -> Optional[Rows]:
        """The rows of means of groups, made when first asked for; None: the library has none."""
        if self.scene is None:
            return None
        with self._lock:
            found = self._rows.get((quantity, names))
        if found is None:
            found = Rows(self, quantity, names)
            with self._lock:
                while len(self._rows) >= ROWS_KEPT:
                    self._rows.pop(next(iter(self._rows)))
                self._rows[quantity, names] = found
        return found

    def jacobian(self, quantity: str, elements: Array, by: str) -> Optional[Array]:
        """[C, elements, sources of a kind]; None: the library has none."""
        if self.scene is None:
            return None
        chosen = np.ascontiguousarray(elements, np.uint32)
        width = int(self.library.functions.lam_scene_sources(self.scene, BY[by]))
        made = np.empty((self.channels, len(chosen), width), np.float32)
        self.library.call("lam_scene_jacobian", self.scene, QUANTITY[quantity], len(chosen), _pointer(chosen), BY[by], _pointer(made))
        return made

    def stated(self, quantity: str, light: Mapping[str, Optional[Array]], values: Array, groups: Sequence[int]) -> Optional[Dict[str, Any]]:
        """The stated error of values [C, n]: of the mean over some groups together, or of all; None: nothing is stated."""
        if self.scene is None:
            return None
        kept, of, made = _floats(values), np.array(groups, np.uint32), _Stated()
        arrays, sources = _sources(light)
        try:
            self.library.call("lam_scene_stated", self.scene, QUANTITY[quantity], ctypes.byref(sources), _pointer(kept), len(of), _pointer(of),
                              ctypes.byref(made))
        except Unsupported:
            return None
        del arrays
        parts = {"rest": made.rest, **({"mesh": made.mesh} if made.mesh >= 0 else {})}
        return {"stated": made.stated if np.isfinite(made.stated) else None, "parts": parts, "light": "own" if made.own else "lights"}

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


def _sources(light: Mapping[str, Optional[Array]]) -> Tuple[List[Array], _Light]:
    """A lam_light of arrays by its members' names, and the arrays that it points into."""
    made, arrays = _Light(), []
    for name, given in light.items():
        if given is None:
            continue
        array = np.ascontiguousarray(given, np.uint32 if name == "groups" else np.float32)
        arrays.append(array)
        setattr(made, name, array.ctypes.data)
        if name == "groups":
            made.n_groups = len(array)
    return arrays, made


class Rows:
    """Rows of the means of groups by the library (lam_rows); they keep the operator that they are of."""

    def __init__(self, of: LibraryOperator, quantity: str, names: Tuple[str, ...]) -> None:
        self.of, self.count, self.handle = of, len(names), None
        texts = (ctypes.c_char_p * len(names))(*(name.encode() for name in names))
        handle = ctypes.c_void_p()
        of.library.call("lam_rows_create", of.scene, QUANTITY[quantity], len(names), texts, ctypes.byref(handle))
        self.handle = handle
        self.areas = np.array([of.library.functions.lam_rows_area(handle, k) for k in range(len(names))])

    def __del__(self) -> None:
        if self.handle is not None:
            self.of.library.functions.lam_rows_close(self.handle)

    def means(self, lights: Sequence[Mapping[str, Optional[Array]]]) -> Array:
        """[m, rows, C] of the linear map, in doubles."""
        kept = [_sources(light) for light in lights]
        sources = (_Light * len(kept))(*(light for _, light in kept))
        made = np.empty((len(kept), self.count, self.of.channels))
        self.of.library.call("lam_rows_means", self.handle, len(kept), sources, made.ctypes.data)
        return made

    def jacobian(self, by: str) -> Array:
        """[C, rows, sources of a kind]."""
        width = int(self.of.library.functions.lam_scene_sources(self.of.scene, BY[by]))
        made = np.empty((self.of.channels, self.count, width), np.float32)
        self.of.library.functions.lam_rows_jacobian(self.handle, BY[by], made.ctypes.data)
        return made
