"""Schemes for impacts and their accumulation: error against cost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.plot.canvas import GROUND, INK, add_labels, add_legend, figure_for, scale_by_ratio, styles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Marks of the families, which are told apart by them where there are no colours.
_MARKS: Final = "osD^vPX"

#: How the cost of the reference is drawn.
_CERTIFIED: Final[dict[str, Any]] = {"color": GROUND, "linewidth": 1.2, "linestyle": (0, (4, 2))}

#: Errors that are not known to be larger than nothing: rounding of a position, and the bracket of a time of rest, s.
_ROUNDING: Final = 2.0**-52
_BRACKET: Final = 1e-12

#: Size (points) of the names of the curves, and their least distance over the height of the axes.
_LETTERS: Final = 7.5
_LINE: Final = 0.065

#: Ratio of the greatest cost to the least up to which ticks stand between the powers of ten, too.
_FEW: Final = 300.0


class SchemeCurve(NamedTuple):
    """A family of schemes, from cheap to costly.

    Label; costs; errors of the position over the largest one, and of the worst time of rest (s; NaN where there is
    none); whether rests and verdict are right.
    """

    label: str
    cost: Floats
    position: Floats
    rest: Floats
    right: Flags


def schemes_figure(
    *,
    curves: Sequence[SchemeCurve],
    certified: float,
    cost_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw the error of the position against the cost, and below it that of the worst time of rest.

    With ``ax`` the position alone. Hollow marks: a rest is false or missing, or the verdict wrong. Errors that are not
    known to be any are drawn at the lowest that would be. ``certified`` is the cost of the reference.
    """
    from matplotlib.lines import Line2D

    with figure_for(ax, (5.2, 5.4), figsize, title) as figure:
        upper, lower = (ax, None) if ax is not None else figure.subplots(2, 1, sharex=True)
        _draw(upper, curves, [np.maximum(curve.position, _ROUNDING) for curve in curves])
        add_labels(upper, cost_label if lower is None else "", "error of the position over the largest one")
        if lower is not None:
            _draw(lower, curves, [np.maximum(curve.rest, _BRACKET) for curve in curves])
            add_labels(lower, cost_label, "error of the worst time of rest (s)")
        for axes in (upper,) if lower is None else (upper, lower):
            axes.axvline(certified, **_CERTIFIED, zorder=0)
        look: dict[str, Any] = {"color": INK, "linestyle": "", "marker": "o", "markersize": 4.0}
        handles = [
            Line2D([], [], **look, label="every rest found, no other"),
            Line2D([], [], **look, markerfacecolor="white", label="a rest false or missed, or the wrong verdict"),
            Line2D([], [], **_CERTIFIED, label="cost of the certified response"),
        ]
        add_legend(figure, ax, handles)
    return figure


def _draw(axes: Axes, curves: Sequence[SchemeCurve], errors: Sequence[Floats]) -> None:
    """Draw one kind of error, and name each family to the right, at the height of its most exact member."""
    costs = np.concatenate([each.cost for each in curves]) if curves else np.ones(1)
    span = np.array([costs.min(), costs.max()])
    if 0.0 < span[1] < _FEW * span[0]:  # of few decades, others than powers of ten are written, too
        scale_by_ratio(axes, span)
    else:
        axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True)
    ends = []
    for curve, error, style, mark in zip(curves, errors, styles_of(len(curves)), _MARKS, strict=False):
        seen = error > 0.0  # not NaN
        if not seen.any():
            continue
        cost, shown, right = curve.cost[seen], error[seen], curve.right[seen]
        axes.plot(cost, shown, linewidth=1.0, **style)
        for whole, face in ((right, style["color"]), (~right, "white")):
            axes.plot(
                cost[whole], shown[whole], mark, color=style["color"], markerfacecolor=face, markersize=4.5,
                markeredgewidth=0.9, zorder=3,
            )  # fmt: skip
        best = int(np.argmin(shown))
        ends.append((float(cost[best]), float(shown[best]), curve.label, style["color"]))
    _name(axes, ends)


def _name(axes: Axes, ends: list[tuple[float, float, str, str]]) -> None:
    """Write names beside the axes, from below upwards as the points that they belong to, with a line to each."""
    bottom, top = np.log10(axes.get_ylim())
    lowest, height = 0.0, 0.0
    for left, (x, y, text, colour) in enumerate(sorted(ends, key=lambda end: end[1])):
        most = 1.0 - _LINE * (len(ends) - 1 - left)  # what is above needs space, too
        height = min(max((np.log10(y) - bottom) / (top - bottom), lowest), most)
        lowest = height + _LINE
        axes.annotate(
            text, (x, y), xytext=(1.03, height), textcoords=axes.transAxes, va="center", color=INK, fontsize=_LETTERS,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5, "shrinkA": 1.0, "shrinkB": 3.0},
        )  # fmt: skip
