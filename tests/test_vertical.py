"""Vertical ground motion: the weight changes with 1 + a_v/g, in both models and in all that follows from them."""

import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rocking
from rocking import InvalidMotion, InvalidOption, Motion
from rocking.block import Blocks
from rocking.explorer.case import read_case, texts_of
from rocking.explorer.shelf import Shelf
from rocking.kernels import state
from rocking.kernels.certificate import arc_bounds, bounds_on_motion, prove_rest, side_bounds
from rocking.motion.exceedance import exceedances
from rocking.problem import ground_of, records_of, rules_of
from rocking.treatment import treatment

G = 9.80665
MODELS = ("linear", "nonlinear")

quick = settings(deadline=None, max_examples=25)


def wave(amplitude: float, seed: int, dt: float = 0.02, count: int = 200) -> Motion:
    """Smooth random motion, linear between even samples."""
    random = np.random.default_rng(seed)
    t = dt * np.arange(count + 1)
    parts = [random.normal() * np.sin(f * t + random.uniform(0.0, 6.0)) for f in random.uniform(2.0, 25.0, 6)]
    return Motion.from_samples(amplitude * np.sum(parts, axis=0) * np.sin(np.pi * t / t[-1]), dt)


def block_for(p: float, alpha: float, e: float = 0.9) -> rocking.Block:
    return rocking.Block.from_parameters(p=p, alpha=alpha, restitution=e)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("lift", [-0.4, 0.0, 0.25, 1.5])
def test_a_constant_vertical_acceleration_is_another_gravity(model: str, lift: float) -> None:
    """W = 1 + w: p becomes p sqrt(W), and a horizontal acceleration counts as a/W."""
    push = wave(3.0 * (1.0 + lift), 1)
    level = Motion([0.0, push.duration], [[lift * G]])
    weight = 1.0 + lift
    given_block, other = block_for(2.0, 0.2), block_for(2.0 * math.sqrt(weight), 0.2)
    duration = push.duration
    one = rocking.simulate(given_block, push.with_vertical(level), model=model, duration=duration)
    two = rocking.simulate(other, push.scaled(1.0 / weight), model=model, duration=duration)
    assert len(one.impacts) == len(two.impacts) > 3
    assert one.impacts["time"] == pytest.approx(two.impacts["time"], rel=1e-11)
    assert one.impacts["speed_before"] == pytest.approx(two.impacts["speed_before"], rel=1e-8)
    assert one.peak_rotation == pytest.approx(two.peak_rotation, rel=1e-10)


def integrated(block: rocking.Block, motion: Motion, model: str, end: float) -> tuple[list[float], float, float]:
    """Times of impacts by DOP853, an event each, restarted at the breakpoints; the rotation at the end and the peak."""
    alpha, p, e = block.sides[0].alpha, block.p, block.restitution

    def rate(t: float, y: np.ndarray, sign: float, left: float, span: float) -> tuple[float, float]:
        at = min(max(t, left), left + span)  # within the piece
        a, w = motion.acceleration(at) / G, 1.0 + motion.vertical.acceleration(at) / G
        if model == "linear":
            return y[1], p * p * (w * (y[0] - sign * alpha) - a)
        return y[1], -p * p * (w * math.sin(sign * alpha - y[0]) + a * math.cos(sign * alpha - y[0]))

    threshold = alpha if model == "linear" else math.tan(alpha)

    def margin(t: float) -> float:
        return threshold * (1.0 + motion.vertical.acceleration(t) / G) - abs(motion.acceleration(t)) / G

    grid = np.linspace(0.0, end, 40001)
    first = int(np.flatnonzero([margin(t) < 0.0 for t in grid])[0])
    t = brentq(margin, grid[first - 1], grid[first], xtol=1e-14)
    sign = -math.copysign(1.0, motion.acceleration(t))
    state = np.array([0.0, 0.0])
    impacts: list[float] = []

    def impact(t: float, y: np.ndarray, sign: float, *_: float) -> float:
        return sign * y[0]

    def summit(t: float, y: np.ndarray, *_: float) -> float:
        return y[1]

    impact.terminal, impact.direction = True, -1.0
    peak = 0.0
    corners = motion.breakpoints
    while t < end - 1e-12:
        k = int(np.searchsorted(corners, t + 1e-12, side="right"))
        stop = min(end, float(corners[k]) if k < len(corners) else end)
        found = solve_ivp(
            rate, (t, stop), state, "DOP853", events=(impact, summit), rtol=1e-12, atol=1e-15,
            args=(sign, t, stop - t),
        )  # fmt: skip
        t, state = float(found.t[-1]), found.y[:, -1]
        peak = max(peak, abs(float(state[0])), *(abs(float(at[0])) for at in found.y_events[1]))
        if found.status == 1:
            impacts.append(t)
            state = np.array([0.0, e * state[1]])
            sign = -sign
    return impacts, float(state[0]), peak


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", [3, 4])
def test_a_response_agrees_with_another_integrator(model: str, seed: int) -> None:
    motion = wave(2.5, seed).with_vertical(wave(2.0, seed + 100))
    block = block_for(2.5, 0.18)
    response = rocking.simulate(block, motion, model=model, duration=2.5)
    impacts, rotation, peak = integrated(block, motion, model, 2.5)
    assert len(response.impacts) == len(impacts) > 0
    assert response.impacts["time"] == pytest.approx(impacts, abs=1e-8)
    assert response.rotation(2.5) == pytest.approx(rotation, abs=1e-9)
    together = rocking.simulate_many(rocking.Blocks.of([block]), motion, model=model, duration=2.5)
    assert int(together.impacts.item()) == len(impacts)
    assert together.peak_rotation.item() == pytest.approx(peak, abs=1e-9)


def problem_of(block: rocking.Block, motion: Motion, model: str) -> tuple[object, ...]:
    """Ground, block and rules as kernels take them."""
    blocks = Blocks.of([block])
    rules = rules_of(blocks, model, treatment("certified"), None, record=True)
    return ground_of(motion, block.gravity), records_of(blocks, model, np.zeros((1, 2)))[0], rules


@st.composite
def weighings(draw: st.DrawFn) -> tuple[rocking.Block, Motion, str, float, float]:
    """Block, motion, model, speed after an impact at time 0, and a window in which the weight changes much."""
    model, e = draw(st.sampled_from(MODELS)), draw(st.floats(0.3, 0.9))
    p, alpha = 10.0 ** draw(st.floats(0.0, 1.0)), draw(st.floats(0.05, 1.0))
    block = block_for(p, alpha, e)
    restoring = p * p * (alpha if model == "linear" else math.sin(alpha))
    v = 10.0 ** draw(st.floats(-3.0, -0.4)) * restoring / p
    window = 3.0 * v / restoring * (1.0 + e) / (1.0 - e * e)
    change, push = draw(st.floats(-0.6, 0.9)), draw(st.floats(-0.3, 0.3)) * math.tan(alpha)
    vertical = Motion([0.0, 2.0 * window], [[0.0, change * G / window]])
    return block, Motion([0.0, 2.0 * window], [[push * G, 0.0]]).with_vertical(vertical), model, v, window


@quick
@given(weighings())
def test_the_time_of_rest_lies_in_the_bracket_from_the_first_impact(
    case: tuple[rocking.Block, Motion, str, float, float],
) -> None:
    block, motion, model, v, _ = case
    ground, body, rules = problem_of(block, motion, model)
    start = state.record(state.STATE, v=v)
    proof = prove_rest(ground, body, rules, state.new_scratch(), start)
    assume(proof.upper >= 0.0)
    how = rocking.Certified(1e-14)
    response = rocking.simulate(block, motion, model=model, initial_velocity=v, chattering=how)
    first = response.chattering[0]
    rounding = 1e-14 + 4e-15 * first["end"]
    assert proof.lower <= first["upper"] + rounding
    assert first["lower"] <= proof.upper + rounding


@quick
@given(weighings())
def test_bounds_on_an_arc_hold_its_duration_and_its_impact(
    case: tuple[rocking.Block, Motion, str, float, float],
) -> None:
    block, motion, model, v, window = case
    ground, body, rules = problem_of(block, motion, model)
    scratch, start = state.new_scratch(), state.record(state.STATE, v=v)
    bounds = side_bounds(body, rules, 0, bounds_on_motion(ground, body, start, window, scratch))
    change, shortest, longest = arc_bounds(v, bounds)
    assume(longest <= window)
    response = rocking.simulate(block, motion, model=model, initial_velocity=v, duration=1.01 * longest)
    impact = response.impacts[0]
    assert shortest * (1.0 - 1e-14) <= impact["time"] <= longest * (1.0 + 1e-14)
    assert abs((impact["speed_before"] / v) ** 2 - 1.0) <= change + 1e-13


def test_a_change_of_weight_alone_changes_the_speed_of_an_arc_as_much_as_is_allowed_for() -> None:
    """With no horizontal motion at all, the bound must come from the vertical one."""
    block = block_for(4.0, 0.3)
    motion = Motion([0.0, 1.0], [[0.0, 0.0]]).with_vertical(Motion([0.0, 1.0], [[0.0, 8.0 * G]]))
    ground, body, rules = problem_of(block, motion, "linear")
    v = 0.1
    start = state.record(state.STATE, v=v)
    bounds = side_bounds(body, rules, 0, bounds_on_motion(ground, body, start, 0.05, state.new_scratch()))
    impact = rocking.simulate(block, motion, model="linear", initial_velocity=v, duration=0.05).impacts[0]
    change, _, longest = arc_bounds(v, bounds)
    assert longest <= 0.05
    assert 0.05 < (impact["speed_before"] / v) ** 2 - 1.0 <= change


@quick
@given(st.integers(0, 10_000), st.floats(0.05, 0.6), st.integers(1, 5))
def test_uplift_is_where_the_push_first_passes_the_threshold_times_the_weight(
    seed: int, alpha: float, degree: int
) -> None:
    random = np.random.default_rng(seed)
    corners = np.cumsum([0.0, *random.uniform(0.1, 1.0, 6)])
    push = Motion(corners, random.normal(size=(6, 2)) * 0.7 * alpha * G)
    lift = Motion(np.cumsum([0.0, *random.uniform(0.2, 1.3, 5)]), random.normal(size=(5, degree)) * 0.3 * G)
    motion = push.with_vertical(lift)
    response = rocking.simulate(block_for(3.0, alpha), motion, model="linear", duration=float(corners[-1]))
    times = np.linspace(0.0, corners[-1], 20_001)[:-1]
    margin = alpha * (1.0 + lift.acceleration(times) / G) - np.abs(push.acceleration(times)) / G
    beyond = np.flatnonzero(margin < 0.0)
    if not len(beyond):
        assert len(response.events) == 0
        return
    uplift = response.events["time"][0]
    assert uplift <= times[beyond[0]] + 1e-12
    before = (times < uplift - 1e-9) & (margin < -1e-9)
    assert not np.any(before)


@pytest.mark.parametrize("model", MODELS)
def test_the_sensitivity_to_the_motion_is_that_of_both_components(model: str) -> None:
    block, motion = block_for(2.5, 0.18), wave(2.5, 3).with_vertical(wave(2.0, 103))
    size = 1e-6
    responses = [
        rocking.simulate(block, motion.scaled(1.0 + change), model=model, duration=2.0) for change in (-size, 0.0, size)
    ]
    assert len({len(one.impacts) for one in responses}) == 1
    expected = (responses[2].impacts["time"] - responses[0].impacts["time"]) / (2.0 * size)
    assert responses[1].sensitivity.impacts["motion"] == pytest.approx(expected, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("what", ["p", "alpha"])
def test_the_sensitivity_to_the_block_holds_under_both_components(model: str, what: str) -> None:
    motion, size = wave(2.5, 3).with_vertical(wave(2.0, 103)), 1e-6

    def response(change: float) -> rocking.Response:
        p, alpha = (2.5 * (1.0 + change), 0.18) if what == "p" else (2.5, 0.18 * (1.0 + change))
        return rocking.simulate(block_for(p, alpha), motion, model=model, duration=2.0)

    low, middle, high = (response(change) for change in (-size, 0.0, size))
    expected = (high.impacts["time"] - low.impacts["time"]) / (2.0 * size)
    assert middle.sensitivity.impacts[what] == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_forces_carry_the_weight_in_the_frame_of_the_ground() -> None:
    """Under a constant w the forces are those under gravity g (1 + w), times 1 + w."""
    lift, push = 0.3, wave(3.0, 1)
    motion = push.with_vertical(Motion([0.0, push.duration], [[lift * G]]))
    one = rocking.Block(half_width=0.2, half_height=1.0, restitution=0.9)
    other = rocking.Block(half_width=0.2, half_height=1.0, restitution=0.9, gravity=G * (1.0 + lift))
    responses = [rocking.simulate(one, motion, duration=3.0), rocking.simulate(other, push, duration=3.0)]
    times = np.linspace(0.0, 2.9, 50)
    heavy, light = (response.normal_force(times) for response in responses)
    assert heavy == pytest.approx((1.0 + lift) * light, abs=1e-7)
    assert responses[0].friction_demand(times) == pytest.approx(responses[1].friction_demand(times), abs=1e-7)
    assert responses[0].required_friction == pytest.approx(responses[1].required_friction, rel=1e-8)


def test_a_block_at_rest_leaves_the_ground_where_its_weight_is_gone() -> None:
    motion = Motion([0.0, 2.0], [[0.0, 0.0]]).with_vertical(Motion([0.0, 2.0], [[0.0, -G]]))
    response = rocking.simulate(rocking.Block(0.2, 1.0), motion)
    assert response.lift_off_time == pytest.approx(1.0, abs=1e-9)


def test_ensembles_agree_with_single_simulations() -> None:
    blocks = rocking.Blocks.grid(p=np.linspace(1.5, 5.0, 6), alpha=np.linspace(0.1, 0.3, 5), restitution=0.9)
    motion = wave(3.0, 7).with_vertical(wave(2.0, 8))
    for polarity, sign in (("+", 1.0), ("-", -1.0)):
        many = rocking.simulate_many(blocks, motion, polarity=polarity)
        each = [rocking.simulate(block, motion.scaled(sign)).peak_rotation for block in blocks]
        assert many.peak_rotation.to_numpy().ravel() == pytest.approx(each, rel=1e-11)


def test_the_vertical_component_goes_with_the_motion() -> None:
    push, lift = wave(3.0, 1), wave(2.0, 2, dt=0.01, count=500)
    motion = push.with_vertical(lift)
    at = np.linspace(0.0, 4.5, 31)
    for changed, factor in (
        (motion.scaled(2.0), 2.0),
        (-motion, 1.0),
        (motion.scaled(-0.5), 0.5),
        (motion + push, 1.0),
    ):
        assert changed.vertical.acceleration(at) == pytest.approx(factor * lift.acceleration(at), abs=1e-12)
    assert motion.delayed(1.0).vertical.acceleration(at) == pytest.approx(lift.delayed(1.0).acceleration(at))
    assert motion.processed(trim=(1.0, 2.0)).vertical.acceleration(0.5) == pytest.approx(lift.acceleration(1.5))
    assert (motion + motion).vertical.pga == pytest.approx(2.0 * lift.pga)
    assert pickle.loads(pickle.dumps(motion)).vertical.pga == lift.pga
    assert motion.pga == push.pga
    assert "vertical: samples" in str(motion)
    assert motion.with_vertical(None).vertical is None


@pytest.mark.parametrize(
    "vertical, said", [([1.0, 2.0], "Motion"), (wave(1.0, 1).with_vertical(wave(1.0, 2)), "of its own")]
)
def test_what_is_no_vertical_component_is_refused(vertical: object, said: str) -> None:
    with pytest.raises(InvalidMotion, match=said):
        wave(1.0, 3).with_vertical(vertical)


TWO = Path(__file__).parent / "data" / "formats" / "two.v1"


def test_the_command_takes_a_vertical_component_from_a_record_or_a_channel(run) -> None:
    block, size = rocking.Block(width=0.5, height=2.0), ["--width", "0.5", "--height", "2.0", "--pga", "0.4g", "--json"]
    up = "el-centro-meloland-up"
    printed = json.loads(run("simulate", "el-centro-meloland-270", *size, "--vertical", up)[1])
    both = rocking.records.load("el-centro-meloland-270").with_vertical(rocking.records.load(up)).scaled(pga=0.4 * G)
    response, alone = rocking.simulate(block, both), rocking.simulate(block, both.with_vertical(None))
    assert printed["motion"]["vertical"]["pga_m_s2"] == pytest.approx(both.vertical.pga)
    assert printed["overturn_time_s"] == pytest.approx(response.overturn_time)
    assert response.overturn_time != alone.overturn_time
    channels = [rocking.read(TWO, channel=channel) for channel in ("1", "2")]
    printed = json.loads(run("simulate", TWO, *size, "--channel", "1", "--vertical", "2")[1])
    assert printed["motion"]["vertical"]["pga_m_s2"] == pytest.approx(0.4 * G / channels[0].pga * channels[1].pga)


@pytest.mark.parametrize("name", ["7", "no-such-record"])
def test_a_vertical_component_that_is_not_there_is_refused(run, name: str) -> None:
    size = ["--width", "0.5", "--height", "2.0"]
    code, _, err = run("simulate", TWO, *size, "--channel", "1", "--vertical", name)
    assert (code, err.count("\n")) == (2, 1)
    assert f"no channel {name!r}" in err
    code, _, err = run("simulate", "el-centro-meloland-270", *size, "--vertical", name)
    assert (code, err.count("\n")) == (2, 1)
    assert "has no channels" in err


def test_a_part_after_the_vertical_component_has_none() -> None:
    motion = wave(3.0, 1).with_vertical(wave(2.0, 2, count=100))
    assert motion.processed(trim=(1.0, 3.0)).vertical.duration == pytest.approx(1.0)
    assert motion.processed(trim=(2.5, 3.0)).vertical is None


@pytest.mark.parametrize("seed", range(4))
def test_stretches_beyond_the_threshold_are_those_of_the_weighted_threshold(seed: int) -> None:
    motion = wave(3.0, seed).with_vertical(wave(3.0, seed + 50, dt=0.03, count=150))
    plus, minus = 1.8, 2.2
    found = exceedances(motion, (plus, minus), G)
    times = np.linspace(0.0, 4.5, 90_001)[1:-1]
    weight = 1.0 + motion.vertical.acceleration(times) / G
    push = motion.acceleration(times)
    beyond = (push > minus * weight) | (push < -plus * weight)
    inside = np.any([(times > start) & (times < end) for start, end in found], axis=0)
    near = np.min(np.abs(times[:, None] - found.ravel()), axis=1) < 1e-9
    assert len(found) > 3
    assert np.array_equal(inside[~near], beyond[~near])


def test_a_page_of_a_response_shows_its_vertical_component_too() -> None:
    """Neither a pulse's nor a shipped record's name says it, and two motions may differ in nothing else."""
    shelf, block = Shelf(), block_for(2.0, 0.2)
    pulse, record = rocking.pulses.one_sine(4.0, 1.0), rocking.records.load("el-centro-meloland-270")
    for horizontal in (pulse, record):
        for vertical in (wave(3.0, 1), wave(3.0, 2)):
            response = rocking.simulate(block, horizontal.with_vertical(vertical))
            shown = read_case(texts_of(response, shelf), shelf).simulate()
            assert shown.peak_rotation == response.peak_rotation
            assert shown.impacts["time"].tolist() == response.impacts["time"].tolist()


def test_the_asymptotic_time_is_for_horizontal_motions() -> None:
    motion = rocking.pulses.sine(2.2, 1.0, cycles=3).with_vertical(wave(1.0, 1))
    with pytest.raises(InvalidOption, match="no vertical motion"):
        rocking.simulate(block_for(2.0, 0.2), motion, chattering="time")


@quick
@given(st.integers(0, 10_000), st.sampled_from(MODELS), st.floats(1.0, 6.0), st.floats(0.08, 0.4), st.floats(0.5, 0.95))
def test_certified_rests_hold_what_all_impacts_give(seed: int, model: str, p: float, alpha: float, e: float) -> None:
    """A rest proven early lies where the impacts, followed on until time stalls, accumulate."""
    motion = wave(6.0 * alpha, seed).with_vertical(wave(3.0, seed + 1))
    block = block_for(p, alpha, e)
    early = rocking.simulate(block, motion, model=model, chattering=rocking.Certified(tolerance=1e-4))
    late = rocking.simulate(block, motion, model=model, chattering=rocking.Certified(tolerance=1e-13))
    if early.overturned:
        return
    for first, second in zip(early.chattering, late.chattering, strict=False):
        if not math.isfinite(first["lower"]):
            break
        if abs(first["lower"] - second["lower"]) > 1e-3:  # another rest, once the first ones differ by rounding
            break
        assert first["lower"] - 1e-12 <= second["upper"]
        assert second["lower"] <= first["upper"] + 1e-12
