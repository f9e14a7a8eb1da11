"""Analytic pulses: their published formulas, in 40 digits, and what is known in closed form."""

import functools
import math
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from rocking import pulses
from rocking.errors import MotionError


@pytest.fixture(autouse=True, scope="module")
def forty_digits():
    with mp.workdps(40):
        yield


def sine_formula(amplitude, frequency, phase):
    return lambda t: amplitude * mp.sin(2 * mp.pi * mp.mpf(frequency) * t + mp.mpf(phase))


def symmetric_ricker_formula(amplitude, frequency, middle):
    def formula(t):
        s = (mp.pi * mp.mpf(frequency) * (t - middle)) ** 2
        return amplitude * (1 - 2 * s) * mp.exp(-s)

    return formula


def antisymmetric_ricker_formula(amplitude, frequency, middle):
    """Vassiliou and Makris (2011), with T_p = 1/frequency; beta makes the peak equal to the amplitude."""

    def shape(t):
        f = mp.mpf(frequency)
        exponent = -(4 * mp.pi**2 * f**2 * t**2) / 6
        return (4 * mp.pi**2 * f**2 * t**2 / 3 - 3) * (2 * mp.pi * f * t / mp.sqrt(3)) * mp.exp(exponent)

    def formula(t):
        beta = shape(-mp.sqrt(9 - 3 * mp.sqrt(6)) / (2 * mp.pi * mp.mpf(frequency)))
        return amplitude * shape(t - middle) / beta

    return formula


def test_beta_of_the_antisymmetric_ricker_pulse_is_the_published_one():
    # At its centre the pulse falls with slope 3 (2 pi f / sqrt 3) amplitude / beta; beta = 1.38.
    slope = mp.diff(antisymmetric_ricker_formula(1, 1, 0), 0)
    assert abs(-2 * mp.pi * mp.sqrt(3) / slope - mp.mpf("1.3801")) < 5e-5


def near_fault_velocity(amplitude, frequency, phase, gamma):
    """Mavroeidis and Papageorgiou (2003), Eq. 3."""

    def formula(t):
        s, f, g = t - mp.mpf(gamma) / (2 * mp.mpf(frequency)), mp.mpf(frequency), mp.mpf(gamma)
        return amplitude / mp.mpf(2) * (1 + mp.cos(2 * mp.pi * f / g * s)) * mp.cos(2 * mp.pi * f * s + mp.mpf(phase))

    return formula


def near_fault_formula(amplitude, frequency, phase, gamma):
    """Mavroeidis and Papageorgiou (2003), Eq. 4."""

    def formula(t):
        f, g, nu = mp.mpf(frequency), mp.mpf(gamma), mp.mpf(phase)
        s = t - g / (2 * f)
        slow, fast = 2 * mp.pi * f / g * s, 2 * mp.pi * f * s + nu
        bracket = mp.sin(slow) * mp.cos(fast) + g * mp.sin(fast) * (1 + mp.cos(slow))
        return -amplitude * mp.pi * f / g * bracket

    return formula


def worst_error(motion, formula, most_pieces):
    """Largest difference of the pieces, evaluated exactly, from a formula."""
    pieces = np.unique(np.linspace(0, len(motion.coefficients) - 1, most_pieces).astype(int))
    worst = mp.mpf(0)
    for k in pieces:
        start, end = (mp.mpf(float(b)) for b in motion.breakpoints[k : k + 2])
        highest_first = [mp.mpf(float(c)) for c in motion.coefficients[k, ::-1]]
        for i in range(7):
            x = (end - start) * i / 6
            value = functools.reduce(lambda total, c, x=x: total * x + c, highest_first)
            worst = max(worst, abs(value - formula(start + x)))
    return worst


CASES = {
    "sine": (pulses.sine(2.0, 1.3, cycles=7.3, phase=0.4), sine_formula(2, 1.3, 0.4)),
    "long sine": (pulses.sine(1.0, 0.7, cycles=5000, phase=3.0), sine_formula(1, 0.7, 3.0)),
    "sine of a large phase": (pulses.sine(1.0, 2.0, cycles=1, phase=1e6), sine_formula(1, 2.0, 1e6)),
    "slow sine": (pulses.sine(1.0, 1e-4, cycles=2), sine_formula(1, 1e-4, 0.0)),
    "half sine": (pulses.half_sine(3.0, 0.9), sine_formula(3, 0.9, 0.0)),
    "one-sine": (pulses.one_sine(3.0, 0.9), sine_formula(3, 0.9, 0.0)),
    "one-cosine": (pulses.one_cosine(3.0, 0.9), sine_formula(3, 0.9, math.pi / 2)),
}
for _f in (0.31, 4.0):
    _m = pulses.ricker(2.0, _f)
    CASES[f"symmetric Ricker, {_f} Hz"] = (_m, symmetric_ricker_formula(2, _f, mp.mpf(_m.duration) / 2))
    _m = pulses.ricker(2.0, _f, kind="antisymmetric")
    CASES[f"antisymmetric Ricker, {_f} Hz"] = (_m, antisymmetric_ricker_formula(2, _f, mp.mpf(_m.duration) / 2))
for _arguments in ((0.8, 0.5, 0.0, 1.0), (1.0, 1.3, 0.4, 2.3), (1.0, 0.37, math.pi / 2, 3.0), (1.0, 3.0, 5.0, 41.7)):
    _a, _f, _nu, _g = _arguments
    CASES[f"Mavroeidis-Papageorgiou {_arguments}"] = (
        pulses.mavroeidis_papageorgiou(_a, _f, phase=_nu, gamma=_g),
        near_fault_formula(*_arguments),
    )


@pytest.mark.parametrize("most_pieces", [12, pytest.param(60, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("case", CASES)
def test_pieces_follow_the_formula_within_the_stated_error(case, most_pieces):
    motion, formula = CASES[case]
    assert worst_error(motion, formula, most_pieces) <= 0.5 * motion.error
    assert motion.error <= 1.2e-15 * motion.pga
    assert motion.coefficients.shape[1] <= 16


def test_no_pulse_is_without_a_test_of_its_formula():
    text = Path(__file__).read_text("utf-8")
    assert {name for name in pulses.__all__ if f"pulses.{name}(" not in text} == set()
    assert len(pulses.__all__) >= 9


@settings(deadline=None, max_examples=30)
@given(
    st.floats(1e-3, 1e3), st.floats(1e-3, 1e2), st.floats(1e-3, 300.0), st.floats(-100.0, 100.0)
)  # fmt: skip
def test_any_sine_follows_its_formula(amplitude, frequency, cycles, phase):
    motion = pulses.sine(amplitude, frequency, cycles=cycles, phase=phase)
    assert worst_error(motion, sine_formula(amplitude, frequency, phase), 8) <= 0.5e-15 * amplitude
    assert motion.error == 1e-15 * amplitude  # however little of it the cut leaves
    assert motion.duration == cycles / frequency


@pytest.mark.parametrize("arguments", [(0.8, 0.5, 0.0, 1.0), (1.0, 1.3, 0.4, 2.3), (0.5, 0.37, math.pi / 2, 3.0)])
def test_the_near_fault_motion_has_the_published_velocity(arguments):
    amplitude, frequency, phase, gamma = arguments
    motion = pulses.mavroeidis_papageorgiou(amplitude, frequency, phase=phase, gamma=gamma)
    velocity = near_fault_velocity(*arguments)
    for t in np.linspace(0.0, motion.duration, 23):
        assert abs(motion.velocity(float(t)) - velocity(mp.mpf(float(t)))) <= 2e-15 * amplitude


def test_peaks_known_in_closed_form():
    assert pulses.half_sine(3.0, 0.5).pgv == pytest.approx(6.0 / math.pi, rel=1e-15)
    assert pulses.one_sine(3.0, 0.5).pgd == pytest.approx(6.0 / math.pi, rel=1e-15)
    assert pulses.one_cosine(3.0, 0.5).pgv == pytest.approx(3.0 / math.pi, rel=1e-15)
    # A Ricker pulse is the second derivative of a Gaussian: its displacement is amplitude / (2 pi^2 f^2).
    assert pulses.ricker(3.0, 0.5).pgd == pytest.approx(3.0 / (2 * math.pi**2 * 0.25), rel=1e-14)
    assert pulses.ricker(3.0, 0.5, kind="antisymmetric").pga == pytest.approx(3.0, rel=1e-15)
    assert pulses.rectangular(3.0, 0.5).pgd == 0.375
    assert pulses.triangular(3.0, 0.5).pgd == 0.1875


@pytest.mark.parametrize(
    "motion",
    [
        pulses.one_sine(1.0, 0.3),
        pulses.one_cosine(1.0, 0.3),
        pulses.ricker(1.0, 0.3),
        pulses.ricker(1.0, 0.3, kind="antisymmetric"),
        pulses.mavroeidis_papageorgiou(1.0, 0.3, phase=1.0, gamma=2.7),
    ],
    ids=lambda motion: motion.name,
)
def test_pulses_that_leave_the_ground_at_rest(motion):
    assert abs(motion.velocity(motion.duration)) <= 1e-15 * motion.pga / 0.3


@pytest.mark.parametrize("case", CASES)
def test_pieces_join(case):
    motion = CASES[case][0]
    before = [
        np.polynomial.polynomial.polyval(w, c)
        for w, c in zip(np.diff(motion.breakpoints), motion.coefficients, strict=True)
    ]
    assert np.abs(motion.coefficients[1:, 0] - before[:-1]).max() <= 2 * motion.error


def test_a_ricker_pulse_ends_where_it_has_vanished():
    for kind in ("symmetric", "antisymmetric"):
        motion = pulses.ricker(1.0, 2.0, kind=kind)
        assert 1e-18 < abs(motion.acceleration(0.0)) < 1e-16
        assert 1e-18 < abs(motion.acceleration(motion.duration)) < 1e-16


def test_a_cut_ricker_pulse_is_the_middle_of_the_whole_one():
    whole, cut = pulses.ricker(1.0, 1.0), pulses.ricker(1.0, 1.0, duration=2.0)
    times = np.linspace(0.0, 2.0, 101)
    assert_allclose(cut.acceleration(times), whole.acceleration(times - 1.0 + 0.5 * whole.duration), atol=1e-14)


def test_ricker_pulses_are_even_and_odd_about_their_middle():
    x = np.linspace(0.0, 2.0, 50)
    for kind, sign in (("symmetric", 1.0), ("antisymmetric", -1.0)):
        motion = pulses.ricker(1.0, 1.0, kind=kind)
        middle = 0.5 * motion.duration
        assert_allclose(motion.acceleration(middle + x), sign * motion.acceleration(middle - x), atol=2e-15)


def test_equal_lobes_are_a_sine():
    lobes, sine = pulses.n_lobe(2.0, 0.7, lobes=5), pulses.sine(2.0, 0.7, cycles=2.5)
    times = np.linspace(0.0, sine.duration, 200)
    assert_allclose(lobes.acceleration(times), sine.acceleration(times), atol=4e-15)
    assert lobes.description.parameters == {"amplitude": 2.0, "frequency": 0.7, "lobes": 5}


def test_unequal_lobes_have_their_own_amplitudes():
    amplitudes = [1.0, 0.0, 2.5, -0.5]
    motion = pulses.n_lobe(amplitudes, 0.5)
    middles = np.arange(4) + 0.5
    assert_allclose(motion.acceleration(middles), [1.0, 0.0, 2.5, 0.5], atol=1e-15)
    assert_allclose(motion.velocity(4.0), 2.0 / math.pi * (1.0 + 2.5 + 0.5), rtol=1e-15)
    assert motion.description.scaled(2.0).parameters["amplitude_2"] == 5.0
    assert motion.error == pytest.approx(2.5e-15)


def test_rectangles_and_triangles_are_exact():
    motion = pulses.rectangular(1.5, 2.0)
    assert_array_equal(motion.acceleration([0.0, 1.0, 2.0, 2.1]), [1.5, 1.5, 1.5, 0.0])
    assert motion.error == 0.0
    motion = pulses.triangular(1.5, 2.0)
    assert_array_equal(motion.acceleration([0.0, 0.5, 1.0, 1.5, 2.0]), [0.0, 0.75, 1.5, 0.75, 0.0])


def test_a_sine_keeps_what_it_was_made_of():
    motion = pulses.sine(2.0, 1.5, cycles=2.0, phase=0.25)
    assert motion.description.family == "sine"
    assert motion.description.parameters == {"amplitude": 2.0, "frequency": 1.5, "cycles": 2.0, "phase": 0.25}
    assert motion.history == ()


@pytest.mark.parametrize(
    ("pulse", "given"),
    [
        *((pulses.sine, {"amplitude": each, "frequency": 1.0, "cycles": 1}) for each in (np.nan, "1 g")),
        *((pulses.sine, {"amplitude": 1.0, "frequency": each, "cycles": 1}) for each in (0.0, -1.0, 1e-13, 1e300)),
        *((pulses.sine, {"amplitude": 1.0, "frequency": 1.0, "cycles": each}) for each in (0, 1e9)),
        (pulses.sine, {"amplitude": 1.0, "frequency": 1.0, "cycles": 1, "phase": np.inf}),
        (pulses.half_sine, {"amplitude": np.inf, "frequency": 1.0}),
        *((pulses.n_lobe, {"amplitude": 1.0, "frequency": 1.0, "lobes": each}) for each in (None, 0, 2.5)),
        *((pulses.n_lobe, {"amplitude": each, "frequency": 1.0}) for each in ([], [[1.0]], [1.0, np.nan])),
        (pulses.n_lobe, {"amplitude": [1.0, 2.0], "frequency": 1.0, "lobes": 3}),
        (pulses.ricker, {"amplitude": 1.0, "frequency": 1.0, "kind": "third"}),
        *((pulses.ricker, {"amplitude": 1.0, "frequency": 1.0, "duration": each}) for each in (0.0, 100.0)),
        *(
            (pulses.mavroeidis_papageorgiou, {"amplitude": 1.0, "frequency": 1.0, "phase": phase, "gamma": gamma})
            for phase, gamma in ((0.0, 0.9), (0.0, 1e9), (np.nan, 2.0))
        ),
        (pulses.rectangular, {"amplitude": 1.0, "duration": 0.0}),
        (pulses.triangular, {"amplitude": np.nan, "duration": 1.0}),
    ],
)
def test_unusable_parameters_are_refused(pulse, given):
    with pytest.raises(MotionError):
        pulse(**given)
