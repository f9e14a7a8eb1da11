"""Simulated case: its numbers, texts and lines on the page, complete or in a window."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from rocking.block import Block
from rocking.chattering.maps import chattering_episodes
from rocking.core.arrays import Floats, Integers, clear_rounding
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.schemes import Certified
from rocking.errors import OptionError
from rocking.explorer.inputs import Case
from rocking.explorer.payload import Payload
from rocking.inputs.notes import list_block_notes, list_motion_notes
from rocking.inputs.quantities import read_duration
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.response.figure import compute_active_span, compute_boundary, find_event_times, sample_interval
from rocking.response.summary import format_outcome, round_ratio

#: Evaluation times of a rotation in a window, and points of a line in a payload.
_MAX_TIMES: Final = 12_000
MAX_POINTS: Final = 3_000

#: Narrowest window, s, because of the precision of times; also the width for a response of zero duration.
_MIN_WINDOW: Final = 1e-12

#: Maximum number of impacts in a window whose times are added to the line.
_MAX_MARKS: Final = 2_000

#: Treatment with a narrow bracket on times of rest, s, to resolve impacts in windows close to a rest.
_REFINED_SCHEME: Final = Certified(1e-40)

#: Longest drawn period of ground motion, s, for records whose baseline would drift.
MAX_DRAWN_PERIOD: Final = 10.0

#: Share of the strong shaking below which a block counts as never at rest: rounding errors.
_MIN_SHARE: Final = 1e-9

#: Properties of a response that the page shows unchanged.
_RESPONSE_PROPERTIES: Final = ("duration", "overturned", "overturn_time", "tipping_time", "peak_rotation", "peak_time")


@dataclass(frozen=True, eq=False)
class SimulatedCase:
    """Case with its response, and cached results."""

    case: Case
    response: Response

    @functools.cached_property
    def refined(self) -> Response:
        """Same response with more impacts resolved before each proven rest."""
        if self.case.chattering.name != _REFINED_SCHEME.name:
            return self.response
        refined = self.case.simulate(chattering=_REFINED_SCHEME)
        return refined if refined.rests_by_rounding == self.response.rests_by_rounding else self.response

    def resolve_window(self, window: tuple[float, float] | None) -> tuple[Response, float, float]:
        """Return the response that resolves the impacts in a window, and the ends of the window, s.

        By default, and for a window beyond the response, which was chosen for a longer one, this is the time of motion.
        """
        duration = self.response.duration
        if window is None or window[0] >= duration:
            start, end = compute_active_span(self.response)
        else:
            start, end = max(window[0], 0.0), min(window[1], duration)
            if not end - start >= _MIN_WINDOW:
                limits = f"{_MIN_WINDOW:g} s wide, within the response from 0 to {duration:.6g} s"
                raise OptionError(f"the window must be at least {limits}", value=window)
        return self.refined if find_unresolved(self.response, start, end) else self.response, start, end


def find_unresolved(response: Response, start: float, end: float) -> list[float]:
    """Return the times, s, from the last resolved impact to the rest, for sequences that end in a window."""
    ends = np.asarray(response.sequences["end"], dtype=float)
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    last_impacts = impact_times[np.searchsorted(impact_times, ends, side="right") - 1]
    is_visible = (ends > start) & (last_impacts < end) & (ends - last_impacts > 1e-3 * (end - start))
    return [float(duration) for duration in (ends - last_impacts)[is_visible]]


def has_drift(motion: Motion) -> bool:
    """Whether a motion has the displacement of a record, which can be filtered."""
    is_long_enough = motion.dt is not None and motion.duration > 2.0 * MAX_DRAWN_PERIOD > 20.0 * motion.dt
    return is_long_enough and motion.coefficients.shape[1] == 2 and not motion.has_jumps


def describe_case(simulated_case: SimulatedCase, window: tuple[float, float] | None) -> Payload:
    """Return the numbers of a case on the page, the sentence above them, and its lines in a window (s)."""
    case, response = simulated_case.case, simulated_case.response
    block, motion = case.block, case.motion
    resolved, start, end = simulated_case.resolve_window(window)
    impact_times = resolved.impacts["time"][(resolved.impacts["time"] >= start) & (resolved.impacts["time"] <= end)]
    share = chattering_episodes(response).share_at_rest
    outline = None if case.body is None else case.body.find_outline(case.azimuth)
    header = {
        "block": {
            "sides": [vars(side) for side in block.sides],
            "thresholds_g": [threshold / STANDARD_GRAVITY for threshold in block.uplift_thresholds(case.model)],
            "gravity_g": block.gravity / STANDARD_GRAVITY,
            "outline": _describe_outline(block, outline),
            "notes": [*map(str, list_block_notes(block)), *(case.body.solid.notes if case.body else ())],
            "body": None if case.body is None else case.body.describe_plane(case.azimuth),
        },
        "motion": None if motion is None else _describe_motion(motion),
        "treatment": str(case.chattering),
        **{name: getattr(response, name) for name in _RESPONSE_PROPERTIES},
        "peak_over_slenderness": round_ratio(response),
        "impacts": len(response.impacts),
        "rests": int(np.sum(response.events["kind"] == "rest")),
        "proven": int(np.sum(~np.isnan(response.sequences["upper"]))),
        "share_at_rest": 0.0 if share < _MIN_SHARE else share,
        "verdict": describe_outcome(response),
        "window": {
            "from": start, "to": end if end > start else start + 1.0, "impacts": len(impact_times),
            "unresolved": max(find_unresolved(response, start, end), default=None),
        },
    }  # fmt: skip
    arrays = {**_sample_window(case, resolved, start, end, impact_times), **sample_events(response)}
    return Payload(header, arrays | ({} if outline is None else {"outline": outline.ravel()}))


def describe_outcome(response: Response) -> str:
    """Describe the outcome in one sentence; a small change of the motion does not change it unless it is undecided."""
    perturbed, ratio = response.perturbed(), round_ratio(response)
    text = format_outcome(response, f"{response.tipping_time:.2f} s, and lies flat at {response.overturn_time:.2f} s")
    if not perturbed.is_decided:
        text = perturbed.describe_outcome()
    elif response.moved and not (response.overturned or response.unfinished or response.ended_early):
        # Two digits, or four near 100 %, where they matter.
        text = f"It {text}: it reaches {100.0 * ratio:.{2 if ratio < 0.99 else 4}g} % of the overturning rotation"
    elif not (response.unfinished or response.ended_early):
        text = f"It {text}"
    return f"{text[0].upper()}{text[1:]}."


def describe_details(simulated_case: SimulatedCase, window: tuple[float, float] | None) -> Payload:
    """Return the phase plane, the energy and the ground displacement in a window (s); times count from its start."""
    response, start, end = simulated_case.resolve_window(window)
    course = sample_interval(response, start, end)
    x, y = compute_boundary(response)
    times = np.linspace(start, end, MAX_POINTS // 4)
    ground = None if simulated_case.case.motion is None else simulated_case.case.motion.with_vertical(None)
    if ground is not None and has_drift(ground):
        ground = ground.processed(baseline=1, band_pass=(1.0 / MAX_DRAWN_PERIOD, None))
    displacements = np.zeros_like(times) if ground is None else ground.displacement(np.minimum(times, ground.duration))
    arrays = {
        "course_time": course.time - start, "course_rotation": course.rotation, "course_velocity": course.velocity,
        "kinetic": course.kinetic, "potential": course.potential, "jump": course.impact_rows.astype(float),
        "boundary_x": x, "boundary_y": y, "displacement_time": times - start, "displacement": displacements,
        **{f"course_{kind}": instants - start for kind, instants in find_event_times(response, start, end).items()}
    }  # fmt: skip
    return Payload({"from": start, "needed": response._energy.overturning_energy.tolist()}, arrays)


def find_state(simulated_case: SimulatedCase, time: str, window: tuple[float, float] | None) -> dict[str, Any]:
    """Return the state at a time (text), in the response of a window (s)."""
    value, duration = read_duration(time, "at"), simulated_case.response.duration
    if not 0.0 <= value <= duration:
        message = f"{{}} must be within the response, from 0 to {duration:.6g} s, not {value:g} s"
        raise OptionError(message, "at", value=time)
    response, *_ = simulated_case.resolve_window(window)
    rotation, velocity, _ = response.states(value).tolist()
    motion = simulated_case.case.motion
    components = {"ground_g": motion, "vertical_g": None if motion is None else motion.vertical}
    return {
        "time": value,
        "rotation": rotation,
        "over_slenderness": rotation / simulated_case.case.block.sides[0 if rotation >= 0.0 else 1].alpha,
        "velocity": velocity,
        "energy": float(response.kinetic_energy(value) + response.potential_energy(value)),
        "slip": float(response.slip(value)) if response.friction is not None else None,
        **{
            name: None if part is None else float(clear_rounding(part.acceleration(value), part.pga)) / STANDARD_GRAVITY
            for name, part in components.items()
        },
    }


@functools.lru_cache(maxsize=4)
def _describe_motion(motion: Motion) -> dict[str, Any]:
    """Return facts on a motion, cached while only the block changes."""
    return {
        "name": motion.name,
        "duration": motion.duration,
        "pga_g": motion.pga / STANDARD_GRAVITY,
        "vertical": motion.vertical and {"name": motion.vertical.name, "pga_g": motion.vertical.pga / STANDARD_GRAVITY},
        "notes": list(list_motion_notes(motion)),
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


def _sample_window(case: Case, response: Response, start: float, end: float, impacts: Floats) -> dict[str, Floats]:
    """Return the lines in a window; times count from its start to keep their precision in narrow windows."""
    marks = impacts if len(impacts) <= _MAX_MARKS else impacts[:: math.ceil(len(impacts) / _MAX_MARKS)]
    times = np.sort(np.concatenate([np.linspace(start, end, _MAX_TIMES), marks]), kind="stable")
    times = times[np.diff(times, prepend=-math.inf) > 0.0]
    rotation = response.rotation(times)
    indices = thin_line(rotation, MAX_POINTS)
    slip = {} if response.friction is None else {"slip": response.slip(times[indices])}
    return {
        "time": times[indices] - start,
        "rotation": rotation[indices],
        "impact": marks - start,
        **slip,
        **_sample_ground_acceleration(case, start, end, MAX_POINTS),
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
    corners = motion.choose_drawing_times(start, min(end, max(start, motion_end)))
    acceleration = clear_rounding(motion.acceleration(corners), motion.pga) / STANDARD_GRAVITY
    if motion.vertical is None:
        indices = thin_line(acceleration, points)
        return {"ground_time": corners[indices] - start, "ground_g": acceleration[indices]}
    weight = 1.0 + motion.vertical.acceleration(corners) / case.block.gravity
    plus, minus = (threshold / STANDARD_GRAVITY for threshold in case.block.uplift_thresholds(case.model))
    excesses = (-acceleration - plus * weight, acceleration - minus * weight)
    indices = np.unique(np.concatenate([thin_line(line, points) for line in (acceleration, weight, *excesses)]))
    return {"ground_time": corners[indices] - start, "ground_g": acceleration[indices], "weight": weight[indices]}


def sample_events(response: Response) -> dict[str, Floats]:
    """Return the lines common to all windows: impacts, rests, uplifts, chattering sequences."""
    sequences = response.sequences
    columns = [np.asarray(sequences[name], dtype=float) for name in ("start", "end", "lower", "upper", "impacts")]
    columns.append(_find_rest_spreads(response))
    return {
        "impact_time": np.asarray(response.impacts["time"], dtype=float),
        "rest": response.rest_intervals.ravel(),
        "uplift": np.asarray(response.events["time"][response.events["kind"] == "uplift"], dtype=float),
        "sequence": np.column_stack(columns).ravel(),
    }


def _find_rest_spreads(response: Response) -> Floats:
    """Return the spread of each sequence's rest in the repeated simulations, s; NaN if missing in one of them."""
    if not len(response.sequences):
        return np.empty(0)
    rests = np.searchsorted(response.events["time"], response.sequences["end"])
    spreads = response.perturbed().event_spreads[rests]
    return np.where(spreads > response.duration, math.inf, spreads)  # undetermined
