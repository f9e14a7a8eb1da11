"""Figures drawn from arrays; this layer knows no class of the package."""

from rocking.plot.amplitudes import contour_figure, duration_figure, frequency_figure, surface_figure
from rocking.plot.blocks import blocks_figure
from rocking.plot.calibration import Parameter, measured_figure, outcomes_figure
from rocking.plot.fragility import FragilityLine, dispersions_figure, fragility_figure
from rocking.plot.histories import (
    Detail,
    Mark,
    Ratios,
    chattering_figure,
    excitation_figure,
    history_figure,
    ratio_figure,
)
from rocking.plot.ida import ScaledMotion, ida_figure
from rocking.plot.intervals import intervals_figure
from rocking.plot.maps import outcome_figure, regions_figure
from rocking.plot.motion import motion_figure
from rocking.plot.response import DrawnSequence, RotationUnits, response_figure
from rocking.plot.risk import HazardLine, RiskLine, risk_figure, survival_figure
from rocking.plot.sketches import Box, Flowchart, Way, block_figure, flowchart_figure
from rocking.plot.spectrum import SpectrumCurves, spectrum_figure

__all__ = [
    "Box",
    "Detail",
    "DrawnSequence",
    "Flowchart",
    "FragilityLine",
    "HazardLine",
    "Mark",
    "Parameter",
    "Ratios",
    "RiskLine",
    "RotationUnits",
    "ScaledMotion",
    "SpectrumCurves",
    "Way",
    "block_figure",
    "blocks_figure",
    "chattering_figure",
    "contour_figure",
    "dispersions_figure",
    "duration_figure",
    "excitation_figure",
    "flowchart_figure",
    "fragility_figure",
    "frequency_figure",
    "history_figure",
    "ida_figure",
    "intervals_figure",
    "measured_figure",
    "motion_figure",
    "outcome_figure",
    "outcomes_figure",
    "ratio_figure",
    "regions_figure",
    "response_figure",
    "risk_figure",
    "spectrum_figure",
    "surface_figure",
    "survival_figure",
]
