"""Continuation: a periodic orbit followed as a parameter changes, through folds, to where orbits of its kind end."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.dynamics.branches import CLOSED, GRAZING, LIMIT, LOST, SHORT, Bifurcation, Branch
from rocking.dynamics.courses import Course
from rocking.dynamics.locating import LEAST_STEP, Location, ending, joined, passed, vanishing
from rocking.dynamics.orbit_equations import AT_VALUE, OrbitEquations, Solved, Tests
from rocking.dynamics.orbits import PeriodicOrbit
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion

#: Steps along a branch, over the scales of state and parameter: the first one, and the factor by which one grows after
#: so few Newton steps.
_FIRST_STEP: Final = 0.005
_LONGER: Final = 1.4
_QUICK: Final = 4

#: Steps that succeed after one that failed until that one is forgotten; and the distance below which a point takes the
#: place of the one before.
_SUCCESSES: Final = 5
_NEAR: Final = 1e-5

#: Steps that are tried for each point.
_TRIALS: Final = 4

#: Least cosine between one tangent and the next, how far a point may be from where the tangent leads, over the step (a
#: bend of that cosine makes it half as much), and the longest step in which that may mean that the branch ends; in a
#: longer one it bends, or the point is one of another branch.
_COSINE: Final = 0.97
_ASIDE: Final = 0.25
_SHARP: Final = 1e-3

#: Size of det(R - 1) on either side of a turn of the parameter: it is zero there.
_TURNING: Final = 0.05

#: Speed of the slowest impact, over the scale, from which grazing is extrapolated.
_SLOW: Final = 2e-3

#: Step along a tangent that shows where it leads after the start of a period has been moved.
_AHEAD: Final = 1e-6

#: Points after which a branch may have come back to where it began, and how far from that it may pass, over the step.
_ROUND: Final = 12
_BESIDE: Final = 0.1


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

    The motion is to be given over its least period. Over two of them, orbits of twice the period and those from which
    they bifurcate are of one kind, so that a long step may lead from the ones to the others without a word.

    References
    ----------
    H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", in Applications of Bifurcation
    Theory, Academic Press (1977).

    Examples
    --------
    A ball bounces once a period of the table from pi/3 g on, and no longer stably beyond 1.5268 g (Luck and Mehta):

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
    low, high = range_of(limits)
    start = checks.within(value, "value", InvalidOption, low, high)
    longest = checks.positive(step, "step", InvalidOption)
    count = checks.whole(most, "most", InvalidOption, least=1)
    equations = OrbitEquations.of(orbit, family, start, (low, high))
    z = np.append(orbit.state, start) / equations.sizes
    backward = _followed(equations, z, -1.0, longest, count)
    # What has come back to where it began is all there is.
    onwards = backward.end != CLOSED
    forward = _followed(equations, z, 1.0, longest, count) if onwards else _Path([], [], CLOSED)
    points = [*reversed(backward.points), *forward.points[1:]]
    return Branch(
        family, name, unit, orbit.model, orbit.treatment, (low, high), orbit.period,
        np.array([each.value for each in points]),
        np.array([each.state for each in points]),
        np.array([each.multipliers for each in points]),
        orbit.impacts,
        np.array([each.peak for each in points]),
        (*reversed(backward.bifurcations), *forward.bifurcations),
        (backward.end, forward.end),
    )  # fmt: skip


class _Point(NamedTuple):
    """A point of a branch, with the state at the start of the period of the motion as it was given."""

    value: float
    state: Floats
    multipliers: NDArray[np.complex128]
    peak: float


class _Path(NamedTuple):
    """A branch in one direction."""

    points: list[_Point]
    bifurcations: list[Bifurcation]
    end: str


def _followed(equations: OrbitEquations, z: Floats, direction: float, longest: float, most: int) -> _Path:
    """Follow the branch in one direction of the parameter, as it leaves the orbit."""
    course = equations.course(z)
    equations, z = equations.moved(z, course)
    path = _Path([_point(equations, z, course.peak)], [], SHORT)
    if path.points[0].value == equations.limits[0 if direction < 0.0 else 1]:
        return path._replace(end=LIMIT)
    step = min(_FIRST_STEP, longest)
    equations.for_step(step)
    found = equations.solved(z, AT_VALUE)
    if found is None:
        return path._replace(end=LOST)
    tangent = found.tangent(direction * AT_VALUE)
    walk = _Walk(equations, found.z, tangent, found.tests(tangent), course, step, longest)
    for _ in range(_TRIALS * most):
        if len(path.points) >= most:
            break
        end = walk.advance(path)
        walk.equations.for_step(walk.step)
        if end:
            return path._replace(end=end)
    return path


@dataclass
class _Walk(Location):
    """Where a branch has been followed to, and the next step along it."""

    step: float
    longest: float
    #: How far ahead there is no point of this kind, as far as is known, and successful steps since that was found.
    ahead: float = math.inf
    successes: int = 0
    #: Whether the last step failed only as it led too far from the tangent.
    turned: bool = False

    def __post_init__(self) -> None:
        self.written = self.z
        #: Speed of the slowest impact and parameter, over its size, at all points so far.
        self.slowest = [(self.course.slowest, self.z[2])]

    def advance(self, path: _Path) -> str:
        """Take a step along the branch, or find that it is too long; returns why the branch ends, if it does."""
        equations = self.equations
        if self.ahead < LEAST_STEP:
            end, bifurcations = ending(self, self.ahead)
            path.bifurcations.extend(bifurcations)
            return end
        found = self.next()
        if found is None:
            self.shorten()
            return ""
        solved, at_limit = found
        new, tangent = solved.z, solved.tangent(self.tangent)
        tests = solved.tests(tangent)
        if self.turns(tests) or equations.is_parent(new):
            path.bifurcations.append(joined(self, new))
            return path.bifurcations[-1].kind
        path.bifurcations.extend(passed(self, new, tests))
        course, before = equations.course(new), self.course
        if len(path.points) > 1 and np.max(np.abs(new - self.written)) < _NEAR:
            path.points.pop()
        else:
            self.written = new
        path.points.append(_point(equations, new, course.peak))
        self.go_to(new, tangent, tests)
        self.course, self.successes = course, self.successes + 1
        self.ahead = math.inf if self.successes > _SUCCESSES else self.ahead - self.step
        if at_limit:
            return LIMIT
        if self.comes_to_graze(path, before):
            return GRAZING
        if self.has_returned(path):
            return CLOSED
        self.move_start()
        if self.ahead < math.inf:
            self.step = 0.5 * self.ahead
        elif solved.steps <= _QUICK:
            self.step = min(self.step * _LONGER, self.longest)
        return ""

    def comes_to_graze(self, path: _Path, before: Course) -> bool:
        """Whether the slowest impact comes to have no speed, and where."""
        equations, speed = self.equations, self.course.slowest
        self.slowest.append((speed, self.z[2]))
        if equations.kind.rests or speed >= min(_SLOW * equations.sizes[1], before.slowest):
            return False
        grazing = vanishing(self, self.slowest)
        path.bifurcations.extend([] if grazing is None else [grazing])
        return grazing is not None

    def has_returned(self, path: _Path) -> bool:
        """Whether the branch has passed its first point again, in the direction in which it left it."""
        if len(path.points) <= _ROUND:
            return False
        first, second, before, last = (
            np.append(each.state, each.value) / self.equations.sizes
            for each in (path.points[0], path.points[1], path.points[-2], path.points[-1])
        )
        step, left = last - before, second - first
        size = float(np.linalg.norm(step))
        share = float((first - before) @ step) / size**2
        beside = float(np.linalg.norm(first - before - share * step))
        same_way = float(step @ left) > _COSINE * size * float(np.linalg.norm(left))
        return 0.0 <= share <= 1.0 and beside < _BESIDE * size and same_way

    def shorten(self) -> None:
        """Try half the step that failed; there is no point of this kind at its end, unless the branch bends."""
        if not (self.turned and self.step > _SHARP):
            self.ahead, self.successes = self.step, 0
        self.step *= 0.5
        self.tangent = self.equations.tangent(self.z, self.tangent)

    def go_to(self, z: Floats, tangent: Floats, tests: Tests) -> None:
        """Go to another point."""
        self.z, self.tangent, self.tests = z, tangent, tests

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
        onwards = found.tangent(tangent)
        # Far from the prediction it is another branch.
        self.turned = bool(np.linalg.norm(found.z - guess) > _ASIDE * self.step or onwards @ tangent < _COSINE)
        if self.turned:
            return None
        before, after = self.tests, found.tests(onwards)
        if before.at_one * after.at_one < 0.0 and before.at_minus_one * after.at_minus_one < 0.0:
            return None  # A multiplier passes 1 and -1, or changes its sign through infinity, where an impact grazes.
        if self.turns(after) and max(abs(before.at_one), abs(after.at_one)) > _TURNING:
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
        equations, z = self.equations.moved(self.z, self.course)
        if equations is self.equations:
            return
        # At a fold the parameter does not say where the branch leads: the course a little ahead does.
        onwards = self.equations.later(self.z + _AHEAD * self.tangent, equations.shift) - z
        onwards /= np.linalg.norm(onwards)
        found = equations.solved(z, onwards)
        if found is not None:
            tangent = found.tangent(onwards)
            self.equations = equations
            self.go_to(found.z, tangent, found.tests(tangent))


def _point(equations: OrbitEquations, z: Floats, peak: float) -> _Point:
    """Point of a branch."""
    return _Point(equations.physical(z)[1], equations.at_start(z), equations.multipliers(z), peak)


def range_of(limits: Sequence[float]) -> tuple[float, float]:
    """Return a range of the parameter, checked."""
    values = checks.several(limits, "limits", InvalidOption)
    if len(values) != 2:
        raise InvalidOption("{} must be (lower, higher)", "limits")
    low, high = (checks.finite(each, "limits", InvalidOption) for each in values)
    if not (low < high and math.isfinite(high - low)):
        raise InvalidOption(f"{{}} must be (lower, higher), not ({low:g}, {high:g})", "limits")
    return low, high
