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
from rocking.kernels.arc import compute_restoring, compute_weight, side_sign, write_weight_series
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.events import bound_factor, compute_mean_factor
from rocking.kernels.ground import (
    ROUNDING,
    AccelerationBounds,
    Ground,
    bound_window,
    ground_error,
    has_vertical,
    piece_length,
    piece_start,
    select_vertical,
    write_local_series,
)
from rocking.kernels.remaining import ImpactSide, Pair, bound_restoring_error, estimate_remaining_time, refine_bracket
from rocking.kernels.restraints import may_tendon_law_change_below
from rocking.kernels.sliding import (
    compute_slip_factor,
    compute_slip_restoring,
    compute_slip_stiffness,
    find_sticking_friction,
)
from rocking.kernels.state import Struct

#: Window of the proof divided by the first estimate of the remaining time.
_WINDOW_RATIO = 1.5

#: With damping: bound on every speed until rest divided by the first, valid for this bound on the energy gained in the
#: first two arcs.
_MAX_SPEED_RATIO = 1.5
_MAX_ENERGY_RATIO = 2.25


class RestoringBounds(NamedTuple):
    """Bounds on the restoring acceleration of one side at zero rotation during a window."""

    stiffness: float  # largest change per unit of rotation
    min_restoring: float  # smallest restoring acceleration
    max_restoring: float  # largest restoring acceleration
    change: float  # largest change by the motion
    rate: float  # largest rate of change by the motion
    jumps: float  # sum of the jumps by the motion


@inlined
def bracket_geometrically(
    v: float, first: RestoringBounds, second: RestoringBounds, e: Pair, min_e: Pair
) -> tuple[float, float]:
    """Compute a lower and an upper bound on the time to rest if the bounds hold that long; NaN, NaN: no proof.

    ``first`` bounds the side entered, ``second`` the other. ``e`` and ``min_e`` are the largest and the smallest
    restitution on leaving each side.
    """
    change_i, shortest_i, longest_i = bound_arc(v, first)
    max_speed = e[0] * math.sqrt(1.0 + change_i) * v
    min_speed = min_e[0] * math.sqrt(max(0.0, 1.0 - change_i)) * v
    change_j, _, longest_j = bound_arc(max_speed, second)
    _, shortest_j, _ = bound_arc(min_speed, second)
    max_ratio = max_speed / v * e[1] * math.sqrt(1.0 + change_j) * (1.0 + ROUNDING)
    min_ratio = min_speed / v * min_e[1] * math.sqrt(max(0.0, 1.0 - change_j)) * (1.0 - ROUNDING)
    if not max_ratio < 1.0:
        return np.nan, np.nan
    lower = (shortest_i + shortest_j) / (1.0 - min_ratio)
    upper = (longest_i + longest_j) / (1.0 - max_ratio)
    return lower * (1.0 - ROUNDING), upper * (1.0 + ROUNDING)


@inlined
def bound_impact_speed(v: float, first: RestoringBounds, second: RestoringBounds, e_i: float) -> float:
    """Bound all impact speeds until a rest that `bracket_geometrically` proves."""
    max_speed = math.sqrt(1.0 + bound_arc(v, first)[0]) * v
    next_speed = e_i * max_speed * math.sqrt(1.0 + bound_arc(e_i * max_speed, second)[0])
    return max(max_speed, next_speed) * (1.0 + ROUNDING)


@inlined
def replace_restitution(side: ImpactSide, e: float) -> ImpactSide:
    """Return one side with another restitution."""
    return ImpactSide(side.g, side.rate, side.curvature, side.stiffness, e, side.error)


@inlined
def bound_arc(v: float, bounds: RestoringBounds) -> tuple[float, float, float]:
    """Bound an arc of initial speed v: |w^2/v^2 - 1| for its impact speed w, and its shortest and longest duration.

    The durations (2/sqrt(k)) atan(x), atanh(x), with the stiffness k and x = sqrt(k) v/M and sqrt(k) v/m, are
    replaced by the rational bounds x - x^3/3 and x + x^3/(3 (1 - x^2)) without transcendental functions.
    """
    k, m, M, change, rate, jumps = bounds
    if not (m > 0.0 and k * v * v < m * m):
        return np.nan, np.nan, np.nan
    ratio = k * v * v / (m * m)
    min_duration = 2.0 * v / M * (1.0 - k * v * v / (3.0 * M * M))
    max_duration = 2.0 * v / m * (1.0 + ratio / (3.0 * (1.0 - ratio)))
    energy = 2.0 * min(change, rate * max_duration + jumps) / (m * (1.0 + math.sqrt(1.0 - ratio)))
    return energy, min_duration, max_duration


class Proof(NamedTuple):
    """Proof of complete chattering from an impact; all NaN: no proof."""

    lower: float  # lower bound on the time to rest
    upper: float  # upper bound on the time to rest
    time: float  # estimate of the time to rest
    height: float  # bound on all rotations until rest


@inlined
def create_failed_proof() -> Proof:
    """Return an all-NaN proof."""
    return Proof(np.nan, np.nan, np.nan, np.nan)


@not_inlined
def prove_rest(ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct) -> Proof:
    """Compute a bracket on the time to rest after an impact; all NaN: no proof."""
    v, i = state.v, state.side
    j = block.next_side[i]
    e_i, e_j = block.restitution[i], block.restitution[j]
    g_i = compute_restoring(ground, block, i, state.piece, state.offset)
    g_j = compute_restoring(ground, block, j, state.piece, state.offset)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0 and abs(block.stiffness[i]) * v * v < g_i * g_i):
        return create_failed_proof()
    window = _WINDOW_RATIO * 2.0 * v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)
    # Rounding decides on which side of a jump of the motion the window ends.
    rounding = ROUNDING * (piece_start(ground, state.piece) + state.offset)
    motion_bounds = bound_motion(ground, block, state, window + rounding, scratch)
    first = bound_side(block, settings, i, motion_bounds)
    second = bound_side(block, settings, j, motion_bounds)
    drag = max(block.damping[i], block.damping[j]) * _MAX_SPEED_RATIO * v * (1.0 + ROUNDING)
    if drag > 0.0:
        first, second = widen_for_drag(first, drag), widen_for_drag(second, drag)
        energy_ratio = 1.0 + bound_arc(v, first)[0]
        max_speed = e_i * math.sqrt(energy_ratio) * v
        next_ratio = e_i * e_i * energy_ratio * (1.0 + bound_arc(max_speed, second)[0])
        if not (energy_ratio <= _MAX_ENERGY_RATIO and next_ratio <= _MAX_ENERGY_RATIO):
            return create_failed_proof()
    max_speed = bound_impact_speed(v, first, second, e_i) if block.variable_restitution else v
    min_e = bound_factor(block, i, max_speed), bound_factor(block, j, max_speed)
    lower, upper = bracket_geometrically(v, first, second, (e_i, e_j), min_e)
    if not upper <= window:
        return create_failed_proof()
    min_restoring, change = min(first.min_restoring, second.min_restoring), max(first.change, second.change)
    height = v * v * (1.0 + 2.0 * change / min_restoring) / min_restoring
    # Up to twice the slenderness, the contribution of the weight to the restoring acceleration is largest at zero
    # rotation.
    if has_vertical(ground) and not height <= 2.0 * min(block.slenderness[0], block.slenderness[1]):
        return create_failed_proof()
    max_square = v * v * (1.0 + 2.0 * change / min_restoring) * (1.0 + 2.0 * change / min_restoring)
    if (
        (block.two_stops and height >= block.overturn_angle)
        or (block.yielding and may_tendon_law_change_below(block, settings, state.plastic_elongation, height))
        or (block.has_friction and not sticks_until_rest(block, settings, motion_bounds, height, max_square))
    ):
        return create_failed_proof()
    write_local_series(ground, state.piece, state.offset, 1.0, clear_lowest_coefficients(scratch.ground))
    write_weight_series(ground, state.piece, state.offset, clear_lowest_coefficients(scratch.weight))
    horizon = Horizon(motion_bounds, ground_error(ground), ground.coefficient_count, upper, height, drag)
    side_i = fit_restoring_parabola(block, settings, i, scratch, horizon)
    side_j = fit_restoring_parabola(block, settings, j, scratch, horizon)
    if block.variable_restitution:
        side_i = replace_restitution(side_i, compute_mean_factor(block, i, max_speed))
        side_j = replace_restitution(side_j, compute_mean_factor(block, j, max_speed))
    elif upper - lower > settings.tolerance and upper + rounding <= piece_length(ground, state.piece) - state.offset:
        narrower = refine_bracket(v, side_i, side_j, upper)
        if narrower[1] >= narrower[0]:
            lower, upper = max(lower, narrower[0]), min(upper, narrower[1])
            return Proof(lower, upper, 0.5 * (lower + upper), height)
    return Proof(lower, upper, min(max(estimate_remaining_time(v, side_i, side_j), lower), upper), height)


class MotionBounds(NamedTuple):
    """Bounds on both components of the motion during a window."""

    horizontal: AccelerationBounds  # bounds on the push
    vertical: AccelerationBounds  # bounds on the addition to a weight of 1


@inlined
def sticks_until_rest(
    block: Struct, settings: Struct, motion: MotionBounds, height: float, max_squared_speed: float
) -> bool:
    """Return whether no arc and no impact of a proven sequence slips (Eqs 7 and 10 of "Sliding"); False for NaN.

    ``height`` and ``max_squared_speed`` bound all rotations and all squared speeds.
    """
    horizontal, vertical = motion
    strength = compute_norm(bound_weight_magnitude(vertical), bound_magnitude(horizontal)) * (1.0 + ROUNDING)
    mu = block.static_friction * (1.0 - ROUNDING)
    for side in range(2):
        ratio = block.arm_over_g[side] * block.stiffness[side]
        # Change of the forces by a finite size of the arcs.
        change = block.arm_over_g[side] * (2.0 * block.stiffness[side] * strength * height + max_squared_speed)
        if not find_sticking_friction(block, side) <= mu:
            return False
        s, c = block.slenderness[side], 1.0
        if settings.nonlinear:
            s, c = block.sine[side], block.cosine[side]
        for corner in range(4):  # both sides of the inequality are convex
            push = side_sign(side) * (horizontal.low if corner < 2 else horizontal.high)
            weight = 1.0 + (vertical.low if corner % 2 == 0 else vertical.high)
            force = abs(push * (1.0 - ratio * c * c) - ratio * weight * s * c) + change
            normal = weight * (1.0 - ratio * s * s) - ratio * push * s * c if settings.nonlinear else weight
            if not force <= mu * (normal - change):
                return False
    return True


#: While sliding: bounds on every rotation and speed until rest, divided by their first estimates.
_MAX_HEIGHT_RATIO = 2.0
_MAX_SLIDING_SPEED_RATIO = 1.25


@not_inlined
def prove_slide(ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct) -> Proof:
    """Compute a bracket on the time at which a block that slips ceases to rock and slides; all NaN: no proof.

    The restoring acceleration does not depend on the horizontal motion (Eq. 11 of "Sliding"), and an impact multiplies
    the speed by Eq. 12, as long as the slip keeps its direction.
    """
    v, i = state.v, state.side
    j = 1 - i
    mu, direction = block.kinetic_friction, side_sign(i) * state.direction
    g_i = compute_slip_restoring(block, settings, i, direction)
    g_j = compute_slip_restoring(block, settings, j, -direction)
    e_i = max(0.0, compute_slip_factor(block, i, block.restitution[i], state.direction))
    e_j = max(0.0, compute_slip_factor(block, j, block.restitution[j], state.direction))
    weight = compute_weight(ground, state.piece, state.offset)
    if not (g_i > 0.0 and g_j > 0.0 and weight > 0.0 and e_i * e_j < 1.0):
        return create_failed_proof()
    time = 2.0 * v * (1.0 / g_i + e_i / g_j) / (weight * (1.0 - e_i * e_j))
    window = _WINDOW_RATIO * time
    rounding = ROUNDING * (piece_start(ground, state.piece) + state.offset)
    motion = bound_motion(ground, block, state, window + rounding, scratch)
    max_height = _MAX_HEIGHT_RATIO * v * v / (min(g_i, g_j) * weight)
    max_speed = _MAX_SLIDING_SPEED_RATIO * v
    first = bound_sliding_side(block, settings, i, (direction, g_i), motion.vertical, (max_height, max_speed))
    second = bound_sliding_side(block, settings, j, (-direction, g_j), motion.vertical, (max_height, max_speed))
    lower, upper = bracket_geometrically(v, first, second, (e_i, e_j), (e_i, e_j))
    min_restoring, change = min(first.min_restoring, second.min_restoring), max(first.change, second.change)
    height = v * v * (1.0 + 2.0 * change / min_restoring) / min_restoring
    max_restoring = max(first.max_restoring, second.max_restoring)
    if not (
        upper <= window
        and height <= max_height
        and bound_impact_speed(v, first, second, e_i) <= max_speed
        and max_speed * max_speed * max(first.stiffness, second.stiffness) <= max_restoring * max_restoring
    ):
        return create_failed_proof()
    # Change of the slip velocity by arcs and impacts. The sum of all speeds at the starts of arcs is at most
    # max_restoring upper/(2 (1 - 1/3)), the sum of those before and after impacts at most 2.25 times as large.
    divisor = 1.0
    if settings.nonlinear:
        divisor = compute_sliding_divisor(block, i, direction, max_height)
        divisor = min(divisor, compute_sliding_divisor(block, j, -direction, max_height))
    arm = max(block.arm_over_g[0], block.arm_over_g[1])
    base = max(block.pivot_distance_over_g[0], block.pivot_distance_over_g[1])
    normal = (1.0 + motion.vertical.high) / min(1.0, divisor)
    along_arcs = mu * normal + bound_magnitude(motion.horizontal) + arm * (3.0 * max_restoring + max_speed * max_speed)
    at_impacts = 2.0 * (mu * base + block.height_over_g) * max_restoring
    if not upper * (along_arcs + at_impacts) < abs(state.slip_rate):
        return create_failed_proof()
    return Proof(lower, upper, min(max(time, lower), upper), height)


@inlined
def compute_sliding_divisor(block: Struct, side: int, direction: float, height: float) -> float:
    """Return a lower bound on the divisor of the normal force on a side up to a height."""
    lever = block.sine[side] - direction * block.kinetic_friction * block.cosine[side]
    slope = block.inertia_ratio[side] * compute_norm(1.0, block.kinetic_friction)
    return 1.0 + block.inertia_ratio[side] * block.sine[side] * lever - slope * height


@inlined
def bound_sliding_side(
    block: Struct,
    settings: Struct,
    side: int,
    slip: tuple[float, float],
    vertical: AccelerationBounds,
    limits: tuple[float, float],
) -> RestoringBounds:
    """Compute bounds on a side while slipping; NaN without a proof.

    ``slip``: direction in the frame of the side and restoring acceleration; ``limits``: on rotations and speeds. The
    acceleration is a function of u times W - R cos(psi) u'^2. The latter part returns the speed of an arc unchanged,
    and enlarges the contribution of a varying weight by less than a fifth.
    """
    (direction, g), (height, speed) = slip, limits
    low, high = 1.0 + vertical.low, 1.0 + vertical.high
    stiffness, inertia = compute_slip_stiffness(block, side), 0.0
    if settings.nonlinear:
        norm = compute_norm(1.0, block.kinetic_friction)
        divisor = compute_sliding_divisor(block, side, direction, height)
        stiffness *= norm * (divisor + block.inertia_ratio[side] * norm) / (divisor * divisor)
        inertia = block.arm_over_g[side] * speed * speed
        if not (divisor > 0.0 and 2.0 * (g + stiffness * height) * block.arm_over_g[side] * height <= 0.1):
            return RestoringBounds(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan)
    gain = 1.2 * (g + stiffness * height) * (1.0 + ROUNDING)
    return RestoringBounds(
        stiffness * high * (1.0 + ROUNDING),
        g * (low - inertia) * (1.0 - ROUNDING),
        g * high * (1.0 + ROUNDING),
        gain * (high - low),
        gain * vertical.slope,
        gain * vertical.jumps,
    )


@inlined
def bound_motion(ground: Ground, block: Struct, state: Struct, window: float, scratch: Struct) -> MotionBounds:
    """Bound the motion from a state on, including its error; NaN beyond a threshold."""
    vertical = AccelerationBounds(0.0, 0.0, 0.0, 0.0)
    if has_vertical(ground):
        limits = (-1.0, np.inf)
        bounds = bound_window(select_vertical(ground), state.piece, state.offset, window, limits, scratch.ground)
        vertical = widen_for_error(bounds, ground_error(ground))
    weight = 1.0 + vertical.high
    limits = (
        -block.threshold[0] * weight - block.restraint_threshold[0],
        block.threshold[1] * weight + block.restraint_threshold[1],
    )
    if state.direction != 0:
        limits = (-np.inf, np.inf)
    if block.two_stops:  # the other stop is out of reach
        limits = (limits[0], np.inf) if state.side == 0 else (-np.inf, limits[1])
    horizontal = bound_window(ground, state.piece, state.offset, window, limits, scratch.ground)
    return MotionBounds(widen_for_error(horizontal, ground_error(ground)), vertical)


class Horizon(NamedTuple):
    """Bounds during the window of a proof."""

    motion: MotionBounds  # bounds on the motion
    error: float  # error of the motion
    coefficient_count: int  # number of coefficients of a piece of the motion
    window: float  # length of the window
    height: float  # largest rotation
    drag: float  # largest acceleration by damping


@inlined
def widen_for_drag(bounds: RestoringBounds, drag: float) -> RestoringBounds:
    """Widen bounds on a side for an acceleration that differs by at most ``drag`` at any time and in either direction.

    On the way up and down, this takes as much energy as a motion that changes by twice as much.
    """
    k, m, M, change, rate, jumps = bounds
    return RestoringBounds(k, m - drag, M + drag, change + 2.0 * drag, rate, jumps + 2.0 * drag)


@inlined
def fit_restoring_parabola(block: Struct, settings: Struct, j: int, scratch: Struct, horizon: Horizon) -> ImpactSide:
    """Compute side j after an impact: restoring acceleration as a parabola in time, stiffness, and error.

    ``scratch`` contains the ground acceleration and the weight about the impact.
    """
    A, W = scratch.ground, scratch.weight
    sign, gain, threshold, lam = side_sign(j), block.restoring_gain[j], block.threshold[j], block.stiffness[j]
    weight, push = W[0] + block.added_weight[j], sign * A[0] + block.added_push[j]
    horizontal, vertical = horizon.motion
    error = horizon.error + bound_higher_terms(A, horizon)
    # If almost no weight presses the block down, the rounding of weight and push remains.
    from_weight = abs(threshold) * (1.0 + bound_magnitude(vertical))
    error += ROUNDING * (from_weight + abs(block.restraint_threshold[j]) + bound_magnitude(horizontal))
    weight_changes = vertical.high > vertical.low
    weight_error = horizon.error + bound_higher_terms(W, horizon) if weight_changes else 0.0
    weight_change = vertical.slope * horizon.window + 2.0 * horizon.error if weight_changes else 0.0
    if not settings.nonlinear:
        stiffness = lam * weight - block.spring[j]
        error = gain * (error + abs(threshold) * weight_error) + horizon.drag
        if weight_changes:
            error = bound_restoring_error(error, abs(lam) * weight_change, 0.0, horizon.height)
    else:
        sine, cosine = block.sine[j], block.cosine[j]
        stiffness = lam * (cosine * weight - push * sine) - block.spring[j]
        push_change = horizontal.slope * horizon.window + 2.0 * horizon.error
        change = lam * (sine * push_change + cosine * weight_change)
        curvature = lam * compute_norm(bound_weight(block, j, vertical), bound_push(block, j, horizontal))
        curvature += 0.25 * block.prestress[j]
        error = bound_restoring_error(lam * (error + weight_error) + horizon.drag, change, curvature, horizon.height)
    g = gain * (threshold * W[0] + block.restraint_threshold[j] + sign * A[0])
    rate, half_curvature = gain * (sign * A[1]), gain * (sign * A[2]) if horizon.coefficient_count > 2 else 0.0
    if weight_changes:
        rate += gain * threshold * W[1]
        half_curvature += gain * threshold * W[2]
    return ImpactSide(g, rate, half_curvature, stiffness, block.restitution[j], error)


@inlined
def bound_higher_terms(A: Floats, horizon: Horizon) -> float:
    """Bound the terms of a polynomial beyond degree 2."""
    total = 0.0
    for k in range(horizon.coefficient_count - 1, 2, -1):
        total = (total + abs(A[k])) * horizon.window
    return total * horizon.window * horizon.window


@inlined
def clear_lowest_coefficients(A: Floats) -> Floats:
    """Set the lowest coefficients of a polynomial to zero and return it."""
    A[0] = A[1] = A[2] = 0.0
    return A


@inlined
def widen_for_error(motion: AccelerationBounds, error: float) -> AccelerationBounds:
    """Return bounds on a motion that differs from a bounded one by at most ``error``."""
    return AccelerationBounds(motion.low - error, motion.high + error, motion.slope, motion.jumps + 2.0 * error)


@inlined
def bound_magnitude(motion: AccelerationBounds) -> float:
    """Return the largest absolute value of an acceleration."""
    return max(abs(motion.low), abs(motion.high))


@inlined
def bound_weight_magnitude(vertical: AccelerationBounds) -> float:
    """Return the largest absolute weight divided by the weight at rest."""
    return max(1.0 + vertical.high, -(1.0 + vertical.low))


@inlined
def bound_weight(block: Struct, j: int, vertical: AccelerationBounds) -> float:
    """Return the largest absolute weight on side j, including restraints."""
    return bound_weight_magnitude(vertical) + abs(block.added_weight[j])


@inlined
def bound_push(block: Struct, j: int, horizontal: AccelerationBounds) -> float:
    """Return the largest absolute push on side j, including restraints."""
    return bound_magnitude(horizontal) + abs(block.added_push[j])


@inlined
def compute_norm(a: float, b: float) -> float:
    """Compute the length of a vector; hypot rounds differently across C libraries and in Python."""
    return math.sqrt(a * a + b * b)


@inlined
def bound_side(block: Struct, settings: Struct, j: int, motion: MotionBounds) -> RestoringBounds:
    """Compute bounds on side j, rounding included, from bounds on the motion."""
    horizontal, vertical = motion
    sign, threshold = side_sign(j), block.threshold[j]
    from_weight = (threshold * (1.0 + vertical.low), threshold * (1.0 + vertical.high))
    from_push = (sign * horizontal.low, sign * horizontal.high)
    push, weight = bound_magnitude(horizontal), bound_weight_magnitude(vertical)
    rounding = ROUNDING * (abs(threshold) * weight + abs(block.restraint_threshold[j]) + push)
    # A rotation changes the stiffness and, in the nonlinear model, the effect of the motion (by at most p^2 a/g).
    max_stiffness_factor = bound_weight(block, j, vertical)
    spring = abs(block.spring[j])
    if settings.nonlinear:
        max_stiffness_factor = compute_norm(max_stiffness_factor, bound_push(block, j, horizontal))
        spring += 0.5 * abs(block.prestress[j])
    stiffness = (abs(block.stiffness[j]) * max_stiffness_factor + spring) * (1.0 + ROUNDING)
    per_push = (block.stiffness[j] if settings.nonlinear else block.restoring_gain[j]) * (1.0 + ROUNDING)
    per_weight = block.restoring_gain[j] * threshold * (1.0 + ROUNDING)  # largest at zero rotation: see `prove_rest`
    return RestoringBounds(
        stiffness,
        block.restoring_gain[j]
        * (from_weight[0] + block.restraint_threshold[j] + min(from_push[0], from_push[1]) - rounding),
        block.restoring_gain[j]
        * (from_weight[1] + block.restraint_threshold[j] + max(from_push[0], from_push[1]) + rounding),
        per_push * (horizontal.high - horizontal.low) + per_weight * (vertical.high - vertical.low),
        per_push * horizontal.slope + per_weight * vertical.slope,
        per_push * horizontal.jumps + per_weight * vertical.jumps,
    )
