"""The consistent expansion of the chattering time: the impact map in truncated power series.

With r = sqrt(eps) every quantity is a power of r times a series in eps = a - 1: phases x = r(...), first-side arcs
t = r z, second-side arcs t = r^3 z, speeds V = r^3 v, restoring acceleration P = eps p, slope D = r d. So the exact
impact map acts on coefficient arrays, and its sums are closed as those of numbers are, by the same formula.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.compiled import allocating
from rocking.kernels.paper import positive_root
from rocking.kernels.remaining import Restoring, remaining_time
from rocking.kernels.sine.sequence import LEVELS, richardson_weights


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


Series = Floats

#: Relative size of the last extrapolation, coefficient by coefficient, at which it is taken.
_CLOSED: Final = 1e-14

_MAXIMUM_PAIRS: Final = 100_000

#: By so much, as exponent, the speed falls in the first pairs that are formed; and some more pairs.
_FALLEN: Final = 2.3
_SPARE_PAIRS: Final = 3

# Python strings the arcs together: that costs little beside them, and to compile it as well would multiply the time of
# a first call.


def phase_coefficients(delta: float, eta: float, order: int) -> Series:
    """Coefficients c_k of omega tau_ch = sqrt(eps) (c_0 + c_1 eps + ...), ``order`` of them; NaN: not resolved."""
    count = LEVELS + _SPARE_PAIRS + int(_FALLEN / -math.log(eta))
    passed, entered = first_impact(delta, eta, order)
    while passed.shape[0] < _MAXIMUM_PAIRS:
        more_passed, more_entered = impact_pairs(entered[-1], delta, eta, count)
        passed = np.concatenate((passed, more_passed))
        entered = np.concatenate((entered, more_entered))
        v, p, d = entered.transpose(1, 2, 0)
        state = PowerSeries(v, 3), PowerSeries(p, 2), PowerSeries(d, 1)
        with np.errstate(over="ignore", invalid="ignore"):
            remaining = remaining_series(state, delta, eta).from_power(1)
            rest, change = extrapolated(remaining.T, passed, eta)
        x = np.cumsum(passed, axis=0)[-change.shape[0] :]
        settled = np.flatnonzero((change <= _CLOSED * np.abs(x)).all(axis=1))
        if settled.size:
            coefficients: Series = x[settled[0]] + rest[settled[0]]
            return coefficients
        if not np.isfinite(change).all():
            break
        count = passed.shape[0]
    return np.full(order, math.nan)


def remaining_series(entered: tuple[PowerSeries, PowerSeries, PowerSeries], delta: float, eta: float) -> PowerSeries:
    """Evaluate the same formula, uncompiled, for a state (V, P, D) of power series."""
    V, P, D = entered
    formula: Any = getattr(remaining_time, "py_func", remaining_time)
    side: Any = Restoring
    remaining: PowerSeries = formula(V, side(2.0 - P, -D, 0.0, delta, eta, 0.0), side(P, D, 0.0, delta, eta, 0.0))
    return remaining


def extrapolated(remaining: Series, passed: Series, eta: float) -> tuple[Series, Series]:
    """Extrapolate the closures of successive pairs, as ``closure.extrapolate``: last column, and its last changes."""
    weights = getattr(richardson_weights, "py_func", richardson_weights)(eta)
    column = less = remaining
    for k, weight in enumerate(weights):
        less = column[1:]
        column = less + (less - column[:-1] + passed[k + 1 :]) * weight
    from_level = column - less
    from_pair = column[1:] - column[:-1] + passed[-column.shape[0] + 1 :]
    return column[1:], np.maximum(np.abs(from_level[1:]), np.abs(from_pair))


def first_impact(delta: float, eta: float, order: int) -> tuple[Series, Series]:
    """Phase of the first impact, over r, and v, p, d after it; shapes (1, order), (1, 3, order)."""
    phase = np.zeros((1, order))
    entered = np.zeros((1, 3, order))
    start = -square_root_of_two_plus(order)
    phase[0], w, p, d = series_arc(np.zeros(order), np.zeros(order), start, True, delta)
    entered[0, 0] = eta * w
    entered[0, 1] = p
    entered[0, 2] = d
    return phase, entered


def impact_pairs(start: Series, delta: float, eta: float, count: int) -> tuple[Series, Series]:
    """Phase passed, over r, in each of the next pairs of impacts, and v, p, d after it; ``start``: those before."""
    order = start.shape[1]
    passed = np.zeros((count, order))
    entered = np.zeros((count, 3, order))
    v, p, d = start[0].copy(), start[1].copy(), start[2].copy()
    for n in range(count):
        second, w, p, d = series_arc(v, p, d, False, delta)
        first, w, p, d = series_arc(eta * w, p, d, True, delta)
        v = eta * w
        passed[n] = first + raised(second, 1)
        entered[n, 0] = v
        entered[n, 1] = p
        entered[n, 2] = d
    return passed, entered


@allocating
def series_arc(
    v: Series, p: Series, d: Series, first_side: bool, delta: float
) -> tuple[Series, Series, Series, Series]:
    """One arc: scaled duration z and impact speed, p and d at the impact."""
    order = v.size
    mean = -raised(p, 1)
    mean[0] += 1.0
    lift = 1 if first_side else 3
    pull = p.copy()
    slope_term = d
    mean_term = mean
    if not first_side:
        pull = -raised(p, 1)
        pull[0] += 2.0
        slope_term = -raised(d, 2)
        mean_term = -raised(mean, 3)
    z = np.zeros(order)
    z[0] = leading_duration(v[0], p[0], d[0]) if first_side else v[0]
    correct = 1
    while True:
        q = raised(product(z, z), lift)
        sine, versine, E, W = series_basis(q, delta)
        A = sine + (1.0 + delta) * product(q, E)
        B = versine + (1.0 + delta) * product(q, W)
        bend = versine + delta * product(q, W)
        grown = v + delta * product(v, product(q, B))
        height = product(v, A) - product(
            z, product(pull, B) + product(z, product(slope_term, E) + product(z, product(mean_term, W)))
        )
        speed = grown - product(
            z, product(pull, A) + product(z, product(slope_term, bend) + product(z, product(mean_term, E)))
        )
        if correct >= 2 * order:
            break
        z = z - quotient(product(height, z), speed - height)
        correct *= 2
    turned = product(q, versine)
    swept = product(z, sine)
    if first_side:
        p_impact = p + product(product(z, z), product(versine, mean)) + product(d, swept)
        d_impact = d - product(turned, d) + product(mean, swept)
    else:
        p_impact = p + raised(product(product(z, z), product(versine, mean)), 2) + raised(product(d, swept), 1)
        d_impact = d - product(turned, d) + raised(product(mean, swept), 1)
    return z, -speed, p_impact, d_impact


@allocating
def leading_duration(v: float, p: float, d: float) -> float:
    """Duration of a first-side arc to leading order (the cubic of Eq. 62)."""
    if v == 0.0:
        return -4.0 * d
    return positive_root(d / 6.0, p / 2.0, v)


@allocating
def series_basis(q: Series, delta: float) -> tuple[Series, Series, Series, Series]:
    """Return the four basis functions of ``basis.Basis`` at a series q without constant term."""
    order = q.size
    sine = np.zeros(order)
    versine = np.zeros(order)
    E = np.zeros(order)
    W = np.zeros(order)
    power = np.zeros(order)
    power[0] = 1.0
    mixed = power.copy()
    factor = 1.0
    for m in range(order):
        sine += factor * power
        versine += factor / (2 * m + 2) * power
        factor /= (2 * m + 2) * (2 * m + 3)
        E += factor * mixed
        W += factor / (2 * m + 4) * mixed
        power = -product(q, power)
        mixed = delta * product(q, mixed) + power
    return sine, versine, E, W


def square_root_of_two_plus(order: int) -> Series:
    """Series of sqrt(2 + eps)."""
    root = np.zeros(order)
    term = math.sqrt(2.0)
    for k in range(order):
        root[k] = term
        term *= (0.5 - k) / (2.0 * (k + 1))
    return root


@allocating
def product(a: Series, b: Series) -> Series:
    """Multiply, truncated."""
    c = np.zeros(a.size)
    for i in range(a.size):
        if a[i] != 0.0:
            for j in range(a.size - i):
                c[i + j] += a[i] * b[j]
    return c


@allocating
def quotient(a: Series, b: Series) -> Series:
    """Divide, truncated."""
    c = np.zeros(a.size)
    for n in range(a.size):
        total = a[n]
        for k in range(n):
            total -= c[k] * b[n - k]
        c[n] = total / b[0]
    return c


@allocating
def raised(a: Series, power: int) -> Series:
    """Multiply by eps^power."""
    b = np.zeros(a.size)
    for k in range(power, a.size):
        b[k] = a[k - power]
    return b
