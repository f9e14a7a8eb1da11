"""Restraints as moments about the pivots, and laws of restitution."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from rocking.block.sides import check_pair
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.errors import BlockError

#: Force on a block to side + and up, N.
Force = tuple[Floats | float, Floats | float]

#: Largest seed. All whole numbers up to it are exact as floats.
_LARGEST_SEED: Final = 2**53


class RestraintTerms(NamedTuple):
    """Terms of restraints and of a law of restitution on one side, at a rotation u and a rate u'.

    The moment of the restraints about the pivot, positive if it restores the block, divided by weight times R, is

        sine_coefficient sin(alpha - u) + cosine_coefficient cos(alpha - u) + prestress cos(u/2) + spring u
        + (damping/p^2) u'

    plus the moment of a yielding tendon.
    """

    sine_coefficient: float = 0.0
    cosine_coefficient: float = 0.0
    prestress: float = 0.0
    spring: float = 0.0
    damping: float = 0.0  # 1/s
    lever_arm: float = 0.0  # distance of the yielding tendon's duct from the pivot, m
    tendon_stiffness: float = 0.0  # its stiffness times that distance, divided by weight times R, 1/m
    yield_elongation: float = math.inf  # elongation beyond the plastic one at which it yields, m
    slack_elongation: float = 0.0  # elongation above which it is taut, m
    min_restitution: float = 0.0  # lower bound of a varying restitution
    restitution_slope: float = 0.0  # decrease per angular speed of the impact, s/rad
    restitution_seed: float = -1.0  # seed of a random restitution; -1 if not random

    def add(self, other: RestraintTerms) -> RestraintTerms:
        """Return the sum, of which one operand may have a yielding tendon, and only `self` a law of restitution."""
        tendon = self if other.yield_elongation == math.inf else other
        sums = (a + b for a, b in zip(self[:5], other[:5], strict=True))
        return RestraintTerms._make((*sums, *tendon[5:9], *self[9:]))


class Pivot(NamedTuple):
    """Geometry of one side of a standing block, for restraints."""

    sign: float  # +1 on side +, -1 on side -
    alpha: float  # slenderness of the standing block, rad
    lean: float  # angle by which the block leans to this side, rad
    distance: float  # distance along the base to the centre of mass without loads that follow, m
    p: float  # rad/s
    moment: float  # weight times R, N m
    gravity: float  # m/s^2

    def compute_arms(self, height: float, offset: float) -> tuple[float, float]:
        """Return the inward distance from the pivot and the height above it, m, of a point of the standing block.

        The height is above the base, the offset from the centre of mass without loads to side +, both along the axes
        of the block.
        """
        inwards = self.distance - self.sign * offset
        c, s = math.cos(self.lean), math.sin(self.lean)
        return inwards * c - height * s, height * c + inwards * s

    def rotate(self, inwards: float, upwards: float) -> tuple[float, float]:
        """Return ``rho sin`` and ``rho cos`` of the angle of a point from the line to the centre of mass, m."""
        c, s = math.cos(self.alpha), math.sin(self.alpha)
        return inwards * c - upwards * s, upwards * c + inwards * s


#: Pivots of both sides.
Pivots = tuple[Pivot, Pivot]


class Restraint(ABC):
    """Force or moment on a block, as terms for each side.

    See Also
    --------
    rocking.RestrainedBlock : Add restraints to a block.
    rocking.Tendon : Restrain a block by a vertical tendon.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0, mass=800.0)
    >>> restrained = rocking.RestrainedBlock(block, rocking.Spring(1e3), rocking.Damper(200.0))
    >>> isinstance(restrained.restraints[0], rocking.Restraint), restrained.restraints
    (True, (Spring(stiffness=1000.0), Damper(coefficient=200.0)))
    """

    @abstractmethod
    def _compute_terms(self, pivot: Pivot) -> RestraintTerms:
        """Compute the terms while the block leans to one side."""

    def _compute_force(self, pivots: Pivots, rotation: Floats, side: Integers, elongation: Floats) -> Force:
        """Compute the force on the block to side + and up, N, which is zero for springs and dampers.

        ``side`` is -1 at rest, ``elongation`` that of a yielding tendon beyond its plastic elongation, m.
        """
        return 0.0, 0.0

    def _set_finite(self, *names: str) -> None:
        """Check that attributes are finite and convert them to floats."""
        for name in names:
            object.__setattr__(self, name, checks.finite(getattr(self, name), name, BlockError))

    def _set_positive(self, name: str, unit: str) -> None:
        """Check that an attribute is positive and convert it to a float."""
        object.__setattr__(self, name, checks.positive(getattr(self, name), name, BlockError, unit))


@dataclass(frozen=True)
class Tendon(Restraint):
    """Unbonded elastic tendon through a duct in the block and the ground, vertical while the block stands.

    The elongation of the tendon is the opening of the base at the duct, 2 x sin(u/2), with the distance x of the duct
    from the pivot.

    Parameters
    ----------
    stiffness : float
        Force per elongation, N/m; E A/L for a bar.
    prestress : float
        Force while the block stands, N.
    offset : float
        Distance of the duct from the centre of mass of the block without loads, m, positive to side +. A tendon at a
        pivot has no effect while the block rocks about this pivot.
    strength : float
        Yield force, N. Yielding lengthens the tendon permanently, so it is slack after the block has returned.

    Raises
    ------
    BlockError
        If the stiffness or the prestress is negative, both are zero, or the strength does not exceed the prestress.

    See Also
    --------
    RestrainedBlock : Block with restraints.
    Spring : Rotational spring.

    Notes
    -----
    The moment is x cos(u/2) T with the force T = prestress + stiffness 2 x sin(u/2). Without prestress it is stiffness
    x^2 sin(u). Therefore uplift is unchanged, and the slender block has the stiffness p^2 minus stiffness x^2/I, which
    may be negative (:cite:t:`makris2015`; derived in the documentation).

    Examples
    --------
    >>> Tendon(2e6, prestress=5e3)
    Tendon(stiffness=2000000.0, prestress=5000.0, offset=0.0, strength=inf)
    """

    stiffness: float
    prestress: float = 0.0
    offset: float = 0.0
    strength: float = math.inf

    def __post_init__(self) -> None:
        self._set_finite("stiffness", "prestress", "offset")
        stiffness, prestress = self.stiffness, self.prestress
        for name, value, unit in (("stiffness", stiffness, "N/m"), ("prestress", prestress, "N")):
            if value < 0.0:
                raise BlockError(f"{{}} of a tendon must be at least 0 {unit}, not {value:g}", name, value=value)
        if stiffness == prestress == 0.0:
            raise BlockError("a tendon requires {} (N/m) or {} (N)", "stiffness", "prestress")
        object.__setattr__(self, "strength", checks.real(self.strength, "strength", BlockError))
        if not self.strength > prestress:
            message = f"{{}} of a tendon must be above its prestress, {prestress:g} N, not {self.strength:g}"
            raise BlockError(message, "strength", value=self.strength)
        if stiffness == 0.0 and self.strength < math.inf:
            raise BlockError("a yielding tendon requires a {}, N/m", "stiffness")

    def _compute_terms(self, pivot: Pivot) -> RestraintTerms:
        x = self._compute_lever_arm(pivot)
        if self.strength < math.inf:
            yields, slack = (self.strength - self.prestress) / self.stiffness, -self.prestress / self.stiffness
            return RestraintTerms(
                lever_arm=x,
                tendon_stiffness=self.stiffness * x / pivot.moment,
                yield_elongation=yields,
                slack_elongation=slack,
            )
        factor = self.stiffness * x * x / pivot.moment
        return RestraintTerms(
            -factor * math.cos(pivot.alpha), factor * math.sin(pivot.alpha), self.prestress * x / pivot.moment
        )

    def _compute_force(self, pivots: Pivots, rotation: Floats, side: Integers, elongation: Floats) -> Force:
        """Compute the force of the tendon, along the chord between its ends."""
        if self.strength == math.inf:
            x = np.where(side == 1, self._compute_lever_arm(pivots[1]), self._compute_lever_arm(pivots[0]))
            elongation = 2.0 * x * np.sin(0.5 * np.abs(rotation))
        tension = np.clip(self.prestress + self.stiffness * elongation, 0.0, self.strength)
        inclination = 0.5 * rotation + pivots[0].lean
        return -tension * np.sin(inclination), -tension * np.cos(inclination)

    def _compute_extremes(self, pivots: Pivots, ratios: tuple[float, float]) -> tuple[float, float, float]:
        """Compute the largest elongation, m, the largest force, N, and the plastic elongation, m.

        ``ratios``: largest opening of the base on each side divided by the distance from the pivot.
        """
        elongation = max(self._compute_lever_arm(pivot) * ratio for pivot, ratio in zip(pivots, ratios, strict=True))
        elastic = self.prestress + self.stiffness * elongation
        if elastic <= self.strength:
            return elongation, elastic, 0.0
        return elongation, self.strength, (elastic - self.strength) / self.stiffness

    def __str__(self) -> str:
        stiffness = _format_si(self.stiffness, "N/m") if self.stiffness else "constant force"
        prestress = f"prestress {_format_si(self.prestress, 'N')}" if self.prestress else "no prestress"
        strength = f", yielding at {_format_si(self.strength, 'N')}" if self.strength < math.inf else ""
        position = _describe_offset(self.offset) or " at the centre of mass"
        return f"tendon of {stiffness}, {prestress}{strength}{position}"

    def _compute_lever_arm(self, pivot: Pivot) -> float:
        """Return the distance of the duct from the pivot, m."""
        x = pivot.distance - pivot.sign * self.offset
        if x < -1e-12 * pivot.distance:
            place = f"beyond the pivot, which is {pivot.distance:g} m from the centre of mass"
            raise BlockError(f"a tendon at {{}} = {self.offset:g} m is {place}", "offset", value=self.offset)
        return max(x, 0.0)


@dataclass(frozen=True)
class Spring(Restraint):
    """Rotational spring between block and ground.

    Parameters
    ----------
    stiffness : float
        Moment per rotation, N m/rad. For a vertical spring of k N/m at a distance x from the pivot use a `Tendon`.

    See Also
    --------
    RestrainedBlock : Block with restraints.
    Tendon : Vertical tendon or spring.

    Examples
    --------
    >>> Spring(1e3)
    Spring(stiffness=1000.0)
    """

    stiffness: float

    def __post_init__(self) -> None:
        self._set_positive("stiffness", "N m/rad")

    def _compute_terms(self, pivot: Pivot) -> RestraintTerms:
        return RestraintTerms(spring=self.stiffness / pivot.moment)

    def __str__(self) -> str:
        return f"spring of {_format_si(self.stiffness, 'N m/rad')}"


@dataclass(frozen=True)
class Damper(Restraint):
    """Linear viscous damper between block and ground.

    Parameters
    ----------
    coefficient : float
        Moment per angular velocity, N m s/rad.

    See Also
    --------
    RestrainedBlock : Block with restraints.

    Examples
    --------
    >>> Damper(200.0)
    Damper(coefficient=200.0)
    """

    coefficient: float

    def __post_init__(self) -> None:
        self._set_positive("coefficient", "N m s/rad")

    def _compute_terms(self, pivot: Pivot) -> RestraintTerms:
        return RestraintTerms(damping=self.coefficient * pivot.p**2 / pivot.moment)

    def __str__(self) -> str:
        return f"damper of {_format_si(self.coefficient, 'N m s/rad')}"


@dataclass(frozen=True)
class Thrust(Restraint):
    """Constant horizontal force, such as the thrust of a vault on a wall, independent of vertical ground motion.

    Parameters
    ----------
    force : float
        Force, N, positive to side +.
    height, offset : float
        Height above the base and offset (as of a `Load`) of the point of application, m.

    Raises
    ------
    BlockError
        If the force is zero, or the height is not positive.

    See Also
    --------
    RestrainedBlock : Block with restraints.
    Load : Weight on the block.

    Examples
    --------
    >>> Thrust(1.5e3, height=4.0)
    Thrust(force=1500.0, height=4.0, offset=0.0)
    """

    force: float
    height: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        self._set_finite("force", "offset")
        if self.force == 0.0:
            raise BlockError("{} of a thrust must not be zero", "force", value=self.force)
        self._set_positive("height", "m")

    def _compute_terms(self, pivot: Pivot) -> RestraintTerms:
        rho_sin, rho_cos = pivot.rotate(*pivot.compute_arms(self.height, self.offset))
        force = pivot.sign * self.force / pivot.moment
        return RestraintTerms(force * rho_sin, -force * rho_cos)

    def _compute_force(self, pivots: Pivots, rotation: Floats, side: Integers, elongation: Floats) -> Force:
        return self.force, 0.0

    def __str__(self) -> str:
        position = f"at a height of {self.height:.5g} m{_describe_offset(self.offset)}"
        return f"thrust of {_format_si(self.force, 'N')} {position}"


@dataclass(frozen=True)
class Load(Restraint):
    """Weight on the block that either moves with it or only presses on it, like a floor that slides on a wall.

    Parameters
    ----------
    mass : float
        Mass, kg.
    height : float
        Height of the point of support above the base, m.
    offset : float
        Distance of this point from the centre of mass of the block without loads, m, positive to side +.
    moves_with_block : bool
        Whether the load moves with the block. Otherwise it presses with its static weight, without inertia.

    Raises
    ------
    BlockError
        If the mass or the height is not positive.

    See Also
    --------
    RestrainedBlock : Block with restraints.
    Thrust : Constant horizontal force.

    Examples
    --------
    >>> Load(250.0, height=3.0, moves_with_block=False)
    Load(mass=250.0, height=3.0, offset=0.0, moves_with_block=False)
    """

    mass: float
    height: float
    offset: float = 0.0
    moves_with_block: bool = True

    def __post_init__(self) -> None:
        self._set_positive("mass", "kg")
        self._set_positive("height", "m")
        self._set_finite("offset")
        object.__setattr__(
            self, "moves_with_block", checks.boolean(self.moves_with_block, "moves_with_block", BlockError)
        )

    def _compute_terms(self, pivot: Pivot) -> RestraintTerms:
        if self.moves_with_block:  # part of the block
            return RestraintTerms()
        rho_sin, rho_cos = pivot.rotate(*pivot.compute_arms(self.height, self.offset))
        weight = self.mass * pivot.gravity / pivot.moment
        return RestraintTerms(weight * rho_cos, weight * rho_sin)

    def _compute_force(self, pivots: Pivots, rotation: Floats, side: Integers, elongation: Floats) -> Force:
        return 0.0, 0.0 if self.moves_with_block else -self.mass * pivots[0].gravity

    def __str__(self) -> str:
        behaviour = "that moves with it" if self.moves_with_block else "that only presses"
        position = f"at a height of {self.height:.5g} m{_describe_offset(self.offset)}"
        return f"load of {self.mass:.5g} kg {behaviour} {position}"


@dataclass(frozen=True)
class Restitution:
    """Law by which the restitution of a `RestrainedBlock` varies between two bounds from impact to impact.

    With a slope the restitution decreases linearly with the speed of the impact: max(minimum, maximum - slope speed).
    With a seed it is drawn at each impact, uniformly between both bounds, by Philox 2x32 with ten rounds
    (:cite:t:`salmon2011`).

    Parameters
    ----------
    maximum, minimum : float or pair
        Bounds of the factor on the angular speed, in (0, 1]. A pair is (on leaving side +, on leaving side -). The
        maximum replaces the restitution of each `Side`.
    slope : float or pair
        Decrease per angular speed before the impact, s/rad, at least 0.
    seed : int, optional
        Whole number from 0 to 2^53, preferably different for each body. The factor depends only on the seed and the
        number of the impact. Therefore it is the same under any ground motion, for a body alone or among others. After
        a rest, the numbering continues from the last simulated impact. The later factors therefore depend on the
        chattering scheme, because a finer scheme simulates more impacts before the rest.

    Raises
    ------
    BlockError
        If a bound, the slope or the seed is out of its range, or a slope and a seed are both given or both
        missing.

    See Also
    --------
    RestrainedBlock : Block that accepts this law.

    Examples
    --------
    >>> from rocking import Block, RestrainedBlock, simulate
    >>> block = RestrainedBlock(Block(width=0.4, height=2.0), restitution=Restitution(0.95, 0.8, slope=0.2))
    >>> hits = simulate(block, None, initial_rotation=0.15).impacts
    >>> [round(float(hit["speed_after"] / hit["speed_before"]), 4) for hit in hits[:3]]
    [0.8473, 0.8629, 0.8749]
    """

    maximum: float | Sequence[float]
    minimum: float | Sequence[float]
    slope: float | Sequence[float] | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        if self.slope is None:
            if self.seed is None:
                raise BlockError("a law of restitution requires a {} or a {}", "slope", "seed")
            object.__setattr__(self, "slope", 0.0)
        slopes = check_pair(self.slope, "slope")
        if invalid := [slope for slope in slopes if not 0.0 <= slope < math.inf]:
            message = f"{{}} must be finite and at least 0, in s/rad, not {invalid[0]:g}"
            raise BlockError(message, "slope", value=self.slope)
        for low, high in zip(check_pair(self.minimum, "minimum"), check_pair(self.maximum, "maximum"), strict=True):
            if not 0.0 < high <= 1.0:
                hint = checks.hint_at_percent(high)
                raise BlockError(f"{{}} must be in (0, 1], not {high:g}{hint}", "maximum", value=self.maximum)
            if not 0.0 < low <= high:
                message = f"{{}} must be above 0 and at most {{}}, {high:g}, not {low:g}"
                raise BlockError(message, "minimum", "maximum", value=self.minimum)
        if self.seed is not None:
            checks.integer(self.seed, "seed", BlockError, 0, _LARGEST_SEED)
            if max(slopes) > 0.0:
                raise BlockError("a law of restitution has either a {} or a {}, not both", "slope", "seed")

    def _compute_terms(self, side: int) -> dict[str, float]:
        """Return the law on leaving a side as fields of `RestraintTerms`, without the largest factor."""
        minimum, slope = (check_pair(getattr(self, name), name)[side] for name in ("minimum", "slope"))
        seed = -1.0 if self.seed is None else float(self.seed)
        return {"min_restitution": minimum, "restitution_slope": slope, "restitution_seed": seed}

    def __str__(self) -> str:
        if self.seed is None:
            return f"restitution falling from {self.maximum} by {self.slope} per rad/s to {self.minimum}"
        return f"restitution drawn from {self.minimum} to {self.maximum}, seed {self.seed}"


def _describe_offset(offset: float) -> str:
    """Describe a position off the centre of mass."""
    return f" {abs(offset):.5g} m to side {'+' if offset > 0.0 else '-'}" if offset else ""


def _format_si(value: float, unit: str) -> str:
    """Format a number with its unit, if large with kilo, mega or giga."""
    for size, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:.5g} {prefix}{unit}"
    return f"{value:.5g} {unit}"
