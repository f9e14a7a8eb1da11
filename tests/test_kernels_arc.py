"""The Taylor series of arcs: against closed forms, high precision, and each other."""

from fractions import Fraction

import mpmath
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rocking.kernels.arc import (
    NEGLIGIBLE,
    converged,
    evaluate,
    expand_linear,
    expand_nonlinear,
    linear_order,
    local_motion,
    vary_linear,
    vary_nonlinear,
)
from rocking.kernels.state import COSINE, GROUND, ORDER, SERIES, SINE, Floats, new_scratch

ULP = 2.0**-52

quick = settings(deadline=None, max_examples=40)

mp = mpmath.mp.clone()
mp.dps = 90  # the closed form cancels


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers far from underflow."""
    return st.floats(low, high).map(lambda x: x if abs(x) > 1e-30 else 0.0)


speeds = numbers(-2.0, 2.0)
rotations = st.floats(0.0, 1.2)
slendernesses = st.floats(0.02, 1.5)
frequencies = st.floats(0.1, 10.0)
motions = st.lists(numbers(-3.0, 3.0), min_size=1, max_size=14)


def terms(c: np.ndarray, order: int, t: float) -> float:
    """Sum of the sizes of a series' terms: its rounding is a few units in the last place of that."""
    return float(sum(abs(c[k]) * t**k for k in range(order + 1)))


def motion_over(A: list[float], h: float) -> np.ndarray:
    """Motion with coefficients A in units of the time h, as arcs take it."""
    return np.array([a / h**k for k, a in enumerate(A)])


def value(c: list[mpmath.mpf], t: mpmath.mpf) -> mpmath.mpf:
    total = mp.mpf(0)
    for x in reversed(c):
        total = total * t + x
    return total


def linear_arc(u: float, v: float, lam: float, alpha: float, A: np.ndarray, t: float) -> tuple[mpmath.mpf, mpmath.mpf]:
    """u = (polynomial) + a cosh p t + b sinh p t, where the polynomial is the sum of (D^2/lam)^m (alpha + A)."""
    lam, t = mp.mpf(lam), mp.mpf(t)
    derivative = [mp.mpf(float(x)) for x in A]
    derivative[0] += mp.mpf(alpha)
    polynomial = [mp.mpf(0)] * len(derivative)
    while derivative:
        polynomial = [p + (derivative[k] if k < len(derivative) else 0) for k, p in enumerate(polynomial)]
        derivative = [(k + 1) * (k + 2) * derivative[k + 2] / lam for k in range(len(derivative) - 2)]
    slope = [k * p for k, p in enumerate(polynomial)][1:]
    p = mp.sqrt(lam)
    a = mp.mpf(u) - polynomial[0]
    b = (mp.mpf(v) - (slope[0] if slope else 0)) / p
    return (
        value(polynomial, t) + a * mp.cosh(p * t) + b * mp.sinh(p * t),
        value(slope, t) + p * (a * mp.sinh(p * t) + b * mp.cosh(p * t)),
    )


def assert_solves_the_nonlinear_equation(
    c: np.ndarray, order: int, h: float, lam: float, alpha: float, A: np.ndarray
) -> None:
    """u'' + lam (sin(alpha - u) + A cos(alpha - u)) vanishes, but for rounding and truncation, all along the step."""
    series, motion = ([mp.mpf(float(x)) for x in row] for row in (c[: order + 1], A))
    curvature = [k * (k - 1) * x for k, x in enumerate(series)][2:]
    force = 1.0 + sum(abs(a) * h**k for k, a in enumerate(A))
    for share in (0.1, 0.5, 0.8, 1.0):
        t = mp.mpf(share * h)
        angle = mp.mpf(alpha) - value(series, t)
        residual = value(curvature, t) + mp.mpf(lam) * (mp.sin(angle) + value(motion, t) * mp.cos(angle))
        size = float(terms(c, order, h)) / h**2 + lam * force
        assert abs(residual) <= 2.0**-46 * size


def linear_series(
    u: float, v: float, lam: float, alpha: float, A: np.ndarray, h: float
) -> tuple[np.ndarray, int, float]:
    """Series, its order and the step, as for an arc of a response."""
    scratch = new_scratch(len(A))
    scratch[GROUND][: len(A)] = A
    degree = len(A) - 1
    order = linear_order(lam, h) if degree <= 1 else ORDER
    expand_linear(u, v, lam, alpha, scratch[GROUND], degree, order, scratch[SERIES])
    if degree > 1:
        order, h = converged(scratch[SERIES], degree, h)
    return scratch[SERIES], order, h


def nonlinear_series(
    u: float, v: float, lam: float, alpha: float, A: np.ndarray, h: float
) -> tuple[Floats, int, float]:
    scratch = new_scratch(len(A))
    scratch[GROUND][: len(A)] = A
    order, h = expand_nonlinear(
        u, v, lam, alpha, scratch[GROUND], len(A) - 1, h, scratch[SERIES], scratch[SINE], scratch[COSINE]
    )
    return scratch, order, h


def assert_series_is(c: np.ndarray, order: int, t: float, expected: tuple[mpmath.mpf, mpmath.mpf]) -> None:
    rotation, speed, _ = evaluate(c, order, t)
    rounding = 0.5 * ULP * order * terms(c, order, t)
    assert abs(rotation - expected[0]) <= rounding
    assert abs(speed - expected[1]) * t <= order * rounding


@quick
@given(rotations, speeds, frequencies, slendernesses, motions, st.floats(0.01, 1.0))
def test_a_linear_series_gives_the_closed_form(
    u: float, v: float, p: float, alpha: float, A: list[float], share: float
) -> None:
    motion = motion_over(A, share / p)
    c, order, h = linear_series(u, v, p * p, alpha, motion, share / p)
    assert 0.0 < h <= share / p
    assert_series_is(c, order, h, linear_arc(u, v, p * p, alpha, motion, h))


@quick
@given(rotations, speeds, frequencies, slendernesses, motions, st.floats(1e-6, 1.0))
def test_what_a_linear_series_leaves_out_is_negligible(
    u: float, v: float, p: float, alpha: float, A: list[float], share: float
) -> None:
    motion = motion_over(A, share / p)
    c, order, h = linear_series(u, v, p * p, alpha, motion, share / p)
    full = [mp.mpf(float(x)) for x in c[:2]]
    for k in range(80):
        force = full[k] - (mp.mpf(float(motion[k])) if k < len(motion) else 0) - (mp.mpf(alpha) if k == 0 else 0)
        full.append(mp.mpf(p * p) * force / ((k + 1) * (k + 2)))
    sizes = [abs(x) * mp.mpf(h) ** k for k, x in enumerate(full)]
    assert sum(sizes[order + 1 :]) <= 4.0 * NEGLIGIBLE * max(sizes)


@quick
@given(rotations, speeds, frequencies, slendernesses, st.lists(numbers(-3.0, 3.0), min_size=1, max_size=4))
def test_a_nonlinear_series_solves_the_equation_of_motion(
    u: float, v: float, p: float, alpha: float, A: list[float]
) -> None:
    motion = motion_over(A, 1.0 / p)
    scratch, order, h = nonlinear_series(u, v, p * p, alpha, motion, 1.0 / p)
    assert 0.0 < h <= 1.0 / p
    assert_solves_the_nonlinear_equation(scratch[SERIES], order, h, p * p, alpha, motion)


@quick
@given(speeds, st.floats(10.0, 100.0), st.sampled_from([0.01, 1.0, 30.0]))
def test_a_violent_motion_shortens_the_step_until_the_series_converges(v: float, strength: float, p: float) -> None:
    motion = np.array([strength, -3.0 * p * strength])
    scratch, order, h = nonlinear_series(0.3, v * p, p * p, 0.4, motion, 1.0 / p)
    assert order == ORDER
    assert 0.02 / p < h < 1.0 / p
    last = max(abs(scratch[SERIES][k]) * h**k for k in (order - 1, order))
    assert last <= NEGLIGIBLE * max(abs(scratch[SERIES][k]) * h**k for k in range(order + 1))
    assert_solves_the_nonlinear_equation(scratch[SERIES], order, h, p * p, 0.4, motion)


@quick
@given(st.floats(0.0, 0.9), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_nonlinear_arc_of_a_slender_block_is_the_linear_one(u: float, v: float, a: float, slope: float) -> None:
    """Scaled by a small slenderness, the two differ by its square."""

    def difference(alpha: float) -> float:
        motion = alpha * np.array([a, slope])
        one, order, _ = linear_series(alpha * u, alpha * v, 1.0, alpha, motion, 0.5)
        other, other_order, _ = nonlinear_series(alpha * u, alpha * v, 1.0, alpha, motion, 0.5)
        return abs(evaluate(one, order, 0.5)[0] - evaluate(other[SERIES], other_order, 0.5)[0]) / alpha

    assert difference(1e-3) <= 1e-5
    assert difference(1e-5) <= 1e-9


@quick
@given(motions, numbers(0.0, 3.0), numbers(-2.0, 2.0))
def test_the_local_motion_is_the_same_polynomial_about_a_later_time(
    A: list[float], offset: float, factor: float
) -> None:
    local = np.full(len(A) + 2, np.nan)
    local_motion(np.array(A), offset, factor, 1.0, local)
    exact, sizes = ([f(Fraction(x) * Fraction(factor)) for x in A] for f in (lambda x: x, abs))
    for row in (exact, sizes):
        for k in range(len(row) - 1):
            for j in range(len(row) - 2, k - 1, -1):
                row[j] += Fraction(offset) * row[j + 1]
    for k, (value, size) in enumerate(zip(exact, sizes, strict=True)):
        assert abs(Fraction(local[k]) - value) <= len(A) * Fraction(ULP) * size
    assert np.all(np.isnan(local[len(A) :]))


def test_the_local_motion_drops_what_does_not_count_within_the_step() -> None:
    coefficients = np.array([1.0, 0.0, 1.0, 1e-3, 1e-30])
    assert local_motion(coefficients, 0.0, 1.0, 1.0, np.zeros(5)) == 3
    assert local_motion(coefficients, 0.0, 1.0, 1e-6, np.zeros(5)) == 2
    assert local_motion(coefficients, 0.0, 1.0, 1e-12, np.zeros(5)) == 1
    assert local_motion(coefficients[:1], 0.5, 1.0, 1.0, np.zeros(5)) == 0


@quick
@given(rotations, speeds, st.floats(-0.3, 0.3), st.floats(-1.0, 1.0), motions, st.booleans(), st.floats(0.3, 3.0))
def test_the_variation_is_the_derivative_by_the_strength_of_the_motion(
    u: float, v: float, du: float, dv: float, A: list[float], nonlinear: bool, p: float
) -> None:
    step = 0.5 / p
    motion = motion_over(A[:6], step)

    def end(strength: float) -> np.ndarray:
        start = u + strength * du, v + strength * dv
        if nonlinear:
            scratch, order, _ = nonlinear_series(*start, p * p, 0.3, (1.0 + strength) * motion, step)
            return np.array(evaluate(scratch[SERIES], order, h)[:2])
        c, order, _ = linear_series(*start, p * p, 0.3, (1.0 + strength) * motion, step)
        return np.array(evaluate(c, order, h)[:2])

    scratch, order, h = nonlinear_series(u, v, p * p, 0.3, motion, step)
    if nonlinear:
        found = vary_nonlinear(du, dv, p * p, len(motion) - 1, order, h, scratch)
    else:
        _, order, h = linear_series(u, v, p * p, 0.3, motion, step)
        found = vary_linear(du, dv, p * p, len(motion) - 1, order, h, scratch)
    strength = 1e-4
    difference = (8.0 * (end(strength) - end(-strength)) - end(2 * strength) + end(-2 * strength)) / (12.0 * strength)
    size = 1.0 + abs(np.array(found))
    assert np.all(np.abs(np.array(found) - difference) <= 1e-9 * size * np.array([1.0, p]))
