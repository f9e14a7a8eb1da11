"""Whole responses by the kernels alone: how they end, resume and mirror, and what the trace makes of them."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import MINUS, NO_GROUND, PLUS, ULP, Pair, in_units_of_g, long_uncompiled, rocking_block, rules_for
from numpy.testing import assert_array_equal

from rocking.kernels import state
from rocking.kernels.ground import Ground
from rocking.kernels.march import march
from rocking.kernels.state import Struct, Structs, create_scratch, create_states
from rocking.kernels.trace import Trail, trace

quick = settings(deadline=None, max_examples=40)


class Run(NamedTuple):
    """What a march wrote, and how it ended."""

    status: int
    nodes: Structs
    impacts: Structs
    events: Structs
    sequences: Structs
    at: Struct
    trail: Trail

    @property
    def kinds(self) -> list[int]:
        return self.events["kind"].tolist()

    def traced(self, times: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """Rotation, velocity, acceleration."""
        times = np.asarray(times, dtype=float)
        if rows is None:
            rows = np.searchsorted(self.nodes["time"], times, side="right") - 1
        out = np.full((len(times), 3), np.nan)
        trace(self.trail, create_scratch(), times, np.asarray(rows, dtype=np.int64), out)
        return out


def record(seed: int, samples: int = 150, dt: float = 0.02, pga: float = 0.3) -> Ground:
    noise = np.random.default_rng(seed).normal(size=samples + 3)
    values = np.convolve(noise, np.ones(4), mode="valid")
    values *= pga / np.max(np.abs(values))
    return in_units_of_g(dt * np.arange(samples), np.column_stack([values[:-1], np.diff(values) / dt]))


def with_rows(ground: Ground, rows: np.ndarray) -> Ground:
    """The same pieces with other coefficients."""
    return in_units_of_g(ground.pieces[:, 0], rows)


def started(rotation: float = 0.0, velocity: float = 0.0) -> Struct:
    """State at time zero of a block at rest, or thrown off it."""
    at = create_states(1, 10**6)[0]
    if rotation != 0.0 or velocity != 0.0:
        sign = math.copysign(1.0, rotation if rotation != 0.0 else velocity)
        at["side"], at["u"], at["v"] = (PLUS if sign > 0.0 else MINUS), abs(rotation), sign * velocity
        at["peak"] = at["u"]
    return at


def run(
    ground: Ground,
    *,
    p: Pair = (2.0, 2.0),
    alpha: Pair = (0.15, 0.15),
    e: Pair = (0.9, 0.9),
    nonlinear: bool = False,
    rest_rule: int = state.RestRule.CERTIFIED,
    limit: float = 0.0,
    stop: float = math.inf,
    rotation: float = 0.0,
    velocity: float = 0.0,
    rows: int = 4096,
    keep: bool = True,
    block: Struct | None = None,
) -> Run:
    if block is None:
        block = rocking_block(p, alpha, e, nonlinear=nonlinear, limit=limit)
    rules = rules_for(nonlinear=nonlinear, rest_rule=rest_rule, stop=stop, writes_tables=keep)
    table, at, scratch = state.create_table(rows), started(rotation, velocity), create_scratch()
    status = march(ground, block, rules, table, scratch, at)
    while status == state.MarchStatus.FULL and len(table) < 200_000:
        table = state.enlarge_table(table)
        status = march(ground, block, rules, table, scratch, at)
    nodes = table["node"][: at["node_count"]].copy()
    kept = (table[name][: at[name + "_count"] if keep else 0] for name in ("impact", "event", "sequence"))
    return Run(status, nodes, *kept, at, Trail(ground, block, rules, state.expose_fields(nodes)))


def assert_sound(found: Run) -> None:
    """Time never runs backwards, the block is never below the ground, and no NaN has come in."""
    nodes, impacts = found.nodes, found.impacts
    assert found.status in (state.MarchStatus.DONE, state.MarchStatus.OVERTURNED)
    assert all(np.all(np.isfinite(nodes[name])) for name in nodes.dtype.names)
    assert np.all(np.diff(nodes["time"]) >= -2.0 * ULP * nodes["time"][1:])
    assert np.all(nodes["u"] >= 0.0)
    assert np.all(np.diff(impacts["time"]) >= 0.0)
    assert np.all(impacts["speed_after"] <= impacts["speed_before"])
    assert all(np.isfinite(found.at[name]) for name in ("u", "v", "peak", "end_time"))


def assert_same(one: Run, other: Run) -> None:
    """Bit for bit."""
    assert one.status == other.status
    for name in ("nodes", "impacts", "events", "sequences"):
        assert_array_equal(getattr(one, name), getattr(other, name))


# ---- Resuming, mirroring ----


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_march_that_runs_out_of_room_resumes_bit_for_bit(nonlinear: bool) -> None:
    for seed in range(4):
        whole = run(record(seed), nonlinear=nonlinear)
        resumed = run(record(seed), nonlinear=nonlinear, rows=3)
        assert len(whole.impacts) > 10
        assert_same(whole, resumed)
        assert whole.at == resumed.at


@long_uncompiled
@pytest.mark.cases(fast=2)
@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [2, 3])
def test_a_march_writes_into_its_table_and_never_behind_it(nonlinear: bool, columns: int) -> None:
    """Every size of a first table, with more rows behind it that must stay as they are."""
    rows = np.zeros((149, columns))
    rows[:, :2] = record(2).pieces[:-1, 2:]
    ground = with_rows(record(2), rows)
    block, scratch = rocking_block(nonlinear=nonlinear), create_scratch()
    rules = rules_for(nonlinear=nonlinear)
    whole = run(ground, nonlinear=nonlinear)
    assert len(whole.sequences) > 0
    assert max(whole.sequences["impacts"]) > 10
    for size in range(max(whole.at["node_count"], whole.at["impact_count"]) + 6):
        table, at = state.create_table(size + 5), started()
        table.view(np.uint8)[:] = 0xA5
        guard = table[size:].tobytes()
        status = march(ground, block, rules, table[:size], scratch, at)
        assert table[size:].tobytes() == guard
        while status == state.MarchStatus.FULL:
            size *= 2
            grown = state.create_structs(max(size, 8) + 5, state.TABLE_DTYPE)
            grown.view(np.uint8)[:] = 0xA5
            grown[: len(table) - 5] = table[: len(table) - 5]
            size = max(size, 8)
            table = grown
            guard = table[size:].tobytes()
            status = march(ground, block, rules, table[:size], scratch, at)
            assert table[size:].tobytes() == guard
        assert (status, at) == (whole.status, whole.at)
        assert_array_equal(table["node"][: at["node_count"]], whole.nodes)
        assert_array_equal(table["impact"][: at["impact_count"]], whole.impacts)


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("budget", [1, 7, 50])
def test_a_march_in_slices_is_the_march_in_one(nonlinear: bool, budget: int) -> None:
    ground, block, rules = record(1), rocking_block(nonlinear=nonlinear), rules_for(nonlinear=nonlinear)
    whole = run(ground, nonlinear=nonlinear)
    table, at, scratch, pauses = state.create_table(4096), started(), create_scratch(), 0
    at["budget"] = budget
    while march(ground, block, rules, table, scratch, at) == state.MarchStatus.PAUSED:
        at["budget"] = budget
        pauses += 1
    assert pauses > 1
    assert_array_equal(table["impact"][: at["impact_count"]], whole.impacts)
    assert_array_equal(table["event"][: at["event_count"]], whole.events)
    assert_array_equal(table["node"][: at["node_count"]], whole.nodes)


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_march_from_piece_to_piece_is_the_march_in_one(nonlinear: bool) -> None:
    ground, block, rules = record(1), rocking_block(nonlinear=nonlinear), rules_for(nonlinear=nonlinear)
    whole = run(ground, nonlinear=nonlinear)
    table, at, scratch = state.create_table(4096), started(), create_scratch()
    for until in [*range(1, len(ground.pieces)), state.NO_STOP_PIECE]:
        at["stop_piece"] = until
        status = march(ground, block, rules, table, scratch, at)
        is_stopped = until < state.NO_STOP_PIECE and at["piece"] >= until
        assert status == (state.MarchStatus.RUNNING if is_stopped else whole.status)
        if status != state.MarchStatus.RUNNING:
            break
    assert_array_equal(table["impact"][: at["impact_count"]], whole.impacts)
    assert_array_equal(table["event"][: at["event_count"]], whole.events)
    assert at["peak"] == whole.at["peak"]


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [2, 3])
def test_recording_or_not_gives_the_same_bits(nonlinear: bool, columns: int) -> None:
    for seed in range(6):
        rows = np.zeros((149, columns))
        rows[:, :2] = record(seed).pieces[:-1, 2:]
        ground = with_rows(record(seed), rows)
        kept = run(ground, nonlinear=nonlinear)
        state_alone = run(ground, nonlinear=nonlinear, rows=0, keep=False)
        assert kept.status == state_alone.status
        for name in state.STATE_DTYPE.names:
            if name not in ("node_count", "budget"):
                assert kept.at[name] == state_alone.at[name], name


# ---- Rest and uplift ----


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [1, 2, 5])
def test_rectangular_pulses_uplift_by_their_jumps_and_the_block_rests_between(nonlinear: bool, columns: int) -> None:
    rows = np.zeros((3, columns))
    rows[:, 0] = 0.3, 0.0, -0.3
    found = run(in_units_of_g([0.0, 0.1, 20.0, 20.1], rows), nonlinear=nonlinear)
    assert found.kinds == [state.EventKind.UPLIFT, state.EventKind.REST, state.EventKind.UPLIFT, state.EventKind.REST]
    assert found.events["time"][[0, 2]].tolist() == [0.0, 20.0]
    assert found.events["side"].tolist() == [-1, 0, 1, 0]
    first, second = found.events["time"][1], found.events["time"][3] - 20.0
    assert second == pytest.approx(first, abs=1e-10)
    assert_sound(found)


@pytest.mark.parametrize("row", [[0.2], [0.2, -0.01], [0.2, 0.0, -0.05]])
def test_a_motion_of_one_piece_may_uplift_at_its_very_start(row: list[float]) -> None:
    found = run(in_units_of_g([0.0, 0.2], [row]))
    assert found.events[0].tolist() == (0.0, state.EventKind.UPLIFT, -1)
    assert found.kinds == [state.EventKind.UPLIFT, state.EventKind.REST]
    assert found.status == state.MarchStatus.DONE
    assert_sound(found)


def test_a_motion_that_never_passes_a_threshold_leaves_the_block_at_rest() -> None:
    found = run(in_units_of_g([0.0, 1.0, 2.0], [[0.1, 0.04], [0.14, -0.2]]))
    assert (len(found.events), len(found.impacts), found.nodes.shape[0]) == (0, 0, 1)
    assert found.at["end_time"] == 2.0


@long_uncompiled
@pytest.mark.parametrize("shape", [[1.0, 0.0], [1.0, -1.0], [0.0, 1.0], [1.0, 1.0]])
@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_motion_clipped_at_the_threshold_ends_whatever_rounding_makes_of_it(
    shape: list[float], nonlinear: bool
) -> None:
    """Four pieces between samples that are zero or, within some units in the last place, at the threshold."""
    alpha = 0.15
    for ulps in range(-24, 25, 3):
        top = (math.tan(alpha) if nonlinear else alpha) * (1.0 + ulps * ULP)
        values = top * np.array([*shape, *shape, shape[0]])
        ground = in_units_of_g(0.1 * np.arange(5), np.column_stack([values[:-1], np.diff(values) / 0.1]))
        found = run(ground, nonlinear=nonlinear)
        assert_sound(found)
        assert len(found.nodes) < 200, ulps


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [1, 5, 21])
def test_coefficients_that_are_zero_change_nothing(nonlinear: bool, columns: int) -> None:
    """Up to the highest degree that a motion may have."""
    ground = in_units_of_g([0.0, 0.1, 0.5, 0.6], np.full((3, 1), 0.2) * [[1.0], [-0.4], [-1.0]])
    rows = np.zeros((3, columns))
    rows[:, :1] = ground.pieces[:-1, 2:3]
    one, other = run(ground, nonlinear=nonlinear), run(with_rows(ground, rows), nonlinear=nonlinear)
    assert len(one.impacts) > 10
    assert one.kinds == other.kinds
    assert one.events["time"] == pytest.approx(other.events["time"], abs=1e-11)


# ---- Ends ----


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_march_stops_in_an_arc_at_rest_and_exactly_at_an_impact(nonlinear: bool) -> None:
    whole = run(record(1), nonlinear=nonlinear)
    impact, rest = whole.impacts["time"][5], whole.events["time"][whole.events["kind"] == state.EventKind.REST][-1]
    middle = 0.5 * (whole.impacts["time"][5] + whole.impacts["time"][6])
    for stop in (middle, impact, rest + 0.5, 1e3, whole.nodes["time"][7], whole.events["time"][0]):
        found = run(record(1), nonlinear=nonlinear, stop=stop)
        assert (found.status, found.at["end_time"]) == (state.MarchStatus.DONE, stop)
        before = whole.impacts[whole.impacts["time"] < stop]
        assert_array_equal(found.impacts[: len(before)], before)
        assert len(found.impacts) - len(before) in ((0, 1) if stop == impact else (0,))
        assert_sound(found)
    assert run(record(1), nonlinear=nonlinear, stop=middle).nodes["time"][-1] == middle


def test_a_march_may_stop_between_the_last_impact_resolved_and_rest() -> None:
    whole = run(NO_GROUND, velocity=0.1)
    last, rest = whole.impacts["time"][-1], whole.events["time"][-1]
    assert rest > last
    found = run(NO_GROUND, velocity=0.1, stop=0.5 * (last + rest))
    assert (found.status, found.kinds) == (state.MarchStatus.DONE, [])
    assert found.sequences["lower"][0] <= rest <= found.sequences["upper"][0]
    assert_array_equal(found.traced(np.linspace(last, found.at["end_time"], 9)[2:]), np.zeros((7, 3)))


@long_uncompiled
@pytest.mark.parametrize("nonlinear", [False, True])
def test_without_loss_the_block_rocks_on_until_the_stop(nonlinear: bool) -> None:
    found = run(NO_GROUND, velocity=0.1, e=(1.0, 1.0), nonlinear=nonlinear, stop=50.0)
    assert (found.status, found.at["end_time"], len(found.sequences)) == (state.MarchStatus.DONE, 50.0, 0)
    assert np.max(np.abs(found.impacts["speed_after"] - 0.1)) <= 1e-13
    assert np.ptp(np.diff(found.impacts["time"])) <= 1e-12
    assert_sound(found)


def test_a_block_on_its_corner_balances() -> None:
    for nonlinear in (False, True):
        assert run(NO_GROUND, rotation=0.15, nonlinear=nonlinear).status == state.MarchStatus.BALANCED
        assert run(NO_GROUND, rotation=0.15, nonlinear=nonlinear, stop=9.0).status == state.MarchStatus.DONE
        fallen = run(NO_GROUND, rotation=0.15 * (1.0 + ULP), nonlinear=nonlinear)
        assert (fallen.status, fallen.kinds) == (state.MarchStatus.OVERTURNED, [state.EventKind.OVERTURN])
        assert fallen.at["peak"] == 0.5 * math.pi
        assert fallen.at["peak_time"] == fallen.at["end_time"] == fallen.events["time"][0]


def test_intervals_that_time_can_no_longer_tell_apart_end_a_sequence() -> None:
    found = run(NO_GROUND, velocity=0.1, rest_rule=state.RestRule.TIME, limit=math.inf)
    exact = run(NO_GROUND, velocity=0.1)
    assert found.at["rests_by_rounding"] == 1
    assert np.isnan(found.sequences["lower"][0])
    assert np.isnan(found.sequences["upper"][0])
    assert found.events["time"][-1] == pytest.approx(exact.events["time"][-1], abs=1e-12)


@pytest.mark.parametrize(
    "rest_rule, limit", [(state.RestRule.VELOCITY, 1e-9), (state.RestRule.INTERVAL, 1e-9), (state.RestRule.TIME, 2.0)]
)
def test_other_rest_rules_end_a_sequence_at_their_threshold(rest_rule: int, limit: float) -> None:
    found = run(NO_GROUND, velocity=0.1, rest_rule=rest_rule, limit=limit)
    assert (found.status, found.kinds, found.at["rests_by_rounding"]) == (
        state.MarchStatus.DONE,
        [state.EventKind.REST],
        0,
    )
    measure = {
        state.RestRule.VELOCITY: -found.impacts["speed_after"],
        state.RestRule.INTERVAL: -np.diff(found.impacts["time"], prepend=0.0),
        state.RestRule.TIME: found.impacts["time"],
    }[rest_rule]
    threshold = limit if rest_rule == state.RestRule.TIME else -limit
    assert np.all(measure[:-1] < threshold)
    assert measure[-1] >= threshold


# ---- States that rounding could break ----


def test_an_impact_on_a_breakpoint_is_struck_once_and_with_full_speed() -> None:
    """The pieces end at, or within a few units in the last place of, an impact of the motion without pieces."""
    whole = run(in_units_of_g([0.0, 9.0], [[0.02, 0.0]]), velocity=0.1)
    impact = whole.impacts["time"][0]
    for ulps in range(-6, 7):
        found = run(in_units_of_g([0.0, impact * (1.0 + ulps * ULP), 9.0], [[0.02, 0.0]] * 2), velocity=0.1)
        assert found.at["rests_by_rounding"] == 0
        assert len(found.impacts) == len(whole.impacts)
        assert found.impacts["speed_before"][0] == pytest.approx(whole.impacts["speed_before"][0], rel=1e-12)
        assert found.events["time"][-1] == pytest.approx(whole.events["time"][-1], abs=1e-11)


def test_an_impact_without_speed_ends_at_rest_and_poisons_nothing() -> None:
    """The block is set down so gently by a motion made for it, u = (1 - t)^3 / 10, that no speed is left."""
    lam, alpha = 4.0, 0.15
    u = np.polynomial.Polynomial([1.0, -1.0]) ** 3 * 0.1
    row = (u - alpha - u.deriv(2) / lam).coef
    found = run(in_units_of_g([0.0, 2.0], [row]), rotation=0.1, velocity=-0.3)
    assert len(found.impacts) > 0
    assert found.impacts["speed_before"][0] <= 1e-7
    assert found.status in (state.MarchStatus.DONE, state.MarchStatus.OVERTURNED)
    assert all(np.all(np.isfinite(found.nodes[name])) for name in found.nodes.dtype.names)


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
        "ground": in_units_of_g(np.cumsum([0.0, *widths]), rows),
        "p": draw(pair(power(-2.0, 2.0), power(-2.0, 2.0))),
        "alpha": draw(pair(st.floats(1e-3, 1.57), st.floats(1e-3, 1.57))),
        "e": draw(pair(power(-6.0, -0.05), power(-6.0, -0.05))),
        "nonlinear": draw(st.booleans()),
    }


@long_uncompiled
@settings(quick, max_examples=75)
@given(extremes())
def test_every_march_ends_and_stays_sound(case: dict[str, object]) -> None:
    assert_sound(run(**case))  # type: ignore[arg-type]


# ---- Trace ----


def assert_traced_well(found: Run) -> None:
    """Continuous across the nodes, zero at impacts, with the velocities of the impact table, and never NaN."""
    nodes, impacts = found.nodes, found.impacts
    assert np.all(np.isfinite(found.traced(np.linspace(0.0, found.at["end_time"], 400))))
    steps = np.flatnonzero((nodes["side"][:-1] != state.AT_REST) & (nodes["side"][1:] != state.AT_REST))
    ends = nodes["time"][steps + 1]
    left, right = found.traced(ends, steps), found.traced(ends, steps + 1)
    jump = np.abs(left - right)
    span = ends - nodes["time"][steps] + ends
    impact = np.isin(ends, impacts["time"])
    smooth = ~impact
    size = np.abs(left) + np.abs(right)
    assert np.all(jump[smooth, 0] <= 1e-14 * (size[:, 0] + size[:, 1] * span)[smooth])
    assert np.all(jump[smooth, 1] <= 1e-14 * (size[:, 1] + size[:, 2] * span)[smooth])
    rows = impacts[np.searchsorted(impacts["time"], ends[impact])]
    for (rotation, velocity), speed in (
        (left[impact, :2].T, rows["speed_before"]),
        (right[impact, :2].T, rows["speed_after"]),
    ):
        assert np.all(np.abs(rotation) <= 1e-15 * ends[impact] * speed + 1e-14 * speed * (span - ends)[impact])
        assert np.all(np.abs(velocity - rows["side"] * speed) <= 1e-14 * (speed + (size[:, 2] * span)[impact]))


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("columns", [2, 5])
def test_the_trace_is_continuous_and_agrees_with_the_impacts(nonlinear: bool, columns: int) -> None:
    for seed in range(3):
        ground = record(seed)
        rows = np.zeros((len(ground.pieces) - 1, columns))
        rows[:, :2] = ground.pieces[:-1, 2:]
        found = run(with_rows(ground, rows), nonlinear=nonlinear)
        assert len(found.impacts) > 10
        assert_sound(found)
        assert_traced_well(found)


def test_the_trace_lies_still_between_the_last_arc_followed_and_rest() -> None:
    """The first arc after the last impact resolved is a tenth of what is left; those after it are left out."""
    found = run(NO_GROUND, velocity=0.1)
    last, rest = found.impacts["time"][-1], found.events["time"][-1]
    assert np.all(found.traced(np.linspace(last, rest, 9)[1:]) == 0.0)
    assert np.all(found.traced(np.linspace(found.impacts["time"][-2], last, 9)[1:-1])[:, 0] != 0.0)


def test_the_trace_does_not_depend_on_the_order_of_the_times() -> None:
    found = run(record(2), nonlinear=True)
    times = np.linspace(0.0, found.at["end_time"], 500)
    shuffled = np.random.default_rng(0).permutation(500)
    assert_array_equal(found.traced(times[shuffled]), found.traced(times)[shuffled])
