"""The trials of studies, at a small size."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "stress"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked, and their memory is read, as on Linux")
@pytest.mark.parametrize(
    ("program", "arguments", "says"),
    [
        ("kills.py", ["--kills", "20"], "studies with the one digest"),
        ("damage.py", ["--trials", "40"], "unit: reported by verify"),
    ],
)
def test_a_trial_finds_what_is_promised(tmp_path, program, arguments, says):
    pytest.importorskip("distributed")
    command = [sys.executable, FOLDER / program, *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stderr
    assert says in done.stdout
