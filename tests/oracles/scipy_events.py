"""A whole response by SciPy's DOP853.

`integrate` restarts at every breakpoint of the motion and at every impact and is accurate to the last digits.
`integrate_as_practised` restarts at impacts only, as one would for a study: the benchmark's baseline.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import OdeSolution, solve_ivp
from scipy.optimize import brentq

from oracles.problem import OVERTURNED, Problem

POINTS_PER_STEP = 24


@dataclass
class Run:
    """What happened: (time, kind, side), (time, side entered, speed before, speed after), largest |theta|."""

    events: list[tuple[float, str, int]] = field(default_factory=list)
    impacts: list[tuple[float, int, float, float]] = field(default_factory=list)
    peak: float = 0.0
    peak_time: float = 0.0
    overturned: bool = False

    def note_peak(self, time: float, rotation: float) -> None:
        if rotation > self.peak:
            self.peak, self.peak_time = rotation, time


def integrate(
    problem: Problem,
    *,
    until: float = np.inf,
    rotation: float = 0.0,
    velocity: float = 0.0,
    rtol: float = 1e-12,
    atol: float = 1e-18,
    rest_speed: float = 1e-11,
) -> Run:
    """Follow the block from `rotation`, `velocity` at time zero to rest for good, overturning or `until`.

    Chattering ends where the speed after an impact falls below `rest_speed` while the ground presses the
    block down on both sides; the geometric sum of the arcs that would follow is added to the time.
    """
    run = Run()
    time = 0.0
    side, u, v = _initial_side(rotation, velocity)
    if side == 0:
        time, side = _uplift(problem, run, time)
    while time < until and side != 0 and not run.overturned:
        time, w = _arc(problem, run, time, side, u, v, until, rtol, atol)
        if time >= until or run.overturned:
            break
        u, v = 0.0, problem.side(side)[2] * w
        side = -side
        run.impacts.append((time, side, w, v))
        if v < rest_speed and min(problem.restoring(time, 1), problem.restoring(time, -1)) > 0.0:
            time += _geometric_tail(problem, time, side, v)
            run.events.append((time, "rest", 0))
            v = 0.0
            time, side = _uplift(problem, run, time)
    return run


def _initial_side(rotation: float, velocity: float) -> tuple[int, float, float]:
    side = int(np.sign(rotation) or np.sign(velocity))
    return side, abs(rotation), side * velocity


def _uplift(problem: Problem, run: Run, time: float) -> tuple[float, int]:
    time, side = problem.next_uplift(time)
    if side != 0:
        run.events.append((time, "uplift", side))
    return time, side


def _geometric_tail(problem: Problem, time: float, side: int, speed: float) -> float:
    here, there = problem.side(side)[2], problem.side(-side)[2]
    first = 2.0 * speed / problem.restoring(time, side)
    second = 2.0 * here * speed / problem.restoring(time, -side)
    return (first + second) / (1.0 - here * there)


def _arc(
    problem: Problem,
    run: Run,
    time: float,
    side: int,
    u: float,
    v: float,
    until: float,
    rtol: float,
    atol: float,
) -> tuple[float, float]:
    """End of the arc and speed there; u = |theta|, v its rate. Each step runs in time from its own start."""
    while time < until:
        end = min(problem.piece(time)[1], until)
        span = min(end - time, _sensible_span(problem, time, side, u, v))
        solution = solve_ivp(
            equation_of_motion(problem, side, time),
            (0.0, span),
            (u, v),
            method="DOP853",
            dense_output=True,
            rtol=rtol,
            atol=atol,
        ).sol
        overturn = _first_passing(lambda s, f=solution: f(s)[0] - OVERTURNED, solution)
        impact = _first_passing(lambda s, f=solution: -f(s)[0], solution)
        _note_peak(run, time, solution, min(impact, overturn, span))
        if overturn < impact:
            run.overturned = True
            run.note_peak(time + overturn, OVERTURNED)
            run.events.append((time + overturn, "overturn", side))
            return time + overturn, float(solution(overturn)[1])
        if impact < np.inf:
            return time + impact, -float(solution(impact)[1])
        time = end if span == end - time else time + span
        u, v = solution(span)
    return time, v


def _sensible_span(problem: Problem, time: float, side: int, u: float, v: float) -> float:
    """Length to integrate at once: an arc can be much shorter than a piece of the motion."""
    restoring = problem.restoring(time, side)
    return 4.0 * v / restoring if u == 0.0 and v > 0.0 and restoring > 0.0 else 2.0 / problem.side(side)[0]


def equation_of_motion(problem: Problem, side: int, time: float) -> Callable[..., tuple[float, float]]:
    """Right side f(s, (u, u')) of the equation of motion, s = t - time, in the piece that holds at `time`."""
    p, alpha, _ = problem.side(side)
    horizontal, vertical = (
        (time - start, coefficients[::-1].tolist())
        for start, _, coefficients in (problem.piece(time), problem.vertical_piece(time))
    )

    def over_gravity(component: tuple[float, list[float]], s: float) -> float:
        offset, descending = component
        a = 0.0
        for c in descending:
            a = a * (offset + s) + c
        return a / problem.gravity

    def push(s: float) -> float:
        return side * over_gravity(horizontal, s)

    def weight(s: float) -> float:
        return 1.0 + over_gravity(vertical, s)

    def linear(s: float, y: NDArray[np.float64]) -> tuple[float, float]:
        return y[1], p * p * (weight(s) * (y[0] - alpha) - push(s))

    def nonlinear(s: float, y: NDArray[np.float64]) -> tuple[float, float]:
        return y[1], -p * p * (weight(s) * sin(alpha - y[0]) + push(s) * cos(alpha - y[0]))

    return linear if problem.model == "linear" else nonlinear


def _first_passing(function: Callable[[float], float], solution: OdeSolution) -> float:
    """First instant after the start at which `function` becomes positive, inf where it does not."""
    edges = solution.ts
    grid = np.unique(np.concatenate([np.linspace(*ab, POINTS_PER_STEP) for ab in itertools.pairwise(edges)]))
    values = np.array([function(t) for t in grid])
    positive = np.flatnonzero(values[1:] > 0.0)
    if len(positive) == 0:
        return np.inf
    k = int(positive[0])
    if values[k] == 0.0 or k == 0:
        grid[k] += 1e-6 * (grid[k + 1] - grid[k])
    return float(brentq(function, grid[k], grid[k + 1], xtol=1e-300, rtol=4 * np.finfo(float).eps))


def _note_peak(run: Run, time: float, solution: OdeSolution, end: float) -> None:
    grid = np.linspace(0.0, end, POINTS_PER_STEP)
    u, v = solution(grid)
    run.note_peak(time + float(grid[np.argmax(u)]), float(np.max(u)))
    for k in np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0)):
        top = brentq(lambda s: solution(s)[1], grid[k], grid[k + 1], xtol=1e-14)
        run.note_peak(time + top, float(solution(top)[0]))


def integrate_as_practised(
    samples: NDArray[np.float64],
    dt: float,
    problem: Problem,
    *,
    rtol: float,
    atol: float,
    max_step: float,
    rest_speed: float,
) -> float:
    """Peak |theta| under evenly spaced samples (m/s^2): one `solve_ivp` per arc, ended by its event function.

    A block slower than `rest_speed` after an impact stays at rest until the samples pass a threshold.
    """
    last = (len(samples) - 1) * dt
    acceleration = _interpolated(samples, dt)
    lower, upper = -problem.threshold(1), problem.threshold(-1)
    outside = (samples < lower) | (samples > upper)
    time, side, v, peak = 0.0, 0, 0.0, 0.0
    while time < last:
        if side == 0:
            time, side = _uplift_between_samples(samples, dt, lower, upper, outside, time)
            v = 0.0
            continue
        arc = _practised_arc(problem, acceleration, time, last, side, v, rtol, atol, max_step)
        tops = [float(y[0]) for y in arc.y_events[2]]
        peak = max([peak, float(np.max(arc.y[0])), *tops])
        if len(arc.t_events[0]) == 0:
            break
        time, v, side = float(arc.t[-1]), -problem.side(side)[2] * float(arc.y[1, -1]), -side
        if v < rest_speed and lower < acceleration(time) < upper:
            side = 0
    return peak


def _interpolated(samples: NDArray[np.float64], dt: float) -> Callable[[float], float]:
    values = [*samples.tolist(), 0.0]
    n = len(samples) - 1

    def acceleration(t: float) -> float:
        x = t / dt
        k = min(int(x), n)
        return values[k] + (x - k) * (values[k + 1] - values[k])

    return acceleration


def _uplift_between_samples(
    samples: NDArray[np.float64],
    dt: float,
    lower: float,
    upper: float,
    outside: NDArray[np.bool_],
    time: float,
) -> tuple[float, int]:
    """Instant at which the line to the first sample outside the thresholds crosses one, or (inf, 0)."""
    first = int(time / dt) + 1
    k = first + int(np.argmax(outside[first:]))
    if first >= len(samples) or not outside[k]:
        return np.inf, 0
    side, threshold = (1, lower) if samples[k] < lower else (-1, upper)
    share = (threshold - samples[k - 1]) / (samples[k] - samples[k - 1])
    return max(time, (k - 1 + share) * dt), side


def _practised_arc(
    problem: Problem,
    acceleration: Callable[[float], float],
    time: float,
    last: float,
    side: int,
    v: float,
    rtol: float,
    atol: float,
    max_step: float,
) -> Any:
    p, alpha, _ = problem.side(side)
    gravity, stiffness = problem.gravity, p * p

    def linear(t: float, y: NDArray[np.float64]) -> tuple[float, float]:
        return y[1], stiffness * (y[0] - alpha - side * acceleration(t) / gravity)

    def nonlinear(t: float, y: NDArray[np.float64]) -> tuple[float, float]:
        lean = alpha - y[0]
        return y[1], -stiffness * (sin(lean) + side * acceleration(t) / gravity * cos(lean))

    def impact(t: float, y: NDArray[np.float64]) -> float:
        return y[0]

    def overturn(t: float, y: NDArray[np.float64]) -> float:
        return y[0] - OVERTURNED

    def top(t: float, y: NDArray[np.float64]) -> float:
        return y[1]

    impact.terminal = overturn.terminal = True  # type: ignore[attr-defined]
    impact.direction = top.direction = -1.0  # type: ignore[attr-defined]
    first_step = min(max_step, v / (stiffness * alpha)) if v > 0.0 else None
    return solve_ivp(
        linear if problem.model == "linear" else nonlinear,
        (time, last),
        (0.0, v),
        method="DOP853",
        events=(impact, overturn, top),
        rtol=rtol,
        atol=atol,
        max_step=max_step,
        first_step=first_step and min(first_step, last - time),
    )
