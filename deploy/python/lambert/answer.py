"""Answers: vectors of light with what the daemon says of them, figures by name, and matrices of derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Dict, Mapping, Optional, Union

import numpy as np

if TYPE_CHECKING:
    _Base = np.ndarray[Any, np.dtype[Any]]
else:
    _Base = np.ndarray


class Answer(_Base):
    """Light as an array of NumPy: [n] for one channel, [C, n] for more, one level deeper for a batch.

    `error` is the stated error, where the answer has one (see `stated` of Scene.radiosity), `unit` the unit of the values,
    `converted_by` the factors by which lights or values were converted. `limited` is the number of elements that the linear
    map put below zero, `times` has milliseconds of the daemon. Of a refined answer `certificate` bounds the error of each
    value, and `iterations` counts products with F. Results of arithmetic are plain arrays.

    >>> answer = Answer.of(np.float32([1, 2]), unit="lx")
    >>> answer.unit, type(answer + 1).__name__, answer.values
    ('lx', 'ndarray', array([1., 2.], dtype=float32))
    """

    error: Optional[Mapping[str, Any]]
    unit: Optional[str]
    converted_by: Optional[str]
    limited: Any
    times: Mapping[str, float]
    certificate: Any
    iterations: Any

    @classmethod
    def of(cls, values: Any, *, error: Optional[Mapping[str, Any]] = None, unit: Optional[str] = None,
           converted_by: Optional[str] = None, limited: Any = None, times: Optional[Mapping[str, float]] = None,
           certificate: Any = None, iterations: Any = None) -> Answer:
        made = np.asarray(values).view(cls)
        made.error, made.unit, made.converted_by, made.limited = error, unit, converted_by, limited
        made.times, made.certificate, made.iterations = times or {}, certificate, iterations
        return made

    def __array_finalize__(self, source: Any) -> None:
        self.error = self.unit = self.converted_by = self.limited = self.certificate = self.iterations = None
        self.times = {}

    def __array_wrap__(self, array: Any, *context: Any) -> Any:
        plain = np.asarray(array)
        return plain[()] if plain.ndim == 0 else plain

    @property
    def values(self) -> np.ndarray[Any, np.dtype[Any]]:
        """The plain array; it shares the memory."""
        return self.view(np.ndarray)


Figure = Union[float, np.ndarray[Any, np.dtype[Any]], None, Any]


class Figures(Dict[str, Dict[str, Any]]):
    """Figures by name of group or set of sensors, then by figure: a float, or an array of channels, of a batch, or of both.

    >>> figures = Figures.of({"floor": {"mean": 2.5, "share": {"300": 0.5}}}, unit="lx")
    >>> figures["floor"]["mean"], figures["floor"]["share"][300], figures.unit
    (2.5, 0.5, 'lx')
    """

    unit: Optional[str] = None
    converted_by: Optional[str] = None
    times: Mapping[str, float] = {}
    limited: Any = None
    _error: Union[None, Mapping[str, Any], Callable[[], Optional[Mapping[str, Any]]]] = None

    @property
    def error(self) -> Optional[Mapping[str, Any]]:
        """The stated error, also of each name in `groups`. In process it is found when it is first looked at, which takes a whole answer."""
        if callable(self._error):
            self._error = self._error()
        return self._error

    @classmethod
    def of(cls, read: Mapping[str, Mapping[str, Any]], *, error: Union[None, Mapping[str, Any], Callable[[], Optional[Mapping[str, Any]]]] = None,
           unit: Optional[str] = None, converted_by: Optional[str] = None, times: Optional[Mapping[str, float]] = None,
           limited: Any = None) -> Figures:
        made = cls({name: {figure: _figure(figure, value) for figure, value in figures.items()}
                    for name, figures in read.items()})
        made._error, made.unit, made.converted_by = error, unit, converted_by
        made.times, made.limited = times or {}, limited
        return made


def _figure(name: str, value: Any) -> Figure:
    if name == "ugr":
        return value
    if isinstance(value, dict):  # shares by their limits
        return {float(limit): _figure("", share) for limit, share in value.items()}
    if isinstance(value, list):
        return np.array(value, float)
    return None if value is None else float(value)


class Jacobian(Dict[str, np.ndarray[Any, np.dtype[Any]]]):
    """Matrices by what they derive by: [rows, columns], or [C, rows, columns] for more than one channel.

    `rows` has the slice of each set of sensors, or of each group, `columns` the names of the columns of each matrix, or the number of tiles.
    """

    rows: Mapping[str, slice] = {}
    columns: Mapping[str, Any] = {}
    times: Mapping[str, float] = {}

    @classmethod
    def of(cls, read: Mapping[str, Any], sensors: Mapping[str, int], columns: Mapping[str, Any],
           times: Optional[Mapping[str, float]] = None) -> Jacobian:
        made = cls({name: np.asarray(matrix, np.float32) for name, matrix in read.items()})
        first, rows = 0, {}
        for name, count in sensors.items():
            rows[name] = slice(first, first + count)
            first += count
        made.rows, made.columns, made.times = rows, dict(columns), times or {}
        return made


def joined(parts: "list[Answer]") -> Answer:
    """The answer to a batch of answers to its parts."""
    if len(parts) == 1:
        return parts[0]

    def all_of(name: str) -> Any:
        values = [getattr(part, name) for part in parts]
        return None if any(value is None for value in values) else [v for value in values for v in np.atleast_1d(value).tolist()]

    times: Dict[str, float] = {}
    for part in parts:
        for name, value in part.times.items():
            times[name] = times.get(name, 0) + value
    first = parts[0]
    worst = max((part.error for part in parts if part.error), key=lambda e: e.get("stated") or 0, default=None)
    return Answer.of(np.concatenate([part.values for part in parts]), unit=first.unit, converted_by=first.converted_by,
                     error=worst, times=times, limited=all_of("limited"), certificate=all_of("certificate"),
                     iterations=all_of("iterations"))
