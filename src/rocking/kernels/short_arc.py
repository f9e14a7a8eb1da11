"""Steps so short that nine terms of the series suffice, in registers, with one bound on possible events.

The outcome is UNDECIDED for NaN and if the bound is inconclusive (two close impacts, a rotation near the largest so
far, overturning). `expand_arc` and `advance_to_event` then compute the step from the same series.
"""

import math

import numpy as np

from rocking.kernels.arc import compute_weight, side_sign
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.events import StepEnd
from rocking.kernels.ground import (
    Ground,
    coefficient,
    compute_acceleration,
    has_vertical,
    is_piecewise_linear,
    select_vertical,
)
from rocking.kernels.series import (
    AngleSums,
    RotationCoefficients,
    ValueAndSlope,
    expand_linear,
    expand_nonlinear,
    expand_weighted,
    has_negligible_truncation,
    sum_forcing,
)
from rocking.kernels.state import StepOutcome, Struct

#: Largest lam t^2 of a linear step, lam |W| t^2 under a varying weight W, and (lam (|W| + |a|/g) + v^2) t^2 of a
#: nonlinear step.
SHORT_LINEAR = 4e-3
SHORT_WEIGHTED = 2e-3
SHORT_NONLINEAR = 1.2e-3

#: Smallest fraction of the remaining time for which a short step pays: full series reach further with less rounding.
_MIN_FRACTION = 0.125

#: Largest sum of the last two terms of a linear velocity, divided by the first two. For small lam t^2, the truncation
#: is smaller by a factor of at least 18,000.
_MAX_LAST_RATIO = 2.0**-40

#: Largest quantity tested by `is_sufficient_weighted`, divided by the first two terms; the truncation is 1/60 of it.
_MAX_NEXT_RATIO = 2.0**-46

#: Largest number of Newton steps, and relative size of the last, whose square is the order of the error.
_NEWTON_STEPS = 8
_CONVERGED = 1e-8


@inlined
def take_short_step(ground: Ground, block: Struct, settings: Struct, state: Struct, h_max: float) -> StepEnd:
    """Step to the next impact or by at most ``h_max``; UNDECIDED if the step is small or not simple."""
    end = take_nine_term_step(ground, block, settings, state, h_max)
    return create_undecided_step() if end.outcome == StepOutcome.STEP and end.time < _MIN_FRACTION * h_max else end


@inlined
def take_nine_term_step(ground: Ground, block: Struct, settings: Struct, state: Struct, h_max: float) -> StepEnd:
    """Step to the next impact or by at most ``h_max``, as far as nine terms suffice."""
    if not is_piecewise_linear(ground) or block.restrained:
        return create_undecided_step()
    if has_vertical(ground):
        return take_short_weighted_step(ground, block, settings, state, h_max)
    if settings.nonlinear:
        return take_short_nonlinear_step(ground, block, state, h_max, None)
    c = compute_linear_series(ground, block, state)
    end = resolve_step(
        c, limit_time(abs(block.stiffness[state.side]), SHORT_LINEAR, h_max), state, block.overturn_angle
    )
    return end if is_sufficient_linear(c, end.time) else create_undecided_step()


@not_inlined
def take_short_weighted_step(ground: Ground, block: Struct, settings: Struct, state: Struct, h_max: float) -> StepEnd:
    """Compute a short step under varying weight."""
    lam = block.stiffness[state.side]
    weight = compute_weight(ground, state.piece, state.offset), coefficient(select_vertical(ground), state.piece, 1)
    if settings.nonlinear:
        return take_short_nonlinear_step(ground, block, state, h_max, weight)
    c = compute_weighted_series(ground, block, state, weight)
    end = resolve_step(
        c,
        limit_time(abs(lam) * find_largest_weight(weight, h_max), SHORT_WEIGHTED, h_max),
        state,
        block.overturn_angle,
    )
    return end if is_sufficient_weighted(c, lam, weight, end.time) else create_undecided_step()


@inlined
def take_short_nonlinear_step(
    ground: Ground, block: Struct, state: Struct, h_max: float, weight: ValueAndSlope | None
) -> StepEnd:
    """Compute a short step in the nonlinear model."""
    c, angles = compute_nonlinear_series(ground, block, state, weight)
    lam, slope = block.stiffness[state.side], coefficient(ground, state.piece, 1)
    start = coefficient(ground, state.piece, 0) + slope * state.offset
    size = lam * (find_largest_weight(weight, h_max) + max(abs(start), abs(start + slope * h_max))) + state.v * state.v
    end = resolve_step(c, limit_time(size, SHORT_NONLINEAR, h_max), state, block.overturn_angle)
    push = (compute_acceleration(ground, state.piece, state.offset), slope)
    is_sufficient = is_sufficient_nonlinear(c, angles, lam, push, weight, end.time)
    return end if is_sufficient else create_undecided_step()


@inlined
def is_sufficient_weighted(c: RotationCoefficients, lam: float, weight: ValueAndSlope, t: float) -> bool:
    """Return whether nine terms of a linear series are sufficient at t under varying weight.

    Each coefficient follows from those two and, by the change of weight, three before. Therefore the last three bound
    the truncation by a geometric sum with the ratio lam (|W| + |W'| t) t^2 <= 0.006.
    """
    t2, change = t * t, abs(weight[1]) * t
    t6 = t2 * t2 * t2
    eighth, ninth = 8.0 * abs(c[8]) * t2, 9.0 * abs(c[9]) * (t2 * t)
    last_terms = (abs(weight[0]) + change) * (eighth + ninth) + change * (7.0 * abs(c[7]) * t)
    return abs(lam) * t2 * (last_terms * t6) <= _MAX_NEXT_RATIO * (abs(c[1]) * t + 2.0 * abs(c[2]) * t2)


@inlined
def is_sufficient_nonlinear(
    c: RotationCoefficients, z: AngleSums, lam: float, push: ValueAndSlope, weight: ValueAndSlope | None, t: float
) -> bool:
    """Return whether nine terms of a nonlinear series are sufficient at t."""
    t2 = t * t
    t3, t4 = t2 * t, t2 * t2
    t5, t6, t7 = t2 * t3, t3 * t3, t3 * t4
    low = (abs(c[1]) * t, 2.0 * abs(c[2]) * t2, 3.0 * abs(c[3]) * t3, 4.0 * abs(c[4]) * t4, 5.0 * abs(c[5]) * t5)
    sizes = (*low, 6.0 * abs(c[6]) * t6, 7.0 * abs(c[7]) * t7, 8.0 * abs(c[8]) * (t4 * t4), 9.0 * abs(c[9]) * (t4 * t5))
    angles = (z[0] * t, z[1] * t2, z[2] * t3, z[3] * t4, z[4] * t5, z[5] * t6, z[6] * t7)
    is_negligible, _ = has_negligible_truncation(sizes, angles, lam * t2, sum_forcing(weight, push, t))
    return is_negligible


@inlined
def create_undecided_step() -> StepEnd:
    """Return an UNDECIDED step."""
    return StepEnd(StepOutcome.UNDECIDED, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def limit_time(size: float, limit: float, max_time: float) -> float:
    """Return the time t, at most ``max_time``, up to which size t^2 is within a limit."""
    return max_time if size * max_time * max_time <= limit else min(max_time, math.sqrt(limit / size))


@inlined
def find_largest_weight(weight: ValueAndSlope | None, duration: float) -> float:
    """Return the largest absolute weight during a time; 1 if constant."""
    return 1.0 if weight is None else max(abs(weight[0]), abs(weight[0] + weight[1] * duration))


@inlined
def compute_linear_series(ground: Ground, block: Struct, state: Struct) -> RotationCoefficients:
    """Compute the series of a linear arc under a ground acceleration that is linear in time."""
    side = state.side
    gain = block.restoring_gain[side]
    push = compute_push_line(ground, state)
    return expand_linear(
        state.u, state.v, block.stiffness[side], gain * (block.threshold[side] + push[0]), gain * push[1]
    )


@inlined
def compute_weighted_series(
    ground: Ground, block: Struct, state: Struct, weight: ValueAndSlope
) -> RotationCoefficients:
    """Compute the series of a linear arc under two ground accelerations that are linear in time."""
    side, gain = state.side, block.restoring_gain[state.side]
    push = compute_push_line(ground, state)
    pushes = (gain * push[0], gain * push[1])
    return expand_weighted(state.u, state.v, block.stiffness[side], gain * block.threshold[side], pushes, weight)


@inlined
def compute_nonlinear_series(
    ground: Ground, block: Struct, state: Struct, weight: ValueAndSlope | None
) -> tuple[RotationCoefficients, AngleSums]:
    """Compute the series of a nonlinear arc under ground accelerations that are linear in time."""
    side, u = state.side, state.u
    angle = (block.sine[side], block.cosine[side])
    if u != 0.0:
        psi = block.slenderness[side] - u
        angle = (math.sin(psi), math.cos(psi))
    return expand_nonlinear((u, state.v), angle, block.stiffness[side], compute_push_line(ground, state), weight)


@inlined
def compute_push_line(ground: Ground, state: Struct) -> ValueAndSlope:
    """Return the ground acceleration (linear in time) in the frame of the state's side, and its slope."""
    sign = side_sign(state.side)
    return sign * compute_acceleration(ground, state.piece, state.offset), sign * coefficient(ground, state.piece, 1)


@inlined
def resolve_step(c: RotationCoefficients, t: float, state: Struct, overturn_angle: float) -> StepEnd:
    """Return the end of a step of duration t, or its first impact; UNDECIDED if the bounds are inconclusive."""
    if c[1] == 0.0 and c[2] == 0.0:  # balanced, perhaps forever
        return create_undecided_step()
    outcome = StepOutcome.STEP
    higher_terms = bound_higher_curvature(c, t)
    max_curvature = 2.0 * c[2] + 6.0 * max(c[3], 0.0) * t + higher_terms
    min_curvature = 2.0 * c[2] + 6.0 * min(c[3], 0.0) * t - higher_terms
    if c[0] == 0.0:
        # u/t > v + min(u'')/2 t: no impact while the right side is positive.
        if not c[1] + 0.5 * min(min_curvature, 0.0) * t > 0.0:
            t, outcome = find_impact_from_ground(c, t), StepOutcome.IMPACT
    else:
        end = evaluate_rotation(c, t)
        # The rotation is at most t^2/8 times the curvature below the lower of both ends.
        if not min(c[0], end) > 0.125 * t * t * max(max_curvature, 0.0):
            is_falling = max_curvature < 0.0 or c[1] + max(max_curvature, 0.0) * t < 0.0
            t, outcome = find_impact_from_above(c, t) if end < 0.0 and is_falling else np.nan, StepOutcome.IMPACT
    if math.isnan(t):
        return create_undecided_step()
    end, speed = (evaluate_rotation(c, t) if outcome == StepOutcome.STEP else 0.0), evaluate_velocity(c, t)
    peak_time, peak = t, end
    is_rising = c[1] + min(min_curvature, 0.0) * t > 0.0
    if not is_rising and max(c[0], end) - 0.125 * t * t * min(min_curvature, 0.0) > state.peak:
        if not (max_curvature < 0.0 and c[1] > 0.0 and speed < 0.0):
            return create_undecided_step()
        peak_time = find_peak_time(c, t)
        peak = evaluate_rotation(c, peak_time)
    if not max(c[0], peak) < overturn_angle:
        return create_undecided_step()
    return StepEnd(outcome, t, end, speed, peak_time, peak)


@inlined
def bound_higher_curvature(c: RotationCoefficients, t: float) -> float:
    """Bound the contribution of the terms from the fourth power on to |u''| within t."""
    high = 56.0 * abs(c[8]) + 72.0 * abs(c[9]) * t
    middle = 30.0 * abs(c[6]) + 42.0 * abs(c[7]) * t
    low = 12.0 * abs(c[4]) + 20.0 * abs(c[5]) * t
    square = t * t
    return square * (low + square * (middle + square * high))


@inlined
def is_sufficient_linear(c: RotationCoefficients, t: float) -> bool:
    """Return whether nine terms of a linear series are sufficient at t for the velocity to its last place."""
    t2 = t * t
    t4 = t2 * t2
    return 9.0 * (abs(c[8]) + abs(c[9]) * t) * (t4 * t4) <= _MAX_LAST_RATIO * (abs(c[1]) * t + 2.0 * abs(c[2]) * t2)


@inlined
def evaluate_rotation(c: RotationCoefficients, t: float) -> float:
    """Evaluate a series in pairs, a shorter chain of operations than Horner's rule."""
    t2 = t * t
    low = (c[2] + c[3] * t) + (c[4] + c[5] * t) * t2
    high = (c[6] + c[7] * t) + (c[8] + c[9] * t) * t2
    return c[0] + t * (c[1] + t * (low + high * (t2 * t2)))


@inlined
def evaluate_velocity(c: RotationCoefficients, t: float) -> float:
    """Evaluate the derivative of a series."""
    t2 = t * t
    low = (2.0 * c[2] + 3.0 * c[3] * t) + (4.0 * c[4] + 5.0 * c[5] * t) * t2
    high = (6.0 * c[6] + 7.0 * c[7] * t) + (8.0 * c[8] + 9.0 * c[9] * t) * t2
    return c[1] + t * (low + high * (t2 * t2))


@inlined
def evaluate_divided_by_time(c: RotationCoefficients, t: float) -> tuple[float, float]:
    """Compute value and slope of a series without constant term, divided by t."""
    t2 = t * t
    low = (c[2] + c[3] * t) + (c[4] + c[5] * t) * t2
    high = (c[6] + c[7] * t) + (c[8] + c[9] * t) * t2
    low_slope = (c[2] + 2.0 * c[3] * t) + (3.0 * c[4] + 4.0 * c[5] * t) * t2
    high_slope = (5.0 * c[6] + 6.0 * c[7] * t) + (7.0 * c[8] + 8.0 * c[9] * t) * t2
    return c[1] + t * (low + high * (t2 * t2)), low_slope + high_slope * (t2 * t2)


@inlined
def find_peak_time(c: RotationCoefficients, duration: float) -> float:
    """Find the time of the peak of a concave arc that rises first and falls after ``duration``; NaN if not found."""
    t = min(duration, -0.5 * c[1] / c[2])
    for _ in range(_NEWTON_STEPS):
        t2 = t * t
        low = (2.0 * c[2] + 6.0 * c[3] * t) + (12.0 * c[4] + 20.0 * c[5] * t) * t2
        high = (30.0 * c[6] + 42.0 * c[7] * t) + (56.0 * c[8] + 72.0 * c[9] * t) * t2
        step = evaluate_velocity(c, t) / (low + high * (t2 * t2))
        t -= step
        if abs(step) <= _CONVERGED * t:
            return t if 0.0 < t < duration else np.nan
    return np.nan


@inlined
def find_impact_from_ground(c: RotationCoefficients, duration: float) -> float:
    """Find the time of the next impact within a duration if u/t decreases until then; else NaN."""
    discriminant = c[2] * c[2] - 4.0 * c[3] * c[1]
    if not (c[2] < 0.0 and discriminant > 0.0):
        return np.nan
    t = 2.0 * c[1] / (math.sqrt(discriminant) - c[2])
    if not t < duration:
        return np.nan
    for _ in range(_NEWTON_STEPS):
        f, slope = evaluate_divided_by_time(c, t)
        step = f / slope
        t -= step
        if abs(step) <= _CONVERGED * t:
            is_decreasing = c[2] + 2.0 * max(c[3], 0.0) * t + 0.25 * bound_higher_curvature(c, t) < 0.0
            return t if is_decreasing and t < duration else np.nan
    return np.nan


@inlined
def find_impact_from_above(c: RotationCoefficients, duration: float) -> float:
    """Find the only root of an arc that is above ground now and below after ``duration``; NaN if not found."""
    discriminant = c[1] * c[1] - 4.0 * c[2] * c[0]
    if not discriminant > 0.0:
        return np.nan
    t = min(duration, 2.0 * c[0] / (math.sqrt(discriminant) - c[1]))
    for _ in range(_NEWTON_STEPS):
        step = evaluate_rotation(c, t) / evaluate_velocity(c, t)
        t -= step
        if abs(step) <= _CONVERGED * t:
            return t if 0.0 < t < duration else np.nan
    return np.nan
