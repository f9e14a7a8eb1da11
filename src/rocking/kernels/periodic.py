"""Bodies under a periodic motion: states after periods and impacts, and their derivatives.

The ground contains the motion twice, so that a decision within one period is valid for one more, and two further pieces
that lift any body off either side: no proof extends across them. After each period, a state is moved back by as many
pieces. A state with a NaN is UNFINISHED.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.arc import compute_restoring, evaluate_series, expand_arc, side_sign
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import compute_restitution_factor, compute_speed_slope
from rocking.kernels.ground import ROUNDING, Ground, piece_length, piece_start, scale_coefficients
from rocking.kernels.march import march
from rocking.kernels.series import write_variation_coefficients
from rocking.kernels.state import AT_REST, MarchStatus, Struct, Structs
from rocking.kernels.trace import Trail, expand_unforced
from rocking.kernels.uplift import find_next_uplift

#: Largest number of march iterations for one period or impact, and the coordinate and speed from which none is allowed:
#: absurd states and NaN would require all of them.
MAX_ITERATIONS = 100_000
MAX_STATE = 1e100


class PeriodOutcome(IntEnum):
    """Outcome of a state after some periods or after an impact.

    See Also
    --------
    rocking.dynamics.StroboscopicMap : Advance a state by one period.
    rocking.dynamics.lyapunov_exponents : Compute the exponents and the outcome of an orbit.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, shaking = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(13.0, 5.0, cycles=1)
    >>> dynamics.lyapunov_exponents(ball, shaking, [0.1, 0.5]).outcome == dynamics.PeriodOutcome.MOVES
    True
    """

    MOVES = 0
    RESTS = 1
    OVERTURNED = 2
    #: Too many steps: the outcome is unknown.
    UNFINISHED = 3
    #: The body is at rest, and the motion never lifts it.
    RESTS_FOR_EVER = 4


class PeriodicProblem(NamedTuple):
    """Body under a periodic motion, and the data that the march of its states requires."""

    ground: Ground  # motion
    block: Struct  # body
    settings: Struct  # settings of the computation
    table: Structs  # table without rows
    steps: Floats  # `build_step_rows`; without rows, every step is marched


#: Columns of a trap: side (negative at rest), middle (u, v), and a, b, c of a du^2 + 2 b du dv + c dv^2 <= 1.
TRAP_COLUMNS = 6


@kernel
def iterate_periods(
    problem: PeriodicProblem,
    scratch: Struct,
    states: Structs,
    periods: int,
    orbit: Floats,
    traps: Floats,
    trap_rows: Integers,
    period_counts: Integers,
) -> None:
    """Take each state through at most ``periods`` periods, until it enters a trap, overturns or rests forever.

    ``status`` is then its `PeriodOutcome`, ``trap_rows[k]`` the row of its trap in ``traps``, shape
    (n, `TRAP_COLUMNS`), or -1, and ``period_counts[k]`` the number of periods. Row n of ``orbit[k]``, if any, is
    (u, v, side) after n + 1 periods, unchanged after the last known state.
    """
    for k in range(states.shape[0]):
        state = states[k]
        outcome = PeriodOutcome.RESTS.value if state.side < 0 else PeriodOutcome.MOVES.value
        trap_rows[k] = -1
        period_counts[k] = periods
        for n in range(periods):
            outcome = advance_period(problem, scratch, state)
            is_known = outcome != PeriodOutcome.OVERTURNED and outcome != PeriodOutcome.UNFINISHED
            if is_known:
                is_at_rest = outcome == PeriodOutcome.RESTS or outcome == PeriodOutcome.RESTS_FOR_EVER
                trap_rows[k] = find_trap(traps, state, is_at_rest, problem.block.two_stops)
                for later in range(
                    n, orbit.shape[1] if outcome == PeriodOutcome.RESTS_FOR_EVER else min(n + 1, orbit.shape[1])
                ):
                    write_state(orbit[k, later], state)
            if trap_rows[k] >= 0 or outcome == PeriodOutcome.RESTS_FOR_EVER or not is_known:
                period_counts[k] = n + 1
                break
        state.status = outcome


@inlined
def find_trap(traps: Floats, state: Struct, rests: bool, two_stops: bool) -> int:
    """Return the row of the first trap that contains a state, or -1."""
    for j in range(traps.shape[0]):
        row = traps[j]
        if row[0] < 0.0:
            # At rest, on the same stop. The march may have moved the state to its next uplift and assigned a side.
            if rests and (not two_stops or row[0] == min(state.side, -1 - state.side)):
                return j
            continue
        du, dv = state.u - row[1], state.v - row[2]
        if not rests and state.side == row[0] and row[3] * du * du + 2.0 * row[4] * du * dv + row[5] * dv * dv <= 1.0:
            return j
    return -1


@inlined
def write_state(row: Floats, state: Struct) -> None:
    """Write a state: coordinate in the frame of its side, velocity, side."""
    row[0], row[1], row[2] = state.u, state.v, state.side


@not_inlined
def advance_period(problem: PeriodicProblem, scratch: Struct, state: Struct) -> int:
    """Advance a state by one period and return its `PeriodOutcome`."""
    ground, block, settings, table, steps = problem
    pieces = count_pieces(ground)
    state.budget = compute_iteration_budget(state)
    status = MarchStatus.RUNNING.value
    while status == MarchStatus.RUNNING and state.piece < pieces:
        state.stop_piece = pieces
        if state.side >= 0 and state.offset == 0.0 and steps.shape[1] > 0:
            if not state.continuous_uplift and skip_piece(steps[state.side, state.piece], block.overturn_angle, state):
                continue
            state.stop_piece = state.piece + 1
        status = march(ground, block, settings, table, scratch, state)
    return shift_back(ground, block, state, status)


@inlined
def compute_iteration_budget(state: Struct) -> int:
    """Return the number of march iterations allowed from a state."""
    return MAX_ITERATIONS if state.u < MAX_STATE and abs(state.v) < MAX_STATE else 0


# ---- Pieces of a linear body's motion without events, in closed form ----

#: Columns of a row of steps: derivatives of (u, v) after a piece by those before it, row by row; (u, v) after the piece
#: from (0, 0); largest |u''| by motion and weight; sqrt(|lam|), and sqrt(|lam|) + c; length of the piece.
_MATRIX, _OFFSET, _FORCE, _ROOT, _RATE, _LENGTH, _COLUMNS = 0, 4, 6, 7, 8, 9, 10

#: Largest (sqrt(|lam|) + c) L of a piece of length L with a row, and its exponential, rounded up.
_MAX_GROWTH_RATE = 0.75
_GROWTH = 2.118


@inlined
def skip_piece(row: Floats, overturn_angle: float, state: Struct) -> bool:
    """Advance a state by a piece in closed form if bounds exclude an event, and return whether they do.

    N = sqrt(|lam|) |u| + |v| grows at a rate of at most (sqrt(|lam|) + c) N + F under a force F, and |u''| is at most
    that rate. Therefore the rotation is within L^2/8 times that rate of the line between both ends.
    """
    u, v, h = state.u, state.v, row[_LENGTH]
    magnitude = _GROWTH * (row[_ROOT] * u + abs(v) + h * row[_FORCE])
    margin = 0.125 * h * h * (row[_FORCE] + row[_RATE] * magnitude)
    next_u = row[_MATRIX] * u + row[_MATRIX + 1] * v + row[_OFFSET]
    if not ((u > margin) & (next_u > margin) & (max(u, next_u) + margin < overturn_angle)):
        return False
    state.v = row[_MATRIX + 2] * u + row[_MATRIX + 3] * v + row[_OFFSET + 1]
    state.u = next_u
    state.piece += 1
    return True


def build_step_rows(ground: Ground, block: Struct) -> Floats:
    """Compute rows for `skip_piece` for each side and piece of the first period, shape (2, pieces, columns).

    There are none if a piece is too long for the bounds or the body has no such side.
    """
    pieces = (len(ground.pieces) - 3) // 2
    rows = np.zeros((2, pieces, _COLUMNS))
    length, coefficients = ground.pieces[:pieces, 1], scale_coefficients(ground, np.arange(pieces))[0]
    if any(np.any(block[name]) for name in ("restraint_threshold", "added_weight", "spring")):
        return np.zeros((2, 0, _COLUMNS))
    for side in range(2):
        lam, gain, threshold = (float(block[name][side]) for name in ("stiffness", "restoring_gain", "threshold"))
        if not np.isfinite(threshold):
            continue
        root, drag = np.sqrt(abs(lam)), float(block["damping"][side])
        if length.max() * (root + drag) > _MAX_GROWTH_RATE:
            return np.zeros((2, 0, _COLUMNS))
        force = -gain * (1.0 - 2.0 * side) * coefficients
        force[:, 0] -= gain * threshold
        series = np.zeros((3, pieces, _TERMS + 2))  # from (1, 0), from (0, 1), from (0, 0) with the motion
        series[0, :, 0] = series[1, :, 1] = 1.0
        for k in range(_TERMS):
            series[:, :, k + 2] = lam * series[:, :, k] - drag * (k + 1) * series[:, :, k + 1]
            if k < ground.coefficient_count:
                series[2, :, k + 2] += force[:, k]
            series[:, :, k + 2] /= (k + 1) * (k + 2)
        powers = length[:, None] ** np.arange(_TERMS + 2)
        values = np.sum((series * powers)[..., ::-1], axis=-1)
        rates = np.sum((series[..., 1:] * np.arange(1, _TERMS + 2) * powers[:, :-1])[..., ::-1], axis=-1)
        rows[side, :, :_OFFSET] = np.stack([values[0], values[1], rates[0], rates[1]], axis=-1)
        rows[side, :, _OFFSET], rows[side, :, _OFFSET + 1] = values[2], rates[2]
        sizes = np.abs(force) * powers[:, : ground.coefficient_count]
        rows[side, :, _FORCE] = np.sum(sizes, axis=-1) * (1.0 + ROUNDING)
        rows[side, :, _ROOT], rows[side, :, _RATE], rows[side, :, _LENGTH] = root, root + drag, length
    return rows


#: Number of terms of the series for rows of steps, sufficient for the motion and for pieces of that length.
_TERMS = 40


@inlined
def count_pieces(ground: Ground) -> int:
    """Count the pieces of one period."""
    return (ground.pieces.shape[0] - 3) // 2


@inlined
def shift_back(ground: Ground, block: Struct, state: Struct, status: int) -> int:
    """Move a state back by the period that it has passed, and return its `PeriodOutcome`."""
    pieces = count_pieces(ground)
    if status == MarchStatus.OVERTURNED:
        return PeriodOutcome.OVERTURNED
    if status == MarchStatus.DONE or (status == MarchStatus.RUNNING and state.piece >= 2 * pieces):
        # Even the second period does not lift the body; the march may have followed an uplift by the additional pieces.
        if state.u == 0.0 and state.v == 0.0:
            state.side = AT_REST if state.side < 0 or not block.two_stops else -1 - state.side
            return PeriodOutcome.RESTS_FOR_EVER
        return PeriodOutcome.UNFINISHED
    if status == MarchStatus.BALANCED:
        state.piece, state.offset = 0, 0.0
        return PeriodOutcome.MOVES
    if status != MarchStatus.RUNNING or not (state.u >= 0.0 and abs(state.v) < np.inf):
        return PeriodOutcome.UNFINISHED
    period = piece_start(ground, pieces)
    state.piece -= pieces
    state.last_uplift_time -= period
    state.last_rest_time -= period
    state.sequence_start -= period
    state.last_impact_time -= period
    return PeriodOutcome.RESTS if state.side < 0 or (state.u == 0.0 and state.v == 0.0) else PeriodOutcome.MOVES


# ---- Derivatives of a state after a period by the state before it ----


@kernel
def differentiate_periods(
    trail: Trail, scratch: Struct, variation: Struct, table: Structs, states: Structs, out: Floats
) -> None:
    """Write the derivative of each state after one period by the state before it, in the frames of their sides.

    It is exactly zero if the body has come to rest for any time, or is held at rest at the start. At a stop that does
    not hold the body, it is the derivative for states off the stop. The trail's settings make the march write its
    table, whose rows are reused. ``states`` are advanced by the period, with ``status`` their `PeriodOutcome`.
    """
    for k in range(states.shape[0]):
        differentiate_period(trail, scratch, variation, table, states[k], out[k])


@not_inlined
def differentiate_period(
    trail: Trail, scratch: Struct, variation: Struct, table: Structs, state: Struct, M: Floats
) -> tuple[int, float]:
    """Take one state through a period and write its derivative, as `differentiate_periods`.

    Returns the number of impacts and, for a nonzero derivative, the logarithm of its |determinant|: a sum over steps,
    because the columns of the derivative become parallel to rounding.
    """
    ground, block, settings, _ = trail
    initial = 1.0
    if state.side < 0:
        uplift = find_next_uplift(ground, block, scratch, state.side, state.piece, state.offset, settings.stop_time)
        is_held = uplift.side < 0 or uplift.piece > state.piece or uplift.offset > state.offset
        # The state at rest is independent of the past; the frame of a body that leaves immediately belongs to no side.
        initial = 0.0 if is_held else side_sign(uplift.side)
    M[0, 0], M[0, 1], M[1, 0], M[1, 1] = initial, 0.0, 0.0, initial
    state.stop_piece = count_pieces(ground)
    state.budget = compute_iteration_budget(state)
    status = MarchStatus.FULL.value
    impacts, log_determinant = 0, 0.0
    while status == MarchStatus.FULL:
        state.node_count = state.impact_count = state.event_count = state.sequence_count = 0
        status = march(ground, block, settings, table, scratch, state)
        impacts += state.impact_count
        for n in range(state.node_count - 1):
            log_determinant += apply_step(trail, scratch, variation, table[n].node, table[n + 1].node, M)
        if state.node_count > 0:
            log_determinant += apply_step(trail, scratch, variation, table[state.node_count - 1].node, state, M)
    state.status = shift_back(ground, block, state, status)
    if state.status == PeriodOutcome.RESTS or state.status == PeriodOutcome.RESTS_FOR_EVER:
        M[0, 0] = M[0, 1] = M[1, 0] = M[1, 1] = 0.0
    elif state.status != PeriodOutcome.MOVES:
        M[0, 0] = M[0, 1] = M[1, 0] = M[1, 1] = np.nan
    return impacts, log_determinant


@kernel
def measure_stretches(
    trail: Trail, scratch: Struct, variation: Struct, table: Structs, state: Struct, frame: Floats, logs: Floats
) -> int:
    """Take a state through one period per row of ``logs``, and write the stretches of a frame of directions.

    A row contains the logarithms of the stretch along a direction that follows the derivatives, and so becomes the one
    that grows fastest, and across it: the diagonal of R where the derivative times Q is Q' R. Both are -inf in a period
    with a rest, after which the direction is arbitrary. Rows end before the period of overturning or permanent rest;
    ``status`` is the `PeriodOutcome`. Row 2 of ``frame``, shape (3, 2), is the direction, the others are scratch space.
    Returns the number of impacts.
    """
    M = frame[:2]
    impacts = 0
    for n in range(logs.shape[0]):
        new_impacts, log_determinant = differentiate_period(trail, scratch, variation, table, state, M)
        impacts += new_impacts
        if state.status != PeriodOutcome.MOVES and state.status != PeriodOutcome.RESTS:
            break
        c, s = frame[2, 0], frame[2, 1]
        x, y = M[0, 0] * c + M[0, 1] * s, M[1, 0] * c + M[1, 1] * s
        length = math.sqrt(x * x + y * y)
        if length > 0.0:
            logs[n, 0] = math.log(length)
            logs[n, 1] = log_determinant - logs[n, 0]
            frame[2, 0], frame[2, 1] = x / length, y / length
        else:
            logs[n, 0] = logs[n, 1] = -np.inf
    return impacts


@not_inlined
def apply_step(trail: Trail, scratch: Struct, variation: Struct, node: Struct, next_node: Struct, M: Floats) -> float:
    """Multiply a derivative by the derivative of the step from a node to ``next_node``, with any impact at its end.

    Returns the logarithm of the |determinant| of the step.
    """
    ground, block, settings, _ = trail
    if node.side < 0:  # the derivative since coming to rest
        return 0.0
    if next_node.side < 0:
        return apply_rest_derivative(ground, block, node, next_node, M)
    h = next_node.offset - node.offset
    if next_node.piece > node.piece:
        h = piece_length(ground, node.piece) - node.offset
        for piece in range(node.piece + 1, next_node.piece):
            h += piece_length(ground, piece)
        h += next_node.offset
    order, _, degree = expand_arc(ground, block, settings, scratch, node, h)
    expand_unforced(trail, scratch, variation, node.side, degree, order)
    for column in range(2):
        variation.rotation[0], variation.rotation[1] = M[0, column], M[1, column]
        write_variation_coefficients(variation, block.damping[node.side], order)
        M[0, column], M[1, column], _ = evaluate_series(variation.rotation, order, h)
    log_determinant = -block.damping[node.side] * h
    if next_node.u == 0.0 and h > 0.0:
        _, v, _ = evaluate_series(scratch.rotation, order, h)
        log_determinant += apply_saltation(ground, block, node.side, next_node, v, M)
    return log_determinant


@inlined
def apply_rest_derivative(ground: Ground, block: Struct, node: Struct, next_node: Struct, M: Floats) -> float:
    """Multiply a derivative by the derivative until a rest: zero, unless the ground ends the rest immediately.

    No speed is left then, and the time of leaving depends on the time of impact. Returns the logarithm of the
    |determinant|.
    """
    side = node.side
    acceleration = compute_restoring(ground, block, side, next_node.piece, next_node.offset)
    if acceleration >= 0.0 and not block.two_stops:
        acceleration = compute_restoring(ground, block, block.next_side[side], next_node.piece, next_node.offset)
    if acceleration >= 0.0 or node.u > 0.0:
        M[0, 0] = M[0, 1] = M[1, 0] = M[1, 1] = 0.0
    elif node.v > 0.0:
        for column in range(2):
            M[0, column], M[1, column] = 0.0, -acceleration / node.v * M[0, column]
    else:
        return 0.0
    return -np.inf


@inlined
def apply_saltation(ground: Ground, block: Struct, departed_side: int, next_node: Struct, v: float, M: Floats) -> float:
    """Multiply a derivative by the saltation of an impact, before which the velocity was v.

    Returns the logarithm of its |determinant|.
    """
    # At the other stop, all signs change in its frame.
    changes_stop = block.two_stops and next_node.side != departed_side
    hit, sign = (next_node.side, -1.0) if changes_stop else (departed_side, 1.0)
    speed = -sign * v
    e = compute_restitution_factor(block, hit, speed, 0)  # not drawn
    rate = e * compute_speed_slope(block, hit, speed, e)
    g_before = compute_restoring(ground, block, hit, next_node.piece, next_node.offset) - block.damping[hit] * speed
    g_after = compute_restoring(ground, block, next_node.side, next_node.piece, next_node.offset) + block.damping[
        next_node.side
    ] * (e * speed)
    coupling = (rate * g_before + g_after) / speed
    for column in range(2):
        du, dv = sign * M[0, column], sign * M[1, column]
        M[0, column], M[1, column] = -e * du, coupling * du - rate * dv
    determinant = abs(e * rate)
    return math.log(determinant) if determinant > 0.0 else -np.inf
