"""Rocking spectra: peak rotation against the size of the block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.constants import STANDARD_GRAVITY
from rocking.ensemble import simulate_many
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.problem import Model
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

#: Most curves that one figure shows.
_MOST_CURVES = 4


def rocking_spectrum(
    motions: Motion | Sequence[Motion],
    *,
    alpha: ArrayLike,
    p: ArrayLike | None = None,
    size: ArrayLike | None = None,
    restitution: ArrayLike | None = None,
    fractiles: Sequence[float] = (0.16, 0.5, 0.84),
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    gravity: float = STANDARD_GRAVITY,
    threads: int | None = None,
    progress: bool | None = None,
) -> xr.Dataset:
    """Peak rotation against the frequency parameter or the size, for slendernesses and restitutions.

    Parameters
    ----------
    motions : Motion or sequence of Motion
        m motions.
    alpha : array_like
        Slendernesses, rad.
    p : array_like
        Frequency parameters, rad/s; or give `size`.
    size : array_like
        Half diagonals R of rectangular blocks, m: p = sqrt(3 g/(4 R)); or give `p`.
    restitution : array_like, optional
        Restitutions; Housner's from each alpha by default.
    fractiles : sequence of float
        Shares, in (0, 1), of motions that stay below the fractile curves.
    model, chattering, threads, progress
        As for `simulate_many`.
    gravity : float
        Acceleration of gravity, m/s^2.

    Returns
    -------
    xarray.Dataset
        Over (motion, alpha, restitution if given, p): peak_rotation (rad; pi/2 where the block
        overturns), peak_over_alpha (infinite where it overturns) and overturned. Over (fractile, alpha, ..., p):
        fractile_over_alpha. Over (alpha, ..., p): overturned_share. Coordinates besides: period 2 pi/p (s), and size R
        (m) of the rectangular block.

    Raises
    ------
    InvalidOption
        If an argument is out of its range.
    InvalidBlock
        If p, alpha or restitution is.

    Notes
    -----
    A block that overturns has no largest rotation, so it counts as infinitely large: fractiles are interpolated in the
    ordered peaks, and are infinite where that share of the motions, or the next motion above it, overturns.

    The blocks are symmetric, so a motion and its mirror image give the same peaks.

    References
    ----------
    Makris, N. and Konstantinidis, D. (2003). The rocking spectrum and the limitations of practical design
    methodologies. Earthquake Engineering and Structural Dynamics 32(2), 265-289.

    Examples
    --------
    >>> import rocking
    >>> motions = [rocking.pulses.one_sine(5.0, f) for f in (0.5, 1.0, 2.0)]
    >>> spectrum = rocking_spectrum(motions, alpha=[0.2], p=[1.0, 2.0, 4.0], restitution=[0.9])
    >>> spectrum.overturned.sum("motion").values.ravel().tolist()
    [1, 2, 3]
    >>> spectrum.fractile_over_alpha.sel(fractile=0.5).values.ravel().round(3).tolist()
    [0.367, inf, inf]
    """
    rates = _rates(p, size, gravity)
    shares = _shares(fractiles)
    axes = {"p": rates, "alpha": checks.positive_numbers(alpha, "alpha", InvalidOption)}
    if restitution is not None:
        axes["restitution"] = checks.positive_numbers(restitution, "restitution", InvalidOption)
    blocks = Blocks.grid(**axes, gravity=gravity)
    table = simulate_many(blocks, motions, model=model, chattering=chattering, threads=threads, progress=progress)
    return _spectrum(table, axes, blocks, shares)


def fractiles_of(peaks: Floats, shares: Floats) -> Floats:
    """Fractiles along the first axis, interpolated in the ordered values; infinite where either neighbour is.

    Parameters
    ----------
    peaks : ndarray, shape (n, ...)
        Values; infinity stands for more than any number.
    shares : ndarray, shape (k,)
        Shares from 0 to 1.

    Returns
    -------
    ndarray, shape (k, ...)
    """
    ordered = np.sort(peaks, axis=0)
    place = shares * (len(ordered) - 1)
    below = np.floor(place).astype(np.int64)
    low, high = ordered[below], ordered[np.ceil(place).astype(np.int64)]
    weight = (place - below).reshape(-1, *[1] * (ordered.ndim - 1))
    level = (weight == 0.0) | (low == high)
    between: Floats = low + weight * (np.where(level, 0.0, high) - np.where(level, 0.0, low))
    return between


def spectrum_figure(dataset: xr.Dataset, *, against: str = "p", title: str = "") -> Figure:
    """Draw what `rocking_spectrum` found: single motions thin, fractiles thick, and the share that overturns.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `rocking_spectrum`; at most four combinations of slenderness and restitution.
    against : {"p", "period", "size"}
        Abscissa.
    title : str
        Title; by default the model and the number of motions.

    Raises
    ------
    InvalidOption
        If there are more combinations, or no such abscissa.
    """
    from rocking.plot.spectrum import SpectrumCurves
    from rocking.plot.spectrum import spectrum_figure as drawn

    labels = {"p": "p (rad/s)", "period": "2π/p (s)", "size": "half diagonal R (m)"}
    if against not in labels:
        raise InvalidOption(f"against must be one of {', '.join(labels)}, not {against!r}")
    combinations = [name for name in ("alpha", "restitution") if name in dataset.dims]
    stacked = dataset.stack(curve=combinations)
    if stacked.sizes["curve"] > _MOST_CURVES:
        raise InvalidOption(f"a figure shows at most {_MOST_CURVES} curves, not {stacked.sizes['curve']}; select some")
    curves = []
    for k in range(stacked.sizes["curve"]):
        one = stacked.isel(curve=k)
        text = f"α = {float(one.alpha):g}" + (f", e = {float(one.restitution):g}" if len(combinations) > 1 else "")
        singles = one.peak_over_alpha.transpose("motion", "p").values
        fractile_lines = one.fractile_over_alpha.transpose("fractile", "p").values
        curves.append(SpectrumCurves(text, singles, fractile_lines, one.overturned_share.values))
    return drawn(
        x=dataset[against].values,
        curves=curves,
        fractiles=dataset.fractile.values.tolist(),
        motions=[str(name) for name in dataset.motion.values],
        x_label=labels[against],
        title=title or f"{dataset.sizes['motion']} motion(s), {dataset.model} model",
    )


def _spectrum(table: xr.Dataset, axes: dict[str, Floats], blocks: Blocks, shares: Floats) -> xr.Dataset:
    """Ensemble over a grid of blocks as a spectrum, p last."""
    import xarray as xr

    names = [*(name for name in axes if name != "p"), "p"]

    def on_grid(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return np.moveaxis(values.reshape(len(values), *map(len, axes.values())), 1, -1)

    peak, overturned = on_grid(table.peak_rotation.values), on_grid(table.overturned.values)
    over_alpha = np.where(overturned, np.inf, peak / axes["alpha"].reshape(-1, *[1] * (len(names) - 1)))
    radius = 0.75 * blocks.gravity / axes["p"] ** 2
    words = "over the slenderness; infinite where the block overturns"
    return xr.Dataset(
        {
            "peak_rotation": (
                ("motion", *names),
                peak,
                {"units": "rad", "long_name": "peak rotation; pi/2: overturns"},
            ),
            "peak_over_alpha": (("motion", *names), over_alpha, {"units": "1", "long_name": f"peak rotation {words}"}),
            "overturned": (("motion", *names), overturned, table.overturned.attrs),
            "fractile_over_alpha": (
                ("fractile", *names),
                fractiles_of(over_alpha, shares),
                {"units": "1", "long_name": f"fractile of the peak rotation {words}"},
            ),
            "overturned_share": (
                names,
                overturned.mean(axis=0),
                {"units": "1", "long_name": "share of the motions that overturn the block"},
            ),
        },
        {
            "motion": table.motion,
            **{name: (name, values, {"units": _UNITS[name]}) for name, values in axes.items()},
            "fractile": ("fractile", shares),
            "period": ("p", 2.0 * np.pi / axes["p"], {"units": "s", "long_name": "2 pi/p"}),
            "size": ("p", radius, {"units": "m", "long_name": "half diagonal of the rectangular block"}),
        },
        {name: table.attrs[name] for name in ("program", "model", "chattering", "gravity", "motions")},
    )


_UNITS = {"p": "rad/s", "alpha": "rad", "restitution": "1"}


def _rates(p: ArrayLike | None, size: ArrayLike | None, gravity: float) -> Floats:
    if p is not None and size is None:
        return checks.positive_numbers(p, "p", InvalidOption)
    if size is not None and p is None:
        g = checks.positive(gravity, "gravity", InvalidOption, "m/s^2")
        return np.sqrt(0.75 * g / checks.positive_numbers(size, "size", InvalidOption))
    raise InvalidOption("a spectrum needs either p (rad/s) or size (half diagonals, m)")


def _shares(fractiles: Sequence[float]) -> Floats:
    each = np.atleast_1d(checks.numbers(fractiles, "fractiles", InvalidOption)).ravel()
    return np.array([checks.share(value, "each of fractiles", InvalidOption) for value in each])
