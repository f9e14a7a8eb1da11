"""The certificate's parts: bounds on arcs and on the time to rest, against 60-digit arithmetic."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kernel_structs import (
    GRAVITY,
    block_of,
    ground_of,
    in_units_of_g,
    long_uncompiled,
    rocking_block,
    rules_for,
    state_of,
)
from oracles import multiprecision
from oracles.cases import between
from oracles.problem import Problem

from rocking.kernels.arc import compute_restoring, write_weight_series
from rocking.kernels.certificate import (
    Horizon,
    MotionBounds,
    Proof,
    RestoringBounds,
    bound_arc,
    bound_motion,
    bound_side,
    bracket_geometrically,
    fit_restoring_parabola,
    prove_rest,
    widen_for_drag,
    widen_for_error,
)
from rocking.kernels.ground import AccelerationBounds, bound_window, select_vertical, write_local_series
from rocking.kernels.state import create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

#: Limits that no motion passes.
ANYTHING = (-math.inf, math.inf)

quick = settings(deadline=None, max_examples=30)
few = settings(deadline=None, max_examples=12)

models = st.sampled_from(["linear", "nonlinear"])


def either(low: float, high: float) -> st.SearchStrategy[tuple[float, float]]:
    """A pair for side + and side -."""
    return between(low, high).map(lambda x: (x, x)) | st.tuples(between(low, high), between(low, high))


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


#: Bounds on a component that does not move.
STILL = AccelerationBounds(0.0, 0.0, 0.0, 0.0)

#: How narrow a bracket must be, so that the one by comparison is enough, and so that the one of higher order is tried.
ANY, NARROWEST = math.inf, 0.0
tolerances = st.sampled_from([ANY, NARROWEST])


def proof(
    problem: Problem,
    v: float,
    side: int,
    *,
    piece: int = 0,
    offset: float = 0.0,
    error: float = 0.0,
    tolerance: float = ANY,
) -> Proof:
    rules = rules_for(nonlinear=problem.model == "nonlinear", tolerance=tolerance)
    start = state_of(side, 0.0, v, piece=piece, offset=offset)
    return prove_rest(ground_of(problem, error), block_of(problem), rules, create_scratch(), start)


@long_uncompiled
@few
@given(problems(pieces=1), st.integers(0, 1), between(1e-4, 0.6))
def test_bounds_on_an_arc_hold_its_duration_and_its_impact(problem: Problem, side: int, share: float) -> None:
    v, i = speed(problem, side, 0.0, share), 1 - 2 * side
    window = 4.0 * v / problem.restoring(0.0, i)
    seen = bound_window(ground_of(problem), 0, 0.0, window, ANYTHING, create_scratch()["ground"])
    rules = rules_for(nonlinear=problem.model == "nonlinear")
    change, shortest, longest = bound_arc(v, bound_side(block_of(problem), rules, side, MotionBounds(seen, STILL)))
    assume(longest <= window)
    soon_at_rest = replace(problem, restitution=(0.01, 0.01))
    time, _, w, _ = multiprecision.follow(soon_at_rest, velocity=i * v).impacts[0]
    assert shortest <= time <= longest
    assert abs((w / v) ** 2 - 1) <= change + 1e-50


@long_uncompiled
@few
@given(problems(pieces=4, jumps=True), st.integers(0, 1), between(1e-5, 0.2), between(0.0, 0.3), tolerances)
def test_the_bracket_holds_the_time_to_rest_whatever_jumps_lie_in_the_window(
    problem: Problem, side: int, share: float, start: float, tolerance: float
) -> None:
    piece = int(np.searchsorted(problem.breakpoints, start, side="right")) - 1
    v = speed(problem, side, start, share)
    found = proof(problem, v, side, piece=piece, offset=start - problem.breakpoints[piece], tolerance=tolerance)
    assume(found.upper > 0.0)
    rest = multiprecision.rest_time(problem, start, 1 - 2 * side, v) - start
    assert found.lower <= rest <= found.upper
    assert found.lower <= found.time <= found.upper


@long_uncompiled
@few
@given(problems(pieces=1, columns=4), st.integers(0, 1), between(1e-6, 1e-2))
def test_the_bracket_of_higher_order_is_within_the_one_by_comparison_and_holds_the_rest(
    problem: Problem, side: int, share: float
) -> None:
    v = speed(problem, side, 0.0, share)
    wide, narrow = (proof(problem, v, side, tolerance=tolerance) for tolerance in (ANY, NARROWEST))
    assume(wide.upper > 0.0)
    assert wide.lower <= narrow.lower <= narrow.upper <= wide.upper
    assert narrow.lower <= multiprecision.rest_time(problem, 0.0, 1 - 2 * side, v) <= narrow.upper


@long_uncompiled
@few
@given(problems(pieces=2), st.integers(0, 1), between(1e-7, 1e-3), st.sampled_from([1e-9, 1e-3]), tolerances)
def test_the_bracket_under_an_approximated_motion_holds_for_every_motion_so_near(
    problem: Problem, side: int, share: float, error: float, tolerance: float
) -> None:
    """The true motion jumps to and fro within the error, in favour of the side that the block enters."""
    v, i = speed(problem, side, 0.0, share), 1 - 2 * side
    error *= GRAVITY * min(problem.alpha)
    lower, upper, _, _ = proof(problem, v, side, error=error, tolerance=tolerance)
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
        estimate = proof(problem, v, side).time
        errors.append(abs(float(multiprecision.rest_time(problem, 0.0, 1 - 2 * side, v) - estimate)))
    assert np.diff(np.log(errors[:3])) / np.diff(np.log(speeds[:3])) == pytest.approx(order, abs=0.1)


@st.composite
def brackets(draw: st.DrawFn) -> tuple[float, list[list[float]], tuple[float, float]]:
    """Speed, bounds on both sides as `bound_arc` takes them, restitutions."""
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
    lower, upper = bracket_geometrically(v, RestoringBounds(*sides[0]), RestoringBounds(*sides[1]), e, e)
    sides[side][which] *= 1.0 - 0.5 * more if which == 1 else 1.0 + more
    wider_lower, wider_upper = bracket_geometrically(v, RestoringBounds(*sides[0]), RestoringBounds(*sides[1]), e, e)
    assert math.isnan(wider_upper) or wider_lower <= lower * (1.0 + 1e-14) <= upper <= wider_upper * (1.0 + 1e-14)


def test_a_constant_motion_of_little_stiffness_leaves_only_rounding_between_the_bounds() -> None:
    bounds = RestoringBounds(1e-20, 3.0, 3.0, 0.0, 0.0, 0.0)
    lower, upper = bracket_geometrically(0.6, bounds, bounds, (0.5, 0.8), (0.5, 0.8))
    assert lower == pytest.approx(0.4 * 1.5 / 0.6, rel=1e-13)
    assert lower < 0.4 * 1.5 / 0.6 < upper < lower * (1.0 + 1e-13)


STEADY = RestoringBounds(1.0, 2.0, 2.0, 0.0, 0.0, 0.0)


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
    assert np.all(np.isnan(bracket_geometrically(v, RestoringBounds(*first), RestoringBounds(*second), (e, e), (e, e))))
    assert np.all(np.isfinite(bracket_geometrically(0.1, STEADY, STEADY, (0.5, 0.5), (0.5, 0.5))))


def test_a_window_over_too_many_pieces_proves_nothing_until_the_block_is_slower() -> None:
    count = 20_000
    problem = Problem(
        "linear", (2.0, 2.0), (0.2, 0.2), (0.9, 0.9), 1e-5 * np.arange(count + 1), np.full((count, 1), 0.1)
    )
    assert np.all(np.isnan(proof(problem, 5e-3, 0)))
    assert np.all(np.isfinite(proof(problem, 1e-4, 0)))


def test_a_jump_just_past_the_end_of_a_window_is_not_ruled_out() -> None:
    """Times are rounded to their last place: a jump that is nearer to the end of the window than that counts."""
    late, length = 2.0**20, 1.0
    rows = np.array([[0.0, 0.0], [-0.5 * GRAVITY, 0.0]])
    problem = Problem("linear", (2.0, 2.0), (0.2, 0.2), (0.5, 0.5), np.array([late, late + length, late + 9.0]), rows)
    v = 1e-8
    window = 1.5 * 2.0 * v * 1.5 / 0.8 / 0.75
    assert np.isfinite(proof(problem, v, 0, offset=length - 1e-6).upper)
    assert np.isnan(proof(problem, v, 0, offset=length - 0.9 * window).upper)
    assert np.isnan(proof(problem, v, 0, offset=length - window - 1e-9).upper)


@pytest.mark.parametrize("error", [0.0, 1e-3])
def test_a_disturbed_motion_may_be_off_by_its_error_at_any_time(error: float) -> None:
    problem = Problem("linear", (2.0, 2.0), (0.2, 0.2), (0.5, 0.5), np.array([0.0, 9.0]), np.array([[0.5, 0.1]]))
    seen = bound_window(ground_of(problem), 0, 1.0, 2.0, ANYTHING, create_scratch()["ground"])
    wider = widen_for_error(seen, error)
    assert (wider.low, wider.high) == (seen.low - error, seen.high + error)
    assert (wider.slope, wider.jumps) == (seen.slope, seen.jumps + 2.0 * error)


@quick
@given(problems(pieces=1), st.integers(0, 1))
def test_the_restoring_acceleration_is_that_of_the_equation_of_motion(problem: Problem, side: int) -> None:
    here = problem.acceleration(0.0) / GRAVITY
    expected = problem.restoring(0.0, 1 - 2 * side)
    size = problem.p[side] ** 2 * (problem.alpha[side] + abs(here))
    assert compute_restoring(ground_of(problem), block_of(problem), side, 0, 0.0) == pytest.approx(
        expected, abs=1e-15 * size
    )


@quick
@given(
    models,
    between(0.05, 0.5),
    st.lists(between(-0.5, 0.5), min_size=8, max_size=8),
    st.integers(2, 4),
    st.tuples(between(-4.0, -1.0), between(-7.0, -1.0)),
    st.sampled_from([0.0, 1e-3]),
    st.integers(0, 1),
)
def test_the_restoring_acceleration_stays_within_its_parabola_s_error(
    model: str,
    alpha: float,
    coefficients: list[float],
    columns: int,
    powers: tuple[float, float],
    error: float,
    side: int,
) -> None:
    """At any time of the window and any rotation up to the height, whatever the motion does within its error.

    It is no larger than what the changes of a straight motion and of the equation's slope make of it.
    """
    window, height = 10.0 ** powers[0], 10.0 ** powers[1]
    rows = np.array(coefficients).reshape(2, 4)[:, :columns] / window ** np.arange(columns)
    ground = in_units_of_g([0.0, 2.0 * window], rows[:1], error, rows[1:])
    block, rules, scratch = (
        rocking_block((2.0, 3.0), (alpha, 0.9 * alpha), nonlinear=model == "nonlinear"),
        rules_for(nonlinear=model == "nonlinear"),
        create_scratch(),
    )
    motion = MotionBounds(
        *(
            widen_for_error(bound_window(component, 0, 0.0, window, ANYTHING, create_scratch()["ground"]), error)
            for component in (ground, select_vertical(ground))
        )
    )
    write_local_series(ground, 0, 0.0, 1.0, scratch["ground"])
    write_weight_series(ground, 0, 0.0, scratch["weight"])
    horizon = Horizon(motion, error, columns, window, height, 0.0)
    found = fit_restoring_parabola(block, rules, side, scratch, horizon)
    sign, p, tilt = 1 - 2 * side, (2.0, 3.0)[side], (alpha, 0.9 * alpha)[side]
    if columns == 2 and not error:
        changes = window * np.abs(rows[:, 1]).sum() + 0.5 * height * (1.0 + np.abs(rows).sum(axis=0) @ [1.0, window])
        assert found.error <= 2.0 * p * p * (height * changes + 1e-15)
    for t in np.linspace(0.0, window, 5):
        horizontal, vertical = (np.polynomial.polynomial.polyval(t, row) for row in rows)
        for u in np.linspace(0.0, height, 4):
            parabola = found.g + found.rate * t + found.curvature * t * t - found.stiffness * u
            for wrong, heavy in ((0.0, 0.0), (error, error), (-error, error), (error, -error), (-error, -error)):
                a, weight = sign * (horizontal + wrong), 1.0 + vertical + heavy
                if model == "linear":
                    true = p * p * (weight * (tilt - u) + a)
                else:
                    true = p * p * (weight * math.sin(tilt - u) + a * math.cos(tilt - u))
                assert abs(true - parabola) <= found.error * (1.0 + 1e-12) + 1e-14 * p * p


def test_resistance_takes_from_and_adds_to_the_restoring_acceleration() -> None:
    assert widen_for_drag(RestoringBounds(1.0, 2.0, 3.0, 0.5, 0.25, 0.125), 0.1) == (1.0, 1.9, 3.1, 0.7, 0.25, 0.325)


@pytest.mark.parametrize("weight", [-0.5, 0.0, 0.5])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_motion_passes_the_threshold_where_the_greatest_weight_lets_it(weight: float, share: float) -> None:
    strong = share * 0.15 * (1.0 + weight)
    ground = in_units_of_g([0.0, 9.0], [[strong, 0.0]], 0.0, [[weight, 0.0]])
    found = bound_motion(ground, rocking_block(), state_of(0, 0.0, 1e-3), 0.1, create_scratch())
    assert math.isnan(found.horizontal.high) == (share > 1.0)
