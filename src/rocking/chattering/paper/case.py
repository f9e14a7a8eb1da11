"""A slender block under a sine: that of the paper's figures, or another one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block
from rocking.chattering.theory.amplitude import critical_amplitude
from rocking.chattering.theory.duration import chattering_time
from rocking.chattering.theory.parameters import (
    checked_amplitude,
    checked_frequency,
    checked_restitution,
    checked_slenderness,
    single,
)
from rocking.errors import InvalidOption
from rocking.motion import pulses
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation import simulate
from rocking.treatment import Treatment

#: The paper's case. Its Fig. 11 has an amplitude of its own, and Fig. 3 two cases.
A: Final = 1.03
OMEGA: Final = 2.0
ETA: Final = 0.92
P: Final = 1.0
ALPHA: Final = 0.2

#: The excitation lasts so many periods.
CYCLES: Final = 2.5

_EVEN_TIMES: Final = 2001
_POINTS_PER_ARC: Final = 16

_SYMBOLS: Final = {"a": "$a$", "omega": r"$\omega$", "eta": r"$\eta$", "p": "$p$", "alpha": r"$\alpha$"}
_UNITS: Final = {"p": " rad/s", "alpha": " rad"}


@dataclass(frozen=True)
class Case:
    """One block under one sine that starts at phase zero.

    Attributes
    ----------
    a : float
        Amplitude of the ground acceleration over g alpha.
    omega : float
        Its frequency over p.
    eta : float
        Coefficient of restitution.
    p : float
        The block's frequency parameter, rad/s.
    alpha : float
        Its slenderness, rad.

    Raises
    ------
    InvalidOption
        If a parameter is out of its range, or the block does not lift off.
    """

    a: float = A
    omega: float = OMEGA
    eta: float = ETA
    p: float = P
    alpha: float = ALPHA

    def __post_init__(self) -> None:
        if single(checked_amplitude(self.a), "a") <= 1.0:
            raise InvalidOption(f"a must be above 1, or the block does not lift off, not {self.a:g}")
        single(checked_frequency(self.omega), "omega")
        lossy(self.eta)
        checks.positive(self.p, "p", InvalidOption, "rad/s")
        single(checked_slenderness(self.alpha), "alpha")

    @property
    def period(self) -> float:
        """Period of the excitation, s."""
        return 2.0 * math.pi / (self.omega * self.p)

    @property
    def critical(self) -> float:
        """Critical amplitude, over g alpha."""
        return float(critical_amplitude(self.omega, self.eta))

    @property
    def rest(self) -> float:
        """Chattering time over the period; NaN where chattering is incomplete."""
        return float(chattering_time(self.a, self.omega, self.eta)) * self.omega / (2.0 * math.pi)

    def block(self) -> Block:
        """Return the block."""
        return Block.from_parameters(p=self.p, alpha=self.alpha, restitution=self.eta)

    def excitation(self) -> Motion:
        """Return the sine."""
        return pulses.sine(self.a * self.block().gravity * self.alpha, 1.0 / self.period, cycles=CYCLES)

    def simulated(self, treatment: str | Treatment) -> Response:
        """Response of the slender block over the duration of the excitation.

        Raises
        ------
        InvalidOption
            If the block overturns.
        """
        motion = self.excitation()
        response = simulate(self.block(), motion, model="linear", chattering=treatment, duration=motion.duration)
        if response.overturned:
            raise InvalidOption(f"the block overturns under a sine of a = {self.a:g}: take a smaller one")
        return response

    def words(self, *names: str) -> str:
        """Parameters of these names and their values: "a = 1.03, p = 1 rad/s"."""
        return in_words({name: value for name, value in asdict(self).items() if name in names})

    def symbols(self, *names: str) -> str:
        """Return the same with the symbols of a figure's title."""
        return in_symbols({name: value for name, value in asdict(self).items() if name in names})


def in_words(parameters: Mapping[str, float]) -> str:
    """Parameters and their values: "omega = 2, eta = 0.92"."""
    return ", ".join(f"{name} = {value:.12g}{_UNITS.get(name, '')}" for name, value in parameters.items())


def in_symbols(parameters: Mapping[str, float]) -> str:
    """Return the same with the symbols of a figure's title."""
    return ", ".join(f"{_SYMBOLS[name]} = {value:g}{_UNITS.get(name, '')}" for name, value in parameters.items())


def lossy(eta: float) -> float:
    """Return a coefficient of restitution below one.

    Raises
    ------
    InvalidOption
        If it is not.
    """
    if single(checked_restitution(eta), "eta") == 1.0:
        raise InvalidOption("eta must be below 1 here: without loss at impacts chattering never ends")
    return float(eta)


def dense_times(impacts: Floats, end: float, *, shortest: float = 0.0) -> Floats:
    """Lay times from 0 to the end: even ones, and some within each arc that is not shorter than the shortest."""
    marks = np.concatenate([[0.0], impacts[impacts < end], [end]])
    lengths = np.diff(marks)
    long = lengths >= shortest
    fractions = np.arange(_POINTS_PER_ARC) / _POINTS_PER_ARC
    arcs = marks[:-1][long, np.newaxis] + fractions * lengths[long, np.newaxis]
    return np.unique(np.concatenate([np.linspace(0.0, end, _EVEN_TIMES), arcs.ravel()]))
