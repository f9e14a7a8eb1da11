"""Ground acceleration for kernels: a polynomial on each piece, in units of g, and zero after the last.

A row of `Ground.pieces` contains the start (s), the length (s), and the coefficients in powers of the time since the
start, of the horizontal and then of any vertical component. The last row has infinite length and zero acceleration, so
that no function needs to check whether the motion is over. NaN propagates unchecked.
"""

from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel, shared

#: Relative allowance for rounding in bounds.
ROUNDING = 2.0**-48

#: Pieces per stretch: `next_beyond` and `bounds_over` skip whole stretches.
STRETCH = 16

#: Largest number of pieces and whole stretches in a window.
_LONGEST_WINDOW = 128

#: Columns of a piece (start, length, first coefficient), and of the bounds on a stretch (as in `Window`).
_START, _LENGTH, _FIRST = 0, 1, 2
_LOW, _HIGH, _SLOPE, _JUMPS = 0, 1, 2, 3


class Ground(NamedTuple):
    """One component of a motion.

    The fields are the pieces of the motion, bounds on stretches of them, shape (stretches, components, 4),
    approximation error (g), number of coefficients per component, and first column of this component (horizontal except
    after `vertical_of`).
    """

    pieces: Floats
    stretches: Floats
    error: float
    columns: int
    first: int


class Window(NamedTuple):
    """Bounds on the acceleration during a time: minimum, maximum, steepest slope and sum of all jumps.

    A stretch includes the jump at its end.
    """

    low: float
    high: float
    slope: float
    jumps: float


def ground_of(
    breakpoints: Floats, coefficients: Floats, unit: float, error: float, vertical: Floats | None = None
) -> Ground:
    """Create a ground from breakpoints (s), coefficients of both components on the same pieces, and error.

    ``unit`` is the factor that converts coefficients and error to units of g.
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
    """Return the coefficients (g, g/s, ...) of a motion on some pieces: horizontal and, if present, vertical."""
    columns = ground.columns
    return [ground.pieces[pieces, _FIRST + k * columns :][:, :columns] for k in range(ground.stretches.shape[1])]


def greatest_weight(ground: Ground) -> float:
    """Return the largest absolute weight in the ground's frame, divided by the weight at rest."""
    return float(np.max(np.abs(1.0 + ground.stretches[:, 1:, _LOW : _HIGH + 1]), initial=1.0))


@kernel
def fill(breakpoints: Floats, coefficients: Floats, unit: float, ground: Ground, A: Floats) -> None:
    """Write the pieces of one component and the bounds on their stretches. ``A`` is scratch space."""
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
    """Return the bounds on a stretch."""
    row = ground.stretches[stretch, component_of(ground)]
    return Window(row[_LOW], row[_HIGH], row[_SLOPE], row[_JUMPS])


@inlined
def component_of(ground: Ground) -> int:
    """Return the index of the component in bounds on stretches: 0 horizontal, 1 vertical."""
    return 0 if ground.first == _FIRST else 1


@inlined
def has_vertical(ground: Ground) -> bool:
    """Return whether the motion has a vertical component."""
    return ground.stretches.shape[1] > 1


@inlined
def vertical_of(ground: Ground) -> Ground:
    """Return the vertical component of the motion."""
    return Ground(ground.pieces, ground.stretches, ground.error, ground.columns, ground.first + ground.columns)


@inlined
def is_straight(ground: Ground) -> bool:
    """Return whether the motion is linear in time on each piece, as records are."""
    return ground.columns == 2


@inlined
def last_piece(ground: Ground) -> int:
    """Return the index of the infinite piece after the motion."""
    return ground.pieces.shape[0] - 1


@inlined
def start_of(ground: Ground, piece: int) -> float:
    """Return the start time of a piece."""
    return ground.pieces[piece, _START]


@inlined
def length_of(ground: Ground, piece: int) -> float:
    """Return the length of a piece; infinite for the last."""
    return ground.pieces[piece, _LENGTH]


@inlined
def coefficient(ground: Ground, piece: int, power: int) -> float:
    """Return the coefficient of a power of the time within a piece."""
    return ground.pieces[piece, ground.first + power]


@inlined
def acceleration(ground: Ground, piece: int, offset: float) -> float:
    """Compute the ground acceleration within a piece, g."""
    value = 0.0
    for k in range(ground.columns - 1, -1, -1):
        value = value * offset + ground.pieces[piece, ground.first + k]
    return value


@inlined
def slope(ground: Ground, piece: int, offset: float) -> float:
    """Compute the rate of the ground acceleration within a piece, g/s."""
    value = 0.0
    for k in range(ground.columns - 1, 0, -1):
        value = value * offset + k * ground.pieces[piece, ground.first + k]
    return value


@inlined
def local_series(ground: Ground, piece: int, offset: float, sign: float, A: Floats) -> int:
    """Write a piece's polynomial about ``offset``, times ``sign``, into A and return its degree."""
    degree = ground.columns - 1
    while degree > 0 and coefficient(ground, piece, degree) == 0.0:
        A[degree] = 0.0
        degree -= 1
    if offset == 0.0:
        for k in range(degree + 1):
            A[k] = sign * coefficient(ground, piece, k)
        return degree
    # Horner's rule for all coefficients at once; unlike in `move`, the sums of one iteration are independent.
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
    """Expand a polynomial about t in place (repeated synthetic division)."""
    for k in range(degree):
        for j in range(degree - 1, k - 1, -1):
            c[j] += t * c[j + 1]


@inlined
def bounds_within(ground: Ground, piece: int, offset: float, window: float, A: Floats) -> Window:
    """Compute bounds on one piece in [offset, offset + window]; ``jumps`` is the allowance for rounding in the others.

    For degree 1 they are exact except for rounding. ``A`` is scratch space.
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
    """Compute the sums of the |terms| of a piece and of its slope at t, to which the rounding is proportional."""
    size = size_of_slope = 0.0
    for k in range(ground.columns - 1, -1, -1):
        size_of_slope = size_of_slope * t + size
        size = size * t + abs(ground.pieces[piece, ground.first + k])
    return size, size_of_slope


@shared
def bounds_over(
    ground: Ground, piece: int, offset: float, window: float, limits: tuple[float, float], A: Floats
) -> Window:
    """Compute bounds, rounding included, on a window from an offset on; ``A`` is scratch space.

    NaN if they exceed ``limits`` or the window spans too many pieces.
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
    """Return whether a stretch starts here and ends within the window."""
    if piece % STRETCH != 0 or offset > 0.0 or piece + STRETCH > last_piece(ground):
        return False
    return bool(start_of(ground, piece + STRETCH) - start_of(ground, piece) < window)


@inlined
def jump_after(ground: Ground, piece: int) -> float:
    """Return the size of the jump at the end of a piece."""
    return abs(coefficient(ground, piece + 1, 0) - acceleration(ground, piece, length_of(ground, piece)))


@inlined
def next_beyond(ground: Ground, piece: int, limits: tuple[float, float], added: tuple[float, float]) -> int:
    """Return the first piece from ``piece`` on whose stretch is not within limits, or the last piece.

    ``limits`` are multiplied by the weight before ``added`` is added.
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
