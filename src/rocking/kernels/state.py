"""Structs on which kernels operate, integer codes that they return, and rows that a march writes.

Compiled code passes structs by pointer, reads fields by name, and treats codes as plain integers.
"""

import math
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Integers
from rocking.kernels.compiled import UNCOMPILED, inlined
from rocking.kernels.ground import Ground, piece_start

Structs = NDArray[np.void]

#: Single struct of one of the types below.
Struct = Any

#: Highest power in an arc's series, sufficient for steps of 1/p in full double precision.
ORDER = 22

#: Side of a body at rest. Every negative side denotes rest: see `encode_resting_side`.
AT_REST = -1

#: Value of ``stop_piece`` of a march without a final piece.
NO_STOP_PIECE = 2**62


class StepOutcome(IntEnum):
    """Event that ended one Taylor step."""

    STEP = 0
    IMPACT = 1
    OVERTURN = 2
    #: Stop time reached.
    STOPPED = 3
    #: Balanced on a corner forever.
    BALANCED = 4
    #: Inconclusive short step: the full series is required.
    UNDECIDED = 5
    #: The body leans forever after the motion, held by restraints.
    LEANS = 6
    #: The foot starts or ceases to slip; the ground no longer presses on it.
    SLIPS = 7
    STICKS = 8
    LOST = 9


class TendonLaw(IntEnum):
    """Present law of a tendon that yields; see `restraints`."""

    ELASTIC = 0
    SLACK = 1
    PLASTIC = 2


class EventKind(IntEnum):
    """Kind of an event in a response."""

    UPLIFT = 0
    REST = 1
    OVERTURN = 2
    #: Slip on both pivots, end of a slip on one pivot, and slip on one pivot.
    SLIDE = 3
    STICK = 4
    SLIDE_ROCK = 5
    #: Contact lost.
    LOST = 6


class RestRule(IntEnum):
    """Quantity whose limit ends a sequence of impacts; CERTIFIED requires a proof instead of a limit."""

    CERTIFIED = 0
    VELOCITY = 1
    INTERVAL = 2
    TIME = 3
    #: As VELOCITY, plus the duration of all further impacts.
    BYPASS = 4


class MarchStatus(IntEnum):
    """Reason why a march ended; RUNNING, FULL and PAUSED marches can be continued."""

    DONE = 0
    OVERTURNED = 1
    BALANCED = 2
    #: Table full.
    FULL = 3
    #: Final piece reached.
    RUNNING = 4
    #: Budget of iterations spent.
    PAUSED = 5
    #: Budget of the simulation spent.
    UNFINISHED = 6
    #: The body leans forever, held by restraints.
    LEANS = 7
    #: The body loses contact with the ground.
    LOST = 8


def define_struct(**fields: Any) -> np.dtype[np.void]:
    """Return the type of a struct with these fields, at the same offsets on every platform.

    They are those of a C struct whose numbers are aligned to their sizes. Some 32-bit platforms align numbers of eight
    bytes to four.
    """
    types = [np.dtype(kind) for kind in fields.values()]
    offsets, end = [], 0
    for kind in types:
        alignment = 8 if kind.names else kind.base.itemsize
        offsets.append(math.ceil(end / alignment) * alignment)
        end = offsets[-1] + kind.itemsize
    size = math.ceil(end / 8) * 8
    layout: Any = {"names": [*fields], "formats": types, "offsets": offsets, "itemsize": size}
    return np.dtype(layout, align=True)


_SIDES = ("f8", (2,))
_SERIES = ("f8", (ORDER + 2,))

#: Body. Fields of two numbers refer to side + and side -; accelerations are in units of g. In all structs the most used
#: fields come first, so that fewer cache lines are read.
BLOCK_DTYPE = define_struct(
    stiffness=_SIDES,  # lambda in u'' = lambda u - ..., 1/s^2
    restoring_gain=_SIDES,  # restoring acceleration at zero rotation per acceleration above the threshold
    threshold=_SIDES,  # ground acceleration at uplift without restraints
    restraint_threshold=_SIDES,  # added to the threshold by restraints
    restitution=_SIDES,  # factor on the speed on leaving the side; the largest one if it varies
    next_side=("i8", (2,)),  # side entered from this side
    overturn_angle="f8",  # rotation at overturning, or distance of two stops
    restrained="?",  # whether added_weight to damping, or restraint_threshold, is nonzero
    two_stops="?",  # whether the sides are two facing stops
    slenderness=_SIDES,  # alpha, rad
    sine=_SIDES,  # of alpha
    cosine=_SIDES,  # of alpha
    rest_limit=_SIDES,  # limit of a `RestRule`
    added_weight=_SIDES,  # added to the weight by restraints
    added_push=_SIDES,  # added to the push by restraints
    prestress=_SIDES,  # restraining force of cos(u/2) divided by inertia, 1/s^2
    spring=_SIDES,  # restraining force of u divided by inertia, 1/s^2
    damping=_SIDES,  # c in u'' = ... - c u', 1/s
    yielding="?",  # whether a tendon yields
    tendon_stiffness=_SIDES,  # stiffness of the tendon times its lever arm divided by inertia
    lever_arm=_SIDES,  # distance of the tendon from the pivot, m
    tendon_weight=_SIDES,  # added to the weight by the elastic tendon
    tendon_push=_SIDES,  # added to the push by the elastic tendon
    yield_elongation="f8",  # elongation at which the tendon yields, m
    slack_elongation="f8",  # elongation below which the tendon is slack, m
    base_weight=_SIDES,  # added_weight without the tendon
    base_push=_SIDES,  # added_push without the tendon
    base_prestress=_SIDES,  # prestress without the tendon
    base_restraint_threshold=_SIDES,  # restraint_threshold without the tendon
    variable_restitution="?",  # whether the restitution varies
    seed="i8",  # seed of the draws; -1 if the restitution decreases with the speed
    min_restitution=_SIDES,  # smallest restitution
    restitution_slope=_SIDES,  # decrease of the restitution per speed, s/rad
    has_friction="?",  # whether the body may slip
    static_friction="f8",  # coefficient of friction without slip
    kinetic_friction="f8",  # coefficient of friction while slipping
    arm_over_g=_SIDES,  # distance of the centre of mass from the pivot, linear model: its height, divided by g, s^2
    inertia_ratio=_SIDES,  # square of that distance divided by the square of the radius of gyration
    pivot_distance_over_g=_SIDES,  # horizontal distance of the centre of mass from the pivot divided by g, s^2
    height_over_g="f8",  # height of the centre of mass divided by g, s^2
    sticking_push=_SIDES,  # push below which a body sticks up to twice its slenderness, without speed
    sticking_slope=_SIDES,  # decrease of that push per square of the speed, s^2
)

#: Settings of the computation.
SETTINGS_DTYPE = define_struct(
    nonlinear="?",  # whether the model is nonlinear
    rest_rule="i8",  # `RestRule` that ends chattering
    tolerance="f8",  # largest accepted width of a bracket on the time of rest, s
    stop_time="f8",  # time at which to stop, s
    no_end_time="?",  # whether the stop time is infinite
    writes_tables="?",  # whether to write the tables, or only the state
)

#: State of a march.
STATE_DTYPE = define_struct(
    piece="i8",  # present piece of the motion
    offset="f8",  # time since the start of the piece, s
    side="i8",  # 0 for side +, 1 for side -; negative at rest
    u="f8",  # rotation in the frame of the side
    v="f8",  # rate of u
    peak="f8",  # largest rotation so far
    stop_piece="i8",  # first piece beyond the march
    budget="i8",  # remaining iterations
    proven_impacts="i8",  # impacts since chattering was proven
    certificate_speed="f8",  # speed below which another proof is attempted
    last_impact_time="f8",  # time of the last impact or uplift, s
    impact_count="i8",  # number of impacts so far
    status="i8",  # a `MarchStatus`
    continuous_uplift="?",  # whether the body has just been lifted without a jump
    peak_time="f8",  # time of the largest rotation, s
    sequence_start="f8",  # time since which chattering is proven, s
    last_uplift_time="f8",  # time of the last uplift, s
    last_rest_time="f8",  # time of the last rest, s
    first_uplift="f8",  # time of the first uplift, s; 0 without one
    first_rest="f8",  # time of the first rest, s; 0 without one
    time_at_rest="f8",  # total time at rest, s
    end_time="f8",  # time at which the march ended, s
    node_count="i8",  # number of nodes written to the table
    event_count="i8",  # number of events written to the table
    sequence_count="i8",  # number of sequences written to the table
    uplift_count="i8",  # number of uplifts so far
    rest_count="i8",  # number of rests so far
    rests_by_rounding="i8",  # number of rests because time hardly advanced between impacts
    rounding_decisions="i8",  # number of contacts, or sides of uplift without weight, decided by rounding
    tendon_law="i8",  # `TendonLaw` of a tendon that yields
    plastic_elongation="f8",  # plastic elongation of the tendon, m
    leaning_rotation="f8",  # rotation about which the body leans at the end
    direction="i8",  # sign of the velocity of the foot; 0 if it sticks
    slip="f8",  # displacement of the foot relative to the ground divided by g, s^2
    slip_rate="f8",  # its rate, s
    largest_slip="f8",  # largest absolute displacement so far
)

#: Step of a response: state at its start (see `STATE_DTYPE`) and time, for `expand_arc`.
NODE_DTYPE = define_struct(
    time="f8",
    piece="i8",
    offset="f8",
    side="i4",
    tendon_law="i4",
    u="f8",
    v="f8",
    slip="f8",
    slip_rate="f8",
    direction="i8",
)

#: Impact: time, side entered (+1 or -1), speeds before and after.
IMPACT_DTYPE = define_struct(time="f8", side="i8", speed_before="f8", speed_after="f8")

#: Event: time, `EventKind`, side (+1 or -1; 0 at rest).
EVENT_DTYPE = define_struct(time="f8", kind="i8", side="i8")

#: Chattering sequence: time since which it is proven, time of rest with bounds, number of impacts in between.
SEQUENCE_DTYPE = define_struct(start="f8", end="f8", lower="f8", upper="f8", impacts="i8")

#: Row k contains the k-th node, impact, event and chattering sequence of a march: one array, because kernels pass
#: arrays by value.
TABLE_DTYPE = define_struct(node=NODE_DTYPE, impact=IMPACT_DTYPE, event=EVENT_DTYPE, sequence=SEQUENCE_DTYPE)

#: Scratch space: series of one step about its start.
SCRATCH_DTYPE = define_struct(
    rotation=_SERIES,  # u
    ground=_SERIES,  # push: acceleration of the ground in the frame of the side, in units of g
    weight=_SERIES,  # weight divided by the weight at rest
    sine=_SERIES,  # sin(alpha - u)
    cosine=_SERIES,  # cos(alpha - u)
    auxiliary=_SERIES,  # space for another series
    half_sine=_SERIES,  # sin(u/2)
    half_cosine=_SERIES,  # cos(u/2)
    horizontal=_SERIES,  # velocity of the foot, or the horizontal force without slip, in the frame of the side
    normal=_SERIES,  # normal force
    undivided_normal=_SERIES,  # normal force times divisor
    squares=_SERIES,  # square of u'
    lever=_SERIES,  # b of `sliding`
    divisor=_SERIES,  # 1 + (R^2/k^2) sin(alpha - u) b
)

#: Scratch space of a variation: series of the stiffness, the forcing and the variation itself.
VARIATION_DTYPE = define_struct(stiffness=_SERIES, forcing=_SERIES, rotation=_SERIES)


def create_structs(count: int, kind: np.dtype[np.void]) -> Structs:
    """Return zeroed structs."""
    return expose_fields(np.zeros(count, dtype=kind))


def expose_fields(array: Structs) -> Structs:
    """Let kernels that Python runs read fields as attributes, which is slow elsewhere."""
    return array.view(np.recarray) if UNCOMPILED else array


def replace_structs(structs: Structs, indices: Integers, values: Structs) -> None:
    """Replace some of the structs (assignment would copy field by field, which takes 15 times as long)."""
    raw = np.dtype((np.void, structs.itemsize))
    structs.view(raw)[indices] = values.view(raw)


def create_struct(kind: np.dtype[np.void], **values: Any) -> Struct:
    """Return one struct with these values."""
    row = create_structs(1, kind)[0]
    for name, value in values.items():
        row[name] = value
    return row


def create_states(count: int, budget: int) -> Structs:
    """Return states of blocks at rest at time zero that march to the end of the motion."""
    states = create_structs(count, STATE_DTYPE)
    states["side"] = AT_REST
    states["stop_piece"] = NO_STOP_PIECE
    states["status"] = MarchStatus.RUNNING.value
    states["budget"] = budget
    return states


def create_state_at_node(node: Struct, plastic_elongation: float = 0.0, budget: int = np.iinfo(np.int64).max) -> Struct:
    """Return the state of a march that starts at a node, with the plastic elongation of a tendon there."""
    state = create_states(1, budget)[0]
    for name in ("piece", "offset", "side", "u", "v", "tendon_law", "slip", "slip_rate", "direction"):
        state[name] = node[name]
    state["peak"], state["plastic_elongation"] = node["u"], plastic_elongation
    return state


def create_scratch() -> Struct:
    """Return scratch space for one march at a time."""
    return create_struct(SCRATCH_DTYPE)


def create_table(rows: int) -> Structs:
    """Return a table with empty rows."""
    return create_structs(rows, TABLE_DTYPE)


def enlarge_table(table: Structs) -> Structs:
    """Return a table with the same rows followed by as many empty ones."""
    return expose_fields(np.concatenate([table, np.zeros_like(table)]))


# ---- Rows of a table, which are written only if the settings require them ----

#: Largest number of impacts of a proven sequence in one iteration of a march, and of rows of each kind that it writes.
PROVEN_PER_ITERATION = 64
_ROWS_PER_ITERATION = PROVEN_PER_ITERATION + 3


@inlined
def has_space(settings: Struct, table: Structs, state: Struct) -> bool:
    """Return whether the table has space for one iteration of the march."""
    max_rows = max(max(state.node_count, state.impact_count), max(state.event_count, state.sequence_count))
    return not settings.writes_tables or max_rows + _ROWS_PER_ITERATION <= table.shape[0]


@inlined
def signed_side(side: int) -> int:
    """Return the sign of the rotation on a side: +1, -1, or 0 at rest."""
    return 0 if side < 0 else 1 - 2 * side


@inlined
def encode_resting_side(block: Struct, side: int) -> int:
    """Return the side of a body at rest on a side, which identifies one of two facing stops."""
    return -1 - side if block.two_stops else AT_REST


@inlined
def find_stop_of_resting_side(resting: int) -> int:
    """Return the stop at which a body rests (0 without two stops); ``resting`` is its `encode_resting_side`."""
    return -1 - resting


@inlined
def write_node(ground: Ground, settings: Struct, table: Structs, state: Struct) -> None:
    """Write the state."""
    if not settings.writes_tables:
        return
    row = table[state.node_count].node
    row.time = piece_start(ground, state.piece) + state.offset
    row.piece = state.piece
    row.offset = state.offset
    row.side = state.side
    row.u = state.u
    row.v = state.v
    row.tendon_law = state.tendon_law
    row.slip = state.slip
    row.slip_rate = state.slip_rate
    row.direction = state.direction
    state.node_count += 1


@inlined
def write_event(settings: Struct, table: Structs, state: Struct, time: float, kind: int) -> None:
    """Write an uplift, rest or overturning."""
    if settings.writes_tables:
        row = table[state.event_count].event
        row.time = time
        row.kind = kind
        row.side = signed_side(state.side)
    state.event_count += 1


@inlined
def write_impact(settings: Struct, table: Structs, state: Struct, time: float, speed: float) -> None:
    """Write the last impact, from the state after it and the speed before."""
    if not settings.writes_tables:
        return
    row = table[state.impact_count - 1].impact
    row.time = time
    row.side = signed_side(state.side)
    row.speed_before = speed
    row.speed_after = state.v


@inlined
def write_sequence(
    settings: Struct, table: Structs, state: Struct, time: float, bounds: tuple[float, float, float]
) -> None:
    """Write a finished chattering sequence.

    ``time``: last impact; ``bounds``: (lower, upper, time) to rest.
    """
    lower, upper, time_to_rest = bounds
    if settings.writes_tables:
        row = table[state.sequence_count].sequence
        row.start = state.sequence_start
        row.end = time + time_to_rest
        row.lower = time + lower
        row.upper = time + upper
        row.impacts = state.proven_impacts
    state.sequence_count += 1
