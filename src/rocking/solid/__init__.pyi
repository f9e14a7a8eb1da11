from .mesh import Region
from .rose import Rose
from .solid import Solid

__all__ = ["Region", "Rose", "Solid"]
