"""Measure how often each rule of thumb is unsafe, and how often over-conservative, on the shipped records.

Run ``python scripts/rules_trial.py`` from the repository's root (some minutes): it writes the tables of
docs/howto/rules.md and its figure.
"""

from __future__ import annotations

import sys

import numpy as np
from pages import markdown, write

import rocking
from rocking import rules
from rocking.analysis.survey import format_rule_name
from rocking.core.constants import MODELS
from rocking.plot.canvas import CURVES, add_labels, add_legend, collect_handles, open_figure

#: Heights, m, and slendernesses of the blocks: from a bottle to a monument.
HEIGHTS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
SLENDERNESSES = (0.1, 0.15, 0.2, 0.3, 0.4)

#: As many lines as rules.
STYLES = (*CURVES, {"color": "0.45", "linestyle": (0, (3, 1, 1, 1, 1, 1))})

#: Peak accelerations that every record is scaled to, over gravity.
LEVELS = np.geomspace(0.1, 2.0, 40)

#: Housner's demand over capacity to which white noises are scaled, and their number, step and duration, s.
RATIOS = (1.0, 1.5, 2.0)
NOISES, STEP, DURATION = 300, 0.02, 20.0


def main() -> None:
    """Write the tables and the figure."""
    blocks, motions = all_blocks(), all_motions()
    ratios = ratings(blocks, motions)
    verdicts, capacities = simulated_verdicts(blocks, motions), simulated_capacities(blocks, motions)
    tables = {
        "rules-verdicts.txt": verdict_table(blocks, motions, ratios, verdicts),
        "rules-capacities.txt": capacity_table(ratios, capacities),
        "rules-noise.txt": noise_table(overturned_by_noise(range(NOISES))),
    }
    write(tables, [("rules.png", figure(ratios, capacities))])


def all_blocks():
    """Rectangular blocks of all heights and slendernesses."""
    return rocking.Blocks.from_bodies(
        [
            rocking.Block(width=height * float(np.tan(alpha)), height=height)
            for height in HEIGHTS
            for alpha in SLENDERNESSES
        ]
    )


def all_motions():
    """Shipped horizontal records, from 5 s before their strong shaking to 10 s after it, with a PGA of 1 g."""
    found = []
    for name in rocking.records.names():
        if name.endswith("-up"):
            continue
        record = rocking.records.load(name)
        start, end = strong_part(record)
        trimmed = record.processed(trim=(max(start - 5.0, 0.0), min(end + 10.0, record.duration)))
        found.append(trimmed.scaled_to(rocking.Block(half_width=1.0, half_height=1.0).gravity))
    return found


def strong_part(record):
    """Find the times between which 5 and 95 % of the Arias intensity arrive."""
    times, samples = record.times, record.samples
    energy = np.cumsum(samples**2)
    return tuple(float(times[np.searchsorted(energy, share * energy[-1])]) for share in (0.05, 0.95))


def ratings(blocks, motions):
    """Demand over capacity by every rule under a PGA of 1 g, shape (motion, block)."""
    found: dict[str, list[np.ndarray]] = {name: [] for name in rules.RULES}
    for motion in motions:
        for name, rating in rules.apply_rules(blocks, motion).items():
            found[name].append(rating.ratio)
        sys.stdout.write(f"{motion.name}\n")
        sys.stdout.flush()
    return {name: np.array(rows) for name, rows in found.items()}


def simulated_verdicts(blocks, motions):
    """Whether each block overturns under each motion at every level, shape (motion, level, block)."""
    found = rocking.simulate_many(blocks, motions, levels=LEVELS * blocks.gravity, measure="pga")
    return found.overturned.transpose("motion", "scale", "block").values


def simulated_capacities(blocks, motions):
    """Lowest PGA, over gravity, that overturns each block under each motion, shape (motion, block)."""
    found = rocking.incremental_dynamic_analysis(blocks, motions, rtol=1e-3)
    return found.data.overturning_level.transpose("motion", "block").values / blocks.gravity


def verdict_table(blocks, motions, ratios, fell):
    """Verdicts of each rule against the simulated ones, over all cases in which the block is lifted."""
    lifted = np.broadcast_to(LEVELS[:, None] >= np.tan(blocks.alpha[:, 0]), fell.shape)
    rows = []
    for name, ratio in ratios.items():
        said = ratio[:, None, :] * LEVELS[:, None] >= 1.0
        unsafe, wary = (int(np.sum(lifted & wrong)) for wrong in (fell & ~said, ~fell & said))
        falls, stands = int(np.sum(lifted & fell)), int(np.sum(lifted & ~fell))
        right = 1.0 - (unsafe + wary) / (falls + stands)
        rows.append(
            (
                format_rule_name(name),
                f"{100 * unsafe / falls:.1f}",
                f"{100 * wary / stands:.1f}",
                f"{100 * right:.1f}",
                unsafe,
            )
        )
    head = ("rule", "unsafe, % of the falls", "over-conservative, % of the others", "right, % of all", "unsafe cases")
    total = (f"{len(motions)} records, {len(blocks)} blocks", f"{falls} falls", f"{stands} others", "", "")
    return markdown(head, [*rows, total])


def capacity_table(ratios, capacities):
    """Peak acceleration that overturns by each rule, over the simulated one."""
    rows = []
    for name, ratio in ratios.items():
        share = (1.0 / ratio / capacities)[np.isfinite(capacities)]
        low, median, high = np.quantile(share, [0.05, 0.5, 0.95])
        numbers = (f"{value:.2f}" for value in (low, median, high, share.max()))
        rows.append((format_rule_name(name), *numbers, f"{100.0 * np.mean(share > 1.0):.0f}"))
    return markdown(("rule", "5 %", "median", "95 %", "largest", "above 1, %"), rows)


def overturned_by_noise(seeds):
    """Whether white noise overturns a block at each of Housner's ratios in both models, shape (seed, ratio, model)."""
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.925)
    found = []
    for seed in seeds:
        noise = rocking.Motion.from_samples(np.random.default_rng(seed).normal(size=round(DURATION / STEP)), STEP)
        unit = noise.scaled(1.0 / rules.housner(block, noise).ratio[0])
        found.append(
            [
                [rocking.simulate(block, unit.scaled(ratio), model=model).overturned for model in MODELS]
                for ratio in RATIOS
            ]
        )
    return np.array(found)


def noise_table(fell):
    """Share of white noises that overturn the block, with its standard error."""
    share = fell.mean(axis=0)
    guess = (fell.sum(axis=0) + 0.5) / (len(fell) + 1.0)  # a share of 0 is uncertain, too
    error = np.sqrt(guess * (1.0 - guess) / len(fell))
    rows = [
        (f"{ratio:g}", *(f"{100.0 * p:.1f} +- {100.0 * s:.1f}" for p, s in zip(*row, strict=True)))
        for ratio, row in zip(RATIOS, zip(share, error, strict=True), strict=True)
    ]
    return markdown(("p S_v/(g alpha)", "nonlinear, % overturned", "linear, % overturned"), rows)


def figure(ratios, capacities):
    """Distribution of the rules' overturning accelerations over the simulated ones."""
    with open_figure(None, (5.6, 3.9)) as drawn:
        axes = drawn.add_subplot()
        for (name, ratio), curve in zip(ratios.items(), STYLES, strict=True):
            share = np.sort((1.0 / ratio / capacities)[np.isfinite(capacities)])
            axes.step(
                share, np.arange(1, share.size + 1) / share.size, where="post", label=format_rule_name(name), **curve
            )
        axes.axvline(1.0, color="0.35", linewidth=0.8)
        axes.set_xscale("log")
        ticks = [0.1, 0.2, 0.5, 1.0, 2.0, 3.0]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_xlim(0.1, 3.0)
        axes.set_ylim(0.0, 1.0)
        axes.text(0.97, 0.02, "safe side", ha="right", color="0.35", fontsize=8)
        axes.text(1.03, 0.02, "unsafe side", ha="left", color="0.35", fontsize=8)
        add_labels(axes, "overturning PGA by the rule over the simulated one", "share of blocks and records")
        add_legend(drawn, None, collect_handles(axes))
    return drawn


if __name__ == "__main__":
    main()
