from .basin_maps import Basins, basins
from .basin_measures import basin_entropy, uncertainty_exponent
from .bifurcation import BifurcationDiagram, bifurcation_diagram
from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .erosion import BasinErosion, safe_basin_erosion
from .exponents import LyapunovExponents, lyapunov_exponents
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .simulation import Response, simulate, simulate_many

__all__ = [
    "BasinErosion",
    "Basins",
    "BifurcationDiagram",
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
    "basin_entropy",
    "basins",
    "bifurcation_diagram",
    "impact_map",
    "lyapunov_exponents",
    "safe_basin_erosion",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
    "uncertainty_exponent",
]
