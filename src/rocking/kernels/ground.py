"""The ground acceleration as kernels read it: a polynomial on each piece, in units of g, and zero after the last.

A row of `Ground.pieces` is one piece: start (s), length (s), coefficients in powers of the time since the start, those
of the vertical component, where there is one, after the horizontal ones. The last row has no end and no acceleration,
so that no function has to check whether the motion is over. Nothing here checks for NaN; it is passed on.
"""

from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel, shared

#: Relative allowance for rounding in bounds.
ROUNDING = 2.0**-48

#: Pieces of one stretch: `next_beyond` and `bounds_over` skip whole stretches.
STRETCH = 16

#: Pieces and whole stretches that a window may span.
_LONGEST_WINDOW = 128

#: Columns of a piece: start, length, first coefficient; and of the bounds on a stretch, which are those of a `Window`.
_START, _LENGTH, _FIRST = 0, 1, 2
_LOW, _HIGH, _SLOPE, _JUMPS = 0, 1, 2, 3


class Ground(NamedTuple):
    """One component of a motion.

    The motion's pieces; bounds on stretches of them, shape (stretches, components, 4); approximation error (g); number
    of coefficients of a component; column of this component's first one (the horizontal one's, but for `vertical_of`).
    """

    pieces: Floats
    stretches: Floats
    error: float
    columns: int
    first: int


class Window(NamedTuple):
    """Bounds on the acceleration over some time: least, greatest, steepest slope, sum of all jumps.

    The jump at the end of a stretch is one of its jumps.
    """

    low: float
    high: float
    slope: float
    jumps: float


def ground_of(
    breakpoints: Floats, coefficients: Floats, unit: float, error: float, vertical: Floats | None = None
) -> Ground:
    """Ground from a motion's breakpoints (s), coefficients of both components on the same pieces, and error.

    ``unit``: factor that makes of coefficients and error units of g.
    """
    components = [coefficients] if vertical is None else [coefficients, vertical]
    columns = max(2, *(component.shape[1] for component in components))
    pieces = np.zeros((len(coefficients) + 1, _FIRST + columns * len(components)))
    stretches = np.zeros((-(-len(pieces) // STRETCH), len(components), len(Window._fields)))
    ground = Ground(pieces, stretches, error * unit, columns, _FIRST)
    for k, component in enumerate(components):
        fill(breakpoints, component, unit, ground._replace(first=_FIRST + k * columns), np.zeros(columns))
    return ground


def components(ground: Ground, pieces: Integers) -> list[Floats]:
    """Coefficients (g, g/s, ...) of a motion on some pieces: horizontal ones, and vertical ones if it has any."""
    columns = ground.columns
    return [ground.pieces[pieces, _FIRST + k * columns :][:, :columns] for k in range(ground.stretches.shape[1])]


def greatest_weight(ground: Ground) -> float:
    """Greatest absolute value of the weight in the ground's frame, over that at rest."""
    return float(np.max(np.abs(1.0 + ground.stretches[:, 1:, _LOW : _HIGH + 1]), initial=1.0))


@kernel
def fill(breakpoints: Floats, coefficients: Floats, unit: float, ground: Ground, A: Floats) -> None:
    """Write the pieces of one component, and the bounds on stretches of them. ``A`` is scratch space."""
    pieces, last = ground.pieces, coefficients.shape[0]
    for k in range(last):
        pieces[k, _START] = breakpoints[k]
        pieces[k, _LENGTH] = breakpoints[k + 1] - breakpoints[k]
    for j in range(coefficients.shape[1]):
        column = pieces[:, ground.first + j]
        for k in range(last):
            column[k] = coefficients[k, j] * unit
    pieces[last, _START] = breakpoints[last]
    pieces[last, _LENGTH] = np.inf
    for stretch in range(ground.stretches.shape[0]):
        low, high, steepest, jumps = np.inf, -np.inf, 0.0, 0.0
        for k in range(stretch * STRETCH, min((stretch + 1) * STRETCH, last + 1)):
            piece = bounds_within(ground, k, 0.0, pieces[k, _LENGTH], A)
            low, high, steepest = min(low, piece.low), max(high, piece.high), max(steepest, piece.slope)
            jumps += piece.jumps + jump_after(ground, k) if k < last else 0.0
        row = ground.stretches[stretch, component_of(ground)]
        row[_LOW], row[_HIGH], row[_SLOPE], row[_JUMPS] = low, high, steepest, jumps


@inlined
def stretch_bounds(ground: Ground, stretch: int) -> Window:
    """Bounds on a stretch."""
    row = ground.stretches[stretch, component_of(ground)]
    return Window(row[_LOW], row[_HIGH], row[_SLOPE], row[_JUMPS])


@inlined
def component_of(ground: Ground) -> int:
    """Index of the component among the bounds on stretches: 0 for the horizontal one, 1 for the vertical one."""
    return 0 if ground.first == _FIRST else 1


@inlined
def has_vertical(ground: Ground) -> bool:
    """Whether the motion has a vertical component."""
    return ground.stretches.shape[1] > 1


@inlined
def vertical_of(ground: Ground) -> Ground:
    """Take the motion's vertical component in place of the horizontal one."""
    return Ground(ground.pieces, ground.stretches, ground.error, ground.columns, ground.first + ground.columns)


@inlined
def is_straight(ground: Ground) -> bool:
    """Whether the motion is linear in time on each piece, as records are."""
    return ground.columns == 2


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
def coefficient(ground: Ground, piece: int, power: int) -> float:
    """Coefficient of a power of the time since a piece's start."""
    return ground.pieces[piece, ground.first + power]


@inlined
def acceleration(ground: Ground, piece: int, offset: float) -> float:
    """Ground acceleration within a piece, g."""
    value = 0.0
    for k in range(ground.columns - 1, -1, -1):
        value = value * offset + ground.pieces[piece, ground.first + k]
    return value


@inlined
def slope(ground: Ground, piece: int, offset: float) -> float:
    """Rate of the ground acceleration within a piece, g/s."""
    value = 0.0
    for k in range(ground.columns - 1, 0, -1):
        value = value * offset + k * ground.pieces[piece, ground.first + k]
    return value


@inlined
def local_series(ground: Ground, piece: int, offset: float, sign: float, A: Floats) -> int:
    """Put a piece's polynomial about ``offset``, times ``sign``, into A; returns its degree."""
    degree = ground.columns - 1
    while degree > 0 and coefficient(ground, piece, degree) == 0.0:
        A[degree] = 0.0
        degree -= 1
    if offset == 0.0:
        for k in range(degree + 1):
            A[k] = sign * coefficient(ground, piece, k)
        return degree
    # Horner's rule, for all coefficients at once: unlike in `move` the sums of one turn do not depend on each other.
    A[0] = sign * coefficient(ground, piece, degree)
    for k in range(1, degree + 1):
        before = A[0]
        for j in range(1, k):
            here = A[j]
            A[j] = before + offset * here
            before = here
        A[k] = before
        A[0] = sign * coefficient(ground, piece, degree - k) + offset * A[0]
    return degree


@inlined
def move(c: Floats, degree: int, t: float) -> None:
    """Expand a polynomial about t, in place (repeated synthetic division)."""
    for k in range(degree):
        for j in range(degree - 1, k - 1, -1):
            c[j] += t * c[j + 1]


@inlined
def bounds_within(ground: Ground, piece: int, offset: float, window: float, A: Floats) -> Window:
    """Bounds over [offset, offset + window] of one piece; ``jumps`` is the allowance for rounding in the others.

    Exact but for rounding for degree 1. ``A`` is scratch space.
    """
    columns = ground.columns
    if columns == 2:
        rate = ground.pieces[piece, ground.first + 1]
        first = ground.pieces[piece, ground.first] + rate * offset
        last = first + rate * window if rate != 0.0 else first
        rounding = ROUNDING * (abs(ground.pieces[piece, ground.first]) + max(abs(first), abs(last)))
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
    size, size_of_slope = absolute_sums(ground, piece, offset + window if degree > 0 else offset)
    rounding = ROUNDING * columns * size
    return Window(low - rounding, high + rounding, steepest + ROUNDING * columns * size_of_slope, rounding)


@inlined
def absolute_sums(ground: Ground, piece: int, t: float) -> tuple[float, float]:
    """Return the sums of the |terms| of a piece and of its slope at t, of which rounding is a fraction."""
    size = size_of_slope = 0.0
    for k in range(ground.columns - 1, -1, -1):
        size_of_slope = size_of_slope * t + size
        size = size * t + abs(ground.pieces[piece, ground.first + k])
    return size, size_of_slope


@shared
def bounds_over(
    ground: Ground, piece: int, offset: float, window: float, limits: tuple[float, float], A: Floats
) -> Window:
    """Bounds over a window that starts in a piece, rounding included; ``A`` is scratch space.

    NaN where they are not within ``limits``, or the window spans too many pieces.
    """
    low, high, steepest, jumps = np.inf, -np.inf, 0.0, 0.0
    for _ in range(_LONGEST_WINDOW):
        if is_whole_stretch(ground, piece, offset, window):
            following = piece + STRETCH
            left = start_of(ground, following) - start_of(ground, piece)
            here = stretch_bounds(ground, piece // STRETCH)
        else:
            following = piece + 1
            left = length_of(ground, piece) - offset
            here = bounds_within(ground, piece, offset, min(window, left), A)
        low, high, steepest = min(low, here.low), max(high, here.high), max(steepest, here.slope)
        if low < limits[0] or high > limits[1]:
            break
        if window <= left:
            return Window(low, high, steepest, jumps)
        jumps += here.jumps
        if following == piece + 1:
            jumps += jump_after(ground, piece)
        window -= left
        piece, offset = following, 0.0
    return Window(np.nan, np.nan, np.nan, np.nan)


@inlined
def is_whole_stretch(ground: Ground, piece: int, offset: float, window: float) -> bool:
    """Whether a stretch starts here and ends within the window."""
    if piece % STRETCH != 0 or offset > 0.0 or piece + STRETCH > last_piece(ground):
        return False
    return bool(start_of(ground, piece + STRETCH) - start_of(ground, piece) < window)


@inlined
def jump_after(ground: Ground, piece: int) -> float:
    """Size of the motion's jump at the end of a piece."""
    return abs(coefficient(ground, piece + 1, 0) - acceleration(ground, piece, length_of(ground, piece)))


@inlined
def next_beyond(ground: Ground, piece: int, limits: tuple[float, float], added: tuple[float, float]) -> int:
    """First piece from this one on whose stretch is not within limits, times the weight, and what is added to them.

    The last one where none is.
    """
    below, above = limits
    while piece < last_piece(ground):
        stretch = piece // STRETCH
        weight = 1.0 + (stretch_bounds(vertical_of(ground), stretch).low if has_vertical(ground) else 0.0)
        bounds = stretch_bounds(ground, stretch)
        if bounds.low < below * weight + added[0] or bounds.high > above * weight + added[1]:
            return piece
        piece = (stretch + 1) * STRETCH
    return last_piece(ground)
