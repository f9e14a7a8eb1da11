"""Forces of the ground on a body at any time, their greatest values, and the friction that sticking needs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.block.body import ContactLaw
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.bisection import bisected
from rocking.errors import InvalidOption
from rocking.kernels.ground import components
from rocking.motion import piecewise
from rocking.response.history import History, elongation, plastic_elongations

#: Samples per step, and rounds of sampling again around the largest, when the forces' extremes are searched.
_SAMPLES: Final = 9
_REFINEMENTS: Final = 10

#: Coefficients of friction beyond those of any two materials.
_ROUGHEST: Final = 3.0

#: What is asked of the horizontal and the vertical force over the weight.
Measure = Callable[[Floats, Floats], Floats]


def friction_coefficient(value: object) -> float:
    """Return a coefficient of friction; refuse one that is not positive, or larger than that of any two materials."""
    coefficient = checks.positive(value, "friction", InvalidOption)
    if coefficient > _ROUGHEST:
        raise InvalidOption(
            "{} must be a coefficient (friction over normal force, about 0.6 of stone on stone) of at most "
            f"{_ROUGHEST:g}, not {coefficient:g}; of an angle of friction take the tangent",
            "friction",
            value=value,
        )
    return coefficient


def friction_demand(horizontal: Floats, vertical: Floats) -> Floats:
    """Friction coefficient that sticking needs: |H|/N, infinite where the block would leave the ground, NaN of NaN."""
    demand = np.where(np.isnan(vertical), np.nan, np.inf)
    np.divide(np.abs(horizontal), vertical, out=demand, where=vertical > 0.0)
    return demand


def pull(_: Floats, vertical: Floats) -> Floats:
    """Return how much the ground would have to pull: the normal force's opposite."""
    return -vertical


def _reach(values: Floats) -> Floats:
    """How high a smooth quantity may rise within each step: above its samples by less than they span."""
    return np.asarray(2.0 * values.max(axis=1) - values.min(axis=1))


@dataclass(frozen=True, eq=False)
class Contact:
    """Horizontal and vertical force of the ground over the weight, up to the time `until` (s).

    Within a step the forces are smooth; both limits at every impact and at every jump of the motion are looked at. The
    impulses at impacts are not part of it.
    """

    history: History
    law: ContactLaw
    until: float

    @cached_property
    def _plastic(self) -> Floats:
        return plastic_elongations(self.history.trail)

    def forces(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Both forces at times of any shape; NaN outside the response."""
        times = checks.numbers(time, "time", InvalidOption)
        flat = times.ravel()
        outside = self.history.outside(flat)
        within = np.where(outside, 0.0, flat)
        horizontal, vertical = self._forces_in(within, self.history.rows(within))
        horizontal[outside] = vertical[outside] = np.nan
        return horizontal.reshape(times.shape), vertical.reshape(times.shape)

    def extremes(self) -> tuple[float, float]:
        """Largest friction that sticking needs, and least normal force, from the same samples."""
        times, rows = self._samples()
        horizontal, vertical = (force.reshape(times.shape) for force in self._forces_in(times.ravel(), rows.ravel()))
        friction, least = float(friction_demand(horizontal, vertical).max()), float(vertical.min())

        def refined(measure: Measure, beyond: Floats) -> float:
            """Largest value of a measure in the steps where what is positive beyond the samples may be so."""
            near = np.flatnonzero(_reach(beyond) > 0.0)
            return float(self._peaks(measure, times[near], rows[near])[1].max(initial=-math.inf))

        if math.isfinite(friction):
            # Unlike the demand it is smooth, and bounded, where the normal force nearly vanishes.
            friction = max(friction, refined(friction_demand, np.abs(horizontal) - friction * vertical))
        return friction, min(least, -refined(pull, least - vertical))

    def first(self, measure: Measure, is_beyond: Callable[[Floats], Flags]) -> float:
        """First time, s, at which a measure is beyond a level, as then all greater values are; NaN if it never is."""
        times, rows = self._samples()
        values = self._measured(measure, times, rows)
        near = np.flatnonzero(is_beyond(_reach(values)))
        if not len(near):
            return math.nan
        at, peaks = self._peaks(measure, times[near], rows[near])
        passing = np.flatnonzero(is_beyond(peaks))
        if not len(passing):
            return math.nan
        step = near[passing[0]]
        looks = np.append(times[step], at[passing[0]])
        beyond = is_beyond(np.append(values[step], peaks[passing[0]]))
        high = float(looks[beyond].min())
        before = looks[~beyond & (looks < high)]
        if not len(before):
            return high  # at once: a jump

        def passes(time: float) -> bool:
            return bool(is_beyond(self._measured(measure, np.array([time]), rows[step, :1]))[0])

        return bisected(float(before.max()), high, passes)[1]

    def _peaks(self, measure: Measure, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Where each of some steps has its largest value, and that value."""
        at, best = times[:, 0], np.full(len(times), -np.inf)
        for _ in range(_REFINEMENTS):
            values = self._measured(measure, times, rows)
            place = values.argmax(axis=1)[:, None]
            value, where = (np.take_along_axis(array, place, axis=1)[:, 0] for array in (values, times))
            at, best = np.where(value > best, where, at), np.maximum(value, best)
            low = np.take_along_axis(times, np.maximum(place - 1, 0), axis=1)
            high = np.take_along_axis(times, np.minimum(place + 1, times.shape[1] - 1), axis=1)
            times = low + (high - low) * np.linspace(0.0, 1.0, times.shape[1])
        return at, best

    def _measured(self, measure: Measure, times: Floats, rows: Integers) -> Floats:
        return measure(*self._forces_in(times.ravel(), rows.ravel())).reshape(times.shape)

    def _forces_in(self, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Compute the forces in the steps that start at these rows: on the side and under the piece of each."""
        theta, rate, acceleration = self.history.states_in(times, rows).T
        side = self.history.trail.nodes["side"][rows]
        ground = self._ground_in(times, rows, side < 0)
        stretch = elongation(self.history.trail, np.abs(theta), side) - self._plastic[rows]
        return self.law((theta, rate, acceleration), ground, side, stretch)

    def _ground_in(self, times: Floats, rows: Integers, at_rest: Flags) -> tuple[Floats, Floats]:
        """Both ground accelerations in g: in the piece where a step starts; at rest, which may span many, anywhere."""
        ground = self.history.trail.ground
        anywhere = np.maximum(np.searchsorted(ground.pieces[:, 0], times, side="right") - 1, 0)
        piece = np.where(at_rest, anywhere, self.history.trail.nodes["piece"][rows])
        elapsed = np.maximum(times - ground.pieces[piece, 0], 0.0)
        push, *lift = (piecewise.value(coefficients, elapsed) for coefficients in components(ground, piece))
        return push, lift[0] if lift else np.zeros_like(push)

    def _samples(self) -> tuple[Floats, Integers]:
        """Sample every step, and at rest every piece of the motion, ends included and in order; with their steps."""
        nodes = self.history.trail.nodes
        corners = self.history.trail.ground.pieces[:, 0]
        corners = corners[nodes["side"][self.history.rows(corners)] < 0]
        starts = np.unique(np.concatenate([nodes["time"], corners]))
        starts = starts[(starts < self.until) | (starts == starts[0])]
        if nodes["side"][self.history.rows(np.array([self.until]))[0]] < 0:
            starts = np.union1d(starts, [self.until])  # what the motion is after a jump at the end
        ends = np.append(starts[1:], max(self.until, starts[-1]))
        rows = self.history.rows(starts)
        fractions = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _SAMPLES))
        times = starts[:, None] + fractions * (ends - starts)[:, None]
        resting = nodes["side"][rows] < 0  # what the motion is before a jump
        times[resting, -1] = np.maximum(np.nextafter(times[resting, -1], 0.0), times[resting, 0])
        return times, np.repeat(rows[:, None], _SAMPLES, axis=1)
