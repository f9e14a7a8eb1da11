"""Uplifts and impacts as heyoka locates them: Taylor series to double precision with terminal events.

An uplift is an event of time alone: time is the state, on one piece of the motion after the other. An impact is one of
an arc under a constant push; the solver is started again after it. heyoka does not see an event if another one is zero
at the start of its step: an arc starts a share of its height above the ground, and steps grow from its length.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import heyoka as hy
import numpy as np

from promises.exact import GRAVITY

if TYPE_CHECKING:
    from promises.events import Question

#: Coefficients of a piece, at most.
_TERMS = 3

#: Height from which an arc starts after an impact, over its own height.
_OFFSET = 1e-13


def by_heyoka(asked: Question) -> list[float]:
    """Say when heyoka sees the event."""
    return _impacts(asked) if asked.kind == "impact" else _uplifts(asked)


@cache
def _clock() -> Any:
    time = hy.expression("time")
    passing = hy.par[_TERMS - 1]
    for number in reversed(range(_TERMS - 1)):
        passing = hy.par[number] + time * passing
    event = hy.t_event(passing, direction=hy.event_direction.positive)
    return hy.taylor_adaptive([(time, hy.expression(1.0))], [0.0], pars=[0.0] * _TERMS, t_events=[event])


def _uplifts(asked: Question) -> list[float]:
    """Ask when the motion less the threshold of the weight passes zero, piece by piece."""
    motion, threshold = asked.motion, GRAVITY * asked.block.sides[0].alpha
    above = np.zeros((len(motion.coefficients), _TERMS))
    above[:, : motion.coefficients.shape[1]] = motion.coefficients
    above[:, 0] -= threshold
    if motion.vertical is not None:
        assert np.array_equal(motion.vertical.breakpoints, motion.breakpoints)
        lift = motion.vertical.coefficients
        above[:, : lift.shape[1]] -= threshold / GRAVITY * lift
    clock = _clock()
    for start, end, row in zip(motion.breakpoints, motion.breakpoints[1:], above, strict=False):
        clock.time, clock.state[0], clock.pars[:] = 0.0, 0.0, row
        clock.reset_cooldowns()
        if clock.propagate_until(float(end - start))[0] != hy.taylor_outcome.time_limit:
            return [float(start) + float(clock.time)]
    return []


@cache
def _arc() -> Any:
    u, v = hy.make_vars("u", "v")
    event = hy.t_event(u, direction=hy.event_direction.negative)
    system = [(u, v), (v, hy.par[0] * (u - hy.par[1]))]
    return hy.taylor_adaptive(system, [1.0, 0.0], pars=[0.0, 0.0], t_events=[event])


def _impacts(asked: Question) -> list[float]:
    side, motion = asked.block.sides[0], asked.motion
    ends, levels = [*motion.breakpoints[1:-1].tolist(), np.inf], motion.coefficients[:, 0] / GRAVITY
    found: list[float] = []
    (u, v), time, sign = asked.start, 0.0, 1.0
    while len(found) < max(len(asked.true), 1) and time < asked.until:
        piece = int(np.searchsorted(ends, time, side="right"))
        held, until = side.alpha + sign * float(levels[piece]), min(ends[piece], asked.until)
        time, u, v, hit = _advanced(time, u, v, side.p, held, until)
        if hit:
            found.append(time)
            u, v, sign = 0.0, -side.restitution * v, -sign
    return found


def _advanced(time: float, u: float, v: float, p: float, held: float, until: float) -> tuple[float, float, float, bool]:
    """Time, state, and whether the block came down, after an arc or at a time."""
    arc, pull = _arc(), p * p * abs(held)
    reach = 1.0 / p
    if u == 0.0:
        u, reach = _OFFSET * 0.5 * v * v / pull, min(reach, 4.0 * v / pull)
    arc.time, arc.state[:], arc.pars[:] = time, (u, v), (p * p, held)
    arc.reset_cooldowns()
    while True:
        outcome = arc.propagate_until(min(arc.time + reach, until))[0]
        if outcome != hy.taylor_outcome.time_limit or arc.time >= until:
            return float(arc.time), float(arc.state[0]), float(arc.state[1]), outcome != hy.taylor_outcome.time_limit
        reach *= 2.0
