"""Tendons, springs, dampers, thrusts and loads as terms of the moment about the pivots of a block; laws of impacts."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from rocking.block.sides import checked_pair
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.errors import InvalidBlock

#: Force on a block to side + and up, N.
Force = tuple[Floats | float, Floats | float]

#: Largest seed: whole numbers up to it are floats, too.
_LARGEST_SEED: Final = 2**53


class Terms(NamedTuple):
    """What restraints add on one side, at a rotation u and a rate u'; a law of restitution, too.

    Their moment about the pivot, positive where it brings the block back, divided by weight times R, is

        sine sin(alpha - u) + cosine cos(alpha - u) + prestress cos(u/2) + spring u + (damping/p^2) u'

    and that of a tendon that yields.
    """

    sine: float = 0.0
    cosine: float = 0.0
    prestress: float = 0.0
    spring: float = 0.0
    damping: float = 0.0  # 1/s
    opening: float = 0.0  # distance of the yielding tendon's duct from the pivot, m
    stiffness: float = 0.0  # its stiffness times that distance, divided by weight times R, 1/m
    yields: float = math.inf  # elongation beyond the plastic one at which it yields, m
    slack: float = 0.0  # elongation above which it is taut, m
    restitution_least: float = 0.0  # lower bound of a restitution that varies
    restitution_slope: float = 0.0  # how much it falls per angular speed of the impact, s/rad
    restitution_seed: float = -1.0  # by which it is drawn at each impact; -1 where it is not

    def plus(self, other: Terms) -> Terms:
        """Return both together; one of them at most has a tendon that yields, and only this one a restitution."""
        tendon = self if other.yields == math.inf else other
        sums = (a + b for a, b in zip(self[:5], other[:5], strict=True))
        return Terms._make((*sums, *tendon[5:9], *self[9:]))


class Pivot(NamedTuple):
    """One side of a standing block, as restraints see it."""

    sign: float  # +1 on side +, -1 on side -
    alpha: float  # slenderness as it stands, rad
    lean: float  # angle by which the block leans to this side, rad
    distance: float  # of the pivot along the base from the centre of mass without loads that follow, m
    p: float  # rad/s
    moment: float  # weight times R, N m
    gravity: float  # m/s^2

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


class Restraint(ABC):
    """Force or moment on a block, as a term for each side."""

    @abstractmethod
    def _terms(self, pivot: Pivot) -> Terms:
        """Return what it adds while the block leans to a side."""

    def _acting(self, pivots: tuple[Pivot, Pivot], rotation: Floats, side: Integers, stretch: Floats) -> Force:
        """Return the force on the block to side + and up, N; a spring and a damper have none.

        ``side`` is -1 at rest, ``stretch`` the elongation of a tendon that yields beyond its plastic one, m.
        """
        return 0.0, 0.0

    def _finite(self, *names: str) -> None:
        """Check numbers and keep them as floats."""
        for name in names:
            object.__setattr__(self, name, checks.finite(getattr(self, name), name, InvalidBlock))

    def _positive(self, name: str, unit: str) -> None:
        """Check that a number is positive and keep it as a float."""
        object.__setattr__(self, name, checks.positive(getattr(self, name), name, InvalidBlock, unit))


@dataclass(frozen=True)
class Tendon(Restraint):
    """Elastic tendon through a duct in the block and the ground, unbonded, as long as the block stands it is vertical.

    Where the block's base opens at the duct by 2 x sin(u/2), x being the duct's distance from the pivot, the tendon
    becomes longer by that.

    Parameters
    ----------
    stiffness : float
        Force per elongation, N/m: of a bar E A/L.
    prestress : float
        Force while the block stands, N.
    offset : float
        Distance of the duct from the centre of mass of the block without loads, m, positive to side +. At a pivot's
        distance it is at that toe, and does nothing while the block rocks about it.
    strength : float
        Force at which it yields, N: it becomes longer for good then, and hangs slack when the block has come back.

    Raises
    ------
    InvalidBlock
        If the stiffness or the prestress is negative, or both are zero, or the strength is not above the prestress.

    Notes
    -----
    The moment is x cos(u/2) T with the force T = prestress + stiffness 2 x sin(u/2): without prestress
    stiffness x^2 sin(u), so that uplift is unchanged, and the slender block has the stiffness p^2 less
    stiffness x^2/I, which may be negative (Makris and Vassiliou 2015; derived in the documentation).

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
        self._finite("stiffness", "prestress", "offset")
        stiffness, prestress = self.stiffness, self.prestress
        for name, value, unit in (("stiffness", stiffness, "N/m"), ("prestress", prestress, "N")):
            if value < 0.0:
                raise InvalidBlock(f"{{}} of a tendon must be at least 0 {unit}, not {value:g}", name, value=value)
        if stiffness == prestress == 0.0:
            raise InvalidBlock("a tendon needs {} (N/m) or {} (N)", "stiffness", "prestress")
        object.__setattr__(self, "strength", checks.number(self.strength, "strength", InvalidBlock))
        if not self.strength > prestress:
            raise InvalidBlock(
                f"{{}} of a tendon must be above its prestress, {prestress:g} N, not {self.strength:g}",
                "strength",
                value=self.strength,
            )
        if stiffness == 0.0 and self.strength < math.inf:
            raise InvalidBlock("a tendon that yields needs a {}, N/m", "stiffness")

    def _terms(self, pivot: Pivot) -> Terms:
        x = self._opening(pivot)
        if self.strength < math.inf:
            yields = (self.strength - self.prestress) / self.stiffness
            return Terms(
                opening=x, stiffness=self.stiffness * x / pivot.moment, yields=yields,
                slack=-self.prestress / self.stiffness,
            )  # fmt: skip
        stiff = self.stiffness * x * x / pivot.moment
        return Terms(-stiff * math.cos(pivot.alpha), stiff * math.sin(pivot.alpha), self.prestress * x / pivot.moment)

    def _acting(self, pivots: tuple[Pivot, Pivot], rotation: Floats, side: Integers, stretch: Floats) -> Force:
        """Return its pull, along the chord from its end in the block to that in the ground."""
        if self.strength == math.inf:
            x = np.where(side == 1, self._opening(pivots[1]), self._opening(pivots[0]))
            stretch = 2.0 * x * np.sin(0.5 * np.abs(rotation))
        pull = np.clip(self.prestress + self.stiffness * stretch, 0.0, self.strength)
        along = 0.5 * rotation + pivots[0].lean
        return -pull * np.sin(along), -pull * np.cos(along)

    def _stretched(self, pivots: tuple[Pivot, Pivot], bends: tuple[float, float]) -> tuple[float, float, float]:
        """Return the largest elongation, m, the largest force, N, and the plastic elongation, m.

        ``bends``: largest opening of the base on each side divided by the distance from the pivot.
        """
        elongation = max(self._opening(pivot) * bend for pivot, bend in zip(pivots, bends, strict=True))
        elastic = self.prestress + self.stiffness * elongation
        if elastic <= self.strength:
            return elongation, elastic, 0.0
        return elongation, self.strength, (elastic - self.strength) / self.stiffness

    def __str__(self) -> str:
        parts = [
            _thousands(self.stiffness, "N/m") if self.stiffness else "constant force",
            f"prestress {_thousands(self.prestress, 'N')}" if self.prestress else "no prestress",
            f"yielding at {_thousands(self.strength, 'N')}" if self.strength < math.inf else "",
        ]
        return f"tendon of {', '.join(filter(None, parts))}{_at(self.offset) or ' at the centre of mass'}"

    def _opening(self, pivot: Pivot) -> float:
        """Distance of the duct from the pivot, m."""
        x = pivot.distance - pivot.sign * self.offset
        if x < -1e-12 * pivot.distance:
            raise InvalidBlock(
                f"a tendon at {{}} = {self.offset:g} m is beyond the pivot, which is {pivot.distance:g} m from the "
                "centre of mass",
                "offset",
                value=self.offset,
            )
        return max(x, 0.0)


@dataclass(frozen=True)
class Spring(Restraint):
    """Rotational spring between block and ground.

    Parameters
    ----------
    stiffness : float
        Moment per rotation, N m/rad. A vertical spring of k N/m at a distance x from the pivot is a `Tendon`.

    Examples
    --------
    >>> Spring(1e3)
    Spring(stiffness=1000.0)
    """

    stiffness: float

    def __post_init__(self) -> None:
        self._positive("stiffness", "N m/rad")

    def _terms(self, pivot: Pivot) -> Terms:
        return Terms(spring=self.stiffness / pivot.moment)

    def __str__(self) -> str:
        return f"spring of {_thousands(self.stiffness, 'N m/rad')}"


@dataclass(frozen=True)
class Damper(Restraint):
    """Linear viscous damper between block and ground.

    Parameters
    ----------
    coefficient : float
        Moment per angular velocity, N m s/rad.

    Examples
    --------
    >>> Damper(200.0)
    Damper(coefficient=200.0)
    """

    coefficient: float

    def __post_init__(self) -> None:
        self._positive("coefficient", "N m s/rad")

    def _terms(self, pivot: Pivot) -> Terms:
        return Terms(damping=self.coefficient * pivot.p**2 / pivot.moment)

    def __str__(self) -> str:
        return f"damper of {_thousands(self.coefficient, 'N m s/rad')}"


@dataclass(frozen=True)
class Thrust(Restraint):
    """Horizontal force of constant size, as of a vault on a wall; vertical ground motion does not change it.

    Parameters
    ----------
    force : float
        N, positive to side +.
    height, offset : float
        Height above the base of the point where it acts, and offset of that point as of a `Load`, m.

    Raises
    ------
    InvalidBlock
        If the force is zero, or the height not positive.

    Examples
    --------
    >>> Thrust(1.5e3, height=4.0)
    Thrust(force=1500.0, height=4.0, offset=0.0)
    """

    force: float
    height: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        self._finite("force", "offset")
        if self.force == 0.0:
            raise InvalidBlock("{} of a thrust must not be zero", "force", value=self.force)
        self._positive("height", "m")

    def _terms(self, pivot: Pivot) -> Terms:
        across, along = pivot.turned(*pivot.arms(self.height, self.offset))
        force = pivot.sign * self.force / pivot.moment
        return Terms(force * across, -force * along)

    def _acting(self, pivots: tuple[Pivot, Pivot], rotation: Floats, side: Integers, stretch: Floats) -> Force:
        return self.force, 0.0

    def __str__(self) -> str:
        return f"thrust of {_thousands(self.force, 'N')} at a height of {self.height:.5g} m{_at(self.offset)}"


@dataclass(frozen=True)
class Load(Restraint):
    """Weight on the block: one that moves with it, or one that only presses, as a floor that slides on a wall.

    Parameters
    ----------
    mass : float
        kg.
    height : float
        Height of the point where it rests, above the base, m.
    offset : float
        Distance of that point from the centre of mass of the block without loads, m, positive to side +.
    follows : bool
        Whether it moves with the block. One that does not presses with its weight, whatever the ground does, and its
        own inertia does not count.

    Raises
    ------
    InvalidBlock
        If mass or height are not positive.

    Examples
    --------
    >>> Load(250.0, height=3.0, follows=False)
    Load(mass=250.0, height=3.0, offset=0.0, follows=False)
    """

    mass: float
    height: float
    offset: float = 0.0
    follows: bool = True

    def __post_init__(self) -> None:
        self._positive("mass", "kg")
        self._positive("height", "m")
        self._finite("offset")
        object.__setattr__(self, "follows", checks.flag(self.follows, "follows", InvalidBlock))

    def _terms(self, pivot: Pivot) -> Terms:
        if self.follows:  # it is part of the block
            return Terms()
        across, along = pivot.turned(*pivot.arms(self.height, self.offset))
        weight = self.mass * pivot.gravity / pivot.moment
        return Terms(weight * along, weight * across)

    def _acting(self, pivots: tuple[Pivot, Pivot], rotation: Floats, side: Integers, stretch: Floats) -> Force:
        return 0.0, 0.0 if self.follows else -self.mass * pivots[0].gravity

    def __str__(self) -> str:
        follows = "that follows" if self.follows else "that only presses"
        return f"load of {self.mass:.5g} kg {follows} at a height of {self.height:.5g} m{_at(self.offset)}"


@dataclass(frozen=True)
class Restitution:
    """A law by which the restitution of a `RestrainedBlock` varies from impact to impact, between two bounds.

    With a slope it falls in a straight line with the speed of the impact: max(least, largest - slope speed). With a
    seed it is drawn at each impact, evenly between both, by Philox 2x32 with ten rounds.

    Parameters
    ----------
    largest, least : float or pair
        Bounds of the factor on the angular speed, in (0, 1]; a pair is (on leaving side +, on leaving side -). The
        largest takes the place of the restitution of each `Side`.
    slope : float or pair, optional
        How much it falls per angular speed before the impact, s/rad, at least 0.
    seed : int, optional
        Whole number from 0 to 2^53. The factor depends on it and on the number of the impact alone: a body draws the
        same ones whatever shakes it, and whether it is simulated alone or with others. Give bodies seeds of their own.
        After a rest it goes on from the impacts that were resolved, of which a finer treatment has more.

    Raises
    ------
    InvalidBlock
        If a bound, the slope or the seed is out of its range, or there are both a slope and a seed, or neither.

    References
    ----------
    J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011).

    Examples
    --------
    >>> from rocking import Block, RestrainedBlock, simulate
    >>> block = RestrainedBlock(Block(width=0.4, height=2.0), restitution=Restitution(0.95, 0.8, slope=0.2))
    >>> hits = simulate(block, None, initial_rotation=0.15).impacts
    >>> [round(float(hit["speed_after"] / hit["speed_before"]), 4) for hit in hits[:3]]
    [0.8473, 0.8629, 0.8749]
    """

    largest: float | Sequence[float]
    least: float | Sequence[float]
    slope: float | Sequence[float] | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        if self.slope is None:
            if self.seed is None:
                raise InvalidBlock("a restitution that varies needs a {} or a {}", "slope", "seed")
            object.__setattr__(self, "slope", 0.0)
        slopes = checked_pair(self.slope, "slope")
        if wrong := [slope for slope in slopes if not 0.0 <= slope < math.inf]:
            raise InvalidBlock(
                f"{{}} must be finite and at least 0, in s/rad, not {wrong[0]:g}: a faster impact loses more",
                "slope",
                value=self.slope,
            )
        for low, high in zip(checked_pair(self.least, "least"), checked_pair(self.largest, "largest"), strict=True):
            if not 0.0 < high <= 1.0:
                hint = checks.hint_of_percent(high)
                raise InvalidBlock(f"{{}} must be in (0, 1], not {high:g}{hint}", "largest", value=self.largest)
            if not 0.0 < low <= high:
                raise InvalidBlock(
                    f"{{}} must be above 0 and at most {{}}, {high:g}, not {low:g}", "least", "largest",
                    value=self.least,
                )  # fmt: skip
        if self.seed is not None:
            checks.whole(self.seed, "seed", InvalidBlock, 0, _LARGEST_SEED)
            if max(slopes) > 0.0:
                raise InvalidBlock("a restitution either falls or is drawn: give a {} or a {}", "slope", "seed")

    def _terms(self, side: int) -> dict[str, float]:
        """Return what is below the largest factor on leaving a side, as fields of `restraints.Terms`."""
        least, slope = (checked_pair(getattr(self, name), name)[side] for name in ("least", "slope"))
        seed = -1.0 if self.seed is None else float(self.seed)
        return {"restitution_least": least, "restitution_slope": slope, "restitution_seed": seed}

    def __str__(self) -> str:
        if self.seed is None:
            return f"restitution falling from {self.largest} by {self.slope} per rad/s to {self.least}"
        return f"restitution drawn from {self.least} to {self.largest}, seed {self.seed}"


def _at(offset: float) -> str:
    """Say where it is, if not at the centre of mass."""
    return f" {abs(offset):.5g} m to side {'+' if offset > 0.0 else '-'}" if offset else ""


def _thousands(value: float, unit: str) -> str:
    """Write a number with its unit: with kilo, mega or giga where it is large."""
    for size, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:.5g} {prefix}{unit}"
    return f"{value:.5g} {unit}"
