"""Limits of the parameters that pulses share."""

from typing import Final

from rocking import checks
from rocking.errors import InvalidMotion

MOST_CYCLES: Final = 100_000
#: Far beyond any ground motion, Hz.
_LOWEST: Final = 1e-9
_HIGHEST: Final = 1e6


def checked_frequency(frequency: float) -> float:
    """Return a frequency, Hz, or raise InvalidMotion if it is no pulse's."""
    checked = checks.positive(frequency, "frequency", InvalidMotion, "Hz")
    return checks.within(checked, "frequency of a pulse", InvalidMotion, _LOWEST, _HIGHEST, "Hz")
