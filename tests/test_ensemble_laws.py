"""Laws of an ensemble where it could part from single simulations; `test_referee.py` compares the two at random."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from oracles.multiprecision import follow
from oracles.problem import Problem

import rocking
from rocking import Blocks, Motion, simulate, simulate_many
from rocking.engine.problem import prepare_ground
from rocking.kernels.ground import bound_stretch, ground_error, scale_coefficients
from rocking.simulation import ensemble
from rocking.simulation.ensemble import ScalingLevels

GRAVITY = 9.80665
MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])


def steady(times_threshold: float, *, samples: int = 501, dt: float = 0.01) -> Motion:
    """A constant acceleration, over that of uplift of a slenderness of 0.2."""
    return Motion.from_samples(np.full(samples, times_threshold * 0.2 * GRAVITY), dt)


# --- the end --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("duration", [0.5, 0.25, 0.503])
def test_the_peak_where_the_simulation_stops_is_that_of_the_closed_form(duration: float) -> None:
    blocks = Blocks(p=[1.0, 2.0, 4.0], alpha=0.2, restitution=0.9)
    result = simulate_many(blocks, steady(1.2), model="linear", duration=duration)
    expected = 0.2 * 0.2 * (np.cosh(blocks.p[:, 0] * duration) - 1.0)
    assert_allclose(result.peak_rotation.values[0], expected, rtol=1e-11)


# --- scales ---------------------------------------------------------------------------------------------------


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
    found = prepare_ground(motion, GRAVITY)._replace(factor=factor)
    expected = prepare_ground(motion.scaled(factor), GRAVITY)
    assert ground_error(found) == pytest.approx(max(errors or (3e-3,)) * abs(factor) / GRAVITY, rel=1e-15)
    assert ground_error(found) == pytest.approx(ground_error(expected), rel=1e-15)
    assert (found.coefficient_count, found.first_column) == (expected.coefficient_count, expected.first_column)
    pieces = np.arange(len(found.pieces))
    for k, scaled in enumerate(scale_coefficients(found, pieces)):
        assert_allclose(scaled, scale_coefficients(expected, pieces)[k], rtol=1e-14, atol=1e-15)
    assert_allclose(found.pieces[:, :2], expected.pieces[:, :2])
    for stretch in range(len(found.stretches)):
        assert_allclose(bound_stretch(found, stretch), bound_stretch(expected, stretch), rtol=1e-13, atol=1e-14)
    if errors is not None:
        (_, lifts), (_, as_it_is) = (
            scale_coefficients(each, np.arange(30)) for each in (found, prepare_ground(motion, GRAVITY))
        )
        assert np.abs(as_it_is).max() > 0.1
        assert_allclose(lifts, abs(factor) * as_it_is, rtol=1e-14)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("with_vertical", [False, True])
def test_lanes_under_multiples_of_a_record_are_responses_to_the_scaled_record(model, with_vertical) -> None:
    """To the last bit, though levels, polarities and blocks of a motion step together."""
    record = rocking.records.load("el-centro-meloland-270")
    if with_vertical:
        record = record.with_vertical(rocking.records.load("el-centro-meloland-up"))
    blocks = [
        rocking.Block.from_parameters((p, 1.2 * p), (0.15, alpha), 0.9) for p, alpha in ((2.0, 0.15), (5.0, 0.25))
    ]
    levels = [0.3, 0.9, 1.7]
    many = simulate_many(blocks, record, levels=levels, polarity="both", model=model, include_times=True)
    names = ("peak_rotation", "residual_rotation", "first_rest", "last_rest", "peak_time")
    for s, level in enumerate(levels):
        for k, sign in enumerate((1.0, -1.0)):
            scaled = record.scaled(sign * level)
            for b, block in enumerate(blocks):
                alone = simulate_many(block, scaled, model=model, include_times=True)
                at = {"motion": 0, "scale": s, "polarity": k, "block": b}
                for name in names:
                    expected, found = alone[name].values.ravel()[0], many[name].isel(at).item()
                    assert found == expected or (np.isnan(found) and np.isnan(expected)), (name, at)
                response = rocking.simulate(block, scaled, model=model)
                assert bool(many.overturned.isel(at)) is response.overturned
                if not response.overturned:
                    assert float(many.peak_rotation.isel(at)) == response.peak_rotation


def test_a_scale_that_makes_a_motion_too_strong_is_refused_before_anything_is_simulated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: list[object] = []
    monkeypatch.setattr(ensemble, "simulate_tasks", lambda setup, tasks, **options: iter(map(begun.append, tasks)))
    block, motion = rocking.Block.from_parameters(p=2.0, alpha=0.2), Motion([0.0, 0.5], [[2.0]])
    for levels, measure in (([1.0, 1e30], "factor"), ([1.0, 1e31], "pga"), ([1.0, 1e308], "pga")):
        with pytest.raises(rocking.errors.MotionError, match=r"must stay below 1e\+30 m/s\^2: check units and scale"):
            simulate_many(block, motion, levels=levels, measure=measure)
    assert not begun
    assert ScalingLevels.from_levels([1.0, 4e29], "factor").factors(motion).tolist() == [1.0, 4e29]


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
