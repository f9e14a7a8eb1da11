from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .comparison import SchemeComparison, SchemeOutcome
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .schemes import compare_schemes, scheme_of
from .simulation import Response, simulate, simulate_many
from .stepping import MoreauJean, SchatzmanPaoli, SteppedResponse, TimeStepping, integrate

__all__ = [
    "BouncingBall",
    "Fate",
    "ImpactMap",
    "ImpactOscillator",
    "InvertedPendulum",
    "Law",
    "LinearBodies",
    "MoreauJean",
    "Response",
    "SchatzmanPaoli",
    "SchemeComparison",
    "SchemeOutcome",
    "SteppedResponse",
    "StroboscopicMap",
    "TimeStepping",
    "compare_schemes",
    "impact_map",
    "integrate",
    "scheme_of",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
]
