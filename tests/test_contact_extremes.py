"""No instant of a response asks for more friction, or presses less on the ground, than the response says."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import rocking
from rocking import Block, Motion, Response, simulate

GRAVITY = 9.80665
COUNT = 100
_WITHIN = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 258))
"""Shares of a stretch: both ends, more closely near them."""


@cache
def responses() -> list[tuple[int, Response]]:
    """Records, jumps and steps of the ground; blocks with equal sides and two different ones; both models."""
    found = []
    for seed in range(COUNT):
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


def instants(response: Response) -> NDArray[np.float64]:
    """Densely within every stretch without impact, event or corner of the motion, and just before its end."""
    assert response.motion is not None
    corners = [
        response.trail.nodes["time"],
        response.impacts["time"],
        response.events["time"],
        response.motion.breakpoints,
        [0.0, response.duration],
    ]
    ends = np.unique(np.concatenate(corners))
    ends = ends[(ends >= 0.0) & (ends <= response.duration)]
    dense = ends[:-1, None] + _WITHIN * np.diff(ends)[:, None]
    dense[:, -1] = np.nextafter(ends[1:], 0.0)
    return np.unique(np.maximum(dense, ends[:-1, None]))


def between(one: float, other: float, tolerance: float) -> bool:
    return one == other or abs(one - other) <= tolerance


@pytest.mark.parametrize("part", range(4))
def test_no_instant_presses_less_on_the_ground_than_the_minimum(part: int) -> None:
    wrong = []
    for seed, response in responses()[part::4]:
        dense = float(np.min(response.normal_force(instants(response))))
        # The dense look may stop a little short of the extreme, and is never beyond it.
        if not dense - 1e-4 <= response.minimum_normal_force <= dense + 1e-9:
            wrong.append((seed, response.minimum_normal_force, dense))
    assert not wrong, f"{len(wrong)} of {COUNT // 4}; (seed, said, found): {wrong[:4]}"


@pytest.mark.parametrize("part", range(4))
def test_no_instant_asks_for_more_friction_than_required(part: int) -> None:
    wrong = []
    for seed, response in responses()[part::4]:
        if response.minimum_normal_force < 0.05:
            continue
        dense = float(np.max(response.friction_demand(instants(response))))
        if not dense - 1e-9 <= response.required_friction <= dense * (1.0 + 1e-4):
            wrong.append((seed, response.required_friction, dense))
    assert not wrong, f"{len(wrong)} of {COUNT // 4}; (seed, said, found): {wrong[:4]}"


def test_the_ground_that_lets_go_asks_for_infinite_friction() -> None:
    for _, response in responses():
        if response.minimum_normal_force <= 0.0:
            assert response.required_friction == np.inf


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_jump_of_the_ground_counts_from_both_sides(model: str) -> None:
    """While the block leans, the ground's acceleration drops: the worst is just before the drop."""
    block = Block.from_parameters(p=2.0, alpha=0.3, restitution=0.9)
    motion = Motion([0.0, 0.3, 0.31], [[0.5 * GRAVITY, 4.0 * GRAVITY], [0.0, 0.0]])
    response = simulate(block, motion, model=model)
    before = float(np.nextafter(0.3, 0.0))
    assert response.required_friction >= float(response.friction_demand(before)) - 1e-12
    assert response.required_friction >= float(response.friction_demand(0.3))
    assert response.minimum_normal_force <= min(float(response.normal_force(t)) for t in (before, 0.3)) + 1e-12


def test_free_rocking_has_its_extremes_right_after_and_before_impacts() -> None:
    block = Block.from_parameters(p=(2.0, 3.0), alpha=(0.3, 0.2), restitution=0.9)
    response = rocking.simulate(block, None, initial_rotation=0.25)
    struck = response.impacts["time"][:20]
    times = np.concatenate([struck, np.nextafter(struck, 0.0), np.linspace(0.0, response.duration, 40_001)])
    assert response.required_friction >= float(np.max(response.friction_demand(times))) - 1e-9
    assert response.minimum_normal_force <= float(np.min(response.normal_force(times))) + 1e-9
