"""Who steps, who is played exactly, and who waits: the loop over the samples of a record."""

from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.ground import Ground, coefficient, has_vertical, last_piece, length_of, start_of, vertical_of
from rocking.kernels.lanes.crew import WIDTH, Crew, lean, load, relocate, unload, vacate
from rocking.kernels.lanes.linear import step_linear
from rocking.kernels.lanes.nonlinear import step_nonlinear
from rocking.kernels.lanes.weighted import step_weighted
from rocking.kernels.march import march
from rocking.kernels.state import AT_REST, TO_THE_END, Record
from rocking.kernels.status import GOING


@kernel
def run_lanes(ground: Ground, rules: Record, scratch: Record, crew: Crew, substeps: int) -> None:
    """March every block of a crew through a record of even samples, and on to its own end.

    ``ending`` of every state says how it ended (`status`); GOING and PAUSED ones can be taken on one by one.
    ``substeps`` is how many a sample is divided into: 0 in the linear model under a constant weight.
    """
    piece = next_joining(crew, 0)
    while piece < last_piece(ground) and start_of(ground, piece + 1) <= rules.stop:
        step_groups(ground, rules, scratch, crew, piece, substeps)
        close_ranks(crew)
        join(ground, rules, scratch, crew, piece)
        piece += 1
        if crew.tally.active == 0:
            if crew.tally.waiting == 0:
                return
            piece = next_joining(crew, piece)
    for lane in range(crew.tally.active):
        unload(ground, crew, lane, piece)
    for index in range(crew.blocks.shape[0]):
        if crew.states[index].ending == GOING:
            play(ground, rules, scratch, crew, index, TO_THE_END)


@inlined
def next_joining(crew: Crew, piece: int) -> int:
    """First piece from this one on at which a block joins; the motion's end where there is none."""
    while piece < crew.first.shape[0] - 1 and crew.first[piece] < 0:
        piece += 1
    return piece


@inlined
def step_groups(ground: Ground, rules: Record, scratch: Record, crew: Crew, piece: int, substeps: int) -> None:
    """Take all lanes through one sample: together, or exactly where that may hold an event."""
    for first in range(0, crew.tally.active, WIDTH):
        group = crew.groups[first // WIDTH]
        busy = step_group(ground, rules, group, piece, substeps, crew.fallen)
        slot = 0
        while busy > 0:
            if group.event[slot] != 0:
                replay(ground, rules, scratch, crew, piece, first + slot)
                busy -= 1
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
    return step_linear(group, push[0], push[1], h, length - h, fallen)


@inlined
def replay(ground: Ground, rules: Record, scratch: Record, crew: Crew, piece: int, lane: int) -> None:
    """Play a sample exactly for the block of a lane, which keeps it if it rocks on."""
    index = unload(ground, crew, lane, piece)
    if play(ground, rules, scratch, crew, index, piece + 1):
        take(rules, crew, lane, index)
    else:
        vacate(crew, lane)
        crew.holes[crew.tally.holes] = lane
        crew.tally.holes += 1


@inlined
def take(rules: Record, crew: Crew, lane: int, index: int) -> None:
    """Let a lane carry a block."""
    load(crew, lane, index)
    if rules.nonlinear:
        lean(crew, lane, index)


@inlined
def play(ground: Ground, rules: Record, scratch: Record, crew: Crew, index: int, until: int) -> bool:
    """March a block up to a piece; tells whether it rocks there, else puts it down for when it does."""
    state = crew.states[index]
    state.until = until
    state.ending = march(ground, crew.blocks[index], rules, crew.table, scratch, state)
    if state.ending != GOING:
        return False
    if state.side != AT_REST and state.piece == until and state.offset == 0.0:
        return True
    crew.following[index] = crew.first[state.piece]
    crew.first[state.piece] = index
    crew.tally.waiting += 1
    return False


@inlined
def close_ranks(crew: Crew) -> None:
    """Fill the lanes that have become free with the last ones."""
    while crew.tally.holes > 0:
        crew.tally.holes -= 1
        crew.tally.active -= 1
        hole = crew.holes[crew.tally.holes]
        if hole != crew.tally.active:
            relocate(crew, crew.tally.active, hole)


@inlined
def join(ground: Ground, rules: Record, scratch: Record, crew: Crew, piece: int) -> None:
    """Play a piece for the blocks that wait for it, and take in those that rock at its end."""
    index = crew.first[piece]
    while index >= 0:
        following = crew.following[index]
        crew.tally.waiting -= 1
        if play(ground, rules, scratch, crew, index, piece + 1):
            take(rules, crew, crew.tally.active, index)
            crew.tally.active += 1
        index = following


@kernel
def march_each(ground: Ground, rules: Record, scratch: Record, crew: Crew) -> None:
    """March every block of a crew to its end, one after the other."""
    for index in range(crew.blocks.shape[0]):
        play(ground, rules, scratch, crew, index, TO_THE_END)
