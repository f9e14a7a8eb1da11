"""Checks of numbers that describe a motion."""

import math

from rocking.errors import InvalidMotion


def finite(value: object, what: str) -> float:
    """Return `value` as a float, or raise InvalidMotion unless it is one finite number."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError) as error:
        raise InvalidMotion(f"the {what} must be one number, not {value!r}") from error
    if not math.isfinite(number):
        raise InvalidMotion(f"the {what} must be a finite number, not {value!r}")
    return number


def positive(value: object, what: str, unit: str) -> float:
    """Return `value` as a float, or raise InvalidMotion unless it is one positive finite number."""
    number = finite(value, what)
    if number <= 0.0:
        raise InvalidMotion(f"the {what} must be a positive number of {unit}, not {value!r}")
    return number
