"""The search for the first root, against exact rational arithmetic."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import ULP
from oracles.exact import as_float, exact, polynomial, real_roots

from rocking.kernels.events import bound_curvature, find_first_root

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

quick = settings(deadline=None, max_examples=80)


def exact_first_root(c: Sequence[float], h: float, raised: float = 0.0) -> float:
    """First root in (0, h] of the polynomial plus `raised`, its doubles taken as exact numbers; inf: none."""
    real = real_roots(polynomial(c) + exact(raised))
    inside = [float(r.mid()) for r in real if r > 0 and not r > exact(h)]
    return min(inside, default=math.inf)


def rounding(c: Sequence[float], h: float) -> float:
    """Bound on the rounding of the polynomial's values on [0, h]."""
    return 4.0 * ULP * len(c) * sum(abs(x) * h**k for k, x in enumerate(c))


def is_touch(c: Sequence[float], h: float, t: float) -> bool:
    """Whether the search may have ended at t for want of patience: a value and a slope next to zero for the curvature.

    A hundred thousand steps are not enough only where the last was shorter than h/100,000; each is longer than half of
    sqrt(value/bound), and a series whose slope is steeper than sqrt(2 value bound) passes through zero.
    """
    bound = bound_curvature(np.array(c), 0, len(c) - 1, h)
    value = as_float(polynomial(c)(exact(t)))
    slope = as_float(polynomial(c).derivative()(exact(t)))
    return 0.0 <= value <= 4e-10 * bound * h * h and slope * slope <= 2.0 * value * bound


def assert_first_root(c: Sequence[float], h: float, found: float) -> None:
    """The root found is the first, of the polynomial itself or of one that differs by its rounding, or a touch."""
    slack = rounding(c, h)
    if not math.isnan(found) and is_touch(c, h, found):
        assert 0.0 < found <= exact_first_root(c, h, slack) * (1.0 + 4.0 * ULP)
    elif math.isnan(found):
        assert exact_first_root(c, h, slack) == math.inf
    else:
        assert 0.0 < found <= h * (1.0 + ULP)
        assert exact_first_root(c, h, -slack) <= found * (1.0 + 4.0 * ULP)
        assert found <= exact_first_root(c, h, slack) * (1.0 + 4.0 * ULP)


def from_roots(real: Sequence[float], pairs: Sequence[tuple[float, float]]) -> np.ndarray:
    """Coefficients, positive at 0, of a polynomial with these real roots and conjugate pairs."""
    c = np.array([1.0])
    for r in real:
        c = np.convolve(c, [-r, 1.0])
    for re, im in pairs:
        c = np.convolve(c, [re * re + im * im, -2.0 * re, 1.0])
    return c if c[0] > 0.0 else -c


sizes = st.floats(0.01, 3.0, allow_subnormal=False)
signed = sizes | sizes.map(lambda x: -x)


@st.composite
def polynomials(draw: st.DrawFn) -> tuple[np.ndarray, float]:
    """Coefficients and an interval: separate, close, double and complex roots, one maybe at the interval's end."""
    real = draw(st.lists(signed, max_size=4))
    if real and draw(st.booleans()):
        real.append(real[0] * (1.0 + draw(st.sampled_from([0.0, 1e-14, 1e-10, 1e-6, 1e-3]))))
    pairs = draw(st.lists(st.tuples(signed, st.sampled_from([1e-7, 1e-4, 0.1, 1.0])), max_size=2))
    ends = [r for r in real if r > 0.0] or [1.0]
    return from_roots(real, pairs), draw(sizes | st.sampled_from(ends))


@quick
@given(polynomials(), st.lists(signed, max_size=3))
def test_the_root_found_is_the_first_one_and_none_is_skipped_or_invented(
    polynomial: tuple[np.ndarray, float], divided_out: list[float]
) -> None:
    c, h = polynomial
    series = np.array([*divided_out, *c])
    assert_first_root(c, h, find_first_root(series, len(divided_out), len(series) - 1, h))


@quick
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=22), st.floats(0.1, 1.0))
def test_series_of_any_coefficients_give_their_first_root(terms: list[float], h: float) -> None:
    c = np.array([0.3, *terms])
    assert_first_root(c, h, find_first_root(c, 0, len(c) - 1, h))


@pytest.mark.parametrize(
    "c, h", [([1.0, 0.0, 1.0], 5.0), ([1.0, -1.0, 0.2501], 9.0), ([1.0, -0.5], 1.999), ([2.0], 1.0)]
)
def test_a_series_without_a_root_in_the_interval_gives_nan(c: list[float], h: float) -> None:
    assert math.isnan(find_first_root(np.array(c), 0, len(c) - 1, h))


def test_a_root_of_high_multiplicity_is_approached_without_end() -> None:
    """Where the steps become too short, what is left counts as a touch, before the root and never after it."""
    c = from_roots([1.0] * 5, [(1.0, 1e-4)])
    found = find_first_root(c, 0, len(c) - 1, 1.0)
    assert 0.97 < found < 1.0
    assert is_touch(list(c), 1.0, found)


@pytest.mark.parametrize("c", [[0.0, -1.0, 2.0], [-1e-30, -1.0, 0.0], [0.0, 0.0, 0.0]])
def test_a_zero_at_the_start_is_not_a_root(c: list[float]) -> None:
    assert math.isnan(find_first_root(np.array(c), 0, 2, 0.4))


def test_leading_zeros_are_divided_out() -> None:
    assert find_first_root(np.array([9.0, 0.0, 0.0, 3.0, -6.0]), 1, 4, 1.0) == 0.5


@pytest.mark.parametrize("least", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("power", [1, 8, 20])
def test_a_dip_that_stays_above_zero_is_not_a_root(least: float, power: int) -> None:
    """The higher the power, the steeper the series elsewhere, and the shorter the steps near the dip."""
    c = np.convolve([0.25 + least, -1.0, 1.0], [1.0, *[0.0] * (power - 1), -1.0])
    assert exact_first_root(c, 0.99) == math.inf
    assert math.isnan(find_first_root(c, 0, len(c) - 1, 0.99))


@pytest.mark.parametrize("start", [0.0, 1e-300, 1e-25, 1e-18, 1e-12, 1e-6])
@pytest.mark.parametrize("speed", [1e-3, 1.0])
def test_a_series_that_rises_from_next_to_nothing_still_comes_down(start: float, speed: float) -> None:
    """After a step that ends just past an impact, rotation is tiny and rises: nothing must cancel."""
    c = np.array([start, speed, -2.0, 0.3])
    expected = exact_first_root(c, 1.0)
    assert find_first_root(c, 0, 3, 1.0) == pytest.approx(expected, rel=4.0 * ULP)


@pytest.mark.parametrize("scale", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("start", [0.0, 1e-6, 1e-2])
def test_an_arc_much_shorter_than_the_interval_is_found(scale: float, start: float) -> None:
    """As after an uplift just before a peak of the motion: the series turns down long before the interval ends."""
    c = np.array([start * scale**3, start * scale**2, scale, -1.0])
    expected = exact_first_root(c, 1.0)
    assert find_first_root(c, 0, 3, 1.0) == pytest.approx(expected, rel=16.0 * ULP, abs=0.0)


@quick
@given(st.integers(-290, -2), st.floats(1.0, 9.0), st.floats(-1.0, 1.0))
def test_tiny_roots_of_a_divided_series_keep_their_relative_accuracy(
    exponent: int, digits: float, third: float
) -> None:
    speed = digits * 10.0**exponent
    c = [speed, -1.0, third, 0.5 * third]
    found = find_first_root(np.array([0.0, *c]), 1, 4, 1.5 * speed)
    assert found == pytest.approx(exact_first_root(c, 1.5 * speed), rel=8.0 * ULP, abs=0.0)


@quick
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=12), st.integers(0, 2), st.floats(0.1, 2.0))
def test_the_curvature_is_never_below_its_bound(terms: list[float], lead: int, h: float) -> None:
    c = np.array([1.0] * lead + terms)
    bound = bound_curvature(c, lead, len(c) - 1, h)
    curvature = np.polynomial.Polynomial(terms).deriv(2)(np.linspace(0.0, h, 101))
    assert bound >= 0.0
    assert np.all(curvature >= -bound * (1.0 + 1e-12) - 1e-12)
