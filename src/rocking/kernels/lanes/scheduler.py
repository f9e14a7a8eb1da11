"""The loop over the samples of a record: which lanes step together, which blocks march alone, and which wait."""

from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.ground import Ground, coefficient, has_vertical, last_piece, length_of, start_of, vertical_of
from rocking.kernels.lanes.pool import WIDTH, Pool, empty, load, move_block, set_angles, unload
from rocking.kernels.lanes.steps import step_linear, step_nonlinear, step_weighted
from rocking.kernels.march import march
from rocking.kernels.state import AT_REST, TO_THE_END, Ending, Record


@kernel
def run_lanes(ground: Ground, rules: Record, scratch: Record, pool: Pool, substeps: int) -> None:
    """March every block of a pool through a record of even samples, and on to its own end.

    ``substeps`` is how many a sample is divided into: 0 in the linear model under a constant weight. Afterwards
    ``ending`` of every state is an `Ending`; RUNNING and PAUSED ones can be continued one by one.
    """
    piece = next_waited_for(pool, 0)
    while piece < last_piece(ground) and start_of(ground, piece + 1) <= rules.stop:
        step_groups(ground, rules, scratch, pool, piece, substeps)
        compact(pool)
        admit_waiting(ground, rules, scratch, pool, piece)
        piece += 1
        if pool.counts.active == 0:
            if pool.counts.waiting == 0:
                return
            piece = next_waited_for(pool, piece)
    for lane in range(pool.counts.active):
        unload(ground, pool, lane, piece)
    for index in range(pool.blocks.shape[0]):
        if pool.states[index].ending == Ending.RUNNING:
            march_until(ground, rules, scratch, pool, index, TO_THE_END)


@kernel
def march_each(ground: Ground, rules: Record, scratch: Record, pool: Pool) -> None:
    """March every block of a pool to its end, one after the other; ``ending`` of every state is then an `Ending`."""
    for index in range(pool.blocks.shape[0]):
        march_until(ground, rules, scratch, pool, index, TO_THE_END)


@inlined
def next_waited_for(pool: Pool, piece: int) -> int:
    """First piece from this one on for which a block waits; the motion's end where there is none."""
    while piece < pool.first.shape[0] - 1 and pool.first[piece] < 0:
        piece += 1
    return piece


@inlined
def step_groups(ground: Ground, rules: Record, scratch: Record, pool: Pool, piece: int, substeps: int) -> None:
    """Move all lanes through one sample: together, or by a march where that may hold an event."""
    for first in range(0, pool.counts.active, WIDTH):
        group = pool.groups[first // WIDTH]
        events = step_group(ground, rules, group, piece, substeps, pool.fallen)
        slot = 0
        while events > 0:
            if group.event[slot] != 0:
                march_sample(ground, rules, scratch, pool, piece, first + slot)
                events -= 1
            slot += 1


@inlined
def step_group(ground: Ground, rules: Record, group: Record, piece: int, substeps: int, fallen: float) -> int:
    """Step a group through one sample; returns in how many lanes that may hold an event."""
    push = (coefficient(ground, piece, 0), coefficient(ground, piece, 1))
    length, h = length_of(ground, piece), length_of(ground, 0)
    if has_vertical(ground):
        lift = vertical_of(ground)
        weight = (1.0 + coefficient(lift, piece, 0), coefficient(lift, piece, 1))
        if rules.nonlinear:
            return step_nonlinear(group, push, weight, length, h, substeps, fallen)
        return step_weighted(group, push, weight, length, substeps, fallen)
    if rules.nonlinear:
        return step_nonlinear(group, push, None, length, h, substeps, fallen)
    return step_linear(group, push, h, length - h, fallen)


@inlined
def march_sample(ground: Ground, rules: Record, scratch: Record, pool: Pool, piece: int, lane: int) -> None:
    """March the block of a lane through one sample; it keeps its lane if it rocks on."""
    index = unload(ground, pool, lane, piece)
    if march_until(ground, rules, scratch, pool, index, piece + 1):
        admit(rules, pool, lane, index)
    else:
        empty(pool, lane)
        pool.free[pool.counts.free] = lane
        pool.counts.free += 1


@inlined
def admit(rules: Record, pool: Pool, lane: int, index: int) -> None:
    """Let a lane carry a block."""
    load(pool, lane, index)
    if rules.nonlinear:
        set_angles(pool, lane, index)


@inlined
def march_until(ground: Ground, rules: Record, scratch: Record, pool: Pool, index: int, until: int) -> bool:
    """March a block up to a piece; returns whether it rocks there, else lets it wait for the piece in which it does."""
    state = pool.states[index]
    state.until = until
    state.ending = march(ground, pool.blocks[index], rules, pool.table, scratch, state)
    if state.ending != Ending.RUNNING:
        return False
    if state.side != AT_REST and state.piece == until and state.offset == 0.0:
        return True
    pool.following[index] = pool.first[state.piece]
    pool.first[state.piece] = index
    pool.counts.waiting += 1
    return False


@inlined
def compact(pool: Pool) -> None:
    """Fill the lanes that have become free with the last ones."""
    while pool.counts.free > 0:
        pool.counts.free -= 1
        pool.counts.active -= 1
        lane = pool.free[pool.counts.free]
        if lane != pool.counts.active:
            move_block(pool, pool.counts.active, lane)


@inlined
def admit_waiting(ground: Ground, rules: Record, scratch: Record, pool: Pool, piece: int) -> None:
    """March the blocks that wait for a piece through it, and admit those that rock at its end."""
    index = pool.first[piece]
    while index >= 0:
        following = pool.following[index]
        pool.counts.waiting -= 1
        if march_until(ground, rules, scratch, pool, index, piece + 1):
            admit(rules, pool, pool.counts.active, index)
            pool.counts.active += 1
        index = following
