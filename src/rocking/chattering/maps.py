"""Where chattering is complete: maps over the two parameters of any family of cases, by certified simulation."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.chattering.families import Family, SimulationInput
from rocking.constants import VERSION
from rocking.engine import OUTCOME, complete_chattering
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.motion.exceedance import exceedances
from rocking.motion.motion import Motion
from rocking.progress import Progress
from rocking.response import Response
from rocking.result import DatasetResult
from rocking.simulation import simulate
from rocking.tables import as_written, text_table
from rocking.threads import in_threads

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

    @property
    def words(self) -> str:
        """The outcome in words: "rests later"."""
        return self.name.lower().replace("_", " ")


#: Four ulp: by so much of itself a peak that was meant to be the threshold may exceed it.
_ROUNDING: Final = 2.0**-50


class _Point(NamedTuple):
    """One point of a map; times that do not exist are NaN."""

    outcome: int
    uplift: float = math.nan
    rest: float = math.nan
    lower: float = math.nan
    upper: float = math.nan
    rests: int = 0
    overturned: bool = False


#: Units and meanings of the variables of a map.
_ATTRIBUTES: Final[Mapping[str, dict[str, Any]]] = MappingProxyType(
    {
        "outcome": {
            "flag_values": [outcome.value for outcome in Outcome],
            "flag_meanings": " ".join(outcome.name.lower() for outcome in Outcome),
        },
        **{name: {"units": "s"} for name in ("uplift", "rest", "lower", "upper")},
        "rests": {"units": "1", "long_name": "times the block comes to rest"},
    }
)


def chattering_map(
    family: Family,
    parameters: Mapping[str, ArrayLike],
    *,
    threads: int | None = None,
    progress: bool | None = None,
) -> ChatteringMap:
    """Simulate a family of inputs over a grid, and tell where chattering after the first uplift is complete.

    Parameters
    ----------
    family : callable
        Makes a `SimulationInput` (block, motion, model) from two numbers: one of `rocking.chattering.families`, or your
        own.
    parameters : mapping
        Names and values of the two parameters, the first of them upwards in the figure. A family whose first two
        parameters have these names the other way round gets them so; else they are given to it in this order.
    threads : int, optional
        Number of threads; by default one for every core.
    progress : bool, optional
        Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

    Returns
    -------
    ChatteringMap
        Outcomes, times and brackets.

    Raises
    ------
    InvalidOption
        If there are not two parameters, or their values are not one-dimensional, finite and in increasing order, or the
        family is no function that returns a `SimulationInput`.
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
    >>> found = chattering_map(families.sine(block, model="linear"), {"a": [0.9, 1.03, 1.05], "omega": [1.0, 2.0]})
    >>> found.data.complete.values.tolist()
    [[False, False], [True, True], [False, False]]
    """
    import xarray as xr

    checks.mapping(parameters, "parameters", InvalidOption, '{"a": [1.0, 1.1], "omega": [1.0, 2.0]}')
    if len(parameters) != 2:
        raise InvalidOption(f"{{}} must be two, not {len(parameters)}", "parameters", value=parameters)
    count = None if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)
    if not callable(family):
        raise InvalidOption(
            f"{{}} must be a function of two numbers, as rocking.chattering.families.sine(block), not {family!r}",
            "family",
            value=family,
        )
    (first, x), (second, y) = ((name, _axis(values, name)) for name, values in parameters.items())
    swapped = _is_swapped(family, str(first), str(second))
    inputs = [family(*map(float, (other, one) if swapped else (one, other))) for one in x for other in y]
    for each in inputs:
        if not (isinstance(each, SimulationInput) and isinstance(each.motion, Motion)):
            raise InvalidOption(
                "{} must return a SimulationInput of a block and a Motion for each pair", "family", value=each
            )
    points = []
    with Progress("mapping", len(inputs), show=progress) as bar:
        for point in in_threads(_simulated, inputs, threads=count):
            points.append(point)
            bar.advance()
    columns = {name: np.array(column) for name, column in zip(_Point._fields, zip(*points, strict=True), strict=True)}
    dataset = xr.Dataset(
        {
            name: ((first, second), column.reshape(x.size, y.size), _ATTRIBUTES.get(name, {}))
            for name, column in columns.items()
        },
        {first: x, second: y},
        {"program": f"rocking {VERSION}", "case": _in_common(inputs[0], inputs[-1])},
    )
    return ChatteringMap(dataset.assign(complete=dataset.outcome == Outcome.COMPLETE))


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringMap(DatasetResult):
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
        values, counts = np.unique(self.data.outcome, return_counts=True)
        rows = [
            (Outcome(value).words, f"{100 * count / self.data.outcome.size:.1f} %")
            for value, count in zip(values, counts, strict=True)
        ]
        first, second = self.data.outcome.dims
        head = f"end of the first rocking, over {first} and {second}"
        overturned, later = (100.0 * float(each.mean()) for each in (self.data.overturned, self._later()))
        fate = f"overturns in the end: {overturned:.1f} %" + (f", {later:.1f} % after a first rest" if later else "")
        return f"{head}\n\n{text_table(['outcome', 'share of the map'], rows)}\n\n{fate}"

    def _later(self) -> NDArray[np.bool_]:
        """Whether a block overturns after its first rocking has ended otherwise."""
        found: NDArray[np.bool_] = (self.data.overturned & (self.data.outcome != Outcome.OVERTURNS)).values
        return found

    def to_dict(self) -> dict[str, Any]:
        columns = {str(name): self.data[name].values for name in (*self.data.outcome.dims, *self.data.data_vars)}
        return {"outcomes": {outcome.value: outcome.words for outcome in Outcome}, **columns}

    def plot(
        self,
        ax: Axes | None = None,
        *,
        labels: Mapping[str, str] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw the outcomes, the first parameter upwards, the second to the right.

        They are of the first rocking; where the block overturns in a later one, it is hatched.

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

        Returns
        -------
        matplotlib.figure.Figure
            The new figure, or that of `ax`.

        Examples
        --------
        >>> import rocking
        >>> from rocking.chattering import families
        >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
        >>> found = chattering_map(families.sine(block), {"a": [1.03, 1.05], "omega": [1.0, 2.0]})
        >>> found.plot(labels={"omega": "ω"}).axes[0].get_xlabel()
        'ω'
        """
        from rocking.plot.maps import outcome_figure

        first, second = self.data.outcome.dims
        written = labels or {}
        return outcome_figure(
            x=self.data[second].values,
            y=self.data[first].values,
            outcome=self.data.outcome.values,
            meanings=[outcome.words for outcome in Outcome],
            later=self._later(),
            x_label=written.get(str(second), str(second)),
            y_label=written.get(str(first), str(first)),
            title=title or as_written(f"end of the first rocking under {self.data.attrs['case']}"),
            ax=ax,
            figsize=figsize,
        )


def last_exceedance(motion: Motion, thresholds: tuple[float, float], gravity: float) -> float | None:
    """Time, s, at which a motion last passes the thresholds of the two sides (m/s^2); None if it hardly passes one.

    What passes a threshold by no more than rounding lifts no block.
    """
    plus, minus = (threshold * (1.0 + _ROUNDING) for threshold in thresholds)
    lifts = motion.vertical is None and motion.pga > min(plus, minus)
    if not (lifts or len(exceedances(motion, (plus, minus), gravity))):
        return None
    starts = exceedances(motion, thresholds, gravity)[:, 0]
    return float(starts[-1]) if starts.size else None


def outcomes_of(ends: NDArray[np.void], last: float | None) -> Integers:
    """Return the `Outcome` of each block, from what the engine keeps of its certified simulation.

    The last exceedance is that of their motion, as `last_exceedance` gives it. Of a block that rests several times
    UNPROVEN says that one of the rests is not proven.
    """
    if last is None:
        return np.full(len(ends), Outcome.NO_UPLIFT, dtype=np.int64)
    rested = ends["rests"] > 0
    found = np.where(ends["first_rest"] <= last, Outcome.RESTS_LATER, Outcome.RESTS_AT_LAST)
    found[ends["complete_chattering"]] = Outcome.COMPLETE
    found[~rested] = Outcome.OVERTURNS
    found[(ends["stalled"] > 0) | (ends["unfinished"] & ~rested)] = Outcome.UNPROVEN
    found[ends["uplifts"] == 0] = Outcome.NO_UPLIFT
    return found.astype(np.int64)


def _in_common(one: SimulationInput, other: SimulationInput) -> str:
    """Say what two inputs have in common: the motion's name, the proportions and the size of the block, the model."""
    what = [
        ("{}", *(each.motion.name for each in (one, other))),
        ("alpha = {} rad", *(_of_sides(each, "alpha") for each in (one, other))),
        ("restitution = {}", *(_of_sides(each, "restitution") for each in (one, other))),
        ("{} model", one.model, other.model),
    ]
    return ", ".join(words.format(first) for words, first, last in what if first == last)


def _of_sides(given: SimulationInput, name: str) -> str:
    """Return a parameter of a block, once where both sides have the same."""
    return ", ".join(dict.fromkeys(f"{getattr(side, name):.5g}" for side in given.block.sides))


def _simulated(given: SimulationInput) -> _Point:
    """Simulate one point and keep all that a response knows: the engine's outcomes hold no bracket on a rest."""
    response = simulate(given.block, given.motion, model=given.model)
    last = last_exceedance(given.motion, given.block.uplift_thresholds(given.model), given.block.gravity)
    if not len(response.events) or last is None:
        return _Point(Outcome.NO_UPLIFT)
    ends = np.zeros(1, OUTCOME)
    uplift, rests = float(response.events["time"][0]), len(response.chattering)
    ends["uplifts"], ends["rests"], ends["unfinished"] = 1, rests, response.unfinished
    times: dict[str, float] = {}
    if rests:
        first = response.chattering[0]
        times = {"rest": float(first["end"]), "lower": float(first["lower"]), "upper": float(first["upper"])}
        # What the motion must not pass a threshold before is the upper bound on the rest.
        ends["first_rest"], ends["stalled"] = times["upper"], math.isnan(times["upper"])
        ends["complete_chattering"] = _is_complete(response, rests, uplift, times["upper"])
    return _Point(int(outcomes_of(ends, last)[0]), uplift, **times, rests=rests, overturned=response.overturned)


def _is_complete(response: Response, rests: int, uplift: float, rest: float) -> bool:
    if math.isnan(rest):
        return False
    states = state.new_states(1, 0)
    states["rests"], states["first_uplift"], states["first_rest"] = rests, uplift, rest
    trail = response.solution.trail
    return bool(complete_chattering(trail.ground, np.array([trail.block]), states)[0])


def _is_swapped(family: Family, first: str, second: str) -> bool:
    """Whether a family has two parameters, by the names of which they stand the other way round."""
    try:
        taken = [*inspect.signature(family).parameters]
    except (TypeError, ValueError):  # a callable that does not tell its parameters
        return False
    return len(taken) > 1 and (first == taken[1] or second == taken[0])


def _axis(values: ArrayLike, name: str) -> Floats:
    axis = checks.numbers(values, name, InvalidOption)
    if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all() or not (np.diff(axis) > 0.0).all():
        raise InvalidOption("{} must be finite numbers in increasing order", name, value=values)
    return axis
