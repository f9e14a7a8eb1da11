"""How the median and the dispersion of a fragility change with the block, where they have derivatives.

Outcomes at given levels jump as a block changes. A fit to all levels between two, evenly in their logarithm, depends on
the ends of the bands of levels that overturn alone, each of which is a critical scale with derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.analysis.critical import critical_between
from rocking.analysis.fragility import lognormal
from rocking.analysis.fragility.lognormal import Outcomes
from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.errors import InvalidOption, Unfitted
from rocking.motion.motion import Motion
from rocking.motion.named import Motions, several_motions
from rocking.motion.scaling import Measure, MeasureName
from rocking.simulation import simulate

#: Intensities of a motion alone: the unit of a block's own would change with the block.
_MEASURES: Final = ("pga", "pgv", "sa")

#: Ends of bands are found to this share of the level in an ensemble; single responses then agree within some more.
_TOLERANCE: Final = 1e-12
_BRACKETS: Final = (1e-11, 1e-9, 1e-7)

#: Points of a panel (Gauss and Legendre), panels in the range, and panels in a dispersion.
_POINTS: Final = 10
_PANELS: Final = 64
_PER_DISPERSION: Final = 4.0

_BY: Final = ("by_p", "by_alpha", "by_restitution")
_END: Final = np.dtype([("motion", "i8"), ("level", "f8"), ("begins", "?"), *((name, "f8") for name in _BY)])


@dataclass(frozen=True, eq=False)
class MedianGradient:
    """Median and dispersion of a fragility fitted to all levels between two, with derivatives; by `median_gradient`.

    Attributes
    ----------
    median, dispersion : float
        Median intensity, in `units`, and standard deviation of the logarithm of the intensity.
    median_by_p, median_by_alpha, median_by_restitution : float
        Change of the median per relative change of these of both sides together: times 1e-3 it is that by 0.1 % more.
    dispersion_by_p, dispersion_by_alpha, dispersion_by_restitution : float
        The same of the dispersion.
    ends : structured array
        Ends of the bands of levels that overturn: position of the motion, level (in `units`), whether the band begins
        there, and the change of the level by_p, by_alpha and by_restitution per relative change of each.
    reason : str
        Why derivatives are NaN, one sentence; empty where none is.
    units : str
        Of the measure: "m/s^2" or "m/s".
    """

    median: float
    dispersion: float
    median_by_p: float
    median_by_alpha: float
    median_by_restitution: float
    dispersion_by_p: float
    dispersion_by_alpha: float
    dispersion_by_restitution: float
    ends: NDArray[np.void]
    reason: str
    units: str

    def __repr__(self) -> str:
        units = "" if self.units == "1" else f" {self.units}"
        text = f"median {self.median:.6g}{units}, dispersion {self.dispersion:.6g}"
        by = self.reason or (
            f"0.1 % more of the slenderness changes them by {1e-3 * self.median_by_alpha:.2g} and "
            f"{1e-3 * self.dispersion_by_alpha:.2g}"
        )
        return f"<MedianGradient: {text}; {by}>"


def median_gradient(
    block: Body,
    motions: Motions,
    low: float,
    high: float,
    *,
    measure: MeasureName | Measure = "pga",
    model: Model = "nonlinear",
    levels: int = 100,
    threads: int | None = None,
    progress: bool | None = None,
) -> MedianGradient:
    """Fit a fragility to all levels of motions between two, and differentiate its median and dispersion.

    Parameters
    ----------
    block : Block
        What rocks, or another body that can overturn.
    motions : Motion, sequence of Motion, or mapping of str to Motion
        What shakes it; more than one, since a single motion mostly makes a step.
    low, high : float
        Levels of the measure, SI units, between which all count alike, evenly in their logarithm.
    measure : {"pga", "pgv"} or Measure
        Intensity measure: peak acceleration (m/s^2), peak velocity (m/s), or spectral acceleration (m/s^2) as
        ``rocking.Measure("sa", period=1.0)``.
    model : {"nonlinear", "linear"}
        Equation of motion.
    levels : int
        Levels at which verdicts are compared first. Thinner bands between two of them are not seen, and as the block
        changes may come to be: take so many that more change nothing.
    threads : int, optional
        As for `simulate_many`.
    progress : bool, optional
        As for `simulate_many`.

    Returns
    -------
    MedianGradient
        Median, dispersion, and their changes per relative change of p, slenderness and restitution.

    Raises
    ------
    InvalidOption
        If an argument is out of its range.
    Unfitted
        If no lognormal can be fitted: no level between the two overturns the block, all do, or they are separated.
    InvalidMotion
        If a motion is zero throughout.

    Notes
    -----
    With more and more levels the median and the dispersion of `fragility` tend to these. The likelihood is an integral
    over the logarithm of the level, which changes with the ends of the bands that overturn; these change as critical
    scales do, and the fit by the implicit function theorem on its score equations (see "Impacts: restitution and
    sensitivity" in the documentation).

    Examples
    --------
    >>> import numpy as np
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> pulses = [rocking.pulses.one_sine(1.0, f) for f in np.linspace(0.4, 1.0, 5)]
    >>> found = rocking.median_gradient(block, pulses, 1.0, 12.0)
    >>> f"{found.median:.4f} m/s^2, {found.median_by_alpha:+.4f} per 100 % of the slenderness"
    '2.6372 m/s^2, +2.7020 per 100 % of the slenderness'
    """
    how = Measure.of(measure, among=_MEASURES)
    least, most = (checks.positive(value, name, InvalidOption) for value, name in ((low, "low"), (high, "high")))
    if not least < most:
        raise InvalidOption(f"{{}} = {least:g} must be below {{}} = {most:g}", "low", "high", value=low)
    grid = np.geomspace(least, most, checks.whole(levels, "levels", InvalidOption, 2))
    shaken = several_motions(motions)
    found = incremental_dynamic_analysis(
        block,
        shaken,
        measure=how,
        levels=grid,
        model=model,
        tolerance=_TOLERANCE,
        threads=threads,
        progress=progress,
    )
    ends, reasons = [], []
    for m, motion in enumerate(shaken):
        for band in found.bands(motion=m):
            for level, begins in zip(band, (True, False), strict=True):
                if not math.isnan(level):
                    changes, reason = _end(block, motion, level / how.value(motion), model, begins=begins)
                    ends.append((m, level, begins, *(level * changes)))
                    reasons.append(reason)
    starts_beyond = found.data.overturned.transpose("level", "motion", "block").values[0, :, 0]
    return _fitted(np.array(ends, dtype=_END), starts_beyond, (least, most), how, next(filter(None, reasons), ""))


def _end(block: Body, motion: Motion, factor: float, model: Model, *, begins: bool) -> tuple[Floats, str]:
    """Relative changes of a factor at which a band begins or ends by p, slenderness, restitution; or why none."""
    for width in _BRACKETS:
        low, high = factor * (1.0 - width), factor * (1.0 + width)
        verdicts = [simulate(block, motion * scale, model=model).overturned for scale in (low, high)]
        if verdicts == [not begins, begins]:
            found = critical_between(
                lambda scale: simulate(block, motion * scale, model=model), motion, low, high, falls_above=begins
            )
            changes = np.array([found.p, found.alpha, found.restitution]) / found.scale
            return changes, found.gradient.reason if np.any(np.isnan(changes)) else ""
    return np.full(3, math.nan), "bands of levels that overturn follow each other as closely as rounding can tell"


def _segments(
    ends: NDArray[np.void], starts_beyond: Sequence[bool], limits: tuple[float, float]
) -> Iterator[tuple[float, float, bool]]:
    """Stretches of the logarithm of the level under each motion, and whether all levels there overturn."""
    low, high = (math.log(each) for each in limits)
    for m, beyond in enumerate(starts_beyond):
        level: Floats = ends["level"][ends["motion"] == m]
        mine = np.sort(np.log(level))
        edges = [low, *mine.tolist(), high]
        for k in range(len(edges) - 1):
            yield edges[k], edges[k + 1], bool(beyond) ^ (k % 2 == 1)


def _outcomes(segments: Sequence[tuple[float, float, bool]], width: float) -> Outcomes:
    """Points and weights of a quadrature over segments, in panels at most so wide, as outcomes that count in parts."""
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    z, parts, passed = [], [], []
    for low, high, overturns in segments:
        edges = np.linspace(low, high, max(1, math.ceil((high - low) / width)) + 1)
        half = 0.5 * np.diff(edges)[:, None]
        z.append((0.5 * (edges[:-1] + edges[1:])[:, None] + half * points).ravel())
        parts.append((half * weights).ravel())
        passed.append(np.full(z[-1].size, overturns))
    trials = np.concatenate(parts)
    return Outcomes(np.concatenate(z), np.where(np.concatenate(passed), trials, 0.0), trials)


def _fitted(
    ends: NDArray[np.void], starts_beyond: Sequence[bool], limits: tuple[float, float], measure: Measure, reason: str
) -> MedianGradient:
    """Fit the continuum of levels, and take the changes of the ends of bands to those of the fit."""
    segments = list(_segments(ends, starts_beyond, limits))
    if len({overturns for _, _, overturns in segments}) == 1:
        some, which = ("all levels overturn", "lower") if segments[0][2] else ("no level overturns", "higher")
        raise Unfitted(f"no lognormal can be fitted: {some} the block under every motion: {which} levels are needed")
    width = (math.log(limits[1]) - math.log(limits[0])) / _PANELS
    fault = lognormal.unidentified(_outcomes(segments, width), measure.shown)
    if fault is not None:
        raise Unfitted(f"no lognormal can be fitted: {fault}")
    for _ in range(2):  # a narrow curve needs narrow panels
        outcomes = _outcomes(segments, width)
        (a,), (b,) = lognormal.fit(outcomes.alone())
        width = min(width, 1.0 / (_PER_DISPERSION * b))
    by_a, by_b = np.linalg.solve(_information(outcomes, a, b), _score_by_ends(ends, a, b))
    median = math.exp(-a / b)
    by_median = median * (a * by_b / b - by_a) / b
    by_dispersion = -by_b / (b * b)
    return MedianGradient(
        median=median,
        dispersion=1.0 / b,
        **{f"median_{name}": float(each) for name, each in zip(_BY, by_median, strict=True)},
        **{f"dispersion_{name}": float(each) for name, each in zip(_BY, by_dispersion, strict=True)},
        ends=ends,
        reason=reason,
        units=measure.units,
    )


def _ratios(at: Floats) -> tuple[Floats, Floats]:
    """Return the normal density over the probabilities below and above."""
    density, below, above = lognormal.logarithms(at)
    return np.exp(density - below), np.exp(density - above)


def _information(outcomes: Outcomes, a: float, b: float) -> Floats:
    """Minus the second derivatives of the likelihood by intercept and slope, as observed."""
    at = a + b * outcomes.z
    yes, no = _ratios(at)
    curvature = outcomes.trials * np.where(outcomes.exceeded > 0.0, yes * (yes + at), no * (no - at))
    powers = np.stack([np.ones_like(at), outcomes.z])
    return np.asarray(np.einsum("n,jn,kn->jk", curvature, powers, powers))


def _score_by_ends(ends: NDArray[np.void], a: float, b: float) -> Floats:
    """Change of the likelihood's gradient as ends of bands shift by p, slenderness and restitution, shape (2, 3)."""
    level: Floats = ends["level"]
    z = np.log(level)
    pull = np.where(ends["begins"], -1.0, 1.0) * sum(_ratios(a + b * z)) / level
    return np.asarray(np.stack([pull, pull * z]) @ np.stack([ends[name] for name in _BY], axis=1))
