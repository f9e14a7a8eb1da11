"""What every oracle is given: plain numbers that state one rocking problem, and nothing of the package."""

from bisect import bisect_right
from dataclasses import dataclass
from math import pi, tan

import numpy as np
from numpy.typing import NDArray

OVERTURNED = pi / 2.0

Pieces = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Breakpoints and coefficients of a component."""


@dataclass(frozen=True)
class Problem:
    """A block (side +, side -) under a ground acceleration that is a polynomial on every piece.

    Piece k holds on [breakpoints[k], breakpoints[k + 1]); its row of `coefficients` (m/s^2) goes by
    ascending powers of t - breakpoints[k]. The first piece starts at or before time zero; after the last
    one the acceleration is zero. So it is with the vertical component, positive upwards, whose pieces are its own:
    it makes the weight 1 + a_v/g times that at rest.
    """

    model: str
    p: tuple[float, float]
    alpha: tuple[float, float]
    restitution: tuple[float, float]
    breakpoints: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    gravity: float = 9.80665
    vertical: Pieces | None = None

    def side(self, side: int) -> tuple[float, float, float]:
        """Frequency parameter, slenderness and restitution of a side."""
        k = 0 if side > 0 else 1
        return self.p[k], self.alpha[k], self.restitution[k]

    def threshold(self, side: int) -> float:
        """Ground acceleration (m/s^2, positive) beyond which the block uplifts to a side under its weight at rest."""
        alpha = self.side(side)[1]
        return self.gravity * (alpha if self.model == "linear" else tan(alpha))

    def piece(self, time: float) -> tuple[float, float, NDArray[np.float64]]:
        """Start and coefficients of the horizontal piece that holds from `time` on; the end of either component's."""
        start, end, coefficients = _piece((self.breakpoints, self.coefficients), time)
        return start, min(end, self.vertical_piece(time)[1]), coefficients

    def vertical_piece(self, time: float) -> tuple[float, float, NDArray[np.float64]]:
        """Start, end and coefficients of the vertical piece that holds from `time` on."""
        return (0.0, np.inf, np.zeros(1)) if self.vertical is None else _piece(self.vertical, time)

    def end(self) -> float:
        """When the last component is over."""
        return float(max(self.breakpoints[-1], 0.0 if self.vertical is None else self.vertical[0][-1]))

    def acceleration(self, time: float) -> float:
        start, _, coefficients = self.piece(time)
        return float(np.polynomial.polynomial.polyval(time - start, coefficients))

    def weight(self, time: float) -> float:
        """Weight over that at rest."""
        start, _, coefficients = self.vertical_piece(time)
        return 1.0 + float(np.polynomial.polynomial.polyval(time - start, coefficients)) / self.gravity

    def restoring(self, time: float, side: int) -> float:
        """Angular acceleration (rad/s^2) that presses the block, at zero rotation, back from a side."""
        p, alpha, _ = self.side(side)
        push, weight = side * self.acceleration(time) / self.gravity, self.weight(time)
        if self.model == "linear":
            return float(p * p * (weight * alpha + push))
        return float(p * p * (weight * np.sin(alpha) + push * np.cos(alpha)))

    def next_uplift(self, time: float) -> tuple[float, int]:
        """First instant from `time` on at which a threshold is passed, and the side; (inf, 0) if none is."""
        while time < self.end():
            end = self.piece(time)[1]
            found = {side: self._passing(time, end, side) for side in (1, -1)}
            first = min(found.values())
            if first < np.inf:
                # Where nothing weighs the block down both are passed at once, and the push decides.
                at_once = abs(found[1] - found[-1]) <= 1e-12 * (end - time)
                pushed = -1 if self.acceleration(first) > 0.0 else 1
                return first, pushed if at_once else min(found, key=found.__getitem__)
            time = end
        return np.inf, 0

    def _passing(self, time: float, end: float, side: int) -> float:
        start, _, coefficients = self.piece(time)
        since, _, lifts = self.vertical_piece(time)
        shift = np.polynomial.Polynomial([start - since, 1.0])
        weight = 1.0 + np.polynomial.Polynomial(lifts)(shift) / self.gravity
        excess = np.polynomial.Polynomial(-side * coefficients) - self.threshold(side) * weight
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


def _piece(pieces: Pieces, time: float) -> tuple[float, float, NDArray[np.float64]]:
    breakpoints, coefficients = pieces
    k = bisect_right(breakpoints, time) - 1  # `searchsorted` would make numbers of many digits of all breakpoints
    if k >= len(coefficients):
        return float(breakpoints[-1]), np.inf, np.zeros(1)
    return float(breakpoints[k]), float(breakpoints[k + 1]), coefficients[k]


def linear_record(acceleration: NDArray[np.float64], dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Breakpoints and coefficients of samples joined by straight lines."""
    breakpoints = dt * np.arange(len(acceleration))
    slopes = np.diff(acceleration) / np.diff(breakpoints)
    return breakpoints, np.column_stack([acceleration[:-1], slopes])
