"""The kernels as plain Python: the same laws, and the same numbers."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_kernels_march import record, run

TESTS = Path(__file__).parent

#: Left out: many cases that take long without compilation, or that test the oracle's arithmetic as much.
LONG = ["clipped", "ends_and_stays_sound", "jumps_lie", "approximated", "hold_its_duration"]


@pytest.mark.slow
def test_uncompiled_kernels_obey_the_same_laws() -> None:
    subjects = ["root", "arc", "chatter", "impact", "march"]
    files = [str(TESTS / f"test_kernels_{subject}.py") for subject in subjects]
    chosen = " and ".join(f"not {name}" for name in LONG)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-k", chosen, *files],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]


PROGRAM = """
import sys; sys.path.insert(0, {tests!r})
from test_kernels_march import record, run
for nonlinear in (False, True):
    print(*run(record(3), nonlinear=nonlinear).impacts[:, :4].ravel())
"""


@pytest.mark.slow
def test_compiled_and_uncompiled_kernels_agree() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(tests=str(TESTS))],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    for nonlinear, line in zip((False, True), done.stdout.splitlines(), strict=True):
        compiled = run(record(3), nonlinear=nonlinear).impacts[:, :4]
        uncompiled = np.array(line.split(), dtype=float).reshape(-1, 4)
        assert_allclose(uncompiled, compiled, rtol=1e-11, atol=1e-12)
