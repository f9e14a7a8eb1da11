"""Blocks as a struct of arrays, the input of kernels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block.body import BODIES_TYPES
from rocking.block.restrained import RestrainedBlock
from rocking.block.restraints import RestraintTerms
from rocking.block.sides import check_gravity, check_sides, compute_rigid_bodies, describe_missing_body
from rocking.block.single import Block, require_block
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.core.tables import format_cell, format_range
from rocking.errors import BlockError, escape_braces
from rocking.kernels import state

_PARAMETER_NAMES: Final = ("p", "alpha", "restitution")

#: Terms of restraints on each side with their default values, and `one_sided`.
_TERM_DEFAULTS: Final = {**RestraintTerms()._asdict(), "one_sided": 0.0}
_UNITS: Final = {
    "p": "rad/s", "alpha": "rad", "damping": "1/s", "lever_arm": "m", "tendon_stiffness": "1/m",
    "yield_elongation": "m", "slack_elongation": "m", "restitution_slope": "s/rad",
}  # fmt: skip

#: Exponents of the factor on p in the terms of a resized block; other terms do not change.
_SIZE_EXPONENTS: Final = {
    "damping": 1, "tendon_stiffness": 2, "lever_arm": -2, "yield_elongation": -2, "slack_elongation": -2,
    "restitution_slope": -1,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Blocks:
    """Any number n of blocks, as arrays of shape (n, 2): side +, side -.

    Arguments broadcast against each other: a number, shape (n,) for symmetric blocks, or shape (n, 2).

    Parameters
    ----------
    p, alpha : array_like
        Frequency parameters, rad/s, and slendernesses, rad.
    restitution : array_like, optional
        Factors on the angular speed on leaving a side. The default conserves angular momentum: Housner's value from
        `alpha` if both sides are equal, otherwise the value of the only rigid body with these p and alpha.
    gravity : float
        Acceleration of gravity, m/s^2.
    **terms : array_like
        RestraintTerms of restraints by name, as returned by `parameters` of restrained blocks.

    Attributes
    ----------
    terms : dict of str to ndarray
        RestraintTerms of blocks with restraints, a lean or a single side; empty for free blocks. For a one-sided block
        `one_sided` is 1, and both columns of all parameters contain the values of side +.
    axes : dict of str to ndarray, or None
        Axes of a grid: p (rad/s), alpha (rad) and restitution if it was an argument. The last one varies fastest.
    labels : dict of str to ndarray
        Names and further facts of labelled blocks (``Block.with_labels``), shape (n,); empty otherwise.

    Raises
    ------
    BlockError
        If a value is out of range, or p and alpha determine no restitution. The message names the block.

    See Also
    --------
    Block : Single free block.
    RestrainedBlock : Single restrained block.

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
    radii: Floats | None  # m, of the gathered single blocks, NaN for frames; None: of the only body with p and alpha
    labels: Mapping[str, NDArray[Any]]

    def __init__(
        self,
        p: ArrayLike,
        alpha: ArrayLike,
        restitution: ArrayLike | None = None,
        *,
        gravity: float = STANDARD_GRAVITY,
        **terms: ArrayLike,
    ) -> None:
        arguments: dict[str, ArrayLike] = {"p": p, "alpha": alpha}
        if restitution is not None:
            arguments["restitution"] = restitution
        if terms:
            arguments |= {**_TERM_DEFAULTS, **terms}
            if unknown := [*terms.keys() - _TERM_DEFAULTS.keys()]:
                message = f"blocks have no parameter {{}}; the terms of restraints are {', '.join(_TERM_DEFAULTS)}"
                raise BlockError(message, unknown[0])
        try:
            columns = [_expand_sides(checks.numbers(values, name, BlockError)) for name, values in arguments.items()]
            arrays = dict(zip(arguments, np.broadcast_arrays(*columns), strict=True))
        except ValueError:
            message = "{}, {} and {} must be numbers, or arrays of shape (n,) or (n, 2) with the same n"
            raise BlockError(message, *_PARAMETER_NAMES) from None
        g = check_gravity(gravity)
        for name in _PARAMETER_NAMES if restitution is not None else _PARAMETER_NAMES[:2]:
            check_sides(arrays[name], name)
        if restitution is None:
            arrays["restitution"] = _compute_restitutions(arrays["p"], arrays["alpha"])
        self._fill(g, {name: np.array(values) for name, values in arrays.items()})

    def _fill(
        self,
        gravity: float,
        arrays: Mapping[str, Floats],
        axes: dict[str, Floats] | None = None,
        radii: Floats | None = None,
        labels: Mapping[str, NDArray[Any]] | None = None,
    ) -> Blocks:
        """Set all attributes from valid arrays of shape (n, 2), which become read-only."""
        columns = {name: np.ascontiguousarray(values) for name, values in arrays.items()}
        for values in columns.values():
            values.flags.writeable = False
        self.__dict__.update({name: columns.pop(name) for name in _PARAMETER_NAMES})
        self.__dict__.update(gravity=gravity, terms=columns, axes=axes, radii=radii, labels=labels or {})
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
        """Create symmetric blocks for every combination of p, alpha and restitution; the last one varies fastest.

        Parameters
        ----------
        alpha : float or sequence of float
            Slendernesses, rad.
        p : float or sequence of float
            Frequency parameters, rad/s. Alternative to `size`.
        size : float or sequence of float
            Half diagonals R of rectangular blocks, m: p = sqrt(3 g/(4 R)). Alternative to `p`.
        restitution : float or sequence of float, optional
            Restitutions; by default Housner's value for each alpha.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Blocks
            Blocks with `axes`.
        """
        arguments = {"p": resolve_p(p, size, gravity), "alpha": alpha}
        if restitution is not None:
            arguments["restitution"] = restitution
        axes = {name: np.atleast_1d(checks.numbers(axis, name, BlockError)) for name, axis in arguments.items()}
        if any(axis.ndim != 1 or axis.size == 0 for axis in axes.values()):
            raise BlockError("each parameter of a grid must be a number or a sequence of at least one number")
        checks.check_grid_size({name: axis.size for name, axis in axes.items()}, BlockError)
        blocks = cls(*(column.ravel() for column in np.meshgrid(*axes.values(), indexing="ij")), gravity=gravity)
        return blocks._fill(blocks.gravity, blocks._collect_arrays(), axes)

    @classmethod
    def sample(
        cls, count: int, create: Callable[..., Block | RestrainedBlock] = Block, *, seed: int = 0, **parameters: Any
    ) -> Blocks:
        """Sample blocks with uncertain parameters.

        Every distribution is divided into `count` intervals of equal probability, and each interval contains one value
        (Latin hypercube). Different parameters are independent.

        Parameters
        ----------
        count : int
            Number n of blocks.
        create : callable
            Constructor of a block: `Block` for sizes, `Block.from_parameters`, `Block.from_pivots`, or a function that
            returns a restrained block.
        seed : int
            Seed of the random numbers. The same seed returns the same blocks.
        **parameters : Distribution, ndarray or object
            Arguments of `create`: a distribution (`rocking.normal`, `rocking.lognormal`, `rocking.uniform`, or any
            frozen distribution of `scipy.stats`), an array of n values, for example of correlated samples, or the same
            value for all blocks.

        Returns
        -------
        Blocks
            n blocks of equal weight.

        Raises
        ------
        BlockError
            If no parameter varies, an array does not have n values, or a sampled block is not possible.

        See Also
        --------
        rocking.Fragility.survival : Mean probability of survival of sampled blocks.

        Notes
        -----
        The variance of a mean over the samples is at most n/(n - 1) times that of independent samples
        :cite:p:`owen1997`.

        Examples
        --------
        >>> import rocking
        >>> blocks = Blocks.sample(100, width=rocking.normal(0.30, 0.02), height=1.2)
        >>> len(blocks), f"{blocks.alpha[:, 0].mean():.3f}", f"{blocks.alpha[:, 0].std():.3f}"
        (100, '0.245', '0.016')
        """
        number = checks.integer(count, "count", BlockError, 1)
        generator, samples = np.random.default_rng(checks.integer(seed, "seed", BlockError, 0)), dict[str, Any]()
        for name, value in parameters.items():
            if hasattr(value, "ppf"):
                strata = (generator.permutation(number) + generator.random(number)) / number
                samples[name] = value.ppf(np.clip(strata, 2.0**-54, 1.0 - 2.0**-53)).tolist()
            elif isinstance(value, np.ndarray) and value.ndim:
                samples[name] = value.tolist()
                if len(value) != number:
                    message = f"{{}} must be an array of {number} values, one for each block; got {len(value)}"
                    raise BlockError(message, name, value=value)
        if not samples:
            message = "no parameter is uncertain: give a distribution, for example width=rocking.normal(0.3, 0.02)"
            raise BlockError(message)
        bodies = []
        for k in range(number):
            values = {name: column[k] for name, column in samples.items()}
            try:
                bodies.append(create(**parameters | values))
            except BlockError as error:
                text = ", ".join(f"{name} = {value:.6g}" if isinstance(value, float) else f"{name} = {value}"
                                 for name, value in values.items())  # fmt: skip
                hint = "truncate the distribution, for example with the argument low of rocking.normal"
                raise BlockError(escape_braces(f"sample {k} ({text}) is not possible: {error}; {hint}")) from error
        return cls.from_bodies(bodies)

    @classmethod
    def from_bodies(cls, blocks: Blocks | Block | RestrainedBlock | Iterable[Block | RestrainedBlock]) -> Blocks:
        """Gather single blocks with the same gravity. `Blocks` are returned unchanged.

        The arrays determine the motion, but do not contain sizes. Therefore an extracted block has the sizes and
        ground forces of a rectangle, as from `Block.from_parameters`.

        Parameters
        ----------
        blocks : Block, RestrainedBlock, iterable of these, or Blocks
            The blocks.

        Returns
        -------
        Blocks
            Blocks in the same order.

        Raises
        ------
        BlockError
            If there are no blocks, an item is not a block, or gravities differ.
        """
        if isinstance(blocks, Blocks):
            return blocks
        is_iterable = not isinstance(blocks, (Block, RestrainedBlock, str)) and isinstance(blocks, Iterable)
        bodies: list[Any] = [*cast("Iterable[Block]", blocks)] if is_iterable else [blocks]
        for body in bodies:
            if not isinstance(body, (Block, RestrainedBlock)):
                require_block(body)
        gravities = {body.gravity for body in bodies}
        if len(gravities) != 1:
            message = "Blocks.from_bodies requires at least one block, and the same {} for all of them"
            raise BlockError(message, "gravity")
        rows = [body._create_rows() for body in bodies]
        if max(len(sides[0]) for sides in rows) > len(_PARAMETER_NAMES):
            defaults, count = [*_TERM_DEFAULTS.values()], len(_PARAMETER_NAMES)
            rows = [[(*side, *defaults[len(side) - count :]) for side in sides] for sides in rows]
        table = np.array(rows).transpose(2, 0, 1)
        names = (*_PARAMETER_NAMES, *_TERM_DEFAULTS)[: len(table)]
        radii = np.array([body._list_radii() for body in bodies])
        labels = {
            name: _collect_label(bodies, name) for name in dict.fromkeys(n for body in bodies for n in body.labels)
        }
        return cls.__new__(cls)._fill(gravities.pop(), dict(zip(names, table, strict=True)), radii=radii, labels=labels)

    @property
    def kind(self) -> str:
        """Name of the kind of bodies."""
        return "restrained-blocks" if self.terms else "blocks"

    def _collect_arrays(self) -> dict[str, Floats]:
        return {"p": self.p, "alpha": self.alpha, "restitution": self.restitution, **self.terms}

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return p, alpha, restitution and the terms of restrained blocks, with units, by name."""
        return {name: (values, _UNITS.get(name, "1")) for name, values in self._collect_arrays().items()}

    def speed_thresholds(self, share: float) -> Floats:
        """Return a share of p alpha on every side, rad/s, shape (n, 2)."""
        return share * self.p * self.alpha

    def create_kernel_structs(self, model: Model, thresholds: Floats) -> state.Structs:
        """Return structs for kernels (`kernels.state.BLOCK_DTYPE`), shape (n,)."""
        p, alpha = self.p, self.alpha
        structs = state.create_structs(len(self), state.BLOCK_DTYPE)
        stiffness, cosine = p * p, np.cos(alpha)
        structs["stiffness"], structs["slenderness"] = stiffness, alpha
        structs["sine"], structs["cosine"] = np.sin(alpha), cosine
        structs["threshold"] = alpha if model == "linear" else np.tan(alpha)
        structs["restoring_gain"] = stiffness if model == "linear" else stiffness * cosine
        structs["restitution"] = self.restitution
        structs["rest_limit"] = thresholds
        structs["next_side"] = (1, 0)
        structs["overturn_angle"] = 0.5 * math.pi
        if self.terms:
            self._add_terms(structs, model)
        return structs

    def _add_terms(self, structs: state.Structs, model: Model) -> None:
        """Add terms of restraints to structs."""
        terms, p, sine, cosine = self.terms, self.p, structs["sine"], structs["cosine"]
        is_one_sided = terms["one_sided"] > 0.0
        structs["next_side"][is_one_sided] = 0
        structs["threshold"][:, 1] = np.where(is_one_sided[:, 1], math.inf, structs["threshold"][:, 1])
        structs["min_restitution"] = terms["min_restitution"]
        structs["restitution_slope"] = terms["restitution_slope"]
        structs["seed"] = terms["restitution_seed"][:, 0]
        structs["variable_restitution"] = (structs["seed"] >= 0) | np.any(structs["restitution_slope"] > 0.0, axis=1)
        structs["prestress"], structs["spring"] = p * p * terms["prestress"], p * p * terms["spring"]
        structs["damping"] = terms["damping"]
        sine_term, cosine_term = terms["sine_coefficient"], terms["cosine_coefficient"]
        moment = sine_term * sine + cosine_term * cosine  # at u = 0
        slope = sine_term * cosine - cosine_term * sine
        # The moment of a tendon without prestress is zero here apart from rounding.
        moment[np.abs(moment) <= 1e-14 * (np.abs(sine_term * sine) + np.abs(cosine_term * cosine))] = 0.0
        gain = 1.0 if model == "linear" else cosine  # gain divided by p^2
        structs["restraint_threshold"] = (moment + terms["prestress"]) / gain
        if model == "linear":
            structs["added_weight"], structs["added_push"] = slope, moment - self.alpha * slope
        else:
            structs["added_weight"], structs["added_push"] = sine_term, cosine_term
        structs["yielding"] = np.any(terms["tendon_stiffness"] > 0.0, axis=1)
        if np.any(structs["yielding"]):  # a yielding tendon is initially elastic
            for name in ("added_weight", "added_push", "prestress", "restraint_threshold"):
                structs[f"base_{name.removeprefix('added_')}"] = structs[name]
            structs["tendon_stiffness"] = p * p * terms["tendon_stiffness"]
            structs["lever_arm"] = terms["lever_arm"]
            structs["yield_elongation"], structs["slack_elongation"] = (
                terms["yield_elongation"][:, 0],
                terms["slack_elongation"][:, 0],
            )
            tendon_moment, slack_moment = (
                terms["tendon_stiffness"] * terms["lever_arm"],
                -terms["tendon_stiffness"] * terms["slack_elongation"],
            )
            structs["tendon_weight"] = -tendon_moment * (1.0 if model == "linear" else cosine)
            structs["tendon_push"] = tendon_moment * (self.alpha if model == "linear" else sine)
            structs["added_weight"] += structs["tendon_weight"]
            structs["added_push"] += structs["tendon_push"]
            structs["prestress"] += p * p * slack_moment
            structs["restraint_threshold"] += slack_moment / gain
        names = ("restraint_threshold", "added_weight", "added_push", "prestress", "spring", "damping")
        is_restrained = [np.any(structs[name] != 0.0, axis=1) for name in (*names, "tendon_stiffness")]
        structs["restrained"] = np.any(is_restrained, axis=0)

    @property
    def stops(self) -> Floats:
        """Rotation at which each block stands on each side: zero."""
        return np.zeros((len(self), 2))

    @property
    def is_symmetric(self) -> bool:
        """Whether all blocks have two equal sides."""
        has_equal_sides = all(np.array_equal(values[:, 0], values[:, 1]) for values in self._collect_arrays().values())
        return has_equal_sides and not np.any(self.terms.get("one_sided", 0.0))

    def __repr__(self) -> str:
        if not len(self):
            return "<Blocks: none>"
        p, alpha, e = (format_range(values) for values in (self.p, self.alpha, self.restitution))
        suffix = ", restrained" if self.terms else ""
        return f"<Blocks: {len(self)}; p {p} rad/s, alpha {alpha} rad, restitution {e}{suffix}>"

    def __len__(self) -> int:
        return len(self.p)

    def __getitem__(self, index: int) -> Block | RestrainedBlock:
        if isinstance(index, (slice, tuple, list, np.ndarray)):
            message = "the index of a block must be a whole number; use blocks.select for slices, indices and masks"
            raise BlockError(message)
        p, alpha, e = (tuple(array[index]) for array in (self.p, self.alpha, self.restitution))
        block = Block.from_parameters(p, alpha, e, gravity=self.gravity)
        terms, is_one_sided = [RestraintTerms(), RestraintTerms()], False
        if self.terms:
            terms = [
                RestraintTerms(*(float(self.terms[name][index, side]) for name in RestraintTerms._fields))
                for side in range(2)
            ]
            is_one_sided = bool(self.terms["one_sided"][index, 0])
        labels = {name: values[index].item() for name, values in self.labels.items()}
        if not is_one_sided and terms == [RestraintTerms(), RestraintTerms()]:
            return block.with_labels(**labels) if labels else block
        text = "block with restraints" + ", rocking one way" * is_one_sided
        restrained = RestrainedBlock.__new__(RestrainedBlock)._fill(block, terms, text, is_one_sided=is_one_sided)
        return restrained.with_labels(**labels) if labels else restrained

    def __iter__(self) -> Iterator[Block | RestrainedBlock]:
        return (self[index] for index in range(len(self)))

    def select(self, index: slice | NDArray[np.int64] | NDArray[np.bool_]) -> Blocks:
        """Return some of the blocks, by a slice, indices, or a mask."""
        selection = index if isinstance(index, slice) else np.asarray(index)
        if not isinstance(selection, slice) and not selection.size:
            selection = selection.astype(np.int64)
        try:
            rows = np.arange(len(self))[selection]
        except IndexError:
            rows = np.array(0)
        if rows.ndim != 1:
            requirement = f"a slice, a flat array of indices below {len(self)}, or a mask of {len(self)} values"
            hint = "use blocks[0] for a single block"
            raise BlockError(f"select requires {requirement}, not {checks.short_repr(index)}; {hint}")
        arrays = {name: values[rows] for name, values in self._collect_arrays().items()}
        radii = None if self.radii is None else self.radii[rows]
        labels = {name: values[rows] for name, values in self.labels.items()}
        return Blocks.__new__(Blocks)._fill(self.gravity, arrays, radii=radii, labels=labels)

    def with_p_scaled(self, factors: Floats) -> Blocks:
        """Return blocks of the same shapes with p multiplied by these factors.

        Lengths are divided by the square of the factor. Forces of restraints keep their ratio to the weight: for a
        tendon prestress, strength, and stiffness times length, so its yield strain is unchanged.
        """
        scale = factors[:, None]
        terms = {name: values * scale ** _SIZE_EXPONENTS.get(name, 0) for name, values in self.terms.items()}
        blocks = Blocks(self.p * scale, self.alpha, self.restitution, gravity=self.gravity, **terms)
        blocks.__dict__.update(radii=None if self.radii is None else self.radii / scale**2, labels=self.labels)
        return blocks


def _collect_label(bodies: Iterable[Any], name: str) -> NDArray[Any]:
    """Return a label of all bodies as numbers, NaN if missing, or else as texts."""
    values = [body.labels.get(name) for body in bodies]
    if all(value is None or isinstance(value, (int, float)) for value in values):
        return np.array(values, dtype=np.float64)
    return np.array(["" if value is None else format_cell(value) for value in values])


def resolve_p(p: ArrayLike | None, size: ArrayLike | None, gravity: float) -> ArrayLike:
    """Return frequency parameters, rad/s, from either argument."""
    if p is not None and size is None:
        return p
    if size is not None and p is None:
        g = checks.positive(gravity, "gravity", BlockError, "m/s^2")
        return np.sqrt(0.75 * g / checks.positive_numbers(size, "size", BlockError))
    suffix = "" if p is None else ", not both"
    raise BlockError(f"give either {{}} (rad/s) or {{}} (half diagonals, m){suffix}", "p", "size")


def _expand_sides(array: Floats) -> Floats:
    if array.ndim == 2 and array.shape[1] == 2:
        return array
    if array.ndim > 1:
        raise ValueError
    return np.repeat(np.atleast_1d(array)[:, None], 2, axis=1)


def _compute_restitutions(p: Floats, alpha: Floats) -> Floats:
    """Compute the restitutions by angular momentum of rigid bodies with these p and alpha."""
    factors: Floats = 1.0 - 1.5 * np.sin(alpha) ** 2
    asymmetric = np.flatnonzero((p[:, 0] != p[:, 1]) | (alpha[:, 0] != alpha[:, 1]))
    factors[asymmetric], _ = compute_rigid_bodies(p[asymmetric], alpha[asymmetric])
    if (undetermined := np.isnan(factors).any(axis=1)).any():
        first = int(np.argmax(undetermined))
        raise BlockError(f"{describe_missing_body(p[first], alpha[first])} (block {first})", "restitution")
    stocky = np.flatnonzero(~(factors > 0.0).all(axis=1))
    if len(stocky):
        result = f"gives block {stocky[0]} a restitution of {factors[stocky[0]].min():.3g}, because it is too stocky"
        message = f"conservation of angular momentum {result}; set {{}} to a value or a pair in (0, 1]"
        raise BlockError(message, "restitution")
    return check_sides(factors, "restitution")


BODIES_TYPES["blocks"] = BODIES_TYPES["restrained-blocks"] = Blocks
