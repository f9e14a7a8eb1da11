"""Time stepping: schemes of a fixed step that locate no impact, to compare with.

Both follow u >= 0, the coordinate in the frame of the side: a unilateral constraint with Newton's restitution. What a
block adds is another equation of motion after each impact, since the side changes. A scheme does so at the step in
which the contact pushes. A body at rest is in contact at every step; a block that rests so changes its side from step
to step, and leaves to the first side on which the contact need not push: a step late at most. Of two stops that face
each other u is the distance from the first, and the constraint of the other holds beside it.
"""

import math

from rocking.arrays import Floats
from rocking.kernels.arc import sign_of, weight_at
from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.ground import Ground, acceleration, length_of, start_of
from rocking.kernels.state import Record

#: Newton's steps for the velocity at the end of a step, which the linear model knows after one.
_NEWTON_STEPS = 12

#: Change of a velocity by rounding, relative to it.
_ROUNDING = 2.0**-50

#: Largest number of steps in contact that an impact takes by Schatzman and Paoli's scheme.
_IMPACT_STEPS = 3

#: Columns of what a scheme writes: sign of the side; u, its velocity, and what the contact adds to that in the step.
SIDE, COORDINATE, VELOCITY, IMPULSE = 0, 1, 2, 3

#: Their number.
COLUMNS = 4


@kernel
def moreau_jean(
    ground: Ground, block: Record, rules: Record, state: Record, theta: float, ahead: float, h: float, out: Floats
) -> int:
    """Moreau and Jean's scheme: the constraint holds for the velocity at the end of a step, where the contact is near.

    It is where u_k + ahead h v_k <= 0. Row k of ``out`` is for the time k h; returns how many are written, fewer than
    there are if the body overturns.
    """
    side, u, v = start_of_steps(block, state)
    piece = 0
    write_step(out, 0, side, (u, v, 0.0))
    for k in range(1, out.shape[0]):
        before, time = (k - 1) * h, k * h
        force, _ = acceleration_of(ground, block, rules, side, piece, before, u)
        force -= block.damping[side] * v
        piece = piece_at(ground, piece, time)
        free = v + h * force
        for _ in range(_NEWTON_STEPS if theta > 0.0 else 0):
            ahead_u = u + h * (theta * free + (1.0 - theta) * v)
            end_force, slope = acceleration_of(ground, block, rules, side, piece, time, ahead_u)
            end_force -= block.damping[side] * free
            excess = free - v - h * (theta * end_force + (1.0 - theta) * force)
            change = excess / (1.0 + h * theta * (block.damping[side] - h * theta * slope))
            free -= change
            if not rules.nonlinear or abs(change) <= _ROUNDING * abs(free):
                break
        end = free
        if u + ahead * h * v <= 0.0:
            end = max(free, -block.restitution[side] * v)
        elif block.facing and u + ahead * h * v >= block.fallen:
            end = min(free, -block.restitution[1] * v)
        u += h * (theta * end + (1.0 - theta) * v)
        v = end
        if end > free:
            side = block.entered[side]
        write_step(out, k, side, (u, v, abs(end - free)))
        if u >= block.fallen and not block.facing:
            return k + 1
    return out.shape[0]


@kernel
def schatzman_paoli(ground: Ground, block: Record, rules: Record, state: Record, h: float, out: Floats) -> int:
    """Schatzman and Paoli's scheme: central differences, and u_{k+1} + e u_{k-1} >= 0; rows as of `moreau_jean`.

    An impact takes two steps in contact or three, of which the first changes the side; in contact for longer, every
    third does. All of them have the restitution of the side that was hit. The velocity is the difference from the step
    before.
    """
    side, u, v = start_of_steps(block, state)
    before, piece, in_contact, restitution = u, 0, 0, 0.0
    write_step(out, 0, side, (u, v, 0.0))
    for k in range(1, out.shape[0]):
        time = (k - 1) * h
        piece = piece_at(ground, piece, time)
        force, _ = acceleration_of(ground, block, rules, side, piece, time, u)
        if in_contact % _IMPACT_STEPS == 0:
            restitution = block.restitution[side]
        if k == 1:
            free, least = u + h * (v + 0.5 * h * (force - block.damping[side] * v)), 0.0
        else:
            drag = 0.5 * h * block.damping[side]  # by the central difference
            free = u + ((1.0 - drag) * (u - before) + h * h * force) / (1.0 + drag)
            least = -restitution * before
        end = max(free, least)
        if block.facing:
            gap = block.fallen - before
            end = min(end, block.fallen + (block.restitution[1] * gap if k > 1 else 0.0))
        before, u = u, end
        if end > free and in_contact % _IMPACT_STEPS == 0:
            side = block.entered[side]
        in_contact = in_contact + 1 if end > free else 0
        write_step(out, k, side, (u, (u - before) / h, abs(end - free) / h))
        if u >= block.fallen and not block.facing:
            return k + 1
    return out.shape[0]


@inlined
def start_of_steps(block: Record, state: Record) -> tuple[int, float, float]:
    """Side, u and its velocity at the start; of two stops the first one's."""
    if not block.facing:
        return max(state.side, 0), state.u, state.v
    at_other = state.side == 1 or state.side == -2
    return 0, block.fallen - state.u if at_other else state.u, -state.v if at_other else state.v


@inlined
def piece_at(ground: Ground, piece: int, time: float) -> int:
    """Piece of the motion at a time, not before the given one."""
    while time - start_of(ground, piece) >= length_of(ground, piece):
        piece += 1
    return piece


@inlined
def acceleration_of(
    ground: Ground, block: Record, rules: Record, side: int, piece: int, time: float, u: float
) -> tuple[float, float]:
    """Acceleration of u off the ground but for damping, and its derivative by u."""
    offset = time - start_of(ground, piece)
    push, weight = sign_of(side) * acceleration(ground, piece, offset), weight_at(ground, piece, offset)
    weight, push = weight + block.added_weight[side], push + block.added_push[side]
    stiffness, spring, prestress = block.stiffness[side], block.spring[side], block.prestress[side]
    if rules.nonlinear:
        sine, cosine = math.sin(block.slenderness[side] - u), math.cos(block.slenderness[side] - u)
        force = -stiffness * (weight * sine + push * cosine) - prestress * math.cos(0.5 * u) - spring * u
        return force, stiffness * (weight * cosine - push * sine) + 0.5 * prestress * math.sin(0.5 * u) - spring
    slope = stiffness * weight - spring
    return slope * u - block.gain[side] * (block.threshold[side] * weight + push) - prestress, slope


@inlined
def write_step(out: Floats, k: int, side: int, step: tuple[float, float, float]) -> None:
    """Write the end of a step into a row."""
    u, v, impulse = step
    out[k, SIDE] = sign_of(side)
    out[k, COORDINATE] = u
    out[k, VELOCITY] = v
    out[k, IMPULSE] = impulse
