"""heyoka's adaptive Taylor integrator with terminal events, restarted at each impact."""

# requires: heyoka==7.13.2 numpy==2.4.6

from __future__ import annotations

import math
from typing import Any

import heyoka as hy
from loop import Case, Push, event_program

SETTINGS = "Taylor series to double precision"


def integrator() -> Any:
    u, v = hy.make_vars("u", "v")
    stiffness, damping, constant, slope, start, amplitude, w, phase, gap = (hy.par[n] for n in range(9))
    push = constant + slope * (hy.time - start) + amplitude * hy.sin(w * hy.time + phase)
    events = [
        hy.t_event(u, direction=hy.event_direction.negative),
        hy.t_event(gap - u, direction=hy.event_direction.negative),
    ]
    system = [(u, v), (v, stiffness * u - damping * v - push)]
    return hy.taylor_adaptive(system, [1.0, 0.0], pars=[0.0] * 9, t_events=events)


TAYLOR = integrator()

#: Height from which an arc starts over its own height.
OFFSET = 1e-13


def advance(case: Case, t: float, u: float, v: float, push: Push, until: float) -> tuple[float, float, float, bool]:
    # An event that is zero at the start hides the next one, and so does a step that is far longer than the arc.
    height, reach = 0.5 * v * v / (abs(push(t)) + 10.0 * v), 4.0 * v / (abs(push(t)) + 10.0 * v)
    TAYLOR.time, TAYLOR.state[:] = t, (u or OFFSET * height, v)
    TAYLOR.pars[:] = [case.stiffness, case.damping, *push, case.gap if math.isfinite(case.gap) else 1e9]
    TAYLOR.reset_cooldowns()
    reach = reach if u == 0.0 and v > 0.0 else 0.01
    while True:
        outcome = TAYLOR.propagate_until(min(TAYLOR.time + reach, until))[0]
        if outcome != hy.taylor_outcome.time_limit or TAYLOR.time >= until:
            return TAYLOR.time, float(TAYLOR.state[0]), float(TAYLOR.state[1]), outcome != hy.taylor_outcome.time_limit
        reach = min(2.0 * reach, 0.1)


if __name__ == "__main__":
    event_program("heyoka", SETTINGS, advance, slowest=1e-12)
