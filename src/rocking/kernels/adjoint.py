"""Derivatives of one number of a response by all coefficients of its motion, in one backward pass.

Whereas `trace.compute_variation` propagates one change of the input forwards to all numbers of a response, this module
propagates the derivatives of one number by the state, d number = l du + m dv, backwards to all inputs. Along an arc
with du'' = k(t) du - c du' + f(t), m'' = k(t) m + c m' and l = c m - m', and a forcing f adds the integral of m f.
Through an impact, the transposed saltation applies. A tendon that yields adds its plastic elongation to the state,
which forces arcs with an elastic tendon and is written when the body turns back.
"""

import math
from enum import IntEnum

from rocking.core.arrays import Floats
from rocking.kernels.arc import compute_restoring, evaluate_series, expand_arc, side_sign
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.events import compute_mean_factor
from rocking.kernels.ground import ground_error, has_vertical, select_vertical, sum_absolute_terms
from rocking.kernels.restraints import apply_tendon_law, update_plastic_elongation
from rocking.kernels.series import write_variation_coefficients
from rocking.kernels.state import Struct, Structs, TendonLaw
from rocking.kernels.trace import (
    Quantity,
    Trail,
    compute_elongation_rate,
    compute_push_rate,
    compute_saltation,
    compute_step_duration,
    differentiate_start_plasticity,
    expand_unforced,
    is_impact,
    is_jump,
    vary_tendon_restoring,
)

#: Number of derivatives: by u, v and a plastic elongation.
_STATE_DERIVATIVES = 3

#: Rounding of a step, divided by its largest terms.
_STEP_ROUNDING = 2.0**-51


class AdjointEnd(IntEnum):
    """End of a backward pass."""

    START = 0
    REST = 1
    #: The body touches the ground without speed.
    GRAZES = 2
    #: The body leaves the ground at the instant of rest.
    LEAVES_AT_ONCE = 3
    #: The motion touches the threshold of a side without a rate.
    TOUCHES_THRESHOLD = 4
    #: Not ended.
    CONTINUES = 5


@kernel
def adjoint(
    trail: Trail, scratch: Struct, variation: Struct, row: int, time: float, adjoint: Floats, out: Floats
) -> int:
    """Propagate the derivatives of a number back to the start of the response; return the `AdjointEnd`.

    The derivatives are by u, v and plastic elongation at ``time`` after the node of a row; if infinite, at the end of
    its step, before an impact there. On return they refer to the start, and are 0 if the body has come to rest.
    Derivatives by the coefficients of piece k (units of g, horizontal first) are added to row k of ``out``, and
    ``variation`` is scratch space (`state.VARIATION_DTYPE`). For two more derivatives, see `add_rounding`.
    """
    block, nodes = trail.block, trail.nodes
    number = count_impacts(nodes, row)
    plastic_elongation = find_plastic_elongation(trail, row)
    for k in range(row, -1, -1):
        node = nodes[k]
        if node.side < 0 or (k < row and nodes[k + 1].side < 0):
            end = propagate_through_rest(nodes, k, adjoint)
            if end != AdjointEnd.CONTINUES:
                return end
            continue
        t = compute_step_duration(trail, node, nodes[k + 1]) if k < row or time == math.inf else time
        if block.yielding:
            if k < row and is_plastic_end(nodes, k + 1):
                adjoint[0] += compute_elongation_rate(trail, node.side, nodes[k + 1].u) * adjoint[2]
                adjoint[2] = 0.0
                plastic_elongation = find_plastic_elongation(trail, k)
            apply_tendon_law(block, node.tendon_law, plastic_elongation)
        order, _, degree = expand_arc(trail.ground, block, trail.settings, scratch, node, t)
        if k < row and nodes[k + 1].u == 0.0 and t > 0.0:
            number -= is_impact(nodes, k)
            _, v, _ = evaluate_series(scratch.rotation, order, t)
            if not propagate_through_impact(trail, k, v, number, adjoint):
                return AdjointEnd.GRAZES
        if t > 0.0:
            if adjoint.shape[0] > _STATE_DERIVATIVES:
                add_rounding(trail, scratch, k, order, t, adjoint)
            propagate_through_arc(trail, scratch, variation, node, (order, degree), t, adjoint, out)
    adjoint[0] += differentiate_start_plasticity(trail) * adjoint[2]
    return AdjointEnd.START


@inlined
def add_rounding(trail: Trail, scratch: Struct, k: int, order: int, t: float, adjoint: Floats) -> None:
    """Add a bound on the effect of rounding during a time t of the arc from the k-th node to ``adjoint[3]``.

    ``adjoint[4]`` becomes the largest relative rate of decrease of a speed just before its impact.
    """
    ground, block, node = trail.ground, trail.block, trail.nodes[k]
    side, end = node.side, node.offset + t
    u, v, w = evaluate_series(scratch.rotation, order, t)
    if trail.nodes[k + 1].u == 0.0:
        adjoint[4] = max(adjoint[4], -w / v)
    speed = max(abs(node.v), abs(v))
    height = max(node.u, u) + speed * t
    push = 0.5 * ground.coefficient_count * sum_absolute_terms(ground, node.piece, end)[0] + abs(block.added_push[side])
    weight = 1.0 + abs(block.added_weight[side])
    if has_vertical(ground):
        weight += 0.5 * ground.coefficient_count * sum_absolute_terms(select_vertical(ground), node.piece, end)[0]
    force = abs(block.threshold[side]) * weight + abs(block.restraint_threshold[side]) + push
    force *= block.restoring_gain[side]
    force += (abs(block.stiffness[side]) * (weight + push) + abs(block.spring[side])) * height
    force = _STEP_ROUNDING * (force + abs(block.prestress[side]) + block.damping[side] * speed)
    force += block.restoring_gain[side] * ground_error(ground)
    adjoint[3] += abs(adjoint[0]) * (0.5 * _STEP_ROUNDING * (height + speed * t) + 0.5 * force * t * t)
    adjoint[3] += abs(adjoint[1]) * (0.5 * _STEP_ROUNDING * speed + force * t)
    adjoint[3] += abs(adjoint[0] * v + adjoint[1] * w) * _STEP_ROUNDING * end


@inlined
def propagate_through_rest(nodes: Structs, k: int, adjoint: Floats) -> int:
    """Propagate ``adjoint`` back through a rest at the node or the one before; CONTINUES if a derivative remains.

    Impacts between the last resolved one and the rest have no effect.
    """
    if nodes[k].side >= 0:
        return AdjointEnd.CONTINUES
    is_nonzero = adjoint[0] != 0.0 or adjoint[1] != 0.0
    adjoint[0] = adjoint[1] = 0.0
    if k == 0:
        return AdjointEnd.START
    # If the ground ends the rest immediately, landing and leaving have the same time.
    if is_nonzero and nodes[k + 1].time == nodes[k].time:
        return AdjointEnd.LEAVES_AT_ONCE
    return AdjointEnd.REST if adjoint[2] == 0.0 else AdjointEnd.CONTINUES


@inlined
def propagate_through_impact(trail: Trail, k: int, v: float, number: int, adjoint: Floats) -> bool:
    """Propagate derivatives back through the impact after the k-th node, at velocity v; False if the body only touches.

    ``number`` is the number of earlier impacts.
    """
    if adjoint[0] == 0.0 and adjoint[1] == 0.0:
        return True
    node, next_node = trail.nodes[k], trail.nodes[k + 1]
    sign = -1.0 if trail.block.two_stops and next_node.side != node.side else 1.0  # the other stop
    if not (is_impact(trail.nodes, k) and sign * v < 0.0):
        return False
    by_u = compute_saltation(trail, node, next_node, Quantity.ROTATION, -1.0 / v, (0.0, -sign * v), number)
    by_v = compute_saltation(trail, node, next_node, Quantity.ROTATION, 0.0, (sign, -sign * v), number)
    adjoint[0], adjoint[1] = adjoint[0] * by_u[0] + adjoint[1] * by_u[1], adjoint[0] * by_v[0] + adjoint[1] * by_v[1]
    return True


@kernel
def differentiate_step_end(trail: Trail, scratch: Struct, row: int, adjoint: Floats, out: Floats) -> int:
    """Write the derivative of the time at which the step of a row ends by the state before it; return the `AdjointEnd`.

    That state is at the end of the step, before an impact or an overturning, otherwise at its node. For an uplift or
    rest, derivatives by the motion at that instant are added to ``out``, as in `propagate_adjoint`.
    """
    block, nodes = trail.block, trail.nodes
    node, next_node = nodes[row], nodes[row + 1]
    plastic_elongation = find_plastic_elongation(trail, row)
    if block.yielding:
        apply_tendon_law(block, node.tendon_law, plastic_elongation)
    if node.side < 0:
        side, rate = (
            next_node.side,
            -compute_push_rate(trail.ground, block, next_node.side, next_node.piece, next_node.offset),
        )
        if row > 0 and next_node.time == node.time:
            return AdjointEnd.LEAVES_AT_ONCE
        if is_jump(trail, next_node):
            return AdjointEnd.START
        if not rate > 0.0:
            return AdjointEnd.TOUCHES_THRESHOLD
        adjoint[2] = vary_tendon_restoring(block, side, plastic_elongation, 1.0) / (block.restoring_gain[side] * rate)
        add_instant(trail, next_node, (side_sign(side) / rate, block.threshold[side] / rate), out)
    elif next_node.side < 0:
        differentiate_rest_time(trail, node, plastic_elongation, adjoint, out)
    else:
        t = compute_step_duration(trail, node, next_node)
        order, _, _ = expand_arc(trail.ground, block, trail.settings, scratch, node, t)
        _, v, _ = evaluate_series(scratch.rotation, order, t)
        if v == 0.0:
            return AdjointEnd.GRAZES
        adjoint[0] = -1.0 / v
    return AdjointEnd.START


@inlined
def differentiate_rest_time(
    trail: Trail, node: Struct, plastic_elongation: float, adjoint: Floats, out: Floats
) -> None:
    """Write the derivatives of the time of rest after the impact of a node (see `trace.compute_rest_shift`)."""
    block, i = trail.block, node.side
    j = block.next_side[i]
    g_i = compute_restoring(trail.ground, block, i, node.piece, node.offset)
    g_j = compute_restoring(trail.ground, block, j, node.piece, node.offset)
    e_i, e_j = compute_mean_factor(block, i, node.v), compute_mean_factor(block, j, node.v)
    scale = 2.0 / (1.0 - e_i * e_j)
    by_speed = scale * (1.0 / g_i + e_i / g_j)
    by_g_i, by_g_j = -scale * node.v / (g_i * g_i), -scale * node.v * e_i / (g_j * g_j)
    by_time = 1.0 - by_speed * g_i  # by the shift of the impact
    by_time += by_g_i * block.restoring_gain[i] * compute_push_rate(trail.ground, block, i, node.piece, node.offset)
    by_time += by_g_j * block.restoring_gain[j] * compute_push_rate(trail.ground, block, j, node.piece, node.offset)
    adjoint[0], adjoint[1] = -by_time / node.v, by_speed
    adjoint[2] = by_g_i * vary_tendon_restoring(block, i, plastic_elongation, 1.0)
    adjoint[2] += by_g_j * vary_tendon_restoring(block, j, plastic_elongation, 1.0)
    by_i, by_j = by_g_i * block.restoring_gain[i], by_g_j * block.restoring_gain[j]
    push = by_i * side_sign(i) + by_j * side_sign(j)
    add_instant(trail, node, (push, by_i * block.threshold[i] + by_j * block.threshold[j]), out)


@inlined
def add_instant(trail: Trail, node: Struct, adjoint: tuple[float, float], out: Floats) -> None:
    """Add the derivatives by the coefficients of a node's piece from ``adjoint`` by push and weight at the node."""
    columns = trail.ground.coefficient_count
    push, weight = adjoint
    for j in range(columns):
        out[node.piece, j] += push
        if has_vertical(trail.ground):
            out[node.piece, columns + j] += weight
        push *= node.offset
        weight *= node.offset


@inlined
def is_plastic_end(nodes: Structs, row: int) -> bool:
    """Return whether the body turns back at a node, where the plastic elongation is written."""
    return bool(nodes[row - 1].tendon_law == TendonLaw.PLASTIC and nodes[row].tendon_law == TendonLaw.ELASTIC)


@inlined
def find_plastic_elongation(trail: Trail, row: int) -> float:
    """Return the plastic elongation at a node; 0 if no tendon yields."""
    if not trail.block.yielding:
        return 0.0
    while row > 0 and not is_plastic_end(trail.nodes, row):
        row -= 1
    return update_plastic_elongation(trail.block, trail.settings, trail.nodes, row, 0.0)


@inlined
def count_impacts(nodes: Structs, row: int) -> int:
    """Count the impacts up to the node of a row."""
    count = 0
    for k in range(row):
        count += is_impact(nodes, k)
    return count


@not_inlined
def propagate_through_arc(
    trail: Trail,
    scratch: Struct,
    variation: Struct,
    node: Struct,
    orders: tuple[int, int],
    t: float,
    adjoint: Floats,
    out: Floats,
) -> None:
    """Propagate ``adjoint`` back through a time t of the arc from a node, for the given order and degree."""
    order, degree = orders
    x = variation.rotation
    expand_unforced(trail, scratch, variation, node.side, degree, order)
    drag = trail.block.damping[node.side]
    x[0], x[1] = 1.0, 0.0
    write_variation_coefficients(variation, drag, order)
    u_by_u, v_by_u, _ = evaluate_series(x, order, t)
    x[0], x[1] = 0.0, 1.0
    write_variation_coefficients(variation, drag, order)
    u_by_v, v_by_v, _ = evaluate_series(x, order, t)
    adjoint[0], adjoint[1] = adjoint[0] * u_by_u + adjoint[1] * v_by_u, adjoint[0] * u_by_v + adjoint[1] * v_by_v
    ground, block = trail.ground, trail.block
    if adjoint.shape[0] > _STATE_DERIVATIVES and not block.yielding:  # only the rounding is required
        return
    x[0], x[1] = adjoint[1], drag * adjoint[1] - adjoint[0]
    write_variation_coefficients(variation, -drag, order)
    lam, gain, threshold = block.stiffness[node.side], block.restoring_gain[node.side], block.threshold[node.side]
    m = variation.forcing
    for k in range(order - 1):  # times d u'' / d A, for the horizontal motion in the frame of the side
        m[k] = -gain * x[k]
        if trail.settings.nonlinear:
            m[k] = 0.0
            for j in range(k + 1):
                m[k] -= lam * x[j] * scratch.cosine[k - j]
    row = out[node.piece, : ground.coefficient_count]
    add_moments(scratch.auxiliary, m, order, node.offset, t, side_sign(node.side), row)
    if has_vertical(ground):
        for k in range(order - 1):  # times d u'' / d W
            m[k] = 0.0 if trail.settings.nonlinear else -gain * threshold * x[k]
            for j in range(k + 1):
                m[k] += lam * x[j] * (-scratch.sine[k - j] if trail.settings.nonlinear else scratch.rotation[k - j])
        add_moments(scratch.auxiliary, m, order, node.offset, t, 1.0, out[node.piece, ground.coefficient_count :])
    if block.yielding and node.tendon_law == TendonLaw.ELASTIC:
        write_plastic_series(trail, scratch, node.side, x, order, m)
        add_moments(scratch.auxiliary, m, order, 0.0, t, 1.0, adjoint[2:_STATE_DERIVATIVES])


@inlined
def write_plastic_series(trail: Trail, scratch: Struct, side: int, x: Floats, order: int, m: Floats) -> None:
    """Write x times d u'' / d plastic into m."""
    stiffness = trail.block.tendon_stiffness[side]
    for k in range(order - 1):
        m[k] = 0.0 if trail.settings.nonlinear else stiffness * x[k]
        for j in range(k + 1 if trail.settings.nonlinear else 0):
            m[k] += stiffness * x[j] * scratch.half_cosine[k - j]


@inlined
def add_moments(moments: Floats, m: Floats, order: int, offset: float, t: float, sign: float, out: Floats) -> None:
    """Add the integrals of m(s) (offset + s)^j over s from 0 to t, times ``sign``, to ``out[j]``."""
    count = out.shape[0]
    for i in range(count):
        value = 0.0
        for k in range(order - 2, -1, -1):
            value = value * t + m[k] / (k + i + 1)
        power = t
        for _ in range(i):
            power *= t
        moments[i] = value * power
    for j in range(count):
        out[j] += sign * moments[0]
        for i in range(count - 1 - j):
            moments[i] = moments[i + 1] + offset * moments[i]
