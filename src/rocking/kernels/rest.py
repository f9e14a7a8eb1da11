"""Decision whether and when a block comes to rest after an impact, and impacts of a proven sequence."""

import math
from typing import NamedTuple

import numpy as np

from rocking.kernels.arc import restoring, sign_of
from rocking.kernels.certificate import Proof, prove_rest
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.events import is_drawn, middle_factor
from rocking.kernels.ground import Ground, coefficient, length_of, start_of
from rocking.kernels.remaining import THIRD, Pair
from rocking.kernels.state import PROVEN_PER_ITERATION, Record, Records, RestRule, write_impact, write_node

ULP = 2.0**-52

#: Decrease of the speed after a failed proof at which the next one is attempted.
_SLOWER = 0.6

#: After a proof with too wide a bracket, the next one is attempted at the speed expected for a sufficiently narrow one,
#: times the first factor, but at most the present speed times the second.
_SOONER = 0.97
_SLOWEST = 0.95

#: Smallest interval between impacts, approximately, at a repeated proof, divided by the rounding of the time.
_RESOLVED = 8.0


class Rest(NamedTuple):
    """Time to rest (NaN: not yet), with proven bounds (NaN: not proven).

    ``stalled``: at rest only because time no longer advances.
    """

    lower: float
    upper: float
    time: float
    stalled: bool


@inlined
def time_of(ground: Ground, state: Record) -> float:
    """Return the time of a state."""
    return start_of(ground, state.piece) + state.offset


@inlined
def count_impact(state: Record) -> None:
    """Count an impact of a proven sequence or, before a proof, set the speed for the next attempt."""
    if state.proven_impacts > 0:
        state.proven_impacts += 1
    elif state.v > state.certificate_speed:
        state.certificate_speed = max(state.certificate_speed, _SLOWER * state.v)


@inlined
def record_proof(ground: Ground, block: Record, settings: Record, state: Record, proof: Proof) -> None:
    """Store the time since which chattering is proven and the speed for the next proof."""
    if not proof.upper >= 0.0:
        state.certificate_speed = _SLOWER * state.v
        return
    if state.proven_impacts == 0:
        state.proven_impacts = 1
        state.run_start = time_of(ground, state)
    excess = (proof.upper - proof.lower) / settings.tolerance
    if block.variable_restitution:
        # The width is proportional to the square of the speed, or to the speed if the factor is drawn.
        ratio = 1.0 / excess if is_drawn(block) else math.sqrt(1.0 / excess)
    else:
        wait = time_to_piece(ground, state, proof.time)
        # The width of a fourth-order bracket is proportional to the fifth power of the speed, of the geometric one to
        # its square. The former requires a rest within the present piece.
        ratio = _SOONER * excess**-0.2 if wait == 0.0 else 1.0 - wait / proof.time
        ratio = max(ratio, math.sqrt(1.0 / excess))
    # Approximate length of the next arc. Arcs are proportional to the speed, and must exceed the rounding of times.
    arc = (1.0 - max(block.restitution[0], block.restitution[1])) * proof.time
    least = _RESOLVED * ULP * time_of(ground, state) / arc if arc > 0.0 else 0.0
    state.certificate_speed = state.v * min(_SLOWEST, max(ratio, least))


@inlined
def time_to_piece(ground: Ground, state: Record, time: float) -> float:
    """Return the time from a state to the start of the piece that is reached ``time`` later."""
    piece = state.piece
    wait = 0.0
    reached = length_of(ground, piece) - state.offset
    while reached < time:
        wait = reached
        piece += 1
        reached += length_of(ground, piece)
    return wait


@shared
def proven_bounds(ground: Ground, block: Record, settings: Record, scratch: Record, state: Record) -> Proof:
    """Compute proven bounds on the time to rest, widened by the rounding of all times; all NaN: no proof."""
    lower, upper, time, height = prove_rest(ground, block, settings, scratch, state)
    rounding = allowance(time_of(ground, state), upper, state)
    return Proof(lower - rounding, upper + rounding, time, height)


@inlined
def allowance(time: float, upper: float, state: Record) -> float:
    """Compute an allowance for the rounding of times and of the arcs since the first proof."""
    since = time - state.run_start if state.proven_impacts > 0 else 0.0
    return 4.0 * ULP * time + 8.0 * ULP * (max(state.proven_impacts, 1) + 4) * (since + upper)


@shared
def rest_after_impact(ground: Ground, block: Record, settings: Record, state: Record, proof: Proof) -> Rest:
    """Decide whether the block comes to rest at an impact, given the proven bounds (NaN: none)."""
    time = time_of(ground, state)
    if settings.rest_rule == RestRule.CERTIFIED:
        if state.v == 0.0:
            rounding = allowance(time, 0.0, state)
            return Rest(-rounding, rounding, 0.0, False)
        # No unresolved rotation may exceed the resolved ones.
        good = max(settings.tolerance, 4.0 * allowance(time, proof.upper, state))
        if proof.upper - proof.lower <= good and proof.height <= state.peak:
            return Rest(proof.lower, proof.upper, proof.time, False)
    elif settings.rest_rule == RestRule.BYPASS:
        left = geometric_time(ground, block, state)
        if state.v <= block.limit[state.side] and left >= 0.0:
            return Rest(np.nan, np.nan, left, False)
    else:
        limit = block.limit[state.side]
        by_speed = settings.rest_rule == RestRule.VELOCITY and state.v <= limit
        by_interval = settings.rest_rule == RestRule.INTERVAL and time - state.last_impact_time <= limit
        by_time = settings.rest_rule == RestRule.TIME and time - state.last_uplift_time >= limit
        if by_speed or by_interval or by_time:
            return Rest(np.nan, np.nan, 0.0, False)
    stalled = has_stalled(ground, block, state)
    return Rest(np.nan, np.nan, 0.0 if stalled or state.v == 0.0 else np.nan, stalled)


@inlined
def geometric_time(ground: Ground, block: Record, state: Record) -> float:
    """Compute the time to rest after an impact under constant accelerations, or NaN if one does not press down.

    Sum of the paper's Eq. 75 without remainder: arcs of 2 v/g, with speeds reduced by a factor at each impact.
    """
    i, j = state.side, block.next_side[state.side]
    g_i = restoring(ground, block, i, state.piece, state.offset)
    g_j = restoring(ground, block, j, state.piece, state.offset)
    e_i, e_j = middle_factor(block, i, state.v), middle_factor(block, j, state.v)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0):
        return np.nan
    return 2.0 * state.v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)


@inlined
def has_stalled(ground: Ground, block: Record, state: Record) -> bool:
    """Return whether time hardly advanced since the last impact and will not until the next."""
    time = time_of(ground, state)
    fastest = max(abs(block.stiffness[0]), abs(block.stiffness[1]))
    least = ULP * (time + (1.0 / math.sqrt(fastest) if fastest > 0.0 else 0.0))
    pressed = restoring(ground, block, state.side, state.piece, state.offset)
    return bool(time - state.last_impact_time <= least and 2.0 * state.v <= least * pressed)


#: Largest |beta| and |gamma| of `proven_arc`, for which the relative truncation of its sums is below 2^-54.
LARGEST_BETA = 1.0 / 64.0
LARGEST_GAMMA = 2.0**-14


@shared
def pass_proven_impacts(
    ground: Ground, block: Record, settings: Record, table: Records, state: Record, left: float
) -> None:
    """March the linear model through some impacts within ``left``, up to the one with another proof.

    The ground acceleration is linear in time, and the state immediately after an impact.
    """
    rate = coefficient(ground, state.piece, 1)
    end = state.offset + left
    for _ in range(PROVEN_PER_ITERATION):
        side, v = state.side, state.v
        g = restoring(ground, block, side, state.piece, state.offset)
        t, speed = proven_arc(v, g, block.threshold_slope[side] * sign_of(side) * rate, block.stiffness[side])
        slower = block.restitution[side] * speed
        # The arc is below its first tangent.
        if not (t < end - state.offset and slower > state.certificate_speed and v * t <= state.peak):
            return
        state.side = block.next_side[side]
        state.v = slower
        state.offset += t
        state.last_impact_time = start_of(ground, state.piece) + state.offset
        state.impacts += 1
        state.proven_impacts += 1
        state.budget -= 1
        write_impact(settings, table, state, state.last_impact_time, speed)
        write_node(ground, settings, table, state)


@inlined
def proven_arc(v: float, g: float, rate: float, stiffness: float) -> Pair:
    """Compute duration and impact speed of an arc with initial speed v under g + rate t - stiffness u.

    Full precision for |beta| = |rate| v/g^2 and |gamma| = |stiffness| v^2/g^2 up to the limits above, NaN beyond. Half
    the duration is (v/g) x with x + b x^2 = 1, b = 2 beta/3, and a correction for gamma.
    """
    if not g > 0.0:
        return math.nan, math.nan
    inverse = 1.0 / g
    half = v * inverse  # half the duration under constant acceleration
    beta, gamma = rate * half * inverse, stiffness * half * half
    if not (abs(beta) <= LARGEST_BETA and abs(gamma) <= LARGEST_GAMMA):
        return math.nan, math.nan
    x = half_duration(2.0 * THIRD * beta)
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
def half_duration(b: float) -> float:
    """Compute the root of x + b x^2 = 1 near 1 for |b| <= 1/96, to full precision, by Catalan's numbers."""
    square = b * b
    fourth = square * square
    low = (1.0 - b) + square * (2.0 - 5.0 * b)
    middle = (14.0 - 42.0 * b) + square * (132.0 - 429.0 * b)
    high = (1430.0 - 4862.0 * b) + square * 16796.0
    return low + fourth * (middle + fourth * high)
