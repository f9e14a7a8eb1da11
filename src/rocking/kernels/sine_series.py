"""The consistent expansion of the chattering time: the impact map in truncated power series.

With r = sqrt(eps) every quantity is a power of r times a series in eps = a - 1: phases x = r(...), first-side arcs
t = r z, second-side arcs t = r^3 z, speeds V = r^3 v, restoring acceleration P = eps p, slope D = r d. So the exact
impact map of ``sine`` acts on coefficient arrays; its sums are closed as those of numbers are.
"""

import math
from typing import Final

import numba
import numpy as np
from numpy.typing import NDArray

from rocking.kernels.paper import positive_root
from rocking.kernels.sine import LEVELS

Series = NDArray[np.float64]

#: Relative size of the last extrapolation, coefficient by coefficient, at which it is taken.
_CLOSED: Final = 1e-14

_MAXIMUM_PAIRS: Final = 100_000

#: These kernels allocate their arrays of coefficients, unlike all others.
_allocating = numba.njit(cache=True, error_model="numpy")


@_allocating
def phase_coefficients(delta: float, eta: float, order: int) -> Series:
    """Coefficients c_k of omega tau_ch = sqrt(eps) (c_0 + c_1 eps + ...), ``order`` of them; NaN: not resolved."""
    p = np.zeros(order)
    d = -square_root_of_two_plus(order)
    x, w, p, d = series_arc(np.zeros(order), p, d, True, delta)
    v = eta * w
    table = np.zeros((LEVELS + 1, order))
    gone = np.zeros(order)
    for pair in range(_MAXIMUM_PAIRS):
        expected = table[LEVELS] - gone
        extrapolate_series(table, series_closure(v, p, d, eta), gone, eta * eta)
        remaining = table[LEVELS]
        change = np.maximum(np.abs(remaining - table[LEVELS - 1]), np.abs(remaining - expected))
        if not np.all(np.isfinite(change)):
            break
        if pair > LEVELS and np.all(change <= _CLOSED * np.abs(x)):
            return x + remaining
        second, w, p, d = series_arc(v, p, d, False, delta)
        first, w, p, d = series_arc(eta * w, p, d, True, delta)
        v = eta * w
        gone = first + raised(second, 1)
        x = x + gone
    return np.full(order, math.nan)


@_allocating
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


@_allocating
def leading_duration(v: float, p: float, d: float) -> float:
    """Duration of a first-side arc to leading order (the cubic of Eq. 62)."""
    if v == 0.0:
        return -4.0 * d
    return positive_root(d / 6.0, p / 2.0, v)


@_allocating
def series_basis(q: Series, delta: float) -> tuple[Series, Series, Series, Series]:
    """Return the four basis functions of ``sine.basis`` at a series q without constant term."""
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


@_allocating
def series_closure(v: Series, p: Series, d: Series, eta: float) -> Series:
    """Remaining phase over r to second order in the speed, as ``sine.closure``."""
    pull = -raised(p, 1)
    pull[0] += 2.0
    up = reciprocal(pull)
    down = reciprocal(p)
    scale = 2.0 / (1.0 - eta * eta)
    first_up = scale * (raised(up, 1) + eta * down)
    first_down = scale * (down + eta * raised(up, 1))
    up2 = product(up, up)
    down2 = product(down, down)
    drift_up = scale * product(d, raised(up2, 2) - eta * down2)
    drift_down = scale * product(d, eta * raised(up2, 3) - raised(down2, 1))
    own_up = product(
        product(d, up2), (4.0 / 3.0) * raised(up, 3) - (2.0 / 3.0) * eta * raised(first_down, 2)
    ) + 2.0 * eta * product(up, drift_down)
    own_down = product(product(d, down2), (2.0 / 3.0) * eta * first_up - (4.0 / 3.0) * down) + 2.0 * eta * product(
        down, drift_up
    )
    second = (own_up + eta * eta * own_down) / (1.0 - eta**4)
    return product(v, first_up + product(v, second))


@_allocating
def extrapolate_series(table: Series, T: Series, gone: Series, Q: float) -> None:
    """Add one closure to the last row of Richardson's table, as ``sine.extrapolate``."""
    power = Q * Q
    for k in range(LEVELS + 1):
        power *= Q
        old = table[k] - gone
        table[k] = T
        T = T + (T - old) * (power / (1.0 - power))


@_allocating
def square_root_of_two_plus(order: int) -> Series:
    """Series of sqrt(2 + eps)."""
    root = np.zeros(order)
    term = math.sqrt(2.0)
    for k in range(order):
        root[k] = term
        term *= (0.5 - k) / (2.0 * (k + 1))
    return root


@_allocating
def product(a: Series, b: Series) -> Series:
    """Multiply, truncated."""
    c = np.zeros(a.size)
    for i in range(a.size):
        if a[i] != 0.0:
            for j in range(a.size - i):
                c[i + j] += a[i] * b[j]
    return c


@_allocating
def quotient(a: Series, b: Series) -> Series:
    """Divide, truncated."""
    c = np.zeros(a.size)
    for n in range(a.size):
        total = a[n]
        for k in range(n):
            total -= c[k] * b[n - k]
        c[n] = total / b[0]
    return c


@_allocating
def reciprocal(a: Series) -> Series:
    """Invert, truncated."""
    one = np.zeros(a.size)
    one[0] = 1.0
    return quotient(one, a)


@_allocating
def raised(a: Series, power: int) -> Series:
    """Multiply by eps^power."""
    b = np.zeros(a.size)
    for k in range(power, a.size):
        b[k] = a[k - power]
    return b
