"""Events that end a step of an arc (impact, overturning), and the change of state at an impact.

The search for the first positive root of a power series cannot step over it.
"""

import math
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.arc import evaluate_series
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.ground import ROUNDING, shift_polynomial
from rocking.kernels.state import StepOutcome, Struct

_EPSILON = 2.0**-53

#: After each _STEPS_PER_WINDOW steps, the search continues in a window _WINDOW times as long as the part searched.
_STEPS_PER_WINDOW = 8
_WINDOW = 4.0

#: About six steps find a simple root, tens to thousands a minimum near zero. A series that is still not negative after
#: _MAX_STEPS is within 1e-10 of zero relative to its curvature, which counts as a root.
_MAX_STEPS = 100_000


@not_inlined
def find_first_root(c: Floats, lead: int, order: int, h: float) -> float:
    """Find the first root in (0, h] of sum_k c[lead + k] t^k (Eq. 20: Eq. 15 divided by t^lead); NaN if there is none.

    A zero at 0 is not a root, nor is a negative value there, which is rounding. The parabola through the current value
    and slope with the smallest curvature on [0, h] is below the series, so that a step to its root passes no root of
    the series. Near a simple root, these steps converge quadratically. If that curvature is much larger than needed, a
    shorter window with its own bound is searched first.
    """
    while lead < order and c[lead] == 0.0:
        lead += 1
    t = 0.0
    f = max(0.0, c[lead])
    slope = c[lead + 1] if lead < order else 0.0
    if f == 0.0 and slope <= 0.0:
        return np.nan
    window = h
    bound = bound_curvature(c, lead, order, window)
    for n in range(1, _MAX_STEPS + 1):
        radical = math.sqrt(slope * slope + 2.0 * bound * f)
        if radical == 0.0:  # by underflow only
            radical = math.sqrt(2.0 * bound) * math.sqrt(f)
        # The two forms of the parabola's root; neither subtracts numbers of the same sign.
        numerator, denominator = (slope + radical, bound) if slope > 0.0 else (2.0 * f, radical - slope)
        if numerator <= denominator * (window - t):
            step = numerator / denominator
            t += step
            if step <= _EPSILON * t:
                return t
        elif window < h:  # no root in the window
            t = window
        else:
            return np.nan
        if t == window or n % _STEPS_PER_WINDOW == 0:
            window = min(h, _WINDOW * t)
            bound = bound_curvature(c, lead, order, window)
        f, slope = evaluate_deflated(c, lead, order, t)
        if f <= 0.0:
            return t
    return t


@inlined
def bound_curvature(c: Floats, lead: int, order: int, h: float) -> float:
    """Compute a bound B >= 0 with f'' >= -B on [0, h] for the deflated series f, from its negative terms."""
    lowest = 0.0
    power = 1.0
    for k in range(2, order - lead + 1):
        curvature = k * (k - 1) * c[lead + k] * power
        if k == 2 or curvature < 0.0:
            lowest += curvature
        power *= h
    return max(0.0, -lowest)


@inlined
def evaluate_deflated(c: Floats, lead: int, order: int, t: float) -> tuple[float, float]:
    """Compute value and slope of sum_k c[lead + k] t^k."""
    f = c[order]
    slope = 0.0
    for k in range(order - 1, lead - 1, -1):
        slope = slope * t + f
        f = f * t + c[k]
    return f, slope


@not_inlined
def find_first_negative_beyond_rounding(d: Floats, degree: int, h: float) -> float:
    """Find the first time in [0, h) from which a polynomial is negative beyond rounding; inf if never.

    It is not negative before. A root without a change of sign is divided out, and the search continues. Changes ``d``.
    """
    rounding = bound_rounding(d, degree, h)
    start = 0.0
    for _ in range(degree + 1):
        lead = find_leading_power(d, degree, h - start, rounding)
        if lead > degree:
            return np.inf
        if d[lead] < 0.0:
            return start
        time = find_first_root(d, lead, degree, h - start)
        if not start + time < h:
            return np.inf
        shift_polynomial(d, degree, time)
        start += time
        if d[1] < 0.0 and d[1] * d[1] <= 2.0 * d[2] * rounding:  # a minimum below zero by less than rounding
            step = -2.0 * d[1] / d[2]
            shift_polynomial(d, degree, step)
            start += step
        d[0] = 0.0
    return np.inf


@inlined
def bound_rounding(d: Floats, degree: int, h: float) -> float:
    """Bound the rounding of a polynomial within h."""
    rounding = 0.0
    for k in range(degree, -1, -1):
        rounding = rounding * h + ROUNDING * abs(d[k])
    return rounding


@inlined
def find_leading_power(d: Floats, degree: int, h: float, rounding: float) -> int:
    """Return the lowest power of a polynomial that is not negligible within h; above ``degree`` if there is none."""
    lead = 0
    power = 1.0
    while lead <= degree and abs(d[lead]) * power <= rounding:
        lead += 1
        power *= h
    return lead


#: Relative difference of maxima that rounding may cause.
_SAME_PEAK = 2.0**-40


class StepEnd(NamedTuple):
    """End of a step."""

    outcome: int  # a `StepOutcome`
    time: float  # length of the step
    u: float  # rotation at the end
    v: float  # velocity at the end
    peak_time: float  # time of the largest rotation; the end if none exceeds the largest so far
    peak: float  # rotation at that time


@not_inlined
def advance_to_event(state: Struct, scratch: Struct, order: int, h: float, overturn_angle: float) -> StepEnd:
    """Follow the series of an arc to its first event within h; the outcome is STEP, IMPACT or OVERTURN."""
    c, d = scratch.rotation, scratch.auxiliary
    lead = 0 if state.u > 0.0 else (1 if state.v > 0.0 else 2)
    time = find_first_root(c, lead, order, h)
    outcome = StepOutcome.IMPACT
    if math.isnan(time):
        time = h
        outcome = StepOutcome.STEP
    end, speed, _ = evaluate_series(c, order, time)
    if end <= 0.0:  # also without a root, which may be within rounding of the step's end
        outcome, end = StepOutcome.IMPACT, 0.0
    peak_time, peak = time, end
    if may_exceed_peak(state, end, c, order, time):
        peak_time, peak = find_maximum(order, time, c, d)
    if peak >= overturn_angle:
        passage = find_first_passage(c, order, overturn_angle, peak_time, d)
        _, speed, _ = evaluate_series(c, order, passage)
        return StepEnd(StepOutcome.OVERTURN, passage, overturn_angle, speed, passage, overturn_angle)
    if outcome == StepOutcome.IMPACT:
        end = 0.0
    return StepEnd(outcome, time, end, speed, peak_time, peak)


@inlined
def raise_peak(state: Struct, peak: float, time: float) -> None:
    """Store a new largest rotation, with the time of the first of maxima that differ only by rounding.

    A step from the largest rotation so far continues the same rise.
    """
    if state.u == state.peak or peak > state.peak * (1.0 + _SAME_PEAK):
        state.peak_time = time
    state.peak = peak


@inlined
def may_exceed_peak(state: Struct, end: float, c: Floats, order: int, h: float) -> bool:
    """Return whether a series may exceed, within (0, h), its values at both ends and the largest rotation so far."""
    curvature = bound_curvature(c, 0, order, h)
    if max(state.u, end) + 0.125 * h * h * curvature <= state.peak:
        return False
    if state.v > 0.0:
        return bool(state.v < curvature * h)
    rise = state.v
    power = h
    for k in range(2, order + 1):
        rise += max(0.0, c[k]) * power
        power *= h
    return rise > 0.0


@not_inlined
def find_maximum(order: int, h: float, c: Floats, d: Floats) -> tuple[float, float]:
    """Find time and value of a series' maximum on (0, h] between turning points; ``d`` is scratch space."""
    highest_time = h
    highest, _, _ = evaluate_series(c, order, h)
    for k in range(order):
        d[k] = (k + 1) * c[k + 1]
    t = 0.0
    is_rising = True
    for _ in range(order):
        lead = 0
        while lead < order - 1 and d[lead] == 0.0:
            lead += 1
        if d[lead] < 0.0:
            is_rising = not is_rising
            for k in range(order):
                d[k] = -d[k]
        step = find_first_root(d, lead, order - 1, h - t)
        if not step > 0.0:
            break
        t += step
        value, _, _ = evaluate_series(c, order, t)
        if is_rising and value > highest:
            highest_time, highest = t, value
        shift_polynomial(d, order - 1, step)
        d[0] = 0.0
    return highest_time, highest


@inlined
def find_first_passage(c: Floats, order: int, level: float, h: float, d: Floats) -> float:
    """Find the first time in (0, h] at which a series that is below ``level`` at 0, but not at h, reaches it.

    ``d`` is scratch space.
    """
    d[0] = level - c[0]
    for k in range(1, order + 1):
        d[k] = -c[k]
    time = find_first_root(d, 0, order, h)
    return h if math.isnan(time) else time


@inlined
def apply_impact(block: Struct, state: Struct) -> float:
    """Reduce the angular speed and change the side at an impact; return the earlier speed."""
    departed_side = state.side
    speed = max(0.0, -state.v)
    state.side = block.next_side[departed_side]
    if block.two_stops and state.u > 0.0:  # at the stop on the other side
        departed_side = state.side = 1 - departed_side
        speed = max(0.0, state.v)
        state.certificate_speed = np.inf
    state.u = 0.0
    state.v = compute_restitution_factor(block, departed_side, speed, state.impact_count) * speed
    state.impact_count += 1
    return speed


# ---- Restitution factor of an impact ----
# A variable factor decreases with the speed or is drawn at each impact. A draw depends only on the body's seed and the
# number of the impact, and is the same in single and multiple simulations.

#: Philox 2x32 with ten rounds (Salmon, Moraes, Dror and Shaw 2011): its multiplier and the increment of its key.
_MULTIPLIER = 0xD256D193
_WEYL = 0x9E3779B9
_ROUNDS = 10
_WORD = 0xFFFFFFFF


@inlined
def compute_restitution_factor(block: Struct, side: int, speed: float, number: int) -> float:
    """Return the factor on the speed of an impact that leaves a side, after ``number`` others."""
    if block.variable_restitution:
        return compute_variable_factor(block, side, speed, number)
    return float(block.restitution[side])


@not_inlined
def compute_variable_factor(block: Struct, side: int, speed: float, number: int) -> float:
    """Compute a variable factor; see `compute_restitution_factor`."""
    lowest, highest = block.min_restitution[side], block.restitution[side]
    if is_factor_random(block):
        return min(highest, lowest + (highest - lowest) * draw_uniform(int(block.seed), int(number)))
    return max(lowest, highest - block.restitution_slope[side] * speed)


@inlined
def is_factor_random(block: Struct) -> bool:
    """Return whether the factor is drawn at each impact."""
    return bool(block.variable_restitution and block.seed >= 0)


@inlined
def compute_speed_slope(block: Struct, side: int, speed: float, e: float) -> float:
    """Compute d(speed after)/d(speed before) of an impact, divided by the factor e (1 if the factor is constant)."""
    if block.variable_restitution and block.seed < 0 and e > block.min_restitution[side]:
        return 1.0 - block.restitution_slope[side] * speed / e
    return 1.0


@inlined
def bound_factor(block: Struct, side: int, max_speed: float) -> float:
    """Return the smallest factor up to a speed; the largest is ``block.restitution``."""
    if not block.variable_restitution:
        return float(block.restitution[side])
    if block.seed >= 0:
        return float(block.min_restitution[side])
    return max(block.min_restitution[side], block.restitution[side] - block.restitution_slope[side] * max_speed)


@inlined
def compute_mean_factor(block: Struct, side: int, max_speed: float) -> float:
    """Return the midpoint of all factors up to a speed."""
    return 0.5 * (bound_factor(block, side, max_speed) + block.restitution[side])


@not_inlined
def draw_uniform(seed: int, number: int) -> float:
    """Draw from [0, 1) a multiple of 2^-53 that depends only on a seed below 2^63 and a number below 2^32.

    Only lower halves of sums and products matter, except for one product, whose upper half of 64 bits is the same for
    wrapping machine integers and Python's.
    """
    a, b, key = number & _WORD, (seed >> 32) & _WORD, seed & _WORD
    for _ in range(_ROUNDS):
        product = _MULTIPLIER * a
        a, b = ((product >> 32) & _WORD) ^ key ^ b, product & _WORD
        key = (key + _WEYL) & _WORD
    return ((a >> 5) * 67108864.0 + (b >> 6)) * 2.0**-53
