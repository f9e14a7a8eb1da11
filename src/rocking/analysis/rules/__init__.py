"""Rules of thumb for the rocking and overturning of blocks, and a check of them against simulations."""

from rocking.analysis.rules.check import Check, check
from rocking.analysis.rules.criteria import RULES, Rating, asce_43_05, housner, ishiyama, priestley, rate, west

__all__ = ["RULES", "Check", "Rating", "asce_43_05", "check", "housner", "ishiyama", "priestley", "rate", "west"]
