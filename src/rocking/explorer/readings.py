"""Further views of a case: phase plane and energy, one instant, a thumbnail. Independent of the web."""

from __future__ import annotations

from typing import Any

import numpy as np

from rocking.block.single import require_block
from rocking.core.arrays import clear_rounding
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import OptionError
from rocking.explorer.core import Explorer
from rocking.explorer.parameters import READING, Texts
from rocking.explorer.payload import Payload, phrase
from rocking.explorer.simulated import SimulatedCase, check_window, describe_outcome, thin_line
from rocking.response import Response
from rocking.response.figure import compute_boundary, compute_course, find_active_span, find_event_times


def sample_phase(explorer: Explorer, texts: Texts, window: tuple[float, float]) -> Payload:
    """Return the phase plane and the energy of a case in a window (s); times count from its start.

    Examples
    --------
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> payload = sample_phase(Explorer(), texts, (0.0, 0.5))
    >>> payload.header["needed"], round(float(payload.arrays["potential"][0]), 6)
    ([1.0, 1.0], 0.189487)
    """
    simulated = explorer.simulate(texts)
    start, end = check_window(window, simulated.response.duration)
    response = simulated.select_response(start, end)
    trajectory = compute_course(response, start, end)
    x, y = compute_boundary(response)
    marks = find_event_times(response, start, end)
    header = {"window": {"from": start, "to": end}, "needed": response._energy.overturning_energy.tolist()}
    arrays = {
        "time": trajectory.time - start,
        "rotation": trajectory.rotation,
        "velocity": trajectory.velocity,
        "kinetic": trajectory.kinetic,
        "potential": trajectory.potential,
        "before": trajectory.impact_rows.astype(float),
        "boundary_x": x,
        "boundary_y": y,
        **{kind: times - start for kind, times in marks.items()},
    }
    return Payload(header, arrays)


def find_state(
    explorer: Explorer, texts: Texts, time: str, window: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Return the state of a case at a time (text), in the response of a window (s).

    Examples
    --------
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> state = find_state(Explorer(), texts, "0 ms")
    >>> state["rotation"], round(state["over_slenderness"], 12), state["state"]["phrase"]
    (0.02, 0.1, 'state.right')
    """
    simulated = explorer.simulate(texts)
    time_value = READING["at"].read(time)
    duration = simulated.response.duration
    if not 0.0 <= time_value <= duration:
        raise OptionError(
            f"{{}} must be within the response, from 0 to {duration:.6g} s, not {time_value:g} s", "at", value=time
        )
    response = simulated.response if window is None else simulated.select_response(*check_window(window, duration))
    rotation, velocity, acceleration = response.states(time_value).tolist()
    kinetic, potential = float(response.kinetic_energy(time_value)), float(response.potential_energy(time_value))
    sides = require_block(response.block).sides
    return {
        "time": time_value,
        "state": _describe_state(response, time_value, rotation),
        "rotation": rotation,
        "over_slenderness": rotation / sides[0 if rotation >= 0.0 else 1].alpha,
        "velocity": velocity,
        "acceleration": acceleration,
        **_find_ground_acceleration(simulated, time_value),
        "kinetic": kinetic,
        "potential": potential,
        "energy": kinetic + potential,
    }


def _describe_state(response: Response, time: float, rotation: float) -> dict[str, Any]:
    """Return a phrase for the state of the block at a time."""
    rests = response.rest_intervals
    if np.any((rests[:, 0] <= time) & (time < rests[:, 1])):
        return phrase("state.rests")
    if rotation == 0.0:
        return phrase("state.stands")
    return phrase("state.right") if rotation > 0.0 else phrase("state.left")


def _find_ground_acceleration(simulated: SimulatedCase, time: float) -> dict[str, float | None]:
    """Return the ground accelerations at a time, g, or None for missing motions."""
    motion = simulated.case.motion
    components = {"ground_g": motion, "vertical_g": None if motion is None else motion.vertical}
    return {
        name: None
        if component is None
        else float(clear_rounding(component.acceleration(time), component.pga)) / STANDARD_GRAVITY
        for name, component in components.items()
    }


def create_thumbnail(explorer: Explorer, texts: Texts) -> Payload:
    """Return the outcome of a case in one line, and its normalised rotation while it moves, in few points.

    Examples
    --------
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> payload = create_thumbnail(Explorer(), texts)
    >>> payload.header["verdict"]["phrase"], len(payload.arrays["time"]) <= 300
    ('verdict.stays', True)
    """
    simulated = explorer.simulate(texts)
    response = simulated.response
    start, end = find_active_span(response)
    times = np.linspace(start, end, 2_000)
    rotation = response.rotation(times)
    plus, minus = (side.alpha for side in require_block(response.block).sides)
    indices = thin_line(rotation, 300)
    normalised = np.where(rotation >= 0.0, rotation / plus, rotation / minus)
    outcome = describe_outcome(response, require_block(response.block).uplift_thresholds(simulated.case.model))
    return Payload(
        {"verdict": outcome, "from": start, "to": end}, {"time": times[indices], "rotation": normalised[indices]}
    )
