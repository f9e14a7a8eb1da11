"""Make the tables and figures of published impact dynamics in docs/theory/orbits.md.

Run ``python scripts/dynamics_pages.py`` from the repository's root (a minute); tests compare what it computes with
closed forms.
"""

from __future__ import annotations

import math

import numpy as np
from pages import markdown, write

import rocking
from rocking import dynamics
from rocking.plot.canvas import ACCENT, CURVES, GREY, INK, PALE, add_labels, add_legend, collect_handles, open_figure

#: The block of Hogan's orbits, forced at three times its frequency parameter; what it hits the ground twice in.
HOGAN_BLOCK = rocking.Block.from_parameters(p=1.0, alpha=0.1, restitution=0.925)
HOGAN_RATIO = 3.0
ORBITS = {1: "one period", 3: "three periods"}


def main() -> None:
    """Write all tables and images."""
    branches = hogan_branches()
    images = [("orbits-slender.png", hogan_figure(branches)), ("sticking.png", sticking_figure())]
    write({"orbits-slender.txt": hogan_table(branches)}, images)


# --- Hogan's orbits ---------------------------------------------------------------------------------------------


def shaken(block, ratio, model="linear"):
    """Return what makes (block, motion) of the peak acceleration over that of uplift."""
    lifts = block.uplift_thresholds(model)[0]
    frequency = ratio * block.p / (2.0 * math.pi)
    return lambda level: (block, rocking.pulses.sine(level * lifts, frequency, cycles=1))


def stable_orbits(family, level, period, model):
    """Stable orbits with two impacts in so many periods."""
    found = dynamics.periodic_orbits(*family(level), period=period, model=model)
    return [each for each in found if each.is_stable and each.period == period and each.impact_count == 2.0]


def hogan_branches():
    """Branches of the symmetric and of an asymmetric orbit, by the periods that these take."""
    family, found = shaken(HOGAN_BLOCK, HOGAN_RATIO), {}
    for period, (below, above, top) in {1: (5.0, 6.0, 8.0), 3: (0.6, 0.7, 0.8)}.items():
        whole = next(each for each in stable_orbits(family, below, period, "linear") if each.is_symmetric)
        other = next(each for each in stable_orbits(family, above, period, "linear") if not each.is_symmetric)
        found[period] = (
            dynamics.continue_orbit(whole, family, below, (0.01, top)),
            dynamics.continue_orbit(other, family, above, (0.01, top)),
        )
    return found


def values_of(branch):
    """Values of the parameter at the bifurcations of a branch, by kind."""
    return {each.kind: each.value for each in branch.bifurcations}


def hogan_table(branches):
    """Amplitudes at which the orbits begin, lose their symmetry, and double."""
    rows = []
    for period, (whole, other) in branches.items():
        first, second = values_of(whole), values_of(other)
        values = first["fold"], first["symmetry breaking"], second["symmetry breaking"], second["flip"]
        rows.append((ORBITS[period], *(f"{value:.10f}" for value in values)))
    return markdown(("orbit of", "fold", "symmetry lost", "asymmetric orbits begin", "period doubles"), rows)


def heteroclinic(ratio, restitution):
    """Amplitude over that of uplift from which courses lead from one balance to the other."""
    return (1.0 + ratio**2) * (1.0 - restitution) / math.hypot(1.0 + restitution, ratio * (1.0 - restitution))


def hogan_figure(branches):
    """Branches of both orbits, and the states at the starts of periods on the way to chaos."""
    block, family = HOGAN_BLOCK, shaken(HOGAN_BLOCK, HOGAN_RATIO)
    alpha, restitution = block.alpha, block.restitution
    start = next(each for each in stable_orbits(family, 4.5, 1, "linear") if each.is_symmetric).state
    values, starts = np.linspace(4.5, 7.3, 561), start * [1.0, 1.0001]
    diagram = dynamics.bifurcation_diagram(
        family, values, starts, transient_periods=600, recorded_periods=48, model="linear"
    ).data
    look = {"color": INK, "markersize": 4.5, "markerfacecolor": "white"}
    with open_figure(None, (7.4, 3.5)) as drawn:
        left, right = drawn.subplots(1, 2)
        for curve, (period, pair) in zip(CURVES, branches.items(), strict=False):
            for number, branch in enumerate(pair):
                for stable in (True, False):
                    shown = np.where(branch.is_stable == stable, branch.peaks / alpha, np.nan)
                    name = f"{ORBITS[period]}, {'stable' if stable else 'unstable'}" if number == 0 else None
                    left.plot(
                        branch.values, shown, color=curve["color"], label=name,
                        linestyle="-" if stable else (0, (2, 1.5)), linewidth=1.4 if stable else 0.9,
                    )  # fmt: skip
                for each in branch.bifurcations:
                    if each.kind in (("fold", "symmetry breaking") if number == 0 else ("flip",)):
                        near = np.argmin(
                            np.hypot(np.log(branch.values / each.value), 0.0)
                            + 10.0 * np.linalg.norm(branch.states - each.orbit.state, axis=1)
                        )
                        mark = {"fold": "o", "symmetry breaking": "D", "flip": "s"}[each.kind]
                        left.plot(each.value, branch.peaks[near] / alpha, mark, zorder=4, **look)
        for mark, name in (("o", "fold"), ("D", "symmetry lost"), ("s", "period doubles")):
            left.plot([], [], mark, label=name, **look)
        left.axvline(heteroclinic(HOGAN_RATIO, restitution), color=GREY, linewidth=1.0, label="heteroclinic")
        left.axvline(1.0, color=GREY, linewidth=1.0, linestyle=(0, (1, 1.5)), label="uplift")
        left.set_xscale("log")
        add_labels(left, "peak acceleration over that of uplift", "largest rotation over the slenderness")
        dots = diagram.coordinate.values[0, :, 0] / alpha
        right.plot(np.repeat(diagram.value.values, dots.shape[1]), dots.ravel(), ".", color=INK, markersize=0.8)
        for value in (values_of(branches[1][0])["symmetry breaking"], values_of(branches[1][1])["flip"]):
            right.axvline(
                value, color=ACCENT, linewidth=0.8, linestyle=(0, (4, 2)), label="closed form" if value < 6 else None
            )
        add_labels(
            right, "peak acceleration over that of uplift", "rotation at the start of a period, over the slenderness"
        )
        add_legend(drawn, None, collect_handles(left, right))
    return drawn


# --- an oscillator that sticks ----------------------------------------------------------------------------------


def oscillating(restitution, frequency, cycles=1):
    """Budd and Dux's oscillator with its stop at zero, and the forcing cos(w t); both per unit of time."""
    body = dynamics.ImpactOscillator(1.0 / (2.0 * math.pi), restitution)
    return body, rocking.pulses.sine(1.0, frequency / (2.0 * math.pi), cycles=cycles, phase=0.5 * math.pi)


def sticking(restitution, frequency):
    """Share of a period for which the mass rests after the first release; 0 where it does not rest in that period."""
    body, motion = oscillating(restitution, frequency, 2)
    rests = dynamics.simulate(body, motion, duration=motion.duration).rest_intervals
    period = 0.5 * motion.duration
    return (rests[1, 1] - rests[1, 0]) / period if len(rests) > 1 and rests[1, 0] < rests[0, 1] + period else 0.0


def lost_at(restitution, low, high):
    """Frequency from which the mass no longer rests."""
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sticking(restitution, middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def sticking_figure():
    """Draw a course with chattering and rest, the time of rest by frequency, and impacts beyond the boundary."""
    ends = {0.5: lost_at(0.5, 0.55, 0.65), 0.8: lost_at(0.8, 0.32, 0.36), 0.9: lost_at(0.9, 0.19, 0.22)}
    with open_figure(None, (7.6, 2.9)) as drawn:
        course, rests, beyond = drawn.subplots(1, 3)
        body, motion = oscillating(0.8, 0.3, 2)
        response = dynamics.simulate(body, motion, duration=motion.duration)
        times, period = np.linspace(0.0, motion.duration, 3001), 0.5 * motion.duration
        course.plot(times / period, -response.states(times)[:, 0], color=INK, linewidth=1.1)
        for first, last in response.rest_intervals / period:
            course.axvspan(first, last, color=PALE, linewidth=0.0)
        add_labels(course, "time (periods of the forcing)", "x (amplitude of the force over the stiffness)")
        for curve, (restitution, end) in zip(CURVES, ends.items(), strict=False):
            frequencies = np.append(np.linspace(0.05, end, 240)[:-1], end - np.geomspace(1e-3, 1e-9, 25))
            shares = [sticking(restitution, frequency) for frequency in frequencies]
            rests.plot(frequencies, shares, label=f"restitution {restitution:g}", **curve)
            rests.plot(end, 0.0, "o", color=curve["color"], markersize=4.0, clip_on=False)
        rests.set_ylim(0.0, None)
        add_labels(rests, "frequency of the forcing over the natural one", "share of the period at rest")
        away = np.geomspace(3e-8, 1e-3, 300)
        counts = []
        for distance in away:
            strobe = dynamics.stroboscopic_map(*oscillating(0.5, ends[0.5] + distance))
            counts.append(strobe.advance(strobe([[0.0, 0.0]], 100)[0], 1)[2])
        beyond.plot(away, counts, drawstyle="steps-mid", **CURVES[0])
        beyond.set_xscale("log")
        add_labels(beyond, "frequency beyond the boundary", "impacts in a period")
        add_legend(drawn, None, collect_handles(rests))
    return drawn


if __name__ == "__main__":
    main()
