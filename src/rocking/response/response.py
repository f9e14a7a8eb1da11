"""The response of one body to one motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rocking.block import RestrainedBlock
from rocking.core import checks
from rocking.core.result import Row, dictionary_of, text_of
from rocking.core.tables import Column, frame_of, named, records_of, write_csv, write_netcdf
from rocking.errors import InvalidOption
from rocking.response import figure, summary
from rocking.response.figure import RotationUnits
from rocking.response.history import even_times
from rocking.response.perturbed import PRECISION, steps_within
from rocking.response.simulated import Simulated

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Letters of the column of names in a summary.
_WIDTH = 20

#: Points that a computer's memory holds, and those of a history whose motion has no step of its own.
_MOST_POINTS = 50_000_000
_POINTS = 2000


@dataclass(frozen=True, eq=False, repr=False)
class Response(Simulated):
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

    def _headline(self) -> str:
        return summary.line(self)

    def summary_rows(self, friction: float | None = None, *, precision: float = PRECISION) -> Sequence[Row]:
        """Return the lines of `summary` as rows of name, value, unit and note; arguments as there."""
        return summary.summary_rows(self, friction, precision)

    def facts(self, friction: float | None = None, *, precision: float = PRECISION) -> Sequence[Row]:
        """Return the entries of `to_dict` as rows of name, value and unit; arguments as of `summary`."""
        body, motion, limit = self.body, self.motion, self.body.coordinate.limit
        shaken = motion and {
            "name": motion.name,
            named("duration", "s"): motion.duration,
            named("pga", "m/s^2"): motion.pga,
            "history": motion.history,
            "vertical": motion.vertical and {"name": motion.vertical.name, named("pga", "m/s^2"): motion.vertical.pga},
        }
        rows = [Row("block", {"description": body.description, **self._parameters()}), Row("motion", shaken)]
        rows += self._outcome_rows()
        if limit:
            rows.append(Row(f"peak_over_{limit}", self.peak_over_slenderness))
        if isinstance(body, RestrainedBlock):
            rows.append(Row("balance", list(self.balance), body.coordinate.unit))
            rows.append(Row("tendons", records_of(self._structured("tendons"))))
        rows.append(Row("peak_time", self.peak_time, "s"))
        if body.contact is not None:
            rows.append(Row("required_friction", self.required_friction))
            rows.append(Row("minimum_normal_force_over_weight", self.minimum_normal_force))
            rows.append(Row("lift_off_time", self.lift_off_time, "s"))
        if friction is not None:
            rows += [Row("friction", friction), Row("sliding_time", self.sliding_time(friction), "s")]
        near = [self.perturbed().to_dict(), self.perturbed(*steps_within(precision)).to_dict()]
        return [
            *rows,
            Row("impacts_resolved", len(self.impacts)),
            Row("duration", self.duration, "s"),
            Row("time_at_rest", self.time_at_rest, "s"),
            Row("perturbed", near),
            Row("ambiguous", self.ambiguous),
            Row("ambiguities", self.ambiguities),
            Row("events", records_of(self._structured("events"))),
            Row("chattering", records_of(self._structured("chattering"))),
        ]

    def _parameters(self) -> dict[str, Any]:
        of_body = self.body.alone().parameters().items()
        gravity = {named("gravity", "m/s^2"): self.body.gravity}
        return {named(name, unit): values[0].tolist() for name, (values, unit) in of_body} | gravity

    def _outcome_rows(self) -> list[Row]:
        name, unit = self.body.coordinate.name, self.body.coordinate.unit
        return [
            Row("model", self.model),
            Row("chattering_treatment", repr(self.treatment)),
            *(Row(flag, getattr(self, flag)) for flag in ("overturned", "unfinished", "stopped", "leans")),
            Row("overturn_time", self.overturn_time, "s"),
            Row("tipping_time", self.tipping_time, "s"),
            Row(f"peak_{name}", self.peak_rotation, unit),
            Row(f"residual_{name}", self.residual_rotation, unit),
        ]

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
        import xarray as xr

        time, *histories = self._columns("histories", dt)
        variables: dict[str, Any] = {each.name: ("time", each.values, {"units": each.unit}) for each in histories}
        for table, dimension in (("events", "event"), ("impacts", "impact"), ("chattering", "sequence")):
            for name, values, unit, _ in self._columns(table):
                column = values.astype(object) if values.dtype.kind == "U" else values
                variables[f"{dimension}_{name}"] = (dimension, column, {"units": unit})
        motion = self.motion
        rows = [row for row in self._outcome_rows() if row.name != "tipping_time"]
        rows += [Row("peak_time", self.peak_time, "s"), Row("ambiguous", self.ambiguous)]
        attributes = {
            "block": self.body.description,
            **self._parameters(),
            "motion": "none" if motion is None else motion.name,
            "vertical_motion": "none" if motion is None or motion.vertical is None else motion.vertical.name,
            "motion_history": "" if motion is None else "; ".join(motion.history),
            **{named(row.name, row.unit): int(row.value) if isinstance(row.value, bool) else row.value for row in rows},
        }
        return xr.Dataset(variables, {"time": ("time", time.values, {"units": "s"})}, attributes)

    def _columns(self, table: str, dt: float | None = None) -> list[Column]:
        checks.one_of(table, "table", InvalidOption, self.TABLES)
        if table == "histories":
            return self._histories(dt)
        if dt is not None:
            raise InvalidOption(f"{{}} is the step of the histories; the {table} have none", "dt")
        return self._structured(table)

    def _structured(self, table: str) -> list[Column]:
        rows, speed = getattr(self, table), f"{self.body.coordinate.unit}/s"
        units = {"kind": "1", "side": "1", "impacts": "1", "speed_before": speed, "speed_after": speed}
        units |= {"elongation": "m", "force": "N", "plastic_elongation": "m"}
        return [Column(name, rows[name], units.get(name, "s")) for name in rows.dtype.names]

    def _histories(self, dt: float | None) -> list[Column]:
        motion, (name, rate, _, unit, _) = self.motion, self.body.coordinate
        if dt is None:
            step = motion and motion.step
            # A pulse of a few straight lines has a step, too, that shows nothing.
            dt = step if step and step <= 0.01 * self.duration else max(self.duration, 1e-3) / _POINTS
        step = checks.positive(dt, "dt", InvalidOption, "s")
        if self.duration > _MOST_POINTS * step:
            most = f"more than {_MOST_POINTS:,} points of {self.duration:g} s"
            raise InvalidOption(f"{{}} = {step:g} s makes {most}; take a longer step", "dt", value=dt)
        times = even_times(self.duration, step)
        states = self.states(times)
        columns = [
            Column("time", times, "s"),
            Column(name, states[:, 0], unit),
            Column(rate, states[:, 1], f"{unit}/s"),
        ]
        ground = np.zeros_like(times) if motion is None else motion.acceleration(times)
        columns.append(Column("ground_acceleration", ground, "m/s^2"))
        if motion is not None and motion.vertical is not None:
            columns.append(Column("vertical_ground_acceleration", motion.vertical.acceleration(times), "m/s^2"))
        return columns

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
