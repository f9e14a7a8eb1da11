"""Peak displacement of a linear oscillator under a piecewise polynomial base acceleration."""

import math

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import evaluate_deflated
from rocking.kernels.ground import shift_polynomial

#: Length of the work array in excess of the motion's columns: 0.25**16 / 16! = 1e-23.
TERMS = 18
_RADIANS_PER_STEP = 0.25

#: Largest number of parts of a step, and relative error of a peak: some units in its last place.
_MAX_PARTS = 2**30
_ROUNDING_FACTOR = 1.0 + 2.0**-50


@kernel
def write_peak_displacements(
    breakpoints: Floats, coefficients: Floats, frequencies: Floats, damping: float, work: Floats, peaks: Floats
) -> None:
    """Write the largest |u| (m) of u'' + 2 z w u' + w^2 u = -a(t) from rest into ``peaks``, for each w (rad/s).

    In each step of at most a quarter radian, u is the Taylor series of the exact solution. After the motion, u is
    followed to its first extremum. The frequencies must be positive, 0 <= z < 1, and all numbers finite. ``work`` is
    scratch space of twice the motion's columns plus TERMS.
    """
    columns = coefficients.shape[1]
    for i in range(len(frequencies)):
        peaks[i] = _find_peak(breakpoints, coefficients, frequencies[i], damping, work[:columns], work[columns:])


@not_inlined
def _find_peak(
    breakpoints: Floats, coefficients: Floats, frequency: float, damping: float, force: Floats, series: Floats
) -> float:
    """Compute the peak displacement of one oscillator; ``force`` and ``series`` are scratch space."""
    series[:] = 0.0
    peak = 0.0
    for k in range(len(coefficients)):
        width = breakpoints[k + 1] - breakpoints[k]
        steps = max(1, math.ceil(frequency * width / _RADIANS_PER_STEP))
        for j in range(len(force)):
            force[j] = coefficients[k, j]
        for _ in range(steps):
            peak = _step_oscillator(series, force, width / steps, frequency, damping, peak)
            _shift_force(force, width / steps)
    force[:] = 0.0
    half_period = math.pi / math.sqrt(1.0 - damping * damping)
    for _ in range(math.ceil(half_period / _RADIANS_PER_STEP)):
        peak = _step_oscillator(series, force, _RADIANS_PER_STEP / frequency, frequency, damping, peak)
    return peak


@not_inlined
def _step_oscillator(series: Floats, force: Floats, h: float, frequency: float, damping: float, peak: float) -> float:
    """Expand the solution about the start of a step, and move ``series[:2]`` to its end.

    Returns the largest displacement of the step, or ``peak`` if larger.
    """
    for k in range(len(series) - 2):
        acceleration = force[k] if k < len(force) else 0.0
        restoring = 2.0 * damping * frequency * (k + 1) * series[k + 1] + frequency * frequency * series[k]
        series[k + 2] = -(acceleration + restoring) / ((k + 1) * (k + 2))
    peak = _raise_peak(series, h, peak)
    series[0], series[1] = evaluate_deflated(series, 0, len(series) - 1, h)[0], _evaluate_slope(series, h)
    return peak


@not_inlined
def _raise_peak(series: Floats, h: float, peak: float) -> float:
    """Return the largest absolute value of a series from 0 to h, or ``peak`` if larger, except for rounding.

    Between two points a distance d apart, the series exceeds both values by at most d^2/8 times its second derivative.
    The step is halved if the largest value could be there.
    """
    max_curvature = 0.0
    for k in range(len(series) - 1, 1, -1):
        max_curvature = max_curvature * h + k * (k - 1) * abs(series[k])
    position, width = 0, _MAX_PARTS
    left = abs(series[0])
    while position < _MAX_PARTS:
        right = abs(evaluate_deflated(series, 0, len(series) - 1, h * ((position + width) / _MAX_PARTS))[0])
        peak = max(peak, right)
        d = h * (width / _MAX_PARTS)
        if (
            width > 1
            and max(left, right) + 0.125 * max_curvature * d * d > peak * _ROUNDING_FACTOR
            and max_curvature < math.inf
        ):
            width //= 2
            continue
        position, left = position + width, right
        while position % (2 * width) == 0 and position < _MAX_PARTS:
            width *= 2
    return peak


@inlined
def _evaluate_slope(series: Floats, x: float) -> float:
    """Compute the slope of a series at x."""
    slope = 0.0
    for k in range(len(series) - 1, 0, -1):
        slope = slope * x + k * series[k]
    return slope


@not_inlined
def _shift_force(force: Floats, shift: float) -> None:
    """Expand a polynomial about ``shift`` in place; inlined, it would slow the loop over the steps."""
    shift_polynomial(force, len(force) - 1, shift)
