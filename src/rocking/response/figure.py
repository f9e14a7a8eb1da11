"""What a figure of a response is given: arrays of the stretch of time that it shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, get_args

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.plot import RotationUnits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.response.response import Response

#: Even times of a line.
_EVEN_TIMES: Final = 4001


def figure(
    response: Response,
    units: RotationUnits,
    window: tuple[float, float] | None,
    chattering: bool,
    ax: Axes | None,
    figsize: tuple[float, float] | None,
) -> Figure:
    """Draw the rotation over the ground motion, from the window's start to its end."""
    from rocking.plot import DrawnSequence, response_figure

    checks.one_of(units, "units", InvalidOption, get_args(RotationUnits))
    start, end = active_span(response) if window is None else _checked(window, response.duration)
    times = drawing_times(response, start, end)
    motion, gravity = response.motion, response.block.gravity
    corners = np.empty(0) if motion is None else motion.drawing_times(start, end)
    lift = None if motion is None or motion.vertical is None else motion.vertical.acceleration(corners) / gravity
    weight = 1.0 if lift is None else 1.0 + lift
    plus, minus = (weight * threshold / gravity for threshold in response.block.uplift_thresholds(response.model))
    alpha_plus, alpha_minus = (side.alpha for side in response.block.sides)
    sequence = _longest_sequence(response, start, end) if chattering else None
    return response_figure(
        time=times,
        rotation=response.rotation(times),
        slenderness=(alpha_plus, alpha_minus),
        impact_times=response.impacts["time"],
        rest_intervals=response.rest_intervals,
        uplift_times=response.events["time"][response.events["kind"] == "uplift"],
        overturn_time=response.overturn_time if response.overturned and response.overturn_time <= end else None,
        motion_time=corners,
        motion_acceleration_g=corners if motion is None else motion.acceleration(corners) / gravity,
        thresholds_g=(plus, minus),
        vertical_acceleration_g=lift,
        duration=response.duration,
        chattering=None if sequence is None else DrawnSequence(*sequence),
        units=units,
        title=f"{response.block.description} under {'no motion' if motion is None else motion.label}",
        ax=ax,
        figsize=figsize,
    )


def active_span(response: Response) -> tuple[float, float]:
    """Stretch worth drawing: from a little before the first event to a little after the last."""
    times = np.concatenate([response.events["time"], response.impacts["time"]])
    if len(times) == 0:
        return 0.0, response.duration
    first = float(times.min()) if response.rotation(0.0) == 0.0 else 0.0
    margin = 0.1 * (float(times.max()) - first) + 0.5
    return max(0.0, first - margin), min(response.duration, float(times.max()) + margin)


def drawing_times(response: Response, start: float, end: float) -> Floats:
    """Return times dense enough for a smooth line: even ones, and those of steps that are long enough to see."""
    even = np.linspace(start, end, _EVEN_TIMES)
    steps = _within(response.trail.nodes["time"], start, end)
    visible = np.diff(np.floor(steps / max(even[1] - even[0], 1e-12)), prepend=-1.0) > 0.0
    return np.union1d(even, steps[visible])


def _checked(window: Sequence[float], duration: float) -> tuple[float, float]:
    ends: Any = checks.numbers(window, "window", InvalidOption)
    if ends.shape != (2,) or not 0.0 <= ends[0] < ends[1] <= duration:
        raise InvalidOption(f"window must be (start, end), in s, with 0 <= start < end <= {duration:.6g}, the duration")
    return float(ends[0]), float(ends[1])


def _longest_sequence(response: Response, start: float, end: float) -> tuple[Floats, float, float] | None:
    """Impact times of the chattering sequence with the most impacts in the stretch, and the bracket on its rest."""
    shown = response.chattering[(response.chattering["start"] >= start) & (response.chattering["end"] <= end)]
    longest = max(shown, key=lambda row: row["impacts"], default=None)
    if longest is None:
        return None
    struck = _within(response.impacts["time"], longest["start"], longest["end"])
    return struck, float(longest["lower"]), float(longest["upper"])


def _within(times: Floats, start: float, end: float) -> Floats:
    return times[(times >= start) & (times <= end)]
