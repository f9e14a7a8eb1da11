"""The response of one body to one motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from rocking import svg
from rocking.plot.response import RotationUnits
from rocking.response import export, phase, summary
from rocking.response.answers import Answers
from rocking.response.perturbed import PRECISION
from rocking.result import Result, Row, dictionary_of, text_of
from rocking.tables import Column, write_csv, write_netcdf

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Letters of the column of names in a summary.
_WIDTH = 20

#: Rotations beyond this multiple of the slenderness are cut in a notebook's picture: past it a block only falls.
_HIGHEST_PICTURED = 2.0


@dataclass(frozen=True, eq=False, repr=False)
class Response(Answers, Result):
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
    """

    TABLES = get_args(export.ResponseTable)

    def _columns(self, table: str) -> list[Column]:
        return [Column(name, values, unit) for name, (values, unit) in export._columns(self, table).items()]

    def _headline(self) -> str:
        return summary.line(self)

    def _repr_html_(self) -> str:
        start, end = export.active_span(self)
        times = export.drawing_times(self, start, end)
        coordinate, (plus, minus) = self.body.coordinate, self.balance
        drawn, label = self.states(times)[:, 0], f"{coordinate.name} ({coordinate.unit})"
        if coordinate.limit and math.isfinite(min(plus, minus)):
            drawn = drawn / np.where((drawn >= 0.0) & math.isfinite(plus) | (not math.isfinite(minus)), plus, minus)
            drawn = np.clip(drawn, -_HIGHEST_PICTURED, _HIGHEST_PICTURED)
            label = f"{coordinate.name} / {coordinate.limit}"
        return svg.captioned(f"Response: {self._headline()}", svg.history(times, drawn, label))

    def summary_rows(self, friction: float | None = None, *, precision: float = PRECISION) -> Sequence[Row]:
        """Return what happened for people, as rows of name, value, unit and note: the lines of `summary`.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction: says whether the block would slide, and when first.
        precision : float
            Relative precision of the ground motion, from 1e-6 to 0.1: the outcome is also counted within it.

        Returns
        -------
        sequence of Row
            One for each line.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> response.summary_rows()[-2]
        Row(name='outcome', value='overturns in 5 of 5 motions within 3e-6, at 1.53202 s', unit='1', note='')
        """
        return summary.summary_rows(self, friction, precision)

    def facts(self, friction: float | None = None, *, precision: float = PRECISION) -> Sequence[Row]:
        """Return what happened for machines, as rows of name, value and unit: the entries of `to_dict`.

        Parameters
        ----------
        friction : float, optional
            As for `summary_rows`.
        precision : float
            As for `summary_rows`.

        Returns
        -------
        sequence of Row
            One for each entry.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> response.facts()[4]
        Row(name='overturned', value=True, unit='1', note='')
        """
        return summary.facts(self, friction, precision)

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
        overturn            1.53202 s
        impacts resolved    1
        peak rotation       1.5708 rad at 1.5320 s, where the block has fallen
        friction needed     0.2372, until it tips at 0.9319 s
        least normal force  0.8919 of the weight, until it tips at 0.9319 s
        outcome             overturns in 5 of 5 motions within 3e-6, at 1.53202 s
                            overturns in 11 of 11 motions within 0.1 %
        """
        return text_of(self.summary_rows(friction, precision=precision), _WIDTH)

    def to_dict(self, friction: float | None = None, *, precision: float = PRECISION) -> dict[str, Any]:
        """Return the result in plain values for machines, as ``rocking simulate --json`` prints it.

        Units are in the names; None stands for what is not a finite number.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction: says whether the block would slide, and when first.
        precision : float
            Relative precision of the ground motion, from 1e-6 to 0.1: the outcome is also counted within it.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> result = response.to_dict()
        >>> result["overturned"], result["lift_off_time_s"], result["events"][0]["kind"]
        (True, None, 'uplift')
        """
        return dictionary_of(self.facts(friction, precision=precision))

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

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> dict(response.to_xarray(dt=0.1).sizes)
        {'time': 16, 'event': 2, 'impact': 1, 'sequence': 0}
        """
        return export.dataset(self, dt)

    def to_dataframe(self, table: str | None = None, *, dt: float | None = None) -> pd.DataFrame:
        """Return one of the response's tables as a data frame; columns are named with their units.

        Parameters
        ----------
        table : {"histories", "events", "impacts", "chattering"}
            Rotation, angular velocity and ground acceleration over time (the index, ``time_s``), or the rows of
            `events`, `impacts` or `chattering`.
        dt : float, optional
            Step of the histories, s; by default the motion's own, or a two-thousandth of the duration.

        Returns
        -------
        pandas.DataFrame
            A row for each time, event, impact or sequence.

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
        return export.frame(self, table or "histories", dt)

    def to_netcdf(self, path: str | Path, dt: float | None = None) -> None:
        """Write `to_xarray` to a NetCDF file.

        Parameters
        ----------
        path : path
            File to write.
        dt : float, optional
            As for `to_xarray`.

        Raises
        ------
        OutputError
            If the file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> response.to_netcdf(pathlib.Path(tempfile.mkdtemp()) / "response.nc", dt=0.1)
        """
        write_netcdf(path, export.dataset(self, dt))

    def to_csv(self, path: str | Path, table: str | None = None, *, dt: float | None = None) -> None:
        """Write one of the tables of `to_dataframe` as text columns with a header.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, whole or not at all.
        table : {"histories", "impacts", "events", "chattering"}
            The table, as `to_dataframe` takes it.
        dt : float, optional
            Step of the histories, s.

        Raises
        ------
        InvalidOption
            As `to_dataframe`.
        OutputError
            If the file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "impacts.csv"
        >>> response.to_csv(file, "impacts")
        >>> file.read_text().splitlines()[0]
        'time_s,side,speed_before_rad_s,speed_after_rad_s'
        """
        write_csv(path, self.to_dataframe(table, dt=dt), index=table in (None, "histories"))

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
        """Figure of the rotation with impacts and rests, and of the motion with thresholds.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Draw the rotation here, without the other panels.
        units : {"slenderness", "rad", "deg"}
            What rotations are drawn in: over the slenderness of their side (of a restrained block over its balance, if
            it has one), or as they are.
        window : (start, end), optional
            Stretch of time to draw, s; by default from a little before the first event to a little after the last.
        longest_sequence : bool
            Whether to show the longest chattering sequence, impact by impact, in a panel of its own.
        title : str
            Title; by default what was simulated.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Raises
        ------
        InvalidOption
            If there is no such unit, the window is not a stretch of the response, or the size is not one.
        """
        return export.figure(self, units, window, title, ax, figsize, longest_sequence=longest_sequence)

    def plot_phase_plane(
        self,
        ax: Axes | None = None,
        *,
        window: tuple[float, float] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Figure of the velocity against the rotation, with impacts as jumps and the energy of the balance.

        Rotations are over the slenderness of their side (of a restrained block over its balance), velocities over p
        times that; where a side has no balance, rotations are in rad.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Draw here.
        window : (start, end), optional
            Stretch of time to draw, s; by default as of `plot`.
        title : str
            Title; by default what was simulated.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.

        Raises
        ------
        InvalidOption
            As `kinetic_energy`, and if the window is not a stretch of the response, or the size is not one.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> response.plot_phase_plane(window=(0.0, 1.2)).axes[0].get_xlabel()
        'rotation / slenderness'
        """
        return phase.phase_plane(self, window, title, ax, figsize)

    def plot_energy(
        self,
        ax: Axes | None = None,
        *,
        window: tuple[float, float] | None = None,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Figure of kinetic, potential and total energy over time, over the least energy that overturns the block.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Draw here.
        window : (start, end), optional
            Stretch of time to draw, s; by default as of `plot`.
        title : str
            Title; by default what was simulated.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.

        Raises
        ------
        InvalidOption
            As `plot_phase_plane`.

        Examples
        --------
        >>> import rocking
        >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
        >>> response.plot_energy(window=(0.0, 1.2)).axes[0].get_ylabel()
        'energy / least that overturns'
        """
        return phase.energy_over_time(self, window, title, ax, figsize)
