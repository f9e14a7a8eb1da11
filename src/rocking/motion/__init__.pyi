from . import formats, pulses, records
from .description import Description
from .motion import Motion

__all__ = ["Description", "Motion", "formats", "pulses", "records"]
