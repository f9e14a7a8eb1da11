"""Motions as kernels read them: pieces, bounds on windows of them, and stretches that are passed over."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import ULP, in_units_of_g, long_uncompiled, numbers
from oracles.exact import exact, polynomial

from rocking.kernels.adjoint import add_moments
from rocking.kernels.arc import find_significant_degree
from rocking.kernels.ground import (
    PIECES_PER_STRETCH,
    Ground,
    bound_piece,
    bound_window,
    build_ground,
    coefficient,
    compute_acceleration,
    compute_acceleration_rate,
    find_piece_beyond,
    ground_error,
    shift_polynomial,
    write_local_series,
)
from rocking.kernels.ground import build_ground as laid_out
from rocking.kernels.state import create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

#: Limits that no motion passes.
ANYTHING = (-math.inf, math.inf)

quick = settings(deadline=None, max_examples=50)


def work() -> np.ndarray:
    return create_scratch()["ground"]


rows = st.lists(numbers(-3.0, 3.0), min_size=1, max_size=14)


@st.composite
def grounds(draw: st.DrawFn, *, most: int = 6) -> Ground:
    """Pieces of one degree, with jumps between them or continuous."""
    columns = draw(st.integers(1, 6))
    pieces = draw(st.lists(st.lists(numbers(-1.0, 1.0), min_size=columns, max_size=columns), min_size=1, max_size=most))
    widths = [draw(st.floats(0.01, 2.0)) for _ in pieces]
    if draw(st.booleans()):
        for k in range(1, len(pieces)):
            pieces[k][0] = float(np.polynomial.Polynomial(pieces[k - 1])(widths[k - 1]))
    return in_units_of_g(np.cumsum([draw(st.floats(0.0, 9.0)), *widths]), pieces)


def dense(ground: Ground, piece: int, offset: float, window: float, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Times since the start of the window, and accelerations, on all the pieces that it touches."""
    times, values, elapsed = [], [], 0.0
    while True:
        length = ground.pieces[piece, 1]
        span = min(window - elapsed, length - offset)
        local = np.linspace(0.0, span, count)
        times.append(elapsed + local)
        values.append(np.polynomial.Polynomial(ground.pieces[piece, 2:])(offset + local))
        if elapsed + length - offset >= window:
            return np.concatenate(times), np.concatenate(values)
        elapsed, piece, offset = elapsed + length - offset, piece + 1, 0.0


@pytest.mark.thorough
@quick
@given(rows, numbers(0.0, 3.0), st.sampled_from([1.0, -1.0]))
def test_the_local_series_is_the_same_polynomial_about_a_later_time(
    coefficients: list[float], offset: float, sign: float
) -> None:
    A = np.full(24, np.nan)
    degree = write_local_series(in_units_of_g([0.0, 9.0], [coefficients]), 0, offset, sign, A)
    exact, sizes = ([f(Fraction(x) * Fraction(sign)) for x in coefficients] for f in (lambda x: x, abs))
    for row in (exact, sizes):
        for k in range(len(row) - 1):
            for j in range(len(row) - 2, k - 1, -1):
                row[j] += Fraction(offset) * row[j + 1]
    for k, (value, size) in enumerate(zip(exact, sizes, strict=True)):
        found = Fraction(float(A[k])) if k <= degree else Fraction(0)
        assert abs(found - value) <= len(coefficients) * Fraction(ULP) * size
    assert np.all(np.isnan(A[max(2, len(coefficients)) :]))


def test_what_does_not_count_within_a_step_is_dropped() -> None:
    A = np.array([1.0, 0.0, 1.0, 1e-3, 1e-30])
    assert [find_significant_degree(A, 4, h) for h in (1.0, 1e-6, 1e-12)] == [3, 2, 1]
    assert find_significant_degree(A, 0, 1.0) == 0


@quick
@given(rows, numbers(0.0, 3.0))
def test_value_and_slope_are_those_of_the_polynomial(coefficients: list[float], offset: float) -> None:
    ground, f = in_units_of_g([0.0, 9.0], [coefficients]), polynomial(coefficients)
    size = sum(abs(c) * offset**k for k, c in enumerate(coefficients))
    steepness = sum(k * abs(c) * offset ** (k - 1) for k, c in enumerate(coefficients) if k > 0)
    at = exact(offset)
    assert abs(exact(compute_acceleration(ground, 0, offset)) - f(at)) <= exact(2.0 * len(coefficients) * ULP * size)
    assert abs(exact(compute_acceleration_rate(ground, 0, offset)) - f.derivative()(at)) <= exact(
        2.0 * len(coefficients) * ULP * steepness
    )


def test_the_last_piece_has_no_end_and_no_motion() -> None:
    ground = laid_out(np.array([1.0, 3.0]), np.array([[2.0]]), 0.5, 0.25)
    assert ground.pieces.tolist() == [[1.0, 2.0, 2.0, 0.0], [3.0, math.inf, 0.0, 0.0]]
    assert (coefficient(ground, 0, 0), ground_error(ground)) == (1.0, 0.125)
    assert laid_out(np.zeros(1), np.zeros((0, 2)), 1.0, 0.0).pieces.tolist() == [[0.0, math.inf, 0.0, 0.0]]
    assert bound_window(ground, 1, 0.3, 5.0, ANYTHING, work()) == (0.0, 0.0, 0.0, 0.0)


@quick
@given(rows, st.floats(0.0, 2.0))
def test_a_polynomial_is_moved_and_moved_back(coefficients: list[float], t: float) -> None:
    c = np.array(coefficients)
    shift_polynomial(c, len(c) - 1, t)
    reached = np.polynomial.Polynomial(coefficients)(t)
    assert c[0] == pytest.approx(reached, abs=1e-14 * sum(abs(x) * t**k for k, x in enumerate(coefficients)))
    size = sum(abs(x) * (2.0 * t) ** k for k, x in enumerate(np.abs(c)))
    shift_polynomial(c, len(c) - 1, -t)
    assert np.all(np.abs(c - coefficients) * t ** np.arange(len(c)) <= 1e-13 * (size + np.sum(np.abs(coefficients))))


@quick
@given(grounds(), st.floats(0.0, 0.99), st.floats(1e-6, 1.0))
def test_the_bounds_on_a_window_within_a_piece_hold_every_value_and_slope(
    ground: Ground, share: float, part: float
) -> None:
    length = float(ground.pieces[0, 1])
    offset = share * length
    window = part * (length - offset)
    bounds = bound_piece(ground, 0, offset, window, work())
    f = polynomial(ground.pieces[0, 2:])
    for t in np.linspace(offset, offset + window, 25):
        assert exact(bounds.low) <= f(exact(t)) <= exact(bounds.high)
        assert abs(f.derivative()(exact(t))) <= exact(bounds.slope * (1.0 + 1e-13))


@quick
@given(st.lists(numbers(-1.0, 1.0), min_size=2, max_size=2), st.floats(0.0, 1.0), st.floats(1e-6, 1.0))
def test_the_bounds_on_an_even_change_are_its_ends(row: list[float], offset: float, window: float) -> None:
    bounds = bound_piece(in_units_of_g([0.0, 2.0], [row]), 0, offset, window, work())
    ends = [row[0] + row[1] * t for t in (offset, offset + window)]
    size = abs(row[0]) + 2.0 * abs(row[1])
    assert bounds[:3] == pytest.approx((min(ends), max(ends), abs(row[1])), abs=2.0**-46 * size)


@quick
@given(grounds(), st.integers(0, 5), st.floats(0.0, 0.99), st.floats(1e-6, 12.0))
def test_the_bounds_over_any_window_hold_dense_samples_their_slopes_and_their_jumps(
    ground: Ground, piece: int, share: float, window: float
) -> None:
    piece = min(piece, len(ground.pieces) - 2)
    offset = share * float(ground.pieces[piece, 1])
    bounds = bound_window(ground, piece, offset, window, ANYTHING, work())
    times, values = dense(ground, piece, offset, window)
    size = np.max(np.abs(ground.pieces[:, 2:]) @ 2.0 ** np.arange(ground.pieces.shape[1] - 2))
    assert bounds.low <= np.min(values) + 1e-13 * size
    assert np.max(values) <= bounds.high + 1e-13 * size
    # Along the way, what is not a jump changes no faster than the slope allows.
    assert np.all(np.abs(np.diff(values)) <= bounds.slope * np.diff(times) * (1.0 + 1e-9) + bounds.jumps + 1e-13 * size)
    jumps = np.abs(np.diff(values))[np.diff(times) == 0.0]
    assert bounds.jumps >= np.sum(jumps) * (1.0 - 1e-12) - 1e-13 * size
    assert bounds.jumps <= np.sum(jumps) + 1e-12 * size


def test_every_jump_of_a_window_is_counted_and_none_beyond() -> None:
    ground = in_units_of_g([0.0, 1.0, 2.0, 3.0], [[0.0, 0.25], [0.5, 0.0], [-0.25, 0.0]])
    expected = {0.5: 0.0, 1.5: 0.25, 2.5: 1.0, 3.5: 1.25, 9.0: 1.25}
    for window, jumps in expected.items():
        assert bound_window(ground, 0, 0.0, window, ANYTHING, work()).jumps == pytest.approx(jumps, abs=1e-12)
    assert bound_window(ground, 1, 0.5, 1.0, ANYTHING, work()).jumps == pytest.approx(0.75, abs=1e-12)


def test_a_window_in_which_the_motion_passes_a_limit_has_no_bounds() -> None:
    ground = build_ground(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.0], [0.5, 0.0]]), 1.0, 0.0)
    assert bound_window(ground, 0, 0.0, 1.5, (-0.6, 0.6), work()).high == pytest.approx(0.5)
    for limits in ((-0.6, 0.4), (0.1, 0.6)):
        assert np.all(np.isnan(bound_window(ground, 0, 0.0, 1.5, limits, work())))
    assert np.all(np.isfinite(bound_window(ground, 0, 0.0, 0.9, (-0.6, 0.4), work())))


def piece_by_piece(ground: Ground, piece: int, offset: float, window: float) -> np.ndarray:
    """Bounds over a window without the help of stretches."""
    low, high, steepest, jumps = math.inf, -math.inf, 0.0, 0.0
    while True:
        left = float(ground.pieces[piece, 1]) - offset
        here = bound_piece(ground, piece, offset, min(window, left), work())
        low, high, steepest = min(low, here.low), max(high, here.high), max(steepest, here.slope)
        if window <= left:
            return np.array([low, high, steepest, jumps])
        end = compute_acceleration(ground, piece, float(ground.pieces[piece, 1]))
        jumps += abs(float(ground.pieces[piece + 1, 2]) - end) + here.jumps
        window, piece, offset = window - left, piece + 1, 0.0


@quick
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 4),
    st.integers(0, 5 * PIECES_PER_STRETCH),
    st.floats(0.0, 0.99),
    st.floats(0.0, 1.2),
)
def test_bounds_over_whole_stretches_are_those_of_their_pieces(
    seed: int, columns: int, piece: int, share: float, part: float
) -> None:
    random = np.random.default_rng(seed)
    count = 5 * PIECES_PER_STRETCH + 3
    widths = random.uniform(0.01, 1.0, count)
    ground = in_units_of_g(np.cumsum([0.0, *widths]), random.normal(size=(count, columns)) * random.random((count, 1)))
    offset = share * float(ground.pieces[piece, 1]) * (seed % 2)
    window = part * float(ground.pieces[-1, 0])
    bounds = bound_window(ground, piece, offset, window, ANYTHING, work())
    assert np.array(bounds) == pytest.approx(piece_by_piece(ground, piece, offset, window), rel=1e-13)


def test_a_window_over_too_many_stretches_has_no_bounds() -> None:
    count = 200 * PIECES_PER_STRETCH
    ground = in_units_of_g(np.arange(count + 1.0), np.zeros((count, 2)))
    assert np.all(np.isfinite(bound_window(ground, 0, 0.0, 100.0 * PIECES_PER_STRETCH, ANYTHING, work())))
    assert np.all(np.isnan(bound_window(ground, 0, 0.0, 150.0 * PIECES_PER_STRETCH, ANYTHING, work())))


@long_uncompiled
@quick
@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.integers(1, 4), st.floats(0.1, 1.0), st.floats(0.1, 1.0))
def test_no_piece_that_passes_the_threshold_is_passed_over(
    seed: int, count: int, columns: int, below: float, above: float
) -> None:
    random = np.random.default_rng(seed)
    coefficients = random.normal(size=(count, columns)) * 0.1 * random.random((count, 1)) ** 4
    coefficients[random.integers(count)] *= 10.0
    ground = in_units_of_g(0.1 * np.arange(count + 1), coefficients)
    samples = np.array([dense(ground, k, 0.0, float(ground.pieces[k, 1]), 30)[1] for k in range(count)])
    beyond = np.append(np.max(samples, axis=1) > above, True) | np.append(np.min(samples, axis=1) < -below, True)
    for piece in random.integers(0, count + 1, size=20):
        found = find_piece_beyond(ground, int(piece), (-below, above), (0.0, 0.0))
        assert piece <= found <= piece + np.argmax(beyond[piece:])


def test_stretches_without_anything_are_passed_over() -> None:
    count = 10 * PIECES_PER_STRETCH
    coefficients = np.full((count, 2), [0.1, 0.0])
    coefficients[7 * PIECES_PER_STRETCH + 5, 0] = -0.5
    ground = in_units_of_g(np.arange(count + 1.0), coefficients)
    assert find_piece_beyond(ground, 3, (-0.2, 0.2), (0.0, 0.0)) == 7 * PIECES_PER_STRETCH
    assert find_piece_beyond(ground, 7 * PIECES_PER_STRETCH + 3, (-0.2, 0.2), (0.0, 0.0)) == 7 * PIECES_PER_STRETCH + 3
    assert find_piece_beyond(ground, 8 * PIECES_PER_STRETCH, (-0.2, 0.2), (0.0, 0.0)) == count
    assert find_piece_beyond(ground, 3, (-0.6, 0.2), (0.0, 0.0)) == count
    assert find_piece_beyond(ground, 3, (-0.6, 0.05), (0.0, 0.0)) == 3


@pytest.mark.parametrize(("offset", "count"), [(0.0, 1), (0.0, 2), (0.7, 2), (0.7, 4), (-0.3, 6)])
def test_moments_of_a_series_are_its_integrals_with_powers_of_the_time_in_a_piece(offset: float, count: int) -> None:
    """By Gauss-Legendre quadrature, which is exact for polynomials of this degree."""
    series, t = np.array([0.7, -1.3, 0.4, 2.1, -0.9]), 0.6
    nodes, weights = np.polynomial.legendre.leggauss(12)
    at = 0.5 * t * (nodes + 1.0)
    m = np.polynomial.polynomial.polyval(at, series)
    expected = [1.0 - 0.5 * t * np.sum(weights * m * (offset + at) ** j) for j in range(count)]
    out = np.ones(count)
    add_moments(np.empty(count), np.append(series, 99.0), len(series) + 1, offset, t, -1.0, out)
    assert out == pytest.approx(expected, rel=1e-14, abs=1e-15)
