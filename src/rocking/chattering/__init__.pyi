from . import families
from .amplitude import critical_amplitude_nonlinear
from .episodes import ChatteringEpisodes, chattering_episodes
from .maps import ChatteringMap, Outcome, chattering_map
from .paper import paper_figure
from .report import ChatteringReport, CriticalReport, chattering_report, critical_report
from .schemes import SchemeComparison, SchemeOutcome, compare_schemes
from .theory.amplitude import critical_amplitude
from .theory.asymptotic import asymptotic_table, first_impact_speed, first_interval
from .theory.duration import (
    ChatteringSequence,
    chattering_time,
    interval_ratios,
    is_complete,
    sequence,
)
from .theory.series import SeriesDiagnosis, series_coefficients, series_diagnosis

__all__ = [
    "ChatteringEpisodes",
    "ChatteringMap",
    "ChatteringReport",
    "ChatteringSequence",
    "CriticalReport",
    "Outcome",
    "SchemeComparison",
    "SchemeOutcome",
    "SeriesDiagnosis",
    "asymptotic_table",
    "chattering_episodes",
    "chattering_map",
    "chattering_report",
    "chattering_time",
    "compare_schemes",
    "critical_amplitude",
    "critical_amplitude_nonlinear",
    "critical_report",
    "families",
    "first_impact_speed",
    "first_interval",
    "interval_ratios",
    "is_complete",
    "paper_figure",
    "sequence",
    "series_coefficients",
    "series_diagnosis",
]
