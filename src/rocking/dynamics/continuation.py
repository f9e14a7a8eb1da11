"""Continuation: a periodic orbit followed as a parameter changes, through folds, to where orbits of its kind end.

Bifurcations on the way are roots of test functions between two points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.dynamics import branches as ends
from rocking.dynamics.branches import Bifurcation, Branch
from rocking.dynamics.maps import is_mirrored
from rocking.dynamics.orbit_equations import AT_VALUE, OrbitEquations, Solved, Tests, tangent_of
from rocking.dynamics.orbits import OrbitTrajectory, PeriodicOrbit
from rocking.errors import InvalidOption, RockingError
from rocking.motion.motion import Motion

#: Least cosine between one tangent and the next, and how far a point may be from where the tangent leads, over the step
#: (a bend of that cosine makes it half as much).
_COSINE: Final = 0.97
_ASIDE: Final = 0.25

#: Step along a branch below which it has come to its end.
_LEAST_STEP: Final = 1e-13

#: Gap and speed, over their scales, below which a branch that ends has come to grazing.
_GRAZES: Final = 1e-4

#: Steps beyond the end of a branch at which the kind of its orbits is looked at.
_BEYOND: Final = (0.0, *np.geomspace(1e-12, 1e-4, 9).tolist())

#: Points from which the crossing of two branches is interpolated.
_CROSSING: Final = 4

#: Shares of the range of the parameter within which the orbits are sought from which a branch bifurcates.
_WIDER: Final = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


def continue_orbit(
    orbit: PeriodicOrbit,
    family: Callable[[float], tuple[Body, Motion]],
    value: float,
    limits: tuple[float, float],
    *,
    name: str = "parameter",
    unit: str = "1",
    step: float = 0.05,
    most: int = 1000,
) -> Branch:
    """Follow a periodic orbit as a parameter changes, through folds, and say where it bifurcates.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Where to begin.
    family : callable
        Makes (body, motion) of the parameter.
    value : float
        The parameter of the orbit.
    limits : (float, float)
        Range of the parameter; beyond it the family may raise a `RockingError`.
    name, unit : str
        What the parameter is, for tables and figures.
    step : float
        Longest step along the branch, over the range of the parameter and the natural size of states.
    most : int
        Most points in either direction.

    Returns
    -------
    Branch
        Followed from the orbit in both directions, until the limits, or until orbits of this kind end: at a grazing
        impact, where chattering is no longer complete, or where a body at rest lifts off.

    Raises
    ------
    InvalidOption
        If the value is not within the limits, the orbit is none of the family's at this value, or a number is out of
        its range.

    Notes
    -----
    Pseudo-arclength continuation in state and parameter. Folds, flips and breaking of symmetry are roots of the
    determinant of the derivative less or plus one; of a symmetric orbit the derivative is that of the map to the mirror
    image half a period later. Ends are located by halving the step. Of two multipliers whose product is less than one,
    none leaves the unit circle but through 1 or -1: there is no Neimark-Sacker bifurcation with restitution below 1.

    The motion must be given over its least period: over two of them, orbits of twice the period and those from which
    they bifurcate are of one kind, and a long step may lead from the ones to the others.

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
    bounds = checks.several(limits, "limits", InvalidOption)
    if len(bounds) != 2:
        raise InvalidOption("{} must be (lower, higher)", "limits")
    low, high = (checks.finite(each, "limits", InvalidOption) for each in bounds)
    if not (low < high and math.isfinite(high - low)):
        raise InvalidOption(f"{{}} must be (lower, higher), not ({low:g}, {high:g})", "limits")
    start = checks.within(value, "value", InvalidOption, low, high)
    longest = checks.positive(step, "step", InvalidOption)
    count = checks.whole(most, "most", InvalidOption, least=1)
    equations = OrbitEquations.of(orbit, family, start, (low, high))
    z = np.append(orbit.state, start) / equations.sizes
    backward, forward = (_Walk(equations, z, direction, longest) for direction in (-1.0, 1.0))
    backward.run(count)
    if backward.end == ends.CLOSED:  # what has come back to where it began is all there is
        forward.end = ends.CLOSED
    else:
        forward.run(count)
    points = [*reversed(backward.points), *forward.points[1:]]
    values, states, multipliers, peaks = (np.array(column) for column in zip(*points, strict=True))
    return Branch(
        family, name, unit, orbit.model, orbit.treatment, (low, high), orbit.period, values, states, multipliers,
        orbit.impacts, peaks, (*reversed(backward.bifurcations), *forward.bifurcations), (backward.end, forward.end),
    )  # fmt: skip


class _Walk:
    """A branch that is followed in one direction of the parameter: its points, where it is now, and the next step."""

    def __init__(self, equations: OrbitEquations, z: Floats, direction: float, longest: float) -> None:
        self.trajectory = equations.trajectory(z)
        self.equations, self.z = equations.moved(z, self.trajectory)
        self.direction, self.step, self.longest = direction, min(0.005, longest), longest
        #: Of each point the parameter, the state at the start of the motion's period, multipliers and greatest size.
        self.points: list[tuple[float, Floats, NDArray[np.complex128], float]] = []
        self.bifurcations: list[Bifurcation] = []
        self.end = ends.SHORT
        #: How far ahead there is no point of this kind, as far as is known, and successful steps since that was found.
        self.ahead, self.successes = math.inf, 0
        #: Whether the last step failed only as it led too far from the tangent.
        self.turned = False
        self.add_point(self.z)

    def add_point(self, z: Floats) -> None:
        """Add a point to the branch."""
        equations, peak = self.equations, self.trajectory.peak
        self.points.append((equations.physical(z)[1], equations.state(z), equations.multipliers(z), peak))

    def run(self, most: int) -> None:
        """Follow the branch over so many points, or until it ends."""
        if self.points[0][0] == self.equations.limits[0 if self.direction < 0.0 else 1]:
            self.end = ends.LIMIT
            return
        self.equations.for_step(self.step)
        found = self.equations.solved(self.z, AT_VALUE)
        if found is None:
            self.end = ends.LOST
            return
        self.go_to(found, self.direction * AT_VALUE)
        self.written = self.z
        #: Speed of the slowest impact and parameter, over its size, at all points so far.
        self.slowest = [(self.trajectory.slowest, self.z[2])]
        for _ in range(4 * most):  # some steps fail
            if len(self.points) >= most:
                break
            end = self.advance()
            self.equations.for_step(self.step)
            if end:
                self.end = end
                break

    def go_to(self, found: Solved, like: Floats) -> None:
        """Go to a point, with its tangent in the direction of another."""
        self.z, self.tangent = found.z, tangent_of(found.jacobian, like)
        self.tests = found.tests(self.tangent)

    def bifurcation(self, kind: str, z: Floats, values: Sequence[float]) -> Bifurcation:
        """Bifurcation at a point near this one, between values of the parameter over its size."""
        bracket = sorted(float(each * self.equations.sizes[2]) for each in values)
        value, orbit = self.equations.physical(z)[1], self.equations.orbit(z)
        return Bifurcation(kind, value, (bracket[0], bracket[-1]), orbit)

    def advance(self) -> str:
        """Take a step along the branch, or find that it is too long; returns why the branch ends, if it does."""
        equations = self.equations
        if self.ahead < _LEAST_STEP:
            reason = reason_of_end(equations, self.trajectory, self.z, self.tangent)
            values = [(self.z + step * self.tangent)[2] for step in (0.0, self.ahead)]
            self.bifurcations += [] if reason == ends.LOST else [self.bifurcation(reason, self.z, values)]
            return reason
        found = self.next()
        if found is None:
            self.shorten()
            return ""
        solved, at_limit = found
        new, tests = solved.z, solved.tests(tangent_of(solved.jacobian, self.tangent))
        if self.turns(tests) or equations.is_parent(new):
            self.bifurcations.append(_joined(self, new))
            return self.bifurcations[-1].kind
        self.bifurcations.extend(_passed(self, new, tests))
        before, self.trajectory = self.trajectory, equations.trajectory(new)
        # A point so near takes the place of the one before.
        if len(self.points) > 1 and np.max(np.abs(new - self.written)) < 1e-5:
            self.points.pop()
        else:
            self.written = new
        self.add_point(new)
        self.go_to(solved, self.tangent)
        self.successes += 1
        self.ahead = math.inf if self.successes > 5 else self.ahead - self.step
        if at_limit:
            return ends.LIMIT
        if self.comes_to_graze(before):
            return ends.GRAZING
        if self.has_returned():
            return ends.CLOSED
        self.move_start()
        if self.ahead < math.inf:
            self.step = 0.5 * self.ahead
        elif solved.steps <= 4:
            self.step = min(self.step * 1.4, self.longest)
        return ""

    def shorten(self) -> None:
        """Try half the step that failed; there is no point of this kind at its end, unless the branch bends."""
        # In a longer step it bends, or the point is one of another branch.
        if not (self.turned and self.step > 1e-3):
            self.ahead, self.successes = self.step, 0
        self.step *= 0.5
        self.tangent = self.equations.tangent(self.z, self.tangent)

    def comes_to_graze(self, before: OrbitTrajectory) -> bool:
        """Whether the slowest impact comes to have no speed, and where."""
        equations, speed = self.equations, self.trajectory.slowest
        self.slowest.append((speed, self.z[2]))
        if equations.kind.rests or speed >= min(2e-3 * equations.sizes[1], before.slowest):
            return False
        grazing = _vanishing(self)
        self.bifurcations += [] if grazing is None else [grazing]
        return grazing is not None

    def has_returned(self) -> bool:
        """Whether the branch has passed its first point again, in the direction in which it left it."""
        if len(self.points) <= 12:
            return False
        first, second, before, last = (
            np.append(self.points[k][1], self.points[k][0]) / self.equations.sizes for k in (0, 1, -2, -1)
        )
        step, left = last - before, second - first
        size = float(np.linalg.norm(step))
        share = float((first - before) @ step) / size**2
        beside = float(np.linalg.norm(first - before - share * step))
        same_way = float(step @ left) > _COSINE * size * float(np.linalg.norm(left))
        return 0.0 <= share <= 1.0 and beside < 0.1 * size and same_way

    def next(self) -> tuple[Solved, bool] | None:
        """Return the next point where a step leads to one of the same kind, and whether at a limit."""
        equations, z, tangent, self.turned = self.equations, self.z, self.tangent, False
        guess = z + self.step * tangent
        found = equations.solved(guess, tangent)
        new = guess if found is None else found.z  # beyond a limit there may be no body or motion
        low, high = (each / equations.sizes[2] for each in equations.limits)
        at_limit = not low <= new[2] <= high
        if at_limit:
            wanted = low if new[2] < low else high
            guess = z + (wanted - z[2]) / (new[2] - z[2]) * (new - z)
            guess[2] = wanted
            found = equations.solved(guess, AT_VALUE)
        if found is None:
            return None
        onwards = tangent_of(found.jacobian, tangent)
        # Far from the prediction it is another branch.
        self.turned = bool(np.linalg.norm(found.z - guess) > _ASIDE * self.step or onwards @ tangent < _COSINE)
        if self.turned:
            return None
        before, after = self.tests, found.tests(onwards)
        if before.at_one * after.at_one < 0.0 and before.at_minus_one * after.at_minus_one < 0.0:
            return None  # A multiplier passes 1 and -1, or changes its sign through infinity, where an impact grazes.
        if self.turns(after) and max(abs(before.at_one), abs(after.at_one)) > 0.05:
            return None  # Too far from the turn, or there is none: the difference by the parameter reaches past an end.
        return (found, at_limit) if equations.kind_at(found.z) == equations.kind else None

    def turns(self, after: Tests) -> bool:
        """Whether the parameter turns on the way to a point, but no multiplier passes 1.

        There the branch bifurcates from orbits of half the period, or symmetric ones: beyond it are the same orbits
        again, shifted or mirrored.
        """
        return self.tests.onwards * after.onwards < 0.0 < self.tests.at_one * after.at_one

    def move_start(self) -> None:
        """Move the start of the period where an impact is near it."""
        equations, z = self.equations.moved(self.z, self.trajectory)
        if equations is self.equations:
            return
        # At a fold the parameter does not say where the branch leads: the course a little ahead does.
        onwards = self.equations.later(self.z + 1e-6 * self.tangent, equations.shift) - z
        onwards /= np.linalg.norm(onwards)
        found = equations.solved(z, onwards)
        if found is not None:
            self.equations = equations
            self.go_to(found, onwards)


def _passed(here: _Walk, new: Floats, after: Tests) -> Iterator[Bifurcation]:
    """Bifurcations between a point and the next one at which the branch goes on."""
    turns = here.tests.onwards * after.onwards < 0.0
    at_minus_one = ends.SYMMETRY if here.equations.by_half else ends.FLIP
    for k, kind in enumerate((ends.FOLD if turns else ends.BRANCHES, at_minus_one)):
        if here.tests[k] * after[k] < 0.0:
            yield from _located(kind, here, new, k)


def _located(kind: str, here: _Walk, new: Floats, number: int) -> Iterator[Bifurcation]:
    """Root of one of the test functions between two points."""
    z, tangent = here.z, here.tangent

    def solve(length: float) -> Solved | None:
        return here.equations.solved(z + length * tangent, tangent)

    def test(solved: Solved) -> float:
        return solved.tests(tangent_of(solved.jacobian, tangent))[number]

    points, reached = _towards_root(solve, test, 0.0, float(tangent @ (new - z)))
    if not reached and len(points) > 1:
        # Where branches cross the equations are singular.
        value = _at_zero([each for _, each in points[:_CROSSING]], [each.z[2] for each, _ in points[:_CROSSING]])
        found = here.bifurcation(kind, points[0][0].z, [z[2], new[2]])
        yield found._replace(value=float(value * here.equations.sizes[2]))
    elif reached:
        yield here.bifurcation(kind, points[0][0].z, [each.z[2] for each, _ in points[:2]])


def _joined(here: _Walk, new: Floats) -> Bifurcation:
    """Bifurcation at which a branch meets, between two points, orbits of half the period, or symmetric ones."""
    equations, middle = here.equations, 0.5 * (here.z + new)
    even = equations.period % 2 == 0
    parent = replace(equations, period=equations.period // 2 if even else equations.period, by_half=not even)

    def solve(value: float) -> Solved | None:
        return parent.solved(np.append(middle[:2], value), AT_VALUE)

    def test(solved: Solved) -> float:
        return solved.tests(AT_VALUE).at_minus_one

    for share in _WIDER if even or is_mirrored(equations.strobe(equations.physical(middle)[1])) else ():
        points, reached = _towards_root(solve, test, middle[2] - share, middle[2] + share)
        if reached:
            near = [each.z for each, _ in points[:2]]
            found = here.bifurcation(ends.FLIP if even else ends.SYMMETRY, near[0], [each[2] for each in near])
            return found._replace(orbit=parent.orbit(near[0]))
    return here.bifurcation(ends.BRANCHES, middle, [here.z[2], new[2]])


def _vanishing(here: _Walk) -> Bifurcation | None:
    """Grazing, where the speed of the slowest impact vanishes: extrapolated, as the equations are singular there."""
    (least, value), *others = reversed(here.slowest)
    speeds, values = [least], [value]
    for speed, value in others:
        if len(speeds) == 6 or speed < speeds[-1]:
            break
        if speed >= speeds[-1] + least:
            speeds.append(speed)
            values.append(value)
    if len(speeds) < 4:
        return None
    estimates = [_at_zero(speeds[:most], values[:most]) for most in range(len(speeds) - 2, len(speeds) + 1)]
    if abs(estimates[-1] - estimates[-2]) > 1e-6:
        return None
    found = here.bifurcation(ends.GRAZING, here.z, estimates)
    return found._replace(value=float(estimates[-1] * here.equations.sizes[2]))


def reason_of_end(equations: OrbitEquations, trajectory: OrbitTrajectory, z: Floats, tangent: Floats) -> str:
    """Name what ends a branch just beyond its last point."""
    kind, sizes = equations.kind, equations.sizes
    if not kind.rests and (trajectory.slowest < _GRAZES * sizes[1] or trajectory.gap < _GRAZES * sizes[0]):
        return ends.GRAZING
    beyond = z + 8.0 * _LEAST_STEP * tangent
    on_other_courses = False
    for step in _BEYOND:
        try:
            found = equations.kind_at(beyond + step * tangent)
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
    # A body that lifts and rests as before, but not in the same way, has touched or missed something in between.
    return ends.GRAZING if on_other_courses else ends.LOST


def _towards_root(
    solve: Callable[[float], Solved | None], test: Callable[[Solved], float], low: float, high: float
) -> tuple[list[tuple[Solved, float]], bool]:
    """Return points of a branch with values of a test function, the nearest to its root first, and whether there."""
    from scipy.optimize import brentq

    found: dict[float, tuple[Solved, float]] = {}

    def tested(at: float) -> float:
        solved = solve(at)
        if solved is None:
            raise _Missed
        found[at] = solved, test(solved)
        return found[at][1]

    try:
        root = brentq(tested, low, high, xtol=1e-16, rtol=1e-15)
    except ValueError:
        return [], False
    except _Missed:
        signs = {each > 0.0 for _, each in found.values()}
        return sorted(found.values(), key=lambda each: abs(each[1])) if len(signs) > 1 else [], False
    return [found[at] for at in sorted(found, key=lambda at: abs(at - root))], True


class _Missed(Exception):
    """There is no point of the branch where one was looked for."""


def _at_zero(x: Sequence[float], y: Sequence[float]) -> float:
    """Value at zero of the polynomial through points."""
    weights = [math.prod(b / (b - a) for b in x if b != a) for a in x]
    return float(np.dot(weights, y))
