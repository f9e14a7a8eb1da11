"""What kernels work on, as numpy records; the integer codes that they return; and the rows that a march writes.

Compiled code passes a record by pointer and reads its fields by name. Compiled, an integer code is a plain integer.
"""

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rocking.kernels.compiled import UNCOMPILED, inlined
from rocking.kernels.ground import Ground, start_of

Records = NDArray[np.void]

#: One record of the types below.
Record = Any

#: Highest power in an arc's series; enough for steps of 1/p to full double precision.
ORDER = 22

#: Side of a body at rest. Every negative side is one at rest: see `resting_side`.
AT_REST = -1

#: The value of ``until`` of a march that ends at no piece of the motion.
TO_THE_END = 2**62


class Outcome(IntEnum):
    """What ended one Taylor step."""

    STEP = 0
    IMPACT = 1
    OVERTURN = 2
    #: The time at which the march was to stop is reached.
    STOPPED = 3
    #: The block is balanced on a corner and nothing will ever move it.
    BALANCED = 4
    #: A short step does not decide it; the full series does.
    UNDECIDED = 5
    #: The motion is over, and the body leans for ever, held by its restraints.
    LEANS = 6


class TendonLaw(IntEnum):
    """What a tendon that yields does at present; see `tendon`."""

    ELASTIC = 0
    SLACK = 1
    PLASTIC = 2


class EventKind(IntEnum):
    """Kinds of event in a response."""

    UPLIFT = 0
    REST = 1
    OVERTURN = 2


class RestRule(IntEnum):
    """What is compared with a limit to bring a sequence of impacts to rest; CERTIFIED: a proof, and no limit."""

    CERTIFIED = 0
    VELOCITY = 1
    INTERVAL = 2
    TIME = 3
    #: As VELOCITY, and the time that all further impacts would take is added.
    BYPASS = 4


class Ending(IntEnum):
    """How a march ended. RUNNING, FULL and PAUSED ones can be continued."""

    DONE = 0
    OVERTURNED = 1
    BALANCED = 2
    #: The table has no space left.
    FULL = 3
    #: The piece at which the march was to end is reached.
    RUNNING = 4
    #: The budget of iterations is spent.
    PAUSED = 5
    #: The whole budget of a simulation is spent.
    UNFINISHED = 6
    #: The body leans for ever, held by its restraints.
    LEANS = 7


def _record(**fields: Any) -> np.dtype[np.void]:
    """Type of a record with these fields."""
    return np.dtype(
        [(name, *(kind if isinstance(kind, tuple) else (kind,))) for name, kind in fields.items()], align=True
    )


_SIDES = ("f8", (2,))
_SERIES = ("f8", (ORDER + 2,))

#: A block, side by side: lambda in u'' = lambda u - ...; uplift threshold in g and its gain (the restoring acceleration
#: at zero rotation is gain (threshold + side a/g)); restitution on leaving the side, and the side entered from it; the
#: rotation at which the block has overturned; slenderness, its sine and cosine; limit of a treatment other than the
#: certificate; what restraints add: to the restoring acceleration at zero rotation, over the gain (``hold``); to the
#: weight and to the push of u'', in g; a force of cos(u/2) and one of u, over inertia; damping, c in u'' = ... - c u';
#: whether there is any of these five; and whether the sides are two stops that face each
#: other: each side is then entered from itself, and at ``fallen``, their distance, the body hits the other stop.
#: From ``yielding`` on: whether there is a tendon that yields; of it stiffness times lever arm over inertia, lever arm,
#: what it adds to weight and push where it is elastic, elongations at which it yields and hangs slack; and the values
#: of four fields without it. From ``varying`` on: whether the restitution varies, up to that above; the seed by which
#: it is drawn at each impact, or -1 where it falls with the speed; its least value, and how much it falls per speed.
#: The fields that most iterations of a march read come first, here and below: fewer cache lines are read.
BLOCK = _record(
    stiffness=_SIDES, gain=_SIDES, threshold=_SIDES, hold=_SIDES, restitution=_SIDES, entered=("i8", (2,)),
    fallen="f8", restrained="?", facing="?", slenderness=_SIDES, sine=_SIDES, cosine=_SIDES, limit=_SIDES,
    added_weight=_SIDES, added_push=_SIDES, prestress=_SIDES, spring=_SIDES, damping=_SIDES,
    yielding="?", tendon=_SIDES, opening=_SIDES, tendon_weight=_SIDES, tendon_push=_SIDES, yields="f8", slack="f8",
    base_weight=_SIDES, base_push=_SIDES, base_prestress=_SIDES, base_hold=_SIDES,
    varying="?", seed="i8", least=_SIDES, slope=_SIDES,
)  # fmt: skip

#: How to compute: model, end of chattering (`RestRule`), width of a good bracket (s), when to stop (s), whether that
#: is never, and whether the tables are written or only the state is kept.
RULES = _record(nonlinear="?", treatment="i8", tolerance="f8", stop="f8", endless="?", record="?")

#: The state of a march. ``until`` is the first piece that is not marched through and ``budget`` the number of
#: iterations left; ``run`` counts the impacts since chattering was proven; ``smooth`` marks an uplift that is not a
#: jump; a proof is tried only at a speed below ``proof_speed``; ``stalled`` counts the rests only because time hardly
#: advanced from one impact to the next. ``uplifted`` and ``rested`` are the last such times. ``near_ties`` counts the
#: decisions by the last digits whether a block touches the ground, or to which side it goes without weight. ``law``
#: and ``plastic`` are those of a tendon that yields; ``leaning`` is the rotation about which the body leans at the end.
STATE = _record(
    piece="i8", offset="f8", side="i8", u="f8", v="f8", peak="f8", until="i8", budget="i8",
    run="i8", proof_speed="f8", last_impact_time="f8", impacts="i8", ending="i8", smooth="?", peak_time="f8",
    run_start="f8", uplifted="f8", rested="f8", first_uplift="f8", first_rest="f8", resting="f8", end="f8",
    nodes="i8", events="i8", sequences="i8", uplifts="i8", rests="i8", stalled="i8", near_ties="i8",
    law="i8", plastic="f8", leaning="f8",
)  # fmt: skip

#: A step of a response: the state at its start, as `expand` takes it. Elsewhere a side is +1 or -1, and 0 at rest.
NODE_ROW = _record(time="f8", piece="i8", offset="f8", side="i4", law="i4", u="f8", v="f8")
IMPACT_ROW = _record(time="f8", side="i8", speed_before="f8", speed_after="f8")
EVENT_ROW = _record(time="f8", kind="i8", side="i8")
SEQUENCE_ROW = _record(start="f8", end="f8", lower="f8", upper="f8", impacts="i8")

#: Row k of a march's table holds its k-th node, impact, event and chattering sequence: one array, since kernels pass
#: arrays by value.
TABLE = _record(node=NODE_ROW, impact=IMPACT_ROW, event=EVENT_ROW, sequence=SEQUENCE_ROW)

#: Scratch space: the series of one step; of the ground, the weight, sin and cos(alpha - u), and sin and cos(u/2) about
#: its start; another.
SCRATCH = _record(
    rotation=_SERIES, ground=_SERIES, weight=_SERIES, sine=_SERIES, cosine=_SERIES, other=_SERIES,
    half_sine=_SERIES, half_cosine=_SERIES,
)  # fmt: skip

#: Scratch space of a variation: series of the stiffness, of the forcing and of the variation itself.
VARIATION = _record(stiffness=_SERIES, forcing=_SERIES, change=_SERIES)


def records(count: int, kind: np.dtype[np.void]) -> Records:
    """Zeroed records."""
    return attributed(np.zeros(count, dtype=kind))


def attributed(array: Records) -> Records:
    """Give records as kernels take them: uncompiled ones read fields as attributes, which is slow elsewhere."""
    return array.view(np.recarray) if UNCOMPILED else array


def record(kind: np.dtype[np.void], **values: Any) -> Record:
    """One record with these values."""
    made = records(1, kind)[0]
    for name, value in values.items():
        made[name] = value
    return made


def new_states(count: int, budget: int) -> Records:
    """States of blocks at rest at time zero that march to the end of the motion."""
    states = records(count, STATE)
    states["side"] = AT_REST
    states["until"] = TO_THE_END
    states["ending"] = Ending.RUNNING.value
    states["budget"] = budget
    return states


def state_at(node: Record, plastic: float = 0.0, budget: int = np.iinfo(np.int64).max) -> Record:
    """State of a march that starts at a node, with the plastic elongation of a tendon there."""
    made = new_states(1, budget)[0]
    for name in ("piece", "offset", "side", "u", "v", "law"):
        made[name] = node[name]
    made["peak"], made["plastic"] = node["u"], plastic
    return made


def new_scratch() -> Record:
    """Scratch space for one march at a time."""
    return record(SCRATCH)


def new_table(rows: int) -> Records:
    """Empty table for a first try."""
    return records(rows, TABLE)


def grown(table: Records) -> Records:
    """Table with the same rows and as many more."""
    return attributed(np.concatenate([table, np.zeros_like(table)]))


# ---- Writing rows of a table; nothing is written where the rules say so ----

#: Largest number of impacts of a proven sequence in one iteration of a march, and of rows of one kind that it writes.
PROVEN_PER_ITERATION = 64
_ROWS_PER_ITERATION = PROVEN_PER_ITERATION + 3


@inlined
def has_space(rules: Record, table: Records, state: Record) -> bool:
    """Whether the table has space for what one iteration of the march can write."""
    most = max(max(state.nodes, state.impacts), max(state.events, state.sequences))
    return not rules.record or most + _ROWS_PER_ITERATION <= table.shape[0]


@inlined
def signed(side: int) -> int:
    """Sign of the rotation on a side: +1, -1, and 0 at rest."""
    return 0 if side < 0 else 1 - 2 * side


@inlined
def resting_side(block: Record, side: int) -> int:
    """Side of a body that comes to rest on a side: of two stops that face each other it tells which; see `stop_of`."""
    return -1 - side if block.facing else AT_REST


@inlined
def stop_of(resting: int) -> int:
    """Return the stop at which a body rests whose side is ``resting``; 0 for all but those between two stops."""
    return -1 - resting


@inlined
def write_node(ground: Ground, rules: Record, table: Records, state: Record) -> None:
    """Write the state into the table."""
    if not rules.record:
        return
    row = table[state.nodes].node
    row.time = start_of(ground, state.piece) + state.offset
    row.piece = state.piece
    row.offset = state.offset
    row.side = state.side
    row.u = state.u
    row.v = state.v
    row.law = state.law
    state.nodes += 1


@inlined
def write_event(rules: Record, table: Records, state: Record, time: float, kind: int) -> None:
    """Write an uplift, a rest or an overturning."""
    if rules.record:
        row = table[state.events].event
        row.time = time
        row.kind = kind
        row.side = signed(state.side)
    state.events += 1


@inlined
def write_impact(rules: Record, table: Records, state: Record, time: float, speed: float) -> None:
    """Write the last impact, from the state after it and the speed before."""
    if not rules.record:
        return
    row = table[state.impacts - 1].impact
    row.time = time
    row.side = signed(state.side)
    row.speed_before = speed
    row.speed_after = state.v


@inlined
def write_sequence(rules: Record, table: Records, state: Record, time: float, rest: tuple[float, float, float]) -> None:
    """Write a chattering sequence that ends, from its last impact's time and (lower, upper, time) to rest."""
    lower, upper, to_rest = rest
    if rules.record:
        row = table[state.sequences].sequence
        row.start = state.run_start
        row.end = time + to_rest
        row.lower = time + lower
        row.upper = time + upper
        row.impacts = state.run
    state.sequences += 1
