"""Arrays, numbers and texts of one or two cases on the page, independent of the web."""

from __future__ import annotations

import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rocking.core.arrays import Floats
from rocking.errors import BlockError, OptionError
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.inputs import read_case
from rocking.explorer.meshes import describe_body
from rocking.explorer.parameters import Texts, list_names
from rocking.explorer.payload import Payload
from rocking.explorer.simulated import (
    MAX_POINTS,
    SimulatedCase,
    check_window,
    choose_window,
    describe_case,
    describe_window,
    sample_events,
    sample_ground_displacement,
    sample_window,
    widen_empty_window,
)
from rocking.explorer.uploads import RecentCache, UploadStore
from rocking.response.figure import find_active_span

#: Number of stored responses, and maximum size of their steps and motions, some hundreds of MB.
_MAX_RESPONSES: Final = 48
_MAX_ROWS: Final = 2_000_000

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
        self._simulated = RecentCache[SimulatedCase](_MAX_ROWS, _count_rows)

    def add_record(self, name: str, data: bytes) -> dict[str, Any]:
        """Store a record file, and return its description."""
        return self.uploads.add_and_describe(name, data)

    def add_mesh(self, name: str, data: bytes) -> dict[str, Any]:
        """Store a mesh, and return the direction of first uplift, or an error that the user may correct."""
        uploads = self.uploads
        key = uploads.add_mesh(name, data)
        description = {"key": key, "name": uploads.file(key).name, "azimuth": 0.0}
        try:
            return description | {"azimuth": uploads.body(f"file:{key}", {}, None, None).solid.weakest_azimuth}
        except BlockError as error:
            if error.argument is None:
                uploads.remove(key)
                raise
            return description

    def remove(self, key: str) -> dict[str, int]:
        """Remove a file and its responses, and return the number of remaining files."""
        self.uploads.remove(key)
        self._simulated.remove(f"file:{key}")
        return self.uploads.usage()

    def simulate(self, texts: Texts) -> SimulatedCase:
        """Return a case with its response."""

        def simulate_case() -> SimulatedCase:
            case = read_case(texts, self.uploads)
            return SimulatedCase(case, case.simulate())

        return self._simulated.get(
            tuple(sorted(f"{name}={value}" for name, value in texts.items() if value)), simulate_case
        )

    def case(self, texts: Texts, window: tuple[float, float] | None = None) -> Payload:
        """Return all words on a case, and its arrays in a window (s; by default the time of its motion)."""
        simulated = self.simulate(texts)
        response = simulated.response
        start, end = choose_window(window, response.duration, find_active_span(response))
        header = {**describe_case(simulated), "window": describe_window(simulated, start, end)}
        profile = {} if simulated.outline is None else {"profile": simulated.outline.ravel()}
        return Payload(header, {**sample_window(simulated, start, end), **sample_events(response), **profile})

    def window(
        self, texts: Texts, window: tuple[float, float], *, ground: bool = False, points: int = MAX_POINTS
    ) -> Payload:
        """Return the newly evaluated arrays of a window (s), with the ground displacement."""
        simulated = self.simulate(texts)
        start, end = check_window(window, simulated.response.duration)
        arrays = sample_window(simulated, start, end, min(max(points, 2), MAX_POINTS))
        if ground:
            arrays |= sample_ground_displacement(simulated, start, end)
        return Payload({"window": describe_window(simulated, start, end)}, arrays)

    def compare(
        self, texts: Texts, changed: Texts, window: tuple[float, float] | None = None, *, complete: bool = False
    ) -> Payload:
        """Return two cases in one window; the second is ``complete``, or the first with some texts changed."""
        first = self.simulate(texts)
        cases = {
            "first": first,
            "second": self.simulate(changed if complete else _replace_texts(first.case.texts, changed)),
        }
        longest = max(simulated.response.duration for simulated in cases.values())
        starts, ends = zip(*(find_active_span(simulated.response) for simulated in cases.values()), strict=True)
        start, end = choose_window(window, longest, (min(starts), max(ends)))
        header = {
            "window": widen_empty_window(start, end),
            "duration": longest,
            "cases": [describe_case(simulated) for simulated in cases.values()],
        }
        arrays: dict[str, Floats] = {}
        for name, simulated in cases.items():
            stop = min(end, simulated.response.duration)
            if start < stop:
                arrays |= {f"{name}_{key}": values for key, values in sample_window(simulated, start, stop).items()}
            arrays[f"{name}_rest"] = simulated.response.rest_intervals.ravel()
        return Payload(header, arrays)

    def body(self, texts: Texts) -> Payload:
        """Return plan, resistance in every direction, and words for the body of a mesh."""
        case = self.simulate(texts).case
        if case.body is None:
            raise OptionError("this block is of no {}: open one", "mesh")
        return describe_body(case.body, case.azimuth)

    def summary(self, texts: Texts) -> list[tuple[str, str]]:
        """Return the summary of a response as rows of label and value."""
        return [(row.name, row.text) for row in self.simulate(texts).response.summary_rows()]

    def code(self, texts: Texts) -> dict[str, str | None]:
        """Return a case as Python, and as a command if the command line supports it."""
        case = self.simulate(texts).case
        return {"python": case_as_python(case), "command": case_as_command(case)}

    def export(self, texts: Texts, form: str, window: tuple[float, float] | None = None) -> bytes:
        """Return a response as the content of a file in one of `EXPORTS`; a figure shows a window (s)."""
        if form not in EXPORTS:
            raise OptionError(f"a case is written as one of {', '.join(EXPORTS)}, not {form[:20]!r}")
        response = self.simulate(texts).response
        with tempfile.TemporaryDirectory(prefix="rocking-") as folder:
            file = Path(folder) / f"response.{form}"
            if form in _TABLES:
                response.to_csv(file, _TABLES[form])
            elif form == "nc":
                response.to_netcdf(file)
            else:
                checked_ends = None if window is None else check_window(window, response.duration)
                with self._drawing:
                    from matplotlib import rc_context

                    figure = response.plot(window=checked_ends, longest_sequence=bool(len(response.sequences)))
                    with rc_context({"svg.hashsalt": "rocking"}):
                        figure.savefig(file, dpi=160)
                    if "matplotlib.pyplot" in sys.modules:
                        sys.modules["matplotlib.pyplot"].close(figure)
            return file.read_bytes()


def _count_rows(simulated: SimulatedCase) -> int:
    """Count the steps of a response and the samples of its motion, or return a minimum if there are few."""
    motion = simulated.case.motion
    samples = 0 if motion is None else len(motion.breakpoints) * (1 if motion.vertical is None else 2)
    return max(samples + len(simulated.response.solution.trail.nodes), _MAX_ROWS // _MAX_RESPONSES)


def _replace_texts(texts: Texts, changed: Texts) -> dict[str, str]:
    """Return the texts of a case with replacements. Texts of a block, or of motion and start, are replaced together."""
    replacements = [(list_names("block"), list_names("block")), (list_names("motion"), list_names("motion", "start"))]
    replaced = {name for changed_names, names in replacements if changed.keys() & {*changed_names} for name in names}
    return {name: value for name, value in texts.items() if name not in replaced} | dict(changed)
