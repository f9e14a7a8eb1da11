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
from rocking.dynamics.maps import HalfMap, PeriodOutcome, StroboscopicMap, compute_scale, has_mirror_symmetry
from rocking.dynamics.orbits import (
    MAX_ORBIT_DISTANCE,
    PeriodicOrbit,
    compute_multipliers,
    compute_peak,
    create_orbit,
    simulate_periods,
)
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError, RockingError
from rocking.motion.motion import Motion
from rocking.response import Response

#: Number of points that interpolate a crossing of branches.
_CROSSING_POINT_COUNT: Final = 4

#: Residual of a point, relative to the scale and the size of the derivative, and its absolute maximum.
_RESIDUAL_TOLERANCE: Final = 1e-12
_MAX_RESIDUAL: Final = 1e-6

#: Largest step of differences by the parameter, relative to its range.
MAX_DIFFERENCE: Final = 1e-6

#: Normal of the plane of constant parameter.
PARAMETER_AXIS: Final = np.array([0.0, 0.0, 1.0])


class OrbitKind(NamedTuple):
    """Properties of orbits that are constant along a branch."""

    #: Whether every period contains a rest.
    has_rest: bool
    #: Whether the body is always at rest.
    rests_forever: bool
    #: Number of impacts in one period; 0 with a rest.
    impact_count: int
    #: Whether the body overturns.
    overturns: bool
    #: Whether the response is unknown because it requires too many steps.
    is_unknown: bool


class TestFunctions(NamedTuple):
    """Test functions that change sign at bifurcations."""

    #: det(R' - 1), which vanishes if a multiplier is 1.
    multiplier_one: float
    #: det(R' + 1), which vanishes if a multiplier is -1.
    multiplier_minus_one: float
    #: Component of the tangent along the parameter.
    parameter_rate: float


class BranchPoint(NamedTuple):
    """Point of a branch, derivatives of its equations and of the map, and number of Newton steps."""

    z: Floats
    jacobian: Floats
    derivative: Floats
    steps: int

    def compute_tests(self, tangent: Floats) -> TestFunctions:
        """Compute the test functions for a tangent."""
        minus, plus = (float(np.linalg.det(self.derivative + sign * np.eye(2))) for sign in (-1.0, 1.0))
        return TestFunctions(minus, plus, float(tangent[2]))


@dataclass(eq=False)
class OrbitEquations:
    """Equations of the orbits of a family that are of the same kind as a given orbit."""

    family: Callable[[float], tuple[Body, Motion]]
    model: Model
    chattering: ChatteringScheme
    period: int
    sizes: Floats
    kind: OrbitKind
    #: Range of the parameter, beyond which the family need not be defined.
    bounds: tuple[float, float]
    #: Breakpoint at which a period starts; an impact on it makes the equations non-smooth.
    shift: int = 0
    difference: float = MAX_DIFFERENCE
    #: Whether the equations use the map to the mirror image half a period later.
    uses_half_map: bool = False

    def __post_init__(self) -> None:
        self.create_map = lru_cache(maxsize=64)(self._create_map)
        self.create_half_map = lru_cache(maxsize=64)(self._create_half_map)

    @classmethod
    def from_orbit(
        cls, orbit: PeriodicOrbit, family: Callable[[float], object], value: float, bounds: tuple[float, float]
    ) -> OrbitEquations:
        """Create the equations of an orbit at a value of the parameter."""
        pair = family(value) if callable(family) else None
        if not isinstance(pair, tuple) or len(pair) != 2:
            message = "{} must be a function of the parameter that returns a body and one period of a motion"
            raise OptionError(message, "family")
        strobe = StroboscopicMap(*pair, orbit.model, orbit.chattering)
        scale = compute_scale(strobe)
        if not np.all(np.abs(strobe(orbit.state, orbit.period) - orbit.state) / scale < 1e-8):
            message = f"the orbit is not periodic for {{}} at {{}} = {value:g}; use the body and motion of the orbit"
            raise OptionError(message, "family", "value", value=value)
        sizes, kind = np.array([*scale, bounds[1] - bounds[0]]), determine_kind(strobe, orbit.state, orbit.period)
        equations = cls(family, orbit.model, orbit.chattering, orbit.period, sizes, kind, bounds)  # type: ignore[arg-type]
        equations.uses_half_map = orbit.is_symmetric and not orbit.has_rest and equations.is_mirrored_throughout(value)
        return equations

    def _create_map(self, value: float) -> StroboscopicMap:
        body, motion = self.family(value)
        if k := self.shift:
            times, rows = motion.breakpoints, np.roll(motion.coefficients, -k, axis=0)
            breakpoints = np.concatenate([times[k:] - times[k], times[1 : k + 1] + (times[-1] - times[k])])
            motion = Motion(breakpoints, rows, motion.name, motion.description, error=motion.error)
        return StroboscopicMap(body, motion, self.model, self.chattering)

    def _create_half_map(self, value: float) -> HalfMap:
        strobe = self.create_map(value)
        if not has_mirror_symmetry(strobe):
            message = f"the body and motion have no mirror symmetry at {{}} = {value:g}"
            raise OptionError(message, "value", value=value)
        return HalfMap(strobe)

    def is_mirrored_throughout(self, value: float) -> bool:
        """Whether the family has mirror images at a value, and over the whole range of the parameter."""
        for sample in (value, *np.linspace(*self.bounds, 5).tolist()):
            with suppress(RockingError):  # no body or motion exists at this value
                if not has_mirror_symmetry(self.create_map(sample)):
                    return False
        return True

    def to_physical(self, z: Floats) -> tuple[Floats, float]:
        """Convert z to state and parameter, which equals a bound if it differs only by rounding error."""
        value = float(z[2] * self.sizes[2])
        reached_bounds = (bound for bound in self.bounds if math.isclose(value, bound, rel_tol=2.0**-50))
        return z[:2] * self.sizes[:2], next(reached_bounds, value)

    def map_state(self, state: Floats, value: float) -> tuple[Floats, Floats]:
        """Return the state after the period (or its mirror image after half of it) and the derivative, or NaN."""
        try:
            if self.uses_half_map:
                return self.create_half_map(value).map_to_mirror_image(state, self.period)
            return self.create_map(value).derivative(state, self.period)
        except RockingError:  # behind a stop, or no body or motion for the parameter
            return np.full(2, np.nan), np.full((2, 2), np.nan)

    def compute_residual(self, z: Floats) -> tuple[Floats, Floats]:
        """Compute the residual and its derivative with respect to z."""
        state, value = self.to_physical(z)
        image, derivative = self.map_state(state, value)
        h, (low, high) = self.difference * self.sizes[2], self.bounds
        lower = low if value - h < low <= value else value - h
        upper = high if value <= high < value + h else value + h
        value_derivative = (self.map_state(state, upper)[0] - self.map_state(state, lower)[0]) / (upper - lower)
        scaled_derivative = derivative / self.sizes[:2, None] * self.sizes[:2]
        value_derivative = value_derivative * self.sizes[2] / self.sizes[:2]
        return (image - state) / self.sizes[:2], np.column_stack([scaled_derivative - np.eye(2), value_derivative])

    def solve(self, guess: Floats, normal: Floats) -> BranchPoint | None:
        """Find a point in the plane through a guess by Newton's method; None without convergence."""
        z = guess.copy()
        for step_count in range(10):
            residual, jacobian = self.compute_residual(z)
            if not np.all(np.isfinite(jacobian)):
                return None
            tolerance = _RESIDUAL_TOLERANCE * max(1.0, float(np.max(np.abs(jacobian[:, :2]))))
            is_accurate = np.max(np.abs(residual)) < min(tolerance, _MAX_RESIDUAL)
            try:
                step = np.linalg.solve(np.vstack([jacobian, normal]), -np.append(residual, normal @ (z - guess)))
            except np.linalg.LinAlgError:
                return None
            z = z + step
            if is_accurate:  # The derivative at the previous point may be from beyond a grazing impact.
                return BranchPoint(z, jacobian, self.map_state(*self.to_physical(z))[1], step_count)
        return None

    def determine_kind(self, z: Floats) -> OrbitKind:
        """Determine the kind of the orbit at a point."""
        state, value = self.to_physical(z)
        return determine_kind(self.create_map(value), state, self.period)

    def simulate_period(self, z: Floats) -> Response:
        """Simulate one period from the current start."""
        state, value = self.to_physical(z)
        return simulate_periods(self.create_map(value), state, self.period)

    def compute_state(self, z: Floats, shift: int = 0) -> Floats:
        """Return the state of the same response at another breakpoint of the original motion."""
        state, value = self.to_physical(z)
        if shift == self.shift:
            return state
        _, motion = self.family(value)
        time = float(np.mod(motion.breakpoints[shift] - motion.breakpoints[self.shift], motion.duration))
        return self.simulate_period(z).states(time)[:2]

    def evaluate_point(self, z: Floats, response: Response) -> tuple[float, Floats, NDArray[np.complex128], float]:
        """Return parameter, state, multipliers and largest absolute coordinate at a point."""
        state, value = self.to_physical(z)
        strobe = self.create_map(value)
        multipliers = compute_multipliers(strobe, strobe.derivative(state, self.period)[1])
        return value, self.compute_state(z), multipliers, compute_peak(response)

    def is_parent(self, z: Floats) -> bool:
        """Whether a point belongs to symmetric orbits, or to those of half the period, where this branch starts."""
        state, value = self.to_physical(z)
        if self.kind.has_rest or self.uses_half_map:
            return False
        if self.period % 2 == 0:
            image = self.create_map(value)(state, self.period // 2)
        elif has_mirror_symmetry(self.create_map(value)):
            image, _ = self.create_half_map(value).map_to_mirror_image(state, self.period)
        else:
            return False
        return bool(np.max(np.abs(image - state) / self.sizes[:2]) < MAX_ORBIT_DISTANCE)

    def create_bifurcation(self, kind: str, z: Floats, values: Sequence[float]) -> Bifurcation:
        """Create the bifurcation near a point, between scaled values of the parameter."""
        bracket = sorted(float(scaled * self.sizes[2]) for scaled in values)
        value = self.to_physical(z)[1]
        strobe = StroboscopicMap(*self.family(value), self.model, self.chattering)
        orbit = create_orbit(strobe, self.compute_state(z), self.period)
        return Bifurcation(kind, value, (bracket[0], bracket[-1]), orbit)

    def locate_bifurcation(
        self, kind: str, z: Floats, tangent: Floats, length: float, test_index: int
    ) -> Bifurcation | None:
        """Find a root of a test function along a line from a point; None if there is none."""
        from scipy.optimize import brentq

        evaluated: dict[float, tuple[BranchPoint, float]] = {}

        def evaluate_test(distance: float) -> float:
            point = self.solve(z + distance * tangent, tangent)
            if point is None:
                raise _PointNotFound
            evaluated[distance] = point, point.compute_tests(compute_tangent(point.jacobian, tangent))[test_index]
            return evaluated[distance][1]

        try:
            root = brentq(evaluate_test, 0.0, length, xtol=1e-16, rtol=1e-15)
        except ValueError:
            return None
        except _PointNotFound:
            if len({test > 0.0 for _, test in evaluated.values()}) < 2:
                return None
            # The equations are singular where branches cross.
            points = sorted(evaluated.values(), key=lambda pair: abs(pair[1]))[:_CROSSING_POINT_COUNT]
            value = interpolate_at_zero([test for _, test in points], [pair.z[2] for pair, _ in points])
            crossing = self.create_bifurcation(kind, points[0][0].z, [z[2], (z + length * tangent)[2]])
            return crossing._replace(value=float(value * self.sizes[2]))
        nearest = sorted(evaluated, key=lambda distance: abs(distance - root))[:2]
        first, second = (evaluated[distance][0].z for distance in nearest)
        return self.create_bifurcation(kind, first, [first[2], second[2]])


class _PointNotFound(Exception):
    """No point of the branch was found."""


def compute_tangent(jacobian: Floats, reference: Floats) -> Floats:
    """Compute the unit tangent of a branch, oriented like a reference."""
    tangent = np.cross(jacobian[0], jacobian[1])
    size = float(np.linalg.norm(tangent))
    if size == 0.0:
        return reference
    tangent /= size
    return tangent if tangent @ reference >= 0.0 else -tangent


def determine_kind(strobe: StroboscopicMap, state: Floats, period: int) -> OrbitKind:
    """Determine the kind of the response of a body over a number of periods."""
    _, outcome, impacts = strobe.advance(state, period)
    _, derivative = strobe.derivative(state, period)
    rests, rests_forever = not np.any(derivative), bool(outcome == PeriodOutcome.RESTS_FOR_EVER and not impacts)
    overturns, is_unknown = (bool(outcome == ending) for ending in (PeriodOutcome.OVERTURNED, PeriodOutcome.UNFINISHED))
    return OrbitKind(rests, rests_forever, 0 if rests else int(impacts), overturns, is_unknown)


def interpolate_at_zero(x: Sequence[float], y: Sequence[float]) -> float:
    """Interpolate the polynomial through points at zero."""
    weights = [math.prod(b / (b - a) for b in x if b != a) for a in x]
    return float(np.dot(weights, y))
