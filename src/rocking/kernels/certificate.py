"""The chattering certificate: complete chattering proven for any motion, with a bracket on the time of rest.

At an impact the block enters side i with speed v. Over a window, side j's restoring acceleration at zero rotation

    g_j(t) = gain_j (threshold_j W(t) + j a(t)/g),    W = 1 + a_v/g,

stays within [m_j, M_j]. Comparison of the arc with two of constant acceleration bounds its duration and its height,
energy bounds the next impact's speed, and a geometric sum bounds all that follows. The derivation is in the
documentation ("Theory").
"""

import math
from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.arc import restoring, sign_of, weight_series
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import (
    ROUNDING,
    Ground,
    Window,
    bounds_over,
    columns_of,
    has_vertical,
    length_of,
    local_series,
    start_of,
    vertical_of,
)
from rocking.kernels.remaining import Restoring, deviation, refined_bracket, remaining_time
from rocking.kernels.state import Record

#: Window of the proof over the first estimate of the remaining time.
_WINDOW = 1.5


class Bounds(NamedTuple):
    """What is known of one side over a window.

    The restoring acceleration at zero rotation stays within [least, greatest] and changes by at most ``stiff`` per unit
    of rotation; what the motion adds to it changes by at most ``swing``, and within a time by at most ``rate`` times
    that time and ``leap``.
    """

    stiff: float
    least: float
    greatest: float
    swing: float
    rate: float
    leap: float


@inlined
def geometric_bracket(v: float, first: Bounds, second: Bounds, e_i: float, e_j: float) -> tuple[float, float]:
    """Lower and upper bound on the time to rest, for bounds that hold as long as needed; NaN, NaN: no proof.

    ``first`` bounds the side that the block enters, ``second`` the other one.
    """
    change_i, shortest_i, longest_i = arc_bounds(v, first)
    fastest = e_i * math.sqrt(1.0 + change_i) * v
    slowest = e_i * math.sqrt(max(0.0, 1.0 - change_i)) * v
    change_j, _, longest_j = arc_bounds(fastest, second)
    _, shortest_j, _ = arc_bounds(slowest, second)
    most = fastest / v * e_j * math.sqrt(1.0 + change_j) * (1.0 + ROUNDING)
    least = slowest / v * e_j * math.sqrt(max(0.0, 1.0 - change_j)) * (1.0 - ROUNDING)
    if not most < 1.0:
        return np.nan, np.nan
    lower = (shortest_i + shortest_j) / (1.0 - least)
    upper = (longest_i + longest_j) / (1.0 - most)
    return lower * (1.0 - ROUNDING), upper * (1.0 + ROUNDING)


@inlined
def arc_bounds(v: float, bounds: Bounds) -> tuple[float, float, float]:
    """Bounds on one arc of initial speed v: (|w^2/v^2 - 1| for its impact speed w, duration from, to); NaN: none.

    The durations (2/sqrt(stiff)) atan(x), atanh(x), with x = sqrt(stiff) v/greatest and /least, are replaced by the
    rational bounds x - x^3/3 and x + x^3/(3 (1 - x^2)), which need no transcendental function.
    """
    stiff, m, M, swing, rate, leap = bounds
    if not (m > 0.0 and stiff * v * v < m * m):
        return np.nan, np.nan, np.nan
    squared = stiff * v * v / (m * m)
    shortest = 2.0 * v / M * (1.0 - stiff * v * v / (3.0 * M * M))
    longest = 2.0 * v / m * (1.0 + squared / (3.0 * (1.0 - squared)))
    change = 2.0 * min(swing, rate * longest + leap) / (m * (1.0 + math.sqrt(1.0 - squared)))
    return change, shortest, longest


class Proof(NamedTuple):
    """Bounds on the time to rest from an impact, the likeliest time, and a bound on all rotations until then.

    All NaN where nothing is proven.
    """

    lower: float
    upper: float
    time: float
    height: float


@inlined
def unproven() -> Proof:
    """No proof."""
    return Proof(np.nan, np.nan, np.nan, np.nan)


@shared
def prove_rest(ground: Ground, block: Record, rules: Record, scratch: Record, state: Record) -> Proof:
    """Bracket on the time to rest from an impact just passed."""
    v, i = state.v, state.side
    j = block.entered[i]
    e_i, e_j = block.restitution[i], block.restitution[j]
    g_i = restoring(ground, block, i, state.piece, state.offset)
    g_j = restoring(ground, block, j, state.piece, state.offset)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0 and abs(block.stiffness[i]) * v * v < g_i * g_i):
        return unproven()
    window = _WINDOW * 2.0 * v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)
    # The rounding of the times decides on which side of a jump of the motion the window ends.
    doubt = ROUNDING * (start_of(ground, state.piece) + state.offset)
    motion = bounds_on_motion(ground, block, state, window + doubt, scratch)
    first = side_bounds(block, rules, i, motion)
    second = side_bounds(block, rules, j, motion)
    lower, upper = geometric_bracket(v, first, second, e_i, e_j)
    if not upper <= window:
        return unproven()
    least, swing = min(first.least, second.least), max(first.swing, second.swing)
    height = v * v * (1.0 + 2.0 * swing / least) / least
    if has_vertical(ground) and not is_low(block, height):
        return unproven()
    local_series(ground, state.piece, state.offset, 1.0, clear(scratch.ground))
    weight_series(ground, state.piece, state.offset, clear(scratch.weight))
    seen_up_to = Seen(motion, ground.error, columns_of(ground), upper, height)
    one = side_here(block, rules, i, scratch, seen_up_to)
    other = side_here(block, rules, j, scratch, seen_up_to)
    if upper - lower > rules.tolerance and upper + doubt <= length_of(ground, state.piece) - state.offset:
        finer = refined_bracket(v, one, other, upper)
        if finer[1] >= finer[0]:
            lower, upper = max(lower, finer[0]), min(upper, finer[1])
            return Proof(lower, upper, 0.5 * (lower + upper), height)
    return Proof(lower, upper, min(max(remaining_time(v, one, other), lower), upper), height)


class Bounded(NamedTuple):
    """Bounds on both components of the motion over a window; the vertical one adds to a weight of 1."""

    horizontal: Window
    vertical: Window


@inlined
def bounds_on_motion(ground: Ground, block: Record, state: Record, window: float, scratch: Record) -> Bounded:
    """Bounds on the motion from a state on, its error included; NaN where it passes a threshold."""
    lifts = Window(0.0, 0.0, 0.0, 0.0)
    if has_vertical(ground):
        upright = bounds_over(vertical_of(ground), state.piece, state.offset, window, (-1.0, np.inf), scratch.ground)
        lifts = disturbed(upright, ground.error)
    weight = 1.0 + lifts.high
    limits = (-block.threshold[0] * weight, block.threshold[1] * weight)
    pushes = bounds_over(ground, state.piece, state.offset, window, limits, scratch.ground)
    return Bounded(disturbed(pushes, ground.error), lifts)


@inlined
def is_low(block: Record, height: float) -> bool:
    """Whether rotations up to a height leave the weight's part of the restoring acceleration below that at zero."""
    return height <= 2.0 * min(block.slenderness[0], block.slenderness[1])


class Seen(NamedTuple):
    """What is known of the time to come.

    Bounds on the motion, its error and the number of its coefficients, how long that holds, the highest rotation.
    """

    motion: Bounded
    error: float
    columns: int
    window: float
    height: float


@inlined
def side_here(block: Record, rules: Record, j: int, scratch: Record, seen: Seen) -> Restoring:
    """Side j as seen from an impact: its restoring acceleration as a parabola in time, a stiffness, and what is left.

    ``scratch`` holds the ground acceleration and the weight about the impact.
    """
    A, W = scratch.ground, scratch.weight
    sign, gain, threshold, lam = sign_of(j), block.gain[j], block.threshold[j], block.stiffness[j]
    horizontal, vertical = seen.motion
    error = seen.error + beyond_parabola(A, seen)
    # Where next to nothing presses the block down, weight and push cancel, and the rounding of both stays.
    error += ROUNDING * (threshold * (1.0 + largest(vertical)) + largest(horizontal))
    weighs = vertical.high > vertical.low
    lift = seen.error + beyond_parabola(W, seen) if weighs else 0.0
    sway = vertical.slope * seen.window + 2.0 * seen.error if weighs else 0.0
    if not rules.nonlinear:
        stiffness = lam * W[0]
        error = gain * (error + threshold * lift)
        if weighs:
            error = deviation(error, abs(lam) * sway, 0.0, seen.height)
    else:
        sine, cosine = block.sine[j], block.cosine[j]
        stiffness = lam * (cosine * W[0] - sign * A[0] * sine)
        drift = lam * (sine * (horizontal.slope * seen.window + 2.0 * seen.error) + cosine * sway)
        bend = lam * math.hypot(heaviest(vertical), largest(horizontal))
        error = deviation(lam * (error + lift), drift, bend, seen.height)
    g = gain * (threshold * W[0] + sign * A[0])
    rate, curvature = gain * (sign * A[1]), gain * (sign * A[2]) if seen.columns > 2 else 0.0
    if weighs:
        rate += gain * threshold * W[1]
        curvature += gain * threshold * W[2]
    return Restoring(g, rate, curvature, stiffness, block.restitution[j], error)


@inlined
def beyond_parabola(A: Floats, seen: Seen) -> float:
    """Bound on what a polynomial holds beyond degree 2."""
    beyond = 0.0
    for k in range(seen.columns - 1, 2, -1):
        beyond = (beyond + abs(A[k])) * seen.window
    return beyond * seen.window * seen.window


@inlined
def clear(A: Floats) -> Floats:
    """Set the lowest coefficients of a polynomial to zero, and return it."""
    A[0] = A[1] = A[2] = 0.0
    return A


@inlined
def disturbed(motion: Window, error: float) -> Window:
    """Bounds on a motion that differs from a bounded one by at most ``error`` at any time."""
    return Window(motion.low - error, motion.high + error, motion.slope, motion.jumps + 2.0 * error)


@inlined
def largest(motion: Window) -> float:
    """Largest size of an acceleration."""
    return max(abs(motion.low), abs(motion.high))


@inlined
def heaviest(lifts: Window) -> float:
    """Largest size of the weight."""
    return max(1.0 + lifts.high, -(1.0 + lifts.low))


@inlined
def side_bounds(block: Record, rules: Record, j: int, motion: Bounded) -> Bounds:
    """Bounds on side j, rounding included, for bounds on the motion."""
    horizontal, vertical = motion
    sign, threshold = sign_of(j), block.threshold[j]
    light, heavy = threshold * (1.0 + vertical.low), threshold * (1.0 + vertical.high)
    one, other = sign * horizontal.low, sign * horizontal.high
    strongest, weight = largest(horizontal), heaviest(vertical)
    slack = ROUNDING * (threshold * weight + strongest)
    # A rotation changes both models' stiffness and, in the nonlinear one, what the motion adds (at most p^2 a/g).
    stiff = abs(block.stiffness[j]) * (math.hypot(weight, strongest) if rules.nonlinear else weight) * (1.0 + ROUNDING)
    push = (block.stiffness[j] if rules.nonlinear else block.gain[j]) * (1.0 + ROUNDING)
    # What weight adds is largest at zero rotation (`is_low`).
    lift = block.gain[j] * threshold * (1.0 + ROUNDING)
    return Bounds(
        stiff,
        block.gain[j] * (light + min(one, other) - slack),
        block.gain[j] * (heavy + max(one, other) + slack),
        push * (horizontal.high - horizontal.low) + lift * (vertical.high - vertical.low),
        push * horizontal.slope + lift * vertical.slope,
        push * horizontal.jumps + lift * vertical.jumps,
    )
