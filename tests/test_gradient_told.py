"""Derivatives of rotations, velocities and times by motion and start, against 30 digits, differences and variations."""

import itertools
from typing import Any

import numpy as np
import pytest
from oracles import standing
from oracles.cases import GRAVITY
from oracles.multiprecision import Course, follow
from oracles.problem import Problem
from test_gradient import ALPHA, BLOCK, MODELS, RESTITUTION, P, samples_of, slope

import rocking
from rocking import Block, Motion, RestrainedBlock, Tendon, VelocityThreshold, dynamics, gradient
from rocking.errors import OptionError

RECORD = Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)


def judged_by_digits(seed: int, model: str, pieces: list[int], most: int) -> dict[str, int]:
    """Judge what a response tells by differences in 30 digits; returns how many of each quantity were judged."""
    drawn = Motion.from_samples(samples_of(seed), 0.06)
    coefficients = np.round(drawn.coefficients * 2.0**20) / 2.0**20  # what is added below is then not rounded
    response = rocking.simulate(BLOCK, Motion(drawn.breakpoints, coefficients), model=model)
    times = response.impacts["time"]
    k = int(np.argmax(np.diff(times)))
    at = float(np.float32(times[k] + 0.3 * (times[k + 1] - times[k])))
    judged = {"peak": 0, "rotation": 0, "velocity": 0, "impact": 0, "uplift": 0, "rest": 0}
    h = 2.0**-36
    for piece, power in itertools.product(pieces, range(2)):

        def course(h: float, piece: int = piece, power: int = power) -> Course:
            changed = coefficients.copy()
            changed[piece, power] += h
            problem = Problem(model, P, ALPHA, RESTITUTION, drawn.breakpoints, changed)
            return follow(problem, closest=1e-2, digits=30, at=(at,))

        higher, lower = course(h), course(-h)

        def judge(name: str, of: Any, where: Any, high: Any, low: Any, piece: int = piece, power: int = power) -> None:
            found = gradient(response, of, where).coefficients[:, power]
            error = found[piece] - float((high - low) / (2.0 * h))
            assert abs(error) <= 1e-8 * max(1e-3, np.max(np.abs(found))), (seed, model, name, where, piece, power)
            judged[name] += 1

        if not gradient(response).reason and response.peak_time >= drawn.breakpoints[piece]:
            judge("peak", "peak", None, higher.peak, lower.peak)
        judge("rotation", "rotation", at, higher.states[at][0], lower.states[at][0])
        judge("velocity", "velocity", at, higher.states[at][1], lower.states[at][1])
        for k in range(min(most, len(times))):
            judge("impact", "impact", k, higher.impacts[k][0], lower.impacts[k][0])
        for k, kind in enumerate(response.events["kind"][:most]):
            judge(kind, "event", k, higher.events[k][0], lower.events[k][0])
    return judged


@MODELS
def test_rotations_velocities_and_times_change_with_the_motion_as_thirty_digits_say(model: str) -> None:
    judged = judged_by_digits(2, model, [4], 4)
    assert min(judged.values()) >= 2


@pytest.mark.slow
@MODELS
def test_many_rotations_velocities_and_times_change_as_thirty_digits_say(model: str) -> None:
    judged = [judged_by_digits(seed, model, [2, 5, 9], 20) for seed in range(5)]
    assert sum(sum(each.values()) for each in judged) >= 250
    assert sum(each["rest"] for each in judged) >= 15 and sum(each["peak"] for each in judged) >= 10


def tables_of(response: rocking.Response, most: int) -> list[tuple[Any, int | None, Any]]:
    """What a sensitivity tells of a response: quantity, place, row of changes."""
    found = response.sensitivity
    asked: list[tuple[Any, int | None, Any]] = [("peak", None, found.peak[0])]
    asked += [("event", k, found.events[k]) for k in range(min(most, len(response.events)))]
    return asked + [("impact", k, found.impacts[k]) for k in range(min(most, len(response.impacts)))]


def judged_backwards(response: rocking.Response, start: tuple[str, float], judged: dict[str, int]) -> None:
    """Judge all that a sensitivity tells, of which rests are to first order in a larger speed."""
    motion = response.motion
    assert motion is not None
    for of, k, row in tables_of(response, 6):
        found = gradient(response, of, k)
        if found.reason:
            continue
        terms = [found.coefficients * motion.coefficients]
        if motion.vertical is not None:
            terms.append(found.vertical * motion.vertical.coefficients)
        together, size = (sum(np.sum(each(term)) for term in terms) for each in (np.asarray, np.abs))
        kind = str(response.events["kind"][k]) if of == "event" else of
        share = 1e-3 if kind == "rest" else 1e-11
        assert together == pytest.approx(row["motion"], rel=share, abs=share * size), (of, k)
        by_start = {"initial_rotation": found.initial_rotation, "initial_velocity": found.initial_velocity}[start[0]]
        near = 1e-11 if of == "peak" else max(share, 1e-9)
        assert by_start * start[1] == pytest.approx(row[start[0]], rel=near, abs=1e-12), (of, k)
        judged[kind] = judged.get(kind, 0) + 1


def judged_restrained(seeds: range) -> dict[str, int]:
    judged: dict[str, int] = {}
    for seed in seeds:
        body, motion, start = standing.drawn(seed)
        for model in ("linear", "nonlinear"):
            response = rocking.simulate(body, motion, model=model, initial_rotation=start, duration=motion.end)
            judged_backwards(response, ("initial_rotation", start), judged)
    return judged


def test_times_of_restrained_bodies_answer_backwards_as_forwards() -> None:
    judged = judged_restrained(range(8))
    assert min(judged.get(kind, 0) for kind in ("peak", "impact", "uplift", "rest")) >= 3


@pytest.mark.slow
def test_times_of_many_restrained_bodies_answer_backwards_as_forwards() -> None:
    judged = judged_restrained(range(8, 140))
    assert min(judged.get(kind, 0) for kind in ("peak", "impact", "uplift", "rest")) >= 40
    assert judged["overturn"] >= 6


def between_stops(seed: int) -> tuple[Any, Motion, float]:
    """Return a body with two stops, or one, what shakes it, and where it starts."""
    rng = np.random.default_rng(seed)
    gap, e = rng.uniform(0.02, 0.1), rng.uniform(0.3, 0.9)
    oscillator = {"restitution": e, "frequency": rng.uniform(0.5, 2.0), "damping_ratio": rng.uniform(0.0, 0.1)}
    body: Any = (
        dynamics.InvertedPendulum(p=rng.uniform(1.0, 4.0), gap=gap, restitution=e),
        dynamics.ImpactOscillator(**oscillator, stop=0.0, second_stop=gap),
        dynamics.ImpactOscillator(**oscillator, stop=0.0),
        dynamics.BouncingBall(0.0 if seed % 8 == 3 else e),
    )[seed % 4]
    motion = rocking.pulses.sine(
        rng.uniform(0.5, 3.0) * (8.0 if seed % 4 == 3 else 1.0), rng.uniform(0.5, 2.0), cycles=2
    )
    return body, motion, body.stops[0] + rng.uniform(0.1, 0.9) * gap


def judged_between_stops(seeds: range) -> dict[str, int]:
    judged: dict[str, int] = {}
    for seed in seeds:
        body, motion, start = between_stops(seed)
        response = dynamics.simulate(body, motion, initial_position=start, initial_velocity=0.1, duration=motion.end)
        judged_backwards(response, ("initial_velocity", 0.1), judged)
    return judged


def test_bodies_between_two_stops_answer_backwards_as_forwards() -> None:
    judged = judged_between_stops(range(8))
    assert judged["peak"] >= 3
    assert judged["impact"] >= 20
    assert judged["rest"] >= 1


@pytest.mark.slow
def test_many_bodies_between_two_stops_answer_backwards_as_forwards() -> None:
    judged = judged_between_stops(range(8, 80))
    assert judged["impact"] >= 200
    assert judged["rest"] >= 10


def test_where_the_second_stop_is_reached_the_peak_has_no_derivative_and_a_word_says_so() -> None:
    pendulum = dynamics.InvertedPendulum(p=3.0, gap=0.1, restitution=0.6)
    found = gradient(dynamics.simulate(pendulum, rocking.pulses.sine(5.0, 1.0, cycles=2)))
    assert "second stop" in found.reason
    assert np.all(np.isnan(found.coefficients))


def test_a_ball_that_does_not_bounce_comes_to_rest_where_it_lands() -> None:
    """From x at rest, onto a still table: sqrt(2 x/g), for `gradient` and for `Response.sensitivity`."""
    fall = dynamics.simulate(dynamics.BouncingBall(0.0), Motion.from_samples([0.0, 0.0], 1.0), initial_position=0.2)
    expected = 0.5 * fall.events["time"][0] / 0.2
    for of in ("event", "impact"):
        found = gradient(fall, of, 0)
        assert found.value == pytest.approx(np.sqrt(0.4 / GRAVITY), rel=1e-12)
        assert found.initial_rotation == pytest.approx(expected, rel=1e-12)
    assert fall.sensitivity.impacts["initial_rotation"][0] == pytest.approx(0.2 * expected, rel=1e-12)
    assert fall.sensitivity.events["initial_rotation"][0] == pytest.approx(0.2 * expected, rel=1e-12)


def test_a_tendon_that_yields_at_the_start_is_longer_with_a_larger_start() -> None:
    column = Block(width=0.5, height=3.0, mass=4000.0)
    tied = RestrainedBlock(column, Tendon(3e6, prestress=1e3, strength=2e4), restitution=0.8)
    judged = 0
    for model in ("linear", "nonlinear"):

        def response(h: float, model: Any = model) -> rocking.Response:
            return rocking.simulate(tied, RECORD * 0.3, model=model, initial_rotation=0.04 + h)

        middle = response(0.0)
        assert middle.tendons["plastic_elongation"][0] > 1e-3
        for k in range(3):
            expected = slope(lambda h, k=k: response(h).impacts["time"][k], 1e-4)
            assert gradient(middle, "impact", k).initial_rotation == pytest.approx(expected, rel=1e-8)
            forwards = middle.sensitivity.impacts["initial_rotation"][k]
            assert 0.04 * expected == pytest.approx(forwards, rel=1e-8)
            judged += 1
    assert judged == 6


def test_rotation_and_velocity_after_a_closed_sequence_and_at_an_impact_are_those_of_the_course() -> None:
    """By differences, within the impacts that follow a proof; at an impact just after it, so to one side."""
    free = rocking.simulate(BLOCK, None, initial_rotation=0.05)
    closing, rest = free.impacts["time"][-1], free.events["time"][-1]
    assert rest - closing > 1e-6
    for at, step in ((0.5, 1e-5), (closing + 0.1 * (rest - closing), 1e-9)):
        for of, k in (("rotation", 0), ("velocity", 1)):

            def told(h: float, at: float = at, k: int = k) -> float:
                return float(rocking.simulate(BLOCK, None, initial_rotation=0.05 + h).states(at)[k])

            assert gradient(free, of, at).initial_rotation == pytest.approx(slope(told, step), rel=1e-5), (at, of)
    time = float(free.impacts["time"][0])
    after = gradient(free, "rotation", time).initial_rotation
    just_after = gradient(free, "rotation", time + 1e-9).initial_rotation
    just_before = gradient(free, "rotation", time - 1e-9).initial_rotation
    assert after == pytest.approx(just_after, rel=1e-6)
    entered = free.impacts["side"][0]
    e = RESTITUTION[0 if entered < 0 else 1]
    assert after == pytest.approx(e * just_before, rel=1e-6)
    moved = gradient(free, "rotation", 0.0)
    assert (moved.value, moved.initial_rotation, moved.initial_velocity) == (0.05, 1.0, 0.0)


def judged_after_proofs(body: Any, motion: Motion, start: float) -> int:
    """Judge the course behind proofs by one without any; returns how many sequences were judged."""
    proven, followed = (
        rocking.simulate(body, motion, initial_rotation=start, chattering=how)
        for how in ("certified", VelocityThreshold(1e-8))
    )
    judged = 0
    for end in proven.sequences["end"]:
        closing = proven.impacts["time"][proven.impacts["time"] < end].max()
        times = closing + np.linspace(0.05, 0.6, 12) * (end - closing)
        expected = followed.rotation(times)
        assert proven.rotation(times) == pytest.approx(expected, rel=1e-4, abs=1e-4 * np.max(np.abs(expected)))
        judged += bool(np.any(expected != 0.0))
    return judged


def test_behind_a_proof_tendons_are_as_long_as_before_it() -> None:
    judged = 0
    for seed in range(7, 67, 10):  # tendons that yield
        judged += judged_after_proofs(*standing.drawn(seed))
    assert judged >= 4


@pytest.mark.parametrize("way", ["drawn", "interval=1e-14", "velocity=1e-15"])
def test_impacts_at_any_speed_change_as_those_of_a_proof_do(way: str) -> None:
    """Of lengths of arcs that are all rounding no error stays in what shifts: over 100 impacts follow each other."""
    proven = rocking.simulate(BLOCK, RECORD)
    body = RestrainedBlock(BLOCK, restitution=rocking.Restitution(RESTITUTION, RESTITUTION, seed=1))
    slow = rocking.simulate(body, RECORD) if way == "drawn" else rocking.simulate(BLOCK, RECORD, chattering=way)
    assert len(slow.impacts) > 100 > len(proven.impacts)
    expected = gradient(proven, "event", 1).samples
    for of, at in (("event", 1), ("impact", -1)):
        assert gradient(slow, of, at).samples == pytest.approx(expected, rel=1e-8)
    shifts = slow.sensitivity.events["motion"][1], slow.sensitivity.impacts["motion"][-1]
    assert shifts == pytest.approx((proven.sensitivity.events["motion"][1],) * 2, rel=1e-8)


def test_at_rest_nothing_changes() -> None:
    response = rocking.simulate(BLOCK, RECORD)
    for of, at in (("rotation", 0.01), ("velocity", response.events["time"][-1] + 0.01), ("rotation", 0.0)):
        found = gradient(response, of, min(at, response.duration))
        assert found.value == 0.0
        assert not np.any(found.coefficients)
        assert found.reason == ""


def test_an_uplift_shifts_with_the_motion_about_it_alone() -> None:
    """Where a(t) = -g tan(alpha), by a sample: by the share that it has there, over the rate of the motion."""
    response = rocking.simulate(BLOCK, RECORD)
    time, side = response.events["time"][0], response.events["side"][0]
    rate = np.diff(RECORD.acceleration([0.29, 0.3]))[0] / 0.01 if time < 0.3 else 0.0
    assert rate > 0.0
    assert side == -1
    found = gradient(response, "event", 0)
    assert found.samples == pytest.approx([-(1.0 - time / 0.3) / rate, -(time / 0.3) / rate, 0.0, 0.0, 0.0], rel=1e-12)
    step = rocking.simulate(BLOCK, Motion([0.0, 0.5, 1.0], [[0.0], [3.0]]))
    assert not np.any(gradient(step, "event", 0).coefficients)


def test_a_motion_that_only_touches_the_threshold_leaves_no_derivative_of_the_uplift() -> None:
    threshold = BLOCK.uplift_thresholds()[1]
    rising = Motion([0.0, 0.5, 1.0], [[0.0, 0.0, 0.0], [threshold, 0.0, 4.0]])
    found = gradient(rocking.simulate(BLOCK, rising), "event", 0)
    assert found.value == pytest.approx(0.5, abs=1e-6)
    assert "threshold" in found.reason
    assert np.all(np.isnan(found.coefficients))


def test_a_touch_after_what_is_asked_for_takes_no_derivative() -> None:
    """With a weight of -1 a block swings about alpha as a pendulum, and back to zero, where rounding decides."""
    lift = Motion.from_samples(np.full(3, -2.0 * GRAVITY), 2.0)
    push = Motion.from_points([0.0, 2.2, 2.5, 2.6, 4.0], [0.0, 0.0, -2.0, 0.0, 0.0]).with_vertical(lift)
    block = Block.from_parameters(p=3.0, alpha=0.2, restitution=0.5)
    swing = rocking.simulate(block, push, duration=2.3)
    assert swing.rounding_decisions > 0
    assert swing.peak_time < 1.1
    found = gradient(swing)
    assert "without speed" not in found.reason
    assert np.all(np.isfinite(found.coefficients))
    assert np.all(np.isfinite(gradient(swing, "rotation", 2.0).coefficients))
    late = gradient(swing, "rotation", 2.25)
    assert "without speed" in late.reason
    assert np.all(np.isnan(late.coefficients))


def test_where_a_block_leaves_as_it_comes_to_rest_there_is_no_derivative() -> None:
    rng = np.random.default_rng(1)
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.7)
    for _ in range(6):
        samples = 2.5 * np.convolve(rng.normal(size=22), np.ones(3), mode="valid")
    motion = Motion.from_samples(samples, 0.1)
    response = rocking.simulate(block, motion, chattering=VelocityThreshold(0.3), duration=motion.end)
    at_once = np.flatnonzero(np.diff(response.events["time"]) == 0.0)
    assert len(at_once) == 1
    for of, at in (("peak", None), ("event", int(at_once[0]) + 1)):
        found = gradient(response, of, at)
        assert "at which it comes to rest" in found.reason, of
        assert np.all(np.isnan(found.coefficients)), of
    assert np.all(np.isfinite(gradient(response, "event", int(at_once[0])).coefficients))


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_of_an_unfinished_simulation_no_derivative_is_known(few_steps: Any, model: Any, side: float) -> None:
    with few_steps(20):
        response = rocking.simulate(BLOCK, None, model=model, initial_rotation=0.05 * side)
    assert response.unfinished
    assert len(response.impacts) > 1
    asked: list[tuple[Any, float | None]] = [("peak", None), ("rotation", 0.5), ("velocity", 0.5), ("impact", -1)]
    for of, at in asked:
        found = gradient(response, of, at)
        assert "not finished" in found.reason, of
        assert np.isnan([found.initial_rotation, found.initial_velocity]).all(), of
        assert np.isnan(found.coefficients).all(), of
    changes = response.sensitivity
    for table in (changes.peak, changes.impacts):
        assert len(table)
        assert all(np.isnan(table[name]).all() for name in table.dtype.names or ())
    assert all(np.isnan(values).all() for values in changes.rotation([0.0, 0.5]).values())
    assert "UNFINISHED" in response.summary()
    assert "nan" not in response.summary()


def test_the_time_of_overturning_has_derivatives_though_the_peak_has_none() -> None:
    def fallen(h: float) -> rocking.Response:
        return rocking.simulate(BLOCK, Motion.from_samples([0.0, 5.0 + h, 5.0, 0.0], 0.5))

    found = gradient(fallen(0.0), "event", -1)
    expected = slope(lambda h: fallen(h).overturn_time, 1e-2)
    assert found.samples[1] == pytest.approx(expected, rel=1e-8)
    assert found.value == fallen(0.0).overturn_time


@pytest.mark.parametrize(
    ("of", "at", "match"),
    [
        ("height", None, "of must be one of"),
        ("peak", 1.0, 'does not apply to a "peak"'),
        ("rotation", None, "requires at, the time"),
        ("impact", 10_000, "at must be a whole number"),
        ("event", 0.5, "at must be a whole number"),
    ],
)
def test_what_is_not_told_is_refused_in_a_sentence(of: Any, at: Any, match: str) -> None:
    with pytest.raises(OptionError, match=match):
        gradient(rocking.simulate(BLOCK, RECORD), of, at)
    with pytest.raises(OptionError, match="has no impact"):
        gradient(rocking.simulate(BLOCK, RECORD * 0.01), "impact", 0)
