"""Intensity measures against closed forms, rational arithmetic and independent oscillators."""

import math
import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp
from scipy import linalg
from scipy.integrate import solve_ivp

from rocking import pulses, records
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import MotionError
from rocking.motion.motion import Motion

samples = st.lists(st.floats(-10.0, 10.0).map(lambda x: round(x, 3)), min_size=2, max_size=25)


def rational_integrals(motion):
    """Integrals of the squared and of the absolute acceleration of a piecewise linear motion, exactly."""
    squared = absolute = Fraction(0)
    breakpoints = [Fraction(b) for b in motion.breakpoints.tolist()]
    for start, end, (a, slope) in zip(breakpoints, breakpoints[1:], motion.coefficients.tolist(), strict=False):
        width, a = end - start, Fraction(a)
        b = a + Fraction(slope) * width
        squared += width * (a * a + a * b + b * b) / 3
        absolute += width * (abs(a + b) / 2 if a * b >= 0 else (a * a + b * b) / (2 * abs(a - b)))
    return squared, absolute


@settings(deadline=None)
@given(samples, st.floats(0.005, 0.5))
def test_integrals_of_a_record_are_exact(values, dt):
    motion = Motion.from_samples(values, dt)
    squared, absolute = rational_integrals(motion)
    assert motion.arias_intensity == pytest.approx(math.pi / (2 * STANDARD_GRAVITY) * float(squared), rel=1e-14)
    assert motion.cumulative_absolute_velocity == pytest.approx(float(absolute), rel=1e-13, abs=1e-15)


def test_integrals_of_a_sine_are_known():
    motion = pulses.sine(2.0, 0.8, cycles=3.5, phase=0.3)
    duration = 3.5 / 0.8
    mean_square = 2.0 * duration - (math.sin(2 * (7 * math.pi + 0.3)) - math.sin(0.6)) / (2 * math.pi * 0.8) * 0.5 * 2
    assert motion.arias_intensity == pytest.approx(math.pi / (2 * STANDARD_GRAVITY) * mean_square, rel=1e-14)
    # Each half cycle has area 2 A / omega, wherever it starts.
    assert motion.cumulative_absolute_velocity == pytest.approx(7 * 4.0 / (2 * math.pi * 0.8), rel=1e-14)


def test_significant_duration_of_a_constant_is_its_fraction():
    motion = pulses.rectangular(3.0, 10.0)
    assert motion.significant_duration(0.05, 0.75) == pytest.approx(7.0, rel=1e-14)
    assert motion.significant_duration() == pytest.approx(9.0, rel=1e-14)
    assert motion.significant_duration(0.0, 1.0) == pytest.approx(10.0, rel=1e-14)


@pytest.mark.thorough
@settings(deadline=None, max_examples=20)
@given(samples, st.floats(0.05, 0.4), st.floats(0.5, 0.95))
def test_significant_duration_holds_its_share_of_the_energy(values, start, end):
    even = Motion.from_samples(values, 0.1)
    # Rest of an uneven length: without a step, trim cuts between samples.
    motion = Motion(np.append(even.breakpoints, even.duration + 0.05), np.vstack([even.coefficients, np.zeros(2)]))
    whole = motion.arias_intensity
    assume(whole > 1e-9)
    first, last = motion.significant_duration(0.0, start), motion.significant_duration(0.0, end)
    assert motion.significant_duration(start, end) == pytest.approx(last - first, rel=1e-12, abs=1e-14)
    for time, fraction in ((first, start), (last, end)):
        assert motion.processed(trim=(0.0, time)).arias_intensity == pytest.approx(fraction * whole, rel=1e-12)


def exact_linear_response(motion, period, damping, per_step=1):
    """Displacement of the oscillator at the samples of a piecewise linear motion, by matrix exponentials."""
    omega, h = 2 * math.pi / period, motion.dt / per_step
    # State (u, v, a, slope of a): u' = v, v' = -omega^2 u - 2 z omega v - a, a' = slope.
    rates = np.zeros((4, 4))
    rates[0, 1] = rates[2, 3] = 1.0
    rates[1] = [-(omega**2), -2 * damping * omega, -1.0, 0.0]
    step = linalg.expm(rates * h)
    state, history = np.zeros(4), [0.0]
    for a, slope in motion.coefficients:
        state[2:] = a, slope
        for _ in range(per_step):
            state = step @ state
            history.append(state[0])
    return np.array(history)


@pytest.mark.thorough
@pytest.mark.parametrize("period", [0.05, 0.3, 1.0, 4.0])
def test_spectral_acceleration_of_a_record_is_the_exact_recurrence(period):
    motion = records.load("el-centro-meloland-270")
    omega = 2 * math.pi / period
    coarse = np.abs(exact_linear_response(motion, period, 0.05)).max() * omega**2
    fine = np.abs(exact_linear_response(motion, period, 0.05, per_step=64)).max() * omega**2
    spectral = motion.spectral_acceleration(period)
    assert coarse <= spectral * (1 + 1e-11)
    assert fine <= spectral * (1 + 1e-11)
    # Between points h apart a maximum stands out by (omega h)^2 / 8, relatively, where the motion is the restoring one.
    assert spectral <= fine * (1 + (omega * motion.dt / 64) ** 2 / 4 + 1e-11)


def test_spectral_acceleration_of_a_pulse_agrees_with_an_ode_solver():
    motion = pulses.ricker(2.0, 0.8)
    period, damping = 0.9, 0.03
    omega = 2 * math.pi / period

    def rates(t, state):
        return [state[1], -(omega**2) * state[0] - 2 * damping * omega * state[1] - motion.acceleration(t)]

    times = np.linspace(0.0, motion.duration + period, 40_001)
    solution = solve_ivp(rates, (0.0, times[-1]), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-14, max_step=0.05)
    peak = omega**2 * np.abs(solution.y[0]).max()
    assert motion.spectral_acceleration(period, damping) == pytest.approx(peak, rel=1e-6)


@pytest.mark.parametrize("ratio", [0.4, 1.3, 2.0, 5.0])
def test_the_undamped_shock_spectrum_of_a_half_sine_is_known(ratio):
    """Period over duration of the pulse; beyond 2 the peak comes after the pulse (Chopra, Dynamics of Structures)."""
    duration, period = 0.5, 0.5 * ratio
    motion = pulses.half_sine(1.0, 1.0 / (2 * duration))
    x = period / duration  # T/t_d
    if x > 2.0:
        expected = (x / (1 - x**2 / 4)) * math.cos(math.pi / x)
    elif x == 2.0:
        expected = math.pi / 2
    else:
        orders = range(1, 1 + int(1 / x + 0.5))
        times = [2 * k * math.pi * duration / (math.pi * (1 + 2 / x)) for k in orders]
        expected = max(
            abs(
                1 / (1 - (x / 2) ** 2) * (math.sin(math.pi * t / duration) - x / 2 * math.sin(2 * math.pi * t / period))
            )
            for t in times
        )
    assert motion.spectral_acceleration(period, 0.0) == pytest.approx(abs(expected), rel=1e-9)


def test_a_step_doubles_the_static_response():
    assert pulses.rectangular(1.5, 5.0).spectral_acceleration(1.0, 0.0) == pytest.approx(3.0, rel=1e-13)


def test_stiff_and_soft_oscillators_have_the_known_limits():
    motion = records.load("el-centro-meloland-270")
    assert motion.spectral_acceleration(0.005) == pytest.approx(motion.pga, rel=0.02)
    # A very soft oscillator stays where it is while the ground moves.
    pulse = pulses.ricker(1.0, 1.0)
    period = 2000.0
    assert pulse.spectral_acceleration(period, 0.0) * (period / (2 * math.pi)) ** 2 == pytest.approx(
        pulse.pgd, rel=1e-4
    )


def displacements(row, width, period, damping):
    """Displacements (m) under a polynomial from rest and after it, to 40 digits: extrema, and that at its end."""
    w, z = 2 * mp.pi / mp.mpf(period), mp.mpf(damping)
    row = [mp.mpf(each) for each in row]
    forced = [mp.mpf(0)] * (len(row) + 2)
    for k in reversed(range(len(row))):
        forced[k] = -(row[k] + (k + 1) * 2 * z * w * forced[k + 1] + (k + 1) * (k + 2) * forced[k + 2]) / w**2
    root = w * mp.sqrt(1 - z**2)

    def free(u, v, t):
        fall = mp.exp(-z * w * t)
        by_sine = (v + z * w * u) / root
        u_t = fall * (u * mp.cos(root * t) + by_sine * mp.sin(root * t))
        return u_t, fall * (by_sine * root * mp.cos(root * t) - u * root * mp.sin(root * t)) - z * w * u_t

    def under(t):
        u, v = free(-forced[0], -forced[1], t)
        slope = sum(k * each * t ** (k - 1) for k, each in enumerate(forced) if k)
        return u + sum(each * t**k for k, each in enumerate(forced)), v + slope

    end = under(mp.mpf(width))
    found = [end[0]]
    for course, length in ((under, mp.mpf(width)), (lambda t: free(*end, t), mp.pi / root)):
        times = [length * k / 400 for k in range(1, 401)]
        speeds = [course(t)[1] for t in times]
        for k in range(399):
            if speeds[k] * speeds[k + 1] <= 0:
                at = mp.findroot(lambda t: course(t)[1], (times[k], times[k + 1]), solver="anderson", verify=False)  # noqa: B023
                found.append(course(at)[0])
    return found


@pytest.mark.parametrize("count", [6, pytest.param(24, marks=pytest.mark.thorough)])
def test_no_extremum_within_a_step_is_missed(count):
    """Neither where the velocity vanishes at an end of a step, nor where it changes its sign twice in one."""
    rng = np.random.default_rng(11)
    cases = [([-2.0, 12.0, -12.0], 1.0, 100.0, 0.05), ([-2.0, 12.0, -12.0], 1.0, 1000.0, 0.0)]
    for _ in range(count):
        row = rng.normal(size=rng.integers(3, 7)) * 4.0 ** rng.integers(0, 3)
        cases.append((list(row), rng.uniform(0.1, 2.0), 10 ** rng.uniform(0.5, 3.0), rng.choice([0.0, 0.05, 0.7])))
    with mp.workdps(40):
        for row, width, period, damping in cases:
            peak = max(abs(u) for u in displacements(row, width, period, damping))
            expected = float((2 * mp.pi / mp.mpf(period)) ** 2 * peak)
            assert Motion([0.0, width], [row]).spectral_acceleration(period, damping) == pytest.approx(
                expected, rel=1e-12
            )


def test_spectral_acceleration_takes_many_periods():
    motion = pulses.one_sine(1.0, 1.0)
    spectrum = motion.spectral_acceleration([[0.5, 1.0]])
    assert spectrum.shape == (1, 2)
    assert spectrum[0, 1] == motion.spectral_acceleration(1.0)


def test_measures_name_their_units():
    motion = pulses.one_sine(1.0, 1.0)
    table = motion.measures([0.5])
    assert list(table) == [
        "duration_s",
        "pga_m_s2",
        "pgv_m_s",
        "pgd_m",
        "arias_intensity_m_s",
        "cumulative_absolute_velocity_m_s",
        "significant_duration_5_75_s",
        "significant_duration_5_95_s",
        "spectral_acceleration_0.5s_m_s2",
    ]
    assert table["pga_m_s2"] == motion.pga
    assert table["significant_duration_5_75_s"] == motion.significant_duration(0.05, 0.75)
    assert table["spectral_acceleration_0.5s_m_s2"] == motion.spectral_acceleration(0.5)


def test_the_oscillator_kernel_works_uncompiled():
    code = "from rocking import pulses; print(repr(pulses.one_sine(1.0, 1.0).spectral_acceleration(0.7)))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert float(done.stdout) == pytest.approx(pulses.one_sine(1.0, 1.0).spectral_acceleration(0.7), rel=1e-14)


def test_the_longest_period_is_a_million_durations():
    samples = np.zeros(1001)
    samples[400:600] = np.sin(np.linspace(0.0, 2.0 * np.pi, 200)) * 3.0
    motion = Motion.from_samples(samples, 0.01)
    # The mass of a soft oscillator stays where it is: it moves by the displacement of the ground, or farther after it.
    w = 2.0 * np.pi / 0.9e7
    assert motion.spectral_acceleration(0.9e7, 0.0) >= w * w * motion.pgd * (1.0 - 1e-6) > 0.0
    with pytest.raises(MotionError, match="one million times the duration, 10 s, gives only the displacement"):
        motion.spectral_acceleration(1.1e7)


@pytest.mark.parametrize("fractions", [(0.5, 0.5), (-0.1, 0.5), (0.5, 1.1), (math.nan, 0.5)])
def test_unusable_fractions_are_refused(fractions):
    assert math.isnan(pulses.rectangular(0.0, 1.0).significant_duration())
    with pytest.raises(MotionError):
        pulses.rectangular(1.0, 1.0).significant_duration(*fractions)


@pytest.mark.parametrize("oscillator", [(0.0, 0.05), (math.nan, 0.05), (1e-9, 0.05), (1.0, 1.0), (1.0, -0.1)])
def test_unusable_oscillators_are_refused(oscillator):
    with pytest.raises(MotionError):
        pulses.one_sine(1.0, 1.0).spectral_acceleration(*oscillator)
