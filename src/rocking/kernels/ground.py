"""Ground acceleration for kernels: a polynomial on each piece, times a factor, in units of g, and zero after the last.

A row of `Ground.pieces` contains the start (s), the length (s), and the coefficients of the motion in powers of the
time since the start, of the horizontal and then of any vertical component. They are multiplied by the factor and the
unit when they are read, so that many bodies under multiples of a motion share its pieces. The last row has infinite
length and zero acceleration, so that no function needs to check whether the motion is over. NaN propagates unchecked.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel, not_inlined

#: Relative allowance for rounding in bounds.
ROUNDING = 2.0**-48

#: Pieces per stretch: `find_piece_beyond` and `bound_window` skip whole stretches.
PIECES_PER_STRETCH = 16

#: Largest number of pieces and whole stretches in a window.
_MAX_WINDOW = 128

#: Columns of a piece (start, length, first coefficient), and of bounds on a stretch, as in `AccelerationBounds`.
START, LENGTH, FIRST = 0, 1, 2
_MIN, _MAX, _STEEPEST, _JUMPS = 0, 1, 2, 3


class Ground(NamedTuple):
    """One component of a motion: the horizontal one, or that of `select_vertical`."""

    pieces: Floats  # pieces of the motion, one per row
    stretches: Floats  # bounds on stretches of unscaled pieces, shape (stretches, components, 4)
    error: float  # approximation error of the unscaled motion
    coefficient_count: int  # number of coefficients per component
    first_column: int  # first column of this component
    factor: float  # factor on the motion
    g_per_unit: float  # factor that converts coefficients and error to units of g


class Grounds(NamedTuple):
    """Several motions with the same number of components and of coefficients."""

    pieces: Floats  # pieces of all motions, one motion after the other
    stretches: Floats  # bounds on their stretches, likewise
    first_pieces: Integers  # first row of each motion in `pieces`, and their number
    first_stretches: Integers  # likewise in `stretches`
    errors: Floats  # approximation error of each unscaled motion
    coefficient_count: int  # number of coefficients per component
    g_per_unit: float  # factor that converts coefficients and errors to units of g


class AccelerationBounds(NamedTuple):
    """Bounds on the acceleration during a time."""

    low: float  # lower bound
    high: float  # upper bound
    slope: float  # bound on the absolute slope
    jumps: float  # sum of all jumps; a stretch includes the jump at its end


def build_ground(
    breakpoints: Floats, coefficients: Floats, unit: float, error: float, vertical: Floats | None = None
) -> Ground:
    """Create a ground from breakpoints (s), coefficients of both components on the same pieces, and error.

    ``unit`` is the factor that converts coefficients and error to units of g.
    """
    components = [coefficients] if vertical is None else [coefficients, vertical]
    columns = max(2, *(component.shape[1] for component in components))
    pieces = np.zeros((len(coefficients) + 1, FIRST + columns * len(components)))
    stretches = np.zeros((-(-len(pieces) // PIECES_PER_STRETCH), len(components), 4))
    ground = Ground(pieces, stretches, error, columns, FIRST, 1.0, 1.0)
    for k, component in enumerate(components):
        write_pieces(breakpoints, component, ground._replace(first_column=FIRST + k * columns), np.zeros(columns))
    return ground._replace(g_per_unit=unit)


def join_grounds(grounds: Sequence[Ground]) -> Grounds:
    """Join horizontal components of motions with the same components, columns and unit; factors are left out."""
    return Grounds(
        np.concatenate([ground.pieces for ground in grounds]),
        np.concatenate([ground.stretches for ground in grounds]),
        np.cumsum([0, *(len(ground.pieces) for ground in grounds)]),
        np.cumsum([0, *(len(ground.stretches) for ground in grounds)]),
        np.array([ground.error for ground in grounds]),
        grounds[0].coefficient_count,
        grounds[0].g_per_unit,
    )


@inlined
def select_ground(grounds: Grounds, motion: int, factor: float) -> Ground:
    """Return one of the motions, multiplied by a factor."""
    pieces = grounds.pieces[grounds.first_pieces[motion] : grounds.first_pieces[motion + 1]]
    stretches = grounds.stretches[grounds.first_stretches[motion] : grounds.first_stretches[motion + 1]]
    count = grounds.coefficient_count
    return Ground(pieces, stretches, grounds.errors[motion], count, FIRST, factor, grounds.g_per_unit)


def scale_coefficients(ground: Ground, pieces: Integers) -> list[Floats]:
    """Return the coefficients (g, g/s, ...) of a motion on some pieces: horizontal and, if present, vertical."""
    columns, factors = ground.coefficient_count, (ground.factor, abs(ground.factor))
    return [
        ground.pieces[pieces, FIRST + k * columns :][:, :columns] * factors[k] * ground.g_per_unit
        for k in range(ground.stretches.shape[1])
    ]


def compute_max_weights(grounds: Grounds, motions: Integers, factors: Floats) -> Floats:
    """Return the largest absolute weight in the ground's frame under each multiple, divided by the weight at rest."""
    if grounds.stretches.shape[1] == 1:
        return np.ones(len(factors))
    scale, first = np.abs(factors) * grounds.g_per_unit, grounds.first_stretches[:-1]
    low = np.minimum.reduceat(grounds.stretches[:, 1, 0], first)
    high = np.maximum.reduceat(grounds.stretches[:, 1, 1], first)
    weights = [1.0 + scale * np.minimum(low, 0.0)[motions], 1.0 + scale * np.maximum(high, 0.0)[motions]]
    return np.maximum(1.0, np.abs(weights).max(axis=0))


@kernel
def write_pieces(breakpoints: Floats, coefficients: Floats, ground: Ground, A: Floats) -> None:
    """Write the pieces of one component and the bounds on their stretches. ``A`` is scratch space."""
    pieces, count = ground.pieces, coefficients.shape[0]
    for k in range(count):
        pieces[k, START] = breakpoints[k]
        pieces[k, LENGTH] = breakpoints[k + 1] - breakpoints[k]
    for j in range(coefficients.shape[1]):
        column = pieces[:, ground.first_column + j]
        for k in range(count):
            column[k] = coefficients[k, j]
    pieces[count, START] = breakpoints[count]
    pieces[count, LENGTH] = np.inf
    for stretch in range(ground.stretches.shape[0]):
        low, high, steepest, jumps = np.inf, -np.inf, 0.0, 0.0
        for k in range(stretch * PIECES_PER_STRETCH, min((stretch + 1) * PIECES_PER_STRETCH, count + 1)):
            piece = bound_piece(ground, k, 0.0, pieces[k, LENGTH], A)
            low, high, steepest = min(low, piece.low), max(high, piece.high), max(steepest, piece.slope)
            # A factor changes jumps by its rounding, which has the same bound as the rounding of the piece.
            jumps += 2.0 * piece.jumps + (compute_end_jump(ground, k) if k < count else 0.0)
        row = ground.stretches[stretch, component_index(ground)]
        row[_MIN], row[_MAX], row[_STEEPEST], row[_JUMPS] = low, high, steepest, jumps


@inlined
def bound_stretch(ground: Ground, stretch: int) -> AccelerationBounds:
    """Compute bounds on a stretch from those of the unscaled motion; those in scaled units include the rounding."""
    row = ground.stretches[stretch, component_index(ground)]
    scale = ground.factor * ground.g_per_unit
    first, second, size = scale * row[_MIN], scale * row[_MAX], abs(scale) * (1.0 + ROUNDING)
    rounding = ROUNDING * max(abs(first), abs(second))
    return AccelerationBounds(
        min(first, second) - rounding, max(first, second) + rounding, size * row[_STEEPEST], size * row[_JUMPS]
    )


@inlined
def component_index(ground: Ground) -> int:
    """Return the index of the component in bounds on stretches: 0 horizontal, 1 vertical."""
    return 0 if ground.first_column == FIRST else 1


@inlined
def has_vertical(ground: Ground) -> bool:
    """Return whether the motion has a vertical component."""
    return ground.stretches.shape[1] > 1


@inlined
def select_vertical(ground: Ground) -> Ground:
    """Return the vertical component of the motion."""
    first_column = ground.first_column + ground.coefficient_count
    return Ground(
        ground.pieces, ground.stretches, ground.error, ground.coefficient_count, first_column, abs(ground.factor),
        ground.g_per_unit,
    )  # fmt: skip


@inlined
def ground_error(ground: Ground) -> float:
    """Return the approximation error of the scaled motion, g."""
    return (ground.error * abs(ground.factor)) * ground.g_per_unit


@inlined
def is_piecewise_linear(ground: Ground) -> bool:
    """Return whether the motion is linear in time on each piece, as in records."""
    return ground.coefficient_count == 2


@inlined
def last_piece(ground: Ground) -> int:
    """Return the index of the infinite piece after the motion."""
    return ground.pieces.shape[0] - 1


@inlined
def piece_start(ground: Ground, piece: int) -> float:
    """Return the start time of a piece."""
    return ground.pieces[piece, START]


@inlined
def piece_length(ground: Ground, piece: int) -> float:
    """Return the length of a piece; infinite for the last."""
    return ground.pieces[piece, LENGTH]


@inlined
def coefficient(ground: Ground, piece: int, power: int) -> float:
    """Return the coefficient of a power of the time within a piece, g/s^power."""
    return (ground.pieces[piece, ground.first_column + power] * ground.factor) * ground.g_per_unit


@inlined
def compute_acceleration(ground: Ground, piece: int, offset: float) -> float:
    """Compute the ground acceleration within a piece, g."""
    value = 0.0
    for k in range(ground.coefficient_count - 1, -1, -1):
        value = value * offset + coefficient(ground, piece, k)
    return value


@inlined
def compute_acceleration_rate(ground: Ground, piece: int, offset: float) -> float:
    """Compute the rate of the ground acceleration within a piece, g/s."""
    value = 0.0
    for k in range(ground.coefficient_count - 1, 0, -1):
        value = value * offset + k * coefficient(ground, piece, k)
    return value


@inlined
def write_local_series(ground: Ground, piece: int, offset: float, sign: float, A: Floats) -> int:
    """Write a piece's polynomial about ``offset``, times ``sign``, into A and return its degree."""
    degree = ground.coefficient_count - 1
    while degree > 0 and coefficient(ground, piece, degree) == 0.0:
        A[degree] = 0.0
        degree -= 1
    if offset == 0.0:
        for k in range(degree + 1):
            A[k] = sign * coefficient(ground, piece, k)
        return degree
    # Horner's rule for all coefficients; unlike in `shift_polynomial`, the sums of an iteration are independent.
    A[0] = sign * coefficient(ground, piece, degree)
    for k in range(1, degree + 1):
        previous = A[0]
        for j in range(1, k):
            current = A[j]
            A[j] = previous + offset * current
            previous = current
        A[k] = previous
        A[0] = sign * coefficient(ground, piece, degree - k) + offset * A[0]
    return degree


@inlined
def shift_polynomial(c: Floats, degree: int, shift: float) -> None:
    """Expand a polynomial about ``shift`` in place (repeated synthetic division)."""
    for k in range(degree):
        for j in range(degree - 1, k - 1, -1):
            c[j] += shift * c[j + 1]


@inlined
def bound_piece(ground: Ground, piece: int, offset: float, duration: float, A: Floats) -> AccelerationBounds:
    """Compute bounds on a piece in [offset, offset + duration]; ``jumps`` is the allowance for rounding in the others.

    For degree 1 they are exact except for rounding. ``A`` is scratch space.
    """
    columns = ground.coefficient_count
    if columns == 2:
        start, rate = coefficient(ground, piece, 0), coefficient(ground, piece, 1)
        first = start + rate * offset
        last = first + rate * duration if rate != 0.0 else first
        rounding = ROUNDING * (abs(start) + max(abs(first), abs(last)))
        return AccelerationBounds(min(first, last) - rounding, max(first, last) + rounding, abs(rate), rounding)
    degree = write_local_series(ground, piece, offset, 1.0, A)
    low = high = A[0]
    steepest = 0.0
    power = 1.0
    for k in range(1, degree + 1):
        steepest += k * abs(A[k]) * power
        power *= duration
        low += min(0.0, A[k] * power)
        high += max(0.0, A[k] * power)
    size, slope_size = sum_absolute_terms(ground, piece, offset + duration if degree > 0 else offset)
    rounding = ROUNDING * columns * size
    return AccelerationBounds(low - rounding, high + rounding, steepest + ROUNDING * columns * slope_size, rounding)


@inlined
def sum_absolute_terms(ground: Ground, piece: int, t: float) -> tuple[float, float]:
    """Compute the sums of the |terms| of a piece and of its slope at t, to which the rounding is proportional."""
    size = slope_size = 0.0
    for k in range(ground.coefficient_count - 1, -1, -1):
        slope_size = slope_size * t + size
        size = size * t + abs(coefficient(ground, piece, k))
    return size, slope_size


@not_inlined
def bound_window(
    ground: Ground, piece: int, offset: float, duration: float, limits: tuple[float, float], A: Floats
) -> AccelerationBounds:
    """Compute bounds, rounding included, for a duration from an offset on; ``A`` is scratch space.

    NaN if they exceed ``limits`` or the duration spans too many pieces.
    """
    low, high, steepest, jumps = np.inf, -np.inf, 0.0, 0.0
    for _ in range(_MAX_WINDOW):
        if spans_stretch(ground, piece, offset, duration):
            next_piece = piece + PIECES_PER_STRETCH
            remaining = piece_start(ground, next_piece) - piece_start(ground, piece)
            bounds = bound_stretch(ground, piece // PIECES_PER_STRETCH)
        else:
            next_piece = piece + 1
            remaining = piece_length(ground, piece) - offset
            bounds = bound_piece(ground, piece, offset, min(duration, remaining), A)
        low, high, steepest = min(low, bounds.low), max(high, bounds.high), max(steepest, bounds.slope)
        if low < limits[0] or high > limits[1]:
            break
        if duration <= remaining:
            return AccelerationBounds(low, high, steepest, jumps)
        jumps += bounds.jumps
        if next_piece == piece + 1:
            jumps += compute_end_jump(ground, piece)
        duration -= remaining
        piece, offset = next_piece, 0.0
    return AccelerationBounds(np.nan, np.nan, np.nan, np.nan)


@inlined
def spans_stretch(ground: Ground, piece: int, offset: float, duration: float) -> bool:
    """Return whether a stretch starts at the offset and ends within the duration."""
    if piece % PIECES_PER_STRETCH != 0 or offset > 0.0 or piece + PIECES_PER_STRETCH > last_piece(ground):
        return False
    return bool(piece_start(ground, piece + PIECES_PER_STRETCH) - piece_start(ground, piece) < duration)


@inlined
def compute_end_jump(ground: Ground, piece: int) -> float:
    """Return the size of the jump at the end of a piece."""
    return abs(coefficient(ground, piece + 1, 0) - compute_acceleration(ground, piece, piece_length(ground, piece)))


@inlined
def find_piece_beyond(ground: Ground, piece: int, limits: tuple[float, float], restraint: tuple[float, float]) -> int:
    """Return the first piece from ``piece`` on whose stretch is not within limits, or the last piece.

    ``limits`` are multiplied by the weight before ``restraint`` is added.
    """
    below, above = limits
    while piece < last_piece(ground):
        stretch = piece // PIECES_PER_STRETCH
        weight = 1.0 + (bound_stretch(select_vertical(ground), stretch).low if has_vertical(ground) else 0.0)
        bounds = bound_stretch(ground, stretch)
        if bounds.low < below * weight + restraint[0] or bounds.high > above * weight + restraint[1]:
            return piece
        piece = (stretch + 1) * PIECES_PER_STRETCH
    return last_piece(ground)
