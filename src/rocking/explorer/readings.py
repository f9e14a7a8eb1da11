"""Further views of a case: phase plane and energy, one instant, a thumbnail. Independent of the web."""

from __future__ import annotations

from typing import Any

import numpy as np

from rocking.block import one_block
from rocking.core.arrays import without_dust
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.explorer.core import Explorer
from rocking.explorer.parameters import READING, Texts
from rocking.explorer.payload import Payload, phrase
from rocking.explorer.simulated import Simulated, checked_window, extremes, verdict
from rocking.response import Response, active_span
from rocking.response.figure import boundary_of, course_of, marked


def phase(explorer: Explorer, texts: Texts, window: tuple[float, float]) -> Payload:
    """Return the phase plane and the energy of a case in a window (s); times count from its start.

    Examples
    --------
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> payload = phase(Explorer(), texts, (0.0, 0.5))
    >>> payload.header["needed"], round(float(payload.arrays["potential"][0]), 6)
    ([1.0, 1.0], 0.189487)
    """
    shown = explorer.show(texts)
    start, end = checked_window(window, shown.response.duration)
    response = shown.resolved(start, end)
    course = course_of(response, start, end)
    x, y = boundary_of(response)
    seen = marked(response, start, end)
    header = {"window": {"from": start, "to": end}, "needed": response._energy.needed.tolist()}
    arrays = {
        "time": course.time - start,
        "rotation": course.rotation,
        "velocity": course.velocity,
        "kinetic": course.kinetic,
        "potential": course.potential,
        "before": course.before.astype(float),
        "boundary_x": x,
        "boundary_y": y,
        **{kind: times - start for kind, times in seen.items()},
    }
    return Payload(header, arrays)


def at(explorer: Explorer, texts: Texts, time: str, window: tuple[float, float] | None = None) -> dict[str, Any]:
    """Return the state of a case at a time (text), in the response of a window (s).

    Examples
    --------
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> found = at(Explorer(), texts, "0 ms")
    >>> found["rotation"], round(found["over_slenderness"], 12), found["state"]["phrase"]
    (0.02, 0.1, 'state.right')
    """
    shown = explorer.show(texts)
    seconds = READING["at"].read(time)
    duration = shown.response.duration
    if not 0.0 <= seconds <= duration:
        raise InvalidOption(
            f"{{}} must be within the response, from 0 to {duration:.6g} s, not {seconds:g} s", "at", value=time
        )
    response = shown.response if window is None else shown.resolved(*checked_window(window, duration))
    rotation, velocity, acceleration = response.states(seconds).tolist()
    kinetic, potential = float(response.kinetic_energy(seconds)), float(response.potential_energy(seconds))
    sides = one_block(response.block).sides
    return {
        "time": seconds,
        "state": _state(response, seconds, rotation),
        "rotation": rotation,
        "over_slenderness": rotation / sides[0 if rotation >= 0.0 else 1].alpha,
        "velocity": velocity,
        "acceleration": acceleration,
        **_ground(shown, seconds),
        "kinetic": kinetic,
        "potential": potential,
        "energy": kinetic + potential,
    }


def _state(response: Response, time: float, rotation: float) -> dict[str, Any]:
    """Return a phrase for the state of the block at a time."""
    rests = response.rest_intervals
    if np.any((rests[:, 0] <= time) & (time < rests[:, 1])):
        return phrase("state.rests")
    if rotation == 0.0:
        return phrase("state.stands")
    return phrase("state.right") if rotation > 0.0 else phrase("state.left")


def _ground(shown: Simulated, time: float) -> dict[str, float | None]:
    """Return the ground accelerations at a time, g, or None for missing motions."""
    motion = shown.case.motion
    both = {"ground_g": motion, "vertical_g": None if motion is None else motion.vertical}
    return {
        name: None if each is None else float(without_dust(each.acceleration(time), each.pga)) / STANDARD_GRAVITY
        for name, each in both.items()
    }


def thumbnail(explorer: Explorer, texts: Texts) -> Payload:
    """Return the outcome of a case in one line, and its normalised rotation while it moves, in few points.

    Examples
    --------
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> payload = thumbnail(Explorer(), texts)
    >>> payload.header["verdict"]["phrase"], len(payload.arrays["time"]) <= 300
    ('verdict.stays', True)
    """
    shown = explorer.show(texts)
    response = shown.response
    start, end = active_span(response)
    times = np.linspace(start, end, 2_000)
    rotation = response.rotation(times)
    plus, minus = (side.alpha for side in one_block(response.block).sides)
    kept = extremes(rotation, 300)
    over = np.where(rotation >= 0.0, rotation / plus, rotation / minus)
    words = verdict(response, one_block(response.block).uplift_thresholds(shown.case.model))
    return Payload({"verdict": words, "from": start, "to": end}, {"time": times[kept], "rotation": over[kept]})
