"""diffrax's diffeqsolve with an event found by a root finder, restarted at each impact."""

# requires: diffrax==0.7.2 jax==0.10.2 numpy==2.4.6

from __future__ import annotations

import math
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import optimistix
from loop import Case, Push, event_program

SETTINGS = "Dopri8 in double precision, rtol 1e-12, atol 1e-14; steps of 2 ms at most"

jax.config.update("jax_enable_x64", True)


def rates(t: Any, y: Any, args: Any) -> Any:
    stiffness, damping, constant, slope, start, amplitude, w, phase, _ = args
    push = constant + slope * (t - start) + amplitude * jnp.sin(w * t + phase)
    return jnp.array([y[1], stiffness * y[0] - damping * y[1] - push])


def near(t: Any, y: Any, args: Any, **_: Any) -> Any:
    return y[0]


def far(t: Any, y: Any, args: Any, **_: Any) -> Any:
    return args[8] - y[0]


EVENT = diffrax.Event([near, far], optimistix.Newton(1e-13, 1e-15), direction=[False, False])


@jax.jit
def arc(t: Any, until: Any, first: Any, state: Any, given: Any) -> tuple[Any, Any]:
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(rates), diffrax.Dopri8(), t, until, first, state, given, event=EVENT, max_steps=100_000,
        stepsize_controller=diffrax.PIDController(rtol=1e-12, atol=1e-14, dtmax=0.002), throw=False,
    )  # fmt: skip
    return found.ts[-1], found.ys[-1]


def advance(case: Case, t: float, u: float, v: float, push: Push, until: float) -> tuple[float, float, float, bool]:
    first = 0.2 * v / (abs(push(t)) + 10.0 * v) if v > 0.0 and u == 0.0 else 1e-4
    # Time starts with the arc: the root finder's tolerance is relative to it, and would exceed a short arc late on.
    push = push._replace(start=push.start - t, phase=push.phase + push.w * t)
    given = jnp.array([case.stiffness, case.damping, *push, case.gap if math.isfinite(case.gap) else 1e9])
    passed, state = arc(0.0, until - t, min(max(first, 1e-13), until - t), jnp.array([u, v]), given)
    end = t + float(passed) if passed < until - t else until
    # The result does not say it: the root finder may report that it did not converge where it has, to rounding.
    return end, float(state[0]), float(state[1]), bool(passed < until - t)


if __name__ == "__main__":
    event_program("diffrax", SETTINGS, advance, slowest=1e-12)
