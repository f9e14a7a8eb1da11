"""The consistent expansion: coefficients, rising order of its error, and where it stops converging."""

import re

import mpmath
import numpy as np
import pytest
from flint import arb, ctx
from oracles.sine_chattering import BITS, first_impacts, rest_time

from rocking import chattering
from rocking.chattering import expansions
from rocking.errors import OptionError


def test_coefficients_of_the_reference(reference):
    known = reference["series_at_eta_092"]
    coefficients = chattering.series_coefficients(known["omega"], 0.92, order=4) * known["omega"]
    assert coefficients[0] == pytest.approx(known["c1"], rel=1e-12)
    assert coefficients[1] == pytest.approx(known["c3"], rel=1e-9)
    assert coefficients[2:] == pytest.approx([known["c5"], known["c7"]], rel=1e-8)


def test_frequency_enters_as_known(reference):
    """C1 omega is free of omega, and C_{2k+1} omega a polynomial of degree k in 1/omega^2."""
    known = reference["series_at_eta_092"]
    omega = np.array([0.5, 1.0, 2.0, 4.0, 8.0])
    scaled = chattering.series_coefficients(omega, 0.92, order=4) * omega[:, None]
    assert scaled[:, 0] == pytest.approx(known["c1"], rel=1e-12)
    assert scaled[:, 1] == pytest.approx(known["A"] + known["B"] / omega**2, abs=1e-4)
    for k in (1, 2, 3):
        fit = np.polynomial.Polynomial.fit(omega**-2.0, scaled[:, k], k)
        assert fit(omega**-2.0) == pytest.approx(scaled[:, k], rel=1e-10)


def test_leading_coefficient_is_that_of_the_paper():
    eps = 1e-12
    asymptotic = chattering.chattering_time(1.0 + eps, 1.0, [0.5, 0.8, 0.97], method="asymptotic")
    leading = chattering.series_coefficients(1.0, [0.5, 0.8, 0.97], order=1)[:, 0]
    assert asymptotic / np.sqrt((1.0 + eps) - 1.0) == pytest.approx(leading, rel=1e-9)


@pytest.mark.cases(fast=5)
@pytest.mark.parametrize(("omega", "eta"), [(2.0, 0.92), (0.6, 0.7), (8.0, 0.5)])
@pytest.mark.parametrize("terms", [1, 2, 3, 4])
def test_the_error_rises_by_one_order_per_term(omega, eta, terms):
    """Log-log slope k + 1/2 for k terms; the exact time in 120 digits, in differences too small for doubles."""
    coefficients = chattering.series_coefficients(omega, eta, order=12)
    eps = float(chattering.critical_amplitude(omega, eta) - 1.0) * np.array([2.0**-8, 2.0**-7])
    exact = [rest_time(1.0 + e, omega, eta, little=1e-14) for e in eps]
    partial = [float(sum(c * ((1.0 + e) - 1.0) ** k for k, c in enumerate(coefficients[:terms]))) for e in eps]
    with ctx.workprec(BITS):
        errors = [float(x - (arb(1.0 + e) - 1).sqrt() * p) for x, e, p in zip(exact, eps, partial, strict=True)]
    assert np.log2(errors[1] / errors[0]) == pytest.approx(terms + 0.5, abs=0.05)


@pytest.mark.parametrize("eta", [1e-20, 1e-26, 1e-27, 1e-28, 1e-30, 1e-60, 1e-100, 1e-150, 1e-200, 1e-300])
@pytest.mark.parametrize("omega", [0.5, 2.0])
def test_without_a_speed_after_impacts_only_the_first_arc_is_left(omega, eta):
    a = 1.01
    with mpmath.workdps(40):
        frequency = mpmath.mpf(omega)
        exact = first_impacts(a, omega, eta, 1)[0][0]
        # Their terms in eps^(1/2) and eps^(3/2), as in the paper's Eq. 32 with its correction.
        second = mpmath.sqrt(2) / frequency * (1 - mpmath.mpf(32) / 15 * (frequency**2 - 1) / frequency**2)
    found = [chattering.chattering_time(a, omega, eta, method="series", order=order) for order in (4, 20)]
    assert found == pytest.approx([exact] * 2, rel=1e-5 if omega < 1.0 else 1e-8)
    assert found[1] == pytest.approx(exact, rel=1e-8 if omega < 1.0 else 1e-15)
    coefficients = chattering.series_coefficients(omega, eta, order=2)
    assert coefficients == pytest.approx([4.0 * 2.0**0.5 / omega, float(second)], rel=1e-14)
    report = chattering.chattering_report(a, omega, eta)
    assert report.values["chattering_time"]["exact"] == pytest.approx(exact, rel=1e-15)


def test_four_terms_beat_eq65_fifty_times():
    exact = chattering.chattering_time(1.01, 2.0, 0.92)
    series = chattering.chattering_time(1.01, 2.0, 0.92, method="series", order=4)
    asymptotic = chattering.chattering_time(1.01, 2.0, 0.92, method="asymptotic")
    assert abs(asymptotic - exact) > 50.0 * abs(series - exact)


@pytest.mark.parametrize(("omega", "eta"), [(2.0, 0.92), (0.5, 0.5), (8.0, 0.75), (2.0, 0.97)])
def test_the_series_converges_up_to_the_critical_amplitude(omega, eta):
    critical = chattering.critical_amplitude(omega, eta) - 1.0
    a = 1.0 + critical * np.array([0.5, 0.7, 0.9])
    time = chattering.chattering_time(a, omega, eta, method="series", order=34)
    error = np.abs(time - chattering.chattering_time(a, omega, eta))
    assert (error < np.array([1e-10, 1e-6, 1e-3]) * time).all()


def test_series_knows_its_ends():
    assert np.isinf(chattering.series_coefficients(2.0, 1.0)).all()
    assert chattering.series_coefficients([1.0, 2.0], [[0.5], [0.6], [0.7]], order=3).shape == (3, 2, 3)
    time = chattering.chattering_time([0.5, 1.0], 2.0, 0.9, method="series")
    assert np.isnan(time[0]) and time[1] == 0.0
    with pytest.raises(OptionError, match="order must be"):
        chattering.series_coefficients(2.0, 0.9, order=41)
    with pytest.raises(OptionError, match="does not resolve"):
        chattering.series_coefficients(1e-6, 0.9, order=40)


@pytest.fixture
def unresolved(monkeypatch):
    """No coefficient is resolved: so it is at eta = 0.99999, after half a minute."""
    monkeypatch.setattr(expansions, "compute_phase_coefficients", lambda _, __, order: np.full(order, np.inf))


def test_where_double_precision_does_not_resolve_the_series_the_rest_is_told(unresolved):
    report = chattering.chattering_report(1.03, 2.0, 0.9)
    assert report.values["chattering_time"]["exact"] > 0.0
    assert np.isnan(report.values["chattering_time"]["series"])
    assert re.search("by a series, 4 terms +none", report.summary())
    with pytest.raises(OptionError, match="order must be a whole number from 1 to 40"):
        chattering.chattering_report(1.03, 2.0, 0.9, order=41)
