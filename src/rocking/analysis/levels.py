"""Every block under every motion, scaled to levels of an intensity measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block, Blocks
from rocking.constants import Model
from rocking.engine import require_finished
from rocking.ensemble import simulate_many
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.tables import counted

if TYPE_CHECKING:
    import xarray as xr


#: Where only motions as they are were simulated, though the sides of a block differ.
REVERSED_TOO: Final = "the sides differ, so motions that are reversed (scaled by -1) overturn at other levels"


def described(blocks: Blocks | Block | Sequence[Block]) -> str:
    """Name blocks in a few words: one by its sizes or parameters, several by their number."""
    only = only_block(blocks)
    if only is None:
        return counted(len(Blocks.of(blocks)), "block")
    if not isinstance(blocks, Blocks):
        return only.description
    return f"block with p = {_pair(blocks.p[0])} rad/s, alpha = {_pair(blocks.alpha[0])} rad"


def pooled(blocks: Blocks | Block | Sequence[Block], weights: ArrayLike | None) -> str:
    """Name blocks whose outcomes are pooled, and say whether one counts more than another."""
    if only_block(blocks) is not None:
        return described(blocks)
    return f"{described(blocks)}, {'all of equal weight' if weights is None else 'weighted'}"


def mean_one(weights: ArrayLike | None, count: int) -> Floats:
    """Weights of blocks, one each and 1 in the mean; all 1 where none are given."""
    if weights is None:
        return np.ones(count)
    given = checks.numbers(weights, "weights", InvalidOption)
    if given.shape != (count,):
        raise InvalidOption(f"weights must hold one number for each of {counted(count, 'block')}, not {given.shape}")
    if not (np.all(np.isfinite(given) & (given >= 0.0)) and given.sum() > 0.0):
        raise InvalidOption("weights must be finite numbers of 0 or more, and not all 0")
    return np.asarray(given * (count / given.sum()))


def only_block(blocks: Blocks | Block | Sequence[Block]) -> Block | None:
    """Return the block, as it was described, where there is one only."""
    several: Sequence[Block] | Blocks = [blocks] if isinstance(blocks, Block) else blocks
    return several[0] if len(several) == 1 else None


def _pair(sides: Floats) -> str:
    return f"{sides[0]:.4g}" if sides[0] == sides[1] else f"({sides[0]:.4g}, {sides[1]:.4g})"


def values_of(motions: Sequence[Motion], measure: Measure) -> Floats:
    """Return what each motion alone measures, in SI units."""
    return np.array([measure.positive(motion, motion.name) for motion in motions])


def units_of(blocks: Blocks, measure: Measure, model: Model) -> Floats:
    """Return what counts as 1 for each block, in SI units: the block's own unit, or 1."""
    if not measure.in_block_units:
        return np.ones(len(blocks))
    return measure.unit(np.array([min(block.uplift_thresholds(model)) for block in blocks]), blocks.p.min(axis=1))


def simulate_levels(
    blocks: Blocks, motions: Sequence[Motion], measure: Measure, levels: Floats, *, model: Model, **options: Any
) -> xr.Dataset:
    """Simulate every block under every motion at every level; as `simulate_many`, with the dimension ``level``.

    Parameters
    ----------
    blocks, motions, model, **options
        As for `simulate_many`.
    measure : Measure
        What the motions are scaled to; one that counts in a block's own unit scales them for each block.
    levels : ndarray
        Levels of the measure.
    """
    import xarray as xr

    units = units_of(blocks, measure, model)
    groups = [np.flatnonzero(units == unit) for unit in np.unique(units)]
    parts = []
    for group in groups:
        scaled = {"levels": levels * units[group[0]], "measure": measure.alone}
        parts.append(simulate_many(blocks.select(group), motions, model=model, **scaled, **options))
        parts[-1] = parts[-1].assign_coords(scale=("scale", levels, {"measure": measure.name, "units": measure.units}))
    whole = xr.concat(parts, "block", data_vars="all", coords="minimal", compat="override", join="override")
    require_finished(whole.unfinished.values)
    return whole.isel(block=np.argsort(np.concatenate(groups))).rename(scale="level")
