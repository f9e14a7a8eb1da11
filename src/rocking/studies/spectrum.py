"""Peak rotations of a study, by block and scale: fractiles over the motions, and the share that overturns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.spectrum import fractiles_of
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.product import body_coordinates
from rocking.result import Result, table_of_some
from rocking.studies.fragility import plane_of
from rocking.studies.ratios import peak_ratios, require_ratios
from rocking.studies.store import Store
from rocking.tables import counted

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Scales that a table or a figure shows.
_SCALES: Final = 4

FRACTILES: Final = (0.16, 0.5, 0.84)


def study_spectrum(store: Store, fractiles: Sequence[float] = FRACTILES) -> StudySpectrum:
    """Fractiles over motions and polarities of peak rotation over slenderness, for each scale and block."""
    import xarray as xr

    require_ratios(store.grid.outcomes, "a spectrum")
    shares = np.array([checks.share(value, "each of fractiles", InvalidOption) for value in fractiles])
    product, count = store.product, store.grid.shape[3]
    values = np.empty((len(shares), product.scales.count, count))
    overturned = np.empty((product.scales.count, count))
    for blocks, ratios in peak_ratios(store):
        pooled = ratios.swapaxes(1, 2).reshape(-1, product.scales.count, ratios.shape[3])
        values[:, :, blocks] = fractiles_of(pooled, shares)
        overturned[:, blocks] = np.isinf(pooled).mean(axis=0)
    about = {"measure": product.scales.measure or "factor", "units": product.scales.units}
    words = "peak rotation over the slenderness, infinite where that share overturns"
    return StudySpectrum(
        xr.Dataset(
            {
                "fractile_over_alpha": (("fractile", "scale", "block"), values, {"units": "1", "long_name": words}),
                "overturned_share": (("scale", "block"), overturned, {"units": "1"}),
            },
            {
                "fractile": shares,
                "scale": ("scale", product.scales.values, about),
                **body_coordinates(product.bodies),
            },
            {"motions": len(product.motions), "model": product.model},
        )
    )


@dataclass(frozen=True, eq=False, repr=False)
class StudySpectrum(Result):
    """Peak rotations of every block at every scale; from `Study.spectrum`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (fractile, scale, block): fractile_over_alpha, infinite where that share of the motions overturns the
        block. Over (scale, block): overturned_share. Parameters of the blocks are coordinates.
    """

    TABLES = MappingProxyType({"fractiles": ("fractile_over_alpha", "overturned_share")})

    def summary(self) -> str:
        """Medians (or the fractile next to it) of some blocks at up to four scales."""
        data, one = self.data, self._fractile(0.5)
        names = [str(name) for name in data.coords if data[name].dims == ("block",)]
        chosen = self._some_scales()
        header = ["block", *names, *(self._scale_name(i) for i in chosen)]
        rows = [
            [
                j,
                *(float(data[name].values[j]) for name in names),
                *("overturns" if np.isinf(value) else float(value) for value in one.values[chosen, j]),
            ]
            for j in range(data.sizes["block"])
        ]
        what = f"{100 * float(one.fractile):g} % fractile of peak rotation over slenderness"
        return f"{what}; {self._about()}\n\n{table_of_some(header, rows)}"

    def to_dict(self) -> dict[str, Any]:
        """Axes, fractiles and shares by name."""
        data = self.data
        return {
            **data.attrs,
            "measure": data.scale.attrs["measure"],
            "scale": data.scale.values,
            "blocks": {str(name): data[name].values for name in data.coords if data[name].dims == ("block",)},
            "fractile": data.fractile.values,
            "fractile_over_alpha": data.fractile_over_alpha.values,
            "overturned_share": data.overturned_share.values,
        }

    def plot(
        self,
        ax: Axes | None = None,
        *,
        fractile: float = 0.5,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw a fractile of each block over its frequency parameter and slenderness, at up to four scales.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw, if there is one scale.
        fractile : float
            Which one; the nearest there is.
        title : str
            Title; by default the number of motions, the model, and how many scales are shown.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Raises
        ------
        InvalidOption
            If there are several scales for the one `ax`.
        """
        from rocking.plot import blocks_figure

        one = self._fractile(fractile)
        return blocks_figure(
            *plane_of(self.data),
            panels={self._scale_name(i): one.values[i] for i in self._some_scales()},
            value_label=f"{100 * float(one.fractile):g} % fractile of peak rotation over slenderness",
            missing_label="so many motions overturn the block that there is none",
            title=title or self._about(),
            ax=ax,
            figsize=figsize,
        )

    def _fractile(self, wanted: float) -> xr.DataArray:
        """Return the fractile that is nearest to the wanted one."""
        nearest = int(np.argmin(np.abs(self.data.fractile.values - wanted)))
        found: xr.DataArray = self.data.fractile_over_alpha.isel(fractile=nearest)
        return found

    def _about(self) -> str:
        """Say what the figure and the table are about, and of which scales."""
        motions, scales, shown = int(self.data.motions), self.data.sizes["scale"], len(self._some_scales())
        left_out = f"; {shown} of {scales} scales are shown" if shown < scales else ""
        return f"{counted(motions, 'motion')}, {self.data.model} model{left_out}"

    def _some_scales(self) -> list[int]:
        count = self.data.sizes["scale"]
        return sorted({round(k) for k in np.linspace(0, count - 1, min(count, _SCALES))})

    def _scale_name(self, i: int) -> str:
        value, about = float(self.data.scale.values[i]), self.data.scale.attrs
        if about["units"] == "m/s^2":
            return f"{about['measure'].upper()} {value / STANDARD_GRAVITY:.4g} g"
        return f"{about['measure'].upper()} {value:.4g} m/s" if about["units"] == "m/s" else f"factor {value:.4g}"
