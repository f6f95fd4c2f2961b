"""The linear map of a scene in other libraries: SciPy's linear algebra, and functions that PyTorch and JAX differentiate."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from .errors import Refused, Unsupported
from .wire import Array, shape_text

if TYPE_CHECKING:
    from .scene import Scene


def _library(module: str, name: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise Unsupported(f"{name} is not installed: {error}") from None


def _apply(scene: Scene, quantity: str, E: Array) -> Array:
    return scene.radiosity(E, quantity=quantity, limit=False).values


def _pull_back(scene: Scene, quantity: str, g: Array) -> Array:
    found: Array = scene.adjoint(g, quantity=quantity)
    return found


def _whole(scene: Scene, array: Array) -> Array:
    """[m, C, n] of [n], [C, n] or [m, C, n]; other shapes are Refused."""
    if _is_batch(scene, array.shape) and array.size % (scene.channels * scene.n) == 0 and array.shape[-1] == scene.n:
        return array.reshape(-1, scene.channels, scene.n)
    return np.broadcast_to(scene._source.about.dense(array), (scene.channels, scene.n))[None]


def linear_operator(scene: Scene, quantity: str = "radiosity") -> Any:
    """M~ as SciPy has linear operators: C n rows and columns, channel by channel; of doubles, with single precision in them.

    >>> A = lambert.Scene(address + "/box").as_operator()
    >>> x = np.random.default_rng(1).normal(size=A.shape[1])
    >>> A.shape, bool(abs((A @ x) @ x - x @ (A.H @ x)) < 1e-3)
    ((1200, 1200), True)
    """
    linalg = _library("scipy.sparse.linalg", "SciPy")
    C, n = scene.channels, scene.n

    def columns(ask: Any, X: Array) -> Array:
        X = np.asarray(X)
        if np.iscomplexobj(X):
            return np.asarray(columns(ask, X.real) + 1j * columns(ask, X.imag))
        many = X.reshape(C * n, -1).T.reshape(-1, C, n)
        if len(many) == 0:
            return np.zeros(X.shape)
        found: Array = np.asarray(ask(scene, quantity, many), np.float64).reshape(len(many), C * n).T.reshape(X.shape)
        return found

    def forward(X: Array) -> Array:
        return columns(_apply, X)

    def backward(X: Array) -> Array:
        return columns(_pull_back, X)

    return linalg.LinearOperator((C * n, C * n), matvec=forward, rmatvec=backward, matmat=forward, rmatmat=backward,
                                 dtype=np.float64)


def torch_function(scene: Scene, quantity: str = "radiosity") -> Any:
    """A function of emissions [n], [C, n] or [m, C, n] as tensors, with gradients by E; second derivatives are 0, as M~ is linear.

    The light is that of the linear map, computed in single precision, on the device and with the type of E.
    """
    torch = _library("torch", "PyTorch")

    def shaped(values: Array, E: Any) -> Any:
        return torch.as_tensor(np.ascontiguousarray(values), dtype=E.dtype, device=E.device)

    class Light(torch.autograd.Function):  # type: ignore[misc, name-defined]
        @staticmethod
        def forward(context: Any, E: Any) -> Any:
            context.shape = tuple(E.shape)
            return shaped(_light(scene, quantity, E.detach().cpu().numpy()), E)

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[misc]
        def backward(context: Any, g: Any) -> Any:
            return shaped(_gradient(scene, quantity, g.detach().cpu().numpy(), context.shape), g)

    return Light.apply


def jax_function(scene: Scene, quantity: str = "radiosity") -> Any:
    """A function of emissions [n], [C, n] or [m, C, n] as arrays of JAX, with gradients by E; it may stand in jit."""
    jax = _library("jax", "JAX")

    def called(ask: Any, array: Any, shape: Any, *more: Any) -> Any:
        def host(values: Any) -> Array:
            return np.asarray(ask(scene, quantity, np.asarray(values), *more), dtype=array.dtype)

        return jax.pure_callback(host, jax.ShapeDtypeStruct(shape, array.dtype), array)

    @jax.custom_vjp  # type: ignore[misc]
    def light(E: Any) -> Any:
        return called(_light, E, _shape(scene, E.shape))

    def forward(E: Any) -> Any:
        return light(E), E.shape

    def backward(shape: Any, g: Any) -> Any:
        return (called(_gradient, g, shape, tuple(shape)),)

    light.defvjp(forward, backward)
    return light


def _is_batch(scene: Scene, shape: Any) -> bool:
    """True of [m, C, n], and of [m, n] of one channel."""
    return len(shape) == 3 or len(shape) == 2 and scene.channels == 1


def _shape(scene: Scene, shape: Any) -> Any:
    """The shape of the light of an emission of this shape."""
    return (shape[0], *scene.shape) if _is_batch(scene, shape) else scene.shape


def _light(scene: Scene, quantity: str, E: Array) -> Array:
    """The light of E; a batch is one also where it has one vector."""
    many = _apply(scene, quantity, _whole(scene, E))
    return many if _is_batch(scene, E.shape) else np.asarray(many[0])


def _gradient(scene: Scene, quantity: str, g: Array, shape: Optional[Any] = None) -> Array:
    """The gradient by E of the shape given: summed over channels where all had one E."""
    C, n = scene.channels, scene.n
    wanted = tuple(shape) if shape is not None else g.shape
    if g.size % (C * n):
        raise Refused(f"a gradient has the shape {shape_text(g.shape)}, must have that of the light")
    found = _pull_back(scene, quantity, g.reshape(-1, C, n)).reshape(-1, C, n)
    if _is_batch(scene, wanted):
        return found.reshape(wanted)
    return np.asarray(found[0].sum(0) if len(wanted) == 1 else found[0])
