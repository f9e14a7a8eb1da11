"""Answers to the page's requests by name, independent of the web."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from rocking.errors import BlockError, OptionError
from rocking.explorer import maps, periodic, simulated
from rocking.explorer.assessment import AssessedCase, assess_case, describe_assessment
from rocking.explorer.catalogue import list_records, read_entries
from rocking.explorer.code import case_as_command, case_as_python, map_as_python, sweep_as_python
from rocking.explorer.inputs import Case, read_case
from rocking.explorer.meshes import describe_body
from rocking.explorer.parameters import ASSESSMENT_NAMES, PARAMETERS, Texts, describe_inputs
from rocking.explorer.payload import Payload
from rocking.explorer.simulated import SimulatedCase
from rocking.explorer.standalone import is_available
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import UploadStore, is_mesh, list_units
from rocking.inputs.quantities import read_number

#: Maximum numbers of cached responses, of some MB and up to 100 MB for the longest records, and assessments.
_MAX_RESPONSES, _MAX_ASSESSMENTS = 8, 8

#: Tables of a response by the ending of their files, and other files of a case.
_TABLES: Final[Mapping[str, Any]] = {"csv": "histories", "events.csv": "events", "impacts.csv": "impacts"}
EXPORTS: Final = (*_TABLES, "nc", "report.html", "assessment.nc")


class Stream(NamedTuple):
    """Answer in parts: a description, then the parts in the order of their computation."""

    description: dict[str, Any]
    parts: Generator[Payload]


@dataclass(frozen=True)
class Query:
    """Texts of a request: those of its case, and others."""

    fields: Texts

    def select(self, names: Iterable[str]) -> dict[str, str]:
        """Return the texts with these names that are not empty."""
        return {name: self.fields[name] for name in names if self.fields.get(name)}

    @property
    def case(self) -> dict[str, str]:
        """Texts of the case."""
        return self.select(PARAMETERS)

    def get(self, name: str) -> str:
        """Return a text, empty if it is missing."""
        return self.fields.get(name, "")

    def numbers(self, *names: str) -> list[float]:
        """Return required finite numbers."""
        numbers = [read_number(self.get(name)[:40], name) for name in names]
        if not all(map(math.isfinite, numbers)):
            raise OptionError(f"{' and '.join(['{}'] * len(names))} must be finite numbers", *names)
        return numbers

    @property
    def window(self) -> tuple[float, float] | None:
        """Ends of a time window, s, or None if they are missing."""
        if not (self.get("from") and self.get("to")):
            return None
        start, end = self.numbers("from", "to")
        return start, end


class Explorer:
    """Answers to requests, with a thread-safe cache of the last responses.

    Parameters
    ----------
    opening : dict of str to str
        Texts of the initial case.
    study : StudyView, optional
        Study whose maps are shown.

    Attributes
    ----------
    answers : dict of str to callable
        Functions by the names of requests; they return a payload, a stream, the bytes of a file, or plain values.

    Examples
    --------
    >>> explorer = Explorer()
    >>> query = Query({"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"})
    >>> explorer.answers["case"](query).header["rests"]
    1
    """

    def __init__(self, opening: Mapping[str, str] | None = None, study: StudyView | None = None) -> None:
        self.opening, self.study = dict(opening or {}), study
        self.uploads = UploadStore()
        self._simulated = lru_cache(_MAX_RESPONSES)(self._simulate)
        self._assessed = lru_cache(_MAX_ASSESSMENTS)(
            lambda case, texts: assess_case(read_case(dict(case), self.uploads), dict(texts), self.uploads)
        )
        self.answers: dict[str, Callable[[Query], Any]] = {
            "start": self._start,
            "case": lambda query: simulated.describe_case(self.simulate(query.case), query.window),
            "details": self._details,
            "at": lambda query: simulated.find_state(self.simulate(query.case), query.get("at"), query.window),
            "export": self._export,
            "map": self._map,
            "map/point": lambda query: maps.map_point_to_texts(self._grid(query), *query.numbers("at_x", "at_y")),
            "orbit": lambda query: periodic.describe_orbit(self._case(query)),
            "sweep": self._sweep,
            "sweep/point": self._sweep_point,
            "assessment": lambda query: describe_assessment(self._assess(query)),
            "list": lambda query: list_records(self.uploads, read_entries(query.get("answers"))),
            "remove": self._remove,
            "study": lambda query: self._require_study().select(query.fields),
            "study/point": lambda query: self._require_study().point_to_texts(query.fields, self.uploads),
        }

    def add_file(self, name: str, data: bytes) -> dict[str, Any]:
        """Store a record or a mesh, and describe it; unreadable files are not kept."""
        key = self.uploads.add_file(name, data)
        try:
            if not is_mesh(name):
                return self.uploads.describe_file(key)
            description = {"key": key, "name": self.uploads.get_file(key).name, "azimuth": 0.0}
            try:
                solid = self.uploads.read_body(f"file:{key}").solid
            except BlockError as error:
                if error.argument is None:
                    raise
                return description  # the page can correct this argument
            return description | {"azimuth": solid.weakest_azimuth}
        except Exception:
            self.uploads.remove(key)
            raise

    def simulate(self, texts: Texts) -> SimulatedCase:
        """Return a case with its response."""
        return self._simulated(tuple(sorted(texts.items())))

    def _simulate(self, texts: tuple[tuple[str, str], ...]) -> SimulatedCase:
        case = read_case(dict(texts), self.uploads)
        return SimulatedCase(case, case.simulate())

    def _start(self, _: Query) -> dict[str, Any]:
        study = None if self.study is None else self.study.describe()
        axes = [{"name": name, "unit": kind.unit} for name, kind in maps.AXES.items()]
        own = {"axes": axes, "opening": self.opening, "study": study, "block_page": is_available()}
        return describe_inputs() | own | {"record_units": list_units()}

    def _details(self, query: Query) -> Payload:
        """Return what the page shows after a pause: phase plane, ground displacement, body, summary and code."""
        shown = self.simulate(query.case)
        payload = simulated.describe_details(shown, query.window)
        payload.header["summary"] = [(row.name, row.text) for row in shown.response.summary_rows()]
        payload.header.update(python=case_as_python(shown.case), command=case_as_command(shown.case), body=None)
        if shown.case.body is not None:
            body = describe_body(shown.case.body)
            payload.header["body"] = body.header
            payload.arrays.update(body.arrays)
        return payload

    def _case(self, query: Query) -> Case:
        return read_case(query.case, self.uploads)

    def _grid(self, query: Query) -> maps.MapGrid:
        return maps.read_grid(self._case(query), query.fields)

    def _map(self, query: Query) -> Stream:
        grid = self._grid(query)
        return Stream(maps.describe_map(grid) | {"python": map_as_python(grid)}, maps.simulate_grid(grid))

    def _sweep(self, query: Query) -> Stream:
        sweep = periodic.read_sweep(self._case(query), query.fields)
        axis = {"name": sweep.axis.name, "values": sweep.axis.values.tolist()}
        return Stream(axis | {"python": sweep_as_python(sweep)}, periodic.simulate_sweep(sweep))

    def _sweep_point(self, query: Query) -> dict[str, str]:
        sweep = periodic.read_sweep(self._case(query), query.fields)
        (value,), state = query.numbers("at"), query.numbers("u", "v") if query.get("u") else []
        return periodic.sweep_point_to_texts(sweep, value, state)

    def _assess(self, query: Query) -> AssessedCase:
        return self._assessed(tuple(query.case.items()), tuple(query.select(ASSESSMENT_NAMES).items()))

    def _remove(self, query: Query) -> dict[str, int]:
        """Remove a file and its responses, and return the number of remaining files."""
        self.uploads.remove(query.get("key"))
        self._simulated.cache_clear()
        self._assessed.cache_clear()
        return self.uploads.count_usage()

    def _require_study(self) -> StudyView:
        if self.study is None:
            raise OptionError("no study is open: start with rocking explore FOLDER")
        return self.study

    def _export(self, query: Query) -> bytes:
        """Return a file in one of `EXPORTS`."""
        form = query.get("form")
        if form not in EXPORTS:
            raise OptionError(f"a case is written as one of {', '.join(EXPORTS)}, not {form[:20]!r}")
        with tempfile.TemporaryDirectory(prefix="rocking-") as folder:
            file = Path(folder) / f"file.{form}"
            if form in _TABLES:
                self.simulate(query.case).response.to_csv(file, _TABLES[form])
            elif form == "nc":
                self.simulate(query.case).response.to_netcdf(file)
            elif form == "assessment.nc":
                self._assess(query).result.to_netcdf(file)
            else:
                self._assess(query).result.to_html(file)
            return file.read_bytes()
