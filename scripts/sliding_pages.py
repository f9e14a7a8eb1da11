"""Table of the influence of friction for the documentation, docs/_tables/sliding-influence.txt.

Rectangles of 14 sizes and five slendernesses under the six shipped horizontal records, whose accelerations are
multiplied by 1.5, compared with blocks that never slip.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import pages

import rocking

#: Half heights, m, ratios of width to height, coefficients of friction, and the factor on the records.
HALF_HEIGHTS: Final = np.geomspace(0.25, 2.0, 14)
RATIOS: Final = (0.10, 0.15, 0.20, 0.25, 0.35)
FRICTION: Final = (0.5, 0.4, 0.3, 0.25, 0.2, 0.15)
FACTOR: Final = 1.5

HEADING: Final = (
    "$\\mu$", "slip", "only slide", "overturn", "stand, overturn without slip", "overturn, stand without slip",
    "median slip of standing blocks, mm",
)  # fmt: skip


def build_rows() -> list[tuple[str, ...]]:
    """Return a row for each coefficient of friction."""
    blocks = [rocking.Block(half_width=ratio * h, half_height=h) for h in HALF_HEIGHTS for ratio in RATIOS]
    names = [name for name in rocking.records.names() if not name.endswith("-up")]
    motions, bodies = [rocking.records.load(name) for name in names], rocking.Blocks.from_bodies(blocks)
    free = rocking.simulate_many(bodies, motions, levels=[FACTOR])
    fell, rocked = free.overturned.values, free.peak_rotation.values > 0.0
    rows: list[tuple[str, ...]] = [("none", "0 %", "0 %", f"{fell.sum()} of {fell.size}", "", "", "")]
    for mu in FRICTION:
        data = rocking.simulate_many(bodies, motions, levels=[FACTOR], friction=mu)
        falls, largest = data.overturned.values, 1e3 * data.largest_slip.values
        slips, only_slides = (largest > 0.0) & rocked, (data.peak_rotation.values == 0.0) & rocked
        standing = largest[(largest > 0.0) & ~falls]
        shares = (f"{100 * cases.sum() / rocked.sum():.0f} %" for cases in (slips, only_slides))
        counts = (f"{cases.sum()}" for cases in (falls, fell & ~falls, falls & ~fell))
        rows.append((f"{mu:g}", *shares, *counts, f"{np.median(standing):.3g}" if len(standing) else ""))
    return rows


if __name__ == "__main__":
    pages.write({"sliding-influence.txt": pages.markdown(HEADING, build_rows())})
