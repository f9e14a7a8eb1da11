from .curve import Fragility, FragilityCurve
from .fit import fit_fragility, fragility

__all__ = ["Fragility", "FragilityCurve", "fit_fragility", "fragility"]
