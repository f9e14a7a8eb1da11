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
from rocking.dynamics.bodies import LinearBody, convert_to_positions
from rocking.dynamics.maps import StroboscopicMap, compute_scale, estimate_mean_acceleration, has_mirror_symmetry
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation.simulate import compute_response

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Largest scaled distance between two states of the same orbit.
MAX_ORBIT_DISTANCE: Final = 1e-7

#: Rounding error of a multiplier near 1 or of the product of two, and of two nearly equal multipliers.
_NEUTRAL_TOLERANCE: Final = 1e-9
_NEUTRAL_PAIR: Final = 1e-6

#: Number of periods after which states of every `_LATER_STRIDE`-th start are further starts, close to attractors.
_LATER_PERIOD_COUNT, _LATER_STRIDE = 60, 8

#: Smallest and largest initial speed relative to the impulse of a period, and largest of a block that may overturn.
_MIN_GAIN, _MAX_GAIN, _MAX_BLOCK_SPEED = 0.5, 20.0, 2.0


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
    impact_count : float
        Number of impacts in one period: an integer, or infinity with complete chattering.
    multipliers : ndarray of complex, shape (2,)
        Floquet multipliers, the largest first (eigenvalues of the derivative of the map over the period). They are
        exactly zero with a proven rest, and one at rest without energy loss, because neighbouring states never rest.
    is_symmetric, has_rest : bool
        Whether the orbit equals its mirror image half a period later, and whether every period contains a rest.

    See Also
    --------
    periodic_orbits : Find the periodic orbits of a body.
    continue_orbit : Follow a periodic orbit as a parameter changes.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, shaking = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(12.0, 5.0, cycles=1)
    >>> orbit = next(orbit for orbit in dynamics.periodic_orbits(ball, shaking) if orbit.is_stable)
    >>> orbit.period, orbit.impact_count, orbit.state.round(6).tolist()
    (1, 1.0, [0.054619, 0.544362])
    """

    TABLES: ClassVar[tuple[str, ...]] = ("states", "impacts", "histories")

    body: Body
    motion: Motion
    model: Model
    chattering: ChatteringScheme
    state: Floats
    period: int
    impact_count: float
    multipliers: NDArray[np.complex128]
    is_symmetric: bool
    has_rest: bool

    @property
    def is_stable(self) -> bool:
        """Whether all multipliers are within the unit circle, by more than rounding error."""
        return bool(np.all(compute_moduli(self.multipliers) < 1.0))

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
        return simulate_periods(self._map, self.state, self.period)

    @cached_property
    def _map(self) -> StroboscopicMap:
        return StroboscopicMap(self.body, self.motion, self.model, self.chattering)

    @property
    def _description(self) -> str:
        grows = np.any(compute_moduli(self.multipliers) > 1.0)
        stable = "stable" if self.is_stable else "unstable" if grows else "neutral"
        if self.has_rest and not self.impact_count:
            events = "always at rest"
        elif math.isinf(self.impact_count):
            events = "with complete chattering"
        else:
            events = f"with {format_count(int(self.impact_count), 'impact')}{' with a rest' if self.has_rest else ''}"
        symmetric = " symmetric" if self.is_symmetric else ""
        return f"{stable}{symmetric} orbit of {format_count(self.period, 'period')} {events}"

    @property
    def _multiplier_text(self) -> str:
        """Format the multipliers with three digits."""
        texts = []
        for multiplier in self.multipliers:
            sign = "-" if multiplier.imag < 0.0 else "+"
            imaginary = f" {sign} {abs(multiplier.imag):.3g}i" if multiplier.imag else ""
            texts.append(f"{multiplier.real:.3g}{imaginary}")
        return ", ".join(texts)

    def _format_headline(self) -> str:
        return f"{self._description}, multipliers {self._multiplier_text}"

    def summary(self) -> str:
        coordinate, (x, v) = self.body.coordinate, self.state
        rows = [
            Row("orbit", self._description),
            Row("body", self.body.description),
            Row("motion", f"{self.motion.label}, one period of {self._map.forcing_period:.6g} s"),
            Row(coordinate.name, f"{x:.12g}", coordinate.unit, " at the start of a period"),
            Row("velocity", f"{v:.12g}", f"{coordinate.unit}/s"),
            Row("multipliers", self._multiplier_text),
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
            "impact_count": to_plain(self.impact_count),
            "complete_chattering": math.isinf(self.impact_count),
            "has_rest": self.has_rest,
            "symmetric": self.is_symmetric,
            "stable": self.is_stable,
            "multipliers": [[float(multiplier.real), float(multiplier.imag)] for multiplier in self.multipliers],
        }

    def _columns(self, table: str) -> list[Column]:
        if table == "impacts":
            return self.response._columns("impacts")
        coordinate = self.body.coordinate
        times = self._map.forcing_period * np.arange(self.period) if table == "states" else self._compute_times()
        states = self.states if table == "states" else self.response.states(times)[:, :2]
        return [
            Column("time", times, "s"),
            Column(coordinate.name, states[:, 0], coordinate.unit),
            Column("velocity", states[:, 1], f"{coordinate.unit}/s"),
        ]

    def _compute_times(self) -> Floats:
        """Compute evenly spaced times for a figure, and times just before and after every impact."""
        even_times = np.linspace(0.0, self.response.duration, 400 * self.period + 1)
        impact_times = self.response.impacts["time"]
        times: Floats = np.unique(np.concatenate([even_times, impact_times, np.nextafter(impact_times, 0.0)]))
        return times

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import draw_orbit

        times, coordinate = self._compute_times(), self.body.coordinate
        states = self.response.states(times)
        return draw_orbit(
            time=times / self._map.forcing_period,
            coordinate=states[:, 0],
            velocity=states[:, 1],
            impact_times=self.response.impacts["time"] / self._map.forcing_period,
            states=self.states,
            labels=(f"{coordinate.name} ({coordinate.unit})", f"velocity ({coordinate.unit}/s)"),
            title=title or escape_dollars(f"{self.body.description}, {self._description}"),
            ax=ax,
            figsize=figsize,
        )


def simulate_periods(strobe: StroboscopicMap, state: Floats, periods: int) -> Response:
    """Simulate a body from a state over a number of periods."""
    motion, duration = strobe.motion, periods * strobe.forcing_period
    # The motion after the end determines how long a chattering sequence lasts.
    starts = strobe.forcing_period * np.arange(periods + 1)
    breakpoints = np.append((starts[:, None] + motion.breakpoints[:-1]).ravel(), strobe.forcing_period * (periods + 1))
    coefficients = np.tile(motion.coefficients, (periods + 1, 1))
    repeated = Motion(breakpoints, coefficients, motion.name, motion.description, error=motion.error)
    start, name = (float(state[0]), float(state[1])), "initial_position"
    response = compute_response(strobe.body, repeated, strobe.model, strobe.chattering, duration, start, name)
    return convert_to_positions(response) if isinstance(strobe.body, LinearBody) else response


def compute_peak(response: Response) -> float:
    """Compute the largest absolute coordinate of a response, from 64 points per impact and the impacts themselves."""
    times = np.linspace(0.0, response.duration, 64 * max(1, len(response.impacts)) + 1)
    all_times = np.concatenate([times, response.impacts["time"]])
    return max(response.peak_rotation, float(np.max(np.abs(response.states(all_times)[:, 0]))))


def create_orbit(strobe: StroboscopicMap, state: Floats, period: int) -> PeriodicOrbit:
    """Create the periodic orbit of a state that recurs after a number of periods."""
    _, derivative = strobe.derivative(state, period)
    symmetric = False
    if period % 2 and has_mirror_symmetry(strobe):  # an orbit may be its own mirror image half a period later
        half_period_state = simulate_periods(strobe, state, period).states(0.5 * period * strobe.forcing_period)[:2]
        symmetric = bool(np.all(np.abs(half_period_state + state) < 1e-9 * np.array(compute_scale(strobe))))
    return PeriodicOrbit(
        strobe.body, strobe.motion, strobe.model, strobe.chattering, state, period,
        count_orbit_impacts(strobe, state, period, derivative), compute_multipliers(strobe, derivative), symmetric,
        not np.any(derivative),
    )  # fmt: skip


def count_orbit_impacts(strobe: StroboscopicMap, state: Floats, period: int, derivative: Floats) -> float:
    """Count the impacts over a number of periods; infinity with complete chattering."""
    impacts = float(strobe.advance(state, period)[2])
    chatters = impacts > 0.0 and strobe.chattering.bracket_width > 0.0 and np.max(strobe.bodies.restitution) > 0.0
    return math.inf if chatters and not np.any(derivative) else impacts


def compute_multipliers(strobe: StroboscopicMap, derivative: Floats) -> NDArray[np.complex128]:
    """Compute the Floquet multipliers of an orbit from the derivative of the map, the largest first.

    If impacts lose no energy, the multipliers at rest are one, because neighbouring states never rest.
    """
    struct = strobe._body_structs[0]
    if strobe._conserves_energy and not np.any(derivative):
        return np.ones(2, dtype=np.complex128)
    if strobe._conserves_energy and not (struct["variable_restitution"] or np.any(struct["damping"])):
        # Otherwise rounding errors of many impacts would make the orbit seem attracting.
        derivative = derivative / np.sqrt(np.abs(np.linalg.det(derivative)))
    multipliers = np.linalg.eigvals(derivative).astype(np.complex128)
    return multipliers[np.lexsort((-multipliers.imag, -np.abs(multipliers)))] + 0.0


def compute_moduli(multipliers: NDArray[np.complex128]) -> Floats:
    """Compute absolute multipliers (pairs along the last axis), exactly 1 within rounding error."""
    sizes = np.abs(multipliers)
    is_pair = np.abs(np.prod(sizes, axis=-1, keepdims=True) - 1.0) < _NEUTRAL_TOLERANCE
    return np.where(np.abs(sizes - 1.0) < np.where(is_pair, _NEUTRAL_PAIR, _NEUTRAL_TOLERANCE), 1.0, sizes)


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
    :cite:t:`thompson2002`, "Nonlinear dynamics and chaos", chapter 15.

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
    period_count = checks.integer(period, "period", OptionError, minimum=1)
    search = _OrbitSearch(StroboscopicMap(body, motion, model, chattering), period_count)
    distinct = np.empty((0, 2))
    for state in search.find_recurrent(search.create_starts(starts), period_count):
        if not len(distinct) or np.min(search.compute_sizes(distinct - state)) > MAX_ORBIT_DISTANCE:
            distinct = np.vstack([distinct, state])
    orbits: list[PeriodicOrbit] = []
    for orbit in map(search.create_least_orbit, distinct):
        shifts = [np.roll(orbit.states, k, axis=0) for k in range(orbit.period)]
        differences = (shift - known.states for known in orbits if known.period == orbit.period for shift in shifts)
        if not any(np.max(search.compute_sizes(difference)) < MAX_ORBIT_DISTANCE for difference in differences):
            orbits.append(orbit)
    return sorted(orbits, key=lambda orbit: (orbit.period, orbit.impact_count, *orbit.state))


class _OrbitSearch:
    """Search for states that recur after a number of periods."""

    def __init__(self, strobe: StroboscopicMap, period_count: int) -> None:
        self.strobe, self.period_count = strobe, period_count
        self.scale = compute_scale(strobe)

    def create_starts(self, requested: ArrayLike | int | None) -> Floats:
        """Return the requested initial states, or create about the requested number."""
        if requested is not None and np.ndim(requested) > 0:
            return self.strobe._check_starts(requested, "starts")
        start_count = 1024 if requested is None else checks.integer(requested, "starts", OptionError, minimum=1)
        strobe, (low, high) = self.strobe, self.strobe.body.stops
        is_two_sided = strobe._is_two_sided
        max_speed = self._estimate_max_speed()
        point_count = max(2, round(math.sqrt(start_count / (2 if is_two_sided else 1))))
        phases = strobe.forcing_period * (np.arange(point_count) + 0.5) / point_count
        speeds = max_speed * ((np.arange(point_count) + 0.5) / point_count) ** 1.5
        impacts = np.stack(np.meshgrid(phases, speeds), axis=-1).reshape(-1, 2)
        if is_two_sided:
            impacts = np.concatenate([impacts, impacts * [1.0, -1.0]])
        fractions = np.linspace(-0.9, 0.9, max(2, point_count // 4))
        width = high - low if strobe._body_structs[0]["two_stops"] else self.scale.coordinate
        coordinates = 0.5 * (low + high) + 0.5 * width * fractions if is_two_sided else low + width * (1.0 + fractions)
        between = np.stack(np.meshgrid(coordinates, max_speed * fractions), axis=-1).reshape(-1, 2)
        rests = np.array([[stop, 0.0] for stop in {low, high}])
        states = np.concatenate([rests, between, strobe.convert_impacts(impacts)])
        states = states[self._are_admissible(states)]
        later = strobe(states[::_LATER_STRIDE], _LATER_PERIOD_COUNT * self.period_count)
        return np.concatenate([states, later[self._are_admissible(later)]])

    def _estimate_max_speed(self) -> float:
        """Estimate the largest impact speed of orbits of this period."""
        strobe = self.strobe
        restitution = float(np.max(strobe.bodies.restitution))
        gain = restitution / max(1.0 - restitution, 1e-300)
        speed_gain = self.period_count * strobe.forcing_period * estimate_mean_acceleration(strobe.motion)
        speed = min(max(gain, _MIN_GAIN), _MAX_GAIN) * speed_gain or self.scale.velocity
        struct = strobe._body_structs[0]
        if not math.isinf(min(strobe.body.balance)):
            return min(speed, _MAX_BLOCK_SPEED * self.scale.velocity + speed_gain)
        if float(struct["stiffness"][0]) == 0.0:  # the flight time of a ball is proportional to its speed
            pull = float(struct["restoring_gain"][0] * struct["threshold"][0])
            return min(speed, 0.5 * self.period_count * strobe.forcing_period * pull + speed_gain)
        return speed

    def _are_admissible(self, states: Floats) -> Flags:
        """Whether each state is admissible."""
        struct, (low, high) = self.strobe._body_structs[0], self.strobe.body.stops
        x, v = states.T
        admissible: Flags = np.all(np.isfinite(states), axis=-1)
        if self.strobe._is_two_sided and not struct["two_stops"]:
            return np.asarray(admissible & (np.abs(x) < struct["overturn_angle"]))
        if struct["two_stops"]:
            admissible &= (x <= high) & ~((x == high) & (v > 0.0))
        return np.asarray(admissible & (x >= low) & ~((x == low) & (v < 0.0)))

    def map_with_derivatives(self, states: Floats, period_count: int) -> Floats:
        """Compute rows of states, their images and derivatives, shape (n, 8); NaN for inadmissible states."""
        rows, admissible = np.full((len(states), 8), np.nan), self._are_admissible(states)
        images, derivatives = self.strobe.derivative(states[admissible], period_count)
        rows[:, :2], rows[admissible, 2:4], rows[admissible, 4:] = states, images, derivatives.reshape(-1, 4)
        return rows

    def compute_residuals(self, rows: Floats) -> tuple[Floats, Flags]:
        """Compute scaled distances between states and their images, and whether they are only rounding errors."""
        residual = self.compute_sizes(rows[:, 2:4] - rows[:, :2])
        tolerance = 1e-11 * np.maximum(1.0, np.max(np.abs(rows[:, 4:]), axis=1))
        # Larger residuals are never accepted, even with a large derivative.
        return residual, residual < np.minimum(tolerance, 1e-6)

    def find_recurrent(self, states: Floats, period_count: int) -> Floats:
        """Find the recurrent states to which Newton's method converges."""
        rows, done = self.map_with_derivatives(states, period_count), np.zeros(len(states), dtype=bool)
        for _ in range(40):
            residual, accurate = self.compute_residuals(rows)
            active = np.flatnonzero(~(done & accurate) & np.isfinite(residual))
            if not len(active):
                break
            done |= accurate  # one more step follows the first that is accurate to rounding
            new, steps, better = rows[active], _compute_newton_steps(rows[active]), np.zeros(len(active), dtype=bool)
            # A step that does not reduce the residual is halved.
            for halving in range(5):
                remaining = np.flatnonzero(~better)
                trials = rows[active[remaining], :2] + 0.5**halving * steps[remaining]
                candidates = self.map_with_derivatives(trials, period_count)
                # A step that is already accurate to rounding need not reduce the residual.
                better[remaining] = reduced = self.compute_residuals(candidates)[0] < residual[active[remaining]]
                new[remaining[reduced]] = candidates[reduced]
            stuck = ~better & ~accurate[active]
            if np.any(stuck):  # The map itself leads to an attractor.
                new[stuck] = self.map_with_derivatives(new[stuck, 2:4], period_count)
            rows[active] = new
        return rows[self.compute_residuals(rows)[1], :2]

    def compute_sizes(self, differences: Floats) -> Floats:
        """Compute the scaled sizes of differences between states."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(np.max(np.abs(differences) / self.scale, axis=-1))

    def create_least_orbit(self, state: Floats) -> PeriodicOrbit:
        """Create the orbit of a state, with its least period."""
        for divisor in range(1, self.period_count):
            if self.period_count % divisor == 0:
                image = self.strobe(state, divisor)
                if self.compute_sizes(image - state) < math.sqrt(MAX_ORBIT_DISTANCE):
                    recurrent = self.find_recurrent(state[None], divisor)
                    if len(recurrent) and self.compute_sizes(recurrent[0] - state) < MAX_ORBIT_DISTANCE:
                        return create_orbit(self.strobe, recurrent[0], divisor)
        return create_orbit(self.strobe, state, self.period_count)


def _compute_newton_steps(rows: Floats) -> Floats:
    """Compute Newton steps towards fixed points, or steps of the map if the equations are singular."""
    jacobian, residual = rows[:, 4:].reshape(-1, 2, 2) - np.eye(2), rows[:, 2:4] - rows[:, :2]
    with np.errstate(all="ignore"):
        (a, b), (c, d) = jacobian.transpose(1, 2, 0)
        r, s = residual.T
        step = np.stack([b * s - d * r, c * r - a * s], axis=-1) / np.linalg.det(jacobian)[:, None]
    return np.where(np.all(np.isfinite(step), axis=1)[:, None], step, residual)
