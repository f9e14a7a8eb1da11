"""SciPy's solve_ivp with terminal events, restarted at each impact."""

# requires: scipy==1.17.1 numpy==2.4.6

from __future__ import annotations

from typing import Any

import numpy as np
from loop import Case, Push, event_program
from scipy.integrate import solve_ivp

SETTINGS = "DOP853, rtol 1e-12, atol 1e-14; steps of 2 ms at most"


def advance(case: Case, t: float, u: float, v: float, push: Push, until: float) -> tuple[float, float, float, bool]:
    def rates(time: float, state: Any) -> list[float]:
        return [state[1], case.stiffness * state[0] - case.damping * state[1] - push(time)]

    def near(_: float, state: Any) -> Any:
        return state[0]

    def far(_: float, state: Any) -> Any:
        return case.gap - state[0]

    events: list[Any] = [near, far] if np.isfinite(case.gap) else [near]
    for event in events:
        event.terminal, event.direction = True, -1
    # Signs are compared at the ends of steps, so that the first step ends before a brief arc does.
    first = 0.2 * v / (abs(push(t)) + 10.0 * v) if v > 0.0 and u == 0.0 else 1e-4
    found = solve_ivp(
        rates, (t, until), [u, v], "DOP853", rtol=1e-12, atol=1e-14, events=events, max_step=0.002,
        first_step=min(max(first, 1e-13), until - t),
    )  # fmt: skip
    return float(found.t[-1]), float(found.y[0, -1]), float(found.y[1, -1]), found.status == 1


if __name__ == "__main__":
    event_program("scipy", SETTINGS, advance, slowest=1e-12)
