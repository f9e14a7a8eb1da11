"""Continuation of a periodic orbit as a parameter changes, through folds, until orbits of its kind end.

Bifurcations are located as roots of test functions between two points.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.dynamics import branches
from rocking.dynamics.branches import Bifurcation, Branch
from rocking.dynamics.maps import compute_distances, has_mirror_symmetry, have_opposite_breakpoints
from rocking.dynamics.orbit_equations import (
    MAX_DIFFERENCE,
    PARAMETER_AXIS,
    BranchPoint,
    OrbitEquations,
    TestFunctions,
    compute_tangent,
    interpolate_at_zero,
)
from rocking.dynamics.orbits import PeriodicOrbit
from rocking.errors import OptionError, RockingError
from rocking.motion.motion import Motion

#: Smallest cosine between the tangents of consecutive points.
_MIN_COSINE: Final = 0.97

#: Largest distance from the tangent, relative to the step (twice the distance of a bend with the smallest cosine).
_MAX_OFFSET: Final = 0.25

#: Step below which the branch ends.
_MIN_STEP: Final = 1e-13

#: Distances beyond the end at which the kind of orbit is examined.
_STEPS_BEYOND_END: Final = (0.0, *np.geomspace(1e-12, 1e-4, 9).tolist())

#: Fractions of the parameter range that are searched for the orbits from which a branch bifurcates.
_SEARCH_FRACTIONS: Final = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


def continue_orbit(
    orbit: PeriodicOrbit,
    family: Callable[[float], tuple[Body, Motion]],
    value: float,
    bounds: tuple[float, float],
    *,
    name: str = "parameter",
    unit: str = "1",
    step: float = 0.05,
    max_points: int = 1000,
) -> Branch:
    """Follow a periodic orbit as a parameter changes, through folds, and locate its bifurcations.

    Parameters
    ----------
    orbit : PeriodicOrbit
        First orbit of the branch.
    family : callable
        Function of the parameter that returns (body, motion).
    value : float
        Value of the parameter at the orbit.
    bounds : (float, float)
        Range of the parameter; beyond it the family may raise a `RockingError`.
    name, unit : str
        Name and unit of the parameter, for tables and figures.
    step : float
        Longest step, relative to the range of the parameter and the natural size of states.
    max_points : int
        Maximum number of points in either direction.

    Returns
    -------
    Branch
        Branch in both directions, up to the bounds or the end of orbits of this kind: at a grazing impact, where
        chattering becomes incomplete, or where a body at rest lifts off.

    Raises
    ------
    OptionError
        If the value is beyond the bounds, the orbit does not belong to the family there, or a number is out of range.

    See Also
    --------
    periodic_orbits : Find orbits at one value of the parameter.
    bifurcation_diagram : Compute long-term states against a parameter.

    Notes
    -----
    The method is pseudo-arclength continuation in state and parameter. Folds, flips and symmetry breaking are roots of
    the determinant of the derivative minus or plus one. For a symmetric orbit the derivative is that of the map to the
    mirror image half a period later. Ends are located by halving the step. Two multipliers whose product is less than
    one leave the unit circle only through 1 or -1. Therefore no Neimark-Sacker bifurcation occurs with restitution
    below 1.

    The motion must be specified over its least period. If it is specified over two periods, both an orbit and the orbit
    of twice the period that bifurcates from it are fixed points of the map, and a long step may jump from one to the
    other.

    References
    ----------
    :cite:t:`keller1977`, "Numerical solution of bifurcation and nonlinear eigenvalue problems".

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> def family(amplitude):
    ...     return ball, pulses.sine(amplitude, 5.0, cycles=1)
    >>> stable = next(orbit for orbit in dynamics.periodic_orbits(*family(12.0)) if orbit.is_stable)
    >>> branch = dynamics.continue_orbit(stable, family, 12.0, (9.0, 16.0))
    >>> for bifurcation in branch.bifurcations:
    ...     print(f"{bifurcation.kind} {bifurcation.value:.8f}")
    fold 10.47197551
    flip 15.26823701
    """
    if not isinstance(orbit, PeriodicOrbit):
        raise OptionError("{} must be a PeriodicOrbit, as periodic_orbits returns", "orbit", value=orbit)
    low, high = checks.increasing_pair(bounds, "bounds", OptionError)
    start = checks.between(value, "value", OptionError, low, high)
    max_step = checks.positive(step, "step", OptionError)
    point_count = checks.integer(max_points, "max_points", OptionError, minimum=1)
    equations = OrbitEquations.from_orbit(orbit, family, start, (low, high))
    z = np.append(orbit.state, start) / equations.sizes
    backward, forward = (_BranchWalk(equations, z, direction, max_step) for direction in (-1.0, 1.0))
    backward.follow(point_count)
    if backward.end == branches.END_CLOSED:  # a closed branch is complete
        forward.end = branches.END_CLOSED
    else:
        forward.follow(point_count)
    points = [*reversed(backward.points), *forward.points[1:]]
    values, states, multipliers, peaks = (np.array(column) for column in zip(*points, strict=True))
    return Branch(
        family, name, unit, orbit.model, orbit.chattering, (low, high), orbit.period, values, states, multipliers,
        orbit.impact_count, peaks, (*reversed(backward.bifurcations), *forward.bifurcations),
        (backward.end, forward.end),
    )  # fmt: skip


class _BranchWalk:
    """Continuation of a branch in one direction of the parameter: points, current position and next step."""

    def __init__(self, equations: OrbitEquations, z: Floats, direction: float, max_step: float) -> None:
        self.equations, self.z = equations, z
        self.direction, self.step, self.max_step = direction, min(0.005, max_step), max_step
        self.response = equations.simulate_period(z)
        self.points = [equations.evaluate_point(z, self.response)]
        self.bifurcations: list[Bifurcation] = []
        self.end = branches.END_TOO_MANY_POINTS
        #: Length of the last failed step, less later steps, and number of later successful steps.
        self.distance_to_end, self.successes = math.inf, 0
        #: Whether the last step failed only because of a bend of the branch.
        self.is_bent = False
        #: Speed of the slowest impact, and scaled parameter, at all points so far.
        self.slowest_impacts: list[tuple[float, float]] = []

    def follow(self, max_points: int) -> None:
        """Follow the branch over a number of points, or to its end."""
        if self.points[0][0] == self.equations.bounds[0 if self.direction < 0.0 else 1]:
            self.end = branches.END_AT_LIMIT
            return
        solution = self.equations.solve(self.z, PARAMETER_AXIS)
        if solution is None:
            self.end = branches.END_LOST
            return
        self.move_to(solution, self.direction * PARAMETER_AXIS)
        self.last_recorded = self.z
        self.shift_start()
        for _ in range(4 * max_points):  # some steps fail
            # Small differences of the parameter remain on the branch.
            self.equations.difference = min(max(1e-3 * self.step, 1e-13), MAX_DIFFERENCE)
            if len(self.points) >= max_points:
                break
            if end := self.take_step():
                self.end = end
                break

    def move_to(self, solution: BranchPoint, previous_tangent: Floats) -> None:
        """Move to a point, with its tangent oriented like the previous one."""
        self.z, self.tangent = solution.z, compute_tangent(solution.jacobian, previous_tangent)
        self.tests = solution.compute_tests(self.tangent)

    def take_step(self) -> str:
        """Take a step along the branch or shorten it, and return the reason if the branch ends."""
        equations = self.equations
        if self.distance_to_end < _MIN_STEP:
            reason = self.find_end_reason()
            values = [(self.z + step * self.tangent)[2] for step in (0.0, self.distance_to_end)]
            ending = [] if reason == branches.END_LOST else [equations.create_bifurcation(reason, self.z, values)]
            self.bifurcations += ending
            return reason
        result = self.try_step()
        if result is None:
            self.shorten()
            return ""
        point, at_limit = result
        z, tests = point.z, point.compute_tests(compute_tangent(point.jacobian, self.tangent))
        if self.turns_without_fold(tests) or equations.is_parent(z):
            self.bifurcations.append(self.locate_junction(z))
            return self.bifurcations[-1].kind
        self.add_bifurcations(z, tests)
        self.response = equations.simulate_period(z)
        # A point this close replaces the previous one.
        if len(self.points) > 1 and np.max(np.abs(z - self.last_recorded)) < 1e-5:
            self.points.pop()
        else:
            self.last_recorded = z
        self.points.append(equations.evaluate_point(z, self.response))
        self.move_to(point, self.tangent)
        self.successes += 1
        self.distance_to_end = math.inf if self.successes > 5 else self.distance_to_end - self.step
        if at_limit:
            return branches.END_AT_LIMIT
        if grazing := self.extrapolate_grazing():
            self.bifurcations.append(grazing)
            return branches.GRAZING
        if len(self.points) > 12 and self.has_returned():
            return branches.END_CLOSED
        self.shift_start()
        if self.distance_to_end < math.inf:
            self.step = 0.5 * self.distance_to_end
        elif point.steps <= 4:
            self.step = min(self.step * 1.4, self.max_step)
        return ""

    def shorten(self) -> None:
        """Halve a step that failed, and record its length unless the branch bends."""
        # After a longer step a distant point may belong to another branch.
        if not (self.is_bent and self.step > 1e-3):
            self.distance_to_end, self.successes = self.step, 0
        self.step *= 0.5
        _, jacobian = self.equations.compute_residual(self.z)
        if np.all(np.isfinite(jacobian)):
            self.tangent = compute_tangent(jacobian, self.tangent)

    def try_step(self) -> tuple[BranchPoint, bool] | None:
        """Return the next point and whether it is at a bound; None if the step does not reach an orbit of this kind."""
        equations, z, tangent, self.is_bent = self.equations, self.z, self.tangent, False
        guess = z + self.step * tangent
        point = equations.solve(guess, tangent)
        new_z = guess if point is None else point.z  # beyond a limit the body or the motion may not exist
        low, high = (bound / equations.sizes[2] for bound in equations.bounds)
        at_limit = not low <= new_z[2] <= high
        if at_limit:
            limit = low if new_z[2] < low else high
            guess = z + (limit - z[2]) / (new_z[2] - z[2]) * (new_z - z)
            guess[2] = limit
            point = equations.solve(guess, PARAMETER_AXIS)
        if point is None:
            return None
        new_tangent = compute_tangent(point.jacobian, tangent)
        # A point far from the prediction belongs to another branch.
        offset = np.linalg.norm(point.z - guess)
        self.is_bent = bool(offset > _MAX_OFFSET * self.step or new_tangent @ tangent < _MIN_COSINE)
        if self.is_bent:
            return None
        tests, new_tests = self.tests, point.compute_tests(new_tangent)
        if all(old * new < 0.0 for old, new in zip(tests[:2], new_tests[:2], strict=True)):
            return None  # A multiplier passes 1 and -1, or changes sign through infinity at a grazing impact.
        if self.turns_without_fold(new_tests) and max(abs(tests.multiplier_one), abs(new_tests.multiplier_one)) > 0.05:
            return None  # The turn is too far away, or a difference of the parameter extends past an end.
        return (point, at_limit) if equations.determine_kind(point.z) == equations.kind else None

    def turns_without_fold(self, tests: TestFunctions) -> bool:
        """Whether the parameter turns before a point although no multiplier passes 1.

        At such a turn the branch meets orbits of half the period, or symmetric ones, and then repeats its own orbits,
        shifted or mirrored.
        """
        return self.tests.parameter_rate * tests.parameter_rate < 0.0 < self.tests.multiplier_one * tests.multiplier_one

    def add_bifurcations(self, z: Floats, tests: TestFunctions) -> None:
        """Add the bifurcations between this point and the next that do not end the branch."""
        turns, length = self.tests.parameter_rate * tests.parameter_rate < 0.0, float(self.tangent @ (z - self.z))
        at_minus_one = branches.SYMMETRY_BREAKING if self.equations.uses_half_map else branches.FLIP
        for k, kind in enumerate((branches.FOLD if turns else branches.BRANCH_POINT, at_minus_one)):
            if self.tests[k] * tests[k] < 0.0:
                bifurcation = self.equations.locate_bifurcation(kind, self.z, self.tangent, length, k)
                self.bifurcations += [] if bifurcation is None else [bifurcation]

    def locate_junction(self, z: Floats) -> Bifurcation:
        """Locate the point at which the branch meets orbits of half the period, or symmetric orbits."""
        equations, middle = self.equations, 0.5 * (self.z + z)
        period, is_odd = equations.period, equations.period % 2 == 1
        kind = branches.SYMMETRY_BREAKING if is_odd else branches.FLIP
        parent = replace(equations, period=period if is_odd else period // 2, uses_half_map=is_odd)
        has_parent = not is_odd or has_mirror_symmetry(equations.create_map(equations.to_physical(middle)[1]))
        for fraction in _SEARCH_FRACTIONS if has_parent else ():
            start = middle - fraction * PARAMETER_AXIS
            if bifurcation := parent.locate_bifurcation(kind, start, PARAMETER_AXIS, 2.0 * fraction, 1):
                return bifurcation
        return equations.create_bifurcation(branches.BRANCH_POINT, middle, [self.z[2], z[2]])

    def extrapolate_grazing(self) -> Bifurcation | None:
        """Extrapolate the speed of the slowest impact to zero (grazing), where the equations are singular."""
        speed, equations = float(np.min(self.response.impacts["speed_before"], initial=math.inf)), self.equations
        self.slowest_impacts.append((speed, self.z[2]))
        if equations.kind.has_rest or speed >= 2e-3 * equations.sizes[1]:
            return None
        fitted: list[tuple[float, float]] = []
        for impact in reversed(self.slowest_impacts):
            if len(fitted) == 6 or (fitted and impact[0] < fitted[-1][0]):
                break
            if not fitted or impact[0] >= fitted[-1][0] + speed:
                fitted.append(impact)
        if len(fitted) < 4:
            return None
        speeds, values = zip(*fitted, strict=True)
        estimates = [interpolate_at_zero(speeds[:n], values[:n]) for n in range(len(fitted) - 2, len(fitted) + 1)]
        if abs(estimates[-1] - estimates[-2]) > 1e-6:
            return None
        bifurcation = equations.create_bifurcation(branches.GRAZING, self.z, estimates)
        return bifurcation._replace(value=float(estimates[-1] * equations.sizes[2]))

    def has_returned(self) -> bool:
        """Whether the branch has returned to its first point in its initial direction."""
        points = (self.points[k] for k in (0, 1, -2, -1))
        first, second, before, last = (np.append(state, value) / self.equations.sizes for value, state, *_ in points)
        near = np.linalg.norm(last - first) < np.linalg.norm(last - before)
        return bool(near and (last - before) @ (second - first) > 0.0)

    def shift_start(self) -> None:
        """Move the start of the period to another breakpoint of the motion if an impact is close to it."""
        equations = self.equations
        _, motion = equations.family(equations.to_physical(self.z)[1])
        starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
        phases = np.mod(self.response.impacts["time"] + starts[equations.shift], period)
        if not len(phases):
            return
        nearest = compute_distances(starts, phases, period)
        if equations.uses_half_map:  # the map of half a period ends at a breakpoint, too
            nearest[~have_opposite_breakpoints(motion)] = -1.0
        new_shift = int(np.argmax(nearest))
        if nearest[equations.shift] > 0.03 * period or nearest[new_shift] <= nearest[equations.shift]:
            return
        shifted = replace(equations, shift=new_shift)
        # At a fold not the parameter but the response slightly ahead determines the direction.
        z, ahead = (
            np.append(equations.compute_state(point, new_shift), equations.to_physical(point)[1]) / equations.sizes
            for point in (self.z, self.z + 1e-6 * self.tangent)
        )
        tangent = (ahead - z) / np.linalg.norm(ahead - z)
        if solution := shifted.solve(z, tangent):
            self.equations = shifted
            self.move_to(solution, tangent)

    def find_end_reason(self) -> str:
        """Return the reason why the branch ends just beyond its last point."""
        kind, beyond = self.equations.kind, self.z + 8.0 * _MIN_STEP * self.tangent
        rests_differently = False
        for step in _STEPS_BEYOND_END:
            try:
                kind_beyond = self.equations.determine_kind(beyond + step * self.tangent)
            except RockingError:
                continue
            if kind_beyond.is_unknown:
                return branches.END_LOST
            if kind_beyond.overturns:
                return branches.OVERTURNING
            if kind_beyond.rests_forever != kind.rests_forever:
                return branches.UPLIFT
            if kind_beyond.has_rest != kind.has_rest:
                return branches.START_OF_REST if kind_beyond.has_rest else branches.LOSS_OF_CHATTERING
            if kind_beyond != kind:
                return branches.GRAZING
            rests_differently = kind.has_rest and not kind.rests_forever
        # A body that uplifts and rests as before has touched or missed a stop in between.
        return branches.GRAZING if rests_differently else branches.END_LOST
