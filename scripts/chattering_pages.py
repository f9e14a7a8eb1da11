"""Write the tables and images of docs/paper.md and docs/chattering-maps.md from computation.

Run ``python scripts/chattering_pages.py`` from the repository's root; a test compares the tables with what it makes.
"""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path

import numpy as np
from pages import markdown, write

import rocking
from rocking.chattering import chattering_time, critical_amplitude, families
from rocking.chattering.maps import chattering_episodes, chattering_map
from rocking.core.tables import format_count

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples/paper"))

from figures import FIGURES, paper_figure

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

#: Frequencies and restitutions of the paper's Fig. 6.
FIGURE_6 = np.linspace(0.5, 8.0, 76)[:, np.newaxis], np.linspace(0.5, 0.97, 48)

#: Amplitude and frequency of the cases in which the paper's scheme is tried with each critical amplitude.
SCHEME_CASES = ((1.03, 2.0), (1.0375, 2.0), (1.0386, 4.0), (1.05, 12.0))

#: Amplitude and restitution of the cases above the critical amplitude, at omega = 2.
LATER_CASES = ((1.03878, 0.92), (1.04049, 0.92), (1.05, 0.92), (1.09388, 0.75))


def tables():
    """Make all tables, by file name."""
    figures = (paper_figure(number) for number in FIGURES)
    made = {f"paper-figure-{figure.number}.txt": paper_table(figure) for figure in figures if figure.statements}
    made["paper-frequency.txt"] = frequency_table()
    made["paper-excess.txt"] = excess_table()
    made["paper-slow.txt"] = slow_table()
    made["paper-later.txt"] = later_table()
    made["paper-robust.txt"] = robust_table()
    made["critical-pulses.txt"] = pulses_table()
    made["episodes-records.txt"] = records_table()
    made["episodes-one.txt"] = episodes_table()
    return made


def paper_table(figure):
    """Set what the paper states about a figure beside what is computed."""
    rows = [(s.claim, *s.cells) for s in figure.statements]
    return markdown(("", "paper", "here", "difference"), rows)


def frequency_table():
    """Chattering time over half a period at several frequencies, by Eqs 65 and 75 and exactly."""
    omega = np.array([0.5, 1.0, 2.0, 5.0])
    names = {"asymptotic": "Eq. 65", "semianalytical": "Eq. 75", "exact": "exact"}
    times = {name: chattering_time(1.01, omega, 0.92, method=method) for method, name in names.items()}
    rows = [(name, *(f"{value:.8f}" for value in times[name] * omega / math.pi)) for name in times]
    return markdown(("tau_ch/(T/2)", *(f"omega = {value:g}" for value in omega)), rows)


def excess_table():
    """Spreads and errors as shares of the critical amplitude and of what it exceeds one by."""
    omega, eta = FIGURE_6
    exact = critical_amplitude(omega, eta)
    lowest = exact.min(axis=0)
    spread = exact.max(axis=0) - lowest
    practical, one = eta >= 0.75, critical_amplitude(omega, 0.92)
    rows = [
        shares("spread over omega, eta = 0.92", one.max() - one.min(), one.min()),
        shares("spread over omega, eta from 0.75 on", spread[practical], lowest[practical]),
    ]
    for method in ("eq76", "eq77"):
        error = np.abs(critical_amplitude(omega, eta, method=method) - exact)
        rows.append(shares(f"error of Eq. {method[2:]}", error, exact))
    return markdown(("", "largest, % of a_cr", "there, % of a_cr - 1", "largest, % of a_cr - 1"), rows)


def shares(what, difference, amplitude):
    """One row: the largest share of the amplitude, the same as a share of its excess, and the largest of those."""
    whole, excess = (np.ravel(100.0 * difference / base) for base in (amplitude, amplitude - 1.0))
    worst = np.argmax(whole)
    return (what, f"{whole[worst]:.2f}", f"{excess[worst]:.1f}", f"{excess.max():.1f}")


def slow_table():
    """Critical amplitude under slow forcing, and the bound that no restitution changes."""
    omega = np.array([0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0])
    rows = [
        (f"{w:g}", *(f"{a:.6f}" for a in critical_amplitude(w, [0.92, 0.75, 0.5])), f"{math.hypot(1.0, w):.6f}")
        for w in omega.tolist()
    ]
    return markdown(("omega", "eta = 0.92", "eta = 0.75", "eta = 0.5", "sqrt(1 + omega^2)"), rows)


def later_table():
    """Rests above the critical amplitude: within the paper's 2.5 periods and until the block is still, and under 12."""
    rows = []
    for a, eta in LATER_CASES:
        block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=eta)
        short, long, shifted = (
            rests_in_periods(block, *case) for case in ((a, 2.5, None), (a, 12.0, 12.0), (a + 1e-6, 12.0, 12.0))
        )
        rows.append((f"{a:g}", f"{eta:g}", f"{critical_amplitude(2.0, eta):.5f}", short, long, shifted))
    heading = ("a", "eta", "a_cr", "rests, T (2.5 cycles)", "first rests, T (12 cycles)", "the same at a + 1e-6")
    return markdown(heading, rows)


def rests_in_periods(block, a, cycles, until):
    """Tell the first rests, in periods since the sine began; ``until``: how many periods are watched, None: all."""
    case = families.sine(block, cycles=cycles, model="linear")(a, 2.0)
    duration = None if until is None else until * math.pi
    events = rocking.simulate(case.block, case.motion, model="linear", duration=duration).events
    times = events["time"][events["kind"] == "rest"] / math.pi
    return ", ".join(f"{time:.3f}" for time in times[:3]) or "none"


def robust_table():
    """Try the paper's scheme with each critical amplitude that it may trust."""
    rows = []
    for a, omega in SCHEME_CASES:
        case = families.sine(PAPER_BLOCK, model="linear")(a, omega)
        certified = rests_under(case, "certified")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rocking.errors.OutsideFitWarning)
            found = [rests_under(case, rocking.AsymptoticTime(critical=name)) for name in ("eq76", "eq77", "exact")]
        exact = float(critical_amplitude(omega, 0.92))
        rows.append((f"{a:g}", f"{omega:g}", f"{exact:.5f}", *(verdict_on(each, certified) for each in found)))
    return markdown(("a", "omega", "a_cr", "with Eq. 76", "with Eq. 77", "with the exact a_cr"), rows)


def rests_under(case, chattering):
    """Start and end of each rest, and how many ended a sequence only because time no longer advanced."""
    response = rocking.simulate(case.block, case.motion, model="linear", chattering=chattering)
    times, kinds = response.events["time"], response.events["kind"]
    return np.column_stack([times, np.append(times, math.inf)[1:]])[kinds == "rest"], response.rests_by_rounding


def verdict_on(found, certified):
    """Say which rests overlap with no certified rest, and which of these have no counterpart."""
    (rests, rests_by_rounding), (proven, _) = found, certified
    overlap = np.minimum.outer(rests[:, 1], proven[:, 1]) > np.maximum.outer(rests[:, 0], proven[:, 0])
    false, missed = rests[~overlap.any(axis=1), 0], proven[~overlap.any(axis=0), 0]
    faults = []
    if false.size:
        faults.append(f"{format_count(false.size, 'false rest')}, the first at {false[0]:.6f} s")
    if missed.size:
        faults.append(f"{format_count(missed.size, 'rest')} missed, the first at {missed[0]:.6f} s")
    if rests_by_rounding:
        faults.append(f"{format_count(rests_by_rounding, 'rest')} only as time no longer advanced")
    return "; ".join(faults) or "every rest found, no other"


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
        low, high = (middle, high) if bool(dataset.data.complete.item()) else (low, middle)
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
        start, end = found.shaking_span
        rows.append(
            (
                name,
                f"{motion.pga / STATUE.gravity:.3f}",
                "overturns" if response.overturned else "stands",
                len(episodes),
                int(found.ends_during_shaking.sum()),
                f"{np.max(episodes['duration'], initial=0.0):.3f}" if len(episodes) else "",
                ("below 1e-11" if widest < 1e-11 else f"{widest:.0e}") if len(episodes) else "",
                f"{end - start:.3f}",
                f"{100.0 * found.share_at_rest:.1f}",
            )
        )
    words = "record", "PGA, g", "verdict", "episodes", "amid the shaking", "longest, s", "brackets, s"
    return markdown((*words, "shaking, s", "at rest, %"), rows)


def episodes_table():
    """Every episode of one block under one record."""
    found = chattering_episodes(rocking.simulate(STATUE, rocking.records.load("ridgecrest-clc-090")))
    digits = {"uplift": 6, "rest": 9, "duration": 6}
    rows = [
        (*(f"{row[k]:.{n}f}" for k, n in digits.items()), f"{row['ground'] / STATUE.gravity:+.4f}")
        for row in found.episodes
    ]
    return markdown(("uplift, s", "rest, s", "duration, s", "ground acceleration at rest, g"), rows)


def images():
    """All images, with their file names."""
    for number in FIGURES:
        figure = paper_figure(number)
        yield f"paper-figure-{number}.png", figure.draw()
        for drawing in [*figure.drawings][1:]:
            yield f"paper-figure-{number}-{drawing}.png", figure.draw(drawing)
    amplitude = np.linspace(0.98, 1.12, 71)
    omega = np.linspace(0.5, 8.0, 61)
    labels = {"a": "amplitude over the threshold, $a$", "omega": r"frequency over $p$, $\omega$"}
    for name, family, title in (
        ("sine", families.sine(PAPER_BLOCK, model="linear"), "sine, 2.5 cycles"),
        ("ricker", PULSES["Ricker, antisymmetric"], "antisymmetric Ricker pulse"),
    ):
        found = chattering_map(family, {"a": amplitude, "omega": omega})
        yield f"map-{name}.png", with_theory(found.plot(labels=labels, title=rf"{title}; $\eta$ = 0.92"), omega)
    labels |= {
        "ratio": "amplitude of a lobe over that of the lobe before",
        "p": "frequency parameter of the block, $p$ (rad/s)",
    }
    axes = {"a": np.linspace(0.98, 1.3, 81), "ratio": np.linspace(0.6, 1.2, 61)}
    title = r"five unequal lobes; $\omega$ = 2, $\eta$ = 0.92"
    found = chattering_map(families.lobes(PAPER_BLOCK, model="linear"), axes)
    yield "map-lobes.png", found.plot(labels=labels, title=title)
    record = rocking.records.load("ridgecrest-clc-090").processed(trim=(225.0, 245.0))
    axes = {"a": np.linspace(0.94, 2.99, 83), "p": np.linspace(1.0, 8.0, 57)}
    title = r"ridgecrest-clc-090, scaled; $\alpha$ = 0.2, $\eta$ = 0.92"
    found = chattering_map(families.record(record, alpha=0.2, restitution=0.92), axes)
    yield "map-record.png", found.plot(labels=labels, title=title)


def with_theory(figure, omega):
    """Add the critical amplitude of the sine."""
    (axes,) = figure.axes
    axes.plot(omega, critical_amplitude(omega, 0.92), color="#b0390c", linewidth=1.4, linestyle=(0, (4, 2)))
    axes.annotate("$a_{cr}$ of the sine", (omega[-1], 1.0345), ha="right", va="top", color="#b0390c", fontsize=8)
    return figure


if __name__ == "__main__":
    write(tables(), images())
