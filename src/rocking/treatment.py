"""How a sequence of impacts is brought to rest: by proof, or by one of the thresholds in use."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from rocking.block import Block
from rocking.errors import InvalidOption
from rocking.kernels import status
from rocking.motion.motion import Motion


@dataclass(frozen=True)
class Certified:
    """Rest where, and only where, the certificate proves complete chattering; the default.

    Parameters
    ----------
    tolerance : float
        Impacts are resolved until the bracket on the time of rest is narrower than this, s.

    Raises
    ------
    InvalidOption
        If the tolerance is not positive and finite.

    Examples
    --------
    >>> Certified(tolerance=1e-9)
    Certified(tolerance=1e-09)
    """

    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        _positive(self.tolerance, "tolerance", "s")

    def code_and_limits(self, block: Block, motion: Motion | None) -> tuple[int, tuple[float, float]]:
        """Code and threshold of each side for the kernels."""
        return status.CERTIFIED, (0.0, 0.0)


@dataclass(frozen=True)
class VelocityThreshold:
    """Rest as soon as an impact leaves less than a threshold of angular speed (paper, Fig. 8b).

    Parameters
    ----------
    threshold : float
        VelTol/(p alpha), the threshold over the side's p and alpha, dimensionless.

    Raises
    ------
    InvalidOption
        If the threshold is not positive and finite.
    """

    threshold: float = 5e-10

    def __post_init__(self) -> None:
        _positive(self.threshold, "threshold", "as a fraction of p alpha")

    def code_and_limits(self, block: Block, motion: Motion | None) -> tuple[int, tuple[float, float]]:
        """Code and threshold of each side for the kernels, rad/s."""
        plus, minus = (self.threshold * side.p * side.alpha for side in block.sides)
        return status.VELOCITY, (plus, minus)


@dataclass(frozen=True)
class IntervalThreshold:
    """Rest as soon as two impacts follow each other within a threshold of time.

    Parameters
    ----------
    threshold : float
        Shortest interval between impacts that is resolved, s.

    Raises
    ------
    InvalidOption
        If the threshold is not positive and finite.
    """

    threshold: float = 1e-9

    def __post_init__(self) -> None:
        _positive(self.threshold, "threshold", "s")

    def code_and_limits(self, block: Block, motion: Motion | None) -> tuple[int, tuple[float, float]]:
        """Code and threshold of each side for the kernels, s."""
        return status.INTERVAL, (self.threshold, self.threshold)


@dataclass(frozen=True)
class AsymptoticTime:
    """Rest once the asymptotic chattering time (paper, Eq. 65) has passed since uplift (paper, Fig. 8a).

    For sinusoidal motions and symmetric blocks only. Where the amplitude is above the critical one (Eq. 76), the
    block never rests; where Eq. 65 exceeds the true time, it rests once time no longer advances between impacts.
    """

    def code_and_limits(self, block: Block, motion: Motion | None) -> tuple[int, tuple[float, float]]:
        """Code and chattering time for the kernels, s."""
        if motion is None or motion.description.family != "sine":
            raise InvalidOption(
                'chattering="time" is the scheme for sinusoidal motions (rocking.pulses.sine), not for '
                f'{"free rocking" if motion is None else motion.description.family}; use "certified"'
            )
        if not block.is_symmetric:
            raise InvalidOption('chattering="time" is for symmetric blocks; use "certified"')
        from rocking.kernels import paper

        side = block.sides[0]
        parameters = motion.description.parameters
        amplitude = abs(parameters["amplitude"]) / (block.gravity * side.alpha)
        frequency = 2.0 * math.pi * parameters["frequency"] / side.p
        if amplitude < 1.0 or amplitude >= paper.eq76(frequency, side.restitution):
            return status.TIME, (math.inf, math.inf)
        time = paper.eq65_time(amplitude, frequency, side.restitution) / side.p
        return status.TIME, (time, time)


Treatment = Certified | VelocityThreshold | IntervalThreshold | AsymptoticTime

_BY_NAME: dict[str, Callable[[], Treatment]] = {
    "certified": Certified,
    "velocity": VelocityThreshold,
    "interval": IntervalThreshold,
    "time": AsymptoticTime,
}


def treatment(chattering: str | Treatment) -> Treatment:
    """Treatment of that name, or the treatment itself.

    Raises
    ------
    InvalidOption
        If there is none of that name.

    Examples
    --------
    >>> treatment("certified")
    Certified(tolerance=1e-12)
    """
    if isinstance(chattering, Treatment):
        return chattering
    if chattering not in _BY_NAME:
        raise InvalidOption(f"chattering must be one of {', '.join(_BY_NAME)} or a treatment, not {chattering!r}")
    return _BY_NAME[chattering]()


def _positive(value: float, name: str, unit: str) -> None:
    if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0):
        raise InvalidOption(f"{name} must be a positive number, {unit}, not {value!r}")
