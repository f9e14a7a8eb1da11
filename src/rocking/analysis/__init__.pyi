from . import rules
from .efficiency import MeasureComparison
from .fragility import Band, Fragility, FragilityCurve
from .hazard import HazardCurve
from .incremental import IncrementalDynamicAnalysis
from .risk import Rate, Risk
from .survival import Survival

__all__ = [
    "Band",
    "Fragility",
    "FragilityCurve",
    "HazardCurve",
    "IncrementalDynamicAnalysis",
    "MeasureComparison",
    "Rate",
    "Risk",
    "Survival",
    "rules",
]
