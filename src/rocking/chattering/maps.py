"""Where chattering is complete, by certified simulation: maps over two parameters, and episodes in one response."""

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

from rocking.chattering.families import Family, SimulationInput
from rocking.core import checks
from rocking.core.arrays import Integers, without_dust
from rocking.core.constants import VERSION
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, Result
from rocking.core.tables import as_written, rows_of, text_table
from rocking.core.threads import in_threads
from rocking.engine.tasks import OUTCOME, complete_chattering
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.motion.motion import Motion, exceedances
from rocking.response import Response
from rocking.simulation.simulate import simulate

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


_EPISODE: Final = np.dtype(
    [(name, float) for name in ("uplift", "proven", "rest", "lower", "upper", "duration")]
    + [("impacts", np.int64), ("ground", float)]
)


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
_ATTRIBUTES: Final[dict[str, dict[str, Any]]] = {
    "outcome": {
        "flag_values": [outcome.value for outcome in Outcome],
        "flag_meanings": " ".join(outcome.name.lower() for outcome in Outcome),
    },
    **{name: {"units": "s"} for name in ("uplift", "rest", "lower", "upper")},
    "rests": {"units": "1", "long_name": "times the block comes to rest"},
}


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
        Names and values of the two parameters, given to the family in this order; the first is upwards in the figure.
    threads, progress : int or bool, optional
        As for `rocking.simulate_many`.

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
    Each rest is proven by certificate. The paper has no criteria but for the sine (end of its section 5.2).

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
    (first, x), (second, y) = ((k, checks.axis(values, k, InvalidOption)) for k, values in parameters.items())
    swapped = _is_swapped(family, str(first), str(second))
    inputs = [family(*map(float, (other, one) if swapped else (one, other))) for one in x for other in y]
    for each in inputs:
        if not (isinstance(each, SimulationInput) and isinstance(each.motion, Motion)):
            raise InvalidOption(
                "{} must return a SimulationInput of a block and a Motion for each pair", "family", value=each
            )
    points: list[_Point] = []
    with Progress("mapping", len(inputs), show=progress) as bar:
        for point in in_threads(_simulated, inputs, threads=count):
            points.append(point)
            bar.advance()
    columns = zip(_Point._fields, zip(*points, strict=True), strict=True)
    dataset = xr.Dataset(
        {
            name: ((first, second), np.reshape(column, (x.size, y.size)), _ATTRIBUTES.get(name, {}))
            for name, column in columns
        },
        {first: x, second: y},
        {"program": f"rocking {VERSION}", "case": _in_common(inputs[0], inputs[-1])},
    )
    return ChatteringMap(dataset.assign(complete=dataset.outcome == Outcome.COMPLETE))


def _is_swapped(family: Family, first: str, second: str) -> bool:
    """Whether the parameters of a family have these names in the opposite order."""
    try:
        names = [*inspect.signature(family).parameters]
    except (TypeError, ValueError):  # a callable without a signature
        return False
    return len(names) > 1 and (first == names[1] or second == names[0])


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
        return np.asarray(self.data.overturned & (self.data.outcome != Outcome.OVERTURNS))

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
        `labels` replace the names of the parameters at the axes.
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
    """Time, s, at which a motion last passes the thresholds of the two sides (m/s^2); None if it hardly passes one."""
    # By four ulp a peak that was meant to be the threshold may exceed it.
    plus, minus = (threshold * (1.0 + 2.0**-50) for threshold in thresholds)
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

    def described(given: SimulationInput) -> list[str]:
        alpha, restitution = (
            ", ".join(dict.fromkeys(f"{getattr(side, name):.5g}" for side in given.block.sides))
            for name in ("alpha", "restitution")
        )
        return [given.motion.name, f"alpha = {alpha} rad", f"restitution = {restitution}", f"{given.model} model"]

    return ", ".join(a for a, b in zip(described(one), described(other), strict=True) if a == b)


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
        if not math.isnan(times["upper"]):
            states, trail = state.new_states(1, 0), response.solution.trail
            states["rests"], states["first_uplift"], states["first_rest"] = rests, uplift, times["upper"]
            ends["complete_chattering"] = complete_chattering(trail.ground, np.array([trail.block]), states)
    return _Point(int(outcomes_of(ends, last)[0]), uplift, **times, rests=rests, overturned=response.overturned)


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringEpisodes(Result):
    """The episodes of a response, from `chattering_episodes`; ``print`` it for a table.

    Attributes
    ----------
    episodes : structured array
        One row for each stretch of rocking that complete chattering ends: uplift (s; 0 where the block was already
        moving); proven (time of the impact from which chattering is proven to be complete, s); rest, and lower and
        upper bound on it (s); duration from uplift to rest (s); impacts resolved in it; ground (acceleration at the
        rest, m/s^2).
    shaking : tuple of float
        Bracketed duration: when the motion first passes a threshold of the block, and when it falls below one for the
        last time or the block has overturned, s; NaN where it never does before the simulation ends.
    at_rest : float
        Time at rest within the bracketed duration, s.
    """

    episodes: NDArray[np.void]
    shaking: tuple[float, float]
    at_rest: float

    def _headline(self) -> str:
        return f"{len(self.episodes)}, at rest for {self.at_rest:.3f} s of the shaking"

    @property
    def share_at_rest(self) -> float:
        """Share of the bracketed duration during which the block is at rest; NaN where there is none."""
        start, end = self.shaking
        return self.at_rest / (end - start) if end > start else math.nan

    @property
    def amid_shaking(self) -> NDArray[np.bool_]:
        """Whether each episode ends before the motion passes a threshold for the last time."""
        return np.asarray(self.episodes["upper"] < self.shaking[1])

    def __str__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        header = ["uplift, s", "rest, s", "bracket, s", "duration, s", "impacts", "ground, m/s^2"]
        rows = [
            [
                f"{row['uplift']:.6f}",
                f"{row['rest']:.9f}",
                f"{row['upper'] - row['lower']:.1e}",
                f"{row['duration']:.6f}",
                int(row["impacts"]),
                f"{row['ground']:+.4f}",
            ]
            for row in self.episodes
        ]
        start, end = self.shaking
        about = (
            "the motion never passes a threshold of the block before the simulation ends"
            if math.isnan(start)
            else f"at rest for {self.share_at_rest:.1%} of the shaking from {start:.3f} s to {end:.3f} s"
        )
        return f"{text_table(header, rows)}\n{about}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "episodes": rows_of(self.episodes),
            "shaking_s": self.shaking,
            "at_rest_s": self.at_rest,
            "share_at_rest": self.share_at_rest,
        }


def chattering_episodes(response: Response) -> ChatteringEpisodes:
    """List the episodes of complete chattering in a response.

    Parameters
    ----------
    response : Response
        From `rocking.simulate` with certified chattering. Rests that are not proven are no episodes.

    Returns
    -------
    ChatteringEpisodes
        The episodes with duration and bracket, and the share of the shaking during which the block is at rest. The
        shaking is the bracketed duration for this block: from the first to the last time that the motion is beyond one
        of the block's own thresholds.

    Raises
    ------
    InvalidOption
        If it is given anything but the `Response` of a block without restraints.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090"))
    >>> found = chattering_episodes(response)
    >>> len(found.episodes), bool((found.episodes["upper"] - found.episodes["lower"] < 1e-11).all())
    (6, True)
    >>> print(f"{found.share_at_rest:.3f}")
    0.498
    """
    if not isinstance(response, Response):
        raise InvalidOption(
            f"{{}} must be a Response, not a {type(response).__name__}: simulate(block, motion) makes one", "response"
        )
    proven = response.chattering[np.isfinite(response.chattering["upper"])]
    starts = response.events["time"][response.events["kind"] == "uplift"]
    impacts = response.impacts["time"]
    episodes = np.zeros(len(proven), _EPISODE)
    before = np.searchsorted(starts, proven["end"], side="left") - 1
    episodes["uplift"] = np.where(before >= 0, np.append(starts, 0.0)[before], 0.0)
    for name, source in (("proven", "start"), ("rest", "end"), ("lower", "lower"), ("upper", "upper")):
        episodes[name] = proven[source]
    episodes["duration"] = episodes["rest"] - episodes["uplift"]
    impacts_before = np.searchsorted(impacts, episodes["uplift"], "left")
    episodes["impacts"] = np.searchsorted(impacts, proven["end"], "right") - impacts_before
    if response.motion is None:
        return ChatteringEpisodes(episodes, (math.nan, math.nan), 0.0)
    episodes["ground"] = response.motion.acceleration(proven["end"])
    beyond = exceedances(response.motion, response.block.uplift_thresholds(response.model), response.block.gravity)
    if not len(beyond) or beyond[0, 0] >= response.duration:
        return ChatteringEpisodes(episodes, (math.nan, math.nan), 0.0)
    start, end = float(beyond[0, 0]), min(float(beyond[-1, 1]), response.duration)
    # The shaking starts with an uplift, to rounding.
    at_rest = without_dust(np.diff(np.clip(response.rest_intervals, start, end)), end).sum()
    return ChatteringEpisodes(episodes, (start, end), float(at_rest))
