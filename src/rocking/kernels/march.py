"""The whole response of one block to one motion: rest, uplift, arc, impact, and so on to the end."""

import math

import numpy as np

from rocking.kernels.arc import evaluate, expand, restoring
from rocking.kernels.certificate import unproven
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.ground import Ground, has_vertical, is_straight, last_piece, length_of, start_of
from rocking.kernels.impact import Arrival, advance, strike
from rocking.kernels.proven import pass_proven_impacts
from rocking.kernels.rest import ULP, Rest, note_impact, note_proof, proven_bounds, rest_after_impact, time_of
from rocking.kernels.root import first_root
from rocking.kernels.short_arc import short_step
from rocking.kernels.state import AT_REST, Record, Records
from rocking.kernels.status import (
    BALANCED,
    CERTIFIED,
    DONE,
    FELL,
    FULL,
    GOING,
    IMPACT,
    OVERTURN,
    PAUSED,
    REST,
    STEP,
    TOPPLED,
    UNDECIDED,
    UPLIFT,
)
from rocking.kernels.tables import has_room, write_event, write_impact, write_node, write_sequence
from rocking.kernels.uplift import next_uplift

# Further outcomes of an arc, besides STEP, IMPACT and OVERTURN.
_STOPPED = 3
_STUCK = 4

#: Depth of a dip below zero rotation that is lost in rounding, over the highest rotation so far.
_TOUCH = 2.0**-46

#: Distance from zero rotation at which that may be decided by the rounding of what was given.
_NEAR_TIE = 2.0**-36


@kernel
def march(ground: Ground, block: Record, rules: Record, table: Records, scratch: Record, state: Record) -> int:
    """Follow one block through one motion, from its state on; returns how it ended (`status`).

    GOING: the piece ``state.until`` is reached; a block at rest may have gone on to its next uplift. PAUSED: the
    budget is spent. FULL: the table has no room left. After each of them, call again with the same state.
    """
    while state.piece < state.until:
        if state.budget <= 0:
            return PAUSED
        if not has_room(rules, table, state):
            return FULL
        state.budget -= 1
        ending = turn(ground, block, rules, table, scratch, state)
        if ending != GOING:
            return ending
    return GOING


@inlined
def turn(ground: Ground, block: Record, rules: Record, table: Records, scratch: Record, state: Record) -> int:
    """One turn of a march: to the next uplift of a block at rest, or along an arc to its first event."""
    write_node(ground, rules, table, state)
    if state.side == AT_REST:
        return lift_off(ground, block, rules, table, scratch, state)
    if state.run > 0 and state.u == 0.0 and may_pass(ground, rules):
        pass_proven_impacts(ground, block, rules, table, state, time_left(ground, rules, state))
    outcome = follow_arc(ground, block, rules, scratch, state)
    if outcome == IMPACT:
        return pass_impact(ground, block, rules, table, scratch, state)
    if outcome == OVERTURN:
        return fall(ground, block, rules, table, state)
    if outcome == _STOPPED:
        return stop(ground, rules, table, state)
    return BALANCED if outcome == _STUCK else GOING


@inlined
def may_pass(ground: Ground, rules: Record) -> bool:
    """Whether impacts of a proven sequence can be passed at once: stiffness does not change, and pushes evenly."""
    return not rules.nonlinear and is_straight(ground) and not has_vertical(ground)


@inlined
def lift_off(ground: Ground, block: Record, rules: Record, table: Records, scratch: Record, state: Record) -> int:
    """Stay at rest until the motion passes a threshold; DONE when it never does, and the response is over."""
    found = next_uplift(ground, block, scratch, state.piece, state.offset, rules.stop)
    if found.side == AT_REST or start_of(ground, found.piece) + found.offset >= rules.stop:
        over = start_of(ground, last_piece(ground))
        state.end = max(state.rested, over) if rules.endless else rules.stop
        state.resting += state.end - state.rested
        return DONE
    state.piece = found.piece
    state.offset = found.offset
    state.side = found.side
    state.smooth = not found.jump
    state.u = state.v = 0.0
    state.uplifted = state.struck = time_of(ground, state)
    state.worth = np.inf
    state.resting += state.uplifted - state.rested
    if state.uplifts == 0:
        state.first_uplift = state.uplifted
    state.uplifts += 1
    if has_vertical(ground) and state.rests > 0 and state.uplifted - state.rested <= _NEAR_TIE * state.uplifted:
        # The last of its impacts may have come too late.
        state.near_ties += is_weightless(ground, block, state, state.offset)
    write_event(rules, table, state, state.uplifted, UPLIFT)
    return GOING


@inlined
def follow_arc(ground: Ground, block: Record, rules: Record, scratch: Record, state: Record) -> int:
    """One Taylor step along the arc, or as much of it as its first event leaves."""
    left = time_left(ground, rules, state)
    if left <= 0.0:
        return _STOPPED
    arrival = Arrival(UNDECIDED, 0.0, 0.0, 0.0, 0.0, 0.0)
    if not state.smooth:
        arrival = short_step(ground, block, rules, state, left)
    if arrival.outcome == UNDECIDED:
        arrival = long_step(ground, block, rules, scratch, state, left)
    if has_vertical(ground) and arrival.outcome == STEP and state.v < 0.0 <= arrival.v:
        state.near_ties += nearly_touches(ground, block, rules, scratch, state, arrival.time)
    return arrive(ground, rules, state, arrival, left)


@inlined
def long_step(ground: Ground, block: Record, rules: Record, scratch: Record, state: Record, left: float) -> Arrival:
    """Step along the full series of the arc."""
    order, h, _ = expand(ground, block, rules, scratch, state, left)
    if state.smooth:  # the acceleration at an uplift is zero, whatever rounding says
        scratch.rotation[2] = 0.0
    balanced = state.v == 0.0 and scratch.rotation[2] == 0.0
    if balanced and state.piece == last_piece(ground) and rules.endless:
        return Arrival(_STUCK, 0.0, state.u, 0.0, 0.0, 0.0)
    return advance(state, scratch, order, h, block.fallen)


@inlined
def arrive(ground: Ground, rules: Record, state: Record, arrival: Arrival, left: float) -> int:
    """Take the state to the end of a step; returns what ended it."""
    if arrival.height > state.peak:
        state.peak = arrival.height
        state.peak_time = time_of(ground, state) + arrival.top
    stopped = arrival.outcome == STEP and arrival.time >= left and is_last(ground, rules, state)
    pass_time(state, arrival.time)
    state.u = arrival.u
    state.v = arrival.v
    state.smooth = False
    if stopped:
        return _STOPPED
    if arrival.outcome == STEP:
        enter_piece(ground, state, arrival.time >= left)
    return arrival.outcome


@inlined
def pass_impact(ground: Ground, block: Record, rules: Record, table: Records, scratch: Record, state: Record) -> int:
    """Pass an impact, and come to rest where it is so decided; DONE when the march ends there."""
    settle(ground, state)
    if has_vertical(ground) and is_weightless(ground, block, state, state.offset):
        pushed = abs(restoring(ground, block, state.side, state.piece, state.offset))
        depth = 0.5 * state.v * state.v / pushed  # of the dip below zero rotation, if there were no ground
        state.near_ties += depth <= _NEAR_TIE * state.peak
        if depth <= _TOUCH * state.peak:  # no impact, which would leave the block on the other side
            state.v = 0.0
            return GOING
    time = time_of(ground, state)
    speed = strike(block, state)
    write_impact(rules, table, state, time, speed)
    note_impact(state)
    proof = unproven()
    if rules.treatment == CERTIFIED and state.v <= state.worth:
        proof = proven_bounds(ground, block, rules, scratch, state)
        note_proof(ground, rules, state, proof)
    rest = rest_after_impact(ground, block, rules, state, proof)
    state.struck = time
    if math.isnan(rest.time):
        return GOING
    return come_to_rest(ground, rules, table, state, rest)


@inlined
def is_weightless(ground: Ground, block: Record, state: Record, offset: float) -> bool:
    """Whether a block at zero rotation is pushed off to both sides at an offset of its piece."""
    here = restoring(ground, block, state.side, state.piece, offset)
    other = restoring(ground, block, block.entered[state.side], state.piece, offset)
    return bool(here < 0.0 and other < 0.0)


@shared
def nearly_touches(ground: Ground, block: Record, rules: Record, scratch: Record, state: Record, h: float) -> bool:
    """Whether the arc from a state turns within h so near to the ground that rounding may hide an impact.

    Where weight presses the block down it goes on alike with the impact and without.
    """
    order, _, _ = expand(ground, block, rules, scratch, state, h)
    c, d = scratch.rotation, scratch.spare
    for k in range(order):
        d[k] = -(k + 1) * c[k + 1]
    turn = first_root(d, 0, order - 1, h)
    lowest, _, _ = evaluate(c, order, turn)
    return bool(lowest <= _NEAR_TIE * state.peak and is_weightless(ground, block, state, state.offset + turn))


@inlined
def come_to_rest(ground: Ground, rules: Record, table: Records, state: Record, rest: Rest) -> int:
    """Close a sequence of impacts; DONE when the march stops before the block is at rest."""
    time = time_of(ground, state)
    state.stalled += rest.stalled
    if state.run == 0 or not rest.upper >= 0.0:
        state.run = 1
        state.run_start = time
    write_node(ground, rules, table, state)
    write_sequence(rules, table, state, time, (rest.lower, rest.upper, rest.time))
    state.run = 0
    if time + rest.time >= rules.stop:
        state.end = rules.stop
        return DONE
    state.side = AT_REST
    state.u = state.v = 0.0
    state.rested = time + rest.time
    if state.rests == 0:
        state.first_rest = state.rested
    state.rests += 1
    write_event(rules, table, state, state.rested, REST)
    state.offset += rest.time
    settle(ground, state)
    return GOING


@inlined
def fall(ground: Ground, block: Record, rules: Record, table: Records, state: Record) -> int:
    """End a march in overturning."""
    state.end = state.peak_time = time_of(ground, state)
    state.peak = block.fallen
    write_node(ground, rules, table, state)
    write_event(rules, table, state, state.end, TOPPLED)
    return FELL


@inlined
def stop(ground: Ground, rules: Record, table: Records, state: Record) -> int:
    """End a march where it was told to stop, in the middle of an arc."""
    state.end = rules.stop
    write_node(ground, rules, table, state)
    return DONE


@inlined
def time_left(ground: Ground, rules: Record, state: Record) -> float:
    """Time to the end of the piece, or of the response where that comes first."""
    until_stop = rules.stop - start_of(ground, state.piece) - state.offset
    return min(length_of(ground, state.piece) - state.offset, until_stop)


@inlined
def is_last(ground: Ground, rules: Record, state: Record) -> bool:
    """Whether the response ends within the piece."""
    until_stop = rules.stop - start_of(ground, state.piece) - state.offset
    return bool(until_stop <= length_of(ground, state.piece) - state.offset)


@inlined
def pass_time(state: Record, t: float) -> None:
    """Move on by t, and never by nothing, so that every march ends."""
    start = state.offset
    state.offset += t
    if state.offset == start:
        state.offset += ULP * start


@inlined
def enter_piece(ground: Ground, state: Record, over: bool) -> None:
    """After a step: the start of the next piece if this one is over, by the step's length or by rounding."""
    if over:
        state.piece += 1
        state.offset = 0.0
    else:
        settle(ground, state)


@inlined
def settle(ground: Ground, state: Record) -> None:
    """Bring the offset inside its own piece."""
    while state.offset >= length_of(ground, state.piece):
        state.offset -= length_of(ground, state.piece)
        state.piece += 1
