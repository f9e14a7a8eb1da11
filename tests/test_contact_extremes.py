"""Until a block tips, no instant asks for more friction, or presses less on the ground, than the response says."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import rocking
from rocking import Block, Motion, Response, simulate
from rocking.response.mechanics import compute_friction_demand

GRAVITY = 9.80665
COUNT, PARTS = 100, 5
_WITHIN = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 258))
"""Shares of a stretch: both ends, more closely near them."""


@cache
def responses(part: int) -> list[tuple[int, Response]]:
    """Records, jumps and steps of the ground; blocks with equal sides and two different ones; both models."""
    found = []
    # Kinds repeat themselves after twelve seeds, which five does not divide: every part has them all.
    for seed in range(part, COUNT, PARTS):
        rng = np.random.default_rng([21, seed])
        count = int(rng.integers(20, 120))
        threshold = 0.2 * GRAVITY
        if seed % 3 == 0:
            samples = np.convolve(rng.normal(size=count + 4), np.ones(5), mode="valid")
            motion = Motion.from_samples(samples * rng.uniform(1.1, 4.0) * threshold / np.abs(samples).max(), 0.02)
        elif seed % 3 == 1:
            coefficients = rng.normal(size=(count, 2)) * (1.0, 50.0)
            coefficients *= rng.uniform(1.1, 3.0) * threshold / np.abs(coefficients[:, 0]).max()
            motion = Motion(0.02 * np.arange(count + 1), coefficients)
        else:
            levels = rng.uniform(-1.0, 1.0, 12) * rng.uniform(1.5, 4.0) * threshold
            motion = Motion(np.concatenate([[0.0], np.cumsum(rng.uniform(0.02, 0.4, 12))]), levels[:, None])
        shape = 2 if seed % 2 else 1
        pairs = [np.resize(rng.uniform(*ends, shape), 2) for ends in ((1.0, 5.0), (0.1, 0.5), (0.4, 0.95))]
        block = Block.from_parameters(*pairs)
        found.append((seed, simulate(block, motion, model=("linear", "nonlinear")[seed // 2 % 2])))
    return found


@cache
def under_vertical_motions() -> list[tuple[int, Response]]:
    """Blocks under white noise while the ground falls, for a part of them faster than they do."""
    found = []
    for seed in range(40):
        rng = np.random.default_rng([22, seed])
        horizontal = Motion.from_samples(rng.normal(size=60) * rng.uniform(0.5, 2.0) * 0.2 * GRAVITY, 0.02)
        times = np.cumsum([0.0, *rng.uniform(0.05, 0.3, 4)])
        vertical = Motion.from_points(times, [0.0, *(rng.uniform(-1.3, 0.5, 3) * GRAVITY), 0.0])
        block = Block.from_parameters(*(rng.uniform(*ends, 2) for ends in ((1.0, 5.0), (0.1, 0.5), (0.4, 0.95))))
        motion = horizontal.with_vertical(vertical)
        found.append((seed, simulate(block, motion, model=("linear", "nonlinear")[seed % 2])))
    return found


@cache
def end(response: Response) -> float:
    """End of what counts: the last time, on a dense grid, at which a block that overturns is within its slenderness."""
    if not response.overturned:
        return response.duration
    times = np.linspace(0.0, response.duration, 400_001)
    theta = response.rotation(times)
    plus, minus = (side.alpha for side in response.block.sides)
    return float(times[np.flatnonzero((theta < plus) & (theta > -minus))[-1]])


@cache
def instants(response: Response) -> NDArray[np.float64]:
    """Densely within every stretch without impact, event or corner of the motion, and just before its end."""
    assert response.motion is not None
    corners = [
        response.solution.trail.nodes["time"],
        response.impacts["time"],
        response.events["time"],
        response.motion.breakpoints,
        [0.0, end(response)],
    ]
    ends = np.unique(np.concatenate(corners))
    ends = ends[(ends >= 0.0) & (ends <= end(response))]
    dense = ends[:-1, None] + _WITHIN * np.diff(ends)[:, None]
    dense[:, -1] = np.nextafter(ends[1:], 0.0)
    return np.unique(np.maximum(dense, ends[:-1, None]))


parts = pytest.mark.parametrize("part", [0, *(pytest.param(k, marks=pytest.mark.thorough) for k in range(1, PARTS))])


@parts
def test_no_instant_presses_less_on_the_ground_than_the_minimum(part: int) -> None:
    wrong = []
    for seed, response in responses(part):
        dense = float(np.min(response.normal_force(instants(response))))
        # The dense look may stop a little short of the extreme, and is never beyond it.
        if not dense - 1e-4 <= response.minimum_normal_force <= dense + 1e-9:
            wrong.append((seed, response.minimum_normal_force, dense))
    assert not wrong, f"{len(wrong)} of {COUNT // PARTS}; (seed, said, found): {wrong[:4]}"


@parts
def test_no_instant_asks_for_more_friction_than_required(part: int) -> None:
    wrong, judged = [], 0
    for seed, response in responses(part):
        if response.minimum_normal_force < 0.05:
            continue
        judged += 1
        dense = float(np.max(response.friction_demand(instants(response))))
        if not dense - 1e-9 <= response.required_friction <= dense * (1.0 + 1e-4):
            wrong.append((seed, response.required_friction, dense))
    assert not wrong, f"{len(wrong)} of {COUNT // PARTS}; (seed, said, found): {wrong[:4]}"
    assert judged >= 16


def test_the_ground_that_lets_go_asks_for_infinite_friction() -> None:
    released = [response for _, response in under_vertical_motions() if response.minimum_normal_force <= 0.0]
    assert len(released) >= 12
    assert all(response.required_friction == np.inf for response in released)


@pytest.mark.parametrize(
    ("radius", "overturned", "force", "friction"),
    [
        (0.25, True, 0.8647, 0.2458),
        (0.5, True, 0.885, 0.249),
        (1.0, False, 0.901, 0.250),
        (2.0, False, 0.909, 0.251),
        (4.0, False, 0.911, 0.251),
    ],
)
def test_forces_are_those_of_an_independent_program(radius, overturned, force, friction):
    """Blocks of slenderness 0.2 under a sine pulse of 0.5 s and 2 g tan(0.2), up to |theta| = slenderness.

    The table of "Under this pulse" in the public repository Numerics-in-Motion/blocks, and two digits more of its run.
    """
    block = Block(half_width=radius * np.sin(0.2), half_height=radius * np.cos(0.2))
    response = simulate(block, rocking.pulses.one_sine(2.0 * GRAVITY * np.tan(0.2), 2.0))
    assert response.overturned == overturned
    # The last digit printed there.
    assert response.minimum_normal_force == pytest.approx(force, abs=5e-5 if radius == 0.25 else 5e-4)
    assert response.required_friction == pytest.approx(friction, abs=5e-5 if radius == 0.25 else 5e-4)


@parts
def test_a_block_tips_where_it_last_passes_its_slenderness(part: int) -> None:
    fallen = [response for _, response in responses(part) if response.overturned]
    assert len(fallen) >= 2
    for response in fallen:
        tipping = response.tipping_time
        plus, minus = (side.alpha for side in response.block.sides)
        theta = float(response.rotation(tipping))
        assert abs(theta) == pytest.approx(plus if theta > 0.0 else minus, rel=1e-12)
        after = np.abs(response.rotation(np.linspace(tipping, response.duration, 20_001)))
        assert np.all(after >= abs(theta) * (1.0 - 1e-12))
        assert tipping <= end(response) + response.duration / 400_000


def test_what_does_not_overturn_does_not_tip_and_what_starts_beyond_its_slenderness_has_tipped() -> None:
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    assert np.isnan(simulate(block, None, initial_rotation=0.19).tipping_time)
    beyond = simulate(block, None, initial_rotation=-0.25)
    assert beyond.overturned
    assert beyond.tipping_time == 0.0
    assert beyond.required_friction == float(beyond.friction_demand(0.0))
    assert beyond.minimum_normal_force == float(beyond.normal_force(0.0))


@parts
def test_a_block_slides_first_where_a_dense_look_finds_it(part: int) -> None:
    rng = np.random.default_rng(part)
    for seed, response in responses(part):
        times = instants(response)
        demand = response.friction_demand(times)
        most = response.required_friction
        friction = float(rng.uniform(0.1, 0.99)) * min(most, 1.0)
        found = response.sliding_time(friction)
        over = np.flatnonzero(demand > friction)
        first = float(times[over[0]])
        assert found <= first, seed
        # Before it, nothing that a dense look would see.
        assert found >= (times[over[0] - 1] if over[0] else 0.0), seed
        assert np.isnan(response.sliding_time(most * (1.0 + 1e-9))) or most == np.inf, seed


@pytest.mark.parametrize("share", [0.998, 0.9999, 0.999999])
def test_a_level_between_the_highest_sample_of_a_step_and_its_peak_is_passed(share: float) -> None:
    """A block at rest under a push c t^2 (1 - t): the friction that sticking needs is |a|/g, 4c/27g at two thirds."""
    size = 0.2 * GRAVITY * 27.0 / 4.0
    response = simulate(Block.from_parameters(p=2.0, alpha=0.4), Motion([0.0, 1.0], [[0.0, 0.0, size, -size]]))
    level = share * 0.2
    assert response.required_friction == pytest.approx(0.2, rel=1e-12)
    passing = np.roots([-1.0, 1.0, 0.0, -share * 4.0 / 27.0])
    assert response.sliding_time(level) == pytest.approx(np.sort(passing.real)[1], rel=1e-9)
    assert np.isnan(response.sliding_time(0.2 * (1.0 + 1e-9)))


def test_friction_is_sought_in_every_step_where_the_ground_hardly_presses() -> None:
    """At rest it is |a|/(g + v): it has a peak in each of 150 cycles of v that come near -g."""
    block, share = Block.from_parameters(p=2.0, alpha=0.26), 2.7e-4
    lift = rocking.pulses.sine((1.0 - share) * GRAVITY, 4.0, cycles=150, phase=3.6)
    motion = rocking.pulses.sine(0.07 * share * GRAVITY, 4.8, cycles=150, phase=0.4).with_vertical(lift)
    response = simulate(block, motion, duration=motion.end)
    assert not len(response.impacts)
    lowest = (np.arange(150) + 0.75 - 3.6 / (2.0 * np.pi)) / 4.0
    near = (lowest[lowest > 0.1, None] + np.linspace(-0.01, 0.01, 4001)).ravel()
    seen = compute_friction_demand(motion.acceleration(near) / GRAVITY, 1.0 + lift.acceleration(near) / GRAVITY).max()
    assert seen * (1.0 - 1e-9) <= response.required_friction <= seen * (1.0 + 1e-5)
    assert np.isnan(response.sliding_time(response.required_friction))
    assert response.sliding_time(response.required_friction * (1.0 - 1e-6)) > 0.0


@parts
def test_a_base_lifts_off_where_the_normal_force_ends(part: int) -> None:
    judged = 0
    for seed, response in [*responses(part), *under_vertical_motions()]:
        found = response.lift_off_time
        assert np.isnan(found) == (response.minimum_normal_force > 0.0), seed
        if not np.isnan(found):
            judged += 1
            times = instants(response)
            gone = times[response.normal_force(times) <= 0.0]
            assert found <= gone[0] if len(gone) else found <= end(response), seed
            assert np.all(response.normal_force(times[times < found]) > 0.0), seed
    assert judged >= 12


@pytest.mark.parametrize("friction", [0.0, -0.3, np.nan, "0.3", True])
def test_a_friction_coefficient_is_a_positive_number(friction) -> None:
    response = simulate(Block(half_width=0.2, half_height=1.0), None, initial_rotation=0.1)
    with pytest.raises(rocking.errors.OptionError, match="friction must be a positive number"):
        response.sliding_time(friction)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_the_impacts_that_a_proof_sums_push_and_pull_as_those_that_are_followed(model: str) -> None:
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.5)
    summed, followed = (
        rocking.simulate(block, None, model=model, initial_rotation=0.1, chattering=how)
        for how in (rocking.Certified(), rocking.VelocityThreshold(1e-9))
    )
    times = followed.impacts["time"][len(summed.impacts) :]
    assert len(times) > 15
    between = 0.5 * (times[:-1] + times[1:])[:8]
    assert np.all(between < summed.events["time"][-1])
    assert np.all(followed.normal_force(between) < 0.98)  # 1 at rest
    np.testing.assert_allclose(summed.normal_force(between), followed.normal_force(between), rtol=1e-12)
    np.testing.assert_allclose(summed.friction_demand(between), followed.friction_demand(between), rtol=1e-12)


@pytest.mark.parametrize("ratio", [0.0, 0.5, 2.0, 20.0])
def test_forces_under_a_frame_are_those_of_its_columns_and_its_beam(ratio: float) -> None:
    """By Newton's law mass by mass: columns move with their centres, the beam twice as far."""
    frame = Block.from_frame(half_width=0.5, half_height=3.0, mass_ratio=ratio)
    motion = rocking.pulses.one_sine(3.0, 1.0)
    response = simulate(frame, motion)
    radius, g = float(np.hypot(0.5, 3.0)), frame.gravity
    times = np.linspace(0.55, 0.95, 41)
    theta, rate, acceleration = response.states(times).T
    assert np.all(theta != 0.0)
    side, angle = np.sign(theta), frame.alpha - np.abs(theta)
    across = side * (np.cos(angle) * side * acceleration + np.sin(angle) * rate**2)
    up = np.sin(angle) * side * acceleration - np.cos(angle) * rate**2
    horizontal = (1.0 + ratio) * motion.acceleration(times) + (1.0 + 2.0 * ratio) * radius * across
    vertical = (1.0 + ratio) * g + (1.0 + 2.0 * ratio) * radius * up
    np.testing.assert_allclose(response.friction_demand(times), np.abs(horizontal) / vertical, rtol=1e-11)
    np.testing.assert_allclose(response.normal_force(times), vertical / ((1.0 + ratio) * g), rtol=1e-11)
