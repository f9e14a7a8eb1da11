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


class Trail(NamedTuple):
    """What it takes to follow a response again: the problem and the nodes of its steps."""

    shaking: Shaking
    sides: Floats
    rules: Rules
    nodes: Floats


# Kernels pass their arrays by value, so what belongs together is one array: many in a tuple cost more than an arc.

# A march's tables, shape (4, n, 6), one row each. Nodes: time, piece, offset, side (+1, -1; 0 at rest), u, u'.
# Impacts: time, side entered, speed before, speed after, shift of the time per unit of scaling. Events: time, kind,
# side, shift. Sequences: start, end, lower, upper, impacts.
NODE_TABLE, IMPACT_TABLE, EVENT_TABLE, SEQUENCE_TABLE = range(4)

# Scratch space, shape (5, n): the series of one step (rotation, ground, sine, cosine) and a spare one.
SERIES, GROUND, SINE, COSINE, SPARE = range(5)

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


def new_states(count: int) -> tuple[Integers, Floats]:
    """States of many blocks at rest at time zero, one row each."""
    at, x = np.zeros((count, UPLIFTS + 1), dtype=np.int64), np.zeros((count, END + 1))
    at[:, SIDE] = AT_REST
    return at, x


def new_scratch(columns: int) -> Floats:
    """Scratch space for motions with that many coefficients in a piece."""
    return np.zeros((SPARE + 1, max(ORDER + 1, columns + 2)))


def new_tables(rows: int) -> Floats:
    """Empty tables for a first try."""
    return np.empty((SEQUENCE_TABLE + 1, rows, 6))


def grown(tables: Floats) -> Floats:
    """Tables with twice the room and the same rows."""
    return np.concatenate([tables, np.empty_like(tables)], axis=1)
