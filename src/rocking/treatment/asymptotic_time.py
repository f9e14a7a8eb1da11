"""Rest after the paper's asymptotic chattering time: its ad hoc scheme, for sines only."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import ClassVar, Final, Literal, get_args

import numpy as np

from rocking import checks
from rocking.arrays import Flags, Floats
from rocking.block import Blocks
from rocking.errors import InvalidOption, OutsideFit
from rocking.kernels import state
from rocking.motion.motion import Motion
from rocking.treatment.base import Model, Treatment

Critical = Literal["eq76", "eq77", "exact"]

#: Frequencies and restitutions to which the paper fitted Eqs 76 and 77.
FITTED_FREQUENCIES: Final = (0.5, 8.0)
FITTED_RESTITUTIONS: Final = (0.5, 0.97)


@dataclass(frozen=True)
class AsymptoticTime(Treatment):
    """Rest once the asymptotic chattering time (paper, Eq. 65) has passed since uplift (paper, Fig. 8a).

    For sinusoidal motions and symmetric blocks only. Above the critical amplitude the block never rests; where Eq. 65
    exceeds the true time, it rests once time no longer advances between impacts, which a response counts as `stalled`.

    Parameters
    ----------
    critical : {"eq76", "eq77", "exact"}
        Critical amplitude that the scheme trusts: the paper's fits, or the exact one. Between a fit and the exact one
        the scheme rests falsely, or not at all.

    Raises
    ------
    InvalidOption
        If `critical` is none of these.

    Warns
    -----
    OutsideFit
        Where a fit is asked beyond the frequencies (0.5 to 8, over p) and restitutions (0.5 to 0.97) it was made for.

    Notes
    -----
    Amplitudes count in the acceleration that lifts the block: g alpha in the linear model, as in the paper, and
    g tan(alpha) in the nonlinear one.
    """

    name: ClassVar[str] = "time"
    code: ClassVar[int] = state.RestRule.TIME

    critical: Critical = "eq76"

    def __post_init__(self) -> None:
        checks.one_of(self.critical, "critical", InvalidOption, get_args(Critical))

    @property
    def label(self) -> str:
        """Name and equations."""
        return f"time (Eq. 65, {'exact a_cr' if self.critical == 'exact' else f'Eq. {self.critical[2:]}'})"

    @classmethod
    def from_text(cls, value: str) -> Treatment:
        """Make the treatment from the name of a critical amplitude."""
        return cls(value)  # type: ignore[arg-type]

    def limits(self, blocks: Blocks, motion: Motion | None, model: Model, factor: float = 1.0) -> Floats:
        """Chattering time of every side, s; infinite where chattering is not complete."""
        if motion is None or motion.description.family != "sine":
            raise InvalidOption(
                '{} "time" is the scheme for sinusoidal motions (rocking.pulses.sine), not for '
                f'{"free rocking" if motion is None else motion.description.family}; use "certified"',
                "chattering",
            )
        if motion.vertical is not None:
            raise InvalidOption('{} "time" knows no vertical motion; use "certified"', "chattering")
        if not blocks.is_symmetric:
            raise InvalidOption('{} "time" is for symmetric blocks; use "certified"', "chattering")
        parameters = motion.description.parameters
        threshold = blocks.alpha if model == "linear" else np.tan(blocks.alpha)
        amplitude = abs(factor * parameters["amplitude"]) / (blocks.gravity * threshold)
        frequency = 2.0 * np.pi * parameters["frequency"] / blocks.p
        complete = (amplitude >= 1.0) & (amplitude < self._critical(frequency, blocks.restitution))
        return np.where(complete, _times(amplitude, frequency, blocks.restitution) / blocks.p, np.inf)

    def _critical(self, frequency: Floats, restitution: Floats) -> Floats:
        from rocking.kernels import paper
        from rocking.kernels.sine.sequence import critical_amplitudes

        found = np.ones(frequency.size)
        lossy = np.flatnonzero(restitution.ravel() < 1.0)
        omega, eta = frequency.ravel()[lossy], restitution.ravel()[lossy]
        there = np.zeros(lossy.size)
        if self.critical == "exact":
            critical_amplitudes(omega, eta, there)
        else:
            warn_outside_fit(self.critical, omega, eta)
            paper.fitted_amplitudes(omega, eta, self.critical == "eq76", there)
        found[lossy] = there
        return found.reshape(frequency.shape)


def warn_outside_fit(fit: str, omega: Floats, eta: Floats) -> None:
    """Warn where one of the paper's fits is asked beyond what it was made for.

    Parameters
    ----------
    fit : str
        "eq76" or "eq77".
    omega, eta : ndarray
        Frequencies over p, and restitutions.
    """
    low, high = FITTED_FREQUENCIES
    least, most = FITTED_RESTITUTIONS
    outside: Flags = (omega < low) | (omega > high) | (eta < least) | (eta > most)
    if outside.any():
        k = int(np.argmax(outside))
        warnings.warn(
            f"Eq. {fit[2:]} was fitted for omega from {low:g} to {high:g} and eta from {least:g} to {most:g}; "
            f'at omega = {omega.flat[k]:g}, eta = {eta.flat[k]:g} it means nothing: use "exact"',
            OutsideFit,
            stacklevel=3,
        )


def _times(amplitude: Floats, frequency: Floats, restitution: Floats) -> Floats:
    """Eq. 65 over p."""
    from rocking.kernels import paper

    cases = zip(amplitude.flat, frequency.flat, restitution.flat, strict=True)
    return np.reshape([paper.eq65_time(*case) for case in cases], amplitude.shape)
