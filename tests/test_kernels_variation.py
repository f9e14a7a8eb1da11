"""The variation at a rest against differences between neighbouring rests."""

from dataclasses import replace

import numpy as np
import pytest
from kernel_records import Pair, block_of, ground_of, rules_for
from oracles import multiprecision
from oracles.problem import Problem

from rocking.kernels import state
from rocking.kernels.arc import restoring
from rocking.kernels.state import Record
from rocking.kernels.trace import Quantity, Trail, rest_shift


def node_of(side: int, u: float, v: float, time: float = 0.0) -> Record:
    return state.record(state.NODE_ROW, time=time, piece=0, offset=time, side=side, u=u, v=v)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize(
    "what", [Quantity.MOTION, Quantity.VELOCITY, Quantity.FREQUENCY, Quantity.SLENDERNESS, Quantity.RESTITUTION]
)
def test_the_shift_of_the_rest_is_its_derivative_by_what_is_changed(model: str, side: int, what: int) -> None:
    """To first order in the speed, for any shift of the impact and any change of the speed after it."""
    problem = Problem(model, (2.0, 3.0), (0.2, 0.15), (0.7, 0.5), np.array([0.0, 50.0]), np.array([[0.4, 0.9]]))
    start, v, shift, faster, step = 1.0, 1e-6, 0.3, 2e-6, 1e-7

    def scaled(values: Pair, which: int, strength: float) -> Pair:
        return tuple(x * (1.0 + strength) if what == which else x for x in values)

    def rest(strength: float) -> multiprecision.Number:
        changed = replace(
            problem,
            coefficients=problem.coefficients * (1.0 + strength if what == Quantity.MOTION else 1.0),
            p=scaled(problem.p, Quantity.FREQUENCY, strength),
            alpha=scaled(problem.alpha, Quantity.SLENDERNESS, strength),
            restitution=scaled(problem.restitution, Quantity.RESTITUTION, strength),
        )
        return multiprecision.rest_time(changed, start + strength * shift, 1 - 2 * side, v + strength * faster)

    block = block_of(problem)
    dv = faster + restoring(ground_of(problem), block, side, 0, start) * shift
    trail = Trail(
        ground_of(problem), block, rules_for(nonlinear=model == "nonlinear"), state.records(0, state.NODE_ROW)
    )
    # What happens to the speed at the impact itself is in dv.
    node, later = node_of(side, 0.0, v, start), node_of(state.AT_REST, 0.0, 0.0, start + 1e-4)
    found = rest_shift(trail, node, what, (dv, shift, 0.0), later)
    slope = float((rest(step) - rest(-step)) / (2.0 * step))
    assert found - shift == pytest.approx(slope - shift, rel=1e-3)
