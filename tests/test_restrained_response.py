"""What responses of walls and of blocks with restraints tell: tendons, forces of the ground, summary, figure."""

import math

import numpy as np
import pytest

import rocking
from rocking import Block, Damper, Load, RestrainedBlock, Spring, Tendon, Thrust
from rocking.response.history import compute_plastic_elongations

MASS, G = 4e3, 9.80665
COLUMN = Block.from_pivots((0.25, 0.3), 1.5, 0.9, mass=MASS, restitution=0.85)
SYMMETRIC = Block(width=0.4, height=2.0, mass=2e3)
PUSH = rocking.pulses.sine(3.0, 1.1, cycles=2).with_vertical(rocking.pulses.sine(2.0, 3.0, cycles=3))


def body_of(which, lean=0.0):
    restraints = {
        "tendon": [Tendon(2e5, prestress=4e3, offset=0.05)],
        "thrust": [Thrust(3e2, height=2.0, offset=0.1)],
        "load": [Load(3e2, height=3.0, offset=-0.05, moves_with_block=False)],
        "couples": [Spring(1e3), Damper(4e2)],
    }
    chosen = [each for name, some in restraints.items() for each in some if which in (name, "all")]
    return RestrainedBlock(COLUMN, *chosen, lean=lean)


def moment_of(force, arm):
    """Clockwise moment of a force."""
    return arm[1] * force[0] - arm[0] * force[1]


@pytest.mark.parametrize("lean", [0.0, 0.02])
@pytest.mark.parametrize("which", ["tendon", "thrust", "load", "couples", "all"])
def test_forces_of_the_ground_and_of_restraints_turn_the_block_about_its_centre_of_mass(which, lean):
    """Forces come from how the centre of mass moves; here is what they do to the rotation, which they do not know."""
    body = body_of(which, lean)
    response = rocking.simulate(body, PUSH)
    times = np.linspace(0.0, min(response.duration, 3.0), 500)
    theta, rate, acceleration = response.states(times).T
    vertical = response.normal_force(times)
    ground = PUSH.acceleration(times) / G, PUSH.vertical.acceleration(times) / G
    side = np.where(theta > 0, 0, np.where(theta < 0, 1, -1))
    horizontal = body.contact_law((theta, rate, acceleration), ground, side, np.zeros(len(times)))[0]
    judged = 0
    for k in np.flatnonzero(theta != 0.0):
        turned = theta[k] + lean
        c, s = math.cos(turned), math.sin(turned)
        turn = np.array([[c, s], [-s, c]])  # clockwise: to side +
        pivot = np.array([0.25 if theta[k] > 0.0 else -0.3, 0.0])
        centre = turn @ (np.array([0.0, 1.5]) - pivot)
        total = moment_of(MASS * G * np.array([horizontal[k], vertical[k]]), -centre)
        if which in ("thrust", "all"):
            total += moment_of(np.array([3e2, 0.0]), turn @ (np.array([0.1, 2.0]) - pivot) - centre)
        if which in ("load", "all"):
            total += moment_of(np.array([0.0, -3e2 * G]), turn @ (np.array([-0.05, 3.0]) - pivot) - centre)
        if which in ("tendon", "all"):
            here = turn @ (np.array([0.05, 0.0]) - pivot)
            standing = np.array([[math.cos(lean), math.sin(lean)], [-math.sin(lean), math.cos(lean)]])
            there = standing @ (np.array([0.05, 0.0]) - pivot)
            length = math.hypot(*(there - here))
            total += moment_of((4e3 + 2e5 * length) * (there - here) / length, here - centre)
        if which in ("couples", "all"):
            total -= 1e3 * theta[k] + 4e2 * rate[k]
        assert total == pytest.approx(MASS * 0.9**2 * acceleration[k], abs=1e-7 * MASS * G)
        judged += 1
    assert judged >= 60
    assert 0.0 < response.minimum_normal_force < 2.0
    assert response.required_friction > 0.1


def test_a_block_that_restraints_hold_at_rest_presses_on_the_ground_with_all_their_forces():
    body = RestrainedBlock(
        COLUMN, Tendon(2e5, prestress=4e3), Thrust(3e2, height=1.0), Load(3e2, 2.0, moves_with_block=False)
    )
    response = rocking.simulate(body, rocking.pulses.one_sine(0.1, 1.0))
    assert len(response.events) == 0
    assert response.normal_force(0.0) == pytest.approx(1.0 + (4e3 + 3e2 * G) / (MASS * G))
    assert response.friction_demand(0.0) == pytest.approx(3e2 / (MASS * G + 4e3 + 3e2 * G))


@pytest.mark.parametrize("strength", [math.inf, 5e3])
def test_tendons_are_stretched_as_the_rotations_of_both_sides_stretch_them(strength):
    tendons = Tendon(3e5, prestress=4e3, offset=0.15, strength=strength), Tendon(1e5, offset=-0.2)
    body = RestrainedBlock(COLUMN, *tendons)
    response = rocking.simulate(body, rocking.pulses.sine(3.4, 1.1, cycles=2))
    assert not response.overturned
    theta = response.rotation(np.linspace(0.0, response.duration, 20001))
    found = response.tendons
    for tendon, row in zip(tendons, found, strict=True):
        distances = np.where(theta > 0.0, 0.25 - tendon.offset, 0.3 + tendon.offset)
        elongation = np.max(2.0 * distances * np.sin(0.5 * np.abs(theta)))
        assert row["elongation"] == pytest.approx(elongation, rel=1e-5)
        force = tendon.prestress + tendon.stiffness * row["elongation"]
        assert row["force"] == pytest.approx(min(force, tendon.strength))
        assert row["plastic_elongation"] == pytest.approx(max(0.0, force - tendon.strength) / tendon.stiffness)
    assert (found["plastic_elongation"][0] > 1e-3) == (strength < math.inf)
    # On the other side of its toe the second one is stretched less by the larger rotation.
    assert response.to_dict()["tendons"][1]["force_N"] == found["force"][1]


@pytest.mark.parametrize(
    ("samples", "step", "start"),
    [((-12.0, 30.0), 0.3, (0.0, 0.0)), ((-4.0, 20.0), 0.1, (0.0, 0.0)), ((-12.0, 30.0), 0.3, (4e-3, -0.02))],
    ids=["high", "low", "inwards first"],
)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_tendon_is_stretched_where_the_block_rises_and_turns_within_one_step(model, samples, step, start):
    tied = RestrainedBlock(SYMMETRIC, Tendon(2e5), one_sided=True, restitution=0.1)
    motion, (rotation, velocity) = rocking.Motion.from_samples(samples, step), start
    response = rocking.simulate(tied, motion, model=model, initial_rotation=rotation, initial_velocity=velocity)
    peak = response.peak_rotation
    assert peak > 1.1 * rotation
    opening = 0.2 * (peak if model == "linear" else 2.0 * math.sin(0.5 * peak))
    (row,) = response.tendons
    assert row["elongation"] == pytest.approx(opening, rel=1e-12)
    assert row["force"] == pytest.approx(2e5 * opening, rel=1e-12)


def test_a_tendon_yields_in_the_linear_model_where_its_response_says_so():
    tendon = Tendon(3e5, prestress=4e3, strength=5e3)
    response = rocking.simulate(RestrainedBlock(COLUMN, tendon), PUSH, model="linear")
    elongation = max(0.25 * response.rotation(response.peak_time), -0.3 * response.rotation(response.peak_time))
    (row,) = response.tendons
    assert row["elongation"] == pytest.approx(elongation, rel=1e-12)
    assert row["plastic_elongation"] == pytest.approx(elongation - 1e3 / 3e5, rel=1e-9)
    assert row["plastic_elongation"] == pytest.approx(
        compute_plastic_elongations(response.solution.trail)[-1], rel=1e-9
    )


def balance_about_the_centre(body, response, tension):
    """Judge the forces of the ground by the rotation, which they do not know; returns times and forces."""
    times = np.linspace(0.0, min(response.duration, 4.0), 4000)
    theta, _, acceleration = response.states(times).T
    horizontal, vertical = response._contact.compute_forces(times)
    pulls = tension(theta)
    thrusts = [each for each in body.restraints if isinstance(each, Thrust)]
    (tendon,) = [each for each in body.restraints if isinstance(each, Tendon)] or [None]
    c, s = math.cos(body.lean), math.sin(body.lean)
    standing, judged = np.array([[c, s], [-s, c]]), 0
    for k in np.flatnonzero(theta != 0.0)[::5]:
        c, s = math.cos(theta[k] + body.lean), math.sin(theta[k] + body.lean)
        turn = np.array([[c, s], [-s, c]])
        pivot = np.array([0.25 if theta[k] > 0.0 else -0.3, 0.0])
        centre = turn @ (np.array([0.0, 1.5]) - pivot)
        total = moment_of(MASS * G * np.array([horizontal[k], vertical[k]]), -centre)
        for each in thrusts:
            total += moment_of(
                np.array([each.force, 0.0]), turn @ (np.array([each.offset, each.height]) - pivot) - centre
            )
        if tendon is not None:
            here, there = (by @ (np.array([tendon.offset, 0.0]) - pivot) for by in (turn, standing))
            total += moment_of(pulls[k] * (there - here) / math.hypot(*(there - here)), here - centre)
        assert total == pytest.approx(MASS * 0.9**2 * acceleration[k], abs=1e-7 * MASS * G), k
        judged += 1
    assert judged >= 60
    assert response.minimum_normal_force <= np.min(vertical) + 1e-9
    return times, horizontal, vertical


@pytest.mark.parametrize(
    ("scale", "lean", "offset", "prestress"), [(1.2, 0.0, 0.05, 0.0), (1.2, 0.02, -0.1, 2e3), (0.7, 0.0, 0.05, 3e3)]
)
def test_a_tendon_that_yields_pulls_on_the_ground_as_far_as_it_was_stretched(scale, lean, offset, prestress):
    tendon = Tendon(4e5, prestress=prestress, offset=offset, strength=9e3)
    body = RestrainedBlock(COLUMN, tendon, lean=lean)
    push = PUSH * scale
    motion = push.with_vertical(push.vertical + push.vertical.delayed(10.0))
    response = rocking.simulate(body, motion)
    fine = response.rotation(np.linspace(0.0, min(response.duration, 4.0), 400_000))

    def tension(theta):
        """From the largest elongation so far, by the widths of the pivots: no state of the program's."""

        def longer(at):
            return 2.0 * np.where(at > 0.0, 0.25 - offset, 0.3 + offset) * np.sin(0.5 * np.abs(at))

        plastic = np.maximum.accumulate(np.maximum(longer(fine) - (9e3 - prestress) / 4e5, 0.0))
        so_far = plastic[np.linspace(0, len(fine) - 1, len(theta)).astype(int)]
        assert so_far[-1] > 1e-3
        return np.clip(prestress + 4e5 * (longer(theta) - so_far), 0.0, 9e3)

    # Between two looks at the largest elongation it may have grown by 1e-7 m.
    balance_about_the_centre(body, response, tension)
    at_rest = np.linspace(10.0, 11.0, 101)
    assert response.events["kind"][-1] == "rest" and response.events["time"][-1] < at_rest[0]
    vertical = response.normal_force(at_rest)
    left = max(0.0, prestress - 4e5 * response.tendons["plastic_elongation"][0])
    assert (left > 0.0) == (scale == 0.7)
    lift = motion.vertical.acceleration(at_rest)
    assert np.ptp(lift) > 2.0
    np.testing.assert_allclose(vertical, 1.0 + lift / G + left * math.cos(lean) / (MASS * G), rtol=1e-9)


@pytest.mark.parametrize("with_tendon", [False, True])
def test_a_wall_presses_on_the_ground_as_it_rocks_and_what_is_behind_it_helps_at_rest(with_tendon):
    restraints = [Thrust(3e2, height=2.0)] + [Tendon(2e5, prestress=4e3)] * with_tendon
    body = RestrainedBlock(COLUMN, *restraints, one_sided=True, restitution=0.4)
    response = rocking.simulate(body, PUSH)

    def tension(theta):
        return 4e3 + 2e5 * 2.0 * 0.25 * np.sin(0.5 * theta)

    times, horizontal, vertical = balance_about_the_centre(body, response, tension)
    resting = response.rotation(times) == 0.0
    assert resting.sum() > 50
    needed = PUSH.acceleration(times[resting]) / G - 3e2 / (MASS * G)
    np.testing.assert_allclose(horizontal[resting], np.minimum(needed, 0.0), atol=1e-12)
    assert np.any(needed > 0.0) and np.any(needed < 0.0)
    weight = 1.0 + PUSH.vertical.acceleration(times[resting]) / G + 4e3 * with_tendon / (MASS * G)
    np.testing.assert_allclose(vertical[resting], weight, rtol=1e-12)
    assert "friction needed" in response.summary()


@pytest.mark.parametrize(
    ("restraint", "held", "stiffness"),
    [(Spring(6e3), 0.0, 6e3), (Tendon(1e4, prestress=3e3), 3e3 * 0.3, 1e4 * 0.3**2)],
    ids=["spring", "tendon"],
)
def test_a_linear_response_tips_at_the_balance_of_its_own_model(restraint, held, stiffness):
    """There m g R (alpha - u), what a tendon's prestress holds and what restraints add with u are zero together."""
    block = Block(width=0.6, height=2.0, mass=1e3)
    response = rocking.simulate(RestrainedBlock(block, restraint), rocking.pulses.half_sine(14.0, 0.3), model="linear")
    weight = 1e3 * G * block.radius
    balance = (weight * block.alpha + held) / (weight - stiffness)
    assert response.overturned and response.balance == pytest.approx((balance, balance), rel=1e-12)
    tips = response.tipping_time
    assert abs(float(response.rotation(tips))) == pytest.approx(balance, rel=1e-9)
    assert float(response.potential_energy(tips)) == pytest.approx(1.0, rel=1e-9)
    assert f"{balance:.5g} rad" in response.summary() and response.to_dict()["balance_rad"] == [*response.balance]


@pytest.mark.parametrize("amplitude", [2.4, 3.2, 8.0])
def test_the_linear_balance_of_a_tendon_that_yields_is_that_of_its_strength_under_any_motion(amplitude):
    """Beyond yielding m g R (u - alpha) is what its strength holds, whatever it has become during the response."""
    body = RestrainedBlock(SYMMETRIC, Tendon(2e5, prestress=4e3, strength=6e3))
    response = rocking.simulate(body, rocking.pulses.one_sine(amplitude, 1.0), model="linear")
    balance = SYMMETRIC.alpha + 6e3 * 0.2 / (2e3 * G * SYMMETRIC.radius)
    assert response.balance == pytest.approx((balance, balance), rel=1e-12)
    assert response.overturned == (amplitude > 3.0)
    if response.overturned:
        assert abs(response.rotation(response.tipping_time)) == pytest.approx(balance, rel=1e-9)
    else:
        assert response.peak_over_slenderness == pytest.approx(response.peak_rotation / balance, rel=1e-12)


def test_the_linear_balance_comes_before_a_tendon_yields_where_that_takes_a_larger_rotation():
    weight = 2e3 * G * SYMMETRIC.radius
    body = RestrainedBlock(SYMMETRIC, Tendon(1e4, strength=6e3))
    response = rocking.simulate(body, rocking.pulses.one_sine(8.0, 1.0), model="linear")
    balance = weight * SYMMETRIC.alpha / (weight - 1e4 * 0.2**2)
    assert response.overturned and response.balance == pytest.approx((balance, balance), rel=1e-12)


def test_a_block_that_is_held_at_any_rotation_has_no_balance_to_count_by():
    held = RestrainedBlock(COLUMN, Spring(2e5))
    assert held.balance == (math.inf, math.inf)
    response = rocking.simulate(held, PUSH)
    assert "none: restraints hold it at any rotation" in response.summary()
    assert "of the balance" not in response.summary()
    assert "of the balance" not in repr(response)
    figure = response.plot()
    assert figure.axes[0].get_ylabel() == "rotation (rad)"


def test_a_peak_has_no_ratio_to_a_balance_that_is_not_there():
    body = RestrainedBlock(SYMMETRIC, Spring(2e5))
    motion = rocking.pulses.one_sine(4.0, 1.0)
    for each in (motion, motion.scaled(0.1)):
        response = rocking.simulate(body, each)
        assert math.isnan(response.peak_over_slenderness)
        assert response.to_dict()["peak_over_balance"] is None
    found = rocking.survey(body, [motion])
    header, row = found.summary().splitlines()[-2:]
    assert row[: header.index("peak/balance") + len("peak/balance")].split()[-1] == "-"
    assert math.isnan(found.rows()[0]["peak_over_balance"])
    # A wall that rocks one way has one balance, and counts by it at rest, too.
    wall = RestrainedBlock(SYMMETRIC, one_sided=True)
    assert rocking.simulate(wall, motion.scaled(0.1)).peak_over_slenderness == 0.0


@pytest.mark.thorough
@pytest.mark.parametrize("vertical", [False, True])
def test_a_figure_of_a_wall_counts_by_its_balance(vertical):
    wall = RestrainedBlock(Block(width=0.5, height=5.0, mass=6e3), Thrust(8e2, height=4.0), one_sided=True)
    response = rocking.simulate(
        wall, rocking.pulses.one_sine(1.2, 0.8).with_vertical(PUSH.vertical if vertical else None)
    )
    figure = response.plot()
    assert figure.axes[0].get_ylabel().split() == ["rotation", "/", "balance"]
    drawn = figure.axes[0].lines[1].get_ydata()
    assert np.max(drawn) == pytest.approx(response.peak_over_slenderness, rel=1e-3)


@pytest.mark.parametrize("push", [0.0, 0.02, -0.02])
def test_a_thrust_lifts_a_lighter_block_to_the_side_to_which_it_pushes(push):
    block, times = Block(width=0.4, height=2.0, mass=2000.0, restitution=0.7), np.linspace(0.0, 2.0, 41)
    lighter = rocking.Motion.from_samples(-8.0 * np.sin(0.5 * math.pi * times), 0.05)
    found = []
    for sign in (1.0, -1.0):
        sideways = rocking.Motion.from_samples(sign * push * 9.80665 * np.sin(0.5 * math.pi * times), 0.05)
        body = RestrainedBlock(block, Thrust(sign * 2500.0, height=1.0))
        found.append(rocking.simulate(body, sideways.with_vertical(lighter), duration=2.0))
        # The thrust turns the block about its edge, and the weight that is left turns it back.
        assert found[-1].events[0]["side"] == sign
        lift = float(found[-1].events[0]["time"])
        down = 2000.0 * (9.80665 + float(lighter.acceleration(lift)))
        pushed = 2500.0 - sign * 2000.0 * float(sideways.acceleration(lift))
        assert pushed * 1.0 == pytest.approx(down * 0.2, rel=1e-12)  # moments about the edge
    times = np.linspace(0.0, 1.9, 40)
    np.testing.assert_allclose(found[0].rotation(times), -found[1].rotation(times), rtol=0.0, atol=1e-12)
    assert found[0].peak_rotation > 0.1


def test_a_thrust_and_its_mirror_image_do_the_same_to_a_block_that_becomes_lighter():
    rng, judged = np.random.default_rng(2), 0
    for _ in range(60):
        block = Block(width=0.4, height=rng.uniform(1.0, 3.0), mass=2000.0, restitution=rng.uniform(0.3, 0.9))
        force, step, waves = rng.uniform(500.0, 1500.0), 0.05 * rng.uniform(0.3, 1.5), int(rng.integers(1, 4))
        times = np.arange(41) * step
        lighter = rocking.Motion.from_samples(
            -rng.uniform(5.0, 9.5) * np.sin(math.pi * times / times[-1] * waves), step
        )
        still = rocking.Motion.from_samples(np.zeros(41), step).with_vertical(lighter)
        both = [RestrainedBlock(block, Thrust(sign * force, height=1.0)) for sign in (1.0, -1.0)]
        one, other = (rocking.simulate(body, still, duration=times[-1] + 3.0) for body in both)
        assert one.peak_rotation == other.peak_rotation and one.overturned == other.overturned
        assert one.events["side"].tolist() == (-other.events["side"]).tolist()
        judged += len(one.events) > 0
    assert judged > 20


def test_reading_a_response_leaves_the_law_of_its_tendon_alone():
    block = Block(width=0.6, height=3.0, mass=3000.0, restitution=0.8)
    body = RestrainedBlock(block, Tendon(5e6, prestress=5e3, strength=2e4))
    response = rocking.simulate(body, rocking.records.load("ridgecrest-clc-090").scaled(2.0))
    before = response.solution.trail.block.tobytes()
    response.rotation(np.linspace(0.0, 0.5 * response.duration, 500))
    assert np.isfinite(response.sensitivity.peak["motion"][0])
    rocking.gradient(response, "rotation", 0.5 * response.duration)
    assert response.solution.trail.block.tobytes() == before


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("law", [0.8, rocking.Restitution(0.95, 0.5, slope=0.3)], ids=["constant", "falling"])
def test_a_resized_body_has_the_same_rotations_under_a_motion_as_much_slower(model, law):
    """Every parameter has its power of p: the equation in p t is the same."""
    column, rng = Block(width=0.5, height=3.0, mass=4000.0), np.random.default_rng(3)
    rough = 1.5 * np.convolve(rng.normal(size=200), np.ones(4), mode="same")
    restraints = Tendon(3e6, prestress=1e3, strength=2e4), Damper(2e3)
    tied, factor, judged = RestrainedBlock(column, *restraints, restitution=law).as_bodies(), 0.6, 0
    for level in (0.25, 0.5, 1.0):
        here = rocking.simulate_many(tied, rocking.Motion.from_samples(level * rough, 0.02), model=model)
        slower = rocking.Motion.from_samples(level * rough, 0.02 / factor)
        there = rocking.simulate_many(tied.with_p_scaled(np.array([factor])), slower, model=model)
        assert there.peak_rotation.item() == pytest.approx(here.peak_rotation.item(), rel=1e-9)
        judged += not here.overturned.item()
    assert judged >= 2


@pytest.mark.parametrize("seed", [0, 1])
def test_a_restrained_body_draws_a_restitution_at_each_impact_whatever_the_seed(seed):
    column = Block(width=0.5, height=3.0, mass=4000.0)
    tied = RestrainedBlock(column, Tendon(3e6, prestress=1e3), restitution=rocking.Restitution(0.9, 0.6, seed=seed))
    impacts = rocking.simulate(tied, None, initial_rotation=0.05).impacts
    ratios = np.abs(impacts["speed_after"] / impacts["speed_before"])
    assert len(ratios) > 5 and 0.6 <= ratios.min() < 0.7 < 0.8 < ratios.max() <= 0.9
