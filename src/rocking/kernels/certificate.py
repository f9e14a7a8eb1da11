"""The chattering certificate: complete chattering proven for any motion, with a bracket on the time of rest.

At an impact the block enters side i with speed v. Over a window, side j's restoring acceleration at zero rotation

    g_j(t) = gain_j (threshold_j + j a(t)/g)

stays within [m_j, M_j]. Comparison of the arc with two of constant acceleration bounds its duration and its height,
energy bounds the next impact's speed, and a geometric sum bounds all that follows. The derivation is in the
documentation ("Theory").
"""

import math
from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.arc import restoring, sign_of
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import (
    ROUNDING,
    Ground,
    Window,
    acceleration,
    bounds_over,
    columns_of,
    length_of,
    local_series,
    start_of,
)
from rocking.kernels.remainder import deviation, refined_bracket
from rocking.kernels.remaining import Restoring, remaining_time
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
    here = acceleration(ground, state.piece, state.offset)
    g_i, g_j = restoring(block, i, here), restoring(block, j, here)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0 and abs(block.stiffness[i]) * v * v < g_i * g_i):
        return unproven()
    window = _WINDOW * 2.0 * v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)
    # The rounding of the times decides on which side of a jump of the motion the window ends.
    doubt = ROUNDING * (start_of(ground, state.piece) + state.offset)
    limits = (-block.threshold[0], block.threshold[1])
    seen = bounds_over(ground, state.piece, state.offset, window + doubt, limits, scratch.ground)
    motion = disturbed(seen, ground.error)
    first = side_bounds(block, rules, i, motion)
    second = side_bounds(block, rules, j, motion)
    lower, upper = geometric_bracket(v, first, second, e_i, e_j)
    if not upper <= window:
        return unproven()
    local_series(ground, state.piece, state.offset, 1.0, clear(scratch.ground))
    least, swing = min(first.least, second.least), max(first.swing, second.swing)
    height = v * v * (1.0 + 2.0 * swing / least) / least
    seen_up_to = Seen(motion, ground.error, upper, height)
    one = side_here(block, rules, i, scratch.ground, columns_of(ground), seen_up_to)
    other = side_here(block, rules, j, scratch.ground, columns_of(ground), seen_up_to)
    if upper - lower > rules.tolerance and upper + doubt <= length_of(ground, state.piece) - state.offset:
        finer = refined_bracket(v, one, other, upper)
        if finer[1] >= finer[0]:
            lower, upper = max(lower, finer[0]), min(upper, finer[1])
            return Proof(lower, upper, 0.5 * (lower + upper), height)
    return Proof(lower, upper, min(max(remaining_time(v, one, other), lower), upper), height)


class Seen(NamedTuple):
    """What is known of the time to come: bounds on the motion, its error, how long they hold, the highest rotation."""

    motion: Window
    error: float
    window: float
    height: float


@inlined
def side_here(block: Record, rules: Record, j: int, A: Floats, columns: int, seen: Seen) -> Restoring:
    """Side j as seen from an impact: its restoring acceleration as a parabola in time, a stiffness, and what is left.

    ``A`` holds the ground acceleration about the impact.
    """
    push = block.gain[j] * sign_of(j)
    beyond = 0.0
    for k in range(columns - 1, 2, -1):
        beyond = (beyond + abs(A[k])) * seen.window
    error = seen.error + beyond * seen.window * seen.window
    if not rules.nonlinear:
        stiffness, error = block.stiffness[j], block.gain[j] * error
    else:
        lam, sine = block.stiffness[j], block.sine[j]
        stiffness = lam * (block.cosine[j] - sign_of(j) * A[0] * sine)
        largest = max(abs(seen.motion.low), abs(seen.motion.high))
        drift = lam * sine * (seen.motion.slope * seen.window + 2.0 * seen.error)
        error = deviation(lam * error, drift, lam * math.hypot(1.0, largest), seen.height)
    g = block.gain[j] * (block.threshold[j] + sign_of(j) * A[0])
    return Restoring(g, push * A[1], push * A[2] if columns > 2 else 0.0, stiffness, block.restitution[j], error)


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
def side_bounds(block: Record, rules: Record, j: int, motion: Window) -> Bounds:
    """Bounds on side j, rounding included, for bounds on the motion."""
    sign = sign_of(j)
    one = block.threshold[j] + sign * motion.low
    other = block.threshold[j] + sign * motion.high
    largest = max(abs(motion.low), abs(motion.high))
    slack = ROUNDING * (block.threshold[j] + largest)
    # A rotation changes both models' stiffness and, in the nonlinear one, what the motion adds (at most p^2 a/g).
    stiff = abs(block.stiffness[j]) * (math.hypot(1.0, largest) if rules.nonlinear else 1.0) * (1.0 + ROUNDING)
    push = (block.stiffness[j] if rules.nonlinear else block.gain[j]) * (1.0 + ROUNDING)
    m = block.gain[j] * (min(one, other) - slack)
    M = block.gain[j] * (max(one, other) + slack)
    return Bounds(stiff, m, M, push * (motion.high - motion.low), push * motion.slope, push * motion.jumps)
