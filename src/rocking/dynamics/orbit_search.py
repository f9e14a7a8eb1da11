"""Search for periodic orbits: Newton's method on the stroboscopic map, from many starts."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Flags, Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.orbits import SAME, PeriodicOrbit, orbit_at
from rocking.dynamics.repeated import mean_size, scale_of
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.treatment import Treatment

#: Starts of a search, where none are given.
_STARTS: Final = 1024

#: Newton steps of a search, how often one that does not bring a state nearer is halved, and periods after which every
#: so many-th start is given once more: it is then near what attracts it.
_NEWTON_STEPS: Final = 40

_HALVINGS: Final = 5

_LATER: Final = 60

_EVERY: Final = 8

#: Residual of an orbit, over the scale of its states and the size of the derivative.
_RESIDUAL: Final = 1e-11

#: Largest residual: what comes back no nearer is called no orbit, however large the derivative.
_LARGEST_RESIDUAL: Final = 1e-6

#: Speeds of starts: least and greatest gain over the impulse of a period, and what a block that overturns has at most.
_LEAST_GAIN: Final = 0.5

_MOST_GAIN: Final = 20.0

_BLOCK_SPEED: Final = 2.0


def periodic_orbits(
    body: Body,
    motion: Motion,
    *,
    period: int = 1,
    model: Model | None = None,
    chattering: str | Treatment = "certified",
    starts: ArrayLike | int | None = None,
) -> list[PeriodicOrbit]:
    """Periodic orbits of a body under periodic motion, stable and unstable ones.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        What moves.
    motion : Motion
        One period, which repeats for ever: as ``pulses.sine(a, f, cycles=1)``.
    period : int
        Periods of the motion after which orbits repeat. Those of a shorter period that divides it are found as well.
    model : {"nonlinear", "linear"}, optional
        Equation of motion; by default nonlinear of a body that rocks.
    chattering : str or treatment
        As for `rocking.simulate`.
    starts : int or array_like, shape (..., 2), optional
        Number of states from which orbits are looked for, or these states; by default about a thousand: impacts at all
        phases and speeds, states between them, rests, and what becomes of some of these.

    Returns
    -------
    list of PeriodicOrbit
        Each once, those with the shortest period first, then those with the fewest impacts. There may be others, which
        no start led to.

    Raises
    ------
    InvalidMotion
        If the motion is none, or has no length.
    InvalidOption
        If the period is no whole number from 1, the model is not one of the body's, or a start is behind a stop.

    Notes
    -----
    Newton's method solves P^n(x) = x for all starts at once, with the derivative of the stroboscopic map P. Where that
    is exactly zero, after a proven rest, a step of it is the map itself.

    References
    ----------
    J. M. T. Thompson and H. B. Stewart, "Nonlinear Dynamics and Chaos", 2nd edition, Wiley (2002), chapter 15.

    Examples
    --------
    A ball on a table that goes up and down with 1.2 g bounces once a period, in two ways, or rests every period:

    >>> from rocking import dynamics, pulses
    >>> ball, table = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(12.0, 5.0, cycles=1)
    >>> for orbit in dynamics.periodic_orbits(ball, table):
    ...     print(orbit)
    <PeriodicOrbit: unstable orbit of 1 period with 1 impact, multipliers 2.47, 0.101>
    <PeriodicOrbit: stable orbit of 1 period with 1 impact, multipliers -0.0342 + 0.499i, -0.0342 - 0.499i>
    <PeriodicOrbit: stable orbit of 1 period with complete chattering, multipliers 0, 0>
    """
    count = checks.whole(period, "period", InvalidOption, least=1)
    strobe = StroboscopicMap(body, motion, model, chattering)
    search = _Search(strobe, count)
    found = search.converged(search.starts(starts))
    orbits = [search.orbit(state) for state in search.distinct(found)]
    return search.without_repeats(orbits)


class _Search:
    """Looks for states that come back after some periods."""

    def __init__(self, strobe: StroboscopicMap, count: int) -> None:
        self.strobe, self.count = strobe, count
        self.scale = scale_of(strobe)

    def starts(self, given: ArrayLike | int | None) -> Floats:
        """States to start from: those given, or about as many as are wanted."""
        if given is not None and np.ndim(given) > 0:
            return self.strobe.checked_starts(given, "starts")
        wanted = _STARTS if given is None else checks.whole(given, "starts", InvalidOption, least=1)
        strobe, (low, high) = self.strobe, self.strobe.body.stops
        both = strobe._is_two_sided
        speed = self._fastest()
        side = max(2, round(math.sqrt(wanted / (2 if both else 1))))
        phases = strobe.period * (np.arange(side) + 0.5) / side
        speeds = speed * ((np.arange(side) + 0.5) / side) ** 1.5
        impacts = np.stack(np.meshgrid(phases, speeds), axis=-1).reshape(-1, 2)
        if both:
            impacts = np.concatenate([impacts, impacts * [1.0, -1.0]])
        few = np.linspace(-0.9, 0.9, max(2, side // 4))
        width = high - low if strobe._records[0]["two_stops"] else self.scale.coordinate
        at = 0.5 * (low + high) + 0.5 * width * few if both else low + width * (1.0 + few)
        between = np.stack(np.meshgrid(at, speed * few), axis=-1).reshape(-1, 2)
        rests = np.array([[stop, 0.0] for stop in {low, high}])
        states = np.concatenate([rests, between, strobe.from_impacts(impacts)])
        states = states[self._possible(states)]
        later = strobe(states[::_EVERY], _LATER * self.count)
        return np.concatenate([states, later[self._possible(later)]])

    def _fastest(self) -> float:
        """Return a speed that impacts of an orbit of so many periods hardly exceed."""
        strobe = self.strobe
        restitution = float(np.max(strobe.bodies.restitution))
        gain = restitution / max(1.0 - restitution, 1e-300)
        push = self.count * strobe.period * mean_size(strobe.motion)
        speed = min(max(gain, _LEAST_GAIN), _MOST_GAIN) * push or self.scale.velocity
        record = strobe._records[0]
        if not math.isinf(min(strobe.body.balance)):
            return min(speed, _BLOCK_SPEED * self.scale.velocity + push)
        if float(record["stiffness"][0]) == 0.0:  # A ball flies for as long as its speed lets it.
            pull = float(record["threshold_slope"][0] * record["threshold"][0])
            return min(speed, 0.5 * self.count * strobe.period * pull + push)
        return speed

    def _possible(self, states: Floats) -> Flags:
        """Which states a body may have."""
        record, (low, high) = self.strobe._records[0], self.strobe.body.stops
        x, v = states.T
        fine: Flags = np.all(np.isfinite(states), axis=-1)
        if self.strobe._is_two_sided and not record["two_stops"]:
            fine &= np.abs(x) < record["overturn_angle"]
            return fine
        if record["two_stops"]:
            fine &= (x <= high) & ~((x == high) & (v > 0.0))
        fine &= (x >= low) & ~((x == low) & (v < 0.0))
        return fine

    def _mapped(self, states: Floats, count: int) -> tuple[Floats, Floats]:
        """States after periods and their derivatives; NaN of those that no body may have."""
        after, change = np.full(states.shape, np.nan), np.full((*states.shape, 2), np.nan)
        fine = self._possible(states)
        after[fine], change[fine] = self.strobe.derivative(states[fine], count)
        return after, change

    def converged(self, states: Floats, count: int = 0) -> Floats:
        """States that come back after so many periods, to which Newton's method leads from others."""
        count = count or self.count
        x = states.copy()
        after, change = self._mapped(x, count)
        done = np.zeros(len(x), dtype=bool)
        for _ in range(_NEWTON_STEPS):
            residual = self._size(after - x)
            sharp = residual < _tolerance(change)
            finished = done & sharp
            open_ = np.flatnonzero(~finished & np.isfinite(residual))
            if not len(open_):
                break
            done |= sharp  # One more step after the first that is sharp.
            step = _newton_step(x[open_], after[open_], change[open_])
            new, new_after, new_change = x[open_].copy(), after[open_].copy(), change[open_].copy()
            better = np.zeros(len(open_), dtype=bool)
            for halving in range(_HALVINGS):
                left = np.flatnonzero(~better)
                tried = x[open_[left]] + 0.5**halving * step[left]
                tried_after, tried_change = self._mapped(tried, count)
                # A step that is sharp already need not come nearer: it only rounds in another way.
                near = self._size(tried_after - tried) < residual[open_[left]]
                better[left] = near
                chosen = left[near]
                new[chosen], new_after[chosen], new_change[chosen] = tried[near], tried_after[near], tried_change[near]
            stuck = ~better & ~sharp[open_]
            if np.any(stuck):  # The map itself leads to what attracts.
                moved = new_after[stuck]
                new[stuck] = moved
                new_after[stuck], new_change[stuck] = self._mapped(moved, count)
            x[open_], after[open_], change[open_] = new, new_after, new_change
        residual = self._size(after - x)
        good = residual < _tolerance(change)
        found: Floats = x[good]
        return found

    def _size(self, differences: Floats) -> Floats:
        with np.errstate(invalid="ignore", over="ignore"):
            found: Floats = np.max(np.abs(differences) / self.scale, axis=-1)
            return found

    def distinct(self, states: Floats) -> Floats:
        """States of which no two are the same."""
        kept = np.empty((0, 2))
        for state in states:
            if not len(kept) or np.min(self._size(kept - state)) > SAME:
                kept = np.vstack([kept, state])
        return kept

    def orbit(self, state: Floats) -> PeriodicOrbit:
        """Orbit of a state, with its least period."""
        for count in range(1, self.count):
            if self.count % count == 0:
                after = self.strobe(state, count)
                if self._size(after - state) < math.sqrt(SAME):
                    (*found,) = self.converged(state[None], count)
                    if found and self._size(found[0] - state) < SAME:
                        return orbit_at(self.strobe, found[0], count)
        return orbit_at(self.strobe, state, self.count)

    def without_repeats(self, orbits: list[PeriodicOrbit]) -> list[PeriodicOrbit]:
        """Orbits of which no two are the same, the shortest first."""
        kept: list[PeriodicOrbit] = []
        for each in orbits:
            shifts = [np.roll(each.states, k, axis=0) for k in range(each.period)]
            same = (other for other in kept if other.period == each.period)
            if not any(np.max(self._size(shift - other.states)) < SAME for other in same for shift in shifts):
                kept.append(each)
        return sorted(kept, key=lambda each: (each.period, each.impacts, *each.state))


def _tolerance(change: Floats) -> Floats:
    """Residual, over the scale, up to which a state comes back: rounding grows with the derivative, to a limit."""
    found: Floats = np.minimum(_RESIDUAL * np.maximum(1.0, np.max(np.abs(change), axis=(-2, -1))), _LARGEST_RESIDUAL)
    return found


def _newton_step(x: Floats, after: Floats, change: Floats) -> Floats:
    """Newton's steps towards fixed points; where that is none, a step of the map."""
    jacobian, residual = change - np.eye(2), after - x
    with np.errstate(all="ignore"):
        determinant = np.linalg.det(jacobian)
        a, b, c, d = (jacobian[:, i, j] for i in (0, 1) for j in (0, 1))
        r, s = residual.T
        step: Floats = np.stack([b * s - d * r, c * r - a * s], axis=-1) / determinant[:, None]
    plain = ~np.all(np.isfinite(step), axis=1)
    step[plain] = residual[plain]
    return step
