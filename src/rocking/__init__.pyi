from . import (
    analysis,
    block,
    calibration,
    chattering,
    dynamics,
    errors,
    motion,
    pulses,
    records,
    response,
    rules,
    solid,
    studies,
)
from .analysis.critical import critical_scale
from .analysis.efficiency import compare_measures
from .analysis.fragility import Fragility, fit_fragility, fragility
from .analysis.hazard import HazardCurve
from .analysis.incremental import incremental_dynamic_analysis
from .analysis.overturning import overturning_map
from .analysis.spectrum import rocking_spectrum
from .analysis.survey import survey
from .assessment.assess import assess
from .assessment.results import Assessment
from .block import (
    Block,
    Blocks,
    Damper,
    Load,
    Restitution,
    RestrainedBlock,
    Restraint,
    Spring,
    Tendon,
    Thrust,
    impact_restitution,
    one_sided_restitution,
)
from .calibration.history import calibrate_history
from .calibration.outcomes import Calibration, calibrate
from .calibration.tables import read_tests
from .calibration.validate import ShakeTest, validate
from .core.distributions import lognormal, normal, uniform
from .core.result import Result
from .core.threads import set_options
from .engine.schemes import (
    AsymptoticTime,
    Certified,
    ChatteringScheme,
    GeometricBypass,
    IntervalThreshold,
    VelocityThreshold,
)
from .errors import RockingError
from .inputs.inventory import read_inventory
from .motion import Motion
from .motion.scaling import Measure
from .motion.stochastic import synthesize_motions
from .records.formats import read
from .response import Response, gradient
from .simulation.ensemble import simulate_many
from .simulation.simulate import simulate
from .solid.solid import Solid
from .studies import Study, create_study

__version__: str

__all__ = [
    "Assessment",
    "AsymptoticTime",
    "Block",
    "Blocks",
    "Calibration",
    "Certified",
    "ChatteringScheme",
    "Damper",
    "Fragility",
    "GeometricBypass",
    "HazardCurve",
    "IntervalThreshold",
    "Load",
    "Measure",
    "Motion",
    "Response",
    "Restitution",
    "RestrainedBlock",
    "Restraint",
    "Result",
    "RockingError",
    "ShakeTest",
    "Solid",
    "Spring",
    "Study",
    "Tendon",
    "Thrust",
    "VelocityThreshold",
    "analysis",
    "assess",
    "block",
    "calibrate",
    "calibrate_history",
    "calibration",
    "chattering",
    "compare_measures",
    "create_study",
    "critical_scale",
    "dynamics",
    "errors",
    "fit_fragility",
    "fragility",
    "gradient",
    "impact_restitution",
    "incremental_dynamic_analysis",
    "lognormal",
    "motion",
    "normal",
    "one_sided_restitution",
    "overturning_map",
    "pulses",
    "read",
    "read_inventory",
    "read_tests",
    "records",
    "response",
    "rocking_spectrum",
    "rules",
    "set_options",
    "simulate",
    "simulate_many",
    "solid",
    "studies",
    "survey",
    "synthesize_motions",
    "uniform",
    "validate",
]
