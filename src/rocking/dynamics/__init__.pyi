from .basin_maps import Basins, basin_entropy, basins
from .bifurcation import BifurcationDiagram, bifurcation_diagram
from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum
from .branches import Bifurcation, Branch
from .continuation import continue_orbit
from .exponents import LyapunovExponents, lyapunov_exponents
from .impact_maps import ImpactMap, impact_map
from .linear_bodies import Law, LinearBodies
from .maps import Fate, StroboscopicMap, stroboscopic_map
from .orbit_search import periodic_orbits
from .orbits import PeriodicOrbit
from .simulation import Response, simulate, simulate_many

__all__ = [
    "Basins",
    "Bifurcation",
    "BifurcationDiagram",
    "BouncingBall",
    "Branch",
    "Fate",
    "ImpactMap",
    "ImpactOscillator",
    "InvertedPendulum",
    "Law",
    "LinearBodies",
    "LyapunovExponents",
    "PeriodicOrbit",
    "Response",
    "StroboscopicMap",
    "basin_entropy",
    "basins",
    "bifurcation_diagram",
    "continue_orbit",
    "impact_map",
    "lyapunov_exponents",
    "periodic_orbits",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
]
