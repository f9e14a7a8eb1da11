"""Common parts of all figures: colours, creation and display, titles, labels and legends."""

from __future__ import annotations

import functools
import re
import sys
import textwrap
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypedDict, Unpack

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Luminances differ, so that figures are legible in greyscale.
INK: Final = "#10243e"
GREY: Final = "#94a0ad"
PALE: Final = "#e3e6ea"
ACCENT: Final = "#b0390c"

#: Styles of the curves of one figure; luminances and dashes differ.
CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linestyle": "-"},
    {"color": ACCENT, "linestyle": (0, (5, 1.5))},
    {"color": "#4d7ea8", "linestyle": (0, (1, 1))},
    {"color": "#b8860b", "linestyle": (0, (6, 1.5, 1, 1.5))},
)

#: Lightest value of a colour scale that is visible on white.
_MAX_LIGHTNESS: Final = 0.85

STYLE: Final[dict[Any, Any]] = {
    "font.size": 8.0,
    "axes.titlesize": "medium",
    "figure.titlesize": "medium",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.4,
    "legend.fontsize": 7.5,
    "legend.handlelength": 1.5,
    "legend.columnspacing": 1.0,
    "legend.frameon": False,
}

#: A number with too many decimals.
_LONG_NUMBER: Final = re.compile(r"\d+\.\d{6,}(?:e[-+]?\d+)?")

#: Letter width relative to the font size: mean, and for short labels; letters in place of the
#: handle and the gaps of a legend line.
_LETTER_WIDTH: Final = 0.52
_WIDE_LETTER_WIDTH: Final = 0.53
_HANDLE_LETTERS: Final = 5

#: Maximum label length relative to its axis; the vertical axis is shortened later by title and legend.
_LABEL_LENGTHS: Final = (0.9, 0.6)
_MIN_LETTERS: Final = 12

#: Tick values of each decade on axes of less than one decade, and of more.
_DIGITS: Final = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
_FEW_DIGITS: Final = (1.0, 2.0, 5.0)

#: Left end of titles, in widths of the figure.
_TITLE_X: Final = 0.02


@contextmanager
def open_figure(
    ax: Axes | None, default: tuple[float, float], figsize: tuple[float, float] | None = None, title: str = ""
) -> Iterator[Figure]:
    """Yield the figure to draw in: the figure of `ax`, if any, in its own style, else a new one in the package's style.

    The size (inches) is `figsize` or a default that suits the content.

    If pyplot is loaded, or in a notebook, a new figure is created through pyplot, so that `pyplot.show()` shows it.
    Elsewhere no global state refers to the figure, and it is freed with its last reference. A notebook shows each
    figure once, as the value of a cell or at its end.
    """
    short_title = _LONG_NUMBER.sub(lambda match: f"{float(match[0]):.4g}", title)
    if ax is not None:
        if not hasattr(ax, "get_figure"):
            raise OptionError(f"{{}} must be Matplotlib axes, not {ax!r}", "ax", value=ax)
        figure = ax.get_figure(root=True)
        assert figure is not None
        ax.set_title(short_title, wrap=True)
        yield figure
        _show_once(figure)
        return

    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        figure = _create_figure(_check_size(default if figsize is None else figsize))
        if short_title:
            lines = textwrap.fill(short_title, _count_letters((1.0 - 2.0 * _TITLE_X) * figure.bbox.width, figure.dpi))
            figure.suptitle(lines, x=_TITLE_X, ha="left")
        yield figure
        _create_ticks(figure)
        interactive = mpl.is_interactive()
    # The context would undo the notebook's setting to show figures at the end of a cell if pyplot was loaded in it.
    mpl.interactive(interactive)


class FigureOptions(TypedDict, total=False):
    """Options of every figure: axes, title and size."""

    title: str
    ax: Axes | None
    figsize: tuple[float, float] | None


class Page:
    """Figure in progress, with its panels and additional legend handles."""

    def __init__(self, figure: Figure, ax: Axes | None) -> None:
        self.figure, self.ax = figure, ax
        self.panel_axes: list[Axes] = []
        self.handles: list[Any] | None = None

    def create_panels(self, mosaic: Any = "A", **options: Any) -> list[Axes]:
        """Create panels at the letters of a mosaic, the main one first, or return the caller's axes alone."""
        self.panel_axes = [self.ax] if self.ax else [*self.figure.subplot_mosaic(mosaic, **options).values()]
        return self.panel_axes


@contextmanager
def open_page(default: tuple[float, float], **options: Unpack[FigureOptions]) -> Iterator[Page]:
    """Yield a page on a figure of `open_figure`; its legend lists all labelled artists of the panels."""
    ax = options.get("ax")
    with open_figure(ax, default, options.get("figsize"), options.get("title", "")) as figure:
        page = Page(figure, ax)
        yield page
        add_legend(figure, ax, collect_handles(*page.panel_axes) if page.handles is None else page.handles)


def _count_letters(width: float, dpi: float, letter_width: float = _LETTER_WIDTH) -> int:
    """Count the letters in the style's font that fit in a width in pixels."""
    return max(_MIN_LETTERS, int(width / (letter_width * dpi * float(STYLE["font.size"]) / 72.0)))


def add_labels(axes: Axes, x_label: str, y_label: str) -> None:
    """Label both axes, with lines about as long as the axes."""
    max_lengths = _LABEL_LENGTHS[0] * axes.bbox.width, _LABEL_LENGTHS[1] * axes.bbox.height
    for axis, label, max_length in zip((axes.xaxis, axes.yaxis), (x_label, y_label), max_lengths, strict=True):
        axis.set_label_text(textwrap.fill(label, _count_letters(max_length, axes.figure.dpi), break_long_words=False))


def choose_styles(count: int) -> list[dict[str, Any]]:
    """Choose a colour and dashes for each curve; more than four go from dark to light in order."""
    if count <= len(CURVES):
        return [*CURVES[:count]]
    from matplotlib import colormaps

    colours = colormaps["cividis"](np.linspace(0.0, _MAX_LIGHTNESS, count))
    dashes = [style["linestyle"] for style in CURVES]
    return [{"color": colour, "linestyle": dashes[k % len(dashes)]} for k, colour in enumerate(colours)]


def add_text(axes: Axes, text: str, position: tuple[Any, Any], offset: tuple[float, float], **style: Any) -> None:
    """Write a text at an offset in points from a position."""
    axes.annotate(text, position, xytext=offset, textcoords="offset points", **style)


def add_ticks(axes: Axes, positions: Floats, height: float, marker: str = "|", **options: Any) -> None:
    """Mark positions along an axis at one height, relative to the axes; short ticks by default."""
    style: dict[str, Any] = {"color": INK, "markersize": 6, "markeredgewidth": 0.5} | options
    axes.plot(positions, np.full(positions.size, height), marker, transform=axes.get_xaxis_transform(), **style)


def compute_cell_edges(x: Floats) -> Floats:
    """Compute the edges of the cells around positions: the midpoints, or a tenth away from a single position."""
    if x.size == 1:
        half_width = max(0.1 * abs(float(x[0])), 1e-9)
        return np.array([x[0] - half_width, x[0] + half_width])
    middles = 0.5 * (x[1:] + x[:-1])
    return np.concatenate([[2.0 * x[0] - middles[0]], middles, [2.0 * x[-1] - middles[-1]]])


def set_log_axis(axes: Axes, x: Floats) -> None:
    """Make the axis of these numbers logarithmic, with as many tick labels as fit."""
    from matplotlib.ticker import LogLocator, NullFormatter

    decades = abs(float(np.log10(x[-1] / x[0]))) if x.size > 1 else 0.0
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=_DIGITS if decades < 1.0 else _FEW_DIGITS))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def add_legend(figure: Figure, ax: Axes | None, handles: Sequence[Artist]) -> None:
    """Put the legend below the panels of a new figure, where it covers no data, or into the caller's axes."""
    if ax is not None and handles:
        ax.legend(handles=handles)
    elif handles:
        max_letters = _count_letters(figure.bbox.width, figure.dpi, _WIDE_LETTER_WIDTH)
        labels = [textwrap.fill(str(handle.get_label()), max_letters - _HANDLE_LETTERS) for handle in handles]
        max_label = _HANDLE_LETTERS + max(len(line) for label in labels for line in label.splitlines())
        columns = min(max(1, max_letters // max_label), len(handles))
        figure.legend(handles, labels, ncols=columns, loc="outside lower center")


def collect_handles(*panels: Axes) -> list[Artist]:
    """Collect the handles of labelled artists, each label once."""
    handles: dict[str, Artist] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    return [*handles.values()]


def _check_size(figsize: tuple[float, float]) -> tuple[float, float]:
    sides = checks.positive_numbers(figsize, "figsize", OptionError)
    if sides.size != 2:
        raise OptionError("{} must be (width, height), in inches", "figsize", value=figsize)
    return float(sides[0]), float(sides[1])


def _create_figure(figsize: tuple[float, float]) -> Figure:
    if not _is_displayable():
        from matplotlib.figure import Figure

        return Figure(figsize=figsize, layout="constrained")
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=figsize, layout="constrained")
    if _is_shown_at_cell_end():
        # The cell shows the figure as its value, so pyplot must not show it again.
        plt.close(figure)
    return figure


def _is_shown_at_cell_end() -> bool:
    """Whether a notebook shows and then closes pyplot's figures at the end of a cell."""
    pyplot: Any = sys.modules.get("matplotlib.pyplot")
    return pyplot is not None and "inline" in pyplot.get_backend()


def _show_once(figure: Figure) -> None:
    """Make pyplot forget a figure when it is first shown, so that cells do not show it twice."""
    if _is_shown_at_cell_end():
        vars(figure)["_ipython_display_"] = functools.partial(_display_figure, figure)


def _display_figure(figure: Figure) -> None:
    import IPython.display
    import matplotlib.pyplot as plt

    display: Any = IPython.display.display
    del vars(figure)["_ipython_display_"]
    plt.close(figure)
    display(figure)


def _is_displayable() -> bool:
    """Whether pyplot can show the figure; windows require the main thread."""
    ipython = sys.modules.get("IPython")
    in_notebook = ipython is not None and hasattr(ipython.get_ipython(), "kernel")
    is_main = threading.current_thread() is threading.main_thread()
    return is_main and ("matplotlib.pyplot" in sys.modules or in_notebook)


def _create_ticks(figure: Figure) -> None:
    """Create the first tick of every axis in the current style, which all later ticks copy."""
    for axes in (child for panel in figure.axes for child in (panel, *panel.child_axes)):
        for axis in (axes.xaxis, axes.yaxis):
            axis.get_major_ticks(1)
            axis.get_minor_ticks(1)
