"""Fragility: the probability that a block overturns, or passes a rotation, against the intensity of the motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.analysis.fragility.curve import Band, fitted_curve, passed
from rocking.analysis.fragility.result import Fragility
from rocking.analysis.labels import groups_of
from rocking.analysis.levels import (
    clusters_of,
    mean_one,
    motions_in_words,
    only_block,
    pooled,
    ratios_of,
    simulate_levels,
    undecided_text,
    units_of,
    values_of,
)
from rocking.arrays import Floats
from rocking.body import Bodies, Body
from rocking.constants import Model
from rocking.engine import Setup, missing_text
from rocking.ensemble import SIGNS, Polarity, simulate_many
from rocking.errors import InvalidOption, Unfitted
from rocking.motion.scaling import IntensityName, Measure
from rocking.problem import bodies_of, slenderness_of
from rocking.records.named import Motions, several_motions
from rocking.tables import counted
from rocking.treatment import Treatment, treatment

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Intensities, in SI units, far beyond any motion; whole numbers that double precision counts exactly.
_INTENSITIES: Final = (1e-50, 1e50)
_MOST_TRIALS: Final = 2.0**53
_LIKELIHOOD: Final = Band()

#: Limit states: peak rotation over slenderness that is exceeded; infinity is overturning.
OVERTURNING: Final[Mapping[str, float]] = {"overturning": math.inf}


def fragility(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    measure: IntensityName | Measure = "pga",
    levels: ArrayLike | None = None,
    limits: Mapping[str, float] = OVERTURNING,
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    polarity: Polarity = "+",
    weights: ArrayLike | None = None,
    clusters: ArrayLike | None = None,
    band: Band = _LIKELIHOOD,
    threads: int | None = None,
    progress: bool | None = None,
) -> Fragility:
    """Simulate blocks under motions and fit the probability that a limit is exceeded against the intensity.

    Parameters
    ----------
    blocks : Blocks, Block, RestrainedBlock or sequence of one kind
        One block; or several whose outcomes are pooled: against a measure in their own units, or of an ensemble that
        stands for one block that is not quite known, with `weights` (`Calibration.fragility` does so).
    motions : Motion, sequence of Motion, or mapping of str to Motion
        m motions; a mapping gives them its names.
    measure : {"pga", "pgv", "pga_ratio", "pgv_ratio"} or Measure
        Intensity measure: peak acceleration (m/s^2), peak velocity (m/s); in each block's own units PGA and
        p PGV over the acceleration that lifts it; or spectral acceleration (m/s^2) as
        ``rocking.Measure("sa", period=1.0)``.
    levels : array_like, optional
        Stripes: every motion scaled to each of these levels. Without them a cloud: every motion as it is.
    limits : mapping of str to float
        Limit states: peak rotation over slenderness (of the block as it stands, the smaller one of two sides) that is
        exceeded; ``math.inf``
        stands for overturning, the default.
    model : {"nonlinear", "linear"}
        Equation of motion.
    chattering : str or Treatment
        As for `simulate`.
    polarity : {"+", "-", "both"}
        Motions as they are, reversed, or both. With both each motion counts twice, unless all blocks are symmetric:
        they do the same under a motion and its mirror image, which is no second outcome.
    weights : array_like, optional
        How much the outcomes of each block count, one number for each; by default all alike. A block of weight 0 is
        simulated, and is none of the data.
    clusters : "station" or array_like of labels, shape (m,), optional
        Which motions belong together: intervals then tell how far clusters differ. "station" joins components of one
        station in one earthquake, as their files name them. By default each motion is one cluster, with all its
        outcomes. Motions that are multiples of one another, as one record scaled to several levels beforehand, are one
        cluster in any case.
    band : Band
        How intervals and bands are made.
    threads : int, optional
        As for `simulate_many`.
    progress : bool, optional
        As for `simulate_many`.

    Returns
    -------
    Fragility
        Curves, and all outcomes.

    Raises
    ------
    InvalidOption
        If an argument is out of its range, or a lognormal cannot be fitted because the outcomes are all alike or
        separated.
    InvalidMotion
        If a motion is zero throughout.

    Examples
    --------
    >>> import numpy as np
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> motions = [rocking.pulses.one_sine(1.0, f) for f in np.linspace(0.3, 1.5, 13)]
    >>> result = fragility(block, motions, measure="pga_ratio", levels=np.linspace(1.0, 9.0, 17))
    >>> print(f"median {result.curves[0].median:.3f}, dispersion {result.curves[0].dispersion:.3f}")
    median 1.443, dispersion 0.524
    """
    many, how = bodies_of(blocks), Measure.of(measure)
    slenderness = slenderness_of(many)
    shares = weights_of(weights, len(many))
    mirrored = checks.one_of(polarity, "polarity", InvalidOption, get_args(Polarity)) == "both" and many.is_symmetric
    _check_band(band)
    states = _limit_states(limits, "limits")
    stripes = None if levels is None else checks.increasing_numbers(levels, "levels", InvalidOption)
    if stripes is not None and stripes.size < 2:
        raise InvalidOption("a fragility needs {} that differ: give two or more", "levels", value=levels)
    shaken = several_motions(motions)
    values, together = values_of(shaken, how), clusters_of(shaken, clusters)
    options: dict[str, Any] = {
        "chattering": chattering,
        "polarity": "+" if mirrored else polarity,
        "threads": threads,
        "progress": progress,
    }
    if stripes is None:
        table = simulate_many(many, shaken, model=model, **options).expand_dims("level")
        intensity = (values[:, None] / units_of(many, how, model)[None, :])[None, :, :, None]
    else:
        table = simulate_levels(many, shaken, how, stripes, model=model, **options)
        intensity = stripes[:, None, None, None]
    if "polarity" not in table.dims:
        table = table.expand_dims("polarity")
    table = table.transpose("level", "motion", "block", "polarity")
    missing = table.unfinished.values
    ratio = ratios_of(table.peak_rotation.values, table.overturned.values, missing, slenderness[:, None])
    groups = np.broadcast_to(together[None, :, None, None], ratio.shape)
    x, trials = (np.broadcast_to(each, ratio.shape).ravel() for each in (intensity, shares[:, None]))
    outcomes = _outcomes(table, how, x, ratio, states)
    if weights is not None:
        outcomes["weight"] = trials
    # What a block without weight does is told, but is none of the data; nor is what was given up.
    counts = (trials > 0.0) & ~missing.ravel()
    x, trials, groups = x[counts], trials[counts], groups.ravel()[counts]
    data = {name: (x, trials * passed(ratio, limit, name).ravel()[counts], trials) for name, limit in states.items()}
    try:
        curves = [fitted_curve(name, data[name], groups, band, how, states[name]) for name in states]
    except Unfitted as refused:
        refused.outcomes = outcomes
        raise
    scales = (
        np.ones((1, 1, 1)) if stripes is None else stripes[:, None, None] * units_of(many, how, model) / values[:, None]
    )
    signs = np.array(SIGNS[options["polarity"]])
    setup = Setup(many, model, treatment(chattering))
    kind = "cloud" if levels is None else counted(len(intensity), "stripe")
    text = f"{pooled(blocks, weights)}, {motions_in_words(together, clusters)}, {kind}, {model} model"
    return Fragility(
        curves=tuple(curves),
        measure=how,
        description=text + of_polarities(polarity, is_symmetric=many.is_symmetric),
        block=only_block(blocks),
        model=model,
        outcomes=outcomes,
        one_way=polarity != "both" and not many.is_symmetric,
        with_vertical="vertical" in table.coords,
        several_blocks=bool(np.count_nonzero(shares) > 1),
        source="motion" if clusters is None else "cluster",
        undecided=undecided_text(setup, shaken, scales[..., None] * signs, table.overturned.values, threads),
        missing=missing_text(missing),
    )


def weights_of(weights: ArrayLike | None, count: int) -> Floats:
    """Weights of blocks, 1 in the mean of those that have any: outcomes are as many as without the others."""
    shares = mean_one(weights, count)
    return np.asarray(shares / shares[shares > 0.0].mean())


def of_polarities(polarity: Polarity, *, is_symmetric: bool) -> str:
    """Say, behind a description, which polarities outcomes come from where both were asked for."""
    if polarity != "both":
        return ""
    return ", one polarity, since a symmetric block does the same in both" if is_symmetric else ", both polarities"


def _outcomes(
    table: xr.Dataset, measure: Measure, intensity: Floats, ratio: Floats, limits: Mapping[str, float]
) -> pd.DataFrame:
    """Every simulation: motion, block, polarity, intensity, peak and what it exceeded."""
    import pandas as pd

    def along(values: NDArray[Any]) -> NDArray[Any]:
        return np.broadcast_to(values, ratio.shape).ravel()  # of (level, motion, block, polarity)

    signs = table.polarity.values if "polarity" in table.coords else np.array(["+"])
    verticals = {"vertical": along(table.vertical.values[:, None, None])} if "vertical" in table.coords else {}
    return pd.DataFrame(
        {
            "motion": along(table.motion.values[:, None, None]),
            **verticals,
            "block": along(np.arange(table.sizes["block"])[:, None]),
            "polarity": along(signs),
            measure.column: intensity,
            "peak_rotation_rad": table.peak_rotation.values.ravel(),
            "peak_over_alpha": ratio.ravel(),
            "overturned": table.overturned.values.ravel(),
            "unfinished": table.unfinished.values.ravel(),
            **{f"exceeded_{name}": passed(ratio, limit, name).ravel().astype(bool) for name, limit in limits.items()},
        }
    )


def fit_fragility(
    intensity: ArrayLike,
    exceeded: ArrayLike | Mapping[str, ArrayLike],
    *,
    trials: ArrayLike = 1,
    clusters: ArrayLike | None = None,
    measure: IntensityName | Measure = "pga",
    band: Band = _LIKELIHOOD,
    block: Body | None = None,
    description: str = "observed outcomes",
) -> Fragility:
    """Fit a lognormal fragility to outcomes by maximum likelihood: a cloud (one outcome each) or stripes (counts).

    Parameters
    ----------
    intensity : array_like, shape (n,)
        Positive intensities, in SI units.
    exceeded : array_like, shape (n,), or mapping of str to array_like
        At each intensity, whether the limit was exceeded, or in how many trials; for several limit states a mapping
        from their names. One without a name is called "overturning".
    trials : array_like
        Number of trials at each intensity.
    clusters : array_like of labels, shape (n,), optional
        Which outcomes belong together (the motion, for instance), for the bands; by default each is on its own, as is
        one whose label is NaN, None or empty. Fewer
        than three clusters of several outcomes bound nothing: then intervals go from 0 to infinity.
    measure : {"pga", "pgv", "pga_ratio", "pgv_ratio"} or Measure
        What the intensity is, as for `fragility`.
    band : Band
        How intervals and bands are made.
    block : Block, optional
        What was tested, for the units of `Fragility.to_nrml`.
    description : str
        What was observed.

    Returns
    -------
    Fragility
        A curve for each limit state.

    Raises
    ------
    InvalidOption
        If an argument is out of its range, or no rising lognormal fits best: no outcome exceeds the limit, or all do,
        or they are separated (none up to some intensity and all from there on), or all at one intensity, or exceed the
        limit no more often at higher intensities, or put the median at more than 1000 times any intensity.

    Notes
    -----
    The likelihood of P = Phi(ln(x/median)/dispersion) is that of independent binomial counts (Baker 2015). It has one
    maximum, or none where the outcomes are separated.

    References
    ----------
    Chandler, R. E. and Bate, S. (2007). Inference for clustered data using the independence loglikelihood. Biometrika
    94(1), 167-183.

    Efron, B. (1987). Better bootstrap confidence intervals. Journal of the American Statistical Association 82(397),
    171-185.

    Baker, J. W. (2015). Efficient analytical fragility function fitting using dynamic structural analysis. Earthquake
    Spectra 31(1), 579-599.

    Examples
    --------
    >>> result = fit_fragility([2.0, 3.0, 4.0, 5.0], [1, 4, 7, 10], trials=10)
    >>> curve = result.curves[0]
    >>> print(f"median {curve.median:.4f} m/s^2, dispersion {curve.dispersion:.4f}")
    median 3.1509 m/s^2, dispersion 0.3042
    """
    how = Measure.of(measure)
    x = checks.positive_numbers(intensity, "intensity", InvalidOption)
    if x.min() < _INTENSITIES[0] or x.max() > _INTENSITIES[1]:
        low, high = _INTENSITIES
        raise InvalidOption(f"{{}} must be from {low:g} to {high:g}: check its units", "intensity", value=intensity)
    count = _whole(trials, "trials", x.size, 1.0, _MOST_TRIALS)
    outcomes = _limit_states(exceeded if isinstance(exceeded, Mapping) else {"overturning": exceeded}, "exceeded")
    groups = None if clusters is None else groups_of(clusters, "clusters", x.size)
    _check_band(band)
    curves = [
        fitted_curve(name, (x, _whole(values, "exceeded", x.size, 0.0, count), count), groups, band, how)
        for name, values in outcomes.items()
    ]
    return Fragility(tuple(curves), how, description, block, "nonlinear", None, source="cluster")


def _check_band(band: object) -> None:
    if not isinstance(band, Band):
        raise InvalidOption(
            f'{{}} must be a Band, as Band("bootstrap", samples=500), not {checks.shown(band)}', "band", value=band
        )


def _limit_states(given: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return what is given for each limit state by its name, of which there is one at least."""
    for state in checks.mapping(given, name, InvalidOption, "{'overturning': inf}"):
        checks.text(state, f"name of a limit state in {name}", InvalidOption)
    return given


def _whole(values: ArrayLike, name: str, size: int, least: float, most: ArrayLike) -> Floats:
    """Whole numbers, one for each intensity, between two bounds."""
    given = checks.answers_or_numbers(values, name, InvalidOption)
    try:
        numbers = np.broadcast_to(given, size)
    except ValueError:
        raise InvalidOption(f"{{}} must hold one number for each of the {size} intensities", name) from None
    if not np.all((numbers >= least) & (numbers <= np.asarray(most)) & (numbers == np.floor(numbers))):
        bound = f"{most:g}" if isinstance(most, float) else "the trials"
        raise InvalidOption(f"{{}} must be whole numbers, at least {least:g} and no more than {bound}", name)
    return numbers
