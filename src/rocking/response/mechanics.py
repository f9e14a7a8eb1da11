"""Ground forces, friction demand and energy of a body.

The energy follows from the equation of motion without ground motion, u'' = -V'(u): kinetic u'^2/2 and potential V(u),
both multiplied by the moment of inertia about the pivot. (Derived in the documentation.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block import Block, RestrainedBlock
from rocking.block.body import Body, ContactLaw
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.bisection import bisect
from rocking.errors import OptionError
from rocking.kernels.ground import scale_coefficients
from rocking.kernels.state import Struct
from rocking.motion import piecewise
from rocking.response.history import TimeHistory, compute_elongation, compute_plastic_elongations

#: Samples per step, and refinements around the largest one, in the search for extreme forces.
_SAMPLES_PER_STEP: Final = 9
_REFINEMENT_COUNT: Final = 10

#: Upper bound of the friction of any materials.
_MAX_FRICTION: Final = 3.0

#: Function of the ratios of horizontal and vertical force to the weight.
ForceMeasure = Callable[[Floats, Floats], Floats]


def check_available_friction(value: object, name: str = "available_friction") -> float:
    """Return a coefficient of friction, or raise `OptionError` if it is not in (0, 3]."""
    coefficient = checks.positive(value, name, OptionError)
    if coefficient > _MAX_FRICTION:
        message = f"{{}} must be at most {_MAX_FRICTION:g}, not {coefficient:g}"
        raise OptionError(f"{message}; use the tangent of an angle of friction", name, value=value)
    return coefficient


def compute_friction_demand(horizontal: Floats, vertical: Floats) -> Floats:
    """Return the friction coefficient required to stick: |H|/N, infinite without normal force, NaN for NaN."""
    demand = np.where(np.isnan(vertical), np.nan, np.inf)
    np.divide(np.abs(horizontal), vertical, out=demand, where=vertical > 0.0)
    return demand


def compute_pull(_: Floats, vertical: Floats) -> Floats:
    """Compute the required tensile force of the ground: the negative normal force."""
    return -vertical


def _bound_steps(values: Floats) -> Floats:
    """Return an upper estimate of a quantity in each step: its largest sample plus the span of samples."""
    return np.asarray(2.0 * values.max(axis=1) - values.min(axis=1))


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Ratios of horizontal and vertical ground force to the weight, up to the time `end_time` (s).

    Within a step the forces are smooth. Both limits at every impact and at every jump of the motion are evaluated. The
    impulses of impacts are not included.
    """

    history: TimeHistory
    contact_law: ContactLaw
    end_time: float

    @cached_property
    def _plastic_elongations(self) -> Floats:
        return compute_plastic_elongations(self.history.trail)

    def compute_forces(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Return both forces at times of any shape; NaN outside the response."""
        times = checks.numbers(time, "time", OptionError)
        flat = times.ravel()
        outside = self.history.is_outside(flat)
        within = np.where(outside, 0.0, flat)
        horizontal, vertical = self._compute_forces_in(within, self.history.find_rows(within))
        horizontal[outside] = vertical[outside] = np.nan
        return horizontal.reshape(times.shape), vertical.reshape(times.shape)

    def compute_extremes(self) -> tuple[float, float]:
        """Return the largest friction required to stick, and the smallest normal force."""
        times, rows = self._sample_steps()
        forces = self._compute_forces_in(times.ravel(), rows.ravel())
        horizontal, vertical = (force.reshape(times.shape) for force in forces)
        friction, min_normal = float(compute_friction_demand(horizontal, vertical).max()), float(vertical.min())

        def refine_maximum(measure: ForceMeasure, beyond: Floats) -> float:
            """Return the largest value of a measure in the steps where ``beyond`` may become positive."""
            near = np.flatnonzero(_bound_steps(beyond) > 0.0)
            return float(self._find_peaks(measure, times[near], rows[near])[1].max(initial=-math.inf))

        if math.isfinite(friction):
            # Unlike the demand, this measure is smooth and bounded if the normal force nearly vanishes.
            friction = max(friction, refine_maximum(compute_friction_demand, np.abs(horizontal) - friction * vertical))
        return friction, min(min_normal, -refine_maximum(compute_pull, min_normal - vertical))

    def find_first_time(self, measure: ForceMeasure, is_beyond: Callable[[Floats], Flags]) -> float:
        """Return the first time, s, at which a measure exceeds a level (``is_beyond`` is monotonic); NaN if never."""
        times, rows = self._sample_steps()
        values = self._evaluate(measure, times, rows)
        near = np.flatnonzero(is_beyond(_bound_steps(values)))
        if not len(near):
            return math.nan
        peak_times, peaks = self._find_peaks(measure, times[near], rows[near])
        exceeding = np.flatnonzero(is_beyond(peaks))
        if not len(exceeding):
            return math.nan
        step = near[exceeding[0]]
        sample_times = np.append(times[step], peak_times[exceeding[0]])
        beyond = is_beyond(np.append(values[step], peaks[exceeding[0]]))
        high = float(sample_times[beyond].min())
        earlier = sample_times[~beyond & (sample_times < high)]
        if not len(earlier):
            return high  # at a jump

        def passes(time: float) -> bool:
            return bool(is_beyond(self._evaluate(measure, np.array([time]), rows[step, :1]))[0])

        return bisect(float(earlier.max()), high, passes)[1]

    def _find_peaks(self, measure: ForceMeasure, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Return the times and values of the maxima in these steps."""
        best_times, best_values = times[:, 0], np.full(len(times), -np.inf)
        for _ in range(_REFINEMENT_COUNT):
            values = self._evaluate(measure, times, rows)
            index = values.argmax(axis=1)[:, None]
            value, time_at_max = (np.take_along_axis(array, index, axis=1)[:, 0] for array in (values, times))
            best_times = np.where(value > best_values, time_at_max, best_times)
            best_values = np.maximum(value, best_values)
            low = np.take_along_axis(times, np.maximum(index - 1, 0), axis=1)
            high = np.take_along_axis(times, np.minimum(index + 1, times.shape[1] - 1), axis=1)
            times = low + (high - low) * np.linspace(0.0, 1.0, times.shape[1])
        return best_times, best_values

    def _evaluate(self, measure: ForceMeasure, times: Floats, rows: Integers) -> Floats:
        return measure(*self._compute_forces_in(times.ravel(), rows.ravel())).reshape(times.shape)

    def _compute_forces_in(self, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Compute the forces in the steps that start at these rows, with the side and the piece of each."""
        theta, rate, acceleration = self.history.compute_states(times, rows).T
        side = self.history.trail.nodes["side"][rows]
        ground = self._evaluate_ground(times, rows, side < 0)
        elongation = compute_elongation(self.history.trail, np.abs(theta), side) - self._plastic_elongations[rows]
        horizontal, vertical = self.contact_law((theta, rate, acceleration), ground, side, elongation)
        direction, mu = self.history.trail.nodes["direction"][rows], self.history.trail.block["kinetic_friction"]
        return np.where(direction != 0, -direction * mu * vertical, horizontal), vertical

    def _evaluate_ground(self, times: Floats, rows: Integers, is_resting: Flags) -> tuple[Floats, Floats]:
        """Return both ground accelerations in g, from the piece at the start of a step or, at rest, any piece."""
        ground = self.history.trail.ground
        current = np.maximum(np.searchsorted(ground.pieces[:, 0], times, side="right") - 1, 0)
        piece = np.where(is_resting, current, self.history.trail.nodes["piece"][rows])
        elapsed = np.maximum(times - ground.pieces[piece, 0], 0.0)
        components = scale_coefficients(ground, piece)
        push, *lift = (piecewise.evaluate_pieces(coefficients, elapsed) for coefficients in components)
        return push, lift[0] if lift else np.zeros_like(push)

    def _sample_steps(self) -> tuple[Floats, Integers]:
        """Return samples of every step and, at rest, of every piece of the motion, in order, with their steps."""
        nodes = self.history.trail.nodes
        breakpoints = self.history.trail.ground.pieces[:, 0]
        breakpoints = breakpoints[nodes["side"][self.history.find_rows(breakpoints)] < 0]
        starts = np.unique(np.concatenate([nodes["time"], breakpoints]))
        starts = starts[(starts < self.end_time) | (starts == starts[0])]
        if nodes["side"][self.history.find_rows(np.array([self.end_time]))[0]] < 0:
            starts = np.union1d(starts, [self.end_time])  # motion after a jump at the end
        ends = np.append(starts[1:], max(self.end_time, starts[-1]))
        rows = self.history.find_rows(starts)
        fractions = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _SAMPLES_PER_STEP))
        times = starts[:, None] + fractions * (ends - starts)[:, None]
        is_resting = nodes["side"][rows] < 0  # motion before a jump
        times[is_resting, -1] = np.maximum(np.nextafter(times[is_resting, -1], 0.0), times[is_resting, 0])
        return times, np.repeat(rows[:, None], _SAMPLES_PER_STEP, axis=1)


#: Number of points of a boundary, and its extent divided by the balance.
_BOUNDARY_POINT_COUNT: Final = 201
_MAX_RATIO: Final = 1.6

#: Fields of a struct that determine the potential.
_POTENTIAL_FIELDS: Final = (
    "stiffness", "restoring_gain", "threshold", "slenderness", "added_weight", "added_push", "prestress", "spring",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class EnergyModel:
    """Energy of a block divided by the smallest energy from rest to an unstable balance without ground motion.

    ``struct`` is the body as a struct for kernels. Rotations are in the frame of a side, u = |theta|. A side is 0, 1,
    or negative at rest.
    """

    body: Block | RestrainedBlock
    struct: Struct
    nonlinear: bool

    @cached_property
    def _inertia(self) -> Floats:
        """Ratio of the moment of inertia about the pivot of each side to the weight, m s^2: R/p^2."""
        return np.array([self.body.sides[0].radius, self.body.sides[-1].radius]) / self.p**2

    @property
    def p(self) -> Floats:
        """Frequency parameter of each side, rad/s."""
        return np.array([self.body.sides[0].p, self.body.sides[-1].p])

    @cached_property
    def balance(self) -> Floats:
        """Rotation of the unstable balance on each side in this model, rad; infinite if there is none."""
        return np.array(self.body.balance) if self.nonlinear else compute_linear_balance(self.body)

    @cached_property
    def has_balances(self) -> bool:
        """Whether each side has a balance, the unit of rotations."""
        return bool(np.all(np.isfinite(self.balance[: len(self.body.sides)])))

    @property
    def unit_of_rotation(self) -> Floats:
        """Unit of rotations to each side, rad: the balance, or one radian if a balance is missing."""
        return np.where(np.isfinite(self.balance), self.balance, 1.0) if self.has_balances else np.ones(2)

    @cached_property
    def balance_energy(self) -> Floats:
        """Potential energy at the balance of each side, divided by inertia, 1/s^2; infinite if there is none."""
        energies, finite = np.full(2, math.inf), np.flatnonzero(np.isfinite(self.balance))
        energies[finite] = self._potential(self.balance[finite], finite)
        return energies

    @cached_property
    def overturning_energy(self) -> Floats:
        """Overturning energy to each side, divided by the smaller one: 1 to the easier side."""
        return self.balance_energy * self._inertia / self._unit

    @cached_property
    def _unit(self) -> float:
        return float(np.min(self.balance_energy * self._inertia))

    def kinetic(self, velocity: Floats, side: Integers) -> Floats:
        """Return the kinetic energy at velocities, rad/s."""
        energy: Floats = 0.5 * velocity**2 * (self._inertia / self._unit)[np.maximum(side, 0)]
        return energy

    def potential(self, rotation: Floats, side: Integers) -> Floats:
        """Return the potential energy at rotations, rad: zero upright, without the ground motion."""
        side_index = np.maximum(side, 0)
        energy: Floats = self._potential(np.abs(rotation), side_index) * (self._inertia / self._unit)[side_index]
        return energy

    def _potential(self, u: Floats, side: Integers) -> Floats:
        """Return V(u) of these sides, 1/s^2, without cancellation at small rotations."""
        fields = {name: self.struct[name][side] for name in _POTENTIAL_FIELDS}
        weight, push = 1.0 + fields["added_weight"], fields["added_push"]
        if self.nonlinear:
            chord = 2.0 * np.sin(0.5 * u)
            psi = fields["slenderness"] - 0.5 * u
            raised = fields["stiffness"] * (weight * np.sin(psi) + push * np.cos(psi)) + fields["prestress"]
            return np.asarray(chord * raised + 0.5 * fields["spring"] * u * u)
        restoring = fields["restoring_gain"] * (fields["threshold"] * weight + push) + fields["prestress"]
        return np.asarray(u * (restoring - 0.5 * (fields["stiffness"] * weight - fields["spring"]) * u))

    def compute_boundary(self, side: int) -> tuple[Floats, Floats]:
        """Return normalised rotations and velocities with the energy of the balance of a side.

        Rotations are divided by the balance, absolute velocities by p times the balance.
        """
        balance = self.balance[side]
        if not math.isfinite(balance):
            return np.empty(0), np.empty(0)
        farthest = min(_MAX_RATIO, 0.5 * math.pi / balance)
        u = balance * np.union1d(np.linspace(0.0, farthest, _BOUNDARY_POINT_COUNT), 1.0)
        remaining = self.balance_energy[side] - self._potential(u, np.full(u.shape, side))
        speed = np.sqrt(2.0 * np.maximum(remaining, 0.0)) / (balance * self.p[side])
        return u / balance, speed

    def find_sides(self, impacts: NDArray[np.void]) -> tuple[Integers, Integers]:
        """Return the sides that the body leaves and enters at impacts of a response."""
        entered: Integers = np.where(impacts["side"] > 0, 0, 1)
        return (entered if int(self.struct["next_side"][0]) == 0 else 1 - entered), entered

    def compute_losses(self, impacts: NDArray[np.void]) -> Floats:
        """Return the energy loss of each impact of a response."""
        side_before, side_after = self.find_sides(impacts)
        return self.kinetic(impacts["speed_before"], side_before) - self.kinetic(impacts["speed_after"], side_after)


def compute_linear_balance(body: Block | RestrainedBlock) -> Floats:
    """Return the rotation of the unstable balance on each side in the linear model, rad; infinite if there is none.

    For a yielding tendon the first yield is considered, with the smaller of elastic force and strength, so the nearer
    balance is returned.
    """
    (struct,) = body.as_bodies().create_kernel_structs("linear", np.zeros((1, 2)))
    elastic = _solve_linear_balance(struct, struct["added_weight"], struct["added_push"], struct["prestress"])
    if not struct["yielding"]:
        return elastic
    elongation = struct["yield_elongation"] - struct["slack_elongation"]
    force = struct["base_prestress"] + struct["tendon_stiffness"] * elongation
    return np.minimum(elastic, _solve_linear_balance(struct, struct["base_weight"], struct["base_push"], force))


def _solve_linear_balance(struct: Struct, added_weight: Floats, added_push: Floats, prestress: Floats) -> Floats:
    """Return the rotation without restoring moment, if the moment is linear in the rotation."""
    balance, weight = np.full(2, math.inf), 1.0 + added_weight
    softening = struct["stiffness"] * weight - struct["spring"]
    restoring = struct["restoring_gain"] * (struct["threshold"] * weight + added_push) + prestress
    np.divide(restoring, softening, out=balance, where=softening > 0.0)
    return balance


def create_energy(body: Body, struct: Struct, *, nonlinear: bool) -> EnergyModel:
    """Return the energy of a block; raise `OptionError` for a yielding tendon or a missing balance."""
    if not isinstance(body, Block | RestrainedBlock):
        raise OptionError(f"the overturning energy is defined for blocks only, not for a {type(body).__name__}")
    if struct["yielding"]:
        raise OptionError("the energy is not defined for a yielding tendon; omit the strength of the tendon")
    energy = EnergyModel(body, struct, nonlinear)
    if not np.any(np.isfinite(energy.balance)):
        raise OptionError("this block has no overturning energy, because its restraints hold it at any rotation")
    return energy
