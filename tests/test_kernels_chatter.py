"""The certificate's parts: bounds on arcs, on motions, on the time to rest, against 60-digit arithmetic."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import multiprecision
from oracles.problem import Problem

from rocking.kernels.chatter import (
    arc_bounds,
    geometric_bracket,
    motion_range,
    piece_range,
    prove_rest,
    remaining_time,
    rest_shift,
    restoring,
    side_bounds,
    time_to_rest,
)
from rocking.kernels.state import GROUND, Shaking, new_scratch

GRAVITY = 9.80665

quick = settings(deadline=None, max_examples=60)
few = settings(deadline=None, max_examples=12)

models = st.sampled_from(["linear", "nonlinear"])


def between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_subnormal=False)


def either(low: float, high: float) -> st.SearchStrategy[tuple[float, float]]:
    """A pair for side + and side -."""
    return between(low, high).map(lambda x: (x, x)) | st.tuples(between(low, high), between(low, high))


def sides_of(problem: Problem) -> np.ndarray:
    rows = []
    for p, alpha, e in zip(problem.p, problem.alpha, problem.restitution, strict=True):
        linear = problem.model == "linear"
        threshold, gain = (alpha, p * p) if linear else (math.tan(alpha), p * p * math.cos(alpha))
        rows.append([p * p, alpha, threshold, gain, e, 0.0])
    return np.array(rows)


def shaking_of(problem: Problem, error: float = 0.0) -> Shaking:
    return Shaking(problem.breakpoints, problem.coefficients, 1.0 / GRAVITY, error / GRAVITY)


@st.composite
def problems(draw: st.DrawFn, *, pieces: int, columns: int = 2, jumps: bool = False) -> Problem:
    """Blocks that a motion of some pieces, then of one long one, presses down on both sides all the time."""
    model, p, alpha = draw(models), draw(either(0.5, 5.0)), draw(either(0.05, 0.5))
    widths = [draw(between(0.01, 0.1)) for _ in range(pieces - 1)]
    breakpoints = np.cumsum([0.0, *widths, 20.0])
    strongest = 0.9 * GRAVITY * min(alpha)
    values = [draw(between(-strongest, strongest)) for _ in range(2 * pieces)]
    rows = []
    for k in range(pieces):
        start = values[2 * k] if jumps or k == 0 else rows[-1][0] + rows[-1][1] * widths[k - 1]
        width = widths[k] if k < pieces - 1 else 20.0
        rows.append([start, (values[2 * k + 1] - start) / width, *[0.0] * (columns - 2)])
    return Problem(model, p, alpha, draw(either(0.05, 0.9)), breakpoints, np.array(rows))


def speed(problem: Problem, side: int, time: float, share: float) -> float:
    """Share of the speed beyond which a constant motion would overturn the block."""
    return share * problem.restoring(time, 1 - 2 * side) / problem.p[side]


@few
@given(problems(pieces=1), st.integers(0, 1), between(1e-4, 0.6))
def test_bounds_on_an_arc_hold_its_duration_and_its_impact(problem: Problem, side: int, share: float) -> None:
    v, i = speed(problem, side, 0.0, share), 1 - 2 * side
    window = 4.0 * v / problem.restoring(0.0, i)
    low, high, *others = motion_range(shaking_of(problem), 0, 0.0, window, new_scratch(2)[GROUND])
    in_g = (x / GRAVITY for x in (low, high, *others))
    bounds = side_bounds(sides_of(problem), side, problem.model == "nonlinear", *in_g)
    change, shortest, longest = arc_bounds(v, bounds)
    assume(longest <= window)
    soon_at_rest = replace(problem, restitution=(0.01, 0.01))
    time, _, w, _ = multiprecision.follow(soon_at_rest, velocity=i * v).impacts[0]
    assert shortest <= time <= longest
    assert abs((w / v) ** 2 - 1) <= change + 1e-50


@few
@given(problems(pieces=4, jumps=True), st.integers(0, 1), between(1e-5, 0.2), between(0.0, 0.3))
def test_the_bracket_holds_the_time_to_rest_whatever_jumps_lie_in_the_window(
    problem: Problem, side: int, share: float, start: float
) -> None:
    piece = int(np.searchsorted(problem.breakpoints, start, side="right")) - 1
    v = speed(problem, side, start, share)
    lower, upper = prove_rest(
        shaking_of(problem),
        sides_of(problem),
        problem.model == "nonlinear",
        new_scratch(2)[GROUND],
        v,
        side,
        piece,
        start - problem.breakpoints[piece],
    )
    assume(upper > 0.0)
    rest = multiprecision.rest_time(problem, start, 1 - 2 * side, v) - start
    assert lower <= rest <= upper


@few
@given(problems(pieces=2), st.integers(0, 1), between(1e-7, 1e-3), st.sampled_from([1e-9, 1e-3]))
def test_the_bracket_under_an_approximated_motion_holds_for_every_motion_so_near(
    problem: Problem, side: int, share: float, error: float
) -> None:
    """The true motion jumps to and fro within the error, in favour of the side that the block enters."""
    v, i = speed(problem, side, 0.0, share), 1 - 2 * side
    error *= GRAVITY * min(problem.alpha)
    lower, upper = prove_rest(
        shaking_of(problem, error),
        sides_of(problem),
        problem.model == "nonlinear",
        new_scratch(2)[GROUND],
        v,
        side,
        0,
        0.0,
    )
    assume(upper > 0.0)
    flight = 2.0 * v / problem.restoring(0.0, i)
    breakpoints = np.array([0.0, flight / 2.0, flight, problem.breakpoints[1]])
    assume(flight < problem.breakpoints[1])
    slope = problem.coefficients[0, 1]
    starts = problem.coefficients[0, 0] + slope * breakpoints[:3] + i * error * np.array([-1.0, 1.0, 0.0])
    true = replace(
        problem,
        breakpoints=np.append(breakpoints, problem.breakpoints[2]),
        coefficients=np.vstack([np.column_stack([starts, np.full(3, slope)]), problem.coefficients[1]]),
    )
    assert lower <= multiprecision.rest_time(true, 0.0, i, v) <= upper


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("slope, order", [(0.9, 3), (0.0, 5)], ids=["changing", "constant"])
def test_the_estimate_of_the_time_to_rest_is_accurate_to_its_order(
    model: str, side: int, slope: float, order: int
) -> None:
    """Of a two-sided block: second order in the speed under any motion, fourth under a constant one."""
    problem = Problem(model, (2.0, 3.0), (0.2, 0.15), (0.7, 0.5), np.array([0.0, 50.0]), np.array([[0.4, slope]]))
    speeds = 0.02 * 0.5 ** np.arange(5)
    errors = []
    for v in speeds:
        estimate = time_to_rest(shaking_of(problem), sides_of(problem), model == "nonlinear", v, side, 0, 0.0)
        errors.append(abs(float(multiprecision.rest_time(problem, 0.0, 1 - 2 * side, v) - estimate)))
    assert np.diff(np.log(errors[:3])) / np.diff(np.log(speeds[:3])) == pytest.approx(order, abs=0.1)


@quick
@given(between(1e-6, 10.0), either(0.01, 50.0), either(0.01, 0.99))
def test_the_estimate_for_a_block_without_stiffness_under_a_constant_motion_is_the_geometric_sum(
    v: float, g: tuple[float, float], e: tuple[float, float]
) -> None:
    expected = 2.0 * v / (1.0 - e[0] * e[1]) * (1.0 / g[0] + e[0] / g[1])
    assert remaining_time(v, *g, 0.0, 0.0, 0.0, 0.0, *e) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("side", [0, 1])
def test_the_shift_of_the_rest_is_its_derivative_by_the_strength_of_the_motion(model: str, side: int) -> None:
    """To first order in the speed, for any shift of the impact and any change of the speed after it."""
    problem = Problem(model, (2.0, 3.0), (0.2, 0.15), (0.7, 0.5), np.array([0.0, 50.0]), np.array([[0.4, 0.9]]))
    start, v, shift, faster, step = 1.0, 1e-5, 0.3, 2e-5, 1e-7

    def rest(strength: float) -> multiprecision.Number:
        scaled = replace(problem, coefficients=problem.coefficients * (1.0 + strength))
        return multiprecision.rest_time(scaled, start + strength * shift, 1 - 2 * side, v + strength * faster)

    sides = sides_of(problem)
    dv = faster + restoring(sides, side, problem.acceleration(start) / GRAVITY) * shift
    found = rest_shift(shaking_of(problem), sides, v, dv, shift, side, 0, start)
    slope = float((rest(step) - rest(-step)) / (2.0 * step))
    assert found - shift == pytest.approx(slope - shift, rel=1e-3)


@st.composite
def brackets(draw: st.DrawFn) -> tuple[float, list[list[float]], tuple[float, float]]:
    """Speed, bounds on both sides as `arc_bounds` takes them, restitutions."""
    sides = []
    for _ in range(2):
        m = draw(between(0.1, 10.0))
        widening = [draw(between(0.0, 1.0)) for _ in range(4)]
        sides.append([draw(between(0.1, 10.0)), m, m * (1.0 + widening[0]), *widening[1:]])
    return draw(between(1e-6, 1.0)), sides, draw(either(0.05, 0.95))


@quick
@given(brackets(), st.integers(0, 1), st.integers(0, 5), between(0.0, 1.0))
def test_wider_bounds_never_give_a_narrower_bracket(
    bracket: tuple[float, list[list[float]], tuple[float, float]], side: int, which: int, more: float
) -> None:
    v, sides, e = bracket
    lower, upper = geometric_bracket(v, tuple(sides[0]), tuple(sides[1]), *e)
    sides[side][which] *= 1.0 - 0.5 * more if which == 1 else 1.0 + more
    wider_lower, wider_upper = geometric_bracket(v, tuple(sides[0]), tuple(sides[1]), *e)
    assert math.isnan(wider_upper) or wider_lower <= lower * (1.0 + 1e-14) <= upper <= wider_upper * (1.0 + 1e-14)


def test_a_constant_motion_of_little_stiffness_leaves_only_rounding_between_the_bounds() -> None:
    bounds = (1e-20, 3.0, 3.0, 0.0, 0.0, 0.0)
    lower, upper = geometric_bracket(0.6, bounds, bounds, 0.5, 0.8)
    assert lower == pytest.approx(0.4 * 1.5 / 0.6, rel=1e-13)
    assert lower < 0.4 * 1.5 / 0.6 < upper < lower * (1.0 + 1e-13)


STEADY = (1.0, 2.0, 2.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "v, first, second, e",
    [
        (0.1, (1.0, 0.0, 2.0, 0.0, 0.0, 0.0), STEADY, 0.5),
        (0.1, STEADY, (1.0, -1.0, 2.0, 0.0, 0.0, 0.0), 0.5),
        (2.0, STEADY, STEADY, 0.5),
        (0.1, STEADY, STEADY, 1.0),
        (0.1, (1.0, 2.0, 3.0, 1.5, math.inf, 0.0), STEADY, 0.9),
        (0.1, (math.nan, 2.0, 3.0, 0.0, 0.0, 0.0), STEADY, 0.5),
        (0.1, STEADY, (1.0, math.nan, 3.0, 0.0, 0.0, 0.0), 0.5),
    ],
    ids=["pushed off", "pushed off the other side", "too fast", "elastic", "gains energy", "unknown", "unknown too"],
)
def test_where_a_condition_fails_nothing_is_proven(
    v: float, first: tuple[float, ...], second: tuple[float, ...], e: float
) -> None:
    assert np.all(np.isnan(geometric_bracket(v, first, second, e, e)))
    assert np.all(np.isfinite(geometric_bracket(0.1, STEADY, STEADY, 0.5, 0.5)))


def test_a_window_over_too_many_pieces_proves_nothing_until_the_block_is_slower() -> None:
    count = 400
    problem = Problem(
        "linear", (2.0, 2.0), (0.2, 0.2), (0.9, 0.9), 1e-4 * np.arange(count + 1), np.full((count, 1), 0.1)
    )
    arguments = shaking_of(problem), sides_of(problem), False, new_scratch(1)[GROUND]
    assert np.all(np.isnan(prove_rest(*arguments, 5e-3, 0, 0, 0.0)))
    assert np.all(np.isfinite(prove_rest(*arguments, 1e-4, 0, 0, 0.0)))


def test_a_jump_just_past_the_end_of_a_window_is_not_ruled_out() -> None:
    """Times are rounded to their last place: a jump that is nearer to the end of the window than that counts."""
    late, length = 2.0**20, 1.0
    rows = np.array([[0.0, 0.0], [-0.5 * GRAVITY, 0.0]])
    problem = Problem("linear", (2.0, 2.0), (0.2, 0.2), (0.5, 0.5), np.array([late, late + length, late + 9.0]), rows)
    shaking, sides, A = shaking_of(problem), sides_of(problem), new_scratch(2)[GROUND]
    v = 1e-8
    window = 1.5 * 2.0 * v * 1.5 / 0.8 / 0.75
    assert np.isfinite(prove_rest(shaking, sides, False, A, v, 0, 0, length - 1e-6)[1])
    assert np.isnan(prove_rest(shaking, sides, False, A, v, 0, 0, length - 0.9 * window)[1])
    assert np.isnan(prove_rest(shaking, sides, False, A, v, 0, 0, length - window - 1e-9)[1])


polynomials = st.lists(between(-10.0, 10.0), min_size=1, max_size=14)


@quick
@given(polynomials, between(0.0, 2.0), between(1e-3, 1.0))
def test_the_range_of_a_piece_holds_all_its_values(A: list[float], offset: float, window: float) -> None:
    low, high, steepest, _ = piece_range(np.array(A), offset, window, new_scratch(len(A))[GROUND])
    polynomial = np.polynomial.Polynomial(A)
    times = offset + window * np.linspace(0.0, 1.0, 101)
    assert low <= np.min(polynomial(times))
    assert np.max(polynomial(times)) <= high
    assert np.max(np.abs(polynomial.deriv()(times))) <= steepest
    if len(A) == 2:
        assert high - low == pytest.approx(abs(A[1]) * window, rel=1e-9, abs=1e-12)


def test_the_range_of_a_piece_allows_for_the_rounding_of_large_terms_that_cancel() -> None:
    row, offset = np.array([1e3, -1e5]), 0.01 + 1e-12
    low, high, _, _ = piece_range(row, offset, 0.0, new_scratch(2)[GROUND])
    exact = Fraction(row[0]) + Fraction(row[1]) * Fraction(offset)
    assert Fraction(low) < exact < Fraction(high)
    assert high - low < 1e-10


@quick
@given(problems(pieces=4, columns=3, jumps=True), between(0.0, 0.4), between(1e-3, 0.5))
def test_the_range_of_a_motion_holds_all_its_values_and_changes(problem: Problem, start: float, window: float) -> None:
    shaking = shaking_of(problem)
    piece = int(np.searchsorted(problem.breakpoints, start, side="right")) - 1
    offset = start - problem.breakpoints[piece]
    low, high, steepest, leap = motion_range(shaking, piece, offset, window, new_scratch(3)[GROUND])
    times = start + np.sort(np.append(window * np.linspace(0.0, 1.0 - 1e-9, 301), 0.0))  # a jump may end the window
    values = np.array([problem.acceleration(t) for t in times])
    assert low <= np.min(values)
    assert np.max(values) <= high
    assert np.all(np.abs(np.diff(values)) <= steepest * np.diff(times) * (1.0 + 1e-9) + leap + 1e-14)


def test_after_the_motion_the_range_is_zero() -> None:
    problem = Problem("linear", (2.0, 2.0), (0.2, 0.2), (0.5, 0.5), np.array([0.0, 1.0]), np.array([[0.5, 0.2]]))
    A = new_scratch(2)[GROUND]
    assert motion_range(shaking_of(problem), 1, 0.3, 5.0, A) == (0.0, 0.0, 0.0, 0.0)
    low, high, steepest, leap = motion_range(shaking_of(problem), 0, 0.5, 5.0, A)
    assert (low, high, steepest) == (0.0, pytest.approx(0.7), 0.2)
    assert leap == pytest.approx(0.7)


@quick
@given(problems(pieces=1), st.integers(0, 1))
def test_the_restoring_acceleration_is_that_of_the_equation_of_motion(problem: Problem, side: int) -> None:
    here = problem.acceleration(0.0) / GRAVITY
    expected = problem.restoring(0.0, 1 - 2 * side)
    size = problem.p[side] ** 2 * (problem.alpha[side] + abs(here))
    assert restoring(sides_of(problem), side, here) == pytest.approx(expected, abs=1e-15 * size)
