"""Seismic hazard curves: mean annual rates of exceeding an intensity or a lognormal limit."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.probit import Probit
from rocking.core import checks
from rocking.core.arrays import Floats, Integers, unwrap_scalar
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.result import Result
from rocking.core.tables import format_table, read_csv_rows
from rocking.errors import OptionError
from rocking.motion.scaling import ComponentName, IntensityName, Measure, check_intensities

if TYPE_CHECKING:
    from rocking.plot.curves import HazardLine

#: Column headings of intensities: measure and factor to SI units.
INTENSITY_HEADINGS: Final[dict[str, tuple[IntensityName, float]]] = {
    "pga_g": ("pga", STANDARD_GRAVITY),
    "pga_percent_g": ("pga", 0.01 * STANDARD_GRAVITY),
    "pga_m_s2": ("pga", 1.0),
    "pgv_m_s": ("pgv", 1.0),
    "pgv_cm_s": ("pgv", 0.01),
    "sa_g": ("sa", STANDARD_GRAVITY),
    "sa_percent_g": ("sa", 0.01 * STANDARD_GRAVITY),
    "sa_m_s2": ("sa", 1.0),
    "pgd_m": ("pgd", 1.0),
    "pgd_cm": ("pgd", 0.01),
    "arias_m_s": ("arias", 1.0),
    "cav_m_s": ("cav", 1.0),
    "cav_g_s": ("cav", STANDARD_GRAVITY),
}

#: OpenQuake's names of intensities: measure and factor to SI units.
_OPENQUAKE_MEASURES: Final[dict[str, tuple[IntensityName, float]]] = {
    "PGA": ("pga", STANDARD_GRAVITY),
    "PGV": ("pgv", 0.01),
    "SA": ("sa", STANDARD_GRAVITY),
    "PGD": ("pgd", 0.01),
    "IA": ("arias", 1.0),
    "CAV": ("cav", STANDARD_GRAVITY),
}


_SQRT_HALF: Final = math.sqrt(0.5)


@dataclass(frozen=True, eq=False, repr=False)
class HazardCurve(Result):
    """Seismic hazard curve: mean annual rate of exceeding an intensity at a site.

    Between its points the rate is a power of the intensity, a straight line in logarithms. The first and the last line
    are extrapolated.

    Parameters
    ----------
    intensity : array_like, shape (n,)
        Increasing intensities in SI units (m/s^2, m/s), n >= 2.
    rate : array_like, shape (n,)
        Decreasing numbers of exceedances per year.
    measure : Measure or str
        Intensity measure, for example "pga", `Measure("sa", period)` or `Measure("pga", component="rotd50")`.
    name : str
        Short name for tables and figures.

    Raises
    ------
    OptionError
        If there are fewer than two points, the intensities do not increase, or the rates do not decrease.

    See Also
    --------
    rocking.Fragility.annual_rate : Annual rates of exceeding the limit states.
    rocking.Fragility.survival : Constrain past ground motions.

    Examples
    --------
    >>> hazard = HazardCurve([1.0, 2.0, 4.0], [1e-2, 2e-3, 2e-4])
    >>> hazard.rate_of([1.0, 2.0, 8.0]).round(12).tolist()
    [0.01, 0.002, 2e-05]
    """

    intensity: Floats
    rate: Floats
    measure: Measure = Measure("pga")  # noqa: RUF009 - it is frozen
    name: str = "hazard curve"

    def __post_init__(self) -> None:
        intensity = checks.numbers(self.intensity, "intensity of a hazard curve", OptionError)
        rate = checks.numbers(self.rate, "rate of a hazard curve", OptionError)
        if intensity.ndim != 1 or intensity.shape != rate.shape or len(intensity) < 2:
            raise OptionError(
                "a hazard curve requires at least two points, and one rate for each intensity; got shapes "
                f"{intensity.shape} and {rate.shape}"
            )
        _check_order("intensities", intensity, 1.0)
        _check_order("rates", rate, -1.0)
        measure_input: Any = self.measure
        measure = Measure.parse(measure_input)
        if measure.units == "1":
            message = "a hazard curve must be of a measure that does not depend on a block, as pga, pgv or sa"
            raise OptionError(f"{message}; got {measure.name}")
        for name, value in (("intensity", intensity), ("rate", rate), ("measure", measure)):
            object.__setattr__(self, name, value)
        intensity.flags.writeable = rate.flags.writeable = False

    @classmethod
    def read(
        cls, path: str | Path, *, site: int = 0, period: float | None = None, component: ComponentName = "own"
    ) -> HazardCurve:
        """Read a hazard curve from a table of two columns or an OpenQuake export.

        Parameters
        ----------
        path : str or Path
            CSV file. The heading of a table names the intensity with its units (pga_g, pga_percent_g, pga_m_s2,
            pgv_m_s, pgv_cm_s, sa_g, sa_percent_g or sa_m_s2; "PGA (g)" is equivalent to pga_g) and the rate
            (annual_rate). The separator is a comma, or a semicolon if numbers have decimal commas. OpenQuake's
            ``hazard_curve-...csv`` is self-describing. Its probabilities of exceedance in T years become rates by -ln(1
            - probability)/T.
        site : int
            Row of OpenQuake's file. A table has only one site.
        period : float, optional
            Period of a table's spectral acceleration, s.
        component : str
            Component of the ground motion to which the curve refers, as for `Measure`. Files do not state it. Many
            hazard curves refer to "rotd50" or "geometric_mean".

        Returns
        -------
        HazardCurve
            Curve with the name of the file.

        Raises
        ------
        OptionError
            If the file cannot be read, has another format, or does not contain the site.
        """
        file = checks.path(path, "path of a hazard curve", OptionError)
        checks.integer(site, "site", OptionError, 0)
        if period is not None:
            period = checks.positive(period, "period", OptionError, "s")
        try:
            lines = file.read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            message = error.strerror if isinstance(error, OSError) else "it is not a text file"
            raise OptionError(f"the file cannot be read: {message}", path=str(file)) from error
        try:
            if lines and "investigation_time" in lines[0]:
                intensity, rate, measure = _parse_openquake(lines, site, period)
            elif site:
                raise OptionError("a table of two columns contains only one site; omit {}", "site")
            else:
                intensity, rate, measure = _parse_table(lines, period)
            return cls(intensity, rate, replace(measure, component=component), file.stem)
        except OptionError as error:
            error.path = str(file)
            raise

    def rate_of(self, intensity: ArrayLike) -> Floats:
        """Compute annual rates of exceeding intensities >= 0 (SI units), with their shape, infinite at 0.

        The curve is extrapolated below its first and above its last point.
        """
        intensities = check_intensities(intensity)
        exponents, factors = compute_power_laws(self)
        segment = np.clip(np.searchsorted(self.intensity, intensities, side="right") - 1, 0, len(self.rate) - 2)
        with np.errstate(divide="ignore", over="ignore"):
            return unwrap_scalar(np.asarray(np.exp(factors[segment] - exponents[segment] * np.log(intensities))))

    def to_dict(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "measure": {"name": self.measure.name, **self.measure.options()},
            self.measure.column: self.intensity.tolist(),
            "annual_rate": self.rate.tolist(),
        }

    def summary(self) -> str:
        columns = self.measure.display_factor * self.intensity, self.rate, 1.0 / self.rate
        header = [self.measure.label, "annual rate", "return period (years)"]
        return format_table(header, [*zip(*columns, strict=True)])

    def _format_headline(self) -> str:
        low, high = convert_range(self)
        return (
            f"{self.name}; {self.measure.label} from {low:.4g} to {high:.4g}, "
            f"annual rate from {self.rate[0]:.3g} to {self.rate[-1]:.3g}"
        )


def compute_power_laws(hazard: HazardCurve) -> tuple[Floats, Floats]:
    """Compute exponent k and logarithm of c of each segment, on which the rate is c intensity^-k."""
    x, y = np.log(hazard.intensity), np.log(hazard.rate)
    exponents = -np.diff(y) / np.diff(x)
    return exponents, y[:-1] + exponents * x[:-1]


def convert_range(hazard: HazardCurve) -> tuple[float, float]:
    """Convert the first and the last intensity to the unit of texts and figures."""
    low, high = hazard.measure.display_factor * hazard.intensity[[0, -1]]
    return float(low), float(high)


def create_hazard_line(hazard: HazardCurve, intensity: Floats) -> HazardLine:
    """Create the line of a figure: rates at intensities (SI), without 0 and infinity."""
    from rocking.plot.curves import HazardLine

    return HazardLine(np.clip(hazard.rate_of(intensity), *(1e-200, 1e200)), convert_range(hazard))


def _check_order(quantity: str, values: Floats, sign: float) -> None:
    """Check that values are positive, and increase (`sign` 1) or decrease (-1)."""
    with np.errstate(invalid="ignore"):  # an infinite first value
        is_valid = np.isfinite(values) & (values > 0.0) & (sign * np.diff(values, prepend=-sign * np.inf) > 0.0)
    if not is_valid.all():
        k = int(np.argmin(is_valid))
        predecessor = f" after {values[k - 1]:g}" if k else ""
        raise OptionError(
            f"the {quantity} of a hazard curve must be positive and {'increase' if sign > 0.0 else 'decrease'} from "
            f"point to point; got {values[k]:g}{predecessor} at point {k + 1}; correct or remove this point"
        )


def normalise_heading(cell: str) -> str:
    """Normalise a column name: "PGA (m/s²)" to pga_m_s2, "PGA (%g)" to pga_percent_g."""
    text = cell.lower().replace("^", "").replace("²", "2").replace("%", " percent ")
    return re.sub(r"[^a-z0-9]+", "_", text).strip("_")


def _parse_table(lines: list[str], period: float | None) -> tuple[Floats, Floats, Measure]:
    """Read intensities (SI), annual rates and measure from a table of two columns with comments (#)."""
    text = "\n".join("" if line.lstrip().startswith("#") else line for line in lines)
    (_, header), *rows = read_csv_rows(text) or [(1, [])]
    heading = [normalise_heading(cell) for cell in header]
    intensity_headings = [cell for cell in heading if cell in INTENSITY_HEADINGS]
    if len(intensity_headings) != 1 or heading.count("annual_rate") != 1:
        raise OptionError(
            f"a hazard curve requires a heading with annual_rate and one of {', '.join(INTENSITY_HEADINGS)}; "
            f"got {', '.join(header) or 'nothing'}"
        )
    kind, factor = INTENSITY_HEADINGS[intensity_headings[0]]
    intensity, rate = np.empty((2, len(rows)))
    for k, (line, row) in enumerate(rows):
        try:
            cells = dict(zip(heading, row, strict=True))
            intensity[k], rate[k] = (float(cells[name]) for name in (intensity_headings[0], "annual_rate"))
        except ValueError:
            expected = f"an intensity and a rate in {len(heading)} cells, as in the heading"
            raise OptionError(f"expected {expected}; got {','.join(row)}", line=line) from None
    if kind == "sa" and period is None:
        raise OptionError("a spectral acceleration requires {}, in s", "period")
    if kind != "sa" and period is not None:
        message = f"{{}} applies only to spectral acceleration, but the intensity measure of this curve is {kind}"
        raise OptionError(message, "period")
    measure = Measure(kind, period)
    with np.errstate(over="ignore"):  # infinite values are rejected later
        return factor * intensity, rate, measure


def _parse_openquake(lines: list[str], site: int, period: float | None) -> tuple[Floats, Floats, Measure]:
    """Read intensities (SI), annual rates and measure of a site from an OpenQuake file."""
    fields = dict(re.findall(r"(\w+)='?([^,'\"]+)'?", lines[0]))
    kind, _, period_text = fields.get("imt", "").partition("(")
    header, *rows = [*csv.reader(lines[1:])] or [[]]
    levels = {k: cell.strip()[4:] for k, cell in enumerate(header) if cell.strip().startswith("poe-")}
    if kind not in _OPENQUAKE_MEASURES or not levels:
        message = f"the imt of a hazard curve must be one of {', '.join(_OPENQUAKE_MEASURES)}"
        raise OptionError(f"{message}; got {fields.get('imt', 'none')}")
    if site >= len(rows):
        raise OptionError(f"there is no site {site}; the file contains {len(rows)}, counted from 0")
    try:
        intensity = np.array([float(level) for level in levels.values()])
        probabilities = np.array([float(rows[site][k]) for k in levels])
        years = float(fields["investigation_time"])
        spectral_period = float(period_text.rstrip(")")) if kind == "SA" else None
    except (ValueError, IndexError, KeyError) as error:
        raise OptionError(f"the hazard curve of site {site} is incomplete or damaged: {error}") from None
    if period not in (None, spectral_period):
        message = f"{{}} is {period:g} s, but the intensity measure of this curve is {fields['imt']}; omit it"
        raise OptionError(message, "period")
    measure_name, factor = _OPENQUAKE_MEASURES[kind]
    # Probabilities printed as 0 or 1 contain no information on the rate.
    is_informative = (probabilities > 0.0) & (probabilities < 1.0)
    rates = -np.log1p(-probabilities[is_informative]) / checks.positive(years, "investigation_time", OptionError)
    indices, rate = _select_corners(rates)
    return factor * intensity[is_informative][indices], rate, Measure(measure_name, spectral_period)


def _select_corners(rate: Floats) -> tuple[Integers, Floats]:
    """Select the first and the last (slightly lowered) point of each plateau of a curve."""
    running_minimum = np.minimum.accumulate(rate)
    decreases = np.diff(running_minimum) < 0.0
    is_first, is_last = np.append(True, decreases)[: len(rate)], np.append(decreases, False)[: len(rate)]
    indices = np.flatnonzero(is_first | is_last)
    return indices, np.where(is_first, running_minimum, running_minimum * (1.0 - 1e-9))[indices]


def compute_log_integrals(fits: Probit, hazard: HazardCurve) -> Floats:
    """Compute logarithms of integrals below the hazard curve, over each of its segments, and above.

    The shape is (fits, n + 1). On a segment rate(x) = c x^-k, and with P = Phi(z), z = a + b ln x, the part is c exp(k
    a/b + k^2/(2 b^2)) [Phi(z + k/b)]. If both ends lie on one side of z = -k/b, large terms cancel. The scaled erfcx
    then yields the difference of rate(x) exp(-z^2/2) erfcx(|z + k/b|/sqrt(2))/2 at the nearer and the farther end.
    """
    from scipy.special import erfcx, ndtr

    k, log_c = (_repeat_ends(values) for values in compute_power_laws(hazard))
    boundaries = np.concatenate([[-np.inf], np.log(hazard.intensity), [np.inf]])  # ends of segments
    ends = boundaries[:-1], boundaries[1:]
    a, b = (values[:, None] for values in fits)
    with np.errstate(all="ignore"):
        shift = k / b
        lower, upper = (a + b * end + shift for end in ends)
        is_mirrored = lower > 0.0
        near_bound, far_bound = np.where(is_mirrored, lower, -upper), np.where(is_mirrored, upper, -lower)
        end = np.where(is_mirrored, *ends)
        z = a + b * end
        near_tail, far_tail = erfcx(near_bound * _SQRT_HALF), erfcx(far_bound * _SQRT_HALF)
        decay = np.exp(-0.5 * b * (ends[1] - ends[0]) * (near_bound + far_bound)) * far_tail / near_tail
        tail_logarithm = log_c - k * end - 0.5 * z * z + np.log(0.5 * near_tail) + np.log1p(-decay)
        central_logarithm = log_c + shift * a + 0.5 * shift * shift + np.log(ndtr(upper) - ndtr(lower))
    # The weakest motions always exceed the limit of a curve that does not rise, unless its probability is 0.
    unbounded = np.where(np.isneginf(a), -np.inf, np.inf)
    return np.where(b > 0.0, np.where(near_bound > 0.0, tail_logarithm, central_logarithm), unbounded)


def compute_log_rate_within(fits: Probit, hazard: HazardCurve) -> Floats:
    """Compute logarithms of integrals of P(x) |d rate(x)| between the ends of the hazard curve, shape (fits, 1)."""
    from scipy.special import ndtr

    a, b = (values[:, None] for values in fits)
    first_probability, last_probability = ndtr(a + b * np.log(hazard.intensity[[0, -1]])).T
    # dP is 0 on every segment for a curve that does not rise.
    inner_integral = np.where(fits.slope > 0.0, np.exp(compute_log_integrals(fits, hazard)[:, 1:-1]).sum(axis=1), 0.0)
    rate = first_probability * hazard.rate[0] - last_probability * hazard.rate[-1] + inner_integral
    return np.asarray(np.log(np.maximum(rate, np.finfo(float).tiny)))[:, None]


def compute_log_survival(fits: Probit, hazard: HazardCurve, years: float) -> Floats:
    """Compute logarithms of integrals of exp(-rate(x) years) dP(x) over the hazard curve, shape (fits, 1)."""
    from scipy.special import log_ndtr

    a, b = (values[:, None] for values in fits)
    log_x, log_rate = np.log(hazard.intensity), np.log(hazard.rate)
    with np.errstate(all="ignore"):
        first_score, last_score = (np.clip(a + b * end, -38.0, 38.0) for end in log_x[[0, -1]])
        z = first_score + (last_score - first_score) * np.linspace(0.0, 1.0, 4001)
        density = -0.5 * z * z - years * np.exp(np.interp((z - a) / b, log_x, log_rate))
        inner = np.logaddexp(density[:, 1:], density[:, :-1]) + np.log(np.diff(z) * math.sqrt(0.125 / math.pi))
        # With a curve that does not rise, the weakest motions overturn every block that overturns.
        inner = np.where(b > 0.0, inner, -np.inf)
        log_terms = np.column_stack([log_ndtr(first_score) - years * hazard.rate[0], inner, log_ndtr(-last_score)])
        return np.asarray(np.logaddexp.reduce(log_terms, axis=1)[:, None])


def _repeat_ends(values: Floats) -> Floats:
    """Repeat the values of the first and the last segment for the extrapolations."""
    return np.concatenate([values[:1], values, values[-1:]])


def compute_log_rate(fits: Probit, hazard: HazardCurve) -> Floats:
    """Compute logarithms of integrals of P(x) |d rate(x)|, with the curve's extrapolations, shape (fits, 1)."""
    return np.asarray(np.logaddexp.reduce(compute_log_integrals(fits, hazard), axis=1)[:, None])


def _compute_log_products(fitted: Probit, hazard: HazardCurve, log_intensity: Floats) -> tuple[Floats, Floats]:
    """Compute logarithms of P(x) rate(x), and of k P(x) rate(x) = P(x) |d rate(x)/d ln x|, at logarithms of x."""
    from scipy.special import log_ndtr

    segment = np.searchsorted(np.log(hazard.intensity), log_intensity, side="right")
    k, log_c = (_repeat_ends(values)[segment] for values in compute_power_laws(hazard))
    score = fitted.intercept[0] + fitted.slope[0] * log_intensity
    product = np.asarray(log_c - k * log_intensity + log_ndtr(score))
    return product, np.log(k) + product


def compute_shares_beyond(fitted: Probit, hazard: HazardCurve) -> tuple[float, float]:
    """Compute shares of the integral of P(x) |d rate(x)| below and above the hazard curve, by parts."""
    log_integrals, total = compute_log_integrals(fitted, hazard)[0], compute_log_rate(fitted, hazard)[0, 0]
    first, last = _compute_log_products(fitted, hazard, np.log(hazard.intensity[[0, -1]]))[0]
    with np.errstate(all="ignore"):
        share_below = np.exp(log_integrals[0] - total) * max(-math.expm1(min(first - log_integrals[0], 0.0)), 0.0)
        share_above = np.exp(np.logaddexp(log_integrals[-1], last) - total)
    return float(share_below), float(share_above)


def compute_share_density(fitted: Probit, hazard: HazardCurve, intensity: Floats) -> Floats:
    """Compute the density of the rate by ln x, normalised to an integral of 1."""
    log_density = _compute_log_products(fitted, hazard, np.log(intensity))[1] - compute_log_rate(fitted, hazard)[0, 0]
    with np.errstate(under="ignore"):
        return np.asarray(np.exp(log_density))
