"""Many sequences at once: lanes that pass through their impacts together.

The arithmetic is that of one sequence (``arc``, ``closure``, ``sequence``); only its order differs. One loop over the
lanes makes an impact pair of every sequence of a block, without a branch, so that the compiler turns it into vector
instructions. A lane that the short sums or the plain corrections do not serve stops where it is, and the scalar path
goes on from there.

A pool of blocks holds sequences that lifted off together. Lanes that have stopped are filled from the pool's
end, so that blocks stay full while the pool empties.

A block is a record of arrays: with one base address and constant distances the compiler can prove that stores do not
disturb loads. With one array per quantity it would not vectorise.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.sine import Verdict
from rocking.kernels.sine.arc import (
    BRIEF,
    LARGEST_EXCESS,
    LONG,
    LONGEST,
    MEDIUM,
    REACH_BRIEF,
    REACH_LONG,
    REACH_LONGEST,
    REACH_MEDIUM,
    REACH_SHORT,
    SHORT,
    State,
    brief,
    guess_brief,
    guess_first_impact,
    guess_landing,
    land,
    precise,
    summed_basis,
    uplift,
)
from rocking.kernels.sine.sequence import (
    LEVELS,
    agree,
    extrapolate,
    proven,
    remaining_phase,
    rest_after_impact,
    rest_phase,
    richardson_weights,
)

#: Sequences in a block: eight vectors of eight doubles, since the chain of operations of one vector is long.
LANES: Final = 64

#: Blocks in a pool.
BLOCKS: Final = 8

_LANE: Final = (np.float64, LANES)

#: Constants of each sequence, its state on entering the second side and between, extrapolation, bookkeeping.
BLOCK: Final = np.dtype(
    (
        np.record,
        [
            ("filled", np.int64),
            ("index", np.int64, LANES),
            ("status", np.int64, LANES),
            ("delta", *_LANE),
            ("eta", *_LANE),
            ("excess", *_LANE),
            ("x", *_LANE),
            ("V", *_LANE),
            ("P", *_LANE),
            ("D", *_LANE),
            ("between_V", *_LANE),
            ("between_P", *_LANE),
            ("between_D", *_LANE),
            ("gone", *_LANE),
            ("reach", *_LANE),
            ("weights", np.float64, (LEVELS, LANES)),
            ("row", np.float64, (LEVELS + 1, LANES)),
        ],
    )
)

#: One record of BLOCK: NumPy's types know nothing of its fields.
Block = Any

#: Amplitudes, frequencies and coefficients of restitution.
Sequences = tuple[Floats, Floats, Floats]

_RUNNING: Final = 0
_CLOSING: Final = 1
_LEFT_OVER: Final = 2
_NOT_LANDED: Final = 3
_IDLE: Final = 4

#: Reach of a block's longest arc above which the next pair takes two corrections, or more than the fewest terms; arcs
#: become shorter, but that on the second side may first grow.
_TWICE_CORRECTED: Final = 0.2 * REACH_MEDIUM
_MORE_TERMS: Final = 0.8 * REACH_SHORT

#: No sequence's remaining phase has been seen to rest_after_impact before its speed falls by the factor exp(-4).
_FAR_FROM_REST: Final = 4.0

#: Pairs after which the lanes that still run are left to the scalar path.
_MAXIMUM_PAIRS: Final = 400


class Answers(NamedTuple):
    """Where the answers go: a phase means nothing unless its status is FOUND."""

    phases: Floats
    statuses: NDArray[np.int8]


@kernel
def rest_phases(sequences: Sequences, order: Integers, pool: NDArray[np.record], answers: Answers) -> None:
    """Phases of rest of the sequences (a > 1, omega, eta) that ``order`` picks.

    ``pool`` is scratch space: BLOCKS + 1 records of BLOCK.
    """
    for start in range(0, order.size, BLOCKS * LANES):
        some = order[start : start + BLOCKS * LANES]
        load(sequences, some, pool)
        run(pool, some.size, answers)


@shared
def load(sequences: Sequences, some: Integers, pool: NDArray[np.record]) -> None:
    """Lift some sequences off, and fill the last block up with copies that do not run."""
    a, omega, eta = sequences
    for b in range(blocks_of(some.size)):
        block = pool[b]
        for lane in range(LANES):
            slot = b * LANES + lane
            i = some[min(slot, some.size - 1)]
            block.index[lane] = i
            block.status[lane] = _RUNNING if slot < some.size else _IDLE
            block.delta[lane] = 1.0 / (omega[i] * omega[i])
            block.eta[lane] = eta[i]
            block.excess[lane] = a[i] - 1.0
        first_impacts(block)


@shared
def run(pool: NDArray[np.record], count: int, answers: Answers) -> None:
    """Take every sequence of a pool to rest, or as far as the lanes can and from there by the scalar path."""
    start = first_closure(pool, count)
    for pair in range(_MAXIMUM_PAIRS):
        if pair >= start:
            for b in range(blocks_of(count)):
                close(pool[b], pair > start + LEVELS)
        running = count_running(pool, count)
        if running < count:
            take_out(pool, count, answers)
            fill_up(pool, count)
            count = running
        if count == 0:
            break
        for b in range(blocks_of(count)):
            go_on(pool[b], pair)
    for slot in range(count):
        answer_alone(pool[slot // LANES], slot % LANES, answers)
    answer_closing(pool[BLOCKS], answers)


@inlined
def go_on(block: Block, pair: int) -> None:
    """One pair of impacts of every lane, by the least arithmetic that serves its longest arc."""
    reach = longest_reach(block)
    if pair == 0 or reach > _TWICE_CORRECTED:
        early_pairs(block)
    elif reach > _MORE_TERMS:
        pairs(block)
    elif reach > REACH_BRIEF:
        late_pairs(block)
    else:
        last_pairs(block)


@inlined
def count_running(pool: NDArray[np.record], count: int) -> int:
    """Count the lanes that still run."""
    running = 0
    for b in range(blocks_of(count)):
        for lane in range(LANES):
            running += pool[b].status[lane] == _RUNNING
    return running


@shared
def take_out(pool: NDArray[np.record], count: int, answers: Answers) -> None:
    """Answer for the lanes that have stopped; those that are settled wait until a block of them can be proven."""
    closing = pool[BLOCKS]
    for slot in range(count):
        block = pool[slot // LANES]
        lane = slot % LANES
        if block.status[lane] == _RUNNING:
            continue
        if block.status[lane] == _CLOSING:
            put(block, lane, closing, closing.filled)
            closing.filled += 1
            if closing.filled == LANES:
                answer_closing(closing, answers)
        else:
            answer_alone(block, lane, answers)
        block.status[lane] = _IDLE


@shared
def fill_up(pool: NDArray[np.record], count: int) -> None:
    """Move lanes that run from the pool's end to where others have stopped."""
    for slot in range(count - 1, -1, -1):
        if pool[slot // LANES].status[slot % LANES] == _IDLE:
            count -= 1
            if slot < count:
                move(pool, count, slot)


@inlined
def blocks_of(count: int) -> int:
    """Return the number of blocks that hold so many sequences."""
    return (count + LANES - 1) // LANES


@inlined
def put(one: Block, i: int, other: Block, j: int) -> None:
    """Copy the state and the extrapolation of one lane into another."""
    other.index[j] = one.index[i]
    other.delta[j] = one.delta[i]
    other.eta[j] = one.eta[i]
    other.x[j] = one.x[i]
    other.V[j] = one.V[i]
    other.P[j] = one.P[i]
    other.D[j] = one.D[i]
    for k in range(LEVELS + 1):
        other.row[k, j] = one.row[k, i]


@shared
def move(pool: NDArray[np.record], source: int, target: int) -> None:
    """Move one sequence to another slot of the pool; its old one stands still."""
    one = pool[source // LANES]
    other = pool[target // LANES]
    i = source % LANES
    j = target % LANES
    put(one, i, other, j)
    other.status[j] = one.status[i]
    other.excess[j] = one.excess[i]
    other.gone[j] = one.gone[i]
    other.reach[j] = one.reach[i]
    for k in range(LEVELS):
        other.weights[k, j] = one.weights[k, i]
    one.status[i] = _IDLE


@shared
def first_closure(pool: NDArray[np.record], count: int) -> int:
    """Pair from which closing is tried: earlier, even the fastest sequence of the pool is too far from rest."""
    smallest = 1.0
    for b in range(blocks_of(count)):
        for lane in range(LANES):
            smallest = min(smallest, pool[b].eta[lane])
    return max(0, int(-_FAR_FROM_REST / (2.0 * math.log(smallest))) - LEVELS)


@inlined
def longest_reach(block: Block) -> float:
    """Reach of the longest arc of a block's last pair."""
    reach = 0.0
    for lane in range(LANES):
        reach = max(reach, block.reach[lane])
    return reach


@shared
def first_impacts(block: Block) -> None:
    """First arc of every lane."""
    for lane in range(LANES):
        delta = block.delta[lane]
        eta = block.eta[lane]
        start = uplift(min(block.excess[lane], LARGEST_EXCESS))
        t = guess_first_impact(-start.D, delta)
        t = land(t, start, 1.0, delta, summed_basis(t * t, delta, LONG)).t
        landing = land(t, start, 1.0, delta, summed_basis(t * t, delta, LONGEST))
        landed = (
            precise(landing, t, delta)
            & (t > 0.0)
            & (landing.t < math.pi)
            & (t * t * (1.0 + delta) <= REACH_LONGEST)
            & (block.excess[lane] <= LARGEST_EXCESS)
        )
        block.status[lane] = block.status[lane] if landed else _NOT_LANDED
        block.x[lane] = landing.t
        block.V[lane] = eta * landing.impact.V
        block.P[lane] = landing.impact.P
        block.D[lane] = landing.impact.D
        block.gone[lane] = 0.0
        block.reach[lane] = REACH_LONG
        weights = richardson_weights(eta)
        for k in range(LEVELS):
            block.weights[k, lane] = weights[k]
        for k in range(LEVELS + 1):
            block.row[k, lane] = 0.0


@shared
def early_pairs(block: Block) -> None:
    """One pair of impacts of every lane, for the long arcs at the start."""
    pass_pair(block, LONG, REACH_LONG, 2)


@shared
def pairs(block: Block) -> None:
    """One pair of impacts of every lane, for medium arcs."""
    pass_pair(block, MEDIUM, REACH_MEDIUM, 1)


@shared
def late_pairs(block: Block) -> None:
    """One pair of impacts of every lane, for short arcs."""
    pass_pair(block, SHORT, REACH_SHORT, 1)


@shared
def last_pairs(block: Block) -> None:
    """One pair of impacts of every lane, for brief arcs."""
    pass_pair(block, BRIEF, REACH_BRIEF, 0)


@inlined
def pass_pair(block: Block, order: int, reach: float, corrections: int) -> None:
    """One arc on the second side and one on the first, of every running lane; a lane where it fails stays behind.

    Two loops, because the chain of operations of one arc is long: short loop bodies let several vectors overlap.
    """
    for lane in range(LANES):
        delta = block.delta[lane]
        entered = State(block.V[lane], block.P[lane], block.D[lane])
        sound, second, impact = short_arc(entered, -1.0, delta, order, reach, corrections)
        block.gone[lane] = second
        block.between_V[lane] = block.eta[lane] * impact.V
        block.between_P[lane] = impact.P
        block.between_D[lane] = impact.D
        status = block.status[lane]
        block.status[lane] = status if sound else max(status, _LEFT_OVER)
    for lane in range(LANES):
        delta = block.delta[lane]
        between = State(block.between_V[lane], block.between_P[lane], block.between_D[lane])
        sound, first, impact = short_arc(between, 1.0, delta, order, reach, corrections)
        x = block.x[lane]
        second = block.gone[lane]
        gone = second + first
        longer = first if first > second else second
        sound &= x + gone < math.pi
        status = block.status[lane]
        moves = sound & (status == _RUNNING)
        block.x[lane] = x + gone if moves else x
        block.V[lane] = block.eta[lane] * impact.V if moves else block.V[lane]
        block.P[lane] = impact.P if moves else block.P[lane]
        block.D[lane] = impact.D if moves else block.D[lane]
        block.gone[lane] = gone
        least = 0.0 if brief(entered_by(block, lane), delta) else REACH_BRIEF
        block.reach[lane] = max(longer * longer * (1.0 + delta), least) if moves else 0.0
        block.status[lane] = status if sound else max(status, _LEFT_OVER)


@inlined
def short_arc(
    start: State, s: float, delta: float, order: int, reach: float, corrections: int
) -> tuple[bool, float, State]:
    """Pass an arc with a fixed number of corrections, and tell whether these were enough."""
    t = guess_landing(start, s, delta) if corrections else guess_brief(start, s, delta)
    for _ in range(corrections - 1):
        t = land(t, start, s, delta, summed_basis(t * t, delta, SHORT)).t
    landing = land(t, start, s, delta, summed_basis(t * t, delta, order))
    sound = precise(landing, t, delta) & (t * t * (1.0 + delta) <= reach)
    return sound, landing.t, landing.impact


@shared
def close(block: Block, ready: bool) -> None:
    """Extrapolate every running lane, and stop those whose remaining phase is settled."""
    for lane in range(LANES):
        status = block.status[lane]
        runs = status == _RUNNING
        T = remaining_phase(entered_by(block, lane), block.delta[lane], block.eta[lane])
        weights = (
            block.weights[0, lane],
            block.weights[1, lane],
            block.weights[2, lane],
            block.weights[3, lane],
            block.weights[4, lane],
        )
        last = (
            block.row[0, lane],
            block.row[1, lane],
            block.row[2, lane],
            block.row[3, lane],
            block.row[4, lane],
            block.row[5, lane],
        )
        gone = block.gone[lane]
        row = extrapolate(T, gone, weights, last)
        for k in range(LEVELS + 1):
            block.row[k, lane] = row[k] if runs else last[k]
        closed = ready & runs & agree(row, last, gone, block.x[lane])
        block.status[lane] = _CLOSING if closed else status


@inlined
def entered_by(block: Block, lane: int) -> State:
    """State on entering the second side."""
    return State(block.V[lane], block.P[lane], block.D[lane])


@shared
def answer_closing(closing: Block, answers: Answers) -> None:
    """Answer for settled sequences: as extrapolated if complete chattering is proven, else by the scalar path."""
    prove(closing, closing.filled)
    for lane in range(closing.filled):
        i = closing.index[lane]
        if closing.status[lane] == Verdict.FOUND:
            answers.statuses[i] = Verdict.FOUND
            answers.phases[i] = closing.x[lane] + closing.row[LEVELS, lane]
        else:
            entered = entered_by(closing, lane)
            status, phase = rest_after_impact(closing.x[lane], entered, closing.delta[lane], closing.eta[lane])
            answers.statuses[i] = status
            answers.phases[i] = phase
    closing.filled = 0


@shared
def prove(closing: Block, count: int) -> None:
    """Certificate of the first lanes: FOUND or UNRESOLVED."""
    for lane in range(count):
        holds = proven(
            closing.x[lane],
            entered_by(closing, lane),
            closing.delta[lane],
            closing.eta[lane],
            closing.row[LEVELS, lane],
        )
        closing.status[lane] = Verdict.FOUND if holds else Verdict.UNRESOLVED


@shared
def answer_alone(block: Block, lane: int, answers: Answers) -> None:
    """Answer for one lane by the scalar path, from where the lanes could not go on."""
    i = block.index[lane]
    delta = block.delta[lane]
    eta = block.eta[lane]
    if block.status[lane] == _NOT_LANDED:
        status, phase = rest_phase(block.excess[lane], delta, eta)
    else:
        status, phase = rest_after_impact(block.x[lane], entered_by(block, lane), delta, eta)
    answers.statuses[i] = status
    answers.phases[i] = phase
