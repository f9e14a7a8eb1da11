"""Equations of a family of periodic orbits, and their solution by Newton's method.

The unknowns z are coordinate, velocity and parameter, each divided by its size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Body
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.dynamics.branches import Bifurcation
from rocking.dynamics.maps import HalfMap, PeriodOutcome, StroboscopicMap, is_mirrored, scale_of
from rocking.dynamics.orbits import SAME, PeriodicOrbit, multipliers_at, orbit_at, peak_of, response_of
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import InvalidOption, RockingError
from rocking.motion.motion import Motion
from rocking.response import Response

#: Number of points that interpolate a crossing of branches.
_CROSSING: Final = 4

#: Residual of a point, relative to the scale and the size of the derivative, and its maximum.
_RESIDUAL: Final = 1e-12
_LARGEST_RESIDUAL: Final = 1e-6

#: Largest step of differences by the parameter, relative to its range.
DIFFERENCE: Final = 1e-6

#: Normal of the plane of constant parameter.
AT_VALUE: Final = np.array([0.0, 0.0, 1.0])


class Kind(NamedTuple):
    """Constants of a branch: whether the body rests (for ever), its number of impacts, and whether it overturns.

    Unknown for a body that took too many steps.
    """

    rests: bool
    for_ever: bool
    impacts: int
    overturns: bool
    unknown: bool


class Tests(NamedTuple):
    """Test functions that change sign at bifurcations: det(R' - 1), det(R' + 1), and the parameter of the tangent."""

    at_one: float
    at_minus_one: float
    onwards: float


class Solved(NamedTuple):
    """Point of a branch, derivatives of its equations and of the map, and number of Newton steps."""

    z: Floats
    jacobian: Floats
    change: Floats
    steps: int

    def tests(self, tangent: Floats) -> Tests:
        """Compute the test functions."""
        less, plus = (float(np.linalg.det(self.change + sign * np.eye(2))) for sign in (-1.0, 1.0))
        return Tests(less, plus, float(tangent[2]))


@dataclass(eq=False)
class OrbitEquations:
    """Equations of the orbits of a family that are of the same kind as a given orbit."""

    family: Callable[[float], tuple[Body, Motion]]
    model: Model
    chattering: ChatteringScheme
    period: int
    sizes: Floats
    kind: Kind
    #: Range of the parameter, beyond which the family need not be defined.
    bounds: tuple[float, float]
    #: Breakpoint at which a period starts; an impact on it makes the equations non-smooth.
    shift: int = 0
    difference: float = DIFFERENCE
    #: Whether they are those of the map to the mirror image half a period later.
    by_half: bool = False

    def __post_init__(self) -> None:
        self.strobe = lru_cache(maxsize=64)(self._strobe)
        self.half = lru_cache(maxsize=64)(self._half)

    @classmethod
    def from_orbit(
        cls, orbit: PeriodicOrbit, family: Callable[[float], object], value: float, bounds: tuple[float, float]
    ) -> OrbitEquations:
        """Create the equations of an orbit at a value of the parameter."""
        pair = family(value) if callable(family) else None
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise InvalidOption(
                "{} must be a function of the parameter that returns a body and one period of a motion", "family"
            )
        strobe = StroboscopicMap(*pair, orbit.model, orbit.chattering)
        scale = scale_of(strobe)
        if not np.all(np.abs(strobe(orbit.state, orbit.period) - orbit.state) / scale < 1e-8):
            raise InvalidOption(
                f"the orbit is none of what {{}} makes at {{}} = {value:g}", "family", "value", value=value
            )
        sizes, kind = np.array([*scale, bounds[1] - bounds[0]]), kind_of(strobe, orbit.state, orbit.period)
        made = cls(family, orbit.model, orbit.chattering, orbit.period, sizes, kind, bounds)  # type: ignore[arg-type]
        made.by_half = orbit.symmetric and not orbit.rests and made.stays_mirrored(value)
        return made

    def _strobe(self, value: float) -> StroboscopicMap:
        body, motion = self.family(value)
        if k := self.shift:
            breaks, rows = motion.breakpoints, np.roll(motion.coefficients, -k, axis=0)
            later = np.concatenate([breaks[k:] - breaks[k], breaks[1 : k + 1] + (breaks[-1] - breaks[k])])
            motion = Motion(later, rows, motion.name, motion.description, error=motion.error)
        return StroboscopicMap(body, motion, self.model, self.chattering)

    def _half(self, value: float) -> HalfMap:
        strobe = self.strobe(value)
        if not is_mirrored(strobe):
            raise InvalidOption(f"the family has no mirror images at {{}} = {value:g}", "value", value=value)
        return HalfMap(strobe)

    def stays_mirrored(self, value: float) -> bool:
        """Whether the family has mirror images at a value, and over the whole range of the parameter."""
        for each in (value, *np.linspace(*self.bounds, 5).tolist()):
            with suppress(RockingError):  # no body or motion there: the branch ends before
                if not is_mirrored(self.strobe(each)):
                    return False
        return True

    def physical(self, z: Floats) -> tuple[Floats, float]:
        """Convert z to state and parameter, exactly a limit within rounding error."""
        value = float(z[2] * self.sizes[2])
        at_limit = (each for each in self.bounds if math.isclose(value, each, rel_tol=2.0**-50))
        return z[:2] * self.sizes[:2], next(at_limit, value)

    def returned(self, state: Floats, value: float) -> tuple[Floats, Floats]:
        """Return the state after the period (or its mirror image after half of it) and the derivative, or NaN."""
        try:
            if self.by_half:
                return self.half(value).mirrored(state, self.period)
            return self.strobe(value).derivative(state, self.period)
        except RockingError:  # behind a stop, or no body or motion for the parameter
            return np.full(2, np.nan), np.full((2, 2), np.nan)

    def at(self, z: Floats) -> tuple[Floats, Floats]:
        """Compute the residual and its derivative by z."""
        state, value = self.physical(z)
        after, change = self.returned(state, value)
        h, (low, high) = self.difference * self.sizes[2], self.bounds
        less = low if value - h < low <= value else value - h
        more = high if value <= high < value + h else value + h
        by_value = (self.returned(state, more)[0] - self.returned(state, less)[0]) / (more - less)
        scaled = change / self.sizes[:2, None] * self.sizes[:2]
        by_value = by_value * self.sizes[2] / self.sizes[:2]
        return (after - state) / self.sizes[:2], np.column_stack([scaled - np.eye(2), by_value])

    def solved(self, guess: Floats, normal: Floats) -> Solved | None:
        """Return the point in the plane through a guess; None if Newton's method does not converge."""
        z = guess.copy()
        for count in range(10):
            residual, jacobian = self.at(z)
            if not np.all(np.isfinite(jacobian)):
                return None
            allowed = _RESIDUAL * max(1.0, float(np.max(np.abs(jacobian[:, :2]))))
            sharp = np.max(np.abs(residual)) < min(allowed, _LARGEST_RESIDUAL)
            try:
                step = np.linalg.solve(np.vstack([jacobian, normal]), -np.append(residual, normal @ (z - guess)))
            except np.linalg.LinAlgError:
                return None
            z = z + step
            if sharp:  # The derivative at the previous point may be from beyond a grazing impact.
                return Solved(z, jacobian, self.returned(*self.physical(z))[1], count)
        return None

    def kind_at(self, z: Floats) -> Kind:
        """Return the kind of the response from a state."""
        state, value = self.physical(z)
        return kind_of(self.strobe(value), state, self.period)

    def response(self, z: Floats) -> Response:
        """Simulate one period from the start in use."""
        state, value = self.physical(z)
        return response_of(self.strobe(value), state, self.period)

    def state(self, z: Floats, shift: int = 0) -> Floats:
        """Return the state of the same response at another breakpoint of the original motion."""
        state, value = self.physical(z)
        if shift == self.shift:
            return state
        _, motion = self.family(value)
        time = float(np.mod(motion.breakpoints[shift] - motion.breakpoints[self.shift], motion.duration))
        return self.response(z).states(time)[:2]

    def point(self, z: Floats, response: Response) -> tuple[float, Floats, NDArray[np.complex128], float]:
        """Return parameter, state, multipliers and largest absolute coordinate at a point."""
        state, value = self.physical(z)
        strobe = self.strobe(value)
        multipliers = multipliers_at(strobe, strobe.derivative(state, self.period)[1])
        return value, self.state(z), multipliers, peak_of(response)

    def is_parent(self, z: Floats) -> bool:
        """Whether a point belongs to symmetric orbits, or to those of half the period, where this branch starts."""
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

    def bifurcation(self, kind: str, z: Floats, values: Sequence[float]) -> Bifurcation:
        """Create the bifurcation near a point, between scaled values of the parameter."""
        bracket = sorted(float(each * self.sizes[2]) for each in values)
        value = self.physical(z)[1]
        strobe = StroboscopicMap(*self.family(value), self.model, self.chattering)
        return Bifurcation(kind, value, (bracket[0], bracket[-1]), orbit_at(strobe, self.state(z), self.period))

    def located(self, kind: str, z: Floats, tangent: Floats, length: float, number: int) -> Bifurcation | None:
        """Find a root of a test function along a line from a point; None if there is none."""
        from scipy.optimize import brentq

        found: dict[float, tuple[Solved, float]] = {}

        def tested(at: float) -> float:
            solved = self.solved(z + at * tangent, tangent)
            if solved is None:
                raise _Missed
            found[at] = solved, solved.tests(tangent_of(solved.jacobian, tangent))[number]
            return found[at][1]

        try:
            root = brentq(tested, 0.0, length, xtol=1e-16, rtol=1e-15)
        except ValueError:
            return None
        except _Missed:
            if len({test > 0.0 for _, test in found.values()}) < 2:
                return None
            # The equations are singular where branches cross.
            points = sorted(found.values(), key=lambda each: abs(each[1]))[:_CROSSING]
            value = at_zero([test for _, test in points], [each.z[2] for each, _ in points])
            crossing = self.bifurcation(kind, points[0][0].z, [z[2], (z + length * tangent)[2]])
            return crossing._replace(value=float(value * self.sizes[2]))
        first, second = (found[at][0].z for at in sorted(found, key=lambda at: abs(at - root))[:2])
        return self.bifurcation(kind, first, [first[2], second[2]])


class _Missed(Exception):
    """Absence of an expected point of the branch."""


def tangent_of(jacobian: Floats, like: Floats) -> Floats:
    """Return the unit tangent of a branch, oriented like another tangent."""
    along = np.cross(jacobian[0], jacobian[1])
    size = float(np.linalg.norm(along))
    if size == 0.0:
        return like
    along /= size
    return along if along @ like >= 0.0 else -along


def kind_of(strobe: StroboscopicMap, state: Floats, period: int) -> Kind:
    """Return the kind of the response of a body over a number of periods."""
    _, outcome, impacts = strobe.advance(state, period)
    _, change = strobe.derivative(state, period)
    rests, for_ever = not np.any(change), bool(outcome == PeriodOutcome.RESTS_FOR_EVER and not impacts)
    number = 0 if rests else int(impacts)
    return Kind(
        rests, for_ever, number, bool(outcome == PeriodOutcome.OVERTURNED), bool(outcome == PeriodOutcome.UNFINISHED)
    )


def at_zero(x: Sequence[float], y: Sequence[float]) -> float:
    """Interpolate the polynomial through points at zero."""
    weights = [math.prod(b / (b - a) for b in x if b != a) for a in x]
    return float(np.dot(weights, y))
