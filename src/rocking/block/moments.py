"""Moments about the pivots of a block, as restraints make them: what adds up, and a side as they see it."""

from __future__ import annotations

import math
from typing import NamedTuple


class Held(NamedTuple):
    """What restraints do on one side, at a rotation u and a rate u'.

    Their moment about the pivot, positive where it brings the block back, over the weight times R is

        sine sin(alpha - u) + cosine cos(alpha - u) + prestress cos(u/2) + spring u + (damping/p^2) u'.
    """

    sine: float = 0.0
    cosine: float = 0.0
    prestress: float = 0.0
    spring: float = 0.0
    damping: float = 0.0

    def plus(self, other: Held) -> Held:
        """Return both together."""
        return Held(*(a + b for a, b in zip(self, other, strict=True)))


class Yielding(NamedTuple):
    """A tendon that yields, on one side.

    Attributes
    ----------
    opening : float
        Distance x of its duct from the pivot, m: it is longer by 2 x sin(u/2) than while the block stands.
    stiffness : float
        Its stiffness times x over weight times R, 1/m.
    yields, slack : float
        Elongations, beyond the plastic one, at which it yields and above which it is taut, m.
    """

    opening: float = 0.0
    stiffness: float = 0.0
    yields: float = math.inf
    slack: float = 0.0


class Pivot(NamedTuple):
    """One side of a standing block, as restraints see it.

    Attributes
    ----------
    sign : float
        +1 on side +, -1 on side -.
    alpha, lean : float
        Slenderness as it stands, and the angle by which the block leans to this side, rad.
    distance : float
        Distance of the pivot along the base, m, from the centre of mass of the block without loads that follow it.
    p : float
        Frequency parameter, rad/s.
    moment : float
        Weight times R, N m.
    gravity : float
        m/s^2.
    """

    sign: float
    alpha: float
    lean: float
    distance: float
    p: float
    moment: float
    gravity: float

    def arms(self, height: float, offset: float) -> tuple[float, float]:
        """Distance from the pivot inwards and height above it, m, of a point of the standing block.

        The point is at a height above the base and at an offset to side + from the centre of mass of the block without
        loads, both along the block's own axes.
        """
        inwards = self.distance - self.sign * offset
        c, s = math.cos(self.lean), math.sin(self.lean)
        return inwards * c - height * s, height * c + inwards * s

    def turned(self, inwards: float, upwards: float) -> tuple[float, float]:
        """Return ``rho sin`` and ``rho cos`` of the angle of a point from the line of the centre of mass, m."""
        c, s = math.cos(self.alpha), math.sin(self.alpha)
        return inwards * c - upwards * s, upwards * c + inwards * s
