"""One case by every scheme that ends chattering, against the certified response: where each gets it wrong."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block
from rocking.constants import Model
from rocking.engine import in_threads, require_finished
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.progress import Progress
from rocking.response import Response, trail_of
from rocking.result import Result
from rocking.simulation import simulate
from rocking.tables import counted, rows_of, text_table
from rocking.treatment import AsymptoticTime, Certified, IntervalThreshold, Treatment, VelocityThreshold

#: Thresholds from harmless to harmful, the two of the paper's Figs 10 and 11 among them, and the paper's own scheme.
SCHEMES: Final[tuple[Treatment, ...]] = (
    VelocityThreshold(5e-10),
    VelocityThreshold(1e-6),
    VelocityThreshold(1e-3),
    VelocityThreshold(5e-2),
    IntervalThreshold(1e-9),
    IntervalThreshold(1e-3),
    AsymptoticTime(),
)

#: Even times at which two rotations are compared, besides the nodes of both.
_EVEN_TIMES: Final = 4001

REST: Final = np.dtype([("time", float), ("certified", float), ("error", float), ("speed", float)])


@dataclass(frozen=True, eq=False)
class SchemeOutcome:
    """What one scheme makes of the case.

    Attributes
    ----------
    treatment : treatment
        The scheme.
    response : Response
        Its response.
    rests : structured array
        time (s) of each rest; certified: time of the proven rest that it stands for, NaN where the block does not rest
        (a false rest); error: their difference, s; speed: what the last impact left, over p alpha, and the scheme took
        away.
    missed : ndarray
        Times of proven rests that the scheme does not find, s.
    peak_error : float
        Relative error of the peak rotation.
    rotation_error : float
        Largest difference from the certified rotation, over the smaller slenderness.
    overturns_wrongly : bool
        Whether the verdict on overturning is wrong.
    """

    treatment: Treatment
    response: Response
    rests: NDArray[np.void]
    missed: Floats
    peak_error: float
    rotation_error: float
    overturns_wrongly: bool

    def __repr__(self) -> str:
        return f"<SchemeOutcome: {self.treatment.label}: {self.verdict}>"

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
        if self.response.stalled:
            faults.append(f"{counted(self.response.stalled, 'rest')} only as time no longer advanced")
        return "; ".join(faults) or "every rest found, no other"


@dataclass(frozen=True, eq=False, repr=False)
class SchemeComparison(Result):
    """One case by several schemes, from `compare_schemes`; ``print`` it for a table.

    Attributes
    ----------
    certified : Response
        What the others are measured against.
    outcomes : tuple of SchemeOutcome
        One for each scheme that is applicable, in order.
    not_applicable : tuple of (treatment, str)
        Schemes that refuse the case, and why.
    """

    certified: Response
    outcomes: tuple[SchemeOutcome, ...]
    not_applicable: tuple[tuple[Treatment, str], ...]

    def _headline(self) -> str:
        right = sum(outcome.is_right for outcome in self.outcomes)
        return (
            f"{right} of {len(self.outcomes)} schemes find what the certified one finds; "
            f"{len(self.not_applicable)} not applicable"
        )

    def __str__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        header = ["scheme", "rests", "false", "missed", "worst error, s", "impacts", "rotation off by", "verdict"]
        certified = self.certified
        rows: list[list[Any]] = [
            ["certified", len(_rests(certified)), "", "", "", len(certified.impacts), "", _account(certified)]
        ]
        for outcome in self.outcomes:
            worst = outcome.largest_error
            rows.append(
                [
                    outcome.treatment.label,
                    len(outcome.rests),
                    outcome.false_rests.size,
                    outcome.missed.size,
                    "" if math.isnan(worst) else f"{worst:+.2e}",
                    len(outcome.response.impacts),
                    f"{outcome.rotation_error:.1e}",
                    outcome.verdict,
                ]
            )
        refused = [f"{scheme.label}: not applicable, {reason}" for scheme, reason in self.not_applicable]
        return "\n".join([text_table(header, rows), *refused])

    def to_dict(self) -> dict[str, Any]:
        return {
            "certified": {"rests_s": _rests(self.certified)[:, 0], "impacts": len(self.certified.impacts)},
            "schemes": [
                {
                    "scheme": str(outcome.treatment),
                    "rests": rows_of(outcome.rests),
                    "missed_s": outcome.missed,
                    "impacts": len(outcome.response.impacts),
                    "peak_error": outcome.peak_error,
                    "rotation_error": outcome.rotation_error,
                    "overturns_wrongly": outcome.overturns_wrongly,
                    "is_right": outcome.is_right,
                    "verdict": outcome.verdict,
                }
                for outcome in self.outcomes
            ],
            "not_applicable": {str(scheme): reason for scheme, reason in self.not_applicable},
        }


def compare_schemes(
    block: Block,
    motion: Motion | None,
    *,
    schemes: Sequence[Treatment] = SCHEMES,
    model: Model = "nonlinear",
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
    threads: int | None = None,
    progress: bool | None = None,
) -> SchemeComparison:
    """Run one case with every scheme that ends chattering, and measure each against the certified response.

    Two blocks at rest at the same time stay together until the motion lifts them. So a rest of a scheme stands for the
    certified rest with which it overlaps; if there is none, it is false, and a certified rest without counterpart is
    missed. All responses go on until the last rest or overturning, so that no sequence is cut short.

    Parameters
    ----------
    block : Block
        What rocks.
    motion : Motion or None
        What shakes it.
    schemes : sequence of Treatment
        By default velocity thresholds from 5e-10 to 5e-2 (both in the paper's Fig. 11), intervals of 1e-9 and 1e-3 s,
        and the paper's asymptotic time.
    model : {"nonlinear", "linear"}
        Equation of motion.
    initial_rotation, initial_velocity : float
        As for `rocking.simulate`.
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
        As `rocking.simulate`.

    Notes
    -----
    Source: the paper's section 5.2 and Figs 8, 10 and 11.

    Examples
    --------
    The paper's Fig. 11: above the critical amplitude chattering is incomplete, but a coarse threshold rests.

    >>> import math, rocking
    >>> block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    >>> motion = rocking.pulses.sine(1.05 * block.gravity * 0.2, 1.0 / math.pi, cycles=2.5)
    >>> schemes = rocking.VelocityThreshold(5e-10), rocking.VelocityThreshold(5e-2)
    >>> comparison = compare_schemes(block, motion, schemes=schemes, model="linear")
    >>> [outcome.is_right for outcome in comparison.outcomes], comparison.outcomes[1].false_rests.size
    ([True, False], 4)
    """

    def response(treatment: Treatment) -> Response:
        found = simulate(
            block,
            motion,
            model=model,
            chattering=treatment,
            initial_rotation=initial_rotation,
            initial_velocity=initial_velocity,
        )
        require_finished(np.array([found.unfinished]))
        return found

    def tried(scheme: Treatment) -> SchemeOutcome | str:
        try:
            return _outcome(scheme, response(scheme), certified)
        except InvalidOption as error:
            # The certified run has checked everything but the scheme itself.
            return str(error)

    count = None if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)
    all_schemes = checks.several(schemes, "schemes", InvalidOption)
    certified = response(Certified())
    outcomes, refused = [], []
    with Progress("simulating", len(all_schemes), show=progress) as bar:
        for scheme, found in zip(all_schemes, in_threads(tried, all_schemes, threads=count), strict=True):
            if isinstance(found, str):
                refused.append((scheme, found))
            else:
                outcomes.append(found)
            bar.advance()
    return SchemeComparison(certified, tuple(outcomes), tuple(refused))


def _outcome(scheme: Treatment, response: Response, certified: Response) -> SchemeOutcome:
    stretches, proven = _rests(response), _rests(certified)
    rests = np.zeros(len(stretches), REST)
    rests["time"] = stretches[:, 0]
    rests["certified"] = [_counterpart(stretch, proven) for stretch in stretches]
    rests["error"] = rests["time"] - rests["certified"]
    rests["speed"] = [_speed_left(response, time) for time in rests["time"]]
    found = rests["certified"]
    peak, reference = response.peak_rotation, certified.peak_rotation
    return SchemeOutcome(
        treatment=scheme,
        response=response,
        rests=rests,
        missed=np.setdiff1d(proven[:, 0], found[~np.isnan(found)]),
        peak_error=0.0 if peak == reference else peak / reference - 1.0,
        rotation_error=_rotation_error(response, certified),
        overturns_wrongly=response.overturned != certified.overturned,
    )


def _rests(response: Response) -> Floats:
    """Start and end of each rest that follows an impact, shape (n, 2); the last may have no end."""
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


def _speed_left(response: Response, rest: float) -> float:
    """Speed over p alpha that the last impact before a rest left."""
    last = response.impacts[np.searchsorted(response.impacts["time"], rest, side="right") - 1]
    side = response.block.sides[0 if last["side"] > 0 else 1]
    return float(last["speed_after"]) / (side.p * side.alpha)


def _rotation_error(response: Response, certified: Response) -> float:
    end = min(response.duration, certified.duration)
    nodes = np.concatenate([trail_of(response).nodes["time"], trail_of(certified).nodes["time"]])
    times = np.concatenate([np.linspace(0.0, end, _EVEN_TIMES), nodes[nodes <= end]])
    slenderness = min(side.alpha for side in certified.block.sides)
    return float(np.max(np.abs(response.rotation(times) - certified.rotation(times)))) / slenderness


def _account(certified: Response) -> str:
    """Say what the certified response comes to."""
    ending = "overturns" if certified.overturned else "does not overturn"
    widths = certified.chattering["upper"] - certified.chattering["lower"]
    if not widths.size:
        return f"no rest; {ending}"
    if np.isnan(widths).any():
        return f"{counted(int(np.isnan(widths).sum()), 'rest')} not proven; {ending}"
    return f"every rest known to {widths.max():.0e} s; {ending}"
