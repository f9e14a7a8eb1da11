"""Repeated simulations with the motion or the initial state scaled by factors near 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import CoordinateLabels
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.result import Result
from rocking.core.tables import Column, columns_to_records, format_columns
from rocking.errors import OptionError

#: Relative step and number of factors in summaries and tables.
RELATIVE_STEP: Final = 1e-6
FACTOR_COUNT: Final = 5

#: Relative precision of a ground motion, and number of factors within it, in summaries and tables.
MOTION_PRECISION: Final = 1e-3
_PRECISION_FACTOR_COUNT: Final = 11

#: Outcomes. A block that does not move also stands.
OVERTURNS: Final = "overturns"
UNMOVED: Final = "does not move"
STANDS: Final = "stands"


class Repeat(NamedTuple):
    """One repeated simulation: factor, outcome, peak, times (s; NaN if there is none) and events.

    See Also
    --------
    rocking.response.PerturbedSimulations : Collect repeated simulations.
    rocking.Response.perturbed : Repeat a simulation.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> perturbed = rocking.simulate(block, rocking.pulses.one_sine(amplitude=3.0, frequency=2.0)).perturbed(1e-3)
    >>> repeat = perturbed.repeats[0]
    >>> f"{repeat.factor:.3f}: {repeat.outcome}, peak {repeat.peak:.4f} rad"
    '0.997: stands, peak 0.0660 rad'
    """

    factor: float
    outcome: str
    peak: float
    peak_time: float
    overturn_time: float
    last_rest: float
    events: NDArray[np.void]


@dataclass(frozen=True, eq=False, repr=False)
class PerturbedSimulations(Result):
    """Repeated simulations with the motion or the initial state scaled, from `Response.perturbed`.

    The table "repeats" has a row for each factor.

    Attributes
    ----------
    relative_step : float
        Relative step of the factors.
    repeats : tuple of Repeat
        Factor, outcome, peak (rad), peak_time, overturn_time, last_rest (s; NaN if there is none) and events of each
        simulation, by ascending factor. The middle one has factor 1.
    coordinate : CoordinateLabels
        Name and unit of the coordinate.
    scaled_input : str
        Scaled input: "motions" or "initial states".

    See Also
    --------
    rocking.Response.perturbed : Repeat a simulation.
    rocking.response.Repeat : Describe one repeated simulation.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> perturbed = rocking.simulate(block, rocking.pulses.one_sine(amplitude=3.0, frequency=2.0)).perturbed()
    >>> perturbed.is_decided, perturbed.describe_outcome()
    (True, 'stands in 5 of 5 motions within 3e-6')
    """

    TABLES = ("repeats",)

    relative_step: float
    repeats: tuple[Repeat, ...]
    coordinate: CoordinateLabels
    scaled_input: str

    @property
    def max_deviation(self) -> float:
        """Largest relative distance of a factor from 1."""
        return self.relative_step * max(1, len(self.repeats) - 2)

    @property
    def sample_text(self) -> str:
        """Text with the number of simulations, the scaled input and the range of factors."""
        return f"{len(self.repeats)} {self.scaled_input} within {format_percent(self.max_deviation)}"

    @property
    def factors(self) -> Floats:
        """Factors on the motion or the initial state."""
        return np.array([repeat.factor for repeat in self.repeats])

    @property
    def overturned(self) -> Flags:
        """Whether the block overturns, for each factor."""
        return np.array([repeat.outcome == OVERTURNS for repeat in self.repeats])

    @property
    def is_decided(self) -> bool:
        """Whether the outcome is the same for all factors."""
        return len({_merge_unmoved(repeat.outcome) for repeat in self.repeats}) == 1

    @property
    def peak_range(self) -> tuple[float, float]:
        """Smallest and largest peak among the simulations with the outcome of factor 1, rad."""
        return _compute_range([repeat.peak for repeat in self.agreeing_repeats])

    @property
    def peak_time_range(self) -> tuple[float, float]:
        """Earliest and latest time of the peak among the simulations with the outcome of factor 1, s."""
        return _compute_range([repeat.peak_time for repeat in self.agreeing_repeats])

    @property
    def overturn_range(self) -> tuple[float, float]:
        """Earliest and latest time of overturning, s; NaN if the block does not overturn at factor 1."""
        return _compute_range([repeat.overturn_time for repeat in self.agreeing_repeats])

    @property
    def event_ranges(self) -> Floats:
        """Earliest and latest time of each event at factor 1, s, shape (n, 2).

        NaN from the first event whose kind or side differs between factors.
        """
        events = self._unscaled_repeat.events
        ranges = np.full((len(events), 2), np.nan)
        common = min(len(repeat.events) for repeat in self.repeats)
        rows = np.array([repeat.events[:common] for repeat in self.repeats])
        same = ((rows["kind"] == rows["kind"][0]) & (rows["side"] == rows["side"][0])).all(axis=0)
        count = int(np.argmin(np.append(same, False)))
        times = rows["time"][:, :count]
        ranges[:count] = np.stack([times.min(axis=0), times.max(axis=0)], axis=1)
        return ranges

    @property
    def event_spreads(self) -> Floats:
        """Largest distance of each event from its time at factor 1, s; NaN as in `event_ranges`."""
        return np.asarray(np.abs(self.event_ranges - self._unscaled_repeat.events["time"][:, None]).max(axis=1))

    @property
    def _unscaled_repeat(self) -> Repeat:
        return self.repeats[len(self.repeats) // 2]

    @property
    def agreeing_repeats(self) -> list[Repeat]:
        """Simulations with the outcome of factor 1."""
        return [
            repeat
            for repeat in self.repeats
            if _merge_unmoved(repeat.outcome) == _merge_unmoved(self._unscaled_repeat.outcome)
        ]

    @property
    def outcome(self) -> str:
        """Outcome at factor 1, as a verb. A block that moves only for other factors "stands"."""
        outcomes = [self._unscaled_repeat.outcome, *(repeat.outcome for repeat in self.agreeing_repeats)]
        return next((outcome for outcome in outcomes if outcome != UNMOVED), UNMOVED)

    def describe_agreement(self) -> str:
        """Return as text the number of simulations with the outcome of factor 1, and the range of factors."""
        return f"{self.outcome} in {len(self.agreeing_repeats)} of {self.sample_text}"

    def describe_outcome(self) -> str:
        """Return the outcome, or "undecided" and the number of overturnings if outcomes differ."""
        if self.is_decided:
            return self.describe_agreement()
        overturned = int(np.count_nonzero(self.overturned))
        agreement = f"{OVERTURNS} in {overturned} of {self.sample_text}" if overturned else self.describe_agreement()
        return f"undecided: {agreement}"

    def _columns(self, table: str) -> list[Column]:
        (name, _, _, unit, _), values = self.coordinate, list(zip(*self.repeats, strict=True))
        columns = [Column("factor", values[0]), Column("outcome", values[1], label="outcome")]
        columns.append(Column(f"peak_{name}", values[2], unit, f"peak, {unit}"))
        columns.append(Column("peak_time", values[3], "s", "peak time, s"))
        return [*columns, Column("overturn_time", values[4], "s"), Column("last_rest", values[5], "s", "last rest, s")]

    def rows(self) -> list[dict[str, Any]]:
        """Return the rows of `to_dataframe` as mappings, with units in the names."""
        return columns_to_records(self._columns("repeats"))

    def summary(self) -> str:
        differences = Column("away", [f"{factor - 1.0:+.2g}" for factor in self.factors], label="factor - 1")
        return f"{self.describe_outcome()}\n\n{format_columns([differences, *self._columns('repeats')])}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "relative_step": self.relative_step,
            "within": self.max_deviation,
            "decided": self.is_decided,
            "overturned": int(np.count_nonzero(self.overturned)),
            "count": len(self.repeats),
            "repeats": self.rows(),
        }


def list_checked_factors(relative_step: float, count: int) -> list[float]:
    """Return the factors of `list_factors`, or raise `OptionError` if an argument is out of range."""
    step = checks.between(relative_step, "relative_step", OptionError, 1e-12, 0.1)
    if checks.integer(count, "count", OptionError, 3, 1001) % 2 == 0:
        message = f"{{}} must be odd, with as many factors below 1 as above; got {count}"
        raise OptionError(message, "count", value=count)
    if step * (count - 2) >= 1.0:
        message = f"{{}} must be below 1/{count - 2} for {count} factors; got {step:g}"
        raise OptionError(message, "relative_step", value=step)
    return list_factors(step, count)


def list_factors(relative_step: float, count: int) -> list[float]:
    """Return the factors 1, 1 +- step, 1 +- 3 step, and so on, in ascending order."""
    multiples = range(1, count - 1, 2)
    return [*(1.0 - k * relative_step for k in reversed(multiples)), 1.0, *(1.0 + k * relative_step for k in multiples)]


def choose_factors(precision: float) -> tuple[float, int]:
    """Return the relative step and number (eleven) of factors within a precision, for `Response.perturbed`."""
    limit = checks.between(precision, "precision", OptionError, 1e-6, 0.1)
    return limit / (_PRECISION_FACTOR_COUNT - 2), _PRECISION_FACTOR_COUNT


def format_percent(share: float) -> str:
    """Return a small share as text, in percent from 0.01 % on."""
    if share >= 1e-4:
        return f"{100.0 * share:.3g} %"
    mantissa, _, exponent = f"{share:.1e}".partition("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def _merge_unmoved(outcome: str) -> str:
    return STANDS if outcome == UNMOVED else outcome


def _compute_range(values: Sequence[float]) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))
