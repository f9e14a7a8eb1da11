from .schemes import SchemeComparison, SchemeOutcome, compare_schemes, scheme_of
from .stepping import MoreauJean, SchatzmanPaoli, SteppedResponse, TimeStepping, integrate

__all__ = [
    "MoreauJean",
    "SchatzmanPaoli",
    "SchemeComparison",
    "SchemeOutcome",
    "SteppedResponse",
    "TimeStepping",
    "compare_schemes",
    "integrate",
    "scheme_of",
]
