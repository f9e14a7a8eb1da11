"""Intensity measures of motions, and scale factors to their levels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import add_unit
from rocking.errors import MotionError, OptionError, escape_braces
from rocking.motion.measures import DEFAULT_DAMPING, MotionMeasures, check_damping
from rocking.motion.pairs import compute_directional_peaks, compute_directional_spectrum, iterate_directions

#: Intensity measures of the analyses.
IntensityName = Literal[
    "pga", "pgv", "pgd", "sa", "sa_average", "arias", "cav", "incremental_velocity", "duration", "pga_ratio",
    "pgv_ratio",
]  # fmt: skip
MeasureName = Literal["factor"] | IntensityName

#: Horizontal component or combination of both.
ComponentName = Literal["own", "geometric_mean", "larger", "rotd50", "rotd100"]

INTENSITIES: Final[Sequence[str]] = get_args(IntensityName)


class _Quantity(NamedTuple):
    """Unit, name in words, short name, and power of the factor on a motion by which the measure changes."""

    unit: str
    name: str
    short_name: str = ""
    exponent: int = 1


_QUANTITIES: Final[dict[str, _Quantity]] = {
    "factor": _Quantity("1", "factor of the motion"),
    "pga": _Quantity("m/s^2", "peak ground acceleration", "PGA"),
    "pgv": _Quantity("m/s", "peak ground velocity", "PGV"),
    "pgd": _Quantity("m", "peak ground displacement", "PGD"),
    "sa": _Quantity("m/s^2", "spectral acceleration", "SA"),
    "sa_average": _Quantity("m/s^2", "average spectral acceleration", "average SA"),
    "arias": _Quantity("m/s", "Arias intensity", "Arias intensity", 2),
    "cav": _Quantity("m/s", "cumulative absolute velocity", "CAV"),
    "incremental_velocity": _Quantity("m/s", "incremental velocity", "incremental velocity"),
    "duration": _Quantity("s", "significant duration D5-95", "D5-95", 0),
    "pga_ratio": _Quantity("1", "PGA / uplift acceleration"),
    "pgv_ratio": _Quantity("1", "p PGV / uplift acceleration"),
}

#: Measures of a motion alone to which it can be scaled.
SCALING_MEASURES: Final = tuple(
    name for name, quantity in _QUANTITIES.items() if quantity.exponent and not name.endswith("_ratio")
)

_COMPONENTS: Final[dict[str, str]] = {
    "own": "", "geometric_mean": "geometric mean", "larger": "larger component", "rotd50": "RotD50",
    "rotd100": "RotD100",
}  # fmt: skip


@dataclass(frozen=True)
class Measure:
    """Intensity measure of a motion.

    Parameters
    ----------
    name : str
        Name of the measure:

        - "pga", "pgv", "pgd": peak acceleration (m/s^2), velocity (m/s), displacement (m)
        - "sa": spectral acceleration (m/s^2) at a period
        - "sa_average": geometric mean of spectral accelerations (m/s^2) at several periods
        - "arias": Arias intensity (m/s); "cav": cumulative absolute velocity (m/s)
        - "incremental_velocity": `Motion.incremental_velocity` (m/s)
        - "duration": significant duration D5-95 (s), to which motions cannot be scaled
        - "pga_ratio", "pgv_ratio": dimensionless measures of the block, namely the peak acceleration divided by the
          uplift acceleration, and the peak velocity divided by the uplift acceleration and the time scale 1/p. For a
          free block these are PGA/(g tan alpha) and p PGV/(g tan alpha), in the linear model with alpha for tan alpha.
          Restraints and leaning change the uplift acceleration.
        - "factor": factor on the motion
    period : float or sequence of float, optional
        Period of the oscillator of "sa", or periods of "sa_average", s.
    damping : float, optional
        Fraction of critical damping of "sa" and "sa_average".
    component : {"own", "geometric_mean", "larger", "rotd50", "rotd100"}
        Component of the ground motion: the motion itself, or for motions with an orthogonal component
        (`records.load_pairs`) the geometric mean or the larger value of both, or the median or the largest value over
        all directions in steps of 1 degree :cite:p:`boore2010`.

    Raises
    ------
    OptionError
        If the measure or component is unknown, or `period` or `damping` is missing, out of place or out of range.

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
    >>> Measure("pgv", component="rotd50").label
    'peak ground velocity, RotD50 (m/s)'
    """

    name: MeasureName
    period: float | tuple[float, ...] | None = None
    damping: float = DEFAULT_DAMPING
    component: ComponentName = "own"

    def __post_init__(self) -> None:
        checks.choice(self.name, "measure", OptionError, [*_QUANTITIES])
        checks.choice(self.component, "component", OptionError, get_args(ComponentName))
        damping = check_damping(self.damping, OptionError)
        object.__setattr__(self, "damping", damping)
        if self.name == "factor" and self.component != "own":
            raise OptionError('{} does not apply to {} "factor"', "component", "measure")
        if self.name in ("sa", "sa_average"):
            if self.period is None:
                needed = "{}, in s" if self.name == "sa" else "several values of {}, in s, for example (0.5, 1.0, 2.0)"
                raise OptionError(f'{{}} "{self.name}" requires {needed}', "measure", "period")
            if self.name == "sa":
                periods: Any = checks.positive(self.period, "period", OptionError, "s")
            else:
                periods = tuple(checks.increasing_numbers(self.period, "period", OptionError).tolist())
            object.__setattr__(self, "period", periods)
        elif self.period is not None or damping != DEFAULT_DAMPING:
            argument = "damping" if self.period is None else "period"
            raise OptionError(f'{{}} applies only to {{}} "sa", not to "{self.name}"', argument, "measure")

    @classmethod
    def parse(cls, measure: MeasureName | Measure, names: Sequence[str] = INTENSITIES) -> Measure:
        """Return a measure, or the measure with an accepted name."""
        name = measure.name if isinstance(measure, Measure) else measure
        checks.choice(name, "measure", OptionError, names)
        if isinstance(measure, Measure):
            return measure
        if measure in ("sa", "sa_average"):
            example = 'a period, in s; use rocking.Measure("sa", period=1.0)'
            if measure == "sa_average":
                example = 'periods, in s; use rocking.Measure("sa_average", period=(0.5, 1.0, 2.0))'
            raise OptionError(f'{{}} "{measure}" requires {example}', "measure")
        return cls(measure)

    @property
    def units(self) -> str:
        """Units of the measure, or "1"."""
        return _QUANTITIES[self.name].unit

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
        """Name in words, with the component of a pair, and the damping unless it is 5 %."""
        return self._add_oscillator(_QUANTITIES[self.name].name, " at {}")

    @property
    def short_name(self) -> str:
        """Name for a table or a figure: PGA, PGV, SA(1 s), with the damping unless it is 5 %."""
        quantity = _QUANTITIES[self.name]
        return self._add_oscillator(quantity.short_name or quantity.name, "({})")

    def _add_oscillator(self, name: str, oscillator: str) -> str:
        """Add oscillator and component to a name."""
        name += "" if self.period is None else oscillator.format(self._oscillator_text)
        return name if self.component == "own" else f"{name}, {_COMPONENTS[self.component]}"

    @property
    def _periods_text(self) -> str:
        periods = np.ravel([] if self.period is None else self.period)
        return " to ".join(f"{period:.6g}" for period in np.unique(periods[[0, -1]])) + " s"

    @property
    def _oscillator_text(self) -> str:
        return self._periods_text + ("" if self.damping == DEFAULT_DAMPING else f", damping {self.damping:g}")

    @property
    def label(self) -> str:
        """Name and units for display."""
        return self.quantity + (f" ({self.display_unit})" if self.display_unit else "")

    @property
    def display_unit(self) -> str:
        """Units for display, empty for a dimensionless measure."""
        return {"m/s^2": "g", "1": ""}.get(self.units, self.units)

    def format_value(self, value: float) -> str:
        """Return a value with its unit, to six digits, and accelerations also in g."""
        if self.units == "m/s^2":
            return f"{value:.6g} m/s^2 ({value / STANDARD_GRAVITY:.4g} g)"
        return f"{value:.6g}" if self.units == "1" else f"{value:.6g} {self.units}"

    @property
    def motion_measure_name(self) -> str:
        """Name of the underlying measure of the motion alone."""
        return self.name.removesuffix("_ratio")

    @property
    def motion_measure(self) -> Measure:
        """Underlying measure of the motion alone."""
        name = self.motion_measure_name
        return self if name == self.name else replace(self, name=name)  # type: ignore[arg-type]

    def value(self, motion: MotionMeasures) -> float:
        """Return the measure of a motion (of its pair, unless the component is "own"), in SI units, or 1 for factors.

        Raises `MotionError` if the component requires a pair and the motion has no orthogonal component.
        """
        if self.component == "own":
            return self._compute(motion)
        values = motion.__dict__.setdefault("_pair_values", {})
        if self not in values:
            values[self] = self._compute_pair(motion)
        return float(values[self])

    def _compute_pair(self, motion: MotionMeasures) -> float:
        """Compute the measure of a pair, which takes longer."""
        orthogonal = motion.other_horizontal
        if orthogonal is None:
            message = (
                f"the {self.quantity} requires two horizontal components, and {escape_braces(motion.name)} has one; "
            )
            raise MotionError(message + "use records.load_pairs, or with_orthogonal")
        if self.component.startswith("rotd"):
            return self._compute_rotated(motion, orthogonal)
        values = [self._compute(part) for part in (motion, orthogonal)]
        return max(values) if self.component == "larger" else math.sqrt(values[0] * values[1])

    def _compute(self, motion: MotionMeasures) -> float:
        """Compute the measure of one component."""
        if self.name == "sa_average":
            return float(_average(motion.spectral_acceleration(np.ravel(self.period), self.damping)))  # type: ignore[arg-type]
        if isinstance(self.period, float):
            return float(motion.spectral_acceleration(self.period, self.damping))
        if self.name == "duration":
            return motion.significant_duration()
        names = {"arias": "arias_intensity", "cav": "cumulative_absolute_velocity"}
        name = self.motion_measure_name
        return 1.0 if name == "factor" else float(getattr(motion, names.get(name, name)))

    def _compute_rotated(self, motion: MotionMeasures, orthogonal: MotionMeasures) -> float:
        """Compute the median or the largest value of the measure over all directions."""
        reduce, name = (np.median if self.component == "rotd50" else np.max), self.motion_measure_name
        if self.period is not None:
            periods = np.ravel(self.period).tolist()
            values = [compute_directional_spectrum(motion, orthogonal, period, self.damping) for period in periods]
            return float(reduce(_average(values)))
        if name in ("pga", "pgv", "pgd"):
            return float(reduce(compute_directional_peaks(motion, orthogonal, ("pga", "pgv", "pgd").index(name))))
        return float(reduce([self._compute(rotated) for rotated in iterate_directions(motion, orthogonal)]))

    def find_factor(self, level: Any, value: Any) -> Any:
        """Return the factor on a motion with a value of the measure that scales it to a level, elementwise."""
        ratio = np.asarray(level) / value
        return ratio if self.exponent == 1 else ratio ** (1.0 / self.exponent)

    @property
    def exponent(self) -> int:
        """Power of the factor on a motion by which the measure changes: 2 for "arias", 0 for "duration", else 1."""
        return _QUANTITIES[self.name].exponent

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

    def block_units(self, uplift_accelerations: Floats, p: Floats) -> Floats:
        """Return the unit for each block (m/s^2 or m/s) from its uplift acceleration and its p, shape (n,).

        The p of a block with two sides is the smaller one.
        """
        return uplift_accelerations if self.name == "pga_ratio" else uplift_accelerations / p

    def options(self) -> dict[str, Any]:
        """Return period (s) and damping of spectral accelerations, and the component unless it is the motion's own."""
        component = {} if self.component == "own" else {"component": self.component}
        return component if self.period is None else {"period": self.period, "damping": self.damping, **component}

    def describe_scaling(self, level: float, factor: float) -> str:
        """Return the history sentence of a motion that was scaled to a level (SI units)."""
        if self.name == "factor":
            return f"scaled by {factor:.6g}"
        name, value = _QUANTITIES[self.name].name, self.format_value(level)
        component = "" if self.component == "own" else f" ({_COMPONENTS[self.component]})"
        oscillator = "" if self.period is None else f" at {self._periods_text}, damping {self.damping:.6g}"
        return f"scaled by {factor:.6g} to a {name}{component} of {value}{oscillator}"


def _average(values: ArrayLike) -> Floats:
    """Compute geometric means over the first axis."""
    with np.errstate(divide="ignore"):  # of zero
        return np.asarray(np.exp(np.mean(np.log(values), axis=0)))


#: Factor on unscaled motions.
FACTOR: Final = Measure("factor")


def check_intensities(values: ArrayLike) -> Floats:
    """Return the intensities of a curve as an array of the same shape."""
    intensities = checks.numbers(values, "intensities", OptionError)
    if not np.all(intensities >= 0.0):
        raise OptionError("intensities must be nonnegative numbers")
    return intensities
