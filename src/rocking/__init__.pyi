from . import chattering
from .analysis import rules
from .analysis.calibration import Calibration, HistoryCalibration, calibrate, calibrate_history
from .analysis.efficiency import compare_measures
from .analysis.fragility import Fragility, fit_fragility, fragility
from .analysis.hazard import HazardCurve
from .analysis.incremental import incremental_dynamic_analysis
from .analysis.overturning import overturning_map
from .analysis.spectrum import rocking_spectrum
from .block import Block, Blocks
from .ensemble import simulate_many
from .errors import (
    InvalidBlock,
    InvalidMotion,
    InvalidOption,
    OutputError,
    RockingError,
    StudyError,
    UnreadableRecord,
)
from .explorer.launch import explore
from .motion import Motion, pulses, records
from .motion.formats import read
from .response import Response
from .simulation import simulate
from .studies import Study, study
from .treatment import AsymptoticTime, Certified, IntervalThreshold, VelocityThreshold

__version__: str

__all__ = [
    "AsymptoticTime",
    "Block",
    "Blocks",
    "Calibration",
    "Certified",
    "Fragility",
    "HazardCurve",
    "HistoryCalibration",
    "IntervalThreshold",
    "InvalidBlock",
    "InvalidMotion",
    "InvalidOption",
    "Motion",
    "OutputError",
    "Response",
    "RockingError",
    "Study",
    "StudyError",
    "UnreadableRecord",
    "VelocityThreshold",
    "calibrate",
    "calibrate_history",
    "chattering",
    "compare_measures",
    "explore",
    "fit_fragility",
    "fragility",
    "incremental_dynamic_analysis",
    "overturning_map",
    "pulses",
    "read",
    "records",
    "rocking_spectrum",
    "rules",
    "simulate",
    "simulate_many",
    "study",
]
