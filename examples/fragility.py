"""Fragility of a museum statue under shipped records: the peak ground velocity that overturns it with even odds."""

import math
from pathlib import Path

import numpy as np

import rocking
from rocking import fragility, incremental_dynamic_analysis

OUT = Path("out")

RECORDS = (
    "ridgecrest-clc-090",
    "ridgecrest-clc-360",
    "ridgecrest-tow2-090",
    "ridgecrest-tow2-360",
    "el-centro-meloland-270",
    "el-centro-meloland-360",
)


def main() -> float:
    """Fit, draw, write NRML; return the median peak ground velocity, m/s."""
    statue = rocking.Block(half_width=0.12, half_height=0.55)
    motions = [rocking.records.load(name) for name in RECORDS]
    OUT.mkdir(exist_ok=True)

    scaled = incremental_dynamic_analysis(statue, motions[:4:3], measure="pgv", tolerance=1e-4)
    scaled.plot(title="Statue, two records scaled up").savefig(OUT / "ida.png", dpi=160)

    result = fragility(
        statue,
        motions,
        measure="pgv",
        levels=np.linspace(0.1, 2.0, 39),
        limits={"half": 0.5, "overturning": math.inf},
    )
    result.plot(title="Statue, 0.24 m x 1.10 m").savefig(OUT / "fragility.png", dpi=160)
    result.to_nrml(OUT / "fragility.xml", taxonomy="statue")
    for curve in result.curves:
        low, high = curve.median_interval
        print(f"{curve.limit_state}: median PGV {curve.median:.3f} m/s, 90 % confidence {low:.3f} to {high:.3f} m/s")
    median = result.curve("overturning").median
    print(f"even odds of overturning at a PGV of {median:.4f} m/s")
    return median


if __name__ == "__main__":
    main()
