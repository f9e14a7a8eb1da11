"""How well a calibrated block explains outcomes of tests or a rotation history, and how reliable predictions are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.plot.canvas import ABOVE, CURVES, GROUND, INK, add_labels, add_legend, figure_for, handles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Bars of a histogram of blocks.
_BINS: Final = 24

_DOTS: Final[dict[str, Any]] = {"linestyle": "", "markersize": 3.2, "markeredgewidth": 0.6, "clip_on": False}


class Parameter(NamedTuple):
    """One parameter of the blocks that explain the outcomes: values (blocks, sides), and what is known of each side.

    estimates (sides, 3) : median, lower and upper end of its interval
    bounds : lowest and highest value that was thinkable
    """

    label: str
    values: Floats
    estimates: Floats
    bounds: tuple[float, float]


def outcomes_figure(
    *,
    probabilities: Floats,
    overturned: Flags,
    parameters: Sequence[Parameter],
    weights: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw what happened in every test against its fitted probability, and the blocks behind that by their parameters.

    Probabilities and outcomes have shape (tests,), weights (blocks,). In `ax`, the tests are drawn without the blocks.
    """
    with figure_for(ax, (7.0, 4.6), figsize, title) as figure:
        tests, panels = _panels(figure, len(parameters)) if ax is None else (ax, [])
        _draw_tests(tests, probabilities, overturned)
        for panel, parameter in zip(panels, parameters, strict=False):
            _draw_parameter(panel, parameter, weights)
        if panels:
            add_labels(panels[0], parameters[0].label, "share of blocks")
        add_legend(figure, ax, handles_of(tests, *panels))
    return figure


def measured_figure(
    *,
    time: Floats,
    measured: Floats,
    residual: Floats,
    fitted_time: Floats,
    fitted: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a measured rotation history (rad, over s), that of the fitted block, and what is left between them.

    In `ax`, the histories are drawn without the residuals.
    """
    with figure_for(ax, (7.0, 4.0), figsize, title) as figure:
        panels = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0)).tolist() if ax is None else [ax]
        main, *others = panels
        main.plot(time, measured, ".", color=GROUND, markersize=3.5, markeredgewidth=0.0, label="measured")
        main.plot(fitted_time, fitted, color=ABOVE, linewidth=0.9, label="fitted")
        main.set_xlim(time[0], time[-1])
        add_labels(main, "" if others else "time (s)", "rotation (rad)")
        for panel in others:
            panel.plot(time, residual, color=INK, linewidth=0.6)
            add_labels(panel, "time (s)", "residual (rad)")
        for panel in panels:
            panel.axhline(0.0, color=INK, linewidth=0.4)
        add_legend(figure, ax, handles_of(main))
    return figure


def _panels(figure: Figure, count: int) -> tuple[Axes, list[Axes]]:
    grid = figure.add_gridspec(2, count, height_ratios=(1.2, 1.0))
    return figure.add_subplot(grid[0, :]), [figure.add_subplot(grid[1, k]) for k in range(count)]


def _draw_tests(axes: Axes, probabilities: Floats, overturned: Flags) -> None:
    """Draw the probabilities in increasing order, and each outcome where a sure prediction would put it."""
    order = np.argsort(probabilities, kind="stable")
    number, fell = np.arange(1, order.size + 1), overturned[order]
    axes.plot(number, probabilities[order], color=INK, linewidth=1.2, label="fitted probability")
    axes.plot(number[fell], np.ones(fell.sum()), "v", color=ABOVE, label="overturned", **_DOTS)
    axes.plot(number[~fell], np.zeros((~fell).sum()), "o", color=INK, mfc="white", label="did not overturn", **_DOTS)
    axes.set_ylim(0.0, 1.0)
    axes.grid(True)
    add_labels(axes, "test, by its probability", "probability of overturning")


def _draw_parameter(axes: Axes, parameter: Parameter, weights: Floats) -> None:
    """Draw how the blocks are distributed, and above that the median of the population's centre and its interval."""
    sides = parameter.values.shape[1]
    drawn = {"side +": CURVES[3], "side -": CURVES[1]} if sides > 1 else {"both sides": CURVES[2] | {"linestyle": "-"}}
    edges = np.histogram_bin_edges(parameter.values, _BINS)
    for bound in parameter.bounds:
        axes.axvline(bound, color=GROUND, linewidth=1.0, linestyle=(0, (3, 2)), label="bound")
    for k, (name, style) in enumerate(drawn.items()):
        shares = np.histogram(parameter.values[:, k], edges, weights=weights)[0]
        axes.stairs(shares, edges, linewidth=1.1, label=name, **style)
        median, low, high = parameter.estimates[k]
        at = axes.get_xaxis_transform()
        height = 0.97 - 0.07 * k
        axes.plot([low, high], [height] * 2, color=style["color"], linewidth=1.0, transform=at)
        axes.plot(median, height, "|", color=style["color"], markersize=7.0, transform=at)
    axes.plot([], [], "|-", color=GROUND, linewidth=1.0, markersize=7.0, label="centre: median and 90 %")
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    axes.set_yticks([])
    add_labels(axes, parameter.label, "")


def reliability_figure(
    *,
    predicted: Floats,
    observed: Floats,
    band_lower: Floats,
    band_upper: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw observed shares against predicted ones (bins,), with the bands of right predictions."""
    with figure_for(ax, (3.7, 3.7), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=GROUND, linewidth=0.8, linestyle=(0, (4, 2)))
        label = "90 % of what right predictions would show"
        axes.vlines(predicted, band_lower, band_upper, color=GROUND, linewidth=5.0, alpha=0.55, label=label)
        axes.plot(predicted, observed, "o-", color=INK, linewidth=0.9, markersize=4.0, clip_on=False, label="observed")
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        axes.grid(True)
        add_labels(axes, "predicted probability of overturning", "share that overturned")
        add_legend(figure, ax, handles_of(axes))
    return figure
