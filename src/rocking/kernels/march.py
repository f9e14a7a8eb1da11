"""Complete response of one block to one motion."""

import math
from typing import Any

import numpy as np

from rocking.kernels.arc import compute_restoring, compute_weight, evaluate_series, expand_arc, side_sign
from rocking.kernels.certificate import create_failed_proof
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import StepEnd, advance_to_event, apply_impact, find_first_root, raise_peak
from rocking.kernels.ground import Ground, has_vertical, is_piecewise_linear, last_piece, piece_length, piece_start
from rocking.kernels.rest import (
    ULP,
    Rest,
    apply_proven_impacts,
    bound_rest,
    compute_present_restoring,
    compute_state_time,
    count_impact,
    decide_rest,
    store_proof,
)
from rocking.kernels.restraints import (
    apply_tendon_law,
    change_tendon_law,
    compute_elongation,
    find_leaning_rotation,
    find_tendon_law_change,
)
from rocking.kernels.short_arc import create_undecided_step, take_short_step
from rocking.kernels.sliding import (
    expand_slide,
    expand_slip,
    find_slide_end,
    find_slip,
    find_slip_end,
    may_slip,
    move_slip,
    settle_slip,
    slides_flat,
    strike_with_friction,
    sum_slip_of_sequence,
)
from rocking.kernels.state import (
    AT_REST,
    EventKind,
    MarchStatus,
    RestRule,
    StepOutcome,
    Struct,
    Structs,
    TendonLaw,
    encode_resting_side,
    has_space,
    write_event,
    write_impact,
    write_node,
    write_sequence,
)
from rocking.kernels.uplift import find_next_uplift, is_side_uncertain

#: Distance from zero rotation within rounding, divided by the largest rotation so far.
_CONTACT_ROUNDING = 2.0**-46

#: Distance, divided likewise, at which the rounding of the input may decide on an impact.
_AMBIGUOUS_DISTANCE = 2.0**-36

#: Fraction of a step for which a block sticks after its forces have only touched the cone of friction.
_TOUCHING_STEP_RATIO = 1e-3


@kernel
def march(ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct) -> int:
    """Simulate one block under one motion from its state on; return an `MarchStatus` as a plain integer.

    RUNNING: the piece ``state.stop_piece`` is reached; a block at rest may be at its next uplift. PAUSED: the budget is
    spent. FULL: the table is full. After each, call again with the same state.
    """
    if block.yielding:
        initialise_tendon(ground, block, settings, state)
    while state.piece < state.stop_piece:
        if state.budget <= 0:
            return MarchStatus.PAUSED.value
        if not has_space(settings, table, state):
            return MarchStatus.FULL.value
        state.budget -= 1
        status = march_step(ground, block, settings, table, scratch, state)
        if status != MarchStatus.RUNNING:
            return status.value
    return MarchStatus.RUNNING.value


@inlined
def initialise_tendon(ground: Ground, block: Struct, settings: Struct, state: Struct) -> None:
    """Apply the law of the state to a tendon; one that starts too far from rest has already yielded."""
    if compute_state_time(ground, state) == 0.0 and state.side >= 0:
        elongation = compute_elongation(block, settings.nonlinear, state.side, state.u)
        state.plastic_elongation = max(state.plastic_elongation, elongation - block.yield_elongation)
    apply_tendon_law(block, state.tendon_law, state.plastic_elongation)


@inlined
def march_step(ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct) -> Any:
    """Advance a block to its next uplift or, along an arc, to its first event."""
    write_node(ground, settings, table, state)
    if state.side < 0 and state.direction != 0:
        return slide_flat(ground, block, settings, table, scratch, state)
    if state.side < 0:
        return rest_until_uplift(ground, block, settings, table, scratch, state)
    simple = is_piecewise_linear(ground) and not (has_vertical(ground) or settings.nonlinear)
    is_proven = state.proven_impacts > 0 and state.u == 0.0 and state.direction == 0
    if is_proven and simple and not (block.restrained or block.variable_restitution):
        apply_proven_impacts(ground, block, settings, table, state, compute_time_to_boundary(ground, settings, state))
    outcome = step_along_arc(ground, block, settings, scratch, state)
    if outcome == StepOutcome.IMPACT or (outcome == StepOutcome.OVERTURN and block.two_stops):
        return process_impact(ground, block, settings, table, scratch, state)
    if outcome == StepOutcome.OVERTURN:
        state.end_time = state.peak_time = compute_state_time(ground, state)
        state.peak = block.overturn_angle
        write_node(ground, settings, table, state)
        write_event(settings, table, state, state.end_time, EventKind.OVERTURN)
        return MarchStatus.OVERTURNED
    if outcome == StepOutcome.STOPPED:
        state.end_time = settings.stop_time
        state.peak_time = min(state.peak_time, settings.stop_time)  # rounding may put a peak at the stop slightly later
        write_node(ground, settings, table, state)
        return MarchStatus.DONE
    if outcome == StepOutcome.LEANS:
        state.end_time = compute_state_time(ground, state)
        return MarchStatus.LEANS
    if outcome == StepOutcome.LOST:
        return lose_contact(ground, settings, table, state)
    if outcome == StepOutcome.SLIPS or outcome == StepOutcome.STICKS:
        write_slip_event(ground, settings, table, state)
        return MarchStatus.RUNNING
    return MarchStatus.BALANCED if outcome == StepOutcome.BALANCED else MarchStatus.RUNNING


@inlined
def rest_until_uplift(
    ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct
) -> int:
    """Keep a block at rest until the motion passes a threshold; DONE if it never does."""
    uplift = find_next_uplift(ground, block, scratch, state.side, state.piece, state.offset, settings.stop_time)
    if uplift.side == AT_REST or piece_start(ground, uplift.piece) + uplift.offset >= settings.stop_time:
        motion_end = piece_start(ground, last_piece(ground))
        state.end_time = max(state.last_rest_time, motion_end) if settings.no_end_time else settings.stop_time
        state.time_at_rest += state.end_time - state.last_rest_time
        return MarchStatus.DONE
    state.piece = uplift.piece
    state.offset = uplift.offset
    state.side = uplift.side
    state.u = state.v = 0.0
    if block.has_friction:
        if compute_weight(ground, state.piece, state.offset) <= 0.0:
            return lose_contact(ground, settings, table, state)
        if block.static_friction <= block.threshold[state.side]:
            state.time_at_rest += compute_state_time(ground, state) - state.last_rest_time
            start_slip(block, state, 1 - 2 * state.side)
            write_slip_event(ground, settings, table, state)
            return MarchStatus.RUNNING
    state.continuous_uplift = not uplift.is_jump
    state.last_uplift_time = state.last_impact_time = compute_state_time(ground, state)
    state.certificate_speed = np.inf
    state.time_at_rest += state.last_uplift_time - state.last_rest_time
    if state.uplift_count == 0:
        state.first_uplift = state.last_uplift_time
    state.uplift_count += 1
    if has_vertical(ground) and is_pushed_off_both_sides(ground, block, state, state.offset):
        h = piece_length(ground, state.piece) - state.offset
        A, d = scratch.ground, scratch.auxiliary
        if block.next_side[0] != 0 and is_side_uncertain(ground, block, state.piece, state.offset, h, A, d):
            state.rounding_decisions += 1
        elif (
            state.rest_count > 0
            and state.last_uplift_time - state.last_rest_time <= _AMBIGUOUS_DISTANCE * state.last_uplift_time
        ):
            state.rounding_decisions += 1  # the last of its impacts may have been too late
    write_event(settings, table, state, state.last_uplift_time, EventKind.UPLIFT)
    return MarchStatus.RUNNING


@inlined
def step_along_arc(ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct) -> int:
    """Take one Taylor step along the arc, at most to its first event, and return its `StepOutcome`."""
    h_max = compute_time_to_boundary(ground, settings, state)
    if h_max <= 0.0:
        return StepOutcome.STOPPED
    if state.direction != 0:
        return slip_along_arc(ground, block, settings, scratch, state, h_max)
    end = create_undecided_step()
    if not state.continuous_uplift:
        end = take_short_step(ground, block, settings, state, h_max)
    if end.outcome == StepOutcome.UNDECIDED:
        end = take_full_step(ground, block, settings, scratch, state, h_max)
    if block.has_friction and may_slip(ground, block, settings, scratch, state, end):
        return step_to_slip(ground, block, settings, scratch, state, end, h_max)
    if state.v < 0.0 <= end.v and end.outcome == StepOutcome.STEP:
        state.rounding_decisions += nearly_touches(ground, block, settings, scratch, state, end.time)
    return finish_step(ground, settings, state, end, h_max)


@inlined
def take_full_step(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, h_max: float
) -> StepEnd:
    """Step along the full series of the arc."""
    order, h, _ = expand_arc(ground, block, settings, scratch, state, h_max)
    if state.continuous_uplift:  # by rounding, an uplift may seem to be pushed back
        scratch.rotation[2] = max(0.0, scratch.rotation[2])
    if block.restrained and settings.no_end_time and state.piece == last_piece(ground):
        leaning_rotation = find_leaning_rotation(block, settings, state, 2.0 * scratch.rotation[2])
        if leaning_rotation > 0.0:
            state.leaning_rotation = leaning_rotation
            return StepEnd(StepOutcome.LEANS, 0.0, state.u, state.v, 0.0, state.u)
    if block.yielding:
        return step_yielding(block, settings, scratch, state, order, h)
    is_balanced = state.v == 0.0 and scratch.rotation[2] == 0.0
    if is_balanced and state.piece == last_piece(ground) and settings.no_end_time:
        return StepEnd(StepOutcome.BALANCED, 0.0, state.u, 0.0, 0.0, 0.0)
    return advance_to_event(state, scratch, order, h, block.overturn_angle)


@not_inlined
def step_to_slip(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, end: StepEnd, h_max: float
) -> int:
    """Take a step that may leave the cone of friction; without that it ends at ``end``, which ignores friction."""
    order, h, time, direction = find_slip(ground, block, settings, scratch, state, end.time)
    if direction == 0:
        if h < end.time:
            end = advance_to_event(state, scratch, order, h, block.overturn_angle)
        return finish_step(ground, settings, state, end, h_max)
    if time > 0.0:
        end = advance_to_event(state, scratch, order, time, block.overturn_angle)
        outcome = finish_step(ground, settings, state, end, h_max)
        if outcome != StepOutcome.STEP:
            return outcome
    start_slip(block, state, direction)
    return StepOutcome.SLIPS


@inlined
def start_slip(block: Struct, state: Struct, direction: int) -> None:
    """Start a slip from zero velocity; a block on both pivots slides if it does not tip."""
    state.direction = direction
    state.slip_rate = 0.0
    if state.u == 0.0 and state.v == 0.0 and slides_flat(block, state.side):
        state.side = AT_REST


@not_inlined
def slip_along_arc(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, h_max: float
) -> int:
    """Take a step of slide-rock, at most to its first event, and return its `StepOutcome`."""
    order, h = expand_slip(ground, block, settings, scratch, state, h_max)
    sign = side_sign(state.side)
    stick_time, loss_time = find_slip_end(scratch, order, h, sign * state.direction)
    if loss_time == 0.0:
        return StepOutcome.LOST
    if stick_time == 0.0 and state.slip_rate == 0.0:  # the cone was only touched: a short step without slip
        state.direction = 0
        order, h, _ = expand_arc(ground, block, settings, scratch, state, _TOUCHING_STEP_RATIO * h)
        return finish_step(
            ground, settings, state, advance_to_event(state, scratch, order, h, block.overturn_angle), h_max
        )
    if stick_time > 0.0:
        end = advance_to_event(state, scratch, order, min(h, min(stick_time, loss_time)), block.overturn_angle)
        move_slip(scratch, state, order - 1, sign, end.time)
        outcome = finish_step(ground, settings, state, end, h_max)
        if outcome != StepOutcome.STEP or end.time < min(stick_time, loss_time):
            return outcome
        if loss_time <= stick_time:
            return StepOutcome.LOST
    state.direction = 0
    state.slip_rate = 0.0
    return StepOutcome.STICKS


@inlined
def slide_flat(ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct) -> int:
    """Take a step of a block that slides on both pivots."""
    if compute_weight(ground, state.piece, state.offset) <= 0.0:
        return lose_contact(ground, settings, table, state)
    h_max = compute_time_to_boundary(ground, settings, state)
    if h_max <= 0.0:
        state.end_time = settings.stop_time
        return MarchStatus.DONE
    degree = expand_slide(ground, block, scratch, state)
    h, stick_time, loss_time = find_slide_end(ground, block, scratch, state, degree, h_max)
    t = min(h, min(stick_time, loss_time))
    move_slip(scratch, state, degree, 1.0, t)
    outcome = finish_step(ground, settings, state, StepEnd(StepOutcome.STEP, t, 0.0, 0.0, 0.0, 0.0), h_max)
    if outcome == StepOutcome.STOPPED:
        state.end_time = settings.stop_time
        write_node(ground, settings, table, state)
        return MarchStatus.DONE
    if stick_time <= min(h, loss_time):
        state.direction = 0
        state.slip_rate = 0.0
        count_rest(settings, table, state, compute_state_time(ground, state))
    return lose_contact(ground, settings, table, state) if loss_time < min(h, stick_time) else MarchStatus.RUNNING


@inlined
def lose_contact(ground: Ground, settings: Struct, table: Structs, state: Struct) -> int:
    """End a march because the ground no longer presses on the block."""
    state.end_time = compute_state_time(ground, state)
    write_node(ground, settings, table, state)
    write_event(settings, table, state, state.end_time, EventKind.LOST)
    return MarchStatus.LOST


@inlined
def write_slip_event(ground: Ground, settings: Struct, table: Structs, state: Struct) -> None:
    """Write the start or end of a slip."""
    kind = EventKind.STICK if state.direction == 0 else (EventKind.SLIDE if state.side < 0 else EventKind.SLIDE_ROCK)
    write_event(settings, table, state, compute_state_time(ground, state), kind)


@inlined
def count_rest(settings: Struct, table: Structs, state: Struct, time: float) -> None:
    """Count and write a rest."""
    state.last_rest_time = time
    if state.rest_count == 0:
        state.first_rest = time
    state.rest_count += 1
    write_event(settings, table, state, time, EventKind.REST)


@not_inlined
def step_yielding(block: Struct, settings: Struct, scratch: Struct, state: Struct, order: int, h: float) -> StepEnd:
    """Step along a series to its first event or the next change of the tendon's law."""
    change, law = find_tendon_law_change(block, settings, scratch, state, order, h)
    end = advance_to_event(state, scratch, order, min(h, change), block.overturn_angle)
    if end.outcome == StepOutcome.STEP and end.time >= change:
        turns_back = state.tendon_law == TendonLaw.PLASTIC
        change_tendon_law(block, settings, state, law, end.u)
        return StepEnd(end.outcome, end.time, end.u, 0.0 if turns_back else end.v, end.peak_time, end.peak)
    return end


@inlined
def finish_step(ground: Ground, settings: Struct, state: Struct, end: StepEnd, h_max: float) -> int:
    """Move the state to the end of a step and return its `StepOutcome`."""
    if end.peak > state.peak:
        raise_peak(state, end.peak, compute_state_time(ground, state) + end.peak_time)
    time_to_stop = settings.stop_time - piece_start(ground, state.piece) - state.offset
    is_last_step = time_to_stop <= piece_length(ground, state.piece) - state.offset
    reaches_stop = end.outcome == StepOutcome.STEP and end.time >= h_max and is_last_step
    start = state.offset
    state.offset += end.time
    if state.offset == start:  # at least one ulp, so that every march ends
        state.offset += ULP * start
    state.u = end.u
    state.v = end.v
    state.continuous_uplift = False
    if reaches_stop:
        return StepOutcome.STOPPED
    if end.outcome == StepOutcome.STEP and end.time >= h_max:
        state.piece += 1
        state.offset = 0.0
    elif end.outcome == StepOutcome.STEP:
        normalise_offset(ground, state)  # the piece may be over by rounding
    return end.outcome


@inlined
def process_impact(
    ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct
) -> int:
    """Process an impact and the decision on rest; DONE if the march ends there."""
    normalise_offset(ground, state)
    if has_vertical(ground) and is_pushed_off_both_sides(ground, block, state, state.offset):
        acceleration = abs(compute_restoring(ground, block, state.side, state.piece, state.offset))
        depth = 0.5 * state.v * state.v / acceleration  # distance below zero rotation without ground
        state.rounding_decisions += depth <= _AMBIGUOUS_DISTANCE * state.peak
        if depth <= _CONTACT_ROUNDING * state.peak:  # no impact, because it would put the block on the other side
            state.v = 0.0
            return MarchStatus.RUNNING
    time = compute_state_time(ground, state)
    speed = apply_impact(block, state)
    if block.has_friction:
        slipped = state.direction
        strike_with_friction(block, state, 1 - state.side, speed)
        if (slipped == 0) != (state.direction == 0):
            write_slip_event(ground, settings, table, state)
    write_impact(settings, table, state, time, speed)
    count_impact(state)
    proof = create_failed_proof()
    if settings.rest_rule == RestRule.CERTIFIED and state.v <= state.certificate_speed:
        proof = bound_rest(ground, block, settings, scratch, state)
        store_proof(ground, block, settings, state, proof)
    rest = decide_rest(ground, block, settings, state, proof)
    state.last_impact_time = time
    if math.isnan(rest.time):
        return MarchStatus.RUNNING
    return finish_sequence(ground, block, settings, table, scratch, state, rest)


@inlined
def is_pushed_off_both_sides(ground: Ground, block: Struct, state: Struct, offset: float) -> bool:
    """Return whether a block at zero rotation is pushed off to both sides."""
    side_acceleration = compute_restoring(ground, block, state.side, state.piece, offset)
    other_acceleration = compute_restoring(ground, block, block.next_side[state.side], state.piece, offset)
    return bool(side_acceleration < 0.0 and other_acceleration < 0.0)


@not_inlined
def nearly_touches(ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, h: float) -> bool:
    """Return whether the arc from a state has a minimum within h so near zero that rounding may hide an impact.

    With positive weight, the impact would change the number of impacts, but not the motion.
    """
    order, _, _ = expand_arc(ground, block, settings, scratch, state, h)
    c, d = scratch.rotation, scratch.auxiliary
    for k in range(order):
        d[k] = -(k + 1) * c[k + 1]
    lowest_time = find_first_root(d, 0, order - 1, h)
    lowest, _, _ = evaluate_series(c, order, lowest_time)
    is_near = lowest <= _AMBIGUOUS_DISTANCE * state.peak and is_pushed_off_both_sides(
        ground, block, state, state.offset + lowest_time
    )
    return bool(is_near or lowest <= _CONTACT_ROUNDING * state.peak)


@inlined
def finish_sequence(
    ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct, rest: Rest
) -> int:
    """Finish a sequence of impacts; DONE if the march stops before the block is at rest."""
    time = compute_state_time(ground, state)
    state.rests_by_rounding += rest.is_by_rounding
    if state.proven_impacts == 0 or not rest.upper >= 0.0:
        state.proven_impacts = 1
        state.sequence_start = time
    write_node(ground, settings, table, state)
    write_sequence(settings, table, state, time, (rest.lower, rest.upper, rest.time))
    state.proven_impacts = 0
    if time + rest.time >= settings.stop_time:
        state.end_time = settings.stop_time
        return MarchStatus.DONE
    if state.direction != 0:
        finish_while_sliding(ground, block, settings, table, scratch, state, rest.time)
        return MarchStatus.RUNNING
    state.side = encode_resting_side(block, state.side)
    state.u = state.v = 0.0
    count_rest(settings, table, state, time + rest.time)
    state.offset += rest.time
    normalise_offset(ground, state)
    return MarchStatus.RUNNING


@not_inlined
def finish_while_sliding(
    ground: Ground, block: Struct, settings: Struct, table: Structs, scratch: Struct, state: Struct, duration: float
) -> None:
    """Move a block to the end of a sequence of impacts after which it slides."""
    i = state.side
    g = compute_present_restoring(ground, block, settings, state, i)
    other_g = compute_present_restoring(ground, block, settings, state, 1 - i)
    drift, shift = sum_slip_of_sequence(block, settings, state, g, other_g)
    state.slip_rate += drift
    state.u = state.v = 0.0
    while duration > 0.0:
        degree = expand_slide(ground, block, scratch, state)
        t = min(duration, piece_length(ground, state.piece) - state.offset)
        move_slip(scratch, state, degree, 1.0, t)
        duration -= t
        state.offset += t
        if duration > 0.0:
            state.piece += 1
            state.offset = 0.0
    normalise_offset(ground, state)
    state.slip += shift
    state.side = AT_REST
    settle_slip(block, state)
    if state.side < 0:
        write_slip_event(ground, settings, table, state)


@inlined
def compute_time_to_boundary(ground: Ground, settings: Struct, state: Struct) -> float:
    """Return the time to the end of the piece or of the response, whichever is first."""
    time_to_stop = settings.stop_time - piece_start(ground, state.piece) - state.offset
    return min(piece_length(ground, state.piece) - state.offset, time_to_stop)


@inlined
def normalise_offset(ground: Ground, state: Struct) -> None:
    """Bring the offset within its piece."""
    while state.offset >= piece_length(ground, state.piece):
        state.offset -= piece_length(ground, state.piece)
        state.piece += 1
