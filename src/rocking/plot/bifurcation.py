"""Bifurcation diagrams."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.plot.canvas import ABOVE, GROUND, INK, add_labels, add_legend, figure_for

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colour of each way through the values, and area of its marks, points squared; of two the first is the larger, so that
#: the second is seen on it, and the first around it.
_LOOKS: Final = ((INK, 4.0), (ABOVE, 0.9))
_ALONE: Final = ((INK, 0.9),)

_WORDS: Final = {"up": "values going up", "down": "values going down", "afresh": "each value afresh"}


def bifurcation_figure(
    *,
    value: Floats,
    states: Mapping[str, Floats],
    overturned: Flags,
    not_followed: Flags | None = None,
    x_label: str,
    y_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw states, shape (len(value), n), of each direction against a parameter; NaN where there is none.

    Where nothing is left, marks at the lower edge say whether the body overturned or could not be followed.
    """
    from matplotlib.lines import Line2D

    with figure_for(ax, (5.6, 3.8), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        handles: list[Artist] = []
        looks = _ALONE if len(states) == 1 else _LOOKS
        for (way, kept), (colour, area) in zip(states.items(), looks, strict=True):
            x = np.broadcast_to(value[:, None], kept.shape).ravel()
            axes.scatter(x, kept.ravel(), s=area, marker="o", color=colour, linewidths=0.0, rasterized=True)
            size = area**0.5 + 1.0
            handles.append(Line2D([], [], linestyle="", marker="o", color=colour, markersize=size, label=_WORDS[way]))
        for gone, marker, label in ((overturned, "|", "overturned"), (not_followed, "x", "not followed")):
            if gone is None or not gone.any():
                continue
            places = value[gone]
            look: dict[str, Any] = {"linestyle": "", "marker": marker, "color": GROUND}
            axes.plot(places, np.full(places.size, 0.015), transform=axes.get_xaxis_transform(), **look)
            handles.append(Line2D([], [], label=label, **look))
        axes.set_xlim(value[0], value[-1] if value.size > 1 else None)
        add_labels(axes, x_label, y_label)
        add_legend(figure, ax, handles)
    return figure
