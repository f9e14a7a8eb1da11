"""A block as it stands: with the loads that follow it, leaning, its pivots as restraints see them, and its balance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from rocking.bisection import bisected
from rocking.block.limits import checked_pair, checked_parameter
from rocking.block.moments import Held, Pivot, Yielding
from rocking.block.restraints import Load, Restraint
from rocking.block.sides import Side
from rocking.block.single import Block, block_of_sides
from rocking.errors import InvalidBlock

#: Rotations at which the balance is looked for, on each side.
_LOOKS: Final = 512


def carrying(block: Block, loads: Sequence[Load], restitution: float | Sequence[float] | None) -> Block:
    """Return the rigid body of a block and the loads that follow it, with a restitution or that of angular momentum."""
    if not loads:
        return block
    assert block.mass is not None
    plus = block.sides[0]
    height, (right, left) = plus.radius * math.cos(plus.alpha), distances_of(block)
    masses = np.array([block.mass, *(load.mass for load in loads)])
    across = np.array([0.0, *(load.offset for load in loads)])
    up = np.array([height, *(load.height for load in loads)])
    share = masses / masses.sum()
    x, z = float(share @ across), float(share @ up)
    own = block.gravity * plus.radius / plus.p**2 - plus.radius**2
    gyration = float(share[0] * own + share @ ((across - x) ** 2 + (up - z) ** 2))
    beyond = max(x - right, -x - left)
    if beyond >= 0.0:
        raise InvalidBlock(
            f"with its loads the centre of mass of this block lies {beyond:.3g} m beyond its pivot, so that it falls: "
            "give a load less mass, or less {}",
            "offset",
        )
    return Block.from_pivots(
        (right - x, left + x),
        z,
        math.sqrt(gyration),
        restitution=restitution,
        mass=float(masses.sum()),
        gravity=block.gravity,
    )


def leaning(block: Block, lean: float) -> Block:
    """Return a block that leans to side + by an angle."""
    if lean == 0.0:
        return block
    plus, minus = block.sides
    if not -minus.alpha < lean < plus.alpha:
        raise InvalidBlock(
            f"a block whose {{}} is {lean:g} rad falls: from {-minus.alpha:.4g} to {plus.alpha:.4g} rad it stands"
            f"{f'; if it is in degrees, give math.radians({lean:g})' if 0.5 <= abs(lean) < 90.0 else ''}",
            "lean",
            value=lean,
        )
    sides = replace(plus, alpha=plus.alpha - lean), replace(minus, alpha=minus.alpha + lean)
    return block_of_sides(Block.__new__(Block), sides, block.gravity, block.description, block.mass)


def with_restitution(block: Block, restitution: float | Sequence[float]) -> Block:
    """Return a block with another restitution."""
    plus, minus = (
        replace(side, restitution=checked_parameter(factor, "restitution"))
        for side, factor in zip(block.sides, checked_pair(restitution, "restitution"), strict=True)
    )
    return block_of_sides(Block.__new__(Block), (plus, minus), block.gravity, block.description, block.mass)


def distances_of(block: Block) -> tuple[float, float]:
    """Distances of the pivots from the centre of mass along the base, m."""
    plus, minus = block.sides
    return plus.radius * math.sin(plus.alpha), minus.radius * math.sin(minus.alpha)


def following(restraints: Sequence[Restraint]) -> list[Load]:
    """Return the loads that follow the block, of all that restrains it."""
    return [each for each in restraints if isinstance(each, Load) and each.follows]


def pivots_of(block: Block, lean: float, restraints: Sequence[Restraint]) -> tuple[Pivot, Pivot]:
    """Both sides of a block that leans, with the loads that follow it, as its restraints see them.

    Their points are placed from the centre of mass of the block without these loads, from which the loads are, too.
    """
    mass = math.nan if block.mass is None else block.mass
    shift = sum(load.mass * load.offset for load in following(restraints)) / mass
    plus, minus = (
        Pivot(
            sign, side.alpha, sign * lean, side.radius * math.sin(side.alpha + sign * lean) + sign * shift, side.p,
            mass * block.gravity * side.radius, block.gravity,
        )
        for sign, side in zip((1.0, -1.0), block.sides, strict=True)
    )  # fmt: skip
    return plus, minus


def balance_of(side: Side, held: Held, tendon: Yielding) -> float:
    """First rotation at which what brings a block back has become nothing, without ground motion, rad.

    A tendon that yields does so for the first time.
    """

    def moment(u: float) -> float:
        own = (1.0 + held.sine) * math.sin(side.alpha - u) + held.cosine * math.cos(side.alpha - u)
        stretch = min(2.0 * tendon.opening * math.sin(0.5 * u), tendon.yields) - tendon.slack
        return own + (held.prestress + tendon.stiffness * stretch) * math.cos(0.5 * u) + held.spring * u

    looks = np.linspace(0.0, 0.5 * math.pi, _LOOKS)
    values = np.array([moment(u) for u in looks.tolist()])
    negative = np.flatnonzero(values[1:] <= 0.0)
    if not len(negative):
        return math.inf
    k = int(negative[0])
    return bisected(float(looks[k]), float(looks[k + 1]), lambda u: moment(u) <= 0.0)[1]
