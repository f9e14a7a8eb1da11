"""Branches of periodic orbits along a parameter, with their bifurcations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.core.tables import Column, add_unit, escape_dollars, format_cell, format_count, format_table
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.orbits import PeriodicOrbit, compute_moduli, compute_peak, create_orbit
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.motion.motion import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FOLD: Final = "fold"
FLIP: Final = "flip"
SYMMETRY_BREAKING: Final = "symmetry breaking"
BRANCH_POINT: Final = "branch point"
GRAZING: Final = "grazing"
LOSS_OF_CHATTERING: Final = "loss of complete chattering"
START_OF_REST: Final = "start of rest"
UPLIFT: Final = "uplift"
OVERTURNING: Final = "overturning"

#: Ends of a branch without a bifurcation.
END_AT_LIMIT: Final = "limit of the parameter"
END_CLOSED: Final = "where it began"
END_TOO_MANY_POINTS: Final = "too many points"
END_LOST: Final = "lost"


class Bifurcation(NamedTuple):
    """Bifurcation of a branch of periodic orbits.

    Attributes
    ----------
    kind : str
        "fold", "flip", "symmetry breaking", "branch point" (crossing of another branch), "grazing", "loss of complete
        chattering", "uplift", "overturning", or "start of rest" (only if the scheme imposes rest, because complete
        chattering does not begin on a branch, whose orbits have finitely many impacts).
    value : float
        Value of the parameter.
    bracket : (float, float)
        Bounds of the value: at a branch point the neighbouring points, and for a vanishing impact speed the lowest and
        highest of three extrapolations.
    orbit : PeriodicOrbit
        Orbit at the bifurcation; the last one on the branch if the branch ends there.

    See Also
    --------
    Branch : Branch of periodic orbits.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> def family(amplitude):
    ...     return dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(amplitude, 5.0, cycles=1)
    >>> stable = next(orbit for orbit in dynamics.periodic_orbits(*family(15.0)) if orbit.is_stable)
    >>> bifurcation = dynamics.continue_orbit(stable, family, 15.0, (15.0, 15.5), step=0.5).bifurcations[0]
    >>> f"{bifurcation.kind} at {bifurcation.value:.4f} m/s^2"
    'flip at 15.2682 m/s^2'
    """

    kind: str
    value: float
    bracket: tuple[float, float]
    orbit: PeriodicOrbit


@dataclass(frozen=True, eq=False, repr=False)
class Branch(Result):
    """Branch of periodic orbits along a parameter, created by `continue_orbit`.

    Attributes
    ----------
    family : callable
        Function of the parameter that returns body and motion.
    name, unit : str
        Name and unit of the parameter.
    bounds : (float, float)
        Range of the parameter.
    period : int
        Period of the orbits, in periods of the motion.
    values : ndarray, shape (n,)
        Values of the parameter, in the order along the branch.
    states : ndarray, shape (n, 2)
        Coordinate and velocity at the start of a period.
    multipliers : ndarray of complex, shape (n, 2)
        Floquet multipliers, the largest first.
    impact_count : float
        Number of impacts in one period, constant along the branch; infinity with complete chattering.
    peaks : ndarray, shape (n,)
        Largest absolute coordinates.
    bifurcations : tuple of Bifurcation
        Bifurcations in the order along the branch.
    ends : (str, str)
        Reasons of the ends: a kind of bifurcation, "limit of the parameter", "where it began", "too many points", or
        "lost".

    See Also
    --------
    continue_orbit : Follow a periodic orbit as a parameter changes.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> def family(amplitude):
    ...     return dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(amplitude, 5.0, cycles=1)
    >>> stable = next(orbit for orbit in dynamics.periodic_orbits(*family(12.0)) if orbit.is_stable)
    >>> branch = dynamics.continue_orbit(stable, family, 12.0, (12.0, 13.0), step=0.5)
    >>> bool(branch.is_stable.all()), branch.ends
    (True, ('limit of the parameter', 'limit of the parameter'))
    """

    TABLES: ClassVar[tuple[str, ...]] = ("points", "bifurcations")

    family: Callable[[float], tuple[Body, Motion]]
    name: str
    unit: str
    model: Model
    chattering: ChatteringScheme
    bounds: tuple[float, float]
    period: int
    values: Floats
    states: Floats
    multipliers: NDArray[np.complex128]
    impact_count: float
    peaks: Floats
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[str, str]

    @property
    def is_stable(self) -> Flags:
        """Whether the orbit at each point is stable, shape (n,)."""
        return np.asarray(np.all(compute_moduli(self.multipliers) < 1.0, axis=1))

    def __len__(self) -> int:
        return len(self.values)

    def orbit(self, index: int) -> PeriodicOrbit:
        """Return the orbit at a point of the branch, with its multipliers."""
        index = checks.integer(index, "index", OptionError, minimum=-len(self), maximum=len(self) - 1)
        body, motion = self.family(float(self.values[index]))
        return create_orbit(StroboscopicMap(body, motion, self.model, self.chattering), self.states[index], self.period)

    def _format_headline(self) -> str:
        count = self.impact_count
        impacts = "complete chattering" if math.isinf(count) else format_count(int(count), "impact")
        low, high = float(self.values.min()), float(self.values.max())
        unit = "" if self.unit == "1" else f" {self.unit}"
        orbits = f"orbits of {format_count(self.period, 'period')} with {impacts}"
        return f"{orbits}, {self.name} from {low:.6g} to {high:.6g}{unit}"

    def summary(self) -> str:
        stable = self.is_stable
        lines = [self._format_headline(), f"{len(self)} points, {int(np.sum(stable))} of them stable"]
        if points := self.bifurcations:
            header = ["bifurcation", add_unit(self.name, self.unit), "multipliers"]
            rows = [[kind, f"{x:.12g}", _format_multipliers(orbit.multipliers)] for kind, x, _, orbit in points]
            lines += ["", format_table(header, rows)]
        return "\n".join([*lines, "", f"ends: {self.ends[0]}; {self.ends[1]}"])

    def to_dict(self) -> dict[str, Any]:
        return {
            "parameter": self.name,
            "unit": self.unit,
            "period": self.period,
            "impact_count": self.impact_count,
            "complete_chattering": math.isinf(self.impact_count),
            "values": self.values,
            "states": self.states,
            "stable": self.is_stable,
            "peaks": self.peaks,
            "bifurcations": [
                {"kind": kind, "value": value, "bracket": [*bracket]} for kind, value, bracket, _ in self.bifurcations
            ],
            "ends": [*self.ends],
        }

    def _columns(self, table: str) -> list[Column]:
        if table == "bifurcations":
            rows = [(kind, value, *bracket) for kind, value, bracket, _ in self.bifurcations]
            parameter = add_unit(self.name, self.unit)
            names = "kind", parameter, f"{parameter}_lower", f"{parameter}_upper"
            return [Column(name, [row[k] for row in rows]) for k, name in enumerate(names)]
        coordinate = self.family(float(self.values[0]))[0].coordinate
        return [
            Column(self.name, self.values, self.unit),
            Column(coordinate.name, self.states[:, 0], coordinate.unit),
            Column("velocity", self.states[:, 1], f"{coordinate.unit}/s"),
            Column("peak", self.peaks, coordinate.unit),
            Column("first_multiplier", np.abs(self.multipliers[:, 0])),
            Column("second_multiplier", np.abs(self.multipliers[:, 1])),
            Column("stable", self.is_stable),
        ]

    def plot(
        self,
        ax: Axes | None = None,
        *,
        title: str = "",
        figsize: tuple[float, float] | None = None,
        others: Sequence[Branch] = (),
    ) -> Figure:
        """Draw the largest absolute coordinate against the parameter, with the arguments of `Result.plot`.

        If this is constant, as between two stops, the coordinate at the start of a period is drawn. Stable orbits are
        solid lines, unstable orbits dashed, and bifurcations are marked. `others` are further branches along the same
        parameter, for example of twice the period.
        """
        from rocking.plot.orbits import draw_branches

        body, _ = self.family(float(self.values[0]))
        coordinate, branches = body.coordinate, [self, *others]
        unit = "" if self.unit == "1" else f" ({self.unit.replace('^2', '²')})"
        # The peak is constant if the body hits two stops.
        peaks = np.concatenate([branch.peaks for branch in branches])
        bifurcations = [point for branch in branches for point in branch.bifurcations]
        has_constant_peak = float(np.ptp(peaks)) <= 1e-9 * float(np.max(peaks))
        quantity = f"{coordinate.name} at the start of a period" if has_constant_peak else f"largest {coordinate.name}"
        periods = ", ".join(str(period) for period in sorted({branch.period for branch in branches}))
        headline = f"orbits of {periods} periods, in {len(branches)} branches" if others else self._format_headline()
        heights = [branch.states[:, 0] if has_constant_peak else branch.peaks for branch in branches]
        marks = []
        for kind, value, _, orbit in bifurcations:
            height = float(orbit.state[0]) if has_constant_peak else compute_peak(orbit.response)
            marks.append((kind, value, height))
        return draw_branches(
            values=_join_with_gaps([branch.values for branch in branches]),
            heights=_join_with_gaps(heights),
            stable=_join_with_gaps([branch.is_stable for branch in branches]) == 1.0,
            marks=marks,
            labels=(f"{self.name}{unit}", f"{quantity} ({coordinate.unit})"),
            title=title or escape_dollars(f"{body.description}, {headline.replace('^2', '²')}"),
            ax=ax,
            figsize=figsize,
        )


def _join_with_gaps(lines: Sequence[NDArray[Any]]) -> Floats:
    """Join lines with a NaN between them, which interrupts the plotted line."""
    return np.concatenate([np.append(np.asarray(line, dtype=np.float64), np.nan) for line in lines])[:-1]


def _format_multipliers(multipliers: NDArray[np.complex128]) -> str:
    return ", ".join(format_cell(float(value.real)) if value.imag == 0.0 else f"{value:.5g}" for value in multipliers)
