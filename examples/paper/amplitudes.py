"""Chattering time against amplitude, and the critical amplitude against frequency and restitution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.core.arrays import Floats
from rocking.plot.canvas import ACCENT, GREY, INK, PALE, add_text, open_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import ContourSet
    from matplotlib.figure import Figure

#: How the curves of several methods are distinguished, in colour and in grey.
_CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linewidth": 1.3},
    {"color": ACCENT, "linewidth": 1.2, "linestyle": (0, (5, 2))},
    {"color": GREY, "linewidth": 0.0, "marker": "o", "markersize": 4.0, "markerfacecolor": "white", "markevery": 6},
)
_FREQUENCY_CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linewidth": 1.4},
    {"color": ACCENT, "linewidth": 1.2, "linestyle": (0, (5, 2))},
    {"color": GREY, "linewidth": 1.4, "linestyle": (0, (1, 1))},
)

#: Least distance of a contour's label from the frame and from other labels, over the size of the axes.
_LABEL_MARGIN: Final = 0.03
_LABEL_DISTANCE: Final = 0.11


def duration_figure(*, amplitude: Floats, durations: Mapping[str, Floats], critical: float, title: str) -> Figure:
    """Draw chattering time over half a period by several methods, and below how far they are from the first.

    All are over amplitudes (n,), of the ground acceleration over g alpha: by the exact method first, NaN where
    incomplete.
    """
    with open_figure(None, (5.2, 5.0), title=title) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        for (name, values), style in zip(durations.items(), _CURVES, strict=False):
            upper.plot(amplitude, values, label=name, **style)
        upper.axhline(1.0, color=INK, linewidth=0.5)
        for at, text in ((1.0, "$a = 1$"), (critical, rf"$a_{{cr}}$ = {critical:.6f}")):
            upper.axvline(at, color=INK, linewidth=0.6, linestyle=(0, (1, 2)))
            side, off = ("left", 3) if at == 1.0 else ("right", -3)
            add_text(upper, text, (at, 1.045), (off, 0), ha=side)
        upper.set_ylim(0.0, 1.14)
        upper.set_ylabel(r"chattering time, $\tau_{ch}\,/\,(T/2)$")
        upper.legend(loc="lower right", bbox_to_anchor=(0.84, 0.02))
        exact, *others = durations.values()
        moves = exact > 0.0
        for values, style in zip(others, _CURVES[1:], strict=False):
            lower.semilogy(amplitude[moves], np.abs(values[moves] / exact[moves] - 1.0), **style)
        lower.axvline(critical, color=INK, linewidth=0.6, linestyle=(0, (1, 2)))
        lower.set_ylabel("relative error")
        lower.set_xlabel(r"amplitude of the ground acceleration, $a = \ddot u_g / (g\alpha)$")
        lower.ticklabel_format(axis="x", useOffset=False)
        lower.grid(True)
    return figure


def contour_figure(*, omega: Floats, eta: Floats, exact: Floats, fitted: Floats) -> Figure:
    """Draw contours of the critical amplitude over frequency and restitution, and the error of its fit.

    Frequencies (m,) and coefficients of restitution (n,); critical amplitudes (m, n).
    """
    from matplotlib.lines import Line2D

    with open_figure(None, (7.2, 3.3)) as figure:
        surface, error = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes in (surface, error):
            axes.set_xscale("log", base=2)
            axes.xaxis.set_major_formatter("{x:g}")
            axes.set_xlabel(r"frequency, $\omega = \omega_g / p$")
            axes.set_ylim(eta[0], eta[-1] + 0.03 * (eta[-1] - eta[0]))
        levels = np.arange(1.01, 1.13, 0.01)
        lines = surface.contour(omega, eta, exact.T, levels=levels, colors=INK, linewidths=1.0)
        surface.contour(omega, eta, fitted.T, levels=levels, colors=ACCENT, linewidths=0.9, linestyles="dashed")
        _label(surface, lines, "%.2f")
        surface.set_title(r"(a) critical amplitude $a_{cr}$", loc="left")
        surface.set_ylabel(r"coefficient of restitution, $\eta$")
        percent = 100.0 * (fitted / exact - 1.0)
        shades = error.contourf(
            omega, eta, np.abs(percent).T, levels=[0.0, 0.1, 0.25, 0.5, 1.0, 2.0], cmap="Greys", vmax=3.0
        )
        shades.set_edgecolor("face")
        steps = np.array([-0.5, -0.25, 0.0, 0.25, 0.5, 1.0])
        _label(error, error.contour(omega, eta, percent.T, levels=steps, colors=INK, linewidths=0.6), "%g")
        error.set_title("(b) error of Eq. 76, %", loc="left")
        handles = [
            Line2D([], [], color=INK, linewidth=1.0, label="exact"),
            Line2D([], [], color=ACCENT, linewidth=0.9, linestyle="dashed", label="Eq. 76"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def surface_figure(*, omega: Floats, eta: Floats, exact: Floats, fitted: Floats) -> Figure:
    """Draw the critical amplitude over frequency and restitution as a surface, and its fit as points on or off it.

    Frequencies (m,) and coefficients of restitution (n,); critical amplitudes (m, n).
    """
    from matplotlib.lines import Line2D

    with open_figure(None, (5.2, 4.4)) as figure:
        axes: Any = figure.add_subplot(projection="3d")
        # A drawing in three dimensions does not tell what lies above the surface from what lies below: the points do.
        x, y = np.meshgrid(omega, eta, indexing="ij")
        # Facets of four corners each: Matplotlib fills facets of unequal length from memory that nobody has written.
        mesh = _spread(omega.size, 25, eta.size, 20)
        facets: dict[str, Any] = {"rstride": 1, "cstride": 1, "cmap": "Greys", "vmin": 0.9, "vmax": 1.35}
        axes.plot_surface(x[mesh], y[mesh], exact[mesh], edgecolor=INK, linewidth=0.35, **facets)
        some = _spread(omega.size, 17, eta.size, 11)
        above = fitted[some] >= exact[some]
        for shown, face in ((above, ACCENT), (~above, "white")):
            axes.plot(
                x[some][shown], y[some][shown], fitted[some][shown], "o", color=ACCENT, markerfacecolor=face,
                markersize=2.6, markeredgewidth=0.6, zorder=5,
            )  # fmt: skip
        axes.view_init(elev=27.0, azim=118.0)
        axes.set_xlabel(r"frequency, $\omega$")
        axes.set_ylabel(r"restitution, $\eta$")
        axes.set_zlabel(r"critical amplitude, $a_{cr}$")
        axes.set_xlim(omega[0], omega[-1])
        axes.set_box_aspect((1.2, 1.0, 0.75), zoom=0.95)
        point: dict[str, Any] = {"color": ACCENT, "linestyle": "", "marker": "o", "markersize": 3.5}
        handles = [
            Line2D([], [], color=INK, linewidth=1.0, label="exact"),
            Line2D([], [], **point, label="Eq. 76, above it"),
            Line2D([], [], **point, markerfacecolor="white", label="Eq. 76, below it"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def frequency_figure(*, omega: Floats, critical: Mapping[str, Floats], title: str) -> Figure:
    """Draw the critical amplitude against frequency by several methods, and its spread.

    All are over frequencies (n,), by the exact method first.
    """
    with open_figure(None, (5.2, 3.3), title=title) as figure:
        axes = figure.add_subplot()
        exact = next(iter(critical.values()))
        low, high = float(exact.min()), float(exact.max())
        axes.axhspan(low, high, color=PALE, linewidth=0.0)
        for (name, values), style in zip(critical.items(), _FREQUENCY_CURVES, strict=False):
            axes.plot(omega, values, label=name, **style)
        axes.annotate(
            rf"spread {100.0 * (high / low - 1.0):.2f} %", (omega[-1], 0.5 * (low + high)), ha="right", va="center"
        )
        axes.set_xlim(omega[0], omega[-1])
        low, high = axes.get_ylim()
        axes.set_ylim(low - 0.3 * (high - low), high + 0.1 * (high - low))
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.set_xlabel(r"frequency, $\omega = \omega_g / p$")
        axes.set_ylabel(r"critical amplitude, $a_{cr}$")
        axes.legend(loc="lower right")
    return figure


def _label(axes: Axes, lines: ContourSet, form: str) -> None:
    """Label each contour line once, far from the frame and from other labels, on a ground that no line runs through."""
    chosen: list[Floats] = []
    for piece in (piece for pieces in lines.allsegs for piece in pieces if len(piece)):
        places = axes.transAxes.inverted().transform(axes.transData.transform(piece))
        clearance = np.minimum(places.min(axis=1), (1.0 - places).min(axis=1))
        for other in chosen:
            apart = places - axes.transAxes.inverted().transform(axes.transData.transform(other))
            clearance[np.hypot(*apart.T) < _LABEL_DISTANCE] = 0.0
        if clearance.max() > _LABEL_MARGIN:
            chosen.append(piece[clearance.argmax()])
    for text in axes.clabel(lines, fmt=form, fontsize=7, inline_spacing=2, manual=[tuple(at) for at in chosen]):
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85})
        text.set_clip_on(True)


def _spread(rows: int, most_rows: int, columns: int, most_columns: int) -> tuple[Any, ...]:
    """Return indices of at most so many rows and columns of a grid, from its first to its last."""
    return np.ix_(
        np.unique(np.linspace(0, rows - 1, most_rows).astype(int)),
        np.unique(np.linspace(0, columns - 1, most_columns).astype(int)),
    )
