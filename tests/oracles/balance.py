"""Blocks that start next to their balance, at rest or on the way to it, and when they truly come to rest.

In the linear model under straight pieces of motion, or none, an arc is a closed form in 40 digits:
u = held + rate t + x cosh(p t) + y sinh(p t), of which (x + y)/2 grows. A block whose growing part is a small share q
of its slenderness lingers, and whatever rounding adds to q is magnified by 1/q. The nonlinear model is followed by
`multiprecision`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import MPContext

import rocking
from oracles import multiprecision
from oracles.problem import Problem

mp = MPContext()
mp.dps = 40
GRAVITY = 9.80665
LOOKS = 32
"""Looks per arc and piece for the first impact."""
NOTHING = mp.mpf(10) ** -13
"""Speed over p alpha from which the impacts that are left are a geometric series to a share of its square."""


@dataclass(frozen=True)
class Case:
    """A block of two equal sides, pieces of motion (m/s^2, m/s^3; of these lengths, s) and a start on side +."""

    model: str
    p: float
    alpha: float
    restitution: float
    share: float
    breakpoints: tuple[float, ...]
    rows: tuple[tuple[float, float], ...]
    rotation: float
    velocity: float

    def simulate(self, **options: Any) -> rocking.Response:
        block = rocking.Block.from_parameters(p=self.p, alpha=self.alpha, restitution=self.restitution)
        motion = rocking.Motion(np.array(self.breakpoints), np.array(self.rows)) if self.rows else None
        start = {"initial_rotation": self.rotation, "initial_velocity": self.velocity}
        return rocking.simulate(block, motion, model=self.model, **start, **options)

    def rest(self) -> Any:
        """Instant of the first rest; None where the block overturns."""
        return _nonlinear_rest(self) if self.model == "nonlinear" else _linear_rest(self)


def case(seed: int, number: int, model: str = "linear") -> Case:
    """Case of that number: p 0.5 to 20 rad/s, alpha 0.02 to 0.6, restitution 0.1 to 0.95, q 1e-8 to 0.1.

    A third are free, a third under constant pieces and a third under straight ones, each below half the threshold.
    """
    rng = np.random.default_rng([seed, number])
    p, alpha = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0)))), float(rng.uniform(0.02, 0.6))
    e, q = float(rng.uniform(0.1, 0.95)), float(10.0 ** rng.uniform(-8.0, -1.0))
    count = 0 if number % 3 == 0 else int(rng.integers(1, 6))
    lengths = rng.uniform(0.05, 2.0, count) / p
    lengths[:1] *= -np.log(q)  # about as long as the block lingers
    breakpoints = np.cumsum([0.0, *lengths])
    levels = rng.uniform(-0.5, 0.5, count + 1) * alpha * GRAVITY
    slopes = np.diff(levels) / np.diff(breakpoints) * (number % 3 == 2)
    rows = tuple(zip(levels[:count].tolist(), slopes.tolist(), strict=True))
    push, rate = (rows[0][0] / GRAVITY, rows[0][1] / GRAVITY) if rows else (0.0, 0.0)
    # In the nonlinear model the balance is at alpha + atan(push), and the way to it, under a constant push, that of
    # energy: v = 2 p (1 + push^2)^(1/4) sin((held - u)/2).
    held = alpha + (np.arctan(push) if model == "nonlinear" else push)
    kind = int(rng.integers(3))
    rotation = 0.0 if kind == 1 else float(rng.uniform(0.02, 0.98)) * held
    reach = (
        2.0 * np.sqrt(1.0 + push**2) ** 0.5 * np.sin(0.5 * (held - rotation))
        if model == "nonlinear"
        else held - rotation
    )
    velocity = p * (reach - q * alpha) + (0.0 if model == "nonlinear" else rate)
    if kind == 0:
        rotation, velocity = held - q * alpha + (0.0 if model == "nonlinear" else rate / p), 0.0
    if not (0.0 < rotation < 1.5 or (rotation == 0.0 and velocity > 0.0)):  # no such start: upright, or fallen
        rotation, velocity = (1.0 - q) * alpha, 0.0
    return Case(model, p, alpha, e, q, tuple(breakpoints.tolist()), rows, float(rotation), float(velocity))


def _nonlinear_rest(given: Case) -> Any:
    pieces = (np.array(given.breakpoints), np.array(given.rows)) if given.rows else (np.zeros(1), np.zeros((0, 2)))
    pairs = ((each, each) for each in (given.p, given.alpha, given.restitution))
    problem = Problem("nonlinear", *pairs, *pieces)
    start = {"rotation": given.rotation, "velocity": given.velocity}
    course = multiprecision.follow(problem, **start, digits=40)
    return next((time for time, kind, _ in course.events if kind == "rest"), None)


def _linear_rest(given: Case) -> Any:
    p, alpha, e = mp.mpf(given.p), mp.mpf(given.alpha), mp.mpf(given.restitution)
    u, v, side, time = mp.mpf(given.rotation), mp.mpf(given.velocity), 1, mp.mpf(0)
    ends = [mp.mpf(each) for each in given.breakpoints[1:]]
    piece = 0
    while True:
        row, left = ((0.0, 0.0), mp.inf) if piece == len(ends) else (given.rows[piece], ends[piece] - time)
        start = mp.mpf(given.breakpoints[piece])
        slope = mp.mpf(row[1]) / mp.mpf(GRAVITY)
        push = mp.mpf(row[0]) / mp.mpf(GRAVITY) + slope * (time - start)
        arc = _Arc(p, alpha + side * push, side * slope, u, v)
        pressed = [alpha + push, alpha - push]
        if u == 0 and v < NOTHING * p * alpha:
            here, there = pressed if side > 0 else pressed[::-1]
            return time + 2 * v * (1 / here + e / there) / (p * p * (1 - e * e))
        landing = arc.landing(left)
        if landing is None:
            if left == mp.inf:
                return None
            u, v = arc.state(left)
            time, piece = ends[piece], piece + 1
            if u > 10 * alpha:
                return None
        else:
            time, u, v, side = time + landing, mp.mpf(0), -e * arc.state(landing)[1], -side


class _Arc:
    """u'' = p^2 (u - held - rate t) from a rotation and a velocity."""

    def __init__(self, p: Any, held: Any, rate: Any, u: Any, v: Any) -> None:
        self.p, self.held, self.rate, self.from_ground = p, held, rate, u == 0
        self.x, self.y, self.speed = u - held, (v - rate) / p, v

    def state(self, t: Any) -> tuple[Any, Any]:
        c, s = mp.cosh(self.p * t), mp.sinh(self.p * t)
        here = self.held + self.rate * t + self.x * c + self.y * s
        return here, self.rate + self.p * (self.x * s + self.y * c)

    def landing(self, left: Any) -> Any:
        """First time in (0, left] at which the arc comes down; None where there is none."""
        if left == mp.inf:  # no motion: a quadratic in exp(p t)
            grows, decays = (self.x + self.y) / 2, (self.x - self.y) / 2
            within = self.held * self.held - 4 * grows * decays
            if grows >= 0 or within < 0:
                return None
            return mp.log((-self.held - mp.sqrt(within)) / (2 * grows)) / self.p
        until = left
        if self.from_ground and self.speed < self.p * self.held / 4:  # an arc of about 2 v/g, well within the looks
            until = min(left, 4 * self.speed / (self.p * self.p * self.held))
        while True:
            looks = [until * k / LOOKS for k in range(1, LOOKS + 1)]
            before = until / (64 * LOOKS) if self.from_ground else mp.mpf(0)
            for after in looks:
                if self.state(after)[0] <= 0:
                    return self.polished(before, after)
                before = after
            if until == left:
                return None
            until = min(left, 2 * until)

    def polished(self, low: Any, high: Any) -> Any:
        """Root between a time above the ground and one below, to 24 digits: Newton's steps, kept in between."""
        t = high
        while True:
            u, v = self.state(t)
            low, high = (t, high) if u > 0 else (low, t)
            following = t - u / v if v != 0 else low
            if abs(following - t) <= mp.mpf(10) ** -12 * t:
                return following
            t = following if low < following < high else (low + high) / 2
