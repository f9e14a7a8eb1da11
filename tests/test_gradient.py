"""The derivatives of a peak by every coefficient and sample of a motion, against differences and 30 digits."""

from collections.abc import Callable

import numpy as np
import pytest
from oracles.cases import GRAVITY

import rocking
from rocking import Block, Motion
from rocking.analysis import CriticalScale
from rocking.core.arrays import Floats

P, ALPHA, RESTITUTION = (2.0, 2.6), (0.15, 0.12), (0.9, 0.7)
BLOCK = Block.from_parameters(p=P, alpha=ALPHA, restitution=RESTITUTION)
Arrays = tuple[Floats, Floats, Floats]
MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])


def samples_of(seed: int, count: int = 18) -> Floats:
    rng = np.random.default_rng(seed)
    rough = np.convolve(rng.normal(size=count + 2), np.ones(3), mode="valid")
    return rough * rng.uniform(1.6, 2.4) * 0.13 * GRAVITY / np.max(np.abs(rough))


def slope(value: Callable[[float], float], step: float) -> float:
    """Derivative at zero by central differences, their error extrapolated away to the sixth power of the step."""
    wide, middle, narrow = ((value(h) - value(-h)) / (2.0 * h) for h in (2.0 * step, step, 0.5 * step))
    return ((16.0 * (4.0 * narrow - middle) - (4.0 * middle - wide)) / 3.0) / 15.0


def judged_by_differences(seeds: range, model: str, every: int = 1) -> int:
    """Judge samples of both components and the start; returns how many derivatives were judged."""
    judged = 0
    for seed in seeds:
        horizontal, upright = samples_of(seed), 3.0 * samples_of(seed + 1000, 12)
        start = np.random.default_rng(seed).uniform(-0.05, 0.05, 2)

        def response(x: Floats, y: Floats, z: Floats) -> rocking.Response:
            motion = Motion.from_samples(x, 0.06).with_vertical(Motion.from_samples(y, 0.07))
            return rocking.simulate(BLOCK, motion, model=model, initial_rotation=z[0], initial_velocity=z[1])

        found = response(horizontal, upright, start)
        if found.overturned or found.peak_time == 0.0:
            continue
        gradient = rocking.gradient(found)
        of_start = np.array([gradient.initial_rotation, gradient.initial_velocity])
        for which, values in enumerate((gradient.samples, gradient.vertical_samples, of_start)):
            for k in range(0, len(values), every):

                def peak(
                    h: float, given: Arrays = (horizontal, upright, start), which: int = which, k: int = k
                ) -> float:
                    changed = [each.copy() for each in given]
                    changed[which][k] += h
                    return response(*changed).peak_rotation

                step, scale = 1e-3 if which < 2 else 2e-4, max(1e-3, np.max(np.abs(values)))
                expected, nearer = slope(peak, step), slope(peak, 0.125 * step)
                if abs(nearer - expected) > 2e-9 * scale:  # differences do not know it so well
                    continue
                assert abs(values[k] - expected) <= 1e-8 * scale, (seed, which, k)
                judged += 1
    return judged


@MODELS
@pytest.mark.parametrize(
    ("seeds", "every", "least"), [(range(5, 6), 3, 10), pytest.param(range(6, 10), 1, 50, marks=pytest.mark.slow)]
)
def test_samples_of_both_components_and_the_start_change_the_peak_as_differences_say(
    seeds: range, every: int, least: int, model: str
) -> None:
    assert judged_by_differences(seeds, model, every) >= least


def test_what_comes_before_a_proven_rest_changes_nothing() -> None:
    pulse = np.array([0.0, 3.0, -3.0, 0.0])
    record = Motion.from_samples(np.concatenate([pulse, np.zeros(120), 1.4 * pulse]), 0.1)
    response = rocking.simulate(BLOCK, record, initial_rotation=0.01)
    (rest,) = (row for row in response.rest_intervals if row[1] < response.peak_time)
    found = rocking.gradient(response)
    before = record.breakpoints[1:] < rest[1]
    assert np.count_nonzero(before) >= 100
    assert not np.any(found.coefficients[before])
    assert (found.initial_rotation, found.initial_velocity, found.reason) == (0.0, 0.0, "")
    behind = (record.breakpoints[:-1] > rest[1]) & (record.breakpoints[1:] < response.peak_time)
    assert np.any(behind)
    assert np.all(found.coefficients[behind])


def test_where_a_block_overturns_there_is_no_derivative_and_a_word_says_so() -> None:
    response = rocking.simulate(BLOCK, Motion.from_samples([0.0, 20.0, 20.0, 0.0], 0.5))
    found = rocking.gradient(response)
    assert response.overturned
    assert np.all(np.isnan([*found.samples, found.initial_rotation, found.initial_velocity]))
    assert "overturns" in found.reason


def test_behind_a_touch_without_speed_there_is_no_derivative_and_a_word_says_so() -> None:
    """With a weight of -1 a block swings about alpha as a pendulum, back to zero; then a push moves it higher."""
    lift = Motion.from_samples(np.full(3, -2.0 * GRAVITY), 2.0)
    push = Motion.from_points([0.0, 2.2, 2.5, 2.6, 4.0], [0.0, 0.0, -2.0, 0.0, 0.0]).with_vertical(lift)
    block = Block.from_parameters(p=3.0, alpha=0.2, restitution=0.5)
    response = rocking.simulate(block, push, duration=3.1)
    found = rocking.gradient(response)
    assert len(response.impacts) == 0
    assert response.peak_time > 2.1
    assert "without speed" in found.reason
    assert np.all(np.isnan(found.coefficients))


def test_a_start_on_the_ground_has_no_derivative_to_both_sides() -> None:
    still = rocking.gradient(rocking.simulate(BLOCK, Motion.from_samples([0.0, 0.1, 0.0], 0.1)))
    assert not np.any(still.samples)
    assert np.all(np.isnan([still.initial_rotation, still.initial_velocity]))
    assert "start" in still.reason
    kicked = rocking.gradient(rocking.simulate(BLOCK, None, initial_velocity=0.1))
    assert np.isnan(kicked.initial_rotation)
    h = 1e-4
    higher, lower = (rocking.simulate(BLOCK, None, initial_velocity=0.1 + x).peak_rotation for x in (h, -h))
    assert kicked.initial_velocity == pytest.approx((higher - lower) / (2.0 * h), rel=1e-5)
    held = rocking.gradient(rocking.simulate(BLOCK, None, initial_rotation=-0.05))
    assert (held.initial_rotation, held.initial_velocity, held.reason) == (-1.0, 0.0, "")


def test_what_cannot_be_differentiated_is_refused_in_a_sentence() -> None:
    pulse = rocking.simulate(BLOCK, rocking.pulses.one_sine(2.0, 1.0))
    with pytest.raises(rocking.errors.OptionError, match="not linear between samples"):
        _ = rocking.gradient(pulse).samples
    with pytest.raises(rocking.errors.OptionError, match="no vertical component"):
        _ = rocking.gradient(pulse).vertical_samples
    with pytest.raises(rocking.errors.OptionError, match="must be a Response"):
        rocking.gradient(BLOCK)


@pytest.mark.thorough
@pytest.mark.parametrize("model", [pytest.param("linear", marks=pytest.mark.thorough), "nonlinear"])
def test_a_critical_scale_changes_as_differences_of_critical_scales_say(model: str) -> None:
    rng = np.random.default_rng(1)
    rough = np.convolve(rng.normal(size=20), np.ones(3), mode="valid")
    given = {"samples": 2.0 * rough / np.max(np.abs(rough)), "p": np.array(P), "alpha": np.array(ALPHA)}
    given["restitution"] = np.array(RESTITUTION)

    def critical(changed: dict[str, Floats], low: float = 1.4, high: float = 1.6) -> CriticalScale:
        block = Block.from_parameters(**{name: tuple(changed[name]) for name in ("p", "alpha", "restitution")})
        return rocking.critical_scale(block, Motion.from_samples(changed["samples"], 0.1), (low, high), model=model)

    found = critical(given)
    changes = [("samples", np.eye(18)[k], found.gradient.samples[k]) for k in (3, 12)]
    changes += [(name, given[name], getattr(found, f"{name}_derivative")) for name in ("p", "alpha", "restitution")]
    for name, direction, expected in changes:

        def scale(h: float, name: str = name, direction: Floats = direction) -> float:
            changed = given | {name: given[name] + h * direction}
            return critical(changed, 0.99 * found.scale, 1.01 * found.scale).scale

        h = 1e-3
        wide, narrow = ((scale(x) - scale(-x)) / (2.0 * x) for x in (h, 0.5 * h))
        assert expected == pytest.approx((4.0 * narrow - wide) / 3.0, rel=1e-8, abs=1e-9), name
    assert np.sum(found.gradient.samples * given["samples"]) == pytest.approx(-found.scale, rel=1e-12)


def test_a_critical_scale_changes_with_the_start_and_the_vertical_component() -> None:
    upright = np.array([0.0, 2.0, -3.0, 1.0, 0.0])

    def critical(rotation: float, lift: float = 0.0, low: float = 0.2, high: float = 6.0) -> CriticalScale:
        vertical = Motion.from_samples(upright + lift * np.eye(5)[2], 0.3)
        record = Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3).with_vertical(vertical)
        return rocking.critical_scale(BLOCK, record, (low, high), initial_rotation=rotation, initial_velocity=0.01)

    found, h = critical(0.02), 1e-6
    near = 0.9999 * found.scale, 1.0001 * found.scale
    by_rotation = (critical(0.02 + h, 0.0, *near).scale - critical(0.02 - h, 0.0, *near).scale) / (2.0 * h)
    by_lift = (critical(0.02, h, *near).scale - critical(0.02, -h, *near).scale) / (2.0 * h)
    assert found.gradient.initial_rotation == pytest.approx(by_rotation, rel=1e-7)
    assert found.gradient.vertical_samples[2] == pytest.approx(by_lift, rel=1e-7)


def test_scales_that_bracket_no_overturning_are_refused() -> None:
    record = Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    with pytest.raises(rocking.errors.OptionError, match=r"does not overturn at the scale 0.2"):
        rocking.critical_scale(BLOCK, record, (0.1, 0.2))
    with pytest.raises(rocking.errors.OptionError, match=r"overturns at the scale 8"):
        rocking.critical_scale(BLOCK, record, (8.0, 9.0))
    with pytest.raises(rocking.errors.OptionError, match="requires a motion; got None"):
        rocking.critical_scale(BLOCK, None, (8.0, 9.0))


def test_a_law_of_restitution_is_carried_back_as_it_is_carried_forwards():
    judged = 0
    for law in (rocking.Restitution(0.95, 0.5, slope=0.3), rocking.Restitution(0.95, 0.6, seed=3)):
        block = rocking.RestrainedBlock(rocking.Block(width=0.4, height=2.0), restitution=law)
        for amplitude in (2.0, 2.2, 2.4, 2.6, 2.8, 3.0):
            response = rocking.simulate(block, rocking.pulses.ricker(amplitude, 1.0), initial_rotation=0.05)
            if response.overturned or len(response.impacts) == 0 or response.peak_time < response.impacts["time"][0]:
                continue
            found = rocking.gradient(response)
            assert 0.05 * found.initial_rotation == pytest.approx(
                response.sensitivity.peak["initial_rotation"][0], rel=1e-9, abs=1e-12
            )
            judged += 1
    assert judged >= 3


def test_scales_in_the_wrong_order_are_refused_where_a_stronger_motion_lets_the_block_stand() -> None:
    """The block stands at 14 and overturns at 8: neither is next to a change."""
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    pulse = rocking.pulses.one_sine(1.0, 5.0 / np.pi)
    assert rocking.simulate(block, pulse * 8.0).overturned
    assert not rocking.simulate(block, pulse * 14.0).overturned
    with pytest.raises(rocking.errors.OptionError, match=r"bounds must be \(lower, higher\); got \(14, 8\)"):
        rocking.critical_scale(block, pulse, (14.0, 8.0))


def test_a_gradient_counts_the_pieces_that_its_value_depends_on():
    """Those up to the peak, and none after it."""
    motion = Motion.from_samples([0.0, 1.5, 3.0, 3.0, -2.0, 0.0, 0.1, 0.0], 0.2)
    found = rocking.gradient(rocking.simulate(BLOCK, motion), "rotation", 0.7)
    moved = int(np.count_nonzero(found.coefficients.any(axis=1)))
    assert 0 < moved < len(found.coefficients) == 7
    assert f"depends on {moved} of 7 pieces of the motion" in repr(found)


def test_where_a_touch_decides_on_overturning_a_critical_scale_has_no_derivative():
    """Nothing weighs the block down for a while: a push, sooner or later, decides whether it lands."""
    lift = Motion([0.0, 2.6, 4.0], [[-2.0 * 9.80665], [0.0]])
    push = Motion([0.0, 0.01, 0.9, 1.1, 2.6, 3.2, 4.0], [[-1e-3], [0.0], [1.0], [0.0], [3.5], [0.0]])
    block, motion = Block.from_parameters(p=3.0, alpha=0.2, restitution=0.5), push.with_vertical(lift)
    touch = rocking.critical_scale(block, motion, (0.99, 1.001))
    assert touch.scale == pytest.approx(0.99996, abs=1e-5)
    assert "without the block coming to the balance point" in touch.gradient.reason
    assert np.all(
        np.isnan(
            [
                touch.p_derivative,
                touch.alpha_derivative,
                touch.restitution_derivative,
                *touch.gradient.coefficients.ravel(),
            ]
        )
    )
