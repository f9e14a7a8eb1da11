"""Fit the critical amplitude: write the Chebyshev coefficients and print the measured error.

Run ``python scripts/fit_critical.py`` from the repository's root. The coefficients interpolate the exact critical
amplitude (root finding on certified sequences) at Chebyshev nodes; the error is measured on a finer grid that
shares no point with the nodes and reaches all edges of the domain.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev

from rocking.chattering.amplitude import critical_amplitude, parameters_at

TARGET = Path(__file__).resolve().parents[1] / "src" / "rocking" / "chattering" / "coefficients.py"

#: Coefficients kept in 1/omega^2 and sqrt(1 - eta), and nodes that determine them.
KEPT = (8, 10)
NODES = 24

#: Points per side of the grid on which the error is measured.
CHECKS = 150

HEADER = '''"""Chebyshev coefficients of the critical amplitude; written by scripts/fit_critical.py, do not edit."""

from typing import Final

import numpy as np

#: Largest error on a grid of {checks} x {checks} points that reaches all edges.
LARGEST_ERROR: Final = {error:.2g}

# fmt: off
#: Row i, column j: T_i of the scaled 1/omega^2, T_j of the scaled sqrt(1 - eta).
COEFFICIENTS: Final = np.array(
    [
{rows}
    ]
)
'''


def main() -> None:
    """Fit, measure and write."""
    coefficients = fit()
    error = measured_error(coefficients)
    write(coefficients, error)
    sys.stdout.write(f"{coefficients.size} coefficients, largest error {error:.2e} -> {TARGET}\n")


def fit():
    """Interpolating coefficients of a_cr - 1, cut to those kept and rounded to 1e-12."""
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    omega, eta = parameters_at(*np.meshgrid(nodes, nodes, indexing="ij"))
    excess = critical_amplitude(omega, eta) - 1.0
    transform = chebyshev.chebvander(nodes, NODES - 1) * (2.0 / NODES)
    transform[:, 0] /= 2.0
    return (transform.T @ excess @ transform)[: KEPT[0], : KEPT[1]].round(12)


def measured_error(coefficients):
    """Largest deviation from the exact critical amplitude on the checking grid."""
    side = np.linspace(-1.0, 1.0, CHECKS)
    x, y = np.meshgrid(side, side, indexing="ij")
    approximate = 1.0 + chebyshev.chebval2d(x, y, coefficients)
    return float(np.abs(approximate - critical_amplitude(*parameters_at(x, y))).max())


def write(coefficients, error):
    """Write the module with the coefficients."""
    half = KEPT[1] // 2
    rows = "\n".join(
        "        [\n"
        + "".join(f"            {', '.join(map(repr, part))},\n" for part in (row[:half], row[half:]))
        + "        ],"
        for row in coefficients.tolist()
    )
    TARGET.write_text(HEADER.format(checks=CHECKS, error=error, rows=rows), encoding="utf-8")


if __name__ == "__main__":
    main()
