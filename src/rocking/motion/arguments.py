"""What a motion is made from: arrays, samples, times and steps, checked."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.constants import HIGHEST_DEGREE
from rocking.errors import InvalidMotion
from rocking.motion import piecewise
from rocking.motion.description import Description


class Component(Protocol):
    """A motion, as far as it matters here."""

    @property
    def vertical(self) -> object | None:
        """Its vertical component."""


M = TypeVar("M", bound=Component)

#: Far beyond any ground motion, and far enough from overflow for the squares and integrals that measures take.
STRONGEST: Final = 1e50
_LONGEST: Final = 1e15

#: What those mean who give samples and a step to the constructor.
_OF_SAMPLES: Final = ": of samples make a motion with Motion.from_samples(acceleration, dt)"

#: Far below any ground motion; pieces may be shorter, but must not change faster than over this time.
SHORTEST: Final = 1e-9


def pieces(breakpoints: ArrayLike, coefficients: ArrayLike) -> tuple[Floats, Floats]:
    """Breakpoints and coefficients of a motion as own, read-only arrays."""
    ends = _finite(breakpoints, "breakpoints", 1)
    rows = _finite(coefficients, "coefficients", 2, _OF_SAMPLES)
    if len(ends) < 2 or rows.shape[0] != len(ends) - 1 or rows.shape[1] == 0:
        raise InvalidMotion(
            f"a motion of n pieces needs n + 1 breakpoints and coefficients of shape (n, degree + 1), "
            f"not {ends.shape} and {rows.shape}"
        )
    if ends[0] != 0.0 or not np.all(np.diff(ends) > 0.0):
        raise InvalidMotion("the breakpoints of a motion must start at 0 and increase strictly")
    if rows.shape[1] > HIGHEST_DEGREE + 1:
        raise InvalidMotion(
            f"the pieces of a motion must be of degree {HIGHEST_DEGREE} or less, not {rows.shape[1] - 1}: "
            "split them into shorter ones of a lower degree"
        )
    if not SHORTEST <= ends[-1] <= _LONGEST:
        raise InvalidMotion(
            f"a motion must last from {SHORTEST:g} to {_LONGEST:g} s, not {ends[-1]:g} s: check its units"
        )
    if not _stays_below(STRONGEST, rows, np.diff(ends)):
        raise InvalidMotion(f"the acceleration of a motion must stay below {STRONGEST:g} m/s^2: check units and scale")
    if not _stays_below(STRONGEST, rows, np.maximum(np.diff(ends), SHORTEST)):
        raise InvalidMotion(
            f"a piece of a motion is too steep: shorter than {SHORTEST:g} s, it would pass {STRONGEST:g} m/s^2 "
            "within that time: check units and times"
        )
    for array in (ends, rows):
        array.setflags(write=False)
    return ends, rows


def _stays_below(limit: float, rows: Floats, widths: Floats) -> bool:
    with np.errstate(over="ignore"):
        return bool(np.all(piecewise.value(np.abs(rows), widths) <= limit))


def vertical(component: M, kind: type[M]) -> M:
    """Return the vertical component of a motion: a motion that has none itself."""
    if not isinstance(component, kind):
        raise InvalidMotion(
            f"vertical must be a Motion, as from rocking.read or Motion.from_samples, not {type(component).__name__}"
        )
    if component.vertical is not None:
        raise InvalidMotion("vertical must be a motion without a vertical component of its own")
    return component


def samples(acceleration: ArrayLike) -> Floats:
    """Accelerations, at least two and all finite."""
    values = _floats(acceleration, "accelerations", 1)
    if len(values) < 2:
        raise InvalidMotion(f"a motion needs at least two samples, not {len(values)}")
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise InvalidMotion(f"sample {bad[0]} of the motion is {values[bad[0]]}: every sample must be a finite number")
    return values


def step(dt: float) -> float:
    """Return a sampling step, s."""
    if np.ndim(dt) != 0:
        raise InvalidMotion("{} must be one number; for uneven times use Motion.from_points(times, acceleration)", "dt")
    positive = checks.positive(dt, "dt", InvalidMotion, "s")
    return checks.within(positive, "dt", InvalidMotion, SHORTEST, 1.0 / SHORTEST, "s: check its units")


def instants(times: ArrayLike, count: int) -> Floats:
    """Return the times of so many samples, s."""
    values = _floats(times, "times", 1)
    if len(values) != count:
        raise InvalidMotion(f"there are {len(values)} times but {count} accelerations: give one for each")
    if not np.all(np.isfinite(values)) or not np.all(np.diff(values) > 0.0):
        raise InvalidMotion("the times of a motion must be finite and increase strictly")
    return values


def description(given: Description) -> Description:
    """Return the description, or refuse what is none."""
    if not isinstance(given, Description):
        raise InvalidMotion(
            f"the description of a motion must be a Description(family, parameters, text), not a {type(given).__name__}"
        )
    return given


def history(given: Iterable[str]) -> tuple[str, ...]:
    """Sentences on what was done to a motion."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise InvalidMotion(f"the history of a motion must be a sequence of sentences, not {given!r}")
    return tuple(checks.text(sentence, "sentence of a motion's history", InvalidMotion) for sentence in given)


def _floats(values: ArrayLike, what: str, dimensions: int, mend: str = "") -> Floats:
    array = np.array(checks.numbers(values, f"{what} of a motion", InvalidMotion), order="C")
    if array.ndim != dimensions:
        raise InvalidMotion(f"the {what} of a motion must have {dimensions} dimension(s), not {array.ndim}{mend}")
    return array


def _finite(values: ArrayLike, what: str, dimensions: int, mend: str = "") -> Floats:
    array = _floats(values, what, dimensions, mend)
    if not np.all(np.isfinite(array)):
        raise InvalidMotion(f"the {what} of a motion must be finite numbers")
    return array
