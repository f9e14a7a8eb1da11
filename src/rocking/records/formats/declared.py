"""Formats with a header, declared in `declared.toml`: how each is recognised, what its header states, and its numbers.

Patterns are searched in the text of a header, and their named groups are its statements, of which the first that is not
empty holds. `count`, `step` or `rate`, `duration`, `seconds` (whole ones, instead of a count), `about` (a rounded
duration), `units`, `factor`, `divisor`, `missing`, `peak` with `peak_units`, `peaks`, `columns` describe the numbers.
`name`, `number`, `station`, `network`, `event`, `magnitude`, `azimuth_l` (of components with that first letter),
`start`, `zone` and `quantity` describe the record, and `fact_...` is kept as metadata. Stated counts, steps and
durations must agree with each other and with the numbers.
"""

from __future__ import annotations

import contextlib
import functools
import math
import re
import tomllib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from importlib import resources
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import RecordError, escape_braces
from rocking.records.formats.channel import Channel, Recognised, create_channel, missing_value_error, resolve_timing
from rocking.records.formats.engine import (
    NUMBER,
    Count,
    Layout,
    compute_rounding,
    find_numeric_end,
    parse_layout,
    parse_token,
    read_values,
)
from rocking.records.formats.source import Line, Request, Source
from rocking.records.units import SECOND, Unit, find_unit

_END_OF_DATA: Final = re.compile(r"(?i)^\s*(/&|-*\s*end[ -]of[ -]data)")
_STARTS: Final = ("%Y%m%d_%H%M%S.%f", "%Y/%m/%d-%H:%M:%S.%f", "%d/%m/%Y %H:%M:%S.%f", "%Y %m %d %H %M %S.%f")
#: Ratio of the peak of the numbers to the stated one that indicates another unit.
_PEAK_RATIO: Final = 3.0
_BEARING: Final = re.compile(r"([NS])\s*(\d{1,2}(?:\.\d*)?)\s*([EW])\b")
_DEGREES: Final = re.compile(r"(?ia)(\d{1,3}(?:\.\d*)?)\s*(?:deg|$)")
_DIRECTIONS: Final = {"n": 0.0, "ns": 0.0, "n-s": 0.0, "north": 0.0, "e": 90.0, "ew": 90.0, "e-w": 90.0, "east": 90.0}
_NUMERIC: Final = r"^(?=.*\d)[\d \t.+EeDd-]+$"


@functools.cache
def _compile(pattern: str) -> re.Pattern[str]:
    r"""Return a pattern of `declared.toml`: `\s` is a blank within a line, NUMBER a number, and NUMERIC a row."""
    text = pattern.replace("NUMERIC", _NUMERIC).replace("NUMBER", NUMBER).replace(r"\s", r"[^\S\n]")
    return re.compile(text, re.ASCII | re.IGNORECASE | re.MULTILINE)


def find_azimuth(name: str) -> float | None:
    """Return the direction, degrees clockwise from north, of a component called "N10E", "90 Deg", "E-W", "HNE", ..."""
    if match := _BEARING.match(name):
        angle = float(match[2]) if match[3] == "E" else -float(match[2])
        return (angle if match[1] == "N" else 180.0 - angle) % 360.0
    if match := _DEGREES.match(name):
        return float(match[1]) % 360.0
    word = name.split(" ")[0]
    return _DIRECTIONS.get((word[-1] if re.fullmatch("[BCDEHS][HLN][NE]", word) else word).lower())


class Statement(NamedTuple):
    """Text that a header states, and the offset of its line."""

    text: str
    offset: int


@dataclass(frozen=True)
class Format:
    """Declaration of a format: a table of `declared.toml`."""

    name: str  # name for the user
    agency: str  # origin of such files, for the documentation
    recognised: str  # mark, for the documentation
    units: str  # units, for the documentation
    marks: tuple[str, ...]  # patterns in the first lines, of which the first one begins a channel
    header: tuple[Mapping[str, Any], ...]  # parts of a channel's header
    statement_patterns: tuple[str, ...]  # patterns with statements as named groups
    mark_lines: int = 1  # number of lines that contain the marks
    start_pattern: str = ""  # pattern at the start of the file
    has_several: bool = False  # whether a file may contain several channels
    other_data: str = "(?!)"  # line that begins data of other quantities, which are skipped
    is_paired: bool = False  # whether the numbers are pairs of time and value
    layout: str = ""  # columns of the numbers, such as 8x10, if they may touch
    wide_layout: tuple[Any, ...] = ()  # place in the header's numbers, a number, and the columns that it selects
    count_name: str = "the header"  # name of the count, for messages
    places: Mapping[str, Sequence[tuple[str, int, float]]] = field(
        default_factory=dict
    )  # statements in the header's numbers
    total_count_places: tuple[Any, ...] = ()  # places of the counts of acceleration and of what follows it
    precise_step: tuple[int, ...] = ()  # line, start and end of a step with more digits
    fixed_units: str = ""  # unit of all files
    component_names: Mapping[str, str] = field(default_factory=dict)  # names of components by their text in the file
    is_padded: bool = False  # whether the last row is filled up
    missing_value: float | None = None  # number for unknown values, which are rejected
    is_raw: bool = False  # whether the numbers are counts with the offset of an instrument

    def recognise(self, source: Source) -> Recognised | None:
        """Return the format if each of its marks is found."""
        lines = source.find_first_lines(self.mark_lines)
        found = [[line for line in lines if _compile(mark).search(line.text)] for mark in self.marks]
        shape = _compile(self.start_pattern).match(source.data[:4096].decode("latin-1"))
        if not all(found) or shape is None:
            return None
        match = _compile(self.marks[0]).search(found[0][0].text)
        assert match is not None
        reason = f"line {source.find_line_number(found[0][0].start)} reads {match[0].strip()!r}"
        return Recognised(self.name, reason, functools.partial(self._read_channels, source, lines[0].start))

    def begins_channel(self, line: Line) -> bool:
        """Return whether a line begins a channel."""
        return _compile(self.marks[0]).search(line.text) is not None

    def _read_channels(self, source: Source, start: int | None, request: Request) -> list[Channel]:
        channels: list[Channel] = []
        while start is not None:
            header = Header(source, self, start, len(channels) + 1)
            header.read()
            end = self._find_end(source, header.end)
            quantity = header.find("quantity", "" if "quantity" in header.statements else "acceleration")
            if quantity.lower().startswith("acc"):
                channels += header.create_channels(end, request)
            start = self._find_next(source, end)
        if not channels:
            text = f"this {self.name} file contains {quantity.lower()!r}; use the file of the acceleration"
            raise source.error(text, header.offset)
        return channels

    def _ends_data(self, line: Line) -> bool:
        return bool(_END_OF_DATA.match(line.text) or _compile(self.other_data).search(line.text))

    def _find_end(self, source: Source, start: int) -> int:
        """Return the end of a channel's numbers: the end of the file, or a line that begins other content."""
        end = find_numeric_end(source, start) if self.has_several else len(source.data)
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


@dataclass(eq=False)
class Header:
    """Header of one channel: read part by part, with a method for each kind of part, and its statements."""

    source: Source  # file
    form: Format  # format that reads the header
    end: int  # offset of the numbers
    ordinal: int  # number of the channel in the file, from 1
    lines: list[Line] = field(default_factory=list)  # lines read
    numbers: dict[str, Floats] = field(default_factory=dict)  # numbers of the header by name
    skips: Sequence[int] = (0,)  # alternative numbers of rows before the numbers
    statements: dict[str, list[Statement]] = field(default_factory=lambda: defaultdict(list))  # statements by name

    def read(self) -> None:
        """Read all parts and collect the statements."""
        start = self.end
        if not self._read_parts(self.form.header):
            raise self._missing_count_error(start)
        text = "\n".join(line.text for line in self.lines)
        patterns = self.form.statement_patterns if self.lines else ()
        for match in filter(None, (_compile(pattern).search(text) for pattern in patterns)):
            for name, value in ((name, value) for name, value in match.groupdict().items() if value is not None):
                line = self.lines[text.count("\n", 0, match.start(name))]
                self.statements[re.sub(r"_\d$", "", name)].append(Statement(" ".join(value.split()), line.start))
        for name, places in self.form.places.items():
            for part, index, divisor in places:
                number = self.get_number(part, index)
                text = "" if number == self.form.missing_value else f"{number / divisor:.15g}"
                self.statements[name].append(Statement(text, self.lines[-1].start))

    def _read_parts(self, parts: Sequence[Mapping[str, Any]]) -> bool:
        """Read the parts; return whether each was found."""
        kinds = ((getattr(self, f"read_{kind}"), value) for part in parts for kind, value in part.items())
        return all(read(*(value if isinstance(value, list) else [value])) is not False for read, value in kinds)

    def _fail(self, text: str, offset: int, advice: str = "correct the header, or download the file again") -> NoReturn:
        raise self.source.error(f"{text}; {advice}", offset)

    def _missing_count_error(self, offset: int) -> RecordError:
        advice = "if the file is incomplete, download it again; if its layout differs, write it as a text table"
        return self.source.error(f"no line of points and units ends this channel's header; {advice}", offset)

    def skip(self, count: int) -> list[Line]:
        """Skip this many lines."""
        lines = self.source.read_lines(self.end, count)
        if len(lines) < count:
            last = lines[-1].start if lines else self.end
            raise self.source.error("the file ends within its header; download the complete file again", last)
        self.end = lines[-1].next_start if lines else self.end
        return lines

    def read_text(self, count: int) -> None:
        """Read this many lines of text."""
        self.lines += self.skip(count)

    def read_line(self, pattern: str, content: str) -> re.Match[str]:
        """Read the next line, which must match."""
        self.read_text(1)
        if match := _compile(pattern).search(self.lines[-1].text):
            return match
        advice = "the file may be damaged, so download it again"
        self._fail(f"expected {content} here", self.lines[-1].start, advice)

    def read_expect(self, *keys: str) -> None:
        """Read lines that begin with these words."""
        for key in keys:
            self.read_line(f"^{re.escape(key)}", f"the header line {key!r}")

    def read_titled(self, pattern: str) -> None:
        """Read as many lines as the first one states."""
        self.read_text(int(self.read_line(pattern, "the title")[1]) - 1)

    def read_before(self, pattern: str, limit: int, more: int = 0) -> bool:
        """Read the lines before the first match, within a limit and the same channel."""
        for k, line in enumerate(self.source.read_lines(self.end, limit)):
            if _compile(pattern).search(line.text):
                self.read_text(k + more)
                return True
            if k > 0 and self.form.has_several and self.form.begins_channel(line):
                break
        return False

    def read_until(self, pattern: str, limit: int) -> bool:
        """Read the lines up to the first match."""
        return self.read_before(pattern, limit, 1)

    def read_listed(self, name: str, pattern: str) -> None:
        """Read numbers after a line with their count, lines and layout."""
        match = self.read_line(pattern, "a line '... header values follow'")
        self.read_numbers(name, int(match[1]), int(match[2]), parse_layout(match.string))

    def read_numbers(self, name: str, count: int, rows: int, layout: str | Layout | None) -> None:
        """Read this many numbers in this many lines."""
        columns, start = Layout.parse(layout) if isinstance(layout, str) else layout, self.end
        self.skip(rows)
        self.numbers[name] = read_values(self.source, start, self.end, columns, Count(count, start))

    def read_skip(self, *rows: int) -> None:
        """Skip rows of numbers later, as many as leave the stated number of values."""
        self.skips = rows

    def read_comments(self, pattern: str) -> None:
        """Skip as many lines as the next one states, if it matches."""
        if match := _compile(pattern).match(self.source.read_line(self.end).text):
            self.skip(1 + int(match[1]))

    def read_skip_stated(self, *place: Any) -> None:
        """Skip as many lines as a number of the header states."""
        self.skip(int(self.get_number(*place)))

    def get_number(self, name: str, index: int) -> float:
        """Return a number of the header by the name of its part and its place there, from 1, or 0."""
        numbers = self.numbers.get(name, ())
        return float(numbers[index - 1]) if len(numbers) >= index else 0.0

    def find(self, name: str, default: str = "") -> str:
        """Return the first statement that is not empty."""
        return next((statement.text for statement in self.statements.get(name, ()) if statement.text), default)

    @property
    def offset(self) -> int:
        """Offset of the line for errors on the numbers."""
        places = [statement.offset for name in ("count", "factor") for statement in self.statements.get(name, ())]
        return places[0] if places else self.lines[-1].start if self.lines else self.end

    def _read_number(self, statement: Statement, *, positive: bool = False) -> float:
        """Return the number at the start of a statement."""
        match = _compile(r"NUMBER(?=\s*Hz|[^\w.]|$)").match(statement.text)
        number = (parse_token(match[0].encode()) if match else None) or 0.0
        if match is None or (positive and not number > 0.0):
            line = self.source.read_line(statement.offset)
            advice = "correct it, or download the record again"
            self._fail(f"expected a positive number in {escape_braces(repr(line.text))}", line.start, advice)
        return number

    def find_number(self, name: str, *, positive: bool = False) -> float:
        """Return the first stated number, or 0."""
        statements = [statement for statement in self.statements.get(name, ()) if statement.text]
        return self._read_number(statements[0], positive=positive) if statements else 0.0

    def find_count(self, surplus: int) -> Count:
        """Return the stated number of values in each column."""
        counts = [(self._read_number(statement), statement.offset) for statement in self.statements.get("count", ())]
        if len({count for count, _ in counts}) > 1:
            self._fail(f"the header specifies both {counts[0][0]:.15g} and {counts[1][0]:.15g} values", counts[0][1])
        if counts:
            return Count(*counts[0], self.form.count_name, surplus)
        if not self.statements.get("seconds"):
            if self.form.is_paired:
                raise self._missing_count_error(self.offset)
            return Count(0.0, self.offset, max_surplus=math.inf)
        rate = self.find_number("rate")
        # The duration is in whole seconds. Fewer samples, or a surplus of a second, are errors.
        place = self.statements["seconds"][0].offset
        return Count(self.find_number("seconds") * rate, place, "the duration", max_surplus=max(rate - 1.0, 0.0))

    def find_step(self, count: float) -> tuple[float | None, int]:
        """Return the sampling step, s, or None for pairs, and the offset of its line."""
        if self.form.is_paired or (self.form.missing_value and not self.find("rate")):
            return None, self.offset
        if "step" in self.form.places:
            return self._choose_step(count), self.offset
        duration = self.find_number("duration")
        if duration and count and not self.statements.keys() & {"step", "rate"}:
            return float(f"{duration / count:.6g}"), self.statements["duration"][0].offset
        step, rounding, offset = self._read_step()
        slack = 1.5 * step + count * rounding + compute_rounding(self.find("duration"))
        if duration and count and abs(count * step - duration) > 1.01 * slack:
            self._fail(f"{count:.15g} values in steps of {step:.6g} s do not last the stated {duration:.6g} s", offset)
        return step, offset

    def _read_step(self) -> tuple[float, float, int]:
        """Return the most precise of the stated steps, s, its rounding and the offset of its line."""
        steps = [
            (self._read_number(each), compute_rounding(each.text), each) for each in self.statements.get("step", ())
        ]
        for each in self.statements.get("rate", ()):
            step = _invert(self._read_number(each))
            steps.append((step, compute_rounding(each.text) * step**2, each))
        if not steps:
            self._fail("the header states no sampling step", self.offset)
        step, rounding, statement = min(steps, key=lambda each: each[1])
        for other, other_rounding, place in steps:
            if abs(step - other) > 1.01 * other_rounding + 1e-6 * step:
                self._fail(f"the header states a sampling step of both {step:.6g} and {other:.6g} s", place.offset)
        if self.form.precise_step and len(self.lines) >= -self.form.precise_step[0]:
            line, start, end = self.form.precise_step
            precise = parse_token(self.lines[line].text[start:end].strip().encode("latin-1")) or 0.0
            step = precise if abs(precise - step) <= rounding else step
        return step, rounding, statement.offset

    def _choose_step(self, count: float) -> float:
        """Return the first step among the header's numbers that fits the stated duration."""
        about, steps = self.find_number("about"), [self._read_number(each) for each in self.statements["step"]]
        # The duration is printed in whole seconds, in some files without the last interval.
        fitting = [step for step in steps if step > 0.0 and (not about or abs(count * step - about) <= 1.0 + step)]
        if not fitting:
            text = f"the steps in the real header are inconsistent with {count:.15g} points and the stated duration"
            self._fail(text, self.offset)
        return fitting[0]

    def _choose_layout(self) -> Layout | None:
        form = self.form
        if form.wide_layout and self.get_number(*form.wide_layout[:2]) == form.wide_layout[2]:
            return Layout.parse(form.wide_layout[3])
        stated = parse_layout(self.lines[-1].text) if self.lines else None
        return stated or Layout.parse(form.layout)

    def _read_values(self, end: int, layout: Layout | None, count: Count) -> Floats:
        """Read the numbers after as many rows of header numbers as leave the stated count."""
        start = self.end
        for rows in self.skips:
            self.end = start
            try:
                self.skip(rows)
                if find_numeric_end(self.source, start) < self.end:
                    raise self._missing_count_error(start)
                return read_values(self.source, self.end, end, layout, count)
            except RecordError:
                if rows == self.skips[-1]:
                    raise
        raise AssertionError("the last alternative returns or raises")

    def create_channels(self, end: int, request: Request) -> list[Channel]:
        """Create the channels of the numbers up to the offset `end`."""
        source, form = self.source, self.form
        unit = request.resolve_unit(source, form.fixed_units or self.find("units"), self.offset)
        words = " ".join(statement.text for statement in self.statements.get("columns", ()))
        columns = re.sub(r"\([^)]*\)|[/;]", " ", words).split() or [""]
        layout = self._choose_layout()
        count = self.find_count(layout.per_line if layout and form.is_padded else 0)
        step, place = self.find_step(count.values)
        dt, times = None if step is None else request.check_step(source, step, place), None
        values = self._read_scaled(end, layout, count, 2 if form.is_paired else len(columns))
        if step is None:
            if len(values) % 2 or len(values) < 4:
                self._fail("expected pairs of time and acceleration", self.offset, "correct the file")
            instants, values = _merge_repeated(values[0::2], values[1::2])
            dt, times = resolve_timing(source, request, instants, SECOND, self.offset)
        if len(values) % len(columns):
            self._fail(f"{len(values)} values do not fill {len(columns)} columns", self.end)
        table = values.reshape(-1, len(columns))
        if columns[0].lower() == "time":
            printed, _ = resolve_timing(source, request, table[:, 0], SECOND, self.end)
            if printed is None or abs(printed - (step or 0.0)) > 1e-4 * printed:
                self._fail(f"the header states a sampling step of {step:g} s, but the times are in other steps", place)
            columns, table = columns[1:], table[:, 1:]
        fields: dict[str, Any] = {"spelling": form.fixed_units or self.find("units"), "dt": dt, "times": times}
        channels = []
        for index, (name, column) in enumerate(zip(columns, table.T, strict=True)):
            labels = self._find_labels(name, index) | {"is_raw": form.is_raw}
            channels.append(create_channel(source, form.name, column, unit, self.offset, **fields, **labels))
            self._check_peak(channels[-1].acceleration, index, unit)
        return channels

    def _read_scaled(self, end: int, layout: Layout | None, count: Count, multiple: int) -> Floats:
        """Read the stated number of values in several columns, times the stated factor."""
        form, size = self.form, count.values * multiple
        if form.total_count_places:
            name, first, last = form.total_count_places
            counts = self.numbers[name][first - 1 : last]
            if counts[0] != count.values:
                self._fail(f"the header specifies both {count.values:.15g} and {counts[0]:.15g} values", count.offset)
            size = float(counts.sum())
        stated = count._replace(values=size, max_surplus=count.max_surplus * multiple)
        values = self._read_values(end, layout, stated)
        if (form.total_count_places or form.is_padded) and count.values:
            values = values[: int(count.values * multiple)]
        missing = self.find_number("missing") if form.missing_value is None else form.missing_value
        if missing and (values == missing).any():
            raise missing_value_error(self.source, missing, self.offset)
        if "factor" in self.statements:
            with np.errstate(over="ignore"):
                divisor = self.find_number("divisor", positive=True) or 1.0
                values = values * self.find_number("factor", positive=True) / divisor
        return values

    def _find_labels(self, column: str, index: int) -> dict[str, Any]:
        """Return number, name, azimuth, station, event, start and metadata of a component."""
        form, number = self.form, self.find("number")
        name = form.component_names.get(self.find("name"), column or self.find("name"))
        ordinal = int(number) if number else self.ordinal + index
        letter = self.find(f"azimuth_{name[:1].lower()}") if name else ""
        event, magnitude, start = self.find("event"), self.find("magnitude"), None
        for pattern in _STARTS:
            with contextlib.suppress(ValueError):
                start = datetime.strptime(f"{self.find('start')}+0000", f"{pattern}%z").timestamp()
                start -= 3600.0 * float(self.find("zone", "0"))
        return {
            "name": name or (f"channel {ordinal}" if form.has_several else "acceleration"),
            "number": ordinal,
            "azimuth": float(letter) if letter else find_azimuth(name),
            "station": ".".join(filter(None, (self.find("network"), self.find("station")))),
            "event": f"{event}, magnitude {magnitude}" if magnitude else event,
            "start": start,
            "facts": {
                name[5:].replace("_", " "): self.find(name) for name in self.statements if name.startswith("fact_")
            },
        }

    def find_peak(self, index: int, unit: Unit) -> float:
        """Return the stated peak of a component, m/s^2, or 0."""
        statements = [*self.statements.get("peaks", ()), *self.statements.get("peak", ())]
        numbers = [[abs(float(number)) for number in re.findall(NUMBER, each.text)] for each in statements]
        if len(numbers) == 1 and "peaks" in self.statements:
            numbers = [[number] for number in numbers[0]]
        largest = max(numbers[index], default=0.0) if index < len(numbers) else 0.0
        return float((find_unit(self.find("peak_units")) or unit).to_si(np.array(largest)))

    def _check_peak(self, acceleration: Floats, index: int, unit: Unit) -> None:
        """Raise an error if the peak of a component contradicts the stated one, as with another unit."""
        stated = self.find_peak(index, unit)
        peaks = [float(np.abs(values).max()) for values in (acceleration, acceleration - acceleration.mean())]
        if stated > 0.0 and all(peak > 0.0 and not 1.0 / _PEAK_RATIO < peak / stated < _PEAK_RATIO for peak in peaks):
            text = f"the header states a peak of {stated:.4g} m/s^2, but the largest value is {peaks[0]:.4g} m/s^2"
            self._fail(text, self.offset, "check the units, or download the file again")


def _merge_repeated(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return pairs with the mean of values at equal times, if few times of a film are printed twice."""
    steps = np.diff(times)
    starts = np.flatnonzero(np.append(True, steps > 0.0))
    if (steps < 0.0).any() or not 0 < len(times) - len(starts) <= len(times) // 1000:
        return times, values
    return times[starts], np.add.reduceat(values, starts) / np.diff(np.append(starts, len(times)))


def _invert(rate: float) -> float:
    return 1.0 / rate if rate else 0.0


@functools.cache
def load_formats() -> tuple[Format, ...]:
    """Return the declared formats in the order of recognition."""
    text = (resources.files("rocking.records.formats") / "declared.toml").read_text("utf-8")
    return tuple(Format(**table) for table in tomllib.loads(text)["formats"])
