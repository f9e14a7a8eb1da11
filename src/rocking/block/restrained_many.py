"""Many blocks that restraints hold back, that lean, or that rock one way only, as arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.block.moments import Held, Yielding
from rocking.block.restitution import Varying
from rocking.block.restrained import RestrainedBlock, filled
from rocking.block.single import Block
from rocking.body import KINDS
from rocking.constants import MODELS, STANDARD_GRAVITY, Model
from rocking.errors import InvalidBlock, InvalidOption
from rocking.kernels import state


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
        Of a tendon that yields what `rocking.block.moments.Yielding` says, in m and 1/m; of none 0, 0, inf and 0.
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
        return cls(**dict(zip(_PARAMETERS, np.array(rows).transpose(2, 0, 1), strict=True)), gravity=given[0].gravity)

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
        return filled(made, block, held, tendon, varying, one_way, (text, text), None, 0.0)

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
        >>> import rocking
        >>> block = rocking.Block(width=0.4, height=2.0, mass=2000.0)
        >>> tied = rocking.RestrainedBlock(block, rocking.Tendon(2e5)).alone()
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

KINDS[RestrainedBlocks.kind] = RestrainedBlocks
