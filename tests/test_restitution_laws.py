"""Which law of restitution times of impacts prefer: each law is found where it is the true one."""

import math

import numpy as np
import pytest
from oracles.restrained import Held, integrated

import rocking
from rocking import (
    Block,
    FallingRestitution,
    InvalidBlock,
    InvalidOption,
    RandomRestitution,
    RestrainedBlock,
    compare_restitution,
    impact_restitution,
)
from rocking.analysis.restitution import _factors, _speeds

COLUMN = Block(width=0.4, height=2.0)
FRAME = Block.from_frame(half_width=0.2, half_height=1.0, mass_ratio=2.0)


def releases(law, seed=1, timing=1e-3, impacts=12, model="nonlinear"):
    noise, body = np.random.default_rng(seed), RestrainedBlock(COLUMN, restitution=law)
    runs = [rocking.simulate(body, None, initial_rotation=start, model=model) for start in (0.08, 0.12, 0.16)]
    return [run.impacts["time"][:impacts] + noise.normal(0.0, timing, impacts) for run in runs]


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("law", "names"),
    [
        (None, {"angular momentum (Housner)"}),
        (0.9, {"constant"}),
        (impact_restitution(COLUMN.alpha, contact=0.6), {"constant", "narrow contact"}),
        (FallingRestitution(0.96, 0.15, 0.7), {"falling with the speed"}),
        (RandomRestitution(0.85, 0.97, 4), {"drawn at each impact"}),
    ],
)
def test_the_law_that_made_the_times_is_preferred(law, names):
    found = compare_restitution(releases(law), COLUMN, timing=1e-3)
    assert found.laws[0].name in names
    assert 0.6 < found.laws[0].misfit < 1.4
    assert sum(fit.weight for fit in found.laws) == pytest.approx(1.0)
    assert [fit.criterion for fit in found.laws] == sorted(fit.criterion for fit in found.laws)


@pytest.mark.thorough
def test_laws_of_angular_momentum_are_those_of_the_body_and_not_of_a_rectangle():
    sizes = {"distances": (0.2, 0.2), "height": 1.0, "radius_of_gyration": 0.9}
    for contact in (1.0, 0.7):
        kept = impact_restitution(**sizes, contact=contact)
        block = Block.from_pivots((0.2, 0.2), 1.0, 0.9, restitution=kept)
        runs = [rocking.simulate(block, None, initial_rotation=start) for start in (0.06, 0.1, 0.14)]
        found = compare_restitution([run.impacts["time"][:12] for run in runs], block, timing=1e-5)
        fits = {fit.name: fit for fit in found.laws}
        assert fits["narrow contact"].estimates["contact"] == pytest.approx(contact, rel=1e-4)
        assert (fits["angular momentum (Housner)"].misfit < 1e-3) == (contact == 1.0)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("alpha", [1.0, 1.2])
def test_of_a_stocky_block_a_narrow_contact_explains_what_housner_cannot(alpha):
    """By Housner such a block would not rock on; e = (A - k s^2)/(A + k s^2) of 0.6 tells the contact k."""
    block = Block.from_parameters(p=3.0, alpha=alpha, restitution=0.6)
    runs = [rocking.simulate(block, None, initial_rotation=share * alpha) for share in (0.3, 0.6)]
    found = compare_restitution([run.impacts["time"][:8] for run in runs], block)
    fits = {fit.name: fit for fit in found.laws}
    contact = 0.4 / 1.6 * (1.0 / 3.0 + math.cos(alpha) ** 2) / math.sin(alpha) ** 2
    assert len(fits) == 6
    assert fits["narrow contact"].estimates["contact"] == pytest.approx(contact, rel=1e-5)
    assert fits["angular momentum (Housner)"].weight < 1e-9
    assert found.plot().axes


@pytest.mark.parametrize("model", ["linear", pytest.param("nonlinear", marks=pytest.mark.thorough)])
def test_times_without_errors_tell_the_factors(model):
    found = compare_restitution(releases(0.9, timing=0.0, model=model), COLUMN, timing=1e-6, model=model)
    assert len(found.factors) == 30
    assert found.factors == pytest.approx(np.full(30, 0.9), rel=1e-8)
    fit = next(each for each in found.laws if each.name == "constant")
    assert fit.estimates["factor"] == pytest.approx(0.9, rel=1e-8)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_impacts_close_to_each_other_tell_the_factors_too(model):
    block = Block.from_parameters(p=6.0, alpha=0.3, restitution=0.7)
    times = rocking.simulate(block, None, model=model, initial_rotation=0.2, chattering="velocity=1e-5").impacts["time"]
    times = times[: 2 + int(np.argmax(np.diff(times) < 2e-4))]
    found = rocking.compare_restitution([times], block, model=model, timing=2e-5)
    assert found.factors == pytest.approx(0.7, rel=1e-5)
    assert found.laws[0].name == "constant"


def test_speeds_are_those_of_an_integration():
    body = Held((0.2, 0.2), 1.0, math.sqrt((0.04 + 1.0) / 3.0), 1.0, COLUMN.gravity, (0.9, 0.9))
    still = rocking.Motion.from_samples(np.zeros(60), 0.1)
    times, speeds, _, _ = integrated(body, still, 5.9, 0.19, 0.0, 0)
    found = compare_restitution([times], COLUMN)
    assert len(found.speeds) >= 5
    # The first known speed is that after the first impact; what is left of the lost energy is the next one's.
    assert found.speeds == pytest.approx(speeds[1 : 1 + len(found.speeds)], rel=1e-8)


def test_errors_of_times_are_those_of_the_factors():
    speed_of, times = _speeds(COLUMN, "nonlinear"), releases(0.9, timing=0.0)[2]
    truth, noise = _factors(times, speed_of, 1e-4), np.random.default_rng(3)
    off = np.array(
        [_factors(times + noise.normal(0.0, 1e-4, 12), speed_of, 1e-4).logs - truth.logs for _ in range(1000)]
    )
    scaled = np.linalg.solve(np.linalg.cholesky(truth.covariance), off.T)
    assert np.cov(scaled) == pytest.approx(np.eye(10), abs=0.2)
    assert abs(truth.covariance[1, 0]) > 0.1 * truth.covariance[0, 0]


@pytest.mark.thorough
def test_a_comparison_shows_itself():
    found = compare_restitution(releases(0.9), COLUMN)
    text = found.summary()
    assert text.startswith("30 impacts of 3 tests prefer the law: constant")
    assert all(fit.name in text for fit in found.laws)
    assert len(found.to_dict()["laws"]) == 6
    labels = [each.get_text() for each in found.plot().legends[0].get_texts()]
    assert "measured" in labels
    assert "constant" in labels
    assert len(labels) <= 5


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        (([], COLUMN), InvalidOption, "give at least one of tests"),
        (([[1.0, 2.0]], COLUMN), InvalidOption, "each of tests must hold three increasing times or more, s; test 0"),
        (([[1.0, 2.0, 1.5]], COLUMN), InvalidOption, "three increasing times"),
        (([[1.0, 2.0, 30.0]], COLUMN), InvalidOption, "farther than this block's can be"),
        (([[1.0, 1.5, 1.9, 2.2]], COLUMN), InvalidOption, "tests tell 2 factors of restitution"),
        ((None, COLUMN), InvalidOption, "tests must be a list, not None"),
        (([[1.0, 1.5, 1.9]], 0.4), InvalidBlock, "a Block is needed"),
        (([[1.0, 1.5, 1.9]], Block(width=0.4, height=2.0, offset=0.02)), InvalidOption, "must have equal sides"),
        (([[1.0, 1.5, 1.9]], FRAME), InvalidOption, "block must be one rigid body: laws of angular momentum"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(arguments, error, says):
    with pytest.raises(error, match=says) as refused:
        compare_restitution(*arguments)
    assert "\n" not in str(refused.value)


def test_the_timing_must_be_positive():
    with pytest.raises(InvalidOption, match="timing must be a positive number"):
        compare_restitution([[1.0, 1.5, 1.9]], COLUMN, timing=0.0)


def test_impacts_at_one_speed_tell_no_slope_and_no_warning():
    # Times between impacts repeat: every speed is the same, and every factor 1.
    found = compare_restitution([0.4 * np.arange(9)], COLUMN)
    assert found.factors == pytest.approx(np.ones(7), abs=1e-9)
    assert all(np.isfinite(law.criterion) for law in found.laws)
