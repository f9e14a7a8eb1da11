"""What processing does to a motion, step by step."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from oracles.cases import wave

from rocking import pulses, records
from rocking.errors import MotionError
from rocking.motion.motion import Motion

STEP = 0.01
TIMES = STEP * np.arange(4001)


def sampled(function):
    return Motion.from_samples(function(TIMES), STEP)


def test_trim_keeps_the_samples_between_its_ends():
    motion = sampled(np.sin)
    part = motion.processed(trim=(1.234, 5.678))
    assert_array_equal(part.samples[:-1], motion.samples[123:568])
    assert part.duration == pytest.approx(4.45)
    assert part.dt == STEP
    assert part.history == ("trimmed to 1.23-5.68 s",)


def test_trim_of_a_pulse_cuts_exactly():
    pulse = pulses.ricker(1.0, 1.0)
    start, end = 2.0123, 3.3
    part = pulse.processed(trim=(start, end))
    times = np.linspace(0.0, end - start, 100)[1:-1]
    assert_allclose(part.acceleration(times), pulse.acceleration(times + start), atol=1e-14)
    assert part.duration == end - start
    assert part.error == pulse.error
    assert part.description.family == "processed symmetric Ricker"


def test_trim_to_the_whole_changes_nothing():
    for motion in (sampled(np.sin), pulses.half_sine(1.0, 0.7)):
        same = motion.processed(trim=(0.0, motion.duration))
        assert_array_equal(same.breakpoints, motion.breakpoints)
        assert_allclose(same.coefficients, motion.coefficients, rtol=1e-9, atol=1e-13)


def test_jumps_survive_a_trim_and_are_not_dropped_by_what_works_on_samples():
    ended = Motion.from_samples(np.ones(5), 0.5) + Motion.from_samples(np.zeros(11), 0.5)  # from 1 to 0 at 2 s
    part = ended.processed(trim=(1.0, 4.0))
    assert_array_equal(part.acceleration([0.5, 0.999, 1.0, 2.0]), [1.0, 1.0, 0.0, 0.0])
    for options in ({"baseline": 0}, {"band_pass": (0.1, 0.5)}):
        with pytest.raises(MotionError, match="linear between samples; call processed\\(resample"):
            ended.processed(**options)
    assert not ended.processed(resample=0.25).has_jumps


@settings(deadline=None)
@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=4))
def test_a_baseline_polynomial_is_removed_exactly(polynomial):
    motion = sampled(lambda t: np.polynomial.polynomial.polyval(t / 40.0, polynomial))
    assert motion.processed(baseline=len(polynomial) - 1).pga <= 1e-13 * (1.0 + np.abs(polynomial).max())


def test_a_baseline_is_the_least_squares_fit():
    motion = sampled(lambda t: np.cos(3.0 * t) + 0.2 + 0.1 * t)
    done = motion.processed(baseline=2)
    fitted = np.polyval(np.polyfit(TIMES, motion.samples, 2), TIMES)
    assert_allclose(done.samples, motion.samples - fitted, atol=1e-12)
    assert done.history == ("baseline of degree 2 removed",)


def amplitude_after(frequency, corners, order=4):
    """Factor on a long sine's amplitude in the middle of the motion, and the phase shift."""
    motion = sampled(lambda t: np.sin(2 * math.pi * frequency * t))
    middle = slice(1500, 2500)
    out = motion.processed(band_pass=corners, order=order).samples[middle]
    sine, cosine = np.sin(2 * math.pi * frequency * TIMES[middle]), np.cos(2 * math.pi * frequency * TIMES[middle])
    a, b = np.linalg.lstsq(np.column_stack([sine, cosine]), out, rcond=None)[0]
    return math.hypot(a, b), math.atan2(b, a)


def test_a_band_pass_keeps_its_band_without_phase_shift():
    gain, phase = amplitude_after(2.0, (0.2, 20.0))
    assert gain == pytest.approx(1.0, abs=1e-6)
    assert phase == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("order", [2, 4])
def test_the_gain_is_butterworths_squared(order):
    """Forwards and backwards: 1/(1 + (f/fc)^(2 n)), with the bilinear warp of the frequency."""

    def warped(frequency):
        return math.tan(math.pi * frequency * STEP)

    low = 1 / (1 + (warped(0.5) / warped(1.0)) ** (2 * order))
    high = 1 / (1 + (warped(10.0) / warped(15.0)) ** (-2 * order))
    assert amplitude_after(1.0, (0.5, None), order)[0] == pytest.approx(low, rel=1e-4)
    assert amplitude_after(15.0, (None, 10.0), order)[0] == pytest.approx(high, rel=1e-4)


@pytest.mark.parametrize("corners", [(0.1, 10.0), (0.5, 20.0)])
def test_a_band_pass_takes_the_ground_to_be_at_rest_before_and_after(corners):
    """Zeros that are added by hand change nothing: those that the filter adds last long enough for its lower corner."""
    samples = np.random.default_rng(3).normal(size=2001)
    zeros = np.zeros(8000)
    short, long = (
        Motion.from_samples(values, STEP).processed(band_pass=corners).samples
        for values in (samples, np.concatenate([zeros, samples, zeros]))
    )
    assert_allclose(short, long[8000:10001], rtol=0.0, atol=1e-11 * np.abs(long).max())


def test_a_band_pass_takes_the_drift_out_of_a_record():
    record = records.load("ridgecrest-clc-090")
    done = record.processed(baseline=0, band_pass=(0.05, None))
    assert record.pgd > 1.5
    assert done.pgd < 0.25
    assert done.pga == pytest.approx(record.pga, rel=0.002)
    assert done.history == (
        "baseline of degree 0 removed",
        "band-passed 0.05-inf Hz, order 4 forwards and backwards",
    )


def test_resampling_to_a_finer_step_is_the_same_motion():
    motion = Motion.from_samples([0.0, 1.0, -2.0, 0.5, 0.0], 0.02)
    fine = motion.processed(resample=0.005)
    times = np.linspace(0.0, 0.08, 77)
    assert_allclose(fine.acceleration(times), motion.acceleration(times), atol=1e-13)
    assert fine.dt == 0.005
    assert fine.duration == pytest.approx(0.08)
    assert fine.history == ("resampled to a step of 0.005 s",)


def test_resampling_to_a_coarser_step_takes_values_up_to_the_end():
    coarse = Motion.from_samples([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 0.01).processed(resample=0.02)
    assert_allclose(coarse.samples, [0.0, 2.0, 4.0], atol=1e-14)


def test_resampling_a_pulse_makes_it_fit_for_filters():
    pulse = pulses.ricker(1.0, 1.0)
    samples = pulse.processed(resample=0.01)
    assert samples.error == 0.0
    times = samples.breakpoints
    assert_allclose(samples.acceleration(times[:-1]), pulse.acceleration(times[:-1]), atol=1e-15)
    assert samples.processed(band_pass=(0.1, 25.0)).pga == pytest.approx(1.0, rel=0.01)


def test_steps_are_taken_in_the_documented_order():
    motion = sampled(lambda t: np.sin(5.0 * t) + 0.1 * t)
    together = motion.processed(resample=0.02, band_pass=(0.1, 20.0), baseline=1, trim=(3.0, 33.0))
    one_by_one = motion.processed(trim=(3.0, 33.0)).processed(baseline=1)
    one_by_one = one_by_one.processed(band_pass=(0.1, 20.0)).processed(resample=0.02)
    assert_array_equal(together.coefficients, one_by_one.coefficients)
    assert together.history == one_by_one.history
    assert [step.split()[0] for step in together.history] == ["trimmed", "baseline", "band-passed", "resampled"]
    assert together.description.family == "processed samples"


def test_processing_leaves_the_motion_itself_alone():
    motion = sampled(np.sin)
    before = motion.coefficients.copy()
    motion.processed(trim=(1.0, 2.0), baseline=0)
    assert_array_equal(motion.coefficients, before)
    assert motion.history == ()


# With a vertical component


def test_a_part_after_the_vertical_component_has_none() -> None:
    motion = wave(3.0, 1).with_vertical(wave(2.0, 2, count=100))
    assert motion.processed(trim=(1.0, 3.0)).vertical.duration == pytest.approx(1.0)
    assert motion.processed(trim=(2.5, 3.0)).vertical is None


@pytest.mark.parametrize(
    ("fine", "coarse"), [(0.01, 0.02), (0.01, 0.03), (0.02, 0.01), (0.005, 0.0078125), (0.01, 0.01)]
)
@pytest.mark.parametrize("trim", [(0.11, 1.53), (0.213, 0.233), (1.0, 1.5), (0.0, 4.0), (3.0, 3.99)])
def test_components_are_cut_at_the_same_instants_whatever_their_steps(
    fine: float, coarse: float, trim: tuple[float, float]
) -> None:
    push, lift = wave(3.0, 1, dt=fine, count=round(4.5 / fine)), wave(2.0, 2, dt=coarse, count=201)
    part = push.with_vertical(lift).processed(trim=trim)
    start = push.processed(trim=trim).history[-1].split()[-2].split("-")[0]
    times = np.linspace(0.0, part.duration, 1001)[1:-1]
    inside = times < part.vertical.duration if part.vertical is not None else times < 0.0
    assert part.acceleration(times) == pytest.approx(push.acceleration(times + float(start)), abs=1e-9)
    if part.vertical is None:
        assert float(start) >= lift.duration
        return
    expected = lift.acceleration(times[inside] + float(start))
    assert part.vertical.acceleration(times[inside]) == pytest.approx(expected, abs=1e-9)
    assert part.vertical.duration == pytest.approx(min(part.duration, lift.duration - float(start)), abs=1e-12)


def test_a_vertical_component_whose_samples_are_at_both_ends_stays_even_and_can_be_filtered() -> None:
    push, lift = wave(3.0, 1, dt=0.01, count=401), wave(2.0, 2, dt=0.04, count=101)
    part = push.with_vertical(lift).processed(trim=(0.2, 3.6), band_pass=(0.5, 10.0))
    assert (part.dt, part.vertical.dt) == (0.01, 0.04)
    pulse = pulses.ricker(1.0, 1.0)
    both = pulse.with_vertical(lift).processed(trim=(0.5123, 0.5321))
    assert both.vertical.acceleration(0.01) == pytest.approx(lift.acceleration(0.5223), abs=1e-12)
    both = push.with_vertical(pulse).processed(trim=(0.51, 1.53))
    assert both.vertical.acceleration(0.345) == pytest.approx(pulse.acceleration(0.855), abs=1e-12)


def test_a_part_of_less_than_two_samples_is_refused_with_what_was_given():
    motion = Motion.from_samples(np.sin(np.arange(100)), 0.01)
    with pytest.raises(MotionError, match=r"trim must keep at least two samples, 0.01 s apart") as refused:
        motion.processed(trim=(0.301, 0.304))
    assert (refused.value.argument, refused.value.value) == ("trim", (0.301, 0.304))


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        *(
            {"trim": each}
            for each in (5.0, (1.0, 2.0, 3.0), (5.0, 5.0), (-1.0, 5.0), (1.0, 50.0), (math.nan, 5.0), "ab")
        ),
        *({"baseline": each} for each in (-1, 1.5, 11)),
        *({"band_pass": each} for each in (10.0, (None, None), (2.0, 1.0), (1.0, 1.0), (0.1, 50.0), (0.0, 10.0))),
        *({"band_pass": each} for each in ((1e-9, 10.0), (0.1, math.nan))),
        *({"band_pass": (0.1, 10.0), "order": each} for each in (0, 2.5)),
        *({"resample": each} for each in (0.0, math.inf, 100.0, 1e-9)),
        {"resample": 0.02, "order": 2},
    ],
)
def test_unusable_arguments_are_refused(arguments):
    with pytest.raises(MotionError):
        sampled(np.sin).processed(**arguments)


@pytest.mark.parametrize("arguments", [{"baseline": 0}, {"band_pass": (0.1, 10.0)}])
def test_filters_ask_for_even_samples(arguments):
    with pytest.raises(MotionError, match="resample"):
        pulses.ricker(1.0, 1.0).processed(**arguments)


def test_a_coarser_vertical_component_stays_even_when_it_is_trimmed_between_its_samples():
    rng = np.random.default_rng(3)
    horizontal = Motion.from_samples(rng.normal(size=401), 0.005)
    motion = horizontal.with_vertical(Motion.from_samples(rng.normal(size=201), 0.01))
    found = motion.processed(trim=(0.105, 1.5), baseline=1)
    assert found.vertical.dt == found.dt == 0.005
