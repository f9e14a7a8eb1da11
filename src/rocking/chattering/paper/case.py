"""Block and excitation of the paper's Figs 2, 4 and 9 to 11: p = 1 rad/s, alpha = 0.2, eta = 0.92, omega = 2."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.block import Block
from rocking.motion import pulses
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation import simulate
from rocking.treatment import Treatment

ETA: Final = 0.92
OMEGA: Final = 2.0

#: Period of the excitation, dimensionless and, as p = 1 rad/s, in seconds; the excitation lasts 2.5 of them.
PERIOD: Final = 2.0 * math.pi / OMEGA
CYCLES: Final = 2.5

_EVEN_TIMES: Final = 2001
_POINTS_PER_ARC: Final = 16


def block() -> Block:
    """Return the paper's block."""
    return Block.from_parameters(p=1.0, alpha=0.2, restitution=ETA)


def excitation(a: float) -> Motion:
    """Return the sine of amplitude a; it starts at phase zero."""
    rocking = block()
    return pulses.sine(a * rocking.gravity * rocking.sides[0].alpha, 1.0 / PERIOD, cycles=CYCLES)


def simulated(a: float, treatment: str | Treatment) -> Response:
    """Response of the slender block over the duration of the excitation."""
    motion = excitation(a)
    return simulate(block(), motion, model="linear", chattering=treatment, duration=motion.duration)


def dense_times(impacts: Floats, end: float, *, shortest: float = 0.0) -> Floats:
    """Lay times from 0 to the end: even ones, and some within each arc that is not shorter than the shortest."""
    marks = np.concatenate([[0.0], impacts[impacts < end], [end]])
    lengths = np.diff(marks)
    long = lengths >= shortest
    fractions = np.arange(_POINTS_PER_ARC) / _POINTS_PER_ARC
    arcs = marks[:-1][long, np.newaxis] + fractions * lengths[long, np.newaxis]
    return np.unique(np.concatenate([np.linspace(0.0, end, _EVEN_TIMES), arcs.ravel()]))
