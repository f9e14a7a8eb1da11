"""A whole analysis of a block under samples by leapfrog steps that are extrapolated, compiled by numba.

Nothing is shared with the package: the unknown is the rotation with its sign, theta'' = -p^2 (W sin(s alpha - theta) +
A cos(s alpha - theta)) with s = 1 or -1 for the side, W = 1 + a_v/g and A = a/g; samples are joined here; arcs are cut
at samples and where the acceleration changes its sign, so that each step is a convex or a concave curve, whose crossing
of zero Newton's method finds from the side where it converges steadily.

The leapfrog scheme has an error in even powers of its step (Gragg 1965; Hairer, Norsett and Wanner, Solving Ordinary
Differential Equations I, II.14). The same span in one, two, three ... steps is extrapolated to the step zero by the
rule of Aitken and Neville, until one more row changes nothing that counts.

A block rests once an impact leaves it slower than a billionth of alpha p, while it is pressed down on both sides.
"""

from dataclasses import dataclass
from math import cos, pi, sin, tan

import numba
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

GRAVITY = 9.80665
OVERTURNED = pi / 2.0
ROWS = 10
"""Of an extrapolation; a span that needs more is halved."""
CLOSE = 2e-14
"""A row that changes the result by less than this share is the last: the next one would change it by far less."""
LONGEST = 0.25
"""Length of a step, times p, where no sample ends it before."""
SLOW = 1e-9
"""Of alpha p: a block slower than that after an impact rests."""
MOST_STEPS = 1_000_000
NEWTON = 80
STANDS, FELL, LOST = 0, 1, 2

_compiled = numba.njit(cache=True, error_model="numpy")


@dataclass(frozen=True)
class Outcome:
    """Whether the block overturned, its peak rotation in size (rad), the numbers of its impacts and rests."""

    overturned: bool
    peak: float
    impacts: int
    rests: int


def follow(
    model: str,
    p: tuple[float, float],
    alpha: tuple[float, float],
    restitution: tuple[float, float],
    step: float,
    across: Floats,
    up: Floats,
    *,
    finer: int = 1,
) -> Outcome:
    """Follow a block from rest at the first sample until it rests for good, or overturns.

    ``across`` and ``up`` are accelerations in m/s^2 at the same instants, ``step`` s apart, and nothing after the last;
    pairs are of side + and side -. The weight must not come to zero. Steps are ``finer`` times as
    short as they need be.
    """
    if not np.all(up > -GRAVITY):
        raise ValueError("the weight comes to zero")
    sides = np.array([p, alpha, restitution])
    code, peak, impacts, rests = _follow(
        model == "linear", sides, step, across / GRAVITY, 1.0 + up / GRAVITY, finer, np.empty((2, ROWS))
    )
    if code == LOST:
        raise AssertionError(f"no end within {MOST_STEPS} steps")
    return Outcome(code == FELL, peak, impacts, rests)


@_compiled
def _angular(linear, p, lean, theta, push, weight):
    """Angular acceleration, rad/s^2; lean is the slenderness with the sign of the side."""
    if linear:
        return -p * p * (weight * (lean - theta) + push)
    return -p * p * (weight * sin(lean - theta) + push * cos(lean - theta))


@_compiled
def _step(linear, p, lean, theta, v, ground, span, rows):
    """Changes of theta and of its rate over a span, and whether they are settled.

    ``ground`` is push, its rate, weight and its rate. What is extrapolated is theta - theta0 - v0 t, and v - v0.
    """
    push, push_rate, weight, weight_rate = ground
    first = _angular(linear, p, lean, theta, push, weight)
    # What rounding leaves of terms that cancel.
    noise = 1e-15 * p * p * (abs(weight * lean) + abs(push)) * span
    for k in range(ROWS):
        count = k + 1
        h = span / count
        moved, faster = 0.0, 0.5 * h * first
        for m in range(1, count + 1):
            moved += h * faster
            s = h * m if m < count else span
            f = _angular(linear, p, lean, theta + v * s + moved, push + push_rate * s, weight + weight_rate * s)
            faster += h * f if m < count else 0.5 * h * f
        before_moved, before_faster = rows[0, 0], rows[1, 0]
        rows[0, k], rows[1, k] = moved, faster
        for j in range(1, k + 1):
            ratio = (count / (count - j)) ** 2 - 1.0
            for n in range(2):
                rows[n, k - j] = rows[n, k - j + 1] + (rows[n, k - j + 1] - rows[n, k - j]) / ratio
        if k >= 2:
            moved_enough = abs(rows[0, 0] - before_moved) <= CLOSE * (abs(rows[0, 0]) + abs(v * span)) + noise * span
            faster_enough = abs(rows[1, 0] - before_faster) <= CLOSE * (abs(rows[1, 0]) + abs(v)) + noise
            if moved_enough and faster_enough:
                return v * span + rows[0, 0], rows[1, 0], True
    return 0.0, 0.0, False


@_compiled
def _after(linear, p, lean, theta, v, ground, span, rows):
    """Rotation, rate and acceleration after a span, which is known to be settled."""
    moved, faster, _ = _step(linear, p, lean, theta, v, ground, span, rows)
    push, push_rate, weight, weight_rate = ground
    f = _angular(linear, p, lean, theta + moved, push + push_rate * span, weight + weight_rate * span)
    return theta + moved, v + faster, f


@_compiled
def _turning(linear, p, lean, theta, v, ground, span, rows):
    """When the rate, which changes its sign once over a span, is zero: Newton's method inside a bracket."""
    low, high, at = 0.0, span, span
    for _ in range(NEWTON):
        _, rate, f = _after(linear, p, lean, theta, v, ground, at, rows)
        if rate * v > 0.0:
            low = at
        else:
            high = at
        following = at - rate / f
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - at) <= 1e-15 * span:
            return following
        at = following
    return at


@_compiled
def _bending(linear, p, lean, theta, v, ground, span, rows):
    """About when the acceleration, which changes its sign over a span, is zero: secants that keep the bracket."""
    low, high = 0.0, span
    at_low = _after(linear, p, lean, theta, v, ground, low, rows)[2]
    at_high = _after(linear, p, lean, theta, v, ground, high, rows)[2]
    at = high
    for _ in range(8):
        at = high - at_high * (high - low) / (at_high - at_low)
        f = _after(linear, p, lean, theta, v, ground, at, rows)[2]
        if f == 0.0:
            break
        if f * at_high > 0.0:
            high, at_high, at_low = at, f, 0.5 * at_low
        else:
            low, at_low, at_high = at, f, 0.5 * at_high
    return at


@_compiled
def _landing(linear, p, lean, theta, v, ground, start, rows):
    """When the rotation is zero, and the rate then: Newton's method from where it converges steadily."""
    at = start
    for _ in range(NEWTON):
        there, rate, _ = _after(linear, p, lean, theta, v, ground, at, rows)
        change = there / rate
        at -= change
        if abs(change) <= 1e-15 * at:
            break
    return at, _after(linear, p, lean, theta, v, ground, at, rows)[1]


@_compiled
def _excess(linear, alpha, sign, push, weight):
    """By how much the motion passes the threshold of a side: a straight line from sample to sample."""
    return -sign * push - weight * (alpha if linear else tan(alpha))


@_compiled
def _uplift(linear, sides, ground, since, until):
    """When a threshold is first passed within a sample, and the side; zero if none is."""
    best, side = until, 0
    push, push_rate, weight, weight_rate = ground
    for k in range(2):
        sign = 1 - 2 * k
        low = _excess(linear, sides[1, k], sign, push, weight)
        high = _excess(
            linear, sides[1, k], sign, push + push_rate * (until - since), weight + weight_rate * (until - since)
        )
        at = since if low > 0.0 else until if high <= 0.0 else since + (until - since) * low / (low - high)
        if at < best:
            best, side = at, sign
    return best, side


@_compiled
def _ground(pushes, weights, step, k, since):
    """Push, its rate, weight and its rate at a time since a sample, and the time up to the next."""
    if k >= len(pushes) - 1:
        return (0.0, 0.0, 1.0, 0.0), np.inf
    push_rate, weight_rate = (pushes[k + 1] - pushes[k]) / step, (weights[k + 1] - weights[k]) / step
    return (pushes[k] + push_rate * since, push_rate, weights[k] + weight_rate * since, weight_rate), step - since


@_compiled
def _span(linear, p, lean, theta, v, ground, span, rising, rows):
    """Length of a step up to a span that is settled and bends one way, and how: above 0 towards side +."""
    here = _angular(linear, p, lean, theta, ground[0], ground[2])
    if theta == 0.0 and v != 0.0 and lean * here < 0.0:
        span = min(span, 3.0 * abs(v / here))
    moved, _, settled = _step(linear, p, lean, theta, v, ground, span, rows)
    while not settled:
        span *= 0.5
        moved, _, settled = _step(linear, p, lean, theta, v, ground, span, rows)
    push, weight = ground[0] + ground[1] * span, ground[2] + ground[3] * span
    there = _angular(linear, p, lean, theta + moved, push, weight)
    if not rising and here * there < 0.0:
        bend = _bending(linear, p, lean, theta, v, ground, span, rows)
        # A change of sign at the start, but for rounding, is none.
        if bend > 1e-9 * span:
            return bend, here
    return span, here + there


@_compiled
def _ending(linear, p, lean, theta, v, ground, span, bends, rows):
    """From where Newton's method finds the impact within a step that bends one way, if any, and the top within it."""
    side = 1.0 if lean > 0.0 else -1.0
    there, rate, _ = _after(linear, p, lean, theta, v, ground, span, rows)
    height, up, down, top = side * there, side * v, side * rate, 0.0
    turns = up * down < 0.0
    lowest = height
    if turns:
        at = _turning(linear, p, lean, theta, v, ground, span, rows)
        turn = side * _after(linear, p, lean, theta, v, ground, at, rows)[0]
        top, lowest = (turn, height) if up > 0.0 else (0.0, turn)
    if (side * bends < 0.0 or (turns and up > 0.0)) and height < 0.0:
        return span, top
    if side * bends >= 0.0 and up < 0.0 and lowest < 0.0:
        return 0.0, top
    return np.nan, top


@_compiled
def _rests(linear, sides, v, push, weight):
    """Whether a block that an impact leaves at that rate is at rest, and pressed down on both sides."""
    beyond = max(_excess(linear, sides[1, 0], 1, push, weight), _excess(linear, sides[1, 1], -1, push, weight))
    return beyond < 0.0 and abs(v) < SLOW * min(sides[0, 0] * sides[1, 0], sides[0, 1] * sides[1, 1])


@_compiled
def _follow(linear, sides, step, pushes, weights, finer, rows):
    k, since, rising = 0, 0.0, False
    side, theta, v, peak = 0, 0.0, 0.0, 0.0
    impacts, rests = 0, 0
    for _ in range(MOST_STEPS):
        ground, left = _ground(pushes, weights, step, k, since)
        if left <= 0.0:
            k, since, rising = k + 1, 0.0, False
            continue
        if side == 0:
            if left == np.inf:
                return STANDS, peak, impacts, rests
            at, side = _uplift(linear, sides, ground, since, step)
            # A straight line that has passed the threshold is beyond it up to the next sample.
            rising, since = at > since, at
            continue
        index = 0 if side > 0 else 1
        p, lean = sides[0, index], side * sides[1, index]
        most = min(left, LONGEST / (p * finer), step / finer if k < len(pushes) - 1 else np.inf)
        span, bends = _span(linear, p, lean, theta, v, ground, most, rising, rows)
        landing = np.nan
        if not rising:
            landing, top = _ending(linear, p, lean, theta, v, ground, span, bends, rows)
            peak = max(peak, top)
        if not np.isnan(landing):
            at, rate = _landing(linear, p, lean, theta, v, ground, landing, rows)
            since, theta, v, side, impacts = since + at, 0.0, rate * sides[2, index], -side, impacts + 1
            if _rests(linear, sides, v, ground[0] + ground[1] * at, ground[2] + ground[3] * at):
                side, v, rests = 0, 0.0, rests + 1
            continue
        theta, v, _ = _after(linear, p, lean, theta, v, ground, span, rows)
        peak = max(peak, abs(theta))
        if peak >= OVERTURNED:
            return FELL, peak, impacts, rests
        since += span
        if span >= left:
            k, since, rising = k + 1, 0.0, False
    return LOST, peak, impacts, rests
