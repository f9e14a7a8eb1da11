"""Simulation of many blocks under evenly sampled records: together, or one by one where an event may occur.

A lane contains one simulation: a block, a motion, and the factor on it. Each lane is at its own sample of its own
motion, and starts another simulation when one ends. All lanes step through their samples together, in loops that
vectorise. A lane whose step may contain an event (an impact, a new peak, an overturning) is left unchanged, and `march`
simulates its block during that sample. Bounds decide, never sampling (`lane_steps.is_event_free`). The arithmetic of a
lane depends only on its block, its motion and the factor, never on other lanes. A block with a NaN is always simulated
by `march`.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import raise_peak
from rocking.kernels.ground import FIRST, LENGTH, START, Grounds, select_ground
from rocking.kernels.lane_steps import (
    GROUP_DTYPE,
    LANE_COUNT,
    STEP_CONSTANTS_DTYPE,
    compute_push_line,
    step_linear,
    step_nonlinear,
    step_weighted,
)
from rocking.kernels.march import march
from rocking.kernels.state import (
    NO_STOP_PIECE,
    MarchStatus,
    Struct,
    Structs,
    create_struct,
    create_structs,
    create_table,
    define_struct,
    expose_fields,
)

#: Largest sqrt(|lam W|) h in lanes, where W is the weight divided by the weight at rest: of a step, of a substep of the
#: nonlinear model, and of a substep of the linear model under varying weight.
MAX_STEP = 1.0
MAX_SUBSTEP = 0.04
MAX_WEIGHTED_SUBSTEP = 0.125

#: Rotation of a lane without a block.
EMPTY_ROTATION = 1e-300

#: Numbers of lanes in use and of simulations that have started.
COUNTS_DTYPE = define_struct(active="i8", started="i8")


class SimulationPool(NamedTuple):
    """Simulations of blocks under motions, and the lanes in which they run."""

    grounds: Grounds  # motions
    motion_indices: Integers  # index of the motion of each simulation
    factors: Floats  # factor on it
    blocks: Structs  # body of each
    states: Structs  # state of each
    step_constants: Structs  # step constants of each
    end_pieces: Integers  # first piece of each motion that lanes do not step
    groups: Structs  # one group of lanes
    counts: Struct  # `COUNTS_DTYPE`
    table: Structs  # table without rows


def build_pool(
    grounds: Grounds, motions: Integers, factors: Floats, blocks: Structs, states: Structs, stop: float, substeps: int
) -> SimulationPool:
    """Return a pool of simulations up to a stop; ``substeps`` is 0 in the linear model under constant weight."""
    first, last = grounds.first_pieces[:-1], grounds.first_pieces[1:] - 1
    breakpoints = (grounds.pieces[start + 1 : end + 1, START] for start, end in zip(first, last, strict=True))
    ends = np.array([np.searchsorted(times, stop, "right") for times in breakpoints], dtype=np.int64)
    steps = compute_step_constants(blocks, grounds.pieces[first, LENGTH][motions], substeps)
    groups, counts = _allocate_aligned(1, GROUP_DTYPE), create_struct(COUNTS_DTYPE, active=LANE_COUNT)
    return SimulationPool(grounds, motions, factors, blocks, states, steps, ends, groups, counts, create_table(0))


def _allocate_aligned(count: int, kind: np.dtype[np.void]) -> Structs:
    """Return zeroed structs that start on a cache line (vectors across two lines are read at half the speed)."""
    line_size = 64
    buffer = np.zeros(count * kind.itemsize + line_size, dtype=np.uint8)
    skip = -buffer.ctypes.data % line_size
    return expose_fields(buffer[skip : skip + count * kind.itemsize].view(kind))


def compute_step_constants(blocks: Structs, lengths: Floats, substeps: int) -> Structs:
    """Compute the constants of a step of each length for every block (`STEP_CONSTANTS_DTYPE`)."""
    steps = create_structs(len(blocks), STEP_CONSTANTS_DTYPE)
    lam, h = blocks["stiffness"], lengths[:, None]
    sign = np.array([1.0, -1.0])
    if substeps > 0:
        steps["stiffness"] = -0.5 * lam * (h / substeps) ** 2
        steps["push_gain"] = sign
        return steps
    q = lam * h * h
    steps["stiffness"] = lam
    steps["pull"] = blocks["restoring_gain"] * blocks["threshold"]
    steps["push_gain"] = blocks["restoring_gain"] * sign
    steps["stumpff_1"] = h * compute_stumpff(1, q)
    steps["stumpff_2"] = h * h * compute_stumpff(2, q)
    steps["stumpff_3"] = h * h * h * compute_stumpff(3, q)
    # For lam < 0, u'' inside a step may exceed both ends by |lam| h^2/8 of its largest value.
    steps["curvature_factor"] = h * h / 8.0 / (1.0 - np.maximum(-q, 0.0) / 8.0)
    return steps


def compute_stumpff(k: int, q: Any) -> Floats:
    """Compute Stumpff's function c_k(q), the sum of q^j/(k + 2j)!, for |q| <= 1 to the last one or two bits."""
    q = np.asarray(q, dtype=np.float64)
    total = np.ones_like(q)
    for j in range(9, 0, -1):
        total = 1.0 + total * q / ((k + 2 * j - 1) * (k + 2 * j))
    return total / (1.0, 1.0, 2.0, 6.0)[k]


@inlined
def fill_lane(pool: SimulationPool, settings: Struct, lane: int, index: int) -> None:
    """Write the state and constants of a simulation into a lane."""
    group, state, steps, motion = (
        pool.groups[0],
        pool.states[index],
        pool.step_constants[index],
        pool.motion_indices[index],
    )
    side, first, block = state.side, pool.grounds.first_pieces[motion], pool.blocks[index]
    group.simulation[lane] = index
    group.row[lane] = first + state.piece
    group.end_row[lane] = first + pool.end_pieces[motion]
    group.increment[lane] = 1
    group.h[lane] = pool.grounds.pieces[first, LENGTH]
    group.factor[lane] = pool.factors[index]
    group.overturn_angle[lane] = block.overturn_angle
    group.u[lane] = state.u
    group.v[lane] = state.v
    group.peak[lane] = state.peak
    group.stiffness[lane] = steps.stiffness[side]
    group.pull[lane] = steps.pull[side]
    group.push_gain[lane] = steps.push_gain[side]
    group.stumpff_1[lane] = steps.stumpff_1[side]
    group.stumpff_2[lane] = steps.stumpff_2[side]
    group.stumpff_3[lane] = steps.stumpff_3[side]
    group.curvature_factor[lane] = steps.curvature_factor[side]
    if block.has_friction:
        group.sticking_push[lane] = block.sticking_push[side] if state.direction == 0 else -np.inf
        group.sticking_slope[lane] = block.sticking_slope[side]
        group.overturn_angle[lane] = min(block.overturn_angle, 2.0 * block.slenderness[side])
    if settings.nonlinear:
        psi = block.slenderness[side] - state.u
        group.sine[lane] = math.sin(psi)
        group.cosine[lane] = math.cos(psi)


@inlined
def save_lane(pool: SimulationPool, lane: int) -> int:
    """Write a lane into the state of its simulation at the start of a sample, and return the simulation's index.

    The state does not yet contain the largest rotation of a block that still rises.
    """
    group = pool.groups[0]
    index, row = group.simulation[lane], group.row[lane]
    state = pool.states[index]
    state.piece = row - pool.grounds.first_pieces[pool.motion_indices[index]]
    state.offset = 0.0
    state.u = group.u[lane]
    state.v = group.v[lane]
    if state.u > state.peak:
        raise_peak(state, state.u, pool.grounds.pieces[row, START])
    return index


@inlined
def clear_lane(pool: SimulationPool, lane: int) -> None:
    """Remove the simulation of a lane; no step then changes the lane or detects an event."""
    group = pool.groups[0]
    group.simulation[lane] = -1
    group.row[lane] = group.increment[lane] = 0
    group.end_row[lane] = 1
    group.u[lane] = EMPTY_ROTATION
    group.v[lane] = group.sine[lane] = group.cosine[lane] = group.factor[lane] = 0.0
    group.peak[lane] = group.overturn_angle[lane] = group.sticking_push[lane] = np.inf
    group.h[lane] = pool.grounds.pieces[0, LENGTH]
    group.stiffness[lane] = group.pull[lane] = group.push_gain[lane] = group.curvature_factor[lane] = 0.0
    group.stumpff_1[lane] = group.stumpff_2[lane] = group.stumpff_3[lane] = 0.0


# ---- The loop over samples ----


@kernel
def run_lanes(settings: Struct, scratch: Struct, pool: SimulationPool, substeps: int) -> None:
    """Run all simulations of a pool under evenly sampled records to their ends.

    ``substeps`` per sample is 0 in the linear model under constant weight. Afterwards ``status`` of every state is an
    `MarchStatus`; PAUSED states can be continued individually.
    """
    for lane in range(LANE_COUNT):
        start_simulation(settings, scratch, pool, lane)
    group = pool.groups[0]
    while pool.counts.active > 0:
        load_samples(pool)
        if pool.blocks[0].has_friction:
            mark_slips(group, pool.grounds.g_per_unit, substeps)
        events = step_group(settings, pool, substeps)
        lane = 0
        while events > 0:
            if group.has_event[lane] != 0:
                march_lane(settings, scratch, pool, lane)
                events -= 1
            lane += 1


@kernel
def march_blocks(settings: Struct, scratch: Struct, pool: SimulationPool) -> None:
    """Run all simulations of a pool to their ends, one by one; ``status`` of every state is then an `MarchStatus`."""
    for index in range(pool.blocks.shape[0]):
        state = pool.states[index]
        ground = select_ground(pool.grounds, pool.motion_indices[index], pool.factors[index])
        state.status = march(ground, pool.blocks[index], settings, pool.table, scratch, state)


@inlined
def load_samples(pool: SimulationPool) -> None:
    """Copy the sample of every lane from its motion; NaN beyond the last, which no step accepts."""
    group, pieces = pool.groups[0], pool.grounds.pieces
    for lane in range(LANE_COUNT):
        row = group.row[lane]
        group.length[lane] = pieces[row, LENGTH]
        group.push_start[lane] = pieces[row, FIRST] if row < group.end_row[lane] else np.nan
        group.push_slope[lane] = pieces[row, FIRST + 1]
    if has_vertical_motion(pool):
        for lane in range(LANE_COUNT):
            row = group.row[lane]
            group.vertical_start[lane] = pieces[row, FIRST + 2]
            group.vertical_slope[lane] = pieces[row, FIRST + 3]


@inlined
def mark_slips(group: Struct, g_per_unit: float, substeps: int) -> None:
    """Cause an event in each lane whose block may slip during a sample: without overturning angle until its march.

    See `sliding.may_slip`. The weight is constant; without substeps the model is linear. Rotations beyond twice the
    slenderness are events of all lanes with friction.
    """
    if substeps == 0:
        for lane in range(LANE_COUNT):
            sticks = find_largest_push(group, lane, g_per_unit) <= group.sticking_push[lane]
            group.overturn_angle[lane] = group.overturn_angle[lane] if sticks else -np.inf
        return
    for lane in range(LANE_COUNT):
        largest = find_largest_push(group, lane, g_per_unit)
        max_change = -2.0 * group.stiffness[lane] * (substeps * substeps) / group.length[lane]
        speed = abs(group.v[lane]) + max_change * (1.0 + largest)
        sticks = largest <= group.sticking_push[lane] - group.sticking_slope[lane] * (speed * speed)
        group.overturn_angle[lane] = group.overturn_angle[lane] if sticks else -np.inf


@inlined
def find_largest_push(group: Struct, lane: int, g_per_unit: float) -> float:
    """Return the largest absolute ground acceleration during a sample, g."""
    start, slope = compute_push_line(group, lane, g_per_unit)
    return max(abs(start), abs(start + slope * group.length[lane]))


@inlined
def has_vertical_motion(pool: SimulationPool) -> bool:
    """Return whether the motions have a vertical component."""
    return pool.grounds.stretches.shape[1] > 1


@inlined
def step_group(settings: Struct, pool: SimulationPool, substeps: int) -> int:
    """Step all lanes through their samples and return the number of those with possible events."""
    group, g_per_unit = pool.groups[0], pool.grounds.g_per_unit
    if settings.nonlinear:
        if has_vertical_motion(pool):
            return step_nonlinear(group, (1.0, 0.0), g_per_unit, substeps)
        return step_nonlinear(group, None, g_per_unit, substeps)
    return step_weighted(group, g_per_unit, substeps) if has_vertical_motion(pool) else step_linear(group, g_per_unit)


@inlined
def march_lane(settings: Struct, scratch: Struct, pool: SimulationPool, lane: int) -> None:
    """March the block of a lane at least through one sample; if its simulation ends, start another one."""
    index = save_lane(pool, lane)
    if march_to_sample(settings, scratch, pool, index):
        fill_lane(pool, settings, lane, index)
    else:
        start_simulation(settings, scratch, pool, lane)


@not_inlined
def start_simulation(settings: Struct, scratch: Struct, pool: SimulationPool, lane: int) -> None:
    """Start simulations until one rocks at the start of a sample, and put it into a lane; without one, clear it."""
    while pool.counts.started < pool.blocks.shape[0]:
        index = pool.counts.started
        pool.counts.started += 1
        if march_to_sample(settings, scratch, pool, index):
            fill_lane(pool, settings, lane, index)
            return
    clear_lane(pool, lane)
    pool.counts.active -= 1


@inlined
def march_to_sample(settings: Struct, scratch: Struct, pool: SimulationPool, index: int) -> bool:
    """March a block until it rocks at the start of a sample that lanes may step, or to its end; False at its end."""
    state, block, motion = pool.states[index], pool.blocks[index], pool.motion_indices[index]
    ground = select_ground(pool.grounds, motion, pool.factors[index])
    end = pool.end_pieces[motion]
    while True:
        state.stop_piece = state.piece + 1 if state.piece < end else NO_STOP_PIECE
        state.status = march(ground, block, settings, pool.table, scratch, state)
        if state.status != MarchStatus.RUNNING:
            return False
        if state.side >= 0 and state.piece == state.stop_piece and state.offset == 0.0 and state.piece < end:
            return True
