"""Directions on the ground: azimuths, in degrees clockwise from north, and a motion's component along one of them."""

from __future__ import annotations

from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidMotion
from rocking.motion.description import Description, begins_later

#: Components that are nearer to one line than this, degrees, hardly tell what happened across it.
_NEAR: Final = 15.0


class Component(Protocol):
    """What is known of a horizontal component."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def description(self) -> Description:
        """How it was made, and of a record its azimuth and the instant when it begins."""

    @property
    def duration(self) -> float:
        """Its end, s."""

    @property
    def step(self) -> float | None:
        """Step of its samples, s; None if they are uneven."""


def sine_cosine(degrees: ArrayLike) -> tuple[Floats, Floats]:
    """Return sine and cosine of angles in degrees, exact at multiples of a right angle.

    Examples
    --------
    >>> [part.tolist() for part in sine_cosine([0.0, 90.0, 180.0, -90.0])]
    [[0.0, 1.0, 0.0, -1.0], [1.0, 0.0, -1.0, 0.0]]
    """
    angle = np.asarray(degrees, dtype=np.float64)
    quarters = np.rint(angle / 90.0)
    rest = np.deg2rad(angle - 90.0 * quarters)
    sine, cosine = np.sin(rest), np.cos(rest)
    quarter = np.mod(quarters, 4.0).astype(np.int64)
    found = np.choose(quarter, [sine, cosine, -sine, -cosine]), np.choose(quarter, [cosine, -sine, -cosine, sine])
    return found[0] + 0.0, found[1] + 0.0  # no negative zeros


def check_start(one: Component, other: Component) -> None:
    """Refuse two components that begin at different times, by the clock of their files."""
    if later := begins_later(one.description, other.description, one.step):
        early, late = (one, other) if later > 0.0 else (other, one)
        raise InvalidMotion(
            f"by their files {checks.shown(late.name)} begins {abs(later):.6g} s after {checks.shown(early.name)}: cut "
            f"what comes first with processed(trim=({abs(later):.6g}, {early.duration:.6g})) of the latter"
        )


def recorded_azimuths(one: Component, other: Component, recorded: Any) -> tuple[float, float]:
    """Return the azimuths of two components, as they are given, or else as their records say; or refuse them."""
    if recorded is None:
        known = [(each, each.description.origin) for each in (one, other)]
        missing = [each.name for each, origin in known if origin is None or origin.azimuth is None]
        if missing:
            raise InvalidMotion(
                f"the azimuth of {checks.shown(missing[0])} is not known: give {{}}=(first, second), the directions of "
                "both components in degrees clockwise from north",
                "recorded",
            )
        first, second = (origin.azimuth for _, origin in known if origin is not None and origin.azimuth is not None)
    else:
        given = checks.numbers(recorded, "recorded", InvalidMotion)
        if given.shape != (2,) or not np.all(np.isfinite(given)):
            raise InvalidMotion(
                "{} must be the azimuths of both components, two numbers in degrees", "recorded", value=recorded
            )
        first, second = given.tolist()
    between = abs((second - first + 90.0) % 180.0 - 90.0)
    if between < _NEAR:
        raise InvalidMotion(
            f"the components point to azimuths of {first:g} and {second:g} deg, along one line to {between:g} deg: two "
            "that are across each other are needed"
        )
    return first, second


def shares(recorded: tuple[float, float], azimuth: float) -> tuple[float, float]:
    """Return the factors on two components, at their azimuths, whose sum is the component along another azimuth.

    With a vector a, its components a_1 = a n_1 and a_2 = a n_2 along two directions determine the one along n, even
    where the two are not perpendicular.

    Examples
    --------
    >>> shares((90.0, 0.0), 180.0)
    (0.0, -1.0)
    """
    first, second = recorded
    sine, _ = sine_cosine([second - azimuth, azimuth - first, second - first])
    return float(sine[0] / sine[2]) + 0.0, float(sine[1] / sine[2]) + 0.0
