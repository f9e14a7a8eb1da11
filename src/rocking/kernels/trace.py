"""Rotation of a response at any time, and its derivatives by the input, recomputed from the nodes.

For a change of x to x (1 + epsilon), d/d epsilon at 0 is propagated: through an arc by the linearised equation of
motion, through an impact by the saltation due to its shift in time.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Floats, Integers
from rocking.kernels.arc import evaluate, expand, restoring, sign_of, weight_at
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.events import factor, first_root, middle_factor, relative_slope
from rocking.kernels.ground import Ground, acceleration, has_vertical, length_of, slope, start_of, vertical_of
from rocking.kernels.restraints import apply_tendon_law, law_of_standing, plastic_after
from rocking.kernels.series import INTEGRATED_TWICE, variation_coefficients
from rocking.kernels.state import NODE_ROW, Record, Records, TendonLaw, records

#: Nodes of a response before its march.
NO_NODES = records(0, NODE_ROW)


class Trail(NamedTuple):
    """Problem and nodes of a response, sufficient to recompute it."""

    ground: Ground
    block: Record
    settings: Record
    nodes: Records


def copy_trail(trail: Trail) -> Trail:
    """Return a trail with its own block if a tendon yields, because its law changes from step to step."""
    return trail._replace(block=trail.block.copy()) if trail.block["yielding"] else trail


#: Three variations.
Three = tuple[float, float, float]

#: Columns of the output of `trace`.
_ROTATION, _VELOCITY, _ACCELERATION = 0, 1, 2


@kernel
def trace(trail: Trail, scratch: Record, times: Floats, rows: Integers, out: Floats) -> None:
    """Write theta, theta', theta'' at times[k], in the step that starts at trail.nodes[rows[k]], into out[k].

    They are zero from the end of the last resolved arc to rest or the end of the response, and meaningless for NaN.
    """
    ground, block, settings, nodes = trail
    expanded = -1
    order = 0
    known, plastic = -1, 0.0  # for a tendon that yields
    landing = np.inf
    for k in range(times.shape[0]):
        row = rows[k]
        node = nodes[row]
        last = row + 1 == nodes.shape[0]
        closes = last or nodes[row + 1].side < 0  # the motion after its arc is not resolved
        if node.side < 0:
            out[k, _ROTATION] = out[k, _VELOCITY] = out[k, _ACCELERATION] = 0.0
            continue
        if row != expanded:
            if block.yielding:
                first, plastic = (known + 1, plastic) if row > known else (0, 0.0)
                for each in range(first, row + 1):
                    plastic = plastic_after(block, settings, nodes, each, plastic)
                known = row
                apply_tendon_law(block, node.law, plastic)
            left = np.inf if last else nodes[row + 1].time - node.time
            order, h, _ = expand(ground, block, settings, scratch, node, left)
            landing = np.inf
            if closes:
                lead = 0 if node.u > 0.0 else (1 if node.v > 0.0 else 2)
                landing = first_root(scratch.rotation, lead, order, h)
                if math.isnan(landing):
                    landing = h
            expanded = row
        elapsed = max(0.0, times[k] - start_of(ground, node.piece) - node.offset)
        u, v, w = evaluate(scratch.rotation, order, elapsed)
        if elapsed > landing or (closes and u < 0.0):
            u = v = w = 0.0
        sign = sign_of(node.side)
        out[k, _ROTATION] = sign * u
        out[k, _VELOCITY] = sign * v
        out[k, _ACCELERATION] = sign * w


# ---- Derivatives of a response with respect to its input ----


class Quantity(IntEnum):
    """Quantity that varies: the motion; the initial rotation or velocity; p, slenderness or restitution of both sides.

    The last three follow for side + and side - alone, then NOTHING.
    """

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
_JUMP = 1e-9


@kernel
def vary(
    trail: Trail,
    scratch: Record,
    work: Record,
    quantity: int,
    times: Floats,
    changes: Floats,
    impacts: Floats,
    events: Floats,
) -> None:
    """Write changes of u at given times, and shifts of all impacts and events, per unit of epsilon, into arrays.

    ``times`` ascend; at an impact, the change before it is written. ``work`` is scratch space (`state.VARIATION`).
    """
    nodes = trail.nodes
    impact_count = event_count = 0
    du = nodes[0].u if quantity == Quantity.ROTATION else 0.0
    dv = nodes[0].v if quantity == Quantity.VELOCITY else 0.0
    plastic, dp = 0.0, plastic_by_start(trail) * du  # plastic elongation of a tendon, and its variation
    done = count_until(times, 0, nodes[0].time)
    changes[:done] = du
    changes[done:] = 0.0
    for k in range(nodes.shape[0]):
        node = nodes[k]
        if trail.block.yielding:
            plastic = plastic_after(trail.block, trail.settings, nodes, k, plastic)
            apply_tendon_law(trail.block, node.law, plastic)
        if k + 1 == nodes.shape[0]:
            if node.side >= 0 and event_count < events.shape[0]:
                events[event_count] = -du / node.v
            break
        following = nodes[k + 1]
        first, done = done, count_until(times, done, following.time)
        if node.side < 0:
            by_tendon = restoring_by_tendon(trail.block, following.side, plastic, dp)
            landing = events[event_count - 1] if event_count > 0 else 0.0
            du = 0.0
            events[event_count], dv = leaving(trail, node, following, quantity, by_tendon, landing)
            event_count += 1
        elif following.side < 0:
            shift = impacts[impact_count - 1] if impact_count > 0 else 0.0
            events[event_count] = rest_shift(trail, node, quantity, (dv, shift, plastic, dp), following)
            event_count += 1
            if done > first:
                order = expand_variation(trail, scratch, work, node, quantity, (du, dv, dp), following.time - node.time)
                note_changes(trail, scratch, work, node, order, times[first:done], changes[first:done], True)
        else:
            order = expand_variation(trail, scratch, work, node, quantity, (du, dv, dp), following.time - node.time)
            note_changes(trail, scratch, work, node, order, times[first:done], changes[first:done], False)
            t = elapsed(trail, node, following)
            du, dv, _ = evaluate(work.change, order, t)
            if node.law == TendonLaw.PLASTIC and following.law != node.law:
                dp = elongation_rate(trail, node.side, following.u) * du
            if is_impact(nodes, k):
                _, speed, _ = evaluate(scratch.rotation, order, t)
                shift = du / -speed
                away = -1.0 if trail.block.two_stops and following.side != node.side else 1.0  # the other stop
                rates = away * dv, -away * speed
                du, dv = saltation(trail, node, following, quantity, shift, rates, impact_count)
                impacts[impact_count] = shift
                impact_count += 1


@inlined
def leaving(
    trail: Trail, node: Record, following: Record, quantity: int, by_tendon: float, landing: float
) -> tuple[float, float]:
    """Return shift and velocity variation of an uplift after a rest whose start shifts by ``landing``."""
    if following.time > node.time or node.time == trail.nodes[0].time:
        return uplift_shift(trail, following, quantity, by_tendon), 0.0
    # The ground ends the rest immediately: the arc starts at the same time.
    return landing, landing * restoring(trail.ground, trail.block, following.side, following.piece, following.offset)


@inlined
def count_until(times: Floats, count: int, last: float) -> int:
    """Count the times up to ``last``, starting from a known ``count``."""
    while count < times.shape[0] and times[count] <= last:
        count += 1
    return count


@shared
def note_changes(
    trail: Trail, scratch: Record, work: Record, node: Record, order: int, times: Floats, changes: Floats, lands: bool
) -> None:
    """Write changes of u along the arc from a node, whose series are in scratch, until it lands."""
    for n in range(times.shape[0]):
        t = times[n] - start_of(trail.ground, node.piece) - node.offset
        u, _, _ = evaluate(scratch.rotation, order, t)
        if u > 0.0 or not lands:
            changes[n], _, _ = evaluate(work.change, order, t)


@inlined
def on_side(quantity: int, side: int) -> int:
    """Return the part of a quantity on a side: itself, its counterpart for both sides, or NOTHING."""
    if quantity <= Quantity.RESTITUTION:
        return quantity
    own = quantity - Quantity.FREQUENCY_PLUS - 3 * side
    return Quantity.FREQUENCY + own if 0 <= own < 3 else Quantity.NOTHING


@inlined
def elongation_rate(trail: Trail, side: int, u: float) -> float:
    """Compute the elongation of a tendon per rotation."""
    return trail.block.lever_arm[side] * (math.cos(0.5 * u) if trail.settings.nonlinear else 1.0)


@inlined
def plastic_by_start(trail: Trail) -> float:
    """Return the plastic elongation per rotation at the start of a response: 0 unless the tendon yields there."""
    node = trail.nodes[0]
    if not trail.block.yielding or plastic_after(trail.block, trail.settings, trail.nodes, 0, 0.0) <= 0.0:
        return 0.0
    return elongation_rate(trail, node.side, node.u)


@inlined
def is_impact(nodes: Records, k: int) -> bool:
    """Return whether the step from the k-th node ends in an impact, and not in a contact without speed."""
    node, following = nodes[k], nodes[k + 1]
    if node.side < 0 or following.side < 0 or following.u != 0.0:
        return False
    rests = k + 2 < nodes.shape[0] and nodes[k + 2].side < 0  # immediately, if no speed is left
    return bool(following.side != node.side or following.v > 0.0 or rests)


@inlined
def elapsed(trail: Trail, node: Record, following: Record) -> float:
    """Compute the length of a step without the rounding of absolute times."""
    if following.piece == node.piece:
        return following.offset - node.offset
    if following.piece == node.piece + 1:
        return length_of(trail.ground, node.piece) - node.offset + following.offset
    return following.time - node.time


@shared
def expand_variation(
    trail: Trail, scratch: Record, work: Record, node: Record, quantity: int, start: Three, left: float
) -> int:
    """Write the series of the variation along the arc from a node into ``work.change``, and return its order.

    ``start``: variations of rotation, velocity and a tendon's plastic elongation.
    """
    order, _, degree = expand(trail.ground, trail.block, trail.settings, scratch, node, left)
    expand_coefficients(trail, scratch, work, node.side, degree, order)
    here = on_side(quantity, node.side)
    if here == Quantity.FREQUENCY:
        for k in range(order - 1):
            work.forcing[k] = 2.0 * scratch.rotation[k + 2] / INTEGRATED_TWICE[k]
    elif here == Quantity.SLENDERNESS:
        for k in range(order - 1):
            work.forcing[k] = -trail.block.slenderness[node.side] * work.stiffness[k]
    elif here != Quantity.MOTION:
        for k in range(order - 1):
            work.forcing[k] = 0.0
    work.change[0], work.change[1], plastic = start
    if plastic != 0.0 and node.law == TendonLaw.ELASTIC:
        change = trail.block.tendon[node.side] * plastic
        for k in range(order - 1):
            work.forcing[k] += change * (
                scratch.half_cosine[k] if trail.settings.nonlinear else (1.0 if k == 0 else 0.0)
            )
    add_restraints(trail, scratch, work, node.side, order)
    variation_coefficients(work, trail.block.damping[node.side], order)
    return order


@inlined
def expand_coefficients(trail: Trail, scratch: Record, work: Record, side: int, degree: int, order: int) -> None:
    """Write the series of d u''/d u without `add_restraints`, and of u'' per unit change of the motion, to ``work``.

    This removes the contribution of restraints from the motion in scratch.
    """
    lam, gain, threshold = trail.block.stiffness[side], trail.block.threshold_slope[side], trail.block.threshold[side]
    A, W, S, C = scratch.ground, scratch.weight, scratch.sine, scratch.cosine
    changes = degree if has_vertical(trail.ground) else 0
    for k in range(order - 1):
        if trail.settings.nonlinear:
            stiffness = 0.0
            for j in range(min(k, changes) + 1):
                stiffness += W[j] * C[k - j]
            for j in range(min(k, degree) + 1):
                stiffness -= A[j] * S[k - j]
            work.stiffness[k] = lam * stiffness
        else:
            work.stiffness[k] = lam * W[k] if k <= changes else 0.0
    W[0] -= trail.block.added_weight[side]
    A[0] -= trail.block.added_push[side]
    for k in range(order - 1):
        if trail.settings.nonlinear:
            forcing = -S[k]
            for j in range(min(k, changes) + 1):
                forcing += W[j] * S[k - j]
            for j in range(min(k, degree) + 1):
                forcing += A[j] * C[k - j]
            work.forcing[k] = -lam * forcing
        else:
            forcing = gain * (A[k] + threshold * added_weight(W, k, changes)) if k <= degree else 0.0
            for j in range(min(k, changes) + 1):
                forcing -= lam * added_weight(W, j, changes) * scratch.rotation[k - j]
            work.forcing[k] = -forcing


@inlined
def add_restraints(trail: Trail, scratch: Record, work: Record, side: int, order: int) -> None:
    """Add the contribution of prestress and springs to d u''/d u, after `expand_coefficients`."""
    work.stiffness[0] -= trail.block.spring[side]
    if trail.settings.nonlinear and trail.block.prestress[side] != 0.0:
        for k in range(order - 1):
            work.stiffness[k] += 0.5 * trail.block.prestress[side] * scratch.half_sine[k]


@inlined
def expand_free(trail: Trail, scratch: Record, work: Record, side: int, degree: int, order: int) -> None:
    """Write the series of d u''/d u without forcing to ``work``."""
    expand_coefficients(trail, scratch, work, side, degree, order)
    for k in range(order - 1):
        work.forcing[k] = 0.0
    add_restraints(trail, scratch, work, side, order)


@inlined
def added_weight(W: Floats, k: int, changes: int) -> float:
    """Return a coefficient of the weight added by the motion."""
    if k > changes:
        return 0.0
    return W[0] - 1.0 if k == 0 else W[k]


@inlined
def saltation(
    trail: Trail, node: Record, following: Record, quantity: int, shift: float, rates: tuple[float, float], number: int
) -> tuple[float, float]:
    """Compute the variation after an impact that shifts; ``rates``: velocity variation before it, and impact speed.

    ``number`` of impacts came before. A variable restitution varies as a whole.
    """
    block = trail.block
    dv, speed = rates
    hit = following.side if block.two_stops else node.side
    left = restoring(trail.ground, block, hit, following.piece, following.offset) - block.damping[hit] * speed
    e = factor(block, hit, speed, number)
    entered = restoring(trail.ground, block, following.side, following.piece, following.offset)
    entered += block.damping[following.side] * (e * speed)
    faster = -(dv - left * shift) * relative_slope(block, hit, speed, e)
    faster += speed if on_side(quantity, hit) == Quantity.RESTITUTION else 0.0
    return -following.v * shift, e * faster + entered * shift


@inlined
def uplift_shift(trail: Trail, node: Record, quantity: int, by_tendon: float) -> float:
    """Compute the shift of the uplift of a node; ``by_tendon``: see `restoring_by_tendon`."""
    ground, block, settings, _ = trail
    threshold = block.threshold[node.side]
    push = -push_at(ground, block, node.side, node.piece, node.offset)
    rate = -push_rate(ground, block, node.side, node.piece, node.offset)
    if is_jump(trail, node):
        return 0.0
    slackening = by_tendon / (block.threshold_slope[node.side] * rate)
    if quantity == Quantity.MOTION:
        return -push / rate + slackening
    if on_side(quantity, node.side) == Quantity.SLENDERNESS:
        growth = weight_at(ground, node.piece, node.offset) + block.added_weight[node.side]
        if settings.nonlinear:
            growth *= 1.0 + threshold * threshold
            growth += block.prestress[node.side] * threshold / block.threshold_slope[node.side]
        return block.slenderness[node.side] * growth / rate + slackening
    return slackening


@inlined
def is_jump(trail: Trail, node: Record) -> bool:
    """Return whether the motion jumps past the threshold at the uplift of a node."""
    threshold, hold = trail.block.threshold[node.side], trail.block.restraint_threshold[node.side]
    push = -push_at(trail.ground, trail.block, node.side, node.piece, node.offset)
    return bool(abs(push - threshold - hold) > _JUMP * (abs(threshold) + abs(hold)))


@inlined
def restoring_by_tendon(block: Record, side: int, plastic: float, change: float) -> float:
    """Compute the effect of a change of plastic elongation on the restoring acceleration at zero rotation."""
    if not block.yielding or law_of_standing(block, plastic) == TendonLaw.SLACK:
        return 0.0
    return -block.tendon[side] * change


@inlined
def push_at(ground: Ground, block: Record, side: int, piece: int, offset: float) -> float:
    """Compute the acceleration towards a side plus the weight's contribution to its threshold."""
    added = weight_at(ground, piece, offset) - 1.0
    return sign_of(side) * acceleration(ground, piece, offset) + block.threshold[side] * added


@inlined
def push_rate(ground: Ground, block: Record, side: int, piece: int, offset: float) -> float:
    """Compute the rate of `push_at`."""
    vertical = slope(vertical_of(ground), piece, offset) if has_vertical(ground) else 0.0
    return sign_of(side) * slope(ground, piece, offset) + block.threshold[side] * vertical


@inlined
def rest_shift(
    trail: Trail, node: Record, quantity: int, changes: tuple[float, float, float, float], rest: Record
) -> float:
    """Compute the shift of the rest that follows an impact, to first order in the speed (the paper's Eq. 75).

    ``changes``: velocity variation after the node's impact at the unchanged time, shift of that impact, plastic
    elongation of a tendon and its variation. The time to rest is T = 2 v (1/g_i + e_i/g_j)/(1 - e_i e_j), with v and g
    at the impact.
    """
    dv, shift, plastic, dp = changes
    if rest.time == node.time:
        return shift
    block, i = trail.block, node.side
    j = block.next_side[i]
    g_i = restoring(trail.ground, block, i, node.piece, node.offset)
    g_j = restoring(trail.ground, block, j, node.piece, node.offset)
    dg_i = restoring_shift(trail, node, i, quantity, shift) + restoring_by_tendon(block, i, plastic, dp)
    dg_j = restoring_shift(trail, node, j, quantity, shift) + restoring_by_tendon(block, j, plastic, dp)
    e_i, e_j = middle_factor(block, i, node.v), middle_factor(block, j, node.v)
    de_i = 1.0 if on_side(quantity, i) == Quantity.RESTITUTION else 0.0
    de_j = 1.0 if on_side(quantity, j) == Quantity.RESTITUTION else 0.0
    per_speed = 2.0 * (1.0 / g_i + e_i / g_j)
    change = -2.0 * (dg_i / (g_i * g_i) + e_i * dg_j / (g_j * g_j) - de_i * e_i / g_j)
    change += per_speed * (de_i + de_j) * e_i * e_j / (1.0 - e_i * e_j)
    return shift + (per_speed * (dv - g_i * shift) + change * node.v) / (1.0 - e_i * e_j)


@inlined
def restoring_shift(trail: Trail, node: Record, j: int, quantity: int, shift: float) -> float:
    """Compute the change of a restoring acceleration at an impact that shifts."""
    ground, block, settings, _ = trail
    here = acceleration(ground, node.piece, node.offset)
    change = block.threshold_slope[j] * shift * push_rate(ground, block, j, node.piece, node.offset)
    if quantity == Quantity.MOTION:
        change += block.threshold_slope[j] * push_at(ground, block, j, node.piece, node.offset)
    elif on_side(quantity, j) == Quantity.FREQUENCY:
        change += 2.0 * restoring(ground, block, j, node.piece, node.offset)
    elif on_side(quantity, j) == Quantity.SLENDERNESS:
        slope_of_angle = weight_at(ground, node.piece, node.offset) + block.added_weight[j]
        if settings.nonlinear:
            slope_of_angle = (
                block.cosine[j] * slope_of_angle - (sign_of(j) * here + block.added_push[j]) * block.sine[j]
            )
        change += block.stiffness[j] * slope_of_angle * block.slenderness[j]
    return change
