"""Impacts of a sequence that is proven to end at rest: one after the other, with nothing to decide between them."""

from rocking.kernels.arc import restoring, sign_of
from rocking.kernels.compiled import shared
from rocking.kernels.ground import Ground, acceleration, coefficient, start_of
from rocking.kernels.remaining import proven_arc
from rocking.kernels.state import Record, Records
from rocking.kernels.tables import PROVEN_A_TURN, write_impact, write_node


@shared
def pass_proven_impacts(
    ground: Ground, block: Record, rules: Record, table: Records, state: Record, left: float
) -> None:
    """Take the linear model through some impacts within ``left``, up to the one that is worth another proof.

    Under a ground acceleration that changes evenly; the state is one just after an impact.
    """
    rate = coefficient(ground, state.piece, 1)
    end = state.offset + left
    for _ in range(PROVEN_A_TURN):
        side, v = state.side, state.v
        g = restoring(block, side, acceleration(ground, state.piece, state.offset))
        t, speed = proven_arc(v, g, block.gain[side] * sign_of(side) * rate, block.stiffness[side])
        slower = block.restitution[side] * speed
        # The arc lies below its first tangent.
        if not (t < end - state.offset and slower > state.worth and v * t <= state.peak):
            return
        state.side = block.entered[side]
        state.v = slower
        state.offset += t
        state.struck = start_of(ground, state.piece) + state.offset
        state.impacts += 1
        state.run += 1
        state.budget -= 1
        write_impact(rules, table, state, state.struck, speed)
        write_node(ground, rules, table, state)
