from .curve import Band, FragilityCurve
from .fit import fit_fragility, fragility
from .result import Fragility

__all__ = ["Band", "Fragility", "FragilityCurve", "fit_fragility", "fragility"]
