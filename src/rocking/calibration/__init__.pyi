from .diagnostics import BoundReached, Diagnostics, Scores
from .history import FittedParameter, HistoryCalibration
from .outcomes import Estimate, Validation
from .validate import MeanScore, ModelValidation, PredictedTest, ReliabilityBin

__all__ = [
    "BoundReached",
    "Diagnostics",
    "Estimate",
    "FittedParameter",
    "HistoryCalibration",
    "MeanScore",
    "ModelValidation",
    "PredictedTest",
    "ReliabilityBin",
    "Scores",
    "Validation",
]
