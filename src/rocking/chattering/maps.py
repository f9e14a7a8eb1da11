"""Where chattering is complete: maps over the two parameters of any family of cases, by certified simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.chattering.families import Case, Family
from rocking.constants import VERSION
from rocking.errors import InvalidOption
from rocking.motion.exceedance import exceedances
from rocking.motion.motion import Motion
from rocking.result import Result
from rocking.simulation import simulate
from rocking.tables import text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Outcome(IntEnum):
    """What becomes of the first uplift.

    Attributes
    ----------
    NO_UPLIFT
        The motion never passes a threshold, or by no more than rounding.
    COMPLETE
        Complete chattering: the block is proven to rest before the motion passes a threshold again. Under a sine this
        is the paper's definition, rest within half a period, a < a_cr.
    RESTS_LATER
        The motion passes a threshold again while the block rocks; it comes to rest later, before the last time.
    RESTS_AT_LAST
        It comes to rest only after the motion has passed a threshold for the last time.
    OVERTURNS
        It overturns without ever coming to rest.
    UNPROVEN
        Its first rest is not proven: double precision does not resolve the impacts, as where the motion first passes a
        threshold by hardly more than rounding, or they are more than a simulation's budget of steps.
    """

    NO_UPLIFT = 0
    COMPLETE = 1
    RESTS_LATER = 2
    RESTS_AT_LAST = 3
    OVERTURNS = 4
    UNPROVEN = 5


#: Four ulp: by so much of itself a peak that was meant to be the threshold may exceed it.
_ROUNDING: Final = 2.0**-50


class _Point(NamedTuple):
    """One point of a map."""

    outcome: int
    uplift: float
    rest: float
    lower: float
    upper: float
    rests: int
    overturned: bool


def chattering_map(family: Family, parameters: Mapping[str, ArrayLike]) -> ChatteringMap:
    """Simulate a family of cases over a grid, and tell where chattering after the first uplift is complete.

    Parameters
    ----------
    family : callable
        Makes a `Case` (block, motion, model) from two numbers: one of `rocking.chattering.families`, or your own.
    parameters : mapping
        Names and values of the two parameters, in the order in which the family takes them.

    Returns
    -------
    ChatteringMap
        Outcomes, times and brackets.

    Raises
    ------
    InvalidOption
        If there are not two parameters, or their values are not one-dimensional, finite and in increasing order.
    RockingError
        What the family itself raises for a pair of numbers.

    Notes
    -----
    The paper leaves this open (end of its section 5.2): no criteria for complete chattering exist for waveforms other
    than the sine. Here each rest is proven by certificate; a point takes one or two milliseconds.

    Examples
    --------
    >>> import rocking
    >>> from rocking.chattering import families
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    >>> dataset = chattering_map(families.sine(block, model="linear"), {"a": [0.9, 1.03, 1.05], "omega": [1.0, 2.0]})
    >>> dataset.complete.values.tolist()
    [[False, False], [True, True], [False, False]]
    """
    import xarray as xr

    checks.mapping(parameters, "parameters", InvalidOption, '{"a": [1.0, 1.1], "omega": [1.0, 2.0]}')
    if len(parameters) != 2:
        raise InvalidOption(f"a map has two parameters, not {len(parameters)}")
    (first, x), (second, y) = ((name, _axis(values, name)) for name, values in parameters.items())
    cases = [family(float(one), float(other)) for one in x for other in y]
    points = [_followed(case) for case in cases]
    columns = {name: np.array(column) for name, column in zip(_Point._fields, zip(*points, strict=True), strict=True)}
    attributes = {
        "outcome": {
            "flag_values": [outcome.value for outcome in Outcome],
            "flag_meanings": " ".join(outcome.name.lower() for outcome in Outcome),
        },
        **{name: {"units": "s"} for name in ("uplift", "rest", "lower", "upper")},
        "rests": {"units": "1", "long_name": "times the block comes to rest"},
    }
    dataset = xr.Dataset(
        {
            name: ((first, second), column.reshape(x.size, y.size), attributes.get(name, {}))
            for name, column in columns.items()
        },
        {first: x, second: y},
        {"program": f"rocking {VERSION}", "case": _in_common(cases[0], cases[-1])},
    )
    return ChatteringMap(dataset.assign(complete=dataset.outcome == Outcome.COMPLETE))


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringMap(Result):
    """Where chattering after the first uplift is complete, over two parameters; from `chattering_map`.

    Attributes
    ----------
    data : xarray.Dataset
        Over the two parameters: outcome (see `Outcome`), complete (whether it is COMPLETE), uplift and rest (times of
        the first uplift and the first rest, s), lower and upper (the bracket proven on that rest, s), rests (how many
        in all), overturned (sooner or later).
    """

    TABLES = MappingProxyType(
        {"outcomes": ("outcome", "complete", "uplift", "rest", "lower", "upper", "rests", "overturned")}
    )

    def summary(self) -> str:
        """Shares of the map that each outcome takes."""
        values, counts = np.unique(self.data.outcome, return_counts=True)
        rows = [
            (_words(Outcome(value)), f"{100 * count / self.data.outcome.size:.1f} %")
            for value, count in zip(values, counts, strict=True)
        ]
        first, second = self.data.outcome.dims
        head = f"chattering after the first uplift, over {first} and {second}"
        return f"{head}\n\n{text_table(['outcome', 'share of the map'], rows)}"

    def to_dict(self) -> dict[str, Any]:
        """Axes and variables by name."""
        columns = {str(name): self.data[name].values for name in (*self.data.outcome.dims, *self.data.data_vars)}
        return {"outcomes": {outcome.value: _words(outcome) for outcome in Outcome}, **columns}

    def plot(
        self,
        ax: Axes | None = None,
        *,
        labels: Mapping[str, str] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw the outcomes, the first parameter upwards, the second to the right.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; by default in a new figure.
        labels : mapping of str to str, optional
            What to write at the axes in place of the parameters' names.
        title : str
            Title; by default the motion, the block and the model, as far as they are the same all over the map.
        figsize : (float, float), optional
            Width and height of a new figure, inches.
        """
        from rocking.plot.maps import outcome_figure

        first, second = self.data.outcome.dims
        written = labels or {}
        return outcome_figure(
            x=self.data[second].values,
            y=self.data[first].values,
            outcome=self.data.outcome.values,
            meanings=[_words(outcome) for outcome in Outcome],
            x_label=written.get(str(second), str(second)),
            y_label=written.get(str(first), str(first)),
            title=title or f"first uplift under {self.data.attrs['case']}",
            ax=ax,
            figsize=figsize,
        )


def hardly_lifts(motion: Motion, thresholds: tuple[float, float], gravity: float) -> bool:
    """Whether a motion passes the thresholds of the two sides (m/s^2) by no more than rounding, if at all."""
    plus, minus = (threshold * (1.0 + _ROUNDING) for threshold in thresholds)
    if motion.vertical is None and motion.pga > min(plus, minus):
        return False
    return not len(exceedances(motion, (plus, minus), gravity))


def outcomes_of(ends: NDArray[np.void], later: Floats) -> NDArray[np.int64]:
    """Outcomes of blocks under one motion, from what the engine keeps of each.

    Parameters
    ----------
    ends : structured array
        What became of them (`rocking.engine.OUTCOME`), by certified simulation.
    later : ndarray
        Times, s, at which the motion passes their threshold after it did so first.

    Returns
    -------
    ndarray of int
        An `Outcome` each. A rest counts by its time, not by the upper bound on it; and of a block that rests several
        times UNPROVEN says that one of the rests is not proven.
    """
    rest, rested = ends["first_rest"], ends["rests"] > 0
    first, last = later.min(initial=math.inf), later.max(initial=-math.inf)
    found = np.where(rest <= last, Outcome.RESTS_LATER, Outcome.RESTS_AT_LAST)
    found[rest <= first] = Outcome.COMPLETE
    found[~rested] = Outcome.OVERTURNS
    found[(ends["stalled"] > 0) | (ends["unfinished"] & ~rested)] = Outcome.UNPROVEN
    found[ends["uplifts"] == 0] = Outcome.NO_UPLIFT
    return found.astype(np.int64)


def _words(outcome: Outcome) -> str:
    return outcome.name.lower().replace("_", " ")


def _in_common(one: Case, other: Case) -> str:
    """Say what two cases have in common: the motion's name, the proportions and the size of the block, the model."""
    what = [
        ("{}", *(case.motion.name for case in (one, other))),
        ("alpha = {} rad", *(_of_sides(case, "alpha") for case in (one, other))),
        ("restitution = {}", *(_of_sides(case, "restitution") for case in (one, other))),
        ("{} model", one.model, other.model),
    ]
    return ", ".join(words.format(first) for words, first, last in what if first == last)


def _of_sides(case: Case, name: str) -> str:
    """Return a parameter of a case's block, once where both sides have the same."""
    return ", ".join(dict.fromkeys(f"{getattr(side, name):.5g}" for side in case.block.sides))


def _followed(case: Case) -> _Point:
    response = simulate(case.block, case.motion, model=case.model)
    events = response.events
    thresholds = case.block.uplift_thresholds(case.model)
    if not len(events) or hardly_lifts(case.motion, thresholds, case.block.gravity):
        return _Point(Outcome.NO_UPLIFT, math.nan, math.nan, math.nan, math.nan, 0, False)
    uplift = float(events["time"][0])
    if response.unfinished and not len(response.chattering):
        return _Point(Outcome.UNPROVEN, uplift, math.nan, math.nan, math.nan, 0, False)
    if not len(response.chattering):
        return _Point(Outcome.OVERTURNS, uplift, math.nan, math.nan, math.nan, 0, response.overturned)
    first = response.chattering[0]
    # The first exceedance is the one that lifted the block.
    later = exceedances(case.motion, thresholds, case.block.gravity)[1:, 0]
    return _Point(
        _outcome(float(first["upper"]), later),
        uplift,
        float(first["end"]),
        float(first["lower"]),
        float(first["upper"]),
        len(response.chattering),
        response.overturned,
    )


def _outcome(rest: float, later: Floats) -> Outcome:
    """Outcome from the upper bound on the first rest and the later times at which a threshold is passed."""
    if math.isnan(rest):
        return Outcome.UNPROVEN
    if rest <= later.min(initial=math.inf):
        return Outcome.COMPLETE
    return Outcome.RESTS_LATER if rest <= later.max() else Outcome.RESTS_AT_LAST


def _axis(values: ArrayLike, name: str) -> Floats:
    axis = checks.numbers(values, f"values of {name}", InvalidOption)
    if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all() or not (np.diff(axis) > 0.0).all():
        raise InvalidOption(f"the values of {name} must be finite numbers in increasing order")
    return axis
