"""Equations that a family of periodic orbits solves, and Newton's method on them.

Numbers z are coordinate, velocity and parameter over their sizes. A period may start later than that of the motion as
it was given, by a shift of some pieces: where an impact falls on the start, the equations are not smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Body
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.dynamics.forcing import scale_of
from rocking.dynamics.maps import Fate, HalfMap, StroboscopicMap, are_halved, distances, is_mirrored
from rocking.dynamics.orbits import (
    SAME,
    OrbitTrajectory,
    PeriodicOrbit,
    multipliers_at,
    orbit_at,
    response_of,
    trajectory_of,
)
from rocking.engine.treatment import Treatment
from rocking.errors import InvalidOption, RockingError
from rocking.motion.motion import Motion

#: Makes body and motion of a parameter.
Family = Callable[[float], tuple[Body, Motion]]

#: The plane of one parameter, by its normal.
AT_VALUE: Final = np.array([0.0, 0.0, 1.0])

#: Residual of a point of a branch, over the scale and the size of the derivative; and the largest one.
_RESIDUAL: Final = 1e-12
_LARGEST_RESIDUAL: Final = 1e-6

#: Greatest step of differences by the parameter, over its range.
_DIFFERENCE: Final = 1e-6


class Kind(NamedTuple):
    """What does not change along a branch: whether a body rests (for ever), its impacts, and whether it overturns.

    It is unknown of a body that took too many steps to be followed.
    """

    rests: bool
    for_ever: bool
    impacts: int
    overturns: bool
    unknown: bool


class Tests(NamedTuple):
    """Functions that change their signs at bifurcations: det(R' - 1), det(R' + 1), and the tangent's parameter."""

    at_one: float
    at_minus_one: float
    onwards: float


class Solved(NamedTuple):
    """A point of a branch, the derivative of its equations and that of the map, and the Newton steps to it."""

    z: Floats
    jacobian: Floats
    change: Floats
    steps: int

    def tests(self, tangent: Floats) -> Tests:
        """Return the test functions."""
        less, plus = (float(np.linalg.det(self.change + sign * np.eye(2))) for sign in (-1.0, 1.0))
        return Tests(less, plus, float(tangent[2]))


@dataclass(eq=False)
class OrbitEquations:
    """Equations of the orbits of a family that are of the kind of a given one."""

    family: Family
    model: Model
    treatment: Treatment
    period: int
    #: Whether they are those of the map to the mirror image half a period later.
    by_half: bool
    sizes: Floats
    kind: Kind
    #: Range of the parameter: the family need not be made beyond.
    limits: tuple[float, float]
    shift: int = 0
    difference: float = _DIFFERENCE

    def __post_init__(self) -> None:
        self.strobe = lru_cache(maxsize=64)(self._strobe)
        self.half = lru_cache(maxsize=64)(self._half)

    @classmethod
    def of(cls, orbit: PeriodicOrbit, family: Family, value: float, limits: tuple[float, float]) -> OrbitEquations:
        """Return the equations that an orbit solves at a value of the parameter."""
        pair = family(value) if callable(family) else None
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise InvalidOption(
                "{} must be a function of the parameter that returns a body and one period of a motion", "family"
            )
        strobe = StroboscopicMap(*pair, orbit.model, orbit.treatment)
        scale = scale_of(strobe)
        if not np.all(np.abs(strobe(orbit.state, orbit.period) - orbit.state) / scale < 1e-8):
            raise InvalidOption(
                f"the orbit is none of what {{}} makes at {{}} = {value:g}", "family", "value", value=value
            )
        by_half = orbit.symmetric and not orbit.rests and _stays_mirrored(family, strobe, limits)
        sizes = np.array([*scale, limits[1] - limits[0]])
        kind = kind_of(strobe, orbit.state, orbit.period)
        return cls(family, orbit.model, orbit.treatment, orbit.period, by_half, sizes, kind, limits)

    def _strobe(self, value: float) -> StroboscopicMap:
        """Map of the body and the motion at a value, with the start of the period shifted."""
        body, motion = self.family(value)
        if k := self.shift:
            breaks, rows = motion.breakpoints, np.roll(motion.coefficients, -k, axis=0)
            later = np.concatenate([breaks[k:] - breaks[k], breaks[1 : k + 1] + (breaks[-1] - breaks[k])])
            motion = Motion(later, rows, motion.name, motion.description, error=motion.error)
        return StroboscopicMap(body, motion, self.model, self.treatment)

    def _half(self, value: float) -> HalfMap:
        strobe = self.strobe(value)
        if not is_mirrored(strobe):
            raise InvalidOption(f"the family has no mirror images at {{}} = {value:g}", "value", value=value)
        return HalfMap(strobe)

    def physical(self, z: Floats) -> tuple[Floats, float]:
        """State and parameter of numbers z; exactly a limit where it differs from that by rounding."""
        value = float(z[2] * self.sizes[2])
        at_limit = (each for each in self.limits if math.isclose(value, each, rel_tol=2.0**-50))
        return z[:2] * self.sizes[:2], next(at_limit, value)

    def for_step(self, step: float) -> None:
        """Choose the differences by the parameter for steps of some length along the branch."""
        # Near the end of a branch few of the differences by the parameter reach across it.
        self.difference = min(max(1e-3 * step, 1e-13), _DIFFERENCE)

    def returned(self, state: Floats, value: float) -> tuple[Floats, Floats]:
        """State, or its mirror image, after the period or half of it, and the derivative; NaN where there is none."""
        try:
            if self.by_half:
                return self.half(value).mirrored(state, self.period)
            return self.strobe(value).derivative(state, self.period)
        except RockingError:  # behind a stop, or a parameter that makes no body or motion
            return np.full(2, np.nan), np.full((2, 2), np.nan)

    def at(self, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Residual, its derivative by z, and the derivative of the map."""
        state, value = self.physical(z)
        after, change = self.returned(state, value)
        h, (low, high) = self.difference * self.sizes[2], self.limits
        less = low if value - h < low <= value else value - h
        more = high if value <= high < value + h else value + h
        by_value = (self.returned(state, more)[0] - self.returned(state, less)[0]) / (more - less)
        scaled = change / self.sizes[:2, None] * self.sizes[:2]
        by_value = by_value * self.sizes[2] / self.sizes[:2]
        return (after - state) / self.sizes[:2], np.column_stack([scaled - np.eye(2), by_value]), change

    def solved(self, guess: Floats, normal: Floats) -> Solved | None:
        """Return the point of the branch in the plane through a guess; None where Newton's method finds none."""
        z = guess.copy()
        for count in range(10):
            residual, jacobian, _ = self.at(z)
            if not np.all(np.isfinite(jacobian)):
                return None
            allowed = _RESIDUAL * max(1.0, float(np.max(np.abs(jacobian[:, :2]))))
            sharp = np.max(np.abs(residual)) < min(allowed, _LARGEST_RESIDUAL)
            try:
                step = np.linalg.solve(np.vstack([jacobian, normal]), -np.append(residual, normal @ (z - guess)))
            except np.linalg.LinAlgError:
                return None
            z = z + step
            if sharp:  # The derivative is that of the point itself: the one before may be beyond a grazing impact.
                return Solved(z, jacobian, self.returned(*self.physical(z))[1], count)
        return None

    def tangent(self, z: Floats, like: Floats) -> Floats:
        """Tangent at a point, in the direction of another; that one where there is none."""
        _, jacobian, _ = self.at(z)
        return tangent_of(jacobian, like) if np.all(np.isfinite(jacobian)) else like

    def kind_at(self, z: Floats) -> Kind:
        """Kind of the course from a state."""
        state, value = self.physical(z)
        return kind_of(self.strobe(value), state, self.period)

    def trajectory(self, z: Floats) -> OrbitTrajectory:
        """Extremes of the orbit at a point."""
        state, value = self.physical(z)
        return trajectory_of(self.strobe(value), state, self.period)

    def is_parent(self, z: Floats) -> bool:
        """Whether a point is of orbits from which this branch bifurcates: of half the period, or symmetric."""
        state, value = self.physical(z)
        if self.kind.rests or self.by_half:
            return False
        if self.period % 2 == 0:
            after = self.strobe(value)(state, self.period // 2)
        elif is_mirrored(self.strobe(value)):
            after, _ = self.half(value).mirrored(state, self.period)
        else:
            return False
        return bool(np.max(np.abs(after - state) / self.sizes[:2]) < SAME)

    def multipliers(self, z: Floats) -> NDArray[np.complex128]:
        """Floquet multipliers at a point."""
        state, value = self.physical(z)
        strobe = self.strobe(value)
        return multipliers_at(strobe, strobe.derivative(state, self.period)[1])

    def state(self, z: Floats, shift: int = 0) -> Floats:
        """State of the same course where a period starts at another breakpoint of the motion as it was given."""
        state, value = self.physical(z)
        if shift == self.shift:
            return state
        _, motion = self.family(value)
        time = float(np.mod(motion.breakpoints[shift] - motion.breakpoints[self.shift], motion.duration))
        return response_of(self.strobe(value), state, self.period).states(time)[:2]

    def orbit(self, z: Floats) -> PeriodicOrbit:
        """Orbit at a point."""
        strobe = StroboscopicMap(*self.family(self.physical(z)[1]), self.model, self.treatment)
        return orbit_at(strobe, self.state(z), self.period)

    def moved(self, z: Floats, trajectory: OrbitTrajectory) -> tuple[OrbitEquations, Floats]:
        """Equations with a start of the period that no impact is near, and the same orbit in these."""
        _, motion = self.family(self.physical(z)[1])
        starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
        phases = np.mod(trajectory.phases + starts[self.shift], period)
        if not len(phases):
            return self, z
        nearest = distances(starts, phases, period)
        if self.by_half:  # the map of half a period ends at a breakpoint, too
            nearest[~are_halved(motion)] = -1.0
        best = int(np.argmax(nearest))
        # An impact within 3 % of a period moves its start.
        if nearest[self.shift] > 0.03 * period or nearest[best] <= nearest[self.shift]:
            return self, z
        return replace(self, shift=best), self.later(z, best)

    def later(self, z: Floats, shift: int) -> Floats:
        """Numbers of the same course where a period starts at another breakpoint."""
        return np.append(self.state(z, shift), self.physical(z)[1]) / self.sizes


def _stays_mirrored(family: Family, strobe: StroboscopicMap, limits: tuple[float, float]) -> bool:
    """Whether the mirror image of every course is one half a period later, at a value and over the whole range."""
    if not is_mirrored(strobe):
        return False
    for value in np.linspace(*limits, 5):
        try:
            if not is_mirrored(StroboscopicMap(*family(float(value)), strobe.model, strobe.treatment)):
                return False
        except RockingError:  # no body or motion there: the branch ends before
            continue
    return True


def tangent_of(jacobian: Floats, like: Floats) -> Floats:
    """Return the unit tangent of a branch, in the direction of another."""
    along = np.cross(jacobian[0], jacobian[1])
    size = float(np.linalg.norm(along))
    if size == 0.0:
        return like
    along /= size
    return along if along @ like >= 0.0 else -along


def kind_of(strobe: StroboscopicMap, state: Floats, period: int) -> Kind:
    """Kind of the course of a body over so many periods."""
    _, fate, impacts = strobe.followed(state, period)
    _, change = strobe.derivative(state, period)
    rests, for_ever = not np.any(change), bool(fate == Fate.RESTS_FOR_EVER and not impacts)
    number = 0 if rests else int(impacts)
    return Kind(rests, for_ever, number, bool(fate == Fate.OVERTURNED), bool(fate == Fate.UNFINISHED))
