"""Maps over two parameters (outcomes, regions, basins, numbers for blocks) and roses over all directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Floats
from rocking.core.tables import escape_dollars
from rocking.errors import OptionError
from rocking.plot.canvas import (
    ACCENT,
    GREY,
    INK,
    PALE,
    FigureOptions,
    add_labels,
    add_text,
    compute_cell_edges,
    open_page,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

#: From harmless to worst, each darker than the previous one; the last stands out.
_OUTCOME_COLOURS: Final = ("#ffffff", "#d7e3f2", "#9db6d4", "#5d7da6", "#1c2c47", "#e0a23c")

#: Colour of the hatch over points that overturn later.
_LATER_COLOUR: Final = "#b0390c"

#: Colours and hatches of regions in which the block stays, and in which it overturns after 0, 1, ... impacts, from
#: darkest to lightest; hatches distinguish them in greyscale. The second of the regions in which it stays is the
#: darkest, because it is often a strip that must remain visible between the others.
_STAY_STYLES: Final = (("#ffffff", ""), ("#5d7da6", ""), ("#dde7f0", ""))
_AFTER_REST_STYLE: Final = ("#b0390c", "ooo")
_UNFINISHED_STYLE: Final = ("#b5b5b5", "++")
_OVERTURN_COLOURS: Final = ("#7d2706", "#d9692a", "#eda565", "#f8cf9f", "#fbe7cd")
_OVERTURN_HATCHES: Final = ("", "////", "\\\\\\\\", "xxxx", "....")

#: Fraction of the frame below which a region is invisible, and of its height below which lines hide it.
_MIN_VISIBLE_AREA: Final = 1e-3
_MIN_STRIP_HEIGHT: Final = 1e-2

#: Fraction of the frame's height beyond which boundaries of two columns are not connected.
_MAX_CONNECTED_DISTANCE: Final = 0.25

#: Ends of a frame around one value, relative to the value.
_SINGLE_VALUE_FRAME: Final = np.array([0.9, 1.1])


def draw_outcome_map(
    *,
    x: Floats,
    y: Floats,
    outcome: NDArray[np.integer],
    meanings: Sequence[str],
    is_later: NDArray[np.bool_],
    x_label: str,
    y_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw which of up to six outcomes each point of a grid has: integers of shape (len(y), len(x))."""
    from matplotlib import rc_context
    from matplotlib.colors import ListedColormap

    with open_page((5.4, 4.2), **options) as page:
        (axes,) = page.create_panels()
        _colour_cells(axes, x, y, outcome, _OUTCOME_COLOURS[: len(meanings)])
        page.handles = [_create_patch((_OUTCOME_COLOURS[k], ""), meanings[k]) for k in np.unique(outcome)]
        if is_later.any():
            cells = np.ma.masked_where(~is_later, outcome)
            # Two overlaid hatches are visible on the lightest and the darkest colours.
            for ink, width in (("#ffffff", 2.0), (_LATER_COLOUR, 0.9)):
                style: dict[str, Any] = {"cmap": ListedColormap(["none"]), "edgecolor": ink, "linewidth": 0.0}
                with rc_context({"hatch.linewidth": width}):
                    axes.pcolor(compute_cell_edges(x), compute_cell_edges(y), cells, hatch="////", **style)
            page.handles.append(_create_patch(("#ffffff", "////"), "overturns later"))
        add_labels(axes, x_label, y_label)
    return page.figure


def _colour_cells(axes: Axes, x: Floats, y: Floats, numbers: NDArray[np.integer], colours: Sequence[str]) -> None:
    """Fill the cells around grid points by number."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    norm = BoundaryNorm(np.arange(len(colours) + 1) - 0.5, len(colours))
    style: dict[str, Any] = {"cmap": ListedColormap([*colours]), "norm": norm, "rasterized": True}
    axes.pcolormesh(compute_cell_edges(x), compute_cell_edges(y), numbers, **style)


def draw_regions(
    *,
    x: Floats,
    y_range: tuple[float, float],
    edges: Sequence[Floats],
    regions: Sequence[Sequence[int]],
    names: Mapping[int, str],
    x_label: str,
    y_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw regions between boundaries at increasing abscissae x, shape (n,).

    At each abscissa, `edges` contains the increasing ordinates of the boundaries, and `regions` the regions below,
    between and above them: the number of impacts before overturning, or -5 to -1 for other outcomes (see
    `_choose_style`). Boundaries between the same regions are connected by straight lines. A region without counterpart
    in the next column ends half way to it. The legend names the visible regions.
    """
    low, high = y_range
    # A single column or level fills the frame.
    if x.size == 1:
        x, edges, regions = x * _SINGLE_VALUE_FRAME, [*edges] * 2, [*regions] * 2
    if low == high:
        low, high = low * _SINGLE_VALUE_FRAME
    area: dict[int, float] = {}
    farthest = _MAX_CONNECTED_DISTANCE * (high - low)
    starts = [k for k in range(len(x)) if k == 0 or tuple(regions[k]) != tuple(regions[k - 1])]
    with open_page((5.6, 4.6), **options) as page:
        (axes,) = page.create_panels()
        for start, end in pairwise([*starts, len(x)]):
            abscissae, rows = [*x[start:end]], [*edges[start:end]]
            if start > 0:
                abscissae.insert(0, np.mean(x[start - 1 : start + 1]))
                rows.insert(0, _interpolate(start, start - 1, edges, regions, farthest))
            if end < len(x):
                abscissae.append(np.mean(x[end - 1 : end + 1]))
                rows.append(_interpolate(end - 1, end, edges, regions, farthest))
            levels = np.array([[low, *row, high] for row in rows]).T
            is_visible = np.diff(levels, axis=0).max(axis=1) > _MIN_STRIP_HEIGHT * (high - low)
            for k, region in enumerate(regions[start]):
                colour, hatch = _choose_style(region)
                style: dict[str, Any] = {"facecolor": colour, "hatch": hatch, "edgecolor": INK, "antialiased": False}
                axes.fill_between(abscissae, levels[k], levels[k + 1], linewidth=0.0, **style)
                area[region] = area.get(region, 0.0) + float(np.trapezoid(levels[k + 1] - levels[k], abscissae))
                if k > 0 and is_visible[k - 1] and is_visible[k]:  # lines would hide a strip
                    axes.plot(abscissae, levels[k], color=INK, linewidth=0.5, solid_capstyle="round")
        axes.set(xlim=(x[0], x[-1]), ylim=(low, high))
        add_labels(axes, x_label, y_label)
        regions_by_style: dict[tuple[str, str], list[int]] = {}
        for region in sorted(area):
            if area[region] > _MIN_VISIBLE_AREA * (x[-1] - x[0]) * (high - low):
                regions_by_style.setdefault(_choose_style(region), []).append(region)
        page.handles = [
            _create_patch(style, names[group[0]] if len(group) == 1 else f"overturns after {group[0]} or more")
            for style, group in regions_by_style.items()
        ]
    return page.figure


def _interpolate(
    k: int, neighbour: int, edges: Sequence[Floats], regions: Sequence[Sequence[int]], max_distance: float
) -> Floats:
    """Interpolate a column's boundaries half way to its neighbour: to the nearest alike, closed, or unchanged."""
    ordinates, neighbour_ordinates = np.array(edges[k], dtype=float), np.array(edges[neighbour], dtype=float)
    others = [*pairwise(regions[neighbour])]
    distance = np.abs(ordinates[:, None] - neighbour_ordinates)
    is_alike = np.array([[pair == other for other in others] for pair in pairwise(regions[k])], dtype=bool)
    is_alike = is_alike.reshape(distance.shape) & (distance < max_distance)
    distance[~is_alike] = np.inf
    nearest = [distance.min(axis=axis, initial=np.inf, keepdims=True) for axis in (0, 1)]
    index, neighbour_index = np.nonzero(is_alike & (distance == nearest[0]) & (distance == nearest[1]))
    ordinates[index] = 0.5 * (ordinates[index] + neighbour_ordinates[neighbour_index])
    unmatched = np.setdiff1d(np.arange(ordinates.size), index)
    for i in unmatched[np.isin(unmatched + 1, unmatched)]:
        if regions[k][i] == regions[k][i + 2]:
            ordinates[i : i + 2] = np.mean(ordinates[i : i + 2])
    return np.maximum.accumulate(ordinates)


def _choose_style(region: int) -> tuple[str, str]:
    """Choose colour and hatch of a region: -5 unfinished, -4 overturns after a rest, -3 to -1 stays, else impacts."""
    if region < 0:
        return (_UNFINISHED_STYLE, _AFTER_REST_STYLE, *_STAY_STYLES)[region + 5]
    k = min(region, len(_OVERTURN_COLOURS) - 1)
    return _OVERTURN_COLOURS[k], _OVERTURN_HATCHES[k]


def _create_patch(style: tuple[str, str], label: str) -> Patch:
    from matplotlib.patches import Patch

    return Patch(facecolor=style[0], hatch=style[1], edgecolor=INK, linewidth=0.5, label=label)


#: Width and height of one panel, inches, and the number of panels in a row.
_PANEL_SIZE: Final = (3.5, 2.9)
_PANELS_PER_ROW: Final = 2


#: Maximum number of blocks with names.
_MAX_NAMED_BLOCKS: Final = 20


def draw_blocks(
    p: Floats,
    alpha: Floats,
    *,
    panels: Mapping[str, Floats],
    value_label: str,
    missing_label: str,
    block_names: Sequence[str] = (),
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw a number for each block as the colour of a marker, in one or several panels with one colour scale.

    Up to 20 blocks are named.
    """
    if options.get("ax") is not None and len(panels) > 1:
        raise OptionError(f"{len(panels)} panels require a separate figure; omit ax, or select one panel")
    names, columns = [*panels], min(len(panels), _PANELS_PER_ROW)
    rows = [[*names[k : k + columns], *"." * (columns - len(names[k:]))] for k in range(0, len(names), columns)]
    all_values = np.concatenate([*panels.values()])
    finite_values = all_values[np.isfinite(all_values)] if np.isfinite(all_values).any() else np.array([0.0, 1.0])
    shades: dict[str, Any] = {"cmap": "cividis_r", "vmin": finite_values.min(), "vmax": finite_values.max()}
    size: dict[str, Any] = {"s": float(np.clip(9000.0 / len(p), 6.0, 60.0))}
    with open_page((columns * _PANEL_SIZE[0] + 0.6, len(rows) * _PANEL_SIZE[1] + 0.4), **options) as page:
        for axes, (name, values) in zip(page.create_panels(rows), panels.items(), strict=True):
            is_finite, degrees = np.isfinite(values), np.degrees(alpha)
            style: dict[str, Any] = {"c": values[is_finite], "marker": "s", "linewidth": 0.0, **size, **shades}
            markers = axes.scatter(p[is_finite], degrees[is_finite], **style)
            if not is_finite.all():
                style = {"color": ACCENT, "marker": "x", "linewidth": 0.7, "label": missing_label, **size}
                axes.scatter(p[~is_finite], degrees[~is_finite], **style)
            for k, text in enumerate(block_names if len(block_names) <= _MAX_NAMED_BLOCKS else ()):
                add_text(axes, escape_dollars(text), (p[k], degrees[k]), (5.0, 3.0), fontsize="small", color=INK)
            add_labels(axes, "p (rad/s)", "slenderness (degrees)")
            if len(panels) > 1:
                axes.set_title(escape_dollars(name), color=INK)
        page.figure.colorbar(markers, ax=page.panel_axes, label=value_label, shrink=0.9)
    return page.figure


#: Shades by kind, with different luminances; orbits are ordered by basin size, and the last shade is repeated.
_SHADES: Final = {
    "orbit": ("#f4f7fb", "#c3d3e6", "#8fabcd", "#6488b3", "#e8d9a8", "#bda55d"),
    "overturns": ("#8c3410", "#3f1404"),
    "unsettled": ("#7a7f85",),
}

#: Markers of orbit points, one for each orbit.
_MARKERS: Final = ("o", "^", "s", "D", "v", "P")


def draw_basins(
    *,
    x: Floats,
    y: Floats,
    outcome: NDArray[np.integer],
    names: Sequence[str],
    kinds: Sequence[str],
    orbits: Floats,
    x_label: str,
    y_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw the attractor of each state of a grid: integers of shape (len(y), len(x))."""
    ranks = [kinds[:k].count(kind) for k, kind in enumerate(kinds)]
    shades = [_SHADES[kind][min(k, len(_SHADES[kind]) - 1)] for k, kind in zip(ranks, kinds, strict=True)]
    with open_page((5.4, 4.6), **options) as page:
        (axes,) = page.create_panels()
        _colour_cells(axes, x, y, outcome, shades)
        handles: list[Artist] = []
        for name, kind, shade, k, points in zip(names, kinds, shades, ranks, orbits, strict=True):
            handles.append(_create_patch((shade, ""), name))
            visible_points = points[(points >= [x[0], y[0]]).all(axis=1) & (points <= [x[-1], y[-1]]).all(axis=1)]
            if kind == "orbit" and len(visible_points):
                style: dict[str, Any] = {"linestyle": "", "marker": _MARKERS[k % len(_MARKERS)], "markersize": 4.5}
                style |= {"color": "white", "markeredgecolor": INK, "markeredgewidth": 0.8}
                handles += axes.plot(*visible_points.T, label=f"{name}: its points", **style)
        add_labels(axes, x_label, y_label)
        page.handles = handles
    return page.figure


def draw_rose(
    *,
    azimuth: Floats,
    acceleration: Floats,
    slenderness: Floats,
    p: Floats,
    support: Floats,
    weakest: tuple[float, float],
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw the uplift acceleration, g, of a body in each direction around its support, and its slenderness and p."""
    from matplotlib.patches import Polygon

    with open_page((6.8, 4.0), **options) as page:
        main, *side_panels = page.create_panels("AB;AC", width_ratios=(1.6, 1.0))
        for axes, values, label in zip(side_panels, (slenderness, p), ("slenderness (deg)", "p (rad/s)"), strict=False):
            axes.plot(*_close_circle(azimuth, values), color=INK, linewidth=1.2)
            axes.set(xlim=(0.0, 360.0), xticks=(0.0, 180.0, 360.0))
            axes.grid(True)
            add_labels(axes, "azimuth (deg)" if axes is side_panels[-1] else "", label)
        _set_plan_view(main, float(max(acceleration.max(), np.abs(support).max())))
        label = "support over height of centre of mass"
        main.add_patch(Polygon(support, facecolor=PALE, edgecolor=GREY, linewidth=1.0, label=label))
        label = "ground acceleration that lifts it"
        main.plot(*_convert_to_points(azimuth, acceleration), color=INK, linewidth=1.4, label=label)
        label = f"least: {weakest[1]:.3g} g at {weakest[0]:.3g} deg"
        end = _convert_to_points(np.array([weakest[0]]), np.array([weakest[1]]))[:, :1]
        main.plot(*np.insert(end, 0, 0.0, axis=1), color=ACCENT, linewidth=1.6, linestyle=(0, (4, 1.5)), label=label)
        add_labels(main, "towards west and east (g)", "towards south and north (g)")
    return page.figure


def _close_circle(azimuth: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Repeat the first value over the azimuth after a full turn."""
    return np.append(azimuth, azimuth[0] + 360.0), np.append(values, values[0])


def _convert_to_points(azimuth: Floats, values: Floats) -> Floats:
    """Convert azimuths and distances to the points of a closed line, shape (2, n)."""
    closed_azimuth, distances = _close_circle(azimuth, values)
    angle = np.deg2rad(closed_azimuth)
    return np.asarray(distances * np.array([np.sin(angle), np.cos(angle)]))


def _set_plan_view(axes: Axes, limit: float) -> None:
    """Set equal limits, and label both axes with the distance from the centre."""
    axes.set(aspect="equal", xlim=(-1.1 * limit, 1.1 * limit), ylim=(-1.1 * limit, 1.1 * limit))
    axes.locator_params(nbins=5)
    axes.grid(True)
    axes.plot(0.0, 0.0, "+", color=INK)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda value, _: f"{abs(value):g}")
