"""Chattering certificate: proof of complete chattering under any motion, with a bracket on the time of rest.

At an impact the block enters side i with speed v. During a window, the restoring acceleration of side j at zero
rotation

    g_j(t) = gain_j (threshold_j W(t) + j a(t)/g),    W = 1 + a_v/g,

stays within [m_j, M_j]. Two arcs of constant acceleration bound the duration and height of the arc, energy bounds the
speed of the next impact, and a geometric sum all later arcs. See "Theory" in the documentation. NaN arguments result in
NaN, no proof.
"""

import math
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.arc import restoring, sign_of, weight_series
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.events import least_factor, middle_factor
from rocking.kernels.ground import (
    ROUNDING,
    Ground,
    Window,
    bounds_over,
    has_vertical,
    length_of,
    local_series,
    start_of,
    vertical_of,
)
from rocking.kernels.remaining import Pair, Restoring, deviation, refined_bracket, remaining_time
from rocking.kernels.restraints import may_change_below
from rocking.kernels.state import Record

#: Window of the proof divided by the first estimate of the remaining time.
_WINDOW = 1.5

#: With damping: bound on every speed until rest divided by the first, valid for this bound on the energy gained in the
#: first two arcs.
_FASTEST = 1.5
_GAINED = 2.25


class Bounds(NamedTuple):
    """Bounds on one side during a window.

    The restoring acceleration at zero rotation stays within [least, greatest] and changes by at most ``stiffness`` per
    unit of rotation. The motion changes it by at most ``change``, and within a time by at most ``rate`` times that time
    plus ``jumps``.
    """

    stiffness: float
    least: float
    greatest: float
    change: float
    rate: float
    jumps: float


@inlined
def geometric_bracket(v: float, first: Bounds, second: Bounds, e: Pair, least_e: Pair) -> tuple[float, float]:
    """Compute a lower and an upper bound on the time to rest if the bounds hold that long; NaN, NaN: no proof.

    ``first`` bounds the side entered, ``second`` the other; ``e``, ``least_e``: largest, smallest restitution on
    leaving.
    """
    change_i, shortest_i, longest_i = arc_bounds(v, first)
    fastest = e[0] * math.sqrt(1.0 + change_i) * v
    slowest = least_e[0] * math.sqrt(max(0.0, 1.0 - change_i)) * v
    change_j, _, longest_j = arc_bounds(fastest, second)
    _, shortest_j, _ = arc_bounds(slowest, second)
    most = fastest / v * e[1] * math.sqrt(1.0 + change_j) * (1.0 + ROUNDING)
    least = slowest / v * least_e[1] * math.sqrt(max(0.0, 1.0 - change_j)) * (1.0 - ROUNDING)
    if not most < 1.0:
        return np.nan, np.nan
    lower = (shortest_i + shortest_j) / (1.0 - least)
    upper = (longest_i + longest_j) / (1.0 - most)
    return lower * (1.0 - ROUNDING), upper * (1.0 + ROUNDING)


@inlined
def fastest_impact(v: float, first: Bounds, second: Bounds, e_i: float) -> float:
    """Bound all impact speeds until rest, for a body that a `geometric_bracket` brings to rest."""
    fastest = math.sqrt(1.0 + arc_bounds(v, first)[0]) * v
    following = e_i * fastest * math.sqrt(1.0 + arc_bounds(e_i * fastest, second)[0])
    return max(fastest, following) * (1.0 + ROUNDING)


@inlined
def with_restitution(side: Restoring, e: float) -> Restoring:
    """Return one side with another restitution."""
    return Restoring(side.g, side.rate, side.curvature, side.stiffness, e, side.error)


@inlined
def arc_bounds(v: float, bounds: Bounds) -> tuple[float, float, float]:
    """Bound an arc of initial speed v: |w^2/v^2 - 1| for its impact speed w, and its shortest and longest duration.

    The durations (2/sqrt(k)) atan(x), atanh(x), with the stiffness k and x = sqrt(k) v/greatest and /least, are
    replaced by the rational bounds x - x^3/3 and x + x^3/(3 (1 - x^2)) without transcendental functions.
    """
    k, m, M, change, rate, jumps = bounds
    if not (m > 0.0 and k * v * v < m * m):
        return np.nan, np.nan, np.nan
    squared = k * v * v / (m * m)
    shortest = 2.0 * v / M * (1.0 - k * v * v / (3.0 * M * M))
    longest = 2.0 * v / m * (1.0 + squared / (3.0 * (1.0 - squared)))
    energy = 2.0 * min(change, rate * longest + jumps) / (m * (1.0 + math.sqrt(1.0 - squared)))
    return energy, shortest, longest


class Proof(NamedTuple):
    """Bounds on the time to rest from an impact, its estimate, and a bound on all rotations until then.

    All NaN: no proof.
    """

    lower: float
    upper: float
    time: float
    height: float


@inlined
def unproven() -> Proof:
    """Return an all-NaN proof."""
    return Proof(np.nan, np.nan, np.nan, np.nan)


@shared
def prove_rest(ground: Ground, block: Record, settings: Record, scratch: Record, state: Record) -> Proof:
    """Compute a bracket on the time to rest after an impact; all NaN: no proof."""
    v, i = state.v, state.side
    j = block.next_side[i]
    e_i, e_j = block.restitution[i], block.restitution[j]
    g_i = restoring(ground, block, i, state.piece, state.offset)
    g_j = restoring(ground, block, j, state.piece, state.offset)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0 and abs(block.stiffness[i]) * v * v < g_i * g_i):
        return unproven()
    window = _WINDOW * 2.0 * v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)
    # Rounding decides on which side of a jump of the motion the window ends.
    rounding = ROUNDING * (start_of(ground, state.piece) + state.offset)
    motion = bounds_on_motion(ground, block, state, window + rounding, scratch)
    first = side_bounds(block, settings, i, motion)
    second = side_bounds(block, settings, j, motion)
    drag = max(block.damping[i], block.damping[j]) * _FASTEST * v * (1.0 + ROUNDING)
    if drag > 0.0:
        first, second = with_drag(first, drag), with_drag(second, drag)
        gained = 1.0 + arc_bounds(v, first)[0]
        fastest = e_i * math.sqrt(gained) * v
        if not (gained <= _GAINED and e_i * e_i * gained * (1.0 + arc_bounds(fastest, second)[0]) <= _GAINED):
            return unproven()
    fastest = fastest_impact(v, first, second, e_i) if block.variable_restitution else v
    least_e = least_factor(block, i, fastest), least_factor(block, j, fastest)
    lower, upper = geometric_bracket(v, first, second, (e_i, e_j), least_e)
    if not upper <= window:
        return unproven()
    least, change = min(first.least, second.least), max(first.change, second.change)
    height = v * v * (1.0 + 2.0 * change / least) / least
    # Up to twice the slenderness, the contribution of the weight to the restoring acceleration is largest at zero
    # rotation.
    if has_vertical(ground) and not height <= 2.0 * min(block.slenderness[0], block.slenderness[1]):
        return unproven()
    if (block.two_stops and height >= block.overturn_angle) or (
        block.yielding and may_change_below(block, settings, state.plastic, height)
    ):
        return unproven()
    local_series(ground, state.piece, state.offset, 1.0, set_zero(scratch.ground))
    weight_series(ground, state.piece, state.offset, set_zero(scratch.weight))
    horizon = Horizon(motion, ground.error, ground.columns, upper, height, drag)
    side_i = restoring_parabola(block, settings, i, scratch, horizon)
    side_j = restoring_parabola(block, settings, j, scratch, horizon)
    if block.variable_restitution:
        side_i = with_restitution(side_i, middle_factor(block, i, fastest))
        side_j = with_restitution(side_j, middle_factor(block, j, fastest))
    elif upper - lower > settings.tolerance and upper + rounding <= length_of(ground, state.piece) - state.offset:
        refined = refined_bracket(v, side_i, side_j, upper)
        if refined[1] >= refined[0]:
            lower, upper = max(lower, refined[0]), min(upper, refined[1])
            return Proof(lower, upper, 0.5 * (lower + upper), height)
    return Proof(lower, upper, min(max(remaining_time(v, side_i, side_j), lower), upper), height)


class MotionBounds(NamedTuple):
    """Bounds on both components of the motion during a window; the vertical one adds to a weight of 1."""

    horizontal: Window
    vertical: Window


@inlined
def bounds_on_motion(ground: Ground, block: Record, state: Record, window: float, scratch: Record) -> MotionBounds:
    """Bound the motion from a state on, including its error; NaN beyond a threshold."""
    vertical = Window(0.0, 0.0, 0.0, 0.0)
    if has_vertical(ground):
        limits = (-1.0, np.inf)
        exact = bounds_over(vertical_of(ground), state.piece, state.offset, window, limits, scratch.ground)
        vertical = widened(exact, ground.error)
    weight = 1.0 + vertical.high
    limits = (
        -block.threshold[0] * weight - block.restraint_threshold[0],
        block.threshold[1] * weight + block.restraint_threshold[1],
    )
    if block.two_stops:  # the other stop is out of reach
        limits = (limits[0], np.inf) if state.side == 0 else (-np.inf, limits[1])
    horizontal = bounds_over(ground, state.piece, state.offset, window, limits, scratch.ground)
    return MotionBounds(widened(horizontal, ground.error), vertical)


class Horizon(NamedTuple):
    """Bounds during the window of a proof.

    The fields are bounds on the motion, its error and number of coefficients, length of the window, largest rotation,
    and largest acceleration by damping.
    """

    motion: MotionBounds
    error: float
    columns: int
    window: float
    height: float
    drag: float


@inlined
def with_drag(bounds: Bounds, drag: float) -> Bounds:
    """Widen bounds on a side for an acceleration that differs by at most ``drag`` at any time and in either direction.

    On the way up and down, this takes as much energy as a motion that changes by twice as much.
    """
    k, m, M, change, rate, jumps = bounds
    return Bounds(k, m - drag, M + drag, change + 2.0 * drag, rate, jumps + 2.0 * drag)


@inlined
def restoring_parabola(block: Record, settings: Record, j: int, scratch: Record, horizon: Horizon) -> Restoring:
    """Compute side j after an impact: restoring acceleration as a parabola in time, stiffness, and error.

    ``scratch`` contains the ground acceleration and the weight about the impact.
    """
    A, W = scratch.ground, scratch.weight
    sign, gain, threshold, lam = sign_of(j), block.threshold_slope[j], block.threshold[j], block.stiffness[j]
    weight, push = W[0] + block.added_weight[j], sign * A[0] + block.added_push[j]
    horizontal, vertical = horizon.motion
    error = horizon.error + beyond_parabola(A, horizon)
    # If almost no weight presses the block down, the rounding of weight and push remains.
    error += ROUNDING * (
        abs(threshold) * (1.0 + largest(vertical)) + abs(block.restraint_threshold[j]) + largest(horizontal)
    )
    weight_changes = vertical.high > vertical.low
    weight_error = horizon.error + beyond_parabola(W, horizon) if weight_changes else 0.0
    weight_change = vertical.slope * horizon.window + 2.0 * horizon.error if weight_changes else 0.0
    if not settings.nonlinear:
        stiffness = lam * weight - block.spring[j]
        error = gain * (error + abs(threshold) * weight_error) + horizon.drag
        if weight_changes:
            error = deviation(error, abs(lam) * weight_change, 0.0, horizon.height)
    else:
        sine, cosine = block.sine[j], block.cosine[j]
        stiffness = lam * (cosine * weight - push * sine) - block.spring[j]
        push_change = horizontal.slope * horizon.window + 2.0 * horizon.error
        change = lam * (sine * push_change + cosine * weight_change)
        curvature = (
            lam * diagonal(max_weight(block, j, vertical), max_push(block, j, horizontal)) + 0.25 * block.prestress[j]
        )
        error = deviation(lam * (error + weight_error) + horizon.drag, change, curvature, horizon.height)
    g = gain * (threshold * W[0] + block.restraint_threshold[j] + sign * A[0])
    rate, half_curvature = gain * (sign * A[1]), gain * (sign * A[2]) if horizon.columns > 2 else 0.0
    if weight_changes:
        rate += gain * threshold * W[1]
        half_curvature += gain * threshold * W[2]
    return Restoring(g, rate, half_curvature, stiffness, block.restitution[j], error)


@inlined
def beyond_parabola(A: Floats, horizon: Horizon) -> float:
    """Bound the terms of a polynomial beyond degree 2."""
    beyond = 0.0
    for k in range(horizon.columns - 1, 2, -1):
        beyond = (beyond + abs(A[k])) * horizon.window
    return beyond * horizon.window * horizon.window


@inlined
def set_zero(A: Floats) -> Floats:
    """Set the lowest coefficients of a polynomial to zero and return it."""
    A[0] = A[1] = A[2] = 0.0
    return A


@inlined
def widened(motion: Window, error: float) -> Window:
    """Return bounds on a motion that differs from a bounded one by at most ``error``."""
    return Window(motion.low - error, motion.high + error, motion.slope, motion.jumps + 2.0 * error)


@inlined
def largest(motion: Window) -> float:
    """Return the largest absolute value of an acceleration."""
    return max(abs(motion.low), abs(motion.high))


@inlined
def largest_weight(vertical: Window) -> float:
    """Return the largest absolute weight divided by the weight at rest."""
    return max(1.0 + vertical.high, -(1.0 + vertical.low))


@inlined
def max_weight(block: Record, j: int, vertical: Window) -> float:
    """Return the largest absolute weight on side j, including restraints."""
    return largest_weight(vertical) + abs(block.added_weight[j])


@inlined
def max_push(block: Record, j: int, horizontal: Window) -> float:
    """Return the largest absolute push on side j, including restraints."""
    return largest(horizontal) + abs(block.added_push[j])


@inlined
def diagonal(a: float, b: float) -> float:
    """Compute the length of a vector; hypot rounds differently across C libraries and in Python."""
    return math.sqrt(a * a + b * b)


@inlined
def side_bounds(block: Record, settings: Record, j: int, motion: MotionBounds) -> Bounds:
    """Compute bounds on side j, rounding included, from bounds on the motion."""
    horizontal, vertical = motion
    sign, threshold = sign_of(j), block.threshold[j]
    from_weight = (threshold * (1.0 + vertical.low), threshold * (1.0 + vertical.high))
    from_push = (sign * horizontal.low, sign * horizontal.high)
    push, weight = largest(horizontal), largest_weight(vertical)
    rounding = ROUNDING * (abs(threshold) * weight + abs(block.restraint_threshold[j]) + push)
    # A rotation changes the stiffness and, in the nonlinear model, the effect of the motion (by at most p^2 a/g).
    bend = max_weight(block, j, vertical)
    spring = abs(block.spring[j])
    if settings.nonlinear:
        bend = diagonal(bend, max_push(block, j, horizontal))
        spring += 0.5 * abs(block.prestress[j])
    stiffness = (abs(block.stiffness[j]) * bend + spring) * (1.0 + ROUNDING)
    per_push = (block.stiffness[j] if settings.nonlinear else block.threshold_slope[j]) * (1.0 + ROUNDING)
    per_weight = block.threshold_slope[j] * threshold * (1.0 + ROUNDING)  # largest at zero rotation: see `prove_rest`
    return Bounds(
        stiffness,
        block.threshold_slope[j]
        * (from_weight[0] + block.restraint_threshold[j] + min(from_push[0], from_push[1]) - rounding),
        block.threshold_slope[j]
        * (from_weight[1] + block.restraint_threshold[j] + max(from_push[0], from_push[1]) + rounding),
        per_push * (horizontal.high - horizontal.low) + per_weight * (vertical.high - vertical.low),
        per_push * horizontal.slope + per_weight * vertical.slope,
        per_push * horizontal.jumps + per_weight * vertical.jumps,
    )
