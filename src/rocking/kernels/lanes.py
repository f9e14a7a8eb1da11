"""Simulation of many blocks under one evenly sampled record: together, or one by one where an event may occur.

A lane contains one block and the factor on its motion. All lanes step through a sample together, in loops that
vectorise. A lane whose step may contain an event (an impact, a new peak, an overturning) is left unchanged, and `march`
simulates its block during that sample. Bounds decide, never sampling (`lane_steps.is_event_free`). The arithmetic of a
lane depends only on its block, its factor and the motion, never on other lanes. A block with a NaN is always simulated
by `march`.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.events import raise_peak
from rocking.kernels.ground import (
    ROUNDING,
    Ground,
    has_vertical,
    last_piece,
    piece_length,
    piece_start,
    scale_ground,
    unscaled_line,
    vertical_component,
)
from rocking.kernels.lane_steps import GROUP, STEP_CONSTANTS, WIDTH, step_linear, step_nonlinear, step_weighted
from rocking.kernels.march import march
from rocking.kernels.state import TO_THE_END, Ending, Record, Records, expose_fields, new_record, new_records, new_table

#: Largest sqrt(|lam W|) h in lanes, where W is the weight divided by the weight at rest: of a step, of a substep of the
#: nonlinear model, and of a substep of the linear model under varying weight.
MAX_STEP = 1.0
MAX_SUBSTEP = 0.04
MAX_WEIGHTED_SUBSTEP = 0.125

#: Rotation of a lane without a block.
EMPTY_ROTATION = 1e-300

#: Numbers of lanes in use, of lanes that have become free, and of blocks that wait for their uplift.
COUNTS = np.dtype([("active", "i8"), ("free", "i8"), ("waiting", "i8")], align=True)


class Pool(NamedTuple):
    """Blocks, groups of lanes, and queues of blocks that wait for a piece."""

    blocks: Records  # bodies
    states: Records  # state of each block
    steps: Records  # step constants of each block
    factors: Floats  # factor on the motion of each block
    groups: Records  # groups of lanes
    first_waiting: Integers  # for each piece, the first block that waits for it; -1: none
    next_waiting: Integers  # for each block, the next one that waits for the same piece; -1: none
    free_lanes: Integers  # lanes that have become free
    counts: Record  # `COUNTS`
    table: Records  # table without rows
    overturn_angle: float  # smallest rotation at which a block overturns


def build_pool(blocks: Records, states: Records, factors: Floats, pieces: int, h: float, substeps: int) -> Pool:
    """Return a pool in which every block waits for the first piece; ``substeps`` is 0 in the linear model."""
    count = len(blocks)
    groups = _allocate_aligned(-(-count // WIDTH), GROUP)
    groups["block"] = -1
    groups["u"] = EMPTY_ROTATION
    groups["peak"] = groups["sticking_push"] = np.inf
    first_waiting = np.full(pieces + 1, -1, dtype=np.int64)
    next_waiting = np.arange(1, count + 1, dtype=np.int64)
    next_waiting[-1] = -1
    first_waiting[0] = 0
    return Pool(
        blocks, states, compute_step_constants(blocks, h, substeps), factors, groups, first_waiting, next_waiting,
        np.zeros(count, dtype=np.int64), new_record(COUNTS, waiting=count), new_table(0),
        float(blocks["overturn_angle"].min()),
    )  # fmt: skip


def _allocate_aligned(count: int, kind: np.dtype[np.void]) -> Records:
    """Return zeroed records that start on a cache line (vectors across two lines are read at half the speed)."""
    line_size = 64
    buffer = np.zeros(count * kind.itemsize + line_size, dtype=np.uint8)
    skip = -buffer.ctypes.data % line_size
    return expose_fields(buffer[skip : skip + count * kind.itemsize].view(kind))


def compute_step_constants(blocks: Records, h: float, substeps: int) -> Records:
    """Compute the constants of a step of length h for every block (`STEP_CONSTANTS`)."""
    steps = new_records(len(blocks), STEP_CONSTANTS)
    lam = blocks["stiffness"]
    sign = np.array([1.0, -1.0])
    if substeps > 0:
        steps["stiffness"] = -0.5 * lam * (h / substeps) ** 2
        steps["push"] = sign
        return steps
    q = lam * h * h
    steps["stiffness"] = lam
    steps["pull"] = blocks["threshold_slope"] * blocks["threshold"]
    steps["push"] = blocks["threshold_slope"] * sign
    steps["first"] = h * stumpff(1, q)
    steps["second"] = h * h * stumpff(2, q)
    steps["third"] = h * h * h * stumpff(3, q)
    # For lam < 0, u'' inside a step may exceed both ends by |lam| h^2/8 of its largest value.
    steps["curve"] = h * h / 8.0 / (1.0 - np.maximum(-q, 0.0) / 8.0)
    return steps


def stumpff(k: int, q: Any) -> Floats:
    """Compute Stumpff's function c_k(q), the sum of q^j/(k + 2j)!, for |q| <= 1 to the last one or two bits."""
    q = np.asarray(q, dtype=np.float64)
    total = np.ones_like(q)
    for j in range(9, 0, -1):
        total = 1.0 + total * q / ((k + 2 * j - 1) * (k + 2 * j))
    return total / (1.0, 1.0, 2.0, 6.0)[k]


@inlined
def fill_lane(pool: Pool, lane: int, index: int) -> None:
    """Write a block's state and constants, except its sine and cosine, into a lane."""
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    state, steps = pool.states[index], pool.steps[index]
    side = state.side
    group.block[slot] = index
    group.factor[slot] = pool.factors[index]
    group.u[slot] = state.u
    group.v[slot] = state.v
    group.peak[slot] = state.peak
    group.stiffness[slot] = steps.stiffness[side]
    group.pull[slot] = steps.pull[side]
    group.push[slot] = steps.push[side]
    group.first[slot] = steps.first[side]
    group.second[slot] = steps.second[side]
    group.third[slot] = steps.third[side]
    group.curve[slot] = steps.curve[side]
    block = pool.blocks[index]
    if block.friction:
        group.sticking_push[slot] = block.sticking_push[side] if state.direction == 0 else -np.inf
        group.sticking_slope[slot] = block.sticking_slope[side]
        group.twice_slenderness[slot] = 2.0 * block.slenderness[side]


@inlined
def set_angles(pool: Pool, lane: int, index: int) -> None:
    """Set the sine and cosine of alpha - u in a lane."""
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    state = pool.states[index]
    psi = pool.blocks[index].slenderness[state.side] - state.u
    group.sine[slot] = math.sin(psi)
    group.cosine[slot] = math.cos(psi)


@inlined
def write_lane(ground: Ground, pool: Pool, lane: int, piece: int) -> int:
    """Write a lane into the state of its block at the start of a piece, and return the block's index.

    The state does not yet contain the largest rotation of a block that still rises.
    """
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    index = group.block[slot]
    state = pool.states[index]
    state.piece = piece
    state.offset = 0.0
    state.u = group.u[slot]
    state.v = group.v[slot]
    if state.u > state.peak:
        raise_peak(state, state.u, piece_start(ground, piece))
    return index


@inlined
def clear_lane(pool: Pool, lane: int) -> None:
    """Remove the block of a lane; no step then changes the lane or detects an event."""
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    group.block[slot] = -1
    group.u[slot] = EMPTY_ROTATION
    group.v[slot] = group.sine[slot] = group.cosine[slot] = 0.0
    group.peak[slot] = group.sticking_push[slot] = np.inf
    group.stiffness[slot] = group.pull[slot] = group.push[slot] = group.curve[slot] = 0.0
    group.first[slot] = group.second[slot] = group.third[slot] = 0.0


@inlined
def move_block(pool: Pool, lane: int, target_lane: int) -> None:
    """Move a block from one lane to another."""
    source, i = pool.groups[lane // WIDTH], lane % WIDTH
    target, j = pool.groups[target_lane // WIDTH], target_lane % WIDTH
    index = source.block[i]
    state = pool.states[index]
    state.u = source.u[i]
    state.v = source.v[i]
    peak = source.peak[i]
    target.sine[j] = source.sine[i]
    target.cosine[j] = source.cosine[i]
    fill_lane(pool, target_lane, index)
    target.peak[j] = peak
    clear_lane(pool, lane)


# ---- The loop over the samples of a record ----


@kernel
def run_lanes(ground: Ground, settings: Record, scratch: Record, pool: Pool, substeps: int) -> None:
    """Simulate every block of a pool under an evenly sampled record to its end.

    ``substeps`` per sample is 0 in the linear model under constant weight. Afterwards ``ending`` of every state is an
    `Ending`; RUNNING and PAUSED states can be continued individually.
    """
    piece = next_waiting_piece(pool, 0)
    while piece < last_piece(ground) and piece_start(ground, piece + 1) <= settings.stop:
        step_groups(ground, settings, scratch, pool, piece, substeps)
        drop_finished(pool)
        admit_waiting(ground, settings, scratch, pool, piece)
        piece += 1
        if pool.counts.active == 0:
            if pool.counts.waiting == 0:
                return
            piece = next_waiting_piece(pool, piece)
    for lane in range(pool.counts.active):
        write_lane(ground, pool, lane, piece)
    for index in range(pool.blocks.shape[0]):
        if pool.states[index].ending == Ending.RUNNING:
            march_until(ground, settings, scratch, pool, index, TO_THE_END)


@kernel
def march_blocks(ground: Ground, settings: Record, scratch: Record, pool: Pool) -> None:
    """Simulate every block of a pool to its end, one by one; ``ending`` of every state is then an `Ending`."""
    for index in range(pool.blocks.shape[0]):
        march_until(ground, settings, scratch, pool, index, TO_THE_END)


@inlined
def next_waiting_piece(pool: Pool, piece: int) -> int:
    """Return the first piece from ``piece`` on with a waiting block, or the end of the motion."""
    while piece < pool.first_waiting.shape[0] - 1 and pool.first_waiting[piece] < 0:
        piece += 1
    return piece


@inlined
def step_groups(ground: Ground, settings: Record, scratch: Record, pool: Pool, piece: int, substeps: int) -> None:
    """Move all lanes through one sample: together, or by a march if an event may occur."""
    for first in range(0, pool.counts.active, WIDTH):
        group = pool.groups[first // WIDTH]
        if pool.blocks[0].friction:
            mark_slips(group, unscaled_line(ground, piece), ground.unit, piece_length(ground, piece), substeps)
        events = step_group(ground, settings, group, piece, substeps, pool.overturn_angle)
        slot = 0
        while events > 0:
            if group.event[slot] != 0:
                march_sample(ground, settings, scratch, pool, piece, first + slot)
                events -= 1
            slot += 1


@inlined
def mark_slips(group: Record, push: tuple[float, float], unit: float, h: float, substeps: int) -> None:
    """Cause an event in each lane whose block may slip during a sample, by a NaN that is overwritten after its march.

    See `sliding.may_slip`. The weight is constant; without substeps the model is linear.
    """
    for lane in range(WIDTH):
        start, change = push[0] * group.factor[lane] * unit, push[1] * group.factor[lane] * unit * h
        largest = max(abs(start), abs(start + change)) * (1.0 + ROUNDING)
        speed = abs(group.v[lane])
        if substeps > 0:
            speed += -2.0 * group.stiffness[lane] * (substeps * substeps) / h * (1.0 + largest)
        else:
            speed += group.stiffness[lane] * h * (group.twice_slenderness[lane] + largest)
        sticks = largest <= group.sticking_push[lane] - group.sticking_slope[lane] * (speed * speed)
        sticks &= max(group.peak[lane], group.u[lane] + speed * h) <= group.twice_slenderness[lane]
        if not sticks and group.block[lane] >= 0:
            group.stiffness[lane] = np.nan


@inlined
def step_group(
    ground: Ground, settings: Record, group: Record, piece: int, substeps: int, overturn_angle: float
) -> int:
    """Step a group through one sample and return the number of lanes with possible events."""
    push, unit = unscaled_line(ground, piece), ground.unit
    length, h = piece_length(ground, piece), piece_length(ground, 0)
    if has_vertical(ground):
        lift = unscaled_line(vertical_component(ground), piece)
        if settings.nonlinear:
            return step_nonlinear(group, push, lift, unit, length, h, substeps, overturn_angle)
        return step_weighted(group, push, lift, unit, length, substeps, overturn_angle)
    if settings.nonlinear:
        return step_nonlinear(group, push, None, unit, length, h, substeps, overturn_angle)
    return step_linear(group, push, unit, h, length - h, overturn_angle)


@inlined
def march_sample(ground: Ground, settings: Record, scratch: Record, pool: Pool, piece: int, lane: int) -> None:
    """March the block of a lane through one sample, and free the lane unless the block still rocks."""
    index = write_lane(ground, pool, lane, piece)
    if march_until(ground, settings, scratch, pool, index, piece + 1):
        start_lane(settings, pool, lane, index)
    else:
        clear_lane(pool, lane)
        pool.free_lanes[pool.counts.free] = lane
        pool.counts.free += 1


@inlined
def start_lane(settings: Record, pool: Pool, lane: int, index: int) -> None:
    """Assign a block to a lane."""
    fill_lane(pool, lane, index)
    if settings.nonlinear:
        set_angles(pool, lane, index)


@inlined
def march_until(ground: Ground, settings: Record, scratch: Record, pool: Pool, index: int, stop_piece: int) -> bool:
    """March a block up to a piece and return whether it rocks at its start; if not, queue it for its next uplift."""
    state = pool.states[index]
    state.stop_piece = stop_piece
    scaled = scale_ground(ground, pool.factors[index])
    state.ending = march(scaled, pool.blocks[index], settings, pool.table, scratch, state)
    if state.ending != Ending.RUNNING:
        return False
    if state.side >= 0 and state.piece == stop_piece and state.offset == 0.0:
        return True
    pool.next_waiting[index] = pool.first_waiting[state.piece]
    pool.first_waiting[state.piece] = index
    pool.counts.waiting += 1
    return False


@inlined
def drop_finished(pool: Pool) -> None:
    """Move the blocks of the last lanes into the lanes that have become free."""
    while pool.counts.free > 0:
        pool.counts.free -= 1
        pool.counts.active -= 1
        lane = pool.free_lanes[pool.counts.free]
        if lane != pool.counts.active:
            move_block(pool, pool.counts.active, lane)


@inlined
def admit_waiting(ground: Ground, settings: Record, scratch: Record, pool: Pool, piece: int) -> None:
    """March the blocks that wait for a piece through it, and admit those that rock at its end."""
    index = pool.first_waiting[piece]
    while index >= 0:
        next_index = pool.next_waiting[index]
        pool.counts.waiting -= 1
        if march_until(ground, settings, scratch, pool, index, piece + 1):
            start_lane(settings, pool, pool.counts.active, index)
            pool.counts.active += 1
        index = next_index
