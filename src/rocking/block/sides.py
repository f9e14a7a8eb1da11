"""The two sides of a block: from a rectangle, from pivots, and with which restitution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rocking.block.limits import checked_pair, checked_parameter
from rocking.block.restitution import Restitution
from rocking.errors import InvalidBlock


@dataclass(frozen=True)
class Side:
    """One side of a block: what counts while it leans to that side.

    Attributes
    ----------
    p : float
        Frequency parameter, rad/s.
    alpha : float
        Slenderness, rad: the angle between the vertical and the line from the pivot to the centre of mass.
    restitution : float
        Factor on the angular speed when the block leaves this side at an impact.
    radius : float
        Distance R from the pivot to the centre of mass, m.
    """

    p: float
    alpha: float
    restitution: float
    radius: float

    def __str__(self) -> str:
        """Return the parameters as people read them."""
        return f"p = {self.p:.5g} rad/s, alpha = {self.alpha:.5g} rad, restitution = {self.restitution:.5g}"

    def __repr__(self) -> str:
        return f"<Side: {self}, R = {self.radius:.5g} m>"


def in_line(sides: Sequence[object]) -> str:
    """Return the parameters of one side or of two, which are named where they differ."""
    if len(sides) == 1 or sides[0] == sides[1]:
        return str(sides[0])
    return "; ".join(f"side {sign}: {side}" for sign, side in zip("+-", sides, strict=True))


def sides_on_pivots(
    distances: tuple[float, float],
    height: float,
    gyration_squared: float,
    gravity: float,
    restitution: object,
) -> tuple[Side, Side]:
    """Sides of a body from the distances of its pivots from the centre of mass, its height, m, and k^2, m^2."""
    plus, minus = distances
    radii = math.hypot(plus, height), math.hypot(minus, height)
    inertias = [gyration_squared + radius * radius for radius in radii]
    kept = gyration_squared + height * height - plus * minus
    e = restitutions(restitution, (kept / inertias[1], kept / inertias[0]))
    first, second = (
        Side(math.sqrt(gravity * radius / inertia), math.atan2(distance, height), factor, radius)
        for distance, radius, inertia, factor in zip(distances, radii, inertias, e, strict=True)
    )
    return first, second


def restitutions(given: object, conserved: Sequence[float]) -> tuple[float, float]:
    """Return the factors that are given, or those that conserve angular momentum."""
    if given is None:
        if min(conserved) <= 0.0:
            raise InvalidBlock(
                f"conserving angular momentum gives this block a restitution of {min(conserved):.3g}: it is too stocky "
                "to rock that way; correct its sizes if they are swapped, or give {} a value in (0, 1]",
                "restitution",
            )
        return conserved[0], conserved[1]
    if isinstance(given, Restitution):
        raise InvalidBlock(
            "{} of a block is a number or a pair; a law goes to RestrainedBlock(block, restitution=...)", "restitution"
        )
    plus, minus = (checked_parameter(value, "restitution") for value in checked_pair(given, "restitution"))
    return plus, minus
