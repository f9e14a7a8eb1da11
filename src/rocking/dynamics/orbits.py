"""Periodic orbits of a body under periodic motion: in words, as tables and as a figure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.body import Body, title_of
from rocking.constants import Model
from rocking.dynamics.courses import response_of
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.symmetry import is_symmetric
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.result import DrawnResult, Row, TableResult, dictionary_of, text_of
from rocking.tables import as_written, counted, named
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Distance, over the scale of the states, within which two orbits are the same.
SAME: Final = 1e-7

#: Difference from 1 that rounding may have made in a multiplier, in the product of two, and in two whose product is 1,
#: which may be equal: then it is a root of rounding.
_NEUTRAL: Final = 1e-9
_NEUTRAL_PAIR: Final = 1e-6

#: Points of a figure for each period, and letters of the column of names in a summary.
_DRAWN: Final = 400
_WIDTH: Final = 20


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit(DrawnResult, TableResult):
    """A motion of a body that repeats after some periods of what shakes it, made by `periodic_orbits`.

    Attributes
    ----------
    body, motion, model, treatment
        What moves: the motion is one period.
    state : ndarray, shape (2,)
        Coordinate and velocity at the start of a period of the motion.
    period : int
        Its period, in periods of the motion; the least one.
    impacts : float
        Impacts in its period: a whole number, or infinity with complete chattering.
    multipliers : ndarray of complex, shape (2,)
        Floquet multipliers, the largest first: eigenvalues of the derivative of the state after a period of the orbit
        by that before. Exactly zero with a proven rest; one at rest where impacts lose nothing, for what is near it
        never rests.
    symmetric : bool
        Whether it is its own mirror image half a period later.
    rests : bool
        Whether the body comes to rest in every period of the orbit.
    """

    TABLES: ClassVar[tuple[str, ...]] = ("states", "impacts", "histories")

    body: Body
    motion: Motion
    model: Model
    treatment: Treatment
    state: Floats
    period: int
    impacts: float
    multipliers: NDArray[np.complex128]
    symmetric: bool
    rests: bool

    @property
    def is_stable(self) -> bool:
        """Whether what is near it comes nearer: all multipliers are within the unit circle, by more than rounding."""
        return bool(np.all(sizes_of(self.multipliers) < 1.0))

    @property
    def duration(self) -> float:
        """Its period, s."""
        return self.period * self._map.period

    @cached_property
    def states(self) -> Floats:
        """States at the starts of the periods of the motion, shape (period, 2)."""
        return self._map.orbit(self.state, self.period)[:-1]

    @cached_property
    def response(self) -> Response:
        """One period of the orbit as a simulation, with its impacts, rests, and the state at any time."""
        return response_of(self._map, self.state, self.period)

    @cached_property
    def _map(self) -> StroboscopicMap:
        return StroboscopicMap(self.body, self.motion, self.model, self.treatment)

    @property
    def _kind(self) -> str:
        grows = np.any(sizes_of(self.multipliers) > 1.0)
        words = [
            "stable" if self.is_stable else "unstable" if grows else "neutral",
            *(["symmetric"] if self.symmetric else []),
        ]
        how = "with complete chattering" if math.isinf(self.impacts) else f"with {counted(int(self.impacts), 'impact')}"
        rests = ["with a rest"] if self.rests and self.impacts and not math.isinf(self.impacts) else []
        always = ["always at rest"] if self.rests and not self.impacts else []
        each = [" ".join([*words, "orbit"]), f"of {counted(self.period, 'period')}", *(always or [how, *rests])]
        return " ".join(each)

    def _rows(self) -> list[Row]:
        coordinate = self.body.coordinate
        x, v = self.state
        return [
            Row("orbit", self._kind),
            Row("body", self.body.description),
            Row("motion", f"{self.motion.label}, one period of {self._map.period:.6g} s"),
            Row(coordinate.name, f"{x:.12g}", coordinate.unit, " at the start of a period"),
            Row("velocity", f"{v:.12g}", f"{coordinate.unit}/s"),
            Row("multipliers", ", ".join(_number(each) for each in self.multipliers)),
        ]

    def _headline(self) -> str:
        return f"{self._kind}, multipliers {', '.join(_number(each) for each in self.multipliers)}"

    def summary(self) -> str:
        return text_of(self._rows(), _WIDTH)

    def to_dict(self) -> dict[str, Any]:
        coordinate = self.body.coordinate
        rows = [
            Row("body", self.body.description),
            Row("motion", self.motion.label),
            Row("model", self.model),
            Row("period", self.period),
            Row("duration", self.duration, "s"),
            Row(coordinate.name, float(self.state[0]), coordinate.unit),
            Row("velocity", float(self.state[1]), f"{coordinate.unit}/s"),
            Row("impacts", self.impacts),
            Row("complete_chattering", math.isinf(self.impacts)),
            Row("rests", self.rests),
            Row("symmetric", self.symmetric),
            Row("stable", self.is_stable),
            Row("multipliers", [[float(each.real), float(each.imag)] for each in self.multipliers]),
        ]
        return dictionary_of(rows)

    def _frame(self, table: str) -> pd.DataFrame:
        import pandas as pd

        if table == "impacts":
            return self.response.to_dataframe("impacts")
        coordinate = self.body.coordinate
        columns = [
            named("time", "s"), named(coordinate.name, coordinate.unit), named("velocity", f"{coordinate.unit}/s"),
        ]  # fmt: skip
        times = self._map.period * np.arange(self.period) if table == "states" else self._times()
        states = self.states if table == "states" else self.response.states(times)[:, :2]
        return pd.DataFrame(np.column_stack([times, states]), columns=columns)

    def _times(self) -> Floats:
        """Return times of a figure: even, with the last before and the first after every impact."""
        even = np.linspace(0.0, self.response.duration, _DRAWN * self.period + 1)
        at = self.response.impacts["time"]
        found: Floats = np.unique(np.concatenate([even, at, np.nextafter(at, 0.0)]))
        return found

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import orbit_figure

        times, coordinate = self._times(), self.body.coordinate
        states = self.response.states(times)
        return orbit_figure(
            time=times / self._map.period,
            coordinate=states[:, 0],
            velocity=states[:, 1],
            impact_times=self.response.impacts["time"] / self._map.period,
            states=self.states,
            labels=(f"{coordinate.name} ({coordinate.unit})", f"velocity ({coordinate.unit}/s)"),
            title=title or as_written(f"{title_of(self.body)}, {self._kind}"),
            ax=ax,
            figsize=figsize,
        )


def orbit_at(strobe: StroboscopicMap, state: Floats, period: int) -> PeriodicOrbit:
    """Periodic orbit of a state that comes back after so many periods."""
    _, change = strobe.derivative(state, period)
    return PeriodicOrbit(
        strobe.body, strobe.motion, strobe.model, strobe.treatment, state, period,
        impacts_of(strobe, state, period, change), multipliers_at(strobe, change), is_symmetric(strobe, state, period),
        not np.any(change),
    )  # fmt: skip


def impacts_of(strobe: StroboscopicMap, state: Floats, period: int, change: Floats) -> float:
    """Impacts in so many periods from a state of this derivative: infinity with complete chattering.

    That is a rest after impacts which is proven, and not made by an impact that leaves no speed.
    """
    impacts = float(strobe.followed(state, period)[2])
    chatters = impacts > 0.0 and strobe.treatment.bracket > 0.0 and np.max(strobe.bodies.restitution) > 0.0
    return math.inf if chatters and not np.any(change) else impacts


def multipliers_of(change: Floats) -> NDArray[np.complex128]:
    """Floquet multipliers of a derivative, the largest first."""
    found = np.linalg.eigvals(change).astype(np.complex128)
    return found[np.lexsort((-found.imag, -np.abs(found)))] + 0.0


def multipliers_at(strobe: StroboscopicMap, change: Floats) -> NDArray[np.complex128]:
    """Floquet multipliers of an orbit with this derivative of the map, also of a body whose impacts lose nothing.

    What is near the rest of such a body bounces for ever, so that they are one there, not zero.
    """
    if not strobe._loses_nothing:
        return multipliers_of(change)
    if not np.any(change):
        return np.ones(2, dtype=np.complex128)
    record = strobe._records[0]
    keeps_areas = not (record["variable_restitution"] or np.any(record["damping"]))
    # By the rounding of many impacts the product of both would differ from 1, as if the orbit attracted.
    return multipliers_of(change / np.sqrt(np.abs(np.linalg.det(change)))) if keeps_areas else multipliers_of(change)


def sizes_of(multipliers: NDArray[np.complex128]) -> Floats:
    """Sizes of multipliers, pairs along the last axis: exactly 1 where they differ from that by rounding."""
    sizes = np.abs(multipliers)
    is_pair = np.abs(np.prod(sizes, axis=-1, keepdims=True) - 1.0) < _NEUTRAL
    return np.where(np.abs(sizes - 1.0) < np.where(is_pair, _NEUTRAL_PAIR, _NEUTRAL), 1.0, sizes)


def _number(value: complex) -> str:
    """Return a multiplier as text, to three digits."""
    if value.imag == 0.0:
        return f"{value.real:.3g}"
    return f"{value.real:.3g} {'-' if value.imag < 0.0 else '+'} {abs(value.imag):.3g}i"
