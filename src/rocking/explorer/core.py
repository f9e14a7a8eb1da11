"""From a case, or two beside each other, to what a page shows: arrays, numbers and words. It knows no web."""

from __future__ import annotations

import math
import sys
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.tables import named
from rocking.errors import InvalidBlock, InvalidOption
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.inputs import read_case
from rocking.explorer.meshes import described
from rocking.explorer.parameters import Texts, names_of
from rocking.explorer.payload import Payload
from rocking.explorer.simulated import Simulated, facts
from rocking.explorer.uploads import UploadStore
from rocking.explorer.windows import (
    POINTS,
    about_window,
    begun_window,
    checked_window,
    ends_of,
    ground_in,
    lines_in,
    lines_of,
)
from rocking.motion.measures import significant_span
from rocking.response import Response, active_span


def _begun(response: Response) -> float:
    motion = response.motion
    found = math.nan if motion is None else significant_span(motion, start=0.05)[0]
    return 0.0 if math.isnan(found) else found


def _lifted(response: Response) -> float:
    times = response.events["time"][response.events["kind"] == "uplift"]
    return float(times[0]) if len(times) else 0.0


#: Moments, s, that are laid over each other; 0 where a response has no such one.
ALIGNED: Final[Mapping[str, Callable[[Response], float]]] = {
    "start": lambda _: 0.0,
    "uplift": _lifted,
    "arias": _begun,
}


def shift_of(first: Response, second: Response, align: str) -> float:
    """Return by how much later, s, the second is drawn than it happens, for the chosen moments to coincide.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> first, second = (rocking.simulate(block, rocking.pulses.sine(3.0, f, cycles=2)) for f in (1.0, 2.0))
    >>> f"{shift_of(first, second, 'uplift'):.4f}"
    '0.0632'
    """
    moment = ALIGNED[checks.one_of(align, "align", InvalidOption, list(ALIGNED))]
    return moment(first) - moment(second)


def as_csv(responses: Mapping[str, Response], shift: float) -> str:
    """Return the histories of two responses below each other, each under its name, in its own time and the common one.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> response = rocking.simulate(block, rocking.pulses.sine(3.0, 1.0, cycles=1))
    >>> as_csv({"one": response, "other": response}, 2.0).splitlines()[0]
    'case,common_time_s,time_s,rotation_rad,angular_velocity_rad_s,ground_acceleration_m_s2'
    """
    import pandas as pd

    frames = []
    for (name, response), later in zip(responses.items(), (0.0, shift), strict=True):
        frame = response.to_dataframe("histories").reset_index()
        frame.insert(0, named("common_time", "s"), frame[named("time", "s")] + later)
        frame.insert(0, "case", name)
        frames.append(frame)
    return str(pd.concat(frames).to_csv(index=False))


#: Responses that are kept; their steps and the samples of their motions, some hundreds of MB at most.
_KEPT: Final = 48
_KEPT_ROWS: Final = 2_000_000

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
                uploads.remove(key)
                raise
            return found

    def forget(self, key: str) -> dict[str, int]:
        """Forget a file with the responses that are of it, and say how many files are kept."""
        self.uploads.remove(key)
        with self._lock:
            for case in [case for case in self._kept if any(f"file:{key}" in text for _, text in case)]:
                del self._kept[case]
        return self.uploads.usage()

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
            while len(self._kept) > 1 and (len(self._kept) > _KEPT or self._rows() > _KEPT_ROWS):
                self._kept.popitem(last=False)
        return shown

    def case(self, texts: Texts, window: tuple[float, float] | None = None) -> Payload:
        """Return all that the page says of a case, and its arrays in a window (s; by default where it moves)."""
        shown = self.show(texts)
        response = shown.response
        window = begun_window(window, response.duration)
        start, end = active_span(response) if window is None else checked_window(window, response.duration)
        header = {**facts(shown), "window": about_window(shown, start, end)}
        profile = {} if shown.outline is None else {"profile": shown.outline.ravel()}
        return Payload(header, {**lines_in(shown, start, end), **lines_of(response), **profile})

    def window(
        self, texts: Texts, window: tuple[float, float], *, ground: bool = False, points: int = POINTS
    ) -> Payload:
        """Return the arrays of a window (s), evaluated anew; with those of the ground's displacement."""
        shown = self.show(texts)
        start, end = checked_window(window, shown.response.duration)
        arrays = lines_in(shown, start, end, min(max(points, 2), POINTS))
        if ground:
            arrays |= ground_in(shown, start, end)
        return Payload({"window": about_window(shown, start, end)}, arrays)

    def compare(
        self,
        texts: Texts,
        changed: Texts,
        window: tuple[float, float] | None = None,
        *,
        align: str = "start",
        whole: bool = False,
    ) -> Payload:
        """Return two cases in one window, with chosen moments over each other; the second is ``whole`` or changed."""
        first, second = self._compared(texts, changed, whole=whole)
        shift = shift_of(first.response, second.response, align)
        spans = [active_span(first.response), tuple(end + shift for end in active_span(second.response))]
        longest = max(first.response.duration, second.response.duration + shift)
        window = begun_window(window, longest)
        if window is None:
            start, end = max(0.0, min(span[0] for span in spans)), max(span[1] for span in spans)
        else:
            start, end = checked_window(window, longest)
        header: dict[str, Any] = {"window": ends_of(start, end), "duration": longest, "shift": shift, "cases": []}
        arrays: dict[str, Floats] = {}
        for name, shown, by in (("first", first, 0.0), ("second", second, shift)):
            header["cases"].append(facts(shown))
            begin, stop = max(start - by, 0.0), min(end - by, shown.response.duration)
            if begin < stop:
                here = lines_in(shown, begin, stop)
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
        # A spreadsheet takes no name for a formula.
        # A formula of a spreadsheet begins so.
        one, other = (f"'{name}" if name.startswith(("=", "+", "-", "@", "\t", "\r")) else name for name in names)
        other = f"{other} (other)" if one == other else other
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
                shown = None if window is None else checked_window(window, response.duration)
                with self._drawing:
                    from matplotlib import rc_context

                    figure = response.plot(window=shown, longest_sequence=bool(len(response.chattering)))
                    with rc_context({"svg.hashsalt": "rocking"}):
                        figure.savefig(file, dpi=160)
                    if "matplotlib.pyplot" in sys.modules:
                        sys.modules["matplotlib.pyplot"].close(figure)
            return file.read_bytes()

    def _rows(self) -> int:
        """Return the steps of all responses that are kept, and the samples of their motions, which many may share."""
        motions = {}
        for shown in self._kept.values():
            for motion in (shown.case.motion, shown.case.motion and shown.case.motion.vertical):
                if motion is not None:
                    motions[id(motion)] = len(motion.breakpoints)
        return sum(motions.values()) + sum(len(shown.response.solution.trail.nodes) for shown in self._kept.values())


def _changed(texts: Texts, changed: Texts) -> dict[str, str]:
    """Texts of a case with others in their place; a block's, or a motion's and its start's, go together."""
    together = [(names_of("block"), names_of("block")), (names_of("motion"), names_of("motion", "start"))]
    gone = {name for given, names in together if changed.keys() & {*given} for name in names}
    return {name: value for name, value in texts.items() if name not in gone} | dict(changed)
