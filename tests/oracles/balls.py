"""A proof, in ball arithmetic, of when a chattering sequence ends.

Everything is enclosed: the arcs (closed form in the linear model, Taylor with Lagrange remainder in the
nonlinear one), the impacts (sign change of a concave function), and the infinite rest of the sequence (bounds
on the restoring acceleration over the time that remains). `rest_enclosure` returns a ball that is proven to
hold the time of rest, or raises `UnprovenError`.

Concavity carries the uniqueness of each impact. On side i let u = |theta| and let g(t) be the restoring
acceleration at zero rotation, g >= m > 0. Since u'' <= L u - g(t), with L = p^2 (linear) or p^2 hypot(1, a/g)
(nonlinear), u stays below m / L whenever sqrt(L) v < m. So u'' < 0 and u has exactly one positive root.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, log2
from typing import Protocol

import numpy as np
from flint import arb, arb_poly, ctx

from oracles.problem import Problem

PRECISION = 1600
"""Bits. Balls of time and speed triple in width at each impact, so that some hundred impacts need many."""
LOWEST_ORDER, HIGHEST_ORDER = 12, 240
NARROW = arb(2) ** -64
"""Width (s) at which the enclosure of the time of rest is narrow enough."""
MOST_IMPACTS = 3000


class UnprovenError(AssertionError):
    """A condition of the proof does not hold."""


class Ground(Protocol):
    """Ground acceleration over g: Taylor coefficients about a time, exact up to the end of the piece."""

    def end(self, time: arb) -> arb | None:
        """End of the piece that holds just after `time`; None where there is none."""

    def series(self, time: arb, order: int) -> list[arb]:
        """Coefficients by ascending powers of the time since `time`."""

    def over(self, time: arb, span: arb) -> arb:
        """Enclosure of all values on [time, time + span], within one piece."""


@dataclass(frozen=True)
class Pieces:
    """The piecewise polynomial of a problem, its doubles taken as exact numbers."""

    problem: Problem

    def _piece(self, time: arb) -> tuple[arb, arb_poly]:
        start, end, coefficients = self.problem.piece(_double_below(time))
        if not (time >= arb(start) and (end == np.inf or time < arb(end))):
            raise UnprovenError("an impact cannot be told from a breakpoint of the motion")
        return arb(start), arb_poly([arb(float(c)) / arb(self.problem.gravity) for c in coefficients])

    def end(self, time: arb) -> arb | None:
        end = self.problem.piece(_double_below(time))[1]
        return None if end == np.inf else arb(end)

    def series(self, time: arb, order: int) -> list[arb]:
        start, polynomial = self._piece(time)
        return _coefficients(polynomial, time - start)[:order]

    def over(self, time: arb, span: arb) -> arb:
        start, polynomial = self._piece(time)
        return arb_poly(_coefficients(polynomial, time - start))(arb(0).union(span))


@dataclass(frozen=True)
class Sine:
    """amplitude sin(angular_frequency t + phase) over g, the true sine, without end."""

    amplitude: arb
    angular_frequency: arb
    phase: arb

    def end(self, time: arb) -> None:
        return None

    def series(self, time: arb, order: int) -> list[arb]:
        sine, cosine = (self.angular_frequency * time + self.phase).sin_cos()
        cycle = (sine, cosine, -sine, -cosine)
        factor, coefficients = self.amplitude, []
        for n in range(order):
            coefficients.append(factor * cycle[n % 4])
            factor = factor * self.angular_frequency / (n + 1)
        return coefficients

    def over(self, time: arb, span: arb) -> arb:
        value, slope = self.series(time, 2)
        curvature = abs(self.amplitude) * self.angular_frequency**2 / 2 * span * span
        return value + slope * arb(0).union(span) + _symmetric(curvature)


def sine(problem: Problem, amplitude: float, frequency: float, phase: float = 0.0) -> Sine:
    """amplitude sin(2 pi frequency t + phase), m/s^2 and Hz."""
    with ctx.workprec(PRECISION):
        return Sine(arb(amplitude) / arb(problem.gravity), 2 * arb.pi() * arb(frequency), arb(phase))


def rest_enclosure(problem: Problem, time: float, side: int, speed: float, *, ground: Ground | None = None) -> arb:
    """Ball that holds the instant of rest, from the side entered at an impact and the speed there."""
    with ctx.workprec(PRECISION):
        ground = ground or Pieces(problem)
        t, v = arb(time), arb(speed)
        for _ in range(MOST_IMPACTS):
            remaining = _remaining(problem, ground, t, side, v)
            if remaining is not None and 2 * remaining.rad() < NARROW:
                return t + remaining
            t, w = _arc(problem, ground, t, side, v)
            v = arb(problem.side(side)[2]) * w
            side = -side
        raise UnprovenError(f"no rest within {MOST_IMPACTS} impacts")


def within(rest: arb, lower: float, upper: float) -> bool:
    """Whether a time of rest is proven to lie between two doubles."""
    with ctx.workprec(PRECISION):
        return bool(rest >= arb(lower)) and bool(rest <= arb(upper))


def holds(rest: arb, digits: str) -> bool:
    """Whether a number, in decimal digits, may be the time of rest."""
    with ctx.workprec(PRECISION):
        return bool(rest.overlaps(arb(digits)))


def _double_below(time: arb) -> float:
    """Largest double not above the ball; the ball must not straddle a breakpoint, which `_piece` checks."""
    near = float(time.mid())
    return near if arb(near) <= time else float(np.nextafter(near, -np.inf))


def _coefficients(polynomial: arb_poly, offset: arb) -> list[arb]:
    """Coefficients of the same polynomial about a point further on."""
    return polynomial(arb_poly([offset, arb(1)])).coeffs() or [arb(0)]


def _symmetric(radius: arb) -> arb:
    return (-radius).union(radius)


def _parameters(problem: Problem, side: int) -> tuple[arb, arb, arb]:
    p, alpha, restitution = problem.side(side)
    return arb(p), arb(alpha), arb(restitution)


def _restoring(problem: Problem, side: int, acceleration: arb) -> arb:
    """Restoring acceleration at zero rotation; `acceleration` is over g."""
    p, alpha, _ = _parameters(problem, side)
    if problem.model == "linear":
        return p**2 * (alpha + side * acceleration)
    sine, cosine = alpha.sin_cos()
    return p**2 * (sine + side * acceleration * cosine)


def _stiffness(problem: Problem, side: int, acceleration: arb) -> arb:
    """Bound L of |d u'' / d u|."""
    p = _parameters(problem, side)[0]
    return p**2 if problem.model == "linear" else p**2 * (1 + arb(acceleration.abs_upper()) ** 2).sqrt()


def _over_window(ground: Ground, time: arb, span: arb) -> arb:
    """Enclosure of the acceleration on [time, time + span] across the pieces of the motion."""
    total = None
    for begin, length in _stretches(ground, time, span):
        values = ground.over(begin, length)
        total = values if total is None else total.union(values)
    return total


def _stretches(ground: Ground, time: arb, span: arb) -> Iterator[tuple[arb, arb]]:
    """Parts of [time, time + span], each within one piece of the motion."""
    last = time + span
    while True:
        end = ground.end(time)
        if end is None or last < end:
            yield time, last - time
            return
        yield time, end - time
        time = end


def _remaining(problem: Problem, ground: Ground, time: arb, side: int, v: arb) -> arb | None:
    """Ball that holds the time from here to rest, by bounds over a window; None where they prove nothing.

    Per arc: (2 / sqrt L) atanh(sqrt L v / m) bounds the length from above and, with M = sup g, 2 v / M
    (linear) or (2 / sqrt L) atan(sqrt L v / M) from below. The speed at the end, w, obeys
    |w^2 - v^2| <= 2 D U, where U <= v^2 / m is the peak and D the spread of g (linear) or of p^2 a / g
    (nonlinear). So each pair of arcs multiplies the speed by a factor between q_low and q_high, and the sums
    are geometric (atanh is convex and x / (1 + x^2) <= atan x).
    """
    here, there = (_restoring(problem, i, _at(ground, time)) for i in (side, -side))
    e_here, e_there = (_parameters(problem, i)[2] for i in (side, -side))
    if not (here > 0 and there > 0):
        return None
    window = 2 * (2 * v / here + 2 * e_here * v / there) / (1 - e_here * e_there)
    window = arb(window.upper())
    acceleration = _over_window(ground, time, window)
    first = _pair_half(problem, side, acceleration, v)
    if first is None:
        return None
    second = _pair_half(problem, -side, acceleration, e_here * first.speed)
    if second is None:
        return None
    q = e_here * e_there * first.growth * second.growth
    if not q < 1:
        return None
    lower = (first.lower + second.lower).lower() / (1 - q.lower())
    upper = (first.upper + second.upper).upper() / (1 - q.upper())
    if not upper < window:
        return None
    return arb(lower).union(arb(upper))


@dataclass(frozen=True)
class _Half:
    """One arc of the first pair: bounds whose geometric sums bound all later arcs on that side."""

    lower: arb
    upper: arb
    speed: arb
    growth: arb


def _pair_half(problem: Problem, side: int, acceleration: arb, v: arb) -> _Half | None:
    g = _restoring(problem, side, acceleration)
    m, M = arb(g.lower()), arb(g.upper())
    stiffness = _stiffness(problem, side, acceleration)
    root = stiffness.sqrt()
    fast, slow = arb(v.upper()), arb(v.lower())
    if not (m > 0 and root * fast < m and slow > 0):
        return None
    spread = M - m if problem.model == "linear" else _spread(problem, side, acceleration)
    change = 2 * spread / m
    if not change < 1:
        return None
    growth = (1 - change).sqrt().union((1 + change).sqrt())
    upper = 2 / root * (root * fast / m).atanh()
    x = root * slow / M
    lower = 2 * slow / M if problem.model == "linear" else 2 * slow / M / (1 + x**2)
    return _Half(lower, upper, v * growth, growth)


def _spread(problem: Problem, side: int, acceleration: arb) -> arb:
    return _parameters(problem, side)[0] ** 2 * (arb(acceleration.upper()) - arb(acceleration.lower()))


def _at(ground: Ground, time: arb) -> arb:
    return ground.series(time, 1)[0]


def _arc(problem: Problem, ground: Ground, time: arb, side: int, v: arb) -> tuple[arb, arb]:
    """Balls of the time of the next impact and of the speed there."""
    _prove_concave(problem, ground, time, side, v)
    u = arb(0)
    while True:
        span = _longest_step(problem, ground, time, side, u, v)
        flow = _flow(problem, ground, time, side, u, v, span)
        rotation, rate = flow.at(span)
        if rotation < 0:
            s = _root(flow, span)
            return time + s, -flow.at(s)[1]
        if not rotation > 0:
            raise UnprovenError("an impact cannot be told from a breakpoint of the motion")
        end = ground.end(time)
        time = end if end is not None and (end - time - span).contains(0) else time + span
        u, v = rotation, rate


def _prove_concave(problem: Problem, ground: Ground, time: arb, side: int, v: arb) -> None:
    """The arc ends within a window over which the restoring acceleration holds it concave."""
    here = _restoring(problem, side, _at(ground, time))
    if not here > 0:
        raise UnprovenError("the ground does not press the block down at an impact")
    window = arb((3 * v / here).upper())
    acceleration = _over_window(ground, time, window)
    m = arb(_restoring(problem, side, acceleration).lower())
    root = _stiffness(problem, side, acceleration).sqrt()
    fast = arb(v.upper())
    if not (m > 0 and root * fast < m and 2 / root * (root * fast / m).atanh() < window):
        raise UnprovenError("an arc cannot be shown to be concave")


def _longest_step(problem: Problem, ground: Ground, time: arb, side: int, u: arb, v: arb) -> arb:
    """To the end of the piece, of the arc with some margin, or of the reach of the series."""
    end = ground.end(time)
    candidates = [arb(1) / 4 / _parameters(problem, side)[0]]
    here = _restoring(problem, side, _at(ground, time))
    if here > 0:
        late = (v + (v**2 + 2 * u * here).sqrt()) / here
        candidates.append(arb((late * arb("1.3")).mid()))
    if end is not None:
        candidates.append(end - time)
    shortest = candidates[0]
    for candidate in candidates[1:]:
        shortest = candidate if candidate < shortest else shortest
    return shortest


@dataclass(frozen=True)
class _Flow:
    """u(s) and u'(s): Taylor polynomials and a ball r that holds u^(n) / n! all along the step."""

    rotation: arb_poly
    rate: arb_poly
    order: int
    remainder: arb

    def at(self, s: arb) -> tuple[arb, arb]:
        n = self.order
        return self.rotation(s) + self.remainder * s**n, self.rate(s) + n * self.remainder * s ** (n - 1)


def _flow(problem: Problem, ground: Ground, time: arb, side: int, u: arb, v: arb, span: arb) -> _Flow:
    """Taylor polynomial about the start; remainder from the same recurrence over a box that holds the arc.

    The box needs no fixed-point argument: |u''| <= K on all of it, with K = p^2 (|u| + alpha + |a/g|) bounded
    through Gronwall in the linear model and K = p^2 hypot(1, a/g) in the nonlinear one.
    """
    order = _order(problem, side, span)
    push = [side * a for a in ground.series(time, order)]
    series = _grow(problem, side, u, v, push, order)
    step = arb(0).union(span)
    acceleration = ground.over(time, span)
    u_box, v_box = _box(problem, side, u, v, acceleration, span)
    push_box = [side * a for a in _series_box(ground, time, step, order)]
    box = _grow(problem, side, u_box, v_box, push_box, order)
    n = len(series) - 1
    return _Flow(arb_poly(series[:n]), arb_poly(series[:n]).derivative(), n, box[n])


def _order(problem: Problem, side: int, span: arb) -> int:
    """Order at which the remainder falls below the precision, for a series in powers of p s."""
    reach = log2(1.0 / float((problem.side(side)[0] * span).upper()))
    return min(max(LOWEST_ORDER, ceil(PRECISION / reach)), HIGHEST_ORDER)


def _series_box(ground: Ground, time: arb, step: arb, order: int) -> list[arb]:
    """Taylor coefficients of the acceleration about every instant of the step."""
    if isinstance(ground, Sine):
        return ground.series(time + step, order)
    return _coefficients(arb_poly(ground.series(time, order)), step)


def _box(problem: Problem, side: int, u: arb, v: arb, acceleration: arb, span: arb) -> tuple[arb, arb]:
    p, alpha, _ = _parameters(problem, side)
    if problem.model == "linear":
        force = p**2 * (alpha + acceleration.abs_upper())
        growth = (p * span).cosh()
        size = (abs(u) + abs(v) * span + force * span**2) * growth
        K = p**2 * size + force
    else:
        K = _stiffness(problem, side, acceleration)
    K = arb(K.upper())
    return u + v * arb(0).union(span) + _symmetric(K * span**2 / 2), v + _symmetric(K * span)


def _grow(problem: Problem, side: int, u: arb, v: arb, push: list[arb], order: int) -> list[arb]:
    p, alpha, _ = _parameters(problem, side)
    series = [u, v]
    if problem.model == "linear":
        for n in range(order):
            force = series[n] - (push[n] if n < len(push) else 0) - (alpha if n == 0 else 0)
            series.append(p**2 * force / ((n + 1) * (n + 2)))
        return series
    S, C = [(alpha - u).sin()], [(alpha - u).cos()]
    weighted = [v]
    for n in range(order):
        force = S[n] + _dot(push, C, n)
        series.append(-(p**2) * force / ((n + 1) * (n + 2)))
        S.append(-_dot(weighted, C, n) / (n + 1))
        C.append(_dot(weighted, S, n) / (n + 1))
        weighted.append((n + 2) * series[n + 2])
    return series


def _dot(first: list[arb], second: list[arb], n: int) -> arb:
    """Coefficient n of the product of two series."""
    total = arb(0)
    for k in range(min(n + 1, len(first))):
        total += first[k] * second[n - k]
    return total


def _root(flow: _Flow, span: arb) -> arb:
    """Ball that holds the one root in (0, span]: Newton from its far side, then a proven sign change."""
    s = span.mid()
    for _ in range(60):
        rotation, rate = flow.at(s)
        step = (rotation / rate).mid() if rate < 0 else s / 2
        s = (s - step).mid()
        if abs(step) < s * arb(2) ** (-PRECISION // 2):
            break
    rotation, rate = flow.at(s)
    radius = arb(2 * (rotation / rate).abs_upper()) + s * arb(2) ** (8 - PRECISION)
    low, high = s - radius, s + radius
    if not (flow.at(low)[0] > 0 and flow.at(high)[0] < 0 and low > 0):
        raise UnprovenError("no sign change around an impact")
    return low.union(high)
