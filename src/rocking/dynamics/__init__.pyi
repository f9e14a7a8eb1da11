from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .simulation import Response, simulate, simulate_many

__all__ = [
    "BouncingBall",
    "Fate",
    "ImpactMap",
    "ImpactOscillator",
    "InvertedPendulum",
    "Law",
    "LinearBodies",
    "Response",
    "StroboscopicMap",
    "impact_map",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
]
