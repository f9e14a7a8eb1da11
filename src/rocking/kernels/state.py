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

#: The value of ``stop_piece`` of a march that ends at no piece of the motion.
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
    """Type of a record with these fields, at the offsets of a C struct."""
    return np.dtype(
        [(name, *(kind if isinstance(kind, tuple) else (kind,))) for name, kind in fields.items()], align=True
    )


_SIDES = ("f8", (2,))
_SERIES = ("f8", (ORDER + 2,))

#: A body. Fields of two numbers are of side + and side -; accelerations are in units of g. The fields that most
#: iterations of a march read come first, here and below: fewer cache lines are read.
BLOCK = _record(
    stiffness=_SIDES,  # lambda in u'' = lambda u - ..., 1/s^2
    threshold_slope=_SIDES,  # restoring acceleration at zero rotation per acceleration above the threshold
    threshold=_SIDES,  # ground acceleration that lifts the body, without restraints
    restraint_threshold=_SIDES,  # what restraints add to the threshold
    restitution=_SIDES,  # factor on the speed on leaving the side; the largest where it varies
    next_side=("i8", (2,)),  # side entered from the side
    overturn_angle="f8",  # rotation at which the body has overturned; between two stops their distance
    restrained="?",  # whether added_weight to damping, or restraint_threshold, are not all zero
    two_stops="?",  # whether the sides are two stops that face each other
    slenderness=_SIDES,  # alpha, rad
    sine=_SIDES,  # of alpha
    cosine=_SIDES,  # of alpha
    limit=_SIDES,  # of a treatment of chattering other than the certificate
    added_weight=_SIDES,  # what restraints add to the weight
    added_push=_SIDES,  # what restraints add to the push
    prestress=_SIDES,  # restraining force of cos(u/2) over inertia, 1/s^2
    spring=_SIDES,  # restraining force of u over inertia, 1/s^2
    damping=_SIDES,  # c in u'' = ... - c u', 1/s
    yielding="?",  # whether there is a tendon that yields
    tendon=_SIDES,  # its stiffness times lever arm over inertia
    lever_arm=_SIDES,  # its distance from the pivot, m
    tendon_weight=_SIDES,  # what it adds to the weight where it is elastic
    tendon_push=_SIDES,  # what it adds to the push where it is elastic
    yields="f8",  # elongation at which it yields, m
    slack="f8",  # elongation at which it hangs slack, m
    base_weight=_SIDES,  # added_weight without it
    base_push=_SIDES,  # added_push without it
    base_prestress=_SIDES,  # prestress without it
    base_restraint_threshold=_SIDES,  # restraint_threshold without it
    variable_restitution="?",  # whether the restitution varies
    seed="i8",  # by which it is drawn at each impact; -1 where it falls with the speed
    min_restitution=_SIDES,  # its least value
    restitution_slope=_SIDES,  # how much it falls per speed, s/rad
)

#: How to compute.
SETTINGS = _record(
    nonlinear="?",  # model
    treatment="i8",  # end of chattering, a `RestRule`
    tolerance="f8",  # width of a good bracket on the time of rest, s
    stop="f8",  # time to stop at, s
    no_end_time="?",  # whether that is infinite
    record="?",  # whether the tables are written, or only the state is kept
)

#: The state of a march.
STATE = _record(
    piece="i8",  # present piece of the motion
    offset="f8",  # time since its start, s
    side="i8",  # 0 is side +, 1 side -; negative at rest
    u="f8",  # rotation in the frame of the side
    v="f8",  # its rate
    peak="f8",  # highest rotation so far
    stop_piece="i8",  # first piece that is not marched through
    budget="i8",  # iterations left
    proven_impacts="i8",  # impacts since chattering was proven
    certificate_speed="f8",  # speed below which the next proof is tried
    last_impact_time="f8",  # of the last impact or uplift
    impacts="i8",  # number so far
    ending="i8",  # an `Ending`
    continuous_uplift="?",  # whether the body has just been lifted, and not by a jump
    peak_time="f8",  # time of the peak
    run_start="f8",  # time at which chattering was proven
    last_uplift_time="f8",
    last_rest_time="f8",
    first_uplift="f8",  # times; 0 without one
    first_rest="f8",
    time_at_rest="f8",  # all together
    end="f8",  # time at which the march ended
    nodes="i8",  # rows of the table written
    events="i8",
    sequences="i8",
    uplifts="i8",  # number so far
    rests="i8",
    rests_by_rounding="i8",  # rests only because time hardly advanced from one impact to the next
    rounding_decisions="i8",  # whether a block touches the ground, or to which side it goes without weight
    law="i8",  # of a tendon that yields, a `TendonLaw`
    plastic="f8",  # its plastic elongation, m
    leaning="f8",  # rotation about which the body leans at the end
)

#: A step of a response: the state at its start, as `expand` takes it. Elsewhere a side is +1 or -1, and 0 at rest.
NODE_ROW = _record(time="f8", piece="i8", offset="f8", side="i4", law="i4", u="f8", v="f8")
IMPACT_ROW = _record(time="f8", side="i8", speed_before="f8", speed_after="f8")
EVENT_ROW = _record(time="f8", kind="i8", side="i8")
SEQUENCE_ROW = _record(start="f8", end="f8", lower="f8", upper="f8", impacts="i8")

#: Row k of a march's table holds its k-th node, impact, event and chattering sequence: one array, since kernels pass
#: arrays by value.
TABLE = _record(node=NODE_ROW, impact=IMPACT_ROW, event=EVENT_ROW, sequence=SEQUENCE_ROW)

#: Scratch space: series of one step about its start.
SCRATCH = _record(
    rotation=_SERIES,
    ground=_SERIES,  # acceleration of the ground
    weight=_SERIES,
    sine=_SERIES,  # of alpha - u
    cosine=_SERIES,
    other=_SERIES,  # space for another series
    half_sine=_SERIES,  # of u/2
    half_cosine=_SERIES,
)

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
    states["stop_piece"] = TO_THE_END
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


# ---- Writing rows of a table; nothing is written where the settings say so ----

#: Largest number of impacts of a proven sequence in one iteration of a march, and of rows of one kind that it writes.
PROVEN_PER_ITERATION = 64
_ROWS_PER_ITERATION = PROVEN_PER_ITERATION + 3


@inlined
def has_space(settings: Record, table: Records, state: Record) -> bool:
    """Whether the table has space for what one iteration of the march can write."""
    most = max(max(state.nodes, state.impacts), max(state.events, state.sequences))
    return not settings.record or most + _ROWS_PER_ITERATION <= table.shape[0]


@inlined
def signed(side: int) -> int:
    """Sign of the rotation on a side: +1, -1, and 0 at rest."""
    return 0 if side < 0 else 1 - 2 * side


@inlined
def resting_side(block: Record, side: int) -> int:
    """Side of a body that comes to rest on a side: of two stops that face each other it tells which; see `stop_of`."""
    return -1 - side if block.two_stops else AT_REST


@inlined
def stop_of(resting: int) -> int:
    """Return the stop at which a body rests whose side is ``resting``; 0 for all but those between two stops."""
    return -1 - resting


@inlined
def write_node(ground: Ground, settings: Record, table: Records, state: Record) -> None:
    """Write the state into the table."""
    if not settings.record:
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
def write_event(settings: Record, table: Records, state: Record, time: float, kind: int) -> None:
    """Write an uplift, a rest or an overturning."""
    if settings.record:
        row = table[state.events].event
        row.time = time
        row.kind = kind
        row.side = signed(state.side)
    state.events += 1


@inlined
def write_impact(settings: Record, table: Records, state: Record, time: float, speed: float) -> None:
    """Write the last impact, from the state after it and the speed before."""
    if not settings.record:
        return
    row = table[state.impacts - 1].impact
    row.time = time
    row.side = signed(state.side)
    row.speed_before = speed
    row.speed_after = state.v


@inlined
def write_sequence(
    settings: Record, table: Records, state: Record, time: float, rest: tuple[float, float, float]
) -> None:
    """Write a chattering sequence that ends, from its last impact's time and (lower, upper, time) to rest."""
    lower, upper, to_rest = rest
    if settings.record:
        row = table[state.sequences].sequence
        row.start = state.run_start
        row.end = time + to_rest
        row.lower = time + lower
        row.upper = time + upper
        row.impacts = state.proven_impacts
    state.sequences += 1
