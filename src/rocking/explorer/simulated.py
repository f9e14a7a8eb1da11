"""Case with its response: numbers, words, and the lines that the page draws, complete or in a window."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from rocking.block import Block
from rocking.chattering.maps import chattering_episodes
from rocking.core.arrays import Floats, Integers, without_dust
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.schemes import Certified
from rocking.errors import InvalidOption
from rocking.explorer.inputs import Case
from rocking.explorer.payload import phrase
from rocking.inputs.notes import block_notes, motion_notes
from rocking.motion.motion import Motion
from rocking.response import Response, in_words, known_ratio

#: Evaluation times of a rotation in a window, and points of a line in a payload.
_TIMES: Final = 12_000
POINTS: Final = 3_000

#: Narrowest window, s, because of the precision of times; also the width for a response of zero duration.
_NARROWEST: Final = 1e-12

#: Maximum number of impacts in a window whose times are added to the line.
_MARKED: Final = 2_000

#: Bracket on a time of rest, s, to resolve impacts in a window close to it; some nanoseconds remain.
_FINEST: Final = Certified(1e-40)

#: Longest drawn period of ground motion, s, for records whose baseline would drift.
_LONGEST_PERIOD: Final = 10.0

#: Properties of a response that the page shows unchanged.
_ANSWERS: Final = ("duration", "overturned", "overturn_time", "peak_rotation", "peak_time", "time_at_rest")


@dataclass(frozen=True, eq=False)
class Simulated:
    """Case with its response, and cached results."""

    case: Case
    response: Response

    @functools.cached_property
    def fine(self) -> Response:
        """Same response with more impacts resolved before each proven rest."""
        if self.case.chattering.name != _FINEST.name:
            return self.response
        fine = replace(self.case, chattering=_FINEST).simulate()
        return fine if fine.rests_by_rounding == self.response.rests_by_rounding else self.response

    def resolved(self, start: float, end: float) -> Response:
        """Return the response with impacts resolved as finely as a window shows."""
        return self.fine if unresolved(self.response, start, end) else self.response

    @functools.cached_property
    def outline(self) -> Floats | None:
        """Trapezoids of a mesh's outline in its rocking plane; None for other blocks."""
        return None if self.case.body is None else self.case.body.across(self.case.azimuth)

    @functools.cached_property
    def ground(self) -> Motion | None:
        """Horizontal motion whose displacement is drawn; records are filtered against drift."""
        if self.case.motion is None:
            return None
        motion = self.case.motion.with_vertical(None)
        return motion.processed(baseline=1, band_pass=(1.0 / _LONGEST_PERIOD, None)) if drifts(motion) else motion


def unresolved(response: Response, start: float, end: float) -> list[float]:
    """Return the times, s, from the last resolved impact to the rest, for sequences that end in a window."""
    ends = np.asarray(response.sequences["end"], dtype=float)
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    last = impact_times[np.searchsorted(impact_times, ends, side="right") - 1]
    seen = (ends > start) & (last < end) & (ends - last > 1e-3 * (end - start))
    return [float(each) for each in (ends - last)[seen]]


def drifts(motion: Motion) -> bool:
    """Whether a motion has the displacement of a record, which can be filtered."""
    long_enough = motion.dt is not None and motion.duration > 2.0 * _LONGEST_PERIOD > 20.0 * motion.dt
    return long_enough and motion.coefficients.shape[1] == 2 and not motion.jumps


def facts(shown: Simulated) -> dict[str, Any]:
    """Return the numbers of a case on the page, and the sentence above them."""
    case, response = shown.case, shown.response
    block, motion = case.block, case.motion
    return {
        "block": {
            "description": block.description,
            "sides": [vars(side) for side in block.sides],
            "thresholds_g": [each / STANDARD_GRAVITY for each in block.uplift_thresholds(case.model)],
            "gravity_g": block.gravity / STANDARD_GRAVITY,
            "outline": _outline(block, shown.outline),
            "notes": [*map(str, block_notes(block)), *(case.body.solid.notes if case.body else ())],
            "body": None if case.body is None else case.body.plane(case.azimuth),
        },
        "motion": None if motion is None else _motion_facts(motion),
        "model": case.model,
        "treatment": str(case.chattering),
        **{name: getattr(response, name) for name in _ANSWERS},
        "peak_over_slenderness": known_ratio(response),
        "impacts": len(response.impacts),
        "rests": int(np.sum(response.events["kind"] == "rest")),
        "proven": int(np.sum(~np.isnan(response.sequences["upper"]))),
        "share_at_rest": chattering_episodes(response).share_at_rest,
        "eta_squared": math.prod(side.restitution for side in block.sides),
        "verdict": verdict(response, block.uplift_thresholds(case.model)),
    }


def verdict(response: Response, thresholds: tuple[float, float]) -> dict[str, Any] | str:
    """Describe the outcome of a block with these uplift accelerations (m/s^2) in one sentence, overturning first."""
    if response.stopped:
        words = in_words(response, "")
        return f"{words[0].upper()}{words[1:]}."
    if not len(response.events) and not len(response.impacts) and response.peak_rotation == 0.0:
        if response.motion is None:
            return phrase("verdict.still")
        if response.motion.vertical is not None:
            return phrase("verdict.unlifted")
        return phrase("verdict.below", lifting=min(thresholds))
    near = response.perturbed()
    if not near.is_decided:
        return phrase("verdict.undecided", overturned=int(near.overturned.sum()), count=len(near.repeats))
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
    resting = phrase("verdict.rests", count=rests) if rests else phrase("verdict.no_rest")
    if unproven:
        resting = phrase("verdict.unproven", rests=resting, unproven=unproven)
    ratio = known_ratio(response)
    # Two digits, or four near 100 %, where they matter.
    share = phrase("verdict.percent" if ratio < 0.99 else "verdict.near_percent", value=100.0 * ratio)
    return phrase("verdict.stays", share=share, resting=resting)


@functools.lru_cache(maxsize=4)
def _motion_facts(motion: Motion) -> dict[str, Any]:
    """Return facts on a motion, cached while only the block changes."""
    return {
        "name": motion.name,
        "duration": motion.duration,
        "pga_g": motion.pga / STANDARD_GRAVITY,
        "vertical": motion.vertical and {"name": motion.vertical.name, "pga_g": motion.vertical.pga / STANDARD_GRAVITY},
        "notes": list(motion_notes(motion)),
        "filtered": drifts(motion),
    }


def _outline(block: Block, outline: Floats | None) -> dict[str, Any]:
    """Return the corners of the standing block (m) or trapezoids (n, 6), centre of mass at distance 0, and extent."""
    right, left = (side.radius * math.sin(side.alpha) for side in block.sides)
    heights = [side.radius * math.cos(side.alpha) for side in block.sides]
    centre = 0.5 * (heights[0] + heights[1])
    shape = {"left": left, "right": right, "centre": centre}
    if outline is None:
        return {**shape, "top": 2.0 * centre, "widest": max(left, right)}
    return {**shape, "top": float(outline[:, 1].max()), "widest": float(np.abs(outline[:, 2:]).max())}


def checked_window(window: tuple[float, float], duration: float) -> tuple[float, float]:
    """Return the ends of a window, s, within a response of this duration; reject invalid windows."""
    start, end = window
    if not (math.isfinite(start) and math.isfinite(end) and start < end):
        raise InvalidOption("the window must go from a time to a later one, both in s", value=window)
    start, end = max(start, 0.0), min(end, duration)
    if not start < end:
        raise InvalidOption(f"the window is outside the response, which lasts {duration:.6g} s")
    if end - start < _NARROWEST:
        raise InvalidOption(f"the window is {end - start:.3g} s wide; widen it to {_NARROWEST:g} s or more")
    return start, end


def shown_window(
    window: tuple[float, float] | None, duration: float, usual: tuple[float, float]
) -> tuple[float, float]:
    """Return a window, s, or the default if it is missing or was chosen for a longer response."""
    return usual if window is None or window[0] >= duration else checked_window(window, duration)


def about_window(shown: Simulated, start: float, end: float) -> dict[str, Any]:
    """Describe a window: its ends, number of impacts, and time from the last one to a rest, s."""
    response = shown.resolved(start, end)
    times = response.impacts["time"]
    count = np.searchsorted(times, end, "right") - np.searchsorted(times, start, "left")
    left = max(unresolved(response, start, end), default=None)
    return {**ends_of(start, end), "impacts": int(count), "unresolved": left}


def ends_of(start: float, end: float) -> dict[str, float]:
    """Return distinct ends of the display, s, also for a response of zero duration."""
    return {"from": start, "to": end if end > start else start + 1.0}


def lines_in(shown: Simulated, start: float, end: float, points: int = POINTS) -> dict[str, Floats]:
    """Return the lines in a window; times count from its start to keep their precision in narrow windows."""
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
    """Return the indices of at most `most` values of a line: minimum and maximum of each group of neighbours.

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
    """Return the ground acceleration in a window, g; with a vertical component, also the factor on thresholds."""
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
    """Return the displacement of the ground in a window, m."""
    times = np.linspace(start, end, POINTS // 4)
    ground = shown.ground
    moved = np.zeros_like(times) if ground is None else ground.displacement(np.minimum(times, ground.duration))
    return {"displacement_time": times - start, "displacement": moved}


def lines_of(response: Response) -> dict[str, Floats]:
    """Return the lines common to all windows: impacts with intervals, rests, uplifts, chattering sequences."""
    intervals, ratios = _intervals(response)
    sequences = response.sequences
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
    """Return the spread of each sequence's rest in the repeated simulations, s; NaN if missing in one of them."""
    if not len(response.sequences):
        return np.empty(0)
    rests = np.searchsorted(response.events["time"], response.sequences["end"])
    return response.perturbed().event_spreads[rests]


def _intervals(response: Response) -> tuple[Floats, Floats]:
    """Return the time from each impact to the next, and the ratio of the next interval but one to it (or NaN)."""
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    intervals = np.append(np.diff(impact_times), np.nan)[: len(impact_times)]
    uplifts = response.events["time"][response.events["kind"] == "uplift"]
    rocking = np.searchsorted(uplifts, impact_times, side="right")
    intervals[np.flatnonzero(np.diff(rocking))] = np.nan
    ratios = np.full(len(impact_times), np.nan)
    positive = np.where(intervals > 0.0, intervals, np.nan)
    ratios[:-2] = positive[2:] / positive[:-2]
    return intervals, ratios
