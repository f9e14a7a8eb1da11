"""Measure which branches the tests take of the parts on which everything else rests; kernels are run uncompiled.

    python stress/branches.py                        # every part, and the table of docs/reliability.md
    python stress/branches.py readers "authentication of requests"

A branch is a way out of a line that has several: an `if` has two, and both count. The tests are the nearest of those
that `make quick` would run for a change of a file (`tests/of_changes.py`). Every branch that none of them takes is
printed. What a part showed is kept under a hash of its sources and tests, so that a run that was stopped goes on where
it was. Exits with status 1 where fewer than 95 % of the branches or of the lines of a part are reached.
"""

from __future__ import annotations

import argparse
import datetime
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from mutants import NOT_JUDGED
from of_changes import FilesOfTests, ordered

import rocking

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "src/rocking"

#: Least share of branches, and of lines.
WANTED = 0.95

#: Lines that run nowhere: imports for types, and bodies of protocols.
_EXCLUDED = ("if TYPE_CHECKING:", r"^\s*\.\.\.$")


@dataclass(frozen=True)
class Part:
    """Files of the package, how many files of tests of each are run, and whether kernels are compiled."""

    patterns: tuple[str, ...]
    nearest: int
    compiled: bool = True

    @property
    def files(self) -> list[Path]:
        """Its files, in order."""
        found = {path for pattern in self.patterns for path in SOURCES.glob(pattern)}
        return sorted(path for path in found if path.name not in NOT_JUDGED)

    @property
    def tests(self) -> list[Path]:
        """The nearest files of tests of each of its files."""
        known = FilesOfTests(ROOT)
        return sorted({test for path in self.files for test in ordered([known.of(path)])[: self.nearest]})


PARTS = {
    "kernels": Part(("kernels/**/*.py",), nearest=3, compiled=False),
    "store of studies": Part(("studies/store.py", "studies/place.py", "studies/state.py"), nearest=6),
    "readers": Part(("motion/formats/*.py",), nearest=6),
    "authentication of requests": Part(("explorer/authentication.py",), nearest=1),
}


def measured(part: Part, kept: Path) -> dict[str, Any]:
    """Totals of a part and the branches that are missing, from what is kept or from a run of its tests."""
    tests = part.tests
    total = hashlib.sha256()
    for path in [*sorted(SOURCES.rglob("*.py")), *tests]:
        total.update(f"{path.relative_to(ROOT)}".encode() + b"\0" + path.read_bytes())
    place = kept / f"{total.hexdigest()[:20]}.json"
    if not place.exists():
        found = _run(part, tests)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps(found), "utf-8")
    result: dict[str, Any] = json.loads(place.read_text("utf-8"))
    return result


def _run(part: Part, tests: list[Path]) -> dict[str, Any]:
    """Run tests, and read what they reached."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, "settings.ini")
        included = "".join(f"\n    {path}" for path in part.files)
        excluded = "".join(f"\n    {each}" for each in _EXCLUDED)
        run = f"branch = true\nparallel = true\npatch = subprocess\ndata_file = {folder}/data\ninclude ={included}"
        settings.write_text(f"[run]\n{run}\n[report]\nexclude_also ={excluded}\n", "utf-8")
        coverage = [sys.executable, "-m", "coverage"]
        options = ["-q", "-x", "-n", "auto", "--dist", "worksteal", "--benchmark-disable", "-p", "no:cacheprovider"]
        fast = "not slow and not browser" + (" and not thorough" if part.compiled else "")
        if not part.compiled:
            options += ["-W", "ignore::RuntimeWarning"]
        environment = os.environ | ({} if part.compiled else {"NUMBA_DISABLE_JIT": "1"})
        named = f"--rcfile={settings}"
        start = sum(os.times()[:4])
        subprocess.run(
            [*coverage, "run", named, "-m", "pytest", *options, "-m", fast, *map(str, tests)],
            cwd=ROOT,
            env=environment,
            check=True,
        )
        seconds = sum(os.times()[:4]) - start
        subprocess.run([*coverage, "combine", "-q", named], cwd=ROOT, check=True)
        subprocess.run([*coverage, "json", "-q", named, "-o", f"{folder}/found.json"], cwd=ROOT, check=True)
        found = json.loads(Path(folder, "found.json").read_text("utf-8"))
    totals = found["totals"]
    names = ("num_statements", "covered_lines", "num_branches", "covered_branches")
    missing = {name: each["missing_branches"] for name, each in found["files"].items() if each["missing_branches"]}
    return {name: totals[name] for name in names} | {"missing": missing, "seconds": seconds, "tests": len(tests)}


def row(name: str, found: dict[str, Any]) -> tuple[str, bool]:
    """Line of the table, and whether enough is reached."""
    shares = [found["covered_branches"] / found["num_branches"], found["covered_lines"] / found["num_statements"]]
    cells = (name, found["num_branches"], f"{100 * shares[0]:.1f}", found["num_statements"], f"{100 * shares[1]:.1f}")
    return "| " + " | ".join(map(str, cells)) + f" | {found['seconds']:.0f} |", min(shares) >= WANTED


def main() -> int:
    """Measure what is not kept, print, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="which; by default all")
    parser.add_argument("--kept", type=Path, default=ROOT / "out" / "branches", help="folder of what is kept")
    given = parser.parse_args()
    heads = ("part", "branches", "taken, %", "lines", "run, %", "processor time, s")
    lines = ["| " + " | ".join(heads) + " |", "|---" + "|--:" * (len(heads) - 1) + "|"]
    enough = True
    for name in given.parts or PARTS:
        found = measured(PARTS[name], given.kept)
        line, good = row(name, found)
        lines.append(line)
        enough = enough and good
        for file, missing in found["missing"].items():
            ways = ", ".join(f"{start} to {'its end' if end < 0 else end}" for start, end in missing)
            print(f"{file}: {ways}")
    print("\n".join(lines))
    if not given.parts:
        said = f"Measured on {datetime.date.today().isoformat()}, rocking {rocking.__version__}:"
        (ROOT / "docs/_tables/tests-branches.txt").write_text("\n".join([said, "", *lines, ""]), "utf-8")
    return 0 if enough else 1


if __name__ == "__main__":
    sys.exit(main())
