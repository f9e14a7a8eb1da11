from .basin_maps import Basins, basins
from .basin_measures import basin_entropy, uncertainty_exponent
from .bifurcation import BifurcationDiagram, bifurcation_diagram
from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .comparison import SchemeComparison, SchemeOutcome
from .continuation import Bifurcation, Branch, continue_orbit
from .erosion import BasinErosion, safe_basin_erosion
from .exponents import LyapunovExponents, lyapunov_exponents
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .orbits import PeriodicOrbit, periodic_orbits
from .schemes import compare_schemes, scheme_of
from .simulation import Response, simulate, simulate_many
from .stepping import MoreauJean, SchatzmanPaoli, SteppedResponse, TimeStepping, integrate

__all__ = [
    "BasinErosion",
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
    "safe_basin_erosion",
    "scheme_of",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
    "uncertainty_exponent",
]
