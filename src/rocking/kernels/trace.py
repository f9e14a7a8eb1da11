"""What a response keeps of a march, row by row, and its rotation at any time, from the series of its arcs.

Nothing is written where the rules say so.
"""

from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.kernels.arc import evaluate, expand, sign_of
from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.ground import Ground, start_of
from rocking.kernels.state import AT_REST, NODE_ROW, Record, Records, records

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
    return 0 if side == AT_REST else 1 - 2 * side


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


#: Nodes of a response before its march.
NO_NODES = records(0, NODE_ROW)


class Trail(NamedTuple):
    """What a response is computed again from: the problem and the nodes of its steps."""

    ground: Ground
    block: Record
    rules: Record
    nodes: Records


@kernel
def trace(trail: Trail, scratch: Record, times: Floats, rows: Integers, out: Floats) -> None:
    """Write theta, theta', theta'' at times[k], in the step that starts at trail.nodes[rows[k]], into out[k].

    Between the last resolved impact and rest, or the end of the response, the unresolved ones are left out: the block
    lies still there once its last arc is over.
    """
    ground, block, rules, nodes = trail
    expanded = -1
    order = 0
    for k in range(times.shape[0]):
        row = rows[k]
        node = nodes[row]
        last = row + 1 == nodes.shape[0]
        if node.side == AT_REST:
            out[k, 0] = out[k, 1] = out[k, 2] = 0.0
            continue
        if row != expanded:
            left = np.inf if last else nodes[row + 1].time - node.time
            order, _, _ = expand(ground, block, rules, scratch, node, left)
            expanded = row
        elapsed = max(0.0, times[k] - start_of(ground, node.piece) - node.offset)
        u, v, w = evaluate(scratch.rotation, order, elapsed)
        if u < 0.0 and (last or nodes[row + 1].side == AT_REST):
            u = v = w = 0.0
        sign = sign_of(node.side)
        out[k, 0] = sign * u
        out[k, 1] = sign * v
        out[k, 2] = sign * w
