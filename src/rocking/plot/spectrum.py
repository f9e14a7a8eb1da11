"""A rocking spectrum: peak rotation against the size of the block, and the share of motions that overturn it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.arrays import Flags, Floats, evenly
from rocking.plot.canvas import GROUND, INK, add_labels, add_legend, figure_for, scale_by_ratio, styles_of
from rocking.tables import as_written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

#: Up to so many motions are named; of so few there is nothing to take fractiles of, either.
_FEW: Final = 2

#: So many curves leave space for all of their fractiles, and so many for every motion.
_WITH_ALL_FRACTILES: Final = 2
_WITH_ALL_MOTIONS: Final = 4

#: Most curves that the legend names.
_NAMED: Final = 8

#: Widths of the lines of up to two motions, of the fractile nearest to the median, and of the others.
_WIDTHS: Final = (1.6, 0.7)
_MIDDLE: Final = 1.8
_OTHER: Final = 0.9

#: What marks an end of a line beyond which blocks overturn.
_END: Final[dict[str, Any]] = {"marker": "x", "linestyle": "none", "markersize": 4.0, "markeredgewidth": 1.0}


class SpectrumCurves(NamedTuple):
    """Curves of one slenderness and restitution over the spectrum's abscissa; infinite where the block overturns.

    label : what the legend says of them; none if empty
    singles (motions, points) : peak rotation over slenderness of every motion
    fractiles (fractiles, points) : their fractiles, the middle one drawn thickest
    overturned (points,) : share of the motions that overturn the block
    """

    label: str
    singles: Floats
    fractiles: Floats
    overturned: Floats


def spectrum_figure(
    *,
    x: Floats,
    curves: Sequence[SpectrumCurves],
    fractiles: Sequence[float],
    motions: Sequence[str],
    x_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw peak rotations over the abscissa, and below them the share of motions that overturn the block.

    One curve alone needs no label, and of more than eight some are named. Two motions are named, more are counted, and
    drawn with up to four curves. Of two motions or fewer no fractile is drawn, and of three curves or more only the
    middle one. A line of a named motion, and a
    fractile, ends in a cross where the block of the next point overturns; of a fractile that means that so many motions
    overturn it that there is none. In `ax`, the peak rotations are drawn without the shares.
    """
    few = len(motions) <= _FEW
    middle = _middle(fractiles)
    chosen = {share: k for k, share in enumerate(fractiles) if share == middle or len(curves) <= _WITH_ALL_FRACTILES}
    with figure_for(ax, (5.6, 4.8), figsize, title) as figure:
        panels = figure.subplots(2, 1, sharex=True, height_ratios=(3.2, 1.0)).tolist() if ax is None else [ax]
        peaks, *shares = panels
        for style, curve in zip(styles_of(len(curves)), curves, strict=True):
            if few:
                _draw_named(peaks, x, curve, style)
            else:
                singles = curve.singles if len(curves) <= _WITH_ALL_MOTIONS else ()
                _draw_family(peaks, x, curve, singles, chosen, style)
            for panel in shares:
                panel.step(x, curve.overturned, where="mid", linewidth=1.2, **style)
        for panel in panels:
            panel.grid(True, which="both")
        scale_by_ratio(panels[-1], x)
        peaks.set_ylim(bottom=0.0)
        add_labels(peaks, "" if shares else x_label, "peak rotation / slenderness")
        for panel in shares:
            panel.set_ylim(-0.03, 1.03)
            add_labels(panel, x_label, "share overturned")
        add_legend(figure, ax, [*_handles(curves, motions, chosen), *_ends_handle(peaks)])
    return figure


def _draw_named(axes: Axes, x: Floats, curve: SpectrumCurves, style: dict[str, Any]) -> None:
    for width, single in zip(_WIDTHS, curve.singles, strict=False):
        _draw(axes, x, single, {**style, "linewidth": width})


def _draw_family(
    axes: Axes,
    x: Floats,
    curve: SpectrumCurves,
    singles: Iterable[Floats],
    fractiles: Mapping[float, int],
    style: dict[str, Any],
) -> None:
    """Draw the motions given thin, and the fractiles whose rows are given thicker."""
    for single in singles:
        axes.plot(x, _cut(single), color=style["color"], linewidth=0.5, alpha=0.35)
    for share, row in fractiles.items():
        width = _MIDDLE if share == _middle(fractiles) else _OTHER
        _draw(axes, x, curve.fractiles[row], {**style, "linewidth": width})


def _draw(axes: Axes, x: Floats, values: Floats, style: dict[str, Any]) -> None:
    """Draw a line with gaps where its values are infinite, and mark its ends there."""
    axes.plot(x, _cut(values), marker="o" if x.size == 1 else "", markersize=4.0, **style)
    ends = _ends(np.isfinite(values))
    if ends.any():
        axes.plot(x[ends], values[ends], color=style["color"], **_END)


def _ends(finite: Flags) -> Flags:
    """Points with a value beside which there is one without."""
    before, after = np.append(True, finite[:-1]), np.append(finite[1:], True)
    ends: Flags = finite & ~(before & after)
    return ends


def _middle(fractiles: Iterable[float]) -> float:
    return min(fractiles, key=lambda share: abs(share - 0.5))


def _cut(values: Floats) -> Floats:
    """Values with gaps where they are infinite."""
    return np.where(np.isfinite(values), values, np.nan)


def _handles(curves: Sequence[SpectrumCurves], motions: Sequence[str], fractiles: Iterable[float]) -> list[Line2D]:
    from matplotlib.lines import Line2D

    styles, shown = styles_of(len(curves)), evenly(len(curves), _NAMED)
    each = [
        Line2D([], [], linewidth=1.4, label=as_written(curves[k].label), **styles[k]) for k in shown if curves[k].label
    ]
    if len(shown) < len(curves):
        each.append(Line2D([], [], linestyle="none", label=f"({len(shown)} of {len(curves)} curves are named)"))
    if len(motions) == 1:
        return each
    if len(motions) <= _FEW:
        named = zip(motions, _WIDTHS, strict=False)
        return each + [Line2D([], [], color=INK, linewidth=width, label=as_written(name)) for name, width in named]
    if len(curves) <= _WITH_ALL_MOTIONS:
        each.append(Line2D([], [], color=GROUND, linewidth=0.5, label=f"each of {len(motions)} motions"))
    middle = _middle(fractiles)
    others = ", ".join(f"{100 * share:g}" for share in sorted(fractiles) if share != middle)
    each.append(Line2D([], [], color=INK, linewidth=_MIDDLE, label=_named(f"{100 * middle:g}")))
    if others:
        each.append(Line2D([], [], color=INK, linewidth=_OTHER, label=_named(others)))
    return each


def _ends_handle(axes: Axes) -> list[Line2D]:
    """Make the handle of the crosses, if there are any."""
    from matplotlib.lines import Line2D

    crosses = any(line.get_marker() == _END["marker"] for line in axes.lines)
    return [Line2D([], [], color=INK, label="beyond: overturns", **_END)] if crosses else []


def _named(percent: str) -> str:
    return "median" if percent == "50" else f"{percent} % of the motions are below"
