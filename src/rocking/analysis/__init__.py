"""What engineers ask of many simulations: spectra, overturning maps, scaling, fragility, calibration.

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rocking.analysis.calibration import Calibration, Estimate, Validation, calibrate
    from rocking.analysis.calibration_history import HistoryCalibration, Measured, calibrate_history
    from rocking.analysis.calibration_scores import Scores
    from rocking.analysis.dynamic import dynamic_figure, incremental_dynamic_analysis
    from rocking.analysis.fragility_curve import Fragility, FragilityCurve
    from rocking.analysis.fragility_function import fit_fragility, fragility
    from rocking.analysis.overturning import mode_name, overturning_figure, overturning_map
    from rocking.analysis.spectrum import rocking_spectrum, spectrum_figure

__all__ = [
    "Calibration",
    "Estimate",
    "Fragility",
    "FragilityCurve",
    "HistoryCalibration",
    "Measured",
    "Scores",
    "Validation",
    "calibrate",
    "calibrate_history",
    "dynamic_figure",
    "fit_fragility",
    "fragility",
    "incremental_dynamic_analysis",
    "mode_name",
    "overturning_figure",
    "overturning_map",
    "rocking_spectrum",
    "spectrum_figure",
]

# No module may have the name of what it exports: once imported, it would stand in its place.
_HOMES = {
    "Calibration": "calibration",
    "Estimate": "calibration",
    "Fragility": "fragility_curve",
    "FragilityCurve": "fragility_curve",
    "HistoryCalibration": "calibration_history",
    "Measured": "calibration_history",
    "Scores": "calibration_scores",
    "Validation": "calibration",
    "calibrate": "calibration",
    "calibrate_history": "calibration_history",
    "dynamic_figure": "dynamic",
    "fit_fragility": "fragility_function",
    "fragility": "fragility_function",
    "incremental_dynamic_analysis": "dynamic",
    "mode_name": "overturning",
    "overturning_figure": "overturning",
    "overturning_map": "overturning",
    "rocking_spectrum": "spectrum",
    "spectrum_figure": "spectrum",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rocking.analysis' has no attribute {name!r}")
    return getattr(import_module(f"rocking.analysis.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
