from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .exponents import LyapunovExponents, lyapunov_exponents
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
    "LyapunovExponents",
    "Response",
    "StroboscopicMap",
    "impact_map",
    "lyapunov_exponents",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
]
