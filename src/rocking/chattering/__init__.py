"""Chattering: the dimensionless theory under a sine (asymptotic, semi-analytical, series, exact), and what lies beyond.

Parameters throughout: amplitude ``a`` of the ground acceleration over g alpha, ``omega`` = forcing frequency over the
block's p, ``eta`` = coefficient of restitution; times are p t, speeds theta'/(p alpha).
"""

from rocking.chattering import families
from rocking.chattering.asymptotic import asymptotic_table, first_impact_speed, first_interval
from rocking.chattering.critical import critical_amplitude
from rocking.chattering.duration import (
    ChatteringSequence,
    chattering_time,
    interval_ratios,
    is_complete,
    sequence,
)
from rocking.chattering.episodes import ChatteringEpisodes, chattering_episodes
from rocking.chattering.maps import Outcome, chattering_map, map_figure
from rocking.chattering.nonlinear import critical_amplitude_nonlinear
from rocking.chattering.paper import paper_figure
from rocking.chattering.schemes import SchemeComparison, SchemeOutcome, compare_schemes
from rocking.chattering.series import SeriesDiagnosis, series_coefficients, series_diagnosis

__all__ = [
    "ChatteringEpisodes",
    "ChatteringSequence",
    "Outcome",
    "SchemeComparison",
    "SchemeOutcome",
    "SeriesDiagnosis",
    "asymptotic_table",
    "chattering_episodes",
    "chattering_map",
    "chattering_time",
    "compare_schemes",
    "critical_amplitude",
    "critical_amplitude_nonlinear",
    "families",
    "first_impact_speed",
    "first_interval",
    "interval_ratios",
    "is_complete",
    "map_figure",
    "paper_figure",
    "sequence",
    "series_coefficients",
    "series_diagnosis",
]
