"""Answers in closed form of the linear model, in 50 digits: one arc under a straight line, and a constant push."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mpmath import MPContext

mp = MPContext()
mp.dps = 50
GRAVITY = 9.80665
Number = Any
"""An mpf of the context above."""


@dataclass(frozen=True)
class Side:
    """p, rad/s, slenderness, rad, and restitution, as doubles."""

    p: float
    alpha: float
    restitution: float


def over_gravity(acceleration: Number) -> Number:
    """Acceleration in units of gravity."""
    return mp.mpf(acceleration) / mp.mpf(GRAVITY)


def state(side: Side, u: Number, v: Number, push: Number, rate: Number, t: Number) -> tuple[Number, Number]:
    """|theta| and its rate after t, under an acceleration towards the ground of push + rate t, over that of gravity.

    u'' = p^2 (u - alpha - push - rate t).
    """
    p, held = mp.mpf(side.p), mp.mpf(side.alpha) + push
    c, s = mp.cosh(p * t), mp.sinh(p * t)
    x, y = u - held, (v - rate) / p
    return held + rate * t + x * c + y * s, rate + p * (x * s + y * c)


def lowest(side: Side, u: Number, v: Number, push: Number) -> tuple[Number, Number]:
    """When an arc that falls is lowest under a constant push, and how high it is then; it must turn."""
    p, x, y = mp.mpf(side.p), u - mp.mpf(side.alpha) - push, v / mp.mpf(side.p)
    t = mp.atanh(-y / x) / p
    return t, state(side, u, v, push, mp.mpf(0), t)[0]


def root(function: Any, low: Number, high: Number) -> Number:
    """Root of a function that changes its sign once in between, by bisection and then secants."""
    sign = mp.sign(function(low))
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if mp.sign(function(middle)) == sign else (low, middle)
    return mp.findroot(function, (low, high), solver="anderson", tol=mp.mpf(10) ** -90, verify=False)


def impacts(sides: tuple[Side, Side], push: float, speed: float, first: int) -> Iterator[tuple[Number, Number]]:
    """Yield times of the impacts after one at time zero, and speeds after them, under a constant acceleration (m/s^2).

    Side ``first`` (0 or 1) is entered with a speed. Energy is kept within an arc, so that it ends as fast as it began,
    after 2/p atanh(v / (p c)) with c = alpha +- a/g.
    """
    time, v, k = mp.mpf(0), mp.mpf(speed), first
    while True:
        side = sides[k]
        p, pressed = mp.mpf(side.p), mp.mpf(side.alpha) + (1 - 2 * k) * over_gravity(push)
        time += 2 / p * mp.atanh(v / (p * pressed))
        v *= mp.mpf(side.restitution)
        k = 1 - k
        yield time, v


def rest(sides: tuple[Side, Side], push: float, speed: float, first: int) -> Number:
    """When those impacts accumulate: what is left is a geometric series once speeds count for nothing beside p c."""
    for number, (time, v) in enumerate(impacts(sides, push, speed, first)):
        k = (first + number + 1) % 2
        slow = [
            v / (mp.mpf(s.p) * (mp.mpf(s.alpha) + sign * over_gravity(push)))
            for s, sign in zip(sides, (1, -1), strict=True)
        ]
        if max(slow) < mp.mpf(10) ** -25:
            # atanh x = x (1 + x^2/3 + ...): the next term is a share of 1e-50.
            e = [mp.mpf(s.restitution) for s in sides]
            here, there = slow[k] / mp.mpf(sides[k].p), slow[1 - k] / mp.mpf(sides[1 - k].p)
            return time + 2 * (here + e[k] * there) / (1 - e[0] * e[1])
    raise AssertionError("unreachable: the impacts have no end")
