"""Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rocking.constants import VERSION

__version__ = VERSION

if TYPE_CHECKING:
    from rocking import chattering
    from rocking.analysis import (
        Fragility,
        fit_fragility,
        fragility,
        incremental_dynamic_analysis,
        overturning_map,
        rocking_spectrum,
    )
    from rocking.analysis.calibration import Calibration, calibrate
    from rocking.analysis.calibration_history import HistoryCalibration, calibrate_history
    from rocking.block import Block, Blocks
    from rocking.ensemble import simulate_many
    from rocking.errors import (
        InvalidBlock,
        InvalidMotion,
        InvalidOption,
        OutputError,
        RockingError,
        UnreadableRecord,
    )
    from rocking.motion import Motion, pulses, records
    from rocking.motion.formats import read
    from rocking.response import Response
    from rocking.simulation import simulate
    from rocking.treatment import AsymptoticTime, Certified, IntervalThreshold, VelocityThreshold

__all__ = [
    "AsymptoticTime",
    "Block",
    "Blocks",
    "Calibration",
    "Certified",
    "Fragility",
    "HistoryCalibration",
    "IntervalThreshold",
    "InvalidBlock",
    "InvalidMotion",
    "InvalidOption",
    "Motion",
    "OutputError",
    "Response",
    "RockingError",
    "UnreadableRecord",
    "VelocityThreshold",
    "calibrate",
    "calibrate_history",
    "chattering",
    "fit_fragility",
    "fragility",
    "incremental_dynamic_analysis",
    "overturning_map",
    "pulses",
    "read",
    "records",
    "rocking_spectrum",
    "simulate",
    "simulate_many",
]

# Public names are imported when they are first used, so that `import rocking` and the command line start at once.
_HOMES = {
    "AsymptoticTime": "rocking.treatment",
    "Block": "rocking.block",
    "Blocks": "rocking.block",
    "Calibration": "rocking.analysis.calibration",
    "Certified": "rocking.treatment",
    "Fragility": "rocking.analysis",
    "HistoryCalibration": "rocking.analysis.calibration_history",
    "IntervalThreshold": "rocking.treatment",
    "InvalidBlock": "rocking.errors",
    "InvalidMotion": "rocking.errors",
    "InvalidOption": "rocking.errors",
    "Motion": "rocking.motion.motion",
    "OutputError": "rocking.errors",
    "Response": "rocking.response",
    "RockingError": "rocking.errors",
    "UnreadableRecord": "rocking.errors",
    "VelocityThreshold": "rocking.treatment",
    "calibrate": "rocking.analysis.calibration",
    "calibrate_history": "rocking.analysis.calibration_history",
    "chattering": "rocking.chattering",
    "fit_fragility": "rocking.analysis",
    "fragility": "rocking.analysis",
    "incremental_dynamic_analysis": "rocking.analysis",
    "overturning_map": "rocking.analysis",
    "pulses": "rocking.motion.pulses",
    "read": "rocking.motion.formats",
    "records": "rocking.motion.records",
    "rocking_spectrum": "rocking.analysis",
    "simulate": "rocking.simulation",
    "simulate_many": "rocking.ensemble",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rocking' has no attribute {name!r}")
    home = import_module(_HOMES[name])
    is_module = home.__name__.rpartition(".")[2] == name
    return home if is_module else getattr(home, name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
