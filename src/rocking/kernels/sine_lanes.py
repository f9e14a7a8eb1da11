"""Many chattering sequences at once: blocks of lanes that pass through their impacts together.

The arithmetic is that of ``sine``; only its order differs. One loop over the lanes makes an impact pair of every
sequence of a block, without a branch, so that the compiler turns it into vector instructions. A lane that the short
sums or the plain corrections do not serve stops where it is, and the scalar path goes on from there.

All of a block's numbers lie in one flat array, quantity after quantity. With one base address and constant
distances the compiler can prove that stores do not disturb loads; with one array per quantity it would not vectorise.
"""

import math
from typing import Final

import numba
import numpy as np
from numpy.typing import NDArray

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.sine import (
    LARGEST_CORRECTION,
    LARGEST_EXCESS,
    LEVELS,
    LONG,
    LONGEST,
    MEDIUM,
    REACH_LONG,
    REACH_LONGEST,
    REACH_MEDIUM,
    REACH_SHORT,
    SHORT,
    agree,
    basis,
    closure,
    extrapolate,
    guess_first_impact,
    guess_landing,
    land,
    proven,
    rest_phase,
    settle,
)

#: Sequences in a block: two vectors of eight doubles.
LANES: Final = 16

# Rows of a block's array: constants of the sequence, state on entering the second side, extrapolation, bookkeeping.
_KAPPA: Final = 0
_DELTA: Final = 1
_ETA: Final = 2
_X: Final = 3
_V: Final = 4
_P: Final = 5
_D: Final = 6
_GONE: Final = 7
_REACH: Final = 8
_STATUS: Final = 9
_BETWEEN_V: Final = 10
_BETWEEN_P: Final = 11
_BETWEEN_D: Final = 12
_TABLE: Final = 13

#: Size of a block's array.
BLOCK: Final = (_TABLE + LEVELS + 1) * LANES

_RUNNING: Final = 0.0
_CLOSING: Final = 1.0
_LEFT_OVER: Final = 2.0
_NEVER_UP: Final = 3.0

#: Reach of a block's longest arc above which the next pair takes two corrections, or more than the fewest terms; arcs
#: become shorter, but that on the second side may first grow.
_TWICE_CORRECTED: Final = 0.2 * REACH_MEDIUM
_MORE_TERMS: Final = 0.8 * REACH_SHORT

#: No sequence's remaining phase has been seen to settle before its speed falls by the factor exp(-4).
_FAR_FROM_REST: Final = 4.0

#: Pairs after which the lanes that still run are left to the scalar path.
_MAXIMUM_PAIRS: Final = 400

#: As ``compiled.kernel``, and free of the interpreter's lock, so that threads can share an array's sequences.
_unlocked = numba.njit(cache=True, error_model="numpy", nogil=True, _nrt=False)


@_unlocked
def rest_times(
    a: NDArray[np.float64],
    omega: NDArray[np.float64],
    eta: NDArray[np.float64],
    order: NDArray[np.int64],
    block: NDArray[np.float64],
    times: NDArray[np.float64],
) -> None:
    """Chattering times of the sequences ``order`` picks; NaN: incomplete, infinity: unresolved.

    ``block`` is scratch space of BLOCK doubles.
    """
    last = order.size - 1
    for start in range(0, order.size, LANES):
        for lane in range(LANES):
            i = order[min(start + lane, last)]
            load(block, lane, a[i] - 1.0, omega[i], eta[i])
        advance(block)
        for lane in range(min(LANES, order.size - start)):
            i = order[start + lane]
            times[i] = finish(block, lane, a[i] - 1.0) / omega[i]


@inlined
def load(block: NDArray[np.float64], lane: int, excess: float, omega: float, eta: float) -> None:
    """Write one sequence into a lane; one that has nothing to compute gets harmless numbers."""
    rocks = 0.0 < excess <= LARGEST_EXCESS
    used = excess if rocks else 0.01
    block[_KAPPA * LANES + lane] = math.sqrt(used * (2.0 + used))
    block[_DELTA * LANES + lane] = 1.0 / (omega * omega)
    block[_ETA * LANES + lane] = eta
    block[_STATUS * LANES + lane] = _RUNNING if rocks else _NEVER_UP


@shared
def advance(block: NDArray[np.float64]) -> None:
    """Take every lane to where its remaining phase is known, or as far as the lanes can."""
    first_impacts(block)
    start = first_closure(block)
    for pair in range(_MAXIMUM_PAIRS):
        if pair >= start:
            close(block, pair > start + LEVELS)
        running, reach = survey(block)
        if running == 0:
            return
        if pair == 0 or reach > _TWICE_CORRECTED:
            early_pairs(block)
        elif reach > _MORE_TERMS:
            pairs(block)
        else:
            late_pairs(block)


@shared
def first_closure(block: NDArray[np.float64]) -> int:
    """Pair from which closing is tried: earlier, even the fastest lane of the block is too far from rest."""
    smallest = 1.0
    for lane in range(LANES):
        smallest = min(smallest, block[_ETA * LANES + lane])
    return max(0, int(-_FAR_FROM_REST / (2.0 * math.log(smallest))) - LEVELS)


@inlined
def survey(block: NDArray[np.float64]) -> tuple[int, float]:
    """Count the lanes that still run, and find the reach of their longest arc."""
    running = 0
    reach = 0.0
    for lane in range(LANES):
        if block[_STATUS * LANES + lane] == _RUNNING:
            running += 1
            reach = max(reach, block[_REACH * LANES + lane])
    return running, reach


@shared
def first_impacts(block: NDArray[np.float64]) -> None:
    """First arc of every lane."""
    for lane in range(LANES):
        kappa = block[_KAPPA * LANES + lane]
        delta = block[_DELTA * LANES + lane]
        x = guess_first_impact(kappa, delta)
        x, _, _, _, _ = land(x, 0.0, 0.0, -kappa, 1.0, delta, basis(x * x, delta, LONGEST))
        before = x
        x, w, P, D, change = land(x, 0.0, 0.0, -kappa, 1.0, delta, basis(x * x, delta, LONGEST))
        landed = (
            (change <= LARGEST_CORRECTION * before) & (x < math.pi) & (before * before * (1.0 + delta) <= REACH_LONGEST)
        )
        status = block[_STATUS * LANES + lane]
        block[_STATUS * LANES + lane] = status if landed else max(status, _LEFT_OVER)
        block[_X * LANES + lane] = x if landed else 0.0
        block[_V * LANES + lane] = block[_ETA * LANES + lane] * w
        block[_P * LANES + lane] = P
        block[_D * LANES + lane] = D
        block[_GONE * LANES + lane] = 0.0
        block[_REACH * LANES + lane] = REACH_LONG
    for k in range(_TABLE * LANES, BLOCK):
        block[k] = 0.0


@shared
def early_pairs(block: NDArray[np.float64]) -> None:
    """One pair of impacts of every lane, for the long arcs at the start."""
    pass_pair(block, LONG, REACH_LONG, 2)


@shared
def pairs(block: NDArray[np.float64]) -> None:
    """One pair of impacts of every lane, for medium arcs."""
    pass_pair(block, MEDIUM, REACH_MEDIUM, 1)


@shared
def late_pairs(block: NDArray[np.float64]) -> None:
    """One pair of impacts of every lane, for short arcs."""
    pass_pair(block, SHORT, REACH_SHORT, 1)


@inlined
def pass_pair(block: NDArray[np.float64], order: int, reach: float, corrections: int) -> None:
    """One arc on the second side and one on the first, of every running lane; a lane where it fails stays behind.

    Two loops, because the chain of operations of one arc is long: short loop bodies let several vectors overlap.
    """
    for lane in range(LANES):
        V = block[_V * LANES + lane]
        P = block[_P * LANES + lane]
        D = block[_D * LANES + lane]
        delta = block[_DELTA * LANES + lane]
        second, w, P, D, sound = short_arc(V, P, D, -1.0, delta, order, reach, corrections)
        block[_GONE * LANES + lane] = second
        block[_BETWEEN_V * LANES + lane] = block[_ETA * LANES + lane] * w
        block[_BETWEEN_P * LANES + lane] = P
        block[_BETWEEN_D * LANES + lane] = D
        status = block[_STATUS * LANES + lane]
        block[_STATUS * LANES + lane] = status if sound else max(status, _LEFT_OVER)
    for lane in range(LANES):
        V = block[_BETWEEN_V * LANES + lane]
        P = block[_BETWEEN_P * LANES + lane]
        D = block[_BETWEEN_D * LANES + lane]
        delta = block[_DELTA * LANES + lane]
        first, w, P, D, sound = short_arc(V, P, D, 1.0, delta, order, reach, corrections)
        x = block[_X * LANES + lane]
        second = block[_GONE * LANES + lane]
        gone = second + first
        longer = first if first > second else second
        sound &= x + gone < math.pi
        status = block[_STATUS * LANES + lane]
        moves = sound & (status == _RUNNING)
        block[_X * LANES + lane] = x + gone if moves else x
        block[_V * LANES + lane] = block[_ETA * LANES + lane] * w if moves else block[_V * LANES + lane]
        block[_P * LANES + lane] = P if moves else block[_P * LANES + lane]
        block[_D * LANES + lane] = D if moves else block[_D * LANES + lane]
        block[_GONE * LANES + lane] = gone
        block[_REACH * LANES + lane] = longer * longer * (1.0 + delta) if moves else 0.0
        block[_STATUS * LANES + lane] = status if sound else max(status, _LEFT_OVER)


@inlined
def short_arc(
    V: float, P: float, D: float, s: float, delta: float, order: int, reach: float, corrections: int
) -> tuple[float, float, float, float, bool]:
    """Pass an arc with a fixed number of corrections, and tell whether these were enough."""
    t = guess_landing(V, P, D, s, delta)
    for _ in range(corrections - 1):
        t, _, _, _, _ = land(t, V, P, D, s, delta, basis(t * t, delta, order))
    landed, w, P_impact, D_impact, change = land(t, V, P, D, s, delta, basis(t * t, delta, order))
    sound = (change <= LARGEST_CORRECTION * t) & (t * t * (1.0 + delta) <= reach)
    return landed, w, P_impact, D_impact, sound


@shared
def close(block: NDArray[np.float64], ready: bool) -> None:
    """Extrapolate every running lane, and stop those whose remaining phase is settled."""
    for lane in range(LANES):
        eta = block[_ETA * LANES + lane]
        status = block[_STATUS * LANES + lane]
        runs = status == _RUNNING
        T = closure(block[_V * LANES + lane], block[_P * LANES + lane], block[_D * LANES + lane], eta)
        old = (
            block[_TABLE * LANES + lane],
            block[(_TABLE + 1) * LANES + lane],
            block[(_TABLE + 2) * LANES + lane],
            block[(_TABLE + 3) * LANES + lane],
            block[(_TABLE + 4) * LANES + lane],
            block[(_TABLE + 5) * LANES + lane],
        )
        new = extrapolate(T, block[_GONE * LANES + lane], eta * eta, old)
        for k in range(LEVELS + 1):
            block[(_TABLE + k) * LANES + lane] = new[k] if runs else old[k]
        expected = old[LEVELS] - block[_GONE * LANES + lane]
        settled = agree(new[LEVELS], new[LEVELS - 1], expected, block[_X * LANES + lane])
        closed = ready & runs & settled
        block[_STATUS * LANES + lane] = _CLOSING if closed else status


@shared
def finish(block: NDArray[np.float64], lane: int, excess: float) -> float:
    """Phase of rest of one lane: as found there if complete chattering is proven, else by the scalar path."""
    status = block[_STATUS * LANES + lane]
    x = block[_X * LANES + lane]
    delta = block[_DELTA * LANES + lane]
    eta = block[_ETA * LANES + lane]
    if status == _NEVER_UP:
        return 0.0 if excess == 0.0 else math.nan
    if x == 0.0:
        return rest_phase(excess, delta, eta)
    V = block[_V * LANES + lane]
    P = block[_P * LANES + lane]
    D = block[_D * LANES + lane]
    remaining = block[(_TABLE + LEVELS) * LANES + lane]
    if status == _CLOSING and proven(x, V, P, D, delta, eta, remaining):
        return x + remaining
    return settle(x, V, P, D, delta, eta)
