"""The bracket of higher order on the time to rest, and the arcs of a proven sequence."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st
from oracles import multiprecision, one_piece
from oracles.cases import between
from oracles.problem import Problem

from rocking.kernels.remaining import (
    ImpactSide,
    bound_ratio,
    bound_restoring_error,
    estimate_remaining_time,
    refine_bracket,
)
from rocking.kernels.rest import MAX_BETA, MAX_GAMMA, solve_proven_arc

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

GRAVITY = 9.80665
FOREVER = 1e9

many = settings(deadline=None, max_examples=25)
quick = settings(
    deadline=None, max_examples=30, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)
few = settings(deadline=None, max_examples=12)

Sides = tuple[ImpactSide, ImpactSide]


def signed(low: float, high: float) -> st.SearchStrategy[float]:
    """Powers of ten from low to high, of either sign, or zero."""
    size = between(low, high).map(lambda x: 10.0**x)
    return st.tuples(size, st.sampled_from([1.0, -1.0, 0.0])).map(lambda pair: pair[0] * pair[1])


@st.composite
def sequences(draw: st.DrawFn, *, weakest: float = -5.0, bent: bool = True) -> tuple[float, Sides]:
    """Speed and sides; both are one for a body that bounces on one side. Changes are in units of the first estimate."""
    one_sided = draw(st.booleans())
    g = [10.0 ** draw(between(-0.5, 1.0)) for _ in range(2)]
    e = [draw(between(0.3, 0.99)) for _ in range(2)]
    if one_sided:
        g[1], e[1] = g[0], e[0]
    v = 10.0 ** draw(between(-6.0, 0.0))
    s = 2.0 * v * (1.0 / g[0] + e[0] / g[1]) / (1.0 - e[0] * e[1])
    sides = [
        ImpactSide(
            g[k],
            draw(signed(weakest, -0.3)) * g[k] / s,
            draw(signed(weakest, -0.6)) * g[k] / s**2 if bent else 0.0,
            draw(signed(-4.0, 1.5)) / s**2,
            e[k],
            0.0,
        )
        for k in range(2)
    ]
    return v, (sides[0], sides[0] if one_sided else sides[1])


def exact(v: float, sides: Sides) -> one_piece.Number:
    return one_piece.rest_time(v, (sides[0][:5], sides[1][:5]))


@few
@given(sequences())
def test_the_bracket_holds_the_time_to_rest(case: tuple[float, Sides]) -> None:
    v, sides = case
    lower, upper = refine_bracket(v, *sides, FOREVER)
    event("proven" if upper > 0.0 else "not proven")
    assume(upper > 0.0)
    assert lower <= exact(v, sides) <= upper


@pytest.mark.cases(fast=3, thorough=4)
@pytest.mark.parametrize("stiffness", [9.0, 0.0, -9.0])
@pytest.mark.parametrize("one_sided", [True, False])
def test_width_and_error_fall_with_the_fifth_power_of_the_speed(stiffness: float, one_sided: bool) -> None:
    i = ImpactSide(2.0, 30.0, 40.0, stiffness, 0.8, 0.0)
    j = i if one_sided else ImpactSide(1.5, -40.0, 20.0, 1.5 * stiffness, 0.7, 0.0)
    speeds = 2e-4 * 0.5 ** np.arange(4)
    widths, errors = [], []
    for v in speeds:
        lower, upper = refine_bracket(v, i, j, FOREVER)
        widths.append(upper - lower)
        errors.append(abs(float(exact(v, (i, j)) - 0.5 * (lower + upper))))
    assert np.diff(np.log2(widths)) == pytest.approx(-5.0, abs=0.25)
    assert np.diff(np.log2(errors)) == pytest.approx(-5.0, abs=0.4)
    assert widths[-1] < 40.0 * errors[-1]


@quick
@given(sequences())
def test_a_body_without_stiffness_under_a_constant_motion_rests_at_the_geometric_sum(case: tuple[float, Sides]) -> None:
    v, sides = case
    i, j = (side._replace(rate=0.0, curvature=0.0, stiffness=0.0) for side in sides)
    expected = 2.0 * v / (1.0 - i.restitution * j.restitution) * (1.0 / i.g + i.restitution / j.g)
    lower, upper = refine_bracket(v, i, j, FOREVER)
    assert lower <= expected * (1.0 + 1e-14) and expected * (1.0 - 1e-14) <= upper
    assert upper - lower <= 1e-10 * expected
    assert estimate_remaining_time(v, i, j) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(
    "stiffness, slope, order",
    [
        (4.0, 0.9, 3),
        (-4.0, 0.0, 5),
        pytest.param(-4.0, 0.9, 3, marks=pytest.mark.thorough),
        pytest.param(4.0, 0.0, 5, marks=pytest.mark.thorough),
    ],
)
def test_the_estimate_is_accurate_to_its_order(stiffness: float, slope: float, order: int) -> None:
    i = ImpactSide(1.0, 4.0 * slope, 0.0, stiffness, 0.7, 0.0)
    j = ImpactSide(1.3, -9.0 * slope, 0.0, 2.0 * stiffness, 0.5, 0.0)
    speeds = (0.001 if slope else 0.02) * 0.5 ** np.arange(4)
    errors = [abs(float(exact(v, (i, j)) - estimate_remaining_time(v, i, j))) for v in speeds]
    assert np.diff(np.log2(errors)) == pytest.approx(-order, abs=0.2)


def disturbed_rest(v: float, sides: Sides, size: float, shape: str) -> float:
    """Time to rest while the restoring acceleration is off by a constant or changes sign halfway along each arc."""
    time, k = 0.0, 0
    while v > 1e-18:
        side = sides[k % 2]
        first, second = (size, size) if shape == "constant" else (-size, size)
        half = (v - 0.5 * first * v / side.g) / side.g
        tau, w = halves(v, side.g + side.rate * time, side.rate, first, second, half)
        time, v, k = time + tau, side.restitution * w, k + 1
    return time


def halves(v: float, g: float, rate: float, first: float, second: float, half: float) -> tuple[float, float]:
    """Duration and impact speed under g + rate t, plus one constant up to the time half and another one after it."""
    tau = 2.0 * v / g
    step = second - first
    for _ in range(50):
        late = max(0.0, tau - half)
        height = v * tau - 0.5 * (g + first) * tau**2 - rate * tau**3 / 6.0 - 0.5 * step * late**2
        slope = v - (g + first) * tau - 0.5 * rate * tau**2 - step * late
        tau -= height / slope
    return tau, (g + first) * tau + 0.5 * rate * tau**2 + step * max(0.0, tau - half) - v


@pytest.mark.parametrize("shape", ["constant", "swing"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("e", [(0.9, 0.9), (0.5, 0.8)])
@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_the_bracket_holds_the_time_to_rest_under_any_disturbance_within_the_error(
    shape: str, sign: float, e: tuple[float, float], rate: float
) -> None:
    v, size = 1e-3, 1e-7
    i, j = ImpactSide(2.0, rate, 0.0, 0.0, e[0], size), ImpactSide(1.5, -rate, 0.0, 0.0, e[1], size)
    lower, upper = refine_bracket(v, i, j, FOREVER)
    plain_lower, plain_upper = refine_bracket(v, i._replace(error=0.0), j._replace(error=0.0), FOREVER)
    rest = disturbed_rest(v, (i, j), sign * size, shape)
    assert lower <= rest <= upper
    if shape == "swing" and rate == 0.0:
        assert abs(rest - 0.5 * (lower + upper)) > 0.38 * (upper - lower)
    assert not plain_lower <= rest <= plain_upper


@settings(quick, max_examples=10)
@given(sequences(weakest=-3.0), st.sampled_from([1.0, -1.0]))
def test_a_curvature_left_out_is_an_error_of_its_own(case: tuple[float, Sides], sign: float) -> None:
    v, sides = case
    T = 1.5 * estimate_remaining_time(v, sides[0]._replace(rate=0.0), sides[1]._replace(rate=0.0))
    known = [
        side._replace(curvature=0.0, rate=0.1 * side.rate, stiffness=0.0, error=abs(side.curvature) * T * T)
        for side in sides
    ]
    lower, upper = refine_bracket(v, known[0], known[1], T)
    assume(upper > 0.0)
    true = [one._replace(curvature=sign * abs(side.curvature)) for one, side in zip(known, sides, strict=True)]
    assert lower <= exact(v, (true[0], true[1])) <= upper


def nonlinear_sides(problem: Problem, v: float, window: float, first: int) -> Sides:
    """Both sides at time zero, under a motion of one linear piece, with all that the nonlinear model deviates."""
    here, slope = (c / GRAVITY for c in problem.coefficients[0])
    sides = []
    for i in (first, -first):
        p, alpha, e = problem.side(i)
        square = p * p
        g = square * (math.sin(alpha) + i * here * math.cos(alpha))
        rate = square * i * slope * math.cos(alpha)
        stiffness = square * (math.cos(alpha) - i * here * math.sin(alpha))
        most = max(abs(here), abs(here + slope * window))
        least = min(g, g + rate * window)
        height = 1.1 * v * v / least
        error = bound_restoring_error(
            0.0, square * abs(slope) * math.sin(alpha) * window, square * math.hypot(1.0, most), height
        )
        sides.append(ImpactSide(g, rate, 0.0, stiffness, e, error))
    return sides[0], sides[1]


@few
@given(
    between(1.0, 5.0),
    st.tuples(between(0.1, 1.4), between(0.1, 1.4)),
    st.tuples(between(0.3, 0.8), between(0.3, 0.8)),
    st.tuples(between(-0.9, 0.9), between(-1.0, 1.0)),
    between(-4.0, -1.0),
    st.sampled_from([1, -1]),
)
def test_the_bracket_holds_the_time_to_rest_of_a_nonlinear_block(
    p: float, alpha: tuple[float, float], e: tuple[float, float], push: tuple[float, float], size: float, first: int
) -> None:
    """Also of a bulky one under an acceleration of several g, which enters the bound on the curvature in u."""
    threshold = GRAVITY * math.tan(min(alpha))
    motion = np.array([[push[0] * threshold, push[1] * threshold]])
    problem = Problem("nonlinear", (p, 0.8 * p), alpha, e, np.array([0.0, 50.0]), motion)
    v = 10.0**size * problem.restoring(0.0, first) / p
    window = 3.0 * v / (1.0 - e[0] * e[1]) * sum(1.0 / problem.restoring(0.0, i) for i in (1, -1))
    assume(min(problem.restoring(window, i) for i in (1, -1)) > 0.0)
    i, j = nonlinear_sides(problem, v, window, first)
    lower, upper = refine_bracket(v, i, j, window)
    assume(upper > 0.0)
    assert lower <= multiprecision.rest_time(problem, 0.0, first, v) <= upper


@quick
@given(between(0.1, 1.4), between(-4.0, 4.0), between(0.0, 0.5))
def test_what_a_nonlinear_block_deviates_by_is_bounded_closely(alpha: float, a: float, height: float) -> None:
    g = math.sin(alpha) + a * math.cos(alpha)
    stiffness = math.cos(alpha) - a * math.sin(alpha)
    bound = bound_restoring_error(0.0, 0.0, math.hypot(1.0, a), height)
    for u in np.linspace(0.0, height, 7):
        G = math.sin(alpha - u) + a * math.cos(alpha - u)
        assert abs(G - (g - stiffness * u)) <= bound + 1e-15
    steep = math.atan2(1.0, abs(a))
    worst = math.sin(steep - 1e-3) + abs(a) * math.cos(steep - 1e-3)
    linear = math.sin(steep) + abs(a) * math.cos(steep) - 1e-3 * (math.cos(steep) - abs(a) * math.sin(steep))
    assert abs(worst - linear) == pytest.approx(bound_restoring_error(0.0, 0.0, math.hypot(1.0, a), 1e-3), rel=1e-5)


def test_nothing_is_claimed_where_a_hypothesis_fails() -> None:
    side = ImpactSide(2.0, 10.0, 0.0, 9.0, 0.9, 0.0)
    fine = refine_bracket(1e-4, side, side, FOREVER)
    assert fine[1] > fine[0] > 0.0
    bad = [
        (1e-4, side, side, 0.99 * fine[1]),
        (1e-4, side._replace(g=-2.0), side, FOREVER),
        (1e-4, side, side._replace(g=0.0), FOREVER),
        (1e-4, side._replace(rate=-1e4), side, FOREVER),
        (1e-4, side._replace(curvature=-1e7), side, FOREVER),
        (1e-4, side._replace(stiffness=1e9), side, FOREVER),
        (1e-4, side._replace(stiffness=-1e9), side, FOREVER),
        (1e-4, side._replace(error=1e-2), side, FOREVER),
        (1e-4, side._replace(restitution=1.0), side._replace(restitution=1.0), FOREVER),
        (0.0, side, side, FOREVER),
        (-1e-4, side, side, FOREVER),
        (math.nan, side, side, FOREVER),
        (math.inf, side, side, FOREVER),
    ]
    for v, i, j, window in bad:
        assert all(math.isnan(bound) for bound in refine_bracket(v, i, j, window)), (v, i, j, window)


@many
@given(between(-6.0, 1.0), between(-1.0, 1.3), between(-1.0, 1.0), between(-1.0, 1.0))
def test_an_arc_of_a_proven_sequence_is_right_to_a_few_ulp(size: float, pull: float, beta: float, gamma: float) -> None:
    v, g = 10.0**size, 10.0**pull
    rate = beta * (1.0 - 1e-12) * MAX_BETA * g * g / v
    stiffness = gamma * (1.0 - 1e-12) * MAX_GAMMA * (g / v) ** 2
    tau, w = solve_proven_arc(v, g, rate, stiffness)
    true_tau, true_w = one_piece.arc(one_piece.mp.mpf(v), one_piece.mp.mpf(0), (g, rate, 0.0, stiffness, 1.0))
    assert abs(tau / true_tau - 1) <= 3 * 2.0**-52
    assert abs(w / true_w - 1) <= 2.0**-52


def test_an_arc_out_of_the_reach_of_its_sums_is_refused() -> None:
    assert math.isnan(solve_proven_arc(1.0, 1.0, 1.01 * MAX_BETA, 0.0)[0])
    assert math.isnan(solve_proven_arc(1.0, 1.0, 0.0, -1.01 * MAX_GAMMA)[0])
    assert math.isnan(solve_proven_arc(1.0, 0.0, 0.0, 0.0)[0])


@quick
@given(
    between(1e-6, 10.0),
    st.tuples(between(0.01, 50.0), between(0.01, 50.0)),
    st.tuples(between(0.01, 0.99), between(0.01, 0.99)),
)
def test_the_estimate_without_stiffness_under_a_constant_motion_is_the_geometric_sum(
    v: float, g: tuple[float, float], e: tuple[float, float]
) -> None:
    expected = 2.0 * v / (1.0 - e[0] * e[1]) * (1.0 / g[0] + e[0] / g[1])
    sides = [ImpactSide(g[k], 0.0, 0.0, 0.0, e[k], 0.0) for k in range(2)]
    assert estimate_remaining_time(v, *sides) == pytest.approx(expected, rel=1e-14)


def test_the_ratio_of_remaining_times_allows_for_every_term_and_shift():
    """Each by what it is, but a small margin."""
    none = (0.0, 0.0, 0.0)
    assert bound_ratio((0.5, 0.0, 0.0, 0.0), none, none) == 0.5
    for k, term in ((1, 0.2), (2, 0.1), (3, -0.05)):
        series = tuple(0.5 if j == 0 else term if j == k else 0.0 for j in range(4))
        assert abs(term) < bound_ratio(series, none, none) - 0.5 < 1.5 * abs(term)
    for shift, following in (((0.1, 0.0, 0.0), none), ((0.0, 0.1, 0.0), none), (none, (0.0, 0.1, 0.0))):
        assert bound_ratio((0.5, 0.0, 0.0, 0.0), shift, following) == pytest.approx(0.6)
    assert math.isnan(bound_ratio((0.5, 0.6, 0.0, 0.0), none, none))
