from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .continuation import Bifurcation, Branch, continue_orbit
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .orbits import PeriodicOrbit, periodic_orbits
from .simulation import Response, simulate, simulate_many

__all__ = [
    "Bifurcation",
    "BouncingBall",
    "Branch",
    "Fate",
    "ImpactMap",
    "ImpactOscillator",
    "InvertedPendulum",
    "Law",
    "LinearBodies",
    "PeriodicOrbit",
    "Response",
    "StroboscopicMap",
    "continue_orbit",
    "impact_map",
    "periodic_orbits",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
]
