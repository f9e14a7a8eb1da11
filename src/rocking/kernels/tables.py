"""What a response keeps of a march, row by row; nothing where the rules say that nothing is recorded."""

from rocking.kernels.compiled import inlined
from rocking.kernels.ground import Ground, start_of
from rocking.kernels.state import AT_REST, Record, Records

#: Impacts of a proven sequence that a turn of the march passes at most, and rows of one kind that it writes at most.
PROVEN_A_TURN = 64
_ROWS_A_TURN = PROVEN_A_TURN + 3


@inlined
def has_room(rules: Record, table: Records, state: Record) -> bool:
    """Whether the table has room for what one turn of the march can write."""
    most = max(max(state.nodes, state.impacts), max(state.events, state.sequences))
    return not rules.record or most + _ROWS_A_TURN <= table.shape[0]


@inlined
def signed(side: int) -> int:
    """Sign of the rotation on a side: +1, -1, and 0 at rest."""
    return 0 if side == AT_REST else 1 - 2 * side


@inlined
def write_node(ground: Ground, rules: Record, table: Records, state: Record) -> None:
    """Write down the state."""
    if not rules.record:
        return
    row = table[state.nodes].node
    row.time = start_of(ground, state.piece) + state.offset
    row.piece = state.piece
    row.offset = state.offset
    row.side = state.side
    row.u = state.u
    row.v = state.v
    state.nodes += 1


@inlined
def write_event(rules: Record, table: Records, state: Record, time: float, kind: int) -> None:
    """Write down an uplift, a rest or an overturning."""
    if rules.record:
        row = table[state.events].event
        row.time = time
        row.kind = kind
        row.side = signed(state.side)
    state.events += 1


@inlined
def write_impact(rules: Record, table: Records, state: Record, time: float, speed: float) -> None:
    """Write down the last impact, from the state after it and the speed before."""
    if not rules.record:
        return
    row = table[state.impacts - 1].impact
    row.time = time
    row.side = signed(state.side)
    row.speed_before = speed
    row.speed_after = state.v


@inlined
def write_sequence(rules: Record, table: Records, state: Record, time: float, rest: tuple[float, float, float]) -> None:
    """Write down a chattering sequence that ends, from its last impact's time and (lower, upper, time) to rest."""
    lower, upper, to_rest = rest
    if rules.record:
        row = table[state.sequences].sequence
        row.start = state.run_start
        row.end = time + to_rest
        row.lower = time + lower
        row.upper = time + upper
        row.impacts = state.run
    state.sequences += 1
