"""Figures drawn from arrays; this layer knows no class of the package."""

from rocking.plot.amplitudes import duration_figure, frequency_figure, surface_figure
from rocking.plot.fragility import FragilityLine, fragility_figure
from rocking.plot.histories import Detail, Mark, excitation_figure, history_figure
from rocking.plot.ida import ScaledMotion, ida_figure
from rocking.plot.maps import outcome_figure
from rocking.plot.motion import motion_figure
from rocking.plot.regions import regions_figure
from rocking.plot.response import DrawnSequence, RotationUnits, response_figure
from rocking.plot.sequences import Ratios, chattering_figure, ratio_figure
from rocking.plot.spectrum import SpectrumCurves, spectrum_figure

__all__ = [
    "Detail",
    "DrawnSequence",
    "FragilityLine",
    "Mark",
    "Ratios",
    "RotationUnits",
    "ScaledMotion",
    "SpectrumCurves",
    "chattering_figure",
    "duration_figure",
    "excitation_figure",
    "fragility_figure",
    "frequency_figure",
    "history_figure",
    "ida_figure",
    "motion_figure",
    "outcome_figure",
    "ratio_figure",
    "regions_figure",
    "response_figure",
    "spectrum_figure",
    "surface_figure",
]
