"""Impacts of a sequence that is proven to end at rest: one after the other, with nothing to decide between them."""

import math

from rocking.kernels.arc import restoring, sign_of
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import Ground, coefficient, start_of
from rocking.kernels.remaining import THIRD, Pair
from rocking.kernels.state import Record, Records
from rocking.kernels.tables import PROVEN_A_TURN, write_impact, write_node

#: Largest |beta| and |gamma| of `proven_arc`: what its sums leave out is below 2^-54 of them.
LARGEST_BETA = 1.0 / 64.0
LARGEST_GAMMA = 2.0**-14


@shared
def pass_proven_impacts(
    ground: Ground, block: Record, rules: Record, table: Records, state: Record, left: float
) -> None:
    """Take the linear model through some impacts within ``left``, up to the one that is worth another proof.

    Under a ground acceleration that changes evenly; the state is one just after an impact.
    """
    rate = coefficient(ground, state.piece, 1)
    end = state.offset + left
    for _ in range(PROVEN_A_TURN):
        side, v = state.side, state.v
        g = restoring(ground, block, side, state.piece, state.offset)
        t, speed = proven_arc(v, g, block.gain[side] * sign_of(side) * rate, block.stiffness[side])
        slower = block.restitution[side] * speed
        # The arc lies below its first tangent.
        if not (t < end - state.offset and slower > state.worth and v * t <= state.peak):
            return
        state.side = block.entered[side]
        state.v = slower
        state.offset += t
        state.struck = start_of(ground, state.piece) + state.offset
        state.impacts += 1
        state.run += 1
        state.budget -= 1
        write_impact(rules, table, state, state.struck, speed)
        write_node(ground, rules, table, state)


@inlined
def proven_arc(v: float, g: float, rate: float, stiffness: float) -> Pair:
    """Duration and impact speed of an arc under g + rate t - stiffness u that starts with speed v.

    To full precision for |beta| = |rate| v/g^2 and |gamma| = |stiffness| v^2/g^2 up to the limits above, NaN beyond.
    Half the duration is (v/g) x with x + b x^2 = 1, b = 2 beta/3, and a correction for gamma. The sum for x, with
    Catalan's numbers, converges for |b| < 1/4; all sums stop where what is left is below rounding.
    """
    if not g > 0.0:
        return math.nan, math.nan
    inverse = 1.0 / g
    pace = v * inverse
    beta, gamma = rate * pace * inverse, stiffness * pace * pace
    if not (abs(beta) <= LARGEST_BETA and abs(gamma) <= LARGEST_GAMMA):
        return math.nan, math.nan
    x = half_duration(2.0 * THIRD * beta)
    tilt = beta * x
    q = gamma * x * x
    # The equation's value, slope and half its second derivative at x.
    bent = q * (q * (2.0 / 15.0 - q * (17.0 / 315.0)) - THIRD)
    value = x * ((1.0 + tilt) * bent + tilt * q * (1.0 / 45.0 - q * (2.0 / 945.0)))
    bending = 2.0 * q * (1.0 + tilt) * (q * (4.0 / 15.0) - THIRD)
    slope = 1.0 + (4.0 / 3.0) * tilt + (1.0 + 2.0 * tilt) * bent + bending + (4.0 / 45.0) * tilt * q
    curving = 2.0 * THIRD * beta - gamma * x * (1.0 + (28.0 / 15.0) * tilt)
    step = 1.0 / slope
    newton = value * step
    x -= newton * (1.0 + curving * step * newton)
    q = gamma * x * x
    gain = 2.0 * beta * x * x * (THIRD - q * (1.0 / 45.0 - q * (2.0 / 945.0)))
    return 2.0 * pace * x, v + v * gain


@inlined
def half_duration(b: float) -> float:
    """Root of x + b x^2 = 1 near 1 for |b| <= 1/96: a sum with Catalan's numbers, in pairs of terms."""
    square = b * b
    fourth = square * square
    low = (1.0 - b) + square * (2.0 - 5.0 * b)
    middle = (14.0 - 42.0 * b) + square * (132.0 - 429.0 * b)
    high = (1430.0 - 4862.0 * b) + square * 16796.0
    return low + fourth * (middle + fourth * high)
