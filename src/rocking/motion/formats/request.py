"""What the caller says about a file, reconciled with what the file says."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rocking import checks
from rocking.errors import InvalidMotion
from rocking.motion.formats.source import Source
from rocking.motion.formats.units import CHOICES, Unit, choose_unit

_SAME_STEP = 1e-6


@dataclass(frozen=True)
class Request:
    """The arguments `dt` (s) and `units` of a read; None where the file should know.

    Where they are given for several files at once they are for those that do not say; for one alone they must not
    contradict it.
    """

    dt: float | None = None
    unit: Unit | None = None
    several: bool = False

    @classmethod
    def checked(cls, dt: float | None, units: str | None, *, several: bool = False) -> Request:
        """Return the request.

        Raises
        ------
        InvalidMotion
            If `dt` is not a positive number.
        UnreadableRecord
            If the units are not known.
        """
        return cls(
            None if dt is None else checks.positive(dt, "dt", InvalidMotion, "s"),
            None if units is None else choose_unit(units),
            several,
        )

    def step(self, source: Source, stated: float, at: int | None) -> float:
        """Return the step (s) that the file states at the offset `at`.

        Raises
        ------
        UnreadableRecord
            If it is not positive, or `dt` says otherwise.
        """
        # No file holds more samples than bytes, so this also bounds the record's length.
        if not (stated > 0.0 and math.isfinite(stated * len(source.raw))):
            raise source.error(f"the sampling step is {stated:g} s, but it must be positive; correct it", at)
        if self.dt is not None and not self.several and not math.isclose(self.dt, stated, rel_tol=_SAME_STEP):
            raise source.error(f"the sampling step is {stated:g} s, not dt = {self.dt:g} s; leave dt out", at)
        return stated

    def units(self, source: Source, stated: Unit | None, at: int | None) -> Unit:
        """Return the unit that the file states at the offset `at`, or else the one asked for.

        Raises
        ------
        UnreadableRecord
            If there is neither, or the two differ.
        """
        unit = stated or self.unit
        if unit is None:
            raise source.error(
                f"the file does not say its units; give {{}}= as one of {', '.join(CHOICES)}", at, "units"
            )
        if self.unit is not None and not self.several and unit != self.unit:
            raise source.error(f"the units are {unit.name}, not units = {self.unit.name!r}; leave units out", at)
        return unit

    def units_by_heading(self, source: Source, heading: Unit | None, at: int | None) -> Unit:
        """Return the unit that a heading in the file's own words names, or the one asked for, which overrules it.

        Raises
        ------
        UnreadableRecord
            If there is neither.
        """
        if self.several and heading is not None:
            return heading
        return self.units(source, None if self.unit is not None else heading, at)
