"""Vertical ground motion: the weight changes with 1 + a_v/g, in both models and in all that follows from them."""

import dataclasses
import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from oracles.cases import wave

import rocking
from rocking import Motion
from rocking.errors import MotionError, OptionError
from rocking.inputs.notes import list_vertical_notes
from rocking.motion.description import Origin
from rocking.motion.motion import compute_uplift_factors, find_exceedances
from rocking.records.formats.source import Request
from rocking.records.named import load_motion

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

G = 9.80665
MODELS = ("linear", "nonlinear")


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
    response = rocking.simulate(rocking.Block(half_width=0.2, half_height=1.0), motion)
    assert response.lift_off_time == pytest.approx(1.0, abs=1e-9)


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
    with pytest.raises(MotionError, match=said):
        wave(1.0, 3).with_vertical(vertical)


TWO = Path(__file__).parent / "data" / "formats" / "two.v1"


def test_the_command_takes_a_vertical_component_from_a_record_or_a_channel(run) -> None:
    block, size = rocking.Block(width=0.5, height=2.0), ["--width", "0.5", "--height", "2.0", "--pga", "0.4g", "--json"]
    up = "el-centro-meloland-up"
    printed = json.loads(run("simulate", "el-centro-meloland-270", *size, "--vertical", up)[1])
    both = rocking.records.load("el-centro-meloland-270").with_vertical(rocking.records.load(up)).scaled_to(0.4 * G)
    response, alone = rocking.simulate(block, both), rocking.simulate(block, both.with_vertical(None))
    assert printed["motion"]["vertical"]["pga_m_s2"] == pytest.approx(both.vertical.pga)
    assert printed["overturn_time_s"] == pytest.approx(response.overturn_time)
    assert response.overturn_time != alone.overturn_time
    channels = [rocking.read(TWO, channel=channel) for channel in ("1", "2")]
    printed = json.loads(run("simulate", TWO, *size, "--channel", "1", "--vertical", "2")[1])
    assert printed["motion"]["vertical"]["pga_m_s2"] == pytest.approx(0.4 * G / channels[0].pga * channels[1].pga)


@pytest.mark.parametrize("name", ["7", "no-such-record"])
def test_a_vertical_component_that_is_not_there_is_refused(run, tmp_path: Path, name: str) -> None:
    size = ["--width", "0.5", "--height", "2.0"]
    code, _, err = run("simulate", TWO, *size, "--channel", "1", "--vertical", name)
    assert (code, err.count("\n")) == (2, 1)
    assert f"there is no channel, file or shipped record {name!r}; give one of 1 '90 Deg', 2 'Up'" in err
    alone = tmp_path / "single1.csv"
    alone.write_text("".join(f"{0.01 * k},{0.1 * (-1) ** k}\n" for k in range(300)))
    code, _, err = run("simulate", alone, *size, "--units", "g", "--vertical", name)
    assert (code, err.count("\n")) == (2, 1)
    assert f"record {name!r}; give one of 1 'single1'" in err
    code, _, err = run("simulate", "el-centro-meloland-270", *size, "--vertical", name)
    assert (code, err.count("\n")) == (2, 1)
    assert f"there is no file or shipped record {name!r} for the vertical motion" in err and "has no channels" in err


@pytest.mark.parametrize("seed", range(4))
def test_stretches_beyond_the_threshold_are_those_of_the_weighted_threshold(seed: int) -> None:
    motion = wave(3.0, seed).with_vertical(wave(3.0, seed + 50, dt=0.03, count=150))
    plus, minus = 1.8, 2.2
    found = find_exceedances(motion, (plus, minus), G)
    times = np.linspace(0.0, 4.5, 90_001)[1:-1]
    weight = 1.0 + motion.vertical.acceleration(times) / G
    push = motion.acceleration(times)
    beyond = (push > minus * weight) | (push < -plus * weight)
    inside = np.any([(times > start) & (times < end) for start, end in found], axis=0)
    near = np.min(np.abs(times[:, None] - found.ravel()), axis=1) < 1e-9
    assert len(found) > 3
    assert np.array_equal(inside[~near], beyond[~near])


@pytest.fixture
def two_files(tmp_path: Path) -> dict[str, Path]:
    """Records of 0.3 and 0.1 m/s^2 that say their units or step, or do not."""
    files = {name: tmp_path / name for name in ("says.csv", "silent.csv", "plain.txt")}
    wave = np.sin(np.arange(60.0))
    rows = [(0.02 * k, 100 * 0.3 * a, 100 * 0.1 * b) for k, (a, b) in enumerate(zip(wave, wave**2, strict=True))]
    written = [f"{t:.2f},{a:.6f},{b:.6f}" for t, a, b in rows]
    files["says.csv"].write_text("\n".join(["time (s),ns (cm/s2),up (cm/s2)", *written]))
    files["silent.csv"].write_text("\n".join(["time (s),ns,up", *(f"{t},{a / 981},{b / 981}" for t, a, b in rows)]))
    files["plain.txt"].write_text("\n".join(f"{b / 100:.6f}" for _, _, b in rows))
    return files


def test_what_is_said_of_files_is_for_the_one_of_two_that_does_not_say_its_own(two_files: dict[str, Path]) -> None:
    says, plain = str(two_files["says.csv"]), str(two_files["plain.txt"])
    found = load_motion(says, Request.create(0.02, "m/s2", channel="ns"), plain)
    alone = rocking.read(says, channel="ns")
    assert found.pga == alone.pga == pytest.approx(0.3, rel=1e-2)
    assert found.vertical is not None
    assert found.vertical.pga == pytest.approx(0.1, rel=1e-2)
    shipped = load_motion("el-centro-meloland-270", Request.create(0.02, "m/s2"), plain)
    assert shipped.vertical is not None
    assert shipped.vertical.pga == found.vertical.pga


def test_a_file_of_several_that_says_its_units_keeps_them_for_both_channels(two_files: dict[str, Path]) -> None:
    for name in ("says.csv", "silent.csv"):
        found = load_motion(str(two_files[name]), Request.create(units="g", channel="ns", are_defaults=True), "up")
        assert found.vertical is not None
        assert (found.pga, found.vertical.pga) == pytest.approx((0.3, 0.1), rel=1e-2)
    # Of one file alone a heading is overruled, and for both channels alike.
    alone = load_motion(str(two_files["says.csv"]), Request.create(units="g", channel="ns"), "up")
    assert alone.vertical is not None
    assert alone.pga / alone.vertical.pga == pytest.approx(3.0, rel=2e-2)
    assert alone.pga == pytest.approx(30.0 * G, rel=1e-2)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("model", MODELS)
def test_levels_begin_where_a_motion_with_its_vertical_component_lifts_a_block(model: str) -> None:
    block = block_for(2.0, 0.2, 0.5)
    alone = wave(2.0, 5)
    motion = alone.with_vertical(wave(5.0, 6))
    found = rocking.incremental_dynamic_analysis(block, motion, model=model, rtol=0.2)
    lifting = found.data.lowest_uplift / motion.pga
    for excess, uplifts in ((1.0 - 1e-9, 0), (1.0 + 1e-9, 1)):
        response = rocking.simulate(block, motion.scaled(lifting * excess), model=model)
        assert min(len(response.events), 1) == uplifts
    assert found.data.lowest_uplift < min(block.uplift_thresholds(model))
    assert found.data.level.values[0] == found.data.lowest_uplift
    horizontal = rocking.incremental_dynamic_analysis(block, alone, model=model, rtol=0.2)
    assert horizontal.data.lowest_uplift == pytest.approx(min(block.uplift_thresholds(model)))


def test_levels_of_a_block_with_two_sides_begin_at_the_side_that_the_motion_lifts() -> None:
    block = rocking.Block.from_parameters(p=2.0, alpha=(0.1, 0.2), restitution=0.5)
    push = Motion.from_samples([0.0, 1.0, 0.0], 0.2)  # to side -, whose slenderness is 0.2
    found = rocking.incremental_dynamic_analysis(block, push, rtol=1e-2)
    assert found.data.lowest_uplift == pytest.approx(G * math.tan(0.2))
    pair = [block.uplift_thresholds("nonlinear")]
    curved = rocking.pulses.one_sine(1.0, 1.0)
    assert compute_uplift_factors(curved, pair) == pytest.approx([G * math.tan(0.1)], rel=1e-12)


def test_a_motion_that_lifts_no_block_at_any_level_is_told() -> None:
    push = Motion.from_samples([0.0, 1.0, 0.0], 0.2)
    heavy = push.with_vertical(Motion.from_samples([0.0, 9.0, 0.0], 0.2))
    with pytest.raises(OptionError, match="no motion lifts a block at any level"):
        rocking.incremental_dynamic_analysis(block_for(2.0, 0.2, 0.5), heavy)


def test_the_asymptotic_time_is_for_horizontal_motions() -> None:
    motion = rocking.pulses.sine(2.2, 1.0, cycles=3).with_vertical(wave(1.0, 1))
    with pytest.raises(OptionError, match="without a vertical component"):
        rocking.simulate(block_for(2.0, 0.2), motion, chattering="time")


@pytest.mark.parametrize("seconds", [1.0, 2.5])
def test_a_duration_within_the_vertical_component_leaves_the_verdict_open(seconds: float) -> None:
    motion = Motion.from_samples(np.zeros(11), 0.1).with_vertical(Motion.from_samples(np.zeros(31), 0.1))
    block = block_for(2.0, 0.2)
    response = rocking.simulate(block, motion, duration=seconds)
    assert response.ended_early
    assert "has not moved by" in response.summary()
    assert bool(rocking.simulate_many(rocking.Blocks.from_bodies([block]), motion, duration=seconds).ended_early.item())
    over = rocking.simulate(block, motion, duration=3.0)
    assert not over.ended_early
    assert not bool(rocking.simulate_many(rocking.Blocks.from_bodies([block]), motion, duration=3.0).ended_early.item())


@pytest.mark.parametrize("push", [1e-15, -1e-15])
def test_the_least_push_chooses_the_side_of_an_uplift_without_weight(push: float) -> None:
    lift = Motion.from_points([0.0, 0.1, 0.4, 0.8], [0.0, -2.0 * G, -2.0 * G, 0.0])
    motion = Motion.from_samples([push * G, push * G], 1.0).with_vertical(lift)
    block = rocking.Block.from_parameters(p=(1.7, 2.1), alpha=(0.13, 0.31), restitution=0.8)
    assert rocking.simulate(block, motion).events["side"][0] == -np.sign(push)


@pytest.mark.parametrize("model", MODELS)
def test_a_push_that_only_rounding_makes_is_no_push_and_calls_the_side_ambiguous(model: str) -> None:
    """A half sine starts at 5e-16 of its peak in place of zero: in exact arithmetic that chooses the other side."""
    lift = Motion.from_points([0.0, 0.4, 0.8], [-1.8 * G, -1.2 * G, 0.0])
    block = rocking.Block.from_parameters(p=(1.7, 2.1), alpha=(0.13, 0.31), restitution=0.8)
    rounded = rocking.pulses.half_sine(-3.0, 0.5)
    assert 0.0 < abs(rounded.acceleration(0.0)) < 1e-14
    exact = Motion.from_points([0.0, 0.25, 0.5], [0.0, rounded.acceleration(0.25), 0.0])
    found, known = (rocking.simulate(block, motion.with_vertical(lift), model=model) for motion in (rounded, exact))
    assert found.events["side"][0] == known.events["side"][0] and found.events["time"][0] == 0.0
    assert (found.rounding_decisions, known.rounding_decisions) == (1, 0)
    assert found.ambiguous


def test_a_touch_without_speed_is_no_impact_and_calls_itself_ambiguous() -> None:
    """Without a push and with a weight of -1 a block swings about alpha as a pendulum, back to zero and zero speed."""
    seconds, block = 12.0, rocking.Block.from_parameters(p=3.0, alpha=0.2, restitution=0.5)
    for count in (2, 7, 50, 1201):
        lift = Motion.from_samples(np.full(count, -2.0 * G), seconds / (count - 1))
        motion = Motion.from_samples(np.zeros(count), seconds / (count - 1)).with_vertical(lift)
        response = rocking.simulate(block, motion, duration=seconds)
        assert len(response.impacts) == 0
        assert response.peak_rotation == pytest.approx(0.4, abs=1e-12)
        assert response.ambiguities == ("touch",)
        together = rocking.simulate_many(rocking.Blocks.from_bodies([block]), motion, duration=seconds)
        assert int(together.impacts.item()) == 0
        assert together.peak_rotation.item() == pytest.approx(0.4, abs=1e-12)


def test_a_block_at_rest_at_the_end_bears_its_weight_again() -> None:
    up = Motion.from_samples(np.full(11, 1.03 * G), 0.1)
    response = rocking.simulate(block_for(2.0, 0.2), Motion.from_samples(np.zeros(11), 0.1).with_vertical(up))
    assert response.minimum_normal_force == 1.0


def forces_before_rest(block: rocking.Block, motion: Motion, rest: float, side: int) -> tuple[float, float]:
    """Both forces over the weight as the impacts accumulate at a rest: at zero rotation and speed, by Newton's law."""
    assert motion.vertical is not None
    push, weight = float(motion.acceleration(rest)) / G, 1.0 + float(motion.vertical.acceleration(rest)) / G
    turn = block.p**2 * (weight * math.sin(block.alpha) + side * push * math.cos(block.alpha))
    along = 0.75 / block.p**2 * turn  # R u''/g of a rectangle, whose p^2 is 3 g/(4 R)
    return push - side * along * math.cos(block.alpha), weight - along * math.sin(block.alpha)


def small_record(seed: int) -> tuple[rocking.Block, Motion]:
    """A block that chatters to rest under short records while the ground still moves, mostly in both directions."""
    random = np.random.default_rng(seed)
    count, strength = int(random.integers(8, 40)), random.uniform(2.2, 4.0)

    def smooth(peak: float) -> Motion:
        samples = np.convolve(random.normal(size=count + 4), np.ones(5), "valid")
        return Motion.from_samples(samples * peak / np.max(np.abs(samples)), 0.05)

    motion = smooth(strength)
    lift = smooth(random.uniform(0.5, 8.0))
    return block_for(3.0, 0.22, float(random.uniform(0.3, 0.93))), motion.with_vertical(lift)


@pytest.mark.parametrize("seed", [57, 86, 176, 220, 263])
def test_extreme_forces_hold_those_of_the_last_impacts_before_a_rest(seed: int) -> None:
    """Also of the impacts that are closed by proof: where forces change until the rest, the last are extreme."""
    block, motion = small_record(seed)
    response, judged = rocking.simulate(block, motion), 0
    for row in response.sequences:
        rest = float(row["end"])
        for side in (1, -1):
            horizontal, vertical = forces_before_rest(block, motion, rest, side)
            assert response.minimum_normal_force <= vertical + 1e-8
            assert response.required_friction >= abs(horizontal) / vertical - 1e-8
            judged += 1
    assert judged >= 2


def el_centro() -> Motion:
    horizontal = rocking.records.load("el-centro-meloland-270")
    return horizontal.with_vertical(rocking.records.load("el-centro-meloland-up"))


def test_the_figure_of_a_response_moves_the_thresholds_with_the_weight_and_shows_the_vertical_motion() -> None:
    """No uplift is drawn where the motion is within the thresholds: the block of the report lifted at 0.175 g."""
    block = rocking.Block(width=0.5, height=2.0)
    response = rocking.simulate(block, el_centro())
    figure = response.plot()
    assert figure.get_suptitle().endswith("under el-centro-meloland-270 with vertical el-centro-meloland-up")
    _, ground, vertical = (axes for axes in figure.axes if axes.get_ylabel())
    assert "vertical" in vertical.get_ylabel()
    lines = [line.get_xydata() for line in ground.lines]
    acceleration = next(line for line in lines if np.ptp(line[:, 0]) and len(line) > 2)
    upper = next(line for line in lines if len(line) > 2 and np.all(line[:, 1] > 0.0))
    uplift = response.events["time"][0]
    pushed, needed = (np.interp(uplift, line[:, 0], line[:, 1]) for line in (acceleration, upper))
    assert pushed == pytest.approx(needed, rel=1e-6)
    assert needed != pytest.approx(block.uplift_thresholds()[1] / G, rel=1e-3)
    trace = next(line.get_xydata() for line in vertical.lines if len(line.get_xydata()) > 2)
    assert trace[:, 1] == pytest.approx(el_centro().vertical.acceleration(trace[:, 0]) / G)
    assert set(el_centro().vertical.breakpoints[400:500]) <= set(el_centro().choose_drawing_times(0.0, 20.0))


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("vertical", "said"),
    [
        ("el-centro-meloland-270", ["the vertical motion is the horizontal one itself"]),
        ("el-centro-meloland-360", ["the channel '360' looks horizontal"]),
        ("ridgecrest-clc-up", ["the vertical motion is of the station 'CI.CLC", "do both start at the same time?"]),
    ],
)
def test_a_vertical_component_that_looks_like_a_mistake_is_computed_with_a_note(
    run, vertical: str, said: list[str]
) -> None:
    statue = ["--width", "0.24", "--height", "1.1"]
    code, _, err = run("simulate", "el-centro-meloland-270", "--vertical", vertical, *statue)
    assert code == 0
    assert "rocking: note: el-centro-meloland-270: " in err and all(each in err for each in said)
    code, _, err = run("simulate", "el-centro-meloland-270", "--vertical", "el-centro-meloland-up", *statue)
    assert (code, err) == (0, "")


def test_components_that_last_very_different_times_are_noted() -> None:
    part = el_centro().vertical.processed(trim=(0.0, 20.0))
    assert list_vertical_notes(el_centro().with_vertical(part)) == (
        "the horizontal motion lasts 56.93 s, the vertical one 20 s: do both start at the same time?",
    )
    late = Motion.from_samples([0.0] * 5600 + [1.0, -1.0] * 40, 0.01)
    assert "the horizontal motion is strong from" in list_vertical_notes(el_centro().with_vertical(late))[0]


def test_a_jump_beyond_one_threshold_lifts_off_though_the_other_is_only_reached() -> None:
    """With a weight of -1 and a push of the threshold to side +, that of side - is just reached, and the other far."""
    lift = Motion.from_samples([-2.0 * G, -2.0 * G], 1.0)
    block, peaks = block_for(2.0, 0.2), []
    for push in (-0.2, -0.2 - 1e-12):
        motion = Motion.from_samples([push * G, (push + 0.05) * G], 1.0).with_vertical(lift)
        response = rocking.simulate(block, motion, model="linear", duration=0.5)
        assert len(response.impacts) == 0
        assert response.rotation(0.2) == pytest.approx(0.031311, abs=1e-6)
        peaks.append(response.peak_rotation)
    assert peaks[0] == pytest.approx(peaks[1], abs=1e-10)


@pytest.mark.parametrize("seed", [86, 263])
def test_extreme_forces_hold_the_impacts_up_to_a_duration_that_ends_before_their_rest(seed: int) -> None:
    block, motion = small_record(seed)
    rest = float(rocking.simulate(block, motion).sequences["end"][0])
    before, after = (rocking.simulate(block, motion, duration=rest + shift) for shift in (-1e-9, 1e-9))
    assert before.moves_at_end and not after.moves_at_end
    assert before.minimum_normal_force == pytest.approx(after.minimum_normal_force, abs=1e-7)
    assert before.required_friction == pytest.approx(after.required_friction, abs=1e-7)


def test_a_grazing_turn_of_a_block_that_has_weight_is_no_touch_in_doubt() -> None:
    """An impact without speed goes over and comes back: the block goes on alike with it and without."""
    motion = Motion([0.0, 1.0], [[-0.3 * G]]).with_vertical(Motion([0.0, 1.0], [[0.001 * G]]))
    for speed in (-0.22345021816950641, -0.2234502181695064):
        response = rocking.simulate(
            block_for(2.0, 0.2, 0.8),
            motion,
            model="linear",
            initial_rotation=0.05,
            initial_velocity=speed,
            duration=0.6,
        )
        assert response.rotation(0.5) == pytest.approx(6.727e-5, abs=1e-8)
        assert response.ambiguities == ()


@pytest.mark.parametrize("channel", ["DWN", "Down", "down (Sta Chn: 3)", "DN"])
def test_a_vertical_record_that_is_positive_downwards_is_turned_round(channel):
    horizontal = rocking.records.load("el-centro-meloland-270")
    up = rocking.records.load("el-centro-meloland-up")
    down = dataclasses.replace(-up, description=dataclasses.replace(up.description, origin=Origin(channel=channel)))
    both = horizontal.with_vertical(down)
    assert np.array_equal(both.vertical.coefficients, up.coefficients)
    assert f"turned upwards, as its channel is called {channel!r}" in both.vertical.history
    assert horizontal.with_vertical(both.vertical).vertical is both.vertical  # not a second time
    assert np.array_equal(horizontal.with_vertical(-down).vertical.coefficients, up.coefficients)
    assert list_vertical_notes(both) == ()
    assert horizontal.with_vertical(up).vertical is up
