"""Algebra of piecewise polynomials, vectorised over the pieces, and validation of their arrays.

Piece k is ``sum_j coefficients[k, j] x**j`` on ``0 <= x <= widths[k]``, with x measured from the start of the piece.
"""

import functools
import math
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import HIGHEST_DEGREE
from rocking.errors import MotionError

#: Pieces that meet within this fraction of the largest value do not jump.
_JUMP_TOLERANCE: Final = 1e-12
#: Largest distance of even breakpoints from their grid divided by the duration, some units in the last place.
_STEP_ROUNDING: Final = 4.0 * np.finfo(np.float64).eps

#: Far above any ground motion, but small enough that squares and integrals in measures do not overflow, and that the
#: solvers terminate (up to 1e42 m/s^2).
MAX_ACCELERATION: Final = 1e30
_MAX_DURATION: Final = 1e15

TOO_STRONG: Final = f"the acceleration of a motion must stay below {MAX_ACCELERATION:g} m/s^2: check units and scale"

#: Far below any ground motion. Pieces may be shorter, but not change faster than over this time.
MIN_DURATION: Final = 1e-9


class Piecewise(Protocol):
    """Protocol of a piecewise polynomial: a motion, or an intermediate result."""

    @property
    def breakpoints(self) -> Floats:
        """Ends of the pieces, s, shape (n + 1,)."""

    @property
    def coefficients(self) -> Floats:
        """Coefficients of each piece from its start, shape (n, degree + 1)."""


class Pieces(NamedTuple):
    """Piecewise polynomial without further data."""

    breakpoints: Floats
    coefficients: Floats


def find_even_step(pieces: Piecewise) -> float | None:
    """Return the length of straight pieces of equal length, else None."""
    breakpoints, coefficients = pieces.breakpoints, pieces.coefficients
    if coefficients.shape[1] < 2 or np.any(coefficients[:, 2:]):
        return None
    step = float(breakpoints[1])
    deviations = np.abs(breakpoints - create_even_times(len(breakpoints), step))
    return step if np.all(deviations <= _STEP_ROUNDING * breakpoints[-1]) else None


def has_jumps(pieces: Piecewise) -> bool:
    """Return whether a piece starts off the end of the previous one, beyond rounding."""
    return bool(np.any(find_jumps(pieces)[:-1]))


def find_jumps(pieces: Piecewise) -> Flags:
    """Return which pieces end in a jump, beyond rounding (the last one to zero)."""
    widths, coefficients = np.diff(pieces.breakpoints), pieces.coefficients
    gaps = np.abs(np.append(coefficients[1:, 0], 0.0) - evaluate_pieces(coefficients, widths))
    return gaps > _JUMP_TOLERANCE * compute_peak_magnitude(widths, coefficients)


def sample_breakpoints(pieces: Piecewise) -> tuple[Floats, Floats]:
    """Return times (s) and values at the breakpoints, with the value after a jump."""
    last = evaluate_pieces(pieces.coefficients[-1], np.diff(pieces.breakpoints)[-1])
    return pieces.breakpoints, np.append(pieces.coefficients[:, 0], last)


def evaluate_pieces(coefficients: Floats, x: Floats) -> Floats:
    """Evaluate each polynomial (last axis of `coefficients`: powers) at `x` by Horner's rule."""
    result = coefficients[..., -1] + 0.0 * x
    for j in range(coefficients.shape[-1] - 2, -1, -1):
        result *= x
        result += coefficients[..., j]
    return result


def evaluate_at(breakpoints: Floats, coefficients: Floats, time: Floats) -> Floats:
    """Return the value at `time`, clipped to the span of the breakpoints, with the value after a jump."""
    clipped = np.clip(time, breakpoints[0], breakpoints[-1])
    piece = np.minimum(np.searchsorted(breakpoints, clipped, side="right"), len(coefficients)) - 1
    return evaluate_pieces(coefficients[piece], clipped - breakpoints[piece])


def create_even_times(count: int, step: float) -> Floats:
    """Return the times of even samples (infinite on overflow)."""
    with np.errstate(over="ignore"):
        return np.arange(count, dtype=np.float64) * step


def join_linearly(times: Floats, samples: Floats) -> Floats:
    """Return coefficients of the straight lines between the samples (not finite on overflow)."""
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        return np.column_stack([samples[:-1], np.diff(samples) / np.diff(times)])


def differentiate_pieces(coefficients: Floats) -> Floats:
    """Return the coefficients of the derivative of each piece."""
    return coefficients[:, 1:] * np.arange(1.0, coefficients.shape[1])


def integrate_pieces(widths: Floats, coefficients: Floats) -> Floats:
    """Return the coefficients of the continuous antiderivative that starts at zero."""
    powers = np.arange(1.0, coefficients.shape[1] + 1)
    integral = np.hstack([np.zeros((len(coefficients), 1)), coefficients / powers])
    integral[1:, 0] = np.cumsum(evaluate_pieces(integral, widths))[:-1]
    return integral


def shift_origin(coefficients: Floats, shift: Floats) -> Floats:
    """Return the coefficients of each piece about ``x = shift`` (repeated synthetic division)."""
    result = coefficients.copy()
    last = result.shape[1] - 1
    for i in range(last):
        for j in range(last - 1, i - 1, -1):
            result[:, j] += shift * result[:, j + 1]
    return result


def shift_origin_exactly(coefficients: Floats, shift: Floats) -> Floats:
    """Return coefficients of each piece about ``x = shift`` by Horner's rule with the error of each operation."""
    offset, zeros = shift[:, np.newaxis], np.zeros((len(shift), 1))
    result = errors = np.zeros_like(coefficients)
    for k in range(coefficients.shape[1] - 1, -1, -1):
        # Partial result times x + shift, plus the next coefficient.
        raised = np.hstack([coefficients[:, k : k + 1], result[:, :-1]])
        product, product_error = multiply_exactly(offset, result)
        result, sum_error = add_exactly(product, raised)
        errors = offset * errors + np.hstack([zeros, errors[:, :-1]]) + (product_error + sum_error)
    return result + errors


def refine_pieces(breakpoints: Floats, coefficients: Floats, new_breakpoints: Floats, columns: int) -> Floats:
    """Return coefficients between new breakpoints, which include the old ones (zero after the end)."""
    piece = np.minimum(np.searchsorted(breakpoints, new_breakpoints[:-1], side="right"), len(coefficients)) - 1
    shift = new_breakpoints[:-1] - breakpoints[piece]
    is_cut = shift > 0.0
    result = np.zeros((len(new_breakpoints) - 1, columns))
    result[:, : coefficients.shape[1]] = coefficients[piece]
    result[is_cut, : coefficients.shape[1]] = shift_origin_exactly(coefficients[piece[is_cut]], shift[is_cut])
    result[new_breakpoints[:-1] >= breakpoints[-1]] = 0.0
    return result


def align_pieces(first: Piecewise, second: Piecewise) -> tuple[Floats, tuple[Floats, Floats]]:
    """Return common breakpoints, and the coefficients of each between them, of equal degree."""
    columns = max(first.coefficients.shape[1], second.coefficients.shape[1])
    if np.array_equal(first.breakpoints, second.breakpoints):
        breakpoints = first.breakpoints
    else:
        breakpoints = np.union1d(first.breakpoints, second.breakpoints)
    first_rows = refine_pieces(first.breakpoints, first.coefficients, breakpoints, columns)
    return breakpoints, (first_rows, refine_pieces(second.breakpoints, second.coefficients, breakpoints, columns))


def find_root_candidates(widths: Floats, coefficients: Floats) -> Floats:
    """Return a superset of the roots of each piece, shape (pieces, degree), sorted along each row.

    Rows are padded with points that are not roots, which is harmless in a search for extrema.
    """
    degree = coefficients.shape[1] - 1
    if degree == 0:
        return np.zeros((len(coefficients), 0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if degree == 1:
            roots = -coefficients[:, :1] / coefficients[:, 1:]
        elif degree == 2:
            c, b, a = coefficients.T
            q = -0.5 * (b + np.copysign(np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)), b))
            roots = np.column_stack([q / a, c / q])
        else:
            roots = _find_numerical_roots(widths, coefficients)
    roots = np.where(np.isfinite(roots), roots, 0.0)
    return np.sort(np.clip(roots, 0.0, widths[:, np.newaxis]), axis=1)


def _find_numerical_roots(widths: Floats, coefficients: Floats) -> Floats:
    roots = np.zeros((len(coefficients), coefficients.shape[1] - 1))
    scaled = coefficients * widths[:, np.newaxis] ** np.arange(float(coefficients.shape[1]))
    control = _compute_control_points(widths, coefficients)
    rounding = 1e-14 * np.sum(np.abs(scaled), axis=1)
    may_vanish = (np.min(control, axis=1) <= rounding) & (np.max(control, axis=1) >= -rounding)
    degrees = np.where(may_vanish, _compute_significant_degrees(scaled), 0)
    for k in np.flatnonzero(degrees):
        roots[k, : degrees[k]] = np.polynomial.polynomial.polyroots(scaled[k, : degrees[k] + 1]).real
    return roots * widths[:, np.newaxis]


def _compute_significant_degrees(pieces: Floats) -> Integers:
    """Return the degree of each piece without leading coefficients far below rounding, which distort the roots."""
    sizes = np.abs(pieces)
    is_significant = sizes > 1e-18 * np.max(sizes, axis=1, keepdims=True)
    last = pieces.shape[1] - 1 - np.argmax(is_significant[:, ::-1], axis=1)
    return np.where(is_significant.any(axis=1), last, 0)


def _compute_control_points(widths: Floats, coefficients: Floats) -> Floats:
    """Return the Bernstein coefficients of each piece, which enclose its values."""
    columns = coefficients.shape[1]
    control: Floats = (coefficients * widths[:, np.newaxis] ** np.arange(float(columns))) @ _bernstein_matrix(columns)
    return control


@functools.cache
def _bernstein_matrix(columns: int) -> Floats:
    """Return the share of each power in each Bernstein coefficient."""
    return np.array([[math.comb(i, j) / math.comb(columns - 1, j) for i in range(columns)] for j in range(columns)])


def bound_magnitudes(widths: Floats, coefficients: Floats) -> Floats:
    """Return an upper bound on each piece's magnitude, from the ends (straight) or Bernstein coefficients."""
    if coefficients.shape[1] <= 2:
        return np.maximum(np.abs(coefficients[:, 0]), np.abs(evaluate_pieces(coefficients, widths)))
    result: Floats = np.max(np.abs(_compute_control_points(widths, coefficients)), axis=1)
    return result


def compute_maximum(widths: Floats, coefficients: Floats) -> float:
    """Return the highest value over all pieces."""
    maximum = max(float(np.max(coefficients[:, 0])), float(np.max(evaluate_pieces(coefficients, widths))))
    if coefficients.shape[1] <= 2:
        return maximum
    may_exceed = np.max(_compute_control_points(widths, coefficients), axis=1) > maximum + 1e-15 * abs(maximum)
    if not np.any(may_exceed):
        return maximum
    pieces, spans = coefficients[may_exceed], widths[may_exceed]
    extrema = find_root_candidates(spans, differentiate_pieces(pieces))
    return max(maximum, float(np.max(evaluate_pieces(pieces[:, np.newaxis, :], extrema))))


def compute_peak_magnitude(widths: Floats, coefficients: Floats) -> float:
    """Return the largest absolute value over all pieces."""
    return max(compute_maximum(widths, coefficients), compute_maximum(widths, -coefficients))


def sine_cosine_from_quarters(quarters: Floats, rest: Floats) -> tuple[Floats, Floats]:
    """Compute sine and cosine of quarter turns plus the rest of an angle, rad."""
    sine, cosine = np.sin(rest), np.cos(rest)
    quadrant = np.mod(quarters, 4.0).astype(np.intp)
    return np.choose(quadrant, [sine, cosine, -sine, -cosine]), np.choose(quadrant, [cosine, -sine, -cosine, sine])


def check_pieces(breakpoints: ArrayLike, coefficients: ArrayLike) -> tuple[Floats, Floats]:
    """Return checked breakpoints and coefficients of a motion as read-only copies."""
    ends = _convert_array(breakpoints, "breakpoints", 1)
    hint = "; for samples, use Motion.from_samples(acceleration, dt)"
    rows = _convert_array(coefficients, "coefficients", 2, hint)
    for array, name in ((ends, "breakpoints"), (rows, "coefficients")):
        if not np.all(np.isfinite(array)):
            raise MotionError("the {} of a motion must be finite numbers", name)
    if len(ends) < 2 or rows.shape[0] != len(ends) - 1 or rows.shape[1] == 0:
        message = "a motion of n pieces requires n + 1 {} and {} of shape (n, degree + 1); got "
        shapes = f"{ends.shape} and {rows.shape}"
        raise MotionError(message + shapes, "breakpoints", "coefficients", value=breakpoints)
    widths = np.diff(ends)
    if ends[0] != 0.0 or not np.all(widths > 0.0):
        raise MotionError("the {} of a motion must start at 0 and increase strictly", "breakpoints")
    if rows.shape[1] > HIGHEST_DEGREE + 1:
        message = f"the pieces of a motion must be of degree {HIGHEST_DEGREE} or less, not {rows.shape[1] - 1}"
        raise MotionError(f"{message}: split them into shorter ones of a lower degree")
    if not MIN_DURATION <= ends[-1] <= _MAX_DURATION:
        message = f"a motion must last from {MIN_DURATION:g} to {_MAX_DURATION:g} s, not {ends[-1]:g} s"
        raise MotionError(f"{message}: check its units")
    with np.errstate(over="ignore"):
        if not np.all(evaluate_pieces(np.abs(rows), widths) <= MAX_ACCELERATION):
            raise MotionError(TOO_STRONG)
        if not np.all(evaluate_pieces(np.abs(rows), np.maximum(widths, MIN_DURATION)) <= MAX_ACCELERATION):
            excess = f"it would exceed {MAX_ACCELERATION:g} m/s^2 within {MIN_DURATION:g} s"
            raise MotionError(f"a piece of a motion is too steep: {excess}; check units and times")
    for array in (ends, rows):
        array.setflags(write=False)
    return ends, rows


def check_samples(acceleration: ArrayLike) -> Floats:
    """Return accelerations, at least two and all finite."""
    values = _convert_array(acceleration, "accelerations", 1)
    if len(values) < 2:
        raise MotionError(f"a motion requires at least two samples; got {len(values)}")
    faults = np.flatnonzero(~np.isfinite(values))
    if len(faults):
        place = f"{values[faults[0]]} at sample {faults[0]}"
        raise MotionError(f"every sample of a motion must be a finite number; got {place}")
    return values


def check_step(dt: float) -> float:
    """Return a sampling step, s."""
    if np.ndim(dt) != 0:
        raise MotionError("{} must be one number; for uneven times use Motion.from_points(times, acceleration)", "dt")
    step = checks.positive(dt, "dt", MotionError, "s")
    return checks.between(step, "dt", MotionError, MIN_DURATION, 1.0 / MIN_DURATION, "s: check its units")


def check_times(times: ArrayLike, count: int) -> Floats:
    """Return the times of this many samples, s."""
    values = _convert_array(times, "times", 1)
    if len(values) != count:
        message = f"{{}} must contain one value for each of the {count} accelerations; got {len(values)}"
        raise MotionError(message, "times", value=times)
    if not np.all(np.isfinite(values)) or not np.all(np.diff(values) > 0.0):
        raise MotionError("the {} of a motion must be finite and increase strictly", "times")
    return values


def _convert_array(values: ArrayLike, name: str, dimensions: int, hint: str = "") -> Floats:
    array = np.array(checks.numbers(values, f"{name} of a motion", MotionError), order="C")
    if array.ndim != dimensions:
        message = f"the {{}} of a motion must have {dimensions} dimension(s), not {array.ndim}{hint}"
        raise MotionError(message, name, value=values)
    return array


def add_exactly(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return a sum and its rounding error (Knuth 1969)."""
    total = a + b
    b_rounded = total - a
    return total, (a - (total - b_rounded)) + (b - b_rounded)


def multiply_exactly(a: float | Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return a product and its rounding error (Dekker 1971)."""
    product = a * b
    a_high, a_low = _split_digits(a)
    b_high, b_low = _split_digits(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def divide_exactly(a: Floats, rest: Floats, divisor: float) -> tuple[Floats, Floats]:
    """Return the quotient of ``a + rest`` and its error."""
    quotient = a / divisor
    product, error = multiply_exactly(divisor, quotient)
    return quotient, ((a - product) - error + rest) / divisor


def _split_digits(a: float | Floats) -> tuple[Any, Any]:
    scaled = 134217729.0 * a
    high = scaled - (scaled - a)
    return high, a - high
