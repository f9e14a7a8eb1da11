from . import analysis, calibration, chattering, dynamics, pulses, records, rules, solid, studies
from .analysis.directions import response_rose
from .analysis.efficiency import compare_measures
from .analysis.fragility import Fragility, fit_fragility, fragility
from .analysis.hazard import HazardCurve
from .analysis.incremental import CriticalScale, critical_scale, incremental_dynamic_analysis
from .analysis.overturning import overturning_map
from .analysis.spectrum import rocking_spectrum
from .analysis.survey import survey
from .block import (
    Block,
    Blocks,
    Damper,
    Load,
    Restitution,
    RestrainedBlock,
    RestrainedBlocks,
    Restraint,
    Side,
    Spring,
    Tendon,
    Thrust,
    impact_restitution,
    one_sided_restitution,
)
from .block.body import Bodies, Body, Coordinate
from .calibration.history import HistoryCalibration, calibrate_history
from .calibration.outcomes import Calibration, calibrate
from .calibration.tables import read_tests
from .calibration.validate import ModelValidation, ShakeTest, validate
from .core.result import DatasetResult, Result, Row
from .core.threads import set_options
from .engine.schemes import (
    AsymptoticTime,
    Certified,
    ChatteringScheme,
    GeometricBypass,
    IntervalThreshold,
    VelocityThreshold,
)
from .errors import (
    DamagedStudy,
    InvalidBlock,
    InvalidMotion,
    InvalidOption,
    OutputError,
    OutsideFit,
    RockingError,
    StudyError,
    UnequalSides,
    Unfinished,
    Unfitted,
    UnreadableRecord,
)
from .explorer.launch import Frame, explore
from .motion import Motion
from .motion.description import Description, Origin
from .motion.scaling import Measure
from .records.formats import read
from .response import Gradient, Perturbed, Repeat, Response, Sensitivity, gradient
from .simulation.ensemble import Product, Scales, simulate_many
from .simulation.simulate import simulate
from .solid.solid import Solid
from .studies import Study, create_study

__version__: str

__all__ = [
    "AsymptoticTime",
    "Block",
    "Blocks",
    "Bodies",
    "Body",
    "Calibration",
    "Certified",
    "ChatteringScheme",
    "Coordinate",
    "CriticalScale",
    "DamagedStudy",
    "Damper",
    "DatasetResult",
    "Description",
    "Fragility",
    "Frame",
    "GeometricBypass",
    "Gradient",
    "HazardCurve",
    "HistoryCalibration",
    "IntervalThreshold",
    "InvalidBlock",
    "InvalidMotion",
    "InvalidOption",
    "Load",
    "Measure",
    "ModelValidation",
    "Motion",
    "Origin",
    "OutputError",
    "OutsideFit",
    "Perturbed",
    "Product",
    "Repeat",
    "Response",
    "Restitution",
    "RestrainedBlock",
    "RestrainedBlocks",
    "Restraint",
    "Result",
    "RockingError",
    "Row",
    "Scales",
    "Sensitivity",
    "ShakeTest",
    "Side",
    "Solid",
    "Spring",
    "Study",
    "StudyError",
    "Tendon",
    "Thrust",
    "UnequalSides",
    "Unfinished",
    "Unfitted",
    "UnreadableRecord",
    "VelocityThreshold",
    "analysis",
    "calibrate",
    "calibrate_history",
    "calibration",
    "chattering",
    "compare_measures",
    "create_study",
    "critical_scale",
    "dynamics",
    "explore",
    "fit_fragility",
    "fragility",
    "gradient",
    "impact_restitution",
    "incremental_dynamic_analysis",
    "one_sided_restitution",
    "overturning_map",
    "pulses",
    "read",
    "read_tests",
    "records",
    "response_rose",
    "rocking_spectrum",
    "rules",
    "set_options",
    "simulate",
    "simulate_many",
    "solid",
    "studies",
    "survey",
    "validate",
]
