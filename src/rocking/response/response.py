"""The response of one body to one motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block import Block, RestrainedBlock
from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats, as_asked
from rocking.core.constants import Model
from rocking.core.result import Result, Row, dictionary_of, text_of
from rocking.core.tables import Column, frame_of, write_csv, write_netcdf
from rocking.engine.treatment import Treatment
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.motion.motion import Motion
from rocking.plot.response import RotationUnits
from rocking.response import figure, history, summary, tables
from rocking.response.contact import Contact, friction_coefficient, friction_demand, pull
from rocking.response.energy import Energy, energy_of, linear_balance
from rocking.response.history import History, with_all_impacts
from rocking.response.perturbed import COUNT, OVERTURNS, PRECISION, RELATIVE, STANDS, UNMOVED, Perturbed, Repeat
from rocking.response.perturbed import repeated as repeated_with
from rocking.response.sensitivity import Sensitivity, ambiguities, carried_errors

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Letters of the column of names in a summary.
_WIDTH = 20


@dataclass(frozen=True, eq=False, repr=False)
class Response(Result):
    """Response of one body to one motion, made by `rocking.simulate`.

    Attributes
    ----------
    body, motion, model, treatment
        What was simulated, and how.
    overturned : bool
        Whether the rotation reached pi/2.
    unfinished : bool
        Whether the simulation was given up after too many steps; all else is then as far as it came.
    leans : bool
        Whether restraints hold it leaning for ever, about `residual_rotation`: proven at the end, `duration`. It may
        still oscillate then, and never reaches zero rotation again nor more than the peak.
    overturn_time : float
        When it first did, s; NaN otherwise.
    peak_rotation, peak_time : float
        Largest |theta|, rad, and when, s; pi/2 when overturned. Of another body its coordinate.
    duration : float
        End of the response, s; of one that leans when that was proven.
    events : structured array
        time (s), kind ("uplift", "rest", "overturn"), side (+1, -1; 0 at rest).
    impacts : structured array
        time (s), side entered, speed_before and speed_after (rad/s), in order of time; of a chattering sequence those
        that were resolved before its rest was closed.
    chattering : structured array
        One row for each sequence of impacts that ended at rest: start (time of the impact from which it was proven to
        be complete), end (time of rest), lower and upper bound on the end, number of impacts resolved since the start.
        The bounds contain the time of rest that follows exactly from the body, the motion and the start as they are
        given: what rounding may have changed before the proof is part of them. They are NaN if the rest is not proven,
        and infinite if it is, but rounding may move it as far as the response is from its balance or a touch.
    tendons : structured array
        One row for each tendon of a restrained block: largest elongation (m) and force (N), and the plastic_elongation
        (m) that a tendon which yields has at the end.
    stalled : int
        Sequences that ended because time no longer advanced between impacts, without proof.
    near_ties : int
        Times that the last digits decided whether a block touches the ground, or to which side it leaves it where
        nothing weighs it down.
    solution : Solution
        What the integration returned, for the methods of the response.
    """

    TABLES = ("histories", "events", "impacts", "chattering")

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
    stalled: int
    near_ties: int
    solution: history.Solution

    def __getstate__(self) -> dict[str, Any]:
        """Return the data alone: answers are found again."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    @property
    def block(self) -> Block:
        """The body; raises `InvalidOption` if it is no block."""
        if not isinstance(self.body, Block):
            raise InvalidOption(f"this is known of blocks alone, not of a {type(self.body).__name__}")
        return self.body

    @cached_property
    def _history(self) -> History:
        """Course in time, with the impacts that follow where a proof has closed a sequence."""
        trail, sequences = self.solution.trail, self.solution.sequences
        if int(trail.settings["treatment"]) == state.RestRule.CERTIFIED:
            closed = bool(len(sequences)) and bool(sequences["end"][-1] >= self.duration)
            trail = with_all_impacts(trail, cut=closed and self.moves_at_end)
        return History(trail, self.duration, self.body.stops)

    @cached_property
    def _energy(self) -> Energy:
        trail = self.solution.trail
        return energy_of(self.body, trail.block, nonlinear=bool(trail.settings["nonlinear"]))

    @cached_property
    def _contact(self) -> Contact:
        law = self.body.contact
        if law is None:
            raise InvalidOption(f"the forces of the ground are not known of this body: {self.body.description}")
        return Contact(self._history, law, self.duration if math.isnan(self.tipping_time) else self.tipping_time)

    @cached_property
    def chattering(self) -> NDArray[np.void]:
        """Sequences of impacts that ended at rest: see `Response`."""
        found = self.solution.sequences.copy()
        error = carried_errors(self.solution.trail, np.isfinite(found["lower"]), max(map(abs, self.body.stops)))
        found["lower"] -= error
        found["upper"] += error
        return found

    @cached_property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side in this model, rad; infinite without one.

        Of a free block it is the slenderness in both models.
        """
        if isinstance(self.body, RestrainedBlock) and self.model == "linear":
            plus, minus = linear_balance(self.body).tolist()
            return plus, minus
        return self.body.balance

    @cached_property
    def peak_over_slenderness(self) -> float:
        """Peak rotation over the slenderness of its side; infinite where the block overturns.

        Of a restrained block over its balance; NaN where there is none.
        """
        if self.overturned:
            return math.inf
        return self.peak_rotation / self._balance_at_peak if math.isfinite(self._balance_at_peak) else math.nan

    @cached_property
    def _balance_at_peak(self) -> float:
        """Balance on the side of the peak, rad; of a block that does not move the nearer one."""
        if self.peak_rotation == 0.0:
            return min(self.balance)
        return self.balance[0 if float(self.rotation(self.peak_time)) > 0.0 else 1]

    @property
    def _reaches_second_stop(self) -> bool:
        """Whether the peak is where the second of two stops is."""
        return bool(self.solution.trail.block["two_stops"]) and self.peak_rotation == self.body.stops[1]

    @cached_property
    def tendons(self) -> NDArray[np.void]:
        """Largest elongation and force of each tendon: see `Response`."""
        rows = []
        if isinstance(self.body, RestrainedBlock):
            plus, minus = self._history.largest()
            if self.overturned:  # the last step ends there
                side = int(self.solution.trail.nodes["side"][-1])
                plus, minus = (self.peak_rotation, minus) if side == 0 else (plus, self.peak_rotation)
            rows = self.body.tendons_at((plus, minus), self.model)
        return np.array(rows, dtype=[("elongation", "f8"), ("force", "f8"), ("plastic_elongation", "f8")])

    @property
    def moves_at_end(self) -> bool:
        """Whether the block is not at rest at the end of the response."""
        return bool(self.solution.trail.nodes["side"][-1] >= 0)

    @property
    def moved(self) -> bool:
        """Whether the body moves at any time."""
        return bool(np.any(self.solution.trail.nodes["side"] >= 0))

    @property
    def outcome(self) -> str:
        """What becomes of the body, as a verb: "overturns", "stands", "leans", "does not move".

        Also "comes to rest" (of a body that cannot overturn), "has not overturned" (`stopped`) and "is given up"
        (`unfinished`).
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
        return math.nan if self.overturned or self.unfinished or self.stopped else self.solution.residual

    @property
    def stopped(self) -> bool:
        """Whether `duration` ended the simulation before a verdict: the block still moved, or the motion went on."""
        over = self.motion is None or self.duration >= self.motion.end
        return not (self.overturned or self.unfinished or self.leans) and (self.moves_at_end or not over)

    @cached_property
    def tipping_time(self) -> float:
        """Last time, s, at which the block passes its `balance`; NaN if it ends within it.

        From then on a block that overturns only falls.
        """
        return self._history.tipping_time(self.balance)

    @property
    def rest_intervals(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        return self._history.rests()

    @property
    def time_at_rest(self) -> float:
        """Time that the block spends at rest, s."""
        starts, ends = self.rest_intervals.T
        return float(np.sum(ends - starts))

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Derivatives of the peak and of the times of events and impacts by the motion, the start and the block."""
        return Sensitivity(self)

    @property
    def ambiguous(self) -> bool:
        """Whether no double-precision program can know this response: one ulp of what was given changes it visibly."""
        return bool(self.ambiguities)

    @cached_property
    def ambiguities(self) -> tuple[str, ...]:
        """What one ulp of the input changes visibly: "peak", "events" (a time of one, or of an impact) and "touch".

        With the last, rounding decides whether the motion passes a threshold of uplift, whether the body touches the
        ground, or whether it falls from its balance. `perturbed` has the spread of such results.
        """
        start, velocity, acceleration = self.states(0.0)
        balanced = velocity == acceleration == 0.0 and bool(np.any(np.isclose(abs(start), self.balance)))
        height = abs(self.peak_rotation - self.body.stops[0])
        return ambiguities(self.sensitivity, self.solution.trail, height, self.near_ties + balanced)

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

        Notes
        -----
        An initial rotation (of a body with a stop its distance from the stop) and velocity are scaled with the motion,
        or alone where there is no motion. An outcome that changes within a few millionths is undecided for every
        practical purpose; one that is the same in a few simulations may still change between them.
        """
        if (relative, count) not in self._repeated:
            scaled = "initial states" if self.motion is None else "motions"
            self._repeated[relative, count] = repeated_with(
                self._as_repeat(1.0), self._repeat, relative, count, self.body.coordinate, scaled
            )
        return self._repeated[relative, count]

    @cached_property
    def _repeated(self) -> dict[tuple[float, int], Perturbed]:
        return {}

    def _repeat(self, factor: float) -> Repeat:
        try:
            again: Response = self.solution.again(factor)
            return again._as_repeat(factor)
        except InvalidOption:  # a state of balance: `simulate` requires a duration
            return Repeat(factor, "balances", math.nan, math.nan, math.nan, math.nan, self.events[:0])

    def _as_repeat(self, factor: float) -> Repeat:
        rests = self.events["time"][self.events["kind"] == "rest"]
        last_rest = float(rests[-1]) if len(rests) and not self.moves_at_end else math.nan
        return Repeat(
            factor, self.outcome, self.peak_rotation, self.peak_time, self.overturn_time, last_rest, self.events
        )

    def states(self, time: ArrayLike) -> Floats:
        """Return coordinate, velocity and acceleration of the body (of a block its rotation) at times, s, of any shape.

        They are the last dimension, of length 3; NaN at times outside [0, duration]. `InvalidOption` if `time` contains
        anything but numbers.
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
            where that is less, m g R (1 - cos alpha) of a free block (m g R alpha^2/2 in the linear model); NaN outside
            [0, duration]. Velocities are relative to the ground.

        Raises
        ------
        InvalidOption
            If `time` contains anything but numbers, the body is no block, one of its tendons yields, or its restraints
            hold it back at any rotation.
        """
        states, sides = self._history.states_and_sides(time)
        return as_asked(self._energy.kinetic(states[..., 1], sides))

    def potential_energy(self, time: ArrayLike) -> Floats:
        """Potential energy of weight and restraints, zero upright, in the unit of `kinetic_energy`; NaN outside.

        Between impacts the sum of both stays the same where nothing shakes or damps the block. Arguments and errors are
        those of `kinetic_energy`.
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
        """Friction coefficient that sticking needs: infinite without normal force, NaN outside the response."""
        return as_asked(friction_demand(*self._contact.forces(time)))

    @cached_property
    def _extremes(self) -> tuple[float, float]:
        return self._contact.extremes()

    @property
    def required_friction(self) -> float:
        """Largest friction coefficient that sticking needs, between impacts and until `tipping_time`.

        Infinite if the normal force does not stay positive.
        """
        return self._extremes[0]

    @property
    def minimum_normal_force(self) -> float:
        """Smallest normal force over the weight, between impacts and until `tipping_time`."""
        return self._extremes[1]

    def sliding_time(self, friction: float) -> float:
        """Return the first time, s, at which sticking needs more than a friction coefficient; NaN if it never does.

        The coefficient is positive and at most 3. The time is before the block tips (`tipping_time`), without the
        impulses at impacts. What happens after a slip is not part of the model.
        """
        level = friction_coefficient(friction)
        if not self.required_friction > level:
            return math.nan
        return self._contact.first(lambda push, normal: np.abs(push) - level * normal, lambda excess: excess > 0.0)

    @cached_property
    def lift_off_time(self) -> float:
        """First time, s, at which the normal force is not positive, so that the base leaves the ground; NaN if never.

        As for `sliding_time`, until the block tips and between impacts.
        """
        if self.minimum_normal_force > 0.0:
            return math.nan
        return self._contact.first(pull, lambda pulled: pulled >= 0.0)

    def _headline(self) -> str:
        return summary.line(self)

    def summary_rows(self, friction: float | None = None, *, precision: float = PRECISION) -> Sequence[Row]:
        """Return the lines of `summary` as rows of name, value, unit and note; arguments as there."""
        return summary.summary_rows(self, friction, precision)

    def facts(self, friction: float | None = None, *, precision: float = PRECISION) -> Sequence[Row]:
        """Return the entries of `to_dict` as rows of name, value and unit; arguments as of `summary`."""
        return tables.facts(self, friction, precision)

    def summary(self, friction: float | None = None, *, precision: float = PRECISION) -> str:
        """Return what happened in words, line by line, as ``rocking simulate`` prints it.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction: says whether the block would slide, and when first.
        precision : float
            Relative precision of the ground motion, from 1e-6 to 0.1: the outcome is also counted within it.

        Notes
        -----
        Times and the peak have the digits that are the same in five simulations with the motion (without one, the
        initial state) scaled by 1, 1 +- 1e-6 and 1 +- 3e-6, at most nine decimals and six digits; where these differ
        by a millisecond, or in the third digit of the peak, their range is given. See `Response.perturbed`.
        """
        return text_of(self.summary_rows(friction, precision=precision), _WIDTH)

    def to_dict(self, friction: float | None = None, *, precision: float = PRECISION) -> dict[str, Any]:
        """Return the result in plain values, as ``rocking simulate --json`` prints it; arguments as of `summary`.

        Units are in the names; None stands for what is not a finite number.
        """
        return dictionary_of(self.facts(friction, precision=precision))

    def to_xarray(self, dt: float | None = None) -> xr.Dataset:
        """Return time histories and events as a dataset; its ``to_dataframe`` multiplies all dimensions.

        Rotation, angular velocity and ground acceleration are over time, at steps `dt` (s; by default the motion's own,
        or a two-thousandth of the duration); events, impacts and chattering sequences have a dimension each. The block
        and the verdict are attributes.
        """
        return tables.dataset(self, dt)

    def _columns(self, table: str, dt: float | None = None) -> list[Column]:
        return tables.columns(self, checks.one_of(table, "table", InvalidOption, self.TABLES), dt)

    def to_dataframe(self, table: str | None = None, *, dt: float | None = None) -> pd.DataFrame:
        """Return a table as a data frame: "histories", "events", "impacts" or "chattering"; units are in the names.

        Histories are rotation, angular velocity and ground acceleration over ``time_s``, at steps `dt` as of
        `to_xarray`.
        """
        frame = frame_of(self._columns(table or "histories", dt))
        return frame.set_index("time_s") if table in (None, "histories") else frame

    def to_netcdf(self, path: str | Path, dt: float | None = None) -> None:
        """Write `to_xarray` to a NetCDF file, whole or not at all; raises `OutputError` if it cannot be written."""
        write_netcdf(path, self.to_xarray(dt))

    def to_csv(self, path: str | Path, table: str | None = None, *, dt: float | None = None) -> None:
        """Write a table of `to_dataframe` as text columns with a header, as `Result.to_csv`."""
        write_csv(path, frame_of(self._columns(table or "histories", dt)))

    def plot(
        self,
        ax: Axes | None = None,
        *,
        units: RotationUnits = "slenderness",
        window: tuple[float, float] | None = None,
        longest_sequence: bool = False,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw the rotation with impacts and rests, and the motion with thresholds, as `Result.plot`.

        Parameters
        ----------
        ax, title, figsize
            As of `Result.plot`.
        units : {"slenderness", "rad", "deg"}
            Rotations over the slenderness of their side (of a restrained block over its balance, if it has one), or as
            they are.
        window : (start, end), optional
            Stretch of time, s; by default from a little before the first event to a little after the last.
        longest_sequence : bool
            Whether to show the longest chattering sequence, impact by impact, in a panel of its own.
        """
        title = title or figure.titled(self)
        return figure.histories(
            self, units, window, longest_sequence=longest_sequence, title=title, ax=ax, figsize=figsize
        )

    def plot_phase_plane(
        self,
        ax: Axes | None = None,
        *,
        window: tuple[float, float] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw the velocity against the rotation, with impacts as jumps and the energy of the balance; as `plot`.

        Rotations are over the slenderness of their side (of a restrained block over its balance), velocities over p
        times that; where a side has no balance, rotations are in rad. `InvalidOption` also as of `kinetic_energy`.
        """
        return figure.phase_plane(self, window, title=title or figure.titled(self), ax=ax, figsize=figsize)

    def plot_energy(
        self,
        ax: Axes | None = None,
        *,
        window: tuple[float, float] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw kinetic, potential and total energy over time, as `plot_phase_plane` and in its units."""
        return figure.energies(self, window, title=title or figure.titled(self), ax=ax, figsize=figsize)
