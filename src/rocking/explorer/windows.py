"""Lines that a page draws: those in a window of a response, evaluated anew, and those that no window changes."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from rocking.core.arrays import Floats, Integers, without_dust
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.explorer.inputs import Case
from rocking.explorer.simulated import Simulated, unresolved
from rocking.response import Response

#: Times at which a rotation is evaluated across a window, and points of a line that are sent.
_TIMES: Final = 12_000
POINTS: Final = 3_000

#: Narrowest window, s: times have no more digits; and what is shown of a response that lasts no time.
_NARROWEST: Final = 1e-12

#: Impacts of a window whose times are added to the line's.
_MARKED: Final = 2_000


def checked_window(window: tuple[float, float], duration: float) -> tuple[float, float]:
    """Return the ends of a window, s, within a response that lasts so long; refuse what is none."""
    start, end = window
    if not (math.isfinite(start) and math.isfinite(end) and start < end):
        raise InvalidOption("the window must go from a time to a later one, both in s", value=window)
    start, end = max(start, 0.0), min(end, duration)
    if not start < end:
        raise InvalidOption(f"the window is outside the response, which lasts {duration:.6g} s")
    if end - start < _NARROWEST:
        raise InvalidOption(f"the window is {end - start:.3g} s wide; widen it to {_NARROWEST:g} s or more")
    return start, end


def begun_window(window: tuple[float, float] | None, duration: float) -> tuple[float, float] | None:
    """Return a window, s, or None where it begins when a response is over: it was chosen for a longer one."""
    return None if window is not None and window[0] >= duration else window


def about_window(shown: Simulated, start: float, end: float) -> dict[str, Any]:
    """Say what a window shows: its ends, how many impacts, and how long before a rest the last one is, s."""
    response = shown.resolved(start, end)
    times = response.impacts["time"]
    count = np.searchsorted(times, end, "right") - np.searchsorted(times, start, "left")
    left = max(unresolved(response, start, end), default=None)
    return {**ends_of(start, end), "impacts": int(count), "unresolved": left}


def ends_of(start: float, end: float) -> dict[str, float]:
    """Return the ends of what is shown, s, apart also where a response lasts no time."""
    return {"from": start, "to": end if end > start else start + 1.0}


def lines_in(shown: Simulated, start: float, end: float, points: int = POINTS) -> dict[str, Floats]:
    """Lines in a window; times count from its start, so that they keep their digits however narrow it is."""
    response = shown.resolved(start, end)
    impact_times = response.impacts["time"]
    inside = impact_times[(impact_times >= start) & (impact_times <= end)]
    marked = inside if len(inside) <= _MARKED else inside[:: math.ceil(len(inside) / _MARKED)]
    times = np.sort(np.concatenate([np.linspace(start, end, min(_TIMES, 4 * points)), marked]), kind="stable")
    times = times[np.diff(times, prepend=-math.inf) > 0.0]
    rotation = response.rotation(times)
    kept = extremes(rotation, points)
    return {
        "time": times[kept] - start,
        "rotation": rotation[kept],
        "impact": marked - start,
        **_shaking(shown.case, start, end, points),
    }


def extremes(values: Floats, most: int) -> Integers:
    """Return where at most so many values of a line are: the least and the greatest of each stretch of neighbours.

    Examples
    --------
    >>> extremes(np.array([0.0, 3.0, 1.0, 5.0, -2.0, 4.0]), 4)
    array([0, 1, 3, 4])
    """
    if len(values) <= most:
        return np.arange(len(values))
    width = math.ceil(2 * len(values) / most)
    rows = np.concatenate([values, np.full(-len(values) % width, values[-1])]).reshape(-1, width)
    starts = width * np.arange(len(rows))
    low, high = starts + rows.argmin(axis=1), starts + rows.argmax(axis=1)
    both = np.column_stack([np.minimum(low, high), np.maximum(low, high)]).ravel()
    kept: Integers = np.minimum(both, len(values) - 1)
    return kept[np.diff(kept, prepend=-1) > 0]


def _shaking(case: Case, start: float, end: float, points: int) -> dict[str, Floats]:
    """Ground acceleration in a window, standard g; with a vertical component, the weight that multiplies thresholds."""
    motion = case.motion
    if motion is None:
        return {"ground_time": np.empty(0), "ground_g": np.empty(0)}
    last = motion.duration if motion.vertical is None else max(motion.duration, motion.vertical.duration)
    corners = motion.drawing_times(start, min(end, max(start, last)))
    acceleration = without_dust(motion.acceleration(corners), motion.pga) / STANDARD_GRAVITY
    if motion.vertical is None:
        kept = extremes(acceleration, points)
        return {"ground_time": corners[kept] - start, "ground_g": acceleration[kept]}
    weight = 1.0 + motion.vertical.acceleration(corners) / case.block.gravity
    plus, minus = (threshold / STANDARD_GRAVITY for threshold in case.block.uplift_thresholds(case.model))
    beyond = (-acceleration - plus * weight, acceleration - minus * weight)
    kept = np.unique(np.concatenate([extremes(each, points) for each in (acceleration, weight, *beyond)]))
    return {"ground_time": corners[kept] - start, "ground_g": acceleration[kept], "weight": weight[kept]}


def ground_in(shown: Simulated, start: float, end: float) -> dict[str, Floats]:
    """Displacement of the ground in a window, m."""
    times = np.linspace(start, end, POINTS // 4)
    ground = shown.ground
    moved = np.zeros_like(times) if ground is None else ground.displacement(np.minimum(times, ground.duration))
    return {"displacement_time": times - start, "displacement": moved}


def lines_of(response: Response) -> dict[str, Floats]:
    """Return what no window changes: impacts with their intervals, rests, uplifts, chattering sequences."""
    intervals, ratios = _intervals(response)
    sequences = response.chattering
    columns = [np.asarray(sequences[name], dtype=float) for name in ("start", "end", "lower", "upper", "impacts")]
    columns.append(_uncertain(response))
    return {
        "impact_time": np.asarray(response.impacts["time"], dtype=float),
        "impact_speed": np.asarray(response.impacts["speed_after"], dtype=float),
        "interval": intervals,
        "ratio": ratios,
        "rest": response.rest_intervals.ravel(),
        "uplift": np.asarray(response.events["time"][response.events["kind"] == "uplift"], dtype=float),
        "sequence": np.column_stack(columns).ravel(),
    }


def _uncertain(response: Response) -> Floats:
    """Return how far the rest of each sequence moves in the repeated simulations, s; NaN where it is not in all."""
    if not len(response.chattering):
        return np.empty(0)
    rests = np.searchsorted(response.events["time"], response.chattering["end"])
    return response.perturbed().event_spreads[rests]


def _intervals(response: Response) -> tuple[Floats, Floats]:
    """Time from each impact to the next, and the ratio of the next interval but one to it (to eta^2); or NaN."""
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    intervals = np.append(np.diff(impact_times), np.nan)[: len(impact_times)]
    uplifts = response.events["time"][response.events["kind"] == "uplift"]
    rocking = np.searchsorted(uplifts, impact_times, side="right")
    intervals[np.flatnonzero(np.diff(rocking))] = np.nan
    ratios = np.full(len(impact_times), np.nan)
    positive = np.where(intervals > 0.0, intervals, np.nan)
    ratios[:-2] = positive[2:] / positive[:-2]
    return intervals, ratios
