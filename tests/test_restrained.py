"""Blocks that are held back, lean or rock one way; `test_standing.py` compares them with forces on points."""

import math
from collections import Counter

import numpy as np
import pytest
from oracles.standing import OF_ENSEMBLES, case, drawn

import rocking
from rocking import Block, Damper, Load, RestrainedBlock, Spring, Tendon, Thrust
from rocking.errors import BlockError


def of_restraints(body, j, u):
    """Acceleration that restraints give a body at rest at a rotation: without the block's own weight and push."""
    return -body.moment(j, u, 0.0, 0.0, -body.gravity) / body.inertia(j)


@pytest.mark.parametrize(
    "kind", ["prestress at the toe", "elastic tendon", "spring and damper", "thrust, load and lean"]
)
def test_the_linear_model_is_the_equation_to_first_order(kind):
    _, body, *_ = case(kind, 1, 2)
    body.damper = 0.0
    restraints = [Tendon(*each) for each in body.tendons] + [Thrust(*each) for each in body.thrusts]
    restraints += [Load(*each, moves_with_block=False) for each in body.loads]
    restraints += [Spring(body.spring)] if body.spring > 0.0 else []
    block = Block.from_pivots(body.distances, body.height, body.gyration, mass=body.mass, gravity=9.81, restitution=0.8)
    ours = RestrainedBlock(block, *restraints, lean=body.lean)
    found = rocking.simulate(ours, None, model="linear", initial_rotation=1e-3, duration=1e-3)
    u, v, acceleration = found.states(0.0)
    h, side = 1e-4, ours.block.sides[0]
    at_zero = of_restraints(body, 0, 0.0)
    slope = (4.0 * of_restraints(body, 0, h) - of_restraints(body, 0, 2.0 * h) - 3.0 * at_zero) / (2.0 * h)
    own = side.p**2 * (side.alpha - 1e-3)
    assert acceleration == pytest.approx(-own - at_zero - slope * 1e-3, rel=1e-6)
    assert (u, v) == (1e-3, 0.0)


def test_derivatives_are_those_of_finite_differences():
    judged = Counter()
    for seed in range(30):
        ours, motion, start = drawn(seed)
        found = rocking.simulate(ours, motion, initial_rotation=start, duration=motion.end)
        if found.overturned or found.ambiguous or not 0.0 < found.peak_time < 0.99 * motion.end:
            continue
        for name in ("motion", "initial_rotation"):
            peaks = []
            for factor in (1.0 - 1e-6, 1.0 + 1e-6):
                shaken = motion * factor if name == "motion" else motion
                from_there = start * factor if name != "motion" else start
                again = rocking.simulate(ours, shaken, initial_rotation=from_there, duration=motion.end)
                peaks.append(again.peak_rotation)
            slope = (peaks[1] - peaks[0]) / 2e-6
            assert found.sensitivity.peak[name][0] == pytest.approx(slope, rel=2e-4, abs=1e-8), (seed, name)
            judged[seed % 10] += 1
    assert judged.total() >= 20 and len(judged) >= 7


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("kind", OF_ENSEMBLES)
def test_rest_is_proven_where_impacts_accumulate(kind, model):
    """In a wide bracket, which holds a rest without a proof and the narrow bracket."""
    judged = 0
    for number in range(4):
        ours, _, motion, _, start = case(kind, 4, number)
        shaken = motion * (0.6 * min(ours.uplift_thresholds(model)) / motion.pga)
        options = {"initial_rotation": start or 0.05 * min(*ours.balance, 0.5), "model": model}
        wide = rocking.simulate(ours, shaken, chattering=rocking.Certified(1e-4), **options)
        stepped = rocking.simulate(ours, shaken, chattering=rocking.VelocityThreshold(1e-13), **options)
        if wide.overturned or not len(wide.sequences):
            continue
        end = stepped.events["time"][stepped.events["kind"] == "rest"][0]
        first, fine = wide.sequences[0], rocking.simulate(ours, shaken, **options).sequences[0]
        assert first["lower"] - 1e-11 <= end <= first["upper"] + 1e-11, number
        assert first["lower"] <= fine["lower"] <= fine["upper"] <= first["upper"], number
        assert fine["upper"] - fine["lower"] <= 1e-10
        judged += 1
    assert judged >= 2


def test_maps_take_restraints_but_no_tendon_that_yields():
    column = Block(width=0.5, height=3.0, mass=4000.0)
    sine = rocking.pulses.sine(2.5, 1.5, cycles=1)
    tied = RestrainedBlock(column, Tendon(3e5, prestress=1e3), Damper(2e3))
    strobe = rocking.dynamics.stroboscopic_map(tied, sine)
    start, h = np.array([0.02, 0.1]), 1e-6
    end, change = strobe.derivative(start)
    for k in range(2):
        step = np.eye(2)[k] * h
        assert change[:, k] == pytest.approx((strobe(start + step) - strobe(start - step)) / (2.0 * h), rel=1e-5)
    assert np.all(strobe(start) == end)
    from rocking.dynamics.maps import has_mirror_symmetry

    aside = RestrainedBlock(column, Tendon(3e5, prestress=1e3, offset=0.1))
    assert has_mirror_symmetry(strobe)
    assert not has_mirror_symmetry(rocking.dynamics.stroboscopic_map(aside, sine))
    with pytest.raises(BlockError, match="yielding tendons have internal state"):
        rocking.dynamics.stroboscopic_map(RestrainedBlock(column, Tendon(3e5, strength=1e3)), sine)


def test_what_is_known_in_closed_form():
    column = Block(width=0.5, height=3.0, mass=4000.0)
    free = column.uplift_thresholds()
    stiffness = 3e5
    tied = RestrainedBlock(column, Tendon(stiffness))
    assert tied.uplift_thresholds() == pytest.approx(free, rel=1e-15)
    record = tied.as_bodies().create_kernel_structs("linear", np.zeros((1, 2)))[0]
    own, inertia = column.p**2, 4000.0 * column.radius**2 * 4.0 / 3.0
    rate = own * (1.0 + record["added_weight"]) - own  # Makris and Vassiliou (2015): less stiffness x^2/I
    assert rate == pytest.approx(-stiffness * 0.25**2 / inertia)
    stressed = RestrainedBlock(column, Tendon(0.0, prestress=2e3))
    assert stressed.uplift_thresholds()[0] == pytest.approx(free[0] * (1.0 + 2e3 / (4000.0 * column.gravity)))
    loaded = RestrainedBlock(column, Load(1000.0, height=3.0))
    whole = loaded.block
    x, z = 0.0, (4000.0 * 1.5 + 1000.0 * 3.0) / 5000.0
    inertia = 4000.0 * (0.25**2 + 1.5**2) * 4.0 / 3.0 + 1000.0 * (0.25**2 + 3.0**2)
    assert whole.p == pytest.approx(math.sqrt(5000.0 * column.gravity * math.hypot(0.25, z) / inertia))
    assert whole.alpha == pytest.approx(math.atan2(0.25 - x, z))
    leaning = RestrainedBlock(column, lean=0.02)
    assert [side.alpha for side in leaning.sides] == pytest.approx([column.alpha - 0.02, column.alpha + 0.02])


@pytest.mark.parametrize("lean", [0.0, 0.03])
def test_restraints_stay_where_they_are_on_the_block_when_a_load_that_follows_moves_its_centre_of_mass(lean):
    """Thresholds are what sums of moments about each pivot say, of forces at points from the block's own centre."""
    right, left, up, mass, g = 0.25, 0.3, 1.5, 4e3, 9.80665
    block = Block.from_pivots((right, left), up, 0.9, mass=mass)
    carried, thrust, pressing, tendon = (8e2, 3.0, 0.2), (5e2, 2.0, -0.1), (3e2, 2.8, -0.05), (0.0, 4e3, 0.1)
    body = RestrainedBlock(
        block, Load(*carried), Thrust(*thrust), Load(*pressing, moves_with_block=False), Tendon(*tendon), lean=lean
    )
    for sign, pivot, found in zip((1.0, -1.0), (right, -left), body.uplift_thresholds(), strict=True):

        def arms(across, along, pivot=pivot):
            x, z = across - pivot, along
            return x * math.cos(lean) + z * math.sin(lean), z * math.cos(lean) - x * math.sin(lean)

        holding, height = 0.0, 0.0  # moment that holds the block down, over the sign; what an acceleration lifts by
        for m, z, x in ((mass, up, 0.0), carried):
            holding -= m * g * arms(x, z)[0]
            height += m * arms(x, z)[1]
        holding -= pressing[0] * g * arms(pressing[2], pressing[1])[0]
        holding -= thrust[0] * arms(thrust[2], thrust[1])[1]
        holding += tendon[1] * (pivot - tendon[2])
        assert found == pytest.approx(sign * holding / height, rel=1e-13)
    assert body.compute_tendon_extremes((0.02, 0.0))[0][0] == pytest.approx(2.0 * (right - 0.1) * math.sin(0.01))


def test_a_body_too_stocky_for_angular_momentum_carries_a_load_with_a_restitution_that_is_given():
    stocky = Block(width=2.5, height=1.6, mass=1e3, restitution=0.5)
    assert [side.restitution for side in RestrainedBlock(stocky, Load(50.0, 1.6), restitution=0.4).sides] == [0.4, 0.4]
    with pytest.raises(rocking.errors.BlockError, match=r"too stocky; .*set restitution"):
        RestrainedBlock(stocky, Load(50.0, 1.6))


def test_a_tendon_that_has_yielded_leaves_the_block_free():
    column = Block(width=0.5, height=3.0, mass=4000.0)
    tied = RestrainedBlock(column, Tendon(1e6, strength=1e3))
    pull = rocking.pulses.one_sine(3.0, 1.7)
    found = rocking.simulate(tied, pull, duration=3.0)
    elongation = 2.0 * 0.25 * math.sin(0.5 * found.peak_rotation) - 1e-3
    assert elongation > 0.01
    slack = 2.0 * math.asin(elongation / 0.5)
    free = rocking.simulate(column, None, initial_rotation=0.9 * slack)
    again = rocking.simulate(tied, None, initial_rotation=found.peak_rotation)
    assert again.peak_rotation == pytest.approx(found.peak_rotation)
    below = again.impacts["time"][1:] - again.impacts["time"][0]
    speed = again.impacts["speed_after"][0]
    freely = rocking.simulate(column, None, initial_velocity=-speed)
    assert below[:5] == pytest.approx(freely.impacts["time"][:5])
    assert len(free.impacts) > 5


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Tendon(0.0), "a tendon requires stiffness"),
        (lambda: Tendon(1e5, prestress=-3.0), "prestress of a tendon must be at least 0 N, not -3"),
        (lambda: Tendon(1e5, prestress=5e3, strength=4e3), "must be above its prestress"),
        (lambda: Tendon(0.0, prestress=5e3, strength=6e3), "a yielding tendon requires a stiffness"),
        (lambda: Thrust(0.0, 2.0), "must not be zero"),
        (lambda: RestrainedBlock(0.4), "a free Block is required"),
        # Its moment about the pivot is that of the weight: the quotient is zero to the last bit.
        (lambda: RestrainedBlock(Block(width=0.25, height=1.0, mass=1.0), Thrust(0.25 * 9.80665, 0.5)), " 0 m/s"),
        (
            lambda: RestrainedBlock(
                Block(width=0.4, height=2.0, mass=9.0), Tendon(1e3, strength=9.0), Tendon(1e3, strength=8.0)
            ),
            "one tendon of a block may yield",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(make, says):
    with pytest.raises(BlockError, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("restitution", [0.4, rocking.Restitution(0.4, 0.3, seed=1)])
def test_a_wall_too_stocky_for_angular_momentum_rocks_one_way_with_a_restitution_that_is_given(restitution):
    with pytest.raises(BlockError, match=r"too stocky; .*set restitution to a value in \(0, 1\]"):
        Block.one_sided(width=3.0, height=2.0)
    wall = Block.one_sided(width=3.0, height=2.0, restitution=restitution)
    assert wall.is_one_sided and wall.sides[0].restitution == 0.4 and wall.balance[1] == math.inf
    assert wall.sides[0].alpha == pytest.approx(math.atan(1.5), rel=1e-15)
    for wrong, says in ((1.2, "restitution must be in"), ((0.4, 0.5), "must be a number, not a pair")):
        with pytest.raises(BlockError, match=says):
            Block.one_sided(width=3.0, height=2.0, restitution=wrong)


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize(
    "restraint",
    [
        Tendon(4e5, prestress=2e3, strength=4e3),
        Tendon(2e5, prestress=2e3),
        Spring(2e3),
        Damper(2e3),
        Thrust(5e2, height=1.0),
    ],
    ids=["yielding", "elastic", "spring", "damper", "thrust"],
)
def test_a_body_of_another_size_moves_alike_in_another_time(restraint, factor):
    """A larger one is slower: what shakes it as much more slowly turns it as far."""
    body = RestrainedBlock(Block(width=0.4, height=2.0, mass=2000.0, restitution=0.85), restraint).as_bodies()
    peaks = []
    for bodies, rate in ((body, 1.0), (body.with_p_scaled(np.array([factor])), factor)):
        found = rocking.simulate_many(bodies, [rocking.pulses.one_sine(a, 2.0 * rate) for a in (2.5, 3.5, 9.0)])
        peaks.append([found.peak_rotation.values.ravel(), rate * found.peak_time.values.ravel()])
    np.testing.assert_allclose(peaks[1], peaks[0], rtol=1e-9)
    assert 0.0 < peaks[0][0][0] < 1.0


UNEVEN = Block.from_pivots((0.3, 0.15), 0.9, 0.5, restitution=(0.8, 0.9), mass=400.0)


@pytest.mark.parametrize("chattering", ["certified", "bypass"])
@pytest.mark.parametrize("vertical", [False, True], ids=["horizontal", "vertical"])
@pytest.mark.parametrize("sign", [1.0, -1.0], ids="+-")
@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("block", [Block(width=0.4, height=2.0), UNEVEN], ids=["even", "uneven"])
def test_without_a_restraint_it_is_the_block_bit_for_bit(block, model, sign, vertical, chattering):
    held, options = RestrainedBlock(block), {"model": model, "chattering": chattering}
    motions = [rocking.pulses.sine(sign * a, 1.1, cycles=3) for a in (2.2, 3.0, 4.5, 9.0)]
    if vertical:
        motions = [each.with_vertical(rocking.pulses.sine(3.0, 3.3, cycles=4)) for each in motions]
    assert held.balance == block.balance and held.as_bodies().kind == "blocks"
    assert held.uplift_thresholds(model) == block.uplift_thresholds(model)
    for motion in motions:
        found, expected = (rocking.simulate(each, motion, **options) for each in (held, block))
        for table in ("events", "impacts", "sequences"):
            assert getattr(found, table).tobytes() == getattr(expected, table).tobytes()
        times = np.linspace(0.0, found.duration, 200)
        assert np.array_equal(found.states(times), expected.states(times))
        assert (found.outcome, found.peak_rotation) == (expected.outcome, expected.peak_rotation)
    many = [rocking.simulate_many(each, motions, **options) for each in (held, block)]
    assert many[0].identical(many[1])


def test_blocks_of_all_kinds_are_simulated_together_as_alone():
    blocks = [UNEVEN, RestrainedBlock(UNEVEN, Spring(300.0)), Block.one_sided(width=0.4, height=3.0), UNEVEN]
    motion = rocking.pulses.sine(4.0, 1.3, cycles=2)
    found = rocking.simulate_many(blocks, motion).peak_rotation.values.ravel()
    assert found.tolist() == [rocking.simulate(each, motion).peak_rotation for each in blocks]
    assert len({*found.tolist()}) == 3
    gathered = rocking.Blocks.from_bodies(blocks)
    assert [type(each) for each in gathered] == [Block, RestrainedBlock, RestrainedBlock, Block]
    again = rocking.Blocks(
        gravity=gathered.gravity, **{name: each for name, (each, _) in gathered.parameters().items()}
    )
    limits = np.zeros((4, 2))
    for model in ("nonlinear", "linear"):
        assert np.array_equal(again.create_kernel_structs(model, limits), gathered.create_kernel_structs(model, limits))
    with pytest.raises(
        BlockError, match="blocks have no parameter stif; the terms of restraints are sine_coefficient, cosine_coef"
    ):
        rocking.Blocks(1.0, 0.2, 0.9, stif=3.0)
