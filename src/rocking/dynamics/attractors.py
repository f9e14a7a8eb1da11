"""Periodic attractors of a map, with an invariant neighbourhood of each of their points.

A neighbourhood is an ellipse in a norm in which the derivative contracts. This is checked at samples of twice its size,
together with the number of impacts, so that no impact grazes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Flags, Floats, Integers, select_evenly
from rocking.core.tables import format_count
from rocking.core.threads import map_in_threads
from rocking.dynamics.maps import StroboscopicMap, parts_of
from rocking.dynamics.orbits import multipliers_at, sizes_of
from rocking.errors import InvalidOption
from rocking.kernels.periodic import TRAP, iterate
from rocking.kernels.state import Records, new_scratch

#: Longest period of an attractor, in periods of the motion, and largest relative distance of a recurrent state.
LONGEST: Final = 64
RETURN: Final = 1e-6

#: Number of rings and angles of the samples.
_RINGS: Final = 4
_ANGLES: Final = 24


@dataclass(frozen=True, eq=False)
class Attractor:
    """Stable periodic orbit.

    Attributes
    ----------
    states : ndarray, shape (period, 2)
        Coordinate and velocity at the starts of the periods of the motion.
    multipliers : ndarray of complex, shape (2,)
        Eigenvalues of the derivative of the map over the period of the orbit; zero if the orbit contains a rest.
    impacts, rests : int, bool
        Number of resolved impacts in one period, and whether the body comes to rest.
    """

    states: Floats
    multipliers: NDArray[np.complex128]
    impacts: int
    rests: bool

    @property
    def period(self) -> int:
        """Period of the orbit, in periods of the motion."""
        return len(self.states)

    @property
    def name(self) -> str:
        """Description in words."""
        if self.impacts == 0 and np.all(self.states[:, 1] == 0.0):
            return "rest"
        return f"period {self.period}, {'rest' if self.rests else format_count(self.impacts, 'impact')}"


def attractor_from(strobe: StroboscopicMap, state: Floats, size: Floats) -> Attractor | None:
    """Return the periodic attractor on which a state has settled; None without a stable orbit."""
    orbit = strobe.orbit(state, 2 * LONGEST)
    back = (np.abs(orbit[-1 - LONGEST : -1][::-1] - orbit[-1]) / size).max(axis=1)
    returns = np.flatnonzero(back < RETURN)
    if returns.size == 0:
        return None
    period = int(returns[0]) + 1
    try:
        fixed = _fixed_point(strobe, orbit[-1], period, size)
    except (np.linalg.LinAlgError, InvalidOption):  # a multiplier of exactly 1; a step that leads behind a stop
        return None
    if fixed is None:
        return None
    at, change = fixed
    for shorter in range(1, period):  # a slow approach may come close only twice in a period
        if period % shorter == 0 and np.abs((strobe(at, shorter) - at) / size).max() < 1e-3 * RETURN:
            return None
    multipliers = multipliers_at(strobe, change)
    if sizes_of(multipliers).max() >= 1.0:
        return None
    _, _, impacts = strobe.advance(at, period)
    return Attractor(strobe.orbit(at, period)[:-1], multipliers, int(impacts), not change.any())


def _fixed_point(strobe: StroboscopicMap, at: Floats, period: int, size: Floats) -> tuple[Floats, Floats] | None:
    """Find the fixed point of a number of periods near a state by Newton's method, with the derivative there."""
    start = at
    for _ in range(12):
        after, change = strobe.derivative(at, period)
        if not np.isfinite(change).all():
            return None
        off = after - at
        if np.abs(off / size).max() < 1e-11:
            return at, change
        at = at + np.linalg.solve(np.eye(2) - change, off) if change.any() else after
        if np.abs((at - start) / size).max() > np.sqrt(RETURN):
            return None
    return None


def _trap(strobe: StroboscopicMap, attractor: Attractor, point: Floats, record: Records, size: Floats) -> Floats | None:
    """Return an invariant neighbourhood of a point of an attractor, as a row for `kernels.periodic.iterate`."""
    side, u, v = int(record["side"]), float(record["u"]), float(record["v"])
    if side < 0:  # at rest, whatever the previous state
        return np.array([side, 0.0, 0.0, 0.0, 0.0, 0.0])
    _, change = strobe.derivative(point, attractor.period)
    shape, rate = _contracting_norm(change, size)
    if not np.isfinite(shape).all():
        return None

    def stays(offsets: Floats) -> bool:
        """Whether states around the point approach it, on the same side and with the same number of impacts."""
        here = offsets[u + offsets[:, 0] > 0.0]
        if np.any(u + offsets[:, 0] >= strobe._records["overturn_angle"][0]) or len(here) == 0:
            return False
        samples = strobe._coordinates(u + here[:, 0], v + here[:, 1], np.full(len(here), side))
        after, changes = strobe.derivative(samples, attractor.period)
        if not np.isfinite(changes).all() or np.any(strobe._states(after)[1]["side"] != side):
            return False
        if attractor.rests:
            target = strobe._coordinates(np.array([u]), np.array([v]), np.array([side]))[0]
            return bool(not changes.any() and np.abs((after - target) / size).max() < 1e-9)
        _, _, impacts = strobe.advance(samples, attractor.period)
        norms = np.linalg.norm(shape @ changes @ np.linalg.inv(shape), ord=2, axis=(1, 2))
        return bool(np.all(impacts == attractor.impacts) and np.all(norms <= 0.5 * (1.0 + rate)))

    angles = 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES
    rings = np.arange(1, _RINGS + 1)[:, None, None] / _RINGS
    disc = (rings * np.stack([np.cos(angles), np.sin(angles)], axis=-1)).reshape(-1, 2) @ np.linalg.inv(shape).T
    radius = 0.25  # relative to the size of the states
    while radius > 1e-7:
        # The checked neighbourhood is twice as large.
        offsets = 2.0 * radius * disc
        # First at a few angles of the outermost ring.
        if stays(offsets[-_ANGLES :: _ANGLES // 4]) and stays(offsets):
            form = shape.T @ shape / radius**2
            return np.array([side, u, v, form[0, 0], form[0, 1], form[1, 1]])
        radius *= 0.5
    return None


def _contracting_norm(change: Floats, size: Floats) -> tuple[Floats, float]:
    """Return a matrix L and a rate such that |L M x| <= rate |L x|, where |L x| is at least |x| relative to the sizes.

    L is NaN if rounding error hides the eigenvalues of the derivative.
    """
    scale = np.diag(1.0 / size)
    M = scale @ change @ np.diag(size)
    rate = max(float(np.sqrt(np.abs(np.linalg.eigvals(M)).max())), 0.01)
    form, power = np.eye(2), np.eye(2)
    for _ in range(100_000):
        power = M @ power / rate
        term = power.T @ power
        form = form + term
        if np.abs(term).max() < 1e-14 * np.abs(form).max():
            return np.linalg.cholesky(form).T @ scale, rate
        if np.abs(term).max() > 1e12:
            break
    return np.full((2, 2), np.nan), rate


class KnownAttractors:
    """Attractors found so far, and their traps.

    Attributes
    ----------
    attractors : list of Attractor
        Attractors in the order of their discovery.
    traps : ndarray, shape (n, 6)
        Their neighbourhoods, in the form that the kernel accepts.
    owner : ndarray, shape (n,)
        Index of the attractor of each trap.
    """

    #: Maximum number of states per search, without those that lead to known attractors.
    MOST_TRIES: Final = 12

    def __init__(self, strobe: StroboscopicMap, size: Floats) -> None:
        self.strobe, self.size = strobe, size
        self.attractors: list[Attractor] = []
        self.traps, self.owner = np.empty((0, TRAP)), np.empty(0, dtype=np.int64)

    def owners(self, states: Floats) -> Integers:
        """Return the attractor of each state, -1 for a state outside all traps."""
        return self._owner_of(self.strobe._states(states)[1])

    def settle(self, states: Floats) -> Integers:
        """Return the attractor of each state, -1 for a state outside all traps, and search for new attractors."""
        _, made = self.strobe._states(states)
        found = self._owner_of(made)
        tries = self.MOST_TRIES
        while tries and (unsettled := np.flatnonzero(found == -1)).size:
            first, known = unsettled[0], len(self.attractors)
            owner = self._add(attractor_from(self.strobe, states[first], self.size))
            if owner == known:
                passing = self.settled(made[unsettled], self.attractors[owner].period)[0]
                found[unsettled] = np.append(self.owner, -1)[passing]
            if owner < 0 or owner == known:  # known attractors do not count as tries
                tries -= 1
            found[first] = owner if owner >= 0 else -2
        found[found == -2] = -1
        return found

    def settled(self, made: Records, periods: int) -> tuple[Integers, Integers]:
        """Advance states, and return the trap that each reaches within these periods, or -1, and how many it takes."""
        setting, traps, orbits = self.strobe._setting(), self.traps, np.empty((len(made), 0, 3))
        found, taken = np.empty(len(made), dtype=np.int64), np.empty(len(made), dtype=np.int64)

        def follow(part: slice) -> None:
            iterate(setting, new_scratch(), made[part], periods, orbits[part], traps, found[part], taken[part])

        for _ in map_in_threads(follow, parts_of(len(made), periods)):
            pass
        return found, taken

    def _owner_of(self, made: Records) -> Integers:
        found = np.full(len(made), -1)
        for trap, owner in zip(self.traps, self.owner, strict=True):
            du, dv = made["u"] - trap[1], made["v"] - trap[2]
            inside: Flags = trap[3] * du * du + 2.0 * trap[4] * du * dv + trap[5] * dv * dv <= 1.0
            found[(made["side"] == trap[0]) & inside & (found == -1)] = owner
        return found

    def _add(self, attractor: Attractor | None) -> int:
        """Add an attractor if it is new, and return its number, or -1 without traps."""
        if attractor is None:
            return -1
        for number, known in enumerate(self.attractors):
            if known.period == attractor.period:
                near = np.abs((known.states - attractor.states[0]) / self.size).max(axis=1)
                if near.min() < RETURN:
                    return number
        points = attractor.states[
            select_evenly(attractor.period, 8)
        ]  # some points of a long orbit have a neighbourhood
        pairs = zip(points, self.strobe._states(points)[1], strict=True)
        traps = [row for pair in pairs if (row := _trap(self.strobe, attractor, *pair, self.size)) is not None]
        if not traps:
            return -1
        self.owner = np.append(self.owner, np.full(len(traps), len(self.attractors)))
        self.traps = np.concatenate([self.traps, traps])
        self.attractors.append(attractor)
        return len(self.attractors) - 1
