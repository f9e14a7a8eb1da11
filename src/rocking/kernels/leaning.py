"""Whether a body that restraints hold while it leans stays between two rotations for ever, once the motion is over.

Its energy no longer grows: it is kept, or dampers and a tendon that yields take some. So a body never passes a rotation
at which its potential energy would be above its present energy. With one such rotation below it and one above, it
neither reaches zero rotation nor falls. On the way out a tendon pulls as far as its strength, on the way back less than
that, so that it raises no later barrier below what it is now, nor can the body come back to where it last yielded.
"""

import math

import numpy as np

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.state import Record
from rocking.kernels.tendon import elongation_at, rotation_at

#: Largest part of the peak by which a body that leans may yet exceed it.
PEAK = 2.0**-30

#: Bound on the rounding of the moment over the sum of what its terms are made of, with room for that of the integral.
_ROUNDING = 2.0**-45

#: Places of a search, over the length of its way; and halvings of an interval.
_PLACES = np.concatenate([np.zeros(1), 2.0 ** np.arange(-40.0, 1.0)])
_HALVINGS = 60

#: Positive nodes of Gauss and Legendre's rule of eight points, and their weights.
_RULE = (
    (0.1834346424956498, 0.362683783378362), (0.525532409916329, 0.3137066458778873),
    (0.7966664774136267, 0.2223810344533745), (0.9602898564975363, 0.1012285362903763),
)  # fmt: skip


@shared
def leaning_at(block: Record, settings: Record, state: Record, rate: float) -> float:
    """Return the rotation about which a body leans for ever, at which nothing turns it; NaN where that is not proven.

    The highest rotation so far will not be exceeded by more than `PEAK` of itself. The body has the acceleration
    ``rate`` and goes out though it is pushed out, as where it has turned back in front of the ground, which no body
    that rocks does below its balance; or it has crept back to within `PEAK` of the rotation, with the speed of that.
    """
    side, u, nonlinear = state.side, state.u, settings.nonlinear
    drag = block.damping[side]
    if rate + drag * state.v <= 0.0 if state.v > 0.0 else rate < 0.0 or -state.v > PEAK * drag * u:
        return np.nan
    plastic = state.plastic
    if block.yielding:
        plastic = max(plastic, elongation_at(block, nonlinear, side, u) - block.yields)
    body = (nonlinear, side, plastic)
    highest = min(state.peak, rotation_at(block, nonlinear, side, plastic + block.yields)) * (1.0 + PEAK)
    below, low = barrier(block, body, u, 0.0)
    above, high = barrier(block, body, u, highest)
    least = min(rise(block, body, u, low), rise(block, body, u, high))
    if math.isnan(below + above) or not (high < block.overturn_angle and 0.5 * state.v * state.v < least):
        return np.nan
    middle = last_before(block, body, below, above)
    return np.nan if state.v < 0.0 and u > middle * (1.0 + PEAK) else middle


@shared
def barrier(block: Record, body: tuple[bool, int, float], start: float, end: float) -> tuple[float, float]:
    """Search the way from one rotation to another for the first place that turns a body back, and where that ends.

    The latter is the end of the way where all places beyond the first turn it back. NaN: there is no such place.
    """
    first = last = np.nan
    for share in _PLACES:
        at = start + (end - start) * share
        if moment_at(block, body, at) * (end - start) > 0.0:
            first, last = (at if math.isnan(first) else first), at
        elif not math.isnan(first):
            return first, last_before(block, body, last, at)
    return first, end


@inlined
def last_before(block: Record, body: tuple[bool, int, float], one: float, other: float) -> float:
    """Rotation at which the moment changes its sign between two at which it has different ones, by halving."""
    sign = moment_at(block, body, one)
    for _ in range(_HALVINGS):
        middle = 0.5 * (one + other)
        if moment_at(block, body, middle) * sign > 0.0:
            one = middle
        else:
            other = middle
    return one


@shared
def rise(block: Record, body: tuple[bool, int, float], start: float, end: float) -> float:
    """Lower bound on the change of the potential energy along a way, over inertia; part by part of the tendon's law."""
    nonlinear, side, plastic = body
    low, high, total = min(start, end), max(start, end), 0.0
    slack = rotation_at(block, nonlinear, side, plastic + block.slack)
    yields = rotation_at(block, nonlinear, side, plastic + block.yields)
    for upper in (min(max(slack, low), high), min(max(yields, low), high), high):
        half, middle = 0.5 * (upper - low), 0.5 * (upper + low)
        for node, weight in _RULE:
            total += half * weight * moment_at(block, body, middle - half * node)
            total += half * weight * moment_at(block, body, middle + half * node)
        low = upper
    size = abs(block.spring[side]) + abs(block.prestress[side]) + abs(block.base_prestress[side])
    size += block.tendon[side] * (block.lever_arm[side] + plastic + abs(block.slack))
    weight = 1.0 + abs(block.added_weight[side]) + abs(block.base_weight[side])
    size += block.stiffness[side] * (weight + abs(block.added_push[side]) + abs(block.base_push[side]))
    return math.copysign(1.0, end - start) * total - _ROUNDING * size * abs(end - start)


@inlined
def moment_at(block: Record, body: tuple[bool, int, float], u: float) -> float:
    """Restoring acceleration at a rotation without ground motion and damping."""
    nonlinear, side, plastic = body
    weight, push, pull = block.added_weight[side], block.added_push[side], block.prestress[side]
    if block.yielding:
        taut = max(elongation_at(block, nonlinear, side, u) - plastic - block.slack, 0.0)
        weight, push, pull = block.base_weight[side], block.base_push[side], block.base_prestress[side]
        pull += block.tendon[side] * min(taut, block.yields - block.slack)
    if nonlinear:
        psi, pull = block.slenderness[side] - u, pull * math.cos(0.5 * u)
        own = block.stiffness[side] * ((1.0 + weight) * math.sin(psi) + push * math.cos(psi))
    else:
        standing = block.threshold_slope[side] * (block.threshold[side] * (1.0 + weight) + push)
        own = standing - block.stiffness[side] * (1.0 + weight) * u
    return own + pull + block.spring[side] * u
