"""Courses of periodic orbits: one period as a simulation, and what it shows of impacts that graze or nearly do."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.simulation import simulate_any
from rocking.motion.motion import Motion
from rocking.response import Response

#: Points at which a period is looked at for extremes, and bisections by which these are found.
_LOOKS: Final = 64
_REFINED: Final = 40


class Course(NamedTuple):
    """What a period of an orbit shows: greatest coordinate, slowest impact, least gap, and the phases of impacts."""

    peak: float
    slowest: float
    gap: float
    phases: Floats


def response_of(strobe: StroboscopicMap, state: Floats, periods: int) -> Response:
    """Course of a body from a state on, over so many periods."""
    motion, duration = strobe.motion, periods * strobe.period
    # One period more: what comes after the end decides how long a chattering sequence lasts.
    starts = strobe.period * np.arange(periods + 1)
    breakpoints = np.append((starts[:, None] + motion.breakpoints[:-1]).ravel(), strobe.period * (periods + 1))
    many = Motion(
        breakpoints, np.tile(motion.coefficients, (periods + 1, 1)), motion.name, motion.description, error=motion.error
    )
    return simulate_any(
        strobe.body, many, model=strobe.model, chattering=strobe.treatment, duration=duration,
        initial_position=float(state[0]), initial_velocity=float(state[1]),
    )  # fmt: skip


def course_of(strobe: StroboscopicMap, state: Floats, periods: int) -> Course:
    """Extremes of the course of a body over so many periods."""
    response = response_of(strobe, state, periods)
    duration, impacts = response.duration, response.impacts
    times = np.linspace(0.0, duration, _LOOKS * periods + 1)
    states = response.states(times)
    # A gap is least where the velocity passes zero between impacts.
    ends = np.concatenate([[0.0], impacts["time"], [duration]])
    inner = np.searchsorted(ends, times, side="right")
    v = states[:, 1]
    crossing = np.flatnonzero((v[1:] * v[:-1] < 0.0) & (inner[1:] == inner[:-1]))
    low, high = times[crossing], times[crossing + 1]
    rising = v[crossing] < 0.0
    for _ in range(_REFINED if len(crossing) else 0):
        middle = 0.5 * (low + high)
        before = (response.states(middle)[:, 1] < 0.0) == rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    at = response.states(0.5 * (low + high))[:, 0]
    gaps = _gaps(strobe, at, rising)
    open_ = gaps[gaps > 0.0]
    hits = response.states(impacts["time"])[:, 0]  # at a second stop the coordinate may be greatest
    peak = float(np.max(np.abs(np.concatenate([states[:, 0], at, hits]))))
    slowest = float(np.min(impacts["speed_before"])) if len(impacts) else math.inf
    return Course(
        peak, slowest, float(np.min(open_)) if len(open_) else math.inf, np.mod(impacts["time"], strobe.period)
    )


def _gaps(strobe: StroboscopicMap, at: Floats, lowest: Flags) -> Floats:
    """Distances to what a body nearly hits where its coordinate is lowest, or else highest; infinite to nothing."""
    low, high = strobe.body.stops
    upper = high - at if strobe._is_two_sided else np.full(len(at), math.inf)
    found: Floats = np.where(lowest, at - low, upper)
    return found
