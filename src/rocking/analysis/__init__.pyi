from .calibration.diagnostics import BoundReached, Diagnostics, Scores
from .calibration.history import Measured
from .calibration.result import Estimate, Validation
from .directions import ResponseRose
from .efficiency import MeasureComparison
from .fragility.curve import Band, FragilityCurve
from .fragility.lognormal import Goodness, Likelihood, Probit
from .incremental import IncrementalDynamicAnalysis
from .overturning import Mode, OverturningMap, mode_name
from .risk import Rate, Risk
from .spectrum import RockingSpectrum
from .survey import Survey
from .survival import Survival
from .validation import JudgedTest, Score, ShareInBin

__all__ = [
    "Band",
    "BoundReached",
    "Diagnostics",
    "Estimate",
    "FragilityCurve",
    "Goodness",
    "IncrementalDynamicAnalysis",
    "JudgedTest",
    "Likelihood",
    "MeasureComparison",
    "Measured",
    "Mode",
    "OverturningMap",
    "Probit",
    "Rate",
    "ResponseRose",
    "Risk",
    "RockingSpectrum",
    "Score",
    "Scores",
    "ShareInBin",
    "Survey",
    "Survival",
    "Validation",
    "mode_name",
]
