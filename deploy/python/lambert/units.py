"""Units of light, as api.md has them: lights of groups such as "3600lm", and units of answers."""

from __future__ import annotations

import math
from typing import List, Optional, Tuple

import numpy as np

from .errors import Refused
from .wire import Array

EFFICACY = 179.0  # lm/W of white light of equal energy
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
FOOTCANDLE = 10.763910416709722  # lx
_GIVEN = {"lm": ("lm", True, 1.0), "W": ("W", True, 1.0), "cd/m2": ("lm", False, math.pi), "lm/m2": ("lm", False, 1.0),
          "W/m2": ("W", False, 1.0)}
_NAMES = {"radiosity": {"lx": "lm/m2", "klx": "klm/m2", "fc": "lm/ft2"}}
_SCALE = {"lx": 1.0, "klx": 1e-3, "fc": 1 / FOOTCANDLE}


def exitance(text: str, area: float, lights: str) -> Tuple[List[float], bool]:
    """The exitances that a light with its unit is, of a group of this area; and whether its kind was converted.

    >>> exitance("3600lm", 2.0, "lm"), exitance("1,2,3W/m2", 2.0, "W")
    (([1800.0], False), ([1.0, 2.0, 3.0], False))
    """
    plain = text.replace("²", "2").strip()
    for unit in sorted(_GIVEN, key=len, reverse=True):
        if plain.endswith(unit):
            kind, flux, factor = _GIVEN[unit]
            try:
                values = [float(value) for value in plain[:-len(unit)].split(",")]
            except ValueError:
                break
            if flux and area <= 0:
                raise Refused(f"{text!r}: the group has no area that could emit")
            factor *= (1 / area if flux else 1) * (1 if kind == lights else EFFICACY if lights == "lm" else 1 / EFFICACY)
            return [value * factor for value in values], kind != lights
    raise Refused(f"{text!r} must be a number, or a text of numbers and a unit: lm, W, cd/m2, lm/m2 or W/m2", kind="unknown-word")


class Conversion:
    """The conversion of values of a kind of light ("W" or "lm") into the unit asked for."""

    def __init__(self, kind: str, unit: Optional[str], quantity: str, channels: int) -> None:
        if unit not in (None, "lx", "klx", "fc", "W/m2"):
            raise Refused(f"unit {unit!r} must be lx, klx, fc or W/m2", kind="unknown-word")
        photometric = kind == "lm" if unit is None else unit != "W/m2"
        self.factor = 1.0 if photometric == (kind == "lm") else EFFICACY if photometric else 1 / EFFICACY
        word = unit if unit is not None else "lx" if photometric else "W/m2"
        self.factor *= _SCALE.get(word, 1.0) if photometric else 1.0
        self.luminance = unit not in (None, "W/m2") and channels == 3
        if unit not in (None, "W/m2") and channels not in (1, 3):
            raise Refused(f"unit: the scene has {channels} channels, whose luminance is not known; ask for W/m2")
        self.unit = word if quantity == "irradiance" else _NAMES["radiosity"].get(word, word)

    def __call__(self, values: Array) -> Array:
        """Of [m, C, x], or [m, 1, x] where channels become one."""
        if self.luminance:
            values = np.einsum("c,mcx->mx", LUMINANCE, values)[:, None]
        return np.asarray(values * self.factor) if self.factor != 1 else values
