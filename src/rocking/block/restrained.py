"""Blocks with restraints, a lean, or a single side."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final

import numpy as np

from rocking.block.body import SINGLE_BODY_TYPES, ContactLaw, CoordinateLabels
from rocking.block.restraints import Load, Pivot, Pivots, Restitution, Restraint, RestraintTerms, Tendon
from rocking.block.sides import Side, check_pair, check_parameter, one_sided_restitution
from rocking.block.single import Block, BlockBase, require_block
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.bisection import bisect
from rocking.core.constants import MODELS, Model
from rocking.errors import BlockError, OptionError

#: Number of rotations in the search for the balance on each side.
_SAMPLE_COUNT: Final = 512

_RESTRAINT_NAMES: Final = "Tendon, Spring, Damper, Thrust or Load"
_ROTATION: Final = CoordinateLabels("rotation", "angular_velocity", "angular_acceleration", "rad", "balance")


@dataclass(frozen=True, repr=False)
class RestrainedBlock(BlockBase):
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
    BlockError
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

    coordinate: ClassVar[CoordinateLabels] = _ROTATION

    block: Block
    _terms: tuple[RestraintTerms, RestraintTerms]
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
            raise BlockError("this block already has restraints; give a Block and all restraints together")
        free_block, is_one_sided = require_block(block), checks.boolean(one_sided, "one_sided", BlockError)
        _check_restraints(restraints, free_block)
        tilt = checks.finite(lean, "lean", BlockError)
        law = restitution if isinstance(restitution, Restitution) else None
        factors = restitution.maximum if isinstance(restitution, Restitution) else restitution
        details = [f"leaning {tilt:.4g} rad to side +"] * (tilt != 0.0) + ["rocking one way"] * is_one_sided
        details += [str(law)] * (law is not None)
        if is_one_sided and restitution is None:
            factors = one_sided_restitution(free_block.sides[0].alpha)
        elif is_one_sided and law is None and len({*check_pair(restitution, "restitution")}) > 1:
            raise BlockError("{} of a one-sided block must be a number, not a pair", "restitution", value=restitution)
        standing_block = _tilt(_add_loads(free_block, _find_following_loads(restraints), factors), tilt)
        if factors is not None:
            plus, minus = (
                replace(side, restitution=check_parameter(factor, "restitution"))
                for side, factor in zip(standing_block.sides, check_pair(factors, "restitution"), strict=True)
            )
            standing_block = standing_block._with_sides((plus, minus))
        if sum(isinstance(restraint, Tendon) and restraint.strength < math.inf for restraint in restraints) > 1:
            raise BlockError("only one tendon of a block may yield; omit {} of the others", "strength")
        pivots = _create_pivots(standing_block, tilt, restraints)
        terms = []
        for side, pivot in enumerate(pivots):
            total = functools.reduce(
                RestraintTerms.add, (restraint._compute_terms(pivot) for restraint in restraints), RestraintTerms()
            )
            terms.append(total._replace(**(law._compute_terms(side) if law else {})))
        description = ", ".join([free_block.description, *_describe_restraints(restraints), *details])
        self._fill(standing_block, terms, description, restraints, tilt, is_one_sided=is_one_sided)
        if (min_uplift := min(self.uplift_thresholds())) <= 0.0:
            hint = "; forces are in N, masses in kg" if min_uplift < -self.gravity else ""
            message = f"this block does not stand: its uplift acceleration is {min_uplift:.3g} m/s^2"
            raise BlockError(f"{message}; reduce the thrust, load or lean{hint}")

    def _fill(
        self,
        block: Block,
        terms: Sequence[RestraintTerms],
        description: str,
        restraints: tuple[Restraint, ...] | None = None,
        lean: float = 0.0,
        *,
        is_one_sided: bool,
    ) -> RestrainedBlock:
        """Set all attributes from valid values."""
        values = {"block": block, "_terms": tuple(terms), "is_one_sided": is_one_sided, "description": description}
        self.__dict__.update(values, restraints=restraints, lean=lean)
        return self

    def _create_rows(self) -> list[tuple[float, ...]]:
        """Return parameters and, unless free, terms of both sides as stored in `Blocks`."""
        rows = self.block._create_rows()
        if not self.is_one_sided and self._terms == (RestraintTerms(), RestraintTerms()):
            return rows
        rows = [(*row, *terms, float(self.is_one_sided)) for row, terms in zip(rows, self._terms, strict=True)]
        return rows[:1] * 2 if self.is_one_sided else rows

    def _list_radii(self) -> list[float]:
        return self.block._list_radii()

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
        plus, minus = map(_compute_balance, self.block.sides, self._terms)
        return plus, math.inf if self.is_one_sided else minus

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Return the ground accelerations, m/s^2, that lift the block to side + (if -a exceeds it) and to side -."""
        checks.choice(model, "model", OptionError, MODELS)
        structs = self.as_bodies().create_kernel_structs(model, np.zeros((1, 2)))
        plus, minus = (self.gravity * (structs["threshold"] + structs["restraint_threshold"])[0]).tolist()
        return plus, minus

    @property
    def contact_law(self) -> ContactLaw | None:
        """Ratio of the ground forces to the weight, including loads that follow (see `rocking.block.body`).

        The support behind a one-sided block at rest pushes it to side + without friction, as little as required.
        Therefore the remaining ground force is smallest. None for a block from the arrays of `Blocks`, whose forces
        are unknown.
        """
        return None if self.restraints is None else self._compute_contact_forces

    def _compute_contact_forces(
        self,
        kinematics: tuple[Floats, Floats, Floats],
        ground_over_g: tuple[Floats, Floats],
        side: Integers,
        elongation: Floats,
    ) -> tuple[Floats, Floats]:
        horizontal, vertical = self.block.contact_law(kinematics, ground_over_g, side, elongation)
        if self.restraints and self.block.mass is not None:
            pivots, weight = _create_pivots(self.block, self.lean, self.restraints), self.block.mass * self.gravity
            for restraint in self.restraints:
                force_x, force_z = restraint._compute_force(pivots, kinematics[0], side, elongation)
                horizontal, vertical = horizontal - force_x / weight, vertical - force_z / weight
        if self.is_one_sided:
            horizontal = np.where(side < 0, np.minimum(horizontal, 0.0), horizontal)
        return horizontal, vertical

    def compute_tendon_extremes(
        self, largest_rotations: tuple[float, float], model: Model = "nonlinear"
    ) -> list[tuple[float, float, float]]:
        """Return the largest elongation (m), largest force (N) and plastic elongation (m) of each tendon, in order.

        The largest rotations are on side + and side -, rad. The list is empty if the restraints are not
        available.
        """
        plus, minus = largest_rotations
        if model != "linear":
            plus, minus = 2.0 * math.sin(0.5 * plus), 2.0 * math.sin(0.5 * minus)
        pivots = _create_pivots(self.block, self.lean, self.restraints or ())
        tendons = [tendon for tendon in self.restraints or () if isinstance(tendon, Tendon)]
        return [tendon._compute_extremes(pivots, (plus, minus)) for tendon in tendons]


def _describe_restraints(restraints: Sequence[object]) -> list[str]:
    """Describe the restraints, for example as "with a spring of ... and a tendon of ..."."""
    if not restraints:
        return []
    *first, last = [f"a {restraint}" for restraint in restraints]
    return [f"with {', '.join(first)} and {last}" if first else f"with {last}"]


def _check_restraints(restraints: Sequence[object], block: Block) -> None:
    """Reject invalid restraints, and restraints of a block without a mass."""
    for restraint in restraints:
        if not isinstance(restraint, Restraint):
            message = f"{checks.short_repr(restraint)} is not a restraint"
            raise BlockError(f"{message}; give {_RESTRAINT_NAMES} as separate arguments")
    if restraints and block.mass is None:
        raise BlockError("a block with restraints requires its {}, kg", "mass")


def _add_loads(block: Block, loads: Sequence[Load], restitution: float | Sequence[float] | None) -> Block:
    """Return a block combined with the loads that follow it, by default conserving angular momentum."""
    if not loads:
        return block
    assert block.mass is not None
    plus = block.sides[0]
    height = plus.radius * math.cos(plus.alpha)
    distance_plus, distance_minus = (side.radius * math.sin(side.alpha) for side in block.sides)
    masses = np.array([block.mass, *(load.mass for load in loads)])
    offsets = np.array([0.0, *(load.offset for load in loads)])
    heights = np.array([height, *(load.height for load in loads)])
    mass_shares = masses / masses.sum()
    x, z = float(mass_shares @ offsets), float(mass_shares @ heights)
    gyration_squared = block.gravity * plus.radius / plus.p**2 - plus.radius**2
    gyration = float(mass_shares[0] * gyration_squared + mass_shares @ ((offsets - x) ** 2 + (heights - z) ** 2))
    overhang = max(x - distance_plus, -x - distance_minus)
    if overhang >= 0.0:
        message = f"with its loads, the centre of mass of this block lies {overhang:.3g} m beyond its pivot; reduce "
        raise BlockError(f"{message}the mass of a load, or its {{}}", "offset")
    distances, mass = (distance_plus - x, distance_minus + x), float(masses.sum())
    options: dict[str, Any] = {"restitution": restitution, "mass": mass, "gravity": block.gravity}
    return Block.from_pivots(distances, z, math.sqrt(gyration), **options)


def _tilt(block: Block, lean: float) -> Block:
    """Return a block that leans to side + by an angle."""
    if lean == 0.0:
        return block
    plus, minus = block.sides
    if not -minus.alpha < lean < plus.alpha:
        requirement = f"between {-minus.alpha:.4g} and {plus.alpha:.4g} rad for the block to stand"
        hint = f"; if it is in degrees, give math.radians({lean:g})" if 0.5 <= abs(lean) < 90.0 else ""
        raise BlockError(f"{{}} must be {requirement}, not {lean:g}{hint}", "lean", value=lean)
    return block._with_sides((replace(plus, alpha=plus.alpha - lean), replace(minus, alpha=minus.alpha + lean)))


def _find_following_loads(restraints: Sequence[Restraint]) -> list[Load]:
    """Return the loads that follow the block."""
    return [restraint for restraint in restraints if isinstance(restraint, Load) and restraint.moves_with_block]


def _create_pivots(block: Block, lean: float, restraints: Sequence[Restraint]) -> Pivots:
    """Return both pivots of a leaning block with the loads that follow it."""
    mass = math.nan if block.mass is None else block.mass
    shift = sum(load.mass * load.offset for load in _find_following_loads(restraints)) / mass
    plus, minus = (
        Pivot(
            sign, side.alpha, sign * lean, side.radius * math.sin(side.alpha + sign * lean) + sign * shift, side.p,
            mass * block.gravity * side.radius, block.gravity,
        )
        for sign, side in zip((1.0, -1.0), block.sides, strict=True)
    )  # fmt: skip
    return plus, minus


def _compute_balance(side: Side, terms: RestraintTerms) -> float:
    """Return the first rotation without restoring moment or ground motion, rad.

    For a yielding tendon, the first yield is considered.
    """
    if terms[:-3] == RestraintTerms()[:-3]:
        return side.alpha

    def moment(u: float) -> float:
        sine, cosine = math.sin(side.alpha - u), math.cos(side.alpha - u)
        elongation = min(2.0 * terms.lever_arm * math.sin(0.5 * u), terms.yield_elongation) - terms.slack_elongation
        tendon = (terms.prestress + terms.tendon_stiffness * elongation) * math.cos(0.5 * u)
        return (1.0 + terms.sine_coefficient) * sine + terms.cosine_coefficient * cosine + tendon + terms.spring * u

    rotations = np.linspace(0.0, 0.5 * math.pi, _SAMPLE_COUNT)
    values = np.array([moment(u) for u in rotations.tolist()])
    negative = np.flatnonzero(values[1:] <= 0.0)
    if not len(negative):
        return math.inf
    k = int(negative[0])
    return bisect(float(rotations[k]), float(rotations[k + 1]), lambda u: moment(u) <= 0.0)[1]


SINGLE_BODY_TYPES["restrained"] = RestrainedBlock
