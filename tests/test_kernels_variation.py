"""The variation along a response against differences between neighbouring arcs and rests."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_records import Pair, block_of, ground_of, in_units_of_g, rocking_block, rules_for, state_of
from oracles import multiprecision
from oracles.problem import Problem

from rocking.kernels import state
from rocking.kernels.arc import evaluate, expand, restoring
from rocking.kernels.state import Record, new_scratch
from rocking.kernels.trace import Trail
from rocking.kernels.variation import expand_variation, rest_shift

quick = settings(deadline=None, max_examples=60)

MOTION, ROTATION, VELOCITY, FREQUENCY, SLENDERNESS, RESTITUTION = range(6)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers far from underflow."""
    return st.floats(low, high).map(lambda x: x if abs(x) > 1e-30 else 0.0)


def node_of(side: int, u: float, v: float, time: float = 0.0) -> Record:
    return state.record(state.NODE_ROW, time=time, piece=0, offset=time, side=side, u=u, v=v)


@quick
@given(
    st.floats(0.01, 1.2),
    numbers(-2.0, 2.0),
    st.floats(-0.3, 0.3),
    st.floats(-1.0, 1.0),
    st.lists(numbers(-1.0, 1.0), min_size=1, max_size=6),
    st.booleans(),
    st.floats(0.3, 3.0),
    st.integers(0, 1),
    st.integers(0, 5),
)
def test_the_variation_along_an_arc_is_the_derivative_by_what_is_changed(
    u: float, v: float, du: float, dv: float, A: list[float], nonlinear: bool, p: float, side: int, what: int
) -> None:
    step, alpha = 0.3 / p, 0.3
    row = np.array(A) / step ** np.arange(len(A))
    rules = rules_for(nonlinear=nonlinear)

    def problem(strength: float) -> tuple[object, Record]:
        changed = 1.0 + strength
        ground = in_units_of_g([0.0, 9.0], [row * (changed if what == MOTION else 1.0)])
        faster, wider = (changed if what == FREQUENCY else 1.0), (changed if what == SLENDERNESS else 1.0)
        return ground, rocking_block((p * faster,) * 2, (alpha * wider,) * 2, nonlinear=nonlinear)

    def end(strength: float, at: float) -> np.ndarray:
        scratch = new_scratch()
        ground, block = problem(strength)
        start = state_of(side, u + strength * du, v + strength * dv)
        order, h, _ = expand(ground, block, rules, scratch, start, step)
        assert h >= 0.9 * at
        return np.array(evaluate(scratch["rotation"], order, at)[:2])

    scratch, work = new_scratch(), state.record(state.VARIATION)
    trail = Trail(*problem(0.0), rules, state.records(0, state.NODE_ROW))
    _, h, _ = expand(*problem(0.0), rules, scratch, state_of(side, u, v), step)
    at = 0.8 * h
    order = expand_variation(trail, scratch, work, node_of(side, u, v), what, (du, dv), step)
    found = np.array(evaluate(work[2], order, at)[:2])
    d = 1e-4
    difference = (8.0 * (end(d, at) - end(-d, at)) - end(2 * d, at) + end(-2 * d, at)) / (12.0 * d)
    size = 1.0 + abs(found)
    assert np.all(np.abs(found - difference) <= 1e-9 * size * np.array([1.0, p]))


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("what", [MOTION, VELOCITY, FREQUENCY, SLENDERNESS, RESTITUTION])
def test_the_shift_of_the_rest_is_its_derivative_by_what_is_changed(model: str, side: int, what: int) -> None:
    """To first order in the speed, for any shift of the impact and any change of the speed after it."""
    problem = Problem(model, (2.0, 3.0), (0.2, 0.15), (0.7, 0.5), np.array([0.0, 50.0]), np.array([[0.4, 0.9]]))
    start, v, shift, faster, step = 1.0, 1e-6, 0.3, 2e-6, 1e-7

    def scaled(values: Pair, which: int, strength: float) -> Pair:
        return tuple(x * (1.0 + strength) if what == which else x for x in values)

    def rest(strength: float) -> multiprecision.Number:
        changed = replace(
            problem,
            coefficients=problem.coefficients * (1.0 + strength if what == MOTION else 1.0),
            p=scaled(problem.p, FREQUENCY, strength),
            alpha=scaled(problem.alpha, SLENDERNESS, strength),
            restitution=scaled(problem.restitution, RESTITUTION, strength),
        )
        return multiprecision.rest_time(changed, start + strength * shift, 1 - 2 * side, v + strength * faster)

    block = block_of(problem)
    dv = faster + restoring(ground_of(problem), block, side, 0, start) * shift
    trail = Trail(
        ground_of(problem), block, rules_for(nonlinear=model == "nonlinear"), state.records(0, state.NODE_ROW)
    )
    # What happens to the speed at the impact itself is in dv.
    node, later = node_of(side, 0.0, v, start), node_of(state.AT_REST, 0.0, 0.0, start + 1e-4)
    found = rest_shift(trail, node, what, dv, shift, later)
    slope = float((rest(step) - rest(-step)) / (2.0 * step))
    assert found - shift == pytest.approx(slope - shift, rel=1e-3)
