"""Simulation of many blocks under one evenly sampled record: together, or one by one where an event may occur.

A lane contains one block. All lanes step through a sample together, in loops that vectorise. A lane whose step may
contain an event (an impact, a new peak, an overturning) is left unchanged, and `march` simulates its block during that
sample. Bounds decide, never sampling (`lane_steps.is_event_free`). The arithmetic of a lane depends only on its block
and the motion, never on other lanes. A block with a NaN is always simulated by `march`.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.events import raise_peak
from rocking.kernels.ground import Ground, coefficient, has_vertical, last_piece, length_of, start_of, vertical_of
from rocking.kernels.lane_steps import GROUP, STEP_CONSTANTS, WIDTH, step_linear, step_nonlinear, step_weighted
from rocking.kernels.march import march
from rocking.kernels.state import (
    TO_THE_END,
    Ending,
    Record,
    Records,
    attributed,
    new_table,
    record,
    records,
)

#: Largest sqrt(|lam W|) h of a block in lanes, where W is its weight divided by the weight at rest; of a substep of the
#: nonlinear model; and of a substep of the linear model under varying weight.
LONGEST_STEP = 1.0
LONGEST_SUBSTEP = 0.04
LONGEST_WEIGHTED_SUBSTEP = 0.125

#: Rotation of a lane without a block.
EMPTY_ROTATION = 1e-300

#: Numbers of lanes in use, of lanes that have become free, and of blocks that wait for their uplift.
COUNTS = np.dtype([("active", "i8"), ("free", "i8"), ("waiting", "i8")], align=True)


class Pool(NamedTuple):
    """Blocks, their states and step constants, groups of lanes, and queues of blocks that wait for a piece.

    ``first[piece]`` is the first block that waits for a piece, ``following[block]`` the next one (-1: none), and
    ``free`` the lanes that have become free. ``table`` has no rows.
    """

    blocks: Records
    states: Records
    steps: Records
    groups: Records
    first: Integers
    following: Integers
    free: Integers
    counts: Record
    table: Records
    fallen: float


def pool_of(blocks: Records, states: Records, pieces: int, h: float, substeps: int) -> Pool:
    """Return a pool in which every block waits for the first piece; ``substeps`` is 0 in the linear model."""
    count = len(blocks)
    groups = _on_cache_lines(-(-count // WIDTH), GROUP)
    groups["block"] = -1
    groups["u"] = EMPTY_ROTATION
    groups["peak"] = np.inf
    first = np.full(pieces + 1, -1, dtype=np.int64)
    following = np.arange(1, count + 1, dtype=np.int64)
    following[-1] = -1
    first[0] = 0
    return Pool(
        blocks, states, step_constants(blocks, h, substeps), groups, first, following,
        np.zeros(count, dtype=np.int64), record(COUNTS, waiting=count), new_table(0),
        float(blocks["overturn_angle"].min()),
    )  # fmt: skip


def _on_cache_lines(count: int, kind: np.dtype[np.void]) -> Records:
    """Return zeroed records that start on a cache line (vectors across two lines are read at half the speed)."""
    line = 64
    space = np.zeros(count * kind.itemsize + line, dtype=np.uint8)
    skip = -space.ctypes.data % line
    return attributed(space[skip : skip + count * kind.itemsize].view(kind))


def step_constants(blocks: Records, h: float, substeps: int) -> Records:
    """Compute the constants of a step of length h for every block (`STEP_CONSTANTS`)."""
    steps = records(len(blocks), STEP_CONSTANTS)
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
        raise_peak(state, state.u, start_of(ground, piece))
    return index


@inlined
def empty(pool: Pool, lane: int) -> None:
    """Remove the block of a lane; no step then changes the lane or detects an event."""
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    group.block[slot] = -1
    group.u[slot] = EMPTY_ROTATION
    group.v[slot] = group.sine[slot] = group.cosine[slot] = 0.0
    group.peak[slot] = np.inf
    group.stiffness[slot] = group.pull[slot] = group.push[slot] = group.curve[slot] = 0.0
    group.first[slot] = group.second[slot] = group.third[slot] = 0.0


@inlined
def move_block(pool: Pool, lane: int, to: int) -> None:
    """Move a block from one lane to another."""
    source, i = pool.groups[lane // WIDTH], lane % WIDTH
    target, j = pool.groups[to // WIDTH], to % WIDTH
    index = source.block[i]
    state = pool.states[index]
    state.u = source.u[i]
    state.v = source.v[i]
    peak = source.peak[i]
    target.sine[j] = source.sine[i]
    target.cosine[j] = source.cosine[i]
    fill_lane(pool, to, index)
    target.peak[j] = peak
    empty(pool, lane)


# ---- The loop over the samples of a record ----


@kernel
def run_lanes(ground: Ground, settings: Record, scratch: Record, pool: Pool, substeps: int) -> None:
    """Simulate every block of a pool under an evenly sampled record to its end.

    ``substeps`` per sample is 0 in the linear model under constant weight. Afterwards ``ending`` of every state is an
    `Ending`; RUNNING and PAUSED states can be continued individually.
    """
    piece = next_waited_for(pool, 0)
    while piece < last_piece(ground) and start_of(ground, piece + 1) <= settings.stop:
        step_groups(ground, settings, scratch, pool, piece, substeps)
        drop_finished(pool)
        admit_waiting(ground, settings, scratch, pool, piece)
        piece += 1
        if pool.counts.active == 0:
            if pool.counts.waiting == 0:
                return
            piece = next_waited_for(pool, piece)
    for lane in range(pool.counts.active):
        write_lane(ground, pool, lane, piece)
    for index in range(pool.blocks.shape[0]):
        if pool.states[index].ending == Ending.RUNNING:
            march_until(ground, settings, scratch, pool, index, TO_THE_END)


@kernel
def march_each(ground: Ground, settings: Record, scratch: Record, pool: Pool) -> None:
    """Simulate every block of a pool to its end, one by one; ``ending`` of every state is then an `Ending`."""
    for index in range(pool.blocks.shape[0]):
        march_until(ground, settings, scratch, pool, index, TO_THE_END)


@inlined
def next_waited_for(pool: Pool, piece: int) -> int:
    """Return the first piece from ``piece`` on with a waiting block, or the end of the motion."""
    while piece < pool.first.shape[0] - 1 and pool.first[piece] < 0:
        piece += 1
    return piece


@inlined
def step_groups(ground: Ground, settings: Record, scratch: Record, pool: Pool, piece: int, substeps: int) -> None:
    """Move all lanes through one sample: together, or by a march if an event may occur."""
    for first in range(0, pool.counts.active, WIDTH):
        group = pool.groups[first // WIDTH]
        events = step_group(ground, settings, group, piece, substeps, pool.fallen)
        slot = 0
        while events > 0:
            if group.event[slot] != 0:
                march_sample(ground, settings, scratch, pool, piece, first + slot)
                events -= 1
            slot += 1


@inlined
def step_group(ground: Ground, settings: Record, group: Record, piece: int, substeps: int, fallen: float) -> int:
    """Step a group through one sample and return the number of lanes with possible events."""
    push = (coefficient(ground, piece, 0), coefficient(ground, piece, 1))
    length, h = length_of(ground, piece), length_of(ground, 0)
    if has_vertical(ground):
        lift = vertical_of(ground)
        weight = (1.0 + coefficient(lift, piece, 0), coefficient(lift, piece, 1))
        if settings.nonlinear:
            return step_nonlinear(group, push, weight, length, h, substeps, fallen)
        return step_weighted(group, push, weight, length, substeps, fallen)
    if settings.nonlinear:
        return step_nonlinear(group, push, None, length, h, substeps, fallen)
    return step_linear(group, push, h, length - h, fallen)


@inlined
def march_sample(ground: Ground, settings: Record, scratch: Record, pool: Pool, piece: int, lane: int) -> None:
    """March the block of a lane through one sample; it keeps its lane if still rocking."""
    index = write_lane(ground, pool, lane, piece)
    if march_until(ground, settings, scratch, pool, index, piece + 1):
        start_lane(settings, pool, lane, index)
    else:
        empty(pool, lane)
        pool.free[pool.counts.free] = lane
        pool.counts.free += 1


@inlined
def start_lane(settings: Record, pool: Pool, lane: int, index: int) -> None:
    """Assign a block to a lane."""
    fill_lane(pool, lane, index)
    if settings.nonlinear:
        set_angles(pool, lane, index)


@inlined
def march_until(ground: Ground, settings: Record, scratch: Record, pool: Pool, index: int, until: int) -> bool:
    """March a block up to a piece and return whether it rocks there; if not, queue it for the piece where it will."""
    state = pool.states[index]
    state.stop_piece = until
    state.ending = march(ground, pool.blocks[index], settings, pool.table, scratch, state)
    if state.ending != Ending.RUNNING:
        return False
    if state.side >= 0 and state.piece == until and state.offset == 0.0:
        return True
    pool.following[index] = pool.first[state.piece]
    pool.first[state.piece] = index
    pool.counts.waiting += 1
    return False


@inlined
def drop_finished(pool: Pool) -> None:
    """Fill the lanes that have become free with the last ones."""
    while pool.counts.free > 0:
        pool.counts.free -= 1
        pool.counts.active -= 1
        lane = pool.free[pool.counts.free]
        if lane != pool.counts.active:
            move_block(pool, pool.counts.active, lane)


@inlined
def admit_waiting(ground: Ground, settings: Record, scratch: Record, pool: Pool, piece: int) -> None:
    """March the blocks that wait for a piece through it, and admit those that rock at its end."""
    index = pool.first[piece]
    while index >= 0:
        following = pool.following[index]
        pool.counts.waiting -= 1
        if march_until(ground, settings, scratch, pool, index, piece + 1):
            start_lane(settings, pool, pool.counts.active, index)
            pool.counts.active += 1
        index = following
