"""Sketches: a rocking block with its sizes, angles and pivots, and flowcharts of steps and decisions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.plot.canvas import ACCENT, GREY, INK, PALE, open_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Radii of the arcs of both angles, over R and over the height, and how far dimensions lie outside the block, over R.
_ALPHA_RADIUS: Final = 0.55
_THETA_RADIUS: Final = 0.79
_OFFSET: Final = 0.13

_DEPTH: Final = 0.09

#: Lines and texts of flowcharts.
_LINE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.8, "solid_joinstyle": "miter"}
_TEXT: Final[dict[str, Any]] = {"ha": "center", "va": "center", "fontsize": 7.0, "linespacing": 1.15}


def block_figure(*, upright: Floats, rocking: Floats, title: str) -> Figure:
    """Draw a block upright and rocking about its right corner, with its sizes, angles and the ground acceleration.

    Both are places, shape (5, 2), over the half diagonal R: pivot O (right), the corner above it, the other upper
    corner, pivot O' (left), and the centre of mass.
    """
    from matplotlib.patches import Polygon

    with open_figure(None, (3.4, 4.2), title=title) as figure:
        axes = figure.add_subplot()
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.add_patch(Polygon(rocking[:4], facecolor=PALE, edgecolor=INK, linewidth=1.3))
        axes.add_patch(Polygon(upright[:4], fill=False, edgecolor=GREY, linewidth=0.9, linestyle=(0, (4, 2))))
        _draw_ground(axes, rocking, upright)
        _draw_sizes(axes, rocking)
        _draw_angles(axes, upright, rocking)
        centre = rocking[4]
        axes.plot(*centre, "o", color=INK, markersize=4.0)
        axes.annotate("C.M.", centre, xytext=(0, 5), textcoords="offset points", ha="center")
    return figure


def _draw_ground(axes: Axes, rocking: Floats, upright: Floats) -> None:
    """Draw the ground with its acceleration, and the pivots on it."""
    from matplotlib.patches import Rectangle

    left = min(rocking[:4, 0].min(), upright[3, 0]) - 0.35
    right = max(rocking[:4, 0].max(), upright[0, 0]) + 0.35
    soil = Rectangle(
        (left, -_DEPTH), right - left, _DEPTH, facecolor="none", edgecolor=GREY, linewidth=0.0, hatch="////"
    )
    axes.add_patch(soil)
    axes.plot([left, right], [0.0, 0.0], color=INK, linewidth=1.3)
    for place, name in ((upright[0], "$O$"), (upright[3], "$O'$")):
        axes.plot(*place, "o", color=INK, markersize=4.0, markerfacecolor="white", zorder=4)
        axes.annotate(name, place - [0.0, 1.3 * _DEPTH], ha="center", va="top")
    middle, height = 0.5 * (upright[0, 0] + upright[3, 0]), -4.0 * _DEPTH
    _draw_arrow(axes, np.array([middle - 0.25, height]), np.array([middle + 0.25, height]), "->", ACCENT)
    axes.annotate(r"$\ddot u_g$", (middle + 0.25, height), xytext=(4, 0), textcoords="offset points", va="center")
    axes.set_xlim(left, right)
    axes.set_ylim(height - 0.1, max(rocking[:4, 1].max(), upright[:4, 1].max()) + 0.3)


def _draw_sizes(axes: Axes, corners: Floats) -> None:
    """Draw width and height outside the block, and the half diagonal in it."""
    pivot, top, other, foot, centre = corners
    across, along = pivot - foot, top - pivot
    outward, upward = -across / np.hypot(*across), along / np.hypot(*along)
    for start, end, away, name in ((other, top, upward, "$2b$"), (pivot, top, -outward, "$2h$")):
        ends = start + _OFFSET * away, end + _OFFSET * away
        for corner, tip in zip((start, end), ends, strict=True):
            axes.plot(
                *zip(corner + 0.3 * (tip - corner), tip + 0.2 * (tip - corner), strict=True), color=INK, linewidth=0.4
            )
        _draw_arrow(axes, *ends, "<->", INK)
        axes.annotate(name, 0.5 * (ends[0] + ends[1]) + 0.09 * away, ha="center", va="center")
    _draw_arrow(axes, pivot, centre, "->", INK)
    axes.annotate("$R$", pivot + 0.72 * (centre - pivot) + 0.07 * outward, ha="center", va="center")


def _draw_angles(axes: Axes, upright: Floats, rocking: Floats) -> None:
    """Draw the slenderness, between the block's edge and R, and the rotation, between the edge upright and rocking."""
    pivot = rocking[0]
    edge, before, diagonal = (math.atan2(*(end - pivot)[::-1]) for end in (rocking[1], upright[1], rocking[4]))
    height = float(np.hypot(*(upright[1] - pivot)))
    arcs = ((_ALPHA_RADIUS, diagonal, r"$\alpha$"), (_THETA_RADIUS * height, before, r"$\theta$"))
    start = edge
    for radius, end, name in arcs:
        angles = np.linspace(start, end, 60)
        axes.plot(
            *(pivot[:, np.newaxis] + radius * np.array([np.cos(angles), np.sin(angles)])), color=INK, linewidth=0.8
        )
        middle = 0.5 * (start + end)
        at = pivot + (radius + 0.09) * np.array([math.cos(middle), math.sin(middle)])
        axes.annotate(name, at, ha="center", va="center")


def _draw_arrow(axes: Axes, start: Any, end: Any, style: str, color: str, **look: float) -> None:
    arrow: dict[str, Any] = {"arrowstyle": style, "color": color, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tuple(end), tuple(start), arrowprops=arrow | look)


class Box(NamedTuple):
    """A step, a decision or an end: its text, and its centre and size in inches."""

    text: str
    kind: Literal["step", "decision", "end"]
    at: tuple[float, float]
    size: tuple[float, float]


class Way(NamedTuple):
    """A way from one box to another by their names; of a decision, the answer that leads along it.

    It goes straight where both boxes lie above or beside each other, else round one corner; or, where ``via`` is given,
    sideways to that distance from the middle, up or down, and back.
    """

    start: str
    end: str
    answer: str = ""
    via: float | None = None


class Flowchart(NamedTuple):
    """Boxes by name, and ways between them."""

    title: str
    boxes: Mapping[str, Box]
    ways: Sequence[Way]


def flowchart_figure(charts: Sequence[Flowchart]) -> Figure:
    """Draw flowcharts of about the same size side by side."""
    boxes = [box for chart in charts for box in chart.boxes.values()]
    left, right = (max(side * box.at[0] + 0.5 * box.size[0] for box in boxes) for side in (-1.0, 1.0))
    vias = [way.via for chart in charts for way in chart.ways if way.via is not None]
    left, right = max(left, *(-via for via in vias)) + 0.06, max(right, *vias) + 0.06
    low = min(box.at[1] - 0.5 * box.size[1] for box in boxes) - 0.05
    high = max(box.at[1] + 0.5 * box.size[1] for box in boxes) + 0.28
    with open_figure(None, (len(charts) * (left + right), high - low)) as figure:
        figure.set_layout_engine("none")
        for k, chart in enumerate(charts):
            axes = figure.add_axes((k / len(charts), 0.0, 1.0 / len(charts), 1.0))
            axes.set_axis_off()
            axes.set_xlim(-left, right)
            axes.set_ylim(low, high)
            axes.text(-left + 0.06, high - 0.04, chart.title, va="top", fontsize=8.5)
            for way in chart.ways:
                _draw_way(axes, way, chart.boxes)
            for box in chart.boxes.values():
                _draw_box(axes, box)
    return figure


def _draw_box(axes: Axes, box: Box) -> None:
    from matplotlib.patches import FancyBboxPatch, Polygon

    (x, y), (width, height) = box.at, box.size
    style: dict[str, Any] = {"facecolor": "white" if box.kind == "step" else PALE, "edgecolor": INK, "linewidth": 0.9}
    if box.kind == "decision":
        slope = 0.14
        corners = [
            (x - 0.5 * width, y),
            (x - 0.5 * width + slope, y + 0.5 * height),
            (x + 0.5 * width - slope, y + 0.5 * height),
            (x + 0.5 * width, y),
            (x + 0.5 * width - slope, y - 0.5 * height),
            (x - 0.5 * width + slope, y - 0.5 * height),
        ]
        axes.add_patch(Polygon(corners, **style))
    else:
        rounding = 0.02 if box.kind == "step" else 0.12
        shape = f"round,pad=0,rounding_size={rounding}"
        axes.add_patch(FancyBboxPatch((x - 0.5 * width, y - 0.5 * height), width, height, boxstyle=shape, **style))
    axes.text(x, y, box.text, **_TEXT)


def _draw_way(axes: Axes, way: Way, boxes: Mapping[str, Box]) -> None:
    points = _route(boxes[way.start], boxes[way.end], way.via)
    axes.plot(*zip(*points, strict=True), **_LINE)
    _draw_arrow(axes, points[-2], points[-1], "-|>", INK, linewidth=0.8, mutation_scale=7)
    if way.answer:
        (x, y), (x_next, _) = points[:2]
        if x == x_next:
            axes.annotate(way.answer, (x, y), xytext=(3, -2), textcoords="offset points", va="top", fontsize=7.0)
        else:
            side = 1 if x_next > x else -1
            axes.annotate(
                way.answer, (x, y), xytext=(3 * side, 2), textcoords="offset points",
                ha="left" if side > 0 else "right", va="bottom", fontsize=7.0,
            )  # fmt: skip


def _route(start: Box, end: Box, via: float | None) -> list[tuple[float, float]]:
    """Corners of a way, from the edge of one box to the edge of the other."""
    (x, y), (x_end, y_end) = start.at, end.at
    if via is not None:
        return [_edge(start, via, y), (via, y), (via, y_end), _edge(end, via, y_end)]
    if x == x_end or y == y_end:
        return [_edge(start, x_end, y_end), _edge(end, x, y)]
    return [_edge(start, x_end, y), (x_end, y), _edge(end, x_end, y)]


def _edge(box: Box, x: float, y: float) -> tuple[float, float]:
    """Middle of the side of a box that faces a place beside it, or above or below it."""
    (at_x, at_y), (width, height) = box.at, box.size
    if abs(x - at_x) > 1e-9 and abs(y - at_y) < 1e-9:
        return at_x + (0.5 if x > at_x else -0.5) * width, at_y
    return at_x, at_y + (0.5 if y > at_y else -0.5) * height
