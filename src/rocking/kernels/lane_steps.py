"""One step of a group of lanes (linear, linear under varying weight, or nonlinear), and bounds on its events.

A step marks and counts the lanes in which an event may occur (always with NaN, never without a block), and changes only
the others that have a block. Weights are in the ground's frame, divided by the weight at rest.
"""

from typing import TypeVar

import numpy as np

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.series import (
    Line,
    has_negligible_truncation,
    nonlinear_velocity_terms,
    sum_forcing,
    weighted_velocity_terms,
)
from rocking.kernels.state import Record

#: Number of lanes that step together, a constant so that their loops have a fixed length.
WIDTH = 32

_LANES = ("f8", (WIDTH,))
_SIDES = ("f8", (2,))

#: Group of lanes: index of the block; whether its step may contain an event; u, u' and (nonlinear)
#: sin and cos(alpha - u) before and after the step; constants of the present side (`STEP_CONSTANTS`); largest rotation;
#: factor on the motion.
GROUP = np.dtype(
    [("block", "i8", (WIDTH,)), ("event", "i8", (WIDTH,))]
    + [
        (name, *_LANES)
        for name in (
            "u", "v", "sine", "cosine", "next_u", "next_v", "next_sine", "next_cosine",
            "stiffness", "pull", "push", "first", "second", "third", "curve", "peak", "factor",
            "sticking_push", "sticking_slope", "twice_slenderness",
        )
    ],
    align=True,
)  # fmt: skip

#: Constants of a step of length h on each side. Linear: lam, gain threshold, side gain (u'' = lam u - pull - push a),
#: h c1, h^2 c2, h^3 c3 with Stumpff's functions c_k of lam h^2. Nonlinear: -lam h^2/2 instead of lam, sign of the side
#: instead of its gain. ``curve`` max |u''| bounds the distance of the rotation above or below both ends of the step.
STEP_CONSTANTS = np.dtype(
    [(name, *_SIDES) for name in ("stiffness", "pull", "push", "first", "second", "third", "curve")], align=True
)

MaybeLine = TypeVar("MaybeLine", Line, None, Line | None)

#: Largest bound on the next terms by the last ones, divided by the first two; the truncation is 1/100 of it.
_NEXT_TERMS = 2.0**-46


@inlined
def scale_line(line: Line, factor: float, unit: float) -> Line:
    """Return a line of the motion, multiplied by a factor, in units of g, rounded as `ground.coefficient`."""
    return (line[0] * factor) * unit, (line[1] * factor) * unit


@inlined
def is_event_free(
    ends: Line, rate: float, below: float, above: float, change: Line, peak: float, overturn_angle: float
) -> bool:
    """Return whether a step certainly contains no impact, new peak or overturning; False for NaN.

    During a step from u to u1 (``ends``), the rotation stays above min(u, u1) - below and under max(u, u1) + above, and
    its rate, initially ``rate``, changes by between ``change[0]`` and ``change[1]``. A rising rotation has its peak at
    the end, which the next step compares; a falling one has it at the start, which must not exceed the peak so far.
    """
    u, u1 = ends
    lower, upper = change
    highest = max(u, u1)
    is_rising = rate + lower > 0.0
    is_falling = (rate + upper < 0.0) & (u <= peak)
    # The comparisons are separate because a minimum may ignore a NaN.
    return (
        (u > below)
        & (u1 > below)
        & ((highest + above <= peak) | is_rising | is_falling)
        & (highest + above < overturn_angle)
    )


@shared
def step_linear(group: Record, push: Line, unit: float, h: float, excess: float, overturn_angle: float) -> int:
    """Step a group through one sample by Stumpff's functions (exact for any lam and h); return the number of events.

    ``push`` is the acceleration of the unscaled motion and its slope. Because w = u'' then satisfies w'' = lam w, its
    extrema are at the ends of the step (except for ``curve``). Rounding of sample times makes the sample longer than
    ``h`` by ``excess``.
    """
    events = 0
    for lane in range(WIDTH):
        start, slope = scale_line(push, group.factor[lane], unit)
        end = start + slope * h
        u, v = group.u[lane], group.v[lane]
        lam, push_gain = group.stiffness[lane], group.push[lane]
        w = lam * u - (group.pull[lane] + push_gain * start)
        j = lam * v - push_gain * slope
        u1 = u + (h * v + (group.second[lane] * w + group.third[lane] * j))
        v1 = v + (group.first[lane] * w + group.second[lane] * j)
        w1 = lam * u1 - (group.pull[lane] + push_gain * end)
        u1 += excess * v1
        v1 += excess * w1
        min_w, max_w = min(min(w, w1), 0.0), max(max(w, w1), 0.0)
        curve = group.curve[lane]
        # Eight times ``curve`` is h^2; its product with the smallest w is h times the smallest change of the rate.
        change = (8.0 * curve * min_w, 8.0 * curve * max_w)
        is_free = is_event_free(
            (u, u1), h * v, curve * max_w, -(curve * min_w), change, group.peak[lane], overturn_angle
        )
        group.u[lane] = u1 if is_free else u
        group.v[lane] = v1 if is_free else v
        group.event[lane] = not is_free
        events += not is_free
    return events


# ---- Steps by Taylor series, divided into substeps ----


@inlined
def copy_states(group: Record, h: float) -> None:
    """Copy the state of all lanes, with the velocity per time h."""
    for lane in range(WIDTH):
        group.next_u[lane] = group.u[lane]
        group.next_v[lane] = group.v[lane] * h
        group.next_sine[lane] = group.sine[lane]
        group.next_cosine[lane] = group.cosine[lane]
        group.event[lane] = 0


@inlined
def push_during(push: Line, factor: float, unit: float, k: int, h: float) -> Line:
    """Return the ground acceleration at the start of the k-th substep of length h, and its change."""
    start, slope = scale_line(push, factor, unit)
    change = slope * h
    return start + k * change, change


@inlined
def weight_during(lift: MaybeLine, factor: float, unit: float, k: int, h: float) -> MaybeLine:
    """Return the weight at the start of the k-th substep of length h, and its change; None without a lift."""
    if lift is None:
        return lift
    start, slope = scale_line(lift, abs(factor), unit)
    change = slope * h
    return (1.0 + start) + k * change, change


@inlined
def accept_states(group: Record, rate: float) -> int:
    """Copy the new states of lanes without an event, and return the number of the other lanes."""
    events = 0
    for lane in range(WIDTH):
        has_event = group.event[lane]
        group.u[lane] = group.u[lane] if has_event else group.next_u[lane]
        group.v[lane] = group.v[lane] if has_event else group.next_v[lane] * rate
        group.sine[lane] = group.sine[lane] if has_event else group.next_sine[lane]
        group.cosine[lane] = group.cosine[lane] if has_event else group.next_cosine[lane]
        events += has_event
    return events


@shared
def step_weighted(
    group: Record, push: Line, lift: Line, unit: float, length: float, substeps: int, overturn_angle: float
) -> int:
    """Step a group of the linear model through one sample under varying weight; return the number of events.

    ``push`` and ``lift`` are the horizontal and vertical acceleration of the unscaled motion.
    """
    h = length / substeps
    copy_states(group, 1.0)
    for k in range(substeps):
        take_weighted_substep(group, push, lift, unit, k, h, overturn_angle)
    return accept_states(group, 1.0)


@shared
def take_weighted_substep(
    group: Record, push: Line, lift: Line, unit: float, k: int, h: float, overturn_angle: float
) -> None:
    """Move the copies through the k-th substep of length h and mark the lanes in which an event may occur.

    With z = h^2 (lam u - pull), r' = weight z - h^2 push. A term contributes to the second next and, as the weight
    changes, to the third. Therefore the last terms bound the truncation.
    """
    square, rate = h * h, 1.0 / h
    for lane in range(WIDTH):
        side_push = push_during(push, group.factor[lane], unit, k, h)
        weight = weight_during(lift, group.factor[lane], unit, k, h)
        w, d = weight
        u, v = group.next_u[lane], group.next_v[lane]
        q, gain = group.stiffness[lane] * square, group.push[lane] * square
        z0 = q * u - group.pull[lane] * square
        terms, r10, r11 = weighted_velocity_terms(v * h, z0, q, (gain * side_push[0], gain * side_push[1]), weight)
        r1, r2, r3, r4, r5, r6, r7, r8, r9 = terms
        high = 0.125 * r8 + ((1.0 / 9.0) * r9 + (0.1 * r10 + (1.0 / 11.0) * r11))
        low = (1.0 / 3.0) * r3 + (0.25 * r4 + (0.2 * r5 + ((1.0 / 6.0) * r6 + ((1.0 / 7.0) * r7 + high))))
        u1 = u + (r1 + (0.5 * r2 + low))
        v1 = v + rate * (r2 + (r3 + (r4 + (r5 + (r6 + (r7 + (r8 + (r9 + (r10 + r11)))))))))
        tail = 3.0 * abs(r4) + (4.0 * abs(r5) + (5.0 * abs(r6) + (6.0 * abs(r7) + 7.0 * abs(r8))))
        tail += 8.0 * abs(r9) + (9.0 * abs(r10) + 10.0 * abs(r11))
        lower, upper = min(r2 + 2.0 * min(r3, 0.0) - tail, 0.0), max(r2 + 2.0 * max(r3, 0.0) + tail, 0.0)
        is_free = is_event_free(
            (u, u1), r1, 0.125 * upper, -0.125 * lower, (lower, upper), group.peak[lane], overturn_angle
        )
        last_terms = (abs(w) + abs(d)) * (abs(r10) + abs(r11)) + abs(d) * abs(r9)
        is_free &= abs(q) * last_terms <= _NEXT_TERMS * (abs(r1) + abs(r2))
        group.event[lane] |= not is_free
        group.next_u[lane] = u1
        group.next_v[lane] = v1


@shared
def step_nonlinear(
    group: Record,
    push: Line,
    lift: Line | None,
    unit: float,
    length: float,
    h: float,
    substeps: int,
    overturn_angle: float,
) -> int:
    """Step a group of the nonlinear model through one sample and return the number of events.

    ``push`` and ``lift`` are the horizontal and any vertical acceleration of the unscaled motion. Due to rounded
    sample times, the sample has ``length``, but the constants of the lanes are for ``h``.
    """
    span = length / substeps
    copy_states(group, span)
    for k in range(substeps):
        scale = (length / h) ** 2
        take_nonlinear_substep(group, push, lift, unit, k, span, scale, overturn_angle)
    return accept_states(group, 1.0 / span)


@shared
def take_nonlinear_substep(
    group: Record,
    push: Line,
    lift: Line | None,
    unit: float,
    k: int,
    span: float,
    scale: float,
    overturn_angle: float,
) -> None:
    """Move the copies through the k-th substep and mark the lanes in which an event may occur.

    ``scale`` is the squared ratio of its length to the usual one. The
    addition theorem gives the sine and cosine of alpha - u.
    """
    for lane in range(WIDTH):
        u, r1 = group.next_u[lane], group.next_v[lane]
        s0, c0 = group.next_sine[lane], group.next_cosine[lane]
        weight = weight_during(lift, group.factor[lane], unit, k, span)
        lane_push = push_during(push, group.factor[lane], unit, k, span)
        side_push = (group.push[lane] * lane_push[0], group.push[lane] * lane_push[1])
        l2 = group.stiffness[lane] * scale
        terms, angles = nonlinear_velocity_terms(r1, (s0, c0), l2, side_push, weight)
        _, r2, r3, r4, r5, r6, r7, r8, r9 = terms
        last_terms = (1.0 / 7.0) * r7 + (0.125 * r8 + (1.0 / 9.0) * r9)
        change = r1 + (0.5 * r2 + ((1.0 / 3.0) * r3 + (0.25 * r4 + (0.2 * r5 + ((1.0 / 6.0) * r6 + last_terms)))))
        u1 = u + change
        v1 = r1 + (r2 + (r3 + (r4 + (r5 + (r6 + (r7 + (r8 + r9)))))))
        sizes = (abs(r1), abs(r2), abs(r3), abs(r4), abs(r5), abs(r6), abs(r7), abs(r8), abs(r9))
        strength = sum_forcing(weight, side_push, 1.0)
        is_converged, tail = has_negligible_truncation(sizes, angles, -2.0 * l2, strength)
        lower, upper = min(r2 - tail, 0.0), max(r2 + tail, 0.0)
        is_free = is_event_free(
            (u, u1), r1, 0.125 * upper, -0.125 * lower, (lower, upper), group.peak[lane], overturn_angle
        )
        is_free &= is_converged
        group.event[lane] |= not is_free
        # sine and 1 - cosine of the change of the rotation
        square = change * change
        higher = 1.0 / 120.0 - square * (1.0 / 5040.0 - square * (1.0 / 362880.0))
        sine = change * (1.0 - square * (1.0 / 6.0 - square * higher))
        higher = 1.0 / 720.0 - square * (1.0 / 40320.0 - square * (1.0 / 3628800.0))
        versine = square * (0.5 - square * (1.0 / 24.0 - square * higher))
        group.next_u[lane] = u1
        group.next_v[lane] = v1
        group.next_sine[lane] = s0 - (s0 * versine + c0 * sine)
        group.next_cosine[lane] = c0 - (c0 * versine - s0 * sine)
