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
from rocking.errors import InvalidOption
from rocking.kernels.ground import component_coefficients
from rocking.kernels.state import Record
from rocking.motion import piecewise
from rocking.response.history import History, elongation, plastic_elongations

#: Samples per step, and refinements around the largest one, in the search for extreme forces.
_SAMPLES: Final = 9
_REFINEMENTS: Final = 10

#: Upper bound of the friction of any materials.
_ROUGHEST: Final = 3.0

#: Function of the ratios of horizontal and vertical force to the weight.
Measure = Callable[[Floats, Floats], Floats]


def friction_coefficient(value: object) -> float:
    """Return a coefficient of friction, or raise `InvalidOption` if it is not in (0, 3]."""
    coefficient = checks.positive(value, "friction", InvalidOption)
    if coefficient > _ROUGHEST:
        text = f"{{}} must be at most {_ROUGHEST:g}, not {coefficient:g}; of an angle of friction take the tangent"
        raise InvalidOption(text, "friction", value=value)
    return coefficient


def friction_demand(horizontal: Floats, vertical: Floats) -> Floats:
    """Return the friction coefficient required to stick: |H|/N, infinite without normal force, NaN for NaN."""
    demand = np.where(np.isnan(vertical), np.nan, np.inf)
    np.divide(np.abs(horizontal), vertical, out=demand, where=vertical > 0.0)
    return demand


def pull(_: Floats, vertical: Floats) -> Floats:
    """Return the required tensile force of the ground: the negative normal force."""
    return -vertical


def _reach(values: Floats) -> Floats:
    """Return an upper estimate of a quantity in each step: its largest sample plus the span of samples."""
    return np.asarray(2.0 * values.max(axis=1) - values.min(axis=1))


@dataclass(frozen=True, eq=False)
class Contact:
    """Ratios of horizontal and vertical ground force to the weight, up to the time `until` (s).

    Within a step the forces are smooth. Both limits at every impact and at every jump of the motion are evaluated. The
    impulses of impacts are not included.
    """

    history: History
    law: ContactLaw
    until: float

    @cached_property
    def _plastic(self) -> Floats:
        return plastic_elongations(self.history.trail)

    def forces(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Return both forces at times of any shape; NaN outside the response."""
        times = checks.numbers(time, "time", InvalidOption)
        flat = times.ravel()
        outside = self.history.outside(flat)
        within = np.where(outside, 0.0, flat)
        horizontal, vertical = self._forces_in(within, self.history.rows(within))
        horizontal[outside] = vertical[outside] = np.nan
        return horizontal.reshape(times.shape), vertical.reshape(times.shape)

    def extremes(self) -> tuple[float, float]:
        """Return the largest friction required to stick, and the smallest normal force."""
        times, rows = self._samples()
        horizontal, vertical = (force.reshape(times.shape) for force in self._forces_in(times.ravel(), rows.ravel()))
        friction, least = float(friction_demand(horizontal, vertical).max()), float(vertical.min())

        def refined(measure: Measure, beyond: Floats) -> float:
            """Return the largest value of a measure in the steps where ``beyond`` may become positive."""
            near = np.flatnonzero(_reach(beyond) > 0.0)
            return float(self._peaks(measure, times[near], rows[near])[1].max(initial=-math.inf))

        if math.isfinite(friction):
            # Unlike the demand, this measure is smooth and bounded if the normal force nearly vanishes.
            friction = max(friction, refined(friction_demand, np.abs(horizontal) - friction * vertical))
        return friction, min(least, -refined(pull, least - vertical))

    def first(self, measure: Measure, is_beyond: Callable[[Floats], Flags]) -> float:
        """Return the first time, s, at which a measure exceeds a level (``is_beyond`` is monotonic); NaN if never."""
        times, rows = self._samples()
        values = self._measured(measure, times, rows)
        near = np.flatnonzero(is_beyond(_reach(values)))
        if not len(near):
            return math.nan
        at, peaks = self._peaks(measure, times[near], rows[near])
        passing = np.flatnonzero(is_beyond(peaks))
        if not len(passing):
            return math.nan
        step = near[passing[0]]
        looks = np.append(times[step], at[passing[0]])
        beyond = is_beyond(np.append(values[step], peaks[passing[0]]))
        high = float(looks[beyond].min())
        before = looks[~beyond & (looks < high)]
        if not len(before):
            return high  # at a jump

        def passes(time: float) -> bool:
            return bool(is_beyond(self._measured(measure, np.array([time]), rows[step, :1]))[0])

        return bisect(float(before.max()), high, passes)[1]

    def _peaks(self, measure: Measure, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Return the times and values of the maxima in these steps."""
        at, best = times[:, 0], np.full(len(times), -np.inf)
        for _ in range(_REFINEMENTS):
            values = self._measured(measure, times, rows)
            place = values.argmax(axis=1)[:, None]
            value, where = (np.take_along_axis(array, place, axis=1)[:, 0] for array in (values, times))
            at, best = np.where(value > best, where, at), np.maximum(value, best)
            low = np.take_along_axis(times, np.maximum(place - 1, 0), axis=1)
            high = np.take_along_axis(times, np.minimum(place + 1, times.shape[1] - 1), axis=1)
            times = low + (high - low) * np.linspace(0.0, 1.0, times.shape[1])
        return at, best

    def _measured(self, measure: Measure, times: Floats, rows: Integers) -> Floats:
        return measure(*self._forces_in(times.ravel(), rows.ravel())).reshape(times.shape)

    def _forces_in(self, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Compute the forces in the steps that start at these rows, with the side and the piece of each."""
        theta, rate, acceleration = self.history.states_in(times, rows).T
        side = self.history.trail.nodes["side"][rows]
        ground = self._ground_in(times, rows, side < 0)
        stretch = elongation(self.history.trail, np.abs(theta), side) - self._plastic[rows]
        return self.law((theta, rate, acceleration), ground, side, stretch)

    def _ground_in(self, times: Floats, rows: Integers, at_rest: Flags) -> tuple[Floats, Floats]:
        """Return both ground accelerations in g, from the piece at the start of a step or, at rest, any piece."""
        ground = self.history.trail.ground
        anywhere = np.maximum(np.searchsorted(ground.pieces[:, 0], times, side="right") - 1, 0)
        piece = np.where(at_rest, anywhere, self.history.trail.nodes["piece"][rows])
        elapsed = np.maximum(times - ground.pieces[piece, 0], 0.0)
        push, *lift = (
            piecewise.evaluate_pieces(coefficients, elapsed) for coefficients in component_coefficients(ground, piece)
        )
        return push, lift[0] if lift else np.zeros_like(push)

    def _samples(self) -> tuple[Floats, Integers]:
        """Return samples of every step and, at rest, of every piece of the motion, in order, with their steps."""
        nodes = self.history.trail.nodes
        corners = self.history.trail.ground.pieces[:, 0]
        corners = corners[nodes["side"][self.history.rows(corners)] < 0]
        starts = np.unique(np.concatenate([nodes["time"], corners]))
        starts = starts[(starts < self.until) | (starts == starts[0])]
        if nodes["side"][self.history.rows(np.array([self.until]))[0]] < 0:
            starts = np.union1d(starts, [self.until])  # motion after a jump at the end
        ends = np.append(starts[1:], max(self.until, starts[-1]))
        rows = self.history.rows(starts)
        fractions = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _SAMPLES))
        times = starts[:, None] + fractions * (ends - starts)[:, None]
        resting = nodes["side"][rows] < 0  # motion before a jump
        times[resting, -1] = np.maximum(np.nextafter(times[resting, -1], 0.0), times[resting, 0])
        return times, np.repeat(rows[:, None], _SAMPLES, axis=1)


#: Number of points of a boundary, and its extent divided by the balance.
_BOUNDARY: Final = 201
_FARTHEST: Final = 1.6

#: Fields of a record that determine the potential.
_FIELDS: Final = (
    "stiffness", "threshold_slope", "threshold", "slenderness", "added_weight", "added_push", "prestress", "spring",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Energy:
    """Energy of a block divided by the smallest energy from rest to an unstable balance without ground motion.

    ``record`` is the body as a record for kernels. Rotations are in the frame of a side, u = |theta|. A side is 0, 1,
    or negative at rest.
    """

    body: Block | RestrainedBlock
    record: Record
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
        return np.array(self.body.balance) if self.nonlinear else linear_balance(self.body)

    @cached_property
    def has_balances(self) -> bool:
        """Whether each side has a balance, the unit of rotations."""
        return bool(np.all(np.isfinite(self.balance[: len(self.body.sides)])))

    @property
    def unit_of_rotation(self) -> Floats:
        """Unit of rotations to each side, rad: the balance, or one radian if a balance is missing."""
        return np.where(np.isfinite(self.balance), self.balance, 1.0) if self.has_balances else np.ones(2)

    @cached_property
    def highest(self) -> Floats:
        """Potential energy at the balance of each side, divided by inertia, 1/s^2; infinite if there is none."""
        found = np.full(2, math.inf)
        for k, at in enumerate(self.balance):
            if math.isfinite(at):
                found[k] = float(self._potential(np.array([at]), np.array([k]))[0])
        return found

    @cached_property
    def needed(self) -> Floats:
        """Overturning energy to each side, divided by the smaller one: 1 to the easier side."""
        return self.highest * self._inertia / self._unit

    @cached_property
    def _unit(self) -> float:
        return float(np.min(self.highest * self._inertia))

    def kinetic(self, velocity: Floats, side: Integers) -> Floats:
        """Return the kinetic energy at velocities, rad/s."""
        found: Floats = 0.5 * velocity**2 * (self._inertia / self._unit)[np.maximum(side, 0)]
        return found

    def potential(self, rotation: Floats, side: Integers) -> Floats:
        """Return the potential energy at rotations, rad: zero upright, without the ground motion."""
        of = np.maximum(side, 0)
        found: Floats = self._potential(np.abs(rotation), of) * (self._inertia / self._unit)[of]
        return found

    def _potential(self, u: Floats, side: Integers) -> Floats:
        """Return V(u) of these sides, 1/s^2, without cancellation at small rotations."""
        made = {name: self.record[name][side] for name in _FIELDS}
        weight, push = 1.0 + made["added_weight"], made["added_push"]
        if self.nonlinear:
            half = 2.0 * np.sin(0.5 * u)
            psi = made["slenderness"] - 0.5 * u
            lifted = made["stiffness"] * (weight * np.sin(psi) + push * np.cos(psi)) + made["prestress"]
            return np.asarray(half * lifted + 0.5 * made["spring"] * u * u)
        stands = made["threshold_slope"] * (made["threshold"] * weight + push) + made["prestress"]
        return np.asarray(u * (stands - 0.5 * (made["stiffness"] * weight - made["spring"]) * u))

    def boundary(self, side: int) -> tuple[Floats, Floats]:
        """Return normalised rotations and velocities with the energy of the balance of a side.

        Rotations are divided by the balance, absolute velocities by p times the balance.
        """
        balance = self.balance[side]
        if not math.isfinite(balance):
            return np.empty(0), np.empty(0)
        farthest = min(_FARTHEST, 0.5 * math.pi / balance)
        u = balance * np.union1d(np.linspace(0.0, farthest, _BOUNDARY), 1.0)
        left = self.highest[side] - self._potential(u, np.full(u.shape, side))
        speed = np.sqrt(2.0 * np.maximum(left, 0.0)) / (balance * self.p[side])
        return u / balance, speed

    def sides_at(self, impacts: NDArray[np.void]) -> tuple[Integers, Integers]:
        """Return the sides that the body leaves and enters at impacts of a response."""
        into: Integers = np.where(impacts["side"] > 0, 0, 1)
        return (into if int(self.record["next_side"][0]) == 0 else 1 - into), into

    def losses(self, impacts: NDArray[np.void]) -> Floats:
        """Return the energy loss of each impact of a response."""
        left, entered = self.sides_at(impacts)
        return self.kinetic(impacts["speed_before"], left) - self.kinetic(impacts["speed_after"], entered)


def linear_balance(body: Block | RestrainedBlock) -> Floats:
    """Return the rotation of the unstable balance on each side in the linear model, rad; infinite if there is none.

    A yielding tendon yields for the first time: with the smaller of elastic force and strength, so at the nearer
    balance.
    """
    (made,) = body.alone().kernel_records("linear", np.zeros((1, 2)))
    elastic = _balance_on_a_line(made, made["added_weight"], made["added_push"], made["prestress"])
    if not made["yielding"]:
        return elastic
    pull = made["base_prestress"] + made["tendon_stiffness"] * (made["yield_elongation"] - made["slack_elongation"])
    return np.minimum(elastic, _balance_on_a_line(made, made["base_weight"], made["base_push"], pull))


def _balance_on_a_line(made: Record, added_weight: Floats, added_push: Floats, prestress: Floats) -> Floats:
    """Return the rotation without restoring moment, if the moment is linear in the rotation."""
    found, weight = np.full(2, math.inf), 1.0 + added_weight
    falls = made["stiffness"] * weight - made["spring"]
    stands = made["threshold_slope"] * (made["threshold"] * weight + added_push) + prestress
    np.divide(stands, falls, out=found, where=falls > 0.0)
    return found


def energy_of(body: Body, record: Record, *, nonlinear: bool) -> Energy:
    """Return the energy of a block; raise `InvalidOption` for a yielding tendon or a missing balance."""
    if not isinstance(body, Block | RestrainedBlock):
        raise InvalidOption(
            f"the energy that overturns a body is known of blocks alone, not of a {type(body).__name__}"
        )
    if record["yielding"]:
        raise InvalidOption("a tendon that yields keeps no energy: leave the strength of the tendon out to see it")
    found = Energy(body, record, nonlinear)
    if not np.any(np.isfinite(found.balance)):
        raise InvalidOption("no energy overturns this block: its restraints hold it back at any rotation")
    return found
