"""Peak rotations of a study, read a range of blocks at a time: all that its post-processing needs; their fractiles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.fragility.curve import checked_limit
from rocking.analysis.levels import ratios_of
from rocking.analysis.spectrum import fractiles_of, overturned_share
from rocking.arrays import Floats, Integers, evenly
from rocking.body import Bodies
from rocking.engine import missing_text
from rocking.ensemble import body_coordinates
from rocking.errors import InvalidOption, StudyError
from rocking.motion.scaling import Measure
from rocking.problem import slenderness_of
from rocking.progress import Progress
from rocking.result import DatasetResult, table_of_some
from rocking.studies.inputs import require
from rocking.studies.store import Store
from rocking.tables import as_written, counted

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Simulations that are held in memory at a time.
_HELD: Final = 4_000_000

#: Scales that a table or a figure shows.
_SCALES: Final = 4

FRACTILES: Final = (0.16, 0.5, 0.84)


def require_ratios(kept: Sequence[str], what: str, *arguments: str) -> None:
    """Check that peak rotations over slenderness follow from the outcomes that are kept."""
    require(kept, ["overturned", "peak_rotation"], what, *arguments)


def require_limits(kept: Sequence[str], limits: Mapping[str, float]) -> None:
    """Check that it follows from these outcomes whether limits are passed: overturning needs no peak rotation."""
    finite = [name for name, limit in limits.items() if math.isfinite(checked_limit(limit, name))]
    if finite:
        require_ratios(kept, f"{{}}.{finite[0]}", "limits")
    else:
        require(kept, ["overturned"], "a fragility")


def polarities_that_count(bodies: Bodies, polarities: int) -> Integers:
    """Return how many polarities have outcomes of their own, for each body: a symmetric one does the same in both."""
    if bodies.is_symmetric or polarities == 1:
        return np.ones(len(bodies), int)
    alone = (bodies.select(slice(k, k + 1)) for k in range(len(bodies)))
    return np.array([1 if each.is_symmetric else polarities for each in alone])


def peak_ratios(store: Store) -> Iterator[tuple[slice, Floats]]:
    """Peak rotation over the slenderness, infinite where a block overturned, for a range of blocks after the other.

    It is NaN where the simulation was given up. Of blocks that stand it is 0 where the study keeps no peak rotation:
    whoever needs it asks `require_ratios` first.

    Yields
    ------
    blocks : slice
        Which blocks.
    ratios : ndarray, shape (motions, scales, polarities, blocks of the range)
        Over the smaller one of two slendernesses; where all blocks of the study are symmetric, only the first of two
        polarities, since the second is no other outcome. Where some are, `polarities_that_count` says which.

    Raises
    ------
    StudyError
        If units are missing or damaged, or the study's duration stopped simulations before their end.
    """
    store.require_complete()
    motions, scales, polarities, _ = store.grid.shape
    shape = motions, scales, 1 if store.product.bodies.is_symmetric else polarities
    width = max(1, _HELD // math.prod(shape))
    for unit in range(store.grid.cells[-1]):
        *_, whole = store.grid.ranges((0, 0, 0, unit))
        for start in range(whole.start, whole.stop, width):
            blocks = slice(start, min(start + width, whole.stop))
            yield blocks, _read(store, shape, unit, blocks)


def _read(store: Store, shape: tuple[int, int, int], unit: int, blocks: slice) -> Floats:
    alpha = slenderness_of(store.product.bodies.select(blocks))
    ratios = np.empty((*shape, len(alpha)))
    for cell in np.ndindex(store.grid.cells[:3]):
        key = *cell, unit
        motions, scales, polarities, whole = store.grid.ranges(key)
        some = slice(blocks.start - whole.start, blocks.stop - whole.start)
        outcomes = {name: values[..., some] for name, values in store.present(key).items()}
        stopped = int(np.count_nonzero(outcomes["stopped"]))
        if stopped:
            raise StudyError(
                f"{stopped} of {outcomes['stopped'].size} simulations of a unit were stopped by the study's duration, "
                "while the block moved or the motion went on, so that their verdicts are not known: make the study "
                "without a duration"
            )
        there = ratios[motions, scales, polarities]
        peak = outcomes.get("peak_rotation", np.zeros_like(outcomes["overturned"]))
        found = ratios_of(peak, outcomes["overturned"] != 0.0, outcomes["unfinished"] != 0.0, alpha)
        there[...] = found[:, :, : there.shape[2]]
    return ratios


@dataclass(frozen=True, eq=False, repr=False)
class BlocksResult(DatasetResult):
    """Result of a study that has a dimension ``block``, whose parameters are coordinates."""

    @property
    def block_parameters(self) -> dict[str, Floats]:
        """Parameters of the blocks by name, SI units: those that tables list."""
        return {str(name): one.values for name, one in self.data.coords.items() if one.dims == ("block",)}

    def _plane(self) -> tuple[Floats, Floats]:
        """Frequency parameters (rad/s) and slendernesses (rad) of the blocks: means of unequal sides."""
        parameters = self.block_parameters
        p, alpha = (
            np.mean([parameters[one] for one in (name, f"{name}_plus", f"{name}_minus") if one in parameters], axis=0)
            for name in ("p", "alpha")
        )
        return p, alpha


def study_spectrum(store: Store, fractiles: Sequence[float] = FRACTILES, progress: bool | None = None) -> StudySpectrum:
    """Fractiles over motions and polarities of peak rotation over slenderness, for each scale and block."""
    import xarray as xr

    require_ratios(store.grid.outcomes, "a spectrum")
    shares = checked_fractiles(fractiles)
    product, count = store.product, len(store.product.bodies)
    values = np.empty((len(shares), product.scales.count, count))
    overturned, missing = np.empty((product.scales.count, count)), 0
    with Progress("reading", count, show=progress) as bar:
        for blocks, ratios in peak_ratios(store):
            counted = polarities_that_count(product.bodies.select(blocks), ratios.shape[2])
            for polarities in np.unique(counted):
                some = np.flatnonzero(counted == polarities)
                own = ratios[:, :, :polarities, some]
                pooled = own.swapaxes(1, 2).reshape(-1, product.scales.count, some.size)
                values[:, :, blocks.start + some] = fractiles_of(pooled, shares)
                overturned[:, blocks.start + some] = overturned_share(pooled)
                missing += int(np.count_nonzero(np.isnan(pooled)))
            bar.advance(blocks.stop - blocks.start)
    words = "peak rotation over the slenderness, infinite where that share overturns"
    return StudySpectrum(
        xr.Dataset(
            {
                "fractile_over_alpha": (("fractile", "scale", "block"), values, {"units": "1", "long_name": words}),
                "overturned_share": (("scale", "block"), overturned, {"units": "1"}),
            },
            {
                "fractile": shares,
                "scale": ("scale", product.scales.values, product.scales.about),
                **body_coordinates(product.bodies),
            },
            {"motions": len(product.motions), "model": product.model, **missing_attribute(missing)},
        )
    )


def missing_attribute(missing: int) -> dict[str, str]:
    """Return what a result of a study says on simulations that were given up; nothing where there are none."""
    return {"missing": missing_text(missing)} if missing else {}


def checked_fractiles(fractiles: Sequence[float]) -> Floats:
    """Return shares between 0 and 1, checked."""
    shares = checks.numbers(fractiles, "fractiles", InvalidOption).ravel()
    if not shares.size:
        raise InvalidOption("{} must hold a share of the motions or more, as [0.16, 0.5, 0.84]", "fractiles")
    for value in shares:
        if not 0.0 < value < 1.0:
            raise InvalidOption(
                f"each of {{}} must be a number between 0 and 1, not {value:g}", "fractiles", value=value
            )
    return shares


@dataclass(frozen=True, eq=False, repr=False)
class StudySpectrum(BlocksResult):
    """Peak rotations of every block at every scale; from `Study.spectrum`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (fractile, scale, block): fractile_over_alpha, infinite where that share of the motions overturns the
        block. Over (scale, block): overturned_share. Parameters of the blocks are coordinates.
    """

    TABLES = MappingProxyType({"fractiles": ("fractile_over_alpha", "overturned_share")})

    def summary(self) -> str:
        data, one = self.data, self._fractile(0.5)
        parameters, chosen = self.block_parameters, self._some_scales()
        header = ["block", *parameters, *(self._scale_name(i) for i in chosen)]
        rows = [
            [
                j,
                *(float(values[j]) for values in parameters.values()),
                *("overturns" if np.isinf(value) else float(value) for value in one.values[chosen, j]),
            ]
            for j in range(data.sizes["block"])
        ]
        what = f"{100 * float(one.fractile):g} % fractile of peak rotation over slenderness"
        return f"{what}; {self._about()}\n\n{table_of_some(header, rows)}"

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            **data.attrs,
            **{name: value for name, value in data.scale.attrs.items() if name != "units"},
            "scale": data.scale.values,
            "blocks": self.block_parameters,
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
        from rocking.plot.maps import blocks_figure

        one = self._fractile(fractile)
        return blocks_figure(
            *self._plane(),
            panels={self._scale_name(i): one.values[i] for i in self._some_scales()},
            value_label=f"{100 * float(one.fractile):g} % fractile of peak rotation over slenderness",
            missing_label="so many motions overturn the block that there is none",
            title=title or as_written(self._about()),
            ax=ax,
            figsize=figsize,
        )

    def _table(self, name: str) -> xr.Dataset:
        # A table's column is named for what the scales are, as in an export: pga_m_s2, or factor.
        return super()._table(name).rename(scale=self.data.scale.attrs["measure"])

    def _fractile(self, wanted: float) -> xr.DataArray:
        """Return the fractile that is nearest to the wanted one."""
        nearest = int(np.argmin(np.abs(self.data.fractile.values - wanted)))
        found: xr.DataArray = self.data.fractile_over_alpha.isel(fractile=nearest)
        return found

    def _about(self) -> str:
        """Say what the figure and the table are about, and of which scales."""
        motions, scales, shown = int(self.data.motions), self.data.sizes["scale"], len(self._some_scales())
        left_out = f"; {shown} of {scales} scales are shown" if shown < scales else ""
        missing = f"; {self.data.missing}" if "missing" in self.data.attrs else ""
        return f"{counted(motions, 'motion')}, {self.data.model} model{left_out}{missing}"

    def _some_scales(self) -> list[int]:
        return evenly(self.data.sizes["scale"], _SCALES)

    def _scale_name(self, i: int) -> str:
        value, about = float(self.data.scale.values[i]), self.data.scale.attrs
        if about["measure"] == "factor":
            return f"factor {value:.4g}"
        measure = Measure(about["measure"], *(about[name] for name in ("period", "damping") if name in about))
        return f"{measure.short_name} {measure.scale * value:.4g} {measure.shown_in}"
