"""Kernels as Python reads them where nothing is compiled yet: the same bits, and a compiler where it is worth one."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest

import rocking
from rocking.dynamics import stroboscopic_map
from rocking.explorer import background
from rocking.kernels import compiled, ground
from rocking.kernels import interpreted as reading
from rocking.kernels import march as march_module
from rocking.kernels.interpreted import Interpreted
from rocking.kernels.march import march
from rocking.kernels.signatures import named
from rocking.response import Response

pytestmark = pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")


def motion_of(random: np.random.Generator, kind: int) -> rocking.Motion:
    """Motions from far below uplift to ten times g, smooth and rough, with and without a vertical component."""
    amplitude, frequency = 10.0 ** random.uniform((-0.5, -0.7), (2.0, 1.0))
    if kind == 0:
        return rocking.pulses.sine(amplitude, frequency, cycles=float(random.integers(1, 4)))
    if kind == 1:
        return rocking.pulses.ricker(amplitude, frequency)
    noise = np.convolve(random.normal(size=(120)), np.ones(5))
    motion = rocking.Motion.from_samples(
        np.append(amplitude * noise / np.abs(noise).max(), 0.0), 10.0 ** random.uniform(-2.3, -1.0)
    )
    return motion if kind == 2 else motion.with_vertical(motion.delayed(0.1).scaled(1.5 / amplitude * random.random()))


def bits(response: Response) -> tuple[bytes, ...]:
    tables = (response.impacts, response.events, response.chattering, response._trail.nodes)
    return tuple(table.tobytes() for table in tables)


@pytest.fixture
def choose(monkeypatch: pytest.MonkeyPatch) -> Callable[[bool], None]:
    """Have Python follow marches, or compiled code."""

    def choose(interpreted: bool) -> None:
        monkeypatch.setattr(compiled.Kernel, "is_at_hand", not interpreted)
        monkeypatch.setattr(march_module, "_interpreted", Interpreted(march, 10**9))
        monkeypatch.setattr(ground, "_interpreted_fill", Interpreted(ground.fill, 10**9))

    return choose


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("count", [12, pytest.param(4000, marks=pytest.mark.slow)])
def test_python_gives_the_same_bits(count: int, choose: Callable[[bool], None]) -> None:
    random = np.random.default_rng(count)
    impacts = 0
    for number in range(count):
        motion = motion_of(random, number % 4)
        block = rocking.Block.from_parameters(
            p=10.0 ** random.uniform(-0.5, 1.0), alpha=random.uniform(0.05, 0.8), restitution=random.uniform(0.3, 0.99)
        )
        how: dict[str, Any] = {"model": ("linear", "nonlinear")[number // 4 % 2]}
        if random.random() < 0.4:
            how["initial_rotation"] = random.uniform(-0.04, 0.04)
        found = []
        for interpreted in (False, True):
            choose(interpreted)
            found.append(rocking.simulate(block, motion, **how))
        assert bits(found[0]) == bits(found[1])
        impacts += len(found[0].impacts)
    assert impacts > 8 * count


def test_where_python_cannot_divide_compiled_code_goes_on(
    choose: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, block = rocking.pulses.sine(4.0, 1.0, cycles=2), rocking.Block.from_parameters(p=2.0, alpha=0.2)
    choose(False)
    expected = rocking.simulate(block, motion)
    choose(True)
    refused = []

    def divide(*arguments: Any) -> int:
        arguments[-1]["u"] = 12.0
        arguments[-1]["nodes"] = 7
        refused.append(1.0)
        raise ZeroDivisionError

    monkeypatch.setattr(Interpreted, "__call__", lambda self, *arguments: divide(*arguments))
    monkeypatch.setattr(ground, "_interpreted_fill", Interpreted(ground.fill, 0))
    found = rocking.simulate(block, motion)
    assert len(refused) == 1
    assert bits(found) == bits(expected)
    assert len(found.impacts) > 3
    rocking.simulate(block, motion)
    assert len(refused) == 1


def test_after_some_work_the_march_is_compiled(choose: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch) -> None:
    motion, block = rocking.pulses.sine(4.0, 1.0, cycles=2), rocking.Block.from_parameters(p=2.0, alpha=0.2)
    choose(False)
    expected = rocking.simulate(block, motion)
    choose(True)
    few = Interpreted(march, 5)
    monkeypatch.setattr(march_module, "_interpreted", few)
    found = rocking.simulate(block, motion)
    assert few.work() == 0
    assert bits(found) == bits(expected)
    assert len(found.impacts) > 5


@pytest.fixture
def unread(choose: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Python has read no kernel yet; a part that is called compiled is an error."""

    def refuse(part: compiled.OnUse, *arguments: Any) -> None:
        raise AssertionError(f"{part.py_func.__name__} would be compiled")

    choose(True)
    monkeypatch.setattr(compiled.OnUse, "__call__", refuse)
    reading._function.cache_clear()
    yield
    reading._function.cache_clear()


MOTION, BLOCK = rocking.pulses.sine(4.0, 1.0, cycles=2), rocking.Block.from_parameters(p=2.0, alpha=0.2)


@pytest.mark.parametrize("when", [40, *(pytest.param(each, marks=pytest.mark.thorough) for each in (1, 100))])
def test_an_interrupt_while_kernels_are_read_leaves_nothing_half_done(
    when: int, unread: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def interrupted(*arguments: Any) -> Any:
        made.append(FunctionType(*arguments))
        if len(made) == when:
            raise KeyboardInterrupt
        return made[-1]

    monkeypatch.setattr(reading, "FunctionType", interrupted)
    with pytest.raises(KeyboardInterrupt):
        rocking.simulate(BLOCK, MOTION)
    assert len(rocking.simulate(BLOCK, MOTION).impacts) > 3
    assert len(made) > when


@pytest.mark.thorough
def test_threads_that_simulate_first_at_once_compile_nothing(unread: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def slowly(*arguments: Any) -> Any:
        time.sleep(1e-4)  # another thread goes on
        return FunctionType(*arguments)

    monkeypatch.setattr(reading, "FunctionType", slowly)
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(rocking.simulate, [BLOCK] * 2, [MOTION] * 2))
    assert len({bits(response) for response in found}) == 1
    assert len(found[0].impacts) > 3


def test_threads_share_the_turns_that_python_takes(
    choose: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = rocking.pulses.sine(2.5, 1.0, cycles=20)
    choose(False)
    expected = bits(rocking.simulate(BLOCK, motion))
    choose(True)
    turns, few = [], Interpreted(march, 60)
    spend = few.spend

    def noting(work: int) -> None:
        turns.append(work)
        spend(work)

    monkeypatch.setattr(few, "spend", noting)
    monkeypatch.setattr(march_module, "_PORTION", 20)
    monkeypatch.setattr(march_module, "_interpreted", few)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(rocking.simulate, [BLOCK] * 4, [motion] * 4))
    assert {bits(response) for response in found} == {expected}
    assert 60 <= sum(turns) < 60 + 4 * 20


@pytest.mark.slow
def test_the_explorer_compiles_kernels_for_the_types_of_responses_and_maps(
    choose: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled.Kernel, "native", None)
    kernels = {name: named(name) for name in background._KERNELS}
    for each in kernels.values():
        for remembered in ("compiled", "native"):
            monkeypatch.delitem(vars(each), remembered, raising=False)
    choose(True)
    background._compile()
    prepared = {name: [*each.compiled.overloads] for name, each in kernels.items()}
    assert [len(types) for types in prepared.values()] == [1] * len(kernels)
    choose(False)
    _respond_and_map()
    assert {name: [*each.compiled.overloads] for name, each in kernels.items()} == prepared


def test_the_explorer_compiles_what_responses_and_maps_call(
    choose: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    called, call = set(), compiled.Kernel.__call__

    def noting(kernel: compiled.Kernel, *arguments: Any) -> Any:
        called.add(f"{kernel.__module__.removeprefix('rocking.kernels.')}.{kernel.py_func.__name__}")
        return call(kernel, *arguments)

    monkeypatch.setattr(compiled.Kernel, "__call__", noting)
    choose(False)
    _respond_and_map()
    assert called == {*background._KERNELS}


def _respond_and_map() -> None:
    record = rocking.Motion.from_samples(MOTION.acceleration([0.01 * k for k in range(200)]), 0.01)
    for motion in (MOTION, record):
        response = rocking.simulate(BLOCK, motion)
        response.rotation([0.5])
        response.summary()
        for model in ("linear", "nonlinear"):
            rocking.simulate_many(rocking.Blocks(p=[3.0, 4.0], alpha=0.2), motion, model=model)
    for model in ("linear", "nonlinear"):
        stroboscopic_map(BLOCK, MOTION, model=model).derivative([0.01, 0.0])


def test_a_first_simulation_needs_no_compiler(tmp_path: Path) -> None:
    code = """
import sys
sys.modules["numba"] = None
import rocking
block = rocking.Block(half_width=0.12, half_height=0.55)
print(len(rocking.simulate(block, rocking.records.load("el-centro-meloland-270")).impacts))
"""
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "ROCKING_SHIPPED": "0", "PATH": ""}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 0
