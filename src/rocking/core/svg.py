"""Small pictures for notebooks, drawn as markup by hand: they appear at once, and in the colour of the page's text."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Final

import numpy as np

from rocking.core.arrays import Floats

#: Corners of a line at most.
MOST_POINTS: Final = 400

_WIDTH, _HEIGHT = 480.0, 130.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 56.0, 10.0, 18.0, 22.0


def picture(width: float, height: float, *parts: str) -> str:
    """Drawing of that size (pixels), of lines and texts in the colour of the text around it."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" '
        f'viewBox="0 0 {width:g} {height:g}" fill="none" stroke="currentColor" font-size="11" '
        f'font-family="sans-serif">{"".join(parts)}</svg>'
    )


def captioned(text: str, drawing: str) -> str:
    """Drawing with a text above it."""
    return f"<div><div>{escape(text)}</div>{drawing}</div>"


def line(points: Floats, width: float = 1.0, *, closed: bool = False) -> str:
    """Line through points, shape (n, 2)."""
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<{"polygon" if closed else "polyline"} points="{corners}" stroke-width="{width:g}"/>'


def words(x: float, y: float, text: str, anchor: str = "start") -> str:
    """Text whose start, middle or end is at a point."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="currentColor" stroke="none">{escape(text)}</text>'
    )


def history(time: Floats, values: Floats, label: str) -> str:
    """Quantity over time (s): a thinned line, its extremes and the span of time at the axes."""
    time, values = thinned(time, values)
    low, high = min(float(values.min()), 0.0), max(float(values.max()), 0.0)
    across = (_WIDTH - _LEFT - _RIGHT) / max(float(time[-1] - time[0]), 1e-300)
    down = (_HEIGHT - _TOP - _BOTTOM) / max(high - low, 1e-300)
    x, y = _LEFT + across * (time - time[0]), _TOP + down * (high - values)
    floor, zero = _HEIGHT - _BOTTOM, _TOP + down * high
    frame = line(np.array([[_LEFT, _TOP], [_LEFT, floor], [_WIDTH - _RIGHT, floor]]), 0.5)
    axis = line(np.array([[_LEFT, zero], [_WIDTH - _RIGHT, zero]]), 0.5)
    marks = [words(_LEFT - 4, _TOP + down * (high - level) + 4, f"{level:.3g}", "end") for level in {low, high}]
    ends = [
        words(_LEFT, _HEIGHT - 7, f"{time[0]:.4g}"),
        words(_WIDTH - _RIGHT, _HEIGHT - 7, f"{time[-1]:.4g} s", "end"),
        words(_LEFT, _TOP - 6, label),
    ]
    return picture(_WIDTH, _HEIGHT, frame, axis, line(np.column_stack([x, y])), *marks, *ends)


def thinned(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """At most `MOST_POINTS` points of a line: its ends, and the least and greatest of each of so many spans of time."""
    if len(time) <= MOST_POINTS:
        return time, values
    spans = np.linspace(time[0], time[-1], MOST_POINTS // 2)[1:-1]
    kept = {0, len(time) - 1}
    for part in np.split(np.arange(len(time)), np.searchsorted(time, spans)):
        if len(part):
            kept |= {int(part[np.argmin(values[part])]), int(part[np.argmax(values[part])])}
    chosen = sorted(kept)
    return time[chosen], values[chosen]


def outline(corners: Sequence[tuple[float, float]], size: float, label: str) -> str:
    """Body on the ground, to scale: its corners (m, upwards), the longer side `size` pixels."""
    points = np.array(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    scale = size / float(np.max(high - low))
    width, height = scale * (high - low)
    margin, ground = 12.0, 12.0 + height
    placed = np.column_stack([margin + scale * (points[:, 0] - low[0]), ground - scale * (points[:, 1] - low[1])])
    across = max(width + 2.0 * margin, 7.0 * len(label))
    floor = line(np.array([[0.0, ground], [width + 2.0 * margin, ground]]), 2.0)
    return picture(across, ground + 20.0, line(placed, 1.5, closed=True), floor, words(2.0, ground + 15.0, label))
