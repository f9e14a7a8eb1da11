"""Laws of an ensemble where it could part from single simulations: ends, turns within a sample, scales, batches."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from oracles import referee
from oracles.multiprecision import follow
from oracles.problem import Problem

import rocking
from rocking import Blocks, Motion, simulate, simulate_many
from rocking.engine.problem import ground_of
from rocking.kernels.ground import components
from rocking.simulation import ensemble
from rocking.simulation.ensemble import Scales

GRAVITY = 9.80665
MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])


def steady(times_threshold: float, *, samples: int = 501, dt: float = 0.01) -> Motion:
    """A constant acceleration, over that of uplift of a slenderness of 0.2."""
    return Motion.from_samples(np.full(samples, times_threshold * 0.2 * GRAVITY), dt)


def white_noise(seed: int) -> tuple[Blocks, Motion]:
    """Blocks of p 1 to 5 rad/s under samples that know nothing of each other, 0.02 s apart."""
    rng = np.random.default_rng(seed)
    blocks = Blocks(p=rng.uniform(1, 5, 64), alpha=rng.uniform(0.05, 0.3, 64), restitution=rng.uniform(0.5, 0.95, 64))
    samples = rng.normal(size=150)
    samples *= rng.uniform(1.5, 6.0) * 0.2 * GRAVITY / np.abs(samples).max()
    return blocks, Motion.from_samples(samples, 0.02)


def assert_same(blocks: Blocks, motion: Motion, model: str) -> None:
    """Together as alone, but for pairs whose last digits decide."""
    found = referee.compare(referee.Batch(0, 0, "given", model, blocks, motion, None, "to rest", None, "+")).differences
    assert not found, f"{len(found)} of {len(blocks)} blocks differ\n" + "\n".join(map(str, found[:3]))


# --- the end --------------------------------------------------------------------------------------------------


@MODELS
@pytest.mark.parametrize("duration", [0.5, 0.01, 0.02, 4.99, 5.0, 0.503])
def test_a_block_on_its_way_out_has_its_peak_where_the_simulation_stops(model: str, duration: float) -> None:
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    response = simulate(block, steady(1.2), model=model, duration=duration)
    result = simulate_many(block, steady(1.2), model=model, duration=duration)
    assert_allclose(result.peak_rotation.item(), response.peak_rotation, rtol=1e-12)
    assert_allclose(result.peak_time.item(), response.peak_time, rtol=1e-12)
    if not response.overturned:
        assert response.peak_time == duration


@pytest.mark.parametrize("duration", [0.5, 0.25, 0.503])
def test_the_peak_where_the_simulation_stops_is_that_of_the_closed_form(duration: float) -> None:
    blocks = Blocks(p=[1.0, 2.0, 4.0], alpha=0.2, restitution=0.9)
    result = simulate_many(blocks, steady(1.2), model="linear", duration=duration)
    expected = 0.2 * 0.2 * (np.cosh(blocks.p[:, 0] * duration) - 1.0)
    assert_allclose(result.peak_rotation.values[0], expected, rtol=1e-11)


def waits() -> tuple[rocking.Block, Motion, rocking.Response]:
    """A block that uplifts and comes to rest, and its whole response."""
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.5)
    samples = np.zeros(400)
    samples[5:15] = 2.0 * 0.2 * GRAVITY
    motion = Motion.from_samples(samples, 0.01)
    return block, motion, simulate(block, motion)


def test_a_rest_that_comes_after_the_stop_is_not_counted() -> None:
    block, motion, whole = waits()
    rest = float(whole.events["time"][whole.events["kind"] == "rest"][0])
    stop = 0.5 * (float(whole.impacts["time"][-1]) + rest)
    assert stop < rest
    response = simulate(block, motion, duration=stop)
    result = simulate_many(block, motion, duration=stop)
    assert [str(kind) for kind in response.events["kind"]] == ["uplift"]
    assert result.rests.item() == 0


@MODELS
def test_outcomes_tell_the_time_at_rest_up_to_a_stop_between_samples(model: str) -> None:
    block, motion, _ = waits()
    for stop in (0.03, 0.05, 2.5, 2.507, 3.99, 5.0):
        response = simulate(block, motion, model=model, duration=stop)
        result = simulate_many(block, motion, model=model, duration=stop)
        assert_allclose(result.time_at_rest.item(), response.time_at_rest, rtol=0.0, atol=1e-12)


# --- turns within a sample ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "seed, model",
    [
        (11, "linear"),
        *(pytest.param(seed, "linear", marks=pytest.mark.thorough) for seed in (24, 33, 36, 46)),
        (53, "nonlinear"),
    ],
)
def test_a_rotation_that_turns_twice_within_a_sample_has_its_peak_there(seed: int, model: str) -> None:
    assert_same(*white_noise(seed), model)


@MODELS
def test_a_block_thrown_up_and_down_again_within_a_sample_has_its_peak_there(model: str) -> None:
    """Every sample is an impulse one way and then the other: up, down and up again between two instants."""
    rng = np.random.default_rng(5)
    samples = np.zeros(120)
    samples[4::2] = 12.0 * GRAVITY
    samples[5::2] = -12.0 * GRAVITY
    samples *= rng.uniform(0.9, 1.1, 120)
    blocks = Blocks(p=np.linspace(1.0, 5.0, 64), alpha=0.2, restitution=np.tile([0.5, 0.9], 32))
    assert_same(blocks, Motion.from_samples(samples, 0.02), model)


# --- scales ---------------------------------------------------------------------------------------------------


def rising(dt: float) -> tuple[Blocks, Motion]:
    """Blocks of p = 1 rad/s on the way out from the fifth sample on: a well-conditioned course."""
    samples = 3.0 * 0.2 * GRAVITY * np.clip(np.arange(120) - 2.0, 0.0, 5.0)
    blocks = Blocks(p=1.0, alpha=np.linspace(0.1, 0.3, 9), restitution=0.9)
    return blocks, Motion.from_samples(samples, dt)


@MODELS
@pytest.mark.parametrize("dt", [1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
def test_small_steps_lose_no_digits(model: str, dt: float) -> None:
    blocks, motion = rising(dt)
    duration = 100.5 * dt
    peaks = simulate_many(blocks, motion, model=model, duration=duration).peak_rotation.values[0]
    alone = [simulate(block, motion, model=model, duration=duration).peak_rotation for block in blocks]
    assert_allclose(peaks, alone, rtol=1e-12)


@pytest.mark.cases(fast=2)
@MODELS
@pytest.mark.parametrize("dt", [1e-6, 1e-4, 1e-2])
def test_small_steps_give_the_rotation_of_sixty_digit_arithmetic(model: str, dt: float) -> None:
    """The whole course, through the turn that the record's second half brings."""
    rng = np.random.default_rng(3)
    samples = np.convolve(rng.normal(size=65), np.ones(6), mode="valid")
    samples *= 3.0 * 0.2 * GRAVITY / np.abs(samples).max()
    motion = Motion.from_samples(samples, dt)
    parameters = [((1.0, 1.0), (0.2, 0.2), (0.4, 0.4)), ((1.0, 1.5), (0.15, 0.25), (0.6, 0.3))]
    for p, alpha, restitution in parameters:
        block = rocking.Block.from_parameters(p, alpha, restitution)
        course = follow(Problem(model, p, alpha, restitution, motion.breakpoints, motion.coefficients))
        result = simulate_many(block, motion, model=model)
        assert_allclose(simulate(block, motion, model=model).peak_rotation, float(course.peak), rtol=1e-11)
        assert_allclose(result.peak_rotation.item(), float(course.peak), rtol=1e-11)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_blocks_overturn_when_they_do_under_a_thousand_g(seed: int) -> None:
    blocks, motion = thousand_g(seed)
    result = simulate_many(blocks, motion).isel(motion=0)
    judged = 0
    for k, block in enumerate(blocks):
        response = simulate(block, motion)
        if not response.ambiguous and response.overturned:
            judged += 1
            moved = [
                abs(simulate(block, motion.scaled(1.0 + i * 2.0**-50)).peak_time - response.peak_time) for i in (1, -1)
            ]
            assert abs(float(result.peak_time[k]) - response.peak_time) <= max(1e-10, 10.0 * max(moved)), k
    assert judged >= 90


def thousand_g(seed: int) -> tuple[Blocks, Motion]:
    rng = np.random.default_rng(seed)
    samples = rng.normal(size=200)
    samples *= 1e3 * GRAVITY / np.abs(samples).max()
    blocks = Blocks(p=rng.uniform(1, 6, 96), alpha=rng.uniform(0.05, 0.4, 96), restitution=rng.uniform(0.5, 0.95, 96))
    return blocks, Motion.from_samples(samples, 0.01)


@pytest.mark.parametrize("every, seed", [(4, 0), *(pytest.param(1, k, marks=pytest.mark.thorough) for k in (0, 1))])
def test_a_batch_of_one_gives_the_same_under_a_thousand_g(every: int, seed: int) -> None:
    blocks, motion = thousand_g(seed)
    together = simulate_many(blocks, motion).isel(motion=0)
    alone = [simulate_many(blocks[k], motion) for k in range(0, len(blocks), every)]
    for name in together.data_vars:
        assert_array_equal(together[name].values[::every], [one[name].item() for one in alone])


# --- factors --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [1.0, 2.0, -0.5, -3.0, 0.7])
@pytest.mark.parametrize("errors", [None, (1e-3, 4e-3), (4e-3, 1e-3), (2e-3, 0.0)])
def test_a_motion_times_a_factor_is_laid_out_as_the_scaled_motion(
    factor: float, errors: tuple[float, float] | None
) -> None:
    """Its error and its vertical component, too, which keeps its sign; without a vertical component for None."""
    rng = np.random.default_rng(4)
    along, up = (np.cumsum(rng.uniform(0.1, 0.4, 40)) for _ in range(2))
    horizontal, vertical = (
        Motion(np.append(0.0, ends), rng.normal(size=(40, degree + 1)), error=error)
        for ends, degree, error in zip((along, up), (2, 1), errors or (3e-3, 0.0), strict=True)
    )
    motion = horizontal if errors is None else horizontal.with_vertical(vertical)
    found, expected = ground_of(motion, GRAVITY, factor), ground_of(motion.scaled(factor), GRAVITY)
    assert found.error == pytest.approx(max(errors or (3e-3,)) * abs(factor) / GRAVITY, rel=1e-15)
    assert found.error == pytest.approx(expected.error, rel=1e-15)
    assert (found.columns, found.first) == (expected.columns, expected.first)
    assert_allclose(found.pieces, expected.pieces, rtol=1e-14, atol=1e-15)
    assert_allclose(found.stretches, expected.stretches, rtol=1e-13, atol=1e-14)
    if errors is not None:
        (_, lifts), (_, as_it_is) = (components(each, np.arange(30)) for each in (found, ground_of(motion, GRAVITY)))
        assert np.abs(as_it_is).max() > 0.1
        assert_allclose(lifts, abs(factor) * as_it_is, rtol=1e-14)


def test_a_scale_that_makes_a_motion_too_strong_is_refused_before_anything_is_simulated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: list[object] = []
    monkeypatch.setattr(ensemble, "simulate_tasks", lambda setup, tasks, **options: iter(map(begun.append, tasks)))
    block, motion = rocking.Block.from_parameters(p=2.0, alpha=0.2), Motion([0.0, 0.5], [[2.0]])
    for levels, measure in (([1.0, 1e30], "factor"), ([1.0, 1e31], "pga"), ([1.0, 1e308], "pga")):
        with pytest.raises(rocking.InvalidMotion, match=r"must stay below 1e\+30 m/s\^2: check units and scale"):
            simulate_many(block, motion, levels=levels, measure=measure)
    assert not begun
    assert Scales.of([1.0, 4e29], "factor").factors(motion).tolist() == [1.0, 4e29]


# --- motions that are not samples -----------------------------------------------------------------------------


@MODELS
@pytest.mark.parametrize("order", ["record first", "pulse first"])
def test_a_record_plus_a_pulse_is_not_a_record(model: str, order: str) -> None:
    """The pulse's pieces end where the samples do, every 1/8 s, but are no straight lines."""
    block = rocking.Block.from_parameters(p=3.0, alpha=0.2, restitution=0.9)
    zeros, pulse = Motion.from_samples(np.zeros(25), 0.125), rocking.pulses.sine(4.0, 1.0, cycles=3)
    motion = zeros + pulse if order == "record first" else pulse + zeros
    result = simulate_many(block, motion, model=model)
    expected = simulate(block, pulse, model=model)
    assert expected.overturned and result.overturned.item()
    assert_allclose(simulate(block, motion, model=model).overturn_time, expected.overturn_time, rtol=1e-12)
    assert_allclose(result.peak_time.item(), expected.overturn_time, rtol=1e-12)


@pytest.mark.cases(fast=3)
@MODELS
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_jumps_between_even_pieces_are_followed(model: str, degree: int) -> None:
    """Whether such a motion has a sampling step or not."""
    rng = np.random.default_rng([7, degree])
    coefficients = rng.normal(size=(80, degree + 1)) * 0.02 ** -np.arange(degree + 1.0)
    coefficients *= 3.0 * 0.2 * GRAVITY / np.abs(coefficients[:, 0]).max()
    instants = 0.02 * np.arange(81)
    blocks = Blocks(p=np.linspace(1.0, 5.0, 32), alpha=np.linspace(0.1, 0.3, 32), restitution=0.8)
    assert_same(blocks, Motion(instants, coefficients), model)
