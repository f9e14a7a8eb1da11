"""Rotation of a response at any time, and its derivatives by the input, recomputed from the nodes.

For a change of x to x (1 + epsilon), d/d epsilon at 0 is propagated: through an arc by the linearised equation of
motion, through an impact by the saltation due to its shift in time.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.arc import compute_restoring, compute_weight, evaluate_series, expand_arc, side_sign
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import compute_mean_factor, compute_restitution_factor, compute_speed_slope, find_first_root
from rocking.kernels.ground import (
    Ground,
    compute_acceleration,
    compute_acceleration_rate,
    has_vertical,
    piece_length,
    piece_start,
    select_vertical,
)
from rocking.kernels.restraints import apply_tendon_law, find_tendon_law_at_rest, update_plastic_elongation
from rocking.kernels.series import INTEGRATED_TWICE, write_variation_coefficients
from rocking.kernels.sliding import expand_slide, expand_slip, integrate_slip
from rocking.kernels.state import NODE_DTYPE, Struct, Structs, TendonLaw, create_structs

#: Nodes of a response before its march.
NO_NODES = create_structs(0, NODE_DTYPE)


class Trail(NamedTuple):
    """Problem and nodes of a response, sufficient to recompute it."""

    ground: Ground  # motion
    block: Struct  # body
    settings: Struct  # settings of the computation
    nodes: Structs  # states at the starts of all steps


def copy_trail(trail: Trail) -> Trail:
    """Copy the block of a trail if a tendon yields, because its law changes from step to step."""
    return trail._replace(block=trail.block.copy()) if trail.block["yielding"] else trail


#: Variations of rotation, velocity and a tendon's plastic elongation.
Variations = tuple[float, float, float]

#: Columns of the output of `trace`.
_ROTATION, _VELOCITY, _ACCELERATION, _SLIP, _SLIP_VELOCITY = 0, 1, 2, 3, 4


@kernel
def trace(trail: Trail, scratch: Struct, times: Floats, rows: Integers, out: Floats) -> None:
    """Write theta, theta', theta'' at times[k], in the step that starts at trail.nodes[rows[k]], into out[k].

    They are zero from the end of the last resolved arc to rest or the end of the response, and meaningless for NaN.
    Two more columns, if any, are displacement and velocity of the foot divided by g.
    """
    ground, block, settings, nodes = trail
    expanded_row = -1
    order = 0
    plastic_row, plastic_elongation = -1, 0.0  # for a tendon that yields
    landing = np.inf
    for k in range(times.shape[0]):
        row = rows[k]
        node = nodes[row]
        is_last = row + 1 == nodes.shape[0]
        is_before_rest = is_last or nodes[row + 1].side < 0  # the motion after its arc is not resolved
        elapsed = max(0.0, times[k] - piece_start(ground, node.piece) - node.offset)
        if node.side < 0:
            out[k, _ROTATION] = out[k, _VELOCITY] = out[k, _ACCELERATION] = 0.0
            write_slip(trail, scratch, row, 0, elapsed, np.inf, out[k])
            expanded_row = -1
            continue
        if row != expanded_row:
            if block.yielding:
                first, plastic_elongation = (plastic_row + 1, plastic_elongation) if row > plastic_row else (0, 0.0)
                for earlier in range(first, row + 1):
                    plastic_elongation = update_plastic_elongation(block, settings, nodes, earlier, plastic_elongation)
                plastic_row = row
                apply_tendon_law(block, node.tendon_law, plastic_elongation)
            duration = np.inf if is_last else nodes[row + 1].time - node.time
            order, h = expand_step(trail, scratch, node, duration)
            landing = np.inf
            if is_before_rest:
                lead = 0 if node.u > 0.0 else (1 if node.v > 0.0 else 2)
                landing = find_first_root(scratch.rotation, lead, order, h)
                if math.isnan(landing):
                    landing = h
            expanded_row = row
        u, v, w = evaluate_series(scratch.rotation, order, elapsed)
        if elapsed > landing or (is_before_rest and u < 0.0):
            u = v = w = 0.0
        sign = side_sign(node.side)
        write_slip(trail, scratch, row, order, elapsed, landing, out[k])
        out[k, _ROTATION] = sign * u
        out[k, _VELOCITY] = sign * v
        out[k, _ACCELERATION] = sign * w


@not_inlined
def expand_step(trail: Trail, scratch: Struct, node: Struct, duration: float) -> tuple[int, float]:
    """Write the series of the step from a node, with or without slip, into scratch; return (order, step)."""
    if node.direction != 0:
        return expand_slip(trail.ground, trail.block, trail.settings, scratch, node, duration)
    order, h, _ = expand_arc(trail.ground, trail.block, trail.settings, scratch, node, duration)
    return order, h


@not_inlined
def write_slip(
    trail: Trail, scratch: Struct, row: int, order: int, elapsed: float, landing: float, out: Floats
) -> None:
    """Write displacement and velocity of the foot in a step, whose series to ``order`` are in scratch if it rocks.

    They are linear in time between ``landing``, after the last resolved arc of a sequence, and the next node.
    """
    if out.shape[0] <= _SLIP:
        return
    nodes = trail.nodes
    node = nodes[row]
    distance = velocity = 0.0
    if node.side < 0 and node.direction != 0:
        distance, velocity = integrate_slip(scratch, expand_slide(trail.ground, trail.block, scratch, node), elapsed)
    elif node.direction != 0:
        sign = side_sign(node.side)
        distance, velocity = integrate_slip(scratch, order - 1, min(elapsed, landing))
        distance, velocity = sign * distance, sign * velocity
    out[_SLIP], out[_SLIP_VELOCITY] = node.slip + distance, velocity
    if elapsed > landing and row + 1 < nodes.shape[0]:
        next_node = nodes[row + 1]
        rest = next_node.time - node.time - landing
        share = min(1.0, (elapsed - landing) / rest) if rest > 0.0 else 1.0
        out[_SLIP] += share * (next_node.slip - out[_SLIP])
        out[_SLIP_VELOCITY] += share * (next_node.slip_rate - velocity)


# ---- Derivatives of a response with respect to its input ----


class Quantity(IntEnum):
    """Quantity that varies: FREQUENCY (p), SLENDERNESS and RESTITUTION of both sides, or of one (_PLUS, _MINUS)."""

    MOTION = 0
    ROTATION = 1
    VELOCITY = 2
    FREQUENCY = 3
    SLENDERNESS = 4
    RESTITUTION = 5
    FREQUENCY_PLUS = 6
    SLENDERNESS_PLUS = 7
    RESTITUTION_PLUS = 8
    FREQUENCY_MINUS = 9
    SLENDERNESS_MINUS = 10
    RESTITUTION_MINUS = 11
    NOTHING = 12


#: An uplift is a jump if the motion exceeds the threshold by more than this fraction of it.
_MIN_JUMP_EXCESS = 1e-9


@kernel
def compute_variation(
    trail: Trail,
    scratch: Struct,
    variation: Struct,
    quantity: int,
    times: Floats,
    changes: Floats,
    impacts: Floats,
    events: Floats,
) -> None:
    """Write changes of u at given times, and shifts of all impacts and events, per unit of epsilon, into arrays.

    ``times`` ascend; at an impact, the change before it is written. ``variation`` is scratch space
    (`state.VARIATION_DTYPE`).
    """
    nodes = trail.nodes
    impact_count = event_count = 0
    du = nodes[0].u if quantity == Quantity.ROTATION else 0.0
    dv = nodes[0].v if quantity == Quantity.VELOCITY else 0.0
    plastic_elongation, plastic_variation = 0.0, differentiate_start_plasticity(trail) * du  # of a tendon
    written = count_times_until(times, 0, nodes[0].time)
    changes[:written] = du
    changes[written:] = 0.0
    for k in range(nodes.shape[0]):
        node = nodes[k]
        if trail.block.yielding:
            plastic_elongation = update_plastic_elongation(trail.block, trail.settings, nodes, k, plastic_elongation)
            apply_tendon_law(trail.block, node.tendon_law, plastic_elongation)
        if k + 1 == nodes.shape[0]:
            if node.side >= 0 and event_count < events.shape[0]:
                events[event_count] = -du / node.v
            break
        next_node = nodes[k + 1]
        start, duration = (du, dv, plastic_variation), next_node.time - node.time
        first, written = written, count_times_until(times, written, next_node.time)
        if node.side < 0:
            tendon_change = vary_tendon_restoring(trail.block, next_node.side, plastic_elongation, plastic_variation)
            shift_of_rest = events[event_count - 1] if event_count > 0 else 0.0
            du = 0.0
            events[event_count], dv = vary_uplift(trail, node, next_node, quantity, tendon_change, shift_of_rest)
            event_count += 1
        elif next_node.side < 0:
            shift = impacts[impact_count - 1] if impact_count > 0 else 0.0
            variations = (dv, shift, plastic_elongation, plastic_variation)
            events[event_count] = compute_rest_shift(trail, node, quantity, variations, next_node)
            event_count += 1
            if written > first:
                order = expand_variation(trail, scratch, variation, node, quantity, start, duration)
                part = slice(first, written)
                write_changes(trail, scratch, variation, node, order, times[part], changes[part], True)
        else:
            order = expand_variation(trail, scratch, variation, node, quantity, start, duration)
            write_changes(trail, scratch, variation, node, order, times[first:written], changes[first:written], False)
            t = compute_step_duration(trail, node, next_node)
            du, dv, _ = evaluate_series(variation.rotation, order, t)
            if node.tendon_law == TendonLaw.PLASTIC and next_node.tendon_law != node.tendon_law:
                plastic_variation = compute_elongation_rate(trail, node.side, next_node.u) * du
            if is_impact(nodes, k):
                _, speed, _ = evaluate_series(scratch.rotation, order, t)
                shift = du / -speed
                sign = -1.0 if trail.block.two_stops and next_node.side != node.side else 1.0  # the other stop
                rates = sign * dv, -sign * speed
                du, dv = compute_saltation(trail, node, next_node, quantity, shift, rates, impact_count)
                impacts[impact_count] = shift
                impact_count += 1


@inlined
def vary_uplift(
    trail: Trail, node: Struct, next_node: Struct, quantity: int, tendon_change: float, shift_of_rest: float
) -> tuple[float, float]:
    """Compute shift and velocity variation of an uplift after a rest whose start shifts by ``shift_of_rest``."""
    if next_node.time > node.time or node.time == trail.nodes[0].time:
        return compute_uplift_shift(trail, next_node, quantity, tendon_change), 0.0
    # The ground ends the rest immediately: the arc starts at the same time.
    return shift_of_rest, shift_of_rest * compute_restoring(
        trail.ground, trail.block, next_node.side, next_node.piece, next_node.offset
    )


@inlined
def count_times_until(times: Floats, count: int, last: float) -> int:
    """Count the times up to ``last``, starting from a known ``count``."""
    while count < times.shape[0] and times[count] <= last:
        count += 1
    return count


@not_inlined
def write_changes(
    trail: Trail,
    scratch: Struct,
    variation: Struct,
    node: Struct,
    order: int,
    times: Floats,
    changes: Floats,
    is_last: bool,
) -> None:
    """Write changes of u along the arc from a node, whose series are in scratch, until it lands."""
    for n in range(times.shape[0]):
        t = times[n] - piece_start(trail.ground, node.piece) - node.offset
        u, _, _ = evaluate_series(scratch.rotation, order, t)
        if u > 0.0 or not is_last:
            changes[n], _, _ = evaluate_series(variation.rotation, order, t)


@inlined
def find_side_quantity(quantity: int, side: int) -> int:
    """Return the quantity that varies on a side: itself, its counterpart for both sides, or NOTHING."""
    if quantity <= Quantity.RESTITUTION:
        return quantity
    part = quantity - Quantity.FREQUENCY_PLUS - 3 * side
    return Quantity.FREQUENCY + part if 0 <= part < 3 else Quantity.NOTHING


@inlined
def compute_elongation_rate(trail: Trail, side: int, u: float) -> float:
    """Compute the elongation of a tendon per rotation."""
    return trail.block.lever_arm[side] * (math.cos(0.5 * u) if trail.settings.nonlinear else 1.0)


@inlined
def differentiate_start_plasticity(trail: Trail) -> float:
    """Return the plastic elongation per rotation at the start of a response: 0 unless the tendon yields there."""
    node = trail.nodes[0]
    if not trail.block.yielding or update_plastic_elongation(trail.block, trail.settings, trail.nodes, 0, 0.0) <= 0.0:
        return 0.0
    return compute_elongation_rate(trail, node.side, node.u)


@inlined
def is_impact(nodes: Structs, k: int) -> bool:
    """Return whether the step from the k-th node ends in an impact, and not in a contact without speed."""
    node, next_node = nodes[k], nodes[k + 1]
    if node.side < 0 or next_node.side < 0 or next_node.u != 0.0:
        return False
    is_followed_by_rest = k + 2 < nodes.shape[0] and nodes[k + 2].side < 0  # immediately, if no speed is left
    return bool(next_node.side != node.side or next_node.v > 0.0 or is_followed_by_rest)


@inlined
def compute_step_duration(trail: Trail, node: Struct, next_node: Struct) -> float:
    """Compute the length of a step without the rounding of absolute times."""
    if next_node.piece == node.piece:
        return next_node.offset - node.offset
    if next_node.piece == node.piece + 1:
        return piece_length(trail.ground, node.piece) - node.offset + next_node.offset
    return next_node.time - node.time


@not_inlined
def expand_variation(
    trail: Trail, scratch: Struct, variation: Struct, node: Struct, quantity: int, start: Variations, duration: float
) -> int:
    """Write the series of the variation along the arc from a node into ``variation.rotation``, and return its order.

    ``start``: variations of rotation, velocity and a tendon's plastic elongation.
    """
    order, _, degree = expand_arc(trail.ground, trail.block, trail.settings, scratch, node, duration)
    expand_derivatives(trail, scratch, variation, node.side, degree, order)
    side_quantity = find_side_quantity(quantity, node.side)
    if side_quantity == Quantity.FREQUENCY:
        for k in range(order - 1):
            variation.forcing[k] = 2.0 * scratch.rotation[k + 2] / INTEGRATED_TWICE[k]
    elif side_quantity == Quantity.SLENDERNESS:
        for k in range(order - 1):
            variation.forcing[k] = -trail.block.slenderness[node.side] * variation.stiffness[k]
    elif side_quantity != Quantity.MOTION:
        for k in range(order - 1):
            variation.forcing[k] = 0.0
    variation.rotation[0], variation.rotation[1], plastic_elongation = start
    if plastic_elongation != 0.0 and node.tendon_law == TendonLaw.ELASTIC:
        change = trail.block.tendon_stiffness[node.side] * plastic_elongation
        for k in range(order - 1):
            variation.forcing[k] += change * (
                scratch.half_cosine[k] if trail.settings.nonlinear else (1.0 if k == 0 else 0.0)
            )
    add_restraints(trail, scratch, variation, node.side, order)
    write_variation_coefficients(variation, trail.block.damping[node.side], order)
    return order


@inlined
def expand_derivatives(trail: Trail, scratch: Struct, variation: Struct, side: int, degree: int, order: int) -> None:
    """Write the series of d u''/d u without `add_restraints`, and of u'' per change of the motion, to ``variation``.

    This removes the contribution of restraints from the motion in scratch.
    """
    lam, gain, threshold = trail.block.stiffness[side], trail.block.restoring_gain[side], trail.block.threshold[side]
    A, W, S, C = scratch.ground, scratch.weight, scratch.sine, scratch.cosine
    weight_degree = degree if has_vertical(trail.ground) else 0
    for k in range(order - 1):
        if trail.settings.nonlinear:
            stiffness = 0.0
            for j in range(min(k, weight_degree) + 1):
                stiffness += W[j] * C[k - j]
            for j in range(min(k, degree) + 1):
                stiffness -= A[j] * S[k - j]
            variation.stiffness[k] = lam * stiffness
        else:
            variation.stiffness[k] = lam * W[k] if k <= weight_degree else 0.0
    W[0] -= trail.block.added_weight[side]
    A[0] -= trail.block.added_push[side]
    for k in range(order - 1):
        if trail.settings.nonlinear:
            forcing = -S[k]
            for j in range(min(k, weight_degree) + 1):
                forcing += W[j] * S[k - j]
            for j in range(min(k, degree) + 1):
                forcing += A[j] * C[k - j]
            variation.forcing[k] = -lam * forcing
        else:
            forcing = gain * (A[k] + threshold * select_motion_weight(W, k, weight_degree)) if k <= degree else 0.0
            for j in range(min(k, weight_degree) + 1):
                forcing -= lam * select_motion_weight(W, j, weight_degree) * scratch.rotation[k - j]
            variation.forcing[k] = -forcing


@inlined
def add_restraints(trail: Trail, scratch: Struct, variation: Struct, side: int, order: int) -> None:
    """Add the contribution of prestress and springs to d u''/d u, after `expand_derivatives`."""
    variation.stiffness[0] -= trail.block.spring[side]
    if trail.settings.nonlinear and trail.block.prestress[side] != 0.0:
        for k in range(order - 1):
            variation.stiffness[k] += 0.5 * trail.block.prestress[side] * scratch.half_sine[k]


@inlined
def expand_unforced(trail: Trail, scratch: Struct, variation: Struct, side: int, degree: int, order: int) -> None:
    """Write the series of d u''/d u without forcing to ``variation``."""
    expand_derivatives(trail, scratch, variation, side, degree, order)
    for k in range(order - 1):
        variation.forcing[k] = 0.0
    add_restraints(trail, scratch, variation, side, order)


@inlined
def select_motion_weight(W: Floats, k: int, weight_degree: int) -> float:
    """Return a coefficient of the weight added by the motion."""
    if k > weight_degree:
        return 0.0
    return W[0] - 1.0 if k == 0 else W[k]


@inlined
def compute_saltation(
    trail: Trail, node: Struct, next_node: Struct, quantity: int, shift: float, rates: tuple[float, float], number: int
) -> tuple[float, float]:
    """Compute the variation after an impact that shifts; ``rates``: velocity variation before it, and impact speed.

    ``number`` is the number of earlier impacts. A variable restitution is scaled at all speeds.
    """
    block = trail.block
    dv, speed = rates
    hit = next_node.side if block.two_stops else node.side
    g_before = compute_restoring(trail.ground, block, hit, next_node.piece, next_node.offset)
    g_before -= block.damping[hit] * speed
    e = compute_restitution_factor(block, hit, speed, number)
    g_after = compute_restoring(trail.ground, block, next_node.side, next_node.piece, next_node.offset)
    g_after += block.damping[next_node.side] * (e * speed)
    speed_change = -(dv - g_before * shift) * compute_speed_slope(block, hit, speed, e)
    speed_change += speed if find_side_quantity(quantity, hit) == Quantity.RESTITUTION else 0.0
    return -next_node.v * shift, e * speed_change + g_after * shift


@inlined
def compute_uplift_shift(trail: Trail, node: Struct, quantity: int, tendon_change: float) -> float:
    """Compute the shift of the uplift of a node; ``tendon_change``: see `vary_tendon_restoring`."""
    ground, block, settings, _ = trail
    threshold = block.threshold[node.side]
    push = -compute_side_push(ground, block, node.side, node.piece, node.offset)
    rate = -compute_push_rate(ground, block, node.side, node.piece, node.offset)
    if is_jump(trail, node):
        return 0.0
    tendon_shift = tendon_change / (block.restoring_gain[node.side] * rate)
    if quantity == Quantity.MOTION:
        return -push / rate + tendon_shift
    if find_side_quantity(quantity, node.side) == Quantity.SLENDERNESS:
        growth = compute_weight(ground, node.piece, node.offset) + block.added_weight[node.side]
        if settings.nonlinear:
            growth *= 1.0 + threshold * threshold
            growth += block.prestress[node.side] * threshold / block.restoring_gain[node.side]
        return block.slenderness[node.side] * growth / rate + tendon_shift
    return tendon_shift


@inlined
def is_jump(trail: Trail, node: Struct) -> bool:
    """Return whether the motion jumps past the threshold at the uplift of a node."""
    threshold, restraint = trail.block.threshold[node.side], trail.block.restraint_threshold[node.side]
    push = -compute_side_push(trail.ground, trail.block, node.side, node.piece, node.offset)
    return bool(abs(push - threshold - restraint) > _MIN_JUMP_EXCESS * (abs(threshold) + abs(restraint)))


@inlined
def vary_tendon_restoring(block: Struct, side: int, plastic_elongation: float, change: float) -> float:
    """Compute the effect of a change of plastic elongation on the restoring acceleration at zero rotation."""
    if not block.yielding or find_tendon_law_at_rest(block, plastic_elongation) == TendonLaw.SLACK:
        return 0.0
    return -block.tendon_stiffness[side] * change


@inlined
def compute_side_push(ground: Ground, block: Struct, side: int, piece: int, offset: float) -> float:
    """Compute the acceleration towards a side plus the weight's contribution to its threshold."""
    added = compute_weight(ground, piece, offset) - 1.0
    return side_sign(side) * compute_acceleration(ground, piece, offset) + block.threshold[side] * added


@inlined
def compute_push_rate(ground: Ground, block: Struct, side: int, piece: int, offset: float) -> float:
    """Compute the rate of `compute_side_push`."""
    vertical = compute_acceleration_rate(select_vertical(ground), piece, offset) if has_vertical(ground) else 0.0
    return side_sign(side) * compute_acceleration_rate(ground, piece, offset) + block.threshold[side] * vertical


@inlined
def compute_rest_shift(
    trail: Trail, node: Struct, quantity: int, changes: tuple[float, float, float, float], rest: Struct
) -> float:
    """Compute the shift of the rest that follows an impact, to first order in the speed (the paper's Eq. 75).

    ``changes``: velocity variation after the node's impact at the unchanged time, shift of that impact, plastic
    elongation of a tendon and its variation. The time to rest is T = 2 v (1/g_i + e_i/g_j)/(1 - e_i e_j), with v and g
    at the impact.
    """
    dv, shift, plastic_elongation, plastic_variation = changes
    if rest.time == node.time:
        return shift
    block, i = trail.block, node.side
    j = block.next_side[i]
    g_i = compute_restoring(trail.ground, block, i, node.piece, node.offset)
    g_j = compute_restoring(trail.ground, block, j, node.piece, node.offset)
    tendon_i = vary_tendon_restoring(block, i, plastic_elongation, plastic_variation)
    dg_i = compute_restoring_shift(trail, node, i, quantity, shift) + tendon_i
    tendon_j = vary_tendon_restoring(block, j, plastic_elongation, plastic_variation)
    dg_j = compute_restoring_shift(trail, node, j, quantity, shift) + tendon_j
    e_i, e_j = compute_mean_factor(block, i, node.v), compute_mean_factor(block, j, node.v)
    de_i = 1.0 if find_side_quantity(quantity, i) == Quantity.RESTITUTION else 0.0
    de_j = 1.0 if find_side_quantity(quantity, j) == Quantity.RESTITUTION else 0.0
    per_speed = 2.0 * (1.0 / g_i + e_i / g_j)
    change = -2.0 * (dg_i / (g_i * g_i) + e_i * dg_j / (g_j * g_j) - de_i * e_i / g_j)
    change += per_speed * (de_i + de_j) * e_i * e_j / (1.0 - e_i * e_j)
    return shift + (per_speed * (dv - g_i * shift) + change * node.v) / (1.0 - e_i * e_j)


@inlined
def compute_restoring_shift(trail: Trail, node: Struct, j: int, quantity: int, shift: float) -> float:
    """Compute the change of a restoring acceleration at an impact that shifts."""
    ground, block, settings, _ = trail
    motion = compute_acceleration(ground, node.piece, node.offset)
    change = block.restoring_gain[j] * shift * compute_push_rate(ground, block, j, node.piece, node.offset)
    if quantity == Quantity.MOTION:
        change += block.restoring_gain[j] * compute_side_push(ground, block, j, node.piece, node.offset)
    elif find_side_quantity(quantity, j) == Quantity.FREQUENCY:
        change += 2.0 * compute_restoring(ground, block, j, node.piece, node.offset)
    elif find_side_quantity(quantity, j) == Quantity.SLENDERNESS:
        per_angle = compute_weight(ground, node.piece, node.offset) + block.added_weight[j]
        if settings.nonlinear:
            per_angle = block.cosine[j] * per_angle - (side_sign(j) * motion + block.added_push[j]) * block.sine[j]
        change += block.stiffness[j] * per_angle * block.slenderness[j]
    return change
