"""One step of an arc to its first event, and the first uplift of a block at rest, against exact arithmetic."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from rocking.kernels.arc import expand_linear
from rocking.kernels.impact import QUARTER_TURN, advance, expand, next_uplift, short_step
from rocking.kernels.state import AT_REST, GROUND, SERIES, SPARE, Rules, Shaking, new_scratch
from rocking.kernels.status import CERTIFIED, IMPACT, OVERTURN, STEP, UNDECIDED

ULP = 2.0**-52
PLUS, MINUS = 0, 1

quick = settings(deadline=None, max_examples=100)


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers far from underflow."""
    return st.floats(low, high).map(lambda x: x if abs(x) > 1e-30 else 0.0)


def exact(x: float) -> fmpq:
    return fmpq(*float(x).as_integer_ratio())


def polynomial(c: Sequence[float]) -> fmpq_poly:
    return fmpq_poly([exact(x) for x in c])


def turning_points(f: fmpq_poly, start: float, end: float) -> list[fmpq]:
    """Both ends, and rational numbers next to every root in between."""
    inside = []
    if f.degree() > 0:
        real = [r.real for r, _ in f.complex_roots() if r.imag == 0]
        inside = [exact(float(r.mid())) for r in real if exact(start) < r < exact(end)]
    return [exact(start), *sorted(inside), exact(end)]


def first_above(f: fmpq_poly, start: float, end: float) -> float:
    """First time in [start, end) from which f > 0; inf when never."""
    if f(exact(start)) > 0:
        return start
    points = turning_points(f, start, end)
    for left, right in itertools.pairwise(points):
        if f((left + right) / 2) > 0:
            return float(int(left.p) / int(left.q))
    return math.inf


def exact_uplift(shaking: Shaking, piece: int, offset: float, thresholds: tuple[float, float]) -> tuple[float, int]:
    """Time and side of the first uplift from an instant on; inf when there is none."""
    for k in range(piece, len(shaking.coefficients)):
        length = shaking.breakpoints[k + 1] - shaking.breakpoints[k]
        start = offset if k == piece else 0.0
        motion = polynomial(shaking.coefficients[k] * shaking.inverse_g)
        found = [
            (first_above((-motion if side == PLUS else motion) - exact(thresholds[side]), start, length), side)
            for side in (PLUS, MINUS)
        ]
        if min(found)[0] < math.inf:
            return shaking.breakpoints[k] + min(found)[0], min(found)[1]
    return math.inf, AT_REST


def sides(thresholds: tuple[float, float] = (0.2, 0.2)) -> np.ndarray:
    return np.array([[4.0, t, t, 4.0, 0.9, 0.0] for t in thresholds])


def uplift(
    shaking: Shaking, thresholds: tuple[float, float], *, piece: int = 0, offset: float = 0.0, stop: float = math.inf
) -> tuple[float, int, bool]:
    """Time, side, and whether by a jump."""
    scratch = new_scratch(shaking.coefficients.shape[1])
    piece, offset, side, jump = next_uplift(
        shaking, piece, offset, sides(thresholds), stop, scratch[GROUND], scratch[SPARE]
    )
    return shaking.breakpoints[piece] + offset if side != AT_REST else math.inf, side, jump


def in_units_of_g(breakpoints: Sequence[float], coefficients: Sequence[Sequence[float]]) -> Shaking:
    return Shaking(np.array(breakpoints, dtype=float), np.array(coefficients, dtype=float), 1.0, 0.0)


@st.composite
def shakings(draw: st.DrawFn) -> Shaking:
    """One to four pieces of one degree, with jumps between them."""
    columns = draw(st.integers(1, 8))
    rows = draw(st.lists(st.lists(between(-1.0, 1.0), min_size=columns, max_size=columns), min_size=1, max_size=4))
    widths = [draw(st.floats(0.01, 2.0)) for _ in rows]
    return in_units_of_g(np.cumsum([0.0, *widths]), rows)


@quick
@given(shakings(), st.tuples(st.floats(0.05, 1.5), st.floats(0.05, 1.5)), st.floats(0.0, 0.9))
def test_the_first_uplift_is_where_the_motion_first_passes_a_threshold(
    shaking: Shaking, thresholds: tuple[float, float], share: float
) -> None:
    offset = share * float(shaking.breakpoints[1])
    time, side, _ = uplift(shaking, thresholds, offset=offset)
    size = np.max(np.sum(np.abs(shaking.coefficients) * 2.0 ** np.arange(shaking.coefficients.shape[1]), axis=1))
    rounding = 2.0**-46 * (size + max(thresholds))
    earliest = exact_uplift(shaking, 0, offset, tuple(t - rounding for t in thresholds))
    latest = exact_uplift(shaking, 0, offset, tuple(t + rounding for t in thresholds))
    assert earliest[0] <= time * (1.0 + 4.0 * ULP)
    assert time <= latest[0] * (1.0 + 4.0 * ULP) + 1e-300
    assert side in (earliest[1], latest[1])


@pytest.mark.parametrize("sign, side", [(1.0, MINUS), (-1.0, PLUS)])
def test_after_a_touch_from_below_the_search_goes_on_to_the_true_crossing(sign: float, side: int) -> None:
    """0.2 - (t - 0.3)^2 (0.9 - t) touches the threshold 0.2 at 0.3 and passes it at 0.9."""
    gap = np.convolve([0.09, -0.6, 1.0], [0.9, -1.0])
    motion = sign * (np.array([0.2, 0.0, 0.0, 0.0]) - gap)
    time, found, jump = uplift(in_units_of_g([0.0, 1.0], [motion]), (0.2, 0.2))
    assert (found, jump) == (side, False)
    assert time == pytest.approx(0.9, rel=1e-14)


@pytest.mark.parametrize("touch", [[0.3], [0.1, 0.5], [0.2, 0.200001]])
def test_touches_alone_do_not_uplift(touch: list[float]) -> None:
    gap = np.array([0.1])
    for r in touch:
        gap = np.convolve(gap, [r * r, -2.0 * r, 1.0])
    motion = -gap
    motion[0] += 0.2
    assert uplift(in_units_of_g([0.0, 1.0], [motion]), (0.2, 0.2))[1] == AT_REST


def test_a_motion_that_starts_at_the_threshold_uplifts_only_where_it_rises() -> None:
    assert uplift(in_units_of_g([0.0, 1.0], [[0.2, 0.1]]), (0.2, 0.2)) == (0.0, MINUS, False)
    assert uplift(in_units_of_g([0.0, 1.0], [[0.2, 0.0, 0.1]]), (0.2, 0.2)) == (0.0, MINUS, False)
    assert uplift(in_units_of_g([0.0, 1.0], [[0.2]]), (0.2, 0.2))[1] == AT_REST
    assert uplift(in_units_of_g([0.0, 1.0], [[0.2, -0.1]]), (0.2, 0.2))[1] == AT_REST
    falls_then_rises = uplift(in_units_of_g([0.0, 1.0], [[0.2, -0.1, 0.2]]), (0.2, 0.2))
    assert falls_then_rises == (pytest.approx(0.5), MINUS, False)


@pytest.mark.parametrize("row", [[0.3], [0.3, -0.1], [0.3, -0.1, 0.05]])
def test_a_motion_beyond_the_threshold_uplifts_at_once(row: list[float]) -> None:
    assert uplift(in_units_of_g([0.0, 1.0], [row]), (0.2, 0.2)) == (0.0, MINUS, True)
    assert uplift(in_units_of_g([0.0, 1.0], [[-a for a in row]]), (0.2, 0.2)) == (0.0, PLUS, True)


def test_a_corner_that_only_touches_the_threshold_does_not_uplift() -> None:
    """Up to the threshold and down again, where the passing at the end of the piece is but rounding."""
    for width in np.linspace(0.1, 0.2, 101):
        rate = 0.2 / width
        corner = in_units_of_g([0.0, width, 2.0 * width], [[0.0, rate * (1.0 + ULP)], [0.2, -rate]])
        assert uplift(corner, (0.2, 0.2))[1] == AT_REST
        assert uplift(corner, (0.2, 0.2), offset=0.3 * width)[1] == AT_REST


def test_nothing_uplifts_at_or_after_the_stop() -> None:
    shaking = in_units_of_g([0.0, 1.0, 2.0], [[0.0, 0.3], [0.3, 0.0]])
    assert uplift(shaking, (0.2, 0.2))[0] == pytest.approx(2.0 / 3.0)
    assert uplift(shaking, (0.35, 0.35))[1] == AT_REST
    assert uplift(shaking, (0.3, 0.3), stop=1.0)[1] == AT_REST


@st.composite
def series(draw: st.DrawFn) -> np.ndarray:
    """Series of a block that is off the ground, or leaves it."""
    terms = draw(st.lists(between(-2.0, 2.0), min_size=2, max_size=9))
    on_the_ground = draw(st.booleans())
    start = (
        [0.0, draw(st.floats(1e-6, 1.0))] if on_the_ground else [draw(st.floats(1e-6, 1.5)), draw(between(-1.0, 1.0))]
    )
    return np.array([*start, *terms])


def follow(c: np.ndarray, h: float) -> tuple[int, float, float, float, float, float]:
    return advance(float(c[0]), float(c[1]), len(c) - 1, h, c, np.zeros(max(23, len(c))))


@quick
@given(series(), st.floats(0.1, 1.5))
def test_a_step_ends_at_its_first_event(c: np.ndarray, h: float) -> None:
    status, time, u, v, _, _ = follow(c, h)
    f = polynomial(c)
    size = float(np.sum(np.abs(c) * h ** np.arange(len(c))))
    rounding = exact(1e-14 * size)
    impact = first_above(-f if c[0] > 0.0 else -polynomial(c[1:]), 0.0, h)
    inside = turning_points(f, 0.0, time)[1:-1]
    overturn = first_above(f - exact(QUARTER_TURN), 0.0, h)
    if status == IMPACT:
        assert (u, v) == (0.0, pytest.approx(float(np.polynomial.Polynomial(c).deriv()(time)), abs=1e-12 * size))
        assert time >= min(impact, h) * (1.0 - 1e-14) or f(exact(time)) <= rounding
        assert overturn >= time * (1.0 - 1e-14)
    elif status == OVERTURN:
        assert u == QUARTER_TURN
        assert abs(f(exact(time)) - exact(u)) <= rounding
        assert not inside or c[0] == 0.0 or all(abs(f.derivative()(r)) <= 1e-6 for r in inside)
    else:
        assert (status, time) == (STEP, h)
        assert u > 0.0
        assert u == pytest.approx(float(np.polynomial.Polynomial(c)(h)), abs=1e-14 * size)
        assert overturn == math.inf or f(exact(h)) <= exact(QUARTER_TURN) + rounding


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
    assert status == IMPACT or end > 0.0
    assert time == pytest.approx(u / v, rel=1e-15)
    assert speed == -v


@pytest.mark.parametrize("start", [0.0, 1e-300, 1e-20, 1e-14])
def test_an_arc_that_a_step_caught_just_off_the_ground_comes_down_all_the_same(start: float) -> None:
    status, time, _, speed, peak_time, peak = follow(np.array([start, 0.4, -1.0]), 1.0)
    assert (status, time) == (IMPACT, pytest.approx(0.4, rel=1e-12))
    assert (speed, peak_time, peak) == (pytest.approx(-0.4), pytest.approx(0.2), pytest.approx(0.04))


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("strength", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("columns", [1, 2, 3])
def test_a_step_after_an_impact_is_sized_by_the_arc_under_weak_and_violent_motions(
    nonlinear: bool, strength: float, columns: int
) -> None:
    """The step reaches beyond the impact where the motion presses the block down, else to 1/p."""
    row = np.zeros(columns)
    row[0] = strength
    shaking, scratch = in_units_of_g([0.0, 9.0], [row]), new_scratch(columns)
    rules = Rules(nonlinear, CERTIFIED, 1e-12, math.inf, True, True)
    order, h, degree = expand(shaking, sides(), rules, scratch, PLUS, 0, 0.0, 0.0, 1e-3, 9.0)
    status, time, *_ = advance(0.0, 1e-3, order, h, scratch[SERIES], scratch[SPARE])
    assert status == IMPACT
    assert time == pytest.approx(2e-3 / (4.0 * (0.2 + strength)), rel=0.03)
    assert (time < h <= 0.5, degree) == (True, 0 if columns == 1 else 1)
    order, h, _ = expand(shaking, sides(), rules, scratch, MINUS, 0, 0.0, 0.0, 1e-3, 9.0)
    assert (h <= 0.5) if strength > 0.2 else (h < 0.01)


@settings(quick, max_examples=400)
@given(
    st.just(0.0) | st.floats(1e-9, 1e-2),
    between(-0.2, 0.2),
    between(-1.5, 1.5),
    between(-60.0, 60.0),
    st.floats(1e-4, 0.03),
    st.integers(0, 1),
    st.floats(1.0, 1.1),
)
def test_a_short_step_at_a_glance_is_the_one_of_the_series(
    u: float, v: float, a: float, slope: float, left: float, side: int, margin: float
) -> None:
    """What it decides is what `advance` finds, and no rotation above the highest so far is passed over."""
    v = max(abs(v), 1e-9) if u == 0.0 else v
    shaking, scratch = in_units_of_g([0.0, 1.0], [[a, slope]]), new_scratch(2)
    block, c = sides(), scratch[SERIES]
    sign = 1.0 - 2.0 * side
    expand_linear(u, v, 4.0, 0.2, np.array([sign * a, sign * slope]), 1, 21, c)
    status, time, end, speed, _, peak = advance(u, v, 21, left, c, scratch[SPARE])
    highest = max(u, peak) * margin
    found, found_time, found_end, found_speed = short_step(shaking, block, side, 0, 0.0, u, v, left, highest)
    assert found in (status, UNDECIDED)
    if found == status:
        assert found_time == pytest.approx(time, rel=1e-11)
        assert found_end == pytest.approx(end, rel=1e-11, abs=1e-14)
        assert found_speed == pytest.approx(speed, rel=1e-9, abs=1e-13)
    if status != OVERTURN and peak > 0.0:
        assert short_step(shaking, block, side, 0, 0.0, u, v, left, 0.999 * peak)[0] == UNDECIDED
