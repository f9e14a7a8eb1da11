"""Figures of one response: what is drawn is what was given, and nothing covers anything else."""

import io
import math

import numpy as np
import pytest

from rocking.plot.response import DrawnSequence, response_figure

NO_TIMES = np.array([])
NO_INTERVALS = np.empty((0, 2))
ALPHA = (0.2, 0.25)


def bouncing_times(rest: float, first_interval: float, ratio: float, count: int) -> np.ndarray:
    """Impact times whose intervals shrink by ``ratio`` and accumulate at ``rest``."""
    return rest - first_interval / (1.0 - ratio) * ratio ** np.arange(count)


def figure_of(**changes):
    time = np.linspace(0.0, 10.0, 1001)
    arrays = {
        "time": time,
        "rotation": 0.08 * np.sin(time) * np.exp(-0.3 * time),
        "slenderness": ALPHA,
        "impact_times": np.pi * np.arange(1, 4),
        "rest_intervals": np.array([[0.0, 0.2], [9.8, 10.0]]),
        "uplift_times": np.array([0.2]),
        "overturn_time": None,
        "motion_time": time,
        "motion_acceleration_g": -0.3 * np.sin(time),
        "thresholds_g": (0.2, 0.25),
        "title": "A block",
    }
    return response_figure(**(arrays | changes))


def labelled(axes, label):
    (artist,) = [line for line in axes.lines if line.get_label() == label]
    return artist


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.parametrize(
    ("units", "plus", "minus"),
    [("slenderness", 1.0 / ALPHA[0], 1.0 / ALPHA[1]), ("rad", 1.0, 1.0), ("deg", 180.0 / math.pi, 180.0 / math.pi)],
)
def test_the_rotation_and_the_motion_are_drawn_as_given(units, plus, minus):
    figure = figure_of(units=units)
    rotation, motion = figure.axes
    time = np.linspace(0.0, 10.0, 1001)
    theta = 0.08 * np.sin(time) * np.exp(-0.3 * time)
    drawn = labelled(rotation, "_rotation").get_ydata()
    np.testing.assert_allclose(drawn, np.where(theta >= 0.0, plus * theta, minus * theta), rtol=1e-15)
    np.testing.assert_array_equal(labelled(motion, "_ground acceleration").get_ydata(), -0.3 * np.sin(time))


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("units", ["slenderness", "rad"])
def test_an_axis_in_degrees_stands_on_the_right(units):
    figure = figure_of(units=units, rotation=np.linspace(-0.1, 0.15, 1001))
    figure.draw_without_rendering()
    (degrees,) = figure.axes[0].child_axes
    assert degrees.get_ylabel() == "rotation (°)"
    low, high = figure.axes[0].get_ylim()
    plus, minus = ALPHA if units == "slenderness" else (1.0, 1.0)
    np.testing.assert_allclose(degrees.get_ylim(), np.degrees([low * minus, high * plus]))
    assert not figure_of(units="deg").axes[0].child_axes


def test_the_angles_of_tipping_are_drawn_where_they_are_in_the_frame():
    figure = figure_of(rotation=np.linspace(-0.3, 0.19, 1001), units="rad")
    dashed = [line.get_ydata()[0] for line in figure.axes[0].lines if line.is_dashed()]
    assert sorted(dashed) == [-ALPHA[1], ALPHA[0]]
    assert legend_of(figure).count("tipping, θ = ±α") == 1
    assert "tipping, θ = ±α" not in legend_of(figure_of())


def test_what_is_not_drawn_is_not_in_the_legend():
    assert legend_of(figure_of()) == [
        "at rest",
        "resolved impacts (3)",
        "uplift",
        "beyond a threshold",
        "uplift thresholds",
    ]
    outside = {"impact_times": np.array([12.0]), "uplift_times": np.array([11.0]), "rest_intervals": [[11.0, 12.0]]}
    quiet = figure_of(motion_acceleration_g=np.full(1001, 0.1), **{k: np.array(v) for k, v in outside.items()})
    assert legend_of(quiet) == ["uplift thresholds"]


def test_side_plus_is_uplifted_by_a_negative_acceleration():
    motion = figure_of(thresholds_g=(0.2, 0.25)).axes[1]
    dashed = [line.get_ydata()[0] for line in motion.lines if line.is_dashed()]
    assert sorted(dashed) == [-0.2, 0.25]


def test_only_the_stretches_beyond_a_threshold_are_filled():
    motion = figure_of(thresholds_g=(0.2, 0.25)).axes[1]
    heights = np.concatenate([p.vertices[:, 1] for c in motion.collections for p in c.get_paths()])
    assert heights.max() == pytest.approx(0.3, abs=1e-4)
    assert heights.min() == pytest.approx(-0.3, abs=1e-4)
    assert (heights[heights < 0.0].max(), heights[heights > 0.0].min()) == pytest.approx((-0.2, 0.25), rel=1e-12)


def test_impacts_uplifts_and_rests_are_marked_at_their_times():
    rotation = figure_of().axes[0]
    np.testing.assert_array_equal(labelled(rotation, "resolved impacts (3)").get_xdata(), np.pi * np.arange(1, 4))
    np.testing.assert_array_equal(labelled(rotation, "uplift").get_xdata(), [0.2])
    spans = [(p.get_x(), p.get_x() + p.get_width()) for p in rotation.patches]
    np.testing.assert_allclose(spans, [[0.0, 0.2], [9.8, 10.0]], rtol=1e-15)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_fall_of_an_overturned_block_is_marked_where_its_curve_leaves_the_frame(side):
    time = np.linspace(0.0, 10.0, 1001)
    figure = figure_of(rotation=side * np.exp(time) * 1e-4, overturn_time=9.75)
    axes = figure.axes[0]
    low, high = axes.get_ylim()
    assert high - low < 5.0
    mark = labelled(axes, "overturned at 9.750 s")
    at, height = mark.get_xdata()[0], mark.get_ydata()[0]
    edge = high if side > 0.0 else low
    assert height == pytest.approx(edge, rel=0.02)  # where the curve leaves the frame, on its way to the fall
    curve = max(axes.lines, key=lambda line: len(line.get_xdata()))
    assert np.interp(at, curve.get_xdata(), curve.get_ydata()) == pytest.approx(height, rel=1e-3) and at < 9.75
    assert mark.get_marker() != labelled(axes, "uplift").get_marker()
    assert "overturned at 9.750 s" in legend_of(figure)


def test_the_zoom_shows_every_interval_against_the_time_to_rest():
    times = bouncing_times(9.8, 0.5, 0.8, 60)
    zoom = figure_of(chattering=DrawnSequence(times, 9.8 - 1e-9, 9.8 + 1e-9)).axes[1]
    (points,) = zoom.lines
    to_rest, intervals = points.get_data()
    assert to_rest.size == 59
    np.testing.assert_allclose(intervals, 0.2 * to_rest, rtol=1e-6)
    assert zoom.get_xscale() == zoom.get_yscale() == "log"
    assert "9.800000" in zoom.get_title(loc="left")
    assert len(figure_of().axes) == 2


@pytest.mark.cases(fast=1, thorough=7)
@pytest.mark.parametrize("extension", ["png", "pdf", "svg"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"impact_times": NO_TIMES, "uplift_times": NO_TIMES, "rest_intervals": NO_INTERVALS},
        {"motion_time": NO_TIMES, "motion_acceleration_g": NO_TIMES},
        {"rotation": np.zeros(1001)},
        {"chattering": DrawnSequence(bouncing_times(9.8, 0.5, 0.8, 60), 9.8 - 1e-9, 9.8 + 1e-9)},
    ],
    ids=["full", "no events", "free rocking", "never moved", "chattering"],
)
def test_every_response_is_drawn_to_every_format_without_a_warning(changes, extension):
    buffer = io.BytesIO()
    figure_of(**changes).savefig(buffer, format=extension)
    assert buffer.tell() > 5000
