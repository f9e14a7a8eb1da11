"""A tendon that yields, and hangs slack afterwards: what it does to the record of a block, and when that changes.

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
