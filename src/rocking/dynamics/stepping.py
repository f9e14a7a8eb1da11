"""Time stepping with a fixed step, for comparison: schemes that locate no impact, and what they make of a body."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import Model
from rocking.dynamics.simulation import model_of, position_at_start
from rocking.engine import check_components
from rocking.errors import InvalidBlock, InvalidOption
from rocking.kernels import state, stepping
from rocking.motion.motion import Motion
from rocking.motion.named import one_motion
from rocking.problem import ground_of, one_body, rules_of
from rocking.simulation import started
from rocking.treatment import Certified

#: Steps in contact without a break from which on a body is at rest: an impact takes three at most, and one of the last
#: before a rest a dozen.
_STEPS_AT_REST: Final = 16

#: Largest number of steps: the rows are half a gigabyte.
_MOST_STEPS: Final = 20_000_000

#: Longest step over the time in which the body's own motion grows or is damped by e, or turns by a radian.
_LONGEST_STEP: Final = 0.5

#: Logarithm of the largest factor by which a scheme may enlarge an oscillation of the body until the end.
_MOST_GROWTH: Final = 1.0


@dataclass(frozen=True)
class TimeStepping(ABC):
    """A scheme with a fixed step that locates no impact.

    Parameters
    ----------
    step : float
        Length of a step, s.

    Raises
    ------
    InvalidOption
        If the step is not positive and finite.
    """

    #: Name, as in ``moreau-jean=1e-3``.
    name: ClassVar[str]

    step: float

    def __post_init__(self) -> None:
        checks.positive(self.step, "step", InvalidOption, "s")

    @property
    @abstractmethod
    def label(self) -> str:
        """Short name with the parameters and their units, for tables and figures."""

    @property
    def _growth(self) -> float:
        """Logarithm of the factor by which a step enlarges an oscillation, over half the square of its phase."""
        return 0.0

    @abstractmethod
    def _follow(self, problem: tuple[Any, state.Record, state.Record, state.Record], out: Floats) -> int:
        """Write steps into rows, and return how many."""

    def __str__(self) -> str:
        """Write the scheme so that `scheme_of` reads it back, apart from parameters that are not the step."""
        return f"{self.name}={self.step}"


@dataclass(frozen=True)
class MoreauJean(TimeStepping):
    """Moreau and Jean's scheme: the theta method, with the constraint and Newton's restitution on velocities.

    At each step the velocity v' = v + h (theta f' + (1 - theta) f) is computed as if there were no contact, f being the
    acceleration at both ends. Where u + h v/2 <= 0 the contact is active: v' is then at least -e v. The coordinate
    follows as u' = u + h (theta v' + (1 - theta) v).

    Parameters
    ----------
    step : float
        Length h of a step, s.
    theta : float
        0 is explicit, 1 implicit; 0.5 is of second order where there are no impacts. Below 0.5 oscillations grow, so
        that a body which swings about its stop, as by a spring, needs short steps.

    Raises
    ------
    InvalidOption
        If the step is not positive and finite, or theta not within [0, 1].

    Notes
    -----
    Source: Moreau, J. J. (1988). Unilateral contact and dry friction in finite freedom dynamics; Jean, M. (1999). The
    non-smooth contact dynamics method. Computer Methods in Applied Mechanics and Engineering 177, 235-257. When the
    contact is active is as in Siconos.
    """

    name: ClassVar[str] = "moreau-jean"

    theta: float = 0.5

    #: Share of the step by which the coordinate is predicted to see whether the contact is active.
    AHEAD: ClassVar[float] = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.within(self.theta, "theta", InvalidOption, 0.0, 1.0)

    @property
    def label(self) -> str:
        """Name, step, and theta if it is not one half."""
        theta = "" if self.theta == 0.5 else f", theta {self.theta:g}"
        return f"Moreau-Jean {self.step:g} s{theta}"

    @property
    def _growth(self) -> float:
        return max(0.0, 1.0 - 2.0 * self.theta)

    def _follow(self, problem: tuple[Any, state.Record, state.Record, state.Record], out: Floats) -> int:
        return int(stepping.moreau_jean(*problem, self.theta, self.AHEAD, self.step, out))


@dataclass(frozen=True)
class SchatzmanPaoli(TimeStepping):
    """Schatzman and Paoli's scheme: central differences, with the constraint and the restitution on positions.

    At each step u'' is replaced by (u_{k+1} - 2 u_k + u_{k-1})/h^2, at the acceleration of the middle one, and u_{k+1}
    is at least -e u_{k-1}.

    Parameters
    ----------
    step : float
        Length h of a step, s.

    Raises
    ------
    InvalidOption
        If the step is not positive and finite.

    Notes
    -----
    Source: Paoli, L. and Schatzman, M. (2002). A numerical scheme for impact problems. SIAM Journal on Numerical
    Analysis 40(2), 702-768.
    """

    name: ClassVar[str] = "schatzman-paoli"

    @property
    def label(self) -> str:
        """Name and step."""
        return f"Schatzman-Paoli {self.step:g} s"

    def _follow(self, problem: tuple[Any, state.Record, state.Record, state.Record], out: Floats) -> int:
        return int(stepping.schatzman_paoli(*problem, self.step, out))


@dataclass(frozen=True, eq=False, repr=False)
class SteppedResponse:
    """What a scheme of time stepping makes of one body and one motion; from `integrate`.

    Attributes
    ----------
    body, motion, model, scheme
        What was computed, and how.
    times, position, velocity, impulse : ndarray, shape (n,)
        The ends of the steps, s; the body's coordinate and velocity there; what the contact added to the speed within
        the step before.
    overturned : bool
        Whether it ends with an overturning.
    rests : ndarray, shape (m, 2)
        Start and end of each time during which the contact pushed at every step, s: 16 steps at least, of which the
        body came to the first from an impact. One that lasts to the end ends at infinity.
    impact_times : ndarray
        Starts of all other times in contact, and of rests, s.
    peak : float
        As the peak rotation or position of the response by `rocking.simulate` or `rocking.dynamics.simulate`.
    penetration : float
        How far the coordinate comes to be on the wrong side of the contact.
    """

    body: Body
    motion: Motion | None
    model: Model
    scheme: TimeStepping
    times: Floats
    position: Floats
    velocity: Floats
    impulse: Floats
    overturned: bool
    rests: Floats
    impact_times: Floats
    peak: float
    penetration: float

    def __repr__(self) -> str:
        found = f"{len(self.impact_times)} impacts, {len(self.rests)} rests, peak {self.peak:.5g}"
        return (
            f"<SteppedResponse: {self.body.description} by {self.scheme.label}: {len(self.times) - 1} steps, {found}>"
        )


def integrate(
    body: Body,
    motion: Motion | None,
    scheme: TimeStepping,
    duration: float,
    *,
    model: Model | None = None,
    initial_position: float | None = None,
    initial_velocity: float = 0.0,
) -> SteppedResponse:
    """Integrate the motion of a body by time stepping, to compare with `rocking.simulate`.

    Parameters
    ----------
    body : Body
        A block, or one of `rocking.dynamics`.
    motion : Motion or None
        What shakes it; None for free motion.
    scheme : TimeStepping
        `MoreauJean` or `SchatzmanPaoli`, with its step.
    duration : float
        Time to stop at, s; the last step ends there or later.
    model : {"nonlinear", "linear"}, optional
        Equation of motion, by default the nonlinear one of a body that rocks.
    initial_position, initial_velocity : float
        As for `rocking.dynamics.simulate`; of a block its rotation.

    Returns
    -------
    SteppedResponse
        The state at the end of each step, and the rests and impacts that can be read from them.

    Raises
    ------
    InvalidBlock, InvalidMotion
        If the body is none, its restitution varies from impact to impact, or a tendon of it yields; or if the motion is
        no `Motion`, or one with a vertical component for a body on a line.
    InvalidOption
        If an argument is out of its range, or the step too long for the body, or too short for the duration.

    Notes
    -----
    The coordinate is followed in the frame of the side, u >= 0, where every impact is one against a constraint with
    Newton's restitution. A block changes its side at the step in which the contact pushes, and the equation of motion
    with it. At rest the contact pushes at every step, so that the sides take turns (every third step by
    `SchatzmanPaoli`, since it takes up to three for one impact); the block is lifted to the first on which nothing need
    push.

    Examples
    --------
    A ball is dropped as in an example of Siconos. It comes to rest a little below the table, and early: the impacts
    accumulate at 8.579 s.

    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.9, gravity=9.81)
    >>> found = dynamics.integrate(ball, None, dynamics.MoreauJean(0.005), 10.0, initial_position=1.0)
    >>> f"{found.rests[0, 0]:.3f} s, {found.position[-1]:.6f} m"
    '8.485 s, -0.000023 m'
    """
    one, motion = one_body(body), one_motion(motion)
    alone, how = one.alone(), Certified()
    check_components(alone, motion)
    stop = checks.positive(duration, "duration", InvalidOption, "s")
    equation = model_of(one, model)
    rules = rules_of(alone, equation, how, stop, record=True)
    records = alone.kernel_records(equation, how.limits(alone, motion, equation))
    record = records[0]
    if record["varying"]:
        raise InvalidBlock("time stepping knows no {} that varies from impact to impact: give a number", "restitution")
    if record["yielding"]:
        raise InvalidBlock("time stepping knows no tendon that yields: leave its {} out", "strength")
    if not isinstance(scheme, TimeStepping):
        raise InvalidOption(
            f"{{}} must be one of time stepping, as MoreauJean(1e-3), not {scheme!r}", "scheme", value=scheme
        )
    h, longest = scheme.step, _longest_step(scheme, record, stop, nonlinear=equation == "nonlinear")
    if h > longest:
        raise InvalidOption(f"{{}} of {h:g} s is too long for this body: at most {longest:.3g} s", "step", value=h)
    count = math.ceil(stop / h * (1.0 - 2.0**-50))
    if count > _MOST_STEPS:
        raise InvalidOption(
            f"{count} steps of {h:g} s are too many; at most {_MOST_STEPS} may be taken: give a longer {{}}",
            *("step",),
            value=h,
        )
    start = started(alone, records, position_at_start(one, initial_position), initial_velocity, "initial_position")
    rows = np.zeros((count + 1, stepping.COLUMNS))
    rows = rows[: scheme._follow((ground_of(motion, one.gravity), record, rules, start), rows)]
    times: Floats = h * np.arange(len(rows), dtype=np.float64)
    side, u, impulse = rows[:, stepping.SIDE], rows[:, stepping.COORDINATE], rows[:, stepping.IMPULSE]
    rests, impacts = _contacts(times, impulse > 0.0)
    return SteppedResponse(
        body=one,
        motion=motion,
        model=equation,
        scheme=scheme,
        times=times,
        position=side * u + one.stops[0],
        velocity=side * rows[:, stepping.VELOCITY],
        impulse=impulse,
        overturned=bool(u[-1] >= record["fallen"] and not record["facing"]),
        rests=rests,
        impact_times=impacts,
        peak=float(u.max()) + one.stops[0],
        penetration=max(0.0, -float(u.min()), float(u.max() - record["fallen"]) if record["facing"] else 0.0),
    )


def _longest_step(scheme: TimeStepping, record: state.Record, stop: float, *, nonlinear: bool) -> float:
    """Longest step, s, by which a scheme follows a body that nothing shakes until ``stop``; infinite without a bound.

    The derivative of its acceleration by the coordinate is between two bounds on each side, at any rotation.
    """
    weight, push = 1.0 + record["added_weight"], np.abs(record["added_push"])
    low = high = record["stiffness"] * weight - record["spring"]
    if nonlinear:  # the weight counts with a cosine that is not negative, the push with a sine of any sign
        low = record["stiffness"] * (np.minimum(weight, 0.0) - push) - record["spring"]
        high = record["stiffness"] * (np.maximum(weight, 0.0) + push) - record["spring"] + 0.5 * record["prestress"]
    rate = max(math.sqrt(float(np.max(np.abs([low, high])))), float(np.max(record["damping"])))
    growth = scheme._growth * max(0.0, -float(np.min(low)))  # of an oscillation, per time and step
    return min(_LONGEST_STEP / rate if rate else math.inf, 2.0 * _MOST_GROWTH / (growth * stop) if growth else math.inf)


def _contacts(times: Floats, pushes: Any) -> tuple[Floats, Floats]:
    """Rests that follow an impact, and times of all impacts, from whether the contact pushes in each step."""
    edges = np.diff(np.concatenate([[False], pushes, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    came = starts > 1  # not at rest from the first step on
    starts, ends = starts[came], ends[came]
    rests = ends - starts >= _STEPS_AT_REST
    until = np.append(times, math.inf)[ends]
    return np.column_stack([times[starts], until])[rests], times[starts]
