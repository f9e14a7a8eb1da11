"""Intensity measures of motions, and scale factors to their levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import add_unit
from rocking.errors import MotionError, OptionError
from rocking.motion.measures import DAMPING, MotionMeasures, check_damping

#: Intensity measures of the analyses.
IntensityName = Literal["pga", "pgv", "sa", "pga_ratio", "pgv_ratio"]
MeasureName = Literal["factor", "pga", "pgv", "sa", "pga_ratio", "pgv_ratio"]

INTENSITIES: Final[Sequence[str]] = get_args(IntensityName)
#: Measures of a motion alone.
SCALING_MEASURES: Final = ("factor", "pga", "pgv", "sa")

#: Unit, and name in words.
_UNITS_AND_NAMES: Final[dict[str, tuple[str, str]]] = {
    "factor": ("1", "factor of the motion"),
    "pga": ("m/s^2", "peak ground acceleration"),
    "pgv": ("m/s", "peak ground velocity"),
    "sa": ("m/s^2", "spectral acceleration"),
    "pga_ratio": ("1", "PGA / uplift acceleration"),
    "pgv_ratio": ("1", "p PGV / uplift acceleration"),
}


@dataclass(frozen=True)
class Measure:
    """Intensity measure of a motion.

    Parameters
    ----------
    name : {"factor", "pga", "pgv", "sa", "pga_ratio", "pgv_ratio"}
        Factor on the motion, peak acceleration (m/s^2), peak velocity (m/s), spectral acceleration (m/s^2), or a
        dimensionless measure of the block: "pga_ratio" is the peak acceleration divided by the uplift acceleration,
        "pgv_ratio" the peak velocity divided by the uplift acceleration and the time scale 1/p. For a free block these
        are PGA/(g tan alpha) and p PGV/(g tan alpha), in the linear model with alpha for tan alpha. Restraints and
        leaning change the uplift acceleration.
    period, damping : float, optional
        Period of the oscillator of "sa", s, and its fraction of critical damping.

    Raises
    ------
    OptionError
        If the measure is unknown, or `period` or `damping` is missing, out of place or out of range.

    See Also
    --------
    rocking.Motion.scaled_to : scale a motion to a level of a measure.
    rocking.compare_measures : compare the efficiency of measures.

    Examples
    --------
    >>> import rocking
    >>> measure = Measure("sa", period=1.0)
    >>> measure.label, measure.units
    ('spectral acceleration at 1 s (g)', 'm/s^2')
    """

    name: MeasureName
    period: float | None = None
    damping: float = DAMPING

    def __post_init__(self) -> None:
        checks.choice(self.name, "measure", OptionError, get_args(MeasureName))
        damping = check_damping(self.damping, OptionError)
        object.__setattr__(self, "damping", damping)
        if self.name == "sa":
            if self.period is None:
                raise OptionError('{} "sa" requires {}, in s', "measure", "period")
            object.__setattr__(self, "period", checks.positive(self.period, "period", OptionError, "s"))
        elif self.period is not None or damping != DAMPING:
            argument = "damping" if self.period is None else "period"
            raise OptionError(f'{{}} applies only to {{}} "sa", not to "{self.name}"', argument, "measure")

    @classmethod
    def parse(cls, measure: MeasureName | Measure, among: Sequence[str] = INTENSITIES) -> Measure:
        """Return a measure, or the measure with an accepted name."""
        name = measure.name if isinstance(measure, Measure) else measure
        checks.choice(name, "measure", OptionError, among)
        if isinstance(measure, Measure):
            return measure
        if measure == "sa":
            raise OptionError('{} "sa" requires a period, in s; use rocking.Measure("sa", period=1.0)', "measure")
        return cls(measure)

    @property
    def units(self) -> str:
        """Units of the measure, or "1"."""
        return _UNITS_AND_NAMES[self.name][0]

    @property
    def column(self) -> str:
        """Name with units for a table."""
        return add_unit(self.name, self.units)

    @property
    def display_factor(self) -> float:
        """Factor from SI units to display units: accelerations in g."""
        return 1.0 / STANDARD_GRAVITY if self.units == "m/s^2" else 1.0

    @property
    def quantity(self) -> str:
        """Name in words, with the damping unless it is 5 %."""
        return _UNITS_AND_NAMES[self.name][1] + ("" if self.period is None else f" at {self._oscillator_text}")

    @property
    def short_name(self) -> str:
        """Name for a table or a figure: PGA, PGV, SA(1 s), with the damping unless it is 5 %."""
        if self.period is not None:
            return f"SA({self._oscillator_text})"
        return self.name.upper() if self.name in ("pga", "pgv") else self.quantity

    @property
    def _oscillator_text(self) -> str:
        return f"{self.period:g} s" + ("" if self.damping == DAMPING else f", damping {self.damping:g}")

    @property
    def label(self) -> str:
        """Name and units for display."""
        return self.quantity + (f" ({self.display_unit})" if self.display_unit else "")

    @property
    def display_unit(self) -> str:
        """Units for display, empty for a dimensionless measure."""
        return {"m/s^2": "g", "m/s": "m/s", "1": ""}[self.units]

    def format_value(self, value: float) -> str:
        """Return a value with its unit, to six digits, and accelerations also in g."""
        if self.units == "m/s^2":
            return f"{value:.6g} m/s^2 ({value / STANDARD_GRAVITY:.4g} g)"
        return f"{value:.6g}" if self.units == "1" else f"{value:.6g} {self.units}"

    @property
    def motion_measure_name(self) -> Literal["factor", "pga", "pgv", "sa"]:
        """Name of the underlying measure of the motion alone."""
        return {"pga_ratio": "pga", "pgv_ratio": "pgv"}.get(self.name, self.name)  # type: ignore[return-value]

    @property
    def motion_measure(self) -> Measure:
        """Underlying measure of the motion alone."""
        return (
            self
            if self.motion_measure_name == self.name
            else Measure(self.motion_measure_name, self.period, self.damping)
        )

    def value(self, motion: MotionMeasures) -> float:
        """Return the measure of a motion alone, in SI units, or 1 if levels are factors."""
        if self.period is not None:
            return float(motion.spectral_acceleration(self.period, self.damping))
        if self.motion_measure_name == "factor":
            return 1.0
        return motion.pga if self.motion_measure_name == "pga" else motion.pgv

    def require_positive_value(self, motion: MotionMeasures, name: str) -> float:
        """Return `value`, or raise an error for a motion `name` that is zero throughout."""
        value = self.value(motion)
        if not value > 0.0:
            raise MotionError(f"{name} is zero throughout, so that it cannot be scaled to a {self.quantity}")
        return value

    @property
    def has_block_units(self) -> bool:
        """Whether the measure has a separate unit for each block."""
        return self.name in ("pga_ratio", "pgv_ratio")

    def unit(self, lifting: Floats, p: Floats) -> Floats:
        """Return the unit for each block (m/s^2 or m/s) from its uplift acceleration and its p, shape (n,).

        The p of a block with two sides is the smaller one.
        """
        return lifting if self.name == "pga_ratio" else lifting / p

    def options(self) -> dict[str, float]:
        """Return period (s) and damping of "sa", or nothing for other measures."""
        return {} if self.period is None else {"period": self.period, "damping": self.damping}

    def describe_scaling(self, level: float, factor: float) -> str:
        """Return the history sentence of a motion that was scaled to a level (SI units)."""
        if self.name == "factor":
            return f"scaled by {factor:.6g}"
        oscillator = "" if self.period is None else f" at {self.period:.6g} s, damping {self.damping:.6g}"
        return f"scaled by {factor:.6g} to a {_UNITS_AND_NAMES[self.name][1]} of {self.format_value(level)}{oscillator}"


#: Factor on unscaled motions.
FACTOR: Final = Measure("factor")


def check_intensities(values: ArrayLike) -> Floats:
    """Return the intensities of a curve as an array of the same shape."""
    intensities = checks.numbers(values, "intensities", OptionError)
    if not np.all(intensities >= 0.0):
        raise OptionError("intensities must be nonnegative numbers")
    return intensities
