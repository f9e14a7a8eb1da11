"""Derivatives of peaks in ensembles: those of single responses, bit for bit."""

import math
from typing import Any

import numpy as np
import pytest
from oracles.standing import drawn

import rocking
from rocking import Blocks, InvalidOption, Motion, simulate, simulate_many

NAMES = ("motion", "p", "alpha", "restitution")


def blocks(count: int, seed: int) -> Blocks:
    rng = np.random.default_rng(seed)
    ranges = {"p": (1.0, 6.0), "alpha": (0.06, 0.4), "restitution": (0.5, 0.95)}
    return Blocks(**{name: rng.uniform(*ends, (count, 2)) for name, ends in ranges.items()})


def record(seed: int, count: int = 60) -> Motion:
    rough = np.convolve(np.random.default_rng(seed).normal(size=count + 2), np.ones(3), mode="valid")
    return Motion.from_samples(3.0 * rough / np.max(np.abs(rough)), 0.05)


def judged(many: Any, motions: list[Motion], levels: list[float], **options: Any) -> dict[str, int]:
    """Compare all derivatives of an ensemble with those of its responses; returns how many there were of each kind."""
    found = simulate_many(many, motions, levels=levels, derivatives=True, **options)
    counts = {"known": 0, "overturned": 0, "still": 0}
    for m, motion in enumerate(motions):
        for s, level in enumerate(levels):
            for k in range(len(many)):
                response = simulate(many[k], motion * level, **options)
                here = found.isel(motion=m, scale=s, block=k)
                changes = np.array([float(here[f"peak_by_{name}"]) for name in NAMES])
                if response.overturned:
                    assert np.all(np.isnan(changes))
                    counts["overturned"] += 1
                    continue
                expected = [response.sensitivity.peak[name][0] for name in NAMES]
                assert changes.tolist() == expected, (m, s, k)
                counts["known" if np.any(changes) else "still"] += 1
    return counts


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_derivatives_in_an_ensemble_are_those_of_its_responses_to_the_bit(model: str) -> None:
    counts = judged(blocks(8, 1), [record(1), record(2)], [0.1, 0.8, 2.0], model=model)
    assert min(counts.values()) >= 3
    assert counts["known"] >= 12


def test_derivatives_of_restrained_blocks_are_those_of_their_responses() -> None:
    bodies = [drawn(seed)[0] for seed in (1, 2, 3, 4)]
    many = rocking.RestrainedBlocks.of(bodies)
    motion = record(6) * (2.0 * min(min(body.uplift_thresholds()) for body in bodies) / 3.0)
    assert judged(many, [motion], [1.0, 2.0])["known"] >= 3


def test_where_rounding_decides_on_a_touch_there_is_no_derivative() -> None:
    lift = Motion.from_samples(np.full(3, -2.0 * 9.80665), 2.0)
    push = Motion.from_points([0.0, 2.2, 2.5, 2.6, 4.0], [0.0, 0.0, -2.0, 0.0, 0.0]).with_vertical(lift)
    block = rocking.Block.from_parameters(p=3.0, alpha=0.2, restitution=0.5)
    found = simulate_many(block, push, duration=3.1, derivatives=True)
    assert not found.overturned.values[0, 0]
    assert math.isnan(found.peak_by_motion.values[0, 0])


def test_a_plain_ensemble_has_no_derivatives_and_the_names_of_others_have_units() -> None:
    plain, with_them = (simulate_many(blocks(3, 1), record(1), derivatives=each) for each in (False, True))
    added = {f"peak_by_{name}" for name in NAMES}
    assert set(with_them.data_vars) - set(plain.data_vars) == added
    assert all(with_them[name].attrs["units"] == "rad" for name in added)
    for name in plain.data_vars:
        assert np.array_equal(plain[name].values, with_them[name].values)
    with pytest.raises(InvalidOption, match="derivatives must be True or False"):
        simulate_many(blocks(3, 1), record(1), derivatives="p")
