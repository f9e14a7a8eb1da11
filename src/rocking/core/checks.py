"""Checks of arguments, each with the type of error to raise.

A number is any real number of Python or NumPy, or an array without dimensions. Text and truth values are rejected
although ``float`` accepts them, because a text such as "0.2" is usually a mistake.
"""

from __future__ import annotations

import contextlib
import difflib
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rocking.core.arrays import Floats
from rocking.errors import RockingError, escape_braces

#: Largest number of characters of a value in a message.
_MAX_LENGTH: Final = 60


class ErrorFactory(Protocol):
    """Constructor of an error from a message, the argument names in it, and the rejected value."""

    def __call__(self, message: str, *arguments: str, value: object = None) -> RockingError:
        """Return the error."""


def real(value: object, name: str, error: ErrorFactory) -> float:
    """Return `value` as a float, or raise `error` unless it is one real number (possibly not finite)."""
    return _check_number(value, name, error, "a number", lambda _: True)


def finite(value: object, name: str, error: ErrorFactory) -> float:
    """Return `value` as a float, or raise `error` unless it is one finite number."""
    return _check_number(value, name, error, "a finite number", math.isfinite)


def positive(
    value: object, name: str, error: ErrorFactory, unit: str = "", limits: tuple[float, float] = (0.0, math.inf)
) -> float:
    """Return `value` as a float, or raise `error` unless it is one positive finite number within its limits."""
    requirement = f"a positive number{_format_unit(unit)}"
    number = _check_number(value, name, error, requirement, lambda number: 0.0 < number < math.inf)
    return between(number, name, error, *limits, unit)


def between(value: object, name: str, error: ErrorFactory, low: float, high: float, unit: str = "") -> float:
    """Return `value` as a float, or raise `error` unless it is a number from `low` to `high` inclusive."""
    requirement = f"a number from {low:g} to {high:g}{_format_unit(unit)}"
    return _check_number(value, name, error, requirement, lambda number: low <= number <= high)


def fraction(value: object, name: str, error: ErrorFactory, below: float = 1.0) -> float:
    """Return `value` as a float, or raise `error` unless it is a number above 0 and below `below`."""
    requirement = f"a number between 0 and {below:g}"
    return _check_number(value, name, error, requirement, lambda number: 0.0 < number < below)


def boolean(value: object, name: str, error: ErrorFactory) -> bool:
    """Return `value` as a bool, or raise `error` unless it is True or False of Python or NumPy."""
    if not isinstance(value, bool | np.bool_):
        raise error(f"{{}} must be True or False, not {short_repr(value)}", name, value=value)
    return bool(value)


def increasing_pair(value: object, name: str, error: ErrorFactory) -> tuple[float, float]:
    """Return two finite numbers, the lower one first, or raise `error`."""
    ends = items(value, name, error)
    if len(ends) != 2:
        raise error("{} must be two numbers (lower, higher)", name, value=value)
    low, high = (finite(end, name, error) for end in ends)
    if not (low < high and math.isfinite(high - low)):
        raise error(f"{{}} must be (lower, higher); got ({low:g}, {high:g})", name, value=value)
    return low, high


def integer(value: object, name: str, error: ErrorFactory, minimum: int, maximum: int | None = None) -> int:
    """Return `value` as an int, or raise `error` unless it has an integer type and is within its bounds."""
    item = _unwrap(value)
    is_integer = isinstance(item, Integral) and not isinstance(item, bool)
    if not is_integer or not minimum <= item or not (maximum is None or item <= maximum):
        bounds = f"of at least {minimum}" if maximum is None else f"from {minimum} to {maximum}"
        raise error(f"{{}} must be a whole number {bounds}, not {short_repr(value)}", name, value=value)
    return int(item)


def text(value: object, name: str, error: ErrorFactory) -> str:
    """Return `value`, or raise `error` unless it is text."""
    if not isinstance(value, str):
        raise error(f"{{}} must be text, not {short_repr(value)}", name, value=value)
    return value


def path(value: object, name: str, error: ErrorFactory) -> Path:
    """Return `value` as a path, or raise `error` unless it is a path or text."""
    if not isinstance(value, (str, PathLike)):
        raise error(f"{{}} must be text or a path, not {short_repr(value)}", name, value=value)
    return Path(value)


def choice(value: object, name: str, error: ErrorFactory, choices: Sequence[str]) -> str:
    """Return `value`, or raise `error` unless it is one of the choices."""
    if not isinstance(value, str) or value not in choices:
        raise error(f"{{}} must be one of {', '.join(choices)}, not {short_repr(value)}", name, value=value)
    return value


def mapping(value: object, name: str, error: ErrorFactory, example: str) -> Mapping[Any, Any]:
    """Return `value`, or raise `error` unless it is a nonempty mapping."""
    if not isinstance(value, Mapping) or not value:
        requirement = f"a mapping with at least one entry, as {example}"
        raise error(f"{{}} must be {requirement}, not {short_repr(value)}", name, value=value)
    return value


def items(value: object, name: str, error: ErrorFactory) -> list[Any]:
    """Return the items of `value`, or raise `error` if it is text, a mapping or not a collection."""
    if isinstance(value, (str, Mapping)) or not isinstance(value, Iterable):
        raise error(f"{{}} must be a list, not {short_repr(value)}", name, value=value)
    return [*value]


def check_grid_size(sizes: Mapping[str, int], error: ErrorFactory, max_points: int = 10_000_000) -> None:
    """Raise `error` if the product of the sizes of a grid's axes, by name, exceeds `max_points`."""
    points = math.prod(sizes.values())
    if points > max_points:
        axes = " x ".join(f"{size} {name}" for name, size in sizes.items())
        raise error(f"a grid of {axes} has {points:,} points; use at most {max_points:,}")


def numbers(values: ArrayLike, name: str, error: ErrorFactory) -> Floats:
    """Return real numbers (possibly not finite) as an array of the same shape, or raise `error`."""
    if np.ma.is_masked(values):
        raise error("{} must not contain masked values", name, value=values)
    with contextlib.suppress(TypeError, ValueError):
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = np.reshape([real(value, name, error) for value in array.ravel()], array.shape)
        if array.dtype.kind in "iuf" or not array.size:
            return np.asarray(array, dtype=np.float64)
    raise error(f"{{}} must be a number or an array of numbers, not {short_repr(values)}", name, value=values)


def booleans_or_numbers(values: ArrayLike, name: str, error: ErrorFactory) -> Floats:
    """Return real numbers, or truth values as 1 and 0, like `numbers`."""
    is_boolean = np.asarray(values).dtype.kind == "b"
    return numbers(np.multiply(values, 1.0) if is_boolean else values, name, error)


def positive_numbers(values: ArrayLike, name: str, error: ErrorFactory) -> Floats:
    """Return one or more positive finite numbers as a flat array, or raise `error`."""
    array = np.atleast_1d(numbers(values, name, error))
    if array.ndim != 1 or not array.size or not np.all(np.isfinite(array) & (array > 0.0)):
        raise error("{} must be one or more positive finite numbers", name, value=values)
    return array


def increasing_numbers(values: ArrayLike, name: str, error: ErrorFactory) -> Floats:
    """Return positive finite numbers in increasing order, or raise `error`."""
    array = positive_numbers(values, name, error)
    if not np.all(np.diff(array) > 0.0):
        raise error("{} must be in increasing order", name, value=values)
    return array


def axis(values: ArrayLike, name: str, error: ErrorFactory) -> Floats:
    """Return finite, increasing numbers of an axis (one or more, of any sign), or raise `error`."""
    array = np.atleast_1d(numbers(values, name, error))
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array)) or np.any(np.diff(array) <= 0.0):
        raise error("{} must be increasing finite numbers", name, value=values)
    return array


def short_repr(value: object) -> str:
    """Return a value for a message, in one line of limited length."""
    text = " ".join((f"{value:g}" if isinstance(value, float) else repr(value)).split())
    return escape_braces(text if len(text) <= _MAX_LENGTH else f"{text[: _MAX_LENGTH - 10]}...{text[-7:]}")


def suggest(name: str, known: Collection[str], default: str | None = None, similarity: float = 0.6) -> str:
    """Return the end of a message about an unknown name: a similar known name, or a default, or all known names."""
    matches = difflib.get_close_matches(name, [*known], n=1, cutoff=similarity)
    if not matches:
        return f"there are {', '.join(known)}" if default is None else default
    return f"did you mean {known[matches[0]] if isinstance(known, Mapping) else matches[0]}?"


def hint_at_degrees(angle: float) -> str:
    """Return a hint for a message if a rejected angle, rad, is plausible in degrees, else an empty text."""
    return f"; if it is in degrees, give math.radians({angle:g})" if 0.5 * math.pi <= abs(angle) < 90.0 else ""


def hint_at_percent(factor: float) -> str:
    """Return a hint for a message if a rejected factor (at most 1) is plausible in per cent, else an empty text."""
    return f"; if it is in per cent, give {factor / 100.0:g}" if 2.0 < factor <= 100.0 else ""


def _check_number(
    value: object, name: str, error: ErrorFactory, requirement: str, is_valid: Callable[[float], bool]
) -> float:
    """Return one real number (infinite if too large for a float), or raise `error` with the requirement."""
    item = _unwrap(value)
    if isinstance(item, Real) and not isinstance(item, bool):
        try:
            number = float(item)
        except OverflowError:
            number = math.inf
        if is_valid(number):
            return number
    raise error(f"{{}} must be {requirement}, not {short_repr(value)}", name, value=value)


def _unwrap(value: object) -> Any:
    """Return the value, or the item of an array without dimensions."""
    return value.item() if getattr(value, "ndim", None) == 0 and hasattr(value, "item") else value


def _format_unit(unit: str) -> str:
    return f", in {unit}" if unit else ""
