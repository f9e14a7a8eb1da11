"""Whole responses by the kernels alone: how they end, resume and mirror, and what the trace makes of them."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from rocking.kernels import state, status
from rocking.kernels.march import march
from rocking.kernels.state import (
    EVENT_TABLE,
    IMPACT_TABLE,
    NODE_TABLE,
    SEQUENCE_TABLE,
    Floats,
    Rules,
    Shaking,
    Trail,
    new_scratch,
    new_state,
)
from rocking.kernels.trace import trace

G = 9.80665
ULP = 2.0**-52
PLUS, MINUS = 0, 1

quick = settings(deadline=None, max_examples=40)

Pair = tuple[float, float]


class Run(NamedTuple):
    """What a march wrote, and how it ended."""

    ending: int
    nodes: np.ndarray
    impacts: np.ndarray
    events: np.ndarray
    sequences: np.ndarray
    at: np.ndarray
    x: np.ndarray
    trail: Trail

    @property
    def kinds(self) -> list[int]:
        return [int(kind) for kind in self.events[:, 1]]

    def traced(self, times: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """Rotation, velocity, acceleration."""
        times = np.asarray(times, dtype=float)
        if rows is None:
            rows = np.searchsorted(self.nodes[:, 0], times, side="right") - 1
        out = np.full((len(times), 3), np.nan)
        columns = self.trail.shaking.coefficients.shape[1]
        trace(self.trail, new_scratch(columns), times, np.asarray(rows, dtype=np.int64), out)
        return out


def motion(breakpoints: object, coefficients: object) -> Shaking:
    """Pieces in units of g."""
    return Shaking(np.array(breakpoints, dtype=float), G * np.array(coefficients, dtype=float), 1.0 / G, 0.0)


FREE = Shaking(np.zeros(1), np.zeros((0, 2)), 1.0 / G, 0.0)


def record(seed: int, samples: int = 150, dt: float = 0.02, pga: float = 0.3) -> Shaking:
    noise = np.random.default_rng(seed).normal(size=samples + 3)
    values = np.convolve(noise, np.ones(4), mode="valid")
    values *= pga / np.max(np.abs(values))
    return motion(dt * np.arange(samples), np.column_stack([values[:-1], np.diff(values) / dt]))


def run(
    shaking: Shaking,
    *,
    p: Pair = (2.0, 2.0),
    alpha: Pair = (0.15, 0.15),
    e: Pair = (0.9, 0.9),
    nonlinear: bool = False,
    treatment: int = status.CERTIFIED,
    limit: float = 0.0,
    stop: float = math.inf,
    rotation: float = 0.0,
    velocity: float = 0.0,
    tables: Floats | None = None,
) -> Run:
    rows = []
    for p_i, alpha_i, e_i in zip(p, alpha, e, strict=True):
        threshold, gain = (math.tan(alpha_i), p_i**2 * math.cos(alpha_i)) if nonlinear else (alpha_i, p_i**2)
        rows.append([p_i**2, alpha_i, threshold, gain, e_i, limit])
    sides = np.array(rows)
    rules = Rules(nonlinear, treatment, 1e-12, stop, stop == math.inf, True)
    tables = state.new_tables(4096) if tables is None else tables
    at, x = new_state()
    if rotation != 0.0 or velocity != 0.0:
        sign = math.copysign(1.0, rotation if rotation != 0.0 else velocity)
        at[state.SIDE], x[state.U], x[state.V] = (PLUS if sign > 0.0 else MINUS), abs(rotation), sign * velocity
        x[state.PEAK] = x[state.U]
    scratch = new_scratch(shaking.coefficients.shape[1])
    pieces = len(shaking.coefficients) + 1
    ending = march(shaking, sides, rules, tables, scratch, at, x, pieces)
    while ending == status.FULL and tables.shape[1] < 200_000:
        tables = state.grown(tables)
        ending = march(shaking, sides, rules, tables, scratch, at, x, pieces)
    nodes = tables[NODE_TABLE, : at[state.NODES]].copy()
    return Run(
        ending,
        nodes,
        tables[IMPACT_TABLE, : at[state.IMPACTS], :5],
        tables[EVENT_TABLE, : at[state.EVENTS], :4],
        tables[SEQUENCE_TABLE, : at[state.SEQUENCES], :5],
        at,
        x,
        Trail(shaking, sides, rules, nodes),
    )


def assert_sound(found: Run) -> None:
    """Time never runs backwards, the block is never below the ground, and no NaN has come in."""
    assert found.ending in (status.DONE, status.FELL)
    assert np.all(np.isfinite(found.nodes))
    assert np.all(np.diff(found.nodes[:, 0]) >= -2.0 * ULP * found.nodes[1:, 0])
    assert np.all(found.nodes[:, 4] >= 0.0)
    assert np.all(np.diff(found.impacts[:, 0]) >= 0.0)
    assert np.all(found.impacts[:, 3] <= found.impacts[:, 2])
    assert np.all(np.isfinite(found.x[[state.U, state.V, state.PEAK, state.END]]))


# ---- Resuming, mirroring ----


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_march_that_runs_out_of_room_resumes_bit_for_bit(nonlinear: bool) -> None:
    least = np.empty((4, 3, 6))
    for seed in range(4):
        whole = run(record(seed), nonlinear=nonlinear)
        resumed = run(record(seed), nonlinear=nonlinear, tables=least)
        assert len(whole.impacts) > 10
        for one, other in zip(whole[:7], resumed[:7], strict=True):
            assert_array_equal(one, other)


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_mirrored_motion_mirrors_the_march_bit_for_bit(nonlinear: bool, sign: float) -> None:
    pairs = {"p": (2.0, 2.6), "alpha": (0.15, 0.12), "e": (0.9, 0.8)}
    mirrored = {name: pair[::-1] for name, pair in pairs.items()}
    for seed in range(4):
        shaking = record(seed)
        one = run(shaking, nonlinear=nonlinear, velocity=sign * 0.01, **pairs)
        other = run(
            shaking._replace(coefficients=-shaking.coefficients), nonlinear=nonlinear, velocity=-sign * 0.01, **mirrored
        )
        for name, column in (("nodes", 3), ("impacts", 1), ("events", 2)):
            expected = getattr(one, name).copy()
            expected[:, column] *= -1.0
            assert_array_equal(getattr(other, name), expected)
        assert_array_equal(one.sequences, other.sequences)


# ---- Rest and uplift ----


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [1, 2, 5])
def test_rectangular_pulses_uplift_by_their_jumps_and_the_block_rests_between(nonlinear: bool, columns: int) -> None:
    rows = np.zeros((3, columns))
    rows[:, 0] = 0.3, 0.0, -0.3
    found = run(motion([0.0, 0.1, 20.0, 20.1], rows), nonlinear=nonlinear)
    assert found.kinds == [status.UPLIFT, status.REST, status.UPLIFT, status.REST]
    assert found.events[[0, 2], 0].tolist() == [0.0, 20.0]
    assert found.events[:, 2].tolist() == [-1.0, 0.0, 1.0, 0.0]
    assert np.all(found.events[[0, 2], 3] == 0.0)
    first, second = found.events[1, 0], found.events[3, 0] - 20.0
    assert second == pytest.approx(first, abs=1e-10)
    assert_sound(found)


@pytest.mark.parametrize("row", [[0.2], [0.2, -0.01], [0.2, 0.0, -0.05]])
def test_a_motion_of_one_piece_may_uplift_at_its_very_start(row: list[float]) -> None:
    found = run(motion([0.0, 0.2], [row]))
    assert found.events[0].tolist() == [0.0, status.UPLIFT, -1.0, 0.0]
    assert found.kinds == [status.UPLIFT, status.REST]
    assert found.ending == status.DONE
    assert_sound(found)


def test_a_motion_that_never_passes_a_threshold_leaves_the_block_at_rest() -> None:
    found = run(motion([0.0, 1.0, 2.0], [[0.1, 0.04], [0.14, -0.2]]))
    assert (len(found.events), len(found.impacts), found.nodes.shape[0]) == (0, 0, 1)
    assert found.x[state.END] == 2.0


@pytest.mark.parametrize("shape", [[1.0, 0.0], [1.0, -1.0], [0.0, 1.0], [1.0, 1.0]])
@pytest.mark.parametrize("ulps", range(-24, 25, 3))
@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_motion_clipped_at_the_threshold_ends_whatever_rounding_makes_of_it(
    shape: list[float], ulps: int, nonlinear: bool
) -> None:
    """Four pieces between samples that are zero or, within some units in the last place, at the threshold."""
    alpha = 0.15
    top = (math.tan(alpha) if nonlinear else alpha) * (1.0 + ulps * ULP)
    values = top * np.array([*shape, *shape, shape[0]])
    found = run(motion(0.1 * np.arange(5), np.column_stack([values[:-1], np.diff(values) / 0.1])), nonlinear=nonlinear)
    assert_sound(found)
    assert len(found.nodes) < 200


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [1, 5, 21, 40])
def test_coefficients_that_are_zero_change_nothing(nonlinear: bool, columns: int) -> None:
    """However many they are: more than the series of an arc has, too."""
    shaking = motion([0.0, 0.1, 0.5, 0.6], np.full((3, 1), 0.2) * [[1.0], [-0.4], [-1.0]])
    rows = np.zeros((3, columns))
    rows[:, :1] = shaking.coefficients
    one = run(shaking._replace(coefficients=np.hstack([shaking.coefficients, np.zeros((3, 1))])), nonlinear=nonlinear)
    other = run(shaking._replace(coefficients=rows), nonlinear=nonlinear)
    assert len(one.impacts) > 10
    assert one.events[:, :3] == pytest.approx(other.events[:, :3], abs=1e-11)


# ---- Ends ----


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_march_stops_in_an_arc_at_rest_and_exactly_at_an_impact(nonlinear: bool) -> None:
    whole = run(record(1), nonlinear=nonlinear)
    impact, rest = whole.impacts[5, 0], whole.events[whole.events[:, 1] == status.REST][-1, 0]
    middle = 0.5 * (whole.impacts[5, 0] + whole.impacts[6, 0])
    for stop in (middle, impact, rest + 0.5, 1e3, whole.nodes[7, 0], whole.events[0, 0]):
        found = run(record(1), nonlinear=nonlinear, stop=stop)
        assert (found.ending, found.x[state.END]) == (status.DONE, stop)
        before = whole.impacts[whole.impacts[:, 0] < stop]
        assert_array_equal(found.impacts[: len(before)], before)
        assert len(found.impacts) - len(before) in ((0, 1) if stop == impact else (0,))
        assert_sound(found)
    assert run(record(1), nonlinear=nonlinear, stop=middle).nodes[-1, 0] == middle


def test_a_march_may_stop_between_the_last_impact_resolved_and_rest() -> None:
    whole = run(FREE, velocity=0.1)
    last, rest = whole.impacts[-1, 0], whole.events[-1, 0]
    assert rest > last
    found = run(FREE, velocity=0.1, stop=0.5 * (last + rest))
    assert (found.ending, found.kinds) == (status.DONE, [])
    assert found.sequences[0, 2] <= rest <= found.sequences[0, 3]
    assert_array_equal(found.traced(np.linspace(last, found.x[state.END], 9)[1:]), np.zeros((8, 3)))


@pytest.mark.parametrize("nonlinear", [False, True])
def test_without_loss_the_block_rocks_on_until_the_stop(nonlinear: bool) -> None:
    found = run(FREE, velocity=0.1, e=(1.0, 1.0), nonlinear=nonlinear, stop=50.0)
    assert (found.ending, found.x[state.END], len(found.sequences)) == (status.DONE, 50.0, 0)
    assert np.max(np.abs(found.impacts[:, 3] - 0.1)) <= 1e-13
    assert np.ptp(np.diff(found.impacts[:, 0])) <= 1e-12
    assert_sound(found)


def test_a_block_on_its_corner_balances() -> None:
    for nonlinear in (False, True):
        assert run(FREE, rotation=0.15, nonlinear=nonlinear).ending == status.BALANCED
        assert run(FREE, rotation=0.15, nonlinear=nonlinear, stop=9.0).ending == status.DONE
        fallen = run(FREE, rotation=0.15 * (1.0 + ULP), nonlinear=nonlinear)
        assert (fallen.ending, fallen.kinds) == (status.FELL, [status.TOPPLED])
        assert fallen.x[state.PEAK] == 0.5 * math.pi
        assert fallen.x[state.PEAK_TIME] == fallen.x[state.END] == fallen.events[0, 0]


def test_intervals_that_time_can_no_longer_tell_apart_end_a_sequence() -> None:
    found = run(FREE, velocity=0.1, treatment=status.TIME, limit=math.inf)
    exact = run(FREE, velocity=0.1)
    assert found.at[state.STALLED] == 1
    assert np.all(np.isnan(found.sequences[0, 2:4]))
    assert found.events[-1, 0] == pytest.approx(exact.events[-1, 0], abs=1e-12)


@pytest.mark.parametrize("treatment, limit", [(status.VELOCITY, 1e-9), (status.INTERVAL, 1e-9), (status.TIME, 2.0)])
def test_other_treatments_end_a_sequence_at_their_threshold(treatment: int, limit: float) -> None:
    found = run(FREE, velocity=0.1, treatment=treatment, limit=limit)
    assert (found.ending, found.kinds, found.at[state.STALLED]) == (status.DONE, [status.REST], 0)
    measure = {
        status.VELOCITY: -found.impacts[:, 3],
        status.INTERVAL: -np.diff(found.impacts[:, 0], prepend=0.0),
        status.TIME: found.impacts[:, 0],
    }[treatment]
    threshold = limit if treatment == status.TIME else -limit
    assert np.all(measure[:-1] < threshold)
    assert measure[-1] >= threshold


# ---- States that rounding could break ----


@pytest.mark.parametrize("rotation", [1e-300, 1e-20, 1e-17, 1e-15])
def test_a_rotation_lost_in_rounding_does_not_hide_the_impact(rotation: float) -> None:
    found, expected = run(FREE, rotation=rotation, velocity=0.1), run(FREE, velocity=0.1)
    assert len(found.impacts) == len(expected.impacts)
    assert found.impacts[:, 0] == pytest.approx(expected.impacts[:, 0], abs=1e-12)


def test_an_impact_on_a_breakpoint_is_struck_once_and_with_full_speed() -> None:
    """The pieces end at, or within a few units in the last place of, an impact of the motion without pieces."""
    whole = run(motion([0.0, 9.0], [[0.02, 0.0]]), velocity=0.1)
    impact = whole.impacts[0, 0]
    for ulps in range(-6, 7):
        found = run(motion([0.0, impact * (1.0 + ulps * ULP), 9.0], [[0.02, 0.0]] * 2), velocity=0.1)
        assert found.at[state.STALLED] == 0
        assert len(found.impacts) == len(whole.impacts)
        assert found.impacts[0, 2] == pytest.approx(whole.impacts[0, 2], rel=1e-12)
        assert found.events[-1, 0] == pytest.approx(whole.events[-1, 0], abs=1e-11)


def test_an_impact_without_speed_ends_at_rest_and_poisons_nothing() -> None:
    """The block is set down so gently by a motion made for it, u = (1 - t)^3 / 10, that no speed is left."""
    lam, alpha = 4.0, 0.15
    u = np.polynomial.Polynomial([1.0, -1.0]) ** 3 * 0.1
    row = (u - alpha - u.deriv(2) / lam).coef
    found = run(motion([0.0, 2.0], [row]), rotation=0.1, velocity=-0.3)
    assert len(found.impacts) > 0
    assert found.impacts[0, 2] <= 1e-7
    assert found.ending in (status.DONE, status.FELL)
    assert np.all(np.isfinite(found.nodes))


@st.composite
def extremes(draw: st.DrawFn) -> dict[str, object]:
    """Blocks and motions far outside the usual."""
    samples = draw(st.integers(2, 12))
    widths = [10.0 ** draw(st.floats(-7.0, 0.5)) for _ in range(samples)]
    strength = 10.0 ** draw(st.floats(-1.0, 2.0))
    columns = draw(st.integers(1, 4))
    rows = [[strength * draw(st.floats(-1.0, 1.0)) / w**k for k in range(columns)] for w in widths]
    pair = st.tuples

    def power(low: float, high: float) -> st.SearchStrategy[float]:
        return st.floats(low, high).map(lambda x: 10.0**x)

    return {
        "shaking": motion(np.cumsum([0.0, *widths]), rows),
        "p": draw(pair(power(-2.0, 2.0), power(-2.0, 2.0))),
        "alpha": draw(pair(st.floats(1e-3, 1.57), st.floats(1e-3, 1.57))),
        "e": draw(pair(power(-6.0, -0.05), power(-6.0, -0.05))),
        "nonlinear": draw(st.booleans()),
    }


@settings(quick, max_examples=150)
@given(extremes())
def test_every_march_ends_and_stays_sound(case: dict[str, object]) -> None:
    assert_sound(run(**case))  # type: ignore[arg-type]


# ---- Trace ----


def assert_traced_well(found: Run) -> None:
    """Continuous across the nodes, zero at impacts, with the velocities of the impact table, and never NaN."""
    nodes, impacts = found.nodes, found.impacts
    assert np.all(np.isfinite(found.traced(np.linspace(0.0, found.x[state.END], 400))))
    steps = np.flatnonzero((nodes[:-1, 3] != 0.0) & (nodes[1:, 3] != 0.0))
    ends = nodes[steps + 1, 0]
    left, right = found.traced(ends, steps), found.traced(ends, steps + 1)
    jump = np.abs(left - right)
    span = ends - nodes[steps, 0] + ends
    impact = np.isin(ends, impacts[:, 0])
    smooth = ~impact
    size = np.abs(left) + np.abs(right)
    assert np.all(jump[smooth, 0] <= 1e-14 * (size[:, 0] + size[:, 1] * span)[smooth])
    assert np.all(jump[smooth, 1] <= 1e-14 * (size[:, 1] + size[:, 2] * span)[smooth])
    rows = impacts[np.searchsorted(impacts[:, 0], ends[impact])]
    for rotation, velocity, speed in ((*left[impact, :2].T, rows[:, 2]), (*right[impact, :2].T, rows[:, 3])):
        assert np.all(np.abs(rotation) <= 1e-15 * ends[impact] * speed + 1e-14 * speed * (span - ends)[impact])
        assert np.all(np.abs(velocity - rows[:, 1] * speed) <= 1e-14 * (speed + (size[:, 2] * span)[impact]))


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [2, 5])
def test_the_trace_is_continuous_and_agrees_with_the_impacts(nonlinear: bool, columns: int) -> None:
    for seed in range(3):
        shaking = record(seed)
        rows = np.zeros((len(shaking.coefficients), columns))
        rows[:, :2] = shaking.coefficients
        found = run(shaking._replace(coefficients=rows), nonlinear=nonlinear)
        assert len(found.impacts) > 10
        assert_sound(found)
        assert_traced_well(found)


def test_the_trace_lies_still_between_the_last_arc_resolved_and_rest() -> None:
    found = run(FREE, velocity=0.1)
    last, rest = found.impacts[-1, 0], found.events[-1, 0]
    assert np.all(found.traced(np.linspace(last, rest, 9)[1:]) == 0.0)
    assert np.all(found.traced(np.linspace(found.impacts[-2, 0], last, 9)[1:-1])[:, 0] != 0.0)


def test_the_trace_does_not_depend_on_the_order_of_the_times() -> None:
    found = run(record(2), nonlinear=True)
    times = np.linspace(0.0, found.x[state.END], 500)
    shuffled = np.random.default_rng(0).permutation(500)
    assert_array_equal(found.traced(times[shuffled]), found.traced(times)[shuffled])
