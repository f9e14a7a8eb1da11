"""Any number of blocks as a struct of arrays: all that a kernel needs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block.body import KINDS
from rocking.block.restrained import RestrainedBlock
from rocking.block.restraints import Terms
from rocking.block.sides import checked_gravity, checked_sides, no_body, rigid_bodies
from rocking.block.single import Block, one_block
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.core.tables import range_text
from rocking.errors import InvalidBlock
from rocking.kernels import state

_NAMES: Final = ("p", "alpha", "restitution")

#: Terms of restraints on each side, and their values without one; and whether a block rocks to side + only.
_TERMS: Final = {**Terms()._asdict(), "one_sided": 0.0}
_UNITS: Final = {
    "p": "rad/s", "alpha": "rad", "damping": "1/s", "opening": "m", "stiffness": "1/m", "yields": "m", "slack": "m",
    "restitution_slope": "s/rad",
}  # fmt: skip

#: Powers of a factor on p by which a block of the same shape differs; all else stays.
_POWERS: Final = {
    "damping": 1, "stiffness": 2, "opening": -2, "yields": -2, "slack": -2, "restitution_slope": -1,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Blocks:
    """Any number n of blocks, each array of shape (n, 2): side +, side -.

    Arguments broadcast against each other: a number, shape (n,) for symmetric blocks, or shape (n, 2).

    Parameters
    ----------
    p, alpha : array_like
        Frequency parameters, rad/s, and slendernesses, rad.
    restitution : array_like, optional
        Factors on the angular speed on leaving a side. By default those that conserve angular momentum: Housner's from
        `alpha` where both sides are equal, else of the one rigid body whose sides have these p and alpha.
    gravity : float
        Acceleration of gravity, m/s^2.
    **terms : array_like
        Terms of restraints by name, as `parameters` of restrained blocks returns them.

    Attributes
    ----------
    terms : dict of str to ndarray
        Terms of restraints of blocks that restraints hold, that lean, or that rock one way; of free ones none. Of a
        block that rocks to side + only, `one_sided` is 1, and all of its parameters are those of side +, twice.
    axes : dict of str to ndarray, or None
        Of a grid its axes p (rad/s), alpha (rad) and, where it was given, restitution; the last one varies fastest.

    Raises
    ------
    InvalidBlock
        If a value is out of its range, or no restitution follows from p and alpha; the message says which block.

    Examples
    --------
    >>> blocks = Blocks(p=[1.5, 3.0], alpha=0.2)
    >>> len(blocks), blocks[1].p, blocks.is_symmetric
    (2, 3.0, True)
    """

    p: Floats
    alpha: Floats
    restitution: Floats
    gravity: float
    terms: dict[str, Floats]
    axes: dict[str, Floats] | None

    def __init__(
        self,
        p: ArrayLike,
        alpha: ArrayLike,
        restitution: ArrayLike | None = None,
        *,
        gravity: float = STANDARD_GRAVITY,
        **terms: ArrayLike,
    ) -> None:
        given: dict[str, ArrayLike] = {"p": p, "alpha": alpha}
        if restitution is not None:
            given["restitution"] = restitution
        if terms:
            given |= {**_TERMS, **terms}
            if wrong := [*terms.keys() - _TERMS.keys()]:
                raise InvalidBlock(f"blocks have no {{}}; terms of restraints are {', '.join(_TERMS)}", wrong[0])
        try:
            columns = [_columns(checks.numbers(values, name, InvalidBlock)) for name, values in given.items()]
            arrays = dict(zip(given, np.broadcast_arrays(*columns), strict=True))
        except ValueError:
            raise InvalidBlock(
                "{}, {} and {} must be numbers, or arrays of shape (n,) or (n, 2) with one n",
                "p", "alpha", "restitution",
            ) from None  # fmt: skip
        g = checked_gravity(gravity)
        for name in _NAMES if restitution is not None else _NAMES[:2]:
            checked_sides(arrays[name], name)
        if restitution is None:
            arrays["restitution"] = _conserved(arrays["p"], arrays["alpha"])
        self._fill(g, {name: np.array(values) for name, values in arrays.items()})

    def _fill(self, gravity: float, arrays: Mapping[str, Floats], axes: dict[str, Floats] | None = None) -> Blocks:
        """Set all attributes, sound arrays of shape (n, 2) that nobody can change then."""
        held = {name: np.ascontiguousarray(values) for name, values in arrays.items()}
        for values in held.values():
            values.flags.writeable = False
        self.__dict__.update({name: held.pop(name) for name in _NAMES}, gravity=gravity, terms=held, axes=axes)
        return self

    @classmethod
    def grid(
        cls,
        *,
        alpha: ArrayLike,
        p: ArrayLike | None = None,
        size: ArrayLike | None = None,
        restitution: ArrayLike | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> Blocks:
        """Symmetric blocks for every combination of p, alpha and restitution, the last one varying fastest.

        Parameters
        ----------
        alpha : float or sequence of float
            Slendernesses, rad.
        p : float or sequence of float
            Frequency parameters, rad/s; or give `size`.
        size : float or sequence of float
            Half diagonals R of rectangular blocks, m: p = sqrt(3 g/(4 R)); or give `p`.
        restitution : float or sequence of float, optional
            Restitutions; Housner's from each alpha by default.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Blocks
            With its `axes`.
        """
        given = {"p": rates_of(p, size, gravity), "alpha": alpha}
        if restitution is not None:
            given["restitution"] = restitution
        axes = {name: np.atleast_1d(checks.numbers(axis, name, InvalidBlock)) for name, axis in given.items()}
        if any(axis.ndim != 1 or axis.size == 0 for axis in axes.values()):
            raise InvalidBlock("each parameter of a grid must be a number or a sequence of at least one number")
        checks.grid_size({name: axis.size for name, axis in axes.items()}, InvalidBlock)
        blocks = cls(*(column.ravel() for column in np.meshgrid(*axes.values(), indexing="ij")), gravity=gravity)
        return blocks._fill(blocks.gravity, blocks._arrays(), axes)

    @classmethod
    def of(cls, blocks: Blocks | Block | RestrainedBlock | Iterable[Block | RestrainedBlock]) -> Blocks:
        """Gather single blocks, all under the same gravity; what is gathered already stays as it is.

        Arrays decide all motion, but they do not contain sizes: a block that is taken out again has those of a
        rectangle, as by `Block.from_parameters`, and so have its forces on the ground.

        Parameters
        ----------
        blocks : Block, RestrainedBlock, iterable of these, or Blocks
            The blocks.

        Returns
        -------
        Blocks
            In their order.

        Raises
        ------
        InvalidBlock
            If there is none, one is no block, or their gravities differ.
        """
        if isinstance(blocks, Blocks):
            return blocks
        several = not isinstance(blocks, (Block, RestrainedBlock, str)) and isinstance(blocks, Iterable)
        gathered: list[Any] = [*cast("Iterable[Block]", blocks)] if several else [blocks]
        for each in gathered:
            if not isinstance(each, (Block, RestrainedBlock)):
                one_block(each)
        gravities = {each.gravity for each in gathered}
        if len(gravities) != 1:
            raise InvalidBlock("Blocks.of needs at least one block, and all of them under the same {}", "gravity")
        rows = [each._rows() for each in gathered]
        if max(len(sides[0]) for sides in rows) > len(_NAMES):
            rows = [[(*side, *[*_TERMS.values()][len(side) - len(_NAMES) :]) for side in sides] for sides in rows]
        table = np.array(rows).transpose(2, 0, 1)
        names = (*_NAMES, *_TERMS)[: len(table)]
        return cls.__new__(cls)._fill(gravities.pop(), dict(zip(names, table, strict=True)))

    @property
    def kind(self) -> str:
        """Name of the kind of bodies."""
        return "restrained-blocks" if self.terms else "blocks"

    def _arrays(self) -> dict[str, Floats]:
        return {"p": self.p, "alpha": self.alpha, "restitution": self.restitution, **self.terms}

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return p, alpha and restitution with their units, by name; of restrained blocks also the terms."""
        return {name: (values, _UNITS.get(name, "1")) for name, values in self._arrays().items()}

    def speed_limits(self, share: float) -> Floats:
        """Return a share of p alpha on every side, rad/s, shape (n, 2)."""
        return share * self.p * self.alpha

    def kernel_records(self, model: Model, limits: Floats) -> state.Records:
        """Return every block as kernels take it (`kernels.state.BLOCK`), shape (n,)."""
        p, alpha = self.p, self.alpha
        made = state.records(len(self), state.BLOCK)
        stiffness, cosine = p * p, np.cos(alpha)
        made["stiffness"], made["slenderness"] = stiffness, alpha
        made["sine"], made["cosine"] = np.sin(alpha), cosine
        made["threshold"] = alpha if model == "linear" else np.tan(alpha)
        made["threshold_slope"] = stiffness if model == "linear" else stiffness * cosine
        made["restitution"] = self.restitution
        made["limit"] = limits
        made["next_side"] = (1, 0)
        made["overturn_angle"] = 0.5 * math.pi
        if self.terms:
            self._add_terms(made, model)
        return made

    def _add_terms(self, made: state.Records, model: Model) -> None:
        """Add what restraints do to records of free blocks."""
        term, p, sine, cosine = self.terms, self.p, made["sine"], made["cosine"]
        one_way = term["one_sided"] > 0.0
        made["next_side"][one_way] = 0
        made["threshold"][:, 1] = np.where(one_way[:, 1], math.inf, made["threshold"][:, 1])
        made["min_restitution"], made["restitution_slope"] = term["restitution_least"], term["restitution_slope"]
        made["seed"] = term["restitution_seed"][:, 0]
        made["variable_restitution"] = (made["seed"] >= 0) | np.any(made["restitution_slope"] > 0.0, axis=1)
        made["prestress"], made["spring"] = p * p * term["prestress"], p * p * term["spring"]
        made["damping"] = term["damping"]
        at_zero = term["sine"] * sine + term["cosine"] * cosine  # of the moment, and its slope by -u
        slope = term["sine"] * cosine - term["cosine"] * sine
        # A moment that only a tendon without prestress makes is zero there, whatever rounding says.
        at_zero[np.abs(at_zero) <= 1e-14 * (np.abs(term["sine"] * sine) + np.abs(term["cosine"] * cosine))] = 0.0
        across = 1.0 if model == "linear" else cosine  # of the gain over p^2
        made["restraint_threshold"] = (at_zero + term["prestress"]) / across
        if model == "linear":
            made["added_weight"], made["added_push"] = slope, at_zero - self.alpha * slope
        else:
            made["added_weight"], made["added_push"] = term["sine"], term["cosine"]
        made["yielding"] = np.any(term["stiffness"] > 0.0, axis=1)
        if np.any(made["yielding"]):  # elastic as such a tendon is at first
            for name in ("added_weight", "added_push", "prestress", "restraint_threshold"):
                made[f"base_{name.removeprefix('added_')}"] = made[name]
            made["tendon"] = p * p * term["stiffness"]
            made["lever_arm"] = term["opening"]
            made["yields"], made["slack"] = term["yields"][:, 0], term["slack"][:, 0]
            stiff, at_rest = term["stiffness"] * term["opening"], -term["stiffness"] * term["slack"]
            made["tendon_weight"] = -stiff * (1.0 if model == "linear" else cosine)
            made["tendon_push"] = stiff * (self.alpha if model == "linear" else sine)
            made["added_weight"] += made["tendon_weight"]
            made["added_push"] += made["tendon_push"]
            made["prestress"] += p * p * at_rest
            made["restraint_threshold"] += at_rest / across
        names = ("restraint_threshold", "added_weight", "added_push", "prestress", "spring", "damping", "tendon")
        made["restrained"] = np.any([np.any(made[name] != 0.0, axis=1) for name in names], axis=0)

    @property
    def stops(self) -> Floats:
        """Rotation at which each stands, for each side: zero."""
        return np.zeros((len(self), 2))

    @property
    def is_symmetric(self) -> bool:
        """Whether both sides of every block are equal, and it rocks to both."""
        even = all(np.array_equal(values[:, 0], values[:, 1]) for values in self._arrays().values())
        return even and not np.any(self.terms.get("one_sided", 0.0))

    def __repr__(self) -> str:
        if not len(self):
            return "<Blocks: none>"
        p, alpha, e = (range_text(values) for values in (self.p, self.alpha, self.restitution))
        held = ", restrained" if self.terms else ""
        return f"<Blocks: {len(self)}; p {p} rad/s, alpha {alpha} rad, restitution {e}{held}>"

    def __len__(self) -> int:
        return len(self.p)

    def __getitem__(self, index: int) -> Block | RestrainedBlock:
        if isinstance(index, (slice, tuple, list, np.ndarray)):
            raise InvalidBlock("blocks[index] takes one whole number; use blocks.select for slices, indices and masks")
        p, alpha, e = (tuple(array[index]) for array in (self.p, self.alpha, self.restitution))
        block = Block.from_parameters(p, alpha, e, gravity=self.gravity)
        terms, one_way = [Terms(), Terms()], False
        if self.terms:
            terms = [Terms(*(float(self.terms[name][index, side]) for name in Terms._fields)) for side in range(2)]
            one_way = bool(self.terms["one_sided"][index, 0])
        if not one_way and terms == [Terms(), Terms()]:
            return block
        text = "block with restraints" + ", rocking one way" * one_way
        made = RestrainedBlock.__new__(RestrainedBlock)
        made.__dict__.update(block=block, _terms=tuple(terms), is_one_sided=one_way, restraints=None, lean=0.0)
        made.__dict__.update(description=text)
        return made

    def __iter__(self) -> Iterator[Block | RestrainedBlock]:
        return (self[index] for index in range(len(self)))

    def select(self, index: slice | NDArray[np.int64] | NDArray[np.bool_]) -> Blocks:
        """Return some of the blocks: a slice, indices, or a mask."""
        given = index if isinstance(index, slice) else np.asarray(index)
        if not isinstance(given, slice) and not given.size:
            given = given.astype(np.int64)
        try:
            rows = np.arange(len(self))[given]
        except IndexError:
            rows = np.array(0)
        if rows.ndim != 1:
            raise InvalidBlock(
                f"select takes a slice, a flat array of indices below {len(self)}, or a mask of {len(self)} truth "
                f"values, not {checks.shown(index)}; for one block alone blocks[0]"
            )
        chosen = {name: values[rows] for name, values in self._arrays().items()}
        return Blocks.__new__(Blocks)._fill(self.gravity, chosen)

    def resized(self, factors: Floats) -> Blocks:
        """Return blocks of the same shapes whose p is so many times theirs.

        Lengths are then divided by the square of the factor, and forces of restraints keep their ratio to the weight:
        of a tendon prestress, strength and stiffness times length, so that its strain at yield is the same, too.
        """
        by = factors[:, None]
        terms = {name: values * by ** _POWERS.get(name, 0) for name, values in self.terms.items()}
        return Blocks(self.p * by, self.alpha, self.restitution, gravity=self.gravity, **terms)


def rates_of(p: ArrayLike | None, size: ArrayLike | None, gravity: float) -> ArrayLike:
    """Return the frequency parameters, rad/s, that are given by themselves, or by half diagonals, m, of rectangles."""
    if p is not None and size is None:
        return p
    if size is not None and p is None:
        g = checks.positive(gravity, "gravity", InvalidBlock, "m/s^2")
        return np.sqrt(0.75 * g / checks.positive_numbers(size, "size", InvalidBlock))
    which = "one of" if p is None else "not both of"
    raise InvalidBlock(f"give {which} {{}} (rad/s) and {{}} (half diagonals, m)", "p", "size")


def _columns(array: Floats) -> Floats:
    if array.ndim == 2 and array.shape[1] == 2:
        return array
    if array.ndim > 1:
        raise ValueError
    return np.repeat(np.atleast_1d(array)[:, None], 2, axis=1)


def _conserved(p: Floats, alpha: Floats) -> Floats:
    """Restitutions that conserve angular momentum, of the rigid bodies whose sides have these p and alpha."""
    kept: Floats = 1.0 - 1.5 * np.sin(alpha) ** 2
    sided = np.flatnonzero((p[:, 0] != p[:, 1]) | (alpha[:, 0] != alpha[:, 1]))
    kept[sided], _ = rigid_bodies(p[sided], alpha[sided])
    if (unknown := np.isnan(kept).any(axis=1)).any():
        first = int(np.argmax(unknown))
        raise InvalidBlock(f"{no_body(p[first], alpha[first])} (block {first})", "restitution")
    stocky = np.flatnonzero(~(kept > 0.0).all(axis=1))
    if len(stocky):
        raise InvalidBlock(
            f"conserving angular momentum gives block {stocky[0]} a restitution of {kept[stocky[0]].min():.3g}: it is "
            "too stocky to rock that way; give {} a value or a pair in (0, 1]",
            "restitution",
        )
    return checked_sides(kept, "restitution")


KINDS["blocks"] = KINDS["restrained-blocks"] = Blocks
