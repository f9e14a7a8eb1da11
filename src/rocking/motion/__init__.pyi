from . import formats, pulses, records
from .motion import Description, Motion

__all__ = ["Description", "Motion", "formats", "pulses", "records"]
