"""Restitution: closed forms, laws by which it varies, and what they leave of proofs, derivatives and ensembles."""

import itertools
import math

import numpy as np
import pytest
from kernel_structs import rocking_block

import rocking
from rocking import Block, Restitution, RestrainedBlock, dynamics, impact_restitution, one_sided_restitution
from rocking.block.sides import housner_restitution
from rocking.errors import BlockError, OptionError
from rocking.kernels.events import compute_restitution_factor, draw_uniform

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

COLUMN = Block(width=0.4, height=2.0, mass=2000.0)


# ---- Numbers ----


def by_momentum(away, height, gyration, points, contact):
    """Factor from velocities of the centre of mass and their angular momentum, one impact after the other."""
    omega, pivots = 1.0, np.linspace(away[0], -away[1], points)
    for old, new in itertools.pairwise(pivots):
        velocity = omega * np.array([-height, -old])  # of the centre of mass at (0, height), about (old, 0)
        at = contact * new
        momentum = gyration**2 * omega + (-at * velocity[1] - height * velocity[0])
        omega = momentum / (gyration**2 + height**2 + at * new)  # turning about the new pivot
    return omega


@pytest.mark.parametrize(("contact", "points"), [(1.0, 2), (0.7, 2), (0.2, 2), (1.0, 3), (1.0, 8)])
def test_angular_momentum_about_every_point_gives_the_restitution(contact, points):
    judged = 0
    sizes = np.random.default_rng(points).uniform((0.05, 0.05, 1.0, 0.05), (1.0, 1.0, 2.0, 1.0), (20, 4))
    for plus, minus, height, gyration in sizes:
        body = {"distances": (plus, minus), "height": height, "radius_of_gyration": gyration}
        ways = [(plus, minus), (minus, plus)]
        expected = [by_momentum(away, height, gyration, points, contact) for away in ways]
        if any(gained(e, away, height, gyration) > 1.0 for e, away in zip(expected, ways, strict=True)):
            with pytest.raises(BlockError, match="gain energy"):
                impact_restitution(**body, contact=contact, points=points)
            continue
        assert impact_restitution(**body, contact=contact, points=points) == pytest.approx(expected, rel=1e-12)
        judged += 1
    assert judged == 20 if contact > 0.5 else 3 < judged < 17


def gained(e, away, height, gyration):
    """Energy after an impact over that before it, about the old pivot and the new one."""
    before, after = (gyration**2 + height**2 + distance**2 for distance in away)
    return e * e * after / before


def test_the_narrowest_contact_keeps_all_energy():
    height, gyration, away = 0.5, 0.3, (0.2, 0.1)
    body = {"distances": away, "height": height, "radius_of_gyration": gyration}
    mostly = [
        max(gained(by_momentum(way, height, gyration, 2, share), way, height, gyration) for way in (away, away[::-1]))
        for share in (0.2345, 0.2346)
    ]
    assert mostly[0] > 1.0 > mostly[1]
    with pytest.raises(BlockError, match=r"contact must be at least 0\.2346"):
        impact_restitution(**body, contact=0.2345)
    assert len(impact_restitution(**body, contact=0.2346)) == 2


def test_the_quoted_formula_has_the_square_of_the_share():
    for alpha, share in ((0.1, 0.7), (0.3, 0.5), (0.45, 0.9)):
        sine = np.sin(alpha) ** 2
        quoted = (4 - 3 * (1 + share**2) * sine) / (4 - 3 * (1 - share**2) * sine)
        assert impact_restitution(alpha, contact=share**2) == pytest.approx([quoted, quoted], rel=1e-14)


def test_one_impact_at_the_pivot_is_the_one_of_blocks():
    for alpha in (0.05, 0.2, 0.5):
        assert impact_restitution(alpha) == pytest.approx((housner_restitution(alpha),) * 2, rel=1e-14)
    body = Block.from_pivots((0.3, 0.2), 1.0, 0.6)
    found = impact_restitution(distances=(0.3, 0.2), height=1.0, radius_of_gyration=0.6)
    assert found == pytest.approx([side.restitution for side in body.sides], rel=1e-14)


def test_more_points_lose_less_as_the_documented_limit_says():
    alpha = 0.25
    found = [impact_restitution(alpha, points=n)[0] for n in (2, 3, 4, 8, 100, 10_000)]
    assert all(a < b for a, b in itertools.pairwise(found))
    sine, root = math.sin(alpha), math.sqrt(1.0 / 3.0 + math.cos(alpha) ** 2)
    loss = 0.75 * sine**2 + sine / root * math.atan(sine / root)
    assert -math.log(found[-1]) * 9_999 == pytest.approx(loss, rel=1e-3)
    many = impact_restitution(distances=(0.3, 0.2), height=1.0, radius_of_gyration=0.6, points=200_000)
    kept = math.sqrt((1.36 + 0.3**2) / (1.36 + 0.2**2))  # no energy is lost
    assert many == pytest.approx((kept, 1.0 / kept), rel=1e-5)


# ---- Draws ----


def test_draws_are_those_of_philox():
    known = [  # of the tests of Random123: counter (two words), key, output (two words)
        (0x00000000, 0x00000000, 0x00000000, 0xFF1DAE59, 0x6CD10DF2),
        (0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0x2C3F628B, 0xAB4FD7AD),
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0xDD7CE038, 0xF62A4C12),
    ]
    for low, high, key, first, second in known:
        drawn = draw_uniform(key + ((high & 0x7FFFFFFF) << 32), low)
        if high <= 0x7FFFFFFF:
            assert drawn == ((first >> 5) * 2**26 + (second >> 6)) / 2**53
        if high > 0x7FFFFFFF:  # seeds end below: Python's integers, of which the same code makes the same bits
            assert draw_uniform(key + (high << 32), low) == ((first >> 5) * 2**26 + (second >> 6)) / 2**53
            assert drawn == draw_uniform(key + ((high & 0x7FFFFFFF) << 32), low)


def test_draws_are_even_between_their_bounds():
    block = rocking_block(e=(0.9, 0.8))
    block["variable_restitution"], block["seed"], block["min_restitution"] = True, 7, (0.5, 0.6)
    draws = np.array([compute_restitution_factor(block, 0, 1.0, n) for n in range(2_000)])
    assert draws.min() >= 0.5
    assert draws.max() <= 0.9
    assert np.histogram(draws, 8, (0.5, 0.9))[0] == pytest.approx([250.0] * 8, abs=60)
    assert abs(np.corrcoef(draws[1:], draws[:-1])[0, 1]) < 0.06


# ---- Proofs ----


def test_a_restitution_that_may_be_one_on_both_sides_proves_nothing():
    lively = RestrainedBlock(COLUMN, restitution=Restitution(1.0, 0.9, seed=2))
    found = rocking.simulate(lively, None, initial_rotation=0.1, duration=9.0)
    assert not len(found.sequences)
    assert len(found.impacts) >= 10


def test_bounds_that_meet_are_a_constant():
    plain = rocking.simulate(RestrainedBlock(COLUMN, restitution=0.9), None, initial_rotation=0.1)
    for law in (Restitution(0.9, 0.5, slope=0.0), Restitution(0.9, 0.9, slope=3.0), Restitution(0.9, 0.9, seed=3)):
        found = rocking.simulate(RestrainedBlock(COLUMN, restitution=law), None, initial_rotation=0.1)
        count = min(len(found.impacts), len(plain.impacts), 30)
        assert count == 30
        assert np.array_equal(found.impacts["time"][:count], plain.impacts["time"][:count])
        rest, known = found.sequences[0], plain.sequences[0]
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
        _, _, impacts = strobe.advance(state)
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
        (lambda: Restitution(1.2, 0.8, slope=0.1), "maximum must be in"),
        (lambda: Restitution(0.9, 0.8, slope=-0.1), "slope must be finite and at least 0, in s/rad, not -0.1"),
        (lambda: Restitution(0.9, 0.95, slope=0.1), "minimum must be above 0 and at most maximum, 0.9"),
        (lambda: Restitution(0.9, 0.95, seed=1), "minimum must be above 0 and at most maximum"),
        (lambda: Restitution(1.1, 0.9, seed=1), "maximum must be in"),
        (lambda: Restitution((0.95, 0.4), (0.9, 0.5), seed=1), "minimum must be above 0 and at most maximum, 0.4"),
        (lambda: Restitution(0.9, 0.5), "a law of restitution requires a slope or a seed"),
        (lambda: Restitution(0.95, 0.9, seed=1.5), "seed must be a whole number"),
        (lambda: Restitution(0.95, 0.9, slope=0.1, seed=1), "has either a slope or a seed"),
        (lambda: impact_restitution(), "either alpha for a rectangular block, or"),
        (lambda: impact_restitution(0.2, height=1.0), "either alpha for a rectangular block, or"),
        (lambda: impact_restitution(0.2, contact=1.5), "contact must be"),
        (lambda: impact_restitution(0.2, contact=0.5, points=3), "either a contact or points"),
        (lambda: impact_restitution(1.2), "too stocky"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(make, says):
    with pytest.raises(BlockError, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("given", [(0.95, 0.9), (0.9, 1.1), ((0.9, 0.5), (0.95, 0.4))])
def test_an_error_keeps_the_bound_that_is_wrong(given):
    with pytest.raises(BlockError) as refused:
        Restitution(*given[::-1], seed=1)
    assert refused.value.value == given[["minimum", "maximum"].index(refused.value.argument)]


def test_what_needs_the_same_factor_each_time_refuses_a_law():
    shaking = rocking.pulses.sine(6.0, 0.8, cycles=1)
    random = RestrainedBlock(COLUMN, restitution=Restitution(0.95, 0.9, seed=1))
    with pytest.raises(OptionError, match="restitution drawn at random at each impact"):
        dynamics.stroboscopic_map(random, shaking)


@pytest.mark.parametrize("alpha", ["a", math.nan, 5.0])
def test_a_wall_has_a_slenderness(alpha):
    with pytest.raises(BlockError, match="alpha"):
        one_sided_restitution(alpha)


def test_several_points_below_a_flat_body_leave_nothing():
    with pytest.raises(BlockError, match="too stocky"):
        impact_restitution(distances=(1.0, 5.0), height=0.1, radius_of_gyration=0.1, points=3)
