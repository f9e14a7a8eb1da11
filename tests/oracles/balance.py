"""Blocks that start next to their balance, at rest or on the way to it, and when they truly come to rest.

In the linear model an arc is u = held + rate t + x cosh(p t) + y sinh(p t), of which (x + y)/2 grows. A block whose
growing part is a small share q of its slenderness lingers, and whatever rounding adds to q is magnified by 1/q. Both
models are followed by `multiprecision`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

import rocking
from oracles import multiprecision
from oracles.problem import Problem

GRAVITY = 9.80665


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
        pieces = (np.array(self.breakpoints), np.array(self.rows)) if self.rows else (np.zeros(1), np.zeros((0, 2)))
        pairs = ((each, each) for each in (self.p, self.alpha, self.restitution))
        start = {"rotation": self.rotation, "velocity": self.velocity}
        course = multiprecision.follow(Problem(self.model, *pairs, *pieces), **start, digits=40)
        return next((time for time, kind, _ in course.events if kind == "rest"), None)


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
