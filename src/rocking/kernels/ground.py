"""The ground acceleration as kernels read it: a polynomial on each piece, in units of g, and zero after the last.

A row of `Ground.pieces` is one piece: start (s), length (s), coefficients in powers of the time since the start. The
last row has no end and no acceleration, so that nothing here or above needs to ask whether the motion is over.
"""

from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, kernel, shared

#: Relative allowance for rounding in bounds.
ROUNDING = 2.0**-48

#: Pieces of one stretch: `next_beyond` passes over whole stretches.
STRETCH = 32

#: Pieces that a window may span; longer windows wait for a slower impact.
_LONGEST_WINDOW = 256

_START, _LENGTH, _FIRST = 0, 1, 2


class Ground(NamedTuple):
    """A motion: its pieces, the least and greatest value on each stretch of them, and its approximation error (g)."""

    pieces: Floats
    stretches: Floats
    error: float


class Window(NamedTuple):
    """Bounds on the acceleration over some time: least, greatest, steepest slope, sum of all jumps."""

    low: float
    high: float
    slope: float
    jumps: float


def ground_of(breakpoints: Floats, coefficients: Floats, unit: float, error: float) -> Ground:
    """Ground from a motion's breakpoints (s), coefficients and error, all times ``unit``."""
    columns = max(2, coefficients.shape[1])
    pieces = np.zeros((len(coefficients) + 1, _FIRST + columns))
    stretches = np.zeros((-(-len(pieces) // STRETCH), 2))
    lay_out(breakpoints, coefficients, unit, pieces, stretches)
    return Ground(pieces, stretches, error * unit)


@kernel
def lay_out(breakpoints: Floats, coefficients: Floats, unit: float, pieces: Floats, stretches: Floats) -> None:
    """Fill the rows of the pieces, and the bounds on whole stretches of them, rounding included."""
    last = coefficients.shape[0]
    for k in range(last):
        pieces[k, _START] = breakpoints[k]
        pieces[k, _LENGTH] = breakpoints[k + 1] - breakpoints[k]
        for j in range(coefficients.shape[1]):
            pieces[k, _FIRST + j] = coefficients[k, j] * unit
    pieces[last, _START] = breakpoints[last]
    pieces[last, _LENGTH] = np.inf
    for k in range(stretches.shape[0]):
        stretches[k, 0], stretches[k, 1] = np.inf, -np.inf
    for k in range(last + 1):
        low, high = piece_bounds(pieces, k, last)
        stretch = k // STRETCH
        stretches[stretch, 0] = min(stretches[stretch, 0], low)
        stretches[stretch, 1] = max(stretches[stretch, 1], high)


@inlined
def piece_bounds(pieces: Floats, piece: int, last: int) -> tuple[float, float]:
    """Bounds on one piece, from the sizes of its terms."""
    low = high = pieces[piece, _FIRST]
    size = abs(low)
    power = 1.0
    for k in range(_FIRST + 1, pieces.shape[1] if piece < last else 0):
        power *= pieces[piece, _LENGTH]
        term = pieces[piece, k] * power
        low, high, size = low + min(term, 0.0), high + max(term, 0.0), size + abs(term)
    return low - 2.0 * ROUNDING * size, high + 2.0 * ROUNDING * size


@inlined
def last_piece(ground: Ground) -> int:
    """Index of the piece without end, in which the motion is over."""
    return ground.pieces.shape[0] - 1


@inlined
def start_of(ground: Ground, piece: int) -> float:
    """Time at which a piece starts."""
    return ground.pieces[piece, _START]


@inlined
def length_of(ground: Ground, piece: int) -> float:
    """Length of a piece; infinite for the last."""
    return ground.pieces[piece, _LENGTH]


@inlined
def columns_of(ground: Ground) -> int:
    """Count the coefficients of a piece."""
    return ground.pieces.shape[1] - _FIRST


@inlined
def coefficient(ground: Ground, piece: int, power: int) -> float:
    """Coefficient of a power of the time since a piece's start."""
    return ground.pieces[piece, _FIRST + power]


@inlined
def acceleration(ground: Ground, piece: int, offset: float) -> float:
    """Ground acceleration within a piece, g."""
    value = 0.0
    for k in range(columns_of(ground) - 1, -1, -1):
        value = value * offset + ground.pieces[piece, _FIRST + k]
    return value


@inlined
def slope(ground: Ground, piece: int, offset: float) -> float:
    """Rate of the ground acceleration within a piece, g/s."""
    value = 0.0
    for k in range(columns_of(ground) - 1, 0, -1):
        value = value * offset + k * ground.pieces[piece, _FIRST + k]
    return value


@inlined
def local_series(ground: Ground, piece: int, offset: float, sign: float, A: Floats) -> int:
    """Put a piece's polynomial about ``offset``, times ``sign``, into A; returns its degree."""
    degree = columns_of(ground) - 1
    for k in range(degree + 1):
        A[k] = sign * ground.pieces[piece, _FIRST + k]
    while degree > 0 and A[degree] == 0.0:
        degree -= 1
    if offset > 0.0:
        move(A, degree, offset)
    return degree


@inlined
def move(c: Floats, degree: int, t: float) -> None:
    """Centre of a polynomial moved by t, in place."""
    for k in range(degree):
        for j in range(degree - 1, k - 1, -1):
            c[j] += t * c[j + 1]


@inlined
def bounds_within(ground: Ground, piece: int, offset: float, window: float, A: Floats) -> Window:
    """Bounds over [offset, offset + window] of one piece, with ``jumps`` the allowance for rounding in the others.

    Exact but for rounding for degree 1, else tight. ``A`` is scratch space.
    """
    columns = columns_of(ground)
    if columns == 2:
        rate = ground.pieces[piece, _FIRST + 1]
        first = ground.pieces[piece, _FIRST] + rate * offset
        last = first + rate * window if rate != 0.0 else first
        rounding = ROUNDING * (abs(ground.pieces[piece, _FIRST]) + max(abs(first), abs(last)))
        return Window(min(first, last) - rounding, max(first, last) + rounding, abs(rate), rounding)
    degree = local_series(ground, piece, offset, 1.0, A)
    low = high = A[0]
    steepest = 0.0
    power = 1.0
    for k in range(1, degree + 1):
        steepest += k * abs(A[k]) * power
        power *= window
        low += min(0.0, A[k] * power)
        high += max(0.0, A[k] * power)
    size, size_of_slope = sizes(ground, piece, offset + window if degree > 0 else offset)
    rounding = ROUNDING * columns * size
    return Window(low - rounding, high + rounding, steepest + ROUNDING * columns * size_of_slope, rounding)


@inlined
def sizes(ground: Ground, piece: int, t: float) -> tuple[float, float]:
    """Sizes of the terms of a piece and of its slope at t, added up: what their rounding is a fraction of."""
    size = size_of_slope = 0.0
    for k in range(columns_of(ground) - 1, -1, -1):
        size_of_slope = size_of_slope * t + size
        size = size * t + abs(ground.pieces[piece, _FIRST + k])
    return size, size_of_slope


@shared
def bounds_over(
    ground: Ground, piece: int, offset: float, window: float, limits: tuple[float, float], A: Floats
) -> Window:
    """Bounds over a window that starts in a piece, rounding included; ``A`` is scratch space.

    NaN where they are not within limits, or the window spans too many pieces.
    """
    low, high, steepest, jumps = np.inf, -np.inf, 0.0, 0.0
    for _ in range(_LONGEST_WINDOW):
        left = length_of(ground, piece) - offset
        here = bounds_within(ground, piece, offset, min(window, left), A)
        low, high, steepest = min(low, here.low), max(high, here.high), max(steepest, here.slope)
        if low < limits[0] or high > limits[1]:
            break
        if window <= left:
            return Window(low, high, steepest, jumps)
        end = acceleration(ground, piece, length_of(ground, piece))
        jumps += abs(coefficient(ground, piece + 1, 0) - end) + here.jumps
        window -= left
        piece += 1
        offset = 0.0
    return Window(np.nan, np.nan, np.nan, np.nan)


@inlined
def next_beyond(ground: Ground, piece: int, below: float, above: float) -> int:
    """First piece from this one on whose stretch passes out of [below, above]; the last one where none does."""
    while piece < last_piece(ground):
        stretch = piece // STRETCH
        if ground.stretches[stretch, 0] < below or ground.stretches[stretch, 1] > above:
            return piece
        piece = (stretch + 1) * STRETCH
    return last_piece(ground)
