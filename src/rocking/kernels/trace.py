"""Rotation, velocity and acceleration anywhere in a response, from the series of the arc in which it lies."""

import numpy as np

from rocking.kernels.arc import evaluate
from rocking.kernels.compiled import kernel
from rocking.kernels.impact import expand
from rocking.kernels.state import SERIES, Floats, Integers, Trail


@kernel
def trace(trail: Trail, scratch: Floats, times: Floats, rows: Integers, out: Floats) -> None:
    """Write theta, theta', theta'' at times[k], in the step that starts at trail.nodes[rows[k]], into out[k].

    Between the last resolved impact and rest, or the end of the response, the unresolved ones are left out: the block
    lies still there once its last arc is over.
    """
    shaking, sides, rules, nodes = trail.shaking, trail.sides, trail.rules, trail.nodes
    expanded = -1
    order = 0
    for k in range(times.shape[0]):
        row = rows[k]
        sign = nodes[row, 3]
        last = row + 1 == nodes.shape[0]
        if sign == 0.0:
            out[k, 0] = out[k, 1] = out[k, 2] = 0.0
            continue
        piece = int(nodes[row, 1])
        if row != expanded:
            left = np.inf if last else nodes[row + 1, 0] - nodes[row, 0]
            side = 0 if sign > 0.0 else 1
            order, _, _ = expand(
                shaking, sides, rules, scratch, side, piece, nodes[row, 2], nodes[row, 4], nodes[row, 5], left
            )
            expanded = row
        elapsed = max(0.0, times[k] - shaking.breakpoints[piece] - nodes[row, 2])
        u, v, w = evaluate(scratch[SERIES], order, elapsed)
        if u < 0.0 and (last or nodes[row + 1, 3] == 0.0):
            u = v = w = 0.0
        out[k, 0] = sign * u
        out[k, 1] = sign * v
        out[k, 2] = sign * w
