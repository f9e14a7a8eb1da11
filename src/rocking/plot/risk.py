"""Risk: a hazard curve, and from which intensities the rate of exceeding each limit state comes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import add_labels, add_legend, add_title, figure_for, labelled
from rocking.plot.style import CURVES, GROUND

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rates are drawn down to this part of the highest contribution.
_LEAST = 1e-3


class RiskLine(NamedTuple):
    """What the intensities contribute to a limit state's rate, for each factor of e in intensity (1/year)."""

    label: str
    contribution: Floats


def risk_figure(
    *,
    intensity: Floats,
    rate: Floats,
    known: tuple[float, float],
    lines: Sequence[RiskLine],
    intensity_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a hazard curve, dotted where it is extended, and the contributions to each limit state's rate below it.

    Parameters
    ----------
    intensity, rate : ndarray, shape (n,)
        Annual rates at which intensities are exceeded.
    known : (float, float)
        First and last intensity of the hazard curve.
    lines : sequence of RiskLine
        One for every limit state.
    intensity_label, title : str
        Texts.
    ax : matplotlib.axes.Axes, optional
        Where to draw.
    figsize : (float, float), optional
        Width and height of a new figure, inches.
    """
    with figure_for(ax, (5.6, 4.2), figsize) as figure:
        axes = ax or figure.add_subplot()
        inside = (intensity >= known[0]) & (intensity <= known[1])
        axes.plot(intensity, rate, color=GROUND, linewidth=1.0, linestyle=":")
        axes.plot(intensity[inside], rate[inside], color=GROUND, linewidth=2.0, label="hazard: intensity exceeded")
        for k, line in enumerate(lines):
            style = CURVES[k % len(CURVES)]
            axes.plot(intensity, line.contribution, linewidth=1.5, label=line.label, **style)
            axes.fill_between(intensity, 0.0, line.contribution, color=style["color"], alpha=0.12, linewidth=0.0)
        highest = max(float(line.contribution.max()) for line in lines)
        shown = np.any([line.contribution > _LEAST * highest for line in lines], axis=0) | inside
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set(xlim=(float(intensity[shown][0]), float(intensity[shown][-1])), ylim=(_LEAST * highest, None))
        axes.grid()
        add_labels(axes, intensity_label, "annual rate (contributions: per unit of ln)")
        add_title(figure, ax, title)
        add_legend(figure, ax, labelled(axes))
    return figure
