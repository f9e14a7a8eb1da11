"""What ends a step of an arc (an impact, a rotation at which the block has fallen, or nothing), and the impact."""

import math
from typing import NamedTuple

from rocking.arrays import Floats
from rocking.kernels.arc import evaluate
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import move
from rocking.kernels.root import curvature_bound, first_root
from rocking.kernels.state import Record
from rocking.kernels.status import IMPACT, OVERTURN, STEP


class Arrival(NamedTuple):
    """How a step ends (STEP, IMPACT or OVERTURN); time, u, u' there; time and height of the highest rotation on it.

    Where no rotation on it is above the highest so far, the last two are those of its end.
    """

    outcome: int
    time: float
    u: float
    v: float
    top: float
    height: float


@shared
def advance(state: Record, scratch: Record, order: int, h: float, fallen: float) -> Arrival:
    """Follow the series of an arc to its first event within h."""
    c, d = scratch.rotation, scratch.spare
    lead = 0 if state.u > 0.0 else (1 if state.v > 0.0 else 2)
    time = first_root(c, lead, order, h)
    outcome = IMPACT
    if math.isnan(time):
        time = h
        outcome = STEP
    end, speed, _ = evaluate(c, order, time)
    if end <= 0.0:  # also without a root: one within rounding of the step's end must not be left behind
        outcome, end = IMPACT, 0.0
    top, height = time, end
    if is_higher_between(state, end, c, order, time):
        top, height = highest(order, time, c, d)
    if height >= fallen:
        passage = first_passage(c, order, fallen, top, d)
        _, speed, _ = evaluate(c, order, passage)
        return Arrival(OVERTURN, passage, fallen, speed, passage, fallen)
    if outcome == IMPACT:
        end = 0.0
    return Arrival(outcome, time, end, speed, top, height)


@inlined
def is_higher_between(state: Record, end: float, c: Floats, order: int, h: float) -> bool:
    """Whether a series may be higher within (0, h) than at both ends, and than the highest rotation so far."""
    bend = curvature_bound(c, 0, order, h)
    if max(state.u, end) + 0.125 * h * h * bend <= state.peak:
        return False
    if state.v > 0.0:
        return bool(state.v < bend * h)
    rise = state.v
    power = h
    for k in range(2, order + 1):
        rise += max(0.0, c[k]) * power
        power *= h
    return rise > 0.0


@shared
def highest(order: int, h: float, c: Floats, d: Floats) -> tuple[float, float]:
    """Time and value of a series' maximum on (0, h], from one turning point to the next. ``d`` is scratch space."""
    best_time = h
    best, _, _ = evaluate(c, order, h)
    for k in range(order):
        d[k] = (k + 1) * c[k + 1]
    t = 0.0
    rising = True
    for _ in range(order):
        lead = 0
        while lead < order - 1 and d[lead] == 0.0:
            lead += 1
        if d[lead] < 0.0:
            rising = not rising
            for k in range(order):
                d[k] = -d[k]
        turn = first_root(d, lead, order - 1, h - t)
        if not turn > 0.0:
            break
        t += turn
        value, _, _ = evaluate(c, order, t)
        if rising and value > best:
            best_time, best = t, value
        move(d, order - 1, turn)
        d[0] = 0.0
    return best_time, best


@inlined
def first_passage(c: Floats, order: int, level: float, h: float, d: Floats) -> float:
    """First time in (0, h] at which a series that starts below ``level``, and is not below it at h, reaches it.

    ``d`` is scratch space.
    """
    d[0] = level - c[0]
    for k in range(1, order + 1):
        d[k] = -c[k]
    time = first_root(d, 0, order, h)
    return h if math.isnan(time) else time


@inlined
def strike(block: Record, state: Record) -> float:
    """Impact: the angular speed drops and the side changes; returns the speed before."""
    left = state.side
    speed = max(0.0, -state.v)
    state.side = block.entered[left]
    state.u = 0.0
    state.v = block.restitution[left] * speed
    state.impacts += 1
    return speed
