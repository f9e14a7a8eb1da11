from .diagnostics import BoundReached, Diagnostics, Scores
from .history import HistoryCalibration, Measured
from .outcomes import Estimate, Validation
from .validate import JudgedTest, MeanScore, ModelValidation, ShareInBin

__all__ = [
    "BoundReached",
    "Diagnostics",
    "Estimate",
    "HistoryCalibration",
    "JudgedTest",
    "MeanScore",
    "Measured",
    "ModelValidation",
    "Scores",
    "ShareInBin",
    "Validation",
]
