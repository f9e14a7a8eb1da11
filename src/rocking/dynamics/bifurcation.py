"""Long-term behaviour of a body under periodic motion: bifurcation diagrams and Lyapunov exponents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, Result, format_some_rows, variable
from rocking.core.tables import escape_dollars, format_count
from rocking.core.threads import map_in_threads
from rocking.dynamics.attractors import RETURN
from rocking.dynamics.bodies import LinearBody
from rocking.dynamics.maps import TOGETHER, PeriodOutcome, Scale, StroboscopicMap, described, scale_of, stroboscopic_map
from rocking.dynamics.orbits import impacts_of
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import InvalidOption
from rocking.kernels.periodic import measure_stretches
from rocking.motion.motion import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Orders of the values of the parameter.
Direction = Literal["up", "down", "both", "afresh"]

#: Values of the period if the body overturned, and if it took too many steps.
OVERTURNED: Final = -1
NOT_FOLLOWED: Final = -2

#: Number of values per update of the progress bar.
_CHUNK: Final = 10


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationDiagram(DatasetResult):
    """Long-term states of orbits against a parameter, created by `bifurcation_diagram`.

    The figure shows every recorded state, with one colour per direction.

    Attributes
    ----------
    data : xarray.Dataset
        With dimensions (direction, value, start, iterate): coordinate and velocity at the starts of periods after the
        transient, NaN after overturning or too many steps. With dimensions (direction, value, start): period, in
        periods of the motion (0 if the recorded states do not repeat, -1 after overturning, -2 after too many steps),
        and impacts in this period (infinity with complete chattering, -1 without a period).

    See Also
    --------
    bifurcation_diagram : Compute the diagram.
    """

    TABLES = MappingProxyType({"states": ("coordinate", "velocity"), "orbits": ("period", "impacts")})

    def changes(self, direction: str | None = None, start: int = 0) -> list[tuple[float, float, int, int]]:
        """List the changes of the period in the order of the computation.

        Each entry contains the values before and after, and the periods there.
        The direction is by default the first; `start` is the number of the initial state. The codes 0, -1 and -2 stand
        for missing periods, as in ``data``. Raise `InvalidOption` if there is no such direction or start.
        """
        ways = self.data.direction.values.tolist()
        way = ways.index(checks.choice(ways[0] if direction is None else direction, "direction", InvalidOption, ways))
        number = checks.integer(start, "start", InvalidOption, minimum=0, maximum=self.data.sizes["start"] - 1)
        values, periods = self.data.value.values, self.data.period.values[way, :, number]
        if ways[way] == "down":
            values, periods = values[::-1], periods[::-1]
        return [
            (float(values[k]), float(values[k + 1]), int(periods[k]), int(periods[k + 1]))
            for k in np.flatnonzero(np.diff(periods) != 0)
        ]

    def summary(self) -> str:
        data = self.data
        head = f"bifurcation diagram over {data.parameter}: {format_count(data.sizes['value'], 'value')}, {data.cases}"
        parts = [head]
        for way in data.direction.values.tolist():
            for start in range(data.sizes["start"]):
                rows = [
                    [f"{before:.6g}", f"{after:.6g}", _in_words(old), _in_words(new)]
                    for before, after, old, new in self.changes(way, start)
                ]
                which = f"{way}, start {start + 1}" if data.sizes["start"] > 1 else way
                period = int(data.period.sel(direction=way).values[0, start])
                said = f"{'period ' if period >= 0 else ''}{_in_words(period)} throughout"
                if rows:
                    said = f"changes of the period\n{format_some_rows(['from', 'to', 'before', 'after'], rows)}"
                parts.append(f"{which}: {said}")
        return "\n\n".join(parts)

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            "parameter": data.parameter,
            "cases": data.cases,
            "transient": data.transient,
            "kept": data.sizes["iterate"],
            "direction": data.direction.values.tolist(),
            "value": data.value.values,
            "starts": np.stack([data.start_coordinate.values, data.start_velocity.values], axis=-1),
            "period": data.period.values,
            "impacts": data.impacts.values,
            "changes": {
                way: [self.changes(way, start) for start in range(data.sizes["start"])]
                for way in data.direction.values.tolist()
            },
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import draw_bifurcation

        data = self.data
        over = (data.period.values == OVERTURNED).all(axis=(0, 2))
        return draw_bifurcation(
            value=data.value.values,
            states={
                way: data.coordinate.sel(direction=way).values.reshape(data.sizes["value"], -1)
                for way in data.direction.values.tolist()
            },
            overturned=over,
            not_followed=(data.period.values < 0).all(axis=(0, 2)) & ~over,
            x_label=escape_dollars(data.parameter.replace("_", " ")),
            y_label=f"{data.coordinate.attrs['long_name']} ({data.coordinate.units})",
            title=title or escape_dollars(data.cases),
            ax=ax,
            figsize=figsize,
        )


def bifurcation_diagram(
    case: Callable[[float], tuple[Body, Motion]],
    values: ArrayLike,
    starts: ArrayLike,
    *,
    direction: Direction = "up",
    transient: int = 200,
    recorded: int = 64,
    parameter: str = "parameter",
    model: Model | None = None,
    chattering: str | ChatteringScheme = "certified",
) -> BifurcationDiagram:
    """Compute the long-term states of orbits of a body under periodic motion against a parameter.

    Parameters
    ----------
    case : callable
        Function of the parameter that returns the body and one period of the motion.
    values : array_like, shape (n,)
        Increasing values of the parameter.
    starts : array_like, shape (2,) or (k, 2)
        Coordinate and velocity of one or several initial states.
    direction : {"up", "down", "both", "afresh"}
        Order of the values. Up or down: orbits continue from the last state at the previous value, or from the initial
        state if this is unknown (for example after overturning). Afresh: every value starts from the initial states.
    transient, recorded : int
        Numbers of discarded and of recorded periods at each value. Near a bifurcation orbits settle slowly. After a
        short transient, no period may be found, or the previous one.
    parameter : str
        Name of the parameter with its unit, for tables and figures.
    model, chattering : str, optional
        As in `stroboscopic_map`.

    Returns
    -------
    BifurcationDiagram
        States, periods and impacts.

    Raises
    ------
    InvalidMotion, InvalidBlock
        If the function does not return a body and a motion.

    See Also
    --------
    continue_orbit : Follow stable and unstable orbits as a parameter changes.
    lyapunov_exponents : Compute the Lyapunov exponents of an orbit.

    Examples
    --------
    >>> import numpy as np, rocking
    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> def case(ratio):
    ...     return ball, rocking.pulses.sine(10.0 * ratio, 5.0, cycles=1)
    >>> found = dynamics.bifurcation_diagram(case, np.linspace(1.4, 1.6, 5), [0.1, 0.5], parameter="A w^2/g")
    >>> found.data.period.values[0, :, 0].tolist()
    [1, 1, 1, 2, 2]
    """
    if not callable(case):
        raise InvalidOption("{} must be a function of the parameter that returns a body and one period", "case")
    way = checks.choice(direction, "direction", InvalidOption, get_args(Direction))
    levels = checks.axis(values, "values", InvalidOption)
    first = checks.numbers(starts, "starts", InvalidOption)
    if first.ndim not in (1, 2) or first.shape[-1] != 2 or first.size == 0:
        raise InvalidOption("{} must be one pair (coordinate, velocity) or several", "starts")
    first = first.reshape(-1, 2)
    before = checks.integer(transient, "transient", InvalidOption, minimum=0)
    count = checks.integer(recorded, "recorded", InvalidOption, minimum=2)
    name = checks.text(parameter, "parameter", InvalidOption)
    checks.grid_size({"values": levels.size, "starts": len(first), "recorded": count}, InvalidOption)

    afresh, ways = way == "afresh", ("up", "down") if way == "both" else (way,)
    order = {w: range(levels.size)[:: -1 if each == "down" else 1] for w, each in enumerate(ways)}
    shape = len(ways), levels.size, len(first)
    states, period, impacts = np.full((*shape, count, 2), np.nan), np.full(shape, OVERTURNED), np.full(shape, -1.0)

    def follow(item: tuple[int, Sequence[int]]) -> int:
        """Follow the orbits of one direction through some values, and return their number."""
        w, some = item
        for k in some:
            strobe, last = _map_of(case(float(levels[k])), model, chattering), k - order[w].step
            at = first if afresh or not 0 <= last < levels.size else states[w, last, :, -1]
            at = _in_front(strobe, np.where(np.isnan(at), first, at))
            states[w, k], outcomes = states_after(strobe, at, before, count)
            now, scale = states[w, k, :, -1], scale_of(strobe)
            period[w, k, outcomes == PeriodOutcome.UNFINISHED] = NOT_FOLLOWED
            for s in np.flatnonzero(~np.isnan(now[:, 0])):
                n = period[w, k, s] = period_of(states[w, k, s], scale)
                if n:
                    impacts[w, k, s] = impacts_of(strobe, now[s], n, strobe.derivative(now[s], n)[1])
        return len(some)

    ends = [_map_of(case(float(each)), model, chattering) for each in levels[[0, -1]]]
    for strobe in ends:
        strobe.checked_starts(first, "starts")  # raises an error for a start behind a stop
    with Progress("bifurcation diagram", len(ways) * levels.size) as bar:
        for start in range(0, levels.size, _CHUNK):
            chunks = [(w, each[start : start + _CHUNK]) for w, each in order.items()]
            for done in map_in_threads(follow, [(0, [k]) for k in chunks[0][1]] if afresh else chunks):
                bar.advance(done)

    import xarray as xr

    coordinate = ends[0].body.coordinate
    orbits, over = ("direction", "value", "start"), ("direction", "value", "start", "iterate")
    said = (_common([described(each.body) for each in ends]), _common([described(each.motion) for each in ends]))
    meaning = "periods of the motion, 0: none found, -1: overturned, -2: not followed"
    meaning_of_impacts = "impacts in one period of the orbit, infinite: chattering, -1: not known"
    found = xr.Dataset(
        {
            "coordinate": variable(over, states[..., 0], coordinate.name, coordinate.unit),
            "velocity": variable(over, states[..., 1], coordinate.rate, f"{coordinate.unit}/s"),
            "period": variable(orbits, period, meaning),
            "impacts": variable(orbits, impacts, meaning_of_impacts),
            "start_coordinate": variable("start", first[:, 0], "initial state", coordinate.unit),
            "start_velocity": variable("start", first[:, 1], "initial state", f"{coordinate.unit}/s"),
        },
        {"direction": list(ways), "value": variable("value", levels, name, "1")},
        {
            "program": f"rocking {VERSION}",
            "parameter": name,
            "cases": " under ".join(said),
            "model": ends[0].model,
            "transient": before,
        },
    )
    return BifurcationDiagram(found)


def _map_of(pair: Any, model: Model | None, chattering: str | ChatteringScheme) -> StroboscopicMap:
    if not isinstance(pair, tuple) or len(pair) != 2:
        raise InvalidOption("{} must return a body and one period of a motion", "case")
    return stroboscopic_map(*pair, model=model, chattering=chattering)


def _in_front(strobe: StroboscopicMap, states: Floats) -> Floats:
    """Move states that a change of the parameter has put behind a stop back to the stop."""
    low, high = strobe.body.stops
    if not isinstance(strobe.body, LinearBody):
        return states
    inside = np.clip(states[:, 0], low, high if high > low else np.inf)
    held = (inside != states[:, 0]) | ((inside == low) & (states[:, 1] < 0.0))
    return np.stack([inside, np.where(held, 0.0, states[:, 1])], axis=-1)


def states_after(strobe: StroboscopicMap, at: Floats, transient: int, recorded: int) -> tuple[Floats, Integers]:
    """Return states at the starts of periods after a transient, shape (n, recorded, 2), and the `PeriodOutcome` of each."""
    states, now, outcomes = np.full((len(at), recorded, 2), np.nan), at, np.full(len(at), PeriodOutcome.MOVES.value)
    if transient:
        now, outcomes, _ = strobe.advance(at, transient)
    moves = ~np.isnan(now[:, 0])
    if moves.any():
        states[moves] = strobe.orbit(now[moves], recorded)[:, 1:]
    lost = moves & np.isnan(states[:, -1, 0])
    if lost.any():
        outcomes[lost] = strobe.advance(now[lost], recorded)[1]
    return states, outcomes


def period_of(states: Floats, scale: Scale | None = None) -> int:
    """Return the period of an orbit from its recorded states.

    The period is 0 if the orbit does not repeat within half of the states, or is still settling.

    Differences are relative to the size of the orbit, but at least to a small share of the natural ``scale``, because
    the size of a state at zero is only its rounding error.
    """
    size = np.abs(states).max(axis=0) + np.finfo(float).tiny
    if scale is not None:
        # With this size `RETURN` is about a thousand times the rounding error.
        size = np.maximum(size, 1e-6 * np.array(scale))

    def apart(period: int) -> Floats:
        distance: Floats = (np.abs(states[period:] - states[:-period]) / size).max(axis=1)
        return distance

    for period in range(1, len(states) // 2 + 1):
        if apart(period).max() <= RETURN:
            # Alternating approach to a shorter orbit resembles twice its period.
            for shorter in (each for each in range(1, period) if period % each == 0):
                gaps = apart(shorter)
                if gaps[-period:].max() < 0.99 * gaps[:period].max():
                    return 0
            return period
    return 0


def _common(texts: Sequence[str]) -> str:
    """Return the comma-separated parts that all texts share."""
    first, last = (text.split(", ") for text in texts)
    return ", ".join(part for part in first if part in last)


def _in_words(period: int) -> str:
    return {0: "none found", OVERTURNED: "overturned", NOT_FOLLOWED: "not followed"}.get(period, str(period))


#: Number of parts of an orbit whose means determine the standard error.
_BATCHES: Final = 20


@dataclass(frozen=True, eq=False, repr=False)
class LyapunovExponents(Result):
    """Lyapunov exponents of one orbit, created by `lyapunov_exponents`.

    Attributes
    ----------
    largest, smallest : float
        Weighted means, per period, of the logarithms of the stretch in the direction of fastest growth and across it.
        Minus infinity after a rest in any period, NaN after overturning. Without energy loss a period at rest counts as
        zero, because neighbouring states never rest.
    standard_error : float
        Standard error of both, from the means of 20 consecutive parts of the orbit.
    forcing_period, n_periods : float, int
        Period of the motion, s, and number of averaged periods.
    impacts : float
        Number of impacts per period.
    resting : float
        Fraction of the known periods in which the body comes to rest or is at rest; NaN if no period is known.
    outcome : PeriodOutcome
        Final condition of the body.
    stretches : ndarray, shape (n_periods, 2)
        Logarithms of the stretches in each period.

    See Also
    --------
    lyapunov_exponents : Compute the exponents.
    """

    largest: float
    smallest: float
    standard_error: float
    forcing_period: float
    n_periods: int
    impacts: float
    resting: float
    outcome: PeriodOutcome
    stretches: Floats

    def summary(self) -> str:
        over = f"over {format_count(self.n_periods, 'period')}"
        if np.isnan(self.largest):
            return f"no Lyapunov exponents: the body overturns or cannot be followed {over}"
        if np.isneginf(self.largest):
            return (
                f"Lyapunov exponents: minus infinity; the body comes to rest in {100.0 * self.resting:.3g} % of the "
                f"periods, {over}"
            )
        said = f"{self.largest:.6g} and {self.smallest:.6g} per period (standard error {self.standard_error:.1g})"
        return f"Lyapunov exponents: {said}, {over}, {self.impacts:.4g} impacts in each"

    def to_dict(self) -> dict[str, Any]:
        return {
            "largest_per_period": self.largest,
            "smallest_per_period": self.smallest,
            "standard_error": self.standard_error,
            "period_s": self.forcing_period,
            "periods": self.n_periods,
            "impacts_per_period": self.impacts,
            "share_of_periods_with_rest": self.resting,
            "outcome": self.outcome.name,
        }


def lyapunov_exponents(
    body: Body,
    motion: Motion,
    state: ArrayLike,
    n_periods: int = 1000,
    *,
    transient: int = 200,
    model: Model | None = None,
    chattering: str | ChatteringScheme = "certified",
) -> LyapunovExponents:
    """Compute both Lyapunov exponents of a body under periodic motion from one orbit.

    Parameters
    ----------
    body, motion : Body, Motion
        As in `stroboscopic_map`.
    state : array_like, shape (2,)
        Coordinate and velocity at the start of a period.
    n_periods : int
        Number of averaged periods.
    transient : int
        Number of preceding periods, in which the direction aligns with the fastest growth.
    model, chattering : str, optional
        As in `stroboscopic_map`.

    Returns
    -------
    LyapunovExponents
        Exponents per period, with a standard error.

    See Also
    --------
    bifurcation_diagram : Compute long-term states against a parameter.
    periodic_orbits : Find periodic orbits with their multipliers.

    Notes
    -----
    On a stable periodic orbit the exponents are the logarithms of the absolute multipliers, divided by the period.
    Their sum is the mean logarithm of the contraction of areas: 2 ln(restitution) per impact, minus the damping times
    the period. A rest removes every small difference. Therefore both exponents are minus infinity however rare rests
    are.

    References
    ----------
    P. C. Mueller, "Calculation of Lyapunov exponents for dynamic systems with discontinuities", Chaos, Solitons and
    Fractals 5 (1995). S. Das and others, "Measuring quasiperiodicity", Europhysics Letters 114 (2016).

    Examples
    --------
    >>> import math, rocking
    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> shaking = rocking.pulses.sine(1.3 * 10.0, 5.0, cycles=1)
    >>> found = dynamics.lyapunov_exponents(ball, shaking, [0.1, 0.5])
    >>> f"{found.largest:.6f} {found.smallest:.6f}, ln 0.5 = {math.log(0.5):.6f}"
    '-0.693147 -0.693147, ln 0.5 = -0.693147'
    """
    strobe = stroboscopic_map(body, motion, model=model, chattering=chattering)
    given = checks.numbers(state, "state", InvalidOption)
    if given.shape != (2,):
        raise InvalidOption(f"{{}} must be one pair (coordinate, velocity), not of shape {given.shape}", "state")
    strobe.checked_starts(given, "state")
    count = checks.integer(n_periods, "n_periods", InvalidOption, minimum=_BATCHES)
    before = checks.integer(transient, "transient", InvalidOption, minimum=0)
    made, marching = strobe._states(given[None])[1][0], strobe._marching()
    frame, logs, impacts = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]), np.full((before + count, 2), np.nan), 0
    for start, stop in pairwise(sorted({*range(0, before + count, TOGETHER), before, before + count})):
        here = measure_stretches(*marching, made, frame, logs[start:stop])
        impacts += here if start >= before else 0
        if made["ending"] not in (PeriodOutcome.MOVES, PeriodOutcome.RESTS):
            break
    outcome, logs = PeriodOutcome(int(made["ending"])), logs[before:]
    if outcome == PeriodOutcome.RESTS_FOR_EVER:
        logs[np.isnan(logs)] = -np.inf
    rests = np.isneginf(logs[:, 0])
    if strobe._loses_nothing:  # neighbouring states never come to rest, and neither approach nor separate
        logs[rests] = 0.0
    # Weights of a mean over periods that vanish with all derivatives at both ends (Das and others 2016).
    at = (np.arange(count) + 0.5) / count
    bump = np.exp(-1.0 / (at * (1.0 - at)))
    weights: Floats = bump / bump.sum()
    known = ~np.isnan(logs).any(axis=1)
    mean, error = np.full(2, np.nan), float("nan")
    if known.all():  # otherwise the later periods are unknown, despite earlier rests
        mean[:] = [-np.inf if np.isneginf(each).any() else weights @ each for each in logs.T]
    if np.isfinite(logs[:, 0]).all():  # standard error of an unweighted mean, from consecutive parts
        means = [part.mean() for part in np.array_split(logs[:, 0], _BATCHES)]
        error = float(np.std(means, ddof=1) / np.sqrt(_BATCHES))
    return LyapunovExponents(
        largest=float(mean[0]),
        smallest=float(mean[1]),
        standard_error=error * float(np.sqrt(count * np.sum(weights**2))),
        forcing_period=strobe.forcing_period,
        n_periods=count,
        impacts=impacts / count,
        resting=float(np.mean(rests[known])) if known.any() else float("nan"),
        outcome=outcome,
        stretches=logs,
    )
