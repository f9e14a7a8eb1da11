"""What one simulation found: events, impacts, chattering, and the rotation at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block import Block
from rocking.contact import contact_forces, friction_demand
from rocking.errors import InvalidOption, OutputError
from rocking.kernels import state, status
from rocking.kernels.state import Floats, Trail
from rocking.kernels.trace import trace
from rocking.motion.motion import Motion
from rocking.problem import Model
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

EVENT = np.dtype([("time", "f8"), ("kind", "U8"), ("side", "i1"), ("sensitivity", "f8")])
IMPACT = np.dtype(
    [("time", "f8"), ("side", "i1"), ("speed_before", "f8"), ("speed_after", "f8"), ("sensitivity", "f8")]
)
CHATTERING = np.dtype([("start", "f8"), ("end", "f8"), ("lower", "f8"), ("upper", "f8"), ("impacts", "i8")])

_KINDS = np.array(["uplift", "rest", "overturn"])

#: A response is ambiguous when a change of the motion by one unit in the last place moves its peak by more than this
#: fraction, or one of its events by more than this many seconds.
AMBIGUITY = 1e-6

_ULP = 2.0**-52

#: Interior points per step, rounds, and points per further round, when the contact forces' extremes are searched.
_INTERIOR = 4
_REFINEMENTS = 3
_REFINED = 33


@dataclass(frozen=True, eq=False)
class Response:
    """Response of one block to one motion, made by `rocking.simulate`.

    Attributes
    ----------
    block, motion, model, treatment
        What was simulated, and how.
    overturned : bool
        Whether the rotation reached pi/2.
    overturn_time : float
        When it first did, s; NaN otherwise.
    peak_rotation, peak_time : float
        Largest |theta|, rad, and when, s; pi/2 when overturned.
    peak_sensitivity : float
        Change of the peak rotation per unit of relative change of the motion, rad.
    duration : float
        End of the response, s.
    events : structured array
        time (s), kind ("uplift", "rest", "overturn"), side (+1, -1; 0 at rest), and sensitivity: shift of the time
        per unit of relative change of the motion, s.
    impacts : structured array
        time (s), side entered, speed_before and speed_after (rad/s), sensitivity (s), in order of time; of a
        chattering sequence those that were resolved before its rest was closed.
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
    overturn_time: float
    peak_rotation: float
    peak_time: float
    peak_sensitivity: float
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
        tables: Floats,
        at: state.Integers,
        x: Floats,
    ) -> Response:
        """Response from the tables and the last state of a march."""
        events = tables[state.EVENT_TABLE, : at[state.EVENTS]]
        overturned = bool(len(events)) and events[-1, 1] == status.TOPPLED
        return cls(
            block=block,
            motion=motion,
            model=model,
            treatment=treatment,
            overturned=bool(overturned),
            overturn_time=float(events[-1, 0]) if overturned else math.nan,
            peak_rotation=float(x[state.PEAK]),
            peak_time=float(x[state.PEAK_TIME]),
            peak_sensitivity=float(x[state.PEAK_CHANGE]),
            duration=float(x[state.END]),
            events=_events(events),
            impacts=_structured(tables[state.IMPACT_TABLE, : at[state.IMPACTS]], IMPACT),
            chattering=_structured(tables[state.SEQUENCE_TABLE, : at[state.SEQUENCES]], CHATTERING),
            stalled=int(at[state.STALLED]),
            trail=trail._replace(nodes=tables[state.NODE_TABLE, : at[state.NODES]].copy()),
        )

    @property
    def peak_over_slenderness(self) -> float:
        """Peak rotation over the slenderness of the side where it is reached."""
        if self.peak_rotation == 0.0:
            return 0.0
        leaning = float(self.rotation(self.peak_time))
        return self.peak_rotation / self.block.sides[0 if leaning > 0.0 else 1].alpha

    @property
    def ambiguous(self) -> bool:
        """Whether no double-precision program can know this response: one ulp of the motion changes it visibly."""
        if not abs(self.peak_sensitivity) * _ULP <= AMBIGUITY * max(self.peak_rotation, 1e-300):
            return True
        return not bool(np.all(np.abs(self.events["sensitivity"]) * _ULP <= AMBIGUITY))

    @property
    def time_at_rest(self) -> float:
        """Time that the block spends at rest, s."""
        starts, ends = self.rest_intervals.T
        return float(np.sum(ends - starts))

    @property
    def rest_intervals(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        nodes = self.trail.nodes
        rows = np.flatnonzero(nodes[:, 3] == 0.0)
        after = np.append(nodes[1:, 0], self.duration)
        return np.column_stack([nodes[rows, 0], after[rows]])

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

    def plot(self) -> Figure:
        """Figure of the rotation with impacts and rests, of the motion with thresholds, and of one chattering sequence.

        Drawn from a little before the first event to a little after the last.
        """
        from rocking.plot import ChatteringSequence, response_figure

        start, end = self._active_span()
        times = self._drawing_times(start, end)
        alpha = np.array([side.alpha for side in self.block.sides])
        theta = self.rotation(times)
        corners = self._motion_drawing_times(start, end)
        plus, minus = self.block.uplift_thresholds(self.model)
        longest = max(self.chattering, key=lambda row: row["impacts"], default=None)
        sequence = None
        if longest is not None:
            struck = self.impacts["time"]
            within = struck[(struck >= longest["start"]) & (struck <= longest["end"])]
            sequence = ChatteringSequence(within, float(longest["lower"]), float(longest["upper"]))
        return response_figure(
            time=times,
            rotation_over_slenderness=theta / np.where(theta >= 0.0, alpha[0], alpha[1]),
            impact_times=self.impacts["time"],
            rest_intervals=np.clip(self.rest_intervals, start, end),
            uplift_times=self.events["time"][self.events["kind"] == "uplift"],
            overturn_time=self.overturn_time if self.overturned else None,
            motion_time=corners,
            motion_acceleration_g=self._ground(corners) / self.block.gravity,
            thresholds_g=(plus / self.block.gravity, minus / self.block.gravity),
            chattering=sequence,
            title=f"{self.block.description} under {'no motion' if self.motion is None else self.motion.name}",
        )

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
        steps = self.trail.nodes[:, 0]
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
            dt = step or max(self.duration, 1e-3) / 2000.0
        if not (math.isfinite(dt) and dt > 0.0):
            raise InvalidOption(f"dt must be a positive number of seconds, not {dt!r}")
        return dt * np.arange(math.floor(self.duration / dt * (1.0 + 1e-12)) + 1, dtype=np.float64)

    def _ground(self, times: Floats) -> Floats:
        if self.motion is None:
            return np.zeros_like(times)
        return self.motion.acceleration(times)

    def _rows(self, times: Floats) -> NDArray[np.int64]:
        rows = np.searchsorted(self.trail.nodes[:, 0], times, side="right") - 1
        return np.maximum(rows, 0).astype(np.int64)

    def _traced(self, time: ArrayLike) -> Floats:
        times = np.asarray(time, dtype=np.float64)
        flat = times.ravel()
        traced = self._traced_in(flat, self._rows(flat))
        traced[~((flat >= 0.0) & (flat <= self.duration))] = np.nan
        return traced.reshape((*times.shape, 3))

    def _traced_in(self, times: Floats, rows: NDArray[np.int64]) -> Floats:
        out = np.empty((len(times), 3))
        scratch = state.new_scratch(self.trail.shaking.coefficients.shape[1])
        trace(self.trail, scratch, times, rows, out)
        return out

    def _forces(self, time: ArrayLike) -> tuple[Floats, Floats]:
        times = np.asarray(time, dtype=np.float64)
        horizontal, vertical = self._forces_in(times.ravel(), self._rows(times.ravel()))
        outside = ~((times >= 0.0) & (times <= self.duration)).ravel()
        horizontal[outside] = vertical[outside] = np.nan
        return horizontal.reshape(times.shape), vertical.reshape(times.shape)

    def _forces_in(self, times: Floats, rows: NDArray[np.int64]) -> tuple[Floats, Floats]:
        theta, rate, acceleration = self._traced_in(times, rows).T
        side = np.where(self.trail.nodes[rows, 3] < 0.0, 1, 0)
        alpha = np.array([s.alpha for s in self.block.sides])[side]
        radius = np.array([s.radius for s in self.block.sides])[side]
        ground = self._ground(times) / self.block.gravity
        leaning = np.where(theta == 0.0, self.trail.nodes[rows, 3] * 1e-300, theta)
        return contact_forces(leaning, rate, acceleration, ground, alpha, radius / self.block.gravity)

    def _extreme(self, measure: Any) -> float:
        """Largest value of a measure of the two forces over the response, refined within its step."""
        times, rows = self._samples()
        best = -math.inf
        for _ in range(_REFINEMENTS):
            values = measure(*self._forces_in(times, rows))
            place = int(np.argmax(values))
            best = max(best, float(values[place]))
            row = rows[place]
            low, high = (times[k] if rows[k] == row else times[place] for k in (place - 1, (place + 1) % len(rows)))
            times, rows = np.linspace(low, high, _REFINED), np.full(_REFINED, row)
        return best

    def _samples(self) -> tuple[Floats, NDArray[np.int64]]:
        """Return times within every step, both ends included, and at every corner of the motion; with their steps."""
        starts = self.trail.nodes[:, 0]
        ends = np.append(starts[1:], self.duration)
        fractions = np.linspace(0.0, 1.0, _INTERIOR + 2)
        times = (starts[:, None] + fractions * (ends - starts)[:, None]).ravel()
        rows = np.repeat(np.arange(len(starts)), len(fractions))
        corners = self.trail.shaking.breakpoints
        pieces = (corners[:-1, None] + fractions * np.diff(corners)[:, None]).ravel()
        pieces = pieces[pieces <= self.duration]
        times, rows = np.append(times, pieces), np.append(rows, self._rows(pieces))
        order = np.lexsort((times, rows))
        return times[order], rows[order]


def _structured(table: Floats, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    rows = np.empty(len(table), dtype=dtype)
    for column, name in enumerate(dtype.names or ()):
        rows[name] = table[:, column]
    return rows


def _events(table: Floats) -> NDArray[np.void]:
    rows = np.empty(len(table), dtype=EVENT)
    rows["time"], rows["side"], rows["sensitivity"] = table[:, 0], table[:, 2], table[:, 3]
    rows["kind"] = _KINDS[table[:, 1].astype(np.intp)]
    return rows
