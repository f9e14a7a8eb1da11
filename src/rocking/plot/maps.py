"""Maps over two parameters: the outcome of each point, or regions between boundaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.plot.boundaries import Stack, runs
from rocking.plot.canvas import add_labels, add_legend, add_title, figure_for
from rocking.plot.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

#: From harmless to the worst, each darker than the one before; the last stands out.
_COLOURS: Final = ("#ffffff", "#d7e3f2", "#9db6d4", "#5d7da6", "#1c2c47", "#e0a23c")

#: Colour and hatch of regions in which the block stays, and of those in which it overturns after 0, 1, ... impacts,
#: from darkest to lightest: hatched, so that none is taken for one of the others in grey. The second one of those in
#: which it stays is the darkest, as it is often a strip and must be seen between the others.
_STAYS: Final = (("#ffffff", ""), ("#5d7da6", ""), ("#dde7f0", ""))
_OVERTURNS: Final = (
    ("#7d2706", ""),
    ("#d9692a", "////"),
    ("#eda565", "\\\\\\\\"),
    ("#f8cf9f", "xxxx"),
    ("#fbe7cd", "...."),
)

#: Share of the frame below which nobody sees a region.
_LEAST_SEEN: Final = 1e-3

#: Shares of the frame's height: a region lower than the first, about half a point, is no more than a speck, and one
#: lower than the second would vanish between the lines on both sides of it.
_SPECK: Final = 2e-3
_STRIP: Final = 1e-2


def outcome_figure(
    *,
    x: Floats,
    y: Floats,
    outcome: NDArray[np.integer],
    meanings: Sequence[str],
    x_label: str,
    y_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw which of up to six outcomes each point of a grid has.

    Parameters
    ----------
    x, y : ndarray
        Values of the two parameters, increasing.
    outcome : ndarray of int, shape (len(y), len(x))
        Number of the outcome at each point.
    meanings : sequence of str
        What the outcomes 0, 1, ... mean, from the lightest colour to the darkest; the last stands out.
    x_label, y_label, title, ax, figsize
        Texts, where to draw, and the size of a new figure, inches.

    Examples
    --------
    >>> import numpy as np
    >>> figure = outcome_figure(
    ...     x=np.array([1.0, 2.0]), y=np.array([0.0, 1.0]), outcome=np.array([[0, 0], [1, 0]]),
    ...     meanings=["stays", "rocks"], x_label="omega", y_label="a", title="A map")
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['stays', 'rocks']
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    count = len(meanings)
    with figure_for(ax, (5.4, 4.2), figsize) as figure:
        axes = ax or figure.add_subplot()
        axes.pcolormesh(
            x,
            y,
            outcome,
            cmap=ListedColormap(_COLOURS[:count]),
            norm=BoundaryNorm(np.arange(count + 1) - 0.5, count),
            shading="nearest",
            rasterized=True,
        )
        add_labels(axes, x_label, y_label)
        add_title(figure, ax, title)
        present = sorted(set(np.unique(outcome).tolist()))
        add_legend(figure, ax, [_patch((_COLOURS[k], ""), meanings[k]) for k in present])
    return figure


def regions_figure(
    *,
    x: Floats,
    y_range: tuple[float, float],
    edges: Sequence[Floats],
    regions: Sequence[Sequence[int]],
    names: Mapping[int, str],
    x_label: str,
    y_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
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
        stays; the others: it overturns after so many impacts.
    names : mapping of int to str
        What the regions mean; those that can be seen are in the legend.
    x_label, y_label, title, ax, figsize
        Texts, where to draw, and the size of a new figure, inches.

    Notes
    -----
    A region that one abscissa has and the next one lacks ends in a tip half way between them: see
    `rocking.plot.boundaries`. A strip has no lines around it, which would hide it, and a region too low to be seen
    none that would make it seen.

    Examples
    --------
    >>> import numpy as np
    >>> figure = regions_figure(
    ...     x=np.array([1.0, 2.0]), y_range=(0.0, 3.0), edges=[np.array([1.0]), np.array([2.0])],
    ...     regions=[[-3, 0], [-3, 0]], names={-3: "stays", 0: "overturns"}, x_label="x", y_label="y", title="A map")
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['stays', 'overturns']
    """
    from matplotlib.collections import LineCollection, PolyCollection

    low, high = y_range
    stacks = [Stack(np.array([low, *edge, high]), tuple(at)) for edge, at in zip(edges, regions, strict=True)]
    polygons: dict[int, list[Floats]] = {}
    specks: dict[int, list[Floats]] = {}
    tallest: dict[int, float] = {}
    lines: list[Floats] = []
    for abscissae, levels, inside in runs(x, stacks):
        curves = [np.column_stack([abscissae, level]) for level in levels]
        heights = np.diff(levels, axis=0).max(axis=1) / (high - low)
        for region, height, below, above in zip(inside, heights, curves, curves[1:], strict=False):
            among = polygons if height > _SPECK else specks
            among.setdefault(region, []).append(np.concatenate([below, above[::-1]]))
            tallest[region] = max(height, tallest.get(region, 0.0))
        seen = np.flatnonzero(heights > _SPECK)
        lines += [curves[j + 1] for j, k in pairwise(seen) if min(heights[j], heights[k]) > _STRIP]
    with figure_for(ax, (5.6, 4.6), figsize) as figure:
        axes = ax or figure.add_subplot()
        for region, corners in specks.items():
            axes.add_collection(PolyCollection(corners, facecolors=_look(region)[0], linewidths=0.0))
        for region, corners in polygons.items():
            colour, hatch = _look(region)
            # An edge of the same colour closes the seams between polygons; a hatch takes the colour of its edge.
            axes.add_collection(PolyCollection(corners, facecolors=colour, edgecolors=colour, linewidths=0.5))
            if hatch:
                shape = PolyCollection(corners, facecolors="none", edgecolors=INK, linewidths=0.0, hatch=hatch)
                axes.add_collection(shape)
        axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.5, capstyle="round", snap=False))
        axes.set(xlim=(x[0], x[-1]), ylim=y_range)
        add_labels(axes, x_label, y_label)
        add_title(figure, ax, title)
        strips = {region: f"{name} (a strip)" for region, name in names.items() if tallest.get(region, 1.0) < _STRIP}
        add_legend(figure, ax, _patches(polygons, {**names, **strips}, (x[-1] - x[0]) * (high - low)))
    return figure


def _look(region: int) -> tuple[str, str]:
    return _STAYS[region + 3] if region < 0 else _OVERTURNS[min(region, len(_OVERTURNS) - 1)]


def _patches(polygons: Mapping[int, Sequence[Floats]], names: Mapping[int, str], frame: float) -> list[Patch]:
    """Make the handles of the legend for what can be seen; regions that look the same share one.

    `frame` is the area of the whole.
    """
    looks: dict[tuple[str, str], list[int]] = {}
    for region in sorted(polygons):
        looks.setdefault(_look(region), []).append(region)
    return [
        _patch(look, names[alike[0]] if len(alike) == 1 else f"overturns after {alike[0]} or more")
        for look, alike in looks.items()
        if sum(_area(corners) for region in alike for corners in polygons[region]) > _LEAST_SEEN * frame
    ]


def _patch(look: tuple[str, str], label: str) -> Patch:
    from matplotlib.patches import Patch

    return Patch(facecolor=look[0], hatch=look[1], edgecolor=INK, linewidth=0.5, label=label)


def _area(corners: Floats) -> float:
    x, y = corners.T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
