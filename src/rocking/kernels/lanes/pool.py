"""A pool of lanes: which block each lane carries, its state, and the constants of its step."""

import math
from typing import Any, NamedTuple

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.kernels.compiled import inlined
from rocking.kernels.ground import Ground, start_of
from rocking.kernels.state import Record, Records, attributed, new_table, record, records

#: Lanes that step together. A constant, so that their loops have a fixed length.
WIDTH = 32

#: Largest sqrt(|lam W|) h of a block in lanes, W being its weight over that at rest; of one substep of the nonlinear
#: model; and of one of the linear model while the weight changes.
LONGEST_STEP = 1.0
LONGEST_SUBSTEP = 0.04
LONGEST_WEIGHTED_SUBSTEP = 0.125

#: Rotation of a lane without a block.
EMPTY_ROTATION = 1e-300

_LANES = ("f8", (WIDTH,))
_SIDES = ("f8", (2,))

#: A group of lanes. Which block and whether its step may hold an event; u, u' and (nonlinear) sin and cos(alpha - u),
#: and the same where a step would take them; constants of the side that the block is on (`STEP_CONSTANTS`); peak.
GROUP = np.dtype(
    [("block", "i8", (WIDTH,)), ("event", "i8", (WIDTH,))]
    + [
        (name, *_LANES)
        for name in (
            "u", "v", "sine", "cosine", "next_u", "next_v", "next_sine", "next_cosine",
            "stiffness", "pull", "push", "first", "second", "third", "curve", "peak",
        )
    ],
    align=True,
)  # fmt: skip

#: Constants of a step of length h on each side. Linear: lam, gain threshold, side gain (u'' = lam u - pull - push a),
#: h c1, h^2 c2, h^3 c3 with Stumpff's functions c_k of lam h^2. Nonlinear: -lam h^2/2 in place of lam, the side's sign
#: in place of its gain. Curve bounds a bulge: (h^2/8) max |u''|.
STEP_CONSTANTS = np.dtype(
    [(name, *_SIDES) for name in ("stiffness", "pull", "push", "first", "second", "third", "curve")],
    align=True,
)

#: How many lanes are in use, how many of them have become free, and how many blocks wait for their uplift.
COUNTS = np.dtype([("active", "i8"), ("free", "i8"), ("waiting", "i8")], align=True)


class Pool(NamedTuple):
    """Blocks, their states and step constants; groups of lanes; and which blocks wait for which piece of the motion.

    ``first[piece]`` is the first block that waits for a piece, ``following[block]`` the next one (-1: none). ``free``
    lists the lanes that have become free. ``table`` has no rows.
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
    """Pool in which every block waits for the first piece; ``substeps`` is 0 in the linear model."""
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
        np.zeros(count, dtype=np.int64), record(COUNTS, waiting=count), new_table(0), float(blocks["fallen"].min()),
    )  # fmt: skip


def _on_cache_lines(count: int, kind: np.dtype[np.void]) -> Records:
    """Zeroed records that start on a cache line: vectors that cross two lines load at half the speed."""
    line = 64
    space = np.zeros(count * kind.itemsize + line, dtype=np.uint8)
    skip = -space.ctypes.data % line
    return attributed(space[skip : skip + count * kind.itemsize].view(kind))


def step_constants(blocks: Records, h: float, substeps: int) -> Records:
    """Constants of a step of length h for every block (`STEP_CONSTANTS`)."""
    steps = records(len(blocks), STEP_CONSTANTS)
    lam = blocks["stiffness"]
    sign = np.array([1.0, -1.0])
    if substeps > 0:
        steps["stiffness"] = -0.5 * lam * (h / substeps) ** 2
        steps["push"] = sign
        return steps
    q = lam * h * h
    steps["stiffness"] = lam
    steps["pull"] = blocks["gain"] * blocks["threshold"]
    steps["push"] = blocks["gain"] * sign
    steps["first"] = h * stumpff(1, q)
    steps["second"] = h * h * stumpff(2, q)
    steps["third"] = h * h * h * stumpff(3, q)
    # For lam < 0 u'' may be larger inside a step than at both its ends, by |lam| h^2/8 of the largest value.
    steps["curve"] = h * h / 8.0 / (1.0 - np.maximum(-q, 0.0) / 8.0)
    return steps


def stumpff(k: int, q: Any) -> Floats:
    """Stumpff's function c_k(q), the sum of q^j/(k + 2j)!, for |q| <= 1: to the last bit or two."""
    q = np.asarray(q, dtype=np.float64)
    total = np.ones_like(q)
    for j in range(9, 0, -1):
        total = 1.0 + total * q / ((k + 2 * j - 1) * (k + 2 * j))
    return total / (1.0, 1.0, 2.0, 6.0)[k]


@inlined
def load(pool: Pool, lane: int, index: int) -> None:
    """Put a block into a lane, but for its sine and cosine."""
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
    """Set a lane's sine and cosine of alpha - u."""
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    state = pool.states[index]
    psi = pool.blocks[index].slenderness[state.side] - state.u
    group.sine[slot] = math.sin(psi)
    group.cosine[slot] = math.cos(psi)


@inlined
def unload(ground: Ground, pool: Pool, lane: int, piece: int) -> int:
    """Write a lane's numbers into its block's state, at the start of a piece; returns the block.

    The highest rotation of a lane that still rises has not been written before.
    """
    group, slot = pool.groups[lane // WIDTH], lane % WIDTH
    index = group.block[slot]
    state = pool.states[index]
    state.piece = piece
    state.offset = 0.0
    state.u = group.u[slot]
    state.v = group.v[slot]
    if state.u > state.peak:
        state.peak = state.u
        state.peak_time = start_of(ground, piece)
    return index


@inlined
def empty(pool: Pool, lane: int) -> None:
    """Leave a lane without a block, with numbers that no step changes and that never mean an event."""
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
    here, slot = pool.groups[lane // WIDTH], lane % WIDTH
    there, place = pool.groups[to // WIDTH], to % WIDTH
    index = here.block[slot]
    state = pool.states[index]
    state.u = here.u[slot]
    state.v = here.v[slot]
    peak = here.peak[slot]
    there.sine[place] = here.sine[slot]
    there.cosine[place] = here.cosine[slot]
    load(pool, to, index)
    there.peak[place] = peak
    empty(pool, lane)
