"""Restitution: closed forms, laws by which it varies, and what they leave of proofs, derivatives and ensembles."""

import itertools
import math

import numpy as np
import pytest
from kernel_records import rocking_block
from oracles.restrained import Held, compared

import rocking
from rocking import (
    Block,
    Damper,
    FallingRestitution,
    InvalidBlock,
    InvalidOption,
    RandomRestitution,
    RestrainedBlock,
    Tendon,
    VelocityThreshold,
    dynamics,
    impact_restitution,
    one_sided_restitution,
)
from rocking.block import RestrainedBlocks, housner_restitution
from rocking.kernels import compiled
from rocking.kernels import march as march_module
from rocking.kernels.interpreted import Interpreted
from rocking.kernels.restitution import factor, uniform

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
            with pytest.raises(InvalidBlock, match="gain energy"):
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
    with pytest.raises(InvalidBlock, match=r"contact must be at least 0\.2346"):
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
        drawn = uniform(key + ((high & 0x7FFFFFFF) << 32), low)
        if high <= 0x7FFFFFFF:
            assert drawn == ((first >> 5) * 2**26 + (second >> 6)) / 2**53
        if high > 0x7FFFFFFF:  # seeds end below: Python's integers, of which the same code makes the same bits
            interpreted = getattr(uniform, "py_func", uniform)
            assert interpreted(key + (high << 32), low) == ((first >> 5) * 2**26 + (second >> 6)) / 2**53
            assert drawn == interpreted(key + ((high & 0x7FFFFFFF) << 32), low)


def test_draws_are_even_between_their_bounds():
    block = rocking_block(e=(0.9, 0.8))
    block["varying"], block["seed"], block["least"] = True, 7, (0.5, 0.6)
    draws = np.array([factor(block, 0, 1.0, n) for n in range(2_000)])
    assert draws.min() >= 0.5
    assert draws.max() <= 0.9
    assert np.histogram(draws, 8, (0.5, 0.9))[0] == pytest.approx([250.0] * 8, abs=60)
    assert abs(np.corrcoef(draws[1:], draws[:-1])[0, 1]) < 0.06


# ---- Laws: against an integration ----


def drawn(seed, motion_over_threshold=(0.05, 1.2)):
    """A body with a law, for the package and for the oracle, a motion, a start."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-0.5, 0.7)
    distances = tuple((size * rng.uniform(0.1, 0.4, 2)).tolist())
    height, gyration, mass = size, size * rng.uniform(0.5, 0.9), 1000.0
    block = Block.from_pivots(distances, height, gyration, mass=mass, gravity=9.81, restitution=0.5)
    largest = rng.uniform(0.6, 0.95, 2)
    least = largest * rng.uniform(0.4, 0.99, 2)
    body = Held(distances, height, gyration, mass, 9.81, (0.0, 0.0), seed % 5 == 0)
    natural = block.sides[0].p * block.sides[0].alpha
    if seed % 2:
        slope = rng.uniform(0.1, 2.0, 2) * (largest - least) / natural
        law = FallingRestitution(tuple(largest), tuple(slope), tuple(least))
        body.law = lambda j, speed, _: max(least[j], largest[j] - slope[j] * speed)
    else:
        law = RandomRestitution(tuple(least), tuple(largest), seed)
        body.law = lambda j, _, number: least[j] + (largest[j] - least[j]) * uniform(seed, number)
    restraints = []
    if seed % 3 == 0:
        stiffness, prestress = mass * 9.81 / size * rng.uniform(0.1, 2.0), 0.2 * mass * 9.81
        body.tendons.append((stiffness, prestress, 0.0))
        restraints.append(Tendon(stiffness, prestress))
    if seed % 7 == 0:
        body.damper = mass * 9.81 * size * 0.01
        restraints.append(Damper(body.damper))
    ours = RestrainedBlock(block, *restraints, one_sided=body.one_sided, restitution=law)
    low, high = motion_over_threshold
    pga = min(ours.uplift_thresholds()) * 10.0 ** rng.uniform(low, high)
    motion = rocking.pulses.sine(pga, 10.0 ** rng.uniform(-0.7, 0.5), cycles=3, phase=rng.uniform(0.0, 6.0))
    return ours, body, motion, 0.3 * min(*ours.balance, 0.5)


@pytest.mark.parametrize(
    ("seeds", "least"), [([8, 13, 35], 12), pytest.param([13, 14, 17, 35], 20, marks=pytest.mark.thorough)]
)
def test_impacts_are_those_of_an_integration(seeds, least):
    assert compared(drawn, seeds)[0] >= least


@pytest.mark.slow
def test_impacts_are_those_of_an_integration_over_wide_ranges():
    assert compared(drawn, range(120))[0] >= 180


# ---- Proofs ----


def rests(seeds, model):
    """Judge cases; returns how many rests without a proof are within a bracket that is wide, and proven narrow ones."""
    judged = narrow = 0
    for seed in seeds:
        ours, _, motion, start = drawn(seed, (-0.4, -0.05))
        options = {"initial_rotation": start, "model": model}
        wide = rocking.simulate(ours, motion, chattering=rocking.Certified(10.0 ** -(2 + seed % 4)), **options)
        if wide.overturned or not len(wide.chattering):
            continue
        stepped = rocking.simulate(ours, motion, chattering=VelocityThreshold(1e-13), **options)
        end = stepped.events["time"][stepped.events["kind"] == "rest"][0]
        first = wide.chattering[0]
        assert first["lower"] - 1e-11 <= end <= first["upper"] + 1e-11, seed
        judged += 1
        fine = rocking.simulate(ours, motion, **options).chattering[0]
        assert first["lower"] <= fine["lower"] <= fine["upper"] <= first["upper"], seed
        narrow += fine["upper"] - fine["lower"] <= 1e-10
    return judged, narrow


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("count", [12, pytest.param(40, marks=pytest.mark.thorough)])
def test_rests_are_within_what_is_proven(model, count):
    judged, narrow = rests(range(count), model)
    assert judged >= 0.75 * count
    assert narrow == judged


@pytest.mark.slow
def test_rests_are_within_what_is_proven_over_wide_ranges():
    judged, narrow = map(sum, zip(*(rests(range(40, 240), model) for model in ("linear", "nonlinear")), strict=True))
    assert judged >= 300
    assert narrow == judged


def test_a_restitution_that_may_be_one_on_both_sides_proves_nothing():
    lively = RestrainedBlock(COLUMN, restitution=RandomRestitution(0.9, 1.0, seed=2))
    found = rocking.simulate(lively, None, initial_rotation=0.1, duration=9.0)
    assert not len(found.chattering)
    assert len(found.impacts) >= 10


def test_bounds_that_meet_are_a_constant():
    plain = rocking.simulate(RestrainedBlock(COLUMN, restitution=0.9), None, initial_rotation=0.1)
    for law in (FallingRestitution(0.9, 0.0, 0.5), FallingRestitution(0.9, 3.0, 0.9), RandomRestitution(0.9, 0.9, 3)):
        found = rocking.simulate(RestrainedBlock(COLUMN, restitution=law), None, initial_rotation=0.1)
        count = min(len(found.impacts), len(plain.impacts), 30)
        assert count == 30
        assert np.array_equal(found.impacts["time"][:count], plain.impacts["time"][:count])
        rest, known = found.chattering[0], plain.chattering[0]
        assert rest["lower"] - 1e-12 <= known["upper"] and known["lower"] - 1e-12 <= rest["upper"]


# ---- The same bits, however they are computed ----


def test_many_are_those_one_by_one_in_any_order():
    bodies = [drawn(seed)[0] for seed in range(16)]
    motions = [rocking.pulses.one_sine(4.0, 1.2), rocking.pulses.one_sine(6.0, 0.8)]
    found = [rocking.simulate_many(bodies, motions, threads=n) for n in (1, 2)]
    turned = rocking.simulate_many(bodies[::-1], motions)
    assert found[0].equals(found[1])
    many, judged = RestrainedBlocks.of(bodies), 0
    peaks, backwards = (each["peak_rotation"].values.reshape(2, 16).T for each in (found[0], turned))
    for k in range(16):
        for m, motion in enumerate(motions):
            alone = [rocking.simulate(one, motion).peak_rotation for one in (bodies[k], many[k])]
            assert {float(peaks[k, m]), float(backwards[15 - k, m])} == set(alone), (k, m)
            judged += 1
    assert judged == 32
    again = RestrainedBlocks(**{name: values for name, (values, _) in many.parameters().items()}, gravity=9.81)
    records = [each.kernel_records("linear", np.zeros((16, 2))) for each in (again, many)]
    assert np.array_equal(*records)


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
def test_python_reads_the_same_bits(monkeypatch):
    judged = 0
    for seed in (13, 14, 17, 28):
        ours, _, motion, start = drawn(seed)
        found = []
        for interpreted in (False, True):
            monkeypatch.setattr(compiled.Kernel, "is_at_hand", not interpreted)
            monkeypatch.setattr(march_module, "_interpreted", Interpreted(march_module.march, 10**9))
            response = rocking.simulate(ours, motion, initial_rotation=start, duration=1.0)
            found.append(response.impacts.tobytes() + response.chattering.tobytes())
            judged += len(response.impacts)
        assert found[0] == found[1], seed
    assert judged >= 10


def test_seeds_make_bodies_that_differ_and_one_seed_the_same():
    made = [RestrainedBlock(COLUMN, restitution=RandomRestitution(0.8, 0.95, seed)) for seed in (1, 1, 2)]
    rates = []
    for body in made:
        hits = rocking.simulate(body, None, initial_rotation=0.15).impacts[:20]
        rates.append(hits["speed_after"] / hits["speed_before"])
    assert np.array_equal(rates[0], rates[1])
    assert abs(rates[0] - rates[2]).max() > 0.05


# ---- Derivatives ----


def test_derivatives_are_those_of_finite_differences():
    judged = 0
    for seed in range(60):
        ours, _, motion, start = drawn(seed, (0.05, 0.4))
        found = rocking.simulate(ours, motion, initial_rotation=start, duration=motion.end)
        late = found.peak_time > found.impacts["time"][0] if len(found.impacts) else False
        if found.overturned or found.ambiguous or not late or not found.peak_time < 0.99 * motion.end:
            continue
        peaks = [
            rocking.simulate(ours, motion * f, initial_rotation=start, duration=motion.end).peak_rotation
            for f in (1.0 - 1e-6, 1.0 + 1e-6)
        ]
        slope = (peaks[1] - peaks[0]) / 2e-6
        assert found.sensitivity.peak["motion"][0] == pytest.approx(slope, rel=2e-4, abs=1e-8), seed
        judged += 1
    assert judged >= 10


def test_maps_of_a_restitution_that_falls_have_the_derivatives_of_finite_differences():
    body = RestrainedBlock(Block.from_parameters(1.0, 0.2), restitution=FallingRestitution(0.9, 1.0, least=0.5))
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
        (lambda: FallingRestitution(1.2, 0.1, 0.8), "largest must be in"),
        (lambda: FallingRestitution(0.9, -0.1, 0.8), "slope must be finite and at least 0, in s/rad, not -0.1"),
        (
            lambda: FallingRestitution(0.9, (0.1, math.inf), 0.8),
            "slope must be finite and at least 0, in s/rad, not inf",
        ),
        (lambda: FallingRestitution(0.9, 0.1, 0.95), "least must be above 0 and at most largest, 0.9"),
        (lambda: FallingRestitution(0.9, 0.1, 0.0), "least must be above 0"),
        (lambda: FallingRestitution("high", 0.1, 0.8), "largest must be a number"),
        (lambda: RandomRestitution(0.95, 0.9, 1), "least must be above 0 and at most largest"),
        (lambda: RandomRestitution(0.9, 1.1, 1), "largest must be in"),
        (lambda: RandomRestitution((0.9, 0.5), (0.95, 0.4), 1), "least must be above 0 and at most largest, 0.4"),
        (lambda: RandomRestitution(0.9, math.nan, 1), "largest must be in"),
        (lambda: RandomRestitution(0.9, 0.95, 1.5), "seed must be a whole number"),
        (lambda: RandomRestitution(0.9, 0.95, -1), "seed must be a whole number"),
        (lambda: Block(width=0.4, height=2.0, restitution=RandomRestitution(0.9, 0.95, 1)), "a law goes to Restrained"),
        (lambda: impact_restitution(), "either alpha of a rectangular block, or"),
        (lambda: impact_restitution(0.2, height=1.0), "either alpha of a rectangular block, or"),
        (lambda: impact_restitution(0.2, contact=1.5), "contact must be"),
        (lambda: impact_restitution(0.2, points=1), "points must be a whole number"),
        (lambda: impact_restitution(0.2, contact=0.5, points=3), "either a contact or points"),
        (lambda: impact_restitution(1.2), "too stocky"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(make, says):
    with pytest.raises(InvalidBlock, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("given", [(0.95, 0.9), (0.9, 1.1), ((0.9, 0.5), (0.95, 0.4))])
def test_an_error_keeps_the_bound_that_is_wrong(given):
    with pytest.raises(InvalidBlock) as refused:
        RandomRestitution(*given, 1)
    assert refused.value.value == given[["least", "largest"].index(refused.value.argument)]


def test_what_needs_the_same_factor_each_time_refuses_a_law():
    shaking = rocking.pulses.sine(6.0, 0.8, cycles=1)
    random = RestrainedBlock(COLUMN, restitution=RandomRestitution(0.9, 0.95, 1))
    with pytest.raises(InvalidOption, match="draws its restitution at each impact"):
        dynamics.stroboscopic_map(random, shaking)


@pytest.mark.parametrize("alpha", ["a", math.nan, 5.0])
def test_a_wall_has_a_slenderness(alpha):
    with pytest.raises(InvalidBlock, match="alpha"):
        one_sided_restitution(alpha)


def test_several_points_below_a_flat_body_leave_nothing():
    with pytest.raises(InvalidBlock, match="too stocky"):
        impact_restitution(distances=(1.0, 5.0), height=0.1, radius_of_gyration=0.1, points=3)
