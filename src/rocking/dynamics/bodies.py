"""The kinds of bodies on a line: a ball, an oscillator and a pendulum. What differs is the sign of the stiffness."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rocking import checks
from rocking.body import KINDS
from rocking.constants import STANDARD_GRAVITY
from rocking.dynamics.linear_bodies import Law, LinearBody, MakerOfKind
from rocking.errors import InvalidBlock


@dataclass(frozen=True)
class BouncingBall(LinearBody):
    """A ball that bounces on a table: x'' = -g - a(t), x >= 0.

    The motion is that of the table, positive up. The ball rests on the table until that goes down faster than g.

    Parameters
    ----------
    restitution : float
        Speed after an impact over that before, relative to the table.
    gravity : float
        Acceleration of gravity, m/s^2.

    Raises
    ------
    InvalidBlock
        If the restitution is not between 0 and 1, or the gravity not positive.

    References
    ----------
    J. M. Luck and A. Mehta, "Bouncing ball with a finite restitution: chattering, locking, and chaos", Physical Review
    E 48 (1993).

    Examples
    --------
    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> f"{dynamics.simulate(ball, None, initial_position=0.2).events['time'][0]:.12f}"
    '0.600000000000'
    """

    kind: ClassVar[str] = "bouncing-ball"
    units: ClassVar[Mapping[str, str]] = {"restitution": "", "gravity": "m/s^2"}

    restitution: float
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        self._check("gravity")

    @property
    def law(self) -> Law:
        """Equation of motion: nothing but gravity."""
        return Law(0.0, 0.0, self.gravity, 0.0, math.inf)


@dataclass(frozen=True)
class ImpactOscillator(LinearBody):
    """A mass on a spring that hits one stop or two: x'' + 2 zeta w x' + w^2 x = -a(t), x >= -stop.

    The motion is that of the support, to which spring, damper and stops are fixed.

    Parameters
    ----------
    frequency : float
        Natural frequency w/(2 pi), Hz.
    restitution : float
        Speed after an impact over that before.
    damping_ratio : float
        Zeta; 0 without damping, below 1.
    stop : float
        Distance from the position without force in the spring to the stop, m; negative where the spring presses the
        mass against it.
    second_stop : float, optional
        Position of a stop on the other side, m: x <= second_stop.

    Raises
    ------
    InvalidBlock
        If a parameter is out of its range, or the second stop is not above the first.

    References
    ----------
    S. W. Shaw and P. J. Holmes, "A periodically forced piecewise linear oscillator", Journal of Sound and Vibration 90
    (1983). C. Budd and F. Dux, "Chattering and related behaviour in impact oscillators", Philosophical Transactions of
    the Royal Society A 347 (1994).

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
    units: ClassVar[Mapping[str, str]] = {
        "frequency": "Hz", "restitution": "", "damping_ratio": "", "stop": "m", "second_stop": "m",
    }  # fmt: skip

    frequency: float
    restitution: float
    damping_ratio: float = 0.0
    stop: float = 0.0
    second_stop: float | None = None

    def __post_init__(self) -> None:
        self._check("frequency")
        damping = checks.finite(self.damping_ratio, "damping_ratio", InvalidBlock)
        if not 0.0 <= damping < 1.0:
            raise InvalidBlock(f"{{}} must be at least 0 and below 1, not {damping:g}", "damping_ratio", value=damping)
        stop = checks.finite(self.stop, "stop", InvalidBlock)
        if self.second_stop is not None and not checks.finite(self.second_stop, "second_stop", InvalidBlock) > -stop:
            raise InvalidBlock(
                f"{{}} = {self.second_stop:g} m must be above -{{}} = {-stop:g} m, the position of the first",
                "second_stop", "stop", value=self.second_stop,
            )  # fmt: skip

    @property
    def law(self) -> Law:
        """Equation of motion: a spring and a damper."""
        w = 2.0 * math.pi * self.frequency
        high = math.inf if self.second_stop is None else self.second_stop
        return Law(-w * w, 2.0 * self.damping_ratio * w, 0.0, -self.stop, high)


@dataclass(frozen=True)
class InvertedPendulum(LinearBody):
    """An inverted pendulum between two walls, for small angles: x'' = p^2 x - a(t), -gap <= x <= gap.

    The motion is that of the support, horizontally. It rests against a wall until the support pulls it off.

    Parameters
    ----------
    p : float
        Rate at which it falls, rad/s: sqrt(g/l) of a pendulum of length l.
    gap : float
        Distance from the upright position to each wall, m.
    restitution : float
        Speed after an impact over that before.

    Raises
    ------
    InvalidBlock
        If a parameter is out of its range.

    References
    ----------
    S. W. Shaw and R. H. Rand, "The transition to chaos in a simple mechanical system", International Journal of
    Non-Linear Mechanics 24 (1989).

    Examples
    --------
    >>> from rocking import dynamics
    >>> pendulum = dynamics.InvertedPendulum(p=3.0, gap=0.1, restitution=0.6)
    >>> response = dynamics.simulate(pendulum, None, initial_position=0.02)
    >>> float(response.position(response.duration)), response.events["kind"].tolist()
    (0.1, ['rest'])
    """

    kind: ClassVar[str] = "inverted-pendulum"
    units: ClassVar[Mapping[str, str]] = {"p": "rad/s", "gap": "m", "restitution": ""}

    p: float
    gap: float
    restitution: float

    def __post_init__(self) -> None:
        self._check("p", "gap")

    @property
    def law(self) -> Law:
        """Equation of motion: it falls away from the upright position."""
        return Law(self.p * self.p, 0.0, 0.0, -self.gap, self.gap)


KINDS.update({made.kind: MakerOfKind(made) for made in (BouncingBall, ImpactOscillator, InvertedPendulum)})
