"""Numbers as text: with a unit, in pairs, in lists and in ranges."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.distributions import Distribution, normal
from rocking.core.tables import round_decimal
from rocking.errors import OptionError, escape_braces, join_placeholders
from rocking.motion.scaling import FACTOR, Measure
from rocking.records.units import ACCELERATION_UNITS, TIME_UNITS, Unit, normalise_spelling

#: Reader of one number: converts its text, with the name of its argument, to SI units.
NumberReader = Callable[[str, str], float]

#: Maximum count of numbers in a range.
_MAX_COUNT: Final = 100_000

_NUMBER_AND_UNIT: Final = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf|nan)\s*(\D.*?)?\s*", re.IGNORECASE
)

_SI_UNIT: Final = Unit("", 1.0, 1.0)
_DEGREE: Final = Unit("deg", math.pi / 180.0, 1.0)


def _index_units(*units: Unit, **spellings: str) -> dict[str, Unit]:
    """Return units by their plain spellings, with the unit of a number without one, and further spellings."""
    units_by_name = {normalise_spelling(unit.name): unit for unit in units}
    alternatives = {spelling: units_by_name[name] for name, line in spellings.items() for spelling in line.split()}
    return {"": _SI_UNIT, **units_by_name, **alternatives}


_METRIC_LENGTHS: Final = (_SI_UNIT._replace(name="m"), Unit("cm", 1.0, 100.0), Unit("mm", 1.0, 1000.0))
_LENGTHS: Final = _index_units(*_METRIC_LENGTHS, Unit("ft", 3048.0, 1e4), Unit("in", 254.0, 1e4))
_ANGLES: Final = _index_units(_SI_UNIT._replace(name="rad"), _DEGREE, deg="° º degree degrees", rad="radian radians")
_VELOCITIES: Final = _index_units(*(unit._replace(name=f"{name}/s") for name, unit in _LENGTHS.items() if name))
_RATES: Final = _index_units(_SI_UNIT._replace(name="rad/s"), _DEGREE._replace(name="deg/s"), degs="°s")

#: Units by their plain spellings, in SI units and radians: the single list, also used by the page of the explorer.
UNITS: Final[Mapping[str, Mapping[str, Unit]]] = {
    "length": _LENGTHS,
    "position": _LENGTHS,
    "angle": _ANGLES,
    "acceleration": {"": _SI_UNIT, **ACCELERATION_UNITS},
    "velocity": _VELOCITIES,
    "frequency": _index_units(_SI_UNIT._replace(name="Hz"), Unit("rad/s", 0.5 / math.pi, 1.0)),
    "rate": _RATES,
    "duration": {"": _SI_UNIT, **{normalise_spelling(name): unit for name, unit in TIME_UNITS.items()}},
    "number": {"": _SI_UNIT},
}


def read_number(text: str, name: str) -> float:
    """Return a number without a unit."""
    value, unit = _split_unit(text)
    if value is None or unit:
        raise OptionError(f"{{}} must be a number, not {text.strip()!r}", name, value=text)
    return value


def _create_reader(units: Mapping[str, Unit], expected: str) -> NumberReader:
    """Return a reader of a number with or without one of some units."""

    def read(text: str, name: str) -> float:
        value, spelling = _split_unit(text)
        unit = units.get(normalise_spelling(spelling))
        if value is None or unit is None:
            raise OptionError(f"{{}} must be {expected}, not {text.strip()!r}", name, value=text)
        return value * unit.multiplier / unit.divisor

    return read


read_acceleration: Final = _create_reader(UNITS["acceleration"], "an acceleration, as 0.5g, 4.9m/s2 or 4.9 (m/s^2)")
read_angle: Final = _create_reader(UNITS["angle"], "an angle, as 12deg or 0.2 (rad)")
read_duration: Final = _create_reader(UNITS["duration"], "a time, as 1.5 (s)")
read_frequency: Final = _create_reader(UNITS["frequency"], "a frequency, as 2Hz, 12.6rad/s or 2 (Hz)")
read_position: Final = _create_reader(UNITS["position"], "a length, as 0.2, 0.2m or 20cm")
read_rate: Final = _create_reader(UNITS["rate"], "an angular velocity, as 2, 2rad/s or 5deg/s")
read_velocity: Final = _create_reader(UNITS["velocity"], "a velocity, as 40cm/s or 0.4 (m/s)")


def read_length(text: str, name: str) -> float:
    """Return a positive length, m, from "0.2m", "20cm" or "0.2" (m)."""
    value = read_position(text, name)
    if not value > 0.0:
        raise OptionError(f"{{}} must be a positive length, in m, not {text.strip()}", name, value=text)
    return value


def read_tilt(text: str, name: str) -> float:
    """Return the angle of a standing block, rad, below pi/2, with an explicit unit for degrees."""
    value = read_angle(text, name)
    if abs(value) < 0.5 * math.pi:
        return value
    number = text.strip()
    message = f"{{}} must be below 90deg in size, not {number}"
    if abs(value) < 90.0 and not _split_unit(text)[1]:
        message = f"{{}} must be below pi/2 rad; got {number}, which is read as rad; did you mean {number}deg?"
    raise OptionError(message, name, value=text)


def read_sides(text: str, name: str, reader: NumberReader = read_number) -> float | list[float]:
    """Return one number, or a list of two: side + and side -."""
    return _read_one_or_two(text, name, reader, "a number, or two numbers separated by a comma (side +, side -)")


def read_bounds(text: str, name: str, reader: NumberReader = read_number) -> float | tuple[float, ...]:
    """Return one known number, or two: the lowest and highest plausible values."""
    expected = "a known number, or the lowest and the highest plausible number, separated by a comma"
    numbers = _read_one_or_two(text, name, reader, expected)
    return tuple(numbers) if isinstance(numbers, list) else numbers


def _read_one_or_two(text: str, name: str, reader: NumberReader, expected: str) -> float | list[float]:
    numbers = [reader(part, name) for part in text.split(",")]
    if len(numbers) > 2:
        raise OptionError(f"{{}} must be {expected}, not {text!r}", name, value=text)
    return numbers[0] if len(numbers) == 1 else numbers


#: Sign between the mean and the standard deviation of an uncertain number.
PLUS_MINUS: Final = re.compile(r"\+-|±|\+/-")


def read_uncertain(text: str, name: str, reader: NumberReader = read_number) -> Distribution:
    """Return the normal distribution of "0.30 +- 0.02" (mean and standard deviation) or "30 +- 2 cm"."""
    mean, deviation = PLUS_MINUS.split(text, maxsplit=1)
    unit = "" if _split_unit(mean)[1] else _split_unit(deviation)[1]
    try:
        return normal(reader(mean + unit, name), reader(deviation, name))
    except OptionError:
        message = "{} must be a mean and a positive standard deviation, as 0.30 +- 0.02 or 30 +- 2 cm, not "
        raise OptionError(message + escape_braces(repr(text.strip())), name, value=text) from None


def read_axis(value: Any, name: str, reader: NumberReader = read_number) -> Floats:
    """Return the numbers of an entry of a study file: one, a list, or a range."""
    if isinstance(value, str):
        return read_array(value, name, reader)
    entries = value if isinstance(value, list) else [value]
    return np.array([reader(entry if isinstance(entry, str) else repr(entry), name) for entry in entries])


def read_array(text: str, name: str, reader: NumberReader = read_number) -> Floats:
    """Return numbers from "1,2,5" or from "START:STOP:COUNT", with ":log" at the end for equal ratios."""
    parts = text.split(":")
    if len(parts) == 1:
        return np.array([reader(part, name) for part in text.split(",")])
    requirement, is_logarithmic = "numbers, as 1,2,5, or a range START:STOP:COUNT[:log]", parts[3:] == ["log"]
    if len(parts) in (3, 4) and parts[2].strip().isdecimal() and (len(parts) == 3 or is_logarithmic):
        start, stop, count = reader(parts[0], name), reader(parts[1], name), int(parts[2])
        if not 2 <= count <= _MAX_COUNT:
            requirement = f"a range START:STOP:COUNT with a COUNT from 2 to {_MAX_COUNT}"
        elif not math.isfinite(stop - start):
            requirement = "a range with finite ends"
        elif is_logarithmic and not min(start, stop) > 0.0:
            requirement = "a range with positive ends because of :log"
        else:
            numbers = np.geomspace(start, stop, count) if is_logarithmic else np.linspace(start, stop, count)
            return np.array([round_decimal(number) for number in numbers])  # 0.3, not 0.30000000000000004
    raise OptionError(f"{{}} must be {requirement}, not {text!r}", name, value=text)


def read_level_at_period(text: str, name: str, reader: NumberReader = read_acceleration) -> tuple[float, float]:
    """Return an acceleration, m/s^2, and a period, s, from "0.4g@1.0"."""
    level, separator, period = text.partition("@")
    if not separator:
        raise OptionError(f"{{}} must be an acceleration at a period, as 0.4g@1.0, not {text!r}", name, value=text)
    return reader(level, name), read_duration(period, name)


def read_scaling(
    texts: Mapping[str, str | float | None], reader: NumberReader = read_acceleration
) -> tuple[float, Measure] | None:
    """Return the level to which a motion is scaled and its measure, or None without a level."""
    options = {name: value for name, value in texts.items() if value is not None}
    if not options:
        return None
    if len(options) > 1:
        raise OptionError(f"{join_placeholders(options)} scale the same motion; use only one of them", *options)
    ((name, value),) = options.items()
    if name == "pga":
        return checks.finite(reader(str(value), name), name, OptionError), Measure("pga")
    if name == "sa":
        numbers = read_level_at_period(str(value), name, reader)
        level, period = (checks.finite(number, name, OptionError) for number in numbers)
        return level, Measure("sa", period)
    read = read_number if name == "scale" else read_velocity
    number = read(value, name) if isinstance(value, str) else float(value)
    if name == "scale":
        return checks.finite(number, name, OptionError), FACTOR
    return checks.positive(number, name, OptionError, "m/s"), Measure("pgv")


def _split_unit(text: str) -> tuple[float | None, str]:
    """Split a text into its number, or None, and its unit."""
    match = _NUMBER_AND_UNIT.fullmatch(text)
    return (None, "") if match is None else (float(match[1]), match[2] or "")


def read_length_unit(text: str, name: str) -> str | float:
    """Return the name of a unit of length, or its length, m."""
    return text if text.isalpha() else read_number(text, name)


def read_densities(text: str, name: str) -> float | dict[str, float]:
    """Return one density, kg/m^3, or densities of parts by name from entries PART=NUMBER."""
    if "=" not in text:
        return read_number(text, name)
    densities = {}
    for entry in text.split(","):
        part, equals, value = entry.rpartition("=")
        if not equals:
            message = f"{{}} must be a number, or PART=NUMBER separated by commas, not {escape_braces(repr(text))}"
            raise OptionError(message, name, value=text)
        densities[part.strip()] = read_number(value, name)
    return densities
