"""Moreau and Jean's scheme and Schatzman and Paoli's as they are written down, in a few lines of Python.

A body is an acceleration off the ground, of (side, time, coordinate in the frame of the side), and a restitution; at an
impact `other` gives the side that is entered.
"""

from __future__ import annotations

from collections.abc import Callable

Acceleration = Callable[[int, float, float], float]


def moreau_jean(
    acceleration: Acceleration,
    restitution: float,
    start: tuple[int, float, float],
    h: float,
    steps: int,
    *,
    theta: float = 0.5,
    other: int = -1,
) -> list[tuple[int, float, float]]:
    """Side, coordinate and velocity at the end of each step; ``other`` -1: a block, 1: a body of one side."""
    side, u, v = start
    rows = [start]
    for k in range(steps):
        here = acceleration(side, k * h, u)
        free = v + h * here
        for _ in range(100):  # a contraction
            end = u + h * (theta * free + (1.0 - theta) * v)
            free = v + h * (theta * acceleration(side, (k + 1) * h, end) + (1.0 - theta) * here)
        struck = u + 0.5 * h * v <= 0.0 and free < -restitution * v
        new = -restitution * v if struck else free
        u, v = u + h * (theta * new + (1.0 - theta) * v), new
        side *= other if struck else 1
        rows.append((side, u, v))
    return rows


def schatzman_paoli(
    acceleration: Acceleration,
    restitution: float,
    start: tuple[int, float, float],
    h: float,
    steps: int,
    *,
    other: int = -1,
) -> list[tuple[int, float]]:
    """Side and coordinate at the end of each step."""
    side, u, v = start
    rows = [(side, u)]
    before, steps_in_contact = 0.0, 0
    for k in range(steps):
        if k == 0:
            free, least = u + h * v + 0.5 * h * h * acceleration(side, 0.0, u), 0.0
        else:
            free, least = 2.0 * u - before + h * h * acceleration(side, k * h, u), -restitution * before
        struck = free < least
        before, u = u, least if struck else free
        side *= other if struck and steps_in_contact % 3 == 0 else 1
        steps_in_contact = steps_in_contact + 1 if struck else 0
        rows.append((side, u))
    return rows
