"""A number for each of many blocks, over their frequency parameters and slendernesses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.plot.canvas import add_labels, add_legend, add_title, figure_for, labelled
from rocking.plot.style import ABOVE, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Width and height of one panel, inches, and how many stand side by side.
_PANEL: Final = (3.5, 2.9)
_BESIDE: Final = 2

#: Area of a mark, points squared, shared by all of them, between bounds.
_AREA: Final = 9000.0
_MARK: Final = (6.0, 60.0)


def blocks_figure(
    p: Floats,
    alpha: Floats,
    *,
    panels: Mapping[str, Floats],
    value_label: str,
    missing_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a number for each block as the colour of a mark, in one panel or several with the same colours.

    Parameters
    ----------
    p, alpha : ndarray, shape (n,)
        Frequency parameters, rad/s, and slendernesses, rad.
    panels : mapping of str to ndarray, shape (n,)
        Values by the name of the panel; where one is not finite, the block has a cross.
    value_label, missing_label, title : str
        Texts; `missing_label` says what a cross means.
    ax, figsize
        As for `figure_for`. In `ax` there is room for one panel.

    Raises
    ------
    InvalidOption
        If there are several panels for one `ax`.

    Examples
    --------
    >>> import numpy as np
    >>> figure = blocks_figure(
    ...     np.array([1.0, 2.0]), np.array([0.1, 0.1]), panels={"overturning": np.array([0.3, np.nan])},
    ...     value_label="median PGA (g)", missing_label="no curve fits")
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['no curve fits']
    """
    if ax is not None and len(panels) > 1:
        raise InvalidOption(f"{len(panels)} panels need a figure of their own: leave ax out, or select one of them")
    columns = min(len(panels), _BESIDE)
    rows = math.ceil(len(panels) / columns)
    finite = np.concatenate([values[np.isfinite(values)] for values in panels.values()])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    area = float(np.clip(_AREA / len(p), *_MARK))
    with figure_for(ax, (columns * _PANEL[0] + 0.6, rows * _PANEL[1] + 0.4), figsize) as figure:
        axes = [ax] if ax is not None else list(np.ravel(figure.subplots(rows, columns, squeeze=False)))
        for each, (name, values) in zip(axes, panels.items(), strict=False):
            there = np.isfinite(values)
            marks = each.scatter(
                p[there],
                np.degrees(alpha[there]),
                c=values[there],
                s=area,
                marker="s",
                cmap="cividis_r",
                vmin=low,
                vmax=high,
                linewidth=0.0,
            )
            if not there.all():
                x, y = p[~there], np.degrees(alpha[~there])
                each.scatter(x, y, s=area, marker="x", color=ABOVE, linewidth=0.7, label=missing_label)
            add_labels(each, "p (rad/s)", "slenderness (degrees)")
            if len(panels) > 1:
                each.set_title(name, color=INK)
        for spare in axes[len(panels) :]:
            spare.remove()
        figure.colorbar(marks, ax=axes[: len(panels)], label=value_label, shrink=0.9)
        add_title(figure, ax, title)
        add_legend(figure, ax, labelled(*axes[: len(panels)]))
    return figure
