"""Measure how often the 90 % intervals of a fragility hold the truth, on random data of a known lognormal.

Run ``python scripts/fragility_coverage.py`` from the repository's root (ten minutes): it writes
docs/_tables/fragility-coverage.txt. Data sets that determine no rising curve are refused by the fit and left out.
Shares of 500 data sets are uncertain by 0.03 (two standard deviations). Another number of data sets may be given, for
a trial that only prints.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from rocking import fit_fragility
from rocking.errors import OptionError

TABLE = Path(__file__).resolve().parents[1] / "docs" / "_tables" / "fragility-coverage.txt"
DATA_SETS = 500

MEDIAN, DISPERSION = 3.0, 0.4
#: Where the band of the probability is looked at: at the intensity of one in ten.
TENTH = MEDIAN * math.exp(DISPERSION * ndtri(0.1))


def cloud(rng, count):
    """Motions as they are, each with one outcome."""
    intensity = rng.lognormal(math.log(MEDIAN), 0.6, count)
    return intensity, intensity > rng.lognormal(math.log(MEDIAN), DISPERSION, count), np.arange(count)


def stripes(rng, count):
    """Motions scaled to 18 levels, each exceeding the limit above its own one."""
    levels, capacity = np.linspace(0.5, 9.0, 18), rng.lognormal(math.log(MEDIAN), DISPERSION, count)
    motion = np.tile(np.arange(count), len(levels))
    return np.repeat(levels, count), np.repeat(levels, count) > capacity[motion], motion


CASES = [(cloud, count) for count in (30, 60, 120)] + [(stripes, count) for count in (5, 10, 20, 40)]


def coverage(data, count, data_sets):
    """Shares of the intervals of median, dispersion and probability that hold the truth, and data sets refused."""
    held, used = np.zeros(3), 0
    for seed in range(data_sets):
        intensity, exceeded, motion = data(np.random.default_rng([seed, count]), count)
        try:
            curve = fit_fragility(intensity, exceeded, clusters=motion).curves[0]
        except OptionError:
            continue
        used += 1
        low, high = curve.band([TENTH])
        ends = (curve.median_interval, curve.dispersion_interval, (low[0], high[0]))
        held += [low <= truth <= high for truth, (low, high) in zip((MEDIAN, DISPERSION, 0.1), ends, strict=True)]
    return held / used, data_sets - used


def main() -> None:
    """Measure all cases, and write the table."""
    data_sets = int(sys.argv[1]) if len(sys.argv) > 1 else DATA_SETS
    lines = [
        "| data | motions | median | dispersion | probability of 0.1 | refused |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for data, count in CASES:
        shares, refused = coverage(data, count, data_sets)
        cells = [data.__name__, str(count), *(f"{100 * share:.0f} %" for share in shares), str(refused)]
        lines.append("| " + " | ".join(cells) + " |")
        sys.stdout.write(lines[-1] + "\n")
        sys.stdout.flush()
    if data_sets == DATA_SETS:
        TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
