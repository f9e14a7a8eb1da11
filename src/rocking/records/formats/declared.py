"""Formats with a header, declared in `declared.toml`: how each is recognised, what its header states, and its numbers.

Patterns are searched in the text of a header, and their named groups are its statements, of which the first holds.
`count`, `further` (numbers of other series that follow), `step`, `milliseconds` or `rate`, `precise_step`, `duration`,
`units`, `factor`, `divisor`, `missing`, `peak` with `peak_units`, `columns` describe the numbers. `name`, `number`,
`station`, `network`, `event`, `magnitude`, `azimuth_l` (of components with that first letter), `start`, `zone` and
`quantity` describe the record, and `fact_...` is kept as metadata. Groups such as `peak_2` repeat a statement. Stated
counts, steps, durations and peaks must agree with each other and with the numbers.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import re
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from importlib import resources
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import escape_braces
from rocking.records.formats.channel import (
    Channel,
    Identification,
    Recognised,
    create_channel,
    missing_value_error,
    resolve_timing,
)
from rocking.records.formats.numbers import (
    NUMBER,
    Layout,
    StatedCount,
    compute_rounding,
    find_numeric_end,
    parse_token,
    read_values,
)
from rocking.records.formats.source import Line, Request, Source
from rocking.records.units import SECOND, Unit, find_unit

_END_OF_DATA: Final = re.compile(r"(?i)^\s*(/&|-*\s*end[ -]of[ -]data)")
_START_FORMATS: Final = ("%Y%m%d_%H%M%S.%f", "%Y/%m/%d-%H:%M:%S.%f", "%d/%m/%Y %H:%M:%S.%f", "%Y %m %d %H %M %S.%f")
#: Ratio of the peak of the numbers to the stated one that indicates another unit.
_PEAK_RATIO: Final = 3.0
_MAX_HEADER_LINES: Final = 400
_BEARING_PATTERN: Final = re.compile(r"([NS])\s*(\d{1,2}(?:\.\d*)?)\s*([EW])\b")
_DEGREES_PATTERN: Final = re.compile(r"(?ia)(\d{1,3}(?:\.\d*)?)\s*(?:deg|$)")
_AZIMUTHS: Final = {"n": 0.0, "ns": 0.0, "n-s": 0.0, "north": 0.0, "e": 90.0, "ew": 90.0, "e-w": 90.0, "east": 90.0}
_NUMERIC_PATTERN: Final = r"(?=.*\d)[\d \t.+EeDd-]+$"


@functools.cache
def _compile(pattern: str) -> re.Pattern[str]:
    r"""Return a pattern of `declared.toml`: `\s` is a blank within a line, NUMBER a number, and NUMERIC a row."""
    text = pattern.replace("NUMERIC", _NUMERIC_PATTERN).replace("NUMBER", NUMBER).replace(r"\s", r"[^\S\n]")
    return re.compile(text, re.ASCII | re.IGNORECASE | re.MULTILINE)


def find_azimuth(name: str) -> float | None:
    """Return the direction, degrees clockwise from north, of a component called "N10E", "90 Deg", "E-W", "HNE", ..."""
    if match := _BEARING_PATTERN.match(name):
        angle = float(match[2]) if match[3] == "E" else -float(match[2])
        return (angle if match[1] == "N" else 180.0 - angle) % 360.0
    if match := _DEGREES_PATTERN.match(name):
        return float(match[1]) % 360.0
    word = name.split(" ")[0]
    return _AZIMUTHS.get((word[-1] if re.fullmatch("[BCDEHS][HLN][NE]", word) else word).lower())


class _Statement(NamedTuple):
    """Text that a header states, and the offset of its line."""

    text: str
    offset: int


@dataclass(frozen=True)
class Format:
    """Declaration of a format: a table of `declared.toml`."""

    name: str  # name for the user
    documentation: Mapping[str, str]  # agency, mark and units, for the table of formats
    marks: tuple[str, ...]  # patterns in the first lines, of which the first one begins a channel
    header: str  # pattern of all lines of a channel's header
    statement_patterns: tuple[str, ...]  # patterns with statements as named groups
    mark_line_count: int = 1  # number of lines that contain the marks
    has_several_channels: bool = False  # whether a file may contain several channels
    other_data: str = "(?!)"  # line that begins data of other quantities, which are skipped
    is_paired: bool = False  # whether the numbers are pairs of time and value
    is_step_optional: bool = False  # whether the numbers are such pairs if the header states no step
    layouts: tuple[str, ...] = ()  # possible columns of the numbers, such as 8x10, if they may touch
    fixed_units: str = ""  # unit of all files
    component_names: Mapping[str, str] = field(default_factory=dict)  # names of components by their text in the file
    is_padded: bool = False  # whether the last row is filled up
    is_raw: bool = False  # whether the numbers are counts with the offset of an instrument

    def recognise(self, source: Source) -> Recognised | None:
        """Return the format if each of its marks is found."""
        lines = source.find_first_lines(self.mark_line_count)
        text = "\n".join(line.text for line in lines)
        mark, *other_matches = [_compile(pattern).search(text) for pattern in self.marks]
        if mark is None or None in other_matches:
            return None
        line = lines[text.count("\n", 0, mark.start())]
        reason = f"line {source.find_line_number(line.start)} reads {mark[0].splitlines()[0].strip()!r}"
        return Identification(self.name, reason), functools.partial(self._read_channels, source, lines[0].start)

    def begins_channel(self, line: Line) -> bool:
        """Return whether a line begins a channel."""
        return _compile(self.marks[0]).search(line.text) is not None

    def _read_channels(self, source: Source, start: int | None, request: Request) -> list[Channel]:
        channels: list[Channel] = []
        while start is not None:
            header = Header(source, self, start, len(channels) + 1)
            end = self._find_end(source, header.end)
            quantity = header.find("quantity", "acceleration").lower()
            channels += header.create_channels(end, request) if quantity.startswith("acc") else []
            start = self._find_next(source, end)
        if not channels:
            text = f"this {self.name} file contains {quantity!r}; use the file of the acceleration"
            raise source.error(text, header.offset)
        return channels

    def _ends_data(self, line: Line) -> bool:
        return bool(_END_OF_DATA.match(line.text) or _compile(self.other_data).search(line.text))

    def _find_end(self, source: Source, start: int) -> int:
        """Return the end of a channel's numbers: the end of the file, or a line that begins other content."""
        end = find_numeric_end(source, start) if self.has_several_channels else len(source.data)
        line = source.read_line(end)
        # Another line is not an end, but contains a damaged number.
        return end if self._ends_data(line) or self.begins_channel(line) else line.next_start

    def _find_next(self, source: Source, end: int) -> int | None:
        """Return the offset of the next channel."""
        line = source.find_first_line(end)
        while line is not None and not self.begins_channel(line):
            if not self._ends_data(line):
                raise source.error("expected the title of the next channel here; correct the file", line.start)
            line = source.find_first_line(find_numeric_end(source, line.next_start))
        return None if line is None else line.start


class Header:
    """Header of one channel: its lines, its statements by name, and the offset of its end."""

    def __init__(self, source: Source, form: Format, start: int, ordinal: int) -> None:
        self.source, self.form, self.ordinal = source, form, ordinal
        title, *others = source.read_lines(start, _MAX_HEADER_LINES)
        if form.has_several_channels:
            others = [*itertools.takewhile(lambda line: not form.begins_channel(line), others)]
        match = _compile(form.header).match("".join(f"{line.text}\n" for line in (title, *others)))
        if match is None:
            advice = "if the file is incomplete, download it again; if its layout differs, write it as a text table"
            raise source.error(f"this header is not complete; {advice}", start)
        self.lines = [title, *others][: match[0].count("\n")]
        self.end, text = self.lines[-1].next_start, match[0].removesuffix("\n")
        self.statements: dict[str, list[_Statement]] = defaultdict(list)
        for found in filter(None, (_compile(pattern).search(text) for pattern in form.statement_patterns)):
            for name, value in found.groupdict(default="").items():
                if words := value.split():
                    line = self.lines[text.count("\n", 0, found.start(name))]
                    self.statements[re.sub(r"_\d$", "", name)].append(_Statement(" ".join(words), line.start))

    def _reject(
        self, fault: str, offset: int, advice: str = "correct the header, or download the file again"
    ) -> NoReturn:
        raise self.source.error(f"{fault}; {advice}", offset)

    def find(self, name: str, default: str = "") -> str:
        """Return the first statement of a name."""
        return next((statement.text for statement in self.statements[name]), default)

    @property
    def offset(self) -> int:
        """Offset of the line for errors on the numbers."""
        places = [statement.offset for name in ("count", "factor") for statement in self.statements[name]]
        return [*places, self.lines[-1].start][0]

    def _read_number(self, statement: _Statement) -> float:
        """Return the positive number at the start of a statement."""
        match = _compile(r"NUMBER(?=[^\w.]|$)").match(statement.text)
        number = (parse_token(match[0].encode()) if match else None) or 0.0
        if not number > 0.0:
            line = self.source.read_line(statement.offset)
            advice = "correct it, or download the record again"
            self._reject(f"expected a positive number in {escape_braces(repr(line.text))}", line.start, advice)
        return number

    def find_number(self, name: str, default: float = 0.0) -> float:
        """Return the first stated number of a name."""
        return next(map(self._read_number, self.statements[name]), default)

    def find_count(self) -> StatedCount:
        """Return the stated number of values in each column, or of pairs."""
        counts = [(self._read_number(statement), statement.offset) for statement in self.statements["count"]]
        if len({count for count, _ in counts}) > 1:
            self._reject(f"the header specifies both {counts[0][0]:.15g} and {counts[1][0]:.15g} values", counts[0][1])
        if counts:
            return StatedCount(*counts[0])
        duration, rate = self.find_number("duration"), self.find_number("rate")
        if not duration * rate and self.form.is_paired:
            self._reject("the header states no number of values", self.offset)
        if not duration * rate:
            return StatedCount(0.0, self.offset, math.inf)
        # The duration is in whole seconds. Fewer samples, or a surplus of a second, are errors.
        return StatedCount(duration * rate, self.statements["duration"][0].offset, max_surplus=max(rate - 1.0, 0.0))

    def find_step(self, count: float) -> tuple[float | None, int]:
        """Return the sampling step, s, or None for pairs, and the offset of its line."""
        duration, steps = self.find_number("duration"), self._list_steps()
        if self.form.is_paired or (self.form.is_step_optional and not steps):
            return None, self.offset
        if not steps and duration:
            return float(f"{duration / count:.6g}"), self.statements["duration"][0].offset
        if not steps:
            self._reject("the header states no sampling step", self.offset)
        step, rounding, offset = min(steps, key=lambda item: item[1])
        for other, other_rounding, place in steps:
            if abs(step - other) > 1.01 * other_rounding + 1e-6 * step:
                self._reject(f"the header states a sampling step of both {step:.6g} and {other:.6g} s", place)
        # Durations in whole seconds may be truncated, and without the last interval.
        text = self.find("duration")
        slack = 1.5 * step + count * rounding + (compute_rounding(text) if "." in text else 1.0)
        if duration and abs(count * step - duration) > 1.01 * slack:
            self._reject(
                f"{count:.15g} values in steps of {step:.6g} s do not last the stated {duration:.6g} s", offset
            )
        precise_step = self.find_number("precise_step", step)
        return (precise_step if abs(precise_step - step) <= rounding else step), offset

    def _list_steps(self) -> list[tuple[float, float, int]]:
        """Return the stated steps, s, with their rounding and the offset of their line."""
        steps = []
        for name, divisor in (("step", 1.0), ("milliseconds", 1000.0), ("rate", None)):
            for statement in self.statements[name]:
                number, rounding = self._read_number(statement), compute_rounding(statement.text)
                step = 1.0 / number if divisor is None else number / divisor
                steps.append((step, rounding * step / number, statement.offset))
        return steps

    def create_channels(self, end: int, request: Request) -> list[Channel]:
        """Create the channels of the numbers up to the offset `end`."""
        source, form, spelling = self.source, self.form, self.form.fixed_units or self.find("units")
        unit = request.resolve_unit(source, spelling, self.offset)
        words = " ".join(statement.text for statement in self.statements["columns"])
        columns = re.sub(r"\([^)]*\)|[/;]", " ", words).split() or [""]
        count = self.find_count()
        step, place = self.find_step(count.number)
        dt, times = None if step is None else request.check_step(source, step, place), None
        values = self._read_values(end, count, 2 if form.is_paired else len(columns))
        if step is None:
            if len(values) % 2 or len(values) < 4:
                self._reject("expected pairs of time and acceleration", self.offset, "correct the file")
            instants, values = _merge_repeated(values[0::2], values[1::2])
            dt, times = resolve_timing(source, request, instants, SECOND, lambda _: self.offset)
        if len(values) % len(columns):
            self._reject(f"{len(values)} values do not fill {len(columns)} columns", self.end)
        table = values.reshape(-1, len(columns))
        if columns[0].lower() == "time":
            printed, _ = resolve_timing(source, request, table[:, 0], SECOND, lambda _: self.end)
            if printed is None or step is None or abs(printed - step) > 1e-4 * printed:
                self._reject(
                    f"the header states a sampling step of {step:g} s, but the times are in other steps", place
                )
            columns, table = columns[1:], table[:, 1:]
        fields: dict[str, Any] = {"spelling": spelling, "dt": dt, "times": times, "is_raw": form.is_raw}
        channels = []
        for index, (name, column) in enumerate(zip(columns, table.T, strict=True)):
            labels = self._find_labels(name, index)
            channels.append(create_channel(source, form.name, column, unit, lambda _: self.offset, **fields, **labels))
        self._check_peaks([channel.acceleration for channel in channels], unit)
        return channels

    def _read_values(self, end: int, count: StatedCount, multiple: int) -> Floats:
        """Read a multiple of the stated number of values, times the stated factor."""
        layouts = [*filter(None, map(Layout.find, (self.lines[-1].text, *self.form.layouts)))]
        padding = layouts[0].per_line if self.form.is_padded else 0
        size = count.number * multiple + sum(float(statement.text) for statement in self.statements["further"])
        stated = StatedCount(size, count.offset, (count.max_surplus + padding) * multiple)
        values = read_values(self.source, self.end, end, layouts, stated)
        if self.statements["count"]:
            values = values[: int(count.number * multiple)]
        missing = float(self.find("missing", "nan"))
        if (values == missing).any():
            raise missing_value_error(self.source, missing, self.offset)
        with np.errstate(over="ignore"):
            return values * self.find_number("factor", 1.0) / self.find_number("divisor", 1.0)

    def _find_labels(self, column: str, index: int) -> dict[str, Any]:
        """Return number, name, azimuth, station, event, start and metadata of a component."""
        form, number = self.form, self.find("number")
        name = form.component_names.get(self.find("name"), column or self.find("name"))
        ordinal = int(number) if number else self.ordinal + index
        azimuth_text = self.find(f"azimuth_{name[:1].lower()}")
        event, magnitude, start = self.find("event"), self.find("magnitude"), None
        for pattern in _START_FORMATS:
            with contextlib.suppress(ValueError):
                start = datetime.strptime(f"{self.find('start')}+0000", f"{pattern}%z").timestamp()
                start -= 3600.0 * float(self.find("zone", "0"))
        facts = {key[5:].replace("_", " "): self.find(key) for key in self.statements if key.startswith("fact_")}
        return {
            "name": name or (f"channel {ordinal}" if form.has_several_channels else "acceleration"),
            "number": ordinal,
            "azimuth": float(azimuth_text) if azimuth_text else find_azimuth(name),
            "station": ".".join(filter(None, (self.find("network"), self.find("station")))),
            "event": f"{event}, magnitude {magnitude}" if magnitude else event,
            "start": start,
            "facts": facts,
        }

    def find_peaks(self, count: int, unit: Unit) -> list[float]:
        """Return the stated peaks of this many components, m/s^2, or 0."""
        peaks = [[abs(float(number)) for number in re.findall(NUMBER, item.text)] for item in self.statements["peak"]]
        if len(peaks) == 1 < count:
            peaks = [[number] for number in peaks[0]]
        peak_unit = find_unit(self.find("peak_units")) or unit
        return [float(peak_unit.to_si(np.array(max(numbers, default=0.0)))) for numbers in peaks]

    def _check_peaks(self, accelerations: list[Floats], unit: Unit) -> None:
        """Raise an error if the peak of a component contradicts the stated one, as with another unit."""
        for acceleration, stated in zip(accelerations, self.find_peaks(len(accelerations), unit), strict=False):
            peaks = [float(np.abs(values).max()) for values in (acceleration, acceleration - acceleration.mean())]
            if stated and all(peak > 0.0 and not 1.0 / _PEAK_RATIO < peak / stated < _PEAK_RATIO for peak in peaks):
                text = f"the header states a peak of {stated:.4g} m/s^2, but the largest value is {peaks[0]:.4g} m/s^2"
                self._reject(text, self.offset, "check the units, or download the file again")


def _merge_repeated(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return pairs with the mean of values at equal times, if few times of a film are printed twice."""
    steps = np.diff(times)
    starts = np.flatnonzero(np.append(True, steps > 0.0))
    if (steps < 0.0).any() or not 0 < len(times) - len(starts) <= len(times) // 1000:
        return times, values
    return times[starts], np.add.reduceat(values, starts) / np.diff(np.append(starts, len(times)))


@functools.cache
def load_formats() -> tuple[Format, ...]:
    """Return the declared formats in the order of recognition."""
    text = (resources.files("rocking.records.formats") / "declared.toml").read_text("utf-8")
    return tuple(Format(**table) for table in tomllib.loads(text)["formats"])
