"""Rest below a threshold: of the speed after an impact, or of the time between two impacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.motion.motion import Motion
from rocking.treatment.base import Model, Treatment


@dataclass(frozen=True)
class VelocityThreshold(Treatment):
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

    name: ClassVar[str] = "velocity"
    code: ClassVar[int] = state.RestRule.VELOCITY

    threshold: float = 5e-10

    def __post_init__(self) -> None:
        checks.positive(self.threshold, "threshold", InvalidOption, "fractions of p alpha")

    @property
    def label(self) -> str:
        """Name and threshold."""
        return f"velocity {self.threshold:g}"

    def limits(self, blocks: Blocks, motion: Motion | None, model: Model, factor: float = 1.0) -> Floats:
        """Threshold of every side, rad/s."""
        return self.threshold * blocks.p * blocks.alpha


@dataclass(frozen=True)
class IntervalThreshold(Treatment):
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

    name: ClassVar[str] = "interval"
    code: ClassVar[int] = state.RestRule.INTERVAL

    threshold: float = 1e-9

    def __post_init__(self) -> None:
        checks.positive(self.threshold, "threshold", InvalidOption, "s")

    @property
    def label(self) -> str:
        """Name and threshold."""
        return f"interval {self.threshold:g} s"

    def limits(self, blocks: Blocks, motion: Motion | None, model: Model, factor: float = 1.0) -> Floats:
        """Threshold of every side, s."""
        return np.full_like(blocks.p, self.threshold)
