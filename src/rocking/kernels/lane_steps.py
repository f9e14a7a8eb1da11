"""One step of a group of lanes (linear, linear under varying weight, or nonlinear), and bounds on its events.

A step marks and counts the lanes in which an event may occur (always with NaN, never without a block), and changes only
the others that have a block. Weights are in the ground's frame, divided by the weight at rest.
"""

from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.series import (
    ValueAndSlope,
    compute_nonlinear_terms,
    compute_weighted_terms,
    has_negligible_truncation,
    sum_forcing,
)
from rocking.kernels.state import Struct, define_struct

#: Number of lanes that step together, a constant so that their loops have a fixed length.
LANE_COUNT = 32

_LANES = ("f8", (LANE_COUNT,))
_SIDES = ("f8", (2,))

#: Group of lanes: index of the simulation (-1: none); row of its sample, and first row that lanes do not step;
#: increment of the row by a step (0 without a simulation); whether the step may contain an event, whether one of its
#: substeps may, whether its series is too short, whether the step is still to be taken; length of the sample,
#: accelerations (horizontal, vertical) of the unscaled motion at its start, and their slopes; u, u' and (nonlinear) sin
#: and cos(alpha - u) before and after the step; constants of the present side (`STEP_CONSTANTS_DTYPE`); largest
#: rotation; rotation of overturning; usual length of a sample; factor on the motion; with friction, the largest push
#: without a slip at zero velocity and its decrease per squared velocity (`sliding.may_slip`).
GROUP_DTYPE = define_struct(
    **dict.fromkeys(
        ("simulation", "row", "end_row", "increment", "has_event", "has_substep_event", "is_truncated", "is_pending"),
        ("i8", (LANE_COUNT,)),
    ),
    **dict.fromkeys(
        (
            "length", "push_start", "push_slope", "vertical_start", "vertical_slope",
            "u", "v", "sine", "cosine", "next_u", "next_v", "next_sine", "next_cosine", "stiffness", "pull",
            "push_gain", "stumpff_1", "stumpff_2", "stumpff_3", "curvature_factor", "peak", "overturn_angle", "h",
            "factor", "sticking_push", "sticking_slope",
        ),
        _LANES,
    ),
)  # fmt: skip

#: Constants of a step of length h on each side. Linear: lam, gain threshold, side gain (u'' = lam u - pull - push a), h
#: c1, h^2 c2, h^3 c3 with Stumpff's functions c_k of lam h^2. Nonlinear: -lam h^2/2 instead of lam, sign of the side
#: instead of its gain. ``curvature_factor`` max |u''| bounds the distance of the rotation above or below both ends of
#: the step.
STEP_CONSTANTS_DTYPE = define_struct(
    **dict.fromkeys(
        ("stiffness", "pull", "push_gain", "stumpff_1", "stumpff_2", "stumpff_3", "curvature_factor"), _SIDES
    )
)

#: Largest bound on the next terms by the last ones, divided by the first two; the truncation is 1/100 of it.
_MAX_NEXT_RATIO = 2.0**-46


@inlined
def compute_push_line(group: Struct, lane: int, g_per_unit: float) -> ValueAndSlope:
    """Return the ground acceleration at the start of a sample and its slope, g, rounded as `ground.coefficient`."""
    factor = group.factor[lane]
    return (group.push_start[lane] * factor) * g_per_unit, (group.push_slope[lane] * factor) * g_per_unit


@inlined
def compute_weight_line(group: Struct, lane: int, g_per_unit: float) -> ValueAndSlope:
    """Return the weight at the start of a sample, divided by the weight at rest, and its slope."""
    factor = abs(group.factor[lane])
    return 1.0 + (group.vertical_start[lane] * factor) * g_per_unit, (group.vertical_slope[lane] * factor) * g_per_unit


@inlined
def is_event_free(
    group: Struct, lane: int, ends: tuple[float, float], rate: float, rate_changes: tuple[float, float]
) -> bool:
    """Return whether a step certainly contains no impact, new peak or overturning; False for NaN.

    During a step from u to u1 (``ends``), the rate of the rotation per step, initially ``rate``, changes by between
    ``rate_changes[0]`` and ``rate_changes[1]``. Therefore the rotation exceeds neither end by more than an eighth of
    them. A rising rotation has its peak at the end, which the next step compares; a falling one has it at the start,
    which must not exceed the peak so far.
    """
    u, u1 = ends
    lower, upper = rate_changes
    peak, below, highest = group.peak[lane], 0.125 * upper, max(u, u1) - 0.125 * lower
    is_rising = rate + lower > 0.0
    is_falling = (rate + upper < 0.0) & (u <= peak)
    # The comparisons are separate because a minimum may ignore a NaN.
    is_below = highest < group.overturn_angle[lane]
    return (u > below) & (u1 > below) & ((highest <= peak) | is_rising | is_falling) & is_below


@not_inlined
def step_linear(group: Struct, g_per_unit: float) -> int:
    """Step a group through one sample by Stumpff's functions (exact for any lam and h); return the number of events.

    Because w = u'' then satisfies w'' = lam w, its extrema are at the ends of the step (except for
    ``curvature_factor``). Rounding of sample times makes some samples longer or shorter than h.
    """
    events = 0
    for lane in range(LANE_COUNT):
        h = group.h[lane]
        start, slope = compute_push_line(group, lane, g_per_unit)
        end = start + slope * h
        u, v = group.u[lane], group.v[lane]
        lam, push_gain = group.stiffness[lane], group.push_gain[lane]
        w = lam * u - (group.pull[lane] + push_gain * start)
        j = lam * v - push_gain * slope
        u1 = u + (h * v + (group.stumpff_2[lane] * w + group.stumpff_3[lane] * j))
        v1 = v + (group.stumpff_1[lane] * w + group.stumpff_2[lane] * j)
        w1 = lam * u1 - (group.pull[lane] + push_gain * end)
        excess = group.length[lane] - h
        u1 += excess * v1
        v1 += excess * w1
        min_w, max_w = min(min(w, w1), 0.0), max(max(w, w1), 0.0)
        curvature_factor = group.curvature_factor[lane]
        # Eight times ``curve`` is h^2; its product with the smallest w is h times the smallest change of the rate.
        is_free = is_event_free(
            group, lane, (u, u1), h * v, (8.0 * curvature_factor * min_w, 8.0 * curvature_factor * max_w)
        )
        group.u[lane] = u1 if is_free else u
        group.v[lane] = v1 if is_free else v
        group.row[lane] += group.increment[lane] if is_free else 0
        group.has_event[lane] = not is_free
        events += not is_free
    return events


# ---- Steps by Taylor series, divided into substeps ----


@inlined
def begin_step(group: Struct) -> None:
    """Declare the step of every lane as still to be taken."""
    for lane in range(LANE_COUNT):
        group.has_event[lane] = group.is_pending[lane] = 1


@inlined
def copy_states(group: Struct, substeps: int, scaled: bool) -> None:
    """Copy the state of all lanes; if ``scaled``, with the velocity per substep."""
    for lane in range(LANE_COUNT):
        group.next_u[lane] = group.u[lane]
        group.next_v[lane] = group.v[lane] * (group.length[lane] / substeps) if scaled else group.v[lane]
        group.next_sine[lane] = group.sine[lane]
        group.next_cosine[lane] = group.cosine[lane]
        group.has_substep_event[lane] = group.is_truncated[lane] = 0


@inlined
def accept_states(group: Struct, substeps: int, scaled: bool) -> tuple[int, int]:
    """Copy the new states of lanes without an event; return the numbers of other lanes, and of those to be repeated."""
    events = retries = 0
    for lane in range(LANE_COUNT):
        is_free = (group.is_pending[lane] != 0) & (group.has_substep_event[lane] == 0)
        rate = 1.0 / (group.length[lane] / substeps) if scaled else 1.0
        group.u[lane] = group.next_u[lane] if is_free else group.u[lane]
        group.v[lane] = group.next_v[lane] * rate if is_free else group.v[lane]
        group.sine[lane] = group.next_sine[lane] if is_free else group.sine[lane]
        group.cosine[lane] = group.next_cosine[lane] if is_free else group.cosine[lane]
        group.row[lane] += group.increment[lane] if is_free else 0
        group.has_event[lane] = 0 if is_free else group.has_event[lane]
        group.is_pending[lane] &= group.is_truncated[lane]
        events += group.has_event[lane]
        retries += group.is_pending[lane]
    return events, retries


@not_inlined
def step_weighted(group: Struct, g_per_unit: float, substeps: int) -> int:
    """Step a group of the linear model through one sample under varying weight; return the number of events."""
    begin_step(group)
    copy_states(group, substeps, scaled=False)
    for k in range(substeps):
        take_weighted_substep(group, g_per_unit, k, substeps)
    return accept_states(group, substeps, scaled=False)[0]


@not_inlined
def take_weighted_substep(group: Struct, g_per_unit: float, k: int, substeps: int) -> None:
    """Move the copies through the k-th substep and mark the lanes in which an event may occur.

    With z = h^2 (lam u - pull), r' = weight z - h^2 push. A term contributes to the second next and, as the weight
    changes, to the third. Therefore the last terms bound the truncation.
    """
    for lane in range(LANE_COUNT):
        h = group.length[lane] / substeps
        square, rate = h * h, 1.0 / h
        side_push = shift_line(compute_push_line(group, lane, g_per_unit), k, h)
        weight = shift_line(compute_weight_line(group, lane, g_per_unit), k, h)
        w, d = weight
        u, v = group.next_u[lane], group.next_v[lane]
        q, gain = group.stiffness[lane] * square, group.push_gain[lane] * square
        z0 = q * u - group.pull[lane] * square
        terms, r10, r11 = compute_weighted_terms(v * h, z0, q, (gain * side_push[0], gain * side_push[1]), weight)
        r1, r2, r3, r4, r5, r6, r7, r8, r9 = terms
        last_terms = 0.125 * r8 + ((1.0 / 9.0) * r9 + (0.1 * r10 + (1.0 / 11.0) * r11))
        middle_terms = (1.0 / 3.0) * r3 + (
            0.25 * r4 + (0.2 * r5 + ((1.0 / 6.0) * r6 + ((1.0 / 7.0) * r7 + last_terms)))
        )
        u1 = u + (r1 + (0.5 * r2 + middle_terms))
        v1 = v + rate * (r2 + (r3 + (r4 + (r5 + (r6 + (r7 + (r8 + (r9 + (r10 + r11)))))))))
        tail = 3.0 * abs(r4) + (4.0 * abs(r5) + (5.0 * abs(r6) + (6.0 * abs(r7) + 7.0 * abs(r8))))
        tail += 8.0 * abs(r9) + (9.0 * abs(r10) + 10.0 * abs(r11))
        lower, upper = min(r2 + 2.0 * min(r3, 0.0) - tail, 0.0), max(r2 + 2.0 * max(r3, 0.0) + tail, 0.0)
        is_free = is_event_free(group, lane, (u, u1), r1, (lower, upper))
        next_terms = (abs(w) + abs(d)) * (abs(r10) + abs(r11)) + abs(d) * abs(r9)
        is_free &= abs(q) * next_terms <= _MAX_NEXT_RATIO * (abs(r1) + abs(r2))
        group.has_substep_event[lane] |= not is_free
        group.next_u[lane] = u1
        group.next_v[lane] = v1


@inlined
def shift_line(line: ValueAndSlope, k: int, h: float) -> ValueAndSlope:
    """Return the value of a line at the start of the k-th substep of length h, and its change."""
    change = line[1] * h
    return line[0] + k * change, change


@inlined
def shift_weight(
    group: Struct, lane: int, resting_weight: ValueAndSlope | None, g_per_unit: float, k: int, h: float
) -> ValueAndSlope | None:
    """Return the weight at the start of the k-th substep of length h, and its change; None if it is constant."""
    if resting_weight is None:
        return resting_weight
    return shift_line(compute_weight_line(group, lane, g_per_unit), k, h)


@not_inlined
def step_nonlinear(group: Struct, resting_weight: ValueAndSlope | None, g_per_unit: float, substeps: int) -> int:
    """Step a group of the nonlinear model through one sample and return the number of events.

    ``resting_weight`` is (1, 0), the weight without vertical motion and its slope, or None if it is constant. A lane
    whose series is too short repeats the step with twice as many substeps, independently of other lanes.
    """
    begin_step(group)
    for refinement in range(1, 3):
        count = refinement * substeps
        copy_states(group, count, scaled=True)
        for k in range(count):
            take_nonlinear_substep(group, resting_weight, g_per_unit, k, count, 1.0 / refinement)
        events, retries = accept_states(group, count, scaled=True)
        if retries == 0:
            break
    return events


@not_inlined
def take_nonlinear_substep(
    group: Struct, resting_weight: ValueAndSlope | None, g_per_unit: float, k: int, count: int, fraction: float
) -> None:
    """Move the copies through the k-th of ``count`` substeps, and mark lanes with possible events or truncation.

    Its length is a ``fraction`` of that for which the lanes have constants. The addition theorem gives the sine and
    cosine of alpha - u.
    """
    for lane in range(LANE_COUNT):
        span = group.length[lane] / count
        scale = (group.length[lane] / group.h[lane] * fraction) ** 2
        u, r1 = group.next_u[lane], group.next_v[lane]
        s0, c0 = group.next_sine[lane], group.next_cosine[lane]
        weight = shift_weight(group, lane, resting_weight, g_per_unit, k, span)
        lane_push = shift_line(compute_push_line(group, lane, g_per_unit), k, span)
        side_push = (group.push_gain[lane] * lane_push[0], group.push_gain[lane] * lane_push[1])
        l2 = group.stiffness[lane] * scale
        terms, angle_sums = compute_nonlinear_terms(r1, (s0, c0), l2, side_push, weight)
        _, r2, r3, r4, r5, r6, r7, r8, r9 = terms
        last_terms = (1.0 / 7.0) * r7 + (0.125 * r8 + (1.0 / 9.0) * r9)
        change = r1 + (0.5 * r2 + ((1.0 / 3.0) * r3 + (0.25 * r4 + (0.2 * r5 + ((1.0 / 6.0) * r6 + last_terms)))))
        u1 = u + change
        v1 = r1 + (r2 + (r3 + (r4 + (r5 + (r6 + (r7 + (r8 + r9)))))))
        sizes = (abs(r1), abs(r2), abs(r3), abs(r4), abs(r5), abs(r6), abs(r7), abs(r8), abs(r9))
        forcing_bounds = sum_forcing(weight, side_push, 1.0)
        is_converged, tail = has_negligible_truncation(sizes, angle_sums, -2.0 * l2, forcing_bounds)
        lower, upper = min(r2 - tail, 0.0), max(r2 + tail, 0.0)
        is_free = is_event_free(group, lane, (u, u1), r1, (lower, upper))
        group.has_substep_event[lane] |= not (is_free & is_converged)
        group.is_truncated[lane] |= not is_converged
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
