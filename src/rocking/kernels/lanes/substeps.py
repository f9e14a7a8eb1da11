"""Copies of the lanes' states that go through the substeps of a sample, and the states that come of them."""

from typing import TypeVar

from rocking.kernels.arc import Line
from rocking.kernels.compiled import inlined
from rocking.kernels.lanes.crew import WIDTH
from rocking.kernels.state import Record

MaybeLine = TypeVar("MaybeLine", Line, None, Line | None)


@inlined
def begin(group: Record, h: float) -> None:
    """Copy the state, with the rate per time h."""
    for lane in range(WIDTH):
        group.next_u[lane] = group.u[lane]
        group.next_v[lane] = group.v[lane] * h
        group.next_sine[lane] = group.sine[lane]
        group.next_cosine[lane] = group.cosine[lane]
        group.event[lane] = 0


@inlined
def over_substep(line: MaybeLine, k: int, h: float) -> MaybeLine:
    """Value at the start of the k-th substep of length h, and the change over it; None of a quantity that is none."""
    if line is None:
        return line
    change = line[1] * h
    return line[0] + k * change, change


@inlined
def commit(group: Record, rate: float) -> int:
    """Make the copies the state of the lanes that have no event; count the others."""
    busy = 0
    for lane in range(WIDTH):
        event = group.event[lane]
        group.u[lane] = group.u[lane] if event else group.next_u[lane]
        group.v[lane] = group.v[lane] if event else group.next_v[lane] * rate
        group.sine[lane] = group.sine[lane] if event else group.next_sine[lane]
        group.cosine[lane] = group.cosine[lane] if event else group.next_cosine[lane]
        busy += event
    return busy
