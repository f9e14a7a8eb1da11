"""Blocks with restraints, a lean, or a single side."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from rocking.block.body import SINGLE, ContactLaw, Coordinate
from rocking.block.restraints import Load, Pivot, Restitution, Restraint, Tendon, Terms
from rocking.block.sides import Side, checked_pair, checked_parameter, one_sided_restitution
from rocking.block.single import Block, Rocking, one_block
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.bisection import bisect
from rocking.core.constants import MODELS, Model
from rocking.errors import InvalidBlock, InvalidOption

#: Number of rotations in the search for the balance on each side.
_LOOKS: Final = 512

_SOME: Final = "Tendon, Spring, Damper, Thrust or Load"
_ROTATION: Final = Coordinate("rotation", "angular_velocity", "angular_acceleration", "rad", "balance")


@dataclass(frozen=True, repr=False)
class RestrainedBlock(Rocking):
    """Block with restraints, a lean, or a single side, such as a facade against its side walls.

    Parameters
    ----------
    block : Block
        Free block. Restraints require its `mass`.
    *restraints : Restraint
        `Tendon`, `Spring`, `Damper`, `Thrust`, `Load`.
    one_sided : bool
        Whether the block rocks to side + only and bounces back from a support behind it with `restitution` times its
        speed.
    lean : float
        Angle by which the block stands out of plumb to side +, rad.
    restitution : float, pair or Restitution, optional
        Factor on the angular speed at an impact, or a law, whose largest value the `sides` then contain. The default
        is the restitution of the block, for one-sided blocks `one_sided_restitution`. With a load that follows, it
        conserves angular momentum.

    Raises
    ------
    InvalidBlock
        If the mass is missing, the block does not stand, or a restraint is not a `Restraint`.

    See Also
    --------
    Block.one_sided : Create a rectangular block with a single side.
    Restitution : Law by which the restitution varies.

    Notes
    -----
    Between impacts, with the weight W = 1 + a_v/g and the push A = +-a/g of the ground on a side,

        u'' = -p^2 [(W + s) sin(alpha - u) + (A + c) cos(alpha - u) + h cos(u/2) + k u] - d u'

    where s, c, h, k and d are sums over the restraints. The linear model is this equation to first order in u, with
    alpha for sin(alpha) and 1 for cos(alpha) in the terms of the block itself (derived in the documentation).

    Examples
    --------
    >>> from rocking import Tendon
    >>> column = RestrainedBlock(Block(width=0.4, height=2.0, mass=2000.0), Tendon(2e5, prestress=2e3))
    >>> [round(a, 4) for a in column.uplift_thresholds()]
    [2.1613, 2.1613]
    """

    coordinate: ClassVar[Coordinate] = _ROTATION

    block: Block
    _terms: tuple[Terms, Terms]
    is_one_sided: bool
    description: str
    restraints: tuple[Restraint, ...] | None
    lean: float

    def __init__(
        self,
        block: Block,
        *restraints: Restraint,
        one_sided: bool = False,
        lean: float = 0.0,
        restitution: float | Sequence[float] | Restitution | None = None,
    ) -> None:
        if isinstance(block, RestrainedBlock):
            raise InvalidBlock("this block has restraints already: give all of them at once, after the Block itself")
        own, one_way = one_block(block), checks.boolean(one_sided, "one_sided", InvalidBlock)
        _check(restraints, own)
        tilt = checks.finite(lean, "lean", InvalidBlock)
        law = restitution if isinstance(restitution, Restitution) else None
        factors = restitution.maximum if isinstance(restitution, Restitution) else restitution
        rest = [f"leaning {tilt:.4g} rad to side +"] * (tilt != 0.0) + ["rocking one way"] * one_way
        rest += [str(law)] * (law is not None)
        if one_way and restitution is None:
            factors = one_sided_restitution(own.sides[0].alpha)
        elif one_way and law is None and len({*checked_pair(restitution, "restitution")}) > 1:
            raise InvalidBlock(
                "{} of a block that rocks one way is one number, not a pair: it leaves one side alone",
                "restitution",
                value=restitution,
            )
        standing = _tilted(_with_loads(own, _following(restraints), factors), tilt)
        if factors is not None:
            plus, minus = (
                replace(side, restitution=checked_parameter(factor, "restitution"))
                for side, factor in zip(standing.sides, checked_pair(factors, "restitution"), strict=True)
            )
            standing = standing._with_sides((plus, minus))
        if sum(isinstance(each, Tendon) and each.strength < math.inf for each in restraints) > 1:
            raise InvalidBlock("one tendon of a block may yield; let the others have no {}", "strength")
        pivots = _pivots_of(standing, tilt, restraints)
        terms = [
            functools.reduce(Terms.plus, (each._terms(pivot) for each in restraints), Terms())._replace(
                **(law._terms(side) if law else {})
            )
            for side, pivot in enumerate(pivots)
        ]
        text = ", ".join([own.description, *_listed(restraints), *rest])
        self.__dict__.update(
            block=standing, _terms=tuple(terms), is_one_sided=one_way, restraints=restraints, lean=tilt
        )
        self.__dict__.update(description=text)
        if (least := min(self.uplift_thresholds())) <= 0.0:
            raise InvalidBlock(
                f"this block does not stand: it would take a ground acceleration of {least:.3g} m/s^2 to lift it; "
                f"a smaller thrust, load or lean lets it{'; forces are in N, masses in kg' * (least < -self.gravity)}"
            )

    def _rows(self) -> list[tuple[float, ...]]:
        """Return parameters and, unless free, terms of both sides as stored in `Blocks`."""
        rows = self.block._rows()
        if not self.is_one_sided and self._terms == (Terms(), Terms()):
            return rows
        rows = [(*row, *terms, float(self.is_one_sided)) for row, terms in zip(rows, self._terms, strict=True)]
        return rows[:1] * 2 if self.is_one_sided else rows

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s^2."""
        return self.block.gravity

    @property
    def sides(self) -> Sequence[Side]:
        """Sides of the standing block including loads that follow; only side + if one-sided."""
        return self.block.sides[:1] if self.is_one_sided else self.block.sides

    @property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side, rad; infinite if restraints hold it at any rotation."""
        plus, minus = map(_balance_of, self.block.sides, self._terms)
        return plus, math.inf if self.is_one_sided else minus

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Return the ground accelerations, m/s^2, that lift the block to side + (if -a exceeds it) and to side -."""
        checks.choice(model, "model", InvalidOption, MODELS)
        made = self.alone().kernel_records(model, np.zeros((1, 2)))
        plus, minus = (self.gravity * (made["threshold"] + made["restraint_threshold"])[0]).tolist()
        return plus, minus

    @property
    def contact(self) -> ContactLaw | None:
        """Ratio of the ground forces to the weight, including loads that follow (see `rocking.block.body`).

        The support behind a one-sided block at rest pushes it to side + without friction, as little as required.
        Therefore the remaining ground force is smallest. None for a block from the arrays of `Blocks`, whose forces
        are unknown.
        """
        return None if self.restraints is None else self._contact_forces

    def _contact_forces(
        self,
        motion: tuple[Floats, Floats, Floats],
        ground_over_g: tuple[Floats, Floats],
        side: Integers,
        stretch: Floats,
    ) -> tuple[Floats, Floats]:
        horizontal, vertical = self.block.contact(motion, ground_over_g, side, stretch)
        if self.restraints and self.block.mass is not None:
            pivots, weight = _pivots_of(self.block, self.lean, self.restraints), self.block.mass * self.gravity
            for each in self.restraints:
                across, up = each._acting(pivots, motion[0], side, stretch)
                horizontal, vertical = horizontal - across / weight, vertical - up / weight
        if self.is_one_sided:
            horizontal = np.where(side < 0, np.minimum(horizontal, 0.0), horizontal)
        return horizontal, vertical

    def tendons_at(self, largest: tuple[float, float], model: Model = "nonlinear") -> list[tuple[float, float, float]]:
        """Return the largest elongation (m), largest force (N) and plastic elongation (m) of each tendon, in order.

        `largest` is the largest rotation on each side, rad. The list is empty if the restraints are not
        available.
        """
        plus, minus = largest if model == "linear" else (2.0 * math.sin(0.5 * u) for u in largest)
        pivots = _pivots_of(self.block, self.lean, self.restraints or ())
        tendons = [each for each in self.restraints or () if isinstance(each, Tendon)]
        return [each._stretched(pivots, (plus, minus)) for each in tendons]


def _listed(restraints: Sequence[object]) -> list[str]:
    """Describe the restraints: with a spring of ..., a load of ... and a tendon of ..."""
    if not restraints:
        return []
    *first, last = [f"a {each}" for each in restraints]
    return [f"with {', '.join(first)} and {last}" if first else f"with {last}"]


def _check(restraints: Sequence[object], block: Block) -> None:
    """Reject invalid restraints, and restraints of a block without a mass."""
    for each in restraints:
        if not isinstance(each, Restraint):
            raise InvalidBlock(f"{checks.short_repr(each)} is no restraint: give {_SOME}, one by one")
    if restraints and block.mass is None:
        raise InvalidBlock("a block with restraints needs its {}, kg, beside its sizes or its pivots", "mass")


def _with_loads(block: Block, loads: Sequence[Load], restitution: float | Sequence[float] | None) -> Block:
    """Return a block combined with the loads that follow it, by default conserving angular momentum."""
    if not loads:
        return block
    assert block.mass is not None
    plus = block.sides[0]
    height = plus.radius * math.cos(plus.alpha)
    right, left = (side.radius * math.sin(side.alpha) for side in block.sides)
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


def _tilted(block: Block, lean: float) -> Block:
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
    return block._with_sides(sides)


def _following(restraints: Sequence[Restraint]) -> list[Load]:
    """Return the loads that follow the block."""
    return [each for each in restraints if isinstance(each, Load) and each.follows]


def _pivots_of(block: Block, lean: float, restraints: Sequence[Restraint]) -> tuple[Pivot, Pivot]:
    """Return both pivots of a leaning block with the loads that follow it."""
    mass = math.nan if block.mass is None else block.mass
    shift = sum(load.mass * load.offset for load in _following(restraints)) / mass
    plus, minus = (
        Pivot(
            sign, side.alpha, sign * lean, side.radius * math.sin(side.alpha + sign * lean) + sign * shift, side.p,
            mass * block.gravity * side.radius, block.gravity,
        )
        for sign, side in zip((1.0, -1.0), block.sides, strict=True)
    )  # fmt: skip
    return plus, minus


def _balance_of(side: Side, terms: Terms) -> float:
    """Return the first rotation without restoring moment or ground motion, rad.

    A yielding tendon yields for the first time.
    """
    if terms[:-3] == Terms()[:-3]:
        return side.alpha

    def moment(u: float) -> float:
        own = (1.0 + terms.sine) * math.sin(side.alpha - u) + terms.cosine * math.cos(side.alpha - u)
        stretch = min(2.0 * terms.opening * math.sin(0.5 * u), terms.yields) - terms.slack
        return own + (terms.prestress + terms.stiffness * stretch) * math.cos(0.5 * u) + terms.spring * u

    looks = np.linspace(0.0, 0.5 * math.pi, _LOOKS)
    values = np.array([moment(u) for u in looks.tolist()])
    negative = np.flatnonzero(values[1:] <= 0.0)
    if not len(negative):
        return math.inf
    k = int(negative[0])
    return bisect(float(looks[k]), float(looks[k + 1]), lambda u: moment(u) <= 0.0)[1]


SINGLE["restrained"] = RestrainedBlock
