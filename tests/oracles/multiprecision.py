"""The same motion in 60-digit arithmetic: arcs by Taylor series, impacts by Newton, the end of chattering.

A series about a time converges at least in the disc of radius R in which Picard's iteration keeps the rotation within
one radian of its value at the centre: so its coefficients are at most 1/R^n (Cauchy), whatever terms vanish, and it
is carried on until what is left out counts for nothing.

The intervals of a chattering sequence that stays within one piece of the motion are, two impacts at a time, a
series in the powers of e+ e- (the return map is analytic and its multiplier at rest is e+ e-). Extrapolation
that removes one power after the other therefore gives the time of rest to full precision after few impacts.

Numbers are midpoints of Arb's balls, which are several times as fast as mpmath's; what is returned is mpmath's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, log, log2
from operator import mul
from typing import Any

import numpy as np
from flint import arb, ctx
from mpmath import MPContext
from numpy.typing import NDArray

from oracles.problem import Problem

DIGITS = 60
mp = MPContext()
mp.dps = DIGITS
ROUNDED = 2.0**-44
HIGHEST_ORDER = 400
MOST_STEPS = 20_000
GRID = np.unique(np.concatenate([[0.0], 2.0 ** -np.arange(1.0, 60.0), np.linspace(0.0, 1.0, 257)]))
"""Where series are first looked at, in shares of a span: an arc can end long before its series loses reach."""
POWERS = GRID[:, np.newaxis] ** np.arange(HIGHEST_ORDER + 2)
FINER = 64
"""Into so many parts an interval of the grid is divided where a curve may dip below zero between its ends."""

Number = Any
"""An mpf of the context above in what is returned; an arb of radius zero elsewhere."""


@dataclass
class Course:
    """What happened, in mpf: (time, kind, side), (time, side entered, speed before and after), peak up to each rest.

    And the rotation at the times that were asked for, but for those at rest.
    """

    events: list[tuple[Number, str, int]] = field(default_factory=list)
    impacts: list[tuple[Number, int, Number, Number]] = field(default_factory=list)
    peaks: list[Number] = field(default_factory=list)
    states: dict[float, tuple[Number, Number]] = field(default_factory=dict)
    """Rotation and velocity at the times that were asked for, where the block then moved."""

    @property
    def peak(self) -> Number:
        return max(self.peaks, default=mp.mpf(0))

    @property
    def overturned(self) -> bool:
        return bool(self.events) and self.events[-1][1] == "overturn"


def follow(
    problem: Problem,
    *,
    rotation: float = 0.0,
    velocity: float = 0.0,
    most_impacts: int = 4000,
    closest: float = inf,
    slack: float = 0.0,
    digits: int = DIGITS,
    reach: float = 0.125,
    at: Sequence[float] = (),
) -> Course:
    """Whole response from time zero until the block rests for good or overturns.

    Impacts of a sequence are followed until less than `closest` seconds are left of it, and its limit is known. A
    threshold counts as passed once the motion is beyond it by `slack` of it; `reach` is the length of steps over the
    radius of convergence; `at` are times whose states are noted.
    """
    with ctx.workdps(digits):
        return _Follower(problem, most_impacts, closest, slack, reach, at).whole(rotation, velocity)


def rest_time(
    problem: Problem, time: float, side: int, speed: float, *, most_impacts: int = 4000, digits: int = DIGITS
) -> Number:
    """Instant at which the impacts accumulate, from the side entered at an impact and the speed there."""
    with ctx.workdps(digits):
        follower = _Follower(problem, most_impacts)
        rest, overturned = follower.rock(arb(time), side, arb(0), arb(speed))
        if overturned:
            raise AssertionError("the block overturns instead of coming to rest")
        return _told(rest)


def _told(x: arb) -> Number:
    mantissa, exponent = x.mid().man_exp()
    return mp.mpf((int(mantissa), int(exponent)))


def _digits(share: float) -> arb:
    """10 to the minus so many of the digits."""
    return arb(10) ** -int(share * ctx.dps)


class _Follower:
    """One block under one motion."""

    def __init__(
        self,
        problem: Problem,
        most_impacts: int,
        closest: float = inf,
        slack: float = 0.0,
        reach: float = 0.125,
        at: Sequence[float] = (),
    ) -> None:
        self.problem = problem
        self.most_impacts = most_impacts
        self.closest = closest
        self.slack = slack
        self.reach = reach
        self.at = at
        self.course = Course()
        self.peak = arb(0)
        self.linear = problem.model == "linear"
        self.gravity = arb(problem.gravity)
        self.fallen = (arb.pi() / 2).mid()

    def whole(self, rotation: float, velocity: float) -> Course:
        side = int(np.sign(rotation) or np.sign(velocity))
        time, u, v = arb(0), arb(abs(rotation)), arb(side * velocity)
        overturned = False
        while not overturned:
            if side == 0:
                found = self.next_uplift(time)
                if found is None:
                    break
                time, side = found
                self.note(time, "uplift", side)
                u = v = arb(0)
            self.peak = arb(0)
            time, overturned = self.rock(time, side, u, v)
            if not overturned:
                self.note(time, "rest", 0)
            self.course.peaks.append(mp.pi / 2 if overturned else _told(self.peak))
            side = 0
        return self.course

    def note(self, time: arb, kind: str, side: int) -> None:
        self.course.events.append((_told(time), kind, side))

    def rock(self, time: arb, side: int, u: arb, v: arb) -> tuple[arb, bool]:
        """Follow arcs and impacts until rest (True: overturning) and say when."""
        tail = _Tail(arb(self.problem.restitution[0]) * arb(self.problem.restitution[1]))
        if u == 0 and v > 0:
            tail.add(self.problem.piece(_below(time))[1], time)
        for n in range(self.most_impacts):
            time, w, overturned = self.arc(time, side, u, v)
            if overturned:
                self.note(time, "overturn", side)
                return time, True
            u, v = arb(0), (arb(self.problem.side(side)[2]) * w).mid()
            side = -side
            self.course.impacts.append((_told(time), side, _told(w), _told(v)))
            if n % 2 == 1:
                rest = tail.add(self.problem.piece(_below(time))[1], time)
                if rest is not None and float(rest - time) < self.closest and self.is_pressed(rest):
                    return rest, False
        raise AssertionError(f"no rest within {self.most_impacts} impacts")

    def is_pressed(self, time: arb) -> bool:
        """Whether the ground presses the block down on both sides."""
        push, weight, _ = self.motion(time)
        return all(self.restoring(side, [side * push[0]], weight) > 0 for side in (1, -1))

    def arc(self, time: arb, side: int, u: arb, v: arb) -> tuple[arb, arb, bool]:
        """End of an arc, the speed there, and whether the block overturned."""
        for _ in range(MOST_STEPS):
            series, span, end = self.series(time, side, u, v)
            most = sum((abs(c) * span**n for n, c in enumerate(series)), arb(0))
            impact = _first_root(series if u != 0 else series[1:], span)
            overturn = None
            if most >= self.fallen:
                overturn = _first_root([self.fallen - series[0], *(-c for c in series[1:])], span)
            ends = min((root for root in (impact, overturn) if root is not None), default=span)
            for each in self.at:
                since = arb(each) - time
                if 0 <= since <= ends:
                    self.course.states[each] = _told(side * _value(series, since)), _told(side * _slope(series, since))
            if overturn is not None and (impact is None or overturn < impact):
                return (time + overturn).mid(), _slope(series, overturn), True
            if not most <= self.peak:
                self.note_peak(series, span if impact is None else impact)
            if impact is not None:
                return (time + impact).mid(), -_slope(series, impact), False
            u, v = _value(series, span), _slope(series, span)
            time = (time + span).mid() if end is None else end
        raise AssertionError(f"neither impact nor fall within {MOST_STEPS} steps")

    def motion(self, time: arb) -> tuple[list[arb], list[arb], arb | None]:
        """Push and weight, over those of gravity, about a time, and the end of what they hold for."""
        near = _below(time)
        start, end, coefficients = self.problem.piece(near)
        since, _, lifts = self.problem.vertical_piece(near)
        push = [c / self.gravity for c in _shifted(coefficients, time - arb(start))]
        weight = [c / self.gravity for c in _shifted(lifts, time - arb(since))]
        weight[0] += 1
        return push, weight, None if end == inf else arb(end)

    def restoring(self, side: int, push: list[arb], weight: list[arb]) -> arb:
        p, alpha, _ = (arb(x) for x in self.problem.side(side))
        if self.linear:
            return p * p * (weight[0] * alpha + push[0])
        return p * p * (weight[0] * alpha.sin() + push[0] * alpha.cos())

    def series(self, time: arb, side: int, u: arb, v: arb) -> tuple[list[arb], arb, arb | None]:
        """Taylor coefficients of |theta|, a span on which they give it to all digits, and its end if a piece ends."""
        push, weight, end = self.motion(time)
        push = [side * a for a in push]
        radius = self.radius(side, push, weight, u, v, 64.0 if end is None else float(end - time))
        span = arb(self.reach * radius)
        if u == 0 and v > 0:
            restoring = self.restoring(side, push, weight)
            if restoring > 0:
                span = min(span, (3 * v / restoring).mid())
        if end is not None and end - time <= span:
            span = (end - time).mid()
        else:
            end = None
        grow = self.grow_linear if self.linear else self.grow_nonlinear
        p, alpha, _ = (arb(x) for x in self.problem.side(side))
        series = grow(p * p, alpha, push, weight, u, v, _Remainder(span, radius))
        return [c.mid() for c in series], span, end

    def radius(self, side: int, push: list[arb], weight: list[arb], u: arb, v: arb, longest: float) -> float:
        """Radius of a disc about a time in which the rotation stays within a radian of its value at the centre."""
        p, alpha, _ = self.problem.side(side)
        pushes, weights = ([abs(float(c)) for c in series] for series in (push, weight))
        arm = 1.0 + abs(alpha - float(u)) if self.linear else 1.55  # cosh(1) bounds both |sin| and |cos|
        arms = 1.0 if self.linear else 1.55
        speed = abs(float(v))
        radius = min(longest, 4.0 / p) / self.reach
        while True:
            most = arm * _horner(weights, radius) + arms * _horner(pushes, radius)
            if speed * radius + 0.5 * p * p * most * radius * radius <= 0.99:
                return float(radius)
            radius *= 0.8

    @staticmethod
    def grow_linear(
        stiffness: arb, alpha: arb, push: list[arb], weight: list[arb], u: arb, v: arb, remainder: "_Remainder"
    ) -> list[arb]:
        """u'' = -p^2 (W (alpha - u) + A)."""
        series, arms = [u, v], [alpha - u, -v]
        for n in range(HIGHEST_ORDER):
            if remainder.is_negligible(series):
                return series
            force = sum(map(mul, weight, arms[n::-1]), push[n] if n < len(push) else arb(0))
            series.append(-stiffness * force / ((n + 1) * (n + 2)))
            arms.append(-series[-1])
        raise AssertionError("a series does not converge")

    @staticmethod
    def grow_nonlinear(
        stiffness: arb, alpha: arb, push: list[arb], weight: list[arb], u: arb, v: arb, remainder: "_Remainder"
    ) -> list[arb]:
        """u'' = -p^2 (W S + A C) with S = sin(alpha - u), C = cos(alpha - u), S' = -C u', C' = S u'."""
        series, rates, S, C = [u, v], [v], [(alpha - u).sin()], [(alpha - u).cos()]
        for n in range(HIGHEST_ORDER):
            if remainder.is_negligible(series):
                return series
            force = sum(map(mul, weight, reversed(S)), sum(map(mul, push, reversed(C)), arb(0)))
            series.append(-stiffness * force / ((n + 1) * (n + 2)))
            sine, cosine = (sum(map(mul, rates, reversed(terms)), arb(0)) / (n + 1) for terms in (C, S))
            S.append(-sine)
            C.append(cosine)
            rates.append((n + 2) * series[-1])
        raise AssertionError("a series does not converge")

    def note_peak(self, series: list[arb], span: arb) -> None:
        self.peak = max(self.peak, series[0], _value(series, span))
        rate = _derivative(series)
        for low, high in _fallings(rate, span):
            beyond = _beyond(rate, high)
            if beyond is not None and beyond <= span:
                self.peak = max(self.peak, _value(series, _polished(rate, low, beyond)))

    def next_uplift(self, time: arb) -> tuple[arb, int] | None:
        """First passing of a threshold and its side; None when there is none any more.

        Both are passed at once where nothing weighs the block down: then the push chooses the side, or else it is +.
        """
        while True:
            push, weight, end = self.motion(time)
            if end is None:
                return None
            passings = {side: _passing(self.excess(side, push, weight), end - time) for side in (1, -1)}
            passed = [side for side in passings if passings[side] is not None]
            if passed:
                first = min(passed, key=lambda side: float(passings[side]))
                after = passings[first]
                if len(passed) == 2 and abs(passings[1] - passings[-1]) <= _digits(0.5) * (end - time):
                    first = _pushed_side(push, after, end - time)
                # A little later than the root: just before it, rounding would let the block fall back at once.
                return (time + after * (1 + _digits(0.8))).mid(), first
            time = end

    def excess(self, side: int, push: list[arb], weight: list[arb]) -> list[arb]:
        """By how much the motion passes a side's threshold, as a polynomial."""
        alpha = arb(self.problem.side(side)[1])
        threshold = alpha if self.linear else alpha.tan()
        count = max(len(push), len(weight))
        pushes, weights = ([*series, *[arb(0)] * (count - len(series))] for series in (push, weight))
        excess = [-side * a - threshold * w for a, w in zip(pushes, weights, strict=True)]
        excess[0] -= arb(self.slack) * threshold
        return [c.mid() for c in excess]


class _Remainder:
    """Whether what a series leaves out counts, given that its coefficients are at most 1/radius^n."""

    def __init__(self, span: arb, radius: float) -> None:
        self.span, self.ratio = float(span), log(float(span) / radius)
        self.wanted = -ctx.dps * log(10.0)
        self.largest = 0.0
        self.power = 1.0
        self.order = 0

    def is_negligible(self, series: list[arb]) -> bool:
        """Of the velocity times the span; beside its largest term, or beside (a digit to the power of) two."""
        count = len(series)
        left_out = count * self.ratio + log(2.0 * (count + 1))
        if left_out > self.wanted:  # no term is larger than one
            return False
        while self.order < count - 1:
            self.order += 1
            self.power *= self.span
            self.largest = max(self.largest, self.order * abs(float(series[self.order])) * self.power)
        return left_out <= max(self.wanted + log(self.largest) if self.largest > 0.0 else -inf, 2.5 * self.wanted)


class _Tail:
    """Extrapolation of every second impact time within one piece of the motion."""

    def __init__(self, ratio: arb) -> None:
        self.ratio = ratio
        self.piece_end: float = -np.inf
        self.row: list[arb] = []

    def add(self, piece_end: float, time: arb) -> arb | None:
        """Take one more impact time; the limit of the sequence once it is settled and within the piece."""
        if piece_end != self.piece_end:
            self.piece_end, self.row = piece_end, []
        previous, self.row = self.row, [time]
        power = arb(1)
        for older in previous:
            power *= self.ratio
            self.row.append(((self.row[-1] - power * older) / (1 - power)).mid())
        if len(self.row) < 4:
            return None
        changes = [abs(self.row[k] - self.row[k - 1]) for k in (-1, -2)]
        settled = max(changes) < _digits(8 / 15) and self.row[-1] < self.piece_end
        return self.row[-1] if settled else None


def _below(time: arb) -> float:
    """Largest double not above `time`: the piece that holds at a rounded time must not be the next one."""
    near = float(time)
    return near if near <= time else float(np.nextafter(near, -np.inf))


def _shifted(coefficients: NDArray[np.float64], offset: arb) -> list[arb]:
    """Coefficients of the same polynomial about a point further on (repeated Horner division)."""
    shifted = [arb(float(c)) for c in coefficients]
    n = len(shifted)
    if offset == 0:
        return shifted
    for first in range(n - 1):
        for k in range(n - 2, first - 1, -1):
            shifted[k] += offset * shifted[k + 1]
    return shifted


def _horner(coefficients: list[float], x: float) -> float:
    total = 0.0
    for c in reversed(coefficients):
        total = total * x + c
    return total


def _derivative(series: list[arb]) -> list[arb]:
    return [n * c for n, c in enumerate(series)][1:]


def _value(series: Sequence[arb], s: arb) -> arb:
    total = arb(0)
    for c in reversed(series):
        total = total * s + c
    return total.mid()


def _slope(series: list[arb], s: arb) -> arb:
    return _value(_derivative(series), s)


def _first_root(series: list[arb], span: arb) -> arb | None:
    """First sign change from positive of a series on (0, span], found in double and then polished."""
    for low, high in _fallings(series, span):
        beyond = _beyond(series, high)
        if beyond is not None and beyond <= span:
            return _polished(series, low, beyond)
    # Double may not see a root that is next to the end.
    return _polished(series, arb(0), span) if _value(series, span) <= 0 < series[0] else None


def _beyond(series: list[arb], high: arb) -> arb | None:
    """The end of an interval, or a point hardly after it where the root is so close that double sees it before."""
    for end in (high, (high * (1 + ROUNDED)).mid()):
        if _value(series, end) <= 0:
            return end
    return None


def _fallings(series: list[arb], span: arb) -> list[tuple[arb, arb]]:
    """Intervals over which a series falls from positive to zero or below, in double."""
    scaled = [c * span**n for n, c in enumerate(series)]
    size = max(abs(c) for c in scaled)
    if size == 0:
        return []
    doubles = np.array([float(c / size) for c in scaled])
    values = POWERS[:, : len(doubles)] @ doubles
    values[0] = 1.0 if values[1] > 0.0 else values[0]
    grid, values = _refined(doubles, values)
    falling = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    return [(arb(float(grid[k])) * span, (arb(float(grid[k + 1])) * span).mid()) for k in falling]


def _refined(doubles: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], Any]:
    """Add points where a curve that is positive at both ends of an interval may, by its curvature, dip between."""
    n = np.arange(len(doubles))
    bend = float(np.sum(n * (n - 1) * np.abs(doubles)))
    least = np.minimum(values[:-1], values[1:])
    widths = np.diff(GRID)
    doubtful = np.flatnonzero((least > 0.0) & (least <= 0.125 * bend * widths**2))
    if len(doubtful) == 0:
        return GRID, values
    shares = np.arange(1, FINER) / FINER
    points = (GRID[doubtful, np.newaxis] + widths[doubtful, np.newaxis] * shares).ravel()
    grid = np.concatenate([GRID, points])
    order = np.argsort(grid, kind="stable")
    return grid[order], np.concatenate([values, np.polynomial.polynomial.polyval(points, doubles)])[order]


def _polished(series: list[arb], low: arb, high: arb) -> arb:
    """Newton kept inside a bracket; past half the digits one more step doubles them."""
    enough = _digits(0.58) * high
    rate = _derivative(series)
    low = (low * (1 - ROUNDED)).mid()  # where double may have seen a root too early
    root = ((low + high) / 2).mid()
    for _ in range(int(8 * log2(10.0) * ctx.dps)):
        value = _value(series, root)
        low, high = (root, high) if value > 0 else (low, root)
        slope = _value(rate, root)
        following = (root - value / slope).mid() if slope != 0 else low
        if abs(following - root) <= enough:
            slope = _value(rate, following)
            return (following - _value(series, following) / slope).mid() if slope != 0 else following
        root = following if low < following < high else ((low + high) / 2).mid()
    raise AssertionError("no convergence on a root")


def _passing(excess: list[arb], span: arb) -> arb | None:
    """First time in [0, span) from which a polynomial is positive; None when there is none."""
    span = span.mid()
    sizes = [abs(c) * span**n for n, c in enumerate(excess)]
    nothing = _digits(0.8) * max(1, *sizes)
    leading = [c for c, size in zip(excess, sizes, strict=True) if size > nothing]
    if not leading:
        return None
    if leading[0] > 0:
        return arb(0)
    gap = [-c if size > nothing else arb(0) for c, size in zip(excess, sizes, strict=True)]
    while gap[0] == 0:
        gap = gap[1:]
    root = _first_root(gap, span)
    return root if root is not None and root < span else None


def _pushed_side(push: list[arb], after: arb, span: arb) -> int:
    """Side to which the motion pushes from some time on."""
    here = list(push)
    for first in range(len(here) - 1):
        for k in range(len(here) - 2, first - 1, -1):
            here[k] += after * here[k + 1]
    sizes = [abs(c) * span**n for n, c in enumerate(here)]
    for c, size in zip(here, sizes, strict=True):
        if size > _digits(0.5) * max(sizes):
            return -1 if c > 0 else 1
    return 1
