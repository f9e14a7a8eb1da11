"""Slip with Coulomb friction: contact forces, series of slide and slide-rock, impacts, and proofs until rest.

Forces are divided by the weight at rest, and lengths by g. In the frame of the side of sign i, with psi = alpha - u,
b = sin(psi) - s mu cos(psi), the direction s = i sign(V) of the slip and the ratio r of R^2 to k^2,

    stick       H = A + R (cos(psi) u'' + sin(psi) u'^2)      N = W + R (sin(psi) u'' - cos(psi) u'^2)
    slide-rock  N = (W - R cos(psi) u'^2) / (1 + r sin(psi) b)      u'' = -lam (1 + r) N b
                V' = -s mu N - A - R (cos(psi) u'' + sin(psi) u'^2)

The linear model has psi for sin(psi), 1 for cos(psi), W for N, and the height of the centre of mass for R. See
"Sliding" in the documentation. NaN arguments result in NaN, in no event, and in no proof.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.arc import (
    NEGLIGIBLE,
    compute_weight,
    expand_arc,
    pad_to_same_degree,
    side_sign,
    write_weight_series,
)
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.events import StepEnd, find_first_negative_beyond_rounding
from rocking.kernels.ground import (
    Ground,
    bound_piece,
    coefficient,
    compute_acceleration,
    has_vertical,
    is_piecewise_linear,
    last_piece,
    select_vertical,
    write_local_series,
)
from rocking.kernels.series import INTEGRATED_TWICE, write_angle_coefficients
from rocking.kernels.state import ORDER, Struct

#: First step after an impact, divided by the arc's duration under constant acceleration.
_FIRST_STEP = 1.3

#: Accelerations of the foot that rounding may cause, divided by g.
_ACCELERATION_ROUNDING = 2.0**-48

#: Number of last terms that must be negligible where a series ends, and largest number of times that a step is
#: shortened until they are.
_LAST_TERMS = 4
_MAX_SHORTENINGS = 60


@inlined
def compute_slip_stiffness(block: Struct, side: int) -> float:
    """Return lam (1 + R^2/k^2), the rate of u'' while slipping."""
    return block.stiffness[side] * (1.0 + block.inertia_ratio[side])


@inlined
def compute_slip_restoring(block: Struct, settings: Struct, side: int, direction: float) -> float:
    """Compute the restoring acceleration at zero rotation and weight 1 for a slip in the side's frame (Eq. 11)."""
    if not settings.nonlinear:
        return compute_slip_stiffness(block, side) * (block.slenderness[side] - direction * block.kinetic_friction)
    lever = block.sine[side] - direction * block.kinetic_friction * block.cosine[side]
    return compute_slip_stiffness(block, side) * lever / (1.0 + block.inertia_ratio[side] * block.sine[side] * lever)


@inlined
def slides_flat(block: Struct, side: int) -> bool:
    """Return whether a block on both pivots that slips towards a side does not tip."""
    return block.kinetic_friction <= block.threshold[side]


# ---- Leaving the cone of friction while rocking ----


@inlined
def may_slip(ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, end: StepEnd) -> bool:
    """Return whether bounds do not exclude that the forces leave the cone of friction within a step; True for NaN."""
    side, h = state.side, end.time
    if is_piecewise_linear(ground) and not has_vertical(ground):
        start = compute_acceleration(ground, state.piece, state.offset)
        push = max(abs(start), abs(start + coefficient(ground, state.piece, 1) * h))
        allowed = block.sticking_push[side]
        if settings.nonlinear:
            speed = max(abs(state.v), abs(end.v)) + block.stiffness[side] * (1.0 + push) * h
            allowed -= block.sticking_slope[side] * (speed * speed)
        if push <= allowed and max(state.peak, end.peak) <= 2.0 * block.slenderness[side]:
            return False
    ratio, arm = block.arm_over_g[side] * block.stiffness[side], block.arm_over_g[side]
    motion = bound_piece(ground, state.piece, state.offset, h, scratch.ground)
    push_low, push_high = (motion.low, motion.high) if side == 0 else (-motion.high, -motion.low)
    push = max(abs(push_low), abs(push_high))
    low = high = 1.0
    if has_vertical(ground):
        lift = bound_piece(select_vertical(ground), state.piece, state.offset, h, scratch.ground)
        low, high = 1.0 + lift.low, 1.0 + lift.high
    max_acceleration = block.stiffness[side] * (max(abs(low), abs(high)) + push) * (1.0 + 0.5 * math.pi)
    dip = 0.125 * max_acceleration * h * h
    tilt_low = block.slenderness[side] - max(state.u, end.u) - dip
    tilt_high = block.slenderness[side] - min(state.u, end.u) + dip
    if not settings.nonlinear:
        highest = max(push_high * (1.0 - ratio), 0.0) - ratio * min(tilt_low * low, tilt_low * high)
        lowest = min(push_low * (1.0 - ratio), 0.0) - ratio * max(tilt_high * low, tilt_high * high)
        return not (max(highest, -lowest) <= block.static_friction * low)
    tilt = min(1.0, max(abs(tilt_low), abs(tilt_high)))
    cosine = 1.0 - 0.5 * tilt * tilt
    sine_low = tilt_low * (1.0 - tilt_low * tilt_low / 6.0) if tilt_low > 0.0 else tilt_low
    sine_high = tilt_high if tilt_high > 0.0 else tilt_high * (1.0 - tilt_high * tilt_high / 6.0)
    weight_low = low * sine_low * cosine if sine_low > 0.0 else high * sine_low
    weight_high = high * sine_high if sine_high > 0.0 else low * sine_high * cosine
    least, most = 1.0 - ratio, 1.0 - ratio * cosine * cosine
    speed = max(abs(state.v), abs(end.v)) + 0.5 * max_acceleration * h
    inertia = arm * speed * speed
    highest = (push_high * most if push_high > 0.0 else push_high * least) - ratio * weight_low + inertia * tilt
    lowest = (push_low * most if push_low < 0.0 else push_low * least) - ratio * weight_high - inertia * tilt
    normal = low * (1.0 - ratio * tilt * tilt) - ratio * push * tilt - inertia
    return not (low > 0.0 and max(highest, -lowest) <= block.static_friction * normal)


@not_inlined
def find_slip(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, h_max: float
) -> tuple[int, float, float, int]:
    """Find the first time in a step at which the forces leave the cone of friction; inf if they do not.

    Returns (order, step, time, direction of the slip). The series of the arc are then in scratch.
    """
    order, h, degree = expand_arc(ground, block, settings, scratch, state, h_max)
    write_contact_series(ground, block, settings, scratch, state, degree, order)
    time, direction = np.inf, 0
    sign = 1 - 2 * state.side
    for towards in (1, -1):
        d = scratch.auxiliary
        for k in range(order - 1):
            d[k] = block.static_friction * scratch.normal[k] - towards * scratch.horizontal[k]
        passage = find_first_negative_beyond_rounding(d, order - 2, min(h, time))
        if passage < time:
            time, direction = passage, -towards * sign
    return order, h, time, direction


@inlined
def write_contact_series(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, degree: int, order: int
) -> None:
    """Write the horizontal and the normal force without slip into scratch.horizontal and scratch.normal."""
    c, q, arm = scratch.rotation, scratch.squares, block.arm_over_g[state.side]
    weight_degree = degree if has_vertical(ground) else 0
    for n in range(order - 1):
        horizontal = scratch.ground[n] if n <= degree else 0.0
        normal = scratch.weight[n] if n <= weight_degree else 0.0
        if not settings.nonlinear:
            horizontal += arm * c[n + 2] / INTEGRATED_TWICE[n]
        else:
            write_square(scratch, n)
            for m in range(n + 1):
                y = c[n - m + 2] / INTEGRATED_TWICE[n - m]
                horizontal += arm * (scratch.cosine[m] * y + scratch.sine[m] * q[n - m])
                normal += arm * (scratch.sine[m] * y - scratch.cosine[m] * q[n - m])
        scratch.horizontal[n] = horizontal
        scratch.normal[n] = normal


@inlined
def write_square(scratch: Struct, n: int) -> None:
    """Write coefficient n of the square of the rate into scratch.squares."""
    c = scratch.rotation
    value = 0.0
    for m in range(n + 1):
        value += (m + 1) * c[m + 1] * ((n - m + 1) * c[n - m + 1])
    scratch.squares[n] = value


# ---- Series while slipping ----


@not_inlined
def expand_slip(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, h_max: float
) -> tuple[int, float]:
    """Write the series of slide-rock from a state into scratch; return (order, step), the step at most ``h_max``.

    They are the rotation, the slip velocity in the frame of the side (scratch.horizontal), and the clearance
    W - R cos(psi) u'^2, which is positive in contact (scratch.undivided_normal). The last terms are negligible.
    """
    side = state.side
    sign = side_sign(side)
    direction = sign * state.direction
    h = min(h_max, 1.0 / math.sqrt(compute_slip_stiffness(block, side)))
    if state.u == 0.0 and state.v > 0.0:
        g = compute_slip_restoring(block, settings, side, direction) * compute_weight(ground, state.piece, state.offset)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * state.v / g)
    degree = write_local_series(ground, state.piece, state.offset, sign, scratch.ground)
    weight_degree = write_weight_series(ground, state.piece, state.offset, scratch.weight)
    degree = pad_to_same_degree(scratch.ground, degree, scratch.weight, weight_degree)
    c, V = scratch.rotation, scratch.horizontal
    c[0], c[1], V[0] = state.u, state.v, sign * state.slip_rate
    if settings.nonlinear:
        psi = block.slenderness[side] - state.u
        scratch.sine[0], scratch.cosine[0] = math.sin(psi), math.cos(psi)
    negligible = 0
    largest, largest_slip, power = abs(state.v) * h, abs(V[0]) + block.kinetic_friction * h, h
    for n in range(ORDER - 1):
        push = scratch.ground[n] if n <= degree else 0.0
        weight = scratch.weight[n] if n <= degree else 0.0
        write_slip_coefficients(block, settings, side, scratch, direction, n, push, weight)
        slip_term, term = abs(V[n + 1]) * power, (n + 2) * abs(c[n + 2]) * power * h
        largest, largest_slip = max(largest, term), max(largest_slip, slip_term)
        is_negligible = term <= NEGLIGIBLE * largest and slip_term <= NEGLIGIBLE * largest_slip
        negligible = negligible + 1 if is_negligible and n > degree else 0
        if negligible == _LAST_TERMS:
            return n + 2, h
        power *= h
        if settings.nonlinear:
            write_angle_coefficients(scratch, n)
    return ORDER, shorten_slip(block, scratch, h)


@inlined
def write_slip_coefficients(
    block: Struct, settings: Struct, side: int, scratch: Struct, direction: float, n: int, push: float, weight: float
) -> None:
    """Write c[n + 2] and V[n + 1] of slide-rock from the earlier coefficients."""
    c, V, q = scratch.rotation, scratch.horizontal, scratch.squares
    s, k, b, D, N = scratch.sine, scratch.cosine, scratch.lever, scratch.divisor, scratch.normal
    mu, arm = direction * block.kinetic_friction, block.arm_over_g[side]
    if not settings.nonlinear:
        scratch.undivided_normal[n] = N[n] = weight
        y = weight * (mu - block.slenderness[side])
        for m in range(n + 1):
            y += N[m] * c[n - m]
        y *= compute_slip_stiffness(block, side)
        c[n + 2] = y * INTEGRATED_TWICE[n]
        V[n + 1] = (-mu * weight - push - arm * y) / (n + 1)
        return
    write_square(scratch, n)
    b[n] = s[n] - mu * k[n]
    lift, divisor = weight, 1.0 if n == 0 else 0.0
    for m in range(n + 1):
        lift -= arm * (k[m] * q[n - m])
        divisor += block.inertia_ratio[side] * (s[m] * b[n - m])
    scratch.undivided_normal[n], D[n] = lift, divisor
    for m in range(1, n + 1):
        lift -= D[m] * N[n - m]
    N[n] = lift / D[0]
    y = 0.0
    for m in range(n + 1):
        y -= N[m] * b[n - m]
    c[n + 2] = compute_slip_stiffness(block, side) * y * INTEGRATED_TWICE[n]
    force = -mu * N[n] - push
    for m in range(n + 1):
        force -= arm * (k[m] * (c[n - m + 2] / INTEGRATED_TWICE[n - m]) + s[m] * q[n - m])
    V[n + 1] = force / (n + 1)


@inlined
def shorten_slip(block: Struct, scratch: Struct, h: float) -> float:
    """Return a step, at most h, within which the last terms of both series are negligible."""
    c, V = scratch.rotation, scratch.horizontal
    for _ in range(_MAX_SHORTENINGS):
        largest, largest_slip, power = 0.0, abs(V[0]) + block.kinetic_friction * h, h
        excess = 0.0
        for k in range(1, ORDER + 1):
            slip = abs(V[k]) * power if k < ORDER else 0.0
            term = k * abs(c[k]) * power
            largest, largest_slip = max(largest, term), max(largest_slip, slip)
            if k > ORDER - _LAST_TERMS:
                excess = max(excess, term / (4.0 * NEGLIGIBLE * largest), slip / (4.0 * NEGLIGIBLE * largest_slip))
            power *= h
        if excess <= 1.0:
            break
        h *= max(0.5, 0.9 * excess ** (-1.0 / ORDER))
    return h


@inlined
def ignore_rounding_at_start(velocity: Floats) -> None:
    """Set the first acceleration of a foot that starts to slip to zero if it may be a rounding error."""
    if (
        velocity[0] == 0.0 and abs(velocity[1]) <= _ACCELERATION_ROUNDING
    ):  # the forces are on the cone except for rounding
        velocity[1] = 0.0


@not_inlined
def find_slip_end(scratch: Struct, order: int, h: float, direction: float) -> tuple[float, float]:
    """Find the first times in [0, h) at which slide-rock sticks, and at which contact is lost; inf if never."""
    d = scratch.auxiliary
    for k in range(order):
        d[k] = direction * scratch.horizontal[k]
    ignore_rounding_at_start(d)
    stick = find_first_negative_beyond_rounding(d, order - 1, h)
    for k in range(order - 1):
        d[k] = scratch.undivided_normal[k]
    return stick, find_first_negative_beyond_rounding(d, order - 2, h)


@inlined
def move_slip(scratch: Struct, state: Struct, degree: int, sign: float, t: float) -> None:
    """Move displacement and velocity of the foot along the series in scratch.horizontal, in a frame of some sign."""
    distance, velocity = integrate_slip(scratch, degree, t)
    state.slip += sign * distance
    state.slip_rate = sign * velocity
    state.largest_slip = max(state.largest_slip, abs(state.slip))


@inlined
def integrate_slip(scratch: Struct, degree: int, t: float) -> tuple[float, float]:
    """Return the distance until t, and the velocity at t, of the series in scratch.horizontal."""
    V = scratch.horizontal
    distance, velocity = V[degree] / (degree + 1), V[degree]
    for k in range(degree - 1, -1, -1):
        distance = distance * t + V[k] / (k + 1)
        velocity = velocity * t + V[k]
    return distance * t, velocity


@not_inlined
def expand_slide(ground: Ground, block: Struct, scratch: Struct, state: Struct) -> int:
    """Write the velocity of a block that slides on both pivots into scratch.horizontal; return its degree."""
    A, W, V = scratch.ground, scratch.weight, scratch.horizontal
    degree = write_local_series(ground, state.piece, state.offset, 1.0, A)
    degree = pad_to_same_degree(A, degree, W, write_weight_series(ground, state.piece, state.offset, W))
    V[0] = state.slip_rate
    for k in range(degree + 1):
        V[k + 1] = -(A[k] + state.direction * block.kinetic_friction * W[k]) / (k + 1)
    return degree + 1


@inlined
def find_slide_end(
    ground: Ground, block: Struct, scratch: Struct, state: Struct, degree: int, h: float
) -> tuple[float, float, float]:
    """Find the length of a step of slide, and the times in it at which it ends and contact is lost; inf if never."""
    d = scratch.auxiliary
    if state.piece == last_piece(ground):
        h = min(h, 2.0 * abs(state.slip_rate) / block.kinetic_friction)
    for k in range(degree + 1):
        d[k] = state.direction * scratch.horizontal[k]
    ignore_rounding_at_start(d)
    stick = find_first_negative_beyond_rounding(d, degree, h)
    lost = np.inf
    if has_vertical(ground):
        for k in range(degree):
            d[k] = scratch.weight[k]
        lost = find_first_negative_beyond_rounding(d, degree - 1, h)
    return h, stick, lost


# ---- Impacts (section 5 of the theory) ----


@inlined
def compute_slip_factor(block: Struct, side: int, e: float, direction: float) -> float:
    """Compute the factor on the speed of an impact that leaves a side and slips; ``direction`` is the slip's sign."""
    other = 1 - side
    h, d, next_d = block.height_over_g, block.pivot_distance_over_g[side], block.pivot_distance_over_g[other]
    inertia = block.arm_over_g[other] / block.stiffness[other]
    square = inertia - h * h - next_d * next_d
    couple = e * inertia - (square + h * h - d * next_d)
    lever = next_d - side_sign(other) * direction * block.kinetic_friction * h
    return (square - d * lever + couple) / (square + next_d * lever)


@not_inlined
def strike_with_friction(block: Struct, state: Struct, side: int, speed: float) -> None:
    """Change speed, slip and mode at an impact that has left a side and would stick with the speed of the state."""
    other = 1 - side
    j, h = side_sign(other), block.height_over_g
    d, next_d = block.pivot_distance_over_g[side], block.pivot_distance_over_g[other]
    inertia = block.arm_over_g[other] / block.stiffness[other]
    e = state.v / speed if speed > 0.0 else 0.0
    V = state.slip_rate
    after, rate = state.v + j * h * V / inertia, 0.0
    upward, across = next_d * after + d * speed, j * h * (after - speed) - V
    mu = block.static_friction if V == 0.0 else block.kinetic_friction
    if abs(across) > mu * upward:
        direction = -math.copysign(1.0, across)
        after = compute_slip_factor(block, side, e, direction) * speed
        rate = V - direction * block.kinetic_friction * (next_d * after + d * speed) - j * h * (after - speed)
    if not after > 0.0:  # both pivots strike
        after, rate = 0.0, V + j * h * speed
        if abs(rate) <= mu * d * speed:
            rate = 0.0
        else:
            rate -= math.copysign(block.kinetic_friction * d * speed, rate)
    state.v, state.slip_rate = after, rate
    state.direction = 0 if rate == 0.0 else (1 if rate > 0.0 else -1)


@inlined
def find_sticking_friction(block: Struct, side: int) -> float:
    """Compute the friction with which an impact that leaves a side sticks if nothing slips before (Eq. 7)."""
    e = block.restitution[side]
    d, next_d = block.pivot_distance_over_g[side], block.pivot_distance_over_g[1 - side]
    return block.height_over_g * (1.0 - e) / (next_d * e + d)


@inlined
def sum_slip_of_sequence(
    block: Struct, settings: Struct, state: Struct, g: float, other_g: float
) -> tuple[float, float]:
    """Return changes of velocity and displacement of the foot at the end of a sequence of impacts while sliding.

    They are relative to a block that slides on both pivots from the last impact on. In the nonlinear model they follow
    from both momenta. In the linear model, whose weight does not depend on the rotation, the impulses of the impacts
    are added; ``g`` and ``other_g`` are the restoring accelerations of the side entered and the other one.
    """
    side, w, sign = state.side, state.v, side_sign(state.side)
    mu = state.direction * block.kinetic_friction
    d, next_d = block.pivot_distance_over_g[side], block.pivot_distance_over_g[1 - side]
    drift = sign * block.height_over_g * w
    if settings.nonlinear:
        return drift + mu * d * w, 0.0
    e = compute_slip_factor(block, side, block.restitution[side], state.direction)
    back = compute_slip_factor(block, 1 - side, block.restitution[1 - side], state.direction)
    product = e * back
    first, second = (d + next_d * e) * w, (next_d + d * back) * e * w
    time = 2.0 * w * (1.0 / g + e / other_g) / (1.0 - product)
    next_time = 2.0 * w * (1.0 / other_g + back / g) / (1.0 - product)
    impulse = mu * (first + second) / (1.0 - product)
    waiting = mu * (first * next_time * e + second * time * product) / (1.0 - product * product)
    return drift - impulse, impulse * time - waiting


@inlined
def settle_slip(block: Struct, state: Struct) -> None:
    """Set the mode of a block without rotation: at rest, sliding, or slipping on the pivot over which it tips."""
    if state.direction != 0 and not slides_flat(block, 0 if state.direction > 0 else 1):
        state.side = 0 if state.direction > 0 else 1
