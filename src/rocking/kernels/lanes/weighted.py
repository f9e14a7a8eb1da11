"""One step of all lanes of a group in the linear model while the weight changes: a Taylor series, in registers.

Coefficients are those of the rate, with time counted in substeps: r1 + 2 c2 t + ... = r1 + r2 t + r3 t^2 + ... .
"""

from rocking.kernels.arc import Line
from rocking.kernels.compiled import shared
from rocking.kernels.lanes.crew import WIDTH
from rocking.kernels.lanes.events import is_quiet
from rocking.kernels.lanes.substeps import begin, commit, over_substep
from rocking.kernels.state import Record

#: Largest of what the last terms feed into those left out, over the first two: what is left out is a hundredth of it.
_TAIL = 2.0**-46


@shared
def step_weighted(group: Record, push: Line, weight: Line, length: float, substeps: int, fallen: float) -> int:
    """Step a group through one sample of a length, but mark, count and leave the lanes with an event.

    ``push`` is the ground acceleration, ``weight`` that in the ground's frame over that at rest.
    """
    share = length / substeps
    begin(group, 1.0)
    for k in range(substeps):
        substep(group, over_substep(push, k, share), over_substep(weight, k, share), share, fallen)
    return commit(group, 1.0)


@shared
def substep(group: Record, push: Line, weight: Line, h: float, fallen: float) -> None:
    """Take the copies through a substep of length h; mark the lanes in which it may hold an event.

    With z = h^2 (lam u - pull), r' = weight z - h^2 push: a term feeds into the next but one, and by the change of the
    weight into the one after that. The last of them are bounds on all that are left out.
    """
    w, d = weight
    square, rate = h * h, 1.0 / h
    for lane in range(WIDTH):
        u, v = group.next_u[lane], group.next_v[lane]
        q, gain = group.stiffness[lane] * square, group.push[lane] * square
        r1, z0 = v * h, q * u - group.pull[lane] * square
        r2, z1 = w * z0 - gain * push[0], q * r1
        r3, z2 = 0.5 * ((w * z1 + d * z0) - gain * push[1]), 0.5 * (q * r2)
        r4, z3 = (1.0 / 3.0) * (w * z2 + d * z1), (1.0 / 3.0) * (q * r3)
        r5, z4 = 0.25 * (w * z3 + d * z2), 0.25 * (q * r4)
        r6, z5 = 0.2 * (w * z4 + d * z3), 0.2 * (q * r5)
        r7, z6 = (1.0 / 6.0) * (w * z5 + d * z4), (1.0 / 6.0) * (q * r6)
        r8, z7 = (1.0 / 7.0) * (w * z6 + d * z5), (1.0 / 7.0) * (q * r7)
        r9, z8 = 0.125 * (w * z7 + d * z6), 0.125 * (q * r8)
        r10, z9 = (1.0 / 9.0) * (w * z8 + d * z7), (1.0 / 9.0) * (q * r9)
        r11 = 0.1 * (w * z9 + d * z8)
        high = 0.125 * r8 + ((1.0 / 9.0) * r9 + (0.1 * r10 + (1.0 / 11.0) * r11))
        low = (1.0 / 3.0) * r3 + (0.25 * r4 + (0.2 * r5 + ((1.0 / 6.0) * r6 + ((1.0 / 7.0) * r7 + high))))
        u1 = u + (r1 + (0.5 * r2 + low))
        v1 = v + rate * (r2 + (r3 + (r4 + (r5 + (r6 + (r7 + (r8 + (r9 + (r10 + r11)))))))))
        rest = 3.0 * abs(r4) + (4.0 * abs(r5) + (5.0 * abs(r6) + (6.0 * abs(r7) + 7.0 * abs(r8))))
        rest += 8.0 * abs(r9) + (9.0 * abs(r10) + 10.0 * abs(r11))
        least, most = min(r2 + 2.0 * min(r3, 0.0) - rest, 0.0), max(r2 + 2.0 * max(r3, 0.0) + rest, 0.0)
        quiet = is_quiet((u, u1), r1, 0.125 * most, -0.125 * least, (least, most), group.peak[lane], fallen)
        last = (abs(w) + abs(d)) * (abs(r10) + abs(r11)) + abs(d) * abs(r9)
        quiet &= abs(q) * last <= _TAIL * (abs(r1) + abs(r2))
        group.event[lane] |= not quiet
        group.next_u[lane] = u1
        group.next_v[lane] = v1
