"""From a case to what a page shows: arrays, numbers and words. It knows no web."""

from __future__ import annotations

import functools
import math
import sys
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.block import Block
from rocking.chattering.episodes import chattering_episodes
from rocking.constants import STANDARD_GRAVITY
from rocking.dynamics.schemes import TREATMENTS, compare_schemes
from rocking.errors import InvalidBlock, InvalidOption
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.comparing import as_csv, shift_of
from rocking.explorer.inputs import Case, Texts, read_case
from rocking.explorer.meshes import described
from rocking.explorer.parameters import names_of
from rocking.explorer.payload import Payload
from rocking.explorer.phrases import phrase
from rocking.explorer.uploads import UploadStore
from rocking.motion.motion import Motion
from rocking.plausibility import block_notes, motion_notes
from rocking.response import Response, active_span, in_words, trail_of
from rocking.response.sensitivity import KNOWN, driving
from rocking.treatment import Certified

#: Times at which a rotation is evaluated across a window, and points of a line that are sent.
_TIMES: Final = 12_000
_POINTS: Final = 3_000

#: Narrowest window, s: times have no more digits; and what is shown of a response that lasts no time.
_NARROWEST: Final = 1e-12
_OF_NOTHING: Final = 1.0

#: Impacts of a window whose times are added to the line's.
_MARKED: Final = 2_000

#: Bracket on a time of rest, s, with which impacts are resolved for a window close to it: some nanoseconds are left.
_FINEST: Final = Certified(1e-40)

#: A stretch without resolved impacts is seen where it is longer than this part of a window.
_SEEN: Final = 1e-3

#: Responses that are kept, and steps in all of them: a hundred MB at most.
_KEPT: Final = 48
_KEPT_STEPS: Final = 2_000_000

#: Ground motion of longer periods than this (s) is not drawn where a record's baseline would drift.
_LONGEST_PERIOD: Final = 10.0

#: What a figure or a table can be written as, and the type of its content.
EXPORTS: Final[Mapping[str, str]] = {
    "svg": "image/svg+xml",
    "png": "image/png",
    "csv": "text/csv; charset=utf-8",
    "events.csv": "text/csv; charset=utf-8",
    "impacts.csv": "text/csv; charset=utf-8",
    "nc": "application/x-netcdf",
}
_TABLES: Final[Mapping[str, Any]] = {"csv": "histories", "events.csv": "events", "impacts.csv": "impacts"}


@dataclass(frozen=True, eq=False)
class Simulated:
    """A case with its response, and what is made of it when it is first asked for."""

    case: Case
    response: Response

    @functools.cached_property
    def fine(self) -> Response:
        """The same response with more impacts resolved before each proven rest."""
        if self.case.treatment.name != _FINEST.name:
            return self.response
        fine = replace(self.case, treatment=_FINEST).simulate()
        return fine if fine.stalled == self.response.stalled else self.response

    def resolved(self, start: float, end: float) -> Response:
        """Return the response whose impacts are resolved as far as a window shows."""
        for unresolved in _unresolved(self.response, start, end):
            if unresolved > _SEEN * (end - start):
                return self.fine
        return self.response

    @functools.cached_property
    def outline(self) -> Floats | None:
        """Trapezoids of the outline of a mesh, in the plane in which it rocks; None of another block."""
        return None if self.case.body is None else self.case.body.across(self.case.azimuth)

    @functools.cached_property
    def ground(self) -> Motion | None:
        """The motion whose displacement is drawn."""
        return None if self.case.motion is None else _steady(self.case.motion)


class Explorer:
    """Cases by their texts; keeps the last responses. Safe to use from several threads.

    Examples
    --------
    >>> explorer = Explorer()
    >>> payload = explorer.case({"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"})
    >>> payload.header["verdict"]["phrase"], payload.header["verdict"]["values"]["resting"]
    ('verdict.stays', {'phrase': 'verdict.rests', 'values': {'count': 1}})
    """

    def __init__(self) -> None:
        self.uploads = UploadStore()
        self._lock = threading.Lock()
        self._drawing = threading.Lock()
        self._kept: OrderedDict[tuple[tuple[str, str], ...], Simulated] = OrderedDict()

    def take_record(self, name: str, data: bytes) -> dict[str, Any]:
        """Keep a record file, and say what it is."""
        return self.uploads.take(name, data)

    def take_mesh(self, name: str, data: bytes) -> dict[str, Any]:
        """Keep a mesh, and say in which direction its body is lifted first; or what is wrong and may be corrected."""
        uploads = self.uploads
        key = uploads.add_mesh(name, data)
        found = {"key": key, "name": uploads.file(key).name, "azimuth": 0.0}
        try:
            return found | {"azimuth": uploads.meshes.body(f"file:{key}", {}, None, None).solid.weakest_azimuth}
        except InvalidBlock as error:
            if error.argument is None:
                raise
            return found

    def show(self, texts: Texts) -> Simulated:
        """Return a case with its response."""
        key = tuple(sorted((name, value) for name, value in texts.items() if value))
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        case = read_case(texts, self.uploads)
        shown = Simulated(case, case.simulate())
        with self._lock:
            self._kept[key] = shown
            while len(self._kept) > 1 and (len(self._kept) > _KEPT or self._steps() > _KEPT_STEPS):
                self._kept.popitem(last=False)
        return shown

    def case(self, texts: Texts, window: tuple[float, float] | None = None) -> Payload:
        """Return all that the page says of a case, and its arrays in a window (s; by default where it moves)."""
        shown = self.show(texts)
        response = shown.response
        start, end = active_span(response) if window is None else checked_window(window, response.duration)
        header = {**_facts(shown), "window": _window(shown, start, end)}
        profile = {} if shown.outline is None else {"profile": shown.outline.ravel()}
        return Payload(header, {**_window_arrays(shown, start, end), **_whole_arrays(response), **profile})

    def window(
        self, texts: Texts, window: tuple[float, float], *, ground: bool = False, points: int = _POINTS
    ) -> Payload:
        """Return the arrays of a window (s), evaluated anew; with those of the ground's displacement."""
        shown = self.show(texts)
        start, end = checked_window(window, shown.response.duration)
        arrays = _window_arrays(shown, start, end, min(max(points, 2), _POINTS))
        if ground:
            arrays |= _ground_arrays(shown, start, end)
        return Payload({"window": _window(shown, start, end)}, arrays)

    def compare(
        self,
        texts: Texts,
        changed: Texts,
        window: tuple[float, float] | None = None,
        *,
        align: str = "start",
        whole: bool = False,
    ) -> Payload:
        """Return two cases in one window of the first one's time, with chosen moments over each other (`ALIGNED`).

        The second is another case as a ``whole``, or the first with some texts changed; blocks and motions go together.
        """
        first, second = self._compared(texts, changed, whole=whole)
        shift = shift_of(first.response, second.response, align)
        spans = [active_span(first.response), tuple(end + shift for end in active_span(second.response))]
        longest = max(first.response.duration, second.response.duration + shift)
        if window is None:
            start, end = max(0.0, min(span[0] for span in spans)), max(span[1] for span in spans)
        else:
            start, end = checked_window(window, longest)
        header: dict[str, Any] = {"window": _ends(start, end), "duration": longest, "shift": shift, "cases": []}
        arrays: dict[str, Floats] = {}
        for name, shown, by in (("first", first, 0.0), ("second", second, shift)):
            header["cases"].append(_facts(shown))
            begin, stop = max(start - by, 0.0), min(end - by, shown.response.duration)
            if begin < stop:
                here = _window_arrays(shown, begin, stop)
                for key in ("time", "impact", "ground_time"):
                    here[key] += begin + by - start
                arrays |= {f"{name}_{key}": values for key, values in here.items()}
            arrays[f"{name}_rest"] = shown.response.rest_intervals.ravel() + by
        return Payload(header, arrays)

    def body(self, texts: Texts) -> Payload:
        """Return what is shown of the body of a mesh: its plan, its resistance in every direction, and words."""
        case = self.show(texts).case
        if case.body is None:
            raise InvalidOption("this block is of no {}: open one", "mesh")
        return described(case.body, case.azimuth)

    def compared_as_csv(
        self, texts: Texts, changed: Texts, names: tuple[str, str], *, align: str = "start", whole: bool = False
    ) -> bytes:
        """Return the histories of two cases as one table, each under its name."""
        first, second = (shown.response for shown in self._compared(texts, changed, whole=whole))
        one, other = names if names[0] != names[1] else (names[0], f"{names[1]} (other)")
        return as_csv({one: first, other: second}, shift_of(first, second, align)).encode()

    def _compared(self, texts: Texts, changed: Texts, *, whole: bool) -> tuple[Simulated, Simulated]:
        first = self.show(texts)
        return first, self.show(changed if whole else _changed(first.case.texts, changed))

    def summary(self, texts: Texts) -> list[tuple[str, str]]:
        """Return the summary of a response row by row: what, and how much."""
        return [(row.name, row.text) for row in self.show(texts).response.summary_rows()]

    def code(self, texts: Texts) -> dict[str, str | None]:
        """Return a case as Python, and as a command where the command line does it."""
        case = self.show(texts).case
        return {"python": case_as_python(case), "command": case_as_command(case)}

    def schemes(self, texts: Texts) -> list[dict[str, Any]]:
        """Return what each treatment of chattering makes of a case, against the proven response."""
        case = self.show(texts).case
        start: dict[str, Any] = {"initial_position": case.initial_rotation, "initial_velocity": case.initial_velocity}
        start["duration"] = case.duration
        found = compare_schemes(case.block, case.motion, schemes=TREATMENTS, model=case.model, **start)
        rows = [(each.scheme, each.is_right, each.verdict, each.largest_error) for each in found.outcomes]
        unfit = [(scheme, None, reason, None) for scheme, reason in found.not_applicable]
        return [
            {"text": str(scheme), "right": right, "verdict": words, "error": error}
            for scheme, right, words, error in [*rows, *unfit]
        ]

    def export(self, texts: Texts, form: str, window: tuple[float, float] | None = None) -> bytes:
        """Return a response as the content of a file of one of `EXPORTS`; a figure shows a window (s)."""
        if form not in EXPORTS:
            raise InvalidOption(f"a case is written as one of {', '.join(EXPORTS)}, not {form[:20]!r}")
        response = self.show(texts).response
        with tempfile.TemporaryDirectory(prefix="rocking-") as folder:
            file = Path(folder) / f"response.{form}"
            if form in _TABLES:
                response.to_csv(file, _TABLES[form])
            elif form == "nc":
                response.to_netcdf(file)
            else:
                with self._drawing:
                    _draw(response, file, None if window is None else checked_window(window, response.duration))
            return file.read_bytes()

    def _steps(self) -> int:
        return sum(len(trail_of(shown.response).nodes) for shown in self._kept.values())


def _changed(texts: Texts, changed: Texts) -> dict[str, str]:
    """Texts of a case with others in their place; those of a whole block or motion go together."""
    groups = [group for group in (names_of("block"), names_of("motion")) if changed.keys() & {*group}]
    gone = {name for group in groups for name in group}
    return {name: value for name, value in texts.items() if name not in gone} | dict(changed)


def _window(shown: Simulated, start: float, end: float) -> dict[str, Any]:
    """Say what a window shows: its ends, how many impacts, and how long before a rest the last one is, s."""
    response = shown.resolved(start, end)
    times = response.impacts["time"]
    count = np.searchsorted(times, end, "right") - np.searchsorted(times, start, "left")
    left = [each for each in _unresolved(response, start, end) if each > _SEEN * (end - start)]
    return {**_ends(start, end), "impacts": int(count), "unresolved": max(left, default=None)}


def _ends(start: float, end: float) -> dict[str, float]:
    return {"from": start, "to": end if end > start else start + _OF_NOTHING}


def _unresolved(response: Response, start: float, end: float) -> list[float]:
    """Return the times, s, from the last resolved impact to the rest, of sequences that end so in a window."""
    ends = np.asarray(response.chattering["end"], dtype=float)
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    last = impact_times[np.searchsorted(impact_times, ends, side="right") - 1]
    seen = (ends > start) & (last < end)
    return [float(each) for each in (ends - last)[seen]]


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
    rows = np.pad(values, (0, -len(values) % width), mode="edge").reshape(-1, width)
    starts = width * np.arange(len(rows))
    kept: Integers = np.union1d(starts + rows.argmin(axis=1), starts + rows.argmax(axis=1))
    return np.minimum(kept, len(values) - 1)


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


def _window_arrays(shown: Simulated, start: float, end: float, points: int = _POINTS) -> dict[str, Floats]:
    """Lines in a window; times count from its start, so that they keep their digits however narrow it is."""
    response = shown.resolved(start, end)
    impact_times = response.impacts["time"]
    inside = impact_times[(impact_times >= start) & (impact_times <= end)]
    marked = inside if len(inside) <= _MARKED else inside[:: math.ceil(len(inside) / _MARKED)]
    times = np.union1d(np.linspace(start, end, min(_TIMES, 4 * points)), marked)
    rotation = response.rotation(times)
    kept = extremes(rotation, points)
    return {
        "time": times[kept] - start,
        "rotation": rotation[kept],
        "impact": marked - start,
        **_shaking(shown.case, start, end, points),
    }


def _shaking(case: Case, start: float, end: float, points: int) -> dict[str, Floats]:
    """Ground acceleration in a window, g; with a vertical component, the weight, by which thresholds are multiplied.

    A g is the standard one, as in every text of a case, whatever gravity the block has.
    """
    motion = case.motion
    if motion is None:
        return {"ground_time": np.empty(0), "ground_g": np.empty(0)}
    last = motion.duration if motion.vertical is None else max(motion.duration, motion.vertical.duration)
    corners = motion.drawing_times(start, min(end, max(start, last)))
    acceleration = motion.acceleration(corners) / STANDARD_GRAVITY
    if motion.vertical is None:
        kept = extremes(acceleration, points)
        return {"ground_time": corners[kept] - start, "ground_g": acceleration[kept]}
    weight = 1.0 + motion.vertical.acceleration(corners) / case.block.gravity
    plus, minus = (threshold / STANDARD_GRAVITY for threshold in case.block.uplift_thresholds(case.model))
    beyond = (-acceleration - plus * weight, acceleration - minus * weight)
    kept = np.unique(np.concatenate([extremes(each, points) for each in (acceleration, weight, *beyond)]))
    return {"ground_time": corners[kept] - start, "ground_g": acceleration[kept], "weight": weight[kept]}


def _ground_arrays(shown: Simulated, start: float, end: float) -> dict[str, Floats]:
    times = np.linspace(start, end, _POINTS // 4)
    ground = shown.ground
    moved = np.zeros_like(times) if ground is None else ground.displacement(np.minimum(times, ground.duration))
    return {"displacement_time": times - start, "displacement": moved}


def _whole_arrays(response: Response) -> dict[str, Floats]:
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
    """Return by how much the rest of each sequence moves if what drives the block is off by a millionth, s."""
    if not len(response.chattering):
        return np.empty(0)
    changes = driving(response.sensitivity)[1]
    rests = np.searchsorted(response.events["time"], response.chattering["end"])
    return KNOWN * changes[rests]


def _intervals(response: Response) -> tuple[Floats, Floats]:
    """Time from each impact to the next of the same rocking, and the ratio of the next interval but one to it; or NaN.

    Where chattering is complete the ratio tends to the product of both restitutions: eta^2.
    """
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    intervals = np.append(np.diff(impact_times), np.nan)[: len(impact_times)]
    uplifts = response.events["time"][response.events["kind"] == "uplift"]
    rocking = np.searchsorted(uplifts, impact_times, side="right")
    intervals[np.flatnonzero(np.diff(rocking))] = np.nan
    ratios = np.full(len(impact_times), np.nan)
    positive = np.where(intervals > 0.0, intervals, np.nan)
    ratios[:-2] = positive[2:] / positive[:-2]
    return intervals, ratios


def _facts(shown: Simulated) -> dict[str, Any]:
    case, response = shown.case, shown.response
    block, motion = case.block, case.motion
    episodes = chattering_episodes(response)
    return {
        "block": {
            "description": block.description,
            "sides": [vars(side) for side in block.sides],
            "symmetric": block.is_symmetric,
            "thresholds_g": [each / STANDARD_GRAVITY for each in block.uplift_thresholds(case.model)],
            "gravity_g": block.gravity / STANDARD_GRAVITY,
            "outline": _outline(block, shown.outline),
            "notes": [*map(str, block_notes(block)), *(case.body.solid.notes if case.body else ())],
            "body": None if case.body is None else case.body.plane(case.azimuth),
        },
        "motion": None if motion is None else _motion_facts(motion),
        "model": case.model,
        "treatment": str(case.treatment),
        "duration": response.duration,
        "overturned": response.overturned,
        "unfinished": response.unfinished,
        "overturn_time": response.overturn_time,
        "tipping_time": response.tipping_time,
        "peak_rotation": response.peak_rotation,
        "peak_over_slenderness": response.peak_over_slenderness,
        "peak_time": response.peak_time,
        "impacts": len(response.impacts),
        "rests": int(np.sum(response.events["kind"] == "rest")),
        "proven": int(np.sum(np.isfinite(response.chattering["upper"]))),
        "time_at_rest": response.time_at_rest,
        "share_at_rest": episodes.share_at_rest,
        "eta_squared": math.prod(side.restitution for side in block.sides),
        "verdict": verdict(response, block.uplift_thresholds(case.model)),
    }


def verdict(response: Response, thresholds: tuple[float, float]) -> dict[str, Any] | str:
    """Say in one sentence what becomes of a block lifted by these accelerations (m/s^2): first whether it falls."""
    if response.stopped:
        words = in_words(response, "")
        return f"{words[0].upper()}{words[1:]}."
    if not len(response.events) and not len(response.impacts) and response.peak_rotation == 0.0:
        if response.motion is None:
            return phrase("verdict.still")
        if response.motion.vertical is not None:
            return phrase("verdict.unlifted")
        return phrase("verdict.below", lifting=min(thresholds))
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
    unproven = rests - int(np.sum(np.isfinite(response.chattering["upper"])))
    resting = phrase("verdict.rests", count=rests) if rests else phrase("verdict.no_rest")
    if unproven:
        resting = phrase("verdict.unproven", rests=resting, unproven=unproven)
    return phrase("verdict.stays", share=_percent(response.peak_over_slenderness), resting=resting)


def _percent(share: float) -> dict[str, Any]:
    """Write a share in percent: two digits, and four about the whole, where they decide."""
    value = 100.0 * share
    return phrase("verdict.percent", value=value) if share < 0.99 else phrase("verdict.near_percent", value=value)


@functools.lru_cache(maxsize=4)
def _motion_facts(motion: Motion) -> dict[str, Any]:
    """Say what a motion is, found once while only the block is changed."""
    return {
        "name": motion.name,
        "duration": motion.duration,
        "pga_g": motion.pga / STANDARD_GRAVITY,
        "vertical": motion.vertical and {"name": motion.vertical.name, "pga_g": motion.vertical.pga / STANDARD_GRAVITY},
        "notes": list(motion_notes(motion)),
        "filtered": _drifts(motion),
    }


def _outline(block: Block, outline: Floats | None) -> dict[str, Any]:
    """Corners of the block as it stands (m, pivots at height 0), its centre of mass at distance 0, and how far it goes.

    ``outline`` are trapezoids, shape (n, 6), of a body that is no rectangle.
    """
    right, left = (side.radius * math.sin(side.alpha) for side in block.sides)
    heights = [side.radius * math.cos(side.alpha) for side in block.sides]
    centre = 0.5 * (heights[0] + heights[1])
    shape = {"left": left, "right": right, "centre": centre}
    if outline is None:
        return {**shape, "top": 2.0 * centre, "widest": max(left, right)}
    return {**shape, "top": float(outline[:, 1].max()), "widest": float(np.abs(outline[:, 2:]).max())}


def _steady(motion: Motion) -> Motion:
    """Return the horizontal motion, or if it is a record the part of it whose displacement does not drift away."""
    motion = motion.with_vertical(None)
    return motion.processed(baseline=1, band_pass=(1.0 / _LONGEST_PERIOD, None)) if _drifts(motion) else motion


def _drifts(motion: Motion) -> bool:
    """Whether the displacement of a motion is that of a record, and can be filtered."""
    long_enough = motion.step is not None and motion.duration > 2.0 * _LONGEST_PERIOD > 20.0 * motion.step
    return long_enough and motion.coefficients.shape[1] == 2 and not motion.jumps


def _draw(response: Response, file: Path, window: tuple[float, float] | None) -> None:
    from matplotlib import rc_context

    figure = response.plot(window=window, longest_sequence=bool(len(response.chattering)))
    with rc_context({"svg.hashsalt": "rocking"}):
        figure.savefig(file, dpi=160)
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close(figure)
