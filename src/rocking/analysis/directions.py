"""Responses of a body to pairs of horizontal components in the vertical plane of each azimuth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.levels import ratios_of
from rocking.analysis.spectrum import overturned_share
from rocking.core import checks
from rocking.core.constants import Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, variable
from rocking.core.tables import escape_dollars, format_count, format_table
from rocking.engine.schemes import ChatteringScheme
from rocking.engine.tasks import describe_missing
from rocking.errors import InvalidBlock, InvalidOption
from rocking.motion.motion import Motion
from rocking.motion.scaling import FACTOR, Measure, MeasureName
from rocking.records.named import list_motions
from rocking.simulation.ensemble import Scales, simulate_many
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
    measure : {"factor", "pga", "pgv"} or Measure
        Measure of the levels, in SI units: geometric mean of both components as recorded. Both are scaled by one
        factor.
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
    InvalidBlock
        If `solid` is not a Solid, or is too stocky to rock across an azimuth.
    InvalidMotion
        If a component is not a motion, or its azimuth is unknown.
    InvalidOption
        If there is no pair, or an argument is out of range.

    See Also
    --------
    rocking.Solid : Three-dimensional rigid body.
    rocking.simulate_many : Simulate many blocks under many motions.

    Examples
    --------
    >>> import rocking
    >>> pair = tuple(rocking.records.load(f"ridgecrest-tow2-{azimuth}") for azimuth in ("090", "360"))
    >>> found = response_rose(rocking.Solid.from_mesh("statue"), [pair], azimuths=[0.0, 45.0, 90.0])
    >>> found.data.overturned.values[0, 0].tolist()
    [False, False, False]
    """
    import xarray as xr

    if not isinstance(solid, Solid):
        raise InvalidBlock(f"a Solid is needed, not a {type(solid).__name__}: make one with rocking.Solid.from_mesh")
    named = _named_pairs(pairs)
    at = np.arange(0.0, 180.0, 15.0) if azimuths is None else check_azimuths(azimuths)
    scales = Scales.from_levels(levels, measure)
    blocks = [solid.block(azimuth, restitution=restitution) for azimuth in at]
    factors = np.array([_factors(scales, pair) for pair in named.values()])
    shape = (len(named), scales.count, len(at))
    peak, overturned = np.empty(shape), np.empty(shape, bool)
    with Progress("simulating", total=len(at)) as bar:
        for k, (azimuth, block) in enumerate(zip(at.tolist(), blocks, strict=True)):
            along = [one.rotated(other, azimuth, recorded=recorded) for one, other in named.values()]
            motions = [
                motion.scaled(factor) for motion, own in zip(along, factors, strict=True) for factor in own.tolist()
            ]
            found = simulate_many(block, motions, model=model, chattering=chattering)
            fell = found.overturned.values
            ratio = ratios_of(found.peak_rotation.values, fell, found.unfinished.values, min(block.balance))
            overturned[..., k], peak[..., k] = fell.reshape(shape[:2]), ratio.reshape(shape[:2])
            bar.advance()
    anywhere = np.where(overturned.any(axis=2), np.inf, peak.max(axis=2))
    dims = ("pair", "level", "azimuth")
    return ResponseRose(
        xr.Dataset(
            {
                "overturned": variable(dims, overturned, "whether the body overturns in the plane of the azimuth"),
                "peak_over_slenderness": variable(
                    dims, peak, "largest rotation over the smaller slenderness; inf: overturns, NaN: not finished", "1"
                ),
                "overturned_share": variable(
                    dims[1:], overturned_share(peak), "share of the pairs that overturn the body", "1"
                ),
                "anywhere": variable("level", overturned_share(anywhere), "share that does at any azimuth", "1"),
            },
            {
                "pair": [*named],
                "level": variable(
                    "level", scales.values, "of the geometric mean of both components", scales.attributes["units"]
                ),
                "azimuth": variable("azimuth", at, "clockwise from north", "deg"),
            },
            {"description": solid.description, "model": model, "measure": (scales.measure or FACTOR).quantity},
        )
    )


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
    """

    TABLES = MappingProxyType(
        {
            "responses": ("overturned", "peak_over_slenderness"),
            "shares": ("overturned_share",),
            "levels": ("anywhere",),
        }
    )
    POOLED = ("pair", "azimuth")

    def _headline(self) -> str:
        data = self.data
        over = f"{format_count(data.sizes['pair'], 'pair')}, {format_count(data.sizes['azimuth'], 'azimuth')}"
        return f"{data.description}, {data.model} model: share overturned, {over}"

    def _levels(self) -> list[str]:
        """Format the levels."""
        data = self.data
        unit = data.level.attrs.get("units", "1")
        return [
            f"{data.measure} {value:.4g}{'' if unit == '1' else f' {unit}'}" for value in data.level.values.tolist()
        ]

    def summary(self) -> str:
        data = self.data
        rows = []
        for k, name in enumerate(self._levels()):
            share = data.overturned_share.values[k]
            most = data.azimuth.values[share == share.max()]
            where = f"{most[0]:g} deg" if len(most) == 1 else f"{len(most)} azimuths"
            rows.append([name, share.min(), share.max(), where, float(data.anywhere[k])])
        table = format_table(["level", "least share", "largest share", "at", "at any azimuth"], rows)
        missing = describe_missing(np.isnan(data.peak_over_slenderness.values))
        return f"{self._headline()}\n\n{table}" + f"\nnote: {missing}" * bool(missing)

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            "description": data.description,
            "model": data.model,
            "measure": data.measure,
            "pairs": [str(name) for name in data.pair.values],
            "levels": data.level.values.tolist(),
            "azimuths_deg": data.azimuth.values.tolist(),
            **{str(name): each.values.tolist() for name, each in data.data_vars.items()},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.core.arrays import select_evenly
        from rocking.plot.maps import shares_figure

        data = self.data
        chosen = [*select_evenly(data.sizes["level"], 4)]
        azimuth = data.azimuth.values
        # An opposite azimuth that was not requested has the same outcome.
        opposite = np.mod(azimuth + 180.0, 360.0)
        new = ~np.isin(opposite, azimuth)
        around = np.concatenate([azimuth, opposite[new]])
        order = np.argsort(around)
        shares = data.overturned_share.values[chosen]
        names = self._levels()
        return shares_figure(
            azimuth=around[order],
            shares=np.concatenate([shares, shares[:, new]], axis=1)[:, order],
            labels=[names[k] for k in chosen],
            title=title or escape_dollars(self._headline()),
            ax=ax,
            figsize=figsize,
        )


def _named_pairs(pairs: Pairs) -> dict[str, Pair]:
    """Return pairs by name, or raise an error if one is not a pair of motions."""
    given = [*pairs.values()] if isinstance(pairs, Mapping) else checks.items(pairs, "pairs", InvalidOption)
    found = [list_motions(pair) for pair in given if not isinstance(pair, Motion)]
    if not found or len(found) < len(given) or any(len(components) != 2 for components in found):
        raise InvalidOption(
            "{} must hold the two horizontal components of each place, as [(first, second)]", "pairs", value=pairs
        )
    names = [f"{one.name} and {other.name}" for one, other in found]
    numbered = [f"{name} #{k + 1}" if names.count(name) > 1 else name for k, name in enumerate(names)]
    both = ((one, other) for one, other in found)
    return dict(zip(map(str, pairs) if isinstance(pairs, Mapping) else numbered, both, strict=True))


def _factors(scales: Scales, pair: Pair) -> Any:
    """Return factors that scale the geometric mean of the measures of both components to the levels."""
    if scales.measure is None:
        return scales.values
    one, other = (scales.measure.positive(motion, motion.name) for motion in pair)
    return scales.values / np.sqrt(one * other)
