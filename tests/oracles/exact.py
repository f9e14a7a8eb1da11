"""Polynomials with rational coefficients: what doubles say, without any rounding."""

import itertools
import math
from collections.abc import Sequence

from flint import fmpq, fmpq_poly


def exact(x: float) -> fmpq:
    """Rational number that a double is."""
    return fmpq(*float(x).as_integer_ratio())


def as_float(x: fmpq) -> float:
    """Double next to a rational number."""
    return int(x.p) / int(x.q)


def polynomial(c: Sequence[float]) -> fmpq_poly:
    """Polynomial by ascending powers, its doubles taken as exact numbers."""
    return fmpq_poly([exact(x) for x in c])


def real_roots(f: fmpq_poly) -> list:
    """Real roots, as balls, in order."""
    if f.degree() < 1:
        return []
    return sorted((r.real for r, _ in f.complex_roots() if r.imag == 0), key=lambda r: float(r.mid()))


def turning_points(f: fmpq_poly, start: float, end: float) -> list[fmpq]:
    """Both ends, and rational numbers next to every root in between."""
    inside = [exact(float(r.mid())) for r in real_roots(f) if exact(start) < r < exact(end)]
    return [exact(start), *inside, exact(end)]


def first_above(f: fmpq_poly, start: float, end: float) -> float:
    """First time in [start, end) from which f > 0; inf when never."""
    if f(exact(start)) > 0:
        return start
    points = turning_points(f, start, end)
    for left, right in itertools.pairwise(points):
        if f((left + right) / 2) > 0:
            return as_float(left)
    return math.inf
