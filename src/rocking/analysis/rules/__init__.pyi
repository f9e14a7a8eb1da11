from .check import Check, check
from .criteria import RULES, Rating, asce_43_05, housner, ishiyama, priestley, rate, west

__all__ = [
    "RULES",
    "Check",
    "Rating",
    "asce_43_05",
    "check",
    "housner",
    "ishiyama",
    "priestley",
    "rate",
    "west",
]
