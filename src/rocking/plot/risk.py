"""Risk: a hazard curve, and from which intensities the rate of exceeding each limit state comes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import ABOVE, CURVES, GROUND, add_labels, add_legend, figure_for, handles_of, scale_by_ratio
from rocking.tables import as_written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Shares of a rate are shown from this part of the highest one on.
_LEAST = 1e-3

#: Rates are shown from this part of the lowest of the hazard curve to so many times its highest.
_MARGIN = 10.0


class HazardLine(NamedTuple):
    """Annual rates at which intensities are exceeded, and the ends of the curve, beyond which it is extended."""

    rate: Floats
    known: tuple[float, float]


class RiskLine(NamedTuple):
    """Which share of a limit state's rate comes from about each intensity, for each factor of e in intensity."""

    label: str
    share: Floats


def risk_figure(
    *,
    intensity: Floats,
    hazard: HazardLine,
    lines: Sequence[RiskLine],
    intensity_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a hazard curve, dotted where it is extended, and below it where each limit state's rate comes from.

    In `ax`, the shares of the rates are drawn without the hazard curve.
    """
    with figure_for(ax, (5.6, 5.2), figsize, title) as figure:
        panels = figure.subplots(2, 1, sharex=True).tolist() if ax is None else [ax]
        *curves, shares = panels
        for axes in curves:
            _draw_hazard(axes, intensity, hazard)
        for k, line in enumerate(lines):
            style = CURVES[k % len(CURVES)]
            shares.plot(intensity, line.share, linewidth=1.5, label=as_written(line.label), **style)
            shares.fill_between(intensity, 0.0, line.share, color=style["color"], alpha=0.12, linewidth=0.0)
        shown = _inside(intensity, hazard.known)
        for line in lines:
            shown |= line.share > _LEAST * line.share.max()
        for axes in curves:
            axes.set_ylim(0.5 * float(hazard.rate[shown].min()), 2.0 * float(hazard.rate[shown].max()))
        scale_by_ratio(shares, intensity[shown])
        shares.set(xlim=(float(intensity[shown][0]), float(intensity[shown][-1])))
        shares.set_ylim(bottom=0.0)
        shares.grid(True)
        add_labels(shares, intensity_label, "share of the rate per factor of e")
        add_legend(figure, ax, handles_of(*panels))
    return figure


def survival_figure(
    *,
    intensity: Floats,
    largest: Floats,
    largest_label: str,
    hazard: HazardLine | None,
    intensity_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw the largest annual rates of motions that fit with a block that still stands, and a hazard curve."""
    with figure_for(ax, (5.6, 3.6), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        scale_by_ratio(axes, intensity)
        if hazard is not None:
            _draw_hazard(axes, intensity, hazard)
            above = hazard.rate > largest
            axes.fill_between(
                intensity, largest, hazard.rate, where=above.tolist(), color=ABOVE, alpha=0.2, linewidth=0.0,
                label="more often than the block allows" if above.any() else "",
            )  # fmt: skip
        axes.plot(intensity, largest, label=largest_label, linewidth=1.5, **CURVES[1])
        axes.set_yscale("log")
        lowest, highest = float(largest.min()), float(largest[largest < np.inf].max())
        if hazard is not None:
            lowest, highest = min(lowest, float(hazard.rate.min())), float(hazard.rate.max())
        axes.set(xlim=(float(intensity[0]), float(intensity[-1])), ylim=(0.5 * lowest, min(_MARGIN * highest, 10.0)))
        axes.grid(True)
        add_labels(axes, intensity_label, "exceeded, times a year")
        add_legend(figure, ax, handles_of(axes))
    return figure


def _inside(intensity: Floats, known: tuple[float, float]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.asarray((intensity >= known[0]) & (intensity <= known[1]))


def _draw_hazard(axes: Axes, intensity: Floats, hazard: HazardLine) -> None:
    """Draw a hazard curve, dotted where it is extended."""
    inside = _inside(intensity, hazard.known)
    label = "hazard curve (dotted: extended)" if not inside.all() else "hazard curve"
    axes.plot(intensity, hazard.rate, color=GROUND, linewidth=1.0, linestyle=":")
    axes.plot(intensity[inside], hazard.rate[inside], color=GROUND, linewidth=2.0, label=label)
    axes.set_yscale("log")
    axes.grid(True)
    add_labels(axes, "", "exceeded, times a year")
