"""What a march carries along: the problem, its state, its tables and its scratch space, as plain arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Highest power in an arc's series; enough for steps of 1/p to full double precision.
ORDER = 22


class Shaking(NamedTuple):
    """The ground motion: its pieces (s, m/s^2), 1/g, and its approximation error in units of g."""

    breakpoints: Floats
    coefficients: Floats
    inverse_g: float
    error: float


class Rules(NamedTuple):
    """How to compute: model, end of chattering (see `status`), width of a good bracket (s), when to stop (s).

    ``record`` says whether the tables are written and variations carried, or only the state is kept.
    """

    nonlinear: bool
    treatment: int
    tolerance: float
    stop: float
    endless: bool
    record: bool


class Tables(NamedTuple):
    """What a march writes down, one row each.

    nodes (n, 6) : time, piece, offset, side (+1, -1; 0 at rest), u, u'
    impacts (n, 5) : time, side entered, speed before, speed after, shift of the time per unit of scaling
    events (n, 4) : time, kind, side, shift
    sequences (n, 5) : start, end, lower, upper, impacts
    """

    nodes: Floats
    impacts: Floats
    events: Floats
    sequences: Floats


class Trail(NamedTuple):
    """What it takes to follow a response again: the problem and the nodes of its steps."""

    shaking: Shaking
    sides: Floats
    rules: Rules
    nodes: Floats


class Scratch(NamedTuple):
    """Room for the series of one step: rotation, motion, sine, cosine, and a spare one."""

    c: Floats
    A: Floats
    S: Floats
    C: Floats
    d: Floats


# Columns of a block's side (rows: side +, side -): p^2, alpha, uplift threshold in g, its gain (see `chatter`),
# restitution, and the limit of a treatment other than the certificate.
STIFFNESS, SLENDERNESS, THRESHOLD, GAIN, RESTITUTION, LIMIT = range(6)

# Integers of the state. RUN counts the impacts since chattering was proven, SMOOTH marks an uplift that is not a
# jump, STALLED counts the rests brought about only because time hardly advanced from one impact to the next.
PIECE, SIDE, NODES, IMPACTS, EVENTS, SEQUENCES, RUN, SMOOTH, STALLED, UPLIFTS = range(10)

# Floats of the state: position in the motion, rotation, its rate, their variations, times of the last uplift, impact
# and proof, the speed below which a proof is worth trying, the highest rotation so far, the end.
OFFSET, U, V, DU, DV, UPLIFTED, STRUCK, RESTED, RESTING, RUN_START, WORTH, PEAK, PEAK_TIME, PEAK_CHANGE, END = range(15)

#: Side index of a block at rest.
AT_REST = -1


def new_state() -> tuple[Integers, Floats]:
    """State of a block at rest at time zero."""
    at, x = np.zeros(UPLIFTS + 1, dtype=np.int64), np.zeros(END + 1)
    at[SIDE] = AT_REST
    return at, x


def new_scratch(columns: int) -> Scratch:
    """Scratch space for motions with that many coefficients in a piece."""
    size = max(ORDER + 1, columns + 2)
    return Scratch(*(np.zeros(size) for _ in Scratch._fields))


def new_tables(nodes: int) -> Tables:
    """Empty tables for a first try."""
    return Tables(np.empty((nodes, 6)), np.empty((256, 5)), np.empty((16, 4)), np.empty((8, 5)))


def grown(tables: Tables) -> Tables:
    """Tables with twice the room and the same rows."""
    return Tables(*(np.concatenate([table, np.empty_like(table)]) for table in tables))
