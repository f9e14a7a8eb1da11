"""Response of one body to one motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rocking.block import RestrainedBlock
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.result import Row, format_rows, rows_to_dict
from rocking.core.tables import Column, add_unit, columns_to_frame, columns_to_records, write_csv, write_netcdf
from rocking.errors import OptionError
from rocking.response import figure, summary
from rocking.response.figure import RotationUnits
from rocking.response.history import create_times
from rocking.response.perturbed import MOTION_PRECISION, choose_factors
from rocking.response.simulated import ResponseData

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Width of the column of names in a summary, in characters.
_NAME_WIDTH = 20

#: Largest number of points of a history (memory), and the number for a motion without a step.
_MAX_POINTS = 50_000_000
_N_POINTS = 2000


@dataclass(frozen=True, eq=False, repr=False)
class Response(ResponseData):
    """Response of one body to one motion, returned by `rocking.simulate`.

    Attributes
    ----------
    block, motion, model, chattering
        Inputs of the simulation.
    overturned : bool
        Whether the rotation reached pi/2.
    unfinished : bool
        Whether the simulation was aborted after too many steps. All other results then end at this point.
    leans : bool
        Whether restraints permanently hold the block leaning about `residual_rotation`, as proven at the end,
        `duration`. It may still oscillate, but neither returns to zero rotation nor exceeds the peak.
    friction : pair or None
        Static and kinetic coefficient of friction; None for a block that never slips.
    lost_contact : bool
        Whether the ground ceased to press on a block with friction. The response ends there.
    largest_slip : float
        Largest displacement of the base relative to the ground in size, m.
    overturn_time : float
        Time at which the rotation first reached pi/2, s; NaN otherwise.
    peak_rotation, peak_time : float
        Largest |theta|, rad, and its time, s; pi/2 if overturned. For other bodies the peak of the coordinate.
    duration : float
        End of the response, s. For a leaning block, the time of the proof.
    events : structured array
        time (s), kind ("uplift", "rest", "overturn"), side (+1, -1; 0 at rest). With friction also "slide" (slip on
        both pivots), "slide-rock" (slip on one pivot), "stick" (end of a slip on one pivot) and "lost contact". A slip
        on both pivots ends with "rest".
    impacts : structured array
        time (s), side entered, speed_before and speed_after (rad/s), in order of time. For a chattering sequence only
        the impacts that were resolved before its end was proven.
    sequences : structured array
        One row for each sequence that ended at rest: start (time of the impact from which it was proven to be
        complete), end (time of rest), lower and upper bound on the end, number of impacts resolved since the start.
        The bounds contain the exact time of rest for the given body, motion and initial state, including the effect of
        rounding before the proof. They are NaN if the rest is not proven. They are infinite if the rest is proven, but
        rounding may shift the response by as much as its distance from the balance or from grazing.
    tendons : structured array
        One row for each tendon of a restrained block: largest elongation (m) and force (N), and the plastic_elongation
        (m) of a yielding tendon at the end.
    rests_by_rounding : int
        Number of sequences that ended without proof because time no longer advanced between impacts.
    rounding_decisions : int
        Number of times that rounding determined whether a block touches the ground, or to which side it uplifts when
        no weight presses it down.
    solution : Solution
        Result of the integration, used by the methods of the response.

    See Also
    --------
    rocking.simulate : Simulate a body under a motion.
    rocking.gradient : Differentiate a result of a response.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> response = rocking.simulate(block, rocking.pulses.one_sine(amplitude=3.0, frequency=2.0))
    >>> response.events["kind"].tolist(), f"{response.peak_rotation:.4f} rad"
    (['uplift', 'rest'], '0.0667 rad')
    """

    TABLES = ("histories", "events", "impacts", "sequences")

    def _format_headline(self) -> str:
        return summary.format_line(self)

    def summary_rows(
        self, available_friction: float | None = None, *, precision: float = MOTION_PRECISION
    ) -> Sequence[Row]:
        """Return the lines of `summary` as rows of name, value, unit and note; arguments as of `summary`."""
        return summary.create_rows(self, available_friction, precision)

    def result_rows(
        self, available_friction: float | None = None, *, precision: float = MOTION_PRECISION
    ) -> Sequence[Row]:
        """Return the entries of `to_dict` as rows of name, value and unit; arguments as of `summary`."""
        body, motion, limit = self.block, self.motion, self.block.coordinate.limit_name
        entries = motion and {
            "name": motion.name,
            add_unit("duration", "s"): motion.duration,
            add_unit("pga", "m/s^2"): motion.pga,
            "history": motion.history,
            "vertical": motion.vertical
            and {"name": motion.vertical.name, add_unit("pga", "m/s^2"): motion.vertical.pga},
        }
        rows = [Row("block", {"description": body.description, **self._list_parameters()}), Row("motion", entries)]
        rows += self._create_outcome_rows()
        if limit:
            rows.append(Row(f"peak_over_{limit}", self.peak_over_slenderness))
        if isinstance(body, RestrainedBlock):
            rows.append(Row("balance", list(self.balance), body.coordinate.unit))
            rows.append(Row("tendons", columns_to_records(self._convert_table("tendons"))))
        rows.append(Row("peak_time", self.peak_time, "s"))
        if body.contact_law is not None:
            rows.append(Row("required_friction", self.required_friction))
            rows.append(Row("minimum_normal_force_over_weight", self.minimum_normal_force))
            rows.append(Row("lift_off_time", self.lift_off_time, "s"))
        if self.friction is not None:
            rows += [Row("friction_static", self.friction[0]), Row("friction_kinetic", self.friction[1])]
            rows += [Row("largest_slip", self.largest_slip, "m"), Row("residual_slip", self.residual_slip, "m")]
        if available_friction is not None:
            rows.append(Row("available_friction", available_friction))
            rows.append(Row("sliding_time", self.sliding_time(available_friction), "s"))
        rows += [Row("impacts_resolved", len(self.impacts)), Row("duration", self.duration, "s")]
        perturbed = [self.perturbed().to_dict(), self.perturbed(*choose_factors(precision)).to_dict()]
        rows += [Row("time_at_rest", self.time_at_rest, "s"), Row("perturbed", perturbed)]
        rows += [Row("ambiguous", self.ambiguous), Row("ambiguities", self.ambiguities)]
        return [*rows, *(Row(name, columns_to_records(self._convert_table(name))) for name in ("events", "sequences"))]

    def _list_parameters(self) -> dict[str, Any]:
        parameters = self.block.as_bodies().parameters().items()
        gravity = {add_unit("gravity", "m/s^2"): self.block.gravity}
        return {add_unit(name, unit): values[0].tolist() for name, (values, unit) in parameters} | gravity

    def _create_outcome_rows(self) -> list[Row]:
        name, unit = self.block.coordinate.name, self.block.coordinate.unit
        rows = [Row("model", self.model), Row("chattering", repr(self.chattering))]
        flags = [
            "overturned",
            "unfinished",
            "ended_early",
            "leans",
            *(["lost_contact"] if self.friction is not None else []),
        ]
        rows += [Row(flag, getattr(self, flag)) for flag in flags]
        rows += [Row(time, getattr(self, time), "s") for time in ("overturn_time", "tipping_time")]
        rows.append(Row(f"peak_{name}", self.peak_rotation, unit))
        return [*rows, Row(f"residual_{name}", self.residual_rotation, unit)]

    def summary(self, available_friction: float | None = None, *, precision: float = MOTION_PRECISION) -> str:
        """Return a description of the response, line by line, as printed by ``rocking simulate``.

        Parameters
        ----------
        available_friction : float, optional
            Coefficient of friction, for a check of sliding with the time of the first slip.
        precision : float
            Relative precision of the ground motion, from 1e-6 to 0.1, for counting outcomes within it.

        Notes
        -----
        Times and the peak have the digits that agree in five simulations with the motion (without a motion, the
        initial state) scaled by 1, 1 +- 1e-6 and 1 +- 3e-6, at most nine decimals and six digits. If the times differ
        by a millisecond, or the peaks in the third digit, their range is reported. See `Response.perturbed`.
        """
        return format_rows(self.summary_rows(available_friction, precision=precision), _NAME_WIDTH)

    def to_dict(
        self, available_friction: float | None = None, *, precision: float = MOTION_PRECISION
    ) -> dict[str, Any]:
        """Return the result as plain values, as printed by ``rocking simulate --json``; arguments as of `summary`.

        Names contain units. Numbers that are not finite are None.
        """
        return rows_to_dict(self.result_rows(available_friction, precision=precision))

    def to_xarray(self, dt: float | None = None) -> xr.Dataset:
        """Return time histories and events as a dataset. Its ``to_dataframe`` multiplies all dimensions.

        Rotation, angular velocity and ground acceleration depend on time, at steps `dt` (s; by default the step of the
        motion, or the duration divided by 2000). Events, impacts and chattering sequences have a dimension each. The
        block and the outcome are attributes.
        """
        import xarray as xr

        time, *histories = self._columns("histories", dt)
        variables: dict[str, Any] = {name: ("time", values, {"units": unit}) for name, values, unit, _ in histories}
        for table, dimension in (("events", "event"), ("impacts", "impact"), ("sequences", "sequence")):
            for name, values, unit, _ in self._columns(table):
                column = values.astype(object) if values.dtype.kind == "U" else values
                variables[f"{dimension}_{name}"] = (dimension, column, {"units": unit})
        motion = self.motion
        rows = [row for row in self._create_outcome_rows() if row.name != "tipping_time"]
        rows += [Row("peak_time", self.peak_time, "s"), Row("ambiguous", self.ambiguous)]
        if self.friction is not None:
            rows += [Row("friction", list(self.friction)), Row("largest_slip", self.largest_slip, "m")]
            rows += [Row("residual_slip", self.residual_slip, "m")]
        attributes = {
            "block": self.block.description,
            **self._list_parameters(),
            "motion": "none" if motion is None else motion.name,
            "vertical_motion": "none" if motion is None or motion.vertical is None else motion.vertical.name,
            "motion_history": "" if motion is None else "; ".join(motion.history),
        }
        for name, value, unit, _ in rows:
            attributes[add_unit(name, unit)] = int(value) if isinstance(value, bool) else value
        return xr.Dataset(variables, {"time": ("time", time.values, {"units": "s"})}, attributes)

    @property
    def _default_dt(self) -> float:
        """Step of the motion, or the duration divided by 2000."""
        step = self.motion and self.motion.dt
        # A pulse of a few straight lines also has a step, but its resolution is too coarse.
        return step if step and step <= 0.01 * self.duration else max(self.duration, 1e-3) / _N_POINTS

    @property
    def times(self) -> Floats:
        """Times of the histories of `to_xarray` at its default step, s, for methods such as `rotation`."""
        return create_times(self.duration, self._default_dt)

    def _columns(self, table: str, dt: float | None = None) -> list[Column]:
        checks.choice(table, "table", OptionError, self.TABLES)
        if table == "histories":
            return self._create_histories(dt)
        if dt is not None:
            raise OptionError(f"{{}} is the step of the histories, and does not apply to {table}; omit it", "dt")
        return self._convert_table(table)

    def _convert_table(self, table: str) -> list[Column]:
        rows, speed = getattr(self, table), f"{self.block.coordinate.unit}/s"
        units = {"kind": "1", "side": "1", "impacts": "1", "speed_before": speed, "speed_after": speed}
        units |= {"elongation": "m", "force": "N", "plastic_elongation": "m"}
        return [Column(name, rows[name], units.get(name, "s")) for name in rows.dtype.names]

    def _create_histories(self, dt: float | None) -> list[Column]:
        motion, (name, rate, _, unit, _) = self.motion, self.block.coordinate
        step = checks.positive(self._default_dt if dt is None else dt, "dt", OptionError, "s")
        if self.duration > _MAX_POINTS * step:
            message = f"{{}} = {step:g} s gives more than {_MAX_POINTS:,} points of {self.duration:g} s"
            raise OptionError(f"{message}; use a longer step", "dt", value=dt)
        times = create_times(self.duration, step)
        rotation, velocity, _ = self.states(times).T
        ground = np.zeros_like(times) if motion is None else motion.acceleration(times)
        columns = [Column("time", times, "s"), Column(name, rotation, unit), Column(rate, velocity, f"{unit}/s")]
        if self.friction is not None:
            slips = self._history.slip_states(times, self.block.gravity)
            columns += [Column("slip", slips[:, 0], "m"), Column("slip_velocity", slips[:, 1], "m/s")]
        columns.append(Column("ground_acceleration", ground, "m/s^2"))
        if motion is not None and motion.vertical is not None:
            columns.append(Column("vertical_ground_acceleration", motion.vertical.acceleration(times), "m/s^2"))
        return columns

    def to_dataframe(self, table: str | None = None, *, dt: float | None = None) -> pd.DataFrame:
        """Return a table as a data frame: "histories", "events", "impacts" or "sequences"; names contain units.

        Histories contain rotation, angular velocity and ground acceleration, indexed by ``time_s``, at steps `dt` as
        of `to_xarray`.
        """
        frame = columns_to_frame(self._columns(table or "histories", dt))
        return frame.set_index("time_s") if table in (None, "histories") else frame

    def to_netcdf(self, path: str | Path, dt: float | None = None) -> None:
        """Write `to_xarray` to a NetCDF file, completely or not at all; raises `OutputError` on failure."""
        write_netcdf(path, self.to_xarray(dt))

    def to_csv(self, path: str | Path, table: str | None = None, *, dt: float | None = None) -> None:
        """Write a table of `to_dataframe` as text columns with a header, as `Result.to_csv`."""
        write_csv(path, columns_to_frame(self._columns(table or "histories", dt)))

    def plot(
        self,
        ax: Axes | None = None,
        *,
        rotation_units: RotationUnits = "slenderness",
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
        rotation_units : {"slenderness", "rad", "deg"}
            Units; "slenderness" normalises by the slenderness of the side (or the balance of a restrained block, if
            any).
        window : (start, end), optional
            Interval, s; by default from shortly before the first event to shortly after the last.
        longest_sequence : bool
            Whether to show the longest chattering sequence, impact by impact, in a separate panel.
        """
        title = title or figure.create_title(self)
        return figure.draw_histories(
            self, rotation_units, window, longest_sequence=longest_sequence, title=title, ax=ax, figsize=figsize
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

        Rotations are normalised by the slenderness of their side (or the balance of a restrained block), velocities by
        p times this value. Without a balance, rotations are in rad. Raises `OptionError` also as `kinetic_energy`.
        """
        return figure.draw_phase_plane(self, window, title=title or figure.create_title(self), ax=ax, figsize=figsize)

    def plot_energy(
        self,
        ax: Axes | None = None,
        *,
        window: tuple[float, float] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw kinetic, potential and total energy against time; arguments and errors as of `plot_phase_plane`."""
        return figure.draw_energies(self, window, title=title or figure.create_title(self), ax=ax, figsize=figsize)
