"""Figures of one response: what is drawn is what was simulated, and nothing covers anything else."""

import io
import math

import numpy as np
import pytest

import rocking

ALPHA = (0.2, 0.25)
BLOCK = rocking.Block.from_parameters(p=2.0, alpha=ALPHA, restitution=0.85)
SHAKEN = rocking.simulate(BLOCK, rocking.pulses.sine(3.0, 1.0, cycles=2))
FALLEN = {side: rocking.simulate(BLOCK, side * rocking.pulses.sine(8.0, 1.0, cycles=1)) for side in (1.0, -1.0)}


def labelled(axes, label):
    return [line for line in axes.lines if line.get_label() == label]


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.parametrize(
    ("units", "plus", "minus"),
    [("slenderness", 1.0 / ALPHA[0], 1.0 / ALPHA[1]), ("rad", 1.0, 1.0), ("deg", 180.0 / math.pi, 180.0 / math.pi)],
)
def test_the_rotation_and_the_motion_are_drawn_as_simulated(units, plus, minus):
    rotation, motion = SHAKEN.plot(rotation_units=units).axes
    (line,) = labelled(rotation, "_rotation")
    theta = SHAKEN.rotation(line.get_xdata())
    np.testing.assert_allclose(line.get_ydata(), np.where(theta >= 0.0, plus * theta, minus * theta), rtol=1e-15)
    (line,) = labelled(motion, "_ground acceleration")
    expected = SHAKEN.motion.acceleration(line.get_xdata()) / 9.80665
    np.testing.assert_allclose(line.get_ydata(), expected, rtol=1e-15)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("units", ["slenderness", "rad"])
def test_an_axis_in_degrees_stands_on_the_right(units):
    figure = SHAKEN.plot(rotation_units=units)
    figure.draw_without_rendering()
    (degrees,) = figure.axes[0].child_axes
    assert degrees.get_ylabel() == "rotation (°)"
    low, high = figure.axes[0].get_ylim()
    plus, minus = ALPHA if units == "slenderness" else (1.0, 1.0)
    np.testing.assert_allclose(degrees.get_ylim(), np.degrees([low * minus, high * plus]))
    assert not SHAKEN.plot(rotation_units="deg").axes[0].child_axes


def test_the_angles_of_tipping_are_drawn_where_they_are_in_the_frame():
    figure = FALLEN[1.0].plot(rotation_units="rad")
    (low, high), dashed = figure.axes[0].get_ylim(), labelled(figure.axes[0], "tipping, θ = ±α")
    assert {line.get_ydata()[0] for line in dashed} == {at for at in (ALPHA[0], -ALPHA[1]) if low < at < high} != set()
    assert legend_of(figure).count("tipping, θ = ±α") == 1


def test_what_is_not_drawn_is_not_in_the_legend():
    quiet = rocking.simulate(BLOCK, rocking.pulses.sine(1.0, 1.0, cycles=2)).plot()
    assert legend_of(quiet) == ["at rest", "uplift thresholds"]


def test_side_plus_is_uplifted_by_a_negative_acceleration_and_stretches_beyond_are_filled():
    motion = SHAKEN.plot().axes[1]
    levels = sorted(line.get_ydata()[0] for line in labelled(motion, "uplift thresholds"))
    assert levels == pytest.approx([-math.tan(ALPHA[0]), math.tan(ALPHA[1])])
    heights = np.concatenate([p.vertices[:, 1] for c in motion.collections for p in c.get_paths()])
    assert (heights[heights < 0.0].max(), heights[heights > 0.0].min()) == pytest.approx(levels, rel=1e-12)


def test_impacts_uplifts_and_rests_are_marked_at_their_times():
    rotation = SHAKEN.plot().axes[0]
    (impacts,) = labelled(rotation, f"resolved impacts ({len(SHAKEN.impacts)})")
    np.testing.assert_array_equal(impacts.get_xdata(), SHAKEN.impacts["time"])
    (uplifts,) = labelled(rotation, "uplift")
    np.testing.assert_array_equal(uplifts.get_xdata(), SHAKEN.events["time"][SHAKEN.events["kind"] == "uplift"])
    spans = [(p.get_x(), p.get_x() + p.get_width()) for p in rotation.patches]
    shown = np.clip(SHAKEN.rest_intervals, *rotation.get_xlim())
    np.testing.assert_allclose(spans, shown[shown[:, 0] < shown[:, 1]], rtol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_fall_of_an_overturned_block_is_marked_where_its_curve_leaves_the_frame(side):
    fallen = FALLEN[side]
    axes = fallen.plot().axes[0]
    low, high = axes.get_ylim()
    (mark,) = labelled(axes, f"overturned at {fallen.overturn_time:.3f} s")
    at, height = mark.get_xdata()[0], mark.get_ydata()[0]
    edge = high if fallen.rotation(at) > 0.0 else low
    assert height == pytest.approx(edge, rel=0.02) and at < fallen.overturn_time
    alpha = ALPHA[0] if edge > 0.0 else ALPHA[1]
    assert fallen.rotation(at) / alpha == pytest.approx(height, rel=1e-12)


def test_the_zoom_shows_every_interval_against_the_time_to_rest():
    free = rocking.simulate(BLOCK, None, initial_rotation=0.15)
    figure = free.plot(longest_sequence=True)
    (points,) = figure.axes[1].lines
    to_rest, intervals = points.get_data()
    (sequence,) = free.sequences
    times = free.impacts["time"][free.impacts["time"] >= sequence["start"]]
    np.testing.assert_allclose(to_rest, 0.5 * (sequence["lower"] + sequence["upper"]) - times[:-1], rtol=1e-9)
    np.testing.assert_array_equal(intervals, np.diff(times))
    assert figure.axes[1].get_xscale() == figure.axes[1].get_yscale() == "log"
    assert len(free.plot().axes) == 1


@pytest.mark.cases(fast=1, thorough=3)
@pytest.mark.parametrize("extension", ["png", "pdf", "svg"])
def test_every_response_is_drawn_to_every_format_without_a_warning(extension):
    still = rocking.simulate(BLOCK, rocking.pulses.sine(1.0, 1.0, cycles=2))
    free = rocking.simulate(BLOCK, None, initial_rotation=0.15)
    for response in (SHAKEN, FALLEN[1.0], still, free):
        buffer = io.BytesIO()
        response.plot(longest_sequence=True).savefig(buffer, format=extension)
        assert buffer.tell() > 5000
