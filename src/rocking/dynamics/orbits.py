"""Find periodic orbits of a body under periodic motion by Newton's method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import Model
from rocking.core.result import Result, Row, format_rows
from rocking.core.tables import Column, add_unit, escape_dollars, format_count, to_plain
from rocking.dynamics.bodies import LinearBody, in_positions
from rocking.dynamics.maps import StroboscopicMap, is_mirrored, mean_size, scale_of
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation.simulate import compute_response

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Largest scaled distance between two states of the same orbit.
SAME: Final = 1e-7

#: Rounding error of a multiplier near 1 or of the product of two, and of two possibly equal ones (its square root).
_NEUTRAL: Final = 1e-9
_NEUTRAL_PAIR: Final = 1e-6

#: Number of periods after which every `_EVERY`-th start is added again, now close to an attractor.
_LATER, _EVERY = 60, 8

#: Start speeds: smallest and largest gain relative to the impulse of a period, and largest speed of an overturning
#: block.
_LEAST_GAIN, _MOST_GAIN, _BLOCK_SPEED = 0.5, 20.0, 2.0


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit(Result):
    """Periodic orbit of a body under periodic motion, created by `periodic_orbits`.

    Attributes
    ----------
    body, motion, model, chattering
        Body, one period of the motion, model, and chattering scheme.
    state : ndarray, shape (2,)
        Coordinate and velocity at the start of a period of the motion.
    period : int
        Least period of the orbit, in periods of the motion.
    impacts : float
        Number of impacts in one period: an integer, or infinity with complete chattering.
    multipliers : ndarray of complex, shape (2,)
        Floquet multipliers, the largest first (eigenvalues of the derivative of the map over the period). They are
        exactly zero with a proven rest, and one at rest without energy loss, because neighbouring states never rest.
    symmetric, rests : bool
        Whether the orbit equals its mirror image half a period later, and whether every period contains a rest.

    See Also
    --------
    periodic_orbits : Find the periodic orbits of a body.
    continue_orbit : Follow a periodic orbit as a parameter changes.
    """

    TABLES: ClassVar[tuple[str, ...]] = ("states", "impacts", "histories")

    body: Body
    motion: Motion
    model: Model
    chattering: ChatteringScheme
    state: Floats
    period: int
    impacts: float
    multipliers: NDArray[np.complex128]
    symmetric: bool
    rests: bool

    @property
    def is_stable(self) -> bool:
        """Whether all multipliers are within the unit circle, by more than rounding error."""
        return bool(np.all(sizes_of(self.multipliers) < 1.0))

    @property
    def duration(self) -> float:
        """Period of the orbit, s."""
        return self.period * self._map.forcing_period

    @cached_property
    def states(self) -> Floats:
        """States at the starts of the periods of the motion, shape (period, 2)."""
        return self._map.orbit(self.state, self.period)[:-1]

    @cached_property
    def response(self) -> Response:
        """Return the simulation of one period of the orbit, with its impacts and rests."""
        return response_of(self._map, self.state, self.period)

    @cached_property
    def _map(self) -> StroboscopicMap:
        return StroboscopicMap(self.body, self.motion, self.model, self.chattering)

    @property
    def _kind(self) -> str:
        grows = np.any(sizes_of(self.multipliers) > 1.0)
        stable = "stable" if self.is_stable else "unstable" if grows else "neutral"
        if self.rests and not self.impacts:
            how = "always at rest"
        elif math.isinf(self.impacts):
            how = "with complete chattering"
        else:
            how = f"with {format_count(int(self.impacts), 'impact')}{' with a rest' if self.rests else ''}"
        return f"{stable}{' symmetric' if self.symmetric else ''} orbit of {format_count(self.period, 'period')} {how}"

    @property
    def _multipliers(self) -> str:
        """Format the multipliers with three digits."""
        signs = ("-" if each.imag < 0.0 else "+" for each in self.multipliers)
        return ", ".join(
            f"{each.real:.3g}" + (f" {sign} {abs(each.imag):.3g}i" if each.imag else "")
            for each, sign in zip(self.multipliers, signs, strict=True)
        )

    def _headline(self) -> str:
        return f"{self._kind}, multipliers {self._multipliers}"

    def summary(self) -> str:
        coordinate, (x, v) = self.body.coordinate, self.state
        rows = [
            Row("orbit", self._kind),
            Row("body", self.body.description),
            Row("motion", f"{self.motion.label}, one period of {self._map.forcing_period:.6g} s"),
            Row(coordinate.name, f"{x:.12g}", coordinate.unit, " at the start of a period"),
            Row("velocity", f"{v:.12g}", f"{coordinate.unit}/s"),
            Row("multipliers", self._multipliers),
        ]
        return format_rows(rows, 20)

    def to_dict(self) -> dict[str, Any]:
        coordinate = self.body.coordinate
        x, v = map(float, self.state)
        return {
            "body": self.body.description,
            "motion": self.motion.label,
            "model": self.model,
            "period": self.period,
            "duration_s": self.duration,
            add_unit(coordinate.name, coordinate.unit): x,
            add_unit("velocity", f"{coordinate.unit}/s"): v,
            "impacts": to_plain(self.impacts),
            "complete_chattering": math.isinf(self.impacts),
            "rests": self.rests,
            "symmetric": self.symmetric,
            "stable": self.is_stable,
            "multipliers": [[float(each.real), float(each.imag)] for each in self.multipliers],
        }

    def _columns(self, table: str) -> list[Column]:
        if table == "impacts":
            return self.response._columns("impacts")
        coordinate = self.body.coordinate
        times = self._map.forcing_period * np.arange(self.period) if table == "states" else self._times()
        states = self.states if table == "states" else self.response.states(times)[:, :2]
        return [
            Column("time", times, "s"),
            Column(coordinate.name, states[:, 0], coordinate.unit),
            Column("velocity", states[:, 1], f"{coordinate.unit}/s"),
        ]

    def _times(self) -> Floats:
        """Return evenly spaced times for a figure, with the last before and the first after every impact."""
        even = np.linspace(0.0, self.response.duration, 400 * self.period + 1)
        at = self.response.impacts["time"]
        found: Floats = np.unique(np.concatenate([even, at, np.nextafter(at, 0.0)]))
        return found

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import orbit_figure

        times, coordinate = self._times(), self.body.coordinate
        states = self.response.states(times)
        return orbit_figure(
            time=times / self._map.forcing_period,
            coordinate=states[:, 0],
            velocity=states[:, 1],
            impact_times=self.response.impacts["time"] / self._map.forcing_period,
            states=self.states,
            labels=(f"{coordinate.name} ({coordinate.unit})", f"velocity ({coordinate.unit}/s)"),
            title=title or escape_dollars(f"{self.body.description}, {self._kind}"),
            ax=ax,
            figsize=figsize,
        )


def response_of(strobe: StroboscopicMap, state: Floats, periods: int) -> Response:
    """Simulate a body from a state over a number of periods."""
    motion, duration = strobe.motion, periods * strobe.forcing_period
    # The motion after the end determines how long a chattering sequence lasts.
    starts = strobe.forcing_period * np.arange(periods + 1)
    breakpoints = np.append((starts[:, None] + motion.breakpoints[:-1]).ravel(), strobe.forcing_period * (periods + 1))
    many = Motion(
        breakpoints, np.tile(motion.coefficients, (periods + 1, 1)), motion.name, motion.description, error=motion.error
    )
    start = float(state[0]), float(state[1])
    found = compute_response(strobe.body, many, strobe.model, strobe.chattering, duration, start, "initial_position")
    return in_positions(found) if isinstance(strobe.body, LinearBody) else found


def peak_of(response: Response) -> float:
    """Compute the largest absolute coordinate of a response, from 64 points per impact and the impacts themselves."""
    times = np.linspace(0.0, response.duration, 64 * max(1, len(response.impacts)) + 1)
    at = np.concatenate([times, response.impacts["time"]])
    return max(response.peak_rotation, float(np.max(np.abs(response.states(at)[:, 0]))))


def orbit_at(strobe: StroboscopicMap, state: Floats, period: int) -> PeriodicOrbit:
    """Create the periodic orbit of a state that recurs after a number of periods."""
    _, change = strobe.derivative(state, period)
    symmetric = False
    if period % 2 and is_mirrored(strobe):  # its own mirror image half a period later
        after = response_of(strobe, state, period).states(0.5 * period * strobe.forcing_period)[:2]
        symmetric = bool(np.all(np.abs(after + state) < 1e-9 * np.array(scale_of(strobe))))
    return PeriodicOrbit(
        strobe.body, strobe.motion, strobe.model, strobe.chattering, state, period,
        impacts_of(strobe, state, period, change), multipliers_at(strobe, change), symmetric, not np.any(change),
    )  # fmt: skip


def impacts_of(strobe: StroboscopicMap, state: Floats, period: int, change: Floats) -> float:
    """Count the impacts over a number of periods; infinity with complete chattering."""
    impacts = float(strobe.advance(state, period)[2])
    chatters = impacts > 0.0 and strobe.chattering.bracket > 0.0 and np.max(strobe.bodies.restitution) > 0.0
    return math.inf if chatters and not np.any(change) else impacts


def multipliers_at(strobe: StroboscopicMap, change: Floats) -> NDArray[np.complex128]:
    """Compute the Floquet multipliers of an orbit from the derivative of the map, the largest first.

    If impacts lose no energy, the multipliers at rest are one, because neighbouring states bounce for ever.
    """
    record = strobe._records[0]
    if strobe._loses_nothing and not np.any(change):
        return np.ones(2, dtype=np.complex128)
    if strobe._loses_nothing and not (record["variable_restitution"] or np.any(record["damping"])):
        # Otherwise rounding errors of many impacts suggest that the orbit attracts.
        change = change / np.sqrt(np.abs(np.linalg.det(change)))
    found = np.linalg.eigvals(change).astype(np.complex128)
    return found[np.lexsort((-found.imag, -np.abs(found)))] + 0.0


def sizes_of(multipliers: NDArray[np.complex128]) -> Floats:
    """Compute absolute multipliers (pairs along the last axis), exactly 1 within rounding error."""
    sizes = np.abs(multipliers)
    is_pair = np.abs(np.prod(sizes, axis=-1, keepdims=True) - 1.0) < _NEUTRAL
    return np.where(np.abs(sizes - 1.0) < np.where(is_pair, _NEUTRAL_PAIR, _NEUTRAL), 1.0, sizes)


def periodic_orbits(
    body: Body,
    motion: Motion,
    *,
    period: int = 1,
    model: Model | None = None,
    chattering: str | ChatteringScheme = "certified",
    starts: ArrayLike | int | None = None,
) -> list[PeriodicOrbit]:
    """Find stable and unstable periodic orbits of a body under periodic motion.

    Parameters
    ----------
    body, motion : Body, Motion
        As in `stroboscopic_map`.
    period : int
        Number of periods of the motion after which orbits repeat. Orbits of a shorter period that divides it are
        included.
    model, chattering : str, optional
        As in `stroboscopic_map`.
    starts : int or array_like, shape (..., 2), optional
        Number of initial states, or the states themselves. By default about a thousand: impacts at all phases and
        speeds, states between impacts, rests, and later states of some of these.

    Returns
    -------
    list of PeriodicOrbit
        Distinct orbits by period, then by number of impacts. Orbits that no initial state leads to are missing.

    See Also
    --------
    continue_orbit : Follow a periodic orbit as a parameter changes.
    basins : Compute the basins of attraction.

    Notes
    -----
    Newton's method solves P^n(x) = x for all initial states at once, with the derivative of the stroboscopic map P.
    After a proven rest this derivative is exactly zero, and the step is the map itself.

    References
    ----------
    J. M. T. Thompson and H. B. Stewart, "Nonlinear Dynamics and Chaos", 2nd edition, Wiley (2002), chapter 15.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(12.0, 5.0, cycles=1)
    >>> for orbit in dynamics.periodic_orbits(ball, table):
    ...     print(orbit)
    <PeriodicOrbit: unstable orbit of 1 period with 1 impact, multipliers 2.47, 0.101>
    <PeriodicOrbit: stable orbit of 1 period with 1 impact, multipliers -0.0342 + 0.499i, -0.0342 - 0.499i>
    <PeriodicOrbit: stable orbit of 1 period with complete chattering, multipliers 0, 0>
    """
    count = checks.integer(period, "period", InvalidOption, minimum=1)
    search = _Search(StroboscopicMap(body, motion, model, chattering), count)
    distinct = np.empty((0, 2))
    for state in search.converged(search.starts(starts), count):
        if not len(distinct) or np.min(search.size(distinct - state)) > SAME:
            distinct = np.vstack([distinct, state])
    kept: list[PeriodicOrbit] = []
    for each in map(search.orbit, distinct):
        shifts = [np.roll(each.states, k, axis=0) for k in range(each.period)]
        same = (other for other in kept if other.period == each.period)
        if not any(np.max(search.size(shift - other.states)) < SAME for other in same for shift in shifts):
            kept.append(each)
    return sorted(kept, key=lambda each: (each.period, each.impacts, *each.state))


class _Search:
    """Search for states that recur after a number of periods."""

    def __init__(self, strobe: StroboscopicMap, count: int) -> None:
        self.strobe, self.count = strobe, count
        self.scale = scale_of(strobe)

    def starts(self, given: ArrayLike | int | None) -> Floats:
        """Return the given initial states, or about as many as requested."""
        if given is not None and np.ndim(given) > 0:
            return self.strobe.checked_starts(given, "starts")
        wanted = 1024 if given is None else checks.integer(given, "starts", InvalidOption, minimum=1)
        strobe, (low, high) = self.strobe, self.strobe.body.stops
        both = strobe._is_two_sided
        speed = self._fastest()
        side = max(2, round(math.sqrt(wanted / (2 if both else 1))))
        phases = strobe.forcing_period * (np.arange(side) + 0.5) / side
        speeds = speed * ((np.arange(side) + 0.5) / side) ** 1.5
        impacts = np.stack(np.meshgrid(phases, speeds), axis=-1).reshape(-1, 2)
        if both:
            impacts = np.concatenate([impacts, impacts * [1.0, -1.0]])
        few = np.linspace(-0.9, 0.9, max(2, side // 4))
        width = high - low if strobe._records[0]["two_stops"] else self.scale.coordinate
        at = 0.5 * (low + high) + 0.5 * width * few if both else low + width * (1.0 + few)
        between = np.stack(np.meshgrid(at, speed * few), axis=-1).reshape(-1, 2)
        rests = np.array([[stop, 0.0] for stop in {low, high}])
        states = np.concatenate([rests, between, strobe.from_impacts(impacts)])
        states = states[self._possible(states)]
        later = strobe(states[::_EVERY], _LATER * self.count)
        return np.concatenate([states, later[self._possible(later)]])

    def _fastest(self) -> float:
        """Return a speed that impacts of an orbit of this period hardly exceed."""
        strobe = self.strobe
        restitution = float(np.max(strobe.bodies.restitution))
        gain = restitution / max(1.0 - restitution, 1e-300)
        push = self.count * strobe.forcing_period * mean_size(strobe.motion)
        speed = min(max(gain, _LEAST_GAIN), _MOST_GAIN) * push or self.scale.velocity
        record = strobe._records[0]
        if not math.isinf(min(strobe.body.balance)):
            return min(speed, _BLOCK_SPEED * self.scale.velocity + push)
        if float(record["stiffness"][0]) == 0.0:  # The flight time of a ball is proportional to its speed.
            pull = float(record["threshold_slope"][0] * record["threshold"][0])
            return min(speed, 0.5 * self.count * strobe.forcing_period * pull + push)
        return speed

    def _possible(self, states: Floats) -> Flags:
        """Whether each state is admissible."""
        record, (low, high) = self.strobe._records[0], self.strobe.body.stops
        x, v = states.T
        fine: Flags = np.all(np.isfinite(states), axis=-1)
        if self.strobe._is_two_sided and not record["two_stops"]:
            return np.asarray(fine & (np.abs(x) < record["overturn_angle"]))
        if record["two_stops"]:
            fine &= (x <= high) & ~((x == high) & (v > 0.0))
        return np.asarray(fine & (x >= low) & ~((x == low) & (v < 0.0)))

    def mapped(self, states: Floats, count: int) -> Floats:
        """Return rows of states, mapped states and derivatives, shape (n, 8); NaN for inadmissible states."""
        rows, fine = np.full((len(states), 8), np.nan), self._possible(states)
        after, change = self.strobe.derivative(states[fine], count)
        rows[:, :2], rows[fine, 2:4], rows[fine, 4:] = states, after, change.reshape(-1, 4)
        return rows

    def residuals(self, rows: Floats) -> tuple[Floats, Flags]:
        """Return scaled distances between states and mapped states, and whether they are only rounding errors."""
        size = self.size(rows[:, 2:4] - rows[:, :2])
        allowed = 1e-11 * np.maximum(1.0, np.max(np.abs(rows[:, 4:]), axis=1))
        # Larger residuals are not accepted as orbits, however large the derivative.
        return size, size < np.minimum(allowed, 1e-6)

    def converged(self, states: Floats, count: int) -> Floats:
        """Return the recurrent states to which Newton's method converges."""
        rows, done = self.mapped(states, count), np.zeros(len(states), dtype=bool)
        for _ in range(40):
            residual, sharp = self.residuals(rows)
            open_ = np.flatnonzero(~(done & sharp) & np.isfinite(residual))
            if not len(open_):
                break
            done |= sharp  # One more step after the first that is accurate to rounding.
            new, step, better = rows[open_], _newton_step(rows[open_]), np.zeros(len(open_), dtype=bool)
            # A step that does not reduce the residual is halved.
            for halving in range(5):
                left = np.flatnonzero(~better)
                tried = self.mapped(rows[open_[left], :2] + 0.5**halving * step[left], count)
                # A step that is already accurate to rounding need not reduce the residual.
                better[left] = near = self.residuals(tried)[0] < residual[open_[left]]
                new[left[near]] = tried[near]
            stuck = ~better & ~sharp[open_]
            if np.any(stuck):  # The map itself leads to an attractor.
                new[stuck] = self.mapped(new[stuck, 2:4], count)
            rows[open_] = new
        return rows[self.residuals(rows)[1], :2]

    def size(self, differences: Floats) -> Floats:
        """Compute the scaled sizes of differences between states."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(np.max(np.abs(differences) / self.scale, axis=-1))

    def orbit(self, state: Floats) -> PeriodicOrbit:
        """Create the orbit of a state, with its least period."""
        for count in range(1, self.count):
            if self.count % count == 0:
                after = self.strobe(state, count)
                if self.size(after - state) < math.sqrt(SAME):
                    found = self.converged(state[None], count)
                    if len(found) and self.size(found[0] - state) < SAME:
                        return orbit_at(self.strobe, found[0], count)
        return orbit_at(self.strobe, state, self.count)


def _newton_step(rows: Floats) -> Floats:
    """Compute Newton steps towards fixed points, or steps of the map where Newton's step does not exist."""
    jacobian, residual = rows[:, 4:].reshape(-1, 2, 2) - np.eye(2), rows[:, 2:4] - rows[:, :2]
    with np.errstate(all="ignore"):
        (a, b), (c, d) = jacobian.transpose(1, 2, 0)
        r, s = residual.T
        step = np.stack([b * s - d * r, c * r - a * s], axis=-1) / np.linalg.det(jacobian)[:, None]
    return np.where(np.all(np.isfinite(step), axis=1)[:, None], step, residual)
