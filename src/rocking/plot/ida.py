"""Incremental dynamic analysis: motions scaled up, and the bands of levels that overturn the block."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Unpack

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.tables import as_written
from rocking.plot.canvas import ABOVE, CURVES, GROUND, INK, Place, add_labels, page_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

#: Up to so many motions have a line style of their own; more are drawn alike, with the fractiles of their levels.
_FEW: Final = len(CURVES)

#: Shares of the motions that the fractiles are of, and their lines. The legend names these: beside curves that lie
#: close names would stand on the wrong ones.
FRACTILES: Final[Mapping[float, dict[str, Any]]] = {
    0.16: {"linewidth": 1.1, "linestyle": (0, (1, 1))},
    0.5: {"linewidth": 1.8, "linestyle": "-"},
    0.84: {"linewidth": 1.1, "linestyle": (0, (5, 1.5))},
}

#: Peak rotations at which the fractiles are taken.
_POINTS: Final = 200

#: The frame ends with the levels, or this many times above what stands: where strips go on, arrows say so.
_HEADROOM: Final = 1.5

_OWN: Final[dict[str, Any]] = {"linewidth": 1.1, "markersize": 5.0}
_ALIKE: Final[dict[str, Any]] = {"linewidth": 0.6, "markersize": 3.0}
#: Between what stands and what overturns: the way off the frame, and back.
_AWAY: Final[dict[str, Any]] = {"linestyle": (0, (1, 2)), "linewidth": 0.5}
_STRIP: Final[dict[str, Any]] = {"linewidth": 5.0, "solid_capstyle": "butt"}

#: Ends of strips: lines, so that the thinnest strip is seen, and an arrow where one leaves the frame.
_END: Final[dict[str, Any]] = {"linestyle": "", "marker": "_", "markersize": 5.0, "markeredgewidth": 0.8}
_GOES_ON: Final[dict[str, Any]] = {"linestyle": "", "marker": "^", "markersize": 9.0, "markeredgewidth": 0.0}

#: Up to so many strips have space for names in lines of so many letters, which would else be as long as the panel.
_ROOMY: Final = 8
_NAME_LINE: Final = 18

#: Marker that looks like a kinked curve.
_KINK: Final = [(-4, -4), (2, -1), (0, 1), (4, 4)]
_KINKED: Final = "kink: from there on, another swing is the largest"


class ScaledMotion(NamedTuple):
    """One motion scaled up: levels, peak rotation over slenderness, and the bands (n, 2) of levels that overturn."""

    label: str
    levels: Floats
    peak: Floats
    bands: Floats


def ida_figure(*, motions: Sequence[ScaledMotion], level_label: str, **place: Unpack[Place]) -> Figure:
    """Draw the level of scaled motions against the peak rotation, and beside it the levels that overturn."""
    few = len(motions) <= _FEW
    styles = [*CURVES[: len(motions)]] if few else [{"color": GROUND, "linestyle": "-"}] * len(motions)
    with page_for((7.0, 4.2), **place) as page:
        curves, *strips = page.panels(1, 2, sharey=True, width_ratios=(2.0, 1.0))
        for motion, style in zip(motions, styles, strict=True):
            look = {"marker": ".", "markeredgewidth": 0.0, "label": as_written(motion.label), **style}
            peak = np.where(np.isfinite(motion.peak), motion.peak, np.nan)
            curves.plot(peak, motion.levels, **look, **(_OWN if few else _ALIKE))
        if not few:
            _draw_fractiles(curves, motions)
        curves.set_xlim(left=0.0, right=curves.get_xlim()[1])
        for motion, style in zip(motions, styles, strict=True):
            _draw_ways(curves, motion, style["color"])
        curves.set_ylim(0.0, _highest_shown(motions))
        curves.grid(True)
        add_labels(curves, "peak rotation / slenderness", level_label)
        for panel in strips:
            _draw_strips(panel, motions, styles if few else [{"color": INK}] * len(motions))
            _name_strips(panel, motions, few=few)
        goes_on = any(high > _highest_shown(motions) for motion in motions for _, high in motion.bands)
        page.handles = _handles(motions if few else [], with_strips=bool(strips), with_arrows=goes_on)
    return page.figure


def levels_reaching(motion: ScaledMotion, peaks: Floats) -> Floats:
    """Lowest level at which a motion reaches each of these peak rotations; infinite where it never does."""
    overturns = float(np.min(motion.bands[:, 0], initial=np.inf))
    below = motion.levels < overturns
    level, peak = motion.levels[below], motion.peak[below]
    if not level.size:
        return np.full(peaks.shape, overturns)
    first = np.searchsorted(np.maximum.accumulate(peak), peaks)
    after = np.minimum(first, level.size - 1)
    before = np.maximum(after - 1, 0)
    rise = np.where(peak[after] > peak[before], peak[after] - peak[before], np.inf)
    between = level[before] + (peaks - peak[before]) / rise * (level[after] - level[before])
    return np.where(first < level.size, between, overturns)


def _draw_ways(axes: Axes, motion: ScaledMotion, color: str) -> None:
    """Draw how the curve leaves the frame where a band begins, and comes back where it ends."""
    edge = axes.get_xlim()[1]
    stands = np.isfinite(motion.peak)
    level, peak = motion.levels[stands], motion.peak[stands]
    for low, high in motion.bands:
        below, above = np.flatnonzero(level <= low), np.flatnonzero(level >= high)
        if below.size and low > motion.levels[0]:
            axes.plot([peak[below[-1]], edge], [level[below[-1]], low], color=color, **_AWAY)
        if above.size:
            axes.plot([edge, peak[above[0]]], [high, level[above[0]]], color=color, **_AWAY)


def _draw_fractiles(axes: Axes, motions: Sequence[ScaledMotion]) -> None:
    finite = np.concatenate([motion.peak[np.isfinite(motion.peak)] for motion in motions])
    peaks = np.linspace(0.0, float(np.max(finite, initial=0.0)), _POINTS)[1:]
    reached = np.sort([levels_reaching(motion, peaks) for motion in motions], axis=0)
    for share, look in FRACTILES.items():
        # The lowest level that is enough for this share of the motions.
        level = reached[int(np.ceil(share * len(motions))) - 1]
        shown = np.isfinite(level)
        axes.plot(peaks[shown], level[shown], color=ABOVE, label=f"{100 * share:g} %", **look)


def _highest_shown(motions: Sequence[ScaledMotion]) -> float:
    """Return a level a little above the highest at which some motion leaves the block standing: all strips go on."""
    stands = [motion.levels[np.isfinite(motion.peak)] for motion in motions]
    last = max(float(motion.levels[-1]) for motion in motions)
    return min(_HEADROOM * float(np.max(np.concatenate(stands), initial=0.0)) or last, last)


def _draw_strips(axes: Axes, motions: Sequence[ScaledMotion], styles: Sequence[dict[str, Any]]) -> None:
    top = axes.get_ylim()[1]
    for k, (motion, style) in enumerate(zip(motions, styles, strict=True)):
        for low, high in motion.bands:
            axes.plot([k, k], [low, high], color=style["color"], **_STRIP)
            axes.plot([k, k], [low, high], color=style["color"], **_END)
            if high > top:
                axes.plot(k, top, color=style["color"], clip_on=False, **_GOES_ON)
    axes.set(xlim=(-0.7, len(motions) - 0.3))
    axes.tick_params(axis="y", left=False, labelleft=False)
    axes.grid(axis="y")


def _name_strips(axes: Axes, motions: Sequence[ScaledMotion], *, few: bool) -> None:
    """Write below each strip the number that its motion has in the legend, or its name where that has none."""
    axes.set_xlabel("overturns")
    if not few:
        width = _NAME_LINE if len(motions) <= _ROOMY else len(max((motion.label for motion in motions), key=len))
        names = [textwrap.fill(as_written(motion.label), width) for motion in motions]
        axes.set_xticks(range(len(motions)), names, rotation=90, fontsize="x-small")
    elif len(motions) > 1:
        axes.set_xticks(range(len(motions)), [str(k + 1) for k in range(len(motions))])
    else:
        axes.set_xticks([])


def _handles(named: Sequence[ScaledMotion], *, with_strips: bool, with_arrows: bool) -> list[Line2D]:
    """Name the motions that have a style of their own, and say what else is drawn."""
    from matplotlib.lines import Line2D

    labels = [as_written(motion.label) for motion in named]
    names = [f"{k}: {label}" if len(named) > 1 else label for k, label in enumerate(labels, start=1)]
    handles = [
        Line2D([], [], linewidth=1.1, label=name, **style) for name, style in zip(names, CURVES, strict=False)
    ] or [
        Line2D([], [], color=GROUND, linewidth=0.6, label="each motion"),
        *(
            Line2D([], [], color=ABOVE, label=f"level that suffices for {100 * share:g} % of them", **look)
            for share, look in FRACTILES.items()
        ),
    ]
    alone: dict[str, Any] = {"color": INK, "linestyle": ""}
    handles += [
        Line2D([], [], marker=".", markersize=5.0, label="dot: a level at which it stands", **alone),
        Line2D([], [], color=GROUND, label="dotted: off to overturning, and back", **_AWAY | {"linewidth": 1.0}),
        Line2D([], [], marker=_KINK, markersize=8.0, markerfacecolor="none", label=_KINKED, **alone),
    ]
    if with_strips:
        arrow = " (arrow: and above)" if with_arrows else ""
        handles.append(Line2D([], [], color=INK, label=f"strip: levels that overturn{arrow}", **_STRIP))
    return handles
