"""What the numbers that describe a block may be: lengths, mass, gravity, and the parameters of a side."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import InvalidBlock

# Lowest and highest values, both included: far beyond any block, and far enough from the ends of double precision for
# fourth powers of p, for the quotients of a motion's largest acceleration with gravity and slenderness, and for
# products of all of them. Below the least restitution one impact is the end of rocking, to double precision.
_GRAVITY: Final = (1e-6, 1e6)
_LENGTH: Final = (1e-20, 1e20)
_MASS: Final = (1e-30, 1e30)
_LIMITS: Final = {
    "p": (1e-6, 1e6, "positive, from 1e-06 to 1e+06 rad/s"),
    "alpha": (1e-9, math.nextafter(0.5 * math.pi, 0.0), "from 1e-09 to below pi/2 rad"),
    "restitution": (1e-9, 1.0, "in (0, 1], at least 1e-09"),
}


def checked_parameter(value: float, name: str, *, origin: str = "", which: str = "") -> float:
    """Return p, alpha or restitution of a side, or raise InvalidBlock; the message says where it is from, and whose."""
    low, high, rule = _LIMITS[name]
    if not low <= value <= high:
        hint = checks.hint_of_degrees(value) if name == "alpha" else ""
        hint = checks.hint_of_percent(value) if name == "restitution" else hint
        raise InvalidBlock(f"{{}}{origin} must be {rule}, not {value:g}{which}{hint}", name, value=value)
    return value


def checked_sides(values: Floats, name: str) -> Floats:
    """Return p, alpha or restitution of blocks, shape (n, 2), or raise InvalidBlock for the first out of its range."""
    low, high, _ = _LIMITS[name]
    bad = np.argwhere(~((values >= low) & (values <= high)))
    if len(bad):
        checked_parameter(float(values[tuple(bad[0])]), name, which=f" (block {bad[0][0]})")
    return values


def checked_gravity(gravity: object) -> float:
    """Return an acceleration of gravity, m/s^2, or raise InvalidBlock."""
    return checks.positive(gravity, "gravity", InvalidBlock, "m/s^2", _GRAVITY)


def checked_mass(mass: object) -> float:
    """Return a mass, kg, or raise InvalidBlock."""
    return checks.positive(mass, "mass", InvalidBlock, "kg", _MASS)


def checked_length(value: object, name: str) -> float:
    """Return a length, m, or raise InvalidBlock."""
    return checks.positive(value, name, InvalidBlock, "m", _LENGTH)


def checked_pair(value: Any, name: str) -> tuple[float, float]:
    """Return a number, or a pair (side +, side -), as two numbers."""
    if type(value) is float:
        return value, value
    values = checks.numbers(value, name, InvalidBlock)
    if values.shape not in ((), (2,)):
        raise InvalidBlock(
            f"{{}} must be a number or a pair (side +, side -), not {values.size} values", name, value=value
        )
    plus, minus = np.broadcast_to(values, 2).tolist()
    return plus, minus
