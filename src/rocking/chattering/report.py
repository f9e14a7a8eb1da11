"""Reports on one chattering sequence or one critical amplitude, computed by every method."""

from __future__ import annotations

import math
import warnings
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.chattering.duration import chattering_sequence, chattering_time, critical_amplitude
from rocking.chattering.expansions import MAX_ORDER, asymptotic_table, first_impact_speed, first_interval
from rocking.core import checks
from rocking.core.result import Result, format_some_rows
from rocking.core.tables import Column, format_count
from rocking.errors import OptionError, OutsideFitWarning

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_METHOD_LABELS: Final = {"exact": "exact", "eq76": "Eq. 76", "eq77": "Eq. 77"}


@dataclass(frozen=True, eq=False, repr=False)
class ChatteringReport(Result):
    """Report on one chattering sequence of a slender block under a sine, created by `chattering_report`.

    The tables are "impacts" (resolved) and "cycles" (iterative procedure of the paper). The figure shows the intervals
    between impacts, and their ratios, which tend to eta^2 for complete chattering.

    Attributes
    ----------
    values : dict
        All numbers by name. Times are dimensionless, p t, unless the name ends in _s.
    impacts : structured array
        As in `ChatteringSequence`.
    cycles : structured array or None
        As in `asymptotic_table`; None without energy loss at impacts.
    p : float or None
        Frequency parameter of the block, rad/s, for times in seconds.

    See Also
    --------
    chattering_report : Create the report.

    Examples
    --------
    >>> from rocking import chattering
    >>> report = chattering.chattering_report(1.03, 2.0, 0.92)
    >>> {method: round(time, 3) for method, time in report.values["chattering_time"].items()}
    {'exact': 1.126, 'asymptotic': 1.104, 'semianalytical': 1.126, 'series': 1.1}
    """

    TABLES = ("impacts", "cycles")
    _FLOAT_FORMAT = None

    values: dict[str, Any]
    impacts: NDArray[np.void]
    cycles: NDArray[np.void] | None
    p: float | None

    def _format_headline(self) -> str:
        case = ", ".join(f"{name} = {self.values[name]:g}" for name in ("a", "omega", "eta"))
        return f"{case}: {self._describe_completeness()}"

    def to_dict(self) -> dict[str, Any]:
        return self.values

    def summary(self) -> str:
        values = self.values
        times, impact_count = values["chattering_time"], values["impact_count"]
        impacts = "" if impact_count is None else f", {format_count(impact_count, 'impact')}"
        caveat = "" if values["complete"] else ", worthless: it takes chattering for complete"
        lines = [
            ("chattering", self._describe_completeness()),
            ("critical amplitude", f"{values['critical_amplitude']:.9g}"),
            ("time of rest, exact", self._format_time(times["exact"])),
            ("  proven bracket", self._format_bracket(values["bracket"])),
            (f"  by Eq. 75{impacts}", self._format_time(times["semianalytical"])),
            ("  by Eq. 65", f"{self._format_time(times['asymptotic'])}{caveat}"),
            (f"  by a series, {values['order']} terms", f"{self._format_time(times['series'])}{caveat}"),
            ("first interval", self._format_pair(values["first_interval"], "eq32", is_time=True)),
            ("speed at first impact", self._format_pair(values["first_impact_speed"], "eq34", is_time=False)),
        ]
        units = "times are p t, counted from uplift; speeds are theta'/(p alpha)"
        return "\n".join(f"{name:<30}{text}" for name, text in lines) + f"\n\n{units}"

    def table(self) -> str:
        """Return at most a dozen cycles of the iterative procedure of the paper, one per row.

        Raise `OptionError` without energy loss at impacts.
        """
        header = ["n", "sign", "term", "interval, p t", "time, p t", "phase, rad", "speed before", "speed after"]
        rows = [
            [
                cycle["n"], f"{cycle['sign']:+d}", f"T_{cycle['n']};{cycle['order']} = {cycle['term']:.6g}",
                f"{cycle['interval']:.6e}", f"{cycle['time']:.9f}", f"{cycle['phase']:.6f}",
                f"{cycle['speed_before']:.6e}", f"{cycle['speed_after']:.6e}",
            ]
            for cycle in self.to_dataframe("cycles").to_dict("records")
        ]  # fmt: skip
        return format_some_rows(header, rows)

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.orbits import draw_intervals

        values = self.values
        rest = values["chattering_time"]["exact"]
        end = "incomplete" if math.isnan(rest) else f"at rest at p t = {rest:.6g}"
        return draw_intervals(
            intervals=self.impacts["interval"],
            eta=values["eta"],
            title=title or f"a = {values['a']:g}, ω = {values['omega']:g}, η = {values['eta']:g}: {end}",
            ax=ax,
            figsize=figsize,
        )

    def _columns(self, table: str) -> list[Column]:
        rows = self.impacts if table == "impacts" else self.cycles
        if rows is None:
            reason = "because without energy loss chattering never ends"
            raise OptionError(f"{{}} must be below 1 for the iterative procedure, {reason}", "eta")
        return [Column(name, rows[name]) for name in rows.dtype.names or ()]

    def _describe_completeness(self) -> str:
        half_period = self._format_time(self.values["half_period"])
        if self.values["complete"]:
            return f"complete: proven to rest before half a period, {half_period}, is over"
        return f"incomplete: the next half period, from {half_period} on, lifts the block before it rests"

    def _format_time(self, time: float) -> str:
        if math.isnan(time):
            return "none"
        return f"{time:.9g}" if self.p is None else f"{time:.9g} ({time / self.p:.6g} s)"

    def _format_bracket(self, bracket: dict[str, Any]) -> str:
        if math.isnan(bracket["upper"]):
            return "none"
        return f"{bracket['upper'] - bracket['lower']:.1e} wide, from {format_count(bracket['impacts'], 'impact')}"

    def _format_pair(self, values: dict[str, float], method: str, *, is_time: bool) -> str:
        approximate = f"{values[method]:.9g} by Eq. {method[2:]}"
        if math.isnan(values["exact"]):
            return f"none within half a period; {approximate}"
        exact = self._format_time(values["exact"]) if is_time else f"{values['exact']:.9g}"
        return f"{exact} exact, {approximate}"


def chattering_report(
    a: float, omega: float, eta: float, *, order: int = 4, impact_count: int | None = None, p: float | None = None
) -> ChatteringReport:
    """Report the chattering time of a slender block under a sine by every method, and its completeness.

    Parameters
    ----------
    a, omega, eta : float
        As in `chattering_time`, as scalars.
    order, impact_count : int
        As in `chattering_time`.
    p : float, optional
        Frequency parameter of the block, rad/s. If given, times are also reported in seconds.

    Returns
    -------
    ChatteringReport
        Time of rest by every method, critical amplitude, and first impact.

    See Also
    --------
    chattering_time : Compute the chattering time by one method.
    critical_report : Report the critical amplitude by every method.

    Examples
    --------
    >>> report = chattering_report(1.03, 2.0, 0.92, p=2.0)
    >>> print(report.summary().splitlines()[2])
    time of rest, exact           1.12594768 (0.562974 s)
    """
    if p is not None:
        p = checks.positive(p, "p", OptionError, "rad/s")
    chattering = chattering_sequence(a, omega, eta)
    interval = speed = 0.0 if chattering.is_complete else math.nan
    if chattering.impacts.size:
        interval, speed = chattering.impacts[["interval", "speed_before"]][0]
    checks.integer(order, "order", OptionError, 1, MAX_ORDER)
    series = math.nan
    with suppress(OptionError):  # double precision does not resolve this many terms
        series = float(chattering_time(a, omega, eta, method="series", order=order))
    compute = partial(chattering_time, a, omega, eta, impact_count=impact_count)
    times = {method: float(compute(method=method)) for method in ("exact", "asymptotic", "semianalytical")}
    values: dict[str, Any] = {
        "a": a,
        "omega": omega,
        "eta": eta,
        "complete": chattering.is_complete,
        "half_period": math.pi / omega,
        "chattering_time": {**times, "series": series},
        "order": order,
        "impact_count": impact_count,
        "bracket": {"lower": chattering.lower, "upper": chattering.upper, "impacts": int(chattering.impacts.size)},
        "critical_amplitude": float(critical_amplitude(omega, eta)),
        "first_interval": {"exact": float(interval), "eq32": float(first_interval(a, omega))},
        "first_impact_speed": {"exact": float(speed), "eq34": float(first_impact_speed(a, omega))},
    }
    if p is not None:
        values["p_rad_s"] = p
        values["chattering_time_s"] = {method: time / p for method, time in values["chattering_time"].items()}
    cycles = None if eta == 1.0 else asymptotic_table(a, omega, eta)
    return ChatteringReport(values, chattering.impacts, cycles, p)


@dataclass(frozen=True, eq=False, repr=False)
class CriticalReport(Result):
    """Report on the critical amplitude under a sine by every method, created by `critical_report`.

    Attributes
    ----------
    omega, eta : float
        Forcing frequency, divided by p, and coefficient of restitution.
    amplitudes : dict
        Amplitudes by method; None for a method outside its range.

    See Also
    --------
    critical_report : Create the report.

    Examples
    --------
    >>> from rocking import chattering
    >>> report = chattering.critical_report(2.0, 0.92)
    >>> {method: round(a, 4) for method, a in report.amplitudes.items()}
    {'exact': 1.038, 'eq76': 1.0373, 'eq77': 1.0379}
    """

    omega: float
    eta: float
    amplitudes: dict[str, float | None]

    def _format_headline(self) -> str:
        exact = self.amplitudes["exact"]
        return f"omega = {self.omega:g}, eta = {self.eta:g}: chattering is complete up to {exact:.9g} g alpha"

    def to_dict(self) -> dict[str, Any]:
        return {"omega": self.omega, "eta": self.eta, "critical_amplitude": self.amplitudes}

    def summary(self) -> str:
        exact, *approximations = self.amplitudes.values()
        assert exact is not None
        texts = [f"{exact:.9g}"] + [
            "none here: it holds for fewer omega and eta" if a is None else f"{a:<16.9g}off by {a - exact:+.2e}"
            for a in approximations
        ]
        lines = [f"{name:<24}{text}" for name, text in zip(_METHOD_LABELS.values(), texts, strict=True)]
        return "\n".join([*lines, "", "amplitudes of the ground acceleration over g alpha"])


def critical_report(omega: float, eta: float) -> CriticalReport:
    """Report the amplitude up to which chattering under a sine is complete, by every method.

    Parameters
    ----------
    omega, eta : float
        As in `critical_amplitude`, as scalars.

    Returns
    -------
    CriticalReport
        Amplitude by every method.

    See Also
    --------
    critical_amplitude : Compute the critical amplitude by one method.
    chattering_report : Report the chattering time by every method.

    Examples
    --------
    >>> critical_report(20.0, 0.92).amplitudes["eq76"] is None
    True
    """
    amplitudes: dict[str, float | None] = dict.fromkeys(_METHOD_LABELS)
    amplitudes["exact"] = float(critical_amplitude(omega, eta))
    with warnings.catch_warnings():
        warnings.simplefilter("error", OutsideFitWarning)
        for method in [*_METHOD_LABELS][1:]:  # outside its range an approximation has no value
            with suppress(OptionError, OutsideFitWarning):
                amplitudes[method] = float(critical_amplitude(omega, eta, method=method))
    return CriticalReport(omega, eta, amplitudes)
