"""One step of an arc to its first event, and the impact itself, against exact arithmetic."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from kernel_structs import MINUS, PLUS, ULP, in_units_of_g, numbers, rocking_block, rules_for, state_of
from oracles.exact import exact, first_above, polynomial, turning_points

from rocking.kernels.arc import expand_arc
from rocking.kernels.events import advance_to_event, apply_impact
from rocking.kernels.state import StepOutcome, create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

QUARTER_TURN = 0.5 * math.pi

quick = settings(deadline=None, max_examples=50)


@st.composite
def series(draw: st.DrawFn) -> np.ndarray:
    """Series of a block that leaves the ground, is off it, or nearly falls."""
    terms = draw(st.lists(numbers(-2.0, 2.0), min_size=2, max_size=9))
    start = draw(
        st.tuples(st.just(0.0), st.floats(1e-6, 1.0))
        | st.tuples(st.floats(1e-6, 1.5), numbers(-1.0, 1.0))
        | st.tuples(st.floats(1.3, 1.5), st.floats(0.5, 3.0))
    )
    return np.array([*start, *terms])


def follow(c: np.ndarray, h: float) -> tuple[int, float, float, float, float, float]:
    scratch = create_scratch()
    scratch["rotation"][: len(c)] = c
    outcome, time, u, v, top, height = advance_to_event(state_of(0, c[0], c[1]), scratch, len(c) - 1, h, QUARTER_TURN)
    return outcome, time, u, v, top, height


def test_a_step_ends_at_its_first_event() -> None:
    judged: Counter[StepOutcome] = Counter()

    # What is drawn need not fall, nor come down, three times.
    @quick
    @example(np.array([1.3, 2.0, -0.5]), 1.0)
    @example(np.array([1.4, 1.0, 0.2]), 1.0)
    @example(np.array([1.5, 0.5, 0.1]), 1.5)
    @example(np.array([0.1, -0.5, 0.1]), 1.0)
    @example(np.array([0.2, 0.1, -0.9]), 1.5)
    @example(np.array([0.0, 0.3, -0.6]), 1.5)
    @given(series(), st.floats(0.1, 1.5))
    def judge(c: np.ndarray, h: float) -> None:
        status, time, u, v, _, _ = follow(c, h)
        judged[StepOutcome(status)] += 1
        f = polynomial(c)
        size = float(np.sum(np.abs(c) * h ** np.arange(len(c))))
        rounding = exact(1e-14 * size)
        impact = first_above(-f if c[0] > 0.0 else -polynomial(c[1:]), 0.0, h)
        inside = turning_points(f, 0.0, time)[1:-1]
        overturn = first_above(f - exact(QUARTER_TURN), 0.0, h)
        if status == StepOutcome.IMPACT:
            assert (u, v) == (0.0, pytest.approx(float(np.polynomial.Polynomial(c).deriv()(time)), abs=1e-12 * size))
            assert time >= min(impact, h) * (1.0 - 1e-14) or f(exact(time)) <= rounding
            assert overturn >= time * (1.0 - 1e-14)
        elif status == StepOutcome.OVERTURN:
            assert u == QUARTER_TURN
            assert abs(f(exact(time)) - exact(u)) <= rounding
            assert not inside or c[0] == 0.0 or all(abs(f.derivative()(r)) <= 1e-6 for r in inside)
        else:
            assert (status, time) == (StepOutcome.STEP, h)
            assert u > 0.0
            assert u == pytest.approx(float(np.polynomial.Polynomial(c)(h)), abs=1e-14 * size)
            assert overturn == math.inf or f(exact(h)) <= exact(QUARTER_TURN) + rounding

    judge()
    assert all(judged[each] >= 3 for each in (StepOutcome.IMPACT, StepOutcome.OVERTURN, StepOutcome.STEP)), judged


@quick
@given(series(), st.floats(0.1, 1.5))
def test_the_highest_rotation_of_a_step_is_the_maximum_of_its_series(c: np.ndarray, h: float) -> None:
    _, time, _, _, peak_time, peak = follow(c, h)
    points = turning_points(polynomial(c).derivative(), 0.0, time)
    heights = [np.polynomial.Polynomial(c)(float(int(t.p) / int(t.q))) for t in points]
    assert max(peak, c[0]) == pytest.approx(min(max(heights), QUARTER_TURN), rel=1e-13)
    assert 0.0 < peak_time <= time
    assert peak == pytest.approx(float(np.polynomial.Polynomial(c)(peak_time)), rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("turns", [[0.2, 0.9], [0.1, 0.3, 0.9]], ids=["after a dip", "after a hump and a dip"])
def test_a_late_hump_is_not_overlooked(turns: list[float]) -> None:
    f = np.polynomial.Polynomial.fromroots(turns).integ() * -5.0 + 0.5
    _, _, u, v, peak_time, peak = follow(f.coef.copy(), 1.0)
    assert v < 0.0
    assert max(u, f(turns[0])) < peak
    assert (peak_time, peak) == (pytest.approx(0.9, rel=1e-12), pytest.approx(f(0.9), rel=1e-14))


@quick
@given(st.floats(1e-12, 1.0), st.floats(1e-3, 10.0), st.integers(-3, 3))
def test_an_impact_within_rounding_of_the_steps_end_is_never_left_behind(u: float, v: float, ulps: int) -> None:
    h = u / v * (1.0 + ulps * ULP / 2.0)
    status, time, end, speed, _, _ = follow(np.array([u, -v, 0.0]), h)
    assert status == StepOutcome.IMPACT or end > 0.0
    assert time == pytest.approx(u / v, rel=1e-15)
    assert speed == -v


@pytest.mark.parametrize("start", [0.0, 1e-300, 1e-20, 1e-14])
def test_an_arc_that_a_step_caught_just_off_the_ground_comes_down_all_the_same(start: float) -> None:
    status, time, _, speed, peak_time, peak = follow(np.array([start, 0.4, -1.0]), 1.0)
    assert (status, time) == (StepOutcome.IMPACT, pytest.approx(0.4, rel=1e-12))
    assert (speed, peak_time, peak) == (pytest.approx(-0.4), pytest.approx(0.2), pytest.approx(0.04))


def test_a_fall_is_where_the_rotation_first_reaches_the_limit() -> None:
    """Whatever the limit is: a quarter turn of a block, none of a ball."""
    judged = 0

    @quick
    @given(series(), st.floats(0.1, 1.5), st.floats(0.2, 3.0))
    def judge(c: np.ndarray, h: float, share: float) -> None:
        nonlocal judged
        scratch, fallen = create_scratch(), max(share, 1.01 * float(c[0]))
        scratch["rotation"][: len(c)] = c
        end = advance_to_event(state_of(0, c[0], c[1]), scratch, len(c) - 1, h, fallen)
        free = advance_to_event(state_of(0, c[0], c[1]), scratch, len(c) - 1, h, math.inf)
        assert free.outcome != StepOutcome.OVERTURN
        judged += end.outcome == StepOutcome.OVERTURN
        rounding = 1e-13 * float(np.sum(np.abs(c) * h ** np.arange(len(c))))
        earliest = first_above(polynomial(c) - exact(fallen - rounding), 0.0, h)
        latest = first_above(polynomial(c) - exact(fallen + rounding), 0.0, h)
        if end.outcome == StepOutcome.OVERTURN:
            assert (end.u, end.peak, end.peak_time) == (fallen, fallen, end.time)
            assert earliest <= end.time * (1.0 + 1e-14)
            assert end.time <= latest * (1.0 + 1e-14)
            assert earliest <= free.time * (1.0 + 1e-14)
        else:
            assert end == free
            assert latest >= free.time * (1.0 - 1e-14)

    judge()
    assert 3 <= judged <= 47


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("strength", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("columns", [1, 2, 3])
def test_a_step_after_an_impact_is_sized_by_the_arc_under_weak_and_violent_motions(
    nonlinear: bool, strength: float, columns: int
) -> None:
    """The step reaches beyond the impact where the motion presses the block down, else to 1/p."""
    row = np.zeros(columns)
    row[0] = strength
    ground, scratch = in_units_of_g([0.0, 9.0], [row]), create_scratch()
    block, rules = rocking_block(alpha=(0.2, 0.2), nonlinear=nonlinear), rules_for(nonlinear=nonlinear)
    start = state_of(PLUS, 0.0, 1e-3)
    order, h, degree = expand_arc(ground, block, rules, scratch, start, 9.0)
    outcome, time, *_ = advance_to_event(start, scratch, order, h, QUARTER_TURN)
    assert outcome == StepOutcome.IMPACT
    assert time == pytest.approx(2e-3 / (4.0 * (0.2 + strength)), rel=0.03)
    assert (time < h <= 0.5, degree) == (True, 0)
    order, h, _ = expand_arc(ground, block, rules, scratch, state_of(MINUS, 0.0, 1e-3), 9.0)
    assert (h <= 0.5) if strength > 0.2 else (h < 0.01)


@pytest.mark.parametrize("entered", [(1, 0), (0, 0)], ids=["rocks", "bounces"])
@pytest.mark.parametrize("v", [-0.7, -0.0, 0.3])
def test_an_impact_slows_down_and_enters_the_next_side(entered: tuple[int, int], v: float) -> None:
    block = rocking_block(e=(0.5, 0.8))
    block["next_side"] = entered
    for side in (PLUS, MINUS):
        hit = state_of(side, 1e-18, v)
        speed = apply_impact(block, hit)
        assert speed == max(0.0, -v)
        assert (hit["side"], hit["u"], hit["v"]) == (entered[side], 0.0, (0.5, 0.8)[side] * speed)
        assert hit["impact_count"] == 1
