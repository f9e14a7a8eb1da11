"""Units of acceleration and time, in all their spellings."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import RecordError

#: Values of the argument `units=`.
UNIT_NAMES = ("g", "m/s2", "cm/s2", "gal", "mm/s2", "mg")


class Unit(NamedTuple):
    """Unit with m/s^2 or s = value * multiplier / divisor, so that decimal units are rounded once."""

    name: str
    multiplier: float
    divisor: float

    def to_si(self, values: Floats) -> Floats:
        """Convert `values` of this unit to m/s^2 or s (infinite on overflow)."""
        with np.errstate(over="ignore"):
            return values * self.multiplier / self.divisor


SECOND = Unit("s", 1.0, 1.0)


def _index_by_spelling(units: dict[Unit, str]) -> dict[str, Unit]:
    return {spelling: unit for unit, spellings in units.items() for spelling in spellings.split()}


#: Units of time by spelling.
TIME_UNITS = _index_by_spelling(
    {
        SECOND: "s sec secs second seconds seg segundos sek sekunden secondes secondi",
        Unit("ms", 1.0, 1e3): "ms msec msecs millis millisecond milliseconds",
        Unit("us", 1.0, 1e6): "us µs μs usec microsecond microseconds",
        Unit("ns", 1.0, 1e9): "ns nsec nanosecond nanoseconds",
        Unit("min", 60.0, 1.0): "min mins minute minutes",
        Unit("h", 3600.0, 1.0): "h hr hrs hour hours",
        Unit("d", 86400.0, 1.0): "d day days",
    }
)

#: Units of acceleration by spelling without signs, such as "cms2" for "cm/s^2" and "cm_s2", "cmss" for "cm/sec/sec".
ACCELERATION_UNITS = _index_by_spelling(
    {
        Unit("g", STANDARD_GRAVITY, 1.0): "g gs",
        Unit("g/10", STANDARD_GRAVITY, 10.0): "g10",
        Unit("%g", STANDARD_GRAVITY, 100.0): "%g",
        Unit("mg", STANDARD_GRAVITY, 1000.0): "mg",
        Unit("m/s2", 1.0, 1.0): "ms2 mss",
        Unit("cm/s2", 1.0, 100.0): "cms2 cmss gal",
        Unit("mm/s2", 1.0, 1000.0): "mms2 mmss",
        Unit("um/s2", 1.0, 1e6): "ums2 µms2 μms2",
        Unit("nm/s2", 1.0, 1e9): "nms2",
        Unit("ft/s2", 3048.0, 1e4): "fts2 ftss",
        Unit("in/s2", 254.0, 1e4): "ins2 inss",
    }
)


def find_unit(spelling: str) -> Unit | None:
    """Return the unit spelled "CM/SEC/SEC", "cm/sec2", "cm/s^2", "cm/s²", "cm_s2", "gal", "G", ..., or None."""
    return ACCELERATION_UNITS.get(normalise_spelling(spelling))


def normalise_spelling(spelling: str) -> str:
    """Return a spelling without signs: "ms2" for "m/s^2", "mss" for "M/SEC/SEC"."""
    plain = re.sub(r"[\s^*._/·'’]", "", spelling.lower().replace("²", "2").replace("⁻", "-"))
    return plain.replace("sec", "s").replace("s-2", "s2")


def find_time_unit(spelling: str) -> Unit | None:
    """Return the unit of time spelled "ms", "Sec.", "minutes", ..., or None."""
    return TIME_UNITS.get(spelling.strip().rstrip(".").lower())


def choose_unit(units: str) -> Unit:
    """Return the unit named by a user."""
    unit = find_unit(units) if isinstance(units, str) else None
    if unit is None or unit.name not in UNIT_NAMES:
        text = f"the {{}} {units!r} are unknown; use one of {', '.join(UNIT_NAMES)}"
        raise RecordError(text, "units", value=units)
    return unit
