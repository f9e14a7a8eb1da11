"""Sums, products and quotients together with their rounding errors."""

from typing import Any

from rocking.arrays import Floats


def exact_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Sum and its rounding error (Knuth 1969)."""
    total = a + b
    of_b = total - a
    return total, (a - (total - of_b)) + (b - of_b)


def exact_product(a: float | Floats, b: Floats) -> tuple[Floats, Floats]:
    """Product and its rounding error (Dekker 1971)."""
    product = a * b
    a_high, a_low = _halves(a)
    b_high, b_low = _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def exact_quotient(a: Floats, rest: Floats, divisor: float) -> tuple[Floats, Floats]:
    """Quotient of ``a + rest``, and what it lacks."""
    quotient = a / divisor
    product, error = exact_product(divisor, quotient)
    return quotient, ((a - product) - error + rest) / divisor


def _halves(a: float | Floats) -> tuple[Any, Any]:
    scaled = 134217729.0 * a
    high = scaled - (scaled - a)
    return high, a - high
