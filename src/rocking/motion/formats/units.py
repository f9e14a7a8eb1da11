"""Units of acceleration, as users name them and as record files spell them."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.constants import STANDARD_GRAVITY
from rocking.errors import UnreadableRecord

#: What the argument `units=` takes.
CHOICES = ("g", "m/s2", "cm/s2", "gal", "mm/s2", "mg")


class Unit(NamedTuple):
    """One unit of acceleration: m/s^2 = value * multiplier / divisor, so that decimal units round once."""

    name: str
    multiplier: float
    divisor: float

    def to_si(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `values` of this unit in m/s^2 (infinite where that overflows)."""
        with np.errstate(over="ignore"):
            return values * self.multiplier / self.divisor


_G_TENTH = Unit("g/10", STANDARD_GRAVITY, 10.0)
_M = Unit("m/s2", 1.0, 1.0)
_CM = Unit("cm/s2", 1.0, 100.0)
_MM = Unit("mm/s2", 1.0, 1000.0)

#: Units by their spelling without signs: "cm/s^2", "cm/sec/sec" and "cm_s2" are "cms2" or "cmss".
_UNITS = {
    "g": Unit("g", STANDARD_GRAVITY, 1.0),
    "g10": _G_TENTH,
    "mg": Unit("mg", STANDARD_GRAVITY, 1000.0),
    "ms2": _M,
    "mss": _M,
    "cms2": _CM,
    "cmss": _CM,
    "gal": _CM,
    "mms2": _MM,
    "mmss": _MM,
}


def find_unit(spelling: str) -> Unit | None:
    """Return the unit that one spells "CM/SEC/SEC", "cm/sec2", "cm/s^2", "cm/s²", "cm_s2", "gal", "G", ..., or None."""
    plain = spelling.lower().replace("²", "2").replace("s-2", "s2").replace("s⁻2", "s2")
    return _UNITS.get(re.sub(r"[\s^*._/·]", "", plain).replace("sec", "s"))


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
