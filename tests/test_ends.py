"""Every simulation ends soon: with an outcome, marked where it is unfinished, or with one sentence that refuses it."""

import math
from typing import Any

import numpy as np
import pytest

import rocking
from rocking.engine import tasks as engine

MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])
BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
SAMPLES = 1.5 * 0.2 * 9.80665 * np.sin(np.arange(100) * 0.1)
RECORD = rocking.Motion.from_samples(SAMPLES, 0.02)
LIVELY = 1.0 - 1e-12

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


@pytest.fixture
def _of_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "STEP_BUDGET", 10_000)


@pytest.mark.usefixtures("_of_few_steps")
@MODELS
def test_blocks_that_hardly_lose_energy_end(model: str) -> None:
    blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 2), alpha=0.2, restitution=LIVELY)
    with rocking.set_options(threads=2):
        assert rocking.simulate_many(blocks, RECORD, model=model).sizes["block"] == 2
    free = rocking.simulate(rocking.Block.from_parameters(2.0, 0.2, LIVELY), None, model=model, initial_rotation=0.1)
    assert free.unfinished


def peaks_of(blocks: tuple[Any, ...], motion: rocking.Motion, model: str) -> list[float]:
    """Peak rotations; nothing where the blocks are refused."""
    try:
        found = rocking.simulate_many(rocking.Blocks(*blocks), motion, model=model)
    except rocking.RockingError as refused:
        assert "\n" not in str(refused)
        return []
    return found.peak_rotation.values.ravel().tolist()


@pytest.mark.parametrize(
    "parameters",
    [([np.inf], 0.2, 0.9), ([2.0, np.inf], 0.2, 0.9), ([1e200], 0.2, 0.9), ([1e-200], 0.2, 0.9), (2.0, 1e-300, 0.9)],
)
@MODELS
def test_blocks_beyond_all_sense_are_refused_or_right(parameters: tuple[Any, ...], model: str) -> None:
    assert all(0.0 <= peak <= 0.5 * math.pi + 1e-15 for peak in peaks_of(parameters, RECORD, model))


@MODELS
def test_samples_closer_than_any_clock_are_refused_or_right(model: str) -> None:
    """Within 1e-298 s a block does not move; after them it is at rest or as good as."""
    try:
        motion = rocking.Motion.from_samples(SAMPLES, 1e-300)
    except rocking.RockingError:
        return
    assert all(0.0 <= peak <= 1e-100 for peak in peaks_of((2.0, 0.2, 0.9), motion, model))


SPEEDS = [3e5, -3e5, 1e6, -1e6, 1e8, 1e12, -1e12, 1e17, -1e17, 1e20, -1e20, 1e100, 1e300, -1e300]


@MODELS
@pytest.mark.parametrize("rotation", [0.0, 0.1])
def test_a_block_thrown_over_falls_in_no_time_or_is_refused(model: str, rotation: float) -> None:
    """At such a speed gravity plays no part: the block goes straight to pi/2, from 0.1 rad maybe through an impact."""
    fallen = 0
    for velocity in SPEEDS:
        try:
            thrown = rocking.simulate(BLOCK, None, model=model, initial_rotation=rotation, initial_velocity=velocity)
        except rocking.errors.OptionError:
            continue
        way = 0.5 * math.pi - math.copysign(rotation, velocity)
        if velocity < 0.0 and rotation > 0.0:
            # The impact comes first, and takes a tenth of the speed.
            way = rotation + 0.5 * math.pi / 0.9
        assert thrown.overturned and not thrown.unfinished
        assert thrown.overturn_time == pytest.approx(way / abs(velocity), rel=1e-9)
        fallen += 1
    assert fallen == 4
