"""Periodic attractors of a map, with invariant neighbourhoods of their points.

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
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.orbits import compute_moduli, compute_multipliers
from rocking.errors import OptionError
from rocking.kernels.periodic import TRAP_COLUMNS
from rocking.kernels.state import Structs

#: Longest period of an attractor, in periods of the motion.
MAX_PERIOD: Final = 64

#: Largest distance of a recurrent state, relative to the size of states.
RETURN_TOLERANCE: Final = 1e-6

#: Number of rings and angles of the samples.
_RING_COUNT: Final = 4
_ANGLE_COUNT: Final = 24


@dataclass(frozen=True, eq=False)
class Attractor:
    """Stable periodic orbit.

    Attributes
    ----------
    states : ndarray, shape (period, 2)
        Coordinate and velocity at the starts of the periods of the motion.
    multipliers : ndarray of complex, shape (2,)
        Eigenvalues of the derivative of the map over the period of the orbit; zero if the orbit contains a rest.
    impact_count, has_rest : int, bool
        Number of resolved impacts in one period, and whether the body comes to rest.
    """

    states: Floats
    multipliers: NDArray[np.complex128]
    impact_count: int
    has_rest: bool

    @property
    def period(self) -> int:
        """Period of the orbit, in periods of the motion."""
        return len(self.states)

    @property
    def name(self) -> str:
        """Description in words."""
        if self.impact_count == 0 and np.all(self.states[:, 1] == 0.0):
            return "rest"
        return f"period {self.period}, {'rest' if self.has_rest else format_count(self.impact_count, 'impact')}"


def find_attractor(strobe: StroboscopicMap, state: Floats, size: Floats) -> Attractor | None:
    """Find the periodic attractor on which a state has settled; None without a stable orbit."""
    orbit = strobe.orbit(state, 2 * MAX_PERIOD)
    distances = (np.abs(orbit[-1 - MAX_PERIOD : -1][::-1] - orbit[-1]) / size).max(axis=1)
    recurrences = np.flatnonzero(distances < RETURN_TOLERANCE)
    if recurrences.size == 0:
        return None
    period = int(recurrences[0]) + 1
    try:
        point, derivative = _find_fixed_point(strobe, orbit[-1], period, size)
    except (np.linalg.LinAlgError, OptionError):  # a multiplier of exactly 1; a step that leads behind a stop
        return None
    if np.isnan(point).any():
        return None
    for divisor in range(1, period):  # a slow approach may come close only twice in a period
        if period % divisor == 0 and np.abs((strobe(point, divisor) - point) / size).max() < 1e-3 * RETURN_TOLERANCE:
            return None
    multipliers = compute_multipliers(strobe, derivative)
    if compute_moduli(multipliers).max() >= 1.0:
        return None
    _, _, impacts = strobe.advance(point, period)
    return Attractor(strobe.orbit(point, period)[:-1], multipliers, int(impacts), not derivative.any())


def _find_fixed_point(strobe: StroboscopicMap, point: Floats, period: int, size: Floats) -> tuple[Floats, Floats]:
    """Find a fixed point near a state by Newton's method (NaN without), and the derivative of the map at this point."""
    start = point
    for _ in range(12):
        image, derivative = strobe.derivative(point, period)
        residual = image - point
        if not np.isfinite(derivative).all():
            break
        if np.abs(residual / size).max() < 1e-11:
            return point, derivative
        point = point + np.linalg.solve(np.eye(2) - derivative, residual) if derivative.any() else image
        if np.abs((point - start) / size).max() > np.sqrt(RETURN_TOLERANCE):
            break
    return np.full(2, np.nan), np.full((2, 2), np.nan)


def _create_trap(
    strobe: StroboscopicMap, attractor: Attractor, point: Floats, struct: Structs, size: Floats
) -> Floats | None:
    """Find an invariant neighbourhood of a point of an attractor, as a row for `kernels.periodic.iterate_periods`."""
    side, u, v = int(struct["side"]), float(struct["u"]), float(struct["v"])
    if side < 0:  # at rest, whatever the previous state
        return np.array([side, 0.0, 0.0, 0.0, 0.0, 0.0])
    _, derivative = strobe.derivative(point, attractor.period)
    norm_matrix, rate = _compute_contracting_norm(derivative, size)
    if not np.isfinite(norm_matrix).all():
        return None

    def is_trapping(offsets: Floats) -> bool:
        """Whether states around the point approach it, on the same side and with the same number of impacts."""
        in_front = offsets[u + offsets[:, 0] > 0.0]
        if np.any(u + offsets[:, 0] >= strobe._body_structs["overturn_angle"][0]) or len(in_front) == 0:
            return False
        samples = strobe._to_coordinates(u + in_front[:, 0], v + in_front[:, 1], np.full(len(in_front), side))
        images, derivatives = strobe.derivative(samples, attractor.period)
        if not np.isfinite(derivatives).all() or np.any(strobe._to_structs(images)[1]["side"] != side):
            return False
        if attractor.has_rest:
            target = strobe._to_coordinates(np.array([u]), np.array([v]), np.array([side]))[0]
            return bool(not derivatives.any() and np.abs((images - target) / size).max() < 1e-9)
        _, _, impacts = strobe.advance(samples, attractor.period)
        norms = np.linalg.norm(norm_matrix @ derivatives @ np.linalg.inv(norm_matrix), ord=2, axis=(1, 2))
        return bool(np.all(impacts == attractor.impact_count) and np.all(norms <= 0.5 * (1.0 + rate)))

    angles = 2.0 * np.pi * np.arange(_ANGLE_COUNT) / _ANGLE_COUNT
    rings = np.arange(1, _RING_COUNT + 1)[:, None, None] / _RING_COUNT
    disc = (rings * np.stack([np.cos(angles), np.sin(angles)], axis=-1)).reshape(-1, 2) @ np.linalg.inv(norm_matrix).T
    radius = 0.25  # relative to the size of the states
    while radius > 1e-7:
        # The checked neighbourhood is twice as large.
        offsets = 2.0 * radius * disc
        # A few angles of the outermost ring exclude most sizes quickly.
        if is_trapping(offsets[-_ANGLE_COUNT :: _ANGLE_COUNT // 4]) and is_trapping(offsets):
            form = norm_matrix.T @ norm_matrix / radius**2
            return np.array([side, u, v, form[0, 0], form[0, 1], form[1, 1]])
        radius *= 0.5
    return None


def _compute_contracting_norm(derivative: Floats, size: Floats) -> tuple[Floats, float]:
    """Find a matrix L and a rate such that |L M x| <= rate |L x|, and |L x| is at least |x| relative to the sizes.

    L is NaN if rounding error hides the eigenvalues of the derivative.
    """
    scale = np.diag(1.0 / size)
    M = scale @ derivative @ np.diag(size)
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

    #: Maximum number of states per search that do not lead to known attractors.
    MAX_TRIES: Final = 12

    def __init__(self, strobe: StroboscopicMap, size: Floats) -> None:
        self.strobe, self.size = strobe, size
        self.attractors: list[Attractor] = []
        self.traps, self.attractor_of_trap = np.empty((0, TRAP_COLUMNS)), np.empty(0, dtype=np.int64)

    def classify_or_search(self, states: Floats) -> Integers:
        """Return the attractor of each state, -1 for a state outside all traps, and search for new attractors."""
        _, structs = self.strobe._to_structs(states)
        indices = self.classify(structs)
        tries_left = self.MAX_TRIES
        while tries_left and (unsettled := np.flatnonzero(indices == -1)).size:
            first, new_index = unsettled[0], len(self.attractors)
            index = self._add_attractor(find_attractor(self.strobe, states[first], self.size))
            if index == new_index:
                traps = self.advance_to_traps(structs[unsettled], self.attractors[index].period)[0]
                indices[unsettled] = np.append(self.attractor_of_trap, -1)[traps]
            if index < 0 or index == new_index:  # known attractors do not count as tries
                tries_left -= 1
            indices[first] = index if index >= 0 else -2
        indices[indices == -2] = -1
        return indices

    def advance_to_traps(self, structs: Structs, max_periods: int) -> tuple[Integers, Integers]:
        """Advance states until they reach a trap; return the trap (or -1) and the number of periods of each state."""
        return self.strobe._iterate(structs, max_periods, traps=self.traps)

    def classify(self, structs: Structs) -> Integers:
        """Return the attractor of each state, -1 for a state outside all traps."""
        indices = np.full(len(structs), -1)
        for trap, index in zip(self.traps, self.attractor_of_trap, strict=True):
            du, dv = structs["u"] - trap[1], structs["v"] - trap[2]
            inside: Flags = trap[3] * du * du + 2.0 * trap[4] * du * dv + trap[5] * dv * dv <= 1.0
            indices[(structs["side"] == trap[0]) & inside & (indices == -1)] = index
        return indices

    def _add_attractor(self, attractor: Attractor | None) -> int:
        """Add an attractor if it is new, and return its index, or -1 if it has no trap."""
        if attractor is None:
            return -1
        for index, known in enumerate(self.attractors):
            if known.period == attractor.period:
                near = np.abs((known.states - attractor.states[0]) / self.size).max(axis=1)
                if near.min() < RETURN_TOLERANCE:
                    return index
        # Some points of a long orbit have a neighbourhood.
        points = attractor.states[select_evenly(attractor.period, 8)]
        pairs = zip(points, self.strobe._to_structs(points)[1], strict=True)
        traps = [row for pair in pairs if (row := _create_trap(self.strobe, attractor, *pair, self.size)) is not None]
        if not traps:
            return -1
        self.attractor_of_trap = np.append(self.attractor_of_trap, np.full(len(traps), len(self.attractors)))
        self.traps = np.concatenate([self.traps, traps])
        self.attractors.append(attractor)
        return len(self.attractors) - 1
