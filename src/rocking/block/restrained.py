"""A block that is held back by restraints, leans, or rocks one way only."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.block.limits import checked_pair
from rocking.block.moments import Held, Yielding
from rocking.block.restitution import Restitution, Varying, one_sided_restitution
from rocking.block.restraints import Restraint, Tendon
from rocking.block.sides import Side, in_line
from rocking.block.single import Block, one_block
from rocking.block.standing import balance_of, carrying, following, leaning, pivots_of, with_restitution
from rocking.body import KINDS, Bodies, ContactLaw, Coordinate
from rocking.constants import Model
from rocking.errors import InvalidBlock

#: So many restraints are told with their numbers in the title of a figure.
_FEW: Final = 2
_SOME: Final = "Tendon, Spring, Damper, Thrust and Load are some"
_ROTATION: Final = Coordinate("rotation", "angular_velocity", "angular_acceleration", "rad", "balance")


@dataclass(frozen=True)
class RestrainedBlock:
    """A block that restraints hold back, that leans, or that rocks one way only, as a facade against its side walls.

    Parameters
    ----------
    block : Block
        The block by itself. With restraints it needs its `mass`.
    *restraints : Restraint
        `Tendon`, `Spring`, `Damper`, `Thrust`, `Load`.
    one_sided : bool
        Whether it rocks to side + only, and bounces back from what stands behind it with `restitution` times its speed.
    lean : float
        Angle by which it stands out of plumb to side +, rad.
    restitution : float, pair or Restitution, optional
        Factor on the angular speed at an impact, or the law by which it varies: `FallingRestitution`,
        `RandomRestitution`; that of the `sides` is then the largest. By default that of the block; with a load that
        follows, the one that conserves angular momentum; of a one-sided block `one_sided_restitution`.

    Raises
    ------
    InvalidBlock
        If there is no mass for the restraints, the block does not stand, or there is no such restraint.

    Notes
    -----
    Between impacts, with the weight W = 1 + a_v/g and the push A = +-a/g of the ground on a side,

        u'' = -p^2 [(W + s) sin(alpha - u) + (A + c) cos(alpha - u) + h cos(u/2) + k u] - d u'

    where s, c, h, k and d are sums over the restraints. The linear model is that equation to first order in u, with
    alpha for sin(alpha) and 1 for cos(alpha) in the block's own part (derived in the documentation).

    Examples
    --------
    >>> from rocking import Tendon
    >>> column = RestrainedBlock(Block(width=0.4, height=2.0, mass=2000.0), Tendon(2e5, prestress=2e3))
    >>> [round(a, 4) for a in column.uplift_thresholds()]
    [2.1613, 2.1613]
    >>> wall = Block.one_sided(width=0.4, height=4.0, restitution=0.4)
    >>> wall.uplift_thresholds("linear")[1]
    inf
    """

    coordinate: ClassVar[Coordinate] = _ROTATION

    block: Block
    _held: tuple[Held, Held]
    _tendon: tuple[Yielding, Yielding]
    _varying: tuple[Varying, Varying]
    is_one_sided: bool
    description: str
    title: str
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
        own, one_way = one_block(block), checks.flag(one_sided, "one_sided", InvalidBlock)
        _check(restraints, own)
        tilt = checks.finite(lean, "lean", InvalidBlock)
        rest = [f"leaning {tilt:.4g} rad to side +"] * (tilt != 0.0) + ["rocking one way"] * one_way
        varying, factors = (Varying(), Varying()), None if isinstance(restitution, Restitution) else restitution
        if isinstance(restitution, Restitution):
            rest.append(str(restitution))
            varying, factors = restitution._varying(), restitution._factors()
        elif one_way and restitution is None:
            factors = one_sided_restitution(own.sides[0].alpha)
        elif one_way and len({*checked_pair(restitution, "restitution")}) > 1:
            raise InvalidBlock(
                "{} of a block that rocks one way is one number, not a pair: it leaves one side alone",
                "restitution",
                value=restitution,
            )
        standing = leaning(carrying(own, following(restraints), factors), tilt)
        if factors is not None:
            standing = with_restitution(standing, factors)
        pivots = pivots_of(standing, tilt, restraints)
        held = [Held(), Held()]
        for each in restraints:
            held = [of_side.plus(each._held(pivot)) for of_side, pivot in zip(held, pivots, strict=True)]
        yielding = [found for each in restraints for pivot in pivots if (found := each._yielding(pivot))]
        if len(yielding) > len(pivots):
            raise InvalidBlock("one tendon of a block may yield; let the others have no {}", "strength")
        tendon = (yielding[0], yielding[1]) if yielding else (Yielding(), Yielding())
        kinds = [type(each).__name__.lower() for each in restraints]
        text, title = (", ".join([own.description, *_listed(words), *rest]) for words in (restraints, kinds))
        title = title if len(restraints) > _FEW else text
        filled(self, standing, (held[0], held[1]), tendon, varying, one_way, (text, title), restraints, tilt)
        if (least := min(self.uplift_thresholds())) <= 0.0:
            raise InvalidBlock(
                f"this block does not stand: it would take a ground acceleration of {least:.3g} m/s^2 to lift it; "
                f"a smaller thrust, load or lean lets it{'; forces are in N, masses in kg' * (least < -self.gravity)}"
            )

    def __str__(self) -> str:
        """Return description and parameters in one line."""
        return f"{self.description}; {in_line(self.sides)}"

    def __repr__(self) -> str:
        return f"<RestrainedBlock: {self}>"

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s^2."""
        return self.block.gravity

    @property
    def sides(self) -> Sequence[Side]:
        """Sides of the block as it stands, with the loads that follow it; one of a block that rocks one way."""
        return self.block.sides[:1] if self.is_one_sided else self.block.sides

    @property
    def stops(self) -> tuple[float, float]:
        """Rotation at which it stands, for each side: zero."""
        return 0.0, 0.0

    @property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side, rad; infinite where the restraints hold it at any rotation."""
        plus, minus = map(balance_of, self.block.sides, self._held, self._tendon)
        return plus, math.inf if self.is_one_sided else minus

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Ground accelerations, m/s^2, that lift it to side + (when -a passes the first) and to side -."""
        made = self.alone().kernel_records(model, np.zeros((1, 2)))
        plus, minus = (self.gravity * (made["threshold"] + made["hold"])[0]).tolist()
        return plus, minus

    @property
    def contact(self) -> ContactLaw | None:
        """Forces of the ground over the weight of the block with the loads that follow it (see `rocking.body`).

        What stands behind a block of one side pushes it to side +, without friction, as far as that is needed while it
        is at rest; so what is left for the ground is least then. None where the forces are not known: of a block that
        was made of the arrays of `RestrainedBlocks`.
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
            pivots, weight = pivots_of(self.block, self.lean, self.restraints), self.block.mass * self.gravity
            for each in self.restraints:
                across, up = each._acting(pivots, motion[0], side, stretch)
                horizontal, vertical = horizontal - across / weight, vertical - up / weight
        if self.is_one_sided:
            horizontal = np.where(side < 0, np.minimum(horizontal, 0.0), horizontal)
        return horizontal, vertical

    def tendons_at(self, largest: tuple[float, float], model: Model = "nonlinear") -> list[tuple[float, float, float]]:
        """Return how far each tendon was stretched by rotations, in the order of the restraints.

        Parameters
        ----------
        largest : (float, float)
            Largest rotation on each side, rad.
        model : {"nonlinear", "linear"}
            Equation of motion; in the linear model the base opens in proportion to the rotation.

        Returns
        -------
        list of (float, float, float)
            Largest elongation, m, and force, N, and plastic elongation, m, of each; none where restraints are not known
            one by one.

        Examples
        --------
        >>> from rocking import Tendon
        >>> column = RestrainedBlock(Block(width=0.4, height=2.0, mass=2000.0), Tendon(2e5, prestress=2e3))
        >>> [[round(value, 6) for value in each] for each in column.tendons_at((0.02, 0.01))]
        [[0.004, 2799.986667, 0.0]]
        """
        plus, minus = largest if model == "linear" else (2.0 * math.sin(0.5 * u) for u in largest)
        pivots = pivots_of(self.block, self.lean, self.restraints or ())
        tendons = [each for each in self.restraints or () if isinstance(each, Tendon)]
        return [each._stretched(pivots, (plus, minus)) for each in tendons]

    def alone(self) -> Bodies:
        """Return `RestrainedBlocks` of which it is the only one."""
        return KINDS["restrained-blocks"].of([self])


def _listed(restraints: Sequence[object]) -> list[str]:
    """Restraints in words, if there are some: with a spring of ..., a load of ... and a tendon of ..."""
    if not restraints:
        return []
    *first, last = [f"a {each}" for each in restraints]
    return [f"with {', '.join(first)} and {last}" if first else f"with {last}"]


def _check(restraints: Sequence[object], block: Block) -> None:
    """Refuse what is no restraint, and restraints of a block without a mass."""
    for each in restraints:
        if not isinstance(each, Restraint):
            how = "give them one by one" if isinstance(each, (list, tuple)) else _SOME
            raise InvalidBlock(f"{checks.shown(each)} is no restraint: {how}")
    if restraints and block.mass is None:
        raise InvalidBlock("a block with restraints needs its {}, kg, beside its sizes or its pivots", "mass")


def filled(
    made: RestrainedBlock,
    block: Block,
    held: tuple[Held, Held],
    tendon: tuple[Yielding, Yielding],
    varying: tuple[Varying, Varying],
    one_sided: bool,
    texts: tuple[str, str],
    restraints: tuple[Restraint, ...] | None,
    lean: float,
) -> RestrainedBlock:
    """Fill in what a restrained block is, and return it."""
    names = ("block", "_held", "_tendon", "_varying", "is_one_sided", "description", "title", "restraints", "lean")
    values = (block, held, tendon, varying, bool(one_sided), *texts, restraints, lean)
    for name, value in zip(names, values, strict=True):
        object.__setattr__(made, name, value)
    return made
