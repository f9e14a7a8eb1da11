"""Periodic orbits of a body under periodic motion: found from many starts, stable ones and unstable ones alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Flags, Floats
from rocking.block import Block
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.bodies import _LinearBody
from rocking.dynamics.maps import StroboscopicMap, repeated
from rocking.dynamics.simulation import simulate as simulate_between_stops
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.result import DrawnResult, Row, TableResult, dictionary_of, text_of
from rocking.simulation import simulate as simulate_body
from rocking.tables import counted, named
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Starts of a search, where none are given.
_STARTS: Final = 1024

#: Newton steps of a search, how often one that does not bring a state nearer is halved, and periods after which every
#: so many-th start is given once more: it is then near what attracts it.
_NEWTON_STEPS: Final = 40
_HALVINGS: Final = 5
_LATER: Final = 60
_EVERY: Final = 8

#: Residual of an orbit, over the scale of its states and the size of the derivative; and the distance within which two
#: orbits are the same.
_RESIDUAL: Final = 1e-11
_SAME: Final = 1e-7

#: Speeds of starts: least and greatest gain over the impulse of a period, and what a block that overturns has at most.
_LEAST_GAIN: Final = 0.5
_MOST_GAIN: Final = 20.0
_BLOCK_SPEED: Final = 2.0

#: Points of a figure for each period, and letters of the column of names in a summary.
_DRAWN: Final = 400
_WIDTH: Final = 20


class Scale(NamedTuple):
    """Sizes of a coordinate and a velocity by which states are compared."""

    coordinate: float
    velocity: float


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
        by that before. Exactly zero with a proven rest.
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
        """Whether what is near it comes nearer: all multipliers are within the unit circle."""
        return bool(np.all(np.abs(self.multipliers) < 1.0))

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
        words = ["stable" if self.is_stable else "unstable", *(["symmetric"] if self.symmetric else [])]
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
            title=title or f"{self.body.description}, {self._kind}",
            ax=ax,
            figsize=figsize,
        )


def periodic_orbits(
    body: Body,
    motion: Motion,
    *,
    period: int = 1,
    model: Model | None = None,
    chattering: str | Treatment = "certified",
    starts: ArrayLike | int | None = None,
) -> list[PeriodicOrbit]:
    """Periodic orbits of a body under periodic motion, stable and unstable ones.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        What moves.
    motion : Motion
        One period, which repeats for ever: as ``pulses.sine(a, f, cycles=1)``.
    period : int
        Periods of the motion after which orbits repeat. Those of a shorter period that divides it are found as well.
    model : {"nonlinear", "linear"}, optional
        Equation of motion; by default nonlinear of a block.
    chattering : str or treatment
        As for `rocking.simulate`.
    starts : int or array_like, shape (..., 2), optional
        Number of states from which orbits are looked for, or these states; by default about a thousand: impacts at all
        phases and speeds, states between them, rests, and what becomes of some of these.

    Returns
    -------
    list of PeriodicOrbit
        Each once, those with the shortest period first, then those with the fewest impacts. There may be others, which
        no start led to.

    Raises
    ------
    InvalidMotion
        If the motion is none, or has no length.
    InvalidOption
        If the period is no whole number from 1, the model is not one of the body's, or a start is behind a stop.

    Notes
    -----
    Newton's method solves P^n(x) = x for all starts at once, with the derivative of the stroboscopic map P. Where that
    is exactly zero, after a proven rest, a step of it is the map itself.

    References
    ----------
    J. M. T. Thompson and H. B. Stewart, "Nonlinear Dynamics and Chaos", 2nd edition, Wiley (2002), chapter 15.

    Examples
    --------
    A ball on a table that goes up and down with 1.2 g bounces once a period, in two ways, or rests every period:

    >>> from rocking import dynamics, pulses
    >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(12.0, 5.0, cycles=1)
    >>> for orbit in dynamics.periodic_orbits(ball, table):
    ...     print(orbit)
    <PeriodicOrbit: unstable orbit of 1 period with 1 impact, multipliers 2.47, 0.101>
    <PeriodicOrbit: stable orbit of 1 period with 1 impact, multipliers -0.0342 + 0.499i, -0.0342 - 0.499i>
    <PeriodicOrbit: stable orbit of 1 period with complete chattering, multipliers 0, 0>
    """
    count = checks.whole(period, "period", InvalidOption, least=1)
    strobe = StroboscopicMap(body, motion, model, chattering)
    search = _Search(strobe, count)
    found = search.converged(search.starts(starts))
    orbits = [search.orbit(state) for state in search.distinct(found)]
    return search.without_repeats(orbits)


class _Search:
    """Looks for states that come back after some periods."""

    def __init__(self, strobe: StroboscopicMap, count: int) -> None:
        self.strobe, self.count = strobe, count
        self.scale = scale_of(strobe)

    def starts(self, given: ArrayLike | int | None) -> Floats:
        """States to start from: those given, or about as many as are wanted."""
        if given is not None and np.ndim(given) > 0:
            states = checks.numbers(given, "starts", InvalidOption)
            self.strobe._states(states)
            return states.reshape(-1, 2)
        wanted = _STARTS if given is None else checks.whole(given, "starts", InvalidOption, least=1)
        strobe, (low, high) = self.strobe, self.strobe.body.stops
        both = strobe._is_two_sided
        speed = self._fastest()
        side = max(2, round(math.sqrt(wanted / (2 if both else 1))))
        phases = strobe.period * (np.arange(side) + 0.5) / side
        speeds = speed * ((np.arange(side) + 0.5) / side) ** 1.5
        impacts = np.stack(np.meshgrid(phases, speeds), axis=-1).reshape(-1, 2)
        if both:
            impacts = np.concatenate([impacts, impacts * [1.0, -1.0]])
        few = np.linspace(-0.9, 0.9, max(2, side // 4))
        width = high - low if strobe._records[0]["facing"] else self.scale.coordinate
        at = 0.5 * (low + high) + 0.5 * width * few if both else low + width * (1.0 + few)
        between = np.stack(np.meshgrid(at, speed * few), axis=-1).reshape(-1, 2)
        rests = np.array([[stop, 0.0] for stop in {low, high}])
        states = np.concatenate([rests, between, strobe.from_impacts(impacts)])
        states = states[self._possible(states)]
        later = strobe(states[::_EVERY], _LATER * self.count)
        return np.concatenate([states, later[self._possible(later)]])

    def _fastest(self) -> float:
        """Return a speed that impacts of an orbit of so many periods hardly exceed."""
        strobe = self.strobe
        restitution = float(np.max(strobe.bodies.restitution))
        gain = restitution / max(1.0 - restitution, 1e-300)
        push = self.count * strobe.period * _mean_size(strobe.motion)
        speed = min(max(gain, _LEAST_GAIN), _MOST_GAIN) * push
        record = strobe._records[0]
        if not math.isinf(min(strobe.body.balance)):
            return min(speed, _BLOCK_SPEED * self.scale.velocity + push)
        if float(record["stiffness"][0]) == 0.0:  # A ball flies for as long as its speed lets it.
            pull = float(record["gain"][0] * record["threshold"][0])
            return min(speed, 0.5 * self.count * strobe.period * pull + push)
        return speed or self.scale.velocity

    def _possible(self, states: Floats) -> Flags:
        """Which states a body may have."""
        record, (low, high) = self.strobe._records[0], self.strobe.body.stops
        x, v = states.T
        fine: Flags = np.all(np.isfinite(states), axis=-1)
        if self.strobe._is_two_sided and not record["facing"]:
            fine &= np.abs(x) < record["fallen"]
            return fine
        if record["facing"]:
            fine &= (x <= high) & ~((x == high) & (v > 0.0))
        fine &= (x >= low) & ~((x == low) & (v < 0.0))
        return fine

    def _mapped(self, states: Floats, count: int) -> tuple[Floats, Floats]:
        """States after periods and their derivatives; NaN of those that no body may have."""
        after, change = np.full(states.shape, np.nan), np.full((*states.shape, 2), np.nan)
        fine = self._possible(states)
        after[fine], change[fine] = self.strobe.derivative(states[fine], count)
        return after, change

    def converged(self, states: Floats, count: int = 0) -> Floats:
        """States that come back after so many periods, to which Newton's method leads from others."""
        count = count or self.count
        x = states.copy()
        after, change = self._mapped(x, count)
        done = np.zeros(len(x), dtype=bool)
        for _ in range(_NEWTON_STEPS):
            residual = self._size(after - x)
            sharp = residual < _RESIDUAL * np.maximum(1.0, np.max(np.abs(change), axis=(1, 2)))
            finished = done & sharp
            open_ = np.flatnonzero(~finished & np.isfinite(residual))
            if not len(open_):
                break
            done |= sharp  # One more step after the first that is sharp.
            step = _newton_step(x[open_], after[open_], change[open_])
            new, new_after, new_change = x[open_].copy(), after[open_].copy(), change[open_].copy()
            better = np.zeros(len(open_), dtype=bool)
            for halving in range(_HALVINGS):
                left = np.flatnonzero(~better)
                tried = x[open_[left]] + 0.5**halving * step[left]
                tried_after, tried_change = self._mapped(tried, count)
                # A step that is sharp already need not come nearer: it only rounds in another way.
                near = self._size(tried_after - tried) < residual[open_[left]]
                better[left] = near
                chosen = left[near]
                new[chosen], new_after[chosen], new_change[chosen] = tried[near], tried_after[near], tried_change[near]
            stuck = ~better & ~sharp[open_]
            if np.any(stuck):  # The map itself leads to what attracts.
                moved = new_after[stuck]
                new[stuck] = moved
                new_after[stuck], new_change[stuck] = self._mapped(moved, count)
            x[open_], after[open_], change[open_] = new, new_after, new_change
        residual = self._size(after - x)
        good = residual < _RESIDUAL * np.maximum(1.0, np.max(np.abs(change), axis=(1, 2)))
        found: Floats = x[good]
        return found

    def _size(self, differences: Floats) -> Floats:
        with np.errstate(invalid="ignore", over="ignore"):
            found: Floats = np.max(np.abs(differences) / self.scale, axis=-1)
            return found

    def distinct(self, states: Floats) -> Floats:
        """States of which no two are the same."""
        kept = np.empty((0, 2))
        for state in states:
            if not len(kept) or np.min(self._size(kept - state)) > _SAME:
                kept = np.vstack([kept, state])
        return kept

    def orbit(self, state: Floats) -> PeriodicOrbit:
        """Orbit of a state, with its least period."""
        for count in range(1, self.count):
            if self.count % count == 0:
                after = self.strobe(state, count)
                if self._size(after - state) < math.sqrt(_SAME):
                    (*found,) = self.converged(state[None], count)
                    if found and self._size(found[0] - state) < _SAME:
                        return orbit_at(self.strobe, found[0], count)
        return orbit_at(self.strobe, state, self.count)

    def without_repeats(self, orbits: list[PeriodicOrbit]) -> list[PeriodicOrbit]:
        """Orbits of which no two are the same, the shortest first."""
        kept: list[PeriodicOrbit] = []
        for each in orbits:
            shifts = [np.roll(each.states, k, axis=0) for k in range(each.period)]
            same = (other for other in kept if other.period == each.period)
            if not any(np.max(self._size(shift - other.states)) < _SAME for other in same for shift in shifts):
                kept.append(each)
        return sorted(kept, key=lambda each: (each.period, each.impacts, *each.state))


def orbit_at(strobe: StroboscopicMap, state: Floats, period: int) -> PeriodicOrbit:
    """Periodic orbit of a state that comes back after so many periods."""
    _, change = strobe.derivative(state, period)
    _, _, impacts = strobe.followed(state, period)
    rests = not np.any(change)
    complete = rests and bool(impacts) and strobe.treatment.bracket > 0.0 and float(np.max(strobe.bodies.restitution))
    return PeriodicOrbit(
        strobe.body, strobe.motion, strobe.model, strobe.treatment, state, period,
        math.inf if complete else float(impacts), multipliers_of(change), is_symmetric(strobe, state, period), rests,
    )  # fmt: skip


def multipliers_of(change: Floats) -> NDArray[np.complex128]:
    """Floquet multipliers of a derivative, the largest first."""
    found = np.linalg.eigvals(change).astype(np.complex128)
    return found[np.lexsort((-found.imag, -np.abs(found)))] + 0.0


class HalfMap(StroboscopicMap):
    """Map of a mirrored body under an antisymmetric motion to the mirror image of its state half a period later.

    Its square is the stroboscopic map.
    """

    def __init__(self, strobe: StroboscopicMap) -> None:
        super().__init__(strobe.body, strobe.motion, strobe.model, strobe.treatment)
        first = _first_half(strobe.motion)
        self.period *= 0.5
        self._ground = repeated(first, self.body.gravity, -1.0)

    def mirrored(self, state: Floats, halves: int) -> tuple[Floats, Floats]:
        """Mirror image of a state after an odd number of half periods, and its derivative."""
        total, at = np.eye(2), state
        for _ in range(halves):
            after, change = self.derivative(at)
            at, total = 0.0 - after, -change @ total
        return at, total


def is_mirrored(strobe: StroboscopicMap) -> bool:
    """Whether the mirror image of every course of a body is one half a period later."""
    record, (low, high) = strobe._records[0], strobe.body.stops
    if not strobe._is_two_sided or low != -high:
        return False
    same = all(
        record[name][0] == record[name][1] for name in ("stiffness", "gain", "threshold", "restitution", "slenderness")
    )
    return same and _is_antisymmetric(strobe.motion)


def is_symmetric(strobe: StroboscopicMap, state: Floats, period: int) -> bool:
    """Whether an orbit is its own mirror image half a period of it later."""
    if period % 2 == 0 or not is_mirrored(strobe):
        return False
    after = response_of(strobe, state, period).states(0.5 * period * strobe.period)[:2]
    tolerance = 1e-9 * np.array(scale_of(strobe))
    return bool(np.all(np.abs(after + state) < tolerance))


def response_of(strobe: StroboscopicMap, state: Floats, periods: int) -> Response:
    """Course of a body from a state on, over so many periods."""
    motion, duration = strobe.motion, periods * strobe.period
    # One period more: what comes after the end decides how long a chattering sequence lasts.
    starts = strobe.period * np.arange(periods + 1)
    breakpoints = np.append((starts[:, None] + motion.breakpoints[:-1]).ravel(), strobe.period * (periods + 1))
    many = Motion(
        breakpoints, np.tile(motion.coefficients, (periods + 1, 1)), motion.name, motion.description, error=motion.error
    )
    x, v = float(state[0]), float(state[1])
    if isinstance(strobe.body, _LinearBody):
        return simulate_between_stops(
            strobe.body, many, chattering=strobe.treatment, duration=duration, initial_position=x, initial_velocity=v
        )
    return simulate_body(
        strobe.body, many, model=strobe.model, chattering=strobe.treatment, duration=duration,
        initial_rotation=x, initial_velocity=v,
    )  # fmt: skip


def scale_of(strobe: StroboscopicMap) -> Scale:
    """Sizes of coordinate and velocity that are natural to a body under a motion."""
    record, period = strobe._records[0], strobe.period
    if isinstance(strobe.body, Block):
        alpha = float(np.max(record["slenderness"]))
        return Scale(alpha, alpha * math.sqrt(float(np.max(record["stiffness"]))))
    pull = float(np.max(np.abs(record["gain"] * record["threshold"])[: 2 if record["facing"] else 1]))
    speed = period * max(_mean_size(strobe.motion), pull, 1e-300)
    rate = math.sqrt(abs(float(record["stiffness"][0])))
    if record["facing"]:
        width = float(record["fallen"])
        return Scale(width, max(width * rate, width / period))
    return Scale(speed / max(rate, 1.0 / period), speed)


def _newton_step(x: Floats, after: Floats, change: Floats) -> Floats:
    """Newton's steps towards fixed points; where that is none, a step of the map."""
    jacobian, residual = change - np.eye(2), after - x
    with np.errstate(all="ignore"):
        determinant = np.linalg.det(jacobian)
        a, b, c, d = (jacobian[:, i, j] for i in (0, 1) for j in (0, 1))
        r, s = residual.T
        step: Floats = np.stack([b * s - d * r, c * r - a * s], axis=-1) / determinant[:, None]
    plain = ~np.all(np.isfinite(step), axis=1)
    step[plain] = residual[plain]
    return step


def _mean_size(motion: Motion) -> float:
    """Mean size of an acceleration, roughly."""
    times = np.linspace(motion.breakpoints[0], motion.breakpoints[-1], 257)
    return float(np.mean(np.abs(motion.acceleration(times))))


def _first_half(motion: Motion) -> Motion:
    middle = int(np.argmin(np.abs(motion.breakpoints - 0.5 * motion.duration)))
    return Motion(motion.breakpoints[: middle + 1], motion.coefficients[:middle], error=motion.error)


def _is_antisymmetric(motion: Motion) -> bool:
    """Whether the second half of a motion is the first one with the opposite sign, to rounding."""
    half = 0.5 * motion.duration
    if np.min(np.abs(motion.breakpoints - half)) > 1e-14 * motion.duration:
        return False
    times = half * (np.arange(200) + 0.5) / 200.0
    sums = motion.acceleration(times) + motion.acceleration(times + half)
    return bool(np.max(np.abs(sums)) <= 1e-12 * motion.pga)


def _number(value: complex) -> str:
    """Return a multiplier as text, to three digits."""
    if value.imag == 0.0:
        return f"{value.real:.3g}"
    return f"{value.real:.3g} {'-' if value.imag < 0.0 else '+'} {abs(value.imag):.3g}i"
