"""What a figure of a response is given: arrays of the stretch of time that it shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidOption

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rocking.response.response import Response

#: What rotations are drawn in.
RotationUnits = Literal["slenderness", "rad", "deg"]

_LABELS: Final = {"slenderness": "rotation / slenderness", "rad": "rotation (rad)", "deg": "rotation (°)"}

#: Even times of a line.
_EVEN_TIMES: Final = 4001


def figure(response: Response, units: RotationUnits, window: tuple[float, float] | None) -> Figure:
    """Draw the rotation over the ground motion, from the window's start to its end."""
    from rocking.plot import DrawnSequence, response_figure

    checks.one_of(units, "units", InvalidOption, tuple(_LABELS))
    start, end = active_span(response) if window is None else _checked(window, response.duration)
    times = drawing_times(response, start, end)
    motion, gravity = response.motion, response.block.gravity
    corners = np.empty(0) if motion is None else motion.drawing_times(start, end)
    plus, minus = (threshold / gravity for threshold in response.block.uplift_thresholds(response.model))
    sequence = _longest_sequence(response, start, end)
    drawn = response_figure(
        time=times,
        rotation_over_slenderness=_in_units(response, times, units),
        impact_times=_within(response.impacts["time"], start, end),
        rest_intervals=_clipped(response.rest_intervals, start, end),
        uplift_times=_within(response.events["time"][response.events["kind"] == "uplift"], start, end),
        overturn_time=response.overturn_time if response.overturned and response.overturn_time <= end else None,
        motion_time=corners,
        motion_acceleration_g=corners if motion is None else motion.acceleration(corners) / gravity,
        thresholds_g=(plus, minus),
        chattering=None if sequence is None else DrawnSequence(*sequence),
        title=f"{response.block.description} under {'no motion' if motion is None else motion.name}",
    )
    drawn.axes[0].set_ylabel(_LABELS[units])
    return drawn


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


def _in_units(response: Response, times: Floats, units: RotationUnits) -> Floats:
    theta = response.rotation(times)
    if units == "slenderness":
        plus, minus = (side.alpha for side in response.block.sides)
        return theta / np.where(theta >= 0.0, plus, minus)
    return theta if units == "rad" else np.degrees(theta)


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


def _clipped(intervals: Floats, start: float, end: float) -> Floats:
    clipped = np.clip(intervals, start, end)
    return clipped[clipped[:, 1] > clipped[:, 0]]
