"""The one test for what may happen within a step of a lane."""

from rocking.kernels.compiled import inlined


@inlined
def is_quiet(
    ends: tuple[float, float],
    rise: float,
    dip: float,
    bulge: float,
    turn: tuple[float, float],
    peak: float,
    fallen: float,
) -> bool:
    """Whether a step certainly holds no impact, no new peak and no overturning; never with a NaN among the numbers.

    Over a step from u to u1 (``ends``) the rotation stays above min(u, u1) - dip and below max(u, u1) + bulge, and its
    rate, ``rise`` at the start, changes by no less than the first and no more than the second number of ``turn``. A
    rotation that rises all the way has its peak at the end, where it is seen; one that falls all the way has it at the
    start, where it must have been seen already.
    """
    u, u1 = ends
    least, most = turn
    highest = max(u, u1)
    rises = rise + least > 0.0
    falls = (rise + most < 0.0) & (u <= peak)
    # One by one: a minimum would pass over a NaN.
    return (u > dip) & (u1 > dip) & ((highest + bulge <= peak) | rises | falls) & (highest + bulge < fallen)
