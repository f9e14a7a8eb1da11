"""Seismic hazard curves: how often a year the ground motion at a site exceeds an intensity."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats, as_asked
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.motion.scaling import IntensityName, Measure, intensities
from rocking.tables import csv_rows, text_table

if TYPE_CHECKING:
    from rocking.plot.risk import HazardLine

#: Headings of an intensity in a table, with its measure and the factor to SI units.
HEADINGS: Final[dict[str, tuple[IntensityName, float]]] = {
    "pga_g": ("pga", STANDARD_GRAVITY),
    "pga_m_s2": ("pga", 1.0),
    "pgv_m_s": ("pgv", 1.0),
    "pgv_cm_s": ("pgv", 0.01),
    "sa_g": ("sa", STANDARD_GRAVITY),
    "sa_m_s2": ("sa", 1.0),
}

#: Names of intensities in OpenQuake's files, with the factor to SI units.
_OPENQUAKE: Final[dict[str, tuple[IntensityName, float]]] = {
    "PGA": ("pga", STANDARD_GRAVITY),
    "PGV": ("pgv", 0.01),
    "SA": ("sa", STANDARD_GRAVITY),
}

#: Rates that a figure shows.
_DRAWN: Final = (1e-200, 1e200)

_POE: Final = re.compile(r"poe-([0-9.eE+-]+)")


@dataclass(frozen=True, eq=False)
class HazardCurve:
    """Mean annual rate at which the motion at a site exceeds an intensity.

    Between its points the rate is a power of the intensity, a straight line in logarithms; the first and the last such
    line go on beyond them.

    Parameters
    ----------
    intensity : array_like, shape (n,)
        Intensities in SI units (m/s^2, m/s), n >= 2, increasing.
    rate : array_like, shape (n,)
        Exceedances a year, decreasing.
    measure : Measure or str
        What the intensity is: "pga", "pgv", or `Measure("sa", period)`.
    name : str
        Short name for tables and figures.

    Raises
    ------
    InvalidOption
        If there are fewer than two points, or they do not increase in intensity and decrease in rate.

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
        intensity = checks.numbers(self.intensity, "intensity of a hazard curve", InvalidOption)
        rate = checks.numbers(self.rate, "rate of a hazard curve", InvalidOption)
        if intensity.ndim != 1 or intensity.shape != rate.shape or len(intensity) < 2:
            raise InvalidOption(
                "a hazard curve needs two points or more, and as many rates as intensities, not shapes "
                f"{intensity.shape} and {rate.shape}"
            )
        _check_order("intensities", intensity, 1.0)
        _check_order("rates", rate, -1.0)
        given: Any = self.measure
        measure = Measure.of(given)
        if measure.units == "1":
            raise InvalidOption("a hazard curve is of pga, pgv or sa, which are of the site, not of a block")
        for name, value in (("intensity", intensity), ("rate", rate), ("measure", measure)):
            object.__setattr__(self, name, value)
        for array in (intensity, rate):
            array.setflags(write=False)

    @classmethod
    def read(cls, path: str | Path, *, site: int = 0, period: float | None = None) -> HazardCurve:
        """Read a hazard curve: a table of two columns, or what OpenQuake exports.

        Parameters
        ----------
        path : str or Path
            CSV file. A table has a heading that names the intensity with its units (pga_g, pga_m_s2, pgv_m_s, pgv_cm_s,
            sa_g or sa_m_s2; "PGA (g)" is pga_g as well) and the rate (annual_rate), with commas between, or with
            semicolons where numbers have decimal commas. OpenQuake's ``hazard_curve-...csv`` says all in its first
            line, and its probabilities of exceedance in T years become rates by -ln(1 - probability)/T.
        site : int
            Which row of OpenQuake's file; a table has one site only.
        period : float, optional
            Period of a table's spectral acceleration, s.

        Raises
        ------
        InvalidOption
            If the file cannot be read, or is neither, or has no such site.
        """
        file = checks.path(path, "path of a hazard curve", InvalidOption)
        checks.whole(site, "site", InvalidOption, 0)
        try:
            lines = file.read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is no text"
            raise InvalidOption(f"it cannot be read: {reason}", path=str(file)) from error
        try:
            if lines and "investigation_time" in lines[0]:
                return cls(*_from_openquake(lines, site), file.stem)
            if site:
                raise InvalidOption("a table of two columns is of one site; leave {} out", "site")
            return cls(*_from_table(lines, period), file.stem)
        except InvalidOption as error:
            error.path = str(file)
            raise

    def rate_of(self, intensity: ArrayLike) -> Floats:
        """Annual rate of exceeding intensities, shaped like them; infinite at 0.

        Raises
        ------
        InvalidOption
            If an intensity is no number, or negative.
        """
        at = intensities(intensity)
        exponents, factors = self.powers()
        segment = np.clip(np.searchsorted(self.intensity, at, side="right") - 1, 0, len(self.rate) - 2)
        with np.errstate(divide="ignore", over="ignore"):
            return as_asked(np.asarray(np.exp(factors[segment] - exponents[segment] * np.log(at))))

    def line(self, intensity: Floats) -> HazardLine:
        """Return rates at intensities (SI) as a figure takes them: neither 0 nor infinite."""
        from rocking.plot.risk import HazardLine

        low, high = self.measure.scale * self.intensity[[0, -1]]
        return HazardLine(np.clip(self.rate_of(intensity), *_DRAWN), (float(low), float(high)))

    def powers(self) -> tuple[Floats, Floats]:
        """Exponent k and logarithm of c of each segment, on which the rate is c intensity^-k."""
        x, y = np.log(self.intensity), np.log(self.rate)
        exponents = -np.diff(y) / np.diff(x)
        return exponents, y[:-1] + exponents * x[:-1]

    def to_dict(self) -> dict[str, Any]:
        """Points and measure by name."""
        return {
            "name": self.name,
            "measure": {"name": self.measure.name, **self.measure.options()},
            self.measure.column: self.intensity.tolist(),
            "annual_rate": self.rate.tolist(),
        }

    def summary(self) -> str:
        """Points in a table, with return periods."""
        rows = [[self.measure.scale * x, rate, 1.0 / rate] for x, rate in zip(self.intensity, self.rate, strict=True)]
        return text_table([self.measure.label, "annual rate", "return period (years)"], rows)

    def __repr__(self) -> str:
        low, high = self.measure.scale * self.intensity[[0, -1]]
        return (
            f"<HazardCurve: {self.name}; {self.measure.label} from {low:.4g} to {high:.4g}, "
            f"annual rate from {self.rate[0]:.3g} to {self.rate[-1]:.3g}>"
        )


def _check_order(what: str, values: Floats, way: float) -> None:
    """Check that values are positive, and increase (`way` 1) or decrease (-1)."""
    sound = np.isfinite(values) & (values > 0.0)
    sound[1:] &= way * np.diff(values) > 0.0
    if not np.all(sound):
        k = int(np.argmin(sound))
        after = f" after {values[k - 1]:g}" if k else ""
        ordered = "increase" if way > 0.0 else "decrease"
        raise InvalidOption(
            f"the {what} of a hazard curve must be positive and {ordered} from point to point, but "
            f"that of point {k + 1} is {values[k]:g}{after}; correct it or leave the point out"
        )


def heading_of(cell: str) -> str:
    """Name of a column as it is known here: "PGA (m/s^2)" is pga_m_s2."""
    return re.sub(r"[^a-z0-9]+", "_", cell.lower().replace("^", "")).strip("_")


def _from_table(lines: list[str], period: float | None) -> tuple[Floats, Floats, Measure]:
    """Intensities (SI), annual rates and measure of a table of two columns; lines that begin with # are remarks."""
    (_, header), *rows = csv_rows("\n".join("" if line.lstrip().startswith("#") else line for line in lines)) or [
        (1, [])
    ]
    heading = [heading_of(cell) for cell in header]
    found = [cell for cell in heading if cell in HEADINGS]
    if len(found) != 1 or "annual_rate" not in heading:
        raise InvalidOption(
            f"a hazard curve needs a heading with annual_rate and one of {', '.join(HEADINGS)}, "
            f"not {', '.join(header) or 'nothing'}"
        )
    kind, factor = HEADINGS[found[0]]
    intensity, rate = np.empty(len(rows)), np.empty(len(rows))
    for k, (line, row) in enumerate(rows):
        try:
            intensity[k], rate[k] = (float(row[heading.index(name)]) for name in (found[0], "annual_rate"))
        except (ValueError, IndexError):
            raise InvalidOption(f"{','.join(row)} is not an intensity and a rate", line=line) from None
    if kind == "sa" and period is None:
        raise InvalidOption("{} must be given, in s, for a spectral acceleration", "period")
    measure = Measure("sa", period) if kind == "sa" else Measure(kind)
    return factor * intensity, rate, measure


def _from_openquake(lines: list[str], site: int) -> tuple[Floats, Floats, Measure]:
    """Intensities (SI), annual rates and measure of a site in a file of OpenQuake's."""
    said = dict(re.findall(r"(\w+)='?([^,'\"]+)'?", lines[0]))
    kind, _, rest = said.get("imt", "").partition("(")
    rows = list(csv.reader(lines[1:]))
    levels = [_POE.fullmatch(cell.strip()) for cell in rows[0]] if rows else []
    if kind not in _OPENQUAKE or not any(levels):
        raise InvalidOption(f"no hazard curve of {', '.join(_OPENQUAKE)}: imt is {said.get('imt', 'not given')}")
    if not 0 <= site < len(rows) - 1:
        raise InvalidOption(f"there is no site {site}; it holds {len(rows) - 1}, counted from 0")
    columns = [k for k, level in enumerate(levels) if level]
    intensity = np.array([float(level[1]) for level in levels if level])
    try:
        exceeded = np.array([float(rows[1 + site][k]) for k in columns])
        years = float(said["investigation_time"])
    except (ValueError, IndexError) as error:
        raise InvalidOption(f"site {site}: {error}; it is not a whole hazard curve") from None
    measure_name, factor = _OPENQUAKE[kind]
    measure = Measure("sa", float(rest.rstrip(")"))) if kind == "SA" else Measure(measure_name)
    # Probabilities that are printed as 0 or 1 say nothing of the rate.
    useful = (exceeded > 0.0) & (exceeded < 1.0)
    rate = -np.log1p(-exceeded[useful]) / years
    falling = np.append(True, np.diff(np.minimum.accumulate(rate)) < 0.0) if len(rate) else np.zeros(0, dtype=bool)
    return factor * intensity[useful][falling], rate[falling], measure
