from .basin_maps import Basins, basin_entropy, basins
from .bifurcation import BifurcationDiagram, bifurcation_diagram
from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .branches import Bifurcation, Branch
from .continuation import continue_orbit
from .exponents import LyapunovExponents, lyapunov_exponents
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .orbits import PeriodicOrbit, periodic_orbits
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
