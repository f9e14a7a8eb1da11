"""Basins of attraction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.plot.canvas import INK, add_labels, add_legend, cell_edges, figure_for

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Shades by kind, each of another luminance; those of orbits from the largest basin on, of which the last is repeated.
_SHADES: Final = {
    "orbit": ("#f4f7fb", "#c3d3e6", "#8fabcd", "#6488b3", "#e8d9a8", "#bda55d"),
    "overturns": ("#8c3410", "#3f1404"),
    "unsettled": ("#7a7f85",),
    "missing": ("#ffffff",),
}

#: Marks of the points of orbits, those of one orbit alike.
_MARKS: Final = ("o", "^", "s", "D", "v", "P")


def basins_figure(
    *,
    x: Floats,
    y: Floats,
    outcome: NDArray[np.integer],
    names: Sequence[str],
    kinds: Sequence[str],
    orbits: Floats,
    x_label: str,
    y_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw which attractor each state of a grid goes to: numbers of shape (len(y), len(x)), -1 where it is not known.

    A kind is "orbit", "overturns" or "unsettled"; `orbits` has shape (attractors, points, 2), NaN where there is none.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shades = [_SHADES["missing"][0]]
    for k, kind in enumerate(kinds):
        among = _SHADES[kind]
        shades.append(among[min(kinds[:k].count(kind), len(among) - 1)])
    colours, norm = ListedColormap(shades), BoundaryNorm(np.arange(len(shades) + 1) - 1.5, len(shades))
    with figure_for(ax, (5.4, 4.6), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        axes.pcolormesh(cell_edges(x), cell_edges(y), outcome, cmap=colours, norm=norm, rasterized=True)
        handles: list[Artist] = []
        if np.any(outcome < 0):
            handles.append(Patch(facecolor=shades[0], edgecolor=INK, linewidth=0.5, hatch="....", label="not reached"))
        marked = 0
        for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
            handles.append(Patch(facecolor=shades[k + 1], edgecolor=INK, linewidth=0.5, label=name))
            if kind != "orbit":
                continue
            look: dict[str, Any] = {
                "marker": _MARKS[marked % len(_MARKS)],
                "color": "white",
                "markeredgecolor": INK,
                "markersize": 4.5,
            }
            inside = (orbits[k] >= [x[0], y[0]]).all(axis=1) & (orbits[k] <= [x[-1], y[-1]]).all(axis=1)
            if inside.any():
                axes.plot(*orbits[k][inside].T, linestyle="", markeredgewidth=0.8, **look)
                handles.append(Line2D([], [], linestyle="", label=f"{name}: its points", **look))
            marked += 1
        add_labels(axes, x_label, y_label)
        add_legend(figure, ax, handles)
    return figure
