"""The kernels as plain Python obey the same laws; `test_kernels_as_written.py` compares the numbers."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

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
