"""Stroboscopic map of a body under periodic motion, with its derivative."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block.body import Body
from rocking.block.sides import format_sides
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers, split_range
from rocking.core.constants import MODELS, Model
from rocking.core.threads import map_in_threads
from rocking.dynamics.bodies import LinearBody
from rocking.engine.problem import MAX_SPEED, require_body, set_start
from rocking.engine.schemes import ChatteringScheme, chattering_scheme
from rocking.engine.tasks import Setup
from rocking.errors import InvalidBlock, InvalidMotion, InvalidOption
from rocking.kernels import state
from rocking.kernels.ground import Ground, build_ground
from rocking.kernels.periodic import TRAP, PeriodicProblem, build_step_rows, differentiate, iterate
from rocking.kernels.periodic import PeriodOutcome as PeriodOutcome
from rocking.kernels.trace import NO_NODES, Trail
from rocking.motion.motion import Motion
from rocking.records.named import check_motion

#: Ground acceleration, g, that lifts any body; it follows the second period.
_BEYOND_ALL: Final = 1e12

#: States per call of a kernel, few for quick interrupts.
TOGETHER: Final = 256

#: Share that equals one within rounding error.
_ALMOST: Final = 1.0 - 2.0**-40


class PeriodicForcing:
    """Body under periodic motion, in the form that kernels accept."""

    def __init__(self, body: Body, motion: Motion, model: Model | None, chattering: str | ChatteringScheme) -> None:
        given = check_motion(motion)
        if given is None:
            raise InvalidMotion("one period of the motion is needed, as rocking.pulses.sine(a, f, cycles=1), not None")
        if given.vertical is not None:
            raise InvalidMotion("maps are made for one component; give a motion without a vertical one")
        self.body, self.motion = require_body(body), given
        self.bodies = self.body.alone()
        self.model: Model = "linear" if isinstance(self.body, LinearBody) else "nonlinear"
        if model is not None:
            checks.choice(model, "model", InvalidOption, MODELS)
            self.model = model
        self.chattering = chattering_scheme(chattering)
        self.forcing_period = float(self.motion.breakpoints[-1] - self.motion.breakpoints[0])
        if not np.max(np.abs(self.motion.coefficients[:, 0])) < _BEYOND_ALL * self.body.gravity:
            raise InvalidMotion(f"the motion is beyond all sense; maps take accelerations below {_BEYOND_ALL:g} g")
        self._ground = repeated(self.motion, self.body.gravity)
        run = Setup(self.bodies, self.model, self.chattering, self.forcing_period).prepare(
            self.motion, ground=self._ground
        )
        self._records, self._settings = run.records, run.settings
        self._settings["stop"], self._settings["no_end_time"] = np.inf, True
        if np.any(self._records["yielding"]):
            raise InvalidBlock("a tendon that yields remembers; maps know what position and velocity tell")
        if np.any(self._records["variable_restitution"] & (self._records["seed"] >= 0)):
            raise InvalidOption(
                "a map takes a state to the same one each time, but this body draws its restitution at each impact: "
                "give it a number, or one that falls with the speed"
            )
        rows = build_step_rows(self._ground, self._records[0])
        self._steps = rows if self.model == "linear" else rows[:, :0]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {described(self.body)} under {described(self.motion)}; {self.model} model>"

    def _rules(self, *, record: bool) -> state.Record:
        settings = self._settings.copy()
        settings["record"] = record
        return settings

    def _setting(self) -> PeriodicProblem:
        return PeriodicProblem(
            self._ground, self._records[0], self._rules(record=False), state.new_table(0), self._steps
        )

    def _marching(self) -> tuple[Trail, state.Record, state.Record, state.Records]:
        """Return the arguments of the derivative kernels besides the states: the problem and workspace."""
        trail = Trail(self._ground, self._records[0], self._rules(record=True), NO_NODES)
        return trail, state.new_scratch(), state.new_record(state.VARIATION), state.new_table(512)

    def checked_starts(self, given: ArrayLike, name: str) -> Floats:
        """Return initial states, shape (n, 2): finite numbers, in front of the stops."""
        states = checks.numbers(given, name, InvalidOption)
        self._states(states, name)
        sensible(states, name)
        return states.reshape(-1, 2)

    def _states(self, states: ArrayLike, name: str = "states", velocities: str = "") -> tuple[Floats, state.Records]:
        """Return states, flattened and as records; errors call them, or their positions, ``name``."""
        given = self._pairs(states, name, self.body.coordinate.name)
        flat = given.reshape(-1, 2)
        (at, speed), record, (low, high) = flat.T, self._records[0], self.body.stops
        if record["next_side"][0] == 0:  # a stop: there is no ground on its other side
            into = (at == low) & (speed < 0.0) | (bool(record["two_stops"]) & (at == high) & (speed > 0.0))
            if np.any(into):
                x, v = float(at[into][0]), float(speed[into][0])
                raise InvalidOption(
                    f"{{}} must not lead into a stop, as {v:g} m/s at {x:g} m does; change its sign, or begin in front "
                    "of the stop", velocities or name, value=v,
                )  # fmt: skip
        made = state.new_states(len(flat), 0)
        set_start(made, self._records, self.bodies, at, speed, name)
        made["peak"] = self._no_peak
        return given, made

    @property
    def _no_peak(self) -> float:
        """Initial peak that disables the search for peaks: the rotation of a fallen body, less rounding error."""
        fallen = float(self._records["overturn_angle"][0])
        return fallen if np.isinf(fallen) else fallen * _ALMOST

    def _pairs(self, values: ArrayLike, name: str, first: str) -> Floats:
        """Return pairs of numbers, shape (..., 2)."""
        given = checks.numbers(values, name, InvalidOption)
        if given.ndim == 0 or given.shape[-1] != 2:
            raise InvalidOption(
                f"{{}} must hold pairs ({first}, velocity) along the last axis, not have the shape {given.shape}", name
            )
        return given

    def _coordinates(self, u: Floats, v: Floats, side: Integers) -> Floats:
        """Convert states in the frames of their sides to coordinates and velocities."""
        at = np.where(side < 0, -1 - side, side)
        sign = 1.0 - 2.0 * at
        stops = np.array(self.body.stops)[at]
        found = np.stack([stops + sign * u, sign * v], axis=-1)
        found[side < 0] = np.stack([stops, np.zeros_like(stops)], axis=-1)[side < 0]
        return found + 0.0

    def _known(self, made: state.Records) -> Floats:
        """Return coordinates and velocities of states, NaN where they are unknown."""
        found = self._coordinates(made["u"], made["v"], made["side"])
        found[np.isin(made["ending"], (PeriodOutcome.OVERTURNED, PeriodOutcome.UNFINISHED))] = np.nan
        return found

    @property
    def _is_two_sided(self) -> bool:
        """Whether the coordinate changes its sign, or there is a second stop."""
        record = self._records[0]
        return bool(record["two_stops"] or record["next_side"][0] == 1)

    @property
    def _loses_nothing(self) -> bool:
        """Whether two successive impacts lose no speed, so that nothing near a rest comes to rest."""
        return bool(np.prod(self._records[0]["restitution"]) >= 1.0)


class Scale(NamedTuple):
    """Scales of coordinate and velocity for the comparison of states."""

    coordinate: float
    velocity: float


def scale_of(strobe: PeriodicForcing) -> Scale:
    """Compute the natural scales of coordinate and velocity of a body under a motion."""
    record, period = strobe._records[0], strobe.forcing_period
    if not isinstance(strobe.body, LinearBody):
        alpha = float(np.max(record["slenderness"]))
        return Scale(alpha, alpha * math.sqrt(float(np.max(np.abs(record["stiffness"])))))
    pull = float(np.max(np.abs(record["threshold_slope"] * record["threshold"])[: 2 if record["two_stops"] else 1]))
    speed = period * max(mean_size(strobe.motion), pull, 1e-300)
    rate = math.sqrt(abs(float(record["stiffness"][0])))
    if record["two_stops"]:
        width = float(record["overturn_angle"])
        return Scale(width, max(width * rate, width / period))
    return Scale(speed / max(rate, 1.0 / period), speed)


def mean_size(motion: Motion) -> float:
    """Estimate the mean absolute acceleration."""
    times = np.linspace(motion.breakpoints[0], motion.breakpoints[-1], 257)
    return float(np.mean(np.abs(motion.acceleration(times))))


def repeated(motion: Motion, gravity: float, sign: float = 1.0) -> Ground:
    """Create the ground of two periods of a motion, followed by an acceleration that lifts any body."""
    breaks = motion.breakpoints - motion.breakpoints[0]
    period, columns = breaks[-1], motion.coefficients.shape[1]
    beyond = np.zeros((2, columns))
    beyond[:, 0] = _BEYOND_ALL * gravity, -_BEYOND_ALL * gravity
    breakpoints = np.concatenate([breaks, period + breaks[1:], [3.0 * period, 4.0 * period]])
    coefficients = np.concatenate([motion.coefficients, sign * motion.coefficients, beyond])
    breakpoints.flags.writeable = coefficients.flags.writeable = False  # as in a motion: kernels are compiled for these
    return build_ground(breakpoints, coefficients, 1.0 / gravity, motion.error)


def parts_of(count: int, periods: int) -> Sequence[slice]:
    """Divide states into ranges, one per call of a kernel, over a number of periods."""
    # About half a second.
    return [*split_range(count, min(TOGETHER, max(1, 100_000 // periods)))]


def sensible(values: Floats, name: str) -> None:
    """Raise an error for coordinates or velocities that are not finite or absurdly large."""
    if not values.size or not np.all(np.abs(values) <= MAX_SPEED):
        raise InvalidOption(f"{{}} must be finite numbers of at most {MAX_SPEED:g} in size", name)


def described(what: Body | Motion) -> str:
    """Describe a body or a motion with its parameters in one line."""
    if isinstance(what, Motion):
        return ", ".join(part for part in (what.label, what.description.numbers) if part)
    return f"{what.description}, {format_sides(what.sides)}"


class StroboscopicMap(PeriodicForcing):
    """Map of a state (coordinate, velocity) over one period, created by `stroboscopic_map`.

    Attributes
    ----------
    body, motion, model, chattering
        Body, one period of the motion, model, and chattering scheme.
    forcing_period : float
        Period of the motion, s.

    See Also
    --------
    stroboscopic_map : Create the map of a body under periodic motion.
    periodic_orbits : Find the periodic orbits of the map.
    """

    def __call__(self, states: ArrayLike, n_periods: int = 1) -> Floats:
        """Return states after a number of periods.

        Parameters
        ----------
        states : array_like, shape (..., 2)
            Coordinate and velocity at the start of a period, in rad and rad/s for a block, in m and m/s for other
            bodies.
        n_periods : int
            Number of periods.

        Returns
        -------
        ndarray, shape (..., 2)
            Final states. At rest the velocity is exactly zero and the body is at its stop. NaN after overturning or too
            many steps.

        Raises
        ------
        InvalidOption
            If the states have another shape, or a state is behind a stop.
        """
        found, _, _ = self.advance(states, n_periods)
        return found

    def orbit(self, states: ArrayLike, n_periods: int) -> Floats:
        """Return states after 0, 1, ... periods, shape (..., n_periods + 1, 2), as the map does."""
        given, made = self._states(states)
        count = checks.integer(n_periods, "n_periods", InvalidOption, minimum=1)
        rows = np.full((len(made), count, 3), np.nan)
        self._iterate(made, count, rows)
        known = ~np.isnan(rows[..., 0])
        found = self._coordinates(rows[..., 0], rows[..., 1], np.where(known, rows[..., 2], 0.0).astype(np.int64))
        whole = np.concatenate([given.reshape(-1, 1, 2), found], axis=1)
        return whole.reshape(*given.shape[:-1], count + 1, 2)

    def advance(self, states: ArrayLike, n_periods: int = 1) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
        """Return states after a number of periods, the `PeriodOutcome` of each, and the numbers of resolved impacts."""
        given, made = self._states(states)
        self._iterate(made, checks.integer(n_periods, "n_periods", InvalidOption, minimum=1))
        outcomes, impacts = (np.array(made[name]).reshape(given.shape[:-1]) for name in ("ending", "impacts"))
        return self._known(made).reshape(given.shape), outcomes, impacts

    def derivative(self, states: ArrayLike, n_periods: int = 1) -> tuple[Floats, Floats]:
        """Return states after a number of periods and their derivatives by the initial states, shape (..., 2, 2).

        Derivatives are exactly zero if the body comes to rest on the way or is held at rest at the start, NaN after
        overturning, and infinite at a grazing impact. On a stop that does not hold the body, they apply to states in
        front of the stop. Arcs contribute solutions of the variational equation, impacts saltation matrices.
        """
        given, made = self._states(states)
        total = np.broadcast_to(np.eye(2), (len(made), 2, 2)).copy()
        change, ended = np.empty_like(total), np.zeros(len(made), dtype=np.bool_)
        for _ in range(checks.integer(n_periods, "n_periods", InvalidOption, minimum=1)):
            signs, before = _signs(made["side"]), made.copy()
            self._iterate(made)
            differentiate(*self._marching(), state.expose_fields(before), change)
            ended |= np.isin(made["ending"], (PeriodOutcome.OVERTURNED, PeriodOutcome.UNFINISHED))
            total = (signs * _signs(made["side"]))[:, None, None] * change @ total
        found = self._coordinates(made["u"], made["v"], made["side"])
        found[ended] = total[ended] = np.nan
        return found.reshape(given.shape), total.reshape(*given.shape, 2)

    def from_impacts(self, impacts: ArrayLike) -> Floats:
        """Return the states at the end of the period in which bodies leave impacts, shape (..., 2).

        An impact is a pair: time since the start of the period, s, and velocity after the impact. The sign of the
        velocity is the side that a block enters. Between two stops the velocity points away from the stop. NaN if the
        body overturns earlier. Raise `InvalidOption` if the impacts have another shape, or a velocity does not point
        away from its stop.
        """
        given = self._pairs(impacts, "impacts", "phase in s")
        flat = given.reshape(-1, 2)
        made = state.new_states(len(flat), 0)
        phase = np.mod(np.where(np.isfinite(flat[:, 0]), flat[:, 0], np.nan), self.forcing_period)
        starts = self._ground.pieces[: (len(self._ground.pieces) - 3) // 2, 0]
        made["piece"] = np.searchsorted(starts, phase, side="right") - 1
        made["offset"] = phase - starts[made["piece"]]
        made["side"] = np.where(flat[:, 1] < 0.0, 1, 0)
        made["v"] = np.where(np.isnan(phase), np.nan, np.abs(flat[:, 1]))
        if np.any(flat[:, 1] == 0.0) or (not self._is_two_sided and np.any(flat[:, 1] < 0.0)):
            raise InvalidOption("every velocity in {} must lead away from the stop that was hit", "impacts")
        made["peak"] = self._no_peak
        self._iterate(made)
        return self._known(made).reshape(given.shape)

    def _iterate(self, made: state.Records, n_periods: int = 1, rows: Floats | None = None) -> None:
        setting = self._setting()
        orbits = np.empty((len(made), 0, 3)) if rows is None else rows
        traps, counts = np.empty((0, TRAP)), np.zeros((2, len(made)), dtype=np.int64)

        def follow(part: slice) -> None:
            found, taken = counts[:, part]
            iterate(setting, state.new_scratch(), made[part], n_periods, orbits[part], traps, found, taken)

        for _ in map_in_threads(follow, parts_of(len(made), n_periods)):
            pass


class HalfMap(StroboscopicMap):
    """Map of a mirrored body under an antisymmetric motion to the mirror image of its state half a period later."""

    def __init__(self, strobe: StroboscopicMap) -> None:
        super().__init__(strobe.body, strobe.motion, strobe.model, strobe.chattering)
        motion = strobe.motion
        middle = int(np.argmin(np.abs(motion.breakpoints - motion.breakpoints[0] - 0.5 * self.forcing_period)))
        half = Motion(motion.breakpoints[: middle + 1], motion.coefficients[:middle], error=motion.error)
        self.forcing_period *= 0.5
        self._ground = repeated(half, self.body.gravity, -1.0)
        self._steps = np.ascontiguousarray(self._steps[:, :middle])  # as kernels require

    def mirrored(self, state: Floats, halves: int) -> tuple[Floats, Floats]:
        """Return the mirror image after an odd number of half periods, and its derivative; NaN where it overturns."""
        total, at = np.eye(2), state
        for _ in range(halves):
            if not np.all(np.isfinite(at)):  # a march from there would use all its turns
                break
            after, change = self.derivative(at)
            at, total = 0.0 - after, -change @ total
        return at, total


def is_mirrored(strobe: StroboscopicMap) -> bool:
    """Whether the mirror image of every trajectory of a body is a trajectory half a period later."""
    motion = strobe.motion
    if not (strobe.bodies.is_symmetric and are_halved(motion)[0]):
        return False
    times = motion.breakpoints[0] + strobe.forcing_period * (np.arange(200) + 0.5) / 400.0
    sums = motion.acceleration(times) + motion.acceleration(times + 0.5 * strobe.forcing_period)
    return bool(np.max(np.abs(sums)) <= 1e-12 * motion.pga)


def are_halved(motion: Motion) -> Flags:
    """Whether there is another breakpoint half a period later, for each breakpoint but the last."""
    starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
    return distances(np.mod(starts + 0.5 * period, period), starts, period) <= 1e-14 * period


def distances(times: Floats, marks: Floats, period: float) -> Floats:
    """Compute the distance from each time to the nearest mark, within a period that repeats."""
    marks = np.sort(marks)
    after = np.searchsorted(marks, times)
    away = np.abs(times - marks[[after - 1, after % len(marks)]])
    return np.asarray(np.min(np.minimum(away, period - away), axis=0))


def _signs(side: NDArray[np.int64]) -> Floats:
    return np.where(side > 0, -1.0, 1.0)


def stroboscopic_map(
    body: Body, motion: Motion, *, model: Model | None = None, chattering: str | ChatteringScheme = "certified"
) -> StroboscopicMap:
    """Create the map of a body under periodic motion from one period to the next.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        Body under the motion.
    motion : Motion
        One period of the motion, for example ``pulses.sine(a, f, cycles=1)``.
    model : {"nonlinear", "linear"}, optional
        Equation of motion; by default nonlinear for a rocking body.
    chattering : str or ChatteringScheme
        As in `rocking.simulate`.

    Returns
    -------
    StroboscopicMap
        Callable that maps arrays of states.

    Raises
    ------
    InvalidMotion
        If the motion is not a `Motion`, or has zero length.
    InvalidOption
        If the body does not support the model.

    See Also
    --------
    periodic_orbits : Find the periodic orbits of the map.
    bifurcation_diagram : Compute long-term states against a parameter.

    Examples
    --------
    >>> from rocking import Block, dynamics, pulses
    >>> block = Block.from_parameters(p=1.0, alpha=0.2, restitution=0.8)
    >>> shaking = pulses.sine(6.0, 0.8, cycles=1)
    >>> rock = dynamics.stroboscopic_map(block, shaking, model="linear")
    >>> rock([0.05, 0.0]).round(6).tolist()
    [-0.085002, 0.087054]
    """
    return StroboscopicMap(body, motion, model, chattering)
