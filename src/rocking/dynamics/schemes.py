"""One case by every scheme for impacts and their end, against the certified response: where each goes wrong."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.bodies import _LinearBody
from rocking.dynamics.simulation import simulate as simulate_between_stops
from rocking.dynamics.stepping import (
    MoreauJean,
    SchatzmanPaoli,
    SteppedResponse,
    TimeStepping,
    equation_of,
    integrate,
    position_at_start,
)
from rocking.engine import in_threads, require_finished
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.march import march
from rocking.motion.motion import Motion
from rocking.progress import Progress
from rocking.response import Response, trail_of
from rocking.response.answers import with_unresolved_impacts
from rocking.response.history import History
from rocking.result import DrawnResult, TableResult
from rocking.simulation import simulate
from rocking.tables import counted, named, rows_of, text_table
from rocking.treatment import (
    AsymptoticTime,
    Certified,
    GeometricBypass,
    IntervalThreshold,
    Treatment,
    VelocityThreshold,
    treatment,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What ends a sequence of impacts, or follows the motion in steps that locate none.
Scheme = Treatment | TimeStepping

#: Thresholds from harmless to harmful, the two of the paper's Figs 10 and 11 among them, and the paper's own scheme.
TREATMENTS: Final[tuple[Treatment, ...]] = (
    *map(VelocityThreshold, (5e-10, 1e-6, 1e-3, 5e-2)),
    *map(IntervalThreshold, (1e-9, 1e-6, 1e-3)),
    AsymptoticTime(),
    *map(GeometricBypass, (1e-6, 1e-3, 5e-2)),
)

#: Schemes of time stepping, with steps from a record's to a fiftieth of it.
STEPPINGS: Final[tuple[TimeStepping, ...]] = tuple(
    kind(step) for kind in (MoreauJean, SchatzmanPaoli) for step in (1e-2, 1e-3, 1e-4)
)

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

#: Even times at which two positions are compared, besides the nodes of both.
_EVEN_TIMES: Final = 4001

#: Steps of time stepping at whose ends positions are compared, evenly from the first to the last.
_COMPARED_STEPS: Final = 200_000

#: Time stepping goes on for longer than the certified response by this factor: rests may come late.
_LONGER: Final = 1.05

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
    overturns_wrongly : bool
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
    overturns_wrongly: bool

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
        return _impact_times(self.response)

    @property
    def is_right(self) -> bool:
        """Whether it finds every rest, no other one, and the right verdict; how exactly, `largest_error` says."""
        return not (self.false_rests.size or self.missed.size or self.overturns_wrongly)

    @property
    def verdict(self) -> str:
        """Say in words where the scheme is wrong."""
        faults = []
        if self.false_rests.size:
            faults.append(f"{counted(self.false_rests.size, 'false rest')}, the first at {self.false_rests[0]:.6f} s")
        if self.missed.size:
            faults.append(f"{counted(self.missed.size, 'rest')} missed, the first at {self.missed[0]:.6f} s")
        if self.overturns_wrongly:
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
        value, unit = _parameter(scheme)
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
            "overturns_wrongly": outcome.overturns_wrongly,
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
            for value, unit in [_parameter(outcome.scheme)]
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
            cost_label="processor time (s)" if self._is_timed else "arcs or steps",
            title=title or f"{response.body.description}{shaken}",
            ax=ax,
            figsize=figsize,
        )


def compare_schemes(
    body: Body,
    motion: Motion | None,
    *,
    schemes: Sequence[Scheme | str] = (*TREATMENTS, *STEPPINGS),
    model: Model | None = None,
    duration: float | None = None,
    initial_position: float | None = None,
    initial_velocity: float = 0.0,
    repetitions: int = 0,
    threads: int | None = None,
    progress: bool | None = None,
) -> SchemeComparison:
    """Follow one case with every scheme, and measure each against the certified response.

    Two bodies at rest at the same time stay together until the motion lifts them. So a rest of a scheme stands for the
    certified rest with which it overlaps; if there is none, it is false, and a certified rest without counterpart is
    missed. All responses go on until the last rest or overturning, so that no sequence is cut short, and time stepping
    for a twentieth longer.

    Parameters
    ----------
    body : Body
        A block, or one of `rocking.dynamics`.
    motion : Motion or None
        What shakes it.
    schemes : sequence of Treatment, TimeStepping or str
        What to compare, as objects or as `scheme_of` reads them. By default velocity thresholds from 5e-10 to 5e-2
        (both in the paper's Fig. 11), intervals from 1e-9 to 1e-3 s, the paper's asymptotic time, the geometric bypass,
        and both schemes of time stepping with steps of 0.01, 0.001 and 0.0001 s.
    model : {"nonlinear", "linear"}, optional
        Equation of motion, of a block by default the nonlinear one.
    duration : float, optional
        As for `rocking.simulate` or `rocking.dynamics.simulate`.
    initial_position, initial_velocity : float
        As for `rocking.dynamics.simulate`; of a block its rotation.
    repetitions : int
        How many times each scheme is run once more to measure its processor time, of which the least counts; 0: it is
        not measured. All runs are then in one thread, and of compiled code.
    threads : int, optional
        Number of threads; by default one for every core.
    progress : bool, optional
        Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

    Returns
    -------
    SchemeComparison
        One outcome per scheme; schemes that do not apply to the motion are listed with the reason.

    Raises
    ------
    Unfinished
        If a simulation is given up.
    InvalidOption
        As `rocking.simulate`, and if a scheme is none.

    Notes
    -----
    Source: the paper's section 5.2 and Figs 8, 10 and 11. The schemes of time stepping are in `MoreauJean` and
    `SchatzmanPaoli`, the bypass in `rocking.GeometricBypass`.

    Examples
    --------
    The paper's Fig. 11: above the critical amplitude chattering is incomplete, but a coarse threshold rests, and so
    does time stepping.

    >>> import math, rocking
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    >>> motion = rocking.pulses.sine(1.05 * block.gravity * 0.2, 1.0 / math.pi, cycles=2.5)
    >>> schemes = "velocity=5e-10", "velocity=5e-2", "moreau-jean=1e-2"
    >>> comparison = compare_schemes(block, motion, schemes=schemes, model="linear")
    >>> [(outcome.is_right, outcome.false_rests.size) for outcome in comparison.outcomes]
    [(True, 0), (False, 4), (False, 1)]
    """
    again = checks.whole(repetitions, "repetitions", InvalidOption, least=0)
    count = None if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)
    chosen = [scheme_of(scheme) for scheme in checks.several(schemes, "schemes", InvalidOption)]

    equation, position = equation_of(body, model), position_at_start(body, initial_position)
    shared: dict[str, Any] = {"initial_velocity": initial_velocity}

    def marched(how: Treatment) -> Response:
        found: Response
        if isinstance(body, _LinearBody):
            found = simulate_between_stops(
                body, motion, chattering=how, duration=duration, initial_position=position, **shared
            )
        else:
            found = simulate(
                body, motion, model=equation, chattering=how, duration=duration, initial_rotation=position, **shared
            )
        require_finished(np.array([found.unfinished]))
        return found

    proof = marched(Certified())
    exact = with_unresolved_impacts(proof)
    until = proof.duration if proof.stopped or proof.overturned else _LONGER * proof.duration
    if again:
        _compile(proof)

    def stepped(how: TimeStepping) -> SteppedResponse:
        return integrate(body, motion, how, until, model=equation, initial_position=position, **shared)

    def tried(scheme: Scheme) -> SchemeOutcome | str:
        run: Callable[[], Response | SteppedResponse]
        run = partial(stepped, scheme) if isinstance(scheme, TimeStepping) else partial(marched, scheme)
        try:
            found = _outcome(scheme, run(), proof, exact)
        except InvalidOption as error:
            # The certified run has checked everything but the scheme itself.
            return str(error)
        return replace(found, processor_time=_least_time(run, again)) if again else found

    outcomes, refused = [], []
    with Progress("simulating", len(chosen), show=progress) as bar:
        for scheme, found in zip(chosen, in_threads(tried, chosen, threads=1 if again else count), strict=True):
            if isinstance(found, str):
                refused.append((scheme, found))
            else:
                outcomes.append(found)
            bar.advance()
    certified = tried(Certified())
    assert isinstance(certified, SchemeOutcome)
    times = np.append(np.linspace(0.0, exact.end, _EVEN_TIMES), proof.peak_time)
    largest = float(np.max(np.abs(exact.states(times)[:, 0])))
    return SchemeComparison(certified, largest, tuple(outcomes), tuple(refused))


def scheme_of(scheme: Scheme | str) -> Scheme:
    """Make a scheme of its name and parameter, or return it as it is.

    Parameters
    ----------
    scheme : Treatment, TimeStepping or str
        A treatment as `rocking.simulate` takes it, or "moreau-jean=STEP" or "schatzman-paoli=STEP", the step in s.

    Returns
    -------
    Treatment or TimeStepping
        The scheme.

    Raises
    ------
    InvalidOption
        If it is none, or its parameter is out of range.

    Examples
    --------
    >>> scheme_of("moreau-jean=1e-3"), scheme_of("bypass")
    (MoreauJean(step=0.001, theta=0.5), GeometricBypass(threshold=0.001))
    """
    if isinstance(scheme, TimeStepping):
        return scheme
    name, _, value = scheme.partition("=") if isinstance(scheme, str) else ("", "", "")
    kinds = {kind.name: kind for kind in (MoreauJean, SchatzmanPaoli)}
    if name not in kinds:
        return treatment(scheme)
    try:
        return kinds[name](float(value))
    except ValueError:
        raise InvalidOption(f"{name} takes its step in s, as {name}=1e-3, not {value!r}", "schemes") from None


def _compile(proof: Response) -> None:
    """Have the march compiled: Python would follow the first ones, and nobody asks how long that takes."""
    trail = trail_of(proof)
    march(*trail[:3], state.new_table(1), state.new_scratch(), state.new_states(1, 0)[0])


def _least_time(run: Callable[[], object], repetitions: int) -> float:
    """Least processor time of this thread for some runs, s."""
    times = []
    for _ in range(repetitions):
        before = time.thread_time()
        run()
        times.append(time.thread_time() - before)
    return min(times)


def _parameter(scheme: Scheme) -> tuple[float | str, str]:
    """Return the parameter of a scheme and its unit."""
    if isinstance(scheme, TimeStepping):
        return scheme.step, "s"
    if isinstance(scheme, AsymptoticTime):
        return scheme.critical, ""
    if isinstance(scheme, Certified):
        return scheme.tolerance, "s"
    return scheme.threshold, "s" if isinstance(scheme, IntervalThreshold) else "1"  # type: ignore[attr-defined]


def _cost_unit(scheme: Scheme) -> str:
    return "step" if isinstance(scheme, TimeStepping) else "arc"


def _outcome(
    scheme: Scheme, response: Response | SteppedResponse, certified: Response, exact: History
) -> SchemeOutcome:
    stretches, proven = _rests(response), _rests(certified)
    rests = np.zeros(len(stretches), REST)
    rests["time"] = stretches[:, 0]
    rests["certified"] = [_counterpart(stretch, proven) for stretch in stretches]
    rests["error"] = rests["time"] - rests["certified"]
    rests["speed"] = [_speed_left(response, time) for time in rests["time"]]
    found = rests["certified"]
    peak, reference = _peak(response), certified.peak_rotation
    return SchemeOutcome(
        scheme=scheme,
        response=response,
        rests=rests,
        missed=np.setdiff1d(proven[:, 0], found[~np.isnan(found)]),
        peak_error=0.0 if peak == reference else peak / reference - 1.0 if reference != 0.0 else math.inf,
        position_error=_position_error(response, exact),
        cost=len(trail_of(response).nodes) if isinstance(response, Response) else len(response.times) - 1,
        processor_time=math.nan,
        overturns_wrongly=response.overturned != certified.overturned,
    )


def _peak(response: Response | SteppedResponse) -> float:
    return response.peak_rotation if isinstance(response, Response) else response.peak


def _impact_times(response: Response | SteppedResponse) -> Floats:
    return response.impacts["time"] if isinstance(response, Response) else response.impact_times


def _rests(response: Response | SteppedResponse) -> Floats:
    """Start and end of each rest that follows an impact, shape (n, 2); the last may have no end."""
    if isinstance(response, SteppedResponse):
        return response.rests
    stretches = []
    events = response.events
    for k in np.flatnonzero(events["kind"] == "rest"):
        end = events["time"][k + 1] if k + 1 < len(events) else math.inf
        stretches.append((events["time"][k], end))
    return np.array(stretches, dtype=float).reshape(-1, 2)


def _counterpart(stretch: Floats, proven: Floats) -> float:
    """Time of the proven rest that overlaps with a stretch at rest; NaN where none does."""
    overlap = np.minimum(proven[:, 1], stretch[1]) - np.maximum(proven[:, 0], stretch[0])
    matching = np.flatnonzero(overlap > 0.0)
    return float(proven[matching[0], 0]) if matching.size else math.nan


def _speed_left(response: Response | SteppedResponse, rest: float) -> float:
    """Speed that the last impact before a rest left, over that which is natural to the body."""
    if isinstance(response, SteppedResponse):
        return math.nan
    last = response.impacts[np.searchsorted(response.impacts["time"], rest, side="right") - 1]
    natural = response.body.alone().speed_limits(1.0)[0]
    return float(last["speed_after"] / natural[0 if last["side"] > 0 else 1])


def _position_error(response: Response | SteppedResponse, exact: History) -> float:
    """Largest difference of the coordinate from the certified one, up to the end or an overturning."""
    if isinstance(response, SteppedResponse):
        count = int(np.searchsorted(response.times, exact.end, side="right"))
        rows = slice(0, count, count // _COMPARED_STEPS + 1)
        times, position = response.times[rows], response.position[rows]
    else:
        end = min(response.duration, exact.end) if response.overturned else exact.end
        nodes = np.concatenate([trail_of(response).nodes["time"], exact.trail.nodes["time"]])
        times = np.concatenate([np.linspace(0.0, end, _EVEN_TIMES), nodes[nodes <= end]])
        position = response.states(np.minimum(times, response.duration))[:, 0]  # at rest to the end of its own
    return float(np.max(np.abs(position - exact.states(times)[:, 0])))


def _account(certified: Response) -> str:
    """Say what the certified response comes to."""
    ending = "overturns" if certified.overturned else "does not overturn"
    widths = certified.chattering["upper"] - certified.chattering["lower"]
    if not widths.size:
        return f"no rest; {ending}"
    if np.isnan(widths).any():
        return f"{counted(int(np.isnan(widths).sum()), 'rest')} not proven; {ending}"
    return f"every rest known to {widths.max():.0e} s; {ending}"
