from .critical import CriticalScale
from .curve import FragilityCurve
from .efficiency import MeasureComparison
from .incremental import IncrementalDynamicAnalysis
from .overturning import OverturningMap, OverturningMode, describe_mode
from .probit import Goodness, Probit
from .risk import Rate, Risk, Survival
from .spectrum import RockingSpectrum
from .survey import Survey

__all__ = [
    "CriticalScale",
    "FragilityCurve",
    "Goodness",
    "IncrementalDynamicAnalysis",
    "MeasureComparison",
    "OverturningMap",
    "OverturningMode",
    "Probit",
    "Rate",
    "Risk",
    "RockingSpectrum",
    "Survey",
    "Survival",
    "describe_mode",
]
