"""Long-term behaviour of a body under periodic motion: bifurcation diagrams and Lyapunov exponents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, Result, create_variable, format_some_rows
from rocking.core.tables import escape_dollars, format_count
from rocking.core.threads import map_in_threads
from rocking.dynamics.attractors import RETURN_TOLERANCE
from rocking.dynamics.bodies import LinearBody
from rocking.dynamics.maps import (
    STATES_PER_CALL,
    PeriodOutcome,
    StateScale,
    StroboscopicMap,
    compute_scale,
    describe_input,
    stroboscopic_map,
)
from rocking.dynamics.orbits import count_orbit_impacts
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.kernels.periodic import measure_stretches
from rocking.motion.motion import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Order in which the values of the parameter are computed.
Direction = Literal["up", "down", "both", "afresh"]

#: Codes instead of a period if the body overturned, and if it required too many steps.
OVERTURNED: Final = -1
NOT_FOLLOWED: Final = -2

#: Number of values per update of the progress bar.
_VALUES_PER_CHUNK: Final = 10


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

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> def case(amplitude):
    ...     return ball, pulses.sine(amplitude, 5.0, cycles=1)
    >>> dynamics.bifurcation_diagram(case, [14.0, 16.0], [0.1, 0.5]).data.period.values[0, :, 0].tolist()
    [1, 2]
    """

    TABLES: ClassVar = {"states": ("coordinate", "velocity"), "orbits": ("period", "impact_count")}

    def changes(self, direction: str | None = None, start: int = 0) -> list[tuple[float, float, int, int]]:
        """List the changes of the period in the order of the computation.

        Each entry contains the values before and after, and the periods there. By default the direction is the first
        one; `start` is the index of the initial state. The codes 0, -1 and -2 stand for missing periods, as in
        ``data``. Raise `OptionError` if there is no such direction or start.
        """
        directions = self.data.direction.values.tolist()
        requested = directions[0] if direction is None else direction
        index = directions.index(checks.choice(requested, "direction", OptionError, directions))
        number = checks.integer(start, "start", OptionError, minimum=0, maximum=self.data.sizes["start"] - 1)
        values, periods = self.data.value.values, self.data.period.values[index, :, number]
        if directions[index] == "down":
            values, periods = values[::-1], periods[::-1]
        return [
            (float(values[k]), float(values[k + 1]), int(periods[k]), int(periods[k + 1]))
            for k in np.flatnonzero(np.diff(periods) != 0)
        ]

    def summary(self) -> str:
        data = self.data
        count = format_count(data.sizes["value"], "value")
        parts = [f"bifurcation diagram over {data.parameter}: {count}, {data.cases}"]
        for direction in data.direction.values.tolist():
            for start in range(data.sizes["start"]):
                rows = [
                    [f"{before:.6g}", f"{after:.6g}", _format_period(old), _format_period(new)]
                    for before, after, old, new in self.changes(direction, start)
                ]
                orbit = f"{direction}, start {start + 1}" if data.sizes["start"] > 1 else direction
                period = int(data.period.sel(direction=direction).values[0, start])
                description = f"{'period ' if period >= 0 else ''}{_format_period(period)} throughout"
                if rows:
                    description = f"changes of the period\n{format_some_rows(['from', 'to', 'before', 'after'], rows)}"
                parts.append(f"{orbit}: {description}")
        return "\n\n".join(parts)

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            "parameter": data.parameter,
            "cases": data.cases,
            "transient_periods": data.transient_periods,
            "recorded_periods": data.sizes["iterate"],
            "direction": data.direction.values.tolist(),
            "value": data.value.values,
            "starts": np.stack([data.start_coordinate.values, data.start_velocity.values], axis=-1),
            "period": data.period.values,
            "impacts": data.impact_count.values,
            "changes": {
                direction: [self.changes(direction, start) for start in range(data.sizes["start"])]
                for direction in data.direction.values.tolist()
            },
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import draw_bifurcation

        data = self.data
        overturned = (data.period.values == OVERTURNED).all(axis=(0, 2))
        return draw_bifurcation(
            value=data.value.values,
            states={
                direction: data.coordinate.sel(direction=direction).values.reshape(data.sizes["value"], -1)
                for direction in data.direction.values.tolist()
            },
            overturned=overturned,
            not_followed=(data.period.values < 0).all(axis=(0, 2)) & ~overturned,
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
    transient_periods: int = 200,
    recorded_periods: int = 64,
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
    transient_periods, recorded_periods : int
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
    MotionError, BlockError
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
    >>> diagram = dynamics.bifurcation_diagram(case, np.linspace(1.4, 1.6, 5), [0.1, 0.5], parameter="A w^2/g")
    >>> diagram.data.period.values[0, :, 0].tolist()
    [1, 1, 1, 2, 2]
    """
    if not callable(case):
        raise OptionError("{} must be a function of the parameter that returns a body and one period", "case")
    selected = checks.choice(direction, "direction", OptionError, get_args(Direction))
    parameters = checks.axis(values, "values", OptionError)
    initial_states = checks.numbers(starts, "starts", OptionError)
    if initial_states.ndim not in (1, 2) or initial_states.shape[-1] != 2 or initial_states.size == 0:
        raise OptionError("{} must be one pair (coordinate, velocity) or several", "starts")
    initial_states = initial_states.reshape(-1, 2)
    transient_count = checks.integer(transient_periods, "transient_periods", OptionError, minimum=0)
    recorded_count = checks.integer(recorded_periods, "recorded_periods", OptionError, minimum=2)
    parameter_name = checks.text(parameter, "parameter", OptionError)
    sizes = {"values": parameters.size, "starts": len(initial_states), "recorded": recorded_count}
    checks.check_grid_size(sizes, OptionError)

    is_afresh, directions = selected == "afresh", ("up", "down") if selected == "both" else (selected,)
    indices = {d: range(parameters.size)[:: -1 if name == "down" else 1] for d, name in enumerate(directions)}
    shape = len(directions), parameters.size, len(initial_states)
    states = np.full((*shape, recorded_count, 2), np.nan)
    periods, impacts = np.full(shape, OVERTURNED), np.full(shape, -1.0)

    def follow_values(chunk: tuple[int, Sequence[int]]) -> int:
        """Compute consecutive values of the parameter in one direction, and return their number."""
        d, value_indices = chunk
        for k in value_indices:
            strobe, previous = _create_map(case(float(parameters[k])), model, chattering), k - indices[d].step
            has_previous = not is_afresh and 0 <= previous < parameters.size
            start_states = states[d, previous, :, -1] if has_previous else initial_states
            start_states = _move_before_stops(strobe, np.where(np.isnan(start_states), initial_states, start_states))
            states[d, k], outcomes = record_states(strobe, start_states, transient_count, recorded_count)
            final_states, scale = states[d, k, :, -1], compute_scale(strobe)
            periods[d, k, outcomes == PeriodOutcome.UNFINISHED] = NOT_FOLLOWED
            for s in np.flatnonzero(~np.isnan(final_states[:, 0])):
                n = periods[d, k, s] = find_period(states[d, k, s], scale)
                if n:
                    derivative = strobe.derivative(final_states[s], n)[1]
                    impacts[d, k, s] = count_orbit_impacts(strobe, final_states[s], n, derivative)
        return len(value_indices)

    end_maps = [_create_map(case(float(value)), model, chattering) for value in parameters[[0, -1]]]
    for strobe in end_maps:
        strobe._check_starts(initial_states, "starts")  # raises an error for a start behind a stop
    with Progress("bifurcation diagram", len(directions) * parameters.size) as bar:
        for start in range(0, parameters.size, _VALUES_PER_CHUNK):
            chunks = [(d, order[start : start + _VALUES_PER_CHUNK]) for d, order in indices.items()]
            for count in map_in_threads(follow_values, [(0, [k]) for k in chunks[0][1]] if is_afresh else chunks):
                bar.advance(count)

    import xarray as xr

    coordinate = end_maps[0].body.coordinate
    orbit_dimensions, state_dimensions = ("direction", "value", "start"), ("direction", "value", "start", "iterate")
    subjects = zip(*((strobe.body, strobe.motion) for strobe in end_maps), strict=True)
    cases = " under ".join(_join_common_parts(*map(describe_input, pair)) for pair in subjects)
    meaning_of_period = "periods of the motion, 0: none found, -1: overturned, -2: not followed"
    meaning_of_impacts = "impacts in one period of the orbit, infinite: chattering, -1: not known"
    dataset = xr.Dataset(
        {
            "coordinate": create_variable(state_dimensions, states[..., 0], coordinate.name, coordinate.unit),
            "velocity": create_variable(state_dimensions, states[..., 1], coordinate.rate_name, f"{coordinate.unit}/s"),
            "period": create_variable(orbit_dimensions, periods, meaning_of_period),
            "impact_count": create_variable(orbit_dimensions, impacts, meaning_of_impacts),
            "start_coordinate": create_variable("start", initial_states[:, 0], "initial state", coordinate.unit),
            "start_velocity": create_variable("start", initial_states[:, 1], "initial state", f"{coordinate.unit}/s"),
        },
        {"direction": list(directions), "value": create_variable("value", parameters, parameter_name, "1")},
        {
            "program": f"rocking {VERSION}",
            "parameter": parameter_name,
            "cases": cases,
            "model": end_maps[0].model,
            "transient_periods": transient_count,
        },
    )
    return BifurcationDiagram(dataset)


def _create_map(pair: Any, model: Model | None, chattering: str | ChatteringScheme) -> StroboscopicMap:
    if not isinstance(pair, tuple) or len(pair) != 2:
        raise OptionError("{} must return a body and one period of a motion", "case")
    return stroboscopic_map(*pair, model=model, chattering=chattering)


def _move_before_stops(strobe: StroboscopicMap, states: Floats) -> Floats:
    """Move states behind a stop, after a change of the parameter, to the stop."""
    low, high = strobe.body.stops
    if not isinstance(strobe.body, LinearBody):
        return states
    clipped = np.clip(states[:, 0], low, high if high > low else np.inf)
    is_stopped = (clipped != states[:, 0]) | ((clipped == low) & (states[:, 1] < 0.0))
    return np.stack([clipped, np.where(is_stopped, 0.0, states[:, 1])], axis=-1)


def record_states(
    strobe: StroboscopicMap, starts: Floats, transient_periods: int, recorded_periods: int
) -> tuple[Floats, Integers]:
    """Compute states at the starts of periods after a transient, shape (n, recorded, 2), and each `PeriodOutcome`."""
    states, current = np.full((len(starts), recorded_periods, 2), np.nan), starts
    outcomes = np.full(len(starts), PeriodOutcome.MOVES.value)
    if transient_periods:
        current, outcomes, _ = strobe.advance(starts, transient_periods)
    moves = ~np.isnan(current[:, 0])
    if moves.any():
        states[moves] = strobe.orbit(current[moves], recorded_periods)[:, 1:]
    lost = moves & np.isnan(states[:, -1, 0])
    if lost.any():
        outcomes[lost] = strobe.advance(current[lost], recorded_periods)[1]
    return states, outcomes


def find_period(states: Floats, scale: StateScale | None = None) -> int:
    """Find the period of an orbit from its recorded states.

    The period is 0 if the orbit does not repeat within half of the states, or is still settling.

    Differences are relative to the size of the orbit, but at least to 1e-6 of the natural ``scale``, because the size
    of a state at zero is only its rounding error.
    """
    size = np.abs(states).max(axis=0) + np.finfo(float).tiny
    if scale is not None:
        # With this size `RETURN_TOLERANCE` is about a thousand times the rounding error.
        size = np.maximum(size, 1e-6 * np.array(scale))

    def compute_gaps(period: int) -> Floats:
        return np.asarray((np.abs(states[period:] - states[:-period]) / size).max(axis=1))

    for period in range(1, len(states) // 2 + 1):
        if compute_gaps(period).max() <= RETURN_TOLERANCE:
            # An alternating approach to a shorter orbit resembles an orbit of twice its period.
            for divisor in (candidate for candidate in range(1, period) if period % candidate == 0):
                distances = compute_gaps(divisor)
                if distances[-period:].max() < 0.99 * distances[:period].max():
                    return 0
            return period
    return 0


def _join_common_parts(first: str, last: str) -> str:
    """Join the comma-separated parts that two texts share."""
    return ", ".join(part for part in first.split(", ") if part in last.split(", "))


def _format_period(period: int) -> str:
    return {0: "none found", OVERTURNED: "overturned", NOT_FOLLOWED: "not followed"}.get(period, str(period))


#: Number of parts of an orbit whose means yield the standard error.
_BATCH_COUNT: Final = 20


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
    forcing_period, period_count : float, int
        Period of the motion, s, and number of averaged periods.
    impacts_per_period : float
        Number of impacts per period.
    share_at_rest : float
        Fraction of the known periods in which the body comes to rest or is at rest; NaN if no period is known.
    outcome : PeriodOutcome
        Final condition of the body.
    stretches : ndarray, shape (period_count, 2)
        Logarithms of the stretches in each period.

    See Also
    --------
    lyapunov_exponents : Compute the exponents.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, shaking = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(13.0, 5.0, cycles=1)
    >>> exponents = dynamics.lyapunov_exponents(ball, shaking, [0.1, 0.5])
    >>> f"largest exponent {exponents.largest:.4f}, impacts per period {exponents.impacts_per_period:.0f}"
    'largest exponent -0.6931, impacts per period 1'
    """

    largest: float
    smallest: float
    standard_error: float
    forcing_period: float
    period_count: int
    impacts_per_period: float
    share_at_rest: float
    outcome: PeriodOutcome
    stretches: Floats

    def summary(self) -> str:
        averaging = f"over {format_count(self.period_count, 'period')}"
        if np.isnan(self.largest):
            return f"no Lyapunov exponents: the body overturns or cannot be followed {averaging}"
        if np.isneginf(self.largest):
            rests = f"the body comes to rest in {100.0 * self.share_at_rest:.3g} % of the periods"
            return f"Lyapunov exponents: minus infinity; {rests}, {averaging}"
        exponents = f"{self.largest:.6g} and {self.smallest:.6g} per period (standard error {self.standard_error:.1g})"
        return f"Lyapunov exponents: {exponents}, {averaging}, {self.impacts_per_period:.4g} impacts in each"

    def to_dict(self) -> dict[str, Any]:
        return {
            "largest_per_period": self.largest,
            "smallest_per_period": self.smallest,
            "standard_error": self.standard_error,
            "period_s": self.forcing_period,
            "periods": self.period_count,
            "impacts_per_period": self.impacts_per_period,
            "share_of_periods_with_rest": self.share_at_rest,
            "outcome": self.outcome.name,
        }


def lyapunov_exponents(
    body: Body,
    motion: Motion,
    state: ArrayLike,
    period_count: int = 1000,
    *,
    transient_periods: int = 200,
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
    period_count : int
        Number of averaged periods.
    transient_periods : int
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
    :cite:t:`mueller1995`, "Calculation of Lyapunov exponents for dynamic systems with discontinuities".
    :cite:t:`das2016`, "Measuring quasiperiodicity".

    Examples
    --------
    >>> import math, rocking
    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> shaking = rocking.pulses.sine(1.3 * 10.0, 5.0, cycles=1)
    >>> exponents = dynamics.lyapunov_exponents(ball, shaking, [0.1, 0.5])
    >>> f"{exponents.largest:.6f} {exponents.smallest:.6f}, ln 0.5 = {math.log(0.5):.6f}"
    '-0.693147 -0.693147, ln 0.5 = -0.693147'
    """
    strobe = stroboscopic_map(body, motion, model=model, chattering=chattering)
    initial_state = checks.numbers(state, "state", OptionError)
    if (shape := initial_state.shape) != (2,):
        raise OptionError(f"{{}} must be one pair (coordinate, velocity), not of shape {shape}", "state")
    strobe._check_starts(initial_state, "state")
    count = checks.integer(period_count, "period_count", OptionError, minimum=_BATCH_COUNT)
    transient_count = checks.integer(transient_periods, "transient_periods", OptionError, minimum=0)
    struct, arguments = strobe._to_structs(initial_state[None])[1][0], strobe._create_derivative_arguments()
    total = transient_count + count
    frame, logs, impacts = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]), np.full((total, 2), np.nan), 0
    for start, stop in pairwise(sorted({*range(0, total, STATES_PER_CALL), transient_count, total})):
        new_impacts = measure_stretches(*arguments, struct, frame, logs[start:stop])
        impacts += new_impacts if start >= transient_count else 0
        if struct["status"] not in (PeriodOutcome.MOVES, PeriodOutcome.RESTS):
            break
    outcome, logs = PeriodOutcome(int(struct["status"])), logs[transient_count:]
    if outcome == PeriodOutcome.RESTS_FOR_EVER:
        logs[np.isnan(logs)] = -np.inf
    rests = np.isneginf(logs[:, 0])
    if strobe._conserves_energy:  # neighbouring states never come to rest, and neither approach nor separate
        logs[rests] = 0.0
    # Weights of a mean over periods that vanish with all derivatives at both ends (Das and others 2016).
    x = (np.arange(count) + 0.5) / count
    bump = np.exp(-1.0 / (x * (1.0 - x)))
    weights: Floats = bump / bump.sum()
    known = ~np.isnan(logs).any(axis=1)
    mean, error = np.full(2, np.nan), float("nan")
    if known.all():  # otherwise the later periods are unknown, despite earlier rests
        mean[:] = [-np.inf if np.isneginf(column).any() else weights @ column for column in logs.T]
    if np.isfinite(logs[:, 0]).all():  # standard error of an unweighted mean, from consecutive parts
        means = [part.mean() for part in np.array_split(logs[:, 0], _BATCH_COUNT)]
        error = float(np.std(means, ddof=1) / np.sqrt(_BATCH_COUNT))
    return LyapunovExponents(
        largest=float(mean[0]),
        smallest=float(mean[1]),
        standard_error=error * float(np.sqrt(count * np.sum(weights**2))),
        forcing_period=strobe.forcing_period,
        period_count=count,
        impacts_per_period=impacts / count,
        share_at_rest=float(np.mean(rests[known])) if known.any() else float("nan"),
        outcome=outcome,
        stretches=logs,
    )
