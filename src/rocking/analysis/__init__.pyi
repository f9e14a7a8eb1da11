from . import rules
from .calibration.diagnostics import Diagnostics, Leaning, Scores
from .calibration.evidence import Evidence
from .calibration.history import Measured
from .calibration.outcomes import Estimate, Validation
from .efficiency import MeasureComparison
from .fragility import Band, FragilityCurve
from .incremental import IncrementalDynamicAnalysis
from .overturning import Mode, OverturningMap, mode_name
from .risk import Rate, Risk
from .spectrum import RockingSpectrum
from .survey import Survey
from .survival import Survival

__all__ = [
    "Band",
    "Diagnostics",
    "Estimate",
    "Evidence",
    "FragilityCurve",
    "IncrementalDynamicAnalysis",
    "Leaning",
    "MeasureComparison",
    "Measured",
    "Mode",
    "OverturningMap",
    "Rate",
    "Risk",
    "RockingSpectrum",
    "Scores",
    "Survey",
    "Survival",
    "Validation",
    "mode_name",
    "rules",
]
