"""Every simulation ends soon: with an outcome, marked where it is unfinished, or with one sentence that refuses it."""

import json
import math
import os
from collections.abc import Iterator
from typing import Any

import pytest
from oracles import apart

LIMIT = 60.0

MANY = "of_dataset(rocking.simulate_many({}, record, model={!r}, threads=2))"
LIVELY = "rocking.Blocks(p=np.linspace(1.0, 6.0, {}), alpha=0.2, restitution=1.0 - 1e-12)"


PLACE = apart.Place()


@pytest.fixture(scope="module", autouse=True)
def _closed() -> Iterator[None]:
    yield
    PLACE.close()


def ended(expression: str) -> dict[str, Any]:
    """What became of it: outcomes, or why it was refused."""
    found = PLACE.run(expression, limit=LIMIT)
    assert not found.stopped, f"still running after {LIMIT:g} s"
    assert "MemoryError" not in found.errors and "ArrayMemoryError" not in found.errors, found.errors
    assert found.status == 0, found.errors
    outcome: dict[str, Any] = json.loads(found.output)
    return outcome


def numbers(outcome: dict[str, Any]) -> list[float]:
    """Peaks, verdicts and times of an outcome that was neither refused nor left unfinished; else nothing."""
    if "refused" in outcome or outcome["unfinished"] not in (False, [False]):
        return []
    values = outcome["peak_rotation"]
    return values if isinstance(values, list) else [values]


def within(budget: int | None, expression: str) -> str:
    """Have an expression evaluated with so many steps for each simulation, where a number is given."""
    limited = f"__import__('unittest.mock').mock.patch('rocking.engine.BUDGET', {budget})(lambda: {expression})()"
    return expression if budget is None else limited


BUDGETS = pytest.mark.parametrize("budget", [pytest.param(None, marks=pytest.mark.slow), 10_000])


@pytest.mark.thorough
@BUDGETS
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_an_ensemble_of_blocks_that_hardly_lose_energy_ends(model: str, budget: int | None) -> None:
    ended(within(budget, MANY.format(LIVELY.format(2), model)))


@pytest.mark.thorough
@BUDGETS
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_free_rocking_of_a_block_that_hardly_loses_energy_ends(model: str, budget: int | None) -> None:
    lively = "rocking.Block.from_parameters(2.0, 0.2, 1.0 - 1e-12)"
    outcome = ended(
        within(budget, f"of_response(rocking.simulate({lively}, None, model={model!r}, initial_rotation=0.1))")
    )
    assert outcome["unfinished"]


@pytest.mark.parametrize(
    "parameters",
    ["[np.inf], 0.2, 0.9", "[2.0, np.inf], 0.2, 0.9", "[1e200], 0.2, 0.9", "[1e-200], 0.2, 0.9", "2.0, 1e-300, 0.9"],
)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_blocks_beyond_all_sense_are_refused_or_right(parameters: str, model: str) -> None:
    outcome = ended(f"of_dataset(rocking.simulate_many(rocking.Blocks({parameters}), record, model={model!r}))")
    assert "refused" in outcome or numbers(outcome), outcome
    # A bound that holds for what is left: a block that does not overturn stays below pi/2, and has a number for it.
    assert all(0.0 <= peak <= 1.5707963267948968 for peak in numbers(outcome)), outcome


@pytest.mark.parametrize("p", ["1e200", "1e-200"])
def test_a_block_beyond_all_sense_is_refused_or_right(p: str) -> None:
    outcome = ended(f"of_response(rocking.simulate(rocking.Block.from_parameters({p}, 0.2, 0.9), record))")
    assert "refused" in outcome or numbers(outcome), outcome
    assert all(0.0 <= peak <= 1.5707963267948968 for peak in numbers(outcome)), outcome


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_samples_closer_than_any_clock_are_refused_or_right(model: str) -> None:
    """Within 1e-298 s a block does not move; after them it is at rest or as good as."""
    motion = "rocking.Motion.from_samples(samples, 1e-300)"
    outcome = ended(f"of_dataset(rocking.simulate_many(block, {motion}, model={model!r}))")
    assert "refused" in outcome or numbers(outcome), outcome
    assert all(0.0 <= peak <= 1e-100 for peak in numbers(outcome)), outcome


SPEEDS = [3e5, -3e5, 1e6, -1e6, 1e8, 1e12, -1e12, 1e17, -1e17, 1e20, -1e20, 1e100, 1e300, -1e300]


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("rotation", [0.0, 0.1])
def test_a_block_thrown_over_falls_in_no_time_or_is_refused(model: str, rotation: float) -> None:
    """At such a speed gravity plays no part: the block goes straight to pi/2, from 0.1 rad maybe through an impact."""
    thrown = f"simulate(block, None, model={model!r}, initial_rotation={rotation!r}, initial_velocity=v)"
    outcomes: Any = ended(f"[attempt(lambda: of_response(rocking.{thrown})) for v in {SPEEDS!r}]")
    wrong, fallen = {}, 0
    for velocity, outcome in zip(SPEEDS, outcomes, strict=True):
        if "refused" in outcome:
            assert outcome["refused"].startswith("InvalidOption")
            continue
        fallen += 1
        way = 0.5 * math.pi - math.copysign(rotation, velocity)
        if velocity < 0.0 and rotation > 0.0:
            # The impact comes first, and takes a tenth of the speed.
            way = rotation + 0.5 * math.pi / 0.9
        expected = pytest.approx(way / abs(velocity), rel=1e-9)
        if outcome["unfinished"] or not outcome["overturned"] or outcome["overturn_time"] != expected:
            wrong[velocity] = outcome
    assert not wrong, wrong
    assert fallen == 4


# Last: each ends the process in which the others ran.
@pytest.mark.cases(fast=0, thorough=1)
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
@pytest.mark.parametrize("count", [2, 5_000])
def test_an_ensemble_of_blocks_that_hardly_lose_energy_can_be_interrupted(count: int) -> None:
    expression = MANY.format(LIVELY.format(count), "linear")
    found = PLACE.run(expression, limit=LIMIT, interrupt_after=0.3)
    assert not found.stopped, f"deaf to an interrupt for {LIMIT:g} s"  # 5000 blocks take many times as long
    # It may be over by then, within its budget of steps; the interrupt then meets a process about to leave.
    assert "KeyboardInterrupt" in found.errors or found.output or found.status == 0, found.errors
