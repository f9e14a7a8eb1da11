"""What a record file states of itself, read in a few plain lines for each format; None where that is not clear.

It shares nothing with the readers, and has an opinion only where a file is laid out as `record_files` writes it: on
numbers, counts, steps and units that were changed, and on rows and columns that are missing, but not on damage after
which people would argue what the file says.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: m/s^2 of the units that are judged, by their spellings.
FACTORS: Final = {
    **dict.fromkeys(("g", "G"), 9.80665),
    **dict.fromkeys(("cm/s2", "cm/s^2", "cm/sec2", "gal"), 0.01),
    **{"m/s2": 1.0, "mm/s2": 0.001, "mg": 0.00980665},
}
_SECONDS: Final = {"s": 1.0, "ms": 0.001, "min": 60.0}

_PLAIN: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d{1,3})?", re.IGNORECASE)
_TEXT: Final = re.compile(r"[\n -~]*")


class Said(NamedTuple):
    """One channel as its file states it: how many values, which, in m/s^2, and the step or the instants, s.

    `place` is what the printed decimals leave open of the step, or of an instant.
    """

    count: int
    values: Floats
    dt: float | None
    place: float
    times: Floats | None = None


#: Channels of a file; what must not be read at all is an empty list.
Stated = list[Said] | None


def numbers(lines: list[str], count: int | None, width: int) -> Floats | None:
    """Numbers of some lines: blank-separated, or in columns where those are not as many as stated; None if unclear."""
    ways = [[token for line in lines for token in line.split()]]
    ways.append([line[k : k + width].strip() for line in lines for k in range(0, len(line.rstrip()), width)])
    if any(re.search(r"[^\d\s.eE+-]|[eE][+-]?\d{4}", line) for line in lines):
        return None
    plain = [way if way and all(map(_PLAIN.fullmatch, way)) else None for way in ways]
    fitting = [way for way in plain if way is not None and count in (None, len(way))]
    found = fitting[0] if fitting else plain[0]
    return None if found is None or max(map(len, found)) > 40 else np.array([float(each) for each in found])


def at2(text: str) -> Stated:
    """PEER: one line of sizes, one of units."""
    lines = text.split("\n")
    sizes = [k for k, line in enumerate(lines) if "NPTS" in line.upper()]
    if len(sizes) != 1 or not 0 < sizes[0] < 8:
        return None
    head, shown = lines[: sizes[0]], lines[sizes[0]]
    found = re.fullmatch(r"NPTS= +(\d+), DT= +([\d.]+) SEC,?", shown) or re.fullmatch(
        r" +(\d+) +([\d.]+) +NPTS, DT", shown
    )
    units = [each for line in head for each in re.findall(r"UNITS OF (\S+)", line)]
    if found is None or len(units) != 1 or units[0] not in FACTORS or "TION TIME" not in "".join(head):
        return None
    return _one(int(found[1]), float(found[2]), FACTORS[units[0]], lines[sizes[0] + 1 :], 15)


def _one(count: int, dt: float, factor: float, lines: list[str], width: int, place: float = 0.0) -> Stated:
    values = numbers(lines, count, width)
    return None if values is None else [Said(count, values * factor, dt, place)]


def esm(text: str) -> Stated:
    """ESM: keys, then one value to a line."""
    lines = text.split("\n")
    keys = [re.fullmatch(r"([A-Z][A-Z0-9_/^]+): (.*)", line) for line in lines]
    head = next((k for k, found in enumerate(keys) if found is None), len(lines))
    given = [(found[1], found[2]) for found in keys[:head] if found]
    entries = dict(given)
    if len(entries) != len(given) or entries.get("DATA_TYPE") != "ACCELERATION" or entries.get("UNITS") not in FACTORS:
        return None
    dt, count = entries.get("SAMPLING_INTERVAL_S", ""), entries.get("NDATA", "")
    if not re.fullmatch(r"\d\.\d+", dt) or not count.isdecimal():
        return None
    return _one(int(count), float(dt), FACTORS[entries["UNITS"]], lines[head:], 99)


def knet(text: str) -> Stated:
    """K-NET: the count is what the duration and the rate allow."""
    lines = text.split("\n")
    found = {
        key: [re.fullmatch(pattern, line) for line in lines[:17] if line.startswith(key)]
        for key, pattern in {
            "Sampling Freq(Hz)": r".{18}(\d+)Hz",
            "Scale Factor": r".{18}(\d+)\(gal\)/(\d+)",
            "Duration Time(s)": r".{18}(\d+)",
        }.items()
    }
    if not all(len(each) == 1 and each[0] for each in found.values()) or not lines[16].startswith("Memo."):
        return None
    (rate,), (scale,), (duration,) = found.values()
    assert rate and scale and duration
    values = numbers(lines[17:], None, 9)
    if values is None or 0 in (int(rate[1]), int(scale[2])):
        return None
    stated, most = int(duration[1]) * int(rate[1]), (int(duration[1]) + 1) * int(rate[1])
    count = len(values) if stated <= len(values) < most else stated
    return [Said(count, values * (int(scale[1]) / int(scale[2]) * 0.01), 1.0 / int(rate[1]), 0.0)]


def smc(text: str) -> Stated:
    """SMC with a rate: integers in 8I10, reals in 5E15.7."""
    lines = text.split("\n")
    if len(lines) < 28 or not re.match(r"[12] (UN)?CORRECTED ACCELEROGRAM$", lines[0]):
        return None
    integers = [line[k : k + 10] for line in lines[11:17] for k in range(0, len(line), 10)]
    reals = [line[k : k + 15].strip() for line in lines[17:27] for k in range(0, len(line), 15)]
    whole = len(integers) == 48 and all(re.fullmatch(r" +-?\d+", each) for each in integers)
    if not whole or len(reals) != 50 or not all(map(_PLAIN.fullmatch, reals)) or float(reals[1]) > 1e30:
        return None
    comments, rate = int(integers[15]), float(reals[1])
    if not 0 <= comments <= 9 or rate <= 0.0 or any(line[:1] != "|" for line in lines[27 : 27 + comments]):
        return None
    return _one(int(integers[16]), 1.0 / rate, 0.01, lines[27 + comments :], 10)


def _blocks(
    text: str, title: str, head: str, width: int, read: Callable[[re.Match[str], list[str]], tuple[float, ...]]
) -> Stated:
    """Blocks of numbers behind lines that state count, step and units; each ends where a line has letters.

    There must be as many as channels, which begin with a title.
    """
    lines, said = text.split("\n"), []
    for k, line in enumerate(lines):
        found = re.fullmatch(head, line)
        if found is None:
            continue
        end = next((j for j in range(k + 1, len(lines)) if re.search(r"[A-CF-Za-cf-z]", lines[j])), len(lines))
        if found["units"] not in FACTORS:
            return None
        count, dt = int(found["count"]), read(found, lines[:k])
        values = numbers(lines[k + 1 : end], count, width)
        if values is None or not dt:
            return None
        said.append(Said(count, values * FACTORS[found["units"]], *dt))
    titles = sum(re.match(title, line, re.IGNORECASE) is not None for line in lines)
    return said if len(said) == titles and said else None


def v1(text: str) -> Stated:
    """CSMIP V1 with a line of sizes; the rate is whole."""
    head = (
        r" *(?P<count>\d+) Accelerogram points at (?P<rate>\d+) pts/sec in units of (?P<units>\S+)\. +"
        r"Format: \(8f9\.6\)"
    )
    return _blocks(
        text,
        " *uncorrected accel",
        head,
        9,
        lambda found, _: (1.0 / int(found["rate"]), 0.0) if int(found["rate"]) else (),
    )


def v2(text: str) -> Stated:
    """CSMIP V2: the printed step, to half of its last decimal."""
    head = (
        r" *(?P<count>\d+) points of accel data equally spaced at +(?P<dt>[\d.]+) sec, in (?P<units>\S+)\. \(8f10\.6\)"
    )

    def step(found: re.Match[str], _: list[str]) -> tuple[float, ...]:
        return (float(found["dt"]), 0.5 * 10.0 ** -len(found["dt"].partition(".")[2])) if "." in found["dt"] else ()

    return _blocks(text, " *corrected accel", head, 10, step)


def cosmos(text: str) -> Stated:
    """COSMOS with its step in milliseconds and in seconds in agreement; only files of one acceleration."""
    head = (
        r" *(?P<count>\d+) acceleration pts, approx +(?P<long>\d+) secs, units=(?P<units>[^(,]+)\(04\),"
        r"Format=\(8F10\.5\)"
    )
    if text.count(" pts, approx") != 1 or "Values used when" not in text:
        return None

    def step(found: re.Match[str], before: list[str]) -> tuple[float, ...]:
        reals = [line for line in before if re.fullmatch(r"(?: +-?\d+\.\d{6}){5}", line) and len(line) == 75]
        fields = [float(line[k : k + 15]) for line in reals for k in range(0, 75, 15)]
        agree = len(fields) == 100 and fields[61] / 1000.0 == fields[33]
        return (fields[33], 0.0) if agree and int(found["long"]) <= 1 else ()

    return _blocks(text, " *corrected accel", head, 10, step)


def table(text: str) -> Stated:
    """A table below one line of names with units, "time (s), a (g)"; times first, commas or semicolons between."""
    heading, *rows = text.rstrip("\n").split("\n")
    sign = ";" if ";" in text else ","
    names = [re.fullmatch(r' *"?([A-Za-z ]+) \(([^()]+)\)"? *', name) for name in heading.split(sign)]
    if not rows or len(names) < 2 or not all(names):
        return None
    (first, unit), *others = [(found[1], found[2]) for found in names if found]
    if not first.lower().startswith("time") or unit not in _SECONDS or any(each not in FACTORS for _, each in others):
        return None
    if any("time" in name.lower() or name.lower() in ("g", "s") for name, _ in others):
        return None
    cells = [[cell.strip() for cell in row.split(sign)] for row in rows]
    if sign == ";":
        cells = [[cell.replace(",", ".") for cell in row] for row in cells]
    if any(len(row) != len(names) or not all(map(_PLAIN.fullmatch, row)) for row in cells):
        return None
    columns = np.array(cells, dtype=np.float64).T
    decimals = max(len(row[0].partition(".")[2]) for row in cells)
    times, place = columns[0] * _SECONDS[unit], 10.0**-decimals * _SECONDS[unit]
    return [
        Said(len(rows), column * FACTORS[each], None, place, times)
        for column, (_, each) in zip(columns[1:], others, strict=True)
    ]


def column(text: str) -> Stated:
    """One column below "# acceleration, UNIT"; its step is given by who reads it."""
    heading, *rows = text.rstrip("\n").split("\n")
    found = re.fullmatch(r"# acceleration, (\S+)", heading)
    if found is None or found[1] not in FACTORS or not rows or not all(map(_PLAIN.fullmatch, rows)):
        return None
    return [Said(len(rows), np.array(rows, dtype=np.float64) * FACTORS[found[1]], None, 0.0)]


#: How each fixture is read here.
READINGS: Final[dict[str, Callable[[str], Stated]]] = {
    **dict.fromkeys(("nga.at2", "old.at2", "nga.vt2", "nga.dt2"), at2),
    **dict.fromkeys(("esm.asc", "velocity.asc"), esm),
    **dict.fromkeys(("knet.ns", "kiknet.ew2"), knet),
    **dict.fromkeys(("even.smc", "velocity.smc"), smc),
    **{"two.v1": v1, "two.v2": v2, "one.v2c": cosmos, "column.txt": column},
    **dict.fromkeys(("times.csv", "three.csv", "commas.csv"), table),
}


def stated(name: str, content: bytes) -> Stated:
    """What the file states that a fixture of this name has become; None where that is not clear."""
    text = content.decode("latin-1")
    if name not in READINGS or not _TEXT.fullmatch(text):
        return None
    with np.errstate(over="ignore"):
        return READINGS[name](text)


def contradiction(said: Said, acceleration: Floats, dt: float | None, times: Floats | None) -> str:
    """What a channel has otherwise than the file states, in a few words; nothing where it has all as stated."""
    if not said.count == len(said.values) == len(acceleration):
        return f"{len(acceleration)} values read, {len(said.values)} in the file, which states {said.count}"
    if not np.allclose(acceleration, said.values, rtol=1e-12, atol=0.0):
        return "values or their unit are others"
    if said.dt is not None and (dt is None or abs(dt - said.dt) > said.place + 1e-12 * said.dt):
        return f"the step is {dt} s, in the file {said.dt} s"
    if said.times is not None:
        taken = times if dt is None else said.times[0] + dt * np.arange(said.count)
        if taken is None or np.abs(taken - said.times).max() > 1.5 * said.place + 1e-6 * np.diff(said.times).max():
            return "the instants are others"
    return ""
