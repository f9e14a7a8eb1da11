"""Arrays, numbers and words that the page shows for one or two cases, independent of the web."""

from __future__ import annotations

import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rocking.core.arrays import Floats
from rocking.errors import InvalidBlock, InvalidOption
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.inputs import read_case
from rocking.explorer.meshes import described
from rocking.explorer.parameters import Texts, names_of
from rocking.explorer.payload import Payload
from rocking.explorer.simulated import (
    POINTS,
    Simulated,
    about_window,
    checked_window,
    ends_of,
    facts,
    ground_in,
    lines_in,
    lines_of,
    shown_window,
)
from rocking.explorer.uploads import Recent, UploadStore
from rocking.response import active_span

#: Number of stored responses, and maximum size of their steps and motions, some hundreds of MB.
_KEPT: Final = 48
_KEPT_ROWS: Final = 2_000_000

#: File formats of figures and tables, and their content types.
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
    """Cases by their texts, with a thread-safe cache of the last responses.

    Examples
    --------
    >>> explorer = Explorer()
    >>> payload = explorer.case({"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"})
    >>> payload.header["verdict"]["phrase"], payload.header["verdict"]["values"]["resting"]
    ('verdict.stays', {'phrase': 'verdict.rests', 'values': {'count': 1}})
    """

    def __init__(self) -> None:
        self.uploads = UploadStore()
        self._drawing = threading.Lock()
        self._kept = Recent[Simulated](_KEPT_ROWS, _rows)

    def take_record(self, name: str, data: bytes) -> dict[str, Any]:
        """Store a record file, and return its description."""
        return self.uploads.take(name, data)

    def take_mesh(self, name: str, data: bytes) -> dict[str, Any]:
        """Store a mesh, and return the direction of first uplift, or an error that the user may correct."""
        uploads = self.uploads
        key = uploads.add_mesh(name, data)
        found = {"key": key, "name": uploads.file(key).name, "azimuth": 0.0}
        try:
            return found | {"azimuth": uploads.body(f"file:{key}", {}, None, None).solid.weakest_azimuth}
        except InvalidBlock as error:
            if error.argument is None:
                uploads.remove(key)
                raise
            return found

    def forget(self, key: str) -> dict[str, int]:
        """Remove a file and its responses, and return the number of remaining files."""
        self.uploads.remove(key)
        self._kept.forget(f"file:{key}")
        return self.uploads.usage()

    def show(self, texts: Texts) -> Simulated:
        """Return a case with its response."""

        def simulated() -> Simulated:
            case = read_case(texts, self.uploads)
            return Simulated(case, case.simulate())

        return self._kept.get(tuple(sorted(f"{name}={value}" for name, value in texts.items() if value)), simulated)

    def case(self, texts: Texts, window: tuple[float, float] | None = None) -> Payload:
        """Return all words on a case, and its arrays in a window (s; by default the time of its motion)."""
        shown = self.show(texts)
        response = shown.response
        start, end = shown_window(window, response.duration, active_span(response))
        header = {**facts(shown), "window": about_window(shown, start, end)}
        profile = {} if shown.outline is None else {"profile": shown.outline.ravel()}
        return Payload(header, {**lines_in(shown, start, end), **lines_of(response), **profile})

    def window(
        self, texts: Texts, window: tuple[float, float], *, ground: bool = False, points: int = POINTS
    ) -> Payload:
        """Return the newly evaluated arrays of a window (s), with the ground displacement."""
        shown = self.show(texts)
        start, end = checked_window(window, shown.response.duration)
        arrays = lines_in(shown, start, end, min(max(points, 2), POINTS))
        if ground:
            arrays |= ground_in(shown, start, end)
        return Payload({"window": about_window(shown, start, end)}, arrays)

    def compare(
        self, texts: Texts, changed: Texts, window: tuple[float, float] | None = None, *, whole: bool = False
    ) -> Payload:
        """Return two cases in one window; the second is ``whole``, or the first with some texts changed."""
        first = self.show(texts)
        both = {"first": first, "second": self.show(changed if whole else _changed(first.case.texts, changed))}
        longest = max(shown.response.duration for shown in both.values())
        starts, ends = zip(*(active_span(shown.response) for shown in both.values()), strict=True)
        start, end = shown_window(window, longest, (min(starts), max(ends)))
        header = {"window": ends_of(start, end), "duration": longest, "cases": [facts(each) for each in both.values()]}
        arrays: dict[str, Floats] = {}
        for name, shown in both.items():
            stop = min(end, shown.response.duration)
            if start < stop:
                arrays |= {f"{name}_{key}": values for key, values in lines_in(shown, start, stop).items()}
            arrays[f"{name}_rest"] = shown.response.rest_intervals.ravel()
        return Payload(header, arrays)

    def body(self, texts: Texts) -> Payload:
        """Return plan, resistance in every direction, and words for the body of a mesh."""
        case = self.show(texts).case
        if case.body is None:
            raise InvalidOption("this block is of no {}: open one", "mesh")
        return described(case.body, case.azimuth)

    def summary(self, texts: Texts) -> list[tuple[str, str]]:
        """Return the summary of a response as rows of label and value."""
        return [(row.name, row.text) for row in self.show(texts).response.summary_rows()]

    def code(self, texts: Texts) -> dict[str, str | None]:
        """Return a case as Python, and as a command if the command line supports it."""
        case = self.show(texts).case
        return {"python": case_as_python(case), "command": case_as_command(case)}

    def export(self, texts: Texts, form: str, window: tuple[float, float] | None = None) -> bytes:
        """Return a response as the content of a file in one of `EXPORTS`; a figure shows a window (s)."""
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

                    figure = response.plot(window=shown, longest_sequence=bool(len(response.sequences)))
                    with rc_context({"svg.hashsalt": "rocking"}):
                        figure.savefig(file, dpi=160)
                    if "matplotlib.pyplot" in sys.modules:
                        sys.modules["matplotlib.pyplot"].close(figure)
            return file.read_bytes()


def _rows(shown: Simulated) -> int:
    """Return the steps of a response and the samples of its motion, at least its share of `_KEPT` responses."""
    motion = shown.case.motion
    samples = 0 if motion is None else len(motion.breakpoints) * (1 if motion.vertical is None else 2)
    return max(samples + len(shown.response.solution.trail.nodes), _KEPT_ROWS // _KEPT)


def _changed(texts: Texts, changed: Texts) -> dict[str, str]:
    """Return the texts of a case with replacements. Texts of a block, or of motion and start, are replaced together."""
    together = [(names_of("block"), names_of("block")), (names_of("motion"), names_of("motion", "start"))]
    gone = {name for given, names in together if changed.keys() & {*given} for name in names}
    return {name: value for name, value in texts.items() if name not in gone} | dict(changed)
