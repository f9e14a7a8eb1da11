"""Complete chattering: whether a block came to rest before the motion passed a threshold again."""

from rocking.arrays import Flags
from rocking.kernels.compiled import inlined, kernel
from rocking.kernels.ground import Ground, last_piece, length_of, start_of
from rocking.kernels.state import AT_REST, Record, Records
from rocking.kernels.uplift import Uplift, first_passing, next_uplift, push_series

#: A motion is back within a threshold once it is below it by this fraction: rounding makes no second passing.
_BACK = 2.0**-40


@kernel
def note_complete(ground: Ground, blocks: Records, states: Records, scratch: Record, complete: Flags) -> None:
    """Tell of every block that started at rest whether the chattering after its first uplift was complete."""
    for k in range(blocks.shape[0]):
        state = states[k]
        complete[k] = state.rests > 0 and not passes_again(ground, blocks[k], scratch, state)


@inlined
def passes_again(ground: Ground, block: Record, scratch: Record, state: Record) -> bool:
    """Whether the motion, having lifted a block and come back within the thresholds, passes one before its rest."""
    until = state.first_rest
    lifted = next_uplift(ground, block, scratch, piece_before(ground, state.first_uplift), 0.0, until)
    if lifted.side == AT_REST:
        return False
    piece, offset = back_within(ground, block, scratch, lifted)
    again = next_uplift(ground, block, scratch, piece, offset, until)
    return bool(again.side != AT_REST and start_of(ground, again.piece) + again.offset < until)


@inlined
def piece_before(ground: Ground, time: float) -> int:
    """Return a piece that is over before a time, the one nearest to it; the first where there is none."""
    low, high = 0, last_piece(ground)
    while high - low > 1:
        middle = (low + high) // 2
        if start_of(ground, middle) < time:
            low = middle
        else:
            high = middle
    return max(0, low - 1)


@inlined
def back_within(ground: Ground, block: Record, scratch: Record, lifted: Uplift) -> tuple[int, float]:
    """Piece and offset at which the motion is beyond neither threshold any more.

    It may jump from one to the other and, where nothing weighs the block down, be beyond both.
    """
    piece, offset, side = lifted.piece, lifted.offset, lifted.side
    while piece < last_piece(ground):
        until = offset + time_beyond(ground, block, scratch, piece, offset, side)
        if until == offset:
            side = 1 - side
            until = offset + time_beyond(ground, block, scratch, piece, offset, side)
        if until == offset:
            return piece, offset
        offset = until
        if not offset < length_of(ground, piece):
            piece += 1
            offset = 0.0
    return piece, 0.0


@inlined
def time_beyond(ground: Ground, block: Record, scratch: Record, piece: int, offset: float, side: int) -> float:
    """Time from here for which the motion stays beyond a side's threshold within a piece; inf when to its end."""
    sign, threshold = 1.0 if side == 1 else -1.0, block.threshold[side]
    A, d = scratch.ground, scratch.spare
    degree = push_series(ground, piece, offset, threshold, sign, A, d)
    d[0] = sign * A[0] - (1.0 - _BACK) * threshold
    for k in range(1, degree + 1):
        d[k] = sign * A[k]
    return first_passing(d, degree, length_of(ground, piece) - offset)
