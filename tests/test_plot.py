"""Figures: what is drawn is what was given, and nothing covers anything else."""

import io

import numpy as np
import pytest

from rocking.plot import DrawnSequence, response_figure

NO_TIMES = np.array([])
NO_INTERVALS = np.empty((0, 2))


def bouncing_times(rest: float, first_interval: float, ratio: float, count: int) -> np.ndarray:
    """Impact times whose intervals shrink by ``ratio`` and accumulate at ``rest``."""
    return rest - first_interval / (1.0 - ratio) * ratio ** np.arange(count)


def figure_of(**changes):
    time = np.linspace(0.0, 10.0, 1001)
    arrays = {
        "time": time,
        "rotation_over_slenderness": 0.4 * np.sin(time) * np.exp(-0.3 * time),
        "impact_times": np.pi * np.arange(1, 4),
        "rest_intervals": np.array([[0.0, 0.2], [9.8, 10.0]]),
        "uplift_times": np.array([0.2]),
        "overturn_time": None,
        "motion_time": time,
        "motion_acceleration_g": -0.3 * np.sin(time),
        "thresholds_g": (0.2, 0.25),
        "chattering": None,
        "title": "A block",
    }
    return response_figure(**(arrays | changes))


def labelled(axes, label):
    (artist,) = [line for line in axes.lines if line.get_label() == label]
    return artist


def test_the_rotation_and_the_motion_are_drawn_as_given():
    figure = figure_of()
    rotation, motion = figure.axes
    time = np.linspace(0.0, 10.0, 1001)
    np.testing.assert_array_equal(labelled(rotation, "rotation").get_ydata(), 0.4 * np.sin(time) * np.exp(-0.3 * time))
    np.testing.assert_array_equal(labelled(motion, "ground acceleration").get_ydata(), -0.3 * np.sin(time))


def test_side_plus_is_uplifted_by_a_negative_acceleration():
    motion = figure_of(thresholds_g=(0.2, 0.25)).axes[1]
    dashed = [line.get_ydata()[0] for line in motion.lines if line.is_dashed()]
    assert sorted(dashed) == [-0.2, 0.25]


def test_only_the_stretches_beyond_a_threshold_are_filled():
    motion = figure_of(thresholds_g=(0.2, 0.25)).axes[1]
    heights = np.concatenate([p.vertices[:, 1] for c in motion.collections for p in c.get_paths()])
    assert heights.max() == pytest.approx(0.3, abs=1e-4)
    assert heights.min() == pytest.approx(-0.3, abs=1e-4)
    assert not np.any((heights > -0.2 + 1e-12) & (heights < 0.25 - 1e-12))


def test_impacts_uplifts_and_rests_are_marked_at_their_times():
    rotation = figure_of().axes[0]
    np.testing.assert_array_equal(labelled(rotation, "impacts (3)").get_xdata(), np.pi * np.arange(1, 4))
    np.testing.assert_array_equal(labelled(rotation, "uplift").get_xdata(), [0.2])
    spans = [(p.get_x(), p.get_x() + p.get_width()) for p in rotation.patches]
    np.testing.assert_allclose(spans, [[0.0, 0.2], [9.8, 10.0]], rtol=1e-15)


def test_an_overturned_block_does_not_flatten_the_rocking_before():
    time = np.linspace(0.0, 10.0, 1001)
    figure = figure_of(rotation_over_slenderness=np.exp(time) * 1e-3, overturn_time=10.0)
    low, high = figure.axes[0].get_ylim()
    assert high - low < 5.0
    assert labelled(figure.axes[0], "overturns, 10.000 s").get_xdata() == [10.0, 10.0]


def test_the_zoom_shows_every_interval_against_the_time_to_rest():
    times = bouncing_times(9.8, 0.5, 0.8, 60)
    zoom = figure_of(chattering=DrawnSequence(times, 9.8 - 1e-9, 9.8 + 1e-9)).axes[2]
    (points,) = zoom.lines
    to_rest, intervals = points.get_data()
    assert to_rest.size == 59
    np.testing.assert_allclose(intervals, 0.2 * to_rest, rtol=1e-6)
    assert zoom.get_xscale() == zoom.get_yscale() == "log"
    assert "9.800000" in zoom.get_title(loc="left")


def test_impacts_closer_than_the_spacing_of_times_are_left_out_of_the_zoom():
    times = bouncing_times(9.8, 0.5, 0.5, 80)
    zoom = figure_of(chattering=DrawnSequence(times, 9.8, 9.8)).axes[2]
    assert np.all(zoom.lines[0].get_ydata() > 0.0)
    assert zoom.lines[0].get_xdata().size < 60


@pytest.mark.parametrize("extension", ["png", "pdf", "svg"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"impact_times": NO_TIMES, "uplift_times": NO_TIMES, "rest_intervals": NO_INTERVALS},
        {"motion_time": NO_TIMES, "motion_acceleration_g": NO_TIMES},
        {"rotation_over_slenderness": np.zeros(1001)},
        {"chattering": DrawnSequence(bouncing_times(9.8, 0.5, 0.8, 60), 9.8 - 1e-9, 9.8 + 1e-9)},
    ],
    ids=["full", "no events", "free rocking", "never moved", "chattering"],
)
def test_every_response_is_drawn_to_every_format_without_a_warning(changes, extension):
    buffer = io.BytesIO()
    figure_of(**changes).savefig(buffer, format=extension)
    assert buffer.tell() > 5000


@pytest.mark.parametrize(
    "sequence",
    [DrawnSequence(np.array([9.0]), 9.1, 9.2), DrawnSequence(np.array([9.0, 9.5]), np.nan, np.nan)],
    ids=["one impact", "rest not bracketed"],
)
def test_without_a_bracketed_sequence_the_panels_fill_the_figure(sequence):
    assert len(figure_of(chattering=sequence).axes) == 2


def test_no_text_covers_another_text():
    sequence = DrawnSequence(bouncing_times(9.8, 0.5, 0.8, 60), 9.8 - 1e-9, 9.8 + 1e-9)
    figure = figure_of(chattering=sequence, overturn_time=9.9)
    figure.savefig(io.BytesIO(), format="png")
    boxes = [figure._suptitle.get_window_extent()]
    for axes in figure.axes:
        titles = [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label]
        boxes += [text.get_window_extent() for text in titles if text.get_text()]
    boxes.append(figure.legends[0].get_window_extent())
    for number, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:number])
        assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1
