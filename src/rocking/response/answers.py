"""What was simulated, what the march found, and short answers from it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.arrays import Floats, as_asked
from rocking.block import Block, RestrainedBlock
from rocking.body import Body
from rocking.constants import Model
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.trace import Trail
from rocking.motion.motion import Motion
from rocking.response.contact import Contact, friction_coefficient, friction_demand, pull
from rocking.response.energy import Energy, energy_of, linear_balance
from rocking.response.history import History, with_all_impacts
from rocking.response.perturbed import COUNT, OVERTURNS, RELATIVE, STANDS, UNMOVED, Perturbed, Repeat, repeated
from rocking.response.sensitivity import Sensitivity, ambiguities, carried_errors
from rocking.treatment import Treatment


@dataclass(frozen=True, eq=False, repr=False)
class Answers:
    """Data of a response and answers that follow from them; `Response` is the public class and lists them."""

    body: Body
    motion: Motion | None
    model: Model
    treatment: Treatment
    overturned: bool
    unfinished: bool
    leans: bool
    overturn_time: float
    peak_rotation: float
    peak_time: float
    duration: float
    events: NDArray[np.void]
    impacts: NDArray[np.void]
    _sequences: NDArray[np.void]
    stalled: int
    near_ties: int
    _residual: float
    _trail: Trail
    _again: Callable[[float], Answers]

    @property
    def block(self) -> Block:
        """The body, for what only blocks can answer.

        Raises
        ------
        InvalidOption
            If it is of another kind.
        """
        if not isinstance(self.body, Block):
            raise InvalidOption(f"this is known of blocks alone, not of a {type(self.body).__name__}")
        return self.body

    @cached_property
    def _history(self) -> History:
        """Its course, with the impacts that follow where a proof has closed a sequence."""
        if int(self._trail.settings["treatment"]) != state.RestRule.CERTIFIED:
            return History(self._trail, self.duration, self.body.stops)
        closed = bool(len(self._sequences)) and bool(self._sequences["end"][-1] >= self.duration)
        trail = with_all_impacts(self._trail, cut=closed and self.moves_at_end)
        return History(trail, self.duration, self.body.stops)

    @cached_property
    def chattering(self) -> NDArray[np.void]:
        """Sequences of impacts that ended at rest, a row for each: see `Response`."""
        found = self._sequences.copy()
        error = carried_errors(self._trail, np.isfinite(found["lower"]), max(map(abs, self.body.stops)))
        found["lower"] -= error
        found["upper"] += error
        return found

    @cached_property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side, rad, in the model of this response; infinite without one.

        Of a free block it is the slenderness in both models.
        """
        if isinstance(self.body, RestrainedBlock) and not self._trail.settings["nonlinear"]:
            plus, minus = linear_balance(self.body).tolist()
            return plus, minus
        return self.body.balance

    @cached_property
    def peak_over_slenderness(self) -> float:
        """Peak rotation over the slenderness of the side where it is reached; infinite where the block overturns.

        Of a restrained block over its balance; NaN where there is none.
        """
        if self.overturned:
            return math.inf
        balance = self._balance_at_peak
        return self.peak_rotation / balance if math.isfinite(balance) else math.nan

    @cached_property
    def _balance_at_peak(self) -> float:
        """Rotation of the unstable balance on the side of the peak, rad; infinite without one.

        Of a block that does not move it is the nearer one.
        """
        if self.peak_rotation == 0.0:
            return min(self.balance)
        return self.balance[0 if float(self.rotation(self.peak_time)) > 0.0 else 1]

    @cached_property
    def tendons(self) -> NDArray[np.void]:
        """Largest elongation (m) and force (N), and plastic elongation (m) at the end, of each tendon of the body."""
        rows = []
        if isinstance(self.body, RestrainedBlock):
            plus, minus = self._history.largest()
            if self.overturned:  # the last step ends there
                side = int(self._trail.nodes["side"][-1])
                plus, minus = (self.peak_rotation, minus) if side == 0 else (plus, self.peak_rotation)
            rows = self.body.tendons_at((plus, minus), "nonlinear" if self._trail.settings["nonlinear"] else "linear")
        return np.array(rows, dtype=[("elongation", "f8"), ("force", "f8"), ("plastic_elongation", "f8")])

    @property
    def moves_at_end(self) -> bool:
        """Whether the block is not at rest at the end of the response."""
        return bool(self._trail.nodes["side"][-1] >= 0)

    @property
    def moved(self) -> bool:
        """Whether the body moves at any time."""
        return bool(np.any(self._trail.nodes["side"] >= 0))

    @property
    def outcome(self) -> str:
        """What becomes of the body, as a verb: "overturns", "stands", "leans", "does not move".

        Also "has not overturned" where the simulation is `stopped`, "is given up" where it is `unfinished`, and "comes
        to rest" of a body that cannot overturn.
        """
        if self.overturned:
            return OVERTURNS
        if self.unfinished:
            return "is given up"
        if self.stopped:
            return "has not overturned"
        if self.leans:
            return "leans"
        if not self.moved:
            return UNMOVED
        return STANDS if self.body.coordinate.limit else "comes to rest"

    @property
    def residual_rotation(self) -> float:
        """Rotation at which the block stays, rad: 0 where it rests upright, the equilibrium where it `leans`.

        NaN where it overturns or its end is not known. Of another body its coordinate.
        """
        return math.nan if self.overturned or self.unfinished or self.stopped else self._residual

    @property
    def stopped(self) -> bool:
        """Whether `duration` ended the simulation before a verdict: the block still moved, or the motion went on.

        What became of the block is then not known, and `overturned` says no more than "not by then".
        """
        over = self.motion is None or self.duration >= self.motion.end
        return not (self.overturned or self.unfinished or self.leans) and (self.moves_at_end or not over)

    @cached_property
    def tipping_time(self) -> float:
        """Last time, s, at which the block passes its `balance`, of a free block alpha; NaN if it ends within it.

        From then on a block that overturns only falls; one that is beyond it where the simulation was `stopped` may yet
        be caught by the motion.
        """
        return self._history.tipping_time(self.balance)

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """How the peak and the times of events and impacts change with the motion, the initial state and the block."""
        drawn = int(self._trail.block["seed"]) >= 0 and bool(self._trail.block["variable_restitution"])
        return Sensitivity(
            self._trail,
            # What is drawn goes by the number of the impact, which those beyond a proof do not count in.
            History(self._trail, self.duration, self.body.stops) if drawn else self._history,
            self.peak_time,
            (len(self.impacts), len(self.events)),
            self.overturned or self._reaches_second_stop,
            self.unfinished,
        )

    @property
    def _reaches_second_stop(self) -> bool:
        """Whether the peak is where the second of two stops is."""
        return bool(self._trail.block["two_stops"]) and self.peak_rotation == self.body.stops[1]

    @property
    def ambiguous(self) -> bool:
        """Whether no double-precision program can know this response: one ulp of what was given changes it visibly."""
        return bool(self.ambiguities)

    @cached_property
    def ambiguities(self) -> tuple[str, ...]:
        """What makes the response ambiguous: "peak", "events" (a time of one, or of an impact) and "touch".

        With the last, the last digits decide whether the motion passes a threshold of uplift, whether the body touches
        the ground, or whether it falls from its balance.

        An ambiguous response is one of those that are possible. Scale the motion, or the initial state, by 1 plus some
        millionths, simulate each, and take the spread of the results for the answer.
        """
        start, velocity, acceleration = self.states(0.0)
        balanced = velocity == acceleration == 0.0 and bool(np.any(np.isclose(abs(start), self.balance)))
        height = abs(self.peak_rotation - self.body.stops[0])
        return ambiguities(self.sensitivity, height, self.near_ties + balanced)

    def perturbed(self, relative: float = RELATIVE, count: int = COUNT) -> Perturbed:
        """Repeat the simulation with the motion scaled by factors near 1.

        Parameters
        ----------
        relative : float
            Relative step of the factors, from 1e-12 to 0.1.
        count : int
            Number of factors, odd and at least 3: 1, 1 +- relative, 1 +- 3 relative, 1 +- 5 relative, and so on.

        Returns
        -------
        Perturbed
            Outcome, peak and times for each factor, and the ranges of these.

        Raises
        ------
        InvalidOption
            If an argument is out of its range.

        Notes
        -----
        An initial rotation and velocity are scaled with the motion, or alone where there is no motion; of a body with
        a stop it is the initial distance from the stop. Ground motions are known to three digits or so, and file
        formats print four to seven. An outcome that changes within a few millionths is therefore undecided for every
        practical purpose. Conversely, an outcome that is the same in a few simulations may still change between them.

        Examples
        --------
        >>> import rocking
        >>> block, record = rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090")
        >>> found = rocking.simulate(block, record.scaled_to(0.53 * 9.80665)).perturbed()
        >>> found.overturned.tolist(), found.is_decided
        ([True, False, False, False, True], False)
        """
        if (relative, count) not in self._repeated:
            scaled = "initial states" if self.motion is None else "motions"
            self._repeated[relative, count] = repeated(
                self._as_repeat(1.0), self._repeat, relative, count, self.body.coordinate, scaled
            )
        return self._repeated[relative, count]

    def _repeat(self, factor: float) -> Repeat:
        try:
            return self._again(factor)._as_repeat(factor)
        except InvalidOption:  # a state of balance: `simulate` requires a duration
            return Repeat(factor, "balances", math.nan, math.nan, math.nan, math.nan, self.events[:0])

    def _as_repeat(self, factor: float) -> Repeat:
        rests = self.events["time"][self.events["kind"] == "rest"]
        last_rest = float(rests[-1]) if len(rests) and not self.moves_at_end else math.nan
        return Repeat(
            factor, self.outcome, self.peak_rotation, self.peak_time, self.overturn_time, last_rest, self.events
        )

    @cached_property
    def _repeated(self) -> dict[tuple[float, int], Perturbed]:
        return {}

    @property
    def time_at_rest(self) -> float:
        """Time that the block spends at rest, s."""
        starts, ends = self.rest_intervals.T
        return float(np.sum(ends - starts))

    @property
    def rest_intervals(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        return self._history.rests()

    def states(self, time: ArrayLike) -> Floats:
        """Coordinate of the body, its velocity and its acceleration at any time: of a block those of its rotation.

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.

        Returns
        -------
        ndarray
            One more dimension, of length 3, in the unit of the coordinate, over s and over s^2; NaN at times outside
            [0, duration], and where a time is NaN.

        Raises
        ------
        InvalidOption
            If `time` contains anything but numbers.
        """
        return self._history.states(time)

    def rotation(self, time: ArrayLike) -> Floats:
        """Rotation theta, rad, at any time, from the series of the arc in which it lies; NaN outside [0, duration]."""
        return as_asked(self.states(time)[..., 0])

    def angular_velocity(self, time: ArrayLike) -> Floats:
        """Angular velocity, rad/s, at any time (just after an impact, at one); NaN outside [0, duration]."""
        return as_asked(self.states(time)[..., 1])

    def angular_acceleration(self, time: ArrayLike) -> Floats:
        """Angular acceleration, rad/s^2, at any time; NaN outside [0, duration]."""
        return as_asked(self.states(time)[..., 2])

    def kinetic_energy(self, time: ArrayLike) -> Floats:
        """Kinetic energy over the least that overturns the block, at any time (just after an impact, at one).

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.

        Returns
        -------
        ndarray
            Over the energy that takes the block, without ground motion, from rest to the unstable balance of the side
            where that is less; NaN outside [0, duration]. Velocities are relative to the ground.

        Raises
        ------
        InvalidOption
            If `time` contains anything but numbers, the body is no block, one of its tendons yields, or its restraints
            hold it back at any rotation.

        Notes
        -----
        Of a free block m g R (1 - cos alpha) overturns it, or m g R alpha^2/2 in the linear model. (Derived in the
        documentation.)

        Examples
        --------
        >>> import rocking
        >>> block = rocking.Block(width=0.24, height=1.1)
        >>> response = rocking.simulate(block, None, initial_rotation=0.5 * block.alpha)
        >>> time = response.impacts["time"][0] - 1e-9
        >>> energies = [response.kinetic_energy([0.0, time]), response.potential_energy([0.0, time])]
        >>> [energy.round(6).tolist() for energy in energies]
        [[0.0, 0.749278], [0.749278, 0.0]]
        """
        states, sides = self._history.states_and_sides(time)
        return as_asked(self._energy.kinetic(states[..., 1], sides))

    def potential_energy(self, time: ArrayLike) -> Floats:
        """Potential energy of weight and restraints, zero upright, in the unit of `kinetic_energy`.

        Between impacts the sum of both stays the same where nothing shakes or damps the block.

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.

        Returns
        -------
        ndarray
            As of `kinetic_energy`.

        Raises
        ------
        InvalidOption
            As `kinetic_energy`.

        Examples
        --------
        >>> import rocking
        >>> block = rocking.Block(width=0.24, height=1.1)
        >>> response = rocking.simulate(block, rocking.pulses.one_sine(3.0, 1.0))
        >>> f"{response.potential_energy(response.tipping_time):.6f}"
        '1.000000'
        """
        states, sides = self._history.states_and_sides(time)
        return as_asked(self._energy.potential(states[..., 0], sides))

    @cached_property
    def impact_losses(self) -> Floats:
        """Energy that each of `impacts` takes, over the least that overturns the block, as `kinetic_energy`."""
        return self._energy.losses(self.impacts)

    def normal_force(self, time: ArrayLike) -> Floats:
        """Return the normal force over the weight without the impulses of impacts; NaN outside the response."""
        return as_asked(self._contact.forces(time)[1])

    def friction_demand(self, time: ArrayLike) -> Floats:
        """Friction coefficient that sticking needs at any time: infinite where the normal force is not positive.

        NaN outside [0, duration].
        """
        return as_asked(friction_demand(*self._contact.forces(time)))

    @cached_property
    def required_friction(self) -> float:
        """Largest friction coefficient that sticking needs, between impacts and until the block tips (`tipping_time`).

        Infinite if the normal force does not stay positive.
        """
        return self._extremes[0]

    @cached_property
    def minimum_normal_force(self) -> float:
        """Smallest normal force over the weight, between impacts and until the block tips (`tipping_time`)."""
        return self._extremes[1]

    @cached_property
    def _extremes(self) -> tuple[float, float]:
        return self._contact.extremes()

    def sliding_time(self, friction: float) -> float:
        """Return the first time, s, at which sticking needs more than a friction coefficient; NaN if it never does.

        Parameters
        ----------
        friction : float
            Coefficient of friction between block and ground, positive and at most 3.

        Raises
        ------
        InvalidOption
            If it is no such number.

        Notes
        -----
        Only until the block tips (`tipping_time`), and without the impulses at impacts, at which a block may slip by
        itself. What happens after a slip is not part of the model: the response goes on as if the block stuck.

        Examples
        --------
        >>> import rocking
        >>> block = rocking.Block(width=0.24, height=1.1)
        >>> response = rocking.simulate(block, rocking.records.load("ridgecrest-clc-090"))
        >>> f"{response.required_friction:.4f}, {response.sliding_time(0.24):.4f} s, {response.sliding_time(0.3)}"
        '0.2489, 234.3559 s, nan'
        """
        level = friction_coefficient(friction)
        if not self.required_friction > level:
            return math.nan
        return self._contact.first(lambda push, normal: np.abs(push) - level * normal, lambda excess: excess > 0.0)

    @cached_property
    def lift_off_time(self) -> float:
        """First time, s, at which the normal force is no longer positive, so that the base would leave the ground.

        NaN if that never happens; as for `sliding_time`, until the block tips and between impacts.
        """
        if self.minimum_normal_force > 0.0:
            return math.nan
        return self._contact.first(pull, lambda pulled: pulled >= 0.0)

    def __getstate__(self) -> dict[str, Any]:
        """Return the data alone: answers are found again."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    @cached_property
    def _energy(self) -> Energy:
        return energy_of(self.body, self._trail.block, nonlinear=bool(self._trail.settings["nonlinear"]))

    @cached_property
    def _contact(self) -> Contact:
        law = self.body.contact
        if law is None:
            raise InvalidOption(f"the forces of the ground are not known of this body: {self.body.description}")
        until = self.duration if math.isnan(self.tipping_time) else self.tipping_time
        return Contact(self._history, law, until)


def trail_of(response: Answers) -> Trail:
    """Return the steps of the march that a response was made from."""
    return response._trail


def history_of(response: Answers) -> History:
    """Return the course of a response in time."""
    return response._history


def energy_in(response: Answers) -> Energy:
    """Return what the energy of a response's body is.

    Raises
    ------
    InvalidOption
        If that is not known.
    """
    return response._energy
