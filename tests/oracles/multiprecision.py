"""The same motion in 60-digit arithmetic: arcs by Taylor series, impacts by Newton, the end of chattering.

The intervals of a chattering sequence that stays within one piece of the motion are, two impacts at a time, a
series in the powers of e+ e- (the return map is analytic and its multiplier at rest is e+ e-). Extrapolation
that removes one power after the other therefore gives the time of rest to full precision after few impacts.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpmath import MPContext

from oracles.problem import Problem

mp = MPContext()
mp.dps = 60
SETTLED = mp.mpf("1e-32")
NEGLIGIBLE = mp.mpf("1e-56")
ROUNDED = mp.mpf("1e-14")
HIGHEST_ORDER = 90
GRID = np.unique(np.concatenate([[0.0], 2.0 ** -np.arange(1.0, 60.0), np.linspace(0.0, 1.0, 257)]))
"""Where series are first looked at, in shares of a span: an arc can end long before its series loses reach."""

Number = Any
"""An mpf of the context above."""


@dataclass
class Course:
    """What happened, in mpf: (time, kind, side), (time, side entered, speed before, speed after), peak."""

    events: list[tuple[Number, str, int]] = field(default_factory=list)
    impacts: list[tuple[Number, int, Number, Number]] = field(default_factory=list)
    peak: Number = 0


def follow(problem: Problem, *, rotation: float = 0.0, velocity: float = 0.0, most_impacts: int = 4000) -> Course:
    """Whole response from time zero until the block rests for good or overturns."""
    course = Course()
    side = int(np.sign(rotation) or np.sign(velocity))
    time, u, v = mp.mpf(0), mp.mpf(abs(rotation)), mp.mpf(side * velocity)
    while True:
        if side == 0:
            time, side = _next_uplift(problem, time)
            if side == 0:
                return course
            course.events.append((time, "uplift", side))
            u = v = mp.mpf(0)
        time, overturned = _rock(problem, course, time, side, u, v, most_impacts)
        if overturned:
            return course
        course.events.append((time, "rest", 0))
        side = 0


def rest_time(problem: Problem, time: float, side: int, speed: float, *, most_impacts: int = 4000) -> Number:
    """Instant at which the impacts accumulate, from the side entered at an impact and the speed there."""
    course = Course()
    rest, overturned = _rock(problem, course, mp.mpf(time), side, mp.mpf(0), mp.mpf(speed), most_impacts)
    if overturned:
        raise AssertionError("the block overturns instead of coming to rest")
    return rest


def _rock(
    problem: Problem, course: Course, time: Number, side: int, u: Number, v: Number, most_impacts: int
) -> tuple[Number, bool]:
    """Follow arcs and impacts until rest (True: overturning) and say when."""
    tail = _Tail(mp.mpf(problem.restitution[0]) * mp.mpf(problem.restitution[1]))
    if u == 0 and v > 0:
        tail.add(problem.piece(_below(time))[1], time)
    for n in range(most_impacts):
        time, w, overturned = _arc(problem, course, time, side, u, v)
        if overturned:
            course.events.append((time, "overturn", side))
            return time, True
        u, v = mp.mpf(0), mp.mpf(problem.side(side)[2]) * w
        side = -side
        course.impacts.append((time, side, w, v))
        if n % 2 == 1:
            rest = tail.add(problem.piece(_below(time))[1], time)
            if rest is not None and min(problem.restoring(float(rest), i) for i in (1, -1)) > 0.0:
                return rest, False
    raise AssertionError(f"no rest within {most_impacts} impacts")


class _Tail:
    """Extrapolation of every second impact time within one piece of the motion."""

    def __init__(self, ratio: Number) -> None:
        self.ratio = ratio
        self.piece_end: float = -np.inf
        self.row: list[Number] = []

    def add(self, piece_end: float, time: Number) -> Number | None:
        """Take one more impact time; the limit of the sequence once it is settled and within the piece."""
        if piece_end != self.piece_end:
            self.piece_end, self.row = piece_end, []
        previous, self.row = self.row, [time]
        power = mp.mpf(1)
        for older in previous:
            power *= self.ratio
            self.row.append((self.row[-1] - power * older) / (1 - power))
        if len(self.row) < 4:
            return None
        changes = [abs(self.row[k] - self.row[k - 1]) for k in (-1, -2)]
        settled = max(changes) < SETTLED and self.row[-1] < self.piece_end
        return self.row[-1] if settled else None


def _below(time: Number) -> float:
    """Largest double not above `time`: the piece that holds at a rounded time must not be the next one."""
    near = float(time)
    return near if near <= time else float(np.nextafter(near, -np.inf))


def _arc(
    problem: Problem, course: Course, time: Number, side: int, u: Number, v: Number
) -> tuple[Number, Number, bool]:
    """End of an arc, the speed there, and whether the block overturned."""
    while True:
        series, span = _series(problem, time, side, u, v)
        impact = _first_root(series if u != 0 else series[1:], span)
        overturn = _first_root([mp.pi / 2 - series[0], *(-c for c in series[1:])], span)
        _note_peak(course, series, span if impact is None else impact)
        if overturn is not None and (impact is None or overturn < impact):
            course.peak = mp.pi / 2
            return time + overturn, _slope(series, overturn), True
        if impact is not None:
            return time + impact, -_slope(series, impact), False
        time, u, v = time + span, _value(series, span), _slope(series, span)
        time = _onto_breakpoint(problem, time)


def _onto_breakpoint(problem: Problem, time: Number) -> Number:
    nearest = problem.breakpoints[np.argmin(np.abs(problem.breakpoints - float(time)))]
    return mp.mpf(float(nearest)) if abs(time - float(nearest)) < mp.mpf("1e-50") else time


def _series(problem: Problem, time: Number, side: int, u: Number, v: Number) -> tuple[list[Number], Number]:
    """Taylor coefficients of |theta| about `time`, and a span on which they give it to all digits."""
    p, alpha, _ = (mp.mpf(x) for x in problem.side(side))
    start, end, coefficients = problem.piece(_below(time))
    push = [side * a / mp.mpf(problem.gravity) for a in _shifted(coefficients, time - mp.mpf(start))]
    span = min(mp.mpf(end) - time, 1 / (2 * p))
    restoring = _restoring(problem.model, p, alpha, push[0])
    if u == 0 and v > 0 and restoring > 0:
        span = min(span, 3 * v / restoring)
    grow = _grow_linear if problem.model == "linear" else _grow_nonlinear
    series = grow(p, alpha, push, u, v, span)
    while _size(series, span, -1) > NEGLIGIBLE * _scale(series, span):
        span /= 2
    return series, span


def _size(series: list[Number], span: Number, k: int) -> Number:
    n = len(series)
    return abs(series[k]) * span ** (n + k) + abs(series[k - 1]) * span ** (n + k - 1)


def _scale(series: list[Number], span: Number) -> Number:
    return max(abs(c) * span**n for n, c in enumerate(series[:4]))


def _restoring(model: str, p: Number, alpha: Number, push: Number) -> Number:
    if model == "linear":
        return p * p * (alpha + push)
    return p * p * (mp.sin(alpha) + push * mp.cos(alpha))


def _shifted(coefficients: Any, offset: Number) -> list[Number]:
    """Coefficients of the same polynomial about a point further on (repeated Horner division)."""
    shifted = [mp.mpf(float(c)) for c in coefficients]
    n = len(shifted)
    for first in range(n - 1):
        for k in range(n - 2, first - 1, -1):
            shifted[k] += offset * shifted[k + 1]
    return shifted


def _enough(series: list[Number], span: Number) -> bool:
    return len(series) > 6 and _size(series, span, -1) < NEGLIGIBLE * _scale(series, span)


def _grow_linear(p: Number, alpha: Number, push: list[Number], u: Number, v: Number, span: Number) -> list[Number]:
    series = [u, v]
    for n in range(HIGHEST_ORDER):
        force = series[n] - (push[n] if n < len(push) else 0) - (alpha if n == 0 else 0)
        series.append(p * p * force / ((n + 1) * (n + 2)))
        if n >= len(push) and _enough(series, span):
            break
    return series


def _grow_nonlinear(p: Number, alpha: Number, push: list[Number], u: Number, v: Number, span: Number) -> list[Number]:
    """u'' = -p^2 (S + push C) with S = sin(alpha - u), C = cos(alpha - u), S' = -C u', C' = S u'."""
    series, S, C = [u, v], [mp.sin(alpha - u)], [mp.cos(alpha - u)]
    for n in range(HIGHEST_ORDER):
        force = S[n] + mp.fsum(push[k] * C[n - k] for k in range(min(n + 1, len(push))))
        series.append(-p * p * force / ((n + 1) * (n + 2)))
        S.append(-mp.fsum(C[n - k] * (k + 1) * series[k + 1] for k in range(n + 1)) / (n + 1))
        C.append(mp.fsum(S[n - k] * (k + 1) * series[k + 1] for k in range(n + 1)) / (n + 1))
        if n >= len(push) and _enough(series, span):
            break
    return series


def _value(series: list[Number], s: Number) -> Number:
    total = mp.mpf(0)
    for c in reversed(series):
        total = total * s + c
    return total


def _slope(series: list[Number], s: Number) -> Number:
    return _value([n * c for n, c in enumerate(series)][1:], s)


def _first_root(series: list[Number], span: Number) -> Number | None:
    """First sign change from positive of a series on (0, span], found in double and then polished."""
    for low, high in _fallings(series, span):
        beyond = _beyond(series, high)
        if beyond is not None:
            return _polished(series, low, beyond)
    return None


def _beyond(series: list[Number], high: Number) -> Number | None:
    """The end of an interval, or a point hardly after it where the root is so close that double sees it before."""
    for end in (high, high * (1 + ROUNDED)):
        if _value(series, end) <= 0:
            return end
    return None


def _fallings(series: list[Number], span: Number) -> list[tuple[Number, Number]]:
    """Intervals of the grid over which a series falls from positive to zero or below, in double."""
    scaled = [c * span**n for n, c in enumerate(series)]
    size = max(abs(c) for c in scaled)
    values = np.polynomial.polynomial.polyval(GRID, [float(c / size) for c in scaled])
    values[0] = 1.0 if values[1] > 0.0 else values[0]
    falling = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    return [(mp.mpf(float(GRID[k])) * span, mp.mpf(float(GRID[k + 1])) * span) for k in falling]


def _polished(series: list[Number], low: Number, high: Number) -> Number:
    """Newton kept inside a bracket; past 35 digits one more step doubles them."""
    enough = mp.mpf("1e-35") * high
    root = (low + high) / 2
    for _ in range(400):
        value = _value(series, root)
        low, high = (root, high) if value > 0 else (low, root)
        slope = _slope(series, root)
        following = root - value / slope if slope != 0 else low
        if abs(following - root) <= enough:
            return following - _value(series, following) / _slope(series, following)
        root = following if low < following < high else (low + high) / 2
    raise AssertionError("no convergence on a root")


def _note_peak(course: Course, series: list[Number], span: Number) -> None:
    course.peak = max(course.peak, series[0], _value(series, span))
    rate = [n * c for n, c in enumerate(series)][1:]
    for low, high in _fallings(rate, span):
        beyond = _beyond(rate, high)
        if beyond is not None:
            course.peak = max(course.peak, _value(series, _polished(rate, low, beyond)))


def _next_uplift(problem: Problem, time: Number) -> tuple[Number, int]:
    """First passing of a threshold: the double-precision root, polished."""
    near, side = problem.next_uplift(_below(time))
    if side == 0:
        return mp.inf, 0
    start, _, coefficients = problem.piece(near)
    excess = [-side * mp.mpf(float(c)) for c in coefficients]
    excess[0] -= _threshold(problem, side)
    root = mp.mpf(near) - mp.mpf(start)
    if near == start and excess[0] > 0:
        return mp.mpf(near), side
    for _ in range(8):
        root -= _value(excess, root) / _slope(excess, root)
    return max(time, mp.mpf(start) + root), side


def _threshold(problem: Problem, side: int) -> Number:
    alpha = mp.mpf(problem.side(side)[1])
    return mp.mpf(problem.gravity) * (alpha if problem.model == "linear" else mp.tan(alpha))
