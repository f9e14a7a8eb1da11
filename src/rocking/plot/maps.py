"""Maps of outcomes over two parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.plot.canvas import add_labels, add_legend, add_title, figure_for
from rocking.plot.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: From harmless to the worst, each darker than the one before; the last stands out.
_COLOURS: Final = ("#ffffff", "#d7e3f2", "#9db6d4", "#5d7da6", "#1c2c47", "#e0a23c")


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
    x_label, y_label, title : str
        Texts.
    ax : matplotlib.axes.Axes, optional
        Where to draw.
    figsize : (float, float), optional
        Width and height of a new figure, inches; by default 5.4 by 4.2.

    Returns
    -------
    matplotlib.figure.Figure

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
    from matplotlib.patches import Patch

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
        handles = [Patch(facecolor=_COLOURS[k], edgecolor=INK, linewidth=0.5, label=meanings[k]) for k in present]
        add_legend(figure, ax, handles)
    return figure
