"""The dimensionless theory of chattering under a sine: asymptotic, semi-analytical, series, exact.

Parameters throughout: amplitude ``a`` of the ground acceleration over g alpha, ``omega`` = forcing frequency over the
block's p, ``eta`` = coefficient of restitution; times are p t, speeds theta'/(p alpha).
"""

from rocking.chattering.asymptotic import asymptotic_table, first_impact_speed, first_interval
from rocking.chattering.critical import critical_amplitude
from rocking.chattering.duration import (
    ChatteringSequence,
    chattering_time,
    interval_ratios,
    is_complete,
    sequence,
)
from rocking.chattering.nonlinear import critical_amplitude_nonlinear
from rocking.chattering.series import SeriesDiagnosis, series_coefficients, series_diagnosis

__all__ = [
    "ChatteringSequence",
    "SeriesDiagnosis",
    "asymptotic_table",
    "chattering_time",
    "critical_amplitude",
    "critical_amplitude_nonlinear",
    "first_impact_speed",
    "first_interval",
    "interval_ratios",
    "is_complete",
    "sequence",
    "series_coefficients",
    "series_diagnosis",
]
