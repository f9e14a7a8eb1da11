"""How well predictions of tests hold: reliability with bands, measured peaks against predicted ones, their ranks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.plot.canvas import ABOVE, GROUND, INK, REST, add_labels, add_legend, figure_for, handles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Bins of the panel of predicted probabilities.
_COUNTED: Final = 20


class Bars(NamedTuple):
    """Observed shares in bins (bins,): ends of each, tests in it, what was predicted, and the band of right ones."""

    lower: Floats
    upper: Floats
    tests: Floats
    predicted: Floats
    observed: Floats
    band_lower: Floats
    band_upper: Floats


class PeaksPlot(NamedTuple):
    """Measured peaks, rad, and the 5 %, 50 % and 95 % of the blocks that stand (tests,); NaN where none does."""

    measured: Floats
    lower: Floats
    median: Floats
    upper: Floats


def validation_figure(
    *,
    reliability: Bars,
    probabilities: Floats,
    overturned: Flags,
    ranks: Bars | None = None,
    peaks: PeaksPlot | None = None,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw the reliability diagram and the predicted probabilities below; beside them peaks and ranks where known.

    In `ax`, the reliability diagram alone.
    """
    with figure_for(ax, (3.7 if peaks is None else 7.0, 4.8), figsize, title) as figure:
        if ax is None:
            panels = figure.subplots(2, 1 if peaks is None else 2, squeeze=False, height_ratios=(2.4, 1.0))
            main, others = panels[0, 0], [panels[1, 0], *panels[:, 1:].ravel()]
        else:
            main, others = ax, []
        _draw_reliability(main, reliability)
        if others:
            _draw_counts(others[0], probabilities, overturned)
        if len(others) > 1 and peaks is not None:
            _draw_peaks(others[1], peaks)
            if ranks is None:
                others[2].set_axis_off()
            else:
                _draw_ranks(others[2], ranks)
        add_legend(figure, ax, handles_of(main, *others))
    return figure


def _draw_reliability(axes: Axes, bars: Bars) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0], color=GROUND, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.vlines(
        bars.predicted,
        bars.band_lower,
        bars.band_upper,
        color=GROUND,
        linewidth=5.0,
        alpha=0.55,
        label="90 % of what right predictions would show",
    )
    axes.plot(
        bars.predicted, bars.observed, "o-", color=INK, linewidth=0.9, markersize=4.0, clip_on=False, label="observed"
    )
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.grid(True)
    add_labels(axes, "predicted probability of overturning", "share that overturned")


def _draw_counts(axes: Axes, probabilities: Floats, overturned: Flags) -> None:
    """Draw how many tests have each probability, those that overturned below those that did not."""
    edges = np.linspace(0.0, 1.0, _COUNTED + 1)
    fell, stood = (np.histogram(probabilities[chosen], edges)[0] for chosen in (overturned, ~overturned))
    axes.bar(edges[:-1], fell, 1.0 / _COUNTED, align="edge", color=ABOVE, linewidth=0.0, label="overturned")
    axes.bar(
        edges[:-1],
        stood,
        1.0 / _COUNTED,
        bottom=fell,
        align="edge",
        color=REST,
        edgecolor=INK,
        linewidth=0.4,
        label="stood",
    )
    axes.set_xlim(0.0, 1.0)
    add_labels(axes, "predicted probability", "tests")


def _draw_peaks(axes: Axes, peaks: PeaksPlot) -> None:
    """Draw the peaks of the blocks that stand over the measured ones, where some stand."""
    known = np.isfinite(peaks.median)
    finite = np.concatenate([peaks.measured, peaks.upper[known]])
    top = 1.05 * max(float(finite.max()), 1e-6)
    axes.plot([0.0, top], [0.0, top], color=GROUND, linewidth=0.8, linestyle=(0, (4, 2)))
    at, low, middle, high = (each[known] for each in peaks)
    axes.vlines(at, low, high, color=INK, linewidth=0.6, label="90 % of the blocks that stand")
    axes.plot(at, middle, "s", color=INK, mfc="white", markersize=3.2, label="their median")
    axes.set(xlim=(0.0, top), ylim=(0.0, top))
    axes.grid(True)
    add_labels(axes, "measured peak rotation (rad)", "predicted peak rotation (rad)")


def _draw_ranks(axes: Axes, bars: Bars) -> None:
    """Draw the share of the measured peaks in each bin of their ranks, and the band of right predictions."""
    axes.bar(
        bars.lower,
        bars.band_upper - bars.band_lower,
        bars.upper - bars.lower,
        bottom=bars.band_lower,
        align="edge",
        color=GROUND,
        alpha=0.55,
        linewidth=0.0,
    )
    axes.stairs(bars.observed, np.append(bars.lower, 1.0), color=INK, linewidth=1.2)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(bottom=0.0)
    add_labels(axes, "rank among the blocks that stand", "share of peaks")
