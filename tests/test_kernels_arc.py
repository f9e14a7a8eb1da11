"""The Taylor series of arcs: against closed forms, high precision, and each other."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import in_units_of_g, numbers, one_sided, rocking_block, rules_for, state_of
from oracles.taylor import System, after, coefficients, mp

from rocking.kernels import arc
from rocking.kernels.arc import evaluate_series, expand_arc, find_converged_order, find_linear_order, find_step_length
from rocking.kernels.series import write_linear_coefficients
from rocking.kernels.state import ORDER, Struct, create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

ULP = 2.0**-52

quick = settings(deadline=None, max_examples=40)


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
    u: float, v: float, lam: float, gain: float, threshold: float, A: np.ndarray, h: float
) -> tuple[np.ndarray, int, float]:
    """Series, its order and the step, as for an arc of a response."""
    scratch, start = create_scratch(), state_of(0, u, v)
    scratch["ground"][: len(A)] = A
    degree = len(A) - 1
    order = find_linear_order(lam, h) if degree <= 1 else ORDER
    body = one_sided(lam, gain, threshold, 0.5)
    write_linear_coefficients(body, start, scratch, degree, order)
    if degree > 1:
        order = find_converged_order(scratch["rotation"], degree, h)
        if order > ORDER:
            scratch["weight"][0] = 1.0
            order, h = ORDER, arc.shorten_step(body, rules_for(), 0, scratch, (degree, 0), h)
    return scratch["rotation"], order, h


def nonlinear_series(
    u: float, v: float, lam: float, alpha: float, A: np.ndarray, h: float
) -> tuple[Struct, int, float]:
    scratch, p = create_scratch(), lam**0.5
    scratch["ground"][: len(A)] = A
    scratch["weight"][0] = 1.0
    block = rocking_block((p, p), (alpha, alpha), nonlinear=True)
    block["stiffness"] = lam
    order, h = arc.expand_with_bound(block, rules_for(nonlinear=True), state_of(0, u, v), scratch, (len(A) - 1, 0), h)
    return scratch["rotation"], order, h


def assert_series_is(c: np.ndarray, order: int, t: float, expected: tuple[mpmath.mpf, mpmath.mpf]) -> None:
    rotation, speed, _ = evaluate_series(c, order, t)
    rounding = 0.5 * ULP * order * terms(c, order, t)
    assert abs(rotation - expected[0]) <= rounding
    assert abs(speed - expected[1]) * t <= order * rounding


#: lambda h^2 over the longest step, of a block, an oscillator with a stop and a ball, and the gain over p^2.
STIFFNESSES = (1.0, -1.0, 0.0)
stiffnesses = st.sampled_from(STIFFNESSES)
gains = st.floats(0.1, 3.0)


@pytest.mark.parametrize("examples", [5, pytest.param(20, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("sign", STIFFNESSES)
def test_a_linear_series_is_the_solution(examples: int, sign: float) -> None:
    judged = []

    @settings(quick, max_examples=examples)
    @given(rotations, speeds, frequencies, gains, slendernesses, motions, st.floats(0.01, 1.0))
    def judge(u: float, v: float, p: float, gain: float, threshold: float, A: list[float], share: float) -> None:
        motion = motion_over(A, share / p)
        lam, gain = sign * p * p, gain * p * p
        c, order, h = linear_series(u, v, lam, gain, threshold, motion, share / p)
        assert 0.0 < h <= share / p
        assert_series_is(c, order, h, after(System(lam, threshold, gain=gain), u, v, h, list(motion)))
        judged.append(len(A))

    judge()
    assert len(judged) >= examples and len(set(judged)) >= 2


@quick
@given(rotations, speeds, frequencies, stiffnesses, slendernesses, motions, st.floats(1e-6, 1.0))
def test_what_a_linear_series_leaves_out_is_negligible(
    u: float, v: float, p: float, sign: float, alpha: float, A: list[float], share: float
) -> None:
    motion = motion_over(A, share / p)
    _, order, h = linear_series(u, v, sign * p * p, p * p, alpha, motion, share / p)
    full = coefficients(System(sign * p * p, alpha, gain=p * p), u, v, list(motion), order=80)
    sizes = [abs(x) * mp.mpf(h) ** k for k, x in enumerate(full)]
    assert sum(sizes[order + 1 :]) <= 4.0 * arc.NEGLIGIBLE * max(sizes)


@quick
@given(rotations, speeds, frequencies, slendernesses, st.lists(numbers(-3.0, 3.0), min_size=1, max_size=4))
def test_a_nonlinear_series_solves_the_equation_of_motion(
    u: float, v: float, p: float, alpha: float, A: list[float]
) -> None:
    motion = motion_over(A, 1.0 / p)
    c, order, h = nonlinear_series(u, v, p * p, alpha, motion, 1.0 / p)
    assert 0.0 < h <= 1.0 / p
    assert_solves_the_nonlinear_equation(c, order, h, p * p, alpha, motion)


@quick
@given(speeds, st.floats(10.0, 100.0), st.sampled_from([0.01, 1.0, 30.0]))
def test_a_violent_motion_shortens_the_step_until_the_series_converges(v: float, strength: float, p: float) -> None:
    motion = np.array([strength, -3.0 * p * strength])
    c, order, h = nonlinear_series(0.3, v * p, p * p, 0.4, motion, 1.0 / p)
    assert order == ORDER
    assert 0.02 / p < h < 1.0 / p
    assert_solves_the_nonlinear_equation(c, order, h, p * p, 0.4, motion)


@quick
@given(st.floats(0.0, 0.9), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_nonlinear_arc_of_a_slender_block_is_the_linear_one(u: float, v: float, a: float, slope: float) -> None:
    """Scaled by a small slenderness, the two differ by its square."""

    def difference(alpha: float) -> float:
        motion = alpha * np.array([a, slope])
        one, order, _ = linear_series(alpha * u, alpha * v, 1.0, 1.0, alpha, motion, 0.5)
        other, other_order, _ = nonlinear_series(alpha * u, alpha * v, 1.0, alpha, motion, 0.5)
        return abs(evaluate_series(one, order, 0.5)[0] - evaluate_series(other, other_order, 0.5)[0]) / alpha

    assert difference(1e-3) <= 1e-5
    assert difference(1e-5) <= 1e-9


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("columns", [1, 2, 3, 9])
def test_an_arc_takes_the_motion_about_its_start_and_in_the_frame_of_its_side(
    nonlinear: bool, side: int, columns: int
) -> None:
    row, offset, h = 0.1 * (-0.5) ** np.arange(columns), 0.3, 0.02
    alpha, sign = 0.2 + 0.1 * side, 1.0 - 2.0 * side
    block = rocking_block((2.0, 3.0), (0.2, 0.3), nonlinear=nonlinear)
    scratch, start = create_scratch(), state_of(side, 0.05, 0.1, piece=1, offset=offset)
    ground = in_units_of_g([0.0, 1.0, 2.0], [9.0 + 0.0 * row, row])
    order, step, _ = expand_arc(ground, block, rules_for(nonlinear=nonlinear), scratch, start, h)
    assert step == h
    u, _, w = evaluate_series(scratch["rotation"], order, h)
    a = sign * np.polynomial.Polynomial(row)(offset + h)
    lam = (4.0, 9.0)[side]
    expected = -lam * (np.sin(alpha - u) + a * np.cos(alpha - u)) if nonlinear else lam * (u - alpha - a)
    assert w == pytest.approx(expected, rel=1e-13)
    assert scratch["rotation"][:2].tolist() == [0.05, 0.1]


def test_a_step_from_an_impact_is_no_longer_than_its_arc_and_some_margin() -> None:
    ground = in_units_of_g([0.0, 9.0], [[0.1, 0.0]])
    block = rocking_block((2.0, 2.0), (0.2, 0.2))
    assert find_step_length(ground, block, state_of(0, 0.0, 1e-3), 9.0) == pytest.approx(1.3 * 2e-3 / (4.0 * 0.3))
    assert find_step_length(ground, block, state_of(0, 0.0, 1e-3), 1e-4) == 1e-4
    assert find_step_length(ground, block, state_of(0, 0.0, 9.0), 9.0) == 0.5
    assert find_step_length(ground, block, state_of(0, 1e-9, 1e-3), 9.0) == 0.5
    pushed = in_units_of_g([0.0, 9.0], [[-0.3, 0.0]])
    assert find_step_length(pushed, block, state_of(0, 0.0, 1e-3), 9.0) == 0.5
