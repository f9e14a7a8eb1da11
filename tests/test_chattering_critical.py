"""The critical amplitude: exact, with 120 digits on both sides, and the paper's fits."""

import numpy as np
import pytest
from oracles.sine_chattering import rest_time

from rocking import chattering


def test_critical_amplitudes_of_the_reference(reference):
    assert len(reference["critical_amplitude"]) >= 3
    for case in reference["critical_amplitude"]:
        assert chattering.critical_amplitude(case["omega"], case["eta"]) == pytest.approx(case["value"], abs=1e-13)


LONG = [pytest.param(omega, 0.975, marks=pytest.mark.thorough) for omega in (0.3, 2.0, 30.0)]


@pytest.mark.cases(fast=3, thorough=7)
@pytest.mark.parametrize(
    ("omega", "eta"), [*((omega, eta) for eta in (0.1, 0.5, 0.92) for omega in (0.3, 2.0, 30.0)), *LONG]
)
def test_both_sides_of_the_critical_amplitude_are_those_of_120_digits(omega, eta):
    critical = float(chattering.critical_amplitude(omega, eta))
    assert rest_time(critical - 1e-13, omega, eta) is not None
    assert rest_time(critical + 1e-13, omega, eta) is None


def test_completeness_is_lost_once_and_for_all():
    """So that the supremum of complete amplitudes is the boundary that root finding meets."""
    rng = np.random.default_rng(0)
    omega = 10.0 ** rng.uniform(-1.0, 2.0, (400, 1))
    eta = rng.uniform(0.02, 0.98, (400, 1))
    critical = chattering.critical_amplitude(omega, eta)
    share = np.concatenate([rng.uniform(0.0, 2.0, (400, 30)), 1.0 + np.outer(np.ones(400), [-1e-9, 1e-9])], axis=1)
    complete = chattering.is_complete(1.0 + (critical - 1.0) * share, omega, eta)
    assert (complete == (share < 1.0)).all()
    assert not chattering.is_complete(np.linspace(1.37, 30.0, 500), omega[:50], eta[:50]).any()


@pytest.mark.parametrize(("eta", "exponent"), [(0.92, 0.6002), (0.5, 0.6116), (0.3, 0.6319)])
def test_rest_approaches_half_a_period_by_the_exponent_of_the_scaled_map(eta, exponent):
    critical = float(chattering.critical_amplitude(2.0, eta))
    distance = np.array([1e-9, 1e-11])
    left = np.pi / 2.0 - chattering.chattering_time(critical - distance, 2.0, eta)
    assert np.log(left[0] / left[1]) / np.log(100.0) == pytest.approx(exponent, abs=0.006)


def test_numbers_that_the_paper_states():
    assert chattering.critical_amplitude(2.0, 0.92) == pytest.approx(1.038, abs=5e-4)
    assert chattering.critical_amplitude(2.0, 0.92, method="eq76") == pytest.approx(1.038, abs=1e-3)
    assert chattering.critical_amplitude(2.0, 0.92, method="eq77") == pytest.approx(1.038, abs=1e-3)
    over_frequency = chattering.critical_amplitude(np.linspace(0.5, 8.0, 100), 0.92)
    assert np.ptp(over_frequency) / over_frequency.mean() == pytest.approx(0.005, abs=5e-4)


def test_the_fits_of_the_paper_err_as_known():
    assert chattering.critical_amplitude(0.5, 0.5, method="eq76") == pytest.approx(1.0935, abs=1e-4)
    assert chattering.critical_amplitude(0.5, 0.5) == pytest.approx(1.082087, abs=1e-6)
    exact = chattering.critical_amplitude(0.5, 0.75)
    assert chattering.critical_amplitude(0.5, 0.75, method="eq77") / exact - 1.0 == pytest.approx(0.026, abs=1e-3)


def test_more_loss_at_impacts_allows_more_shaking():
    eta = np.linspace(0.05, 0.999, 100)
    for omega in (0.3, 2.0, 20.0):
        assert (np.diff(chattering.critical_amplitude(omega, eta)) < 0.0).all()
    assert chattering.critical_amplitude(2.0, 1.0) == 1.0
