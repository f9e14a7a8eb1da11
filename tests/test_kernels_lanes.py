"""Steps of many lanes: exact where they are quiet, and quiet only where nothing happens."""

import math
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_structs import ULP, in_units_of_g, long_uncompiled, one_sided, rocking_block, rules_for, state_of
from oracles.taylor import System, after

from rocking.kernels import state
from rocking.kernels.arc import evaluate_series, expand_arc
from rocking.kernels.ground import LENGTH, Ground, join_grounds
from rocking.kernels.lane_steps import LANE_COUNT, step_linear, step_nonlinear, step_weighted
from rocking.kernels.lanes import (
    MAX_SUBSTEP,
    MAX_WEIGHTED_SUBSTEP,
    SimulationPool,
    build_pool,
    clear_lane,
    compute_stumpff,
    fill_lane,
    load_samples,
    save_lane,
)
from rocking.kernels.series import ValueAndSlope
from rocking.kernels.state import Struct, Structs, create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

mp = mpmath.mp.clone()
mp.dps = 60

quick = settings(deadline=None, max_examples=80)
QUARTER_TURN = 0.5 * math.pi


@quick
@given(st.floats(-300.0, 0.0), st.sampled_from([1.0, -1.0]), st.integers(1, 3))
def test_stumpffs_functions_are_exact_to_two_units_in_the_last_place(exponent: float, sign: float, k: int) -> None:
    """c_k(q) = sum q^j/(k + 2j)!: (sinh z)/z, (cosh z - 1)/z^2, (sinh z - z)/z^3 with z^2 = q."""
    q = sign * 10.0**exponent
    with mpmath.workdps(60):
        exact = sum(mp.mpf(q) ** j / mp.factorial(k + 2 * j) for j in range(20))
        found = float(compute_stumpff(k, q))
        assert abs(found - exact) <= 2.0 * ULP * exact
        if exponent > -8.0:
            z = mp.sqrt(mp.mpf(q))
            closed = {1: mp.sinh(z) / z, 2: (mp.cosh(z) - 1) / z**2, 3: (mp.sinh(z) - z) / z**3}[k]
            assert abs(exact - mp.re(closed)) <= mp.mpf(10) ** -25


# ---- Single steps ----


class Way(NamedTuple):
    """How lanes step: the model, into how many substeps, and the weight (at the start, per second) where it changes."""

    nonlinear: bool = False
    substeps: int = 0
    weight: ValueAndSlope | None = None


def ground_under(way: Way, row: ValueAndSlope, *corners: float) -> Ground:
    """Ground that pushes by a row on each piece, and lifts so that the weight is that of the way."""
    pieces = len(corners) - 1
    lifts = None if way.weight is None else [(way.weight[0] - 1.0, way.weight[1])] * pieces
    return in_units_of_g(corners, [row] * pieces, vertical=lifts)


class Step(NamedTuple):
    """What one lane's step started from and how it ended."""

    block: Struct
    start: Struct
    end: Struct
    quiet: bool


def stepped(
    blocks: Structs,
    states: Structs,
    row: ValueAndSlope,
    h: float,
    way: Way = Way(),  # noqa: B008
    *,
    late: float = 0.0,
    fallen: float = QUARTER_TURN,
) -> list[Step]:
    """Take up to a group of blocks through one sample that starts with row[0] and changes by row[1] per second."""
    lift = None if way.weight is None else (way.weight[0] - 1.0, way.weight[1])
    sample = in_units_of_g([0.0, h, h + (h + late), 10.0 * h], [row] * 3, vertical=lift and [lift] * 3)
    grounds, count = join_grounds([sample]), len(blocks)
    grounds.pieces[1, LENGTH] = h + late  # beyond the rounding of the breakpoints
    blocks["overturn_angle"] = fallen
    substeps = way.substeps if way.nonlinear else 0
    pool: SimulationPool = build_pool(
        grounds, np.zeros(count, dtype=np.int64), np.ones(count), blocks, states, math.inf, substeps
    )
    before = states.copy()
    states["piece"] = 1
    for lane in range(LANE_COUNT):
        if lane < count:
            fill_lane(pool, rules_for(nonlinear=way.nonlinear), lane, lane)
        else:
            clear_lane(pool, lane)
    group = pool.groups[0]
    load_samples(pool)
    if way.nonlinear:
        busy = step_nonlinear(group, None if lift is None else (1.0, 0.0), 1.0, way.substeps)
    else:
        busy = step_linear(group, 1.0) if lift is None else step_weighted(group, 1.0, way.substeps)
    events = np.array(group["has_event"][: len(blocks)], dtype=bool)
    assert busy == np.sum(group["has_event"])
    assert not np.any(group["has_event"][len(blocks) :]) or not np.all(np.isfinite(row))  # empty lanes
    for lane in range(len(blocks)):
        assert save_lane(pool, lane) == lane
        assert states[lane]["piece"] == (1 if events[lane] else 2)
    return [Step(blocks[k], before[k], states[k], not events[k]) for k in range(len(blocks))]


def drawn(random: np.random.Generator, nonlinear: bool, h: float, stiffness: float = 1.0) -> tuple[Structs, Structs]:
    """A group of blocks in motion: steps from next to nothing to one over p, rotations and speeds of all sizes."""
    blocks, states = state.create_structs(LANE_COUNT, state.BLOCK_DTYPE), state.create_states(LANE_COUNT, 0)
    width = 10.0 ** random.uniform(-9.0, -1.4 if nonlinear else 0.0, LANE_COUNT)
    for k in range(LANE_COUNT):
        p, alpha = width[k] / h, 10.0 ** random.uniform(-2.0, 0.0)
        block = rocking_block((p, p), (alpha, alpha), nonlinear=nonlinear)
        if not nonlinear:
            block["stiffness"] *= stiffness
        blocks[k] = block
        states[k]["side"] = random.integers(2)
        states[k]["u"] = alpha * 10.0 ** random.uniform(-6.0, 0.1)
        speed = max(p * alpha, states[k]["u"] / h * 10.0 ** random.uniform(-6.0, 0.0))
        states[k]["v"] = random.choice([-1.0, 1.0]) * speed * 10.0 ** random.uniform(-4.0, 0.5)
        states[k]["peak"] = max(states[k]["u"], 2.0 * alpha)
    return blocks, states


def linear_end(step: Step, row: tuple[float, float], t: float) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Rotation and velocity in 60 digits."""
    side = int(step.start["side"])
    lam, gain, threshold = (float(step.block[name][side]) for name in ("stiffness", "restoring_gain", "threshold"))
    push = [(1 - 2 * side) * x for x in row]
    return after(System(lam, threshold, gain=gain), step.start["u"], step.start["v"], t, push)


def rounds_of(one: float, few: int, many: int) -> pytest.MarkDecorator:
    """How many groups of blocks are judged; of less than one its first blocks."""
    more = pytest.param(few, marks=pytest.mark.thorough), pytest.param(many, marks=pytest.mark.slow)
    return pytest.mark.parametrize("rounds", [one, *more])


@pytest.mark.cases(fast=4)
@rounds_of(0.5, 3, 20)
@pytest.mark.parametrize("late", [0.0, 1e-9, -1e-9])
@pytest.mark.parametrize("stiffness", [1.0, 0.0, -1.0], ids=["block", "ball", "oscillator"])
def test_a_quiet_linear_step_is_exact(stiffness: float, late: float, rounds: float) -> None:
    """To a few units in the last place of the largest of rotation, way and pull."""
    random, quiet = np.random.default_rng([1, math.ceil(rounds)]), 0
    for _ in range(math.ceil(rounds)):
        h = 10.0 ** random.uniform(-3.0, -1.0)
        row = (random.normal() * 0.1, random.normal() * 0.1 / h)
        for step in stepped(*drawn(random, False, h, stiffness), row, h, late=late * h)[: int(rounds * LANE_COUNT)]:
            if not step.quiet:
                assert step.start["u"] == step.end["u"]
                assert step.start["v"] == step.end["v"]
                continue
            quiet += 1
            u, v = linear_end(step, row, h * (1.0 + late))
            side = int(step.start["side"])
            push = float(step.block["restoring_gain"][side]) * (
                step.block["threshold"][side] + abs(row[0]) + abs(row[1]) * h
            )
            size = max(abs(step.start["u"]), abs(step.start["v"]) * h, abs(u), abs(v) * h, push * h * h)
            assert abs(step.end["u"] - u) <= 4.0 * ULP * size
            assert abs(step.end["v"] - v) * h <= 8.0 * ULP * size
    assert quiet > 16 * rounds


@pytest.mark.cases(fast=3)
@pytest.mark.parametrize("late", [0.0, 1e-13, -1e-13])
@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("rounds", [5, pytest.param(25, marks=pytest.mark.thorough)])
def test_a_quiet_nonlinear_step_is_the_full_series(substeps: int, late: float, rounds: int) -> None:
    """To a few units in the last place of the largest of rotation, way, and a fraction of the slenderness."""
    random, quiet, scratch = np.random.default_rng(2), 0, create_scratch()
    rules = rules_for(nonlinear=True)
    for _ in range(rounds):
        h = 10.0 ** random.uniform(-3.0, -1.0)
        row = (random.normal() * 0.1, random.normal() * 0.1 / h)
        ground = in_units_of_g([0.0, h + late, 2.0], [row, row])
        for step in stepped(*drawn(random, True, h), row, h, Way(True, substeps), late=late):
            if not step.quiet:
                assert step.start["u"] == step.end["u"]
                continue
            quiet += 1
            order, reach, _ = expand_arc(ground, step.block, rules, scratch, step.start, h + late)
            assert reach == h + late
            u, v, _ = evaluate_series(scratch["rotation"], order, h + late)
            alpha = float(step.block["slenderness"][int(step.start["side"])])
            size = max(step.start["u"], abs(step.start["v"]) * h, abs(u), abs(v) * h, 0.125 * alpha)
            assert abs(step.end["u"] - u) <= 8.0 * substeps * ULP * size
            assert abs(step.end["v"] - v) * h <= 8.0 * substeps * ULP * size
    assert quiet > 16 * rounds


# ---- While the weight changes ----

WEIGHTS = {
    "weak": (0.7, 1.3, 0.2),
    "strong": (-1.0, 3.0, 2.0),
    "near lift-off": (-1e-3, 1e-3, 1e-2),
    "at lift-off": (0.0, 0.0, 1.0),
}


def weighted_cases(
    random: np.random.Generator, nonlinear: bool, kind: str, substeps: int
) -> tuple[Structs, Structs, ValueAndSlope, ValueAndSlope]:
    """A group of blocks in motion, the push and the weight over a step of one second."""
    low, high, swing = WEIGHTS[kind]
    weight = (random.uniform(low, high), random.normal() * swing)
    heaviest = max(1.0, abs(weight[0]), abs(sum(weight)))
    longest = substeps * (MAX_SUBSTEP if nonlinear else MAX_WEIGHTED_SUBSTEP) / math.sqrt(heaviest)
    blocks, states = state.create_structs(LANE_COUNT, state.BLOCK_DTYPE), state.create_states(LANE_COUNT, 0)
    for k in range(LANE_COUNT):
        p, alpha = longest * 10.0 ** random.choice([0.0, random.uniform(-9.0, 0.0)]), 10.0 ** random.uniform(-2.0, 0.0)
        blocks[k] = rocking_block((p, p), (alpha, alpha), nonlinear=nonlinear)
        u = alpha * random.choice([1.0, 10.0 ** random.uniform(-6.0, 0.1)])  # balanced, too
        v = random.choice([0.0, random.choice([-1.0, 1.0]) * max(p * alpha, u) * 10.0 ** random.uniform(-4.0, 0.0)])
        states[k] = state_of(int(random.integers(2)), u, v, peak=9.0)
    push = (random.normal() * 0.1, random.normal() * 0.1) if random.random() < 0.8 else (0.0, 0.0)
    return blocks, states, push, weight


@pytest.mark.cases(fast=8)
@rounds_of(0.25, 1, 4)
@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("kind", WEIGHTS)
@pytest.mark.parametrize("nonlinear", [False, True], ids=["linear", "nonlinear"])
def test_a_quiet_step_is_exact_while_the_weight_changes(
    nonlinear: bool, kind: str, substeps: int, rounds: float
) -> None:
    """To a few units in the last place, beside 60 digits; also without weight, in balance or released from rest."""
    random, quiet = np.random.default_rng([5, substeps, math.ceil(rounds)]), 0
    for _ in range(math.ceil(rounds)):
        blocks, states, push, weight = weighted_cases(random, nonlinear, kind, substeps)
        steps = stepped(blocks, states, push, 1.0, Way(nonlinear, substeps, weight), fallen=99.0)
        for step in steps[: int(rounds * LANE_COUNT)]:
            if not step.quiet:
                assert (step.start["u"], step.start["v"]) == (step.end["u"], step.end["v"])
                continue
            quiet += 1
            side = int(step.start["side"])
            lam, alpha = float(step.block["stiffness"][side]), float(step.block["slenderness"][side])
            toward = (push[0] * (1 - 2 * side), push[1] * (1 - 2 * side))
            system = System(lam, alpha, nonlinear)
            u, v = after(system, step.start["u"], step.start["v"], 1.0, toward, weight)
            pulls = lam * (alpha * (abs(weight[0]) + abs(weight[1])) + abs(push[0]) + abs(push[1]))
            size = max(abs(step.start["u"]), abs(step.start["v"]), abs(u), abs(v), pulls, 0.125 * alpha * nonlinear)
            assert abs(step.end["u"] - u) <= 8.0 * substeps * ULP * size
            assert abs(step.end["v"] - v) <= 8.0 * substeps * ULP * size
    assert quiet > 7 * rounds


def shapes(random: np.random.Generator, h: float, nonlinear: bool) -> tuple[Structs, Structs]:
    """Steps with turning points: down to nearly nothing and up again, up to nearly the highest and down again."""
    blocks, states = state.create_structs(LANE_COUNT, state.BLOCK_DTYPE), state.create_states(LANE_COUNT, 0)
    for k in range(LANE_COUNT):
        alpha = 0.2
        p = random.uniform(0.05, 1.0) * (0.02 if nonlinear else 1.0) / h
        blocks[k] = rocking_block((p, p), (alpha, alpha), nonlinear=nonlinear)
        u = alpha * random.uniform(0.01, 1.9)
        states[k]["side"] = random.integers(2)
        w = abs(p * p * (u - alpha)) * random.uniform(0.1, 3.0)
        states[k]["v"] = random.choice([-1.0, 1.0]) * w * h * random.uniform(0.0, 1.2)
        turn = abs(states[k]["v"]) * h * 0.5
        states[k]["u"] = max(1e-9, min(u, turn * random.uniform(0.5, 1.5))) if random.random() < 0.5 else u
        states[k]["peak"] = states[k]["u"] + turn * random.uniform(0.0, 1.5)
    return blocks, states


@pytest.mark.cases(fast=2)
@long_uncompiled
@pytest.mark.parametrize("nonlinear", [False, True], ids=["linear", "nonlinear"])
@pytest.mark.parametrize("weighted", [False, True], ids=["", "weighted"])
@pytest.mark.parametrize("rounds", [30, pytest.param(150, marks=pytest.mark.thorough)])
def test_a_lane_is_quiet_only_if_nothing_happens_in_its_step(nonlinear: bool, weighted: bool, rounds: int) -> None:
    """No rotation at or below zero, and none above the highest so far but one that rises to the step's end."""
    random, scratch, quiet = np.random.default_rng(3), create_scratch(), 0
    rules = rules_for(nonlinear=nonlinear)
    for _ in range(rounds):
        h = 10.0 ** random.uniform(-3.0, -1.0)
        row = (random.normal() * 0.3, random.normal() * (0.3 if nonlinear else 2.0) / h)
        fallen = random.choice([0.1, 0.4, QUARTER_TURN])
        way = Way(nonlinear, int(nonlinear))
        if weighted:
            way = Way(nonlinear, 1, (random.uniform(-0.5, 2.0), random.normal() * 0.3 / h))
        ground = ground_under(way, row, 0.0, 9.0)
        for step in stepped(*shapes(random, h, nonlinear or weighted), row, h, way, fallen=fallen):
            if not step.quiet:
                continue
            quiet += 1
            order, reach, _ = expand_arc(ground, step.block, rules, scratch, step.start, h)
            path = [evaluate_series(scratch["rotation"], order, t)[:2] for t in np.linspace(0.0, reach, 41)]
            u = np.array([rotation for rotation, _ in path])
            highest = max(u[0], u[-1])
            assert np.min(u) > 0.0
            assert np.max(u) < fallen
            assert np.max(u) <= max(step.start["peak"], highest) * (1.0 + 1e-14)
            if highest > step.start["peak"]:
                assert u[-1] > u[0] * (1.0 - 1e-14)  # it is seen at the end, when it is taken from its lane
            assert step.end["peak"] >= np.max(u) * (1.0 - 1e-14) or step.start["peak"] >= np.max(u)
    assert quiet > 10 * rounds / 3


P, ALPHA, H = 0.5, 0.2, 0.005


def one(u: float, v: float, peak: float, *, nonlinear: bool = False) -> tuple[Structs, Structs]:
    blocks, states = state.create_structs(1, state.BLOCK_DTYPE), state.create_states(1, 0)
    blocks[0] = rocking_block((P, P), (ALPHA, ALPHA), nonlinear=nonlinear)
    states[0] = state_of(0, u, v, peak=peak)
    return blocks, states


#: The weight grows by a tenth within the step.
HEAVIER = (0.9, 0.1 / H)
WAYS = {
    "linear": Way(),
    "nonlinear": Way(True, 1),
    "weighted linear": Way(False, 1, HEAVIER),
    "weighted nonlinear": Way(True, 1, HEAVIER),
}
every = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)


def is_quiet_step(way: Way, u: float, v: float, peak: float, row: tuple[float, float], fallen: float = 9.0) -> bool:
    return stepped(*one(u, v, peak, nonlinear=way.nonlinear), row, H, way, fallen=fallen)[0].quiet


def path(way: Way, u: float, v: float, row: tuple[float, float]) -> np.ndarray:
    """Rotation throughout the step."""
    blocks, states = one(u, v, 0.0, nonlinear=way.nonlinear)
    rules, scratch = rules_for(nonlinear=way.nonlinear), create_scratch()
    order, reach, _ = expand_arc(ground_under(way, row, 0.0, 9.0), blocks[0], rules, scratch, states[0], H)
    return np.array([evaluate_series(scratch["rotation"], order, t)[0] for t in np.linspace(0.0, reach, 2001)])


@every
@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_dip_to_the_ground_between_two_ends_above_it_is_an_event(way: Way, share: float) -> None:
    """Pushed up while it comes down; a little higher it is quiet."""
    row = (-1.2, 0.0)
    v = -share * P * P * H
    depth = -np.min(path(way, 0.0, v, row))
    for low in (0.9, 0.999):
        rotation = path(way, low * depth, v, row)
        assert np.min(rotation) < 0.0
        assert not is_quiet_step(way, low * depth, v, 1.0, row)
    assert is_quiet_step(way, depth + 0.2 * P * P * H * H, v, 1.0, row)


@every
@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_bulge_over_the_highest_so_far_between_two_ends_below_it_is_an_event(way: Way, share: float) -> None:
    row, u = (0.8, 0.0), 0.1
    v = share * 0.9 * P * P * H
    rotation = path(way, u, v, row)
    top = np.max(rotation)
    assert max(u, rotation[-1]) < top
    for below in (1e-6, 0.01, 0.5):
        assert not is_quiet_step(way, u, v, top - below * (top - max(u, rotation[-1])), row)
    assert is_quiet_step(way, u, v, top + 0.2 * P * P * H * H, row)


@pytest.mark.parametrize("up", [1.0, -1.0], ids=["bulge", "dip"])
def test_the_curvature_of_an_oscillator_may_be_largest_inside_a_step(up: float) -> None:
    """u = A cos(omega (t - h/2)) - c over a step of one radian: bulges by A (1 - cos(1/2))."""
    a, beyond = up, 1.0 - math.cos(0.5)
    blocks, states = state.create_structs(1, state.BLOCK_DTYPE), state.create_states(1, 0)
    for share, quiet in ((0.95, False), (1.06, True)):
        u = 1.0 if up > 0.0 else share * beyond
        pull = (a * math.cos(0.5) - u) / H**2
        blocks[0] = one_sided(-1.0 / H**2, pull, 1.0, 0.5)
        peak = u + share * beyond if up > 0.0 else 9.0
        states[0] = state_of(0, u, a * math.sin(0.5) / H, peak=peak)
        found = stepped(blocks, states, (0.0, 0.0), H, fallen=99.0)[0]
        assert found.quiet == quiet
        if quiet:
            assert found.end["u"] == pytest.approx(u, rel=1e-14)


@every
def test_a_rotation_that_rises_all_the_way_is_quiet_and_one_that_turns_is_not(way: Way) -> None:
    assert is_quiet_step(way, 0.1, 1.0, 0.1, (0.0, 0.0))
    assert not is_quiet_step(way, 0.1, 0.05 * P * P * H, 0.1, (0.0, 0.0))


@every
def test_a_rotation_that_falls_from_the_highest_so_far_is_quiet_but_not_one_that_falls_from_a_higher_one(
    way: Way,
) -> None:
    assert is_quiet_step(way, 0.1, -0.5, 0.1, (0.0, 0.0))
    assert not is_quiet_step(way, 0.1, -0.5, 0.099, (0.0, 0.0))


@every
@pytest.mark.parametrize(("rise", "strong"), [(0.03, 0.3), (0.05, 0.3), (0.08, 0.3), (-0.01, -0.3)])
def test_two_turns_within_a_sample_are_an_event_where_the_top_is_new(way: Way, rise: float, strong: float) -> None:
    """The motion turns around within the sample: the rotation bulges and dips, or the other way round."""
    u, v, row = 0.1, rise * P * P * H, (strong, -3.0 * strong / H)
    assert np.sum(np.diff(np.sign(np.diff(path(way, u, v, row)))) != 0) == 2
    assert not is_quiet_step(way, u, v, u, row)
    assert is_quiet_step(way, u, v, u + 1.0, row)


@every
@pytest.mark.parametrize("below", [1e-3, 1e-9])
def test_a_fall_is_an_event(way: Way, below: float) -> None:
    """At the step's end, or between its ends."""
    for v, row in ((1.0, (0.0, 0.0)), (0.45 * P * P * H, (0.8, 0.0))):
        top = np.max(path(way, 0.1, v, row))
        assert not is_quiet_step(way, 0.1, v, 1.0, row, fallen=0.1 + (top - 0.1) * (1.0 - below))
        assert is_quiet_step(way, 0.1, v, 1.0, row, fallen=top + 0.2 * P * P * H * H)


@pytest.mark.parametrize("strength", [3.0, 30.0, 300.0, 3e3])
def test_a_nonlinear_series_whose_last_terms_still_count_is_an_event(strength: float) -> None:
    """Under ever more violent motions a quiet step is still exact, and in the end there is none."""
    u, v, row = 1.0, 1e-3, (-strength, 0.0)
    blocks, states = one(u, v, 9.0, nonlinear=True)
    scratch = create_scratch()
    order, reach, _ = expand_arc(
        in_units_of_g([0.0, 9.0], [row]), blocks[0], rules_for(nonlinear=True), scratch, states[0], H
    )
    assert reach == H
    expected = evaluate_series(scratch["rotation"], order, H)
    found = stepped(blocks, states, row, H, Way(True, 1), fallen=math.inf)[0]
    if found.quiet:
        assert found.end["u"] == pytest.approx(expected[0], rel=4.0 * ULP)
        assert found.end["v"] == pytest.approx(expected[1], rel=8.0 * ULP)
    assert found.quiet == (strength < 1000.0)


@every
@pytest.mark.parametrize("what", ["u", "v", "start", "slope"])
def test_not_a_number_is_an_event(way: Way, what: str) -> None:
    values = {"u": 0.1, "v": -0.5, "start": 0.0, "slope": 0.0, "peak": 0.1}
    values[what] = math.nan
    row = (values["start"], values["slope"])
    found = stepped(*one(values["u"], values["v"], values["peak"], nonlinear=way.nonlinear), row, H, way)
    assert not found[0].quiet


@every
def test_a_lane_does_the_same_whatever_its_company(way: Way) -> None:
    random, h, row = np.random.default_rng(4), 0.01, (0.05, 1.0)
    blocks, states = drawn(random, way.nonlinear, h)
    whole = stepped(blocks.copy(), states.copy(), row, h, way)
    for k in (0, 7, LANE_COUNT - 1):
        alone = stepped(blocks[k : k + 1].copy(), states[k : k + 1].copy(), row, h, way)[0]
        assert alone.quiet == whole[k].quiet
        assert (alone.end["u"], alone.end["v"]) == (whole[k].end["u"], whole[k].end["v"])


@every
def test_a_lane_without_a_block_never_has_an_event(way: Way) -> None:
    for row in ((0.0, 0.0), (100.0, -1e6)):
        stepped(*one(0.1, 0.0, 1.0, nonlinear=way.nonlinear), row, H, way)  # checks it
