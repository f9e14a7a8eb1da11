"""Whether a block came to rest before the motion passed a threshold again, against the stretches beyond a threshold."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kernel_structs import long_uncompiled, rocking_block, state_of

import rocking
from rocking.engine.problem import prepare_ground
from rocking.kernels.ground import join_grounds
from rocking.kernels.state import AT_REST, create_scratch, create_structs
from rocking.kernels.uplift import write_completeness
from rocking.motion.motion import find_exceedances

Pair = tuple[float, float]


def is_complete(motion: rocking.Motion, thresholds: Pair, rest: float, *, uplift: float = 0.0, rests: int = 1) -> bool:
    block = rocking_block()
    block["threshold"] = thresholds
    state = state_of(AT_REST, 0.0, 0.0, rest_count=rests, first_uplift=uplift, first_rest=rest)
    blocks, states = create_structs(1, block.dtype), create_structs(1, state.dtype)
    blocks[0], states[0] = block, state
    complete = np.zeros(1, dtype=bool)
    grounds, first = join_grounds([prepare_ground(motion, 1.0)]), np.zeros(1, dtype=np.int64)
    write_completeness(grounds, first, np.ones(1), blocks, states, create_scratch(), complete)
    return bool(complete[0])


def numbers(size: int) -> st.SearchStrategy[list[float]]:
    return st.lists(st.integers(-64, 64).map(lambda k: k / 64), min_size=size, max_size=size)


@st.composite
def motions(draw: st.DrawFn) -> rocking.Motion:
    """Up to twelve pieces of one degree, with jumps between them; some move the ground up and down besides.

    A few of these leave the block no weight: it is beyond both thresholds then.
    """
    columns, count = draw(st.integers(1, 5)), draw(st.integers(1, 12))
    breakpoints = np.cumsum([0.0, *(draw(st.floats(0.1, 2.0)) for _ in range(count))])
    made = rocking.Motion(breakpoints, np.array([draw(numbers(columns)) for _ in range(count)]))
    if draw(st.booleans()):
        lifts = draw(st.sampled_from([0.3, 2.0])) * np.array([draw(numbers(columns)) for _ in range(count)])
        made = made.with_vertical(rocking.Motion(breakpoints, lifts))
    return made


@long_uncompiled
@settings(deadline=None, max_examples=20)
@given(motions(), st.tuples(st.floats(0.05, 1.0), st.floats(0.05, 1.0)), st.floats(0.0, 1.1))
def test_chattering_is_complete_where_the_next_stretch_beyond_a_threshold_starts_after_the_rest(
    motion: rocking.Motion, thresholds: Pair, share: float
) -> None:
    found, rest = find_exceedances(motion, thresholds, 1.0), share * motion.duration
    assume(len(found) > 0 and found[0, 0] < rest)
    edges = np.sort(np.append(found.ravel(), rest))
    assume(np.diff(edges).min() > 1e-6)  # a touch, and a tie, are decided by rounding
    assert is_complete(motion, thresholds, rest, uplift=found[0, 0]) == (not np.any(found[1:, 0] < rest))


def test_a_jump_from_beyond_one_threshold_to_beyond_the_other_is_no_second_passing() -> None:
    square = rocking.Motion([0.0, 1.0, 2.0, 3.0, 4.0], [[1.0], [-1.0], [0.0], [1.0]])
    assert is_complete(square, (0.5, 0.5), 2.9)
    assert not is_complete(square, (0.5, 0.5), 3.1)
    assert is_complete(square, (2.0, 0.5), 2.9)
    assert not is_complete(square, (2.0, 0.5), 3.1)
    assert is_complete(square, (0.5, 2.0), 3.9)


@pytest.mark.parametrize("ahead", [1e-3, 1e-9, 1e-12])
def test_a_motion_that_only_just_falls_below_a_threshold_passes_it_again(ahead: float) -> None:
    motion = rocking.Motion.from_samples([0.0, 1.0, 0.5 - ahead, 1.0, 0.0], 1.0)
    assert not is_complete(motion, (0.5, 0.5), 3.0)
    assert is_complete(motion, (0.5, 0.5), 1.9)
    assert is_complete(motion, (0.5, 0.5 - 2.0 * ahead), 3.0)


def test_a_block_that_never_came_to_rest_did_not_chatter_to_completion() -> None:
    assert not is_complete(rocking.Motion.from_samples([0.0, 1.0, 0.0], 1.0), (0.5, 0.5), 0.0, rests=0)
