from .basin_maps import Basins, basin_entropy, basins
from .bifurcation import BifurcationDiagram, bifurcation_diagram
from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum
from .branches import Bifurcation, Branch
from .comparison import SchemeComparison, SchemeOutcome
from .continuation import continue_orbit
from .exponents import LyapunovExponents, lyapunov_exponents
from .impact_maps import ImpactMap, impact_map
from .linear_bodies import Law, LinearBodies
from .maps import Fate, StroboscopicMap, stroboscopic_map
from .orbit_search import periodic_orbits
from .orbits import PeriodicOrbit
from .schemes import compare_schemes, scheme_of
from .simulation import Response, simulate, simulate_many
from .stepping import MoreauJean, SchatzmanPaoli, SteppedResponse, TimeStepping, integrate

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
    "MoreauJean",
    "PeriodicOrbit",
    "Response",
    "SchatzmanPaoli",
    "SchemeComparison",
    "SchemeOutcome",
    "SteppedResponse",
    "StroboscopicMap",
    "TimeStepping",
    "basin_entropy",
    "basins",
    "bifurcation_diagram",
    "compare_schemes",
    "continue_orbit",
    "impact_map",
    "integrate",
    "lyapunov_exponents",
    "periodic_orbits",
    "scheme_of",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
]
