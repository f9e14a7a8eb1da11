"""Units of acceleration, as users name them and as record files spell them."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.constants import STANDARD_GRAVITY
from rocking.errors import UnreadableRecord

#: What the argument `units=` takes.
CHOICES = ("g", "m/s2", "cm/s2", "gal", "mm/s2")


class Unit(NamedTuple):
    """One unit of acceleration: m/s^2 = value * multiplier / divisor, so that decimal units round once."""

    name: str
    multiplier: float
    divisor: float

    def to_si(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `values` of this unit in m/s^2 (infinite where that overflows)."""
        with np.errstate(over="ignore"):
            return values * self.multiplier / self.divisor


_UNITS = {
    "g": Unit("g", STANDARD_GRAVITY, 1.0),
    "g/10": Unit("g/10", STANDARD_GRAVITY, 10.0),
    "m/s2": Unit("m/s2", 1.0, 1.0),
    "cm/s2": Unit("cm/s2", 1.0, 100.0),
    "gal": Unit("cm/s2", 1.0, 100.0),
    "mm/s2": Unit("mm/s2", 1.0, 1000.0),
}


def find_unit(spelling: str) -> Unit | None:
    """Return the unit that a file spells "CM/SEC/SEC", "cm/sec2", "cm/s^2", "gal", "G", ..., or None."""
    plain = re.sub(r"[\s^*.]", "", spelling.lower()).replace("sec", "s").replace("/s/s", "/s2")
    return _UNITS.get(plain)


def choose_unit(units: str) -> Unit:
    """Return the unit that a user names.

    Raises
    ------
    UnreadableRecord
        If it is none of CHOICES.
    """
    unit = find_unit(units) if isinstance(units, str) else None
    if unit is None or unit.name not in CHOICES:
        raise UnreadableRecord(f"the units {units!r} are not known; give one of {', '.join(CHOICES)}")
    return unit
