"""Many sequences at once: lanes that pass through their impacts together.

The arithmetic is that of one sequence (``arc``, ``sequence``); only its order differs. One loop over the lanes makes an
impact pair of every sequence of a group, without a branch, so that the compiler turns it into vector instructions. A
lane for which the short sums or the fixed number of corrections are not exact stops before that pair, and its sequence
is continued alone.

A pool of groups holds sequences that lifted off together. Lanes that have stopped are filled from the pool's end, so
that groups stay full while the pool empties.

A group is a record of arrays: with one base address and constant distances the compiler can prove that stores do not
disturb loads. With one array per quantity it would not vectorise.
"""

import math
from enum import IntEnum
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Floats, Integers
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
    corrected_duration,
    estimated_brief_duration,
    estimated_duration,
    estimated_first_impact,
    is_brief,
    is_precise,
    summed_basis,
    uplift_state,
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

#: Lanes of a group: eight vectors of eight doubles, since the chain of operations of one vector is long.
WIDTH: Final = 64

#: Groups of a pool.
GROUPS: Final = 8


class LaneState(IntEnum):
    """What a lane does; one that stops takes a greater value."""

    RUNNING = 0
    #: The remaining phase has settled, and its proof is due.
    SETTLED = 1
    #: An arc of the next pair is to be computed for itself.
    STOPPED = 2
    #: So is the first arc.
    NO_IMPACT = 3
    EMPTY = 4


_FIELDS: Final = (
    "delta", "eta", "excess", "x", "V", "P", "D", "between_V", "between_P", "between_D", "passed", "reach",
)  # fmt: skip

#: Number of settled lanes; index, state and constants of each sequence; phase and state on entering the second side,
#: and between the two arcs of a pair; phase and reach of the last pair; weights and last row of the extrapolation.
GROUP: Final = np.dtype(
    (
        np.record,
        [
            ("filled", np.int64),
            ("index", np.int64, WIDTH),
            ("status", np.int64, WIDTH),
            *((name, np.float64, WIDTH) for name in _FIELDS),
            ("weights", np.float64, (LEVELS, WIDTH)),
            ("row", np.float64, (LEVELS + 1, WIDTH)),
        ],
    )
)

#: One record of GROUP: NumPy's types do not have its fields.
Group = Any

#: Amplitudes, frequencies and coefficients of restitution.
Sequences = tuple[Floats, Floats, Floats]

#: Reach of a group's longest arc above which the next pair takes two corrections, or more than the fewest terms: arcs
#: become shorter, but those on the second side may first become longer.
_TWICE_CORRECTED: Final = 0.2 * REACH_MEDIUM
_MORE_TERMS: Final = 0.8 * REACH_SHORT

#: In no sequence did the remaining phase settle before its speed had fallen by the factor exp(-4).
_FAR_FROM_REST: Final = 4.0

#: Pairs after which the sequences that still run are continued one by one.
_MAXIMUM_PAIRS: Final = 400


class Answers(NamedTuple):
    """Phases of rest and their verdicts: a phase means something only where its status is FOUND."""

    phases: Floats
    statuses: NDArray[np.int8]


@kernel
def rest_phases(sequences: Sequences, order: Integers, pool: NDArray[np.record], answers: Answers) -> None:
    """Write phases of rest and verdicts of the sequences (a > 1, omega, eta) with the indices ``order`` into answers.

    ``pool`` is scratch space: GROUPS + 1 records of GROUP. All numbers must be finite.
    """
    for start in range(0, order.size, GROUPS * WIDTH):
        some = order[start : start + GROUPS * WIDTH]
        load(sequences, some, pool)
        run(pool, some.size, answers)


@shared
def load(sequences: Sequences, some: Integers, pool: NDArray[np.record]) -> None:
    """Put sequences into lanes and compute their first arcs; the last group is filled with copies that do not run."""
    a, omega, eta = sequences
    for b in range(groups_of(some.size)):
        group = pool[b]
        for lane in range(WIDTH):
            slot = b * WIDTH + lane
            i = some[min(slot, some.size - 1)]
            group.index[lane] = i
            group.status[lane] = LaneState.RUNNING if slot < some.size else LaneState.EMPTY
            group.delta[lane] = 1.0 / (omega[i] * omega[i])
            group.eta[lane] = eta[i]
            group.excess[lane] = a[i] - 1.0
        first_impacts(group)


@shared
def run(pool: NDArray[np.record], count: int, answers: Answers) -> None:
    """Follow every sequence of a pool to rest: in lanes as far as possible, from there one by one."""
    start = first_extrapolated_pair(pool, count)
    for pair in range(_MAXIMUM_PAIRS):
        if pair >= start:
            for b in range(groups_of(count)):
                extrapolate_lanes(pool[b], pair > start + LEVELS)
        running = count_running(pool, count)
        if running < count:
            answer_stopped(pool, count, answers)
            compact(pool, count)
            count = running
        if count == 0:
            break
        for b in range(groups_of(count)):
            pass_impact_pairs(pool[b], pair)
    for slot in range(count):
        answer_alone(pool[slot // WIDTH], slot % WIDTH, answers)
    answer_settled(pool[GROUPS], answers)


@inlined
def pass_impact_pairs(group: Group, pair: int) -> None:
    """One pair of impacts of every lane, by the shortest sums that are exact for the longest arc."""
    reach = longest_reach(group)
    if pair == 0 or reach > _TWICE_CORRECTED:
        pairs_of_long_arcs(group)
    elif reach > _MORE_TERMS:
        pairs_of_medium_arcs(group)
    elif reach > REACH_BRIEF:
        pairs_of_short_arcs(group)
    else:
        pairs_of_brief_arcs(group)


@inlined
def count_running(pool: NDArray[np.record], count: int) -> int:
    """Count the lanes that still run."""
    running = 0
    for b in range(groups_of(count)):
        for lane in range(WIDTH):
            running += pool[b].status[lane] == LaneState.RUNNING
    return running


@shared
def answer_stopped(pool: NDArray[np.record], count: int, answers: Answers) -> None:
    """Answer for the lanes that have stopped; settled ones are collected until they fill a group, and then proven."""
    settled = pool[GROUPS]
    for slot in range(count):
        group, lane = pool[slot // WIDTH], slot % WIDTH
        if group.status[lane] == LaneState.RUNNING:
            continue
        if group.status[lane] == LaneState.SETTLED:
            copy_lane(group, lane, settled, settled.filled)
            settled.filled += 1
            if settled.filled == WIDTH:
                answer_settled(settled, answers)
        else:
            answer_alone(group, lane, answers)
        group.status[lane] = LaneState.EMPTY


@shared
def compact(pool: NDArray[np.record], count: int) -> None:
    """Move running lanes from the pool's end to where others have stopped."""
    for slot in range(count - 1, -1, -1):
        if pool[slot // WIDTH].status[slot % WIDTH] == LaneState.EMPTY:
            count -= 1
            if slot < count:
                move_lane(pool, count, slot)


@inlined
def groups_of(count: int) -> int:
    """Count the groups that hold so many sequences."""
    return (count + WIDTH - 1) // WIDTH


@inlined
def copy_lane(one: Group, i: int, other: Group, j: int) -> None:
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
def move_lane(pool: NDArray[np.record], source: int, target: int) -> None:
    """Move one sequence to another slot of the pool; the old one becomes empty."""
    one, other = pool[source // WIDTH], pool[target // WIDTH]
    i, j = source % WIDTH, target % WIDTH
    copy_lane(one, i, other, j)
    other.status[j] = one.status[i]
    other.excess[j] = one.excess[i]
    other.passed[j] = one.passed[i]
    other.reach[j] = one.reach[i]
    for k in range(LEVELS):
        other.weights[k, j] = one.weights[k, i]
    one.status[i] = LaneState.EMPTY


@shared
def first_extrapolated_pair(pool: NDArray[np.record], count: int) -> int:
    """Pair from which extrapolation is tried: before, even the sequence of the least eta is too far from rest."""
    smallest = 1.0
    for b in range(groups_of(count)):
        for lane in range(WIDTH):
            smallest = min(smallest, pool[b].eta[lane])
    return max(0, int(-_FAR_FROM_REST / (2.0 * math.log(smallest))) - LEVELS)


@inlined
def longest_reach(group: Group) -> float:
    """Reach of the longest arc of a group's last pair."""
    reach = 0.0
    for lane in range(WIDTH):
        reach = max(reach, group.reach[lane])
    return reach


@shared
def first_impacts(group: Group) -> None:
    """First arc of every lane."""
    for lane in range(WIDTH):
        delta = group.delta[lane]
        eta = group.eta[lane]
        start = uplift_state(min(group.excess[lane], LARGEST_EXCESS))
        t = estimated_first_impact(-start.D, delta)
        t = corrected_duration(t, start, 1.0, delta, summed_basis(t * t, delta, LONG)).t
        correction = corrected_duration(t, start, 1.0, delta, summed_basis(t * t, delta, LONGEST))
        found = (
            is_precise(correction, t, delta)
            & (t > 0.0)
            & (correction.t < math.pi)
            & (t * t * (1.0 + delta) <= REACH_LONGEST)
            & (group.excess[lane] <= LARGEST_EXCESS)
        )
        group.status[lane] = group.status[lane] if found else LaneState.NO_IMPACT.value
        group.x[lane] = correction.t
        group.V[lane] = eta * correction.impact.V
        group.P[lane] = correction.impact.P
        group.D[lane] = correction.impact.D
        group.passed[lane] = 0.0
        group.reach[lane] = REACH_LONG
        weights = richardson_weights(eta)
        for k in range(LEVELS):
            group.weights[k, lane] = weights[k]
        for k in range(LEVELS + 1):
            group.row[k, lane] = 0.0


@shared
def pairs_of_long_arcs(group: Group) -> None:
    """One pair of impacts of every lane, for the long arcs at the start."""
    pass_pair(group, LONG, REACH_LONG, 2)


@shared
def pairs_of_medium_arcs(group: Group) -> None:
    """One pair of impacts of every lane, for medium arcs."""
    pass_pair(group, MEDIUM, REACH_MEDIUM, 1)


@shared
def pairs_of_short_arcs(group: Group) -> None:
    """One pair of impacts of every lane, for short arcs."""
    pass_pair(group, SHORT, REACH_SHORT, 1)


@shared
def pairs_of_brief_arcs(group: Group) -> None:
    """One pair of impacts of every lane, for brief arcs."""
    pass_pair(group, BRIEF, REACH_BRIEF, 0)


@inlined
def pass_pair(group: Group, order: int, reach: float, corrections: int) -> None:
    """One arc on the second side and one on the first, of every running lane; a lane where they are not exact stops.

    Two loops, because the chain of operations of one arc is long: short loop bodies let several vectors overlap.
    """
    for lane in range(WIDTH):
        delta = group.delta[lane]
        entered = State(group.V[lane], group.P[lane], group.D[lane])
        exact, second, impact = short_arc(entered, -1.0, delta, order, reach, corrections)
        group.passed[lane] = second
        group.between_V[lane] = group.eta[lane] * impact.V
        group.between_P[lane] = impact.P
        group.between_D[lane] = impact.D
        status = group.status[lane]
        group.status[lane] = status if exact else max(status, LaneState.STOPPED.value)
    for lane in range(WIDTH):
        delta = group.delta[lane]
        between = State(group.between_V[lane], group.between_P[lane], group.between_D[lane])
        exact, first, impact = short_arc(between, 1.0, delta, order, reach, corrections)
        x = group.x[lane]
        second = group.passed[lane]
        passed = second + first
        longer = first if first > second else second
        exact &= x + passed < math.pi
        status = group.status[lane]
        moves = exact & (status == LaneState.RUNNING)
        group.x[lane] = x + passed if moves else x
        group.V[lane] = group.eta[lane] * impact.V if moves else group.V[lane]
        group.P[lane] = impact.P if moves else group.P[lane]
        group.D[lane] = impact.D if moves else group.D[lane]
        group.passed[lane] = passed
        least = 0.0 if is_brief(entered_by(group, lane), delta) else REACH_BRIEF
        group.reach[lane] = max(longer * longer * (1.0 + delta), least) if moves else 0.0
        group.status[lane] = status if exact else max(status, LaneState.STOPPED.value)


@inlined
def short_arc(
    start: State, s: float, delta: float, order: int, reach: float, corrections: int
) -> tuple[bool, float, State]:
    """Follow an arc by a fixed number of corrections: whether they are enough, its duration, the state at its end."""
    t = estimated_duration(start, s, delta) if corrections else estimated_brief_duration(start, s, delta)
    for _ in range(corrections - 1):
        t = corrected_duration(t, start, s, delta, summed_basis(t * t, delta, SHORT)).t
    correction = corrected_duration(t, start, s, delta, summed_basis(t * t, delta, order))
    exact = is_precise(correction, t, delta) & (t * t * (1.0 + delta) <= reach)
    return exact, correction.t, correction.impact


@shared
def extrapolate_lanes(group: Group, ready: bool) -> None:
    """Extrapolate the remaining phase of every running lane; where ``ready``, those where it has settled stop."""
    for lane in range(WIDTH):
        status = group.status[lane]
        runs = status == LaneState.RUNNING
        T = remaining_phase(entered_by(group, lane), group.delta[lane], group.eta[lane])
        weights = (
            group.weights[0, lane], group.weights[1, lane], group.weights[2, lane], group.weights[3, lane],
            group.weights[4, lane],
        )  # fmt: skip
        last = (
            group.row[0, lane], group.row[1, lane], group.row[2, lane], group.row[3, lane], group.row[4, lane],
            group.row[5, lane],
        )  # fmt: skip
        passed = group.passed[lane]
        row = extrapolate(T, passed, weights, last)
        for k in range(LEVELS + 1):
            group.row[k, lane] = row[k] if runs else last[k]
        agrees = ready & runs & agree(row, last, passed, group.x[lane])
        group.status[lane] = LaneState.SETTLED.value if agrees else status


@inlined
def entered_by(group: Group, lane: int) -> State:
    """State on entering the second side."""
    return State(group.V[lane], group.P[lane], group.D[lane])


@shared
def answer_settled(settled: Group, answers: Answers) -> None:
    """Answer for settled sequences: as extrapolated where complete chattering is proven; the others one by one."""
    prove_settled(settled, settled.filled)
    for lane in range(settled.filled):
        if settled.status[lane] == LaneState.SETTLED:
            i = settled.index[lane]
            answers.statuses[i] = Verdict.FOUND
            answers.phases[i] = settled.x[lane] + settled.row[LEVELS, lane]
        else:
            answer_alone(settled, lane, answers)
    settled.filled = 0


@shared
def prove_settled(settled: Group, count: int) -> None:
    """Prove complete chattering of the first lanes; where there is no proof the lane is STOPPED."""
    for lane in range(count):
        delta, eta, remaining = settled.delta[lane], settled.eta[lane], settled.row[LEVELS, lane]
        holds = proven(settled.x[lane], entered_by(settled, lane), delta, eta, remaining)
        settled.status[lane] = LaneState.SETTLED if holds else LaneState.STOPPED


@shared
def answer_alone(group: Group, lane: int, answers: Answers) -> None:
    """Continue one sequence from where its lane has stopped, and answer for it."""
    i, delta, eta = group.index[lane], group.delta[lane], group.eta[lane]
    if group.status[lane] == LaneState.NO_IMPACT:
        status, phase = rest_phase(group.excess[lane], delta, eta)
    else:
        status, phase = rest_after_impact(group.x[lane], entered_by(group, lane), delta, eta)
    answers.statuses[i] = status
    answers.phases[i] = phase
