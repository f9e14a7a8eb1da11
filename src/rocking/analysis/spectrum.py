"""Rocking spectra: peak rotation against the size of the block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.levels import (
    RATIO_VARIABLES,
    compute_ratios,
    create_motion_labels,
    describe_motions,
    describe_pool,
    list_missing_notes,
    normalise_weights,
    split_curves,
)
from rocking.block import Blocks
from rocking.block.bodies import resolve_p
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.core.result import DatasetResult, create_variable, format_some_rows
from rocking.core.tables import add_unit, escape_dollars
from rocking.engine.problem import gather_bodies
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.records.named import Motions, list_motions
from rocking.simulation.ensemble import simulate_many

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Abscissa = Literal["p", "period", "size"]


_MEDIAN_SHARE: Final = np.array([0.5])

_AXES: Final = ("p", "period", "size", "alpha", "restitution", "fractile")

_UNITS: Final = {"p": "rad/s", "alpha": "rad", "restitution": "1", "fractile": "1"}


def rocking_spectrum(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    p: ArrayLike | None = None,
    size: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    fractiles: Sequence[float] = (0.16, 0.5, 0.84),
    model: Model = "nonlinear",
    chattering: str | ChatteringScheme = "certified",
    friction: Friction | None = None,
) -> RockingSpectrum:
    """Compute peak rotation against the frequency parameter or the size, for a grid or an ensemble.

    Parameters
    ----------
    blocks : Blocks, Block, RestrainedBlock or sequence of one kind
        Grid of frequency parameters, slendernesses and restitutions (`Blocks.grid`), the dimensions of the spectrum.
        Blocks without a grid, for example from a calibration, or a grid with `p`, `size` or `weights` are treated as an
        ensemble: for each value of `p`, all blocks are resized by one factor (`Blocks.with_p_scaled`) so that their
        median p equals this value.
    motions : optional
        As for `simulate_many`.
    p : array_like, optional
        Frequency parameters of an ensemble, rad/s. The default is half to twice its own, or follows from `size`.
    size : array_like, optional
        Half diagonals R in place of `p`, m, with p = sqrt(3 g/(4 R)) as for a rectangular block.
    weights : array_like, optional
        Weights of the blocks of an ensemble, equal by default.
    fractiles : sequence of float
        Shares, in (0, 1), of motions (and of the ensemble's weight) below the fractile curves.
    model, chattering, friction : optional
        As for `simulate_many`.

    Returns
    -------
    RockingSpectrum
        Peaks, fractiles, and shares that overturn.

    Raises
    ------
    OptionError
        If an argument is out of range.
    BlockError
        If p or size is out of range, or one of the blocks is not a block.

    See Also
    --------
    rocking.Blocks.grid : Create a grid of blocks.
    rocking.simulate_many : Simulate many blocks under many motions.

    Notes
    -----
    The peak of an overturning block is infinite. Fractiles are interpolated between the ordered peaks, and are infinite
    if that share of the motions, or the next motion above it, overturns. For an ensemble, the fractile of a share is
    the lowest peak for which the peaks up to it have at least this share of the total weight. The peaks of an ensemble
    are normalised by the smaller slenderness of the blocks at rest.

    References
    ----------
    Makris, N. and Konstantinidis, D. (2003). The rocking spectrum and the limitations of practical design
    methodologies. Earthquake Engineering and Structural Dynamics 32(2), 265-289.

    Examples
    --------
    >>> import rocking
    >>> motions = [rocking.pulses.one_sine(5.0, f) for f in (0.5, 1.0, 2.0)]
    >>> blocks = rocking.Blocks.grid(p=[1.0, 2.0, 4.0], alpha=[0.2], restitution=[0.9])
    >>> rocking_spectrum(blocks, motions).data.fractile_over_alpha.sel(fractile=0.5).values.ravel().round(3).tolist()
    [0.367, inf, inf]
    """
    requested = np.atleast_1d(checks.numbers(fractiles, "fractiles", OptionError)).ravel()
    shares = np.array([checks.fraction(share, "each of fractiles", OptionError) for share in requested])
    options: dict[str, Any] = {"model": model, "chattering": chattering, "friction": friction}
    bodies, motions = gather_bodies(blocks), list_motions(motions)
    if not isinstance(bodies, Blocks):
        raise OptionError(f"a spectrum requires blocks, because only blocks have a size; got {bodies.kind}")
    if (axes := bodies.axes) is not None and p is None and size is None and weights is None:
        checks.check_grid_size({"motions": len(motions), "blocks": len(bodies)}, OptionError)
        names, shape = (*(name for name in axes if name != "p"), "p"), [*map(len, axes.values())]
        table = simulate_many(bodies, motions, **options)
        outcomes = [np.moveaxis(table[name].values.reshape(-1, *shape), 1, -1) for name in RATIO_VARIABLES]
        ratio = compute_ratios(axes["alpha"].reshape(-1, *[1] * (len(names) - 1)), *outcomes)
        values = [*outcomes[:2], ratio, compute_fractiles(ratio, shares), compute_overturned_share(ratio)]
        return RockingSpectrum(_combine_peaks(table, names, values, axes | {"fractile": shares}))
    block_weights = normalise_weights(weights, len(bodies))
    median = float(compute_weighted_fractiles(bodies.p.mean(axis=1), block_weights, _MEDIAN_SHARE)[0])
    p_values = median * np.geomspace(0.5, 2.0, 25)
    if p is not None or size is not None:
        p_values = checks.positive_numbers(resolve_p(p, size, bodies.gravity), "p", OptionError)
    p_count, block_count = len(p_values), len(bodies)
    checks.check_grid_size({"motions": len(motions), "blocks": block_count, "p": p_count}, OptionError)
    repeated = bodies.select(np.repeat(np.arange(block_count), p_count))
    resized = repeated.with_p_scaled(np.tile(p_values / median, block_count))
    table = simulate_many(resized, motions, **options).transpose("motion", "block")
    outcomes = [table[name].values.reshape(-1, block_count, p_count) for name in RATIO_VARIABLES]
    ratio = compute_ratios(bodies.alpha.min(axis=1)[:, None], *outcomes)
    flat_ratios, tiled_weights = ratio.reshape(-1, p_count), np.tile(block_weights, len(ratio))
    fractile_values = compute_weighted_fractiles(flat_ratios, tiled_weights, shares)
    values = [*outcomes[:2], ratio, fractile_values, compute_overturned_share(flat_ratios, tiled_weights)]
    data = _combine_peaks(table, ("block", "p"), values, {"p": p_values, "fractile": shares})
    data = data.assign_coords(weight=("block", block_weights))
    return RockingSpectrum(data.assign_attrs(blocks=describe_pool(bodies, weights)))


def compute_fractiles(peaks: Floats, shares: Floats) -> Floats:
    """Interpolate fractiles (k, ...) of peaks (n, ...) without NaN, infinite if either neighbour is."""
    ordered = np.sort(peaks, axis=0)  # NaN last
    counts = np.maximum(np.count_nonzero(~np.isnan(peaks), axis=0), 1)
    position = shares.reshape(-1, *[1] * counts.ndim) * (counts - 1)
    # Rounding must not select the next higher value, which may be infinite: 0.28 * 25 > 7.
    nearest = np.rint(position)
    position = np.where(np.abs(position - nearest) <= 1e-12 * np.maximum(nearest, 1.0), nearest, position)
    floor = np.floor(position).astype(np.int64)
    low, high = (np.take_along_axis(ordered, index, axis=0) for index in (floor, np.ceil(position).astype(np.int64)))
    weight = position - floor
    is_level = (weight == 0.0) | (low == high)
    return np.asarray(low + weight * (np.where(is_level, 0.0, high) - np.where(is_level, 0.0, low)))


def compute_weighted_fractiles(values: Floats, weights: Floats, shares: Floats) -> Floats:
    """Compute the lowest values (n, ...) not exceeded by k shares of the weight, without NaN, shape (k, ...)."""
    order = np.argsort(values, axis=0, kind="stable")
    ordered = np.take_along_axis(values, order, axis=0)
    cumulative = np.cumsum(weights[order] * ~np.isnan(ordered), axis=0)
    # Tolerance, so that rounding does not miss a share that is reached.
    is_reached = cumulative[None] >= shares.reshape(-1, *[1] * values.ndim) * cumulative[-1] * (1.0 - 1e-12)
    return np.asarray(np.take_along_axis(ordered, np.argmax(is_reached, axis=1), axis=0))


def compute_overturned_share(peaks: Floats, weights: Floats | None = None) -> Floats:
    """Compute the share of infinite peaks (n, ...) along the first axis, without NaN."""
    is_finished, is_overturned = ~np.isnan(peaks), np.isinf(peaks)
    if weights is not None and is_finished.all():
        return np.asarray(np.average(is_overturned, axis=0, weights=weights))
    counts = is_finished if weights is None else is_finished * weights.reshape(-1, *[1] * (peaks.ndim - 1))
    with np.errstate(invalid="ignore"):
        return np.asarray((is_overturned * counts).sum(axis=0) / counts.sum(axis=0))


@dataclass(frozen=True, eq=False, repr=False)
class RockingSpectrum(DatasetResult):
    """Peak rotation against the frequency parameter or the size, computed by `rocking_spectrum`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (motion, alpha, restitution if given, p): peak_rotation (rad, pi/2 for overturning), peak_over_alpha
        (infinite for overturning, NaN for abandoned simulations, which fractiles and shares exclude) and overturned.
        Over (fractile, alpha, ..., p): fractile_over_alpha. Over (alpha, ..., p): overturned_share. Additional
        coordinates: period 2 pi/p (s), and size R (m) of the rectangular block. For an ensemble, peaks are over
        (motion, block, p), fractiles and shares over p alone, p is the median, and the blocks' weights (mean 1) are a
        coordinate.

    See Also
    --------
    rocking.rocking_spectrum : Compute the spectrum.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[1.0, 2.0, 4.0], alpha=[0.2], restitution=[0.9])
    >>> spectrum = rocking.rocking_spectrum(blocks, rocking.pulses.one_sine(5.0, 1.0))
    >>> spectrum.data.overturned.values.ravel().tolist()
    [False, True, True]
    """

    TABLES: ClassVar = {
        "fractiles": ("fractile_over_alpha", "overturned_share"),
        "peaks": ("peak_rotation", "peak_over_alpha", "overturned"),
    }
    AGGREGATED_DIMENSIONS = ("motion", "block")

    def summary(self) -> str:
        header = ["p (rad/s)", "R (m)", *(f"{100 * share:g} %" for share in self.data.fractile.values), "overturned"]
        parts = [f"peak rotation over slenderness, {describe_motions(self.data)}, {self.data.model} model"]
        for title, curve in split_curves(self.data):
            fractiles = curve.fractile_over_alpha.transpose("p", "fractile").values.tolist()
            columns = curve.p.values, curve["size"].values, fractiles, curve.overturned_share.values
            rows = [
                [p, size, *("overturns" if value == np.inf else value for value in row), f"{100 * share:.0f} %"]
                for p, size, row, share in zip(*columns, strict=True)
            ]
            parts.append(f"{title}\n{format_some_rows(header, rows)}")
        return "\n\n".join([*parts, *list_missing_notes(np.isnan(self.data.peak_over_alpha.values))])

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        axes = [str(name) for name in data.overturned_share.dims]
        return {
            "motions": data.motion.values,
            **({"verticals": data.vertical.values} if "vertical" in data.coords else {}),
            **({"blocks": data.sizes["block"], "weights": data.weight.values} if self._is_ensemble else {}),
            "model": data.model,
            "chattering": data.chattering,
            **{add_unit(name, data[name].units): data[name].values for name in _AXES if name in data.coords},
            "axes": axes,
            "fractile_over_alpha": data.fractile_over_alpha.transpose("fractile", *axes).values,
            "overturned_share": data.overturned_share.values,
        }

    def plot(
        self,
        ax: Axes | None = None,
        *,
        abscissa: Abscissa = "p",
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Plot motions (thin), fractiles (thick) and the share that overturns against "p", "period" or "size".

        For more than two combinations of slenderness and restitution, only the fractiles nearest to the median are
        drawn, and for more than four, no single motions. See also `DrawnResult.plot`.
        """
        from rocking.plot.curves import SpectrumCurves, draw_spectrum

        checks.choice(abscissa, "abscissa", OptionError, get_args(Abscissa))
        # Lines are drawn in the order of the abscissa, whatever the order of p.
        data = self.data.sortby("p") if "p" in self.data.dims else self.data
        names, datasets = zip(*split_curves(data), strict=True)
        fractiles = [curve.fractile_over_alpha.transpose("fractile", "p").values for curve in datasets]
        shares = [curve.overturned_share.values for curve in datasets]
        title_parts = [describe_motions(data), *(names if len(names) == 1 else ()), f"{data.model} model"]
        labels = names if len(names) > 1 else ("",)
        return draw_spectrum(
            x=data[abscissa].values,
            curves=[*map(SpectrumCurves, labels, map(self._select_peaks, datasets), fractiles, shares)],
            fractiles=data.fractile.values.tolist(),
            motions=create_motion_labels(data),
            x_label={"p": "p (rad/s)", "period": "2π/p (s)", "size": "half diagonal R (m)"}[abscissa],
            title=title or escape_dollars(", ".join(title_parts)),
            ax=ax,
            figsize=figsize,
        )

    @property
    def _is_ensemble(self) -> bool:
        return "block" in self.data.dims

    def _select_peaks(self, curve: xr.Dataset) -> Floats:
        """Select peaks under each motion, shape (motions, p), or their medians for an ensemble."""
        if not self._is_ensemble:
            return np.asarray(curve.peak_over_alpha.transpose("motion", "p").values)
        peaks = curve.peak_over_alpha.transpose("block", "motion", "p").values
        return np.asarray(compute_weighted_fractiles(peaks, curve.weight.values, _MEDIAN_SHARE)[0])


def _combine_peaks(
    table: xr.Dataset, names: tuple[str, ...], values: Sequence[Floats], axes: dict[str, Floats]
) -> xr.Dataset:
    """Combine peaks, outcomes and ratios over (motion, *names) with fractiles and shares over their last dimensions."""
    import xarray as xr

    peak, overturned, ratio, fractiles, share = values
    dims, share_dims, half_diagonal = ("motion", *names), names[-share.ndim :], 0.75 * table.gravity / axes["p"] ** 2
    meaning = "peak rotation over the slenderness; infinite where the block overturns"
    return xr.Dataset(
        {
            "peak_rotation": create_variable(dims, peak, "peak rotation; pi/2: overturns", "rad"),
            "peak_over_alpha": create_variable(dims, ratio, meaning, "1"),
            "overturned": (dims, overturned, table.overturned.attrs),
            "fractile_over_alpha": create_variable(
                ("fractile", *share_dims), fractiles, f"fractile of the {meaning}", "1"
            ),
            "overturned_share": create_variable(share_dims, share, "share of the motions that overturn the block", "1"),
        },
        {
            "motion": table.motion,
            **{name: table[name] for name in ("vertical",) if name in table.coords},
            **{name: create_variable(name, points, unit=_UNITS[name]) for name, points in axes.items()},
            "period": create_variable("p", 2.0 * np.pi / axes["p"], "2 pi/p", "s"),
            "size": create_variable("p", half_diagonal, "half diagonal of the rectangular block", "m"),
        },
        {name: table.attrs[name] for name in ("program", "model", "chattering", "gravity", "motions", "histories")},
    )
