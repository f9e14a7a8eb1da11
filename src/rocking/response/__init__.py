"""Responses: results of a single simulation."""

from rocking.core.result import Row
from rocking.response.gradient import Gradient, gradient
from rocking.response.perturbed import PerturbedSimulations, Repeat
from rocking.response.response import Response
from rocking.response.sensitivity import Sensitivity

__all__ = ["Gradient", "PerturbedSimulations", "Repeat", "Response", "Row", "Sensitivity", "gradient"]
