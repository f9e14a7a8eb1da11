"""Uplift: first time at which the ground acceleration passes the threshold of a side. A NaN never does.

The arguments ``A`` and ``d`` are scratch space.
"""

from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.events import first_root
from rocking.kernels.ground import (
    Ground,
    bounds_within,
    has_vertical,
    last_piece,
    length_of,
    local_series,
    move,
    next_beyond,
    start_of,
    vertical_of,
)
from rocking.kernels.restraints import apply_tendon_law, plastic_after
from rocking.kernels.state import AT_REST, Record, Records, stop_of
from rocking.kernels.trace import Trail

#: Accelerations that differ from a threshold by less than this fraction are at the threshold.
_ROUNDING = 2.0**-48


class Uplift(NamedTuple):
    """Uplift of a block: piece of the motion, offset within it, side, and whether the motion jumps there."""

    piece: int
    offset: float
    side: int
    jump: bool


@shared
def next_uplift(
    ground: Ground, block: Record, scratch: Record, resting: int, piece: int, offset: float, stop: float
) -> Uplift:
    """Find the first instant from (piece, offset) at which the motion passes a threshold of a body at rest.

    Without an uplift before ``stop``, the side is AT_REST and the piece the last one examined.
    """
    A, d = scratch.ground, scratch.other
    plus, minus = block.threshold[0], block.threshold[1]
    hold_plus, hold_minus = block.restraint_threshold[0], block.restraint_threshold[1]
    if block.two_stops:  # only the stop at which the body rests
        plus, minus = (plus, np.inf) if stop_of(resting) == 0 else (np.inf, minus)
    while True:
        following = next_beyond(ground, piece, (-plus, minus), (-hold_plus, hold_minus))
        if following > piece:
            piece, offset = following, 0.0
        if piece == last_piece(ground) or not start_of(ground, piece) + offset < stop:
            return Uplift(piece, offset, AT_REST, False)
        length = length_of(ground, piece)
        left = length - offset
        bounds = bounds_within(ground, piece, offset, left, A)
        weight = 1.0
        if has_vertical(ground):
            weight += bounds_within(vertical_of(ground), piece, offset, left, A).low
        if bounds.high > minus * weight + hold_minus or -bounds.low > plus * weight + hold_plus:
            degree = push_series(ground, piece, offset, plus, -1.0, A, d)
            to_plus, jump_plus = first_excess(A, degree, left, plus + hold_plus, -1.0, d)
            degree = push_series(ground, piece, offset, minus, 1.0, A, d)
            to_minus, jump_minus = first_excess(A, degree, left, minus + hold_minus, 1.0, d)
            passed = min(to_plus, to_minus)
            # If rounding puts a passing at the end of the piece, the next one decides, because the motion may turn
            # back.
            if offset + passed < length:
                side = stop_of(resting) if block.two_stops else 0
                if block.next_side[0] != 0:  # the body rests on both sides
                    side = lifted_side(ground, block, piece, offset + passed, length - offset - passed, A, d)
                return Uplift(piece, offset + passed, side, jump_minus if side == 1 else jump_plus)
        piece += 1
        offset = 0.0


@kernel
def next_uplifts(trail: Trail, scratch: Record, times: Floats) -> None:
    """Write the time of the next uplift from each node at rest, or inf if there is none.

    The law of a tendon that yields changes in the block of the trail.
    """
    ground, block, settings, nodes = trail
    plastic = 0.0
    for k in range(nodes.shape[0]):
        node = nodes[k]
        if block.yielding:
            plastic = plastic_after(block, settings, nodes, k, plastic)
            apply_tendon_law(block, node.law, plastic)
        if node.side < 0:
            found = next_uplift(ground, block, scratch, node.side, node.piece, node.offset, settings.stop)
            times[k] = start_of(ground, found.piece) + found.offset if found.side != AT_REST else np.inf


@inlined
def lifted_side(ground: Ground, block: Record, piece: int, offset: float, h: float, A: Floats, d: Floats) -> int:
    """Return the side of an uplift of a body that rests on both: the side whose threshold is exceeded by more within h.

    With a positive weight, it is the side whose threshold is passed. Without, both are passed at instants that differ
    only by rounding, and the push on the body decides: side + without a push.
    """
    degree = difference_series(ground, block, piece, offset, A, d)
    lead = leading_power(A, degree, h, rounding_of(A, degree, h))
    return 1 if lead <= degree and A[lead] > 0.0 else 0


@inlined
def is_hardly_pushed(ground: Ground, block: Record, piece: int, offset: float, h: float, A: Floats, d: Floats) -> bool:
    """Return whether the push has negligible leading terms, so that rounding decides the side without weight."""
    degree = difference_series(ground, block, piece, offset, A, d)
    hidden = 0.0
    for k in range(leading_power(A, degree, h, rounding_of(A, degree, h))):
        hidden += abs(A[k])
    return hidden > 0.0


@inlined
def difference_series(ground: Ground, block: Record, piece: int, offset: float, A: Floats, d: Floats) -> int:
    """Write half the difference of the excess over both thresholds (side - minus side +) into A; return its degree.

    Without restraints this is the horizontal motion, even for unequal sides: both thresholds vanish with the weight.
    """
    if block.restraint_threshold[0] == 0.0 and block.restraint_threshold[1] == 0.0:
        return local_series(ground, piece, offset, 1.0, A)
    uneven = 0.5 * (block.threshold[1] - block.threshold[0])
    degree = push_series(ground, piece, offset, uneven, 1.0, A, d)
    A[0] -= uneven + 0.5 * (block.restraint_threshold[1] - block.restraint_threshold[0])
    return degree


@inlined
def push_series(ground: Ground, piece: int, offset: float, threshold: float, sign: float, A: Floats, d: Floats) -> int:
    """Write the polynomial that, times ``sign``, is compared with a threshold into A, and return its degree.

    It is the motion minus the contribution of the vertical component to the threshold.
    """
    degree = local_series(ground, piece, offset, 1.0, A)
    if not has_vertical(ground) or threshold == np.inf:  # the threshold of a side that is never lifted stays infinite
        return degree
    changes = local_series(vertical_of(ground), piece, offset, 1.0, d)
    for k in range(degree + 1, changes + 1):
        A[k] = 0.0
    for k in range(changes + 1):
        A[k] -= sign * threshold * d[k]
    return max(degree, changes)


@shared
def first_excess(A: Floats, degree: int, h: float, threshold: float, sign: float, d: Floats) -> tuple[float, bool]:
    """Find the first time in [0, h) from which sign * A(t) > threshold (else inf), and whether that is a jump."""
    gap = threshold - sign * A[0]
    if gap < -_ROUNDING * abs(threshold):
        return 0.0, True
    if degree <= 1:
        rate = sign * A[1] if degree == 1 else 0.0
        if rate > 0.0 and gap < rate * h - _ROUNDING * abs(threshold):
            return max(0.0, gap) / rate, False
        return np.inf, False
    d[0] = gap
    for k in range(1, degree + 1):
        d[k] = -sign * A[k]
    return first_passing(d, degree, h), False


@shared
def first_passing(d: Floats, degree: int, h: float) -> float:
    """Find the first time in [0, h) from which a polynomial is negative beyond rounding; inf if never.

    It is not negative before. A root without a change of sign is divided out, and the search continues. Changes ``d``.
    """
    rounding = rounding_of(d, degree, h)
    start = 0.0
    for _ in range(degree + 1):
        lead = leading_power(d, degree, h - start, rounding)
        if lead > degree:
            return np.inf
        if d[lead] < 0.0:
            return start
        time = first_root(d, lead, degree, h - start)
        if not start + time < h:
            return np.inf
        move(d, degree, time)
        start += time
        if d[1] < 0.0 and d[1] * d[1] <= 2.0 * d[2] * rounding:  # a minimum below zero by less than rounding
            across = -2.0 * d[1] / d[2]
            move(d, degree, across)
            start += across
        d[0] = 0.0
    return np.inf


@inlined
def rounding_of(d: Floats, degree: int, h: float) -> float:
    """Bound the rounding of a polynomial within h."""
    rounding = 0.0
    for k in range(degree, -1, -1):
        rounding = rounding * h + _ROUNDING * abs(d[k])
    return rounding


@inlined
def leading_power(d: Floats, degree: int, h: float, rounding: float) -> int:
    """Return the lowest power of a polynomial that is not negligible within h; above ``degree`` if there is none."""
    lead = 0
    power = 1.0
    while lead <= degree and abs(d[lead]) * power <= rounding:
        lead += 1
        power *= h
    return lead


#: A motion is back within a threshold once below by this fraction, so that rounding causes no second passing.
_BACK = 2.0**-40


@kernel
def note_complete(ground: Ground, blocks: Records, states: Records, scratch: Record, complete: Flags) -> None:
    """Write whether the chattering after the first uplift was complete, for each block that started at rest."""
    for k in range(blocks.shape[0]):
        state = states[k]
        complete[k] = state.rests > 0 and not passes_again(ground, blocks[k], scratch, state)


@inlined
def passes_again(ground: Ground, block: Record, scratch: Record, state: Record) -> bool:
    """Return whether the motion, after an uplift and a return within the thresholds, passes one before the rest."""
    until = state.first_rest
    lifted = next_uplift(ground, block, scratch, AT_REST, piece_before(ground, state.first_uplift), 0.0, until)
    if lifted.side == AT_REST:
        return False
    piece, offset = back_within(ground, block, scratch, lifted)
    again = next_uplift(ground, block, scratch, AT_REST, piece, offset, until)
    return bool(again.side != AT_REST and start_of(ground, again.piece) + again.offset < until)


@inlined
def piece_before(ground: Ground, time: float) -> int:
    """Return the last piece that is over before a time, or the first one."""
    low, high = 0, last_piece(ground)
    while high - low > 1:
        middle = (low + high) // 2
        if start_of(ground, middle) < time:
            low = middle
        else:
            high = middle
    return max(0, low - 1)


@inlined
def back_within(ground: Ground, block: Record, scratch: Record, lifted: Uplift) -> tuple[int, float]:
    """Return the piece and offset from which the motion exceeds neither threshold.

    The motion may jump from one threshold to the other and, without a positive weight, exceed both.
    """
    piece, offset, side = lifted.piece, lifted.offset, lifted.side
    while piece < last_piece(ground):
        until = offset + time_beyond(ground, block, scratch, piece, offset, side)
        if until == offset:
            side = 1 - side
            until = offset + time_beyond(ground, block, scratch, piece, offset, side)
        if until == offset:
            return piece, offset
        offset = until
        if not offset < length_of(ground, piece):
            piece += 1
            offset = 0.0
    return piece, 0.0


@inlined
def time_beyond(ground: Ground, block: Record, scratch: Record, piece: int, offset: float, side: int) -> float:
    """Return the time for which the motion exceeds a threshold within a piece; inf if to its end."""
    sign, threshold = 1.0 if side == 1 else -1.0, block.threshold[side]
    if threshold == np.inf:
        return 0.0
    A, d = scratch.ground, scratch.other
    degree = push_series(ground, piece, offset, threshold, sign, A, d)
    threshold += block.restraint_threshold[side]
    d[0] = sign * A[0] - (threshold - _BACK * abs(threshold))
    for k in range(1, degree + 1):
        d[k] = sign * A[k]
    return first_passing(d, degree, length_of(ground, piece) - offset)
