"""Responses: results of a single simulation."""

from rocking.response.figure import choose_times, find_active_span
from rocking.response.gradient import Gradient, gradient
from rocking.response.history import Solution
from rocking.response.perturbed import (
    COUNT,
    PRECISION,
    RELATIVE,
    Perturbed,
    Repeat,
    choose_steps,
    format_percent,
    list_factors,
)
from rocking.response.response import Response
from rocking.response.sensitivity import Sensitivity
from rocking.response.summary import format_brief_outcome, format_outcome, format_ratio, round_ratio

__all__ = [
    "COUNT",
    "PRECISION",
    "RELATIVE",
    "Gradient",
    "Perturbed",
    "Repeat",
    "Response",
    "Sensitivity",
    "Solution",
    "choose_steps",
    "choose_times",
    "find_active_span",
    "format_brief_outcome",
    "format_outcome",
    "format_percent",
    "format_ratio",
    "gradient",
    "list_factors",
    "round_ratio",
]
