"""One step of all lanes of a group in the nonlinear model: a Taylor series of ninth order, in registers.

Time is counted in steps, so that coefficients are terms: u is their sum. The sine and cosine of alpha - u are carried
along, turned by the addition theorem. Under a vertical ground acceleration the weight changes evenly, too.
"""

from rocking.kernels.arc import Line, borne, is_left_out_nothing, strength_of
from rocking.kernels.compiled import shared
from rocking.kernels.lanes.crew import WIDTH
from rocking.kernels.lanes.events import is_quiet
from rocking.kernels.lanes.substeps import begin, commit, over_substep
from rocking.kernels.state import Record


@shared
def step_nonlinear(
    group: Record, push: Line, weight: Line | None, length: float, h: float, substeps: int, fallen: float
) -> int:
    """Step a group through one sample, but mark, count and leave the lanes with an event.

    ``push`` is the ground acceleration, ``weight`` that in the ground's frame over that at rest (None: it does not
    change). Samples whose times are rounded are not all of one length: this one has ``length``, the lanes' constants
    are for ``h``.
    """
    share = length / substeps
    begin(group, share)
    for k in range(substeps):
        substep(group, over_substep(push, k, share), over_substep(weight, k, share), (length / h) ** 2, fallen)
    return commit(group, 1.0 / share)


@shared
def substep(group: Record, push: Line, weight: Line | None, stretch: float, fallen: float) -> None:
    """Take the copies through one substep; mark the lanes in which it may hold an event.

    ``push`` and ``weight`` have the changes over it; ``stretch`` is the square of its length over the usual one.
    """
    for lane in range(WIDTH):
        u, r1 = group.next_u[lane], group.next_v[lane]
        s0, c0 = group.next_sine[lane], group.next_cosine[lane]
        a, b = group.push[lane] * push[0], group.push[lane] * push[1]
        l2 = group.stiffness[lane] * stretch
        r2 = 2.0 * (l2 * (borne(weight, s0, 0.0) + a * c0))
        s1, c1 = -(r1 * c0), r1 * s0
        r3 = l2 * (borne(weight, s1, s0) + (a * c1 + b * c0))
        s2, c2 = -0.5 * (r1 * c1 + r2 * c0), 0.5 * (r1 * s1 + r2 * s0)
        r4 = (2.0 / 3.0) * (l2 * (borne(weight, s2, s1) + (a * c2 + b * c1)))
        s3, c3 = -(1.0 / 3.0) * (r1 * c2 + (r2 * c1 + r3 * c0)), (1.0 / 3.0) * (r1 * s2 + (r2 * s1 + r3 * s0))
        r5 = 0.5 * (l2 * (borne(weight, s3, s2) + (a * c3 + b * c2)))
        s4 = -0.25 * ((r1 * c3 + r2 * c2) + (r3 * c1 + r4 * c0))
        c4 = 0.25 * ((r1 * s3 + r2 * s2) + (r3 * s1 + r4 * s0))
        r6 = 0.4 * (l2 * (borne(weight, s4, s3) + (a * c4 + b * c3)))
        s5 = -0.2 * ((r1 * c4 + r2 * c3) + (r3 * c2 + (r4 * c1 + r5 * c0)))
        c5 = 0.2 * ((r1 * s4 + r2 * s3) + (r3 * s2 + (r4 * s1 + r5 * s0)))
        r7 = (1.0 / 3.0) * (l2 * (borne(weight, s5, s4) + (a * c5 + b * c4)))
        s6 = -(1.0 / 6.0) * ((r1 * c5 + r2 * c4) + ((r3 * c3 + r4 * c2) + (r5 * c1 + r6 * c0)))
        c6 = (1.0 / 6.0) * ((r1 * s5 + r2 * s4) + ((r3 * s3 + r4 * s2) + (r5 * s1 + r6 * s0)))
        r8 = (2.0 / 7.0) * (l2 * (borne(weight, s6, s5) + (a * c6 + b * c5)))
        s7 = -(1.0 / 7.0) * (((r1 * c6 + r2 * c5) + (r3 * c4 + r4 * c3)) + ((r5 * c2 + r6 * c1) + r7 * c0))
        c7 = (1.0 / 7.0) * (((r1 * s6 + r2 * s5) + (r3 * s4 + r4 * s3)) + ((r5 * s2 + r6 * s1) + r7 * s0))
        r9 = 0.25 * (l2 * (borne(weight, s7, s6) + (a * c7 + b * c6)))
        last = (1.0 / 7.0) * r7 + (0.125 * r8 + (1.0 / 9.0) * r9)
        moved = r1 + (0.5 * r2 + ((1.0 / 3.0) * r3 + (0.25 * r4 + (0.2 * r5 + ((1.0 / 6.0) * r6 + last)))))
        u1 = u + moved
        v1 = r1 + (r2 + (r3 + (r4 + (r5 + (r6 + (r7 + (r8 + r9)))))))
        sizes = (abs(r1), abs(r2), abs(r3), abs(r4), abs(r5), abs(r6), abs(r7), abs(r8), abs(r9))
        low = (abs(r1), abs(s2) + abs(c2), abs(s3) + abs(c3), abs(s4) + abs(c4))
        angles = (*low, abs(s5) + abs(c5), abs(s6) + abs(c6), abs(s7) + abs(c7))
        converged, rest = is_left_out_nothing(sizes, angles, -2.0 * l2, strength_of(weight, (a, b), 1.0))
        least, most = min(r2 - rest, 0.0), max(r2 + rest, 0.0)
        quiet = is_quiet((u, u1), r1, 0.125 * most, -0.125 * least, (least, most), group.peak[lane], fallen)
        quiet &= converged
        group.event[lane] |= not quiet
        # sin and 1 - cos of the rotation moved through
        square = moved * moved
        fine = 1.0 / 120.0 - square * (1.0 / 5040.0 - square * (1.0 / 362880.0))
        sine = moved * (1.0 - square * (1.0 / 6.0 - square * fine))
        fine = 1.0 / 720.0 - square * (1.0 / 40320.0 - square * (1.0 / 3628800.0))
        versine = square * (0.5 - square * (1.0 / 24.0 - square * fine))
        group.next_u[lane] = u1
        group.next_v[lane] = v1
        group.next_sine[lane] = s0 - (s0 * versine + c0 * sine)
        group.next_cosine[lane] = c0 - (c0 * versine - s0 * sine)
