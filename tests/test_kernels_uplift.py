"""The first uplift of a block at rest, against exact arithmetic."""

import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import MINUS, PLUS, ULP, in_units_of_g, numbers, rocking_block
from oracles.exact import exact, first_above, polynomial

from rocking.kernels.ground import Ground
from rocking.kernels.state import AT_REST, create_scratch
from rocking.kernels.uplift import find_next_uplift

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

quick = settings(deadline=None, max_examples=100)


def exact_uplift(ground: Ground, piece: int, offset: float, thresholds: tuple[float, float]) -> tuple[float, int]:
    """Time and side of the first uplift from an instant on; inf when there is none."""
    for k in range(piece, len(ground.pieces) - 1):
        beginning, length, *row = ground.pieces[k]
        start = offset if k == piece else 0.0
        motion = polynomial(row)
        found = [
            (first_above((-motion if side == PLUS else motion) - exact(thresholds[side]), start, length), side)
            for side in (PLUS, MINUS)
        ]
        if min(found)[0] < math.inf:
            return beginning + min(found)[0], min(found)[1]
    return math.inf, AT_REST


def uplift(
    ground: Ground, thresholds: tuple[float, float], *, piece: int = 0, offset: float = 0.0, stop: float = math.inf
) -> tuple[float, int, bool]:
    """Time, side, and whether by a jump."""
    block = rocking_block()
    block["threshold"] = thresholds
    piece, offset, side, jump = find_next_uplift(ground, block, create_scratch(), AT_REST, piece, offset, stop)
    return ground.pieces[piece, 0] + offset if side != AT_REST else math.inf, side, jump


@st.composite
def shakings(draw: st.DrawFn) -> Ground:
    """One to four pieces of one degree, with jumps between them."""
    columns = draw(st.integers(1, 8))
    rows = draw(st.lists(st.lists(numbers(-1.0, 1.0), min_size=columns, max_size=columns), min_size=1, max_size=4))
    widths = [draw(st.floats(0.01, 2.0)) for _ in rows]
    return in_units_of_g(np.cumsum([0.0, *widths]), rows)


@pytest.mark.parametrize("examples", [60, pytest.param(100, marks=pytest.mark.thorough)])
def test_the_first_uplift_is_where_the_motion_first_passes_a_threshold(examples: int) -> None:
    judged: Counter[int] = Counter()

    @settings(deadline=None, max_examples=examples)
    @given(shakings(), st.tuples(st.floats(0.05, 1.5), st.floats(0.05, 1.5)), st.floats(0.0, 0.9))
    def judge(ground: Ground, thresholds: tuple[float, float], share: float) -> None:
        offset = share * float(ground.pieces[0, 1])
        time, side, _ = uplift(ground, thresholds, offset=offset)
        judged[side] += 1
        coefficients = ground.pieces[:, 2:]
        size = np.max(np.sum(np.abs(coefficients) * 2.0 ** np.arange(coefficients.shape[1]), axis=1))
        rounding = 2.0**-46 * (size + max(thresholds))
        earliest = exact_uplift(ground, 0, offset, tuple(t - rounding for t in thresholds))
        latest = exact_uplift(ground, 0, offset, tuple(t + rounding for t in thresholds))
        assert earliest[0] <= time * (1.0 + 4.0 * ULP)
        assert time <= latest[0] * (1.0 + 4.0 * ULP) + 1e-300
        assert side in (earliest[1], latest[1])

    judge()
    assert min(judged[AT_REST], judged[PLUS] + judged[MINUS]) >= examples // 10, judged


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


@quick
@given(st.integers(1, 400), st.data())
def test_far_away_the_uplift_is_found_in_its_piece(quiet: int, data: st.DataObject) -> None:
    """Whole stretches of quiet pieces are passed over, never the one that matters."""
    dt, threshold = 0.01, 0.2
    values = 0.999 * threshold * (-1.0) ** np.arange(quiet + 2)
    values[-1] = data.draw(st.sampled_from([-1.0, 1.0])) * threshold * (1.0 + data.draw(st.floats(1e-9, 1.0)))
    ground = in_units_of_g(dt * np.arange(quiet + 2), np.column_stack([values[:-1], np.diff(values) / dt]))
    time, side, jump = uplift(ground, (threshold, threshold))
    piece = ground.pieces[quiet]
    before, after = Fraction(float(values[-2])), Fraction(float(values[-1]))
    share = ((threshold if after > 0 else -Fraction(threshold)) - before) / (after - before)
    assert (side, jump) == (MINUS if after > 0 else PLUS, False)
    assert time == pytest.approx(piece[0] + float(share) * dt, rel=1e-13)
    assert uplift(ground, (threshold, threshold), piece=quiet // 2)[0] == time


def test_a_body_that_cannot_lift_off_to_a_side_only_does_to_the_other() -> None:
    for rows in ([[9.0, 0.0]], [[9.0, 0.0, -2.0]]):
        assert uplift(in_units_of_g([0.0, 1.0], rows), (0.2, math.inf))[1] == AT_REST
    time, side, _ = uplift(in_units_of_g([0.0, 1.0], [[9.0, -20.0, 0.0]]), (0.2, math.inf))
    assert (time, side) == (pytest.approx(0.46), PLUS)


@pytest.mark.parametrize(
    "horizontal, side",
    [([0.1, 0.0], MINUS), ([-0.1, 0.0], PLUS), ([0.0, 0.1], MINUS), ([0.0, -0.1], PLUS), ([0.0, 0.0], PLUS)],
)
def test_a_block_that_nothing_weighs_down_goes_where_the_motion_pushes(horizontal: list[float], side: int) -> None:
    """At a vertical acceleration of -1.5 g both thresholds are passed at once, and no block can stay at rest."""
    ground = in_units_of_g([0.0, 1.0], [horizontal], vertical=[[-1.5, 0.0]])
    assert uplift(ground, (0.3, 0.3)) == (0.0, side, True)
