"""Calibration from a measured rotation history: least squares for p, alpha and restitution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import compress
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.block import Block
from rocking.block.friction import Friction
from rocking.calibration.space import (
    MAX_VALUES,
    NO_UNKNOWNS,
    PARAMETERS,
    Range,
    find_parameter_unit,
    is_known,
    parse_range,
)
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.core.progress import Progress
from rocking.core.result import Result
from rocking.core.tables import escape_dollars, format_count, format_table
from rocking.errors import OptionError
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.response.figure import choose_times
from rocking.response.sensitivity import compute_changes
from rocking.simulation.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Number of blocks at the start of the search.
_START_COUNT: Final = 2048

#: Successive shares of the history to fit, and number of best fits that continue. Over the whole history the misfit has
#: many local minima because impacts drift out of phase, over the first arcs few.
_FIT_STAGES: Final = ((0.15, 16), (0.3, 8), (0.6, 4), (1.0, 2))

#: Number of points then tried around the optimum, and widths of the clouds in standard errors.
_CLOUD_POINT_COUNT: Final = 64
_CLOUD_WIDTHS: Final = (6.0, 3.0, 1.5)


#: A sensitivity below this share of the largest counts as zero.
_INSENSITIVE_SLOPE: Final = 1e-7

#: Smallest step in the logarithms for differences of simulations, which are accurate to about 1e-12.
_MIN_STEP: Final = 1e-5


@dataclass(frozen=True)
class FittedParameter:
    """Fitted parameter.

    Attributes
    ----------
    value : float
        Estimate, in the parameter's unit.
    deviation : float
        Standard error.
    is_at_bound : bool
        Whether the fit reached a bound, which should then be widened.

    See Also
    --------
    rocking.calibrate_history : Fit a block to a rotation history.
    rocking.calibration.HistoryCalibration : Inspect the fitted block and its parameters.

    Examples
    --------
    >>> from rocking.calibration import FittedParameter
    >>> p = FittedParameter(value=2.5, deviation=0.05, is_at_bound=False)
    >>> f"p = {p.value:.2f} rad/s, coefficient of variation {p.deviation / p.value:.0%}"
    'p = 2.50 rad/s, coefficient of variation 2%'
    """

    value: float
    deviation: float
    is_at_bound: bool


@dataclass(frozen=True, eq=False, repr=False)
class HistoryCalibration(Result):
    """Block fitted to a rotation history, returned by `calibrate_history`.

    The figure shows the measured rotation, the fitted rotation, and the residuals.

    Attributes
    ----------
    block : Block
        Fitted block.
    estimates : mapping of str to FittedParameter
        Fitted parameters: "p" (rad/s), "alpha" (rad), "restitution" (with "_plus" and "_minus" for a two-sided block),
        "initial_rotation" (rad).
    covariance : ndarray, shape (k, k)
        Covariance of the logarithms of the estimates.
    times, residuals : ndarray, shape (n,)
        Times of the samples, s, and measured minus simulated rotation, rad.
    response : Response
        Simulation of the fitted block.

    See Also
    --------
    rocking.calibrate_history : Fit a block to a rotation history.

    Examples
    --------
    >>> import numpy as np, rocking
    >>> block, times = rocking.Block.from_parameters(p=2.5, alpha=0.2, restitution=0.9), np.arange(0.0, 4.0, 0.1)
    >>> rotation = rocking.simulate(block, None, initial_rotation=0.12, duration=4.0).rotation(times)
    >>> fitted = rocking.calibrate_history(times, rotation, alpha=0.2, restitution=0.9, initial_rotation=0.12)
    >>> f"p = {fitted.block.p:.3f} rad/s"
    'p = 2.500 rad/s'
    """

    block: Block
    estimates: Mapping[str, FittedParameter]
    covariance: Floats
    times: Floats
    residuals: Floats
    response: Response

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals, rad."""
        return math.sqrt(float(np.mean(self.residuals**2)))

    def summary(self) -> str:
        rows = []
        for name, fit in self.estimates.items():
            remark = "at its bound" if fit.is_at_bound else ""
            rows.append([name, fit.value, float(f"{fit.deviation:.2g}"), find_parameter_unit(name), remark])
        table = format_table(["parameter", "value", "std. error", "unit", ""], rows)
        return f"{table}\n\n{self._format_misfit()}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "model": self.response.model,
            "samples": len(self.residuals),
            "estimates": {name: asdict(fit) for name, fit in self.estimates.items()},
            "covariance_of_logarithms": self.covariance,
            "misfit_rad": self.misfit,
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import draw_measured_history

        simulated = self.response.rotation(np.minimum(self.times, self.response.duration))
        end = min(float(self.times[-1]), self.response.duration)
        fine_times = choose_times(self.response, float(self.times[0]), end)
        return draw_measured_history(
            time=self.times,
            measured=simulated + self.residuals,
            residual=self.residuals,
            fitted_time=fine_times,
            fitted=self.response.rotation(fine_times),
            title=title or escape_dollars(self._format_estimates()),
            ax=ax,
            figsize=figsize,
        )

    def _format_estimates(self) -> str:
        numbers = ((name, f"{fit.value:.4g} {find_parameter_unit(name)}") for name, fit in self.estimates.items())
        return ", ".join(f"{name.replace('_', ' ')} = {number.removesuffix(' 1')}" for name, number in numbers)

    def _format_headline(self) -> str:
        return f"{self._format_estimates()}; {self._format_misfit()}"

    def _format_misfit(self) -> str:
        return f"misfit {self.misfit:.3g} rad (root mean square) over {format_count(len(self.residuals), 'sample')}"


def calibrate_history(
    times: ArrayLike,
    rotation: ArrayLike,
    motion: Motion | None = None,
    *,
    model: Model = "nonlinear",
    p: float | Range = (1.0, 10.0),
    alpha: float | Range = (0.02, 0.6),
    restitution: float | Range = (0.3, 0.999),
    two_sided: bool = False,
    initial_rotation: float | None = None,
    seed: int = 0,
    friction: Friction | None = None,
) -> HistoryCalibration:
    """Fit a block to a measured rotation history, free or forced.

    Parameters
    ----------
    times : array_like, shape (n,)
        Times of the samples, s, nonnegative and increasing, from the release or the start of the motion.
    rotation : array_like, shape (n,)
        Measured rotation, rad, positive towards side +.
    motion : Motion, optional
        Measured motion of the base. By default the block was released and rocked freely.
    model : {"nonlinear", "linear"}
        Equation of motion.
    p, alpha, restitution : float or pair of float
        Known value, or lowest and highest plausible value (rad/s, rad, -).
    two_sided : bool
        Whether unknown parameters may differ between the sides. By default they may not, unlike in `calibrate`, because
        residuals show whether one value suffices.
    initial_rotation : float, optional
        Rotation of the held block at time 0, rad. By default fitted in a release test, and 0 under a motion.
    seed : optional
        As for `calibrate`.
    friction : float or pair, optional
        Known coefficient of friction, as for `simulate`; then all blocks are rectangles.

    Returns
    -------
    HistoryCalibration
        Fitted block with standard errors.

    Raises
    ------
    OptionError
        If an argument is out of range, there are too few samples, or the history does not determine a parameter.

    See Also
    --------
    rocking.calibrate : Fit blocks to the outcomes of tests.

    Notes
    -----
    The method is least squares in the logarithms of the parameters, with derivatives from `Sensitivity.rotation`. The
    search starts from 2048 blocks over the whole range and fits the best ones to 15, 30, 60 and 100 % of the history.
    Standard errors follow from the curvature at the optimum. They allow for residuals correlated in time, but not for a
    specimen that is not a rigid plane block.

    Examples
    --------
    >>> import numpy as np, rocking
    >>> hidden = rocking.Block.from_parameters(p=2.5, alpha=0.2, restitution=0.9)
    >>> times = np.arange(0.0, 4.0, 0.01)
    >>> measured = rocking.simulate(hidden, None, initial_rotation=0.12, duration=4.0).rotation(times)
    >>> noise = np.random.default_rng(1).normal(0.0, 1e-3, len(times))
    >>> f"{rocking.calibrate_history(times, measured + noise).estimates['p'].value:.2f}"
    '2.50'
    """
    sample_times, measured = _check_history(times, rotation)
    is_two_sided = checks.boolean(two_sided, "two_sided", OptionError)
    known, unknowns = _split_parameters({"p": p, "alpha": alpha, "restitution": restitution}, is_two_sided)
    if initial_rotation is not None:
        known["initial_rotation"] = checks.finite(initial_rotation, "initial_rotation", OptionError)
    elif motion is not None:
        known["initial_rotation"] = 0.0
    else:
        unknowns.append(_bound_initial_rotation(measured))
    if not unknowns:
        raise OptionError(NO_UNKNOWNS)
    if len(sample_times) < 2 * len(unknowns):
        counts = format_count(len(sample_times), "sample"), format_count(len(unknowns), "parameter")
        raise OptionError(f"{counts[0]} cannot determine {counts[1]}: provide more")
    problem = _Problem(sample_times, measured, motion, model, known, tuple(unknowns), friction)
    rng = np.random.default_rng(checks.integer(seed, "seed", OptionError, 0))
    return _create_calibration(problem, _fit(problem, rng))


def _check_history(times: ArrayLike, rotation: ArrayLike) -> tuple[Floats, Floats]:
    """Check the times and rotations of a history, and copy them."""
    sample_times = np.array(checks.numbers(times, "times", OptionError))
    measured = np.array(checks.numbers(rotation, "rotation", OptionError))
    if sample_times.ndim != 1 or sample_times.shape != measured.shape:
        shapes = f"{sample_times.shape} and {measured.shape}"
        raise OptionError(f"times and rotations must have the same shape; got {shapes}")
    if not (np.all(np.isfinite(sample_times)) and np.all(np.isfinite(measured))):
        raise OptionError("{} and {} must be finite; remove missing samples", "times", "rotation")
    if not len(sample_times) or sample_times[0] < 0.0 or not np.all(np.diff(sample_times) > 0.0):
        raise OptionError("{} must be nonnegative and increasing", "times")
    if not np.any(measured) or np.abs(measured).max() >= 0.5 * math.pi:
        raise OptionError("{} must be in rad, below pi/2 in size, and not zero throughout", "rotation")
    return sample_times, measured


@dataclass(frozen=True)
class _Unknown:
    """Unknown parameter between two bounds, with the `sign` of its value."""

    name: str
    low: float
    high: float
    sign: float = 1.0


@dataclass(frozen=True, eq=False)
class _Problem:
    """History, known parameters of the block by name, and unknown parameters."""

    times: Floats
    rotation: Floats
    motion: Motion | None
    model: Model
    known: Mapping[str, float]
    unknowns: tuple[_Unknown, ...]
    friction: Friction | None = None

    def count_samples(self, share: float) -> int:
        """Count the samples up to this share of the integral of |rotation|."""
        cumulative = np.cumsum(np.abs(self.rotation) * np.gradient(self.times))
        return int(np.searchsorted(cumulative, share * cumulative[-1])) + 1

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Logarithms of the lower and upper bounds of the unknowns."""
        low, high = np.log([[unknown.low, unknown.high] for unknown in self.unknowns]).T
        return low, high

    def compute_values(self, logs: Floats) -> dict[str, float]:
        """Return all parameters by name, known and unknown."""
        fitted = {unknown.name: unknown.sign * math.exp(log) for unknown, log in zip(self.unknowns, logs, strict=True)}
        return {**self.known, **fitted}

    def create_block(self, logs: Floats) -> Block:
        values = self.compute_values(logs)
        p, alpha, restitution = (
            values[name] if name in values else [values[f"{name}_plus"], values[f"{name}_minus"]] for name in PARAMETERS
        )
        return Block.from_parameters(p, alpha, restitution)

    def simulate(self, logs: Floats, end: float) -> Response:
        start = self.compute_values(logs)["initial_rotation"]
        options: dict[str, Any] = {"model": self.model, "duration": end, "friction": self.friction}
        return simulate(self.create_block(logs), self.motion, initial_rotation=start, **options)

    def compute_residuals(self, logs: Floats, count: int) -> Floats:
        """Compute measured minus simulated rotation of the first samples, with overturned blocks at pi/2."""
        times = self.times[:count]
        response = self.simulate(logs, float(times[-1]))
        return self.rotation[:count] - response.rotation(np.minimum(times, response.duration))

    def compute_jacobian(self, logs: Floats, count: int) -> Floats:
        """Compute the Jacobian of the residuals in the logarithms, shape (count, k)."""
        times = self.times[:count]
        response = self.simulate(logs, float(times[-1]))
        is_overturned = times > response.duration
        changes = compute_changes(response._history, times[~is_overturned], [unknown.name for unknown in self.unknowns])
        jacobian = np.zeros((count, len(logs)))
        jacobian[~is_overturned] = -np.column_stack([changes[unknown.name] for unknown in self.unknowns])
        return jacobian

    def compute_squared_error(self, logs: Floats, count: int) -> float:
        """Compute the sum of the squared residuals of the first samples."""
        return float((self.compute_residuals(logs, count) ** 2).sum())


def _split_parameters(inputs: Mapping[str, float | Range], two_sided: bool) -> tuple[dict[str, float], list[_Unknown]]:
    """Separate the known parameters of a block from the unknown ones."""
    known, unknowns = {}, []
    for name, value in inputs.items():
        if is_known(value):
            known[name] = checks.positive(np.ravel(value)[0], name, OptionError)
            continue
        low, high = parse_range(value, name, MAX_VALUES[name])
        sides = ("_plus", "_minus") if two_sided else ("",)
        unknowns += [_Unknown(name + side, low, high) for side in sides]
    return known, unknowns


def _bound_initial_rotation(rotation: Floats) -> _Unknown:
    """Return the unknown initial rotation with bounds around the first sample."""
    first = float(rotation[0])
    if abs(first) < 0.05 * np.abs(rotation).max():
        raise OptionError("a release test must start at the rotation of the release; set {}", "initial_rotation")
    return _Unknown("initial_rotation", 0.5 * abs(first), min(2.0 * abs(first), 1.57), math.copysign(1.0, first))


def _fit(problem: _Problem, rng: np.random.Generator) -> Floats:
    """Find the logarithms of the unknowns with the least squares over the whole history."""
    from scipy.stats import qmc

    low, high = problem.bounds
    survivors = qmc.scale(qmc.Halton(len(low), rng=rng).random(_START_COUNT), low, high)
    sample_count = len(problem.times)
    with Progress("fitting", sum(survivor_count for _, survivor_count in _FIT_STAGES) + len(_CLOUD_WIDTHS)) as bar:
        for share, survivor_count in _FIT_STAGES:
            count = min(max(problem.count_samples(share), 2 * len(low)), sample_count)
            errors = [problem.compute_squared_error(logs, count) for logs in survivors]
            optima = []
            for logs in survivors[np.argsort(errors, kind="stable")[:survivor_count]]:
                optima.append(_descend(problem, logs, count))
                bar.advance(1)
            survivors = np.array(optima)
        optimum = min(survivors, key=lambda logs: problem.compute_squared_error(logs, sample_count))
        for width in _CLOUD_WIDTHS:
            optimum = _search_nearby(problem, optimum, width, rng)
            bar.advance(1)
    return np.asarray(optimum, dtype=np.float64)


def _descend(problem: _Problem, start: Floats, count: int) -> Floats:
    from scipy.optimize import least_squares

    low, high = problem.bounds
    fit = least_squares(problem.compute_residuals, start, problem.compute_jacobian, (low, high), args=(count,))
    return np.asarray(fit.x, dtype=np.float64)


def _search_nearby(problem: _Problem, optimum: Floats, width: float, rng: np.random.Generator) -> Floats:
    """Search within `width` standard errors of an optimum, because a forced response can be rugged on that scale."""
    sample_count = len(problem.times)
    covariance = _compute_covariance(problem, optimum, problem.compute_residuals(optimum, sample_count))
    offsets = rng.multivariate_normal(np.zeros(len(optimum)), covariance, _CLOUD_POINT_COUNT, method="cholesky")
    cloud = np.clip(optimum + width * offsets, *problem.bounds)

    def compute_error(logs: Floats) -> float:
        return problem.compute_squared_error(logs, sample_count)

    return min(optimum, _descend(problem, min(cloud, key=compute_error), sample_count), key=compute_error)


def _create_calibration(problem: _Problem, logs: Floats) -> HistoryCalibration:
    count = len(problem.times)
    residuals = problem.compute_residuals(logs, count)
    covariance = _compute_covariance(problem, logs, residuals)
    estimates, bounds = {}, np.transpose(problem.bounds)
    for unknown, log, variance, ends in zip(problem.unknowns, logs, np.diag(covariance), bounds, strict=True):
        is_at_bound = bool(np.abs(log - ends).min() < 1e-6)
        value, deviation = math.exp(log), math.exp(log) * math.sqrt(variance)
        estimates[unknown.name] = FittedParameter(unknown.sign * value, deviation, is_at_bound)
    response = problem.simulate(logs, float(problem.times[-1]))
    return HistoryCalibration(problem.create_block(logs), estimates, covariance, problem.times, residuals, response)


def _compute_covariance(problem: _Problem, logs: Floats, residuals: Floats) -> Floats:
    """Compute the covariance of the logarithms: inverse curvature times variance of the autocorrelated residuals."""
    variance = float((residuals**2).sum()) / (len(residuals) - len(logs)) * _integrate_autocorrelation(residuals)
    slopes = _compute_slopes(problem, logs, math.sqrt(variance))
    norms = np.linalg.norm(slopes, axis=0)
    names = [unknown.name for unknown in problem.unknowns]
    if undetermined := ", ".join(compress(names, norms <= _INSENSITIVE_SLOPE * norms.max())):
        raise OptionError(f"the history does not determine {undetermined}: set a value, or use a longer history")
    _, singular_values, right_vectors = np.linalg.svd(slopes / norms, full_matrices=False)
    if singular_values[-1] <= _INSENSITIVE_SLOPE * singular_values[0]:
        raise OptionError(f"the history does not distinguish {', '.join(names)}: set the value of one")
    return np.asarray(variance * (right_vectors.T / singular_values**2) @ right_vectors / np.outer(norms, norms))


def _compute_slopes(problem: _Problem, logs: Floats, deviation: float) -> Floats:
    """Differentiate the residuals, shape (n, k), by differences over about one standard error, because of jumps."""
    count, low, high = len(problem.times), *problem.bounds
    columns = []
    for k in range(len(logs)):
        step = _MIN_STEP
        for _ in range(4):
            ahead, behind = logs.copy(), logs.copy()
            ahead[k], behind[k] = min(logs[k] + step, high[k]), max(logs[k] - step, low[k])
            change = problem.compute_residuals(ahead, count) - problem.compute_residuals(behind, count)
            slope = change / (ahead[k] - behind[k])
            step = float(np.clip(deviation / max(float(np.linalg.norm(slope)), 1e-300), _MIN_STEP, 0.05))
        columns.append(slope)
    return np.array(columns).T


def _integrate_autocorrelation(residuals: Floats) -> float:
    """Compute 1 + 2 times the sum of the autocorrelations up to the first nonpositive one."""
    size = 2 * len(residuals)
    power = np.abs(np.fft.rfft(residuals, size)) ** 2
    correlation = np.fft.irfft(power, size)[: len(residuals)]
    if correlation[0] == 0.0:
        return 1.0
    positive = correlation[1:] > 0.0
    lag_count = len(positive) if positive.all() else int(np.argmin(positive))
    return 1.0 + 2.0 * float(correlation[1 : lag_count + 1].sum() / correlation[0])
