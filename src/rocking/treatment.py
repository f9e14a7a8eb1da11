"""How a sequence of impacts is brought to rest: by proof, or by one of the thresholds in use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
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
        checks.positive(self.tolerance, "tolerance", InvalidOption, "s")

    code: ClassVar[int] = status.CERTIFIED

    def limits(self, blocks: Blocks, motion: Motion | None) -> Floats:
        """Nothing to compare with."""
        return np.zeros_like(blocks.p)


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
        checks.positive(self.threshold, "threshold", InvalidOption, "fractions of p alpha")

    code: ClassVar[int] = status.VELOCITY

    def limits(self, blocks: Blocks, motion: Motion | None) -> Floats:
        """Threshold of every side, rad/s."""
        return self.threshold * blocks.p * blocks.alpha


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
        checks.positive(self.threshold, "threshold", InvalidOption, "s")

    code: ClassVar[int] = status.INTERVAL

    def limits(self, blocks: Blocks, motion: Motion | None) -> Floats:
        """Threshold of every side, s."""
        return np.full_like(blocks.p, self.threshold)


@dataclass(frozen=True)
class AsymptoticTime:
    """Rest once the asymptotic chattering time (paper, Eq. 65) has passed since uplift (paper, Fig. 8a).

    For sinusoidal motions and symmetric blocks only. Where the amplitude is above the critical one (Eq. 76), the
    block never rests; where Eq. 65 exceeds the true time, it rests once time no longer advances between impacts.
    """

    code: ClassVar[int] = status.TIME

    def limits(self, blocks: Blocks, motion: Motion | None) -> Floats:
        """Chattering time of every side, s; infinite where chattering is not complete."""
        if motion is None or motion.description.family != "sine":
            raise InvalidOption(
                'chattering="time" is the scheme for sinusoidal motions (rocking.pulses.sine), not for '
                f'{"free rocking" if motion is None else motion.description.family}; use "certified"'
            )
        if not blocks.is_symmetric:
            raise InvalidOption('chattering="time" is for symmetric blocks; use "certified"')
        from rocking.kernels import paper

        parameters = motion.description.parameters
        amplitude = abs(parameters["amplitude"]) / (blocks.gravity * blocks.alpha)
        frequency = 2.0 * np.pi * parameters["frequency"] / blocks.p
        times = np.full_like(blocks.p, np.inf)
        for k in range(times.size):
            a, omega, eta = (float(values.flat[k]) for values in (amplitude, frequency, blocks.restitution))
            if 1.0 <= a < paper.eq76(omega, eta):
                times.flat[k] = paper.eq65_time(a, omega, eta) / blocks.p.flat[k]
        return times


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
