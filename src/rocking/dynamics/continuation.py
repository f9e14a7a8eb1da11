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
from rocking.dynamics import branches as ends
from rocking.dynamics.branches import Bifurcation, Branch
from rocking.dynamics.maps import are_halved, distances, is_mirrored
from rocking.dynamics.orbit_equations import AT_VALUE, DIFFERENCE, OrbitEquations, Solved, Tests, at_zero, tangent_of
from rocking.dynamics.orbits import PeriodicOrbit
from rocking.errors import InvalidOption, RockingError
from rocking.motion.motion import Motion

#: Smallest cosine between tangents, and largest distance from the tangent, relative to the step (twice that of such a
#: bend).
_COSINE: Final = 0.97
_ASIDE: Final = 0.25

#: Step below which the branch ends, and steps beyond the end at which the kind of orbits is examined.
_LEAST_STEP: Final = 1e-13
_BEYOND: Final = (0.0, *np.geomspace(1e-12, 1e-4, 9).tolist())

#: Fractions of the parameter range that are searched for the orbits from which a branch bifurcates.
_WIDER: Final = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


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
    InvalidOption
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

    The motion must be specified over its least period. Over two periods, orbits of twice the period and those from
    which they bifurcate are of one kind, and a long step may jump between them.

    References
    ----------
    H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", in Applications of Bifurcation
    Theory, Academic Press (1977).

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> def family(amplitude):
    ...     return ball, pulses.sine(amplitude, 5.0, cycles=1)
    >>> stable = next(each for each in dynamics.periodic_orbits(*family(12.0)) if each.is_stable)
    >>> branch = dynamics.continue_orbit(stable, family, 12.0, (9.0, 16.0))
    >>> for each in branch.bifurcations:
    ...     print(f"{each.kind} {each.value:.8f}")
    fold 10.47197551
    flip 15.26823701
    """
    if not isinstance(orbit, PeriodicOrbit):
        raise InvalidOption("{} must be one of those that periodic_orbits returns", "orbit", value=orbit)
    low, high = checks.increasing_pair(bounds, "bounds", InvalidOption)
    start = checks.between(value, "value", InvalidOption, low, high)
    longest = checks.positive(step, "step", InvalidOption)
    count = checks.integer(max_points, "max_points", InvalidOption, minimum=1)
    equations = OrbitEquations.from_orbit(orbit, family, start, (low, high))
    z = np.append(orbit.state, start) / equations.sizes
    backward, forward = (_Walk(equations, z, direction, longest) for direction in (-1.0, 1.0))
    backward.run(count)
    if backward.end == ends.CLOSED:  # a closed branch is complete
        forward.end = ends.CLOSED
    else:
        forward.run(count)
    points = [*reversed(backward.points), *forward.points[1:]]
    values, states, multipliers, peaks = (np.array(column) for column in zip(*points, strict=True))
    return Branch(
        family, name, unit, orbit.model, orbit.chattering, (low, high), orbit.period, values, states, multipliers,
        orbit.impacts, peaks, (*reversed(backward.bifurcations), *forward.bifurcations), (backward.end, forward.end),
    )  # fmt: skip


class _Walk:
    """Continuation of a branch in one direction of the parameter: points, current position and next step."""

    def __init__(self, equations: OrbitEquations, z: Floats, direction: float, longest: float) -> None:
        self.equations, self.z = equations, z
        self.direction, self.step, self.longest = direction, min(0.005, longest), longest
        self.response = equations.response(z)
        self.points = [equations.point(z, self.response)]
        self.bifurcations: list[Bifurcation] = []
        self.end = ends.SHORT
        #: Distance ahead at which there is no known point of this kind, and number of successful steps since.
        self.ahead, self.successes = math.inf, 0
        #: Whether the last step failed only because of its distance from the tangent.
        self.turned = False
        #: Speed of the slowest impact, and scaled parameter, at all points so far.
        self.slowest: list[tuple[float, float]] = []

    def run(self, most: int) -> None:
        """Follow the branch over a number of points, or to its end."""
        if self.points[0][0] == self.equations.bounds[0 if self.direction < 0.0 else 1]:
            self.end = ends.LIMIT
            return
        found = self.equations.solved(self.z, AT_VALUE)
        if found is None:
            self.end = ends.LOST
            return
        self.go_to(found, self.direction * AT_VALUE)
        self.written = self.z
        self.move_start()
        for _ in range(4 * most):  # some steps fail
            # Keeps most differences by the parameter within the branch.
            self.equations.difference = min(max(1e-3 * self.step, 1e-13), DIFFERENCE)
            if len(self.points) >= most:
                break
            if end := self.advance():
                self.end = end
                break

    def go_to(self, found: Solved, like: Floats) -> None:
        """Move to a point, with its tangent in the direction of another."""
        self.z, self.tangent = found.z, tangent_of(found.jacobian, like)
        self.tests = found.tests(self.tangent)

    def advance(self) -> str:
        """Take a step along the branch or shorten it, and return the reason if the branch ends."""
        equations = self.equations
        if self.ahead < _LEAST_STEP:
            reason = self.reason_of_end()
            values = [(self.z + step * self.tangent)[2] for step in (0.0, self.ahead)]
            self.bifurcations += [] if reason == ends.LOST else [equations.bifurcation(reason, self.z, values)]
            return reason
        found = self.next()
        if found is None:
            self.shorten()
            return ""
        solved, at_limit = found
        new, tests = solved.z, solved.tests(tangent_of(solved.jacobian, self.tangent))
        if self.turns(tests) or equations.is_parent(new):
            self.bifurcations.append(self.joined(new))
            return self.bifurcations[-1].kind
        self.pass_bifurcations(new, tests)
        self.response = equations.response(new)
        # A point this close replaces the previous one.
        if len(self.points) > 1 and np.max(np.abs(new - self.written)) < 1e-5:
            self.points.pop()
        else:
            self.written = new
        self.points.append(equations.point(new, self.response))
        self.go_to(solved, self.tangent)
        self.successes += 1
        self.ahead = math.inf if self.successes > 5 else self.ahead - self.step
        if at_limit:
            return ends.LIMIT
        if grazing := self.vanishing():
            self.bifurcations.append(grazing)
            return ends.GRAZING
        if len(self.points) > 12 and self.has_returned():
            return ends.CLOSED
        self.move_start()
        if self.ahead < math.inf:
            self.step = 0.5 * self.ahead
        elif solved.steps <= 4:
            self.step = min(self.step * 1.4, self.longest)
        return ""

    def shorten(self) -> None:
        """Halve a step that failed; no point of this kind is at its end, unless the branch bends."""
        # With a longer step the branch bends, or the point belongs to another branch.
        if not (self.turned and self.step > 1e-3):
            self.ahead, self.successes = self.step, 0
        self.step *= 0.5
        _, jacobian = self.equations.at(self.z)
        if np.all(np.isfinite(jacobian)):
            self.tangent = tangent_of(jacobian, self.tangent)

    def next(self) -> tuple[Solved, bool] | None:
        """Return the next point, if a step leads to one of the same kind, and whether the point is at a limit."""
        equations, z, tangent, self.turned = self.equations, self.z, self.tangent, False
        guess = z + self.step * tangent
        found = equations.solved(guess, tangent)
        new = guess if found is None else found.z  # beyond a limit the body or the motion may not exist
        low, high = (each / equations.sizes[2] for each in equations.bounds)
        at_limit = not low <= new[2] <= high
        if at_limit:
            wanted = low if new[2] < low else high
            guess = z + (wanted - z[2]) / (new[2] - z[2]) * (new - z)
            guess[2] = wanted
            found = equations.solved(guess, AT_VALUE)
        if found is None:
            return None
        onwards = tangent_of(found.jacobian, tangent)
        # A point far from the prediction belongs to another branch.
        self.turned = bool(np.linalg.norm(found.z - guess) > _ASIDE * self.step or onwards @ tangent < _COSINE)
        if self.turned:
            return None
        before, after = self.tests, found.tests(onwards)
        if before.at_one * after.at_one < 0.0 and before.at_minus_one * after.at_minus_one < 0.0:
            return None  # A multiplier passes 1 and -1, or changes sign through infinity at a grazing impact.
        if self.turns(after) and max(abs(before.at_one), abs(after.at_one)) > 0.05:
            return None  # Too far from a turn, or the difference by the parameter extends past an end.
        return (found, at_limit) if equations.kind_at(found.z) == equations.kind else None

    def turns(self, after: Tests) -> bool:
        """Whether the parameter turns before a point although no multiplier passes 1.

        There the branch meets orbits of half the period, or symmetric ones. The same orbits follow, shifted or
        mirrored.
        """
        return self.tests.onwards * after.onwards < 0.0 < self.tests.at_one * after.at_one

    def pass_bifurcations(self, new: Floats, tests: Tests) -> None:
        """Add the bifurcations between this point and the next at which the branch continues."""
        turns, length = self.tests.onwards * tests.onwards < 0.0, float(self.tangent @ (new - self.z))
        at_minus_one = ends.SYMMETRY if self.equations.by_half else ends.FLIP
        for k, kind in enumerate((ends.FOLD if turns else ends.BRANCHES, at_minus_one)):
            if self.tests[k] * tests[k] < 0.0:
                there = self.equations.located(kind, self.z, self.tangent, length, k)
                self.bifurcations += [] if there is None else [there]

    def joined(self, new: Floats) -> Bifurcation:
        """Locate, between two points, where the branch meets orbits of half the period, or symmetric orbits."""
        equations, middle = self.equations, 0.5 * (self.z + new)
        even = equations.period % 2 == 0
        parent = replace(equations, period=equations.period // 2 if even else equations.period, by_half=not even)
        kind = ends.FLIP if even else ends.SYMMETRY
        for share in _WIDER if even or is_mirrored(equations.strobe(equations.physical(middle)[1])) else ():
            if found := parent.located(kind, middle - share * AT_VALUE, AT_VALUE, 2.0 * share, 1):
                return found
        return equations.bifurcation(ends.BRANCHES, middle, [self.z[2], new[2]])

    def vanishing(self) -> Bifurcation | None:
        """Extrapolate to the grazing at zero speed of the slowest impact, where the equations are singular."""
        speed, equations = float(np.min(self.response.impacts["speed_before"], initial=math.inf)), self.equations
        self.slowest.append((speed, self.z[2]))
        if equations.kind.rests or speed >= 2e-3 * equations.sizes[1]:
            return None
        chosen: list[tuple[float, float]] = []
        for each in reversed(self.slowest):
            if len(chosen) == 6 or (chosen and each[0] < chosen[-1][0]):
                break
            if not chosen or each[0] >= chosen[-1][0] + speed:
                chosen.append(each)
        if len(chosen) < 4:
            return None
        speeds, values = zip(*chosen, strict=True)
        estimates = [at_zero(speeds[:most], values[:most]) for most in range(len(chosen) - 2, len(chosen) + 1)]
        if abs(estimates[-1] - estimates[-2]) > 1e-6:
            return None
        found = equations.bifurcation(ends.GRAZING, self.z, estimates)
        return found._replace(value=float(estimates[-1] * equations.sizes[2]))

    def has_returned(self) -> bool:
        """Whether the branch has returned to its first point in its initial direction."""
        first, second, before, last = (
            np.append(self.points[k][1], self.points[k][0]) / self.equations.sizes for k in (0, 1, -2, -1)
        )
        near = np.linalg.norm(last - first) < np.linalg.norm(last - before)
        return bool(near and (last - before) @ (second - first) > 0.0)

    def move_start(self) -> None:
        """Move the start of the period to another breakpoint of the motion if an impact is close to it."""
        equations = self.equations
        _, motion = equations.family(equations.physical(self.z)[1])
        starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
        phases = np.mod(self.response.impacts["time"] + starts[equations.shift], period)
        if not len(phases):
            return
        nearest = distances(starts, phases, period)
        if equations.by_half:  # the map of half a period ends at a breakpoint, too
            nearest[~are_halved(motion)] = -1.0
        best = int(np.argmax(nearest))
        if nearest[equations.shift] > 0.03 * period or nearest[best] <= nearest[equations.shift]:
            return
        moved = replace(equations, shift=best)
        # At a fold not the parameter but the response slightly ahead determines the direction.
        z, ahead = (
            np.append(equations.state(each, best), equations.physical(each)[1]) / equations.sizes
            for each in (self.z, self.z + 1e-6 * self.tangent)
        )
        onwards = (ahead - z) / np.linalg.norm(ahead - z)
        if found := moved.solved(z, onwards):
            self.equations = moved
            self.go_to(found, onwards)

    def reason_of_end(self) -> str:
        """Return the reason why the branch ends just beyond its last point."""
        kind, beyond = self.equations.kind, self.z + 8.0 * _LEAST_STEP * self.tangent
        on_other_courses = False
        for step in _BEYOND:
            try:
                found = self.equations.kind_at(beyond + step * self.tangent)
            except RockingError:
                continue
            if found.unknown:
                return ends.LOST
            if found.overturns:
                return ends.OVERTURNING
            if found.for_ever != kind.for_ever:
                return ends.UPLIFT
            if found.rests != kind.rests:
                return ends.REST if found.rests else ends.CHATTERING
            if found != kind:
                return ends.GRAZING
            on_other_courses = kind.rests and not kind.for_ever
        # A body that lifts and rests as before, but in another way, has touched or missed a stop in between.
        return ends.GRAZING if on_other_courses else ends.LOST
