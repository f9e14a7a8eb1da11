"""Rest by proof."""

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
class Certified(Treatment):
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

    name: ClassVar[str] = "certified"
    code: ClassVar[int] = state.RestRule.CERTIFIED

    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        checks.positive(self.tolerance, "tolerance", InvalidOption, "s")

    @property
    def label(self) -> str:
        """Name and tolerance."""
        return f"certified {self.tolerance:g} s"

    @property
    def bracket(self) -> float:
        """The tolerance."""
        return self.tolerance

    def limits(self, blocks: Blocks, motion: Motion | None, model: Model, factor: float = 1.0) -> Floats:
        """Nothing to compare with."""
        return np.zeros_like(blocks.p)
