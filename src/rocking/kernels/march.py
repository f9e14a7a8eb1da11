"""The whole response of one block to one motion: rest, uplift, arc, impact, and so on to the end."""

import math

import numpy as np

from rocking.kernels.arc import vary_linear, vary_nonlinear
from rocking.kernels.chatter import motion_at, motion_slope, prove_rest, rest_shift, restoring, time_to_rest
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.impact import (
    QUARTER_TURN,
    SHORT,
    advance,
    arc_from_impact,
    expand,
    next_uplift,
    short_series,
    short_step,
)
from rocking.kernels.state import (
    AT_REST,
    DU,
    DV,
    END,
    EVENT_TABLE,
    EVENTS,
    GAIN,
    GROUND,
    IMPACT_TABLE,
    IMPACTS,
    LIMIT,
    NODE_TABLE,
    NODES,
    OFFSET,
    PEAK,
    PEAK_CHANGE,
    PEAK_TIME,
    PIECE,
    RESTED,
    RESTING,
    RESTITUTION,
    RUN,
    RUN_START,
    SEQUENCE_TABLE,
    SEQUENCES,
    SERIES,
    SIDE,
    SMOOTH,
    SPARE,
    STALLED,
    STIFFNESS,
    STRUCK,
    THRESHOLD,
    UPLIFTED,
    UPLIFTS,
    WORTH,
    Floats,
    Integers,
    Rules,
    Shaking,
    U,
    V,
)
from rocking.kernels.status import (
    BALANCED,
    CERTIFIED,
    DONE,
    FELL,
    FULL,
    GOING,
    IMPACT,
    INTERVAL,
    OVERTURN,
    REST,
    STEP,
    TIME,
    TOPPLED,
    UNDECIDED,
    UPLIFT,
    VELOCITY,
)

_ULP = 2.0**-52

#: A proof that failed, or whose bracket is too wide, is tried again once the speed has fallen by this factor.
_SLOWER = 0.6

# Further outcomes of an arc, besides STEP, IMPACT and OVERTURN.
_STOPPED = 3
_STUCK = 4


@kernel
def march(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    tables: Floats,
    scratch: Floats,
    at: Integers,
    x: Floats,
    pieces: int,
) -> int:
    """Follow one block through one motion, from the state (at, x) on; returns how it ended (`status`).

    GOING means that the first ``pieces`` of the motion's pieces are over; more than there are: go on to the end. FULL
    means that a table has no room left: call again with larger tables and the same state.
    """
    while has_room(rules, tables, at):
        if at[PIECE] >= pieces:
            return GOING
        if at[SIDE] == AT_REST and not wait_for_uplift(shaking, sides, rules, tables, scratch, at, x, pieces):
            return DONE if pieces > shaking.coefficients.shape[0] else GOING
        outcome = follow_arc(shaking, sides, rules, tables, scratch, at, x)
        if outcome == IMPACT:
            strike(shaking, sides, rules, tables, at, x)
            resting, lower, upper, to_rest = judge(shaking, sides, rules, scratch, at, x)
            if resting and not come_to_rest(shaking, sides, rules, tables, lower, upper, to_rest, at, x):
                return DONE
        elif outcome == OVERTURN:
            return FELL
        elif outcome == _STOPPED:
            return DONE
        elif outcome == _STUCK:
            return BALANCED
    return FULL


@inlined
def has_room(rules: Rules, tables: Floats, at: Integers) -> bool:
    """Whether every table has room for what one turn of the march can write."""
    rows = tables.shape[1]
    most = max(max(at[NODES], at[IMPACTS]), max(at[EVENTS], at[SEQUENCES]))
    return bool(not rules.record or most + 3 <= rows)


@inlined
def now(shaking: Shaking, at: Integers, x: Floats) -> float:
    """Time of the state."""
    return shaking.breakpoints[at[PIECE]] + x[OFFSET]


@inlined
def sign_of(side: int) -> float:
    """Sign of the rotation on a side: +1, -1, and 0 at rest."""
    return 0.0 if side == AT_REST else 1.0 - 2.0 * side


@shared
def wait_for_uplift(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    tables: Floats,
    scratch: Floats,
    at: Integers,
    x: Floats,
    pieces: int,
) -> bool:
    """Stay at rest until the motion passes a threshold; False when it does not within its first ``pieces`` pieces."""
    stop = rules.stop
    if pieces < shaking.breakpoints.shape[0]:
        stop = min(stop, shaking.breakpoints[pieces])
    write_node(rules, tables, now(shaking, at, x), at, x)
    piece, offset, side, jump = next_uplift(shaking, at[PIECE], x[OFFSET], sides, stop, scratch[GROUND], scratch[SPARE])
    if side == AT_REST or shaking.breakpoints[piece] + offset >= stop:
        x[END] = max(now(shaking, at, x), shaking.breakpoints[-1]) if rules.endless else rules.stop
        if pieces > shaking.coefficients.shape[0]:
            x[RESTING] += x[END] - x[RESTED]
        return False
    at[PIECE], x[OFFSET], at[SIDE] = piece, offset, side
    at[SMOOTH] = not jump
    x[U] = x[V] = x[DU] = x[DV] = 0.0
    x[UPLIFTED] = x[STRUCK] = now(shaking, at, x)
    x[WORTH] = np.inf
    x[RESTING] += x[UPLIFTED] - x[RESTED]
    at[UPLIFTS] += 1
    shift = 0.0
    if not jump:
        shift = -motion_at(shaking, piece, offset) / motion_slope(shaking, piece, offset)
    write_event(rules, tables, x[UPLIFTED], UPLIFT, shift, at)
    return True


@shared
def follow_arc(
    shaking: Shaking, sides: Floats, rules: Rules, tables: Floats, scratch: Floats, at: Integers, x: Floats
) -> int:
    """One Taylor step along the arc, or as much of it as its first event leaves."""
    start = now(shaking, at, x)
    write_node(rules, tables, start, at, x)
    left, last = time_left(shaking, at[PIECE], x[OFFSET], rules.stop)
    if left <= 0.0:
        x[END] = rules.stop
        return _STOPPED
    side = at[SIDE]
    if not (rules.record or rules.nonlinear or at[SMOOTH]) and shaking.coefficients.shape[1] == 2:
        if at[RUN] > 0 and x[U] == 0.0:
            left = hurry(shaking, sides, left, at, x)
            side = at[SIDE]
        outcome, t, u, v = short_step(shaking, sides, side, at[PIECE], x[OFFSET], x[U], x[V], left, x[PEAK])
        if outcome != UNDECIDED:
            return arrive(shaking, rules, tables, outcome, t, u, v, left, last, at, x)
    order, h, degree = expand(shaking, sides, rules, scratch, side, at[PIECE], x[OFFSET], x[U], x[V], left)
    if at[SMOOTH]:  # the acceleration at an uplift is zero, whatever rounding says
        scratch[SERIES][2] = 0.0
        at[SMOOTH] = 0
    if at[PIECE] == shaking.coefficients.shape[0] and x[V] == 0.0 and scratch[SERIES][2] == 0.0 and rules.endless:
        return _STUCK
    outcome, t, u, v, top, height = advance(x[U], x[V], order, h, scratch[SERIES], scratch[SPARE])
    if height > x[PEAK]:
        x[PEAK], x[PEAK_TIME] = height, start + top
        x[PEAK_CHANGE], _ = vary(sides, rules, scratch, x[DU], x[DV], side, order, degree, top)
    x[DU], x[DV] = vary(sides, rules, scratch, x[DU], x[DV], side, order, degree, t)
    return arrive(shaking, rules, tables, outcome, t, u, v, left, last, at, x)


@shared
def hurry(shaking: Shaking, sides: Floats, left: float, at: Integers, x: Floats) -> float:
    """Impacts of a proven sequence of the linear model within a piece, up to the one that is worth another proof.

    Returns the time left in the piece.
    """
    piece, side, v = at[PIECE], at[SIDE], x[V]
    ground = motion_at(shaking, piece, x[OFFSET]) * shaking.inverse_g
    slope = motion_slope(shaking, piece, x[OFFSET]) * shaking.inverse_g
    elapsed = 0.0
    while True:
        lam, gain = sides[side, STIFFNESS], sides[side, GAIN] * (1.0 - 2.0 * side)
        c2 = -0.5 * (sides[side, GAIN] * sides[side, THRESHOLD] + gain * (ground + slope * elapsed))
        c3 = (lam * v - gain * slope) * (1.0 / 6.0)
        t = arc_from_impact(v, c2, c3, lam, left)
        if not (t == t and lam * t * t < SHORT):
            break
        _, speed = short_series(0.0, v, c2, c3, lam, t)
        slower = -sides[side, RESTITUTION] * speed
        # The arc lies below its first tangent.
        if not (slower > x[WORTH] and v * t <= x[PEAK]):
            break
        v, side = slower, 1 - side
        elapsed += t
        left -= t
        at[IMPACTS] += 1
        at[RUN] += 1
    at[SIDE], x[V] = side, v
    x[OFFSET] += elapsed
    x[STRUCK] = now(shaking, at, x)
    return left


@inlined
def arrive(
    shaking: Shaking,
    rules: Rules,
    tables: Floats,
    outcome: int,
    t: float,
    u: float,
    v: float,
    left: float,
    last: bool,
    at: Integers,
    x: Floats,
) -> int:
    """Take the state to the end of a step, and say what ended it."""
    pass_time(t, x)
    x[U], x[V] = u, v
    if outcome == OVERTURN:
        x[END] = x[PEAK_TIME] = now(shaking, at, x)
        x[PEAK], x[PEAK_CHANGE] = QUARTER_TURN, 0.0
        write_node(rules, tables, x[END], at, x)
        write_event(rules, tables, x[END], TOPPLED, -x[DU] / v, at)
    elif outcome == STEP and last and t >= left:
        x[END] = rules.stop
        write_node(rules, tables, rules.stop, at, x)
        return _STOPPED
    elif outcome == STEP:
        enter_piece(shaking, t >= left, at, x)
    return outcome


@shared
def strike(shaking: Shaking, sides: Floats, rules: Rules, tables: Floats, at: Integers, x: Floats) -> None:
    """Impact: the angular speed drops, the side changes, and the variation jumps with them (saltation).

    Without any speed the impact might come at any time, and the block is at rest.
    """
    settle(shaking, at, x)
    time = now(shaking, at, x)
    acceleration = motion_at(shaking, at[PIECE], x[OFFSET])
    left, entered = at[SIDE], 1 - at[SIDE]
    speed = max(0.0, -x[V])
    e = sides[left, RESTITUTION]
    at[SIDE], x[U], x[V] = entered, 0.0, e * speed
    shift = np.inf
    if speed > 0.0:
        shift = x[DU] / speed
        faster = -(x[DV] - restoring(sides, left, acceleration * shaking.inverse_g) * shift)
        x[DU] = -x[V] * shift
        x[DV] = e * faster + restoring(sides, entered, acceleration * shaking.inverse_g) * shift
    if rules.record:
        k = at[IMPACTS]
        tables[IMPACT_TABLE, k, 0], tables[IMPACT_TABLE, k, 1] = time, sign_of(entered)
        tables[IMPACT_TABLE, k, 2], tables[IMPACT_TABLE, k, 3], tables[IMPACT_TABLE, k, 4] = speed, x[V], shift
    at[IMPACTS] += 1


@shared
def judge(
    shaking: Shaking, sides: Floats, rules: Rules, scratch: Floats, at: Integers, x: Floats
) -> tuple[bool, float, float, float]:
    """Whether the block comes to rest from this impact on: proven, imposed, or because time hardly advances any more.

    Returns (resting, lower and upper bound on the time that it takes, estimate of it); NaN bounds: not proven.
    """
    time, v, side = now(shaking, at, x), x[V], at[SIDE]
    interval = time - x[STRUCK]
    x[STRUCK] = time
    lower = upper = np.nan
    if rules.treatment == CERTIFIED:
        if worth_proving(at, x):
            lower, upper = bracket(shaking, sides, rules, scratch, at, x)
        if upper - lower <= max(rules.tolerance, 4.0 * allowance(time, upper, at, x)):
            estimate = time_to_rest(shaking, sides, rules.nonlinear, v, side, at[PIECE], x[OFFSET])
            return True, lower, upper, min(max(estimate, lower), upper)
    elif imposed(rules, sides[side, LIMIT], v, interval, time - x[UPLIFTED]):
        return True, lower, upper, 0.0
    standing = stalled(shaking, sides, interval, at, x)
    if v == 0.0 or standing:
        at[STALLED] += standing
        at[RUN] = 0
        return True, np.nan, np.nan, 0.0
    return False, lower, upper, 0.0


@inlined
def bracket(
    shaking: Shaking, sides: Floats, rules: Rules, scratch: Floats, at: Integers, x: Floats
) -> tuple[float, float]:
    """Proven bounds on the time to rest, with room for the rounding of all times; NaN, NaN: no proof."""
    time = now(shaking, at, x)
    lower, upper = prove_rest(shaking, sides, rules.nonlinear, scratch[GROUND], x[V], at[SIDE], at[PIECE], x[OFFSET])
    if not upper >= 0.0:
        x[WORTH] = _SLOWER * x[V]
        return np.nan, np.nan
    if at[RUN] == 0:
        at[RUN], x[RUN_START] = 1, time
    slack = allowance(time, upper, at, x)
    lower, upper = max(0.0, lower - slack), upper + slack
    # A bracket's width is about quadratic in the speed.
    x[WORTH] = x[V] * min(_SLOWER, math.sqrt(rules.tolerance / (upper - lower)))
    return lower, upper


@inlined
def worth_proving(at: Integers, x: Floats) -> bool:
    """Whether the block has become so much slower since the last proof was tried that another may bring more."""
    if at[RUN] > 0:
        at[RUN] += 1
    if x[V] <= x[WORTH]:
        return True
    if at[RUN] == 0:
        x[WORTH] = max(x[WORTH], _SLOWER * x[V])
    return False


@inlined
def allowance(time: float, upper: float, at: Integers, x: Floats) -> float:
    """Room for the rounding of the times, and of the arcs resolved since the first proof."""
    return float(4.0 * _ULP * time + 8.0 * _ULP * (at[RUN] + 4) * (time + upper - x[RUN_START]))


@inlined
def stalled(shaking: Shaking, sides: Floats, interval: float, at: Integers, x: Floats) -> bool:
    """Whether time hardly advanced since the last impact, and will not until the next."""
    fastest = max(sides[0, STIFFNESS], sides[1, STIFFNESS])
    least = _ULP * (now(shaking, at, x) + 1.0 / math.sqrt(fastest))
    pressed = restoring(sides, at[SIDE], motion_at(shaking, at[PIECE], x[OFFSET]) * shaking.inverse_g)
    return bool(interval <= least and 2.0 * x[V] <= least * pressed)


@inlined
def imposed(rules: Rules, limit: float, v: float, interval: float, since_uplift: float) -> bool:
    """Whether a treatment other than the certificate brings the block to rest at this impact."""
    if rules.treatment == VELOCITY:
        return v <= limit
    if rules.treatment == INTERVAL:
        return interval <= limit
    return rules.treatment == TIME and since_uplift >= limit


@shared
def come_to_rest(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    tables: Floats,
    lower: float,
    upper: float,
    to_rest: float,
    at: Integers,
    x: Floats,
) -> bool:
    """Close a sequence of impacts; False when the march stops before the block is at rest."""
    time = now(shaking, at, x)
    if at[RUN] == 0:
        at[RUN], x[RUN_START] = 1, time
    if rules.record:
        k = at[SEQUENCES]
        tables[SEQUENCE_TABLE, k, 0], tables[SEQUENCE_TABLE, k, 1] = x[RUN_START], time + to_rest
        tables[SEQUENCE_TABLE, k, 2], tables[SEQUENCE_TABLE, k, 3], tables[SEQUENCE_TABLE, k, 4] = (
            time + lower,
            time + upper,
            at[RUN],
        )
    at[SEQUENCES] += 1
    at[RUN] = 0
    if time + to_rest >= rules.stop:
        x[END] = rules.stop
        return False
    shift = shift_of_rest(shaking, sides, rules, tables, to_rest, at, x)
    at[SIDE], x[U], x[V] = AT_REST, 0.0, 0.0
    x[RESTED] = time + to_rest
    write_event(rules, tables, x[RESTED], REST, shift, at)
    x[OFFSET] += to_rest
    settle(shaking, at, x)
    return True


@inlined
def shift_of_rest(
    shaking: Shaking, sides: Floats, rules: Rules, tables: Floats, to_rest: float, at: Integers, x: Floats
) -> float:
    """Shift of the time of rest per unit of scaling, from the last impact; 0 if nothing is recorded."""
    if not rules.record:
        return 0.0
    shift = float(tables[IMPACT_TABLE, at[IMPACTS] - 1, 4])
    if to_rest == 0.0:
        return shift
    return rest_shift(shaking, sides, x[V], x[DV], shift, at[SIDE], at[PIECE], x[OFFSET])


@inlined
def vary(
    sides: Floats, rules: Rules, scratch: Floats, du: float, dv: float, side: int, order: int, degree: int, t: float
) -> tuple[float, float]:
    """Variation carried over a part of the step, linear or nonlinear; as it was if nothing is recorded."""
    if not rules.record:
        return du, dv
    stiffness = sides[side, STIFFNESS]
    if rules.nonlinear:
        return vary_nonlinear(du, dv, stiffness, degree, order, t, scratch)
    return vary_linear(du, dv, stiffness, degree, order, t, scratch)


@inlined
def time_left(shaking: Shaking, piece: int, offset: float, stop: float) -> tuple[float, bool]:
    """Time to the end of the piece, or to ``stop`` where that comes first, and whether it does."""
    until_stop = stop - shaking.breakpoints[piece] - offset
    if piece == shaking.coefficients.shape[0]:
        return until_stop, True
    left = shaking.breakpoints[piece + 1] - shaking.breakpoints[piece] - offset
    return min(left, until_stop), until_stop <= left


@inlined
def pass_time(t: float, x: Floats) -> None:
    """Move on by t, and never by nothing, so that every march ends."""
    start = x[OFFSET]
    x[OFFSET] += t
    if x[OFFSET] == start:
        x[OFFSET] += _ULP * start


@inlined
def enter_piece(shaking: Shaking, over: bool, at: Integers, x: Floats) -> None:
    """After a step: the start of the next piece if this one is over, by the step's length or by rounding."""
    if over:
        at[PIECE] += 1
        x[OFFSET] = 0.0
    else:
        settle(shaking, at, x)


@inlined
def settle(shaking: Shaking, at: Integers, x: Floats) -> None:
    """Bring the offset inside its own piece."""
    while at[PIECE] < shaking.coefficients.shape[0]:
        length = shaking.breakpoints[at[PIECE] + 1] - shaking.breakpoints[at[PIECE]]
        if x[OFFSET] < length:
            return
        x[OFFSET] -= length
        at[PIECE] += 1


@inlined
def write_node(rules: Rules, tables: Floats, time: float, at: Integers, x: Floats) -> None:
    """Write down the state."""
    if not rules.record:
        return
    k = at[NODES]
    tables[NODE_TABLE, k, 0], tables[NODE_TABLE, k, 1], tables[NODE_TABLE, k, 2] = time, at[PIECE], x[OFFSET]
    tables[NODE_TABLE, k, 3], tables[NODE_TABLE, k, 4], tables[NODE_TABLE, k, 5] = sign_of(at[SIDE]), x[U], x[V]
    at[NODES] += 1


@inlined
def write_event(rules: Rules, tables: Floats, time: float, kind: int, shift: float, at: Integers) -> None:
    """Write down an uplift, a rest or an overturning."""
    if not rules.record:
        return
    k = at[EVENTS]
    tables[EVENT_TABLE, k, 0], tables[EVENT_TABLE, k, 1] = time, kind
    tables[EVENT_TABLE, k, 2], tables[EVENT_TABLE, k, 3] = sign_of(at[SIDE]), shift
    at[EVENTS] += 1


@kernel
def march_each(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    tables: Floats,
    scratch: Floats,
    at: Integers,
    x: Floats,
    endings: Integers,
) -> None:
    """March many blocks, one after the other, each from its own state to its own end (`status`)."""
    for k in range(sides.shape[0]):
        endings[k] = march(shaking, sides[k], rules, tables, scratch, at[k], x[k], shaking.coefficients.shape[0] + 1)
