from .diagnostics import Diagnostics, Leaning, Scores
from .history import HistoryCalibration, Measured, calibrate_history
from .outcomes import Calibration, Estimate, Validation, calibrate

__all__ = [
    "Calibration",
    "Diagnostics",
    "Estimate",
    "HistoryCalibration",
    "Leaning",
    "Measured",
    "Scores",
    "Validation",
    "calibrate",
    "calibrate_history",
]
