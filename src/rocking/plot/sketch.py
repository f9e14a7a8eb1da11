"""A sketch of a rocking block: its sizes, angles and pivots."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import add_title, figure_for
from rocking.plot.style import ABOVE, GROUND, INK, REST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Radii of the arcs of both angles, over R and over the height, and how far dimensions lie outside the block, over R.
_ALPHA_RADIUS: Final = 0.55
_THETA_RADIUS: Final = 0.79
_OFFSET: Final = 0.13

_DEPTH: Final = 0.09


def block_figure(*, upright: Floats, rocking: Floats, title: str, ax: Axes | None = None) -> Figure:
    """Draw a block upright and rocking about its right corner, with its sizes, angles and the ground acceleration.

    Parameters
    ----------
    upright, rocking : ndarray, shape (5, 2)
        Places, over the half diagonal R, of pivot O (right), of the corner above it, of the other upper corner, of
        pivot O' (left), and of the centre of mass.
    title : str
        Title of the figure.
    ax : matplotlib.axes.Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.patches import Polygon

    with figure_for(ax, (3.4, 4.2)) as figure:
        axes = ax or figure.add_subplot()
        axes.set_aspect("equal")
        axes.set_axis_off()
        add_title(figure, ax, title)
        axes.add_patch(Polygon(rocking[:4], facecolor=REST, edgecolor=INK, linewidth=1.3))
        axes.add_patch(Polygon(upright[:4], fill=False, edgecolor=GROUND, linewidth=0.9, linestyle=(0, (4, 2))))
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
        (left, -_DEPTH), right - left, _DEPTH, facecolor="none", edgecolor=GROUND, linewidth=0.0, hatch="////"
    )
    axes.add_patch(soil)
    axes.plot([left, right], [0.0, 0.0], color=INK, linewidth=1.3)
    for place, name in ((upright[0], "$O$"), (upright[3], "$O'$")):
        axes.plot(*place, "o", color=INK, markersize=4.0, markerfacecolor="white", zorder=4)
        axes.annotate(name, place - [0.0, 1.3 * _DEPTH], ha="center", va="top")
    middle, height = 0.5 * (upright[0, 0] + upright[3, 0]), -4.0 * _DEPTH
    _draw_arrow(axes, np.array([middle - 0.25, height]), np.array([middle + 0.25, height]), "->", ABOVE)
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
    edge, before, diagonal = (_direction(end - pivot) for end in (rocking[1], upright[1], rocking[4]))
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


def _direction(vector: Floats) -> float:
    return math.atan2(vector[1], vector[0])


def _draw_arrow(axes: Axes, start: Floats, end: Floats, style: str, color: str) -> None:
    arrow: dict[str, Any] = {"arrowstyle": style, "color": color, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tuple(end), tuple(start), arrowprops=arrow)
