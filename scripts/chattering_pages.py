"""Write the tables and images of docs/paper.md and docs/chattering-maps.md from computation.

Run ``python scripts/chattering_pages.py`` from the repository's root; a test compares the tables with what it makes.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

import rocking
from rocking.chattering import critical_amplitude, families
from rocking.chattering.episodes import chattering_episodes
from rocking.chattering.maps import chattering_map
from rocking.chattering.paper import FIGURES, paper_figure
from rocking.chattering.paper.case import excitation
from rocking.chattering.schemes import compare_schemes

DOCS = Path(__file__).resolve().parents[1] / "docs"
TABLES = DOCS / "_tables"
IMAGES = DOCS / "_static"

#: Small enough for a page: the files of `rocking paper` are finer.
DOTS_PER_INCH = 110

PAPER_BLOCK = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
STATUE = rocking.Block(half_width=0.12, half_height=0.55)

#: Pulses whose critical amplitude is compared with the sine's.
PULSES = {
    "sine, 2.5 cycles": families.sine(PAPER_BLOCK, model="linear"),
    "Ricker, antisymmetric": families.ricker(PAPER_BLOCK, kind="antisymmetric", model="linear"),
    "Mavroeidis-Papageorgiou, gamma = 2, symmetric": families.mavroeidis_papageorgiou(
        PAPER_BLOCK, gamma=2.0, model="linear"
    ),
    "Mavroeidis-Papageorgiou, gamma = 4, symmetric": families.mavroeidis_papageorgiou(
        PAPER_BLOCK, gamma=4.0, model="linear"
    ),
}
FREQUENCIES = (1.0, 2.0, 4.0, 8.0)


def main() -> None:
    """Write all tables and images."""
    TABLES.mkdir(exist_ok=True)
    for name, text in tables().items():
        (TABLES / name).write_text(text, encoding="utf-8")
    for name, figure in images():
        figure.savefig(IMAGES / name, dpi=DOTS_PER_INCH, pil_kwargs={"optimize": True})
        sys.stdout.write(f"{IMAGES / name}: {(IMAGES / name).stat().st_size // 1000} kB\n")


def tables():
    """Make all tables, by file name."""
    made = {f"paper-figure-{number}.txt": paper_table(number) for number in FIGURES}
    made["schemes-complete.txt"] = schemes_table(1.03)
    made["schemes-incomplete.txt"] = schemes_table(1.05)
    made["schemes-record.txt"] = table_of_comparison(
        compare_schemes(STATUE, rocking.records.load("ridgecrest-clc-090"))
    )
    made["critical-pulses.txt"] = pulses_table()
    made["episodes-records.txt"] = records_table()
    made["episodes-one.txt"] = episodes_table()
    return made


def paper_table(number):
    """Set what the paper states about a figure beside what is computed."""
    rows = [(s.claim, *s.cells()) for s in paper_figure(number).statements]
    return markdown(("", "paper", "here", "difference"), rows)


def schemes_table(a):
    """All schemes under the paper's sine of amplitude a."""
    return table_of_comparison(compare_schemes(PAPER_BLOCK, excitation(a), model="linear"))


def table_of_comparison(comparison):
    """Rests, errors and verdict of each scheme."""
    certified = comparison.certified
    rests = int(np.sum(certified.events["kind"] == "rest"))
    rows = [("certified", rests, "", "", "", "")]
    for outcome in comparison.outcomes:
        worst = outcome.largest_error
        rows.append(
            (
                outcome.treatment.label,
                len(outcome.rests),
                outcome.false_rests.size,
                outcome.missed.size,
                "" if math.isnan(worst) else "0" if abs(worst) < 1e-11 else f"{worst:+.1e}",
                outcome.verdict,
            )
        )
    rows += [(scheme.label, "", "", "", "", "not applicable") for scheme, _ in comparison.not_applicable]
    return markdown(("scheme", "rests", "false", "missed", "worst error of a true rest, s", "verdict"), rows)


def pulses_table():
    """Amplitude up to which the first sequence is complete, for pulses of several frequencies."""
    rows = [
        ("sine, exact theory", *(f"{float(critical_amplitude(omega, 0.92)):.6f}" for omega in FREQUENCIES)),
        *((name, *(largest_complete(family, omega) for omega in FREQUENCIES)) for name, family in PULSES.items()),
    ]
    return markdown(("a_cr", *(f"omega = {omega:g}" for omega in FREQUENCIES)), rows)


def largest_complete(family, omega):
    """Bisect between complete and incomplete; the amplitude is right to 1e-7."""
    low, high = 1.0 + 1e-6, 1.1
    while high - low > 1e-7:
        middle = 0.5 * (low + high)
        dataset = chattering_map(family, {"a": [middle], "omega": [omega]})
        low, high = (middle, high) if bool(dataset.complete.item()) else (low, middle)
    return f"{low:.6f}"


def records_table():
    """Episodes of one block under every shipped horizontal record."""
    rows = []
    for name in rocking.records.names():
        motion = rocking.records.load(name)
        if name.endswith("-up"):
            continue
        response = rocking.simulate(STATUE, motion)
        found = chattering_episodes(response)
        episodes = found.episodes
        widest = float(np.max(episodes["upper"] - episodes["lower"], initial=0.0))
        start, end = found.shaking
        rows.append(
            (
                name,
                f"{motion.pga / STATUE.gravity:.3f}",
                "overturns" if response.overturned else "stands",
                len(episodes),
                int(found.amid_shaking.sum()),
                f"{np.max(episodes['duration'], initial=0.0):.3f}" if len(episodes) else "",
                ("below 1e-11" if widest < 1e-11 else f"{widest:.0e}") if len(episodes) else "",
                f"{end - start:.3f}",
                f"{100.0 * found.share_at_rest:.1f}",
            )
        )
    heading = (
        "record",
        "PGA, g",
        "verdict",
        "episodes",
        "amid the shaking",
        "longest, s",
        "brackets, s",
        "shaking, s",
        "at rest, %",
    )
    return markdown(heading, rows)


def episodes_table():
    """Every episode of one block under one record."""
    found = chattering_episodes(rocking.simulate(STATUE, rocking.records.load("ridgecrest-clc-090")))
    rows = [
        (
            f"{row['uplift']:.6f}",
            f"{row['rest']:.9f}",
            f"{row['duration']:.6f}",
            f"{row['ground'] / STATUE.gravity:+.4f}",
        )
        for row in found.episodes
    ]
    return markdown(("uplift, s", "rest, s", "duration, s", "ground acceleration at rest, g"), rows)


def images():
    """All images, with their file names."""
    for number in FIGURES:
        yield f"paper-figure-{number}.png", paper_figure(number).draw()
    amplitude = np.linspace(0.98, 1.12, 71)
    omega = np.linspace(0.5, 8.0, 61)
    labels = {"a": "amplitude over the threshold, $a$", "omega": r"frequency over $p$, $\omega$"}
    sine = chattering_map(families.sine(PAPER_BLOCK, model="linear"), {"a": amplitude, "omega": omega}).plot(
        labels=labels,
        title=r"sine, 2.5 cycles; $\eta$ = 0.92",
    )
    yield "map-sine.png", with_theory(sine, omega)
    ricker = chattering_map(
        families.ricker(PAPER_BLOCK, kind="antisymmetric", model="linear"), {"a": amplitude, "omega": omega}
    ).plot(
        labels=labels,
        title=r"antisymmetric Ricker pulse; $\eta$ = 0.92",
    )
    yield "map-ricker.png", with_theory(ricker, omega)
    yield (
        "map-lobes.png",
        chattering_map(
            families.lobes(PAPER_BLOCK, model="linear"),
            {"a": np.linspace(0.98, 1.3, 81), "ratio": np.linspace(0.6, 1.2, 61)},
        ).plot(
            labels=labels | {"ratio": "amplitude of a lobe over that of the lobe before"},
            title=r"five unequal lobes; $\omega$ = 2, $\eta$ = 0.92",
        ),
    )
    record = rocking.records.load("ridgecrest-clc-090").processed(trim=(225.0, 245.0))
    yield (
        "map-record.png",
        chattering_map(
            families.record(record, alpha=0.2, restitution=0.92),
            {"a": np.linspace(0.94, 2.99, 83), "p": np.linspace(1.0, 8.0, 57)},
        ).plot(
            labels=labels | {"p": "frequency parameter of the block, $p$ (rad/s)"},
            title=r"ridgecrest-clc-090, scaled; $\alpha$ = 0.2, $\eta$ = 0.92",
        ),
    )


def with_theory(figure, omega):
    """Add the critical amplitude of the sine."""
    (axes,) = figure.axes
    axes.plot(omega, critical_amplitude(omega, 0.92), color="#b0390c", linewidth=1.4, linestyle=(0, (4, 2)))
    axes.annotate("$a_{cr}$ of the sine", (omega[-1], 1.0345), ha="right", va="top", color="#b0390c", fontsize=8)
    return figure


def markdown(heading, rows):
    """Write a table as Markdown; columns of numbers to the right, the others to the left."""
    columns = zip(*rows, strict=True)
    lines = [heading, ["---:" if all(is_number(cell) for cell in column) else "---" for column in columns], *rows]
    return "".join("| " + " | ".join(str(cell) for cell in line) + " |\n" for line in lines)


def is_number(cell):
    """Whether a cell is empty or starts like a number."""
    return str(cell)[:1] in "+-0123456789"


if __name__ == "__main__":
    main()
