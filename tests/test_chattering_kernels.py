"""Parts of the sine theory's kernels by themselves: basis, statuses, power series."""

import mpmath
import numpy as np
import pytest
from numpy.polynomial import polynomial

from rocking import chattering
from rocking.kernels.sine import SequenceStatus
from rocking.kernels.sine.arc import State, compute_basis, solve_arc
from rocking.kernels.sine.sequence import estimate_remaining_phase
from rocking.kernels.sine.series import PowerSeries, expand_remaining_phase

pytestmark = pytest.mark.usefixtures("parts_run_by_python")


def exact_basis(t, delta):
    """Definitions of E and W in fifty digits, over the factor that a long arc's are scaled by."""
    with mpmath.workdps(50):
        t, delta = mpmath.mpf(t), mpmath.mpf(delta)
        rate = mpmath.sqrt(delta)
        S, C = mpmath.sinh(rate * t) / rate, (mpmath.cosh(rate * t) - 1) / delta
        E = (S - mpmath.sin(t)) / ((1 + delta) * t**3)
        W = (C - 1 + mpmath.cos(t)) / ((1 + delta) * t**4)
        return mpmath.sin(t) / t, (1 - mpmath.cos(t)) / t**2, E, W


REACHES = (1e-9, 0.0029, 0.0031, 0.119, 0.121, 1.49, 1.51, 11.9, 12.1, 200.0, 1e4, 4e5)
DELTAS = (1e-6, 0.1, 1.0, 40.0, 1e6, 1e12)


@pytest.mark.parametrize(
    ("reach", "delta"),
    [(reach, delta) for delta in DELTAS for reach in REACHES if reach <= np.pi**2 * (1.0 + delta)],
)
def test_the_basis_is_right_on_both_sides_of_every_change_of_sum(reach, delta):
    t = float(np.sqrt(reach / (1.0 + delta)))
    *values, decay = compute_basis(t, delta)
    exact = exact_basis(t, delta)
    assert values[:2] == pytest.approx([float(x) for x in exact[:2]], rel=4e-16)
    with mpmath.workdps(50):
        scale = mpmath.exp(-mpmath.sqrt(mpmath.mpf(delta)) * t) if decay < 1.0 else mpmath.mpf(1)
        scaled = [float(x * scale) for x in exact[2:]]
    assert decay == pytest.approx(float(scale), rel=1e-12)
    # The argument of the exponential is rounded, and so is the difference in E and W.
    assert values[2:] == pytest.approx(scaled, rel=1e-14 + 3e-16 * np.sqrt(reach))


def test_an_arc_tells_what_became_of_it():
    lands = State(0.01, 0.3, 0.5)
    assert solve_arc(lands, 0.06, 1.0, 1.0, 2.0)[0] == SequenceStatus.FOUND
    assert solve_arc(lands, 1e-3, 1.0, 1.0, 2.0)[1] == pytest.approx(
        solve_arc(lands, 0.06, 1.0, 1.0, 2.0)[1], rel=1e-15
    )
    assert solve_arc(lands, 0.06, 1.0, 1.0, 0.02)[0] == SequenceStatus.INCOMPLETE
    assert solve_arc(State(1.0, 0.3, 0.5), 0.06, 1.0, 1e12, 3.0)[0] == SequenceStatus.INCOMPLETE


@pytest.mark.parametrize("count", [1, 4095, 4096, 4097])
def test_every_number_of_sequences_is_computed(count):
    rock = np.arange(2 * count) % 2 == 1
    times = chattering.chattering_time(np.where(rock, 1.03, 0.5), 2.0, 0.92)
    assert np.isnan(times[~rock]).all()
    assert times[rock] == pytest.approx(1.1259476769338108721, rel=1e-14)


def test_power_series_multiply_and_divide_as_polynomials():
    rng = np.random.default_rng(0)
    a, b = rng.uniform(0.5, 2.0, (2, 6, 3))
    x, y = PowerSeries(a, 1), PowerSeries(b, 3)
    product = x * y
    assert product.lowest == 4
    for n in range(3):
        assert product.coefficients[:, n] == pytest.approx(polynomial.polymul(a[:, n], b[:, n])[:6])
    assert ((product / y).coefficients, (product / y).lowest) == (pytest.approx(a), 1)
    assert (2.0 / x * x).coefficients[0] == pytest.approx(2.0)
    total = 2.0 - (y - x) * (y - x)
    assert total.lowest == 0
    assert total.coefficients[0] == pytest.approx(2.0)
    assert total.coefficients[1] == pytest.approx(-(a[0] ** 2))


def test_the_closure_of_series_is_that_of_numbers():
    """A series of one term is a number."""
    V, P, D = 0.013, 0.4, 0.7
    one = [PowerSeries(np.array([[value]]), 0) for value in (V, P, D)]
    number = float(expand_remaining_phase(tuple(one), 0.25, 0.9).coefficients[0, 0])
    assert number == pytest.approx(estimate_remaining_phase(State(V, P, D), 0.25, 0.9), rel=1e-14)


@pytest.mark.parametrize("omega, eta", [(0.7, 0.6), (3.0, 0.8), (5.0, 0.95)])
def test_eq_76_and_eq_77_are_the_polynomials_that_the_paper_prints(omega, eta):
    """Terms of Eq. 76: coefficient, power of eta, power of omega."""
    terms = [
        (1.079, 0, 0), (-0.1885, 1, 0), (0.1405, 0, 1), (0.6442, 2, 0), (-0.1903, 1, 1), (-0.02818, 0, 2),
        (-0.7372, 3, 0), (0.06413, 2, 1), (0.03236, 1, 2), (0.00176, 0, 3), (0.2146, 4, 0), (-0.0187, 3, 1),
        (-0.003045, 2, 2), (-0.00185, 1, 3),
    ]  # fmt: skip
    expected = sum(factor * eta**i * omega**j for factor, i, j in terms)
    assert chattering.critical_amplitude(omega, eta, method="eq76") == pytest.approx(expected, rel=1e-13)
    cubic = np.polynomial.polynomial.polyval(eta, [1.271, -0.45, 0.5763, -0.3941])
    assert chattering.critical_amplitude(omega, eta, method="eq77") == pytest.approx(cubic, rel=1e-13)
