"""Uplift: first time at which the ground acceleration passes the threshold of a side. A NaN never does.

The arguments ``A`` and ``d`` are scratch space. Accelerations that differ from a threshold by less than the fraction
`ROUNDING` are at the threshold.
"""

from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats, Integers
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import bound_rounding, find_first_negative_beyond_rounding, find_leading_power
from rocking.kernels.ground import (
    ROUNDING,
    Ground,
    Grounds,
    bound_piece,
    find_piece_beyond,
    has_vertical,
    last_piece,
    piece_length,
    piece_start,
    select_ground,
    select_vertical,
    write_local_series,
)
from rocking.kernels.restraints import apply_tendon_law, update_plastic_elongation
from rocking.kernels.state import AT_REST, Struct, Structs, find_stop_of_resting_side
from rocking.kernels.trace import Trail


class Uplift(NamedTuple):
    """Uplift of a block."""

    piece: int  # piece of the motion
    offset: float  # time since the start of the piece
    side: int  # side of the rotation; AT_REST without an uplift
    is_jump: bool  # whether the motion jumps past the threshold


@inlined
def find_threshold(block: Struct, side: int) -> float:
    """Return the threshold of a side, of an uplift or of a slip."""
    return min(block.threshold[side], block.static_friction) if block.has_friction else block.threshold[side]


@not_inlined
def find_next_uplift(
    ground: Ground, block: Struct, scratch: Struct, resting: int, piece: int, offset: float, stop_time: float
) -> Uplift:
    """Find the first instant from (piece, offset) at which the motion passes a threshold of a body at rest.

    Without an uplift before ``stop_time``, the side is AT_REST and the piece the last one examined.
    """
    A, d = scratch.ground, scratch.auxiliary
    plus, minus = find_threshold(block, 0), find_threshold(block, 1)
    restraint_plus, restraint_minus = block.restraint_threshold[0], block.restraint_threshold[1]
    if block.two_stops:  # only the stop at which the body rests
        plus, minus = (plus, np.inf) if find_stop_of_resting_side(resting) == 0 else (np.inf, minus)
    while True:
        next_piece = find_piece_beyond(ground, piece, (-plus, minus), (-restraint_plus, restraint_minus))
        if next_piece > piece:
            piece, offset = next_piece, 0.0
        if piece == last_piece(ground) or not piece_start(ground, piece) + offset < stop_time:
            return Uplift(piece, offset, AT_REST, False)
        length = piece_length(ground, piece)
        remaining = length - offset
        bounds = bound_piece(ground, piece, offset, remaining, A)
        weight = 1.0
        if has_vertical(ground):
            weight += bound_piece(select_vertical(ground), piece, offset, remaining, A).low
        if bounds.high > minus * weight + restraint_minus or -bounds.low > plus * weight + restraint_plus:
            degree = write_push(ground, piece, offset, plus, -1.0, A, d)
            to_plus, jump_plus = find_first_excess(A, degree, remaining, plus + restraint_plus, -1.0, d)
            degree = write_push(ground, piece, offset, minus, 1.0, A, d)
            to_minus, jump_minus = find_first_excess(A, degree, remaining, minus + restraint_minus, 1.0, d)
            passage = min(to_plus, to_minus)
            # If rounding puts a passing at the end of the piece, the next one decides, because the motion may turn
            # back.
            if offset + passage < length:
                side = find_stop_of_resting_side(resting) if block.two_stops else 0
                if block.next_side[0] != 0:  # the body rests on both sides
                    side = find_uplift_side(ground, block, piece, offset + passage, length - offset - passage, A, d)
                return Uplift(piece, offset + passage, side, jump_minus if side == 1 else jump_plus)
        piece += 1
        offset = 0.0


@kernel
def write_next_uplifts(trail: Trail, scratch: Struct, times: Floats) -> None:
    """Write the time of the next uplift from each node at rest, or inf if there is none.

    The law of a tendon that yields changes in the block of the trail.
    """
    ground, block, settings, nodes = trail
    plastic_elongation = 0.0
    for k in range(nodes.shape[0]):
        node = nodes[k]
        if block.yielding:
            plastic_elongation = update_plastic_elongation(block, settings, nodes, k, plastic_elongation)
            apply_tendon_law(block, node.tendon_law, plastic_elongation)
        if node.side < 0:
            uplift = find_next_uplift(ground, block, scratch, node.side, node.piece, node.offset, settings.stop_time)
            times[k] = piece_start(ground, uplift.piece) + uplift.offset if uplift.side != AT_REST else np.inf


@inlined
def find_uplift_side(ground: Ground, block: Struct, piece: int, offset: float, h: float, A: Floats, d: Floats) -> int:
    """Return the side of an uplift of a body that rests on both: the side whose threshold is exceeded by more within h.

    With a positive weight, it is the side whose threshold is passed. Without, both are passed at instants that differ
    only by rounding, and the push on the body decides: side + without a push.
    """
    degree = write_threshold_difference(ground, block, piece, offset, A, d)
    lead = find_leading_power(A, degree, h, bound_rounding(A, degree, h))
    return 1 if lead <= degree and A[lead] > 0.0 else 0


@inlined
def is_side_uncertain(ground: Ground, block: Struct, piece: int, offset: float, h: float, A: Floats, d: Floats) -> bool:
    """Return whether the push has negligible leading terms, so that rounding decides the side without weight."""
    degree = write_threshold_difference(ground, block, piece, offset, A, d)
    negligible_terms = 0.0
    for k in range(find_leading_power(A, degree, h, bound_rounding(A, degree, h))):
        negligible_terms += abs(A[k])
    return negligible_terms > 0.0


@inlined
def write_threshold_difference(ground: Ground, block: Struct, piece: int, offset: float, A: Floats, d: Floats) -> int:
    """Write half the difference of the excess over both thresholds (side - minus side +) into A; return its degree.

    Without restraints this is the horizontal motion, even for unequal sides: both thresholds vanish with the weight.
    """
    if block.restraint_threshold[0] == 0.0 and block.restraint_threshold[1] == 0.0:
        return write_local_series(ground, piece, offset, 1.0, A)
    half_difference = 0.5 * (block.threshold[1] - block.threshold[0])
    degree = write_push(ground, piece, offset, half_difference, 1.0, A, d)
    A[0] -= half_difference + 0.5 * (block.restraint_threshold[1] - block.restraint_threshold[0])
    return degree


@inlined
def write_push(ground: Ground, piece: int, offset: float, threshold: float, sign: float, A: Floats, d: Floats) -> int:
    """Write the polynomial that, times ``sign``, is compared with a threshold into A, and return its degree.

    It is the motion minus the contribution of the vertical component to the threshold.
    """
    degree = write_local_series(ground, piece, offset, 1.0, A)
    if not has_vertical(ground) or threshold == np.inf:  # the threshold of a side that is never lifted stays infinite
        return degree
    weight_degree = write_local_series(select_vertical(ground), piece, offset, 1.0, d)
    for k in range(degree + 1, weight_degree + 1):
        A[k] = 0.0
    for k in range(weight_degree + 1):
        A[k] -= sign * threshold * d[k]
    return max(degree, weight_degree)


@not_inlined
def find_first_excess(A: Floats, degree: int, h: float, threshold: float, sign: float, d: Floats) -> tuple[float, bool]:
    """Find the first time in [0, h) from which sign * A(t) > threshold (else inf), and whether that is a jump."""
    gap = threshold - sign * A[0]
    if gap < -ROUNDING * abs(threshold):
        return 0.0, True
    if degree <= 1:
        rate = sign * A[1] if degree == 1 else 0.0
        if rate > 0.0 and gap < rate * h - ROUNDING * abs(threshold):
            return max(0.0, gap) / rate, False
        return np.inf, False
    d[0] = gap
    for k in range(1, degree + 1):
        d[k] = -sign * A[k]
    return find_first_negative_beyond_rounding(d, degree, h), False


#: A motion is back within a threshold once below by this fraction, so that rounding causes no second passing.
_RETURN_MARGIN = 2.0**-40


@kernel
def write_completeness(
    grounds: Grounds,
    motions: Integers,
    factors: Floats,
    blocks: Structs,
    states: Structs,
    scratch: Struct,
    complete: Flags,
) -> None:
    """Write whether the chattering after the first uplift was complete, for each block that started at rest."""
    for k in range(blocks.shape[0]):
        state = states[k]
        ground = select_ground(grounds, motions[k], factors[k])
        complete[k] = state.rest_count > 0 and not exceeds_threshold_again(ground, blocks[k], scratch, state)


@inlined
def exceeds_threshold_again(ground: Ground, block: Struct, scratch: Struct, state: Struct) -> bool:
    """Return whether the motion, after an uplift and a return within the thresholds, passes one before the rest."""
    rest_time = state.first_rest
    uplift = find_next_uplift(
        ground, block, scratch, AT_REST, find_piece_before(ground, state.first_uplift), 0.0, rest_time
    )
    if uplift.side == AT_REST:
        return False
    piece, offset = find_return(ground, block, scratch, uplift)
    passage = find_next_uplift(ground, block, scratch, AT_REST, piece, offset, rest_time)
    return bool(passage.side != AT_REST and piece_start(ground, passage.piece) + passage.offset < rest_time)


@inlined
def find_piece_before(ground: Ground, time: float) -> int:
    """Return the last piece that is over before a time, or the first one."""
    low, high = 0, last_piece(ground)
    while high - low > 1:
        middle = (low + high) // 2
        if piece_start(ground, middle) < time:
            low = middle
        else:
            high = middle
    return max(0, low - 1)


@inlined
def find_return(ground: Ground, block: Struct, scratch: Struct, uplift: Uplift) -> tuple[int, float]:
    """Return the piece and offset from which the motion exceeds neither threshold.

    The motion may jump from one threshold to the other and, without a positive weight, exceed both.
    """
    piece, offset, side = uplift.piece, uplift.offset, uplift.side
    while piece < last_piece(ground):
        end = offset + measure_time_above_threshold(ground, block, scratch, piece, offset, side)
        if end == offset:
            side = 1 - side
            end = offset + measure_time_above_threshold(ground, block, scratch, piece, offset, side)
        if end == offset:
            return piece, offset
        offset = end
        if not offset < piece_length(ground, piece):
            piece += 1
            offset = 0.0
    return piece, 0.0


@inlined
def measure_time_above_threshold(
    ground: Ground, block: Struct, scratch: Struct, piece: int, offset: float, side: int
) -> float:
    """Return the time for which the motion exceeds a threshold within a piece; inf if to its end."""
    sign, threshold = 1.0 if side == 1 else -1.0, find_threshold(block, side)
    if threshold == np.inf:
        return 0.0
    A, d = scratch.ground, scratch.auxiliary
    degree = write_push(ground, piece, offset, threshold, sign, A, d)
    threshold += block.restraint_threshold[side]
    d[0] = sign * A[0] - (threshold - _RETURN_MARGIN * abs(threshold))
    for k in range(1, degree + 1):
        d[k] = sign * A[k]
    return find_first_negative_beyond_rounding(d, degree, piece_length(ground, piece) - offset)
