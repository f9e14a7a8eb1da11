from .basin_maps import Basins, basins
from .basin_measures import basin_entropy, uncertainty_exponent
from .bifurcation import BifurcationDiagram, bifurcation_diagram
from .bodies import BouncingBall, ImpactOscillator, InvertedPendulum, Law, LinearBodies
from .comparison import SchemeComparison, SchemeOutcome
from .erosion import BasinErosion, safe_basin_erosion
from .exponents import LyapunovExponents, lyapunov_exponents
from .maps import Fate, ImpactMap, StroboscopicMap, impact_map, stroboscopic_map
from .schemes import compare_schemes, scheme_of
from .simulation import Response, simulate, simulate_many
from .stepping import MoreauJean, SchatzmanPaoli, SteppedResponse, TimeStepping, integrate

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
    "MoreauJean",
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
    "impact_map",
    "integrate",
    "lyapunov_exponents",
    "safe_basin_erosion",
    "scheme_of",
    "simulate",
    "simulate_many",
    "stroboscopic_map",
    "uncertainty_exponent",
]
