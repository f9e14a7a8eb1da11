from .description import Description
from .motion import Motion

__all__ = ["Description", "Motion"]
