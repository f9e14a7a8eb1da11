"""What restraints change in time: a tendon that yields, and a body that leans for ever.

A tendon that yields hangs slack afterwards: what it does to the record of a block, and when that changes.

The tendon is longer by e = 2 x sin(u/2), or x u in the linear model, than while the block stands, and its force is
k (e - plastic - slack), between nothing and that at e - plastic = yields. So there are three laws:

    ELASTIC   until e - plastic rises to ``yields``, or falls to ``slack``
    SLACK     until e - plastic rises to ``slack``
    PLASTIC   until the block turns back; the plastic elongation is then e - yields

Each law is that of an arc. The block's record has the present one, so that all other kernels know constants alone.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.events import first_root
from rocking.kernels.state import Record, Records, TendonLaw

#: Distance from a level, relative to it, that is rounding.
_ROUNDING = 2.0**-44


@shared
def apply_tendon_law(block: Record, law: int, plastic: float) -> None:
    """Write a law, and what follows from the plastic elongation, into the record of a block."""
    for side in range(2):
        force = -block.tendon[side] * (plastic + block.slack)  # at no elongation, over inertia and lever arm
        weight = push = prestress = 0.0
        if law == TendonLaw.ELASTIC:
            weight, push, prestress = block.tendon_weight[side], block.tendon_push[side], force
        elif law == TendonLaw.PLASTIC:
            prestress = block.tendon[side] * (block.yields - block.slack)
        block.added_weight[side] = block.base_weight[side] + weight
        block.added_push[side] = block.base_push[side] + push
        block.prestress[side] = block.base_prestress[side] + prestress
        block.restraint_threshold[side] = (
            block.base_restraint_threshold[side] + max(0.0, force) / block.threshold_slope[side]
        )


@inlined
def rotation_at(block: Record, nonlinear: bool, side: int, elongation: float) -> float:
    """Rotation at which the tendon is longer by so much; an infinity with the sign of that where it never is."""
    x = block.lever_arm[side]
    if x <= 0.0 or (nonlinear and abs(elongation) >= 2.0 * x):
        return math.copysign(np.inf, elongation)
    return 2.0 * math.asin(0.5 * elongation / x) if nonlinear else elongation / x


@inlined
def elongation_at(block: Record, nonlinear: bool, side: int, u: float) -> float:
    """Elongation of the tendon at a rotation."""
    return block.lever_arm[side] * (2.0 * math.sin(0.5 * u) if nonlinear else u)


@inlined
def law_of_standing(block: Record, plastic: float) -> int:
    """Law while the block stands."""
    return TendonLaw.ELASTIC if plastic + block.slack <= 0.0 else TendonLaw.SLACK


@inlined
def may_change_below(block: Record, settings: Record, plastic: float, height: float) -> bool:
    """Whether the law of a standing block changes below a height on one of its sides."""
    level = block.slack if law_of_standing(block, plastic) == TendonLaw.SLACK else block.yields
    plus = rotation_at(block, settings.nonlinear, 0, plastic + level)
    minus = rotation_at(block, settings.nonlinear, 1, plastic + level)
    return bool(not height < min(plus, minus))


@shared
def next_law(
    block: Record, settings: Record, scratch: Record, state: Record, order: int, h: float
) -> tuple[float, int]:
    """Time of the first change of the law along an arc, inf without one within h; and the law after it."""
    c, d, side = scratch.rotation, scratch.other, state.side
    if state.law == TendonLaw.PLASTIC:
        for k in range(order):
            d[k] = (k + 1) * c[k + 1]
        return first_of(d, order - 1, h), TendonLaw.ELASTIC
    slack = rotation_at(block, settings.nonlinear, side, state.plastic + block.slack)
    if state.law == TendonLaw.SLACK:
        return time_to_level(c, order, h, slack, 1.0, d), TendonLaw.ELASTIC
    top = rotation_at(block, settings.nonlinear, side, state.plastic + block.yields)
    yielding = time_to_level(c, order, h, top, 1.0, d)
    slackening = time_to_level(c, order, h, slack, -1.0, d) if slack > 0.0 else np.inf
    if slackening < yielding:
        return slackening, TendonLaw.SLACK
    return yielding, TendonLaw.PLASTIC


@inlined
def time_to_level(c: Floats, order: int, h: float, level: float, sign: float, d: Floats) -> float:
    """First time within h at which a series that is below a level (sign 1), or above it (-1), passes it; else inf."""
    if level == np.inf:
        return np.inf
    d[0] = sign * (level - c[0])
    if abs(d[0]) <= _ROUNDING * level:
        d[0] = 0.0
    for k in range(1, order + 1):
        d[k] = -sign * c[k]
    return first_of(d, order, h)


@inlined
def first_of(d: Floats, order: int, h: float) -> float:
    """First time from which a series is negative; 0 where it is so at once, inf where it is not within h."""
    lead = 0
    while lead < order and d[lead] == 0.0:
        lead += 1
    if d[lead] < 0.0:
        return 0.0
    time = first_root(d, lead, order, h)
    return time if time <= h else np.inf


@inlined
def plastic_after(block: Record, settings: Record, nodes: Records, row: int, before: float) -> float:
    """Plastic elongation at a node of a response, from that at the node before it; of the first node from itself."""
    node = nodes[row]
    turns = row > 0 and node.law == TendonLaw.ELASTIC and nodes[row - 1].law == TendonLaw.PLASTIC
    if turns or (row == 0 and node.side >= 0):
        return max(0.0, elongation_at(block, settings.nonlinear, node.side, node.u) - block.yields)
    return before


@inlined
def change_law(block: Record, settings: Record, state: Record, law: int, u: float) -> None:
    """Change the law of a block at a rotation."""
    if state.law == TendonLaw.PLASTIC:
        state.plastic = max(0.0, elongation_at(block, settings.nonlinear, state.side, u) - block.yields)
    state.law = law
    apply_tendon_law(block, law, state.plastic)


# ---- Whether a body that restraints hold while it leans stays between two rotations for ever ----
# Once the motion is over its energy no longer grows: it is kept, or dampers and a tendon that yields take some. So a
# body never passes a rotation at which its potential energy would be above its present energy. With one such rotation
# below it and one above, it neither reaches zero rotation nor falls. On the way out a tendon pulls as far as its
# strength, on the way back less than that, so that it raises no later barrier below what it is now, nor can the body
# come back to where it last yielded.

#: Largest part of the peak by which a body that leans may yet exceed it.
PEAK = 2.0**-30

#: Bound on the rounding of the moment over the sum of what its terms are made of, with room for that of the integral.
_ROUNDING_OF_MOMENT = 2.0**-45

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
    return math.copysign(1.0, end - start) * total - _ROUNDING_OF_MOMENT * size * abs(end - start)


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
