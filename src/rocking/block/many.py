"""Many blocks as a struct of arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.block.limits import checked_gravity, checked_sides
from rocking.block.rigid_body import refusal, rigid_bodies
from rocking.block.single import Block, one_block
from rocking.body import KINDS
from rocking.constants import STANDARD_GRAVITY, Model
from rocking.errors import InvalidBlock
from rocking.kernels import state
from rocking.tables import range_text


@dataclass(frozen=True, eq=False)
class Blocks:
    """Any number n of blocks, each array of shape (n, 2): side +, side -.

    What is given broadcasts against each other: a number, shape (n,) for symmetric blocks, or shape (n, 2).

    Parameters
    ----------
    p : array_like
        Frequency parameters, rad/s.
    alpha : array_like
        Slendernesses, rad.
    restitution : array_like, optional
        Factors on the angular speed on leaving a side. By default those that conserve angular momentum: Housner's from
        `alpha` where both sides are equal, else of the one rigid body whose sides have these p and alpha.
    gravity : float
        Acceleration of gravity, m/s^2.

    Attributes
    ----------
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

    kind: ClassVar[str] = "blocks"

    p: Floats
    alpha: Floats
    restitution: Floats
    gravity: float = STANDARD_GRAVITY
    axes: dict[str, Floats] | None = None

    def __init__(
        self,
        p: ArrayLike,
        alpha: ArrayLike,
        restitution: ArrayLike | None = None,
        *,
        gravity: float = STANDARD_GRAVITY,
    ) -> None:
        given: dict[str, ArrayLike] = {"p": p, "alpha": alpha}
        if restitution is not None:
            given["restitution"] = restitution
        try:
            columns = [_columns(checks.numbers(values, name, InvalidBlock)) for name, values in given.items()]
            arrays = dict(zip(given, np.broadcast_arrays(*columns), strict=True))
        except ValueError:
            raise InvalidBlock(
                "{}, {} and {} must be numbers, or arrays of shape (n,) or (n, 2) with one n",
                "p", "alpha", "restitution",
            ) from None  # fmt: skip
        g = checked_gravity(gravity)
        for name, values in arrays.items():
            checked_sides(values, name)
        if restitution is None:
            arrays["restitution"] = _conserved(arrays["p"], arrays["alpha"])
        _filled(self, g, **{name: np.array(values) for name, values in arrays.items()})

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

        Raises
        ------
        InvalidBlock
            If a value is out of its range, an axis is empty, or not one of `p` and `size` is given.

        Examples
        --------
        >>> blocks = Blocks.grid(p=[1.0, 2.0, 3.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> len(blocks), [*blocks.axes]
        (6, ['p', 'alpha', 'restitution'])
        """
        given = {"p": rates_of(p, size, gravity), "alpha": alpha}
        if restitution is not None:
            given["restitution"] = restitution
        axes = {name: np.atleast_1d(checks.numbers(axis, name, InvalidBlock)) for name, axis in given.items()}
        if any(axis.ndim != 1 or axis.size == 0 for axis in axes.values()):
            raise InvalidBlock("each parameter of a grid must be a number or a sequence of at least one number")
        checks.grid_size({name: axis.size for name, axis in axes.items()}, InvalidBlock)
        blocks = cls(*(column.ravel() for column in np.meshgrid(*axes.values(), indexing="ij")), gravity=gravity)
        object.__setattr__(blocks, "axes", axes)
        return blocks

    @classmethod
    def of(cls, blocks: Blocks | Block | Iterable[Block]) -> Blocks:
        """Gather single blocks, all under the same gravity; what is gathered already stays as it is.

        Many blocks know p, alpha and restitution, which decide all motion, but not their sizes: a block that is taken
        out again has those of a rectangle, as by `Block.from_parameters`, and so have its forces on the ground.

        Parameters
        ----------
        blocks : Block, iterable of Block, or Blocks
            The blocks.

        Returns
        -------
        Blocks
            In their order.

        Raises
        ------
        InvalidBlock
            If there is none, one is no block, or their gravities differ.

        Examples
        --------
        >>> Blocks.of([Block(width=0.4, height=2.0), Block(width=0.2, height=1.0)]).p.shape
        (2, 2)
        """
        if isinstance(blocks, Blocks):
            return blocks
        several = not isinstance(blocks, (Block, str)) and isinstance(blocks, Iterable)
        gathered = [one_block(block) for block in cast("Iterable[Block]", blocks if several else [blocks])]
        gravities = {block.gravity for block in gathered}
        if len(gravities) != 1:
            raise InvalidBlock("Blocks.of needs at least one block, and all of them under the same gravity")
        table = np.array([[(side.p, side.alpha, side.restitution) for side in block.sides] for block in gathered])
        p, alpha, restitution = table.transpose(2, 0, 1)
        return _filled(cls.__new__(cls), gravities.pop(), p=p, alpha=alpha, restitution=restitution)

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return p, alpha and restitution with their units, by name."""
        return {"p": (self.p, "rad/s"), "alpha": (self.alpha, "rad"), "restitution": (self.restitution, "1")}

    def speed_limits(self, share: float) -> Floats:
        """Return a share of p alpha on every side, rad/s, shape (n, 2)."""
        return share * self.p * self.alpha

    def kernel_records(self, model: Model, limits: Floats) -> state.Records:
        """Return every block as kernels take it (`kernels.state.BLOCK`), shape (n,)."""
        p, alpha = self.p, self.alpha
        made = state.records(len(self), state.BLOCK)
        made["stiffness"] = p * p
        made["slenderness"] = alpha
        made["sine"], made["cosine"] = np.sin(alpha), np.cos(alpha)
        made["threshold"] = alpha if model == "linear" else np.tan(alpha)
        made["gain"] = p * p if model == "linear" else p * p * np.cos(alpha)
        made["restitution"] = self.restitution
        made["limit"] = limits
        made["entered"] = (1, 0)
        made["fallen"] = 0.5 * math.pi
        return made

    @property
    def stops(self) -> Floats:
        """Rotation at which each stands, for each side: zero."""
        return np.zeros((len(self), 2))

    @property
    def is_symmetric(self) -> bool:
        """Whether both sides of every block are equal."""
        return all(np.array_equal(values[:, 0], values[:, 1]) for values, _ in self.parameters().values())

    def __repr__(self) -> str:
        if not len(self):
            return "<Blocks: none>"
        ranges = [
            f"{name} {range_text(values)}{'' if unit == '1' else f' {unit}'}"
            for name, (values, unit) in self.parameters().items()
        ]
        return f"<Blocks: {len(self)}; {', '.join(ranges)}>"

    def __len__(self) -> int:
        return len(self.p)

    def __getitem__(self, index: int) -> Block:
        if isinstance(index, (slice, tuple, list, np.ndarray)):
            raise InvalidBlock("blocks[index] takes one whole number; use blocks.select for slices, indices and masks")
        p, alpha, e = (array[index] for array in (self.p, self.alpha, self.restitution))
        return Block.from_parameters(tuple(p), tuple(alpha), tuple(e), gravity=self.gravity)

    def __iter__(self) -> Iterator[Block]:
        return (self[index] for index in range(len(self)))

    def select(self, index: slice | NDArray[np.int64] | NDArray[np.bool_]) -> Blocks:
        """Return some of the blocks: a slice, indices, or a mask."""
        if not isinstance(index, slice):
            index = self._indices(index)
        chosen = {name: values[index] for name, (values, _) in self.parameters().items()}
        return _filled(Blocks.__new__(Blocks), self.gravity, **chosen)

    def resized(self, factors: Floats) -> Blocks:
        """Return blocks of the same shapes whose p is so many times theirs.

        Parameters
        ----------
        factors : ndarray, shape (n,)
            Factors on p.

        Returns
        -------
        Blocks
            In the same order.

        Examples
        --------
        >>> Blocks(p=[1.0, 2.0], alpha=0.2).resized(np.array([2.0, 0.5])).p[:, 0].tolist()
        [2.0, 1.0]
        """
        return Blocks(self.p * factors[:, None], self.alpha, self.restitution, gravity=self.gravity)

    def _indices(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> NDArray[np.int64]:
        """Positions of the blocks of a flat array of indices, or of a mask."""
        given = np.asarray(index)
        if given.ndim == 1 and given.dtype == np.bool_ and len(given) == len(self):
            return np.flatnonzero(given)
        usable = given.ndim == 1 and (given.dtype.kind in "iu" or not given.size)
        chosen = given.astype(np.int64) if usable else np.array([len(self)])
        if not np.all((chosen >= -len(self)) & (chosen < len(self))):
            raise InvalidBlock(
                f"select takes a slice, a flat array of indices below {len(self)}, or a mask of {len(self)} truth "
                f"values, not {checks.shown(index)}; for one block alone blocks[0]"
            )
        return chosen


def _filled(blocks: Blocks, gravity: float, **sides: Floats) -> Blocks:
    """Fill in what blocks are, sound values of shape (n, 2) that nobody can change then, and return them."""
    object.__setattr__(blocks, "gravity", gravity)
    for name, values in sides.items():
        held = np.ascontiguousarray(values)
        held.flags.writeable = False
        object.__setattr__(blocks, name, held)
    return blocks


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
    found = rigid_bodies(p[sided], alpha[sided])
    if not found.known.all():
        first = int(np.argmin(found.known))
        raise InvalidBlock(f"{refusal(found, p[sided], alpha[sided], first)} (block {sided[first]})", "restitution")
    kept[sided] = found.restitution
    stocky = np.flatnonzero(~(kept > 0.0).all(axis=1))
    if len(stocky):
        raise InvalidBlock(
            f"conserving angular momentum gives block {stocky[0]} a restitution of {kept[stocky[0]].min():.3g}: it is "
            "too stocky to rock that way; give {} a value or a pair in (0, 1]",
            "restitution",
        )
    return checked_sides(kept, "restitution")


KINDS[Blocks.kind] = Blocks
