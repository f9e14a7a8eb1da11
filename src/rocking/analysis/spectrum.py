"""Rocking spectra: peak rotation against the size of the block."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.constants import STANDARD_GRAVITY
from rocking.engine import require_finished
from rocking.ensemble import simulate_many
from rocking.errors import InvalidOption
from rocking.motion.description import labelled
from rocking.motion.motion import Motion
from rocking.result import Result, table_of_some
from rocking.treatment import Treatment
from rocking.treatment.base import Model

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Abscissa = Literal["p", "period", "size"]

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
) -> RockingSpectrum:
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
    RockingSpectrum
        Peaks, fractiles and shares that overturn.

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
    shaken = motions if isinstance(motions, Sequence) else [motions]
    checks.grid_size({"motions": len(shaken)} | {name: len(axis) for name, axis in axes.items()}, InvalidOption)
    blocks = Blocks.grid(**axes, gravity=gravity)
    table = simulate_many(blocks, motions, model=model, chattering=chattering, threads=threads, progress=progress)
    require_finished(table.unfinished.values)
    return RockingSpectrum(_spectrum(table, axes, blocks, shares))


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


@dataclass(frozen=True, eq=False, repr=False)
class RockingSpectrum(Result):
    """Peak rotation against the frequency parameter or the size; from `rocking_spectrum`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (motion, alpha, restitution if given, p): peak_rotation (rad; pi/2 where the block
        overturns), peak_over_alpha (infinite where it overturns) and overturned. Over (fractile, alpha, ..., p):
        fractile_over_alpha. Over (alpha, ..., p): overturned_share. Coordinates besides: period 2 pi/p (s), and size R
        (m) of the rectangular block.
    """

    TABLES = MappingProxyType(
        {
            "fractiles": ("fractile_over_alpha", "overturned_share"),
            "peaks": ("peak_rotation", "peak_over_alpha", "overturned"),
        }
    )

    def summary(self) -> str:
        """Fractiles of peak rotation over slenderness at some sizes, for each slenderness and restitution."""
        header = ["p (rad/s)", "R (m)", *(f"{100 * share:g} %" for share in self.data.fractile.values), "overturned"]
        parts = [f"peak rotation over slenderness, {self._motions()}, {self.data.model} model"]
        for title, one in self._curves():
            fractiles = one.fractile_over_alpha.transpose("p", "fractile").values
            rows = [
                [
                    float(one.p[j]),
                    float(one["size"][j]),
                    *("overturns" if np.isinf(value) else float(value) for value in fractiles[j]),
                    f"{100 * float(one.overturned_share[j]):.0f} %",
                ]
                for j in range(self.data.sizes["p"])
            ]
            parts.append(f"{title}\n{table_of_some(header, rows)}")
        return "\n\n".join(parts)

    def to_dict(self) -> dict[str, Any]:
        """Axes, fractiles and shares by name."""
        data = self.data
        axes = [str(name) for name in data.overturned_share.dims]
        return {
            "motions": data.motion.values,
            "model": data.model,
            "chattering_treatment": data.chattering,
            "p_rad_s": data.p.values,
            "period_s": data.period.values,
            "size_m": data["size"].values,
            "alpha_rad": data.alpha.values,
            **({"restitution": data.restitution.values} if "restitution" in data.dims else {}),
            "fractile": data.fractile.values,
            "axes": axes,
            "fractile_over_alpha": data.fractile_over_alpha.transpose("fractile", *axes).values,
            "overturned_share": data.overturned_share.values,
        }

    def plot(
        self,
        ax: Axes | None = None,
        *,
        against: Abscissa = "p",
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw single motions thin, fractiles thick, and the share that overturns.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; by default in a new figure.
        against : {"p", "period", "size"}
            Abscissa.
        title : str
            Title; by default the model and the number of motions.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Raises
        ------
        InvalidOption
            If there are more than four combinations of slenderness and restitution, or no such abscissa.
        """
        from rocking.plot import SpectrumCurves, spectrum_figure

        checks.one_of(against, "against", InvalidOption, get_args(Abscissa))
        named_curves = self._curves()
        if len(named_curves) > _MOST_CURVES:
            raise InvalidOption(f"a figure shows at most {_MOST_CURVES} curves, not {len(named_curves)}; select some")
        curves = [
            SpectrumCurves(
                name,
                one.peak_over_alpha.transpose("motion", "p").values,
                one.fractile_over_alpha.transpose("fractile", "p").values,
                one.overturned_share.values,
            )
            for name, one in named_curves
        ]
        return spectrum_figure(
            x=self.data[against].values,
            curves=curves,
            fractiles=self.data.fractile.values.tolist(),
            motions=self._labels(),
            x_label={"p": "p (rad/s)", "period": "2π/p (s)", "size": "half diagonal R (m)"}[against],
            title=title or f"{self._motions()}, {self.data.model} model",
            ax=ax,
            figsize=figsize,
        )

    def _labels(self) -> list[str]:
        """Names of the motions, with what was done to them."""
        names, histories = self.data.motion.values, self.data.histories
        return [
            labelled(str(name), done.split("; ") if done else []) for name, done in zip(names, histories, strict=True)
        ]

    def _motions(self) -> str:
        """Name the motion, or count them; those that were scaled are told from those that were not."""
        labels = self._labels()
        changed = sum(bool(done) for done in self.data.histories)
        if len(labels) == 1:
            return labels[0]
        which = "all" if changed == len(labels) else f"{changed} of them"
        return f"{len(labels)} motions" + (f", {which} scaled or processed" if changed else "")

    def _curves(self) -> list[tuple[str, xr.Dataset]]:
        """Name and select each combination of slenderness and restitution."""
        stacked = self.data.stack(curve=[name for name in ("alpha", "restitution") if name in self.data.dims])
        return [(_curve_name(one), one) for one in (stacked.isel(curve=k) for k in range(stacked.sizes["curve"]))]


def _curve_name(one: xr.Dataset) -> str:
    restitution = f", restitution {float(one.restitution):g}" if "restitution" in one.coords else ""
    return f"alpha = {float(one.alpha):.5g} rad ({math.degrees(one.alpha):.4g}°){restitution}"


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
        {name: table.attrs[name] for name in ("program", "model", "chattering", "gravity", "motions", "histories")},
    )


_UNITS = {"p": "rad/s", "alpha": "rad", "restitution": "1"}


def _rates(p: ArrayLike | None, size: ArrayLike | None, gravity: float) -> Floats:
    if p is not None and size is None:
        return checks.positive_numbers(p, "p", InvalidOption)
    if size is not None and p is None:
        g = checks.positive(gravity, "gravity", InvalidOption, "m/s^2")
        return np.sqrt(0.75 * g / checks.positive_numbers(size, "size", InvalidOption))
    which = "one of" if p is None else "not both of"
    raise InvalidOption(f"give {which} p= (rad/s) and size= (half diagonals, m)")


def _shares(fractiles: Sequence[float]) -> Floats:
    each = np.atleast_1d(checks.numbers(fractiles, "fractiles", InvalidOption)).ravel()
    return np.array([checks.share(value, "each of fractiles", InvalidOption) for value in each])
