"""Levels that were looked at and the bands of them that overturn, in words: never more than was looked at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rocking.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Levels:
    """Levels that motions were scaled to.

    Attributes
    ----------
    at : ndarray
        Levels as people read them: accelerations in g.
    unit : str
        Their unit, after a blank; empty if they have none.
    scale : float
        Factor from SI units.
    """

    at: Floats
    unit: str
    scale: float

    @classmethod
    def of(cls, data: xr.Dataset) -> Levels:
        """Levels of an incremental dynamic analysis."""
        level = data.level
        unit = {"m/s^2": " g", "m/s": " m/s", "1": ""}[level.units]
        return cls(level.scale * level.values, unit, level.scale)

    def summary(self, lowest_uplift: float) -> str:
        """Say what was looked at, and whether it is all below the level (SI) from which on a motion lifts a block."""
        count = f"{len(self.at)} levels" if len(self.at) > 1 else "1 level"
        text = f"looked at: {count}, {self._range(self.at[0], self.at[-1])}{self._step()}"
        lifting = self.scale * lowest_uplift
        if self.at[-1] < lifting:
            text += f"\nnone of them lifts a block; that begins at {lifting:.5g}{self.unit}: are the levels right?"
        return text

    def overturning(self, bands: Sequence[tuple[float, float]]) -> str:
        """Bands that overturn (SI); beyond the levels nothing is known of them, which is NaN."""
        if not bands:
            return f"at no level looked at, {self._range(self.at[0], self.at[-1])}"
        return "; ".join(self._band(self.scale * low, self.scale * high) for low, high in bands)

    def _band(self, low: float, high: float) -> str:
        if not (math.isnan(low) or math.isnan(high)):
            return f"{low:.5g} to {high:.5g}"
        if math.isnan(low) and math.isnan(high):
            return f"at every level looked at, {self._range(self.at[0], self.at[-1])}"
        open_end = f"up to {high:.5g}{self.unit}" if math.isnan(low) else f"from {low:.5g}{self.unit} on"
        return f"at all levels looked at {open_end}"

    def _range(self, low: float, high: float) -> str:
        return f"{low:.5g}{self.unit}" if low == high else f"{low:.5g} to {high:.5g}{self.unit}"

    def _step(self) -> str:
        """How far neighbouring levels are apart; what lies between two of the same verdict is not seen."""
        if len(self.at) == 1:
            return ""
        steps, ratios = np.diff(self.at), self.at[1:] / self.at[:-1]
        if np.allclose(steps, steps[0], rtol=1e-6):
            apart = f"{steps[0]:.5g}{self.unit} apart"
        elif np.allclose(ratios, ratios[0], rtol=1e-6):
            apart = f"{100.0 * (ratios[0] - 1.0):.3g} % apart"
        else:
            apart = f"up to {steps.max():.5g}{self.unit} apart"
        return f", {apart}; bands and gaps that lie between two of them are not seen"
