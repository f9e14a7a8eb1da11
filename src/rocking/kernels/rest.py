"""Decision whether and when a block comes to rest after an impact, and impacts of a proven sequence."""

import math
from typing import NamedTuple

import numpy as np

from rocking.kernels.arc import compute_restoring, compute_weight, side_sign
from rocking.kernels.certificate import Proof, prove_rest, prove_slide
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.events import compute_mean_factor, is_factor_random
from rocking.kernels.ground import Ground, coefficient, piece_length, piece_start
from rocking.kernels.remaining import THIRD, Pair
from rocking.kernels.sliding import compute_slip_factor, compute_slip_restoring
from rocking.kernels.state import PROVEN_PER_ITERATION, RestRule, Struct, Structs, write_impact, write_node

ULP = 2.0**-52

#: Decrease of the speed after a failed proof at which the next one is attempted.
_RETRY_RATIO = 0.6

#: After a proof with too wide a bracket, the next one is attempted at the speed expected for a sufficiently narrow one,
#: times the first factor, but at most the present speed times the second.
_RETRY_MARGIN = 0.97
_MAX_RETRY_RATIO = 0.95

#: Smallest interval between impacts, approximately, at a repeated proof, divided by the rounding of the time.
_MIN_INTERVAL = 8.0


class Rest(NamedTuple):
    """Rest after an impact, with proven bounds (NaN: not proven)."""

    lower: float  # lower bound on the time to rest
    upper: float  # upper bound on the time to rest
    time: float  # time to rest; NaN: not yet
    is_by_rounding: bool  # at rest only because time no longer advances


@inlined
def compute_state_time(ground: Ground, state: Struct) -> float:
    """Return the time of a state."""
    return piece_start(ground, state.piece) + state.offset


@inlined
def count_impact(state: Struct) -> None:
    """Count an impact of a proven sequence or, before a proof, set the speed for the next attempt."""
    if state.proven_impacts > 0:
        state.proven_impacts += 1
    elif state.v > state.certificate_speed:
        state.certificate_speed = max(state.certificate_speed, _RETRY_RATIO * state.v)


@inlined
def store_proof(ground: Ground, block: Struct, settings: Struct, state: Struct, proof: Proof) -> None:
    """Store the time since which chattering is proven and the speed for the next proof."""
    if not proof.upper >= 0.0:
        state.certificate_speed = _RETRY_RATIO * state.v
        return
    if state.proven_impacts == 0:
        state.proven_impacts = 1
        state.sequence_start = compute_state_time(ground, state)
    excess = (proof.upper - proof.lower) / settings.tolerance
    if block.variable_restitution or state.direction != 0:
        # The width is proportional to the square of the speed, or to the speed if the factor is drawn.
        ratio = 1.0 / excess if is_factor_random(block) else math.sqrt(1.0 / excess)
    else:
        wait = compute_time_to_last_piece(ground, state, proof.time)
        # The width of a fourth-order bracket is proportional to the fifth power of the speed, of the geometric one to
        # its square. The former requires a rest within the present piece.
        ratio = _RETRY_MARGIN * excess**-0.2 if wait == 0.0 else 1.0 - wait / proof.time
        ratio = max(ratio, math.sqrt(1.0 / excess))
    # Approximate length of the next arc. Arcs are proportional to the speed, and must exceed the rounding of times.
    arc = (1.0 - max(block.restitution[0], block.restitution[1])) * proof.time
    min_ratio = _MIN_INTERVAL * ULP * compute_state_time(ground, state) / arc if arc > 0.0 else 0.0
    state.certificate_speed = state.v * min(_MAX_RETRY_RATIO, max(ratio, min_ratio))


@inlined
def compute_time_to_last_piece(ground: Ground, state: Struct, time: float) -> float:
    """Return the time from a state to the start of the piece that is reached ``time`` later."""
    piece = state.piece
    wait = 0.0
    reached = piece_length(ground, piece) - state.offset
    while reached < time:
        wait = reached
        piece += 1
        reached += piece_length(ground, piece)
    return wait


@not_inlined
def bound_rest(ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct) -> Proof:
    """Compute proven bounds on the time to rest, widened by the rounding of all times; all NaN: no proof."""
    if state.direction == 0:
        lower, upper, time, height = prove_rest(ground, block, settings, scratch, state)
    else:
        lower, upper, time, height = prove_slide(ground, block, settings, scratch, state)
    rounding = bound_rounding_of_rest(compute_state_time(ground, state), upper, state)
    return Proof(lower - rounding, upper + rounding, time, height)


@inlined
def bound_rounding_of_rest(time: float, upper: float, state: Struct) -> float:
    """Compute an allowance for the rounding of times and of the arcs since the first proof."""
    since_proof = time - state.sequence_start if state.proven_impacts > 0 else 0.0
    return 4.0 * ULP * time + 8.0 * ULP * (max(state.proven_impacts, 1) + 4) * (since_proof + upper)


@not_inlined
def decide_rest(ground: Ground, block: Struct, settings: Struct, state: Struct, proof: Proof) -> Rest:
    """Decide whether the block comes to rest at an impact, given the proven bounds (NaN: none)."""
    time = compute_state_time(ground, state)
    if settings.rest_rule == RestRule.CERTIFIED:
        if state.v == 0.0:
            rounding = bound_rounding_of_rest(time, 0.0, state)
            return Rest(-rounding, rounding, 0.0, False)
        # No unresolved rotation may exceed the resolved ones.
        max_width = max(settings.tolerance, 4.0 * bound_rounding_of_rest(time, proof.upper, state))
        if proof.upper - proof.lower <= max_width and proof.height <= state.peak:
            return Rest(proof.lower, proof.upper, proof.time, False)
    elif settings.rest_rule == RestRule.BYPASS:
        remaining = sum_geometric_arcs(ground, block, settings, state)
        if state.v <= block.rest_limit[state.side] and remaining >= 0.0:
            return Rest(np.nan, np.nan, remaining, False)
    else:
        limit = block.rest_limit[state.side]
        is_slow = settings.rest_rule == RestRule.VELOCITY and state.v <= limit
        is_frequent = settings.rest_rule == RestRule.INTERVAL and time - state.last_impact_time <= limit
        is_late = settings.rest_rule == RestRule.TIME and time - state.last_uplift_time >= limit
        if is_slow or is_frequent or is_late:
            return Rest(np.nan, np.nan, 0.0, False)
    is_by_rounding = is_within_time_rounding(ground, block, settings, state)
    return Rest(np.nan, np.nan, 0.0 if is_by_rounding or state.v == 0.0 else np.nan, is_by_rounding)


@inlined
def sum_geometric_arcs(ground: Ground, block: Struct, settings: Struct, state: Struct) -> float:
    """Compute the time to rest after an impact under constant accelerations, or NaN if one does not press down.

    Sum of the paper's Eq. 75 without remainder: arcs of 2 v/g, with speeds reduced by a factor at each impact.
    """
    i, j = state.side, block.next_side[state.side]
    g_i = compute_present_restoring(ground, block, settings, state, i)
    g_j = compute_present_restoring(ground, block, settings, state, j)
    e_i, e_j = compute_mean_factor(block, i, state.v), compute_mean_factor(block, j, state.v)
    if state.direction != 0:
        e_i = compute_slip_factor(block, i, e_i, state.direction)
        e_j = compute_slip_factor(block, j, e_j, state.direction)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0):
        return np.nan
    return 2.0 * state.v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)


@inlined
def compute_present_restoring(ground: Ground, block: Struct, settings: Struct, state: Struct, side: int) -> float:
    """Compute the restoring acceleration of a side at zero rotation for the present slip, if any."""
    if state.direction == 0:
        return compute_restoring(ground, block, side, state.piece, state.offset)
    weight = compute_weight(ground, state.piece, state.offset)
    return weight * compute_slip_restoring(block, settings, side, side_sign(side) * state.direction)


@inlined
def is_within_time_rounding(ground: Ground, block: Struct, settings: Struct, state: Struct) -> bool:
    """Return whether time hardly advanced since the last impact and will not until the next."""
    time = compute_state_time(ground, state)
    max_stiffness = max(abs(block.stiffness[0]), abs(block.stiffness[1]))
    resolution = ULP * (time + (1.0 / math.sqrt(max_stiffness) if max_stiffness > 0.0 else 0.0))
    acceleration = compute_present_restoring(ground, block, settings, state, state.side)
    return bool(time - state.last_impact_time <= resolution and 2.0 * state.v <= resolution * acceleration)


#: Largest |beta| and |gamma| of `solve_proven_arc`, for which the relative truncation of its sums is below 2^-54.
MAX_BETA = 1.0 / 64.0
MAX_GAMMA = 2.0**-14


@not_inlined
def apply_proven_impacts(
    ground: Ground, block: Struct, settings: Struct, table: Structs, state: Struct, duration: float
) -> None:
    """March the linear model through some impacts within ``duration``, up to the one with another proof.

    The ground acceleration is linear in time, and the state immediately after an impact.
    """
    rate = coefficient(ground, state.piece, 1)
    end = state.offset + duration
    for _ in range(PROVEN_PER_ITERATION):
        side, v = state.side, state.v
        g = compute_restoring(ground, block, side, state.piece, state.offset)
        t, speed = solve_proven_arc(v, g, block.restoring_gain[side] * side_sign(side) * rate, block.stiffness[side])
        next_speed = block.restitution[side] * speed
        # The arc is below its first tangent.
        if not (t < end - state.offset and next_speed > state.certificate_speed and v * t <= state.peak):
            return
        state.side = block.next_side[side]
        state.v = next_speed
        state.offset += t
        state.last_impact_time = piece_start(ground, state.piece) + state.offset
        state.impact_count += 1
        state.proven_impacts += 1
        state.budget -= 1
        write_impact(settings, table, state, state.last_impact_time, speed)
        write_node(ground, settings, table, state)


@inlined
def solve_proven_arc(v: float, g: float, rate: float, stiffness: float) -> Pair:
    """Compute duration and impact speed of an arc with initial speed v under g + rate t - stiffness u.

    Full precision for |beta| = |rate| v/g^2 and |gamma| = |stiffness| v^2/g^2 up to the limits above, NaN beyond. Half
    the duration is (v/g) x with x + b x^2 = 1, b = 2 beta/3, and a correction for gamma.
    """
    if not g > 0.0:
        return math.nan, math.nan
    inverse = 1.0 / g
    half = v * inverse  # half the duration under constant acceleration
    beta, gamma = rate * half * inverse, stiffness * half * half
    if not (abs(beta) <= MAX_BETA and abs(gamma) <= MAX_GAMMA):
        return math.nan, math.nan
    x = solve_half_duration(2.0 * THIRD * beta)
    y = beta * x
    q = gamma * x * x
    # Value, slope and half the second derivative of the equation at x.
    tangent = q * (q * (2.0 / 15.0 - q * (17.0 / 315.0)) - THIRD)
    value = x * ((1.0 + y) * tangent + y * q * (1.0 / 45.0 - q * (2.0 / 945.0)))
    change = 2.0 * q * (1.0 + y) * (q * (4.0 / 15.0) - THIRD)
    slope = 1.0 + (4.0 / 3.0) * y + (1.0 + 2.0 * y) * tangent + change + (4.0 / 45.0) * y * q
    curvature = 2.0 * THIRD * beta - gamma * x * (1.0 + (28.0 / 15.0) * y)
    step = 1.0 / slope
    newton = value * step
    x -= newton * (1.0 + curvature * step * newton)
    q = gamma * x * x
    gain = 2.0 * beta * x * x * (THIRD - q * (1.0 / 45.0 - q * (2.0 / 945.0)))
    return 2.0 * half * x, v + v * gain


@inlined
def solve_half_duration(b: float) -> float:
    """Compute the root of x + b x^2 = 1 near 1 for |b| <= 1/96, to full precision, by Catalan's numbers."""
    square = b * b
    fourth = square * square
    low = (1.0 - b) + square * (2.0 - 5.0 * b)
    middle = (14.0 - 42.0 * b) + square * (132.0 - 429.0 * b)
    high = (1430.0 - 4862.0 * b) + square * 16796.0
    return low + fourth * (middle + fourth * high)
