"""Ground motions: piecewise polynomials in time."""

from rocking.motion.motion import Description, Motion

__all__ = ["Description", "Motion"]
