"""A one-sine pulse on a slender block: two regions of overturning, and the closed form for one of them."""

import math
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import rocking
from rocking.analysis.overturning import overturning_map

OUT = Path("out")


def closed_form(ratio: float) -> float:
    """Amplitude, over g alpha, of the one-sine pulse that just overturns a slender block without an impact."""

    def excess(a: float) -> float:
        return math.sqrt(a * a - 1.0) - a * math.exp(-(2.0 * math.pi - math.asin(1.0 / a)) / ratio) - ratio

    return float(brentq(excess, 1.0, 100.0, xtol=1e-14, rtol=1e-15))


def main() -> float:
    """Draw the map; return the largest difference between its upper boundary and the closed form."""
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    amplitudes, frequencies = np.linspace(0.5, 15.0, 59), np.linspace(0.4, 9.0, 87)
    OUT.mkdir(exist_ok=True)
    found = overturning_map(block, "one-sine", amplitudes=amplitudes, frequencies=frequencies)
    found.plot().savefig(OUT / "map.png", dpi=160)

    # So slender that pi/2, where a block has fallen, is too many times alpha to be reached before the pulse is over.
    slender = rocking.Block.from_parameters(p=2.0, alpha=1e-5, restitution=0.9)
    frequencies = np.linspace(1.0, 7.0, 7)
    linear = overturning_map(
        slender, "one-sine", amplitudes=np.linspace(0.5, 15.0, 30), frequencies=frequencies, model="linear"
    )
    upper = linear.boundary_amplitude.where(linear.mode_above == 0, drop=True)
    exact = np.array([closed_form(ratio) for ratio in frequencies])
    for ratio, found in zip(frequencies, upper.values, strict=True):
        print(f"omega/p = {ratio:g}: overturns without impact from {found:.9f} on")
    difference = float(np.max(np.abs(upper.values - exact)))
    print(f"largest difference from the closed form {difference:.1e}")
    return difference


if __name__ == "__main__":
    main()
