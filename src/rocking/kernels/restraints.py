"""Variable restraints: a tendon that yields, and a body that leans forever.

A tendon that has yielded is slack afterwards. The tendon is longer by e = 2 x sin(u/2), or x u in the linear model,
than while the block stands. Its force is k (e - plastic - slack), between zero and the force at e - plastic = yields.
There are three laws:

    ELASTIC   until e - plastic rises to ``yields``, or falls to ``slack``
    SLACK     until e - plastic rises to ``slack``
    PLASTIC   until the block turns back; the plastic elongation is then e - yields

A law is constant during an arc. The block's struct contains the present one, so that other kernels have constant
coefficients.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.events import find_first_root
from rocking.kernels.state import Struct, Structs, TendonLaw

#: Distance from a level, relative to it, that is rounding.
_LEVEL_TOLERANCE = 2.0**-44


@not_inlined
def apply_tendon_law(block: Struct, law: int, plastic_elongation: float) -> None:
    """Write a law and its quantities at a plastic elongation into the struct of a block."""
    for side in range(2):
        # Force at zero elongation, divided by inertia and lever arm.
        force = -block.tendon_stiffness[side] * (plastic_elongation + block.slack_elongation)
        weight = push = prestress = 0.0
        if law == TendonLaw.ELASTIC:
            weight, push, prestress = block.tendon_weight[side], block.tendon_push[side], force
        elif law == TendonLaw.PLASTIC:
            prestress = block.tendon_stiffness[side] * (block.yield_elongation - block.slack_elongation)
        block.added_weight[side] = block.base_weight[side] + weight
        block.added_push[side] = block.base_push[side] + push
        block.prestress[side] = block.base_prestress[side] + prestress
        block.restraint_threshold[side] = (
            block.base_restraint_threshold[side] + max(0.0, force) / block.restoring_gain[side]
        )


@inlined
def find_rotation(block: Struct, nonlinear: bool, side: int, elongation: float) -> float:
    """Compute the rotation for an elongation of the tendon, or an infinity of the same sign if there is none."""
    x = block.lever_arm[side]
    if x <= 0.0 or (nonlinear and abs(elongation) >= 2.0 * x):
        return math.copysign(np.inf, elongation)
    return 2.0 * math.asin(0.5 * elongation / x) if nonlinear else elongation / x


@inlined
def compute_elongation(block: Struct, nonlinear: bool, side: int, u: float) -> float:
    """Compute the elongation of the tendon at a rotation."""
    return block.lever_arm[side] * (2.0 * math.sin(0.5 * u) if nonlinear else u)


@inlined
def find_tendon_law_at_rest(block: Struct, plastic_elongation: float) -> int:
    """Return the law while the block stands."""
    return TendonLaw.ELASTIC if plastic_elongation + block.slack_elongation <= 0.0 else TendonLaw.SLACK


@inlined
def may_tendon_law_change_below(block: Struct, settings: Struct, plastic_elongation: float, height: float) -> bool:
    """Return whether the law of a standing block changes below a height on one of its sides."""
    is_slack = find_tendon_law_at_rest(block, plastic_elongation) == TendonLaw.SLACK
    level = block.slack_elongation if is_slack else block.yield_elongation
    plus = find_rotation(block, settings.nonlinear, 0, plastic_elongation + level)
    minus = find_rotation(block, settings.nonlinear, 1, plastic_elongation + level)
    return bool(not height < min(plus, minus))


@not_inlined
def find_tendon_law_change(
    block: Struct, settings: Struct, scratch: Struct, state: Struct, order: int, h: float
) -> tuple[float, int]:
    """Find the time of the first change of the law along an arc, inf if none within h, and the law after it."""
    c, d, side = scratch.rotation, scratch.auxiliary, state.side
    if state.tendon_law == TendonLaw.PLASTIC:
        for k in range(order):
            d[k] = (k + 1) * c[k + 1]
        return find_first_negative(d, order - 1, h), TendonLaw.ELASTIC
    slack_rotation = find_rotation(block, settings.nonlinear, side, state.plastic_elongation + block.slack_elongation)
    if state.tendon_law == TendonLaw.SLACK:
        return find_level_passage(c, order, h, slack_rotation, 1.0, d), TendonLaw.ELASTIC
    yield_rotation = find_rotation(block, settings.nonlinear, side, state.plastic_elongation + block.yield_elongation)
    yield_time = find_level_passage(c, order, h, yield_rotation, 1.0, d)
    slack_time = find_level_passage(c, order, h, slack_rotation, -1.0, d) if slack_rotation > 0.0 else np.inf
    if slack_time < yield_time:
        return slack_time, TendonLaw.SLACK
    return yield_time, TendonLaw.PLASTIC


@inlined
def find_level_passage(c: Floats, order: int, h: float, level: float, sign: float, d: Floats) -> float:
    """Find the first time within h at which a series passes a level from below (sign 1) or above (-1); else inf."""
    if level == np.inf:
        return np.inf
    d[0] = sign * (level - c[0])
    if abs(d[0]) <= _LEVEL_TOLERANCE * level:
        d[0] = 0.0
    for k in range(1, order + 1):
        d[k] = -sign * c[k]
    return find_first_negative(d, order, h)


@inlined
def find_first_negative(d: Floats, order: int, h: float) -> float:
    """Find the first time from which a series is negative: 0 if immediately, inf if not within h."""
    lead = 0
    while lead < order and d[lead] == 0.0:
        lead += 1
    if d[lead] < 0.0:
        return 0.0
    time = find_first_root(d, lead, order, h)
    return time if time <= h else np.inf


@inlined
def update_plastic_elongation(block: Struct, settings: Struct, nodes: Structs, row: int, previous: float) -> float:
    """Return the plastic elongation at a node, from the node itself or from its value ``previous``."""
    node = nodes[row]
    turns_back = row > 0 and node.tendon_law == TendonLaw.ELASTIC and nodes[row - 1].tendon_law == TendonLaw.PLASTIC
    if turns_back or (row == 0 and node.side >= 0):
        return max(0.0, compute_elongation(block, settings.nonlinear, node.side, node.u) - block.yield_elongation)
    return previous


@inlined
def change_tendon_law(block: Struct, settings: Struct, state: Struct, law: int, u: float) -> None:
    """Change the law of a block at a rotation."""
    if state.tendon_law == TendonLaw.PLASTIC:
        state.plastic_elongation = max(
            0.0, compute_elongation(block, settings.nonlinear, state.side, u) - block.yield_elongation
        )
    state.tendon_law = law
    apply_tendon_law(block, law, state.plastic_elongation)


# ---- Proof that a leaning body stays between two rotations forever ----
# After the motion, the energy of the body is constant or reduced by dampers and a tendon that yields. Therefore the
# body never passes a rotation whose potential energy exceeds its present energy. With one such rotation below and one
# above, it neither reaches zero rotation nor falls. A tendon pulls with at most its strength on the way out and with
# less on the way back: it reduces no later barrier below its present height, and the body cannot return to the last
# yield.

#: Largest fraction of the peak by which a leaning body may still exceed it.
PEAK_MARGIN = 2.0**-30

#: Bound on the rounding of the moment divided by the sum of the sizes of its terms, with allowance for the integral.
_ROUNDING_OF_MOMENT = 2.0**-45

#: Places of a search, as fractions of its path, and number of bisections of an interval.
_SEARCH_FRACTIONS = np.concatenate([np.zeros(1), 2.0 ** np.arange(-40.0, 1.0)])
_BISECTIONS = 60

#: Positive nodes and weights of the Gauss-Legendre rule of eight points.
_GAUSS_LEGENDRE = (
    (0.1834346424956498, 0.362683783378362), (0.525532409916329, 0.3137066458778873),
    (0.7966664774136267, 0.2223810344533745), (0.9602898564975363, 0.1012285362903763),
)  # fmt: skip


@not_inlined
def find_leaning_rotation(block: Struct, settings: Struct, state: Struct, acceleration: float) -> float:
    """Find the rotation without moment about which a body leans forever; NaN if this is not proven.

    The largest rotation so far will not be exceeded by more than the fraction `PEAK_MARGIN`. Either the body, with the
    ``acceleration``, moves and is pushed outwards, as after turning back before the ground, which no rocking body
    does below its balance. Or it has crept back to within `PEAK_MARGIN` of the rotation, at the corresponding speed.
    """
    side, u, nonlinear = state.side, state.u, settings.nonlinear
    drag = block.damping[side]
    if (
        acceleration + drag * state.v <= 0.0
        if state.v > 0.0
        else acceleration < 0.0 or -state.v > PEAK_MARGIN * drag * u
    ):
        return np.nan
    plastic_elongation = state.plastic_elongation
    if block.yielding:
        elongation = compute_elongation(block, nonlinear, side, u)
        plastic_elongation = max(plastic_elongation, elongation - block.yield_elongation)
    tendon_state = (nonlinear, side, plastic_elongation)
    max_rotation = min(
        state.peak, find_rotation(block, nonlinear, side, plastic_elongation + block.yield_elongation)
    ) * (1.0 + PEAK_MARGIN)
    inner, inner_end = find_barrier(block, tendon_state, u, 0.0)
    outer, outer_end = find_barrier(block, tendon_state, u, max_rotation)
    min_rise = min(
        bound_energy_rise(block, tendon_state, u, inner_end), bound_energy_rise(block, tendon_state, u, outer_end)
    )
    if math.isnan(inner + outer) or not (outer_end < block.overturn_angle and 0.5 * state.v * state.v < min_rise):
        return np.nan
    middle = bisect_moment(block, tendon_state, inner, outer)
    return np.nan if state.v < 0.0 and u > middle * (1.0 + PEAK_MARGIN) else middle


@not_inlined
def find_barrier(block: Struct, tendon_state: tuple[bool, int, float], start: float, end: float) -> tuple[float, float]:
    """Find the first interval of rotations between two that turns a body back; NaN: none.

    It ends at ``end`` if all later rotations turn the body back.
    """
    first = last = np.nan
    for fraction in _SEARCH_FRACTIONS:
        rotation = start + (end - start) * fraction
        if compute_static_restoring(block, tendon_state, rotation) * (end - start) > 0.0:
            first, last = (rotation if math.isnan(first) else first), rotation
        elif not math.isnan(first):
            return first, bisect_moment(block, tendon_state, last, rotation)
    return first, end


@inlined
def bisect_moment(block: Struct, tendon_state: tuple[bool, int, float], start: float, end: float) -> float:
    """Find the rotation at which the moment changes its sign between two rotations, by bisection."""
    sign = compute_static_restoring(block, tendon_state, start)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (start + end)
        if compute_static_restoring(block, tendon_state, middle) * sign > 0.0:
            start = middle
        else:
            end = middle
    return start


@not_inlined
def bound_energy_rise(block: Struct, tendon_state: tuple[bool, int, float], start: float, end: float) -> float:
    """Compute a lower bound on the change of potential energy along a path, divided by inertia, law by law."""
    nonlinear, side, plastic_elongation = tendon_state
    low, high, total = min(start, end), max(start, end), 0.0
    slack_rotation = find_rotation(block, nonlinear, side, plastic_elongation + block.slack_elongation)
    yield_rotation = find_rotation(block, nonlinear, side, plastic_elongation + block.yield_elongation)
    for upper in (min(max(slack_rotation, low), high), min(max(yield_rotation, low), high), high):
        half, middle = 0.5 * (upper - low), 0.5 * (upper + low)
        for node, weight in _GAUSS_LEGENDRE:
            total += half * weight * compute_static_restoring(block, tendon_state, middle - half * node)
            total += half * weight * compute_static_restoring(block, tendon_state, middle + half * node)
        low = upper
    size = abs(block.spring[side]) + abs(block.prestress[side]) + abs(block.base_prestress[side])
    size += block.tendon_stiffness[side] * (block.lever_arm[side] + plastic_elongation + abs(block.slack_elongation))
    weight = 1.0 + abs(block.added_weight[side]) + abs(block.base_weight[side])
    size += block.stiffness[side] * (weight + abs(block.added_push[side]) + abs(block.base_push[side]))
    return math.copysign(1.0, end - start) * total - _ROUNDING_OF_MOMENT * size * abs(end - start)


@inlined
def compute_static_restoring(block: Struct, tendon_state: tuple[bool, int, float], u: float) -> float:
    """Compute the restoring acceleration at a rotation without ground motion and damping."""
    nonlinear, side, plastic_elongation = tendon_state
    weight, push, pull = block.added_weight[side], block.added_push[side], block.prestress[side]
    if block.yielding:
        elongation = compute_elongation(block, nonlinear, side, u) - plastic_elongation
        stretch = max(elongation - block.slack_elongation, 0.0)
        weight, push, pull = block.base_weight[side], block.base_push[side], block.base_prestress[side]
        pull += block.tendon_stiffness[side] * min(stretch, block.yield_elongation - block.slack_elongation)
    if nonlinear:
        psi, pull = block.slenderness[side] - u, pull * math.cos(0.5 * u)
        restoring = block.stiffness[side] * ((1.0 + weight) * math.sin(psi) + push * math.cos(psi))
    else:
        standing = block.restoring_gain[side] * (block.threshold[side] * (1.0 + weight) + push)
        restoring = standing - block.stiffness[side] * (1.0 + weight) * u
    return restoring + pull + block.spring[side] * u
