"""Bifurcations on a branch of periodic orbits: roots of test functions between two points, and what ends a branch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.dynamics.branches import (
    BRANCHES,
    CHATTERING,
    FLIP,
    FOLD,
    GRAZING,
    LOST,
    OVERTURNING,
    REST,
    SYMMETRY,
    UPLIFT,
    Bifurcation,
)
from rocking.dynamics.courses import Course
from rocking.dynamics.orbit_equations import AT_VALUE, OrbitEquations, Solved, Tests
from rocking.dynamics.symmetry import is_mirrored
from rocking.errors import RockingError

#: Step along a branch below which it has come to its end.
LEAST_STEP: Final = 1e-13

#: Gap and speed, over their scales, below which a branch that ends has come to grazing.
_GRAZES: Final = 1e-4

#: Steps beyond the end of a branch at which the kind of its orbits is looked at.
_BEYOND: Final = (0.0, *np.geomspace(1e-12, 1e-4, 9).tolist())

#: Points from which grazing is extrapolated, at least and at most, and how far the last two estimates may differ, over
#: the range of the parameter.
_FEWEST: Final = 4
_EXTRAPOLATED: Final = 6
_AGREEMENT: Final = 1e-6

#: Points from which the crossing of two branches is interpolated.
_CROSSING: Final = 4

#: Shares of the range of the parameter within which the orbits are sought from which a branch bifurcates.
_WIDER: Final = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


@dataclass(eq=False)
class Location:
    """Where a branch has been followed to: the equations there, a point, its tangent, test functions and course."""

    equations: OrbitEquations
    z: Floats
    tangent: Floats
    tests: Tests
    course: Course

    def bifurcation(self, kind: str, z: Floats, values: Sequence[float]) -> Bifurcation:
        """Bifurcation at a point near this one, between values of the parameter over its size."""
        ends = sorted(float(each * self.equations.sizes[2]) for each in values)
        return Bifurcation(kind, self.equations.physical(z)[1], (ends[0], ends[-1]), self.equations.orbit(z))


def passed(here: Location, new: Floats, after: Tests) -> Iterator[Bifurcation]:
    """Bifurcations between a point and the next one at which the branch goes on."""
    before = here.tests
    if before.at_one * after.at_one < 0.0:
        kind = FOLD if before.onwards * after.onwards < 0.0 else BRANCHES
        yield from _located(kind, here, new, lambda tests: tests.at_one)
    if before.at_minus_one * after.at_minus_one < 0.0:
        kind = SYMMETRY if here.equations.by_half else FLIP
        yield from _located(kind, here, new, lambda tests: tests.at_minus_one)


def _located(kind: str, here: Location, new: Floats, value_of: Callable[[Tests], float]) -> Iterator[Bifurcation]:
    """Root of a test function between two points."""
    z, tangent = here.z, here.tangent

    def solve(length: float) -> Solved | None:
        return here.equations.solved(z + length * tangent, tangent)

    def test(solved: Solved) -> float:
        return value_of(solved.tests(solved.tangent(tangent)))

    points, reached = _towards_root(solve, test, 0.0, float(tangent @ (new - z)))
    if not reached and len(points) > 1:
        # Where branches cross the equations are singular.
        value = _at_zero([each for _, each in points[:_CROSSING]], [each.z[2] for each, _ in points[:_CROSSING]])
        found = here.bifurcation(kind, points[0][0].z, [z[2], new[2]])
        yield found._replace(value=float(value * here.equations.sizes[2]))
    elif reached:
        yield here.bifurcation(kind, points[0][0].z, [each.z[2] for each, _ in points[:2]])


def joined(here: Location, new: Floats) -> Bifurcation:
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
            found = here.bifurcation(FLIP if even else SYMMETRY, near[0], [each[2] for each in near])
            return found._replace(orbit=parent.orbit(near[0]))
    return here.bifurcation(BRANCHES, middle, [here.z[2], new[2]])


def vanishing(here: Location, slowest: Sequence[tuple[float, float]]) -> Bifurcation | None:
    """Grazing, where the speed of the slowest impact vanishes: extrapolated, as the equations are singular there.

    ``slowest`` holds that speed and the parameter, over its size, at all points up to this one. None where the speed
    has not fallen far enough yet for estimates that agree.
    """
    (least, value), *others = reversed(slowest)
    speeds, values = [least], [value]
    for speed, value in others:
        if len(speeds) == _EXTRAPOLATED or speed < speeds[-1]:
            break
        if speed >= speeds[-1] + least:
            speeds.append(speed)
            values.append(value)
    if len(speeds) < _FEWEST:
        return None
    estimates = [_at_zero(speeds[:most], values[:most]) for most in range(len(speeds) - 2, len(speeds) + 1)]
    if abs(estimates[-1] - estimates[-2]) > _AGREEMENT:
        return None
    found = here.bifurcation(GRAZING, here.z, estimates)
    return found._replace(value=float(estimates[-1] * here.equations.sizes[2]))


def ending(here: Location, ahead: float) -> tuple[str, list[Bifurcation]]:
    """Why a branch ends between here and a distance ahead, and the bifurcation there, if there is one."""
    reason = _reason(here, here.z + 8.0 * LEAST_STEP * here.tangent)
    values = [(here.z + step * here.tangent)[2] for step in (0.0, ahead)]
    return reason, [] if reason == LOST else [here.bifurcation(reason, here.z, values)]


def _reason(here: Location, beyond: Floats) -> str:
    """Name what ends a branch just beyond its last point."""
    equations, course = here.equations, here.course
    kind, sizes = equations.kind, equations.sizes
    if not kind.rests and (course.slowest < _GRAZES * sizes[1] or course.gap < _GRAZES * sizes[0]):
        return GRAZING
    on_other_courses = False
    for step in _BEYOND:
        try:
            found = equations.kind_at(beyond + step * here.tangent)
        except RockingError:
            continue
        if found.unknown:
            return LOST
        if found.overturns:
            return OVERTURNING
        if found.for_ever != kind.for_ever:
            return UPLIFT
        if found.rests != kind.rests:
            return REST if found.rests else CHATTERING
        if found != kind:
            return GRAZING
        on_other_courses = kind.rests and not kind.for_ever
    # A body that lifts and rests as before, but not in the same way, has touched or missed something in between.
    return GRAZING if on_other_courses else LOST


def _towards_root(
    solve: Callable[[float], Solved | None], test: Callable[[Solved], float], low: float, high: float
) -> tuple[list[tuple[Solved, float]], bool]:
    """Return points of a branch with values of a test function, the nearest to its root first, and whether it is there.

    None where it does not change its sign. The search ends where there is no point to be found.
    """
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
