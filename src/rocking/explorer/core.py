"""Arrays, numbers and texts of a case on the page, independent of the web."""

from __future__ import annotations

import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rocking.errors import BlockError, OptionError
from rocking.explorer import simulated
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.inputs import read_case
from rocking.explorer.meshes import describe_body
from rocking.explorer.parameters import Texts
from rocking.explorer.payload import Payload
from rocking.explorer.simulated import SimulatedCase
from rocking.explorer.uploads import RecentCache, UploadStore, is_mesh

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

    def add_file(self, name: str, data: bytes) -> dict[str, Any]:
        """Store a record or a mesh, and describe it; unreadable files are not kept."""
        key = self.uploads.add_file(name, data)
        try:
            if not is_mesh(name):
                return self.uploads.describe_file(key)
            description = {"key": key, "name": self.uploads.file(key).name, "mesh": True, "azimuth": 0.0}
            try:
                solid = self.uploads.body(f"file:{key}", {}, None, None).solid
            except BlockError as error:
                if error.argument is None:
                    raise
                return description  # the page can correct this argument
            return description | {"azimuth": solid.weakest_azimuth}
        except Exception:
            self.uploads.remove(key)
            raise

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
        return simulated.describe_case(self.simulate(texts), window)

    def details(self, texts: Texts, window: tuple[float, float] | None = None) -> Payload:
        """Return what the page shows after a pause: phase plane, ground displacement, body, summary and code."""
        shown = self.simulate(texts)
        payload = simulated.describe_details(shown, window)
        payload.header["summary"] = [(row.name, row.text) for row in shown.response.summary_rows()]
        payload.header.update(python=case_as_python(shown.case), command=case_as_command(shown.case), body=None)
        if shown.case.body is not None:
            body = describe_body(shown.case.body, shown.case.azimuth)
            payload.header["body"] = body.header
            payload.arrays.update(body.arrays)
        return payload

    def state(self, texts: Texts, time: str, window: tuple[float, float] | None = None) -> dict[str, Any]:
        """Return the state of a case at a time (text), in the response of a window (s)."""
        return simulated.find_state(self.simulate(texts), time, window)

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
                ends = None if window is None else simulated.check_window(window, response.duration)
                with self._drawing:
                    from matplotlib import rc_context

                    figure = response.plot(window=ends, longest_sequence=bool(len(response.sequences)))
                    with rc_context({"svg.hashsalt": "rocking"}):
                        figure.savefig(file, dpi=160)
                    if "matplotlib.pyplot" in sys.modules:
                        sys.modules["matplotlib.pyplot"].close(figure)
            return file.read_bytes()


def _count_rows(shown: SimulatedCase) -> int:
    """Count the steps of a response and the samples of its motion, or return a minimum if there are few."""
    motion = shown.case.motion
    samples = 0 if motion is None else len(motion.breakpoints) * (1 if motion.vertical is None else 2)
    return max(samples + len(shown.response.solution.trail.nodes), _MAX_ROWS // _MAX_RESPONSES)
