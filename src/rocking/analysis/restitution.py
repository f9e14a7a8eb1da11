"""Which law of restitution tests of free rocking prefer: from the times of their impacts, by an information criterion.

Between two impacts a block that rocks freely keeps its energy. So the time between them tells the speed with which it
left the first and met the second, and the quotient of two such speeds is the factor of the impact between them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block, impact_restitution, one_block
from rocking.constants import MODELS, Model
from rocking.errors import InvalidBlock, InvalidOption
from rocking.result import DrawnResult
from rocking.tables import as_written, counted, text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Highest rotations, over the slenderness, between which times are tabulated; how many; points of their quadrature.
_HEIGHTS: Final = (1e-5, 1.0 - 1e-6)
_TABULATED: Final = 1500
_NODES: Final = 48

#: Most points at which a base is taken to meet the ground.
_MOST_POINTS: Final = 12

#: How often a search starts again from where it ended.
_SEARCHES: Final = 2

#: How many laws are drawn at most. Those that differ by less than this are drawn as one, the preferred one.
_DRAWN: Final = 4
_SAME: Final = 1e-4

#: Least factor that is thinkable.
_LEAST: Final = 0.05

#: Parameters of the laws with the most.
_MOST_PARAMETERS: Final = 3

#: Logarithm of the factor, and its variance, from the speeds of impact and the parameters of a law.
_Moments = Callable[[Floats, Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class LawFit:
    """One law of restitution as it fits tests best.

    Attributes
    ----------
    name : str
        Its name.
    estimates : mapping of str to float
        Its parameters by name: factors, and the slope in s/rad.
    log_likelihood : float
        Logarithm of the largest likelihood.
    criterion : float
        Bayesian information criterion, the least of which is preferred.
    weight : float
        Share of the evidence: exp(-criterion/2) over the sum of all laws.
    misfit : float
        Root mean square of the residuals over what the law and the timing allow: about 1 where both hold.
    """

    name: str
    estimates: Mapping[str, float]
    log_likelihood: float
    criterion: float
    weight: float
    misfit: float


@dataclass(frozen=True, eq=False, repr=False)
class RestitutionComparison(DrawnResult):
    """Laws of restitution side by side; from `compare_restitution`.

    Its figure has the measured factors over the speed of the impact, and the four laws that explain them best.

    Attributes
    ----------
    laws : tuple of LawFit
        The preferred one first.
    speeds, factors, deviations : ndarray, shape (n,)
        Speed before each impact, rad/s, the factor there, and its standard error by the timing.
    block : Block
        The block.
    tests : int
        Number of tests.
    """

    laws: tuple[LawFit, ...]
    speeds: Floats
    factors: Floats
    deviations: Floats
    block: Block
    tests: int

    def summary(self) -> str:
        rows = [
            [
                law.name,
                ", ".join(f"{name} {value:.4g}" for name, value in law.estimates.items()) or "-",
                f"{law.criterion - self.laws[0].criterion:.1f}",
                f"{law.weight:.3f}",
                f"{law.misfit:.2f}",
            ]
            for law in self.laws
        ]
        table = text_table(["law", "estimates", "criterion over the least", "weight", "misfit"], rows)
        return f"{self._headline()}\n\n{table}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "tests": self.tests,
            "speeds_rad_per_s": self.speeds,
            "factors": self.factors,
            "deviations": self.deviations,
            "laws": [
                {
                    "name": law.name, "estimates": dict(law.estimates), "log_likelihood": law.log_likelihood,
                    "criterion": law.criterion, "weight": law.weight, "misfit": law.misfit,
                }
                for law in self.laws
            ],
        }  # fmt: skip

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.calibration import factors_figure

        at = np.linspace(0.0, 1.05 * float(self.speeds.max()), 200)
        made = _laws(self.block)
        curves: dict[str, tuple[Floats, Floats, Floats]] = {}
        for law in self.laws:
            middle, variance = made[law.name].moments(np.array([*law.estimates.values()]), at)
            curve = at, np.exp(middle), np.exp(middle) * np.sqrt(3.0 * variance)
            if all(np.abs(np.subtract(curve, drawn)).max() > _SAME for drawn in curves.values()):
                curves[law.name] = curve
        return factors_figure(
            speed=self.speeds,
            factor=self.factors,
            deviation=self.deviations,
            curves=dict([*curves.items()][:_DRAWN]),
            title=title or as_written(self._headline()),
            ax=ax,
            figsize=figsize,
        )

    def _headline(self) -> str:
        what = f"{counted(len(self.factors), 'impact')} of {counted(self.tests, 'test')}"
        return f"{what} prefer the law: {self.laws[0].name}"


def compare_restitution(
    tests: Sequence[ArrayLike], block: Block, *, timing: float = 1e-3, model: Model = "nonlinear"
) -> RestitutionComparison:
    """Compare laws of restitution by how well they explain the times of impacts in free rocking.

    Parameters
    ----------
    tests : sequence of array_like
        Of each test the times of its impacts, s, increasing, three at least.
    block : Block
        What rocked, one rigid body with equal sides; its restitution is not used.
    timing : float
        Standard deviation of the error of a time, s.
    model : {"nonlinear", "linear"}
        Equation of motion.

    Returns
    -------
    RestitutionComparison
        Housner's law, of a rectangle 1 - 1.5 sin(alpha)^2; impulses on a narrower contact; several points in turn; a
        constant; one that falls with the speed; one that is drawn. Where the first three give less than 0.05, or say
        that a stocky block would not rock on, they count as 0.05.

    Raises
    ------
    InvalidBlock
        If the block is none.
    InvalidOption
        If an argument is out of its range, or impacts are farther apart than those of the block can be.

    Notes
    -----
    The logarithms of the factors are taken to be normal: their errors are those of the times, to first order and with
    their correlation between neighbours, and a factor that is drawn adds the variance of its distribution. Laws are
    compared by the Bayesian information criterion, -2 ln(likelihood) + k ln(n) with k parameters and n impacts. It
    approximates the marginal likelihood of a law under a prior that is worth one impact, and so needs no prior that a
    user would have to defend; its penalty grows with n, so that a law with a parameter too many is left in the end,
    which Akaike's criterion does not do. It trusts `timing`: where every misfit is far above 1, that is too small or
    the block is another.

    References
    ----------
    G. Schwarz, "Estimating the dimension of a model", Annals of Statistics 6 (1978). G. W. Housner, "The behavior of
    inverted pendulum structures during earthquakes", Bulletin of the Seismological Society of America 53 (1963).

    Examples
    --------
    >>> import rocking
    >>> column = rocking.Block(width=0.4, height=2.0)
    >>> worn = rocking.RestrainedBlock(column, restitution=rocking.FallingRestitution(0.96, 0.15, least=0.7))
    >>> runs = [rocking.simulate(worn, None, initial_rotation=start) for start in (0.08, 0.12, 0.16)]
    >>> found = compare_restitution([run.impacts["time"][:12] for run in runs], column, timing=1e-3)
    >>> found.laws[0].name, round(found.laws[0].estimates["slope"], 2)
    ('falling with the speed', 0.15)
    """
    one = one_block(block)
    if one.sides[0].alpha != one.sides[1].alpha or one.sides[0].p != one.sides[1].p:
        raise InvalidOption("the {} must have equal sides, so that a time tells a speed on both", "block")
    if one.sides[0].arm is not None:
        raise InvalidOption("the {} must be one rigid body: laws of angular momentum are of no frame", "block")
    error = checks.positive(timing, "timing", InvalidOption, "s")
    checks.one_of(model, "model", InvalidOption, MODELS)
    speed_of = _speeds(one, model)
    given = checks.several(tests, "tests", InvalidOption)
    made = [_factors(_times(each, k), speed_of, error) for k, each in enumerate(given)]
    if not made:
        raise InvalidOption("give at least one of {}: the times of its impacts, s", "tests")
    known = sum(len(test.logs) for test in made)
    if known <= _MOST_PARAMETERS:
        raise InvalidOption(
            f"laws have up to {_MOST_PARAMETERS} parameters, and the {{}} tell {counted(known, 'factor')} of "
            "restitution, one for each impact between two others: give more impacts",
            "tests",
        )
    fits = [_fitted(name, law, made) for name, law in _laws(one).items()]
    least = min(fit.criterion for fit in fits)
    shares = np.exp([-0.5 * (fit.criterion - least) for fit in fits])
    weighted = [
        LawFit(fit.name, fit.estimates, fit.log_likelihood, fit.criterion, float(share), fit.misfit)
        for fit, share in zip(fits, shares / shares.sum(), strict=True)
    ]
    logs = np.concatenate([test.logs for test in made])
    return RestitutionComparison(
        laws=tuple(sorted(weighted, key=lambda fit: fit.criterion)),
        speeds=np.concatenate([test.speeds for test in made]),
        factors=np.exp(logs),
        deviations=np.exp(logs) * np.sqrt(np.concatenate([np.diag(test.covariance) for test in made])),
        block=one,
        tests=len(made),
    )


# ---- Factors from times ----


@dataclass(frozen=True, eq=False)
class _Test:
    """Speeds before the impacts of a test, logarithms of the factors there, and the covariance of these by timing."""

    speeds: Floats
    logs: Floats
    covariance: Floats


def _times(given: ArrayLike, k: int) -> Floats:
    times = checks.numbers(given, "tests", InvalidOption)
    if times.ndim != 1 or len(times) < 3 or not np.all(np.isfinite(times)) or not np.all(np.diff(times) > 0.0):
        raise InvalidOption(f"each of {{}} must hold three increasing times or more, s; test {k} does not", "tests")
    return times


def _speeds(block: Block, model: Model) -> Callable[[Floats], tuple[Floats, Floats]]:
    """Return what finds the logarithms of speeds, and their slopes by the time, from times between impacts."""
    from scipy.interpolate import CubicSpline

    p, alpha = block.sides[0].p, block.sides[0].alpha
    share = np.concatenate([np.geomspace(_HEIGHTS[0], 0.5, _TABULATED), 1.0 - np.geomspace(0.5, 1e-6, _TABULATED)[1:]])
    if model == "linear":
        speed = p * alpha * np.sqrt(share * (2.0 - share))
        time = 2.0 / p * np.arctanh(speed / (p * alpha))
    else:
        highest = share * alpha
        # With u = highest (1 - x^2) the integrand of the time has no singularity at the top.
        x, weight = np.polynomial.legendre.leggauss(_NODES)
        # Near balance most of the time is spent near the top: x = y^3 has more nodes there.
        y, weight = 0.5 * (x + 1.0), 0.5 * weight
        at, slope = y**3, 3.0 * y**2
        below = highest[:, None] * at**2
        pull = np.sin(alpha - highest[:, None] + 0.5 * below) * np.sin(0.5 * below)
        time = 2.0 / p * ((highest[:, None] * at * slope / np.sqrt(pull)) @ weight)
        speed = p * np.sqrt(4.0 * np.sin(alpha - 0.5 * highest) * np.sin(0.5 * highest))
    spline = CubicSpline(np.log(time), np.log(speed))

    def found(times: Floats) -> tuple[Floats, Floats]:
        if np.any(times > time[-1]):
            raise InvalidOption(
                f"impacts {times.max():.4g} s apart are farther than this block's can be: {time[-1]:.4g} s; "
                "give another {}",
                "block",
            )
        logs = np.log(times)
        inside = np.maximum(logs, math.log(time[0]))
        # The speed of a very small arc is in proportion to its time.
        return spline(inside) + (logs - inside), np.where(logs < inside, 1.0, spline(inside, 1)) / times

    return found


def _factors(times: Floats, speed_of: Callable[[Floats], tuple[Floats, Floats]], error: float) -> _Test:
    between = np.diff(times)
    logs, slopes = speed_of(between)
    count = len(between)
    by_time = slopes[:, None] * (np.eye(count, count + 1, 1) - np.eye(count, count + 1))
    change = by_time[1:] - by_time[:-1]
    return _Test(np.exp(logs[:-1]), np.diff(logs), error**2 * change @ change.T)


# ---- Laws ----


@dataclass(frozen=True, eq=False)
class _Law:
    """A law: names and bounds of its parameters, what a search for them starts from, and the moments of ln(factor)."""

    names: tuple[str, ...]
    bounds: tuple[tuple[float, float], ...]
    starts: Callable[[Floats, Floats], list[list[float]]]
    moments: _Moments


def _laws(block: Block) -> dict[str, _Law]:
    natural = block.sides[0].p * block.sides[0].alpha
    factor, share = (_LEAST, 1.0), (1e-3, 1.0)
    at_the_pivot = _by_momentum(block)
    return {
        "angular momentum (Housner)": _Law((), (), lambda w, e: [[]], lambda x, w: _even(at_the_pivot, w)),
        "narrow contact": _Law(
            *(("contact",), (share,), lambda w, e: [[0.2], [0.8]]),
            lambda x, w: _even(_by_momentum(block, contact=float(x[0])), w),
        ),
        "several points": _Law(
            *(("points",), (), lambda w, e: [[float(n)] for n in range(2, _MOST_POINTS + 1)]),
            lambda x, w: _even(_by_momentum(block, points=int(x[0])), w),
        ),
        "constant": _Law(
            ("factor",), (factor,), lambda w, e: [[float(np.median(e))]], lambda x, w: _even(float(x[0]), w)
        ),
        "falling with the speed": _Law(
            ("largest", "slope", "least"), (factor, (0.0, 3.0 / natural), factor), _starts_of_falling, _falling
        ),
        "drawn at each impact": _Law(
            *(("least", "largest"), (factor, factor)),
            *(lambda w, e: [[float(q) for q in np.quantile(e, ends)] for ends in ((0.0, 1.0), (0.4, 0.6))], _drawn),
        ),
    }


def _by_momentum(block: Block, **impulses: Any) -> float:
    """Restitution by angular momentum; `_LEAST` where a stocky block would not rock on, which it did in the tests."""
    side = block.sides[0]
    half_width = side.radius * math.sin(side.alpha)
    sizes: dict[str, Any] = {
        "distances": (half_width, half_width),
        "height": side.radius * math.cos(side.alpha),
        "radius_of_gyration": math.sqrt(block.gravity * side.radius / side.p**2 - side.radius**2),
    }
    try:
        return max(impact_restitution(**sizes, **impulses)[0], _LEAST)
    except InvalidBlock:
        return _LEAST


def _even(e: float, speeds: Floats) -> tuple[Floats, Floats]:
    return np.full(len(speeds), math.log(e)), np.zeros(len(speeds))


def _falling(values: Floats, speeds: Floats) -> tuple[Floats, Floats]:
    largest, slope, least = values
    return np.log(np.maximum(min(least, largest), largest - slope * speeds)), np.zeros(len(speeds))


def _starts_of_falling(speeds: Floats, factors: Floats) -> list[list[float]]:
    apart = speeds - speeds.mean()
    # Speeds that are all alike tell no slope.
    falls = max(0.0, -float(apart @ factors) / max(float(apart @ apart), 1e-12 * float(speeds @ speeds)))
    low, largest = float(factors.min()), float(factors.mean() + falls * speeds.mean())
    return [[largest, falls * more, low * below] for more in (1.0, 2.0) for below in (0.8, 1.0)]


def _drawn(values: Floats, speeds: Floats) -> tuple[Floats, Floats]:
    middle, width = 0.5 * float(values[0] + values[1]), float(values[1] - values[0])
    return np.full(len(speeds), math.log(middle)), np.full(len(speeds), width**2 / (12.0 * middle**2))


def _log_likelihood(law: _Law, values: Floats, tests: Sequence[_Test]) -> tuple[float, float]:
    """Logarithm of the likelihood, and the sum of the squares of the residuals over what is allowed."""
    total = squares = 0.0
    for test in tests:
        middle, variance = law.moments(values, test.speeds)
        root = np.linalg.cholesky(test.covariance + np.diag(variance))
        scaled = np.linalg.solve(root, test.logs - middle)
        squares += float(scaled @ scaled)
        total -= 0.5 * float(scaled @ scaled) + float(np.log(np.diag(root)).sum())
        total -= 0.5 * len(scaled) * math.log(2.0 * math.pi)
    return total, squares


def _negated(values: Floats, law: _Law, tests: Sequence[_Test]) -> float:
    return -_log_likelihood(law, values, tests)[0]


def _fitted(name: str, law: _Law, tests: Sequence[_Test]) -> LawFit:
    """Fit one law; its weight is still to be found."""
    from scipy.optimize import Bounds, minimize

    speeds, logs, variances = (
        np.concatenate([getattr(test, each) if each else np.diag(test.covariance) for test in tests])
        for each in ("speeds", "logs", "")
    )
    known = variances <= np.quantile(variances, 0.5)  # the timing tells little of slow impacts
    found = []
    for start in law.starts(speeds[known], np.exp(logs[known])):
        values = np.array(start)
        if law.bounds:
            low, high = np.array(law.bounds).T
            values = np.clip(values, low, high)
            for _ in range(_SEARCHES):
                search = minimize(_negated, values, (law, tests), "Nelder-Mead", bounds=Bounds(low, high), tol=1e-7)
                values = np.asarray(search.x)
        found.append(values)
    values = max(found, key=lambda x: _log_likelihood(law, x, tests)[0])
    likelihood, squares = _log_likelihood(law, values, tests)
    if law.names[-1:] == ("least",):
        values[2] = min(values[2], values[0])
    elif len(values) == 2:
        values = np.sort(values)
    criterion = -2.0 * likelihood + len(values) * math.log(len(logs))
    estimates = dict(zip(law.names, values.tolist(), strict=True))
    return LawFit(name, estimates, likelihood, criterion, math.nan, math.sqrt(squares / len(logs)))
