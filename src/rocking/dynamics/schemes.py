"""One case by every scheme for impacts and their end, against the certified response: where each goes wrong."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.comparison import FAMILIES, REST, Scheme, SchemeComparison, SchemeOutcome
from rocking.dynamics.simulation import model_of, position_at_start, simulate_any
from rocking.dynamics.stepping import (
    MoreauJean,
    SchatzmanPaoli,
    SteppedResponse,
    TimeStepping,
    integrate,
)
from rocking.engine import require_finished
from rocking.errors import InvalidBlock, InvalidOption
from rocking.kernels import state
from rocking.kernels.march import march
from rocking.motion.motion import Motion
from rocking.progress import Progress
from rocking.response import Response, trail_of
from rocking.response.answers import history_of
from rocking.response.history import History
from rocking.threads import in_threads
from rocking.treatment import (
    AsymptoticTime,
    Certified,
    GeometricBypass,
    IntervalThreshold,
    Treatment,
    VelocityThreshold,
    treatment,
)

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

#: Even times at which two positions are compared, besides the nodes of both.
_EVEN_TIMES: Final = 4001

#: Steps of time stepping at whose ends positions are compared, evenly from the first to the last.
_COMPARED_STEPS: Final = 200_000

#: Time stepping goes on for longer than the certified response by this factor: rests and overturning may come late.
_LONGER: Final = 1.05


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
        Equation of motion, by default the nonlinear one of a body that rocks.
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
    if not chosen:
        raise InvalidOption("{} must hold at least one scheme", "schemes")

    equation, position = model_of(body, model), position_at_start(body, initial_position)
    shared: dict[str, Any] = {"initial_velocity": initial_velocity}

    def marched(how: Treatment) -> Response:
        found = simulate_any(
            body, motion, model=equation, chattering=how, duration=duration, initial_position=position, **shared
        )
        require_finished(found.unfinished)
        return found

    proof = marched(Certified())
    exact = history_of(proof)
    until = proof.duration if proof.stopped else _LONGER * proof.duration
    if again:
        _compile(proof)

    def stepped(how: TimeStepping) -> SteppedResponse:
        return integrate(body, motion, how, until, model=equation, initial_position=position, **shared)

    def tried(scheme: Scheme) -> SchemeOutcome | str:
        run: Callable[[], Response | SteppedResponse]
        run = partial(stepped, scheme) if isinstance(scheme, TimeStepping) else partial(marched, scheme)
        try:
            found = _outcome(scheme, run(), proof, exact)
        except (InvalidBlock, InvalidOption) as error:
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
    certified = replace(certified, position_error=0.0)  # what it does not resolve is no error of the reference
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
    if isinstance(scheme, Treatment):
        return scheme
    name, _, value = scheme.partition("=") if isinstance(scheme, str) else ("", "", "")
    if name not in FAMILIES:
        raise InvalidOption(f"a scheme must be one of {', '.join(FAMILIES)}, not {scheme!r}", "schemes", value=scheme)
    kinds = {kind.name: kind for kind in (MoreauJean, SchatzmanPaoli)}
    if name not in kinds:
        return treatment(scheme)
    try:
        return kinds[name](float(value))
    except ValueError:
        raise InvalidOption(
            f"{name} takes its step in s, as {name}=1e-3, not {value!r}", "schemes", value=scheme
        ) from None


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
        wrong_verdict=response.overturned != certified.overturned,
    )


def _peak(response: Response | SteppedResponse) -> float:
    return response.peak_rotation if isinstance(response, Response) else response.peak


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
        nodes = np.unique(np.concatenate([trail_of(response).nodes["time"], exact.trail.nodes["time"]]))
        between = 0.5 * (nodes[1:] + nodes[:-1])  # many nodes are impacts, at which both positions are zero
        times = np.concatenate([np.linspace(0.0, end, _EVEN_TIMES), nodes, between])
        times = times[times <= end]
        position = response.states(np.minimum(times, response.duration))[:, 0]  # at rest to the end of its own
    return float(np.max(np.abs(position - exact.states(times)[:, 0])))
