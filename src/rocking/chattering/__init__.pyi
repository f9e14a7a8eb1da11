from . import families
from .duration import (
    ChatteringSequence,
    chattering_sequence,
    chattering_time,
    critical_amplitude,
    critical_amplitude_nonlinear,
    interval_ratios,
    is_complete,
)
from .expansions import asymptotic_table, first_impact_speed, first_interval, series_coefficients
from .maps import ChatteringEpisodes, ChatteringMap, UpliftOutcome, chattering_episodes, chattering_map
from .report import ChatteringReport, CriticalReport, chattering_report, critical_report

__all__ = [
    "ChatteringEpisodes",
    "ChatteringMap",
    "ChatteringReport",
    "ChatteringSequence",
    "CriticalReport",
    "UpliftOutcome",
    "asymptotic_table",
    "chattering_episodes",
    "chattering_map",
    "chattering_report",
    "chattering_sequence",
    "chattering_time",
    "critical_amplitude",
    "critical_amplitude_nonlinear",
    "critical_report",
    "families",
    "first_impact_speed",
    "first_interval",
    "interval_ratios",
    "is_complete",
    "series_coefficients",
]
