"""What schemes for impacts make of one case, against the certified response: in words, as tables and as a figure."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.body import title_of
from rocking.dynamics.stepping import SteppedResponse, TimeStepping
from rocking.response import Response
from rocking.result import DrawnResult, TableResult
from rocking.tables import as_written, counted, named, rows_of, text_table
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What ends a sequence of impacts, or follows the motion in steps that locate none.
Scheme = Treatment | TimeStepping

#: What the families of schemes are called, by their names; those in a figure are drawn in this order.
FAMILIES: Final = {
    "velocity": "velocity threshold",
    "interval": "interval threshold",
    "bypass": "geometric bypass",
    "time": "asymptotic time",
    "certified": "certificate",
    "moreau-jean": "Moreau-Jean",
    "schatzman-paoli": "Schatzman-Paoli",
}

REST: Final = np.dtype([("time", float), ("certified", float), ("error", float), ("speed", float)])


@dataclass(frozen=True, eq=False)
class SchemeOutcome:
    """What one scheme makes of the case.

    Attributes
    ----------
    scheme : Treatment or TimeStepping
        The scheme.
    response : Response or SteppedResponse
        Its response.
    rests : structured array
        time (s) of each rest; certified: time of the proven rest that it stands for, NaN where the body does not rest
        (a false rest); error: their difference, s; speed: what the last impact left, over the speed that is natural to
        the body (p alpha of a block), and the scheme took away; NaN by time stepping.
    missed : ndarray
        Times of proven rests that the scheme does not find, s.
    peak_error : float
        Relative error of the peak.
    position_error : float
        Largest difference from the certified position, in the unit of the body's coordinate.
    cost : int
        Arcs, or steps of time stepping.
    processor_time : float
        Of one run, s; NaN where it was not measured.
    wrong_verdict : bool
        Whether the verdict on overturning is wrong.
    """

    scheme: Scheme
    response: Response | SteppedResponse
    rests: NDArray[np.void]
    missed: Floats
    peak_error: float
    position_error: float
    cost: int
    processor_time: float
    wrong_verdict: bool

    def __repr__(self) -> str:
        return f"<SchemeOutcome: {self.scheme.label}: {self.verdict}>"

    @property
    def false_rests(self) -> Floats:
        """Times of rests that are none, s."""
        return np.asarray(self.rests["time"][np.isnan(self.rests["certified"])], dtype=float)

    @property
    def largest_error(self) -> float:
        """Error in time of the worst rest that is one, s; NaN where there is none."""
        errors = self.rests["error"][~np.isnan(self.rests["error"])]
        return float(errors[np.argmax(np.abs(errors))]) if errors.size else math.nan

    @property
    def penetration(self) -> float:
        """How far the position comes to be beyond the contact, in the unit of the body's coordinate."""
        return self.response.penetration if isinstance(self.response, SteppedResponse) else 0.0

    @property
    def impact_times(self) -> Floats:
        """Times of the impacts that the scheme resolves, s."""
        found = self.response
        return found.impacts["time"] if isinstance(found, Response) else found.impact_times

    @property
    def is_right(self) -> bool:
        """Whether it finds every rest, no other one, and the right verdict; how exactly, `largest_error` says."""
        return not (self.false_rests.size or self.missed.size or self.wrong_verdict)

    @property
    def verdict(self) -> str:
        """Say in words where the scheme is wrong."""
        faults = []
        if self.false_rests.size:
            faults.append(f"{counted(self.false_rests.size, 'false rest')}, the first at {self.false_rests[0]:.6f} s")
        if self.missed.size:
            faults.append(f"{counted(self.missed.size, 'rest')} missed, the first at {self.missed[0]:.6f} s")
        if self.wrong_verdict:
            faults.append("overturns, wrongly" if self.response.overturned else "does not overturn, wrongly")
        if isinstance(self.response, Response) and self.response.stalled:
            faults.append(f"{counted(self.response.stalled, 'rest')} only as time no longer advanced")
        return "; ".join(faults) or "every rest found, no other"


@dataclass(frozen=True, eq=False, repr=False)
class SchemeComparison(DrawnResult, TableResult):
    """One case by several schemes, from `compare_schemes`; ``print`` it for a table.

    Its figure has the error of the position and of the worst time of rest against the cost, a curve for each family of
    schemes.

    Attributes
    ----------
    certified : SchemeOutcome
        What the others are measured against.
    largest : float
        Largest certified distance from position zero, or rotation.
    outcomes : tuple of SchemeOutcome
        One for each scheme that is applicable, in order.
    not_applicable : tuple of (scheme, str)
        Schemes that refuse the case, and why.
    """

    TABLES = ("schemes", "rests")

    certified: SchemeOutcome
    largest: float
    outcomes: tuple[SchemeOutcome, ...]
    not_applicable: tuple[tuple[Scheme, str], ...]

    def _headline(self) -> str:
        right = sum(outcome.is_right for outcome in self.outcomes)
        return (
            f"{right} of {len(self.outcomes)} schemes find what the certified one finds; "
            f"{len(self.not_applicable)} not applicable"
        )

    def __str__(self) -> str:
        return self.summary()

    @property
    def _is_timed(self) -> bool:
        return not math.isnan(self.certified.processor_time)

    @property
    def _unit(self) -> str:
        return self.certified.response.body.coordinate.unit

    def _of_peak(self, outcome: SchemeOutcome) -> float:
        """Error of the position over the largest certified one."""
        return outcome.position_error / self.largest if self.largest > 0.0 else math.nan

    def summary(self) -> str:
        timed = ["time, ms"] if self._is_timed else []
        header = ["scheme", "cost", *timed, "rests", "false", "missed", "worst error, s", "impacts", "position off by",
                  "peak off by", "penetration", "verdict"]  # fmt: skip
        rows: list[list[Any]] = []
        for outcome in (self.certified, *self.outcomes):
            worst, proof = outcome.largest_error, outcome is self.certified
            rows.append(
                [
                    "certified" if proof else outcome.scheme.label,
                    counted(outcome.cost, _cost_unit(outcome.scheme)),
                    *([f"{1e3 * outcome.processor_time:.2g}"] if timed else []),
                    len(outcome.rests),
                    "" if proof else outcome.false_rests.size,
                    "" if proof else outcome.missed.size,
                    "" if proof or math.isnan(worst) else f"{worst:+.1e}",
                    len(outcome.impact_times),
                    "" if proof else f"{self._of_peak(outcome):.1e}",
                    "" if proof else f"{outcome.peak_error:+.1e}",
                    "" if not isinstance(outcome.scheme, TimeStepping) else f"{outcome.penetration:.1e} {self._unit}",
                    _account(outcome.response) if isinstance(outcome.response, Response) and proof else outcome.verdict,
                ]
            )
        refused = [f"{scheme.label}: not applicable, {reason}" for scheme, reason in self.not_applicable]
        return "\n".join(
            [
                text_table(header, rows),
                *refused,
                "",
                "position: over the largest certified one; peak: over the certified one",
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        return {
            "certified": self._entry(self.certified),
            "schemes": [
                {
                    **self._entry(outcome),
                    "rests": rows_of(outcome.rests),
                    "missed_s": outcome.missed,
                    "is_right": outcome.is_right,
                    "verdict": outcome.verdict,
                }
                for outcome in self.outcomes
            ],
            "not_applicable": {str(scheme): reason for scheme, reason in self.not_applicable},
        }

    def _entry(self, outcome: SchemeOutcome) -> dict[str, Any]:
        """Return what all tables say of a scheme, in plain values."""
        scheme, rests = outcome.scheme, outcome.rests["time"]
        value, unit = _parameter(scheme, self._unit)
        timed = {named("processor_time", "s"): outcome.processor_time} if self._is_timed else {}
        impacts = outcome.impact_times
        first = float(rests[0]) if rests.size else math.inf
        return {
            "scheme": scheme.name,
            "parameter": value,
            "unit": unit,
            "cost": outcome.cost,
            "cost_unit": f"{_cost_unit(scheme)}s",
            **timed,
            "rests_found": len(rests),
            "false_rests": outcome.false_rests.size,
            "missed_rests": outcome.missed.size,
            named("rest_error", "s"): outcome.largest_error,
            named("position_error", self._unit): outcome.position_error,
            "position_error_over_largest": self._of_peak(outcome),
            "peak_error": outcome.peak_error,
            "impacts": len(impacts),
            "impacts_to_first_rest": int(np.sum(impacts <= first)),
            named("penetration", self._unit): outcome.penetration,
            "wrong_verdict": outcome.wrong_verdict,
        }

    def _frame(self, table: str) -> pd.DataFrame:
        import pandas as pd

        if table == "schemes":
            return pd.DataFrame(
                {**self._entry(outcome), "verdict": outcome.verdict} for outcome in (self.certified, *self.outcomes)
            )
        found = [
            {"scheme": outcome.scheme.name, "parameter": value, "unit": unit, **rest}
            for outcome in self.outcomes
            for value, unit in [_parameter(outcome.scheme, self._unit)]
            for rest in rows_of(outcome.rests)
        ]
        units = {"time": "s", "certified": "s", "error": "s"}
        columns = ["scheme", "parameter", "unit", *(REST.names or ())]
        return pd.DataFrame(found, columns=columns).rename(columns={name: named(name, units[name]) for name in units})

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.schemes import SchemeCurve, schemes_figure

        curves = []
        for name, label in FAMILIES.items():
            family = [outcome for outcome in self.outcomes if outcome.scheme.name == name]
            family.sort(key=lambda outcome: outcome.cost)
            if family:
                costs = [outcome.processor_time if self._is_timed else outcome.cost for outcome in family]
                curves.append(
                    SchemeCurve(
                        label,
                        np.array(costs, dtype=float),
                        np.array([self._of_peak(outcome) for outcome in family]),
                        np.array([abs(outcome.largest_error) for outcome in family]),
                        np.array([outcome.is_right for outcome in family]),
                    )
                )
        response = self.certified.response
        shaken = "" if response.motion is None else f" under {response.motion.name}"
        return schemes_figure(
            curves=curves,
            certified=self.certified.processor_time if self._is_timed else self.certified.cost,
            cost_label="processor time (s)" if self._is_timed else "arcs or steps",
            title=title or as_written(f"{title_of(response.body)}{shaken}"),
            ax=ax,
            figsize=figsize,
        )


def _parameter(scheme: Scheme, coordinate: str) -> tuple[float | str, str]:
    """Return the parameter of a scheme and its unit, of a body whose coordinate has a unit."""
    if isinstance(scheme, TimeStepping):
        return scheme.step, "s"
    (parameter,) = (getattr(scheme, each.name) for each in fields(scheme))
    speed = "p alpha" if coordinate == "rad" else f"{coordinate}/s"
    return parameter, speed if scheme.unit == "speed" else scheme.unit


def _cost_unit(scheme: Scheme) -> str:
    return "step" if isinstance(scheme, TimeStepping) else "arc"


def _account(certified: Response) -> str:
    """Say what the certified response comes to."""
    falls = math.isfinite(min(certified.body.balance))
    ending = "" if not falls else "; overturns" if certified.overturned else "; does not overturn"
    widths = certified.chattering["upper"] - certified.chattering["lower"]
    if not widths.size:
        return f"no rest{ending}"
    if np.isnan(widths).any():
        return f"{counted(int(np.isnan(widths).sum()), 'rest')} not proven{ending}"
    return f"every rest known to {widths.max():.0e} s{ending}"
