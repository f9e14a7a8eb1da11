"""What blocks predict of tests: how probably each overturns the specimen, and how large the rotation is if not.

The blocks stand for one specimen that is not quite known, or that is not quite the same from test to test: draws from a
population, with weights. Each is simulated under every motion once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.calibration.evidence import blurred, expected_share
from rocking.analysis.calibration.result import Calibration, Validation
from rocking.analysis.levels import mean_one, note_missing, pooled, ratios_of
from rocking.analysis.validation.tested import Observed
from rocking.arrays import Floats, Integers
from rocking.body import Bodies, Body
from rocking.constants import Model
from rocking.ensemble import simulate_many
from rocking.errors import InvalidOption
from rocking.problem import bodies_of, slenderness_of
from rocking.tables import counted

#: What can predict tests of one specimen.
Source = Calibration | Validation | Bodies | Body | Sequence[Body]

#: Equally probable errors that stand for a normal one, for each block; of few blocks more, so many points in all.
_ERRORS: Final = 16
_POINTS: Final = 1024


@dataclass(frozen=True, eq=False)
class Predicted:
    """Outcomes of n blocks under m tests of one specimen, their weights, which sum to 1, and what they say of a test.

    Attributes
    ----------
    probabilities : ndarray, shape (m,)
        Probability that a test is noted as overturned.
    tests : ndarray of int, shape (m,)
        Positions of the tests.
    weights : ndarray, shape (n,)
        Weights of the blocks; n is 0 where probabilities are all that is known.
    peaks : ndarray, shape (n, m)
        Largest rotation, rad; infinite where the block overturns.
    deviation : float
        Standard deviation of a measured peak, rad.
    """

    probabilities: Floats
    tests: Integers
    weights: Floats
    peaks: Floats
    deviation: float = 0.0

    @property
    def has_blocks(self) -> bool:
        """Whether more than probabilities is known."""
        return len(self.weights) > 0

    @cached_property
    def errors(self) -> Floats:
        """Equally probable errors of a measured peak, rad."""
        if self.deviation == 0.0:
            return np.zeros(1)
        from scipy.special import ndtri

        count = max(_ERRORS, _POINTS // max(len(self.weights), 1))
        return np.asarray(self.deviation * ndtri((np.arange(count) + 0.5) / count))

    def standing(self, k: int) -> tuple[Floats, Floats] | None:
        """Possible measured peaks of the blocks that stand in test k, in order, and their weights; None without any."""
        values = np.maximum(self.peaks[:, k, None] + self.errors, 0.0).ravel()  # a size, whatever its error
        weights = np.repeat(self.weights / len(self.errors), len(self.errors))
        order = np.argsort(values, kind="stable")
        order = order[np.isfinite(values[order]) & (weights[order] > 0.0)]
        return (values[order], weights[order] / weights[order].sum()) if len(order) else None


@dataclass(frozen=True)
class Prediction:
    """Predictions of all tests: of each specimen, and in words from what."""

    of_specimens: tuple[Predicted, ...]
    description: str
    model: str

    @property
    def probabilities(self) -> Floats:
        """Probability that each test overturns its specimen, in the order of the tests."""
        found = np.empty(sum(len(one.tests) for one in self.of_specimens))
        for one in self.of_specimens:
            found[one.tests] = one.probabilities
        return found


def predicted(
    tests: Observed,
    sources: Source | Mapping[str, Source],
    *,
    weights: ArrayLike | Mapping[str, ArrayLike] | None,
    model: Model | None,
    lapse: float | None,
    deviation: float,
    threads: int | None,
    progress: bool | None,
) -> Prediction:
    """Simulate the blocks of each specimen under its tests."""
    if isinstance(sources, Mapping):
        missing = [name for name in tests.names if name not in sources]
        if missing:
            raise InvalidOption(
                f"{{}} have nothing for the specimen {missing[0]!r} of the tests; they have "
                f"{', '.join(map(repr, sources)) or 'none'}",
                "blocks",
            )
        if weights is not None and not isinstance(weights, Mapping):
            raise InvalidOption("{} of several specimens must be a mapping like {}", "weights", "blocks")
        unknown = [name for name in weights or {} if name not in sources]
        if unknown:
            raise InvalidOption(
                f"{{}} have {unknown[0]!r}, for which {{}} have nothing: name a specimen of these",
                "weights",
                "blocks",
            )
        chosen = {name: (sources[name], (weights or {}).get(name)) for name in tests.names}
        where = {name: np.flatnonzero(tests.specimens == k) for k, name in enumerate(tests.names)}
    else:
        if isinstance(weights, Mapping):
            raise InvalidOption(
                "{} are a mapping, and {} are none: make both mappings by specimen", "weights", "blocks"
            )
        chosen, where = {"": (sources, weights)}, {"": np.arange(len(tests.overturned))}
    found, words, models = [], {}, {}
    for name, (source, own) in chosen.items():
        if isinstance(source, Validation):
            if lapse is not None and len(chosen) == 1:
                raise InvalidOption("predictions of tests that were left out have their own {}: leave it out", "lapse")
            found.append(_left_out(source, own, tests, where[name]))
            words[name], models[name] = "predictions of tests that were left out", ""
            continue
        how: Model = model or (source.model if isinstance(source, Calibration) else "nonlinear")
        shared = {"lapse": lapse, "deviation": deviation, "threads": threads, "progress": progress}
        found.append(_simulated(source, own, tests, where[name], how, **shared))  # type: ignore[arg-type]
        words[name], models[name] = _described(source, own), how
    several = [f"{name}: {text}" for name, text in words.items()] if len(words) > 1 else [*words.values()]
    known = sorted({each for each in models.values() if each})
    return Prediction(tuple(found), "; ".join(several), " and ".join(known))


def _simulated(
    source: Calibration | Bodies | Body | Sequence[Body],
    weights: ArrayLike | None,
    tests: Observed,
    where: Integers,
    model: Model,
    *,
    lapse: float | None,
    deviation: float,
    threads: int | None,
    progress: bool | None,
) -> Predicted:
    if isinstance(source, Calibration):
        if weights is not None:
            raise InvalidOption("a calibration has {} of its own: leave them out", "weights")
        bodies: Bodies = source.blocks
        shares, effective = source.weights / source.weights.sum(), source.diagnostics.effective
        lapse = source.lapse if lapse is None else lapse
    else:
        bodies = bodies_of(source)
        slenderness_of(bodies)  # refused before the work
        shares = mean_one(weights, len(bodies)) / len(bodies)
        effective = math.inf if len(bodies) == 1 else 1.0 / float((shares**2).sum())
    needed, which = np.unique(tests.which[where], return_inverse=True)
    motions = [tests.distinct[k] for k in needed]
    simulated = simulate_many(bodies, motions, model=model, threads=threads, progress=progress)
    peak, fell, missing = (
        simulated[name].transpose("block", "motion").values for name in ("peak_rotation", "overturned", "unfinished")
    )
    note_missing(missing)
    peaks = ratios_of(peak, fell, missing, 1.0)[:, which]
    share = shares @ np.where(np.isnan(peaks), 0.5, np.isinf(peaks).astype(np.float64))
    expected = share if math.isinf(effective) else expected_share(share, effective)
    lapse = 0.0 if lapse is None else lapse
    # A sum of weights may be a rounding above 1.
    probabilities = np.clip(blurred(expected, lapse), 0.0, 1.0)
    return Predicted(probabilities, where, shares, peaks, deviation)


def _left_out(source: Validation, weights: object, tests: Observed, where: Integers) -> Predicted:
    if weights is not None:
        raise InvalidOption("predictions of tests that were left out have no blocks: leave {} out", "weights")
    count = source.probabilities.shape[1]
    if count != len(where):
        raise InvalidOption(
            f"the predictions are of {counted(count, 'test')}, and {counted(len(where), 'test')} are given: "
            "{} must be those of the calibration, in their order",
            "tests",
        )
    return Predicted(source.probabilities.mean(axis=0), where, np.empty(0), np.empty((0, count)))


def _described(source: Calibration | Bodies | Body | Sequence[Body], weights: ArrayLike | None) -> str:
    if isinstance(source, Calibration):
        return f"calibration, {counted(len(source.blocks), 'block')}"
    return pooled(source, weights)
