"""Simulated case: its numbers, texts and lines on the page, complete or in a window."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from rocking.block import Block
from rocking.chattering.maps import chattering_episodes
from rocking.core.arrays import Floats, Integers, clear_rounding
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.schemes import Certified
from rocking.errors import OptionError
from rocking.explorer.inputs import Case
from rocking.explorer.payload import phrase
from rocking.inputs.notes import block_notes, motion_notes
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.response.summary import format_outcome, round_ratio

#: Evaluation times of a rotation in a window, and points of a line in a payload.
_MAX_TIMES: Final = 12_000
MAX_POINTS: Final = 3_000

#: Narrowest window, s, because of the precision of times; also the width for a response of zero duration.
_MIN_WINDOW: Final = 1e-12

#: Maximum number of impacts in a window whose times are added to the line.
_MAX_MARKS: Final = 2_000

#: Treatment with a narrow bracket on times of rest, s, to resolve impacts in windows close to a rest.
_REFINED: Final = Certified(1e-40)

#: Longest drawn period of ground motion, s, for records whose baseline would drift.
_MAX_DRAWN_PERIOD: Final = 10.0

#: Properties of a response that the page shows unchanged.
_RESPONSE_PROPERTIES: Final = ("duration", "overturned", "overturn_time", "peak_rotation", "peak_time", "time_at_rest")


@dataclass(frozen=True, eq=False)
class SimulatedCase:
    """Case with its response, and cached results."""

    case: Case
    response: Response

    @functools.cached_property
    def refined(self) -> Response:
        """Same response with more impacts resolved before each proven rest."""
        if self.case.chattering.name != _REFINED.name:
            return self.response
        refined = replace(self.case, chattering=_REFINED).simulate()
        return refined if refined.rests_by_rounding == self.response.rests_by_rounding else self.response

    def select_response(self, start: float, end: float) -> Response:
        """Return the response that resolves the impacts in a window."""
        return self.refined if find_unresolved(self.response, start, end) else self.response

    @functools.cached_property
    def outline(self) -> Floats | None:
        """Trapezoids of a mesh's outline in its rocking plane; None for other blocks."""
        return None if self.case.body is None else self.case.body.find_outline(self.case.azimuth)

    @functools.cached_property
    def ground(self) -> Motion | None:
        """Horizontal motion whose displacement is drawn; records are filtered against drift."""
        if self.case.motion is None:
            return None
        motion = self.case.motion.with_vertical(None)
        return motion.processed(baseline=1, band_pass=(1.0 / _MAX_DRAWN_PERIOD, None)) if has_drift(motion) else motion


def find_unresolved(response: Response, start: float, end: float) -> list[float]:
    """Return the times, s, from the last resolved impact to the rest, for sequences that end in a window."""
    ends = np.asarray(response.sequences["end"], dtype=float)
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    last_impacts = impact_times[np.searchsorted(impact_times, ends, side="right") - 1]
    is_visible = (ends > start) & (last_impacts < end) & (ends - last_impacts > 1e-3 * (end - start))
    return [float(duration) for duration in (ends - last_impacts)[is_visible]]


def has_drift(motion: Motion) -> bool:
    """Whether a motion has the displacement of a record, which can be filtered."""
    long_enough = motion.dt is not None and motion.duration > 2.0 * _MAX_DRAWN_PERIOD > 20.0 * motion.dt
    return long_enough and motion.coefficients.shape[1] == 2 and not motion.jumps


def describe_case(simulated: SimulatedCase) -> dict[str, Any]:
    """Return the numbers of a case on the page, and the sentence above them."""
    case, response = simulated.case, simulated.response
    block, motion = case.block, case.motion
    return {
        "block": {
            "description": block.description,
            "sides": [vars(side) for side in block.sides],
            "thresholds_g": [threshold / STANDARD_GRAVITY for threshold in block.uplift_thresholds(case.model)],
            "gravity_g": block.gravity / STANDARD_GRAVITY,
            "outline": _describe_outline(block, simulated.outline),
            "notes": [*map(str, block_notes(block)), *(case.body.solid.notes if case.body else ())],
            "body": None if case.body is None else case.body.plane(case.azimuth),
        },
        "motion": None if motion is None else _describe_motion(motion),
        "model": case.model,
        "treatment": str(case.chattering),
        **{name: getattr(response, name) for name in _RESPONSE_PROPERTIES},
        "peak_over_slenderness": round_ratio(response),
        "impacts": len(response.impacts),
        "rests": int(np.sum(response.events["kind"] == "rest")),
        "proven": int(np.sum(~np.isnan(response.sequences["upper"]))),
        "share_at_rest": chattering_episodes(response).share_at_rest,
        "eta_squared": math.prod(side.restitution for side in block.sides),
        "verdict": describe_outcome(response, block.uplift_thresholds(case.model)),
    }


def describe_outcome(response: Response, thresholds: tuple[float, float]) -> dict[str, Any] | str:
    """Describe the outcome of a block with these uplift accelerations (m/s^2) in one sentence, overturning first."""
    if response.stopped:
        sentence = format_outcome(response, "")
        return f"{sentence[0].upper()}{sentence[1:]}."
    if not len(response.events) and not len(response.impacts) and response.peak_rotation == 0.0:
        if response.motion is None:
            return phrase("verdict.still")
        if response.motion.vertical is not None:
            return phrase("verdict.unlifted")
        return phrase("verdict.below", lifting=min(thresholds))
    perturbed = response.perturbed()
    if not perturbed.is_decided:
        return phrase("verdict.undecided", overturned=int(perturbed.overturned.sum()), count=len(perturbed.repeats))
    rests = int(np.sum(response.events["kind"] == "rest"))
    if response.overturned:
        time = response.overturn_time
        return (
            phrase("verdict.overturns_later", time=time, count=rests)
            if rests
            else phrase("verdict.overturns", time=time)
        )
    if response.unfinished:
        return phrase("verdict.given_up", time=response.duration)
    unproven = rests - int(np.sum(~np.isnan(response.sequences["upper"])))
    rest_phrase = phrase("verdict.rests", count=rests) if rests else phrase("verdict.no_rest")
    if unproven:
        rest_phrase = phrase("verdict.unproven", rests=rest_phrase, unproven=unproven)
    ratio = round_ratio(response)
    # Two digits, or four near 100 %, where they matter.
    ratio_phrase = phrase("verdict.percent" if ratio < 0.99 else "verdict.near_percent", value=100.0 * ratio)
    return phrase("verdict.stays", share=ratio_phrase, resting=rest_phrase)


@functools.lru_cache(maxsize=4)
def _describe_motion(motion: Motion) -> dict[str, Any]:
    """Return facts on a motion, cached while only the block changes."""
    return {
        "name": motion.name,
        "duration": motion.duration,
        "pga_g": motion.pga / STANDARD_GRAVITY,
        "vertical": motion.vertical and {"name": motion.vertical.name, "pga_g": motion.vertical.pga / STANDARD_GRAVITY},
        "notes": list(motion_notes(motion)),
        "filtered": has_drift(motion),
    }


def _describe_outline(block: Block, outline: Floats | None) -> dict[str, Any]:
    """Return the corners of the standing block (m) or trapezoids (n, 6), centre of mass at distance 0, and extent."""
    right, left = (side.radius * math.sin(side.alpha) for side in block.sides)
    heights = [side.radius * math.cos(side.alpha) for side in block.sides]
    centre = 0.5 * (heights[0] + heights[1])
    extent = {"left": left, "right": right, "centre": centre}
    if outline is None:
        return {**extent, "top": 2.0 * centre, "widest": max(left, right)}
    return {**extent, "top": float(outline[:, 1].max()), "widest": float(np.abs(outline[:, 2:]).max())}


def check_window(window: tuple[float, float], duration: float) -> tuple[float, float]:
    """Return the ends of a window, s, within a response of this duration; reject invalid windows."""
    start, end = window
    if not (math.isfinite(start) and math.isfinite(end) and start < end):
        raise OptionError("the window must go from a time to a later one, both in s", value=window)
    start, end = max(start, 0.0), min(end, duration)
    if not start < end:
        raise OptionError(f"the window is outside the response, which lasts {duration:.6g} s")
    if end - start < _MIN_WINDOW:
        raise OptionError(f"the window is {end - start:.3g} s wide; widen it to {_MIN_WINDOW:g} s or more")
    return start, end


def choose_window(
    window: tuple[float, float] | None, duration: float, default: tuple[float, float]
) -> tuple[float, float]:
    """Return a window, s, or the default if it is missing or was chosen for a longer response."""
    return default if window is None or window[0] >= duration else check_window(window, duration)


def describe_window(simulated: SimulatedCase, start: float, end: float) -> dict[str, Any]:
    """Describe a window: its ends, number of impacts, and time from the last one to a rest, s."""
    response = simulated.select_response(start, end)
    times = response.impacts["time"]
    count = np.searchsorted(times, end, "right") - np.searchsorted(times, start, "left")
    unresolved_time = max(find_unresolved(response, start, end), default=None)
    return {**widen_empty_window(start, end), "impacts": int(count), "unresolved": unresolved_time}


def widen_empty_window(start: float, end: float) -> dict[str, float]:
    """Return distinct ends of the display, s, also for a response of zero duration."""
    return {"from": start, "to": end if end > start else start + 1.0}


def sample_window(simulated: SimulatedCase, start: float, end: float, points: int = MAX_POINTS) -> dict[str, Floats]:
    """Return the lines in a window; times count from its start to keep their precision in narrow windows."""
    response = simulated.select_response(start, end)
    impact_times = response.impacts["time"]
    visible = impact_times[(impact_times >= start) & (impact_times <= end)]
    marks = visible if len(visible) <= _MAX_MARKS else visible[:: math.ceil(len(visible) / _MAX_MARKS)]
    times = np.sort(np.concatenate([np.linspace(start, end, min(_MAX_TIMES, 4 * points)), marks]), kind="stable")
    times = times[np.diff(times, prepend=-math.inf) > 0.0]
    rotation = response.rotation(times)
    indices = thin_line(rotation, points)
    return {
        "time": times[indices] - start,
        "rotation": rotation[indices],
        "impact": marks - start,
        **_sample_ground_acceleration(simulated.case, start, end, points),
    }


def thin_line(values: Floats, max_count: int) -> Integers:
    """Return the indices of at most `most` values of a line: minimum and maximum of each group of neighbours.

    Examples
    --------
    >>> thin_line(np.array([0.0, 3.0, 1.0, 5.0, -2.0, 4.0]), 4)
    array([0, 1, 3, 4])
    """
    if len(values) <= max_count:
        return np.arange(len(values))
    width = math.ceil(2 * len(values) / max_count)
    rows = np.concatenate([values, np.full(-len(values) % width, values[-1])]).reshape(-1, width)
    starts = width * np.arange(len(rows))
    low, high = starts + rows.argmin(axis=1), starts + rows.argmax(axis=1)
    pairs = np.column_stack([np.minimum(low, high), np.maximum(low, high)]).ravel()
    indices: Integers = np.minimum(pairs, len(values) - 1)
    return indices[np.diff(indices, prepend=-1) > 0]


def _sample_ground_acceleration(case: Case, start: float, end: float, points: int) -> dict[str, Floats]:
    """Return the ground acceleration in a window, g; with a vertical component, also the factor on thresholds."""
    motion = case.motion
    if motion is None:
        return {"ground_time": np.empty(0), "ground_g": np.empty(0)}
    motion_end = motion.duration if motion.vertical is None else max(motion.duration, motion.vertical.duration)
    corners = motion.drawing_times(start, min(end, max(start, motion_end)))
    acceleration = clear_rounding(motion.acceleration(corners), motion.pga) / STANDARD_GRAVITY
    if motion.vertical is None:
        indices = thin_line(acceleration, points)
        return {"ground_time": corners[indices] - start, "ground_g": acceleration[indices]}
    weight = 1.0 + motion.vertical.acceleration(corners) / case.block.gravity
    plus, minus = (threshold / STANDARD_GRAVITY for threshold in case.block.uplift_thresholds(case.model))
    excesses = (-acceleration - plus * weight, acceleration - minus * weight)
    indices = np.unique(np.concatenate([thin_line(line, points) for line in (acceleration, weight, *excesses)]))
    return {"ground_time": corners[indices] - start, "ground_g": acceleration[indices], "weight": weight[indices]}


def sample_ground_displacement(simulated: SimulatedCase, start: float, end: float) -> dict[str, Floats]:
    """Return the displacement of the ground in a window, m."""
    times = np.linspace(start, end, MAX_POINTS // 4)
    ground = simulated.ground
    displacement = np.zeros_like(times) if ground is None else ground.displacement(np.minimum(times, ground.duration))
    return {"displacement_time": times - start, "displacement": displacement}


def sample_events(response: Response) -> dict[str, Floats]:
    """Return the lines common to all windows: impacts with intervals, rests, uplifts, chattering sequences."""
    intervals, ratios = _find_intervals(response)
    sequences = response.sequences
    columns = [np.asarray(sequences[name], dtype=float) for name in ("start", "end", "lower", "upper", "impacts")]
    columns.append(_find_rest_spreads(response))
    return {
        "impact_time": np.asarray(response.impacts["time"], dtype=float),
        "impact_speed": np.asarray(response.impacts["speed_after"], dtype=float),
        "interval": intervals,
        "ratio": ratios,
        "rest": response.rest_intervals.ravel(),
        "uplift": np.asarray(response.events["time"][response.events["kind"] == "uplift"], dtype=float),
        "sequence": np.column_stack(columns).ravel(),
    }


def _find_rest_spreads(response: Response) -> Floats:
    """Return the spread of each sequence's rest in the repeated simulations, s; NaN if missing in one of them."""
    if not len(response.sequences):
        return np.empty(0)
    rests = np.searchsorted(response.events["time"], response.sequences["end"])
    return response.perturbed().event_spreads[rests]


def _find_intervals(response: Response) -> tuple[Floats, Floats]:
    """Return the time from each impact to the next, and the ratio of the next interval but one to it (or NaN)."""
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    intervals = np.append(np.diff(impact_times), np.nan)[: len(impact_times)]
    uplifts = response.events["time"][response.events["kind"] == "uplift"]
    rocking_phase = np.searchsorted(uplifts, impact_times, side="right")
    intervals[np.flatnonzero(np.diff(rocking_phase))] = np.nan
    ratios = np.full(len(impact_times), np.nan)
    positive = np.where(intervals > 0.0, intervals, np.nan)
    ratios[:-2] = positive[2:] / positive[:-2]
    return intervals, ratios
