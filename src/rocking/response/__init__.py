"""What one simulation found, and what a practitioner asks of it."""

from rocking.response.response import Response
from rocking.response.sensitivity import AMBIGUITY, QUANTITIES, Sensitivity

__all__ = ["AMBIGUITY", "QUANTITIES", "Response", "Sensitivity"]
