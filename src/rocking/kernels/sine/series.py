"""Expansion of the chattering time in eps = a - 1, consistent in all powers, by power series.

With r = sqrt(eps), every quantity is a power of r times a series in eps: phases x = r(...), first-side arcs t = r z,
second-side arcs t = r^3 z, speeds V = r^3 v, restoring acceleration P = eps p, slope D = r d. Therefore the exact
impact map acts on coefficient arrays, whose sums are extrapolated to rest like numbers.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.remaining import ImpactSide, estimate_remaining_time
from rocking.kernels.sine.sequence import LEVELS, MIN_MOVING_SPEED, compute_richardson_weights


class PowerSeries:
    """Truncated sums r^lowest (c_0 + c_1 r^2 + c_2 r^4 + ...); coefficients along the first axis.

    Addition requires powers that are all even or all odd. The number of terms is constant.
    """

    __slots__ = ("coefficients", "lowest")

    def __init__(self, coefficients: Floats, lowest: int) -> None:
        self.coefficients = coefficients
        self.lowest = lowest

    def coefficients_from_power(self, lowest: int) -> Floats:
        """Return the coefficients from a lower power on, without the last ones."""
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
        return PowerSeries(self.coefficients_from_power(lowest) + other.coefficients_from_power(lowest), lowest)

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
        """Compute the reciprocal."""
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


Series = Floats
ThreeSeries = tuple[Series, Series, Series]
FourSeries = tuple[Series, Series, Series, Series]

#: Relative change of each coefficient by the last extrapolation at which its result is accepted.
_EXTRAPOLATION_TOLERANCE: Final = 1e-14

_MAX_PAIRS: Final = 100_000

#: Number of pairs in the first batch: until the speed has decreased by exp(-4.6), and some more.
_BATCH_DECAY: Final = 2.3
_EXTRA_PAIRS: Final = 3


def compute_phase_coefficients(delta: float, eta: float, order: int) -> Series:
    """Compute ``order`` coefficients c_k of omega tau_ch = sqrt(eps) (c_0 + c_1 eps + ...); all NaN: not resolved."""
    count = LEVELS + _EXTRA_PAIRS + int(_BATCH_DECAY / -math.log(eta))
    elapsed, entries = expand_first_impact(delta, eta, order)
    while elapsed.shape[0] < _MAX_PAIRS:
        new_elapsed, new_entries = expand_impact_pairs(entries[-1], delta, eta, count)
        elapsed = np.concatenate((elapsed, new_elapsed))
        entries = np.concatenate((entries, new_entries))
        v, p, d = entries.transpose(1, 2, 0)
        state = PowerSeries(v, 3), PowerSeries(p, 2), PowerSeries(d, 1)
        with np.errstate(over="ignore", invalid="ignore"):
            remaining = expand_remaining_phase(state, delta, eta).coefficients_from_power(1)
            rest, change = extrapolate_series(remaining.T, elapsed, eta)
        x = np.cumsum(elapsed, axis=0)[-change.shape[0] :]
        converged_rows = np.flatnonzero((change <= _EXTRAPOLATION_TOLERANCE * np.abs(x)).all(axis=1))
        if converged_rows.size:
            coefficients: Series = x[converged_rows[0]] + rest[converged_rows[0]]
            return coefficients
        if not np.isfinite(change).all():
            break
        count = elapsed.shape[0]
    return np.full(order, math.nan)


def expand_remaining_phase(
    entries: tuple[PowerSeries, PowerSeries, PowerSeries], delta: float, eta: float
) -> PowerSeries:
    """Evaluate the uncompiled formula of `estimate_remaining_time` for a state (V, P, D) of power series."""
    V, P, D = entries
    formula: Any = getattr(estimate_remaining_time, "py_func", estimate_remaining_time)
    side: Any = ImpactSide
    remaining: PowerSeries = formula(V, side(2.0 - P, -D, 0.0, delta, eta, 0.0), side(P, D, 0.0, delta, eta, 0.0))
    return remaining


def extrapolate_series(remaining: Series, elapsed: Series, eta: float) -> tuple[Series, Series]:
    """Extrapolate the estimates of successive pairs, as `sequence.extrapolate`: last column and its changes."""
    weights = getattr(compute_richardson_weights, "py_func", compute_richardson_weights)(eta)
    column = previous = remaining
    for k, weight in enumerate(weights):
        previous = column[1:]
        column = previous + (previous - column[:-1] + elapsed[k + 1 :]) * weight
    from_level = column - previous
    from_pair = column[1:] - column[:-1] + elapsed[-column.shape[0] + 1 :]
    return column[1:], np.maximum(np.abs(from_level[1:]), np.abs(from_pair))


def expand_first_impact(delta: float, eta: float, order: int) -> tuple[Series, Series]:
    """Compute phase divided by r and v, p, d after the first impact; shapes (1, order), (1, 3, order)."""
    start = np.zeros((3, order))
    start[2] = -expand_root_of_two_plus(order)
    return _expand_arcs(start, True, delta, eta, 1)


def expand_impact_pairs(start: Series, delta: float, eta: float, count: int) -> tuple[Series, Series]:
    """Compute phases divided by r and v, p, d after the next pairs of impacts, from those in ``start``."""
    durations, states = _expand_arcs(start, False, delta, eta, 2 * count)
    elapsed = durations[1::2]
    elapsed[:, 1:] += durations[::2, :-1]
    return elapsed, states[1::2]


def _expand_arcs(start: Series, is_first_side: bool, delta: float, eta: float, count: int) -> tuple[Series, Series]:
    """Compute scaled durations of arcs on alternating sides, and v, p, d after their impacts."""
    order = start.shape[1]
    durations, states = np.zeros((count, order)), np.zeros((count, 3, order))
    write_arc_series(start, is_first_side, delta, eta, np.empty((_SCRATCH_ROWS, order)), durations, states)
    return durations, states


def expand_root_of_two_plus(order: int) -> Series:
    """Return the series of sqrt(2 + eps)."""
    root = np.zeros(order)
    term = math.sqrt(2.0)
    for k in range(order):
        root[k] = term
        term *= (0.5 - k) / (2.0 * (k + 1))
    return root


@kernel
def write_arc_series(
    start: Series, is_first_side: bool, delta: float, eta: float, scratch: Series, durations: Series, states: Series
) -> None:
    """Write the results of `_expand_arcs`; ``scratch`` is scratch space of `_SCRATCH_ROWS` series."""
    state = start
    for n in range(durations.shape[0]):
        is_uplift = n == 0 and is_first_side  # at zero speed
        if state[0, 0] < MIN_MOVING_SPEED and not is_uplift:
            write_resting_arc(state, durations[n], states[n])
        else:
            expand_series_arc(state, is_first_side, delta, scratch, durations[n], states[n])
        state, is_first_side = states[n], not is_first_side
        for k in range(start.shape[1]):
            state[0, k] *= eta


@inlined
def write_resting_arc(state: Series, z: Series, end: Series) -> None:
    """Write the unchanged state of a block at rest, as in `solve_next_arc`."""
    for k in range(z.size):
        z[k] = end[0, k] = 0.0
        end[1, k], end[2, k] = state[1, k], state[2, k]


#: Number of series in the scratch space of `expand_series_arc`.
_SCRATCH_ROWS: Final = 17


@inlined
def expand_series_arc(
    state: Series, is_first_side: bool, delta: float, scratch: Series, z: Series, end: Series
) -> None:
    """Compute one arc from v, p, d: its scaled duration z, and impact speed, p and d at its end."""
    order = z.size
    mean, q, height, speed, work = scratch[0], scratch[4], scratch[9], scratch[10], scratch[11:]
    forces, basis = (scratch[1], scratch[2], scratch[3]), (scratch[5], scratch[6], scratch[7], scratch[8])
    _write_forces(state, is_first_side, mean, forces)
    for k in range(order):
        z[k] = 0.0
    z[0] = estimate_leading_duration(state[0, 0], state[1, 0], state[2, 0]) if is_first_side else state[0, 0]
    correct_terms = 1
    while True:
        _multiply(z, z, work[0])
        _shift_powers(work[0], 1 if is_first_side else 3, 1.0, q)
        write_series_basis(q, delta, work, basis)
        _write_height_and_speed(state[0], z, q, basis, forces, delta, work, height, speed)
        if correct_terms >= 2 * order:
            break
        _multiply(height, z, work[0])
        for k in range(order):
            work[1, k] = speed[k] - height[k]
        _divide(work[0], work[1], work[2])
        for k in range(order):
            z[k] -= work[2, k]
        correct_terms *= 2
    _write_end_state(state, is_first_side, mean, z, q, basis, work, end)
    for k in range(order):
        end[0, k] = -speed[k]


@inlined
def _write_forces(state: Series, is_first_side: bool, mean: Series, forces: ThreeSeries) -> None:
    """Write the restoring forces: mean, and coefficients of degrees 0, 1 and 2 in time."""
    _shift_powers(state[1], 1, -1.0, mean)
    mean[0] += 1.0
    if is_first_side:
        _shift_powers(state[1], 0, 1.0, forces[0])
        _shift_powers(state[2], 0, 1.0, forces[1])
        _shift_powers(mean, 0, 1.0, forces[2])
    else:
        _shift_powers(state[1], 1, -1.0, forces[0])
        forces[0][0] += 2.0
        _shift_powers(state[2], 2, -1.0, forces[1])
        _shift_powers(mean, 3, -1.0, forces[2])


@inlined
def _write_height_and_speed(
    v: Series, z: Series, q: Series, basis: FourSeries, forces: ThreeSeries, delta: float,
    work: Series, height: Series, speed: Series,
) -> None:  # fmt: skip
    """Write height divided by z, and speed, after the duration z."""
    sine, versine, E, W = basis
    A, B, bend, product = work[2], work[3], work[4], work[5]
    _multiply(q, E, A)
    _multiply(q, W, B)
    for k in range(z.size):
        bend[k] = versine[k] + delta * B[k]
        A[k] = sine[k] + (1.0 + delta) * A[k]
        B[k] = versine[k] + (1.0 + delta) * B[k]
    _write_forcing(z, forces, (B, E, W), work, height)
    _write_forcing(z, forces, (A, bend, E), work, speed)
    _multiply(v, A, product)
    for k in range(z.size):
        height[k] = product[k] - height[k]
    _multiply(q, B, product)
    _multiply(v, product, A)
    for k in range(z.size):
        speed[k] = (v[k] + delta * A[k]) - speed[k]


@inlined
def _write_end_state(
    state: Series, is_first_side: bool, mean: Series, z: Series, q: Series, basis: FourSeries, work: Series, end: Series
) -> None:
    """Write p and d at the end of an arc. In the second arc of a pair, the phase has the additional factor r^2."""
    sine, versine, _, _ = basis
    product, factor, slope_drop, sine_term, versine_term = work[0], work[1], work[2], work[3], work[4]
    _multiply(versine, mean, product)
    _multiply(z, z, factor)
    _multiply(factor, product, versine_term)
    _multiply(q, versine, product)
    _multiply(product, state[2], slope_drop)
    _multiply(z, sine, factor)
    _multiply(state[2], factor, sine_term)
    _multiply(mean, factor, product)
    shift = 0 if is_first_side else 1
    for k in range(z.size):
        end[1, k] = state[1, k]
        end[2, k] = state[2, k] - slope_drop[k]
        if k >= 2 * shift:
            end[1, k] += versine_term[k - 2 * shift]
        if k >= shift:
            end[1, k] += sine_term[k - shift]
            end[2, k] += product[k - shift]


@inlined
def estimate_leading_duration(v: float, p: float, d: float) -> float:
    """Compute the duration of a first-side arc to leading order (the cubic of Eq. 62)."""
    if v == 0.0:
        return -4.0 * d
    return find_positive_root(d / 6.0, p / 2.0, v)


@not_inlined
def write_series_basis(q: Series, delta: float, work: Series, basis: FourSeries) -> None:
    """Compute sine, versine, E and W of `sine.arc.Basis` at a series q without constant term."""
    sine, versine, E, W = basis
    power, mixed, product = work[0], work[1], work[2]
    order = q.size
    for k in range(order):
        sine[k] = versine[k] = E[k] = W[k] = power[k] = mixed[k] = 0.0
    power[0] = mixed[0] = 1.0
    factor = 1.0
    for m in range(order):
        for k in range(order):
            sine[k] += factor * power[k]
            versine[k] += factor / (2 * m + 2) * power[k]
        factor /= (2 * m + 2) * (2 * m + 3)
        for k in range(order):
            E[k] += factor * mixed[k]
            W[k] += factor / (2 * m + 4) * mixed[k]
        _multiply(q, power, product)
        for k in range(order):
            power[k] = -product[k]
        _multiply(q, mixed, product)
        for k in range(order):
            mixed[k] = delta * product[k] + power[k]


@inlined
def _write_forcing(z: Series, forces: ThreeSeries, basis: ThreeSeries, work: Series, effect: Series) -> None:
    """Write the effect of the forces of degrees 0, 1 and 2 in time during z: z (f0 b0 + z (f1 b1 + z f2 b2))."""
    product, total = work[0], work[1]
    _multiply(forces[2], basis[2], product)
    _multiply(z, product, total)
    for i in (1, 0):
        _multiply(forces[i], basis[i], product)
        for k in range(z.size):
            product[k] += total[k]
        _multiply(z, product, total)
    for k in range(z.size):
        effect[k] = total[k]


@not_inlined
def _multiply(a: Series, b: Series, c: Series) -> None:
    """Write the truncated product of two series into a third one."""
    for k in range(c.size):
        c[k] = 0.0
    for i in range(a.size):
        if a[i] != 0.0:
            for j in range(a.size - i):
                c[i + j] += a[i] * b[j]


@inlined
def _divide(a: Series, b: Series, c: Series) -> None:
    """Write the truncated quotient of two series into a third one."""
    for n in range(a.size):
        total = a[n]
        for k in range(n):
            total -= c[k] * b[n - k]
        c[n] = total / b[0]


@inlined
def _shift_powers(a: Series, power: int, sign: float, b: Series) -> None:
    """Write a series times eps^power, or its negative, into another one."""
    for k in range(a.size):
        b[k] = sign * a[k - power] if k >= power else 0.0


# ---- Expansion of the paper (Eq. 65) ----
# In Eqs 57, 60, 62 and 64, amplitude and frequency cancel if durations are in units of sqrt(eps)/omega and
# eps^(3/2)/omega, with eps = a - 1. Then z = omega T_{n;1}, y = omega sigma_{n;1} and v = -omega Phi^(1)_{n;3} depend
# on eta alone.

_ROOT2: Final = math.sqrt(2.0)

#: Omitted part of the sum in Eq. 65, relative to the sum.
_NEGLIGIBLE: Final = 1e-17

_MAX_NEWTON_STEPS: Final = 60


@kernel
def sum_eq65(eta: float) -> tuple[float, float]:
    """Return the sums of omega T_{n;1} (n even) and omega T_{n;3} (n odd) in Eq. 65; infinite for eta = 1 and NaN."""
    if not eta < 1.0:
        return math.inf, math.inf
    y = 0.0
    third = 0.0
    v = 0.0
    z = math.inf
    while not is_negligible(z, y, eta):
        z, odd, v = solve_eq65_pair(y, v, eta)
        y += z
        third += odd
    return y, third


@kernel
def write_eq65_terms(eta: float, first: Floats, third: Floats) -> int:
    """Write omega T_{n;1} and omega T_{n+1;3} until they vanish or no more fit; return their number."""
    y = 0.0
    v = 0.0
    for pair in range(first.size):
        first[pair], third[pair], v = solve_eq65_pair(y, v, eta)
        y += first[pair]
        if is_negligible(first[pair], y, eta):
            return pair + 1
    return first.size


@inlined
def is_negligible(z: float, y: float, eta: float) -> bool:
    """Return whether all terms after z, nearly a geometric series, are negligible compared with their sum y."""
    return z <= _NEGLIGIBLE * (1.0 - eta * eta) * y


@inlined
def solve_eq65_pair(y: float, v: float, eta: float) -> tuple[float, float, float]:
    """Compute steps 2 and 3 of the paper's iterative procedure: omega T_{n;1}, omega T_{n+1;3} and v of the next pair.

    The cubic of Eq. 62, z^3/24 + c2 z^2 + c1 z = v, has one positive root: from the second pair on, its coefficients
    are positive because y > 2 sqrt(2). In the first (y = v = 0) it is Eq. 31.
    """
    c2 = (y - _ROOT2) / 6.0
    c1 = y * (y - 2.0 * _ROOT2) / 4.0
    z = 4.0 * _ROOT2 if y == 0.0 else find_positive_root(c2, c1, v)
    speed_before = z * (c1 + z * (2.0 * c2 + z / 8.0))
    odd = eta * speed_before
    return z, odd, eta * odd


@inlined
def find_positive_root(c2: float, c1: float, v: float) -> float:
    """Find the root of z^3/24 + c2 z^2 + c1 z - v, all positive, by Newton steps from above (the cubic is convex)."""
    z = min(v / c1, math.sqrt(v / c2))
    for _ in range(_MAX_NEWTON_STEPS):
        excess = z * (c1 + z * (c2 + z / 24.0)) - v
        step = excess / (c1 + z * (2.0 * c2 + z / 8.0))
        z -= step
        if step <= 1e-16 * z:
            break
    return z
