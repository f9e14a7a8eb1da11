"""Make the figures of docs/howto/walls-and-tendons.md.

Run ``python scripts/wall_pages.py`` from the repository's root (a minute); the page shows how the numbers are found.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pages import write

import rocking
from rocking import Block, RestrainedBlock, Tendon, Thrust
from rocking.plot.canvas import ACCENT, CURVES, GREY, INK, add_labels, add_legend, collect_handles, open_figure

G = 9.80665

#: A strip of a facade, 1 m long, and the thrusts of a vault on it, N.
WALL = {"width": 0.6, "height": 7.0, "mass": 7500.0}
THRUSTS = (0.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0, 3000.0)

COLUMN = Block(width=0.8, height=5.0, mass=9000.0)
BODIES: dict[str, Any] = {
    "free": COLUMN,
    "tendon, 0.2 MN/m": RestrainedBlock(COLUMN, Tendon(2e5)),
    "tendon, 1 MN/m": RestrainedBlock(COLUMN, Tendon(1e6)),
    "prestress alone, 30 kN": RestrainedBlock(COLUMN, Tendon(0.0, prestress=3e4)),
}
FREQUENCIES = np.geomspace(0.2, 1.6, 25)


def facade(thrust):
    """Return the strip of the facade, which rocks one way, under a thrust at 6 m."""
    return Block.one_sided(*([Thrust(thrust, height=6.0)] if thrust else []), **WALL)


def motions():
    """Return six records, as they are and turned over: a wall of one side does otherwise under each."""
    records = [rocking.records.load(name) for name in rocking.records.names() if not name.endswith("up")]
    return [record.scaled(sign) for record in records for sign in (1.0, -1.0)]


def facade_figure():
    """Draw the lowest peak accelerations that overturn the facade, and those that lift it, against the thrust."""
    shaking, bodies = motions(), [facade(thrust) for thrust in THRUSTS]
    found = rocking.incremental_dynamic_analysis(bodies, shaking, rtol=1e-2)
    lowest = found.data.overturning_level.transpose("motion", "block").values / G
    with open_figure(None, (6.2, 3.4), None, "") as figure:
        axes, x = figure.subplots(), 1e-3 * np.array(THRUSTS)
        axes.plot(x, lowest.T, "o", color=GREY, markersize=3.0, label="_each motion")
        axes.plot([], [], "o", color=GREY, markersize=3.0, label=f"overturns, each of {len(shaking)} motions")
        axes.plot(x, np.median(lowest, axis=0), color=ACCENT, label="overturns, median")
        axes.plot(x, [body.uplift_thresholds()[0] / G for body in bodies], "--", color=INK, label="lifts")
        axes.set_ylim(0.0)
        add_labels(axes, "thrust per metre of wall (kN/m)", "lowest peak acceleration (g)")
        add_legend(figure, None, collect_handles(axes))
    return figure


def tendon_figure():
    """Draw the overturning spectra of the column: lowest amplitudes of a one-sine pulse that overturn it."""
    pulses = [rocking.pulses.one_sine(1.0, frequency) for frequency in FREQUENCIES]
    bodies = [RestrainedBlock(COLUMN), *list(BODIES.values())[1:]]
    levels = np.geomspace(1.4, 30.0, 60)
    found = rocking.incremental_dynamic_analysis(bodies, pulses, levels=levels, rtol=1e-3)
    lowest = found.data.overturning_level.transpose("block", "motion").values / G
    with open_figure(None, (6.2, 3.6), None, "") as figure:
        axes = figure.subplots()
        for name, row, look in zip(BODIES, lowest, CURVES, strict=False):
            axes.plot(FREQUENCIES, row, **look, label=name)
        axes.set_xscale("log")
        axes.set_yscale("log")
        ticks = [0.2, 0.3, 0.5, 0.8, 1.2, 1.6]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_yticks([0.2, 0.5, 1.0, 2.0, 3.0], ["0.2", "0.5", "1", "2", "3"])
        add_labels(axes, "frequency of the one-sine pulse (Hz)", "lowest amplitude\nthat overturns (g)")
        add_legend(figure, None, collect_handles(axes))
    return figure


def yielding_figure():
    """Draw the rotation of the column, free, with an elastic tendon and with one that yields, and forces of both."""
    pulse = rocking.pulses.one_sine(2.5, 0.8)
    bodies: dict[str, Any] = {
        "without a tendon: falls": COLUMN,
        "elastic tendon": RestrainedBlock(COLUMN, Tendon(1e6, prestress=5e3)),
        "tendon that yields at 40 kN": RestrainedBlock(COLUMN, Tendon(1e6, prestress=5e3, strength=4e4)),
    }
    with open_figure(None, (6.6, 4.4), None, "") as figure:
        histories, forces = figure.subplots(2, 1, height_ratios=(1.2, 1.0), sharex=True)
        for (name, body), look in zip(bodies.items(), CURVES, strict=False):
            times = np.linspace(0.0, 10.0, 4001)
            response = rocking.simulate(body, pulse, duration=10.0)
            rotation = response.rotation(times)
            histories.plot(times, np.degrees(rotation), **look, label=name)
            if isinstance(body, RestrainedBlock) and body.restraints:
                forces.plot(times, 1e-3 * tension(body.restraints[0], rotation), **look)
        histories.set_ylim(-10.0, 16.0)
        add_labels(histories, "", "rotation (°)")
        add_labels(forces, "time (s)", "force in the tendon (kN)")
        add_legend(figure, None, collect_handles(histories))
    return figure


def tension(tendon, rotation):
    """Return the force of a tendon at half the column's width from both pivots, N, along a history of rotations."""
    elongation = 0.8 * np.sin(0.5 * np.abs(rotation))
    yields = (tendon.strength - tendon.prestress) / tendon.stiffness
    plastic = np.maximum.accumulate(np.maximum(elongation - yields, 0.0))
    return np.maximum(tendon.prestress + tendon.stiffness * (elongation - plastic), 0.0)


if __name__ == "__main__":
    figures = {"facade": facade_figure, "tendons": tendon_figure, "yielding-tendon": yielding_figure}
    write({}, ((f"{name}.png", draw()) for name, draw in figures.items()))
