"""Fixtures shared by all tests."""

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with records and reference values that do not ship with the project; absent on most machines."""
    if not SHARED.is_dir():
        pytest.skip("the shared folder with reference data is not on this machine")
    return SHARED
