"""One step of all lanes of a group in the linear model, with Stumpff's functions: exact for any lam and any h."""

from rocking.kernels.compiled import shared
from rocking.kernels.lanes.crew import WIDTH
from rocking.kernels.lanes.events import is_quiet
from rocking.kernels.state import Record


@shared
def step_linear(group: Record, start: float, slope: float, h: float, late: float, fallen: float) -> int:
    """Step a group through one sample, but mark, count and leave the lanes with an event.

    w = u'' obeys w'' = lam w under a ground acceleration that changes evenly, so its extrema are at the ends of the
    step (but for what ``curve`` allows). Samples whose times are rounded are not all of one length: ``late`` is what
    this one has more than ``h``.
    """
    end = start + slope * h
    busy = 0
    for lane in range(WIDTH):
        u, v = group.u[lane], group.v[lane]
        lam, push = group.stiffness[lane], group.push[lane]
        w = lam * u - (group.pull[lane] + push * start)
        j = lam * v - push * slope
        u1 = u + (h * v + (group.second[lane] * w + group.third[lane] * j))
        v1 = v + (group.first[lane] * w + group.second[lane] * j)
        w1 = lam * u1 - (group.pull[lane] + push * end)
        u1 += late * v1
        v1 += late * w1
        least, most = min(min(w, w1), 0.0), max(max(w, w1), 0.0)
        curve = group.curve[lane]
        # Eight times the bulge's factor is h^2: times the least w, that is h times the least change of the rate.
        turn = (8.0 * curve * least, 8.0 * curve * most)
        quiet = is_quiet((u, u1), h * v, curve * most, -(curve * least), turn, group.peak[lane], fallen)
        group.u[lane] = u1 if quiet else u
        group.v[lane] = v1 if quiet else v
        group.event[lane] = not quiet
        busy += not quiet
    return busy
