"""Score answers to the accumulation benchmark: ``python benchmarks/accumulation/score.py [answers/NAME.json ...]``.

Without names it scores all answers that are kept here; with ``--write`` it also writes what docs/accumulation.md shows.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

FOLDER = Path(__file__).resolve().parent
DOCS = FOLDER.parents[1] / "docs"

#: Largest error, s, with which all rests of a case are right.
RIGHT = 1e-2

#: Finer errors that the table counts, too.
FINER = (1e-6, 1e-9)

#: Smallest error in the figure, s.
LOWEST = 1e-13

#: Lines of the figure: wide pale ones below thin dark ones, so that lines that coincide are all seen.
STYLES: list[dict[str, Any]] = [
    {"color": color, "linestyle": line, "linewidth": width}
    for color, line, width in (
        ("k", "-", 1.2), ("0.82", "-", 7.0), ("0.55", "-", 3.5), ("k", (0, (3, 2)), 1.2), ("k", "-.", 1.2),
        ("k", ":", 1.6),
    )
]  # fmt: skip

#: Share of the shorter interval beside an impact within which an answer is that impact.
NEAR = 0.25


class Score(NamedTuple):
    """What an answer to a case is worth.

    ``error`` is the largest distance of a time of rest from its bracket, s: infinite where rests are missing or too
    many, or impacts where there is no rest; NaN without an answer.
    """

    error: float
    missed: int
    extra: int
    penetration: float
    seconds: float

    @property
    def verdict(self) -> str:
        """Word for it."""
        return "no answer" if math.isnan(self.error) else "right" if self.error <= RIGHT else "wrong"


def scored(case: dict[str, Any], answer: dict[str, Any] | None) -> Score:
    """Score one answer."""
    if answer is None:
        return Score(math.nan, 0, 0, math.nan, math.nan)
    missed, extra = compared(case["impacts"], answer["impacts"])
    known, rests = case["rests"], answer["rests"]
    error = math.inf
    if len(known) == len(rests) and (known or not missed + extra):
        off = [max(row["lower"] - time, time - row["upper"], 0.0) for row, time in zip(known, rests, strict=True)]
        error = max(off, default=0.0)
    return Score(error, missed, extra, answer.get("penetration", math.nan), answer.get("seconds", math.nan))


def compared(known: Sequence[float], times: Sequence[float]) -> tuple[int, int]:
    """Impacts among the first ones that are missing, and those in between that are too many."""
    gaps = [b - a for a, b in zip([0.0, *known], known, strict=False)] + [math.inf]
    reach = [NEAR * min(gaps[n : n + 2]) for n in range(len(known))]
    found = [any(abs(time - t) <= near for time in times) for t, near in zip(known, reach, strict=True)]
    between = sum(time < known[-1] - reach[-1] for time in times)
    return len(known) - sum(found), max(between - sum(found[:-1]), 0)


def scores_of(program: dict[str, Any], cases: Sequence[dict[str, Any]]) -> list[Score]:
    """Score all answers of a program."""
    unknown = program["answers"].keys() - {case["name"] for case in cases}
    if unknown:
        raise SystemExit(f"{program['program']} answers cases that there are not: {', '.join(sorted(unknown))}")
    return [scored(case, program["answers"].get(case["name"])) for case in cases]


def main_table(programs: Sequence[dict[str, Any]], cases: Sequence[dict[str, Any]]) -> str:
    """Table with a row for each program."""
    rows = []
    for program in programs:
        found = [score for score in scores_of(program, cases) if score.verdict != "no answer"]
        errors = sorted(score.error for score in found)
        median = statistics.median(errors)
        rows.append((
            f"{program['program']} {program['version']}", len(found),
            *(sum(error <= limit for error in errors) for limit in (RIGHT, *FINER)),
            f"{median:.1e}" if math.isfinite(median) else "wrong", sum(score.missed for score in found),
            sum(score.extra for score in found), f"{max(score.penetration for score in found):.1e}",
            f"{1e3 * statistics.median(score.seconds for score in found):.3g}",
        ))  # fmt: skip
    heading = (
        "program", "answers", "right to 10 ms", "to 1 us", "to 1 ns", "median error, s", "impacts missed", "too many",
        "deepest in a stop, m", "ms a case",
    )  # fmt: skip
    return markdown(heading, rows)


def family_table(programs: Sequence[dict[str, Any]], cases: Sequence[dict[str, Any]]) -> str:
    """Table of right answers by body and by family."""
    groups = [(key, name) for key in ("body", "family") for name in dict.fromkeys(case[key] for case in cases)]
    rows = []
    for program in programs:
        right = [score.verdict == "right" for score in scores_of(program, cases)]
        counts = (sum(r for r, case in zip(right, cases, strict=True) if case[key] == name) for key, name in groups)
        rows.append((program["program"], *counts))
    totals = ["of", *(sum(case[key] == name for case in cases) for key, name in groups)]
    return markdown(("right to 10 ms", *(name for _, name in groups)), [*rows, totals])


def markdown(heading: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Write a table, numbers to the right."""
    lines = [heading, ["---", *["---:"] * (len(heading) - 1)], *rows]
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


def draw(programs: Sequence[dict[str, Any]], cases: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw the number of cases within an error, a line for each program."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.9), layout="constrained")
    axes = figure.add_subplot()
    for n, program in enumerate(programs):
        errors = sorted(max(s.error, LOWEST) for s in scores_of(program, cases) if math.isfinite(s.error))
        axes.step(
            [*errors, 1.0], [*range(1, len(errors) + 1), len(errors)], where="post", label=program["program"],
            **STYLES[n % len(STYLES)],
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xlim(LOWEST, 1.0)
    axes.set_ylim(0, 1.04 * len(cases))
    axes.set_xlabel("error of the times of rest, s")
    axes.set_ylabel("cases with no larger error")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.savefig(path, dpi=150)


def read(paths: Sequence[Path]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the programs that answer, the best first, and the cases."""
    cases = json.loads((FOLDER / "cases.json").read_text("utf-8"))
    programs = [json.loads(path.read_text("utf-8")) for path in paths or sorted((FOLDER / "answers").glob("*.json"))]
    order = {id(p): [sum(s.error <= limit for s in scores_of(p, cases)) for limit in (1e-9, RIGHT)] for p in programs}
    return sorted(programs, key=lambda program: order[id(program)], reverse=True), cases


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("answers", nargs="*", type=Path)
    parser.add_argument("--write", action="store_true", help="write the tables and the figure of the documentation")
    given = parser.parse_args()
    programs, cases = read(given.answers)
    print(main_table(programs, cases))
    print(family_table(programs, cases))
    if given.write:
        (DOCS / "_tables" / "accumulation.txt").write_text(main_table(programs, cases), "utf-8")
        (DOCS / "_tables" / "accumulation-families.txt").write_text(family_table(programs, cases), "utf-8")
        draw(programs, cases, DOCS / "_static" / "accumulation.png")


if __name__ == "__main__":
    main()
