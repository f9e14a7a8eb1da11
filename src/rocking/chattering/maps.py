"""Chattering by certified simulation: maps over two parameters, and episodes in one response."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block.single import require_block
from rocking.chattering.families import Family, SimulationInput
from rocking.core import checks
from rocking.core.arrays import Integers, clear_rounding
from rocking.core.constants import VERSION
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, Result
from rocking.core.tables import array_to_rows, escape_dollars, format_table
from rocking.core.threads import map_in_threads
from rocking.engine.tasks import OUTCOME_DTYPE, detect_complete_chattering
from rocking.errors import OptionError
from rocking.kernels import state
from rocking.kernels.ground import join_grounds
from rocking.motion.motion import Motion, find_exceedances
from rocking.response import Response
from rocking.simulation.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class UpliftOutcome(IntEnum):
    """Outcome of the first uplift.

    Attributes
    ----------
    NO_UPLIFT
        The motion does not exceed a threshold, or only by rounding error.
    COMPLETE
        Complete chattering: proven rest before the motion exceeds a threshold again. Under a sine this is the
        definition of the paper, rest within half a period, a < a_cr.
    RESTS_LATER
        The motion exceeds a threshold again while the block rocks. Rest follows before the last exceedance.
    RESTS_AT_LAST
        Rest follows only after the last exceedance.
    OVERTURNS
        The block overturns without coming to rest.
    UNPROVEN
        The first rest is not proven, because double precision does not resolve the impacts (for example, after a first
        exceedance by hardly more than rounding error), or they exceed the step budget of a simulation.

    See Also
    --------
    chattering_map : Compute a map of outcomes.

    Examples
    --------
    >>> import rocking
    >>> from rocking import chattering
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    >>> family = chattering.families.sine(block, model="linear")
    >>> result = chattering.chattering_map(family, {"a": [0.9, 1.03, 1.05], "omega": [1.0, 2.0]})
    >>> [chattering.UpliftOutcome(code).name for code in result.data.outcome.sel(omega=2.0).values]
    ['NO_UPLIFT', 'COMPLETE', 'RESTS_AT_LAST']
    """

    NO_UPLIFT = 0
    COMPLETE = 1
    RESTS_LATER = 2
    RESTS_AT_LAST = 3
    OVERTURNS = 4
    UNPROVEN = 5

    @property
    def label(self) -> str:
        """The outcome in label: "rests later"."""
        return self.name.lower().replace("_", " ")


_EPISODE_DTYPE: Final = np.dtype(
    [(name, float) for name in ("uplift", "proven", "rest", "lower", "upper", "duration")]
    + [("impacts", np.int64), ("ground", float)]
)


class _MapPoint(NamedTuple):
    """Results at one point of a map; missing times are NaN."""

    outcome: int = UpliftOutcome.NO_UPLIFT
    uplift: float = math.nan
    rest: float = math.nan
    lower: float = math.nan
    upper: float = math.nan
    rests: int = 0
    overturned: bool = False


#: Units and meanings of the variables of a map.
_VARIABLE_ATTRIBUTES: Final[dict[str, dict[str, Any]]] = {
    "outcome": {
        "flag_values": [outcome.value for outcome in UpliftOutcome],
        "flag_meanings": " ".join(outcome.name.lower() for outcome in UpliftOutcome),
    },
    **{name: {"units": "s"} for name in ("uplift", "rest", "lower", "upper")},
    "rests": {"units": "1", "long_name": "times the block comes to rest"},
}


def chattering_map(family: Family, parameters: Mapping[str, ArrayLike]) -> ChatteringMap:
    """Simulate a family of inputs on a grid, and determine where chattering after the first uplift is complete.

    Parameters
    ----------
    family : callable
        Function of two numbers that returns a `SimulationInput` (block, motion, model), for example from
        `rocking.chattering.families`.
    parameters : mapping
        Names and values of the two parameters, in the order of the arguments of the family. The first is the vertical
        axis of the figure.

    Returns
    -------
    ChatteringMap
        Outcomes, times and brackets.

    Raises
    ------
    OptionError
        If there are not two parameters, their values are not one-dimensional, finite and increasing, or the family does
        not return a `SimulationInput`.
    RockingError
        Errors raised by the family.

    See Also
    --------
    chattering_episodes : List the episodes of complete chattering in a response.
    critical_amplitude : Compute the critical amplitude under a sine.

    Notes
    -----
    Each rest is proven by a certificate. The paper has criteria only for the sine (end of its section 5.2).

    Examples
    --------
    >>> import rocking
    >>> from rocking.chattering import families
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    >>> result = chattering_map(families.sine(block, model="linear"), {"a": [0.9, 1.03, 1.05], "omega": [1.0, 2.0]})
    >>> result.data.complete.values.tolist()
    [[False, False], [True, True], [False, False]]
    """
    import xarray as xr

    checks.mapping(parameters, "parameters", OptionError, '{"a": [1.0, 1.1], "omega": [1.0, 2.0]}')
    if len(parameters) != 2:
        raise OptionError(f"{{}} must contain two parameters; got {len(parameters)}", "parameters", value=parameters)
    if not callable(family):
        expected = "a function of two numbers, as rocking.chattering.families.sine(block)"
        raise OptionError(f"{{}} must be {expected}; got {family!r}", "family", value=family)
    (first, x), (second, y) = ((k, checks.axis(values, k, OptionError)) for k, values in parameters.items())
    is_swapped = _is_swapped(family, str(first), str(second))
    inputs = [family(*map(float, (b, a) if is_swapped else (a, b))) for a in x for b in y]
    for entry in inputs:
        if not (isinstance(entry, SimulationInput) and isinstance(entry.motion, Motion)):
            message = "{} must return a SimulationInput of a block and a Motion for each pair"
            raise OptionError(message, "family", value=entry)
    points: list[_MapPoint] = []
    with Progress("mapping", len(inputs)) as bar:
        for point in map_in_threads(_simulate_point, inputs):
            points.append(point)
            bar.advance()
    variables = {
        name: ((first, second), np.reshape(column, (x.size, y.size)), _VARIABLE_ATTRIBUTES.get(name, {}))
        for name, column in zip(_MapPoint._fields, zip(*points, strict=True), strict=True)
    }
    attributes = {"program": f"rocking {VERSION}", "case": _describe_common_properties(inputs[0], inputs[-1])}
    dataset = xr.Dataset(variables, {first: x, second: y}, attributes)
    return ChatteringMap(dataset.assign(complete=dataset.outcome == UpliftOutcome.COMPLETE))


def _is_swapped(family: Family, first: str, second: str) -> bool:
    """Whether the parameters of a family have these names in the opposite order."""
    try:
        names = [*inspect.signature(family).parameters]
    except (TypeError, ValueError):  # a callable without a signature
        return False
    return len(names) > 1 and (first == names[1] or second == names[0])


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringMap(DatasetResult):
    """Map of the outcomes of the first uplift over two parameters, created by `chattering_map`.

    Attributes
    ----------
    data : xarray.Dataset
        With the two parameters as dimensions: outcome (see `UpliftOutcome`), complete (whether it is COMPLETE), uplift
        and rest (times of the first uplift and the first rest, s), lower and upper (proven bounds of that rest, s),
        rests (total number), overturned (at any time).

    See Also
    --------
    chattering_map : Compute the map.

    Examples
    --------
    >>> import rocking
    >>> from rocking import chattering
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    >>> family = chattering.families.sine(block, model="linear")
    >>> result = chattering.chattering_map(family, {"a": [0.9, 1.03, 1.05], "omega": [1.0, 2.0]})
    >>> result.data.complete.sel(omega=2.0).values.tolist()
    [False, True, False]
    """

    TABLES: ClassVar = {"outcomes": ("outcome", "complete", "uplift", "rest", "lower", "upper", "rests", "overturned")}

    def summary(self) -> str:
        values, counts = np.unique(self.data.outcome, return_counts=True)
        rows = [
            (UpliftOutcome(value).label, f"{100 * count / self.data.outcome.size:.1f} %")
            for value, count in zip(values, counts, strict=True)
        ]
        first, second = self.data.outcome.dims
        headline = f"end of the first rocking, over {first} and {second}"
        overturned, later = (100.0 * float(flags.mean()) for flags in (self.data.overturned, self._overturns_later()))
        later_text = f", {later:.1f} % after a first rest" if later else ""
        table = format_table(["outcome", "share of the map"], rows)
        return f"{headline}\n\n{table}\n\noverturns in the end: {overturned:.1f} %{later_text}"

    def _overturns_later(self) -> NDArray[np.bool_]:
        """Whether a block overturns after its first rocking has ended with another outcome."""
        return np.asarray(self.data.overturned & (self.data.outcome != UpliftOutcome.OVERTURNS))

    def to_dict(self) -> dict[str, Any]:
        columns = {str(name): self.data[name].values for name in (*self.data.outcome.dims, *self.data.data_vars)}
        return {"outcomes": {outcome.value: outcome.label for outcome in UpliftOutcome}, **columns}

    def plot(
        self,
        ax: Axes | None = None,
        *,
        labels: Mapping[str, str] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw the outcomes, with the first parameter on the vertical axis.

        Colours show the outcomes of the first rocking, and hatching marks later overturning. `labels` replace the names
        of the parameters on the axes.
        """
        from rocking.plot.maps import draw_outcome_map

        first, second = self.data.outcome.dims
        axis_labels = labels or {}
        return draw_outcome_map(
            x=self.data[second].values,
            y=self.data[first].values,
            outcome=self.data.outcome.values,
            meanings=[outcome.label for outcome in UpliftOutcome],
            is_later=self._overturns_later(),
            x_label=axis_labels.get(str(second), str(second)),
            y_label=axis_labels.get(str(first), str(first)),
            title=title or escape_dollars(f"end of the first rocking under {self.data.attrs['case']}"),
            ax=ax,
            figsize=figsize,
        )


def find_last_exceedance(motion: Motion, thresholds: tuple[float, float], gravity: float) -> float | None:
    """Find the time (s) of the last exceedance of the thresholds (m/s^2); None if exceeded only by rounding error."""
    # Rounding error (four ulp) may raise a peak at the threshold above it.
    plus, minus = (threshold * (1.0 + 2.0**-50) for threshold in thresholds)
    lifts = motion.vertical is None and motion.pga > min(plus, minus)
    if not (lifts or len(find_exceedances(motion, (plus, minus), gravity))):
        return None
    starts = find_exceedances(motion, thresholds, gravity)[:, 0]
    return float(starts[-1]) if starts.size else None


def classify_uplifts(results: NDArray[np.void], last_exceedance: float | None) -> Integers:
    """Determine the `UpliftOutcome` of each block from the results of its certified simulation.

    ``last_exceedance`` is a time from `find_last_exceedance`. For a block that rests several times, UNPROVEN means that
    one of the rests is not proven.
    """
    if last_exceedance is None:
        return np.full(len(results), UpliftOutcome.NO_UPLIFT, dtype=np.int64)
    never_rests, rests_early = results["rests"] == 0, results["first_rest"] <= last_exceedance
    outcomes = np.where(rests_early, UpliftOutcome.RESTS_LATER, UpliftOutcome.RESTS_AT_LAST)
    outcomes[results["complete_chattering"]] = UpliftOutcome.COMPLETE
    outcomes[never_rests] = UpliftOutcome.OVERTURNS
    outcomes[(results["rests_by_rounding"] > 0) | (results["unfinished"] & never_rests)] = UpliftOutcome.UNPROVEN
    outcomes[results["uplifts"] == 0] = UpliftOutcome.NO_UPLIFT
    return outcomes.astype(np.int64)


def _describe_common_properties(first: SimulationInput, last: SimulationInput) -> str:
    """Describe the common properties of two inputs: name of the motion, proportions and size of the block, model."""

    def list_properties(point: SimulationInput) -> list[str]:
        alpha, restitution = (
            ", ".join(dict.fromkeys(f"{getattr(side, name):.5g}" for side in point.block.sides))
            for name in ("alpha", "restitution")
        )
        return [point.motion.name, f"alpha = {alpha} rad", f"restitution = {restitution}", f"{point.model} model"]

    return ", ".join(a for a, b in zip(list_properties(first), list_properties(last), strict=True) if a == b)


def _simulate_point(point: SimulationInput) -> _MapPoint:
    """Simulate one point; only a full response contains a bracket of the rest."""
    block, motion, model = point
    response = simulate(block, motion, model=model)
    last_exceedance = find_last_exceedance(motion, block.uplift_thresholds(model), block.gravity)
    if not len(response.events) or last_exceedance is None:
        return _MapPoint()
    results = np.zeros(1, OUTCOME_DTYPE)
    uplift, rests = float(response.events["time"][0]), len(response.sequences)
    results["uplifts"], results["rests"], results["unfinished"] = 1, rests, response.unfinished
    rest = lower = upper = math.nan
    if rests:
        rest, lower, upper = (float(response.sequences[name][0]) for name in ("end", "lower", "upper"))
        # The motion must not exceed a threshold before the upper bound of the rest.
        results["first_rest"], results["rests_by_rounding"] = upper, math.isnan(upper)
        if not math.isnan(upper):
            states, trail = state.create_states(1, 0), response.solution.trail
            states["rest_count"], states["first_uplift"], states["first_rest"] = rests, uplift, upper
            grounds, factors = join_grounds([trail.ground]), np.array([trail.ground.factor])
            blocks, index = np.array([trail.block]), np.zeros(1, dtype=np.int64)
            results["complete_chattering"] = detect_complete_chattering(grounds, index, factors, blocks, states)
    outcome = int(classify_uplifts(results, last_exceedance)[0])
    return _MapPoint(outcome, uplift, rest, lower, upper, rests, response.overturned)


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringEpisodes(Result):
    """Episodes of complete chattering in a response, created by `chattering_episodes`; ``print`` shows a table.

    Attributes
    ----------
    episodes : structured array
        One row per interval of rocking that ends with complete chattering: uplift (s; 0 if already moving); proven
        (time of the impact from which completeness is proven, s); rest, lower and upper (time of rest and its bounds,
        s); duration from uplift to rest (s); impacts resolved; ground (acceleration at the rest, m/s^2).
    shaking_span : tuple of float
        Bracketed duration: times at which the motion first exceeds a threshold of the block, and last falls below one
        or the block overturns, s; NaN if not before the end of the simulation.
    time_at_rest : float
        Time at rest within the bracketed duration, s.

    See Also
    --------
    chattering_episodes : List the episodes of a response.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090"))
    >>> episodes = rocking.chattering.chattering_episodes(response)
    >>> f"{len(episodes.episodes)} episodes, at rest for {100 * episodes.share_at_rest:.0f} % of the shaking"
    '6 episodes, at rest for 50 % of the shaking'
    """

    episodes: NDArray[np.void]
    shaking_span: tuple[float, float]
    time_at_rest: float

    def _format_headline(self) -> str:
        return f"{len(self.episodes)}, at rest for {self.time_at_rest:.3f} s of the shaking"

    @property
    def share_at_rest(self) -> float:
        """Fraction of the bracketed duration during which the block is at rest; NaN without a bracketed duration."""
        start, end = self.shaking_span
        return self.time_at_rest / (end - start) if end > start else math.nan

    @property
    def ends_during_shaking(self) -> NDArray[np.bool_]:
        """Whether each episode ends before the motion exceeds a threshold for the last time."""
        return np.asarray(self.episodes["upper"] < self.shaking_span[1])

    def __str__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        header = ["uplift, s", "rest, s", "bracket, s", "duration, s", "impacts", "ground, m/s^2"]
        rows = []
        for uplift, _, rest, lower, upper, duration, impacts, ground in self.episodes.tolist():
            times = f"{uplift:.6f}", f"{rest:.9f}", f"{upper - lower:.1e}", f"{duration:.6f}"
            rows.append([*times, impacts, f"{ground:+.4f}"])
        start, end = self.shaking_span
        conclusion = f"at rest for {self.share_at_rest:.1%} of the shaking from {start:.3f} s to {end:.3f} s"
        if math.isnan(start):
            conclusion = "the motion never passes a threshold of the block before the simulation ends"
        return f"{format_table(header, rows)}\n{conclusion}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "episodes": array_to_rows(self.episodes),
            "shaking_s": self.shaking_span,
            "time_at_rest_s": self.time_at_rest,
            "share_at_rest": self.share_at_rest,
        }


def chattering_episodes(response: Response) -> ChatteringEpisodes:
    """List the episodes of complete chattering in a response.

    Parameters
    ----------
    response : Response
        Response from `rocking.simulate` with certified chattering. Unproven rests are not episodes.

    Returns
    -------
    ChatteringEpisodes
        Episodes with duration and bracket, and the fraction of the shaking spent at rest. The shaking is the bracketed
        duration for this block, from the first to the last exceedance of its thresholds.

    Raises
    ------
    OptionError
        If the argument is not the `Response` of a block without restraints.

    See Also
    --------
    rocking.simulate : Simulate the response of a block.
    chattering_map : Compute a map of outcomes.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090"))
    >>> result = chattering_episodes(response)
    >>> len(result.episodes), bool((result.episodes["upper"] - result.episodes["lower"] < 1e-11).all())
    (6, True)
    >>> print(f"{result.share_at_rest:.3f}")
    0.498
    """
    if not isinstance(response, Response):
        message = f"{{}} must be a Response of simulate(block, motion); got {type(response).__name__}"
        raise OptionError(message, "response", value=response)
    sequences = response.sequences[np.isfinite(response.sequences["upper"])]
    uplifts = response.events["time"][response.events["kind"] == "uplift"]
    impacts = response.impacts["time"]
    episodes = np.zeros(len(sequences), _EPISODE_DTYPE)
    uplift_indices = np.searchsorted(uplifts, sequences["end"], side="left") - 1
    episodes["uplift"] = np.where(uplift_indices >= 0, np.append(uplifts, 0.0)[uplift_indices], 0.0)
    for name, field in (("proven", "start"), ("rest", "end"), ("lower", "lower"), ("upper", "upper")):
        episodes[name] = sequences[field]
    episodes["duration"] = episodes["rest"] - episodes["uplift"]
    impacts_before = np.searchsorted(impacts, episodes["uplift"], "left")
    episodes["impacts"] = np.searchsorted(impacts, sequences["end"], "right") - impacts_before
    if response.motion is None:
        return ChatteringEpisodes(episodes, (math.nan, math.nan), 0.0)
    episodes["ground"] = response.motion.acceleration(sequences["end"])
    block = require_block(response.block)
    exceedances = find_exceedances(response.motion, block.uplift_thresholds(response.model), block.gravity)
    if not len(exceedances) or exceedances[0, 0] >= response.duration:
        return ChatteringEpisodes(episodes, (math.nan, math.nan), 0.0)
    start, end = float(exceedances[0, 0]), min(float(exceedances[-1, 1]), response.duration)
    # The shaking starts with an uplift, within rounding error.
    time_at_rest = clear_rounding(np.diff(np.clip(response.rest_intervals, start, end)), end).sum()
    return ChatteringEpisodes(episodes, (start, end), float(time_at_rest))
