"""Chattering time against amplitude, and the critical amplitude against frequency and restitution."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import add_title, figure_for
from rocking.plot.style import ABOVE, GROUND, INK, REST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

#: How the curves of several methods are told apart, in colour and in grey.
_CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linewidth": 1.3},
    {"color": ABOVE, "linewidth": 1.2, "linestyle": (0, (5, 2))},
    {"color": GROUND, "linewidth": 0.0, "marker": "o", "markersize": 4.0, "markerfacecolor": "white", "markevery": 6},
)


def duration_figure(
    *,
    amplitude: Floats,
    durations: Mapping[str, Floats],
    critical: float,
    title: str,
) -> Figure:
    """Draw chattering time over half a period by several methods, and below how far they are from the first.

    Parameters
    ----------
    amplitude : ndarray, shape (n,)
        Amplitude a of the ground acceleration over g alpha.
    durations : mapping of str to ndarray, shape (n,)
        Chattering time over half a period by each method, the exact one first; NaN where incomplete.
    critical : float
        Critical amplitude.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with figure_for(None, (5.2, 5.0)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        for (name, values), style in zip(durations.items(), _CURVES, strict=False):
            upper.plot(amplitude, values, label=name, **style)
        upper.axhline(1.0, color=INK, linewidth=0.5)
        for at, text in ((1.0, "$a = 1$"), (critical, rf"$a_{{cr}}$ = {critical:.6f}")):
            upper.axvline(at, color=INK, linewidth=0.6, linestyle=(0, (1, 2)))
            upper.annotate(
                text,
                (at, 1.045),
                ha="left" if at == 1.0 else "right",
                xytext=(3 if at == 1.0 else -3, 0),
                textcoords="offset points",
            )
        upper.set_ylim(0.0, 1.14)
        upper.set_ylabel(r"chattering time, $\tau_{ch}\,/\,(T/2)$")
        add_title(figure, None, title)
        upper.legend(loc="lower right", bbox_to_anchor=(0.84, 0.02))
        exact, *others = durations.values()
        moves = exact > 0.0
        for values, style in zip(others, _CURVES[1:], strict=False):
            lower.semilogy(amplitude[moves], np.abs(values[moves] / exact[moves] - 1.0), **style)
        lower.axvline(critical, color=INK, linewidth=0.6, linestyle=(0, (1, 2)))
        lower.set_ylabel("relative error")
        lower.set_xlabel(r"amplitude of the ground acceleration, $a = \ddot u_g / (g\alpha)$")
        lower.grid()
    return figure


def surface_figure(*, omega: Floats, eta: Floats, exact: Floats, fitted: Floats) -> Figure:
    """Draw the critical amplitude over frequency and restitution, and the error of its fit.

    Parameters
    ----------
    omega, eta : ndarray, shapes (m,) and (n,)
        Frequencies and coefficients of restitution.
    exact, fitted : ndarray, shape (m, n)
        Critical amplitude.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.lines import Line2D

    with figure_for(None, (7.2, 3.3)) as figure:
        surface, error = figure.subplots(1, 2, sharex=True, sharey=True)
        levels = np.arange(1.01, 1.13, 0.01)
        lines = surface.contour(omega, eta, exact.T, levels=levels, colors=INK, linewidths=1.0)
        surface.contour(omega, eta, fitted.T, levels=levels, colors=ABOVE, linewidths=0.9, linestyles="dashed")
        _label(surface.clabel(lines, fmt="%.2f", fontsize=7))
        surface.set_title(r"(a) critical amplitude $a_{cr}$", loc="left")
        surface.set_ylabel(r"coefficient of restitution, $\eta$")
        percent = 100.0 * (fitted / exact - 1.0)
        steps = np.array([-0.5, -0.25, 0.0, 0.25, 0.5, 1.0])
        shades = error.contourf(
            omega, eta, np.abs(percent).T, levels=[0.0, 0.1, 0.25, 0.5, 1.0, 2.0], cmap="Greys", vmax=3.0
        )
        shades.set_edgecolor("face")
        lines = error.contour(omega, eta, percent.T, levels=steps, colors=INK, linewidths=0.6)
        for text in error.clabel(lines, fmt="%g", fontsize=7):
            text.set_clip_on(True)
        error.set_title("(b) error of Eq. 76, %", loc="left")
        for axes in (surface, error):
            axes.set_xlabel(r"frequency, $\omega = \omega_g / p$")
            axes.set_xscale("log", base=2)
            axes.xaxis.set_major_formatter("{x:g}")
        handles = [
            Line2D([], [], color=INK, linewidth=1.0, label="exact"),
            Line2D([], [], color=ABOVE, linewidth=0.9, linestyle="dashed", label="Eq. 76"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def frequency_figure(*, omega: Floats, critical: Mapping[str, Floats], title: str, ax: Axes | None = None) -> Figure:
    """Draw the critical amplitude against frequency by several methods, and its spread.

    Parameters
    ----------
    omega : ndarray, shape (n,)
        Frequencies.
    critical : mapping of str to ndarray, shape (n,)
        Critical amplitude by each method, the exact one first.
    title : str
        Title of the figure.
    ax : matplotlib.axes.Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with figure_for(ax, (5.2, 3.3)) as figure:
        axes = ax or figure.add_subplot()
        exact = next(iter(critical.values()))
        low, high = float(exact.min()), float(exact.max())
        axes.axhspan(low, high, color=REST, linewidth=0.0)
        for (name, values), style in zip(critical.items(), _FREQUENCY_CURVES, strict=False):
            axes.plot(omega, values, label=name, **style)
        axes.annotate(
            rf"spread {100.0 * (high / low - 1.0):.2f} %",
            (omega[-1], 0.5 * (low + high)),
            ha="right",
            va="center",
        )
        axes.set_xlim(omega[0], omega[-1])
        _loosen(axes)
        axes.set_xlabel(r"frequency, $\omega = \omega_g / p$")
        axes.set_ylabel(r"critical amplitude, $a_{cr}$")
        add_title(figure, ax, title)
        axes.legend(loc="lower right")
    return figure


def _label(texts: Iterable[Text]) -> None:
    """Give the labels of contour lines a ground of their own, so that no other line runs through them."""
    for text in texts:
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85})


_FREQUENCY_CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linewidth": 1.4},
    {"color": ABOVE, "linewidth": 1.2, "linestyle": (0, (5, 2))},
    {"color": GROUND, "linewidth": 1.4, "linestyle": (0, (1, 1))},
)


def _loosen(axes: Axes) -> None:
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.3 * (high - low), high + 0.1 * (high - low))
    axes.ticklabel_format(axis="y", useOffset=False)
