"""Which blocks explain what was observed: overturned or not, over many motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.analysis.calibration.diagnostics import diagnosed
from rocking.analysis.calibration.evidence import unpacked
from rocking.analysis.calibration.result import ROUNDS, Calibration, Estimate, overturned_under
from rocking.analysis.calibration.search import Problem, posterior, search, systematic
from rocking.analysis.calibration.space import SIDED, Knowledge, Space
from rocking.arrays import Flags, Floats
from rocking.constants import Model
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.records.named import distinct_motions, several_motions

#: Chance that an outcome is not that of a rocking block at all (the specimen slid, was touched, was noted wrongly).
_LAPSE: Final = 0.005

#: Draws from the posterior over populations.
_DRAWS: Final = 512

#: Central share of the posterior between an estimate's lower and upper end.
_CENTRAL: Final = 0.9


def calibrate(
    motions: Sequence[Motion] | Mapping[str, Motion],
    overturned: ArrayLike,
    *,
    model: Model = "nonlinear",
    p: Knowledge = (1.0, 10.0),
    alpha: Knowledge = (0.02, 0.6),
    restitution: Knowledge = (0.3, 0.999),
    two_sided: bool = True,
    lapse: float = _LAPSE,
    candidates: int = 8192,
    ensemble: int = 1000,
    seed: int = 0,
    threads: int | None = None,
    progress: bool | None = None,
) -> Calibration:
    """Find the blocks that explain which motions overturned a specimen and which did not.

    Parameters
    ----------
    motions : sequence of Motion or mapping of str to Motion
        m motions, each of which the specimen met at rest.
    overturned : array_like of bool, shape (m,)
        Whether it overturned.
    model : {"nonlinear", "linear"}
        Equation of motion; the linear one is faster and serves slender specimens.
    p, alpha, restitution : float or pair of float
        A number, or a pair of equal ones, is known and kept, on both sides and in every test; a pair is the lowest and
        highest value that is thinkable on either side (rad/s; rad; -), with a prior that is even in the logarithm. A
        body of known size has p = ``Block(width=..., height=...).p``. The restitution may be "housner": it then
        follows from the slenderness as 1 - 1.5 sin(alpha)^2 (Housner 1963), and of two sides from those of a rectangle
        whose centre of mass is off the middle, whose p is that of the rectangle.
    two_sided : bool
        Whether the slendernesses of the two sides may differ, by a factor of 3 at most. p and restitution of a rigid
        body's sides differ by terms of second order in the slenderness only. By default they may, other than in
        `calibrate_history`: hardly any specimen leans alike to both sides, and outcomes alone would not show it.
    lapse : float
        Chance that an outcome is not that of a rocking block at all.
    candidates : int
        Blocks that are simulated under every motion, about; up to twice as many while runs disagree, or while few of
        them tell what a typical population does. A motion that is given several times is simulated once.
    ensemble : int
        Most blocks that are kept for predictions.
    seed : int
        The same seed gives the same result.
    threads : int, optional
        As for `simulate_many`.
    progress : bool, optional
        As for `simulate_many`.

    Returns
    -------
    Calibration
        Ensemble of blocks with weights, estimates, predictions for other motions.

    Raises
    ------
    InvalidOption
        If an argument is out of its range, everything is known, the numbers of motions and outcomes differ, or all
        outcomes are the same (they bound the block from one side only).

    Notes
    -----
    A specimen differs a little from test to test, and no rigid plane block is a real rock. So each test is taken to
    have its own block, drawn from a population that is lognormal in p, alpha, restitution and in the ratio of the
    sides' slendernesses. The probability of an outcome is the share of the population that behaves so (and a small
    lapse). The posterior over populations is drawn by sequential Monte Carlo (Del Moral, Doucet and Jasra 2006), with
    the prior that is given by the bounds and a lognormal prior on each dispersion (median 10 %).

    The search is global. Two independent runs each fill the bounds evenly, then try blocks where their own fits say. A
    candidate weighs what the density of candidates lacks, so that the prior stays what it was (deterministic mixture;
    Owen and Zhou 2000). What is left of a disagreement between the runs, few effective candidates, or a posterior that
    reaches a bound, is said in the summary.

    Two mirrored blocks often explain the outcomes equally well; then the estimates of each side are wide while the
    predictions are not.

    Examples
    --------
    A block is hidden behind forty outcomes:

    >>> import numpy as np, rocking
    >>> hidden = rocking.Block.from_parameters(p=3.0, alpha=0.15, restitution=0.9)
    >>> pulses = [rocking.pulses.one_sine(a, f) for a in range(1, 9) for f in (0.5, 1.0, 1.5, 2.0, 3.0)]
    >>> times = np.arange(0.0, 3.0, 0.02)
    >>> motions = [rocking.Motion.from_samples(one.acceleration(times), 0.02) for one in pulses]
    >>> overturned = [rocking.simulate(hidden, one, model="linear").overturned for one in motions]
    >>> found = rocking.calibrate(motions, overturned, model="linear", candidates=512, two_sided=False)
    >>> bool(np.mean((found.predict(motions) > 0.5) == overturned) > 0.9)
    True

    Where p and the restitution are known, the same tests tell the one angle that is not:

    >>> found = rocking.calibrate(
    ...     motions, overturned, model="linear", p=3.0, restitution=0.9, candidates=512, two_sided=False)
    >>> angle = found.estimates["alpha"]
    >>> angle.lower < hidden.alpha < angle.upper, angle.upper / angle.lower < 1.3
    (True, True)
    """
    tested = several_motions(motions)
    observed = checked_outcomes(overturned, len(tested))
    space = Space.of(p, alpha, restitution, two_sided=checks.flag(two_sided, "two_sided", InvalidOption))
    checks.share(lapse, "lapse", InvalidOption, below=0.5)
    checks.whole(candidates, "candidates", InvalidOption, 128)
    checks.whole(ensemble, "ensemble", InvalidOption, 1)
    rng = np.random.default_rng(checks.whole(seed, "seed", InvalidOption, 0))
    distinct, which = distinct_motions(tested)

    def tried(points: Floats) -> NDArray[np.float32]:
        return np.take(overturned_under(space.blocks(points), distinct, model, threads, progress), which, axis=1)

    found = search(Problem(space, observed, lapse, tried, threads), candidates, rng)
    evidence = found.evidence
    final = posterior(evidence, _DRAWS, ROUNDS, rng, progress=progress)
    weights = evidence.mean_weights(final)
    kept, times = np.unique(systematic(weights, ensemble, rng), return_counts=True)
    return Calibration(
        blocks=space.blocks(evidence.candidates.points[kept]),
        weights=times / ensemble,
        estimates=_estimates(space, final),
        draws=space.named(unpacked(final)[0]),
        probabilities=evidence.probabilities(final).mean(axis=0),
        observed=observed,
        model=model,
        lapse=lapse,
        seed=seed,
        diagnostics=diagnosed(found, final),
        _evidence=evidence,
    )


def _estimates(space: Space, populations: Floats) -> dict[str, Estimate]:
    centres, dispersions = unpacked(populations)
    sides = dispersions[:, : len(space.unknown)].copy()
    if space.two_sided:
        # The side's logarithm is that of the mean plus or minus half that of the ratio.
        sided = space.unknown.index(SIDED)
        sides[:, sided] = np.hypot(sides[:, sided], 0.5 * dispersions[:, -1])
    dispersion = dict(zip(space.unknown, sides.mean(axis=0).tolist(), strict=True))
    tails = (0.5, 0.5 * (1.0 - _CENTRAL), 0.5 * (1.0 + _CENTRAL))
    estimates = {}
    for name, values in space.named(centres).items():
        median, lower, upper = np.quantile(values, tails).tolist()
        estimates[name] = Estimate(median, lower, upper, dispersion[name.partition("_")[0]])
    return estimates


def checked_outcomes(overturned: ArrayLike, count: int) -> Flags:
    """Outcomes as an array that nobody can change: yes or no, one for each motion, and not all the same."""
    if np.ma.is_masked(overturned):
        raise InvalidOption("{} must be given for each motion, but some are masked", "overturned", value=overturned)
    values = np.asarray(overturned)
    if values.shape != (count,):
        raise InvalidOption(
            f"{{}} must hold one outcome for each of the {count} motions, not {values.shape}",
            "overturned",
            value=overturned,
        )
    if not np.all(np.isin(values, (0, 1))):
        raise InvalidOption("{} must hold True or False (or 1 or 0) for each motion", "overturned")
    observed = values.astype(bool)
    if observed.all() or not observed.any():
        raise InvalidOption(
            "the outcomes are all the same: calibration needs motions that overturn and motions that do not"
        )
    observed.flags.writeable = False
    return observed
