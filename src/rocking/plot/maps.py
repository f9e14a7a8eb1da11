"""Maps of outcomes over two parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.plot.style import STYLE

if TYPE_CHECKING:
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
    title: str,
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
    import matplotlib as mpl
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    count = len(meanings)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.4, 4.2), layout="constrained")
        axes = figure.add_subplot()
        axes.pcolormesh(
            x,
            y,
            outcome,
            cmap=ListedColormap(_COLOURS[:count]),
            norm=BoundaryNorm(np.arange(count + 1) - 0.5, count),
            shading="nearest",
            rasterized=True,
        )
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        axes.set_title(title)
        present = sorted(set(np.unique(outcome).tolist()))
        handles = [Patch(facecolor=_COLOURS[k], edgecolor="black", linewidth=0.5, label=meanings[k]) for k in present]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure
