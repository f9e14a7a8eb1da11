"""Curves with bands and points: fragility, risk, spectra, incremental dynamic analyses, calibrations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Unpack

import numpy as np

from rocking.core.arrays import Flags, Floats, select_evenly
from rocking.core.tables import escape_dollars
from rocking.plot.canvas import (
    ACCENT,
    CURVES,
    GREY,
    INK,
    FigureOptions,
    add_labels,
    choose_styles,
    open_page,
    set_log_axis,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GROUP_MARKER: Final[dict[str, Any]] = {"markersize": 4.0, "markerfacecolor": "none"}


class FragilityLine(NamedTuple):
    """Fitted curve with its confidence band, and the observed fractions in groups of similar intensity.

    group_intensity, observed (groups,) : mean intensity of each group, and its fraction that exceeds the limit
    """

    label: str
    intensity: Floats
    probability: Floats
    lower: Floats
    upper: Floats
    group_intensity: Floats
    observed: Floats


def draw_fragility(
    *,
    lines: Sequence[FragilityLine],
    intensity_label: str,
    band_label: str,
    probability_label: str = "probability",
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw fitted fragility curves with their confidence bands and the observed fractions."""
    with open_page((5.6, 4.2), **options) as page:
        (axes,) = page.create_panels()
        for k, line in enumerate(lines):
            style = CURVES[k % len(CURVES)]
            axes.fill_between(line.intensity, line.lower, line.upper, color=style["color"], alpha=0.18, linewidth=0.0)
            axes.plot(line.intensity, line.probability, linewidth=1.5, label=escape_dollars(line.label), **style)
            # Every limit state has its own marker.
            dot_style = _GROUP_MARKER | {"color": style["color"], "clip_on": False}
            axes.plot(line.group_intensity, line.observed, "os^D"[k % 4], **dot_style)
        is_bounded = any(np.any(line.lower < line.upper) for line in lines)
        axes.fill_between([], [], color=GREY, alpha=0.4 * is_bounded, linewidth=0.0, label=band_label)
        axes.plot([], [], "o", color=GREY, label="dot: share of outcomes at about its intensity", **_GROUP_MARKER)
        axes.set(xlim=(0.0, float(lines[0].intensity[-1])), ylim=(0.0, 1.0))
        axes.grid(True)
        add_labels(axes, intensity_label, probability_label)
    return page.figure


def draw_dispersions(
    *, names: Sequence[str], dispersion: Floats, low: Floats, high: Floats, **options: Unpack[FigureOptions]
) -> Figure:
    """Draw the dispersion of the overturning intensity, with its interval, for each named measure."""
    with open_page((5.6, 0.8 + 0.32 * len(names)), **options) as page:
        (axes,) = page.create_panels()
        row = np.arange(len(names))
        axes.hlines(row, low, high, color=INK, linewidth=1.0)
        axes.plot(dispersion, row, color=INK, linestyle="none", marker="o", markersize=4.5)
        axes.set_yticks(row, list(names))
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlim(left=0.0)
        axes.grid(axis="x", linewidth=0.4, color="0.85")
        add_labels(axes, "dispersion of the intensity at overturning (90 % interval)", "")
        page.handles = []
    return page.figure


#: Fractions of a rate are shown from this part of the largest fraction on.
_MIN_SHARE = 1e-3

#: Range of the shown rates: factors on the lowest and highest rate of the hazard curve.
_RATE_MARGIN = 10.0


class HazardLine(NamedTuple):
    """Annual exceedance rates of intensities, and the ends of the curve, beyond which it is extrapolated."""

    rate: Floats
    known_range: tuple[float, float]


class RiskLine(NamedTuple):
    """Fraction of a limit state's rate from each intensity, per factor of e in intensity."""

    label: str
    share: Floats


def draw_risk(
    *,
    intensity: Floats,
    hazard: HazardLine,
    lines: Sequence[RiskLine],
    intensity_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw a hazard curve, and below it the contributions to each limit state's rate."""
    with open_page((5.6, 5.2), **options) as page:
        *hazard_axes, share_axes = page.create_panels("A;B", sharex=True)
        for panel in hazard_axes:
            _draw_hazard(panel, intensity, hazard)
        for k, line in enumerate(lines):
            style = CURVES[k % len(CURVES)]
            share_axes.plot(intensity, line.share, linewidth=1.5, label=escape_dollars(line.label), **style)
            share_axes.fill_between(intensity, 0.0, line.share, color=style["color"], alpha=0.12, linewidth=0.0)
        is_visible = _is_inside(intensity, hazard.known_range)
        for line in lines:
            is_visible |= line.share > _MIN_SHARE * line.share.max()
        for panel in hazard_axes:
            panel.set_ylim(0.5 * float(hazard.rate[is_visible].min()), 2.0 * float(hazard.rate[is_visible].max()))
        set_log_axis(share_axes, intensity[is_visible])
        share_axes.set(xlim=(float(intensity[is_visible][0]), float(intensity[is_visible][-1])))
        share_axes.set_ylim(bottom=0.0)
        share_axes.grid(True)
        add_labels(share_axes, intensity_label, "share of the rate per factor of e")
    return page.figure


def draw_survival(
    *,
    intensity: Floats,
    largest: Floats,
    largest_label: str,
    hazard: HazardLine | None,
    intensity_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw a hazard curve and the largest annual rates consistent with a standing block."""
    with open_page((5.6, 3.6), **options) as page:
        (axes,) = page.create_panels()
        set_log_axis(axes, intensity)
        if hazard is not None:
            _draw_hazard(axes, intensity, hazard)
            style: dict[str, Any] = {"color": ACCENT, "alpha": 0.2, "label": "more often than the block allows"}
            axes.fill_between(intensity, largest, np.maximum(largest, hazard.rate), linewidth=0.0, **style)
        axes.plot(intensity, largest, label=largest_label, linewidth=1.5, **CURVES[1])
        rate = largest[largest < np.inf] if hazard is None else hazard.rate
        lowest, highest = 0.5 * min(float(largest.min()), float(rate.min())), _RATE_MARGIN * float(rate.max())
        axes.set(yscale="log", xlim=(intensity[0], intensity[-1]), ylim=(lowest, min(highest, 10.0)))
        axes.grid(True)
        add_labels(axes, intensity_label, "exceeded, times a year")
    return page.figure


def _is_inside(intensity: Floats, bounds: tuple[float, float]) -> Flags:
    return np.asarray((intensity >= bounds[0]) & (intensity <= bounds[1]))


def _draw_hazard(axes: Axes, intensity: Floats, hazard: HazardLine) -> None:
    """Draw a hazard curve, dotted where it is extrapolated."""
    is_inside = _is_inside(intensity, hazard.known_range)
    label = "hazard curve (dotted: extended)" if not is_inside.all() else "hazard curve"
    axes.plot(intensity, hazard.rate, color=GREY, linewidth=1.0, linestyle=":")
    axes.plot(intensity[is_inside], hazard.rate[is_inside], color=GREY, linewidth=2.0, label=label)
    axes.set_yscale("log")
    axes.grid(True)
    add_labels(axes, "", "exceeded, times a year")


#: Maximum number of curves that are drawn with all fractiles, and with every motion.
_MAX_CURVES_WITH_FRACTILES: Final = 2
_MAX_CURVES_WITH_MOTIONS: Final = 4

#: Maximum number of curves in the legend.
_MAX_NAMED_CURVES: Final = 8

#: Marker at the end of a line beyond which blocks overturn.
_END_MARKER: Final[dict[str, Any]] = {"marker": "x", "linestyle": "none", "markersize": 4.0, "markeredgewidth": 1.0}


class SpectrumCurves(NamedTuple):
    """Curves of one slenderness and restitution against the abscissa; infinite where the block overturns.

    label : legend label; none if empty
    singles (motions, points) : normalised peak rotation of every motion
    fractiles (fractiles, points) : their fractiles; the middle one is drawn thickest
    overturned_share (points,) : fraction of the motions that overturn the block
    """

    label: str
    single_curves: Floats
    fractiles: Floats
    overturned_share: Floats


def draw_spectrum(
    *,
    x: Floats,
    curves: Sequence[SpectrumCurves],
    fractiles: Sequence[float],
    motions: Sequence[str],
    x_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw peak rotations against the abscissa, and below them the fraction of motions that overturn the block.

    A single curve needs no label, and if there are more than eight, some are labelled. Up to four curves are drawn
    with all motions, up to two with all fractiles, more with the middle fractile. A fractile, and the line of a single
    motion, ends in a cross if the block of the next point overturns. In `ax`, only the peak rotations are drawn.
    """
    middle = min(fractiles, key=lambda share: abs(share - 0.5))
    drawn_fractiles = fractiles if len(motions) > 1 and len(curves) <= _MAX_CURVES_WITH_FRACTILES else [middle]
    widths = {share: 1.8 if share == middle else 0.9 for share in drawn_fractiles}
    labelled, has_singles = select_evenly(len(curves), _MAX_NAMED_CURVES), len(curves) <= _MAX_CURVES_WITH_MOTIONS
    with open_page((5.6, 4.8), **options) as page:
        peak_axes, *share_axes = panels = page.create_panels("A;B", sharex=True, height_ratios=(3.2, 1.0))
        for k, (style, curve) in enumerate(zip(choose_styles(len(curves)), curves, strict=True)):
            peak_axes.plot([], [], linewidth=1.4, label=escape_dollars(curve.label) if k in labelled else "", **style)
            if has_singles:
                singles = np.where(np.isfinite(curve.single_curves), curve.single_curves, np.nan)
                peak_axes.plot(x, singles.T, color=style["color"], linewidth=0.5, alpha=0.35)
            for share, width in widths.items():
                fractile = curve.fractiles[[*fractiles].index(share)]
                _draw_peaks(peak_axes, x, curve.single_curves[0] if len(motions) == 1 else fractile, width, style)
            for panel in share_axes:
                panel.step(x, curve.overturned_share, where="mid", linewidth=1.2, **style)
        if len(labelled) < len(curves):
            peak_axes.plot([], [], linestyle="none", label=f"({len(labelled)} of {len(curves)} named)")
        if len(motions) > 1:
            if has_singles:
                peak_axes.plot([], [], color=GREY, linewidth=0.5, label=f"each of {len(motions)} motions")
            for share, width in widths.items():
                label = "median" if share == 0.5 else f"{100 * share:g} % of the motions are below"
                peak_axes.plot([], [], color=INK, linewidth=width, label=label)
        peak_axes.grid(True, which="both")
        set_log_axis(panels[-1], x)
        peak_axes.set_ylim(bottom=0.0)
        add_labels(peak_axes, "" if share_axes else x_label, "peak rotation / slenderness")
        for panel in share_axes:
            panel.grid(True, which="both")
            panel.set_ylim(-0.03, 1.03)
            add_labels(panel, x_label, "share overturned")
    return page.figure


def _draw_peaks(axes: Axes, x: Floats, values: Floats, width: float, style: dict[str, Any]) -> None:
    """Draw a line with gaps at infinite values, and mark its ends there."""
    is_finite = np.isfinite(values)
    finite_values = np.where(is_finite, values, np.nan)
    axes.plot(x, finite_values, marker="o" if x.size == 1 else "", markersize=4.0, linewidth=width, **style)
    is_end = is_finite & ~(np.append(True, is_finite[:-1]) & np.append(is_finite[1:], True))
    if is_end.any():
        axes.plot(x[is_end], values[is_end], color=style["color"], label="beyond: overturns", **_END_MARKER)


#: Fractiles of the motions, and their line styles.
_FRACTILE_LINES: Final[Mapping[float, Any]] = {0.16: (0, (1, 1)), 0.5: "-", 0.84: (0, (5, 1.5))}


class ScaledMotion(NamedTuple):
    """Levels, normalised peak rotations, and bands (n, 2) of overturning levels of one scaled motion."""

    label: str
    levels: Floats
    peak: Floats
    bands: Floats


def draw_ida(*, motions: Sequence[ScaledMotion], level_label: str, **options: Unpack[FigureOptions]) -> Figure:
    """Draw the level of scaled motions against the peak rotation, and beside it the levels that overturn.

    More than four motions are drawn in one style, with the fractiles of the levels that reach a peak rotation.
    """
    has_few = len(motions) <= len(CURVES)
    names = [escape_dollars(motion.label) for motion in motions]
    if has_few and len(motions) > 1:
        names = [f"{k}: {name}" for k, name in enumerate(names, start=1)]
    standing_levels = np.concatenate([motion.levels[np.isfinite(motion.peak)] for motion in motions])
    last = max(float(motion.levels[-1]) for motion in motions)
    with open_page((7.0, 4.2), **options) as page:
        curve_axes, *strip_axes = page.create_panels("AB", sharey=True, width_ratios=(2.0, 1.0))
        for k, motion in enumerate(motions):
            style = CURVES[k] if has_few else {"color": GREY, "linewidth": 0.6}
            peak = np.where(np.isfinite(motion.peak), motion.peak, np.nan)
            label, size = (names[k], 5.0) if has_few else ("each motion", 3.0)
            curve_axes.plot(peak, motion.levels, label=label, marker=".", markersize=size, markeredgewidth=0.0, **style)
            for panel in strip_axes:
                for band in motion.bands:
                    # Lines at the ends keep the thinnest strip visible.
                    color = style["color"] if has_few else INK
                    panel.plot([k, k], band, "_-", color=color, linewidth=5.0, markersize=5.0, solid_capstyle="butt")
        if not has_few:
            all_peaks = np.concatenate([motion.peak for motion in motions])
            peaks = np.linspace(0.0, float(np.max(all_peaks[np.isfinite(all_peaks)], initial=0.0)), 200)[1:]
            reached = np.sort([compute_reaching_levels(motion, peaks) for motion in motions], axis=0)
            for share, linestyle in _FRACTILE_LINES.items():
                # Lowest level that suffices for this fraction of the motions.
                level = reached[int(np.ceil(share * len(motions))) - 1]
                label = f"level that suffices for {100 * share:g} % of them"
                finite_level = np.where(np.isfinite(level), level, np.nan)
                curve_axes.plot(peaks, finite_level, color=ACCENT, linestyle=linestyle, label=label)
        curve_axes.set(xlim=(0.0, None), ylim=(0.0, min(1.5 * float(standing_levels.max(initial=0.0)) or last, last)))
        curve_axes.grid(True)
        add_labels(curve_axes, "peak rotation / slenderness", level_label)
        for panel in strip_axes:
            panel.set_xticks(range(len(motions)), [str(k + 1) for k in range(len(motions))] if has_few else names)
            panel.tick_params("x", labelrotation=0 if has_few else 90, labelsize="small")
            panel.set_xlim(-0.7, len(motions) - 0.3)
            add_labels(panel, "overturns", "")
    return page.figure


def compute_reaching_levels(motion: ScaledMotion, peaks: Floats) -> Floats:
    """Find the lowest level at which a motion reaches each peak rotation; infinite if never."""
    overturning_level = float(np.min(motion.bands[:, 0], initial=np.inf))
    is_below = motion.levels < overturning_level
    level, peak = motion.levels[is_below], motion.peak[is_below]
    if not level.size:
        return np.full(peaks.shape, overturning_level)
    first = np.searchsorted(np.maximum.accumulate(peak), peaks)
    lower, upper = (np.clip(first - shift, 0, level.size - 1) for shift in (1, 0))
    rise = np.where(peak[upper] > peak[lower], peak[upper] - peak[lower], np.inf)
    interpolated = level[lower] + (peaks - peak[lower]) / rise * (level[upper] - level[lower])
    return np.where(first < level.size, interpolated, overturning_level)


#: Bars of a histogram of blocks.
_BIN_COUNT: Final = 24

_TEST_MARKER: Final[dict[str, Any]] = {"linestyle": "", "markersize": 3.2, "markeredgewidth": 0.6, "clip_on": False}


class ParameterEstimate(NamedTuple):
    """One parameter of the blocks that explain the outcomes: values (blocks, sides) and estimates.

    estimates (sides, 3) : median, lower and upper end of its interval
    bounds : lowest and highest plausible value
    """

    label: str
    values: Floats
    estimates: Floats
    bounds: tuple[float, float]


def draw_outcomes(
    *,
    probabilities: Floats,
    overturned: Flags,
    parameters: Sequence[ParameterEstimate],
    weights: Floats,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw the outcome of every test against its fitted probability, and the parameters of the blocks."""
    with open_page((7.0, 4.6), **options) as page:
        letters = "ABCDEFGHI"[: len(parameters)]
        tests_panel, *panels = page.create_panels(f"{'T' * len(parameters)};{letters}", height_ratios=(1.2, 1.0))
        # Sorted, with each outcome at a probability of 0 or 1.
        order = np.argsort(probabilities, kind="stable")
        number, is_overturned = np.arange(1, order.size + 1), overturned[order]
        tests_panel.plot(number, probabilities[order], color=INK, linewidth=1.2, label="fitted probability")
        fallen, standing = number[is_overturned], number[~is_overturned]
        tests_panel.plot(fallen, np.ones(fallen.size), "v", color=ACCENT, label="overturned", **_TEST_MARKER)
        standing_style: Any = {"color": INK, "mfc": "white", "label": "did not overturn", **_TEST_MARKER}
        tests_panel.plot(standing, np.zeros(standing.size), "o", **standing_style)
        tests_panel.set_ylim(0.0, 1.0)
        tests_panel.grid(True)
        add_labels(tests_panel, "test, by its probability", "probability of overturning")
        for panel, parameter in zip(panels, parameters, strict=False):
            _draw_parameter(panel, parameter, weights)
        if panels:
            add_labels(panels[0], parameters[0].label, "share of blocks")
    return page.figure


def draw_measured_history(
    *,
    time: Floats,
    measured: Floats,
    residual: Floats,
    fitted_time: Floats,
    fitted: Floats,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw measured and fitted rotation histories (rad, against s) and their residual."""
    with open_page((7.0, 4.0), **options) as page:
        main_panel, *residual_panels = page.create_panels("A;B", sharex=True, height_ratios=(2.4, 1.0))
        main_panel.plot(time, measured, ".", color=GREY, markersize=3.5, markeredgewidth=0.0, label="measured")
        main_panel.plot(fitted_time, fitted, color=ACCENT, linewidth=0.9, label="fitted")
        main_panel.set_xlim(time[0], time[-1])
        add_labels(main_panel, "" if residual_panels else "time (s)", "rotation (rad)")
        for panel in residual_panels:
            panel.plot(time, residual, color=INK, linewidth=0.6)
            add_labels(panel, "time (s)", "residual (rad)")
        for panel in (main_panel, *residual_panels):
            panel.axhline(0.0, color=INK, linewidth=0.4)
    return page.figure


def _draw_parameter(axes: Axes, parameter: ParameterEstimate, weights: Floats) -> None:
    """Draw the distribution of the blocks, and the median and interval of the population's centre."""
    sides = parameter.values.shape[1]
    styles = {"side +": CURVES[3], "side -": CURVES[1]} if sides > 1 else {"both sides": CURVES[2] | {"linestyle": "-"}}
    edges = np.histogram_bin_edges(parameter.values, _BIN_COUNT)
    for bound in parameter.bounds:
        axes.axvline(bound, color=GREY, linewidth=1.0, linestyle=(0, (3, 2)), label="bound")
    transform = axes.get_xaxis_transform()
    for k, (name, style) in enumerate(styles.items()):
        shares = np.histogram(parameter.values[:, k], edges, weights=weights)[0]
        axes.stairs(shares, edges, linewidth=1.1, label=name, **style)
        ends, height = np.sort(parameter.estimates[k]), 0.97 - 0.07 * k
        axes.plot(ends, [height] * 3, "|-", color=style["color"], linewidth=1.0, transform=transform)
    axes.plot([], [], "|-", color=GREY, linewidth=1.0, markersize=7.0, label="centre: median and 90 %")
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    axes.set_yticks([])
    add_labels(axes, parameter.label, "")


def draw_reliability(
    *, predicted: Floats, observed: Floats, band_lower: Floats, band_upper: Floats, **options: Unpack[FigureOptions]
) -> Figure:
    """Draw observed against predicted fractions (bins,), with the bands of correct predictions."""
    with open_page((3.7, 3.7), **options) as page:
        (axes,) = page.create_panels()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=GREY, linewidth=0.8, linestyle=(0, (4, 2)))
        label = "90 % of what right predictions would show"
        axes.vlines(predicted, band_lower, band_upper, color=GREY, linewidth=5.0, alpha=0.55, label=label)
        axes.plot(predicted, observed, "o-", color=INK, linewidth=0.9, markersize=4.0, clip_on=False, label="observed")
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        axes.grid(True)
        add_labels(axes, "predicted probability of overturning", "share that overturned")
    return page.figure


def draw_ground(axes: Axes, time: Floats, acceleration: Floats, linewidth: float) -> None:
    """Draw an acceleration against time, with a line at zero."""
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GREY, linewidth=linewidth, label="_ground acceleration")


def draw_motion(
    *, time: Floats, acceleration_g: Floats, vertical_g: Floats | None = None, **options: Unpack[FigureOptions]
) -> Figure:
    """Draw a ground acceleration (g) against time (s), and below it the vertical one, which is omitted in `ax`."""
    traces = {"ground acceleration (g)": acceleration_g}
    if vertical_g is not None and options.get("ax") is None:
        traces["vertical acceleration (g)"] = vertical_g
    with open_page((7.0, 0.6 + 1.8 * len(traces)), **options) as page:
        panels = page.create_panels(";".join("AB"[: len(traces)]), sharex=True)
        for axes, (label, trace) in zip(panels, traces.items(), strict=True):
            draw_ground(axes, time, trace, 0.8)
            axes.set_xlim(time[0], time[-1])
            add_labels(axes, "time (s)" if axes is panels[-1] else "", label)
        page.handles = []
    return page.figure
