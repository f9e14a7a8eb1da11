"""Erosion of the safe basin: how the share of initial states that do not overturn shrinks as the motion grows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import VERSION, Model
from rocking.dynamics.basin_grid import TO_MINUS, TO_PLUS, Grid
from rocking.dynamics.basin_maps import grid_of
from rocking.dynamics.repeated import described, one_period
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.progress import Progress, note
from rocking.result import DatasetResult, table_of_some, variable
from rocking.tables import as_written
from rocking.treatment import Treatment

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class BasinErosion(DatasetResult):
    """Share of initial states that do not overturn, against a factor on the motion; from `safe_basin_erosion`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (factor): safe, the share of the states that do not overturn in so many periods, with its standard_error
        as that of as many random states; to_plus and to_minus, the shares that overturn to either side.
    """

    TABLES = MappingProxyType({"erosion": ("safe", "standard_error", "to_plus", "to_minus")})

    def summary(self) -> str:
        data = self.data
        rows = [
            [f"{factor:.4g}", f"{100.0 * safe:.2f} %", f"{100.0 * error:.2f} %"]
            for factor, safe, error in zip(
                data.factor.values, data.safe.values, data.standard_error.values, strict=True
            )
        ]
        head = f"safe basin of {data.body} under multiples of {data.motion}: {data.cells} states"
        return "\n".join([head, "", table_of_some(["factor", "do not overturn", "standard error"], rows)])

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            "body": data.body,
            "motion": data.motion,
            "model": data.model,
            "periods": data.most_periods,
            "states": data.cells,
            "factor": data.factor.values,
            **{name: data[name].values for name in self.TABLES["erosion"]},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.basins import erosion_figure

        data = self.data
        return erosion_figure(
            factor=data.factor.values,
            safe=data.safe.values,
            error=data.standard_error.values,
            x_label="factor on the motion",
            title=title or as_written(f"{data.body} under multiples of {data.motion}, {data.model} model"),
            ax=ax,
            figsize=figsize,
        )


def safe_basin_erosion(
    body: Body,
    motion: Motion,
    factors: ArrayLike,
    positions: ArrayLike,
    velocities: ArrayLike,
    periods: int = 200,
    *,
    model: Model | None = None,
    chattering: str | Treatment = "certified",
    folder: str | Path | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> BasinErosion:
    """Find how the safe basin of a body shrinks as a periodic motion grows.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        What moves; those between stops do not overturn.
    motion : Motion
        One period, which repeats for ever.
    factors : array_like, shape (k,)
        Increasing factors on the motion.
    positions, velocities : array_like
        Initial states, as for `basins`: the share is that of this grid.
    periods : int
        Most periods that a state is followed for.
    model : {"nonlinear", "linear"}, optional
        As for `stroboscopic_map`.
    chattering : str or treatment
        As for `rocking.simulate`.
    folder : str or pathlib.Path, optional
        Where to keep what was computed, again and again, each factor in a folder of its own; a call with the same
        arguments goes on from there, and one with other factors takes those that it finds.
    threads : int, optional
        Number of threads; by default one for every core.
    progress : bool, optional
        Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

    Returns
    -------
    BasinErosion
        Shares of the states that do not overturn; after an interrupt, for the factors that were reached.

    Raises
    ------
    InvalidMotion
        If the motion is none, or has no length.
    InvalidOption
        If an argument is out of its range, or the folder holds basins of something else.

    References
    ----------
    J. M. T. Thompson, "Chaotic phenomena triggering the escape from a potential well", Proceedings of the Royal Society
    A 421 (1989). S. Lenci and G. Rega, "A dynamical systems approach to the overturning of rocking blocks", Chaos,
    Solitons and Fractals 28 (2006).

    Examples
    --------
    >>> import numpy as np, rocking
    >>> from rocking import dynamics
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> shaking = rocking.pulses.sine(1.0, 1.2, cycles=1)
    >>> grid = np.linspace(-0.19, 0.19, 15), np.linspace(-0.38, 0.38, 15)
    >>> dynamics.safe_basin_erosion(block, shaking, [1.0, 3.0, 6.0], *grid, periods=50).safe.values.round(2)
    array([0.59, 0.44, 0.05])
    """
    import xarray as xr

    levels = checks.increasing_numbers(factors, "factors", InvalidOption)
    unit = one_period(motion)
    place = None if folder is None else checks.path(folder, "folder", InvalidOption)
    found: list[Grid] = []
    try:
        with Progress("eroding", len(levels), show=progress) as bar:
            for factor in levels.tolist():
                inside = None if place is None else place / f"factor-{factor!r}"
                grid = grid_of(
                    body, unit.scaled(factor), positions, velocities, periods, model, chattering, inside, threads
                )
                grid.run(progress=False)
                found.append(grid)
                bar.advance()
    except KeyboardInterrupt:
        if not found:
            raise
        note("interrupted: the erosion holds the factors that were reached")
    levels, cells = levels[: len(found)], found[0].outcome.size
    shares = (
        np.array([[np.count_nonzero(each.outcome == way) for way in (TO_PLUS, TO_MINUS)] for each in found]) / cells
    )
    safe: Floats = 1.0 - shares.sum(axis=1)
    error = np.sqrt(np.maximum(safe * (1.0 - safe), 0.0) / cells)
    return BasinErosion(
        xr.Dataset(
            {
                "safe": variable("factor", safe, "share of the states that do not overturn", "1"),
                "standard_error": variable("factor", error, "of the share, as of random states", "1"),
                "to_plus": variable("factor", shares[:, 0], "share that overturns to side +", "1"),
                "to_minus": variable("factor", shares[:, 1], "share that overturns to side -", "1"),
            },
            {"factor": variable("factor", levels, "factor on the motion", "1")},
            {
                "program": f"rocking {VERSION}",
                "body": described(found[0].strobe.body),
                "motion": described(unit),
                "model": found[0].strobe.model,
                "most_periods": found[0].periods,
                "cells": cells,
            },
        )
    )
