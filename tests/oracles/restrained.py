"""Blocks with restraints by the coordinates of their points, and DOP853 restarted at impacts.

Nothing here knows the equations of the package: the moment about a pivot is the work of every force along the turning.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

#: Speeds after an impact below which the arcs are too short for the integrator's events.
SLOWEST = 2e-2
#: Speeds after an impact below which a body rests, if the motion does not lift it.
AT_REST = 1e-7


@dataclass
class Held:
    """A rigid body on two pivots, in m, kg, N; points are (offset, height) along its own axes."""

    distances: tuple[float, float]
    height: float
    gyration: float
    mass: float
    gravity: float
    restitution: tuple[float, float]
    one_sided: bool = False
    lean: float = 0.0
    tendons: list[tuple[float, float, float]] = field(default_factory=list)  # stiffness, prestress, offset
    thrusts: list[tuple[float, float, float]] = field(default_factory=list)  # force, height, offset
    loads: list[tuple[float, float, float]] = field(default_factory=list)  # mass, height, offset
    yielding: tuple[float, float, float, float] | None = None  # stiffness, prestress, offset, strength
    spring: float = 0.0
    damper: float = 0.0
    plastic: float = 0.0
    flows: bool = False
    law: Callable[[int, float, int], float] | None = None  # of side, speed and impacts before
    resumed: list[int] = field(default_factory=list)  # impacts that count as before, from each rest on

    def factor(self, j, speed, number):
        return self.restitution[j] if self.law is None else self.law(j, speed, number)

    def inertia(self, j):
        return self.mass * (self.gyration**2 + self.height**2 + self.distances[j] ** 2)

    def moment(self, j, u, v, push, lift):
        """Moment about the pivot of side j that turns the block farther to it, N m."""
        sign = 1.0 - 2.0 * j
        pivot = np.array([sign * self.distances[j], 0.0])
        leaning = clockwise(self.lean)

        def where(point):
            """Position from the pivot, and its rate by the turning."""
            at = clockwise(self.lean + sign * u) @ (np.array(point) - pivot)
            return at, sign * np.array([at[1], -at[0]])

        def power(force, point):
            return float(np.dot(force, where(point)[1]))

        total = power((-self.mass * push, -self.mass * (self.gravity + lift)), (0.0, self.height))
        for force, height, offset in self.thrusts:
            total += power((force, 0.0), (offset, height))
        for mass, height, offset in self.loads:
            total += power((0.0, -mass * self.gravity), (offset, height))
        forces = [(offset, prestress, stiffness) for stiffness, prestress, offset in self.tendons]
        if self.yielding:
            _, _, offset, strength = self.yielding
            force = strength if self.flows else max(0.0, self.force(j, u))
            forces.append((offset, force, 0.0))
        for offset, force, stiffness in forces:
            here = leaning @ (np.array([offset, 0.0]) - pivot)
            at, rate = where((offset, 0.0))
            opening = float(np.hypot(*(at - here)))
            along = float(np.dot(at - here, rate)) / opening if opening > 1e-7 else float(np.hypot(*rate))
            total -= (force + stiffness * opening) * along
        return total - self.spring * u - self.damper * v

    def opening(self, j, u):
        """Elongation of the tendon that yields."""
        sign = 1.0 - 2.0 * j
        at = np.array([self.yielding[2] - sign * self.distances[j], 0.0])
        return float(np.hypot(*((clockwise(sign * u) - np.eye(2)) @ at)))

    def force(self, j, u):
        """Force of the tendon that yields as if it were elastic."""
        stiffness, prestress, _, _ = self.yielding
        return prestress + stiffness * (self.opening(j, u) - self.plastic)

    def turn_back(self, j, u):
        """The tendon stops yielding."""
        stiffness, prestress, _, strength = self.yielding
        self.flows = False
        self.plastic = self.opening(j, u) - (strength - prestress) / stiffness


def clockwise(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s], [-s, c]])


def integrated(body, motion, end, u, v, j, rests=False):  # noqa: C901
    """Impact times and speeds, highest rotation, and how it ended: "over", "overturned", "chatters".

    Where it `rests`, it does not end where it chatters: it goes on to speeds of `AT_REST`, and from there as the motion
    lifts it again.
    """
    times, speeds, t, peak, number = [], [], 0.0, u, 0
    if body.yielding and body.force(j, u) > body.yielding[3]:
        body.turn_back(j, u)

    def pushes(time):
        lift = 0.0 if motion.vertical is None else float(motion.vertical.acceleration(time))
        return float(motion.acceleration(time)), lift

    def rates(time, y):
        return [y[1], body.moment(j, y[0], y[1], *pushes(time)) / body.inertia(j)]

    def landing(_, y):
        return y[0]

    def over(_, y):
        return 0.5 * math.pi - y[0]

    def turning(_, y):
        return y[1]

    def slack(_, y):
        return body.force(j, y[0]) if body.yielding and not body.flows else 1.0

    def yields(_, y):
        return body.yielding[3] - body.force(j, y[0]) if body.yielding and not body.flows else 1.0

    landing.terminal = over.terminal = slack.terminal = yields.terminal = True
    yields.direction = -1
    landing.direction = over.direction = turning.direction = -1
    breaks = (
        motion.breakpoints if motion.vertical is None else np.union1d(motion.breakpoints, motion.vertical.breakpoints)
    )
    hangs = body.yielding is not None and body.force(j, u) < 0.0
    if rests and u == v == 0.0:
        t, j = lifted(body, pushes, t, end)
    pieces = np.unique(np.append(breaks[(breaks > 0.0) & (breaks < end)], end))
    while t < end:
        stop, step = pieces[np.searchsorted(pieces, t, side="right")], 0.02
        if rests and u == 0.0 and 0.0 < v < SLOWEST and (back := -rates(t, (u, v))[1]) > 0.0:
            stop, step = min(stop, t + 4.0 * v / back), 0.3 * v / back  # one arc that the motion hardly changes
        slack.direction = 1 if hangs else -1
        found = solve_ivp(
            rates, (t, stop), [u, v], "DOP853", rtol=1e-12, atol=1e-14 * (min(1.0, v * v) if step < 0.02 else 1.0),
            events=[landing, over, turning, slack, yields], max_step=step,
            first_step=min(1e-4, stop - t) if v == 0.0 else None,  # or a turn soon after the start is passed over
        )  # fmt: skip
        peak = max(peak, found.y[0, -1], *(row[0] for row in found.y_events[2]), 0.0)
        t, (u, v) = found.t[-1], found.y[:, -1]
        if len(found.t_events[1]):
            return times, speeds, peak, "overturned"
        if body.flows and len(found.t_events[2]):
            body.turn_back(j, u)
        if len(found.t_events[3]):
            hangs = not hangs
        if len(found.t_events[4]):
            body.flows, turning.terminal = True, True
        if not body.flows:
            turning.terminal = False
        if len(found.t_events[0]):
            times.append(t)
            speeds.append(-v)
            u, v, number = 0.0, -body.factor(j, -v, number) * v, number + 1
            j = j if body.one_sided else 1 - j
            if v < SLOWEST and not rests:
                return times[:-1], speeds[:-1], peak, "chatters"
            if v < AT_REST and not lifts(body, pushes(t)):
                v, number = 0.0, body.resumed.pop(0) if body.resumed else number
                t, j = lifted(body, pushes, t, end)
            hangs = body.yielding is not None and body.force(j, u) < 0.0
    return times, speeds, peak, "over"


def lifts(body, forces):
    """Side to which the motion lifts the body that stands, as a number in a list; an empty one where it stays."""
    return [j for j in ((0,) if body.one_sided else (0, 1)) if body.moment(j, 0.0, 0.0, *forces) > 0.0]


def lifted(body, pushes, start, end):
    """When the motion next lifts the body that stands, and to which side; the end where it does not."""

    def beyond(time, j):
        return body.moment(j, 0.0, 0.0, *pushes(time))

    step = 2e-3
    for time in np.arange(start, end, step):
        sides = lifts(body, pushes(min(time + step, end)))
        if sides:
            j = sides[0]
            return (float(time) if beyond(time, j) > 0.0 else brentq(beyond, time, time + step, (j,), xtol=1e-14)), j
    return end, 0
