"""Rotation, velocity and acceleration anywhere in a response, from the series of the arc in which it lies."""

from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.kernels.arc import evaluate, expand, sign_of
from rocking.kernels.compiled import kernel
from rocking.kernels.ground import Ground, start_of
from rocking.kernels.state import AT_REST, NODE_ROW, Record, Records, records

#: Nodes of a response that has not begun.
NO_NODES = records(0, NODE_ROW)


class Trail(NamedTuple):
    """What it takes to follow a response again: the problem and the nodes of its steps."""

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
