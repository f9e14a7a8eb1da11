from .mesh import Region
from .rose import ResistanceRose
from .solid import Solid

__all__ = ["Region", "ResistanceRose", "Solid"]
