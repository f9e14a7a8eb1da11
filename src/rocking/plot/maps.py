"""Maps over two parameters: outcomes of points, regions between boundaries, basins, a number for each block."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Floats
from rocking.core.tables import as_written
from rocking.errors import InvalidOption
from rocking.plot.boundaries import Stack, runs
from rocking.plot.canvas import ABOVE, INK, Place, add_labels, cell_edges, page_for

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

#: From harmless to the worst, each darker than the one before; the last stands out.
_COLOURS: Final = ("#ffffff", "#d7e3f2", "#9db6d4", "#5d7da6", "#1c2c47", "#e0a23c")

#: Colour of the hatch over what overturns later.
_LATER: Final = "#b0390c"

#: Colour and hatch of regions in which the block stays, and of those in which it overturns after 0, 1, ... impacts,
#: from darkest to lightest: hatched, so that none is taken for one of the others in grey. The second one of those in
#: which it stays is the darkest, as it is often a strip and must be seen between the others.
_STAYS: Final = (("#ffffff", ""), ("#5d7da6", ""), ("#dde7f0", ""))
_OVERTURNS_AFTER_REST: Final = ("#b0390c", "ooo")
_UNFINISHED: Final = ("#b5b5b5", "++")
_OVERTURNS: Final = (
    ("#7d2706", ""),
    ("#d9692a", "////"),
    ("#eda565", "\\\\\\\\"),
    ("#f8cf9f", "xxxx"),
    ("#fbe7cd", "...."),
)

#: Share of the frame below which nobody sees a region.
_LEAST_SEEN: Final = 1e-3

#: The ends of a frame around one value, over it.
_AROUND: Final = np.array([0.9, 1.1])

#: Shares of the frame's height: a region lower than the first, about half a point, is no more than a speck, and one
#: lower than the second would vanish between the lines on both sides of it.
_SPECK: Final = 2e-3
_STRIP: Final = 1e-2


def outcome_figure(
    *,
    x: Floats,
    y: Floats,
    outcome: NDArray[np.integer],
    meanings: Sequence[str],
    later: NDArray[np.bool_],
    x_label: str,
    y_label: str,
    **place: Unpack[Place],
) -> Figure:
    """Draw which of up to six outcomes each point of a grid has: numbers of shape (len(y), len(x))."""
    from matplotlib import rc_context
    from matplotlib.colors import BoundaryNorm, ListedColormap

    count = len(meanings)
    with page_for((5.4, 4.2), **place) as page:
        (axes,) = page.panels()
        colours, norm = ListedColormap(_COLOURS[:count]), BoundaryNorm(np.arange(count + 1) - 0.5, count)
        axes.pcolormesh(cell_edges(x), cell_edges(y), outcome, cmap=colours, norm=norm, rasterized=True)
        present = sorted(set(np.unique(outcome).tolist()))
        handles = [_patch((_COLOURS[k], ""), meanings[k]) for k in present]
        if later.any():
            # Two hatches over each other are seen on the lightest colours and on the darkest.
            for ink, width in (("#ffffff", 2.0), (_LATER, 0.9)):
                with rc_context({"hatch.linewidth": width}):
                    axes.pcolor(
                        cell_edges(x), cell_edges(y), np.ma.masked_where(~later, outcome), facecolor="none",
                        cmap=ListedColormap(["none"]), hatch="////", edgecolor=ink, linewidth=0.0,
                    )  # fmt: skip
            handles.append(_patch(("#ffffff", "////"), "overturns later"))
        add_labels(axes, x_label, y_label)
        page.handles = handles
    return page.figure


def regions_figure(
    *,
    x: Floats,
    y_range: tuple[float, float],
    edges: Sequence[Floats],
    regions: Sequence[Sequence[int]],
    names: Mapping[int, str],
    x_label: str,
    y_label: str,
    **place: Unpack[Place],
) -> Figure:
    """Draw regions between boundaries that are known at increasing abscissae x, shape (n,).

    At each abscissa, `edges` are the ordinates of the boundaries, increasing, and `regions` those below, between and
    above them: negative ones, from -3 on, where the block stays, the others where it overturns after so many impacts.
    Those that can be seen are in the legend by their names. How the regions of neighbours meet says
    `rocking.plot.boundaries`. A strip has no lines around it, which would hide it, and a region too low to be seen none
    that would make it seen.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    low, high = y_range
    # One column, or one level, fills the frame.
    if x.size == 1:
        x, edges, regions = x * _AROUND, [*edges] * 2, [*regions] * 2
    if low == high:
        low, high = low * _AROUND
    stacks = [Stack(np.array([low, *edge, high]), tuple(at)) for edge, at in zip(edges, regions, strict=True)]
    polygons, specks = dict[int, list[Floats]](), dict[int, list[Floats]]()
    tallest: dict[int, float] = {}
    lines: list[Floats] = []
    for abscissae, levels, inside in runs(x, stacks):
        curves = [np.column_stack([abscissae, level]) for level in levels]
        heights = np.diff(levels, axis=0).max(axis=1) / (high - low)
        for region, height, below, above in zip(inside, heights, curves, curves[1:], strict=False):
            among = polygons if height > _SPECK else specks
            among.setdefault(region, []).append(np.concatenate([below, above[::-1]]))
            tallest[region] = max(height, tallest.get(region, 0.0))
        seen = np.flatnonzero(heights > _SPECK)
        lines += [curves[j + 1] for j, k in pairwise(seen) if min(heights[j], heights[k]) > _STRIP]
    with page_for((5.6, 4.6), **place) as page:
        (axes,) = page.panels()
        for region, corners in specks.items():
            axes.add_collection(PolyCollection(corners, facecolors=_look(region)[0], linewidths=0.0))
        for region, corners in polygons.items():
            colour, hatch = _look(region)
            # An edge of the same colour closes the seams between polygons; a hatch takes the colour of its edge.
            axes.add_collection(PolyCollection(corners, facecolors=colour, edgecolors=colour, linewidths=0.5))
            if hatch:
                shape = PolyCollection(corners, facecolors="none", edgecolors=INK, linewidths=0.0, hatch=hatch)
                axes.add_collection(shape)
        axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.5, capstyle="round", snap=False))
        axes.set(xlim=(x[0], x[-1]), ylim=(low, high))
        add_labels(axes, x_label, y_label)
        strips = {region: f"{name} (a strip)" for region, name in names.items() if tallest.get(region, 1.0) < _STRIP}
        page.handles = _patches(polygons, {**names, **strips}, (x[-1] - x[0]) * (high - low))
    return page.figure


def _look(region: int) -> tuple[str, str]:
    """Colour and hatch of a region: from -5, not finished, and -4, overturns after a rest, to n impacts."""
    if region < 0:
        return (_UNFINISHED, _OVERTURNS_AFTER_REST, *_STAYS)[region + 5]
    return _OVERTURNS[min(region, len(_OVERTURNS) - 1)]


def _patches(polygons: Mapping[int, Sequence[Floats]], names: Mapping[int, str], frame: float) -> list[Patch]:
    """Make the handles of the legend for what can be seen; regions that look the same share one."""

    def area(x: Floats, y: Floats) -> float:
        return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))

    looks: dict[tuple[str, str], list[int]] = {}
    for region in sorted(polygons):
        looks.setdefault(_look(region), []).append(region)
    return [
        _patch(look, names[alike[0]] if len(alike) == 1 else f"overturns after {alike[0]} or more")
        for look, alike in looks.items()
        if sum(area(*corners.T) for region in alike for corners in polygons[region]) > _LEAST_SEEN * frame
    ]


def _patch(look: tuple[str, str], label: str) -> Patch:
    from matplotlib.patches import Patch

    return Patch(facecolor=look[0], hatch=look[1], edgecolor=INK, linewidth=0.5, label=label)


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
    **place: Unpack[Place],
) -> Figure:
    """Draw a number for each block as the colour of a mark, in one panel or several with the same colours."""
    if place.get("ax") is not None and len(panels) > 1:
        raise InvalidOption(f"{len(panels)} panels need a figure of their own: leave ax out, or select one of them")
    columns = min(len(panels), _BESIDE)
    rows = math.ceil(len(panels) / columns)
    finite = np.concatenate([values[np.isfinite(values)] for values in panels.values()])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    area = float(np.clip(_AREA / len(p), *_MARK))
    with page_for((columns * _PANEL[0] + 0.6, rows * _PANEL[1] + 0.4), **place) as page:
        axes = page.panels(rows, columns)
        for each, (name, values) in zip(axes, panels.items(), strict=False):
            there = np.isfinite(values)
            x, y = p[there], np.degrees(alpha[there])
            shades: dict[str, Any] = {"cmap": "cividis_r", "vmin": low, "vmax": high}
            marks = each.scatter(x, y, c=values[there], s=area, marker="s", linewidth=0.0, **shades)
            if not there.all():
                x, y = p[~there], np.degrees(alpha[~there])
                each.scatter(x, y, s=area, marker="x", color=ABOVE, linewidth=0.7, label=missing_label)
            add_labels(each, "p (rad/s)", "slenderness (degrees)")
            if len(panels) > 1:
                each.set_title(as_written(name), color=INK)
        page.drawn = axes[: len(panels)]
        for spare in axes[len(panels) :]:
            spare.remove()
        page.figure.colorbar(marks, ax=page.drawn, label=value_label, shrink=0.9)
    return page.figure


#: Shades by kind, each of another luminance; those of orbits from the largest basin on, of which the last is repeated.
_SHADES: Final = {
    "orbit": ("#f4f7fb", "#c3d3e6", "#8fabcd", "#6488b3", "#e8d9a8", "#bda55d"),
    "overturns": ("#8c3410", "#3f1404"),
    "unsettled": ("#7a7f85",),
    "missing": ("#ffffff",),
}

#: Marks of the points of orbits, those of one orbit alike.
_MARKS: Final = ("o", "^", "s", "D", "v", "P")


def basins_figure(
    *,
    x: Floats,
    y: Floats,
    outcome: NDArray[np.integer],
    names: Sequence[str],
    kinds: Sequence[str],
    orbits: Floats,
    x_label: str,
    y_label: str,
    **place: Unpack[Place],
) -> Figure:
    """Draw which attractor each state of a grid goes to: numbers of shape (len(y), len(x)), -1 where unknown."""
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shades = [_SHADES["missing"][0]]
    for k, kind in enumerate(kinds):
        among = _SHADES[kind]
        shades.append(among[min(kinds[:k].count(kind), len(among) - 1)])
    colours, norm = ListedColormap(shades), BoundaryNorm(np.arange(len(shades) + 1) - 1.5, len(shades))
    with page_for((5.4, 4.6), **place) as page:
        (axes,) = page.panels()
        axes.pcolormesh(cell_edges(x), cell_edges(y), outcome, cmap=colours, norm=norm, rasterized=True)
        handles: list[Artist] = []
        if np.any(outcome < 0):
            handles.append(Patch(facecolor=shades[0], edgecolor=INK, linewidth=0.5, hatch="....", label="not reached"))
        marked = 0
        for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
            handles.append(Patch(facecolor=shades[k + 1], edgecolor=INK, linewidth=0.5, label=name))
            if kind != "orbit":
                continue
            look: dict[str, Any] = {
                "marker": _MARKS[marked % len(_MARKS)],
                "color": "white",
                "markeredgecolor": INK,
                "markersize": 4.5,
            }
            inside = (orbits[k] >= [x[0], y[0]]).all(axis=1) & (orbits[k] <= [x[-1], y[-1]]).all(axis=1)
            if inside.any():
                axes.plot(*orbits[k][inside].T, linestyle="", markeredgewidth=0.8, **look)
                handles.append(Line2D([], [], linestyle="", label=f"{name}: its points", **look))
            marked += 1
        add_labels(axes, x_label, y_label)
        page.handles = handles
    return page.figure
