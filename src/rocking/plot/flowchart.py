"""Flowcharts: steps and decisions with the ways between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from rocking.plot.canvas import figure_for
from rocking.plot.style import INK, REST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LINE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.8, "solid_joinstyle": "miter"}
_TEXT: Final[dict[str, Any]] = {"ha": "center", "va": "center", "fontsize": 7.0, "linespacing": 1.15}


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
    """Draw flowcharts side by side.

    Parameters
    ----------
    charts : sequence of Flowchart
        All of about the same size.

    Returns
    -------
    matplotlib.figure.Figure
    """
    boxes = [box for chart in charts for box in chart.boxes.values()]
    left, right = (max(side * box.at[0] + 0.5 * box.size[0] for box in boxes) for side in (-1.0, 1.0))
    vias = [way.via for chart in charts for way in chart.ways if way.via is not None]
    left, right = max(left, *(-via for via in vias)) + 0.06, max(right, *vias) + 0.06
    low = min(box.at[1] - 0.5 * box.size[1] for box in boxes) - 0.05
    high = max(box.at[1] + 0.5 * box.size[1] for box in boxes) + 0.28
    with figure_for(None, (len(charts) * (left + right), high - low)) as figure:
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
    style: dict[str, Any] = {"facecolor": "white" if box.kind == "step" else REST, "edgecolor": INK, "linewidth": 0.9}
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
    arrow: dict[str, Any] = {
        "arrowstyle": "-|>",
        "color": INK,
        "linewidth": 0.8,
        "shrinkA": 0.0,
        "shrinkB": 0.0,
        "mutation_scale": 7,
    }
    axes.annotate("", points[-1], points[-2], arrowprops=arrow)
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
