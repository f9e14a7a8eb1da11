from .diagnostics import BoundReached, Diagnostics, Scores
from .history import Measured
from .outcomes import Estimate, Validation
from .validate import JudgedTest, Score, ShareInBin

__all__ = [
    "BoundReached",
    "Diagnostics",
    "Estimate",
    "JudgedTest",
    "Measured",
    "Score",
    "Scores",
    "ShareInBin",
    "Validation",
]
