"""What every oracle is given: plain numbers that state one rocking problem, and nothing of the package."""

from dataclasses import dataclass
from math import pi, tan

import numpy as np
from numpy.typing import NDArray

OVERTURNED = pi / 2.0


@dataclass(frozen=True)
class Problem:
    """A block (side +, side -) under a ground acceleration that is a polynomial on every piece.

    Piece k holds on [breakpoints[k], breakpoints[k + 1]); its row of `coefficients` (m/s^2) goes by
    ascending powers of t - breakpoints[k]. The first piece starts at or before time zero; after the last
    one the acceleration is zero.
    """

    model: str
    p: tuple[float, float]
    alpha: tuple[float, float]
    restitution: tuple[float, float]
    breakpoints: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    gravity: float = 9.80665

    def side(self, side: int) -> tuple[float, float, float]:
        """Frequency parameter, slenderness and restitution of a side."""
        k = 0 if side > 0 else 1
        return self.p[k], self.alpha[k], self.restitution[k]

    def threshold(self, side: int) -> float:
        """Ground acceleration (m/s^2, positive) beyond which the block uplifts to a side."""
        alpha = self.side(side)[1]
        return self.gravity * (alpha if self.model == "linear" else tan(alpha))

    def piece(self, time: float) -> tuple[float, float, NDArray[np.float64]]:
        """Start, end and coefficients of the piece that holds from `time` on."""
        k = int(np.searchsorted(self.breakpoints, time, side="right")) - 1
        if k >= len(self.coefficients):
            return float(self.breakpoints[-1]), np.inf, np.zeros(1)
        return float(self.breakpoints[k]), float(self.breakpoints[k + 1]), self.coefficients[k]

    def acceleration(self, time: float) -> float:
        start, _, coefficients = self.piece(time)
        return float(np.polynomial.polynomial.polyval(time - start, coefficients))

    def restoring(self, time: float, side: int) -> float:
        """Angular acceleration (rad/s^2) that presses the block, at zero rotation, back from a side."""
        p, alpha, _ = self.side(side)
        push = side * self.acceleration(time) / self.gravity
        if self.model == "linear":
            return float(p * p * (alpha + push))
        return float(p * p * (np.sin(alpha) + push * np.cos(alpha)))

    def next_uplift(self, time: float) -> tuple[float, int]:
        """First instant from `time` on at which a threshold is passed, and the side; (inf, 0) if none is."""
        while time < self.breakpoints[-1]:
            start, end, coefficients = self.piece(time)
            found = [(self._passing(time, start, end, coefficients, side), side) for side in (1, -1)]
            first = min(found)
            if first[0] < np.inf:
                return first
            time = end
        return np.inf, 0

    def _passing(self, time: float, start: float, end: float, coefficients: NDArray[np.float64], side: int) -> float:
        excess = np.polynomial.Polynomial(-side * coefficients) - self.threshold(side)
        if excess(time - start) > 0.0:
            return time
        with np.errstate(over="ignore"):  # a slope next to nothing passes nowhere
            roots = excess.roots()
        real = np.sort(roots[np.abs(roots.imag) < 1e-12 * (end - start)].real) + start
        slope = excess.deriv()
        for root in real:
            if time <= root < end and slope(root - start) > 0.0:
                return float(root)
        return np.inf


def linear_record(acceleration: NDArray[np.float64], dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Breakpoints and coefficients of samples joined by straight lines."""
    breakpoints = dt * np.arange(len(acceleration))
    slopes = np.diff(acceleration) / np.diff(breakpoints)
    return breakpoints, np.column_stack([acceleration[:-1], slopes])
