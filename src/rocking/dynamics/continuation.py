"""Branches of periodic orbits: an orbit followed as a parameter changes, through folds, with the bifurcations on it."""

from __future__ import annotations

import contextlib
import copy
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Flags, Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.maps import Fate, StroboscopicMap
from rocking.dynamics.orbits import (
    HalfMap,
    PeriodicOrbit,
    is_mirrored,
    multipliers_of,
    orbit_at,
    response_of,
    scale_of,
)
from rocking.errors import InvalidOption, RockingError
from rocking.motion.motion import Motion
from rocking.result import DrawnResult, TableResult
from rocking.tables import cell, counted, named, text_table
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.response import Response

#: Names of bifurcations.
FOLD: Final = "fold"
FLIP: Final = "flip"
SYMMETRY: Final = "symmetry breaking"
BRANCHES: Final = "branch point"
GRAZING: Final = "grazing"
CHATTERING: Final = "loss of complete chattering"
REST: Final = "start of complete chattering"
UPLIFT: Final = "uplift"
OVERTURNING: Final = "overturning"

#: How a branch may end without one.
LIMIT: Final = "limit of the parameter"
CLOSED: Final = "where it began"
SHORT: Final = "too many points"
LOST: Final = "lost"

#: Steps along a branch, over the scales of state and parameter: the first one, the least one, and how one changes.
_FIRST_STEP: Final = 0.005
_LEAST_STEP: Final = 1e-13
_LONGER: Final = 1.4
_QUICK: Final = 4

#: Steps that succeed after one that failed until that one is forgotten; and the distance below which a point takes the
#: place of the one before.
_SUCCESSES: Final = 5
_NEAR: Final = 1e-5

#: Steps that are tried for each point.
_TRIALS: Final = 4

#: Newton steps to a branch, its residual over the scale and the size of the derivative, and the least cosine between
#: one tangent and the next.
_CORRECTIONS: Final = 10
_RESIDUAL: Final = 1e-12
_COSINE: Final = 0.97

#: Step of differences by the parameter, over its range: least and greatest, and over the step along the branch, so that
#: near the end of a branch few of them reach across it.
_LEAST_DIFFERENCE: Final = 1e-13
_DIFFERENCE: Final = 1e-6
_OF_STEP: Final = 1e-3

#: An impact nearer to the start of a period than this share of it moves that start.
_TOO_NEAR: Final = 0.03

#: Points at which a period is looked at for extremes, steps with which they are found, and the gap, over the scale, and
#: the speed, over the scale, below which a branch that ends has come to grazing.
_LOOKS: Final = 64
_REFINED: Final = 40
_GRAZES: Final = 1e-4

#: Speed of the slowest impact, over the scale, from which grazing is extrapolated, and points for that.
_SLOW: Final = 2e-3
_EXTRAPOLATED: Final = 6

#: Shares of the range of the parameter within which the orbits are looked at from which others came off.
_WIDER: Final = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)

#: Distance, over the scale, within which an orbit is one of those.
_SAME: Final = 1e-7

#: Share of the parameter in a tangent, below which the start of a period is not moved.
_ALONG: Final = 0.05

#: Points after which a branch may have come back to where it began.
_ROUND: Final = 12


class Bifurcation(NamedTuple):
    """Where a branch of periodic orbits changes.

    Attributes
    ----------
    kind : str
        "fold", "flip", "symmetry breaking", "branch point", "grazing", "loss of complete chattering", "start of
        complete chattering", "uplift" or "overturning".
    value : float
        The parameter there.
    bracket : (float, float)
        Values of the parameter between which it lies; where the speed of an impact vanishes, the lowest and highest of
        three extrapolations.
    orbit : PeriodicOrbit
        The orbit there: the last one on the branch where that ends.

    Examples
    --------
    >>> from rocking.dynamics import Bifurcation
    >>> Bifurcation._fields
    ('kind', 'value', 'bracket', 'orbit')
    """

    kind: str
    value: float
    bracket: tuple[float, float]
    orbit: PeriodicOrbit


@dataclass(frozen=True, eq=False, repr=False)
class Branch(DrawnResult, TableResult):
    """Periodic orbits along a parameter, made by `continue_orbit`.

    Attributes
    ----------
    family : callable
        Makes body and motion of the parameter.
    name, unit : str
        What the parameter is.
    period : int
        Period of the orbits, in periods of the motion.
    values : ndarray, shape (n,)
        The parameter, in the order along the branch.
    states : ndarray, shape (n, 2)
        Coordinate and velocity at the start of a period.
    multipliers : ndarray of complex, shape (n, 2)
        Floquet multipliers, the largest first.
    impacts : float
        Impacts in the period of the orbits, which are as many all along the branch; infinity with complete chattering.
    peaks : ndarray, shape (n,)
        Greatest size of the coordinate.
    bifurcations : tuple of Bifurcation
        In the order along the branch.
    ends : (str, str)
        Why the branch ends where it does: a kind of bifurcation, "limit of the parameter", "where it began", "too many
        points", or "lost".
    """

    TABLES: ClassVar[tuple[str, ...]] = ("points", "bifurcations")

    family: Callable[[float], tuple[Body, Motion]]
    name: str
    unit: str
    model: Model
    treatment: Treatment
    period: int
    values: Floats
    states: Floats
    multipliers: NDArray[np.complex128]
    impacts: float
    peaks: Floats
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[str, str]

    @property
    def is_stable(self) -> Flags:
        """Whether the orbit at each point is stable, shape (n,)."""
        return np.asarray(np.all(np.abs(self.multipliers) < 1.0, axis=1))

    def __len__(self) -> int:
        return len(self.values)

    def orbit(self, index: int) -> PeriodicOrbit:
        """Return the orbit at a point of the branch.

        Parameters
        ----------
        index : int
            Number of the point.

        Returns
        -------
        PeriodicOrbit
            With its multipliers and its course.

        Raises
        ------
        InvalidOption
            If there is no such point.

        Examples
        --------
        >>> from rocking import dynamics, pulses
        >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
        >>> def family(amplitude):
        ...     return ball, pulses.sine(amplitude, 5.0, cycles=1)
        >>> stable = next(each for each in dynamics.periodic_orbits(*family(12.0)) if each.is_stable)
        >>> branch = dynamics.continue_orbit(stable, family, 12.0, (11.0, 13.0))
        >>> branch.orbit(0).impacts
        1.0
        """
        if not -len(self) <= index < len(self):
            raise InvalidOption(f"{{}} must be that of one of {len(self)} points, not {index}", "index", value=index)
        body, motion = self.family(float(self.values[index]))
        return orbit_at(StroboscopicMap(body, motion, self.model, self.treatment), self.states[index], self.period)

    def _headline(self) -> str:
        impacts = "complete chattering" if math.isinf(self.impacts) else counted(int(self.impacts), "impact")
        low, high = float(self.values.min()), float(self.values.max())
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"orbits of {counted(self.period, 'period')} with {impacts}, {self.name} from {low:.6g} to {high:.6g}{unit}"
        )

    def summary(self) -> str:
        stable = self.is_stable
        lines = [self._headline(), f"{len(self)} points, {int(np.sum(stable))} of them stable"]
        if self.bifurcations:
            header = ["bifurcation", named(self.name, self.unit), "multipliers"]
            rows = [[each.kind, f"{each.value:.12g}", _written(each.orbit.multipliers)] for each in self.bifurcations]
            lines += ["", text_table(header, rows)]
        return "\n".join([*lines, "", f"ends: {self.ends[0]}; {self.ends[1]}"])

    def to_dict(self) -> dict[str, Any]:
        return {
            "parameter": self.name,
            "unit": self.unit,
            "period": self.period,
            "impacts": self.impacts,
            "complete_chattering": math.isinf(self.impacts),
            "values": self.values,
            "states": self.states,
            "stable": self.is_stable,
            "peaks": self.peaks,
            "bifurcations": [
                {"kind": each.kind, "value": each.value, "bracket": [*each.bracket]} for each in self.bifurcations
            ],
            "ends": [*self.ends],
        }

    def _frame(self, table: str) -> pd.DataFrame:
        import pandas as pd

        parameter = named(self.name, self.unit)
        if table == "bifurcations":
            rows = [(each.kind, each.value, *each.bracket) for each in self.bifurcations]
            return pd.DataFrame(rows, columns=["kind", parameter, f"{parameter}_lower", f"{parameter}_upper"])
        coordinate = self._coordinate
        columns = {
            parameter: self.values,
            named(coordinate.name, coordinate.unit): self.states[:, 0],
            named("velocity", f"{coordinate.unit}/s"): self.states[:, 1],
            named("peak", coordinate.unit): self.peaks,
            "first_multiplier": np.abs(self.multipliers[:, 0]),
            "second_multiplier": np.abs(self.multipliers[:, 1]),
            "stable": self.is_stable,
        }
        return pd.DataFrame(columns)

    @property
    def _coordinate(self) -> Any:
        return self.family(float(self.values[0]))[0].coordinate

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import branch_figure

        coordinate = self._coordinate
        unit = "" if self.unit == "1" else f" ({self.unit})"
        body, _ = self.family(float(self.values[0]))
        return branch_figure(
            values=self.values,
            peaks=self.peaks,
            stable=self.is_stable,
            marks=[(each.kind, each.value, _peak_at(self, each)) for each in self.bifurcations],
            labels=(f"{self.name}{unit}", f"largest {coordinate.name} ({coordinate.unit})"),
            title=title or f"{body.kind if hasattr(body, 'kind') else body.description}, {self._headline()}",
            ax=ax,
            figsize=figsize,
        )


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
        Range of the parameter.
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
    low, high = (checks.finite(each, "limits", InvalidOption) for each in _pair(limits))
    if not low < high:
        raise InvalidOption(f"{{}} must be (lower, higher), not ({low:g}, {high:g})", "limits")
    start = checks.within(value, "value", InvalidOption, low, high)
    longest = checks.positive(step, "step", InvalidOption)
    tracer = _Tracer(orbit, family, start, (low, high), longest, checks.whole(most, "most", InvalidOption, least=1))
    backward, forward = tracer.followed(-1.0), tracer.followed(1.0)
    points = [*reversed(backward.points), *forward.points[1:]]
    return Branch(
        family, name, unit, orbit.model, orbit.treatment, orbit.period,
        np.array([each.value for each in points]),
        np.array([each.state for each in points]),
        np.array([each.multipliers for each in points]),
        orbit.impacts,
        np.array([each.peak for each in points]),
        (*reversed(backward.bifurcations), *forward.bifurcations),
        (backward.end, forward.end),
    )  # fmt: skip


class _Kind(NamedTuple):
    """What must stay as it is along a branch: whether a body rests, for ever, and its impacts where it does not."""

    rests: bool
    for_ever: bool
    impacts: int


class _Point(NamedTuple):
    """A point of a branch, with the state at the start of the period of the motion as it was given."""

    value: float
    state: Floats
    multipliers: NDArray[np.complex128]
    peak: float


class _Course(NamedTuple):
    """What a period of an orbit shows: greatest coordinate, slowest impact, least gap, and the phases of impacts."""

    peak: float
    slowest: float
    gap: float
    phases: Floats


class _Path(NamedTuple):
    """A branch in one direction."""

    points: list[_Point]
    bifurcations: list[Bifurcation]
    end: str


class _Tests(NamedTuple):
    """Functions that change their signs at bifurcations: det(R' - 1), det(R' + 1), and the tangent's parameter."""

    plus: float
    minus: float
    turn: float


@dataclass
class _Walk:
    """Where a branch has been followed to: point, tangent, test functions, start of the period, course, next step."""

    z: Floats
    tangent: Floats
    tests: _Tests
    turn: int
    course: _Course
    step: float
    #: How far ahead there is no point of this kind, as far as is known, and successful steps since that was found.
    ahead: float = math.inf
    successes: int = 0

    def __post_init__(self) -> None:
        self.written = self.z

    def fail(self) -> None:
        """Halve the step."""
        self.ahead, self.step, self.successes = self.step, 0.5 * self.step, 0

    def succeed(self, z: Floats, tangent: Floats, tests: _Tests, course: _Course) -> None:
        """Be at the next point."""
        self.z, self.tangent, self.tests, self.course = z, tangent, tests, course
        self.successes += 1
        self.ahead = math.inf if self.successes > _SUCCESSES else self.ahead - self.step

    def choose(self, corrections: int, longest: float) -> None:
        """Choose the next step: half of what is left, or a longer one than the last."""
        if self.ahead < math.inf:
            self.step = 0.5 * self.ahead
        elif corrections <= _QUICK:
            self.step = min(self.step * _LONGER, longest)


class _Tracer:
    """Follows one orbit of a family; numbers z are coordinate, velocity and parameter over their scales."""

    def __init__(
        self,
        orbit: PeriodicOrbit,
        family: Callable[[float], tuple[Body, Motion]],
        value: float,
        limits: tuple[float, float],
        longest: float,
        most: int,
    ) -> None:
        self.orbit, self.family, self.limits, self.longest, self.most = orbit, family, limits, longest, most
        self.value, self.period, self.difference = value, orbit.period, _DIFFERENCE
        self.model, self.treatment = orbit.model, orbit.treatment
        self.strobe = lru_cache(maxsize=64)(self._strobe)
        self.half = lru_cache(maxsize=64)(self._half)
        given = self.strobe(value, 0)
        after, _ = given.derivative(orbit.state, self.period)
        scale = scale_of(given)
        if not np.all(np.abs(after - orbit.state) / scale < 1e-8):
            raise InvalidOption(
                f"the orbit is none of what {{}} makes at {{}} = {value:g}", "family", "value", value=value
            )
        self.sizes = np.array([*scale, limits[1] - limits[0]])
        self.by_half = orbit.symmetric and not orbit.rests and is_mirrored(given)
        self.kind = self._kind_of(given, orbit.state)

    def _strobe(self, value: float, turn: int) -> StroboscopicMap:
        """Map of the body and the motion at a value, with the start of the period moved by some pieces."""
        body, motion = self.family(value)
        return StroboscopicMap(body, _turned(motion, turn), self.model, self.treatment)

    def _half(self, value: float, turn: int) -> HalfMap:
        return HalfMap(self.strobe(value, turn))

    def _kind_of(self, strobe: StroboscopicMap, state: Floats) -> _Kind:
        _, fate, impacts = strobe.followed(state, self.period)
        _, change = strobe.derivative(state, self.period)
        rests = not np.any(change)
        return _Kind(rests, bool(fate == Fate.RESTS_FOR_EVER and not impacts), 0 if rests else int(impacts))

    def returned(self, state: Floats, value: float, turn: int) -> tuple[Floats, Floats]:
        """State, or its mirror image, after the period or half of it, and the derivative; NaN where there is none."""
        try:
            if self.by_half:
                return self.half(value, turn).mirrored(state, self.period)
            return self.strobe(value, turn).derivative(state, self.period)
        except RockingError:  # behind a stop, or a parameter that makes no body or motion
            return np.full(2, np.nan), np.full((2, 2), np.nan)

    def equations(self, z: Floats, turn: int) -> tuple[Floats, Floats, Floats]:
        """Residual, its derivative by z, and the derivative of the map."""
        state, value = z[:2] * self.sizes[:2], float(z[2] * self.sizes[2])
        after, change = self.returned(state, value, turn)
        h = self.difference * self.sizes[2]
        ahead, _ = self.returned(state, value + h, turn)
        behind, _ = self.returned(state, value - h, turn)
        scaled = change / self.sizes[:2, None] * self.sizes[:2]
        by_value = (ahead - behind) / (2.0 * h) * self.sizes[2] / self.sizes[:2]
        return (after - state) / self.sizes[:2], np.column_stack([scaled - np.eye(2), by_value]), change

    def corrected(self, guess: Floats, normal: Floats, turn: int) -> tuple[Floats, Floats, Floats, int] | None:
        """Return the point of the branch in the plane through a guess, its equations, and the steps it took."""
        z = guess.copy()
        for count in range(_CORRECTIONS):
            residual, jacobian, change = self.equations(z, turn)
            if not np.all(np.isfinite(jacobian)):
                return None
            sharp = np.max(np.abs(residual)) < _RESIDUAL * max(1.0, float(np.max(np.abs(jacobian[:, :2]))))
            try:
                step = np.linalg.solve(np.vstack([jacobian, normal]), -np.append(residual, normal @ (z - guess)))
            except np.linalg.LinAlgError:
                return None
            if sharp:
                return z + step, jacobian, change, count
            z = z + step
        return None

    def tangent(self, z: Floats, like: Floats, turn: int) -> Floats:
        """Tangent at a point, in the direction of another; that one where there is none."""
        _, jacobian, _ = self.equations(z, turn)
        return _tangent(jacobian, like) if np.all(np.isfinite(jacobian)) else like

    def tests(self, change: Floats, tangent: Floats) -> _Tests:
        """Test functions at a point."""
        one = np.eye(2)
        return _Tests(float(np.linalg.det(change - one)), float(np.linalg.det(change + one)), float(tangent[2]))

    def followed(self, direction: float) -> _Path:
        """Follow the branch in one direction of the parameter, as it leaves the orbit."""
        course = self.course(self.orbit.response)
        state, turn = self.moved(self.orbit.state, self.value, 0, course)
        z = np.append(state, self.value) / self.sizes
        path = _Path([self.point(z, turn, course)], [], SHORT)
        self.difference = _OF_STEP * min(_FIRST_STEP, self.longest)
        found = self.corrected(z, np.array([0.0, 0.0, 1.0]), turn)
        if found is None:
            return path._replace(end=LOST)
        tangent = _tangent(found[1], np.array([0.0, 0.0, direction]))
        walk = _Walk(found[0], tangent, self.tests(found[2], tangent), turn, course, min(_FIRST_STEP, self.longest))
        for _ in range(_TRIALS * self.most):
            if len(path.points) >= self.most:
                break
            end = self.step(walk, path, first=found[0])
            self.difference = min(max(_OF_STEP * walk.step, _LEAST_DIFFERENCE), _DIFFERENCE)
            if end:
                return path._replace(end=end)
        return path

    def step(self, walk: _Walk, path: _Path, first: Floats) -> str:
        """Take a step along the branch, or find that it is too long; returns why the branch ends, if it does."""
        if walk.ahead < _LEAST_STEP:
            end = self.reason(walk.z + 8.0 * _LEAST_STEP * walk.tangent, walk.tangent, walk.turn, walk.course)
            path.bifurcations.extend(self.last(end, walk))
            return end
        taken = self.taken(walk)
        if taken is None:
            walk.fail()
            walk.tangent = self.tangent(walk.z, walk.tangent, walk.turn)
            return ""
        new, jacobian, change, count, at_limit = taken
        tangent = _tangent(jacobian, walk.tangent)
        tests = self.tests(change, tangent)
        # The parameter turns, but no multiplier passes 1: this is the branch from which the orbits came off. They go
        # back along it as others, or as the same ones.
        turns = walk.tests.turn * tests.turn < 0.0 < walk.tests.plus * tests.plus
        if turns or self.is_parent(new, walk.turn):
            path.bifurcations.append(self.joined(walk, new))
            return path.bifurcations[-1].kind
        path.bifurcations.extend(self.passed(walk, new, tests))
        value, course = self.seen(new, walk.turn)
        if len(path.points) > 1 and np.max(np.abs(new - walk.written)) < _NEAR:
            path.points.pop()
        else:
            walk.written = new
        path.points.append(self.point(new, walk.turn, course))
        before, length = walk.course, float(np.linalg.norm(new - walk.z))
        walk.succeed(new, tangent, tests, course)
        if at_limit:
            return LIMIT
        if not self.kind.rests and course.slowest < min(_SLOW * self.sizes[1], before.slowest):
            path.bifurcations.append(self.vanishing(walk, before, length))
            return GRAZING
        if len(path.points) > _ROUND and walk.turn == 0 and np.max(np.abs(new - first)) < length:
            return CLOSED
        self.turned(walk, value)
        walk.choose(count, self.longest)
        return ""

    def turned(self, walk: _Walk, value: float) -> None:
        """Move the start of the period where an impact is near it."""
        state, turn = self.moved(walk.z[:2] * self.sizes[:2], value, walk.turn, walk.course)
        # Near a fold the branch is along the plane of one parameter: a later point will do.
        if turn == walk.turn or abs(walk.tangent[2]) < _ALONG:
            return
        found = self.corrected(np.append(state, value) / self.sizes, np.array([0.0, 0.0, 1.0]), turn)
        if found is not None:
            walk.turn, walk.z = turn, found[0]
            walk.tangent = _tangent(found[1], np.array([0.0, 0.0, walk.tangent[2]]))
            walk.tests = self.tests(found[2], walk.tangent)

    def taken(self, walk: _Walk) -> tuple[Floats, Floats, Floats, int, bool] | None:
        """Return the next point where a step leads to one of the same kind, and whether at a limit."""
        z, tangent, before, step, turn = walk.z, walk.tangent, walk.tests, walk.step, walk.turn
        found = self.corrected(z + step * tangent, tangent, turn)
        if found is None:
            return None
        low, high = (each / self.sizes[2] for each in self.limits)
        at_limit = not low <= found[0][2] <= high
        if at_limit:
            wanted = low if found[0][2] < low else high
            share = (wanted - z[2]) / (found[0][2] - z[2])
            guess = z + share * (found[0] - z)
            guess[2] = wanted
            found = self.corrected(guess, np.array([0.0, 0.0, 1.0]), turn)
            if found is None:
                return None
        new, jacobian, change, count = found
        # Far from the prediction it is another branch.
        if np.linalg.norm(new - z) > 2.0 * step or _tangent(jacobian, tangent) @ tangent < _COSINE:
            return None
        after = self.tests(change, tangent)
        if before.plus * after.plus < 0.0 and before.minus * after.minus < 0.0:
            return None  # A multiplier passes 1 and -1, or changes its sign through infinity, where an impact grazes.
        state, value = new[:2] * self.sizes[:2], float(new[2] * self.sizes[2])
        if self._kind_of(self.strobe(value, turn), state) != self.kind:
            return None
        return new, jacobian, change, count, at_limit

    def passed(self, walk: _Walk, new: Floats, after: _Tests) -> Iterator[Bifurcation]:
        """Bifurcations between a point and the next one at which the branch goes on."""
        before = walk.tests
        if before.plus * after.plus < 0.0:
            kind = FOLD if before.turn * after.turn < 0.0 else BRANCHES
            yield from self.located(kind, walk, new, lambda tests: tests.plus)
        if before.minus * after.minus < 0.0:
            kind = SYMMETRY if self.by_half else FLIP
            yield from self.located(kind, walk, new, lambda tests: tests.minus)

    def located(
        self, kind: str, walk: _Walk, new: Floats, value_of: Callable[[_Tests], float]
    ) -> Iterator[Bifurcation]:
        """Root of a test function between two points."""
        from scipy.optimize import brentq

        z, tangent, turn = walk.z, walk.tangent, walk.turn
        found: dict[float, Floats] = {}

        def test(length: float) -> float:
            corrected = self.corrected(z + length * tangent, tangent, turn)
            if corrected is None:
                raise _Missed
            at, jacobian, change, _ = corrected
            found[length] = at
            return value_of(self.tests(change, _tangent(jacobian, tangent)))

        try:
            root = brentq(test, 0.0, float(tangent @ (new - z)), xtol=1e-16, rtol=1e-15)
        except (_Missed, ValueError):
            return
        near = sorted(found, key=lambda length: abs(length - root))[:2]
        values = sorted(float(found[length][2] * self.sizes[2]) for length in near)
        yield self.bifurcation(kind, found[near[0]], turn, (values[0], values[-1]))

    def is_parent(self, z: Floats, turn: int) -> bool:
        """Whether a point is of orbits from which this branch came off: of half the period, or symmetric."""
        state, value = z[:2] * self.sizes[:2], float(z[2] * self.sizes[2])
        if self.kind.rests or self.by_half:
            return False
        if self.period % 2 == 0:
            after = self.strobe(value, turn)(state, self.period // 2)
        elif is_mirrored(self.strobe(value, turn)):
            after, _ = self.half(value, turn).mirrored(state, self.period)
        else:
            return False
        return bool(np.max(np.abs(after - state) / self.sizes[:2]) < _SAME)

    def joined(self, walk: _Walk, new: Floats) -> Bifurcation:
        """Bifurcation between two points, of the orbits of half the period, or symmetric ones, that are between."""
        from scipy.optimize import brentq

        even = self.period % 2 == 0
        parent = copy.copy(self)
        parent.period, parent.by_half = (self.period // 2, False) if even else (self.period, True)
        at_value, near, turn = np.array([0.0, 0.0, 1.0]), 0.5 * (walk.z + new), walk.turn
        found: dict[float, Floats] = {}

        def test(value: float) -> float:
            corrected = parent.corrected(np.append(near[:2], value), at_value, turn)
            if corrected is None:
                raise _Missed
            found[value] = corrected[0]
            return float(np.linalg.det(corrected[2] + np.eye(2)))

        for share in _WIDER if even or is_mirrored(self.strobe(self.value, turn)) else ():
            with contextlib.suppress(_Missed, ValueError):
                root = brentq(test, near[2] - share, near[2] + share, xtol=1e-16, rtol=1e-15)
                values = sorted(sorted(found, key=lambda value: abs(value - root))[:2])
                bracket = float(values[0] * self.sizes[2]), float(values[-1] * self.sizes[2])
                return self.bifurcation(FLIP if even else SYMMETRY, found[root], turn, bracket)
        ends = sorted(float(each[2] * self.sizes[2]) for each in (walk.z, new))
        return self.bifurcation(BRANCHES, near, turn, (ends[0], ends[-1]))

    def vanishing(self, walk: _Walk, before: _Course, length: float) -> Bifurcation:
        """Grazing, where the speed of the slowest impact vanishes: extrapolated, for it is hard to come near."""
        z, tangent, turn, course = walk.z, walk.tangent, walk.turn, walk.course
        at, speeds, values = z, list[float](), list[float]()
        back = length * course.slowest / (before.slowest - course.slowest)
        for count in range(_EXTRAPOLATED):
            found = self.corrected(z - count * back * tangent, tangent, turn) if count else None
            at = z if found is None else found[0]
            value, course = self.seen(at, turn)
            if count == 0 or found is not None:
                speeds.append(course.slowest)
                values.append(value)
        estimates = [_at_zero(speeds[:most], values[:most]) for most in range(max(1, len(speeds) - 2), len(speeds) + 1)]
        grazing = self.bifurcation(GRAZING, z, turn, (min(estimates), max(estimates)))
        return grazing._replace(value=estimates[-1])

    def seen(self, z: Floats, turn: int) -> tuple[float, _Course]:
        """Parameter and course at a point of the branch."""
        state, value = z[:2] * self.sizes[:2], float(z[2] * self.sizes[2])
        return value, self.course(response_of(self.strobe(value, turn), state, self.period))

    def bifurcation(self, kind: str, z: Floats, turn: int, bracket: tuple[float, float]) -> Bifurcation:
        """Bifurcation at a point of the branch."""
        value = float(z[2] * self.sizes[2])
        state = self.at_start(z[:2] * self.sizes[:2], value, turn)
        return Bifurcation(kind, value, bracket, orbit_at(self.strobe(value, 0), state, self.period))

    def last(self, kind: str, walk: _Walk) -> Iterator[Bifurcation]:
        """Bifurcation that ends a branch at its last point, if one does."""
        if kind != LOST:
            values = sorted(float((walk.z + step * walk.tangent)[2] * self.sizes[2]) for step in (0.0, walk.ahead))
            yield self.bifurcation(kind, walk.z, walk.turn, (values[0], values[-1]))

    def reason(self, beyond: Floats, tangent: Floats, turn: int, course: _Course) -> str:
        """Name what ends a branch just beyond its last point."""
        if not self.kind.rests and (course.slowest < _GRAZES * self.sizes[1] or course.gap < _GRAZES * self.sizes[0]):
            return GRAZING
        for step in (0.0, *np.geomspace(1e-12, 1e-4, 9)):
            state, value = (beyond + step * tangent)[:2] * self.sizes[:2], (beyond + step * tangent)[2] * self.sizes[2]
            try:
                strobe = self.strobe(float(value), turn)
                found = self._kind_of(strobe, state)
            except RockingError:
                continue
            if np.any(np.isnan(strobe(state, self.period))):
                return OVERTURNING
            if found.for_ever != self.kind.for_ever:
                return UPLIFT
            if found.rests != self.kind.rests:
                return REST if found.rests else CHATTERING
            if found != self.kind:
                return GRAZING
        # A body that rests as before, but not in the same way, has touched or missed something since it lifted.
        return GRAZING if self.kind.rests else LOST

    def course(self, response: Response) -> _Course:
        """Extremes of a period of an orbit."""
        duration = response.duration
        times = np.linspace(0.0, duration, _LOOKS * self.period + 1)
        states = response.states(times)
        impacts = response.impacts
        # A gap is least where the velocity passes zero between impacts.
        ends = np.concatenate([[0.0], impacts["time"], [duration]])
        inner = np.searchsorted(ends, times, side="right")
        v = states[:, 1]
        crossing = np.flatnonzero((v[1:] * v[:-1] < 0.0) & (inner[1:] == inner[:-1]))
        low, high = times[crossing], times[crossing + 1]
        rising = v[crossing] < 0.0
        for _ in range(_REFINED if len(crossing) else 0):
            middle = 0.5 * (low + high)
            before = (response.states(middle)[:, 1] < 0.0) == rising
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        at = response.states(0.5 * (low + high))[:, 0]
        gaps = self.gaps(at, rising)
        open_ = gaps[gaps > 0.0]
        peak = float(np.max(np.abs(np.concatenate([states[:, 0], at]))))
        slowest = float(np.min(impacts["speed_before"])) if len(impacts) else math.inf
        phases = np.mod(impacts["time"], duration / self.period)
        return _Course(peak, slowest, float(np.min(open_)) if len(open_) else math.inf, phases)

    def gaps(self, at: Floats, lowest: Flags) -> Floats:
        """Distances to what a body nearly hits where its coordinate is lowest, or else highest; infinite to nothing."""
        strobe = self.strobe(self.value, 0)
        low, high = strobe.body.stops
        upper = high - at if strobe._is_two_sided else np.full(len(at), math.inf)
        found: Floats = np.where(lowest, at - low, upper)
        return found

    def moved(self, state: Floats, value: float, turn: int, course: _Course) -> tuple[Floats, int]:
        """State at a start of the period that no impact is near, and that start."""
        _, motion = self.family(value)
        starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
        phases = np.mod(course.phases + starts[turn], period)
        if not len(phases):
            return state, turn
        away = np.abs(starts[:, None] - phases)
        nearest = np.min(np.minimum(away, period - away), axis=1)
        best = int(np.argmax(nearest))
        if nearest[turn] > _TOO_NEAR * period or nearest[best] <= nearest[turn]:
            return state, turn
        response = response_of(self.strobe(value, turn), state, self.period)
        return response.states(float(np.mod(starts[best] - starts[turn], period)))[:2], best

    def at_start(self, state: Floats, value: float, turn: int) -> Floats:
        """State at the start of the period as it was given."""
        if turn == 0:
            return state
        _, motion = self.family(value)
        strobe = self.strobe(value, turn)
        time = motion.duration - float(motion.breakpoints[turn])
        return response_of(strobe, state, self.period).states(time)[:2]

    def point(self, z: Floats, turn: int, course: _Course) -> _Point:
        """Point of the branch."""
        state, value = z[:2] * self.sizes[:2], float(z[2] * self.sizes[2])
        _, change = self.strobe(value, turn).derivative(state, self.period)
        return _Point(value, self.at_start(state, value, turn), multipliers_of(change), course.peak)


class _Missed(Exception):
    """There is no point of the branch where one was looked for."""


def _tangent(jacobian: Floats, like: Floats) -> Floats:
    """Return the unit tangent of a branch, in the direction of another."""
    along = np.cross(jacobian[0], jacobian[1])
    size = float(np.linalg.norm(along))
    if size == 0.0:
        return like
    along /= size
    return along if along @ like >= 0.0 else -along


def _at_zero(x: Sequence[float], y: Sequence[float]) -> float:
    """Value at zero of the polynomial through points."""
    weights = [math.prod(b / (b - a) for b in x if b != a) for a in x]
    return float(np.dot(weights, y))


def _turned(motion: Motion, turn: int) -> Motion:
    """One period of a motion that starts some pieces later."""
    if turn == 0:
        return motion
    breaks = motion.breakpoints
    shifted = np.concatenate([breaks[turn:] - breaks[turn], breaks[1 : turn + 1] + (breaks[-1] - breaks[turn])])
    return Motion(
        shifted, np.roll(motion.coefficients, -turn, axis=0), motion.name, motion.description, error=motion.error
    )


def _peak_at(branch: Branch, bifurcation: Bifurcation) -> float:
    """Greatest coordinate of an orbit at a bifurcation: that of the nearest point."""
    away = np.abs(branch.values - bifurcation.value) / max(np.ptp(branch.values), 1e-300)
    size = np.max(np.abs(branch.states), axis=0)
    away = away + np.max(np.abs(branch.states - bifurcation.orbit.state) / np.where(size > 0.0, size, 1.0), axis=1)
    return float(branch.peaks[np.argmin(away)])


def _pair(limits: Sequence[float]) -> Sequence[float]:
    values = checks.several(limits, "limits", InvalidOption)
    if len(values) != 2:
        raise InvalidOption("{} must be (lower, higher)", "limits")
    return values


def _written(multipliers: NDArray[np.complex128]) -> str:
    return ", ".join(cell(float(each.real)) if each.imag == 0.0 else f"{each:.5g}" for each in multipliers)
