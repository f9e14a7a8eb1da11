"""Responses: results of a single simulation."""

from rocking.response.figure import active_span, drawing_times
from rocking.response.gradient import Gradient, gradient
from rocking.response.history import Solution
from rocking.response.perturbed import (
    COUNT,
    PRECISION,
    RELATIVE,
    Perturbed,
    Repeat,
    factors_near,
    percent,
    steps_within,
)
from rocking.response.response import Response
from rocking.response.sensitivity import Sensitivity
from rocking.response.summary import in_brief, in_words, known_ratio, ratio_text

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
    "active_span",
    "drawing_times",
    "factors_near",
    "gradient",
    "in_brief",
    "in_words",
    "known_ratio",
    "percent",
    "ratio_text",
    "steps_within",
]
