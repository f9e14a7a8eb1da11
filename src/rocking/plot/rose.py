"""What a body does in every direction, seen from above: roses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.tables import as_written
from rocking.plot.canvas import ABOVE, GROUND, INK, REST, Place, add_labels, page_for, styles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def rose_figure(
    *,
    azimuth: Floats,
    acceleration: Floats,
    slenderness: Floats,
    p: Floats,
    support: Floats,
    weakest: tuple[float, float],
    **place: Unpack[Place],
) -> Figure:
    """Draw the acceleration that lifts a body in each direction, g, around its support; slenderness and p beside it."""
    from matplotlib.patches import Polygon

    with page_for((6.8, 4.0), **place) as page:
        if page.ax is None:
            grid = page.figure.add_gridspec(2, 2, width_ratios=(1.6, 1.0))
            page.drawn = [page.figure.add_subplot(grid[:, 0])]
            upper = page.figure.add_subplot(grid[0, 1])
            lower = page.figure.add_subplot(grid[1, 1], sharex=upper)
            for axes, values, label in ((upper, slenderness, "slenderness (deg)"), (lower, p, "p (rad/s)")):
                axes.plot(*_closed(azimuth, values), color=INK, linewidth=1.2)
                axes.grid(True)
                add_labels(axes, "" if axes is upper else "azimuth (deg)", label)
            upper.tick_params(labelbottom=False)
            lower.set_xlim(0.0, 360.0)
            lower.set_xticks([0.0, 180.0, 360.0])
            lower.set_xticks([90.0, 270.0], minor=True)
        (main,) = page.drawn or page.panels()
        _draw_circles(main, float(max(acceleration.max(), np.abs(support).max())))
        label = "support over height of centre of mass"
        main.add_patch(Polygon(support, facecolor=REST, edgecolor=GROUND, linewidth=1.0, label=label))
        main.plot(*_around(azimuth, acceleration), color=INK, linewidth=1.4, label="ground acceleration that lifts it")
        main.plot(0.0, 0.0, "o", color=INK, markersize=4.0)
        end = weakest[1] * _unit(weakest[0])
        label = f"least: {weakest[1]:.3g} g at {weakest[0]:.3g} deg"
        main.plot([0.0, end[0]], [0.0, end[1]], color=ABOVE, linewidth=1.6, linestyle=(0, (4, 1.5)), label=label)
        add_labels(main, "towards west and east (g)", "towards south and north (g)")
    return page.figure


def shares_figure(*, azimuth: Floats, shares: Floats, labels: Sequence[str], **place: Unpack[Place]) -> Figure:
    """Draw shares, shape (curves, azimuths), over the azimuth: towards the north up, and the full circle is all."""
    with page_for((4.8, 4.8), **place) as page:
        (axes,) = page.panels()
        _draw_circles(axes, 1.0)
        for share, label, style in zip(shares, labels, styles_of(len(labels)), strict=True):
            look = {"linewidth": 1.4, "marker": "o", "markersize": 2.0, "label": as_written(label), **style}
            axes.plot(*_around(azimuth, share), **look)
        add_labels(axes, "share towards west and east", "share towards south and north")
    return page.figure


def _unit(azimuth: Any) -> Floats:
    angle = np.deg2rad(azimuth)
    return np.array([np.sin(angle), np.cos(angle)])


def _closed(azimuth: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Values over the azimuth, with the first once more a turn later."""
    return np.append(azimuth, azimuth[0] + 360.0), np.append(values, values[0])


def _around(azimuth: Floats, values: Floats) -> Floats:
    """Places at distances towards azimuths, in a closed line; shape (2, n)."""
    turned, distances = _closed(azimuth, values)
    return np.asarray(_unit(turned) * distances)


def _draw_circles(axes: Axes, most: float) -> None:
    """Draw circles, and the points of the compass, as far as a distance."""
    from matplotlib.patches import Circle
    from matplotlib.ticker import MaxNLocator

    places = [place for place in MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, most) if place > 0.0]
    for place in places:
        axes.add_patch(Circle((0.0, 0.0), place, fill=False, edgecolor=REST, linewidth=0.7, zorder=0))
    reach = places[-1]
    for azimuth, name in ((0.0, "N"), (90.0, "E"), (180.0, "S"), (270.0, "W")):
        end = reach * _unit(azimuth)
        axes.plot([0.0, end[0]], [0.0, end[1]], color=REST, linewidth=0.7, zorder=0)
        axes.annotate(name, tuple(1.1 * end), ha="center", va="center", fontsize=7.5, color=INK)
    axes.set_aspect("equal")
    axes.set_xlim(-1.2 * reach, 1.2 * reach)
    axes.set_ylim(-1.2 * reach, 1.2 * reach)
    for axis in (axes.xaxis, axes.yaxis):  # to either side the distance from the middle
        axis.set_ticks([-place for place in reversed(places)] + [0.0, *places])
        axis.set_major_formatter(lambda value, _: f"{abs(value):g}")
