"""A response in the phase plane, and its energy over time: lines whose impacts are jumps, and their figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.response.answers import Answers, energy_in, history_of
from rocking.response.export import active_span, checked_window, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Even times of a stretch; impacts of it that are drawn at most, evenly left out; and intervals between impacts that
#: have more points, by how many even steps they are long: arcs of shorter ones nobody sees.
_EVEN_TIMES: Final = 3001
_MOST_IMPACTS: Final = 2000
_SHORT: Final = (0.5, 12.0)
_POINTS_OF_SHORT: Final = 12


class Course(NamedTuple):
    """A stretch of a response, with the points of its impacts twice: before each and, at the same time, after it.

    Attributes
    ----------
    time : ndarray
        s.
    rotation, velocity : ndarray
        Rotation over the balance of its side (of a free block the slenderness), velocity over p times that; where a
        side has no balance, rotation in rad and velocity over p.
    kinetic, potential : ndarray
        Energies as of `Response.kinetic_energy`.
    before : ndarray of int
        Places of the points before impacts.
    """

    time: Floats
    rotation: Floats
    velocity: Floats
    kinetic: Floats
    potential: Floats
    before: Integers

    @property
    def total(self) -> Floats:
        """Kinetic and potential energy."""
        return self.kinetic + self.potential

    def parted(self, values: Floats) -> Floats:
        """Put a gap at each impact into values at these points: a line of them does not jump."""
        return np.insert(values, self.before + 1, np.nan)


def course_of(response: Answers, start: float, end: float) -> Course:
    """Follow a response from a time to a later one, s.

    Raises
    ------
    InvalidOption
        If the energy of its body is not known.
    """
    history, energy = history_of(response), energy_in(response)
    even, step = np.linspace(start, end, _EVEN_TIMES, retstep=True)
    impacts = response.impacts[(response.impacts["time"] >= start) & (response.impacts["time"] <= end)]
    impacts = impacts[:: 1 + len(impacts) // _MOST_IMPACTS]
    at = np.asarray(impacts["time"], dtype=float)
    gaps = np.diff(at)
    short = np.flatnonzero((gaps > _SHORT[0] * step) & (gaps < _SHORT[1] * step))
    inside = at[short, None] + gaps[short, None] * np.linspace(0.0, 1.0, _POINTS_OF_SHORT)[1:-1]
    times = np.setdiff1d(np.union1d(even, inside.ravel()), at)
    rows = history.rows(times)
    theta, rate, _ = history.states_in(times, rows).T
    where = np.searchsorted(times, at)

    def joined(values: Floats | Integers, before: Floats | Integers, after: Floats | Integers) -> Floats:
        return np.insert(values.astype(float), np.repeat(where, 2), np.column_stack([before, after]).ravel())

    left, entered = energy.sides_at(impacts)
    side = joined(history.trail.nodes["side"][rows], left, entered).astype(np.int64)
    back, out = (2.0 * left - 1.0) * impacts["speed_before"], (1.0 - 2.0 * entered) * impacts["speed_after"]
    rotation, velocity = joined(theta, 0.0 * at, 0.0 * at), joined(rate, back, out)
    own = np.maximum(side, 0)
    unit = energy.counted_in[own]
    return Course(
        joined(times, at, at),
        rotation / unit,
        velocity / (energy.p[own] * unit),
        energy.kinetic(velocity, side),
        energy.potential(rotation, side),
        where + 2 * np.arange(len(where)),
    )


def boundary_of(response: Answers) -> tuple[Floats, Floats]:
    """Rotations and velocities, in units of a `Course`, with as much energy as at the balance.

    What moves outwards beyond them overturns if nothing shakes. Not a number between its branches.
    """
    energy, gap = energy_in(response), np.array([np.nan])
    x: list[Floats] = []
    y: list[Floats] = []
    for side, sign in enumerate((1.0, -1.0)):
        u, speed = energy.boundary(side)
        falling = np.where(u < 1.0, speed, -speed)  # two branches cross at the balance
        unit = energy.balance[side] / energy.counted_in[side]
        for direction in (1.0, -1.0) if len(u) else ():
            x += [sign * unit * u, gap]
            y += [direction * unit * falling, gap]
    return np.concatenate(x), np.concatenate(y)


def needed_of(response: Answers) -> tuple[float, float]:
    """Return the energy that overturns a body to side + and to side -, over the least; infinite to one it has not."""
    plus, minus = energy_in(response).needed.tolist()
    return plus, minus


def marked(response: Answers, start: float, end: float) -> dict[str, Floats]:
    """Return the times of uplift and rest within a stretch, s."""
    events = response.events
    inside = (events["time"] >= start) & (events["time"] <= end)
    return {kind: np.asarray(events["time"][inside & (events["kind"] == kind)], float) for kind in ("uplift", "rest")}


def phase_plane(
    response: Answers,
    window: tuple[float, float] | None,
    title: str,
    ax: Axes | None,
    figsize: tuple[float, float] | None,
) -> Figure:
    """Draw velocity against rotation, from the window's start to its end."""
    from rocking.plot.phase import phase_figure

    start, end = active_span(response) if window is None else checked_window(window, response.duration)
    course = course_of(response, start, end)
    return phase_figure(
        rotation=course.parted(course.rotation),
        velocity=course.parted(course.velocity),
        jumps=np.column_stack([course.velocity[course.before], course.velocity[course.before + 1]]),
        boundary=boundary_of(response),
        **{f"{kind}s": bool(len(times)) for kind, times in marked(response, start, end).items()},
        limit=response.body.coordinate.limit if energy_in(response).counts_by_balance else "rad",
        title=title or titled(response),
        ax=ax,
        figsize=figsize,
    )


def energy_over_time(
    response: Answers,
    window: tuple[float, float] | None,
    title: str,
    ax: Axes | None,
    figsize: tuple[float, float] | None,
) -> Figure:
    """Draw kinetic, potential and total energy, from the window's start to its end."""
    from rocking.plot.phase import energy_figure

    start, end = active_span(response) if window is None else checked_window(window, response.duration)
    course = course_of(response, start, end)
    return energy_figure(
        time=course.time,
        kinetic=course.kinetic,
        potential=course.potential,
        needed=needed_of(response),
        impact_times=course.time[course.before],
        rest_intervals=response.rest_intervals,
        title=title or titled(response),
        ax=ax,
        figsize=figsize,
    )
