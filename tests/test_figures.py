"""Figures of studies: what they show is explained, and no text leaves them at the widths that journals print."""

import dataclasses
import functools
import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.text import Text

import rocking
from rocking import dynamics
from rocking.plot.curves import (
    FragilityLine,
    HazardLine,
    ParameterEstimate,
    RiskLine,
    ScaledMotion,
    SpectrumCurves,
    compute_reaching_levels,
    draw_fragility,
    draw_ida,
    draw_measured_history,
    draw_outcomes,
    draw_reliability,
    draw_risk,
    draw_spectrum,
    draw_survival,
)
from rocking.plot.maps import draw_basins, draw_outcome_map, draw_regions, draw_rose
from rocking.plot.orbits import draw_bifurcation, draw_branches, draw_intervals, draw_orbit

COLUMN, PAGE = 86.0 / 25.4, 174.0 / 25.4
LONG = "rectangular block, 0.24 m x 1.1 m, restitution = 0.9318234567890123, under ridgecrest-clc-090, nonlinear model"
RECORDS = [f"some-earthquake-station-{k:02d}-090" for k in range(12)]


def spectrum_of(count, curves=1, **options):
    x = np.geomspace(0.3, 60.0, 25)
    each = np.array([(1.0 + 0.3 * k) / (1.0 + x) for k in range(count)])
    each[each > 1.0] = np.inf
    fractiles = np.sort(each, axis=0)[[0, count // 2, -1]]
    lines = [SpectrumCurves(f"α = {k}", each, fractiles, np.isinf(each).mean(axis=0)) for k in range(curves)]
    chosen = {"fractiles": [0.16, 0.5, 0.84], "motions": RECORDS[:count], "x_label": "half diagonal R (m)"}
    return draw_spectrum(x=x, curves=lines, **(chosen | options))


def scaled(count):
    levels = 1.05 ** np.arange(40)
    peaks = [np.where(levels < 3.0 + 0.3 * k, 0.1 * levels, np.inf) for k in range(count)]
    bands = [np.array([[3.0 + 0.3 * k, levels[-1]]]) for k in range(count)]
    return [ScaledMotion(*each) for each in zip(RECORDS[:count], [levels] * count, peaks, bands, strict=True)]


def ida_of(count, **options):
    return draw_ida(motions=scaled(count), **({"level_label": "peak ground acceleration (m/s²)"} | options))


def fragility_of(**options):
    x = np.linspace(0.0, 8.0, 50)
    p = x / 9.0
    line = FragilityLine("overturning: median 4.149", x, p, 0.8 * p, 1.1 * p, x[[9, 19, 29]], p[[9, 19, 29]])
    texts = {"intensity_label": "peak ground acceleration (m/s²)", "band_label": "band: 90 % confidence (likelihood)"}
    return draw_fragility(lines=[line, line._replace(label="half: median 3.6")], **(texts | options))


def rose_of(**options):
    azimuth = np.arange(0.0, 360.0, 10.0)
    values = 0.3 + 0.1 * np.abs(np.sin(np.deg2rad(2.0 * azimuth)))
    corners = np.array([[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]])
    each = {"acceleration": values, "slenderness": 60.0 * values, "p": 3.0 - values}
    return draw_rose(azimuth=azimuth, support=corners, weakest=(90.0, 0.3), **each, **options)


def map_of(**options):
    texts = {"x_label": "frequency of the pulse over p", "y_label": "amplitude over the smallest that lifts the block"}
    return draw_regions(
        x=np.array([0.4, 9.0]),
        y_range=(0.5, 15.0),
        edges=[np.arange(2.0, 14.0, 2.0)] * 2,
        regions=[range(-3, 4)] * 2,
        names={k: f"overturns after {k} impacts" for k in range(-3, 4)},
        **(texts | options),
    )


@functools.cache
def response():
    """A block that uplifts, chatters and comes to rest; its motion has a vertical component."""
    shaken = rocking.pulses.sine(2.6, 1.0, cycles=2).with_vertical(rocking.pulses.sine(1.0, 0.5, cycles=2))
    return rocking.simulate(rocking.Block.from_parameters(p=2.2, alpha=(0.24, 0.25), restitution=0.8), shaken)


def response_of(**options):
    return response().plot(longest_sequence=True, window=(0.0, response().duration), **options)


def phase_of(**options):
    return response().plot_phase_plane(**options)


def energy_over_time_of(**options):
    return response().plot_energy(**options)


def outcomes_of(**options):
    return draw_outcome_map(
        x=np.arange(3.0),
        y=np.arange(3.0),
        outcome=np.arange(9).reshape(3, 3) % 6,
        meanings=[f"what becomes of the block, number {k}" for k in range(6)],
        is_later=np.eye(3, dtype=bool),
        **(
            {
                "x_label": "amplitude of a lobe over that of the one before it, of which there are five unequal ones",
                "y_label": "amplitude",
            }
            | options
        ),
    )


def intervals_of(count=60, **options):
    intervals = 0.5 * 0.9 ** np.arange(count) * np.where(np.arange(count) % 2, 0.1, 1.0)
    return draw_intervals(intervals=intervals, eta=0.9, **options)


def trials_of(sides=2, **options):
    rng = np.random.default_rng(1)
    probabilities, values = rng.uniform(size=80), np.exp(rng.normal(size=(50, sides)))
    names = ("p (rad/s)", "alpha (rad)", "restitution")
    parameters = [ParameterEstimate(name, values, np.array([[1.0, 0.5, 2.0]] * sides), (0.1, 9.0)) for name in names]
    fell = probabilities > rng.uniform(size=80)
    weights = np.full(50, 0.02)
    return draw_outcomes(
        probabilities=probabilities, overturned=fell, parameters=parameters, weights=weights, **options
    )


def validation_of(**options):
    middle = np.linspace(0.05, 0.95, 10)
    bands = {"band_lower": np.maximum(middle - 0.2, 0.0), "band_upper": np.minimum(middle + 0.2, 1.0)}
    return draw_reliability(predicted=middle, observed=middle**1.2, **bands, **options)


def risk_of(**options):
    x = np.geomspace(0.05, 2.0, 80)
    lines = [RiskLine(f"{name}: once in 460 years (210 to 830)", x * np.exp(-x)) for name in ("half", "overturning")]
    hazard = HazardLine(1e-3 * x**-2.0, (0.1, 1.0))
    return draw_risk(
        intensity=x, hazard=hazard, lines=lines, **({"intensity_label": "peak ground acceleration (g)"} | options)
    )


def survival_of(**options):
    x = np.geomspace(0.05, 2.0, 80)
    label = "at most, with 10000 years without overturning (95 %)"
    hazard = HazardLine(1e-3 * x**-2.0, (0.1, 1.0))
    texts = {"intensity_label": "peak ground acceleration (g)", "largest_label": label}
    return draw_survival(intensity=x, largest=1e-3 / x, hazard=hazard, **(texts | options))


def measured_of(**options):
    time = np.linspace(0.0, 5.0, 101)
    fine = np.linspace(0.0, 5.0, 1001)
    arrays = {"time": time, "measured": np.sin(time), "residual": 1e-3 * np.cos(time)}
    return draw_measured_history(**arrays, fitted_time=fine, fitted=np.sin(fine), **options)


def basins_of(**options):
    kinds = ["orbit"] * 4 + ["overturns"] * 2 + ["unsettled"]
    orbits = np.full((7, 3, 2), np.nan)
    orbits[:4] = np.linspace(0.0, 2.0, 24).reshape(4, 3, 2)
    names = [f"what becomes of the block, number {k}" for k in range(7)]
    texts = {"x_label": "rotation at the start of a period (rad)", "y_label": "angular velocity (rad/s)"}
    outcome = np.arange(9).reshape(3, 3) % 8 - 1
    arrays = {"x": np.arange(3.0), "y": np.arange(3.0), "outcome": outcome, "orbits": orbits}
    return draw_basins(**arrays, names=names, kinds=kinds, **(texts | options))


def bifurcation_of(**options):
    value = np.linspace(1.0, 2.0, 30)
    states = {way: np.sin(np.outer(value, np.arange(1.0, 9.0)) + k) for k, way in enumerate(("up", "down"))}
    texts = {"x_label": "amplitude over the smallest that lifts the block", "y_label": "rotation (rad)"}
    return draw_bifurcation(value=value, states=states, overturned=value > 1.9, **(texts | options))


def orbit_of(**options):
    time = np.linspace(0.0, 2.0, 400)
    arrays = {"coordinate": 0.1 * np.sin(np.pi * time), "velocity": 0.3 * np.cos(np.pi * time)}
    texts = {"labels": ("rotation (rad)", "velocity (rad/s)"), "states": np.array([[0.0, 0.3], [0.0, -0.3]])}
    return draw_orbit(time=time, impact_times=time[[100, 300]], **arrays, **(texts | options))


def branch_of(**options):
    s = np.linspace(-1.0, 1.0, 60)
    marks = [("fold", 3.0, 0.2), ("symmetry breaking", 3.6, 0.31), ("loss of complete chattering", 3.9, 0.02)]
    texts = {"marks": marks, "labels": ("peak ground acceleration (m/s²)", "largest rotation (rad)")}
    return draw_branches(values=3.0 + s * s, heights=0.2 + 0.18 * s, stable=s > 0.0, **(texts | options))


FIGURES = {
    "basins": (basins_of, 4.8),
    "bifurcation": (bifurcation_of, 3.8),
    "intervals": (intervals_of, 4.2),
    "outcomes of tests": (trials_of, 4.8),
    "validation": (validation_of, 5.2),
    "measured": (measured_of, 3.8),
    "response": (response_of, 4.8),
    "phase plane": (phase_of, 4.2),
    "energy": (energy_over_time_of, 3.4),
    "spectrum of two": (lambda **options: spectrum_of(2, 2, **options), 4.2),
    "spectrum of twelve": (lambda **options: spectrum_of(12, 4, **options), 4.2),
    "spectrum of many curves": (lambda **options: spectrum_of(12, 30, **options), 4.8),
    "ida of two": (lambda **options: ida_of(2, **options), 4.2),
    "ida of twelve": (lambda **options: ida_of(12, **options), 4.8),
    "fragility": (fragility_of, 3.6),
    "risk": (risk_of, 4.8),
    "survival": (survival_of, 3.6),
    "map": (map_of, 3.8),
    "rose": (rose_of, 4.0),
    "outcomes": (outcomes_of, 3.8),
    "orbit": (orbit_of, 3.8),
    "branch": (branch_of, 3.8),
}


def shown_boxes(figure):
    """What is drawn of every text: all but ticks, of which those out of sight are there as well, and every axis."""
    renderer = figure.canvas.get_renderer()
    every = [axes for panel in figure.axes for axes in (panel, *panel.child_axes)]
    axes_of_all = [axis for axes in every for axis in (axes.xaxis, axes.yaxis)]
    ticks = {id(text) for axis in axes_of_all for text in axis.findobj(Text) if text is not axis.label}
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text() and id(text) not in ticks:
            yield text.get_text(), text.get_window_extent(renderer)
    for axis in axes_of_all:
        if (box := axis.get_tightbbox(renderer)) is not None:
            yield "an axis", box


@pytest.mark.cases(fast=2, thorough=26)
@pytest.mark.parametrize(
    ("width", "dpi"),
    [
        pytest.param(COLUMN, 100.0, id="column"),
        pytest.param(PAGE, 100.0, id="page"),
        pytest.param(COLUMN, 300.0, id="column, fine"),
        pytest.param(PAGE, 200.0, id="page, fine"),
    ],
)
@pytest.mark.parametrize("kind", FIGURES)
def test_no_text_leaves_the_figure(kind, width, dpi):
    draw, height = FIGURES[kind]
    figure = draw(title=LONG, figsize=(width, height))
    figure.set_dpi(dpi)
    FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    frame = figure.bbox
    boxes = [*shown_boxes(figure)]
    assert len(boxes) > 4
    outside = [
        text
        for text, box in boxes
        if box.x0 < frame.x0 - 0.5 or box.x1 > frame.x1 + 0.5 or box.y0 < frame.y0 - 0.5 or box.y1 > frame.y1 + 0.5
    ]
    assert not outside
    assert not any("9318234567890123" in text for text, _ in boxes)


@pytest.mark.cases(fast=9)
@pytest.mark.parametrize("kind", FIGURES)
def test_axes_of_the_caller_take_the_main_panel(kind):
    draw, _ = FIGURES[kind]
    mine = Figure()
    ax, other = mine.subplots(1, 2)
    assert draw(ax=ax) is mine
    assert mine.axes == [ax, other]
    assert ax.get_xlabel()
    assert not other.has_data()


def entries(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_where_blocks_overturn_the_lines_of_a_spectrum_end_in_crosses():
    x = np.arange(1.0, 8.0)
    peaks = np.array([[0.1, 0.2, np.inf, 0.4, np.inf, 0.6, 0.7]])
    curve = SpectrumCurves("", peaks, peaks, np.isinf(peaks[0]).astype(float))
    figure = draw_spectrum(x=x, curves=[curve], fractiles=[0.5], motions=["a"], x_label="p")
    (crosses,) = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    np.testing.assert_array_equal(crosses.get_xydata(), [[2.0, 0.2], [4.0, 0.4], [6.0, 0.6]])
    assert entries(figure) == ["beyond: overturns"]
    standing = curve._replace(single_curves=0.0 * np.nan_to_num(peaks, posinf=0.0))
    assert not draw_spectrum(x=x, curves=[standing], fractiles=[0.5], motions=["a"], x_label="p").legends


def test_the_lowest_level_that_reaches_a_peak_is_on_the_curve_before_it_turns_back():
    levels = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    peak = np.array([0.1, 0.3, 0.2, 0.6, np.inf])
    motion = ScaledMotion("a", levels, peak, np.array([[4.5, 5.0]]))
    reached = compute_reaching_levels(motion, np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7]))
    np.testing.assert_allclose(reached, [1.0, 1.0, 1.5, 2.0, 3.5, 4.0, 4.5])
    standing = motion._replace(peak=np.append(peak[:4], 0.65), bands=np.empty((0, 2)))
    np.testing.assert_allclose(compute_reaching_levels(standing, np.array([0.65, 0.7])), [5.0, np.inf])
    always = motion._replace(bands=np.array([[1.0, 5.0]]))
    np.testing.assert_allclose(compute_reaching_levels(always, np.array([0.1, 0.9])), [1.0, 1.0])


def test_the_intervals_of_a_sequence_are_drawn_with_the_limit_of_their_ratios():
    figure = intervals_of(6)
    assert entries(figure) == ["impacts 1, 3, ...", "impacts 2, 4, ...", "η² = 0.81"]
    _, odd, even = figure.axes[0].lines
    assert (odd.get_xdata().tolist(), even.get_xdata().tolist()) == ([1, 3, 5], [2, 4, 6])
    np.testing.assert_allclose(odd.get_ydata(), [0.5, 0.405, 0.32805])
    ratios = np.concatenate([line.get_ydata() for line in figure.axes[1].lines[1:]])
    np.testing.assert_allclose(ratios, 0.81)
    assert figure.axes[0].get_yscale() == "log"
    intervals_of(0).draw_without_rendering()


def test_tests_are_drawn_in_the_order_of_their_probability_and_blocks_by_weight():
    tests, first, *_ = trials_of().axes
    curve, fell, stood = tests.lines
    assert np.all(np.diff(curve.get_ydata()) >= 0.0)
    numbers = np.concatenate([fell.get_xdata(), stood.get_xdata()])
    assert sorted(numbers) == list(range(1, 81))
    assert set(fell.get_ydata()) == {1.0} and set(stood.get_ydata()) == {0.0}
    assert [sum(stairs.get_data().values) for stairs in first.patches] == pytest.approx([1.0, 1.0])
    assert entries(trials_of(1))[3:] == ["bound", "both sides", "centre: median and 90 %"]
    assert {line.get_xdata()[0] for line in first.lines if line.get_label() == "bound"} == {0.1, 9.0}
    assert len({first.patches[k].get_edgecolor() for k in (0, 1)} | {to_rgba(curve.get_color())}) == 3


def test_dots_of_a_fragility_say_what_they_pool():
    figure = fragility_of()
    assert entries(figure)[-1] == "dot: share of outcomes at about its intensity"
    assert figure.axes[0].get_xlim() == pytest.approx((0.0, 8.0))
    marks = [line for line in figure.axes[0].lines if line.get_marker() != "None" and len(line.get_xdata())]
    np.testing.assert_allclose(marks[0].get_xdata(), np.linspace(0.0, 8.0, 50)[[9, 19, 29]])
    assert len({mark.get_marker() for mark in marks}) == 2


def test_dollars_in_names_begin_no_formula():
    sine = rocking.pulses.sine(3.0, 1.0, cycles=2)
    named = [dataclasses.replace(sine, name=name) for name in ("$a_b$ $c^d$", "$40 and $50")]
    block = rocking.Block(width=0.3, height=1.2)
    oscillator = dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.01)

    def case(damping):
        return dataclasses.replace(oscillator, stop=damping), named[0]

    diagram = dynamics.bifurcation_diagram(
        case, [0.1, 0.2], (0.0, 0.0), transient_periods=3, recorded_periods=2, parameter="first_stop"
    )
    figures = {
        "response": rocking.simulate(block, named[0]).plot(),
        "motion": named[0].plot(),
        "ida": rocking.incremental_dynamic_analysis(block, named, levels=[1.0, 2.0], measure="pga").plot(),
        "spectrum": rocking.rocking_spectrum(rocking.Blocks.grid(alpha=[0.2], p=[2.0, 3.0, 4.0]), named).plot(),
        "diagram": diagram.plot(),
    }
    seen = 0
    for kind, figure in figures.items():
        texts = [text.get_text() for text in figure.findobj(Text)]
        assert not [text for text in texts if re.search(r"(?<!\\)\$(?!10\^)", text)], kind
        assert not [text for text in texts if re.search(r"[a-z]_[a-z]{2}", text)], kind
        seen += any("\\$" in text for text in texts)
    assert seen >= 4


def test_a_response_that_leaves_the_frame_at_once_or_rests_as_it_ends_is_drawn():
    block = rocking.Block(width=0.4, height=2.0)
    fallen = rocking.simulate(block, None, initial_rotation=0.5)
    assert fallen.plot().axes
    falling = rocking.simulate(block, rocking.pulses.one_sine(9.0, 0.8))
    assert falling.overturned
    assert falling.plot(window=(falling.overturn_time - 0.01, falling.duration)).axes
    resting = rocking.simulate(block, None, initial_rotation=0.1).duration
    assert rocking.simulate(block, None, initial_rotation=0.1, duration=resting).plot(longest_sequence=True).axes


def test_fractiles_of_many_motions_are_drawn_where_the_first_overturns_at_every_level():
    motions = [rocking.pulses.one_sine(1.0, frequency) for frequency in (0.3, 4.0, 4.5, 5.0, 5.5, 6.0)]
    found = rocking.incremental_dynamic_analysis(rocking.Block(width=0.4, height=2.0), motions, levels=[3.0, 5.0, 8.0])
    drawn = [line for line in found.plot().axes[0].lines if "suffices" in str(line.get_label())]
    assert drawn and all(np.isfinite(line.get_ydata()).any() for line in drawn)


def test_the_ground_panel_names_the_side_of_each_threshold_of_an_asymmetric_block():
    block = rocking.Block(width=0.4, height=2.0, offset=0.05)
    axes = rocking.simulate(block, rocking.pulses.one_sine(5.0, 1.0)).plot().axes
    assert {"lifts to side +", "lifts to side −"} <= {text.get_text() for each in axes for text in each.texts}
