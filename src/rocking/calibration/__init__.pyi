from .diagnostics import BoundReached, Diagnostics, Scores
from .history import HistoryCalibration, Measured
from .outcomes import Estimate, Validation
from .validate import JudgedTest, ModelValidation, Score, ShareInBin

__all__ = [
    "BoundReached",
    "Diagnostics",
    "Estimate",
    "HistoryCalibration",
    "JudgedTest",
    "Measured",
    "ModelValidation",
    "Score",
    "Scores",
    "ShareInBin",
    "Validation",
]
