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
from rocking.errors import BlockError, MotionError, OptionError
from rocking.kernels import state
from rocking.kernels.ground import Ground, build_ground
from rocking.kernels.periodic import (
    TRAP_COLUMNS,
    PeriodicProblem,
    build_step_rows,
    differentiate_periods,
    iterate_periods,
)
from rocking.kernels.periodic import PeriodOutcome as PeriodOutcome
from rocking.kernels.trace import NO_NODES, Trail
from rocking.motion.motion import Motion
from rocking.records.named import check_motion

#: Ground acceleration after the second period, g, which lifts any body.
_LIFTING_ACCELERATION: Final = 1e12

#: Number of states per call of a kernel, small so that a computation can be interrupted quickly.
STATES_PER_CALL: Final = 256

#: Traps of a map of single states.
_NO_TRAPS: Final = np.empty((0, TRAP_COLUMNS))

#: Factor that equals one within rounding error.
_BELOW_ONE: Final = 1.0 - 2.0**-40


class PeriodicallyForcedBody:
    """Body under periodic motion, in the form that kernels accept."""

    def __init__(self, body: Body, motion: Motion, model: Model | None, chattering: str | ChatteringScheme) -> None:
        if (one_period := check_motion(motion)) is None:
            example = "rocking.pulses.sine(a, f, cycles=1)"
            raise MotionError(f"motion must be one period of a Motion, for example {example}; got None")
        if one_period.vertical is not None:
            raise MotionError("motion must not have a vertical component for a stroboscopic map")
        self.body, self.motion = require_body(body), one_period
        self.bodies = self.body.as_bodies()
        default: Model = "linear" if isinstance(self.body, LinearBody) else "nonlinear"
        self.model: Model = default if model is None else model
        checks.choice(self.model, "model", OptionError, MODELS)
        self.chattering = chattering_scheme(chattering)
        self.forcing_period = float(self.motion.breakpoints[-1] - self.motion.breakpoints[0])
        if not np.max(np.abs(self.motion.coefficients[:, 0])) < _LIFTING_ACCELERATION * self.body.gravity:
            limit = f"{_LIFTING_ACCELERATION:g} g"
            raise MotionError(f"the accelerations of the motion must be below {limit} for a stroboscopic map")
        self._ground = create_repeated_ground(self.motion, self.body.gravity)
        setup = Setup(self.bodies, self.model, self.chattering, self.forcing_period)
        run = setup.prepare(self.motion, ground=self._ground)
        self._body_structs, self._settings = run.structs, run.settings
        self._settings["stop_time"], self._settings["no_end_time"] = np.inf, True
        if np.any(self._body_structs["yielding"]):
            reason = "which stroboscopic maps do not support"
            raise BlockError(f"yielding tendons have internal state, {reason}: remove the tendon")
        if np.any(self._body_structs["variable_restitution"] & (self._body_structs["seed"] >= 0)):
            raise OptionError(
                "stroboscopic maps do not support restitution drawn at random at each impact: specify a number, or a "
                "restitution that decreases with the speed"
            )
        rows = build_step_rows(self._ground, self._body_structs[0])
        self._steps = rows if self.model == "linear" else rows[:, :0]

    def __repr__(self) -> str:
        inputs = f"{describe_input(self.body)} under {describe_input(self.motion)}"
        return f"<{type(self).__name__}: {inputs}; {self.model} model>"

    def _copy_settings(self, *, stores_nodes: bool) -> state.Struct:
        settings = self._settings.copy()
        settings["writes_tables"] = stores_nodes
        return settings

    def _create_problem(self) -> PeriodicProblem:
        settings = self._copy_settings(stores_nodes=False)
        return PeriodicProblem(self._ground, self._body_structs[0], settings, state.create_table(0), self._steps)

    def _create_derivative_arguments(self) -> tuple[Trail, state.Struct, state.Struct, state.Structs]:
        """Create the problem and the workspace of the derivative kernels."""
        trail = Trail(self._ground, self._body_structs[0], self._copy_settings(stores_nodes=True), NO_NODES)
        return trail, state.create_scratch(), state.create_struct(state.VARIATION_DTYPE), state.create_table(512)

    def _check_starts(self, starts: ArrayLike, name: str) -> Floats:
        """Return initial states, shape (n, 2), after checking that they are finite and in front of the stops."""
        states = checks.numbers(starts, name, OptionError)
        self._to_structs(states, name)
        check_magnitudes(states, name)
        return states.reshape(-1, 2)

    def _to_structs(
        self, states: ArrayLike, name: str = "states", velocities: str = ""
    ) -> tuple[Floats, state.Structs]:
        """Return states as an array and as structs; ``name`` and ``velocities`` are the argument names for errors."""
        pairs = self._check_pairs(states, name, self.body.coordinate.name)
        flat = pairs.reshape(-1, 2)
        (coordinate, velocity), struct, (low, high) = flat.T, self._body_structs[0], self.body.stops
        if struct["next_side"][0] == 0:  # a stop, which the body cannot pass
            leads_into_second = bool(struct["two_stops"]) & (coordinate == high) & (velocity > 0.0)
            leads_into_stop = (coordinate == low) & (velocity < 0.0) | leads_into_second
            if np.any(leads_into_stop):
                x, v = float(coordinate[leads_into_stop][0]), float(velocity[leads_into_stop][0])
                message = f"{{}} must not point into a stop; got {v:g} m/s at {x:g} m"
                correction = "change its sign, or begin in front of the stop"
                raise OptionError(f"{message}; {correction}", velocities or name, value=v)
        structs = state.create_states(len(flat), 0)
        set_start(structs, self._body_structs, self.bodies, coordinate, velocity, name)
        structs["peak"] = self._initial_peak
        return pairs, structs

    @property
    def _initial_peak(self) -> float:
        """Initial peak that disables the search for peaks: the overturning angle less rounding error."""
        overturn_angle = float(self._body_structs["overturn_angle"][0])
        return overturn_angle if np.isinf(overturn_angle) else overturn_angle * _BELOW_ONE

    def _check_pairs(self, values: ArrayLike, name: str, coordinate: str) -> Floats:
        """Return pairs of numbers as an array, shape (..., 2)."""
        pairs = checks.numbers(values, name, OptionError)
        if pairs.ndim == 0 or pairs.shape[-1] != 2:
            expected = f"pairs ({coordinate}, velocity) along the last axis"
            raise OptionError(f"{{}} must contain {expected}; got shape {pairs.shape}", name)
        return pairs

    def _to_coordinates(self, u: Floats, v: Floats, side: Integers) -> Floats:
        """Convert states in the frames of their sides to coordinates and velocities."""
        stop = np.where(side < 0, -1 - side, side)
        sign = 1.0 - 2.0 * stop
        stops = np.array(self.body.stops)[stop]
        coordinates = np.stack([stops + sign * u, sign * v], axis=-1)
        coordinates[side < 0] = np.stack([stops, np.zeros_like(stops)], axis=-1)[side < 0]
        return coordinates + 0.0

    def _from_structs(self, structs: state.Structs) -> Floats:
        """Convert structs to coordinates and velocities, NaN after overturning or too many steps."""
        coordinates = self._to_coordinates(structs["u"], structs["v"], structs["side"])
        coordinates[np.isin(structs["status"], (PeriodOutcome.OVERTURNED, PeriodOutcome.UNFINISHED))] = np.nan
        return coordinates

    @property
    def _is_two_sided(self) -> bool:
        """Whether the coordinate changes its sign, or there is a second stop."""
        struct = self._body_structs[0]
        return bool(struct["two_stops"] or struct["next_side"][0] == 1)

    @property
    def _conserves_energy(self) -> bool:
        """Whether two successive impacts lose no speed, so that states near a rest never rest."""
        return bool(np.prod(self._body_structs[0]["restitution"]) >= 1.0)


class StateScale(NamedTuple):
    """Scales of coordinate and velocity for the comparison of states."""

    coordinate: float
    velocity: float


def compute_scale(forced_body: PeriodicallyForcedBody) -> StateScale:
    """Compute the natural scales of coordinate and velocity of a body under a motion."""
    struct, period = forced_body._body_structs[0], forced_body.forcing_period
    if not isinstance(forced_body.body, LinearBody):
        alpha = float(np.max(struct["slenderness"]))
        return StateScale(alpha, alpha * math.sqrt(float(np.max(np.abs(struct["stiffness"])))))
    pull = float(np.max(np.abs(struct["restoring_gain"] * struct["threshold"])[: 2 if struct["two_stops"] else 1]))
    speed = period * max(estimate_mean_acceleration(forced_body.motion), pull, 1e-300)
    rate = math.sqrt(abs(float(struct["stiffness"][0])))
    if struct["two_stops"]:
        width = float(struct["overturn_angle"])
        return StateScale(width, max(width * rate, width / period))
    return StateScale(speed / max(rate, 1.0 / period), speed)


def estimate_mean_acceleration(motion: Motion) -> float:
    """Estimate the mean absolute acceleration."""
    times = np.linspace(motion.breakpoints[0], motion.breakpoints[-1], 257)
    return float(np.mean(np.abs(motion.acceleration(times))))


def create_repeated_ground(motion: Motion, gravity: float, sign: float = 1.0) -> Ground:
    """Create the ground of two periods of a motion, followed by an acceleration that lifts any body."""
    times = motion.breakpoints - motion.breakpoints[0]
    period, columns = times[-1], motion.coefficients.shape[1]
    lifting_rows = np.zeros((2, columns))
    lifting_rows[:, 0] = _LIFTING_ACCELERATION * gravity, -_LIFTING_ACCELERATION * gravity
    breakpoints = np.concatenate([times, period + times[1:], [3.0 * period, 4.0 * period]])
    coefficients = np.concatenate([motion.coefficients, sign * motion.coefficients, lifting_rows])
    breakpoints.flags.writeable = coefficients.flags.writeable = False  # as in a motion: kernels are compiled for these
    return build_ground(breakpoints, coefficients, 1.0 / gravity, motion.error)


def split_states(count: int, periods: int) -> Sequence[slice]:
    """Divide states into ranges, one per call of a kernel of about half a second."""
    return [*split_range(count, min(STATES_PER_CALL, max(1, 100_000 // periods)))]


def check_magnitudes(values: Floats, name: str) -> None:
    """Raise an error for coordinates or velocities that are not finite or too large."""
    if not values.size or not np.all(np.abs(values) <= MAX_SPEED):
        raise OptionError(f"{{}} must be finite numbers between -{MAX_SPEED:g} and {MAX_SPEED:g}", name)


def describe_input(subject: Body | Motion) -> str:
    """Describe a body or a motion with its parameters in one line."""
    if isinstance(subject, Motion):
        return ", ".join(part for part in (subject.label, subject.description.parameter_text) if part)
    return f"{subject.description}, {format_sides(subject.sides)}"


class StroboscopicMap(PeriodicallyForcedBody):
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

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, shaking = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(12.0, 5.0, cycles=1)
    >>> strobe = dynamics.stroboscopic_map(ball, shaking)
    >>> strobe.forcing_period, strobe([0.1, 0.0]).round(6).tolist()
    (0.2, [0.07887, 0.732401])
    """

    def __call__(self, states: ArrayLike, period_count: int = 1) -> Floats:
        """Return states after a number of periods.

        Parameters
        ----------
        states : array_like, shape (..., 2)
            Coordinate and velocity at the start of a period, in rad and rad/s for a block, in m and m/s for other
            bodies.
        period_count : int
            Number of periods.

        Returns
        -------
        ndarray, shape (..., 2)
            Final states. At rest the velocity is exactly zero and the body is at its stop. NaN after overturning or too
            many steps.

        Raises
        ------
        OptionError
            If the states have another shape, or a state is behind a stop.
        """
        final_states, _, _ = self.advance(states, period_count)
        return final_states

    def orbit(self, states: ArrayLike, period_count: int) -> Floats:
        """Return states after 0, 1, ... periods, shape (..., period_count + 1, 2), as the map does."""
        pairs, structs = self._to_structs(states)
        count = checks.integer(period_count, "period_count", OptionError, minimum=1)
        rows = np.full((len(structs), count, 3), np.nan)
        self._iterate(structs, count, rows)
        u, v, side = np.moveaxis(rows, -1, 0)
        later_states = self._to_coordinates(u, v, np.where(np.isnan(u), 0.0, side).astype(np.int64))
        orbit = np.concatenate([pairs.reshape(-1, 1, 2), later_states], axis=1)
        return orbit.reshape(*pairs.shape[:-1], count + 1, 2)

    def advance(self, states: ArrayLike, period_count: int = 1) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
        """Return states after a number of periods, the `PeriodOutcome` of each, and the numbers of resolved impacts."""
        pairs, structs = self._to_structs(states)
        self._iterate(structs, checks.integer(period_count, "period_count", OptionError, minimum=1))
        outcomes, impacts = (np.array(structs[name]).reshape(pairs.shape[:-1]) for name in ("status", "impact_count"))
        return self._from_structs(structs).reshape(pairs.shape), outcomes, impacts

    def derivative(self, states: ArrayLike, period_count: int = 1) -> tuple[Floats, Floats]:
        """Return states after a number of periods and their derivatives by the initial states, shape (..., 2, 2).

        Derivatives are exactly zero if the body comes to rest in between or is held at rest at the start, NaN after
        overturning, and infinite at a grazing impact. On a stop that does not hold the body, they apply to states in
        front of the stop. Arcs contribute solutions of the variational equation, impacts saltation matrices.
        """
        pairs, structs = self._to_structs(states)
        product = np.broadcast_to(np.eye(2), (len(structs), 2, 2)).copy()
        change, ended = np.empty_like(product), np.zeros(len(structs), dtype=np.bool_)
        for _ in range(checks.integer(period_count, "period_count", OptionError, minimum=1)):
            signs, initial_states = _compute_signs(structs["side"]), structs.copy()
            self._iterate(structs)
            differentiate_periods(*self._create_derivative_arguments(), state.expose_fields(initial_states), change)
            ended |= np.isin(structs["status"], (PeriodOutcome.OVERTURNED, PeriodOutcome.UNFINISHED))
            product = (signs * _compute_signs(structs["side"]))[:, None, None] * change @ product
        final_states = self._to_coordinates(structs["u"], structs["v"], structs["side"])
        final_states[ended] = product[ended] = np.nan
        return final_states.reshape(pairs.shape), product.reshape(*pairs.shape, 2)

    def convert_impacts(self, impacts: ArrayLike) -> Floats:
        """Return the states at the end of the period in which bodies leave impacts, shape (..., 2).

        An impact is a pair: time since the start of the period, s, and velocity after the impact. The sign of the
        velocity is the side that a block enters. Between two stops the velocity points away from the stop. NaN if the
        body overturns earlier. Raise `OptionError` if the impacts have another shape, or a velocity does not point
        away from its stop.
        """
        pairs = self._check_pairs(impacts, "impacts", "phase in s")
        flat = pairs.reshape(-1, 2)
        structs = state.create_states(len(flat), 0)
        phase = np.mod(np.where(np.isfinite(flat[:, 0]), flat[:, 0], np.nan), self.forcing_period)
        starts = self._ground.pieces[: (len(self._ground.pieces) - 3) // 2, 0]
        structs["piece"] = np.searchsorted(starts, phase, side="right") - 1
        structs["offset"] = phase - starts[structs["piece"]]
        structs["side"] = np.where(flat[:, 1] < 0.0, 1, 0)
        structs["v"] = np.where(np.isnan(phase), np.nan, np.abs(flat[:, 1]))
        if np.any(flat[:, 1] == 0.0) or (not self._is_two_sided and np.any(flat[:, 1] < 0.0)):
            raise OptionError("every velocity in {} must point away from the stop of the impact", "impacts")
        structs["peak"] = self._initial_peak
        self._iterate(structs)
        return self._from_structs(structs).reshape(pairs.shape)

    def _iterate(
        self, structs: state.Structs, period_count: int = 1, rows: Floats | None = None, traps: Floats = _NO_TRAPS
    ) -> tuple[Integers, Integers]:
        """Advance states, up to traps; write their orbits, and return the trap (or -1) and periods of each."""
        problem = self._create_problem()
        orbits = np.empty((len(structs), 0, 3)) if rows is None else rows
        reached, counts = np.empty((2, len(structs)), dtype=np.int64)

        def advance_part(part: slice) -> None:
            outputs = reached[part], counts[part]
            iterate_periods(problem, state.create_scratch(), structs[part], period_count, orbits[part], traps, *outputs)

        for _ in map_in_threads(advance_part, split_states(len(structs), period_count)):
            pass
        return reached, counts


class HalfMap(StroboscopicMap):
    """Map of a mirrored body under an antisymmetric motion to the mirror image of its state half a period later."""

    def __init__(self, strobe: StroboscopicMap) -> None:
        super().__init__(strobe.body, strobe.motion, strobe.model, strobe.chattering)
        motion = strobe.motion
        middle = int(np.argmin(np.abs(motion.breakpoints - motion.breakpoints[0] - 0.5 * self.forcing_period)))
        half = Motion(motion.breakpoints[: middle + 1], motion.coefficients[:middle], error=motion.error)
        self.forcing_period *= 0.5
        self._ground = create_repeated_ground(half, self.body.gravity, -1.0)
        self._steps = np.ascontiguousarray(self._steps[:, :middle])  # as kernels require

    def map_to_mirror_image(self, state: Floats, half_count: int) -> tuple[Floats, Floats]:
        """Return the mirror image after an odd number of half periods, and its derivative; NaN where it overturns."""
        product, mirror_image = np.eye(2), state
        for _ in range(half_count):
            if not np.all(np.isfinite(mirror_image)):  # a NaN state would use up the step budget
                break
            image, change = self.derivative(mirror_image)
            mirror_image, product = 0.0 - image, -change @ product
        return mirror_image, product


def has_mirror_symmetry(strobe: StroboscopicMap) -> bool:
    """Whether the mirror image of every trajectory of a body is a trajectory half a period later."""
    motion = strobe.motion
    if not (strobe.bodies.is_symmetric and have_opposite_breakpoints(motion)[0]):
        return False
    times = motion.breakpoints[0] + strobe.forcing_period * (np.arange(200) + 0.5) / 400.0
    sums = motion.acceleration(times) + motion.acceleration(times + 0.5 * strobe.forcing_period)
    return bool(np.max(np.abs(sums)) <= 1e-12 * motion.pga)


def have_opposite_breakpoints(motion: Motion) -> Flags:
    """Whether there is another breakpoint half a period later, for each breakpoint but the last."""
    starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
    return compute_distances(np.mod(starts + 0.5 * period, period), starts, period) <= 1e-14 * period


def compute_distances(times: Floats, marks: Floats, period: float) -> Floats:
    """Compute the distance from each time to the nearest mark, within a period that repeats."""
    marks = np.sort(marks)
    next_mark = np.searchsorted(marks, times)
    gaps = np.abs(times - marks[[next_mark - 1, next_mark % len(marks)]])
    return np.asarray(np.min(np.minimum(gaps, period - gaps), axis=0))


def _compute_signs(side: NDArray[np.int64]) -> Floats:
    """Compute the signs of rotations on the sides of states."""
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
    MotionError
        If the motion is not a `Motion`, or has zero length.
    OptionError
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
