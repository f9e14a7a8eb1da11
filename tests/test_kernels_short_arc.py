"""Steps at a glance: what they decide is what the full series says, and they never miss an impact or a peak."""

import math
from collections.abc import Iterator
from itertools import product

import numpy as np
import pytest
from flint import fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import ULP, in_units_of_g, long_uncompiled, rocking_block, rules_for, state_of
from oracles.exact import exact, real_roots
from oracles.taylor import System, after

from rocking.kernels.arc import evaluate_series, expand_arc
from rocking.kernels.events import StepEnd, advance_to_event
from rocking.kernels.series import ValueAndSlope
from rocking.kernels.short_arc import take_short_step
from rocking.kernels.state import StepOutcome, Struct, create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

quick = settings(deadline=None, max_examples=80)
weights = pytest.mark.parametrize("weighted", [False, True], ids=["at rest", "weighted"])
models = pytest.mark.parametrize("nonlinear", [False, True], ids=["linear", "nonlinear"])


class Case:
    """An arc under an even change of the ground acceleration, and of the weight."""

    def __init__(
        self,
        nonlinear: bool,
        side: int,
        p: float,
        alpha: float,
        row: ValueAndSlope,
        weight: ValueAndSlope | None = None,
    ) -> None:
        self.nonlinear, self.side, self.p, self.alpha, self.row = nonlinear, side, p, alpha, row
        self.weight = weight
        self.heaviest = 1.0 if weight is None else abs(weight[0])
        lifts = None if weight is None else [(weight[0] - 1.0, weight[1])]
        self.ground = in_units_of_g([0.0, 1e3], [row], vertical=lifts)
        self.block = rocking_block((p, p), (alpha, alpha), nonlinear=nonlinear)
        self.rules = rules_for(nonlinear=nonlinear)
        self.scratch = create_scratch()

    def short(self, start: Struct, left: float) -> StepEnd:
        return take_short_step(self.ground, self.block, self.rules, start, left)

    def long(self, start: Struct, left: float) -> tuple[StepEnd, float]:
        """StepEnd, and how far the series reaches."""
        order, h, _ = expand_arc(self.ground, self.block, self.rules, self.scratch, start, left)
        return advance_to_event(start, self.scratch, order, h, self.block["overturn_angle"]), h

    def pulls(self, t: float) -> float:
        """Size of what is added up in t^2 u'': where weight and push cancel, their rounding stays."""
        if self.weight is None:
            return 0.0
        (a, b), (w, d) = self.row, self.weight
        return (self.p * t) ** 2 * (self.alpha * (abs(w) + abs(d) * t) + abs(a) + abs(b) * t)

    def curvature(self, u: float) -> float:
        """Size of u''."""
        a, w = abs(self.row[0]), self.heaviest
        return self.p**2 * (w + a if self.nonlinear else w * (abs(u) + self.alpha) + a)


def cases(
    nonlinear: bool, count: int, seed: int, *, weighted: bool = False
) -> Iterator[tuple[Case, float, float, float]]:
    """Arcs of blocks and motions over many powers of ten: case, u, v, time left."""
    random = np.random.default_rng(seed)

    def power(low: float, high: float) -> float:
        return float(10.0 ** random.uniform(low, high))

    for _ in range(count):
        p, alpha, left = power(-2.0, 2.0), power(-3.0, 0.0), power(-5.0, 0.3)
        sign = random.choice([-1.0, 1.0], size=3)
        row = (sign[0] * alpha * power(-3.0, 1.5), sign[1] * alpha * power(-3.0, 2.0) * p / left)
        side = int(random.integers(2))
        weight = None
        if weighted:  # from next to none to a few times that at rest, of either sign
            weight = (sign[2] * power(-6.0, 0.7), random.choice([-1.0, 1.0]) * power(-6.0, 1.0) * p / left)
        case = Case(nonlinear, side, p, alpha, row, weight)
        u = 0.0 if random.random() < 0.5 else alpha * power(-12.0, 0.2)
        v = p * alpha * power(-9.0, 1.0)
        if random.random() < 0.5:  # an arc that ends nearby
            v = power(-1.0, 0.2) * (0.5 * case.curvature(0.0) * left / p if u == 0.0 else -u * p / left)
        yield case, u, v if u == 0.0 else sign[2] * v, left / p


@pytest.mark.thorough
@long_uncompiled
@models
@weights
@pytest.mark.parametrize("count", [500, pytest.param(6000, marks=pytest.mark.slow)])
def test_what_a_short_step_decides_is_what_the_full_series_says(nonlinear: bool, weighted: bool, count: int) -> None:
    """Outcome, time, rotation, velocity and peak to a few units in the last place, over many powers of ten."""
    decided = {StepOutcome.STEP: 0, StepOutcome.IMPACT: 0}
    for number, (case, u, v, left) in enumerate(cases(nonlinear, count, 1, weighted=weighted)):
        start = state_of(case.side, u, v, peak=u + (number % 2) * case.alpha)
        found = case.short(start, left)
        if found.outcome == StepOutcome.UNDECIDED:
            continue
        assert 0.0 < found.time <= left
        expected, reach = case.long(start, found.time if found.outcome == StepOutcome.STEP else left)
        if reach < found.time:
            continue
        decided[found.outcome] += 1
        t = found.time
        size = max(u, abs(v) * t, abs(found.v) * t, found.u, case.pulls(t))
        assert found.outcome == expected.outcome
        assert abs(found.time - expected.time) * abs(found.v) <= 8.0 * ULP * size
        assert abs(found.u - expected.u) <= 8.0 * ULP * size
        # The velocity is compared at the impact's own time.
        shift = case.curvature(u) * abs(found.time - expected.time)
        assert abs(found.v - expected.v) * t <= 16.0 * ULP * size + shift * t
        highest, height = max(float(start["peak"]), expected.peak), max(float(start["peak"]), found.peak)
        assert abs(highest - height) <= 8.0 * ULP * size
    assert min(decided.values()) > count // 12


@models
@weights
@pytest.mark.parametrize("count", [80, pytest.param(500, marks=pytest.mark.thorough)])
def test_a_short_step_decides_on_what_is_common(nonlinear: bool, weighted: bool, count: int) -> None:
    """Or else nothing is gained: arcs of a small rotation, well below the highest so far, under moderate motions."""
    random = np.random.default_rng(2)
    decided = 0
    for _ in range(count):
        weight = (random.uniform(0.5, 1.5), random.uniform(-20.0, 20.0)) if weighted else None
        case = Case(nonlinear, 0, 2.0, 0.2, (random.uniform(-0.1, 0.1), random.uniform(-3.0, 3.0)), weight)
        u, v = random.choice([0.0, 0.05]), random.uniform(1e-3, 0.05)
        decided += case.short(state_of(0, u, v, peak=0.2), 0.005).outcome != StepOutcome.UNDECIDED
    assert decided > 0.9 * count


def test_the_first_impact_is_never_missed() -> None:
    """Against the isolated roots of the exact series of the linear model, 25 terms of it."""
    judged = {StepOutcome.STEP: 0, StepOutcome.IMPACT: 0, StepOutcome.UNDECIDED: 0}

    @quick
    @given(
        st.just(0.0) | st.floats(1e-9, 1e-2),
        st.floats(-0.2, 0.2),
        st.floats(-1.5, 1.5),
        st.floats(-60.0, 60.0),
        st.floats(1e-4, 0.03),
        st.integers(0, 1),
    )
    def holds(u: float, v: float, a: float, slope: float, left: float, side: int) -> None:
        v = max(abs(v), 1e-9) if u == 0.0 else v
        case = Case(False, side, 2.0, 0.2, (a, slope))
        found = case.short(state_of(side, u, v), left)
        judged[StepOutcome(found.outcome)] += 1
        sign = 1.0 - 2.0 * side
        c = [exact(u), exact(v), -2 * (exact(0.2) + exact(sign * a) - exact(u))]
        c.append(4 * (c[1] - exact(sign * slope)) / 6)
        while len(c) < 25:
            c.append(4 * c[-2] / ((len(c) - 1) * len(c)))
        roots = [float(r.mid()) for r in real_roots(fmpq_poly(c[1:] if u == 0.0 else c)) if r > 0]
        first = min(roots, default=math.inf)
        if found.outcome == StepOutcome.IMPACT:
            size = max(u, abs(v) * found.time)
            assert abs(found.time - first) * abs(found.v) <= 16.0 * ULP * size or found.time == pytest.approx(
                first, rel=1e-13
            )
        elif found.outcome == StepOutcome.STEP:
            assert first > found.time * (1.0 - 1e-14)

    holds()
    assert judged[StepOutcome.STEP] >= 10 and judged[StepOutcome.IMPACT] >= 5, judged
    assert judged[StepOutcome.UNDECIDED] <= 0.6 * sum(judged.values()), judged


def lower_than_before(case: Case, u: float, v: float, peak: float = 9.0) -> Struct:
    """State of a block that has been higher."""
    return state_of(case.side, u, v, peak=peak)


@models
def test_a_dip_below_the_ground_between_two_ends_above_it_is_not_stepped_over(nonlinear: bool) -> None:
    """A block pushed up while it comes down: u = k (t - m)^2 - d has two roots within the step."""
    case = Case(nonlinear, 0, 2.0, 0.2, (-0.7, 0.0))
    curvature = -4.0 * (math.sin(0.2) - 0.7 * math.cos(0.2) if nonlinear else 0.2 - 0.7)
    steps = 0
    for depth in (1e-9, 1e-5, 1e-3, 0.1):
        for t in (1e-4, 1e-3, 5e-3):
            middle = 0.5 * t
            low = depth * 0.5 * curvature * middle**2
            u, v = 0.5 * curvature * middle**2 - low, -curvature * middle
            assert case.short(lower_than_before(case, u, v), t).outcome == StepOutcome.UNDECIDED
            touching = case.short(lower_than_before(case, u + 3.0 * low, v), t)
            assert touching.outcome in (StepOutcome.UNDECIDED, StepOutcome.STEP)
            steps += touching.outcome == StepOutcome.STEP
    assert steps >= 8


@models
def test_of_two_impacts_within_a_step_the_first_is_taken_or_none(nonlinear: bool) -> None:
    """An arc from the ground that comes down and would come up again: u/t has two roots."""
    alpha, p, judged = 0.2, 2.0, 0
    for scale, second in product((1e-4, 1e-3, 1e-2), (1.000001, 1.1, 2.0, 5.0)):
        r1, r2 = scale, scale * second
        left = 1.2 * r2
        # c2 and c3 of u = k t (r1 - t)(r2 - t), from the threshold and the slope of the motion.
        down = 0.1
        k = p * p * down / 2.0 / (r1 + r2)
        v = k * r1 * r2
        gain = p * p * (math.cos(alpha) if nonlinear else 1.0)
        a = 2.0 * k * (r1 + r2) / gain - (math.tan(alpha) if nonlinear else alpha)
        slope = -6.0 * k / gain
        case = Case(nonlinear, 0, p, alpha, (a, slope))
        found = case.short(lower_than_before(case, 0.0, v), left)
        assert found.outcome in (StepOutcome.UNDECIDED, StepOutcome.IMPACT)
        if found.outcome == StepOutcome.IMPACT:
            judged += 1
            assert found.time == pytest.approx(r1, rel=0.05 + 0.2 / (second - 1.0) * scale)
            assert found.v < 0.0
    assert judged >= 6


@models
@pytest.mark.parametrize("below", [1e-12, 1e-6, 1e-3, 0.5])
def test_a_peak_within_a_step_that_may_be_a_new_one_is_looked_at_closely(nonlinear: bool, below: float) -> None:
    case = Case(nonlinear, 1, 2.0, 0.2, (0.0, 0.0))
    u, v, left = 0.01, 1e-4, 1e-3
    expected, _ = case.long(state_of(1, u, v), left)
    assert u < expected.peak
    assert expected.u < expected.peak
    peak = u + (expected.peak - u) * (1.0 - below)
    found = case.short(lower_than_before(case, u, v, peak), left)
    assert (found.outcome, found.peak) == (StepOutcome.STEP, pytest.approx(expected.peak, rel=1e-15))
    assert found.peak_time == pytest.approx(expected.peak_time, rel=1e-9)
    assert case.short(lower_than_before(case, u, v, 0.02), left).outcome == StepOutcome.STEP


@models
def test_the_peak_of_a_step_on_a_convex_arc_is_that_of_the_full_series(nonlinear: bool) -> None:
    alpha = 0.2
    case = Case(nonlinear, 1, 2.0, alpha, (-0.05, 600.0))  # pushed ever harder to the other side, then back
    u, v, left = 0.1, 1e-3, 1e-3
    step = case.short(lower_than_before(case, u, v, 0.5 * u), left)
    long, _ = case.long(lower_than_before(case, u, v, 0.5 * u), left)
    assert step.outcome == StepOutcome.STEP
    assert step.peak == pytest.approx(long.peak, rel=1e-14)


@models
def test_a_fall_is_left_to_a_closer_look(nonlinear: bool) -> None:
    case = Case(nonlinear, 0, 2.0, 0.2, (0.0, 0.0))
    near = 0.5 * math.pi - 1e-4
    assert case.short(state_of(0, near, 1.0), 1e-3).outcome == StepOutcome.UNDECIDED
    assert case.long(state_of(0, near, 1.0), 1e-3)[0].outcome == StepOutcome.OVERTURN
    assert case.short(state_of(0, near, 1e-4), 1e-3).outcome == StepOutcome.STEP


@models
@pytest.mark.parametrize("left", [1e-4, 1e-3])
def test_a_fall_between_two_ends_that_stand_is_left_to_a_closer_look(nonlinear: bool, left: float) -> None:
    """A push against the fall turns the block back, once it has passed the end of what is followed, or before."""
    case = Case(nonlinear, 0, 2.0, 0.2, (20.0, 0.0))
    psi = 0.2 - 0.5 * math.pi
    pull = 4.0 * (math.sin(psi) + 20.0 * math.cos(psi) if nonlinear else 0.2 - 0.5 * math.pi + 20.0)
    v = 0.49 * pull * left
    summit = 0.5 * v * v / pull
    for share, outcome, long in (
        (0.5, StepOutcome.UNDECIDED, StepOutcome.OVERTURN),
        (0.9, StepOutcome.UNDECIDED, StepOutcome.OVERTURN),
        (1.5, StepOutcome.STEP, StepOutcome.STEP),
    ):
        start = state_of(0, 0.5 * math.pi - share * summit, v)
        found = case.short(start, left)
        assert (found.outcome, case.long(start, left)[0].outcome) == (outcome, long)
        if outcome == StepOutcome.STEP:
            assert found.u < start["u"] < found.peak < 0.5 * math.pi


@models
def test_a_balanced_block_is_left_to_a_closer_look(nonlinear: bool) -> None:
    case = Case(nonlinear, 0, 2.0, 0.2, (0.0, 0.0))
    assert case.short(state_of(0, 0.2, 0.0), 1e-3).outcome == StepOutcome.UNDECIDED


@models
@pytest.mark.parametrize("what", ["u", "v", "acceleration", "slope", "weight", "change", "left"])
@pytest.mark.parametrize("grounded", [True, False])
def test_not_a_number_is_undecided(nonlinear: bool, what: str, grounded: bool) -> None:
    values = {"u": 0.0 if grounded else 0.01, "v": 0.01, "acceleration": 0.1, "slope": 0.3, "left": 1e-3}
    values |= {"weight": 1.1, "change": 0.4} if what in ("weight", "change") else {}
    values[what] = math.nan
    weight = (values["weight"], values["change"]) if "weight" in values else None
    case = Case(nonlinear, 0, 2.0, 0.2, (values["acceleration"], values["slope"]), weight)
    start = state_of(0, values["u"], values["v"], peak=1.0, offset=1e-3)
    assert case.short(start, values["left"]).outcome == StepOutcome.UNDECIDED


@models
@pytest.mark.parametrize("columns", [3, 5])
def test_motions_of_a_higher_degree_take_the_long_way(nonlinear: bool, columns: int) -> None:
    case = Case(nonlinear, 0, 2.0, 0.2, (0.1, 0.3))
    case.ground = in_units_of_g([0.0, 9.0], [[0.1, 0.3, *[0.0] * (columns - 2)]])
    assert case.short(state_of(0, 0.01, 0.0, peak=1.0), 1e-3).outcome == StepOutcome.UNDECIDED


@models
def test_a_long_step_goes_as_far_as_it_is_short(nonlinear: bool) -> None:
    """What is left of it comes next: the end is on the arc. A step that leaves nearly all of it is not worth taking."""
    case = Case(nonlinear, 0, 2.0, 0.2, (0.02, 0.1))
    start = state_of(0, 0.1, 0.5, peak=1.0)
    assert case.short(start, 5.0).outcome == StepOutcome.UNDECIDED
    found = case.short(start, 0.1)
    assert found.outcome == StepOutcome.STEP
    assert 0.0125 <= found.time < 0.05
    order, _, _ = expand_arc(case.ground, case.block, case.rules, case.scratch, start, 0.5)
    u, v, _ = evaluate_series(case.scratch["rotation"], order, found.time)
    assert (found.u, found.v) == (pytest.approx(u, rel=4.0 * ULP), pytest.approx(v, rel=16.0 * ULP))


#: Near lift-off c8 and c9 tell little of what follows: there the change of the weight alone carries terms on.
NEAR_LIFT_OFF = [(0.0, 1.0), (1e-9, 5.0), (-0.01, 20.0), (0.0, 300.0)]


@pytest.mark.cases(fast=12)
@models
@pytest.mark.parametrize("weight", NEAR_LIFT_OFF)
@pytest.mark.parametrize("u, v", [(0.3, 0.1), (0.2, 0.3), (0.05, -0.5), (0.0, 0.2)])
def test_a_short_step_near_lift_off_is_exact(nonlinear: bool, weight: ValueAndSlope, u: float, v: float) -> None:
    """Beside 60 digits, to a few units in the last place of the way."""
    judged = 0
    alpha, push = 0.2, (0.0, 0.01)
    for share in (0.01, 0.1, 0.3, 0.6, 1.0):
        case = Case(nonlinear, 0, 2.0, alpha, push, weight)
        found = case.short(state_of(0, u, v, peak=9.0), 0.02 * share)
        if found.outcome != StepOutcome.STEP:
            continue
        expected = after(System(4.0, alpha, nonlinear), u, v, found.time, push, weight)
        way = max(abs(v) * found.time, 4.0 * alpha * (abs(weight[0]) + abs(weight[1])) * found.time**2)
        assert abs(found.u - expected[0]) <= 4.0 * ULP * max(u, way)
        assert abs(found.v - expected[1]) * found.time <= 8.0 * ULP * max(way, 0.1 * alpha * found.time * nonlinear)
        judged += 1
    assert judged >= 1
