"""Fixtures shared by all tests."""

import os
from pathlib import Path

import hypothesis
import pytest

# The same examples on every run of continuous integration; new ones on every other run.
hypothesis.settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    hypothesis.settings.load_profile("ci")

# Figures are not looked at here, whatever display there is.
os.environ["MPLBACKEND"] = "agg"

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with records and reference values that do not ship with the project; absent on most machines."""
    if not SHARED.is_dir():
        pytest.skip("the shared folder with reference data is not on this machine")
    return SHARED
