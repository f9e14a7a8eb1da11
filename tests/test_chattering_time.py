"""The exact chattering time: against references, 120 digits, another path, and itself."""

import numpy as np
import pytest
from oracles.sine_chattering import rest_time

from rocking import chattering
from rocking.kernels.sine import SequenceStatus
from rocking.kernels.sine.sequence import write_semianalytical_phases


def random_parameters(count, seed, spread=1.5):
    """Omega in [0.4, 10], eta in [0.5, 0.97], and amplitudes on both sides of the critical one, many close to it."""
    rng = np.random.default_rng(seed)
    eta = rng.uniform(0.5, 0.97, count)
    omega = np.exp(rng.uniform(np.log(0.4), np.log(10.0), count))
    critical = chattering.critical_amplitude(omega, eta)
    far = rng.uniform(0.0, spread, count)
    near = 1.0 + rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-6.0, -2.0, count)
    return 1.0 + (critical - 1.0) * np.where(rng.random(count) < 0.8, far, near), omega, eta


def assert_agrees(a, omega, eta):
    """The product's answer is that of 120 digits, up to what one ulp of a changes: is it complete?"""
    time = float(chattering.chattering_time(a, omega, eta))
    expected = rest_time(a, omega, eta)
    assert np.isnan(time) == (expected is None)
    if expected is None:
        return False
    error = abs(float(expected - time))
    if error > 1e-12 * time:
        assert error < abs(float(rest_time(float(np.nextafter(a, 0.0)), omega, eta) - expected))
    return True


def test_chattering_times_of_the_reference(reference):
    assert len(reference["chattering_time"]) >= 15
    for case in reference["chattering_time"]:
        time = chattering.chattering_time(case["a"], case["omega"], case["eta"])
        assert time == pytest.approx(float(case["tau"]), rel=3e-14)


def test_small_amplitudes_of_the_reference(reference):
    assert len(reference["small_epsilon_eta_092_omega_2"]) >= 8
    for case in reference["small_epsilon_eta_092_omega_2"]:
        eps = float(case["epsilon"])
        a = 1.0 + eps
        scaled = float(case["tau_times_omega_over_sqrt_epsilon"])
        # The double a is not 1 + epsilon exactly: at leading order the time follows the square root of a - 1.
        time = scaled / 2.0 * np.sqrt(eps) * np.sqrt((a - 1.0) / eps)
        assert chattering.chattering_time(a, 2.0, 0.92) == pytest.approx(
            time, rel=3e-14 + 10 * abs((a - 1.0) / eps - 1.0)
        )


def test_share_of_half_a_period_depends_on_frequency_as_known():
    omega = np.array([0.5, 1.0, 2.0, 5.0])
    share = chattering.chattering_time(1.03, omega, 0.92) * omega / np.pi
    assert share == pytest.approx([0.8068, 0.7308, 0.7168, 0.7131], abs=5e-5)


@pytest.mark.parametrize("count", [18, pytest.param(60, marks=pytest.mark.thorough)])
def test_time_and_completeness_are_those_of_120_digits(count):
    complete = sum(assert_agrees(*map(float, case)) for case in zip(*random_parameters(count, seed=3), strict=True))
    assert count / 6 <= complete <= 5 * count / 6


FAR = [(omega, eta) for eta in (0.02, 0.3) for omega in (0.08, 0.3, 30.0, 1e3)]
LONG = [(30.0, 0.985), *(pytest.param(omega, 0.985, marks=pytest.mark.slow) for omega in (0.08, 0.3, 1e3))]


@pytest.mark.cases(fast=4)
@pytest.mark.parametrize(("omega", "eta"), [*FAR, *LONG])
def test_time_is_right_far_outside_the_usual_range(omega, eta):
    critical = float(chattering.critical_amplitude(omega, eta))
    for share in (1e-7, 0.1, 0.8, 0.999, 1.001):
        assert_agrees(1.0 + (critical - 1.0) * share, omega, eta)


@pytest.mark.slow
def test_a_thousand_times_are_those_of_120_digits():
    complete = sum(assert_agrees(*map(float, case)) for case in zip(*random_parameters(1000, seed=4), strict=True))
    assert 200 <= complete <= 800


@pytest.mark.parametrize("count", [5_000, pytest.param(30_000, marks=pytest.mark.thorough)])
def test_verdicts_agree_with_the_semianalytical_scheme(count):
    a, omega, eta = random_parameters(count, seed=1)
    exact = chattering.chattering_time(a, omega, eta)
    phases, statuses = np.zeros(a.size), np.zeros(a.size, np.int8)
    write_semianalytical_phases((a, omega, eta), np.full(a.size, 1000), phases, statuses)
    resolved = np.where(statuses == SequenceStatus.FOUND, phases / omega, np.nan)
    both = np.isfinite(exact) & np.isfinite(resolved)
    assert both.mean() > 0.5
    differ = np.flatnonzero(np.isnan(exact) != np.isnan(resolved))
    assert np.abs(a[differ] - chattering.critical_amplitude(omega[differ], eta[differ])).max(initial=0.0) < 1e-9
    assert np.abs(exact[both] / resolved[both] - 1.0).max() < 1e-8


@pytest.mark.parametrize("resolved", [None, 5, 60])
@pytest.mark.parametrize("eta", [0.5, 0.92, 0.99])
def test_the_semianalytical_time_is_nan_where_chattering_is_incomplete_and_only_there(eta, resolved):
    omega = np.array([0.5, 2.0, 8.0])
    critical = chattering.critical_amplitude(omega, eta)
    for share in (-1e-2, -1e-5, -1e-8, 1e-8, 1e-5, 1e-2):
        a = critical + share * (critical - 1.0)
        times = chattering.chattering_time(a, omega, eta, method="semianalytical", impact_count=resolved)
        np.testing.assert_array_equal(np.isnan(times), [share > 0.0] * 3)


def test_near_restitution_one_the_semianalytical_scheme_resolves_more_impacts():
    a = 1.0 + 0.5 * (chattering.critical_amplitude(2.0, 0.99) - 1.0)
    exact = float(chattering.chattering_time(a, 2.0, 0.99))
    by_default, by_sixty = (
        float(chattering.chattering_time(a, 2.0, 0.99, method="semianalytical", impact_count=n)) for n in (None, 60)
    )
    assert abs(by_default / exact - 1.0) < 1e-4 < 0.04 < abs(by_sixty / exact - 1.0)


def test_semianalytical_scheme_converges_like_the_square_of_what_remains():
    exact = chattering.chattering_time(1.03, 2.0, 0.92)
    resolved = np.array([40, 60, 80, 100])
    times = np.array(
        [chattering.chattering_time(1.03, 2.0, 0.92, method="semianalytical", impact_count=int(n)) for n in resolved]
    )
    rates = np.diff(np.log(np.abs(times - exact))) / np.diff(resolved)
    assert rates == pytest.approx(2.0 * np.log(0.92), rel=0.1)


def test_edges_of_the_definition():
    times = chattering.chattering_time([0.5, 1.0, 1.03, 1.05, 1e300], 2.0, 0.92)
    assert np.isnan(times[[0, 3, 4]]).all() and times[1] == 0.0 and times[2] > 0.0
    assert np.isnan(chattering.chattering_time(1.001, 2.0, 1.0))
    assert chattering.chattering_time(1.0, 2.0, 1.0) == 0.0
    assert chattering.is_complete([0.9, 1.0, 1.03, 1.05], 2.0, 0.92).tolist() == [False, True, True, False]


@pytest.mark.parametrize("method", ["exact", "asymptotic", "series", "semianalytical"])
def test_every_method_broadcasts_and_knows_the_ends(method):
    a = np.array([0.9, 1.0, 1.01])[:, None, None]
    omega = np.array([1.0, 2.0])[:, None]
    eta = np.array([0.8, 0.9, 0.92, 0.95])
    times = chattering.chattering_time(a, omega, eta, method=method)
    assert times.shape == (3, 2, 4)
    assert np.isnan(times[0]).all() and (times[1] == 0.0).all()
    single = chattering.chattering_time(1.01, 2.0, 0.92, method=method)
    assert np.ndim(single) == 0 and single == pytest.approx(times[2, 1, 2], rel=1e-14)
