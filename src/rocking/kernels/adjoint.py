"""How one number of a response changes with every coefficient of its motion: one pass back along the nodes.

`trace.vary` carries one change of the input forwards, to all numbers of a response; this carries the change of one
number with the state, (l, m) with d number = l du + m dv, backwards to all inputs. Along an arc with
du'' = k(t) du - c du' + f(t), m'' = k(t) m + c m' and l = c m - m', and a forcing f adds the integral of m f. Through
an impact the transposed saltation takes it.
"""

from enum import IntEnum

from rocking.arrays import Floats
from rocking.kernels.arc import evaluate, expand, sign_of
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.ground import has_vertical
from rocking.kernels.recurrences import variation_coefficients
from rocking.kernels.state import Record, Records
from rocking.kernels.trace import Quantity, Trail, add_restraints, elapsed, expand_coefficients, saltation


class Ends(IntEnum):
    """Where a pass back ends: at the start of the response, at a rest, or where there is no derivative."""

    START = 0
    REST = 1
    #: The body touches the ground without speed.
    GRAZES = 2
    #: The body leaves the ground at the instant at which it comes to rest.
    LEAVES_AT_ONCE = 3


@kernel
def adjoint(trail: Trail, scratch: Record, work: Record, row: int, time: float, change: Floats, out: Floats) -> int:
    """Take ``change``, of a number with u and v, from ``time`` after the node of a row back; returns the `Ends`.

    In ``change`` stays that with u and v at the start of the response, 0 where the body has come to rest. To row k of
    ``out`` is added the change with the coefficients of piece k, in units of g, horizontal ones first. ``work`` is
    scratch space (`state.VARIATION`). Tendons that yield and stops that face each other are not known here.
    """
    nodes = trail.nodes
    number = impacts_up_to(nodes, row)
    for k in range(row, -1, -1):
        node = nodes[k]
        if node.side < 0:
            change[0] = change[1] = 0.0
            if k == 0:
                return Ends.START
            # Where the ground ends the rest at once, the time of landing is that of leaving.
            return Ends.LEAVES_AT_ONCE if nodes[k + 1].time == node.time else Ends.REST
        t = time
        if k < row:
            following = nodes[k + 1]
            t = elapsed(trail, node, following)
            if following.u == 0.0 and following.side == node.side and following.v <= 0.0 and t > 0.0:
                return Ends.GRAZES
        order, _, degree = expand(trail.ground, trail.block, trail.rules, scratch, node, t)
        if k < row and following.u == 0.0 and t > 0.0:
            _, v, _ = evaluate(scratch.rotation, order, t)
            if not v < 0.0:
                return Ends.GRAZES
            rate = 1.0 / v
            number -= 1
            by_u = saltation(trail, node, following, Quantity.ROTATION, -rate, (0.0, -v), number)
            by_v = saltation(trail, node, following, Quantity.ROTATION, 0.0, (1.0, -v), number)
            change[0], change[1] = (
                change[0] * by_u[0] + change[1] * by_u[1],
                change[0] * by_v[0] + change[1] * by_v[1],
            )
        if t > 0.0:
            back_through(trail, scratch, work, node, (order, degree), t, change, out)
    return Ends.START


@inlined
def impacts_up_to(nodes: Records, row: int) -> int:
    """Count the impacts up to the node of a row."""
    count = 0
    for k in range(row):
        node, following = nodes[k], nodes[k + 1]
        moves = node.side >= 0 and following.side >= 0 and following.u == 0.0
        count += moves and (following.side != node.side or following.v > 0.0)
    return count


@shared
def back_through(
    trail: Trail,
    scratch: Record,
    work: Record,
    node: Record,
    orders: tuple[int, int],
    t: float,
    change: Floats,
    out: Floats,
) -> None:
    """Take ``change`` back through a time t of the arc from a node, expanded to the order and of the degree given."""
    order, degree = orders
    x = work.change
    expand_coefficients(trail, scratch, work, node.side, degree, order)
    add_restraints(trail, scratch, work, node.side, order)
    for j in range(order - 1):
        work.forcing[j] = 0.0
    drag = trail.block.damping[node.side]
    x[0], x[1] = 1.0, 0.0
    variation_coefficients(work, drag, order)
    u_by_u, v_by_u, _ = evaluate(x, order, t)
    x[0], x[1] = 0.0, 1.0
    variation_coefficients(work, drag, order)
    u_by_v, v_by_v, _ = evaluate(x, order, t)
    change[0], change[1] = change[0] * u_by_u + change[1] * v_by_u, change[0] * u_by_v + change[1] * v_by_v
    x[0], x[1] = change[1], drag * change[1] - change[0]
    variation_coefficients(work, -drag, order)
    ground, block = trail.ground, trail.block
    lam, gain, threshold = block.stiffness[node.side], block.gain[node.side], block.threshold[node.side]
    m = work.forcing
    for k in range(order - 1):  # times d u'' / d A, of the horizontal motion in the frame of the side
        m[k] = -gain * x[k]
        if trail.rules.nonlinear:
            m[k] = 0.0
            for j in range(k + 1):
                m[k] -= lam * x[j] * scratch.cosine[k - j]
    add_moments(scratch.other, m, order, node.offset, t, sign_of(node.side), out[node.piece, : ground.columns])
    if has_vertical(ground):
        for k in range(order - 1):  # times d u'' / d W
            m[k] = 0.0 if trail.rules.nonlinear else -gain * threshold * x[k]
            for j in range(k + 1):
                m[k] += lam * x[j] * (-scratch.sine[k - j] if trail.rules.nonlinear else scratch.rotation[k - j])
        add_moments(scratch.other, m, order, node.offset, t, 1.0, out[node.piece, ground.columns :])


@inlined
def add_moments(moments: Floats, m: Floats, order: int, offset: float, t: float, sign: float, out: Floats) -> None:
    """Add to ``out[j]`` the integrals of m(s) (offset + s)^j, times ``sign``, over s from 0 to t."""
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
