"""Figures of studies with many simulations: spectra, maps of regions, scaled motions, fragility."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.plot.style import ABOVE, GROUND, INK, REST, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Regions in which the block stays, from lightest to darkest, and in which it overturns, from darkest to lightest.
_STAYS: Final = ("#ffffff", "#d9e4ee", "#a9bfd6")
_OVERTURNS: Final = ("#8c2d08", "#d95f1a", "#f0a35e", "#f8cf9f", "#fbe7cd")

#: Curves of one figure: luminances differ, and so do the dashes.
_CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linestyle": "-"},
    {"color": ABOVE, "linestyle": (0, (5, 1.5))},
    {"color": "#4d7ea8", "linestyle": (0, (1, 1))},
    {"color": "#b8860b", "linestyle": (0, (6, 1.5, 1, 1.5))},
)


class SpectrumCurves(NamedTuple):
    """Curves of one slenderness and restitution over the spectrum's abscissa; infinite where the block overturns.

    singles (motions, points) : peak rotation over slenderness of every motion
    fractiles (fractiles, points) : their fractiles, the middle one drawn thickest
    overturned (points,) : share of the motions that overturn the block
    """

    label: str
    singles: Floats
    fractiles: Floats
    overturned: Floats


class ScaledMotion(NamedTuple):
    """One motion scaled up: levels, peak rotation over slenderness, and the bands (n, 2) of levels that overturn."""

    label: str
    levels: Floats
    peak: Floats
    bands: Floats


class FragilityLine(NamedTuple):
    """A fitted curve with its confidence band, and the shares seen at (grouped) intensities."""

    label: str
    intensity: Floats
    probability: Floats
    lower: Floats
    upper: Floats
    seen_at: Floats
    seen: Floats


def spectrum_figure(
    *, x: Floats, curves: Sequence[SpectrumCurves], fractiles: Sequence[float], x_label: str, title: str
) -> Figure:
    """Draw peak rotations against the size of the block, and below them the share of motions that overturn it.

    Parameters
    ----------
    x : ndarray, shape (points,)
        Abscissa, drawn on a logarithmic axis.
    curves : sequence of SpectrumCurves
        At most four.
    fractiles : sequence of float
        What the fractiles are, in (0, 1).
    x_label, title : str
        Texts.

    Examples
    --------
    >>> import numpy as np
    >>> peaks = np.array([[0.1, 0.4], [0.2, np.inf]])
    >>> curves = [SpectrumCurves("tall", peaks, np.array([[0.15, np.inf]]), np.array([0.0, 0.5]))]
    >>> figure = spectrum_figure(x=np.array([1.0, 2.0]), curves=curves, fractiles=[0.5], x_label="p", title="Spectrum")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['peak rotation / slenderness', 'share overturned']
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.8), layout="constrained")
        peaks, shares = figure.subplots(2, 1, sharex=True, height_ratios=(3.2, 1.0))
        for style, curve in zip(_CURVES, curves, strict=False):
            _draw_spectrum(peaks, x, curve, fractiles, style)
            shares.step(x, curve.overturned, where="mid", linewidth=1.2, **style)
        peaks.set(ylabel="peak rotation / slenderness", title=title, ylim=(0.0, None))
        shares.set(xscale="log", xlabel=x_label, ylabel="share overturned", ylim=(-0.03, 1.03))
        shares.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        shares.xaxis.set_major_formatter(lambda value, position: f"{value:g}")
        shares.xaxis.set_minor_formatter(NullFormatter())
        for axes in (peaks, shares):
            axes.grid(color=REST, linewidth=0.6, which="both")
            axes.set_axisbelow(True)
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def _draw_spectrum(
    axes: Axes, x: Floats, curve: SpectrumCurves, fractiles: Sequence[float], style: Mapping[str, Any]
) -> None:
    for single in curve.singles:
        axes.plot(x, _cut(single), color=style["color"], linewidth=0.5, alpha=0.35)
    middle = int(np.argmin(np.abs(np.asarray(fractiles) - 0.5)))
    for k, (share, fractile) in enumerate(zip(fractiles, curve.fractiles, strict=True)):
        label = f"{curve.label}, {'median' if share == 0.5 else f'{100 * share:g} %'}" if k == middle else None
        axes.plot(x, _cut(fractile), linewidth=1.8 if k == middle else 0.9, label=label, **style)


def _cut(values: Floats) -> Floats:
    """Values with gaps where they are infinite."""
    return np.where(np.isfinite(values), values, np.nan)


def regions_figure(
    *,
    x: Floats,
    y_range: tuple[float, float],
    edges: Sequence[Floats],
    regions: Sequence[Sequence[int]],
    names: Mapping[int, str],
    x_label: str,
    y_label: str,
    title: str,
) -> Figure:
    """Draw regions between boundaries that are known at some abscissae.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Increasing abscissae.
    y_range : (float, float)
        Lowest and highest ordinate.
    edges : sequence of ndarray
        At each abscissa the ordinates of the boundaries, increasing.
    regions : sequence of sequence of int
        At each abscissa the regions below, between and above the boundaries; negative ones, from -3 on: the block
        stays.
    names : mapping of int to str
        What the regions mean.
    x_label, y_label, title : str
        Texts.

    Examples
    --------
    >>> import numpy as np
    >>> figure = regions_figure(
    ...     x=np.array([1.0, 2.0]), y_range=(0.0, 3.0), edges=[np.array([1.0]), np.array([2.0])],
    ...     regions=[[-3, 0], [-3, 0]], names={-3: "stays", 0: "overturns"}, x_label="x", y_label="y", title="A map")
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['stays', 'overturns']
    """
    import matplotlib as mpl
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    polygons: dict[int, list[Floats]] = {region: [] for region in names}
    lines: list[Floats] = []
    for abscissae, bounds, inside in _runs(x, edges, regions, y_range):
        curves = [np.column_stack([abscissae, bound]) for bound in bounds]
        for region, low, high in zip(inside, curves, curves[1:], strict=False):
            polygons[region].append(np.concatenate([low, high[::-1]]))
        lines += curves[1:-1]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.6), layout="constrained")
        axes = figure.add_subplot()
        for region, corners in polygons.items():
            colour = _region_colour(region)
            axes.add_collection(PolyCollection(corners, facecolors=colour, edgecolors=colour, linewidths=0.5))
        axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.5))
        axes.set(xlim=(x[0], x[-1]), ylim=y_range, xlabel=x_label, ylabel=y_label, title=title)
        figure.legend(handles=_region_patches(names, Patch), loc="outside lower center", ncols=3)
    return figure


def _runs(
    x: Floats, edges: Sequence[Floats], regions: Sequence[Sequence[int]], y_range: tuple[float, float]
) -> Iterator[tuple[Floats, Floats, Sequence[int]]]:
    """Yield runs of abscissae with the same regions: abscissae, bounds of shape (regions + 1, abscissae), regions.

    Two runs meet half way: a boundary that both have runs straight from one to the other, any other one level.
    """
    columns = [np.array([y_range[0], *edge, y_range[1]]) for edge in edges]
    starts = [k for k in range(len(x)) if k == 0 or list(regions[k]) != list(regions[k - 1])]
    for start, end in zip(starts, [*starts[1:], len(x)], strict=True):
        at, bounds = [*x[start:end]], columns[start:end]
        if start > 0:
            at = [0.5 * (x[start - 1] + x[start]), *at]
            bounds = [_meeting(columns, regions, start, start - 1), *bounds]
        if end < len(x):
            at = [*at, 0.5 * (x[end - 1] + x[end])]
            bounds = [*bounds, _meeting(columns, regions, end - 1, end)]
        yield np.array(at), np.stack(bounds, axis=1), regions[start]


def _meeting(columns: Sequence[Floats], regions: Sequence[Sequence[int]], here: int, there: int) -> Floats:
    """Bounds half way from one abscissa to the next."""
    bounds = columns[here].copy()
    for mine, other in _shared(regions[here], regions[there]):
        bounds[mine] = 0.5 * (columns[here][mine] + columns[there][other])
    return bounds


def _shared(left: Sequence[int], right: Sequence[int]) -> list[tuple[int, int]]:
    """Match boundaries, by their numbers from 1 on: from the lowest and from the highest as long as they are alike."""
    one, other = ([*pairwise(regions)] for regions in (left, right))
    shortest = min(len(one), len(other))
    begin = next((k for k in range(shortest) if one[k] != other[k]), shortest)
    end = next((k for k in range(shortest - begin) if one[-1 - k] != other[-1 - k]), shortest - begin)
    highest = [(len(one) - k, len(other) - k) for k in range(end)]
    return [(k, k) for k in range(1, begin + 1)] + highest


def _region_colour(region: int) -> str:
    return _STAYS[region + 3] if region < 0 else _OVERTURNS[min(region, len(_OVERTURNS) - 1)]


def _region_patches(names: Mapping[int, str], patch: Any) -> list[Any]:
    """List the handles of the legend; regions of one colour share one."""
    shown = sorted(names, key=lambda region: (region >= 0, region))
    most = len(_OVERTURNS) - 1
    labels = {_region_colour(region): names[region] for region in shown if region < most}
    if any(region >= most for region in shown):
        labels[_OVERTURNS[most]] = f"overturns after {most} impacts or more"
    return [patch(facecolor=colour, edgecolor=INK, linewidth=0.5, label=text) for colour, text in labels.items()]


def scaling_figure(*, motions: Sequence[ScaledMotion], level_label: str, title: str) -> Figure:
    """Draw the level of scaled motions against the peak rotation, and below it the levels that overturn.

    Parameters
    ----------
    motions : sequence of ScaledMotion
        One curve each; peaks are infinite where the block overturns.
    level_label, title : str
        Texts.

    Examples
    --------
    >>> import numpy as np
    >>> motion = ScaledMotion("a", np.array([1.0, 2.0]), np.array([0.1, np.inf]), np.array([[1.5, 2.0]]))
    >>> figure = scaling_figure(motions=[motion], level_label="PGA (m/s^2)", title="Scaled up")
    >>> [axes.get_xlabel() for axes in figure.axes]
    ['peak rotation / slenderness', 'overturns']
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 4.2), layout="constrained")
        curves, bands = figure.subplots(1, 2, sharey=True, width_ratios=(2.2, 1.0))
        for k, motion in enumerate(motions):
            style = _CURVES[k % len(_CURVES)]
            curves.plot(_cut(motion.peak), motion.levels, ".", markersize=2.5, color=style["color"])
            curves.plot(_cut(motion.peak), motion.levels, linewidth=1.0, label=motion.label, **style)
            for low, high in motion.bands:
                bands.plot([k, k], [low, high], color=style["color"], linewidth=5.0, solid_capstyle="butt")
        curves.set(xlabel="peak rotation / slenderness", ylabel=level_label)
        curves.set_xlim(left=0.0)
        curves.grid(color=REST, linewidth=0.6)
        bands.set(xlabel="overturns", xlim=(-0.7, len(motions) - 0.3), xticks=[])
        bands.grid(color=REST, linewidth=0.6, axis="y")
        for axes in (curves, bands):
            axes.set_axisbelow(True)
        figure.suptitle(title)
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def fragility_figure(*, lines: Sequence[FragilityLine], intensity_label: str, band_label: str, title: str) -> Figure:
    """Draw fitted fragility curves with their confidence bands, and the shares that were seen.

    Parameters
    ----------
    lines : sequence of FragilityLine
        One for every limit state.
    intensity_label, band_label, title : str
        Texts; `band_label` says what the bands are.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.array([1.0, 2.0, 3.0])
    >>> line = FragilityLine("overturning", x, x / 4, x / 5, x / 3, np.array([2.0]), np.array([0.5]))
    >>> figure = fragility_figure(lines=[line], intensity_label="PGA", band_label="90 %", title="Fragile")
    >>> figure.axes[0].get_ylabel()
    'probability'
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.0), layout="constrained")
        axes = figure.add_subplot()
        for k, line in enumerate(lines):
            style = _CURVES[k % len(_CURVES)]
            axes.fill_between(line.intensity, line.lower, line.upper, color=style["color"], alpha=0.18, linewidth=0.0)
            axes.plot(line.intensity, line.probability, linewidth=1.5, label=line.label, **style)
            axes.plot(
                line.seen_at,
                line.seen,
                "o",
                color=style["color"],
                markersize=4.0,
                markerfacecolor="white",
                clip_on=False,
            )
        axes.fill_between([], [], [], color=GROUND, alpha=0.4, linewidth=0.0, label=band_label)
        axes.plot([], [], "o", color=GROUND, markersize=4.0, markerfacecolor="white", label="shares seen")
        axes.set(xlabel=intensity_label, ylabel="probability", ylim=(0.0, 1.0), title=title)
        axes.set_xlim(left=0.0, right=float(lines[0].intensity[-1]))
        axes.grid(color=REST, linewidth=0.6)
        axes.set_axisbelow(True)
        figure.legend(loc="outside lower center", ncols=2)
    return figure
