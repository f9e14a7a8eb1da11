"""Whether a block comes to rest after an impact, and when: proven, imposed, or because time hardly advances."""

import math
from typing import NamedTuple

import numpy as np

from rocking.kernels.arc import restoring
from rocking.kernels.certificate import Proof, prove_rest
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import Ground, length_of, start_of
from rocking.kernels.state import Record
from rocking.kernels.status import CERTIFIED, INTERVAL, TIME, VELOCITY

ULP = 2.0**-52

#: A proof that failed is tried again once the speed has fallen by this factor.
_SLOWER = 0.6

#: One whose bracket is too wide, once it is expected to be good enough: by a little less, and at least by this factor.
_SOONER = 0.97
_SLOWEST = 0.95


class Rest(NamedTuple):
    """Time to rest, with proven bounds; NaN bounds: not proven; NaN time: the block does not come to rest yet.

    ``stalled``: for no other reason than that time does not advance any more.
    """

    lower: float
    upper: float
    time: float
    stalled: bool


@inlined
def time_of(ground: Ground, state: Record) -> float:
    """Time of a state."""
    return start_of(ground, state.piece) + state.offset


@inlined
def note_impact(state: Record) -> None:
    """Count an impact of a proven sequence; before a proof, see when one is worth trying."""
    if state.run > 0:
        state.run += 1
    elif state.v > state.worth:
        state.worth = max(state.worth, _SLOWER * state.v)


@inlined
def note_proof(ground: Ground, rules: Record, state: Record, proof: Proof) -> None:
    """Remember from when on chattering is proven, and when the next proof is worth trying."""
    if not proof.upper >= 0.0:
        state.worth = _SLOWER * state.v
        return
    if state.run == 0:
        state.run = 1
        state.run_start = time_of(ground, state)
    excess = (proof.upper - proof.lower) / rules.tolerance
    wait = time_to_piece(ground, state, proof.time)
    # The width of a bracket of higher order falls with the fifth power of the speed. It needs a rest within the present
    # piece; that of lower order does not, and is quadratic.
    finer = _SOONER * excess**-0.2 if wait == 0.0 else 1.0 - wait / proof.time
    state.worth = state.v * min(_SLOWEST, max(finer, math.sqrt(1.0 / excess)))


@inlined
def time_to_piece(ground: Ground, state: Record, time: float) -> float:
    """Time from a state to the start of the piece in which it will be some time later."""
    piece = state.piece
    wait = 0.0
    reached = length_of(ground, piece) - state.offset
    while reached < time:
        wait = reached
        piece += 1
        reached += length_of(ground, piece)
    return wait


@shared
def proven_bounds(ground: Ground, block: Record, rules: Record, scratch: Record, state: Record) -> Proof:
    """Proven bounds on the time to rest, with room for the rounding of all times."""
    lower, upper, time, height = prove_rest(ground, block, rules, scratch, state)
    slack = allowance(time_of(ground, state), upper, state)
    return Proof(max(0.0, lower - slack), upper + slack, time, height)


@inlined
def allowance(time: float, upper: float, state: Record) -> float:
    """Room for the rounding of the times, and of the arcs resolved since the first proof."""
    since = time - state.run_start if state.run > 0 else 0.0
    return 4.0 * ULP * time + 8.0 * ULP * (max(state.run, 1) + 4) * (since + upper)


@shared
def rest_after_impact(ground: Ground, block: Record, rules: Record, state: Record, proof: Proof) -> Rest:
    """Decide on rest at an impact, given the bounds that are proven there, if any."""
    time = time_of(ground, state)
    if rules.treatment == CERTIFIED:
        # What is not resolved any more must not be higher than what was.
        good = max(rules.tolerance, 4.0 * allowance(time, proof.upper, state))
        if proof.upper - proof.lower <= good and proof.height <= state.peak:
            return Rest(proof.lower, proof.upper, proof.time, False)
    elif is_imposed(rules, block.limit[state.side], state.v, time - state.struck, time - state.uplifted):
        return Rest(np.nan, np.nan, 0.0, False)
    stalled = has_stalled(ground, block, state)
    return Rest(np.nan, np.nan, 0.0 if stalled or state.v == 0.0 else np.nan, stalled)


@inlined
def is_imposed(rules: Record, limit: float, v: float, interval: float, since_uplift: float) -> bool:
    """Whether a treatment other than the certificate brings the block to rest at this impact."""
    if rules.treatment == VELOCITY:
        return v <= limit
    if rules.treatment == INTERVAL:
        return interval <= limit
    return rules.treatment == TIME and since_uplift >= limit


@inlined
def has_stalled(ground: Ground, block: Record, state: Record) -> bool:
    """Whether time hardly advanced since the last impact, and will not until the next."""
    time = time_of(ground, state)
    fastest = max(abs(block.stiffness[0]), abs(block.stiffness[1]))
    least = ULP * (time + (1.0 / math.sqrt(fastest) if fastest > 0.0 else 0.0))
    pressed = restoring(ground, block, state.side, state.piece, state.offset)
    return bool(time - state.struck <= least and 2.0 * state.v <= least * pressed)
