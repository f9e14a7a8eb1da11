from .description import Description, Origin
from .motion import Motion

__all__ = ["Description", "Motion", "Origin"]
