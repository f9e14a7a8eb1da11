"""Bodies on a line between stops: a bouncing ball, an impact oscillator and an inverted pendulum.

All satisfy x'' = stiffness x - damping x' - pull - a(t), with x relative to a table or support of acceleration a(t). At
a stop the velocity is reversed and multiplied by the restitution.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import rocking.response
from rocking.block.body import BODIES_TYPES, CoordinateLabels
from rocking.core import checks
from rocking.core.arrays import Floats, Integers, unwrap_scalar
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.engine.problem import conserves_speed
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import BlockError, OptionError
from rocking.kernels import state
from rocking.motion.motion import Motion
from rocking.records.named import check_motion
from rocking.simulation.simulate import compute_response


class EquationOfMotion(NamedTuple):
    """Equation of motion: stiffness (1/s^2), damping (1/s), pull (m/s^2) and stops (m; the second may be infinite).

    See Also
    --------
    rocking.dynamics.BouncingBall : Create a ball on a table.
    rocking.dynamics.ImpactOscillator : Create an oscillator with stops.

    Examples
    --------
    >>> from rocking import dynamics
    >>> dynamics.BouncingBall(0.8, gravity=10.0).equation
    EquationOfMotion(stiffness=0.0, damping=0.0, pull=10.0, low=0.0, high=inf)
    """

    stiffness: float
    damping: float
    pull: float
    low: float
    high: float


@dataclass(frozen=True)
class LinearBody(ABC):
    """Base class of the bodies, which implements the protocol `rocking.block.body.Body`."""

    coordinate: ClassVar[CoordinateLabels] = CoordinateLabels("position", "velocity", "acceleration", "m")
    balance: ClassVar[tuple[float, float]] = (math.inf, math.inf)
    contact_law: ClassVar[None] = None
    kind: ClassVar[str]
    units: ClassVar[Mapping[str, str]]

    @property
    @abstractmethod
    def equation(self) -> EquationOfMotion:
        """Equation of motion."""

    @property
    def gravity(self) -> float:
        """Unit of accelerations, m/s^2."""
        return STANDARD_GRAVITY

    @property
    def description(self) -> str:
        """Description in words."""
        return self.kind.replace("-", " ")

    @property
    def sides(self) -> Sequence[object]:
        """Parameters as text."""
        known = {entry.name: value for entry in fields(self) if (value := getattr(self, entry.name)) is not None}
        texts = (f"{k.replace('_', ' ')} = {v:.5g} {self.units.get(k, '')}".rstrip() for k, v in known.items())
        return (", ".join(texts),)

    @property
    def stops(self) -> tuple[float, float]:
        """Positions of the stops, m; with a single stop, its position twice."""
        low, high = self.equation.low, self.equation.high
        return low, (high if math.isfinite(high) else low)

    def uplift_thresholds(self, model: Model = "linear") -> tuple[float, float]:
        """Accelerations (m/s^2) that lift the body off its stops: -a for the first, a for the second; or inf."""
        _require_linear_model(model)
        stiffness, _, pull, low, high = self.equation
        return pull - stiffness * low, stiffness * high - pull if math.isfinite(high) else math.inf

    def as_bodies(self) -> LinearBodies:
        """Return a `LinearBodies` that contains only this body."""
        return LinearBodies((self,))

    def _check_parameters(self, *positive: str) -> None:
        """Check the restitution and that the named parameters are positive, and convert numbers to floats."""
        for name in positive:
            object.__setattr__(self, name, checks.positive(getattr(self, name), name, BlockError, self.units[name]))
        restitution = checks.finite(self.restitution, "restitution", BlockError)  # type: ignore[attr-defined]
        if not 0.0 <= restitution <= 1.0:
            raise BlockError(f"{{}} must be from 0 to 1, not {restitution:g}", "restitution", value=restitution)
        object.__setattr__(self, "restitution", restitution)


@dataclass(frozen=True, eq=False)
class LinearBodies:
    """Collection of n bodies of one kind.

    Parameters
    ----------
    members : sequence
        Bodies of one kind, with the same gravity.

    Raises
    ------
    BlockError
        If the sequence is empty or contains bodies of several kinds.

    See Also
    --------
    simulate : Simulate a single body.

    Examples
    --------
    >>> from rocking.dynamics import BouncingBall
    >>> LinearBodies([BouncingBall(0.8), BouncingBall(0.9)])
    <LinearBodies: 2 of kind bouncing-ball>
    """

    members: tuple[LinearBody, ...]

    def __init__(self, members: Sequence[LinearBody]) -> None:
        bodies = tuple(members)
        if len({type(body) for body in bodies}) != 1 or not isinstance(bodies[0], LinearBody):
            raise BlockError("members must be bodies of rocking.dynamics, all of the same kind")
        if len({body.gravity for body in bodies}) > 1:
            raise BlockError("all bodies must have the same {}", "gravity")
        object.__setattr__(self, "members", bodies)

    @property
    def kind(self) -> str:
        """Name of the kind."""
        return self.members[0].kind

    @property
    def gravity(self) -> float:
        """Unit of accelerations, m/s^2."""
        return self.members[0].gravity

    @property
    def restitution(self) -> Floats:
        """Coefficients of restitution at the stops, shape (n, 2)."""
        return self._repeat_for_stops("restitution")

    @property
    def stops(self) -> Floats:
        """Positions of the stops, m, shape (n, 2)."""
        return np.array([body.stops for body in self.members])

    @property
    def is_symmetric(self) -> bool:
        """Whether every body is between two stops at equal distances, without a pull."""
        equations = [body.equation for body in self.members]
        return all(equation.pull == 0.0 and equation.low == -equation.high for equation in equations)

    def __len__(self) -> int:
        return len(self.members)

    def __getitem__(self, index: int) -> LinearBody:
        return self.members[index]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self)} of kind {self.kind}>"

    def select(self, index: slice | Integers) -> LinearBodies:
        return LinearBodies([self.members[k] for k in np.arange(len(self))[index]])

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        names = [entry.name for entry in fields(self.members[0]) if entry.name != "gravity"]
        return {name: (self._repeat_for_stops(name), self.members[0].units.get(name, "1")) for name in names}

    def speed_thresholds(self, share: float) -> Floats:
        return np.full((len(self), 2), share)  # these bodies have no natural speed

    def create_kernel_structs(self, model: Model, thresholds: Floats) -> state.Structs:
        _require_linear_model(model)
        structs = state.create_structs(len(self), state.BLOCK_DTYPE)
        equations = np.array([body.equation for body in self.members])
        two_stops = np.isfinite(equations[:, 4])
        structs["stiffness"] = equations[:, :1]
        structs["damping"] = equations[:, 1:2]
        structs["restrained"] = equations[:, 1] > 0.0
        structs["restoring_gain"] = self.gravity
        structs["threshold"] = np.array([body.uplift_thresholds() for body in self.members]) / self.gravity
        structs["restitution"] = self.restitution
        structs["two_stops"] = two_stops
        structs["next_side"][:, 1] = two_stops
        structs["overturn_angle"] = equations[:, 4] - equations[:, 3]
        structs["rest_limit"] = thresholds
        return structs

    def _repeat_for_stops(self, name: str) -> Floats:
        values = [getattr(body, name) for body in self.members]
        return np.repeat(np.array([math.nan if value is None else value for value in values])[:, None], 2, axis=1)


def _require_linear_model(model: Model) -> None:
    if model != "linear":
        correction = 'call rocking.dynamics.simulate, or set {} to "linear"'
        message = f"bodies of rocking.dynamics have linear equations of motion: {correction}"
        raise OptionError(message, "model", value=model)


@dataclass(frozen=True)
class BouncingBall(LinearBody):
    """Ball that bounces on a table: x'' = -g - a(t), x >= 0.

    The motion is the acceleration of the table, positive upwards. The ball rests until the downward acceleration
    exceeds g.

    Parameters
    ----------
    restitution, gravity : float
        Coefficient of restitution (of velocities relative to the table) and acceleration of gravity, m/s^2.

    Raises
    ------
    BlockError
        If the restitution is not between 0 and 1, or the gravity is not positive.

    See Also
    --------
    simulate : Simulate the response.
    ImpactOscillator : Mass on a spring with one or two stops.

    References
    ----------
    :cite:t:`luck1993`, "Bouncing ball with a finite restitution: chattering, locking, and chaos".

    Examples
    --------
    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> f"{dynamics.simulate(ball, None, initial_position=0.2).events['time'][0]:.12f}"
    '0.600000000000'
    """

    kind: ClassVar[str] = "bouncing-ball"
    units: ClassVar[Mapping[str, str]] = {"gravity": "m/s^2"}

    restitution: float
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        self._check_parameters("gravity")

    @property
    def equation(self) -> EquationOfMotion:
        """Equation of motion: gravity alone."""
        return EquationOfMotion(0.0, 0.0, self.gravity, 0.0, math.inf)


@dataclass(frozen=True)
class ImpactOscillator(LinearBody):
    """Mass on a spring with one or two stops: x'' + 2 zeta w x' + w^2 x = -a(t), x >= -stop.

    The motion is the acceleration of the support of spring, damper and stops.

    Parameters
    ----------
    frequency : float
        Natural frequency w/(2 pi), Hz.
    restitution : float
        Coefficient of restitution.
    damping_ratio : float
        Damping ratio zeta, at least 0 and below 1.
    stop : float
        Distance from the position of zero spring force to the stop, m; negative if the spring presses the mass against
        the stop.
    second_stop : float, optional
        Position of a stop on the other side, m: x <= second_stop.

    See Also
    --------
    simulate : Simulate the response.
    InvertedPendulum : Inverted pendulum between two walls.

    References
    ----------
    :cite:t:`shaw1983`, "A periodically forced piecewise linear oscillator". :cite:t:`budd1994`, "Chattering and related
    behaviour in impact oscillators".

    Examples
    --------
    >>> import rocking
    >>> from rocking import dynamics
    >>> oscillator = dynamics.ImpactOscillator(1.0, 0.8, stop=0.01)
    >>> response = dynamics.simulate(oscillator, rocking.pulses.sine(2.0, 0.5, cycles=4))
    >>> len(response.impacts), bool(response.position(4.0) >= -0.01)
    (17, True)
    """

    kind: ClassVar[str] = "impact-oscillator"
    units: ClassVar[Mapping[str, str]] = {"frequency": "Hz", "stop": "m", "second_stop": "m"}

    frequency: float
    restitution: float
    damping_ratio: float = 0.0
    stop: float = 0.0
    second_stop: float | None = None

    def __post_init__(self) -> None:
        self._check_parameters("frequency")
        damping = checks.finite(self.damping_ratio, "damping_ratio", BlockError)
        if not 0.0 <= damping < 1.0:
            raise BlockError(f"{{}} must be at least 0 and below 1, not {damping:g}", "damping_ratio", value=damping)
        stop = checks.finite(self.stop, "stop", BlockError)
        second_stop = self.second_stop
        if second_stop is not None and not checks.finite(second_stop, "second_stop", BlockError) > -stop:
            message = f"{{}} = {second_stop:g} m must be above -{{}} = {-stop:g} m, the position of the first stop"
            raise BlockError(message, "second_stop", "stop", value=second_stop)

    @property
    def equation(self) -> EquationOfMotion:
        """Equation of motion: a spring and a damper."""
        w = 2.0 * math.pi * self.frequency
        high = math.inf if self.second_stop is None else self.second_stop
        return EquationOfMotion(-w * w, 2.0 * self.damping_ratio * w, 0.0, -self.stop, high)


@dataclass(frozen=True)
class InvertedPendulum(LinearBody):
    """Inverted pendulum between two walls, for small angles: x'' = p^2 x - a(t), -gap <= x <= gap.

    The motion is the horizontal acceleration of the support, which can lift the pendulum off a wall.

    Parameters
    ----------
    p : float
        Rate of falling, rad/s: sqrt(g/l) for a pendulum of length l.
    gap : float
        Distance from the upright position to each wall, m.
    restitution : float
        Coefficient of restitution.

    See Also
    --------
    simulate : Simulate the response.
    ImpactOscillator : Mass on a spring with one or two stops.

    References
    ----------
    :cite:t:`shaw1989`, "The transition to chaos in a simple mechanical system".

    Examples
    --------
    >>> from rocking import dynamics
    >>> pendulum = dynamics.InvertedPendulum(p=3.0, gap=0.1, restitution=0.6)
    >>> response = dynamics.simulate(pendulum, None, initial_position=0.02)
    >>> float(response.position(response.duration)), response.events["kind"].tolist()
    (0.1, ['rest'])
    """

    kind: ClassVar[str] = "inverted-pendulum"
    units: ClassVar[Mapping[str, str]] = {"p": "rad/s", "gap": "m"}

    p: float
    gap: float
    restitution: float

    def __post_init__(self) -> None:
        self._check_parameters("p", "gap")

    @property
    def equation(self) -> EquationOfMotion:
        """Equation of motion: the pendulum falls away from the upright position."""
        return EquationOfMotion(self.p * self.p, 0.0, 0.0, -self.gap, self.gap)


class _BodyFactory(NamedTuple):
    """Function that creates bodies of one kind from `LinearBodies.parameters`."""

    body_class: type[LinearBody]

    def __call__(self, *, gravity: float, **parameters: Any) -> LinearBodies:
        gravity_argument = {"gravity": gravity} if self.body_class is BouncingBall else {}
        rows = zip(*(values[:, 0].tolist() for values in parameters.values()), strict=True)
        arguments = ({k: None if math.isnan(v) else v for k, v in zip(parameters, row, strict=True)} for row in rows)
        return LinearBodies([self.body_class(**body_arguments, **gravity_argument) for body_arguments in arguments])

    def from_bodies(self, bodies: Iterable[LinearBody], /) -> LinearBodies:
        return LinearBodies([*bodies])


BODIES_TYPES.update({cls.kind: _BodyFactory(cls) for cls in (BouncingBall, ImpactOscillator, InvertedPendulum)})


@dataclass(frozen=True, eq=False, repr=False)
class PositionResponse(rocking.response.Response):
    """Response of a body between stops, created by `rocking.dynamics.simulate`.

    A `rocking.Response` in positions relative to the table or the support. In events and impacts, ``side`` is +1 at the
    lower and -1 at the upper stop.

    See Also
    --------
    simulate : Simulate the response of a body between stops.

    Examples
    --------
    >>> from rocking import dynamics
    >>> response = dynamics.simulate(dynamics.BouncingBall(0.5, gravity=10.0), None, initial_position=0.2)
    >>> f"position {response.position(0.1):.2f} m, velocity {response.velocity(0.1):.2f} m/s"
    'position 0.15 m, velocity -1.00 m/s'
    """

    @property
    def body(self) -> LinearBody:
        """The body."""
        assert isinstance(self.block, LinearBody)
        return self.block

    @property
    def peak_position(self) -> float:
        """Highest position, m; exactly the position of the second stop once the body has reached it."""
        return self.peak_rotation

    def position(self, time: ArrayLike) -> Floats:
        """Return the position relative to the table or the support at any time, m; NaN outside the response."""
        return unwrap_scalar(self.states(time)[..., 0])

    def velocity(self, time: ArrayLike) -> Floats:
        """Return the derivative of `position`, m/s; at an impact, the velocity just after it."""
        return unwrap_scalar(self.states(time)[..., 1])


def convert_to_positions(response: rocking.response.Response) -> PositionResponse:
    """Convert the response of a body between stops to positions."""
    return PositionResponse(**{entry.name: getattr(response, entry.name) for entry in fields(response)})


def simulate(
    body: LinearBody,
    motion: Motion | None,
    *,
    chattering: str | ChatteringScheme = "certified",
    duration: float | None = None,
    initial_position: float | None = None,
    initial_velocity: float = 0.0,
) -> PositionResponse:
    """Simulate the response of a body between stops to a motion of its table or support.

    Parameters
    ----------
    body : BouncingBall, ImpactOscillator or InvertedPendulum
        Body to simulate.
    motion : Motion or None
        Acceleration of the table (positive upwards) or the support; None for free motion.
    chattering : str or ChatteringScheme
        As in `rocking.simulate`, with velocity thresholds in m/s. By default rest is proven.
    duration : float, optional
        End time, s. By default rest after the motion, or the end of the motion if the body need not come to rest.
    initial_position : float, optional
        Position at time 0, m; by default 0, or the stop if this is behind it.
    initial_velocity : float
        Velocity at time 0, m/s.

    Returns
    -------
    Response
        Events, impacts, chattering sequences, and the position at any time.

    Raises
    ------
    BlockError, MotionError
        If the body is none of these, or the motion is not a `Motion` or has a vertical component.
    OptionError
        If an argument is out of range, the body starts behind a stop, or it never rests and has neither motion nor
        duration.

    See Also
    --------
    stroboscopic_map : Map of a body under periodic motion.
    rocking.simulate : Simulate the response of a block.

    Examples
    --------
    >>> from rocking import dynamics
    >>> response = dynamics.simulate(dynamics.BouncingBall(0.8, gravity=10.0), None, initial_position=0.2)
    >>> f"{response.events['time'][0]:.12f}"
    '1.800000000000'
    """
    body, motion = _require_linear_body(body), check_motion(motion)
    end_time = _choose_duration(body, motion, duration)
    position = min(max(0.0, body.equation.low), body.equation.high) if initial_position is None else initial_position
    start = position, initial_velocity
    return convert_to_positions(compute_response(body, motion, "linear", chattering, end_time, start))


def _require_linear_body(body: object) -> LinearBody:
    if not isinstance(body, LinearBody):
        raise BlockError(
            "a BouncingBall, ImpactOscillator or InvertedPendulum of rocking.dynamics is required, not "
            f"{type(body).__name__}; use rocking.simulate for blocks"
        )
    return body


def _is_pressed(body: LinearBody) -> bool:
    """Whether the body is pressed against one of its stops while its support is at rest."""
    low, high = body.uplift_thresholds()
    return low > 0.0 or 0.0 < high < np.inf


def _choose_duration(body: LinearBody, motion: Motion | None, duration: float | None) -> float | None:
    """Return the requested duration, otherwise None (until rest), or that of the motion if the body need not rest."""
    if duration is not None:
        return duration
    if not _is_pressed(body):
        if motion is None:
            raise OptionError("this body is not pressed against a stop and may never rest; specify {}", "duration")
        return motion.end
    if conserves_speed(body.as_bodies()):
        message = f"a body with {{}} 1, as this {body.description}, never comes to rest; specify {{}}"
        raise OptionError(message, "restitution", "duration")
    return None
