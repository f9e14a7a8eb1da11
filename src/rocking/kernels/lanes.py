"""Many blocks through one evenly sampled record: together where nothing happens, one by one where something does.

A lane is one block. Over each sample all lanes step together, in loops that vectorise; a lane in which the step may
hold an event (an impact, a new peak, an overturning, an uplift) is left where it was, and `march` plays that sample
for it exactly. What may hold an event is decided by bounds, never by sampling, so that no impact can be missed.

In the linear model z = u''/p^2 = u - alpha - i a/g obeys z'' = p^2 z, whatever the (linear) motion, so one step adds a
product with a matrix that is known beforehand; it is added to u, since u - z would lose the digits of small rotations.
In the nonlinear model a step is a Taylor series of fixed order.

Over a step of length h, u stays above the straight line between its ends less (h^2/8) max(u'', 0), and below it plus
(h^2/8) max(-u'', 0). In the linear model the extrema of u'' = p^2 z are at the ends; in the nonlinear model they are
bounded from the series' coefficients.
"""

import math
from typing import NamedTuple

import numpy as np

from rocking.kernels.chatter import piece_range
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.impact import QUARTER_TURN
from rocking.kernels.march import march
from rocking.kernels.state import (
    AT_REST,
    OFFSET,
    ORDER,
    PEAK,
    PIECE,
    SIDE,
    SLENDERNESS,
    STIFFNESS,
    THRESHOLD,
    Floats,
    Integers,
    Rules,
    Shaking,
    U,
    V,
)
from rocking.kernels.status import GOING

#: Lanes that step together. A constant, so that the compiler sees that the rows of the flat tables do not overlap.
WIDTH = 64

# Where each row of the lanes' flat table starts. State: u, u', and (nonlinear) the sine and cosine of alpha - u; where
# a step would take it (nonlinear).
U0, V0, S0, C0, U1, V1, S1, C1 = range(0, 8 * WIDTH, WIDTH)
# Constants of the side that the lane is on: with x = p h, cosh x - 1, sinh x / p, h - sinh x / p, p sinh x (linear);
# alpha, i/g, p^2, and the factor of the bounds.
COSH, SINH, LAG, SINH_P, ALPHA, SIGN, LAMBDA, CURVE = range(8 * WIDTH, 16 * WIDTH, WIDTH)
# Peak so far, and the accelerations beyond which a lane at rest uplifts.
HIGHEST, ABOVE, BELOW = range(16 * WIDTH, 19 * WIDTH, WIDTH)
ROWS = 19


class Room(NamedTuple):
    """Room for the work of `run_lanes`.

    The lanes' flat table; their marks; the step matrices of both their sides (linear), shape (WIDTH, 2, 4); and the
    series of u, sin and cos(alpha - u) (nonlinear), shape (3, ORDER + 1, WIDTH).
    """

    lanes: Floats
    events: Integers
    steps: Floats
    series: Floats


def new_room() -> Room:
    """Room for one call of `run_lanes` at a time."""
    series = _on_cache_lines(3 * (ORDER + 1) * WIDTH).reshape(3, ORDER + 1, WIDTH)
    return Room(_on_cache_lines(ROWS * WIDTH), np.zeros(WIDTH, dtype=np.int64), np.zeros((WIDTH, 2, 4)), series)


def _on_cache_lines(size: int) -> Floats:
    """Zeros that start on a cache line: vectors that straddle two lines load at half the speed."""
    line = 64
    room = np.zeros(size + line // 8)
    skip = -room.ctypes.data % line // 8
    return room[skip : skip + size]


@kernel
def run_lanes(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    tables: Floats,
    scratch: Floats,
    room: Room,
    at: Integers,
    x: Floats,
    endings: Integers,
) -> None:
    """March every lane through a record of even samples, and on to its own end.

    Parameters
    ----------
    shaking : Shaking
        Pieces of degree 1 and equal length.
    sides : ndarray, shape (n, 2, 6)
        Blocks, as `march` takes them; n <= WIDTH.
    at, x : ndarray, shapes (n, .), (n, .)
        State of every lane at time zero; the last state on return.
    endings : ndarray of int, shape (n,)
        How each lane ended (`status`), written on return.
    """
    lanes = room.lanes
    h = shaking.breakpoints[1] - shaking.breakpoints[0]
    order = series_order(sides, h) if rules.nonlinear else 0
    moving = start_lanes(shaking, sides, rules, room, at, x, endings, h)
    pieces = shaking.coefficients.shape[0]
    piece = next_loud(shaking, lanes, 0, pieces)
    while piece < pieces and moving > 0 and shaking.breakpoints[piece + 1] <= rules.stop:
        start, slope = shaking.coefficients[piece, 0], shaking.coefficients[piece, 1]
        length = shaking.breakpoints[piece + 1] - shaking.breakpoints[piece]
        if rules.nonlinear:
            busy = quiet_nonlinear(lanes, room.series, room.events, start, slope, length, order)
        else:
            busy = quiet_linear(lanes, room.events, start, slope, h, length - h)
        if busy > 0:
            moving -= play(shaking, sides, rules, tables, scratch, room, at, x, endings, piece, h)
        piece += 1
        if busy > 0 and is_idle(lanes):
            piece = next_loud(shaking, lanes, piece, pieces)
    for lane in range(sides.shape[0]):
        if endings[lane] == GOING:
            unload(lanes, at, x, lane, piece)
            endings[lane] = march(shaking, sides[lane], rules, tables, scratch, at[lane], x[lane], pieces + 1)


@shared
def start_lanes(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    room: Room,
    at: Integers,
    x: Floats,
    endings: Integers,
    h: float,
) -> int:
    """Load the lanes that there are and freeze the rest; returns how many there are."""
    for lane in range(WIDTH):
        freeze(room.lanes, lane, np.inf)
        room.events[lane] = 0
    for lane in range(sides.shape[0]):
        endings[lane] = GOING
        for side in range(2):
            p = math.sqrt(sides[lane, side, STIFFNESS])
            half, whole = math.sinh(0.5 * p * h), math.sinh(p * h)
            room.steps[lane, side, 0], room.steps[lane, side, 1] = 2.0 * half * half, whole / p
            room.steps[lane, side, 2], room.steps[lane, side, 3] = h - whole / p, p * whole
        load(shaking, sides, rules, room, at, x, lane, h)
    return sides.shape[0]


@shared
def play(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    tables: Floats,
    scratch: Floats,
    room: Room,
    at: Integers,
    x: Floats,
    endings: Integers,
    piece: int,
    h: float,
) -> int:
    """Play one sample exactly for the lanes that are marked; returns how many of them have ended."""
    ended = 0
    for lane in range(sides.shape[0]):
        if room.events[lane] == 0:
            continue
        unload(room.lanes, at, x, lane, piece)
        endings[lane] = march(shaking, sides[lane], rules, tables, scratch, at[lane], x[lane], piece + 1)
        load(shaking, sides, rules, room, at, x, lane, h)
        if endings[lane] != GOING:
            freeze(room.lanes, lane, np.inf)
            ended += 1
    return ended


@shared
def unload(lanes: Floats, at: Integers, x: Floats, lane: int, piece: int) -> None:
    """Hand a lane's state before the step to the verbs of `march`."""
    if at[lane, SIDE] == AT_REST:
        if at[lane, PIECE] < piece:
            at[lane, PIECE], x[lane, OFFSET] = piece, 0.0
        return
    at[lane, PIECE], x[lane, OFFSET] = piece, 0.0
    x[lane, U], x[lane, V] = lanes[U0 + lane], lanes[V0 + lane]


@shared
def load(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    room: Room,
    at: Integers,
    x: Floats,
    lane: int,
    h: float,
) -> None:
    """Take a lane's state back from the verbs of `march`."""
    lanes, side = room.lanes, at[lane, SIDE]
    lanes[HIGHEST + lane] = x[lane, PEAK]
    if side == AT_REST:
        freeze(lanes, lane, 1.0)
        lanes[ABOVE + lane] = sides[lane, 1, THRESHOLD] / shaking.inverse_g
        lanes[BELOW + lane] = -sides[lane, 0, THRESHOLD] / shaking.inverse_g
        return
    stiffness, alpha = sides[lane, side, STIFFNESS], sides[lane, side, SLENDERNESS]
    sign = (1.0 - 2.0 * side) * shaking.inverse_g
    lanes[COSH + lane], lanes[SINH + lane] = room.steps[lane, side, 0], room.steps[lane, side, 1]
    lanes[LAG + lane], lanes[SINH_P + lane] = room.steps[lane, side, 2], room.steps[lane, side, 3]
    lanes[ALPHA + lane], lanes[SIGN + lane], lanes[LAMBDA + lane] = alpha, sign, stiffness
    lanes[ABOVE + lane], lanes[BELOW + lane] = np.inf, -np.inf
    u = x[lane, U]
    lanes[U0 + lane], lanes[V0 + lane] = u, x[lane, V]
    if rules.nonlinear:
        lanes[CURVE + lane] = h * h / 8.0
        lanes[S0 + lane], lanes[C0 + lane] = math.sin(alpha - u), math.cos(alpha - u)
        return
    lanes[CURVE + lane] = stiffness * h * h / 8.0


@inlined
def freeze(lanes: Floats, lane: int, limit: float) -> None:
    """Constants with which a lane stays where it is: at rest, or (infinite limit) ended."""
    for row in range(COSH, CURVE + WIDTH, WIDTH):
        lanes[row + lane] = 0.0
    lanes[U0 + lane], lanes[V0 + lane] = 1.0, 0.0
    lanes[S0 + lane], lanes[C0 + lane] = 0.0, 1.0
    lanes[ALPHA + lane] = 1.0
    lanes[ABOVE + lane], lanes[BELOW + lane] = limit, -limit


@inlined
def is_idle(lanes: Floats) -> bool:
    """Whether no lane rocks: all are at rest or have ended."""
    rocking = 0.0
    for lane in range(WIDTH):
        rocking += lanes[LAMBDA + lane]
    return rocking == 0.0


@shared
def next_loud(shaking: Shaking, lanes: Floats, piece: int, pieces: int) -> int:
    """First piece from this one on in which the motion passes the threshold of a lane at rest."""
    above, below = np.inf, -np.inf
    for lane in range(WIDTH):
        above, below = min(above, lanes[ABOVE + lane]), max(below, lanes[BELOW + lane])
    while piece < pieces:
        low, high, _, _ = piece_range(
            shaking.coefficients[piece], 0.0, shaking.breakpoints[piece + 1] - shaking.breakpoints[piece], lanes
        )
        if high > above or low < below:
            break
        piece += 1
    return piece


@shared
def quiet_linear(lanes: Floats, events: Integers, start: float, slope: float, h: float, late: float) -> int:
    """Step all lanes through one sample of the linear model, but mark, count and leave those with an event.

    Samples whose times are rounded are not all of one length: ``late`` is what this one has more than ``h``.
    """
    end = start + slope * h
    above, below = max(start, end), min(start, end)
    busy = 0
    for lane in range(WIDTH):
        u, v, sign, alpha = lanes[U0 + lane], lanes[V0 + lane], lanes[SIGN + lane], lanes[ALPHA + lane]
        z = u - (alpha + sign * start)
        drift = sign * slope
        u1 = u + (lanes[COSH + lane] * z + (lanes[SINH + lane] * v + lanes[LAG + lane] * drift))
        v1 = v + (lanes[SINH_P + lane] * z + lanes[COSH + lane] * (v - drift))
        z1 = u1 - (alpha + sign * end)
        u1 += late * v1
        v1 += late * (lanes[LAMBDA + lane] * z1)
        dip = lanes[CURVE + lane] * max(max(z, z1), 0.0)
        bulge = lanes[CURVE + lane] * max(max(-z, -z1), 0.0)
        event = (
            (min(u, u1) <= dip)
            | ((v > 0.0) & (v1 <= 0.0) & (max(u, u1) + bulge > lanes[HIGHEST + lane]))
            | (u1 >= QUARTER_TURN)
            | (above > lanes[ABOVE + lane])
            | (below < lanes[BELOW + lane])
        )
        lanes[U0 + lane], lanes[V0 + lane] = u if event else u1, v if event else v1
        events[lane] = event
        busy += event
    return busy


@shared
def series_order(sides: Floats, h: float) -> int:
    """Order of the nonlinear lanes' series: enough for the fastest block to double precision."""
    fastest = 0.0
    for lane in range(sides.shape[0]):
        fastest = max(fastest, max(sides[lane, 0, STIFFNESS], sides[lane, 1, STIFFNESS]))
    # Until it falls, a block's rotation changes hardly faster than p.
    x = 1.5 * math.sqrt(fastest) * h
    term = 1.0
    for k in range(1, ORDER):
        term *= x / k
        if term < 2.0**-53:
            return max(4, k + 1)  # the velocity, the sine and the cosine are an order behind
    return ORDER


@shared
def quiet_nonlinear(
    lanes: Floats, series: Floats, events: Integers, start: float, slope: float, h: float, order: int
) -> int:
    """Step all lanes through one sample of the nonlinear model, but mark, count and leave those with an event."""
    end = start + slope * h
    rotation, sine, cosine = series[0], series[1], series[2]
    signs, stiffness = lanes[SIGN : SIGN + WIDTH], lanes[LAMBDA : LAMBDA + WIDTH]
    copy(rotation[0], lanes[U0 : U0 + WIDTH])
    copy(rotation[1], lanes[V0 : V0 + WIDTH])
    copy(sine[0], lanes[S0 : S0 + WIDTH])
    copy(cosine[0], lanes[C0 : C0 + WIDTH])
    for k in range(order - 1):
        accelerate(
            rotation[k + 2], sine[k], cosine[k], cosine[max(k - 1, 0)], signs, stiffness,
            start, slope if k > 0 else 0.0, 1.0 / ((k + 1.0) * (k + 2.0)),
        )  # fmt: skip
        clear(sine[k + 1])
        clear(cosine[k + 1])
        for j in range(k + 1):
            turn(sine[k + 1], cosine[k + 1], rotation[j + 1], sine[k - j], cosine[k - j], (j + 1.0) / (k + 1.0))
    sum_series(lanes[U1 : U1 + WIDTH], rotation, order, h, False)
    sum_series(lanes[V1 : V1 + WIDTH], rotation, order, h, True)
    sum_series(lanes[S1 : S1 + WIDTH], sine, order - 1, h, False)
    sum_series(lanes[C1 : C1 + WIDTH], cosine, order - 1, h, False)
    spread = cosine[0]
    clear(spread)
    for k in range(3, order + 1):
        add_size(spread, rotation[k], k * (k - 1) * h ** (k - 2))
    return mark_nonlinear(lanes, rotation[2], spread, events, max(start, end), min(start, end))


@inlined
def copy(to: Floats, values: Floats) -> None:
    """Copy a row."""
    for lane in range(WIDTH):
        to[lane] = values[lane]


@inlined
def clear(to: Floats) -> None:
    """Set a row to zero."""
    for lane in range(WIDTH):
        to[lane] = 0.0


@inlined
def accelerate(
    to: Floats,
    sine: Floats,
    cosine: Floats,
    cosine_before: Floats,
    signs: Floats,
    stiffness: Floats,
    start: float,
    slope: float,
    weight: float,
) -> None:
    """Next coefficient of the rotation, from those of sin and cos(alpha - u) and of the motion start + slope t."""
    for lane in range(WIDTH):
        push = start * cosine[lane] + slope * cosine_before[lane]
        to[lane] = -weight * stiffness[lane] * (sine[lane] + signs[lane] * push)


@inlined
def turn(to_sine: Floats, to_cosine: Floats, rotation: Floats, sine: Floats, cosine: Floats, weight: float) -> None:
    """One term of the recurrence of sin and cos(alpha - u)."""
    for lane in range(WIDTH):
        rate = weight * rotation[lane]
        to_sine[lane] -= rate * cosine[lane]
        to_cosine[lane] += rate * sine[lane]


@inlined
def sum_series(to: Floats, table: Floats, order: int, h: float, weighted: bool) -> None:
    """Value of every lane's series at h, or (weighted) of its derivative."""
    clear(to)
    for k in range(order, 0 if weighted else -1, -1):
        factor = float(k) if weighted else 1.0
        term = table[k]
        for lane in range(WIDTH):
            to[lane] = to[lane] * h + factor * term[lane]


@inlined
def add_size(to: Floats, values: Floats, factor: float) -> None:
    """Add the sizes of a row, times a factor."""
    for lane in range(WIDTH):
        to[lane] += factor * abs(values[lane])


@inlined
def mark_nonlinear(
    lanes: Floats, half_curvature: Floats, spread: Floats, events: Integers, above: float, below: float
) -> int:
    """Mark and count the lanes that may have an event, and move on the others.

    u'' is twice c2, give or take the sizes of the other terms.
    """
    busy = 0
    for lane in range(WIDTH):
        u, v, u1, v1 = lanes[U0 + lane], lanes[V0 + lane], lanes[U1 + lane], lanes[V1 + lane]
        dip = lanes[CURVE + lane] * max(2.0 * half_curvature[lane] + spread[lane], 0.0)
        bulge = lanes[CURVE + lane] * max(spread[lane] - 2.0 * half_curvature[lane], 0.0)
        event = (
            (min(u, u1) <= dip)
            | ((v > 0.0) & (v1 <= 0.0) & (max(u, u1) + bulge > lanes[HIGHEST + lane]))
            | (u1 >= QUARTER_TURN)
            | (above > lanes[ABOVE + lane])
            | (below < lanes[BELOW + lane])
        )
        if not event:
            lanes[U0 + lane], lanes[V0 + lane] = u1, v1
            lanes[S0 + lane], lanes[C0 + lane] = lanes[S1 + lane], lanes[C1 + lane]
        events[lane] = event
        busy += event
    return busy
