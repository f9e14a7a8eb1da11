"""Blocks that are held back by restraints, lean, or rock one way only: one, and many."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.block.restitution import Restitution, Varying, one_sided_restitution
from rocking.block.restraints import Held, Load, Restraint, Tendon, Yielding
from rocking.block.single import Block, Side, one_block
from rocking.block.standing import balance_of, carrying, leaning, pivots_of, with_restitution
from rocking.body import KINDS, ContactLaw, Coordinate
from rocking.constants import MODELS, STANDARD_GRAVITY, Model
from rocking.errors import InvalidBlock, InvalidOption
from rocking.kernels import state

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
        own, one_way = one_block(block), checks.truth(one_sided, "one_sided", InvalidBlock)
        _check(restraints, own)
        tilt = checks.finite(lean, "lean", InvalidBlock)
        loads = [each for each in restraints if isinstance(each, Load) and each.follows]
        standing = leaning(carrying(own, loads), tilt)
        if one_way and restitution is None:
            restitution = one_sided_restitution(own.sides[0].alpha)
        varying = Varying(), Varying()
        if isinstance(restitution, Restitution):
            varying = restitution._varying()
        if restitution is not None:
            standing = with_restitution(standing, restitution)
        pivots = pivots_of(standing, tilt)
        held = [Held(), Held()]
        for each in restraints:
            held = [of_side.plus(each._held(pivot)) for of_side, pivot in zip(held, pivots, strict=True)]
        yielding = [found for each in restraints for pivot in pivots if (found := each._yielding(pivot))]
        if len(yielding) > len(pivots):
            raise InvalidBlock("one tendon of a block may yield; let the others have no {}", "strength")
        tendon = (yielding[0], yielding[1]) if yielding else (Yielding(), Yielding())
        rest = [f"leaning {tilt:.4g} rad to side +"] * (tilt != 0.0) + ["rocking one way"] * one_way
        rest += [str(restitution)] * isinstance(restitution, Restitution)
        kinds = [type(each).__name__.lower() for each in restraints]
        text, title = (", ".join([own.description, *_listed(words), *rest]) for words in (restraints, kinds))
        title = title if len(restraints) > _FEW else text
        _fill(self, standing, (held[0], held[1]), tendon, varying, one_way, (text, title), restraints, tilt)
        if (least := min(self.uplift_thresholds())) <= 0.0:
            raise InvalidBlock(
                f"this block does not stand: it would take a ground acceleration of {least:.3g} m/s^2 to lift it; "
                f"a smaller thrust, load or lean lets it{'; forces are in N, masses in kg' * (least < -self.gravity)}"
            )

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

        They are those of `contact_forces`, without a tendon that yields. None where they are not known: of one that was
        made of the arrays of `RestrainedBlocks`.
        """
        return None if self.restraints is None else self.contact_forces

    def tension(self, elongation: Floats) -> Floats:
        """Force of its tendon that yields, N, from its elongation beyond the plastic one, m.

        Parameters
        ----------
        elongation : ndarray
            Elongation since the block stood, less the plastic one.

        Returns
        -------
        ndarray
            Of the same shape; none where no tendon yields.

        Examples
        --------
        >>> from rocking import Tendon
        >>> column = RestrainedBlock(Block(width=0.4, height=2.0, mass=2000.0), Tendon(2e5, 1e3, strength=3e3))
        >>> column.tension(np.array([-0.02, 0.0, 0.005, 0.1]))
        array([   0., 1000., 2000., 3000.])
        """
        for each in self.restraints or ():
            if isinstance(each, Tendon) and each.strength < math.inf:
                return np.clip(each.prestress + each.stiffness * elongation, 0.0, each.strength)
        return np.zeros_like(elongation)

    def contact_forces(
        self,
        motion: tuple[Floats, Floats, Floats],
        ground_over_g: tuple[Floats, Floats],
        side: Integers,
        tension: Floats | float = 0.0,
    ) -> tuple[Floats, Floats]:
        """Return the forces of the ground over the weight, horizontal and vertical.

        What stands behind a block of one side pushes it to side +, without friction, as far as that is needed while it
        is at rest; so what is left for the ground is least then.

        Parameters
        ----------
        motion : tuple of ndarray
            Rotation and its two rates, rad and s.
        ground_over_g : tuple of ndarray
            Accelerations of the ground, horizontal and vertical, over g.
        side : ndarray of int
            0 on side +, 1 on side -, -1 at rest.
        tension : ndarray or float
            Force of a tendon that yields, N.

        Returns
        -------
        (ndarray, ndarray)
            To side + and up.

        Examples
        --------
        >>> wall = Block.one_sided(width=0.4, height=4.0)
        >>> still, at_rest = np.zeros(2), np.array([-1, -1])
        >>> wall.contact_forces((still, still, still), (np.array([-0.05, 0.3]), still), at_rest)
        (array([-0.05,  0.  ]), array([1., 1.]))
        """
        horizontal, vertical = self.block.contact(motion, ground_over_g, side)
        if self.restraints and self.block.mass is not None:
            pivots, weight = pivots_of(self.block, self.lean), self.block.mass * self.gravity
            for each in self.restraints:
                if isinstance(each, Tendon) and each.strength < math.inf:
                    across, up = each._along(pivots, motion[0], tension)
                else:
                    across, up = each._acting(pivots, motion[0], side)
                horizontal, vertical = horizontal - across / weight, vertical - up / weight
        if self.is_one_sided:
            horizontal = np.where(side < 0, np.minimum(horizontal, 0.0), horizontal)
        return horizontal, vertical

    def tendons_at(self, largest: tuple[float, float]) -> list[tuple[float, float, float]]:
        """Return how far each tendon was stretched by rotations, in the order of the restraints.

        Parameters
        ----------
        largest : (float, float)
            Largest rotation on each side, rad.

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
        pivots = pivots_of(self.block, self.lean)
        tendons = [each for each in self.restraints or () if isinstance(each, Tendon)]
        return [each._stretched(pivots, largest) for each in tendons]

    def alone(self) -> RestrainedBlocks:
        """Return `RestrainedBlocks` of which it is the only one."""
        return RestrainedBlocks.of([self])


@dataclass(frozen=True, eq=False)
class RestrainedBlocks:
    """Any number n of such blocks under one gravity, each array of shape (n, 2): side +, side -.

    Parameters
    ----------
    p, alpha, restitution : ndarray
        As of `rocking.Blocks`, of the blocks as they stand.
    sine, cosine, prestress, spring, damping : ndarray
        What the restraints do: the coefficients s, c, h, k and d of `RestrainedBlock`; damping in 1/s.
    opening, stiffness, yields, slack : ndarray
        Of a tendon that yields what `rocking.block.restraints.Yielding` says, in m and 1/m; of none 0, 0, inf and 0.
    restitution_least, restitution_slope, restitution_seed : ndarray
        Of a restitution that varies what `rocking.block.restitution.Varying` says, the largest being `restitution`: 1,
        s/rad and 1; of a constant one 0, 0 and -1.
    one_sided : ndarray
        1 where a block rocks to side + only, else 0, twice the same; all else of such a block is that of side +, twice.
    gravity : float
        m/s^2.

    Examples
    --------
    >>> wall = Block.one_sided(width=0.4, height=4.0, restitution=0.4)
    >>> RestrainedBlocks.of([wall, wall])
    <RestrainedBlocks: 2>
    """

    kind: ClassVar[str] = "restrained-blocks"

    p: Floats
    alpha: Floats
    restitution: Floats
    sine: Floats
    cosine: Floats
    prestress: Floats
    spring: Floats
    damping: Floats
    opening: Floats
    stiffness: Floats
    yields: Floats
    slack: Floats
    restitution_least: Floats
    restitution_slope: Floats
    restitution_seed: Floats
    one_sided: Floats
    gravity: float = STANDARD_GRAVITY

    @classmethod
    def of(cls, bodies: Iterable[RestrainedBlock]) -> RestrainedBlocks:
        """Gather single ones.

        Parameters
        ----------
        bodies : iterable of RestrainedBlock
            At least one, all under one gravity.

        Returns
        -------
        RestrainedBlocks
            In their order.

        Raises
        ------
        InvalidBlock
            If there is none, one is none, or their gravities differ.

        Examples
        --------
        >>> len(RestrainedBlocks.of([Block.one_sided(width=0.4, height=4.0, restitution=0.4)]))
        1
        """
        given = list(bodies)
        if not given or not all(isinstance(each, RestrainedBlock) for each in given):
            raise InvalidBlock("restrained blocks are needed, at least one, and of free ones RestrainedBlock(block)")
        if len({each.gravity for each in given}) > 1:
            raise InvalidBlock("all blocks must be under one {}", "gravity")
        rows = [
            [
                (*(side.p, side.alpha, side.restitution), *held, *tendon, *varying, float(each.is_one_sided))
                for side, held, tendon, varying in (sides[0 if each.is_one_sided else k] for k in range(2))
            ]
            for each in given
            for sides in [[*zip(each.block.sides, each._held, each._tendon, each._varying, strict=True)]]
        ]
        return cls(**dict(zip(_PARAMETERS, np.moveaxis(np.array(rows), 2, 0), strict=True)), gravity=given[0].gravity)

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return what they are made from, with units, by name."""
        units = {"p": "rad/s", "alpha": "rad", "damping": "1/s", "opening": "m", "stiffness": "1/m"}
        units |= {"yields": "m", "slack": "m", "restitution_slope": "s/rad"}
        return {name: (getattr(self, name), units.get(name, "1")) for name in _PARAMETERS}

    @property
    def stops(self) -> Floats:
        """Rotation at which each stands, for each side: zero."""
        return np.zeros((len(self), 2))

    @property
    def is_symmetric(self) -> bool:
        """Whether both sides of every block are equal, and it rocks to both."""
        even = all(np.array_equal(values[:, 0], values[:, 1]) for values, _ in self.parameters().values())
        return even and not np.any(self.one_sided)

    def __len__(self) -> int:
        return len(self.p)

    def __repr__(self) -> str:
        return f"<RestrainedBlocks: {len(self)}>"

    def __getitem__(self, index: int) -> RestrainedBlock:
        p, alpha, e, *others, one_sided = (getattr(self, name)[index].tolist() for name in _PARAMETERS)
        block = Block.from_parameters(p, alpha, e, gravity=self.gravity)
        plus, minus = ([values[j] for values in others] for j in range(2))
        held, tendon = (Held(*plus[:5]), Held(*minus[:5])), (Yielding(*plus[5:9]), Yielding(*minus[5:9]))
        varying = Varying(*plus[9:]), Varying(*minus[9:])
        text = "block with restraints" + ", rocking one way" * bool(one_sided[0])
        made, one_way = RestrainedBlock.__new__(RestrainedBlock), bool(one_sided[0])
        return _fill(made, block, held, tendon, varying, one_way, (text, text), None, 0.0)

    def __iter__(self) -> Iterator[RestrainedBlock]:
        return (self[index] for index in range(len(self)))

    def resized(self, factors: Floats) -> RestrainedBlocks:
        """Return blocks of the same shapes whose p is so many times theirs.

        Lengths are over the square of the factor then, and forces keep their ratio to the weight: of a tendon
        prestress, strength and stiffness times length, so that its strain at yield is the same, too.

        Parameters
        ----------
        factors : ndarray, shape (n,)
            Factors on p.

        Returns
        -------
        RestrainedBlocks
            In the same order.

        Examples
        --------
        >>> tied = RestrainedBlock(Block(width=0.4, height=2.0, mass=2000.0), Tendon(2e5)).alone()
        >>> larger = tied.resized(np.array([0.5]))
        >>> bool(np.all(larger.p == 0.5 * tied.p) and np.all(larger.sine == tied.sine))
        True
        """
        powers = {
            "p": 1,
            "damping": 1,
            "stiffness": 2,
            "opening": -2,
            "yields": -2,
            "slack": -2,
            "restitution_slope": -1,
        }
        scaled = {name: getattr(self, name) * factors[:, None] ** power for name, power in powers.items()}
        return replace(self, **scaled)

    def select(self, index: slice | Integers) -> RestrainedBlocks:
        """Return some of them: a slice, indices, or a mask."""
        return replace(self, **{name: getattr(self, name)[index] for name in _PARAMETERS})

    def speed_limits(self, share: float) -> Floats:
        """Return a share of p alpha on every side, rad/s, shape (n, 2)."""
        return share * self.p * self.alpha

    def kernel_records(self, model: Model, limits: Floats) -> state.Records:
        """Return every block as kernels take it (`kernels.state.BLOCK`), shape (n,)."""
        linear = checks.one_of(model, "model", InvalidOption, MODELS) == "linear"
        p, alpha, one_way = self.p, self.alpha, self.one_sided > 0.0
        sine, cosine = np.sin(alpha), np.cos(alpha)
        made = state.records(len(self), state.BLOCK)
        made["stiffness"] = p * p
        made["slenderness"], made["sine"], made["cosine"] = alpha, sine, cosine
        made["restitution"], made["limit"] = self.restitution, limits
        made["entered"] = np.where(one_way, 0, (1, 0))
        made["fallen"] = 0.5 * math.pi
        made["prestress"], made["spring"] = p * p * self.prestress, p * p * self.spring
        made["damping"] = self.damping
        made["least"], made["slope"] = self.restitution_least, self.restitution_slope
        made["seed"] = self.restitution_seed[:, 0]
        made["varying"] = (made["seed"] >= 0) | np.any(self.restitution_slope > 0.0, axis=1)
        at_zero = self.sine * sine + self.cosine * cosine  # of the moment, and its slope by -u
        slope = self.sine * cosine - self.cosine * sine
        # A moment that only a tendon without prestress makes is zero there, whatever rounding says.
        at_zero[np.abs(at_zero) <= 1e-14 * (np.abs(self.sine * sine) + np.abs(self.cosine * cosine))] = 0.0
        standing = at_zero + self.prestress
        if linear:
            made["threshold"], made["gain"], made["hold"] = alpha, p * p, standing
            made["added_weight"], made["added_push"] = slope, at_zero - alpha * slope
        else:
            made["threshold"], made["gain"], made["hold"] = sine / cosine, p * p * cosine, standing / cosine
            made["added_weight"], made["added_push"] = self.sine, self.cosine
        made["threshold"][:, 1] = np.where(one_way[:, 1], math.inf, made["threshold"][:, 1])
        made["yielding"] = np.any(self.stiffness > 0.0, axis=1)
        if np.any(made["yielding"]):
            self._add_tendons(made, linear)
        names = ("hold", "added_weight", "added_push", "prestress", "spring", "damping", "tendon")
        made["restrained"] = np.any([np.any(made[name] != 0.0, axis=1) for name in names], axis=0)
        return made

    def _add_tendons(self, made: state.Records, linear: bool) -> None:
        """Write the tendons that yield into records of the blocks without them, elastic as they are at first."""
        for name in ("weight", "push", "prestress"):
            made[f"base_{name}"] = made[name if name == "prestress" else f"added_{name}"]
        made["base_hold"] = made["hold"]
        made["tendon"] = self.p * self.p * self.stiffness
        made["opening"], made["yields"], made["slack"] = self.opening, self.yields[:, 0], self.slack[:, 0]
        stiff = self.stiffness * self.opening
        made["tendon_weight"] = -stiff if linear else -stiff * np.cos(self.alpha)
        made["tendon_push"] = stiff * self.alpha if linear else stiff * np.sin(self.alpha)
        at_rest = -self.stiffness * self.slack
        made["added_weight"] += made["tendon_weight"]
        made["added_push"] += made["tendon_push"]
        made["prestress"] += self.p * self.p * at_rest
        made["hold"] += at_rest if linear else at_rest / np.cos(self.alpha)


_PARAMETERS: Final = (
    "p", "alpha", "restitution", "sine", "cosine", "prestress", "spring", "damping", "opening", "stiffness", "yields",
    "slack", "restitution_least", "restitution_slope", "restitution_seed", "one_sided",
)  # fmt: skip


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


def _fill(
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


KINDS[RestrainedBlocks.kind] = RestrainedBlocks
