"""Restitution: closed forms, laws by which it varies, and what they leave of proofs, derivatives and ensembles."""

import math

import numpy as np
import pytest
from kernel_records import rocking_block

import rocking
from rocking import (
    Block,
    InvalidBlock,
    InvalidOption,
    Restitution,
    RestrainedBlock,
    dynamics,
    one_sided_restitution,
)
from rocking.kernels.events import factor, uniform

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

COLUMN = Block(width=0.4, height=2.0, mass=2000.0)


# ---- Draws ----


def test_draws_are_those_of_philox():
    known = [  # of the tests of Random123: counter (two words), key, output (two words)
        (0x00000000, 0x00000000, 0x00000000, 0xFF1DAE59, 0x6CD10DF2),
        (0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0x2C3F628B, 0xAB4FD7AD),
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0xDD7CE038, 0xF62A4C12),
    ]
    for low, high, key, first, second in known:
        drawn = uniform(key + ((high & 0x7FFFFFFF) << 32), low)
        if high <= 0x7FFFFFFF:
            assert drawn == ((first >> 5) * 2**26 + (second >> 6)) / 2**53
        if high > 0x7FFFFFFF:  # seeds end below: Python's integers, of which the same code makes the same bits
            assert uniform(key + (high << 32), low) == ((first >> 5) * 2**26 + (second >> 6)) / 2**53
            assert drawn == uniform(key + ((high & 0x7FFFFFFF) << 32), low)


def test_draws_are_even_between_their_bounds():
    block = rocking_block(e=(0.9, 0.8))
    block["variable_restitution"], block["seed"], block["min_restitution"] = True, 7, (0.5, 0.6)
    draws = np.array([factor(block, 0, 1.0, n) for n in range(2_000)])
    assert draws.min() >= 0.5
    assert draws.max() <= 0.9
    assert np.histogram(draws, 8, (0.5, 0.9))[0] == pytest.approx([250.0] * 8, abs=60)
    assert abs(np.corrcoef(draws[1:], draws[:-1])[0, 1]) < 0.06


# ---- Proofs ----


def test_a_restitution_that_may_be_one_on_both_sides_proves_nothing():
    lively = RestrainedBlock(COLUMN, restitution=Restitution(1.0, 0.9, seed=2))
    found = rocking.simulate(lively, None, initial_rotation=0.1, duration=9.0)
    assert not len(found.chattering)
    assert len(found.impacts) >= 10


def test_bounds_that_meet_are_a_constant():
    plain = rocking.simulate(RestrainedBlock(COLUMN, restitution=0.9), None, initial_rotation=0.1)
    for law in (Restitution(0.9, 0.5, slope=0.0), Restitution(0.9, 0.9, slope=3.0), Restitution(0.9, 0.9, seed=3)):
        found = rocking.simulate(RestrainedBlock(COLUMN, restitution=law), None, initial_rotation=0.1)
        count = min(len(found.impacts), len(plain.impacts), 30)
        assert count == 30
        assert np.array_equal(found.impacts["time"][:count], plain.impacts["time"][:count])
        rest, known = found.chattering[0], plain.chattering[0]
        assert rest["lower"] - 1e-12 <= known["upper"] and known["lower"] - 1e-12 <= rest["upper"]


# ---- The same bits, however they are computed ----


def test_seeds_make_bodies_that_differ_and_one_seed_the_same():
    made = [RestrainedBlock(COLUMN, restitution=Restitution(0.95, 0.8, seed=seed)) for seed in (1, 1, 2)]
    rates = []
    for body in made:
        hits = rocking.simulate(body, None, initial_rotation=0.15).impacts[:20]
        rates.append(hits["speed_after"] / hits["speed_before"])
    assert np.array_equal(rates[0], rates[1])
    assert abs(rates[0] - rates[2]).max() > 0.05


# ---- Derivatives ----


def test_maps_of_a_restitution_that_falls_have_the_derivatives_of_finite_differences():
    body = RestrainedBlock(Block.from_parameters(1.0, 0.2), restitution=Restitution(0.9, 0.5, slope=1.0))
    strobe = dynamics.stroboscopic_map(body, rocking.pulses.sine(6.0, 0.8, cycles=1), model="linear")
    judged = 0
    for state in ([0.05, 0.0], [0.02, 0.1], [-0.08, 0.05], [0.1, -0.1]):
        _, change = strobe.derivative(state)
        _, _, impacts = strobe.followed(state)
        h = 1e-6
        ends = [
            strobe([[a + s * da, b + s * db]])[0] for a, b in [state] for da, db in ((h, 0), (0, h)) for s in (1, -1)
        ]
        numeric = np.column_stack([(ends[0] - ends[1]) / (2 * h), (ends[2] - ends[3]) / (2 * h)])
        if impacts:
            assert change == pytest.approx(numeric, rel=1e-5, abs=1e-6)
            judged += 1
    assert judged >= 3


# ---- What is refused ----


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Restitution(1.2, 0.8, slope=0.1), "largest must be in"),
        (lambda: Restitution(0.9, 0.8, slope=-0.1), "slope must be finite and at least 0, in s/rad, not -0.1"),
        (lambda: Restitution(0.9, 0.95, slope=0.1), "least must be above 0 and at most largest, 0.9"),
        (lambda: Restitution(0.9, 0.95, seed=1), "least must be above 0 and at most largest"),
        (lambda: Restitution(1.1, 0.9, seed=1), "largest must be in"),
        (lambda: Restitution((0.95, 0.4), (0.9, 0.5), seed=1), "least must be above 0 and at most largest, 0.4"),
        (lambda: Restitution(0.95, 0.9, seed=1.5), "seed must be a whole number"),
        (lambda: Restitution(0.95, 0.9, slope=0.1, seed=1), "either falls or is drawn: give a slope or a seed"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(make, says):
    with pytest.raises(InvalidBlock, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("given", [(0.95, 0.9), (0.9, 1.1), ((0.9, 0.5), (0.95, 0.4))])
def test_an_error_keeps_the_bound_that_is_wrong(given):
    with pytest.raises(InvalidBlock) as refused:
        Restitution(*given[::-1], seed=1)
    assert refused.value.value == given[["least", "largest"].index(refused.value.argument)]


def test_what_needs_the_same_factor_each_time_refuses_a_law():
    shaking = rocking.pulses.sine(6.0, 0.8, cycles=1)
    random = RestrainedBlock(COLUMN, restitution=Restitution(0.95, 0.9, seed=1))
    with pytest.raises(InvalidOption, match="draws its restitution at each impact"):
        dynamics.stroboscopic_map(random, shaking)


@pytest.mark.parametrize("alpha", ["a", math.nan, 5.0])
def test_a_wall_has_a_slenderness(alpha):
    with pytest.raises(InvalidBlock, match="alpha"):
        one_sided_restitution(alpha)
