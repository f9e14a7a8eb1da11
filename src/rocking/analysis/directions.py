"""Responses of a body to pairs of horizontal components in the vertical plane of each azimuth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.levels import RATIO_VARIABLES, compute_ratios, list_missing_notes
from rocking.analysis.spectrum import compute_overturned_share
from rocking.core import checks
from rocking.core.constants import Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, create_variable
from rocking.core.tables import escape_dollars, format_count, format_table
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import BlockError, OptionError
from rocking.motion.motion import Motion
from rocking.motion.scaling import FACTOR, Measure, MeasureName
from rocking.records.named import list_motions
from rocking.simulation.ensemble import ScalingLevels, simulate_many
from rocking.solid.rose import check_azimuths
from rocking.solid.solid import Solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Pair of horizontal components from one location.
Pair = tuple[Motion, Motion]
Pairs = Sequence[Pair] | Mapping[str, Pair]


def response_rose(
    solid: Solid,
    pairs: Pairs,
    *,
    azimuths: ArrayLike | None = None,
    levels: ArrayLike | None = None,
    measure: MeasureName | Measure = "factor",
    recorded: tuple[float, float] | None = None,
    restitution: float | Sequence[float] | None = None,
    model: Model = "nonlinear",
    chattering: str | ChatteringScheme = "certified",
) -> ResponseRose:
    """Simulate a body in the plane of every azimuth under the ground motion along it.

    Each azimuth is a separate simulation in one vertical plane, without the motion across it.

    Parameters
    ----------
    solid : Solid
        Body. Each azimuth uses the block of `Solid.block`.
    pairs : sequence of (Motion, Motion), or mapping of str to (Motion, Motion)
        m pairs of simultaneous horizontal components.
    azimuths : array_like, optional
        Azimuths, degrees clockwise from north. By default 0 to 165 in steps of 15, because results at 180 more are
        mirrored.
    levels : array_like, optional
        Levels to which every pair is scaled. By default pairs are not scaled.
    measure : str or Measure
        Measure of the levels, in SI units, of the pair as recorded: the geometric mean of both components unless the
        measure has another component, for example RotD50. Both are scaled by one factor.
    recorded : pair of float, optional
        Azimuths of the first and the second component of every pair. The default is read from the records.
    restitution : float or pair, optional
        As for `Solid.block`.
    model, chattering : optional
        As for `simulate_many`.

    Returns
    -------
    ResponseRose
        Peaks and outcomes for each pair, level and azimuth.

    Raises
    ------
    BlockError
        If `solid` is not a Solid, or is too stocky to rock across an azimuth.
    MotionError
        If a component is not a motion, or its azimuth is unknown.
    OptionError
        If there is no pair, or an argument is out of range.

    See Also
    --------
    rocking.Solid : Three-dimensional rigid body.
    rocking.simulate_many : Simulate many blocks under many motions.

    Examples
    --------
    >>> import rocking
    >>> pair = tuple(rocking.records.load(f"ridgecrest-tow2-{azimuth}") for azimuth in ("090", "360"))
    >>> rose = response_rose(rocking.Solid.from_mesh("statue"), [pair], azimuths=[0.0, 45.0, 90.0])
    >>> rose.data.overturned.values[0, 0].tolist()
    [False, False, False]
    """
    import xarray as xr

    if not isinstance(solid, Solid):
        kind = type(solid).__name__
        raise BlockError(f"a Solid is required, not a {kind}; create one with rocking.Solid.from_mesh")
    named_pairs = _name_pairs(pairs)
    angles = np.arange(0.0, 180.0, 15.0) if azimuths is None else check_azimuths(azimuths)
    scales = ScalingLevels.from_levels(levels, measure)
    blocks = [solid.block(azimuth, restitution=restitution) for azimuth in angles]
    factors = np.array([_compute_pair_factors(scales, pair) for pair in named_pairs.values()])
    shape = (len(named_pairs), scales.count, len(angles))
    peak, overturned = np.empty(shape), np.empty(shape, bool)
    with Progress("simulating", total=len(angles)) as bar:
        for k, (azimuth, block) in enumerate(zip(angles.tolist(), blocks, strict=True)):
            components = [first.rotated(second, azimuth, recorded=recorded) for first, second in named_pairs.values()]
            pairs_and_factors = zip(components, factors.tolist(), strict=True)
            motions = [motion.scaled(factor) for motion, row in pairs_and_factors for factor in row]
            table = simulate_many(block, motions, model=model, chattering=chattering)
            overturned[..., k] = table.overturned.values.reshape(shape[:2])
            outcomes = (table[name].values for name in RATIO_VARIABLES)
            peak[..., k] = compute_ratios(min(block.balance), *outcomes).reshape(shape[:2])
            bar.advance()
    worst_peak = np.where(overturned.any(axis=2), np.inf, peak.max(axis=2))
    share, share_anywhere = compute_overturned_share(peak), compute_overturned_share(worst_peak)
    dims, unit = ("pair", "level", "azimuth"), scales.attributes["units"]
    component = scales.attributes.get("component", "geometric mean").replace("_", " ")
    peak_meaning = "largest rotation over the smaller slenderness; inf: overturns, NaN: not finished"
    dataset = xr.Dataset(
        {
            "overturned": create_variable(dims, overturned, "whether the body overturns in the plane of the azimuth"),
            "peak_over_slenderness": create_variable(dims, peak, peak_meaning, "1"),
            "overturned_share": create_variable(dims[1:], share, "share of the pairs that overturn the body", "1"),
            "anywhere": create_variable("level", share_anywhere, "share that does at any azimuth", "1"),
        },
        {
            "pair": [*named_pairs],
            "level": create_variable("level", scales.values, f"of the {component} of both components", unit),
            "azimuth": create_variable("azimuth", angles, "clockwise from north", "deg"),
        },
        {"description": solid.description, "model": model, "measure": (scales.measure or FACTOR).quantity},
    )
    return ResponseRose(dataset)


@dataclass(frozen=True, eq=False, repr=False)
class ResponseRose(DatasetResult):
    """Responses of a body in the plane of each azimuth, computed by `response_rose`.

    The figure shows the share of pairs that overturn the body over the full circle, for up to four levels.

    Attributes
    ----------
    data : xarray.Dataset
        Over (pair, level, azimuth): overturned, peak_over_slenderness. Over (level, azimuth): overturned_share. Over
        (level): anywhere, the share of pairs that overturn the body at one azimuth or more.

    See Also
    --------
    rocking.response_rose : Run the simulations.

    Examples
    --------
    >>> import rocking
    >>> pair = tuple(rocking.records.load(f"ridgecrest-tow2-{azimuth}") for azimuth in ("090", "360"))
    >>> rose = rocking.response_rose(rocking.Solid.from_mesh("statue"), [pair], azimuths=[0.0, 90.0])
    >>> rose.data.overturned_share.values[0].tolist()
    [0.0, 0.0]
    """

    TABLES: ClassVar = {
        "responses": ("overturned", "peak_over_slenderness"),
        "shares": ("overturned_share",),
        "levels": ("anywhere",),
    }
    AGGREGATED_DIMENSIONS = ("pair", "azimuth")

    def _format_headline(self) -> str:
        data = self.data
        counts = f"{format_count(data.sizes['pair'], 'pair')}, {format_count(data.sizes['azimuth'], 'azimuth')}"
        return f"{data.description}, {data.model} model: share overturned, {counts}"

    def _format_levels(self) -> list[str]:
        """Format the levels."""
        level = self.data.level
        unit = f" {level.attrs.get('units', '1')}".removesuffix(" 1")
        return [f"{self.data.measure} {value:.4g}{unit}" for value in level.values.tolist()]

    def summary(self) -> str:
        data = self.data
        rows = []
        for k, name in enumerate(self._format_levels()):
            shares = data.overturned_share.values[k]
            worst = data.azimuth.values[shares == shares.max()]
            azimuth_text = f"{worst[0]:g} deg" if len(worst) == 1 else f"{len(worst)} azimuths"
            rows.append([name, shares.min(), shares.max(), azimuth_text, float(data.anywhere[k])])
        table = format_table(["level", "least share", "largest share", "at", "at any azimuth"], rows)
        notes = list_missing_notes(np.isnan(data.peak_over_slenderness.values))
        return "\n".join([self._format_headline(), "", table, *notes])

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            "description": data.description,
            "model": data.model,
            "measure": data.measure,
            "pairs": [str(name) for name in data.pair.values],
            "levels": data.level.values.tolist(),
            "azimuths_deg": data.azimuth.values.tolist(),
            **{str(name): values.values.tolist() for name, values in data.data_vars.items()},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.core.arrays import select_evenly
        from rocking.plot.maps import draw_shares

        data, level_names = self.data, self._format_levels()
        indices = select_evenly(data.sizes["level"], 4)
        azimuth, shares = data.azimuth.values, data.overturned_share.values[indices]
        # An opposite azimuth that was not requested has the same outcome.
        opposite = np.mod(azimuth + 180.0, 360.0)
        is_new = ~np.isin(opposite, azimuth)
        full_circle = np.concatenate([azimuth, opposite[is_new]])
        order = np.argsort(full_circle)
        return draw_shares(
            azimuth=full_circle[order],
            shares=np.concatenate([shares, shares[:, is_new]], axis=1)[:, order],
            labels=[level_names[k] for k in indices],
            title=title or escape_dollars(self._format_headline()),
            ax=ax,
            figsize=figsize,
        )


def _name_pairs(pairs: Pairs) -> dict[str, Pair]:
    """Name pairs, or raise an error if one is not a pair of motions."""
    entries = [*pairs.values()] if isinstance(pairs, Mapping) else checks.items(pairs, "pairs", OptionError)
    lists = [list_motions(pair) for pair in entries if not isinstance(pair, Motion)]
    if not lists or len(lists) < len(entries) or any(len(components) != 2 for components in lists):
        message = "{} must contain a pair of horizontal components for each site, as [(first, second)]"
        raise OptionError(message, "pairs", value=pairs)
    names = [f"{first.name} and {second.name}" for first, second in lists]
    unique_names = [f"{name} #{k + 1}" if names.count(name) > 1 else name for k, name in enumerate(names)]
    keys = map(str, pairs) if isinstance(pairs, Mapping) else unique_names
    return {key: (first, second) for key, (first, second) in zip(keys, lists, strict=True)}


def _compute_pair_factors(scales: ScalingLevels, pair: Pair) -> Any:
    """Compute factors that scale the geometric mean of the measures of both components to the levels."""
    if scales.measure is None:
        return scales.values
    measure = scales.measure
    if measure.component == "own":
        first, second = (measure.require_positive_value(motion, motion.name) for motion in pair)
        return measure.find_factor(scales.values, np.sqrt(first * second))
    first_motion = pair[0].with_orthogonal(pair[1])
    return measure.find_factor(scales.values, measure.require_positive_value(first_motion, first_motion.name))
