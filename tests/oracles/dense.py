"""A dense look at every arc of a response: was an impact missed, and does the arc end where it is said to?

Each arc is integrated afresh from the state at its start (closed form in the linear model, DOP853 in the
nonlinear one), sampled densely, and its lowest point between the samples searched.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from oracles.problem import OVERTURNED, Problem
from oracles.scipy_events import equation_of_motion

POINTS_PER_PIECE = 48
LAST_SHARE = 1e-3
"""Share of an arc before its end that is left out of the search, since rotation goes to zero there..."""
ROUNDING = 2.0**-50
"""... and share of the time: where the arc ends is known no better."""


@dataclass(frozen=True)
class Arc:
    """Start (time, side, |theta|, rate), end, and what ends it: "impact", "overturn" or "duration"."""

    start: float
    side: int
    rotation: float
    speed: float
    end: float
    ended_by: str
    speed_at_end: float


@dataclass(frozen=True)
class Finding:
    """Of one arc: the lowest |theta| / (time since start) inside, and the errors at the end.

    `time_error` (s) is the distance to the crossing by the tangent; `speed_error` is in rad/s.
    """

    arc: Arc
    lowest: float
    time_error: float
    speed_error: float


def arcs(
    events: list[tuple[float, str, int]],
    impacts: list[tuple[float, int, float, float]],
    end: float,
    *,
    rotation: float = 0.0,
    velocity: float = 0.0,
) -> list[Arc]:
    """Arcs between the listed events and impacts, without those that a proof of chattering has summed."""
    starts: list[tuple[float, int, str, float, float, float]] = []
    if rotation != 0.0 or velocity != 0.0:
        side = int(np.sign(rotation) or np.sign(velocity))
        starts.append((0.0, side, "start", 0.0, abs(rotation), side * velocity))
    starts += [(time, side, kind, 0.0, 0.0, 0.0) for time, kind, side in events]
    starts += [(time, side, "impact", before, 0.0, after) for time, side, before, after in impacts]
    starts.sort(key=lambda item: (item[0], ("start", "impact", "rest", "uplift", "overturn").index(item[2])))
    starts.append((end, 0, "duration", 0.0, 0.0, 0.0))
    found = []
    for (t0, side, kind, _, u, v), (t1, _, next_kind, w, _, _) in itertools.pairwise(starts):
        if kind in ("uplift", "impact", "start") and next_kind != "rest" and t1 > t0:
            found.append(Arc(t0, side, u, v, t1, next_kind, w))
    return found


def examine(problem: Problem, arc: Arc) -> Finding:
    """Integrate one arc afresh and compare."""
    lowest = np.inf
    u, v = arc.rotation, arc.speed
    for begin, end in _stretches(problem, arc):
        path = (
            _linear(problem, arc.side, begin, u, v)
            if problem.model == "linear"
            else _nonlinear(problem, arc.side, begin, end, u, v)
        )
        elapsed = begin - arc.start
        last = arc.end - LAST_SHARE * (arc.end - arc.start) - ROUNDING * arc.end
        span = min(end, last) - begin
        if span > 0.0:
            lowest = min(lowest, _lowest(path, elapsed, span))
        u, v = (float(x[0]) for x in path(np.array([end - begin])))
    if arc.ended_by == "duration":
        return Finding(arc, lowest, 0.0, 0.0)
    if arc.ended_by == "overturn":
        return Finding(arc, lowest, (u - OVERTURNED) / v, 0.0)
    return Finding(arc, lowest, u / v, v + arc.speed_at_end)


Path = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]


def _stretches(problem: Problem, arc: Arc) -> Iterator[tuple[float, float]]:
    time = arc.start
    while time < arc.end:
        end = min(problem.piece(time)[1], arc.end, time + 1.0 / problem.side(arc.side)[0])
        yield time, end
        time = end


def _lowest(path: Path, elapsed: float, span: float) -> float:
    """Smallest |theta| over the time since the start of the arc: the time divides the start's zero out."""

    def slope(s: NDArray[np.float64]) -> NDArray[np.float64]:
        return path(s)[0] / (elapsed + s)

    grid = np.linspace(0.0, span, POINTS_PER_PIECE + 1)[1:]
    values = slope(grid)
    lowest = float(np.min(values))
    inner = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:])) + 1
    for k in inner:
        refined = minimize_scalar(
            lambda s: float(slope(np.array([s]))[0]), bounds=(grid[k - 1], grid[k + 1]), method="bounded"
        )
        lowest = min(lowest, float(refined.fun))
    return lowest


def _linear(problem: Problem, side: int, time: float, u: float, v: float) -> Path:
    """Closed form within the piece that holds at `time`: cosh, sinh and their repeated integrals.

    With u'' = p^2 u + sum f_k s^k, u = u0 h_0 + v0 h_1 + sum f_k k! h_(k+2), where h_k is cosh(p s)
    integrated k times from zero.
    """
    p, alpha, _ = problem.side(side)
    start, _, coefficients = problem.piece(time)
    local = np.polynomial.Polynomial(coefficients)(np.polynomial.Polynomial([time - start, 1.0])).coef
    force = -p * p * side * local / problem.gravity
    force[0] -= p * p * alpha
    weights = [factorial(k) * f for k, f in enumerate(force)]

    def path(s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        h = [_integral_of_cosh(k, p, s) for k in range(len(weights) + 2)]
        rotation = u * h[0] + v * h[1] + sum(w * h[k + 2] for k, w in enumerate(weights))
        rate = u * p * p * h[1] + v * h[0] + sum(w * h[k + 1] for k, w in enumerate(weights))
        return rotation, rate

    return path


def _integral_of_cosh(k: int, p: float, s: NDArray[np.float64]) -> NDArray[np.float64]:
    """k-fold integral of cosh(p s) from zero; the terms are positive, so nothing cancels."""
    term = s**k / factorial(k)
    total = term.copy()
    n = k
    while np.max(term) > 1e-18 * np.max(total):
        term = term * (p * s) ** 2 / ((n + 1) * (n + 2))
        total += term
        n += 2
    return total


def _nonlinear(problem: Problem, side: int, begin: float, end: float, u: float, v: float) -> Path:
    scale = max(abs(v), 1e-5 * (end - begin))
    solution = solve_ivp(
        equation_of_motion(problem, side, begin),
        (0.0, end - begin),
        (u, v),
        method="DOP853",
        dense_output=True,
        rtol=1e-13,
        atol=1e-14 * scale * np.array([min(1.0, end - begin), 1.0]),
    ).sol

    def path(s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rotation, rate = solution(s)
        return rotation, rate

    return path
