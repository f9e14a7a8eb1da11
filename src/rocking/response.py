"""What one simulation found: events, impacts, chattering, and the rotation at any time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block
from rocking.contact import contact_forces, friction_demand
from rocking.errors import InvalidOption, OutputError
from rocking.kernels import state, status, variation
from rocking.kernels.trace import Trail, trace
from rocking.motion import piecewise
from rocking.motion.motion import Motion
from rocking.problem import Model
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.plot import DrawnSequence, RotationUnits

EVENT = np.dtype([("time", "f8"), ("kind", "U8"), ("side", "i1")])
IMPACT = np.dtype([("time", "f8"), ("side", "i1"), ("speed_before", "f8"), ("speed_after", "f8")])
CHATTERING = np.dtype([("start", "f8"), ("end", "f8"), ("lower", "f8"), ("upper", "f8"), ("impacts", "i8")])

_KINDS = np.array(["uplift", "rest", "overturn"])

#: A response is ambiguous when changes of the motion, the initial state and the block by one unit in the last place
#: move its peak by more than this fraction, or one of its events by more than this many seconds.
AMBIGUITY = 1e-6

_ULP = 2.0**-52

#: Samples per step, rounds, and steps that are looked at again, when the contact forces' extremes are searched.
_SAMPLES = 9
_REFINEMENTS = 10
_MOST_REFINED = 64


#: What a sensitivity is to.
QUANTITIES = ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution")


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Changes of a response per unit of relative change of what it was computed from.

    Structured arrays with the fields motion, initial_rotation, initial_velocity, p, alpha and restitution (of both
    sides together): a field times 1e-3 is what 0.1 % more of that quantity changes, to first order.

    Attributes
    ----------
    peak : structured array, shape (1,)
        Of the peak rotation, rad; 0 when overturned.
    impacts, events : structured array
        Of the times of the response's impacts and events, s.
    """

    peak: NDArray[np.void]
    impacts: NDArray[np.void]
    events: NDArray[np.void]


def _by_quantity(values: Floats) -> NDArray[np.void]:
    table = np.empty(values.shape[1], dtype=[(name, "f8") for name in QUANTITIES])
    for name, row in zip(QUANTITIES, values, strict=True):
        table[name] = row
    return table


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
            trail=trail._replace(nodes=state.attributed(np.array(table["node"][: end["nodes"]]))),
        )

    @property
    def peak_over_slenderness(self) -> float:
        """Peak rotation over the slenderness of the side where it is reached."""
        if self.peak_rotation == 0.0:
            return 0.0
        leaning = float(self.rotation(self.peak_time))
        return self.peak_rotation / self.block.sides[0 if leaning > 0.0 else 1].alpha

    @property
    def sensitivity(self) -> Sensitivity:
        """How the peak and the times of events and impacts change with the motion, the initial state and the block."""
        trail, count = self.trail, len(QUANTITIES)
        peak = np.zeros(count)
        impacts, events = np.zeros((count, len(self.impacts))), np.zeros((count, len(self.events)))
        scratch, work = state.new_scratch(), np.zeros(variation.WORK)
        for k in range(count):
            peak[k] = variation.vary(trail, scratch, work, k, self.peak_time, impacts[k], events[k])
        if self.overturned:
            peak[:] = 0.0
        return Sensitivity(*(_by_quantity(values) for values in (peak[:, None], impacts, events)))

    @property
    def ambiguous(self) -> bool:
        """Whether no double-precision program can know this response: one ulp of what was given changes it visibly."""
        changes = self.sensitivity
        total = [np.sum([np.abs(values[name]) for name in QUANTITIES], axis=0) for values in vars(changes).values()]
        peak, _, events = (values * _ULP for values in total)
        return not bool(np.all(peak <= AMBIGUITY * max(self.peak_rotation, 1e-300)) and np.all(events <= AMBIGUITY))

    @property
    def time_at_rest(self) -> float:
        """Time that the block spends at rest, s."""
        starts, ends = self.rest_intervals.T
        return float(np.sum(ends - starts))

    @property
    def rest_intervals(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        nodes = self.trail.nodes
        rows = np.flatnonzero(nodes["side"] == state.AT_REST)
        after = np.append(nodes["time"][1:], self.duration)
        return np.column_stack([nodes["time"][rows], after[rows]])

    def rotation(self, time: ArrayLike) -> Floats:
        """Rotation theta, rad, at any time, from the series of the arc in which it lies.

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.

        Returns
        -------
        ndarray
            Same shape; NaN outside [0, duration].
        """
        return self._traced(time)[..., 0]

    def angular_velocity(self, time: ArrayLike) -> Floats:
        """Angular velocity, rad/s, at any time (just after an impact, at one); NaN outside [0, duration]."""
        return self._traced(time)[..., 1]

    def angular_acceleration(self, time: ArrayLike) -> Floats:
        """Angular acceleration, rad/s^2, at any time; NaN outside [0, duration]."""
        return self._traced(time)[..., 2]

    def normal_force(self, time: ArrayLike) -> Floats:
        """Return the normal force over the weight at any time; impulses at impacts are not part of it."""
        return self._forces(time)[1]

    def friction_demand(self, time: ArrayLike) -> Floats:
        """Friction coefficient that sticking needs at any time; infinite where the normal force is not positive."""
        return friction_demand(*self._forces(time))

    @property
    def required_friction(self) -> float:
        """Largest friction coefficient that sticking needs during the response (between impacts)."""
        return self._extreme(friction_demand)

    @property
    def minimum_normal_force(self) -> float:
        """Smallest normal force over the weight during the response (between impacts)."""
        return -self._extreme(lambda _, vertical: -vertical)

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
            chattering sequences; the block and the verdict as attributes. It can be written with ``to_netcdf``.

        Raises
        ------
        InvalidOption
            If `dt` is not positive.
        """
        import xarray as xr

        times = self._axis(dt)
        traced = self._traced(times)
        histories = {
            "rotation": (traced[:, 0], "rad"),
            "angular_velocity": (traced[:, 1], "rad/s"),
            "ground_acceleration": (self._ground(times), "m/s^2"),
        }
        variables: dict[str, Any] = {
            name: ("time", values, {"units": units}) for name, (values, units) in histories.items()
        }
        for kind in ("events", "impacts", "chattering"):
            rows = getattr(self, kind)
            dimension = {"events": "event", "impacts": "impact", "chattering": "sequence"}[kind]
            for name in rows.dtype.names:
                column = rows[name].astype(object) if rows[name].dtype.kind == "U" else rows[name]
                variables[f"{dimension}_{name}"] = (dimension, column)
        return xr.Dataset(variables, {"time": ("time", times, {"units": "s"})}, self._attributes())

    def to_netcdf(self, path: str | Path, dt: float | None = None) -> None:
        """Write `to_xarray` to a NetCDF file.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        dataset = self.to_xarray(dt)
        try:
            dataset.to_netcdf(path, engine="h5netcdf")
        except OSError as error:
            raise OutputError(f"{path} cannot be written: {error.strerror or error}; choose another place") from error

    def to_csv(self, path: str | Path, dt: float | None = None) -> None:
        """Write time, rotation, angular velocity and ground acceleration as text columns with a header.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        times = self._axis(dt)
        traced = self._traced(times)
        columns = np.column_stack([times, traced[:, :2], self._ground(times)])
        header = "time_s,rotation_rad,angular_velocity_rad_per_s,ground_acceleration_m_per_s2"
        try:
            np.savetxt(path, columns, fmt="%.12g", delimiter=",", header=header, comments="")
        except OSError as error:
            raise OutputError(f"{path} cannot be written: {error.strerror or error}; choose another place") from error

    def plot(self, ax: Axes | None = None, *, units: RotationUnits = "slenderness", chattering: bool = False) -> Figure:
        """Figure of the rotation with impacts and rests, and of the motion with thresholds.

        Drawn from a little before the first event to a little after the last.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Draw the rotation here, without the other panels.
        units : {"slenderness", "rad", "deg"}
            What rotations are drawn in.
        chattering : bool
            Whether to show the longest chattering sequence, impact by impact, in a panel of its own.
        """
        from rocking.plot import response_figure

        start, end = self._active_span()
        times = self._drawing_times(start, end)
        alpha = [side.alpha for side in self.block.sides]
        corners = self._motion_drawing_times(start, end)
        plus, minus = self.block.uplift_thresholds(self.model)
        return response_figure(
            time=times,
            rotation=self.rotation(times),
            slenderness=(alpha[0], alpha[1]),
            impact_times=self.impacts["time"],
            rest_intervals=self.rest_intervals,
            uplift_times=self.events["time"][self.events["kind"] == "uplift"],
            overturn_time=self.overturn_time if self.overturned else None,
            motion_time=corners,
            motion_acceleration_g=self._ground(corners) / self.block.gravity,
            thresholds_g=(plus / self.block.gravity, minus / self.block.gravity),
            duration=self.duration,
            chattering=self._longest_sequence() if chattering else None,
            units=units,
            ax=ax,
            title=f"{self.block.description} under {'no motion' if self.motion is None else self.motion.name}",
        )

    def _longest_sequence(self) -> DrawnSequence | None:
        """Chattering sequence with the most impacts, as it is drawn."""
        from rocking.plot import DrawnSequence

        longest = max(self.chattering, key=lambda row: row["impacts"], default=None)
        if longest is None:
            return None
        struck = self.impacts["time"]
        within = struck[(struck >= longest["start"]) & (struck <= longest["end"])]
        return DrawnSequence(within, float(longest["lower"]), float(longest["upper"]))

    def _attributes(self) -> dict[str, Any]:
        sides = self.block.sides
        return {
            "block": self.block.description,
            "frequency_parameter_rad_per_s": [side.p for side in sides],
            "slenderness_rad": [side.alpha for side in sides],
            "restitution": [side.restitution for side in sides],
            "gravity_m_per_s2": self.block.gravity,
            "motion": "none" if self.motion is None else self.motion.name,
            "motion_history": "" if self.motion is None else "; ".join(self.motion.history),
            "model": self.model,
            "chattering": repr(self.treatment),
            "overturned": int(self.overturned),
            "overturn_time_s": self.overturn_time,
            "peak_rotation_rad": self.peak_rotation,
            "peak_time_s": self.peak_time,
            "ambiguous": int(self.ambiguous),
        }

    def _active_span(self) -> tuple[float, float]:
        """Stretch worth drawing: from a little before the first event to a little after the last."""
        times = np.concatenate([self.events["time"], self.impacts["time"]])
        if len(times) == 0:
            return 0.0, self.duration
        first = float(times.min()) if self.rotation(0.0) == 0.0 else 0.0
        margin = 0.1 * (float(times.max()) - first) + 0.5
        return max(0.0, first - margin), min(self.duration, float(times.max()) + margin)

    def _drawing_times(self, start: float, end: float) -> Floats:
        """Return times dense enough for a smooth line: even ones, and those of steps that are long enough to see."""
        even = np.linspace(start, end, 4001)
        steps = self.trail.nodes["time"]
        steps = steps[(steps > start) & (steps < end)]
        visible = np.diff(np.floor(steps / max(even[1] - even[0], 1e-12)), prepend=-1.0) > 0.0
        return np.union1d(even, steps[visible])

    def _motion_drawing_times(self, start: float, end: float) -> Floats:
        """Corners of the motion, and points between them where it is curved."""
        if self.motion is None:
            return np.empty(0)
        corners = self.motion.breakpoints
        if self.motion.coefficients.shape[1] > 2:
            corners = (corners[:-1, None] + np.linspace(0.0, 1.0, 33) * np.diff(corners)[:, None]).ravel()
        return np.union1d([start, end], corners[(corners > start) & (corners < end)])

    def _axis(self, dt: float | None) -> Floats:
        if dt is None:
            step = None if self.motion is None else self.motion.step
            # A pulse of a few straight lines has a step, too, that shows nothing.
            dt = step if step and step <= 0.01 * self.duration else max(self.duration, 1e-3) / 2000.0
        dt = checks.positive(dt, "dt", InvalidOption, "s")
        return dt * np.arange(math.floor(self.duration / dt * (1.0 + 1e-12)) + 1, dtype=np.float64)

    def _ground(self, times: Floats) -> Floats:
        if self.motion is None:
            return np.zeros_like(times)
        return self.motion.acceleration(times)

    def _rows(self, times: Floats) -> NDArray[np.int64]:
        rows = np.searchsorted(self.trail.nodes["time"], times, side="right") - 1
        return np.maximum(rows, 0).astype(np.int64)

    def _traced(self, time: ArrayLike) -> Floats:
        times = np.asarray(time, dtype=np.float64)
        flat = times.ravel()
        traced = self._traced_in(flat, self._rows(flat))
        traced[~((flat >= 0.0) & (flat <= self.duration))] = np.nan
        return traced.reshape((*times.shape, 3))

    def _traced_in(self, times: Floats, rows: NDArray[np.int64]) -> Floats:
        out = np.empty((len(times), 3))
        trace(self.trail, state.new_scratch(), times, rows, out)
        return out

    def _forces(self, time: ArrayLike) -> tuple[Floats, Floats]:
        times = np.asarray(time, dtype=np.float64)
        horizontal, vertical = self._forces_in(times.ravel(), self._rows(times.ravel()))
        outside = ~((times >= 0.0) & (times <= self.duration)).ravel()
        horizontal[outside] = vertical[outside] = np.nan
        return horizontal.reshape(times.shape), vertical.reshape(times.shape)

    def _forces_in(self, times: Floats, rows: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Contact forces in the steps that start at these rows: on the side and under the piece of each."""
        nodes = self.trail.nodes[rows]
        theta, rate, acceleration = self._traced_in(times, rows).T
        rests = nodes["side"] == state.AT_REST
        side = np.maximum(nodes["side"], 0)
        alpha = np.array([s.alpha for s in self.block.sides])[side]
        radius = np.array([s.radius for s in self.block.sides])[side]
        ground = self._ground_in(times, nodes)
        sign = np.where(rests, 0.0, 1.0 - 2.0 * side)
        return contact_forces((theta, rate, acceleration), ground, sign, alpha, radius / self.block.gravity)

    def _ground_in(self, times: Floats, nodes: state.Records) -> Floats:
        """Ground acceleration in g: in the piece where a step starts; at rest, which may span many, wherever it is."""
        pieces = self.trail.ground.pieces
        inside = np.maximum(times - pieces[nodes["piece"], 0], 0.0)
        stepping = piecewise.value(pieces[nodes["piece"], 2:], inside)
        return np.where(nodes["side"] == state.AT_REST, self._ground(times) / self.block.gravity, stepping)

    def _extreme(self, measure: Callable[[Floats, Floats], Floats]) -> float:
        """Largest value of a measure of the two forces, both limits at every impact and jump included.

        Within a step the forces are smooth. Those steps whose samples come near the largest are sampled again, around
        their best.
        """
        times, rows = self._samples()
        largest = -math.inf
        for _ in range(_REFINEMENTS):
            values = measure(*self._forces_in(times.ravel(), rows.ravel())).reshape(times.shape)
            largest = max(largest, float(values.max()))
            kept = np.argsort(values.max(axis=1))[-_MOST_REFINED:]
            times, rows, place = times[kept], rows[kept], values[kept].argmax(axis=1)
            low = np.take_along_axis(times, np.maximum(place - 1, 0)[:, None], axis=1)
            high = np.take_along_axis(times, np.minimum(place + 1, times.shape[1] - 1)[:, None], axis=1)
            times = low + (high - low) * np.linspace(0.0, 1.0, times.shape[1])
        return largest

    def _samples(self) -> tuple[Floats, NDArray[np.int64]]:
        """Sample every step, and every piece of the motion during rest, ends included; with their steps."""
        nodes = self.trail.nodes
        starts, ends = nodes["time"], np.append(nodes["time"][1:], self.duration)
        corners = self.trail.ground.pieces[:, 0]
        corners = corners[(corners > 0.0) & (corners < self.duration)]
        at_rest = self._rows(corners)
        corners = corners[nodes["side"][at_rest] == state.AT_REST]
        rests = self._rows(corners)
        until = np.minimum(ends[rests], np.append(corners[1:], self.duration))
        starts, ends = np.append(starts, corners), np.append(ends, until)
        rows = np.append(np.arange(len(nodes)), rests)
        lasting = ends > starts
        starts, ends, rows = starts[lasting], ends[lasting], rows[lasting]
        fractions = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _SAMPLES))
        times = starts[:, None] + fractions * (ends - starts)[:, None]
        resting = nodes["side"][rows] == state.AT_REST  # what the motion is before a jump
        times[resting, -1] = np.maximum(np.nextafter(times[resting, -1], 0.0), times[resting, 0])
        return times, np.repeat(rows[:, None], _SAMPLES, axis=1)


def _public(rows: state.Records, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    public = np.empty(len(rows), dtype=dtype)
    for name in dtype.names or ():
        public[name] = rows[name]
    return public


def _events(rows: state.Records) -> NDArray[np.void]:
    events = np.empty(len(rows), dtype=EVENT)
    events["time"], events["side"], events["kind"] = rows["time"], rows["side"], _KINDS[rows["kind"]]
    return events
