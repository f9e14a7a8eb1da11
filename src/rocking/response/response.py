"""The response of one block to one motion: its state, and short answers; each longer one has a room of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import svg
from rocking.arrays import Floats, as_asked
from rocking.block import Block
from rocking.contact import friction_coefficient, friction_demand
from rocking.kernels import state, status
from rocking.kernels.trace import Trail
from rocking.motion.motion import Motion
from rocking.plot import RotationUnits
from rocking.response import data, figure, summary
from rocking.response.forces import Contact, with_all_impacts
from rocking.response.history import History
from rocking.response.sensitivity import Sensitivity
from rocking.treatment import Treatment
from rocking.treatment.base import Model

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EVENT = np.dtype([("time", "f8"), ("kind", "U8"), ("side", "i1")])
IMPACT = np.dtype([("time", "f8"), ("side", "i1"), ("speed_before", "f8"), ("speed_after", "f8")])
CHATTERING = np.dtype([("start", "f8"), ("end", "f8"), ("lower", "f8"), ("upper", "f8"), ("impacts", "i8")])

_KINDS = np.array(["uplift", "rest", "overturn"])

#: Rotations beyond this multiple of the slenderness are cut in a notebook's picture: past it a block only falls.
_HIGHEST_PICTURED = 2.0


@dataclass(frozen=True, eq=False)
class Response:
    """Response of one block to one motion, made by `rocking.simulate`.

    Attributes
    ----------
    block, motion, model, treatment
        What was simulated, and how.
    overturned : bool
        Whether the rotation reached pi/2.
    unfinished : bool
        Whether the simulation was given up after too many steps; all else is then as far as it came.
    overturn_time : float
        When it first did, s; NaN otherwise.
    peak_rotation, peak_time : float
        Largest |theta|, rad, and when, s; pi/2 when overturned.
    duration : float
        End of the response, s.
    events : structured array
        time (s), kind ("uplift", "rest", "overturn"), side (+1, -1; 0 at rest).
    impacts : structured array
        time (s), side entered, speed_before and speed_after (rad/s), in order of time; of a chattering sequence those
        that were resolved before its rest was closed.
    chattering : structured array
        One row for each sequence of impacts that ended at rest: start (time of the impact from which it was proven to
        be complete), end (time of rest), lower and upper bound on the end (NaN if not proven), number of impacts
        resolved since the start.
    stalled : int
        Sequences that ended because time no longer advanced between impacts, without proof.
    near_ties : int
        Times that the last digits decided whether a block that nothing weighs down touches the ground.
    """

    block: Block
    motion: Motion | None
    model: Model
    treatment: Treatment
    overturned: bool
    unfinished: bool
    overturn_time: float
    peak_rotation: float
    peak_time: float
    duration: float
    events: NDArray[np.void]
    impacts: NDArray[np.void]
    chattering: NDArray[np.void]
    stalled: int
    near_ties: int
    trail: Trail = field(repr=False)

    @classmethod
    def from_march(
        cls,
        block: Block,
        motion: Motion | None,
        model: Model,
        treatment: Treatment,
        trail: Trail,
        table: state.Records,
        end: state.Record,
    ) -> Response:
        """Response from the table and the last state of a march."""
        events = table["event"][: end["events"]]
        overturned = bool(len(events)) and events["kind"][-1] == status.TOPPLED
        return cls(
            block=block,
            motion=motion,
            model=model,
            treatment=treatment,
            overturned=bool(overturned),
            unfinished=bool(end["ending"] == status.UNFINISHED),
            overturn_time=float(events["time"][-1]) if overturned else math.nan,
            peak_rotation=float(end["peak"]),
            peak_time=float(end["peak_time"]),
            duration=float(end["end"]),
            events=_events(events),
            impacts=_public(table["impact"][: end["impacts"]], IMPACT),
            chattering=_public(table["sequence"][: end["sequences"]], CHATTERING),
            stalled=int(end["stalled"]),
            near_ties=int(end["near_ties"]),
            trail=trail._replace(nodes=state.attributed(np.array(table["node"][: end["nodes"]]))),
        )

    def __repr__(self) -> str:
        return f"<Response: {summary.line(self)}>"

    def _repr_html_(self) -> str:
        start, end = figure.active_span(self)
        times = figure.drawing_times(self, start, end)
        alpha = min(side.alpha for side in self.block.sides)
        drawn = np.clip(self.rotation(times) / alpha, -_HIGHEST_PICTURED, _HIGHEST_PICTURED)
        return svg.captioned(f"Response: {summary.line(self)}", svg.history(times, drawn, "rotation / slenderness"))

    @property
    def _history(self) -> History:
        return History(self.trail, self.duration)

    @property
    def peak_over_slenderness(self) -> float:
        """Peak rotation over the slenderness of the side where it is reached; infinite where the block overturns."""
        if self.overturned:
            return math.inf
        if self.peak_rotation == 0.0:
            return 0.0
        leaning = float(self.rotation(self.peak_time))
        return self.peak_rotation / self.block.sides[0 if leaning > 0.0 else 1].alpha

    @property
    def moves_at_end(self) -> bool:
        """Whether the block is not at rest at the end of the response."""
        return bool(self.trail.nodes["side"][-1] != state.AT_REST)

    @property
    def stopped(self) -> bool:
        """Whether `duration` ended the simulation before a verdict: the block still moved, or the motion went on.

        What became of the block is then not known, and `overturned` says no more than "not by then".
        """
        over = self.motion is None or self.duration >= self.motion.end
        return not (self.overturned or self.unfinished) and (self.moves_at_end or not over)

    @property
    def tipping_time(self) -> float:
        """Last time, s, at which the block passes its balance point, |theta| = alpha; NaN if it ends within it.

        From then on a block that overturns only falls; one that is beyond it where the simulation was `stopped` may yet
        be caught by the motion.
        """
        plus, minus = self.block.sides
        return self._history.tipping_time((plus.alpha, minus.alpha))

    @property
    def sensitivity(self) -> Sensitivity:
        """How the peak and the times of events and impacts change with the motion, the initial state and the block."""
        return Sensitivity.along(
            self.trail, self.peak_time, len(self.impacts), len(self.events), overturned=self.overturned
        )

    @property
    def ambiguous(self) -> bool:
        """Whether no double-precision program can know this response: one ulp of what was given changes it visibly."""
        return bool(self.ambiguities)

    @property
    def ambiguities(self) -> tuple[str, ...]:
        """What makes the response ambiguous: "peak", "events" (a time of one, or of an impact) and "touch".

        The last is that of a block that nothing weighs down, which may just reach the ground, or just not.

        An ambiguous response is one of those that are possible. Scale the motion, or the initial state, by 1 plus some
        millionths, simulate each, and take the spread of the results for the answer.
        """
        return self.sensitivity.ambiguities(self.peak_rotation, self.near_ties)

    @property
    def time_at_rest(self) -> float:
        """Time that the block spends at rest, s."""
        starts, ends = self.rest_intervals.T
        return float(np.sum(ends - starts))

    @property
    def rest_intervals(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        return self._history.rests()

    def rotation(self, time: ArrayLike) -> Floats:
        """Rotation theta, rad, at any time, from the series of the arc in which it lies.

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.

        Returns
        -------
        ndarray
            Same shape, a number for a number; NaN outside [0, duration].

        Raises
        ------
        InvalidOption
            If a time is not a number.
        """
        return as_asked(self._history.states(time)[..., 0])

    def angular_velocity(self, time: ArrayLike) -> Floats:
        """Angular velocity, rad/s, at any time (just after an impact, at one); NaN outside [0, duration]."""
        return as_asked(self._history.states(time)[..., 1])

    def angular_acceleration(self, time: ArrayLike) -> Floats:
        """Angular acceleration, rad/s^2, at any time; NaN outside [0, duration]."""
        return as_asked(self._history.states(time)[..., 2])

    def normal_force(self, time: ArrayLike) -> Floats:
        """Return the normal force over the weight at any time; impulses at impacts are not part of it."""
        return as_asked(self._contact.forces(time)[1])

    def friction_demand(self, time: ArrayLike) -> Floats:
        """Friction coefficient that sticking needs at any time: infinite where the normal force is not positive.

        NaN outside the response.
        """
        return as_asked(friction_demand(*self._contact.forces(time)))

    @cached_property
    def required_friction(self) -> float:
        """Largest friction coefficient that sticking needs, between impacts and until the block tips (`tipping_time`).

        Infinite if the normal force does not stay positive.
        """
        return self._contact.largest(friction_demand)

    @cached_property
    def minimum_normal_force(self) -> float:
        """Smallest normal force over the weight, between impacts and until the block tips (`tipping_time`)."""
        return -self._contact.largest(_pull)

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
        return self._contact.first(friction_demand, lambda demand: demand > level)

    @cached_property
    def lift_off_time(self) -> float:
        """First time, s, at which the normal force is no longer positive, so that the base would leave the ground.

        NaN if that never happens; as for `sliding_time`, until the block tips and between impacts.
        """
        return self._contact.first(_pull, lambda pull: pull >= 0.0)

    def __getstate__(self) -> dict[str, Any]:
        """Return what is kept of the response: the impacts that its forces need are followed again."""
        return {name: value for name, value in self.__dict__.items() if name != "_contact"}

    @cached_property
    def _contact(self) -> Contact:
        cut = bool(len(self.chattering)) and bool(self.chattering["end"][-1] >= self.duration) and self.moves_at_end
        history = History(with_all_impacts(self.trail, self.block, cut=cut), self.duration)
        return Contact(history, self.block, self._end_of_contact)

    @property
    def _end_of_contact(self) -> float:
        """Time up to which contact is looked at, s: until the block tips, or to the end."""
        return self.duration if math.isnan(self.tipping_time) else self.tipping_time

    def summary(self, friction: float | None = None) -> str:
        """Return what happened in words, line by line, as ``rocking simulate`` prints it.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction: says whether the block would slide, and when first.

        Notes
        -----
        What drives the block (the motion, or the initial state) is taken to be known to a millionth of itself, about
        what the usual record formats print. Times and the peak are given without the digits that so small a change of
        it moves, by `sensitivity`, and with nine decimals and six digits at most; a change of a time by a millisecond
        or more is told with it, after +-.

        Examples
        --------
        >>> import rocking
        >>> block = rocking.Block(width=0.24, height=1.1)
        >>> print(rocking.simulate(block, rocking.pulses.one_sine(3.0, 1.0)).summary())
        block               rectangular block, 0.24 m x 1.1 m
        parameters          p = 3.6146 rad/s, alpha = 0.21482 rad, restitution = 0.93184
        motion              one-sine, 1.00 s, peak 0.3059 g
        uplift above        0.2182 g
        uplift              0.126380 s, to side -
        overturn            1.532021 s
        impacts resolved    1
        peak rotation       1.5708 rad at 1.5320 s, where the block has fallen
        friction needed     0.2372, until it tips at 0.9319 s
        least normal force  0.8919 of the weight, until it tips at 0.9319 s
        verdict             overturns at 1.532021 s
        """
        return summary.text(self, friction)

    def summary_rows(self, friction: float | None = None) -> list[tuple[str, str]]:
        """Return the rows of `summary`: what, and how much.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction, as for `summary`.

        Returns
        -------
        list of (str, str)
            Name and words of each row.

        Examples
        --------
        >>> import rocking
        >>> block = rocking.Block(width=0.24, height=1.1)
        >>> rocking.simulate(block, rocking.pulses.one_sine(3.0, 1.0)).summary_rows()[-1]
        ('verdict', 'overturns at 1.532021 s')
        """
        return summary.rows(self, friction)

    def to_dict(self, friction: float | None = None) -> dict[str, Any]:
        """Return the result in plain values for machines, as ``rocking simulate --json`` prints it.

        Units are in the names; None stands for what is not a finite number.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction: says whether the block would slide, and when first.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> result = response.to_dict()
        >>> result["overturned"], result["lift_off_time_s"], result["events"][0]["kind"]
        (True, None, 'uplift')
        """
        return summary.values(self, friction)

    def to_xarray(self, dt: float | None = None) -> xr.Dataset:
        """Time histories and events as a dataset.

        Parameters
        ----------
        dt : float, optional
            Step of the time axis, s; by default the motion's own, or a two-thousandth of the duration.

        Returns
        -------
        xarray.Dataset
            rotation, angular_velocity and ground_acceleration over time; one dimension each for events, impacts and
            chattering sequences; units with each variable; the block and the verdict as attributes. It can be written
            with ``to_netcdf``. Its own ``to_dataframe`` multiplies all these dimensions, which easily makes millions of
            rows: take `Response.to_dataframe`.

        Raises
        ------
        InvalidOption
            If `dt` is not positive.
        """
        return data.dataset(self, dt)

    def to_dataframe(self, table: data.Table = "histories", *, dt: float | None = None) -> pd.DataFrame:
        """Return one of the response's tables as a data frame; columns are named with their units.

        Parameters
        ----------
        table : {"histories", "events", "impacts", "chattering"}
            Rotation, angular velocity and ground acceleration over time (the index, ``time_s``), or the rows of
            `events`, `impacts` or `chattering`.
        dt : float, optional
            Step of the histories, s; by default the motion's own, or a two-thousandth of the duration.

        Raises
        ------
        InvalidOption
            If there is no such table, `dt` is not positive, or it is given for another table than the histories.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> list(response.to_dataframe(dt=0.01).columns)
        ['rotation_rad', 'angular_velocity_rad_s', 'ground_acceleration_m_s2']
        >>> list(response.to_dataframe("impacts").columns)
        ['time_s', 'side', 'speed_before_rad_s', 'speed_after_rad_s']
        """
        return data.frame(self, table, dt)

    def to_netcdf(self, path: str | Path, dt: float | None = None) -> None:
        """Write `to_xarray` to a NetCDF file.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        data.write_netcdf(self, path, dt)

    def to_csv(self, path: str | Path, table: data.Table = "histories", *, dt: float | None = None) -> None:
        """Write one of the tables of `to_dataframe` as text columns with a header.

        Raises
        ------
        InvalidOption
            As `to_dataframe`.
        OutputError
            If the file cannot be written.
        """
        data.write_csv(self, path, table, dt)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        units: RotationUnits = "slenderness",
        window: tuple[float, float] | None = None,
        chattering: bool = False,
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Figure of the rotation with impacts and rests, and of the motion with thresholds.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Draw the rotation here, without the other panels.
        units : {"slenderness", "rad", "deg"}
            What rotations are drawn in: over the slenderness of their side, or as they are.
        window : (start, end), optional
            Stretch of time to draw, s; by default from a little before the first event to a little after the last.
        chattering : bool
            Whether to show the longest chattering sequence, impact by impact, in a panel of its own.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Raises
        ------
        InvalidOption
            If there is no such unit, the window is not a stretch of the response, or the size is not one.
        """
        return figure.figure(self, units, window, chattering, ax, figsize)


def _pull(_: Floats, vertical: Floats) -> Floats:
    """Return how much the ground would have to pull: the normal force's opposite."""
    return -vertical


def _public(rows: state.Records, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    public = np.empty(len(rows), dtype=dtype)
    for name in dtype.names or ():
        public[name] = rows[name]
    return public


def _events(rows: state.Records) -> NDArray[np.void]:
    events = np.empty(len(rows), dtype=EVENT)
    events["time"], events["side"], events["kind"] = rows["time"], rows["side"], _KINDS[rows["kind"]]
    return events
