"""The kernels as plain Python: the same laws, and the same numbers."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_kernels_march import record, run

import rocking
from rocking.engine import Setup, Task, simulate_task
from rocking.treatment import Certified

TESTS = Path(__file__).parent

#: Tests of compiled kernels.
COMPILATION = ("test_kernels_library.py", "test_kernels_rounding.py", Path(__file__).name)


@pytest.mark.slow
def test_uncompiled_kernels_obey_the_same_laws() -> None:
    """All tests of kernels but those that take long without compilation (`kernel_records.long_uncompiled`)."""
    files = [str(file) for file in sorted(TESTS.glob("test_kernels_*.py")) if file.name not in COMPILATION]
    options = ["-q", "-x", "-p", "no:cacheprovider", "-W", "ignore::RuntimeWarning", "-m", "not slow"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, *files],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    (passed,) = re.findall(r"(\d+) passed", done.stdout)
    assert int(passed) >= 580


def played() -> Iterator[np.ndarray]:
    """Critical amplitudes, impacts of marches, states of lanes, and changes of responses."""
    etas = np.array([5e-324, 1e-300, 1e-100, 1e-28, 1e-20, 1e-6, 0.1, 0.5, 0.9, 0.999])
    yield rocking.chattering.critical_amplitude(np.array([[0.5], [4.0], [100.0]]), etas)
    for nonlinear in (False, True):
        found = run(record(3), nonlinear=nonlinear)
        yield np.column_stack([found.impacts[name] for name in ("time", "speed_before", "speed_after")])
        yield np.column_stack([found.nodes[name] for name in ("time", "u", "v")])
        blocks = rocking.Blocks(np.linspace(1.0, 6.0, 5), np.linspace(0.08, 0.3, 5), np.linspace(0.6, 0.95, 5))
        setup = Setup(blocks, "nonlinear" if nonlinear else "linear", Certified())
        noise = np.convolve(np.random.default_rng(1).normal(size=200), np.ones(8))
        motion = rocking.Motion.from_samples(np.append(noise, 0.0), 0.01)
        outcomes = simulate_task(setup, Task(slice(None), motion))
        assert np.sum(outcomes["impacts"]) > 10
        yield np.column_stack([outcomes[name].astype(float) for name in outcomes.dtype.names])
        response = rocking.simulate(blocks[1], rocking.pulses.sine(2.5, 1.0, cycles=1), model=setup.model)
        yield np.column_stack([response.sensitivity.events[name] for name in ("motion", "p", "alpha", "restitution")])


@pytest.mark.slow
def test_compiled_and_uncompiled_kernels_agree(tmp_path: Path) -> None:
    program = (
        f"import sys, numpy; sys.path.insert(0, {str(TESTS)!r}); from test_kernels_uncompiled import played\n"
        f"numpy.savez({str(tmp_path / 'played.npz')!r}, *played())"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", "-c", program],
        env=environment,
        check=False,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr[-4000:]
    with np.load(tmp_path / "played.npz") as uncompiled:
        for one, other in zip(played(), uncompiled.values(), strict=True):
            assert len(one) > 0
            assert_allclose(other, one, rtol=1e-10, atol=1e-12)
