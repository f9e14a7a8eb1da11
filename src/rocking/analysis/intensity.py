"""Intensity measures of a motion, and those that count it in a block's own units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.model import Model
from rocking.motion.motion import Motion

MeasureName = Literal["pga", "pgv", "sa", "pga_ratio", "pgv_ratio"]

_UNITS: Final[dict[str, str]] = {"pga": "m/s^2", "pgv": "m/s", "sa": "m/s^2", "pga_ratio": "1", "pgv_ratio": "1"}


@dataclass(frozen=True)
class Measure:
    """How intensity is measured.

    Parameters
    ----------
    name : {"pga", "pgv", "sa", "pga_ratio", "pgv_ratio"}
        Peak acceleration (m/s^2), peak velocity (m/s), spectral acceleration (m/s^2); or a block's own dimensionless
        ones: peak acceleration over the smallest that lifts it, PGA/(g tan alpha), and peak velocity over that
        acceleration in the block's time, p PGV/(g tan alpha). In the linear model alpha stands for tan alpha.
    period, damping : float
        Oscillator of "sa": s, and fraction of critical.

    Raises
    ------
    InvalidOption
        If there is no such measure, or `period` is missing or out of place.
    """

    name: MeasureName
    period: float | None = None
    damping: float = 0.05

    def __post_init__(self) -> None:
        checks.one_of(self.name, "measure", InvalidOption, get_args(MeasureName))
        if (self.name == "sa") != (self.period is not None):
            raise InvalidOption('period= (s) goes with measure="sa", and only with it')
        if self.period is not None:
            object.__setattr__(self, "period", checks.positive(self.period, "period", InvalidOption, "s"))
        damping = checks.number(self.damping, "damping", InvalidOption)
        if not 0.0 <= damping < 1.0:
            raise InvalidOption(f"damping must be a fraction of critical from 0 to below 1, not {damping:g}")
        object.__setattr__(self, "damping", damping)

    @property
    def units(self) -> str:
        """Units of the measure; "1" if it has none."""
        return _UNITS[self.name]

    @property
    def column(self) -> str:
        """Name with units for a table."""
        return {"pga": "pga_m_s2", "pgv": "pgv_m_s", "sa": "sa_m_s2"}.get(self.name, self.name)

    @property
    def scale(self) -> float:
        """Factor from SI units to those for people: accelerations in g."""
        return 1.0 / STANDARD_GRAVITY if self.units == "m/s^2" else 1.0

    @property
    def quantity(self) -> str:
        """Name in words."""
        if self.name == "sa":
            return f"spectral acceleration at {self.period:g} s"
        return {
            "pga": "peak ground acceleration",
            "pgv": "peak ground velocity",
            "pga_ratio": "PGA / (g tan α)",
            "pgv_ratio": "p PGV / (g tan α)",
        }[self.name]

    @property
    def label(self) -> str:
        """Name and units for people."""
        return self.quantity + (f" ({self.shown_in})" if self.shown_in else "")

    @property
    def shown_in(self) -> str:
        """Units for people; nothing if it has none."""
        return {"m/s^2": "g", "m/s": "m/s", "1": ""}[self.units]

    def shown(self, value: float) -> str:
        """Value, in SI units, with its unit; an acceleration in g, too."""
        if self.units == "m/s^2":
            return f"{value:.6g} m/s^2 ({value / STANDARD_GRAVITY:.4g} g)"
        return f"{value:.6g}" if self.units == "1" else f"{value:.6g} {self.units}"

    @property
    def of_motion(self) -> Literal["pga", "pgv", "sa"]:
        """Measure of the motion alone that this one counts."""
        return "sa" if self.name == "sa" else "pga" if self.name.startswith("pga") else "pgv"

    def of(self, motion: Motion) -> float:
        """Measure of the motion alone, in SI units."""
        if self.of_motion == "sa":
            assert self.period is not None
            return motion.spectral_acceleration(self.period, self.damping)
        return motion.pga if self.of_motion == "pga" else motion.pgv

    def unit_of(self, blocks: Blocks, model: Model) -> Floats:
        """Return what counts as 1 for each block, in SI units: the block's own unit, or 1."""
        if self.units != "1":
            return np.ones(len(blocks))
        lifting = np.array([min(block.uplift_thresholds(model)) for block in blocks])
        return lifting if self.name == "pga_ratio" else lifting / blocks.p.min(axis=1)

    def options(self) -> dict[str, float]:
        """Further arguments of `simulate_many` and `Motion.scaled`."""
        return {} if self.period is None else {"period": self.period, "damping": self.damping}


def intensities(values: ArrayLike) -> Floats:
    """Return intensities at which a curve is asked for, as an array of their shape.

    Raises
    ------
    InvalidOption
        If one is no number, or negative.
    """
    at = checks.numbers(values, "intensities", InvalidOption)
    if not np.all(at >= 0.0):
        raise InvalidOption("intensities must be numbers that are not negative")
    return at
