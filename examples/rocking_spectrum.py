"""Rocking spectra of shipped records: a large block turns less than a small one, and moves as far."""

from pathlib import Path

import numpy as np

import rocking
from rocking.analysis.spectrum import rocking_spectrum

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
    """Draw the spectra; return the exponent with which the peak rotation falls as large similar blocks grow."""
    motions = [rocking.records.load(name).scaled_to(0.5, "pgv") for name in RECORDS]
    spectrum = rocking_spectrum(rocking.Blocks.grid(alpha=[0.1, 0.2], size=np.geomspace(0.3, 60.0, 48)), motions)
    OUT.mkdir(exist_ok=True)
    figure = spectrum.plot(against="size", title="Six records scaled to a PGV of 0.5 m/s")
    figure.savefig(OUT / "spectrum.png", dpi=160)
    overturned = spectrum["size"].where(spectrum.overturned_share > 0.0).max("p")
    for alpha in spectrum.alpha.values:
        print(f"slenderness {alpha:g}: overturned up to R = {float(overturned.sel(alpha=alpha)):.2f} m")

    sizes = np.geomspace(20.0, 160.0, 16)
    large = rocking_spectrum(rocking.Blocks.grid(alpha=[0.1], size=sizes), motions)
    exponents = [np.polyfit(np.log(sizes), np.log(peaks), 1)[0] for peaks in large.peak_rotation.values[:, 0]]
    for name, exponent in zip(RECORDS, exponents, strict=True):
        print(f"{name}: peak rotation goes as R^{exponent:.2f}")
    median = float(np.median(exponents))
    print(f"median exponent {median:.3f}; -1 is an equal displacement of all sizes")
    return median


if __name__ == "__main__":
    main()
