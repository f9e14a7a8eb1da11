"""Complete response of one block to one motion."""

import math
from typing import Any

import numpy as np

from rocking.kernels.arc import evaluate, expand, restoring
from rocking.kernels.certificate import unproven
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.events import StepEnd, advance, apply_impact, first_root, raise_peak
from rocking.kernels.ground import Ground, has_vertical, is_straight, last_piece, length_of, start_of
from rocking.kernels.rest import (
    ULP,
    Rest,
    count_impact,
    pass_proven_impacts,
    proven_bounds,
    record_proof,
    rest_after_impact,
    time_of,
)
from rocking.kernels.restraints import apply_tendon_law, change_law, elongation_at, leaning_at, next_law
from rocking.kernels.short_arc import short_step, undecided
from rocking.kernels.state import (
    AT_REST,
    Ending,
    EventKind,
    Outcome,
    Record,
    Records,
    RestRule,
    TendonLaw,
    has_space,
    resting_side,
    write_event,
    write_impact,
    write_node,
    write_sequence,
)
from rocking.kernels.uplift import is_hardly_pushed, next_uplift

#: Distance from zero rotation within rounding, divided by the largest rotation so far.
_TOUCH = 2.0**-46

#: Distance, divided likewise, at which the rounding of the input may decide on an impact.
_NEAR_TIE = 2.0**-36


@kernel
def march(ground: Ground, block: Record, settings: Record, table: Records, scratch: Record, state: Record) -> int:
    """Simulate one block under one motion from its state on; return an `Ending` as a plain integer.

    RUNNING: the piece ``state.stop_piece`` is reached; a block at rest may be at its next uplift. PAUSED: the budget is
    spent. FULL: the table is full. After each, call again with the same state.
    """
    if block.yielding:
        initialise_tendon(ground, block, settings, state)
    while state.piece < state.stop_piece:
        if state.budget <= 0:
            return Ending.PAUSED.value
        if not has_space(settings, table, state):
            return Ending.FULL.value
        state.budget -= 1
        ending = march_step(ground, block, settings, table, scratch, state)
        if ending != Ending.RUNNING:
            return ending.value
    return Ending.RUNNING.value


@inlined
def initialise_tendon(ground: Ground, block: Record, settings: Record, state: Record) -> None:
    """Apply the law of the state to a tendon; one that starts too far from rest has already yielded."""
    if time_of(ground, state) == 0.0 and state.side >= 0:
        stretched = elongation_at(block, settings.nonlinear, state.side, state.u) - block.yields
        state.plastic = max(state.plastic, stretched)
    apply_tendon_law(block, state.law, state.plastic)


@inlined
def march_step(ground: Ground, block: Record, settings: Record, table: Records, scratch: Record, state: Record) -> Any:
    """Advance a block to its next uplift or, along an arc, to its first event."""
    write_node(ground, settings, table, state)
    if state.side < 0:
        return rest_until_uplift(ground, block, settings, table, scratch, state)
    plain = is_straight(ground) and not (has_vertical(ground) or settings.nonlinear)
    if state.proven_impacts > 0 and state.u == 0.0 and plain and not (block.restrained or block.variable_restitution):
        pass_proven_impacts(ground, block, settings, table, state, time_left(ground, settings, state))
    outcome = follow_arc(ground, block, settings, scratch, state)
    if outcome == Outcome.IMPACT or (outcome == Outcome.OVERTURN and block.two_stops):
        return pass_impact(ground, block, settings, table, scratch, state)
    if outcome == Outcome.OVERTURN:
        state.end = state.peak_time = time_of(ground, state)
        state.peak = block.overturn_angle
        write_node(ground, settings, table, state)
        write_event(settings, table, state, state.end, EventKind.OVERTURN)
        return Ending.OVERTURNED
    if outcome == Outcome.STOPPED:
        state.end = settings.stop
        state.peak_time = min(state.peak_time, settings.stop)  # rounding may put a peak at the stop slightly later
        write_node(ground, settings, table, state)
        return Ending.DONE
    if outcome == Outcome.LEANS:
        state.end = time_of(ground, state)
        return Ending.LEANS
    return Ending.BALANCED if outcome == Outcome.BALANCED else Ending.RUNNING


@inlined
def rest_until_uplift(
    ground: Ground, block: Record, settings: Record, table: Records, scratch: Record, state: Record
) -> int:
    """Keep a block at rest until the motion passes a threshold; DONE if it never does."""
    found = next_uplift(ground, block, scratch, state.side, state.piece, state.offset, settings.stop)
    if found.side == AT_REST or start_of(ground, found.piece) + found.offset >= settings.stop:
        over = start_of(ground, last_piece(ground))
        state.end = max(state.last_rest_time, over) if settings.no_end_time else settings.stop
        state.time_at_rest += state.end - state.last_rest_time
        return Ending.DONE
    state.piece = found.piece
    state.offset = found.offset
    state.side = found.side
    state.continuous_uplift = not found.jump
    state.u = state.v = 0.0
    state.last_uplift_time = state.last_impact_time = time_of(ground, state)
    state.certificate_speed = np.inf
    state.time_at_rest += state.last_uplift_time - state.last_rest_time
    if state.uplifts == 0:
        state.first_uplift = state.last_uplift_time
    state.uplifts += 1
    if has_vertical(ground) and is_weightless(ground, block, state, state.offset):
        left = length_of(ground, state.piece) - state.offset
        A, d = scratch.ground, scratch.other
        if block.next_side[0] != 0 and is_hardly_pushed(ground, block, state.piece, state.offset, left, A, d):
            state.rounding_decisions += 1
        elif state.rests > 0 and state.last_uplift_time - state.last_rest_time <= _NEAR_TIE * state.last_uplift_time:
            state.rounding_decisions += 1  # the last of its impacts may have been too late
    write_event(settings, table, state, state.last_uplift_time, EventKind.UPLIFT)
    return Ending.RUNNING


@inlined
def follow_arc(ground: Ground, block: Record, settings: Record, scratch: Record, state: Record) -> int:
    """Take one Taylor step along the arc, at most to its first event, and return its `Outcome`."""
    left = time_left(ground, settings, state)
    if left <= 0.0:
        return Outcome.STOPPED
    end = undecided()
    if not state.continuous_uplift:
        end = short_step(ground, block, settings, state, left)
    if end.outcome == Outcome.UNDECIDED:
        end = long_step(ground, block, settings, scratch, state, left)
    if state.v < 0.0 <= end.v and end.outcome == Outcome.STEP:
        state.rounding_decisions += nearly_touches(ground, block, settings, scratch, state, end.time)
    return finish_step(ground, settings, state, end, left)


@inlined
def long_step(ground: Ground, block: Record, settings: Record, scratch: Record, state: Record, left: float) -> StepEnd:
    """Step along the full series of the arc."""
    order, h, _ = expand(ground, block, settings, scratch, state, left)
    if state.continuous_uplift:  # by rounding, an uplift may seem to be pushed back
        scratch.rotation[2] = max(0.0, scratch.rotation[2])
    if block.restrained and settings.no_end_time and state.piece == last_piece(ground):
        leaning = leaning_at(block, settings, state, 2.0 * scratch.rotation[2])
        if leaning > 0.0:
            state.leaning = leaning
            return StepEnd(Outcome.LEANS, 0.0, state.u, state.v, 0.0, state.u)
    if block.yielding:
        return yielding_step(block, settings, scratch, state, order, h)
    balanced = state.v == 0.0 and scratch.rotation[2] == 0.0
    if balanced and state.piece == last_piece(ground) and settings.no_end_time:
        return StepEnd(Outcome.BALANCED, 0.0, state.u, 0.0, 0.0, 0.0)
    return advance(state, scratch, order, h, block.overturn_angle)


@shared
def yielding_step(block: Record, settings: Record, scratch: Record, state: Record, order: int, h: float) -> StepEnd:
    """Step along a series to its first event or the next change of the tendon's law."""
    change, law = next_law(block, settings, scratch, state, order, h)
    end = advance(state, scratch, order, min(h, change), block.overturn_angle)
    if end.outcome == Outcome.STEP and end.time >= change:
        turns = state.law == TendonLaw.PLASTIC
        change_law(block, settings, state, law, end.u)
        return StepEnd(end.outcome, end.time, end.u, 0.0 if turns else end.v, end.peak_time, end.peak)
    return end


@inlined
def finish_step(ground: Ground, settings: Record, state: Record, end: StepEnd, left: float) -> int:
    """Move the state to the end of a step and return its `Outcome`."""
    if end.peak > state.peak:
        raise_peak(state, end.peak, time_of(ground, state) + end.peak_time)
    until_stop = settings.stop - start_of(ground, state.piece) - state.offset
    is_last = until_stop <= length_of(ground, state.piece) - state.offset
    stopped = end.outcome == Outcome.STEP and end.time >= left and is_last
    start = state.offset
    state.offset += end.time
    if state.offset == start:  # at least one ulp, so that every march ends
        state.offset += ULP * start
    state.u = end.u
    state.v = end.v
    state.continuous_uplift = False
    if stopped:
        return Outcome.STOPPED
    if end.outcome == Outcome.STEP and end.time >= left:
        state.piece += 1
        state.offset = 0.0
    elif end.outcome == Outcome.STEP:
        normalize_offset(ground, state)  # the piece may be over by rounding
    return end.outcome


@inlined
def pass_impact(ground: Ground, block: Record, settings: Record, table: Records, scratch: Record, state: Record) -> int:
    """Process an impact and the decision on rest; DONE if the march ends there."""
    normalize_offset(ground, state)
    if has_vertical(ground) and is_weightless(ground, block, state, state.offset):
        pushed = abs(restoring(ground, block, state.side, state.piece, state.offset))
        depth = 0.5 * state.v * state.v / pushed  # distance below zero rotation without ground
        state.rounding_decisions += depth <= _NEAR_TIE * state.peak
        if depth <= _TOUCH * state.peak:  # no impact, because it would put the block on the other side
            state.v = 0.0
            return Ending.RUNNING
    time = time_of(ground, state)
    speed = apply_impact(block, state)
    write_impact(settings, table, state, time, speed)
    count_impact(state)
    proof = unproven()
    if settings.rest_rule == RestRule.CERTIFIED and state.v <= state.certificate_speed:
        proof = proven_bounds(ground, block, settings, scratch, state)
        record_proof(ground, block, settings, state, proof)
    rest = rest_after_impact(ground, block, settings, state, proof)
    state.last_impact_time = time
    if math.isnan(rest.time):
        return Ending.RUNNING
    return come_to_rest(ground, block, settings, table, state, rest)


@inlined
def is_weightless(ground: Ground, block: Record, state: Record, offset: float) -> bool:
    """Return whether a block at zero rotation is pushed off to both sides."""
    here = restoring(ground, block, state.side, state.piece, offset)
    other = restoring(ground, block, block.next_side[state.side], state.piece, offset)
    return bool(here < 0.0 and other < 0.0)


@shared
def nearly_touches(ground: Ground, block: Record, settings: Record, scratch: Record, state: Record, h: float) -> bool:
    """Return whether the arc from a state has a minimum within h so near zero that rounding may hide an impact.

    With positive weight, the impact would change the number of impacts, but not the motion.
    """
    order, _, _ = expand(ground, block, settings, scratch, state, h)
    c, d = scratch.rotation, scratch.other
    for k in range(order):
        d[k] = -(k + 1) * c[k + 1]
    lowest_time = first_root(d, 0, order - 1, h)
    lowest, _, _ = evaluate(c, order, lowest_time)
    near = lowest <= _NEAR_TIE * state.peak and is_weightless(ground, block, state, state.offset + lowest_time)
    return bool(near or lowest <= _TOUCH * state.peak)


@inlined
def come_to_rest(ground: Ground, block: Record, settings: Record, table: Records, state: Record, rest: Rest) -> int:
    """Finish a sequence of impacts; DONE if the march stops before the block is at rest."""
    time = time_of(ground, state)
    state.rests_by_rounding += rest.stalled
    if state.proven_impacts == 0 or not rest.upper >= 0.0:
        state.proven_impacts = 1
        state.run_start = time
    write_node(ground, settings, table, state)
    write_sequence(settings, table, state, time, (rest.lower, rest.upper, rest.time))
    state.proven_impacts = 0
    if time + rest.time >= settings.stop:
        state.end = settings.stop
        return Ending.DONE
    state.side = resting_side(block, state.side)
    state.u = state.v = 0.0
    state.last_rest_time = time + rest.time
    if state.rests == 0:
        state.first_rest = state.last_rest_time
    state.rests += 1
    write_event(settings, table, state, state.last_rest_time, EventKind.REST)
    state.offset += rest.time
    normalize_offset(ground, state)
    return Ending.RUNNING


@inlined
def time_left(ground: Ground, settings: Record, state: Record) -> float:
    """Return the time to the end of the piece or of the response, whichever is first."""
    until_stop = settings.stop - start_of(ground, state.piece) - state.offset
    return min(length_of(ground, state.piece) - state.offset, until_stop)


@inlined
def normalize_offset(ground: Ground, state: Record) -> None:
    """Bring the offset within its piece."""
    while state.offset >= length_of(ground, state.piece):
        state.offset -= length_of(ground, state.piece)
        state.piece += 1
