"""Data of a simulation and the results derived from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block import RestrainedBlock
from rocking.block.body import Body
from rocking.core.arrays import Floats, unwrap_scalar
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.kernels import state
from rocking.motion.motion import Motion
from rocking.response.history import Solution, TimeHistory, add_all_impacts
from rocking.response.mechanics import (
    ContactForces,
    EnergyModel,
    check_available_friction,
    compute_friction_demand,
    compute_linear_balance,
    compute_pull,
    create_energy,
)
from rocking.response.perturbed import (
    FACTOR_COUNT,
    OVERTURNS,
    RELATIVE_STEP,
    STANDS,
    UNMOVED,
    PerturbedSimulations,
    Repeat,
    list_checked_factors,
)
from rocking.response.sensitivity import (
    NEAR_TIE,
    Sensitivity,
    bound_rest_errors,
    find_ambiguities,
    find_slip_ambiguities,
    require_sticking,
)


@dataclass(frozen=True, eq=False, repr=False)
class ResponseData(Result):
    """Data and computed results of a response. `Response` adds the output methods."""

    block: Body
    motion: Motion | None
    model: Model
    chattering: ChatteringScheme
    friction: tuple[float, float] | None
    overturned: bool
    unfinished: bool
    leans: bool
    lost_contact: bool
    largest_slip: float
    overturn_time: float
    peak_rotation: float
    peak_time: float
    duration: float
    events: NDArray[np.void]
    impacts: NDArray[np.void]
    rests_by_rounding: int
    rounding_decisions: int
    solution: Solution

    def __getstate__(self) -> dict[str, Any]:
        """Return only the data. Derived results are computed again."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    @cached_property
    def _history(self) -> TimeHistory:
        """Time history, including the impacts after the proof of a sequence."""
        trail, sequences = self.solution.trail, self.solution.sequences
        if int(trail.settings["rest_rule"]) == state.RestRule.CERTIFIED:
            is_open = bool(len(sequences)) and bool(sequences["end"][-1] >= self.duration) and self.moves_at_end
            trail = add_all_impacts(trail, ends_in_sequence=is_open)
        return TimeHistory(trail, self.duration, self.block.stops)

    @cached_property
    def _energy(self) -> EnergyModel:
        trail = self.solution.trail
        return create_energy(self.block, trail.block, nonlinear=bool(trail.settings["nonlinear"]))

    @cached_property
    def _contact(self) -> ContactForces:
        law = self.block.contact_law
        if law is None:
            raise OptionError(f"the ground forces of this body are unknown: {self.block.description}")
        return ContactForces(self._history, law, self.duration if math.isnan(self.tipping_time) else self.tipping_time)

    @property
    def slips(self) -> bool:
        """Whether the base slips at any time."""
        return bool(np.any(self.solution.trail.nodes["direction"] != 0))

    @cached_property
    def sequences(self) -> NDArray[np.void]:
        """Sequences of impacts that ended at rest: see `Response`."""
        sequences = self.solution.sequences.copy()
        if self.slips:  # without the effect of rounding before the proof
            return sequences
        largest_stop = max(map(abs, self.block.stops))
        errors = bound_rest_errors(self.solution.trail, np.isfinite(sequences["lower"]), largest_stop)
        sequences["lower"] -= errors
        sequences["upper"] += errors
        return sequences

    @cached_property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side in this model, rad; infinite if there is none.

        For a free block it equals the slenderness in both models.
        """
        if isinstance(self.block, RestrainedBlock) and self.model == "linear":
            plus, minus = compute_linear_balance(self.block).tolist()
            return plus, minus
        return self.block.balance

    @cached_property
    def peak_over_slenderness(self) -> float:
        """Ratio of the peak rotation to the slenderness of its side; infinite if the block overturns.

        For a restrained block the balance replaces the slenderness; NaN if there is none.
        """
        if self.overturned:
            return math.inf
        return self.peak_rotation / self._balance_at_peak if math.isfinite(self._balance_at_peak) else math.nan

    @cached_property
    def _balance_at_peak(self) -> float:
        """Balance on the side of the peak, rad, or the smaller one if the block does not move."""
        if self.peak_rotation == 0.0:
            return min(self.balance)
        return self.balance[0 if float(self.rotation(self.peak_time)) > 0.0 else 1]

    @property
    def _reaches_second_stop(self) -> bool:
        """Whether the peak is at the second of two stops."""
        return bool(self.solution.trail.block["two_stops"]) and self.peak_rotation == self.block.stops[1]

    @cached_property
    def tendons(self) -> NDArray[np.void]:
        """Largest elongation and force of each tendon: see `Response`."""
        rows = []
        if isinstance(self.block, RestrainedBlock):
            plus, minus = self._history.find_peaks()
            if self.overturned:  # the last step ends at the peak
                side = int(self.solution.trail.nodes["side"][-1])
                plus, minus = (self.peak_rotation, minus) if side == 0 else (plus, self.peak_rotation)
            rows = self.block.compute_tendon_extremes((plus, minus), self.model)
        return np.array(rows, dtype=[("elongation", "f8"), ("force", "f8"), ("plastic_elongation", "f8")])

    @property
    def moves_at_end(self) -> bool:
        """Whether the block is not at rest at the end of the response."""
        last = self.solution.trail.nodes[-1]
        return bool(last["side"] >= 0 or last["direction"] != 0)

    @property
    def moved(self) -> bool:
        """Whether the body moves at any time."""
        nodes = self.solution.trail.nodes
        return bool(np.any((nodes["side"] >= 0) | (nodes["direction"] != 0)))

    @property
    def outcome(self) -> str:
        """Outcome as a verb: "overturns", "stands", "leans", "does not move".

        Further outcomes are "comes to rest" (for a body that cannot overturn), "has not overturned" (`ended_early`) and
        "is given up" (`unfinished`).
        """
        if self.overturned:
            return OVERTURNS
        if self.unfinished:
            return "is given up"
        if self.lost_contact:
            return "loses contact"
        if self.ended_early:
            return "has not overturned"
        if self.leans:
            return "leans"
        if not self.moved:
            return UNMOVED
        return STANDS if self.block.coordinate.limit_name else "comes to rest"

    @property
    def residual_rotation(self) -> float:
        """Final rotation, rad: 0 at rest in upright position, the equilibrium of a block that `leans`.

        NaN if the block overturns or its final state is unknown. For other bodies the coordinate.
        """
        is_unknown = self.overturned or self.unfinished or self.ended_early or self.lost_contact
        return math.nan if is_unknown else self.solution.residual

    @property
    def ended_early(self) -> bool:
        """Whether `duration` ended the simulation while the block or the ground still moved."""
        motion_ended = self.motion is None or self.duration >= self.motion.end
        is_decided = self.overturned or self.unfinished or self.leans or self.lost_contact
        return not is_decided and (self.moves_at_end or not motion_ended)

    @cached_property
    def tipping_time(self) -> float:
        """Last time, s, at which the block passes its `balance`; NaN if it ends within it.

        After this time an overturning block only falls.
        """
        return self._history.compute_tipping_time(self.balance)

    @property
    def rest_intervals(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        return self._history.find_rests()

    @property
    def time_at_rest(self) -> float:
        """Total time at rest, s."""
        starts, ends = self.rest_intervals.T
        return float(np.sum(ends - starts))

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Derivatives of the peak and of event and impact times by the motion, the initial state and the block.

        Raises `OptionError` for a response that slips.
        """
        require_sticking(self.slips)
        trail, history = self.solution.trail, self._history
        if int(trail.block["seed"]) >= 0 and trail.block["variable_restitution"]:
            # Random restitutions depend on the number of the impact, which excludes the impacts after a proof.
            history = TimeHistory(trail, self.duration, self.block.stops)
        sizes, is_fixed = (len(self.impacts), len(self.events)), self.overturned or self._reaches_second_stop
        return Sensitivity(trail, history, self.peak_time, sizes, is_fixed=is_fixed, is_known=not self.unfinished)

    @property
    def ambiguous(self) -> bool:
        """Whether a change of the input by one ulp, i.e. rounding in double precision, changes the response visibly."""
        return bool(self.ambiguities)

    @cached_property
    def ambiguities(self) -> tuple[str, ...]:
        """Results that one ulp of the input changes visibly: "peak", "events" (time of an event or impact), "touch".

        "touch" means that rounding determines whether the motion exceeds an uplift threshold, whether the body touches
        the ground, or whether it falls from its balance. `perturbed` returns the spread of such results.
        """
        if self.slips:
            repeats = [self._repeat(1.0 + change) for change in (-NEAR_TIE, 0.0, NEAR_TIE)]
            return find_slip_ambiguities(repeats, self.rounding_decisions)
        start, velocity, acceleration = self.states(0.0)
        balanced = velocity == acceleration == 0.0 and bool(np.any(np.isclose(abs(start), self.balance)))
        height = abs(self.peak_rotation - self.block.stops[0])
        return find_ambiguities(self.sensitivity, self.solution.trail, height, self.rounding_decisions + balanced)

    def perturbed(self, relative_step: float = RELATIVE_STEP, count: int = FACTOR_COUNT) -> PerturbedSimulations:
        """Repeat the simulation with the motion scaled by factors near 1.

        Parameters
        ----------
        relative_step : float
            Relative step of the factors, from 1e-12 to 0.1.
        count : int
            Number of factors, odd and at least 3: 1, 1 +- step, 1 +- 3 step, 1 +- 5 step, and so on.

        Returns
        -------
        PerturbedSimulations
            Outcome, peak and times for each factor, and their ranges.

        Notes
        -----
        An initial rotation (for a body with a stop, its distance from the stop) and velocity are scaled with the
        motion, or alone without a motion. An outcome that changes within a few millionths is undecided in practice. An
        outcome shared by all simulations may still change between their factors.
        """
        if (relative_step, count) not in self._perturbations:
            repeats = tuple(self._repeat(factor) for factor in list_checked_factors(relative_step, count))
            scaled_input = "initial states" if self.motion is None else "motions"
            self._perturbations[relative_step, count] = PerturbedSimulations(
                float(relative_step), repeats, self.block.coordinate, scaled_input
            )
        return self._perturbations[relative_step, count]

    @cached_property
    def _perturbations(self) -> dict[tuple[float, int], PerturbedSimulations]:
        return {}

    def _repeat(self, factor: float) -> Repeat:
        try:
            repeated: ResponseData = self if factor == 1.0 else self.solution.repeat(factor)
        except OptionError:  # balanced: `simulate` requires a duration
            return Repeat(factor, "balances", math.nan, math.nan, math.nan, math.nan, self.events[:0])
        rests = repeated.events["time"][repeated.events["kind"] == "rest"]
        last_rest = float(rests[-1]) if len(rests) and not repeated.moves_at_end else math.nan
        peak, peak_time = repeated.peak_rotation, repeated.peak_time
        return Repeat(factor, repeated.outcome, peak, peak_time, repeated.overturn_time, last_rest, repeated.events)

    def states(self, time: ArrayLike) -> Floats:
        """Return coordinate, velocity and acceleration of the body (rotation for a block) at times, s, of any shape.

        They are the last dimension, of length 3; NaN outside [0, duration]. Raises `OptionError` if `time` is not
        numeric.
        """
        return self._history.states(time)

    def rotation(self, time: ArrayLike) -> Floats:
        """Return the rotation theta, rad, at any time, from the series of the arc; NaN outside [0, duration]."""
        return unwrap_scalar(self.states(time)[..., 0])

    def angular_velocity(self, time: ArrayLike) -> Floats:
        """Return the angular velocity, rad/s, at any time (at an impact, just after it); NaN outside [0, duration]."""
        return unwrap_scalar(self.states(time)[..., 1])

    def angular_acceleration(self, time: ArrayLike) -> Floats:
        """Return the angular acceleration, rad/s^2, at any time; NaN outside [0, duration]."""
        return unwrap_scalar(self.states(time)[..., 2])

    def slip(self, time: ArrayLike) -> Floats:
        """Return the displacement of the base relative to the ground, m, at any time; NaN outside [0, duration].

        It is the displacement of the pivot in contact, positive to side + and zero at the start.
        """
        return unwrap_scalar(self._history.slip_states(time, self.block.gravity)[..., 0])

    def slip_velocity(self, time: ArrayLike) -> Floats:
        """Return the rate of `slip`, m/s, at any time (at an impact, just after it); NaN outside [0, duration]."""
        return unwrap_scalar(self._history.slip_states(time, self.block.gravity)[..., 1])

    @property
    def residual_slip(self) -> float:
        """Displacement of the base relative to the ground at the end of the response, m."""
        return float(self.slip(self.duration))

    def kinetic_energy(self, time: ArrayLike) -> Floats:
        """Return the kinetic energy divided by the overturning energy, at any time (at an impact, just after it).

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.

        Returns
        -------
        ndarray
            Energy relative to the smallest energy that moves the block without ground motion from rest to an unstable
            balance, m g R (1 - cos alpha) for a free block (m g R alpha^2/2 in the linear model). NaN outside [0,
            duration]. Velocities are relative to the ground.

        Raises
        ------
        OptionError
            If `time` is not numeric, the body is not a block, one of its tendons yields, or its restraints hold it at
            any rotation.
        """
        states, sides = self._history.compute_states_and_sides(time)
        return unwrap_scalar(self._energy.kinetic(states[..., 1], sides))

    def potential_energy(self, time: ArrayLike) -> Floats:
        """Return the potential energy of weight and restraints, zero upright, in the unit of `kinetic_energy`.

        The result is NaN outside [0, duration]. Between impacts the sum of both energies is constant without ground
        motion and damping. Arguments and errors are the same as of `kinetic_energy`.
        """
        states, sides = self._history.compute_states_and_sides(time)
        return unwrap_scalar(self._energy.potential(states[..., 0], sides))

    @cached_property
    def impact_losses(self) -> Floats:
        """Energy loss at each of `impacts`, divided by the overturning energy, as `kinetic_energy`."""
        return self._energy.compute_losses(self.impacts)

    def normal_force(self, time: ArrayLike) -> Floats:
        """Return the ratio of normal force to weight, without the impulses of impacts; NaN outside the response."""
        return unwrap_scalar(self._contact.compute_forces(time)[1])

    def friction_demand(self, time: ArrayLike) -> Floats:
        """Return the friction coefficient for sticking: infinite without normal force, NaN outside the response."""
        return unwrap_scalar(compute_friction_demand(*self._contact.compute_forces(time)))

    @cached_property
    def _extremes(self) -> tuple[float, float]:
        return self._contact.compute_extremes()

    @property
    def required_friction(self) -> float:
        """Largest friction coefficient required to stick, between impacts and until `tipping_time`.

        Infinite if the normal force does not stay positive.
        """
        return self._extremes[0]

    @property
    def minimum_normal_force(self) -> float:
        """Smallest ratio of normal force to weight, between impacts and until `tipping_time`."""
        return self._extremes[1]

    def sliding_time(self, available_friction: float) -> float:
        """Return the first time, s, at which sticking requires more than the available friction; NaN if never.

        The coefficient is positive and at most 3. The search excludes impulses at impacts and ends at `tipping_time`.
        Motion after a slip is not modelled.
        """
        level = check_available_friction(available_friction)
        if not self.required_friction > level:
            return math.nan

        def compute_excess(push: Floats, normal: Floats) -> Floats:
            return np.abs(push) - level * normal

        return self._contact.find_first_time(compute_excess, lambda excess: excess > 0.0)

    @cached_property
    def lift_off_time(self) -> float:
        """First time, s, at which the normal force is not positive, so that the base leaves the ground; NaN if never.

        The search is limited as for `sliding_time`.
        """
        if self.minimum_normal_force > 0.0:
            return math.nan
        return self._contact.find_first_time(compute_pull, lambda pulled: pulled >= 0.0)
