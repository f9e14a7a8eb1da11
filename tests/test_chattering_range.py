"""The theory over its whole range of frequency and restitution, against many digits and against limits."""

import numpy as np
import pytest
from flint import arb, ctx
from oracles.sine_chattering import BITS, rest_time

from rocking import chattering

#: Shares of a_cr - 1, some close to either side of one.
SHARES = (1e-3, 0.4, 0.95, 1.003)


def assert_agrees(share, omega, eta):
    """Time, verdict and completeness are those of many digits, up to what a few ulp of a change."""
    a = 1.0 + share * (float(chattering.critical_amplitude(omega, eta)) - 1.0)
    expected = rest_time(a, omega, eta)
    assert bool(chattering.is_complete(a, omega, eta)) == (expected is not None)
    time = float(chattering.chattering_time(a, omega, eta))
    if expected is None:
        assert np.isnan(time)
    else:
        # Extrapolation ends when it agrees to 1e-13; where restitution is near one it is no better than that.
        assert time == pytest.approx(float(expected), rel=5e-14 if eta < 0.95 else 2e-13)


AGREEING = [
    pytest.param(share, omega, eta, marks=[] if eta < 0.5 or quick else pytest.mark.thorough)
    for omega in (1e-6, 1e-3, 0.0042, 0.05, 1e3)
    for eta in (0.05, 0.5)
    for share in SHARES
    for quick in [share in (0.4, 1.003) and omega in (1e-6, 0.05, 1e3)]
]


@pytest.mark.cases(fast=5, thorough=26)
@pytest.mark.parametrize(("share", "omega", "eta"), AGREEING)
def test_times_and_verdicts_agree_with_many_digits(share, omega, eta):
    assert_agrees(share, omega, eta)


NEAR = [
    pytest.param(
        omega, eta, distance, marks=[] if distance in (1e-4, 1e-8) and omega in (0.1, 30.0) else pytest.mark.thorough
    )
    for omega in (0.06, 0.1, 0.15, 2.0, 30.0)
    for eta in (0.3, 0.92)
    for distance in (1e-4, 1e-6, 1e-8, 1e-10)
]


@pytest.mark.cases(fast=2, thorough=12)
@pytest.mark.parametrize(("omega", "eta", "distance"), NEAR)
def test_near_the_critical_amplitude_a_time_is_as_accurate_as_the_amplitude_allows(omega, eta, distance):
    """Two ulp of a, by the slope of the time."""
    a = float(chattering.critical_amplitude(omega, eta)) - distance
    time = float(chattering.chattering_time(a, omega, eta))
    with ctx.workprec(BITS):
        expected = rest_time(a, omega, eta)
        slope = float((expected - rest_time(arb(a) - 1e-9 * distance, omega, eta)) / (1e-9 * distance))
        error = abs(float(expected - time))
    assert error < 1e-13 * time + 2.0**-51 * 0.95 * slope


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("omega", [1e-3, 0.01])
@pytest.mark.parametrize("share", [1e-3, 1e-6])
def test_under_very_slow_forcing_too(omega, share):
    critical = float(chattering.critical_amplitude(omega, 0.3))
    a = critical - share * (critical - 1.0)
    time = float(chattering.chattering_time(a, omega, 0.3))
    with ctx.workprec(BITS):
        expected = rest_time(a, omega, 0.3)
        slope = (expected - rest_time(a - arb(critical - a) / 10**9, omega, 0.3)) / (critical - a) * 10**9
        assert abs(expected - time) < 1e-13 * time + 2.0**-51 * slope


@pytest.mark.slow
@pytest.mark.parametrize("omega", [1e-6, 1e-5, 1e-4, 1e-3, 0.0042, 0.0043, 0.02, 0.1, 0.5, 3.0, 30.0, 1e3])
@pytest.mark.parametrize("eta", [0.05, 0.2, 0.7, 0.9, 0.99])
def test_times_and_verdicts_agree_with_many_digits_everywhere(omega, eta):
    for share in (*SHARES, 0.1, 0.8, 1.5, 3.0) if eta < 0.9 else SHARES[1:]:
        assert_agrees(share, omega, eta)


@pytest.mark.parametrize("omega", [1e-6, 1e-5, 1e-4, 1e-3, 4e-3, 0.01])
def test_under_slow_forcing_the_first_arc_decides(omega):
    """The part of it that grows as exp(tau) vanishes where sqrt(a^2 - 1) = omega, but for exp(-pi/omega)."""
    critical = chattering.critical_amplitude(omega, [0.01, 0.05, 0.2, 0.5, 0.9])
    assert critical == pytest.approx(np.sqrt(1.0 + omega**2), rel=0.0, abs=1e-15)


CORNERS = [(omega, eta) for omega in (1e-6, 1e-3, 1.0, 1e6) for eta in (1e-300, 1e-100, 1e-8, 0.01, 0.9, 0.999)]
#: Sequences of a hundred thousand impacts.
LONG = [
    (1e-6, 0.99999),
    pytest.param(1e-3, 0.99999, marks=pytest.mark.thorough),
    *(pytest.param(omega, 0.99999, marks=pytest.mark.slow) for omega in (1.0, 1e6)),
]


@pytest.mark.cases(fast=8)
@pytest.mark.parametrize(("omega", "eta"), [*CORNERS, *LONG])
def test_time_and_sequence_have_an_answer_at_every_corner(omega, eta):
    critical = float(chattering.critical_amplitude(omega, eta)) - 1.0
    assert 0.0 < critical < 0.38
    below, above = 1.0 + 0.5 * critical, 1.0 + 1.01 * critical
    time = float(chattering.chattering_time(below, omega, eta))
    sequence = chattering.chattering_sequence(below, omega, eta, tolerance=1e-9)
    assert 0.0 < sequence.lower <= sequence.time <= sequence.upper < np.pi / omega
    assert sequence.time == pytest.approx(time, rel=1e-9)
    assert not chattering.is_complete(above, omega, eta)
    assert not chattering.chattering_sequence(above, omega, eta).is_complete


def test_a_place_where_the_correction_of_an_arc_vanishes_is_no_landing():
    assert not chattering.is_complete(1.1151407720386019, 1.0146326207140592, 0.6062211928500365)


def test_within_rounding_of_the_critical_amplitude_there_is_one_verdict():
    """A sequence and a time come from marches of their own."""
    rng, judged = np.random.default_rng(0), 0
    cases = [(1.0 - 10 ** rng.uniform(-2.5, -0.01), 10 ** rng.uniform(-3, 3)) for _ in range(60)]
    for eta, omega in [*cases, (0.038270937673807404, 767.3827503406839)]:
        critical = float(chattering.critical_amplitude(omega, eta))
        for steps in (-1, 0, 1, 2):
            a = critical + steps * 2.0**-52
            if a <= 1.0:
                continue
            found = chattering.chattering_sequence(a, omega, eta)
            time = float(chattering.chattering_time(a, omega, eta))
            assert found.is_complete == np.isfinite(time)
            if found.is_complete:
                assert found.lower <= found.time <= found.upper
                assert found.time == pytest.approx(time, rel=1e-6)
            judged += 1
    assert judged > 200


@pytest.mark.parametrize("omega", [1e-6, 1e-3, 0.0042, 2.0, 1e3])
def test_the_semianalytical_scheme_holds_over_the_same_range(omega):
    a = 1.0 + np.array([0.3, 0.9, 1.01]) * (chattering.critical_amplitude(omega, 0.5) - 1.0)
    exact = chattering.chattering_time(a, omega, 0.5)
    semianalytical = chattering.chattering_time(a, omega, 0.5, method="semianalytical")
    assert semianalytical == pytest.approx(exact, rel=1e-12, nan_ok=True)
