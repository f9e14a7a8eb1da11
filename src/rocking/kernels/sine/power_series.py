"""Numbers that are power series, for formulas written for numbers; uncompiled, many series at a time."""

from __future__ import annotations

import numpy as np

from rocking.arrays import Floats


class PowerSeries:
    """Truncated sums r^lowest (c_0 + c_1 r^2 + c_2 r^4 + ...); coefficients along the first axis.

    Sums need powers that are all even or all odd; the number of terms stays the same.
    """

    __slots__ = ("coefficients", "lowest")

    def __init__(self, coefficients: Floats, lowest: int) -> None:
        self.coefficients = coefficients
        self.lowest = lowest

    def from_power(self, lowest: int) -> Floats:
        """Coefficients from a lower power on, without the last that no longer fit."""
        shift = (self.lowest - lowest) // 2
        raised = np.zeros_like(self.coefficients)
        raised[shift:] = self.coefficients[: raised.shape[0] - shift]
        return raised

    def __add__(self, other: PowerSeries | float) -> PowerSeries:
        """Add a series or a number."""
        if not isinstance(other, PowerSeries):
            constant = np.zeros_like(self.coefficients)
            constant[0] = other
            other = PowerSeries(constant, 0)
        lowest = min(self.lowest, other.lowest)
        return PowerSeries(self.from_power(lowest) + other.from_power(lowest), lowest)

    __radd__ = __add__

    def __neg__(self) -> PowerSeries:
        """Change the sign."""
        return PowerSeries(-self.coefficients, self.lowest)

    def __sub__(self, other: PowerSeries | float) -> PowerSeries:
        """Subtract a series or a number."""
        return self + -other

    def __rsub__(self, other: float) -> PowerSeries:
        """Subtract from a number."""
        return -self + other

    def __mul__(self, other: PowerSeries | float) -> PowerSeries:
        """Multiply by a series or a number."""
        if not isinstance(other, PowerSeries):
            return PowerSeries(self.coefficients * other, self.lowest)
        product = np.zeros_like(self.coefficients)
        for k, coefficient in enumerate(self.coefficients):
            product[k:] += coefficient * other.coefficients[: product.shape[0] - k]
        return PowerSeries(product, self.lowest + other.lowest)

    __rmul__ = __mul__

    def reciprocal(self) -> PowerSeries:
        """Invert."""
        inverse = np.zeros_like(self.coefficients)
        inverse[0] = 1.0 / self.coefficients[0]
        for k in range(1, inverse.shape[0]):
            inverse[k] = -inverse[0] * (self.coefficients[1 : k + 1] * inverse[k - 1 :: -1][:k]).sum(axis=0)
        return PowerSeries(inverse, -self.lowest)

    def __truediv__(self, other: PowerSeries | float) -> PowerSeries:
        """Divide by a series or a number."""
        return self * (other.reciprocal() if isinstance(other, PowerSeries) else 1.0 / other)

    def __rtruediv__(self, other: float) -> PowerSeries:
        """Divide a number."""
        return self.reciprocal() * other

    def __pow__(self, exponent: int) -> PowerSeries:
        """Raise to a whole power, one or more."""
        power = self
        for _ in range(exponent - 1):
            power = power * self
        return power
