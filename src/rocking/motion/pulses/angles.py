"""Large angles without their rounding: products and quotients with their errors, whole turns taken off exactly."""

from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats


class Angle(NamedTuple):
    """Angles by their sines and cosines."""

    sine: Floats
    cosine: Floats


def sine_and_cosine(turns: Floats, rest: Floats, phase: float) -> Angle:
    """Angle ``2 pi (turns + rest) + phase``, `rest` far below `turns`, without the rounding of a large angle.

    Whole quarter turns are taken off exactly, and the phase is added by the addition theorem.
    """
    within = (turns - np.rint(turns)) + rest
    quarter = np.rint(4.0 * within)
    angle = 2.0 * np.pi * (within - 0.25 * quarter)
    sine, cosine = np.sin(angle), np.cos(angle)
    quadrant = quarter.astype(int) % 4
    turned = Angle(
        np.choose(quadrant, [sine, cosine, -sine, -cosine]),
        np.choose(quadrant, [cosine, -sine, -cosine, sine]),
    )
    return sum_of_angles(turned, Angle(np.sin(phase), np.cos(phase)), 1.0)


def sum_of_angles(one: Angle, other: Angle, sign: float) -> Angle:
    """Sum of two angles, or their difference where the sign is -1."""
    return Angle(
        one.sine * other.cosine + sign * one.cosine * other.sine,
        one.cosine * other.cosine - sign * one.sine * other.sine,
    )


def exact_product(a: float, b: Floats) -> tuple[Floats, Floats]:
    """Product and its rounding error (Dekker 1971)."""
    product = a * b
    a_high, a_low = _halves(np.asarray(a))
    b_high, b_low = _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def exact_quotient(a: Floats, rest: Floats, divisor: float) -> tuple[Floats, Floats]:
    """Quotient of ``a + rest``, and what it lacks."""
    quotient = a / divisor
    product, error = exact_product(divisor, quotient)
    return quotient, ((a - product) - error + rest) / divisor


def _halves(a: Floats) -> tuple[Floats, Floats]:
    scaled = 134217729.0 * a
    high = scaled - (scaled - a)
    return high, a - high
