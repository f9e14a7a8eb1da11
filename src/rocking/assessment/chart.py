"""Small charts as SVG text, for pages with many of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from rocking.core.arrays import Floats

#: Size of a chart, and its margins (left, top, right, bottom), px.
_WIDTH, _HEIGHT = 680.0, 190.0
_LEFT, _TOP, _RIGHT, _BOTTOM = 55.0, 8.0, 12.0, 38.0


class Chart:
    """Chart with two linear axes.

    Parameters
    ----------
    x, y : (float, float)
        Ranges of the axes.
    x_label, y_label : str
        Names of the axes.
    """

    def __init__(self, x: tuple[float, float], y: tuple[float, float], x_label: str, y_label: str) -> None:
        self.x, self.y, self.parts = x, y, list[str]()
        for tick in list_ticks(*x):
            position = float(self._place_x(np.array(tick)))
            self.parts.append(_render_line("grid", position, _TOP, position, _HEIGHT - _BOTTOM))
            self.parts.append(_render_text(position, _HEIGHT - _BOTTOM + 15.0, f"{tick:g}"))
        for tick in list_ticks(*y, 4):
            position = float(self._place_y(np.array(tick)))
            self.parts.append(_render_line("grid", _LEFT, position, _WIDTH - _RIGHT, position))
            self.parts.append(_render_text(_LEFT - 6.0, position + 4.0, f"{tick:g}", "end"))
        middle = 0.5 * (_TOP + _HEIGHT - _BOTTOM)
        self.parts.append(_render_text(0.5 * (_LEFT + _WIDTH), _HEIGHT - 5.0, x_label))
        self.parts.append(f'<g transform="rotate(-90 12 {middle:.0f})">{_render_text(12.0, middle, y_label)}</g>')

    def _place_x(self, values: Floats) -> Floats:
        return _LEFT + (values - self.x[0]) / (self.x[1] - self.x[0]) * (_WIDTH - _LEFT - _RIGHT)

    def _place_y(self, values: Floats) -> Floats:
        return _HEIGHT - _BOTTOM - (values - self.y[0]) / (self.y[1] - self.y[0]) * (_HEIGHT - _TOP - _BOTTOM)

    def _format_points(self, x: Floats, y: Floats) -> str:
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(self._place_x(x), self._place_y(y), strict=True))

    def add_line(self, x: Floats, y: Floats, kind: str) -> None:
        """Add a line of a kind of `report.css`."""
        self.parts.append(f'<polyline class="{kind}" points="{self._format_points(x, y)}"/>')

    def add_band(self, x: Floats, low: Floats, high: Floats) -> None:
        """Add a filled band."""
        points = self._format_points(np.append(x, x[::-1]), np.append(low, high[::-1]))
        self.parts.append(f'<polygon class="band" points="{points}"/>')

    def add_points(self, x: Floats, y: Floats) -> None:
        """Add dots."""
        for a, b in zip(self._place_x(x), self._place_y(y), strict=True):
            self.parts.append(f'<circle class="point" cx="{a:.1f}" cy="{b:.1f}" r="2.5"/>')

    def write(self) -> str:
        """Return the chart as SVG."""
        frame = f'<path class="axis" d="M{_LEFT},{_TOP}V{_HEIGHT - _BOTTOM}H{_WIDTH - _RIGHT}"/>'
        return _render_svg(_WIDTH, _HEIGHT, [*self.parts, frame])


def render_bar(interval: tuple[float, float], mark: float, max_value: float, *, has_end: bool) -> str:
    """Return a bar between two numbers, with an arrow without an upper end, and a triangle at a mark."""
    width, height = 150.0, 8.0
    low, high, mark_x = (width * min(value / max_value, 1.0) for value in (*interval, mark))
    parts = [_render_line("grid", 0.0, 4.0, width, 4.0)]
    arrow = f'<path class="point" d="M{low - 6:.1f},1l6,3l-6,3z"/>'
    parts.append(_render_line("bar", low, 4.0, max(high, low + 1.5), 4.0) if has_end else arrow)
    parts.append(f'<path class="now" d="M{mark_x:.1f},4l-3,4h6z"/>')
    return _render_svg(width, height, parts)


def render_intervals(rows: Sequence[tuple[str, float, float, float]], ends: tuple[float, float], label: str) -> str:
    """Return named intervals (low, middle, high) on one logarithmic axis."""
    left, step = 200.0, 17.0
    height = step * len(rows) + 40.0
    low, high = math.log(ends[0] / 1.15), math.log(ends[1] * 1.15)

    def place_x(value: float) -> float:
        share = (math.log(value) - low) / (high - low) if 0.0 < value < math.inf else float(value > 0.0)
        return left + share * (_WIDTH - left - _RIGHT)

    parts = [_render_text(0.5 * (left + _WIDTH), height - 6.0, label)]
    for tick in list_log_ticks(math.exp(low), math.exp(high)):
        parts.append(_render_line("grid", place_x(tick), 0.0, place_x(tick), height - 38.0))
        parts.append(_render_text(place_x(tick), height - 24.0, f"{tick:g}"))
    for k, (name, start, middle, end) in enumerate(rows):
        y = step * (k + 0.5)
        parts.append(_render_text(left - 8.0, y + 4.0, name if len(name) <= 32 else f"{name[:31]}…", "end"))
        parts.append(_render_line("bar", place_x(start), y, place_x(end), y))
        if math.isinf(end):
            parts.append(f'<path class="point" d="M{place_x(end):.1f},{y - 5:.1f}l8,5l-8,5z"/>')
        if not math.isnan(middle):
            parts.append(f'<circle class="point" cx="{place_x(middle):.1f}" cy="{y:.1f}" r="4"/>')
    return _render_svg(_WIDTH, height, parts)


def _render_line(kind: str, x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<line class="{kind}" x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'


def _render_text(x: float, y: float, text: str, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'


def _render_svg(width: float, height: float, parts: Sequence[str]) -> str:
    size = f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" role="img" {size}>{"".join(parts)}</svg>'


def list_ticks(low: float, high: float, max_count: int = 7) -> list[float]:
    """Return round numbers in a range, at most about ``max_count``."""
    rough_step = (high - low) / max_count
    power = 10.0 ** math.floor(math.log10(rough_step))
    step = power * next(factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if factor * power >= rough_step * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [float(f"{k * step:.6g}") for k in range(first, last + 1)]


def list_log_ticks(low: float, high: float) -> list[float]:
    """Return round numbers (1, 2, 5 and powers of ten) in a range of a logarithmic axis."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    factors = (1.0, 2.0, 5.0) if high > 5.0 * low else (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
    ticks = [float(f"{factor * 10.0**power:.6g}") for power in powers for factor in factors]
    return [tick for tick in ticks if low <= tick <= high]
