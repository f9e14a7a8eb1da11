"""Print the oldest version that pyproject.toml allows of every requirement, one constraint a line.

``python scripts/lowest_versions.py > lowest.txt`` and ``pip install -c lowest.txt ".[test]"`` make an environment in
which each bound is put to the test.
"""

import re
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"


def lowest(requirements: list[str]) -> list[str]:
    """Constraints from requirements as ``name>=version`` or ``name>=version,<version``."""
    parsed = [re.fullmatch(r"([\w.-]+)>=([\w.]+)(?:,<[\w.]+)?", requirement) for requirement in requirements]
    if None in parsed:
        raise SystemExit(f"{PROJECT.name}: every requirement must be NAME>=VERSION or NAME>=VERSION,<VERSION")
    return [f"{match[1]}=={match[2]}" for match in parsed if match]


def main() -> None:
    """Print the constraints of the package and of all its extras."""
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    extras = [requirement for extra in project["optional-dependencies"].values() for requirement in extra]
    print("\n".join(sorted({*lowest(project["dependencies"]), *lowest(extras)})))


if __name__ == "__main__":
    main()
