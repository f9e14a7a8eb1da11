"""Measure which branches the tests take of the parts on which everything else rests; kernels are run uncompiled.

    python stress/branches.py                        # every part, and the table of docs/reliability.md
    python stress/branches.py readers "authentication of requests"

A branch is a way out of a line that has several: an `if` has two, and both count. Every branch that no test takes is
printed. What a part showed is kept with a hash of the sources and its tests, and measured anew when these change; the
table of docs/reliability.md has the last measurement of each part. Exits with status 1 where fewer than 95 % of the
branches, or of the lines, of a part are reached.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mutants import NOT_JUDGED
from rows import markdown, with_earlier

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "src/rocking"
TABLE = ROOT / "docs/_tables/tests-branches.txt"

#: Least share of branches, and of lines.
WANTED = 0.95

#: What is kept beside the table.
_SHOWN = ("num_statements", "covered_lines", "num_branches", "covered_branches", "seconds")

_OPTIONS = ["-q", "-x", "-n", "auto", "--maxprocesses", "4", "--dist", "worksteal", "--benchmark-disable"]
_OPTIONS += ["-p", "no:cacheprovider", "-m", "not thorough and not slow and not browser"]

#: Lines that run nowhere: imports for types, and bodies of protocols.
_EXCLUDED = ("if TYPE_CHECKING:", r"^\s*\.\.\.$")


@dataclass(frozen=True)
class Part:
    """Files of the package, the files of tests that hold them, and whether kernels are compiled for these."""

    patterns: tuple[str, ...]
    held_by: tuple[str, ...]
    compiled: bool = True

    @property
    def files(self) -> list[Path]:
        """Its files, in order."""
        found = {path for pattern in self.patterns for path in SOURCES.glob(pattern)}
        return sorted(path for path in found if path.name not in NOT_JUDGED)

    @property
    def tests(self) -> list[Path]:
        """Files of tests, in order."""
        return sorted({path for pattern in self.held_by for path in (ROOT / "tests").glob(pattern)})


PARTS = {
    "kernels": Part(
        ("kernels/**/*.py",),
        (
            "test_kernels_*.py",
            "test_chattering_kernels.py",
            "test_chattering_first_arc.py",
            "test_chattering_sequence.py",
            "test_gradient_told.py",
        ),
        compiled=False,
    ),
    "store of studies": Part(
        ("studies/store.py", "studies/place.py", "studies/state.py"), ("test_stud*.py", "test_portability.py")
    ),
    "readers": Part(("motion/formats/*.py",), ("test_formats*.py", "test_table_headings.py", "test_records.py")),
    "authentication of requests": Part(("explorer/authentication.py",), ("test_explorer_authentication.py",)),
}


def measured(part: Part, place: Path) -> dict[str, Any]:
    """Totals of a part and the branches that are missing, from what is kept or from a run of its tests."""
    total = hashlib.sha256()
    for path in [*sorted(SOURCES.rglob("*.py")), *part.tests]:
        total.update(f"{path.relative_to(ROOT)}".encode() + b"\0" + path.read_bytes())
    found: dict[str, Any] = json.loads(place.read_text("utf-8")) if place.exists() else {}
    if found.get("of") != total.hexdigest():
        found = _run(part) | {"of": total.hexdigest()}
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps(found), "utf-8")
    return found


def _run(part: Part) -> dict[str, Any]:
    """Run tests, and read what they reached."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, "settings.ini")
        included = "".join(f"\n    {path}" for path in part.files)
        excluded = "".join(f"\n    {each}" for each in _EXCLUDED)
        run = f"branch = true\nparallel = true\npatch = subprocess\ndata_file = {folder}/data\ninclude ={included}"
        settings.write_text(f"[run]\n{run}\n[report]\nexclude_also ={excluded}\n", "utf-8")
        coverage, named = [sys.executable, "-m", "coverage"], f"--rcfile={settings}"
        options = [*_OPTIONS, *([] if part.compiled else ["-W", "ignore::RuntimeWarning"]), *map(str, part.tests)]
        environment = os.environ | ({} if part.compiled else {"NUMBA_DISABLE_JIT": "1"})
        start = os.times()
        subprocess.run([*coverage, "run", named, "-m", "pytest", *options], cwd=ROOT, env=environment, check=True)
        seconds = sum(os.times()[2:4]) - sum(start[2:4])
        subprocess.run([*coverage, "combine", "-q", named], cwd=ROOT, check=True)
        subprocess.run([*coverage, "json", "-q", named, "-o", f"{folder}/found.json"], cwd=ROOT, check=True)
        found = json.loads(Path(folder, "found.json").read_text("utf-8"))
    totals = found["totals"]
    names = ("num_statements", "covered_lines", "num_branches", "covered_branches")
    missing = {name: each["missing_branches"] for name, each in found["files"].items() if each["missing_branches"]}
    return {name: totals[name] for name in names} | {"missing": missing, "seconds": seconds}


def shares(found: dict[str, Any]) -> tuple[float, float]:
    """Share of branches that are taken, and of lines that are run."""
    return found["covered_branches"] / found["num_branches"], found["covered_lines"] / found["num_statements"]


def table(found: dict[str, dict[str, Any]]) -> str:
    """Table of parts."""
    heads = ("part", "branches", "taken, %", "lines", "run, %", "processor time, s", "date")
    rows: dict[str, tuple[object, ...]] = {}
    for name in PARTS:
        rows[name] = ()
        if each := found.get(name):
            taken, run = (f"{100 * share:.1f}" for share in shares(each))
            rows[name] = (
                each["num_branches"],
                taken,
                each["num_statements"],
                run,
                f"{each['seconds']:.0f}",
                each["date"],
            )
    return "\n".join([*markdown(heads, rows, "not measured yet"), ""])


def main() -> int:
    """Measure what is not kept, print, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="which; by default all")
    parser.add_argument("--kept", type=Path, default=ROOT / "out" / "branches", help="folder of what is kept")
    given = parser.parse_args()
    kept = {name: given.kept / f"{name}.json" for name in PARTS}
    found = {name: measured(PARTS[name], kept[name]) for name in given.parts or PARTS}
    for each in found.values():
        for file, missing in each["missing"].items():
            ways = ", ".join(f"{start} to {end if end > 0 else 'its end'}" for start, end in missing)
            print(f"{file}: {ways}")
    every = with_earlier(TABLE, {name: {key: each[key] for key in _SHOWN} for name, each in found.items()})
    print(table(every))
    TABLE.write_text(table(every), "utf-8")
    return 0 if all(min(shares(each)) >= WANTED for each in found.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
